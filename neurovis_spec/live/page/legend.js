/**
 * The legend: it stands in a corner of the page, in pixels of the page, and can be folded.
 */

import { Drawing } from './draw.js';

/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Shape} Shape */
/** What explains one thing: its shapes, from its heading on, and the rectangle around them.
 * @typedef {{shapes: Shape[], left: number, top: number, wide: number, high: number}} Entry */

/** How large its smallest text is, and how far entries are apart, across and down, in pixels of a page. */
const SMALL = 11,
  APART = [20, 10];
/** An entry begins with its heading, which alone is so bold; the part of a text's size above its baseline, and below. */
const BOLD = 600,
  ABOVE = 0.8,
  BELOW = 0.3;

/** How far shapes reach to the right and down. @param {CanvasRenderingContext2D} context @param {Shape} shape
 * @param {string[]} family @returns {number[]} */
function reach(context, { kind, at, points, size, radius, text, font, weight, anchor }, family) {
  if (points) return [0, 1].map((axis) => Math.max(...points.filter((_, place) => place % 2 === axis)));
  if (kind === 'disc') return at.map((value) => value + radius);
  if (size) return at.map((value, axis) => value + size[axis]);
  if (kind !== 'text') return at;
  context.font = `${weight} ${font}px ${family}`;
  const wide = context.measureText(text).width * { start: 1, middle: 0.5, end: 0 }[/** @type {'start'} */ (anchor)];
  return [at[0] + wide, at[1] + BELOW * font];
}

/** Shows what colours, widths and ends of lines mean. */
export class Legend {
  /** @param {HTMLDetailsElement} panel */
  constructor(panel) {
    this.panel = panel;
    this.canvas = /** @type {HTMLCanvasElement} */ (panel.querySelector('canvas'));
    this.heading = /** @type {HTMLElement} */ (panel.querySelector('summary'));
    /** @type {Entry[]} */
    this.entries = [];
    /** pixels of a page for a unit */
    this.scale = 1;
    /** @type {Drawing | null} */
    this.drawing = null;
    /** whether somebody has opened or folded it: then it stays so */
    this.isChosen = false;
    this.drawn = '';
    this.heading.addEventListener('click', () => {
      this.isChosen = true;
    });
  }

  /** Another picture. @param {Scene} scene */
  use(scene) {
    const shapes = scene.groups.find(({ id }) => id === 'legend')?.shapes ?? [],
      texts = shapes.flatMap(({ kind, font }) => (kind === 'text' ? font : [])),
      context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext('2d'));
    this.drawing = new Drawing({ ...scene, groups: [] });
    this.scale = SMALL / Math.min(...texts, SMALL);
    this.entries = [];
    this.drawn = '';
    this.panel.hidden = !shapes.length;
    /** @type {Shape[][]} */
    const entries = [];
    for (const shape of shapes) {
      if (!entries.length || shape.weight === BOLD) entries.push([]);
      entries[entries.length - 1].push(shape);
    }
    for (const own of entries) {
      const ends = own.map((shape) => reach(context, shape, /** @type {Drawing} */ (this.drawing).family)),
        [left, baseline] = own[0].at,
        top = baseline - ABOVE * (own[0].font ?? 0);
      const [right, bottom] = [0, 1].map((axis) => Math.max(...ends.map((end) => end[axis])));
      this.entries.push({ shapes: own, left, top, wide: right - left, high: bottom - top });
    }
    const words = shapes.flatMap(({ kind, text }) => (kind === 'text' ? text : []));
    this.canvas.setAttribute('aria-label', `legend: ${words.join(', ')}`);
  }

  /** Fold it, or unfold it. */
  toggle() {
    this.isChosen = true;
    this.panel.open = !this.panel.open;
  }

  /** Where each entry stands in so wide a panel, and how wide and high all are, in pixels of a page. @param {number} room */
  flow(room) {
    const { entries, scale } = this;
    let [x, y, high, across] = [0, 0, 0, 0];
    const places = entries.map((entry) => {
      const wide = scale * entry.wide;
      if (x && x + wide > room) [x, y, high] = [0, y + high + APART[1], 0];
      const place = [x, y];
      across = Math.max(across, x + wide);
      x += wide + APART[0];
      high = Math.max(high, scale * entry.high);
      return place;
    });
    return { places, size: [Math.ceil(across), Math.ceil(y + high)] };
  }

  /** The sizes that it can have in at most so much room across, the widest first. @param {number} room @returns {number[][]} */
  sizes(room) {
    /** @type {number[][]} */
    const found = [];
    const least = this.scale * Math.max(0, ...this.entries.map(({ wide }) => wide));
    for (let wide = room; wide >= least; ) {
      const { size } = this.flow(wide);
      found.push(size);
      wide = size[0] - 1;
    }
    return found;
  }

  /** Draw it in so much room across. @param {number} room */
  draw(room) {
    const { canvas, drawing, scale } = this,
      density = devicePixelRatio,
      key = [room, density].join();
    if (!drawing || key === this.drawn) return;
    this.drawn = key;
    const { places, size } = this.flow(room),
      context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    [canvas.width, canvas.height] = size.map((length) => Math.round(length * density));
    [canvas.style.width, canvas.style.height] = size.map((length) => `${length}px`);
    this.entries.forEach(({ shapes, left, top }, at) => {
      const by = scale * density,
        [x, y] = places[at];
      context.setTransform(by, 0, 0, by, density * x - by * left, density * y - by * top);
      for (const shape of shapes) drawing.shape(context, shape);
    });
  }
}
