// Keys that work anywhere on the page, and the overlay that lists them with the mouse's ways.

import { showDialog } from "./dialog.js";
import { h } from "./element.js";

const MOUSE = [
  ["Wheel", "zoom at the pointer"],
  ["Drag", "move the picture; with Shift draw a region (with the region tool the other way round)"],
  ["Click", "put the active pin there and show its spectrum"],
  ["Ctrl + click", "pin another pixel beside it"],
  ["Double click on a slider", "its plain value"],
];
const ON_PICTURE = [
  ["← ↑ → ↓", "move the cursor by a pixel, with Shift by ten"],
  ["Enter", "pin it; with Ctrl one more pin"],
  ["M", "begin a region, Enter ends it"],
  ["Esc", "put the cursor away"],
];

/** Whether a key belongs to the field it is typed in: all keys of a text or number, the letters of a menu. */
function isTyped({ target, ctrlKey, metaKey }) {
  if (target.matches("select")) return !ctrlKey && !metaKey;
  return target.matches("input:not([type=range], [type=checkbox])");
}

/** `bindings`: as `shortcuts` gives them. */
export function listenToKeys(bindings) {
  document.addEventListener("keydown", (event) => {
    if (document.querySelector("dialog[open]") || isTyped(event)) return;
    const found = bindings.flatMap(([, , pairs]) => pairs).find(([matches]) => matches(event));
    if (!found) return;
    event.preventDefault();
    found[1]();
  });
}

export function showKeys(bindings) {
  const table = (title, rows) => h("section", {}, h("h3", {}, title), h("table", {}, rows.map(([keys, meaning]) => h("tr", {}, h("th", { scope: "row" }, h("kbd", {}, keys)), h("td", {}, meaning)))));
  showDialog(
    "Keyboard and mouse",
    h("div", { class: "keys" }, table("Anywhere", bindings), h("div", {}, table("Mouse, on the picture", MOUSE), table("Keyboard, on the picture", ON_PICTURE))),
  );
}
