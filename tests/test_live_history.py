"""Traces of the live view: what was noted is read as it was, in bins, in bounded memory, and after a branch anew."""

from __future__ import annotations

import gzip
import json
import struct

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.live.history import Bins, Members, Recorded, Ring
from neurovis_spec.live.protocol import (
    RASTER,
    TRACE,
    LookAt,
    ProtocolError,
    Trace,
    command_of,
    raster_message,
    trace_message,
)
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.turns import Hold, Set
from neurovis_spec.live.view import RASTER_ROWS, view_of

SPEC = """neurovis: 1
name: live
time: {dt: 0.05, steps: 40}
parameters: {pull: {value: 0.1, min: 0, max: 1}}
neurons:
  A: {count: 3, activation: tanh, bias: 0.4}
  B: {activation: tanh}
connections:
  A -> B: {weight: -0.5, plasticity: {hebbian: {rate: 0.05}}}
  B -> A: pull
"""
COMPILED = nv.compile_text(SPEC)
RECORDING = COMPILED.run(steps=40)


def neurons(*indices: int) -> Members:
    return Members("neurons", np.array(indices))


def connections(*indices: int) -> Members:
    return Members("connections", np.array(indices), "sum")


@pytest.mark.parametrize("recorded", [False, True])
def test_a_trace_is_what_a_run_records(recorded: bool) -> None:
    source: RecordedSource | SimulatedSource
    source = RecordedSource(COMPILED.network, RECORDING) if recorded else SimulatedSource(COMPILED.simulator())
    while source.step < 39:
        source.advance()
    each = Bins(0, 1, 40)
    for index in range(4):
        read = source.history.read(neurons(index), each)
        assert np.array_equal(read[:, 0], read[:, 1])
        assert np.allclose(read[:, 0], RECORDING.activity[:, index], rtol=1e-6)
    weights = np.array([RECORDING.snapshot(step).weights for step in range(40)])
    for index in range(6):
        assert np.allclose(source.history.read(connections(index), each)[:, 0], weights[:, index], rtol=1e-6)
    least, most = source.history.read(neurons(3), Bins(8, 4, 3)).T
    rows = RECORDING.activity[8:20, 3].reshape(3, 4)
    assert np.allclose(least, rows.min(axis=1), rtol=1e-6)
    assert np.allclose(most, rows.max(axis=1), rtol=1e-6)


def test_several_are_joined_and_what_is_unknown_is_no_number() -> None:
    history = Recorded(RECORDING)
    joined = history.read(neurons(0, 3), Bins(30, 1, 12))[:, 0]
    assert np.allclose(joined[:10], RECORDING.activity[30:, [0, 3]].mean(axis=1), rtol=1e-6)
    assert np.isnan(joined[10:]).all()
    total = history.read(connections(0, 5), Bins(30, 1, 1))[0, 0]
    assert total == pytest.approx(RECORDING.snapshot(30).weights[[0, 5]].sum(), rel=1e-6)


def test_a_ring_holds_the_latest_steps_in_bounded_memory() -> None:
    ring = Ring(2, 1, room=100 * 12)
    for step in range(5, 1000):
        ring.note(step, np.array([step, -step]), np.array([2.0]))
    first, last = ring.steps
    assert last == 999
    assert 70 < last - first <= 100
    read = ring.read(neurons(1), Bins(0, 1, 1200))[:, 0]
    assert np.isnan(read[:first]).all()
    assert read[first:1000].tolist() == [-step for step in range(first, 1000)]
    assert np.isnan(read[1000:]).all()


def test_a_ring_forgets_another_future_and_steps_noted_again_stay() -> None:
    ring = Ring(1, 0)
    for step in range(50):
        ring.note(step, np.array([1.0]), np.zeros(0))
    ring.note(20, np.array([9.0]), np.zeros(0))
    ring.cut(30)
    assert ring.steps == (0, 30)
    ring.note(31, np.array([2.0]), np.zeros(0))
    assert ring.read(neurons(0), Bins(19, 1, 14))[:, 0].tolist()[:13] == [1.0] * 12 + [2.0]
    ring.cut(-1)
    assert np.isnan(ring.read(neurons(0), Bins(0, 1, 50))).all()
    ring.note(7, np.array([3.0]), np.zeros(0))
    assert ring.steps == (7, 7)


def test_what_is_huge_or_no_number_is_read_without_a_warning() -> None:
    ring = Ring(2, 0)
    ring.note(0, np.array([1e300, np.nan]), np.zeros(0))
    ring.note(1, np.array([-1e300, 1.0]), np.zeros(0))
    assert ring.read(neurons(0), Bins(0, 2, 1)).tolist() == [[-np.inf, np.inf]]
    assert ring.read(neurons(1), Bins(0, 2, 1)).tolist() == [[1.0, 1.0]]


def test_a_turn_makes_another_future_in_traces() -> None:
    source = SimulatedSource(COMPILED.simulator())
    while source.step < 30:
        source.advance()
    before = source.history.read(neurons(0), Bins(0, 1, 31))
    source.go(10)
    assert np.array_equal(source.history.read(neurons(0), Bins(0, 1, 31)), before), "looking back forgets nothing"
    source.turn(Set({"pull": 0.9}))
    assert np.isnan(source.history.read(neurons(0), Bins(11, 1, 20))).all()
    source.go(10)
    while source.step < 30:
        source.advance()
    after = source.history.read(neurons(0), Bins(0, 1, 31))
    assert np.array_equal(after[:11], before[:11])
    assert (after[12:] != before[12:]).all()


def test_items_of_a_view_stand_for_what_is_gathered() -> None:
    text = SPEC + "render: {collapse: [A]}\n"
    compiled = nv.compile_text(text)
    view = view_of(compiled, compiled.gains)
    found = [view.members(item) for item in ("n0", "n1", "c0", "c1", "n2", "c2")]
    assert [None if one is None else (one.of, one.indices.tolist()) for one in found] == [
        ("neurons", [0, 1, 2]), ("neurons", [3]), ("connections", [0, 1, 2]), ("connections", [3, 4, 5]), None, None,
    ]  # fmt: skip


#: a synapse with a state, a rule with one, an output; nothing between A1 and C has a name
NAMED = """neurovis: 1
name: named
time: {dt: 0.1, steps: 20}
models: {cell: {state: {v: {derivative: drive - v}}, outputs: {twice: 2*v}, activity: v}}
synapses: {gate: {state: {g: {initial: 0.5, derivative: pre.v - g}}, signal: weight*g*(1 - post.v)}}
rules: {tracing: {state: {trace: {each_step: 0.9*trace + pre}}, weight: {each_step: weight + 0.01*trace}}}
neurons: {A: {count: 2, model: cell, bias: [0.4, 1]}, B: {model: cell, bias: 1}, C: {}}
connections:
  A -> B: {weight: 0.5, synapse: gate, plasticity: tracing}
  A1 -> C: 1
  B -> A1: {weight: 0.5, plasticity: tracing}
"""


@pytest.mark.parametrize("recorded", [False, True])
def test_states_outputs_and_signals_have_traces_by_their_names(recorded: bool) -> None:
    compiled = nv.compile_text(NAMED)
    made, view = compiled.run(states="all"), view_of(compiled, compiled.gains)
    source: RecordedSource | SimulatedSource
    source = RecordedSource(compiled.network, made) if recorded else SimulatedSource(compiled.simulator())
    while source.step < 19:
        source.advance()
    wanted = {"n0.v": "A1.v", "n1.twice": "A2.twice", "c0.g": "(A1 -> B).g", "c1.signal": "(A2 -> B).signal"}
    for item, name in {**wanted, "c1.trace": "(A2 -> B).trace", "c3.trace": "(B -> A1).trace"}.items():
        members = view.members(item)
        assert members is not None
        read = source.history.read(members, Bins(0, 1, 20))
        np.testing.assert_allclose(read[:, 0], made[name], rtol=1e-6)
        assert view.values(source.seen(), [item], source.quantities) == {item: made[name][-1]}
    for item in ("c2.signal", "n3.v", "c0.h", "c0.v", "n0.signal", "c9.g"):
        assert view.members(item) is None
        assert view.values(source.seen(), [item], source.quantities) == {}


FIRING = """neurovis: 1
name: firing
time: {dt: 1 ms, steps: 60}
models:
  cell:
    time: ms
    state: {v: {derivative: (drive - v)/20}}
    spike: {when: v >= 1, set: {v: 0}}
  shown: {time: ms, state: {v: {derivative: (drive - v)/5}}, spike: {when: v >= 1, set: {v: 0}}, activity: v}
modules: {leg: {neurons: {S: {model: cell, bias: 3}, G: {}, H: {count: 2, model: shown, bias: 2}}}}
neurons:
  E: {count: 3, model: cell, bias: 1.2 + i/2}
  M: {count: 150, model: cell, bias: 1.2 + i/50}
  Q: {}
instances: {left: {module: leg}}
render: {collapse: [left]}
"""


@pytest.mark.parametrize("recorded", [False, True])
def test_a_raster_has_a_row_for_each_neuron_that_fires(recorded: bool) -> None:
    """Of many, several share a row; of an instance that is collapsed it is that of its groups."""
    compiled = nv.compile_text(FIRING)
    run = compiled.run(60, backend="reference", states=["left.H.spike"])
    source = RecordedSource(compiled.network, run) if recorded else SimulatedSource(compiled.simulator())
    while source.step < 59:
        source.advance()
    view = view_of(compiled, compiled.gains)
    ids = {name: f"n{index}" for index, name in enumerate(view.drawn.network.neurons.names)}
    fired = {name: run[name] != 0 for name in ("E", "M")}
    fired["left"] = np.column_stack([run["left.S"] != 0, run["left.H.spike"] != 0])
    asked = ("E2", "E", ("E1", "E3")), ("M150", "M", ("M1", "M150")), ("left", "left", ("left.S", "left.H2"))
    for item, group, ends in asked:
        names, rows = view.raster(ids[item])
        assert names == ends
        parts = np.array_split(fired[group].astype(float), min(fired[group].shape[1], RASTER_ROWS), axis=1)
        for bins in (Bins(0, 1, 60), Bins(20, 7, 8)):
            message = raster_message(3, 5, names, [source.history.read(row, bins) for row in rows], bins)
            kind, version, place, first, every, count, told, words = struct.unpack_from("<BxHIdIIHH", message)
            assert (kind, version, place, first, every) == (RASTER, 3, 5, bins.first, bins.every)
            assert message[28 : 28 + words].decode().split("\n") == list(ends)
            cells = np.frombuffer(message[28 + words :], np.uint8).reshape(told, count)
            steps = np.arange(60)
            for row, part in zip(cells, parts, strict=True):
                for at, cell in enumerate(row.tolist()):
                    inside = (steps - bins.first) // bins.every == at
                    share = part[inside].mean(axis=1).max(initial=0.0)
                    assert cell == (np.ceil(254 * np.float32(share)) if inside.any() else 255)
    assert view.raster(ids["Q"]) == ((), ())
    assert view.raster("n9999") == ((), ())
    empty = raster_message(3, 5, (), (), Bins(0, 1, 4))
    assert struct.unpack_from("<BxHIdIIHH", empty)[-2:] == (0, 0)
    assert len(empty) == 28


def test_rasters_are_of_few_neurons() -> None:
    def asked(rasters: object) -> object:
        return command_of(
            json.dumps({"type": "trace", "items": [], "rasters": rasters, "first": 0, "every": 1, "bins": 1})
        )

    assert asked(["n0", "n7"]) == Trace((), Bins(0, 1, 1), ("n0", "n7"))
    for wrong in (["c0"], ["n0.spike"], [f"n{index}" for index in range(9)], "n0", [3]):
        with pytest.raises(ProtocolError):
            asked(wrong)


def test_traces_say_by_numbers_which_names_they_are_of() -> None:
    """As a page unpacks them: items, the numbers of names, then the ranges."""
    some, others = np.ones((2, 2), np.float32), np.zeros((2, 2), np.float32)
    data = trace_message(7, {(5, 0): some, (5, 3): others}, Bins(4, 2, 2))
    assert struct.unpack_from("<BxHIdII", data) == (TRACE, 7, 2, 4.0, 2, 2)
    assert np.frombuffer(data, "<u4", 4, 24).tolist() == [5, 5, 0, 3]
    assert np.frombuffer(data, "<f4", 8, 24 + 16).tolist() == [*[1] * 4, *[0] * 4]


@pytest.mark.parametrize(
    "item", ["c5.", "c5.g.h", "c5.1", ".g", "g", "(A -> B).g", "c5.g ", "c5.é", "c" + "5" * 10 + ".g"]
)
def test_what_is_no_id_with_a_name_is_refused(item: str) -> None:
    for message in (
        {"type": "look", "items": [item]},
        {"type": "trace", "items": [item], "first": 0, "every": 1, "bins": 1},
    ):
        with pytest.raises(ProtocolError, match="ids of neurons and connections"):
            command_of(json.dumps(message))


def test_ids_may_have_a_name() -> None:
    asked = command_of(json.dumps({"type": "look", "items": ["c5.signal", "n0.v", "c5", "c5.signal"]}))
    assert asked == LookAt(("c5.signal", "n0.v", "c5"))


def test_what_a_recording_does_not_hold_is_not_known() -> None:
    compiled = nv.compile_text(NAMED)
    source, view = RecordedSource(compiled.network, compiled.run()), view_of(compiled, compiled.gains)
    state, signal = view.members("c0.g"), view.members("c0.signal")
    assert state is not None
    assert signal is not None
    assert np.isnan(source.history.read(state, Bins(0, 1, 20))).all()
    assert np.isfinite(source.history.read(signal, Bins(0, 1, 20))).all(), "pictures need it"
    assert [*view.values(source.seen(), ["c0.g", "c0.signal", "c0"], source.quantities)] == ["c0.signal", "c0"]
    heard = Ring(4, 4)
    heard.note(0, np.zeros(4), np.zeros(4))
    assert np.isnan(heard.read(state, Bins(0, 1, 1))).all()


def test_the_page_knows_the_names_of_what_is_drawn_and_glyphs_have_those_of_their_members() -> None:
    compiled = nv.compile_text(NAMED)
    view = view_of(compiled, compiled.gains)
    names = [view.listed.lists[number] for number in view.listed.of.tolist()]
    of_connections = [("trace", "g", "signal")] * 2 + [(), ("trace",)]
    assert names == [*of_connections, *[("v", "twice")] * 3, ()]
    scene = json.loads(gzip.decompress(view.content))
    assert [tuple(scene["named"][number]) for number in scene["names"]] == names
    assert view.place("c1.signal") == (1, 3)
    assert view.place("n2.twice") == (6, 2)
    assert view.place("n2") == (6, 0)
    glyphs = nv.compile_text(NAMED + "render: {collapse: [A]}\n")
    view, source = view_of(glyphs, glyphs.gains), SimulatedSource(glyphs.simulator())
    source.advance()
    assert source.quantities is not None
    values = dict(zip(view.quantities.names, source.quantities.tolist(), strict=False))
    told = view.values(source.seen(), ["n0.v", "c0.signal", "c0.g", "c2.trace"], source.quantities)
    assert told["n0.v"] == (values["A1.v"] + values["A2.v"]) / 2
    assert told["c0.g"] == (values["(A1 -> B).g"] + values["(A2 -> B).g"]) / 2
    assert told["c0.signal"] == values["(A1 -> B).signal"] + values["(A2 -> B).signal"]
    assert told["c2.trace"] == values["(B -> A1).trace"]


def test_going_back_and_a_turn_say_the_quantities_of_the_step_that_is_shown() -> None:
    compiled = nv.compile_text(NAMED)
    made, view, source = (
        compiled.run(states="all"),
        view_of(compiled, compiled.gains),
        SimulatedSource(compiled.simulator()),
    )
    while source.step < 15:
        source.advance()
    for step in (4, 12):
        source.go(step)
        assert view.values(source.seen(), ["c0.g"], source.quantities)["c0.g"] == made["(A1 -> B).g"][step]
    source.turn(Hold("(A1 -> B).g", 3.0))
    source.advance()
    assert view.values(source.seen(), ["c0.g"], source.quantities)["c0.g"] == 3
