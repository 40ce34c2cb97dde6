/**
 * Weight: the weight of a connection that is held, with a slider within its bounds.
 */

import { Sliders } from './sliders.js';

/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Link} Link */

/** The slider of what is held; of a line that stands for several connections there is none. */
export class Weight {
  /** @param {Link} link @param {HTMLElement} place */
  constructor(link, place) {
    this.link = link;
    this.place = place;
    this.sliders = new Sliders(place);
    this.id = '';
    /** the weight that it had when it was held, which a reset gives it again @type {number | undefined} */
    this.begin = undefined;
  }

  /** Something is held. @param {Group} group @param {string} connections what names it */
  hold({ id }, connections) {
    const { ranges = [], ranged = [] } = this.link.scene ?? {},
      range = id[0] === 'c' ? ranges[ranged[Number(id.slice(1))]] : undefined;
    this.id = range ? id : '';
    this.begin = undefined;
    this.place.hidden = true;
    this.sliders.clear();
    if (!range) return;
    const [low, high, reach] = range;
    this.sliders.add({ name: 'weight', value: 0, low, high, reach, description: '' }, 'weigh', (value, moving) =>
      this.link.ask('weigh', { connections, value: value ?? this.begin ?? 0, moving }),
    );
  }

  /** Show the weight as it is now, as soon as that is known. @param {Object<string, number | null>} values */
  show(values) {
    const value = values[this.id];
    if (!this.id || value === undefined) return;
    this.begin ??= value ?? undefined;
    this.place.hidden = false;
    if (value !== null) this.sliders.show({ weight: value });
  }
}
