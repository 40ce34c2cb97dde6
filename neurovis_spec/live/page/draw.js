/**
 * Drawing: a scene and a look on a canvas, the same picture as the renderers make.
 */

import { palette } from './colours.js';

/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Shape} Shape */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {CanvasRenderingContext2D} Context */
/** @typedef {{index: number, path: Path2D, box: number[], head: Shape, rest: Shape[]}} Line */
/** @typedef {{index: number, shape: Shape, rest: Shape[]}} Disc */

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

/** How much is seen of what recedes, where something is held. */
const RECEDING = 0.12;

/** Draws one scene. */
export class Drawing {
  /** @param {Scene} scene */
  constructor(scene) {
    this.scene = scene;
    this.constants = scene.constants;
    this.palette = palette(scene.theme, this.constants.levels);
    this.family = this.constants.families.map((/** @type {string} */ name) => (name === 'sans-serif' ? name : `"${name}"`));
    /** @type {Group[]} */
    this.back = [];
    /** @type {Group[]} */
    this.front = [];
    /** @type {Line[]} */
    this.lines = [];
    /** @type {Disc[]} */
    this.discs = [];
    /** @type {Shape | null} */
    this.caption = null;
    for (const group of scene.groups) this.sort(group);
    /** @type {HTMLCanvasElement[]} */
    this.layers = [];
    /** the ids of what stands out; where there are none, all does @type {Set<string>} */
    this.near = new Set();
    this.held = '';
    this.layout = '';
  }

  /** Put a group where it belongs. @param {Group} group */
  sort(group) {
    const { id, shapes, data } = group;
    if (data.neuron !== undefined) {
      this.discs.push({ index: Number(id.slice(1)), shape: shapes[0], rest: shapes.slice(1) });
    } else if (data.connection !== undefined) {
      const { points } = shapes[0], index = Number(id.slice(1));
      this.lines.push({ index, path: spline(points), box: around(points), head: shapes[1], rest: shapes.slice(2) });
    } else if (id === 'caption') {
      this.caption = shapes[0];
    } else {
      (this.lines.length || this.discs.length ? this.front : this.back).push(group);
    }
  }

  /** Draw a look. @param {Context} context @param {Camera} camera @param {Look} look */
  draw(context, camera, look) {
    this.prepare(camera);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.globalAlpha = 1;
    context.drawImage(this.layers[0], 0, 0);
    this.place(context, camera);
    for (const line of this.lines) this.line(context, line, look);
    for (const disc of this.discs) this.disc(context, disc, look);
    context.globalAlpha = 1;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.layers[1], 0, 0);
    this.place(context, camera);
    if (this.caption) this.text(context, { ...this.caption, text: look.caption }, this.caption.fill);
  }

  /** Draw what stays, where the camera has moved. @param {Camera} camera */
  prepare(camera) {
    const layout = [...camera.window, camera.scale, ...camera.origin].join(' ');
    if (layout === this.layout) return;
    this.layout = layout;
    this.layers = [this.back, this.front].map((groups, at) => {
      const layer = document.createElement('canvas');
      [layer.width, layer.height] = camera.window;
      const context = /** @type {Context} */ (layer.getContext('2d'));
      if (at === 0) {
        context.fillStyle = this.scene.theme.background;
        context.fillRect(0, 0, layer.width, layer.height);
      }
      this.place(context, camera);
      for (const group of groups) for (const shape of group.shapes) this.shape(context, shape);
      return layer;
    });
  }

  /** @param {Context} context @param {Camera} camera */
  place(context, camera) {
    const [left, top] = camera.origin;
    context.setTransform(camera.scale, 0, 0, camera.scale, left, top);
    context.lineJoin = 'round';
  }

  /** @param {Context} context @param {Line} line @param {Look} look */
  line(context, line, look) {
    const { constants } = this, kind = look.kinds[line.index];
    const width = look.widths[line.index] / constants.fineness, glow = look.glows[line.index] / constants.fineness;
    const colour = this.palette.fills[look.lines[line.index] + constants.levels];
    context.globalAlpha = (kind & constants.isFaint ? constants.faint : 1) * this.share(`c${line.index}`);
    if (glow > 0) {
      context.strokeStyle = this.scene.theme.glow;
      context.lineWidth = glow;
      context.stroke(line.path);
    }
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.stroke(line.path);
    this.head(context, line.head, width, colour, (kind & constants.isBar) !== 0);
    for (const shape of line.rest) this.shape(context, shape);
  }

  /** @param {Context} context @param {Disc} disc @param {Look} look */
  disc(context, disc, look) {
    const { constants } = this, level = look.discs[disc.index] + constants.levels;
    const faint = look.kinds[look.widths.length + disc.index] & constants.isFaint, id = `n${disc.index}`;
    context.globalAlpha = (faint ? constants.faint : 1) * this.share(id);
    this.shape(context, { ...disc.shape, fill: this.palette.fills[level] });
    for (const shape of disc.rest) {
      if (shape.kind === 'text') this.text(context, shape, shape.onDisc ? this.palette.texts[level] : shape.fill);
      else this.shape(context, shape);
    }
    if (id === this.held) {
      const { at, radius } = disc.shape;
      context.globalAlpha = 1;
      context.strokeStyle = this.scene.theme.ink;
      context.lineWidth = 2;
      context.beginPath();
      context.arc(at[0], at[1], radius + 3, 0, 2 * Math.PI);
      context.stroke();
    }
  }

  /** How much is seen of something. @param {string} id @returns {number} */
  share(id) {
    return !this.near.size || this.near.has(id) ? 1 : RECEDING;
  }

  /** The end of a line. @param {Context} context @param {Shape} shape @param {number} width @param {string} colour
   * @param {boolean} bar */
  head(context, shape, width, colour, bar) {
    const { constants } = this, { length } = shape, [x, y] = shape.at, [dx, dy] = shape.along;
    const half = Math.max(constants.headOfLength * length + constants.headOfWidth * width,
      (0.5 / constants.notch) * width + constants.headMore);
    const notch = -constants.notch * length, back = -constants.bar * length, lap = notch - constants.lap * length;
    const stem = width / 2;
    const corners = bar
      ? [0, half, back, half, back, stem, lap, stem, lap, -stem, back, -stem, back, -half, 0, -half]
      : [0, 0, -length, half, notch, 0, -length, -half];
    context.fillStyle = colour;
    context.beginPath();
    for (let i = 0; i < corners.length; i += 2) {
      const along = corners[i], across = corners[i + 1];
      context.lineTo(x + along * dx - across * dy, y + along * dy + across * dx);
    }
    context.fill();
  }

  /** A shape as it stands. @param {Context} context @param {Shape} shape */
  shape(context, shape) {
    const [x, y] = shape.at || [0, 0], [across, down] = shape.size || [0, 0];
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
        context.lineCap = shape.dash.length ? 'round' : 'butt';
        context.setLineDash(shape.dash);
        context.stroke(spline(shape.points));
        context.restore();
        break;
      case 'head':
        this.head(context, shape, shape.width || 0.6, shape.fill, shape.bar);
        break;
      case 'ramp': {
        const step = across / shape.colours.length, last = shape.colours.length - 1;
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
    const cells = document.createElement('canvas'), { columns, rows } = shape;
    [cells.width, cells.height] = [columns, rows];
    const pixels = Uint8Array.from(atob(shape.pixels), (c) => c.charCodeAt(0)), data = new ImageData(columns, rows);
    for (let i = 0; i < columns * rows; i++) {
      data.data.set([pixels[3 * i], pixels[3 * i + 1], pixels[3 * i + 2], 255], 4 * i);
    }
    /** @type {Context} */ (cells.getContext('2d')).putImageData(data, 0, 0);
    context.imageSmoothingEnabled = false;
    context.drawImage(cells, shape.at[0], shape.at[1], shape.size[0], shape.size[1]);
  }

  /** @param {Context} context @param {Shape} shape @param {string} fill */
  text(context, shape, fill) {
    const { constants } = this, { font: size, anchor, weight } = shape, small = constants.subscriptSize * size;
    /** @param {number} at */
    const choose = (at) => { context.font = `${weight} ${at}px ${this.family}`; };
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
