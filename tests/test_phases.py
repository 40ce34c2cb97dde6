"""Phases: what is carried on from step to step is what a plain computation of each step by itself gives."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Learn

HEAD = """
neurovis: 1
name: x
parameters: {g: 1}
neurons: {A: {count: 3, bias: 1, initial: g}, B: {count: 2}}
connections:
  A -> B: {weight: g, pattern: all_to_all}
  B -> A: {weight: 0.1, pattern: all_to_all, plasticity: {hebbian: {rate: 0.01 * g}}}
"""
NAMES = ("A1", "A2", "A3", "B1", "B2")

#: kind, first step, the one after the last (of a clamp), a neuron, another one, a value
Change: TypeAlias = tuple[str, int, int | None, int, int, int]
CHANGES = st.tuples(
    st.sampled_from(["set", "clamp", "neuron", "connection"]),
    st.integers(0, 6),
    st.none() | st.integers(1, 4),
    st.integers(0, 2),
    st.integers(3, 4),
    st.integers(-2, 2),
).map(lambda c: (c[0], c[1], c[1] + c[2] if c[0] == "clamp" and c[2] else None, *c[3:]))


def entry(change: Change) -> str:
    kind, at, to, one, other, value = change
    if kind == "set":
        return f"  - {{at: {at}, set: {{g: {value}}}}}\n"
    if kind == "clamp":
        until = "" if to is None else f"to: {to}, "
        return f"  - {{from: {at}, {until}clamp: {{{NAMES[one]}: {value}, {NAMES[other]}: 1}}}}\n"
    return f"  - {{at: {at}, lesion: [{NAMES[one]}{f' -> {NAMES[other]}' if kind == 'connection' else ''}]}}\n"


@lru_cache
def plain(g: float) -> Network:
    return nv.compile_text(HEAD, parameters={"g": g}).network


def check(phase: Network, changes: list[Change], step: int) -> None:
    """A phase is what all events up to its step give, each of them looked at anew."""
    begun = [change for change in changes if change[1] <= step]
    sets = [(at, number, value) for number, (kind, at, *_, value) in enumerate(begun) if kind == "set"]
    base = plain(max(sets)[2] if sets else 1)
    clamps: dict[int, float] = {}
    for kind, _, to, one, other, value in begun:
        if kind == "clamp" and (to is None or step < to):
            clamps |= {one: value, other: 1.0}
    silent = {one for kind, _, _, one, _, _ in begun if kind == "neuron"}
    wires = {(one, other) for kind, _, _, one, other, _ in begun if kind == "connection"}
    clamps |= dict.fromkeys(silent, 0.0)
    assert phase.clamped == tuple(sorted(clamps.items()))
    ends = list(zip(base.connections.sources.tolist(), base.connections.targets.tolist(), strict=True))
    stays = np.array([not {*pair} & silent and pair not in wires for pair in ends])
    assert phase.parameters == base.parameters
    np.testing.assert_array_equal(phase.neurons.initial, plain(1).neurons.initial)
    np.testing.assert_array_equal(phase.connections.weights, base.connections.weights)
    for block, whole in zip(phase.blocks, base.blocks, strict=True):
        keep = stays[whole.incoming]
        assert block.incoming.tolist() == whole.incoming[keep].tolist()
        assert block.slots.tolist() == whole.slots[keep].tolist()
        assert not block.incoming.flags.writeable
    for rule, entire in zip(phase.plasticity, base.plasticity, strict=True):
        keep = stays[entire.members]
        assert rule.members.tolist() == entire.members[keep].tolist()
        for name, values in entire.parameters.items():
            assert rule.parameters[name].tolist() == values[keep].tolist()
        for name, signals in entire.signals.items():
            assert rule.signals[name].tolist() == signals[keep].tolist()
    learns = [op.plasticity for op in phase.program if isinstance(op, Learn)]
    assert learns == [number for number, rule in enumerate(phase.plasticity) if len(rule.members)]
    assert len(phase.program) - len(learns) == len([op for op in base.program if not isinstance(op, Learn)])


@given(st.lists(CHANGES, min_size=1, max_size=12))
@settings(deadline=None, max_examples=150)
def test_what_is_carried_on_is_what_each_step_gives_by_itself(changes: list[Change]) -> None:
    network = nv.compile_text(HEAD + "events:\n" + "".join(map(entry, changes))).network
    ends = {to for _, _, to, *_ in changes if to is not None}
    assert [step for step, _ in network.phases] == sorted({at for _, at, *_ in changes} | ends)
    for step, phase in network.phases:
        check(phase, changes, step)


def test_phases_in_which_nothing_changes_are_one_network() -> None:
    """Thousands of them take the memory of one."""
    text = HEAD + "events:\n" + "".join(f"  - {{at: {step}, lesion: [A1]}}\n" for step in range(50))
    phases = [phase for _, phase in nv.compile_text(text).network.phases]
    assert all(one is other for one, other in pairwise(phases))


def test_what_is_set_to_and_fro_is_compiled_once() -> None:
    text = HEAD + "events:\n" + "".join(f"  - {{at: {step}, set: {{g: {step % 2}}}}}\n" for step in range(50))
    phases = [phase for _, phase in nv.compile_text(text).network.phases]
    assert all(one.connections is other.connections for one, other in zip(phases, phases[2:], strict=False))
    assert phases[0].connections is not phases[1].connections


def test_a_negative_zero_that_is_set_is_another_value_than_zero() -> None:
    text = HEAD + "events: [{at: 1, set: {g: 0}}, {at: 2, set: {g: '-0.0'}}]"
    weights = [phase.connections.weights[0] for _, phase in nv.compile_text(text).network.phases]
    assert np.signbit(weights).tolist() == [False, True]
