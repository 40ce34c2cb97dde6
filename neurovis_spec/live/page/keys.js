/**
 * Keys: what each does, and the list of them, with what the pointer and fingers do.
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
    if ((key === ' ' || key === 'Enter') && at.closest('button, summary, a')) return;
    if (at.closest('dialog') && key !== '?') return;
    const known = keys[event.shiftKey && key.startsWith('Arrow') ? `shift+${CALLED[key]}` : key];
    if (known) {
      known[1]();
      event.preventDefault();
    }
  });
}

/** What belongs together: its keys, and what is done with the pointer or with fingers. What is in no group comes last.
 * @type {[string, string[], [string, string][]][]} */
const GROUPS = [
  [
    'transport',
    [' ', 'ArrowRight', 'ArrowLeft', 'Home', 'e', 'E', 'b', 'L', '<', '>'],
    [
      ['drag the timeline', 'go to a step'],
      ['wheel over the timeline', 'show more of the past, or less'],
      ['press a curve', 'go to the step there'],
    ],
  ],
  [
    'looking',
    ['+', '-', '0', 'h', 'j', 'k', 'l', 'v'],
    [
      ['wheel, pinch', 'come closer, go further away'],
      ['drag, two fingers', 'move the picture'],
      ['point', 'read name and value'],
      ['click a closed box', 'go there'],
    ],
  ],
  [
    'holding',
    [']', '[', 'Escape', 'p', 'c', '/', 'o'],
    [
      ['click, tap', 'hold a neuron or a connection'],
      ['click beside', 'let go'],
    ],
  ],
  ['views', ['m', 'g', 'y', 'i', 'Enter', 'f'], []],
  [
    'changing',
    ['t', 'shift+←', 'shift+→', 'shift+↑', 'shift+↓', 'z', 'ctrl+z', 'ctrl+shift+z'],
    [
      ['drag a neuron', 'put it elsewhere (with a finger: hold it first)'],
      ['shift and drag up, down', 'clamp a neuron to a value'],
      ['double click a slider', 'reset it (or Delete)'],
    ],
  ],
];

/** A row of a list. @param {string} tag @param {string} name @param {string} words @returns {HTMLElement[]} */
function row(tag, name, words) {
  const [term, shown, what] = ['dt', tag, 'dd'].map((one) => document.createElement(one));
  shown.textContent = name;
  what.textContent = words;
  term.append(shown);
  return [term, what];
}

/** Show the list of keys and gestures, or close it. @param {HTMLDialogElement} dialog @param {Keys} keys */
export function listKeys(dialog, keys) {
  if (dialog.open) {
    dialog.close();
    return;
  }
  const grouped = GROUPS.flatMap(([, some]) => some),
    rest = Object.keys(keys).filter((key) => !grouped.includes(key));
  const isTouched = matchMedia('(pointer: coarse)').matches;
  /** @type {typeof GROUPS} */
  const all = [...GROUPS, ['more', rest, []]];
  const list = /** @type {HTMLElement} */ (dialog.querySelector('#keylist'));
  list.replaceChildren(
    ...all.flatMap(([group, some, gestures]) => {
      const pressed = some.filter((key) => key in keys).flatMap((key) => row('kbd', CALLED[key] || key, keys[key][0])),
        done = gestures.flatMap(([name, words]) => row('span', name, words)),
        rows = isTouched ? [...done, ...pressed] : [...pressed, ...done];
      if (!rows.length) return [];
      const [section, heading, terms] = ['section', 'h3', 'dl'].map((tag) => document.createElement(tag));
      heading.textContent = group;
      terms.append(...rows);
      section.append(heading, terms);
      return [section];
    }),
  );
  dialog.showModal();
}
