"""Matrices: dense rows, from the spec or from a file, to numbers and a mask.

In: rows as written (numbers, expressions, null) or a file. Out: a Grid: values, and which cells are present.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.limits import PATIENCE, plural
from neurovis_spec.compiler.values.cells import cells_of, seen_by_pairs, values_of
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.expressions.functions import DRAWS
from neurovis_spec.language.tables import FileReference
from neurovis_spec.language.unknown import UNKNOWN, Unknown, known
from neurovis_spec.language.values import MatrixRows, Written
from neurovis_spec.language.yaml.source import NULL


class Grid(NamedTuple):
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


def draws_any(matrix: Written) -> bool:
    """Whether a formula in any cell draws."""
    cells = UNKNOWN if isinstance(matrix, FileReference) else cells_of(matrix.node, Findings(), "")
    return cells is not UNKNOWN and any(f"{name}(" in text.replace(" ", "") for name in DRAWS for text in cells.texts)


def grid_of(
    matrix: Written,
    n: int | Unknown,
    m: int | Unknown,
    by_target: bool,
    constants: Constants,
    files: Files,
    stream: Stream,
) -> Grid | Unknown:
    """The numbers of a matrix from n sources to m targets; UNKNOWN where it is invalid. An end of which nothing is
    known is taken to be as large as the matrix has it, so that all else can be checked.

    In its cells ``i`` is the source and ``j`` the target, also where ``by_target`` its rows are targets.
    """
    if isinstance(matrix, FileReference):
        table = files.table(matrix, None if n is UNKNOWN or m is UNKNOWN else (n, m))
        if table is UNKNOWN:
            return UNKNOWN
        return fit(Grid(table.values, table.present, matrix.path.span), n, m, by_target, constants.findings)
    return _grid_of_rows(matrix, n, m, by_target, constants, stream)


def _grid_of_rows(
    matrix: MatrixRows, n: int | Unknown, m: int | Unknown, by_target: bool, constants: Constants, stream: Stream
) -> Grid | Unknown:
    """The grid of rows in the spec. What can be checked is checked, also where an end or a row is invalid."""
    findings = constants.findings
    cells = cells_of(matrix.node, findings, "a row of a matrix is a list")
    if cells is UNKNOWN:
        return UNKNOWN
    widths = cells.widths
    if cells.failed:
        uneven = widths[:0]  # a row may be none
    elif not len(widths) or not widths[0]:
        span = cells.row_span(0) if len(widths) else matrix.span
        findings.error("wrong-size", span, "a matrix needs at least one row, and a row at least one cell")
        return UNKNOWN
    else:
        uneven = np.flatnonzero(widths != widths[0])
    for row in uneven[:PATIENCE].tolist():
        message = f"this row has {plural(int(widths[row]), 'cell')}, the first has {widths[0]}"
        findings.error("ragged-matrix", cells.row_span(row), message)
    rows, columns = cells.rows(), cells.columns()
    i, j = (UNKNOWN, UNKNOWN) if cells.failed else (columns, rows) if by_target else (rows, columns)
    shape = (len(widths), int(widths.max(initial=0)))
    own = shape[::-1] if by_target else shape
    sizes = (UNKNOWN, UNKNOWN) if cells.failed else (float(known(n, own[0])), float(known(m, own[1])))
    values = values_of(cells, np.arange(len(rows)), constants, *seen_by_pairs(i, j, sizes, stream))
    if values is UNKNOWN or len(uneven) or cells.failed:
        return UNKNOWN
    grid = Grid(values.reshape(shape), (cells.kinds != NULL).reshape(shape), matrix.span)
    return fit(grid, n, m, by_target, findings)


def fit(grid: Grid, n: int | Unknown, m: int | Unknown, by_target: bool, findings: Findings) -> Grid | Unknown:
    """The grid with sources as rows, of n × m; a shape that fits only when transposed is an error that says so. A size
    that is UNKNOWN fits."""
    oriented = grid.transposed() if by_target else grid
    n, m = (known(size, own) for own, size in zip(oriented.shape, (n, m), strict=True))
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
    return UNKNOWN
