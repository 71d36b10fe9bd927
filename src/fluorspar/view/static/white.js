// What counts as white: nothing is adapted, or a lamp, an illuminant, or a pixel is shown as white.

import * as api from "./api.js";
import { h } from "./element.js";
import { shown } from "./numbers.js";
import { chosenIn, fillSelect } from "./menu.js";

const PICK = "pick";

export function whiteMenu(store, stage, about, report) {
  const select = h("select", { "aria-label": "White balance", title: "White balance: what is shown as white" });
  const fill = () => {
    const { white, source } = store.view;
    const { lights = [] } = about.source(source);
    const picked = Array.isArray(white) ? [[white, `Pixel: XYZ ${white.map((v) => shown(v, 3)).join(" ")}`]] : [];
    fillSelect(
      select,
      [
        [null, "White: as it is"],
        ...picked,
        [PICK, "Pick a pixel…"],
        { group: "Light of the scene", entries: lights.map(({ id }) => [{ light: id }, id]) },
        { group: "Illuminants", entries: about.library.illuminants.map(({ name }) => [name, name]) },
      ],
      white,
    );
  };
  select.addEventListener("change", () => {
    const chosen = chosenIn(select);
    if (chosen !== PICK) {
      store.change(({ view }) => (view.white = chosen));
      return;
    }
    fill();
    pick();
  });

  function pick() {
    stage.pick("Click what should look white, or drag a region", async (region) => {
      try {
        const { xyz } = await api.spectrum(store.view, region);
        if (xyz[1] > 0) store.change(({ view }) => (view.white = xyz));
        else report("There is no light at this pixel, so it cannot be white.");
      } catch (error) {
        report(error.message);
      }
    });
  }

  store.watch(({ view }) => [view.white, view.source], fill);
  return { node: h("div", { class: "tool" }, select), fill, pick };
}
