/**
 * Memory: what a viewer has chosen, kept in the browser from one time to the next, where it may be.
 */

const PREFIX = 'neurovis.';

/** What is kept by a name: null where nothing is, undefined where nothing can be. @param {string} name
 * @returns {string | null | undefined} */
export function recall(name) {
  try {
    return localStorage.getItem(PREFIX + name);
  } catch {
    // the frame of a notebook has no storage, and browsers can be told to keep nothing
    return undefined;
  }
}

/** Keep something by a name. @param {string} name @param {string} value */
export function keep(name, value) {
  try {
    localStorage.setItem(PREFIX + name, value);
  } catch {
    // then the next time is as the first
  }
}
