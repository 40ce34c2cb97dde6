"""Stress: places whose distances differ as little as they can from those wished for.

In: wished distances, arcs, first places. Out: places. Each step solves for the minimum of a parabola that touches the
stress from above (Gansner, Koren and North 2004: majorisation); an arc whose target is too high adds a spring that
presses it down, in the same system, so that every step lowers the whole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
    wished: FloatArray, places: FloatArray, arcs: Arcs, fixed: IntArray, steps: int = _STEPS
) -> FloatArray:
    """Places (n, 2) of least stress from first ``places``, near distances counting most; ``fixed`` ones stay."""
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
    held = fixed if len(fixed) else np.zeros(1, dtype=np.int64)  # something has to stand, or the system has no answer
    free = np.setdiff1d(np.arange(count), held)
    solvers = [np.linalg.inv(system[np.ix_(free, free)]) for system in (across, along)]
    pulls = [system[np.ix_(free, held)] for system in (across, along)]
    scaled = weights * wished
    for _ in range(steps):
        targets = _targets(scaled, places)
        gap = places[arcs.below, 1] - places[arcs.above, 1]
        # a spring at rest, whatever the gap, where there is nothing to press
        press = arcs.strength * np.maximum(gap, arcs.gap)
        targets[:, 1] += np.bincount(arcs.below, press, count) - np.bincount(arcs.above, press, count)
        moved = places.copy()
        for k in (0, 1):
            moved[free, k] = solvers[k] @ (targets[free, k] - pulls[k] @ places[held, k])
        change = float(np.abs(moved - places).mean())
        places = moved
        if change < _STILL:
            break
    return places


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
