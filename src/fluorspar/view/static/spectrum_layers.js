// What is drawn of spectra: areas and lines of a plot. Pure functions of the server's answers.

import { componentColour, pinColour } from "./colours.js";

const INK = "currentColor";

/** Values of an answer, radiance or relative to the reference that was asked with. */
function scaled(answer, values, relative) {
  if (!relative) return values;
  return values.map((value, i) => (answer.total[i] ? (value * answer.relative[i]) / answer.total[i] : 0));
}

export const totalOf = (answer, relative) => (relative ? answer.relative.map((value) => value ?? 0) : answer.total);

/** The components that an answer holds at all: [[name, values], ...]. */
export const presentIn = (answer) => Object.entries(answer?.components ?? {}).filter(([, values]) => values.some((value) => value > 0));

function componentLayers(answer, { stacked, relative }) {
  const x = answer.wavelengths;
  let low = x.map(() => 0);
  return presentIn(answer).map(([name, values]) => {
    const [part, colour] = [scaled(answer, values, relative), componentColour(name)];
    if (!stacked) return { x, y: part, colour, width: 1.5 };
    const area = { x, low, high: low.map((value, i) => value + part[i]), colour, opacity: 0.75 };
    low = area.high;
    return area;
  });
}

function errorBand(answer, index, { active, relative }) {
  const [total, error] = [totalOf(answer, relative), scaled(answer, answer.standard_error, relative)];
  const [low, high] = [-1, 1].map((sign) => total.map((value, i) => value + sign * error[i]));
  const own = index === active;
  return { x: answer.wavelengths, low, high, colour: own ? INK : pinColour(index), opacity: own ? 0.3 : 0.18 };
}

/**
 * Layers from back to front: the band that is shown, the components of the active pin, errors, totals of all pins, the
 * image compared with (dashed), what is under the pointer (dotted). `answers`: {a, b} of `PinSpectra`.
 */
export function layersOf({ a, b }, under, how) {
  const { active, relative, band } = how;
  const absolute = (answer, dash, width) => (answer && !relative ? [{ x: answer.wavelengths, y: answer.total, colour: INK, width, dash }] : []);
  return [
    ...(band ? [{ from: band[0], to: band[1], colour: INK, opacity: 0.1 }] : []),
    ...(a[active] ? componentLayers(a[active], how) : []),
    ...a.flatMap((answer, index) => (answer.standard_error ? [errorBand(answer, index, how)] : [])),
    ...a.map((answer, index) => ({ x: answer.wavelengths, y: totalOf(answer, relative), colour: pinColour(index), width: index === active ? 2.5 : 1.5 })),
    ...absolute(b, "6 3", 1.5),
    ...absolute(under, "2 2", 1),
  ];
}

/** The greatest value of what is pinned; of what is under the pointer if nothing is: the axis does not follow the pointer. */
export function highest({ a, b }, under, { relative }) {
  const pinned = a.flatMap((answer) => {
    const error = answer.standard_error ? scaled(answer, answer.standard_error, relative) : null;
    return totalOf(answer, relative).map((value, i) => value + (error?.[i] ?? 0));
  });
  const all = [...pinned, ...(b && !relative ? b.total : [])];
  return Math.max(0, ...(all.length ? all : (under?.total ?? [])));
}
