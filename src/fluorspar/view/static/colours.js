// The fixed colours of things that have a name. They read on a dark and on a light ground.

/** Reflections are blue, luminescence is warm; the more bounces, the paler. */
export const COMPONENT = {
  source: "#8a8a8a",
  direct_reflection: "#2f7ed8",
  direct_luminescence: "#e8590c",
  indirect_reflection: "#7fb2ea",
  indirect_luminescence: "#f59f5f",
  luminescent_reflection: "#c9a227",
  reexcitation: "#b5468b",
};

export const componentColour = (name) => COMPONENT[name] ?? "#5f9ea0";

const PINS = ["#e03131", "#0ca678", "#7048e8", "#f08c00", "#1098ad", "#d6336c", "#66a80f", "#495057"];

export const MOST_PINS = PINS.length;
export const pinColour = (index) => PINS[index % PINS.length];
