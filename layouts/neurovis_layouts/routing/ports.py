"""Ports: in which direction each connection leaves its source and arrives at its target.

In: for one side of one disc, where the other ends are. Out: for each a sideways share u in (−1, 1) of a unit vector
whose other part points away from the disc, in the order of the other ends, spread so that arrowheads do not pile up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from neurovis_layouts.isotonic import spread

_GAP = 0.28
_PARTNER_GAP = 0.5
_WIDEST = 0.85
#: Lines leave more steeply than they arrive: first out of the rank, then across.
_LEAN_SOURCE, _LEAN_TARGET = 0.5, 0.75


@dataclass(frozen=True, slots=True, order=True)
class Port:
    """One end of an edge on one side of a disc: where it goes (relative), the partner, the edge, which end."""

    across: float
    partner: int
    backward: bool
    edge: int
    at_source: bool
    along: float


def leanings(ports: Sequence[Port]) -> dict[tuple[int, bool], float]:
    """u for each (edge, whether at its source), in the order of the other ends.

    A lone connection leans towards its other end; several keep a least difference, smaller where they are many.
    """
    ordered = sorted(ports)
    wishes = [
        (_LEAN_SOURCE if port.at_source else _LEAN_TARGET)
        * (port.across / math.sqrt(port.across * port.across + port.along * port.along))
        for port in ordered
    ]
    room = 2 * _WIDEST / max(1, len(ordered) - 1)
    gaps = [min(room, _PARTNER_GAP if first.partner == second.partner else _GAP) for first, second in pairwise(ordered)]
    places = spread(wishes, [1.0] * len(ordered), gaps)
    # a whole fan that leans out to one side is moved back, one that is too wide is narrowed as well
    over, under = places[-1] - _WIDEST, -_WIDEST - places[0]
    if over > 0 and under <= 0:
        places = [place - min(over, -under) for place in places]
    elif under > 0 and over <= 0:
        places = [place + min(under, -over) for place in places]
    widest = max(abs(place) for place in places)
    scale = _WIDEST / widest if widest > _WIDEST else 1.0
    return {(port.edge, port.at_source): place * scale for port, place in zip(ordered, places, strict=True)}
