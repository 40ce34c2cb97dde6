/**
 * Appearance: the theme, and how many times as large the gains are.
 */

import { Sliders } from './sliders.js';

/** @typedef {import('./protocol.js').Link} Link */

/** What is coloured, or drawn thicker. @type {Object<string, string>} */
const GAINS = {
  activity: 'colour of neurons', signal: 'colour of connections', thickness: 'thickness of connections', change: 'glow where weights change',
};

/** A choice of themes, and a slider for each gain. */
export class Appearance {
  /** @param {Link} link @param {HTMLSelectElement} theme @param {HTMLElement} place */
  constructor(link, theme, place) {
    this.theme = theme;
    /** @type {Object<string, any>} */
    this.shown = {};
    const ask = (/** @type {object} */ more) => link.ask('draw', { ...this.shown, ...more });
    theme.onchange = () => ask({ theme: theme.value });
    this.sliders = new Sliders(place);
    for (const [name, description] of Object.entries(GAINS)) {
      this.sliders.add({ name, value: 1, low: 1 / 64, high: 64, description, log: true }, `gain-${name}`,
        (value, moving) => { if (!moving) ask({ [name]: value ?? 1 }); });
    }
  }

  /** @param {string[]} names */
  use(names) {
    if (this.theme.length === names.length + 1) return;
    this.theme.replaceChildren(...['', ...names].map((name) => new Option(name || 'of the spec', name)));
    this.theme.value = this.shown.theme;
  }

  /** @param {Object<string, any>} shown */
  show(shown) {
    this.shown = shown;
    this.theme.value = shown.theme;
    this.sliders.show(shown);
  }
}
