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
            assert f"did you mean '{name}'?" == found.hint
        else:  # it is used once: that may be the slip, too
            assert wrong in (found.hint or found.message)
    assert at_declaration >= 3


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
