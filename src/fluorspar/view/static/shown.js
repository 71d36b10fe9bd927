// A picture as it is shown: of a large image some of its pixels, and all of them in the part that one looks at.

/** `width` and `height` are those of the image, whatever the bitmap has. */
export class Shown {
  detail = null; // {bitmap, region}: x0, y0, x1, y1, inclusive

  constructor(bitmap, [width, height]) {
    Object.assign(this, { bitmap, width, height });
  }

  /** Pixels of the bitmap for one of the image. */
  get share() {
    return Math.max(this.bitmap.width / this.width, this.bitmap.height / this.height);
  }

  /** The part of a region that is in the image; null if none is. */
  within([x0, y0, x1, y1]) {
    const [right, bottom] = [Math.min(x1, this.width - 1), Math.min(y1, this.height - 1)];
    return x0 <= right && y0 <= bottom ? [x0, y0, right, bottom] : null;
  }

  /** Whether a region is there in the detail that a scale shows, or the best there is of it. */
  covers(region, scale) {
    const part = this.within(region);
    if (!part || this.share >= Math.min(scale, 1)) return true;
    if (!this.detail) return false;
    const [left, top, right, bottom] = this.detail.region;
    const [x0, y0, x1, y1] = part;
    if (left === x0 && top === y0 && right === x1 && bottom === y1) return true;
    const share = this.detail.bitmap.width / (right + 1 - left);
    return left <= x0 && top <= y0 && right >= x1 && bottom >= y1 && share >= Math.min(scale, 1);
  }

  draw(context, left, top, scale) {
    context.drawImage(this.bitmap, left, top, this.width * scale, this.height * scale);
    if (!this.detail || this.share >= Math.min(scale, 1)) return;
    const [x0, y0, x1, y1] = this.detail.region;
    context.drawImage(this.detail.bitmap, left + x0 * scale, top + y0 * scale, (x1 + 1 - x0) * scale, (y1 + 1 - y0) * scale);
  }

  close() {
    this.bitmap.close();
    this.detail?.bitmap.close();
  }
}
