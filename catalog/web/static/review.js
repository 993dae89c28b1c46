// The review: decisions by keyboard that do not wait for their publication. The next clip is shown at once; what
// was decided is sent in order behind it, and the line above tells what came of it. A decision that was not made
// stays listed until its clip is decided about.

import { mountAll } from "./player.js";

const desk = document.getElementById("desk");
const said = document.getElementById("said");
const failed = document.getElementById("failed");
const undo = document.getElementById("undo");
const editable = desk.dataset.editable === "yes";

let sending = Promise.resolve();
let waiting = 0;
let last = undo ? JSON.parse(undo.dataset.last) : null;
let shown = 0;
const ahead = new Map(); // pages by URL, fetched before they are asked for

const onward = () => go("after");
const back = () => go("previous");
const KEYS = {
  n: onward, j: onward, ArrowRight: onward, b: back, k: back, ArrowLeft: back,
  a: accept, Enter: accept, s: keep, r: focusLabel, u: takeBack, " ": play, p: play,
};

document.addEventListener("keydown", (event) => {
  if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
  const held = event.target.closest("#label, .motionary-player");
  if (held && event.key === "Escape") return document.activeElement.blur(); // the keys are the page's again
  const busy = event.target.closest("input, textarea, select, dialog, .motionary-player");
  const pressed = event.target.closest("a, button, summary") && ["Enter", " "].includes(event.key);
  const does = KEYS[event.key];
  if (busy || pressed || !does) return;
  event.preventDefault();
  does();
});

document.addEventListener("click", (event) => {
  const link = event.target.closest("#review .ways a");
  if (link && !event.ctrlKey && !event.metaKey && !event.shiftKey) {
    event.preventDefault();
    show(link.getAttribute("href"));
  }
  const does = event.target.closest("[data-does]")?.dataset.does;
  if (does === "accept") accept();
  if (does === "keep") keep();
  if (does === "forget") decide(null);
});

document.addEventListener("submit", (event) => {
  if (event.target.id !== "relabel") return;
  event.preventDefault();
  const label = document.getElementById("label").value.trim();
  if (label) decide(label);
});

undo?.addEventListener("click", takeBack);
addEventListener("popstate", () => show(location.pathname + location.search, false));
addEventListener("beforeunload", (event) => waiting && event.preventDefault());

tellLast();
settle();

// What the keys do.

function accept() {
  const { proposed } = item();
  if (proposed) decide(proposed);
  else tell(editable ? "It has no name to accept; press r and type one." : readOnly());
}

function keep() {
  if (item().name) decide(item().name);
}

function focusLabel() {
  const field = document.getElementById("label");
  if (!field) return tell(readOnly());
  field.focus();
  field.select();
}

function play() {
  const { player } = document.querySelector("#review .motionary-player") ?? {};
  if (player) player.state.playing ? player.pause() : player.play();
}

function decide(label) {
  if (!editable) return tell(readOnly());
  const { clip, waiting: next } = item();
  document.getElementById("item").dataset.decided = "yes";
  send(
    () => post("/edit/relabel", { clip, label }),
    `${clip}: ${label ?? "forgotten"}`,
    (made) => {
      for (const one of failed.querySelectorAll("li")) if (one.dataset.clip === clip) one.remove();
      if (made.before === made.label) return `${clip} was called so already`;
      return made.label === null ? `${clip} has no label of a person's any more` : `${clip} is called ${made.label}`;
    },
    clip,
  );
  document.activeElement?.blur();
  if (next) show(next);
  else refresh();
}

function takeBack() {
  if (!editable) return tell(readOnly());
  send(
    () => {
      if (!last) throw new Error("there is nothing to undo");
      return post("/edit/undo", { edit: last.edit });
    },
    "undo",
    (made) => {
      show(`/review?clip=${encodeURIComponent(made.clip)}`);
      return `undone: ${made.clip} is ${made.label === null ? "without a person's label again" : `${made.label} again`}`;
    },
  );
}

// One after another, so that an undo means the decision before it.

function send(ask, what, done, clip) {
  waiting += 1;
  tell(`${what}; being published…`);
  sending = sending.then(ask).then(
    (made) => told(made.undo, done(made)),
    (error) => {
      told(error.undo, `not done: ${error.message}`);
      if (clip) list(clip, error.message);
    },
  );
}

function told(undoable, text) {
  waiting -= 1;
  if (undoable !== undefined) last = undoable;
  tellLast();
  tell(waiting ? `${text} (${waiting} more to come)` : text);
  ahead.clear(); // what was fetched ahead knows nothing of this
  if (!waiting) refresh().then(() => atTheEnd() && tell(`${text}. Nothing more waits to be decided.`));
}

function atTheEnd() {
  const { decided, waiting: more } = item();
  return editable && decided === "yes" && !more;
}

async function post(url, body) {
  const answer = await fetch(url, {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body), keepalive: true,
  }).catch(() => { throw new Error("the server cannot be reached; is motionary browse still running?"); });
  const given = await answer.json().catch(() => ({ error: `${answer.status} ${answer.statusText}` }));
  if (!answer.ok) throw Object.assign(new Error(given.error), { undo: given.undo });
  return given;
}

function list(clip, why) {
  const line = document.createElement("li");
  const link = document.createElement("a");
  line.dataset.clip = clip;
  link.href = `/review?clip=${encodeURIComponent(clip)}`;
  link.textContent = clip;
  line.append(link, `: ${why}`);
  failed.append(line);
}

function tell(text) {
  said.textContent = text;
}

function tellLast() {
  if (!undo) return;
  undo.hidden = !last;
  if (last) undo.querySelector("bdi").textContent = `${last.clip}: ${last.label ?? "no label"}, was ${last.before ?? "not a person's"}`;
}

function readOnly() {
  return "Read only: to decide here, start it with motionary browse CATALOG --edit.";
}

// Which clip is shown.

function item() {
  return document.getElementById("item")?.dataset ?? {};
}

function go(way) {
  const url = item()[way];
  if (url) show(url);
  else tell(way === "after" ? "This is the last clip of the list." : "This is the first clip of the list.");
}

async function show(url, remember = true) {
  const wanted = ++shown;
  let page;
  try {
    page = await (ahead.get(url) ?? read(url));
  } catch {
    return location.assign(url);
  }
  if (wanted !== shown) return; // another was asked for meanwhile
  if (remember && url !== location.pathname + location.search) history.pushState(null, "", url);
  document.title = page.title;
  document.querySelector("#review .motionary-player")?.player?.destroy();
  document.getElementById("review").replaceWith(document.adoptNode(page.getElementById("review")));
  scrollTo(0, 0);
  settle();
}

/** Show the counts and the name of the clip anew, and leave its player as it is. */
async function refresh() {
  const url = location.pathname + location.search;
  const clip = item().clip;
  const page = await read(url).catch(() => null);
  const now = page?.getElementById("item");
  const old = document.getElementById("item");
  if (!now || !old || item().clip !== clip || now.dataset.clip !== clip || document.activeElement?.id === "label") return;
  Object.assign(old.dataset, now.dataset);
  for (const part of [":scope > .quiet", ".names", ".decide"]) {
    const fresh = now.querySelector(part);
    if (fresh) old.querySelector(part)?.replaceWith(document.adoptNode(fresh));
  }
  if (!ahead.size) fetchAhead();
}

function settle() {
  mountAll(document.getElementById("review"));
  ahead.clear();
  fetchAhead();
}

function fetchAhead() {
  const next = (editable && item().waiting) || item().after;
  if (next) ahead.set(next, read(next).then(warm));
  ahead.get(next)?.catch(() => ahead.delete(next));
}

async function read(url) {
  const answer = await fetch(url, { headers: { Accept: "text/html" } });
  if (!answer.ok) throw new Error(answer.statusText);
  return new DOMParser().parseFromString(await answer.text(), "text/html");
}

/** Have the browser keep the motions of a page that is not shown yet. */
function warm(page) {
  const scene = page.querySelector(".motionary-player")?.dataset.sceneUrl;
  if (scene) fetch(scene).catch(() => {});
  return page;
}
