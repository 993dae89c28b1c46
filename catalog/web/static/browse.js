// What the pages do beyond being read: playing, charts, suggestions, marks for comparison, the keyboard. Without it
// every page can still be read. Data comes from attributes and from /data/..., never from script in a page.
import { drawCharts } from "./charts.js";
import { listenToKeys } from "./keyboard.js";
import { showMarks } from "./marks.js";
import { mountAll } from "./player.js";
import { playClip } from "./playing.js";
import { suggestFor } from "./suggest.js";

document.documentElement.classList.add("scripted");
mountAll();
drawCharts();
showMarks();
listenToKeys();
for (const input of document.querySelectorAll("input[data-suggest]")) suggestFor(input);
for (const button of document.querySelectorAll("[data-play]")) {
  button.addEventListener("click", () => playClip(button.dataset.play));
}
