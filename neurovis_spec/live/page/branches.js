/**
 * Branches: what else the run has done, as a tree; gone to, compared, named and deleted.
 */

import { button, retype } from './naming.js';
import { told } from './told.js';

/** @typedef {import('./protocol.js').Future} Future */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Status} Status */
/** @typedef {import('./undo.js').Undo} Undo */

/** All of a tree. @param {Future[]} futures @returns {Future[]} */
export const every = (futures) => futures.flatMap((one) => [one, ...every(one.within)]);

/** From which step to which a branch goes, if it has gone any. @param {Future} branch @returns {string} */
const span = ({ at, last }) => `from step ${at + 1} ${last > at ? `to ${last}` : 'on'}`;

/** How a branch is called. @param {Future} branch @returns {string} */
export const called = (branch) => branch.name || `the branch ${span(branch)}`;

/** The list of branches. */
export class Branches {
  /** @param {Link} link @param {(id: string) => HTMLElement} find @param {Undo} undo
   * @param {(number: number | null, name: string) => void} compare called with the branch that curves are compared with, null for none */
  constructor(link, find, undo, compare) {
    this.link = link;
    this.find = find;
    this.undo = undo;
    this.compare = compare;
    /** the branch that is compared @type {number | null} */
    this.chosen = null;
    this.shown = '';
    this.owner = false;
    /** the number of the one that the run is in, and the others */
    this.current = 0;
    /** @type {Future[]} */
    this.futures = [];
    /** what it is called, '' where it has no name */
    this.named = '';
    /** how many were forgotten, −1 where that is not known yet */
    this.dropped = -1;
    /** the one that is shown beside the run @type {number | null} */
    this.compared = null;
    /** the one that is being named */
    this.naming = -1;
    find('alone').onclick = () => this.put(-1, 'A alone');
  }

  /** @param {Status} status */
  status({ futures, dropped, current, branch, owner, compared }) {
    [this.current, this.futures] = [current, futures];
    const fewer = dropped - this.dropped;
    if (this.dropped >= 0 && fewer > 0)
      this.undo.tell(
        `${fewer === 1 ? 'a branch was' : `${fewer} branches were`} forgotten: there is room for 16, in 128 MiB`,
      );
    this.dropped = dropped;
    this.owner = owner;
    this.find('futures').hidden = !futures.length;
    this.named = branch;
    this.compared = compared;
    const key = JSON.stringify([futures, owner, compared, branch, current]);
    const isThere = (/** @type {number} */ one) =>
      one === current || every(futures).some(({ number }) => number === one);
    if (key === this.shown || (this.naming >= 0 && isThere(this.naming))) return;
    this.shown = key;
    if (this.chosen !== null && !every(futures).some(({ number }) => number === this.chosen)) this.choose(null, '');
    this.list(futures);
  }

  /** Whether there are others. */
  get isSeveral() {
    return this.futures.length > 0;
  }

  /** Go to the branch of a link; '' where the run is there then, else why it is not. @param {number} wanted @returns {string} */
  go(wanted) {
    if (wanted === this.current) return '';
    const known = every(this.futures).find(({ number }) => number === wanted);
    if (!known) return 'the branch of this link is no more: what the run does now is shown instead';
    if (known.older)
      return 'the branch of this link is of an older spec: its curves can be compared, but it cannot go on';
    if (!this.owner)
      return 'this link is of another branch: only the owner can go there, and this page shows where the run is';
    this.link.ask('switch', { number: wanted });
    return '';
  }

  /** @param {Future[]} futures */
  list(futures) {
    const list = this.find('others'),
      focused = list.contains(document.activeElement);
    this.find('current').replaceChildren(...this.run());
    list.replaceChildren(...this.rows(futures));
    const summary = /** @type {HTMLElement} */ (document.querySelector('[data-fold=interventions] > summary'));
    if (focused) (list.querySelector('button') ?? summary).focus();
  }

  /** The rows of a tree, the latest first. @param {Future[]} futures @returns {HTMLElement[]} */
  rows(futures) {
    return [...futures].reverse().map((one) => {
      const row = document.createElement('li'),
        inner = document.createElement('ul');
      row.className = 'branch';
      inner.className = 'tree';
      row.append(this.branch(one));
      inner.append(...this.rows(one.within));
      if (one.within.length) row.append(inner);
      return row;
    });
  }

  /** What the run does now, and a button to give that a name. @returns {HTMLElement[]} */
  run() {
    const words = document.createElement('span'),
      { current: number, named: name } = this;
    words.textContent = name ? `this run: ${name}` : 'this run';
    if (!this.owner) return [words];
    const rename = button('rename', 'rename this run', () => this.rename({ number, name }, words));
    rename.className = 'small';
    return [words, rename];
  }

  /** Have the run go to a branch, so that it can be undone: back to the step at which it was. @param {number} number
   * @param {string} own */
  enter(number, own) {
    const { current, link } = this,
      shown = link.look?.step ?? 0;
    this.undo.whole({
      words: `went to ${own}`,
      undo: () => link.ask('switch', { number: current, shown }),
      redo: () => link.ask('switch', { number }),
    });
  }

  /** Have a branch shown beside the run, −1 for none, so that it can be undone. @param {number} number @param {string} words */
  put(number, words) {
    const show = (/** @type {number} */ which) => () => this.link.ask('compare', { number: which });
    this.undo.whole({ words, undo: show(this.compared ?? -1), redo: show(number) });
  }

  /** What can be done with a branch. @param {Future} future @returns {HTMLElement} */
  branch(future) {
    const { number, name, turned, within, older } = future;
    const words = turned.map((entry) => `step ${entry.step + 1}: ${told(entry)}`).join('; ') || 'as it went',
      own = called(future);
    const go = button(
      `${name ? `${name}, ` : ''}${span(future)}: ${words}${older ? ' (of an older spec)' : ''}`,
      '',
      () => (older ? this.choose(number, own) : this.enter(number, own)),
    );
    go.className = 'go';
    go.title = older
      ? 'its curves can be shown beside; it cannot go on, as the spec is another one'
      : 'go there, to the same step';
    go.disabled = !this.owner && !older;
    const beside = button('A | B', `A | B with ${own}`, () => {
      if (this.compared === number) this.put(-1, 'A alone');
      else {
        if (this.chosen !== number) this.choose(number, own);
        this.put(number, `A | B, ${own}`);
      }
    });
    beside.setAttribute('aria-pressed', String(this.compared === number));
    beside.className = 'small';
    beside.title = 'its picture beside this one, at the same step';
    const compare = button('compare', `compare with ${own}`, () =>
      this.choose(this.chosen === number ? null : number, own),
    );
    compare.setAttribute('aria-pressed', String(this.chosen === number));
    compare.dataset.branch = String(number);
    const place = document.createElement('span');
    compare.className = 'small';
    place.append(compare);
    if (this.owner && !older) place.append(beside);
    if (this.owner) {
      const forget = button('delete', `delete ${own}`, () => {
        this.link.ask('forget', { number });
        const more = within.length ? `, and ${every(within).length} within it` : '';
        const again = { undo: () => this.link.ask('restore'), redo: () => this.link.ask('forget', { number }) };
        this.undo.act({ words: `deleted ${own}${more}`, ...again });
        this.undo.tell(`deleted ${own}${more}`);
      });
      const rename = button('rename', `rename ${own}`, () => this.rename(future, go));
      forget.className = rename.className = 'small';
      place.append(rename, forget);
    }
    const whole = document.createElement('div');
    whole.append(go, place);
    return whole;
  }

  /** Give a branch another name, in its place. @param {{number: number, name: string}} branch @param {HTMLElement} place */
  rename({ number, name }, place) {
    this.naming = number;
    retype(place, name, 'name of the branch', (called) => {
      this.naming = -1;
      this.shown = '';
      if (called === null) return;
      const call = (/** @type {string} */ one) => () => this.link.ask('rename', { number, name: one });
      call(called)();
      this.undo.act({ words: `branch named ${called || 'no more'}`, undo: call(name), redo: call(called) });
    });
  }

  /** Compare with a branch, or with none. @param {number | null} number @param {string} name */
  choose(number, name) {
    this.chosen = number;
    for (const one of /** @type {NodeListOf<HTMLElement>} */ (this.find('others').querySelectorAll('[data-branch]')))
      one.setAttribute('aria-pressed', String(one.dataset.branch === String(number)));
    this.compare(number, name);
  }
}
