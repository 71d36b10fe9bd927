// The spectra of the pins: a plot, the numbers below it, and both as a file.

import * as api from "./api.js";
import { componentColour, MOST_PINS, pinColour } from "./colours.js";
import { copyText, download } from "./download.js";
import { h, swatch } from "./element.js";
import { latest } from "./latest.js";
import { notice } from "./notice.js";
import { at, shown, unitText } from "./numbers.js";
import { fillPinTable } from "./pin_table.js";
import { PinSpectra } from "./pins.js";
import { Plot } from "./plot.js";
import { highest, layersOf, presentIn, totalOf } from "./spectrum_layers.js";

export function spectrumPanel(node, { store, about, stage, frames, hovered }) {
  const fault = notice();
  const spectra = new PinSpectra((id) => about.generation(id));
  const plot = new Plot({ width: 384, height: 192, label: "Spectrum" });
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

  let answers = { a: [], b: null }; // of the state `answered`
  let answered = store.state;
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
    const got = state.pins.length ? await fault.of(() => spectra.all(state, frames.a?.facts)) : { a: [], b: null };
    [answers, answered] = [got ?? { a: [], b: null }, state]; // numbers of another view must not stay
    paint();
  });

  function paint() {
    const { pins, active, relative: isRelative } = store.state;
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
    fillPinTable(table, answers, answered);
  }

  function draw() {
    const { view } = store.state;
    const { relative: isRelative, active } = answered;
    const { a, b } = answers;
    const [main, source] = [a[active], about.source(view.source)];
    const how = { active, relative: isRelative, stacked: stacked.checked, band: view.mode === "colour" ? null : view.band };
    const wavelengths = main?.wavelengths ?? under?.wavelengths ?? source.wavelengths ?? [400, 700];
    const read = (nm) => {
      const near = wavelengths.reduce((best, w) => (Math.abs(w - nm) < Math.abs(best - nm) ? w : best));
      const texts = a.map((answer, index) => `${index + 1}: ${shown(at(answer.wavelengths, totalOf(answer, isRelative), near))}`);
      if (b && !isRelative) texts.push(`B: ${shown(at(b.wavelengths, b.total, near))}`);
      return `${near} nm  ${texts.slice(0, 4).join("  ")}`;
    };
    plot.draw({
      x: [wavelengths[0], wavelengths.at(-1)],
      y: [0, highest(answers, under, how) * 1.05 || 1],
      unit: isRelative ? "of pin 1" : unitText(main?.unit ?? under?.unit ?? ""),
      layers: layersOf(answers, under, how),
      read: main ? read : null,
      label: main ? `Spectrum of pin ${active + 1}, luminance ${shown(main.luminance)}, with its components` : "Spectrum; nothing is pinned",
    });
    const labelOf = (name) => source.components?.find((component) => component.name === name)?.label ?? name;
    legend.replaceChildren(
      ...presentIn(main).map(([name]) => h("span", { class: "key" }, swatch(componentColour(name)), labelOf(name))),
      b && !isRelative ? h("span", { class: "key" }, "╌╌ B") : "",
    );
  }

  hovered.addEventListener("spectrum", () => {
    under = hovered.spectrum;
    if (store.state.panel === "spectrum") draw();
  });
  about.addEventListener("change", refresh);
  frames.addEventListener("change", () => store.state.other && refresh()); // B is seen as A's picture is
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
