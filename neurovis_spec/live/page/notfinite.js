/**
 * Not finite: which activity is no finite number, and since when, told until all are again.
 */

/** @typedef {import('./attention.js').Attention} Attention */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Nonfinite} Nonfinite */

/** Tells it. */
export class NotFinite {
  /** @param {Link} link @param {Attention} attention @param {(id: string) => HTMLElement} find */
  constructor(link, attention, find) {
    this.attention = attention;
    this.place = find('undefined');
    this.name = find('undefinedname');
    this.words = find('undefinedwords');
    this.more = find('undefinedmore');
    this.before = /** @type {HTMLButtonElement} */ (find('defined'));
    /** @type {Nonfinite} */
    this.told = { type: 'undefined', item: '', since: 0, known: true, count: 0 };
    this.name.onclick = () => {
      if (attention.groups.has(this.told.item)) attention.hold(this.told.item);
    };
    this.before.onclick = () => link.ask('seek', { step: this.told.since - 1 });
  }

  /** @param {Nonfinite} told @param {boolean} owner */
  tell(told, owner) {
    const { item, since, known, count } = told,
      group = this.attention.groups.get(item);
    this.told = told;
    this.place.hidden = !group;
    if (!group) return;
    const words = `is not finite since ${known ? '' : 'before '}step ${since}`;
    this.name.textContent = group.title.split('\n')[0];
    if (this.words.textContent !== words) this.words.textContent = words;
    this.more.textContent = count > 1 ? `and ${count - 1} other${count > 2 ? 's' : ''}` : '';
    this.before.hidden = !owner || !known || !since;
    this.before.textContent = `step ${since - 1}`;
    this.before.title = 'go to the last step at which it was finite';
  }
}
