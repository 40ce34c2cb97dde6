"""Around pins: instances and neurons that are not pinned are moved off the frames of those that are.

In: a problem with instances and pins, and a layout in which the pins are exact, but frames may overlap. Out: a layout
without these overlaps, found by treating the pins as an earlier layout to which everything else is added.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from neurovis_layouts.incremental import kept
from neurovis_spec.layout.model import Layout, LayoutProblem, Point


def gives_way(problem: LayoutProblem, pins: Mapping[int, Point], most: int) -> bool:
    """Whether ``around_pins`` is to be called: there are instances and pins (of neurons or of origins), no earlier
    layout, and at most so many neurons."""
    return bool(problem.modules and pins and problem.memory is None and len(problem.neurons) <= most)


def around_pins(problem: LayoutProblem, pins: Mapping[int, Point], free: Layout) -> Layout:
    """The free layout, changed so that no two frames overlap and no frame holds a neuron of another: as if the pins
    were an earlier layout, and everything else were new."""
    known = Layout(problem.network, free.engine, {problem.neurons[i]: point for i, point in pins.items()}, {})
    placed = tuple(replace(module, origin=None) for module in problem.modules)  # as pins now
    return kept(replace(problem, pins=pins, modules=placed, memory=known), free)
