/**
 * Controls: the buttons, the speed and the keys of a run.
 */

import { followKeys } from './keys.js';
import { Rate } from './rate.js';
import { say } from './say.js';

/** @typedef {import('./protocol.js').Status} Status */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Look} Look */
/** @typedef {import('./keys.js').Keys} Keys */

/** @template {HTMLElement} T @param {string} id @returns {T} */
export const part = (id) => /** @type {T} */ (document.getElementById(id));

/** The bar below the picture. */
export class Controls {
  /** @param {Link} link */
  constructor(link) {
    this.link = link;
    this.playing = true;
    this.owner = false;
    /** @type {HTMLButtonElement} */
    this.play = part('play');
    /** @type {HTMLSelectElement} */
    this.speed = part('speed');
    this.told = part('told');
    this.findings = part('findings');
    this.rate = new Rate(part('rate'));
    part('seen').onclick = () => {
      this.findings.hidden = true;
    };
    /** @type {Object<string, () => void>} */
    const actions = {
      restart: () => link.ask('restart'),
      back: () => link.ask('step', { by: -1 }),
      play: () => this.toggle(),
      step: () => link.ask('step', { by: 1 }),
      before: () => link.ask('event', { by: -1 }),
      next: () => link.ask('event', { by: 1 }),
      branch: () => link.ask('branch'),
    };
    for (const [id, action] of Object.entries(actions)) part(id).onclick = action;
    this.speed.onchange = () => link.ask('speed', { value: this.speed.value });
    /** @type {Keys} */
    this.keys = {
      ' ': ['play or pause', actions.play],
      ArrowRight: ['one step on', actions.step],
      ArrowLeft: ['one step back', actions.back],
      Home: ['restart', actions.restart],
      e: ['to the next event of the spec', actions.next],
      E: ['to the event before', actions.before],
      b: ['branch: go on differently from here, and keep what came after', actions.branch],
    };
    followKeys(this.keys);
  }

  /** Play or pause. */
  toggle() {
    this.link.ask(this.playing ? 'pause' : 'play');
  }

  /** How the run stands. @param {Status} status */
  status(status) {
    this.playing = status.playing;
    const does = status.playing ? 'pause' : 'play';
    this.play.setAttribute('aria-label', does);
    this.play.querySelector('use')?.setAttribute('href', `#i-${does}`);
    this.speed.value = status.speed;
    this.rate.status(status);
    this.owner = status.owner;
    for (const id of ['restart', 'back', 'play', 'step', 'speed', 'before', 'next', 'svg', 'pdf', 'npz', 'film']) {
      const isEvent = id === 'before' || id === 'next';
      /** @type {HTMLButtonElement} */ (part(id)).disabled = !status.owner || (isEvent && !status.events.length);
    }
  }

  /** @param {Look} look */
  frame(look) {
    /** @type {HTMLButtonElement} */ (part('branch')).disabled = !this.owner || look.step === look.last;
    this.tell(`step ${look.step}`);
    this.rate.show(look.step, this.link.scene?.dt ?? null);
  }

  /** Why something is not done. @param {string} reason */
  refuse(reason) {
    this.tell(reason);
    say(reason);
  }

  /** @param {string} text */
  tell(text) {
    if (this.told.textContent !== text) this.told.textContent = text;
  }

  /** What is wrong with an edited spec, or was noticed. @param {{text: string, errors: boolean}} found */
  found(found) {
    part('noticed').textContent = found.text;
    this.findings.hidden = !found.text;
    this.findings.classList.toggle('mild', !found.errors);
  }
}
