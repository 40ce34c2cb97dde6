"""Lowering: from neurons and connections to populations and the update program.

In: the Census, the connections. Out: levels of neurons along delay-0 connections (one more than the highest of
those that reach it within the step) or a Cycle; Populations (neurons that are updated together), Projections
(connections that learn by one rule) and the program, an ordered list of operations.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import Indices, IntArray, IntColumn, frozen, narrow, width
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.connections.plasticity import Learning
from neurovis_spec.compiler.neurons.groups import Built
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import (
    Gather,
    Learn,
    Operation,
    Owner,
    Population,
    Port,
    Projection,
    ReadInputs,
    Send,
    Update,
    Use,
)


class Cycle(NamedTuple):
    """Neurons that wait for each other: the first is named again at the end; ``connection`` closes the cycle."""

    neurons: tuple[int, ...]
    connection: int


def levels(n: int, sources: IntColumn, targets: IntColumn, delays: IntColumn) -> IntArray | Cycle:
    """Levels by Kahn's algorithm; a cycle of delay-0 connections of single neurons where there is one."""
    result = np.zeros(n, dtype=np.int64)
    if not (delays.kept == 0).any():
        return result
    prompt = np.flatnonzero(delays.compact() == 0)
    order = prompt[np.argsort(sources[prompt], kind="stable")]
    outgoing = targets[order]
    starts = np.searchsorted(sources[order], np.arange(n + 1)).tolist()
    waiting = np.bincount(targets[prompt], minlength=n).tolist()
    ready = [neuron for neuron in range(n) if waiting[neuron] == 0]
    level = result.tolist()
    done = 0
    while done < len(ready):
        neuron = ready[done]
        done += 1
        for target in outgoing[starts[neuron] : starts[neuron + 1]].tolist():
            level[target] = max(level[target], level[neuron] + 1)
            waiting[target] -= 1
            if waiting[target] == 0:
                ready.append(target)
    if len(ready) == n:
        return np.array(level, dtype=np.int64)
    return _cycle(prompt.tolist(), sources, targets, waiting)


def _cycle(prompt: list[int], sources: IntColumn, targets: IntColumn, waiting: list[int]) -> Cycle:
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


def make_populations(census: Census, targets: Indices, levels: IntArray) -> tuple[Population, ...]:
    """Neurons of the same level, activation, model and combination, in the order of the levels."""
    groups = census.groups
    alike: dict[tuple[str, ...], int] = {}
    own = [
        alike.setdefault((*(used.definition.name for used in one.kind), one.group.combine), len(alike))
        for one in groups
    ]
    counts = [one.group.count for one in groups]
    group = np.repeat(np.arange(len(groups)), counts)
    home = _numbered(levels, np.repeat(np.array(own, dtype=np.int64), counts), len(alike))
    members = [some.astype(np.int64) for some in _split(home, int(home.max(initial=-1)) + 1)]
    home, slot = narrow(home), np.zeros(len(home), dtype=width(0, len(home)))
    for some in members:
        slot[some] = np.arange(len(some))
    populations = []
    for number, (some, incoming) in enumerate(zip(members, _split(home[targets], len(members)), strict=True)):
        first = groups[group[some[0]]]
        activation, model = (_use(number, some, group[some], groups, which) for which in (0, 1))
        drive = Port("drive", first.group.combine, frozen(incoming), frozen(slot[targets[incoming]]))
        populations.append(Population(int(levels[some[0]]), frozen(some), activation, model, (drive,)))
    return tuple(populations)


def _numbered(levels: IntArray, alike: IntArray, kinds: int) -> Indices:
    """The number of each neuron's population, by levels, then by first neurons; ``alike`` has what else they have in
    common, one of so many kinds."""
    _, first, population = np.unique(levels * kinds + alike, return_index=True, return_inverse=True)
    number = np.empty_like(first)
    number[np.lexsort((first, levels[first]))] = np.arange(len(first))
    return np.asarray(number[population], dtype=np.int64)


def _split(populations: Indices, number: int) -> list[Indices]:
    """The places of each population, ascending, in the least width."""
    kind = width(0, len(populations))
    if number == 1:
        return [np.arange(len(populations), dtype=kind)]
    order = np.argsort(populations, kind="stable").astype(kind)
    ends = np.cumsum([0, *np.bincount(populations, minlength=number).tolist()]).tolist()
    return [order[start:end].copy() for start, end in pairwise(ends)]


def _use(number: int, members: IntArray, own: IntArray, groups: Sequence[Built], which: int) -> Use:
    """A definition in use at a population: that of ``which`` kind of its groups, the ``own`` of each member."""
    definition = groups[own[0]].kind[which].definition
    owner = Owner(definition.kind.name, number)
    if not definition.parameters:
        return Use(owner, definition, {})
    starts = np.flatnonzero(np.diff(own, prepend=-1))
    ends = pairwise((*starts.tolist(), len(own)))
    parts = [
        (one.kind[which].parameters, members[start:end] - one.group.start)
        for one, (start, end) in zip((groups[place] for place in own[starts].tolist()), ends, strict=True)
    ]
    parameters = {
        name: frozen(np.concatenate([values[name][rows] for values, rows in parts])) for name in definition.parameters
    }
    return Use(owner, definition, parameters)


def make_projections(bundles: tuple[Bundle, ...]) -> tuple[tuple[Projection, ...], list[int]]:
    """One Projection a rule, whichever entries learn by it, and for each entry the number of its Projection or −1: what
    is learned by the same rule is computed together."""
    numbers: dict[str, int] = {}
    parts: list[list[tuple[Learning, IntArray]]] = []
    rules: list[int] = []
    start = 0
    for bundle in bundles:
        n, learning = len(bundle.sources), bundle.learning
        number = -1
        if learning is not None:
            number = numbers.setdefault(learning.rule.name, len(parts))
            if number == len(parts):
                parts.append([])
            parts[number].append((learning, np.arange(start, start + n, dtype=np.int64)))
        rules.append(number)
        start += n
    return tuple(_together(number, part) for number, part in enumerate(parts)), rules


def _together(number: int, parts: list[tuple[Learning, IntArray]]) -> Projection:
    """The connections of several entries that learn by one rule."""
    first = parts[0][0]
    members = np.concatenate([members for _, members in parts])
    parameters = {name: np.concatenate([one.parameters[name] for one, _ in parts]) for name in first.parameters}
    signals = {name: np.concatenate([one.signals[name] for one, _ in parts]) for name in first.signals}
    for array in (members, *parameters.values(), *signals.values()):
        frozen(array)
    return Projection(members, (Use(Owner(first.rule.kind.name, number), first.rule, parameters),), signals)


def make_program(populations: tuple[Population, ...], projections: tuple[Projection, ...]) -> tuple[Operation, ...]:
    """What a step does, in order (§5): inputs, neurons along delay 0, signals that leave, rules."""
    program: list[Operation] = [ReadInputs()]
    for number in range(len(populations)):
        program += [Gather(number), Update(number)]
    program.append(Send())
    program += [Learn(number) for number in range(len(projections))]
    return tuple(program)
