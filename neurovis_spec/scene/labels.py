"""Neuron labels: on the disc, else beside it where there is room, else shortened, else left out.

In: labels, discs and what is in the way. Out: for every neuron a Label or None. Labels do not move neurons; in dense
pictures they are left out rather than drawn over each other or over discs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from neurovis_spec.compiler.network import Network
from neurovis_spec.scene import texts
from neurovis_spec.scene.geometry import Point, Rect
from neurovis_spec.scene.model import Text
from neurovis_spec.scene.obstacles import Obstacles

_WEIGHT = 600
#: on the disc: never smaller, not for the sake of others, never larger
_SMALLEST, _READABLE, _LARGEST = 9.0, 10.5, 14.0
#: beside it: these, and so much for each unit of the radius between them
_BESIDE_SMALLEST, _BESIDE_LARGEST, _BESIDE_SHARE = 8.5, 11.0, 0.8
#: a numbered name may be smaller: it says where one is among many; on small discs so may all
_NUMBERED, _TINY = 7.5, 6.0
#: how much larger than the smallest the others are at most
_UNLIKE = 1.25
#: one that is shortened may be
_LEGIBLE = 8.0
#: how wide, in radii, a text beside a disc may be, if there is room: it must not look like a title of those around
_WIDEST_BESIDE = (9.0, 5.0)
#: of a group with so many labels all stand beside their discs, or none does: some would look as if they meant something
_MANY = 4
#: with more labels than this to place beside discs, none is
_MOST_BESIDE = 150
#: a disc smaller than this has no label
_SMALLEST_DISC = 7.0
#: one up to this size has its label almost from rim to rim
_SMALL_DISC = 12.0


@dataclass(frozen=True, slots=True)
class Label:
    """A text for a neuron; on the disc its colour follows the disc's."""

    text: str
    subscript: str
    size: float
    point: Point
    anchor: Literal["start", "middle", "end"]
    on_disc: bool
    #: it lies across the line of a box
    crosses: bool = False

    def shape(self, fill: str, halo: str) -> Text:
        """The text in a colour; where it lies across a line, with a halo in another."""
        around = halo if self.crosses else ""
        return Text(self.point, self.text, self.size, fill, self.anchor, _WEIGHT, self.subscript, self.on_disc, around)


def labels_of(
    network: Network, centres: list[Point], radius: float, obstacles: Obstacles, picture: Rect
) -> list[Label | None]:
    """A label for every neuron, or None where there is no room for any of it. ``picture``: where texts may be."""
    level = _level(network)
    neurons = network.neurons
    if radius < _SMALLEST_DISC:
        return [None] * len(neurons)
    parts = [_parts(label, name) for label, name in zip(neurons.labels, neurons.names, strict=True)]
    common = _common_size(parts, radius)
    result = [_on_disc(*both, centre, radius, common) for both, centre in zip(parts, centres, strict=True)]
    missing = [index for index, found in enumerate(result) if found is None]
    if len(missing) <= _MOST_BESIDE:
        for members in _together(network, missing):
            placed = [
                _beside(neurons.labels[index], centres[index], radius, obstacles, picture, level) for index in members
            ]
            if len(members) >= _MANY and None in placed:
                obstacles.drop_texts(len(placed) - placed.count(None))
                continue
            for index, label in zip(members, placed, strict=True):
                result[index] = label
    for index in missing:
        if result[index] is None:
            result[index] = _shortened(*parts[index], centres[index], radius)
    return result


def room_beside(network: Network, radius: float) -> list[tuple[int, Point]]:
    """The neurons whose labels do not fit on discs of this radius, and how far from their centres these reach then:
    down, or to either side where signals run across."""
    neurons, level = network.neurons, _level(network)
    result: list[tuple[int, Point]] = []
    for index, (label, name) in enumerate(zip(neurons.labels, neurons.names, strict=True)):
        if _on_disc(*_parts(label, name), (0.0, 0.0), radius, _READABLE) is None:
            width = min(texts.width(label, _BESIDE_LARGEST, _WEIGHT), _WIDEST_BESIDE[-1] * radius)
            result.append((index, (radius + 8 + width, 0.0) if level else (0.0, radius + 17)))
    return result


def _level(network: Network) -> bool:
    """Whether signals run across, so that there is more room at the ends than beneath."""
    return network.layout.direction in ("right", "left")


def _together(network: Network, missing: list[int]) -> list[list[int]]:
    """Those of a group together."""
    left, result = set(missing), []
    for group in network.neurons.groups:
        members = [index for index in group.indices if index in left]
        if members:
            result.append(members)
    return result


def _parts(label: str, name: str) -> tuple[str, str]:
    """The label and its subscript: a numbered neuron has one, and a label of its own that is such a name."""
    return texts.with_subscript(label) if label == name.rsplit(".", 1)[-1] or label.isidentifier() else (label, "")


def _fits(parts: tuple[str, str], size: float, radius: float) -> bool:
    return texts.width(parts[0], size, _WEIGHT, parts[1]) <= _chord(radius, size)


def _common_size(parts: list[tuple[str, str]], radius: float) -> float:
    """The size of most labels: the largest at which all that fit at a readable size do fit."""
    size = largest = min(_LARGEST, 0.76 * radius)
    readable = [p for p in dict.fromkeys(parts) if _fits(p, min(_READABLE, largest), radius)]
    while size > _READABLE and not all(_fits(p, size, radius) for p in readable):
        size -= 0.5
    smallest = size
    for both in dict.fromkeys(parts):
        least = _least(both[1], largest)
        if _fits(both, least, radius):
            while smallest > least and not _fits(both, smallest, radius):
                smallest = max(smallest - 0.5, least)
    return min(size, max(_UNLIKE * smallest, min(_SMALLEST, largest)))


def _least(subscript: str, common: float) -> float:
    """The smallest size on a disc, where most labels have the ``common`` one."""
    if common < _SMALLEST:
        return _TINY
    return _NUMBERED if subscript else _SMALLEST


def _on_disc(
    base: str, subscript: str, centre: Point, radius: float, common: float, least: float | None = None
) -> Label | None:
    size, least = common, least or _least(subscript, common)
    while size > least and not _fits((base, subscript), size, radius):
        size = max(size - 0.5, least)
    if not _fits((base, subscript), size, radius):
        return None
    drop = 0.36 if not subscript else 0.32
    return Label(base, subscript, size, (centre[0], centre[1] + drop * size), "middle", True)


def _chord(radius: float, size: float) -> float:
    """How wide a text of this size may be on a disc."""
    return float(
        2 * (max(radius * radius - (0.4 * size) ** 2, 0.0)) ** 0.5 - (2.5 if radius > _SMALL_DISC else 0.1 * radius)
    )


def _beside(label: str, centre: Point, radius: float, obstacles: Obstacles, picture: Rect, level: bool) -> Label | None:
    size, (x, y) = min(_BESIDE_LARGEST, max(_BESIDE_SMALLEST, _BESIDE_SHARE * radius)), centre
    aside, corner = radius + 5, 0.75 * radius + 3
    places: tuple[tuple[Literal["start", "middle", "end"], float, float], ...] = (
        ("middle", x, y + radius + 4 + 0.8 * size),
        ("middle", x, y - radius - 6),
        ("start", x + aside, y + 0.36 * size),
        ("end", x - aside, y + 0.36 * size),
        ("start", x + corner, y - corner),
        ("end", x - corner, y - corner),
        ("start", x + corner, y + corner + 0.72 * size),
        ("end", x - corner, y + corner + 0.72 * size),
    )
    if level:
        places = (*places[2:4], *places[:2], *places[4:])
    across: tuple[Label, Rect] | None = None
    for text in dict.fromkeys(texts.shorten(label, size, room * radius, _WEIGHT) for room in _WIDEST_BESIDE):
        width = texts.width(text, size, _WEIGHT)
        for anchor, at, baseline in places:
            left = at - {"start": 0.0, "middle": width / 2, "end": width}[anchor]
            rect = (left - 2, baseline - 0.8 * size, left + width + 2, baseline + 0.25 * size)
            inside = rect[0] >= picture[0] and rect[1] >= picture[1] and rect[2] <= picture[2] and rect[3] <= picture[3]
            hits = obstacles.hits(rect) if inside else 1
            if hits == 0:
                obstacles.add_text(rect)
                return Label(text, "", size, (at, baseline), anchor, False)
            if across is None and inside and hits == obstacles.frame_hits(rect):
                across = Label(text, "", size, (at, baseline), anchor, False, crosses=True), rect
    if across is None:
        return None
    obstacles.add_text(across[1])
    return across[0]


def _shortened(base: str, subscript: str, centre: Point, radius: float) -> Label | None:
    """What fits on the disc: the beginning of a name; of a numbered one its number, if need be alone."""
    if subscript:
        for end in range(min(len(base) - 1, 3), 0, -1):
            found = _on_disc(base[:end] + "…", subscript, centre, radius, _SMALLEST, _LEGIBLE)
            if found is not None:
                return found
        return _on_disc(subscript, "", centre, radius, min(_SMALLEST, 0.76 * radius), _TINY)
    size = min(max(_SMALLEST, min(10.0, 0.5 * radius)), 0.76 * radius)
    text = texts.shorten(base, size, _chord(radius, size), _WEIGHT)
    if len(text) < 2:
        return None
    return Label(text, "", size, (centre[0], centre[1] + 0.36 * size), "middle", True)
