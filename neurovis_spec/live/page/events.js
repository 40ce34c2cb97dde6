/**
 * Events: what was turned, as the `events:` of a spec.
 */

/** @typedef {import('./protocol.js').Turned} Turned */

/** A name or a text in a flow of YAML. @param {string} text @returns {string} */
const plain = (text) => (/^[\w. >()-]+$/.test(text) ? text : JSON.stringify(text));

/** What is called so is the second, third, … of several connections between the same ends: an event names all of these. */
const SEVERAL = / \(\d+\)$/;

/** By what a turn is known: of those at one step that are alike the last counts. @param {Turned} entry @returns {string} */
function keyOf({ step, type, part, neurons, connections, name }) {
  const what = { lesion: 'part', mend: 'part', hold: 'clamp', release: 'clamp' }[type] || type;
  return `${step} ${what} ${part || neurons || connections || name || ''}`;
}

/** What is turned at its step in the end: of parameters each by itself. @param {Turned[]} turned @returns {Turned[]} */
function lastOf(turned) {
  /** @type {Map<string, Turned>} */
  const last = new Map();
  for (const entry of turned) {
    const each =
      entry.type === 'set'
        ? Object.entries(entry.values).map(([name, value]) => ({ ...entry, name, values: { [name]: value } }))
        : [entry];
    for (const one of each) {
      const key = keyOf(one);
      last.delete(key); // what is done last at a step is written last
      last.set(key, one);
    }
  }
  return [...last.values()];
}

/** What an input is fed. @param {Turned} entry @returns {string} */
function fed({ values }) {
  const all = Object.values(values);
  return all.length > 1 ? `[${all.join(', ')}]` : String(all[0] ?? null);
}

/** A turn as an event; where there is none, why. @param {Turned} entry @param {Turned[]} before what was turned before it
 * @param {Turned[]} later and after it @returns {{event: string} | {why: string}} */
function eventOf(entry, before, later) {
  const at = entry.step + 1,
    { neurons, type, value } = entry,
    { connections, part } = entry,
    one = connections || part || '';
  if (SEVERAL.test(one)) return { why: `${type} ${one}: an event names all connections between the same ends` };
  switch (type) {
    case 'set':
      return { event: `{at: ${at}, set: {${plain(entry.name)}: ${entry.values[entry.name]}}}` };
    case 'weigh':
      return { event: `{at: ${at}, set: {${plain(connections)}: ${value}}}` };
    case 'feed':
      return { event: `{at: ${at}, feed: {${plain(entry.name)}: ${fed(entry)}}}` };
    case 'learn':
      return { event: `{at: ${at}, learning: {${plain(connections)}: ${entry.on}}}` };
    case 'hold': {
      const end = later.find((other) => other.neurons === neurons),
        to = end ? `to: ${end.step + 1}, ` : '';
      return { event: `{from: ${at}, ${to}clamp: {${plain(neurons)}: ${value}}}` };
    }
    case 'release':
      return before.filter((other) => other.neurons === neurons).pop()?.type === 'hold'
        ? { event: '' }
        : { why: `release ${neurons}: the clamp that ends says so itself (to: ${at})` };
    default:
      return { event: `{at: ${at}, ${type}: ${plain(part)}}` };
  }
}

/** The events that do what was turned; what no event does is told in comments. @param {Turned[]} turned @returns {string} */
export function eventsOf(turned) {
  const all = lastOf(turned),
    found = all.map((entry, place) => eventOf(entry, all.slice(0, place), all.slice(place + 1)));
  const events = found.flatMap((one) => ('event' in one && one.event ? [`  - ${one.event}\n`] : []));
  const left = found.flatMap((one, place) => ('why' in one ? [`# step ${all[place].step + 1}, ${one.why}\n`] : []));
  const drags = all.flatMap((entry) =>
    entry.since === undefined
      ? []
      : [
          `# step ${entry.since + 1} to ${entry.step + 1}: what ${nameOf(entry)} was while it was dragged is left out\n`,
        ],
  );
  return [...(events.length ? ['events:\n', ...events] : []), ...left, ...drags].join('');
}

/** What has a value that can be dragged. @param {Turned} entry @returns {string} */
const nameOf = ({ neurons, connections, name }) => neurons || connections || name;
