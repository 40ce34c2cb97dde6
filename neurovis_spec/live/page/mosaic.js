/**
 * The mosaic: the window as tiles; only tiles in which something lies otherwise are worked out anew, and only those in
 * which a colour has changed are blended anew.
 */

import { blend, Coverage, SIDE } from './coverage.js';

/** @typedef {import('./coverage.js').Chain} Chain */
/** @typedef {import('./coverage.js').Tile} Tile */

/** Something comes into tiles, whose things stay in order. @param {Tile[]} tiles @param {'lines' | 'discs'} kind
 * @param {number} at */
export function enter(tiles, kind, at) {
  for (const tile of tiles) {
    const list = tile[kind];
    let place = list.length;
    while (place && list[place - 1] > at) place--;
    if (place === list.length) list.push(at);
    else list.splice(place, 0, at);
  }
}

/** Something goes out of tiles. @param {Tile[]} tiles @param {'lines' | 'discs'} kind @param {number} at */
export function leave(tiles, kind, at) {
  for (const tile of tiles) tile[kind].splice(tile[kind].indexOf(at), 1);
}

/** Tiles that fill a window. */
export class Mosaic {
  /** @param {number[]} window in pixels @param {number} slots how many colours there are that change */
  constructor([width, height], slots) {
    this.image = new ImageData(width, height);
    this.out = new Uint32Array(this.image.data.buffer);
    this.columns = Math.ceil(width / SIDE);
    this.rows = Math.ceil(height / SIDE);
    this.coverage = new Coverage(slots, width, height);
    this.colours = new Float64Array(slots);
    this.changed = new Uint8Array(slots);
    const none = new Uint32Array(0);
    /** @type {Tile[]} */
    this.tiles = Array.from({ length: this.columns * this.rows }, (_, at) => ({
      left: SIDE * (at % this.columns),
      top: SIDE * Math.floor(at / this.columns),
      lines: [],
      discs: [],
      slots: none,
      where: none,
      ends: none,
      entries: none,
      base: new Float64Array(0),
    }));
    /** those that are to be worked out anew, the longest waiting first @type {Set<Tile>} */
    this.stale = new Set(this.tiles);
    this.stamps = new Uint32Array(this.tiles.length);
    this.stamp = 0;
  }

  /** Something else is in these tiles. @param {Tile[]} tiles */
  spoil(tiles) {
    for (const tile of tiles) this.stale.add(tile);
  }

  /** Two pictures of what stays: tiles in which they differ are stale. @param {Uint8ClampedArray | null} one
   * @param {Uint8ClampedArray | null} other */
  compare(one, other) {
    const [a, b] = [one, other].map((data) =>
      data && data.length === 4 * this.out.length ? new Uint32Array(data.buffer) : null,
    );
    if (!a || !b) {
      if (a || b) this.spoil(this.tiles);
      return;
    }
    const { width } = this.image;
    for (let at = 0; at < a.length; at++) {
      if (a[at] === b[at]) continue;
      const y = Math.floor(at / width),
        x = at - y * width,
        column = Math.floor(x / SIDE);
      this.stale.add(this.tiles[Math.floor(y / SIDE) * this.columns + column]);
      at += Math.min(width, (column + 1) * SIDE) - x - 1;
    }
  }

  /** A slot has a colour. @param {number} slot @param {number} colour packed */
  paint(slot, colour) {
    if (this.colours[slot] === colour) return;
    this.colours[slot] = colour;
    this.changed[slot] = 1;
  }

  /** The tiles that a box touches, which none of this stamp were yet.
   * @param {number} left @param {number} top @param {number} right @param {number} bottom @param {Tile[]} found */
  touched(left, top, right, bottom, found) {
    const last = Math.min(this.columns - 1, Math.floor(right / SIDE)),
      end = Math.min(this.rows - 1, Math.floor(bottom / SIDE));
    for (let row = Math.max(0, Math.floor(top / SIDE)); row <= end; row++) {
      for (let column = Math.max(0, Math.floor(left / SIDE)); column <= last; column++) {
        const at = row * this.columns + column;
        if (this.stamps[at] === this.stamp) continue;
        this.stamps[at] = this.stamp;
        found.push(this.tiles[at]);
      }
    }
  }

  /** The tiles around a point. @param {number} x @param {number} y @param {number} reach @returns {Tile[]} */
  around(x, y, reach) {
    /** @type {Tile[]} */
    const found = [];
    this.stamp++;
    this.touched(x - reach, y - reach, x + reach, y + reach, found);
    return found;
  }

  /** The tiles along a curve, and around where it ends. @param {Chain} chain @param {number} reach
   * @param {{x: number, y: number}[]} ends @param {number} room @returns {Tile[]} */
  beside({ at, parts }, reach, ends, room) {
    const [{ x, y }, ...others] = ends,
      found = this.around(x, y, room);
    for (const end of others) this.touched(end.x - room, end.y - room, end.x + room, end.y + room, found);
    for (let i = 0; i < 2 * parts; i += 2) {
      const [x0, y0, x1, y1] = [at[i], at[i + 1], at[i + 2], at[i + 3]],
        least = Math.min(y0, y1) - reach;
      const most = Math.min(Math.max(y0, y1) + reach, this.rows * SIDE),
        steep = Math.abs(y1 - y0) > 1 ? (x1 - x0) / (y1 - y0) : 0;
      for (let top = Math.max(0, Math.floor(least / SIDE) * SIDE); top <= most; top += SIDE) {
        let [from, to] = [x0, x1];
        if (steep) {
          // the part of it that lies in this row of tiles
          const [begin, end] = [top - reach, top + SIDE + reach].map((y) =>
            Math.max(Math.min(y, Math.max(y0, y1)), Math.min(y0, y1)),
          );
          [from, to] = [x0 + (begin - y0) * steep, x0 + (end - y0) * steep];
        }
        this.touched(Math.min(from, to) - reach, top, Math.max(from, to) + reach, top, found);
      }
    }
    return found;
  }

  /** Work out tiles, at least one, until a time; true where more are left.
   * @param {(coverage: Coverage, tile: Tile) => void} fill puts in all that is in a tile @param {number} until
   * @returns {boolean} */
  work(fill, until) {
    for (const tile of this.stale) {
      this.stale.delete(tile);
      this.coverage.begin(tile);
      fill(this.coverage, tile);
      this.coverage.end(tile, this.out);
      blend(tile, this.colours, this.out);
      if (performance.now() > until) break;
    }
    return this.stale.size > 0;
  }

  /** Blend the tiles in which a colour has changed. */
  blend() {
    for (const tile of this.tiles) {
      for (const slot of tile.slots) {
        if (this.changed[slot]) {
          blend(tile, this.colours, this.out);
          break;
        }
      }
    }
    this.changed.fill(0);
  }
}
