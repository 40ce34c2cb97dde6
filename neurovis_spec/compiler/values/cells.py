"""Cells: lists of rows as arrays, however they were read.

In: rows as written, from the reader's packed arrays or as nodes. Out: Cells, structure of arrays; and their values,
each distinct formula parsed and evaluated once, for all places where it stands. So a matrix of a million cells ``w``
costs hardly more than one of numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, Indices, IntArray
from neurovis_spec.compiler.limits import PATIENCE
from neurovis_spec.compiler.values.constants import Constants, Randomness, Value, check_finite
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.located import Located, formula_of
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.source import NULL, NUMBER, TEXT, AnyList, Node, Packed, Scalar


@dataclass(frozen=True)
class Cells:
    """Row ``r`` holds the cells ``starts[r]`` to ``starts[r + 1]``. A cell is NULL, a NUMBER or a TEXT (then its number
    is an index into ``texts``); ``node`` and ``row_span`` say where things stand. ``failed``: some were no cells, which
    is reported; they are left as NULL, so that the others can be checked."""

    starts: IntArray
    kinds: npt.NDArray[np.int8]
    numbers: FloatArray
    texts: tuple[str, ...]
    node: Callable[[int], Node]
    row_span: Callable[[int], Span]
    failed: bool = False

    @property
    def widths(self) -> IntArray:
        """How many cells each row has."""
        return np.diff(self.starts)

    def rows(self) -> IntArray:
        """The row of each cell."""
        return np.repeat(np.arange(len(self.starts) - 1), self.widths)

    def columns(self) -> IntArray:
        """The column of each cell."""
        return np.arange(len(self.kinds)) - np.repeat(self.starts[:-1], self.widths)


def cells_of(node: AnyList, findings: Findings, row: str, *, named: bool = False, gaps: bool = True) -> Cells | Unknown:
    """The cells of a list of rows; findings where one is no number, text or null, or a row is no list. UNKNOWN where
    there are many such.

    ``row`` is what a row is, for a finding; with "" a bare cell is a row of one. ``named``: some cells are names, so
    that the caller has to say what an empty text is. ``gaps``: a cell may be null.
    """
    if isinstance(node, Packed) and (node.rows is not None or not row):
        cells: Cells | Unknown = _from_packed(node)
    else:
        cells = _from_nodes(node, findings, row, named)
    if cells is UNKNOWN:
        return UNKNOWN
    wild = np.flatnonzero(
        ((cells.kinds == NUMBER) & ~np.isfinite(cells.numbers)) | ((cells.kinds == NULL) & (not gaps))
    )
    for cell in wild[:PATIENCE].tolist():
        formula_of(cells.node(cell), findings)  # perhaps once more: a finding counts once
    return replace(cells, failed=True) if len(wild) else cells


def _from_packed(node: Packed) -> Cells:
    """The cells of the reader's packed arrays."""
    starts = np.arange(len(node.kinds) + 1) if node.rows is None else np.array(node.rows, dtype=np.int64)
    kinds = np.array(node.kinds, dtype=np.int8)
    numbers = np.array(node.numbers, dtype=np.float64)
    return Cells(starts, kinds, numbers, node.texts, node.cell, lambda r: _row_span(node, r))


def _row_span(node: Packed, row: int) -> Span:
    return node.cell(row).span if node.rows is None else node.row(row).span


def _from_nodes(node: AnyList, findings: Findings, row: str, named: bool) -> Cells | Unknown:
    """The cells of a list of nodes. ``row`` and ``named`` are as for ``cells_of``."""
    before = findings.errors
    nodes: list[Node] = []
    starts = [0]
    items = node.items
    for item in items:
        if isinstance(item, AnyList):
            nodes += item.items
        elif row:
            findings.error("wrong-type", item.span, row)
        else:
            nodes.append(item)
        starts.append(len(nodes))
        if findings.errors - before >= PATIENCE:
            return UNKNOWN
    texts: dict[str, int] = {}
    kinds = np.zeros(len(nodes), dtype=np.int8)
    numbers = np.full(len(nodes), np.nan)
    for place, cell in enumerate(nodes):
        if isinstance(cell, Scalar) and cell.value is None:
            continue
        if not isinstance(cell, Scalar) or isinstance(cell.value, bool) or (cell.value == "" and not named):
            formula_of(cell, findings)
            if findings.errors - before >= PATIENCE:
                return UNKNOWN
        elif isinstance(cell.value, str):
            kinds[place], numbers[place] = TEXT, texts.setdefault(cell.value, len(texts))
        elif cell.value is not None:
            kinds[place], numbers[place] = NUMBER, cell.value
    return Cells(
        np.array(starts, dtype=np.int64),
        kinds,
        numbers,
        tuple(texts),
        nodes.__getitem__,
        lambda r: items[r].span,
        findings.errors > before,
    )


def seen_by_pairs(
    i: Indices | Unknown, j: Indices | Unknown, sizes: tuple[float | Unknown, float | Unknown], stream: Stream
) -> tuple[dict[str, Value | Unknown], Randomness | Unknown]:
    """What the formula of a connection sees, and what it draws from: its source ``i``, its target ``j``, the sizes of
    both ends."""
    seen: dict[str, Value | Unknown] = {"n_from": sizes[0], "n_to": sizes[1]}
    if i is UNKNOWN or j is UNKNOWN:
        return {**seen, "i": UNKNOWN, "j": UNKNOWN}, UNKNOWN
    return {**seen, "i": i.astype(np.float64), "j": j.astype(np.float64)}, Randomness(stream, i, j)


def values_of(
    cells: Cells,
    which: IntArray,
    constants: Constants,
    seen: Mapping[str, Value | Unknown] | None = None,
    randomness: Randomness | Unknown | None = None,
) -> FloatArray | Unknown:
    """The values of the cells ``which``; NaN where null. ``seen`` is what their formulas see beside the parameters, and
    ``randomness`` what they draw from, each the same for all or as long as ``which``."""
    result = cells.numbers[which]
    kinds = cells.kinds[which]
    result[kinds == NULL] = np.nan
    written = np.flatnonzero(kinds == TEXT)
    if not len(written):
        return result
    numbers = result[written].astype(np.int64)
    order = np.argsort(numbers, kind="stable")
    groups = np.split(written[order], np.flatnonzero(np.diff(numbers[order])) + 1)
    before = constants.findings.errors
    failed = False
    for places in sorted(groups, key=lambda places: int(places[0])):
        around = {name: _at(value, places) for name, value in (seen or {}).items()}
        drawn = randomness
        if isinstance(drawn, Randomness):
            drawn = drawn._replace(i=np.asarray(drawn.i)[places], j=np.asarray(drawn.j)[places])
        values = _evaluated(cells, which[places], constants, around, drawn, places)
        failed = failed or values is UNKNOWN
        if values is not UNKNOWN:
            result[places] = values
        elif constants.findings.errors - before >= PATIENCE:
            return UNKNOWN
    return UNKNOWN if failed else result


def _at(value: Value | Unknown, places: IntArray) -> Value | Unknown:
    return value[places] if isinstance(value, np.ndarray) else value


def _evaluated(
    cells: Cells,
    which: IntArray,
    constants: Constants,
    seen: Mapping[str, Value | Unknown],
    randomness: Randomness | Unknown | None,
    places: IntArray,
) -> Value | Unknown:
    """The values of one formula in all its cells; a finding stands at the first cell whose value is not finite."""
    formula = formula_of(cells.node(int(which[0])), constants.findings)
    if formula is UNKNOWN:
        return UNKNOWN
    values = constants.unchecked(formula, seen, randomness, places=places)
    if values is UNKNOWN or np.isfinite(values).all():
        return values
    everywhere = np.broadcast_to(values, which.shape)
    wild = int(np.flatnonzero(~np.isfinite(everywhere))[0])
    node = cells.node(int(which[wild]))
    assert isinstance(node, Scalar)
    check_finite(float(everywhere[wild]), Located(formula.value, node), constants.findings)
    return UNKNOWN
