"""Settle: forces at one level, step by step, each shorter than the one before.

In: a wiring and where its points are. Out: where they come to rest. All points push each other off (``field``); links
pull with a force that grows slower than their length, so that clusters stand apart (Noack 2007: forces between linear
and logarithmic); arcs press their target below their source. Mirror images are such at each step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from neurovis_layouts.apart import pushed
from neurovis_layouts.organic.field import Field
from neurovis_layouts.symmetry import Symmetry
from neurovis_layouts.wiring import Wiring
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.geometry import lengths

#: How strongly points push each other off.
_PUSH = 0.2
#: How strongly an arc presses as long as its target is too little below its source.
_PRESS = 4.0


@dataclass(frozen=True, slots=True)
class Cooling:
    """How many steps, and the longest move in the first and in the last."""

    steps: int
    first: float
    last: float


def settle(
    wiring: Wiring,
    places: FloatArray,
    field: Field,
    cooling: Cooling,
    fixed: IntArray | None = None,
    tick: Callable[[int], None] | None = None,
    drop: FloatArray | float = 1.0,
    axis: float = 0.0,
) -> FloatArray:
    """Places (count, 2) at rest, mirror images about x = ``axis``; ``fixed`` ones stay; ``tick`` is called after every
    step with their number. An arc presses as long as its target is less than ``drop`` below its source, one for all or
    (m,)."""
    count, symmetry = wiring.count, Symmetry(wiring.image, axis)
    for step in range(cooling.steps):
        force = _PUSH * field(places)
        way = places[wiring.b] - places[wiring.a]
        length = lengths(way) + 1e-9
        # links pull with the power 11/16 of their length, by roots alone, which every processor rounds alike
        fourth = np.sqrt(np.sqrt(length))
        stiffness = wiring.weight / (fourth * np.sqrt(np.sqrt(fourth)))
        force += pushed(count, wiring.b, wiring.a, way * stiffness[:, None])
        held = np.bincount(wiring.a, stiffness, count) + np.bincount(wiring.b, stiffness, count)
        missing = drop - (places[wiring.below, 1] - places[wiring.above, 1])
        press = _PRESS * wiring.pull * np.maximum(missing, 0)
        force[:, 1] += np.bincount(wiring.below, press, count) - np.bincount(wiring.above, press, count)
        active = _PRESS * wiring.pull * (missing > 0)
        held += np.bincount(wiring.below, active, count) + np.bincount(wiring.above, active, count)
        move = force / (held + 1e-9)[:, None]
        far = lengths(move) + 1e-12
        longest = cooling.first * (cooling.last / cooling.first) ** (step / max(1, cooling.steps - 1))
        move *= (np.minimum(far, longest) / far)[:, None]
        if fixed is not None:
            move[fixed] = 0.0
        places = symmetry.kept(places + move)
        if tick is not None:
            tick(count)
    return places
