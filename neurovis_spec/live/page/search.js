/**
 * Searching: what is called so, the best first.
 */

/** @typedef {{id: string, name: string, more: string}} Entry something that has a name; `more` is what else is told of it */

/** How well a name fits, 0 best; Infinity: not at all. @param {Entry} entry @param {string} text @param {string[]} words
 * @returns {number} */
function fit({ name, more }, text, words) {
  const low = name.toLowerCase(),
    all = `${low}\n${more.toLowerCase()}`;
  if (!words.every((word) => all.includes(word))) return Infinity;
  if (low === text) return 0;
  if (low.startsWith(text)) return 1;
  if (low.split(/[^\p{L}\p{N}]+/u).some((part) => part.startsWith(text))) return 2;
  return low.includes(text) ? 3 : 4;
}

/** The entries that fit what is searched; of those that fit as well, in their order. @param {Entry[]} entries @param {string} text
 * @returns {Entry[]} */
export function search(entries, text) {
  const wanted = text.trim().toLowerCase().replaceAll('->', '→'),
    words = wanted.split(/\s+/);
  return entries
    .map((entry) => ({ entry, fits: fit(entry, wanted, words) }))
    .filter(({ fits }) => fits < Infinity)
    .sort((one, other) => one.fits - other.fits)
    .map(({ entry }) => entry);
}
