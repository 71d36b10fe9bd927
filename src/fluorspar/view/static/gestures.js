// What mouse, pen and keyboard mean on the picture.

const CLICK = 4; // a pointer that moved less than this many pixels has clicked
const SPEED = 0.0018;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

const pointOf = (canvas, event) => {
  const box = canvas.getBoundingClientRect();
  return { x: event.clientX - box.left, y: event.clientY - box.top };
};

/**
 * Listens on a canvas and calls
 * `zoom(factor, point)`, `pan(dx, dy)`, `hover(point | null)`, `click(point, {add})`, `drag(from, to)` while a region is
 * drawn and `region(from, to, {add})` in the end, `move(dx, dy)` of the keyboard's cursor, `enter({add})`, `anchor()`,
 * `cancel()`. `drawsRegions()` tells whether a plain drag draws a region; with Shift it does the other thing.
 */
export function listen(canvas, { drawsRegions, ...calls }) {
  let down = null;

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button > 1) return;
    canvas.setPointerCapture(event.pointerId);
    const draws = event.button === 0 && drawsRegions() !== event.shiftKey;
    down = { from: pointOf(canvas, event), last: pointOf(canvas, event), draws, moved: false, button: event.button };
  });
  canvas.addEventListener("pointermove", (event) => {
    const point = pointOf(canvas, event);
    if (!down) {
      calls.hover(point);
      return;
    }
    if (Math.hypot(point.x - down.from.x, point.y - down.from.y) >= CLICK) down.moved = true;
    if (!down.moved) return;
    if (down.draws) calls.drag(down.from, point);
    else calls.pan(point.x - down.last.x, point.y - down.last.y);
    down.last = point;
  });
  canvas.addEventListener("pointerup", (event) => {
    if (!down) return;
    const { from, moved, draws, button } = down;
    down = null;
    const how = { add: event.ctrlKey || event.metaKey };
    const point = pointOf(canvas, event);
    if (moved && draws) calls.region(from, point, how);
    else if (!moved && button === 0) calls.click(point, how);
  });
  canvas.addEventListener("pointercancel", () => {
    down = null;
    calls.cancel();
  });
  canvas.addEventListener("pointerleave", () => down || calls.hover(null));
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 33 : 1;
      // a pinch on a touchpad arrives as a small wheel with Ctrl
      calls.zoom(Math.exp(-event.deltaY * lines * SPEED * (event.ctrlKey ? 6 : 1)), pointOf(canvas, event));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    const arrow = ARROWS[event.key];
    if (arrow && !event.altKey && !event.metaKey && !event.ctrlKey) {
      const far = event.shiftKey ? 10 : 1;
      calls.move(arrow[0] * far, arrow[1] * far);
    } else if (event.key === "Enter") calls.enter({ add: event.ctrlKey || event.metaKey });
    else if (event.key === "m" || event.key === "M") calls.anchor();
    else if (event.key === "Escape") calls.cancel();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
}
