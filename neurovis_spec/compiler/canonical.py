"""The canonical form of a network's parts: what the content hash is made from.

In: parts of a Network in the order in which the spec writes them. Out: the same parts in an order that depends on names
alone, where no run depends on the order: inputs, outputs, and the parameters, states and signals of definitions. What
counts by the place of an input counts by its place here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.network import Input, Neurons, Output
from neurovis_spec.compiler.program import Activation, Block, Model, Plasticity, Rule


def canonical(
    neurons: Neurons,
    inputs: Sequence[Input],
    outputs: Sequence[Output],
    blocks: Sequence[Block],
    plasticity: Sequence[Plasticity],
) -> tuple[object, ...]:
    """The parts, in this order, ready to be hashed."""
    arranged, places = _arranged(inputs)
    count = len(neurons)
    moved = np.concatenate((np.arange(count), count + places))
    return (
        replace(neurons, input=np.append(places, -1)[neurons.input]),  # −1, without an input, stays −1
        arranged,
        sorted(outputs, key=lambda output: output.name),
        [replace(block, activation=_activation(block.activation), model=_definition(block.model)) for block in blocks],
        [
            replace(
                one,
                rule=replace(_definition(one.rule), signals=tuple(sorted(one.rule.signals))),
                signals={name: moved[indices] for name, indices in one.signals.items()},
            )
            for one in plasticity
        ],
    )


def _arranged(inputs: Sequence[Input]) -> tuple[list[Input], IntArray]:
    """The inputs by name, and where each number of the vector of all inputs stands then."""
    places = np.zeros(sum(entry.size for entry in inputs), dtype=np.int64)
    result: list[Input] = []
    start = 0
    for entry in sorted(inputs, key=lambda entry: entry.name):
        places[entry.start : entry.start + entry.size] = np.arange(start, start + entry.size)
        result.append(replace(entry, start=start))
        start += entry.size
    return result, places


def _activation(activation: Activation) -> Activation:
    return replace(activation, parameters=tuple(sorted(activation.parameters)))


Definition = TypeVar("Definition", Model, Rule)


def _definition(made: Definition) -> Definition:
    states = tuple(sorted(made.state, key=lambda state: state.name))
    return replace(made, parameters=tuple(sorted(made.parameters)), state=states)
