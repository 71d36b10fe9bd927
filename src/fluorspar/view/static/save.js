// Files of what is seen, and the command that makes them again.

import * as api from "./api.js";
import { copyText, download } from "./download.js";
import { freshId, h } from "./element.js";
import { latest } from "./latest.js";
import { notice } from "./notice.js";

const FORMATS = [
  ["nc", "NetCDF", "All components and wavelengths, as relit; opens in xarray and here"],
  ["exr", "Spectral EXR", "All components and wavelengths, as relit; opens in tev"],
  ["png", "PNG", "The picture as it is shown"],
  ["csv", "CSV", "The spectra of the pins"],
];

/** A name that every file system takes. */
const stemOf = (name) => name.replace(/\.(nc|exr|hdr|paths|xml)$/i, "").replace(/[^\p{L}\p{N}._-]+/gu, "-").slice(0, 80) || "fluorspar";

export function savePanel(node, { store, about }) {
  const [saving, commanding] = [notice(), notice()];
  const [nameId, commandId] = [freshId(), freshId()];
  const name = h("input", { type: "text", id: nameId, spellcheck: "false" });
  const told = h("p", { class: "hint", role: "status" });

  const buttons = FORMATS.map(([format, label, meaning]) => {
    const button = h("button", { type: "button", class: "primary", "data-format": format, click: async () => {
      const file = `${stemOf(name.value)}.${format}`;
      told.textContent = `Writing ${file} …`;
      button.disabled = true;
      const { view, pins } = store.state;
      const blob = await saving.of(async () =>
        format === "csv"
          ? new Blob([await api.csv(view, pins.map(({ region }, index) => ({ name: `${index + 1}`, region })))], { type: "text/csv" })
          : api.save(view, format, file));
      put();
      told.textContent = blob ? `Handed ${file} to the browser, which saves it among its downloads.` : "";
      if (blob) download(blob, file);
    } }, label);
    return [format, button, meaning];
  });
  const command = h("pre", { class: "command", id: commandId, tabindex: "0" });
  const files = h("span", { class: "buttons" }); // spectra that the command reads
  const notes = h("ul", { class: "notes hint" });
  const copied = h("span", { class: "hint", role: "status" });
  const copy = h("button", { type: "button", click: async () => (copied.textContent = (await copyText(command.textContent)) ? "Copied" : "The browser forbids to copy") }, "Copy");

  node.append(
    h("h2", {}, "Save"),
    h("div", { class: "field" }, h("label", { for: nameId }, "Name"), name),
    h("dl", { class: "formats" }, buttons.map(([, button, meaning]) => [h("dt", {}, button), h("dd", {}, meaning)])),
    told,
    saving.node,
    h("h2", {}, "The command that makes it again"),
    command,
    h("div", { class: "buttons" }, copy, files, copied),
    notes,
    commanding.node,
  );

  function put() {
    const { pins } = store.state;
    for (const [format, button] of buttons) button.disabled = format === "csv" && pins.length === 0;
    buttons.find(([format]) => format === "csv")[1].title = pins.length ? "" : "Pin a pixel first: click it";
  }
  const refresh = latest(async () => {
    if (store.state.panel !== "save" || store.live) return;
    const answer = await commanding.of(() => api.command(store.view));
    command.textContent = answer?.command ?? "";
    command.hidden = !answer;
    copied.textContent = "";
    const texts = Object.entries(answer?.files ?? {});
    files.replaceChildren(...texts.map(([file, text]) => h("button", { type: "button", title: "A spectrum that the command reads", click: () => download(new Blob([text], { type: "text/csv" }), file) }, file)));
    notes.replaceChildren(...(answer?.notes ?? []).map((note) => h("li", {}, note)));
  });
  store.watch(({ view }) => view.source, (source) => (name.value = stemOf(about.title(source))));
  store.watch(({ pins }) => pins.length, put);
  store.watch(({ panel, view }) => [panel, view, store.live], () => refresh());
}
