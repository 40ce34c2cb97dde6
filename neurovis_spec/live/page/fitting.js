/**
 * Fitting: the owner's page says of which shape its window is, so that the network is laid out for it where that shows it
 * larger; and a part of the picture is seen in the layout in which it was chosen.
 */

import { windowOf } from './room.js';
import { WRITTEN } from './undo.js';

/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Status} Status */

/** Of which shape a window can be. */
const SHAPES = ['tall', 'default', 'wide'];
/** What takes no longer than this, in milliseconds, is not told. */
const SOON = 700;

/** Asks for layouts. */
export class Fitting {
  /** @param {Link} link @param {HTMLElement} room what network and curves share @param {HTMLElement} words
   * @param {() => void} lost called where a part that was to be seen is of a layout that there is not */
  constructor(link, room, words, lost) {
    this.lost = lost;
    this.link = link;
    this.room = room;
    this.words = words;
    this.owner = false;
    /** for which window a layout was asked for last, '' for none */
    this.asked = '';
    /** what has a part of the picture be seen, once it is laid out for a window @type {{window: string, see: () => void} | null} */
    this.aim = null;
    this.timer = 0;
    this.isNew = true;
    matchMedia('(orientation: portrait)').onchange = () => this.turned();
  }

  /** Of which shape the window is. @returns {string} */
  get shape() {
    return windowOf(this.room.clientWidth, this.room.clientHeight);
  }

  /** The connection is there anew: what was asked for is asked again where nobody has asked for anything else. */
  begin() {
    this.isNew = true;
  }

  /** How the run stands, and whatever the page was opened with, is known. @param {Status} status */
  status({ owner }) {
    const { asked, isNew, link } = this;
    this.owner = owner && link.takes.has('fit');
    if (!this.owner) this.aim = null;
    else if (link.scene && isNew) {
      this.isNew = false;
      if (!asked) this.ask(this.aim?.window ?? this.shape);
      else if (link.scene.window !== asked && link.scene.window === 'default') this.ask(asked);
    }
  }

  /** @param {string} window */
  ask(window) {
    this.asked = window;
    this.link.ask('fit', { window });
  }

  /** The window was turned; who types has but opened a keyboard, and may have turned it when that is closed. */
  turned() {
    const { shape } = this;
    if (document.activeElement?.matches(WRITTEN)) {
      addEventListener('focusout', () => setTimeout(() => this.turned()), { once: true });
      return;
    }
    if (!this.owner || !this.asked || this.asked === shape) return;
    this.aim = null;
    this.ask(shape);
  }

  /** See a part of the picture in the layout for a window; what an address says need not be one. @param {string} said
   * @param {() => void} see */
  see(said, see) {
    const window = SHAPES.includes(said) ? said : 'default';
    const isThere = this.link.scene?.window === window;
    this.aim = isThere ? null : { window, see };
    const isOther = this.asked !== '' && this.asked !== window;
    if (isThere) {
      this.asked ||= window; // so that the page, which has just been opened with it, asks for no other
      see();
    }
    if (this.owner && (isThere ? isOther : this.asked)) this.ask(window);
  }

  /** Another scene has come. @param {Scene} scene */
  scene({ window }) {
    const { aim } = this;
    if (aim?.window !== window) return;
    this.aim = null;
    aim.see();
  }

  /** The network is being laid out for a window, or no more, and for which it is laid out that is shown.
   * @param {string | null} window @param {string} shown */
  told(window, shown) {
    clearTimeout(this.timer);
    this.words.hidden = true;
    if (window === null) {
      if (this.aim && this.aim.window !== shown) this.lost();
      this.aim = this.aim?.window === shown ? this.aim : null;
    } else
      this.timer = setTimeout(() => {
        this.words.hidden = false;
      }, SOON);
  }
}
