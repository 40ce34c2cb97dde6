"""What is read behind a syntax error: all else that is wrong is said at once, and nothing follows from the loss."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

import neurovis_spec as nv
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.yaml.characters import Lines
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.repair import LARGEST_MENDED, MOST_MENDED, faulty_value, left_out

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
        ("neurons:\n  A:{bias: 1, size: 2}\n  B: {bais: 1}\nconnections: {A -> B: 1}", ["4:19 yaml", "5:7"]),
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


def test_both_parsers_leave_out_the_same() -> None:
    text = 'a: 1\nb: [1, 2\nc: {d: @e}\nf: "x\n  - y\ng: 3\n'
    results = []
    for pure in (False, True):
        findings = Findings()
        document = read_text(text, "x", findings, pure=pure, mend=True)
        assert document is not None
        assert [entry.name for entry in document.root.entries] == ["a", "b", "c", "f", "g"]
        results.append((document, findings.sorted()))
    assert results[0] == results[1]
    assert [item.span.line for item in results[0][1]] == [2, 3, 4]


def test_who_does_not_ask_for_it_gets_no_document() -> None:
    findings = Findings()
    assert read_text("a: [1\nb: 2\n", "x", findings) is None
    assert [item.code for item in findings.sorted()] == ["yaml-syntax"]


def test_there_is_an_end_to_it() -> None:
    findings = Findings()
    many = "".join(f"k{number}: @\n" for number in range(MOST_MENDED + 5))
    assert read_text(many, "x", findings, mend=True) is None
    assert len(findings.sorted()) == MOST_MENDED + 1
    findings = Findings()
    large = "a: @\n" + "# \n" * (LARGEST_MENDED // 3 + 1)
    assert read_text(large, "x", findings, mend=True) is None
    assert len(findings.sorted()) == 1


@pytest.mark.parametrize(
    ("text", "line", "expected"),
    [
        ("a: [1\nb: 2\n", 1, "a: ~ \nb: 2\n"),
        ("a:\n  - {b: [\n     1}\n  - c\n", 2, "a:\n  - ~    \n       \n  - c\n"),
        ("  time:{dt: 1}\n", 1, "  time: ~     \n"),
        ("  time  {dt: 1}\n", 1, "  time: ~      \n"),
        ('"k: l": @x\n', 1, '"k: l": ~ \n'),
    ],
)
def test_the_stretch_that_is_left_out(text: str, line: int, expected: str) -> None:
    stretch = faulty_value(Lines(text), line)
    assert stretch is not None
    assert left_out(text, stretch) == expected
    assert expected[stretch.unread] == "~"


@pytest.mark.parametrize("text", ["just a text\n", "# a: b\n", "\n", "a: ~\n", "a:\n"])
def test_where_no_value_can_be_told(text: str) -> None:
    assert faulty_value(Lines(text), 1) is None
