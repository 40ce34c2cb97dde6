/**
 * Refusals: why something that was asked is not done, to be read until something else is done.
 */

/** What was refused last. */
export class Refusal {
  /** @param {HTMLElement} place */
  constructor(place) {
    this.place = place;
    for (const name of ['pointerdown', 'keydown'])
      addEventListener(
        name,
        () => {
          place.hidden = true;
        },
        true,
      );
  }

  /** @param {string} reason */
  tell(reason) {
    this.place.textContent = reason;
    this.place.hidden = false;
  }
}
