"""Settings: what an author gives an activation, a model or a rule at its use.

In: a Choice (a name with settings), the definition's parameters with their defaults, the Constants. Out: the value of
every parameter, one for each of n neurons; the neuron's index ``i`` and the count ``n`` are known there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import numpy as np

from neurovis_spec.compiler.constants import CONSTANTS, Constants, Randomness, Value
from neurovis_spec.compiler.definitions import Defaults
from neurovis_spec.compiler.draws import Stream
from neurovis_spec.compiler.network import FloatArray
from neurovis_spec.diagnostics import suggest
from neurovis_spec.language.expressions.arrays import evaluate_array
from neurovis_spec.language.located import Formula, formula_of
from neurovis_spec.language.source import Entry, Packed, Sequence
from neurovis_spec.language.values import Choice, FormulaList

T = TypeVar("T")


def choose(
    choice: Choice, known: Mapping[str, tuple[T, Defaults]], what: str, constants: Constants
) -> tuple[T, Defaults] | None:
    """The definition that a choice names; an unknown name is answered with the nearest ones."""
    name = choice.name
    found = known.get(name.value)
    if found is None:
        hint = suggest(name.value, known, "known")
        constants.findings.error(f"unknown-{what}", name.span, f"there is no {what} '{name.value}'", hint)
    return found


def spread(
    formulas: Formula | FormulaList, n: int, constants: Constants, what: str, stream: Stream | None = None
) -> FloatArray | None:
    """One value for each of n neurons: from one formula of ``i`` and ``n``, or from a list of n.

    With a stream the formulas may draw random numbers; the counter of neuron i is (i, 0, 0, number of the draw).
    """
    if isinstance(formulas, FormulaList):
        return _listed(formulas, n, constants, what, stream)
    index = np.arange(n, dtype=np.int64)
    randomness = None if stream is None else Randomness(stream, index)
    value = constants.value(formulas, {"i": index.astype(np.float64), "n": float(n)}, randomness)
    return None if value is None else np.broadcast_to(np.asarray(value, dtype=np.float64), (n,)).copy()


def _listed(formulas: FormulaList, n: int, constants: Constants, what: str, stream: Stream | None) -> FloatArray | None:
    if len(formulas.items) != n:
        message = f"{what} has {len(formulas.items)} values for {n} neuron{'s' if n != 1 else ''}"
        constants.findings.error("wrong-size", formulas.span, message)
        return None
    result: list[float] = []
    for position, item in enumerate(formulas.items):
        randomness = None if stream is None else Randomness(stream, position)
        value = constants.value(item, {"i": float(position), "n": float(n)}, randomness)
        if value is not None:
            result.append(float(value))
    return np.array(result, dtype=np.float64) if len(result) == n else None


def _formulas(entry: Entry, constants: Constants) -> Formula | FormulaList | None:
    node = entry.value
    if isinstance(node, (Sequence, Packed)):
        items = [formula_of(item, constants.findings) for item in node.items]
        if any(item is None for item in items):
            return None
        return FormulaList(tuple(item for item in items if item is not None), node.span)
    return formula_of(node, constants.findings)


def parameters(
    entries: tuple[Entry, ...], defaults: Defaults, n: int, constants: Constants, allowed: tuple[str, ...] = ()
) -> dict[str, FloatArray] | None:
    """The value of every parameter of a definition for n neurons or connections.

    ``allowed`` are further keys (signals) that the caller reads itself.
    """
    names = tuple(name for name, _ in defaults)
    given: dict[str, FloatArray] = {}
    failed = False
    for entry in entries:
        if entry.name in names:
            formulas = _formulas(entry, constants)
            value = None if formulas is None else spread(formulas, n, constants, f"'{entry.name}'")
            failed = failed or value is None
            if value is not None:
                given[entry.name] = value
        elif entry.name not in allowed:
            failed = True
            known = (*names, *allowed)
            hint = suggest(entry.name, known, "known here") or "it has no parameters"
            constants.findings.error("unknown-parameter", entry.key.span, f"there is no parameter '{entry.name}'", hint)
    if failed:
        return None
    values: dict[str, Value] = {**CONSTANTS, "dt": constants.dt}
    result: dict[str, FloatArray] = {}
    for name, tree in defaults:
        value = given.get(name)
        if value is None:
            value = np.broadcast_to(np.asarray(evaluate_array(tree, values), dtype=np.float64), (n,)).copy()
        values[name] = value
        result[name] = value
    return result
