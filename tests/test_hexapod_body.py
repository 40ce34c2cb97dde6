"""Use case 3 on its body: feet that stand, speeds of gaits, beams that are learned, and K, which closes the loop."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.recording import Recording

FOLDER = Path(__file__).parent.parent / "specs" / "hexapod"
SPEC, BODY = FOLDER / "hexapod.yaml", Path("body", "body.yaml")
LEGS = ("left1", "left2", "left3", "right1", "right2", "right3")
#: where each gait is settled, the tripod behind the beams, and the feet that have to be down
SETTLED = {"wave": (slice(120, 360), 5), "caterpillar": (slice(430, 540), 4), "tripod": (slice(1900, 2050), 3)}


@pytest.fixture(scope="module")
def walk() -> Recording:
    return nv.compile(SPEC).run(steps=2050, body=FOLDER / BODY)


def sensed(recording: Recording, name: str) -> npt.NDArray[np.float64]:
    assert recording.sensors is not None
    assert recording.sensor_names is not None
    return np.asarray(recording.sensors[:, list(recording.sensor_names).index(name)])


def speed(recording: Recording, window: slice) -> float:
    """Metres a second."""
    way = sensed(recording, "torso_x")[window]
    return float((way[-1] - way[0]) / (0.025 * (len(way) - 1)))


def hits(recording: Recording, leg: str) -> list[float]:
    """Where the robot was, in metres, when a leg was hit."""
    hit = np.diff((recording[f"{leg}.dr"] > 0.5).astype(int)) == 1
    return [float(place) for place in sensed(recording, "torso_x")[1:][hit]]


@pytest.mark.parametrize("gait", SETTLED)
def test_enough_feet_stand(walk: Recording, gait: str) -> None:
    window, least = SETTLED[gait]
    feet = np.stack([walk[f"{leg}.F"][window] for leg in LEGS], axis=1).sum(axis=1)
    assert (feet >= least).mean() >= 0.95
    pressing = [sensed(walk, f"foot_{leg[0]}{leg[-1]}")[window] > 0 for leg in LEGS]
    assert (np.sum(pressing, axis=0) >= least).mean() >= 0.95


def test_from_gait_to_gait_it_walks_faster(walk: Recording) -> None:
    wave, caterpillar, tripod = (speed(walk, window) for window, _ in SETTLED.values())
    assert 0.03 < wave < 0.6 * caterpillar < 0.5 * tripod


def test_it_stays_level(walk: Recording) -> None:
    up = sensed(walk, "torso_up[2]")
    tilt = np.degrees(np.arccos(np.clip(up, -1, 1)))
    assert tilt[SETTLED["wave"][0]].max() < 1
    assert tilt[SETTLED["caterpillar"][0]].max() < 3
    assert tilt[60:].max() < 12  # over the beams, too


def test_the_legs_behind_learn_to_step_over_beams(walk: Recording) -> None:
    """Eight beams, 0.65 m apart: the front legs hit all of them, those behind the first few."""
    for leg in ("left1", "right1"):
        assert len(hits(walk, leg)) == 8
    assert sensed(walk, "torso_x")[-1] > 6.3
    for leg in ("left2", "right2", "left3", "right3"):
        assert 1 <= len(hits(walk, leg)) <= 5
        assert max(hits(walk, leg)) < 4
    for name in ("left1.dp -> left2.dp", "left2.dp -> left3.dp", "right1.dp -> right2.dp", "right2.dp -> right3.dp"):
        assert 1.05 < walk.weight(name)[-1] < 2.5


def test_a_hit_lasts_until_the_leg_steps_over(walk: Recording) -> None:
    """The robot is stopped for a stride or two, and goes on."""
    way = sensed(walk, "torso_x")
    assert (way[700:][60:] - way[700:][:-60] > 0.05).all()


def test_a_leg_that_k_does_not_stretch_comes_late_to_the_ground(walk: Recording, tmp_path: Path) -> None:
    spec = shutil.copytree(FOLDER, tmp_path / "hexapod") / SPEC.name
    text = spec.read_text()
    spec.write_text(text.replace("events:\n", "events:\n  - {at: 0, lesion: [right1.K -> right1.FT]}\n"))
    numb = nv.compile(spec).run(steps=540, body=spec.parent / BODY)
    window = SETTLED["caterpillar"][0]
    assert numb["right1.S"][window].sum() > 1.3 * walk["right1.S"][window].sum()
    assert numb["right1.K"][window].mean() > 1.05 * walk["right1.K"][window].mean()
    assert numb["left2.S"][window].sum() == walk["left2.S"][window].sum()


def test_without_its_body_it_feels_what_the_files_say() -> None:
    network = nv.compile(SPEC)
    assert network.network.body is None
    assert network.run(steps=700).sensors is None
