/**
 * Saved views: where the page stood, by names, in a file beside the spec; gone to with a click.
 */

import { button, retype } from './naming.js';
import { refOf } from './protocol.js';
import { USUAL } from './share.js';

/** @typedef {import('./appearance.js').Appearance} Appearance */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Joined} Joined */
/** @typedef {import('./protocol.js').SavedView} SavedView */
/** @typedef {import('./share.js').Share} Share */
/** @typedef {import('./undo.js').Undo} Undo */
/** @typedef {import('./zoom.js').Zoom} Zoom */

/** What joins the signals of a curve: behind the first, in the same axis, in a plane. */
const JOINING = / (over|with|against) /;
/** The most characters of a measure, and of what is saved. */
const LONGEST = 500,
  LARGEST = 12000;

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
    /** what is to be seen in the next scene @type {number[] | null} */
    this.next = null;
    /** by their names; null until they are told @type {Object<string, SavedView> | null} */
    this.all = null;
    this.file = '';
    /** the one that is to be gone to as soon as they are told */
    this.wanted = '';
    /** the one that is being saved */
    this.saving = '';
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
      this.saving = name;
      share.link.ask('keep', { name, view });
      field.value = '';
    };
    share.opens = (name) => this.open(name);
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
    if (this.saving && Object.hasOwn(views, this.saving)) {
      this.undo.tell(`saved ${this.saving} in ${file}`);
      this.saving = '';
    }
    if (this.wanted) this.open(this.wanted);
  }

  /** List them. */
  rows() {
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
  }

  /** Have a view be called otherwise, in its place. @param {string} name @param {HTMLElement} place */
  rename(name, place) {
    retype(place, name, 'name of the view', (typed) => {
      const to = (typed ?? '').trim().replaceAll(/\s+/g, ' '),
        call = (/** @type {string} */ from, /** @type {string} */ called) => () =>
          this.share.link.ask('rekeep', { name: from, to: called });
      if (to && to !== name) this.undo.whole({ words: `view named ${to}`, undo: call(to, name), redo: call(name, to) });
    });
  }

  /** Take a view out of the file. @param {string} name @param {SavedView} view */
  forget(name, view) {
    const { link } = this.share;
    this.undo.whole({
      words: `deleted the view ${name}`,
      undo: () => link.ask('keep', { name, view }),
      redo: () => link.ask('unkeep', { name }),
    });
    this.undo.tell(`deleted the view ${name}`);
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

  /** Whether the matrix is shown in place of the picture. */
  asMatrix() {
    return this.share.matrix.getAttribute('aria-pressed') === 'true';
  }

  /** Where the page stands. @returns {SavedView} */
  state() {
    const { share, zoom } = this;
    return {
      step: share.link.look?.step ?? 0,
      speed: share.controls.speed.value,
      camera: this.asMatrix() ? null : this.units(share.seen(), false),
      curves: share.strips.pinned.map((strip) => {
        const [first, ...behind] = [strip.key, ...strip.behind].map((key) => this.named(key));
        const more = strip.joined.map(({ key }) => ` with ${this.named(key)}`);
        const against = strip.against ? ` against ${this.named(strip.against.key)}` : '';
        return [first, ...behind].join(' over ') + more.join('') + against;
      }),
      theme: this.appearance.chosen,
      closed: zoom.boxes.filter(({ id }) => zoom.hand.has(id)).map(({ path }) => path),
      shows: this.asMatrix() ? 'matrix' : this.appearance.shown.pathways ? 'pathways' : 'network',
      window: this.asMatrix() || share.window === USUAL ? null : share.window,
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

  /** How the file calls what is asked for by a key. @param {string} key @returns {string} */
  named(key) {
    const [id, what] = key.split('.'),
      group = this.share.strips.group(id),
      called = (group && refOf(group.data)) ?? group?.title ?? '';
    return what ? `${called}.${what}` : called;
  }

  /** By what is asked for what the file calls so, '' for nothing. @param {string} name @returns {string} */
  key(name) {
    const { attention, strips } = this.share,
      all = [...attention.groups.values(), ...strips.beside.groups.values()];
    /** @param {string} called */
    const id = (called) => all.find(({ data, title }) => (refOf(data) ?? title) === called)?.id ?? '';
    const own = id(name),
      dot = name.lastIndexOf('.'),
      other = own || dot < 0 ? '' : id(name.slice(0, dot));
    return own || (other && `${other}${name.slice(dot)}`);
  }

  /** Have a page, and the owner's run, be as a view says. @param {SavedView} view */
  show({ step, speed, camera, curves, theme, closed, shows, window }) {
    const { share, zoom } = this,
      missing = curves ? this.pin(curves) : [];
    if (closed) {
      missing.push(...closed.filter((path) => !zoom.boxes.some((box) => box.path === path)));
      zoom.hand = new Set(zoom.boxes.filter(({ path }) => closed.includes(path)).map(({ id }) => id));
      zoom.from = '';
    }
    if (theme !== null && theme !== this.appearance.chosen) this.appearance.choose(theme);
    const { appearance } = this,
      turns = shows !== null && (shows === 'pathways') !== appearance.shown.pathways && appearance.owner;
    if (shows === null ? camera && this.asMatrix() : (shows === 'matrix') !== this.asMatrix()) share.matrix.click();
    if (turns) appearance.toggle();
    this.next = turns ? camera : null;
    if (camera && !turns) share.fitting.see(window ?? USUAL, () => share.see(this.units(camera, true)));
    share.run(step, speed);
    if (missing.length) share.tell(`left out, as there is none here: ${missing.join(', ')}`);
    this.redraw();
  }

  /** Another scene is there, which a view may have asked for. */
  use() {
    const { next } = this;
    this.next = null;
    if (next) this.share.see(this.units(next, true));
  }

  /** Pin curves and nothing else; what is none any more. What nothing is called may be a measure: the owner's run is asked
   * for it, and they are pinned again when it is one. @param {string[]} curves @param {boolean} [asks] @returns {string[]} */
  pin(curves, asks = true) {
    const { controls, link, strips } = this.share,
      all = new Set(curves.flatMap((curve) => curve.split(JOINING).filter((_, at) => at % 2 === 0)));
    const keys = new Map([...all].map((name) => [name, this.key(name)])),
      unknown = [...all].filter((name) => !keys.get(name)),
      asked = asks && controls.owner ? unknown.filter((text) => text.length <= LONGEST) : [];
    this.waiting = asked.length ? { curves, texts: new Set(asked) } : null;
    if (controls.owner) {
      // a measure without a strip could not be taken away
      for (const { id } of strips.pinned)
        if (id[0] === 'm' && ![...keys.values()].includes(id)) link.ask('unmeasure', { number: Number(id.slice(1)) });
    }
    for (const text of asked) link.ask('measure', { text });
    strips.only(
      curves.flatMap((curve) => {
        const [first, ...more] = curve.split(JOINING),
          /** @type {Object<string, string[]>} */ beside = { over: [], with: [], against: [] };
        for (let at = 0; at < more.length; at += 2) if (keys.get(more[at + 1])) beside[more[at]].push(more[at + 1]);
        if (!keys.get(first)) return [];
        const names = [first, ...beside.over],
          keyed = (/** @type {string[]} */ some) => some.map((name) => keys.get(name) ?? '');
        return [
          {
            curve: { items: keyed(names), names },
            joined: keyed(beside.with),
            against: keyed(beside.against)[0],
          },
        ];
      }),
    );
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
