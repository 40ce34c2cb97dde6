"""Rows: the free gaps between discs and frames at each height (y), and where ways run through them already.

In: centres, frames. Out: for a way between two neurons, the free spans (of x) of a row, and the sides of frames that
it must not cross between two rows. A way may always pass its own neurons, and enter the frames that hold one of them.
"""

from __future__ import annotations

import math
from bisect import bisect_left, insort
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from neurovis_layouts.routing.lines import CutLines
from neurovis_layouts.routing.walls import Frame
from neurovis_spec.layout.model import Point

Span: TypeAlias = tuple[float, float]
#: What a way need not keep off: neurons by number, frames by −1, −2 and so on.
Own: TypeAlias = frozenset[int]

_DISC, _ROW = 0.45, 0.42
_BESIDE_FRAME, _ON_LINE = 0.2, 0.12
#: Rows closer than this are one.
_FINE = 0.15
#: With more rows than this by ways only those are checked that matter to a way.
_MOST = 30_000


@dataclass(slots=True)
class _Row:
    """The blocked spans of a row, from left to right, each with its owner (as in ``Own``); all owners; and the free
    spans, cached by the owners that a way need not keep off."""

    blocked: list[tuple[float, float, int]]
    owners: frozenset[int]
    free: dict[Own, list[Span]] = field(default_factory=dict)


class OccupiedRows:
    """Discs and frames by rows, and where ways run already."""

    def __init__(self, centres: Sequence[Point], frames: Sequence[Frame], ways: int, lined: bool = False) -> None:
        """``ways`` is how many ways will be looked for; with ``lined`` none runs along the sides of its own frames."""
        self.centres = centres
        self._lined = lined
        #: what is to be crossed as little as can be
        self.lines = CutLines()
        self._frames = frames
        self._sorted = sorted((y, x, i) for i, (x, y) in enumerate(centres))
        self._ys = [y for y, _, _ in self._sorted]
        self._around: list[list[int]] = [[] for _ in centres]
        for number, (members, _) in enumerate(frames):
            for member in members:
                self._around[member].append(-1 - number)
        self._rows: dict[float, _Row] = {}
        self._walls: dict[Span, list[tuple[float, float, int]]] = {}
        self._used: dict[float, list[float]] = {}
        #: heights, each with the frames that its discs are in; a frame that begins or ends there is in none
        self._heights: list[tuple[float, set[Own]]] = []
        stops = [(y, frozenset(self._around[i])) for y, _, i in self._sorted]
        for y, around in sorted([*stops, *((y, frozenset()) for _, r in frames for y in (r[1], r[3]))], key=_height):
            if not self._heights or y - self._heights[-1][0] >= _FINE:
                self._heights.append((y, set()))
            self._heights[-1][1].add(around)
        if ways * len(self._heights) <= _MOST:
            self._heights = [(y, {frozenset()}) for y, _ in self._heights]

    def between(self, top: float, bottom: float, own: Own, off: float = _ROW) -> list[float]:
        """The heights of the rows between ``top`` and ``bottom``, farther than ``off`` from both. Where there are many,
        rows with nothing but discs in frames that the way may not enter are left out: no way bends there."""
        return [
            y for y, inside in self._heights if top + off < y < bottom - off and any(around <= own for around in inside)
        ]

    def own(self, source: int, target: int) -> Own:
        """What a way between two neurons need not keep off: the two, and the frames that hold one of them."""
        return frozenset((source, target, *self._around[source], *self._around[target]))

    def free(self, y: float, own: Own) -> list[Span]:
        """What is free in a row, from left to right."""
        row = self._rows.get(y)
        if row is None:
            low, high = bisect_left(self._ys, y - _ROW), bisect_left(self._ys, y + _ROW)
            blocked = [(x - _DISC, x + _DISC, i) for _, x, i in self._sorted[low:high]]
            blocked += [
                (r[0] - _BESIDE_FRAME, r[2] + _BESIDE_FRAME, -1 - number)
                for number, (_, r) in enumerate(self._frames)
                if r[1] <= y <= r[3]
            ]
            row = self._rows[y] = _Row(sorted(blocked), frozenset(owner for _, _, owner in blocked))
        here = own & row.owners
        if here not in row.free:
            row.free[here] = _gaps(
                span for low, high, owner in row.blocked for span in self._blocking(low, high, owner, here)
            )
        return row.free[here]

    def _blocking(self, low: float, high: float, owner: int, own: Own) -> Iterable[Span]:
        """What a disc or a frame blocks: its whole width, nothing, or only the sides of a frame that may be entered."""
        if owner not in own:
            yield low, high
        elif self._lined and owner < 0:
            for side in (low + _BESIDE_FRAME, high - _BESIDE_FRAME):
                yield side - _ON_LINE, side + _ON_LINE

    def walls(self, top: float, bottom: float, own: Own, within: Span) -> list[Span]:
        """The sides of foreign frames that stand between two heights, of those that lie within these limits."""
        known = self._walls.get((top, bottom))
        if known is None:
            known = self._walls[top, bottom] = [
                (r[0], r[2], -1 - number)
                for number, (_, r) in enumerate(self._frames)
                if r[1] <= bottom and top <= r[3]
            ]
        low, high = within
        return [(x0, x1) for x0, x1, owner in known if low <= x0 and x1 <= high and owner not in own]

    def used(self, y: float) -> list[float]:
        """Where ways run through a row, from left to right."""
        return self._used.get(y, [])

    def use(self, path: Iterable[Point]) -> None:
        """Remember where a way runs."""
        for x, y in path:
            insort(self._used.setdefault(y, []), x)


def _height(stop: tuple[float, Own]) -> float:
    return stop[0]


def _gaps(blocked: Iterable[Span]) -> list[Span]:
    free: list[Span] = []
    edge = -math.inf
    for low, high in sorted(blocked):
        if low > edge:
            free.append((edge, low))
        edge = max(edge, high)
    return [*free, (edge, math.inf)]
