"""A column of an edge file as the labels of connections and as the styles of their lines."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from neurovis_renderers import coverage
from small_specs import answer, compiled, network_of

import neurovis_spec as nv
from neurovis_spec.arrays import Texts, texts_of
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.language.words import LINE_STYLES
from neurovis_spec.scene.line_styles import DASHES, styles_of

WORM = "Source,Target,Type,N,Tag\nA,B,chemical,3,fast\nB,C,chemical,-5,\nA,C,electrical,2,gap\nC,D,peptide,4,x\n"
GROUP = "neurons: {C: {names: [A, B, C, D], bias: 0.1, activation: tanh}}\n"
EDGES = "edges: {file: worm.csv, columns: {from: Source, to: Target, weight: N}}"
STYLED = f"{GROUP}connections:\n  C -> C: {{{EDGES}, label: {{column: Tag}}}}\n"
STYLE = "render: {lines: {style: {column: Type}}}\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "worm.csv").write_text(WORM)
    return tmp_path


def drawn(network: CompiledNetwork, folder: Path) -> str:
    network.render(folder / "x.svg", step=1)
    return (folder / "x.svg").read_text()


def dashed(svg: str) -> dict[str, str]:
    """The dashes of each line, by its ends."""
    lines = re.findall(r'<g data-connection="([^"]*)"(.*?)</g>', svg, re.S)
    found = ((name, re.search(r'stroke-dasharray="([^"]*)"', line)) for name, line in lines)
    return {name: dash[1] if dash else "" for name, dash in found}


def test_lines_have_the_styles_of_a_column(folder: Path) -> None:
    plain, network = compiled(STYLED, folder), compiled(STYLED + STYLE, folder)
    assert network.hash == plain.hash == compiled(STYLED.replace(", label: {column: Tag}", ""), folder).hash
    svg = drawn(network, folder)
    found = dashed(svg)
    assert [found[name] for name in ("A -&gt; B", "B -&gt; C", "A -&gt; C", "C -&gt; D")] == ["", "", "8 4", "3.5 2.5"]
    assert "linecap" not in svg
    for words in ("line: Type", "chemical", "electrical", "peptide", "Type peptide", 'data-style="peptide"', ">gap<"):
        assert words in svg
    assert "A → C: gap\n" in svg
    # the text of the spec brings what it draws
    again = nv.compile_text(network.text())
    assert again.hash == network.hash
    assert drawn(again, folder) == svg
    assert "dasharray" not in drawn(plain, folder)


def test_what_has_no_value_is_solid_and_the_values_are_not(folder: Path) -> None:
    more = STYLED.replace("connections:\n", "connections:\n  D -> A: 1\n")
    network = compiled(more + STYLE, folder)
    styles = styles_of(network.network)
    assert styles is not None
    assert styles.called == (
        ("others", "solid"),
        ("chemical", "dashed"),
        ("electrical", "finely dashed"),
        ("peptide", "dash-dotted"),
    )
    assert styles.numbers.tolist() == [0, 1, 1, 2, 3]
    assert ">others<" in drawn(network, folder)
    (folder / "worm.csv").write_text(WORM.replace("peptide", ""))
    styles = styles_of(network_of(STYLED + STYLE, folder))
    assert styles is not None
    assert styles.numbers.tolist() == [1, 1, 2, 0]


def test_a_line_that_stands_for_several_has_their_style_where_they_have_one(folder: Path) -> None:
    (folder / "worm.csv").write_text("Source,Target,Type\nA1,B1,x\nA1,B2,x\nA2,B1,y\nA3,B1,x\nA3,B2,y\n")
    edges = EDGES.replace(", weight: N", "")
    text = f"neurons: {{A: {{count: 3}}, B: {{count: 2}}}}\nconnections: {{A -> B: {{{edges}}}}}\n"
    svg = drawn(compiled(text + "render: {lines: {style: {column: Type}}, collapse: B}\n", folder), folder)
    assert dashed(svg) == {"A1 -&gt; B": "8 4", "A2 -&gt; B": "3.5 2.5", "A3 -&gt; B": ""}
    assert ">others<" in svg


@pytest.mark.parametrize("kind", ["quoted", "npz"])
def test_texts_of_edges_however_the_rows_are_read(folder: Path, kind: str) -> None:
    network = network_of(STYLED + STYLE, folder)
    rows = [row.split(",") for row in WORM.splitlines()]
    if kind == "quoted":
        (folder / "worm.csv").write_text("".join(",".join(f'"{cell}"' for cell in row) + "\n" for row in rows))
        other = network_of(STYLED + STYLE, folder)
    else:
        columns = dict(zip(rows[0], zip(*rows[1:], strict=True), strict=True))
        arrays = {name: np.array(cells, float if name == "N" else None) for name, cells in columns.items()}
        np.savez(folder / "worm.npz", allow_pickle=False, **arrays)
        other = network_of((STYLED + STYLE).replace("worm.csv", "worm.npz"), folder)
    for one in (network, other):
        assert one.connections.own_labels is not None
        assert [one.connections.own_labels.of(edge) for edge in range(4)] == ["fast", "", "gap", "x"]
        assert one.connections.styles is not None
        assert [one.connections.styles.of(edge)[0] for edge in range(4)] == list("ccep")
    assert network.hash == other.hash


def test_rows_that_do_not_count_have_no_style_and_twins_have_one(folder: Path) -> None:
    some = STYLED.replace("weight: N}", "weight: N}, where: {Type: [peptide, electrical]}").replace(
        "Tag}", "Tag}, symmetric: true"
    )
    network = network_of(some + STYLE, folder)
    styles = styles_of(network)
    assert styles is not None
    assert styles.called == (("electrical", "solid"), ("peptide", "dashed"))
    assert styles.numbers.tolist() == [0, 0, 1, 1]
    assert network.connections.own_labels is not None
    assert [network.connections.own_labels.of(edge) for edge in range(4)] == ["gap", "gap", "x", "x"]


@pytest.mark.parametrize(
    ("old", "new", "code", "message"),
    [
        ("Tag}", "Tga}", "file-format", "no column 'Tga'; its columns are 'Source'"),
        ("Tag}", "1}", "wrong-type", "expected a text"),
        ("label: {column: Tag}", "label: {}", "wrong-type", "expected a column"),
        ("{column: Type}", "Type", "wrong-type", "expected a column of the file"),
        ("column: Type", "column: Tpye", "file-format", "no column 'Tpye'"),
        ("file: worm.csv", 'csv: "a,b\\n1,2\\n"', "file-format", "no column 'Source'"),
    ],
)
def test_columns_that_are_no_labels_and_no_styles(folder: Path, old: str, new: str, code: str, message: str) -> None:
    text = STYLED + STYLE
    assert old in text
    found = answer(text.replace(old, new), folder)
    assert found[0] == code
    assert message in found[1]


def test_labels_that_cannot_be_shown(folder: Path) -> None:
    (folder / "worm.csv").write_text(WORM.replace("gap", "g\x7fp"))
    assert "row 4, column 5: a text has a character here that cannot be shown" in answer(STYLED, folder)[1]
    (folder / "worm.csv").write_text(WORM.replace("gap", "g" * 1001))
    assert answer(STYLED, folder)[0] == "label-too-long"


def test_edges_and_their_texts_in_the_spec_itself() -> None:
    edges = STYLED.replace("file: worm.csv", f"csv: {json.dumps(WORM)}")
    network = compiled(edges + STYLE)
    assert network.network.connections.styles is not None
    assert nv.compile_text(network.text()).hash == network.hash


def test_labels_and_styles_are_exported(folder: Path) -> None:
    compiled(STYLED + STYLE, folder).export(folder / "tables", to="csv")
    header, *rows = (folder / "tables" / "edges.csv").read_text().splitlines()
    assert header == "Source,Target,N,delay,label,Type,entry"
    assert rows[2] == "A,C,2.0,1,gap,electrical,C -> C"


def test_every_style_can_be_told_from_every_other() -> None:
    assert [*DASHES] == [*LINE_STYLES]
    assert len({*DASHES.values()}) == len(DASHES)
    # none is dots alone, as the lines of rules are
    assert min(max(dash) for dash in DASHES.values() if dash) >= 3


PARTS = st.lists(st.tuples(st.lists(st.sampled_from("abc"), max_size=4), st.booleans()), max_size=4)


@given(PARTS)
def test_texts_of_parts_are_those_of_each(parts: list[tuple[list[str], bool]]) -> None:
    def made(cells: list[str]) -> Texts:
        known = tuple(dict.fromkeys(cells))
        return Texts(known, np.array([known.index(cell) for cell in cells], dtype=np.int64))

    found = texts_of((made(cells) if given_ else None, len(cells)) for cells, given_ in parts)
    wanted = [cell if given_ else "" for cells, given_ in parts for cell in cells]
    if any(given_ for _, given_ in parts):
        assert found is not None
        assert [found.of(place) for place in range(len(wanted))] == wanted
    else:
        assert found is None


@given(st.sampled_from([dash for dash in DASHES.values() if dash]), st.floats(0.3, 3), st.floats(1, 300))
def test_dashes_cover_what_they_say(dash: tuple[float, ...], scale: float, length: float) -> None:
    control = np.array([(0.0, 0.0), (length / 3, 0.0), (2 * length / 3, 0.0), (length, 0.0)] * 2)
    pieces = coverage.flatten(control, np.array([0, 4, 8]))
    found = coverage.cut(pieces, {1: dash}, scale)
    solid, cut = found.only(found.owners == 0), found.only(found.owners == 1)
    assert float((solid.ends - solid.starts)[:, 0].sum()) == pytest.approx(length)
    at = np.concatenate([[0.0], np.cumsum(np.resize(scale * np.array(dash), 2 + int(2 * length / scale)))])
    wanted = sum(max(0.0, min(end, length) - begin) for begin, end in zip(at[::2], at[1::2], strict=False))
    assert float((cut.ends - cut.starts)[:, 0].sum()) == pytest.approx(wanted, abs=0.01)
    assert cut.first.sum() == cut.last.sum()
