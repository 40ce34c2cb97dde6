/**
 * The axis of time: ticks below the strips, in the unit that the spec gives steps in, else in steps.
 */

import { THUMB } from './scrubber.js';
import { Sized } from './sized.js';
import { roundAbove, written } from './ticks.js';

/** @typedef {import('./scrubber.js').Scrubber} Scrubber */
/** @typedef {{step: number, unit: string} | null} Time how long a step is, and in what unit; null where a spec says nothing */

/** How far apart ticks are at least, and how long they are, in pixels of a page. */
const APART = 80,
  LONG = 4;

/** Draws the ticks, and says what time a step is. */
export class Axis {
  /** @param {Scrubber} scrubber @param {(id: string) => HTMLElement} find @param {() => void} changed */
  constructor(scrubber, find, changed) {
    this.scrubber = scrubber;
    this.canvas = /** @type {HTMLCanvasElement} */ (find('ticks'));
    this.size = new Sized(this.canvas, changed);
    this.unit = find('unit');
    /** @type {Time} */
    this.time = null;
    this.drawn = '';
  }

  /** @param {Time} time */
  use(time) {
    this.time = time;
    this.drawn = '';
    this.unit.textContent = time ? `time, ${time.unit}` : 'step';
  }

  /** What a step is called. @param {number} step @returns {string} */
  words(step) {
    return this.time ? `${written(step * this.time.step, this.time.step)} ${this.time.unit}` : `step ${step}`;
  }

  /** Draw them, where others are to be seen. */
  show() {
    const { canvas, scrubber } = this,
      { low, high } = scrubber,
      { wide: width, high: height } = this.size,
      layout = [width, height, devicePixelRatio, low, high].join(' ');
    if (layout === this.drawn || !width) return;
    this.drawn = layout;
    [canvas.width, canvas.height] = [width * devicePixelRatio, height * devicePixelRatio];
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d')),
      style = getComputedStyle(canvas),
      long = this.time?.step ?? 1;
    context.scale(devicePixelRatio, devicePixelRatio);
    context.fillStyle = context.strokeStyle = style.color;
    context.font = `${style.fontSize} ${style.fontFamily}`;
    context.textAlign = 'center';
    context.textBaseline = 'bottom';
    const apart = roundAbove(Math.max(long, ((high - low) * long * APART) / Math.max(1, width - 2 * THUMB)));
    context.beginPath();
    for (let at = Math.ceil((low * long) / apart - 1e-9); at * apart <= high * long * (1 + 1e-12) + 1e-12; at++) {
      const x = THUMB + scrubber.across((at * apart) / long) * (width - 2 * THUMB),
        text = written(at * apart, apart),
        half = context.measureText(text).width / 2;
      context.moveTo(x, 0);
      context.lineTo(x, LONG);
      context.fillText(text, Math.min(width - half, Math.max(half, x)), height);
    }
    context.stroke();
  }
}
