/**
 * Naming: a field in the place of what is to be called otherwise.
 */

/** Have a name typed; Enter, or leaving the field, is meant, Escape is not. What it stands in is not to be made anew meanwhile.
 * @param {HTMLElement} place @param {string} name what it is called by now @param {string} label
 * @param {(name: string | null) => void} done called with the new name, null where nothing is called otherwise */
export function retype(place, name, label, done) {
  const field = Object.assign(document.createElement('input'), { value: name, maxLength: 80, className: 'naming' });
  field.setAttribute('aria-label', label);
  let isOpen = true;
  const end = (/** @type {boolean} */ isMeant) => {
    if (!isOpen) return;
    isOpen = false;
    field.replaceWith(place);
    done(isMeant && field.value !== name ? field.value : null);
  };
  field.onkeydown = (event) => {
    if (event.key === 'Enter' || event.key === 'Escape') end(event.key === 'Enter');
    event.stopPropagation();
  };
  field.onblur = () => end(true);
  place.replaceWith(field);
  field.focus();
  field.select();
}

/** A button. @param {string} words @param {string} label @param {() => void} does @returns {HTMLButtonElement} */
export function button(words, label, does) {
  const made = document.createElement('button');
  made.textContent = words;
  if (label) made.setAttribute('aria-label', label);
  made.onclick = does;
  return made;
}
