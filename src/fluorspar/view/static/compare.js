// Two images: which one B is, how both are shown, and how far they differ.

import { choice } from "./choice.js";
import { h } from "./element.js";
import { chosenIn, fillSelect } from "./menu.js";
import { shown } from "./numbers.js";
import { UNCHANGED } from "./state.js";

const KEEP = "keep";
const isRelit = ({ relight }) => Object.values(relight).some((changes) => Object.keys(changes).length);

/** The menu in the toolbar: what to compare with. */
export function compareMenu(store, about) {
  const select = h("select", { "aria-label": "Compare with", title: "Compare with another image (C: keep what you see as B)" });
  const others = () => {
    const { view } = store.state;
    const rest = about.sources.filter(({ id }) => id !== view.source);
    const before = isRelit(view) ? [[{ name: "as it was", source: view.source, relight: UNCHANGED, weights: view.weights }, "The light as it was"]] : [];
    return [...before, ...rest.map(({ id }) => [{ name: about.title(id), source: id, relight: UNCHANGED, weights: {} }, about.title(id)])];
  };
  const fill = () => {
    const { other } = store.state;
    const offered = others();
    const listed = offered.some(([value]) => JSON.stringify(value) === JSON.stringify(other));
    fillSelect(
      select,
      [[null, other ? "Do not compare" : "Compare…"], ...(other && !listed ? [[other, `B: ${other.name}`]] : []), ...offered, [KEEP, "Keep what I see as B"]],
      other,
    );
  };
  select.addEventListener("change", () => {
    const chosen = chosenIn(select);
    if (chosen === KEEP) keep();
    else store.change((state) => (state.other = chosen));
    fill();
  });
  function keep() {
    const { source, relight, weights } = store.view;
    store.change((state) => (state.other = structuredClone({ name: "as kept", source, relight, weights })));
  }
  store.watch(({ view, other }) => [view.source, view.relight, view.weights, other], fill);
  return { node: select, fill, keep };
}

/** The strip below the pictures: names, layout, CIEDE2000; and the scale of the map, over a corner of `place`. */
export function compareStrip(node, place, { store, frames, about }) {
  const names = h("span", { class: "names" });
  const numbers = h("output", { class: "numbers", "aria-label": "CIEDE2000 of A and B" });
  const layout = choice(
    "Layout",
    [
      ["slider", "Slider", "A on the left of the line, B on the right"],
      ["side", "Sides", "A and B side by side, at the same place"],
      ["map", "ΔE map", "How far each pixel differs, CIEDE2000"],
    ],
    (value) => store.change((state) => (state.layout = value), { quiet: true }),
  );
  const close = h("button", { type: "button", class: "plain", "aria-label": "Stop comparing", title: "Stop comparing", click: () => store.change((state) => (state.other = null)) }, "✕");
  const [low, high] = [h("output"), h("output")];
  const bar = h("span", { class: "bar" });
  bar.style.background = `linear-gradient(to right, ${(about.colour_maps.difference?.stops ?? ["black", "white"]).join(", ")})`;
  const scale = h("span", { class: "scale over-corner", title: "The colours of the map, CIEDE2000" }, low, bar, high);
  node.append(names, layout.node, numbers, close);
  place.append(scale);

  store.watch(
    ({ other, layout: chosen, view }) => [other, chosen, view.source],
    ([other, chosen, source]) => {
      node.hidden = !other;
      layout.put(chosen);
      scale.hidden = !other || chosen !== "map";
      if (other) names.replaceChildren(h("b", {}, "A"), ` ${about.title(source)}  `, h("b", {}, "B"), ` ${other.name}`);
    },
  );
  frames.addEventListener("change", () => {
    const facts = frames.difference?.facts;
    const { mean, median, p95, max, range, error, noise, text } = facts ?? {};
    const verdict = noise?.differs === false ? " · no more than noise" : "";
    node.classList.toggle("is-fault", Boolean(error));
    [low.textContent, high.textContent] = (range ?? []).map((value) => shown(value, 3));
    numbers.textContent = error ?? (facts ? `ΔE00: mean ${shown(mean, 3)} · median ${shown(median, 3)} · 95 % ${shown(p95, 3)} · max ${shown(max, 3)}${verdict}` : "");
    numbers.title = error ?? text ?? "";
  });
}
