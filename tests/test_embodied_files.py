"""What a run with a body leaves: recordings in files and in memory, checkpoints, copies of simulations."""

from __future__ import annotations

import json
import pickle
import warnings
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from toy_bodies import SKELETON, SPEC, carted, registered

import neurovis_spec as nv
from neurovis_spec.body import BodyError, Link, Skeleton, Solid, skeleton_of, text_of
from neurovis_spec.runtime.errors import RecordingError, UnknownNameError
from neurovis_spec.runtime.recording import Recording


@pytest.fixture(autouse=True)
def _carts(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch)


def same(one: Recording, other: Recording) -> bool:
    """Whether two recordings hold the same bits, and say the same of them."""
    arrays = zip((one.step, *one.rows, one.weights_after), (other.step, *other.rows, other.weights_after), strict=True)
    said = zip(*((r.sensor_names, r.skeleton, r.sensors is None, r.pose is None) for r in (one, other)), strict=True)
    return all(a.shape == b.shape and a.tobytes() == b.tobytes() for a, b in arrays) and all(a == b for a, b in said)


# ---- recordings in files -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".npz", ".mcap"])
@pytest.mark.parametrize("given", ["plain", "bare"])
def test_a_file_holds_sensors_and_pose(suffix: str, given: str, tmp_path: Path) -> None:
    run, streamed = tmp_path / f"run{suffix}", tmp_path / f"streamed{suffix}"
    recording = carted(given).run(100, every=3)
    assert recording.skeleton == (None if given == "bare" else SKELETON)
    recording.save(run)
    carted(given).run_to(streamed, 100, every=3)
    for path in (run, streamed):
        assert same(nv.load(path), recording)


def test_a_table_holds_sensors_and_no_pose(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recording = carted().run(50)
    carted().run_to(path, 50)
    assert path.read_text().splitlines()[0].endswith(",W -> O2,sensor x,sensor arm[0],sensor arm[1],sensor clock")
    read = nv.load(path)
    assert read.sensor_names == recording.sensor_names
    assert read.pose is None
    assert read.skeleton is None
    assert read.sensor("arm").tobytes() == recording.sensor("arm").tobytes()
    assert np.array_equal(read.weights, recording.weights)


def test_a_bag_does_not_say_which_sensors_there_are(tmp_path: Path) -> None:
    run, folder = carted().run(20), tmp_path / "bag"
    folder.mkdir()
    carted().run_to(folder / "bag_0.mcap", 20)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read = nv.load(folder)
    assert np.array_equal(read.activity, run.activity)
    assert read.sensors is None


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("step,t,A,sensor x,B", "sensors are mixed with others"),
        ("step,t,A,sensor x,sensor x", "one is named twice"),
    ],
)
def test_a_table_whose_sensors_are_out_of_place_is_refused(header: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "odd.csv"
    path.write_text(f"{header}\n0,0,1,2,3\n")
    with pytest.raises(RecordingError, match=message):
        nv.load(path)


def test_without_a_body_there_is_nothing_of_one(tmp_path: Path) -> None:
    recording = carted().run(10, body=False)
    assert recording.sensors is None
    assert recording.pose is None
    assert recording.skeleton is None
    assert recording.sensor_names == ()
    recording.save(tmp_path / "x.npz")
    with zipfile.ZipFile(tmp_path / "x.npz") as archive:
        assert not {"sensors.npy", "pose.npy", "skeleton.npy", "sensor_names.npy"} & set(archive.namelist())
    with pytest.raises(UnknownNameError, match="a network without a body"):
        recording.sensor("x")


def test_a_sensor_is_had_by_its_name() -> None:
    recording = carted().run(10)
    assert recording.sensors is not None
    assert np.array_equal(recording.sensor("x"), recording.sensors[:, 0])
    assert np.array_equal(recording.sensor("arm"), recording.sensors[:, 1:3])
    assert np.array_equal(recording.sensor("arm[1]"), recording.sensors[:, 2])
    assert recording._repr_svg_().count("<title>sensor of ") == 4
    assert "more" not in recording._repr_svg_()
    with pytest.raises(UnknownNameError, match="no sensor 'clok'; did you mean 'clock'"):
        recording.sensor("clok")
    assert "4 sensors" in repr(recording)


def test_a_snapshot_has_the_pose_at_the_beginning_of_its_step() -> None:
    recording, simulation = carted().run(10), carted().simulator()
    for step in range(10):
        snapshot, pose = recording.snapshot(step), simulation.pose
        simulation.step()
        assert snapshot.pose is not None
        assert snapshot.sensors is not None
        assert np.array_equal(snapshot.pose, pose)  # type: ignore[arg-type]
        assert np.array_equal(snapshot.sensors, simulation.sensed)  # type: ignore[arg-type]


def test_part_of_a_recording_has_the_rows_of_the_body_too() -> None:
    recording = carted().run(10)
    part = recording.part(slice(3, 7))
    assert part.sensors is not None
    assert part.pose is not None
    assert part.step.tolist() == [3, 4, 5, 6]
    assert np.array_equal(part.sensor("x"), recording.sensor("x")[3:7])
    assert len(part.pose) == 4


def test_frames_of_others_have_the_sensors() -> None:
    recording = carted().run(10)
    frame, data = recording.to_pandas(), recording.to_xarray()
    assert np.array_equal(frame["sensor"]["arm[0]"], recording.sensor("arm[0]"))
    assert np.array_equal(data["sensor"].sel(sensor_name="x"), recording.sensor("x"))


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("skeleton", np.array("[1]"), "'skeleton': not a skeleton"),
        ("skeleton", np.array('{"points": ["a"], "links": [[0, 7, 1]]}'), "there is no point 7"),
        ("skeleton", np.array('{"points": ["a"]}'), "'pose' has the shape"),
        ("sensor_names", np.array(["a"]), "'sensors' has the shape"),
        ("skeleton", None, "of 'pose' and 'skeleton' it holds one alone"),
        ("sensors", None, "of 'sensors' and 'sensor_names' it holds one alone"),
    ],
)
def test_what_a_file_says_of_a_body_is_checked(
    name: str, value: np.ndarray[tuple[int, ...], np.dtype[np.str_]] | None, message: str, tmp_path: Path
) -> None:
    path, odd = tmp_path / "run.npz", tmp_path / "odd.npz"
    carted().run(5).save(path)
    with np.load(path) as found:
        arrays = dict(found)
    arrays.pop(name)
    np.savez(odd, **arrays, **({} if value is None else {name: value}))  # type: ignore[arg-type]
    with pytest.raises(RecordingError, match=message):
        nv.load(odd)


def test_a_skeleton_reads_back_from_its_text() -> None:
    bare = Skeleton((), ())
    solid = Skeleton(("a",), (), (0, 0), 0, (Solid((0.1, 0, -1e9), (1, 2, 3)),))
    for skeleton in (SKELETON, bare, solid, Skeleton(("a", "b"), (Link(1, 1, 0.25, ((0, 1), (1, 0))),), middle=1)):
        assert skeleton_of(text_of(skeleton)) == skeleton


@pytest.mark.parametrize(
    "change",
    [
        {"points": [1]},
        {"points": "ab"},
        {"links": [[0, 1]]},
        {"links": [[0, 1, 0.1, 1]]},
        {"links": [[0, 1, 0.1, 1, 9]]},
        {"links": [[0, True, 0.1]]},
        {"links": [[0, 1, 1e999]]},
        {"feet": [2]},
        {"middle": -1},
        {"solids": [[[0, 0, 0], [1, 1]]]},
        {"solids": [[[0, 0, "x"], [1, 1, 1]]]},
    ],
)
def test_a_text_that_is_no_skeleton_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(BodyError, match="not a skeleton"):
        skeleton_of(json.dumps({**json.loads(text_of(SKELETON)), **change}))
    for text in ("", "[" * 100_000, "3"):
        with pytest.raises(BodyError, match="not a skeleton"):
            skeleton_of(text)


def test_a_run_that_fails_leaves_the_steps_until_then(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    with (
        pytest.warns(UserWarning, match="what was recorded, up to step"),
        pytest.raises(BodyError, match="at step 19: the cart is stuck"),
    ):
        carted("stuck").run_to(path, 100)
    with pytest.warns(UserWarning, match="did not come to its end"):
        read = nv.load(path)
    whole = carted("plain").run(20)
    assert same(replace(read, weights_after=whole.weights_after), whole)


# ---- a control loop leaves a recording -----------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".npz", ".mcap"])
@pytest.mark.parametrize("body", [True, False])
def test_a_control_loop_leaves_the_recording_of_the_run(suffix: str, body: bool, tmp_path: Path) -> None:
    path = tmp_path / f"walk{suffix}"
    run = carted().run(600, every=2, body=body)
    with carted().simulator(record=path, every=2, body=body) as simulation:
        for k in range(600):
            simulation.step()
            if k == 299:
                assert same(replace(simulation.recording, weights_after=run.weights_after), run.part(slice(150)))
        assert not path.exists()
    for recording in (simulation.recording, nv.load(path)):
        assert same(recording, run)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    simulation.step()  # it goes on, and is recorded no more
    assert len(simulation.recording) == 300


def test_the_loop_of_the_manual_leaves_its_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = Path(__file__).parent.parent
    text = (root / "docs/language.md").read_text(encoding="utf-8")
    code = text.partition("### Control loops")[2].partition("```python\n")[2].partition("```")[0]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "specs").symlink_to(root / "specs")
    exec(compile(code, "language.md", "exec"), {})
    assert len(nv.load(tmp_path / "loop.npz")) == 2000


def test_in_memory_a_loop_is_recorded_as_well() -> None:
    spec = SPEC.replace("A: {count: 2,", "A: {count: 2, model: leaky_integrator,")
    run = carted(spec=spec).run(300, neurons="O + A", states="A.v", weights="none")
    simulation = carted(spec=spec).simulator(record=True, neurons="O + A", states="A.v", weights="none")
    assert len(simulation.recording) == 0
    for _ in range(300):
        simulation.step()
    recording = simulation.recording
    assert recording.columns == run.columns
    assert same(recording, run)
    assert np.array_equal(recording["A.v"], run["A.v"])
    simulation.close()
    assert same(simulation.recording, run)


@pytest.mark.parametrize("ends", [KeyboardInterrupt, SystemExit])
def test_ctrl_c_ends_a_loop_and_its_recording_is_there(ends: type[BaseException], tmp_path: Path) -> None:
    path = tmp_path / "walk.npz"

    def loop() -> None:
        with carted().simulator(record=path) as simulation:
            for _ in range(7):
                simulation.step()
            raise ends

    with pytest.raises(ends):
        loop()
    assert same(nv.load(path), carted().run(7))


def test_a_loop_that_fails_leaves_a_part_and_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "walk.npz"
    carted().run(3).save(path)

    def loop() -> None:
        with carted().simulator(record=path) as simulation:
            for step in range(7, -1, -1):
                simulation.step(place=1 // step)

    with pytest.warns(UserWarning, match="what was recorded, up to step 6"), pytest.raises(ZeroDivisionError):
        loop()
    with pytest.warns(UserWarning, match="a later run did not come to its end"):
        assert len(nv.load(path)) == 3


def test_a_recorded_simulation_goes_forward_alone(tmp_path: Path) -> None:
    simulation = carted().simulator(record=tmp_path / "walk.npz")
    begin = simulation.state()
    simulation.step()
    with pytest.raises(RecordingError, match="it is recorded, and cannot go to step 0"):
        simulation.restore(begin)
    with pytest.raises(RecordingError, match="it is recorded, and cannot go to step 0"):
        simulation.reset()
    with pytest.raises(RecordingError, match="is recorded already"):
        simulation.record()
    simulation.close()
    simulation.restore(begin)
    with pytest.raises(RecordingError, match="nothing is recorded"):
        _ = carted().simulator().recording
    with pytest.raises(RecordingError, match="no format has the suffix"):
        carted().simulator(record=tmp_path / "walk.xyz")


# ---- going on exactly ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("given", ["plain", "short"])
@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_parts_of_a_run_are_the_run_in_one_go(given: str, backend: str, tmp_path: Path) -> None:
    whole, checkpoint = carted(given).run(150, backend=backend), tmp_path / "run.state"
    parts = [carted(given).run(steps, backend=backend, checkpoint=checkpoint) for steps in (40, 17, 23, 70)]
    for kind, array in zip(whole.rows._fields, whole.rows, strict=True):
        assert np.concatenate([getattr(part.rows, kind) for part in parts]).tobytes() == array.tobytes()
    carted(given).run_to(tmp_path / "a.npz", 40, checkpoint=tmp_path / "b.state", backend=backend)
    carted(given).run_to(tmp_path / "b.npz", 110, checkpoint=tmp_path / "b.state", backend=backend)
    assert nv.load(tmp_path / "b.npz").pose.tobytes() == whole.pose[40:].tobytes()  # type: ignore[union-attr,index]


@pytest.mark.parametrize("given", ["plain", "short", "whole"])
def test_a_state_goes_on_exactly_also_in_another_process(given: str) -> None:
    whole = carted(given).run(150)
    simulation = carted(given).simulator()
    for k in range(150):
        if k in (23, 40, 95):
            kept, other = simulation.state(), pickle.loads(pickle.dumps(simulation))
            for _ in range(30):
                simulation.step()
            simulation.restore(kept)
            assert (other.k, other.episode, other.ended_episode) == (k, simulation.episode, simulation.ended_episode)
            simulation = other
        assert simulation.pose is not None
        assert np.array_equal(simulation.pose, whole.pose[k])  # type: ignore[index]
        simulation.step()
        assert np.array_equal(simulation.activity, whole.activity[k])


def test_a_body_that_cannot_be_kept_is_refused_before_a_run_that_would_keep_it(tmp_path: Path) -> None:
    for given, message in (("unkept", "this cart cannot be kept"), ("whole", "cannot be put into a file")):
        with pytest.raises(BodyError, match=message):
            carted(given).run(5, checkpoint=tmp_path / "x.state")
        assert len(carted(given).run(5)) == 5
        with pytest.raises(BodyError, match=message):
            carted(given).run_to(tmp_path / "x.npz", 5, checkpoint=tmp_path / "x.state")
    assert list(tmp_path.iterdir()) == []
    simulation = carted("unkept").simulator()
    simulation.step()
    with pytest.raises(BodyError, match="cannot be kept"):
        simulation.state()
    simulation.reset()
    simulation.state()


def test_checkpoints_with_and_without_a_body_are_not_mixed(tmp_path: Path) -> None:
    with_, without = tmp_path / "with.state", tmp_path / "without.state"
    carted().run(5, checkpoint=with_)
    carted().run(5, checkpoint=without, body=False)
    with pytest.raises(RecordingError, match="a checkpoint of a run with a body"):
        carted().run(5, checkpoint=with_, body=False)
    with pytest.raises(RecordingError, match="a checkpoint of a run without a body"):
        carted().run(5, checkpoint=without)
    simulation, bare = carted().simulator(), carted().simulator(body=False)
    for one in (simulation, bare):
        one.step()
    with pytest.raises(ValueError, match="a state of a run with a body"):
        bare.restore(simulation.state())
    with pytest.raises(ValueError, match="the state of a run without a body"):
        simulation.restore(bare.state())
    simulation.save_state(tmp_path / "x.state")
    simulation.restore(tmp_path / "x.state")


def test_a_checkpoint_of_another_body_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.state"
    carted().run(5, checkpoint=path)
    with zipfile.ZipFile(path) as archive:
        arrays = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive, (tmp_path / "long.npy").open("w+b") as file:
        np.save(file, np.zeros(6))
        file.seek(0)
        for name, data in {**arrays, "body.npy": file.read()}.items():
            archive.writestr(name, data)
    with pytest.raises(BodyError, match="this is no state of a cart"):
        carted().run(5, checkpoint=path)


def test_a_run_that_goes_on_from_a_recording_begins_a_new_episode_with_a_new_seed() -> None:
    first = carted().run(60)
    second = carted().run(60, start=first)
    assert first.sensor("clock")[0] == second.sensor("clock")[0] == 0
    assert first.sensor("x")[0] != second.sensor("x")[0]
    assert np.array_equal(second.weights[0], first.weights_after)
