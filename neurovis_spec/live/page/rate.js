/**
 * The rate: how fast a run really goes, where that is not what was asked for, and what makes its steps.
 */

/** @typedef {import('./protocol.js').Status} Status */

/** Over how many milliseconds it is measured; what is below this share of the speed that was asked for is told. */
const OVER = 1000,
  LATE = 0.9;

/** What backends are called. @type {Object<string, string>} */
const CALLED = { c: 'C', numpy: 'NumPy', reference: 'Python' };

/** Says it in the bar. */
export class Rate {
  /** @param {HTMLElement} place */
  constructor(place) {
    this.place = place;
    this.asked = 1;
    this.playing = false;
    this.backend = '';
    /** where it is measured from: a time and a step @type {[number, number] | null} */
    this.from = null;
    /** the speed that is reached, as a factor of real time; NaN where that is not known */
    this.reached = Number.NaN;
  }

  /** @param {Status} status */
  status({ speed, playing, backend }) {
    const asked = speed === 'max' ? Infinity : Number(speed);
    if (asked !== this.asked || playing !== this.playing) [this.from, this.reached] = [null, Number.NaN];
    [this.asked, this.playing, this.backend] = [asked, playing, backend];
    this.tell();
  }

  /** A step is shown. @param {number} step @param {number | null} dt seconds in a step, null where nothing says so */
  show(step, dt) {
    const now = performance.now();
    if (!this.playing || dt === null || (this.from && step < this.from[1])) this.from = null;
    else if (!this.from) this.from = [now, step];
    else if (now - this.from[0] >= OVER) {
      this.reached = ((step - this.from[1]) * dt * 1000) / (now - this.from[0]);
      this.from = [now, step];
      this.tell();
    }
  }

  /** Say it. */
  tell() {
    const { reached, asked, place } = this,
      late = reached < LATE * asked;
    const made = this.backend && `in ${CALLED[this.backend] ?? this.backend}`,
      words = [late && `×${Number(reached.toPrecision(2))}`, made].filter(Boolean).join(' · ');
    if (place.textContent === words) return;
    place.textContent = words;
    const why = Number.isFinite(asked) ? `as fast as it can, of ×${asked} that is asked for` : 'as fast as it can';
    place.title = [late && `times real time: ${why}`, made && `steps are made ${made}`].filter(Boolean).join('; ');
  }
}
