"""Checkpoints: a run in parts is bit for bit the run in one go; what is no checkpoint of a network is refused."""

from __future__ import annotations

import signal
import zipfile
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.simulation import Simulation

SPEC = """\
neurovis: 1
name: parts
time: {steps: 60, episode: 7}
seed: 3
parameters: {g: 0.5, level: 0.25}
inputs: {drive: {expression: g*sin(k/5)}, reward: {expression: cos(k)}}
neurons:
  A: {count: 3, model: adaptive, bias: 0.5, input: drive, noise: "normal(0, 0.1)"}
  B: {model: leaky_integrator, initial: 0.3}
  O: {activation: tanh}
connections:
  - A -> B: {weight: g, delay: 4}
  - A -> O: {weight: 0.1, delay: 3, plasticity: {reward_modulated: {policy: A1, reward: reward}}}
  - B -> O: {weight: 0.2, plasticity: {oja: {rate: 0.01}}}
  - O -> A: 0.3
events:
  - {at: 10, set: {g: g + 0.25}}
  - {from: 12, to: 45, clamp: {A2: level}}
  - {from: 18, to: 30, clamp: {A1..A2: 0.75}}
  - {at: 20, lesion: [A3, B -> O]}
  - {at: 25, set: {level: 0.1}}
  - {at: 33, mend: [A3]}
  - {at: 35, learning: {A -> O: false}}
  - {at: 50, learning: {A -> O: true}}
"""


@pytest.fixture(scope="module")
def network() -> nv.CompiledNetwork:
    return nv.compile_text(SPEC)


def same(whole: Recording, parts: list[Recording]) -> None:
    """The parts one behind the other are the whole, every bit."""
    for name in ("step", "activity", "weights", "states"):
        joined = np.concatenate([getattr(part, name) for part in parts])
        assert joined.tobytes() == getattr(whole, name).tobytes(), name
    assert parts[-1].weights_after.tobytes() == whole.weights_after.tobytes()
    assert parts[-1].reached == whole.reached


@pytest.mark.parametrize("backend", ["numpy", "reference"])
@pytest.mark.parametrize("cut", [1, 10, 12, 20, 29, 33, 59])
def test_a_run_in_parts_is_the_run_in_one_go(
    network: nv.CompiledNetwork, tmp_path: Path, cut: int, backend: str
) -> None:
    whole = network.run(60, states=["A.v"], backend=backend)
    file = tmp_path / "run.state"
    parts = [network.run(n, states=["A.v"], backend=backend, checkpoint=file) for n in (cut, 60 - cut)]
    same(whole, parts)


@pytest.mark.parametrize("suffix", ["npz", "csv"])
def test_parts_in_files_keep_their_steps(network: nv.CompiledNetwork, tmp_path: Path, suffix: str) -> None:
    file, cuts = tmp_path / "run.state", (0, 13, 26, 27, 60)
    paths = [tmp_path / f"{number}.{suffix}" for number in range(4)]
    for path, (a, b) in zip(paths, pairwise(cuts), strict=True):
        network.run_to(path, b - a, every=3, checkpoint=file)
    whole, parts = network.run(60, every=3), [nv.load(path) for path in paths]
    assert [part.step[0] for part in parts if len(part)] == [0, 15, 27]
    assert np.array_equal(np.concatenate([part.step for part in parts]), whole.step)
    assert np.array_equal(np.concatenate([part.activity for part in parts]), whole.activity)


def test_a_simulation_goes_on_from_a_file(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    def go(simulation: Simulation, steps: int) -> list[bytes]:
        rows = []
        for _ in range(steps):
            simulation.step()
            rows.append(simulation.activity.tobytes() + simulation.weights.tobytes())
        return rows

    first = network.simulator()
    go(first, 20)
    first.set(g=0.9)  # after the events of step 20
    first.clamp("B", 0.125)
    first.lesion("O -> A")
    first.save_state(tmp_path / "x.state")
    second = network.simulator()
    second.restore(tmp_path / "x.state")
    assert second.parameters == first.parameters
    assert go(second, 30) == go(first, 30)
    second.restore(tmp_path / "x.state")
    second.release("B")
    assert second.k == 20


def test_a_run_takes_what_a_simulation_left(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    simulation = network.simulator()
    for _ in range(20):
        simulation.step()
    simulation.save_state(tmp_path / "x.state")
    part = network.run(40, checkpoint=tmp_path / "x.state")
    assert part.activity.tobytes() == network.run(60).activity[20:].tobytes()


def test_inputs_go_on_at_their_row(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    given = {"drive": np.linspace(-1, 1, 60)}
    parts = [network.run(n, given, checkpoint=tmp_path / "x.state") for n in (25, 35)]
    same(network.run(60, given), parts)


def test_another_network_is_refused(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    network.run(5, checkpoint=tmp_path / "x.state")
    for other in (nv.compile_text(SPEC, g=0.6), nv.compile_text(SPEC, seed=4)):
        with pytest.raises(RecordingError, match="of another network"):
            other.run(5, checkpoint=tmp_path / "x.state")
    with pytest.raises(RecordingError, match="not from both"):
        network.run(5, start=network.run(5), checkpoint=tmp_path / "x.state")


def damage(path: Path, change: Callable[[dict[str, np.ndarray]], None]) -> None:
    """Write the arrays of a checkpoint anew, some of them changed."""
    with np.load(path) as file:
        arrays = dict(file)
    change(arrays)
    with path.open("wb") as file:
        np.savez(file, **arrays)


HOSTILE: dict[str, Callable[[dict[str, np.ndarray]], None]] = {
    "missing": lambda a: a.__delitem__("signals"),
    "long": lambda a: a.update(activity=np.zeros(10**6)),
    "texts": lambda a: a.update(weights=np.array(["x"] * 5)),
    "shape": lambda a: a.update(history=a["history"].T),
    "clamps": lambda a: a.update(clamps=np.array([[5, 7, 1]]), clamped=np.array([0]), clamp_values=np.array([0.0])),
    "neurons": lambda a: a.update(clamps=np.array([[5, -1, 1]]), clamped=np.array([99]), clamp_values=np.array([0.0])),
    "counts": lambda a: a.update(clamps=np.array([[5, -1, -1]]), clamped=np.zeros(0, int), clamp_values=np.zeros(1)),
    "sum of counts": lambda a: a.update(
        clamps=np.array([[5, -1, 1 << 62]] * 4), clamped=np.zeros(0, int), clamp_values=np.zeros(4)
    ),
    "held": lambda a: a.update(held_order=a["held_order"] + 9),
    "text": lambda a: a.update(about=np.array("[" * 900)),
    "steps": lambda a: a.update(about=np.array(str(a["about"]).replace('"k": 5', '"k": -5'))),
    "float": lambda a: a.update(about=np.array(str(a["about"]).replace('"k": 5', '"k": 1e300'))),
    "pickle": lambda a: a.update(cells=np.array([{}], dtype=object)),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused(network: nv.CompiledNetwork, tmp_path: Path, name: str) -> None:
    path = tmp_path / "x.state"
    network.run(5, checkpoint=path)
    damage(path, HOSTILE[name])
    with pytest.raises(RecordingError, match=r"x\.state: "):
        network.simulator().restore(path)


def test_no_archive_a_bomb_and_a_folder_are_refused(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    path = tmp_path / "x.state"
    path.write_bytes(b"PK\x03\x04 no archive")
    with pytest.raises(RecordingError):
        network.simulator().restore(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("about.npy", bytes(10**8))
    with pytest.raises(RecordingError, match="not a checkpoint"):
        network.simulator().restore(path)
    with pytest.raises(RecordingError):
        network.simulator().restore(tmp_path)


def test_a_checkpoint_cut_off_anywhere_is_refused(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    path = tmp_path / "x.state"
    network.run(5, checkpoint=path)
    whole = path.read_bytes()
    for end in range(0, len(whole) - 1, 97):
        path.write_bytes(whole[:end])
        with pytest.raises(RecordingError):
            network.simulator().restore(path)


def test_a_signal_leaves_a_checkpoint(tmp_path: Path) -> None:
    network = nv.compile_text(SPEC.replace("steps: 60", "steps: 10000000"))

    def stop(done: int, total: int) -> None:
        if done < 2000:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        network.run_to(tmp_path / "x.npz", checkpoint=tmp_path / "x.state", progress=stop)
    first = nv.load(tmp_path / "x.npz")
    second = network.run(50, checkpoint=tmp_path / "x.state")
    assert second.step[0] == len(first)
    same(network.run(len(first) + 50), [first, second])


def test_the_command_goes_on(tmp_path: Path) -> None:
    spec, state = tmp_path / "x.yaml", tmp_path / "x.state"
    spec.write_text(SPEC, encoding="utf-8")
    for name, steps in (("a", "20"), ("b", "40")):
        run = ["run", str(spec), "--steps", steps, "--checkpoint", str(state), "-o", str(tmp_path / f"{name}.npz")]
        assert CliRunner().invoke(neurovis, run).exit_code == 0
    same(nv.compile(spec).run(60), [nv.load(tmp_path / "a.npz"), nv.load(tmp_path / "b.npz")])
    shown = CliRunner().invoke(neurovis, ["run", str(spec), "--steps", "1", "--checkpoint", str(state)])
    assert "at step 60" in shown.stdout
    for other in (["--set", "g=0.1"], ["--from", str(tmp_path / "a.npz")]):
        refused = CliRunner().invoke(neurovis, ["run", str(spec), "--checkpoint", str(state), *other])
        assert refused.exit_code == 1
        assert "checkpoint" in refused.stderr
    same_file = CliRunner().invoke(neurovis, ["run", str(spec), "--checkpoint", str(spec)])
    assert same_file.exit_code == 2
