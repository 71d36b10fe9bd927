// What is known of the image: size, wavelengths, and what its file says of how it was made.

import { h } from "./element.js";
import { shown, unitText } from "./numbers.js";

const KINDS = { image: "image", paths: "light paths", scene: "scene, traced here" };

function grid(wavelengths) {
  const steps = new Set(wavelengths.slice(1).map((nm, i) => Number((nm - wavelengths[i]).toPrecision(6))));
  const by = steps.size === 1 ? ` by ${[...steps][0]}` : "";
  return `${shown(wavelengths[0])}–${shown(wavelengths.at(-1))} nm${by}, ${wavelengths.length} bands`;
}

/** Facts within facts as lines, those without a value left out. */
function written(value) {
  if (value === null || typeof value !== "object") return `${value}`;
  if (Array.isArray(value)) return value.map(written).join(", ");
  return Object.entries(value).filter(([, inner]) => inner !== "" && inner !== null).map(([key, inner]) => `${key}: ${written(inner)}`).join("\n");
}

/** `mark(is)`: whether there is something to read. */
export function infoPanel(node, { store, about, frames }, mark) {
  const facts = h("dl", { class: "facts" });
  const notes = h("ul", { class: "notes" });
  node.append(h("h2", {}, "Image"), facts, notes, h("p", { class: "hint" }, "Fluorspar ", h("span", { class: "version" })));
  function put() {
    const { name, kind, size, wavelengths, unit, components, standard_error: known, partial, attrs } = about.source(store.view.source);
    const rows = [
      ["Name", name],
      ["Kind", KINDS[kind] ?? kind],
      size && ["Size", `${size[0]} × ${size[1]} pixels`],
      wavelengths?.length && ["Wavelengths", grid(wavelengths)],
      unit && ["Unit", unitText(unit)],
      components?.length && ["Components", `${components.length}`],
      ["Standard errors", known ? "yes" : "none"],
      partial && ["Partial", "some pixels were not rendered"],
      ...Object.entries(attrs ?? {}).map(([key, value]) => [key, written(value ?? "")]).filter(([, value]) => value),
    ];
    facts.replaceChildren(...rows.filter(Boolean).flatMap(([key, value]) => [h("dt", {}, key), h("dd", {}, value)]));
    node.querySelector(".version").textContent = about.version;
  }
  frames.addEventListener("change", () => {
    const texts = frames.a?.facts.notes ?? [];
    notes.replaceChildren(...texts.map((text) => h("li", {}, text)));
    mark(texts.length > 0);
  });
  about.addEventListener("change", put);
  store.watch(({ view }) => view.source, put);
}
