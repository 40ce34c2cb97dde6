/**
 * Undo: what was done in this page, taken back act by act, and done again.
 */

import { say } from './say.js';

/** @typedef {import('./protocol.js').Gains} Gains */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Status} Status */
/** @typedef {import('./protocol.js').Turned} Turned */
/** Something that was done: in words, how it is taken back and done again; of what is alike (`key`) and done in one go of the hand (`gesture`),
 * such as a drag, the last counts.
 * @typedef {{words: string, undo: () => void, redo: () => void, key?: string, gesture?: number}} Act */
/** A message that was sent. @typedef {{type: string, [member: string]: unknown}} Asked */
/** A turn as it was asked for, until the status tells it; by `act` it is done again. @typedef {{asked: Asked, gesture: number, act: Act | null}} Pending */

/** What has an undo of its own. */
export const WRITTEN = 'textarea, input:not([type=range], [type=checkbox])';
/** The most acts that are kept. */
const MOST = 200;
/** The messages that are turns. */
const TURNS = new Set(['set', 'feed', 'hold', 'release', 'lesion', 'mend', 'learn', 'weigh']);

/** What a turn is of, and what it says. @param {Asked | Turned} turn @returns {string[]} */
function contentOf(turn) {
  const { type, part, neurons, connections, name, values, value, on } = /** @type {Asked} */ (turn);
  const names = type === 'set' ? Object.keys(/** @type {object} */ (values)) : [];
  return [
    JSON.stringify([type, part, neurons, connections, name, ...names]),
    JSON.stringify([type, part, neurons, connections, name, values, value, on]),
  ];
}

/** What was done, and what was taken back and can be done again. */
export class Undo {
  /** @param {Link} link @param {(id: string) => HTMLElement} find @param {(turn: Turned) => string} told a turn in words */
  constructor(link, find, told) {
    this.link = link;
    this.find = find;
    this.told = told;
    /** @type {Act[]} */
    this.done = [];
    /** @type {Act[]} */
    this.undone = [];
    /** @type {Pending[]} */
    this.pending = [];
    /** what is turned, by its number @type {Map<number, Turned>} */
    this.known = new Map();
    /** @type {Gains | null} */
    this.drawn = null;
    /** an act that is being taken back, or done again @type {Act | null} */
    this.now = null;
    this.gesture = 0;
    for (const name of ['pointerdown', 'keydown'])
      addEventListener(
        name,
        () => {
          this.gesture += 1;
        },
        true,
      );
    addEventListener('keydown', (event) => this.key(event));
    find('undo').onclick = () => this.back();
    find('redo').onclick = () => this.again();
    link.asked = (type, more) => this.asked({ ...more, type });
    this.show();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const at = /** @type {Element} */ (event.target),
      pressed = event.key.toLowerCase();
    if (!(event.ctrlKey || event.metaKey) || event.altKey || at.matches(WRITTEN)) return;
    if (pressed !== 'z' && pressed !== 'y') return;
    event.preventDefault();
    if (pressed === 'z' && !event.shiftKey) this.back();
    else this.again();
  }

  /** Something was done. @param {Act} act */
  act(act) {
    if (this.now) return;
    const last = this.done[this.done.length - 1];
    if (act.key && last?.key === act.key && last.gesture === act.gesture)
      [last.words, last.redo] = [act.words, act.redo];
    else this.done.push(act);
    this.done.splice(0, this.done.length - MOST);
    this.undone = [];
    this.show();
  }

  /** Do something that is one act, whatever acts it is made of. @param {Act} act */
  whole(act) {
    this.now = act;
    act.redo();
    this.now = null;
    this.act(act);
  }

  /** Take back what was done last. */
  back() {
    this.take(this.done, this.undone, 'undone', 'undo');
  }

  /** Do again what was taken back last. */
  again() {
    this.take(this.undone, this.done, 'done again', 'redo');
  }

  /** @param {Act[]} from @param {Act[]} to @param {string} how @param {'undo' | 'redo'} which */
  take(from, to, how, which) {
    const act = from.pop();
    this.tell(act ? `${how}: ${act.words}` : `nothing to ${which}`);
    if (!act) return;
    to.push(act);
    this.now = act;
    act[which]();
    this.now = null;
    this.show();
  }

  /** @param {string} words */
  tell(words) {
    this.find('did').textContent = words;
    say(words);
  }

  /** Show whether there is anything. */
  show() {
    for (const [id, acts, words, keys] of /** @type {const} */ ([
      ['undo', this.done, 'undo', 'ctrl+z'],
      ['redo', this.undone, 'do again', 'ctrl+shift+z'],
    ])) {
      const button = /** @type {HTMLButtonElement} */ (this.find(id)),
        last = acts[acts.length - 1];
      button.disabled = !last;
      button.title = `${words}${last ? `: ${last.words}` : ''} (${keys})`;
    }
  }

  /** A message was sent. @param {Asked} asked */
  asked(asked) {
    const { type } = asked,
      { gesture } = this;
    if (TURNS.has(type)) this.pending.push({ asked, gesture, act: this.now });
    else if (type === 'draw' && gesture && this.drawn) this.redrawn(this.drawn, asked);
    else if (type === 'place' && asked.done) {
      const again = () => this.link.ask('place', { neuron: asked.neuron, at: asked.at, done: true });
      this.act({
        words: `${asked.neuron} put elsewhere`,
        undo: () => this.link.ask('unplace'),
        redo: again,
        key: 'place',
      });
    } else if (type === 'unplace' && !this.now) {
      const place = this.done.map(({ key }) => key).lastIndexOf('place');
      if (place >= 0) this.undone.push(...this.done.splice(place, 1));
      this.show();
    }
  }

  /** The picture is drawn otherwise. @param {Gains} before @param {Asked} asked */
  redrawn(before, asked) {
    const { type, ...now } = asked,
      was = /** @type {Object<string, unknown>} */ (before),
      other = Object.keys(now).filter((name) => was[name] !== now[name]);
    if (!other.length) return;
    this.drawn = /** @type {Gains} */ (/** @type {unknown} */ ({ ...before, ...now }));
    const words = other.map((name) => `${name} ${now[name] === '' ? 'of the spec' : now[name]}`).join(', ');
    const back = Object.fromEntries(other.map((name) => [name, was[name]]));
    const draw = (/** @type {object} */ more) => this.link.ask(type, { ...this.drawn, ...more });
    this.act({ words, undo: () => draw(back), redo: () => draw(now), key: `draw ${other}`, gesture: this.gesture });
  }

  /** What was asked is not done. */
  refused() {
    const last = this.done[this.done.length - 1];
    if (this.pending.length) this.pending.shift();
    else if (last?.key === 'place') this.done.pop();
    this.show();
  }

  /** What was asked is told to be so. @param {Status} status */
  status({ turned, appearance }) {
    const latest = new Map(turned.map((entry) => [entry.number, entry]));
    for (const entry of turned) {
      const [of, says] = contentOf(entry);
      const place = this.pending.findIndex(({ asked }) => contentOf(asked)[1] === says);
      const before = this.known.get(entry.number);
      if (place < 0 || (before && contentOf(before)[1] === says)) continue;
      const { act, gesture } = this.pending[place];
      this.pending = this.pending.filter((one, at) => at > place || contentOf(one.asked)[0] !== of);
      if (act) act.undo = this.undoing(entry, before);
      else {
        const redo = () => this.link.ask(entry.type, { ...messageOf(entry) });
        this.act({ words: this.told(entry), undo: this.undoing(entry, before), redo, key: of, gesture });
      }
    }
    this.known = latest;
    this.drawn = appearance;
  }

  /** What takes a turn back: what gave the same thing a value before it at the same step, or else as though it had not been.
   * @param {Turned} entry @param {Turned} [before] @returns {() => void} */
  undoing({ number, back }, before) {
    return () => {
      if (before) this.link.ask(before.type, messageOf(before));
      else if (this.link.takes.has('undo')) this.link.ask('undo', { number });
      else if (back) this.link.ask(back.type, messageOf(/** @type {Turned} */ (back)));
    };
  }

  /** Have a panel that is opened and closed, or anything else that is one or the other, be an act.
   * @param {{toggle: () => void}} of @param {string} words */
  follow(of, words) {
    const toggle = of.toggle.bind(of);
    of.toggle = () => {
      toggle();
      this.act({ words, undo: toggle, redo: toggle });
    };
  }

  /** Have the theme that is chosen be an act. @param {import('./appearance.js').Appearance} appearance */
  followTheme(appearance) {
    const choose = appearance.choose.bind(appearance);
    appearance.choose = (name) => {
      const before = appearance.chosen;
      choose(name);
      this.act({ words: `theme ${name || 'of the spec'}`, undo: () => choose(before), redo: () => choose(name) });
    };
  }

  /** Have strips that are pinned, unpinned, joined and parted be acts. @param {import('./strips.js').Strips} strips */
  followPins(strips) {
    const stand = () => strips.pinned.map((strip) => ({ strip, joined: strip.joined, against: strip.against }));
    const restore = (/** @type {ReturnType<typeof stand>} */ stood) => () => {
      for (const { strip, joined, against } of stood) Object.assign(strip, { joined, against });
      strips.pinned = stood.map(({ strip }) => strip);
      strips.use();
    };
    const [toggle, join] = [strips.toggle.bind(strips), strips.join.bind(strips)];
    let isWithin = false;
    /** @param {() => void} does @param {(before: import('./strips.js').Strip[]) => string} words */
    const follow = (does, words) => {
      const before = stand(),
        isInner = isWithin;
      isWithin = true;
      does();
      isWithin = isInner;
      const told = isInner ? '' : words(before.map(({ strip }) => strip));
      if (told) this.act({ words: told, undo: restore(before), redo: restore(stand()) });
    };
    strips.toggle = (...of) =>
      follow(
        () => toggle(...of),
        (before) => {
          const after = strips.pinned,
            one = [...before, ...after].find((strip) => !(before.includes(strip) && after.includes(strip)));
          // measures are the run's
          return one && one.id[0] !== 'm' ? `${after.includes(one) ? 'pinned' : 'unpinned'} ${one.told}` : '';
        },
      );
    strips.join = (strip, how) => {
      const words = `${strip.told} ${strip.join.selectedOptions[0]?.text ?? how}`;
      follow(
        () => join(strip, how),
        () => words,
      );
    };
  }
}

/** The members of a turn that a message has. @param {Turned | {type: string}} turn @returns {object} */
function messageOf(turn) {
  const { part, neurons, connections, name, values, value, on } = /** @type {Turned} */ (turn);
  return JSON.parse(JSON.stringify({ part, neurons, connections, name, values, value, on }));
}
