"""Lowering: from neurons and connections to blocks and the update program.

In: the Population, the connections. Out: levels of neurons along delay-0 connections (one more than the highest of
those that reach it within the step) or a Cycle; Blocks (neurons that are updated together), Plasticities (connections
that learn by one rule) and the program, an ordered list of operations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray, frozen
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.connections.plasticity import Learning
from neurovis_spec.compiler.neurons.groups import Kind
from neurovis_spec.compiler.neurons.populate import Population
from neurovis_spec.compiler.program import (
    Block,
    Gather,
    Learn,
    Operation,
    Plasticity,
    ReadInputs,
    Send,
    Update,
)
from neurovis_spec.language.words import Combine

#: What the neurons of a block have in common: level, activation, model, combination.
_Key: TypeAlias = tuple[int, str, str, Combine]
#: The row of a group of one; there may be many of these.
_ONE: Final[IntArray] = np.zeros(1, dtype=np.int64)


class Cycle(NamedTuple):
    """Neurons that wait for each other: the first is named again at the end; ``connection`` closes the cycle."""

    neurons: tuple[int, ...]
    connection: int


def levels(n: int, sources: IntArray, targets: IntArray, delays: IntArray) -> IntArray | Cycle:
    """Levels by Kahn's algorithm; a cycle of delay-0 connections of single neurons where there is one."""
    prompt = np.flatnonzero(delays == 0)
    result = np.zeros(n, dtype=np.int64)
    if not len(prompt):
        return result
    order = prompt[np.argsort(sources[prompt], kind="stable")]
    outgoing = targets[order].tolist()
    starts = np.searchsorted(sources[order], np.arange(n + 1)).tolist()
    waiting = np.bincount(targets[prompt], minlength=n).tolist()
    ready = [neuron for neuron in range(n) if waiting[neuron] == 0]
    level = result.tolist()
    done = 0
    while done < len(ready):
        neuron = ready[done]
        done += 1
        for target in outgoing[starts[neuron] : starts[neuron + 1]]:
            level[target] = max(level[target], level[neuron] + 1)
            waiting[target] -= 1
            if waiting[target] == 0:
                ready.append(target)
    if len(ready) == n:
        return np.array(level, dtype=np.int64)
    return _cycle(prompt.tolist(), sources, targets, waiting)


def _cycle(prompt: list[int], sources: IntArray, targets: IntArray, waiting: list[int]) -> Cycle:
    """Go backwards among the neurons that still wait until one comes up again."""
    into: dict[int, int] = {}
    for connection in prompt:
        source, target = int(sources[connection]), int(targets[connection])
        if waiting[source] and waiting[target]:
            into.setdefault(target, connection)
    neuron = min(into)
    path: list[int] = []
    place: dict[int, int] = {}
    while neuron not in place:
        place[neuron] = len(path)
        path.append(neuron)
        neuron = int(sources[into[neuron]])
    ring = path[place[neuron] :]
    forward = (ring[0], *reversed(ring))
    return Cycle(forward, into[ring[0]])


def make_blocks(population: Population, sources: IntArray, targets: IntArray, levels: IntArray) -> tuple[Block, ...]:
    """Neurons of the same level, activation, model and combination, in the order of the levels."""
    parts: dict[_Key, list[_Part]] = {}
    for group, kind in ((one.group, one.kind) for one in population.groups):
        own = levels[group.start : group.start + group.count]
        for level, rows in _by_level(own):
            key = (level, kind.activation.name, kind.model.name, group.combine)
            parts.setdefault(key, []).append(_Part(kind, group.start, rows))
    order = sorted(parts, key=lambda key: (key[0], parts[key][0].members[0]))
    home = np.full(len(population.neurons), -1, dtype=np.int64)
    slot = np.zeros(len(population.neurons), dtype=np.int64)
    members = {key: np.concatenate([part.members for part in parts[key]]) for key in order}
    for number, key in enumerate(order):
        home[members[key]] = number
        slot[members[key]] = np.arange(len(members[key]))
    owner = home[targets]
    by_owner = np.argsort(owner, kind="stable")
    ends = np.searchsorted(owner[by_owner], np.arange(len(order) + 1))
    blocks = []
    for number, key in enumerate(order):
        first = parts[key][0].kind
        incoming = by_owner[ends[number] : ends[number + 1]].astype(np.int64)
        block = Block(
            level=key[0],
            members=members[key],
            combine=key[3],
            activation=first.activation,
            activation_parameters=_column([(p.kind.activation_parameters, p.rows) for p in parts[key]]),
            model=first.model,
            model_parameters=_column([(p.kind.model_parameters, p.rows) for p in parts[key]]),
            incoming=incoming,
            slots=slot[targets[incoming]],
        )
        for array in (block.members, block.incoming, block.slots):
            frozen(array)
        blocks.append(block)
    return tuple(blocks)


def _by_level(levels: IntArray) -> Iterator[tuple[int, IntArray]]:
    """Each level, and the rows that have it, ascending; a chain with delay 0 has as many levels as neurons."""
    if len(levels) == 1:
        yield int(levels[0]), _ONE
        return
    rows = np.argsort(levels, kind="stable")
    found, starts = np.unique(levels[rows], return_index=True)
    ends = [*starts[1:].tolist(), len(rows)]
    for level, start, end in zip(found.tolist(), starts.tolist(), ends, strict=True):
        yield level, rows[start:end]


class _Part(NamedTuple):
    """The neurons of one group that belong to one block, by their rows within the group."""

    kind: Kind
    start: int
    rows: IntArray

    @property
    def members(self) -> IntArray:
        return self.start + self.rows


def _column(parts: list[tuple[Mapping[str, FloatArray], IntArray]]) -> Mapping[str, FloatArray]:
    """The parameters of a block, each from rows of its groups' arrays."""
    result: dict[str, FloatArray] = {}
    for name in parts[0][0]:
        result[name] = frozen(np.concatenate([parameters[name][rows] for parameters, rows in parts]))
    return result


def make_plasticity(bundles: tuple[Bundle, ...]) -> tuple[tuple[Plasticity, ...], IntArray]:
    """One Plasticity a rule, whichever entries learn by it, and for each connection the number of its Plasticity or −1:
    what is learned by the same rule is computed together."""
    numbers: dict[str, int] = {}
    parts: list[list[tuple[Learning, IntArray]]] = []
    rules: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    start = 0
    for bundle in bundles:
        n, learning = len(bundle.sources), bundle.learning
        number = -1
        if learning is not None:
            number = numbers.setdefault(learning.rule.name, len(parts))
            if number == len(parts):
                parts.append([])
            parts[number].append((learning, np.arange(start, start + n, dtype=np.int64)))
        rules.append(np.full(n, number, dtype=np.int64))
        start += n
    return tuple(_together(part) for part in parts), np.concatenate(rules)


def _together(parts: list[tuple[Learning, IntArray]]) -> Plasticity:
    """The connections of several entries that learn by one rule."""
    first = parts[0][0]
    members = np.concatenate([members for _, members in parts])
    parameters = {name: np.concatenate([one.parameters[name] for one, _ in parts]) for name in first.parameters}
    signals = {name: np.concatenate([one.signals[name] for one, _ in parts]) for name in first.signals}
    for array in (members, *parameters.values(), *signals.values()):
        frozen(array)
    return Plasticity(first.rule, members, parameters, signals)


def make_program(blocks: tuple[Block, ...], plasticity: tuple[Plasticity, ...]) -> tuple[Operation, ...]:
    """What a step does, in order (§5): inputs, neurons along delay 0, signals that leave, rules."""
    program: list[Operation] = [ReadInputs()]
    for number in range(len(blocks)):
        program += [Gather(number), Update(number)]
    program.append(Send())
    program += [Learn(number) for number in range(len(plasticity))]
    return tuple(program)
