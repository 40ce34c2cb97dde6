"""Sectors: what frames neurons that follow each other on a ring, where a rectangle would hold others.

In: where neurons stand, and which of them are on a ring together. Out: for those that follow each other there the
stretch of the ring: the spline around it, the rectangle around that, and points on its border.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.layout.geometry import Rect, bounds, sampled, straight
from neurovis_spec.layout.model import RADIUS, Point, Route

#: How far a sector reaches to both sides of the centres, and how much of the way to the next neuron along the ring.
HALF, _SHARE = RADIUS + 0.25, 0.42
#: Fewer neurons than this are no ring; on one they stand this close to the circle.
_FEWEST, _NEAR = 5, 0.02
#: A cubic piece of an arc turns by this at most.
_PIECE = math.pi / 4


@dataclass(frozen=True, slots=True)
class Sector:
    """A stretch of a ring about ``centre``, from one angle to a larger one, clockwise in the picture."""

    centre: Point
    radius: float
    first: float
    last: float

    def outline(self) -> Route:
        """The spline along its border, back to where it begins."""
        outer, inner = self._arc(self.radius + HALF), self._arc(max(self.radius - HALF, 0.0))[::-1]
        return (*outer, *straight(outer[-1], inner[0])[1:], *inner[1:], *straight(inner[-1], outer[0])[1:])

    def _arc(self, radius: float) -> Route:
        count = math.ceil((self.last - self.first) / _PIECE)
        step = (self.last - self.first) / count
        hold = 4 / 3 * math.tan(step / 4)
        points = [self._at(self.first, radius)]
        for k in range(count):
            a, b = self.first + k * step, self.first + (k + 1) * step
            start, end = self._at(a, radius), self._at(b, radius)
            towards, back = self._at(a + math.pi / 2, radius * hold), self._at(b - math.pi / 2, radius * hold)
            points += [
                (start[0] + towards[0] - self.centre[0], start[1] + towards[1] - self.centre[1]),
                (end[0] + back[0] - self.centre[0], end[1] + back[1] - self.centre[1]),
                end,
            ]
        return tuple(points)

    def _at(self, angle: float, radius: float) -> Point:
        return self.centre[0] + radius * math.cos(angle), self.centre[1] + radius * math.sin(angle)

    def rect(self) -> Rect:
        """The rectangle around it."""
        return bounds(sampled(self.outline(), 0.05))

    def outmost(self) -> Rect:
        """The place on its outer side where there is most room beyond, as a rectangle without extent, for a title
        beside it: close to a diagonal, as a picture has room in its corners."""
        quarter, inset = math.pi / 2, (self.last - self.first) / 8
        diagonal = quarter * (math.floor((self.first + self.last) / 2 / quarter) + 0.5)
        x, y = self._at(min(max(diagonal, self.first + inset), self.last - inset), self.radius + HALF)
        return x, y, x, y

    def border(self, step: float) -> FloatArray:
        """(k, 2) points on its border, about so far apart."""
        return np.array(sampled(self.outline(), step))


def sector(positions: FloatArray, ring: IntArray, members: IntArray) -> Sector | None:
    """The sector of the ``members``, of all that are on a ring, None where these form no ring, or others stand between
    the members, or there are no others."""
    count = len(ring)
    if count < _FEWEST or not 0 < len(members) < count or not np.isin(members, ring).all():
        return None
    middle = positions[ring].mean(axis=0)
    x, y = (positions[ring] - middle).T
    radius = float(np.sqrt(x * x + y * y).mean())
    if np.abs(np.sqrt(x * x + y * y) - radius).max() > _NEAR:
        return None
    angle = np.array([math.atan2(b, a) for a, b in zip(x.tolist(), y.tolist(), strict=True)])
    order = np.argsort(angle, kind="stable")
    angle, own = angle[order], np.isin(ring[order], members)
    begins = np.flatnonzero(own & ~np.roll(own, 1))
    if len(begins) != 1:
        return None
    place = (int(begins[0]) + np.arange(count + 1) - 1) % count  # from the one before the first to it again
    line = np.unwrap(angle[place])
    last = len(members)
    room = min(HALF / radius, _SHARE * float(line[1] - line[0]), _SHARE * float(line[last + 1] - line[last]))
    return Sector((float(middle[0]), float(middle[1])), radius, float(line[1]) - room, float(line[last]) + room)
