/**
 * Saying: what a screen reader is to read now. Nothing else in the page speaks by itself, so that a run can play in peace.
 */

/** Have a text read, even where it is the same as before. @param {string} text */
export function say(text) {
  const place = /** @type {HTMLElement} */ (document.getElementById('said'));
  place.textContent = '';
  // a text that is put back within the same task is no change to a screen reader
  setTimeout(() => {
    place.textContent = text;
  }, 50);
}
