/**
 * A tiny raster: how the neurons of a closed box were in the last frames, a row each, in the colours of their discs.
 */

/** How many frames it goes back, and the most rows: of more neurons each row shows one of some neighbours. */
const COLUMNS = 48,
  ROWS = 24;

/** The last frames. */
export class Past {
  constructor() {
    /** the levels of all neurons, the latest last @type {Int8Array[]} */
    this.frames = [];
    this.step = NaN;
    this.canvas = document.createElement('canvas');
  }

  /** Nothing is known. */
  clear() {
    this.frames = [];
    this.step = NaN;
  }

  /** A frame is shown; what was after it is forgotten. @param {{step: number, discs: Int8Array}} look */
  add({ step, discs }) {
    if (step === this.step) return;
    if (!(step > this.step)) this.clear();
    this.step = step;
    this.frames.push(discs.slice());
    if (this.frames.length > COLUMNS) this.frames.shift();
  }

  /** Draw the raster of some neurons into a rectangle, in pixels.
   * @param {CanvasRenderingContext2D} context @param {number[]} members @param {number[]} rect left, top, width, height
   * @param {number[][]} channels of each level @param {number} levels */
  draw(context, members, [left, top, width, height], channels, levels) {
    const rows = Math.min(members.length, ROWS),
      image = new ImageData(COLUMNS, rows),
      { canvas, frames } = this;
    frames.forEach((frame, at) => {
      const column = COLUMNS - frames.length + at;
      for (let row = 0; row < rows; row++) {
        const level = frame[members[Math.floor((row * members.length) / rows)]] + levels;
        image.data.set([...(channels[Math.max(0, level)] ?? []), 255], 4 * (row * COLUMNS + column));
      }
    });
    [canvas.width, canvas.height] = [COLUMNS, rows];
    /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d')).putImageData(image, 0, 0);
    context.imageSmoothingEnabled = false;
    context.drawImage(canvas, left, top, width, height);
  }
}
