/**
 * Motors: what the actuators of a body are told, as colours of the joints that they move. In: a number of each, its range.
 * Out: a disc a joint, in as many sectors as numbers move it, in the colours that activities of neurons have: full where
 * a number is at an end of its range, or where that has none as large as it has been.
 */

import { mixed } from './colours.js';

/** @typedef {import('./protocol.js').Motor} Motor */
/** @typedef {import('./protocol.js').Theme} Theme */
/** A joint: its point of the skeleton, the colours of its sectors. @typedef {{point: number, colours: string[]}} Joint */

/** How large a joint is, in the thickness of what meets there, and in pixels at least and at most; the line around it. */
const SIZE = 1.15,
  SMALL = 3,
  LARGE = 8,
  EDGE = 1.2;

/** The numbers that move a body. */
export class Motors {
  /** @param {Motor[]} motors */
  constructor(motors) {
    this.motors = motors;
    /** the largest that each has been, to either side */
    this.largest = motors.map(() => 0);
  }

  /** How active a motor is, from −1 to 1. @param {number} number @param {number} value @returns {number} */
  share(number, value) {
    const [, , low, high] = this.motors[number],
      end = value < 0 ? low : high;
    this.largest[number] = Math.max(this.largest[number], Math.abs(value));
    const most = end === null || end === 0 ? this.largest[number] : Math.abs(end);
    return most > 0 ? Math.max(-1, Math.min(1, value / most)) : 0;
  }

  /** The joints, in the colours of these numbers; none where they are not known. @param {Float32Array} told
   * @param {Theme} theme @returns {Joint[]} */
  shown(told, theme) {
    /** @type {Map<number, string[]>} */
    const found = new Map();
    if (told.length !== this.motors.length) return [];
    this.motors.forEach(([point], number) => {
      if (point < 0 || !Number.isFinite(told[number])) return;
      const colours = found.get(point) ?? [];
      colours.push(between(theme, this.share(number, told[number])));
      found.set(point, colours);
    });
    return [...found].map(([point, colours]) => ({ point, colours }));
  }
}

/** The colour of a share of the activity. @param {Theme} theme @param {number} share @returns {string} */
function between({ negative, zero, positive }, share) {
  return mixed(share < 0 ? negative : positive, zero, Math.abs(share));
}

/** A disc in sectors, from the top on. @param {CanvasRenderingContext2D} context @param {[number, number]} middle
 * @param {number} thick pixels @param {string[]} colours @param {Theme} theme */
export function pie(context, [x, y], thick, colours, theme) {
  const radius = Math.min(LARGE, Math.max(SMALL, SIZE * thick)),
    part = (2 * Math.PI) / colours.length;
  colours.forEach((colour, at) => {
    context.beginPath();
    if (colours.length > 1) context.moveTo(x, y);
    context.arc(x, y, radius, at * part - Math.PI / 2, (at + 1) * part - Math.PI / 2);
    context.fillStyle = colour;
    context.fill();
  });
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  [context.strokeStyle, context.lineWidth] = [theme.box_fill, EDGE];
  context.stroke();
}
