/**
 * The pointer: what it is over, what a click holds, and drags: of a neuron, which puts it elsewhere or, up and down with
 * shift, clamps it; of anything else, which moves the picture.
 */

/** @typedef {import('./attention.js').Attention} Attention */
/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./place.js').Placing} Placing */
/** @typedef {import('./sized.js').Sized} Sized */
/** What a pointer must know of the page: the id of what lies under a pixel, what a click on it does, and how to draw anew;
 * where the picture stands, if it is not that of the run.
 * @typedef {{pointed: (x: number, y: number) => string, pressed: (id: string) => void, redraw: () => void, over?: Sized}} Ground */

/** How far a pointer may move, in pixels of a page, before a click is a drag. */
const STILL = 5;
/** How far a disc is dragged up for its activity to be 1 larger, in pixels of a page, and milliseconds between two clamps. */
const ONE = 100,
  OFTEN = 50;

/** Where a pointer is, in pixels of the display. @param {MouseEvent} event @returns {number[]} */
const pixel = (event) => [event.offsetX * devicePixelRatio, event.offsetY * devicePixelRatio];

/** Follows the pointer over the picture. */
export class Pointer {
  /** @param {HTMLCanvasElement} canvas @param {Camera} camera @param {Attention} attention
   * @param {Placing | null} placing where neurons can be dragged @param {Ground} ground */
  constructor(canvas, camera, attention, placing, ground) {
    this.canvas = canvas;
    this.camera = camera;
    this.attention = attention;
    this.placing = placing;
    this.ground = ground;
    /** how far it was dragged, what was under it when it went down, and how far from its middle */
    this.dragged = 0;
    this.on = '';
    this.off = [0, 0];
    /** where a clamp began, from which value, and when it was last sent @type {{y: number, from: number, last: number} | null} */
    this.clamp = null;
    canvas.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointerup', (event) => this.up(event));
    canvas.addEventListener('pointercancel', () => this.cancel());
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

  /** A drag may begin; with a finger only what is held is dragged. @param {PointerEvent} event */
  down(event) {
    const [x, y] = pixel(event),
      id = this.ground.pointed(x, y),
      { placing } = this,
      asks = event.shiftKey ? 'hold' : 'place';
    this.cancel();
    this.dragged = 0;
    const isMeant = event.button === 0 && (event.pointerType === 'mouse' || id === this.attention.held);
    if (!placing || !isMeant || !placing.can(id, asks)) return;
    this.on = id;
    this.canvas.setPointerCapture(event.pointerId);
    // of one that shows a state the activity is not known
    const from = placing.groups.get(id)?.data.state === undefined ? (this.attention.values[id] ?? 0) : 0;
    this.clamp = event.shiftKey ? { y: event.offsetY, from, last: 0 } : null;
    const [across, down] = this.camera.unit(x, y),
      [left, top] = placing.stand(id).at[0];
    this.off = [left - across, top - down];
  }

  /** Give up a drag: the neuron stands where it stood. */
  cancel() {
    if (this.placing?.dragged) this.placing.cancel();
    this.on = '';
    this.clamp = null;
  }

  /** A click holds; a neuron stays where it was dragged to. @param {PointerEvent} event */
  up(event) {
    const [x, y] = pixel(event);
    if (this.dragged < STILL && event.button === 0) this.ground.pressed(this.ground.pointed(x, y));
    if (this.clamp && this.dragged >= STILL) this.hold(event, false);
    this.placing?.drop();
    this.on = '';
    this.clamp = null;
  }

  /** Clamp the neuron to what its disc was dragged to. @param {PointerEvent} event @param {boolean} moving */
  hold(event, moving) {
    const { clamp, placing } = this;
    if (!placing || !clamp || (moving && event.timeStamp - clamp.last < OFTEN)) return;
    clamp.last = event.timeStamp;
    const value = Number((clamp.from + (clamp.y - event.offsetY) / ONE).toFixed(2));
    placing.link.ask('hold', { neurons: placing.groups.get(this.on)?.data.neuron, value, moving });
  }

  /** Say what is pointed at, or drag. @param {PointerEvent} event */
  move(event) {
    const [x, y] = pixel(event),
      at = this.camera.unit(x, y);
    if (event.buttons !== 1) {
      const id = this.ground.pointed(x, y);
      this.canvas.style.cursor = id ? 'pointer' : '';
      this.attention.point(id, at, this.ground.over);
      return;
    }
    this.dragged += Math.abs(event.movementX) + Math.abs(event.movementY);
    if (!this.on) {
      this.camera.move(event.movementX * devicePixelRatio, event.movementY * devicePixelRatio);
      this.ground.redraw();
    } else if (this.clamp) {
      this.hold(event, true);
    } else if (this.dragged >= STILL) {
      this.placing?.drag(this.on, [at[0] + this.off[0], at[1] + this.off[1]]);
    }
  }
}
