"""A network that runs as a node is turned in its live page, between two of its steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from threading import Lock
from typing import cast

import numpy as np
import pytest

import neurovis_spec
from neurovis_spec.live.source import SourceError
from neurovis_spec.live.turns import TURNS, Feed, Hold, Learn, Lesion, Mend, Set, Turned
from neurovis_spec.ros.middleware import Node
from neurovis_spec.ros.received import ReceivedSource
from neurovis_spec.ros.steering import RunSteering, ViewSteering

SPEC = """
neurovis: 1
name: turned
parameters: {gain: {value: 0.5, min: 0, max: 2}, count: 2}
inputs: {target: {}, pair: {size: 2}}
neurons: {A: {input: target, activation: identity}, M: {count: count, input: pair}, B: {activation: identity}}
connections: {A -> B: gain, M -> B: {weight: 0.1, plasticity: hebbian}}
"""
NETWORK = neurovis_spec.compile_text(SPEC).network


def steering() -> tuple[RunSteering, ReceivedSource]:
    simulation = neurovis_spec.compile_text(SPEC).simulator("reference")
    made, source = RunSteering(simulation, Lock()), ReceivedSource(NETWORK)
    source.steer(made)
    return made, source


def test_what_arrives_takes_no_turns_by_itself() -> None:
    source = ReceivedSource(NETWORK)
    assert not source.capabilities.takes
    assert (source.parameters, source.fed, source.learning, source.turned) == ({}, {}, {}, ())
    with pytest.raises(SourceError, match="takes no turns"):
        source.turn(Set({"gain": 1.0}))


def test_parameters_are_set_within_their_bounds() -> None:
    made, source = steering()
    assert source.capabilities.takes == TURNS - {"weigh"}
    assert source.capabilities.arrives
    assert source.parameters == {"gain": 0.5}
    source.turn(Set({"gain": 1.5}))
    assert source.parameters == {"gain": 1.5} == made.parameters
    for values, said in (({"gain": 3.0}, "gain"), ({"count": 3.0}, "structure"), ({"gane": 1.0}, "gane")):
        with pytest.raises(SourceError, match=said):
            source.turn(Set(values))
    assert source.turned == (Turned(0, Set({"gain": 1.5})),)
    source.turn(Set({"gain": 1.0}))
    assert source.turned == (Turned(0, Set({"gain": 1.0})),)


def test_what_is_lesioned_and_clamped_is_seen_at_the_newest_step() -> None:
    made, source = steering()
    for step in range(3):
        source.hear_activity(step, step * 10**9, np.zeros(4))
    source.advance()
    source.turn(Lesion("A"))
    source.turn(Hold("M1", 0.5))
    seen = source.seen()
    assert seen.lesioned_neurons.tolist() == [True, False, False, False]
    assert seen.lesioned_connections.tolist() == [True, False, False]
    assert seen.clamped.tolist() == [False, True, False, False]
    source.go(0)
    assert not source.seen().lesioned_neurons.any()
    source.turn(Mend("A"))
    assert not made.touched[0].any()
    with pytest.raises(SourceError, match="Z"):
        source.turn(Lesion("Z"))


def test_rules_are_stopped_and_inputs_fed() -> None:
    made, source = steering()
    assert source.learning == {"M -> B": True}
    source.turn(Learn("M -> B", False))
    assert source.learning == {"M -> B": False}
    source.turn(Feed("target", (0.25,)))
    source.turn(Feed("pair", (0.5,)))
    assert source.fed == {"target": (0.25,), "pair": (0.5, 0.5)} == made.fed
    source.turn(Feed("target"))
    assert source.fed == {"pair": (0.5, 0.5)}
    with pytest.raises(SourceError, match="takes 2 numbers, not 3"):
        source.turn(Feed("pair", (1.0, 2.0, 3.0)))


class Elsewhere:
    """A node that meets another one, which has parameters, and refuses some values."""

    def __init__(self, values: Mapping[str, float] | None) -> None:
        self.values = None if values is None else dict(values)

    def parameters_of(self, node: str, names: Sequence[str]) -> Mapping[str, float] | None:
        assert node == "/neurovis/turned"
        return None if self.values is None else {name: self.values[name] for name in names if name in self.values}

    def set_parameters_of(self, node: str, values: Mapping[str, float]) -> str | None:
        if self.values is None or any(value == 0.125 for value in values.values()):
            return f"{node} says no"
        self.values |= values
        return None


def elsewhere(values: Mapping[str, float] | None) -> tuple[Elsewhere, ViewSteering]:
    node = Elsewhere(values)
    return node, ViewSteering(NETWORK, cast(Node, node), "/neurovis/turned")


def test_the_parameters_of_a_network_elsewhere_are_set() -> None:
    node, made = elsewhere({"gain": 0.5, "count": 2.0})
    assert made.look()
    assert made.parameters == {"gain": 0.5}
    made.turn(Set({"gain": 1.5}))
    assert made.parameters == {"gain": 1.5} == {"gain": node.values and node.values["gain"]}
    node.values = {"gain": 0.25}
    assert made.look()
    assert made.parameters == {"gain": 0.25}


def test_what_a_network_elsewhere_does_not_take_is_refused() -> None:
    node, made = elsewhere({"gain": 0.5})
    assert made.look()
    for turn, said in (
        (Set({"gain": 3.0}), "gain"),
        (Set({"gain": 0.125}), "says no"),
        (Set({"count": 3.0}), "structure"),
        (Set({"gane": 1.0}), "gane"),
        (Lesion("A"), "nothing else"),
        (Feed("target", (1.0,)), "nothing else"),
    ):
        with pytest.raises(SourceError, match=said):
            made.turn(turn)
    assert (node.values, made.parameters) == ({"gain": 0.5}, {"gain": 0.5})
    assert (made.fed, made.learning) == ({}, {"M -> B": True})
    nothings: tuple[dict[str, float] | None, ...] = (None, {})
    for nothing in nothings:
        _, made = elsewhere(nothing)
        assert not made.look()
        with pytest.raises(SourceError, match="does not offer 'gain'"):
            made.turn(Set({"gain": 1.0}))
