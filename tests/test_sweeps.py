"""Sweeps: a row for each point of a grid, what is in the file is not run again, and nothing is lost."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
from multiprocessing import active_children
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from click.testing import CliRunner, Result

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.sweeps import grid, point, workers
from neurovis_spec.sweeps.grid import Point, SweepError
from neurovis_spec.sweeps.sweep import named_metrics, planned
from neurovis_spec.sweeps.table import Table
from neurovis_spec.sweeps.workers import in_processes

SPEC = """\
neurovis: 1
name: noisy
time: {steps: 300}
parameters: {gain: {value: 0.5, min: 0, max: 1}, count: 2}
inputs: {pull: {expression: sin(k)}}
neurons: {A: {input: pull, noise: "normal(0, 0.1)"}, K: {count: count, activation: tanh}}
connections: {A -> K: {weight: gain}}
outputs: {signal: K2}
"""
OVER = {"gain": "0.25:0.75:3", "seed": "0..2"}
METRICS = ["rms(K1 - A, last=100)", "top=max(signal)", "gain * k"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "noisy.yaml").write_text(SPEC)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*arguments: object, stdin: str | None = None) -> Result:
    result = CliRunner().invoke(neurovis, [str(argument) for argument in arguments], input=stdin)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def swept(*more: object) -> Result:
    """The sweep of OVER and METRICS on the command line."""
    over = [word for name, values in OVER.items() for word in ("--over", f"{name}={values}")]
    metrics = [word for text in METRICS for word in ("--metric", text)]
    return call("sweep", "noisy.yaml", *over, *metrics, *more)


# Grids


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0..3", (0, 1, 2, 3)),
        ("-1 .. 1", (-1, 0, 1)),
        ("1,2.5, 1e-3", (1, 2.5, 0.001)),
        ("7", (7,)),
        ("0:1:5", (0.0, 0.25, 0.5, 0.75, 1.0)),
        ("1:0:3", (1.0, 0.5, 0.0)),
        ("1:100:log3", (1.0, 10.0, 100.0)),
        ("0.001:0.1:log2", (0.001, 0.1)),
    ],
)
def test_a_range(text: str, values: tuple[float, ...]) -> None:
    found = grid.axis("x", text).values
    assert found == pytest.approx(values)
    assert (found[0], found[-1]) == (values[0], values[-1])
    assert [isinstance(one, int) for one in found] == [isinstance(one, int) for one in values]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("x", "3..1", "runs backwards"),
        ("x", "0:1", "is no range"),
        ("x", "0:1:log", "is no range"),
        ("x", "0:1:2:3", "is no range"),
        ("x", "0:1:1", "two numbers or more"),
        ("x", "0:1:log5", "above 0"),
        ("x", "a:1:5", "'a' is no number"),
        ("x", "1,,2", "'' is no number"),
        ("x", "1_0", "is no number"),
        ("x", "1,inf", "no finite number"),
        ("x", "1,2,1", "the value 1 twice"),
        ("x", "0..99999999", "more than 10,000,000"),
        ("seed", "0.5,1", "the seed is an integer"),
        ("x", "", "'' is no number"),
    ],
)
def test_a_range_that_is_none_is_refused(name: str, text: str, words: str) -> None:
    with pytest.raises(SweepError) as caught:
        grid.axes({name: text})
    assert words in str(caught.value)


def test_ranges_in_python_are_numbers_too() -> None:
    found = grid.axes({"a": range(2), "b": np.linspace(0, 1, 3), "c": [1, np.float64(0.5)]})
    assert [one.values for one in found] == [(0, 1), (0.0, 0.5, 1.0), (1, 0.5)]
    for bad in ([True], ["1"], []):
        with pytest.raises(SweepError):
            grid.axes({"a": bad})


def test_metrics_have_names() -> None:
    assert named_metrics("A") == {"A": "A"}
    assert named_metrics(["a = A > 1", "A  >= 1", "A == 1", "rms(A, last=5)"]) == {
        "a": "A > 1", "A >= 1": "A  >= 1", "A == 1": "A == 1", "rms(A, last=5)": "rms(A, last=5)",
    }  # fmt: skip
    with pytest.raises(SweepError, match="two metrics 'A'"):
        named_metrics(["A", "A"])


# Tables


def test_a_row_is_what_a_run_of_its_point_gives(folder: Path) -> None:
    table = nv.sweep("noisy.yaml", OVER, METRICS)
    assert table.columns == ("gain", "seed", "rms(K1 - A, last=100)", "top", "gain * k", "error")
    assert [row[:2] for row in table] == [(gain, seed) for gain in (0.25, 0.5, 0.75) for seed in range(3)]
    for gain, seed, error, top, product, finding in table:
        network = nv.compile("noisy.yaml", gain=float(gain or 0), seed=int(seed or 0))
        recording = network.run()
        assert error == network.measure("rms(K1 - A, last=100)", recording)[-1]
        assert top == recording["signal"].max()
        assert (product, finding) == (float(gain or 0) * 299, None)
    assert len(set(table["top"])) == 9


def test_a_parameter_of_the_structure_makes_another_network_at_each_point() -> None:
    over: dict[str, str] = {"count": "3..5"}
    table = nv.sweep({**yaml_of(SPEC)}, over, {"last": "K5 + 1", "first": "K1"}, steps=5)
    assert [row[0] for row in table] == [3, 4, 5]
    assert [error and error.split(":")[0] for error in map(str, table["error"])] == ["unknown-name"] * 2 + ["None"]
    assert table["last"][:2] == table["first"][:2] == (None, None)


def yaml_of(text: str) -> dict[str, object]:
    import yaml

    found = yaml.safe_load(text)
    assert isinstance(found, dict)
    return found


def test_processes_give_the_same_table(folder: Path) -> None:
    assert nv.sweep("noisy.yaml", OVER, METRICS, jobs=3, path="x.csv") == nv.sweep("noisy.yaml", OVER, METRICS)
    assert not active_children()
    text = (folder / "x.csv").read_text()
    assert text == str(nv.sweep("noisy.yaml", OVER, METRICS))
    assert sorted(path.name for path in folder.iterdir()) == ["noisy.yaml", "x.csv"]


def test_a_failed_point_is_a_row_with_its_finding(folder: Path) -> None:
    result = call("sweep", "noisy.yaml", "--over", "gain=0.5,2,-1", "--metric", "K1", "--jobs", 1)
    assert result.exit_code == 0
    assert result.stderr == "2 points of 3 failed: the column 'error' says why\n"
    header, good, *bad = result.stdout.splitlines()
    assert header == "gain,K1,error"
    assert good.startswith("0.5,")
    assert bad == [f"{value},,out-of-range: 'gain' is {value}; its bounds are 0 to 1" for value in (2, -1)]


def test_inputs_steps_and_values_are_those_given(folder: Path) -> None:
    rows = np.arange(20.0)
    np.savetxt("pull.csv", rows)
    wanted = nv.compile("noisy.yaml", gain=0.25, seed=3).run(20, {"pull": rows})["A"].mean()
    for source in ("noisy.yaml", "-"):
        result = call("sweep", source, "--over", "seed=3,4", "--metric", "mean(A)", "--set", "gain=0.25", "--steps", 20,
                      "--input", "pull=pull.csv", "--backend", "reference", "--jobs", 1, stdin=SPEC)  # fmt: skip
        assert (result.exit_code, result.stderr) == (0, "")
        assert float(result.stdout.splitlines()[1].split(",")[1]) == pytest.approx(wanted, rel=1e-12)


def test_a_table_is_saved_and_becomes_a_data_frame(folder: Path) -> None:
    table = Table(("x", "m", "error"), ((1, 0.1, None), (2, math.nan, None), (3, None, 'a: "b", c')))
    table.save("x.csv")
    assert (folder / "x.csv").read_text() == 'x,m,error\n1,0.1,\n2,nan,\n3,,"a: ""b"", c"\n'
    table.save("x.parquet")
    read = pyarrow.parquet.read_table("x.parquet").to_pydict()
    assert read["x"] == [1, 2, 3]
    assert read["error"] == [None, None, 'a: "b", c']
    frame = table.to_pandas()
    assert list(frame.columns) == ["x", "m", "error"]
    assert frame["x"].tolist() == [1, 2, 3]
    with pytest.raises(SweepError, match=r"\.csv or \.parquet"):
        table.save("x.txt")
    with pytest.raises(KeyError, match="there are: x, m, error"):
        table["y"]


# Going on


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[Point]:
    """The points that are run in this process."""
    made: list[Point] = []

    def counted(job: point.Job, where: Point) -> point.Result:
        made.append(where)
        return point.run_point(job, where)

    monkeypatch.setattr(workers, "run_point", counted)
    return made


@pytest.mark.parametrize("name", ["x.csv", "x.parquet"])
def test_what_is_in_the_file_is_not_run_again(folder: Path, name: str, runs: list[Point]) -> None:
    first = nv.sweep("noisy.yaml", {"seed": "0..2"}, "K1", path=name)
    assert nv.sweep("noisy.yaml", {"seed": "0..2"}, "K1", path=name) == first
    assert runs == [(0,), (1,), (2,)]
    more = nv.sweep("noisy.yaml", {"seed": "4,1,3"}, "K1", path=name)
    assert runs[3:] == [(4,), (3,)]
    assert more.rows[1] == first.rows[1]
    whole = nv.sweep("noisy.yaml", {"seed": "0..4"}, "K1", path=name)
    assert len(runs) == 5, "rows of other points have stayed"
    assert whole == nv.sweep("noisy.yaml", {"seed": "0..4"}, "K1")
    assert sorted(path.name for path in folder.iterdir()) == ["noisy.yaml", name]


def test_a_half_written_row_is_dropped_and_run(folder: Path, runs: list[Point]) -> None:
    whole = nv.sweep("noisy.yaml", {"seed": "0..3"}, "K1", path="x.csv")
    content = (folder / "x.csv").read_bytes()
    for length in range(0, len(content), 3):
        (folder / "x.csv").write_bytes(content[:length])
        runs.clear()
        assert nv.sweep("noisy.yaml", {"seed": "0..3"}, "K1", path="x.csv") == whole
        assert (folder / "x.csv").read_bytes() == content
        assert len(runs) == 4 - max(0, content[:length].count(b"\n") - 1)


def test_rows_of_a_parquet_outlive_what_ended_its_sweep(folder: Path, runs: list[Point]) -> None:
    whole = nv.sweep("noisy.yaml", {"seed": "0..3"}, "K1")
    runs.clear()
    (folder / ".x.parquet.rows").write_text("".join(str(whole).splitlines(keepends=True)[:3]) + "2,0.")
    assert nv.sweep("noisy.yaml", {"seed": "0..3"}, "K1", path="x.parquet") == whole
    assert runs == [(2,), (3,)]
    assert not (folder / ".x.parquet.rows").exists()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"seed,K2,error\n1,2,\n", "its columns are seed, K2, error, not seed, K1, error"),
        (b"seed,K1\n1,2\n", "is not the table of this sweep"),
        (b"my notes", "is not the table of a sweep"),
        (b"my notes\n", "is not the table of this sweep"),
        (b"\xff\xfe\n", "is not the table of a sweep"),
        (b"seed,K1,error\n1,two,\n", "x.csv:2: this is no row"),
        (b"seed,K1,error\n1,2\n", "x.csv:2: this is no row"),
    ],
)
def test_a_file_of_something_else_is_refused_and_stays(folder: Path, content: bytes, words: str) -> None:
    (folder / "x.csv").write_bytes(content)
    result = call("sweep", "noisy.yaml", "--over", "seed=0..1", "--metric", "K1", "-o", "x.csv", "--jobs", 1)
    assert (result.exit_code, result.stdout) == (1, "")
    assert words in result.stderr
    assert (folder / "x.csv").read_bytes() == content


def test_a_file_of_another_sweep_that_goes_on_is_refused(folder: Path) -> None:
    def again(done: int, total: int) -> None:
        if done == 1:
            with pytest.raises(SweepError, match="another sweep is writing"):
                nv.sweep("noisy.yaml", {"seed": "0..3"}, "K1", path="x.csv")

    assert len(nv.sweep("noisy.yaml", {"seed": "0..3"}, "K1", path="x.csv", progress=again)) == 4


# Ends


def test_a_worker_that_is_killed_loses_no_point(folder: Path) -> None:
    killed = []

    def kill(done: int, total: int) -> None:
        if done == 2:
            child = active_children()[0]
            child.kill()
            killed.append(child.pid)

    table = nv.sweep("noisy.yaml", OVER, METRICS, jobs=2, progress=kill)
    assert killed
    assert table == nv.sweep("noisy.yaml", OVER, METRICS)


def deadly(job: point.Job, where: Point) -> point.Result:
    """What ends its process at the point 1."""
    if where == (1,):
        os.kill(os.getpid(), signal.SIGKILL)
    return point.run_point(job, where)


def test_a_point_that_ends_its_process_is_a_failed_one(folder: Path) -> None:
    plan = planned("noisy.yaml", {"seed": "0..3"}, "K1")
    found = dict(in_processes(plan.job, plan.points, 2, deadly))
    assert sorted(found) == [0, 1, 2, 3]
    assert found[1].error == (
        "worker-died: signal 9 ended the process of this point; perhaps there was not enough memory"
    )
    assert [found[place].error for place in (0, 2, 3)] == [None] * 3


def test_a_script_without_a_guard_is_told_so(folder: Path) -> None:
    (folder / "script.py").write_text(
        "import neurovis_spec as nv\nnv.sweep('noisy.yaml', {'seed': '0..3'}, 'K1', jobs=2)\n"
    )
    done = subprocess.run([sys.executable, "script.py"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert "the processes of the sweep do not start" in done.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=lambda one: one.name)
def test_rows_outlive_what_ends_the_sweep(folder: Path, number: signal.Signals) -> None:
    """The signal goes to all, as from a terminal; what was ended goes on where it was."""
    command = [sys.executable, "-m", "neurovis_spec", "sweep", "noisy.yaml", "--over", "seed=0..11", "--metric", "K1",
               "--steps", "4000", "--jobs", "2", "-o", "x.csv"]  # fmt: skip
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, process_group=0)
    wait_for(lambda: (folder / "x.csv").exists() and (folder / "x.csv").read_bytes().count(b"\n") > 2)
    os.killpg(process.pid, number)
    out, err = process.communicate(timeout=60)
    rows = (folder / "x.csv").read_bytes()
    held = rows.count(b"\n") - 1
    assert out == b""
    if number == signal.SIGKILL:
        assert process.returncode == -9
    else:
        assert process.returncode == 128 + number
        assert err.decode() == f"\nstopped; x.csv holds {held} of 12 rows\n"
    wait_for(lambda: not alive(process.pid))
    assert 2 <= held < 12
    result = call(*command[3:], "--jobs", 1)
    assert (result.exit_code, result.stderr) == (0, "")
    assert (folder / "x.csv").read_text() == str(nv.sweep("noisy.yaml", {"seed": "0..11"}, "K1", steps=4000))


def alive(group: int) -> bool:
    """Whether a process of a group is there."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def wait_for(true: object) -> None:
    assert callable(true)
    for _ in range(2000):
        if true():
            return
        time.sleep(0.02)
    raise AssertionError("nothing happened")


# The command


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        ("--over gian=0..1 --metric K1", 1, "there is no parameter 'gian'\nhelp: did you mean 'gain'?"),
        ("--over gain=0:1 --metric K1", 1, "is no range"),
        ("--over gain --metric K1", 2, "name=RANGE"),
        ("--over gain=1 --over gain=0 --metric K1", 2, "'gain' is given twice"),
        ("--over gain=1 --set gain=0 --metric K1", 2, "'gain' is given by --over and by --set"),
        ("--over gain=1", 2, "--metric"),
        ("--metric K1", 2, "--over"),
        ("--over gain=1 --metric K9", 1, "<metric>:1:1: error[unknown-name]"),
        ("--over gain=1 --metric rms(K1,last=301)", 1, "the last 301 steps of a run of 300"),
        ("--over gain=1 --metric gain", 1, "two columns of the table would be called 'gain'"),
        ("--over gain=1 --metric K1 --metric K1", 1, "two metrics 'K1'"),
        ("--over gain=1 --metric K1+", 1, "error[missing-operand]"),
        ("--over gain=1 --metric K1 -o x.txt", 1, "written as .csv or .parquet"),
        ("--over gain=1 --metric K1 -o noisy.yaml", 2, "which would be lost"),
        ("--over gain=1 --metric K1 --jobs 2 --scheduler x", 2, "give one of them"),
        ("--over gain=1 --metric K1 --backend numpi", 2, "did you mean 'numpy'?"),
        ("--over gain=1 --metric K1 --input push=x.csv", 1, "no input 'push'"),
        ("--over gain=1 --metric K1 --set conut=3", 1, "did you mean 'count'?"),
        ("--over gain=2,3 --metric K9", 1, "error[unknown-name]"),
    ],
)
def test_what_is_wrong_with_all_points_is_told_before_any_is_run(
    folder: Path, arguments: str, status: int, words: str
) -> None:
    before = sorted(folder.iterdir())
    result = call("sweep", "noisy.yaml", *arguments.split())
    assert (result.exit_code, result.stdout) == (status, "")
    assert words in result.stderr
    assert sorted(folder.iterdir()) == before


def test_the_command_sums_up(folder: Path) -> None:
    result = swept("-o", "x.parquet", "--jobs", 1)
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.startswith("x.parquet: 9 rows in ")
    read = pyarrow.parquet.read_table("x.parquet")
    assert read.column_names == ["gain", "seed", "rms(K1 - A, last=100)", "top", "gain * k", "error"]
    printed = swept("--jobs", 1)
    assert printed.stdout == str(nv.sweep("noisy.yaml", OVER, METRICS))


def test_a_scheduler_that_is_not_there_is_told(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from neurovis_spec.sweeps import workers

    monkeypatch.setattr(workers, "_PATIENCE", 1)
    result = call("sweep", "noisy.yaml", "--over", "gain=1", "--metric", "K1", "--scheduler", "tcp://127.0.0.1:9")
    assert (result.exit_code, result.stdout) == (1, "")
    assert "the scheduler at tcp://127.0.0.1:9 does not answer" in result.stderr
