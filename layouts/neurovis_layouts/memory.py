"""Memory: what an earlier layout placed stays there; what is new finds a place beside it.

In: a problem with an earlier layout (``memory``), and a fresh layout of the whole as if there were none. Out: positions
in which every neuron that the earlier layout knew stands exactly where it stood, and a new one near where the fresh
layout puts it in relation to what it is connected with, in a free place. What is to be drawn alike is placed together:
the same new neuron in all instances of one make, both of a mirrored pair.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from neurovis_layouts.alike import Alike
from neurovis_layouts.pins import Cells
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import RADIUS, LayoutModule, LayoutProblem, Point

#: How far a new neuron keeps off others, and off the neurons of a frame that it does not belong to.
_CLEAR = 0.75
_MARGIN = 0.6
#: Steps of the search, and how many rings of them are tried before a place far away is taken.
_STEP = 0.25
_RINGS = 64


@dataclass(frozen=True, slots=True)
class _Copy:
    """A set of new neurons placed as a piece: offset by neuron from the anchor. ``flip`` says which coordinates are
    reflected where the first of its kind is not; ``origin`` is what anchors of the first are measured from."""

    offsets: tuple[tuple[int, Point], ...]
    flip: Point
    origin: Point


def remembered(problem: LayoutProblem, fresh: Sequence[Point]) -> list[Point]:
    """Positions by neuron: earlier ones where there are such, pins before them, new ones found."""
    assert problem.memory is not None
    earlier = problem.memory.positions
    known = {i: earlier[name] for i, name in enumerate(problem.neurons) if name in earlier}
    placed: dict[int, Point] = {**known, **problem.pins}
    placed = _not_on_pins(problem, placed)
    if not placed:
        return list(fresh)
    places = _Places(problem, placed)
    near = _neighbours(problem)
    for piece in _pieces(problem, fresh, placed):
        if piece[0].offsets[0][0] in places.placed:
            continue
        wish = _wish(piece[0], fresh, places.placed, near)
        places.put(piece, places.search(piece, wish))
    return [places.placed[i] for i in range(len(problem.neurons))]


def _not_on_pins(problem: LayoutProblem, placed: dict[int, Point]) -> dict[int, Point]:
    """Without what stood where a pin is now: that has to find another place, like what is new."""
    if not problem.pins:
        return placed
    pinned = Cells()
    for point in problem.pins.values():
        pinned.add(point)
    return {i: point for i, point in placed.items() if i in problem.pins or pinned.free(point, 2 * RADIUS)}


def _neighbours(problem: LayoutProblem) -> Mapping[int, list[int]]:
    near: dict[int, list[int]] = {}
    for edge in problem.edges:
        if edge.source != edge.target:
            near.setdefault(edge.source, []).append(edge.target)
            near.setdefault(edge.target, []).append(edge.source)
    return near


def _wish(copy: _Copy, fresh: Sequence[Point], placed: Mapping[int, Point], near: Mapping[int, list[int]]) -> Point:
    """Where the fresh layout puts the anchor, moved as the neighbours have been moved, or, without any, all others."""
    own = {neuron for neuron, _ in copy.offsets}
    mates = sorted({mate for neuron in own for mate in near.get(neuron, ()) if mate in placed}) or sorted(placed)
    dx = _median([placed[mate][0] - fresh[mate][0] for mate in mates])
    dy = _median([placed[mate][1] - fresh[mate][1] for mate in mates])
    neuron, (x, y) = copy.offsets[0]
    wish = fresh[neuron][0] - x + dx, fresh[neuron][1] - y + dy
    # on the line of those that share its rank in the fresh layout, where these still share one
    for axis in (0, 1):
        peers = [i for i in placed if i not in own and fresh[i][axis] == fresh[neuron][axis]]
        lines = {placed[i][axis] for i in peers}
        if len(peers) >= 2 and len(lines) == 1:
            line = lines.pop() - copy.offsets[0][1][axis]
            wish = (line, wish[1]) if axis == 0 else (wish[0], line)
            break
    return snap(wish[0]), snap(wish[1])


def _median(values: list[float]) -> float:
    ordered = sorted(values)
    return ordered[len(ordered) // 2]


class _Places:
    """What is placed, and where something new may stand: off all discs, and outside of the frames of others."""

    def __init__(self, problem: LayoutProblem, placed: dict[int, Point]) -> None:
        self.problem = problem
        self.placed = dict(placed)
        self.cells = Cells()
        for point in placed.values():
            self.cells.add(point)
        self.frames = [(frozenset(members), _frame(members, self.placed)) for members in _framed(problem)]

    def search(self, piece: Sequence[_Copy], wish: Point) -> Point:
        """The free place for the anchor of the first copy that is nearest to the wish; sideways first."""
        for i, j in _spiral():
            anchor = (wish[0] + i * _STEP, wish[1] + j * _STEP)
            if self._free(piece, anchor):
                return anchor
        right = max(x for x, _ in self.placed.values()) + 2
        return snap(right), wish[1]

    def _free(self, piece: Sequence[_Copy], anchor: Point) -> bool:
        points = [place for copy in piece for place in _spots(copy, anchor)]
        if not all(self.cells.free(point, _CLEAR) for _, point in points):
            return False
        inside = Cells()
        for _, point in points:
            if not inside.free(point, _CLEAR):
                return False
            inside.add(point)
        return all(self._keeps(members, frame, points) for members, frame in self.frames)

    def _keeps(self, members: frozenset[int], frame: _Frame | None, points: Sequence[tuple[int, Point]]) -> bool:
        """Whether nothing foreign gets into a frame, be it the new ones or, as the frame grows, those around it."""
        grown = frame
        for neuron, (x, y) in points:
            if neuron in members:
                grown = (x, y, x, y) if grown is None else _joined(grown, (x, y))
        if grown is None:
            return True
        foreign = [point for neuron, point in points if neuron not in members]
        if grown != frame:
            foreign += [point for i, point in self.placed.items() if i not in members]
        return not any(_within(point, grown, _MARGIN) for point in foreign)

    def put(self, piece: Sequence[_Copy], anchor: Point) -> None:
        """Place a piece, all of its copies."""
        for copy in piece:
            for neuron, point in _spots(copy, anchor):
                self.placed[neuron] = point
                self.cells.add(point)
        self.frames = [(members, _frame(members, self.placed)) for members, _ in self.frames]


def _spots(copy: _Copy, anchor: Point) -> Iterator[tuple[int, Point]]:
    """Where the neurons of a copy stand when the first copy's anchor is at ``anchor``."""
    x, y = copy.origin
    fx, fy = copy.flip
    for neuron, (dx, dy) in copy.offsets:
        yield neuron, (x + fx * anchor[0] + fx * dx, y + fy * anchor[1] + fy * dy)


def _spiral() -> Iterator[tuple[int, int]]:
    done = 0
    reach = 4
    while reach <= _RINGS:
        steps = range(-reach, reach + 1)
        around = sorted((i * i + 2 * j * j, abs(j), -i, -j) for i in steps for j in steps)
        for far, _, i, j in around:
            if done <= far < reach * reach:
                yield -i, -j
        done = reach * reach
        reach *= 2


_Frame = tuple[float, float, float, float]


def _framed(problem: LayoutProblem) -> Iterator[Sequence[int]]:
    yield from (module.members for module in problem.modules)
    yield from (members for _, members in problem.boxes)


def _frame(members: Sequence[int] | frozenset[int], placed: Mapping[int, Point]) -> _Frame | None:
    points = [placed[i] for i in members if i in placed]
    if not points:
        return None
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return min(xs), min(ys), max(xs), max(ys)


def _joined(frame: _Frame, point: Point) -> _Frame:
    return min(frame[0], point[0]), min(frame[1], point[1]), max(frame[2], point[0]), max(frame[3], point[1])


def _within(point: Point, frame: _Frame, margin: float) -> bool:
    x, y = point
    return frame[0] - margin < x < frame[2] + margin and frame[1] - margin < y < frame[3] + margin


def _pieces(problem: LayoutProblem, fresh: Sequence[Point], placed: Mapping[int, Point]) -> Iterator[tuple[_Copy, ...]]:
    """What is placed together, each with its copies: new instances as a piece, then new neurons one by one."""
    done = set(placed)
    alike = Alike(problem, placed)
    makes: dict[str, LayoutModule] = {}
    for module in problem.modules:
        if all(i in placed for i in module.members):
            makes.setdefault(module.template, module)
    for module in problem.modules:
        if any(i in done for i in module.members):
            continue
        drawn = makes.get(module.template)
        at = [fresh[i] for i in module.members] if drawn is None else [placed[i] for i in drawn.members]
        offsets = tuple((i, (x - at[0][0], y - at[0][1])) for i, (x, y) in zip(module.members, at, strict=True))
        copies = [_Copy(offsets, (1.0, 1.0), (0.0, 0.0))]
        image = alike.image(module)
        if image is not None and not any(i in done for i in image[0]):
            mirrored = tuple((i, offset) for i, (_, offset) in zip(image[0], offsets, strict=True))
            copies.append(_Copy(mirrored, image[1].flip, image[1].shift))
        done.update(i for copy in copies for i, _ in copy.offsets)
        yield tuple(copies)
    for neuron in range(len(problem.neurons)):
        if neuron in done:
            continue
        copies = [
            _Copy(((mate, (0.0, 0.0)),), move.flip, move.shift) for mate, move in alike.of(neuron) if mate not in done
        ]
        done.update(copy.offsets[0][0] for copy in copies)
        yield tuple(copies)
