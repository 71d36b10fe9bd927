// What the page says of itself: nothing there yet, working, refining, the server gone.

import * as api from "./api.js";
import { h } from "./element.js";

const spinner = () => h("span", { class: "spinner", "aria-hidden": "true" });

function progressText({ doing, done, all, samples }) {
  const part = all > 0 ? ` ${Math.floor((100 * done) / all)} %` : "";
  const so = samples ? `, ${samples} samples so far` : "";
  return `${doing[0].toUpperCase()}${doing.slice(1)}${part}${so}`;
}

/** Covers the stage while there is no picture, and writes the line below it. */
export function statusLine(node, { store, about, stage, frames }) {
  const working = h("span", { class: "working", role: "status" });
  const zoom = h("span", { class: "zoom" });
  const size = h("span", { class: "hint" });
  node.append(working, size, zoom);
  let gone = false;

  function put() {
    const source = about.source(store.view.source);
    const { progress, error } = source;
    cover(source, progress, error, about.title(store.view.source));
    const busy = frames.working ? [spinner(), "Working"] : [];
    const refining = progress ? [progress.doing ? progressText(progress) : ""] : [];
    working.replaceChildren(...(gone ? [h("b", { class: "lost" }, new api.Gone().message)] : refining.length ? [spinner(), ...refining] : busy));
    size.textContent = source.size ? `${source.size[0]} × ${source.size[1]} pixels` : "";
    document.body.classList.toggle("gone", gone);
  }

  function cover(source, progress, error, name) {
    if (error) stage.cover(h("strong", {}, `${name} cannot be shown`), h("p", {}, error));
    else if (frames.a || frames.error) stage.cover();
    else if (progress) {
      const bar = h("progress", { max: "1", "aria-label": "Progress" });
      if (progress.all > 0) bar.value = progress.done / progress.all;
      stage.cover(h("strong", {}, `${name}: ${progressText(progress)}`), bar, h("p", {}, "The picture appears as soon as there is something to see, and refines while you look."));
    } else stage.cover(spinner(), h("strong", {}, "Making the picture"), source.kind === "image" ? null : h("p", {}, "The first image after the installation takes some seconds more, because code is compiled."));
  }

  stage.addEventListener("zoom", () => (zoom.textContent = `${stage.scale >= 1 ? Number(stage.scale.toFixed(1)) : stage.scale.toFixed(2)} ×`));
  for (const [target, event] of [[about, "change"], [about, "progress"], [frames, "change"], [frames, "work"]]) target.addEventListener(event, put);
  api.contact.addEventListener("gone", () => {
    gone = true;
    put();
  });
  api.contact.addEventListener("back", () => {
    gone = false;
    put();
  });
  store.watch(({ view }) => view.source, put);
}
