// The two rows above the picture: what is shown, and how.

import { bandSlider } from "./band_slider.js";
import { choice } from "./choice.js";
import { colourBar } from "./colour_bar.js";
import { compareMenu } from "./compare.js";
import { h } from "./element.js";
import { exposureControl } from "./exposure.js";
import { icon } from "./icons.js";
import { chosenIn, fillSelect } from "./menu.js";
import { percent } from "./numbers.js";
import { UNCHANGED } from "./state.js";
import { nextTheme } from "./theme.js";
import { whiteMenu } from "./white.js";

/** [mode of a view, label, meaning] */
export const MODES = [
  ["colour", "Colour", "As an eye sees it (1)"],
  ["band", "Band", "The mean radiance of a band, in false colour (2)"],
  ["standard_error", "Error", "The standard error of the band's mean (3)"],
  ["relative_error", "Rel. error", "The standard error, of the radiance (4)"],
];

/** The band to begin with: 20 nm in the middle of what an eye sees, or of an image that it does not see. */
function middleBand(wavelengths) {
  const [first, last] = [wavelengths[0], wavelengths.at(-1)];
  const middle = first <= 550 && last >= 550 ? 550 : (first + last) / 2;
  const nearest = (nm) => wavelengths.reduce((best, w) => (Math.abs(w - nm) < Math.abs(best - nm) ? w : best));
  return [nearest(middle - 10), nearest(middle + 10)];
}

export function toolbar(node, { store, stage, frames, about, report, help }) {
  const setMode = (mode) =>
    store.change(({ view }) => {
      if (mode !== view.mode) view.range = null; // a range of radiance is none of relative errors
      view.mode = mode;
      if (mode !== "colour") view.band ??= middleBand(about.source(view.source).wavelengths);
    });
  const modes = choice("What is shown", MODES, setMode);
  const sources = h("select", { "aria-label": "Image", title: "The image that is shown" });
  sources.addEventListener("change", () => {
    const id = chosenIn(sources);
    store.change(({ view }) => {
      Object.assign(view, { source: id, relight: UNCHANGED, weights: {}, band: null, range: null, white: null });
      if (view.mode !== "colour") view.band = middleBand(about.source(id).wavelengths);
    });
  });
  const button = (name, label, title, click) => h("button", { type: "button", class: "icon", "aria-label": label, title, click }, icon(name));
  const undo = button("undo", "Undo", "Undo (Ctrl+Z)", () => store.undo());
  const redo = button("redo", "Redo", "Redo (Ctrl+Shift+Z)", () => store.redo());
  const compare = compareMenu(store, about);

  const exposure = exposureControl(store);
  const white = whiteMenu(store, stage, about, report);
  const gamut = h(
    "button",
    {
      type: "button",
      title: "Mark the colours that sRGB cannot show (G)",
      click: () => store.change(({ view }) => (view.gamut = !view.gamut)),
    },
    "Gamut",
  );
  const outside = h("output", { class: "hint" });
  const colourTools = h("div", { class: "tools" }, exposure.node, white.node, h("div", { class: "tool" }, gamut, outside));

  const band = bandSlider((chosen, live) => store.change(({ view }) => (view.band = chosen), { live }));
  const bar = colourBar((range) => store.change(({ view }) => (view.range = range)));
  const bandTools = h("div", { class: "tools" }, band.node, bar.node);

  const theme = button("theme", "Light or dark", "Light, dark, or as the system has it", () => (theme.title = nextTheme()));
  node.append(
    h("div", { class: "row" },
      h("h1", {}, "Fluorspar"), sources, modes.node, h("span", { class: "spring" }), compare.node, undo, redo, theme,
      button("help", "Keyboard and mouse", "Keyboard and mouse (?)", help)),
    h("div", { class: "row second" }, colourTools, bandTools),
  );

  function fill() {
    const { source } = store.view;
    fillSelect(sources, about.sources.map(({ id }) => [id, about.title(id)]), source);
    document.title = `${about.title(source)} – Fluorspar`;
    const { standard_error: known, wavelengths = [] } = about.source(source);
    const why = known ? "" : "This image holds no standard errors.";
    modes.allow("standard_error", why);
    modes.allow("relative_error", why);
    if (wavelengths.length) {
      band.range(wavelengths);
      band.put(store.view.band ?? middleBand(wavelengths));
    }
    white.fill();
    compare.fill();
  }
  about.addEventListener("change", fill);
  store.watch(({ view }) => view.source, fill);
  store.watch(
    ({ view }) => [view.mode, view.band, view.gamut],
    ([mode, chosen, marked]) => {
      modes.put(mode);
      colourTools.hidden = mode !== "colour";
      bandTools.hidden = mode === "colour";
      if (chosen) band.put(chosen);
      gamut.ariaPressed = `${marked}`;
    },
  );
  store.watch(
    () => [store.canUndo, store.canRedo],
    ([can, again]) => {
      undo.disabled = !can;
      redo.disabled = !again;
    },
  );
  frames.addEventListener("change", () => {
    const { view } = store;
    const facts = frames.a?.facts ?? {};
    if (view.mode === "colour") {
      exposure.put(facts);
      const share = facts.out_of_gamut;
      outside.textContent = share > 0 ? `${percent(share)} outside sRGB` : "";
    } else bar.put(facts, about.colour_maps[view.mode]?.stops, view.range === null, view.mode === "relative_error");
  });
  return { setMode, exposure, white, compare };
}
