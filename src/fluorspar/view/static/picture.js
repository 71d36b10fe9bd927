// Draws the pictures, the grid of pixels and the pins on one canvas. Knows nothing of the server.

import { pinColour } from "./colours.js";

const GRID_FROM = 8; // screen pixels a picture pixel must have before lines between them help
const SMOOTH_BELOW = 1;

function pixels(context, picture, viewport) {
  const { left, top, scale } = viewport;
  context.imageSmoothingEnabled = scale < SMOOTH_BELOW;
  context.imageSmoothingQuality = "high";
  picture.draw(context, left, top, scale);
}

function grid(context, picture, viewport, room) {
  const { left, top, scale } = viewport;
  if (scale < GRID_FROM) return;
  const right = Math.min(room.right, left + picture.width * scale);
  const bottom = Math.min(room.height, top + picture.height * scale);
  const line = (x0, y0, x1, y1) => {
    context.moveTo(Math.round(x0) + 0.5, Math.round(y0) + 0.5);
    context.lineTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5);
  };
  context.beginPath();
  for (let x = left + Math.max(0, Math.ceil((room.left - left) / scale)) * scale; x <= right + 0.5; x += scale)
    line(x, Math.max(0, top), x, bottom);
  for (let y = top + Math.max(0, Math.ceil(-top / scale)) * scale; y <= bottom + 0.5; y += scale)
    line(Math.max(room.left, left), y, right, y);
  context.lineWidth = 1;
  context.strokeStyle = "rgb(128 128 128 / 35%)";
  context.stroke();
}

function outline(context, region, viewport, colour, width) {
  const { left, top, scale } = viewport;
  const [x0, y0, x1, y1] = region;
  // a pixel smaller than 7 screen pixels still gets a mark that can be seen
  const grow = Math.max(0, (7 - (x1 - x0 + 1) * scale) / 2, (7 - (y1 - y0 + 1) * scale) / 2);
  const box = [left + x0 * scale - grow, top + y0 * scale - grow, (x1 - x0 + 1) * scale + 2 * grow, (y1 - y0 + 1) * scale + 2 * grow];
  context.lineWidth = width + 2;
  context.strokeStyle = "rgb(255 255 255 / 90%)";
  context.strokeRect(...box);
  context.lineWidth = width;
  context.strokeStyle = colour;
  context.strokeRect(...box);
  return box;
}

function pin(context, number, region, viewport, active) {
  const colour = pinColour(number);
  const [x, y] = outline(context, region, viewport, colour, active ? 3 : 1.5);
  context.font = "600 11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.beginPath();
  context.arc(x - 7, y - 7, 8, 0, 2 * Math.PI);
  context.fillStyle = colour;
  context.fill();
  context.lineWidth = 1.5;
  context.strokeStyle = "white";
  context.stroke();
  context.fillStyle = "white";
  context.fillText(`${number + 1}`, x - 7, y - 6.5);
}

/**
 * Draws all.
 *
 * `panes`: [{picture, left, right, shift}], from left to right on the stage; `shift` moves the origin of the viewport, so
 * that two panes side by side show the same part. `marks`: {pins, active, draft, cursor}.
 */
export function draw(canvas, panes, viewport, marks) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  for (const { picture, left, right, shift } of panes) {
    if (!picture) continue;
    context.save();
    context.beginPath();
    context.rect(left, 0, right - left, height);
    context.clip();
    context.translate(shift, 0);
    pixels(context, picture, viewport);
    grid(context, picture, viewport, { left: left - shift, right: right - shift, height });
    marks.pins.forEach(({ region }, index) => pin(context, index, region, viewport, index === marks.active));
    if (marks.draft) outline(context, marks.draft, viewport, "#222", 1.5);
    if (marks.cursor) outline(context, [marks.cursor.x, marks.cursor.y, marks.cursor.x, marks.cursor.y], viewport, "#222", 1.5);
    context.restore();
  }
}
