"""What is read behind a syntax error: all else that is wrong is said at once, and nothing follows from the loss."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

import neurovis_spec as nv
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import Scalar

SPECS = sorted((Path(__file__).parent.parent / "specs").glob("*.yaml"))
#: What the reader itself says of characters that begin no text.
SYNTAX = {"yaml-syntax", "tag", "anchor", "alias"}


def said(text: str, folder: Path | None = None) -> list[str]:
    try:
        network = nv.compile_text(text, folder=folder)
    except nv.SpecError as error:
        return [f"{item.span.line}:{item.span.column} {item.code}" for item in error.diagnostics]
    return [f"{item.span.line}:{item.span.column} {item.code}" for item in network.warnings]


def test_what_stands_before_and_behind_is_found_too() -> None:
    text = "neurovis: 1\nname: x\nneurons:\n  A: {bais: 2}\n  B: {label: a: b}\n  C: {label: @x}\n"
    text += "connections:\n  A -> D: 1\n"
    assert said(text) == ["4:7 unknown-key", "5:15 yaml-syntax", "6:14 yaml-syntax", "8:8 unknown-neuron"]


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (
            "neurons: {A: {bias: 1}, B: [}\nconnections: {A -> B: tahn(1)}",
            ["3:29 yaml-syntax", "4:23 unknown-function"],
        ),
        ("neurons:\n  A: {bias: 'one\n  B: {bias: 2}\nconnections: {A -> B: 1, B -> A: x}", ["4:13", "6:34"]),
        ("neurons: {A: {bias: 1}}\nconnections:\n  A -> A: [[1, 2], [3 4]", ["5:11 yaml-syntax"]),
        ("neurons:\n  A:{bias: 1, size: 2}\n  B: {bais: 1}\nconnections: {A -> B: 1}", ["4:4 yaml", "5:7"]),
        ("neurons: {A: {bias: 1}}\nevents:\n  - {at: 1, lesion: A\n  - {at: 2, lesion: B}", ["5:5", "6:21"]),
        ("neurons: {A: {bias: 1}}\nlayout: [\n", ["4:9 yaml-syntax"]),
    ],
)
def test_what_is_lost_has_no_consequences(lines: str, expected: list[str]) -> None:
    found = said(f"neurovis: 1\nname: x\n{lines}\n")
    assert len(found) == len(expected)
    assert all(item.startswith(begin) for item, begin in zip(found, expected, strict=True)), found


def spoilt(text: str, random: Random) -> str:
    """A text with one slip in its punctuation."""
    lines = text.split("\n")
    number = random.randrange(len(lines))
    line = lines[number]
    brackets = [at for at, character in enumerate(line) if character in "[]{}"]
    colon = line.find(": ")
    ways = [" " + line]
    if brackets:
        at = random.choice(brackets)
        ways += [line[:at] + line[at + 1 :], line[:at] + random.choice("[]{}") + line[at:]]
    if colon > 0:
        ways += [line[: colon + 2] + begin + line[colon + 2 :] for begin in ("a: b: ", "@", "`", '"', "'", "[", "{")]
        ways += [line.replace(": ", ":", 1), line.replace(":", " ", 1)]
    lines[number] = random.choice(ways) if line.strip() else line
    return "\n".join(lines)


@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.stem)
def test_one_slip_in_a_sound_spec_is_all_that_is_said(path: Path) -> None:
    random = Random(path.stem)
    text = path.read_text(encoding="utf-8")
    slips = 0
    for _ in range(40):
        broken = spoilt(text, random)
        codes = {item.partition(" ")[2] for item in said(broken, path.parent)}
        if "yaml-syntax" in codes:  # the others are sound YAML of another meaning
            slips += 1
            assert codes <= SYNTAX, broken
    assert slips > 5


def lost(text: str) -> tuple[list[str], list[str]]:
    """The keys of a text at the top, a lost value marked by a ``?`` behind its key, and the places of its findings."""
    findings = Findings()
    document = read_text(text, "x", findings)
    places = [f"{item.span.line}:{item.span.column}" for item in findings.sorted()]
    entries = () if document is None else document.root.entries
    return [entry.name + "?" * (entry.value == Scalar(True, entry.value.span, None)) for entry in entries], places


@pytest.mark.parametrize(
    ("text", "names", "places"),
    [
        ('a: 1\nb: [1, 2\nc: {d: @e}\nf: "x\n  - y\ng: 3\n', ["a", "b?", "c?", "f?", "g"], ["2:4", "3:8", "4:4"]),
        ("a: [1\nb: 2\n", ["a?", "b"], ["1:4"]),
        ("a: {b: 1 c: 2,\n  d: [3}\n}\ne: 4\n", ["a?", "e"], ["1:11"]),
        ("a:\n  - {b: [\n     1}\n  - c\nd: @\n", ["a", "d?"], ["3:7", "5:4"]),
        ("time:{dt: 1, size: 2}\nb: 1\n", ["time?", "b"], ["1:5"]),
        ('"k: l": @x\nb: 1\n', ["k: l?", "b"], ["1:9"]),
        ("a: 'one\nb: it's\nc: 'two'\n", ["a?", "b", "c"], ["1:4"]),
        ("a:\n  'b: 1\n  c: 2\nd: 3\n", ["a?", "d"], ["2:3"]),
    ],
)
def test_what_a_syntax_error_costs(text: str, names: list[str], places: list[str]) -> None:
    assert lost(text) == (names, places)


@pytest.mark.parametrize(
    ("text", "names", "places"),
    [
        ("a: 1\nb 2\nc: @\n", ["a", "b?", "c?"], ["2:1", "3:4"]),
        ("a: 1\n=b\nc: @\n", ["a", "c?"], ["2:1", "3:4"]),
        ("a:\n    b: 1\n  c: 2\n  d: 3\ne: @\n", ["a", "e?"], ["3:3", "5:4"]),
        ("a: 1\n- b\nc: @\n", ["a", "c?"], ["2:1", "3:4"]),
        ("a: 1\n  b: 2\n  c: 3\nd: @\n", ["a?", "d?"], ["2:3", "4:4"]),
        ("a: [1]\nb:\n  - [c]\n   - d\ne: 1\n", ["a", "b?", "e"], ["4:4"]),
    ],
)
def test_lines_that_fit_nowhere_are_left_out(text: str, names: list[str], places: list[str]) -> None:
    assert lost(text) == (names, places)


@pytest.mark.parametrize("text", ["a:\n\tb: 1\nc: @\n", "  a: 1\nb: 2\n", "%YAML 1.2\na: @\n"])
def test_where_nobody_can_tell_what_is_missing_that_alone_is_said(text: str) -> None:
    names, places = lost(text)
    assert (names, len(places)) == ([], 1)


def test_all_syntax_errors_are_said() -> None:
    names, places = lost("".join(f"k{number}: @\n" for number in range(300)))
    assert (len(names), len(places)) == (300, 300)
