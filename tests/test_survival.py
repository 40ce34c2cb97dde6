"""Recordings outlive the process that makes them: signals, kill -9, several writers of one file."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from small_specs import compiled

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.runtime import parts, record, stream
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.numpy_backend import NumpyStepper
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.state import State

SPEC = """\
neurovis: 1
name: long
time: {steps: 1000000}
neurons: {A: {count: 3, bias: 0.1, noise: "normal(0, 0.1)", activation: tanh}}
connections: {A -> A: {weight: 0.1, pattern: all_to_all, plasticity: {oja: {rate: 0.01}}}}
"""
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "long.yaml").write_text(SPEC)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def start(*arguments: object) -> subprocess.Popen[bytes]:
    slow = ("--backend", "numpy") if arguments[0] == "run" and "--backend" not in arguments else ()
    command = [sys.executable, "-m", "neurovis_spec", *map(str, arguments), *slow]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def called(*arguments: object) -> Result:
    """A command that nothing ends, in this process."""
    result = CliRunner().invoke(neurovis, [str(argument) for argument in arguments])
    assert result.exit_code == 0
    return result


def ended(process: subprocess.Popen[bytes], number: int) -> str:
    """What a process says on standard error when it is sent a signal."""
    process.send_signal(number)
    output, said = process.communicate(timeout=60)
    assert output == b""
    assert b"Traceback" not in said
    return said.decode()


def until_it_records(part: Path, size: int = 10_000) -> None:
    """Wait until there is something in a part."""
    for _ in range(3000):
        if part.exists() and part.stat().st_size > size:
            return
        time.sleep(0.01)
    raise AssertionError(f"{part} does not grow")


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def assert_begins_like_it(recording: Recording, backend: str = "numpy", every: int = 20) -> None:
    """The rows are those of a run that nobody has ended, one in ``every``; the first stretches are checked."""
    rows = min(len(recording), 100)
    whole = nv.compile("long.yaml").run(rows * every, every=every, backend=backend)
    assert rows > 0
    np.testing.assert_array_equal(recording.activity[:rows], whole.activity)
    np.testing.assert_array_equal(recording.weights[:rows], whole.weights)
    assert recording.step.tolist() == list(range(0, len(recording) * every, every))


@pytest.mark.parametrize(("number", "suffix"), [(signal.SIGINT, "csv"), *((number, "npz") for number in SIGNALS)])
def test_a_signal_ends_a_run_with_what_was_recorded(folder: Path, number: signal.Signals, suffix: str) -> None:
    process = start("run", "long.yaml", "--every", 20, "-o", f"x.{suffix}")
    until_it_records(folder / f".x.{suffix}.part")
    said = ended(process, number)
    recording = nv.load(f"x.{suffix}")
    assert process.returncode == 128 + number
    assert re.search(rf"stopped at step \d+; x\.{suffix} holds steps 0 to {recording.step[-1]}, one in 20\n", said)
    assert files(folder) == ["long.yaml", f"x.{suffix}"]
    assert_begins_like_it(recording)
    if suffix == "npz":
        assert 1 <= recording.reached - recording.step[-1] <= 20
        longer = nv.compile("long.yaml").run(recording.reached + 1, backend="numpy")
        np.testing.assert_array_equal(recording.weights_after, longer.weights[-1])


@pytest.mark.parametrize(("suffix", "wait"), [("npz", 0.0), ("npz", 0.1), ("csv", 0.1), ("mcap", 0.0)])
def test_what_is_killed_can_be_read_and_is_taken_over(folder: Path, suffix: str, wait: float) -> None:
    """The part is read, and the next run makes the file of it before it begins."""
    path, part = folder / f"x.{suffix}", folder / f".x.{suffix}.part"
    process = start("run", "long.yaml", "--every", 20, "-o", path.name)
    until_it_records(part)
    time.sleep(wait)
    ended(process, signal.SIGKILL)
    assert files(folder) == [part.name, "long.yaml"]
    with pytest.warns(UserWarning, match=r"its run did not come to its end; what was recorded, up to step"):
        read = nv.load(path)
    assert_begins_like_it(read)
    assert len(nv.load(part)) == len(read)
    again = called("run", "long.yaml", "--steps", 5, "-o", path.name)
    words = f"x.{suffix}: what an earlier run recorded before it broke off, up to step {read.step[-1]}, is in it"
    assert again.stderr == f"warning: {words} until this run is at its end\n"
    assert files(folder) == ["long.yaml", path.name]
    assert len(nv.load(path)) == 5


@pytest.mark.parametrize("suffix", ["npz", "csv", "mcap"])
def test_an_earlier_file_is_never_harmed(folder: Path, suffix: str) -> None:
    """A part of a later run beside it is told by whoever reads the file, and cleared by the next run."""
    path, part = folder / f"x.{suffix}", folder / f".x.{suffix}.part"
    network = nv.compile("long.yaml")
    network.run_to(path, 7)
    before = path.read_bytes()
    process = start("run", "long.yaml", "--every", 20, "-o", path.name)
    until_it_records(part)
    ended(process, signal.SIGKILL)
    assert path.read_bytes() == before
    with pytest.warns(UserWarning, match="is of an earlier run: a later run did not come to its end; what it recorded"):
        assert len(nv.load(path)) == 7
    with pytest.warns(
        UserWarning, match=r"what an earlier run recorded before it broke off, up to step \d+, is removed"
    ):
        network.run_to(path, 9)
    assert files(folder) == ["long.yaml", path.name]
    assert len(nv.load(path)) == 9


def test_what_was_taken_over_stays_when_the_next_run_is_killed_too(folder: Path) -> None:
    for wanted in ([], ["x.npz"]):
        process = start("run", "long.yaml", "--every", 20, "-o", "x.npz")
        for name in wanted:
            until_it_records(folder / name, 100)
        until_it_records(folder / ".x.npz.part")
        ended(process, signal.SIGKILL)
    assert files(folder) == [".x.npz.part", "long.yaml", "x.npz"]
    with pytest.warns(UserWarning, match="is of an earlier run"):
        assert_begins_like_it(nv.load("x.npz"))
    assert_begins_like_it(nv.load(".x.npz.part"))


@pytest.mark.parametrize("suffix", ["npz", "csv"])
def test_two_writers_do_not_destroy_each_other(folder: Path, suffix: str) -> None:
    path = folder / f"x.{suffix}"
    first = start("run", "long.yaml", "--every", 20, "-o", path.name)
    until_it_records(folder / f".x.{suffix}.part")
    second = start("run", "long.yaml", "--every", 20, "-o", path.name)
    until_it_records(folder / f".x.{suffix}.2.part")
    with pytest.warns(UserWarning, match="its run is still going on"):
        assert len(nv.load(path)) > 0
    assert called("run", "long.yaml", "--steps", 4, "-o", path.name).stderr == ""
    assert len(nv.load(path)) == 4
    for process in (first, second):
        ended(process, signal.SIGTERM)
        assert_begins_like_it(nv.load(path))
    assert files(folder) == ["long.yaml", path.name]


@pytest.mark.compiler
@pytest.mark.parametrize("number", SIGNALS[:2])
def test_many_steps_in_one_call_of_c_end_at_a_signal(folder: Path, number: signal.Signals) -> None:
    much = ("--backend", "c", "--steps", 10**9, "--every", 1000)
    process = start("run", "long.yaml", *much, "-o", "x.npz")
    until_it_records(folder / ".x.npz.part")
    assert "stopped at step" in ended(process, number)
    assert process.returncode == 128 + number
    assert_begins_like_it(nv.load("x.npz"), "c", 1000)
    assert files(folder) == ["long.yaml", "x.npz"]


def test_rows_are_written_at_least_every_quarter_of_a_second(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock on which each step takes 40 ms. Other backends make several at once, of tens of milliseconds."""
    network = compiled("neurons: {A: {bias: 1}}")
    now, lengths = [0.0], []

    def clock() -> float:
        now[0] += 0.04
        return now[0]

    handed = stream._BufferedRows.end

    def end(self: stream._BufferedRows, count: int) -> None:
        lengths.append(count)
        handed(self, count)

    monkeypatch.setattr(stream, "monotonic", clock)
    monkeypatch.setattr(stream._BufferedRows, "end", end)
    network.run_to(tmp_path / "x.npz", 300, backend="reference")
    assert sum(lengths) == 300
    assert max(lengths) * 0.04 <= 0.25
    assert len(nv.load(tmp_path / "x.npz")) == 300


@pytest.mark.parametrize("suffix", ["npz", "csv", "mcap"])
def test_a_part_is_read_up_to_its_last_whole_chunk_wherever_it_breaks_off(tmp_path: Path, suffix: str) -> None:
    network = compiled(
        "neurons: {A: {count: 3, bias: 0.1*i, activation: tanh}}\n"
        "connections: {A -> A: {weight: 1, pattern: all_to_all, plasticity: {oja: {rate: 0.001}}}}"
    )
    part = tmp_path / f".x.{suffix}.part"
    whole = _broken_off(network, part, 800)
    data, last = part.read_bytes(), 800
    for cut in range(len(data), 0, -max(1, len(data) // 60)):
        part.write_bytes(data[:cut])
        try:
            read = nv.load(part)
        except RecordingError:
            assert cut < len(data) / 10
            last = 0
            continue
        assert len(read) <= last
        last = len(read)
        np.testing.assert_array_equal(read.activity, whole.activity[:last])
        np.testing.assert_array_equal(read.weights, whole.weights[:last])
    assert last == 0


def _broken_off(network: CompiledNetwork, part: Path, steps: int) -> Recording:
    """Leave the part of a run that fails at the end."""

    def fail(done: int, total: int) -> None:
        if done == total:
            raise ZeroDivisionError

    target = parts.target_of(part)
    assert target is not None
    with pytest.warns(UserWarning, match="what was recorded"), pytest.raises(ZeroDivisionError):
        network.run_to(target, steps, progress=fail)
    return network.run(steps)


def test_a_damaged_part_is_read_as_far_as_it_agrees_or_refused(tmp_path: Path) -> None:
    network = compiled("neurons: {A: {count: 3, bias: 0.1*i}}")
    part = tmp_path / ".x.npz.part"
    whole = _broken_off(network, part, 5)
    data, refused, short = part.read_bytes(), 0, 0
    for place in range(0, len(data), 11):
        part.write_bytes(data[:place] + bytes([data[place] ^ 0xFF]) + data[place + 1 :])
        try:
            read = nv.load(part)
        except RecordingError:
            refused += 1
            continue
        short += len(read) < 5
        assert read.activity.tolist() == whole.activity[: len(read)].tolist()
    assert refused > short > 0


def test_a_new_recording_has_the_permissions_of_the_one_before(folder: Path) -> None:
    network = nv.compile("long.yaml")
    for name in ("x.npz", "x.csv", "x.layout.yaml"):
        Path(name).touch(mode=0o600)
        if name.endswith("yaml"):
            network.layout().save(name)
        else:
            network.run_to(name, 3)
        assert Path(name).stat().st_mode & 0o777 == 0o600
        assert Path(name).stat().st_size > 0
    umask = os.umask(0o027)
    try:
        network.run_to("y.npz", 3)
    finally:
        os.umask(umask)
    assert Path("y.npz").stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize(
    ("command", "number"), [*(("render", number) for number in SIGNALS), ("animate", signal.SIGTERM)]
)
def test_other_commands_end_at_a_signal_and_leave_nothing(folder: Path, command: str, number: signal.Signals) -> None:
    process = start(command, "long.yaml", "-o", "x.svg")
    while b"numpy" not in Path(f"/proc/{process.pid}/maps").read_bytes():  # then the process is at work
        time.sleep(0.01)
    said = ended(process, number)
    assert (process.returncode, said.strip()) == (128 + number, "stopped")
    assert files(folder) == ["long.yaml"]


@pytest.mark.parametrize("suffix", ["npz", "csv"])
def test_a_file_of_somebody_else_is_left_alone(tmp_path: Path, suffix: str) -> None:
    """It has the name of a part, and something else in it; what was begun and holds no step is cleared."""
    path, part = tmp_path / f"x.{suffix}", tmp_path / f".x.{suffix}.part"
    network = compiled("neurons: {A: {}}")
    part.write_bytes(b"somebody's own\n1\n2\n")
    with pytest.raises(RecordingError, match=rf"x\.{suffix}: No such file"):
        nv.load(path)
    network.run_to(path, 3)
    assert len(nv.load(path)) == 3
    assert part.read_bytes() == b"somebody's own\n1\n2\n"
    for begun in (b"", b"neurovis r" if suffix == "npz" else b"step,t,A\n0,"):
        part.write_bytes(begun)
        network.run_to(path, 3)
        assert files(tmp_path) == [path.name]


def test_what_a_writer_that_was_killed_has_left_is_cleared(tmp_path: Path) -> None:
    """A file that is of no use before it is whole goes without a word."""
    (tmp_path / ".x.svg.neurovis-new").write_bytes(b"half")
    (tmp_path / ".x.svg.3.neurovis-new").write_bytes(b"half")
    compiled("neurons: {A: {}}").render(tmp_path / "x.svg", step=0)
    assert files(tmp_path) == ["x.svg"]


def test_a_large_network_makes_few_steps_between_two_looks_at_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as take a tenth of a second, by a clock on which each step takes 5 ms."""
    network = compiled("neurons: {A: {count: 400}}\nconnections: {A -> A: {weight: 0, pattern: all_to_all}}")
    run, lengths, now = NumpyStepper.run, [], [0.0]

    def counted(self: NumpyStepper, state: State, vectors: FloatArray, *more: object) -> int:
        lengths.append(len(vectors))
        now[0] += 0.005 * len(vectors)
        return run(self, state, vectors, *more)  # type: ignore[arg-type]

    monkeypatch.setattr(NumpyStepper, "run", counted)
    monkeypatch.setattr(record, "monotonic", lambda: now[0])
    network.run(100, backend="numpy")
    assert sum(lengths) == 100
    assert max(lengths) in (19, 20)
