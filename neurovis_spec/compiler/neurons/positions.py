"""Positions of neurons as data: ``[x, y]`` or ``[x, y, z]``, a list of these, or a file.

In: the node of a group's ``position``. Out: (n, 2) or (n, 3) numbers, NaN where there is none. A number may be an
expression over the parameters, ``i`` and ``n``, and may be drawn; with expressions one ``[x, y]`` does for a whole
group: ``[cos(2*pi*i/n), sin(2*pi*i/n)]``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.limits import PATIENCE, plural
from neurovis_spec.compiler.values.cells import cells_of, values_of
from neurovis_spec.compiler.values.constants import Constants, Randomness
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.compiler.values.table_values import TableReader
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.expressions.evaluate import Value
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.located import formula_of
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.sections import GroupModel
from neurovis_spec.language.tables import FileReference, TableColumn
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.source import TEXT, AnyList, Scalar, Sequence

_POSITION = formula_at(GroupModel, "position", 0)
_NUMBERS = "a position is two or three numbers"
#: How many numbers a position may have.
_LEAST, _MOST = 2, 3


def positions_of(
    node: FileReference | TableColumn | AnyList,
    n: int | Unknown,
    constants: Constants,
    table: TableReader,
    stream: Stream,
) -> FloatArray | Unknown:
    """One position for each of n neurons; of the ``stream``, the counter of number j of neuron i is (i, j, 0, number of
    the draw)."""
    if isinstance(node, TableColumn):
        return table.positions(node)
    if isinstance(node, FileReference):
        return _from_file(node, n, constants.findings, table.files)
    return _from_rows(node, n, constants, stream)


def _from_file(reference: FileReference, n: int | Unknown, findings: Findings, files: Files) -> FloatArray | Unknown:
    """The positions in a file, a row of x and y, perhaps z, for each neuron."""
    table = files.table(reference, None if n is UNKNOWN else (n, _LEAST))
    if table is UNKNOWN or n is UNKNOWN:
        return UNKNOWN
    rows, columns = table.values.shape
    if rows == n and _LEAST <= columns <= _MOST:
        gap = next(table.gaps(), None)
        if gap is None:
            return np.array(table.values, dtype=np.float64)
        message = f"row {gap[0]}, column {gap[1]} of the file is empty; {_NUMBERS}"
        findings.error("file-format", reference.path.span, message)
        return UNKNOWN
    wanted = f"positions of {plural(n, 'neuron')} are {plural(n, 'row')} of 2 or 3 numbers"
    findings.error("wrong-size", reference.path.span, f"{wanted}; the file has {rows} × {columns}")
    return UNKNOWN


def _from_rows(node: AnyList, n: int | Unknown, constants: Constants, stream: Stream) -> FloatArray | Unknown:
    """The positions in the spec: a row ``[x, y]`` or ``[x, y, z]`` for each neuron, or one for all."""
    findings = constants.findings
    one = n is not UNKNOWN and _one_for_all(node, n)
    if n is not UNKNOWN and not one and len(node) != n:
        if len(node) <= _MOST and all(isinstance(item, Scalar) for item in node.items):
            message = f"{_NUMBERS}, and here are {plural(n, 'neuron')}"
            findings.error("wrong-size", node.span, message, "write a list of positions, [[x, y], [x, y], …]")
            return UNKNOWN
        findings.error("wrong-size", node.span, f"{plural(len(node), 'position')} for {plural(n, 'neuron')}")
        return UNKNOWN
    row = "" if n is UNKNOWN else f"{_NUMBERS}, [x, y] or [x, y, z]"
    cells = cells_of(Sequence((node,), node.span) if one else node, findings, row, gaps=False)
    if cells is UNKNOWN:
        return UNKNOWN
    axes = int(cells.widths[0]) if len(cells.widths) and _LEAST <= cells.widths[0] <= _MOST else _LEAST
    wrong = np.flatnonzero(cells.widths != axes)
    for place in wrong[:PATIENCE].tolist() if row else ():
        width = int(cells.widths[place])
        hint = "give all neurons of the group two numbers, or three" if _LEAST <= width <= _MOST else None
        findings.error("wrong-type", cells.row_span(place), row, hint)
    which = np.arange(len(cells.kinds))
    if n is UNKNOWN or len(wrong):
        values_of(cells, which, constants, dict.fromkeys(_POSITION.sees, UNKNOWN), UNKNOWN)
        return UNKNOWN
    which = np.tile(which, n) if one else which
    i, j = np.repeat(np.arange(n), axes), np.tile(np.arange(axes), n)
    seen: dict[str, Value | Unknown] = {"i": i.astype(np.float64), "n": float(n)}
    values = values_of(cells, which, constants, seen, Randomness(stream, i, j))
    return UNKNOWN if values is UNKNOWN or cells.failed else values.reshape(n, axes)


def _one_for_all(node: AnyList, n: int) -> bool:
    """Whether this is one position: that of the only neuron, or one that differs from neuron to neuron, or can."""
    items = node.items if len(node) <= _MOST else ()
    scalars = [item for item in items if isinstance(item, Scalar)]
    if n == 1:
        return len(node) > 0 and len(scalars) == len(items)
    return _LEAST <= len(scalars) == len(items) and any(isinstance(scalar.value, str) for scalar in scalars)


def depend_on_positions(node: FileReference | TableColumn | AnyList | None, constants: Constants) -> None:
    """Mark the parameters in these positions as structural: something that is fixed in a run depends on them."""
    quiet = replace(constants, findings=Findings())
    cells = (
        UNKNOWN
        if node is None or isinstance(node, (FileReference, TableColumn))
        else cells_of(node, quiet.findings, "")
    )
    for cell in () if cells is UNKNOWN else np.flatnonzero(cells.kinds == TEXT).tolist():
        assert cells is not UNKNOWN
        formula = formula_of(cells.node(cell), quiet.findings)
        tree = UNKNOWN if formula is UNKNOWN else quiet.tree(formula, _POSITION)
        constants.depend(() if tree is UNKNOWN else names(tree))
