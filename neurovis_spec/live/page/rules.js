/**
 * Rules: whether connections learn, switched on and off entry by entry.
 */

/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Scene} Scene */

/** A switch for each rule. */
export class Rules {
  /** @param {Link} link @param {HTMLElement} place */
  constructor(link, place) {
    this.link = link;
    this.place = place;
    /** @type {Map<string, HTMLInputElement>} */
    this.switches = new Map();
  }

  /** Another network. @param {Scene['rules']} declared */
  use(declared) {
    this.switches.clear();
    this.place.replaceChildren(
      ...declared.map(({ connections, rule }) => {
        const label = document.createElement('label'),
          about = document.createElement('small');
        const one = Object.assign(document.createElement('input'), { type: 'checkbox' });
        one.onchange = () => this.link.ask('learn', { connections, on: one.checked });
        about.textContent = rule;
        label.append(one, ` ${connections} `, about);
        this.switches.set(connections, one);
        return label;
      }),
    );
  }

  /** Which learn now, null where some do. @param {Object<string, boolean | null>} learning */
  show(learning) {
    for (const [connections, one] of this.switches) {
      [one.checked, one.indeterminate] = [learning[connections] === true, learning[connections] === null];
    }
  }
}
