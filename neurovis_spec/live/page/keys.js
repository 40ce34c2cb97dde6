/**
 * Keys: what each does, and the list of them.
 */

/** What a key does, in words, and what does it.
 * @typedef {Object<string, [string, () => void]>} Keys */

/** How keys are called that are not called by what they write. @type {Object<string, string>} */
const CALLED = { ' ': 'space', ArrowRight: '→', ArrowLeft: '←', '-': '−' };

/** Show the list of keys, or close it. @param {HTMLDialogElement} dialog @param {Keys} keys */
export function listKeys(dialog, keys) {
  if (dialog.open) {
    dialog.close();
    return;
  }
  const list = /** @type {HTMLElement} */ (dialog.querySelector('dl'));
  list.replaceChildren(...Object.entries(keys).flatMap(([key, [words]]) => {
    const [name, what] = ['dt', 'dd'].map((tag) => document.createElement(tag));
    name.textContent = CALLED[key] || key;
    what.textContent = words;
    return [name, what];
  }));
  dialog.showModal();
}
