"""Label room: what labels that discs cannot hold take up, in the frame of an engine (x across, y along).

In: a problem whose ``labels`` say how large these are. Out: on which side of its disc each stands, what it covers
there, how much farther apart neurons have to be for it. Where signals run down or up, labels stand at the sides; where
they run across, below and above. Those of mirror images stand on the outer sides, all others on one side; where
neurons stand anywhere, away from the middle. On which sides labels are drawn in the end the scene says, which knows how
large the picture is (``neurovis_spec.scene.beside``).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from neurovis_layouts.frame import across_of, to_picture, turned
from neurovis_spec.layout.frames import PAD_LABEL
from neurovis_spec.layout.geometry import Rect, meet, padded, snap
from neurovis_spec.layout.labels import label_rect
from neurovis_spec.layout.model import RADIUS, Direction, LayoutProblem, Point, Side

#: From a label to the disc or the label beside it.
AIR = 0.2
#: What is free around a disc without a label, to either side and along.
_HALF, _ALONG = 0.5, 0.65
#: In how many steps a formation grows until its labels have room, and how much with each.
_STEPS, _STEP = 40, 1.125


def sides_of(problem: LayoutProblem) -> tuple[Side | None, ...]:
    """On which side of its disc each label stands; None where the disc holds it."""
    if not problem.labels:
        return (None,) * len(problem.neurons)
    usual = best_first(problem.direction)[0]
    outer = flipped(usual, across_of(problem.direction))
    first = {a for mirror in problem.mirrors for a, b in mirror.pairs if a != b}
    return tuple(None if not wide else outer if i in first else usual for i, (wide, _) in enumerate(problem.labels))


def outward(problem: LayoutProblem, places: Sequence[Point]) -> dict[str, Side]:
    """On which sides of their discs, at these places in the picture, labels have room that nobody else keeps for them,
    by neuron: where they stood in an earlier layout, else away from the middle."""
    beside = [i for i, (wide, _) in enumerate(problem.labels) if wide]
    if not beside:
        return {}
    before = problem.memory.labels if problem.memory else {}
    across = [x for x, _ in places[: len(problem.neurons)]]
    middle = math.fsum(across) / len(across)
    return {
        (name := problem.neurons[i]): before.get(name, "left" if snap(across[i] - middle) < 0 else "right")
        for i in beside
    }


def best_first(direction: Direction) -> tuple[Side, ...]:
    """The sides on which labels may stand, the best first."""
    beside: tuple[Side, ...] = ("right", "left")
    aligned: tuple[Side, ...] = ("below", "above")
    return beside + aligned if across_of(direction) == 0 else aligned + beside


def flipped(side: Side, across: int) -> Side:
    """A side after a reflection of this coordinate."""
    ends: tuple[Side, Side] = ("below", "above") if across else ("right", "left")
    return ends[1 - ends.index(side)] if side in ends else side


def rect_of(room: Point, side: Side, direction: Direction, place: Point = (0.0, 0.0)) -> Rect:
    """What a label of this width and height covers, of a neuron at a place."""
    return turned(label_rect(to_picture(place, direction), room, side), direction)


def at_ends(problem: LayoutProblem, first: Iterable[int], last: Iterable[int]) -> dict[int, Side]:
    """The sides of labels of neurons in the first rank that nothing drives, and in the last that drive nothing: where
    signals run across, nothing is in the way there."""
    if problem.direction in ("down", "up") or not problem.labels:
        return {}
    driven = {edge.target for edge in problem.edges if edge.source != edge.target}
    driving = {edge.source for edge in problem.edges if edge.source != edge.target}
    before: Side = "left" if problem.direction == "right" else "right"
    behind: Side = "right" if problem.direction == "right" else "left"
    ends: dict[int, Side] = {m: before for m in first if problem.labels[m][0] and m not in driven}
    return ends | {m: behind for m in last if problem.labels[m][0] and m not in driving and m not in ends}


def excess(problem: LayoutProblem, neuron: int) -> Point:
    """How much more room than its disc has a neuron needs for its label: across, on the side where this stands, and
    along, before it and behind it."""
    if not problem.labels or not problem.labels[neuron][0]:
        return 0.0, 0.0
    _, _, across, along = rect_of(problem.labels[neuron], best_first(problem.direction)[0], problem.direction)
    if problem.direction in ("down", "up"):
        return max(0.0, across + AIR - _HALF), 0.0
    return 0.0, max(0.0, along + AIR / 2 - _ALONG)


def covered(
    problem: LayoutProblem,
    places: Sequence[Point] | Mapping[int, Point],
    sides: Sequence[Side | None] | Mapping[int, Side | None],
    among: Iterable[int],
) -> dict[int, Rect]:
    """What the labels of these neurons cover, with the air that a frame leaves around them."""
    beside = [(i, side) for i in among if (side := sides[i]) is not None]
    return {i: padded(rect_of(problem.labels[i], side, problem.direction, places[i]), PAD_LABEL) for i, side in beside}


def roomy(
    rooms: Sequence[Point],
    places: Mapping[int, Point],
    sides: Mapping[int, Side | None],
    grows: tuple[bool, bool],
    air: float = AIR / 2,
) -> dict[int, Point]:
    """Places of a formation in the picture, farther apart across or down, as it ``grows``, where labels would come
    nearer than ``air`` to discs or to each other otherwise."""
    beside = {i: side for i in places if (side := sides[i]) is not None}
    factor, grown = 1.0, dict(places)
    for _ in range(_STEPS if beside else 0):
        rects = {i: label_rect(grown[i], rooms[i], side) for i, side in beside.items()}
        if not any(_met(rect, i, grown, rects, air) for i, rect in rects.items()):
            break
        factor *= _STEP
        across, down = (factor if free else 1.0 for free in grows)
        grown = {i: (x * across, y * down) for i, (x, y) in places.items()}
    return grown


def _met(rect: Rect, own: int, places: Mapping[int, Point], rects: Mapping[int, Rect], air: float) -> bool:
    """Whether a label comes near another neuron's disc or label."""
    discs = ((x - RADIUS, y - RADIUS, x + RADIUS, y + RADIUS) for i, (x, y) in places.items() if i != own)
    return any(meet(rect, disc, air) for disc in discs) or any(
        meet(rect, other, air) for i, other in rects.items() if i != own
    )
