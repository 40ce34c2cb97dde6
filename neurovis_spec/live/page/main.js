/**
 * The page: joins the link, the camera, the drawing and the controls; draws at the display's rate what is new.
 */

import { Aside } from './aside.js';
import { Attention } from './attention.js';
import { Axis } from './axis.js';
import { Beside, isBeside } from './beside.js';
import { Body } from './body.js';
import { Branches } from './branches.js';
import { Camera } from './camera.js';
import { channels, luminance } from './colours.js';
import { Controls, part } from './controls.js';
import { CurveNames } from './curvenames.js';
import { Fitting } from './fitting.js';
import { listKeys } from './keys.js';
import { Legend } from './legend.js';
import { Matrix } from './matrix.js';
import { Measuring } from './measuring.js';
import { NotFinite } from './notfinite.js';
import { Outline } from './outline.js';
import { arrangePanels, greet } from './panels.js';
import { under } from './pick.js';
import { Picture } from './picture.js';
import { followFingers } from './pinch.js';
import { Placing } from './place.js';
import { Pointer } from './pointer.js';
import { Link } from './protocol.js';
import { Range } from './range.js';
import { Refusal } from './refusal.js';
import { bare, frame, Room, staying } from './room.js';
import { download } from './save.js';
import { Saves } from './saves.js';
import { say } from './say.js';
import { Scrubber } from './scrubber.js';
import { Share } from './share.js';
import { Sized } from './sized.js';
import { Strips } from './strips.js';
import { told } from './told.js';
import { Turning } from './turning.js';
import { Undo } from './undo.js';
import { Views } from './views.js';

const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById('picture'));
const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d', { alpha: false }));
const camera = new Camera(),
  picture = new Picture(),
  { zoom } = picture;
/** What is gone to is seen with so many radii of a neuron around it. */
const ROOM = 12;
/** The id of a neuron or a connection. */
const ITEM = /^[nc]\d+$/;
/** what is shown in place of the picture, where it is @type {Matrix | null} */
let matrix = null;
/** of which closed boxes it was asked what runs from and to them */
let joining = '';
let fresh = false,
  asked = false,
  // whether a first scene may still be one in another theme than was asked for
  isBefore = true,
  density = 0;

/** Draw before the display's next frame. */
function redraw() {
  if (!asked) {
    asked = true;
    requestAnimationFrame(show);
  }
}

/** Ask what runs from and to the boxes that are closed now. */
function asks() {
  const ids = zoom.ids.join();
  if (ids === joining) return;
  joining = ids;
  link.ask('close', { boxes: zoom.ids });
}

/** Draw, and say so. */
function show() {
  asked = false;
  const { look } = link;
  if (!look?.serial) return;
  if (density !== devicePixelRatio) resize();
  if (camera.glide()) redraw();
  if (!matrix) {
    if (!zoom.seen(camera)) return;
    if (!camera.way) asks();
  }
  const more = (matrix || picture).draw(context, camera, look, attention);
  const unfinished = aside.draw(camera, zoom, attention, matrix !== null);
  attention.show(camera, look);
  outline.show(look);
  turning.weight.show(attention.values);
  controls.frame(look);
  saves.frame();
  part('caption').textContent = look.caption;
  scrubber.show(look);
  axis.show();
  strips.show();
  if (link.scene) body.show(look, link.scene);
  if (more || unfinished) redraw();
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
  if (link.scene) frame(camera, link.scene, matrix?.size);
  [canvas.width, canvas.height] = camera.window;
  room.place();
  blank();
  redraw();
}

const link = new Link({
  scene(scene) {
    const first = !zoom.scene;
    if (first && isBefore && turning.appearance.awaits(scene)) {
      isBefore = false;
      return;
    }
    const network = bare(scene),
      stays = staying(camera, zoom.scene, network),
      isOther = !first && zoom.scene?.window !== scene.window;
    pointer.cancel();
    zoom.use(network);
    aside.use(network);
    legend.use(scene);
    room.use(network, stays !== undefined);
    joining = '';
    picture.drawing = null;
    document.title = `${scene.title} – NeuroVis`;
    const names = { back: 'background', ink: 'ink', muted: 'muted', line: 'box_line', fill: 'box_fill' };
    const { style } = document.documentElement;
    for (const [name, of] of Object.entries(names)) style.setProperty(`--${name}`, scene.theme[of]);
    style.colorScheme = luminance(channels(scene.theme.background)) < 0.18 ? 'dark' : 'light';
    if (first) blank();
    choose(matrix !== null);
    if (!matrix) stays?.();
    if (isOther && !matrix) camera.fit();
    fitting.scene(scene);
    part('titled').textContent = scene.title;
    beside.use(scene);
    part('notes').textContent = scene.groups.find(({ id }) => id === 'notes')?.title ?? '';
    attention.use(scene);
    strips.use();
    measuring.use(scene);
    axis.use(scene.time);
    if (first) strips.begin(scene.curves);
    turning.use(scene);
    outline.use(scene);
    placing.use(scene);
    views.use();
    redraw();
  },
  traces(traces) {
    strips.take(traces);
  },
  left(traces) {
    strips.left = traces;
  },
  pairs(traces) {
    strips.pairs(traces);
  },
  leftPairs(traces) {
    strips.leftPaired = traces;
  },
  raster(raster) {
    strips.raster(raster);
  },
  joined(joined) {
    zoom.join(joined);
    attention.renew();
  },
  held(told) {
    if (!attention.tell(told)) return;
    zoom.more(told.groups, told.of);
    placing.more(told.groups);
    outline.more(told.groups);
    outline.hold();
  },
  file(name, blob) {
    share.made();
    download(blob, name);
  },
  aside() {
    redraw();
  },
  frame() {
    fresh = true;
    redraw();
  },
  text(message) {
    if (message.type === 'status') {
      link.takes = new Set(message.can.takes);
      const asking = /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll('[data-asks]'));
      for (const one of asking) one.hidden = !link.takes.has(one.dataset.asks ?? '');
      controls.status(message);
      scrubber.status(message);
      turning.status(message);
      undo.status(message);
      branches.status(message);
      aside.status(message);
      placing.status(message);
      saves.status(message);
      range.status(message);
      strips.owner = message.owner;
      strips.measures(message.measures);
      views.measures(message.measures);
      share.status();
      views.status();
      fitting.status(message);
    } else if (message.type === 'values') attention.take(message);
    else if (message.type === 'body') body.use(message.skeleton, message.start, message.motors);
    else if (message.type === 'findings') controls.found(message);
    else if (message.type === 'undefined') notFinite.tell(message, controls.owner);
    else if (message.type === 'moved') placing.take(message);
    else if (message.type === 'placed') {
      placing.told(message);
      saves.placed(message);
    } else if (message.type === 'saving') {
      placing.saving(message);
      if (message.written) controls.tell(`saved ${message.files.join(', ')}`);
    } else if (message.type === 'measured') {
      measuring.take(message);
      views.measured(message);
    } else if (message.type === 'views') views.take(message);
    else if (message.type === 'fitting') fitting.told(message.window, message.shown);
    else if (message.type === 'making') share.making(message.done, message.total);
    else if (message.type === 'refused') {
      share.made();
      refusal.tell(message.reason);
      undo.refused();
      views.refused();
      if (placing.waiting) placing.cancel();
    }
  },
  link(open) {
    part('lost').hidden = open;
    if (open) {
      turning.appearance.dress();
      fitting.begin();
      attention.ask();
    } else controls.refuse('not connected, trying again …');
  },
});
const controls = new Controls(link);
const legend = new Legend(part('legend')),
  room = new Room(camera, legend, part);
const turning = new Turning(link, part);
const undo = new Undo(link, part, told);
const refusal = new Refusal(part('refusal'));
const attention = new Attention(link, zoom, redraw, (group) => {
  if (!attention.all) zoom.more([]);
  turning.hold(group);
  outline.hold();
  strips.hold(group);
});
const beside = new Beside();
const notFinite = new NotFinite(link, attention, part);
const outline = new Outline(attention, beside, part, (id) => go(id));
const scrubber = new Scrubber(link, part, redraw);
const range = new Range(link, scrubber, part, redraw);
const axis = new Axis(scrubber, part, redraw);
const strips = new Strips(link, attention, beside, scrubber, axis, part('strips'), part('under'));
const aside = new Aside(link, part, () => {
  room.arrange(aside.pictures);
  redraw();
});
const branches = new Branches(link, part, undo, (number, name) => {
  scrubber.compare(number);
  strips.compare(number, name);
});
const measuring = new Measuring(link, strips, part);
const body = new Body(part('embodied'), part('posed'), part('bodily'), part('spatial'), redraw);
const fitting = new Fitting(link, part('shown'), part('fitting'), () =>
  refusal.tell('the part that was seen is of another layout of the network than the one that is shown'),
);
const share = new Share(
  link,
  camera,
  new CurveNames(strips),
  controls,
  body,
  redraw,
  part,
  branches,
  fitting,
  (words) => refusal.tell(words),
);
const saves = new Saves(link, body, (done, total) => share.making(done, total), part);
const views = new Views(share, zoom, turning.appearance, undo, redraw, part);

/** Show the matrix in place of the picture, or the picture. @param {boolean} asMatrix */
function choose(asMatrix) {
  const { scene } = link;
  if (!scene) return;
  const cells = asMatrix ? new Matrix(scene) : null,
    changed = !cells !== !matrix;
  matrix = cells;
  frame(camera, scene, cells?.size);
  if (changed) camera.fit();
  attention.spot = cells && ((id) => cells.at(id));
  canvas.setAttribute('aria-label', cells ? `${scene.title}, the matrix of its weights` : scene.title);
  canvas.setAttribute('aria-description', scene.told.join('. '));
  part('matrix').setAttribute('aria-pressed', String(asMatrix));
  redraw();
}

/** Hold a neuron, a connection or a bundle, or go to a box; where it is not seen, the picture is moved. @param {string} id */
function go(id) {
  if (isBeside(id)) {
    strips.pin(id);
    return;
  }
  if (zoom.boxes.some((one) => one.id === id)) enter(id);
  attention.hold(id);
  if (ITEM.test(id) && attention.held === id) see(id);
  redraw();
}

/** Close a box, or open it, for which it may have to be gone to. @param {string} id */
function turn(id) {
  const isClosed = zoom.ids.includes(id);
  if (!zoom.turn(id, camera) && isClosed) enter(id);
  zoom.seen(camera); // so that the pointer knows at once
  redraw();
}

/** Go to a box, so that it opens. @param {string} id */
function enter(id) {
  const box = zoom.boxes.find((one) => one.id === id);
  if (box) {
    const [x0, y0, x1, y1] = box.rect,
      room = 0.1 * Math.max(x1 - x0, y1 - y0);
    choose(false);
    attention.point('', [0, 0]);
    camera.see([x0 - room, y0 - room, x1 + room, y1 + room], 1.01 * zoom.opening(box));
  }
  redraw();
}

/** Have a neuron or a connection be seen. @param {string} id */
function see(id) {
  const [x, y] = attention.middle(id),
    room = ROOM * (picture.drawing?.discs[0]?.shape.radius ?? 20);
  const outside = camera.pixel(x, y).some((pixel, axis) => pixel < 0 || pixel > camera.window[axis]);
  if (outside || (!matrix && zoom.under([x, y]))) camera.see([x - room, y - room, x + room, y + room]);
}

new ResizeObserver(resize).observe(canvas);
const placing = new Placing(
  link,
  () => !matrix && picture.drawing !== null,
  (group) => {
    if (group) picture.drawing?.reshape(zoom.inked(group));
    aside.picture.drawing = null;
    redraw();
  },
  part,
);
/** What lies under a pixel of a picture, or of its matrix. @param {Picture} shown @param {Matrix | null} cells
 * @param {number} x @param {number} y @returns {string} */
function pointed({ drawing }, cells, x, y) {
  if (cells) return cells.under(camera, x, y);
  const at = camera.unit(x, y);
  return (
    zoom.under(at) || (drawing ? under(drawing, camera, x, y) || zoom.titled(at, context, drawing.family.join()) : '')
  );
}

/** A click on something. @param {string} id */
function pressed(id) {
  if (zoom.boxes.some((box) => box.id === id)) turn(id);
  else if (!id.startsWith('joined:')) attention.hold(id);
}

const pointer = new Pointer(canvas, camera, attention, placing, {
  pointed: (x, y) => pointed(picture, matrix, x, y),
  pressed,
  redraw,
});
followFingers(canvas, camera, redraw, () => pointer.cancel());
const beyond = new Pointer(aside.canvas, camera, attention, null, {
  pointed: (x, y) => pointed(aside.picture, matrix && aside.matrix, x, y),
  pressed,
  redraw,
  over: new Sized(aside.canvas, redraw),
});
followFingers(aside.canvas, camera, redraw, () => beyond.cancel());
/** Come closer to the middle, or go away. @param {number} factor */
function nearer(factor) {
  camera.closer(factor, camera.window[0] / 2, camera.window[1] / 2);
  redraw();
}
/** Move the picture, by shares of the window. @param {number} across @param {number} down */
function pan(across, down) {
  camera.move(across * camera.window[0], down * camera.window[1]);
  redraw();
}
/** Have read what is held, or else how the run stands. */
function tellAll() {
  const { look, scene } = link;
  if (!look || !scene) return;
  if (attention.held) attention.say(look);
  else
    say(
      `${scene.title}, ${look.caption || `step ${look.step}`}, ${controls.playing ? 'playing' : 'paused'}, neurons ${scene.discs}, connections ${scene.lines}${body.words && `, ${body.words}`}`,
    );
}
/** List the keys, or close the list. */
function help() {
  listKeys(/** @type {HTMLDialogElement} */ (part('keys')), controls.keys);
}
part('help').onclick = help;
part('unpresent').onclick = () => share.present();
const matrices = { toggle: () => choose(!matrix) };
part('matrix').onclick = () => matrices.toggle();
undo.follow(matrices, 'the matrix of the weights');
undo.follow(turning, 'the panel for turning');
undo.follow(outline, 'the outline');
undo.follow(body, 'the panel of the body');
undo.followPins(strips);
undo.followTheme(turning.appearance);
part('shut').onclick = help;
arrangePanels();
greet(part('hint'));
Object.assign(controls.keys, {
  '+': ['come closer', () => nearer(1.25)],
  '-': ['go further away', () => nearer(0.8)],
  0: [
    'see all of it',
    () => {
      camera.fit();
      redraw();
    },
  ],
  h: ['see more on the left', () => pan(0.1, 0)],
  j: ['see more below', () => pan(0, -0.1)],
  k: ['see more above', () => pan(0, 0.1)],
  l: ['see more on the right', () => pan(-0.1, 0)],
  '/': ['search by name', () => outline.search()],
  o: ['open or close the panel of search', () => outline.toggle()],
  v: ['say what is held with its value, or how the run stands', tellAll],
  t: ['open or close the panel of parameters', () => turning.toggle()],
  y: ['open or close the panel of the body', () => body.toggle()],
  i: ['fold or unfold the legend', () => legend.toggle()],
  m: ['the matrix of the weights in place of the picture, and back', () => matrices.toggle()],
  g: ['each group as one node, with the pathways between them, and back', () => turning.appearance.toggle()],
  f: ['present: the picture and the curves alone, and back', () => share.present()],
  c: ['add a curve by its name, or by a measure', () => measuring.toggle()],
  p: ['pin the curve of what is held, or unpin it', () => strips.toggle()],
  L: ['play the steps that are shown over and over, or go on', () => range.toggle()],
  '<': ['show more of the past', () => scrubber.more(1)],
  '>': ['show less of the past', () => scrubber.more(-1)],
  Escape: [
    'let go of what is held; give up a drag',
    () => {
      pointer.cancel();
      attention.hold('');
    },
  ],
  Enter: [
    'close the box that is held, or open it',
    () => {
      if (zoom.boxes.some(({ id }) => id === attention.held)) turn(attention.held);
    },
  ],
  ']': ['hold the next neuron', () => attention.next(1)],
  '[': ['hold the neuron before', () => attention.next(-1)],
  'shift+←': ['put what is held further left', () => placing.step(attention.held, -1, 0)],
  'shift+→': ['put it further right', () => placing.step(attention.held, 1, 0)],
  'shift+↑': ['put it further up', () => placing.step(attention.held, 0, -1)],
  'shift+↓': ['put it further down', () => placing.step(attention.held, 0, 1)],
  z: ['undo the last placing', () => placing.undo()],
  'ctrl+z': ['undo what was done last', () => undo.back()],
  'ctrl+shift+z': ['do again what was undone, as ctrl+y does', () => undo.again()],
  '?': ['list keys and gestures, or close the list', help],
});
