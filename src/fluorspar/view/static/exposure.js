// Exposure in stops from the one that the picture itself suggests, as photographers count.

import { h } from "./element.js";
import { clamp, shown } from "./numbers.js";
import { slider } from "./slider.js";

const STOPS = 8;

export function exposureControl(store) {
  let suggested = null; // m2/cd
  const set = (stops, live) => {
    const exposure = (suggested ?? 1) * 2 ** clamp(stops, -STOPS * 2, STOPS * 2);
    store.change(({ view }) => (view.exposure = exposure), { live });
  };
  const stops = slider({
    label: "Exposure", low: -STOPS, high: STOPS, least: -2 * STOPS, most: 2 * STOPS, step: 0.25, plain: 0, unit: "EV", digits: 3,
    react: set,
  });
  const auto = h("button", {
    type: "button",
    title: "The exposure that the picture suggests (N)",
    click: () => store.change(({ view }) => (view.exposure = view.exposure === null ? suggested : null)),
  }, "Auto");
  stops.put(0);
  const white = h("output", { class: "hint white-at" });
  return {
    node: h("div", { class: "tool exposure" }, stops.node, auto, white),
    /** One step of a key, in stops. */
    step: (by) => set(now() + by, false),
    put({ exposure, white_at: at }) {
      const automatic = store.view.exposure === null;
      // the first picture of an address that sets the exposure suggests none: its own then counts as 0 EV
      if (exposure && (automatic || suggested === null)) suggested = exposure;
      auto.ariaPressed = `${automatic}`;
      stops.put(now());
      white.textContent = at ? `white: ${shown(at, 3)} cd/m²` : "";
    },
  };

  function now() {
    const { exposure } = store.view;
    return exposure === null || !suggested ? 0 : Math.log2(exposure / suggested);
  }
}
