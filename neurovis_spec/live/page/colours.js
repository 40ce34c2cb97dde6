/**
 * Colours: those of values in −1…1 between a theme's anchors, and text that can be read on them.
 */

/** @typedef {import('./protocol.js').Theme} Theme */

/** Red, green and blue of `#rrggbb`. @param {string} colour @returns {number[]} */
export function channels(colour) {
  return [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
}

/** A colour of which so much is left in another one. @param {string} colour @param {string} other @param {number} share
 * @returns {string} */
export function mixed(colour, other, share) {
  const [one, two] = [channels(colour), channels(other)],
    both = one.map((value, at) => Math.round(share * value + (1 - share) * two[at]));
  return `#${both.map((value) => value.toString(16).padStart(2, '0')).join('')}`;
}

/** Relative luminance (WCAG 2). @param {number[]} rgb @returns {number} */
export function luminance(rgb) {
  const [r, g, b] = rgb.map((v) => v / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

/** @param {number[]} one @param {number[]} other @returns {number} */
function contrast(one, other) {
  const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
}

/** The colours of all levels from −levels to levels and, the last, of what has none; and of text on a disc of each.
 * @param {Theme} theme @param {number} levels @returns {{fills: string[], texts: string[], channels: number[][]}} */
export function palette(theme, levels) {
  const [negative, zero, positive] = [theme.negative, theme.zero, theme.positive].map(channels);
  const fills = [],
    texts = [],
    all = [];
  for (let level = -levels; level <= levels + 1; level++) {
    const end = level < 0 ? negative : positive,
      share = Math.abs(level) / levels;
    const rgb =
      level > levels ? channels(theme.ink) : zero.map((from, at) => Math.round(from + (end[at] - from) * share));
    const light = contrast(channels(theme.light), rgb);
    all.push(rgb);
    fills.push(`rgb(${rgb.join(',')})`);
    texts.push(light >= 3.5 || light >= contrast(channels(theme.dark), rgb) ? theme.light : theme.dark);
  }
  return { fills, texts, channels: all };
}
