// Where the picture lies on the screen: a scale and an offset, in CSS pixels.

import { clamp } from "./numbers.js";

const LARGEST = 96;
const MARGIN = 12;

export class Viewport {
  scale = 1;
  left = 0;
  top = 0;
  /** Whether it follows the size of the stage; false as soon as somebody zooms or pans. */
  fitted = true;

  /** The whole picture, as large as it fits; small pictures by a whole factor, so that their pixels are equal. */
  fit(picture, room) {
    const fits = Math.min((room.width - 2 * MARGIN) / picture.width, (room.height - 2 * MARGIN) / picture.height);
    this.#place(picture, room, fits >= 2 ? Math.floor(fits) : Math.max(fits, 0.01));
    this.fitted = true;
  }

  /** One picture pixel is one CSS pixel. */
  actual(picture, room) {
    this.#place(picture, room, 1);
    this.fitted = false;
  }

  #place(picture, room, scale) {
    this.scale = scale;
    this.left = Math.round((room.width - picture.width * scale) / 2);
    this.top = Math.round((room.height - picture.height * scale) / 2);
  }

  /** Zooms by a factor; what is under `point` stays there. */
  zoom(factor, point) {
    const scale = clamp(this.scale * factor, 0.05, LARGEST);
    const by = scale / this.scale;
    this.left = point.x - (point.x - this.left) * by;
    this.top = point.y - (point.y - this.top) * by;
    this.scale = scale;
    this.fitted = false;
  }

  /** Moves the picture, though never out of sight. */
  pan(dx, dy, picture, room) {
    this.left = clamp(this.left + dx, 40 - picture.width * this.scale, room.width - 40);
    this.top = clamp(this.top + dy, 40 - picture.height * this.scale, room.height - 40);
    this.fitted = false;
  }

  /** Moves the picture as little as needed to show a pixel. */
  reveal(pixel, room) {
    const [x, y] = [this.left + (pixel.x + 0.5) * this.scale, this.top + (pixel.y + 0.5) * this.scale];
    const edge = Math.min(this.scale, room.width / 4, room.height / 4);
    this.left += clamp(x, edge, room.width - edge) - x;
    this.top += clamp(y, edge, room.height - edge) - y;
  }

  /** The pixel of the picture under a point of the stage; may lie outside of it. */
  pixel(point) {
    return { x: Math.floor((point.x - this.left) / this.scale), y: Math.floor((point.y - this.top) / this.scale) };
  }
}
