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
#: on the disc: never smaller, not for the sake of others, never larger; beside it
_SMALLEST, _READABLE, _LARGEST, _BESIDE = 9.0, 10.5, 14.0, 11.0
#: a numbered name may be smaller: it says where one is among many
_NUMBERED = 6.5
#: how wide, in radii, a text beside a disc may be: it must not look like a title of the neurons around
_WIDEST_BESIDE = 5.0
#: with more labels than this to place beside discs, none is
_MOST_BESIDE = 150
#: a disc smaller than this has no label
_SMALLEST_DISC = 7.0


@dataclass(frozen=True, slots=True)
class Label:
    """A text for a neuron; on the disc its colour follows the disc's."""

    text: str
    subscript: str
    size: float
    point: Point
    anchor: Literal["start", "middle", "end"]
    on_disc: bool

    def shape(self, fill: str) -> Text:
        """The text in a colour."""
        return Text(self.point, self.text, self.size, fill, self.anchor, _WEIGHT, self.subscript, self.on_disc)


def labels_of(
    network: Network, centres: list[Point], radius: float, obstacles: Obstacles, picture: Rect
) -> list[Label | None]:
    """A label for every neuron, or None where there is no room for any of it. ``picture``: where texts may be."""
    neurons = network.neurons
    if radius < _SMALLEST_DISC:
        return [None] * len(neurons)
    parts = [_parts(label, name) for label, name in zip(neurons.labels, neurons.names, strict=True)]
    common = _common_size(parts, radius)
    result = [_on_disc(*both, centre, radius, common) for both, centre in zip(parts, centres, strict=True)]
    missing = [index for index, found in enumerate(result) if found is None]
    for index in missing:
        label, centre = neurons.labels[index], centres[index]
        # where most would not find room, the few that do would only look as if they meant something
        found = _beside(label, centre, radius, obstacles, picture) if len(missing) <= _MOST_BESIDE else None
        result[index] = found if found is not None else _shortened(label, centre, radius)
    return result


def _parts(label: str, name: str) -> tuple[str, str]:
    """The label and its subscript: a numbered neuron without a label of its own has one."""
    return texts.with_subscript(label) if label == name.rsplit(".", 1)[-1] else (label, "")


def _fits(parts: tuple[str, str], size: float, radius: float) -> bool:
    return texts.width(parts[0], size, _WEIGHT, parts[1]) <= _chord(radius, size)


def _common_size(parts: list[tuple[str, str]], radius: float) -> float:
    """The size of most labels: the largest at which all that fit at a readable size do fit."""
    size = largest = min(_LARGEST, 0.76 * radius)
    readable = [p for p in dict.fromkeys(parts) if _fits(p, min(_READABLE, largest), radius)]
    while size > _READABLE and not all(_fits(p, size, radius) for p in readable):
        size -= 0.5
    return size


def _on_disc(base: str, subscript: str, centre: Point, radius: float, common: float) -> Label | None:
    size = common
    while size > (_NUMBERED if subscript else _SMALLEST) and not _fits((base, subscript), size, radius):
        size -= 0.5
    if not _fits((base, subscript), size, radius):
        return None
    drop = 0.36 if not subscript else 0.32
    return Label(base, subscript, size, (centre[0], centre[1] + drop * size), "middle", True)


def _chord(radius: float, size: float) -> float:
    """How wide a text of this size may be on a disc."""
    return float(2 * (max(radius * radius - (0.4 * size) ** 2, 0.0)) ** 0.5 - 3)


def _beside(label: str, centre: Point, radius: float, obstacles: Obstacles, picture: Rect) -> Label | None:
    size, (x, y) = _BESIDE, centre
    label = texts.shorten(label, size, _WIDEST_BESIDE * radius, _WEIGHT)
    width = texts.width(label, size, _WEIGHT)
    places: tuple[tuple[Literal["start", "middle", "end"], float, float], ...] = (
        ("middle", x, y + radius + 4 + 0.8 * size),
        ("middle", x, y - radius - 6),
        ("start", x + radius + 5, y + 0.36 * size),
        ("end", x - radius - 5, y + 0.36 * size),
    )
    for anchor, at, baseline in places:
        left = at - {"start": 0.0, "middle": width / 2, "end": width}[anchor]
        rect = (left - 2, baseline - 0.8 * size, left + width + 2, baseline + 0.25 * size)
        inside = rect[0] >= picture[0] and rect[1] >= picture[1] and rect[2] <= picture[2] and rect[3] <= picture[3]
        if inside and obstacles.hits(rect) == 0:
            obstacles.add_text(rect)
            return Label(label, "", size, (at, baseline), anchor, False)
    return None


def _shortened(label: str, centre: Point, radius: float) -> Label | None:
    size = max(_SMALLEST, min(10.0, 0.5 * radius))
    text = texts.shorten(label, size, _chord(radius, size), _WEIGHT)
    if len(text) < 2:
        return None
    return Label(text, "", size, (centre[0], centre[1] + 0.36 * size), "middle", True)
