/**
 * Aside: another branch of the run in a picture of its own, beside that of the run (A | B), at the same step and seen by the same
 * camera.
 */

import { called, every } from './branches.js';
import { Matrix } from './matrix.js';
import { Picture } from './picture.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./draw.js').Context} Context */
/** @typedef {import('./protocol.js').Future} Future */
/** @typedef {import('./picture.js').Held} Held */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Status} Status */
/** @typedef {import('./zoom.js').Zoom} Zoom */

/** The picture of another branch. */
export class Aside {
  /** @param {Link} link @param {(id: string) => HTMLElement} find @param {() => void} arrange has the page arranged anew */
  constructor(link, find, arrange) {
    this.link = link;
    this.find = find;
    this.arrange = arrange;
    this.canvas = /** @type {HTMLCanvasElement} */ (find('other'));
    this.context = /** @type {Context} */ (this.canvas.getContext('2d', { alpha: false }));
    this.picture = new Picture();
    /** @type {Matrix | null} */
    this.matrix = null;
    /** the branch that is shown @type {Future | null} */
    this.branch = null;
  }

  /** How many pictures there are. @returns {number} */
  get pictures() {
    return this.branch ? 2 : 1;
  }

  /** @param {Status} status */
  status({ compared, futures, branch, owner }) {
    const before = this.branch;
    this.branch = every(futures).find(({ number }) => number === compared) ?? null;
    if (!this.branch) this.link.other = null;
    this.find('alone').hidden = !owner;
    this.find('which').textContent = `A · ${branch || 'this run'}`;
    if (this.branch) this.find('otherwise').textContent = `B · ${called(this.branch)}`;
    if (!before === !this.branch) return;
    document.body.classList.toggle('compared', this.branch !== null);
    this.arrange();
  }

  /** Another picture of the network, or another network. @param {Scene} scene */
  use(scene) {
    this.picture.zoom.use(scene);
    this.picture.drawing = this.matrix = null;
  }

  /** Draw it as the run is drawn; true where there is more to be drawn.
   * @param {Camera} camera @param {Zoom} zoom of the run @param {Held} held @param {boolean} asMatrix
   * @returns {boolean} */
  draw(camera, zoom, held, asMatrix) {
    const { canvas, context, link, branch } = this,
      look = link.other;
    if (!branch || !look?.serial || !link.scene) return false;
    if (canvas.width !== camera.window[0] || canvas.height !== camera.window[1])
      [canvas.width, canvas.height] = camera.window;
    const isBefore = link.look && link.look.step > look.step && look.step === branch.last;
    this.find('ended').textContent = isBefore ? ` · ended at step ${look.step}` : '';
    canvas.setAttribute('aria-label', `B, ${called(branch)}, ${look.caption || `step ${look.step}`}`);
    if (asMatrix) {
      this.matrix ??= new Matrix(link.scene);
      return this.matrix.draw(context, camera, look, held);
    }
    this.follow(zoom);
    return this.picture.draw(context, camera, look, held);
  }

  /** See the scene as the run's is seen, with the same boxes closed. @param {Zoom} zoom */
  follow({ scene, hand, joined, ids }) {
    const { zoom } = this.picture,
      isSame = zoom.scene === scene && zoom.joined === joined && zoom.ids.join() === ids.join();
    if (!isSame) Object.assign(zoom, { scene, hand, joined, made: null });
  }
}
