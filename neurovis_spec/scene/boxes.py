"""Named boxes: the frame around their neurons.

In: the groups' ``box``, the layout section's ``boxes`` and the instances of modules. Out: rectangles in layout units,
largest first; where all of a box follow each other on a ring, a sector: a stretch of that ring. ``titles`` finds room
for their titles.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Group, Network
from neurovis_spec.layout.frames import (
    BOX_DOWN,
    PAD_LABEL,
    SLACK,
    boxed,
    enclosing,
    entered,
    titled,
)
from neurovis_spec.layout.geometry import Rect, meet, padded, sampled, straight, united
from neurovis_spec.layout.geometry import bounds as bounds_of_points
from neurovis_spec.layout.labels import BOX_WEIGHT, TITLE_HIGH, instance_titles, title_room, widened
from neurovis_spec.layout.model import RADIUS, Point, Route
from neurovis_spec.scene import texts
from neurovis_spec.scene.geometry import bounds, sample

#: How far a sector reaches to both sides of the centres, and how much of the way to the next neuron along the ring.
HALF, _SHARE = RADIUS + 0.25, 0.42
#: Fewer neurons than this are no ring; on one they stand this close to the circle.
_FEWEST_ON_RING, _ON_RING = 5, 0.02
#: A cubic piece of an arc turns by this at most.
_PIECE = math.pi / 4
#: One of what fills a sector by this, and how far it goes on beneath the next.
_FILLED, _OVER = math.pi / 45, math.pi / 180
_GREEK = {"sigma": "σ", "beta": "β", "alpha": "α", "gamma": "γ", "theta": "θ", "tau": "τ"}


@dataclass(frozen=True, slots=True)
class Sector:
    """A stretch of a ring about ``centre``, from one angle to a larger one, clockwise in the picture."""

    centre: Point
    radius: float
    first: float
    last: float

    @property
    def reach(self) -> tuple[float, float]:
        """How far from the centre it begins and ends."""
        return max(self.radius - HALF, 0.0), self.radius + HALF

    def pieces(self) -> FloatArray:
        """(k, 4, 2) corners of convex pieces that fill it, each a little over the next, so that no seam is seen."""
        count = math.ceil((self.last - self.first) / _FILLED)
        turn = self.first + (self.last - self.first) * np.arange(count + 1) / count
        ends = np.minimum(turn[1:] + _OVER, self.last)
        corners = zip(turn[:-1].tolist(), ends.tolist(), strict=True)
        inner, outer = self.reach
        return np.array(
            [[self._at(a, inner), self._at(a, outer), self._at(b, outer), self._at(b, inner)] for a, b in corners]
        )

    def outline(self) -> Route:
        """The spline along its border, back to where it begins."""
        inner, outer = self._arc(self.reach[0])[::-1], self._arc(self.reach[1])
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
        return bounds_of_points(sampled(self.outline(), 0.05))

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


def ring_of(positions: FloatArray, ring: IntArray) -> tuple[Point, float] | None:
    """The centre and the radius of the ring on which these neurons stand, None where they stand on none."""
    if len(ring) < _FEWEST_ON_RING:
        return None
    middle = positions[ring].mean(axis=0)
    x, y = (positions[ring] - middle).T
    far = np.sqrt(x * x + y * y)
    radius = float(far.mean())
    return None if np.abs(far - radius).max() > _ON_RING else ((float(middle[0]), float(middle[1])), radius)


def sector(positions: FloatArray, ring: IntArray, members: IntArray) -> Sector | None:
    """The sector of the ``members``, of all that are on a ring, None where these form no ring, or others stand between
    the members, or there are no others."""
    count, found = len(ring), ring_of(positions, ring)
    if found is None or not 0 < len(members) < count or not np.isin(members, ring).all():
        return None
    middle, radius = found
    x, y = (positions[ring] - middle).T
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
    return Sector(middle, radius, float(line[1]) - room, float(line[last]) + room)


def outward(network: Network, positions: FloatArray) -> dict[int, Point]:
    """Which way (across, down) is out of the ring on which a neuron stands with all others of its instance, or with all
    that are in none."""
    found: dict[int, Point] = {}
    for ring in _scopes(network, len(positions)):
        on = ring_of(positions, ring)
        if on is not None:
            ways = (positions[ring] - on[0]) / on[1]
            found.update(zip(ring.tolist(), ((x, y) for x, y in ways.tolist()), strict=True))
    return found


def _scopes(network: Network, count: int) -> list[IntArray]:
    """The neurons that are in the same innermost instance, or in none."""
    around = np.full(count, -1, dtype=np.int64)
    for number, instance in sorted(enumerate(network.instances), key=lambda each: each[1].path.count(".")):
        around[list(instance.indices)] = number
    return [np.flatnonzero(around == number) for number in np.unique(around).tolist()]


@dataclass(frozen=True, slots=True)
class Box:
    """A frame: its title in full, the name alone, its members, and its rectangle; what it is (``box`` or
    ``instance``) and its name in the network, which no other of its kind has."""

    title: str
    name: str
    members: tuple[int, ...]
    rect: Rect
    kind: str = "box"
    path: str = ""
    #: the stretch of a ring that it is drawn as, in ``rect``
    sector: Sector | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Named:
    kind: str
    path: str
    members: tuple[int, ...]


def boxes_of(
    network: Network, positions: FloatArray, routes: Sequence[FloatArray], labels: Mapping[int, Rect] | None = None
) -> list[Box]:
    """All boxes, and the instances of modules, largest first. Boxes that would touch another's are drawn tighter, what
    holds another is drawn around it. What foreign neurons stand in has no frame: it would say that they belong to it;
    nor has a box that would lie on the frame of others, where nobody could see what belongs to which. Boxes of neurons
    that follow each other on a ring are sectors. ``labels`` (what those cover for which there is room
    beside their discs) and titles are within their frames. Layout units."""
    named = _named(network)
    within = {n: frozenset(n.members) for n in named}
    rects = _rects(network, positions, routes, named, labels or {})
    clean = [n for n in named if not entered(positions, rects[n], n.members)]
    framed = [
        n
        for n in clean
        if n.kind == "instance"
        or not any(meet(padded(rects[n], -SLACK), rects[o]) and within[n].isdisjoint(within[o]) for o in clean)
    ]
    sectors = _sectors(network, positions, named)
    drawn: list[tuple[_Named, Rect, Sector | None]] = [(n, rects[n], None) for n in framed if n not in sectors]
    drawn += [(n, one.rect(), one) for n, one in sectors.items()]
    boxes = [
        Box(_titled(network, n), n.path.rpartition(".")[2], n.members, rect, n.kind, n.path, one)
        for n, rect, one in drawn
    ]
    return sorted(boxes, key=lambda b: (-(b.rect[2] - b.rect[0]) * (b.rect[3] - b.rect[1]), b.kind, b.path))


def _rects(
    network: Network,
    positions: FloatArray,
    routes: Sequence[FloatArray],
    named: Sequence[_Named],
    labels: Mapping[int, Rect],
) -> dict[_Named, Rect]:
    """The rectangles around what is named, those of boxes tighter where they would touch."""
    within = {n: frozenset(n.members) for n in named}
    inner = _routes_within(network, routes, named)
    titles = _titles(network, named)
    rects: dict[_Named, Rect] = {}
    for tight in (False, True):
        for item in named:  # what is held by another comes before it
            held = [rects[o] for o in named if o is not item and o in rects and within[o] < within[item]]
            beside = [padded(labels[i], PAD_LABEL) for i in item.members if i in labels]
            centres, lines = bounds([positions[list(item.members)]]), bounds(inner.get(item, []))
            assert centres is not None
            if item.kind == "instance":
                rect = titled(enclosing(centres, lines, held, beside))
                wide = widened(rect, titles[item])
                rects[item] = rect if entered(positions, wide, item.members) else wide
            elif not tight:
                rects[item] = widened(boxed(centres, lines, held, beside), titles[item])
            elif any(
                meet(rects[item], rects[o])
                for o in named
                if not (within[o] <= within[item] or within[item] <= within[o])
            ):
                rects[item] = boxed(centres, lines, held, tight=True)
    return rects


def entitled(boxes: Sequence[Box], positions: FloatArray, scale: float, rooms: Mapping[int, Rect]) -> list[Box]:
    """The boxes in a picture with so many page units for a layout unit, frames drawn higher where a title would have no
    room above the discs in them, and wider where labels, which get no smaller with the picture, would reach over their
    lines (``rooms``: what these cover), as far as nothing is there."""
    more = TITLE_HIGH / scale - (BOX_DOWN - RADIUS)
    result = list(boxes)
    for index, box in enumerate(boxes):
        if box.sector is not None:
            continue
        rect, wanted = box.rect, [padded(rooms[i], PAD_LABEL) for i in box.members if i in rooms]
        if more > 0 and box.kind == "box":
            wanted.append((rect[0], rect[1] - more, rect[2], rect[1]))
        for room in wanted:
            if _free(grown := united([rect, room]), rect, box, result, positions):
                rect = grown
        result[index] = replace(box, rect=rect)
    return result


def _free(grown: Rect, rect: Rect, box: Box, boxes: Sequence[Box], positions: FloatArray) -> bool:
    """Whether nothing foreign is where a frame would grow: no disc, and no line of a frame that it does not reach over
    already."""
    around = padded(grown, RADIUS)
    met = np.flatnonzero(((positions > around[:2]) & (positions < around[2:])).all(axis=1))
    if not set(met.tolist()) <= set(box.members):
        return False
    own = frozenset(box.members)
    others = (o for o in boxes if o.path != box.path or o.kind != box.kind)
    return all(_over(grown, o, own) <= _over(rect, o, own) for o in others)


def _over(rect: Rect, other: Box, own: frozenset[int]) -> bool:
    """Whether a frame of these neurons reaches into that of others, or out of one that holds it."""
    x0, y0, x1, y1 = other.rect
    if own <= frozenset(other.members):
        return rect[0] < x0 or rect[1] < y0 or rect[2] > x1 or rect[3] > y1
    return not frozenset(other.members) <= own and meet(rect, other.rect)


def _titles(network: Network, named: Sequence[_Named]) -> dict[_Named, float]:
    """How wide frames have to be for their titles."""
    module = {instance.path: instance.module for instance in network.instances}
    instances = [n for n in named if n.kind == "instance"]
    widths = instance_titles((n.path, module[n.path]) for n in instances)
    return dict(zip(instances, widths, strict=True)) | {
        n: title_room(n.path, BOX_WEIGHT) for n in named if n.kind == "box"
    }


def _named(network: Network) -> list[_Named]:
    """Boxes and instances by size, small ones first; an instance after a box with the same neurons."""
    members: dict[str, list[int]] = {}
    for group in network.neurons.groups:
        if group.box is not None:
            members.setdefault(group.box, []).extend(group.indices)
    for name, indices in network.layout.boxes:
        members.setdefault(name, []).extend(indices)
    found = [_Named("box", name, tuple(dict.fromkeys(indices))) for name, indices in members.items() if indices]
    found += [_Named("instance", i.path, tuple(i.indices)) for i in network.instances if i.count]
    return sorted(found, key=lambda n: (len(n.members), n.kind, n.path.count("."), n.path))


def _sectors(network: Network, positions: FloatArray, named: Sequence[_Named]) -> dict[_Named, Sector]:
    """The sectors of those boxes whose neurons follow each other on a ring, on which all stand that are in the same
    instance, or in none."""
    scope = {member: ring for ring in _scopes(network, len(positions)) for member in ring.tolist()}
    found: dict[_Named, Sector] = {}
    for item in named:
        if item.kind == "box":
            one = sector(positions, scope[item.members[0]], np.array(item.members, dtype=np.int64))
            if one is not None:
                found[item] = one
    return found


def _routes_within(
    network: Network, routes: Sequence[FloatArray], named: Sequence[_Named]
) -> dict[_Named, list[FloatArray]]:
    """Sampled routes that frames are around: those between two neurons of an instance, the self-loops of a box."""
    around: dict[int, list[_Named]] = {}
    for item in named:
        for member in item.members:
            around.setdefault(member, []).append(item)
    found: dict[_Named, list[FloatArray]] = {}
    ends = zip(network.connections.sources.tolist(), network.connections.targets.tolist(), strict=True)
    for index, (source, target) in enumerate(ends if named else ()):
        line: FloatArray | None = None
        for item in around.get(source, ()):
            if source == target or (item.kind == "instance" and item in around.get(target, ())):
                line = sample(routes[index], 8) if line is None else line
                found.setdefault(item, []).append(line)
    return found


def _titled(network: Network, item: _Named) -> str:
    name = item.path.rpartition(".")[2]
    return name if item.kind == "instance" else _title(network, name, item.members)


def _title(network: Network, name: str, members: tuple[int, ...]) -> str:
    """The name, and what its neurons compute where that is one thing and worth saying."""
    chosen = set(members)
    groups = [group for group in network.neurons.groups if chosen.intersection(group.indices)]
    told = {_computes(group) for group in groups}
    only = told.pop() if len(told) == 1 else ""
    return f"{name} · {only}" if only else name


def _computes(group: Group) -> str:
    words = [] if group.model == "static" else [group.model.replace("_", " ")]
    if group.activation != "identity":
        words.append(group.activation.replace("_", " "))
        for key, values in group.activation_parameters.items():
            if len(group.activation_parameters) == 1 and len(set(values)) == 1:
                words[-1] += f", {_GREEK.get(key, key)} = {texts.number(values[0])}"
    return " ".join(words)
