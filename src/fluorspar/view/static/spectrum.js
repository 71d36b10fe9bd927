// The spectra of the pins: a plot, the numbers below it, and both as a file.

import * as api from "./api.js";
import { componentColour, MOST_PINS, pinColour } from "./colours.js";
import { copyText, download } from "./download.js";
import { h, swatch } from "./element.js";
import { latest } from "./latest.js";
import { notice } from "./notice.js";
import { at, percent, shown, unitText } from "./numbers.js";
import { pixelsOf, PinSpectra } from "./pins.js";
import { Plot } from "./plot.js";

const INK = "currentColor";

/** The rows of the table: a label and the text of an answer. */
const ROWS = [
  ["Luminance, cd/m²", ({ luminance }) => shown(luminance)],
  ["X", ({ xyz }) => shown(xyz[0])],
  ["Y", ({ xyz }) => shown(xyz[1])],
  ["Z", ({ xyz }) => shown(xyz[2])],
  ["x", ({ xy }) => xy[0]?.toFixed(4) ?? "–"],
  ["y", ({ xy }) => xy[1]?.toFixed(4) ?? "–"],
  ["L*", ({ lab }) => lab?.[0].toFixed(2) ?? "–"],
  ["a*", ({ lab }) => lab?.[1].toFixed(2) ?? "–"],
  ["b*", ({ lab }) => lab?.[2].toFixed(2) ?? "–"],
  ["CCT, K", ({ cct }) => (cct ? `${Math.round(cct)}` : "–")],
  ["Luminescent", ({ luminescent_share: share }) => percent(share)],
];

export function spectrumPanel(node, { store, about, stage, hovered }) {
  const fault = notice();
  const spectra = new PinSpectra((id) => about.generation(id));
  const plot = new Plot({ width: 384, height: 206, label: "Spectrum" });
  const chips = h("div", { class: "chips", role: "group", "aria-label": "Pins" });
  const empty = h("p", { class: "empty" }, "Click a pixel of the picture, or drag a region with Shift, to pin its spectrum. Ctrl+click pins another one beside it.");
  const legend = h("div", { class: "legend" });
  const stacked = h("input", { type: "checkbox", checked: true, change: () => paint() });
  const relative = h("input", { type: "checkbox", change: () => store.change((state) => (state.relative = relative.checked)) });
  const relativeLabel = h("label", { title: "Radiance divided by that of pin 1, which is also the white of L*a*b*" }, relative, " Relative to pin 1");
  const table = h("table", { class: "numbers-table" });
  const copied = h("span", { class: "hint", role: "status" });
  const withCsv = (use) => () =>
    fault.of(async () => {
      const { view, pins } = store.state;
      await use(await api.csv(view, pins.map(({ region }, index) => ({ name: `${index + 1}`, region }))));
    });
  const copy = withCsv(async (text) => (copied.textContent = (await copyText(text)) ? "Copied" : "The browser forbids to copy"));
  const save = withCsv((text) => download(new Blob([text], { type: "text/csv" }), "spectra.csv"));
  const options = h(
    "div",
    { class: "options" },
    h("label", { title: "The active pin as a stack of its components" }, stacked, " Stacked"),
    relativeLabel,
    h("span", { class: "spring" }),
    h("button", { type: "button", title: "Copy the spectra of all pins as CSV", click: copy }, "Copy"),
    h("button", { type: "button", title: "Download the spectra of all pins as CSV", click: save }, "CSV"),
  );
  const pinned = h("div", {}, options, legend, h("div", { class: "scrolls", tabindex: "0", role: "region", "aria-label": "Numbers of the pins" }, table), copied);
  node.append(chips, plot.node, empty, fault.node, pinned);

  let answers = { a: [], b: null };
  let under = null; // the spectrum under the pointer

  function chip(index, active) {
    const number = index + 1;
    const select = h("button", { type: "button", class: "chip", "aria-pressed": `${index === active}`, "aria-label": `Pin ${number}`, click: () => store.change((state) => (state.active = index), { quiet: true }) }, swatch(pinColour(index)), `${number}`);
    const remove = h("button", { type: "button", class: "plain remove", "aria-label": `Remove pin ${number}`, title: `Remove pin ${number}`, click: () => removePin(index) }, "✕");
    return h("span", { class: "chip-pair" }, select, remove);
  }

  function removePin(index) {
    store.change((state) => {
      state.pins.splice(index, 1);
      if (state.active >= index && state.active > 0) state.active -= 1;
      if (!state.pins.length) state.relative = false;
    });
  }

  function addPin() {
    stage.pick("Click the pixel of the new pin, or drag a region", (region) =>
      store.change((state) => {
        state.pins.push({ region });
        state.active = state.pins.length - 1;
      }),
    );
  }

  const refresh = latest(async () => {
    const { state, live } = store;
    if (state.panel !== "spectrum" || live) return;
    const got = state.pins.length ? await fault.of(() => spectra.all(state)) : { a: [], b: null };
    if (!got) return;
    answers = got;
    paint();
  });

  function paint() {
    const { pins, active, relative: isRelative, other } = store.state;
    empty.hidden = pins.length > 0;
    pinned.hidden = pins.length === 0;
    chips.hidden = pins.length === 0;
    relative.checked = isRelative;
    const focused = chips.contains(document.activeElement);
    chips.replaceChildren(
      ...pins.map((_, index) => chip(index, active)),
      pins.length < MOST_PINS ? h("button", { type: "button", class: "chip add", title: "Pin another place (Ctrl+click)", click: addPin }, "+ Pin") : "",
    );
    if (focused) chips.querySelector("[aria-pressed=true], .add")?.focus();
    draw();
    tabulate(other);
  }

  function draw() {
    const { view, relative: isRelative } = store.state;
    const { a, b } = answers;
    const active = Math.min(store.state.active, a.length - 1);
    const main = a[active];
    const shapes = [];
    const lines = [];
    let most = 0;
    const scaled = (answer, values) => (isRelative ? values.map((value, i) => value * (answer.total[i] ? answer.relative[i] / answer.total[i] : 0)) : values);
    const totalOf = (answer) => (isRelative ? answer.relative.map((value) => value ?? 0) : answer.total);
    const wavelengths = main?.wavelengths ?? under?.wavelengths ?? about.source(view.source).wavelengths ?? [400, 700];
    if (view.mode !== "colour" && view.band) shapes.push({ from: view.band[0], to: view.band[1], colour: INK, opacity: 0.1 });
    const present = main ? Object.entries(main.components).filter(([, values]) => values.some((value) => value > 0)) : [];
    if (main) {
      let low = wavelengths.map(() => 0);
      for (const [name, values] of present) {
        const part = scaled(main, values);
        const colour = componentColour(name);
        if (stacked.checked) {
          const high = low.map((value, i) => value + part[i]);
          shapes.push({ x: wavelengths, low, high, colour, opacity: 0.75 });
          low = high;
        } else lines.push({ x: wavelengths, y: part, colour, width: 1.5 });
      }
    }
    a.forEach((answer, index) => {
      const total = totalOf(answer);
      most = Math.max(most, ...total);
      if (answer.standard_error) {
        const error = scaled(answer, answer.standard_error);
        const [low, high] = [-1, 1].map((sign) => total.map((value, i) => value + sign * error[i]));
        const own = index === active;
        shapes.push({ x: answer.wavelengths, low, high, colour: own ? INK : pinColour(index), opacity: own ? 0.3 : 0.18 });
        most = Math.max(most, ...high);
      }
      lines.push({ x: answer.wavelengths, y: total, colour: pinColour(index), width: index === active ? 2.5 : 1.5 });
    });
    if (b && !isRelative) {
      lines.push({ x: b.wavelengths, y: b.total, colour: INK, width: 1.5, dash: "6 3" });
      most = Math.max(most, ...b.total);
    }
    if (under && !isRelative) {
      lines.push({ x: under.wavelengths, y: under.total, colour: INK, width: 1, dash: "2 2" });
      if (!most) most = Math.max(...under.total);
    }
    const read = (nm) => {
      const near = wavelengths.reduce((best, w) => (Math.abs(w - nm) < Math.abs(best - nm) ? w : best));
      const texts = a.map((answer, index) => `${index + 1}: ${shown(at(answer.wavelengths, totalOf(answer), near))}`);
      if (b && !isRelative) texts.push(`B: ${shown(at(b.wavelengths, b.total, near))}`);
      return `${near} nm  ${texts.slice(0, 4).join("  ")}`;
    };
    plot.draw({
      x: [wavelengths[0], wavelengths.at(-1)],
      y: [0, most * 1.05 || 1],
      unit: isRelative ? "of pin 1" : unitText(main?.unit ?? under?.unit ?? ""),
      layers: [...shapes, ...lines],
      read: main ? read : null,
      label: main ? `Spectrum of pin ${active + 1}, luminance ${shown(main.luminance)}, with its components` : "Spectrum; nothing is pinned",
    });
    const known = about.source(view.source).components ?? [];
    const labelOf = (name) => known.find((component) => component.name === name)?.label ?? name;
    legend.replaceChildren(
      ...present.map(([name]) => h("span", { class: "key" }, swatch(componentColour(name)), labelOf(name))),
      b && !isRelative ? h("span", { class: "key" }, "╌╌ B") : "",
    );
  }

  function tabulate(other) {
    const { pins } = store.state;
    const columns = answers.a.slice(0, pins.length).map((answer, index) => [h("span", {}, swatch(pinColour(index)), `${index + 1}`), answer, pins[index].region]);
    if (answers.b && other) columns.push([h("span", { title: other.name }, "B"), answers.b, pins[store.state.active]?.region ?? []]);
    table.replaceChildren(
      h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Pin"), columns.map(([head]) => h("th", { scope: "col" }, head)))),
      h(
        "tbody",
        {},
        h("tr", {}, h("th", { scope: "row" }, "Pixels"), columns.map(([, , region]) => h("td", { class: "pixels" }, pixelsOf(region)))),
        ROWS.map(([label, of]) => h("tr", { "data-row": label }, h("th", { scope: "row" }, label), columns.map(([, answer]) => h("td", {}, of(answer))))),
      ),
    );
  }

  hovered.addEventListener("spectrum", () => {
    under = hovered.spectrum;
    if (store.state.panel === "spectrum") draw();
  });
  about.addEventListener("change", refresh);
  store.watch(
    ({ panel, view, pins, active, relative: isRelative, other }) => [
      panel, store.live, view.source, view.relight, view.weights, view.exposure, view.white, view.mode, view.band, pins, active, isRelative, other,
    ],
    () => {
      if (store.state.panel !== "spectrum") return;
      refresh();
      if (!store.state.pins.length) paint();
    },
  );
}
