/**
 * Saved views: where the page stood, by names, in a file beside the spec; gone to with a click.
 */

/** @typedef {import('./appearance.js').Appearance} Appearance */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Joined} Joined */
/** @typedef {import('./protocol.js').SavedView} SavedView */
/** @typedef {import('./share.js').Share} Share */
/** @typedef {import('./undo.js').Undo} Undo */
/** @typedef {import('./zoom.js').Zoom} Zoom */

/** What joins the signals of a curve: behind the first, in the same axis, in a plane. */
const JOINING = / (over|with|against) /;

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
    /** by their names; null until they are told @type {Object<string, SavedView> | null} */
    this.all = null;
    this.file = '';
    /** the one that is to be gone to as soon as they are told */
    this.wanted = '';
    const field = /** @type {HTMLInputElement} */ (part('viewname'));
    this.form.onsubmit = (event) => {
      event.preventDefault();
      const name = field.value.trim();
      if (!name) return;
      share.link.ask('keep', { name, view: this.state() });
      field.value = '';
    };
    share.opens = (name) => this.open(name);
  }

  /** Who may save one. */
  status() {
    this.form.hidden = !this.all || !this.share.controls.owner;
  }

  /** They are told. @param {{file: string, views: Object<string, SavedView>, findings: string}} message */
  take({ file, views, findings }) {
    const before = this.all;
    [this.all, this.file] = [views, file];
    this.status();
    this.found.textContent = findings;
    this.found.hidden = !findings;
    this.list.replaceChildren(
      ...Object.keys(views).map((name) => {
        const row = document.createElement('li'),
          go = document.createElement('button');
        go.textContent = name;
        go.className = 'go';
        go.title = `go to the view that was saved in ${file}`;
        go.onclick = () => this.go(name);
        row.append(go);
        return row;
      }),
    );
    const fresh = before && Object.keys(views).find((name) => !(name in before));
    if (fresh) this.undo.tell(`saved ${fresh} in ${file}`);
    if (this.wanted) this.open(this.wanted);
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
      camera: this.asMatrix() ? null : share.seen(),
      curves: share.strips.pinned.map((strip) => {
        const [first, ...behind] = [strip.key, ...strip.behind].map((key) => this.named(key));
        const more = strip.joined.map(({ key }) => ` with ${this.named(key)}`);
        const against = strip.against ? ` against ${this.named(strip.against.key)}` : '';
        return [first, ...behind].join(' over ') + more.join('') + against;
      }),
      theme: this.appearance.chosen,
      closed: zoom.boxes.filter(({ id }) => zoom.hand.has(id)).map(({ path }) => path),
    };
  }

  /** How the file calls what is asked for by a key. @param {string} key @returns {string} */
  named(key) {
    const [id, what] = key.split('.'),
      group = this.share.strips.group(id),
      called = group?.data.neuron ?? group?.data.connection ?? group?.title ?? '';
    return what ? `${called}.${what}` : called;
  }

  /** By what is asked for what the file calls so, '' for nothing. @param {string} name @returns {string} */
  key(name) {
    const { attention, strips } = this.share,
      all = [...attention.groups.values(), ...strips.beside.groups.values()];
    /** @param {string} called */
    const id = (called) =>
      all.find(({ data, title }) => (data.neuron ?? data.connection ?? title) === called)?.id ?? '';
    const own = id(name),
      dot = name.lastIndexOf('.'),
      other = own || dot < 0 ? '' : id(name.slice(0, dot));
    return own || (other && `${other}${name.slice(dot)}`);
  }

  /** Have a page, and the owner's run, be as a view says. @param {SavedView} view */
  show({ step, speed, camera, curves, theme, closed }) {
    const { share, zoom } = this,
      missing = curves ? this.pin(curves) : [];
    if (closed) {
      missing.push(...closed.filter((path) => !zoom.boxes.some((box) => box.path === path)));
      zoom.hand = new Set(zoom.boxes.filter(({ path }) => closed.includes(path)).map(({ id }) => id));
      zoom.from = '';
    }
    if (theme !== null && theme !== this.appearance.chosen) this.appearance.choose(theme);
    if (camera && this.asMatrix()) this.share.matrix.click();
    if (camera) share.see(camera);
    share.run(step, speed);
    if (missing.length) share.tell(`left out, as there is none here: ${missing.join(', ')}`);
    this.redraw();
  }

  /** Pin curves and nothing else; what is none any more. @param {string[]} curves @returns {string[]} */
  pin(curves) {
    const { controls, link, strips } = this.share,
      /** @type {string[]} */ missing = [],
      keys = new Map();
    for (const name of curves.flatMap((curve) => curve.split(JOINING).filter((_, at) => at % 2 === 0))) {
      const key = this.key(name);
      keys.set(name, key);
      if (key) continue;
      // what nothing is called is a measure, which is a curve of its own when the run has it
      if (controls.owner) link.ask('measure', { text: name });
      else missing.push(name);
    }
    strips.pinned = [];
    for (const curve of curves) {
      const [first, ...more] = curve.split(JOINING),
        /** @type {Object<string, string[]>} */ beside = { over: [], with: [], against: [] };
      for (let at = 0; at < more.length; at += 2) if (keys.get(more[at + 1])) beside[more[at]].push(more[at + 1]);
      if (!keys.get(first) || strips.full) continue;
      const names = [first, ...beside.over],
        joined = beside.with.map((name) => keys.get(name)),
        [against] = beside.against.map((name) => keys.get(name));
      strips.put({ items: names.map((name) => keys.get(name)), names }, joined, against);
    }
    strips.list();
    return missing;
  }
}
