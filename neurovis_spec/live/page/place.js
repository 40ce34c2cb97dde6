/**
 * Placing: a neuron is dragged, its mirror image and the routes follow, and what was put by hand is saved or undone.
 */

/** @typedef {import('./protocol.js').Status} Status */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Scene} Scene */
/** Where a group stands: of a disc and its label the points, of a line its points and the tip of its head.
 * @typedef {{at: number[][], points: number[], along: number[], isBoth?: boolean}} Stand of a line whether it has a head
 *   at either end, the other one as its third shape */
/** @typedef {{neurons: string[], undo: boolean, files: boolean}} Put */
/** @typedef {{discs: Object<string, number[]>, lines: Object<string, number[][]>}} Moved */

/** How far a key moves a neuron, in units of the layout. */
const KEYSTEP = 0.125;

/** The neurons from and to which a line or a dotted line runs. @param {Group} group @returns {string[]} */
const endsOf = ({ data: { signal, from, to } }) => (signal === undefined ? [from, to] : signal.split(' -> '));

/** A line whose ends are elsewhere. @param {Stand} stand @param {number[] | null} start by how much @param {number[] | null} end
 * @returns {Stand} */
function bent({ at, points, along, isBoth }, start, end) {
  const last = points.length / 2 - 1;
  const shift = (/** @type {number} */ value, /** @type {number} */ axis, /** @type {number} */ share) =>
    value + (1 - share) * (start ? start[axis] : 0) + share * (end ? end[axis] : 0);
  const shareAt = (/** @type {number} */ place) => (place === 1 ? 1 : place === 2 && isBoth ? 0 : 0.5);
  return {
    along,
    isBoth,
    at: at.map((point, place) => point?.map((value, axis) => shift(value, axis, shareAt(place)))),
    points: points.map((value, place) => shift(value, place & 1, (place >> 1) / last)),
  };
}

/** Neurons put by hand. */
export class Placing {
  /** @param {Link} link @param {() => boolean} drawn whether there is a picture, in which something can stand elsewhere
   * @param {(group?: Group) => void} redraw @param {(id: string) => HTMLElement} find */
  constructor(link, drawn, redraw, find) {
    this.link = link;
    this.drawn = drawn;
    this.redraw = redraw;
    this.find = find;
    this.owner = false;
    /** what is put by hand @type {Put} */
    this.put = { neurons: [], undo: false, files: false };
    /** @type {Map<string, Group>} */
    this.groups = new Map();
    /** the neuron that is dragged, and where to, in units of the picture */
    this.dragged = '';
    this.at = [0, 0];
    /** the last place that was sent, and whether its answer is still awaited */
    this.sent = [NaN, NaN];
    this.waiting = false;
    /** where everything stands in the scene, and by the last answer @type {Map<string, Stand>} */
    this.first = new Map();
    /** @type {Map<string, Stand>} */
    this.last = new Map();
    find('unplace').onclick = () => this.undo();
    find('tospec').onclick = () => this.link.ask('save', { into: 'spec' });
    find('tofile').onclick = () => this.link.ask('save', { into: 'file' });
    find('write').onclick = () => this.link.ask('write');
    find('leave').onclick = () => this.dialog.close();
  }

  /** @returns {HTMLDialogElement} */
  get dialog() {
    return /** @type {HTMLDialogElement} */ (this.find('saving'));
  }

  /** Another network, or another layout of it. @param {Scene} scene */
  use(scene) {
    this.groups = new Map(scene.groups.map((group) => [group.id, group]));
    this.first.clear();
    this.last.clear();
    this.dragged = '';
    this.waiting = false;
  }

  /** More lines are drawn, which follow, too. @param {Group[]} groups */
  more(groups) {
    for (const group of groups) this.groups.set(group.id, group);
  }

  /** Whether this can be dragged, to ask for that. @param {string} id @param {string} [asks] @returns {boolean} */
  can(id, asks = 'place') {
    return this.owner && this.link.takes.has(asks) && /^n\d/.test(id) && this.constants.scale > 0 && this.drawn();
  }

  /** Where layout units lie. @returns {{scale: number, left: number, top: number}} */
  get constants() {
    return this.link.scene?.constants ?? { scale: 0, left: 0, top: 0 };
  }

  /** How a group stands now. @param {string} id @returns {Stand} */
  stand(id) {
    const { shapes } = /** @type {Group} */ (this.groups.get(id));
    const along = shapes[0].points && shapes[1].along;
    const isBoth = Boolean(along) && shapes[2]?.kind === 'head';
    return { at: shapes.map(({ at }) => at), points: shapes[0].points, along, isBoth };
  }

  /** Have a group stand so. @param {string} id @param {Stand} stand */
  set(id, stand) {
    const group = /** @type {Group} */ (this.groups.get(id)),
      { shapes } = group;
    if (!this.first.has(id)) this.first.set(id, this.stand(id));
    shapes.forEach((shape, place) => {
      shape.at = stand.at[place];
    });
    if (stand.points) [shapes[0].points, shapes[1].along] = [stand.points, stand.along];
    if (stand.isBoth) {
      const [dx, dy] = [0, 1].map((axis) => shapes[2].at[axis] - stand.points[axis]),
        far = Math.hypot(dx, dy) || 1;
      shapes[2].along = [dx / far, dy / far];
    }
    this.redraw(group);
  }

  /** How a group stands by the last answer, else in the scene. @param {string} id @returns {Stand} */
  known(id) {
    return this.last.get(id) || this.first.get(id) || this.stand(id);
  }

  /** Drag a neuron to a point of the picture. @param {string} id @param {number[]} at */
  drag(id, at) {
    [this.dragged, this.at] = [id, at];
    this.follow();
    if (!this.waiting) this.send(false);
  }

  /** The disc at the pointer, and the lines from and to it on the way to their routes. */
  follow() {
    const id = this.dragged,
      { neuron } = /** @type {Group} */ (this.groups.get(id)).data,
      from = this.known(id);
    const by = [0, 1].map((axis) => this.at[axis] - from.at[0][axis]);
    this.set(id, { ...from, at: from.at.map((point) => point?.map((value, axis) => value + by[axis])) });
    for (const [line, group] of this.groups) {
      const [start, end] = endsOf(group).map((name) => (name === neuron ? by : null));
      if (start || end) this.set(line, bent(this.known(line), start, end));
    }
    this.redraw();
  }

  /** Say where the neuron is, and whether it stays there. @param {boolean} done */
  send(done) {
    const { scale, left, top } = this.constants;
    const at = [(this.at[0] - left) / scale, (this.at[1] - top) / scale].map((value) => Number(value.toFixed(4)));
    this.sent = this.at;
    this.waiting = true;
    this.link.ask('place', { neuron: /** @type {Group} */ (this.groups.get(this.dragged)).data.neuron, at, done });
  }

  /** Leave the neuron where it is. */
  drop() {
    if (!this.dragged) return;
    this.send(true);
    this.dragged = '';
  }

  /** Let the neuron stand where it was. */
  cancel() {
    this.dragged = '';
    this.waiting = false;
    for (const [id, stand] of this.first) this.set(id, stand);
    this.last.clear();
    this.redraw();
  }

  /** Move a neuron by steps. @param {string} id @param {number} across @param {number} down */
  step(id, across, down) {
    if (!this.can(id)) return;
    const [x, y] = this.stand(id).at[0],
      by = KEYSTEP * this.constants.scale;
    this.drag(id, [x + across * by, y + down * by]);
    this.drop();
  }

  /** Undo the last placing. */
  undo() {
    this.link.ask('unplace');
  }

  /** Where everything would be. @param {Moved} moved */
  take(moved) {
    if (!this.dragged) return;
    this.waiting = false;
    for (const id of this.last.keys()) {
      const stand = this.first.get(id);
      if (stand && !(id in moved.discs || id in moved.lines)) this.set(id, stand);
    }
    this.last.clear();
    /** @type {Map<string, number[]>} */
    const by = new Map();
    for (const [id, [x, y]] of Object.entries(moved.discs)) {
      const from = this.first.get(id) || this.stand(id),
        [a, b] = from.at[0];
      by.set(/** @type {Group} */ (this.groups.get(id)).data.neuron, [x - a, y - b]);
      this.last.set(id, { ...from, at: from.at.map((point) => point && [point[0] + x - a, point[1] + y - b]) });
    }
    // of the dotted lines nothing is told
    for (const [id, group] of this.groups) {
      if (group.data.signal === undefined) continue;
      const [start, end] = endsOf(group).map((name) => by.get(name) ?? null);
      if (start || end) this.last.set(id, bent(this.first.get(id) || this.stand(id), start, end));
    }
    for (const [id, [points, tip, along, tail]] of Object.entries(moved.lines)) {
      const { at, isBoth } = this.first.get(id) || this.stand(id),
        heads = isBoth ? [tip, tail] : [tip];
      this.last.set(id, { at: [at[0], ...heads, ...at.slice(1 + heads.length)], points, along, isBoth });
    }
    for (const [id, stand] of this.last) this.set(id, stand);
    this.follow();
    if (this.sent[0] !== this.at[0] || this.sent[1] !== this.at[1]) this.send(false);
  }

  /** @param {Status} status */
  status(status) {
    this.owner = status.owner;
    this.told(this.put);
  }

  /** What is put by hand. @param {Put} put */
  told(put) {
    const { find } = this,
      { neurons, undo, files } = put;
    this.put = put;
    find('placed').textContent = neurons.join(', ');
    const off = { unplace: !undo, tospec: !(files && neurons.length), tofile: !(files && neurons.length) };
    for (const [id, no] of Object.entries(off)) {
      /** @type {HTMLButtonElement} */ (find(id)).disabled = no || !this.owner;
    }
  }

  /** What would be written, or was. @param {{files: string[], diff: string, written: boolean, into: string}} saving */
  saving(saving) {
    const { dialog, find } = this;
    find('diff').textContent = saving.diff || 'nothing has changed';
    find('write').hidden = !saving.diff;
    find('download').hidden = saving.into !== 'events';
    if (saving.written) {
      dialog.close();
    } else if (!dialog.open) {
      dialog.showModal();
    }
  }
}
