// The left side: the pictures, what one does on them, and what stands over them while there is nothing to see.

import { Divider } from "./divider.js";
import { h } from "./element.js";
import { listen } from "./gestures.js";
import { clamp } from "./numbers.js";
import { MOST_PINS } from "./colours.js";
import { draw } from "./picture.js";
import { Viewport } from "./viewport.js";

const regionOf = (a, b) => [Math.min(a.x, b.x), Math.min(a.y, b.y), Math.max(a.x, b.x), Math.max(a.y, b.y)];

/** Says "hover" with `detail` the pixel and the side under the cursor, or null; "zoom" when the scale changed. */
export class Stage extends EventTarget {
  #waits = false; // for the next frame of the screen
  #store;
  #frames;
  #viewport = new Viewport();
  #canvas = h("canvas", { id: "picture", tabindex: "0", role: "application", "aria-label": "Picture" });
  #divider = new Divider(() => this.#redraw());
  #prompt = h("div", { class: "prompt", role: "status", hidden: true });
  #cover = h("div", { class: "cover", role: "status", hidden: true });
  #fault = h("div", { class: "fault over-picture", role: "alert", hidden: true });
  #cursor = null; // of the keyboard
  #anchor = null; // where the keyboard began a region
  #draft = null;
  #picking = null;
  #tool = "pan";

  constructor(node, store, frames) {
    super();
    this.#store = store;
    this.#frames = frames;
    node.append(this.#canvas, this.#divider.node, this.#prompt, this.#cover, this.#fault);
    this.#listen();
    new ResizeObserver(() => {
      if (this.#viewport.fitted) this.fit();
      this.#redraw();
    }).observe(this.#canvas);
    let size = "";
    frames.addEventListener("change", () => {
      const before = size;
      if (this.#picture) size = `${this.#picture.width} ${this.#picture.height}`;
      if (this.#viewport.fitted || size !== before) this.fit(); // another image may lie where nobody looks
      this.#fault.textContent = frames.error?.message ?? "";
      this.#fault.hidden = !frames.error;
      this.#redraw();
    });
    frames.addEventListener("detail", () => this.#redraw());
    store.watch(
      ({ pins, active, layout, other }) => [pins, active, layout, other],
      ([, , layout, other]) => {
        this.#divider.node.hidden = !(other && layout === "slider");
        if (this.#viewport.fitted) this.fit();
        this.#redraw();
      },
    );
  }

  get canvas() {
    return this.#canvas;
  }

  get #layout() {
    return this.#store.state.other ? this.#store.state.layout : "single";
  }

  get #size() {
    return { width: this.#canvas.clientWidth, height: this.#canvas.clientHeight };
  }

  /** Of one picture: half of the stage when two are side by side. */
  get #room() {
    const { width, height } = this.#size;
    return { width: this.#layout === "side" ? width / 2 : width, height };
  }

  get #picture() {
    return this.#frames.a?.picture ?? null;
  }

  get scale() {
    return this.#viewport.scale;
  }

  /** "pan" or "region": what a drag does. */
  get tool() {
    return this.#tool;
  }

  set tool(tool) {
    this.#tool = tool;
    this.#canvas.classList.toggle("draws", tool === "region");
    this.dispatchEvent(new Event("tool"));
  }

  fit() {
    if (this.#picture) this.#viewport.fit(this.#picture, this.#room);
    this.#moved();
  }

  actual() {
    if (this.#picture) this.#viewport.actual(this.#picture, this.#room);
    this.#moved();
  }

  zoom(factor) {
    const { width, height } = this.#room;
    this.#viewport.zoom(factor, { x: width / 2, y: height / 2 });
    this.#moved();
  }

  /** Covers the stage by a text, while there is no picture; null uncovers it. */
  cover(...content) {
    this.#cover.replaceChildren(...content.filter(Boolean));
    this.#cover.hidden = this.#cover.childNodes.length === 0;
  }

  /** The next click or region goes to `then` and not to the pins. */
  pick(text, then) {
    this.#picking = then;
    this.#prompt.textContent = `${text} (Esc: cancel)`;
    this.#prompt.hidden = false;
    this.#canvas.classList.add("picks");
    this.#canvas.focus();
  }

  #endPick() {
    this.#picking = null;
    this.#prompt.hidden = true;
    this.#canvas.classList.remove("picks");
  }

  #moved() {
    this.#redraw();
    this.dispatchEvent(new Event("zoom"));
  }

  #redraw() {
    if (this.#waits) return;
    this.#waits = true;
    requestAnimationFrame(() => {
      this.#waits = false;
      this.#look();
      const { pins, active } = this.#store.state;
      draw(this.#canvas, this.#panes(), this.#viewport, { pins, active, draft: this.#draft, cursor: this.#cursor });
    });
  }

  /** Of a large image, asks for what there is to see of the part that is on the screen. */
  #look() {
    if (!this.#picture) return;
    const { width, height } = this.#room;
    const { width: w, height: v } = this.#picture;
    const [from, to] = [this.#viewport.pixel({ x: 0, y: 0 }), this.#viewport.pixel({ x: width, y: height })];
    const region = [clamp(from.x, 0, w - 1), clamp(from.y, 0, v - 1), clamp(to.x, 0, w - 1), clamp(to.y, 0, v - 1)];
    this.#frames.look(region, this.scale * (window.devicePixelRatio || 1));
  }

  #panes() {
    const { width } = this.#size;
    const [a, b] = [this.#picture, this.#frames.b?.picture];
    const at = Math.round(width * (this.#layout === "slider" ? this.#divider.share : 0.5));
    const one = (picture) => [{ picture, left: 0, right: width, shift: 0 }];
    if (this.#layout === "single") return one(a);
    if (this.#layout === "map") return one(this.#frames.difference?.image);
    const shift = this.#layout === "side" ? at : 0;
    return [
      { picture: a, left: 0, right: at, shift: 0 },
      { picture: b, left: at, right: width, shift },
    ];
  }

  /** The pixel under a point of the stage and the picture it is of; null outside. */
  #under(point, within = false) {
    if (!this.#picture) return null;
    const { width } = this.#size;
    const right = this.#layout === "side" && point.x >= width / 2;
    const pixel = this.#viewport.pixel({ x: right ? point.x - width / 2 : point.x, y: point.y });
    const { width: w, height: v } = this.#picture;
    const inside = pixel.x >= 0 && pixel.y >= 0 && pixel.x < w && pixel.y < v;
    if (!inside && !within) return null;
    const ofB = right || (this.#layout === "slider" && point.x >= width * this.#divider.share);
    return { x: clamp(pixel.x, 0, w - 1), y: clamp(pixel.y, 0, v - 1), side: ofB ? "b" : "a" };
  }

  #hover(pixel) {
    this.dispatchEvent(new CustomEvent("hover", { detail: pixel }));
  }

  #chosen(region, { add }) {
    if (this.#picking) {
      const then = this.#picking;
      this.#endPick();
      then(region);
      return;
    }
    this.#store.change((state) => {
      if (state.pins.length === 0 || (add && state.pins.length < MOST_PINS)) {
        state.pins.push({ region });
        state.active = state.pins.length - 1;
      } else state.pins[state.active] = { region };
      state.panel = "spectrum";
    });
  }

  #listen() {
    listen(this.#canvas, {
      drawsRegions: () => this.#tool === "region" && !this.#picking,
      zoom: (factor, point) => {
        const { width } = this.#size;
        const x = this.#layout === "side" && point.x >= width / 2 ? point.x - width / 2 : point.x;
        this.#viewport.zoom(factor, { x, y: point.y });
        this.#moved();
      },
      pan: (dx, dy) => {
        if (this.#picture) this.#viewport.pan(dx, dy, this.#picture, this.#room);
        this.#moved();
      },
      hover: (point) => this.#hover(point && this.#under(point)),
      click: (point, how) => {
        const pixel = this.#under(point);
        if (pixel) this.#chosen(regionOf(pixel, pixel), how);
      },
      drag: (from, to) => {
        const corners = [from, to].map((point) => this.#under(point, true));
        this.#draft = corners[0] && regionOf(...corners);
        this.#redraw();
      },
      region: (from, to, how) => {
        const corners = [from, to].map((point) => this.#under(point, true));
        this.#draft = null;
        if (corners[0]) this.#chosen(regionOf(...corners), how);
        this.#redraw();
      },
      move: (dx, dy) => this.#moveCursor(dx, dy),
      enter: (how) => {
        if (!this.#cursor) return;
        const region = regionOf(this.#anchor ?? this.#cursor, this.#cursor);
        this.#anchor = this.#draft = null;
        this.#chosen(region, how);
        this.#redraw();
      },
      anchor: () => {
        this.#moveCursor(0, 0);
        this.#anchor = this.#cursor;
      },
      cancel: () => {
        this.#endPick();
        this.#cursor = this.#anchor = this.#draft = null;
        this.#hover(null);
        this.#redraw();
      },
    });
    document.addEventListener("keydown", ({ key }) => key === "Escape" && this.#endPick());
    this.#canvas.addEventListener("blur", () => {
      if (!this.#cursor) return;
      this.#cursor = this.#anchor = null;
      this.#hover(null);
      this.#redraw();
    });
  }

  #moveCursor(dx, dy) {
    if (!this.#picture) return;
    const { width, height } = this.#picture;
    const from = this.#cursor ?? { x: Math.floor(width / 2), y: Math.floor(height / 2) };
    this.#cursor = { x: clamp(from.x + dx, 0, width - 1), y: clamp(from.y + dy, 0, height - 1) };
    if (this.#anchor) this.#draft = regionOf(this.#anchor, this.#cursor);
    this.#viewport.reveal(this.#cursor, this.#room);
    this.#hover({ ...this.#cursor, side: "a", byKeyboard: true });
    this.#moved();
  }
}
