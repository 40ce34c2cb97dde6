"""A sweep on a cluster: a real scheduler of dask.distributed and two workers, of which one is killed."""

from __future__ import annotations

import logging
import shutil
import subprocess
import sys
import time
from asyncio import CancelledError
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from distributed import Client

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.sweeps.grid import SweepError
from neurovis_spec.sweeps.workers import _ended_tasks_untold

pytestmark = pytest.mark.cluster

SPEC = """\
neurovis: 1
name: noisy
time: {steps: 5000}
parameters: {gain: {value: 0.5, min: 0, max: 1}}
neurons: {A: {noise: "normal(0, 0.1)"}, K: {bias: gain, activation: tanh}}
connections: {A -> K: 0.5}
"""
OVER = {"gain": "0.2:1.1:10", "seed": "0..1"}
METRICS = ["rms(K, last=1000)", "top=max(A)"]


class Cluster:
    """A scheduler and its workers, each a process of its own."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / "scheduler.json"
        self._processes = [self._started("dask_scheduler", "--port", "0", "--dashboard-address", ":0")]
        wait_for(self._file.exists)
        self.workers = [self._started("dask_worker", "--no-nanny", "--no-dashboard", "--nthreads", "1") for _ in "12"]
        with Client(scheduler_file=str(self._file), set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
            self.address = str(client.scheduler.address)

    def _started(self, module: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.{module}", "--scheduler-file", str(self._file), *options]
        return subprocess.Popen(command, stderr=subprocess.DEVNULL, cwd=self._file.parent)

    def kill(self) -> None:
        """End the scheduler."""
        self._processes[0].kill()

    def close(self) -> None:
        for process in (*self.workers, *self._processes):
            process.kill()
            process.wait()


def wait_for(true: object) -> None:
    assert callable(true)
    for _ in range(1500):
        if true():
            return
        time.sleep(0.04)
    raise AssertionError("nothing happened")


@pytest.fixture
def cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Cluster]:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "noisy.yaml").write_text(SPEC)
    made = Cluster(tmp_path)
    yield made
    made.close()


def test_a_sweep_loses_nothing_with_a_worker(cluster: Cluster) -> None:
    serial = nv.sweep("noisy.yaml", OVER, METRICS)
    killed = []

    def kill(done: int, total: int) -> None:
        if done == 3:
            cluster.workers[0].kill()
            killed.append(done)

    table = nv.sweep("noisy.yaml", OVER, METRICS, scheduler=cluster.address, path="x.csv", progress=kill)
    assert killed
    assert cluster.workers[0].wait() == -9
    assert table == serial
    assert Path("x.csv").read_text() == str(serial)
    assert [str(error)[:12] for error in table["error"][-2:]] == ["out-of-range"] * 2


def test_the_command_runs_on_a_cluster_and_goes_on(cluster: Cluster) -> None:
    arguments = ["sweep", "noisy.yaml", "--metric", "mean(K)", "--scheduler", cluster.address, "-o", "x.csv"]
    for seeds in ("0..2", "0..5"):
        result = CliRunner().invoke(neurovis, [*arguments, "--over", f"seed={seeds}"])
        assert (result.exit_code, result.stderr) == (0, "")
    assert Path("x.csv").read_text() == str(nv.sweep("noisy.yaml", {"seed": "0..5"}, "mean(K)"))


READING = """\
neurovis: 1
name: reading
include: [parts/cell.yaml]
time: {steps: 30}
seed: 4
parameters: {gain: 0.5, size: {value: 2, min: 1}}
inputs: {drive: {file: data/drive.csv}}
instances: {c: {module: cell, set: {bias: gain}}}
neurons: {A: {count: size, input: drive, activation: tanh}, B: {count: 2, noise: "normal(0, 0.1)"}}
connections: {A -> B: {matrix: {file: data/link.npy}}, B -> c.K: 1}
"""
CELL = """\
neurovis: 1
modules:
  cell:
    parameters: {bias: 0}
    neurons: {K: {bias: bias}, L: {count: 2}}
    connections: {K -> L: {edges: {file: edges.csv}}}
"""


def test_the_workers_need_none_of_the_files_that_a_spec_reads(cluster: Cluster, tmp_path: Path) -> None:
    """They run elsewhere, and all that the sweep has read is gone before the first of them begins."""
    folder = tmp_path / "specs"
    for name in ("parts", "data"):
        (folder / name).mkdir(parents=True)
    (folder / "spec.yaml").write_text(READING)
    (folder / "parts" / "cell.yaml").write_text(CELL)
    (folder / "parts" / "edges.csv").write_text("from,to,weight\nK,L1,0.5\nK,L2,-0.25\n")
    (folder / "data" / "drive.csv").write_text("drive\n0.1\n0.7\n-0.3\n")
    np.save(folder / "data" / "link.npy", np.array([[0.1, 1 / 3], [0.3, 1e-17]]))
    over: dict[str, list[float]] = {"gain": [0.1, 0.7], "size": [2, 3], "seed": [1, 2]}
    metrics = ["rms(B1, last=20)", "mean(c.L2)"]
    serial = nv.sweep(folder / "spec.yaml", over, metrics)
    assert [error is None for error in serial["error"]] == [True, True, False, False] * 2

    def remove(done: int, total: int) -> None:
        shutil.rmtree(folder, ignore_errors=True)

    assert nv.sweep(folder / "spec.yaml", over, metrics, scheduler=cluster.address, progress=remove) == serial


def test_a_scheduler_that_is_lost_ends_the_sweep_and_no_row_is(
    cluster: Cluster, capfd: pytest.CaptureFixture[str]
) -> None:
    def kill(done: int, total: int) -> None:
        if done == 3:
            cluster.kill()

    with pytest.raises(SweepError, match=r"the cluster gave up: .* lost the connection to the scheduler"):
        nv.sweep("noisy.yaml", OVER, METRICS, scheduler=cluster.address, path="x.csv", progress=kill)
    assert "Traceback" not in capfd.readouterr().err
    rows = Path("x.csv").read_text().splitlines()
    assert set(rows[1:]) <= set(str(nv.sweep("noisy.yaml", OVER, METRICS)).splitlines())
    assert len(rows) > 3


def test_what_the_client_logs_is_told_but_for_its_own_tasks_that_it_ends() -> None:
    logger, told = logging.getLogger("distributed.client"), Told()

    def logged() -> list[str]:
        told.messages.clear()
        for error in (CancelledError("ended"), OSError("broken")):
            try:
                raise error
            except (CancelledError, OSError):
                logger.exception("%r", error)
        return list(told.messages)

    logger.addHandler(told)
    try:
        with _ended_tasks_untold():
            assert logged() == ["OSError('broken')"]
        assert logged() == ["CancelledError('ended')", "OSError('broken')"]
    finally:
        logger.removeHandler(told)


class Told(logging.Handler):
    """Keeps what is logged."""

    def __init__(self) -> None:
        super().__init__()
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.messages.append(record.getMessage())
