/**
 * Saves: the menu of what can be saved and shared, above its button in the bar.
 */

import { download, pixelsOf } from './save.js';
import { withNumber } from './sliders.js';

/** @typedef {import('./body.js').Body} Body */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Status} Status */

/** How far it is from its button and from the edges of the window, in pixels. */
const APART = 8;
/** How far a key goes among what can be chosen; those of a row and those of rows go the same way. @type {Object<string, number>} */
const BY = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 };

/** The menu. */
export class Saves {
  /** @param {Link} link @param {Body} body @param {(done: number, total: number) => void} making says how far a film is
   * @param {(id: string) => HTMLElement} find */
  constructor(link, body, making, find) {
    this.link = link;
    this.find = find;
    this.menu = find('saves');
    this.button = find('save');
    this.hasFile = false;
    this.isTurned = false;
    const closing = (/** @type {string} */ id, /** @type {() => void} */ action = () => {}) => {
      find(id).addEventListener('click', () => {
        if (this.menu.matches(':popover-open')) this.menu.hidePopover();
        action();
      });
    };
    closing('present');
    closing('png', async () => {
      const { scene, look } = link;
      if (scene && look) download(await pixelsOf(scene, look, body), `${scene.name}.png`);
    });
    for (const what of ['svg', 'pdf', 'npz']) closing(what, () => link.ask('fetch', { what, seconds: 1 }));
    closing('withevents', () => link.ask('save', { into: 'events' }));
    find('download').onclick = () => link.ask('fetch', { what: 'yaml', seconds: 1 });
    find('film').onclick = () =>
      withNumber(/** @type {HTMLInputElement} */ (find('seconds')), (seconds) => {
        link.ask('fetch', { what: /** @type {HTMLSelectElement} */ (find('kind')).value, seconds });
        making(0, 1);
      });
    this.menu.addEventListener('toggle', () => this.toggled());
    this.menu.addEventListener('keydown', (event) => this.key(event));
  }

  /** What can be chosen by now. @returns {HTMLElement[]} */
  get choices() {
    const all = /** @type {NodeListOf<HTMLElement>} */ (this.menu.querySelectorAll('button, input, select'));
    return [...all].filter((one) => !one.matches(':disabled') && one.offsetParent);
  }

  /** It has been opened, above its button, or closed. */
  toggled() {
    const isOpen = this.menu.matches(':popover-open'),
      { right, top } = this.button.getBoundingClientRect();
    this.button.setAttribute('aria-expanded', String(isOpen));
    if (!isOpen) return;
    this.frame();
    const width = this.menu.offsetWidth,
      left = Math.min(right - width, innerWidth - width - APART);
    this.menu.style.left = `${Math.max(APART, left)}px`;
    this.menu.style.bottom = `${innerHeight - top + APART}px`;
    this.menu.style.maxHeight = `${top - 2 * APART}px`;
    this.choices[0]?.focus();
  }

  /** Go among what can be chosen by arrows, and leave it by Escape; the page's keys do nothing meanwhile.
   * @param {KeyboardEvent} event */
  key(event) {
    const at = /** @type {HTMLElement} */ (event.target),
      by = BY[event.key];
    if (event.key === 'Escape') {
      event.preventDefault();
      this.menu.hidePopover();
      this.button.focus();
    } else if (by && at.matches('button')) {
      const { choices } = this;
      event.preventDefault();
      choices[(choices.indexOf(at) + by + choices.length) % choices.length]?.focus();
    }
    event.stopPropagation();
  }

  /** Who only looks on sees what may be had. @param {Status} status */
  status({ owner, turned }) {
    const own = /** @type {NodeListOf<HTMLElement>} */ (this.menu.querySelectorAll('[data-own]'));
    for (const one of own) one.hidden = !owner;
    this.isTurned = turned.length > 0;
    this.offer();
  }

  /** Whether there is a file to be written. @param {{files: boolean}} placed */
  placed({ files }) {
    this.hasFile = files;
    this.offer();
  }

  /** Offer the spec with events, where there are both. */
  offer() {
    /** @type {HTMLButtonElement} */ (this.find('withevents')).disabled = !(this.hasFile && this.isTurned);
    const why = this.hasFile ? 'no interventions yet' : 'there is no file of it here';
    this.find('noevents').textContent = this.hasFile && this.isTurned ? '' : why;
  }

  /** The step that is shown is told where a recording goes up to it. */
  frame() {
    const { look } = this.link;
    if (!look || !this.menu.matches(':popover-open')) return;
    const upto = this.find('upto'),
      words = `up to step ${look.step}`;
    if (upto.textContent !== words) upto.textContent = words;
  }
}
