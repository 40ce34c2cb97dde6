/**
 * Turning: parameters, inputs, rules, clamps and lesions by hand; what was turned, listed, taken back, and copied for the spec.
 */

import { Appearance, drawnOtherwise } from './appearance.js';
import { Feeds } from './feeds.js';
import { refOf } from './protocol.js';
import { Rules } from './rules.js';
import { Sliders, withNumber } from './sliders.js';
import { told } from './told.js';
import { Weight } from './weight.js';

/** @typedef {import('./protocol.js').Gains} Gains */
/** @typedef {import('./protocol.js').Status} Status */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Turned} Turned */

/** The panel in which a run is turned. */
export class Turning {
  /** @param {Link} link @param {(id: string) => HTMLElement} find */
  constructor(link, find) {
    this.link = link;
    this.find = find;
    this.panel = find('turning');
    this.sliders = new Sliders(find('sliders'));
    this.feeds = new Feeds(link, find('feeds'));
    this.rules = new Rules(link, find('rules'));
    this.weight = new Weight(link, find('weight'));
    this.appearance = new Appearance(
      link,
      /** @type {HTMLSelectElement} */ (find('theme')),
      find('gains'),
      /** @type {HTMLButtonElement} */ (find('pathways')),
    );
    this.shown = '';
    this.ref = '';
    const clampTo = /** @type {HTMLInputElement} */ (find('clampto'));
    find('clamp').onclick = () => withNumber(clampTo, (value) => link.ask('hold', { neurons: this.ref, value }));
    find('release').onclick = () => link.ask('release', { neurons: this.ref });
    find('lesion').onclick = () => link.ask('lesion', { part: this.ref });
    find('mend').onclick = () => link.ask('mend', { part: this.ref });
    find('turn').onclick = () => this.toggle();
    find('copy').onclick = () => this.copy();
  }

  /** Open or close the panel. */
  toggle() {
    this.panel.hidden = !this.panel.hidden;
    this.find('turn').setAttribute('aria-expanded', String(!this.panel.hidden));
    if (this.panel.hidden) this.find('picture').focus();
  }

  /** Another network. @param {Scene} scene */
  use({ parameters, inputs, rules, themes }) {
    this.appearance.use(themes);
    const shown = JSON.stringify([parameters, inputs, rules]);
    if (shown === this.shown) return;
    this.shown = shown;
    this.sliders.clear();
    for (const entry of parameters) {
      this.sliders.add(entry, `slider-${entry.name}`, (value, moving) => {
        this.link.ask('set', { values: { [entry.name]: value ?? entry.value }, moving });
      });
    }
    this.feeds.use(inputs);
    this.rules.use(rules);
    this.find('inputs').hidden = !inputs.length;
    this.find('learning').hidden = !rules.length;
  }

  /** A neuron or a connection is held, or nothing. @param {Group | undefined} group */
  hold(group) {
    this.find('part').hidden = !group || !['hold', 'lesion', 'weigh'].some((type) => this.link.takes.has(type));
    if (!group) return;
    const { neuron } = group.data;
    this.ref = refOf(group.data);
    this.find('parted').textContent = this.ref;
    this.find('clamps').hidden = neuron === undefined;
    this.weight.hold(group, this.ref);
  }

  /** @param {Status} status */
  status(status) {
    /** @type {HTMLFieldSetElement} */ (this.find('turns')).disabled = !status.owner;
    /** @type {HTMLFieldSetElement} */ (this.find('drawn')).disabled = !status.owner;
    this.appearance.show(status.appearance, status.owner);
    this.sliders.show(status.parameters);
    this.feeds.show(status.fed);
    this.rules.show(status.learning);
    this.find('events').hidden = !status.copied;
    /** @type {HTMLButtonElement} */ (this.find('copy')).disabled = !status.copied;
    this.list(status.turned, status.appearance);
    /** @type {HTMLTextAreaElement} */ (this.find('events')).value = status.copied;
  }

  /** List what was turned, the latest first, and after that what is drawn otherwise.
   * @param {Turned[]} turned @param {Gains} appearance */
  list(turned, appearance) {
    const list = this.find('turned'),
      focused = list.contains(document.activeElement);
    const row = (/** @type {string} */ words, /** @type {() => {type: string}} */ taken) => {
      const one = document.createElement('li'),
        undo = document.createElement('button');
      undo.textContent = 'undo';
      undo.setAttribute('aria-label', `undo ${words}`);
      undo.onclick = () => {
        const { type, ...more } = taken();
        this.link.ask(type, more);
      };
      one.append(words, undo);
      return one;
    };
    const rows = [
      ...drawnOtherwise(appearance).map(({ words, back }) => row(words, () => ({ type: 'draw', ...back }))),
      ...turned.map((entry) =>
        row(`step ${entry.step + 1}: ${told(entry)}`, () =>
          this.link.takes.has('undo') || !entry.back ? { type: 'undo', number: entry.number } : entry.back,
        ),
      ),
    ];
    list.replaceChildren(...rows.reverse());
    const summary = /** @type {HTMLElement} */ (this.panel.querySelector('[data-fold=interventions] > summary'));
    if (focused) (list.querySelector('button') ?? summary).focus();
  }

  /** Copy what was turned, as events; where the page may not, select it. */
  copy() {
    const area = /** @type {HTMLTextAreaElement} */ (this.find('events'));
    area.select();
    if (navigator.clipboard) navigator.clipboard.writeText(area.value).catch(() => area.focus());
  }
}
