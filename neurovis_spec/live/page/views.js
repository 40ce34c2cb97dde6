/**
 * Saved views: where the page stood, by names, in a file beside the spec; gone to with a click.
 */

import { button, retype } from './naming.js';
import { USUAL } from './share.js';

/** @typedef {import('./appearance.js').Appearance} Appearance */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Joined} Joined */
/** @typedef {import('./protocol.js').SavedView} SavedView */
/** @typedef {import('./share.js').Share} Share */
/** @typedef {import('./strips.js').Strip} Strip */
/** @typedef {import('./undo.js').Undo} Undo */
/** @typedef {import('./zoom.js').Zoom} Zoom */

/** The most characters of a measure, and of what is saved. */
const LONGEST = 500,
  LARGEST = 12000;

/** A name as the file has it: as it was typed, without what is blank at its ends. @param {string} name @returns {string} */
const spaced = (name) => name.trim().replaceAll(/\s/g, ' ');

/** The ids of the measures that strips show. @param {Strip[]} strips @returns {Set<string>} */
const measuresIn = (strips) =>
  new Set(
    strips
      .flatMap(({ key, behind, joined, against }) => [
        ...[key, ...behind, ...joined.map((one) => one.key)],
        against?.key ?? '',
      ])
      .filter((id) => id[0] === 'm'),
  );

/** The views that are saved. */
export class Views {
  /** @param {Share} share @param {Zoom} zoom @param {Appearance} appearance @param {Undo} undo @param {() => void} redraw
   * @param {(id: string) => HTMLElement} part */
  constructor(share, zoom, appearance, undo, redraw, part) {
    this.share = share;
    this.zoom = zoom;
    this.appearance = appearance;
    this.undo = undo;
    this.redraw = redraw;
    this.form = /** @type {HTMLFormElement} */ (part('keep'));
    this.list = part('views');
    this.found = part('viewsfound');
    this.owner = false;
    /** a view of another picture than the one that is shown: the rest of it waits for that @type {SavedView | null} */
    this.later = null;
    /** the one that is being named */
    this.naming = '';
    /** what was asked of the file: an act as soon as it is told to be so, by which is seen that it is
     * @type {{act: import('./undo.js').Act, isDone: (all: Object<string, SavedView>) => boolean, words: string} | null} */
    this.pending = null;
    /** by their names; null until they are told @type {Object<string, SavedView> | null} */
    this.all = null;
    this.file = '';
    /** the one that is to be gone to as soon as they are told */
    this.wanted = '';
    /** curves that wait for measures, and for which, by their texts @type {{curves: string[], texts: Set<string>} | null} */
    this.waiting = null;
    const field = /** @type {HTMLInputElement} */ (part('viewname'));
    this.form.onsubmit = (event) => {
      event.preventDefault();
      const name = field.value.trim();
      if (!name) return;
      const view = this.state();
      if (JSON.stringify(view).length > LARGEST) {
        share.tell('too many curves and closed boxes for a view');
        return;
      }
      this.save(name, view);
      field.value = '';
    };
    share.opens = (name) => this.open(name);
    share.pins = (texts) => this.pin(texts);
  }

  /** Who may save one. */
  status() {
    const { owner } = this.share.controls;
    if (this.all && this.owner !== owner) this.rows();
    this.owner = owner;
    this.form.hidden = !this.all || !owner;
  }

  /** They are told. @param {{file: string, views: Object<string, SavedView>, findings: string}} message */
  take({ file, views, findings }) {
    [this.all, this.file] = [views, file];
    this.status();
    this.found.textContent = findings;
    this.found.hidden = !findings;
    this.rows();
    if (this.pending?.isDone(views)) {
      this.undo.act(this.pending.act);
      this.undo.tell(this.pending.words);
      this.pending = null;
    }
    if (this.wanted) this.open(this.wanted);
  }

  /** What was asked is not done. */
  refused() {
    this.pending = null;
  }

  /** Ask for something of the file, which can be undone as soon as it is told to be so. @param {string} words
   * @param {(all: Object<string, SavedView>) => boolean} isDone @param {() => void} redo @param {() => void} undo */
  ask(words, isDone, redo, undo) {
    this.pending = { act: { words, undo, redo }, isDone, words };
    redo();
  }

  /** Save a view, in place of one that is called so. @param {string} typed @param {SavedView} view */
  save(typed, view) {
    const { link } = this.share,
      name = spaced(typed),
      before = this.all?.[name],
      keep = (/** @type {SavedView} */ one) => () => link.ask('keep', { name, view: one });
    this.ask(
      `saved ${name} in ${this.file}`,
      (all) => Object.hasOwn(all, name),
      keep(view),
      before ? keep(before) : () => link.ask('unkeep', { name }),
    );
  }

  /** List them. */
  rows() {
    if (this.naming && this.all && Object.hasOwn(this.all, this.naming)) return;
    this.naming = '';
    const focused = this.list.contains(document.activeElement);
    const rows = Object.entries(this.all ?? {}).map(([name, view]) => {
      const row = document.createElement('li'),
        go = button(name, '', () => this.go(name));
      go.className = 'go';
      go.title = `go to the view that was saved in ${this.file}`;
      row.append(go);
      if (this.share.controls.owner) {
        const rename = button('rename', `rename ${name}`, () => this.rename(name, go)),
          forget = button('delete', `delete ${name}`, () => this.forget(name, view));
        rename.className = forget.className = 'small';
        row.append(rename, forget);
      }
      return row;
    });
    this.list.replaceChildren(...rows);
    if (focused) (this.list.querySelector('button') || this.form.querySelector('input'))?.focus();
  }

  /** Have a view be called otherwise, in its place. @param {string} name @param {HTMLElement} place */
  rename(name, place) {
    this.naming = name;
    retype(place, name, 'name of the view', (typed) => {
      const to = spaced(typed ?? ''),
        call = (/** @type {string} */ from, /** @type {string} */ called) => () =>
          this.share.link.ask('rekeep', { name: from, to: called });
      this.naming = '';
      this.rows();
      if (to && to !== name)
        this.ask(`view named ${to}`, (all) => Object.hasOwn(all, to), call(name, to), call(to, name));
    });
  }

  /** Take a view out of the file. @param {string} name @param {SavedView} view */
  forget(name, view) {
    const { link } = this.share;
    this.ask(
      `deleted the view ${name}`,
      (all) => !Object.hasOwn(all, name),
      () => link.ask('unkeep', { name }),
      () => link.ask('keep', { name, view }),
    );
  }

  /** The page was opened with a view. @param {string} name */
  open(name) {
    this.wanted = this.all ? '' : name;
    if (!this.all) return;
    if (Object.hasOwn(this.all, name)) this.show(this.all[name]);
    else this.share.tell(`there is no view ${name} in ${this.file}`);
  }

  /** Go to a view, so that it can be undone. @param {string} name */
  go(name) {
    const before = this.state(),
      view = this.all?.[name];
    if (!view) return;
    this.undo.whole({ words: `went to ${name}`, undo: () => this.show(before), redo: () => this.show(view) });
  }

  /** Where the page stands. @returns {SavedView} */
  state() {
    const { share, zoom } = this;
    return {
      step: share.link.look?.step ?? 0,
      speed: share.controls.speed.value,
      camera: share.asMatrix ? null : share.isWhole ? 'whole' : this.units(share.seen(), false),
      curves: share.curves.pinned,
      theme: this.appearance.chosen,
      closed: zoom.boxes.filter(({ id }) => zoom.hand.has(id)).map(({ path }) => path),
      shows: share.asMatrix ? 'matrix' : this.appearance.shown.pathways ? 'pathways' : 'network',
      window: share.asMatrix || share.isWhole || share.window === USUAL ? null : share.window,
    };
  }

  /** A part of the picture in units of the layout, as the file has it, or of one there in those of the picture.
   * @param {number[]} part @param {boolean} back @returns {number[]} */
  units([zoom, ...at], back) {
    const { scale = 0, left = 0, top = 0 } = this.share.link.scene?.constants ?? {};
    if (!scale) return [zoom, ...at];
    const from = [left, top];
    const there = at.map((one, axis) => (back ? from[axis] + scale * one : (one - from[axis]) / scale));
    return [zoom, ...there.map((one) => Number(one.toPrecision(6)))];
  }

  /** Have a page, and the owner's run, be as a view says; what is of another picture than the one that is shown waits for
   * that. @param {SavedView} view */
  show(view) {
    const { appearance, share } = this,
      { camera, shows, step, speed, theme } = view;
    if (theme !== null && theme !== appearance.chosen) appearance.choose(theme);
    if (shows === null ? camera && share.asMatrix : (shows === 'matrix') !== share.asMatrix) share.matrix.click();
    if (shows !== null) appearance.have(shows === 'pathways');
    share.run(step, speed);
    this.later = view;
    this.use();
  }

  /** Do the rest of what a view says, once the picture is there of which that is; for who cannot have it at once. */
  use() {
    const { later, appearance, share } = this,
      { scene } = share.link;
    if (!later || !scene) return;
    const { shows } = later,
      isOther = shows !== null && (shows === 'pathways') !== scene.pathways;
    if (isOther && appearance.owner) return;
    this.later = null;
    this.finish(later, isOther);
  }

  /** Curves, closed boxes and the part that is seen, but for a part of another picture. @param {SavedView} view @param {boolean} isOther */
  finish({ camera, curves, closed, window }, isOther) {
    const { share, zoom } = this,
      missing = curves ? this.pin(curves) : [];
    if (closed) {
      missing.push(...closed.filter((path) => !zoom.boxes.some((box) => box.path === path)));
      zoom.hand = new Set(zoom.boxes.filter(({ path }) => closed.includes(path)).map(({ id }) => id));
      zoom.from = '';
    }
    if (camera === 'whole') share.camera.fit();
    else if (camera && !isOther) share.fitting.see(window ?? USUAL, () => share.see(this.units(camera, true)));
    if (missing.length) share.tell(`left out, as there is none here: ${missing.join(', ')}`);
    this.redraw();
  }

  /** Pin curves and nothing else; what is none any more. What nothing is called may be a measure: the owner's run is asked
   * for it, and they are pinned again when it is one. @param {string[]} curves @param {boolean} [asks] @returns {string[]} */
  pin(curves, asks = true) {
    const { controls, curves: named, link } = this.share,
      before = named.strips.pinned,
      unknown = named.pin(curves),
      asked = asks && controls.owner ? unknown.filter((text) => text.length <= LONGEST) : [];
    this.waiting = asked.length ? { curves, texts: new Set(asked) } : null;
    if (controls.owner) {
      // a measure without a strip could not be taken away
      const kept = measuresIn(named.strips.pinned);
      for (const id of measuresIn(before)) if (!kept.has(id)) link.ask('unmeasure', { number: Number(id.slice(1)) });
    }
    for (const text of asked) link.ask('measure', { text });
    return unknown.filter((name) => !asked.includes(name));
  }

  /** Whether a text is a measure has been told. @param {{text: string, findings: object[]}} message */
  measured({ text, findings }) {
    if (!this.waiting?.texts.has(text) || !findings.length) return;
    this.share.tell(`left out, as there is none: ${text}`);
    this.met([text]);
  }

  /** There are these measures. @param {{text: string}[]} measures */
  measures(measures) {
    this.met(measures.map(({ text }) => text));
  }

  /** It is known what these are: where nothing is waited for any more, all that there is is pinned. @param {string[]} texts */
  met(texts) {
    const { waiting } = this;
    if (!waiting || !texts.some((text) => waiting.texts.delete(text)) || waiting.texts.size) return;
    this.pin(waiting.curves, false);
    this.redraw();
  }
}
