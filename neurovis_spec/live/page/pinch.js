/**
 * Pinching: two fingers move the picture, come closer and go away. While there are two, no other meaning is given to them.
 */

/** @typedef {import('./camera.js').Camera} Camera */

/** Where two points have their middle, and how far apart they are. @param {number[][]} points @returns {number[]} */
function spread([[x0, y0], [x1, y1]]) {
  return [(x0 + x1) / 2, (y0 + y1) / 2, Math.max(1, Math.hypot(x1 - x0, y1 - y0))];
}

/** Follow fingers. @param {HTMLCanvasElement} canvas @param {Camera} camera @param {() => void} redraw
 * @param {() => void} begun called when the second finger comes: what the first was about is given up */
export function followFingers(canvas, camera, redraw, begun) {
  /** @type {Map<number, number[]>} */
  const fingers = new Map();
  // two there have been, and one is still down: it neither drags nor taps
  let pinched = false;
  /** @param {PointerEvent} event */
  const follow = (event) => {
    if (event.pointerType !== 'touch') return;
    const { type, pointerId: id } = event,
      at = [event.offsetX, event.offsetY].map((pixel) => pixel * devicePixelRatio);
    const before = fingers.size === 2 ? spread([...fingers.values()]) : null;
    if (type === 'pointerdown' ? fingers.size < 2 : fingers.has(id)) fingers.set(id, at);
    if (type === 'pointerup' || type === 'pointercancel') fingers.delete(id);
    if (fingers.size === 2 && !pinched) begun();
    pinched ||= fingers.size === 2;
    if (pinched) event.stopImmediatePropagation();
    if (pinched && before && type === 'pointermove') {
      const [x, y, reach] = spread([...fingers.values()]);
      camera.move(x - before[0], y - before[1]);
      camera.closer(reach / before[2], x, y);
      redraw();
    }
    if (!fingers.size) pinched = false;
  };
  for (const type of ['pointerdown', 'pointermove', 'pointerup', 'pointercancel']) {
    canvas.addEventListener(type, /** @type {EventListener} */ (follow), { capture: true });
  }
}
