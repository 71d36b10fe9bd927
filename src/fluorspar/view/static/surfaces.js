// The surfaces of a scene: which material each has, and how much of its dye.

import { showDonaldson } from "./donaldson.js";
import { h, swatch } from "./element.js";
import { materialList } from "./material_list.js";
import { notice } from "./notice.js";
import { slider } from "./slider.js";
import { chooseFile, uploaded, uploadsOf } from "./uploads.js";

function surfaceCard(surface, { store, about }) {
  const { id } = surface;
  const fault = notice();
  const known = (name) => about.library.materials.find((material) => material.name === name);
  const own = { name: surface.front ?? surface.back ?? "as in the scene", srgb: surface.srgb, fluorescent: surface.fluorescent, ...known(surface.front ?? surface.back) };
  const setMaterial = (value) =>
    store.change(({ view }) => {
      if (value === null) delete view.relight.materials[id];
      else view.relight.materials[id] = value;
    });
  const patch = h("span", { class: "patch" });
  const label = h("span", { class: "material-name" });
  const list = materialList(id, setMaterial);
  const upload = h("button", { type: "button", click: async () => {
    const file = await fault.of(() => chooseFile("material"));
    if (!file) return;
    setMaterial(file.id);
    fill();
    put();
  } }, "From a file…");
  const matrix = h("button", { type: "button", title: "The Donaldson matrix as a picture", click: () => showDonaldson(store.view, surface, about.colour_maps.matrix.stops) }, "Matrix");
  const concentration = slider({
    label: "Dye", low: 0, high: 3, least: 0, most: 1e6, step: 0.05, plain: 1, unit: "×", digits: 3,
    react: (value, live) =>
      store.change(
        ({ view }) => {
          if (value === 1) delete view.relight.concentration[id];
          else view.relight.concentration[id] = value;
        },
        { live },
      ),
  });
  concentration.node.title = "Factor on the luminescence of the surface, as the concentration of its dye";
  const choose = h("details", { class: "choose" }, h("summary", {}, patch, h("span", { class: "surface-name" }, id), label), list.node, h("div", { class: "buttons" }, upload));
  choose.addEventListener("toggle", () => {
    if (!choose.open) return;
    fill();
    put();
  });
  const node = h("section", { class: "card surface", "aria-label": `Surface ${id}`, "data-surface": id }, h("header", {}, choose, matrix), concentration.node, fault.node);

  const described = () => {
    const value = store.view.relight.materials[id];
    return value === undefined ? own : (uploaded.get(value) ?? known(value) ?? { name: value });
  };

  function fill() {
    list.fill([
      { ...own, value: null, name: "As in the scene" },
      ...uploadsOf("material").map((file) => ({ ...file, value: file.id, description: "a file" })),
      ...about.library.materials.map((material) => ({ ...material, value: material.name })),
    ]);
  }

  function put() {
    const now = described();
    patch.replaceChildren(swatch(now.srgb));
    label.textContent = now.name;
    list.put(store.view.relight.materials[id] ?? null);
    concentration.node.hidden = now.fluorescent === false;
    concentration.put(store.view.relight.concentration[id] ?? 1);
    node.classList.toggle("changed", id in store.view.relight.materials || id in store.view.relight.concentration);
  }
  return { node, put };
}

/** Fills a part of the panel with the surfaces; `put()` brings them up to date with the view. */
export function surfaceCards(node, context) {
  let cards = [];
  return {
    build() {
      const { surfaces = [] } = context.about.source(context.store.view.source);
      const able = surfaces.filter(({ why_not: why }) => !why);
      const unable = surfaces.filter(({ why_not: why }) => why);
      cards = able.map((surface) => surfaceCard(surface, context));
      const rest = h(
        "details",
        { class: "unable" },
        h("summary", {}, `${unable.length} ${unable.length === 1 ? "surface" : "surfaces"} whose material cannot be changed`),
        h("dl", {}, unable.map(({ id, why_not: why }) => [h("dt", {}, id), h("dd", {}, why)])),
      );
      node.replaceChildren(...cards.map((card) => card.node), unable.length ? rest : "");
    },
    put: () => cards.forEach((card) => card.put()),
  };
}
