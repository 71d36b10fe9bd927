// The components of the light: how much each gives, switched on and off, weighted, and sums of them by name.

import * as api from "./api.js";
import { componentColour } from "./colours.js";
import { h, swatch } from "./element.js";
import { icon } from "./icons.js";
import { latest } from "./latest.js";
import { notice } from "./notice.js";
import { percent } from "./numbers.js";
import { slider } from "./slider.js";

/** Sums that have a name: numbers of components, as the paper counts them. */
const PRESETS = [
  ["Total", [0, 1, 2, 3, 4, 5, 6], "All that reaches the camera"],
  ["Reflected", [1, 3], "Light that never luminesced, 1 + 3: the paper's Figure 12"],
  ["Luminescent", [2, 4, 5], "Light that luminesced once, 2 + 4 + 5: the paper's Figure 12"],
  ["Direct", [1, 2], "Light of the sources, reflected or luminesced at once, 1 + 2"],
  ["Indirect", [3, 4, 5], "Light that came by another surface, 3 + 4 + 5"],
  ["0–5", [0, 1, 2, 3, 4, 5], "Light that luminesced at most once, 0 to 5: the paper's Eq. 13"],
];

const weightOf = (weights, name) => weights[name] ?? 1;

/** Weights with nothing in them that is 1 anyway. */
function tidy(weights) {
  return Object.fromEntries(Object.entries(weights).filter(([, weight]) => weight !== 1));
}

export function componentsPanel(node, { store, about }) {
  const fault = notice();
  const sums = h("p", { class: "sums" });
  const list = h("ul", { class: "components" });
  const presets = h("div", { class: "presets", role: "group", "aria-label": "Sums of components" });
  node.append(presets, sums, fault.node, list);
  let rows = {};

  const setWeight = (name, weight, live = false) =>
    store.change(({ view }) => (view.weights = tidy({ ...view.weights, [name]: weight })), { live });
  const only = (numbers) =>
    store.change(({ view }) => {
      const { components } = about.source(view.source);
      view.weights = Object.fromEntries(components.filter(({ number }) => !numbers.includes(number)).map(({ name }) => [name, 0]));
    });

  function row({ name, number, label, meaning = label }) {
    const picture = h("img", { alt: "", class: "thumb" });
    const gain = h("span", { class: "gain" });
    const solo = h("button", { type: "button", class: "plain solo", title: `Show only ${label}`, click: () => only([number]) }, picture, gain);
    const eye = h("button", { type: "button", class: "icon plain", "aria-label": `Show ${label}`, click: () => setWeight(name, weightOf(store.view.weights, name) === 0 ? 1 : 0) });
    const share = h("output", { class: "share" });
    const bar = h("span", { class: "share-bar" });
    bar.style.backgroundColor = componentColour(name);
    const weight = slider({
      label: `Weight of ${label}`, low: 0, high: 2, step: 0.05, plain: 1, digits: 3, hideLabel: true,
      react: (value, live) => setWeight(name, value, live),
    });
    const item = h(
      "li",
      { class: "component", "data-name": name },
      solo,
      h("div", { class: "about-component" }, h("div", { class: "name" }, swatch(componentColour(name)), h("span", { title: meaning }, `${number ?? ""} ${label}`), share), h("div", { class: "share-track" }, bar), weight.node),
      eye,
    );
    return { item, picture, gain, share, bar, weight, eye };
  }

  let built = "";
  function build() {
    const { components = [] } = about.source(store.view.source);
    const key = JSON.stringify([store.view.source, components]);
    if (key === built) return; // a scene that is refined keeps its rows, and a slider its pointer
    built = key;
    rows = Object.fromEntries(components.map((component) => [component.name, row(component)]));
    list.replaceChildren(...Object.values(rows).map(({ item }) => item));
    const numbers = components.map(({ number }) => number);
    presets.hidden = components.length < 2;
    presets.replaceChildren(
      ...PRESETS.map(([text, of, title]) =>
        h("button", { type: "button", title, "data-shows": of.filter((number) => numbers.includes(number)).join(), click: () => only(of) }, text),
      ),
    );
    press();
  }

  function press() {
    const { weights, source } = store.view;
    const plain = Object.values(weights).every((weight) => weight === 0 || weight === 1);
    const { components = [] } = about.source(source);
    const on = components.filter(({ name }) => weightOf(weights, name) !== 0).map(({ number }) => number).join();
    for (const button of presets.children) button.ariaPressed = `${plain && button.dataset.shows === on}`;
    for (const [name, { item, weight, eye }] of Object.entries(rows)) {
      const value = weightOf(weights, name);
      weight.put(value);
      eye.ariaPressed = `${value !== 0}`;
      eye.replaceChildren(icon(value === 0 ? "hidden" : "eye"));
      item.classList.toggle("off", value === 0);
    }
  }

  let asked = null;
  const refresh = latest(async () => {
    const { state, live } = store;
    const { source } = state.view;
    if (state.panel !== "components" || live || !about.ready(source)) return;
    const { exposure, white } = state.view;
    const view = { ...state.view, weights: {}, mode: "colour", band: null, range: null, gamut: false, exposure, white };
    const key = JSON.stringify([view, about.generation(source)]);
    if (key === asked) return;
    const answer = await fault.of(() => api.components(view));
    if (!answer) return;
    asked = key;
    sums.hidden = answer.reflected === null;
    sums.textContent = `Of the luminance ${percent(answer.reflected)} is reflected, ${percent(answer.luminescent)} luminescent.`;
    for (const { name, share, png, exposure_factor: factor } of answer.components) {
      if (!rows[name]) continue;
      rows[name].picture.src = png;
      rows[name].gain.textContent = factor > 1 ? `× ${factor}` : ""; // dark components are shown brighter
      rows[name].share.textContent = percent(share);
      rows[name].bar.style.width = `${Math.max(0, Math.min(1, share)) * 100}%`;
    }
  });

  about.addEventListener("change", () => {
    build();
    refresh();
  });
  store.watch(({ view }) => view.source, build);
  store.watch(({ view }) => view.weights, press);
  store.watch(
    ({ panel, view }) => [panel, store.live, view.source, view.relight, view.exposure, view.white],
    () => refresh(),
  );
}
