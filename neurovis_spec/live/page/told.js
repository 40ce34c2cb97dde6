/**
 * Told: a turn in words.
 */

/** @typedef {import('./protocol.js').Turned} Turned */

/** A turn in words. @param {Turned} turn @returns {string} */
export function told(turn) {
  const pairs = (/** @type {object} */ values) =>
    Object.entries(values)
      .map(([name, value]) => `${name} = ${value}`)
      .join(', ');
  const fed = Object.values(turn.values ?? {});
  switch (turn.type) {
    case 'set':
      return pairs(turn.values);
    case 'hold':
      return `clamp ${turn.neurons} = ${turn.value}`;
    case 'feed':
      return fed.length ? `feed ${turn.name} = ${fed.join(', ')}` : `feed ${turn.name} no more`;
    case 'weigh':
      return `weight of ${turn.connections} = ${turn.value}`;
    case 'learn':
      return `learning of ${turn.connections} ${turn.on ? 'on' : 'off'}`;
    default:
      return `${turn.type} ${turn.neurons || turn.part}`;
  }
}
