/**
 * Turning: parameters, clamps and lesions by hand; what was turned, listed, taken back, and copied for the spec.
 */

import { eventsOf, takenBack } from './events.js';
import { Sliders } from './sliders.js';

/** @typedef {import('./protocol.js').Declared} Declared */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Turned} Turned */

/** A turn in words. @param {Turned} turn @returns {string} */
function told(turn) {
  const pairs = (/** @type {object} */ values) => Object.entries(values).map(([name, value]) => `${name} = ${value}`).join(', ');
  switch (turn.type) {
    case 'set': return pairs(turn.values);
    case 'hold': return `clamp ${turn.neurons} = ${turn.value}`;
    case 'feed': return turn.values.length ? `feed ${turn.name} = ${turn.values.join(', ')}` : `${turn.name} from its source`;
    case 'learn': return `learning of ${turn.connections} ${turn.on ? 'on' : 'off'}`;
    default: return `${turn.type} ${turn.neurons || turn.part}`;
  }
}

/** The panel in which a run is turned. */
export class Turning {
  /** @param {Link} link @param {(id: string) => HTMLElement} find */
  constructor(link, find) {
    this.link = link;
    this.find = find;
    this.panel = find('turning');
    this.sliders = new Sliders(link, find('sliders'));
    /** @type {Declared[]} */
    this.declared = [];
    this.ref = '';
    const clampTo = /** @type {HTMLInputElement} */ (find('clampto'));
    find('clamp').onclick = () => link.ask('hold', { neurons: this.ref, value: Number(clampTo.value) });
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

  /** Another network. @param {Declared[]} declared */
  use(declared) {
    this.declared = declared;
    this.sliders.use(declared);
  }

  /** A neuron or a connection is held, or nothing. @param {Group | undefined} group */
  hold(group) {
    this.find('part').hidden = !group;
    if (!group) return;
    const { neuron, connection, index } = group.data;
    this.ref = neuron ?? (Number(index) > 1 ? `${connection} (${index})` : connection);
    this.find('parted').textContent = this.ref;
    this.find('clamps').hidden = neuron === undefined;
  }

  /** @param {any} status */
  status(status) {
    /** @type {HTMLFieldSetElement} */ (this.find('turns')).disabled = !status.owner || !status.can.turns;
    this.sliders.show(status.parameters);
    this.list(status.turned);
    /** @type {HTMLTextAreaElement} */ (this.find('events')).value = eventsOf(status.turned);
  }

  /** List what was turned, the latest first; settings of one parameter in a row are one. @param {Turned[]} turned */
  list(turned) {
    const list = this.find('turned'), focused = list.contains(document.activeElement), rows = [];
    for (let last = turned.length - 1, first; last >= 0; last = first - 1) {
      const names = (/** @type {Turned} */ entry) => (entry.type === 'set' ? Object.keys(entry.values).join() : NaN);
      for (first = last; first > 0 && names(turned[first - 1]) === names(turned[last]); first--);
      const row = document.createElement('li'), undo = document.createElement('button'), from = first;
      const words = `step ${turned[last].step + 1}: ${told(turned[last])}`;
      undo.textContent = 'undo';
      undo.setAttribute('aria-label', `undo ${words}`);
      undo.onclick = () => {
        const { type, ...more } = takenBack(turned, from, this.declared);
        this.link.ask(type, more);
      };
      row.append(words, undo);
      rows.push(row);
    }
    list.replaceChildren(...rows);
    if (focused) (list.querySelector('button') || this.find('copy')).focus();
  }

  /** Copy what was turned, as events; where the page may not, select it. */
  copy() {
    const area = /** @type {HTMLTextAreaElement} */ (this.find('events'));
    area.select();
    if (navigator.clipboard) navigator.clipboard.writeText(area.value).catch(() => area.focus());
  }
}
