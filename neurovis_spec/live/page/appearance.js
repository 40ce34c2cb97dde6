/**
 * Appearance: the theme, how many times as large the gains are, and whether groups are drawn as one glyph each.
 */

import { Sliders } from './sliders.js';

/** @typedef {import('./protocol.js').Gains} Gains */
/** @typedef {import('./protocol.js').Link} Link */

/** What is coloured, or drawn thicker. @type {Object<string, string>} */
const GAINS = {
  activity: 'colour of neurons',
  signal: 'colour of connections',
  thickness: 'thickness of connections',
  change: 'glow where weights change',
};

/** What is drawn otherwise than the spec says: in words, and what takes it back. @param {Gains} shown
 * @returns {{words: string, back: object}[]} */
export function drawnOtherwise(shown) {
  const { theme, pathways, ...gains } = shown;
  return [
    ...(theme ? [{ words: `theme ${theme}`, back: { ...shown, theme: '' } }] : []),
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
    this.shown = { theme: '', activity: 1, signal: 1, thickness: 1, change: 1, pathways: false };
    /** whether the system says if it is to be dark: nobody else does */
    this.isFree = false;
    /** whether it is dark because this page has asked for it */
    this.isFollowed = false;
    this.owner = false;
    this.isDark = matchMedia('(prefers-color-scheme: dark)');
    const ask = (/** @type {object} */ more) => link.ask('draw', { ...this.shown, ...more });
    this.ask = ask;
    theme.onchange = () => {
      this.isFree = false;
      ask({ theme: theme.value });
    };
    this.isDark.onchange = () => this.follow();
    this.sliders = new Sliders(place);
    for (const [name, description] of Object.entries(GAINS)) {
      this.sliders.add({ name, value: 1, low: 1 / 64, high: 64, description, log: true }, `gain-${name}`, (value) =>
        ask({ [name]: value ?? 1 }),
      );
    }
  }

  /** @param {string[]} names @param {boolean} themed whether a theme is asked for */
  use(names, themed) {
    if (this.theme.length === 0) this.isFree = !themed;
    this.follow();
    if (this.theme.length === names.length + 1) return;
    this.theme.replaceChildren(...['', ...names].map((name) => new Option(name || 'of the spec', name)));
    this.theme.value = this.shown.theme;
  }

  /** Be dark where the system is, unless somebody has chosen a theme. */
  follow() {
    const { matches } = this.isDark;
    if (!this.isFree || !this.owner || matches === this.isFollowed || this.shown.theme !== (matches ? '' : 'dark'))
      return;
    this.isFollowed = matches;
    this.ask({ theme: matches ? 'dark' : '' });
  }

  /** @param {Gains} shown @param {boolean} owner */
  show(shown, owner) {
    this.shown = shown;
    this.owner = owner;
    this.follow();
    const { theme, pathways, ...gains } = shown;
    this.theme.value = theme;
    this.pathways.setAttribute('aria-pressed', String(pathways));
    this.pathways.disabled = !owner;
    this.sliders.show(gains);
  }

  /** Draw each group as one glyph, or each neuron again. */
  toggle() {
    if (this.owner) this.ask({ pathways: !this.shown.pathways });
  }
}
