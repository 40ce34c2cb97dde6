/**
 * Names of curves: a strip as a text that outlasts the page, for links and for saved views, and what such a text pins.
 *
 * `O over T with K2`, `C1 against K2`: what is in front, what lies behind it, what is in the same axis, what it is drawn against;
 * `O.v` is what O has by this name. Links of old have marks instead (`O~T~+K2`, `C1~/K2`, `O|v`), and ids of what is beside the
 * network (`e0`, `m1`): these are understood, and no longer written.
 */

import { refOf } from './protocol.js';

/** @typedef {import('./protocol.js').Curve} Curve */
/** @typedef {import('./strips.js').Strip} Strip */
/** @typedef {import('./strips.js').Strips} Strips */
/** What a curve shows, by names: in front and behind it, in its axis, what it is drawn against ('' nothing).
 * @typedef {{signals: string[], joined: string[], against: string}} Named */

/** What joins the signals of a curve: behind the first, in the same axis, in a plane. */
const JOINING = / (over|with|against) /;
/** What links of old had: what parts signals, and one from what of it is shown, and what stands before one that is joined and
 * before one that it is drawn against: no name has them. */
const WITH = '~',
  OF = '|',
  JOINED = '+',
  AGAINST = '/';
/** The id of what is beside the network. */
const BESIDE = /^[eims]\d+$/;

/** The names in a curve of a link of old. @param {string} text @returns {Named} */
function ofOld(text) {
  const parts = text.split(WITH).map((part) => part.replace(OF, '.')),
    marked = (/** @type {string} */ mark) => parts.filter((one) => one[0] === mark).map((one) => one.slice(1));
  return {
    signals: parts.filter((one) => one[0] !== JOINED && one[0] !== AGAINST),
    joined: marked(JOINED),
    against: marked(AGAINST)[0] ?? '',
  };
}

/** The names in a curve. @param {string} text @returns {Named} */
export function namesIn(text) {
  if (text.includes(WITH) || text.includes(OF)) return ofOld(text);
  const [first, ...more] = text.split(JOINING),
    after = (/** @type {string} */ word) => more.filter((_, at) => at % 2 === 1 && more[at - 1] === word);
  return { signals: [first, ...after('over')], joined: after('with'), against: after('against')[0] ?? '' };
}

/** The curves of a page by their names. */
export class CurveNames {
  /** @param {Strips} strips */
  constructor(strips) {
    this.strips = strips;
  }

  /** The curves that are pinned. @returns {string[]} */
  get pinned() {
    return this.strips.pinned.map(({ key, behind, joined, against }) => {
      const more = joined.map((one) => ` with ${this.named(one.key)}`);
      const other = against ? ` against ${this.named(against.key)}` : '';
      return [key, ...behind].map((one) => this.named(one)).join(' over ') + more.join('') + other;
    });
  }

  /** How what is asked for by a key is called, in another network, too. @param {string} key @returns {string} */
  named(key) {
    const [id, what] = key.split('.'),
      group = this.strips.group(id),
      called = (group && refOf(group.data)) ?? group?.title ?? '';
    return what ? `${called}.${what}` : called;
  }

  /** By what is asked for what is called so, '' for nothing. @param {string} name @returns {string} */
  key(name) {
    const { attention, beside } = this.strips,
      all = [...attention.groups.values(), ...beside.groups.values()];
    /** @param {string} called */
    const id = (called) =>
      all.find(({ data, title }) => (refOf(data) ?? title) === called)?.id ??
      (BESIDE.test(called) && beside.groups.has(called) ? called : '');
    const own = id(name),
      dot = name.lastIndexOf('.'),
      other = own || dot < 0 ? '' : id(name.slice(0, dot));
    return own || (other && `${other}${name.slice(dot)}`);
  }

  /** Pin these curves, as far as there is what they show, and nothing else. @param {string[]} texts
   * @returns {string[]} the names of what there is not */
  pin(texts) {
    const all = texts.map(namesIn),
      names = new Set(all.flatMap(({ signals, joined, against }) => [...signals, ...joined, against])),
      keys = new Map([...names].map((name) => [name, this.key(name)]));
    const known = (/** @type {string[]} */ some) => some.filter((name) => keys.get(name)),
      keyed = (/** @type {string[]} */ some) => some.map((name) => keys.get(name) ?? '');
    this.strips.only(
      all.flatMap(({ signals, joined, against }) => {
        const shown = known(signals),
          curve = { items: keyed(shown), names: shown };
        return keys.get(signals[0]) ? [{ curve, joined: keyed(known(joined)), against: keys.get(against) }] : [];
      }),
    );
    return [...names].filter((name) => name && !keys.get(name));
  }
}
