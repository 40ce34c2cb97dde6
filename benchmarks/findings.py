"""How good the findings are: what is accepted, where findings point, whether a misspelling gets the right word.

In: the defective specs of ``tests/errors``, with what they expect beside their lines, and a right spec, each of whose
words is misspelt in every way that one letter can be. Out: a table, on standard output. Run with
``python benchmarks/findings.py [--misses]``; status 1 where a target is missed. The peers' figures are those of their
own checks of a dozen such specs, as measured once.
"""

from __future__ import annotations

import random
import re
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, permutations
from pathlib import Path

import neurovis_spec as nv
from neurovis_spec.diagnostics import Diagnostic, Findings, Span
from neurovis_spec.language.expressions.lexer import WORDS
from neurovis_spec.language.reader import read_text
from neurovis_spec.language.source import Mapping, Node, Scalar, Sequence

ERRORS = Path(__file__).resolve().parent.parent / "tests" / "errors"
_EXPECTED = re.compile(r"# (error|warning): (\d+):(\d+) ([\w-]+)")
_FIRST = re.compile(r"'([^']*)'")
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
_DECLARED = {"parameters", "inputs", "activations", "models", "rules", "neurons", "let", "state", "outputs", "boxes"}
#: Mappings whose keys are references to what stands elsewhere.
_REFERRED = {"positions", "arrange", "set", "clamp"}
#: Texts that say what they like.
_FREE = {"name", "box", "description", "title"}


@dataclass(frozen=True, slots=True)
class Word:
    """A word that can be misspelt: of the language or a reference, on its line from its column (from 1)."""

    text: str
    line: int
    column: int
    kind: str
    inside: Span | None = None

    def holds(self, other: Word) -> bool:
        """Whether the other word stands inside the value of this key, of which nothing can be said once it is lost."""
        span = self.inside
        place = (other.line, other.column)
        return span is not None and (span.line, span.column) <= place < (span.end_line, span.end_column)


def occurrences(node: Node, under: str = "", depth: int = 0) -> Iterator[Word]:
    """The words of a spec that mean something that is known elsewhere."""
    match node:
        case Mapping(entries=entries):
            for entry in entries:
                name = entry.name
                if (under == "connections" and depth == 1) or under in _REFERRED:
                    yield from _words(entry.key, "reference")
                elif under not in _DECLARED:
                    yield from _words(entry.key, "key", entry.value.span)
                yield from occurrences(entry.value, name, depth + 1)
        case Sequence(items=items):
            for item in items:
                yield from occurrences(item, under, depth + 1)
        case Scalar(value=str()) if under not in _FREE and under != "signals":
            yield from _words(node, "value")


def _words(scalar: Scalar, kind: str, inside: Span | None = None) -> Iterator[Word]:
    text = str(scalar.value)
    for match in _NAME.finditer(text):
        word = match.group()
        if len(word) >= _SHORTEST and word not in WORDS:
            place = scalar.at(match.start(), match.end())
            yield Word(word, place.line, place.column, kind, inside)


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


def first_hint(item: Diagnostic) -> str:
    """The first name that a hint offers."""
    match = _FIRST.search(item.hint or "")
    return "" if match is None else match[1]


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
    """Of misspellings: tried, accepted in silence, found at the very place, answered with the right word first."""

    tried: int = 0
    accepted: int = 0
    located: int = 0
    first: int = 0
    among: int = 0


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
            score.first += any(first_hint(item) == word.text for item in here)
            score.among += any(f"'{word.text}'" in (item.hint or "") for item in here)
            if show and not any(first_hint(item) == word.text for item in here):
                said = "; ".join(f"{item.span.line}:{item.span.column} {item.code}: {item.hint}" for item in found[:2])
                print(f"  {word.line}:{word.column} {word.text} → {wrong} ({how}): {said or 'accepted'}")
    return scores


def several(words: list[Word], count: int, at_once: int, show: bool) -> tuple[int, int]:
    """Specs with several misspellings on lines of their own, none inside another: how many specs, and in how many all
    were found."""
    chooser = random.Random(2)
    whole = tried = 0
    while tried < count:
        picked = chooser.sample(words, at_once)
        if len({word.line for word in picked}) < at_once or any(
            one.holds(other) for one, other in permutations(picked, 2)
        ):
            continue
        text = SPEC
        for word in picked:
            text = misspelt(text, word, word.text[:1] + word.text[2:] + "q")
        places = {(item.span.line, item.span.column) for item in found_in(text)}
        tried += 1
        missing = [word for word in picked if (word.line, word.column) not in places]
        whole += not missing
        if show and missing:
            print(f"  of {shown(picked)}: not {shown(missing)}")
    return tried, whole


def shown(words: list[Word]) -> str:
    return ", ".join(f"{word.line}:{word.column} {word.text}" for word in words)


def share(part: int, whole: int) -> str:
    return f"{part} of {whole} ({100 * part / whole:.1f} %)"


def main() -> int:
    findings = Findings()
    document = read_text(SPEC, "spec.yaml", findings)
    assert document is not None
    assert found_in(SPEC) == ()
    words = list(occurrences(document.root))
    specs, accepted, expected, located = defective()
    scores = one_letter(words, "--misses" in sys.argv)
    tried = sum(score.tried for score in scores.values())
    there = sum(score.located for score in scores.values())
    first = sum(score.first for score in scores.values())
    missed = sum(score.accepted for score in scores.values())
    rows = [
        ("defective specs accepted in silence", "PyRates 1 of 8, NeuroMLlite 4 of 12, BSB 1 of 12, MDF 1 of 10",
         share(accepted, specs)),
        ("findings with the right line and column", "1 or 2 of 12", share(located, expected)),
        ("misspellings accepted in silence", "–", share(missed, tried)),
        ("misspellings found at the very place", "1 or 2 of 12", share(there, tried)),
        ("misspellings with the right word first", "none", share(first, tried)),
    ]  # fmt: skip
    for kind, score in sorted(scores.items()):
        rows.append((f"  of these: {kind}s", "", share(score.first, score.tried)))
    for at_once in (2, 3, 5):
        done, whole = several(words, 200, at_once, "--misses" in sys.argv)
        rows.append((f"{at_once} faults at once, all found", "none", share(whole, done)))
    print(f"{'what':42}{'peers':64}here")
    for what, peers, ours in rows:
        print(f"{what:42}{peers:64}{ours}")
    return int(accepted > 0 or located < 0.95 * expected or missed > 0 or first < 0.95 * tried)


if __name__ == "__main__":
    sys.exit(main())
