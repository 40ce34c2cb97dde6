"""Places: conversion to the protocol's units, and the outline of texts that can and cannot be read."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsp_marks import marked

from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.yaml.reader import read_any, read_text
from neurovis_spec.lsp.completion import where
from neurovis_spec.lsp.outline import item_at, outline
from neurovis_spec.lsp.rename import apply, rename
from neurovis_spec.lsp.text import Place, Text, holds

ROOT = Path(__file__).parents[1]
SPECS = sorted([*ROOT.glob("specs/**/*.yaml"), *ROOT.glob("neurovis_spec/library/*.yaml")])
TEXTS = st.text(st.sampled_from("aé𝜎😀\n\r \ufeff{:,-}[#'\""), max_size=40)


@given(TEXTS, st.sampled_from(["utf-8", "utf-16", "utf-32"]))
def test_places_survive_the_way_to_the_protocol_and_back(source: str, encoding: str) -> None:
    text = Text(source, encoding)
    for line in range(1, len(text.lines.starts) + 1):
        for column in range(1, len(text.line(line)) + 2):
            position = text.position(line, column)
            assert text.place(*position) == Place(line, column)
            width = {"utf-8": "utf-8", "utf-16": "utf-16-le", "utf-32": "utf-32-le"}[encoding]
            before = ("\ufeff" if text.bom and line == 1 else "") + text.line(line)[: column - 1]
            size = {"utf-8": 1, "utf-16": 2, "utf-32": 4}[encoding]
            assert position == (line - 1, len(before.encode(width)) // size)


def test_astral_characters_take_two_units() -> None:
    text = Text("title: 𝜎😀x\nname: y")
    assert text.position(1, 8) == (0, 7)
    assert text.position(1, 9) == (0, 9)
    assert text.position(1, 10) == (0, 11)
    assert text.place(0, 10) == Place(1, 9)  # within a character: its beginning
    assert text.place(0, 99) == Place(1, 11)  # beyond a line: its end
    assert text.place(99, 0) == Place(2, 8)


def test_a_byte_order_mark_counts_for_the_editor_alone() -> None:
    text = Text("\ufeffname: x\ny")
    assert (text.position(1, 1), text.place(0, 1), text.place(0, 0)) == ((0, 1), Place(1, 1), Place(1, 1))
    assert text.position(2, 1) == (1, 0)


def test_a_span_holds_its_end() -> None:
    span = Span("x", 2, 3, 2, 5)
    assert [holds(span, Place(2, column)) for column in range(2, 7)] == [False, True, True, True, False]
    assert not holds(span, Place(1, 4))


@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.name)
def test_of_a_sound_text_there_is_all(path: Path) -> None:
    source = path.read_text(encoding="utf-8")
    document = read_text(source, "x", Findings())
    assert document is not None
    assert read_any(source, "x") == document.root


@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.name)
def test_what_stands_at_a_place_is_the_item_that_begins_there(path: Path) -> None:
    document = read_text(path.read_text(encoding="utf-8"), "x", Findings())
    assert document is not None
    for item in outline(document.root):
        found = item_at(document.root, Place(item.span.line, item.span.column))
        assert found is not None
        assert (found.path, found.is_key, found.span) == (item.path, item.is_key, item.span)


def test_long_lists_of_edges_are_packed_and_still_found() -> None:
    rows = "".join(f"    - [K{i % 9 + 1}, K{i % 7 + 1}, 0.5]\n" for i in range(400))
    text = f"neurons: {{K: {{count: 9}}}}\nconnections:\n  K -> K:\n    edges:\n{rows}outputs: {{a: K1}}\n"
    document = read_text(text, "x", Findings())
    assert document is not None
    items = list(outline(document.root))
    assert len([item for item in items if "edges" in item.path and not item.is_key]) == 800
    for item in items[::37]:
        assert item_at(document.root, Place(item.span.line, item.span.column)) in (item, None) or item.is_key
    assert [item.path for item in outline(document.root, edges=False)][-2:] == [("outputs", "a"), ("outputs", "a")]
    edited, place = marked(text.replace("outputs: {a: K1", "outputs: {a: K1¦"))
    result = apply(edited, rename(edited, place, "L")).source
    assert result == text.replace("K", "L")


@given(TEXTS, st.integers(1, 6), st.integers(1, 12))
def test_no_text_is_too_broken_to_look_at(source: str, line: int, column: int) -> None:
    text = Text(source)
    root = read_any(text.text, "x")
    for item in () if root is None else outline(root):
        assert text.part(item.span) or item.scalar.value is None
    where(text, Place(min(line, len(text.lines.starts)), column))
