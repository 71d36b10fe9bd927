// The one store: what is looked at and how. Everything else follows from it, so it can be undone, put into the
// address bar and sent with every request; the server keeps nothing of it.

const UNDO_STEPS = 200;
const LAYOUTS = ["slider", "side", "map"];
const PANELS = ["components", "spectrum", "relight", "save", "info"];

/** The lights and materials of the scene. */
export const UNCHANGED = { lights: {}, materials: {}, concentration: {} };

/** How a source is looked at before anything was changed. */
export function plainView(source) {
  return {
    source,
    relight: UNCHANGED,
    weights: {},
    mode: "colour",
    band: null,
    exposure: null,
    white: null,
    gamut: false,
    range: null,
  };
}

const plainState = (source) => ({
  view: plainView(source),
  other: null, // what it is compared with: {name, source, relight, weights}
  layout: "slider",
  pins: [], // [{region: [x0, y0, x1, y1]}]
  active: 0,
  relative: false,
  panel: "components",
});

const text = JSON.stringify;

export class Store {
  #state;
  #settled; // as it was before the drag that goes on
  #undo = [];
  #redo = [];
  #watchers = [];
  /** Whether a slider is being dragged: coarse pictures will do. */
  live = false;

  constructor(source) {
    this.#state = this.#settled = plainState(source);
  }

  get state() {
    return this.#state;
  }

  get view() {
    return this.#state.view;
  }

  /** Changes a copy of the state. `live`: during a drag, one step of undo in the end; `quiet`: no step at all. */
  change(edit, { live = false, quiet = false } = {}) {
    const draft = structuredClone(this.#state);
    edit(draft);
    this.live = live;
    if (quiet) {
      const settled = structuredClone(this.#settled);
      edit(settled);
      this.#settled = settled;
    } else if (!live && text(draft) !== text(this.#settled)) {
      this.#undo.push(this.#settled);
      if (this.#undo.length > UNDO_STEPS) this.#undo.shift();
      this.#redo = [];
      this.#settled = draft;
    }
    this.#put(draft);
  }

  #put(state) {
    this.#state = state;
    for (const watcher of [...this.#watchers]) watcher();
  }

  #step(from, to) {
    const state = from.pop();
    if (!state) return;
    to.push(this.#settled);
    this.live = false;
    this.#settled = { ...state, panel: this.#state.panel }; // the tab one works in stays
    this.#put(this.#settled);
  }

  undo() {
    this.#step(this.#undo, this.#redo);
  }

  redo() {
    this.#step(this.#redo, this.#undo);
  }

  get canUndo() {
    return this.#undo.length > 0;
  }

  get canRedo() {
    return this.#redo.length > 0;
  }

  /** Calls `react(part)` now and whenever the part of the state that `select` returns has changed. */
  watch(select, react) {
    let before;
    const look = () => {
      const part = select(this.#state);
      const now = text(part) ?? "";
      if (now === before) return;
      before = now;
      react(part);
    };
    this.#watchers.push(look);
    look();
  }

  /** Takes over a state from elsewhere, the address bar, without a step of undo. */
  restore(state) {
    this.live = false;
    this.#settled = state;
    this.#put(state);
  }
}

/** What stands in the address bar: the parts that differ from a plain look at the first source. */
export function hashOf(state, source) {
  const plain = plainState(source);
  const view = Object.fromEntries(Object.entries(state.view).filter(([key, value]) => text(value) !== text(plain.view[key])));
  const rest = Object.entries(state).filter(([key, value]) => key !== "view" && text(value) !== text(plain[key]));
  const parts = { ...(Object.keys(view).length && { view }), ...Object.fromEntries(rest) };
  return Object.keys(parts).length ? `#${encodeURIComponent(text(parts))}` : "";
}

const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);

/** The state that an address tells of; null if it tells of none. Throws if it is not one of ours. */
export function stateOf(hash, sources) {
  if (hash.length < 2) return null;
  const read = JSON.parse(decodeURIComponent(hash.slice(1)));
  const plain = plainState(sources[0].id);
  if (!isObject(read) || (read.view !== undefined && !isObject(read.view))) throw new Error("not a view");
  const known = (parts, like) => Object.fromEntries(Object.entries(parts).filter(([key]) => key in like));
  const state = { ...plain, ...known(read, plain), view: { ...plain.view, ...known(read.view ?? {}, plain.view) } };
  const relight = { ...plain.view.relight, ...state.view.relight };
  state.view = { ...state.view, relight };
  const numbers = (list, count) => Array.isArray(list) && list.length === count && list.every(Number.isFinite);
  const there = (id) => sources.some((source) => source.id === id);
  const sound =
    there(state.view.source) &&
    (state.other === null || there(state.other.source)) &&
    Object.values(relight).every(isObject) &&
    isObject(state.view.weights) &&
    [state.view.band, state.view.range].every((pair) => pair === null || numbers(pair, 2)) &&
    (state.view.exposure === null || state.view.exposure > 0) &&
    LAYOUTS.includes(state.layout) &&
    PANELS.includes(state.panel) &&
    Array.isArray(state.pins) &&
    state.pins.every((pin) => isObject(pin) && numbers(pin.region, 4));
  if (!sound) throw new Error("not a view of these images");
  return state;
}
