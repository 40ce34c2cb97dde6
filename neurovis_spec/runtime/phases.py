"""Phases: which network runs at a step, and how a run goes over from one to the next (§9).

In: a Network whose events are phases, a State. Out: the network of a step; the state as the next phase wants it.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.state import State, history_depth


def network_at(network: Network, step: int) -> Network:
    """The network that computes a step."""
    current = network
    for begin, phase in network.phases:
        if begin > step:
            break
        current = phase
    return current


def segments(network: Network, steps: int) -> Iterator[tuple[Network, int, int]]:
    """The networks of a run of ``steps`` steps, each with its first step and the one after its last."""
    begins = [begin for begin, _ in network.phases if 0 < begin < steps]
    edges = [0, *begins, steps]
    for first, last in pairwise(edges):
        yield network_at(network, first), first, last


def go_over(state: State, before: Network, after: Network) -> None:
    """Make the state of one phase that of the next, in place.

    Fixed weights that a parameter changes follow; plastic weights, states and signals under way stay; what a lesion
    took out of a rule has no traces any more.
    """
    old, new = before.connections.weights, after.connections.weights
    follow = (after.connections.rules < 0) & (old != new)
    state.weights[follow] = new[follow]
    state.history = _deep(state, history_depth(after))
    state.traces = tuple(
        tuple(values[np.isin(one.members, other.members)] for values in traces)
        for one, other, traces in zip(before.plasticity, after.plasticity, state.traces, strict=True)
    )


def _deep(state: State, depth: int) -> FloatArray:
    """The history in a ring of another depth: as many of the latest activities as it holds."""
    old = len(state.history)
    if depth == old:
        return state.history
    history = np.zeros((depth, state.history.shape[1]))
    for step in range(max(0, state.k - min(depth, old)), state.k):
        history[step % depth] = state.history[step % old]
    return history
