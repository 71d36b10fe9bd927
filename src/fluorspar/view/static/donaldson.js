// The Donaldson matrix of a surface as a picture: excitation across, emission up.

import * as api from "./api.js";
import { choice } from "./choice.js";
import { showDialog } from "./dialog.js";
import { h, svg } from "./element.js";
import { notice } from "./notice.js";
import { at, clamp, shown, ticks } from "./numbers.js";
import { Plot } from "./plot.js";

const SIZE = 360;
const SPACE = { left: 44, bottom: 36, top: 6, right: 10 };

function drawn({ excitation, emission, matrix, png }, reading) {
  const [x, y] = [excitation, emission].map((values) => [values[0], values.at(-1)]);
  const across = (nm) => SPACE.left + ((nm - x[0]) / (x[1] - x[0] || 1)) * SIZE;
  const up = (nm) => SPACE.top + SIZE - ((nm - y[0]) / (y[1] - y[0] || 1)) * SIZE;
  const [width, height] = [SIZE + SPACE.left + SPACE.right, SIZE + SPACE.top + SPACE.bottom];
  const node = svg("svg", { class: "plot matrix", viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": "Donaldson matrix, excitation across, emission up" });
  const axes = svg("g", { class: "axes" });
  for (const nm of ticks(...x, 8)) axes.append(svg("text", { x: across(nm), y: SPACE.top + SIZE + 14, "text-anchor": "middle" }, `${nm}`));
  for (const nm of ticks(...y, 8)) axes.append(svg("text", { x: SPACE.left - 5, y: up(nm) + 3.5, "text-anchor": "end" }, `${nm}`));
  axes.append(svg("text", { class: "unit", x: SPACE.left + SIZE, y: height - 4, "text-anchor": "end" }, "excitation, nm"));
  axes.append(svg("text", { class: "unit", x: 12, y: SPACE.top + 4, transform: `rotate(-90 12 ${SPACE.top + 4})`, "text-anchor": "end" }, "emission, nm"));
  node.append(svg("image", { href: png, x: SPACE.left, y: SPACE.top, width: SIZE, height: SIZE, preserveAspectRatio: "none" }), axes);
  node.addEventListener("pointermove", (event) => {
    const box = node.getBoundingClientRect();
    const share = [(event.clientX - box.left - SPACE.left) / SIZE, 1 - (event.clientY - box.top - SPACE.top) / SIZE];
    const column = clamp(Math.floor(share[0] * excitation.length), 0, excitation.length - 1);
    const row = clamp(Math.floor(share[1] * emission.length), 0, emission.length - 1);
    reading.textContent = `excitation ${excitation[column]} nm, emission ${emission[row]} nm: ${shown(matrix[row][column])}`;
  });
  return node;
}

/** `stops`: the colour map of the matrix. */
export function showDonaldson(view, surface, stops) {
  const fault = notice();
  const picture = h("div", { class: "matrix-place" });
  const reflectance = new Plot({ width: 414, height: 130, label: "Reflectance" });
  const bar = h("span", { class: "bar" });
  bar.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
  const scale = h("div", { class: "scale" });
  const reading = h("output", { class: "hint" }, "Point at the matrix to read it.");
  const sides = ["front", "back"].filter((side) => surface[side]);
  const put = async (side) => {
    buttons.put(side);
    const answer = await fault.of(() => api.donaldson(view.source, view.relight, surface.id, side));
    if (!answer) return;
    picture.replaceChildren(drawn(answer, reading));
    const { emission, reflectance: values, range } = answer;
    scale.replaceChildren(shown(range[0], 3), bar, `${shown(range[1], 3)} 1/nm`);
    reflectance.draw({
      x: [emission[0], emission.at(-1)], y: [0, Math.max(1, ...values)], unit: "reflectance, the matrix's diagonal",
      layers: [{ x: emission, y: values, colour: "currentColor" }], read: (nm) => `${Math.round(nm)} nm  ${shown(at(emission, values, nm), 3)}`,
    });
  };
  const buttons = choice("Side", sides.map((side) => [side, side, `The ${side} of the surface`]), put);
  buttons.node.hidden = sides.length < 2;
  showDialog(`Donaldson matrix of ${surface.id}`, buttons.node, fault.node, picture, scale, reading, reflectance.node);
  put(sides[0] ?? "front");
}
