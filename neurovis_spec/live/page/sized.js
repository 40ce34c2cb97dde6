/**
 * Sized: where an element stands and how large it is, as it was laid out last. To ask the page for that after something
 * was written in a frame has it lay out all anew, once for each that asks.
 */

/** Follows an element. */
export class Sized {
  /** @param {HTMLElement} element @param {() => void} changed */
  constructor(element, changed) {
    this.left = 0;
    this.top = 0;
    this.wide = 0;
    this.high = 0;
    new ResizeObserver(() => {
      const { offsetLeft, offsetTop, offsetWidth, offsetHeight } = element;
      [this.left, this.top, this.wide, this.high] = [offsetLeft, offsetTop, offsetWidth, offsetHeight];
      changed();
    }).observe(element);
  }
}
