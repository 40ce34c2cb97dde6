/**
 * Semantic zoom: lines and labels are no thicker and larger near by than in the picture, and at a distance boxes and
 * instances are closed: they have the mean colour of their neurons, their name, and a raster of the last frames; what runs
 * from and to them is added up. Each can be closed by hand, too.
 */

import { groupsOf } from './joined.js';
import { Past } from './raster.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Shape} Shape */
/** @typedef {import('./protocol.js').Joined} Joined */
/** Of its neurons the least radius, and the least size of a label, 0 where none has one.
 * @typedef {{id: string, path: string, rect: number[], members: number[], radius: number, font: number, holds: boolean,
 *   title: Shape | null}} Box */

/** A box is closed where its labels are smaller than this, or, without labels, its discs, in pixels of a page, unless the
 * picture is shown in its own size, or it holds others and is so large, or all neurons. */
const LEGIBLE = 7,
  TINY = 3,
  OWN = 1,
  ROOMY = 150;
/** How large labels grow with what they are of, those on discs and others, in pixels of a page; those are larger alone
 * that are so in the picture. */
const ON_DISC = 28,
  BESIDE = 16;
/** The size of a closed box's name, in pixels of a page, and the least. */
const NAMED = 12,
  SMALL = 7;
/** How high its raster is at least, in pixels of a page, and half of how wide. */
const RASTER = 14;
/** The level of a neuron whose activity is no finite number. */
const NONE = -128;

/** Whether a point lies in a rectangle. @param {number[]} rect @param {number[]} at @returns {boolean} */
const within = ([x0, y0, x1, y1], [x, y]) => x >= x0 && x <= x1 && y >= y0 && y <= y1;

/** The rectangle around points. @param {number[]} points @returns {number[]} */
function edges(points) {
  const [xs, ys] = [0, 1].map((axis) => points.filter((_, at) => at % 2 === axis));
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}

/** What of a scene is drawn at a distance. */
export class Zoom {
  constructor() {
    /** @type {Scene | null} */
    this.scene = this.whole = null;
    /** @type {Box[]} */
    this.boxes = [];
    /** the ids of those that are closed by hand @type {Set<string>} */
    this.hand = new Set();
    /** what runs from and to closed boxes, and what it adds up to, as it is told @type {Joined | null} */
    this.joined = null;
    this.past = new Past();
    /** the boxes that are closed now @type {Box[]} */
    this.closed = [];
    /** the box that is closed around a neuron, by its name @type {Map<string, Box>} */
    this.around = new Map();
    /** @type {Scene | null} */
    this.made = null;
    /** what it was made for, and from where it was last seen */
    this.key = this.from = '';
    /** all groups by their ids @type {Map<string, Group>} */
    this.places = new Map();
    /** how thick lines are beside the picture's, pixels of a page for a unit, and whether all is as in the picture */
    this.ink = 1;
    this.scale = 1;
    this.isPlain = true;
  }

  /** Another network. @param {Scene} scene */
  use(scene) {
    this.places = new Map(scene.groups.map((group) => [group.id, group]));
    this.boxes = scene.groups
      .filter(({ id }) => scene.boxes[id]?.length)
      .map(({ id, title, shapes: [{ at, size, points }] }) => {
        const members = scene.boxes[id],
          inside = members.map((index) => /** @type {Group} */ (this.places.get(`n${index}`)).shapes);
        const radius = Math.min(...inside.map(([disc]) => disc.radius)),
          fonts = inside.flat().flatMap(({ kind, font }) => (kind === 'text' ? [font] : []));
        const rect = points ? edges(points) : [...at, at[0] + size[0], at[1] + size[1]];
        const words = this.places.get(`title:${title}`)?.shapes[0] ?? null;
        return {
          id,
          path: title,
          rect,
          members,
          radius,
          font: Math.min(...fonts, 99) % 99,
          holds: false,
          title: words,
        };
      });
    const inside = (/** @type {Box} */ box, /** @type {Box} */ other) =>
      other !== box && other.members.every((index) => box.members.includes(index));
    for (const box of this.boxes) box.holds = this.boxes.some((other) => inside(box, other));
    this.hand = new Set([...this.hand].filter((id) => id in scene.boxes));
    this.joined = null;
    this.past.clear();
    this.scene = this.whole = scene;
    this.made = null;
  }

  /** Draw lines, too, which the picture leaves out, those of an open bundle in its place. @param {Group[]} lines
   * @param {string} [open] */
  more(lines, open) {
    const { whole } = this;
    if (!whole || (!lines.length && this.scene === whole)) return;
    // above the others, below bundles
    const groups = whole.groups.filter(({ id }) => id !== open || !lines.length),
      last = groups.reduce((at, { data }, place) => (data.connection === undefined ? at : place + 1), 0),
      at = last || groups.findIndex(({ data }) => data.neuron !== undefined);
    this.scene = lines.length ? { ...whole, groups: [...groups.slice(0, at), ...lines, ...groups.slice(at)] } : whole;
    this.made = null;
  }

  /** Close a box by hand, or open it again; whether it is open then. @param {string} id @param {Camera} camera
   * @returns {boolean} */
  turn(id, camera) {
    const isOpen = !this.ids.includes(id);
    this.hand.delete(id);
    if (isOpen) this.hand.add(id);
    this.from = '';
    return !isOpen && !this.shut(camera).some((box) => box.id === id);
  }

  /** What runs from and to closed boxes is told. @param {Joined} joined */
  join(joined) {
    this.joined = joined;
    this.made = null;
  }

  /** The boxes that are closed, the outermost of those in each other. @param {Camera} camera @returns {Box[]} */
  shut(camera) {
    const scale = camera.scale / devicePixelRatio,
      density = this.scene ? this.scene.density : 1;
    /** @type {Box[]} */
    const closed = [],
      isFar = scale < OWN * density,
      all = this.scene?.discs;
    for (const box of this.boxes) {
      const [x0, y0, x1, y1] = box.rect,
        roomy = box.holds && Math.min(x1 - x0, y1 - y0) * scale >= ROOMY;
      const covered = closed.some(({ members }) => box.members.every((index) => members.includes(index))),
        isTiny = box.font ? box.font * scale < LEGIBLE : box.radius * scale < TINY;
      if (!covered && (this.hand.has(box.id) || (isFar && isTiny && !roomy && box.members.length !== all)))
        closed.push(box);
    }
    return closed;
  }

  /** The least pixels for a unit at which a box is open. @param {Box} box @returns {number} */
  opening({ radius, font }) {
    const legible = font ? LEGIBLE / font : TINY / radius;
    return this.scene ? devicePixelRatio * Math.min(OWN * this.scene.density, legible) : 0;
  }

  /** The scene as it is seen from here; the same as long as it is drawn the same way. @param {Camera} camera @returns {Scene | null} */
  seen(camera) {
    const { scene } = this;
    const from = [camera.scale, camera.whole, devicePixelRatio].join();
    if (!scene || (this.made && from === this.from)) return this.made;
    this.from = from;
    const least = Math.max(scene.density * devicePixelRatio, camera.whole) / camera.scale,
      ink = least > 0.999 ? 1 : least,
      closed = this.shut(camera);
    const scale = camera.scale / devicePixelRatio,
      isPlain = ink === 1 && !this.larger(scale);
    const key = `${isPlain ? '' : scale.toFixed(3)} ${closed.map(({ id }) => id).join()}`;
    if (this.made && key === this.key) return this.made;
    Object.assign(this, { key, ink, scale, isPlain });
    this.closed = closed;
    this.around.clear();
    for (const box of closed) {
      for (const index of box.members) this.around.set(this.places.get(`n${index}`)?.data.neuron ?? '', box);
    }
    const { bundles } = scene,
      { fineness, headMore } = scene.constants;
    this.made =
      isPlain && !closed.length
        ? scene
        : {
            ...scene,
            bundles: { ...bundles, widest: bundles.widest * ink, narrowest: bundles.narrowest * ink },
            constants: { ...scene.constants, fineness: fineness / ink, headMore: headMore * ink },
            groups: this.withJoined(
              scene.groups.filter((group) => !this.covers(group)).map((group) => this.inked(group)),
              camera,
            ),
          };
    return this.made;
  }

  /** What runs from and to closed boxes, by its id. @param {string} id @returns {Group | undefined} */
  joins(id) {
    return this.made?.groups.find((group) => group.id === id);
  }

  /** The ids of the boxes that are closed. @returns {string[]} */
  get ids() {
    return this.closed.map(({ id }) => id);
  }

  /** Groups with what runs from and to closed boxes, beneath the discs. @param {Group[]} groups @param {Camera} camera
   * @returns {Group[]} */
  withJoined(groups, camera) {
    const { joined, scene } = this,
      page = devicePixelRatio / camera.scale;
    if (!joined || !scene || joined.boxes.join() !== this.ids.join()) return groups;
    const at = groups.findIndex(({ data }) => data.neuron !== undefined),
      place = at < 0 ? groups.findIndex(({ id }) => id.startsWith('title:')) : at;
    return [
      ...groups.slice(0, place < 0 ? groups.length : place),
      ...groupsOf(joined, (id) => this.place(id), page, scene),
      ...(place < 0 ? [] : groups.slice(place)),
    ];
  }

  /** Where a box or a neuron is, and how it is called. @param {string} id @returns {{rect: number[], name: string} | null} */
  place(id) {
    const box = this.boxes.find((one) => one.id === id),
      disc = this.places.get(id)?.shapes[0];
    if (box) return { rect: box.rect, name: box.path };
    if (!disc) return null;
    const [x, y] = disc.at;
    const rect = [x - disc.radius, y - disc.radius, x + disc.radius, y + disc.radius];
    return { rect, name: this.places.get(id)?.data.neuron ?? '' };
  }

  /** Whether closed boxes stand in for a group. @param {Group} group @returns {boolean} */
  covers({ id, data }) {
    if (data.neuron !== undefined) return this.around.has(data.neuron);
    if (!this.closed.length) return false;
    if (data.connection !== undefined) return this.around.has(data.from) || this.around.has(data.to);
    if (data.signal !== undefined) {
      const [from, to] = data.signal.split(' -> ');
      return this.around.has(from) && this.around.get(from) === this.around.get(to);
    }
    if (id.startsWith('bundle:')) return data.pathway.split(' -> ').some((group) => this.isIn(group));
    const [kind, ...path] = id.split(':'),
      known = ['box', 'instance', 'title'].includes(kind);
    const one = known && this.boxes.find((box) => (kind === 'title' ? box.path === path.join(':') : box.id === id));
    return (
      Boolean(one) && this.closed.some(({ rect }) => one && within(rect, one.rect) && within(rect, one.rect.slice(2)))
    );
  }

  /** Whether labels would be larger than they are to be, at so many pixels of a page for a unit. @param {number} scale
   * @returns {boolean} */
  larger(scale) {
    const groups = this.scene?.groups ?? [];
    return groups.some(({ shapes }) =>
      shapes.some((shape) => shape.kind === 'text' && this.share(shape, scale) < 0.999),
    );
  }

  /** How large a label is beside one that grows with what it is of. @param {Shape} shape @param {number} scale pixels of a
   * page for a unit @returns {number} */
  share({ font, onDisc }, scale) {
    const most = Math.max(font * (this.scene?.density ?? 1), onDisc ? ON_DISC : BESIDE);
    return Math.min(1, most / (font * scale));
  }

  /** Whether all neurons of a group are in closed boxes. @param {string} group @returns {boolean} */
  isIn(group) {
    const own = this.scene?.groups.filter(({ data }) => data.group === group) ?? [];
    return own.length > 0 && own.every(({ data }) => this.around.has(data.neuron));
  }

  /** A group as it is drawn from here: near by with thinner lines, and labels that are no larger than can well be read.
   * @param {Group} group @returns {Group} */
  inked(group) {
    const { ink, scale } = this,
      { id, data, shapes } = group,
      [first] = shapes;
    if (id.startsWith('bundle:')) {
      // each band has its own head
      const bands = shapes.flatMap((_, at) => (at % 2 ? [] : [shapes.slice(at, at + 2)]));
      return { ...group, shapes: bands.flatMap((band) => this.inked({ ...group, id: '', shapes: band }).shapes) };
    }
    const isDrawn = Object.keys(data).length || /^(box|instance|title):/.test(id) || first?.kind === 'text';
    if (this.isPlain || !isDrawn) return group;
    const { notch } = /** @type {Scene} */ (this.scene).constants,
      [head, tail] = shapes.filter(({ kind }) => kind === 'head');
    /** @type {{from: number[], to: number[]} | null} the first line of a label beside a disc: others stay below it */
    let line = null;
    return {
      ...group,
      shapes: shapes.map((shape) => {
        const made = { ...shape, width: shape.width * ink };
        if (shape.kind === 'head') return { ...made, length: shape.length * ink, half: shape.half * ink };
        if (shape.kind === 'line') {
          made.dash = shape.dash.map((length) => length * ink);
          // the head is shorter, and the line goes on to it
          if (head) {
            const more = notch * head.length * (1 - ink);
            const on = (
              /** @type {number[]} */ [x, y],
              /** @type {number[]} */ along,
              /** @type {number[]} */ shares,
            ) => shares.flatMap((share) => [x + share * more * along[0], y + share * more * along[1]]);
            made.points = [
              ...(tail ? on(shape.points, tail.along, [1, 2 / 3, 1 / 3]) : []),
              ...shape.points,
              ...on(shape.points.slice(-2), head.along, [1 / 3, 2 / 3, 1]),
            ];
          }
        }
        if (shape.kind === 'text') {
          const by = this.share(shape, scale);
          made.font = shape.font * by;
          if (first.kind === 'disc') {
            // a label on a disc stays on it, and one beside it as close
            const [dx, dy] = [0, 1].map((axis) => shape.at[axis] - first.at[axis]),
              far = Math.hypot(dx, dy);
            const share = far > first.radius ? by + ((1 - by) * first.radius) / far : by;
            const { from, to } = line ?? { from: shape.at, to: [first.at[0] + share * dx, first.at[1] + share * dy] };
            made.at = [0, 1].map((axis) => to[axis] + by * (shape.at[axis] - from[axis]));
            if (far > first.radius) line = { from, to };
          }
        }
        if (shape.kind === 'box' && data.connection !== undefined) {
          made.size = shape.size.map((side) => side * ink);
          made.at = shape.at.map((corner, axis) => corner + (shape.size[axis] - made.size[axis]) / 2);
        }
        if (shape.kind === 'box') made.radius = shape.radius * ink;
        return made;
      }),
    };
  }

  /** The mean colour of a box's neurons, as a level. @param {Box} box @param {Look} look @returns {number} */
  mean({ members }, look) {
    const levels = members.map((index) => look.discs[index]).filter((level) => level > NONE);
    return Math.round(levels.reduce((sum, level) => sum + level, 0) / (levels.length || 1));
  }

  /** The mean colour of a box's neurons in percent of the scale of colours, with its sign. @param {Box} box @param {Look} look
   * @returns {string} */
  percent(box, look) {
    const mean = Math.round((100 * this.mean(box, look)) / (this.scene?.constants.levels ?? 1));
    return `${mean < 0 ? '−' : mean > 0 ? '+' : ''}${Math.abs(mean)} %`;
  }

  /** What is said of a closed box. @param {string} id @param {Look} look @param {Look | null} other of the branch beside it
   * @returns {string} */
  words(id, look, other) {
    const box = this.boxes.find((one) => one.id === id);
    if (!box) return '';
    const inB = other ? `, in B ${this.percent(box, other)}` : '';
    return `${box.path}\nmean ${this.percent(box, look)}${inB}\nneurons ${box.members.length}`;
  }

  /** The closed box under a unit, '' for none. @param {number[]} at @returns {string} */
  under(at) {
    const box = this.closed.find(({ rect }) => within(rect, at));
    return box ? box.id : '';
  }

  /** The open box whose title is under a unit, '' for none. @param {number[]} at @param {CanvasRenderingContext2D} context
   * @param {string} family @returns {string} */
  titled([x, y], context, family) {
    const box = this.boxes.find(({ title, path }) => {
      if (!title || [...this.closed].some((one) => one.path === path)) return false;
      const font = title.font * this.ink;
      context.font = `${title.weight} ${100}px ${family}`;
      const wide = (context.measureText(title.text).width * font) / 100,
        left = title.at[0] - wide * (title.anchor === 'middle' ? 0.5 : title.anchor === 'end' ? 1 : 0);
      return x >= left && x <= left + wide && y >= title.at[1] - 1.1 * font && y <= title.at[1] + 0.4 * font;
    });
    return box && !this.closed.some(({ members }) => members.includes(box.members[0])) ? box.id : '';
  }

  /** Choose letters in which a text has room, smaller ones where it must be, 0 for none. @param {CanvasRenderingContext2D} context
   * @param {string} text @param {number} room @param {number} weight @param {string} family @returns {number} */
  fitted(context, text, room, weight, family) {
    const page = devicePixelRatio;
    context.font = `${weight} ${NAMED * page}px ${family}`;
    const size = Math.min(NAMED, (NAMED * room) / Math.max(1, context.measureText(text).width));
    context.font = `${weight} ${size * page}px ${family}`;
    return size < SMALL ? 0 : size;
  }

  /** Draw the closed boxes. @param {CanvasRenderingContext2D} context @param {Camera} camera @param {Look} look
   * @param {{palette: {fills: string[], texts: string[], channels: number[][]}, family: string[], near: Set<string>}} drawing */
  draw(context, camera, look, { palette, family, near }) {
    this.past.add(look);
    if (!this.scene || !this.closed.length) return;
    const { theme, constants } = this.scene,
      page = devicePixelRatio;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.textAlign = 'center';
    for (const box of this.closed) {
      const [x0, y0] = camera.pixel(box.rect[0], box.rect[1]);
      let [x1, y1] = camera.pixel(box.rect[2], box.rect[3]);
      const level = this.mean(box, look) + constants.levels,
        middle = (x0 + x1) / 2;
      context.globalAlpha = !near.size || box.members.some((index) => near.has(`n${index}`)) ? 1 : 0.3;
      context.beginPath();
      context.roundRect(x0, y0, x1 - x0, y1 - y0, Math.min(6 * page, (x1 - x0) / 4, (y1 - y0) / 4));
      context.fillStyle = palette.fills[level];
      context.strokeStyle = theme.ring;
      context.lineWidth = page;
      context.fill();
      context.stroke();
      context.fillStyle = palette.texts[level];
      const room = x1 - x0 - 4 * page,
        lines = [box.path.split('.').pop() || '', this.percent(box, look)];
      const fits = y1 - y0 > 2.6 * NAMED * page ? lines : lines.slice(0, 1),
        below = y1 - y0 - (fits.length * 1.25 + 1) * NAMED * page,
        isRoomy = below >= RASTER * page && x1 - x0 >= 2 * RASTER * page && box.members.length > 1;
      if (isRoomy) {
        const edge = 5 * page,
          high = Math.min(below, 4 * RASTER * page, 4 * box.members.length * page);
        const where = [x0 + edge, y1 - edge - high, x1 - x0 - 2 * edge, high];
        this.past.draw(context, box.members, where, palette.channels, constants.levels);
        y1 -= high + edge;
      }
      fits.forEach((text, at) => {
        const down = (at - (fits.length - 1) / 2) * 1.25 + 0.36,
          size = this.fitted(context, text, room, at ? 400 : 600, family.join());
        if (size) context.fillText(text, middle, (y0 + y1) / 2 + down * NAMED * page);
      });
    }
    context.textAlign = 'start';
    context.globalAlpha = 1;
  }
}
