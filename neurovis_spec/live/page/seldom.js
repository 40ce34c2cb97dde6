/**
 * Seldom: what is read is written some times a second, and in the end as it is; what is drawn is drawn in each frame.
 */

/** Milliseconds from one time to the next. */
const APART = 100;

/** Does something now, or, where that was done just before, a little later. */
export class Seldom {
  /** @param {() => void} does */
  constructor(does) {
    this.does = does;
    this.when = -APART;
    this.timer = 0;
  }

  /** Do it, at the latest in some milliseconds. */
  ask() {
    if (this.timer) return;
    this.timer = setTimeout(
      () => {
        [this.timer, this.when] = [0, performance.now()];
        this.does();
      },
      Math.max(0, this.when + APART - performance.now()),
    );
  }
}
