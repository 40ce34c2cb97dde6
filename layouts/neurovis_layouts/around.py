"""Around pins: frames keep off each other where a pin holds one of them.

In: a problem with instances and pins, and a layout that keeps the pins but nothing else off them. Out: the layout in
which what is free gives way.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from neurovis_layouts.incremental import kept
from neurovis_spec.layout.model import Layout, LayoutProblem, Point


def gives_way(problem: LayoutProblem, pins: Mapping[int, Point], most: int) -> bool:
    """Whether there are frames, and pins (those of origins included), and no earlier layout is kept, of a network of at
    most so many neurons."""
    return bool(problem.modules and pins and problem.memory is None and len(problem.neurons) <= most)


def around_pins(problem: LayoutProblem, pins: Mapping[int, Point], free: Layout) -> Layout:
    """The free layout arranged around the pins as if an earlier layout had known these and nothing else: frames keep
    off each other, and nobody foreign comes into one."""
    known = Layout(problem.network, free.engine, {problem.neurons[i]: point for i, point in pins.items()}, {})
    placed = tuple(replace(module, origin=None) for module in problem.modules)  # as pins now
    return kept(replace(problem, pins=pins, modules=placed, memory=known), free)
