// What the server has: its sources and its library. Looked up again when a source was refined.

import * as api from "./api.js";

const EVERY = 500; // ms, while something goes on
const RETRY = 2000; // ms, while nobody answers

/** Says "change" when sources are new or were refined, "progress" when one got on. */
export class About extends EventTarget {
  sources = [];
  library = { illuminants: [], materials: [] };
  colour_maps = {}; // by mode: {name, stops}
  version = "";
  #timer = null;

  constructor() {
    super();
    api.contact.addEventListener("gone", () => this.#later(RETRY));
    api.contact.addEventListener("back", () => this.load().catch(() => this.#later(RETRY)));
  }

  source(id) {
    return this.sources.find((source) => source.id === id) ?? this.sources[0] ?? {};
  }

  /** What to call a source: its file's name, with the folder only where two have the same name. */
  title(id) {
    const { name = "" } = this.source(id);
    const short = (full) => full.replace(/^.*[\\/]/, "");
    const alone = this.sources.filter((source) => short(source.name) === short(name)).length < 2;
    return alone ? short(name) : name;
  }

  /** Whether there is something to see: a scene shows nothing before its first samples are traced. */
  ready(id) {
    const { kind, generation } = this.source(id);
    return kind !== "scene" || generation > 0;
  }

  generation(id) {
    return this.source(id).generation ?? 0;
  }

  async load() {
    Object.assign(this, await api.about());
    this.dispatchEvent(new Event("change"));
    this.#follow();
  }

  #later(delay) {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#poll(), delay);
  }

  #follow() {
    this.dispatchEvent(new Event("progress"));
    if (this.sources.some(({ progress }) => progress)) this.#later(EVERY);
  }

  async #poll() {
    let states;
    try {
      states = await api.progress();
    } catch {
      this.#later(RETRY);
      return;
    }
    const grown = states.some(({ id, generation }) => generation !== this.generation(id));
    const ended = states.some(({ id, progress }) => !progress && this.source(id).progress);
    for (const { id, ...state } of states) Object.assign(this.source(id), state);
    if (grown || ended) await this.load().catch(() => this.#later(RETRY));
    else this.#follow();
  }
}
