/**
 * Marks: what is lesioned is crossed out, so that it is not told by how faint it is alone; a neuron whose activity is no
 * finite number, which no colour tells, has a question mark.
 */

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {{group: Group, item: number, ends: number[]}} Mark */

/** How far the arms of a cross reach: in a disc, as a share of its radius; on a line, in pixels of a page; and how high a
 * question mark is at least, in these. */
const IN_DISC = 0.6,
  ON_LINE = 5,
  HIGH = 14;

/** The middle of a cubic spline. @param {number[]} points @returns {number[]} */
export function halfway(points) {
  const pieces = (points.length - 2) / 6,
    first = 6 * Math.floor(pieces / 2);
  return [0, 1].map((axis) => {
    const [a, b, c, d] = [0, 2, 4, 6].map((further) => points[first + further + axis]);
    return pieces % 2 ? (a + 3 * b + 3 * c + d) / 8 : a;
  });
}

/** The marks of a network. */
export class Marks {
  /** @param {Scene} scene */
  constructor(scene) {
    this.scene = scene;
    /** @type {Map<string, number>} */
    const items = new Map();
    for (const { id, data } of scene.groups)
      if (data.neuron !== undefined) items.set(data.neuron, scene.lines + Number(id.slice(1)));
    /** @type {Mark[]} */
    this.marks = scene.groups.flatMap((group) => {
      const { id, data } = group;
      if (data.neuron !== undefined) return [{ group, item: items.get(data.neuron) ?? 0, ends: [] }];
      const single = scene.bundles.lone[id];
      if (data.connection === undefined && single === undefined) return [];
      const ends = (data.pathway?.split(' -> ') ?? [data.from, data.to]).flatMap((name) => items.get(name) ?? []);
      return [{ group, item: single ?? Number(id.slice(1)), ends }];
    });
  }

  /** Cross out what is lesioned, but no line of a neuron that is. What recedes does so with its cross.
   * @param {CanvasRenderingContext2D} context @param {Camera} camera @param {Look} look @param {Set<string>} near */
  draw(context, camera, look, near) {
    const { constants, theme } = this.scene,
      [left, top] = camera.origin;
    const gone = (/** @type {number} */ item) => (look.kinds[item] & constants.isFaint) !== 0;
    context.setTransform(1, 0, 0, 1, 0, 0);
    for (const { group, item, ends } of this.marks) {
      const { id, shapes } = group,
        [{ at: middle, points, radius }] = shapes,
        isUndefined = !points && (look.kinds[item] & constants.isUndefined) !== 0;
      if (!(gone(item) || isUndefined) || ends.some(gone)) continue;
      const at = points ? halfway(points) : middle,
        reach = points ? 0 : IN_DISC * radius;
      const x = left + at[0] * camera.scale,
        y = top + at[1] * camera.scale;
      const arm = reach * camera.scale || ON_LINE * devicePixelRatio;
      context.globalAlpha = near.size && !near.has(id) ? 0.3 : 1;
      if (isUndefined) {
        const [across, down] = [x + 0.7 * radius * camera.scale, y - 0.7 * radius * camera.scale];
        context.font = `bold ${Math.max(HIGH * devicePixelRatio, radius * camera.scale)}px sans-serif`;
        [context.strokeStyle, context.fillStyle] = [theme.background, theme.ink];
        context.lineWidth = 5 * devicePixelRatio;
        context.strokeText('?', across, down);
        context.fillText('?', across, down);
      }
      if (!gone(item)) continue;
      context.beginPath();
      for (const [across, down] of [
        [-1, -1],
        [1, -1],
        [1, 1],
        [-1, 1],
      ]) {
        const inner = reach ? arm / 2 : 0; // which leaves room for a label
        context.moveTo(x + across * inner, y + down * inner);
        context.lineTo(x + across * arm, y + down * arm);
      }
      /** @type {[string, number][]} */
      const strokes = [
        [theme.background, 5],
        [theme.ink, 2],
      ];
      for (const [colour, width] of strokes) {
        context.strokeStyle = colour;
        context.lineWidth = width * devicePixelRatio;
        context.stroke();
      }
    }
    context.globalAlpha = 1;
  }
}
