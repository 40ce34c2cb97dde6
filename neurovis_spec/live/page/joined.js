/**
 * Joined: what runs from and to closed boxes, one pathway for each two of them, or of one and a neuron beside them, drawn as
 * bundles are.
 */

/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Joined} Joined */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Shape} Shape */
/** Where something is: its corners, least x and y, largest x and y. @typedef {number[]} Rect */

/** How wide the widest band is, and the narrowest, in pixels of a page; how far bands of a pathway are apart, and what they
 * keep from what they join, in the same; how far one bends, as a share of its length. */
export const WIDEST = 7,
  NARROWEST = 1.2;
const APART = 2.5,
  AIR = 3,
  HEAD = 8,
  BEND = 0.16;
/** What bands of a pathway do, as data. */
const DOES = ['excite', 'inhibit', 'neither'];

/** How far it is from the middle of a rectangle to its rim, in a direction. @param {Rect} rect @param {number[]} along
 * @returns {number} */
function rim([x0, y0, x1, y1], [dx, dy]) {
  return Math.min((x1 - x0) / 2 / Math.max(Math.abs(dx), 1e-9), (y1 - y0) / 2 / Math.max(Math.abs(dy), 1e-9));
}

/** A band from one to another: its line and its head. @param {Rect} from @param {Rect} to @param {number} aside by so much to
 * the right @param {number} page units of a pixel of a page @param {number} notch @returns {Shape[]} */
function band(from, to, aside, page, notch) {
  const [a, b] = [from, to].map(([x0, y0, x1, y1]) => [(x0 + x1) / 2, (y0 + y1) / 2]);
  const way = [b[0] - a[0], b[1] - a[1]],
    far = Math.hypot(way[0], way[1]) || 1,
    along = way.map((value) => value / far);
  const right = [-along[1], along[0]],
    begin = Math.min(0.45 * far, rim(from, along) + AIR * page),
    end = Math.min(0.45 * far, rim(to, along) + AIR * page);
  const at = (/** @type {number} */ share, /** @type {number} */ bend) =>
    [0, 1].map(
      (axis) =>
        a[axis] +
        along[axis] * (begin + share * (far - begin - end)) +
        right[axis] * (aside + bend * BEND * (far - begin - end)),
    );
  const [start, one, other, tip] = [at(0, 0), at(1 / 3, 1), at(2 / 3, 1), at(1, 0)];
  const last = [tip[0] - other[0], tip[1] - other[1]],
    size = Math.hypot(last[0], last[1]) || 1,
    heading = last.map((value) => value / size);
  const length = Math.min(HEAD * page, size / 2),
    back = tip.map((value, axis) => value - notch * length * heading[axis]);
  const nothing = /** @type {Shape} */ ({ stroke: '#888888', fill: '#888888', width: page, opacity: 1, end: 1 });
  return [
    { ...nothing, kind: 'line', points: [...start, ...one, ...other, ...back], dash: [] },
    { ...nothing, kind: 'head', at: tip, along: heading, length, half: length / 2 },
  ];
}

/** What joins closed boxes, as groups. @param {Joined} joined @param {(id: string) => {rect: Rect, name: string} | null} place
 * where a box or a neuron is, and how it is called @param {number} page units of a pixel of a page @param {Scene} scene
 * @returns {Group[]} */
export function groupsOf({ ends }, place, page, { constants }) {
  return ends.flatMap(([a, b], number) => {
    const [from, to] = [place(a), place(b)];
    if (!from || !to) return [];
    const name = `${from.name} -> ${to.name}`;
    const shapes = [-1, 1, 0].flatMap((side) => band(from.rect, to.rect, side * APART * page, page, constants.notch));
    const data = { pathway: name, ...Object.fromEntries(DOES.map((what) => [what, ''])) };
    return [{ id: `joined:${number}`, data, title: name.replace('->', '→'), shapes }];
  });
}
