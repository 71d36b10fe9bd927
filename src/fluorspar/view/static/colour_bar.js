// The colour bar of a false-colour picture, with the ends of its range to be typed.

import { h } from "./element.js";
import { percent, shown, unitText } from "./numbers.js";

/** `react(range | null)`: what the ends are; null: those of the picture. */
export function colourBar(react) {
  let range = [0, 1];
  const bar = h("div", { class: "bar", role: "img" });
  const end = (label, index) =>
    h("input", {
      type: "number",
      class: "number wide",
      step: "any",
      "aria-label": label,
      change: (event) => {
        const next = [...range];
        next[index] = event.target.valueAsNumber;
        const sound = next.every(Number.isFinite) && next[0] < next[1];
        event.target.classList.toggle("wrong", !sound);
        if (sound) react(next);
      },
    });
  const ends = [end("Lowest value of the colour bar", 0), end("Highest value of the colour bar", 1)];
  const unit = h("span", { class: "unit" });
  const auto = h("button", { type: "button", "aria-pressed": "true", title: "The range of the picture", click: () => react(auto.ariaPressed === "true" ? range : null) }, "Auto");
  const node = h("div", { class: "colour-bar", role: "group", "aria-label": "Colour bar" }, ends[0], bar, ends[1], unit, auto);
  return {
    node,
    /** What the server says of the picture: {range, unit}; its colours; and whether the range is the picture's own. */
    put({ range: now, unit: of }, colours, automatic, relative) {
      if (!now) return;
      range = now;
      ends.forEach((field, index) => {
        if (document.activeElement !== field) field.value = shown(range[index], 3);
        field.classList.remove("wrong");
      });
      if (colours) bar.style.background = `linear-gradient(to right, ${colours.join(", ")})`;
      const ofBar = relative ? `${percent(range[0])} to ${percent(range[1])}` : `${shown(range[0])} to ${shown(range[1])} ${of ?? ""}`;
      bar.setAttribute("aria-label", `Colours from ${ofBar}`);
      bar.title = ofBar;
      unit.textContent = relative ? "of the radiance" : unitText(of ?? "");
      auto.ariaPressed = `${automatic}`;
    },
  };
}
