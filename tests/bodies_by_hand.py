"""Bodies by hand: a hexapod whose legs go forward and back by sines, and recordings that hold its poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.body import Link, Skeleton, Solid
from neurovis_spec.runtime.recording import Recording

LEGS = tuple((f"{side}{pair}", 0.12 * (2 - pair), 1 if side == "l" else -1) for side in "lr" for pair in (1, 2, 3))
HEIGHT = 0.112


def hexapod(rows: int, turn: float = 0.0, solids: Sequence[Solid] = ()) -> tuple[Skeleton, FloatArray]:
    """A hexapod of 18 joints that walks in tripods, 12 cm a second, turning by so many radians a second, and its poses
    at steps of 0.05 s."""
    names, links, feet = ["torso", "front", "hind"], [Link(1, 2, 0.04)], []
    for name, _, _ in LEGS:
        base = len(names)
        names += [f"{name}_{part}" for part in ("bc", "cf", "ft", "foot")]
        links += [Link(base + at, base + at + 1, radius) for at, radius in enumerate((0.014, 0.012, 0.01))]
        feet.append(base + 3)
    skeleton = Skeleton(tuple(names), tuple(links), tuple(feet), 0, tuple(solids))
    return skeleton, np.array([_pose(0.05 * row, turn) for row in range(rows)])


def _pose(seconds: float, turn: float) -> list[float]:
    points, touching = [(0.0, 0.0, HEIGHT), (0.15, 0.0, HEIGHT), (-0.15, 0.0, HEIGHT)], []
    for number, (_, ahead, side) in enumerate(LEGS):
        phase = 5.0 * seconds + np.pi * (number % 2)
        swing, lift = -0.35 * np.cos(phase), max(0.0, round(0.04 * np.sin(phase), 9))
        out = np.array([np.sin(swing), side * np.cos(swing), 0.0])
        hip = np.array([ahead, 0.05 * side, HEIGHT])
        knee = hip + 0.1 * out + (0, 0, lift)
        points += [tuple(part.tolist()) for part in (hip, hip + 0.03 * out, knee, knee - (0, 0, 0.1))]
        touching.append(float(lift == 0))
    cos, sin = np.cos(turn * seconds), np.sin(turn * seconds)
    placed = [(0.12 * seconds + cos * x - sin * y, sin * x + cos * y, z) for x, y, z in points]
    return [*(number for point in placed for number in point), *touching]


def posed(recording: Recording, skeleton: Skeleton, poses: FloatArray) -> Recording:
    """The recording with poses, one a row."""
    assert len(poses) == len(recording)
    return replace(recording, pose=poses, skeleton=skeleton)
