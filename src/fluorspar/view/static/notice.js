// A line for what the server says of a part of the page, beside that part.

import { h } from "./element.js";

export function notice() {
  const node = h("p", { class: "fault", role: "alert", hidden: true });
  return {
    node,
    say(text) {
      node.textContent = text ?? "";
      node.hidden = !text;
    },
    /** Runs work; if it fails, says why, and gives null. */
    async of(work) {
      try {
        const result = await work();
        this.say("");
        return result;
      } catch (error) {
        this.say(error.message);
        return null;
      }
    },
  };
}
