"""Poses: a body's poses as arrays of points in metres, and how far it reaches from its middle.

In: a Skeleton, poses as recordings have them. Out: Poses. Where a pose holds something that is no finite number (a
simulation that diverged), nothing of it is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.body import Skeleton
from neurovis_spec.runtime.recording import Recording

#: Metres from the middle that are shown at least, of a body that is a point.
_LEAST = 0.05
#: What lies so far aside of the middle, as a share of what the body reaches aside, is on the near or the far side.
_ASIDE = 0.12


@dataclass(frozen=True, slots=True)
class Reach:
    """How far a body reaches in all its poses, in metres: forward or back and to either side of its middle, down to
    ``low`` (the ground, or below) and up to ``high``."""

    ahead: float
    aside: float
    low: float
    high: float


@dataclass(frozen=True)
class Poses:
    """The poses of frames, ``values`` (frames, size); ``start`` is where the middle was when the run began (x and y in
    metres). ``run`` is where the middle was at all rows of that, (rows, 2), and the row of each frame, (frames,);
    without it frames are all that is known of it."""

    skeleton: Skeleton
    values: FloatArray
    start: tuple[float, float]
    run: tuple[FloatArray, IntArray] | None = None

    @cached_property
    def known(self) -> npt.NDArray[np.bool_]:
        """Of which frames the pose is known, (frames,)."""
        return np.array([bool(np.isfinite(row).all()) for row in self.values], np.bool_)

    @cached_property
    def points(self) -> FloatArray:
        """Where the points are, (frames, points, 3); of what is not known at 0."""
        count = len(self.skeleton.points)
        known = np.where(self.known[:, None], self.values[:, : 3 * count], 0.0)
        return known.reshape(len(self.values), count, 3)

    @cached_property
    def touching(self) -> npt.NDArray[np.bool_]:
        """Which feet touch something, (frames, feet)."""
        result: npt.NDArray[np.bool_] = self.values[:, 3 * len(self.skeleton.points) :] > 0.5
        return result

    @cached_property
    def middles(self) -> FloatArray:
        """Where the point is that the picture follows, (frames, 2)."""
        return self.points[:, self.skeleton.middle, :2]

    @cached_property
    def way(self) -> FloatArray:
        """Where the middle was at all rows of the run, (rows, 2)."""
        return np.where(self.known[:, None], self.middles, np.nan) if self.run is None else self.run[0]

    @cached_property
    def rows(self) -> IntArray:
        """The row of each frame, (frames,)."""
        return np.arange(len(self.values)) if self.run is None else self.run[1]

    @cached_property
    def steps(self) -> FloatArray:
        """How far the middle went to each row, (rows,); NaN where it did not come from the row before: in an episode of
        its own, or after a pose that is not known."""
        far = np.hypot(*np.diff(self.way, axis=0, prepend=np.nan).T)
        return np.where(far <= 2 * self.reach.ahead, far, np.nan)

    @cached_property
    def begun(self) -> IntArray:
        """The row in which the way to each row began, (rows,)."""
        begins = np.where(np.isnan(self.steps), np.arange(len(self.steps)), 0)
        result: IntArray = np.maximum.accumulate(begins)
        return result

    @cached_property
    def forward(self) -> FloatArray:
        """How far it has come forward since the run began, (frames,)."""
        return self.middles[:, 0] - self.start[0]

    @cached_property
    def reach(self) -> Reach:
        """How far it reaches in all of these poses."""
        thick = max((link.radius for link in self.skeleton.links), default=0.0)
        off = np.abs(self.points[:, :, :2] - self.middles[:, None])[self.known]
        ahead, aside = (max(_LEAST, float(off[:, :, axis].max(initial=0.0)) + thick) for axis in (0, 1))
        heights = self.points[self.known][:, :, 2]
        return Reach(
            ahead, aside, float(heights.min(initial=0.0)), max(_LEAST, float(heights.max(initial=0.0)) + thick)
        )

    @cached_property
    def _shares(self) -> FloatArray:
        """What each point counts in the middle of each link, and of each foot, (links and feet, points)."""
        skeleton = self.skeleton
        parts = [*(link.points for link in skeleton.links), *((foot,) for foot in skeleton.feet)]
        result = np.zeros((len(parts), len(skeleton.points)))
        for number, some in enumerate(parts):
            np.add.at(result[number], list(some), 1 / len(some))
        return result

    def layers(self, frame: int) -> FloatArray:
        """On which side of the body links and then feet are: −1 on the far side, 1 on the near one, 0 in the middle."""
        off = self._shares @ (self.points[frame, :, 1] - self.middles[frame, 1]) / self.reach.aside
        result: FloatArray = np.where(off > _ASIDE, -1.0, np.where(off < -_ASIDE, 1.0, 0.0))
        return result

    @cached_property
    def _radii(self) -> FloatArray:
        return np.array([link.radius for link in self.skeleton.links])

    @cached_property
    def tops(self) -> FloatArray:
        """How high links reach, in the middle of all frames, in metres, (links,)."""
        heights = self._shares[: len(self._radii)] @ self.points[:, :, 2].mean(axis=0)
        result: FloatArray = (heights + self._radii).round(6)
        return result

    @cached_property
    def thick(self) -> FloatArray:
        """How large links are, as a share of twice the largest, (links,)."""
        large = self._radii.copy()
        for number, link in enumerate(self.skeleton.links):
            if link.beside:
                ends = self.points[:, list(link.points)]
                large[number] += np.linalg.norm(ends - ends[:, :1], axis=2).max(initial=0.0) / 2
        result: FloatArray = 0.5 * large / max(float(large.max(initial=0.0)), 1e-300)
        return result


def posed_of(recording: Recording) -> tuple[Skeleton, FloatArray] | None:
    """The skeleton and the poses (rows, size) of a recording; None where it has none."""
    pose, skeleton = recording.pose, recording.skeleton
    return None if pose is None or skeleton is None or not skeleton.points else (skeleton, pose)


def middles_of(skeleton: Skeleton, values: FloatArray) -> FloatArray:
    """Where the middle is in poses (rows, size), (rows, 2)."""
    return values[:, 3 * skeleton.middle : 3 * skeleton.middle + 2]


def start_of(skeleton: Skeleton, first: FloatArray) -> tuple[float, float]:
    """Where the middle is in the ``first`` pose of a run, x and y in metres; the origin where that is not known."""
    x, y = first[3 * skeleton.middle : 3 * skeleton.middle + 2].tolist()
    return (x, y) if np.isfinite([x, y]).all() else (0.0, 0.0)
