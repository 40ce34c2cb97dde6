"""Shared synapses in use: what they need, and which connections have their states together.

In: the synapse of an entry with its settings, where its connections lead. Out: findings; Units: of all connections that
lead to the same target the first one *carries* the states and brings the signal, the others only add to these.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray
from neurovis_spec.compiler.connections.in_use import InUse, Piece
from neurovis_spec.compiler.events.settable import Assembled, Dependent, ParameterFormula, Subset
from neurovis_spec.compiler.program import Definition, EndName
from neurovis_spec.compiler.values.arguments import Settled
from neurovis_spec.compiler.values.shared import feed, receptor
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.yaml.source import Entry


class Units(NamedTuple):
    """Of some connections: the first one to each target, ascending; and for each of all which of these it adds to."""

    carriers: IntArray
    slots: IntArray


def units_of(targets: Indices) -> Units:
    """The units of connections that lead to these targets.

    >>> carriers, slots = units_of(np.array([5, 3, 5, 4]))
    >>> carriers.tolist(), slots.tolist()
    ([0, 1, 3], [0, 1, 0, 2])
    """
    _, first, number = np.unique(targets, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return Units(first[order].astype(np.int64), rank[number.ravel()])


def carriers_in(uses: Sequence[InUse], targets: Indices) -> IntArray | None:
    """For each connection of an entry, which lead to these targets, the one that carries the states of its synapse;
    None where the entry shares none."""
    for use in uses:
        if any(piece.definition.shared for piece in use.pieces):
            result = np.arange(len(targets), dtype=np.int64)
            for piece in use.pieces:
                carriers, slots = units_of(targets[piece.places])
                result[piece.places] = piece.places[carriers][slots]
            return result
    return None


def receptor_and_feed(piece: Piece) -> tuple[Piece, Piece]:
    """A shared synapse at some connections as that of which there is one at each target, and what each of the
    connections adds to it; both have all of these connections."""
    receives, feeds = (_with(piece, made(piece.definition)) for made in (receptor, feed))
    return receives, feeds


def _with(piece: Piece, definition: Definition) -> Piece:
    """The same with a part of its definition."""
    parameters = {name: piece.parameters[name] for name in definition.parameters}
    read: tuple[EndName, ...] = tuple(one for one in piece.read if one in definition.end_names)
    return piece._replace(definition=definition, parameters=parameters, read=read)


def check_shared(settled: Settled, span: Span, findings: Findings) -> None:
    """Report parameters that may differ from connection to connection of an entry; ``span``: where the synapse is
    named."""
    for name, values in settled.parameters.items():
        parts = [part for part in settled.parts if part.name == name]
        if _equal(values) and all(part.places is None and _is_one(part.formula) for part in parts):
            continue
        entry = settled.entries.get(name)
        where = entry.value.span if isinstance(entry, Entry) else span
        message = f"the synapse '{settled.definition.name}' is shared, and '{name}' is not the same at all connections"
        hint = "write one number for all, or leave 'shared' out of the synapse"
        findings.error("shared-parameters", where, message, hint)


def _equal(values: FloatArray) -> bool:
    return bool((values == values[:1]).all())


def _is_one(formula: Dependent) -> bool:
    """Whether a formula gives one number for all, whatever the parameters that it follows."""
    if isinstance(formula, Subset):
        return _is_one(formula.whole)
    if isinstance(formula, Assembled):
        return _equal(formula.base) and all(one.places is None and _is_one(one.formula) for one in formula.parts)
    if not isinstance(formula, ParameterFormula) or formula.draw is not None:
        return False
    return all(
        isinstance(one, float) or (_equal(np.atleast_1d(one)) if isinstance(one, np.ndarray) else _is_one(one))
        for one in formula.known.values()
    )
