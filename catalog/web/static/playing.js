// A clip played over the page, wherever it is named.
import { createPlayer } from "./player.js";

/** Play a clip in a dialog, with the way to its own page. */
export async function playClip(clip) {
  const dialog = document.createElement("dialog");
  dialog.className = "playing";
  dialog.setAttribute("aria-label", "Player");
  const title = document.createElement("h2");
  title.append(linkTo("/clip", { id: clip }, clip));
  const close = document.createElement("button");
  close.textContent = "Close";
  close.addEventListener("click", () => dialog.close());
  const head = document.createElement("header");
  head.append(title, close);
  const stage = document.createElement("div");
  dialog.append(head, stage);
  document.body.append(dialog);
  let player;
  dialog.addEventListener("close", () => {
    player?.destroy();
    dialog.remove();
  });
  dialog.showModal();
  close.focus();
  try {
    const scene = await dataOf("/data/scene", { clip });
    if (!dialog.open) return;
    player = createPlayer(stage, scene, { autoplay: true });
    player.canvas.focus(); // whose keys are meant now; Esc closes
  } catch (error) {
    stage.textContent = error.message;
  }
}

/** Fetch JSON of this snapshot; what cannot be had raises, with the server's words. */
export async function dataOf(path, query, options = {}) {
  const url = new URL(path, location.href);
  for (const [name, value] of Object.entries({ ...query, of: document.body.dataset.edition })) {
    url.searchParams.set(name, value);
  }
  const answer = await fetch(url, options);
  const data = await answer.json().catch(() => ({ error: `${answer.status} ${answer.statusText}` }));
  if (!answer.ok) throw new Error(data.error);
  return data;
}

/** A link to a page; the text is shown as it is, in whichever direction it runs. */
export function linkTo(path, query, text) {
  const link = document.createElement("a");
  link.href = `${path}?${new URLSearchParams(query)}`;
  const name = document.createElement("bdi");
  name.textContent = text;
  link.append(name);
  return link;
}
