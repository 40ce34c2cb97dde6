"""Lowering: from neurons and connections to blocks and the update program.

In: the Population, the connections, the levels. Out: Blocks (neurons that are updated together), Plasticities
(connections that learn by one rule) and the program, an ordered list of operations.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from neurovis_spec.compiler.connect import Bundle
from neurovis_spec.compiler.network import (
    Block,
    Combine,
    FloatArray,
    Gather,
    IntArray,
    Learn,
    Operation,
    Plasticity,
    ReadInputs,
    Send,
    Update,
    frozen,
)
from neurovis_spec.compiler.populate import Kind, Population


def make_blocks(population: Population, sources: IntArray, targets: IntArray, levels: IntArray) -> tuple[Block, ...]:
    """Neurons of the same level, activation, model and combination, in the order of the levels."""
    members: dict[tuple[int, str, str, Combine], list[int]] = {}
    kinds: dict[tuple[int, str, str, Combine], list[Kind]] = {}
    rows: dict[tuple[int, str, str, Combine], list[int]] = {}
    for group, kind in zip(population.neurons.groups, population.kinds, strict=True):
        for row, neuron in enumerate(group.indices):
            key = (int(levels[neuron]), kind.activation.name, kind.model.name, group.combine)
            members.setdefault(key, []).append(neuron)
            kinds.setdefault(key, []).append(kind)
            rows.setdefault(key, []).append(row)
    order = sorted(members, key=lambda key: (key[0], members[key][0]))
    home = np.full(len(population.neurons), -1, dtype=np.int64)
    slot = np.zeros(len(population.neurons), dtype=np.int64)
    for number, key in enumerate(order):
        home[members[key]] = number
        slot[members[key]] = np.arange(len(members[key]))
    owner = home[targets] if len(targets) else np.zeros(0, dtype=np.int64)
    blocks = []
    for number, key in enumerate(order):
        first = kinds[key][0]
        incoming = np.flatnonzero(owner == number).astype(np.int64)
        block = Block(
            level=key[0],
            members=np.array(members[key], dtype=np.int64),
            combine=key[3],
            activation=first.activation,
            activation_parameters=_column([k.activation_parameters for k in kinds[key]], rows[key]),
            model=first.model,
            model_parameters=_column([k.model_parameters for k in kinds[key]], rows[key]),
            incoming=incoming,
            slots=slot[targets[incoming]] if len(incoming) else incoming,
        )
        for array in (block.members, block.incoming, block.slots):
            frozen(array)
        blocks.append(block)
    return tuple(blocks)


def _column(parameters: list[Mapping[str, FloatArray]], rows: list[int]) -> Mapping[str, FloatArray]:
    """The parameters of several neurons, each from a row of its group's arrays."""
    result: dict[str, FloatArray] = {}
    for name in parameters[0]:
        values = np.array([one[name][row] for one, row in zip(parameters, rows, strict=True)], dtype=np.float64)
        frozen(values)
        result[name] = values
    return result


def make_plasticity(bundles: tuple[Bundle, ...]) -> tuple[tuple[Plasticity, ...], IntArray]:
    """One Plasticity a plastic entry, and for each connection the number of its Plasticity or −1."""
    result: list[Plasticity] = []
    rules: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    start = 0
    for bundle in bundles:
        n = len(bundle.sources)
        learning = bundle.learning
        if learning is None:
            rules.append(np.full(n, -1, dtype=np.int64))
        else:
            rules.append(np.full(n, len(result), dtype=np.int64))
            members = np.arange(start, start + n, dtype=np.int64)
            for array in (members, *learning.parameters.values(), *learning.signals.values()):
                frozen(array)
            result.append(Plasticity(learning.rule, members, learning.parameters, learning.signals, learning.title))
        start += n
    return tuple(result), np.concatenate(rules)


def make_program(blocks: tuple[Block, ...], plasticity: tuple[Plasticity, ...]) -> tuple[Operation, ...]:
    """What a step does, in order (§5): inputs, neurons along delay 0, signals that leave, rules."""
    program: list[Operation] = [ReadInputs()]
    for number in range(len(blocks)):
        program += [Gather(number), Update(number)]
    program.append(Send())
    program += [Learn(number) for number in range(len(plasticity))]
    return tuple(program)
