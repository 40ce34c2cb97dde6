"""Recordings on disk: what is written reads back, and nothing else is believed."""

from __future__ import annotations

import io
import json
import os
import pickle
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from networks_by_hand import Learns, Link, Unit, build, cpg_rbf, rule

from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime import files, formats
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.recording import Recording, after_rows, ended
from neurovis_spec.runtime.rows import After

ARRAYS = ("activity", "weights", "weights_static", "plastic", "sources", "targets", "delays", "step", "ranks",
          "weights_after", "lesioned_neurons", "lesioned_connections")  # fmt: skip


def learning() -> Network:
    """Three connections share both ends; the one written last is first by delay."""
    links = [Link(0, 1, 0.5, 3, learns=0), Link(0, 1, 0.25, 2), Link(0, 1, 0.125, 1, learns=0)]
    return build([Unit("A", bias=0.1), Unit("B")], links, [Learns(rule("weight + pre"))], dt=0.1)


def parallel() -> Recording:
    return record(learning(), Course(7, every=2))


def same(one: Recording, other: Recording) -> None:
    for name in ARRAYS:
        expected, found = getattr(one, name), getattr(other, name)
        assert found.dtype == expected.dtype
        assert np.array_equal(found, expected, equal_nan=found.dtype.kind == "f")
    assert (one.reached, one.set_parameters) == (other.reached, other.set_parameters)
    assert (one.neurons, one.dt, one.views, one.counted, one.network, one.hash) == (
        other.neurons,
        other.dt,
        other.views,
        other.counted,
        other.network,
        other.hash,
    )


def test_npz_keeps_everything(tmp_path: Path) -> None:
    for number, recording in enumerate((record(cpg_rbf(), Course(50)), parallel(), record(build([]), Course(0)))):
        path = tmp_path / f"{number}.npz"
        recording.save(path)
        same(recording, formats.load(path))
    loaded = formats.load(tmp_path / "0.npz")
    assert loaded["K"].shape == (50, 8)
    assert loaded["signal"].shape == (50,)


def test_npz_keeps_what_is_true_after_the_last_step(tmp_path: Path) -> None:
    after = After(np.array([7.5, -1.0]), 41, {"gain": 0.1}, np.array([1]), np.array([0, 2]))
    recording = ended(parallel(), after)
    recording.save(tmp_path / "x.npz")
    same(recording, formats.load(tmp_path / "x.npz"))


def test_a_recording_knows_the_weights_after_its_last_step(tmp_path: Path) -> None:
    """Also where that step is not among those recorded; a table stands for it with its last row."""
    whole = parallel()
    for steps, every in ((5, 1), (5, 2), (6, 5)):
        network = learning()
        recording = record(network, Course(steps, every=every))
        longer = record(network, Course(steps + 1))
        assert recording.weights_after.tolist() == longer.weights[-1].tolist()
        assert recording.reached == steps
    assert whole.weights_after.tolist() != whole.weights[-1].tolist()
    whole.save(tmp_path / "x.csv")
    loaded = formats.load(tmp_path / "x.csv")
    assert (loaded.weights_after.tolist(), loaded.reached) == (whole.weights[-1].tolist(), 7)


def test_going_on_keeps_the_last_update_and_counts_on() -> None:
    network = learning()
    start = None
    for run in range(1, 6):
        start = record(network, Course(1, start=start))
        assert start.reached == run
    assert start is not None
    assert start.weights[0].tolist() != [0.5, 0.125]


def test_npz_holds_the_arrays_of_the_contract(tmp_path: Path) -> None:
    recording = record(cpg_rbf(), Course(5))
    recording.save(tmp_path / "x.npz")
    with np.load(tmp_path / "x.npz", allow_pickle=False) as arrays:
        assert {"activity", "neurons", "weights", "weights_static", "plastic", "sources", "targets", "delays", "dt",
                "step"} <= set(arrays)  # fmt: skip
        assert arrays["activity"].shape == (5, 12)
        assert arrays["activity"].dtype == np.float64
        assert arrays["neurons"].tolist() == ["C1", "C2", *(f"K{i}" for i in range(1, 9)), "O", "T"]
        assert float(arrays["dt"]) == 0.05


def test_parallel_connections_keep_their_names(tmp_path: Path) -> None:
    recording = parallel()
    assert recording.connection_names == ("A -> B (3)", "A -> B (2)", "A -> B")
    for suffix in (".npz", ".csv"):
        recording.save(tmp_path / f"x{suffix}")
        loaded = formats.load(tmp_path / f"x{suffix}")
        for name in ("A -> B", "A -> B (3)"):
            assert np.array_equal(loaded.weight(name), recording.weight(name))


def test_csv_is_a_table_that_reads_back_exactly(tmp_path: Path) -> None:
    recording = parallel()
    recording.save(tmp_path / "x.csv")
    lines = (tmp_path / "x.csv").read_text("utf-8").splitlines()
    assert lines[0] == "step,t,A,B,A -> B (3),A -> B"
    assert lines[1] == "0,0.0,0.1,0.0,0.5,0.125"
    assert [line.split(",")[0] for line in lines[1:]] == ["0", "2", "4", "6"]
    loaded = formats.load(tmp_path / "x.csv")
    assert np.array_equal(loaded.activity, recording.activity)
    assert np.array_equal(loaded.weights, recording.weights)
    assert loaded.step.tolist() == [0, 2, 4, 6]
    assert loaded.dt == pytest.approx(0.1, rel=1e-15)


def test_a_csv_is_enough_to_go_on_from_but_for_the_last_update(tmp_path: Path) -> None:
    network = cpg_rbf()
    recording = record(network, Course(100))
    recording.save(tmp_path / "x.csv")
    known = ended(recording, after_rows(recording.step, recording.weights))
    on = [record(network, Course(10, start=start)) for start in (known, formats.load(tmp_path / "x.csv"))]
    assert np.array_equal(on[0].activity, on[1].activity)
    assert on[0].weights[0].any()


def test_unknown_suffixes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"suffix '\.nzp'; known: \.csv, \.mcap, \.npz"):
        parallel().save(tmp_path / "x.nzp")


# ---- writing -----------------------------------------------------------------------------------------------------


def interrupted(path: Path) -> None:
    with files.replacing(path) as file:
        file.write(b"half")
        raise KeyboardInterrupt


def test_an_interrupted_write_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    path.write_bytes(b"before")
    with pytest.raises(KeyboardInterrupt):
        interrupted(path)
    assert path.read_bytes() == b"before"
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.npz"]


def test_a_link_is_followed_and_a_folder_refused(tmp_path: Path) -> None:
    (tmp_path / "real.bin").write_bytes(b"1")
    (tmp_path / "link.bin").symlink_to("real.bin")
    with files.replacing(tmp_path / "link.bin") as file:
        file.write(b"2")
    assert (tmp_path / "link.bin").is_symlink()
    assert (tmp_path / "real.bin").read_bytes() == b"2"
    with pytest.raises(OSError, match="not a regular file"), files.replacing(tmp_path):
        raise AssertionError("never reached")


def test_a_character_device_is_written_as_it_is(tmp_path: Path) -> None:
    terminal, child = os.openpty()
    with files.replacing(os.ttyname(child)) as file:
        file.write(b"all")
        file.seek(0)
        file.write(b"A")
    assert os.read(terminal, 10) == b"All"
    os.close(terminal)
    os.close(child)
    (tmp_path / "x.npz").symlink_to(os.devnull)
    with files.replacing(tmp_path / "x.npz") as file:
        file.write(b"gone")
    assert (tmp_path / "x.npz").is_char_device()
    with pytest.raises(RecordingError, match="not a regular file"):
        formats.load(tmp_path / "x.npz")


# ---- files that are no recordings --------------------------------------------------------------------------------


def contents() -> dict[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]]:
    """The arrays of a small valid recording, without ``about``."""
    return {
        "activity": np.array([[0.1, 0.2], [0.3, 0.4]]),
        "neurons": np.array(["A", "B"]),
        "weights": np.array([[1.0], [2.0]]),
        "weights_static": np.array([5.0]),
        "plastic": np.array([1]),
        "sources": np.array([0, 0]),
        "targets": np.array([1, 1]),
        "delays": np.array([1, 0]),
        "dt": np.array(0.5),
        "step": np.array([3, 4]),
    }


def member(array: object) -> bytes:
    data = io.BytesIO()
    np.lib.format.write_array(data, np.asarray(array))
    return data.getvalue()


def written(path: Path, arrays: Mapping[str, object]) -> Path:
    return zipped(path, {name: member(array) for name, array in arrays.items()})


def zipped(path: Path, members: Mapping[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in members.items():
            file.writestr(f"{name}.npy", data)
    return path


def test_a_recording_by_another_program_is_read(tmp_path: Path) -> None:
    loaded = formats.load(written(tmp_path / "x.npz", {**contents(), "activity": np.ones((2, 2), ">f4", order="F")}))
    assert loaded["B"].tolist() == [1, 1]
    assert loaded.weight("A -> B").tolist() == [5, 5]
    assert loaded.weight("A -> B (2)").tolist() == [1, 2]
    assert loaded.snapshot(4).weights.tolist() == [5, 2]
    assert (loaded.hash, loaded.network) == ("", "")
    assert (loaded.weights_after.tolist(), loaded.reached, loaded.set_parameters) == ([2], 5, {})
    assert len(loaded.lesioned_neurons) == len(loaded.lesioned_connections) == 0


BAD: Mapping[str, Mapping[str, object]] = {
    "no 'plastic'": {"plastic": None},
    "'activity' is of another type": {"activity": np.zeros(2)},
    "an array of texts is no array of real numbers": {"activity": np.array([["a", "b"]] * 2)},
    "an array of dates is no array of texts": {"neurons": np.array(["2020-01-01"] * 2, dtype="M8[D]")},
    "an array of spans of time is no array of integers": {"sources": np.array([0, 0], dtype="m8[s]")},
    "an array of byte strings is no array of texts": {"neurons": np.array([b"A", b"B"])},
    "an array of truth values is no array of texts": {"neurons": np.array([True, False])},
    "an array of integers is no array of texts": {"about": np.array(3)},
    "'sources' is of another type": {"sources": np.array([0.0, 0.0])},
    "'neurons' has the shape": {"neurons": np.array(["A"])},
    "'neurons' holds a name twice": {"neurons": np.array(["A", "A"])},
    "'weights' has the shape": {"weights": np.zeros((2, 2))},
    "'weights_static' has the shape": {"weights_static": np.zeros(2)},
    "'plastic' holds a number outside": {"plastic": np.array([2])},
    "'targets' holds a number outside": {"targets": np.array([0, -1])},
    "'delays' holds a number outside": {"delays": np.array([0, -1])},
    "'step' does not ascend": {"step": np.array([4, 4])},
    "'dt' is nan": {"dt": np.array(np.nan)},
    "'dt' is 0.0": {"dt": np.array(0.0)},
    "'about' is no mapping": {"about": np.array("[1]")},
    "JSONDecodeError": {"about": np.array("{")},
    "names neurons that are not there": {"about": np.array(json.dumps({"views": {"K": [[7], False]}}))},
    "names groups that are no views": {"about": np.array(json.dumps({"named": ["C"]}))},
    "names no groups": {"about": np.array(json.dumps({"named": 1}))},
    "counts no instances": {"about": np.array(json.dumps({"counted": {"left": -1}}))},
    "counts more instances than there is room for": {"about": np.array(json.dumps({"counted": {"left": 1 << 60}}))},
    "'weights_after' has the shape": {"weights_after": np.zeros(2)},
    "'reached' is -1": {"reached": np.array(-1)},
    "'lesioned_neurons' holds a number outside": {"lesioned_neurons": np.array([2])},
    "'lesioned_connections' does not ascend": {"lesioned_connections": np.array([1, 0])},
    "sets no parameters": {"about": np.array(json.dumps({"set_parameters": {"gain": "1"}}))},
    "names no views": {"about": np.array(json.dumps({"views": 3}))},
    "ranks a connection": {"about": np.array(json.dumps({"parallel": [[9, 2]]}))},
}


@pytest.mark.parametrize("words", BAD)
def test_what_does_not_agree_is_refused(words: str, tmp_path: Path) -> None:
    arrays = {name: array for name, array in {**contents(), **BAD[words]}.items() if array is not None}
    with pytest.raises(RecordingError, match=words):
        formats.load(written(tmp_path / "x.npz", arrays))


def header(shape: str, dtype: str = "'<f8'") -> bytes:
    text = f"{{'descr': {dtype}, 'fortran_order': False, 'shape': {shape}}}".encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text


class Bomb:
    """Unpickling this would raise."""

    def __reduce__(self) -> tuple[object, ...]:
        return (exit, (3,))


@pytest.mark.parametrize(
    "hostile",
    [
        b"",
        b"\x93NUMPY",
        b"junk" * 100,
        header("(2, 2)"),
        header("(2, 2)") + bytes(31),
        header("(2, 2)") + bytes(33),
        header("(1 << 40, 1 << 40)"),
        header("(1000000000000, 1000000000000)"),
        header("(-2, -2)") + bytes(32),
        header("(2.0, 2)") + bytes(32),
        header("(2, 2)", "'|O'") + pickle.dumps([[Bomb()] * 2] * 2),
        header("(2, 2)", "'<f8, <f8'") + bytes(64),
        header("(2, 2)", "'<M8[Y/0]'") + bytes(32),  # ends the process when NumPy's own reader meets it
        header("(" * 60),
        b"\x93NUMPY\x09\x00" + bytes(64),
    ],
)
def test_hostile_members_are_refused(hostile: bytes, tmp_path: Path) -> None:
    members = {name: member(array) for name, array in contents().items()}
    path = zipped(tmp_path / "x.npz", {**members, "activity": hostile})
    with pytest.raises(RecordingError):
        formats.load(path)


def test_an_archive_that_grows_out_of_proportion_is_refused_before_it_does(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    size = 300 * 2**20
    archived = zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1)
    with archived as file, file.open("activity.npy", "w") as growing:
        growing.write(header(f"({size // 16}, 2)"))
        for _ in range(size // 2**20):
            growing.write(bytes(2**20))
    with pytest.raises(RecordingError, match="out of all proportion"):
        formats.load(path)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damaged_archives_are_read_or_refused_but_never_worse(tmp_path: Path, data: st.DataObject) -> None:
    whole = bytearray(written(tmp_path / "x.npz", contents()).read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(whole)))
    (tmp_path / "y.npz").write_bytes(whole[: cut if data.draw(st.booleans()) else None])
    with suppress(RecordingError):
        assert formats.load(tmp_path / "y.npz").activity.shape == (2, 2)


def test_pipes_folders_and_missing_files_are_refused(tmp_path: Path) -> None:
    for suffix in (".npz", ".csv"):
        pipe = tmp_path / f"pipe{suffix}"
        os.mkfifo(pipe)
        (tmp_path / f"folder{suffix}").mkdir()
        for name in ("pipe", "folder"):
            with pytest.raises(RecordingError, match="not a regular file"):
                formats.load(tmp_path / f"{name}{suffix}")
        with pytest.raises(RecordingError, match="No such file"):
            formats.load(tmp_path / f"missing{suffix}")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "first columns"),
        ("a,b\n", "first columns"),
        ("step,t,A,A\n0,0,1,1\n", "named twice"),
        ("step,t,A -> A,A\n0,0,1,1\n", "mixed with weights"),
        ("step,t,A,A -> B -> A\n0,0,1,1\n", "'A -> B -> A' is no connection of neurons"),
        ("step,t,A,state v\n0,0,1,1\n", "'v' is no state"),
        ("step,t,state A.v,B\n0,0,1,1\n", "mixed with weights"),
        ("step,t,A,A -> A,A -> A\n0,0,1,1,1\n", "stands there twice"),
        ("step,t,A\n0,0\n", "line 2 has 2 columns, the header 3"),
        ("step,t,A\n0,0,1\n1,1,x\n", "line 3 holds something"),
        ("step,t,A\n0,0,1\n0,0,1\n", "ascending"),
        ("step,t,A\n0.5,0,1\n", "ascending"),
        ("step,t,A\nnan,0,1\n", "ascending"),
        ("step,t,A\n1e300,0,1\n", "ascending"),
        ("step,t,A\n1,0,1\n", "a step of 0.0 s"),
        ("step,t,\x00\n" + '"' * 9, "columns"),
        ("\ufffe", "first columns"),
    ],
)
def test_what_is_no_table_of_a_recording_is_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text(text, "utf-8")
    with pytest.raises(RecordingError, match=words):
        formats.load(tmp_path / "x.csv")
