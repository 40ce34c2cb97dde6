"""The timeline: what is carried on from step to step is what a plain computation of each step by itself gives."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.simulation import Simulation

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
Mask: TypeAlias = npt.NDArray[np.bool_]
CHANGES = st.tuples(
    st.sampled_from(["set", "clamp", "neuron", "connection", "mend", "join", "stop", "start"]),
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
    if kind in ("stop", "start"):
        return f"  - {{at: {at}, learning: {{{NAMES[other]} -> {NAMES[one]}: {str(kind == 'start').lower()}}}}}\n"
    action = "mend" if kind in ("mend", "join") else "lesion"
    return (
        f"  - {{at: {at}, {action}: [{NAMES[one]}{f' -> {NAMES[other]}' if kind in ('connection', 'join') else ''}]}}\n"
    )


@lru_cache
def plain(g: float) -> Network:
    return nv.compile_text(HEAD, parameters={"g": g}).network


def check(simulation: Simulation, changes: list[Change], step: int, before: Mask) -> Mask:
    """What holds at a step is what all events up to it give, each of them looked at anew. Which connections were gone
    ``before``, and which are now."""
    begun = sorted((change for change in changes if change[1] <= step), key=lambda change: change[1])
    base = plain(next((value for kind, *_, value in reversed(begun) if kind == "set"), 1))
    clamps: dict[int, float] = {}
    for kind, _, to, one, other, value in (change for change in changes if change in begun):
        if kind == "clamp" and (to is None or step < to):
            clamps |= {one: value, other: 1.0}
    silent, wires, stopped = set[int](), set[tuple[int, int]](), set[tuple[int, int]]()
    for at in sorted({change[1] for change in begun}):
        for order in (("mend", "join"), ("neuron", "connection"), ("stop", "start")):
            for kind, own, _, one, other, _ in begun:
                if own == at and kind in order:
                    change_one = {"mend": silent.discard, "neuron": silent.add}.get(kind)
                    change_two = {
                        "join": wires.discard, "connection": wires.add, "stop": stopped.add, "start": stopped.discard
                    }.get(kind)  # fmt: skip
                    if change_one:
                        change_one(one)
                    if change_two:
                        change_two((one, other) if kind in ("join", "connection") else (other, one))
    clamps |= dict.fromkeys(silent, 0.0)
    ends = list(zip(base.connections.sources.tolist(), base.connections.targets.tolist(), strict=True))
    gone = [bool({*pair} & silent) or pair in wires for pair in ends]
    still = [out or pair in stopped for pair, out in zip(ends, gone, strict=True)]
    lesioned, lost = simulation.lesioned
    assert np.flatnonzero(lesioned).tolist() == sorted(silent)
    assert lost.tolist() == gone
    assert (simulation.stopped | lost).tolist() == still
    assert np.flatnonzero(simulation.held | lesioned).tolist() == sorted(clamps)
    assert simulation.parameters == base.parameters
    sent, weights = simulation.activity, simulation.connection_weights
    fixed = base.connections.rules.whole() < 0
    np.testing.assert_array_equal(weights[fixed], base.connections.weights[fixed])
    simulation.step()
    held = {neuron: float(simulation.activity[neuron]) for neuron in clamps}
    assert held == clamps
    changed, learns = simulation.connection_weights - weights, ~fixed & ~np.array(still)
    assert not changed[~fixed & ~learns].any()
    if step:  # what was sent while a connection was gone never arrives
        arrived = np.where(before, 0.0, sent[base.connections.sources.whole()])
        grown = 0.01 * base.parameters["g"] * arrived * simulation.activity[base.connections.targets.whole()]
        np.testing.assert_allclose(changed[learns], grown[learns], rtol=1e-9, atol=1e-9)
    return lost


@given(st.lists(CHANGES, min_size=1, max_size=12))
@settings(deadline=None, max_examples=100)
def test_what_is_carried_on_is_what_each_step_gives_by_itself(changes: list[Change]) -> None:
    network = nv.compile_text(HEAD + "events:\n" + "".join(map(entry, changes)))
    ends = {to for _, _, to, *_ in changes if to is not None}
    assert [change.at for change in network.network.changes] == sorted({at for _, at, *_ in changes} | ends)
    simulation, gone = network.simulator(), np.zeros(12, bool)
    for step in range(11):
        gone = check(simulation, changes, step, gone)


def test_a_negative_zero_that_is_set_is_another_value_than_zero() -> None:
    text = HEAD + "events: [{at: 1, set: {g: 0}}, {at: 2, set: {g: '-0.0'}}]"
    simulation = nv.compile_text(text).simulator()
    signs = []
    for _ in range(2):
        simulation.step()
        signs.append(bool(np.signbit(simulation.weight("A1 -> B1"))))
    assert signs == [False, True]
    assert nv.compile_text(text).hash != nv.compile_text(text.replace("-0.0", "0")).hash


def test_a_clamp_that_was_covered_holds_again() -> None:
    """Of several clamps of a neuron the one written last holds, while it lasts, whichever began first."""
    events = "[{from: 4, clamp: {A: 1}}, {from: 1, to: 6, clamp: {A1..A2: 2}}, {from: 5, to: 7, clamp: {A1: 3}}]"
    recording = nv.compile_text(f"{HEAD}events: {events}").run(9)
    assert recording["A1"][1:].tolist() == [2.0] * 4 + [3.0] * 2 + [1.0] * 2
    assert recording["A2"][1:].tolist() == [2.0] * 5 + [1.0] * 3
    assert recording["A3"][4:].tolist() == [1.0] * 5


def test_events_that_name_the_same_share_its_indices() -> None:
    """So a thousand events on all connections take no more memory than one."""
    kinds = ("lesion: A -> B", "mend: A -> B", "lesion: A + B", "mend: A + B", "learning: {B -> A: false}")
    events = [f"  - {{at: {at}, {kind}}}\n" for at in (1, 2) for kind in kinds]
    clamps = [f"  - {{from: {at}, clamp: {{A + B: {at}}}}}\n" for at in (1, 2)]
    first, second = nv.compile_text(HEAD + "events:\n" + "".join(events + clamps)).network.changes
    for kind in ("lesioned_neurons", "lesioned_connections", "mended_neurons", "mended_connections"):
        assert len(getattr(first, kind))
        assert getattr(first, kind) is getattr(second, kind)
    assert first.learning[0][0] is second.learning[0][0]
    assert first.clamps[0].neurons is second.clamps[0].neurons is first.lesioned_neurons
