/**
 * The pointer: what it is over, what a click holds, and a drag that moves the picture.
 */

/** @typedef {import('./attention.js').Attention} Attention */
/** @typedef {import('./camera.js').Camera} Camera */
/** What a pointer must know of the page: the id of what lies under a pixel, and how to draw anew.
 * @typedef {{pointed: (x: number, y: number) => string, redraw: () => void}} Ground */

/** How far a pointer may move, in pixels of a page, before a click is a drag. */
const STILL = 5;

/** Where a pointer is, in pixels of the display. @param {MouseEvent} event @returns {number[]} */
const pixel = (event) => [event.offsetX * devicePixelRatio, event.offsetY * devicePixelRatio];

/** Follows the pointer over the picture. */
export class Pointer {
  /** @param {HTMLCanvasElement} canvas @param {Camera} camera @param {Attention} attention @param {Ground} ground */
  constructor(canvas, camera, attention, ground) {
    this.canvas = canvas;
    this.camera = camera;
    this.attention = attention;
    this.ground = ground;
    this.dragged = 0;
    canvas.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
    canvas.addEventListener('pointerdown', () => { this.dragged = 0; });
    canvas.addEventListener('pointerup', (event) => this.up(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    canvas.addEventListener('pointerleave', () => attention.point('', [0, 0]));
  }

  /** Come closer, or go away. @param {WheelEvent} event */
  wheel(event) {
    // in a notebook it scrolls that, until the page has been clicked
    if (parent !== window && !document.hasFocus()) return;
    const [x, y] = pixel(event);
    this.camera.closer(Math.exp(-event.deltaY / 400), x, y);
    event.preventDefault();
    this.ground.redraw();
  }

  /** A click holds. @param {PointerEvent} event */
  up(event) {
    const [x, y] = pixel(event);
    if (this.dragged < STILL && event.button === 0) this.attention.hold(this.ground.pointed(x, y));
  }

  /** Say what is pointed at, or move the picture. @param {PointerEvent} event */
  move(event) {
    const [x, y] = pixel(event);
    if (event.buttons !== 1) {
      const id = this.ground.pointed(x, y);
      this.canvas.style.cursor = id ? 'pointer' : '';
      this.attention.point(id, this.camera.unit(x, y));
      return;
    }
    this.dragged += Math.abs(event.movementX) + Math.abs(event.movementY);
    this.camera.move(event.movementX * devicePixelRatio, event.movementY * devicePixelRatio);
    this.ground.redraw();
  }
}
