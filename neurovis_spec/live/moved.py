"""Moved: where discs and lines are while a neuron is dragged, before all is arranged anew.

In: the plan that is shown, its layout and another. Out: the discs that stand elsewhere and the lines that run
elsewhere, in units of the picture, which stays as large as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from neurovis_spec.layout.model import Layout
from neurovis_spec.scene.plan import Plan, rerouted

#: A line: its points one after the other, the tip of its head, and the direction of this.
Run = tuple[list[float], list[float], list[float]]


@dataclass(frozen=True, slots=True)
class Moved:
    """Centres and lines by the ids of their groups."""

    discs: Mapping[str, tuple[float, float]]
    lines: Mapping[str, Run]


def moved(planned: Plan, before: Layout, after: Layout) -> Moved:
    """What differs between two layouts of the same network."""
    names = planned.network.neurons.names
    discs = {}
    for index, name in enumerate(names):
        if after.positions[name] != before.positions[name]:
            x, y = planned.frame.map(np.array(after.positions[name])).tolist()
            discs[f"n{index}"] = (round(x, 2), round(y, 2))
    other = [
        index
        for index, name in enumerate(planned.network.connection_names)
        if index in planned.lines and after.routes.get(name) != before.routes.get(name)
    ]
    lines = {}
    for index, line in zip(other, rerouted(planned, after, other), strict=True):
        points = [round(value, 2) for point in line.points for value in point]
        tip, along = ([round(value, 5) for value in point] for point in (line.tip, line.direction))
        lines[f"c{index}"] = (points, tip, along)
    return Moved(discs, lines)
