/**
 * The scrubber: the time axis, which strips share, the step on it, how far back it reaches, and what happened when.
 */

import { every } from './branches.js';
import { Sized } from './sized.js';

/** @typedef {import('./protocol.js').Status} Status */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Look} Look */

/** Half the width of a slider's thumb: so far from its ends lie the first and the last step, in pixels of a page. */
export const THUMB = 8;
/** Milliseconds for which the thumb stays where a key has put it, and between two steps that are sought. */
const KEPT = 300,
  AGAIN = 30;

/** Shows the steps from `low` to `high`, the latest `span` of them, or those around the step that is shown; where the run
 * goes on differently, those that it has still to go over, too. */
export class Scrubber {
  /** @param {Link} link @param {(id: string) => HTMLElement} find @param {() => void} changed */
  constructor(link, find, changed) {
    this.link = link;
    this.low = 0;
    this.high = 0;
    /** @type {HTMLInputElement} */
    this.scrub = /** @type {HTMLInputElement} */ (find('scrub'));
    this.span = /** @type {HTMLSelectElement} */ (find('span'));
    this.reach = find('reach');
    this.marks = /** @type {HTMLCanvasElement} */ (find('marks'));
    this.cursor = find('cursor');
    this.size = new Sized(/** @type {HTMLElement} */ (this.scrub.parentElement), changed);
    /** the axis below the strips, which is there also where this one is hidden, as in a talk */
    this.ticks = new Sized(find('ticks'), changed);
    this.sought = -KEPT;
    this.goal = 0;
    this.timer = 0;
    /** the last step of how it went before, which the run goes over differently, and the last that can be shown */
    this.ahead = 0;
    this.end = 0;
    /** the other branches, and the one that is drawn behind the curves, null for that which was left last
     * @type {Status['futures']} */
    this.futures = [];
    /** @type {number | null} */
    this.branch = null;
    /** the steps of the spec's events @type {number[]} */
    this.events = [];
    /** the steps from which on something is turned, those that are still to come again among them @type {number[]} */
    this.turned = [];
    /** @type {number[]} */
    this.known = [];
    this.drawn = '';
    /** the steps that are shown alone, where some are @type {number[] | null} */
    this.range = null;
    this.scrub.oninput = () => {
      const most = this.link.look?.last ?? Infinity;
      if (Number(this.scrub.value) > most) this.scrub.value = String(most);
      this.seek(Number(this.scrub.value));
    };
    this.span.onchange = changed;
    this.changed = changed;
    find('time').addEventListener(
      'wheel',
      (event) => {
        this.more(Math.sign(event.deltaY));
        event.preventDefault();
      },
      { passive: false },
    );
  }

  /** Go to a step; of many that are sought in a drag, to some and the last. @param {number} step */
  seek(step) {
    this.sought = performance.now();
    step = Math.min(step, this.link.look?.last ?? step);
    this.goal = step;
    if (this.timer) return;
    this.link.ask('seek', { step });
    this.timer = setTimeout(() => {
      this.timer = 0;
      if (this.goal !== step) this.seek(this.goal);
    }, AGAIN);
  }

  /** Show more of the past, or less. @param {number} by */
  more(by) {
    this.span.selectedIndex = Math.max(0, Math.min(this.span.length - 1, this.span.selectedIndex + by));
    this.changed();
  }

  /** @param {Status} status */
  status(status) {
    this.scrub.disabled = !status.owner;
    this.events = status.events;
    this.turned = status.turned.map((/** @type {{step: number}} */ { step }) => step + 1);
    this.futures = status.futures;
    this.extend();
  }

  /** Another branch is drawn behind the curves, by its number; null for the one that was left last.
   * @param {number | null} branch */
  compare(branch) {
    this.branch = branch;
    this.extend();
    this.changed();
  }

  /** Have the axis go on to the end of what is drawn behind the curves, where the run differs from that. */
  extend() {
    const left = this.futures.at(-1),
      differs = left && (left.turned.length > 0 || this.turned.some((step) => step > left.at)),
      chosen = every(this.futures).find(({ number }) => number === this.branch) ?? (differs ? left : undefined);
    this.ahead = chosen?.last ?? 0;
  }

  /** How far across the axis a step is, from 0 to 1. @param {number} step @returns {number} */
  across(step) {
    return (step - this.low) / Math.max(1, this.high - this.low);
  }

  /** The step under a pixel of an element as wide as the axis. @param {number} x @param {number} width @returns {number} */
  under(x, width) {
    const share = (x - THUMB) / Math.max(1, width - 2 * THUMB);
    return Math.round(this.low + Math.min(1, Math.max(0, share)) * (this.high - this.low));
  }

  /** The steps at which events begin and something is turned, with which of both it is. @returns {[number, boolean][]} */
  happened() {
    /** @type {[number, boolean][]} */
    const all = [
      ...this.events.map((step) => /** @type {[number, boolean]} */ ([step, true])),
      ...this.known.map((step) => /** @type {[number, boolean]} */ ([step, false])),
    ];
    return all.filter(([step]) => step >= this.low && step <= this.high);
  }

  /** @param {Look} look */
  show(look) {
    const { first, last, step } = look,
      span = Number(this.span.value) || Infinity,
      end = Math.max(last, this.ahead),
      { scrub } = this;
    this.end = end;
    const coming = this.known.filter((turn) => turn > step + 1 && turn <= last);
    this.known = [...new Set([...this.turned, ...coming])];
    if (this.range && (this.range[0] >= last || this.range[1] <= first)) this.range = null;
    if (this.range) {
      [this.low, this.high] = [Math.max(first, this.range[0]), Math.min(end, this.range[1])];
      [scrub.min, scrub.max] = [String(this.low), String(this.high)];
      if (document.activeElement !== scrub || performance.now() - this.sought > KEPT) scrub.value = String(step);
    } else if (!scrub.matches(':active')) {
      const low = this.high - span,
        inside = (step > low || (step === first && low <= first)) && step < this.high;
      if (step === end || end - first <= span) this.high = end;
      else if (!inside) this.high = Math.round(step + span / 2);
      this.high = Math.min(end, Math.max(this.high, first + span));
      this.low = Math.max(first, this.high - span);
      [scrub.min, scrub.max] = [String(this.low), String(this.high)];
      if (document.activeElement !== scrub || performance.now() - this.sought > KEPT) scrub.value = String(step);
    }
    scrub.setAttribute('aria-valuetext', `step ${step} of ${last}, back to ${first}`);
    const words = `back to ${first}`;
    if (this.reach.textContent !== words) this.reach.textContent = words;
    this.cursor.hidden = step < this.low || step > this.high;
    const { left, wide } = this.ticks,
      at = left + THUMB + this.across(step) * (wide - 2 * THUMB);
    this.cursor.style.transform = `translateX(${at.toFixed(1)}px)`;
    this.mark(this.size.wide);
  }

  /** Mark what happened: a filled triangle for an event of the spec, a ring for a turn. @param {number} width */
  mark(width) {
    const happened = this.happened(),
      layout = happened.length ? [width, devicePixelRatio, this.low, this.high, ...happened].join(' ') : '';
    if (layout === this.drawn) return;
    this.drawn = layout;
    const { marks } = this,
      context = /** @type {CanvasRenderingContext2D} */ (marks.getContext('2d'));
    [marks.width, marks.height] = [width * devicePixelRatio, 9 * devicePixelRatio];
    context.scale(devicePixelRatio, devicePixelRatio);
    context.fillStyle = context.strokeStyle = getComputedStyle(marks).color;
    for (const [step, event] of happened) {
      const x = THUMB + this.across(step) * (width - 2 * THUMB);
      context.beginPath();
      if (event) {
        for (const [dx, y] of [
          [-4, 0],
          [4, 0],
          [0, 8],
        ])
          context.lineTo(x + dx, y);
        context.fill();
      } else {
        context.arc(x, 4.5, 3, 0, 2 * Math.PI);
        context.stroke();
      }
    }
  }
}
