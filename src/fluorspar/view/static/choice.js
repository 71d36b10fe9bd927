// A row of buttons of which one is pressed.

import { h } from "./element.js";

/** `options`: [[value, label, title]]; `react(value)`. */
export function choice(label, options, react) {
  const buttons = options.map(([value, text, title]) => {
    const button = h("button", { type: "button", role: "radio", title, "data-value": value, click: () => react(value) }, text);
    return [value, button];
  });
  const node = h("div", { class: "choice", role: "radiogroup", "aria-label": label }, buttons.map(([, button]) => button));
  node.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    const able = buttons.filter(([, button]) => !button.disabled);
    const now = able.findIndex(([, button]) => button === document.activeElement);
    const [value, next] = able[(now + by + able.length) % able.length];
    next.focus();
    react(value);
  });
  return {
    node,
    put(value) {
      for (const [of, button] of buttons) {
        button.ariaChecked = `${of === value}`;
        button.tabIndex = of === value ? 0 : -1;
      }
    },
    /** `why`: why an option is not available; "" if it is. */
    allow(value, why) {
      const [, button] = buttons.find(([of]) => of === value);
      const title = options.find(([of]) => of === value)[2];
      button.disabled = Boolean(why);
      button.title = why || title || "";
    },
  };
}
