/**
 * Strips: how what is held and what is pinned went, below the network, over the time axis of the scrubber.
 */

import { signed } from './attention.js';
import { again, COLOURS, offer, plane, taken } from './joining.js';
import { namesOf } from './protocol.js';
import { THUMB } from './scrubber.js';
import { Seldom } from './seldom.js';
import { Sized } from './sized.js';
import { dot } from './spikes.js';

/** @typedef {import('./attention.js').Attention} Attention */
/** @typedef {import('./axis.js').Axis} Axis */
/** @typedef {import('./beside.js').Beside} Beside */
/** @typedef {import('./protocol.js').Curve} Curve */
/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Raster} Raster */
/** @typedef {import('./protocol.js').Traces} Traces */
/** @typedef {import('./scrubber.js').Scrubber} Scrubber */
/** @typedef {import('./joining.js').Joined} Joined */
/** How large a canvas is on the page, and in which colours it is drawn.
 * @typedef {{width: number, height: number, line: string, ink: string}} Room */
/** The ranges of a trace. @typedef {{trace: Float32Array, first: number, every: number}} Seen */
/** What it shows of a neuron or a connection: its activity or weight where `what` is empty; `key` is what that is asked by,
 * `told` what it is called; behind it, in the same axis, `behind`; `names` and `seen` are the names
 * of all of these, and their ranges. Signals that are `joined` have the same axis; `against` another it is drawn in a plane.
 * @typedef {{id: string, what: string, key: string, told: string, behind: string[], names: string[], seen: Seen[], left: Seen | null, joined: Joined[], against: Joined | null, join: HTMLSelectElement, data: string, name: HTMLButtonElement, choice: HTMLSelectElement, value: HTMLElement,
 *   canvas: HTMLCanvasElement, ends: HTMLElement[], pin: HTMLButtonElement, parts: HTMLElement[]}} Strip */

/** What a model with a spike block has, 1 in the steps in which it fires. */
const SPIKE = 'spike';

/** What a strip shows that is the raster of a neuron's group: no name. */
const RASTER = '*';

/** How wide a curve is, in pixels: one is drawn some thirty times as quickly as a little more, which has an outline; and how
 * many bins are drawn in one go, as what an outline costs grows faster than its length. */
const THIN = 1,
  STRETCH = 32;
/** The most strips that are pinned; the most that is drawn at once: what joined curves are besides is left out; how high marks of spikes are; how high a strip is, in windows of at least which height two begin, and which share of the window those have that a page begins with; how pale that behind another is, and that of a future that was left; how wide the first of these; how many characters an end of an axis has room for; how far what is said stands off the pointer, in pixels of a page; milliseconds between two traces that are asked for, and until one is asked for again. */
const PINS = 8,
  TRACED = 24,
  MARK = 6,
  HIGH = 72,
  LOW = 450,
  SHARE = 0.3,
  PALE = 0.3,
  FAINT = 0.5,
  WIDE = 4,
  FITS = 7,
  AWAY = 6,
  PACE = 40,
  LOST = 2000;

/** Values have 32 bits: what differs by less than this share of them is rounding, and a curve that is at rest. */
const ROUNDING = 1e-6;
/** How many digits an end of an axis has, and fewer than how many where both would be the same. */
const FEW = 3,
  MOST = 9;

/** A new element with a class. @template {keyof HTMLElementTagNameMap} T @param {T} tag @param {string} of
 * @returns {HTMLElementTagNameMap[T]} */
function element(tag, of) {
  const made = document.createElement(tag);
  made.className = of;
  return made;
}

/** The strips: first what is pinned, at the end what is held. */
export class Strips {
  /** @param {Link} link @param {Attention} attention @param {Beside} beside @param {Scrubber} scrubber @param {Axis} axis
   * @param {HTMLElement} place @param {HTMLElement} under what is said of where the pointer is */
  constructor(link, attention, beside, scrubber, axis, place, under) {
    this.axis = axis;
    this.under = under;
    this.size = new Sized(place, () => this.show());
    this.link = link;
    this.attention = attention;
    this.beside = beside;
    /** the ids of the measures that have had a strip @type {Set<string>} */
    this.met = new Set();
    /** the measures that there are, as a text */
    this.typed = '[]';
    this.scrubber = scrubber;
    this.place = place;
    /** @type {Strip[]} */
    this.pinned = [];
    this.held = this.strip();
    this.asked = '';
    this.when = -LOST;
    /** whether what changes the run is taken from here */
    this.owner = false;
    /** whether an answer is awaited */
    this.waiting = false;
    /** how the future went that was left last @type {Traces | null} */
    this.left = null;
    /** the values of what is drawn in planes, and those of now that are drawn in them @type {Traces | null} */
    this.paired = null;
    this.pointed = attention.values;
    /** those of the future that was left, as they have come, and as they are drawn @type {Traces | null} */
    this.leftPaired = null;
    /** @type {Traces | null} */
    this.beyond = null;
    /** the branch that all is compared with, null for the one that was left last, and what it is called @type {number | null} */
    this.branch = null;
    this.called = '';
    this.timer = 0;
    this.values = new Seldom(() => this.say());
    this.of(this.held, undefined);
    this.list();
  }

  /** A strip of nothing. @returns {Strip} */
  strip() {
    const name = element('button', 'of'),
      value = element('span', 'now'),
      choice = element('select', 'what'),
      join = element('select', 'what join'),
      label = element('div', 'label');
    const canvas = element('canvas', 'trace'),
      ends = [element('span', 'end'), element('span', 'end')];
    const pin = element('button', 'pin'),
      scale = element('div', 'scale'),
      numbers = element('div', 'ends');
    /** @type {Strip} */
    const strip = {
      id: '',
      what: '',
      key: '',
      told: '',
      behind: [],
      names: [],
      seen: [],
      joined: [],
      against: null,
      join,
      left: null,
      data: '',
      name,
      choice,
      value,
      canvas,
      ends,
      pin,
      parts: [label, canvas, scale],
    };
    label.append(name, choice, value, join);
    join.onchange = () => this.join(strip, join.value);
    numbers.append(...ends);
    scale.append(numbers, pin);
    canvas.setAttribute('role', 'img');
    name.onclick = () => {
      if (this.attention.groups.has(strip.id)) this.attention.hold(strip.id);
    };
    pin.onclick = () => this.toggle(strip);
    choice.onchange = () => {
      this.of(strip, this.group(strip.id), choice.value);
      if (strip !== this.held) this.of(this.held, this.attention.groups.get(this.held.id), this.held.what);
      this.list();
    };
    canvas.onpointerleave = () => this.point(null);
    canvas.onpointerdown = canvas.onpointermove = (/** @type {PointerEvent} */ event) => {
      if (strip.against || event.shiftKey) return;
      this.point(event.offsetX);
      if (event.buttons !== 1 || this.scrubber.scrub.disabled) return;
      canvas.setPointerCapture(event.pointerId);
      this.scrubber.seek(this.scrubber.under(event.offsetX, canvas.clientWidth));
    };
    return strip;
  }

  /** The neuron, the connection, or what else has an id. @param {string} id @returns {Group | undefined} */
  group(id) {
    return this.beside.groups.get(id) ?? this.attention.groups.get(id);
  }

  /** Whether there is no room for another strip. */
  get full() {
    return this.pinned.length >= PINS;
  }

  /** The id of what is called so, '' where nothing is. @param {string} name @returns {string} */
  named(name) {
    const shown = name.replaceAll(/\s*->\s*/g, ' → '),
      all = [...this.attention.groups.values(), ...this.beside.groups.values()];
    return all.find(({ data, title }) => data.neuron === name || title.split('\n')[0] === shown)?.id ?? '';
  }

  /** What is behind the first signal of a strip, as far as it is there by now. @param {Strip} strip @returns {Curve} */
  behind({ behind, names }) {
    const found = behind.flatMap((key, at) => {
      const what = key.split('.')[1],
        name = names[1 + at],
        id = this.named(what ? name.slice(0, -what.length - 1) : name);
      return id ? [{ item: what ? `${id}.${what}` : id, name }] : [];
    });
    return { items: ['', ...found.map(({ item }) => item)], names: [names[0], ...found.map(({ name }) => name)] };
  }

  /** Show of what a strip shows besides only what there is by now. @param {Strip} strip @param {Group[]} groups */
  lose(strip, groups) {
    const before = strip.joined.length + Number(strip.against !== null);
    strip.joined = again(strip.joined, groups);
    [strip.against = null] = again(strip.against ? [strip.against] : [], groups);
    if (strip.joined.length + Number(strip.against !== null) < before)
      this.of(strip, this.group(strip.id), strip.what, { items: ['', ...strip.behind], names: strip.names });
  }

  /** Pin the strip of an id, where it is not yet. @param {string} id */
  pin(id) {
    if (!this.pinned.some(({ key }) => key === id)) this.toggle({ id, what: '', key: id });
  }

  /** There are these measures: each gets a strip, and loses it with the measure. @param {{number: number, text: string}[]} measures */
  measures(measures) {
    if (JSON.stringify(measures) === this.typed) return;
    this.typed = JSON.stringify(measures);
    this.beside.measure(measures);
    const all = [...this.attention.groups.values(), ...this.beside.groups.values()];
    this.pinned = this.pinned.filter(({ id }) => id[0] !== 'm' || this.group(id));
    for (const strip of this.pinned) this.lose(strip, all);
    const ids = measures.map(({ number }) => `m${number}`),
      fresh = ids.filter((id) => !this.met.has(id));
    this.met = new Set(ids);
    for (const id of fresh) this.pin(id);
    if (!fresh.length) this.list();
  }

  /** Show another signal in the same axis, or in a plane, or each by itself again. @param {Strip} strip @param {string} how */
  join(strip, how) {
    const [verb, place] = how.split(' '),
      other = [...this.pinned, this.held][Number(place)],
      apart = strip.joined;
    if (verb === 'with' && other) {
      strip.joined = [...strip.joined, taken(other), ...other.joined];
      this.pinned = this.pinned.filter((one) => one !== other);
    } else if (verb === 'against' && other) strip.against = taken(other);
    else if (verb === 'apart') strip.joined = [];
    else if (verb === 'time') strip.against = null;
    this.of(strip, this.group(strip.id), strip.what, { items: ['', ...strip.behind], names: strip.names });
    if (verb === 'apart') for (const { id, what, key } of apart) this.toggle({ id, what, key });
    this.list();
    strip.join.focus();
  }

  /** Pin the strips that a page begins with, as far as there is room for them. @param {Curve[]} curves */
  begin(curves) {
    const most = Math.max(innerHeight < LOW ? 1 : 2, Math.floor((SHARE * innerHeight) / HIGH) - 1);
    for (const curve of curves.slice(0, most)) this.put(curve);
    this.list();
  }

  /** Pin these curves, as far as there is room, and nothing else: each with others in its axis, or against another, by what
   * these are asked for. @param {{curve: Curve, joined: string[], against?: string}[]} curves */
  only(curves) {
    this.pinned = [];
    for (const { curve, joined, against } of curves.slice(0, PINS)) this.put(curve, joined, against);
    this.list();
  }

  /** Pin a curve, to be listed then, with others in its axis, or against another. @param {Curve} curve @param {string[]} [joined]
   * by what these are asked for @param {string} [against] */
  put({ items, names }, joined = [], against = '') {
    const [id, what] = items[0].split('.'),
      strip = this.strip();
    this.pinned.push(strip);
    strip.joined = joined.map((key) => this.taken(key));
    strip.against = against ? this.taken(against) : null;
    this.of(strip, this.group(id), what, { items, names });
  }

  /** What is asked for by a key, to be shown by another strip. @param {string} key @returns {Joined} */
  taken(key) {
    const [id, what = ''] = key.split('.'),
      group = this.group(id),
      called = group ? group.title.split('\n')[0] : '';
    return { id, what, key, name: what ? `${called}.${what}` : called, data: JSON.stringify(group?.data) };
  }

  /** Say what all strips show below the pointer. @param {number | null} x pixels across a strip, null where it is on none */
  point(x) {
    this.under.hidden = x === null;
    if (x === null) return;
    const { clientWidth: width, offsetLeft } = this.held.canvas,
      step = this.scrubber.under(x, width);
    const told = (/** @type {Seen} */ { trace, first, every }) => {
      const bin = Math.floor((step - first) / every),
        [least, most] = [trace[2 * bin], trace[2 * bin + 1]];
      return least <= most ? `${signed(rounded(least))}${most > least ? ` … ${signed(rounded(most))}` : ''}` : '';
    };
    const lines = [...this.pinned, this.held].flatMap(({ names, seen, left }) =>
      seen.map((one, at) => {
        const [now, other] = [told(one), left && at === 0 ? told(left) : ''];
        const beside = other && `  (${this.called || 'before'} ${other})`;
        return now || other ? `${names[at]}  ${now}${beside}` : '';
      }),
    );
    const box = /** @type {HTMLElement} */ (
      this.under.firstChild ?? this.under.appendChild(document.createElement('div'))
    );
    box.textContent = [this.axis.words(step), ...lines.filter(Boolean)].join('\n');
    const at = THUMB + this.scrubber.across(step) * (width - 2 * THUMB);
    const isLate = at > width / 2,
      left = offsetLeft + at,
      room = isLate ? left : this.place.clientWidth - left,
      over = Math.max(0, box.offsetWidth + AWAY - room);
    this.under.classList.toggle('late', isLate);
    box.style.translate = `${isLate ? over : -over}px`;
    this.under.style.transform = `translateX(${(offsetLeft + at).toFixed(1)}px)`;
  }

  /** Say what a strip is of. @param {Strip} strip @param {Group | undefined} group @param {string} [what] the name of what it
   * shows, where there is that @param {Curve} [curve] what is behind that, from its second signal on */
  of(strip, group, what = '', curve = { items: [], names: [] }) {
    const called = group ? group.title.split('\n')[0] : '',
      isPinned = strip !== this.held;
    [strip.id, strip.data] = group ? [group.id, JSON.stringify(group.data)] : ['', ''];
    const names = namesOf(this.link.scene, strip.id),
      fires = strip.id[0] === 'n' && names.includes(SPIKE);
    strip.what = names.includes(what) || (fires && what === RASTER) ? what : '';
    strip.canvas.classList.toggle('raster', strip.what === RASTER);
    strip.key = strip.what ? `${strip.id}.${strip.what}` : strip.id;
    strip.told = strip.what === RASTER ? `the group of ${called}` : strip.what ? `${called}, ${strip.what}` : called;
    strip.behind = curve.items.slice(1);
    strip.names = [strip.what && strip.what !== RASTER ? `${called}.${strip.what}` : called, ...curve.names.slice(1)];
    strip.names.splice(1 + strip.behind.length);
    strip.names.push(...strip.joined.map(({ name: one }) => one));
    if (strip.names.length > 1) strip.told = strip.names.join(' and ');
    if (strip.against) strip.told = `${strip.names[0]} against ${strip.against.name}`;
    strip.canvas.classList.toggle('plane', strip.against !== null);
    const again = !isPinned && this.pinned.some(({ key }) => key === strip.key);
    const first = group?.data.neuron === undefined ? 'weight' : (group.data.state ?? 'activity');
    strip.choice.replaceChildren(
      ...[first, ...names.filter((one) => one !== first)].map((one, at) => new Option(one, at ? one : '')),
      ...(fires ? [new Option('raster', RASTER)] : []),
    );
    strip.choice.value = strip.what;
    strip.choice.hidden = !fires && !names.some((one) => one !== first);
    strip.choice.setAttribute('aria-label', `what is shown of ${called}`);
    strip.name.textContent = called;
    strip.name.title = called;
    for (const other of curve.names.slice(1, 1 + strip.behind.length)) {
      const behind = element('span', 'behind');
      behind.textContent = other;
      strip.name.append(behind);
    }
    for (const [at, other] of strip.joined.entries()) {
      const joined = element('span', 'joined');
      joined.textContent = other.name;
      joined.style.borderColor = COLOURS[at % COLOURS.length];
      strip.name.append(joined);
    }
    if (strip.against) strip.name.append(` against ${strip.against.name}`);
    strip.name.title = strip.told;
    strip.join.setAttribute('aria-label', `show ${called} with another, or against it`);
    strip.pin.textContent = isPinned ? '×' : 'pin';
    strip.pin.setAttribute('aria-label', `${isPinned ? 'unpin' : 'pin'} ${strip.told}`);
    strip.pin.hidden = again || (!isPinned && this.pinned.length >= PINS);
    this.place.classList.toggle('nothing', !this.held.id);
    strip.canvas.setAttribute('aria-label', `${strip.what === RASTER ? 'raster' : 'trace'} of ${strip.told}`);
    this.clear(strip);
  }

  /** Show no trace. @param {Strip} strip */
  clear(strip) {
    for (const part of [strip.value, ...strip.ends]) part.textContent = '';
    strip.canvas.width = 0;
    [strip.seen, strip.left] = [[], null];
    this.asked = '';
  }

  /** Compare with a branch, or, where that is null, with the one that was left last. @param {number | null} branch @param {string} called */
  compare(branch, called) {
    [this.branch, this.called] = [branch, called];
    this.asked = '';
    this.show();
  }

  /** Another network; what has the same name in it stays pinned. */
  use() {
    const groups = [...this.attention.groups.values(), ...this.beside.groups.values()];
    this.pinned = this.pinned.filter((strip) => {
      const same = groups.find(({ data }) => JSON.stringify(data) === strip.data);
      this.lose(strip, groups);
      if (same) this.of(strip, same, strip.what, this.behind(strip));
      return same;
    });
    this.of(this.held, this.attention.groups.get(this.held.id), this.held.what);
    [this.waiting, this.paired] = [false, null];
    this.list();
  }

  /** Something is held, or nothing. @param {Group | undefined} group */
  hold(group) {
    if ((group ? group.id : '') !== this.held.id) this.of(this.held, group);
    this.want();
    this.show();
  }

  /** Pin what a strip shows, by default that of what is held, or unpin it; a measure is none any more then.
   * @param {Pick<Strip, 'id' | 'what' | 'key'>} [of] */
  toggle({ id, what, key } = this.held) {
    if (id[0] === 'm' && this.owner && this.pinned.some((strip) => strip.key === key))
      this.link.ask('unmeasure', { number: Number(id.slice(1)) });
    const group = this.group(id),
      known = this.pinned.findIndex((strip) => strip.key === key);
    const focused = this.place.contains(document.activeElement);
    if (!group || (known < 0 && this.pinned.length >= PINS)) return;
    if (known < 0) {
      const strip = this.strip();
      this.pinned.push(strip);
      this.of(strip, group, what);
    } else this.pinned.splice(known, 1);
    this.of(this.held, this.attention.groups.get(this.held.id), this.held.what);
    this.list();
    const { pin } =
      this.pinned[known < 0 ? this.pinned.length - 1 : Math.min(known, this.pinned.length - 1)] || this.held;
    if (focused) (pin.checkVisibility({ visibilityProperty: true }) ? pin : this.scrubber.scrub).focus();
  }

  /** By what the spikes are asked for that are marked in a strip; '' where none are. @param {Strip} strip */
  marks({ id, what }) {
    return id[0] === 'n' && what !== SPIKE && what !== RASTER && namesOf(this.link.scene, id).includes(SPIKE)
      ? `${id}.${SPIKE}`
      : '';
  }

  /** Have the values of what is shown asked for. */
  want() {
    const all = [...this.pinned, this.held];
    this.attention.also = [
      ...this.traced().flatMap((strip) => this.keys(strip)),
      ...all.flatMap(({ key, against }) => (against ? [key, against.key] : [])),
    ];
  }

  /** By what all is asked for that a strip shows over time. @param {Strip} strip */
  keys({ key, behind, joined }) {
    return [key, ...behind, ...joined.map((one) => one.key)];
  }

  /** The strips that show traces. */
  traced() {
    return [...this.pinned, this.held].filter(({ what, against }) => what !== RASTER && !against);
  }

  /** Show the strips that there are. */
  list() {
    for (const strip of this.pinned) offer(strip, [...this.pinned, this.held]);
    this.held.join.hidden = true;
    this.want();
    this.attention.ask();
    const focused = /** @type {HTMLElement} */ (document.activeElement);
    this.place.replaceChildren(...[...this.pinned, this.held].flatMap(({ parts }) => parts));
    if (this.place.contains(focused)) focused.focus();
    this.show();
  }

  /** Say the values of now. */
  say() {
    for (const { key, value } of [...this.pinned, this.held]) {
      const now = this.attention.values[key];
      write(value, key && now !== undefined ? signed(now) : '');
    }
  }

  /** Ask for the traces of the steps on the axis, where others are known. */
  show() {
    const { look } = this.link;
    if (!look) return;
    const { low, high, events, known: turned } = this.scrubber,
      width = Math.max(1, this.axis.size.wide - 2 * THUMB);
    const traced = this.traced(),
      others = [...this.pinned, this.held].filter(({ what }) => what === RASTER),
      pairs = [...new Set(this.pinned.flatMap(({ key, against }) => (against ? [key, against.key] : [])))];
    const items = [...new Set(traced.flatMap((strip) => [this.marks(strip), ...this.keys(strip)]))]
        .filter(Boolean)
        .slice(0, TRACED),
      rasters = [...new Set(others.map(({ id }) => id))].slice(0, PINS);
    this.values.ask();
    if (this.paired && this.pointed !== this.attention.values) this.pairs(this.paired);
    const every = Math.max(1, Math.ceil((high - low + 1) / Math.min(width, 2000))),
      now = performance.now();
    const first = Math.floor(low / every) * every;
    const wanted = [
      look.last,
      low,
      high,
      width,
      this.size.high,
      devicePixelRatio,
      events.length,
      turned.length,
      ...items,
      '/',
      ...rasters,
      '/',
      ...pairs,
    ].join(' ');
    if (!(items.length || rasters.length || pairs.length) || wanted === this.asked) return;
    const wait = this.when + (this.waiting ? LOST : PACE) - now;
    clearTimeout(this.timer);
    if (wait > 0) {
      this.timer = setTimeout(() => this.show(), wait);
      return;
    }
    [this.asked, this.when, this.waiting] = [wanted, now, true];
    const more = {
      ...(rasters.length ? { rasters } : {}),
      ...(pairs.length ? { pairs } : {}),
      ...(this.branch === null ? {} : { branch: this.branch }),
    };
    this.link.ask('trace', { items, first, every, bins: Math.floor((high - first) / every) + 1, ...more });
  }

  /** Traces have come. @param {Traces} traces */
  take(traces) {
    this.waiting = false;
    const strips = [...this.pinned, this.held],
      rooms = new Map(strips.map((strip) => [strip, roomOf(strip.canvas)])); // before anything is written
    for (const [strip, room] of rooms) {
      const trace = traces.ranges.get(strip.key);
      const behind = strip.behind.flatMap((key) => traces.ranges.get(key) ?? []);
      const joined = strip.joined.flatMap(({ key }) => traces.ranges.get(key) ?? []);
      const left = this.left?.ranges.get(strip.key);
      if (trace && !strip.against)
        this.paint(strip, room, trace, traces, { behind, joined, left }, traces.ranges.get(this.marks(strip)));
    }
    this.left = null;
    this.show();
  }

  /** Values of each step have come, or others are those of now. @param {Traces | null} traces */
  pairs(traces) {
    if (traces !== this.paired) [this.beyond, this.leftPaired] = [this.leftPaired, null];
    [this.paired, this.pointed] = [traces, this.attention.values];
    if (traces) for (const strip of this.pinned) plane(strip, traces, this.attention.values, this.beyond, this.called);
  }

  /** A raster has come. @param {Raster} raster */
  raster(raster) {
    for (const strip of [...this.pinned, this.held]) {
      if (strip.what === RASTER && strip.id === raster.id)
        dot(
          strip.canvas,
          strip.ends,
          raster,
          ...this.blank(strip.canvas, roomOf(strip.canvas)),
          `from step ${this.scrubber.low} to ${this.scrubber.high}`,
        );
    }
  }

  /** A canvas as large as it is shown, empty, and how far across it a step is.
   * @param {HTMLCanvasElement} canvas @param {Room} room
   * @returns {[CanvasRenderingContext2D, (step: number) => number]} */
  blank(canvas, { width, height }) {
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d')),
      [wide, high] = [width, height].map((length) => Math.floor(length * devicePixelRatio));
    // another size is other memory, which costs more than the lines
    if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
    context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    context.clearRect(0, 0, width, height);
    [context.globalAlpha, context.lineWidth] = [1, 1];
    return [context, (step) => THUMB + this.scrubber.across(step) * (width - 2 * THUMB)];
  }

  /** Draw a trace: a line, up and down in each bin where it has several steps; above it marks where it fires, unless the
   * trace itself shows that; behind it, wide and pale, others, and, pale, how the future went that was left.
   * @param {Strip} strip @param {Room} place @param {Float32Array} trace
   * @param {Traces} traces @param {{behind: Float32Array[], joined: Float32Array[], left: Float32Array | undefined}} others @param {Float32Array} [spikes] */
  paint(strip, place, trace, { first, every }, { behind, joined, left }, spikes) {
    strip.seen = [trace, ...behind, ...joined].map((one) => ({ trace: one, first, every }));
    strip.left = left ? { trace: left, first, every } : null;
    const { canvas } = strip,
      [context, x] = this.blank(canvas, place),
      { width, height, line, ink } = place,
      { scrubber } = this;
    let [low, high] = [Infinity, -Infinity];
    for (const one of [trace, ...behind, ...joined, ...(left ? [left] : [])]) {
      for (const value of one) {
        if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
      }
    }
    const fired = spikes?.some((value, at) => value !== trace[at] && !Number.isNaN(value)) ? spikes : undefined;
    const known = low <= high,
      top = fired ? 4 + MARK : 4,
      room = height - 4 - top;
    const moves = known && high - low > ROUNDING * Math.max(Math.abs(low), Math.abs(high)),
      ends = moves ? apart(low, high) : ['', known ? short(high) : ''];
    write(strip.ends[0], ends[1]);
    write(strip.ends[1], ends[0]);
    /** @param {number} value */
    const y = (value) => top + room * (moves ? (high - Math.min(high, Math.max(low, value))) / (high - low) : 0.5);
    context.strokeStyle = line;
    context.setLineDash([2, 3]);
    context.beginPath();
    for (const [step] of scrubber.happened()) {
      context.moveTo(x(step), 0);
      context.lineTo(x(step), height);
    }
    if (known && low < 0 && high > 0) {
      context.moveTo(0, y(0));
      context.lineTo(width, y(0));
    }
    context.stroke();
    context.setLineDash([]);
    context.strokeStyle = ink;
    context.lineWidth = THIN;
    context.lineJoin = 'round';
    for (let bin = 0; fired && 2 * bin < fired.length; bin++) {
      const share = fired[2 * bin + 1];
      if (!(share > 0)) continue;
      // of what is collapsed the share of those that fire
      context.globalAlpha = Math.min(1, Math.max(0.25, share));
      const at = x(first + bin * every + (every - 1) / 2);
      context.beginPath();
      context.moveTo(at, 2);
      context.lineTo(at, 1 + MARK);
      context.stroke();
    }
    /** @param {number} bin */
    const middle = (bin) => x(first + bin * every + (every - 1) / 2);
    for (const other of behind) {
      context.globalAlpha = PALE;
      context.lineWidth = WIDE;
      follow(context, other, middle, y);
    }
    if (left) {
      context.globalAlpha = FAINT;
      context.lineWidth = THIN;
      follow(context, left, middle, y);
    }
    context.globalAlpha = 1;
    context.lineWidth = THIN;
    for (const [at, other] of joined.entries()) {
      context.strokeStyle = COLOURS[at % COLOURS.length];
      follow(context, other, middle, y);
    }
    context.strokeStyle = ink;
    follow(context, trace, middle, y);
    const went = left?.some(Number.isFinite) ? `, behind it ${this.called || 'how it went before'}` : '';
    canvas.setAttribute(
      'aria-label',
      known
        ? `${strip.told} from step ${scrubber.low} to ${scrubber.high}: between ${signed(low)} and ${signed(high)}${went}`
        : `${strip.told}: nothing is known of these steps`,
    );
  }
}

/** Where a strip is drawn. @param {HTMLCanvasElement} canvas @returns {Room} */
function roomOf(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas,
    { borderTopColor: line, color: ink } = getComputedStyle(canvas);
  return { width, height, line, ink };
}

/** Have an element say something. @param {HTMLElement} place @param {string} words */
function write(place, words) {
  if (place.textContent !== words) place.textContent = words;
}

/** Draw a line through bins: up and down in each that has several steps.
 * @param {CanvasRenderingContext2D} context @param {Float32Array} trace @param {(bin: number) => number} x
 * @param {(value: number) => number} y */
function follow(context, trace, x, y) {
  context.beginPath();
  let before = NaN;
  for (let bin = 0; 2 * bin < trace.length; bin++) {
    // what is pale would be darker where two begin and end
    if (bin % STRETCH === 0 && bin > 0 && context.globalAlpha === 1) {
      context.stroke();
      context.beginPath();
      if (!Number.isNaN(before)) context.moveTo(x(bin - 1), y(before));
    }
    const [least, most] = [trace[2 * bin], trace[2 * bin + 1]],
      at = x(bin);
    if (!Number.isNaN(least)) {
      // the end that is nearer to the last value first
      const up = Math.abs(least - before) <= Math.abs(most - before);
      if (Number.isNaN(before)) context.moveTo(at, y(least));
      context.lineTo(at, y(up ? least : most));
      if (most > least) context.lineTo(at, y(up ? most : least));
      before = up ? most : least;
    } else before = NaN;
  }
  context.stroke();
}

/** A number as well as 32 bits hold it. @param {number} value @returns {number} */
function rounded(value) {
  return Number(value.toPrecision(4));
}

/** A number in little room. @param {number} value @returns {string} */
function short(value) {
  const [fine, coarse] = [FEW, FEW - 1].map((digits) => String(Number(value.toPrecision(digits))).replace('-', '−'));
  return fine.length > FITS ? coarse : fine;
}

/** Two numbers in little room, with as many digits as tell them apart. @param {number} low @param {number} high
 * @returns {string[]} */
function apart(low, high) {
  let both = [low, high].map(short);
  for (let digits = FEW + 1; both[0] === both[1] && digits < MOST; digits++)
    both = [low, high].map((value) => String(Number(value.toPrecision(digits))).replace('-', '−'));
  return both;
}
