// A slider and a field for the same number, and what both show of it.

import { freshId, h } from "./element.js";
import { clamp, shown } from "./numbers.js";

const STEPS = 1000;

/**
 * A labelled slider with a number field.
 *
 * `low`, `high`: its ends; the field accepts `least` to `most` (default: the ends). `log`: equal steps are equal factors.
 * `step`: of the slider's keys, in its own units. `plain`: where a double click puts it. `unit`: written behind the field.
 * `react(value, live)`: live while it is dragged.
 */
export function slider({ label, low, high, least = low, most = high, log = false, step, plain, unit = "", digits = 4, hideLabel = false, react }) {
  const id = freshId();
  const place = (value) => (log ? (STEPS * Math.log(value / low)) / Math.log(high / low) : value);
  const value = (position) => (log ? low * (high / low) ** (position / STEPS) : position);
  const range = h("input", {
    type: "range",
    id,
    min: log ? "0" : `${low}`,
    max: log ? `${STEPS}` : `${high}`,
    step: log ? "1" : `${step ?? "any"}`,
    "aria-label": hideLabel ? label : null,
    title: plain === undefined ? null : `Double click: ${shown(plain)}${unit && ` ${unit}`}`,
  });
  const field = h("input", { type: "number", class: "number", step: "any", min: `${least}`, max: `${most}`, "aria-label": `${label}${unit && `, ${unit}`}` });
  const read = () => Number(shown(value(Number(range.value)), digits));
  const put = (number) => {
    range.value = `${place(clamp(number, low, high))}`;
    range.setAttribute("aria-valuetext", `${shown(number, digits)} ${unit}`.trim());
    if (document.activeElement !== field) field.value = `${Number(number.toPrecision(digits))}`;
  };
  range.addEventListener("input", () => {
    field.value = `${read()}`;
    react(read(), true);
  });
  range.addEventListener("change", () => react(read(), false));
  range.addEventListener("dblclick", () => {
    if (plain !== undefined) react(plain, false);
  });
  field.addEventListener("change", () => {
    const typed = field.value === "" ? NaN : Number(field.value);
    field.classList.toggle("wrong", !Number.isFinite(typed));
    if (!Number.isFinite(typed)) return;
    field.value = `${clamp(typed, least, most)}`;
    react(clamp(typed, least, most), false);
  });
  const node = h(
    "div",
    { class: "slider" },
    hideLabel ? null : h("label", { for: id }, label),
    range,
    field,
    unit ? h("span", { class: "unit", "aria-hidden": "true" }, unit) : null,
  );
  return {
    node,
    put,
    set disabled(is) {
      range.disabled = field.disabled = is;
    },
  };
}
