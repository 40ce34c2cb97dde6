/**
 * Panels: their parts fold and stay folded, and each has a button that closes it; the line that greets who comes first.
 */

import { keep, recall } from './memory.js';

const GREETED = 'greeted';

/** Have the parts of panels fold as this viewer left them, and their buttons close them. */
export function arrangePanels() {
  const folds = /** @type {NodeListOf<HTMLDetailsElement>} */ (document.querySelectorAll('[data-fold]'));
  for (const fold of folds) {
    const name = `fold.${fold.dataset.fold}`,
      kept = recall(name);
    if (kept) fold.open = kept === 'open';
    fold.ontoggle = () => keep(name, fold.open ? 'open' : 'shut');
  }
  const shuts = /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll('[data-closes]'));
  for (const shut of shuts) {
    shut.onclick = () => document.getElementById(shut.dataset.closes ?? '')?.click();
  }
}

/** Say what to begin with, to who has not been here; it goes with the first that is done. Where nothing is kept it would
 * come each time, and so does not. @param {HTMLElement} hint */
export function greet(hint) {
  if (recall(GREETED) !== null) return;
  hint.hidden = false;
  const heard = ['pointerdown', 'click', 'keydown', 'wheel'],
    ended = new AbortController();
  for (const name of heard) {
    addEventListener(
      name,
      () => {
        hint.hidden = true;
        keep(GREETED, 'yes');
        ended.abort();
      },
      { capture: true, passive: true, signal: ended.signal },
    );
  }
}
