"""Ticks: round values along an axis, and how they are written.

In: the ends of an axis. Out: values that are 1, 2 or 5 times a power of ten apart, and texts of them with as many
decimals as tell them apart.
"""

from __future__ import annotations

import math

from neurovis_spec.scene import texts


def ticks(low: float, high: float, most: int) -> list[float]:
    """Up to ``most`` (at least two) round values from ``low`` to ``high``, as many as there can be.

    >>> ticks(-1.02, 0.98, 5), ticks(0, 128, 6), ticks(3.0, 3.0, 5)
    ([-1.0, -0.5, 0.0, 0.5], [0.0, 50.0, 100.0], [3.0])
    """
    if not (math.isfinite(low) and math.isfinite(high)) or high <= low:
        return [low]
    exponent = math.floor(math.log10(high / most - low / most))
    for power in range(exponent, exponent + 3):
        for factor in (1, 2, 5):
            step = float(f"{factor}e{power}")
            if step <= 0 or not math.isfinite(step):
                continue
            first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
            if last - first + 1 <= most:
                return [float(f"{number * step:.12g}") for number in range(first, last + 1)] or [low]
    return [low]


def words(values: list[float]) -> list[str]:
    """How ticks are written: all with as many decimals as the one that needs most, where these are few.

    >>> words([-0.5, 0.0, 0.5]), words([0.0, 50.0]), words([0.0, 1e-7]), words([2e9, 4e9])
    (['−0.5', '0', '0.5'], ['0', '50'], ['0', '1e−7'], ['2e9', '4e9'])
    """
    if any(abs(value) >= 1e6 or 0 < abs(value) < 1e-4 for value in values):
        return [texts.number(value) for value in values]
    decimals = max((len(f"{value:.6f}".rstrip("0").partition(".")[2]) for value in values), default=0)
    return ["0" if value == 0 else f"{value:.{decimals}f}".replace("-", "−") for value in values]
