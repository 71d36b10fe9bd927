// Elements by function calls. Text goes in as text nodes, so nothing that a file or the server says can become markup.

const SVG = "http://www.w3.org/2000/svg";

function filled(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") node.addEventListener(name, value);
    else if (name in node && typeof value !== "string") node[name] = value;
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

/** An HTML element: h("button", {class: "primary", click: save}, "Save"). Functions are listeners. */
export function h(tag, attributes = {}, ...children) {
  return filled(document.createElement(tag), attributes, children);
}

/** An SVG element; its attributes are never properties. */
export function svg(tag, attributes = {}, ...children) {
  const texts = Object.entries(attributes).map(([name, value]) => [name, typeof value === "number" ? `${value}` : value]);
  return filled(document.createElementNS(SVG, tag), Object.fromEntries(texts), children);
}

/** A colour patch. The content security policy forbids style attributes, so the colour is set by script. */
export function swatch(colour) {
  const node = h("span", { class: "swatch", "aria-hidden": "true" });
  if (colour) node.style.backgroundColor = colour;
  return node;
}

let numbered = 0;

/** An id that no other element has, to tie labels to what they name. */
export function freshId() {
  numbered += 1;
  return `e${numbered}`;
}
