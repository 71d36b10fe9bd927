// The numbers of the pins: a column each.

import { pinColour } from "./colours.js";
import { h, swatch } from "./element.js";
import { luminanceUnit, percent, shown } from "./numbers.js";
import { pixelsOf } from "./pins.js";

const decimals = (value, places) => value?.toFixed(places) ?? "–";

/** [label, text of an answer] */
const ROWS = [
  ["X", ({ xyz }) => shown(xyz[0])],
  ["Y", ({ xyz }) => shown(xyz[1])],
  ["Z", ({ xyz }) => shown(xyz[2])],
  ["x", ({ xy }) => decimals(xy[0], 4)],
  ["y", ({ xy }) => decimals(xy[1], 4)],
  ["L*", ({ lab }) => decimals(lab?.[0], 2)],
  ["a*", ({ lab }) => decimals(lab?.[1], 2)],
  ["b*", ({ lab }) => decimals(lab?.[2], 2)],
  ["CCT, K", ({ cct }) => decimals(cct, 0)],
  ["Luminescent", ({ luminescent_share: share }) => percent(share)],
];

/** `answers`: {a, b} of `PinSpectra` for a state that has pins. */
export function fillPinTable(table, { a, b }, { pins, active, other }) {
  const columns = a.map((answer, index) => [h("span", {}, swatch(pinColour(index)), `${index + 1}`), answer, pins[index].region]);
  if (b) columns.push([h("span", { title: other.name }, "B"), b, pins[active].region]);
  const row = (label, cells, attributes = {}) => h("tr", attributes, h("th", { scope: "row" }, label), cells.map((cell) => h("td", {}, cell)));
  table.hidden = !columns.length;
  table.replaceChildren(
    h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Pin"), columns.map(([head]) => h("th", { scope: "col" }, head)))),
    h(
      "tbody",
      {},
      row("Pixels", columns.map(([, , region]) => pixelsOf(region))),
      row(`Luminance, ${luminanceUnit(a[0]?.unit)}`, columns.map(([, answer]) => shown(answer.luminance))),
      ROWS.map(([label, of]) => row(label, columns.map(([, answer]) => of(answer)), { "data-row": label })),
    ),
  );
}
