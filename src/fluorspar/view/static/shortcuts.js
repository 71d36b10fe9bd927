// The keys of the whole page: what they are called, what they mean, what they do.

import { MODES } from "./toolbar.js";

const plain = (event) => !event.ctrlKey && !event.metaKey && !event.altKey;
const key = (...names) => (event) => plain(event) && names.includes(event.key);
const control = (name, shift) => (event) =>
  (event.ctrlKey || event.metaKey) && !event.altKey && event.shiftKey === shift && event.key.toLowerCase() === name;

/** [[the keys in words, their meaning, [[matches(event), act], ...]], ...] */
export function shortcuts({ store, stage, help }, tools, panel) {
  const onView = (edit) => () => store.change(({ view }) => edit(view));
  const redo = () => store.redo();
  return [
    ["?", "this list", [[key("?"), help]]],
    ["1 2 3 4", "colour, band, error, relative error", MODES.map(([mode], index) => [key(`${index + 1}`), () => tools.setMode(mode)])],
    ["E, Shift + E", "brighter, darker by half a stop", [[key("e"), () => tools.exposure.step(0.5)], [key("E"), () => tools.exposure.step(-0.5)]]],
    ["N", "automatic exposure", [[key("n"), onView((view) => (view.exposure = null))]]],
    ["G", "mark colours that sRGB cannot show", [[key("g"), onView((view) => (view.gamut = !view.gamut))]]],
    ["W", "pick a white pixel", [[key("w"), tools.white.pick]]],
    ["C", "keep what you see as B, to compare", [[key("c"), tools.compare.keep]]],
    ["X", "stop comparing", [[key("x"), () => store.change((state) => (state.other = null))]]],
    ["F, Z", "whole picture, 1:1", [[key("f"), () => stage.fit()], [key("z"), () => stage.actual()]]],
    ["+, −", "zoom", [[key("+", "="), () => stage.zoom(1.5)], [key("-"), () => stage.zoom(1 / 1.5)]]],
    ["V, B", "a drag moves, a drag draws a region", [[key("v"), () => (stage.tool = "pan")], [key("b"), () => (stage.tool = "region")]]],
    ["P", "to the picture, for its keys", [[key("p"), () => stage.canvas.focus()]]],
    ["T, Shift + T", "next, previous tab of the panel", [[key("t"), () => panel.step(1)], [key("T"), () => panel.step(-1)]]],
    ["Ctrl + Z", "undo", [[control("z", false), () => store.undo()]]],
    ["Ctrl + Shift + Z", "redo", [[control("z", true), redo], [control("y", false), redo]]],
  ];
}
