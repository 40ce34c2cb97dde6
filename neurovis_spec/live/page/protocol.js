/**
 * The protocol: the connection to the server, and what its messages mean (docs/live.md).
 */

import { NUMBERS } from './bands.js';
import { isStill } from './camera.js';

/** @typedef {{kind: string, at: number[], points: number[], size: number[], along: number[], colours: string[],
 *   dash: number[], flat?: boolean, font: number, radius: number, width: number, length: number, half: number, fill: string, stroke: string,
 *   opacity: number, end: number, text: string, subscript: string, anchor: string, weight: number, halo: string,
 *   onDisc: boolean, upward: boolean, columns: number, rows: number, pixels: string}} Shape */
/** @typedef {{id: string, data: Object<string, string>, title: string, shapes: Shape[]}} Group */
/** @typedef {Object<string, string>} Theme */
/** @typedef {{activity: number, signal: number, thickness: number, change: number, pathways: boolean}} Gains */
/** @typedef {{name: string, value: number, low: number | null, high: number | null, description: string, unit?: string}} Declared */
/** A turn: of which members it has, `type` decides.
 * @typedef {{step: number, type: string, name: string, neurons: string, part: string, connections: string, on: boolean,
 *   value: number, values: Object<string, number>, moving?: boolean, number: number, since?: number, back: {type: string} | null}} Turned */
/** @typedef {{families: string[], halo: number, subscriptDrop: number, subscriptSize: number, headOfLength: number,
 *   headOfWidth: number, headMore: number, notch: number, bar: number, lap: number, faint: number, levels: number,
 *   fineness: number, shares: number, share: number, isBar: number, isFaint: number, isNegative: number,
 *   isClamped: number, isUndefined: number, scale: number, left: number, top: number}} Constants */
/** @typedef {{version: number, name: string, title: string, width: number, height: number, density: number, network: number[],
 *   theme: Theme, dt: number | null,
 *   time: {step: number, unit: string} | null, discs: number, lines: number, parameters: Declared[],
 *   ranges: [number | null, number | null, number][], ranged: number[],
 *   inputs: {name: string, size: number, description: string}[], rules: {connections: string, rule: string}[], themes: string[],
 *   themed: boolean, pathways: boolean, window: string, named: string[][], names: number[], curves: Curve[], beside: {inputs: string[], sensors: string[], words: string[]}, order: number[], ends: number[][], bands: [number, string, number][], constants: Constants,
 *   told: string[], boxes: Object<string, number[]>, bundles: Bundles, groups: Group[]}} Scene */
/** Signals in one axis, by what they are asked for, the first in front, and their names.
 * @typedef {{items: string[], names: string[]}} Curve */
/** @typedef {{first: number, every: number, ranges: Map<string, Float32Array>}} Traces */
/** All connections of what is held: how many come into it, leave it, stay within, and are not drawn even so; those lines
 * that the picture leaves out.
 * @typedef {{of: string, inputs: number, outputs: number, within: number, undrawn: number, groups: Group[]}} Told */
/** The bundles that are added up, those of single connections and which these are, and how they are drawn: colours of what
 * excites, inhibits and does neither, added up and single.
 * @typedef {{joined: string[], lone: Object<string, number>, inks: string[][], widest: number, narrowest: number, most: number,
 *   signs: boolean}} Bundles */
/** The boxes that are closed, and the ends of what runs from and to these, boxes or neurons by their ids.
 * @typedef {{boxes: string[], ends: string[][]}} Joined */
/** The spikes of some neurons, a row each: in cells (rows × bins) the share that fires, in 254ths, 255 where nothing is known; the
 * names of the first and the last.
 * @typedef {{id: string, first: number, every: number, bins: number, rows: number, ends: string[], cells: Uint8Array}} Raster */
/** @typedef {{serial: number, step: number, first: number, last: number, caption: string, discs: Int8Array,
 *   lines: Int8Array, widths: Uint16Array, glows: Uint16Array, kinds: Uint8Array, pose: Float32Array, sums: Float32Array, added: Float32Array}} Look */
/** A number that moves the body: at which of its points, −1 for none; its name, the lowest and the highest that it can be,
 * where these are known. @typedef {[number, string, number | null, number | null]} Motor */
/** How the pose of a body is drawn: links are two points and a radius in metres, solids the lowest and the highest corner.
 * @typedef {{points: string[], links: number[][], feet: number[], middle: number,
 *   solids: [number[], number[]][]}} Skeleton */
/** What else the run has done behind a step: until which step, with what was turned, and what branches off from that.
 * A name where it was given one; one of an older spec cannot be gone to.
 * @typedef {{number: number, at: number, last: number, turned: Turned[], within: Future[], name: string, older: boolean}} Future */
/** @typedef {{type: 'status', playing: boolean, speed: string, ended: boolean, owner: boolean,
 *   can: {takes: string[], ends: boolean, arrives: boolean}, parameters: Object<string, number>, fed: Object<string, number[]>,
 *   learning: Object<string, boolean | null>, turned: Turned[], copied: string, events: number[], appearance: Gains, backend: string, futures: Future[], dropped: number, current: number, branch: string, compared: number | null, measures: {number: number, text: string}[], loop: number[] | null}} Status */
/** What is not finite: the first, since which step, or an earlier one that is not known, and how many are; '' where nothing is.
 * @typedef {{type: 'undefined', item: string, since: number, known: boolean, count: number}} Nonfinite */
/** Where a page stood; null of what it says nothing. @typedef {{step: number | null, speed: string | null, camera: number[] | 'whole' | null, curves: string[] | null,
 *   theme: string | null, closed: string[] | null, shows: string | null, window: string | null}} SavedView */
/** @typedef {Status | {type: 'views', file: string, views: Object<string, SavedView>, findings: string} | {type: 'values', step: number, values: Object<string, number | null>, other: Object<string, number | null>, lost: Object<string, number[]>, otherLost: Object<string, number[]>}
 *   | {type: 'body', skeleton: Skeleton | null, start: number[], motors: Motor[]}
 *   | {type: 'fitting', window: string | null, shown: string}
 *   | {type: 'making', done: number, total: number}
 *   | {type: 'findings', text: string, errors: boolean}
 *   | Nonfinite
 *   | {type: 'moved', discs: Object<string, number[]>, lines: Object<string, number[][]>}
 *   | {type: 'placed', neurons: string[], undo: boolean, files: boolean}
 *   | {type: 'saving', files: string[], diff: string, written: boolean, into: string}
 *   | {type: 'measured', text: string, findings: {start: number, end: number, message: string, hint: string}[]}
 *   | {type: 'refused', reason: string}} Message */
/** @typedef {{scene: (scene: Scene) => void, frame: () => void, aside: () => void, file: (name: string, blob: Blob) => void, traces: (traces: Traces) => void,
 *   left: (traces: Traces) => void, pairs: (traces: Traces) => void, leftPairs: (traces: Traces) => void,
 *   raster: (raster: Raster) => void, held: (told: Told) => void, joined: (joined: Joined) => void,
 *   text: (message: Message) => void, link: (open: boolean) => void}} Listener */

/** Where little is to move, frames are taken over so many milliseconds after each other: fewer than three flashes a second. */
const CALM = 400;
const SCENE = 1,
  FRAME = 2,
  TRACE = 3,
  FILE = 4,
  RASTER = 5,
  LEFT = 6,
  HELD = 7,
  KIND = 28,
  SUMS = 8,
  PAIRS = 11,
  LEFT_PAIRS = 13,
  JOINED = 9,
  ADDED = 10,
  ASIDE = 12,
  HEAD = 40;
/** Who is told of traces of these kinds. @type {Object<number, 'traces' | 'left' | 'pairs' | 'leftPairs'>} */
const TRACES = { [TRACE]: 'traces', [LEFT]: 'left', [PAIRS]: 'pairs', [LEFT_PAIRS]: 'leftPairs' };

/** Unpack what is compressed behind a head. @param {ArrayBuffer} buffer */
async function unzip(buffer) {
  const stream = new Blob([buffer.slice(4)]).stream().pipeThrough(new DecompressionStream('gzip'));
  return JSON.parse(await new Response(stream).text());
}

/** Unpack a scene. @param {ArrayBuffer} buffer @returns {Promise<Scene>} */
async function unpack(buffer) {
  const scene = await unzip(buffer);
  scene.version = new DataView(buffer).getUint16(2, true);
  return scene;
}

/** How a scene looks of which nothing has come yet. @param {Scene} scene @returns {Look} */
function blank({ lines, discs, bundles }) {
  return {
    serial: 0,
    step: 0,
    first: 0,
    last: 0,
    caption: '',
    discs: new Int8Array(discs),
    lines: new Int8Array(lines),
    widths: new Uint16Array(lines),
    glows: new Uint16Array(lines),
    kinds: new Uint8Array(lines + discs),
    pose: new Float32Array(0),
    added: new Float32Array(0),
    sums: new Float32Array(NUMBERS * bundles.joined.length),
  };
}

/** Take a frame over into a look; false where it is of another scene.
 * @param {ArrayBuffer} buffer @param {number} version @param {Look} look @returns {boolean} */
export function take(buffer, version, look) {
  const view = new DataView(buffer),
    lines = look.widths.length,
    discs = look.kinds.length - lines;
  if (view.getUint16(2, true) !== version) return false;
  look.serial = view.getUint32(4, true);
  const changed = view.getUint32(8, true),
    words = view.getUint16(36, true),
    numbers = view.getUint16(38, true);
  [look.step, look.first, look.last] = [12, 20, 28].map((at) => view.getFloat64(at, true));
  const items = new Uint32Array(buffer, HEAD, changed);
  const widths = new Uint16Array(buffer, HEAD + 4 * changed, changed);
  const glows = new Uint16Array(buffer, HEAD + 6 * changed, changed);
  const kinds = new Uint8Array(buffer, HEAD + 8 * changed, changed);
  for (let i = 0; i < changed; i++) {
    const item = items[i];
    look.kinds[item] = kinds[i];
    if (item < lines) {
      look.widths[item] = widths[i];
      look.glows[item] = glows[i];
    }
  }
  const colours = HEAD + 9 * changed;
  look.discs = new Int8Array(buffer, colours, discs);
  look.lines = new Int8Array(buffer, colours + discs, lines);
  const text = colours + discs + lines;
  look.caption = new TextDecoder().decode(new Uint8Array(buffer, text, words));
  look.pose = new Float32Array(buffer.slice(text + words, text + words + 4 * numbers));
  return true;
}

/** Take over what bundles add up to. @param {ArrayBuffer} buffer @param {Float32Array} sums */
function takeSums(buffer, sums) {
  const changed = new DataView(buffer).getUint32(4, true),
    rows = new Float32Array(buffer, 8 + 4 * changed);
  new Uint32Array(buffer, 8, changed).forEach((number, at) => {
    sums.set(rows.subarray(NUMBERS * at, NUMBERS * (at + 1)), NUMBERS * number);
  });
}

/** How a spec refers to a neuron or a connection. @param {Group['data']} data @returns {string} */
export const refOf = ({ neuron, connection, index }) =>
  neuron ?? (connection && Number(index) > 1 ? `${connection} (${index})` : connection);

/** The names of what a neuron or a connection has beside its activity or weight. @param {Scene | null} scene @param {string} id
 * @returns {string[]} */
export function namesOf(scene, id) {
  if (!scene || !/^[nc]\d+$/.test(id)) return [];
  const item = Number(id.slice(1)) + (id[0] === 'n' ? scene.lines : 0);
  return scene.named[scene.names[item] ?? 0];
}

/** Unpack traces: by id, with a name behind a point where there is one, the least and the largest value of each bin.
 * @param {ArrayBuffer} buffer @param {Scene} scene @returns {Traces} */
function unpackTraces(buffer, scene) {
  const view = new DataView(buffer),
    count = view.getUint32(4, true),
    bins = view.getUint32(20, true);
  const ranges = new Map();
  const which = new Uint32Array(buffer, 24 + 4 * count, count);
  new Uint32Array(buffer, 24, count).forEach((item, at) => {
    const { lines } = scene,
      kind = item >>> KIND,
      id = kind ? `${'?eims'[kind]}${item & ((1 << KIND) - 1)}` : item < lines ? `c${item}` : `n${item - lines}`,
      name = which[at] ? `.${namesOf(scene, id)[which[at] - 1]}` : '';
    ranges.set(id + name, new Float32Array(buffer, 24 + 8 * count + 8 * bins * at, 2 * bins));
  });
  return { first: view.getFloat64(8, true), every: view.getUint32(16, true), ranges };
}

/** Unpack a raster. @param {ArrayBuffer} buffer @param {Scene} scene @returns {Raster} */
function unpackRaster(buffer, scene) {
  const view = new DataView(buffer),
    bins = view.getUint32(20, true),
    [rows, words] = [24, 26].map((at) => view.getUint16(at, true));
  return {
    id: `n${view.getUint32(4, true) - scene.lines}`,
    first: view.getFloat64(8, true),
    every: view.getUint32(16, true),
    bins,
    rows,
    ends: new TextDecoder().decode(new Uint8Array(buffer, 28, words)).split('\n'),
    cells: new Uint8Array(buffer, 28 + words, rows * bins),
  };
}

/** What stands for the websocket where the page is in the frame of a notebook: the port that the frame is handed. */
class Handed {
  constructor() {
    /** @type {number} */
    this.readyState = WebSocket.CONNECTING;
    this.binaryType = 'arraybuffer';
    /** @type {MessagePort | null} */
    this.port = null;
    /** @type {() => void} */
    this.onopen = () => {};
    /** @type {() => void} */
    this.onclose = () => {};
    /** @type {(event: MessageEvent) => void} */
    this.onmessage = () => {};
    addEventListener(
      'message',
      (event) => {
        [this.port] = event.ports;
        this.readyState = WebSocket.OPEN;
        this.onopen();
        this.port.onmessage = (message) => this.onmessage(message);
      },
      { once: true },
    );
  }

  /** @param {string | Uint32Array<ArrayBuffer>} data */
  send(data) {
    if (this.port) this.port.postMessage(data);
  }
}

/** A connection that is made again whenever it is lost. */
export class Link {
  /** @param {Listener} listener */
  constructor(listener) {
    this.listener = listener;
    /** @type {Scene | null} */
    this.scene = null;
    /** @type {Look | null} */
    this.look = null;
    /** how the branch looks that is shown beside the run @type {Look | null} */
    this.other = null;
    /** the messages that change something and are taken @type {Set<string>} */
    this.takes = new Set();
    /** @type {WebSocket | Handed | null} */
    this.socket = null;
    /** called with what is asked @type {(type: string, more?: object) => void} */
    this.asked = () => {};
    this.wait = 250;
    this.work = Promise.resolve();
    /** when the last frame was taken over */
    this.taken = -Infinity;
    this.open();
  }

  /** Connect. */
  open() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    const url = `${scheme}://${location.host}/live${location.search}`;
    const socket = location.protocol === 'about:' ? new Handed() : new WebSocket(url);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      this.wait = 250;
      this.listener.link(true);
    };
    // one message after the other: a scene takes a while to unpack
    socket.onmessage = (event) => {
      const receive = () => this.receive(event.data);
      this.work = this.work.then(receive).catch((error) => console.error(error)); // the next may be well
    };
    socket.onclose = () => {
      this.listener.link(false);
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(4000, this.wait * 2);
    };
    this.socket = socket;
  }

  /** @param {string | ArrayBuffer} data */
  async receive(data) {
    if (typeof data === 'string') {
      this.listener.text(JSON.parse(data));
      return;
    }
    const kind = new Uint8Array(data)[0];
    if (kind === FRAME) {
      const wait = isStill() ? this.taken + CALM - performance.now() : 0;
      if (wait > 0)
        await new Promise((done) => {
          setTimeout(done, wait);
        });
      this.taken = performance.now();
    }
    if (kind === SCENE) {
      this.scene = await unpack(data);
      this.look = blank(this.scene);
      this.other = null;
      this.listener.scene(this.scene);
    } else if (kind === FRAME && this.scene && this.look && take(data, this.scene.version, this.look)) {
      this.listener.frame();
    } else if (kind === ASIDE) {
      this.aside(data.slice(4));
    } else if (kind === FILE) {
      const from = 4 + new DataView(data).getUint16(2, true);
      this.listener.file(new TextDecoder().decode(data.slice(4, from)), new Blob([data.slice(from)]));
    } else if (this.scene && this.look && new DataView(data).getUint16(2, true) === this.scene.version) {
      await this.more(kind, data, this.scene, this.look);
    }
  }

  /** What belongs to the scene that is shown. @param {number} kind @param {ArrayBuffer} data @param {Scene} scene @param {Look} look */
  async more(kind, data, scene, look) {
    const traced = TRACES[kind];
    if (traced) this.listener[traced](unpackTraces(data, scene));
    else if (kind === RASTER) this.listener.raster(unpackRaster(data, scene));
    else if (kind === SUMS) takeSums(data, look.sums);
    else if (kind === ADDED) takeSums(data, look.added);
    else if (kind === HELD) this.listener.held(await unzip(data));
    else if (kind === JOINED) {
      const joined = await unzip(data);
      look.added = new Float32Array(NUMBERS * joined.ends.length);
      this.listener.joined(joined);
    }
  }

  /** Of the branch that is shown beside the run a frame has come, or what is added up. @param {ArrayBuffer} data */
  aside(data) {
    const { scene } = this,
      kind = new Uint8Array(data)[0];
    if (!scene || new DataView(data).getUint16(2, true) !== scene.version) return;
    this.other ??= blank(scene);
    if (kind === SUMS) takeSums(data, this.other.sums);
    else if (kind === ADDED) {
      this.other.added = new Float32Array(NUMBERS * new DataView(data).getUint32(4, true));
      takeSums(data, this.other.added);
    } else if (kind === FRAME && take(data, scene.version, this.other)) this.listener.aside();
  }

  /** Ask for something. @param {string} type @param {object} [more] */
  ask(type, more) {
    if (!this.socket || this.socket.readyState !== WebSocket.OPEN) return;
    this.asked(type, more);
    this.socket.send(JSON.stringify({ type, ...more }));
  }

  /** Say that the latest frame has been drawn. */
  drawn() {
    if (this.look && this.socket && this.socket.readyState === WebSocket.OPEN) {
      this.socket.send(new Uint32Array([this.look.serial]));
    }
  }
}
