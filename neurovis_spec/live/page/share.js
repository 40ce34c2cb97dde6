/**
 * Sharing: where the page is, in its address, so that a link shows the same; and the picture alone, for a talk.
 */

import { pixelsOf } from './save.js';

/** @typedef {import('./body.js').Body} Body */
/** @typedef {import('./branches.js').Branches} Branches */
/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./controls.js').Controls} Controls */
/** @typedef {import('./curvenames.js').CurveNames} CurveNames */
/** @typedef {import('./fitting.js').Fitting} Fitting */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./protocol.js').Scene} Scene */

/** Pixels within which the picture is where it is as a whole; how often the address is brought up to date, in milliseconds; how long it is told that something was copied. */
const HALF = 0.5,
  PACE = 500,
  TOLD = 1500;
/** The window of a picture that is laid out as anywhere. */
export const USUAL = 'default';

/** A finite number of a text, null where it is none. @param {string | null | undefined} text @returns {number | null} */
const number = (text) => (text && Number.isFinite(Number(text)) ? Number(text) : null);

/** What of a page a link holds. */
export class Share {
  /** @param {Link} link @param {Camera} camera @param {CurveNames} curves @param {Controls} controls
   * @param {Body} body @param {() => void} redraw @param {(id: string) => HTMLElement} part
   * @param {Branches} branches @param {Fitting} fitting @param {(words: string) => void} tell says what of a link cannot be shown */
  constructor(link, camera, curves, controls, body, redraw, part, branches, fitting, tell) {
    this.link = link;
    this.camera = camera;
    this.curves = curves;
    this.controls = controls;
    this.redraw = redraw;
    this.tell = tell;
    this.branches = branches;
    this.fitting = fitting;
    /** goes to the view that the page was opened with */
    this.opens = (/** @type {string} */ _) => {};
    /** pins curves, and says which there are not; with views these may be measures that are not there yet */
    this.pins = (/** @type {string[]} */ texts) => curves.pin(texts);
    /** the curves that the page began with */
    this.begun = '';
    this.isBegun = false;
    this.film = /** @type {HTMLButtonElement} */ (part('film'));
    this.matrix = part('matrix');
    const address = part('link'),
      picture = part('clip');
    address.hidden = location.protocol === 'about:'; // the page in a notebook has none
    address.onclick = () => {
      this.keep();
      this.told(address, async () => navigator.clipboard.writeText(location.href));
    };
    picture.onclick = () => {
      const { scene, look } = this.link;
      if (!scene || !look) return;
      const png = pixelsOf(scene, look, body);
      this.told(picture, async () => navigator.clipboard.write([new ClipboardItem({ 'image/png': png })]));
    };
    part('present').onclick = () => this.present();
    document.addEventListener('fullscreenchange', () => {
      if (!document.fullscreenElement) document.documentElement.classList.remove('presenting');
    });
  }

  /** Say on a button that something was copied, or that it could not be. @param {HTMLElement} button @param {() => Promise<void>} copy */
  async told(button, copy) {
    const words = button.dataset.words ?? button.textContent ?? '';
    button.dataset.words = words;
    try {
      await copy();
      button.textContent = 'copied';
    } catch {
      button.textContent = 'not allowed by the browser';
    }
    setTimeout(() => {
      button.textContent = words;
    }, TOLD);
  }

  /** Say how far a film is. @param {number} done @param {number} total */
  making(done, total) {
    this.film.textContent = `making it, ${Math.floor((100 * done) / Math.max(1, total))} %`;
    this.film.disabled = true;
  }

  /** It is there, or will not be. */
  made() {
    if (!this.film.disabled) return;
    this.film.textContent = 'film of the last';
    this.film.disabled = !this.controls.owner;
  }

  /** Show the picture and the curves alone, as large as the screen, or all again. */
  present() {
    const isOn = document.documentElement.classList.toggle('presenting');
    if (isOn) document.documentElement.requestFullscreen?.().catch(() => {});
    else if (document.fullscreenElement) void document.exitFullscreen();
  }

  /** The scene and how the run stands are there: go to where the address says, and keep it up to date from then on. */
  status() {
    if (this.isBegun || !this.link.scene) return;
    this.isBegun = true;
    this.begun = this.pinned;
    if (location.protocol === 'about:') return;
    this.restore(new URLSearchParams(location.hash.slice(1)));
    setInterval(() => this.keep(), PACE);
    // somebody has edited the address, or gone to a link of this very page
    addEventListener('hashchange', () => {
      const said = new URLSearchParams(location.hash.slice(1));
      if (!said.has('view')) this.camera.fit();
      if (!said.has('curves')) said.set('curves', this.begun);
      this.restore(said);
    });
  }

  /** The curves that are pinned, by their names, a line each. @returns {string} */
  get pinned() {
    return this.curves.pinned.join('\n');
  }

  /** Whether the matrix is shown in place of the picture. @returns {boolean} */
  get asMatrix() {
    return this.matrix.getAttribute('aria-pressed') === 'true';
  }

  /** Whether the whole picture is seen. @returns {boolean} */
  get isWhole() {
    const { zoom, shift } = this.camera;
    return zoom === 1 && shift.every((one) => Math.abs(one) < HALF);
  }

  /** What an address says of this page. @returns {string} */
  state() {
    const { controls, link } = this,
      said = new URLSearchParams(),
      curves = this.pinned;
    if (!controls.playing && link.look) said.set('step', String(link.look.step));
    if (!controls.playing || this.branches.isSeveral) said.set('branch', String(this.branches.current));
    if (controls.speed.value !== '1') said.set('speed', controls.speed.value);
    const isWhole = this.asMatrix || this.isWhole;
    if (!isWhole) said.set('view', this.seen().join(' '));
    if (!isWhole && this.window !== USUAL) said.set('window', this.window);
    if (curves !== this.begun) said.set('curves', curves);
    return said.toString();
  }

  /** The window that the picture is laid out for. @returns {string} */
  get window() {
    return this.link.scene?.window ?? USUAL;
  }

  /** Which part of the picture is seen: how many times as large as the whole, and the units in the middle of the window.
   * @returns {number[]} */
  seen() {
    const { camera } = this,
      [x, y] = camera.window;
    return [camera.zoom, ...camera.unit(x / 2, y / 2)].map((one) => Number(one.toPrecision(6)));
  }

  /** See this part of the picture, once the window has found its shape. @param {number[]} part */
  see([zoom, ...at]) {
    const { camera } = this;
    const see = () => {
      camera.way = null;
      camera.zoom = Math.min(64, Math.max(0.25, zoom));
      camera.shift = at.map((one, axis) => camera.scale * (camera.size[axis] / 2 + camera.corner[axis] - one));
      this.redraw();
    };
    requestAnimationFrame(() => requestAnimationFrame(see));
  }

  /** Have the run be at a step and go so fast, where this page may ask for that. @param {number | null} step @param {string | null} speed */
  run(step, speed) {
    const { controls, link } = this;
    if (!controls.owner) return;
    if ([...controls.speed.options].some(({ value }) => value === speed)) link.ask('speed', { value: speed });
    if (step !== null && Number.isSafeInteger(step) && step >= 0) link.ask('seek', { step });
  }

  /** Have the address say where the page is. */
  keep() {
    const state = this.state();
    if (!this.link.look || this.camera.way || location.hash.slice(1) === state) return;
    history.replaceState(null, '', state ? `#${state}` : location.pathname + location.search);
  }

  /** Go to where an address says. @param {URLSearchParams} said */
  restore(said) {
    const curves = said.get('curves'),
      branch = number(said.get('branch')),
      saved = said.get('saved');
    const view = said.get('view')?.split(' ').map(number) ?? [];
    if (view.length === 3 && !view.includes(null))
      this.fitting.see(said.get('window') ?? USUAL, () => this.see(/** @type {number[]} */ (view)));
    if (curves !== null) {
      const unknown = this.pins(curves.split('\n'));
      if (unknown.length) this.tell(`left out, as there is none here: ${unknown.join(', ')}`);
    }
    const missing = branch === null ? '' : this.branches.go(branch);
    if (missing) this.tell(missing);
    this.run(missing ? null : number(said.get('step')), said.get('speed'));
    if (saved) this.opens(saved);
    this.redraw();
  }
}
