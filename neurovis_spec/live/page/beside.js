/**
 * What a run has beside its neurons and connections and a strip can show: errors, inputs, sensors, and measures that somebody has
 * typed.
 */

import { signed } from './attention.js';

/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {{number: number, text: string}} Measured */

/** Whether an id is of something beside the network. @param {string} id @returns {boolean} */
export const isBeside = (id) => /^[eims]\d+$/.test(id);

/** How they are called that have an id. */
export class Beside {
  constructor() {
    /** by id @type {Map<string, Group>} */
    this.groups = new Map();
  }

  /** Another network. @param {Scene} scene */
  use(scene) {
    const { inputs, sensors } = scene.beside,
      errors = scene.curves.filter(({ items }) => items[0][0] === 'e'),
      measures = [...this.groups].filter(([id]) => id[0] === 'm');
    this.groups = new Map(measures);
    for (const { items, names } of errors) this.put(items[0], 'curve', names[0]);
    for (const [at, name] of inputs.entries()) this.put(`i${at}`, 'input', name);
    for (const [at, name] of sensors.entries()) this.put(`s${at}`, 'sensor', name);
  }

  /** There are these measures. @param {Measured[]} measures */
  measure(measures) {
    for (const id of [...this.groups.keys()].filter((one) => one[0] === 'm')) this.groups.delete(id);
    for (const { number, text } of measures) this.put(`m${number}`, 'measure', text);
  }

  /** @param {string} id @param {string} kind @param {string} name */
  put(id, kind, name) {
    this.groups.set(id, { id, title: name, data: { [kind]: name }, shapes: [] });
  }

  /** What kind of thing an id is, as it is called. @param {string} id @returns {string} */
  kind(id) {
    return Object.keys(this.groups.get(id)?.data ?? {})[0] ?? '';
  }

  /** What is said of one: its name, its kind and its value, a line each. @param {string} id @param {Object<string, number | null>} values
   * @returns {string} */
  words(id, values) {
    const told = id in values ? [signed(values[id])] : [];
    return [this.groups.get(id)?.title ?? '', this.kind(id), ...told].join('\n');
  }
}
