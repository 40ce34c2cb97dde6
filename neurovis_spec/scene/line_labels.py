"""Labels of connections: what an author calls an entry, once beside one of its lines, or each connection of one; what
pathways hold.

In: lines, the labels of entries and connections, what is said of pathways, what is in the way. Out: a Text for each
that has room. Of several lines, and of several places on each, the one is taken where the text covers least; no text
stands on a disc or on another. Of what there is no room for less is said where less can be.
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
from neurovis_spec.scene.model import Rectangle, Shape, Text, Theme
from neurovis_spec.scene.obstacles import Obstacles

_SIZE, _WEIGHT = 10.0, 400
#: longer ones are shortened; the tooltip has all of them
_WIDEST = 160.0
#: where they may be on their lines, the best place first, and how many lines of an entry are tried
_PLACES, _MOST = (1 / 2, 0.4, 0.6, 0.3, 0.7), 12
#: more labels of single connections than this would not be quiet: their tooltips have them
_MOST_OWN = 300
#: what lies on more than this (a disc, a text) is left out
_TOO_MUCH = 10_000


def line_labels(
    network: Network, lines: Mapping[int, Line], obstacles: Obstacles, theme: Theme, picture: Rect
) -> dict[str, Text]:
    """The texts by the names of their entries or connections, none of which leaves the ``picture`` to a side; the room
    that each takes is added to ``obstacles``."""
    connections = network.connections
    wanted: dict[int, list[int]] = {}
    if any(connections.labels):
        for index, entry in zip(lines, connections.entry[np.array([*lines], np.int64)].tolist(), strict=True):
            wanted.setdefault(entry, []).append(index)
    result: dict[str, Text] = {}

    def write(name: str, label: str, members: Sequence[int]) -> None:
        text = texts.shorten(label, _SIZE, _WIDEST, _WEIGHT)
        found = _placed([lines[index] for index in members], (text,), obstacles, theme, picture)
        if found is not None:
            result[name] = found

    for entry, label in enumerate(connections.labels):
        if label and entry in wanted:
            write(connections.entries[entry], label, _some(wanted[entry]))
    if (own := connections.own_labels) is not None:
        labelled = [index for index in lines if own.of(index)]
        for index in labelled if len(labelled) <= _MOST_OWN else ():
            write(network.connection_names[index], own.of(index), [index])
    return result


def pathway_labels(
    said: Mapping[str, tuple[Line, Sequence[str]]], obstacles: Obstacles, theme: Theme, picture: Rect
) -> dict[str, Text]:
    """The texts of pathways by their names, those that matter most first: ``said`` has the line of each, and its text,
    the longest wording first. The room that each takes is added to ``obstacles``."""
    found = {name: _placed([line], words, obstacles, theme, picture) for name, (line, words) in said.items()}
    return {name: text for name, text in found.items() if text is not None}


def backed(text: Text) -> tuple[Shape, ...]:
    """A text on a ground of its own, so that its line does not run between its words."""
    wide, high = texts.width(text.text, text.size, text.weight), text.size
    (x, y), ground = text.point, text.halo
    return Rectangle((x - wide / 2 - 1, y - 0.85 * high), wide + 2, 1.15 * high, 2.0, ground, ground, 0.0), text


def _placed(
    lines: Sequence[Line], wordings: Sequence[str], obstacles: Obstacles, theme: Theme, picture: Rect
) -> Text | None:
    """The first of these texts that has room on one of the lines; None where none has."""
    for text in wordings:
        place = _best(lines, text, obstacles, picture)
        if place is not None:
            obstacles.add_text(_rect(place, text))
            at = (place[0], place[1] + 0.35 * _SIZE)
            return Text(at, text, _SIZE, theme.ink, "middle", _WEIGHT, halo=theme.background)
    return None


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
