"""What arrives, as the live page shows it: the newest, and back over what came."""

from __future__ import annotations

import struct
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from click.testing import CliRunner, Result

import neurovis_spec as nv
from neurovis_spec.analysis import group_firing
from neurovis_spec.arrays import FloatArray
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.live.commands import Pause, Play, Seek, Step
from neurovis_spec.live.history import Bins, Members
from neurovis_spec.live.run import Run, Shown
from neurovis_spec.live.source import Reach, SourceError
from neurovis_spec.live.view import view_of
from neurovis_spec.ros.accept import ARRAY
from neurovis_spec.ros.bags import read_bag
from neurovis_spec.ros.files import Files, Rotation
from neurovis_spec.ros.listening import Listening, Wanted
from neurovis_spec.ros.logs import Stored
from neurovis_spec.ros.middleware import Arrival
from neurovis_spec.ros.received import ReceivedSource
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.fitting import fitted
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.wire import ENCODINGS, ArrayForm, label_of, text_message
from neurovis_spec.scene.fading import snapshots_of

SPEC = """
neurovis: 1
name: x
time: {dt: 0.5}
neurons: {A: {count: 2, initial: 0}, O: {initial: 0}}
connections: {A -> O: {weight: 0.5, plasticity: {oja: {rate: 0.1}}}, O -> A1: 0.25}
"""
SECOND = 10**9


@pytest.fixture(scope="module")
def compiled() -> nv.CompiledNetwork:
    return nv.compile_text(SPEC)


@pytest.fixture
def source(compiled: nv.CompiledNetwork) -> ReceivedSource:
    return ReceivedSource(compiled.network)


def come(source: ReceivedSource, seqs: range | list[int | None], start: int = 0) -> None:
    for number, seq in enumerate(seqs, start):
        source.hear_activity(seq, number * SECOND // 100, np.full(3, float(number)))


def test_the_newest_step_is_seen_and_the_others_are_skipped(source: ReceivedSource) -> None:
    assert source.step == 0
    assert not source.advance()
    come(source, range(100, 200))
    assert source.reach == Reach(0, 199)
    assert source.advance()
    assert not source.advance()
    assert (source.step, source.seen().snapshot.activity.tolist()) == (199, [99, 99, 99])
    source.seen()
    assert (source.came, source.shown, source.reach) == (100, 1, Reach(100, 199))


def test_one_can_go_back_and_on_in_its_own_time(source: ReceivedSource) -> None:
    come(source, range(500))
    source.advance()
    source.go(100)
    come(source, range(500, 600), 500)
    for _ in range(60):  # frames: a second
        assert source.advance()
    assert 198 <= source.step <= 200
    assert source.number_after(-10) == source.step - 10
    assert source.number_after(10**6) == 599
    with pytest.raises(SourceError, match="from step 0 to 599"):
        source.go(600)
    source.go(599)
    come(source, range(600, 603), 600)
    source.advance()
    assert source.step == 602


def test_steps_ascend_whatever_their_numbers_do(source: ReceivedSource) -> None:
    come(source, [5, 6, None, 9, 3, 4, 1 << 60, (1 << 60) + 1, 0])
    steps = [row.step for row in source._rows]
    assert steps[:4] == [5, 6, 7, 9]
    assert steps == sorted(set(steps))
    assert len(steps) == 9
    assert steps[-1] < 1 << 53


def test_no_more_is_kept_than_there_is_room_for(compiled: nv.CompiledNetwork) -> None:
    source = ReceivedSource(compiled.network, room=100_000)
    come(source, range(5000))
    reach = source.reach
    assert source.advance()
    assert source.reach.last == 4999
    assert 100 < reach.last - source.reach.first < 400
    source.go(source.reach.first)
    come(source, range(5000, 9000), 5000)
    assert source.seen().snapshot.step == source.step  # what is shown stays
    assert source.advance()
    assert source.step >= 8000


@pytest.mark.parametrize("first", ["activity", "weights"])
def test_weights_are_those_of_their_step(source: ReceivedSource, first: str) -> None:
    for seq in range(5):
        weights = np.array([seq + 0.5, seq + 0.25])
        if first == "weights":
            source.hear_weights(seq, weights)
        source.hear_activity(seq, seq, np.zeros(3))
        if first == "activity":
            source.hear_weights(seq, weights)
    source.go(3)
    snapshot = source.seen().snapshot
    assert snapshot.weights.tolist() == [3.5, 3.25, 0.25]
    assert snapshot.previous_weights is not None
    assert snapshot.previous_weights.tolist() == [2.5, 2.25, 0.25]


def test_traces_are_read_of_what_came(source: ReceivedSource) -> None:
    for seq in (0, 1, 2, 6, 7):
        source.hear_activity(seq, seq, np.full(3, float(seq)))
        source.hear_weights(seq, np.full(2, seq + 0.5))
    source.hear_activity(8, 8, np.zeros(3))
    bins = Bins(0, 1, 9)
    nan = float("nan")
    found = source.history.read(Members("neurons", np.array([1])), bins)
    assert np.array_equal(found[:, 0], [0, 1, 2, nan, nan, nan, 6, 7, nan], equal_nan=True)
    found = source.history.read(Members("connections", np.array([0]), "sum"), bins)
    assert np.array_equal(found[:, 1], [0.5, 1.5, 2.5, nan, nan, nan, 6.5, 7.5, nan], equal_nan=True)


def until(true: Callable[[], bool]) -> None:
    end = time.monotonic() + 20
    while not true():
        assert time.monotonic() < end
        time.sleep(0.002)


def test_a_slow_display_stands_beside_a_complete_recorder(compiled: nv.CompiledNetwork, tmp_path: Path) -> None:
    network = compiled.network
    listening = Listening(compiled, 2, Wanted(tmp_path / "x.mcap", shown=True), print)
    assert listening.source is not None
    slow = list[int]()

    def show(shown: Shown) -> None:
        time.sleep(0.1)
        slow.append(shown.glance.step)

    run = Run(listening.source, view_of(compiled, compiled.gains_for(None)), show)
    listening.start()
    run.start()
    forms = {"activity": 3, "weights": 2}
    for step in range(4000):
        for name, size in forms.items():
            data = ArrayForm.of(label_of(network.hash), size, "cdr").message(
                step, step / 1000, np.full(size, float(step))
            )
            listening.put(f"/neurovis/x/{name}", Arrival(data, step * 10**6, None, ARRAY))
    until(lambda: bool(slow) and slow[-1] == 3999)
    run.end()
    listening.end()
    for name in forms:
        assert (listening.counts[name].received, listening.counts[name].recorded) == (4000, 4000)
    assert sum(listening.shown) == 4000
    assert listening.shown[0] < 200
    found = [one for one in read_bag(tmp_path / "x.mcap").messages() if one.topic.name.endswith("weights")]
    assert [one.sequence for one in found] == list(range(4000))
    assert next(read_bag(tmp_path / "x.mcap").messages()).data == text_message(compiled.text(), "cdr")


def test_what_was_recorded_is_a_recording_of_the_network(compiled: nv.CompiledNetwork, tmp_path: Path) -> None:
    """It is drawn and gone on from as what ``neurovis run`` records."""
    made, path = compiled.run(200), tmp_path / "x.mcap"
    listening = Listening(compiled, 2, Wanted(path), print)
    listening.start()
    for row, step in enumerate(made.step.tolist()):
        for name, values in (("activity", made.activity[row]), ("weights", made.weights[row])):
            data = ArrayForm.of(label_of(made.hash), len(values), "cdr").message(step, 1e9 + step, values)
            listening.put(f"/neurovis/x/{name}", Arrival(data, step * 10**6, None, ARRAY))
    until(lambda: listening.counts["weights"].recorded == 200)
    with pytest.warns(UserWarning, match="breaks off"):
        assert len(nv.load(path)) == 200
    listening.end()
    read = nv.load(path)
    assert read.step.tolist() == made.step.tolist()
    assert np.array_equal(read.activity, made.activity)
    assert np.array_equal(read.weights, made.weights)
    assert (read.spec, read.hash) == (compiled.text(), made.hash)
    assert compiled.run(5, start=read).reached > 200


@pytest.mark.parametrize("ros", [1, 2])
def test_a_recording_of_either_ros_is_read_without_the_steps_that_were_lost(
    compiled: nv.CompiledNetwork, tmp_path: Path, ros: Literal[1, 2]
) -> None:
    made, path, encoding = compiled.run(50), tmp_path / "x.mcap", ENCODINGS[ros]
    listening = Listening(compiled, ros, Wanted(path), print)
    listening.start()
    for row in range(50):
        for name, values, lost in (("activity", made.activity[row], 7), ("weights", made.weights[row], 9)):
            data = ArrayForm.of(label_of(made.hash), len(values), encoding).message(row, 1e9 + row, values)
            if row != lost:
                listening.put(f"/neurovis/x/{name}", Arrival(data, row * 10**6, None, ARRAY))
    until(lambda: listening.counts["weights"].recorded == 49)
    listening.end()
    read, kept = nv.load(path), [row for row in range(50) if row not in (7, 9)]
    assert read.step.tolist() == kept
    assert np.array_equal(read.activity, made.activity[kept])
    assert np.array_equal(read.weights, made.weights[kept])
    assert (read.spec, read.hash) == (compiled.text(), made.hash)


def test_a_recording_of_arrays_without_labels_is_read(tmp_path: Path) -> None:
    """A controller that sends its activities alone."""
    bare, path = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {count: 3, bias: 1}}\n"), tmp_path / "x.mcap"
    listening = Listening(bare, 2, Wanted(path), print)
    listening.start()
    for row in range(4):
        data = b"\0\1\0\0" + struct.pack("<IIIIddd", 0, 0, 3, 0, row, 1.0, 2.0)
        listening.put("/neurovis/x/activity", Arrival(data, row * 10**6, None, ARRAY))
    until(lambda: listening.counts["activity"].recorded == 4)
    listening.end()
    read = nv.load(path)
    assert read.step.tolist() == [0, 1, 2, 3]
    assert read.activity.tolist() == [[row, 1.0, 2.0] for row in range(4)]


def test_a_live_run_follows_pauses_and_goes_back(compiled: nv.CompiledNetwork, source: ReceivedSource) -> None:
    shown = list[Shown]()
    run = Run(source, view_of(compiled, compiled.gains_for(None)), shown.append)
    run.start()
    try:
        come(source, range(50))
        until(lambda: bool(shown) and shown[-1].glance.step == 49)
        assert shown[-1].status.playing
        assert not shown[-1].status.ended
        count = len(shown)
        come(source, range(50, 80), 50)
        until(lambda: shown[-1].glance.step == 79)
        assert len(shown) - count <= 30
        run.ask(Pause())
        run.ask(Seek(10))
        until(lambda: shown[-1].glance.step == 10)
        come(source, range(80, 90), 80)
        run.ask(Step(1))
        until(lambda: shown[-1].glance.step == 11)
        run.ask(Seek(10**6))
        until(lambda: shown[-1].glance.step == 89)
        assert shown[-1].reach == Reach(0, 89)
        come(source, range(90, 95), 90)
        run.ask(Play())
        until(lambda: shown[-1].glance.step == 94)
    finally:
        run.end()
    assert run.failure is None
    assert source.came == 95
    assert 5 <= source.shown <= 95


GATES = """
neurovis: 1
name: x
time: {dt: 0.01}
models: {cell: {state: {v: {derivative: drive - v}}, activity: v}}
synapses: {gate: {state: {g: {initial: 0.5, derivative: pre.v - g}}, signal: weight*g*(1 - post.v)}}
neurons: {A: {model: cell, bias: 1}, B: {model: cell}, C: {}}
connections: {A -> B: {weight: 2, synapse: gate, delay: 2}, B -> A: {send: v, delay: 3}, B -> C: {plasticity: hebbian}}
"""


def test_synapses_whose_signals_do_not_come_are_shown_and_drawn_without(tmp_path: Path) -> None:
    """States and what is formed of them are not known of what comes; all else is."""
    gates = nv.compile_text(GATES)
    source, shown = ReceivedSource(gates.network), list[Shown]()
    run = Run(source, view_of(gates, gates.gains_for(None)), shown.append)
    run.start()
    try:
        come(source, range(9))
        until(lambda: bool(shown) and shown[-1].glance.step == 8)
    finally:
        run.end()
    assert run.failure is None
    made, path = gates.run(20), tmp_path / "x.mcap"
    listening = Listening(gates, 2, Wanted(path), print)
    listening.start()
    for row in range(20):
        for name, values in (("activity", made.activity[row]), ("weights", made.weights[row])):
            data = ArrayForm.of(label_of(made.hash), len(values), "cdr").message(row, 1e9 + row, values)
            listening.put(f"/neurovis/x/{name}", Arrival(data, row * 10**6, None, ARRAY))
    until(lambda: listening.counts["weights"].recorded == 20)
    listening.end()
    read = nv.load(path)
    assert np.array_equal(read.activity, made.activity)
    with pytest.warns(RuntimeWarning, match=r"does not hold B\.v, \(A -> B\)\.signal, .* their lines have no colour"):
        gates.render(tmp_path / "x.svg", recording=read, step=19)
    assert "nan" not in (tmp_path / "x.svg").read_text()
    with pytest.warns(UserWarning, match="lacks states with a derivative, as of A, which begin anew"):
        assert gates.run(5, start=read).reached == 25


#: topic, step, values
Sent = tuple[str, int, FloatArray]


def rows_of(made: Recording, steps: range) -> list[Sent]:
    kinds = (("activity", made.activity), ("weights", made.weights))
    return [(name, step, of[step]) for step in steps for name, of in kinds]


def heard(listening: Listening, rows: Sequence[Sent]) -> None:
    """Messages come, a millisecond after each other, and are recorded."""
    listening.start()
    for number, (name, step, values) in enumerate(rows):
        form = ArrayForm.of(label_of(listening.compiled.hash), len(values), ENCODINGS[listening.ros])
        data = form.message(step, 1e9 + step, values)
        listening.put(f"/neurovis/x/{name}", Arrival(data, number * 10**6, None, ARRAY))
    listening.end()
    assert sum(one.recorded for one in listening.counts.values()) == len(rows)


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(neurovis, [str(one) for one in arguments])


def test_of_a_controller_that_began_anew_each_run_is_a_recording(compiled: nv.CompiledNetwork, tmp_path: Path) -> None:
    """Topics come each in its own time: the last weights of a run may come when the next one has begun."""
    made, path = compiled.run(60), tmp_path / "x.mcap"
    first, second = rows_of(made, range(40)), rows_of(made, range(60))
    heard(
        Listening(compiled, 2, Wanted(path), print),
        [*first[:-1], second[0], first[-1], *second[1:], *rows_of(made, range(20))],
    )
    told = r"holds 3 runs.*\(run 1: steps 0 to 39, run 2: steps 0 to 59, run 3: steps 0 to 19\): the last is read"
    with pytest.warns(UserWarning, match=told):
        assert len(nv.load(path)) == 20
    for number, steps in ((1, 40), (2, 60), (3, 20)):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            read = nv.load(path, run=number)
        assert read.step.tolist() == list(range(steps))
        assert np.array_equal(read.activity, made.activity[:steps])
        assert np.array_equal(read.weights, made.weights[:steps])
    with pytest.raises(RecordingError, match=r"x\.mcap: there is no run 4: it holds 3 runs"):
        nv.load(path, run=4)
    made.save(tmp_path / "x.npz")
    assert len(nv.load(tmp_path / "x.npz", run=1)) == 60
    with pytest.raises(RecordingError, match="there is no run 2: it holds one run"):
        nv.load(tmp_path / "x.npz", run=2)


def test_commands_take_the_last_run_and_say_so_or_the_one_that_is_named(
    compiled: nv.CompiledNetwork, tmp_path: Path
) -> None:
    made, path, spec = compiled.run(60), tmp_path / "x.mcap", tmp_path / "x.yaml"
    spec.write_text(SPEC)
    heard(Listening(compiled, 2, Wanted(path), print), [*rows_of(made, range(60)), *rows_of(made, range(20))])
    done = invoke("render", spec, "--recording", path, "--run", 1, "-o", tmp_path / "x.svg")
    assert (done.exit_code, done.stderr) == (0, "")
    assert "step 59" in (tmp_path / "x.svg").read_text()
    done = invoke("render", spec, "--recording", path, "-o", tmp_path / "y.svg")
    assert done.exit_code == 0
    assert "holds 2 runs" in done.stderr
    assert "--run N" in done.stderr
    assert "step 19" in (tmp_path / "y.svg").read_text()
    done = invoke("analyze", spec, "--recording", path, "--run", 3, "-o", tmp_path / "readings")
    assert (done.exit_code, "there is no run 3" in done.stderr) == (1, True)
    done = invoke("render", spec, "--run", 2, "-o", tmp_path / "z.svg")
    assert (done.exit_code, "--recording" in done.stderr) == (2, True)


@pytest.mark.parametrize(("name", "ros"), [("x.mcap", 2), ("x.bag", 1), ("x", 2)])
def test_the_files_of_a_recording_are_read_as_one(
    compiled: nv.CompiledNetwork, tmp_path: Path, name: str, ros: Literal[1, 2]
) -> None:
    made, path = compiled.run(1000), tmp_path / name
    listening = Listening(compiled, ros, Wanted(path, Rotation(size=60_000)), print)
    heard(listening, rows_of(made, range(1000)))
    assert len(listening.paths) > 2
    read = nv.load(path)
    assert read.step.tolist() == list(range(1000))
    assert np.array_equal(read.activity, made.activity)
    assert np.array_equal(read.weights, made.weights)
    assert (read.spec, read.hash, read.dt) == (compiled.text(), made.hash, made.dt)
    assert compiled.run(5, start=read).reached > 1000
    spec = tmp_path / "x.yaml"
    spec.write_text(SPEC)
    done = invoke("render", spec, "--recording", path, "--step", 999, "-o", tmp_path / "x.svg")
    assert (done.exit_code, done.stderr) == (0, "")


def test_a_bag_of_other_messages_is_read_without_them_or_refused(compiled: nv.CompiledNetwork, tmp_path: Path) -> None:
    made, path = compiled.run(10), tmp_path / "x.bag"
    other = nv.compile_text(SPEC.replace("0.25", "0.5"))
    listening = Listening(compiled, 1, Wanted(path), print)
    heard(listening, rows_of(made, range(10)))
    bag = read_bag(path)
    files = Files(tmp_path / "u.bag", 1, {})
    files.write([one._replace(topic=one.topic._replace(name=f"/robot{one.topic.name}")) for one in bag.messages()])
    files.close()
    assert np.array_equal(nv.load(tmp_path / "u.bag").activity, made.activity), "whatever the topics are called"
    (spec, *_), topic = bag.messages(), bag.topics[1]
    foreign = ArrayForm.of(label_of(other.hash), 3, "ros1").message(5, 5.0, np.zeros(3))
    files = Files(tmp_path / "y.bag", 1, {})
    files.write([spec, *(one for one in bag.messages() if one != spec), Stored(topic, 0, 10**9, 10**9, foreign)])
    files.close()
    with pytest.warns(UserWarning, match="1 messages are left out"):
        assert np.array_equal(nv.load(tmp_path / "y.bag").activity, made.activity)
    files = Files(tmp_path / "z.bag", 1, {})
    files.write([one for one in bag.messages() if one.topic == topic])
    files.close()
    with pytest.raises(RecordingError, match="no topic 'spec' is in it"):
        nv.load(tmp_path / "z.bag")
    with pytest.raises(RecordingError, match="there is no such file"):
        nv.load(tmp_path / "nothing")
    with pytest.raises(RecordingError, match=r"no format has the suffix '\.bag'"):
        made.save(tmp_path / "w.bag")


def test_the_last_steps_are_recalled_and_it_goes_on_with_the_newest(source: ReceivedSource) -> None:
    come(source, [0, 1, 2, 5, 6, 7])
    source.advance()
    come(source, [8], 6)
    seen = source.recall(4)
    assert [one.snapshot.step for one in seen] == [2, 5, 6, 7]
    assert (source.step, source.shown) == (7, 1)
    assert source.advance()
    assert source.step == 8
    assert [one.snapshot.step for one in source.recall(100)] == [0, 1, 2, 5, 6, 7, 8]
    source.go(5)
    assert [one.snapshot.step for one in source.recall(2)] == [2, 5]


def test_spikes_come_as_activities_fade_and_are_measured(tmp_path: Path) -> None:
    """Of a network that spikes topics carry activities as ever; a picture and a measure know which are spikes."""
    spiking = nv.compile_text("""neurovis: 1
name: x
time: {dt: 1 ms, steps: 120}
models: {cell: {time: ms, state: {v: {derivative: (drive - v)/20}}, spike: {when: v >= 1, set: {v: 0}}}}
neurons: {K: {count: 2, model: cell, bias: [1.3, 1.7]}, O: {}}
connections: {K -> O: {weight: 1}}
""")
    made, path = spiking.run(), tmp_path / "x.mcap"
    source = ReceivedSource(spiking.network)
    listening = Listening(spiking, 2, Wanted(path), print)
    listening.start()
    for step in made.step.tolist():
        data = ArrayForm.of(label_of(made.hash), 3, "cdr").message(step, step / 1000, made.activity[step])
        listening.put("/neurovis/x/activity", Arrival(data, step * 10**6, None, ARRAY))
        source.hear_activity(step, step * 10**6, made.activity[step])
    until(lambda: listening.counts["activity"].recorded == 120)
    listening.end()
    source.advance()
    (wanted,) = snapshots_of(spiking.network, made, [119])
    seen = source.seen().snapshot.seen
    assert seen is not None
    assert seen.tolist() == pytest.approx(np.asarray(wanted.seen).tolist(), abs=2e-5)
    assert 0 < seen[0] < 1
    read = nv.load(path)
    with pytest.raises(RecordingError, match="holds no spikes"):
        read.spikes("K")
    known = fitted(read, spiking.network)
    np.testing.assert_array_equal(known.spikes("K").times, made.spikes("K").times)
    np.testing.assert_array_equal(group_firing(known), group_firing(made))
