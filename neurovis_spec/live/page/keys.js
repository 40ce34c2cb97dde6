/**
 * Keys: what each does, and the list of them.
 */

/** What a key does, in words, and what does it.
 * @typedef {Object<string, [string, () => void]>} Keys */

/** How keys are called that are not called by what they write. @type {Object<string, string>} */
const CALLED = {
  ' ': 'space',
  ArrowRight: '→',
  ArrowLeft: '←',
  ArrowUp: '↑',
  ArrowDown: '↓',
  '-': '−',
};
/** The keys that a slider takes for itself. */
const SLIDES = /^(Arrow|Home|End|Page)/;

/** Do what keys do, but where they write, choose or press something. @param {Keys} keys */
export function followKeys(keys) {
  addEventListener('keydown', (event) => {
    const at = /** @type {Element} */ (event.target),
      { key } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    if (at.matches('input[type=range]') ? SLIDES.test(key) : at.closest('input, select, textarea')) return;
    if (key === ' ' && at.closest('button, summary')) return;
    if (at.closest('dialog') && key !== '?') return;
    const known = keys[event.shiftKey && key.startsWith('Arrow') ? `shift+${CALLED[key]}` : key];
    if (known) {
      known[1]();
      event.preventDefault();
    }
  });
}

/** Show the list of keys, or close it. @param {HTMLDialogElement} dialog @param {Keys} keys */
export function listKeys(dialog, keys) {
  if (dialog.open) {
    dialog.close();
    return;
  }
  const list = /** @type {HTMLElement} */ (dialog.querySelector('dl'));
  list.replaceChildren(
    ...Object.entries(keys).flatMap(([key, [words]]) => {
      const [name, what] = ['dt', 'dd'].map((tag) => document.createElement(tag));
      name.textContent = CALLED[key] || key;
      what.textContent = words;
      return [name, what];
    }),
  );
  dialog.showModal();
}
