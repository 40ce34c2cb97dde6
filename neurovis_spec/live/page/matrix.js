/**
 * The matrix: the weights in place of the picture, a row for what a neuron sends, a column for what one takes in.
 */

import { palette } from './colours.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./draw.js').Context} Context */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {{row: number, column: number, lines: number[]}} Cell */

/** The side of a cell, the size of a name, the most neurons with a name each, how far names reach: in units. */
const CELL = 20,
  NAMED_CELL = 11,
  NAMES = 80,
  LONGEST = 130;
/** The least sides of cells, in pixels of a page, that have their sign written in them, and names. */
const SIGNED = 12,
  LEGIBLE = 8;
/** How much is seen of what recedes. */
const PALE = 0.12;

/** Draws the matrix of one scene. */
export class Matrix {
  /** @param {Scene} scene */
  constructor(scene) {
    this.scene = scene;
    this.palette = palette(scene.theme, scene.constants.levels);
    /** the row of each neuron @type {number[]} */
    const rows = [];
    /** the group of the neuron of each row @type {Group[]} */
    this.rows = [];
    this.groups = new Map(scene.groups.map((group) => [group.id, group]));
    scene.order.forEach((index, row) => {
      rows[index] = row;
      this.rows.push(/** @type {Group} */ (this.groups.get(`n${index}`)));
    });
    /** @type {Map<number, Cell>} */
    this.cells = new Map();
    scene.ends[0].forEach((source, line) => {
      const row = rows[source],
        column = rows[scene.ends[1][line]],
        place = row * this.rows.length + column;
      const known = this.cells.get(place);
      if (known) known.lines.push(line);
      else this.cells.set(place, { row, column, lines: [line] });
    });
    this.family = scene.constants.families.map((/** @type {string} */ name) => JSON.stringify(name)).join();
    const count = this.rows.length,
      letters = Math.max(...this.rows.map(({ data }) => data.neuron.length));
    this.each = count <= NAMES;
    this.font = this.each ? NAMED_CELL : 0.016 * count * CELL;
    this.margin = this.each ? Math.min(LONGEST, 20 + 0.7 * NAMED_CELL * letters) : 8 * this.font;
    this.size = [0, 1].map(() => this.margin + 2 * this.font + count * CELL);
    /** @type {Set<string>} */
    this.near = new Set();
    this.held = '';
  }

  /** Draw a look, all of it at once. @param {Context} context @param {Camera} camera @param {Look} look
   * @param {import('./picture.js').Held} [held] @returns {boolean} */
  draw(context, camera, look, held = this) {
    [this.near, this.held] = [held.near, held.held];
    const { theme, constants } = this.scene,
      { margin, font } = this,
      count = this.rows.length,
      [left, top] = camera.origin;
    const pixels = (CELL * camera.scale) / devicePixelRatio,
      gap = 0.5;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.globalAlpha = 1;
    context.fillStyle = theme.background;
    context.fillRect(0, 0, camera.window[0], camera.window[1]);
    context.setTransform(camera.scale, 0, 0, camera.scale, left, top);
    context.fillStyle = theme.box_fill;
    context.fillRect(margin, margin, count * CELL, count * CELL);
    context.textAlign = 'center';
    context.font = `600 ${0.7 * CELL}px ${this.family}`;
    for (const { row, column, lines } of this.cells.values()) {
      const x = margin + column * CELL,
        y = margin + row * CELL,
        level = this.level(lines, look);
      const isFaint = lines.every((line) => look.kinds[line] & constants.isFaint);
      const held = this.rows[row].id === this.held || this.rows[column].id === this.held;
      context.globalAlpha =
        (isFaint ? constants.faint : 1) * (held || !this.near.size ? 1 : this.share(lines.map((line) => `c${line}`)));
      context.fillStyle = this.palette.fills[level + constants.levels];
      context.fillRect(x + gap, y + gap, CELL - 2 * gap, CELL - 2 * gap);
      const glow = lines.some((line) => look.glows[line] > constants.fineness / 2);
      if (glow || lines.some((line) => `c${line}` === this.held)) {
        context.strokeStyle = glow ? theme.glow : theme.ink;
        context.lineWidth = 2;
        context.strokeRect(x + 1, y + 1, CELL - 2, CELL - 2);
      }
      if (pixels < SIGNED) continue;
      context.fillStyle = this.palette.texts[level + constants.levels];
      context.fillText(isFaint ? '×' : level < 0 ? '−' : level > 0 ? '+' : '0', x + CELL / 2, y + 0.75 * CELL);
    }
    context.textAlign = 'start';
    context.globalAlpha = 1;
    context.strokeStyle = theme.muted;
    context.lineWidth = 0.06 * font;
    context.beginPath();
    for (const [start] of this.scene.bands.slice(1)) {
      const at = margin + start * CELL,
        end = margin + count * CELL;
      context.moveTo(at, margin);
      context.lineTo(at, end);
      context.moveTo(margin, at);
      context.lineTo(end, at);
    }
    context.stroke();
    context.font = `${font}px ${this.family}`;
    context.fillStyle = theme.muted;
    context.fillText('rows send, columns take in', margin, margin + count * CELL + 1.5 * font);
    if (this.each) for (const [row, group] of this.rows.entries()) this.name(context, group, row, look, pixels);
    else for (const [start, name, size] of this.scene.bands) this.write(context, name, start + size / 2, 0.5 * font);
    return false;
  }

  /** The name of a row and a column, with the colour of the neuron. @param {Context} context @param {Group} group
   * @param {number} row @param {Look} look @param {number} pixels */
  name(context, { id, data }, row, look, pixels) {
    const { margin } = this,
      { theme, constants } = this.scene,
      at = margin + row * CELL,
      index = Number(id.slice(1));
    context.globalAlpha = this.share([id]);
    context.fillStyle = this.palette.fills.at(look.discs[index] + constants.levels) ?? '';
    context.fillRect(margin - 9, at + 1, 7, CELL - 2);
    context.fillRect(at + 1, margin - 9, CELL - 2, 7);
    if (id === this.held) {
      context.strokeStyle = theme.ink;
      context.lineWidth = 1.5;
      context.strokeRect(margin - 9, at + 1, 7, CELL - 2);
      context.strokeRect(at + 1, margin - 9, CELL - 2, 7);
    }
    if (pixels >= LEGIBLE) this.write(context, data.neuron, row + 0.5, 13);
    context.globalAlpha = 1;
  }

  /** Write a name before a row and above a column. @param {Context} context @param {string} name @param {number} row
   * @param {number} away */
  write(context, name, row, away) {
    const { margin, font } = this,
      at = margin + row * CELL + 0.36 * font,
      room = margin - away;
    let text = name;
    // names that begin alike are told apart by their ends
    while (text.length > 2 && context.measureText(text).width > room) text = `…${text.slice(2)}`;
    context.fillStyle = this.scene.theme.ink;
    context.fillText(text, margin - away - context.measureText(text).width, at);
    context.save();
    context.translate(at, margin - away);
    context.rotate(-Math.PI / 2);
    context.fillText(text, 0, 0);
    context.restore();
  }

  /** The colour of the weights of some lines together. @param {number[]} lines @param {Look} look @returns {number} */
  level(lines, look) {
    const { levels, isNegative, share, shares } = this.scene.constants;
    let sum = 0;
    for (const line of lines) {
      const size = Math.floor(look.kinds[line] / share);
      sum += look.kinds[line] & isNegative ? -size : size;
    }
    return Math.round(levels * Math.max(-1, Math.min(1, sum / shares)));
  }

  /** How much is seen of something. @param {string[]} ids @returns {number} */
  share(ids) {
    return !this.near.size || ids.some((id) => this.near.has(id)) ? 1 : PALE;
  }

  /** The connection under a pixel, or the neuron of its row or column; '' for nothing. @param {Camera} camera
   * @param {number} x @param {number} y @returns {string} */
  under(camera, x, y) {
    const count = this.rows.length;
    const [column, row] = camera.unit(x, y).map((unit) => Math.floor((unit - this.margin) / CELL));
    if (row >= count || column >= count || (row < 0 && column < 0)) return '';
    if (row >= 0 && column >= 0) {
      const cell = this.cells.get(row * count + column);
      const lines = (cell?.lines ?? []).map((line) => `c${line}`); // of several the one after what is held
      return lines[(lines.indexOf(this.held) + 1) % lines.length] ?? '';
    }
    return this.rows[Math.max(row, column)].id;
  }

  /** Where something is, in units. @param {string} id @returns {number[]} */
  at(id) {
    const { margin } = this,
      row = this.rows.findIndex((group) => group.id === id),
      line = Number(id.slice(1));
    if (row >= 0) return [margin, margin + (row + 0.5) * CELL];
    const cell = [...this.cells.values()].find(({ lines }) => lines.includes(line));
    return cell ? [margin + (cell.column + 0.5) * CELL, margin + (cell.row + 0.5) * CELL] : [0, 0];
  }
}
