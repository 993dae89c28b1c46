// Keys of every page. The clip that a key is about is the one whose link has the focus, else the page's own.
import { mark } from "./marks.js";
import { playClip } from "./playing.js";

const KEYS = [
  ["/", "to the search box"],
  ["j or →", "the next clip"],
  ["k or ←", "the clip before"],
  ["↓ ↑", "a row further, a row back"],
  ["Enter", "open the clip"],
  ["p", "play the clip here"],
  ["c", "mark the clip for comparison; of two marked, open the comparison with C"],
  ["?", "this list"],
  ["Esc", "close what is open"],
];
const STEPS = { j: 1, ArrowRight: 1, k: -1, ArrowLeft: -1 };
const BUSY = "input, select, textarea, dialog, .motionary-player, .chart";

/** Listen to the keys that `?` lists. */
export function listenToKeys() {
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest?.(BUSY) || document.querySelector("dialog[open]")) return;
    if (answer(event.key)) event.preventDefault();
  });
  document.querySelector("[data-keys]")?.addEventListener("click", showKeys);
}

function answer(key) {
  const links = [...document.querySelectorAll("[data-results] a.clip")];
  const at = links.indexOf(document.activeElement);
  const clip = links[at]?.closest("[data-clip]").dataset.clip ?? document.querySelector("h1[data-clip]")?.dataset.clip;
  if (key === "/") return focusOn(document.querySelector("#q"));
  if (key === "?") return showKeys();
  if (key in STEPS && (key.length === 1 || at >= 0)) return focusOn(links[at < 0 ? 0 : at + STEPS[key]]);
  if ((key === "ArrowDown" || key === "ArrowUp") && at >= 0) return focusOn(inNextRow(links, at, key === "ArrowDown"));
  if (key === "c" && clip) return mark(clip), true;
  if (key === "C") return follow(document.querySelector(".marked [data-compare]"));
  if (key === "p" && clip) return playClip(clip), true;
  return false;
}

/** The clip nearest to being right under one, or over it, in the next row of cards. */
function inNextRow(links, at, down) {
  const place = (link) => link.closest("[data-clip]").getBoundingClientRect();
  const from = place(links[at]);
  const beyond = (down ? links.slice(at + 1) : links.slice(0, at).reverse()).map((link) => [link, place(link)]);
  const row = beyond.find(([, one]) => Math.abs(one.top - from.top) > 4)?.[1].top;
  const inRow = beyond.filter(([, one]) => row !== undefined && Math.abs(one.top - row) <= 4);
  inRow.sort((one, other) => Math.abs(one[1].left - from.left) - Math.abs(other[1].left - from.left));
  return inRow[0]?.[0];
}

function focusOn(element) {
  element?.focus();
  element?.closest("[data-clip]")?.scrollIntoView({ block: "nearest" });
  element?.select?.();
  return Boolean(element);
}

function follow(link) {
  link?.click();
  return Boolean(link);
}

function showKeys() {
  const dialog = document.createElement("dialog");
  dialog.setAttribute("aria-label", "Keyboard");
  const own = document.querySelector("p.keys"); // a page that has keys of its own tells them
  const list = own ? own.cloneNode(true) : listOfKeys();
  const title = document.createElement("h2");
  title.textContent = "Keyboard";
  const close = document.createElement("button");
  close.textContent = "Close";
  close.addEventListener("click", () => dialog.close());
  dialog.append(title, list, close);
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
  return true;
}

function listOfKeys() {
  const list = document.createElement("dl");
  for (const [key, does] of KEYS) {
    const name = document.createElement("dt");
    const shown = document.createElement("kbd");
    const told = document.createElement("dd");
    shown.textContent = key;
    told.textContent = does;
    name.append(shown);
    list.append(name, told);
  }
  return list;
}
