"""What is written can be read back: layouts, recordings, the whole way from a spec in a file to a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from examples import EXAMPLES, shipped
from hypothesis import HealthCheck, given, settings
from laws import examples
from random_specs import Spec, specs

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.diagnostics import Findings
from neurovis_spec.layout.file import parse
from neurovis_spec.scene.probe import probe_steps

#: Steps beyond which an example is cut short here: its pictures over time need no more.
ENOUGH = 5_000


def short(path: Path) -> CompiledNetwork:
    """An example, of which a long run is made shorter."""
    network = shipped(path)
    if network.network.steps <= ENOUGH:
        return network
    text = path.read_text(encoding="utf-8")
    written = f"steps: {network.network.steps}"
    assert written in text
    return nv.compile_text(text.replace(written, f"steps: {ENOUGH // 2}"), folder=path.parent)


@settings(examples(6), suppress_health_check=[HealthCheck.too_slow])
@given(specs())
def test_a_layout_file_reads_back_exactly(spec: Spec) -> None:
    layout = nv.compile(spec).layout()
    findings = Findings()
    again = parse(layout.dump(), "layout.yaml", findings)
    assert findings.sorted() == ()
    assert again == layout.value


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_a_recording_reads_back_exactly(path: Path, tmp_path: Path) -> None:
    network = shipped(path)
    recording = network.run(50)
    recording.save(tmp_path / "run.npz")
    again = nv.load(tmp_path / "run.npz")
    assert again.neurons == recording.neurons
    np.testing.assert_array_equal(again.activity, recording.activity)
    np.testing.assert_array_equal(again.weights, recording.weights)
    for name in recording.connection_names:
        np.testing.assert_array_equal(again.weight(name), recording.weight(name))
    for output in network.network.outputs:
        np.testing.assert_array_equal(again[output.name], recording[output.name])


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_a_step_looks_the_same_run_or_recorded(path: Path, tmp_path: Path) -> None:
    """The gains, and what views over time show, come from the recording, else from the default run: here these are the
    same."""
    network = short(path)
    shown = network.network.steps if len(network.network.render.figure) > 1 else 31
    network.run(max(shown, probe_steps(network.network))).save(tmp_path / "run.npz")
    network.render(tmp_path / "recorded.svg", step=30, recording=nv.load(tmp_path / "run.npz"))
    network.render(tmp_path / "run.svg", step=30)
    assert (tmp_path / "recorded.svg").read_bytes() == (tmp_path / "run.svg").read_bytes()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_becomes_every_kind_of_picture(path: Path, tmp_path: Path) -> None:
    network = short(path)
    for name in ("still.svg", "still.png"):
        network.render(tmp_path / name, step=5)
    network.animate(tmp_path / "film.svg", steps=8)
    heads = {name: (tmp_path / name).read_bytes()[:8] for name in ("still.svg", "still.png", "film.svg")}
    assert heads["still.png"] == b"\x89PNG\r\n\x1a\n"
    assert heads["still.svg"].startswith(b"<svg") or heads["still.svg"].startswith(b"<?xml")
    assert b"<animate" in (tmp_path / "film.svg").read_bytes() or path.stem == "mlp"
    assert b"<script" not in (tmp_path / "film.svg").read_bytes()


def test_going_on_from_a_recording_keeps_what_was_learned(tmp_path: Path) -> None:
    network = shipped(EXAMPLES[[path.stem for path in EXAMPLES].index("cpg_rbf")])
    first = network.run(6_000)
    first.save(tmp_path / "first.npz")
    second = network.run(1, start=nv.load(tmp_path / "first.npz"))
    np.testing.assert_array_equal(second.weights[0], first.weights_after)
    assert np.abs(second.weights[0]).max() > 0.3
