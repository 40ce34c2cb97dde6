"""Hubs: where that begins and ends which runs from many neurons, or to many.

In: neurons, where these and all others stand. Out: a Hub: the disc of one neuron, the middle of several. Hubs of groups
that stand among each other are apart, as far as these have room.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.layout.geometry import Rect
from neurovis_spec.layout.model import Point

#: Hubs are so far apart, as a share of the picture's shorter side and at least, in page units.
_APART, _LEAST = 0.22, 84.0
#: More hubs than this have no room to be apart.
_MOST = 400
#: How far lines keep from a hub that stands among others, at most from one whose rim is free, and from a rim.
_HUB, _MOST_RIM, _AIR = 9.0, 44.0, 2.0
#: Hubs move within what holds all neurons but for this share on either side.
_RIM = 0.1


@dataclass(frozen=True, slots=True)
class Hub:
    """Where what runs from a group, or to it, begins and ends: so far from a point, or, where no other neuron is there,
    and it is not too far away, at the rim of a rectangle around it."""

    centre: Point
    reach: float
    rect: Rect | None = None

    def rim(self, towards: Point) -> float:
        """How far it reaches in a direction, a unit vector."""
        if self.rect is None:
            return self.reach
        (x, y), (x0, y0, x1, y1) = self.centre, self.rect
        ways = [
            (high - at if way > 0 else at - low) / abs(way)
            for at, way, low, high in ((x, towards[0], x0, x1), (y, towards[1], y0, y1))
            if abs(way) > 1e-9
        ]
        return max(self.reach, min(*ways, _MOST_RIM) + _AIR)


def hubs_of(members: Sequence[IntArray], centres: FloatArray, radii: FloatArray, picture: Rect) -> list[Hub]:
    """The hubs of some neurons each: ``centres`` (n, 2) and ``radii`` (n,) are those of all discs."""
    if not members:
        return []
    x0, y0, x1, y1 = picture
    middles = np.array([centres[own].mean(axis=0) for own in members])
    low, high = (np.array([np.quantile(centres[own], rim, axis=0) for own in members]) for rim in (_RIM, 1 - _RIM))
    at, free = middles.copy(), np.flatnonzero([len(own) > 1 for own in members])
    if len(free) <= _MOST:
        at[free] = _apart(middles[free], low[free], high[free], max(_LEAST, _APART * min(x1 - x0, y1 - y0)))
    return [
        Hub((x, y), float(radii[own[0]])) if len(own) == 1 else Hub((x, y), _HUB, _alone(own, centres, radii))
        for own, (x, y) in zip(members, at.tolist(), strict=True)
    ]


def _alone(members: IntArray, centres: FloatArray, radii: FloatArray) -> Rect | None:
    """The rectangle around some neurons; None where others stand in it."""
    low, high = ((centres + side * radii[:, None])[members] for side in (-1, 1))
    corner, opposite = low.min(axis=0), high.max(axis=0)
    within = ((centres > corner) & (centres < opposite)).all(axis=1)
    if int(within.sum()) > len(members):
        return None
    return float(corner[0]), float(corner[1]), float(opposite[0]), float(opposite[1])


def _apart(places: FloatArray, low: FloatArray, high: FloatArray, least: float) -> FloatArray:
    """Places that push each other off where they are closer than so, each in its own rectangle."""
    count = len(places)
    turn = 2.4 * np.arange(count)  # where two are in one place, each goes its own way
    places = places + 1e-3 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    for _ in range(60):
        away = places[:, None] - places[None]
        far = np.hypot(away[..., 0], away[..., 1]) + np.eye(count)
        push = np.clip(least - far, 0.0, None) * (1 - np.eye(count))
        places = places + 0.25 * (away / far[..., None] * push[..., None]).sum(axis=1)
        places = np.clip(places, low, high)
    return places
