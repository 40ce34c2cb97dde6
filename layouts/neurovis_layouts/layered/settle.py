"""Settle: from a free plan to places, with what is pinned where it belongs and everything else off it.

In: a plan and the frames in it. Out: a place for every neuron, a move for every frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from neurovis_layouts.layered.drawing import Move, Piece
from neurovis_layouts.layered.sheet import Plan
from neurovis_layouts.pins import fit
from neurovis_spec.layout.model import LayoutProblem, Point


@dataclass(frozen=True, slots=True)
class Settled:
    """Places by neuron, pieces and where they are, how the plan has moved as a whole, which neurons did not simply
    follow, and the axis."""

    places: list[Point]
    pieces: list[tuple[Piece, Move]]
    shift: Point = (0.0, 0.0)
    moved: frozenset[int] = frozenset()
    axis: float = 0.0


def settled(
    problem: LayoutProblem, plan: Plan, pieces: Sequence[tuple[Piece, Move]], pair: Mapping[int, int]
) -> Settled:
    """Where everything stands."""
    free = [plan.places[i] for i in range(len(problem.neurons))]
    if not problem.pins:
        return Settled(free, list(pieces))
    places, shift, moved = fit(free, problem.pins)
    return Settled(places, list(pieces), shift, moved)
