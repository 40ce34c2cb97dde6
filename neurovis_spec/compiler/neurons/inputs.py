"""Inputs: signals from outside the network, from the ``inputs`` section.

In: the section and Constants. Out: Inputs in the order written, each with its place in the vector of all inputs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import FloatArray, frozen
from neurovis_spec.compiler.events.settable import slots_named
from neurovis_spec.compiler.limits import PATIENCE, amount, plural
from neurovis_spec.compiler.names.references import Section, key_span
from neurovis_spec.compiler.network import Input
from neurovis_spec.compiler.values.cells import cells_of, values_of
from neurovis_spec.compiler.values.constants import ALWAYS, Constants, is_constant
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.sections import InputModel
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.source import AnyList

_SOURCES = ("expression", "file", "values", "size")


def make_input(
    name: str, model: InputModel, start: int, section: Section, constants: Constants, files: Files
) -> Input | Unknown:
    """One input of a section, from ``start`` on in the vector of all inputs."""
    sources = {"expression": model.expression, "file": model.file, "values": model.values, "size": model.size}
    given = [key for key in _SOURCES if sources[key] is not None]
    made = [
        None if model.expression is None else _by_expression(name, model, model.expression, start, constants),
        None if model.file is None else _by_file(name, model.file, start, files),
        None if model.values is None else _by_values(name, model.values, start, constants),
        None if given and model.size is None else _by_size(name, model, start, section, constants),
    ]
    if model.contradictory or not model.unknown.isdisjoint(_SOURCES):
        return UNKNOWN
    return next(one for one in made if one is not None)


def _by_expression(name: str, model: InputModel, formula: Formula, start: int, constants: Constants) -> Input | Unknown:
    tree = _expression(formula, constants)
    if tree is UNKNOWN:
        return UNKNOWN
    hold = model.hold is not None and model.hold.value
    return Input(name, start, 1, expression=tree, slots=slots_named(tree, constants.settable), hold=hold)


def _by_file(name: str, path: Located[str], start: int, files: Files) -> Input | Unknown:
    """An input whose rows are in a file."""
    table = files.table_at(path)
    return UNKNOWN if table is UNKNOWN else _table_input(name, start, np.array(table.values, dtype=np.float64))


def _by_values(name: str, node: AnyList, start: int, constants: Constants) -> Input | Unknown:
    """An input whose rows are in the spec; they may follow parameters."""
    with constants.following() as parts:
        values = _rows(node, constants)
    if values is UNKNOWN:
        return UNKNOWN
    return replace(_table_input(name, start, values), parts=tuple(part._replace(field="table") for part in parts))


def _by_size(name: str, model: InputModel, start: int, section: Section, constants: Constants) -> Input | Unknown:
    """An input that the caller gives, of a size; UNKNOWN where that is invalid."""
    size = 1 if model.size is None else constants.integer(model.size, "'size'", 1)
    if size is UNKNOWN:
        return UNKNOWN
    if size > 1_000_000:
        span = key_span(section, "inputs", name) if model.size is None else model.size.span
        constants.findings.error("too-many", span, "an input has at most 1,000,000 components")
        return UNKNOWN
    return Input(name, start, size)


def _expression(formula: Formula, constants: Constants) -> Tree | Unknown:
    tree = constants.tree(formula, formula_at(InputModel, "expression"))
    if tree is not UNKNOWN and is_constant(tree, (*ALWAYS, *constants.parameters)):
        constants.value(formula)
    return tree


def _table_input(name: str, start: int, table: FloatArray) -> Input:
    return Input(name, start, table.shape[1], table=frozen(table))


def _rows(node: AnyList, constants: Constants) -> FloatArray | Unknown:
    """Rows of numbers; a bare number is a row of one."""
    findings = constants.findings
    cells = cells_of(node, findings, "", gaps=False)
    if cells is UNKNOWN:
        return UNKNOWN
    widths = cells.widths
    if not len(widths):
        findings.error("wrong-size", node.span, "an input needs at least one row")
        return UNKNOWN
    uneven = np.flatnonzero((widths != widths[0]) if widths[0] else widths == 0)
    for row in () if cells.failed else uneven[:PATIENCE].tolist():
        wanted = f"{amount(int(widths[0]))}, as in the first row" if widths[0] else "at least one"
        message = f"a row of {plural(int(widths[row]), 'number')}; expected {wanted}"
        findings.error("wrong-size", cells.row_span(row), message)
    values = values_of(cells, np.arange(len(cells.kinds)), constants)
    if values is UNKNOWN or len(uneven) or cells.failed:
        return UNKNOWN
    return values.reshape(len(widths), int(widths[0]))
