"""Label overlaps: the labels that lie on something, in a picture that is not reduced.

In: a layout and its problem. Out: how many of the labels that discs cannot hold have no room kept for them, or lie on
another disc, on another label, on the frame of others, or across the line of a frame that their neuron is in.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.frames import Frames, entered
from neurovis_spec.layout.geometry import Rect, meet
from neurovis_spec.layout.labels import label_rect
from neurovis_spec.layout.model import RADIUS, Layout, LayoutProblem

_SLACK = 1e-6


def label_overlaps(layout: Layout, problem: LayoutProblem) -> int:
    """The labels that overlap something, or that nobody says where to put."""
    places = [layout.positions[name] for name in problem.neurons]
    beside = [i for i, (wide, _) in enumerate(problem.labels) if wide]
    sides = {i: layout.labels[name] for i in beside if (name := problem.neurons[i]) in layout.labels}
    rects = {i: label_rect(places[i], problem.labels[i], side) for i, side in sides.items()}
    routes = {i: layout.routes[edge.name] for i, edge in enumerate(problem.edges)}
    frames = Frames(problem, layout.labels)
    centres: FloatArray = np.array(places, dtype=np.float64).reshape(-1, 2)
    drawn = [
        (own, rect)
        for own, rect in zip(frames.members, frames.rects(dict(enumerate(places)), routes), strict=True)
        if rect is not None and not entered(centres, rect, own)
    ]
    return sum(i not in rects or _overlaps(i, rects, centres, drawn) for i in beside)


def _overlaps(own: int, rects: dict[int, Rect], centres: FloatArray, frames: list[tuple[frozenset[int], Rect]]) -> bool:
    rect = x0, y0, x1, y1 = rects[own]
    away = np.maximum(np.maximum((x0, y0) - centres, centres - (x1, y1)), 0.0)
    far = np.hypot(away[:, 0], away[:, 1])
    far[own] = np.inf
    if (far < RADIUS - _SLACK).any() or any(meet(rect, other, -_SLACK) for i, other in rects.items() if i != own):
        return True
    for members, (left, top, right, bottom) in frames:
        if own not in members:
            if meet(rect, (left, top, right, bottom), -_SLACK):
                return True
        elif x0 < left - _SLACK or y0 < top - _SLACK or x1 > right + _SLACK or y1 > bottom + _SLACK:
            return True
    return False
