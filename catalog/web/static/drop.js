// A file that is dropped on the page, or chosen: sent as it is, and shown as the server tells of it.

import { mountAll } from "./player.js";

const form = document.getElementById("drop");
const largest = Number(form.dataset.largest);
const chosen = document.getElementById("files");
const told = document.getElementById("told");
const found = document.getElementById("found");
let asked = 0;
let under = null;

chosen.addEventListener("change", () => look([...chosen.files]));
form.addEventListener("submit", (event) => event.preventDefault());

// Anywhere on the page: a file that misses the field would otherwise replace the page.
for (const name of ["dragenter", "dragover"]) {
  addEventListener(name, (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    form.classList.add("over");
  });
}
addEventListener("dragleave", (event) => event.relatedTarget ?? form.classList.remove("over"));
addEventListener("drop", (event) => {
  form.classList.remove("over");
  if (!event.dataTransfer?.types.includes("Files")) return;
  event.preventDefault();
  look([...event.dataTransfer.files]);
});

found.addEventListener("click", async ({ target }) => {
  const button = target.closest("[data-beside]");
  if (!button) return;
  for (const one of found.querySelectorAll("[data-beside]")) one.setAttribute("aria-pressed", String(one === button));
  const shown = found.querySelector(".motionary-player");
  const scene = JSON.parse(document.getElementById(shown.dataset.scene).textContent);
  const answer = await fetch(button.dataset.beside).catch(() => null);
  if (!answer?.ok) return tell("That clip cannot be read now.");
  shown.player.load({ ...scene, figures: [scene.figures[0], await answer.json()] });
  shown.scrollIntoView({ block: "nearest" });
});

async function look(files) {
  if (!files.length) return;
  const size = files.reduce((sum, file) => sum + file.size, 0);
  if (size > largest) {
    return tell(`${(size / 1e6).toFixed(1)} MB were given, and ${(largest / 1e6).toFixed(0)} MB are looked at.`);
  }
  const mine = ++asked;
  under?.abort();
  under = new AbortController();
  tell(`Looking at ${files.map((file) => file.name).join(" and ")}…`);
  let page;
  try {
    page = await sent(files, under.signal);
  } catch (error) {
    if (mine === asked) tell(`It could not be sent: ${error.message}`);
    return;
  }
  if (mine !== asked) return; // another file came meanwhile
  found.querySelector(".motionary-player")?.player?.destroy();
  found.replaceChildren(...document.adoptNode(page.body).childNodes);
  tell("");
  mountAll(found);
  found.focus();
}

async function sent(files, signal) {
  const listed = files.map(({ name, size }) => ({ name, size }));
  const answer = await fetch("/drop", {
    method: "POST",
    body: new Blob(files),
    headers: {
      "Content-Type": "application/octet-stream",
      "X-Motionary-Files": encodeURIComponent(JSON.stringify(listed)),
    },
    signal,
  });
  const text = await answer.text();
  if (!answer.headers.get("content-type")?.startsWith("text/html")) throw new Error(text);
  return new DOMParser().parseFromString(text, "text/html");
}

function tell(text) {
  told.textContent = text;
}
