// A small plot in SVG: wavelengths across, values up; areas and lines; a reading under the pointer.

import { freshId, svg } from "./element.js";
import { clamp, shown, ticks } from "./numbers.js";

const SPACE = { left: 46, right: 14, top: 16, bottom: 19 };

export class Plot {
  node;
  #width;
  #height;
  #label;
  #content = svg("g");
  #reading = svg("text", { class: "reading", "text-anchor": "end" });
  #ruler = svg("line", { class: "ruler", visibility: "hidden" });
  #clip = freshId();
  #x = [400, 700];
  #read = null;

  constructor({ width, height, label }) {
    [this.#width, this.#height, this.#label] = [width, height, label];
    this.node = svg("svg", { class: "plot", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
    const { left, top } = SPACE;
    const inner = svg("rect", { x: left, y: top, width: width - left - SPACE.right, height: height - top - SPACE.bottom });
    this.node.append(svg("clipPath", { id: this.#clip }, inner), this.#content, this.#ruler, this.#reading);
    this.#reading.setAttribute("x", width - SPACE.right);
    this.#reading.setAttribute("y", 11);
    this.node.addEventListener("pointermove", (event) => this.#follow(event));
    this.node.addEventListener("pointerleave", () => this.#unread());
  }

  /**
   * Draws layers: {x, y, colour, width, dash} is a line, {x, low, high, colour, opacity} an area, {from, to, colour} a
   * span of wavelengths; x in nm. `read(nm)` gives the text that is shown while the pointer is at a wavelength.
   */
  draw({ x, y, unit = "", layers, read = null, label = this.#label }) {
    [this.#x, this.#read] = [x, read];
    const { left, right, top, bottom } = SPACE;
    const [width, height] = [this.#width, this.#height];
    const across = (nm) => left + ((nm - x[0]) / (x[1] - x[0] || 1)) * (width - left - right);
    const up = (value) => height - bottom - ((value - y[0]) / (y[1] - y[0] || 1)) * (height - top - bottom);
    const round = (number) => Math.round(number * 10) / 10;
    const points = (xs, ys) => xs.map((nm, i) => `${round(across(nm))},${round(clamp(up(ys[i]), -1e4, 1e4))}`);
    const axes = svg("g", { class: "axes" });
    for (const nm of ticks(x[0], x[1], 7)) {
      axes.append(svg("line", { x1: across(nm), x2: across(nm), y1: top, y2: height - bottom }));
      axes.append(svg("text", { x: across(nm), y: height - bottom + 13, "text-anchor": "middle" }, axes.querySelector("text") ? `${nm}` : `${nm} nm`));
    }
    for (const value of ticks(y[0], y[1], 5)) {
      axes.append(svg("line", { x1: left, x2: width - right, y1: up(value), y2: up(value) }));
      axes.append(svg("text", { x: left - 4, y: up(value) + 3.5, "text-anchor": "end" }, shown(value, 3)));
    }
    axes.append(svg("text", { class: "unit", x: left, y: 10 }, unit));
    const inside = svg("g", { "clip-path": `url(#${this.#clip})` });
    for (const layer of layers) {
      if (layer.low) {
        const outline = [...points(layer.x, layer.high), ...points(layer.x, layer.low).reverse()].join(" ");
        inside.append(svg("polygon", { points: outline, fill: layer.colour, "fill-opacity": layer.opacity ?? 1 }));
      } else if (layer.y) {
        inside.append(
          svg("polyline", {
            points: points(layer.x, layer.y).join(" "), fill: "none", stroke: layer.colour,
            "stroke-width": layer.width ?? 1.5, "stroke-dasharray": layer.dash ?? null, "stroke-linejoin": "round",
          }),
        );
      } else {
        const box = { x: across(layer.from), width: Math.max(1, across(layer.to) - across(layer.from)) };
        inside.append(svg("rect", { ...box, y: top, height: height - top - bottom, fill: layer.colour, "fill-opacity": layer.opacity ?? 0.15 }));
      }
    }
    this.#content.replaceChildren(axes, inside);
    this.node.setAttribute("aria-label", label);
    this.#unread();
  }

  #follow(event) {
    const box = this.node.getBoundingClientRect();
    const place = ((event.clientX - box.left) / box.width) * this.#width;
    const { left, right, top, bottom } = SPACE;
    const part = (place - left) / (this.#width - left - right);
    if (!this.#read || part < 0 || part > 1) {
      this.#unread();
      return;
    }
    for (const [name, value] of Object.entries({ x1: place, x2: place, y1: top, y2: this.#height - bottom, visibility: "visible" }))
      this.#ruler.setAttribute(name, value);
    this.#reading.textContent = this.#read(this.#x[0] + part * (this.#x[1] - this.#x[0]));
  }

  #unread() {
    this.#ruler.setAttribute("visibility", "hidden");
    this.#reading.textContent = "";
  }
}

/** A curve alone, without axes, to tell one spectrum from another. */
export function sparkline(width, height) {
  const line = svg("polyline", { fill: "none", stroke: "currentColor", "stroke-width": 1.5 });
  const node = svg("svg", { class: "sparkline", viewBox: `0 0 ${width} ${height}`, width, height, "aria-hidden": "true" }, line);
  return {
    node,
    put({ wavelengths = [], values = [] }) {
      const most = Math.max(...values, 0) || 1;
      const [first, last] = [wavelengths[0], wavelengths.at(-1)];
      const at = (nm, i) => `${(((nm - first) / (last - first || 1)) * width).toFixed(1)},${(height - 2 - (values[i] / most) * (height - 4)).toFixed(1)}`;
      line.setAttribute("points", wavelengths.map(at).join(" "));
    },
  };
}
