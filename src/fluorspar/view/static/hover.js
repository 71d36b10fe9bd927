// What lies under the pointer: asked while it moves, one pixel at a time.

import * as api from "./api.js";
import { viewOfOther } from "./frames.js";
import { latest } from "./latest.js";
import { luminanceUnit, shown } from "./numbers.js";

/** The 8-bit sRGB of one pixel of a picture. */
function shownColour(picture, { x, y }) {
  const canvas = new OffscreenCanvas(1, 1);
  const context = canvas.getContext("2d");
  picture.draw(context, -x, -y, 1);
  return [...context.getImageData(0, 0, 1, 1).data.slice(0, 3)];
}

/** Says "spectrum" when `spectrum` (or null) has changed. Writes the numbers into `output`. */
export class Hovered extends EventTarget {
  spectrum = null;

  constructor(stage, store, frames, output) {
    super();
    let now = null;
    const ask = latest(async (pixel) => {
      let spectrum = null;
      if (pixel) {
        const { state } = store;
        const { source, relight, weights } = pixel.side === "b" && state.other ? viewOfOther(state) : state.view;
        try {
          spectrum = await api.spectrum({ source, relight, weights }, [pixel.x, pixel.y, pixel.x, pixel.y]);
        } catch {
          // the picture says what is wrong; a pixel need not say it again
        }
      }
      if (now !== pixel) return;
      this.spectrum = spectrum;
      write(pixel, spectrum);
      this.dispatchEvent(new Event("spectrum"));
    });

    function write(pixel, spectrum) {
      if (!pixel) {
        output.textContent = "";
        return;
      }
      const { state } = store;
      const frame = pixel.side === "b" ? frames.b : frames.a;
      const colour = frame ? `   sRGB ${shownColour(frame.picture, pixel).join(" ")}` : "";
      const side = state.other ? `${pixel.side.toUpperCase()}   ` : "";
      const numbers = spectrum ? `   ${shown(spectrum.luminance)} ${luminanceUnit(spectrum.unit)}   x ${shown(spectrum.xy[0], 3)}  y ${shown(spectrum.xy[1], 3)}` : "";
      output.textContent = `${side}x ${pixel.x}  y ${pixel.y}${numbers}${colour}`;
    }

    frames.addEventListener("change", () => {
      if (!now) return;
      write(now, this.spectrum); // another picture lies under a pointer that rests
      if (!store.live) ask(now); // a coarse picture must not cost a sweep of all bands
    });
    stage.addEventListener("hover", ({ detail }) => {
      if (now && detail && now.x === detail.x && now.y === detail.y && now.side === detail.side) return;
      now = detail;
      output.ariaLive = detail?.byKeyboard ? "polite" : "off"; // a screen reader follows the keys, not the mouse
      if (!detail || !this.spectrum) write(detail, null);
      ask(detail);
    });
  }
}
