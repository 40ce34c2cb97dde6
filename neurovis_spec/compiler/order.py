"""The order within a step: levels of neurons along delay-0 connections.

In: sources, targets and delays of all connections. Out: the level of each neuron (one more than the highest of those
that reach it without delay), or a cycle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import IntArray


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
