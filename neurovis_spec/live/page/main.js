/**
 * The page: joins the link, the camera, the drawing and the controls; draws at the display's rate what is new.
 */

import { Attention } from './attention.js';
import { Camera } from './camera.js';
import { Controls, part } from './controls.js';
import { Drawing } from './draw.js';
import { listKeys } from './keys.js';
import { under } from './pick.js';
import { Pointer } from './pointer.js';
import { Link } from './protocol.js';
import { Refusal } from './refusal.js';
import { Turning } from './turning.js';

const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById('picture'));
const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d', { alpha: false }));
const camera = new Camera();
/** @type {Drawing | null} */
let drawing = null;
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
  [drawing.near, drawing.held] = [attention.near, attention.held];
  const more = drawing.draw(context, camera, look);
  attention.show(camera, look);
  controls.frame(look);
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
    camera.size = [scene.width, scene.height];
    document.title = `${scene.title} – NeuroVis`;
    const names = { back: 'background', ink: 'ink', muted: 'muted', line: 'box_line', fill: 'box_fill' };
    for (const [name, of] of Object.entries(names)) {
      document.documentElement.style.setProperty(`--${name}`, scene.theme[of]);
    }
    if (first) blank();
    canvas.setAttribute('aria-label', scene.title);
    attention.use(scene);
    turning.use(scene);
    redraw();
  },
  frame() {
    fresh = true;
    redraw();
  },
  text(message) {
    if (message.type === 'status') {
      controls.status(message);
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
const attention = new Attention(link, redraw, (group) => turning.hold(group));

new ResizeObserver(resize).observe(canvas);
new Pointer(canvas, camera, attention, {
  pointed(x, y) {
    const { look } = link;
    return drawing && look ? under(drawing, camera, look, x, y) : '';
  },
  redraw,
});
/** List the keys, or close the list. */
function help() {
  listKeys(/** @type {HTMLDialogElement} */ (part('keys')), controls.keys);
}
part('help').onclick = help;
part('shut').onclick = help;
Object.assign(controls.keys, {
  '+': ['come closer', () => { camera.closer(1.25, camera.window[0] / 2, camera.window[1] / 2); redraw(); }],
  '-': ['go further away', () => { camera.closer(0.8, camera.window[0] / 2, camera.window[1] / 2); redraw(); }],
  0: ['see all of it', () => { camera.fit(); redraw(); }],
  t: ['open or close the panel for turning', () => turning.toggle()],
  Escape: ['let go of what is held', () => attention.hold('')],
  ']': ['hold the next neuron', () => attention.next(1)],
  '[': ['hold the neuron before', () => attention.next(-1)],
  '?': ['list the keys, or close the list', help],
});
