"""Spikes of a run as events: all of them, whichever rows and states are kept, in each backend, file and recorder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime import c_backend
from neurovis_spec.runtime.columns import spiking_of
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.fitting import fitted
from neurovis_spec.runtime.journal import MAGIC
from neurovis_spec.runtime.recording import Recording

#: K's activity is its spike; H's is its potential; C counts as spiking without a spike block; O does not spike
SPEC = """\
neurovis: 1
name: three
time: {dt: 1 ms, steps: 150}
models:
  kicked:
    time: ms
    ports: [kicks]
    parameters: {tau: 20}
    state: {v: {derivative: (drive - v)/tau, jump: kicks}}
    spike: {when: v >= 1, set: {v: 0}, refractory: 2}
  shown: {time: ms, state: {v: {derivative: (drive - v)/10}}, spike: {when: v >= 1, set: {v: 0}}, activity: v}
  counter: {state: {c: {each_step: "0 if c >= 5 else c + 1"}}, activity: "1 if c >= 5 else 0", spikes: true}
neurons:
  K: {count: 3, model: kicked, bias: [1.3, 1.5, 0]}
  H: {count: 2, model: shown, bias: [1.2, 2]}
  C: {count: 1, model: counter}
  O: {count: 1}
connections: {K -> O: {weight: 1}, K -> K: {weight: 0.1, pattern: ring, port: kicks}}
outputs: {both: K + H}
"""
BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
NETWORK = nv.compile_text(SPEC)


def truth(steps: int = 150) -> list[tuple[int, int]]:
    """Every spike, by looking at each step."""
    run = NETWORK.run(steps, backend="reference", states=["K.spike + H.spike"])
    seen = np.hstack([run["K"], run["H.spike"], run["C"]])
    return [(int(step), int(neuron)) for step, neuron in np.argwhere(seen != 0)]


TRUTH = truth()


def spikes_of(recording: Recording) -> list[tuple[int, int]]:
    return list(zip(recording.spike_steps.tolist(), recording.spike_neurons.tolist(), strict=True))


def test_times_and_indices_of_any_reference() -> None:
    run = NETWORK.run(backend="reference")
    times, indices = run.spikes("K")
    found = zip(np.rint(times * 1000).tolist(), indices.tolist(), strict=True)
    assert list(found) == [one for one in TRUTH if one[1] < 3]
    np.testing.assert_array_equal(run.spikes("K2").times, times[indices == 1])
    assert set(run.spikes("K2").indices.tolist()) == {0}
    # in the order in which they are named
    np.testing.assert_array_equal(np.unique(run.spikes("H2 + K1..K2").indices), [0, 1, 2])
    assert len(run.spikes("both").times) == len([one for one in TRUTH if one[1] < 5])
    assert len(run.spikes("K3").times) == 0  # which never fires


def test_what_has_no_spikes_says_so() -> None:
    run = NETWORK.run(20, backend="reference")
    with pytest.raises(KeyError, match="no neuron, group or output 'L'"):
        run.spikes("L")
    with pytest.raises(KeyError, match="O1 does not spike"):
        run.spikes("K + O")
    part = NETWORK.run(20, backend="reference", neurons="K")
    with pytest.raises(KeyError, match="H1, H2 were not recorded"):
        part.spikes("H")
    quiet = nv.compile_text("neurovis: 1\nname: quiet\nneurons: {O: {count: 2}}\n").run(3, backend="reference")
    with pytest.raises(RecordingError, match="holds no spikes"):
        quiet.spikes("O")


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    "options", [{}, {"every": 7}, {"every": 1000}, {"states": ["K.v"]}, {"states": "all", "every": 3}]
)
def test_no_spike_is_thinned(backend: str, options: dict[str, object]) -> None:
    run = NETWORK.run(backend=backend, **options)  # type: ignore[arg-type]
    assert spikes_of(run) == TRUTH
    assert run.spike_range == (0, 150)
    whole = NETWORK.run(backend=backend, states=options.get("states", ()))  # type: ignore[arg-type]
    for own, every in zip(run.rows, whole.rows, strict=True):
        np.testing.assert_array_equal(own, every[run.step])


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_run_that_ends_early_has_the_spikes_up_to_there(backend: str) -> None:
    for every in (1, 50):
        run = NETWORK.run(backend=backend, until="k >= 120", every=every)
        assert spikes_of(run) == [one for one in TRUTH if one[0] <= 120]
        assert run.spike_range == (0, 121)


def test_spikes_of_some_neurons() -> None:
    run = NETWORK.run(backend="reference", neurons="H + K2", every=20)
    assert spikes_of(run) == [one for one in TRUTH if one[1] in (1, 3, 4)]


def test_lesioned_and_clamped_neurons() -> None:
    """What is lesioned fires no more, whether its activity is its spike or not; what is clamped fires as it is held."""
    text = SPEC.replace("outputs:", "events: [{at: 100, lesion: K1 + H2}, {from: 100, clamp: {K3: 1}}]\noutputs:")
    for backend in ("reference", "numpy"):
        for every in (1, 9):
            run = nv.compile_text(text).run(backend=backend, every=every)
            after = [one for one in spikes_of(run) if one[0] >= 100]
            assert {0, 4}.isdisjoint(neuron for _, neuron in after)
            assert [step for step, neuron in after if neuron == 2] == list(range(100, 150))


@pytest.mark.parametrize("every", [1, 30])
def test_a_file_keeps_them(tmp_path: Path, every: int) -> None:
    NETWORK.run_to(tmp_path / "run.npz", backend="reference", every=every)
    read = nv.load(tmp_path / "run.npz")
    assert spikes_of(read) == TRUTH
    assert read.spike_range == (0, 150)
    read.save(tmp_path / "again.npz")
    assert spikes_of(nv.load(tmp_path / "again.npz")) == TRUTH
    arrays = np.load(tmp_path / "run.npz")
    assert arrays["spike_steps"].dtype == np.int16  # which is all that they need
    assert arrays["spike_neurons"].dtype == np.int8


def test_a_run_that_breaks_off_keeps_them(tmp_path: Path) -> None:
    def loop() -> None:
        with NETWORK.simulator(record=tmp_path / "run.npz", every=10) as simulation:
            for _ in range(121):
                simulation.step()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        loop()
    (part,) = tmp_path.iterdir()
    assert part.read_bytes().startswith(MAGIC)
    with pytest.warns(UserWarning, match="up to step 120"):
        read = nv.load(tmp_path / "run.npz")
    assert spikes_of(read) == [one for one in TRUTH if one[0] <= 120]


@pytest.mark.parametrize("record", ["", "run.npz"])
def test_a_loop_records_them(tmp_path: Path, record: str) -> None:
    with NETWORK.simulator(record=tmp_path / record if record else True, every=13) as simulation:
        for _ in range(100):
            simulation.step()
        assert spikes_of(simulation.recording) == [one for one in TRUTH if one[0] < 100]
    assert spikes_of(simulation.recording) == [one for one in TRUTH if one[0] < 100]


def test_parts_of_a_run_by_checkpoints_have_them_all(tmp_path: Path) -> None:
    parts = [NETWORK.run(75, backend="reference", every=7, checkpoint=tmp_path / "state") for _ in range(2)]
    assert [spike for part in parts for spike in spikes_of(part)] == TRUTH
    assert [part.spike_range for part in parts] == [(0, 75), (75, 150)]


def test_some_rows_have_the_spikes_of_their_steps() -> None:
    run = NETWORK.run(backend="reference", every=10)
    part = run.part(slice(5, 8))
    assert spikes_of(part) == [one for one in TRUTH if 50 <= one[0] < 80]
    assert part.spike_range == (50, 80)
    assert spikes_of(run.part(slice(0))) == []
    assert spikes_of(run.part(slice(None))) == TRUTH


def test_tables_and_old_files_tell_what_their_rows_tell(tmp_path: Path) -> None:
    """A .csv or .mcap holds activities alone, which tell nothing of H unless its state is there."""
    run = NETWORK.run(backend="reference")
    for name in ("run.csv", "run.mcap"):
        run.save(tmp_path / name)
        read = nv.load(tmp_path / name)
        with pytest.raises(RecordingError, match="holds no spikes"):
            read.spikes("K")
        known = fitted(read, NETWORK.network)
        assert spikes_of(known) == [one for one in TRUTH if one[1] not in (3, 4)]
    old = replace(NETWORK.run(backend="reference", states=["H.spike"]), spiking=None)
    assert spikes_of(fitted(old, NETWORK.network)) == TRUTH


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"spike_neurons": np.array([6])}, "does not spike"),
        ({"spike_steps": np.array([900])}, "order of their steps"),
        ({"spike_steps": np.array([3, 4])}, "do not agree"),
        ({"spike_range": np.array([0])}, "not when"),
        ({"spiking": np.array([99])}, "outside"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path: Path, change: dict[str, np.ndarray], message: str) -> None:
    NETWORK.run_to(tmp_path / "run.npz", 10, backend="reference")
    arrays = dict(np.load(tmp_path / "run.npz"))
    arrays |= {"spike_steps": np.array([5]), "spike_neurons": np.array([0])} | change
    np.savez(tmp_path / "run.npz", **arrays)
    with pytest.raises(RecordingError, match=message):
        nv.load(tmp_path / "run.npz")


def test_a_written_activity_that_is_the_spike_is_one() -> None:
    """As one that is not written: it is drawn as spikes, and connections wait for those of what fires alone."""
    written = nv.compile_text(SPEC.replace("refractory: 2}", "refractory: 2}\n    activity: spike"))
    for network in (NETWORK.network, written.network):
        assert network.spikes.tolist() == [True] * 3 + [False] * 4
        assert spiking_of(network).by_activity.tolist() == [0, 1, 2, 5]
        assert spiking_of(network).by_state.tolist() == [3, 4]
    assert spikes_of(written.run(backend="numpy")) == TRUTH


def test_where_the_last_step_alone_is_kept_spikes_are_not() -> None:
    run = NETWORK.run(backend="numpy", until="rate(K, last=20) > 1000", last=True)
    assert len(run) == 1
    assert run.spiking is None


@pytest.mark.parametrize("backend", BACKENDS)
def test_neurons_that_all_show_something_else_have_their_spikes(backend: str) -> None:
    text = SPEC[: SPEC.index("neurons:")] + "neurons: {H: {count: 20, model: shown, bias: 1.2}}\n"
    network = nv.compile_text(text)
    seen = np.argwhere(network.run(backend="reference", states=["H.spike"])["H.spike"] != 0)
    for every in (1, 50):
        assert spikes_of(network.run(backend=backend, every=every)) == [tuple(one) for one in seen.tolist()]


@pytest.mark.compiler
@pytest.mark.parametrize("every", [1, 7])
def test_c_notes_all_spikes_however_little_room_there_is(every: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends where its room does, and goes on from there; the neurons that spike are not the first."""
    monkeypatch.setattr(c_backend, "_MOST_NOTED", 1)
    text = SPEC.replace("  H: {count: 2, model: shown, bias: [1.2, 2]}\n  C: {count: 1, model: counter}\n", "")
    text = text.replace("outputs: {both: K + H}\n", "").replace("  O: {count: 1}\n", "")
    network = nv.compile_text(text.replace("neurons:\n", "neurons:\n  O: {count: 1, bias: 0.5}\n"))
    assert spiking_of(network.network).together == range(1, 4)
    expected = network.run(backend="reference", every=every)
    run = network.run(backend="c", every=every)
    assert len(spikes_of(run)) > 10
    assert spikes_of(run) == spikes_of(expected)
    np.testing.assert_array_equal(run["K"], expected["K"])
