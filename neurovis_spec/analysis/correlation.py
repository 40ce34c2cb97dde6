"""Cross-correlation (Eq. 12): how much two neurons are active at once.

In: activities. Out: E[x·y] of each pair. The paper prints p(x)·p(y) where the joint distribution p(x, y) must stand:
the printed sum is E[x]·E[y], which does not see whether x and y come together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_spec.analysis.excerpt import paired
from neurovis_spec.analysis.named import NamedArray, pairs
from neurovis_spec.runtime.recording import Recording


def cross_correlation(
    recording: Recording, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
) -> NamedArray:
    """Σ x·y·p(x, y) of each pair of neurons: the mean of the product of their activities, as Fig. 6B has it."""
    part = paired(recording, of, start, stop)
    with np.errstate(all="ignore"):
        product = part.activity.T @ part.activity / len(part.step)
    return pairs("cross-correlation", product, part.names)


def printed_correlation(
    recording: Recording, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
) -> NamedArray:
    """Σ x·y·p(x)·p(y), as Eq. 12 is printed: the product of the means, for all pairs of neurons that are alike one
    value."""
    part = paired(recording, of, start, stop)
    with np.errstate(all="ignore"):
        means = part.activity.mean(axis=0)
        product = np.multiply.outer(means, means)
    return pairs("cross-correlation as printed", product, part.names)
