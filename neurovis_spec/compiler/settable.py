"""What ``set`` can change of a network in a run (§9): the numbers that a step reads and that depend on parameters.

In: a network, and the same one with other parameters. Out: those of its parts that differ. Where neither structure nor
what a run begins with nor what is drawn is among them, equal parts mean equal steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray
from neurovis_spec.compiler.network import Input, Network
from neurovis_spec.language.expressions.tree import Tree, names


def differences(network: Network, other: Network) -> dict[str, object]:
    """The parts of a network that those of another one, of the same structure, are not like: by what they are called,
    in a form that can be hashed."""
    found: dict[str, object] = {}
    for (name, array), (_, like) in zip(_arrays(network), _arrays(other), strict=True):
        if not np.array_equal(array, like):
            found[name] = array
    for number, (one, two) in enumerate(zip(network.inputs, other.inputs, strict=True)):
        formula = _formula(one, network.parameters)
        if formula != _formula(two, other.parameters):
            found[f"input/{number}"] = formula
        if one.table is not None and two.table is not None and not np.array_equal(one.table, two.table):
            found[f"table/{number}"] = one.table
    for number, (noise, before) in enumerate(zip(network.noises, other.noises, strict=True)):
        drawn = _used(noise.expression, noise.parameters)
        if drawn != _used(before.expression, before.parameters):
            found[f"noise/{number}"] = drawn
    return found


def _arrays(network: Network) -> Iterator[tuple[str, FloatArray]]:
    """All arrays that may differ, each under a name."""
    connections = network.connections
    plastic = connections.rules >= 0
    yield "bias", network.neurons.bias
    yield "weights", connections.weights[~plastic]  # the others are what they have become
    yield "centres", connections.centres
    yield "low", connections.low[plastic]
    yield "high", connections.high[plastic]
    for number, block in enumerate(network.blocks):
        for part, values in (("activation", block.activation_parameters), ("model", block.model_parameters)):
            yield from _named(f"{part}/{number}", values)
    for number, plasticity in enumerate(network.plasticity):
        yield from _named(f"rule/{number}", plasticity.parameters)


def _named(part: str, values: Mapping[str, FloatArray]) -> Iterator[tuple[str, FloatArray]]:
    return ((f"{part}/{name}", values[name]) for name in sorted(values))


def _formula(entry: Input, parameters: Mapping[str, float]) -> object:
    """The expression of an input, with the parameters that it reads."""
    if entry.expression is None:
        return None
    return entry.expression, _used(entry.expression, parameters)


def _used(tree: Tree, parameters: Mapping[str, float]) -> dict[str, float]:
    """The parameters that an expression reads."""
    return {name: parameters[name] for name in names(tree) & parameters.keys()}
