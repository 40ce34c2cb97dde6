"""What a picture runs: no more than the step and the gains need, in one run, and the command says so."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.backend import Stepper
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.state import State


def test_a_picture_takes_one_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The step and the gains are of the same run, and gains that are stated need none."""
    runs: list[int] = []
    prepare = NumpyBackend.prepare

    def counting(backend: NumpyBackend, network: Network) -> Stepper:
        made = prepare(backend, network)
        runs.append(0)

        class Counting:
            def step(self, state: State, inputs: FloatArray, /) -> None:
                runs[-1] += 1
                made.step(state, inputs)

        return Counting()

    monkeypatch.setattr(NumpyBackend, "prepare", counting)
    text = "neurovis: 1\nname: x\ntime: {steps: 300}\nneurons: {A: {count: 2, initial: [1, 0]}}\n"
    text += "connections: {A -> A: {pattern: ring, weight: 0.9}}\n"
    stated = text + "render: {gain: {activity: 1, signal: 1, thickness: 1, change: 1}}\n"
    for spec, step, wanted in ((text, 20, [300]), (text, 400, [401]), (text, None, [300]), (stated, 20, [21])):
        runs.clear()
        network = nv.compile_text(spec)
        assert network.steps_to_draw(step) == wanted[0]
        network.render(tmp_path / "x.svg", step=step)
        assert runs == wanted
        runs.clear()
        network.render(tmp_path / "y.svg", step=20)
        assert runs == [21]
    for view, wanted in (("matrix", [21]), (["network", "body"], [21]), (["network", "traces"], [300])):
        runs.clear()
        network = nv.compile_text(stated)
        assert network.steps_to_draw(20, view=view) == wanted[0]
        network.render(tmp_path / "z.svg", step=20, view=view)
        assert runs == wanted
    recording = nv.compile_text(text).run()
    runs.clear()
    again = nv.compile_text(text)
    again.render(tmp_path / "z.svg", step=20, recording=recording)
    assert runs == []
    assert (tmp_path / "z.svg").read_bytes() == render_of(text, tmp_path)


def render_of(text: str, folder: Path) -> bytes:
    nv.compile_text(text).render(folder / "fresh.svg", step=20)
    return (folder / "fresh.svg").read_bytes()


def test_the_command_says_on_a_terminal_when_it_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = tmp_path / "x.yaml"
    spec.write_text("neurovis: 1\nname: x\ntime: {steps: 300}\nneurons: {A: {bias: 1}}\n", encoding="utf-8")
    words = ["render", str(spec), "--step", "20", "-o", str(tmp_path / "x.svg")]
    assert CliRunner().invoke(neurovis, words).stderr == ""
    monkeypatch.setattr("neurovis_spec.cli.render.on_terminal", lambda: True)
    done = CliRunner().invoke(neurovis, words)
    assert done.exit_code == 0
    assert "running 300 steps, which show the range of its values" in done.stderr
    assert done.stdout == f"{tmp_path / 'x.svg'}\n"


LED = """\
neurovis: 1
name: led
time: {steps: 40}
inputs: {push: {}}
neurons: {A: {input: push}, B: {}}
connections: {A -> B: 0.5}
"""


def fills(path: Path) -> dict[str, str]:
    found = re.findall(r'data-neuron="(\w+)".*?<circle[^>]* fill="(#\w+)"', path.read_text(encoding="utf-8"), re.DOTALL)
    return dict(found)


def test_the_gains_of_a_recording_are_those_of_all_of_it(tmp_path: Path) -> None:
    """A controller that is led from outside does nothing by itself: its own run says nothing of what it is given."""
    network = nv.compile_text(LED)
    recording = network.run(inputs={"push": np.array([[10.0 * (step % 4)] for step in range(40)])})
    drawn = []
    for step in (37, 38, 39):
        network.render(tmp_path / f"{step}.svg", step=step, recording=recording)
        drawn.append(fills(tmp_path / f"{step}.svg")["A"])
    assert len(set(drawn)) == 3, "no step is saturated beside the next"
    legends = {re.findall(r">(\+[^<]*)<", path.read_text(encoding="utf-8"))[0] for path in tmp_path.iterdir()}
    assert legends == {"+30"}, "what A reaches"
    network.render(tmp_path / "own.svg", step=39)
    assert ">+30<" not in (tmp_path / "own.svg").read_text(encoding="utf-8")


def test_a_film_of_a_recording_has_the_colours_of_its_pictures(tmp_path: Path) -> None:
    network = nv.compile_text(LED)
    recording = network.run(inputs={"push": np.array([[10.0 * (step % 4)] for step in range(40)])})
    for step in (1, 2):  # one that is part of the other's film: the gains are those of all of the recording
        network.render(tmp_path / "still.svg", step=step, recording=recording)
        network.animate(tmp_path / "film.svg", start=step, steps=2, recording=recording)
        assert fills(tmp_path / "film.svg") == fills(tmp_path / "still.svg")


def test_a_recording_of_every_other_step_has_gains_but_no_glow(tmp_path: Path) -> None:
    """What a weight has changed in two steps is no change of one."""
    text = "neurovis: 1\nname: x\ntime: {steps: 60}\nneurons: {A: {bias: 1}, B: {bias: 0.5}}\n"
    network = nv.compile_text(text + "connections: {A -> B: {weight: 0.1, plasticity: {hebbian: {rate: 0.01}}}}\n")
    for every, glows in ((1, True), (2, False)):
        network.render(tmp_path / "x.svg", recording=network.run(every=every))
        assert ('class="glow"' in (tmp_path / "x.svg").read_text(encoding="utf-8")) == glows
