// Starts the page: asks what there is, puts the parts together, keeps the address bar in step.

import { About } from "./about.js";
import { compareStrip } from "./compare.js";
import { componentsPanel } from "./components.js";
import { h } from "./element.js";
import { Frames } from "./frames.js";
import { Hovered } from "./hover.js";
import { icon } from "./icons.js";
import { infoPanel } from "./info.js";
import { listenToKeys, showKeys } from "./keys.js";
import { relightPanel } from "./relight.js";
import { savePanel } from "./save.js";
import { shortcuts } from "./shortcuts.js";
import { spectrumPanel } from "./spectrum.js";
import { Stage } from "./stage.js";
import { hashOf, stateOf, Store } from "./state.js";
import { statusLine } from "./status.js";
import { tabs } from "./tabs.js";
import { startTheme } from "./theme.js";
import { toolbar } from "./toolbar.js";

const TABS = [["components", "Components"], ["spectrum", "Spectrum"], ["relight", "Light & dyes"], ["save", "Save"], ["info", "Info"]];
const HASH_AFTER = 250; // ms: browsers limit how often an address may change

const part = (id) => document.getElementById(id);

/** A message that goes away by itself, for what belongs to no part of the page. */
function report(text) {
  const toast = h("div", { class: "toast", role: "alert" }, text);
  document.body.append(toast);
  setTimeout(() => toast.remove(), 8000);
}

function keepHash(store, first, sources) {
  let timer = null;
  store.watch(
    (state) => state,
    () => {
      clearTimeout(timer);
      timer = setTimeout(() => history.replaceState(null, "", hashOf(store.state, first) || location.pathname), HASH_AFTER);
    },
  );
  const take = () => {
    try {
      const state = stateOf(location.hash, sources());
      if (state) store.restore(state);
    } catch {
      report("The address describes a view that does not fit what is opened here; it was left out.");
    }
  };
  addEventListener("hashchange", take);
  return take;
}

/** Zoom and tools, over a corner of the picture. */
function stageTools(node, stage) {
  const tool = (name, text, title) => h("button", { type: "button", class: "icon", "aria-label": text, title, click: () => (stage.tool = name) }, icon(name === "pan" ? "hand" : "region"));
  const tools = { pan: tool("pan", "Drag moves the picture", "Drag moves the picture (V)"), region: tool("region", "Drag draws a region", "Drag draws a region (B)") };
  const put = () => Object.entries(tools).forEach(([name, button]) => (button.ariaPressed = `${stage.tool === name}`));
  stage.addEventListener("tool", put);
  put();
  const zoom = (text, label, click) => h("button", { type: "button", class: "icon", "aria-label": label, title: label, click }, text);
  node.append(
    ...Object.values(tools),
    zoom("−", "Zoom out (−)", () => stage.zoom(1 / 1.5)),
    zoom("+", "Zoom in (+)", () => stage.zoom(1.5)),
    zoom("1:1", "One pixel of the picture on one of the screen (Z)", () => stage.actual()),
    zoom("Fit", "The whole picture (F)", () => stage.fit()),
  );
}

async function start() {
  startTheme();
  const about = new About();
  await about.load();
  if (!about.sources.length) {
    part("opening").replaceChildren(h("strong", {}, "Nothing is opened"), h("p", {}, "Start 'fluorspar view' with an image, light paths or a scene."));
    return;
  }
  part("opening").remove();
  const first = about.sources[0].id;
  const store = new Store(first);
  const takeHash = keepHash(store, first, () => about.sources);
  takeHash();
  const frames = new Frames(store, about);
  const stage = new Stage(part("picture-place"), store, frames);
  const context = { store, about, stage, frames, report, help: () => showKeys(bindings) };
  stageTools(part("stage-tools"), stage);
  compareStrip(part("strip"), part("picture-place"), context);
  const hovered = new Hovered(stage, store, frames, part("readout"));
  const panel = tabs(store, TABS);
  part("panel").append(...panel.nodes);
  const tools = toolbar(part("toolbar"), context);
  componentsPanel(panel.pages.components, context);
  spectrumPanel(panel.pages.spectrum, { ...context, hovered });
  relightPanel(panel.pages.relight, context, (is) => panel.show("relight", is));
  savePanel(panel.pages.save, context);
  infoPanel(panel.pages.info, context, (is) => panel.mark("info", is));
  statusLine(part("status"), context);

  const bindings = shortcuts(context, tools, panel);
  listenToKeys(bindings);
}

start().catch((error) => {
  const cover = h("div", { class: "cover", role: "alert" }, h("strong", {}, "The page cannot start"), h("p", {}, error.message));
  part("picture-place").replaceChildren(cover);
});
