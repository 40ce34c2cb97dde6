"""The layered engine: from a problem to a layout.

In: a LayoutProblem. Out: a Layout, or what would be refused. After Sugiyama, Tagawa and Toda (1981), frame by frame
from the inside out (``hierarchy``); in a frame units and blocks (``units``), what shares a rank (``same_rank``),
components (``components``), their ranks, order and places (``component_layout``), pins (``pinning``), routes
(``frame_routing``). Every stage is deterministic and computes in plain IEEE arithmetic, so the result is the same
everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from neurovis_layouts.frame import from_picture
from neurovis_layouts.layered.hierarchy import Composer
from neurovis_spec.layout.model import Layout, LayoutProblem, Point


def drawn(problem: LayoutProblem, engine: str) -> Layout:
    """The layout of a problem as if there were no earlier one. Raises LayoutRefusalError for what cannot be met."""
    if not problem.neurons:
        return Layout(problem.network, engine, {}, {})
    return Composer(_framed(problem)).whole().layout(problem, engine)


def checked(problem: LayoutProblem) -> None:
    """Raises the LayoutRefusalError that ``drawn`` would. Only pins and lines need places for it, and for these no
    connection between frames has to be routed."""
    if not problem.neurons:
        return
    composer = Composer(_framed(problem))
    composer.check_mirrors()
    if problem.pins or problem.align or any(module.pins or module.origin is not None for module in problem.modules):
        composer.whole(routed=False)


def _framed(problem: LayoutProblem) -> LayoutProblem:
    """Pins in the engine's frame: x across, y along."""

    def in_frame(pins: Mapping[int, Point]) -> dict[int, Point]:
        return {i: from_picture(point, problem.direction) for i, point in pins.items()}

    return replace(
        problem,
        pins=in_frame(problem.pins),
        modules=tuple(
            replace(
                m,
                pins=in_frame(m.pins),
                origin=None if m.origin is None else from_picture(m.origin, problem.direction),
            )
            for m in problem.modules
        ),
    )
