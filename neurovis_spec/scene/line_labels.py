"""Labels of connections: what an author calls an entry, once beside one of its lines.

In: lines, the labels of entries, what is in the way. Out: a Text for each entry that has a label and room for it. Of
several lines, and of several places on each, the one is taken where the text covers least; no text stands on a disc or
on another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.geometry import Rect
from neurovis_spec.layout.model import Point
from neurovis_spec.scene import texts
from neurovis_spec.scene.geometry import point_at
from neurovis_spec.scene.lines import Line
from neurovis_spec.scene.model import Text, Theme
from neurovis_spec.scene.obstacles import Obstacles

_SIZE, _WEIGHT = 10.0, 400
#: longer ones are shortened; the tooltip has all of them
_WIDEST = 160.0
#: where they may be on their lines, the best place first, and how many lines of an entry are tried
_PLACES, _MOST = (1 / 2, 0.4, 0.6, 0.3, 0.7), 12
#: what lies on more than this (a disc, a text) is left out
_TOO_MUCH = 10_000


def line_labels(
    network: Network, lines: Mapping[int, Line], obstacles: Obstacles, theme: Theme, picture: Rect
) -> dict[str, Text]:
    """The texts by the names of their entries, none of which leaves the ``picture`` to a side; the room that each takes
    is added to ``obstacles``."""
    connections = network.connections
    wanted: dict[int, list[int]] = {}
    if any(connections.labels):
        for index, entry in zip(lines, connections.entry[np.array([*lines], np.int64)].tolist(), strict=True):
            wanted.setdefault(entry, []).append(index)
    result: dict[str, Text] = {}
    for entry, label in enumerate(connections.labels):
        if label and entry in wanted:
            text = texts.shorten(label, _SIZE, _WIDEST, _WEIGHT)
            place = _best([lines[index] for index in _some(wanted[entry])], text, obstacles, picture)
            if place is not None:
                obstacles.add_text(_rect(place, text))
                result[connections.entries[entry]] = Text(
                    (place[0], place[1] + 0.35 * _SIZE),
                    text,
                    _SIZE,
                    theme.ink,
                    "middle",
                    _WEIGHT,
                    halo=theme.background,
                )
    return result


def _some(members: Sequence[int]) -> Sequence[int]:
    """A few of many, spread evenly."""
    return members[:: -(-len(members) // _MOST)]


def _best(lines: Sequence[Line], text: str, obstacles: Obstacles, picture: Rect) -> Point | None:
    """Where the text covers least; None where it would cover a disc or another text everywhere."""
    half = _half(text)
    low, high = picture[0] + half, picture[2] - half
    on_lines = [point_at(line.points, share * (len(line.points) - 1) / 3) for line in lines for share in _PLACES]
    places = [(max(low, min(high, x)), y) for x, y in on_lines]
    hits = [obstacles.hits(_rect(place, text)) for place in places]
    least = min(hits)
    return places[hits.index(least)] if least < _TOO_MUCH else None


def _rect(centre: Point, text: str) -> Rect:
    """What a text takes up, with a little air."""
    half = _half(text)
    return centre[0] - half, centre[1] - 0.6 * _SIZE, centre[0] + half, centre[1] + 0.6 * _SIZE


def _half(text: str) -> float:
    """Half the width of a text, with a little air."""
    return texts.width(text, _SIZE, _WEIGHT) / 2 + 2
