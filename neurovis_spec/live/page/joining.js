/**
 * Joining: several signals in one axis, each with its colour, and one against another in a plane.
 */

import { signed } from './attention.js';

/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Traces} Traces */
/** @typedef {import('./strips.js').Strip} Strip */
/** A signal that a strip shows beside its own. @typedef {{id: string, what: string, key: string, name: string, data: string}} Joined */

/** The colours of joined signals, told apart by eyes of all kinds (Okabe and Ito 2008) on light and on dark. */
export const COLOURS = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9', '#8a6fd1'];
/** Room around a plane, and the radius of the point of now, in pixels of a page. */
const MARGIN = 8,
  POINT = 4,
  PALE = 0.3;

/** What a strip shows, to be shown by another. @param {Strip} strip @returns {Joined} */
export function taken({ id, what, key, names, data }) {
  return { id, what, key, name: names[0], data };
}

/** What a strip can be joined with, as options. @param {Strip} strip @param {Strip[]} others */
export function offer(strip, others) {
  const { join } = strip,
    more = others.filter((one) => one !== strip && one.id && one.what !== '*' && !one.against);
  /** @param {string} label @param {string} verb @param {Strip[]} each */
  const list = (label, verb, each) => {
    const group = document.createElement('optgroup');
    group.label = label;
    group.append(...each.map((one) => new Option(`${verb} ${one.names[0]}`, `${verb} ${others.indexOf(one)}`)));
    return each.length ? [group] : [];
  };
  const plain = !strip.against && strip.what !== '*',
    alone = plain && !strip.joined.length;
  join.replaceChildren(
    new Option('⋯', ''),
    ...(plain ? list('in one axis', 'with', more) : []),
    ...(alone ? list('in a plane', 'against', more) : []),
    ...(strip.joined.length ? [new Option('apart', 'apart')] : []),
    ...(strip.against ? [new Option('over time', 'time')] : []),
  );
  join.value = '';
  join.hidden = join.options.length < 2;
}

/** Signals of another network that are called as these are. @param {Joined[]} joined @param {Group[]} groups @returns {Joined[]} */
export function again(joined, groups) {
  return joined.flatMap((one) => {
    const same = groups.find(({ data }) => JSON.stringify(data) === one.data);
    return same ? [{ ...one, id: same.id, key: one.what ? `${same.id}.${one.what}` : same.id }] : [];
  });
}

/** The least and the largest finite number. @param {ArrayLike<number> & Iterable<number>} values
 * @param {ArrayLike<number> & Iterable<number>} more @returns {[number, number]} */
function range(values, more) {
  let [low, high] = [Infinity, -Infinity];
  for (const some of [values, more])
    for (const value of some) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  return [low, high];
}

/** Draw one signal against another, over time, and where they are now; pale how they went in another branch.
 * @param {Strip} strip @param {Traces} pairs the value of each at each step, twice @param {Object<string, number | null>} values those of now
 * @param {Traces | null} beyond those of the branch @param {string} called what that is called */
export function plane(strip, { first, ranges }, values, beyond, called) {
  const { canvas, against } = strip,
    keys = [against?.key ?? '', strip.key],
    [across, up] = keys.map((key) => ranges.get(key)),
    [otherAcross, otherUp] = keys.map((key) => beyond?.ranges.get(key));
  if (!against || !across || !up) return;
  const { clientWidth: width, clientHeight: height } = canvas,
    context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d')),
    style = getComputedStyle(canvas),
    [[left, right], [bottom, top]] = [range(across, otherAcross ?? []), range(up, otherUp ?? [])];
  [canvas.width, canvas.height] = [width * devicePixelRatio, height * devicePixelRatio];
  context.scale(devicePixelRatio, devicePixelRatio);
  const known = left <= right && bottom <= top,
    wide = Math.min(width, 2 * height);
  /** @param {number} value @param {number} low @param {number} high */
  const share = (value, low, high) => (high > low ? (value - low) / (high - low) : 0.5);
  /** @param {number} value */
  const x = (value) => MARGIN + (wide - 2 * MARGIN) * share(value, left, right);
  /** @param {number} value */
  const y = (value) => height - MARGIN - (height - 2 * MARGIN) * share(value, bottom, top);
  /** @param {Float32Array} one @param {Float32Array} other @param {number} alpha @returns {boolean} whether any of it is known */
  const path = (one, other, alpha) => {
    context.globalAlpha = alpha;
    context.beginPath();
    let [pen, any] = [false, false];
    for (let at = 0; at < other.length; at += 2) {
      const there = Number.isFinite(one[at]) && Number.isFinite(other[at]);
      if (there) context[pen ? 'lineTo' : 'moveTo'](x(one[at]), y(other[at]));
      [pen, any] = [there, any || there];
    }
    context.stroke();
    context.globalAlpha = 1;
    return any;
  };
  context.strokeStyle = style.borderTopColor;
  context.strokeRect(0.5, 0.5, wide - 1, height - 1);
  context.strokeStyle = context.fillStyle = style.color;
  context.lineWidth = 1;
  context.lineJoin = 'round';
  const went = otherAcross && otherUp && path(otherAcross, otherUp, PALE);
  path(across, up, 0.6);
  const now = [against.key, strip.key].map((key) => values[key]);
  if (known && typeof now[0] === 'number' && typeof now[1] === 'number') {
    context.fillStyle = COLOURS[1];
    context.beginPath();
    context.arc(x(now[0]), y(now[1]), POINT, 0, 2 * Math.PI);
    context.fill();
  }
  context.fillStyle = style.color;
  context.font = `12px ${style.fontFamily}`;
  context.textBaseline = 'bottom';
  const words = known ? [`→ ${against.name}: ${signed(short(left))} … ${signed(short(right))}`] : [];
  for (const text of words) context.fillText(text, wide + 8, height - 4);
  [strip.ends[0].textContent, strip.ends[1].textContent] = known
    ? [signed(short(top)), top > bottom ? signed(short(bottom)) : '']
    : ['', ''];
  canvas.setAttribute(
    'aria-label',
    known
      ? `${strip.told} from step ${first} to ${first + up.length / 2 - 1}: between ${signed(bottom)} and ${signed(top)}, ${against.name} between ${signed(left)} and ${signed(right)}${went ? `, behind it ${called || 'how it went before'}` : ''}`
      : `${strip.told}: nothing is known of these steps`,
  );
}

/** A number in little room. @param {number} value @returns {number} */
function short(value) {
  return Number(value.toPrecision(3));
}
