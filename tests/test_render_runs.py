"""What a picture runs: no more than the step and the gains need, in one run, and the command says so."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiler.network import Network
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.record import Course, Rows, go
from neurovis_spec.runtime.state import State


def test_a_picture_takes_one_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The step and the gains are of the same run, and gains that are stated need none."""
    runs: list[int] = []

    def counted(of: Network, state: State, course: Course, rows: Rows, progress: Progress | None = None) -> None:
        runs.append(course.steps)
        go(of, state, course, rows, progress)

    monkeypatch.setattr("neurovis_spec.runtime.record.go", counted)
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
    recording = nv.compile_text(text).run()
    runs.clear()
    again = nv.compile_text(text)
    again.render(tmp_path / "z.svg", step=20, recording=recording)
    assert runs == [300]
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
