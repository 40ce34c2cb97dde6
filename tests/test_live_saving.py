"""Files of a live run: the picture and the film that the page has, and a recording with every bit."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np

import neurovis_spec as nv
from neurovis_spec import pipeline
from neurovis_spec.live.saving import film, picture, recording, steps_for
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.turns import Lesion, Set
from neurovis_spec.live.view import view_of

COMPILED = nv.compile(Path(__file__).parents[1] / "specs/cpg_rbf.yaml")


def test_the_last_steps_are_recalled_and_the_run_goes_on() -> None:
    source = SimulatedSource(COMPILED.simulator())
    for _ in range(150):
        source.advance()
    source.turn(Set({"eta": 0.5}))
    seen = source.recall(100)
    assert [one.snapshot.step for one in seen] == list(range(51, 151))
    assert source.step == 150
    assert source.parameters["eta"] == 0.5
    source.advance()
    assert source.step == 151
    run = COMPILED.run(152)
    assert all(np.array_equal(one.snapshot.activity, run.activity[one.snapshot.step]) for one in seen)


def test_a_recording_has_every_bit(tmp_path: Path) -> None:
    source = SimulatedSource(COMPILED.simulator())
    for _ in range(200):
        source.advance()
    (tmp_path / "x.npz").write_bytes(recording(COMPILED.network, source.recall(1000), source.parameters))
    found, run = nv.load(tmp_path / "x.npz"), COMPILED.run(200)
    assert np.array_equal(found.activity, run.activity)
    assert np.array_equal(found.weights, run.weights)
    assert np.array_equal(found.weights_after, run.weights_after)
    assert (found.step == run.step).all()
    assert found.hash == run.hash
    assert COMPILED.run(5, start=found).activity.tolist() == COMPILED.run(5, start=run).activity.tolist()


def test_the_picture_is_that_of_render() -> None:
    view = view_of(COMPILED, COMPILED.gains)
    source = SimulatedSource(COMPILED.simulator())
    (seen,) = source.recall(1)
    snapshot, layout = COMPILED.run(1).snapshot(0), COMPILED.drawn().value
    scene = pipeline.picture(COMPILED.network, layout, snapshot, COMPILED.gains, COMPILED.network.render)
    assert picture(view, seen) == pipeline.draw(scene, ".svg")


def test_what_was_lesioned_by_hand_is_faint_in_picture_and_film() -> None:
    view = view_of(COMPILED, COMPILED.gains)
    source = SimulatedSource(COMPILED.simulator())
    for _ in range(20):
        source.advance()
    before = source.recall(1)[-1]
    source.turn(Lesion("K3"))
    for _ in range(20):
        source.advance()
    seen = source.recall(30)
    assert picture(view, seen[-1]).count(b"opacity") > picture(view, before).count(b"opacity")
    moving = film(view, seen)
    assert re.search(rb"<animate|@keyframes", moving)
    assert io.BytesIO(moving).read(4) in (b"<svg", b"<?xm")


def test_memory_is_bounded() -> None:
    assert steps_for(COMPILED.network, 5) == 100, "20 steps a second"
    assert steps_for(COMPILED.network, None) == 10_000
