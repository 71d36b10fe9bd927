// A band of wavelengths on a track in the colours of the spectrum: two ends, and the band between them that moves.

import { h } from "./element.js";
import { clamp } from "./numbers.js";

/**
 * `react([from, to], live)`. The middle handle moves the band, the outer ones its ends; a click on the track moves the
 * band there. Bands begin and end on the image's own wavelengths, which `range` sets.
 */
export function bandSlider(react) {
  let grid = [400, 700];
  let band = [540, 560];
  const track = h("div", { class: "band-track" });
  const handles = {
    from: handle("First wavelength of the band"),
    middle: handle("Middle of the band"),
    to: handle("Last wavelength of the band"),
  };
  handles.middle.classList.add("middle");
  const fields = ["from", "to"].map((end, index) =>
    h("input", {
      type: "number",
      class: "number",
      "aria-label": `Band ${end}, nm`,
      change: (event) => {
        const typed = event.target.valueAsNumber;
        if (Number.isFinite(typed)) moveEnd(index, typed, false);
        else put(band);
      },
    }),
  );
  const node = h("div", { class: "band", role: "group", "aria-label": "Band" }, fields[0], track, fields[1], h("span", { class: "unit" }, "nm"));
  track.append(handles.middle, handles.from, handles.to);

  function handle(label) {
    return h("div", { class: "band-handle", role: "slider", tabindex: "0", "aria-label": label });
  }
  const nearest = (nm) => grid.reduce((best, w) => (Math.abs(w - nm) < Math.abs(best - nm) ? w : best));
  const share = (nm) => clamp((nm - grid[0]) / (grid.at(-1) - grid[0] || 1), 0, 1);
  const told = (next, live) => {
    put(next);
    react(next, live);
  };

  function moveEnd(index, nm, live) {
    const next = [...band];
    next[index] = nearest(nm);
    // an end that is pushed across the other takes it along
    if (next[0] > next[1]) next[1 - index] = next[index];
    told(next, live);
  }

  /** Moves the band by whole steps of the grid, so that its width stays. */
  function moveTo(first, live) {
    const width = grid.indexOf(nearest(band[1])) - grid.indexOf(nearest(band[0]));
    const start = clamp(first, 0, grid.length - 1 - width);
    told([grid[start], grid[start + width]], live);
  }

  function put(next) {
    band = next;
    fields[0].value = `${band[0]}`;
    fields[1].value = `${band[1]}`;
    const [a, b] = band.map(share);
    handles.from.style.left = `${a * 100}%`;
    handles.to.style.left = `${b * 100}%`;
    handles.middle.style.left = `${a * 100}%`;
    handles.middle.style.width = `${(b - a) * 100}%`;
    const now = { from: band[0], to: band[1], middle: (band[0] + band[1]) / 2 };
    for (const [name, node] of Object.entries(handles)) {
      node.setAttribute("aria-valuenow", now[name]);
      node.setAttribute("aria-valuetext", `${now[name]} nm`);
    }
  }

  const nmOf = (event) => {
    const box = track.getBoundingClientRect();
    return grid[0] + clamp((event.clientX - box.left) / box.width, 0, 1) * (grid.at(-1) - grid[0]);
  };
  let dragged = null;
  track.addEventListener("pointerdown", (event) => {
    const name = Object.keys(handles).find((key) => handles[key] === event.target) ?? "middle";
    const centre = (band[0] + band[1]) / 2;
    // a grabbed band keeps its distance to the pointer, a clicked track centres the band there
    dragged = { name, off: name === "middle" && event.target !== track ? nmOf(event) - centre : 0 };
    track.setPointerCapture(event.pointerId);
    handles[name].focus();
    event.preventDefault();
    follow(event, true);
  });
  function follow(event, live) {
    const nm = nmOf(event) - dragged.off;
    if (dragged.name === "middle") moveTo(grid.indexOf(nearest(nm - (band[1] - band[0]) / 2)), live);
    else moveEnd(dragged.name === "from" ? 0 : 1, nm, live);
  }
  track.addEventListener("pointermove", (event) => dragged && follow(event, true));
  for (const end of ["pointerup", "pointercancel"])
    track.addEventListener(end, () => {
      if (!dragged) return;
      dragged = null;
      react(band, false);
    });
  track.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -5, PageUp: 5 }[event.key];
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.target === handles.middle) moveTo(grid.indexOf(nearest(band[0])) + by, false);
    else {
      const index = event.target === handles.from ? 0 : 1;
      moveEnd(index, grid[clamp(grid.indexOf(nearest(band[index])) + by, 0, grid.length - 1)], false);
    }
  });

  return {
    node,
    put,
    /** The wavelengths of the image in nm. */
    range(wavelengths) {
      grid = wavelengths;
      for (const field of fields) Object.assign(field, { min: `${grid[0]}`, max: `${grid.at(-1)}`, step: "any" });
      for (const node of Object.values(handles)) {
        node.setAttribute("aria-valuemin", grid[0]);
        node.setAttribute("aria-valuemax", grid.at(-1));
      }
      track.style.background = rainbow(grid[0], grid.at(-1));
    },
  };
}

/** About the colours of the spectrum: enough to find one's way on a track, nothing to measure by. */
export function rainbow(low, high) {
  const stops = [
    [380, "#3b0a4a"], [420, "#4b19a8"], [450, "#2340e0"], [480, "#129ae0"], [500, "#12b48c"], [530, "#3fb52c"],
    [565, "#b9c417"], [585, "#edb418"], [605, "#f08019"], [640, "#dc2f1d"], [700, "#8a1712"], [760, "#3a0c0a"],
  ];
  const inside = stops.map(([nm, colour]) => `${colour} ${(((nm - low) / (high - low || 1)) * 100).toFixed(1)}%`);
  return `linear-gradient(to right, ${inside.join(", ")})`;
}
