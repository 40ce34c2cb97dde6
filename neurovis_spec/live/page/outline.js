/**
 * The outline: boxes, neurons and connections as a list of names and values, to search, to read and to hold.
 */

import { isBeside } from './beside.js';
import { search } from './search.js';

/** @typedef {import('./attention.js').Attention} Attention */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./beside.js').Beside} Beside */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./search.js').Entry} Entry */

/** As many are listed, and so many more where the last is chosen or seen; and the values of so many are asked for: those around the one that is chosen. */
const LISTED = 100,
  VALUED = 24;

/** The panel with the list. */
export class Outline {
  /** @param {Attention} attention @param {Beside} beside @param {(id: string) => HTMLElement} find @param {(id: string) => void} taken called with
   * what is chosen */
  constructor(attention, beside, find, taken) {
    this.attention = attention;
    this.beside = beside;
    this.find = find;
    this.panel = find('outline');
    this.field = /** @type {HTMLInputElement} */ (find('search'));
    this.list = find('found');
    /** @type {Entry[]} */
    this.entries = [];
    /** what is listed, of all that fits @type {Entry[]} */
    this.shown = this.all = [];
    this.at = 0;
    this.field.oninput = () => this.fill();
    this.field.onkeydown = (event) => this.key(event);
    this.list.onclick = (event) => {
      const row = /** @type {Element} */ (event.target).closest('li');
      if (row) this.choose([...this.list.children].indexOf(row));
    };
    this.list.onscroll = () => {
      const { scrollTop, clientHeight, scrollHeight } = this.list;
      if (scrollTop + 2 * clientHeight > scrollHeight && this.shown.length < this.all.length) this.further();
    };
    find('outlined').onclick = () => this.toggle();
    this.taken = taken;
  }

  /** Another network. @param {Scene} scene */
  use(scene) {
    const { lone } = scene.bundles;
    this.entries = [];
    for (const { id, title } of this.beside.groups.values())
      if ('is'.includes(id[0])) this.entries.push({ id, name: title, more: this.beside.kind(id) });
    this.more(scene.groups.map((group) => (group.id in lone ? { ...group, id: `c${lone[group.id]}` } : group)));
  }

  /** There is more to be listed. @param {Group[]} groups */
  more(groups) {
    // boxes and bundles first, then neurons, connections, inputs and sensors
    const rank = (/** @type {Entry} */ { id }) => (/^[ncis]\d/.test(id) ? 'ncis'.indexOf(id[0]) : -1),
      known = new Set(this.entries.map(({ id }) => id));
    const added = groups
      .filter(({ id }) => /^([nc]\d+$|box:|instance:|bundle:)/.test(id) && !known.has(id))
      .map(({ id, data, title }) => {
        const [first, ...more] = title.split('\n');
        return { id, name: data.neuron === undefined ? first : data.neuron, more: [first, ...more].join('\n') };
      });
    if (!added.length) return;
    this.entries = [...this.entries, ...added].sort(
      (one, other) =>
        rank(one) - rank(other) || (rank(one) < 0 ? 0 : Number(one.id.slice(1)) - Number(other.id.slice(1))),
    );
    this.fill();
  }

  /** Open or close. */
  toggle() {
    this.panel.hidden = !this.panel.hidden;
    this.find('outlined').setAttribute('aria-expanded', String(!this.panel.hidden));
    this.fill();
    (this.panel.hidden ? this.find('picture') : this.field).focus();
  }

  /** Open, and search for something else. */
  search() {
    this.field.value = '';
    if (this.panel.hidden) this.toggle();
    else this.fill();
    this.field.focus();
  }

  /** What is held is another: list what it is connected with. */
  hold() {
    const ids = (/** @type {Entry[]} */ entries) => entries.map(({ id }) => id).join();
    if (!this.panel.hidden && !this.field.value && ids(this.first()) !== ids(this.all)) this.fill();
  }

  /** What is listed without a search: what is held with its inputs and outputs, else all. @returns {Entry[]} */
  first() {
    const { held, near, groups } = this.attention,
      own = this.attention.within(held);
    if (!held) return this.entries;
    const to = (/** @type {Entry} */ { id }) => own.has(groups.get(id)?.data.to ?? '');
    const found = this.entries.filter(({ id }) => id !== held && near.has(id) && (id[0] === 'c') === (held[0] !== 'c'));
    return [
      ...this.entries.filter(({ id }) => id === held),
      ...found.filter(to),
      ...found.filter((entry) => !to(entry)),
    ];
  }

  /** List what fits. */
  fill() {
    if (this.panel.hidden) {
      this.value([]);
      return;
    }
    this.all = this.field.value.trim() ? search(this.entries, this.field.value) : this.first();
    this.shown = [];
    this.list.replaceChildren();
    this.further();
    this.to(0);
  }

  /** List more of what fits. */
  further() {
    const more = this.all.slice(this.shown.length, this.shown.length + LISTED);
    this.shown = [...this.shown, ...more];
    this.list.append(
      ...more.map(({ id }) => {
        const row = document.createElement('li'),
          [name, more] = ['b', 'span'].map((tag) => document.createElement(tag));
        row.id = `found-${id}`;
        row.setAttribute('role', 'option');
        row.append(name, ' ', more);
        return row;
      }),
    );
    const left = this.all.length - this.shown.length;
    this.find('more').textContent = left ? `and ${left} more` : this.all.length ? '' : 'nothing is called so';
  }

  /** Go to a row. @param {number} at */
  to(at) {
    if (at >= this.shown.length && this.shown.length < this.all.length) this.further();
    this.at = Math.max(0, Math.min(this.shown.length - 1, at));
    [...this.list.children].forEach((row, place) => {
      row.setAttribute('aria-selected', String(place === this.at));
    });
    const row = this.list.children[this.at];
    this.field.setAttribute('aria-activedescendant', row ? row.id : '');
    if (row) row.scrollIntoView({ block: 'nearest' });
    const from = Math.max(0, this.at - VALUED / 3);
    this.value(
      this.shown
        .slice(from, from + VALUED)
        .map(({ id }) => id)
        .filter((id) => /^[ncis]\d+$/.test(id)),
    );
  }

  /** Ask for the values of these. @param {string[]} ids */
  value(ids) {
    if (ids.join() !== this.attention.listed.join()) {
      this.attention.listed = ids;
      this.attention.ask();
    }
    this.attention.changed();
  }

  /** Hold what a row is about. @param {number} at */
  choose(at) {
    const entry = this.shown[at];
    if (entry) this.taken(entry.id);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    /** @type {Object<string, () => void>} */
    const does = {
      ArrowDown: () => this.to(this.at + 1),
      ArrowUp: () => this.to(this.at - 1),
      PageDown: () => this.to(this.at + 10),
      PageUp: () => this.to(this.at - 10),
      Enter: () => this.choose(this.at),
      Escape: () => this.toggle(),
    };
    if (does[event.key]) {
      does[event.key]();
      event.preventDefault();
    }
  }

  /** Write names and values. @param {Look} look */
  show(look) {
    if (this.panel.hidden) return;
    const around = new Set(this.attention.listed);
    this.shown.forEach(({ id }, at) => {
      const [name, more] = /** @type {Iterable<HTMLElement>} */ (this.list.children[at].children);
      if (name.textContent && !around.has(id) && /^[nc]\d+$/.test(id)) return;
      const said = isBeside(id)
          ? `${this.beside.words(id, this.attention.values)}\nto be pinned`
          : this.attention.words(id, look),
        [first, ...rest] = said.split('\n'),
        words = rest.join(', ');
      if (name.textContent !== first) name.textContent = first;
      if (more.textContent !== words) more.textContent = words;
    });
  }
}
