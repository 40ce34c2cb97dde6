/**
 * A picture of the network as a camera sees it: lines and discs, what is lesioned, and boxes that are closed at a distance.
 */

import { Drawing } from './draw.js';
import { Marks } from './marks.js';
import { Zoom } from './zoom.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./draw.js').Context} Context */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {{near: Set<string>, held: string}} Held what stands out, and what is held */

/** A picture. */
export class Picture {
  constructor() {
    this.zoom = new Zoom();
    /** @type {Drawing | null} */
    this.drawing = null;
    /** @type {Marks | null} */
    this.marks = null;
  }

  /** Draw a look; true where there is more to be drawn in the next frame.
   * @param {Context} context @param {Camera} camera @param {Look} look @param {Held} held @returns {boolean} */
  draw(context, camera, look, { near, held }) {
    const scene = this.zoom.seen(camera);
    if (!scene) return false;
    if (!this.drawing || (this.drawing.scene !== scene && !this.drawing.isPassing(camera))) {
      this.drawing = new Drawing(scene);
      this.marks = new Marks(scene);
    }
    [this.drawing.near, this.drawing.held] = [near, held];
    const more = this.drawing.draw(context, camera, look);
    this.marks?.draw(context, camera, look, near);
    this.zoom.draw(context, camera, look, this.drawing);
    return more;
  }
}
