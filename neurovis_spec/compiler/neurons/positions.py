"""Positions of neurons as data: ``[x, y]``, a list of these, or a file.

In: the node of a group's ``position``. Out: (n, 2) numbers, NaN where there is none. A number may be an expression over
the parameters, ``i`` and ``n``; with expressions one ``[x, y]`` does for a whole group: ``[cos(2*pi*i/n),
sin(2*pi*i/n)]``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.values.constants import Constants, Value
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.located import Formula, formula_of
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.sections import GroupModel
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import FileReference
from neurovis_spec.language.yaml.source import Node, Packed, Scalar, Sequence

_POSITION = formula_at(GroupModel, "position", 0)


def _point(node: Node, index: int, n: int, constants: Constants) -> tuple[float, float] | Unknown:
    if not isinstance(node, Sequence) or len(node.items) != 2:
        constants.findings.error("wrong-type", node.span, "a position is two numbers [x, y]")
        return UNKNOWN
    values = []
    for axis, item in enumerate(node.items):
        formula = formula_of(item, constants.findings)
        extra: dict[str, Value | Unknown] = {"i": float(index), "n": float(n)}
        place = np.array([2 * index + axis], dtype=np.int64)
        value = UNKNOWN if formula is None else constants.value(formula, extra, places=place)
        if value is not UNKNOWN:
            values.append(float(value))
    return (values[0], values[1]) if len(values) == 2 else UNKNOWN


def _is_formula(items: Iterable[Node]) -> bool:
    """Whether this is one ``[x, y]`` that differs from neuron to neuron, or can."""
    numbers = tuple(items)
    return (
        len(numbers) == 2
        and all(isinstance(item, Scalar) for item in numbers)
        and any(isinstance(item, Scalar) and isinstance(item.value, str) for item in numbers)
    )


def _one_for_all(items: Iterable[Node], n: int, constants: Constants) -> FloatArray | Unknown:
    result, good = np.empty((n, 2)), True
    for axis, item in enumerate(items):
        formula = formula_of(item, constants.findings)
        extra: dict[str, Value | Unknown] = {"i": np.arange(n, dtype=np.float64), "n": float(n)}
        value = UNKNOWN if formula is None else constants.value(formula, extra, places=2 * np.arange(n) + axis)
        if value is UNKNOWN:
            good = False
        else:
            result[:, axis] = value
    return result if good else UNKNOWN


def positions_of(
    node: FileReference | Sequence | Packed | None, n: int | Unknown, constants: Constants, files: Files
) -> FloatArray | Unknown:
    """One position for each of n neurons."""
    if isinstance(node, FileReference):
        return _from_file(node, n, constants, files)
    if n is UNKNOWN:
        for formula in _formulas(node, constants.findings):
            constants.value(formula, dict.fromkeys(_POSITION.sees, UNKNOWN))
        return UNKNOWN
    if node is None:
        return np.full((n, 2), np.nan)
    items = node.items
    if n == 1 and items and not isinstance(items[0], (Sequence, Packed)):
        items = (Sequence(items, node.span),)
    elif _is_formula(items):
        return _one_for_all(items, n, constants)
    if len(items) != n:
        message = f"{plural(len(items), 'position')} for {plural(n, 'neuron')}"
        constants.findings.error("wrong-size", node.span, message)
        return UNKNOWN
    points = [_point(item, index, n, constants) for index, item in enumerate(items)]
    known = [point for point in points if point is not UNKNOWN]
    return np.array(known, dtype=np.float64) if len(known) == n else UNKNOWN


def depend_on_positions(node: FileReference | Sequence | Packed | None, constants: Constants) -> None:
    """Report that something of the structure depends on the parameters by which these positions are written."""
    quiet = replace(constants, findings=Findings())
    for formula in () if isinstance(node, FileReference) else _formulas(node, quiet.findings):
        tree = quiet.tree(formula, _POSITION.sees)
        constants.depend(() if tree is UNKNOWN else names(tree))


def _formulas(node: Sequence | Packed | None, findings: Findings) -> Iterator[Formula]:
    """The numbers of all positions, however many there should be."""
    for item in () if node is None else node.items:
        for number in item.items if isinstance(item, (Sequence, Packed)) else (item,):
            formula = formula_of(number, findings)
            if formula is not None:
                yield formula


def _from_file(reference: FileReference, n: int | Unknown, constants: Constants, files: Files) -> FloatArray | Unknown:
    table = files.table(reference, None if n is UNKNOWN else (n, 2), gaps=False)
    if table is None or n is UNKNOWN:
        return UNKNOWN
    rows, columns = table.values.shape
    if (rows, columns) != (n, 2):
        wanted = f"positions of {plural(n, 'neuron')} are {plural(n, 'row')} of 2 numbers"
        constants.findings.error("wrong-size", reference.path.span, f"{wanted}; the file has {rows} × {columns}")
        return UNKNOWN
    gap = next(table.gaps(), None)
    if gap is not None:
        message = f"row {gap[0]}, column {gap[1]} of the file is empty; a position is two numbers"
        constants.findings.error("file-format", reference.path.span, message)
        return UNKNOWN
    return np.array(table.values, dtype=np.float64)
