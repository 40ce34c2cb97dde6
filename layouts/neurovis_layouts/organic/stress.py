"""Stress: places whose distances differ as little as they can from those wished for.

In: wished distances, arcs, first places. Out: places. Each step solves for the minimum of a parabola that touches the
stress from above (Gansner, Koren and North 2004: majorisation); an arc whose target is too high adds a spring that
presses it down, in the same system, so that every step lowers the whole. Of mirror images one is solved for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurovis_layouts.symmetry import Symmetry
from neurovis_spec.layout import FloatArray, IntArray

_STEPS = 200
#: Ends when a step moves the places by less than this on the average.
_STILL = 1e-3


@dataclass(frozen=True, slots=True)
class Arcs:
    """Arcs press ``below`` at least ``gap`` under ``above``, each with ``strength``."""

    above: IntArray
    below: IntArray
    gap: float
    strength: float


def least_stress(
    wished: FloatArray,
    places: FloatArray,
    arcs: Arcs,
    fixed: IntArray,
    steps: int = _STEPS,
    symmetry: Symmetry | None = None,
) -> FloatArray:
    """Places (n, 2) of least stress from first ``places``, near distances counting most; ``fixed`` ones stay. Those of
    a ``symmetry`` are symmetric about its axis, and stay so."""
    count = len(wished)
    if count < 2:
        return places
    weights = 1 / np.maximum(wished, 1e-9) ** 2
    np.fill_diagonal(weights, 0.0)
    across = _laplacian(weights)
    along = across.copy()
    np.add.at(along, (arcs.above, arcs.above), arcs.strength)
    np.add.at(along, (arcs.below, arcs.below), arcs.strength)
    np.subtract.at(along, (arcs.above, arcs.below), arcs.strength)
    np.subtract.at(along, (arcs.below, arcs.above), arcs.strength)
    symmetry = symmetry or Symmetry(np.arange(count))
    origin = np.array([symmetry.axis, 0.0])
    places = places - origin
    paired = bool(symmetry.paired.any())
    systems = [
        _System(across, symmetry.folding(-1.0), fixed, loose=not paired),
        _System(along, symmetry.folding(1.0), fixed, loose=True),
    ]
    scaled = weights * wished
    for _ in range(steps):
        targets = _targets(scaled, places)
        gap = places[arcs.below, 1] - places[arcs.above, 1]
        # a spring at rest, whatever the gap, where there is nothing to press
        press = arcs.strength * np.maximum(gap, arcs.gap)
        targets[:, 1] += np.bincount(arcs.below, press, count) - np.bincount(arcs.above, press, count)
        moved = np.stack([systems[k].solved(targets[:, k], places[:, k]) for k in (0, 1)], axis=1)
        change = float(np.abs(moved - places).mean())
        places = moved
        if change < _STILL:
            break
    found: FloatArray = places + origin
    return found


class _System:
    """The coordinates along one axis that answer given targets; those of images follow by ``fold`` (n, m). ``fixed``
    points stay, and, where all together could move (``loose``) and none is fixed, the first."""

    def __init__(self, system: FloatArray, fold: FloatArray, fixed: IntArray, loose: bool) -> None:
        self._fold = fold
        self._first = np.argmax(fold == 1.0, axis=0)
        whole = fold.T @ system @ fold
        held = np.flatnonzero(fold[fixed].any(axis=0))
        if loose and not len(held):
            held = np.zeros(1, dtype=np.int64)  # something has to stand, or the system has no answer
        self._held, self._free = held, np.setdiff1d(np.arange(fold.shape[1]), held)
        self._solver = np.linalg.inv(whole[np.ix_(self._free, self._free)])
        self._pull = whole[np.ix_(self._free, held)]

    def solved(self, targets: FloatArray, places: FloatArray) -> FloatArray:
        """The coordinates (n,), from those before."""
        found = places[self._first]
        wanted = self._fold.T @ targets
        found[self._free] = self._solver @ (wanted[self._free] - self._pull @ found[self._held])
        whole: FloatArray = self._fold @ found
        return whole


def _laplacian(weights: FloatArray) -> FloatArray:
    laplacian = -weights
    laplacian[np.diag_indices(len(weights))] = weights.sum(axis=1)
    return laplacian


def _targets(scaled: FloatArray, places: FloatArray) -> FloatArray:
    """(n, 2): what the wished distances ask for, in the ways that pairs stand to each other now."""
    targets = np.empty_like(places)
    x, y = places.T
    dx, dy = x[:, None] - x[None, :], y[:, None] - y[None, :]
    ratio = scaled / np.sqrt(dx * dx + dy * dy + 1e-12)
    targets[:, 0] = (ratio * dx).sum(axis=1)
    targets[:, 1] = (ratio * dy).sum(axis=1)
    return targets
