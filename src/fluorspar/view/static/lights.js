// The lights of a scene: how bright each is, and which spectrum it has.

import * as api from "./api.js";
import { drawnCurve, knotsOf } from "./drawn_curve.js";
import { h } from "./element.js";
import { icon } from "./icons.js";
import { latest } from "./latest.js";
import { chosenIn, fillSelect } from "./menu.js";
import { notice } from "./notice.js";
import { sparkline } from "./plot.js";
import { slider } from "./slider.js";
import { chooseFile, uploadsOf } from "./uploads.js";

const PLAIN = { factor: 1, spectrum: null };
const UPLOAD = "a file";

/** What the menu shows for a setting: the kind alone, where sliders hold its numbers. */
function kindOf(spectrum) {
  if (spectrum === null) return null;
  for (const kind of ["blackbody", "gaussian", "curve"]) if (spectrum[kind]) return kind;
  return spectrum;
}

/** The card of one light. */
function lightCard(light, { store, about }) {
  const { id, plugin } = light;
  const fault = notice();
  const mine = () => ({ ...PLAIN, ...store.view.relight.lights[id] });
  const set = (change, live = false) =>
    store.change(
      ({ view }) => {
        const next = { ...mine(), ...change };
        if (next.factor === 1 && next.spectrum === null) delete view.relight.lights[id];
        else view.relight.lights[id] = next;
      },
      { live },
    );

  let brightness = 1; // what switching it on again gives
  const eye = h("button", { type: "button", class: "icon plain", "aria-label": `${id} on`, click: () => set({ factor: mine().factor === 0 ? brightness : 0 }) });
  const spark = sparkline(88, 26);
  const select = h("select", { "aria-label": `Spectrum of ${id}` });
  const factor = slider({
    label: "Brightness", low: 0.05, high: 20, least: 0, most: 1e6, log: true, plain: 1, unit: "×", digits: 3,
    react: (value, live) => set({ factor: value }, live),
  });
  const kelvin = slider({
    label: "Temperature", low: 1000, high: 20000, least: 500, most: 100000, log: true, unit: "K", digits: 4,
    react: (value, live) => set({ spectrum: { blackbody: value } }, live),
  });
  const gaussian = (index, value, live) => {
    const next = [...(mine().spectrum?.gaussian ?? [550, 30])];
    next[index] = value;
    set({ spectrum: { gaussian: next } }, live);
  };
  const centre = slider({ label: "Centre", low: 300, high: 780, least: 200, most: 2000, step: 1, unit: "nm", react: (value, live) => gaussian(0, value, live) });
  const width = slider({ label: "FWHM", low: 5, high: 200, least: 1, most: 1000, log: true, unit: "nm", digits: 3, react: (value, live) => gaussian(1, value, live) });
  const drawing = drawnCurve((knots, live) => set({ spectrum: { curve: knots } }, live));
  const details = { blackbody: kelvin.node, gaussian: h("div", {}, centre.node, width.node), curve: drawing.node };

  const node = h(
    "section",
    { class: "card", "aria-label": `Light ${id}`, "data-light": id },
    h("header", {}, eye, h("h3", { title: `${plugin} emitter` }, id), spark.node),
    select,
    Object.values(details),
    factor.node,
    fault.node,
  );

  /** The spectrum as it is now: where drawing by hand begins. */
  let present = light.spectrum ?? { wavelengths: [], values: [] };
  const begin = {
    blackbody: () => ({ blackbody: 3000 }),
    gaussian: () => ({ gaussian: [550, 30] }),
    curve: () => {
      const { wavelengths = [400, 700] } = about.source(store.view.source);
      const known = present.wavelengths?.length ? present : { wavelengths: [300, 800], values: [1, 1] };
      // ultraviolet excites, so it can be drawn even where the image has no bands
      return { curve: knotsOf(known, Math.min(300, wavelengths[0]), wavelengths.at(-1)) };
    },
  };
  select.addEventListener("change", async () => {
    const chosen = chosenIn(select);
    if (chosen === UPLOAD) {
      const file = await fault.of(() => chooseFile("light"));
      if (file) set({ spectrum: { upload: file.id } });
      else put(); // the menu goes back to what is
    } else set({ spectrum: begin[chosen] ? begin[chosen]() : chosen });
  });

  const plotted = latest(async (setting) => {
    const answer = setting.spectrum === null ? light.spectrum : await fault.of(() => api.curve(store.view.source, id, setting));
    if (!answer) return;
    present = answer;
    spark.put(answer);
  });

  // an address may name a file of an earlier run
  const isKnown = (kind) => {
    if (kind?.upload) return uploadsOf("light").some((file) => file.id === kind.upload);
    return !kind?.name || about.library.illuminants.some((each) => each.name === kind.name);
  };

  let drawn = "";
  function put() {
    const { factor: now, spectrum } = mine();
    const kind = kindOf(spectrum);
    fillSelect(
      select,
      [
        [null, "As in the scene"],
        ["blackbody", "Blackbody, by temperature…"],
        ["gaussian", "LED, a Gaussian…"],
        ["curve", "Drawn by hand…"],
        [UPLOAD, "From a file…"],
        { group: "Files", entries: uploadsOf("light").map((file) => [{ upload: file.id }, file.name]) },
        ...(isKnown(kind) ? [] : [[kind, spectrum.name ?? "An earlier file"]]),
        { group: "Library", entries: about.library.illuminants.map((each) => [{ name: each.name }, each.name]) },
      ],
      kind,
    );
    for (const [of, detail] of Object.entries(details)) detail.hidden = of !== kind;
    if (spectrum?.blackbody) kelvin.put(spectrum.blackbody);
    if (spectrum?.gaussian) [centre, width].forEach((each, index) => each.put(spectrum.gaussian[index]));
    if (spectrum?.curve) drawing.put(spectrum.curve);
    factor.put(now);
    if (now > 0) brightness = now;
    eye.ariaPressed = `${now !== 0}`;
    eye.replaceChildren(icon(now === 0 ? "hidden" : "eye"));
    node.classList.toggle("off", now === 0);
    node.classList.toggle("changed", Boolean(store.view.relight.lights[id]));
    const key = JSON.stringify(spectrum);
    if (key !== drawn) {
      drawn = key;
      plotted({ factor: 1, spectrum });
    }
  }
  return { node, put };
}

/** Fills a part of the panel with the cards; `put()` brings them up to date with the view. */
export function lightCards(node, context) {
  let cards = [];
  return {
    build() {
      const { lights = [] } = context.about.source(context.store.view.source);
      cards = lights.map((light) => lightCard(light, context));
      node.replaceChildren(...cards.map((card) => card.node));
    },
    put: () => cards.forEach((card) => card.put()),
  };
}
