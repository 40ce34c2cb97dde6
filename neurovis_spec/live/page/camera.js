/**
 * The camera: which part of the picture is seen, in device pixels.
 */

/** A picture of `width` by `height` units is fitted into the window; `zoom` and `shift` (pixels) come on top. */
export class Camera {
  constructor() {
    this.size = [1, 1];
    this.window = [1, 1];
    this.zoom = 1;
    this.shift = [0, 0];
  }

  /** See all of it. */
  fit() {
    this.zoom = 1;
    this.shift = [0, 0];
  }

  /** Pixels for a unit. @returns {number} */
  get scale() {
    return this.zoom * Math.min(this.window[0] / this.size[0], this.window[1] / this.size[1]);
  }

  /** Where the origin of the picture lies. @returns {number[]} */
  get origin() {
    return [0, 1].map((at) => (this.window[at] - this.scale * this.size[at]) / 2 + this.shift[at]);
  }

  /** The unit under a pixel. @param {number} x @param {number} y @returns {number[]} */
  unit(x, y) {
    const [left, top] = this.origin;
    return [(x - left) / this.scale, (y - top) / this.scale];
  }

  /** Come closer, or go away; the pixel stays where it is. @param {number} factor @param {number} x @param {number} y */
  closer(factor, x, y) {
    const [across, down] = this.unit(x, y);
    this.zoom = Math.min(64, Math.max(0.25, this.zoom * factor));
    const [left, top] = this.origin;
    this.move(x - left - across * this.scale, y - top - down * this.scale);
  }

  /** @param {number} x @param {number} y */
  move(x, y) {
    this.shift = [this.shift[0] + x, this.shift[1] + y];
  }
}
