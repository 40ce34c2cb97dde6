"""Continuous delays: what arrives within a step was sent between two steps, and lies on the line between these.

In: a Network. Out: its continuous delays, how many steps of what was sent are kept for each, and where what arrives at
a stage was sent.

At a stage that is a share p of a step behind step k − 1, with 0 < p < 1, what arrives after a delay of L steps was sent
at k − 1 + p − L. With L = W + F, W whole and 0 ≤ F < 1, this is q = p − F behind step k − 1 − W where q ≥ 0, else q + 1
behind the step before. So W + 1 steps back from k − 1 on are needed, and one more where F > 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, Indices, IntArray
from neurovis_spec.compiler.network import Network


class Between(NamedTuple):
    """A time between two steps: the first, counted from k − 1 − W on, and how far on it is, less than a step."""

    first: int
    share: float

    def of(self, one: float, next_: float) -> float:
        """What there is of what was sent at the first step and at the next one."""
        return one + self.share * (next_ - one) if self.share else one


@dataclass(frozen=True, slots=True, eq=False)
class Lags:
    """The continuous delays, one a connection (m,): whether it has one, and of how many ``whole`` steps and which
    ``part`` of one that is; 0 where it has none."""

    there: BoolArray
    whole: IntArray
    part: FloatArray

    @property
    def depth(self) -> IntArray:
        """How many steps back what was sent is read, the step before counted."""
        return np.asarray(self.whole + 1 + (self.part > 0))

    def some(self, connections: Indices) -> Lags:
        """Those of some connections."""
        return Lags(self.there[connections], self.whole[connections], self.part[connections])

    def at(self, connection: int, share: float) -> Between:
        """Where what arrives was sent, when this share of the step is over."""
        q = share - float(self.part[connection])
        if q >= 1.0:
            return Between(1, 0.0)
        return Between(0, q) if q >= 0.0 else Between(-1, q + 1.0)


def lags_of(network: Network) -> Lags | None:
    """The continuous delays of a network; None where it has none."""
    if network.connections.lags is None:
        return None
    exact = network.connections.lags.whole()
    there = ~np.isnan(exact)
    whole = np.floor(np.where(there, exact, 0.0))
    return Lags(there, whole.astype(np.int64), np.where(there, exact - whole, 0.0))


def ring_lengths(network: Network) -> Indices:
    """How many steps of what is sent on each connection (m,) are kept until it has arrived: as many as it takes, of a
    continuous delay all between which it arrives."""
    delays, lags = network.connections.delays.compact(), lags_of(network)
    return delays if lags is None else np.where(lags.there, lags.depth, delays)
