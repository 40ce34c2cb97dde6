/**
 * Drawing: a scene and a look on a canvas, the same picture as the renderers make.
 */

import { Bands } from './bands.js';
import { channels, palette } from './colours.js';
import { dashes, flattened, packed } from './coverage.js';
import { enter, leave, Mosaic } from './mosaic.js';

/** @typedef {import('./bands.js').Band} Band */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Shape} Shape */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {CanvasRenderingContext2D} Context */
/** @typedef {import('./coverage.js').Coverage} Coverage */
/** @typedef {import('./coverage.js').Chain} Chain */
/** @typedef {import('./coverage.js').Tile} Tile */
/** @typedef {import('./coverage.js').Round} Round */
/** @typedef {import('./coverage.js').End} End */
/** A line as it was laid out: from these points, as this chain, which is drawn whole or as dashes, in these tiles, which have room for this reach.
 * @typedef {{points: number[], head: Shape, end: End, start: End | null, box: number[], chain: Chain, strokes: Chain[], tiles: Tile[], reach: number, room: number,
 *   width: number, glow: number, ending: number, share: number}} LaidLine */
/** What lies otherwise when another `points`, `head` or `at` is put in place of the one before.
 * @typedef {{id: string, index: number, points: number[], dash: number[], head: Shape, tail: Shape | null, rest: Shape[],
 *   band: Band | null, laid: LaidLine | null}} Line */
/** @typedef {{id: string, index: number, shape: Shape, rest: Shape[], laid: (Round & {tiles: Tile[]}) | null}} Disc */

/** What a line is drawn of: its points, its head, one at its other end if it leads both ways, and what lies on it.
 * @param {Shape[]} shapes
 * @returns {{points: number[], dash: number[], head: Shape, tail: Shape | null, rest: Shape[]}} */
function parts([{ points, dash }, head, ...rest]) {
  const tail = rest[0]?.kind === 'head' ? rest[0] : null;
  return { points, dash, head: { ...head }, tail, rest: tail ? rest.slice(1) : rest };
}

/** The path of a cubic spline. @param {number[]} points @returns {Path2D} */
function spline(points) {
  const path = new Path2D();
  path.moveTo(points[0], points[1]);
  for (let i = 2; i + 5 < points.length; i += 6) {
    path.bezierCurveTo(points[i], points[i + 1], points[i + 2], points[i + 3], points[i + 4], points[i + 5]);
  }
  return path;
}

/** The box around the points of a line: least x and y, largest x and y. @param {number[]} points @returns {number[]} */
function around(points) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  points.forEach((value, at) => {
    box[at % 2] = Math.min(box[at % 2], value);
    box[2 + (at % 2)] = Math.max(box[2 + (at % 2)], value);
  });
  return box;
}

/** A colour as one number. @param {string} colour as #rrggbb @returns {number} */
const whole = (colour) => packed(channels(colour));

/** Where a camera is. @param {Camera} camera @returns {string} */
const layoutOf = (camera) => [...camera.window, camera.scale, ...camera.origin].join(' ');

/** How much is seen of what recedes, where something is held. */
const RECEDING = 0.12;
/** Milliseconds of a frame in which tiles are worked out; a picture that takes longer is shown as it was, moved, while
 * the camera moves, for so many times as long. */
const BUDGET = 10,
  SLOW = 30,
  PATIENCE = 3;
/** How much further than it needs a line is looked for, in pixels, so that it may become wider. */
const SPARE = 2;

/** Draws one scene. */
export class Drawing {
  /** @param {Scene} scene */
  constructor(scene) {
    this.scene = scene;
    this.constants = scene.constants;
    this.palette = palette(scene.theme, this.constants.levels);
    this.family = this.constants.families.map((/** @type {string} */ name) =>
      name === 'sans-serif' ? name : `"${name}"`,
    );
    /** @type {Group[]} */
    this.back = [];
    /** what lies between lines and discs @type {Group[]} */
    this.between = [];
    this.bands = new Bands(scene);
    /** whether lines have begun, and bands behind them are no more */
    this.isBegun = false;
    /** @type {Group[]} */
    this.front = [];
    /** @type {Line[]} */
    this.lines = [];
    /** @type {Disc[]} */
    this.discs = [];
    /** @type {Shape | null} */
    this.caption = null;
    for (const group of scene.groups) this.sort(group);
    this.colours = { glow: whole(scene.theme.glow), light: whole(scene.theme.light), dark: whole(scene.theme.dark) };
    this.fills = this.palette.channels.map(packed);
    this.inks = this.palette.texts.map(whole);
    /** pictures of what stays: behind everything, between lines and discs, on discs, before everything
     * @type {Object<string, Uint8ClampedArray | null>} */
    this.pictures = { back: null, between: null, words: null, front: null };
    /** @type {Mosaic | null} */
    this.mosaic = null;
    /** the ids of what stands out; where there are none, all does @type {Set<string>} */
    this.near = new Set();
    this.held = '';
    /** where the camera was when this was laid out, and when it was last asked for */
    this.layout = this.asked = '';
    /** what pictures were drawn for */
    this.dressed = '';
    /** when it was laid out, and how long that took */
    this.since = this.cost = 0;
    /** the latest picture, while the camera moves @type {HTMLCanvasElement | null} */
    this.shot = null;
    this.seen = { scale: 1, origin: [0, 0] };
    /** how often discs were moved by hand */
    this.moves = 0;
  }

  /** Put a group where it belongs. @param {Group} group */
  sort(group) {
    const { id, shapes, data } = group;
    if (data.neuron !== undefined) {
      this.discs.push({ id, index: Number(id.slice(1)), shape: shapes[0], rest: shapes.slice(1), laid: null });
    } else if (data.connection !== undefined) {
      this.isBegun = true;
      this.lines.push({ id, index: Number(id.slice(1)), ...parts(shapes), band: null, laid: null });
    } else if (/^(bundle|joined):/.test(id)) {
      for (const { band, shapes: own } of this.bands.of(group)) {
        const { single } = band;
        this.lines.push({ id: single < 0 ? id : `c${single}`, index: single, ...parts(own), band, laid: null });
      }
    } else if (id === 'caption') {
      this.caption = shapes[0];
    } else {
      const { front, between, back } = this;
      (this.discs.length ? front : this.isBegun ? between : back).push(group);
    }
  }

  /** Take over that the shapes of a group have other places. @param {Group} group */
  reshape({ id, shapes }) {
    const group = this.scene.groups.find((one) => one.id === id),
      line = this.lines.find((one) => one.id === id && !one.band),
      disc = this.discs.find((one) => one.id === id);
    if (group) group.shapes = shapes;
    if (disc) [disc.shape, ...disc.rest] = shapes;
    if (line) Object.assign(line, parts(shapes));
  }

  /** Draw a look; true where there is more to be drawn in the next frame.
   * @param {Context} context @param {Camera} camera @param {Look} look @returns {boolean} */
  draw(context, camera, look) {
    const begun = performance.now(),
      isPassing = this.isPassing(camera);
    this.asked = layoutOf(camera);
    if (isPassing) {
      this.preview(context, camera);
      return true;
    }
    const anew = this.prepare(camera),
      mosaic = /** @type {Mosaic} */ (this.mosaic);
    this.lay(camera, look);
    this.dress(camera, look);
    const left = mosaic.work((coverage, tile) => this.fill(coverage, tile), anew ? Infinity : begun + BUDGET);
    mosaic.blend();
    context.putImageData(mosaic.image, 0, 0);
    context.globalAlpha = 1;
    this.place(context, camera);
    if (this.caption) this.text(context, { ...this.caption, text: look.caption }, this.caption.fill);
    if (anew) {
      this.since = performance.now();
      this.cost = this.since - begun;
      this.shot = null;
    }
    return left;
  }

  /** Whether the camera is on its way, and a picture of what it sees would take long. @param {Camera} camera @returns {boolean} */
  isPassing(camera) {
    const { mosaic, cost } = this;
    return (
      layoutOf(camera) !== this.asked &&
      cost > SLOW &&
      performance.now() - this.since < PATIENCE * cost &&
      mosaic !== null &&
      mosaic.image.width === camera.window[0] &&
      mosaic.image.height === camera.window[1]
    );
  }

  /** Show the latest picture where the camera would see it. @param {Context} context @param {Camera} camera */
  preview(context, camera) {
    const [width, height] = camera.window,
      { scale, origin } = this.seen,
      by = camera.scale / scale;
    if (!this.shot) {
      this.shot = document.createElement('canvas');
      [this.shot.width, this.shot.height] = camera.window;
      /** @type {Context} */ (this.shot.getContext('2d')).drawImage(context.canvas, 0, 0);
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.globalAlpha = 1;
    context.fillStyle = this.scene.theme.background;
    context.fillRect(0, 0, width, height);
    const [left, top] = camera.origin.map((at, axis) => at - origin[axis] * by);
    context.drawImage(this.shot, left, top, width * by, height * by);
  }

  /** Lay everything out anew where the camera has moved; whether it had. @param {Camera} camera @returns {boolean} */
  prepare(camera) {
    const layout = layoutOf(camera);
    if (layout === this.layout) return false;
    this.layout = layout;
    this.seen = { scale: camera.scale, origin: camera.origin };
    this.mosaic = new Mosaic(camera.window, this.lines.length + 2 * this.discs.length);
    this.dressed = '';
    for (const item of [...this.lines, ...this.discs]) item.laid = null;
    return true;
  }

  /** A picture of shapes, each of which is as strong as its alpha; none where there are no shapes.
   * @param {Camera} camera @param {Shape[]} shapes @param {(context: Context) => void} [more]
   * @returns {Uint8ClampedArray | null} */
  picture(camera, shapes, more) {
    if (!shapes.length && !more) return null;
    const canvas = document.createElement('canvas'),
      [width, height] = camera.window;
    [canvas.width, canvas.height] = [width, height];
    const context = /** @type {Context} */ (canvas.getContext('2d', { willReadFrequently: true }));
    this.place(context, camera);
    for (const shape of shapes) this.shape(context, shape);
    if (more) more(context);
    return context.getImageData(0, 0, width, height).data;
  }

  /** @param {Context} context @param {Camera} camera */
  place(context, camera) {
    const [left, top] = camera.origin;
    context.setTransform(camera.scale, 0, 0, camera.scale, left, top);
    context.lineJoin = 'round';
  }

  /** Draw the pictures of what stays where they are other ones now. @param {Camera} camera @param {Look} look */
  dress(camera, look) {
    const { lines, discs, near, mosaic } = this,
      { isFaint } = this.constants,
      { kinds } = look;
    const faint = [
      ...lines.filter(({ rest, index }) => rest.length && kinds[index] & isFaint),
      ...discs.filter(({ index }) => kinds[look.widths.length + index] & isFaint),
    ].map(({ id }) => id);
    const dressed = [this.held, this.moves, ...faint, ':', ...this.near].join();
    if (dressed === this.dressed || !mosaic) return;
    this.dressed = dressed;
    const before = this.pictures,
      isWord = (/** @type {Shape} */ shape) => shape.kind === 'text' && shape.onDisc;
    /** whether something recedes @param {string} id */
    const isFar = (id) => near.size > 0 && !near.has(id);
    /** What lies on lines and discs; of what recedes the labels can still be read. @param {Context} context
     * @param {(Line | Disc)[]} items */
    const draw = (context, items) => {
      for (const { id, rest, laid } of items) {
        for (const shape of rest) {
          const isRead = shape.kind === 'text' && isFar(id);
          if (isWord(shape) && !isRead) continue;
          context.globalAlpha = isRead || !laid ? 1 : laid.share;
          this.shape(context, isRead ? { ...shape, fill: this.scene.theme.muted } : shape);
        }
      }
    };
    const words = discs.flatMap(({ id, rest }) => (isFar(id) ? [] : rest.filter(isWord))),
      beads = lines.filter(({ rest }) => rest.length);
    this.pictures = {
      back: this.picture(camera, [], (context) => {
        const [left, top] = camera.unit(0, 0),
          [right, bottom] = camera.unit(camera.window[0], camera.window[1]);
        context.fillStyle = this.scene.theme.background;
        context.fillRect(left, top, right - left, bottom - top);
        for (const { id, data, shapes } of this.back) {
          context.globalAlpha = data.signal === undefined || !near.size || near.has(id) ? 1 : RECEDING;
          for (const shape of shapes) this.shape(context, shape);
        }
      }),
      between:
        beads.length || this.between.length
          ? this.picture(camera, [], (context) => {
              draw(context, beads);
              for (const { id, shapes } of this.between) {
                context.globalAlpha = !near.size || near.has(id) ? 1 : RECEDING;
                for (const shape of shapes) this.shape(context, shape);
              }
            })
          : null,
      words: this.picture(camera, words),
      front: this.picture(camera, [], (context) => {
        draw(context, discs);
        context.globalAlpha = 1;
        for (const { shape, id } of discs) if (id === this.held) this.ring(context, shape);
        for (const { shapes } of this.front) for (const shape of shapes) this.shape(context, shape);
      }),
    };
    for (const name of ['back', 'between', 'words', 'front']) mosaic.compare(before[name], this.pictures[name]);
  }

  /** Show that a disc is held, near by as thin as lines are there. @param {Context} context @param {Shape} shape */
  ring(context, { at, radius }) {
    const ink = Math.min(1, (this.scene.density * devicePixelRatio) / this.seen.scale);
    context.strokeStyle = this.scene.theme.ink;
    context.lineWidth = 2 * ink;
    context.beginPath();
    context.arc(at[0], at[1], radius + 3 * ink, 0, 2 * Math.PI);
    context.stroke();
  }

  /** Lay out what lies otherwise than before, and have all in its colours. @param {Camera} camera @param {Look} look */
  lay(camera, look) {
    const { lines, discs, constants, near, fills } = this,
      { scale } = camera,
      [left, top] = camera.origin;
    const mosaic = /** @type {Mosaic} */ (this.mosaic),
      { fineness, levels, isFaint, isBar, isNegative } = constants;
    /** @param {string} id @param {number} kind */
    const shareOf = (id, kind) => (kind & isFaint ? constants.faint : 1) * (!near.size || near.has(id) ? 1 : RECEDING);
    discs.forEach((disc, at) => {
      const kind = look.kinds[look.widths.length + disc.index],
        share = shareOf(disc.id, kind),
        { shape, laid } = disc;
      const level = look.discs[disc.index] + levels,
        slot = lines.length + at;
      mosaic.paint(slot, fills.at(level) ?? 0);
      mosaic.paint(slot + discs.length, this.inks.at(level) ?? 0);
      const x = shape.at[0] * scale + left,
        y = shape.at[1] * scale + top;
      if (laid && laid.x === x && laid.y === y && laid.share === share) return;
      if (laid && (laid.x !== x || laid.y !== y)) this.moves++;
      const radius = shape.radius * scale,
        ring = (Math.max(0, shape.width) / 2) * scale;
      const tiles = mosaic.around(x, y, radius + ring + 1);
      if (laid) {
        leave(laid.tiles, 'discs', at);
        mosaic.spoil(laid.tiles);
      }
      enter(tiles, 'discs', at);
      mosaic.spoil(tiles);
      disc.laid = { x, y, radius, ring, colour: ring ? whole(shape.stroke) : 0, tiles, share };
    });
    lines.forEach((line, at) => {
      const { index, points, laid } = line,
        band = line.band && this.bands.seen(line.band, look),
        kind = band ? 0 : look.kinds[index];
      const share = shareOf(line.id, kind) * (band ? band.share : 1),
        width = band ? band.width : look.widths[index],
        glow = band ? 0 : look.glows[index];
      const ending = band ? band.ending : !(kind & isBar) ? 1 : kind & isNegative ? -1 : 0;
      mosaic.paint(at, band ? band.colour : fills[look.lines[index] + levels]);
      const same = laid && laid.points === points && laid.head === line.head;
      if (same && laid.width === width && laid.glow === glow && laid.ending === ending && laid.share === share) return;
      const end = this.end(line.head, width / fineness, ending, scale, camera.origin);
      const start = line.tail && this.end(line.tail, width / fineness, ending, scale, camera.origin);
      const reach = (Math.max(width, glow) / 2 / fineness) * scale + 0.5,
        { room } = end;
      const now = { points, head: line.head, end, start, width, glow, ending, share };
      if (same && reach <= laid.reach && room <= laid.room) {
        Object.assign(laid, now);
        mosaic.spoil(laid.tiles);
        return;
      }
      const chain = same ? laid.chain : flattened(points, scale, camera.origin);
      const tiles = mosaic.beside(chain, reach + SPARE, [end, ...(start ? [start] : [])], room + SPARE);
      if (laid) {
        leave(laid.tiles, 'lines', at);
        mosaic.spoil(laid.tiles);
      }
      enter(tiles, 'lines', at);
      mosaic.spoil(tiles);
      const { dash } = line,
        strokes = dash.length
          ? dashes(
              chain,
              dash.map((length) => length * scale),
            )
          : [chain];
      line.laid = { ...now, reach: reach + SPARE, room: room + SPARE, box: around(points), chain, strokes, tiles };
    });
  }

  /** Put in all that is in a tile, from front to back. @param {Coverage} coverage @param {Tile} tile */
  fill(coverage, tile) {
    const { lines, discs, pictures, colours } = this,
      half = this.seen.scale / 2 / this.constants.fineness;
    coverage.picture(pictures.front);
    for (let last = tile.discs.length - 1; last >= 0; last--) {
      const at = tile.discs[last],
        { laid } = discs[at],
        slot = lines.length + at;
      if (laid) coverage.disc(laid, slot, pictures.words, slot + discs.length);
    }
    coverage.picture(pictures.between);
    for (let last = tile.lines.length - 1; last >= 0 && coverage.open; last--) {
      const at = tile.lines[last],
        { laid } = lines[at];
      if (!laid) continue;
      coverage.head(laid.end, laid.share, at);
      if (laid.start) coverage.head(laid.start, laid.share, at);
      const { chain, strokes, share } = laid,
        glow = laid.glow * half;
      if (strokes[0] === chain) coverage.line(chain, laid.width * half, glow, share, at, colours.glow);
      else {
        for (const stroke of strokes) coverage.line(stroke, laid.width * half, 0, share, at, colours.glow);
        if (glow > 0) coverage.line(chain, 0, glow, share, at, colours.glow);
      }
    }
    coverage.picture(pictures.back);
  }

  /** The end of a line of a width, in pixels: an arrow (1), a bar (-1), or its stem alone (0). @param {Shape} shape
   * @param {number} width @param {number} ending
   * @param {number} scale @param {number[]} origin @returns {End} */
  end({ at, along, length: long }, width, ending, scale, origin) {
    const { constants } = this,
      length = long * scale,
      notch = -constants.notch * length,
      lap = notch - constants.lap * length;
    const stem = (width / 2) * scale,
      bar = ending <= 0;
    const half =
      ending === 0
        ? stem
        : Math.max(
            constants.headOfLength * length + constants.headOfWidth * width * scale,
            (0.5 / constants.notch) * width * scale + constants.headMore * scale,
          );
    return {
      x: at[0] * scale + origin[0],
      y: at[1] * scale + origin[1],
      dx: along[0],
      dy: along[1],
      length,
      half,
      notch,
      back: -constants.bar * length,
      lap,
      stem,
      bar,
      room: Math.hypot(half, bar ? lap : length) + 1,
    };
  }

  /** The end of a line that stays. @param {Context} context @param {Shape} shape @param {number} width @param {string} colour
   * @param {number} ending */
  head(context, shape, width, colour, ending) {
    const { x, y, dx, dy, length, half, notch, back, lap, stem, bar } = this.end(shape, width, ending, 1, [0, 0]);
    const corners = bar
      ? [0, half, back, half, back, stem, lap, stem, lap, -stem, back, -stem, back, -half, 0, -half]
      : [0, 0, -length, half, notch, 0, -length, -half];
    context.fillStyle = colour;
    context.beginPath();
    for (let i = 0; i < corners.length; i += 2) {
      const along = corners[i],
        across = corners[i + 1];
      context.lineTo(x + along * dx - across * dy, y + along * dy + across * dx);
    }
    context.fill();
  }

  /** A shape as it stands. @param {Context} context @param {Shape} shape */
  shape(context, shape) {
    const [x, y] = shape.at || [0, 0],
      [across, down] = shape.size || [0, 0];
    switch (shape.kind) {
      case 'disc':
      case 'box':
        context.beginPath();
        if (shape.kind === 'disc') context.arc(x, y, shape.radius, 0, 2 * Math.PI);
        else context.roundRect(x, y, across, down, Math.min(shape.radius, across / 2, down / 2));
        context.fillStyle = shape.fill;
        context.fill();
        if (shape.width > 0) {
          context.strokeStyle = shape.stroke;
          context.lineWidth = shape.width;
          context.stroke();
        }
        break;
      case 'line':
        context.save();
        context.globalAlpha *= shape.opacity;
        context.strokeStyle = shape.stroke;
        context.lineWidth = shape.width;
        context.lineCap = shape.dash.length && !shape.flat ? 'round' : 'butt';
        context.setLineDash(shape.dash);
        context.stroke(spline(shape.points));
        context.restore();
        break;
      case 'polygon':
        context.beginPath();
        for (let at = 0; at < shape.points.length; at += 2) context.lineTo(shape.points[at], shape.points[at + 1]);
        context.closePath();
        context.fillStyle = context.strokeStyle = shape.fill;
        context.fill();
        if (shape.width > 0) {
          context.lineJoin = 'round';
          context.lineWidth = shape.width;
          context.stroke();
        }
        break;
      case 'head':
        this.head(context, shape, shape.width || 0.6, shape.fill, shape.end);
        break;
      case 'ramp': {
        const step = across / shape.colours.length,
          last = shape.colours.length - 1;
        shape.colours.forEach((colour, at) => {
          context.fillStyle = colour;
          context.fillRect(x + at * step, y, at === last ? step : step + 0.75, down);
        });
        break;
      }
      case 'image':
        this.image(context, shape);
        break;
      case 'text':
        this.text(context, shape, shape.fill);
    }
  }

  /** @param {Context} context @param {Shape} shape */
  image(context, shape) {
    const cells = document.createElement('canvas'),
      { columns, rows } = shape;
    [cells.width, cells.height] = [columns, rows];
    const pixels = Uint8Array.from(atob(shape.pixels), (c) => c.charCodeAt(0)),
      data = new ImageData(columns, rows);
    for (let i = 0; i < columns * rows; i++) {
      data.data.set([pixels[3 * i], pixels[3 * i + 1], pixels[3 * i + 2], 255], 4 * i);
    }
    /** @type {Context} */ (cells.getContext('2d')).putImageData(data, 0, 0);
    context.imageSmoothingEnabled = false;
    context.drawImage(cells, shape.at[0], shape.at[1], shape.size[0], shape.size[1]);
  }

  /** @param {Context} context @param {Shape} shape @param {string} fill */
  text(context, shape, fill) {
    const { constants } = this,
      { font: size, anchor, weight } = shape,
      small = constants.subscriptSize * size;
    /** @param {number} at */
    const choose = (at) => {
      context.font = `${weight} ${at}px ${this.family}`;
    };
    let [x, y] = shape.at;
    if (shape.upward) {
      context.save();
      context.translate(x, y);
      context.rotate(-Math.PI / 2);
      this.text(context, { ...shape, at: [0, 0], upward: false }, fill);
      context.restore();
      return;
    }
    let below = 0;
    if (shape.subscript) {
      choose(small);
      below = context.measureText(shape.subscript).width;
    }
    choose(size);
    const across = below || anchor !== 'start' ? context.measureText(shape.text).width : 0;
    if (anchor !== 'start') x -= (across + below) / (anchor === 'middle' ? 2 : 1);
    this.letters(context, shape.text, x, y, fill, shape.halo, size);
    if (below) {
      choose(small);
      y += constants.subscriptDrop * size;
      this.letters(context, shape.subscript, x + across, y, fill, shape.halo, size);
    }
  }

  /** @param {Context} context @param {string} text @param {number} x @param {number} y @param {string} fill
   * @param {string} halo @param {number} size */
  letters(context, text, x, y, fill, halo, size) {
    if (halo) {
      context.strokeStyle = halo;
      context.lineWidth = 2 * this.constants.halo * size;
      context.strokeText(text, x, y);
    }
    context.fillStyle = fill;
    context.fillText(text, x, y);
  }
}
