// Numbers as a reader wants them.

/** Four significant digits, without exponents where they can be avoided. */
export function shown(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-3) return value.toExponential(Math.max(1, digits - 2)).replace("e+", "e");
  return `${Number(value.toPrecision(digits))}`;
}

/** A share from 0 to 1 in per cent. */
export function percent(share) {
  if (share === null || share === undefined || !Number.isFinite(share)) return "–";
  return `${share !== 0 && Math.abs(share) < 0.0995 ? Number((share * 100).toPrecision(2)) : (share * 100).toFixed(1)} %`;
}

/** Numbers of an interval at which an axis is marked: multiples of 1, 2 or 5 times a power of ten. */
export function ticks(low, high, most = 6) {
  if (!(high > low)) return [low];
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
  const marks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k += 1) marks.push(Number((k * step).toPrecision(12)));
  return marks;
}

export const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

/** A spectrum on its own wavelengths, read at another one; 0 outside. */
export function at(wavelengths, values, nm) {
  if (nm < wavelengths[0] || nm > wavelengths.at(-1)) return 0;
  const upper = Math.max(1, wavelengths.findIndex((w) => w >= nm));
  const [w0, w1] = [wavelengths[upper - 1], wavelengths[upper]];
  const part = w1 > w0 ? (nm - w0) / (w1 - w0) : 0;
  return values[upper - 1] + part * (values[upper] - values[upper - 1]);
}

/** What luminances of an image are in: only radiance in SI units gives cd/m². */
export const luminanceUnit = (unit) => (unit === "W m-2 sr-1 nm-1" ? "cd/m²" : "relative");

/** Units with raised exponents, as on the axis of a figure. */
export const unitText = (unit) => unit.replace(/-(\d)/g, (_, digit) => `⁻${"⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]}`);
