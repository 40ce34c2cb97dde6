"""Inputs: signals from outside the network, from the ``inputs`` section.

In: the section and Constants. Out: Inputs in the order written, each with its place in the vector of all inputs.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.compiler.constants import CONSTANTS, Constants, parse_formula
from neurovis_spec.compiler.network import FloatArray, Input, frozen
from neurovis_spec.compiler.populate import key_span
from neurovis_spec.compiler.tables import Files
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.language.located import formula_of
from neurovis_spec.language.source import Packed, Sequence
from neurovis_spec.language.spec import InputModel, Spec

_SOURCES = ("expression", "file", "values", "size")


def make_inputs(spec: Spec, constants: Constants, files: Files) -> tuple[Input, ...] | None:
    """All inputs; None where one is at fault."""
    result: list[Input] = []
    failed = False
    start = 0
    for name, model in spec.inputs.items():
        made = _make(name, model, start, spec, constants, files)
        if made is None:
            failed = True
        else:
            result.append(made)
            start += made.size
    return None if failed else tuple(result)


def _make(name: str, model: InputModel, start: int, spec: Spec, constants: Constants, files: Files) -> Input | None:
    findings = constants.findings
    given = [key for key in _SOURCES if getattr(model, key) is not None]
    if len(given) > 1:
        entry = model.source.entry(given[1])
        span = model.source.span if entry is None else entry.key.span
        message = f"'{given[1]}' beside '{given[0]}': an input has one source"
        findings.error("conflicting-keys", span, message, "keep one of " + ", ".join(_SOURCES))
        return None
    if model.expression is not None:
        known = (*constants.parameters, *constants.broken, *CONSTANTS, "dt", "k", "t")
        tree: Tree | None = parse_formula(model.expression, known, findings)
        return None if tree is None else Input(name, start, 1, expression=tree)
    if model.file is not None:
        table = files.table(model.file)
        if table is None:
            return None
        if not table.present.all():
            row, column = np.argwhere(~table.present)[0]
            message = f"row {row + 1}, column {column + 1} of the file is empty; an input needs a number everywhere"
            findings.error("file-format", model.file.span, message)
            return None
        return _tabled(name, start, np.array(table.values, dtype=np.float64))
    if model.values is not None:
        values = _inline(model.values, constants)
        return None if values is None else _tabled(name, start, values)
    size = 1 if model.size is None else constants.integer(model.size, "'size'", 1)
    if size is not None and size > 1_000_000:
        span = key_span(spec, "inputs", name) if model.size is None else model.size.span
        findings.error("too-many", span, "an input has at most 1,000,000 components")
        return None
    return None if size is None else Input(name, start, size)


def _tabled(name: str, start: int, table: FloatArray) -> Input:
    frozen(table)
    return Input(name, start, table.shape[1], table=table)


def _inline(node: Sequence | Packed, constants: Constants) -> FloatArray | None:
    """Rows of numbers; a bare number is a row of one."""
    rows: list[list[float]] = []
    for item in node.items:
        cells = item.items if isinstance(item, (Sequence, Packed)) else (item,)
        formulas = [formula_of(cell, constants.findings) for cell in cells]
        values = [None if formula is None else constants.scalar(formula) for formula in formulas]
        if any(value is None for value in values):
            return None
        row = [value for value in values if value is not None]
        if not row or (rows and len(row) != len(rows[0])):
            wanted = f"{len(rows[0])} numbers, as in the first row" if rows else "at least one number"
            constants.findings.error("wrong-size", item.span, f"a row of {len(row)} numbers; expected {wanted}")
            return None
        rows.append(row)
    if not rows:
        constants.findings.error("wrong-size", node.span, "an input needs at least one row")
        return None
    return np.array(rows, dtype=np.float64)
