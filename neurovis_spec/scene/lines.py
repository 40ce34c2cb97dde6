"""Routes of a layout become lines: in user units, trimmed to the discs, with an arrowhead.

In: routes by connection, from centre to centre. Out: a Line for each: the spline from the rim of the source to the back
of the head, and where the head points. The head's length does not depend on the weight, so that a line keeps
its shape while it learns; only its width does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.model import Layout, Point
from neurovis_spec.scene.geometry import batches, between, between_all, leaving, point_at
from neurovis_spec.scene.model import Arrowhead


@dataclass(frozen=True, slots=True)
class Line:
    """A connection as it is drawn: ``points`` end in the notch of the head at ``tip``. One that leads both ways begins
    in that of a head at ``tail``, too, which points ``back``."""

    points: tuple[Point, ...]
    tip: Point
    direction: Point
    head: float
    tail: Point | tuple[()] = ()
    back: Point = (0.0, 0.0)
    #: lengths of dashes and gaps; empty: solid
    dash: tuple[float, ...] = ()

    @property
    def end(self) -> Arrowhead:
        """What it ends in, whatever its width and its colour."""
        return Arrowhead(self.tip, self.direction, self.head, 0.0, "")

    @property
    def ends(self) -> tuple[Arrowhead, ...]:
        """What it ends in at its tip and, where it leads both ways, at its tail."""
        return (self.end, Arrowhead(self.tail, self.back, self.head, 0.0, "")) if self.tail else (self.end,)

    def both_ways(self) -> Line:
        """The same with a head at either end."""
        points, notch = np.array(self.points), Arrowhead.NOTCH * self.head
        k = (len(points) - 1) / 3
        at = min(float(leaving(points[None], notch)[0]), 0.6 * k)
        rest = between(self.points, at, k)
        (x0, y0), (x1, y1) = rest[0], self.points[0]
        length = math.hypot(x1 - x0, y1 - y0)
        back = ((x1 - x0) / length, (y1 - y0) / length) if length > 0 else (-1.0, 0.0)
        return replace(self, points=rest, tail=self.points[0], back=back)


def routes_of(names: Sequence[str], ends: Sequence[tuple[str, str]], layout: Layout) -> list[FloatArray]:
    """The route of every connection in layout units; a straight one where the layout has none."""
    routes = []
    for name, (source, target) in zip(names, ends, strict=True):
        route = layout.routes.get(name)
        if route is None:
            (x0, y0), (x1, y1) = layout.positions[source], layout.positions[target]
            route = tuple((x0 + (x1 - x0) * t, y0 + (y1 - y0) * t) for t in (0, 1 / 3, 2 / 3, 1))
        routes.append(np.asarray(route, float))
    return routes


def trimmed(
    routes: Sequence[FloatArray], radii: FloatArray | float, usual: float, unit: float = 1.0, air: float = 0.0
) -> list[Line]:
    """Lines for routes between discs of ``radii``, one or (m, 2), those of the sources and of the targets. Gaps and
    heads are those beside discs of the ``usual`` radius, in ``unit``s; ``air`` is left free besides."""
    lines: list[Line | None] = [None] * len(routes)
    gap, head = unit * _gap(usual) + air, unit * _head(usual)
    radii = np.broadcast_to(radii, (len(routes), 2)) + gap
    for members, batch in batches(routes):
        backward = batch[:, ::-1]
        k = (batch.shape[1] - 1) // 3
        sources, targets = radii[members].T
        starts = leaving(batch, sources)
        tips = k - leaving(backward, targets)
        notches = k - leaving(backward, targets + Arrowhead.NOTCH * head)
        apart = (starts < notches) & (notches < tips) & (k == 1)  # single cubics are cut together
        cut = _cut(batch[apart], starts[apart], notches[apart], tips[apart], head) if apart.any() else []
        for index, line in zip(np.flatnonzero(apart).tolist(), cut, strict=True):
            lines[members[index]] = line
        for index in np.flatnonzero(~apart).tolist():
            route = [(x, y) for x, y in batch[index].tolist()]
            lines[members[index]] = _line(route, float(starts[index]), float(notches[index]), float(tips[index]), head)
    return [line for line in lines if line is not None]


def _gap(radius: float) -> float:
    """The distance between the ends of lines and the rims of discs."""
    return min(1.5, 0.1 * radius)


def _head(radius: float) -> float:
    """How long heads are: a little longer for their discs where these are small, so that they still can be seen."""
    return min(10.0, max(0.5 * radius, min(6.5, 0.75 * radius)))


def _cut(curves: FloatArray, starts: FloatArray, notches: FloatArray, tips: FloatArray, head: float) -> list[Line]:
    """Single cubics between discs that are apart, as ``_line`` makes them one by one."""
    parts, points = between_all(curves, starts, notches), between_all(curves, tips, tips)[:, 0]
    away = points - parts[:, -1]
    lengths = np.hypot(*away.T)
    directions = np.divide(away, lengths[:, None], out=np.tile([1.0, 0.0], (len(away), 1)), where=lengths[:, None] > 0)
    rows = zip(parts.tolist(), points.tolist(), directions.tolist(), lengths.tolist(), strict=True)
    return [
        Line(tuple((x, y) for x, y in part), (tip[0], tip[1]), (way[0], way[1]), min(head, length / Arrowhead.NOTCH))
        for part, tip, way, length in rows
    ]


def _line(route: list[Point], start: float, notch: float, tip: float, head: float) -> Line:
    """Discs that touch leave no room: there a stub and a head are squeezed into the middle."""
    k = (len(route) - 1) / 3
    if tip <= start:
        start, tip = min(start, tip), max(start, tip)
        start, tip = max(0.0, start - 0.02 * k), min(k, tip + 0.02 * k)
    if notch <= start:
        notch = start + 0.3 * (tip - start)
    points = between(route, start, notch)
    (x0, y0), (x1, y1) = points[-1], point_at(route, tip)
    length = math.hypot(x1 - x0, y1 - y0)
    direction = ((x1 - x0) / length, (y1 - y0) / length) if length > 0 else (1.0, 0.0)
    return Line(points, (x1, y1), direction, min(head, length / Arrowhead.NOTCH))
