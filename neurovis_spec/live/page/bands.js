/**
 * Bands: what the picture leaves out of a pathway is a bundle, with a band for what excites and one for what inhibits, as
 * wide as the root of its sum of this step.
 */

import { channels } from './colours.js';
import { packed } from './coverage.js';
import { NARROWEST, WIDEST } from './joined.js';

/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Shape} Shape */
/** Which bundle it is of and what its connections do; of a single one, which that is, else −1.
 * That is as wide as it is `thin`.
 * @typedef {{bundle: string, end: number, single: number, thin: number}} Band */
/** How wide it is, in parts of a unit as lines are, in which colour, how it ends, and how much of it is seen.
 * @typedef {{width: number, colour: number, ending: number, share: number}} Seen */

/** What is told of a bundle, in this order: sums, and how many there are, of what excites, inhibits and does neither; and how
 * many are lesioned. */
export const NUMBERS = 7;
const ENDS = [1, -1, 0],
  DOES = ['excite', 'inhibit', 'neither'];
/** The same in words. */
const SAID = ['excite', 'inhibit', 'neither excite nor inhibit'];
/** What bands beside each other keep between them, and how much wider than the widest at first one gets. */
const BESIDE = 1.5,
  MOST = 2;

/** A number in short. @param {number} value @returns {string} */
export const short = (value) => String(Number(value.toPrecision(4))).replace('-', '−');
/** How many, in thousands. @param {number} number @returns {string} */
export const count = (number) => number.toLocaleString('en');

/** A curve beside another one, by so much, or, of a loop, around it. @param {number[]} points @param {number} by
 * @returns {number[]} */
function beside(points, by) {
  const [x, y] = points,
    [dx, dy] = [points[points.length - 2] - x, points[points.length - 1] - y],
    far = Math.hypot(dx, dy);
  if (far < 1) return points.map((value, at) => value + 0.2 * (value - points[at % 2]));
  return points.map((value, at) => value + (at % 2 ? (by * dx) / far : (-by * dy) / far));
}

/** What else the title of a bundle says: rules and delays. @param {Group} [bundle] @returns {string[]} */
export const restOf = (bundle) =>
  (bundle?.title ?? '').split('\n').filter((line, at) => at && !/^[\d,]+ (excite|inhibit|neither|of them)/.test(line));

/** The bundles of a scene. */
export class Bands {
  /** @param {Scene} scene */
  constructor({ bundles, constants }) {
    this.bundles = bundles;
    this.constants = constants;
    this.inks = bundles.inks.map((of) => of.map((colour) => packed(channels(colour))));
    /** of which sums of closed boxes the largest is known, and that @type {Float32Array[]} */
    this.added = [];
    this.most = 0;
    this.number = new Map(bundles.joined.map((id, number) => [id, number]));
  }

  /** The id of the bundle that a connection is drawn as, of which it is the only one; '' for none. @param {string} id
   * @returns {string} */
  bundleOf(id) {
    const { lone } = this.bundles;
    return Object.keys(lone).find((bundle) => `c${lone[bundle]}` === id) ?? '';
  }

  /** What a bundle is drawn of: each band with its line and its head. A band that is not there at first stands beside that
   * which is. @param {Group} group @returns {{band: Band, shapes: Shape[]}[]} */
  of({ id, data, shapes }) {
    const single = this.bundles.lone[id] ?? -1,
      isWhole = single >= 0 || id.startsWith('joined:');
    const found = ENDS.filter((_, at) => data[DOES[at]] !== undefined).map((end, at) => ({
      band: { bundle: id, end, single, thin: shapes[0].width },
      shapes: shapes.slice(2 * at, 2 * at + 2),
    }));
    for (const end of [1, -1]) {
      if (isWhole || found.some(({ band }) => band.end === end)) continue;
      const [{ shapes: first }] = found,
        by = first[0].width / 2 + BESIDE + this.bundles.narrowest / 2;
      const points = beside(first[0].points, by),
        at = beside([...first[0].points.slice(0, 2), ...first[1].at], by).slice(2);
      found.push({
        band: { bundle: id, end, single, thin: 0 },
        shapes: [
          { ...first[0], points },
          { ...first[1], at },
        ],
      });
    }
    return found;
  }

  /** What is told of a bundle. @param {string} id @param {Look} look @returns {Float32Array | null} */
  told(id, look) {
    const joined = id.startsWith('joined:') ? NUMBERS * Number(id.slice(7)) : -1;
    if (joined >= look.added.length) return null;
    if (joined >= 0) return look.added.subarray(joined, joined + NUMBERS);
    const number = this.number.get(id) ?? -1;
    return number < 0 ? null : look.sums.subarray(NUMBERS * number, NUMBERS * (number + 1));
  }

  /** The largest sum of what runs from and to closed boxes. @param {Look} look @returns {number} */
  mostOf({ added }) {
    if (added !== this.added[0]) {
      let most = 0;
      added.forEach((sum, at) => {
        if (at % NUMBERS < 3 && Math.abs(sum) > most) most = Math.abs(sum);
      });
      this.most = most;
      if (most) this.added = [added];
    }
    return this.most;
  }

  /** How a band looks. @param {Band} band @param {Look} look @returns {Seen} */
  seen({ bundle, end, single, thin }, look) {
    const { isFaint, isBar, isNegative, faint, fineness } = this.constants,
      { signs } = this.bundles,
      isJoined = bundle.startsWith('joined:');
    const { widest, narrowest, most } = isJoined
      ? { widest: WIDEST * thin, narrowest: NARROWEST * thin, most: this.mostOf(look) }
      : this.bundles;
    if (single >= 0) {
      const kind = look.kinds[single],
        now = kind & isNegative ? -1 : kind & isBar ? 0 : 1;
      const share = kind & isFaint ? faint : 1;
      return {
        width: Math.round(thin * fineness),
        colour: this.inks[1][ENDS.indexOf(now)],
        ending: signs ? now : 1,
        share,
      };
    }
    const told = this.told(bundle, look) ?? new Float32Array(NUMBERS),
      at = ENDS.indexOf(end),
      all = told[3] + told[4] + told[5],
      sum = Math.abs(told[at]);
    const width = Math.max(narrowest, Math.min(MOST, Math.sqrt(most > 0 ? sum / most : 0)) * widest || 0);
    const share = told[3 + at] === 0 ? 0 : told[6] === all ? faint : 1;
    return { width: Math.round(width * fineness), colour: this.inks[0][at], ending: signs ? end : 1, share };
  }

  /** How many connections a bundle has, what they add up to, and what those do that are alike, in words. @param {Float32Array} told
   * @returns {{many: number, sum: string, parts: string[]}} */
  summed(told) {
    const [sums, counts] = [told.subarray(0, 3), told.subarray(3, 6)].map((part) => [...part]),
      total = (/** @type {number[]} */ values) => values.reduce((sum, value) => sum + value, 0);
    const lost = told[6] ? ` (${count(told[6])} lesioned)` : '',
      parts = counts.flatMap((many, at) => (many ? [`${count(many)} ${SAID[at]}, sum ${short(sums[at])}`] : []));
    return {
      many: total(counts),
      sum: `sum ${short(total(sums))}${lost}`,
      parts: parts.length > 1 ? parts : [parts[0]?.replace(/^[\d,]+ (.*),.*/, 'all $1') ?? ''],
    };
  }

  /** What is said of a bundle that stands for several connections. @param {Group} bundle @param {Look} look
   * @param {Look | null} other of the branch beside it @returns {string} */
  words(bundle, look, other) {
    const { id, title, data } = bundle;
    const [told, beside] = [look, other].map((one) => one && this.told(id, one));
    if (!told) return title;
    const { many, sum, parts } = this.summed(told),
      inB = beside && this.summed(beside);
    return [
      `${data.pathway.replace('->', '→')} · ${count(many)} connection${many === 1 ? '' : 's'}, ${sum}`,
      ...parts,
      ...(inB ? [`in B ${[inB.sum, ...inB.parts].join('; ')}`] : []),
      ...restOf(bundle),
    ]
      .filter(Boolean)
      .join('\n');
  }
}
