"""Findings in texts over several lines, or with escapes, stand at the characters, however YAML has them written."""

from __future__ import annotations

import pytest

import neurovis_spec as nv
from neurovis_spec.diagnostics import SpecError
from neurovis_spec.language.yaml.texts import Written

WAYS = {
    "folded": "bias: >\n      1 +\n      2 * foo\n",
    "folded, kept": "bias: >+ # a comment\n      1 +\n\n        2 * foo\n\n",
    "literal": "bias: |\n      1 +\n        2 * foo",
    "literal, indented": "bias: |2-\n       1 +\n      2 * foo",
    "plain": "bias: 1 +\n      2 *\n\n      foo",
    "quoted": "bias: '1 +\n\n      2 * foo'",
    "quoted twice": 'bias: "1 +\n      2 * foo"',
    "escaped end of line": 'bias: "1 + \\\n      2 * foo"',
    "escapes": 'bias: "1 +\\t\\x32 * \\U00000031 *\n    foo"',
    "in braces": "bias: 1\n     , noise: normal(0, 1)\n     , initial: 1 +\n\n   2 * foo",
    "anchored": "bias: !!str >\n      1 +\n      2 * foo",
}


@pytest.mark.parametrize("end", ["\n", "\r\n"], ids=["unix", "windows"])
@pytest.mark.parametrize("body", WAYS.values(), ids=WAYS)
def test_a_finding_stands_at_the_character(body: str, end: str) -> None:
    block = not body.startswith("bias: 1\n     ,")
    neuron = f"\n    {body}\n  B: {{}}\n" if block else f" {{{body}}}\n  B: {{}}\n"
    text = f"neurovis: 1\nname: x\nneurons:\n  A:{neuron}".replace("\n", end)
    with pytest.raises(SpecError) as caught:
        nv.compile_text(text)
    (found,) = (item for item in caught.value.diagnostics if item.code == "unknown-name")
    lines = text.split(end)
    line = next(number for number, line in enumerate(lines) if "foo" in line)
    column = lines[line].index("foo")
    assert tuple(found.span)[1:] == (line + 1, column + 1, line + 1, column + 4)


def test_a_reference_over_several_lines() -> None:
    text = "neurovis: 1\nname: x\nneurons: {A: {bias: 1}, B: {}}\nconnections:\n  ? A +\n    Q\n    -> B\n  : 1\n"
    with pytest.raises(SpecError) as caught:
        nv.compile_text(text)
    (found,) = caught.value.diagnostics
    assert (found.code, found.span.line, found.span.column, found.span.end_column) == ("unknown-neuron", 6, 5, 6)


def test_a_part_of_an_expression_is_shown_from_its_first_to_its_last_character() -> None:
    text = "neurovis: 1\nname: x\nneurons:\n  A:\n    bias: >\n      1 + normal(0,\n       0 - 1) * 2\n"
    with pytest.raises(SpecError) as caught:
        nv.compile_text(text)
    (found,) = caught.value.diagnostics
    assert tuple(found.span)[1:] == (7, 8, 7, 13)


def test_a_value_that_is_written_otherwise_has_no_places() -> None:
    assert Written("'a b'", 0, 5).places("a c") is None
    assert Written("'a b'", 0, 5).places("a") is None
    assert Written("'a b'", 0, 5).places("a bc") is None
    assert Written("x: |\n  a\n\n  b\n", 3, 14).places("a\n\nb\n") == ((1, 2), (1, 3), (1, 3), (3, 2), (3, 3))
