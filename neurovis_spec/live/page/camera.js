/**
 * The camera: which part of the picture is seen, in device pixels.
 */

/** How long it takes to go to another place, in milliseconds. */
const GLIDE = 250;

/** Whether the page is to move as little as can be. @returns {boolean} */
export const isStill = () => matchMedia('(prefers-reduced-motion: reduce)').matches;

/** A part of a picture, of a `size` from a `corner` on (units), is fitted into the window; `zoom` and `shift` (pixels) come on top. */
export class Camera {
  constructor() {
    this.size = [1, 1];
    this.corner = [0, 0];
    this.window = [1, 1];
    /** how many pixels are left free on each side of what is fitted in, and the most pixels that a unit then has */
    this.edge = 0;
    this.most = Infinity;
    this.zoom = 1;
    this.shift = [0, 0];
    /** where it is on the way to: zoom and shift, and those where it began @type {{to: number[], from: number[], since: number} | null} */
    this.way = null;
  }

  /** See all of it. */
  fit() {
    this.go([1, 0, 0]);
  }

  /** Pixels for a unit where all of the picture is seen. @returns {number} */
  get whole() {
    const room = this.window.map((length) => Math.max(1, length - 2 * this.edge));
    return Math.min(room[0] / this.size[0], room[1] / this.size[1], this.most);
  }

  /** Pixels for a unit. @returns {number} */
  get scale() {
    return this.zoom * this.whole;
  }

  /** Where the origin of the picture lies. @returns {number[]} */
  get origin() {
    const { window, scale, size, corner, shift } = this;
    return [0, 1].map((at) => (window[at] - scale * size[at]) / 2 - scale * corner[at] + shift[at]);
  }

  /** The unit under a pixel. @param {number} x @param {number} y @returns {number[]} */
  unit(x, y) {
    const [left, top] = this.origin;
    return [(x - left) / this.scale, (y - top) / this.scale];
  }

  /** The pixel on which a unit lies. @param {number} x @param {number} y @returns {number[]} */
  pixel(x, y) {
    const [left, top] = this.origin;
    return [left + x * this.scale, top + y * this.scale];
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
    this.way = null;
    this.shift = [this.shift[0] + x, this.shift[1] + y];
  }

  /** See a part of the picture in the middle of the window, as large as it can be. @param {number[]} rect least x and y,
   * largest x and y, in units @param {number} [least] the least pixels for a unit: of what is larger then, the middle is seen */
  see([x0, y0, x1, y1], least = 0) {
    const scale = Math.max(least, Math.min(this.window[0] / (x1 - x0), this.window[1] / (y1 - y0)));
    const zoom = Math.min(64, Math.max(0.25, scale / this.whole)),
      at = zoom * this.whole;
    const { size, corner } = this;
    this.go([zoom, (at * (size[0] + 2 * corner[0] - x0 - x1)) / 2, (at * (size[1] + 2 * corner[1] - y0 - y1)) / 2]);
  }

  /** See what has the place `at` (pixels) for the origin of the picture, with so many pixels for a unit, at once.
   * @param {number} scale @param {number[]} at */
  stand(scale, at) {
    this.way = null;
    this.zoom = scale / this.whole;
    this.shift = [0, 0];
    this.shift = this.origin.map((from, axis) => at[axis] - from);
  }

  /** Go to a zoom and a shift, at once where little is to move. @param {number[]} to */
  go(to) {
    this.way = { to, from: [this.zoom, ...this.shift], since: isStill() ? -Infinity : performance.now() };
  }

  /** Go on, where it is on the way to somewhere; whether it still is. @returns {boolean} */
  glide() {
    if (!this.way) return false;
    const { to, from, since } = this.way,
      share = Math.min(1, (performance.now() - since) / GLIDE);
    const [zoom, x, y] = to.map((end, at) => from[at] + (end - from[at]) * share * (2 - share));
    this.zoom = zoom;
    this.shift = [x, y];
    if (share === 1) this.way = null;
    return share < 1;
  }
}
