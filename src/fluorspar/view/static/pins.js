// The spectra of the pins: asked once for each view and region, kept until the view changes.

import * as api from "./api.js";
import { viewOfOther } from "./frames.js";

const KEPT = 200;

/** What of a view changes the spectrum of a region; the rest is display. */
function asked(view) {
  const { source, relight, weights, exposure, white } = view;
  return { source, relight, weights, exposure, white };
}

export class PinSpectra {
  #kept = new Map();
  #generation;

  constructor(generation) {
    this.#generation = generation;
  }

  async #one(view, region, reference) {
    const question = [asked(view), region, reference, this.#generation(view.source)];
    const key = JSON.stringify(question);
    if (!this.#kept.has(key)) {
      const answer = await api.spectrum(question[0], region, reference);
      if (this.#kept.size >= KEPT) this.#kept.delete(this.#kept.keys().next().value);
      this.#kept.set(key, answer);
    }
    return this.#kept.get(key);
  }

  /** {a: [answer for each pin], b: answer of the active pin in the image compared with, or null}; `shown`: see `viewOfOther`. */
  async all(state, shown) {
    const { view, pins, active, relative, other } = state;
    const reference = relative ? pins[0].region : null;
    const a = [];
    for (const { region } of pins) a.push(await this.#one(view, region, reference));
    const b = other && pins[active] ? await this.#one(viewOfOther(state, shown), pins[active].region, null) : null;
    return { a, b };
  }
}

/** "12, 40" or "12–20, 40–48": the pixels of a region, first across, then down. */
export function pixelsOf([x0, y0, x1, y1]) {
  const part = (from, to) => (from === to ? `${from}` : `${from}–${to}`);
  return `${part(x0, x1)}, ${part(y0, y1)}`;
}
