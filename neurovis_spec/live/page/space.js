/**
 * The body in space: its pose seen from any side, without perspective, so that lengths can be compared. What lies further
 * away is drawn first; faces are as bright as they turn to the light.
 */

import { channels } from './colours.js';
import { endsOf, meeting, thickness } from './links.js';
import { pie } from './motors.js';

/** @typedef {import('./protocol.js').Skeleton} Skeleton */
/** @typedef {import('./protocol.js').Theme} Theme */
/** @typedef {import('./body.js').Reach} Reach */
/** @typedef {import('./motors.js').Joint} Joint */
/** A point of the world in metres, x forward, y to the left, z up. @typedef {number[]} Point */
/** Where the drawing stands, and pixels of a metre. @typedef {{left: number, top: number, wide: number, high: number}} Room */
/** What is drawn as one, and how near it is. @typedef {{depth: number, draw: () => void}} Item */
/** What is there to draw: where points are, which feet touch something, joints in their colours, ways on the ground, the
 * step of its grid and where that begins.
 * @typedef {{points: Point[], touching: boolean[], joints: Joint[], ways: number[][][], step: number, start: number[]}} Pose */

/** From where it is seen at first: radians to the left of straight ahead, and above the ground; the least and the most. */
const ROUND = -0.9,
  UP = 0.45,
  LOWEST = 0.05,
  HIGHEST = Math.PI / 2;
/** Radians of a pixel that is dragged, and of a press of a key. */
const DRAGGED = 0.01,
  PRESSED = Math.PI / 24;
/** Room around the body; lines around links; the brightness of a face that turns away, of one that faces the light. */
const ROOM = 1.12,
  CASING = 1.3,
  DARK = 0.55;
const LIGHT = [0.36, -0.48, 0.8];
/** A link of more points is drawn by its outline; what is nearer to a plane lies in it, as a share of the link's size. */
const MOST = 48,
  NEAR = 1e-4;
/** Radii of feet in pixels, at least and at most, and in those of their links; a solid as high as the ground. */
const FOOT = 3.4,
  LARGE = 9,
  WIDER = 1.25,
  FLAT = 1e-6;
const NAME = 'neurovis.body';

/** @param {Point} one @param {Point} other @returns {Point} */
const minus = (one, other) => one.map((value, at) => value - other[at]);
/** @param {Point} one @param {Point} other @returns {number} */
const dot = (one, other) => one[0] * other[0] + one[1] * other[1] + one[2] * other[2];
/** @param {Point} a @param {Point} b @returns {Point} */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {Point[]} points @returns {Point} */
const middle = (points) => [0, 1, 2].map((axis) => points.reduce((sum, at) => sum + at[axis], 0) / points.length);

/** A colour times a brightness. @param {string} colour @param {number} share @returns {string} */
function shaded(colour, share) {
  return `rgb(${channels(colour)
    .map((value) => Math.round(share * value))
    .join()})`;
}

/** The faces of the convex hull of points: of each the numbers of its corners, in order. Points in a plane are one face.
 * @param {Point[]} points @returns {number[][]} */
export function faces(points) {
  const size = Math.max(...points.map((at) => Math.hypot(...minus(at, points[0])))),
    /** @type {Map<string, number[]>} */
    found = new Map();
  for (let i = 0; i < points.length; i++)
    for (let j = i + 1; j < points.length; j++)
      for (let k = j + 1; k < points.length; k++) {
        const normal = cross(minus(points[j], points[i]), minus(points[k], points[i])),
          long = Math.hypot(...normal);
        if (long <= NEAR * size * size) continue;
        const away = points.map((at) => dot(normal, minus(at, points[i])) / long / size);
        if (away.some((one) => one > NEAR) && away.some((one) => one < -NEAR)) continue;
        const corners = away.flatMap((one, at) => (Math.abs(one) <= NEAR ? [at] : []));
        if (!found.has(corners.join())) found.set(corners.join(), around(points, corners, normal));
      }
  return [...found.values()];
}

/** Corners of a plane face, in order around its middle. @param {Point[]} points @param {number[]} corners
 * @param {Point} normal @returns {number[]} */
function around(points, corners, normal) {
  const centre = middle(corners.map((at) => points[at])),
    along = minus(points[corners[0]], centre),
    aside = cross(normal, along),
    long = Math.hypot(...along) || 1,
    wide = Math.hypot(...aside) || 1;
  /** @param {number} at */
  const angle = (at) => {
    const from = minus(points[at], centre);
    return Math.atan2(dot(from, aside) / wide, dot(from, along) / long);
  };
  return [...corners].sort((one, other) => angle(one) - angle(other));
}

/** The view of a body in space, which turns by dragging. */
export class Space {
  /** @param {HTMLCanvasElement} canvas @param {HTMLButtonElement} button @param {() => void} redraw */
  constructor(canvas, button, redraw) {
    this.canvas = canvas;
    this.button = button;
    this.redraw = redraw;
    this.round = ROUND;
    this.up = UP;
    /** faces of each link, by its number: they stay, since links are rigid @type {Map<string, number[][]>} */
    this.known = new Map();
    /** where the middle of the drawing is on the page, what it shows, pixels of a metre */
    this.centre = { x: 0, y: 0, at: [0, 0, 0], scale: 1 };
    this.on = remembered();
    button.onclick = () => this.choose(!this.on);
    canvas.ondblclick = () => this.choose(false);
    canvas.onkeydown = (event) => this.pressed(event);
    canvas.onpointerdown = ({ pointerId }) => this.on && canvas.setPointerCapture(pointerId);
    canvas.onpointermove = ({ pointerId, movementX: x, movementY: y }) => {
      if (this.on && canvas.hasPointerCapture(pointerId)) this.turn(-DRAGGED * x, DRAGGED * y);
    };
    this.arrange();
  }

  /** Another body. */
  forget() {
    this.known.clear();
  }

  /** Show it in space, or from above and from its side; kept for this viewer. @param {boolean} on */
  choose(on) {
    this.on = on;
    this.round = ROUND;
    this.up = UP;
    try {
      localStorage.setItem(NAME, on ? 'space' : '');
    } catch {
      // where pages may keep nothing, it is as it is at first
    }
    this.arrange();
    this.redraw();
  }

  /** What the button and the canvas say. */
  arrange() {
    this.button.setAttribute('aria-pressed', String(this.on));
    this.canvas.style.touchAction = this.on ? 'none' : '';
    this.canvas.style.cursor = this.on ? 'grab' : '';
    this.canvas.tabIndex = this.on ? 0 : -1;
  }

  /** @param {number} round @param {number} up */
  turn(round, up) {
    this.round += round;
    this.up = Math.min(HIGHEST, Math.max(LOWEST, this.up + up));
    this.redraw();
  }

  /** @param {KeyboardEvent} event */
  pressed(event) {
    const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!this.on || !by || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    this.turn(PRESSED * by[0], PRESSED * by[1]);
  }

  /** What of the view decides how it is drawn. @returns {string} */
  get key() {
    return this.on ? `${this.round} ${this.up}` : '';
  }

  /** What of the world runs to the right on the page, up, and towards who looks. @returns {Point[]} */
  axes() {
    const [sin, cos, high, level] = [Math.sin(this.round), Math.cos(this.round), Math.sin(this.up), Math.cos(this.up)];
    return [
      [-sin, cos, 0],
      [-high * cos, -high * sin, level],
      [level * cos, level * sin, high],
    ];
  }

  /** Where a point is on the page. @param {Point} point @returns {[number, number]} */
  spot(point) {
    const [right, up] = this.axes(),
      { x, y, at, scale } = this.centre,
      from = minus(point, at);
    return [x + scale * dot(right, from), y - scale * dot(up, from)];
  }

  /** Draw a pose. @param {CanvasRenderingContext2D} context @param {Room} room @param {Theme} theme
   * @param {Skeleton} skeleton @param {Reach} reach @param {Pose} pose */
  paint(context, room, theme, skeleton, reach, pose) {
    const { left, top, wide, high } = room,
      far = Math.hypot(reach.ahead, reach.aside),
      tall = reach.high - reach.low,
      scale = Math.min(wide / 2 / far, high / (2 * far * Math.sin(this.up) + tall * Math.cos(this.up))) / ROOM,
      [x, y] = pose.points[skeleton.middle];
    this.centre = { x: left + wide / 2, y: top + high / 2, at: [x, y, (reach.low + reach.high) / 2], scale };
    this.canvas.dataset.view = [this.round, this.up, scale, this.centre.x, this.centre.y, this.centre.at[2]].join(' ');
    context.save();
    context.beginPath();
    context.rect(left, top, wide, high);
    context.fillStyle = theme.box_fill;
    context.fill();
    context.clip();
    this.ground(context, theme, far, pose);
    const items = [
      ...skeleton.links.map((link, at) => this.link(context, theme, link, at, pose.points)),
      ...skeleton.solids.flatMap((solid) => this.solid(context, theme, solid, far)),
      ...pose.joints.map((joint) => this.joint(context, theme, skeleton, joint, pose.points)),
      ...skeleton.feet.map((foot, at) => this.foot(context, theme, skeleton, foot, pose.points, pose.touching[at])),
    ];
    for (const { draw } of items.sort((one, other) => one.depth - other.depth)) draw();
    context.restore();
    context.strokeStyle = theme.box_line;
    context.lineWidth = 1;
    context.strokeRect(left, top, wide, high);
  }

  /** A line through points. @param {CanvasRenderingContext2D} context @param {Point[]} points @param {string} colour
   * @param {number} width */
  line(context, points, colour, width) {
    context.beginPath();
    for (const at of points) context.lineTo(...this.spot(at));
    [context.strokeStyle, context.lineWidth] = [colour, width];
    context.stroke();
  }

  /** The grid of the ground around the body, and the ways on it. @param {CanvasRenderingContext2D} context
   * @param {Theme} theme @param {number} far @param {Pose} pose */
  ground(context, theme, far, { ways, step, start }) {
    const around = this.centre.at.slice(0, 2),
      half = 1.5 * far;
    for (const axis of [0, 1]) {
      const first = Math.ceil((around[axis] - half - start[axis]) / step);
      for (let at = first; start[axis] + step * at <= around[axis] + half; at++) {
        const ends = [-half, half].map((aside) => {
          const point = [around[0] + aside, around[1] + aside, 0];
          point[axis] = start[axis] + step * at;
          return point;
        });
        this.line(context, ends, axis === 0 && at === 0 ? theme.muted : theme.box_line, 0.8);
      }
    }
    for (const [at, way] of ways.entries()) {
      context.globalAlpha = at === ways.length - 1 ? 0.55 : 0.25;
      this.line(
        context,
        way.map(([, x, y]) => [x, y, 0]),
        theme.positive,
        2,
      );
    }
    context.globalAlpha = 1;
  }

  /** @param {Point} point @returns {number} */
  depth(point) {
    return dot(this.axes()[2], point);
  }

  /** A link: a line with round ends, or the faces of its hull. @param {CanvasRenderingContext2D} context
   * @param {Theme} theme @param {number[]} link @param {number} number @param {Point[]} points @returns {Item} */
  link(context, theme, [start, end, radius, ...beside], number, points) {
    const ends = [start, end, ...beside].map((at) => points[at]),
      width = Math.max(2 * radius * this.centre.scale, beside.length ? 0 : 2.2),
      depth = this.depth(middle(ends));
    if (beside.length && ends.length <= MOST)
      return { depth, draw: () => this.hull(context, theme, theme.zero, ends, String(number), width) };
    const draw = () => {
      this.line(context, ends, theme.box_fill, width + 2 * CASING);
      this.line(context, ends, shaded(theme.zero, 0.82), width);
      const light = ends.map(([x, y, z]) => [x, y, z + 0.3 * radius]);
      if (width > 4) this.line(context, light, theme.zero, 0.45 * width);
    };
    return { depth, draw };
  }

  /** How near what stands before all links that meet at a point is. @param {Skeleton} skeleton @param {number} point
   * @param {Point[]} points @returns {number} */
  before(skeleton, point, points) {
    const middles = meeting(skeleton.links, point).map((link) => middle(endsOf(link).map((at) => points[at])));
    return Math.max(this.depth(points[point]), ...middles.map((at) => this.depth(at))) + 1e-6;
  }

  /** A joint in the colours of what moves it, before the links that meet there. @param {CanvasRenderingContext2D} context
   * @param {Theme} theme @param {Skeleton} skeleton @param {Joint} joint @param {Point[]} points @returns {Item} */
  joint(context, theme, skeleton, { point, colours }, points) {
    const thick = thickness(skeleton.links, point) * this.centre.scale;
    return {
      depth: this.before(skeleton, point, points),
      draw: () => pie(context, this.spot(points[point]), thick, colours, theme),
    };
  }

  /** The faces of a convex hull that are turned to who looks. @param {CanvasRenderingContext2D} context
   * @param {Theme} theme @param {string} colour @param {Point[]} points @param {string} name @param {number} width */
  hull(context, theme, colour, points, name, width) {
    const known = this.known.get(name) ?? faces(points),
      towards = this.axes()[2],
      centre = middle(points);
    this.known.set(name, known);
    const seen = known.flatMap((corners) => {
      const [a, b, c] = corners.map((at) => points[at]);
      let normal = cross(minus(b, a), minus(c, a));
      const isIn = dot(normal, minus(a, centre)) < 0 || (known.length === 1 && dot(normal, towards) < 0);
      if (isIn) normal = normal.map((value) => -value);
      return dot(normal, towards) > 0 ? [{ corners, normal }] : [];
    });
    for (const casing of [CASING, 0])
      for (const { corners, normal } of seen) {
        const share = DARK + (1 - DARK) * Math.max(0, dot(normal, LIGHT) / (Math.hypot(...normal) || 1));
        context.beginPath();
        for (const at of corners) context.lineTo(...this.spot(points[at]));
        context.closePath();
        context.fillStyle = context.strokeStyle = casing ? theme.box_fill : shaded(colour, share);
        context.lineWidth = width + 2 * casing + (casing ? 0 : 0.6);
        context.fill();
        context.stroke();
      }
  }

  /** What stands on the ground, as far as it is near. @param {CanvasRenderingContext2D} context @param {Theme} theme
   * @param {number[][]} solid @param {number} far @returns {Item[]} */
  solid(context, theme, [low, high], far) {
    const { at } = this.centre,
      half = 1.5 * far,
      [from, to] = [low, high].map((corner) => {
        const near = [0, 1].map((axis) => Math.min(at[axis] + half, Math.max(at[axis] - half, corner[axis])));
        return [...near, Math.max(0, corner[2])];
      });
    if (high[2] <= FLAT || from[0] >= to[0] || from[1] >= to[1]) return [];
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((n) => [0, 1, 2].map((axis) => ((n >> axis) & 1 ? to : from)[axis]));
    return [
      {
        depth: this.depth(middle(corners)),
        draw: () => this.hull(context, theme, theme.box_line, corners, 'box', 0),
      },
    ];
  }

  /** A foot, in front of the links that end there. @param {CanvasRenderingContext2D} context @param {Theme} theme
   * @param {Skeleton} skeleton @param {number} foot @param {Point[]} points @param {boolean} isDown @returns {Item} */
  foot(context, theme, skeleton, foot, points, isDown) {
    const thick = thickness(skeleton.links, foot);
    const draw = () => {
      context.beginPath();
      context.arc(
        ...this.spot(points[foot]),
        Math.min(LARGE, Math.max(FOOT, WIDER * thick * this.centre.scale)),
        0,
        2 * Math.PI,
      );
      [context.fillStyle, context.strokeStyle] = isDown ? [theme.positive, theme.ink] : [theme.box_fill, theme.muted];
      context.lineWidth = 1.4;
      context.fill();
      context.stroke();
    };
    return { depth: this.before(skeleton, foot, points), draw };
  }
}

/** Whether this viewer has chosen to see bodies in space. @returns {boolean} */
function remembered() {
  try {
    return localStorage.getItem(NAME) === 'space';
  } catch {
    return false;
  }
}
