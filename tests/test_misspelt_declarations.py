"""One cause, one finding: in our specs a declaration that is misspelt and used several times is told of once, there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import neurovis_spec as nv
from neurovis_spec.language.yaml.reader import read_any
from neurovis_spec.language.yaml.source import Mapping, Scalar

ROOT = Path(__file__).parent.parent / "specs"
SPECS = ("hexapod/hexapod.yaml", "walk/walk.yaml", "reward.yaml")
PARTS = ("parameters", "inputs", "neurons", "instances", "state", "let")
DEFINITIONS = ("modules", "models", "rules")
UNUSED = {"as_printed"}


def declarations(node: Mapping) -> Iterator[Scalar]:
    """The keys that declare names."""
    for part in (*PARTS, *DEFINITIONS):
        inner = node.get(part)
        for entry in inner.entries if isinstance(inner, Mapping) else ():
            yield entry.key
            if part in DEFINITIONS and isinstance(entry.value, Mapping):
                yield from declarations(entry.value)


def misspelt(text: str, key: Scalar, name: str) -> str:
    """The text with another name where this one is declared."""
    lines, span = text.split("\n"), key.span
    line = lines[span.line - 1]
    lines[span.line - 1] = line[: span.column - 1] + name + line[span.end_column - 1 :]
    return "\n".join(lines)


@pytest.mark.parametrize("spec", SPECS)
def test_a_misspelt_declaration_is_one_finding(spec: str) -> None:
    path = ROOT / spec
    text = path.read_text()
    root = read_any(text, spec)
    assert isinstance(root, Mapping)
    at_declaration = 0
    for key in declarations(root):
        name = str(key.value)
        wrong = f"q{name[1:]}"
        if len(name) < 2 or name in UNUSED or re.search(rf"\b{wrong}\d*\b", text):
            continue
        with pytest.raises(nv.SpecError) as caught:
            nv.compile_text(misspelt(text, key, wrong), file=spec, folder=path.parent)
        (found,) = caught.value.diagnostics
        if found.code == "misspelt-declaration":
            at_declaration += 1
            assert found.span == key.span._replace(end_column=key.span.column + len(wrong))
            assert (found.hint or "").startswith(f"did you mean '{name}'?")
        else:  # it is used once: that may be the slip, too
            assert wrong in (found.hint or found.message)
    assert at_declaration  # of short names none is accused


@pytest.mark.parametrize(
    ("spec", "name"),
    [("hexapod/hexapod.yaml", "DL"), ("walk/walk.yaml", "C"), ("sound.yaml", "D"), ("reward.yaml", "L")],
)
def test_what_is_nowhere_declared_is_one_finding(spec: str, name: str) -> None:
    path = ROOT / spec
    text = re.sub(rf"^  {name}:", "  unlike:", path.read_text(), count=1, flags=re.MULTILINE)
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(text, file=spec, folder=path.parent)
    (found,) = caught.value.diagnostics
    assert f"'{name}" in found.message
    assert "more uses: " in found.message


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        # names of one series, which differ in their number or their one letter
        ("neurons: {left1: {}, left2: {}, A: {}}\nconnections: {left1 -> A: 1, left3 -> A: 1, A -> left3: 1}\n", 4, ""),
        ("parameters: {tau1: 1, tau2: 2}\nneurons: {A: {bias: tau1 + tau3}, B: {bias: tau3}}\n", 4, "'tau2'"),
        ("neurons: {h1: {}, h3: {}}\nconnections:\n  h1 -> h4: 1\n  h4 -> h1: 1\n", 5, "'h3'"),
        ("parameters: {gain_b: 1}\nneurons: {A: {bias: gain_c}, B: {bias: gain_c}}\n", 4, "'gain_b'"),
        ("parameters: {gainB: 1}\nneurons: {A: {bias: gainC}, B: {bias: gainC}}\n", 4, "'gainB'"),
        ("parameters: {l_gain: 1}\nneurons: {A: {bias: r_gain}, B: {bias: r_gain}}\n", 4, "'l_gain'"),
        # one that is used is as near
        (
            "neurons: {hidden: {}, hide: {}, A: {}}\nconnections: {hidden -> A: 1, hidde -> A: 1, A -> hidde: 1}\n",
            4,
            "did you mean 'hidden' or 'hide'?",
        ),
        # of few letters
        (
            "neurons: {A: {}, B: {}, AB: {}}\nconnections: {A -> B: 1, A -> BB: 1, BB -> A: 1}\n",
            4,
            "did you mean 'B'? 'AB' (line 3) is declared and never used",
        ),
        ("neurons: {RL: {}, B: {}}\nconnections: {B -> LR: 1, LR -> B: 1}\n", 4, ""),
    ],
)
def test_what_may_be_another_name_is_not_accused(text: str, line: int, words: str) -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(f"neurovis: 1\nname: x\n{text}")
    (found,) = caught.value.diagnostics
    assert found.code in ("unknown-name", "unknown-neuron")
    assert found.span.line == line
    assert "one more use" in found.message
    assert words in (found.hint or "")


def test_a_slip_within_a_series_is_found() -> None:
    text = "neurons: {left1: {}, letf2: {}, A: {}}\nconnections: {left1 -> A: 1, left2 -> A: 1, A -> left2: 1}\n"
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(f"neurovis: 1\nname: x\n{text}")
    (found,) = caught.value.diagnostics
    assert found.code == "misspelt-declaration"
    assert found.hint == "did you mean 'left2'? or is 'left2' (line 4) meant to be 'letf2'?"
