"""Recordings written while the network runs: the same as those saved at once, in memory that does not grow."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
from small_specs import compiled

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.network import Network
from neurovis_spec.interrupts import ENDING, Ended, deferred, raise_at_signals
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.memory import TooLargeError
from neurovis_spec.runtime.recording import Recording, after_rows, ended
from neurovis_spec.runtime.state import State
from neurovis_spec.runtime.stream import StoppedError
from neurovis_spec.runtime.watch import Watch

SPEC = """
parameters: {gain: 1}
inputs: {push: {size: 2}}
neurons: {A: {count: 2, input: push, activation: tanh}, B: {count: 3, bias: 0.1, noise: "normal(0, 0.1)"}}
connections:
  A -> B: {weight: "normal(0, 1)", pattern: all_to_all, plasticity: {hebbian: {rate: 0.001}}}
  B -> A: {weight: gain, pattern: all_to_all, delay: 3}
outputs: {y: B2}
events: [{at: 300, lesion: [B3]}]
"""


@pytest.fixture(scope="module")
def network() -> CompiledNetwork:
    return compiled(SPEC)


def assert_equal(one: Recording, other: Recording) -> None:
    assert one.neurons == other.neurons
    assert one.connection_names == other.connection_names
    assert one.dt == other.dt
    assert (one.reached, one.set_parameters) == (other.reached, other.set_parameters)
    for name in ("activity", "weights", "weights_static", "plastic", "sources", "targets", "delays", "step", "ranks",
                 "weights_after", "lesioned_neurons", "lesioned_connections"):  # fmt: skip
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name, strict=True)


@pytest.mark.parametrize(
    ("steps", "every"), [(0, 1), (1, 1), (255, 1), (256, 1), (700, 1), (700, 3), (700, 1000), (513, 256)]
)
@pytest.mark.parametrize("suffix", ["npz", "csv", "mcap"])
def test_what_is_streamed_is_what_is_saved(
    network: CompiledNetwork, tmp_path: Path, suffix: str, steps: int, every: int
) -> None:
    inputs = {"push": np.arange(20.0).reshape(10, 2) / 10}
    network.run(steps, inputs, every=every).save(tmp_path / f"saved.{suffix}")
    network.run_to(tmp_path / f"streamed.{suffix}", steps, inputs, every=every)
    if suffix == "csv":
        assert (tmp_path / "streamed.csv").read_bytes() == (tmp_path / "saved.csv").read_bytes()
    else:
        streamed, saved = nv.load(tmp_path / f"streamed.{suffix}"), nv.load(tmp_path / f"saved.{suffix}")
        assert_equal(streamed, saved)
        assert (streamed.views, streamed.hash, streamed.network) == (saved.views, saved.hash, saved.network)
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"saved.{suffix}", f"streamed.{suffix}"]


def test_numpy_reads_what_is_streamed(network: CompiledNetwork, tmp_path: Path) -> None:
    network.run_to(tmp_path / "x.npz", 600)
    with np.load(tmp_path / "x.npz") as arrays:
        assert arrays["activity"].shape == (600, 5)
        assert arrays["weights"].shape == (600, 6)
        assert arrays["step"].tolist() == list(range(600))
        assert float(arrays["dt"]) == 1
    with zipfile.ZipFile(tmp_path / "x.npz") as archive:
        assert archive.testzip() is None


def test_a_streamed_run_goes_on_from_another(network: CompiledNetwork, tmp_path: Path) -> None:
    first = network.run(400)
    network.run_to(tmp_path / "x.npz", 50, start=first)
    assert_equal(nv.load(tmp_path / "x.npz"), network.run(50, start=first))


@pytest.mark.parametrize(("suffix", "steps"), [("npz", 8000), ("csv", 300), ("mcap", 8000)])
def test_memory_does_not_grow_with_the_steps(tmp_path: Path, suffix: str, steps: int) -> None:
    """A recording of 128 MB in far less than that; of a table of 12 MB no more than a stretch is held."""
    wide = compiled("neurons: {A: {count: 2000, bias: 0.5}}\nconnections: {A -> A: {pattern: one_to_one}}")
    wide.run_to(tmp_path / f"x.{suffix}", 2)  # what is loaded for the first time does not count
    tracemalloc.start()
    try:
        wide.run_to(tmp_path / f"x.{suffix}", steps)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (tmp_path / f"x.{suffix}").stat().st_size > 5 * steps * 2000
    assert peak < 16_000_000


class _FailedError(Exception):
    pass


@pytest.mark.parametrize("suffix", ["npz", "csv", "mcap"])
def test_what_fails_leaves_what_was_there(network: CompiledNetwork, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"x.{suffix}"
    network.run_to(path, 10)
    before = path.read_bytes()

    told = list[int]()

    def stop(done: int, total: int) -> None:
        told.append(done)
        if done >= 512:
            raise _FailedError

    words = r"what was recorded, up to step \d+, is in .*part$"
    with pytest.warns(UserWarning, match=words) as caught, pytest.raises(_FailedError):
        network.run_to(path, 2000, progress=stop)
    assert f"up to step {told[-1] - 1}, is" in str(caught[0].message)
    assert path.read_bytes() == before
    part = tmp_path / f".x.{suffix}.part"
    assert sorted(tmp_path.iterdir()) == [part, path]
    wanted = _as_read(network.run(told[-1]), tmp_path.parent / f"y.{suffix}")
    if suffix == "mcap":  # what is true after the last step is said at the end alone
        wanted = ended(wanted, after_rows(wanted.step, wanted.weights))
    assert_equal(nv.load(part), wanted)


def _as_read(recording: Recording, path: Path) -> Recording:
    """What a format keeps of a recording."""
    recording.save(path)
    return nv.load(path)


@pytest.mark.parametrize(
    ("backend", "every", "made", "held"),
    [
        ("reference", 1, 601, "steps 0 to 600"),
        ("reference", 7, 601, "steps 0 to 595, one in 7"),
        ("reference", 1000, 601, "step 0"),
        ("numpy", 7, 768, "steps 0 to 763, one in 7"),
    ],
)
@pytest.mark.parametrize("suffix", ["npz", "csv", "mcap"])
def test_ctrl_c_keeps_the_steps_until_then(
    network: CompiledNetwork,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    suffix: str,
    backend: str,
    every: int,
    made: int,
    held: str,
) -> None:
    """Also those of a stretch that is not full, and the step, or the steps of one call, that are made just then; an
    older recording gives way to what can be read."""
    path = tmp_path / f"x.{suffix}"
    network.run_to(path, 10)
    network.run(made, every=every, backend=backend).save(tmp_path / f"whole.{suffix}")
    interrupt(monkeypatch, 600)
    with pytest.raises(StoppedError) as stopped:
        network.run_to(path, 2000, every=every, backend=backend)
    kept, whole = nv.load(path), nv.load(tmp_path / f"whole.{suffix}")
    assert len(kept) == stopped.value.rows == -(-made // every)
    if suffix == "npz":
        with zipfile.ZipFile(path) as archive:
            assert archive.testzip() is None
    assert_equal(kept, whole)
    assert str(stopped.value) == f"stopped at step {made}; {path} holds {held}"
    assert sorted(entry.name for entry in tmp_path.iterdir()) == [f"whole.{suffix}", f"x.{suffix}"]


def interrupt(monkeypatch: pytest.MonkeyPatch, at: int) -> None:
    """Have Ctrl-C come while a step is computed."""

    def check(self: Watch, state: State) -> None:
        if state.k > at:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("neurovis_spec.runtime.watch.Watch.check", check)


def test_ctrl_c_before_the_first_step_leaves_what_was_there(
    network: CompiledNetwork, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x.npz"
    network.run_to(path, 10)
    before = path.read_bytes()
    whole = Watch.__init__

    def interrupted(self: Watch, network: Network) -> None:
        signal.raise_signal(signal.SIGINT)
        whole(self, network)

    monkeypatch.setattr(Watch, "__init__", interrupted)
    with pytest.raises(KeyboardInterrupt) as caught:
        network.run_to(path, 2000)
    assert not isinstance(caught.value, StoppedError)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("number", ENDING)
@pytest.mark.usefixtures("signal_handlers")
def test_a_signal_waits_for_the_end_of_a_block_and_a_second_one_does_not(number: signal.Signals) -> None:
    done: list[object] = []

    def work(times: int) -> None:
        with deferred() as asked:
            for _ in range(times):
                signal.raise_signal(number)
                done.append(asked.number)
        done.append("never reached")

    raise_at_signals()
    during = {one: signal.getsignal(one) for one in ENDING}
    for times in (1, 2):
        with pytest.raises(Ended):
            work(times)
    assert {one: signal.getsignal(one) for one in ENDING} == during
    assert done == [number, number]


@pytest.mark.usefixtures("signal_handlers")
def test_a_signal_that_is_ignored_stays_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    raise_at_signals()
    with deferred() as asked:
        signal.raise_signal(signal.SIGHUP)
    assert not asked
    assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN


def test_the_exit_status_is_said_though_a_signal_came_in_code_made_from_text(tmp_path: Path) -> None:
    """Dataclasses make such code while the program is imported."""
    (tmp_path / "ends.py").write_text(
        "import os, signal, sys\n"
        "from neurovis_spec.interrupts import raise_at_signals\n"
        "raise_at_signals()\n"
        "try:\n"
        "    exec('os.kill(os.getpid(), signal.SIGINT)\\nfor _ in range(10**7): pass')\n"
        "except KeyboardInterrupt:\n"
        "    sys.exit(128 + signal.SIGINT)\n"
    )
    assert subprocess.run([sys.executable, "-m", "ends"], cwd=tmp_path).returncode == 128 + signal.SIGINT


def test_elsewhere_than_in_the_main_thread_nothing_waits() -> None:
    done = []

    def work() -> None:
        with deferred():
            done.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [signal.default_int_handler]


def test_a_disk_that_is_too_small_is_said_beforehand(
    network: CompiledNetwork, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def usage(path: Path) -> object:
        return type("Usage", (), {"free": 1_000_000})()

    monkeypatch.setattr("neurovis_spec.runtime.memory.shutil.disk_usage", usage)
    for suffix in ("npz", "csv"):
        with pytest.raises(TooLargeError, match=r"of the disk while it is written, and 976\.6 KiB are free") as refused:
            network.run_to(tmp_path / f"x.{suffix}", 10**12)
        assert "--every" in refused.value.hint
        network.run_to(tmp_path / f"y.{suffix}", 100)


def test_a_format_that_cannot_stream_saves(
    network: CompiledNetwork, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Plain:
        name = "plain"
        suffixes = frozenset({".plain"})

        def save(self, recording: Recording, path: Path) -> None:
            path.write_text(f"{len(recording)}")

        def load(self, path: Path) -> Recording:
            raise RecordingError("never")

    monkeypatch.setattr("neurovis_spec.runtime.stream.for_path", lambda path: Plain())
    network.run_to(tmp_path / "x.plain", 7)
    assert (tmp_path / "x.plain").read_text() == "7"
