/**
 * Ticks: how far apart they are on an axis, and what stands at them.
 */

/** The smallest of 1, 2 and 5 times a power of ten that is no less. @param {number} least @returns {number} */
export function roundAbove(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return /** @type {number} */ ([1, 2, 5, 10].find((times) => times * power >= least * (1 - 1e-9)) ?? 10) * power;
}

/** A number with as many decimals as multiples of `step` have. @param {number} value @param {number} step
 * @returns {string} */
export function written(value, step) {
  const words = value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  return Number(words) === 0 ? words.replace('-', '') : words.replace('-', '−');
}
