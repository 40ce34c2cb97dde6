/**
 * The room: what the network is given of the window, where curves stand, beside it or below, and where the legend does.
 */

import { along } from './attention.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./legend.js').Legend} Legend */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Shape} Shape */

/** What of a picture the page shows elsewhere. */
const AROUND = ['title', 'caption', 'notes', 'legend'];
/** What is left free around the network, and how large its discs are at most, in pixels of a page. */
const EDGE = 8;
const LARGEST = 60;
/** Curves stand beside the network in a window of this shape and so wide, which then have this share of its width, but so
 * many pixels, and no more than that share. Below it they have so many pixels. */
const WIDE = 1.3,
  LEAST = 640,
  SHARE = 0.225,
  NARROW = 230,
  BROAD = 432,
  HALF = 0.45,
  BELOW = 220;
/** How high a curve beside the network is at least: this share of the window, but so many pixels, and no more than so many;
 * and how high at most where there is room. */
const TRACE = 0.09,
  LOWEST = 40,
  HIGH = 90,
  HIGHEST = 150;
/** What is left free around the legend; in a window narrower than this it is folded. */
const GAP = 10,
  TELEPHONE = 600;

/** A picture without title, caption, notes and legend. @param {Scene} scene @returns {Scene} */
export const bare = (scene) => ({ ...scene, groups: scene.groups.filter(({ id }) => !AROUND.includes(id)) });

/** Have a camera fit in the network alone, or all of a matrix. @param {Camera} camera @param {Scene} scene
 * @param {number[]} [matrix] how large that is, in its units */
export function frame(camera, scene, matrix) {
  const [x0, y0, x1, y1] = scene.network,
    radii = scene.groups.flatMap(({ data, shapes }) => (data.neuron === undefined ? [] : shapes[0].radius));
  camera.corner = [x0, y0];
  camera.size = [x1 - x0, y1 - y0];
  camera.edge = EDGE * devicePixelRatio;
  camera.most = devicePixelRatio * Math.max(scene.density, LARGEST / Math.max(1, ...radii));
  if (matrix) Object.assign(camera, { corner: [0, 0], size: matrix, edge: 0, most: Infinity });
}

/** What has a picture of the same neurons stand where the one before does, though one of them may have been put elsewhere and
 * the picture be larger; none where all of another picture is to be seen.
 * @param {Camera} camera @param {Scene | null} before @param {Scene} after @returns {(() => void) | undefined} */
export function staying(camera, before, after) {
  const named = (/** @type {Scene} */ scene) =>
    scene.groups
      .map(({ data }) => data.neuron ?? '')
      .join('\n')
      .trim();
  if (before?.window !== after.window) return undefined;
  if (!(before.constants.scale * after.constants.scale) || named(before) !== named(after)) return undefined;
  const scale = camera.scale * before.constants.scale,
    { left, top } = before.constants,
    start = camera.origin.map((at, axis) => at + camera.scale * [left, top][axis]);
  return () => {
    const { constants } = after,
      by = scale / constants.scale;
    camera.stand(by, [start[0] - by * constants.left, start[1] - by * constants.top]);
  };
}

/** Of which shape a window is, by what network and curves have of it: wide where these may stand beside the network, tall
 * where it has more height than width above them. @param {number} wide @param {number} high */
export function windowOf(wide, high) {
  if (wide >= LEAST && wide >= WIDE * high) return 'wide';
  return wide < high - Math.min(BELOW, HALF * high) ? 'tall' : 'default';
}

/** How the network and the curves share so much room: whether these stand beside it, and how wide they are then.
 * @param {number} wide @param {number} high @param {number} shape the width of the network by its height
 * @param {boolean} bodied whether a body is shown, too @returns {{isBeside: boolean, aside: number}} */
export function shared(wide, high, shape, bodied) {
  const least = Math.round(Math.min(BROAD, Math.max(NARROW, SHARE * wide)));
  /** how high the network is in so much room @param {number} across @param {number} down */
  const fit = (across, down) => Math.min((across - 2 * EDGE) / shape, down - 2 * EDGE);
  const below = fit(wide * (bodied ? 0.64 : 1), high - Math.min(BELOW, HALF * high));
  const isBeside = wide >= LEAST && wide >= WIDE * high && fit(wide - least, high) >= below;
  const left = Math.round(wide - shape * (high - 2 * EDGE) - 2 * EDGE);
  return { isBeside, aside: Math.max(least, Math.min(left, Math.floor(HALF * wide))) };
}

/** The corners of rectangles in which something of the network lies, in units. @param {Scene} scene @returns {number[][]} */
function taken(scene) {
  /** @param {Shape} shape @returns {number[][]} */
  const around = ({ kind, at, points, size, radius, text, font, anchor }) => {
    if (kind === 'disc') return [[at[0] - radius, at[1] - radius, at[0] + radius, at[1] + radius]];
    if (kind === 'line') return along(points).map(([x, y]) => [x, y, x, y]);
    if (kind === 'text') {
      const wide = 0.65 * font * text.length,
        left = at[0] - wide * { start: 0, middle: 0.5, end: 1 }[/** @type {'start'} */ (anchor)];
      return [[left, at[1] - font, left + wide, at[1] + 0.3 * font]];
    }
    return size ? [[at[0], at[1], at[0] + size[0], at[1] + size[1]]] : [];
  };
  return scene.groups.flatMap(({ shapes }) => shapes.flatMap(around));
}

/** Arranges the page. */
export class Room {
  /** @param {Camera} camera @param {Legend} legend @param {(id: string) => HTMLElement} find */
  constructor(camera, legend, find) {
    this.camera = camera;
    this.legend = legend;
    this.find = find;
    /** @type {Scene | null} */
    this.scene = null;
    /** the width of the network by its height */
    this.shape = 1;
    /** how many pictures of it there are */
    this.pictures = 1;
    /** @type {number[][]} */
    this.taken = [];
    new ResizeObserver(() => this.arrange()).observe(find('shown'));
    for (const one of ['past', 'strips']) new ResizeObserver(() => this.place()).observe(find(one));
    new MutationObserver(() => this.arrange()).observe(find('embodied'), { attributeFilter: ['hidden'] });
    legend.panel.addEventListener('toggle', () => this.place());
  }

  /** Another picture. @param {Scene} scene without what is shown elsewhere @param {boolean} stays whether all is to stay where
   * it is, so that nothing moves under the pointer */
  use(scene, stays) {
    const [x0, y0, x1, y1] = scene.network;
    if (!stays) this.shape = (x1 - x0) / (y1 - y0);
    this.scene = scene;
    this.taken = taken(scene);
    this.arrange();
  }

  /** Put the curves beside the network, or below it; two pictures of it side by side, or one above the other, as they are
   * larger. @param {number} [pictures] how many there are from now on */
  arrange(pictures = this.pictures) {
    this.pictures = pictures;
    if (!this.scene) return;
    const { clientWidth: wide, clientHeight: high } = this.find('shown'),
      isStacked = pictures > 1 && Math.min(wide / 2 / this.shape, high) < Math.min(wide / this.shape, high / 2);
    const shape = isStacked ? this.shape / 2 : this.shape * pictures,
      { isBeside, aside } = shared(wide, high, shape, !this.find('embodied').hidden);
    document.body.classList.toggle('stacked', isStacked);
    document.body.classList.toggle('beside', isBeside);
    document.body.style.setProperty('--aside', `${aside}px`);
    this.place();
  }

  /** Put the legend where there is room for it: below the curves, else in a corner of the picture. */
  place() {
    const { panel } = this.legend;
    if (!this.scene) return;
    if (document.body.classList.contains('beside')) this.below();
    else if (!panel.hidden) this.cornered();
  }

  /** In the column of the curves. */
  below() {
    const { legend, find } = this,
      { panel } = legend,
      wide = find('past').clientWidth - 2 * GAP,
      { count, least, beside } = this.curves(),
      all = find('shown').clientHeight - beside;
    // what is held has room before it is, so that nothing moves then
    const curves = count + (find('strips').classList.contains('nothing') ? 1 : 0);
    panel.style.translate = '';
    if (!panel.hidden) this.unfold(wide, all - count * least);
    // as high as there is room for, unless a body is shown there
    const each = find('embodied').hidden ? Math.floor((all - panel.offsetHeight) / Math.max(1, curves)) : 0;
    document.body.style.setProperty('--trace', `${Math.max(least, Math.min(HIGHEST, each))}px`);
  }

  /** Open the legend, or fold it, by the room that there is. @param {number} wide @param {number} high */
  unfold(wide, high) {
    const { legend, find } = this,
      { panel } = legend,
      { size } = legend.flow(wide),
      body = find('embodied').hidden ? 0 : Math.min(find('embodied').scrollHeight, 200);
    if (!legend.isChosen) panel.open = size[1] <= high - legend.heading.offsetHeight - 2 * GAP - body;
    legend.draw(wide);
  }

  /** How many curves there are, how high each is at least, and how high all else is of what stands with them. */
  curves() {
    const { find } = this,
      traces = /** @type {NodeListOf<HTMLElement>} */ (find('strips').querySelectorAll('.trace:not(.raster, .plane)')),
      heights = [...traces].map(({ offsetHeight }) => offsetHeight).filter(Boolean);
    const least = Math.max(LOWEST, Math.min(HIGH, TRACE * innerHeight));
    return { count: heights.length, least, beside: find('past').scrollHeight - heights.reduce((a, b) => a + b, 0) };
  }

  /** In the corner of the picture where nothing lies, as wide as it may be there, else folded into the line of the title. */
  cornered() {
    const { legend, find } = this,
      { panel } = legend,
      picture = find('picture'),
      { offsetLeft: left, offsetTop: top, clientWidth: wide, clientHeight: high } = picture,
      title = legend.heading.offsetHeight;
    const sizes = legend.sizes(wide - 4 * GAP);
    /** where its corner is, by its size, in which corner of the picture @param {number[]} size @param {number[]} corner */
    const at = ([across, down], [right, bottom]) => [
      left + (right ? wide - across - GAP : GAP),
      top + (bottom ? high - down - GAP : GAP),
    ];
    let [room, corner] = [sizes[0]?.[0] ?? 0, CORNERS[2]];
    const free = innerWidth <= TELEPHONE ? undefined : this.free(sizes, title, at, [left, top]);
    if (free) [room, corner] = free;
    if (!legend.isChosen) panel.open = free !== undefined;
    legend.draw(room);
    const { size } = legend.flow(room),
      // for fingers it is higher than the line of the title
      over = Math.max(-title - 1, -find('heading').offsetHeight);
    const isHalf = this.pictures > 1 && !document.body.classList.contains('stacked');
    let [x, y] = [left + (isHalf ? 2 : 1) * wide - legend.heading.offsetWidth - GAP, over];
    if (panel.open) [x, y] = at([size[0] + 2 * GAP, size[1] + title + GAP], corner);
    panel.style.translate = `${Math.round(Math.max(0, x))}px ${Math.round(free || !panel.open ? y : top)}px`;
  }

  /** The first of some sizes and corners in which the legend lies on nothing. @param {number[][]} sizes @param {number} title
   * @param {(size: number[], corner: number[]) => number[]} at @param {number[]} from where the picture begins
   * @returns {[number, number[]] | undefined} */
  free(sizes, title, at, from) {
    const { camera } = this,
      page = devicePixelRatio,
      scale = camera.whole / page,
      start = [0, 1].map(
        (axis) => (camera.window[axis] / page - scale * camera.size[axis]) / 2 - scale * camera.corner[axis],
      );
    const rects = this.taken.map((rect) => rect.map((value, place) => start[place % 2] + scale * value));
    for (const [across, down] of sizes) {
      const size = [across + 2 * GAP, down + title + GAP];
      if (size.some((length, axis) => length + 2 * GAP > camera.window[axis] / page)) continue;
      for (const corner of CORNERS) {
        const [x, y] = at(size, corner).map((value, axis) => value - from[axis] - GAP / 2),
          [right, bottom] = [x + size[0] + GAP, y + size[1] + GAP];
        if (rects.every(([x0, y0, x1, y1]) => x1 < x || x0 > right || y1 < y || y0 > bottom)) return [across, corner];
      }
    }
    return undefined;
  }
}

/** The corners of the picture, to the right and at the bottom or not, the best first. */
const CORNERS = [
  [1, 1],
  [0, 1],
  [1, 0],
  [0, 0],
];
