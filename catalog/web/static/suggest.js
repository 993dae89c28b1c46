// Clips suggested while one types, as a combobox: arrows choose, Enter takes, Escape closes.
import { dataOf } from "./playing.js";

const PAUSE = 150;
let lists = 0;

/** Suggest clips for an input; one taken is opened, or written into it where the page asks for a clip. */
export function suggestFor(input) {
  const list = document.createElement("ul");
  list.className = "options";
  list.id = `options-${(lists += 1)}`;
  list.setAttribute("role", "listbox");
  list.setAttribute("aria-label", "Clips");
  list.hidden = true;
  document.body.append(list);
  input.setAttribute("role", "combobox");
  input.setAttribute("aria-autocomplete", "list");
  input.setAttribute("aria-controls", list.id);
  input.setAttribute("aria-expanded", "false");
  let waiting, asking, at = -1;

  const close = () => {
    list.hidden = true;
    at = -1;
    input.setAttribute("aria-expanded", "false");
    input.removeAttribute("aria-activedescendant");
  };
  const take = (clip) => {
    close();
    if (input.dataset.suggest === "clips") input.value = clip;
    else location.assign(`/clip?${new URLSearchParams({ id: clip })}`);
  };
  const choose = (index) => {
    at = (index + list.children.length) % list.children.length;
    [...list.children].forEach((one, place) => one.setAttribute("aria-selected", place === at));
    list.children[at].scrollIntoView({ block: "nearest" });
    input.setAttribute("aria-activedescendant", list.children[at].id);
  };
  const ask = async () => {
    asking?.abort();
    if (!input.value.trim()) return close();
    asking = new AbortController();
    const { clips } = await dataOf("/data/search", { q: input.value }, { signal: asking.signal });
    if (!clips.length || document.activeElement !== input) return close();
    list.replaceChildren(...clips.map((clip, index) => option(clip, `${list.id}-${index}`, take)));
    const { left, bottom, width } = input.getBoundingClientRect();
    const place = { left: left + scrollX, top: bottom + scrollY + 2, minWidth: width };
    for (const [side, pixels] of Object.entries(place)) list.style[side] = `${pixels}px`;
    list.hidden = false;
    at = -1;
    input.setAttribute("aria-expanded", "true");
  };
  input.addEventListener("input", () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => ask().catch(close), PAUSE);
  });
  input.addEventListener("keydown", (event) => {
    if (list.hidden) return;
    if (event.key === "ArrowDown") choose(at + 1);
    else if (event.key === "ArrowUp") choose(at < 0 ? -1 : at - 1);
    else if (event.key === "Enter" && at >= 0) take(list.children[at].textContent);
    else if (event.key === "Escape") close();
    else return;
    event.preventDefault();
  });
  input.addEventListener("blur", close);
}

function option(clip, id, take) {
  const item = document.createElement("li");
  item.id = id;
  item.setAttribute("role", "option");
  item.setAttribute("aria-selected", "false");
  const name = document.createElement("bdi");
  name.textContent = clip;
  item.append(name);
  // mousedown, for the input's blur would close the list before a click came
  item.addEventListener("mousedown", (event) => {
    event.preventDefault();
    take(clip);
  });
  return item;
}
