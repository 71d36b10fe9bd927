// The pictures on the stage: A, B that it is compared with, and the map of their difference.

import * as api from "./api.js";
import { latest } from "./latest.js";
import { Shown } from "./shown.js";

const REST = 150; // ms that a picture must not move before its details are asked for

/**
 * B looks as A does, with its own source, light and weights. `shown`: facts of A's picture, for B is seen at the same
 * exposure; and by an eye adapted to the same light, if B knows nothing of that light.
 */
export function viewOfOther({ view, other }, shown = {}) {
  const { source, relight, weights } = other;
  const white = view.white?.light && source !== view.source ? (shown.white ?? null) : view.white;
  return { ...view, source, relight, weights, white, exposure: shown.exposure ?? view.exposure };
}

async function decoded(address, { width, height }) {
  const image = new Image();
  image.src = address;
  await image.decode();
  return new Shown(await createImageBitmap(image), [width, height]);
}

/** Says "change" when there is something new to draw, "work" when it begins or ends asking. */
export class Frames extends EventTarget {
  a = null; // {picture, facts, source, mode, view}
  b = null;
  difference = null; // {image, facts}
  error = null; // the server's words on what could not be drawn
  working = false;
  #keys = {};
  #about;
  #store;
  #ask = latest(() => this.#update());
  #rest = null; // timer
  #detail = latest((region, scale) => this.#details(region, scale));

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
      this[name]?.picture.close();
      this[name] = { ...answer, source, mode, view };
    } catch (error) {
      const old = this[name];
      if (old && (old.source !== source || old.mode !== mode)) this[name] = this.#keys[name] = null; // it shows something else
      throw error;
    }
    this.#keys[name] = key;
    this.#tell("change");
  }

  /** The stage shows this region of the picture at this scale. */
  look(region, scale) {
    clearTimeout(this.#rest);
    if (this.#lacking(region, scale).length) this.#rest = setTimeout(() => this.#detail(region, scale), REST);
  }

  #lacking(region, scale) {
    return [this.a, this.b].filter((frame) => frame && !frame.view.coarse && !frame.picture.covers(region, scale));
  }

  async #details(region, scale) {
    for (const frame of this.#lacking(region, scale)) {
      const { picture, facts, view } = frame;
      const window = picture.within(region);
      try {
        // as bright, or coloured, as the whole
        const part = await api.picture({ ...view, window, exposure: facts.exposure ?? view.exposure, range: facts.range ?? view.range });
        picture.detail?.bitmap.close();
        picture.detail = { bitmap: part.picture.bitmap, region: window };
      } catch (error) {
        if (!(error instanceof api.Refused)) throw error; // there is the whole, less sharp
        return;
      }
    }
    this.#tell("detail");
  }

  async #map(state) {
    const views = [state.view, state.other].map(({ source, relight, weights }) => ({ source, relight, weights }));
    const key = this.#isNew("difference", ...views);
    if (!key) return;
    try {
      const facts = await api.compare(...views);
      this.difference = { image: await decoded(facts.png, this.a.picture), facts };
    } catch (error) {
      // pictures of two sizes can still be looked at side by side
      if (!(error instanceof api.Refused)) throw error;
      this.difference = { image: null, facts: { error: error.message } };
    }
    this.#keys.difference = key;
    this.#tell("change");
  }
}
