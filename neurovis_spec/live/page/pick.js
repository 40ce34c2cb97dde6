/**
 * Picking: which neuron or connection lies under a pointer.
 */

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./draw.js').Drawing} Drawing */

/** How far from a line, in pixels of a page, a pointer may be. */
const NEAR = 5;

/** How far a point is from a curve. @param {import('./coverage.js').Chain} chain @param {number} x @param {number} y
 * @returns {number} */
function distance({ at, parts }, x, y) {
  let least = Infinity;
  for (let i = 0; i < 2 * parts; i += 2) {
    const dx = at[i + 2] - at[i],
      dy = at[i + 3] - at[i + 1],
      right = x - at[i],
      down = y - at[i + 1];
    const part = Math.min(1, Math.max(0, (right * dx + down * dy) / (dx * dx + dy * dy)));
    least = Math.min(least, Math.hypot(right - part * dx, down - part * dy));
  }
  return least;
}

/** The id of the neuron or the connection under a pixel, '' for none; neurons lie above connections, and what is drawn
 * there is before what is close by. @param {Drawing} drawing @param {Camera} camera
 * @param {number} x @param {number} y @returns {string} */
export function under(drawing, camera, x, y) {
  const [across, down] = camera.unit(x, y),
    near = (NEAR * devicePixelRatio) / camera.scale;
  for (const { id, shape } of drawing.discs.slice().reverse()) {
    if (Math.hypot(across - shape.at[0], down - shape.at[1]) <= Math.max(shape.radius, near)) return id;
  }
  const { scale, origin } = drawing.seen;
  let found = '',
    least = near;
  for (const { id, laid } of drawing.lines.slice().reverse()) {
    const half = (laid?.width ?? 0) / drawing.constants.fineness / 2,
      room = near + half;
    if (
      !laid?.share ||
      across < laid.box[0] - room ||
      across > laid.box[2] + room ||
      down < laid.box[1] - room ||
      down > laid.box[3] + room
    )
      continue;
    const far = distance(laid.chain, across * scale + origin[0], down * scale + origin[1]) / scale - half;
    if (far <= 0) return id;
    if (far < least) [found, least] = [id, far];
  }
  return found;
}
