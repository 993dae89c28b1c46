// Clips marked for comparison: two at most, remembered as long as the tab is open.
import { linkTo } from "./playing.js";

const PLACE = "motionary-marked";

/** Show which clips are marked, on their buttons and in a bar at the end of the page. */
export function showMarks() {
  for (const button of document.querySelectorAll("[data-mark]")) {
    button.addEventListener("click", () => mark(button.dataset.mark));
  }
  show();
}

/** Mark a clip, or take its mark away; of three the first loses its own. */
export function mark(clip) {
  const before = marked();
  const now = before.includes(clip) ? before.filter((one) => one !== clip) : [...before, clip].slice(-2);
  sessionStorage.setItem(PLACE, JSON.stringify(now));
  show();
}

function marked() {
  return JSON.parse(sessionStorage.getItem(PLACE) ?? "[]");
}

function show() {
  const clips = marked();
  for (const button of document.querySelectorAll("[data-mark]")) {
    button.setAttribute("aria-pressed", clips.includes(button.dataset.mark));
  }
  document.querySelector(".marked")?.remove();
  if (!clips.length) return;
  const bar = document.createElement("div");
  bar.className = "marked";
  bar.setAttribute("role", "status");
  bar.append("Marked: ", ...clips.flatMap((clip) => [linkTo("/clip", { id: clip }, clip), " "]));
  if (clips.length === 2) {
    bar.append(linkTo("/compare", { a: clips[0], b: clips[1] }, "Compare them"));
    bar.lastChild.dataset.compare = "";
  } else {
    bar.append(linkTo("/search", { with: clips[0] }, "Choose another by a search"));
  }
  const clear = document.createElement("button");
  clear.textContent = "Clear";
  clear.addEventListener("click", () => {
    sessionStorage.removeItem(PLACE);
    show();
  });
  bar.append(clear);
  document.querySelector("main").append(bar);
}
