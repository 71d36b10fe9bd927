// A spectrum drawn by hand: knots every 10 nm, painted with the pointer or moved with the arrow keys.

import { h, svg } from "./element.js";
import { at, clamp, ticks } from "./numbers.js";

const STEP = 10;
const [WIDTH, HEIGHT] = [348, 130];
const SPACE = { left: 14, right: 14, top: 6, bottom: 18 };

/** Knots of a spectrum that is given on its own wavelengths, its greatest value 1. */
export function knotsOf({ wavelengths, values }, low, high) {
  const most = Math.max(...values) || 1;
  const knots = [];
  for (let nm = Math.floor(low / STEP) * STEP; nm <= high; nm += STEP)
    knots.push([nm, Math.round((1000 * at(wavelengths, values, nm)) / most) / 1000]);
  return knots;
}

/** `react(knots, live)`, knots being [[nm, 0 to 1], ...]. */
export function drawnCurve(react) {
  let knots = [];
  let held = 0; // the knot that the keyboard moves
  const area = svg("polygon", { class: "drawn-area" });
  const line = svg("polyline", { class: "drawn-line" });
  const dot = svg("circle", { class: "drawn-knot", r: 4 });
  const axis = svg("g", { class: "axes" });
  const pad = svg("svg", { class: "drawn", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, tabindex: "0", role: "slider", "aria-label": "Drawn spectrum", "aria-valuemin": 0, "aria-valuemax": 1 }, axis, area, line, dot);
  const set = (next) => () => {
    knots = knots.map((knot, index) => [knot[0], next(knot, index)]);
    put(knots);
    react(knots, false);
  };
  const smooth = ([, value], i) => (((knots[i - 1] ?? knots[i])[1] + 2 * value + (knots[i + 1] ?? knots[i])[1]) / 4);
  const node = h(
    "div",
    { class: "drawing" },
    pad,
    h(
      "div",
      { class: "buttons" },
      h("button", { type: "button", click: set(() => 1) }, "Flat"),
      h("button", { type: "button", click: set((...of) => Math.round(1000 * smooth(...of)) / 1000) }, "Smooth"),
      h("button", { type: "button", click: set(() => 0) }, "Clear"),
      h("span", { class: "hint" }, "Paint with the pointer; ← → choose, ↑ ↓ move a knot"),
    ),
  );

  const across = (nm) => SPACE.left + ((nm - knots[0][0]) / (knots.at(-1)[0] - knots[0][0])) * (WIDTH - SPACE.left - SPACE.right);
  const up = (value) => HEIGHT - SPACE.bottom - value * (HEIGHT - SPACE.top - SPACE.bottom);

  function put(next) {
    knots = next;
    held = clamp(held, 0, knots.length - 1);
    const points = knots.map(([nm, value]) => `${across(nm).toFixed(1)},${up(value).toFixed(1)}`);
    line.setAttribute("points", points.join(" "));
    const ground = HEIGHT - SPACE.bottom;
    area.setAttribute("points", [`${SPACE.left},${ground}`, ...points, `${WIDTH - SPACE.right},${ground}`].join(" "));
    const [nm, value] = knots[held];
    dot.setAttribute("cx", across(nm));
    dot.setAttribute("cy", up(value));
    pad.setAttribute("aria-valuenow", value);
    pad.setAttribute("aria-valuetext", `${value} at ${nm} nm`);
    axis.replaceChildren(
      ...ticks(knots[0][0], knots.at(-1)[0], 7).flatMap((mark) => [
        svg("line", { x1: across(mark), x2: across(mark), y1: SPACE.top, y2: ground }),
        svg("text", { x: across(mark), y: HEIGHT - 5, "text-anchor": "middle" }, `${mark}`),
      ]),
    );
  }

  const under = (event) => {
    const box = pad.getBoundingClientRect();
    const [x, y] = [((event.clientX - box.left) / box.width) * WIDTH, ((event.clientY - box.top) / box.height) * HEIGHT];
    const index = ((x - SPACE.left) / (WIDTH - SPACE.left - SPACE.right)) * (knots.length - 1);
    const value = (HEIGHT - SPACE.bottom - y) / (HEIGHT - SPACE.top - SPACE.bottom);
    return { index: clamp(Math.round(index), 0, knots.length - 1), value: Math.round(clamp(value, 0, 1) * 1000) / 1000 };
  };

  let last = null;
  function paint(event) {
    const now = under(event);
    const from = last ?? now;
    const [lower, upper] = from.index <= now.index ? [from, now] : [now, from];
    const next = knots.map((knot) => [...knot]);
    // a quick stroke skips knots: they lie on the line between its two events
    for (let i = lower.index; i <= upper.index; i += 1) {
      const part = upper.index > lower.index ? (i - lower.index) / (upper.index - lower.index) : 1;
      next[i][1] = Math.round((lower.value + part * (upper.value - lower.value)) * 1000) / 1000;
    }
    next[now.index][1] = now.value;
    held = now.index;
    last = now;
    put(next);
    react(knots, true);
  }
  pad.addEventListener("pointerdown", (event) => {
    pad.setPointerCapture(event.pointerId);
    last = null;
    paint(event);
  });
  pad.addEventListener("pointermove", (event) => {
    if (pad.hasPointerCapture(event.pointerId)) paint(event);
  });
  for (const end of ["pointerup", "pointercancel"]) pad.addEventListener(end, () => react(knots, false));
  pad.addEventListener("keydown", (event) => {
    const [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 0.05], ArrowDown: [0, -0.05], PageUp: [0, 0.25], PageDown: [0, -0.25] }[event.key] ?? [];
    if (dx === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    held = clamp(held + dx, 0, knots.length - 1);
    const next = knots.map((knot) => [...knot]);
    next[held][1] = Math.round(clamp(next[held][1] + dy, 0, 1) * 1000) / 1000;
    put(next);
    if (dy) react(knots, false);
  });
  return { node, put };
}
