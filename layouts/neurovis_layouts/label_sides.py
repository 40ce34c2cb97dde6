"""Label sides: on which side of its disc each label stands, now that all else has its place.

In: a problem and its layout, with the sides for which an engine kept room. Out: the sides on which labels lie on
nothing and on the fewest lines; of equals the one on which others of the group stand in the same rank, then the one
that room was kept for, then the usual one. What is drawn alike has its labels alike, mirror images reflected, and what
stood there in an earlier layout keeps its side.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from operator import itemgetter

import numpy as np

from neurovis_layouts.alike import Alike, Move
from neurovis_layouts.frame import across_of
from neurovis_layouts.label_room import best_first, flipped
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.frames import TITLE
from neurovis_spec.layout.geometry import Cells, Rect, meet, pieces_of, points_in_turn
from neurovis_spec.layout.labels import ASIDE, UNIT, label_rect
from neurovis_spec.layout.metrics import Ground
from neurovis_spec.layout.model import Direction, Layout, LayoutProblem, Side

#: How far apart points on lines are, at most, and how near to a label a line may be.
_STEP, _LINE = 0.1, 0.04
#: How near a label may be to another disc, at least as far as to its own.
_AIR = ASIDE / UNIT
#: So often labels are tried: one that moves makes room for others.
_ROUNDS = 3


def sided(problem: LayoutProblem, layout: Layout) -> Layout:
    """The layout with its labels on their best sides; a label that is free on none has only the side that it had."""
    if not any(wide for wide, _ in problem.labels):
        return layout
    if not layout.labels:  # frames hold the labels of their neurons: that makes them larger, and others give way
        layout = replace(layout, labels=best_sides(problem, layout, freely=True))
    return replace(layout, labels=best_sides(problem, layout))


def best_sides(problem: LayoutProblem, layout: Layout, freely: bool = False) -> dict[str, Side]:
    """The best sides of labels, by neuron. ``freely``, each label stands somewhere, though it may lie on something."""
    trial = _Trial(problem, layout)
    names = {i: problem.neurons[i] for i in trial.beside}
    before = problem.memory.labels if problem.memory else {}
    known = {i: before[name] for i, name in names.items() if name in before}
    given = {i: layout.labels[name] for i, name in names.items() if name in layout.labels}
    classes = [mates for mates in _alike(problem, layout, trial.beside) if not any(i in known for i, _ in mates)]
    chosen = {**given, **known}
    beside = _beside(problem, layout, trial.beside)
    for _ in range(_ROUNDS):
        settled = dict(chosen)
        for mates in classes:
            costs = [
                ((*trial.cost(sides, chosen), _apart(sides, chosen, beside), rank), sides)
                for rank, sides in enumerate(_candidates(mates, given, problem.direction))
            ]
            chosen.update(_least(costs, freely))
        if chosen == settled:
            break
    kept = {i: side for i, side in chosen.items() if freely or i in given or not trial.cost({i: side}, chosen)[0]}
    return {names[i]: side for i, side in sorted(kept.items())}


def _least(costs: Sequence[tuple[tuple[int, ...], dict[int, Side]]], freely: bool) -> dict[int, Side]:
    """The sides that cost least, of those that lie on nothing, or of all; none where there are none."""
    free = [(cost, sides) for cost, sides in costs if freely or not cost[0]]
    return min(free, key=itemgetter(0))[1] if free else {}


def _apart(sides: Mapping[int, Side], chosen: Mapping[int, Side], beside: Mapping[int, frozenset[int]]) -> int:
    """How many labels of others of their groups stand on other sides."""
    return sum(chosen.get(k, side) != side for i, side in sides.items() for k in beside[i] - sides.keys())


def _alike(problem: LayoutProblem, layout: Layout, beside: Sequence[int]) -> list[list[tuple[int, Move]]]:
    """The neurons with labels beside their discs, those that are drawn alike together, each with the move from the
    first."""
    alike = Alike(problem, {i: layout.positions[name] for i, name in enumerate(problem.neurons)})
    found: list[list[tuple[int, Move]]] = []
    left = set(beside)
    for neuron in beside:
        if neuron in left:
            found.append([(mate, move) for mate, move in alike.of(neuron) if mate in left])
            left.difference_update(mate for mate, _ in found[-1])
    return found


def _beside(problem: LayoutProblem, layout: Layout, labelled: Sequence[int]) -> dict[int, frozenset[int]]:
    """The neurons with labels that stand in one rank with others of their group, by each of them."""
    along = 1 - across_of(problem.direction)
    own = {i: number for number, group in enumerate(problem.groups) for i in group.members}
    rows: dict[tuple[int, float], set[int]] = {}
    for i in labelled:
        rows.setdefault((own.get(i, -1), layout.positions[problem.neurons[i]][along]), set()).add(i)
    return {i: frozenset(row) for row in rows.values() for i in row}


def _candidates(
    mates: Sequence[tuple[int, Move]], given: Mapping[int, Side], direction: Direction
) -> Iterator[dict[int, Side]]:
    """The sides on which labels that are alike may stand, those given first."""
    if all(i in given for i, _ in mates):
        yield {i: given[i] for i, _ in mates}
    for side in best_first(direction):
        yield {i: _moved(side, move) for i, move in mates}


def _moved(side: Side, move: Move) -> Side:
    for across in (0, 1):
        side = flipped(side, across) if move.flip[across] < 0 else side
    return side


class _Trial:
    """Where labels would lie on what: ``beside`` are the neurons that have one beside their discs."""

    def __init__(self, problem: LayoutProblem, layout: Layout) -> None:
        self.beside = [i for i, (wide, _) in enumerate(problem.labels) if wide]
        self._sides = best_first("down")
        ground = Ground(layout, problem)
        places = [layout.positions[problem.neurons[i]] for i in self.beside]
        self._rects: dict[tuple[int, Side], Rect] = {}
        self._free: dict[tuple[int, Side], bool] = {}
        for i, place in zip(self.beside, places, strict=True):
            for side in self._sides:
                rect = self._rects[i, side] = label_rect(place, problem.labels[i], side)
                air, title = (0.0, 0.0) if layout.labels.get(problem.neurons[i]) == side else (_AIR, TITLE)
                self._free[i, side] = ground.free(i, rect, air, title)
        self._lines = _lines(layout, places, np.array([[self._rects[i, s] for s in self._sides] for i in self.beside]))
        self._row = {i: row for row, i in enumerate(self.beside)}

    def cost(self, sides: Mapping[int, Side], others: Mapping[int, Side]) -> tuple[int, int]:
        """How much these labels lie on, among others where they are, and how many lines run over them."""
        there = {**others, **sides}
        blocked = sum(not self._free[i, side] for i, side in sides.items()) + sum(
            meet(self._rects[i, side], self._rects[k, other], 0.0)
            for i, side in sides.items()
            for k, other in there.items()
            if k != i
        )
        return blocked, sum(int(self._lines[self._row[i], self._sides.index(side)]) for i, side in sides.items())


def _lines(layout: Layout, places: Sequence[tuple[float, float]], rects: FloatArray) -> FloatArray:
    """(k, 4) how many lines run over each of the rectangles (k, 4, 4) around these places."""
    at = np.array(places, dtype=np.float64).reshape(-1, 2)
    wide = rects + np.array([-_LINE, -_LINE, _LINE, _LINE])
    reach = float(np.abs(wide - np.tile(at, 2)[:, None]).max()) * 2**0.5
    cells, routes = Cells(at, reach), list(layout.routes.values())
    crossed: set[tuple[int, int, int]] = set()
    for points, owner in points_in_turn(*pieces_of(routes), _STEP):
        point, place, _ = cells.near(points)
        (x, y), around = points[point].T, wide[place]
        over = (x[:, None] > around[..., 0]) & (x[:, None] < around[..., 2])
        over &= (y[:, None] > around[..., 1]) & (y[:, None] < around[..., 3])
        hit, side = np.nonzero(over)
        crossed.update(zip(place[hit].tolist(), side.tolist(), owner[point[hit]].tolist(), strict=True))
    lines = np.zeros(rects.shape[:2])
    for number, beside, _ in crossed:
        lines[number, beside] += 1
    return lines
