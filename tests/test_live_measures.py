"""Measures that somebody types as curves of a live run, what episodes bring, and the traces of inputs and sensors."""

from __future__ import annotations

import asyncio
import gzip
import json
from queue import SimpleQueue

import numpy as np
import pytest
from toy_bodies import carted, registered

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.diagnostics import SpecError
from neurovis_spec.live.commands import Measure, Unmeasure
from neurovis_spec.live.curves import series_of
from neurovis_spec.live.history import Bins, History, Members
from neurovis_spec.live.hub import Client, Hub, Reception
from neurovis_spec.live.protocol import ProtocolError, command_of, measured_message
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.run import Run
from neurovis_spec.live.series import Episodes, Series, Steps
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import SourceError
from neurovis_spec.live.turns import Lesion, Set
from neurovis_spec.live.typed import MOST, Typed, findings
from neurovis_spec.live.view import KIND, KINDS, view_of

SPEC = """neurovis: 1
name: measured
time: {dt: 0.1, episode: 10}
parameters: {pull: {value: 0.1, min: 0, max: 1}}
inputs: {goal: {expression: 'sin(k/5)'}}
models: {cell: {state: {v: {derivative: drive - v}}, activity: v}}
rules: {paid: {signals: [reward], weight: {each_episode: weight + 0.01*reward}}}
neurons: {A: {count: 3, model: cell, bias: [0.4, 0.1, 1], input: goal}, B: {activation: tanh}, T: {input: goal}}
connections: {A -> B: {weight: 0.5, plasticity: {paid: {reward: T}}}, B -> A: pull}
"""
COMPILED = nv.compile_text(SPEC)
TEXTS = (
    "B - T", "pull*A2 + k", "rms(T - B, last=30)", "rms(T - B)", "count(A > 0.3)", "max(A.v, last=5) - A1.v",
    "mean(count(A > pull), last=7)",
)  # fmt: skip


def typed(*texts: str) -> dict[str, Series]:
    """What these texts measure, as m0, m1, …"""
    found = Typed()
    for text in texts:
        found = found.add(text, COMPILED.network)
    return dict(found.series)


def went(source: SimulatedSource, step: int) -> SimulatedSource:
    """Up to a step."""
    while source.step < step:
        source.advance()
    return source


def read(history: History, name: str, steps: int) -> FloatArray:
    return history.read(Members.of_series(name), Bins(0, 1, steps))[:, 0].astype(np.float64)


@pytest.mark.parametrize("recorded", [False, True])
def test_a_measure_is_at_each_step_what_it_is_of_a_recording(recorded: bool) -> None:
    """Whenever it was typed: what is known of the steps before that tells."""
    run, series = COMPILED.run(400, states="all"), typed(*TEXTS)
    source: RecordedSource | SimulatedSource
    if recorded:
        source = RecordedSource(COMPILED.network, run)
    else:
        source = went(SimulatedSource(COMPILED.simulator()), 250)
        source.history.follow(series)
        went(source, 399)
    source.history.follow(series)
    for number, text in enumerate(TEXTS):
        np.testing.assert_allclose(read(source.history, f"m{number}", 400), COMPILED.measure(text, run), 1e-5, 1e-6)


def test_with_a_turn_in_the_past_a_measure_goes_on_from_there_and_the_branch_keeps_its_own() -> None:
    series = typed(*TEXTS)
    source = went(SimulatedSource(COMPILED.simulator()), 1500)
    source.history.follow(series)
    before = {name: read(source.history, name, 1501) for name in series}
    source.go(1200)
    for turn in (Lesion("A2"), Set({"pull": 0.9})):
        source.turn(turn)
    went(source, 1500).history.follow(series)
    other = went(SimulatedSource(COMPILED.simulator()), 1200)
    for turn in (Lesion("A2"), Set({"pull": 0.9})):
        other.turn(turn)
    went(other, 1500).history.follow(series)
    left = source.futures.left
    assert left is not None
    for name in series:
        now = read(source.history, name, 1501)
        assert np.array_equal(now, read(other.history, name, 1501), equal_nan=True)
        assert not np.array_equal(now[1201:], before[name][1201:])
        assert np.array_equal(read(left.history, name, 1501)[1201:], before[name][1201:])
    source.switch(left.number)
    source.history.follow(series)
    went(source, 1600).history.follow(series)
    for name in series:
        assert np.array_equal(read(source.history, name, 1501), before[name], equal_nan=True)
        assert np.isfinite(read(source.history, name, 1601)[1501:]).all()


def test_a_measure_reaches_further_back_than_what_it_is_made_of() -> None:
    source = SimulatedSource(COMPILED.simulator())
    source.history._size = 600
    series = typed("B - T", "rms(T - B)")
    source.history.follow(series)
    went(source, 2000).history.follow(series)
    run = COMPILED.run(2001)
    for name, text in zip(series, ("B - T", "rms(T - B)"), strict=True):
        assert np.allclose(read(source.history, name, 2001), COMPILED.measure(text, run), 1e-4, 1e-6)
    source.go(1900)
    source.turn(Set({"pull": 0.1}))
    went(source, 2000).history.follow(series)
    assert np.allclose(read(source.history, "m1", 2001), COMPILED.measure("rms(T - B)", run), 1e-4, 1e-6)
    late = typed("rms(T - B)")
    source.history.follow(late)
    assert np.isnan(read(source.history, "m0", 2001)).all(), "of the whole run, whose beginning is not known any more"


def test_what_is_wrong_with_a_text_is_told_with_its_place() -> None:
    assert not findings("mean(A)", COMPILED.network)
    (found,) = findings("mean(hiden) + 1", COMPILED.network)
    message = json.loads(measured_message("mean(hiden) + 1", [found]))
    assert message["type"] == "measured"
    assert [message["findings"][0][key] for key in ("start", "end")] == [5, 10]
    for text in ("A", "rms(B, last=", "eval('1')", "rms(B, last=9999999)", "B.__class__"):
        assert findings(text, COMPILED.network), text
    with pytest.raises(SpecError):
        Typed().add("A +", COMPILED.network)


def test_a_run_has_as_many_measures_as_there_is_room_for_and_tells_all() -> None:
    view = view_of(COMPILED, COMPILED.gains)
    run = Run(SimulatedSource(COMPILED.simulator()), view, lambda shown: None)
    for number in range(MOST):
        run._carry_out(Measure(f"B + {number}"), lambda why: None)
    with pytest.raises(SourceError, match="16 measures already"):
        run._carry_out(Measure("B"), lambda why: None)
    run._carry_out(Measure("B + 3"), lambda why: None)
    run._carry_out(Unmeasure(0), lambda why: None)
    run._carry_out(Measure("B"), lambda why: None)
    assert run.shown().status.measures == (*((at, f"B + {at}") for at in range(1, MOST)), (MOST, "B"))
    other = nv.compile_text(SPEC.replace("B: {", "C: {").replace("A -> B", "A -> C").replace("B -> A", "C -> A"))
    source = SimulatedSource(other.simulator())
    run._carry_out(lambda _: (source, view_of(other, other.gains)), lambda why: None)
    assert run.shown().status.measures == (), "there is no B any more"


def test_a_measure_that_is_asked_for_before_there_is_a_picture_is_looked_at_like_any_other() -> None:
    async def main() -> None:
        view, hub = view_of(COMPILED, COMPILED.gains), Hub(asyncio.get_running_loop())
        run = Run(SimulatedSource(COMPILED.simulator()), view, hub.show, lambda: True, playing=False)
        reception, client = Reception(hub, run), Client(owner=True)
        hub.join(client)
        for text in ("mean(hiden)", "mean(A)"):
            reception.take(client, json.dumps({"type": "measure", "text": text}))
        answers = [json.loads(text) for text in client.texts]
        assert [(one["type"], one["text"], len(one["findings"])) for one in answers] == [
            ("measured", "mean(hiden)", 1),
            ("measured", "mean(A)", 0),
        ]
        asked: SimpleQueue[str] = SimpleQueue()
        run.start()
        try:
            run.ask(Measure("C"), asked.put)  # as of a spec that was edited meanwhile
            assert "C" in await asyncio.to_thread(asked.get, timeout=30)
        finally:
            run.end()
        assert run.shown().status.measures == ((0, "mean(A)"),)
        assert run.failure is None

    asyncio.run(main())


def test_a_recording_that_does_not_hold_what_a_measure_reads_refuses_it() -> None:
    view = view_of(COMPILED, COMPILED.gains)
    run = Run(RecordedSource(COMPILED.network, COMPILED.run(20)), view, lambda shown: None)
    run._carry_out(Measure("A1 - B"), lambda why: None)
    with pytest.raises(SourceError, match=r"A1\.v"):
        run._carry_out(Measure("A1.v"), lambda why: None)
    assert run.shown().status.measures == ((0, "A1 - B"),)


def test_messages_are_checked() -> None:
    assert command_of('{"type": "measure", "text": " B - T "}') == Measure("B - T")
    assert command_of('{"type": "unmeasure", "number": 3}') == Unmeasure(3)
    for wrong in ({"text": ""}, {"text": "a" * 501}, {"text": 3}, {}):
        with pytest.raises(ProtocolError):
            command_of(json.dumps({"type": "measure", **wrong}))


def test_the_reward_of_each_episode_is_a_curve_from_its_last_step_on() -> None:
    source = went(SimulatedSource(COMPILED.simulator()), 35)
    series = {name: one for name, (_, one) in series_of(COMPILED.network).items()}
    assert [told for told, _ in series_of(COMPILED.network).values()] == ["T an episode"]
    source.history.follow(series)
    rewards = COMPILED.run(36)["T"]
    expected = [*[np.nan] * 9, *np.repeat(rewards[[9, 19, 29]], 10)][:36]
    assert np.allclose(read(source.history, "e0", 36), expected, equal_nan=True)
    recorded = RecordedSource(COMPILED.network, COMPILED.run(36))
    recorded.history.follow(series)
    assert np.allclose(read(recorded.history, "e0", 36), expected, equal_nan=True)
    assert view_of(COMPILED, COMPILED.gains).curves.shown[-1].names == ("T an episode",)


@pytest.mark.parametrize(("taken", "expected"), [("last", 3.0), ("sum", 6.0), ("way", 5.0)])
def test_what_an_episode_brings_is_its_last_number_the_sum_or_how_far_it_came(taken: str, expected: float) -> None:
    numbers = np.array([[1.0, 1.0], [2.0, 9.0], [3.0, 1.0]]) if taken != "way" else np.array([[1, 1], [9, 9], [4, 5]])
    quantities = np.column_stack([[0, 0, 1], numbers])
    of = Episodes(np.arange(3), taken)  # type: ignore[arg-type] # pytest gives texts
    found = of.begin(0).rows(Steps(np.arange(3), np.zeros((3, 0)), quantities))
    assert np.isnan(found[:2]).all()
    assert found[2] == expected
    late = of.begin(7).rows(Steps(np.arange(7, 10), np.zeros((3, 0)), quantities))
    assert np.isnan(late[2]) == (taken != "last"), "it is not known when it began"


def test_inputs_and_sensors_have_traces(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch)
    compiled = carted()
    view, made = view_of(compiled, compiled.gains), compiled.run(30)
    assert made.sensors is not None
    names = json.loads(gzip.decompress(view.content))["beside"]
    assert tuple(names["sensors"]) == made.sensor_names
    source = went(SimulatedSource(compiled.simulator()), 29)
    recorded = RecordedSource(compiled.network, made)
    for one in (source, recorded):
        for at in range(len(made.sensor_names)):
            members = view.members(f"s{at}")
            assert members is not None
            assert np.allclose(one.history.read(members, Bins(0, 1, 30))[:, 0], made.sensors[:, at], rtol=1e-6)
    value = view.values(source.seen(), ["s0", "i0", "i99"], source.quantities)
    assert value["s0"] == made.sensors[29, 0]
    assert "i99" not in value
    given = compiled.run(30, states=[f"{names['inputs'][0]}.given"])[f"{names['inputs'][0]}.given"]
    members = view.members("i0")
    assert members is not None
    assert np.allclose(source.history.read(members, Bins(0, 1, 30))[:, 0], given, rtol=1e-6)
    assert view.place("s1") == (KINDS.index("s") << KIND | 1, 0)
    assert view.members("s99") is None
