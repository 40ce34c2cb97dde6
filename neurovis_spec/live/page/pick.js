/**
 * Picking: which neuron or connection lies under a pointer.
 */

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./draw.js').Drawing} Drawing */
/** @typedef {import('./protocol.js').Look} Look */

/** How far from a line, in pixels of a page, a pointer may be. */
const NEAR = 5;

/** The id of the neuron or the connection under a pixel, '' for none; neurons lie above connections.
 * @param {CanvasRenderingContext2D} context @param {Drawing} drawing @param {Camera} camera @param {Look} look
 * @param {number} x @param {number} y @returns {string} */
export function under(context, drawing, camera, look, x, y) {
  const [across, down] = camera.unit(x, y), near = (NEAR * devicePixelRatio) / camera.scale;
  for (const { index, shape } of drawing.discs.slice().reverse()) {
    const reach = Math.max(shape.radius, near);
    if (Math.hypot(across - shape.at[0], down - shape.at[1]) <= reach) return `n${index}`;
  }
  const close = drawing.lines.filter(({ box, index }) => {
    const room = near + look.widths[index] / drawing.constants.fineness;
    return across > box[0] - room && across < box[2] + room && down > box[1] - room && down < box[3] + room;
  }).reverse();
  context.save();
  context.setTransform(1, 0, 0, 1, 0, 0);
  let found = '';
  // what is drawn under the pixel first, then what is close by
  for (const more of [0, near / 2, near]) {
    for (const { index, path } of found ? [] : close) {
      context.lineWidth = look.widths[index] / drawing.constants.fineness + 2 * more;
      if (context.isPointInStroke(path, across, down)) {
        found = `c${index}`;
        break;
      }
    }
  }
  context.restore();
  return found;
}
