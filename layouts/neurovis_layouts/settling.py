"""Settling: where everything stands, from a drawing without pins, pins, and an earlier layout.

In: a problem with its pins and perhaps an earlier layout (``memory``), and a fresh drawing of it as if there were
neither. Out: a place for every neuron, pins exact. What is pinned, its mirror images and what the earlier layout knew
have their places first; what an instance or a box that is a frame has besides stands as it is drawn, as it is or
reflected, where there is room for that, else neuron by neuron; what is new continues the row or the column in which
others of its group stand, or stands near where the fresh drawing has it in relation to what it is connected with, in a
free place (``occupancy``). What is to be drawn alike is placed together:
the same new neuron in all instances of one make, both of a mirrored pair.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from itertools import filterfalse

from neurovis_layouts.alike import STAY, Alike, Axis, Move, pairs_by_axis, reflection, same, twice_axis
from neurovis_layouts.axes import axes, shift_of
from neurovis_layouts.conflicts import Earlier, Memory, carried
from neurovis_layouts.frame import across_of, from_picture, to_picture
from neurovis_layouts.occupancy import AxisSide, Body, Occupancy, Wish, lone
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import Rect, bounds, shifted, snap
from neurovis_spec.layout.model import RADIUS, LayoutProblem, LayoutRefusalError, Point, Route

#: What bodies are anchored at that stand where they are.
_HERE = (0.0, 0.0)
#: Steps of a row are as long as each other but for rounding.
_SLACK = 1 / 512


@dataclass(frozen=True, slots=True)
class Whole:
    """Neurons that are drawn as a whole, by number their frame (−1: none), and where that is in the fresh drawing;
    those of one ``make`` are drawn alike."""

    members: tuple[int, ...]
    frame: int
    rect: Rect
    make: str = ""


@dataclass(frozen=True, slots=True)
class Places:
    """Where everything stands, and where the axis of the whole does."""

    at: Sequence[Point]
    axis: float = 0.0
    shift: Point = (0.0, 0.0)


def settled(problem: LayoutProblem, frames: Frames, fresh: Sequence[Point], wholes: Sequence[Whole]) -> Places:
    """Where everything stands in the picture; ``fresh`` are the places, and ``wholes`` are as they are drawn, without
    pins and memory. Raises LayoutRefusalError for pins with which it cannot be."""
    return _Settling(problem, frames, fresh, wholes).places()


class _Settling:
    """What is asked, and what is known of it from the start."""

    def __init__(self, problem: LayoutProblem, frames: Frames, fresh: Sequence[Point], wholes: Sequence[Whole]) -> None:
        self._problem, self._frames, self._fresh, self._wholes = problem, frames, fresh, wholes
        self._across = across_of(problem.direction)
        self._memory = Memory(problem, fresh)
        pairs = pairs_by_axis(problem)
        self._pair = {a: b for one in pairs.get(-1, ()) for a, b in (one, one[::-1])}
        #: twice where the axis of the whole stands in the fresh drawing
        self._twice = twice_axis(pairs.get(-1, ()), fresh, self._across)
        self._lines = {member: line for line in problem.align for member in line}
        self._numbers = {frozenset(whole.members): whole.frame for whole in wholes}
        self._makes: dict[str, list[Whole]] = {}
        #: by neuron, what it is in, the outermost first
        self._around: dict[int, list[Whole]] = {}
        for whole in sorted(wholes, key=lambda whole: -len(whole.members)):
            self._makes.setdefault(whole.make, []).append(whole)
            for m in whole.members:
                self._around.setdefault(m, []).append(whole)

    def places(self) -> Places:
        """Where everything stands."""
        known, begun = self._memory.known, self._begun()
        if begun is None:  # nothing is known
            return Places(self._fresh)
        axis, held, before, there = begun
        if known:
            before = self._recalled(before, there, held)
            there = self._occupancy({i: before.where[i] for i in sorted(before.where.keys() - before.lost)}, held, axis)
        wishes = _Wishes(self._problem, self._fresh, there.placed, None if known else self._shift(held, axis))
        later: list[Wish] = []
        for piece, anchor in self._pieces(there, before, held, axis):
            row = wishes.row(piece[0], there.placed) if anchor is None else None
            wish = self._on_lines(piece, anchor or row or wishes.wish(piece[0], there.placed), there.placed, axis)
            if not known and self._alone(piece[0].members[0], there.placed):
                later.append(wish)
            elif not there.put(wish, stay=anchor is not None, in_row=row is not None):
                there.put(replace(wish, along=(True, True)))
            wishes.note(there.placed, (i for copy in piece for i in copy.members))
        lost = there.settle(later)
        if lost:
            about = tuple(self._problem.neurons[m] for m in later[lost[0]].bodies[0].members)
            raise LayoutRefusalError("pin-in-frame", "pins leave no room on a line", "move one of the pins", about)
        return Places([there.placed[i] for i in range(len(self._fresh))], axis, self._shift(held, axis))

    def _begun(self) -> tuple[float, Mapping[int, Point], Earlier, Occupancy] | None:
        """The axis at which most of what is held, and of what an earlier layout says, fits; what that is, and where it
        stands."""
        best: tuple[float, Mapping[int, Point], Earlier, Occupancy] | None = None
        least = math.inf
        for axis, held in self._axes():
            before = self._memory.earlier(held, self._axes_at(axis))
            there = self._occupancy({i: before.where[i] for i in sorted(held.keys() | before.newly)}, held, axis)
            unfit = self._complete(there, before, held, axis)
            if unfit < least:
                least, best = unfit, (axis, held, before, there)
            if self._memory.known or not unfit:
                break
        return best

    def _axes(self) -> Iterator[tuple[float, Mapping[int, Point]]]:
        """Where the axis may stand, the likeliest first, and where what is pinned and its images are then."""
        problem, known, pins = self._problem, self._memory.axes, self._problem.pins
        if not pins and not self._memory.known:
            return
        start = shift_of(self._fresh, pins or self._memory.known)[self._across] + self._twice / 2
        start = known[-1].twice / 2 if -1 in known else start
        if not pins:
            yield start, {}
            return
        turned = replace(problem, pins={i: from_picture(point, problem.direction) for i, point in pins.items()})
        wide = 2 + max((whole.rect[self._across + 2] - whole.rect[self._across] for whole in self._wholes), default=0.0)
        for axis, held in axes(turned, start, self._pair, wide):
            yield axis, {i: to_picture(point, problem.direction) for i, point in held.items()}

    def _axes_at(self, axis: float) -> Mapping[int, Axis]:
        """Each axis that is known."""
        return {**self._memory.axes, -1: Axis(self._across, 2 * axis)} if self._pair else self._memory.axes

    def _shift(self, held: Mapping[int, Point], axis: float) -> Point:
        """How the drawing is moved to what is held."""
        shift = list(shift_of(self._fresh, held)) if held else [0.0, 0.0]
        if self._pair:
            shift[self._across] = axis - self._twice / 2
        return shift[0], shift[1]

    def _occupancy(self, placed: Mapping[int, Point], held: Mapping[int, Point], axis: float) -> Occupancy:
        """What has its place, with the frames around it, and the lines of an earlier layout between."""
        routes = self._routes(placed)
        rects = self._frames.rects(placed, routes)
        return Occupancy(self._frames, placed, rects, self._sides(axis, held), routes.values())

    def _routes(self, placed: Mapping[int, Point]) -> Mapping[int, Route]:
        memory = self._problem.memory
        return carried(self._problem, memory, placed) if memory else {}

    def _sides(self, axis: float, held: Mapping[int, Point]) -> dict[int, AxisSide]:
        """For neurons with a mirror image the axis, and on which side of it they are, as in the fresh drawing; what is
        drawn with something held is where that is."""
        known, sides, there = self._memory.known, dict[int, AxisSide](), self._axes_at(axis)
        for scope, pairs in pairs_by_axis(self._problem).items():
            if scope not in there:
                continue
            across, now = there[scope].across, there[scope].twice / 2
            other = twice_axis(pairs, self._fresh, across) / 2
            agree = sum(
                _sign(known[a][across] - now) * _sign(self._fresh[a][across] - other) for a, _ in pairs if a in known
            )
            for a, b in pairs:
                side = _sign(self._fresh[a][across] - other) * (-1 if agree < 0 else 1)
                if side:
                    sides[a], sides[b] = AxisSide(across, now, side), AxisSide(across, now, -side)
        bent = {m for one in self._wholes if not held.keys().isdisjoint(one.members) for m in one.members}
        return {m: side for m, side in sides.items() if m not in bent}

    def _complete(self, there: Occupancy, before: Earlier, held: Mapping[int, Point], axis: float) -> int:
        """Place the rest of wholes in which something is pinned anew, as they are drawn or reflected, where that fits
        the pins and there is room. Returns how far from that it is."""
        missing, newly = 0, before.newly & held.keys()
        rects = self._frames.rects(before.where, self._routes(before.where))
        for whole in self._wholes:
            if newly.isdisjoint(whole.members) or there.placed.keys() >= set(whole.members):
                continue
            offered = list(self._rigid(whole, self._shape(whole, before.where, rects, held), there.placed, axis))
            for near in (True, False):
                found = next((one for one in offered if there.fits(*one, near=near)), None)
                if found is not None:
                    there.enter(*found)
                    break
                missing += 1 if offered else len(self._wholes)
        return missing

    def _rigid(
        self, whole: Whole, shape: _Shape, placed: Mapping[int, Point], axis: float
    ) -> Iterator[tuple[list[Body], Point]]:
        """What of a whole is not placed, with its image, as it is drawn and reflected, if what is placed fits that."""
        mirror = reflection(self._across, 2 * axis)
        for flip in (STAY, Move(reflection(self._across, 0.0).flip)):
            offsets = {m: flip.point(offset) for m, offset in shape.offsets}
            shifts = [(placed[m][0] - x, placed[m][1] - y) for m, (x, y) in offsets.items() if m in placed]
            if len(shifts) in (0, len(offsets)) or not all(same(shift, shifts[0]) for shift in shifts):
                continue
            anchor = flip.point(shifts[0])
            free = tuple((m, offset) for m, offset in shape.offsets if m not in placed)
            bodies = [Body(free, whole.frame, shape.rect, flip)]
            images = self._image(whole)
            if images and set(images) != set(whole.members):
                mates = tuple((self._pair[m], offset) for m, offset in free)
                bodies.append(Body(mates, self._numbers.get(frozenset(images), -1), shape.rect, flip.then(mirror)))
            elif images:
                spots = {m: flip.point((anchor[0] + x, anchor[1] + y)) for m, (x, y) in shape.offsets}
                if not all(same(mirror.point(at), spots.get(self._pair[m], _HERE)) for m, at in spots.items()):
                    continue
            yield bodies, anchor

    def _image(self, whole: Whole) -> tuple[int, ...]:
        """The mirror images of the neurons of a whole, none if not all have one."""
        images = tuple(self._pair[m] for m in whole.members if m in self._pair)
        return images if len(images) == len(whole.members) else ()

    def _shape(
        self, whole: Whole, placed: Mapping[int, Point], rects: Sequence[Rect | None], held: Mapping[int, Point]
    ) -> _Shape:
        """How a whole is drawn: as it is placed, else as another of its make, as far as that is, else as in the fresh
        drawing. What is held may be bent by its pins."""
        if not self._memory.known:
            return _Shape.of({m: self._fresh[m] for m in whole.members}, whole.rect)
        like = [whole, *sorted(self._makes[whole.make], key=lambda one: not held.keys().isdisjoint(one.members))]
        most = max(like, key=lambda one: sum(m in placed for m in one.members))
        rect = rects[most.frame] if most.frame >= 0 else None
        at = {m: placed[mate] for m, mate in zip(whole.members, most.members, strict=True) if mate in placed}
        if rect is None or not at:
            return _Shape.of({m: self._fresh[m] for m in whole.members}, whole.rect)
        return _Shape.of(at, rect)

    def _recalled(self, before: Earlier, there: Occupancy, held: Mapping[int, Point]) -> Earlier:
        """The earlier places with what stands ``there`` anew; what overlaps a disc or a frame of that is lost."""
        problem = self._problem
        where = {**before.where, **there.placed}
        newly = before.newly | (there.placed.keys() - before.where.keys())
        frames = Frames(replace(problem, boxes=()))
        rects, outer = frames.rects(where, self._routes(where)), self._memory.outer
        framed = {i for own in outer.values() for i in own}
        bodies = [lone(i, where[i]) for i in sorted(where.keys() - framed)]
        for number, own in outer.items():
            rect = rects[number]
            if rect is not None:
                bodies.append(Body(tuple((i, where[i]) for i in sorted(own & where.keys())), number, rect))
        firm = Occupancy(frames)
        for body in bodies:
            if not newly.isdisjoint(body.members):
                firm.enter((body,), _HERE)
        stay = newly | held.keys()
        off = [body for body in bodies if stay.isdisjoint(body.members) and not firm.fits((body,), _HERE)]
        lost = before.lost | self._memory.together(i for body in off for i in body.members)
        return Earlier(where, newly, frozenset((lost & where.keys()) - stay))

    def _alone(self, neuron: int, placed: Mapping[int, Point]) -> bool:
        """Whether nothing that a neuron is drawn with has its place."""
        return all(placed.keys().isdisjoint(whole.members) for whole in self._around.get(neuron, ()))

    def _on_lines(self, piece: Sequence[Body], anchor: Point, placed: Mapping[int, Point], axis: float) -> Wish:
        """The wish of what is on a line, or on the axis, along that alone."""
        wish, along = list(anchor), [True, True]
        first, rank = piece[0], 1 - self._across
        for neuron, offset in first.offsets:
            line = self._lines.get(neuron, ())
            if line:
                along[rank] = False
                wish[rank] = next((placed[m][rank] - offset[rank] for m in line if m in placed), wish[rank])
        images = [self._pair[m] for m in first.members if m in self._pair]
        middle = self._fresh[first.members[0]][self._across] - self._twice / 2
        alone = middle == 0 and len(first.members) == 1 and not self._memory.known
        if self._pair and (images[0] in first.members if images else alone):
            along[self._across], wish[self._across] = False, axis + middle
        found = wish[0], wish[1]
        return Wish(piece, found, (along[0], along[1]), found == anchor)

    def _pieces(
        self, there: Occupancy, before: Earlier, held: Mapping[int, Point], axis: float
    ) -> Iterator[tuple[tuple[Body, ...], Point | None]]:
        """What is placed together, each with its copies: wholes, then neurons one by one; what an earlier layout knew
        and has to move comes first, then what partly placed wholes lack, then what is new. With each comes where it
        should stand, if that is known: where it was, or where it is drawn like what is placed by then."""
        problem, placed = self._problem, there.placed
        done, lost = set(placed), before.lost
        alike = Alike(problem, {**before.where, **placed}, self._axes_at(axis))
        firm = {m for module in problem.modules for m in module.pins}

        def single(neuron: int) -> tuple[tuple[Body, ...], Point | None]:
            found = alike.of(neuron)
            lead = next((move.inverse().point(placed[mate]) for mate, move in found if mate in placed), None)
            singles = tuple(replace(lone(mate), move=move) for mate, move in found if mate not in done)
            done.update(i for copy in singles for i in copy.members)
            return singles, before.where[neuron] if neuron in lost else lead

        def whole(one: Whole, known_before: bool) -> tuple[tuple[Body, ...], Point | None]:
            counterparts = list(self._copies(alike, one, axis))
            lead = next((copy for copy in counterparts if done.issuperset(copy[0])), None)
            anchor, first = self._first(one, before if known_before else lead, there, held)
            copies = self._bodies(first, counterparts, done)
            done.update(i for copy in copies for i in copy.members)
            return copies, anchor

        everybody = frozenset(range(len(problem.neurons)))
        for known_before, chosen in ((True, lost), (False, everybody)):
            if not known_before:
                yield from map(single, self._lacking(done, firm))
            for one in sorted(self._wholes, key=lambda one: self._alone(one.members[0], placed)):
                if done.isdisjoint(one.members) and chosen.issuperset(one.members):
                    yield whole(one, known_before)
            yield from map(single, filterfalse(done.__contains__, sorted(chosen)))

    def _lacking(self, done: AbstractSet[int], firm: AbstractSet[int]) -> Iterator[int]:
        """What wholes lack of which something is ``done``, as far as that has come by then; what is ``firm`` first."""
        for neuron in sorted(self._around, key=lambda i: (i not in firm, i)):
            if neuron not in done and not done.isdisjoint(self._around[neuron][-1].members):
                yield neuron

    def _first(
        self,
        one: Whole,
        like: Earlier | tuple[tuple[int, ...], Move] | None,
        there: Occupancy,
        held: Mapping[int, Point],
    ) -> tuple[Point | None, Body]:
        """A whole as it was, as a counterpart is drawn that is placed, by the move that leads there, or as what is
        placed of it asks for; and where it was, or the counterpart is."""
        if like is None:
            shape = self._shape(one, there.placed, there.rects, held)
            return None, Body(shape.offsets, one.frame, shape.rect, STAY)
        if isinstance(like, Earlier):
            shape = self._shape(one, like.where, self._frames.rects(like.where, {}), held)
            return like.where[one.members[0]], Body(shape.offsets, one.frame, shape.rect, STAY)
        mates, move = like
        at = {m: there.placed[mate] for m, mate in zip(one.members, mates, strict=True)}
        shape = _Shape.of(at, there.rect(self._numbers.get(frozenset(mates), -1)) or bounds(at.values()))
        return there.placed[mates[0]], Body(shape.offsets, one.frame, shape.rect, move.inverse())

    def _bodies(
        self, first: Body, counterparts: Sequence[tuple[tuple[int, ...], Move]], done: AbstractSet[int]
    ) -> tuple[Body, ...]:
        """A whole, and those of its counterparts of which nothing has its place."""
        copies = [first]
        for mates, move in counterparts:
            if done.isdisjoint(mates) and all(set(mates).isdisjoint(copy.members) for copy in copies):
                offsets = tuple((i, offset) for i, (_, offset) in zip(mates, first.offsets, strict=True))
                number = self._numbers.get(frozenset(mates), -1)
                copies.append(Body(offsets, number, first.rect, first.move.then(move)))
        return tuple(copies)

    def _copies(self, alike: Alike, whole: Whole, axis: float) -> Iterator[tuple[tuple[int, ...], Move]]:
        """The counterparts of a whole within other instances of the make around it, or its mirror image; not all of its
        own make."""
        images = self._image(whole)
        if images and set(images).isdisjoint(whole.members):
            yield images, reflection(self._across, 2 * axis)
        if self._around[whole.members[0]][0] is whole:
            return
        others = [dict(alike.of(neuron)) for neuron in whole.members]
        moves = [list(other.items()) for other in others]
        for k in range(min(len(one) for one in moves)):
            mates = tuple(one[k][0] for one in moves)
            if mates[0] != whole.members[0] and all(one[k][1] == moves[0][k][1] for one in moves):
                yield mates, moves[0][k][1]


@dataclass(frozen=True, slots=True)
class _Shape:
    """How a whole is drawn: its neurons in relation to the first, and its frame in relation to that."""

    offsets: tuple[tuple[int, Point], ...]
    rect: Rect

    @classmethod
    def of(cls, at: Mapping[int, Point], rect: Rect) -> _Shape:
        """The shape of these neurons as they stand here."""
        x0, y0 = next(iter(at.values()))
        return cls(tuple((m, (x - x0, y - y0)) for m, (x, y) in at.items()), shifted(rect, (-x0, -y0)))


class _Wishes:
    """Where the fresh drawing would have something new, seen from what is placed: all moved by one ``shift``, or, where
    there is none, as its neighbours have been moved."""

    def __init__(
        self, problem: LayoutProblem, fresh: Sequence[Point], placed: Mapping[int, Point], shift: Point | None
    ) -> None:
        self._fresh, self._all = fresh, shift
        self._near: dict[int, list[int]] = {}
        for edge in problem.edges:
            if edge.source != edge.target:
                self._near.setdefault(edge.source, []).append(edge.target)
                self._near.setdefault(edge.target, []).append(edge.source)
        # instances come before those within them
        self._own = {member: module.members for module in problem.modules for member in module.members}
        self._rows = GroupRows(problem, fresh)
        #: by axis and coordinate in the fresh drawing: how many are placed, and on which lines
        self._ranks: dict[tuple[int, float], tuple[int, set[float]]] = {}
        self.note(placed, placed)
        self._drift = _drift(fresh, placed, sorted(placed)) if shift is None else shift

    def note(self, placed: Mapping[int, Point], neurons: Iterable[int]) -> None:
        """These neurons have their places."""
        for neuron in neurons:
            if neuron in placed:
                for axis in (0, 1):
                    count, lines = self._ranks.get((axis, self._fresh[neuron][axis]), (0, set()))
                    lines.add(placed[neuron][axis])
                    self._ranks[axis, self._fresh[neuron][axis]] = count + 1, lines

    def row(self, copy: Body, placed: Mapping[int, Point]) -> Point | None:
        """Where a new member of a group continues the row of the others; None where there is no such row."""
        row = self._rows.next(copy.offsets[0][0], placed) if len(copy.offsets) == 1 and self._all is None else None
        return None if row is None else (snap(row[0]), snap(row[1]))

    def wish(self, copy: Body, placed: Mapping[int, Point]) -> Point:
        """Where the fresh drawing puts the anchor, moved as the neighbours have been moved, or, without any, all
        others."""
        neuron = copy.offsets[0][0]
        own = sorted(i for i in self._own.get(neuron, ()) if i in placed) if copy.frame < 0 else []
        mates = sorted({mate for i, _ in copy.offsets for mate in self._near.get(i, ()) if mate in placed})
        # what its instance is drawn like goes before what is outside
        mates = sorted(set(mates).intersection(own)) or own or ([] if self._all else mates)
        dx, dy = _drift(self._fresh, placed, mates) if mates else self._drift
        wish = self._fresh[neuron][0] + dx, self._fresh[neuron][1] + dy
        # on the line of those that share its rank in the fresh drawing, where these still share one
        for axis in (0, 1) if self._all is None else ():
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
    return ordered[len(ordered) // 2] if ordered else 0.0


def _sign(value: float) -> int:
    return (value > 0) - (value < 0)


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
