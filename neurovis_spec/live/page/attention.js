/**
 * Attention: what is pointed at, and what is held; its values, and what stands out with it.
 */

import { Bands, count, restOf } from './bands.js';
import { isBeside } from './beside.js';
import { halfway } from './marks.js';
import { say } from './say.js';
import { Sized } from './sized.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./zoom.js').Zoom} Zoom */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Told} Told */

/** A number with its sign, for what is not told by colour alone. @param {number | null} value @returns {string} */
export function signed(value) {
  if (value === null) return 'not finite';
  return (value > 0 ? '+' : '') + String(Number(value.toPrecision(6))).replace('-', '−');
}

/** The sides of a place on which a tooltip can be, the best first, how far it is from there, and the steps in which room is
 * kept for it, in pixels of a page. */
const SIDES = [
    [1, 1],
    [-1, 1],
    [1, -1],
    [-1, -1],
  ],
  GAP = 14,
  COARSE = 32;
/** The id of a neuron or a connection. */
const ITEM = /^[nc]\d+$/;

/** Points along a cubic spline. @param {number[]} points @returns {number[][]} */
export function along(points) {
  const found = [];
  for (let first = 0; first + 7 < points.length; first += 6) {
    for (let t = 0; t < 1; t += 1 / 16) {
      const shares = [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t ** 3];
      found.push([0, 1].map((axis) => shares.reduce((sum, by, at) => sum + by * points[first + 2 * at + axis], 0)));
    }
  }
  return found;
}

/** What is so, and in which of two branches; nothing where it is in neither. @param {string[]} words of the run, and of the
 * branch beside it, '' where it is not so @param {Look | null} other that branch, if there is one @returns {string[]} */
function where([inA, inB], other) {
  const each = !other || inA === inB ? [inA] : [inA && `${inA} in A`, inB && `${inB} in B`];
  return each.filter(Boolean);
}

/** What is pointed at and what is held, by the ids of their groups, '' for nothing. */
export class Attention {
  /** @param {Link} link @param {Zoom} zoom @param {() => void} changed called when something else is to be seen
   * @param {(group: Group | undefined) => void} taken called with what is held */
  constructor(link, zoom, changed, taken) {
    this.taken = taken;
    this.zoom = zoom;
    /** what else the values are wanted of @type {string[]} */
    this.listed = [];
    /** whether what is held is to be said as soon as its value is known */
    this.saying = false;
    this.link = link;
    this.changed = changed;
    this.pointed = '';
    this.held = '';
    /** what else it wants the values of @type {string[]} */
    this.also = [];
    /** where a picture of another kind has something, in units @type {((id: string) => number[]) | null} */
    this.spot = null;
    /** neurons and connections, those that the picture leaves out as soon as they were held @type {Map<string, Group>} */
    this.groups = new Map();
    /** bundles and boxes @type {Map<string, Group>} */
    this.others = new Map();
    /** @type {Bands | null} */
    this.bands = null;
    /** what is told of all connections of what is held, and what is to be held as soon as it is told of
     * @type {Told | null} */
    this.all = null;
    this.coming = '';
    /** the dotted lines from neurons to rules @type {Group[]} */
    this.signals = [];
    /** the ids of what stands out with what is held @type {Set<string>} */
    this.near = new Set();
    /** @type {Object<string, number | null>} */
    this.values = {};
    /** those of the branch beside the run @type {Object<string, number | null>} */
    this.other = {};
    /** of what is lesioned in part how many of how many are, in the run and in the branch beside it
     * @type {Object<string, number[]>[]} */
    this.lost = [{}, {}];
    /** where the picture of the run stands; and that which is pointed at, where it is another */
    this.stands = new Sized(/** @type {HTMLElement} */ (document.getElementById('picture')), changed);
    /** @type {Sized | null} */
    this.over = null;
    /** where the pointer is, in units @type {number[]} */
    this.place = [0, 0];
    /** on which side of its place the tooltip is, and for what that was found */
    this.side = SIDES[0];
    this.beside = '';
    this.tip = /** @type {HTMLElement} */ (document.getElementById('tip'));
  }

  /** Another network; what has the same name in it stays held. @param {Scene} scene */
  use(scene) {
    const { held } = this,
      before = this.groups.get(held),
      name = before && JSON.stringify(before.data),
      of = (/** @type {RegExp} */ kind) =>
        new Map(scene.groups.filter(({ id }) => kind.test(id)).map((group) => [group.id, group]));
    this.groups = of(ITEM);
    this.bands = new Bands(scene);
    this.others = of(/^(box|instance|bundle):/);
    this.signals = scene.groups.filter(({ data }) => data.signal !== undefined);
    this.pointed = '';
    const same = [...this.groups.values()].find(({ data }) => JSON.stringify(data) === name);
    this.hold(same ? same.id : this.others.has(held) ? held : '');
  }

  /** Ask for the values of what is shown. */
  ask() {
    this.link.ask('look', { items: this.wanted() });
  }

  /** The ids of neurons, connections and what is beside them whose values are shown, of what they have with its name. @returns {string[]} */
  wanted() {
    const all = new Set([this.pointed, this.held, ...this.also, ...this.listed]);
    return [...all].filter((id) => isBeside(id) || this.isKnown(id.split('.')[0])).slice(0, 64);
  }

  /** Whether there is such a neuron or connection, drawn or not. @param {string} id @returns {boolean} */
  isKnown(id) {
    const { scene } = this.link;
    return this.groups.has(id) || (/^c\d+$/.test(id) && scene !== null && Number(id.slice(1)) < scene.lines);
  }

  /** @param {string} id @param {number[]} place @param {Sized | null} [over] another picture of the same */
  point(id, place, over = null) {
    [this.place, this.over] = [place, over];
    if (id !== this.pointed) {
      this.pointed = id;
      this.ask();
    }
    this.changed();
  }

  /** Hold a neuron, a connection, a bundle or a box; '' lets go. All its connections are asked for, and what the picture
   * leaves out is held as soon as it is told of. @param {string} id */
  hold(id) {
    if (id) this.link.ask('connections', { of: id });
    this.coming = id;
    if (!id || this.groups.has(id) || this.others.has(id)) this.keep(id);
  }

  /** Something is held. @param {string} id */
  keep(id) {
    this.held = id;
    if (this.all && this.all.of !== id) this.all = null;
    this.near = new Set(id ? this.around(id) : []);
    this.saying = id !== '';
    this.ask();
    this.taken(this.groups.get(id));
    this.changed();
  }

  /** What is drawn is other than before: find what stands out. */
  renew() {
    if (this.held) this.near = new Set(this.around(this.held));
    this.changed();
  }

  /** All connections of what is held are told. @param {Told} told @returns {boolean} whether it still is */
  tell(told) {
    if (told.of !== this.coming) return false;
    for (const group of told.groups) this.groups.set(group.id, group);
    this.all = told;
    if (told.of === this.held) {
      this.renew();
      this.speak();
    } else if (this.groups.has(told.of) || this.others.has(told.of)) {
      this.keep(told.of);
    }
    return true;
  }

  /** The next neuron, or the one before. @param {number} by */
  next(by) {
    const neurons = [...this.groups.keys()].filter((id) => id[0] === 'n');
    const at = neurons.indexOf(this.held);
    if (neurons.length)
      this.hold(neurons[(at < 0 ? (by > 0 ? 0 : neurons.length - 1) : at + by + neurons.length) % neurons.length]);
  }

  /** The names of the neurons of what can be held: one, those in a box, or none. @param {string} id @returns {Set<string>} */
  within(id) {
    const inside = this.link.scene?.boxes[id]?.map((index) => `n${index}`) ?? [id];
    return new Set(inside.flatMap((one) => this.groups.get(one)?.data.neuron ?? []));
  }

  /** What the inputs and outputs of neurons are, or the ends of connections. @param {string} id @returns {string[]} */
  around(id) {
    const own = this.within(id),
      all = [...this.groups.values()],
      told = this.others.has(id) && this.all ? this.all.groups : [];
    const lines = own.size
      ? all.filter((line) => own.has(line.data.from) || own.has(line.data.to))
      : [this.groups.get(id), ...told];
    const dotted = this.signals.filter((signal) => signal.data.signal.split(' -> ').some((end) => own.has(end)));
    const ends = new Set(lines.flatMap((line) => (line ? [line.data.from, line.data.to] : [])));
    for (const signal of dotted) for (const end of signal.data.signal.split(' -> ')) ends.add(end);
    const discs = all.filter(
      ({ data }) => data.neuron !== undefined && (ends.has(data.neuron) || own.has(data.neuron)),
    );
    // what runs from and to closed boxes
    const boxes = new Set([id, ...[...own].flatMap((name) => this.zoom.around.get(name)?.id ?? [])]);
    const joined = (this.zoom.joined?.ends ?? []).flatMap((pair, at) =>
      pair.some((end) => boxes.has(end)) ? [`joined:${at}`] : [],
    );
    return [id, ...joined, ...[...lines, ...dotted, ...discs].map((group) => (group ? group.id : ''))];
  }

  /** @param {{values: Object<string, number | null>, other: Object<string, number | null>,
   *   lost: Object<string, number[]>, otherLost: Object<string, number[]>}} message */
  take(message) {
    [this.values, this.other] = [message.values, message.other];
    this.lost = [message.lost, message.otherLost];
    this.speak();
    this.changed();
  }

  /** Have what is held be read, once all is known of it. */
  speak() {
    const { look } = this.link;
    if (this.saying && look && this.all && (this.held in this.values || this.others.has(this.held))) {
      this.saying = false;
      this.say(look);
    }
  }

  /** Have a screen reader read what is held. @param {Look} look */
  say(look) {
    if (this.held) say(this.words(this.held, look).replaceAll('\n', ', '));
  }

  /** What is said of all connections of what is held. @param {string} id @returns {string[]} */
  counts(id) {
    if (!this.all || this.all.of !== id) return [];
    const { inputs, outputs, within, undrawn } = this.all,
      among = id[0] === 'n' ? 'to itself' : 'within',
      all = inputs + outputs + within;
    return [
      ...(this.within(id).size
        ? [`connections ${count(inputs)} in, ${count(outputs)} out${within ? `, ${count(within)} ${among}` : ''}`]
        : []),
      ...(undrawn ? [`${count(undrawn)} of ${count(all)}, the weakest, are not drawn`] : []),
    ];
  }

  /** What is said of a neuron, a connection, a bundle or a box: name, activity, the state that it shows, or weight, delay, rule. @param {string} id @param {Look} look
   * @returns {string} */
  words(id, look) {
    return [this.itself(id, look), ...this.counts(id)].filter(Boolean).join('\n');
  }

  /** The same without its connections. @param {string} id @param {Look} look @returns {string} */
  itself(id, look) {
    const group = this.groups.get(id) ?? this.unseen(id);
    const other = this.link.other?.serial ? this.link.other : null;
    const bundle = /^(bundle|joined):/.test(id) && (this.others.get(id) ?? this.zoom.joins(id));
    if (bundle) return this.bands?.words(bundle, look, other) ?? '';
    if (!group) return this.zoom.words(id, look, other);
    const [name, ...more] = group.title.split('\n'),
      { neuron, delay, state } = group.data;
    const what = neuron === undefined ? 'weight' : (state ?? 'activity'),
      beside = id in this.other ? `, in B ${signed(this.other[id])}` : '',
      told = id in this.values ? [`${what} ${signed(this.values[id])}${beside}`] : [];
    if (delay !== undefined && !more.some((line) => line.startsWith('delay '))) told.push(`delay ${delay}`);
    return [name, ...told, ...more, ...this.states(id, look, other)].join('\n');
  }

  /** Whether a neuron is clamped, and whether it or a connection is lesioned, or so many of those that it stands for.
   * @param {string} id @param {Look} look @param {Look | null} other of the branch beside it @returns {string[]} */
  states(id, look, other) {
    const isNeuron = id[0] === 'n',
      place = Number(id.slice(1)) + (isNeuron ? look.widths.length : 0),
      { isClamped = 0, isFaint = 0 } = this.link.scene?.constants ?? {},
      kinds = [look, other].map((one) => one?.kinds[place] ?? 0);
    const clamped = kinds.map((kind) => (isNeuron && kind & isClamped ? 'clamped' : '')),
      lesioned = kinds.map((kind, at) => {
        const part = this.lost[at][id];
        return kind & isFaint ? 'lesioned' : part ? `${count(part[0])} of ${count(part[1])} lesioned` : '';
      });
    return [...where(clamped, other), ...where(lesioned, other)];
  }

  /** What is known of a connection that the picture leaves out, or draws as a bundle. @param {string} id @returns {Group | null} */
  unseen(id) {
    const { scene } = this.link;
    if (!scene || !this.isKnown(id)) return null;
    const [from, to] = scene.ends.map((ends) => this.groups.get(`n${ends[Number(id.slice(1))]}`)?.data.neuron ?? '');
    const more = restOf(this.others.get(this.bands?.bundleOf(id) ?? ''));
    return { id, data: { from, to }, title: [`${from} → ${to}`, ...more].join('\n'), shapes: [] };
  }

  /** Where a neuron is, the tip of a connection, the middle of a bundle, the corner of a box. @param {string} id
   * @returns {number[]} */
  middle(id) {
    if (this.spot && ITEM.test(id)) return this.spot(id);
    const [first, second] = (this.groups.get(id) ?? this.others.get(id))?.shapes ?? [];
    return (/^c/.test(id) ? second?.at : first?.at) ?? (first?.points ? halfway(first.points) : [0, 0]);
  }

  /** Points of the lines that are told of: a connection's, or those of a neuron's inputs and outputs, and their discs.
   * @param {string} id @returns {number[][]} */
  told(id) {
    const group = this.groups.get(id);
    if (!group) return [];
    const shown = group.data.neuron === undefined ? [id] : id === this.held ? [...this.near] : this.around(id);
    return shown.flatMap((one) => {
      const [{ at, points }] = this.groups.get(one)?.shapes ?? [{}];
      return points ? along(points) : at ? [at] : [];
    });
  }

  /** Show the tooltip, where it covers least of what it tells of, beside what is pointed at, or else held. @param {Camera} camera @param {Look} look */
  show(camera, look) {
    const id = this.pointed || this.held,
      words = this.words(id, look),
      { tip } = this;
    tip.hidden = !words;
    if (!words) return;
    if (tip.textContent !== words) tip.textContent = words;
    const [x, y] = this.pointed ? this.place : this.middle(id);
    const at = camera.pixel(x, y).map((pixel) => pixel / devicePixelRatio);
    // as large as it may become while numbers change, so that it stays on its side
    const [room, size] = [COARSE, 1].map((grain) =>
      [tip.offsetWidth, tip.offsetHeight].map((length) => Math.ceil(length / grain) * grain),
    );
    const edge = camera.window.map((length) => length / devicePixelRatio);
    const key = [id, at, room, edge, camera.scale].join();
    if (key !== this.beside) {
      this.beside = key;
      const points = this.spot ? [] : this.told(id).map((point) => camera.pixel(point[0], point[1]));
      let least = Infinity;
      for (const side of SIDES) {
        const [left, top] = side.map((way, axis) => at[axis] + (way < 0 ? -GAP - room[axis] : GAP));
        const [right, bottom] = [left + room[0], top + room[1]];
        let covered = left < 0 || top < 0 || right > edge[0] || bottom > edge[1] ? points.length + 1 : 0;
        for (const point of points) {
          const [x, y] = point.map((pixel) => pixel / devicePixelRatio);
          if (x > left && x < right && y > top && y < bottom) covered++;
        }
        if (covered < least) [least, this.side] = [covered, side];
      }
    }
    const [across, down] = this.side.map((way, axis) =>
      Math.max(0, Math.min(at[axis] + (way < 0 ? -GAP - size[axis] : GAP), edge[axis] - size[axis])),
    );
    const { left, top } = (this.pointed && this.over) || this.stands;
    tip.style.transform = `translate(${Math.round(left + across)}px, ${Math.round(top + down)}px)`;
  }
}
