"""Incremental places: what an earlier layout placed stays there; what is new finds a place beside it.

In: a problem with an earlier layout (``memory``), and a fresh layout of the whole as if there were none. Out: positions
in which every neuron that the earlier layout knew stands exactly where it stood, unless it has to follow another
(``conflicts``), and a new one near where the fresh layout puts it in relation to what it is connected with, in a free
place (``occupancy``). What is to be drawn alike is placed together: the same new neuron in all instances of one make,
both of a mirrored pair.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from neurovis_layouts.alike import STAY, Alike, Move, pairs_by_axis, twice_axis
from neurovis_layouts.conflicts import Earlier, earlier
from neurovis_layouts.frame import across_of
from neurovis_layouts.occupancy import AxisSide, Body, Occupancy, Wish, instance_of, lone
from neurovis_layouts.rows import GroupRows
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import Rect, bounds, snap
from neurovis_spec.layout.model import LayoutModule, LayoutProblem, Point, Route


def remembered(problem: LayoutProblem, fresh: Sequence[Point], routes: Mapping[int, Route]) -> list[Point]:
    """Positions by neuron: earlier ones where there are such, pins before them, new ones found; ``routes`` are the
    fresh ones by edge."""
    assert problem.memory is not None
    before = earlier(problem, fresh)
    if not before.where:
        return list(fresh)
    frames = Frames(problem, problem.memory.labels)
    placed = {i: before.where[i] for i in sorted(before.stay)}
    shapes = _Shapes(problem, frames, fresh, routes, before)
    sides = _sides(problem, fresh, before.where)
    there = Occupancy(frames, placed, frames.rects(placed, before.routes), sides, before.routes.values())
    wishes = _Wishes(problem, fresh, placed)
    for piece, anchor in _pieces(problem, shapes, before, there.placed):
        if anchor is not None:
            there.put(Wish(piece, anchor), stay=True)
        else:
            row = wishes.row(piece[0], there.placed)
            there.put(Wish(piece, row or wishes.wish(piece[0], there.placed)), in_row=row is not None)
        for neuron in (i for copy in piece for i in copy.members):
            wishes.note(neuron, there.placed[neuron])
    return [there.placed[i] for i in range(len(problem.neurons))]


def _innermost(problem: LayoutProblem) -> dict[int, LayoutModule]:
    """For each neuron of an instance the smallest that it is in: instances come before those within them."""
    return {member: module for module in problem.modules for member in module.members}


class _Wishes:
    """Where the fresh layout would have something new, seen from what is placed."""

    def __init__(self, problem: LayoutProblem, fresh: Sequence[Point], placed: Mapping[int, Point]) -> None:
        self._fresh = fresh
        self._near: dict[int, list[int]] = {}
        for edge in problem.edges:
            if edge.source != edge.target:
                self._near.setdefault(edge.source, []).append(edge.target)
                self._near.setdefault(edge.target, []).append(edge.source)
        self._own = _innermost(problem)
        self._rows = GroupRows(problem, fresh)
        #: by axis and coordinate in the fresh layout: how many are placed, and on which lines
        self._ranks: dict[tuple[int, float], tuple[int, set[float]]] = {}
        for neuron, point in placed.items():
            self.note(neuron, point)
        self._drift = _drift(fresh, placed, sorted(placed)) if placed else (0.0, 0.0)

    def note(self, neuron: int, point: Point) -> None:
        """A neuron has its place."""
        for axis in (0, 1):
            count, lines = self._ranks.get((axis, self._fresh[neuron][axis]), (0, set()))
            lines.add(point[axis])
            self._ranks[axis, self._fresh[neuron][axis]] = count + 1, lines

    def row(self, copy: Body, placed: Mapping[int, Point]) -> Point | None:
        """Where a new member of a group continues the row of the others; None where there is no such row."""
        row = self._rows.next(copy.offsets[0][0], placed) if len(copy.offsets) == 1 else None
        return None if row is None else (snap(row[0]), snap(row[1]))

    def wish(self, copy: Body, placed: Mapping[int, Point]) -> Point:
        """Where the fresh layout puts the anchor, moved as the neighbours have been moved, or, without any, all
        others."""
        mates = sorted({mate for neuron, _ in copy.offsets for mate in self._near.get(neuron, ()) if mate in placed})
        if copy.frame < 0 and copy.offsets[0][0] in self._own:
            # what its instance is drawn like goes before what is outside
            own = sorted(i for i in self._own[copy.offsets[0][0]].members if i in placed)
            mates = sorted(set(mates).intersection(own)) or own or mates
        dx, dy = _drift(self._fresh, placed, mates) if mates else self._drift
        neuron = copy.offsets[0][0]
        wish = self._fresh[neuron][0] + dx, self._fresh[neuron][1] + dy
        # on the line of those that share its rank in the fresh layout, where these still share one
        for axis in (0, 1):
            count, lines = self._ranks.get((axis, self._fresh[neuron][axis]), (0, set()))
            if count >= 2 and len(lines) == 1:
                (line,) = lines
                wish = (line, wish[1]) if axis == 0 else (wish[0], line)
                break
        return snap(wish[0]), snap(wish[1])


def _drift(fresh: Sequence[Point], placed: Mapping[int, Point], mates: Sequence[int]) -> Point:
    return (
        _median([placed[mate][0] - fresh[mate][0] for mate in mates]),
        _median([placed[mate][1] - fresh[mate][1] for mate in mates]),
    )


def _median(values: list[float]) -> float:
    ordered = sorted(values)
    return ordered[len(ordered) // 2]


def _sides(problem: LayoutProblem, fresh: Sequence[Point], before: Mapping[int, Point]) -> dict[int, AxisSide]:
    """For neurons with a mirror image the axis, and on which side of it they are, as in the fresh layout."""
    across = across_of(problem.direction)
    sides: dict[int, AxisSide] = {}
    for pairs in pairs_by_axis(problem):
        there = [(a, b) for a, b in pairs if a in before and b in before]
        if not there:
            continue
        axis, other = twice_axis(there, before, across) / 2, twice_axis(pairs, fresh, across) / 2
        agree = sum(_sign(before[a][across] - axis) * _sign(fresh[a][across] - other) for a, b in there)
        for a, b in pairs:
            side = _sign(fresh[a][across] - other) * (-1 if agree < 0 else 1)
            if side:
                sides[a], sides[b] = AxisSide(across, axis, side), AxisSide(across, axis, -side)
    return sides


def _sign(value: float) -> int:
    return (value > 0) - (value < 0)


class _Shapes:
    """How instances are drawn: their neurons in relation to the first, and how far their frame is around these."""

    def __init__(
        self,
        problem: LayoutProblem,
        frames: Frames,
        fresh: Sequence[Point],
        routes: Mapping[int, Route],
        before: Earlier,
    ) -> None:
        self._fresh, self._before = fresh, before.where
        self._fresh_rects = frames.rects(dict(enumerate(fresh)), routes)
        self._rects = frames.rects(before.where, before.routes)
        self._makes: dict[str, int] = {}
        self._modules = problem.modules
        for number, module in enumerate(problem.modules):
            if all(i in before.where for i in module.members):
                self._makes.setdefault(module.template, number)

    def of(self, number: int, like: int | None = None) -> tuple[tuple[tuple[int, Point], ...], Rect]:
        """The neurons of an instance, each with its offset from the first, and its frame in relation to that; ``like``
        another, else like the first of its make."""
        module = self._modules[number]
        drawn = self._makes.get(module.template) if like is None else like
        where: Mapping[int, Point] | Sequence[Point] = self._fresh if drawn is None else self._before
        rect = self._fresh_rects[number] if drawn is None else self._rects[drawn]
        at = [where[i] for i in (module if drawn is None else self._modules[drawn]).members]
        (x0, y0), rect = at[0], rect or bounds(at)
        offsets = tuple((i, (x - x0, y - y0)) for i, (x, y) in zip(module.members, at, strict=True))
        return offsets, (rect[0] - x0, rect[1] - y0, rect[2] - x0, rect[3] - y0)


def _pieces(
    problem: LayoutProblem, shapes: _Shapes, before: Earlier, placed: Mapping[int, Point]
) -> Iterator[tuple[tuple[Body, ...], Point | None]]:
    """What is placed together, each with its copies: instances as a piece, then neurons one by one; what has been
    in the earlier layout and has to move comes first, then what partly placed instances lack, then what is new. Beside
    it where it is to stand: where it was, or where it is drawn like what is ``placed`` by then."""
    done, wanted = set(before.stay), before.wanted
    alike = Alike(problem, before.where)

    def single(neuron: int) -> tuple[tuple[Body, ...], Point | None]:
        found = alike.of(neuron)
        lead = next((move.inverse().point(placed[mate]) for mate, move in found if mate in placed), None)
        singles = tuple(replace(lone(mate), move=move) for mate, move in found if mate not in done)
        done.update(i for copy in singles for i in copy.members)
        return singles, before.where[neuron] if neuron in wanted else lead

    for again in (True, False):
        own = {} if again else _innermost(problem)
        for neuron in sorted(i for i, module in own.items() if not done.isdisjoint(module.members)):
            if neuron not in done:
                yield single(neuron)
        for number, module in enumerate(problem.modules):
            if not module.members or not done.isdisjoint(module.members):
                continue
            if again and not wanted.issuperset(module.members):
                continue
            counterparts = list(_copies(alike, module))
            anchor, back = before.where[module.members[0]] if again else None, STAY
            offsets, rect = shapes.of(number)
            lead = next((one for one in counterparts if done.issuperset(one[0]) and before.has(one[0])), None)
            if lead is not None and not again:
                anchor, back = placed[lead[0][0]], lead[1].inverse()
                offsets, rect = shapes.of(number, instance_of(problem, lead[0]))
            copies = [Body(offsets, number, rect, back)]
            for mates, move in counterparts:
                if done.isdisjoint(mates) and all(set(mates).isdisjoint(copy.members) for copy in copies):
                    mirrored = tuple((i, offset) for i, (_, offset) in zip(mates, offsets, strict=True))
                    copies.append(Body(mirrored, instance_of(problem, mates), rect, back.then(move)))
            done.update(i for copy in copies for i in copy.members)
            yield tuple(copies), anchor
        for neuron in range(len(problem.neurons)):
            if neuron not in done and (neuron in wanted or not again):
                yield single(neuron)


def _copies(alike: Alike, module: LayoutModule) -> Iterator[tuple[tuple[int, ...], Move]]:
    """The counterparts of an instance within other instances of the template around it, or its mirror image; not every
    instance of its own template."""
    if module.parent < 0:
        image = alike.image(module)
        if image is not None:
            yield image
        return
    others = [dict(alike.of(neuron)) for neuron in module.members]
    moves = [list(other.items()) for other in others]
    for k in range(min(len(one) for one in moves)):
        mates = tuple(one[k][0] for one in moves)
        if mates[0] != module.members[0] and all(one[k][1] == moves[0][k][1] for one in moves):
            yield mates, moves[0][k][1]
