/**
 * Ranges: the steps between which curves are looked at closely, and which a run is played over and over.
 */

import { THUMB } from './scrubber.js';

/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Status} Status */
/** @typedef {import('./scrubber.js').Scrubber} Scrubber */

/** So far is dragged at least, in pixels of a page; as many steps are shown at least; how much closer a turn of the wheel comes. */
const DRAGGED = 4,
  FEWEST = 4,
  CLOSER = 0.8;

/** Zooms the axis of time by a drag with shift, or the wheel, over curves. */
export class Range {
  /** @param {Link} link @param {Scrubber} scrubber @param {(id: string) => HTMLElement} find @param {() => void} changed */
  constructor(link, scrubber, find, changed) {
    this.link = link;
    this.scrubber = scrubber;
    this.changed = changed;
    this.place = find('strips');
    this.past = find('past');
    this.chosen = find('chosen');
    this.loop = /** @type {HTMLButtonElement} */ (find('loop'));
    this.all = find('unzoom');
    this.zoomed = find('zoomed');
    /** where a drag has begun, in steps @type {number | null} */
    this.from = null;
    this.x = 0;
    /** the steps that are played over and over @type {number[] | null} */
    this.looped = null;
    this.owner = false;
    this.place.addEventListener('pointerdown', (event) => this.begin(event));
    this.place.addEventListener('pointermove', (event) => this.drag(event));
    this.place.addEventListener('pointerup', (event) => this.end(event));
    this.place.addEventListener('pointercancel', () => this.choose(null, 0));
    this.place.addEventListener('dblclick', () => this.zoom(null));
    this.place.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
    this.all.onclick = () => this.zoom(null);
    this.loop.onclick = () => this.toggle();
  }

  /** The curve under an event, and the step there. @param {MouseEvent} event @returns {[HTMLElement, number] | null} */
  at(event) {
    const curve = /** @type {HTMLElement} */ (event.target);
    if (!curve.matches('.trace:not(.plane)')) return null;
    return [curve, this.scrubber.under(event.clientX - curve.getBoundingClientRect().left, curve.clientWidth)];
  }

  /** @param {PointerEvent} event */
  begin(event) {
    const found = event.shiftKey && event.button === 0 ? this.at(event) : null;
    if (!found) return;
    found[0].setPointerCapture(event.pointerId);
    [this.from, this.x] = [found[1], event.clientX];
  }

  /** @param {PointerEvent} event */
  drag(event) {
    const found = this.from === null ? null : this.at(event);
    if (found) this.choose(this.from, found[1]);
  }

  /** @param {PointerEvent} event */
  end(event) {
    const found = this.from === null ? null : this.at(event),
      { from, x } = this;
    this.choose(null, 0);
    if (found && from !== null && Math.abs(event.clientX - x) >= DRAGGED)
      this.zoom([Math.min(from, found[1]), Math.max(from, found[1])]);
  }

  /** Show what is dragged over; null: nothing any more. @param {number | null} from @param {number} to */
  choose(from, to) {
    this.from = from;
    this.chosen.hidden = from === null;
    const curve = /** @type {HTMLElement | null} */ (this.place.querySelector('.trace'));
    if (from === null || !curve) return;
    const [left, right] = [from, to]
      .map((step) => curve.offsetLeft + THUMB + this.scrubber.across(step) * (curve.clientWidth - 2 * THUMB))
      .sort((one, other) => one - other);
    this.chosen.style.transform = `translateX(${left.toFixed(1)}px)`;
    this.chosen.style.width = `${(right - left).toFixed(1)}px`;
  }

  /** Come closer to the step under the pointer, or go away; where the curves scroll, with shift. @param {WheelEvent} event */
  wheel(event) {
    const scrolls = this.past.scrollHeight > this.past.clientHeight + 1,
      found = scrolls && !event.shiftKey ? null : this.at(event),
      turned = Math.sign(event.deltaY || event.deltaX);
    if (!found || !turned) return;
    event.preventDefault();
    const { low, high } = this.scrubber,
      factor = turned < 0 ? CLOSER : 1 / CLOSER;
    this.zoom([low, high].map((end) => Math.round(found[1] + (end - found[1]) * factor)));
  }

  /** Show these steps alone, or, null, as many as are chosen. @param {number[] | null} range */
  zoom(range) {
    const { look } = this.link;
    if (!look) return;
    const { end } = this.scrubber;
    let [low, high] = range ?? [look.first, end];
    if (high - low < FEWEST) high = low + FEWEST;
    [low, high] = [Math.max(look.first, low), Math.min(end, high)];
    this.scrubber.range = low <= look.first && high >= end ? null : [low, high];
    if (!this.scrubber.range && this.looped && this.owner) this.link.ask('unloop');
    this.show();
  }

  /** Play the steps that are shown over and over, or no more. */
  toggle() {
    const { low } = this.scrubber,
      high = Math.min(this.scrubber.high, this.link.look?.last ?? 0);
    if (this.looped) this.link.ask('unloop');
    else if (high > low) {
      this.scrubber.range = [low, high];
      this.link.ask('loop', { first: low, last: high });
      this.link.ask('play');
    }
    this.show();
  }

  /** @param {Status} status */
  status(status) {
    [this.looped, this.owner] = [status.loop, status.owner && !status.can.arrives];
    this.show();
  }

  /** Say what is shown alone, and whether it is played over and over. */
  show() {
    this.zoomed.hidden = !this.scrubber.range && !(this.looped && this.owner);
    this.loop.hidden = !this.owner;
    this.loop.setAttribute('aria-pressed', String(this.looped !== null));
    this.loop.title = this.looped
      ? `steps ${this.looped.join(' to ')} are played over and over: go on (L)`
      : 'play these steps over and over (L)';
    this.changed();
  }
}
