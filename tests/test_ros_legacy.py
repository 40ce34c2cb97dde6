"""The topics of the first NeuroVis become a network and a spec, whatever names they use."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.ros.legacy import (
    FLOATS,
    KINDS,
    TEXT,
    Kind,
    Legacy,
    LegacyListener,
    layer_pairs,
    numbers_of,
    positions,
    types_of,
)
from neurovis_spec.ros.listening import Listening, Wanted
from neurovis_spec.ros.middleware import Arrival, Arrived, Node
from neurovis_spec.runtime.wire import Encoding, WireError, text_message


def floats(values: list[float], encoding: Encoding) -> bytes:
    if encoding == "ros1":
        return struct.pack("<III", 0, 0, len(values)) + np.array(values, "<f4").tobytes()
    return b"\0\1\0\0" + struct.pack("<III", 0, 0, len(values)) + np.array(values, "<f4").tobytes()


def say(legacy: Legacy, kind: Kind, text: str) -> object:
    return legacy.hear(kind, text_message(text, "cdr"), "cdr", TEXT)


def controller() -> Legacy:
    """As the first NeuroVis is told of a network."""
    legacy = Legacy()
    say(legacy, "neuronName", "in_1/in_2/CPG-a/CPG-b/out/")
    say(legacy, "neuronPos", "in_1_1_0_2/in_2_1_1_2/CPG-a_2_0.5_2/out_7_-3/")
    say(legacy, "connections", "0,0,0.5,0,0, 0,0,0,-2,0, 0,0,1.5,0.2,0, 0,0,-0.2,1.5,0, 0,0,0,0,0")
    say(legacy, "connectionsLayers", "CPG-out/")
    return legacy


def test_a_controller_of_the_first_neurovis_becomes_a_spec() -> None:
    text = controller().spec("legacy")
    network = nv.compile_text(text).network
    assert network.neurons.names == ("in_1", "in_2", "CPG_a", "CPG_b", "out")
    assert network.neurons.labels == ("in_1", "in_2", "CPG-a", "CPG-b", "out")
    ends = zip(network.connections.sources.tolist(), network.connections.targets.tolist(), strict=True)
    assert dict(zip(ends, network.connections.weights.tolist(), strict=True)) == {
        (0, 2): 0.5, (1, 3): -2, (2, 2): 1.5, (2, 3): 0.2, (3, 2): -0.2, (3, 3): 1.5, (2, 4): 1, (3, 4): 1,
    }  # fmt: skip
    drawn = nv.compile_text(text).layout()
    assert [drawn.positions[name] for name in ("in_1", "in_2", "CPG_a", "out")] == [(0, 1), (1, 1), (0.5, 2), (7, -3)]


def test_a_spec_of_weights_that_came_lets_them_change() -> None:
    legacy = controller()
    assert np.array_equal(say(legacy, "weightsAll", "1 2 3 4 5 6 7 8"), np.arange(1.0, 9))  # type: ignore[arg-type]
    whole = say(legacy, "weightsAll", ";".join(str(k) for k in range(25)))
    assert np.array_equal(whole, [2, 8, 12, 13, 17, 18, 14, 19])  # type: ignore[arg-type]
    network = nv.compile_text(legacy.spec("legacy")).network
    assert len(network.changing) == 8
    nv.compile_text(legacy.spec("legacy")).run(3)


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (1, 3, 0, 2)])
def test_messages_may_come_in_any_order_and_again(order: tuple[int, ...]) -> None:
    texts: list[tuple[Kind, str]] = [
        ("neuronName", "A/B/"),
        ("neuronPos", "A_1_2/B_3_4/C_1_1"),
        ("connections", "0 1 0 0"),
        ("connectionsLayers", "B-A"),
    ]
    legacy = Legacy()
    for _ in range(3):
        for place in order:
            say(legacy, *texts[place])
    assert legacy.described
    assert legacy.edges == {(0, 1): 1, (1, 0): 1}
    assert legacy.positions == {"A": (1, 2), "B": (3, 4)}
    assert legacy.left_out == {"neuronName": 0, "neuronPos": 1, "connections": 0, "connectionsLayers": 0}


def test_entries_that_say_nothing_or_more_than_one_thing_are_left_out() -> None:
    assert positions("A_1_2/A_1/A_x_2/A_1_2_3_4/D_1_2/_1_2/A", ["A"]) == ({"A": (1, 2)}, 6)
    assert positions("A_1_2_3", ["A", "A_1"]) == ({"A_1": (2, 3)}, 0)
    names = ["a-b-c", "a", "b", "b-c"]
    pairs, bad = layer_pairs("a-b/a-b-c/a-x/ab/b-b", names)  # a to b-c, or a-b to c? there is no c
    assert bad == 2
    assert set(pairs) >= {(0, 2), (1, 3)}
    assert layer_pairs("a-b-c", ["a", "b-c", "a-b", "c"])[1] == 1


def test_numbers_come_as_arrays_and_as_texts() -> None:
    for encoding in ("ros1", "cdr"):
        one: Encoding = "ros1" if encoding == "ros1" else "cdr"
        assert numbers_of(floats([1, -2.5, 3], one), one, FLOATS).tolist() == [1, -2.5, 3]
        for text in ("1,-2.5,3", "1/-2.5/3/", "1; -2.5; 3", " 1\n-2.5 3 "):
            assert numbers_of(text_message(text, one), one, TEXT).tolist() == [1, -2.5, 3]
        for text in ("1_0", "0x1", "a", "1,b"):
            with pytest.raises(WireError):
                numbers_of(text_message(text, one), one, TEXT)


def test_lengths_must_agree() -> None:
    legacy = controller()
    assert say(legacy, "activity", "1,2,3,4") == "length"
    assert say(legacy, "connections", "1,2,3,4") == "length"
    assert say(legacy, "weightsAll", "1,2,3,4") == "length"
    activity = say(legacy, "activity", "1,nan,3,4,inf")
    assert np.array_equal(activity, [1, np.nan, 3, 4, np.inf], equal_nan=True)  # type: ignore[arg-type]
    assert types_of("activity") == (FLOATS, TEXT)
    assert types_of("neuronName") == (TEXT,)


def weights_of(compiled: nv.CompiledNetwork) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    return compiled.network.connections.weights.whole().astype(np.float32)


NAMES = st.text("ab1_-. é{}:#'\"on", min_size=1, max_size=7).filter(lambda name: "/" not in name)


@settings(max_examples=40, deadline=None)
@given(st.lists(NAMES, min_size=1, max_size=6), st.data())
def test_every_network_becomes_a_spec_that_validates(names: list[str], data: st.DataObject) -> None:
    legacy = Legacy()
    say(legacy, "neuronName", "/".join(names))
    n = len(legacy.names)
    weights = data.draw(st.lists(st.floats(width=32), min_size=n * n, max_size=n * n))
    legacy.hear("connections", floats(weights, "cdr"), "cdr", FLOATS)
    entries = [f"{name}_{data.draw(st.integers(0, 9))}_{data.draw(st.floats(width=16))}" for name in legacy.names]
    say(legacy, "neuronPos", "/".join(entries))
    legacy.weighted = data.draw(st.booleans())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compiled = nv.compile_text(legacy.spec("legacy"))
    assert compiled.warnings == ()
    assert compiled.network.neurons.labels == legacy.names
    assert len(compiled.network.connections) == len(legacy.edges) == sum(w != 0 and np.isfinite(w) for w in weights)
    assert np.array_equal(weights_of(compiled), np.array(list(legacy.edges.values()), np.float32))


ODD = st.text("AB_-/0123.,; \x00é", max_size=30)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(KINDS), ODD | st.binary(max_size=40)), max_size=20))
def test_hostile_messages_are_survived(sent: list[tuple[Kind, str | bytes]]) -> None:
    legacy = Legacy()
    for kind, what in [("neuronName", "A/A_B/A-B/B"), *sent]:
        data = text_message(what, "cdr") if isinstance(what, str) else what
        try:
            legacy.hear(kind, data, "cdr", TEXT if isinstance(what, str) else types_of(kind)[0])
        except WireError:
            continue
    if legacy.names:
        nv.compile_text(legacy.spec("legacy"))


class Controller:
    """A node that the topics of a controller of the first NeuroVis come to, as texts."""

    ros, encoding = 2, "cdr"

    def __init__(self) -> None:
        self._arrived: dict[str, Arrived] = {}
        self._time = 0

    def topics(self) -> Mapping[str, tuple[str, ...]]:
        return {f"/neurovis/{kind}": (TEXT,) for kind in KINDS}

    def subscription(self, topic: str, type_: str, quality: object, arrived: Arrived) -> SimpleNamespace:
        self._arrived[topic] = arrived
        return SimpleNamespace(topic=topic)

    def send(self, kind: Kind, *texts: str) -> None:
        for text in texts:
            self._time += 10**6
            self._arrived[f"/neurovis/{kind}"](Arrival(text_message(text, "cdr"), self._time, None, TEXT))


def listening_to(told: Callable[[str], None] = print, wanted: bool = True) -> tuple[Controller, LegacyListener]:
    node = Controller()
    listener = LegacyListener(cast(Node, node), "/neurovis", "old", told, wanted)
    listener.look()
    return node, listener


def test_what_comes_before_the_network_is_known_is_recorded_with_it(tmp_path: Path) -> None:
    node, listener = listening_to()
    node.send("activity", *(f"{number},0" for number in range(5)), "1,2,3")
    node.send("weightsAll", "1", "2")
    listener.hear(0.05)
    assert not listener.known
    node.send("neuronName", "A/B/")
    node.send("connections", "0,0.5,0,0")
    node.send("activity", "5,0")
    listener.hear(0.05)
    listener.know()
    compiled = listener.compiled()
    assert len(compiled.network.changing) == 1, "weights have come, so they change"
    listening = Listening(compiled, 2, Wanted(tmp_path / "x.mcap"), print)
    listening.start()
    listener.to(listening)
    node.send("activity", "6,0", "x")
    listener.hear(0.05)
    listening.end()
    listener.end()
    read = nv.load(tmp_path / "x.mcap")
    assert read.activity[:, 0].tolist() == [0, 1]
    assert read.weights.tolist() == [[1], [2]]
    counts = listener.counts["activity"]
    assert (counts.received, counts.recorded, counts.rejected["length"], counts.rejected["parse"]) == (9, 7, 1, 1)
    assert listener.counts["weightsAll"].recorded == 2


def test_no_more_waits_for_a_network_than_there_is_room_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("neurovis_spec.ros.legacy._WAITING", 10_000)
    node, listener = listening_to()
    node.send("activity", *["1,2"] * 1000)
    listener.hear(0.2)
    assert listener.counts["activity"].received == 1000
    assert 900 < listener.counts["activity"].lost < 1000
    listener.end()
    assert sum(listener.counts["activity"].rejected.values()) == 1000 - listener.counts["activity"].lost


def test_weights_that_come_late_are_rejected_and_told_of(tmp_path: Path) -> None:
    """What is recorded is of a network whose weights stay."""
    told = list[str]()
    node, listener = listening_to(told.append)
    node.send("neuronName", "A/B/")
    node.send("connections", "0,0.5,0,0")
    listener.hear(0.05)
    listener.know()
    listening = Listening(listener.compiled(), 2, Wanted(tmp_path / "x.mcap"), print)
    listening.start()
    listener.to(listening)
    node.send("weightsAll", "0.5", "0.25")
    node.send("neuronName", "A/B/C/")
    node.send("activity", "1,2,3")
    listener.hear(0.05)
    listening.end()
    listener.end()
    for kind, count in (("weightsAll", 2), ("activity", 1)):
        counts = listener.counts[kind]
        assert (counts.received, counts.recorded, counts.rejected["length"]) == (count, 0, count)
    assert sum("the network has changed" in line for line in told) == 1
