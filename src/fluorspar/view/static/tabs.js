// The panel on the right: tabs, of which one is open.

import { freshId, h } from "./element.js";

/** `tabs`: [[name, label]]; returns {node, pages: {name: element}}. */
export function tabs(store, labels) {
  const pages = {};
  const buttons = labels.map(([name, label]) => {
    const [tab, page] = [freshId(), freshId()];
    const open = () => store.change((state) => (state.panel = name), { quiet: true });
    pages[name] = h("div", { class: "page", id: page, role: "tabpanel", "aria-labelledby": tab });
    return [name, h("button", { type: "button", role: "tab", id: tab, "aria-controls": page, click: open }, label)];
  });
  const list = h("div", { class: "tabs", role: "tablist", "aria-label": "Panel" }, buttons.map(([, button]) => button));
  function step(by) {
    const able = buttons.filter(([, button]) => !button.hidden);
    const now = able.findIndex(([name]) => name === store.state.panel);
    const [, next] = able[(now + by + able.length) % able.length];
    next.focus();
    next.click();
  }
  list.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    step(by);
  });
  store.watch(
    ({ panel }) => panel,
    (panel) => {
      for (const [name, button] of buttons) {
        button.ariaSelected = `${name === panel}`;
        button.tabIndex = name === panel ? 0 : -1;
        pages[name].hidden = name !== panel;
      }
    },
  );
  return {
    nodes: [list, ...Object.values(pages)],
    pages,
    step,
    /** Marks a tab, for there is something to read. */
    mark(name, is) {
      buttons.find(([of]) => of === name)[1].classList.toggle("marked", is);
    },
    show(name, is) {
      buttons.find(([of]) => of === name)[1].hidden = !is;
      if (!is && store.state.panel === name) store.change((state) => (state.panel = "components"), { quiet: true });
    },
  };
}
