"""Label overlaps: the labels that lie on something, in a picture that is not reduced.

In: a layout and its problem. Out: how many of the labels that discs cannot hold have no room kept for them, or lie on
another disc, on another label, on the frame of others, or across the line of a frame that their neuron is in.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.frames import Frames, entered
from neurovis_spec.layout.geometry import Rect, meet, padded
from neurovis_spec.layout.labels import label_rect
from neurovis_spec.layout.model import RADIUS, Layout, LayoutProblem

_SLACK = 1e-6


def label_overlaps(layout: Layout, problem: LayoutProblem) -> int:
    """The labels that overlap something, or that nobody says where to put."""
    beside = [i for i, (wide, _) in enumerate(problem.labels) if wide]
    sides = {i: layout.labels[name] for i in beside if (name := problem.neurons[i]) in layout.labels}
    rects = {i: label_rect(layout.positions[problem.neurons[i]], problem.labels[i], side) for i, side in sides.items()}
    ground = Ground(layout, problem)
    return sum(
        i not in rects
        or not ground.free(i, rects[i], -_SLACK)
        or any(meet(rects[i], other, -_SLACK) for k, other in rects.items() if k != i)
        for i in beside
    )


class Ground:
    """What labels stand on: discs, and the frames that are drawn."""

    def __init__(self, layout: Layout, problem: LayoutProblem) -> None:
        places = [layout.positions[name] for name in problem.neurons]
        routes = {i: layout.routes[edge.name] for i, edge in enumerate(problem.edges)}
        frames = Frames(problem, layout.labels)
        self._centres: FloatArray = np.array(places, dtype=np.float64).reshape(-1, 2)
        self._frames = [
            (own, rect)
            for own, rect in zip(frames.members, frames.rects(dict(enumerate(places)), routes), strict=True)
            if rect is not None and not entered(self._centres, rect, own)
        ]

    def free(self, neuron: int, rect: Rect, air: float, title: float = 0.0) -> bool:
        """Whether the label of a neuron comes no nearer than ``air`` to another disc, to the frame of others, or to the
        line of a frame that holds the neuron, below whose top so much is left for its ``title``."""
        x0, y0, x1, y1 = rect
        away = np.maximum(np.maximum((x0, y0) - self._centres, self._centres - (x1, y1)), 0.0)
        far = np.hypot(away[:, 0], away[:, 1])
        far[neuron] = np.inf
        if (far < RADIUS + air).any():
            return False
        for members, frame in self._frames:
            if neuron not in members:
                if meet(rect, frame, air):
                    return False
            elif not _within(padded(rect, air), (frame[0], frame[1] + title, *frame[2:])):
                return False
        return True


def _within(rect: Rect, frame: Rect) -> bool:
    return rect[0] >= frame[0] and rect[1] >= frame[1] and rect[2] <= frame[2] and rect[3] <= frame[3]
