"""Ends: whether the line of a connection ends in an arrow, in a bar, or in neither.

In: a network, its weights. Out: 1 (an arrow), −1 (a bar) or 0 for each connection: as the ``sign`` of its synapse says,
where that has one, else as its weight is positive or negative.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.expressions.evaluate import Given, evaluate_array

EndArray: TypeAlias = npt.NDArray[np.int8]


def ends_of(network: Network, weights: FloatArray) -> EndArray:
    """How the lines of connections with these weights (…, m) end; with a sign that is no number in neither."""
    result = np.where(weights < 0, np.int8(-1), np.int8(1))
    for projection in network.projections:
        definition, members = projection.use.definition, projection.members
        if definition.sign is None:
            continue
        known: dict[str, Given] = {**projection.use.parameters, "weight": weights[..., members]}
        with np.errstate(all="ignore"):
            sign = np.nan_to_num(np.sign(evaluate_array(definition.sign, known)), nan=0.0)
        result[..., members] = sign
    return result


def signed(network: Network) -> IntArray:
    """The connections whose synapse says how they end, ascending."""
    found = [one.members for one in network.projections if one.use.definition.sign is not None]
    return np.sort(np.concatenate([np.zeros(0, np.int64), *found]))


def effects_of(network: Network, weights: FloatArray) -> FloatArray:
    """Weights (…, m), below 0 where they inhibit: of a synapse that says how its lines end its size, with that sign."""
    said = signed(network)
    if not len(said):
        return weights
    result, size = weights.copy(), np.abs(weights[..., said])
    result[..., said] = np.where(ends_of(network, weights)[..., said] < 0, -size, size)
    return result
