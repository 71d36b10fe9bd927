// The pictures on the stage: A, B that it is compared with, and the map of their difference.

import * as api from "./api.js";
import { latest } from "./latest.js";

/**
 * B looks as A does, with its own source, light and weights. `shown`: facts of A's picture, for B is seen at the same
 * exposure; and by an eye adapted to the same light, if B knows nothing of that light.
 */
export function viewOfOther({ view, other }, shown = {}) {
  const { source, relight, weights } = other;
  const white = view.white?.light && source !== view.source ? (shown.white ?? null) : view.white;
  return { ...view, source, relight, weights, white, exposure: shown.exposure ?? view.exposure };
}

async function decoded(address) {
  const image = new Image();
  image.src = address;
  await image.decode();
  return image;
}

/** Says "change" when there is something new to draw, "work" when it begins or ends asking. */
export class Frames extends EventTarget {
  a = null; // {bitmap, facts, source, mode}
  b = null;
  difference = null; // {image, facts}
  error = null; // the server's words on what could not be drawn
  working = false;
  #keys = {};
  #about;
  #store;
  #ask = latest(() => this.#update());

  constructor(store, about) {
    super();
    this.#store = store;
    this.#about = about;
    about.addEventListener("change", () => this.refresh()); // its pictures may be worth asking again
    store.watch(
      ({ view, other }) => [view, other, store.live],
      () => this.refresh(),
    );
  }

  refresh() {
    return this.#ask();
  }

  #tell(what) {
    this.dispatchEvent(new Event(what));
  }

  async #update() {
    const { state, live } = this.#store;
    if (!this.#about.ready(state.view.source)) return;
    this.working = true;
    this.#tell("work");
    try {
      await this.#picture("a", { ...state.view, coarse: live });
      if (state.other && this.#about.ready(state.other.source)) {
        const { facts } = this.a; // automatic exposures would hide that B is darker
        await this.#picture("b", { ...viewOfOther(state, facts), range: facts.range ?? state.view.range, coarse: live });
        if (!live) await this.#map(state);
      } else if (this.b) {
        this.b = this.difference = null;
        this.#keys = { a: this.#keys.a };
        this.#tell("change");
      }
      if (this.error) this.#fail(null);
    } catch (error) {
      this.#fail(error);
    } finally {
      this.working = false;
      this.#tell("work");
    }
  }

  #fail(error) {
    this.error = error;
    this.#tell("change");
  }

  #isNew(name, ...views) {
    const key = JSON.stringify([views, views.map((view) => this.#about.generation(view.source))]);
    return this.#keys[name] === key ? null : key;
  }

  async #picture(name, view) {
    const key = this.#isNew(name, view);
    if (!key) return;
    const { source, mode } = view;
    try {
      const answer = await api.picture(view);
      this[name]?.bitmap.close();
      this[name] = { ...answer, source, mode };
    } catch (error) {
      const old = this[name];
      if (old && (old.source !== source || old.mode !== mode)) this[name] = this.#keys[name] = null; // it shows something else
      throw error;
    }
    this.#keys[name] = key;
    this.#tell("change");
  }

  async #map(state) {
    const views = [state.view, state.other].map(({ source, relight, weights }) => ({ source, relight, weights }));
    const key = this.#isNew("difference", ...views);
    if (!key) return;
    try {
      const facts = await api.compare(...views);
      this.difference = { image: await decoded(facts.png), facts };
    } catch (error) {
      // pictures of two sizes can still be looked at side by side
      if (!(error instanceof api.Refused)) throw error;
      this.difference = { image: null, facts: { error: error.message } };
    }
    this.#keys.difference = key;
    this.#tell("change");
  }
}
