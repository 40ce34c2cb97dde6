"""Places on a line that keep their order and their distances, as near as can be to where each wants to be.

In: wishes, weights, least distances. Out: places. It is isotonic regression by pool-adjacent-violators (Barlow and
Brunk 1972) after the distances are taken out: exact, unique and therefore symmetric where the input is.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate


def spread(wishes: Sequence[float], weights: Sequence[float], gaps: Sequence[float]) -> list[float]:
    """Minimise Σ w·(x − wish)² subject to x[i+1] − x[i] ≥ gaps[i]; weights are positive.

    >>> spread([0, 0, 0], [1, 1, 1], [1, 1])
    [-1.0, 0.0, 1.0]
    """
    offsets = list(accumulate(gaps[: max(0, len(wishes) - 1)], initial=0.0))
    pools: list[tuple[float, float, int]] = []  # sum of w·value, sum of w, how many
    for wish, weight, offset in zip(wishes, weights, offsets, strict=False):
        total, mass, count = weight * (wish - offset), weight, 1
        while pools and pools[-1][0] * mass >= total * pools[-1][1]:
            before = pools.pop()
            total, mass, count = before[0] + total, before[1] + mass, before[2] + count
        pools.append((total, mass, count))
    result: list[float] = []
    for total, mass, count in pools:
        start, middle = len(result), total / mass
        result += [middle + offset for offset in offsets[start : start + count]]
    return result
