"""How good the findings are: what is accepted, where findings point, whether a misspelling gets the right word, and
whether several faults are found at once.

In: the defective specs of ``tests/errors``, with what they expect beside their lines, and a right spec, each of whose
words is misspelt in every way that one letter can be; and the same spec with several faults of all kinds (``faults``)
at once, anywhere, also inside each other, such as a wrong number under a misspelt key. Out: a table, on standard
output. Run with ``python benchmarks/findings.py [--misses]``; status 1 where a target is missed. The peers' figures are
those of their own checks of a dozen such specs, as measured once.

A suggestion is right where the word stands first, or behind none but words that are as few slips away from what is
written: ``sensorp`` may be ``sensor1`` as well as ``sensor2``. Of several faults each has to be found at its place; a
finding at another place is a follow-up, which is counted, too. One fault alone can wait for another: a setting of a
definition, such as ``{chase: {colour: red}}``, or a name in its formulas, where another fault lies in what the same
definition declares (``signals: [{}]``, ``parameters``): nobody can know whether ``colour`` is among it. Such are
told apart (``waits``); all others are misses.
"""

from __future__ import annotations

import random
import re
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from faults import Fault, faults, pick, with_faults

import neurovis_spec as nv
from neurovis_spec.diagnostics import Diagnostic, Findings, Span
from neurovis_spec.language.expressions.lexer import WORDS
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import Mapping, Node, Scalar, Sequence
from neurovis_spec.likeness import slips

ERRORS = Path(__file__).resolve().parent.parent / "tests" / "errors"
_EXPECTED = re.compile(r"# (error|warning): (\d+):(\d+) ([\w-]+)")
_OFFERED = re.compile(r"'([^']*)'")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_LETTERS = "abcdefghijklmnopqrstuvwxyz"
_SHORTEST = 3

#: A right spec with words long enough to be misspelt.
SPEC = """\
neurovis: 1
name: walking
time: {steps: 100, episode: 50}
parameters:
  strength: {value: 0.5, min: 0, max: 1}
  frequency: 2*strength
inputs:
  target: {expression: sin(frequency*k)*strength}
  pulse: {values: [[0], [1]]}
  torque: {size: 6}
activations:
  swish: {parameters: {beta: 1}, let: {inner: beta*x}, value: x*sigmoid(inner)}
models:
  slow: {parameters: {leak: 0.1}, state: {voltage: {initial: 0, each_step: voltage + leak*drive}}, activity: f(voltage)}
rules:
  chase:
    parameters: {speed: 0.01}
    signals: [goal]
    state: {trace: {initial: 0, each_step: trace + pre, each_episode: 0}}
    weight: {each_step: weight + speed*trace*(goal - post)}
neurons:
  sensor: {count: 6, input: torque, activation: tanh, box: outside, role: input}
  rhythm: {count: 2, activation: {leaky_relu: {slope: 0.1}}, bias: strength*i, initial: [0.1, frequency]}
  kernel: {count: 4, combine: distance, activation: {gaussian: {sigma: 40}}}
  motor: {count: 3, model: {leaky_integrator: {leak: strength}}, noise: "normal(0, strength)"}
  body: {activation: {swish: {beta: frequency}}, model: {slow: {leak: 0.2}}, position: [0, 1]}
  teacher: {input: target}
  clock: {input: pulse}
connections:
  sensor -> rhythm: {weight: "uniform(0, strength)", pattern: all_to_all}
  rhythm -> rhythm: {matrix: [[strength, 1], [-1, cos(frequency)]]}
  rhythm -> kernel: {centre: [[0, 1, 2, 3], [strength, 1, null, 1]], delay: 0}
  kernel -> motor: {weight: 0, pattern: {random: {probability: 0.9}}, plasticity: {delta: {rate: 0.1, target: teacher}}}
  motor -> body: {weight: 0.2, plasticity: {chase: {speed: strength, goal: clock}}, bounds: [-1, strength]}
  sensor -> motor: {edges: [[sensor1, motor1, 1], [sensor2, motor2, strength, 2]]}
  body + clock -> body: {weight: 0.1, self: true}
events:
  - {at: 2, set: {strength: 0.7}}
  - {from: 3, to: 5, clamp: {body: 0}}
  - {at: 8, lesion: [clock, motor -> body]}
outputs: {position: body, speeds: [motor1, motor2]}
layout:
  engine: layered
  direction: right
  positions: {body: [0, 0]}
  arrange: {rhythm: row}
  boxes: {brain: [kernel, motor]}
  spacing: {neuron: 1.5, rank: 2.5}
render: {gain: {activity: 1, thickness: 2}, theme: dark, labels: true, legend: false}
"""
#: Mappings whose keys are the author's own names, by the key they stand under.
_DECLARED = {
    *("parameters", "inputs", "activations", "models", "rules", "synapses", "neurons", "let", "state", "outputs"),
    "boxes",
}
#: Mappings whose keys are references to what stands elsewhere.
_REFERRED = {"positions", "arrange", "set", "clamp"}
#: Texts that say what they like.
_FREE = {"name", "box", "description", "title"}
#: Keys under which a mapping has one key, a name.
_CHOICES = {"activation", "model", "pattern", "plasticity", "synapse"}


@dataclass(frozen=True, slots=True)
class Word:
    """A word that can be misspelt: of the language or a reference, on its line from its column (from 1)."""

    text: str
    line: int
    column: int
    kind: str


def occurrences(node: Node, under: str = "", depth: int = 0) -> Iterator[Word]:
    """The words of a spec that mean something that is known elsewhere."""
    match node:
        case Mapping(entries=entries):
            for entry in entries:
                name = entry.name
                if (under == "connections" and depth == 1) or under in _REFERRED:
                    yield from _words(entry.key, "reference")
                elif under not in _DECLARED:
                    yield from _words(entry.key, "key")
                yield from occurrences(entry.value, name, depth + 1)
        case Sequence(items=items):
            for item in items:
                yield from occurrences(item, under, depth + 1)
        case Scalar(value=str()) if under not in _FREE and under != "signals":
            yield from _words(node, "value")


def _words(scalar: Scalar, kind: str) -> Iterator[Word]:
    text = str(scalar.value)
    for match in _NAME.finditer(text):
        word = match.group()
        if len(word) >= _SHORTEST and word not in WORDS:
            place = scalar.at(match.start(), match.end())
            yield Word(word, place.line, place.column, kind)


def misspellings(word: str, chooser: random.Random) -> Iterator[tuple[str, str]]:
    """Each letter left out, each two changed over, each replaced by another; the first letter stays a letter."""
    for at in range(len(word)):
        yield "left out", word[:at] + word[at + 1 :]
        yield "replaced", word[:at] + chooser.choice(_LETTERS) + word[at + 1 :]
    for at, (one, other) in enumerate(pairwise(word)):
        yield "changed over", word[:at] + other + one + word[at + 2 :]


def misspelt(text: str, word: Word, wrong: str) -> str:
    lines = text.split("\n")
    line = lines[word.line - 1]
    start = word.column - 1
    assert line[start : start + len(word.text)] == word.text, (line, word)
    lines[word.line - 1] = line[:start] + wrong + line[start + len(word.text) :]
    return "\n".join(lines)


def found_in(text: str, folder: Path | None = None) -> tuple[Diagnostic, ...]:
    try:
        return nv.compile_text(text, folder=folder).warnings
    except nv.SpecError as error:
        return error.diagnostics


def offered(item: Diagnostic, wrong: str, right: str) -> tuple[bool, bool]:
    """Whether a hint offers the right word first; whether it offers it behind none but words that are as near to what
    is written."""
    words = _OFFERED.findall(item.hint or "")
    before = words[: words.index(right)] if right in words else [""]
    near = right in words and all(slips(wrong, other) <= slips(wrong, right) for other in before)
    return right in words and not before, near


def defective() -> tuple[int, int, int, int]:
    """Of ``tests/errors``: specs, those accepted in silence, findings expected, those found where they are."""
    specs = accepted = expected = located = 0
    for path in sorted(ERRORS.glob("*.yaml")):
        wanted = _EXPECTED.findall(path.read_text(encoding="utf-8", errors="replace"))
        try:
            found = nv.compile(path).warnings
        except nv.SpecError as error:
            found = error.diagnostics
        places = Counter((item.severity, str(item.span.line), str(item.span.column), item.code) for item in found)
        specs += 1
        accepted += not found
        expected += len(wanted)
        located += (Counter(wanted) & places).total()
    return specs, accepted, expected, located


@dataclass(slots=True)
class Score:
    """Of misspellings: tried, accepted in silence, found at the very place, answered with the right word first, or
    behind words that are as near."""

    tried: int = 0
    accepted: int = 0
    located: int = 0
    first: int = 0
    near: int = 0


def one_letter(words: list[Word], show: bool) -> dict[str, Score]:
    """Every misspelling of every word, by the kind of the word."""
    chooser = random.Random(1)
    known = {word.text for word in words}
    scores: dict[str, Score] = {}
    for word in words:
        for how, wrong in misspellings(word.text, chooser):
            if wrong == word.text or wrong in known or not _NAME.fullmatch(wrong):
                continue
            score = scores.setdefault(word.kind, Score())
            found = [item for item in found_in(misspelt(SPEC, word, wrong)) if item.severity == "error"]
            here = [item for item in found if (item.span.line, item.span.column) == (word.line, word.column)]
            score.tried += 1
            score.accepted += not found
            score.located += bool(here)
            answers = [offered(item, wrong, word.text) for item in here]
            score.first += any(first for first, _ in answers)
            score.near += any(near for _, near in answers)
            if show and not any(first for first, _ in answers):
                said = "; ".join(f"{item.span.line}:{item.span.column} {item.code}: {item.hint}" for item in found[:2])
                print(f"  {word.line}:{word.column} {word.text} → {wrong} ({how}): {said or 'accepted'}")
    return scores


@dataclass(slots=True)
class Several:
    """Of specs with several faults: tried; those in which all were found; those in which all were but such as wait for
    another; those in which nothing else was said."""

    tried: int = 0
    whole: int = 0
    sound: int = 0
    alone: int = 0


def possible(words: list[Word], root: Mapping) -> list[Fault]:
    """Every fault that is put into the right spec; a misspelling is two slips."""
    wrong = [(word.text, word.line, word.column, word.text[:1] + word.text[2:] + "q") for word in words]
    return list(faults(root, wrong, _DECLARED | _REFERRED | _CHOICES | {"connections"}, _FREE))


def bound(root: Mapping) -> list[tuple[Span, Span]]:
    """Where each definition declares what can be set, and where something of it is set, or read by its formulas."""
    result: list[tuple[Span, Span]] = []
    for section in ("activations", "models", "rules", "synapses"):
        definitions = root.get(section)
        for definition in definitions.entries if isinstance(definitions, Mapping) else ():
            assert isinstance(definition.value, Mapping)
            declared = [entry for entry in definition.value.entries if entry.name in ("parameters", "signals")]
            formulas = [entry.value.span for entry in definition.value.entries if entry not in declared]
            for used in (*settings(root, definition.name), *formulas):
                for entry in declared:
                    key, value = entry.key.span, entry.value.span
                    whole = Span(key.file, key.line, key.column, value.end_line, value.end_column)
                    result.append((whole, used))
    return result


def settings(node: Node, name: str, under: str = "") -> Iterator[Span]:
    """The settings of every use of a definition: ``{name: {…}}`` under a key that chooses one."""
    match node:
        case Mapping(entries=entries):
            for entry in entries:
                if under in _CHOICES and entry.name == name:
                    yield entry.value.span
                yield from settings(entry.value, name, entry.name)
        case Sequence(items=items):
            for item in items:
                yield from settings(item, name, under)


def waits(fault: Fault, picked: list[Fault], places: list[tuple[Span, Span]]) -> bool:
    """Whether a fault is a setting or a name of a definition of which another fault hides what can be set."""
    return any(
        inside(fault, used) and any(inside(other, declared) for other in picked if other is not fault)
        for declared, used in places
    )


def inside(fault: Fault, span: Span) -> bool:
    """Whether a fault begins within a stretch of the text."""
    return (span.line, span.column) <= (fault.line, fault.start + 1) < (span.end_line, span.end_column)


def several(possible: list[Fault], places: list[tuple[Span, Span]], count: int, at_once: int, show: bool) -> Several:
    """So many specs with so many faults; with one at once every possible fault by itself."""
    chooser = random.Random(2)
    result = Several()
    lots = [[fault] for fault in possible] if at_once == 1 else [pick(possible, at_once, chooser) for _ in range(count)]
    for picked in lots:
        text, wanted = with_faults(SPEC, picked)
        found = found_in(text)
        there = {(item.span.line, item.span.column) for item in found}
        missing = [fault for fault, where in zip(picked, wanted, strict=True) if not there & where]
        further = there.difference(*wanted)
        result.tried += 1
        result.whole += not missing
        result.sound += all(waits(fault, picked, places) for fault in missing)
        result.alone += not further
        if show and (missing or further):
            print(f"  of {shown(picked)}: not {shown(missing) or '–'}; further {sorted(further) or '–'}")
    return result


def shown(picked: list[Fault]) -> str:
    return ", ".join(f"{fault.line}:{fault.start + 1} {fault.kind}" for fault in picked)


def share(part: int, whole: int) -> str:
    return f"{part} of {whole} ({100 * part / whole:.1f} %)"


def main() -> int:
    findings = Findings()
    document = read_text(SPEC, "spec.yaml", findings)
    assert document is not None
    assert found_in(SPEC) == ()
    words = list(occurrences(document.root))
    show = "--misses" in sys.argv
    specs, accepted, expected, located = defective()
    scores = one_letter(words, show)
    total = Score()
    for score in scores.values():
        total.tried += score.tried
        total.accepted += score.accepted
        total.located += score.located
        total.first += score.first
        total.near += score.near
    rows = [
        ("defective specs accepted in silence", "PyRates 1 of 8, NeuroMLlite 4 of 12, BSB 1 of 12, MDF 1 of 10",
         share(accepted, specs)),
        ("findings with the right line and column", "1 or 2 of 12", share(located, expected)),
        ("misspellings accepted in silence", "–", share(total.accepted, total.tried)),
        ("misspellings found at the very place", "1 or 2 of 12", share(total.located, total.tried)),
        ("misspellings with the right suggestion", "none", share(total.near, total.tried)),
        ("  of these: the right word first", "", share(total.first, total.tried)),
    ]  # fmt: skip
    for kind, score in sorted(scores.items()):
        rows.append((f"  of {kind}s", "", share(score.near, score.tried)))
    good = accepted == total.accepted == 0 and located >= 0.95 * expected and total.near == total.tried
    possibles, places = possible(words, document.root), bound(document.root)
    for at_once in (1, 2, 3, 5, 8):
        done = several(possibles, places, 500, at_once, show)
        name = "each fault by itself" if at_once == 1 else f"{at_once} faults at once"
        rows.append((f"{name}: all found", "none", share(done.whole, done.tried)))
        if done.sound > done.whole:
            rows.append(("  but for a setting that waits", "", share(done.sound, done.tried)))
        rows.append(("  nothing else said", "", share(done.alone, done.tried)))
        good = good and done.sound == done.alone == done.tried
    print(f"{'what':42}{'peers':64}here")
    for what, peers, ours in rows:
        print(f"{what:42}{peers:64}{ours}")
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
