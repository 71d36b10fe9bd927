// The library of materials as a list of swatches that can be searched; the picture follows the arrow keys.

import { freshId, h, swatch } from "./element.js";

/** `materials`: [{value, name, description, srgb, fluorescent}]; `react(value)`. */
export function materialList(label, react) {
  const search = h("input", { type: "search", placeholder: "Search materials", "aria-label": `Search materials for ${label}` });
  const id = freshId();
  const list = h("div", { class: "materials", role: "listbox", id, tabindex: "0", "aria-label": `Materials for ${label}` });
  const node = h("div", { class: "material-list" }, search, list);
  let options = [];
  let chosen;

  const visible = () => options.filter(({ item }) => !item.hidden);
  function filter() {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const { item, text } of options) item.hidden = !words.every((word) => text.includes(word));
  }
  function choose(option) {
    if (option) react(option.value);
  }
  search.addEventListener("input", filter);
  search.addEventListener("keydown", (event) => {
    if (event.key === "Enter" || event.key === "ArrowDown") {
      event.preventDefault();
      choose(visible()[0]);
      list.focus();
    }
  });
  list.addEventListener("keydown", (event) => {
    const by = { ArrowUp: -1, ArrowDown: 1, Home: -1e6, End: 1e6 }[event.key];
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    const seen = visible();
    const now = seen.findIndex(({ value }) => value === chosen);
    choose(seen[Math.min(seen.length - 1, Math.max(0, now + by))]);
  });

  return {
    node,
    fill(materials) {
      options = materials.map(({ value, name, description = "", srgb, fluorescent }) => {
        const mark = fluorescent ? h("span", { class: "mark", title: "Fluorescent" }, "fluor.") : null;
        const item = h("div", { role: "option", id: freshId(), class: "material", title: description, "data-value": value ?? "", click: () => react(value) }, swatch(srgb), h("span", { class: "name" }, name), mark);
        return { value, item, text: `${name} ${description} ${fluorescent ? "fluorescent" : ""}`.toLowerCase() };
      });
      list.replaceChildren(...options.map(({ item }) => item));
      filter();
    },
    put(value) {
      chosen = value;
      for (const { value: of, item } of options) {
        const is = of === value;
        item.ariaSelected = `${is}`;
        if (!is) continue;
        list.setAttribute("aria-activedescendant", item.id);
        // by hand: scrollIntoView would scroll the panel as well
        if (item.offsetTop < list.scrollTop) list.scrollTop = item.offsetTop;
        else if (item.offsetTop + item.offsetHeight > list.scrollTop + list.clientHeight) list.scrollTop = item.offsetTop + item.offsetHeight - list.clientHeight;
      }
    },
  };
}
