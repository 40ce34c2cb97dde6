/**
 * Coverage: how much of each pixel of a tile is covered by strokes, heads and discs, front to back, so that a pixel is a
 * weighted sum of colours: only these change from frame to frame.
 */

/** Pixels along the side of a tile. */
export const SIDE = 32;
/** The weights of a pixel add up to this; an entry is a slot, of which colours are known, and in its low bits a weight. */
const WHOLE = 256,
  LOW = 511,
  BITS = 9;
/** The least weight that is seen. */
const SEEN = 3;
const OPAQUE = 255 << 24,
  UP = 65536;

/** Red, green and blue in one number, so that a weighted sum is one sum. @param {number[]} rgb @returns {number} */
export function packed([red, green, blue]) {
  return red + (green + blue * UP) * UP;
}

/** The pixel of a weighted sum. @param {number} sum @returns {number} */
function pixelOf(sum) {
  const low = sum | 0,
    high = (sum / (UP * UP)) | 0;
  return OPAQUE | ((high & 0xff00) << 8) | ((low >>> 16) & 0xff00) | ((low >>> 8) & 0xff);
}

/** Half of each level, so that sums are rounded. */
const ROUND = packed([WHOLE / 2, WHOLE / 2, WHOLE / 2]);

/** How much of a pixel is covered by a band: `far` is its distance from the middle.
 * @param {number} far @param {number} half @returns {number} */
function band(far, half) {
  return Math.max(0, Math.min(far + 0.5, half) + Math.min(0.5 - far, half));
}

/** How much of a pixel is covered by what ends at a signed distance. @param {number} far @returns {number} */
function inside(far) {
  return Math.min(1, Math.max(0, 0.5 - far));
}

/** A curve in pixels, as straight parts: their ends, and the direction of the curve there.
 * @typedef {{at: Float64Array, along: Float64Array, parts: number}} Chain */

/** @param {number[]} points of a cubic spline @param {number} scale @param {number[]} origin @returns {Chain} */
export function flattened(points, scale, [left, top]) {
  const at = [points[0] * scale + left, points[1] * scale + top];
  for (let i = 2; i + 5 < points.length; i += 6) {
    const ax = points[i - 2] * scale + left,
      ay = points[i - 1] * scale + top,
      bx = points[i] * scale + left;
    const by = points[i + 1] * scale + top,
      cx = points[i + 2] * scale + left,
      cy = points[i + 3] * scale + top;
    const dx = points[i + 4] * scale + left,
      dy = points[i + 5] * scale + top;
    const bend = Math.max(
      Math.hypot(ax - 2 * bx + cx, ay - 2 * by + cy),
      Math.hypot(bx - 2 * cx + dx, by - 2 * cy + dy),
    );
    const count = Math.max(1, Math.ceil(Math.sqrt(7.5 * bend)));
    for (let k = 1; k <= count; k++) {
      const t = k / count,
        s = 1 - t,
        p = s * s * s,
        q = 3 * s * s * t,
        u = 3 * s * t * t,
        v = t * t * t;
      const x = p * ax + q * bx + u * cx + v * dx,
        y = p * ay + q * by + u * cy + v * dy,
        last = at.length - 2;
      if (Math.abs(x - at[last]) + Math.abs(y - at[last + 1]) > 1e-3) at.push(x, y);
    }
  }
  // at a joint between the directions of both parts, so that each pixel belongs to one of them
  const along = new Float64Array(at.length),
    last = at.length - 2;
  for (let i = 0; i < last; i += 2) {
    const dx = at[i + 2] - at[i],
      dy = at[i + 3] - at[i + 1],
      length = Math.sqrt(dx * dx + dy * dy);
    along[i] += dx / length;
    along[i + 1] += dy / length;
    along[i + 2] = dx / length;
    along[i + 3] = dy / length;
  }
  return { at: Float64Array.from(at), along, parts: last / 2 };
}

/** The dashes of a chain, of these lengths and gaps in pixels, each a chain with flat ends.
 * @param {Chain} chain @param {number[]} lengths @returns {Chain[]} */
export function dashes({ at, along, parts }, lengths) {
  /** @type {Chain[]} */
  const found = [];
  let place = 0,
    left = lengths[0];
  /** @type {number[]} */
  let points = [at[0], at[1]],
    ways = [along[0], along[1]];
  const end = () => {
    if (place % 2 === 0 && points.length > 2)
      found.push({ at: Float64Array.from(points), along: Float64Array.from(ways), parts: points.length / 2 - 1 });
  };
  for (let i = 0; i < 2 * parts; i += 2) {
    const dx = at[i + 2] - at[i],
      dy = at[i + 3] - at[i + 1],
      length = Math.sqrt(dx * dx + dy * dy),
      way = [dx / length, dy / length];
    let done = 0;
    while (length - done > left) {
      done += left;
      const x = at[i] + done * way[0],
        y = at[i + 1] + done * way[1];
      points.push(x, y);
      ways.push(...way);
      end();
      place += 1;
      left = lengths[place % lengths.length];
      points = [x, y];
      ways = [...way];
    }
    left -= length - done;
    points.push(at[i + 2], at[i + 3]);
    ways.push(along[i + 2], along[i + 3]);
  }
  end();
  return found;
}

/** A part of the window: which pixels have colours that change, where each one's entries end, the sum of what stays.
 * @typedef {{left: number, top: number, lines: number[], discs: number[], slots: Uint32Array,
 *   where: Uint32Array, ends: Uint32Array, entries: Uint32Array, base: Float64Array}} Tile */

/** Works out the entries of tiles, one after the other: everything is put in from front to back. */
export class Coverage {
  /** @param {number} slots @param {number} width of the window @param {number} height */
  constructor(slots, width, height) {
    this.width = width;
    this.height = height;
    /** of each pixel: the weight that is left for what lies further back, the sum of what stays, the latest entry */
    this.room = new Int16Array(SIDE * SIDE);
    this.base = new Float64Array(SIDE * SIDE);
    this.first = new Int32Array(SIDE * SIDE);
    this.entries = new Uint32Array(1 << 14);
    this.next = new Int32Array(1 << 14);
    this.stamps = new Uint32Array(slots);
    this.stamp = 0;
    /** @type {number[]} */
    this.slots = [];
    this.count = this.open = this.left = this.top = this.across = this.down = 0;
  }

  /** Begin a tile. @param {Tile} tile */
  begin({ left, top }) {
    this.left = left;
    this.top = top;
    this.across = Math.min(SIDE, this.width - left);
    this.down = Math.min(SIDE, this.height - top);
    this.room.fill(WHOLE);
    this.base.fill(ROUND);
    this.first.fill(-1);
    this.count = 0;
    this.slots = [];
    this.stamp++;
    this.open = this.across * this.down;
  }

  /** The weight of what covers a part of a pixel: none where nobody would see it, and all that is left where nobody would
   * see what lies further back. @param {number} pixel @param {number} share @returns {number} */
  take(pixel, share) {
    const room = this.room[pixel],
      weight = (room * share + 0.5) | 0;
    if (weight < SEEN) return 0;
    if (room - weight >= SEEN) {
      this.room[pixel] = room - weight;
      return weight;
    }
    this.room[pixel] = 0;
    this.open--;
    return room;
  }

  /** What changes covers a part of a pixel. @param {number} pixel @param {number} share @param {number} slot */
  put(pixel, share, slot) {
    const weight = this.take(pixel, share);
    if (!weight) return;
    if (this.count === this.entries.length) this.grow();
    if (this.stamps[slot] !== this.stamp) {
      this.stamps[slot] = this.stamp;
      this.slots.push(slot);
    }
    this.entries[this.count] = (slot << BITS) | weight;
    this.next[this.count] = this.first[pixel];
    this.first[pixel] = this.count++;
  }

  /** What stays covers a part of a pixel. @param {number} pixel @param {number} share @param {number} colour packed */
  fix(pixel, share, colour) {
    this.base[pixel] += this.take(pixel, share) * colour;
  }

  /** Make room for more entries. */
  grow() {
    const [entries, next] = [this.entries, this.next];
    this.entries = new Uint32Array(2 * entries.length);
    this.next = new Int32Array(2 * next.length);
    this.entries.set(entries);
    this.next.set(next);
  }

  /** A picture of the window that stays. @param {Uint8ClampedArray | null} picture */
  picture(picture) {
    if (!picture) return;
    for (let y = 0; y < this.down; y++) {
      let from = 4 * ((this.top + y) * this.width + this.left);
      for (let x = 0; x < this.across; x++, from += 4) {
        const alpha = picture[from + 3];
        if (alpha) {
          const colour = picture[from] + (picture[from + 1] + picture[from + 2] * UP) * UP;
          this.fix(y * SIDE + x, alpha / 255, colour);
        }
      }
    }
  }

  /** A line with its glow, if that is wider than 0. @param {Chain} chain @param {number} half of its width, in pixels
   * @param {number} glow half of its glow's @param {number} share @param {number} slot @param {number} colour of the glow */
  line({ at, along, parts }, half, glow, share, slot, colour) {
    const reach = Math.max(half, glow) + 0.5,
      { left, top, room } = this;
    for (let part = 0; part < parts; part++) {
      const i = 2 * part,
        x0 = at[i] - left,
        y0 = at[i + 1] - top,
        x1 = at[i + 2] - left,
        y1 = at[i + 3] - top;
      const low = Math.max(0, Math.ceil(Math.min(y0, y1) - reach - 0.5));
      const high = Math.min(this.down - 1, Math.floor(Math.max(y0, y1) + reach - 0.5));
      const least = Math.max(0, Math.ceil(Math.min(x0, x1) - reach - 0.5));
      const most = Math.min(this.across - 1, Math.floor(Math.max(x0, x1) + reach - 0.5));
      if (low > high || least > most) continue;
      const dx = x1 - x0,
        dy = y1 - y0,
        length = Math.sqrt(dx * dx + dy * dy),
        nx = -dy / length,
        ny = dx / length;
      const fromX = along[i],
        fromY = along[i + 1],
        toX = along[i + 2],
        toY = along[i + 3];
      const begins = part === 0,
        ends = part === parts - 1,
        steep = Math.abs(nx) > 1e-3;
      for (let y = low; y <= high; y++) {
        const down = y + 0.5 - y0,
          past = y + 0.5 - y1;
        let from = least,
          to = most;
        if (steep) {
          const middle = x0 - (down * ny) / nx - 0.5,
            beside = reach / Math.abs(nx);
          from = Math.max(from, Math.ceil(middle - beside));
          to = Math.min(to, Math.floor(middle + beside));
        }
        for (let x = from; x <= to; x++) {
          const pixel = y * SIDE + x;
          if (!room[pixel]) continue;
          const over = x + 0.5 - x0,
            since = over * fromX + down * fromY,
            until = (x + 0.5 - x1) * toX + past * toY;
          let seen = share;
          if (since < 0) {
            if (!begins || since <= -0.5) continue;
            seen *= since + 0.5;
          } else if (begins && since < 0.5) {
            seen *= since + 0.5;
          }
          if (until >= 0) {
            if (!ends || until >= 0.5) continue;
            seen *= 0.5 - until;
          } else if (ends && until > -0.5) {
            seen *= 0.5 - until;
          }
          const far = Math.abs(over * nx + down * ny);
          if (far < half + 0.5) this.put(pixel, seen * band(far, half), slot);
          if (glow > 0) this.fix(pixel, seen * band(far, glow), colour);
        }
      }
    }
  }

  /** What is within reach of a point: `shape` is given the pixel and where it lies from there.
   * @param {number} x @param {number} y @param {number} reach
   * @param {(pixel: number, x: number, y: number) => void} shape */
  near(x, y, reach, shape) {
    const across = x - this.left - 0.5,
      down = y - this.top - 0.5;
    const high = Math.min(this.down - 1, Math.floor(down + reach)),
      most = Math.min(this.across - 1, Math.floor(across + reach));
    for (let row = Math.max(0, Math.ceil(down - reach)); row <= high; row++) {
      for (let column = Math.max(0, Math.ceil(across - reach)); column <= most; column++) {
        const pixel = row * SIDE + column;
        if (this.room[pixel]) shape(pixel, column - across, row - down);
      }
    }
  }

  /** The end of a line: an arrowhead with a notch, or a bar, which is as narrow as the line where there is no end. @param {End} end @param {number} share @param {number} slot */
  head({ x, y, dx, dy, length, half, notch, back, lap, stem, bar, room }, share, slot) {
    if (x + room < this.left || y + room < this.top || x - room > this.left + SIDE || y - room > this.top + SIDE)
      return;
    const flank = Math.hypot(half, length),
      inner = Math.hypot(half, length + notch);
    this.near(x, y, room, (pixel, right, down) => {
      const along = right * dx + down * dy,
        beside = Math.abs(down * dx - right * dy);
      const far = bar
        ? Math.max(along, Math.min(Math.max(back - along, beside - half), Math.max(lap - along, beside - stem)))
        : Math.max(
            (along * half + beside * length) / flank,
            ((notch - along) * half - beside * (length + notch)) / inner,
          );
      if (far < 0.5) this.put(pixel, share * inside(far), slot);
    });
  }

  /** A disc, its ring and what is written on it. @param {Round} round @param {number} slot
   * @param {Uint8ClampedArray | null} words what is written on discs, as a picture @param {number} ink its slot */
  disc({ x, y, radius, ring, colour, share }, slot, words, ink) {
    this.near(x, y, radius + ring + 1, (pixel, right, down) => {
      const far = Math.sqrt(right * right + down * down) - radius;
      if (words) {
        const row = this.top + ((pixel / SIDE) | 0),
          alpha = words[4 * (row * this.width + this.left + (pixel % SIDE)) + 3];
        if (alpha && far < 0) this.put(pixel, (share * alpha) / 255, ink);
      }
      if (ring) this.fix(pixel, share * band(Math.abs(far), ring), colour);
      if (far < 0.5) this.put(pixel, share * inside(far), slot);
    });
  }

  /** End a tile: keep its entries, and show the pixels that stay. @param {Tile} tile @param {Uint32Array} out */
  end(tile, out) {
    let count = 0,
      used = 0;
    const { first, next, base, entries, across, down } = this;
    for (let y = 0; y < down; y++) for (let x = 0; x < across; x++) if (first[y * SIDE + x] >= 0) count++;
    tile.where = new Uint32Array(count);
    tile.ends = new Uint32Array(count);
    tile.base = new Float64Array(count);
    tile.entries = new Uint32Array(this.count);
    tile.slots = Uint32Array.from(this.slots);
    count = 0;
    for (let y = 0; y < down; y++) {
      for (let x = 0; x < across; x++) {
        const pixel = y * SIDE + x,
          where = (this.top + y) * this.width + this.left + x;
        let entry = first[pixel];
        if (entry < 0) {
          out[where] = pixelOf(base[pixel]);
          continue;
        }
        for (; entry >= 0; entry = next[entry]) tile.entries[used++] = entries[entry];
        tile.where[count] = where;
        tile.base[count] = base[pixel];
        tile.ends[count++] = used;
      }
    }
  }
}

/** Where a line ends, in pixels, its direction there, lengths from its tip, and how far it reaches.
 * @typedef {{x: number, y: number, dx: number, dy: number, length: number, half: number, notch: number, back: number,
 *   lap: number, stem: number, bar: boolean, room: number}} End */
/** A disc in pixels; `ring` is half of the width of its ring, which has a colour.
 * @typedef {{x: number, y: number, radius: number, ring: number, colour: number, share: number}} Round */

/** Show a tile: the sums of its colours. @param {Tile} tile @param {Float64Array} colours of slots, packed
 * @param {Uint32Array} out the pixels of the window */
export function blend({ where, ends, entries, base }, colours, out) {
  for (let i = 0, at = 0; i < where.length; i++) {
    let sum = base[i];
    for (const end = ends[i]; at < end; at++) {
      const entry = entries[at];
      sum += (entry & LOW) * colours[entry >>> BITS];
    }
    out[where[i]] = pixelOf(sum);
  }
}
