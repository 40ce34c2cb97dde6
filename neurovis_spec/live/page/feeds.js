/**
 * Feeds: sliders for inputs without a source, one for each component.
 */

import { Sliders } from './sliders.js';

/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Scene} Scene */

/** Of inputs with more components all have one slider together. */
const MOST = 16;

/** What is given to inputs by hand; nothing: 0. */
export class Feeds {
  /** @param {Link} link @param {HTMLElement} place */
  constructor(link, place) {
    this.link = link;
    this.sliders = new Sliders(place);
    /** @type {Scene['inputs']} */
    this.declared = [];
    /** @type {Object<string, number[]>} */
    this.fed = {};
  }

  /** The names of the sliders of an input. @param {Scene['inputs'][0]} entry @returns {string[]} */
  names({ name, size }) {
    return size > 1 && size <= MOST ? Array.from({ length: size }, (_, at) => `${name} ${at + 1}`) : [name];
  }

  /** Another network. @param {Scene['inputs']} declared */
  use(declared) {
    this.declared = declared;
    this.sliders.clear();
    for (const entry of declared) {
      const names = this.names(entry);
      names.forEach((name, at) => {
        const description = at === names.length - 1 ? entry.description : '';
        this.sliders.add(
          { name, value: 0, low: null, high: null, description },
          `feed-${name.replace(' ', '-')}`,
          (value, moving) => {
            const values = names.map((_, other) => (this.fed[entry.name] || [])[other] || 0);
            values[at] = value || 0;
            this.link.ask('feed', {
              name: entry.name,
              values: value === null && !values.some(Boolean) ? [] : values,
              moving,
            });
          },
        );
      });
    }
  }

  /** @param {Object<string, number[]>} fed */
  show(fed) {
    this.fed = fed;
    this.sliders.show(
      Object.fromEntries(
        this.declared.flatMap((entry) => this.names(entry).map((name, at) => [name, (fed[entry.name] || [])[at] || 0])),
      ),
    );
  }
}
