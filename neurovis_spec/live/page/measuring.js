/**
 * Measuring: the field in which a curve is asked for by typing it: a name, or a measure of the language.
 */

/** @typedef {import('./protocol.js').Group} Group */
/** @typedef {import('./protocol.js').Link} Link */
/** @typedef {import('./protocol.js').Scene} Scene */
/** @typedef {import('./strips.js').Strips} Strips */
/** @typedef {{start: number, end: number, message: string, hint: string}} Finding */

/** What a measure can call; as many names are offered. */
const CALLS = ['rms(', 'mean(', 'min(', 'max(', 'rate(', 'count(', 'last=', 'abs('],
  OFFERED = 40;
/** The end of a text that is the beginning of a name. */
const BEGUN = /[\p{L}_][\p{L}\p{N}_.]*$/u;

/** The field below the strips. */
export class Measuring {
  /** @param {Link} link @param {Strips} strips @param {(id: string) => HTMLElement} find */
  constructor(link, strips, find) {
    this.link = link;
    this.strips = strips;
    this.form = find('measuring');
    this.field = /** @type {HTMLInputElement} */ (find('measure'));
    this.names = find('measurable');
    this.told = find('mismeasured');
    this.button = find('addcurve');
    this.hint = this.told.textContent ?? '';
    /** @type {string[]} */
    this.known = [];
    /** what was asked for last, as it is awaited */
    this.awaited = '';
    this.button.onclick = () => this.toggle();
    this.form.onsubmit = (event) => {
      event.preventDefault();
      this.add(this.field.value.trim());
    };
    this.field.oninput = () => {
      this.tell([]);
      this.offer();
    };
    this.field.onkeydown = (event) => {
      if (event.key !== 'Escape') return;
      event.preventDefault();
      this.toggle();
    };
  }

  /** Another network. @param {Scene} scene */
  use(scene) {
    const { words, inputs, sensors } = scene.beside,
      neurons = scene.groups.flatMap(({ data }) => data.neuron ?? []);
    this.known = [
      ...new Set([...words, ...neurons, ...sensors, ...inputs, ...scene.parameters.map(({ name }) => name), ...CALLS]),
    ];
    this.offer();
  }

  /** Open the field, or close it. */
  toggle() {
    const open = this.form.hidden;
    this.form.hidden = !open;
    this.button.setAttribute('aria-expanded', String(open));
    (open ? this.field : this.button).focus();
    if (open) this.offer();
  }

  /** Offer the names that go on what is typed. */
  offer() {
    if (this.form.hidden) return;
    const text = this.field.value,
      begun = text.match(BEGUN)?.[0] ?? '',
      head = text.slice(0, text.length - begun.length),
      low = begun.toLowerCase();
    const fit = this.known.filter((name) => name.toLowerCase().startsWith(low) && name !== begun).slice(0, OFFERED);
    this.names.replaceChildren(...fit.map((name) => new Option('', head + name)));
  }

  /** Add a curve: of what is called so, else a measure. @param {string} text */
  add(text) {
    if (!text) return;
    const named = this.strips.named(text);
    if (this.strips.full) {
      this.tell([{ start: 0, end: 0, message: 'there is no room for another curve', hint: 'take one away with ×' }]);
    } else if (named) {
      this.strips.pin(named);
      this.done();
    } else {
      this.awaited = text;
      this.link.ask('measure', { text });
    }
  }

  /** Whether a text is a measure has been told. @param {{text: string, findings: Finding[]}} message */
  take({ text, findings }) {
    if (text !== this.awaited) return;
    this.awaited = '';
    if (findings.length) this.tell(findings);
    else this.done();
  }

  /** What was typed is a curve now. */
  done() {
    this.field.value = '';
    this.tell([]);
    this.offer();
  }

  /** Say what is wrong, and mark it; nothing: what can be written. @param {Finding[]} findings */
  tell(findings) {
    const [first] = findings;
    this.field.setAttribute('aria-invalid', String(Boolean(first)));
    this.told.classList.toggle('wrong', Boolean(first));
    this.told.textContent = first
      ? findings.map(({ message, hint }) => (hint ? `${message}: ${hint}` : message)).join('; ')
      : this.hint;
    if (!first || first.end <= first.start) return;
    this.field.focus();
    this.field.setSelectionRange(first.start, first.end);
  }
}
