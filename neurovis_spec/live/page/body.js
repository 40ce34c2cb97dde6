/**
 * The body: its pose at the step that is shown, from above and from its right side, in metres, as films have it.
 */

import { mixed } from './colours.js';
import { endsOf, thickness } from './links.js';
import { Motors, pie } from './motors.js';
import { Space } from './space.js';
import { roundAbove, written } from './ticks.js';

/** @typedef {import('./motors.js').Joint} Joint */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./protocol.js').Motor} Motor */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./protocol.js').Skeleton} Skeleton */
/** @typedef {import('./protocol.js').Theme} Theme */
/** How far the body has reached from its middle, in metres.
 * @typedef {{ahead: number, aside: number, low: number, high: number}} Reach */
/** A drawing: where it stands in the panel, pixels of a metre, what of the world lies in the middle of it, which
 * coordinate runs up.
 * @typedef {{left: number, top: number, wide: number, high: number, scale: number, x: number, y: number, level: number,
 *   up: number}} Frame */

/** Pixels: around the drawings, of titles and of numbers beneath; between lines of the grid and of a scale bar, at least. */
const EDGE = 10,
  TITLE = 20,
  NUMBERS = 17,
  APART = 46,
  BAR = 50,
  FONT = 11,
  BUTTON = 48;
/** The drawings leave so much room around the body, and so much more where it reaches further than before. */
const ROOM = 1.12,
  WIDER = 1.3,
  MORE = 1.06;
/** The least metres that are shown around the middle, lines around links, the least thickness of these. */
const LEAST = 0.05,
  CASING = 1.3,
  THIN = 2.2;
/** A foot is so many times as thick as its links, in pixels at least and at most. */
const FOOT = 1.25,
  SMALL = 3.4,
  LARGE = 9;
/** How much is left of a colour on the far side; what lies so far aside, as a share of the reach, is there or near. */
const FAR = 0.45,
  ASIDE = 0.12;
/** The way that the body took: how wide its line is, and how much of its colour is left. */
const WAY = 2,
  PALE = 0.55;
/** Ways of episodes before this one that are kept, and how much is left of their colour. */
const WAYS = 12,
  PALER = 0.25;
/** A solid as high as the ground is the ground. */
const FLAT = 1e-6;

/** A number of metres with as many decimals as multiples of `step` have. @param {number} value @param {number} step
 * @returns {string} */
function metres(value, step) {
  return `${value === 0 ? '0' : written(value, step)} m`;
}

/** The corners of the convex hull of points on the page, in order. @param {[number, number][]} points
 * @returns {[number, number][]} */
function outline(points) {
  const sorted = [...points].sort(([x, y], [u, v]) => x - u || y - v);
  /** @param {[number, number][]} some */
  const chain = (some) => {
    /** @type {[number, number][]} */
    const found = [];
    for (const [x, y] of some) {
      while (found.length > 1) {
        const [[u, v], [s, t]] = found.slice(-2);
        if ((s - u) * (y - v) - (t - v) * (x - u) > 0) break;
        found.pop();
      }
      found.push([x, y]);
    }
    return found.slice(0, -1);
  };
  return points.length < 3 ? points : [...chain(sorted), ...chain(sorted.reverse())];
}

/** How far apart two points are. @param {number[]} one @param {number[]} other @returns {number} */
function distance(one, other) {
  return Math.hypot(...one.map((value, at) => value - other[at]));
}

/** The panel of the body. */
export class Body {
  /** @param {HTMLElement} panel @param {HTMLCanvasElement} canvas @param {HTMLButtonElement} button
   * @param {HTMLButtonElement} spatial @param {() => void} redraw */
  constructor(panel, canvas, button, spatial, redraw) {
    this.panel = panel;
    this.canvas = canvas;
    this.button = button;
    this.redraw = redraw;
    this.space = new Space(canvas, spatial, redraw);
    /** @type {Skeleton | null} */
    this.skeleton = null;
    this.start = [0, 0];
    this.motors = new Motors([]);
    /** @type {Reach} */
    this.reach = { ahead: LEAST, aside: LEAST, low: 0, high: LEAST };
    /** how high each link reaches in the first pose; none before it @type {number[]} */
    this.tops = [];
    /** where the middle was at the steps that were shown, up to the one that is @type {[number, number, number][]} */
    this.way = [];
    /** the ways of episodes before, the last of them last @type {[number, number, number][][]} */
    this.ways = [];
    this.open = true;
    /** what is drawn: nothing else needs to be */
    this.drawn = '';
    /** what is to be read of it */
    this.words = '';
    button.onclick = () => this.toggle();
    new ResizeObserver(redraw).observe(canvas);
  }

  /** Another body, or none. @param {Skeleton | null} skeleton @param {number[]} start @param {Motor[]} motors */
  use(skeleton, start, motors) {
    this.skeleton = skeleton;
    this.start = start;
    this.motors = new Motors(motors);
    this.reach = { ahead: LEAST, aside: LEAST, low: 0, high: LEAST };
    this.tops = [];
    this.way = [];
    this.ways = [];
    this.words = '';
    this.space.forget();
    this.arrange();
  }

  /** Open the panel, or close it. */
  toggle() {
    if (!this.skeleton) return;
    this.open = !this.open;
    this.arrange();
  }

  /** Show the panel where there is a body and it is open. */
  arrange() {
    this.button.hidden = !this.skeleton;
    this.panel.hidden = !(this.skeleton && this.open);
    this.button.setAttribute('aria-expanded', String(!this.panel.hidden));
    this.drawn = '';
    this.redraw();
  }

  /** How many numbers a pose is; behind them are those that moved the body. @returns {number} */
  get size() {
    return this.skeleton ? 3 * this.skeleton.points.length + this.skeleton.feet.length : 0;
  }

  /** The points of a pose, x, y and z each; null where it is not known. @param {Float32Array} pose
   * @returns {number[][] | null} */
  points(pose) {
    const { skeleton, size } = this;
    if (!skeleton || pose.length < size || !pose.subarray(0, size).every(Number.isFinite)) return null;
    return skeleton.points.map((_, at) => Array.from(pose.subarray(3 * at, 3 * at + 3)));
  }

  /** Draw the pose of a look, where it is another one. @param {Look} look @param {Scene} scene */
  show(look, scene) {
    const { skeleton, canvas } = this;
    this.follow(look);
    if (!skeleton || this.panel.hidden) return;
    const { clientWidth: wide, clientHeight: high } = canvas,
      wanted = [look.step, look.serial, wide, high, devicePixelRatio, scene.version, this.space.key].join(' ');
    if (!wide || !high || wanted === this.drawn) return;
    this.drawn = wanted;
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    [canvas.width, canvas.height] = [Math.round(wide * devicePixelRatio), Math.round(high * devicePixelRatio)];
    context.scale(devicePixelRatio, devicePixelRatio);
    this.paint(context, wide, high, look, scene);
    this.tell(look);
  }

  /** Draw a pose into so much room. @param {CanvasRenderingContext2D} context @param {number} wide @param {number} high
   * @param {Look} look @param {Scene} scene */
  paint(context, wide, high, look, scene) {
    const { skeleton } = this,
      points = this.points(look.pose);
    if (!skeleton) return;
    context.fillStyle = scene.theme.background;
    context.fillRect(0, 0, wide, high);
    context.font = `${FONT}px ${scene.constants.families.map((name) => JSON.stringify(name)).join()}`;
    context.lineCap = context.lineJoin = 'round';
    if (points) this.measure(points);
    const touching = this.touching(look),
      joints = this.motors.shown(look.pose.subarray(this.size), scene.theme);
    if (points && this.space.on) {
      const room = { left: EDGE, top: TITLE, wide: wide - 2 * EDGE, high: high - TITLE - EDGE },
        step = roundAbove((2 * APART * (this.reach.ahead + this.reach.aside)) / wide),
        ways = [...this.ways, this.way];
      this.space.paint(context, room, scene.theme, skeleton, this.reach, {
        points,
        touching,
        joints,
        ways,
        step,
        start: this.start,
      });
      context.fillStyle = scene.theme.muted;
      context.fillText(
        `${this.come(points)}, a square is ${metres(step, step)} wide`,
        EDGE,
        TITLE - 7,
        wide - 2 * EDGE - BUTTON,
      );
      return;
    }
    for (const frame of this.frames(wide, high, points?.[skeleton.middle] ?? [...this.start, 0])) {
      context.save();
      this.ground(context, frame, scene.theme);
      if (points) {
        if (frame.up === 1) this.trail(context, frame, scene.theme);
        this.links(context, frame, scene.theme, points);
        this.joints(context, frame, scene.theme, points, joints);
        this.feet(context, frame, scene.theme, points, touching);
      }
      context.restore();
      this.numbers(context, frame, scene.theme);
      this.title(context, frame, scene.theme, points);
    }
  }

  /** Note where the middle is: of a way that goes on; where it is elsewhere at once, or not known, another begins.
   * @param {Look} look */
  follow(look) {
    const { skeleton, reach } = this,
      middle = this.points(look.pose)?.[skeleton?.middle ?? 0];
    while (this.way.length && this.way[this.way.length - 1][0] >= look.step) this.way.pop();
    const last = this.way[this.way.length - 1];
    this.ways = this.ways.filter((way) => way[0][0] < look.step);
    if (!middle || (last && distance(last.slice(1), middle.slice(0, 2)) > 2 * reach.ahead)) {
      // where it is back at the start another episode has begun; elsewhere somebody has gone to another step
      const isBack = middle && distance(this.start, middle.slice(0, 2)) <= 2 * reach.ahead;
      if (isBack && this.way.length > 1) this.ways = [...this.ways, this.way].slice(-WAYS);
      this.way = [];
    }
    if (middle) this.way.push([look.step, middle[0], middle[1]]);
  }

  /** The way so far, on the ground, and paler those of episodes before. @param {CanvasRenderingContext2D} context @param {Frame} frame @param {Theme} theme */
  trail(context, frame, theme) {
    for (const way of [...this.ways, this.way]) {
      const share = way === this.way ? PALE : PALER;
      context.beginPath();
      for (const [, x, y] of way) context.lineTo(...this.spot(frame, [x, y, 0]));
      [context.strokeStyle, context.lineWidth] = [mixed(theme.positive, theme.box_fill, share), WAY];
      context.stroke();
    }
  }

  /** Which feet touch something. @param {Look} look @returns {boolean[]} */
  touching(look) {
    const { points = [], feet = [] } = this.skeleton ?? {};
    return Array.from(look.pose.subarray(3 * points.length, 3 * points.length + feet.length), (value) => value > 0.5);
  }

  /** How far it reaches. @param {number[][]} points */
  measure(points) {
    const { skeleton, reach } = this;
    if (!skeleton) return;
    const thick = Math.max(0, ...skeleton.links.map(([, , radius]) => radius)),
      middle = points[skeleton.middle];
    const [ahead, aside] = [0, 1].map(
      (axis) => Math.max(...points.map((at) => Math.abs(at[axis] - middle[axis]))) + thick,
    );
    if (ahead > reach.ahead) reach.ahead = MORE * ahead;
    if (aside > reach.aside) reach.aside = MORE * aside;
    reach.low = Math.min(reach.low, ...points.map(([, , z]) => z));
    const high = Math.max(...points.map(([, , z]) => z)) + thick;
    if (high > reach.high) reach.high = MORE * high;
    if (!this.tops.length)
      this.tops = skeleton.links.map((link) => {
        const ends = endsOf(link);
        return ends.reduce((sum, at) => sum + points[at][2], 0) / ends.length + link[2];
      });
  }

  /** Both drawings, by the same scale: beside each other, or below in a panel that is higher than wide.
   * @param {number} width @param {number} height @param {number[]} middle @returns {Frame[]} */
  frames(width, height, [x, y]) {
    const { ahead, aside, low, high } = this.reach,
      isHigh = height > width,
      around = TITLE + NUMBERS + 4,
      wide = isHigh ? width - 2 * EDGE : (width - 3 * EDGE) / 2,
      needed = [2 * ROOM * aside, ROOM * (high - low) + 0.15 * aside];
    const room = height - (isHigh ? 2 : 1) * around,
      highs = needed.map((one) => (isHigh ? (room * one) / (needed[0] + needed[1]) : room));
    const scale = Math.min(wide / (2 * WIDER * ahead), highs[0] / needed[0], highs[1] / needed[1]);
    const [left, top] = isHigh ? [EDGE, TITLE + around + highs[0]] : [2 * EDGE + wide, TITLE];
    const level = top + highs[1] - 0.4 * (highs[1] - scale * (high - low)) + scale * low;
    return [
      { left: EDGE, top: TITLE, wide, high: highs[0], scale, x, y, level: TITLE + highs[0] / 2, up: 1 },
      { left, top, wide, high: highs[1], scale, x, y: 0, level, up: 2 },
    ];
  }

  /** Where a point of the world lies in a drawing. @param {Frame} frame @param {number[]} point @returns {number[]} */
  at(frame, point) {
    const { left, wide, scale, x, y, level, up } = frame;
    return [left + wide / 2 + scale * (point[0] - x), level - scale * (point[up] - y)];
  }

  /** The frame, and what is seen in it of the ground and of what stands on it; nothing is drawn outside from here on.
   * @param {CanvasRenderingContext2D} context @param {Frame} frame @param {Theme} theme */
  ground(context, frame, theme) {
    const { left, top, wide, high, level, up } = frame,
      bottom = top + high;
    context.beginPath();
    context.rect(left, top, wide, high);
    context.fillStyle = theme.box_fill;
    context.fill();
    context.clip();
    if (up === 2) {
      context.fillStyle = mixed(theme.box_line, theme.box_fill, 0.5);
      context.fillRect(left, level, wide, bottom - level);
    }
    context.lineWidth = 1;
    for (const [low, above] of this.skeleton?.solids ?? []) {
      if (above[2] <= FLAT) continue;
      const [[x0, y0], [x1, y1]] = [this.at(frame, low), this.at(frame, above)];
      context.fillStyle = theme.box_line;
      context.strokeStyle = theme.muted;
      context.fillRect(x0, y1, x1 - x0, y0 - y1);
      context.strokeRect(x0, y1, x1 - x0, y0 - y1);
    }
    /** @param {number[]} from @param {number[]} to @param {string} colour @param {number} width */
    const line = (from, to, colour, width) => {
      [context.strokeStyle, context.lineWidth] = [colour, width];
      context.beginPath();
      context.moveTo(from[0], from[1]);
      context.lineTo(to[0], to[1]);
      context.stroke();
    };
    for (const [value, x] of this.marks(frame, 0)) {
      const isMain = up === 2 || value === 0;
      line(
        [x, up === 1 ? top : level],
        [x, up === 1 ? bottom : level + 5],
        isMain ? theme.muted : theme.box_line,
        isMain ? 1.2 : 0.8,
      );
    }
    if (up === 1) for (const [, y] of this.marks(frame, 1)) line([left, y], [left + wide, y], theme.box_line, 0.8);
    else line([left, level], [left + wide, level], theme.muted, 1.4);
    context.strokeStyle = theme.box_line;
    context.lineWidth = 2;
    context.strokeRect(left, top, wide, high);
  }

  /** The lines of the grid across or along the way: how far each is from the start, and where it lies.
   * @param {Frame} frame @param {0 | 1} axis @returns {[number, number][]} */
  marks(frame, axis) {
    const { scale, wide, high } = frame,
      step = roundAbove(APART / scale),
      half = (axis ? high : wide) / 2 / scale,
      middle = (axis ? frame.y : frame.x) - this.start[axis];
    const first = Math.ceil((middle - half) / step),
      count = Math.floor((middle + half) / step) - first + 1;
    return Array.from({ length: Math.max(0, count) }, (_, at) => {
      const value = step * (first + at),
        point = axis ? [frame.x, this.start[1] + value] : [this.start[0] + value, frame.y];
      return [value, this.at(frame, [...point, 0])[axis]];
    });
  }

  /** On which side of the body something is: −1 on the far one, 1 on the near one. @param {number[][]} points
   * @param {number[]} ends @returns {number} */
  layer(points, ends) {
    const { skeleton, reach } = this;
    if (!skeleton) return 0;
    const off = ends.reduce((sum, at) => sum + points[at][1], 0) / ends.length - points[skeleton.middle][1];
    return Math.abs(off) > ASIDE * reach.aside ? -Math.sign(off) : 0;
  }

  /** Links, the nearest last. @param {CanvasRenderingContext2D} context @param {Frame} frame @param {Theme} theme
   * @param {number[][]} points */
  links(context, frame, theme, points) {
    const links = (this.skeleton?.links ?? []).map((link) => {
      const ends = endsOf(link),
        far = ends.length > 2 ? Math.max(...ends.map((end) => distance(points[end], points[ends[0]]))) : 0;
      return { ends, radius: link[2], size: link[2] + far / 2 };
    });
    const largest = Math.max(1e-300, ...links.map(({ size }) => size));
    const ordered = links.map((link, at) => {
      const layer = this.layer(points, link.ends);
      return { ...link, order: frame.up === 1 ? this.tops[at] : layer || (0.5 * link.size) / largest };
    });
    ordered.sort((one, other) => one.order - other.order);
    for (const { ends, radius, order } of ordered) {
      const corners = outline(ends.map((end) => this.spot(frame, points[end]))),
        width = Math.max(2 * radius * frame.scale, ends.length > 2 ? 0 : THIN),
        isFar = frame.up === 2 && order < 0;
      context.beginPath();
      for (const corner of corners) context.lineTo(...corner);
      if (ends.length > 2) context.closePath();
      [context.strokeStyle, context.lineWidth] = [theme.box_fill, width + 2 * CASING];
      context.stroke();
      context.fillStyle = isFar ? mixed(theme.zero, theme.box_fill, FAR) : theme.zero;
      [context.strokeStyle, context.lineWidth] = [context.fillStyle, width];
      context.fill();
      if (width > 0) context.stroke();
    }
  }

  /** @param {Frame} frame @param {number[]} point @returns {[number, number]} */
  spot(frame, point) {
    const [x, y] = this.at(frame, point);
    return [x, y];
  }

  /** Joints in the colours of what moves them. @param {CanvasRenderingContext2D} context @param {Frame} frame
   * @param {Theme} theme @param {number[][]} points @param {Joint[]} joints */
  joints(context, frame, theme, points, joints) {
    const { links = [] } = this.skeleton ?? {};
    for (const { point, colours } of joints) {
      const isFar = frame.up === 2 && this.layer(points, [point]) < 0,
        seen = isFar ? colours.map((one) => mixed(one, theme.box_fill, FAR)) : colours;
      pie(context, this.spot(frame, points[point]), thickness(links, point) * frame.scale, seen, theme);
    }
  }

  /** Feet, filled where they touch something, and these in front of the others. @param {CanvasRenderingContext2D} context @param {Frame} frame
   * @param {Theme} theme @param {number[][]} points @param {boolean[]} touching */
  feet(context, frame, theme, points, touching) {
    const { feet = [], links = [] } = this.skeleton ?? {};
    const ordered = feet.map((point, at) => ({ point, at, order: frame.up === 1 ? 0 : this.layer(points, [point]) }));
    ordered.sort((one, other) => one.order - other.order || Number(touching[one.at]) - Number(touching[other.at]));
    for (const { point, at, order } of ordered) {
      const colours = touching[at] ? [theme.positive, theme.ink] : [theme.box_fill, theme.muted];
      const [fill, edge] = order < 0 ? colours.map((one) => mixed(one, theme.box_fill, FAR)) : colours;
      this.disc(
        context,
        this.spot(frame, points[point]),
        Math.min(LARGE, Math.max(SMALL, FOOT * thickness(links, point) * frame.scale)),
        fill,
        edge,
      );
    }
  }

  /** @param {CanvasRenderingContext2D} context @param {[number, number]} middle @param {number} radius
   * @param {string} fill @param {string} edge */
  disc(context, [x, y], radius, fill, edge) {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    [context.fillStyle, context.strokeStyle, context.lineWidth] = [fill, edge, 1.4];
    context.fill();
    context.stroke();
  }

  /** How far it is from the start, beneath; in the drawing from above, a scale bar.
   * @param {CanvasRenderingContext2D} context @param {Frame} frame @param {Theme} theme */
  numbers(context, frame, theme) {
    const { left, top, wide, high, scale, up } = frame,
      bottom = top + high,
      step = roundAbove(APART / scale);
    context.fillStyle = theme.muted;
    context.textAlign = 'center';
    for (const [value, x] of this.marks(frame, 0)) {
      const words = metres(value, step),
        half = context.measureText(words).width / 2;
      if (x - half >= left && x + half <= left + wide) context.fillText(words, x, bottom + 13);
    }
    if (up === 1) {
      const long = roundAbove(BAR / scale),
        right = left + wide - 10,
        [begin, y] = [right - long * scale, bottom - 9];
      context.strokeStyle = theme.box_fill;
      context.lineWidth = 4;
      context.strokeText(metres(long, long), (begin + right) / 2, y - 6);
      context.fillStyle = context.strokeStyle = theme.ink;
      context.lineWidth = 1.4;
      context.fillText(metres(long, long), (begin + right) / 2, y - 6);
      context.beginPath();
      for (const [x, down] of [
        [begin, -4],
        [begin, 0],
        [right, 0],
        [right, -4],
      ])
        context.lineTo(x, y + down);
      context.stroke();
    }
    context.textAlign = 'start';
  }

  /** What is seen, how far it has come, and what feet mean, as far as there is room.
   * @param {CanvasRenderingContext2D} context @param {Frame} frame @param {Theme} theme
   * @param {number[][] | null} points */
  title(context, frame, theme, points) {
    const { left, top, up } = frame,
      y = top - 7,
      isCorner = top === TITLE && left + frame.wide + EDGE >= this.canvas.clientWidth,
      wide = frame.wide - (isCorner ? BUTTON : 0);
    const side = points
        ? [`from its right side · ${this.come(points)}`, 'from its right side']
        : ['its pose is not known'],
      either = up === 1 ? ['from above, forward →', 'from above'] : side;
    const said = either.find((one) => context.measureText(one).width <= wide) ?? either[either.length - 1];
    context.fillStyle = theme.muted;
    context.fillText(said, left, y, wide);
    if (up === 2 || !this.skeleton?.feet.length) return;
    let x = left + wide;
    const explained = ['touching', 'in the air'];
    const room = explained.reduce((sum, words) => sum + context.measureText(words).width + 22, 0);
    if (context.measureText(said).width + room + 8 > wide) return;
    for (const words of explained.reverse()) {
      x -= context.measureText(words).width;
      context.fillStyle = theme.muted;
      context.fillText(words, x, y);
      const [fill, edge] = words === 'touching' ? [theme.positive, theme.ink] : [theme.box_fill, theme.muted];
      this.disc(context, [x - 8, y - 4], 4, fill, edge);
      x -= 22;
    }
  }

  /** How far it has come. @param {number[][]} points @returns {string} */
  come(points) {
    const far = points[this.skeleton?.middle ?? 0][0] - this.start[0];
    return `${Math.abs(far).toFixed(2)} m ${far < -0.005 ? 'back' : 'forward'}`;
  }

  /** Put into words what is seen. @param {Look} look */
  tell(look) {
    const points = this.points(look.pose),
      touching = this.touching(look),
      count = touching.filter(Boolean).length;
    const feet = touching.length ? `, ${count} of ${touching.length} feet touching` : '';
    this.words = points ? `the body ${this.come(points)}${feet}` : 'the body: its pose is not known';
    const from = this.space.on ? 'in space; arrow keys turn it' : 'from above, and from its right side';
    this.canvas.setAttribute('aria-label', `${this.words}; ${from}`);
  }
}
