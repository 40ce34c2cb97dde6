"""Beams across the hexapod's way, anywhere: what its inputs are, and who hits them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

import neurovis_spec as nv

SPEC = Path(__file__).resolve().parent.parent / "specs" / "hexapod" / "hexapod.yaml"
#: the step at which the front legs meet the first beam (the tripod gait is settled), steps a beam is in the way
FIRST, STRIDE = 600, 20
WARNED = ("left2", "right2", "left3", "right3")

Hits = npt.NDArray[np.int_]


@dataclass(frozen=True)
class Arrangement:
    """Beams across the way, in steps: from one to the next, until the middle and hind legs are there, jitter."""

    every: int
    later: tuple[int, int]
    jitter: int
    offset: int = 0
    beams: int = 16

    def arrivals(self, seed: int) -> npt.NDArray[np.int_]:
        """The step at which each beam comes to the front, middle and hind legs: beams × 3."""
        random = np.random.default_rng(seed)
        moved = random.integers(-self.jitter, self.jitter + 1, (self.beams, 4))
        first = FIRST + self.offset + self.every * np.arange(self.beams) + moved[:, 0]
        arrivals: npt.NDArray[np.int_] = first[:, None] + np.array([0, *self.later]) + moved[:, 1:] * [0, 1, 1]
        return arrivals


def obstacles(arrivals: npt.NDArray[np.int_]) -> npt.NDArray[np.float64]:
    """What the inputs obstacle_left and obstacle_right are at each step: steps × (front, middle, hind)."""
    signal = np.zeros((int(arrivals.max()) + 2 * STRIDE, 3))
    for beam in arrivals:
        for leg, step in enumerate(beam):
            signal[step : step + STRIDE, leg] = 1
    return signal


def walk(arrangement: Arrangement, seed: int = 1) -> tuple[Hits, list[float]]:
    """Which of the WARNED legs hit which beam (beams × legs), and the weights at the end."""
    arrivals = arrangement.arrivals(seed)
    signal = obstacles(arrivals)
    recording = nv.compile(SPEC).run(steps=len(signal), inputs={"obstacle_left": signal, "obstacle_right": signal})
    hits = [
        [recording[f"{leg}.T"][beam[int(leg[-1]) - 1] :][: STRIDE + 5].max() > 0.1 for leg in WARNED]
        for beam in arrivals
    ]
    names = [f"{leg[:-1]}{int(leg[-1]) - 1}.dp -> {leg}.dp" for leg in WARNED]
    return np.array(hits, dtype=int), [float(recording.weight(name)[-1]) for name in names]
