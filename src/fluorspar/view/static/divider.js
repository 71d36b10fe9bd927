// The line between two pictures: dragged, or moved with the arrow keys.

import { h } from "./element.js";
import { clamp } from "./numbers.js";

/** `react()` when it moved; `share` is where it stands, from 0 to 1. */
export class Divider {
  node = h("div", { class: "split", role: "slider", tabindex: "0", "aria-label": "Divide between A and B", "aria-valuemin": "0", "aria-valuemax": "100", hidden: true });
  share = 0.5;
  #react;

  constructor(react) {
    this.#react = react;
    this.#put(0.5);
    const { node } = this;
    node.addEventListener("pointerdown", (event) => node.setPointerCapture(event.pointerId));
    node.addEventListener("pointermove", (event) => {
      if (!node.hasPointerCapture(event.pointerId)) return;
      const box = node.parentElement.getBoundingClientRect();
      this.#move((event.clientX - box.left) / box.width);
    });
    node.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[event.key];
      if (!by) return;
      event.preventDefault();
      event.stopPropagation();
      this.#move(this.share + by);
    });
  }

  #put(share) {
    this.share = clamp(share, 0.02, 0.98);
    this.node.style.left = `${this.share * 100}%`;
    this.node.setAttribute("aria-valuenow", Math.round(this.share * 100));
  }

  #move(share) {
    this.#put(share);
    this.#react();
  }
}
