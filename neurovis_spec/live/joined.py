"""Joined: what runs from and to the boxes that somebody has closed, added up.

In: a View, the ids of boxes. Out: Joined: for each two of these, or of one of these and a neuron that is in none, that
connections run between, a pathway, whose sums are told with each frame as those of bundles.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.live.sums import Sums
from neurovis_spec.live.view import View


@dataclass(frozen=True, slots=True, eq=False)
class Joined:
    """Which ``boxes`` are closed; the two ends of each pathway, boxes or neurons by their ids; what they add up to."""

    boxes: tuple[str, ...]
    ends: tuple[tuple[str, str], ...]
    sums: Sums

    @property
    def content(self) -> bytes:
        """What a page is told, as JSON, compressed."""
        value = {"boxes": list(self.boxes), "ends": [list(pair) for pair in self.ends]}
        return gzip.compress(json.dumps(value, separators=(",", ":")).encode("utf-8", "replace"), 1, mtime=0)


def joined(view: View, boxes: Sequence[str]) -> Joined:
    """What runs between closed boxes, and between these and all other neurons, but not within one. Of boxes in each
    other the first counts; unknown ones are none."""
    ends, counts = view.drawn.network.connections, view.drawn.counts
    known = tuple(box for box in dict.fromkeys(boxes) if box in view.plan.boxes)
    unit = len(known) + np.arange(len(view.drawn.sizes))
    for number in reversed(range(len(known))):
        unit[list(view.plan.boxes[known[number]])] = number
    a, b = unit[ends.sources.whole()], unit[ends.targets.whole()]
    some = np.flatnonzero((a != b) & (np.minimum(a, b) < len(known)))
    pairs, which = np.unique(np.stack([a[some], b[some]], axis=1), axis=0, return_inverse=True)
    which = which.reshape(-1)
    order = np.argsort(which, kind="stable")
    starts = np.searchsorted(which[order], np.arange(len(pairs)))
    members = some[order]

    def name(one: int) -> str:
        return known[one] if one < len(known) else f"n{one - len(known)}"

    called = tuple((name(one), name(other)) for one, other in pairs.tolist())
    return Joined(known, called, Sums(members, starts, counts[members]))
