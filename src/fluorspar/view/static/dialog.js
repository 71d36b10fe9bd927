// A window over the page: title, content, a button that closes it. Escape and a click beside it close it too.

import { freshId, h } from "./element.js";

export function showDialog(title, ...content) {
  const id = freshId();
  const dialog = h("dialog", { "aria-labelledby": id });
  const close = h("button", { type: "button", class: "plain", "aria-label": "Close", click: () => dialog.close() }, "✕");
  dialog.append(h("header", {}, h("h2", { id }, title), close), h("div", { class: "dialog-content" }, ...content));
  dialog.addEventListener("close", () => dialog.remove());
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  document.body.append(dialog);
  dialog.showModal();
  return dialog;
}
