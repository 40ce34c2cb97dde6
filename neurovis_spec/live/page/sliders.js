/**
 * Sliders: the parameters that a spec declares, within their bounds.
 */

/** @typedef {import('./protocol.js').Declared} Declared */
/** @typedef {import('./protocol.js').Link} Link */

/** The least time between two settings while a slider is dragged, in milliseconds. */
const BETWEEN = 50;

/** Where a slider goes: the bounds, and where there is none as far from the value as 0 is, or by 1.
 * @param {Declared} entry @returns {number[]} */
function range({ value, low, high }) {
  const reach = Math.abs(value) || 1, least = low === null ? Math.min(value - reach, (high ?? Infinity) - reach) : low;
  return [least, high === null ? Math.max(value + reach, least + reach) : high];
}

/** A slider and a field for each parameter; a double click on the slider resets. */
export class Sliders {
  /** @param {Link} link @param {HTMLElement} place */
  constructor(link, place) {
    this.link = link;
    this.place = place;
    /** @type {Map<string, HTMLInputElement[]>} */
    this.inputs = new Map();
    this.sent = 0;
  }

  /** Another network. @param {Declared[]} declared */
  use(declared) {
    this.inputs.clear();
    this.place.replaceChildren(...declared.map((entry) => this.row(entry)));
  }

  /** @param {Declared} entry @returns {HTMLElement} */
  row(entry) {
    const { name, value, description } = entry, [min, max] = range(entry);
    const row = document.createElement('div'), label = document.createElement('label'), about = document.createElement('small');
    const [slider, field] = ['range', 'number'].map((type) => Object.assign(document.createElement('input'), { type, step: 'any' }));
    row.className = 'slider';
    slider.id = `slider-${name}`;
    [slider.min, slider.max, slider.title] = [String(min), String(max), 'a double click resets'];
    if (entry.low !== null) field.min = String(entry.low);
    if (entry.high !== null) field.max = String(entry.high);
    label.htmlFor = slider.id;
    label.textContent = name;
    about.textContent = description;
    field.setAttribute('aria-label', `${name}, as a number`);
    slider.value = field.value = String(value);
    slider.oninput = () => {
      field.value = slider.value;
      if (performance.now() - this.sent > BETWEEN) this.set(name, slider.value);
    };
    slider.onchange = () => this.set(name, slider.value);
    field.onchange = () => { if (field.value && field.checkValidity()) this.set(name, field.value); };
    slider.ondblclick = () => this.set(name, String(value));
    row.append(label, document.createElement('span'), slider, field, ...(description ? [about] : []));
    this.inputs.set(name, [slider, field]);
    return row;
  }

  /** @param {string} name @param {string} value */
  set(name, value) {
    this.sent = performance.now();
    this.link.ask('set', { values: { [name]: Number(value) } });
  }

  /** Show what the parameters are now, but where one is being set. @param {Object<string, number>} values */
  show(values) {
    for (const [name, inputs] of this.inputs) {
      if (!(name in values) || inputs[0].matches(':active') || document.activeElement === inputs[1]) continue;
      for (const input of inputs) input.value = String(values[name]);
    }
  }
}
