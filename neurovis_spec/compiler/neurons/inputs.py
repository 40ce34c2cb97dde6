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
from neurovis_spec.compiler.neurons.spikes import by_spikes
from neurovis_spec.compiler.values.cells import cells_of, values_of
from neurovis_spec.compiler.values.constants import ALWAYS, Constants, Value, is_constant
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.compiler.values.poisson import LARGEST_MEAN, is_mean
from neurovis_spec.language.expressions.tree import Chain, Draw, Name, Number, Tree, names
from neurovis_spec.language.grammar import RUN, Role
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.sections import InputModel
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.source import AnyList

_SOURCES = ("expression", "file", "values", "spikes", "poisson", "size")
#: what an expression sees of the number that it is for
_INDEX = ("i", "n")
_RATE = formula_at(InputModel, "poisson")
#: the most numbers of an input
_MOST = 1_000_000


def make_input(
    name: str, model: InputModel, start: int, section: Section, constants: Constants, files: Files
) -> Input | Unknown:
    """One input of a section, from ``start`` on in the vector of all inputs."""
    bare = Input(name, start, 1)
    sized = UNKNOWN if "size" in model.unknown else _sized(bare, model, section, constants)
    made = [
        None if model.expression is None else _by_expression(sized, model, model.expression, constants),
        None if model.file is None else _by_file(name, model.file, start, files),
        None if model.values is None else _by_values(name, model.values, start, constants),
        None if model.spikes is None else by_spikes(bare, sized, model, model.spikes, constants, files),
        None if model.poisson is None else _by_rate(sized, model.poisson, constants),
    ]
    if model.contradictory or not model.unknown.isdisjoint(_SOURCES):
        return UNKNOWN
    return next((one for one in made if one is not None), sized)


def _by_expression(
    sized: Input | Unknown, model: InputModel, formula: Formula, constants: Constants
) -> Input | Unknown:
    """An input that follows an expression; where it has a size, one of i and n, too."""
    indexed = model.size is not None or "size" in model.unknown
    tree = _expression(formula, constants, formula_at(InputModel, "expression") if indexed else RUN)
    if tree is UNKNOWN or sized is UNKNOWN:
        return UNKNOWN
    hold = model.hold is not None and model.hold.value
    return _following(replace(sized, hold=hold), tree, constants, indexed)


def _following(sized: Input, tree: Tree, constants: Constants, indexed: bool) -> Input:
    """The input with an expression: of parameters, and of i and n where it is one for each of its numbers."""
    seen = names(tree).intersection(_INDEX) if indexed else frozenset()
    return replace(sized, expression=tree, slots=slots_named(tree, constants.settable), indexed=bool(seen))


def _by_rate(sized: Input | Unknown, formula: Formula, constants: Constants) -> Input | Unknown:
    """An input that counts events, so many a second. A rate that depends on the step gives NaN where it is negative."""
    rate = constants.tree(formula, _RATE)
    if rate is UNKNOWN or sized is UNKNOWN:
        return UNKNOWN
    made = Draw("poisson", Chain(("*",), (rate, Name("dt"))), Number(0.0), 0)
    drawn = _following(sized, made, constants, indexed=True)
    index: dict[str, Value] = {"i": np.arange(float(sized.size)), "n": float(sized.size)}
    if not names(rate) <= {*index, *ALWAYS, *constants.parameters}:
        return drawn
    rates = constants.value(formula, index)
    if rates is UNKNOWN:
        return UNKNOWN
    if not is_mean(rates * constants.dt).all():
        worst = float(np.max(rates)) if np.min(rates) >= 0 else float(np.min(rates))
        message = f"a rate must be at least 0, this is {worst:.15g}"
        if worst >= 0:
            message = f"a step has at most {LARGEST_MEAN:,.0f} events on average, these are {worst * constants.dt:.15g}"
        constants.findings.error("out-of-range", formula.span, message)
        return UNKNOWN
    bound = constants.bound(rate, {name: value for name, value in index.items() if name in names(rate)})
    return replace(drawn, widths=(bound,) if bound.slots else ())


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


def _sized(bare: Input, model: InputModel, section: Section, constants: Constants) -> Input | Unknown:
    """The input, of its size; UNKNOWN where that is invalid."""
    size = 1 if model.size is None else constants.integer(model.size, "'size'", 1)
    if size is UNKNOWN:
        return UNKNOWN
    if size > _MOST:
        span = key_span(section, "inputs", bare.name) if model.size is None else model.size.span
        constants.findings.error("too-many", span, "an input has at most 1,000,000 components")
        return UNKNOWN
    return replace(bare, size=size)


def _expression(formula: Formula, constants: Constants, role: Role) -> Tree | Unknown:
    tree = constants.tree(formula, role)
    if tree is not UNKNOWN and is_constant(tree, {*ALWAYS, *constants.parameters}.difference(role.sees)):
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
