"""Bodies where networks are run: the live view, trials, sweeps, the command line, and files with another body."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from toy_bodies import BODY, SKELETON, SPEC, carted, registered

import neurovis_spec as nv
from neurovis_spec import analysis, api
from neurovis_spec.analysis import report
from neurovis_spec.body import BodyError
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.diagnostics import SpecError
from neurovis_spec.live.carry import carried
from neurovis_spec.live.past import Kept
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.saving import recording as saved
from neurovis_spec.live.saving import told_by
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import Reach, Seen, SourceError
from neurovis_spec.live.turns import Set
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene.fading import Fading
from neurovis_spec.sweeps.grid import SweepError
from neurovis_spec.sweeps.sweep import sweep

WITH_BODY = SPEC + BODY


@pytest.fixture(autouse=True)
def _carts(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch)


def same(one: Seen, other: Seen) -> bool:
    pairs = [(getattr(one.snapshot, name), getattr(other.snapshot, name)) for name in ("activity", "weights", "pose")]
    return one.snapshot.step == other.snapshot.step and all(np.array_equal(a, b) for a, b in pairs)


def seen(source: SimulatedSource, steps: int) -> list[Seen]:
    found = [source.seen()]
    while source.step < steps:
        assert source.advance()
        found.append(source.seen())
    return found


# ---- the live view -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("given", ["plain", "short", "whole"])
def test_live_shows_the_run_and_goes_back_exactly(given: str) -> None:
    run = carted(given).run(200)
    source = SimulatedSource(carted(given).simulator())
    first = seen(source, 199)
    assert source.body.skeleton == SKELETON
    assert source.body.sensor_names == run.sensor_names
    for step, one in enumerate(first):
        assert np.array_equal(one.snapshot.pose, run.pose[step])  # type: ignore[index,arg-type]
        assert np.array_equal(one.snapshot.sensors, run.sensors[step])  # type: ignore[index,arg-type]
    for step in (150, 41, 40, 39, 3, 199, 90):
        source.go(step)
        assert same(source.seen(), first[step])
    assert all(same(a, b) for a, b in zip(source.recall(30), first[61:91], strict=True))
    source.restart()
    assert all(same(a, b) for a, b in zip(seen(source, 60), first, strict=False))


def test_a_turn_is_taken_again_with_the_body() -> None:
    source = SimulatedSource(carted().simulator())
    seen(source, 70)
    source.turn(Set({"gain": -3.0}))
    after = seen(source, 120)
    source.go(20)
    source.go(120)
    assert same(source.seen(), after[-1])
    assert not same(after[-1], seen(SimulatedSource(carted().simulator()), 120)[-1])


def test_states_of_bodies_that_nobody_can_measure_fill_the_past_as_well() -> None:
    sizes = {}
    for given in ("plain", "whole"):
        simulation = carted(given).simulator()
        simulation.step()
        sizes[given] = Kept(simulation.state(), {}, Fading(simulation.network)).size
    assert sizes["plain"] < 10_000
    assert sizes["whole"] > 1_000_000


def test_where_a_body_cannot_be_kept_there_is_no_going_back() -> None:
    source, run = SimulatedSource(carted("unkept", each_episode=False).simulator()), carted().run(200)
    seen(source, 150)
    assert source.reach == Reach(150, 150)
    with pytest.raises(SourceError, match="step 149 is out of reach"):
        source.go(149)
    source.turn(Set({"gain": 0.1}))
    seen(source, 160)
    source.restart()
    assert np.array_equal(source.seen().snapshot.activity, run.activity[0])


def test_a_body_that_cannot_go_on_stops_the_live_view_where_it_is() -> None:
    source = SimulatedSource(carted("stuck").simulator())
    first = seen(source, 18)
    with pytest.raises(SourceError, match="at step 19: the cart is stuck"):
        source.advance()
    assert same(source.seen(), first[18])
    source.go(18)
    source.go(5)
    assert same(source.seen(), first[5])
    source.go(18)
    source.turn(Set({"gain": 0.1}))
    with pytest.raises(SourceError, match="at step 19: the cart is stuck"):
        source.advance()
    assert source.step == 18


def test_what_is_saved_of_a_live_view_has_the_body(tmp_path: Path) -> None:
    source, run = SimulatedSource(carted().simulator()), carted().run(31)
    seen(source, 30)
    path = tmp_path / "x.npz"
    path.write_bytes(saved(carted().network, told_by(source, 31)))
    read = nv.load(path)
    assert read.skeleton == SKELETON
    assert read.pose.tobytes() == run.pose.tobytes()  # type: ignore[union-attr]
    assert read.sensor("arm").tobytes() == run.sensor("arm").tobytes()
    played = RecordedSource(carted().network, read)
    assert played.body == replace(source.body, motors=()), "a recording holds no commands"
    played.go(12)
    assert np.array_equal(played.seen().snapshot.pose, run.pose[12])  # type: ignore[index,arg-type]


def test_an_edited_spec_goes_on_with_its_body_and_another_body_begins_anew() -> None:
    def edited(given: str, spec: str = SPEC) -> SimulatedSource:
        source = SimulatedSource(carted().simulator())
        seen(source, 50)
        return carried(source, carted(given, spec).simulator())

    run = carted().run(52)
    assert same(edited("plain").seen(), seen(SimulatedSource(carted().simulator()), 50)[-1])
    other = edited("plain", SPEC.replace("weight: -0.7", "weight: -0.6"))
    assert np.array_equal(other.seen().snapshot.pose, run.pose[50])  # type: ignore[index,arg-type]
    anew = edited("short")
    assert anew.step == 50
    assert np.array_equal(anew.seen().snapshot.pose, run.pose[0])  # type: ignore[index,arg-type]


def test_an_edit_with_which_the_body_cannot_go_on_leaves_the_old_run(tmp_path: Path) -> None:
    source, whole = SimulatedSource(carted().simulator()), seen(SimulatedSource(carted().simulator()), 80)
    seen(source, 50)
    broken = api.compile_text(WITH_BODY.replace("gain * drive", "gain * drive / (drive - drive)"))
    with pytest.raises(SourceError, match="at step 50: the command of 'push' is"):
        carried(source, broken.simulator())
    assert same(source.seen(), whole[50])
    assert all(same(a, b) for a, b in zip(seen(source, 80), whole[50:], strict=True))
    source.go(45)
    assert same(source.seen(), whole[45])


# ---- trials and sweeps ---------------------------------------------------------------------------------------------


def test_trials_begin_with_the_body_where_it_was() -> None:
    """A lesion of what the cart is pushed by changes what it senses later; nothing changed changes nothing."""
    trials = analysis.trials.Trials(carted(), start=50, steps=20)
    run = carted().run(70)
    assert np.array_equal(trials.activity, run.activity[50:])
    assert np.array_equal(trials.changed(lambda simulation: None), trials.intact)
    assert np.array_equal(trials.given[:, 0], run.sensor("x")[50:])
    lost = analysis.importance(carted(), start=50, steps=20)
    assert lost["W", "lesion"] > 0
    with pytest.raises(BodyError, match="cannot be kept"):
        analysis.importance(carted("unkept"), start=50, steps=20)


def test_trials_that_would_take_too_long_with_a_body_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, "_LONGEST", 10_000 * 10 * 40)
    for body, left_out in ((True, 2), (False, 0)):
        network = api.compile_text(WITH_BODY, body=body)
        report.analyze(network, tmp_path / str(body), network.run(20), report.ReportOptions(start=0, stop=40))
        text = (tmp_path / str(body) / "index.html").read_text(encoding="utf-8")
        assert text.count("take too long") == left_out


def test_a_sweep_runs_each_point_with_its_body(tmp_path: Path) -> None:
    table = sweep(spec_file(tmp_path), {"gain": "0:1:3", "seed": "0..1"}, ["mean(P)", "P"], steps=60)
    bare = sweep(spec_file(tmp_path), {"gain": "0:1:3", "seed": "0..1"}, ["mean(P)", "P"], steps=60, body=False)
    assert table["error"] == (None,) * 6
    for row in range(6):
        gain, seed = table["gain"][row], table["seed"][row]
        run = api.compile_text(WITH_BODY, gain=gain, seed=int(seed)).run(60)  # type: ignore[arg-type]
        assert table["P"][row] == run["P"][-1]
    assert len(set(table["P"])) == 6
    assert set(bare["P"]) == {np.tanh(0.5)}
    with pytest.raises(SweepError, match="a body is not sent to a cluster"):
        sweep(spec_file(tmp_path), {"gain": "0,1"}, ["P"], scheduler="tcp://127.0.0.1:1")
    broken = sweep(spec_file(tmp_path, "stuck"), {"gain": "0,1"}, ["P"], steps=60)
    assert broken["error"] == ("body: at step 19: the cart is stuck",) * 2


def spec_file(folder: Path, given: str = "plain") -> Path:
    path = folder / f"{given}.yaml"
    path.write_text(WITH_BODY.replace("toy: plain", f"toy: {given}"))
    return path


# ---- the spec, another body, the command line ----------------------------------------------------------------------


def test_the_body_of_a_spec_is_that_of_the_settings() -> None:
    body, settings = api.compile_text(WITH_BODY).network.body, carted().network.body
    assert body is not None
    assert settings is not None
    assert replace(body, moved=()) == replace(settings, moved=())
    assert np.array_equal(api.compile_text(WITH_BODY).run().activity, carted().run().activity)


def test_another_body_takes_the_place_of_that_of_the_spec(tmp_path: Path) -> None:
    file = tmp_path / "other.yaml"
    file.write_text("name: another spec\n" + BODY.replace("toy: plain", "toy: short").replace("gain * drive", "1"))
    compiled = api.compile_text(WITH_BODY, gain=0.5)
    other = compiled.run(100, body=file)
    assert compiled.network.body is not None
    assert not np.array_equal(other.sensor("x"), compiled.run(100).sensor("x"))
    direct = api.compile_text(SPEC, gain=0.5, body=str(file))
    assert np.array_equal(other.activity, direct.run(100).activity)
    compiled.run_to(tmp_path / "x.npz", 100, body=str(file))
    assert np.array_equal(nv.load(tmp_path / "x.npz").sensor("x"), other.sensor("x"))
    with compiled.simulator(body=file, record=True) as simulation:
        for _ in range(100):
            simulation.step()
    assert np.array_equal(simulation.recording.activity, other.activity)
    assert file.resolve() in compiled.with_body(file).files


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("neurons: {A: {}}", "error\\[missing-key\\]: the file names no body"),
        ("body: {toy: plain, sensors: {plac: x}}", "there is no input 'plac'"),
        ("body: {toy: plain, sensors: {place: y}}", "the body has no sensor 'y'"),
        ("body: {toy: gone}", "there is no such cart"),
        ("body: [", "error"),
    ],
)
def test_what_is_invalid_in_the_file_of_a_body_is_told_with_its_place(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "other.yaml"
    file.write_text(text)
    for compiles in (lambda: api.compile_text(WITH_BODY, body=file), lambda: api.compile_text(SPEC).run(body=file)):
        with pytest.raises(SpecError, match=message) as raised:
            compiles()
        assert raised.value.diagnostics[0].span.file == str(file)


def test_validate_checks_the_file_of_a_body_beside_the_spec(tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    other.write_text("body: {toy: plain, sensors: {place: y}}")
    checked = invoke("validate", spec_file(tmp_path), "--body", other)
    assert checked.exit_code == 1
    assert f"{other}:1:37: error[unknown-sensor]: the body has no sensor 'y'" in checked.output
    gone = spec_file(tmp_path, "gone")
    assert invoke("validate", gone).exit_code == 1
    assert invoke("validate", gone, "--no-body").exit_code == 0


def test_a_body_is_a_path_or_whether_there_is_one() -> None:
    with pytest.raises(TypeError, match="'body' is a path, not int"):
        api.compile_text(WITH_BODY, body=3)  # type: ignore[arg-type]
    with pytest.raises(SpecError, match=r"nowhere\.yaml"):
        api.compile_text(WITH_BODY, body="nowhere.yaml")


def test_without_its_body_a_broken_one_is_in_nobodys_way() -> None:
    broken = WITH_BODY.replace("toy: plain", "toy: gone")
    with pytest.raises(SpecError, match="there is no such cart"):
        api.compile_text(broken)
    without = api.compile_text(broken, body=False)
    assert without.warnings == ()  # its commands read 'gain'
    assert np.array_equal(without.run(20).activity, api.compile_text(SPEC).run(20).activity)


def invoke(*words: object) -> Result:
    return CliRunner().invoke(neurovis, [str(word) for word in words])


def test_the_commands_run_with_the_body_with_another_and_without(tmp_path: Path) -> None:
    spec, other = spec_file(tmp_path), tmp_path / "other.yaml"
    other.write_text(BODY.replace("gain * drive", "1"))

    def ran(*more: object) -> Recording:
        done = invoke("run", spec, "--steps", 50, "-o", tmp_path / "x.npz", *more)
        assert done.exit_code == 0, done.output
        return nv.load(tmp_path / "x.npz")

    assert np.array_equal(ran().sensor("x"), carted().run(50).sensor("x"))
    assert not np.array_equal(ran("--body", other).sensor("x"), carted().run(50).sensor("x"))
    assert ran("--no-body").sensors is None
    metric = ("--over", "gain=0,1", "--metric", "P", "--jobs", 1)
    assert invoke("sweep", spec, *metric, "--no-body").output.split()[-1] == f"1,{np.tanh(0.5)},"
    assert invoke("sweep", spec, *metric).output.split()[-1] != f"1,{np.tanh(0.5)},"
    assert invoke("render", spec, "--step", 3, "-o", tmp_path / "x.svg", "--no-body").exit_code == 0
    assert '"lift"' in invoke("inspect", spec, "--format", "json").output
    bare = invoke("inspect", spec, "--format", "json", "--no-body")
    assert bare.exit_code == 0
    assert '"lift"' not in bare.output
    assert invoke("validate", spec, "--body", other).exit_code == 0
    both = invoke("run", spec, "--no-body", "--body", other)
    assert both.exit_code == 2
    assert "--body names a body, and --no-body asks for none" in both.output
    lost = invoke("run", spec, "--body", other, "-o", other.with_suffix(".npz"))
    assert lost.exit_code == 0, lost.output
    stuck = invoke("run", spec_file(tmp_path, "stuck"))
    assert stuck.exit_code == 1
    assert "error: at step 19: the cart is stuck" in stuck.output


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> None:
    """No MuJoCo is installed."""
    monkeypatch.setitem(sys.modules, "mujoco", None)
    for name in [name for name in sys.modules if name.startswith("neurovis_bodies.")]:
        monkeypatch.delitem(sys.modules, name)


def test_where_what_a_body_needs_is_missing_runs_say_so_and_pictures_are_drawn(bare: None, tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text(WITH_BODY.replace("toy: plain", "mujoco: cart.xml"))
    (tmp_path / "cart.xml").write_text("<mujoco/>")
    sweeping = ["sweep", spec, "--over", "gain=0,1", "--metric", "P", "--jobs", 1, "-o", tmp_path / "x.csv"]
    for command in (["run", spec], ["live", spec], ["render", spec, "--step", 3, "-o", tmp_path / "x.svg"], sweeping):
        refused = invoke(*command)
        assert refused.exit_code == 1
        assert "a body of MuJoCo needs what is not installed" in refused.output.splitlines()[-2]
        assert "pip install 'neurovis-spec[sim]'" in refused.output.splitlines()[-1]
        if command[0] != "live":
            assert invoke(*command, "--no-body").exit_code == 0
    assert nv.sweep(spec, {"gain": "0,1"}, ["P"], path=tmp_path / "x.csv", body=False)["error"] == (None, None)
    assert invoke("layout", spec, "-o", tmp_path / "l.json").exit_code == 0
    network = api.compile(spec)
    network.drawn()._repr_svg_()
    with pytest.raises(BodyError) as raised:
        network.run(3)
    assert raised.value.__notes__ == ["pip install 'neurovis-spec[sim]'"]  # a traceback shows it
    report.analyze(network, tmp_path / "page", network.run(20, body=False))
    assert "pip install" in (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
