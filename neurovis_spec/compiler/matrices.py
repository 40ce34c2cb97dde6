"""Matrices: dense rows, from the spec or from a file, to numbers and a mask.

In: rows as written (numbers, expressions, null) or a file. Out: a Grid: values, and which cells are present.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.constants import Constants, Randomness
from neurovis_spec.compiler.draws import Stream
from neurovis_spec.compiler.network import FloatArray
from neurovis_spec.compiler.tables import Files
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.located import formula_of
from neurovis_spec.language.source import NULL, NUMBER, Node, Packed, Scalar, Sequence
from neurovis_spec.language.values import FileReference, Matrix, Rows


@dataclass(frozen=True)
class Grid:
    """A matrix: (rows, columns) values, NaN where a cell is null, and the mask of the cells that are present."""

    values: FloatArray
    present: npt.NDArray[np.bool_]
    span: Span

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return (self.values.shape[0], self.values.shape[1])

    def transposed(self) -> Grid:
        """Rows become columns."""
        return Grid(self.values.T, self.present.T, self.span)


def grid_of(matrix: Matrix, constants: Constants, files: Files, stream: Stream) -> Grid | None:
    """The numbers of a matrix; None where it is at fault. ``i`` and ``j`` are known in its cells."""
    if isinstance(matrix, FileReference):
        if matrix.key is not None:
            constants.findings.error(
                "unsupported", matrix.key.span, "archives of arrays are not read by this version yet"
            )
            return None
        table = files.table(matrix.path)
        return None if table is None else Grid(table.values, table.present, matrix.path.span)
    return _packed(matrix.node) or _written(matrix, constants, stream)


def _packed(node: Sequence | Packed) -> Grid | None:
    """The fast path: long lists of equal rows that hold numbers and nulls alone."""
    if not isinstance(node, Packed) or node.rows is None:
        return None
    kinds = np.frombuffer(node.kinds, dtype=np.int8)
    ends = np.frombuffer(node.rows, dtype=np.dtype(node.rows.typecode))
    widths = np.diff(ends)
    values = np.array(node.numbers, dtype=np.float64)
    regular = len(widths) > 0 and bool((widths == widths[0]).all()) and widths[0] > 0
    if not regular or not np.isin(kinds, (NULL, NUMBER)).all():
        return None
    present = kinds == NUMBER
    if not np.isfinite(values[present]).all():
        return None
    shape = (len(widths), int(widths[0]))
    return Grid(values.reshape(shape), present.reshape(shape), node.span)


def _written(matrix: Rows, constants: Constants, stream: Stream) -> Grid | None:
    findings = constants.findings
    rows = matrix.node.items
    if not rows:
        findings.error("wrong-size", matrix.span, "a matrix needs at least one row")
        return None
    cells: list[list[float | None]] = []
    failed = False
    for i, row in enumerate(rows):
        if not isinstance(row, (Sequence, Packed)):
            findings.error("wrong-type", row.span, "a row of a matrix is a list")
            return None
        values, clean = _row(row, i, constants, stream)
        failed = failed or not clean
        if cells and len(values) != len(cells[0]):
            message = f"this row has {len(values)} cells, the first has {len(cells[0])}"
            findings.error("ragged-matrix", row.span, message)
            failed = True
        cells.append(values)
    if failed:
        return None
    if not cells[0]:
        findings.error("wrong-size", matrix.span, "the rows of a matrix need at least one cell")
        return None
    present = np.array([[cell is not None for cell in row] for row in cells])
    numbers = np.array([[np.nan if cell is None else cell for cell in row] for row in cells], dtype=np.float64)
    return Grid(numbers, present, matrix.span)


def _row(row: Sequence | Packed, i: int, constants: Constants, stream: Stream) -> tuple[list[float | None], bool]:
    values: list[float | None] = []
    clean = True
    for j, cell in enumerate(row.items):
        if isinstance(cell, Scalar) and cell.value is None:
            values.append(None)
            continue
        number = _cell(cell, i, j, constants, stream)
        clean = clean and number is not None
        values.append(number)
    return values, clean


def _cell(cell: Node, i: int, j: int, constants: Constants, stream: Stream) -> float | None:
    formula = formula_of(cell, constants.findings)
    if formula is None:
        return None
    value = constants.value(formula, {"i": float(i), "j": float(j)}, Randomness(stream, i, j))
    return None if value is None else float(value)


def fit(grid: Grid, n: int, m: int, by_target: bool, findings: Findings) -> Grid | None:
    """The grid with sources as rows, of n × m; a shape that fits only when transposed is an error that says so."""
    oriented = grid.transposed() if by_target else grid
    if oriented.shape == (n, m):
        return oriented
    rows, columns = grid.shape
    wanted = (m, n) if by_target else (n, m)
    message = f"the matrix is {rows} × {columns}, {wanted[0]} × {wanted[1]} is wanted"
    if (columns, rows) == wanted:
        sides = "rows are targets" if by_target else "rows are sources"
        other = "remove 'rows: to'" if by_target else "add 'rows: to' if its rows are targets"
        findings.error("transposed", grid.span, f"{message}: it fits transposed; {sides}", f"transpose it, or {other}")
    else:
        findings.error("wrong-size", grid.span, message)
    return None
