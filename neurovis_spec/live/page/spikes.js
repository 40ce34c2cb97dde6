/**
 * Rasters: when the neurons of a group fire.
 */

/** @typedef {import('./protocol.js').Raster} Raster */

/** Draw a raster: a row for each neuron, in it a mark where it fires; of several in a row as strong as their share.
 * @param {HTMLCanvasElement} canvas @param {HTMLElement[]} told where the names of the first and the last are told
 * @param {Raster} raster @param {CanvasRenderingContext2D} context @param {(step: number) => number} x @param {string} steps which
 * steps are shown */
export function dot(canvas, told, { first, every, bins, rows, ends, cells }, context, x, steps) {
  const row = (canvas.clientHeight - 4) / Math.max(1, rows),
    wide = Math.max(1, x(every) - x(0));
  let known = false;
  context.fillStyle = getComputedStyle(canvas).color;
  cells.forEach((share, at) => {
    known ||= share < 255;
    if (share === 0 || share === 255) return;
    context.globalAlpha = Math.max(0.25, share / 254);
    const middle = x(first + (at % bins) * every + (every - 1) / 2);
    context.fillRect(middle - wide / 2, 2 + Math.floor(at / bins) * row, wide, Math.max(1, row - (row > 3 ? 1 : 0)));
  });
  [told[0].textContent, told[1].textContent] = [ends[0], ends[1] === ends[0] ? '' : (ends[1] ?? '')];
  const which = ends[1] === ends[0] ? ends[0] : ends.join(' … ');
  canvas.setAttribute('aria-label', `raster of ${which} ${steps}${known ? '' : ': nothing is known of these steps'}`);
}
