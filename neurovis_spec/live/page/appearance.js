/**
 * Appearance: a viewer's own theme; and for all how many times as large the gains are, and whether each group is drawn as one node.
 */

import { keep, recall } from './memory.js';
import { Sliders } from './sliders.js';

/** @typedef {import('./protocol.js').Gains} Gains */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Scene} Scene */

/** What is coloured, or drawn thicker. @type {Object<string, string>} */
const GAINS = {
  activity: 'colour of neurons',
  signal: 'colour of connections',
  thickness: 'thickness of connections',
  change: 'glow where weights change',
};

/** By what the theme that was chosen is kept. */
const THEME = 'theme';

/** What is drawn otherwise than the spec says: in words, and what takes it back. @param {Gains} shown
 * @returns {{words: string, back: object}[]} */
export function drawnOtherwise(shown) {
  const { pathways, ...gains } = shown;
  return [
    ...(pathways ? [{ words: 'pathways', back: { ...shown, pathways: false } }] : []),
    ...Object.entries(gains)
      .filter(([, value]) => value !== 1)
      .map(([name, value]) => ({ words: `gain of ${name} × ${value}`, back: { ...shown, [name]: 1 } })),
  ];
}

/** A choice of themes, a slider for each gain, and a button for pathways. */
export class Appearance {
  /** @param {Link} link @param {HTMLSelectElement} theme @param {HTMLElement} place @param {HTMLButtonElement} pathways */
  constructor(link, theme, place, pathways) {
    this.theme = theme;
    this.pathways = pathways;
    pathways.onclick = () => this.toggle();
    /** @type {Gains} */
    this.shown = { activity: 1, signal: 1, thickness: 1, change: 1, pathways: false };
    this.link = link;
    /** the theme that was chosen here, '' for none */
    this.chosen = recall(THEME) || '';
    this.owner = false;
    this.isDark = matchMedia('(prefers-color-scheme: dark)');
    const ask = (/** @type {object} */ more) => {
      this.shown = { ...this.shown, ...more };
      link.ask('draw', this.shown);
    };
    this.ask = ask;
    theme.onchange = () => this.choose(theme.value);
    this.isDark.onchange = () => this.dress();
    this.sliders = new Sliders(place);
    for (const [name, description] of Object.entries(GAINS)) {
      this.sliders.add({ name, value: 1, low: 1 / 64, high: 64, description, log: true }, `gain-${name}`, (value) =>
        ask({ [name]: value ?? 1 }),
      );
    }
  }

  /** Have a theme from now on, '' for that of the spec. @param {string} name */
  choose(name) {
    this.chosen = name;
    this.theme.value = name;
    keep(THEME, name);
    this.dress();
  }

  /** Ask for the picture in the theme that was chosen, or as dark as the system where nobody asks for one. */
  dress() {
    this.link.ask('theme', { name: this.chosen, dark: this.isDark.matches });
  }

  /** Whether another scene, in a theme that was asked for, takes the place of this one at once. @param {Scene} scene */
  awaits({ theme, themed }) {
    const wanted = this.chosen || (this.isDark.matches && !themed ? 'dark' : '');
    return wanted !== '' && theme.name !== wanted;
  }

  /** Another network. @param {string[]} names */
  use(names) {
    if (this.theme.length !== names.length + 1)
      this.theme.replaceChildren(...['', ...names].map((name) => new Option(name || 'of the spec', name)));
    this.theme.value = this.chosen;
  }

  /** @param {Gains} shown @param {boolean} owner */
  show(shown, owner) {
    this.shown = shown;
    this.owner = owner;
    const { pathways, ...gains } = shown;
    this.pathways.setAttribute('aria-pressed', String(pathways));
    this.pathways.disabled = !owner;
    this.sliders.show(gains);
  }

  /** Draw each group as one node, or each neuron again. */
  toggle() {
    this.have(!this.shown.pathways);
  }

  /** Draw each group as one node, or each neuron. @param {boolean} pathways */
  have(pathways) {
    if (this.owner) this.ask({ pathways });
  }
}
