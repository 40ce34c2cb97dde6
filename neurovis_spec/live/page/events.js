/**
 * Events: what was turned, as the `events:` of a spec.
 */

/** @typedef {import('./protocol.js').Turned} Turned */

/** A name or a text in a flow of YAML. @param {string} text @returns {string} */
const plain = (text) => (/^[\w. >()-]+$/.test(text) ? text : JSON.stringify(text));

/** The events that do what was turned: of what is turned twice at one step the last counts. @param {Turned[]} turned
 * @returns {string} */
export function eventsOf(turned) {
  /** @type {Map<string, {at: number, entry: Turned}>} */
  const last = new Map();
  /** @type {{at: number, words: string}[]} */
  const events = [];
  for (const entry of turned) {
    const at = entry.step + 1,
      what = { lesion: 'part', mend: 'part', hold: 'clamp', release: 'clamp' }[entry.type] || entry.type;
    const of = entry.part || entry.neurons || entry.connections || entry.name || '';
    if (entry.type === 'set') {
      for (const [name, value] of Object.entries(entry.values)) {
        last.set(`${at} set ${name}`, { at, entry: { ...entry, values: { [name]: value } } });
      }
    } else {
      const key = `${at} ${what} ${of}`;
      last.delete(key); // what is done last at a step is written last
      last.set(key, { at, entry });
    }
  }
  const all = [...last.values()];
  all.forEach(({ at, entry }, place) => {
    const { neurons, type } = entry;
    if (type === 'set') {
      const [[name, value]] = Object.entries(entry.values);
      events.push({ at, words: `{at: ${at}, set: {${plain(name)}: ${value}}}` });
    } else if (type === 'weigh') {
      events.push({ at, words: `{at: ${at}, set: {${plain(entry.connections)}: ${entry.value}}}` });
    } else if (type === 'hold') {
      const end = all.slice(place + 1).find((other) => other.entry.neurons === neurons);
      events.push({
        at,
        words: `{from: ${at}, ${end ? `to: ${end.at}, ` : ''}clamp: {${plain(neurons)}: ${entry.value}}}`,
      });
    } else if (type === 'lesion' || type === 'mend') {
      events.push({ at, words: `{at: ${at}, ${type}: ${plain(entry.part)}}` });
    } else if (type === 'learn') {
      events.push({ at, words: `{at: ${at}, learning: {${plain(entry.connections)}: ${entry.on}}}` });
    }
  });
  return events.length ? `events:\n${events.map(({ words }) => `  - ${words}\n`).join('')}` : '';
}
