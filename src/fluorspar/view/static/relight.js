// Lights and dyes: what the light paths let one change without tracing again.

import { h } from "./element.js";
import { lightCards } from "./lights.js";
import { UNCHANGED } from "./state.js";
import { surfaceCards } from "./surfaces.js";

/** `show(is)`: whether the tab is there at all: an image alone knows nothing of its lights. */
export function relightPanel(node, context, show) {
  const { store, about } = context;
  const reset = h("button", { type: "button", title: "Lights and materials as in the scene", click: () => store.change(({ view }) => (view.relight = UNCHANGED)) }, "As in the scene");
  const [lights, surfaces] = [h("div"), h("div")];
  node.append(h("div", { class: "heading" }, h("h2", {}, "Lights"), reset), lights, h("div", { class: "heading" }, h("h2", {}, "Materials and dyes")), surfaces);
  const parts = [lightCards(lights, context), surfaceCards(surfaces, context)];
  const put = () => {
    reset.disabled = JSON.stringify(store.view.relight) === JSON.stringify(UNCHANGED);
    for (const part of parts) part.put();
  };
  let built = "";
  function build() {
    const { lights: known = [], surfaces: seen = [] } = about.source(store.view.source);
    show(known.length + seen.length > 0);
    const key = JSON.stringify([store.view.source, known, seen]);
    if (key === built) return; // refining a scene must not close what is open
    built = key;
    for (const part of parts) part.build();
    put();
  }
  about.addEventListener("change", build);
  store.watch(({ view }) => view.source, build);
  store.watch(({ view }) => view.relight, put);
}
