/**
 * Sliders: numbers within their bounds, each with a slider, a field and a description.
 */

/** @typedef {import('./protocol.js').Declared} Declared */
/** Of a number: what is declared; with `log`, its slider goes by factors; with `reach`, as far from 0 where there is no bound.
 * @typedef {Declared & {log?: boolean, reach?: number}} Row */
/** What is called when a number is given: with null it is as at the beginning; while it is dragged it is moving.
 * @typedef {(value: number | null, moving: boolean) => void} Given */

/** The least time between two numbers while a slider is dragged, in milliseconds. */
const BETWEEN = 50;

/** Where a slider goes: the bounds, and where there is none as far from the value as 0 is, or by 1.
 * @param {Row} entry @returns {number[]} */
function range({ value, low, high, reach: far }) {
  if (far !== undefined) return [low ?? -far, high ?? far];
  const reach = Math.abs(value) || 1,
    least = low === null ? Math.min(value - reach, (high ?? Infinity) - reach) : low;
  return [least, high === null ? Math.max(value + reach, least + reach) : high];
}

/** Do something with the number in a field; where it is none, or out of bounds, the browser says so in place of that.
 * @param {HTMLInputElement} field @param {(value: number) => void} then */
export function withNumber(field, then) {
  if (field.reportValidity()) then(field.valueAsNumber);
}

/** Rows of sliders; a double click on one, or Delete, resets. */
export class Sliders {
  /** @param {HTMLElement} place */
  constructor(place) {
    this.place = place;
    /** @type {Map<string, HTMLInputElement[]>} */
    this.inputs = new Map();
    /** the names of those that go by factors @type {Set<string>} */
    this.log = new Set();
    this.sent = 0;
    /** whether a key is pressed */
    this.pressed = false;
  }

  /** No rows. */
  clear() {
    this.inputs.clear();
    this.place.replaceChildren();
  }

  /** A row. @param {Row} entry @param {string} id @param {Given} given */
  add(entry, id, given) {
    const { name, value, description, log, unit } = entry,
      [min, max] = range(entry).map(log ? Math.log2 : Number);
    const slid = () => (log ? Number((2 ** Number(slider.value)).toPrecision(3)) : Number(slider.value));
    const row = document.createElement('div'),
      label = document.createElement('label'),
      about = document.createElement('small');
    const [slider, field] = ['range', 'number'].map((type) =>
      Object.assign(document.createElement('input'), { type, step: 'any' }),
    );
    row.className = 'slider';
    slider.id = id;
    [slider.min, slider.max, slider.title] = [String(min), String(max), 'a double click or Delete resets'];
    if (entry.low !== null) field.min = String(entry.low);
    if (entry.high !== null) field.max = String(entry.high);
    label.htmlFor = slider.id;
    label.textContent = label.title = name;
    if (unit) {
      const measure = document.createElement('span');
      measure.className = 'unit';
      measure.textContent = ` ${unit}`;
      label.append(measure);
    }
    about.textContent = description;
    field.setAttribute('aria-label', `${name}, as a number`);
    if (log) this.log.add(name);
    slider.oninput = () => {
      field.value = String(slid());
      if (performance.now() - this.sent < BETWEEN) return;
      this.sent = performance.now();
      given(slid(), true);
    };
    // several keys in a row are one way
    slider.onchange = () => given(slid(), this.pressed);
    slider.onkeyup = () => {
      this.pressed = false;
    };
    field.required = true;
    field.onchange = () => withNumber(field, (number) => given(number, false));
    slider.ondblclick = () => given(null, false);
    slider.onkeydown = (event) => {
      this.pressed = true;
      if (event.key === 'Delete') given(null, false);
    };
    row.append(label, slider, field, ...(description ? [about] : []));
    this.inputs.set(name, [slider, field]);
    this.place.append(row);
    this.show({ [name]: value });
  }

  /** Show what the numbers are now, but where one is being given. @param {Object<string, number>} values */
  show(values) {
    for (const [name, inputs] of this.inputs) {
      if (!(name in values) || inputs[0].matches(':active') || document.activeElement === inputs[1]) continue;
      const [slider, field] = inputs,
        value = values[name];
      [slider.value, field.value] = [String(this.log.has(name) ? Math.log2(value) : value), String(value)];
      slider.setAttribute('aria-valuetext', field.value);
    }
  }
}
