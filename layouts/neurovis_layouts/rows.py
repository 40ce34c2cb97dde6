"""Rows of groups: where a new neuron of a group goes so that it continues the row of the others.

In: a problem, a fresh layout of it, and the places of the neurons placed so far. Out: for a neuron the next place of
its group's row or column, or a gap in it; None where the others form no row, or the fresh layout has it off that line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from neurovis_spec.layout.model import RADIUS, LayoutProblem, Point

#: Steps of a row are as long as each other but for rounding.
_SLACK = 1 / 512


class GroupRows:
    """The rows of groups."""

    def __init__(self, problem: LayoutProblem, fresh: Sequence[Point]) -> None:
        self._fresh = fresh
        self._group = {
            member: (group.members, place) for group in problem.groups for place, member in enumerate(group.members)
        }

    def next(self, neuron: int, placed: Mapping[int, Point]) -> Point | None:
        """Where this neuron continues the row of its group."""
        if neuron not in self._group:
            return None
        members, place = self._group[neuron]
        before, after = members[max(place - 3, 0) : place][::-1], members[place + 1 : place + 4]
        if before and after and before[0] in placed and after[0] in placed:
            (x0, y0), (x1, y1) = placed[before[0]], placed[after[0]]
            room = abs(x1 - x0) + abs(y1 - y0) >= 4 * RADIUS and self._on_line(neuron, before[0], (x1 - x0, y1 - y0))
            return ((x0 + x1) / 2, (y0 + y1) / 2) if room else None
        for row in (before, after):
            at = [placed[mate] for mate in row if mate in placed]
            if len(row) < 2 or len(at) < len(row):
                continue
            steps = [(x1 - x0, y1 - y0) for (x0, y0), (x1, y1) in zip(at[1:], at, strict=False)]
            (dx, dy), even = steps[0], all(_equal(step, steps[0]) for step in steps)
            if even and self._on_line(neuron, row[0], (dx, dy)):
                return at[0][0] + dx, at[0][1] + dy
        return None

    def _on_line(self, neuron: int, mate: int, step: Point) -> bool:
        """Whether a step runs along an axis, and the fresh layout has these two on such a line as well."""
        for axis in (0, 1):
            if step[axis] == 0 and step[1 - axis] != 0:
                return self._fresh[neuron][axis] == self._fresh[mate][axis]
        return False


def _equal(one: Point, other: Point) -> bool:
    return abs(one[0] - other[0]) <= _SLACK and abs(one[1] - other[1]) <= _SLACK
