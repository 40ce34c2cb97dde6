/**
 * The page: joins the link, the camera, the drawing and the controls; draws at the display's rate what is new.
 */

import { Attention } from './attention.js';
import { Camera } from './camera.js';
import { Controls, part } from './controls.js';
import { Drawing } from './draw.js';
import { listKeys } from './keys.js';
import { Matrix } from './matrix.js';
import { under } from './pick.js';
import { Pointer } from './pointer.js';
import { Link } from './protocol.js';
import { Refusal } from './refusal.js';
import { Scrubber } from './scrubber.js';
import { Strips } from './strips.js';
import { Turning } from './turning.js';

const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById('picture'));
const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d', { alpha: false }));
const camera = new Camera();
/** @type {Drawing | null} */
let drawing = null;
/** what is shown in place of the drawing, where it is @type {Matrix | null} */
let matrix = null;
let fresh = false, asked = false, density = 0;

/** Draw before the display's next frame. */
function redraw() {
  if (!asked) {
    asked = true;
    requestAnimationFrame(show);
  }
}

/** Draw, and say so. */
function show() {
  asked = false;
  const { look } = link;
  if (!drawing || !look?.serial) return;
  if (density !== devicePixelRatio) resize();
  const picture = matrix || drawing;
  [picture.near, picture.held] = [attention.near, attention.held];
  const more = picture.draw(context, camera, look);
  attention.show(camera, look);
  controls.frame(look);
  scrubber.show(look);
  strips.show();
  if (more) redraw();
  if (fresh) {
    fresh = false;
    link.drawn();
  }
}

/** Show nothing but the background, which a canvas has as black. */
function blank() {
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.globalAlpha = 1;
  context.fillStyle = getComputedStyle(document.body).backgroundColor;
  context.fillRect(0, 0, canvas.width, canvas.height);
}

/** Fill the window, a pixel a pixel. */
function resize() {
  const box = canvas.getBoundingClientRect();
  if (density !== devicePixelRatio) {
    density = devicePixelRatio;
    matchMedia(`(resolution: ${density}dppx)`).addEventListener('change', redraw, { once: true });
  }
  camera.window = [Math.max(1, Math.round(box.width * density)), Math.max(1, Math.round(box.height * density))];
  [canvas.width, canvas.height] = camera.window;
  blank();
  redraw();
}

const link = new Link({
  scene(scene) {
    const first = !drawing;
    drawing = new Drawing(scene);
    document.title = `${scene.title} – NeuroVis`;
    const names = { back: 'background', ink: 'ink', muted: 'muted', line: 'box_line', fill: 'box_fill' };
    for (const [name, of] of Object.entries(names)) {
      document.documentElement.style.setProperty(`--${name}`, scene.theme[of]);
    }
    if (first) blank();
    choose(matrix !== null);
    attention.use(scene);
    strips.use();
    turning.use(scene);
    redraw();
  },
  traces(traces) {
    strips.take(traces);
  },
  frame() {
    fresh = true;
    redraw();
  },
  text(message) {
    if (message.type === 'status') {
      controls.status(message);
      scrubber.status(message);
      turning.status(message);
    } else if (message.type === 'values') attention.take(message);
    else if (message.type === 'findings') controls.found(message);
    else if (message.type === 'refused') refusal.tell(message.reason);
  },
  link(open) {
    if (open) attention.ask();
    else controls.tell('not connected, trying again …');
  },
});
const controls = new Controls(link);
const turning = new Turning(link, part);
const refusal = new Refusal(part('refusal'));
const attention = new Attention(link, redraw, (group) => {
  turning.hold(group);
  strips.hold(group);
});
const scrubber = new Scrubber(link, part, redraw);
const strips = new Strips(link, attention, scrubber, part('strips'));

/** Show the matrix in place of the picture, or the picture. @param {boolean} asMatrix */
function choose(asMatrix) {
  const { scene } = link;
  if (!scene) return;
  const shown = asMatrix ? new Matrix(scene) : null;
  if (!shown !== !matrix) camera.fit();
  matrix = shown;
  camera.size = shown ? shown.size : [scene.width, scene.height];
  attention.spot = shown && ((id) => shown.at(id));
  canvas.setAttribute('aria-label', shown ? `${scene.title}, the matrix of its weights` : scene.title);
  part('matrix').setAttribute('aria-pressed', String(asMatrix));
  redraw();
}

new ResizeObserver(resize).observe(canvas);
new Pointer(canvas, camera, attention, {
  pointed(x, y) {
    const { look } = link;
    if (matrix) return matrix.under(camera, x, y);
    return drawing && look ? under(drawing, camera, look, x, y) : '';
  },
  redraw,
});
/** List the keys, or close the list. */
function help() {
  listKeys(/** @type {HTMLDialogElement} */ (part('keys')), controls.keys);
}
part('help').onclick = help;
part('matrix').onclick = () => choose(!matrix);
part('shut').onclick = help;
Object.assign(controls.keys, {
  '+': ['come closer', () => { camera.closer(1.25, camera.window[0] / 2, camera.window[1] / 2); redraw(); }],
  '-': ['go further away', () => { camera.closer(0.8, camera.window[0] / 2, camera.window[1] / 2); redraw(); }],
  0: ['see all of it', () => { camera.fit(); redraw(); }],
  t: ['open or close the panel for turning', () => turning.toggle()],
  m: ['the matrix of the weights in place of the picture, and back', () => choose(!matrix)],
  p: ['pin the strip of what is held, or unpin it', () => strips.toggle(attention.held)],
  '<': ['show more of the past', () => scrubber.more(1)],
  '>': ['show less of the past', () => scrubber.more(-1)],
  Escape: ['let go of what is held', () => attention.hold('')],
  ']': ['hold the next neuron', () => attention.next(1)],
  '[': ['hold the neuron before', () => attention.next(-1)],
  '?': ['list the keys, or close the list', help],
});
