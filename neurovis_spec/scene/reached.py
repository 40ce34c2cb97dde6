"""Reached: the ranges of the activities, weights and signals of a run, from which gains are chosen.

In: the activities and weights of a run. Out: Reached. Values that are not finite are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene.signals import Signals

#: Rows looked at together.
_CHUNK = 256
#: So many steps at most are looked at for how much changes at each, and so many numbers in all.
_STEPS, _NUMBERS = 256, 4_000_000
#: What is below this share of a neuron's largest activity counts as rest.
REST = 1 / 200
#: The shares of the values of a shown state that lie below the ends of its colours, and below rest, which is grey.
_SHARES = (0.02, 0.5, 0.98)


@dataclass(frozen=True, eq=False)
class Reached:
    """Of n neurons the ``lowest`` and the ``highest`` a, and the geometric mean of |a| while they are not at rest
    (``typical``); of m connections the largest |w| (``weights``), |w·a| with what is sent in place of a (``signals``)
    and |w[t] − w[t−1]| (``changes``). 0 where there is nothing. ``steps`` (k, p) has the last of these at each of some
    steps, spread over the run, of the p connections that can change."""

    lowest: FloatArray
    highest: FloatArray
    typical: FloatArray
    weights: FloatArray
    signals: FloatArray
    changes: FloatArray
    steps: FloatArray
    #: of what neurons show in place of their activity: what 2 %, 50 % and 98 % of its values lie below (3, n)
    shares: FloatArray | None = None

    @property
    def activity(self) -> FloatArray:
        """The largest |a| (n,)."""
        result: FloatArray = np.maximum(np.abs(self.lowest), np.abs(self.highest))
        return result

    def with_shown(self, neurons: IntArray, values: FloatArray) -> Reached:
        """The same with the states (rows, k) that ``neurons`` (k,) show in place of their activities."""
        shares = np.zeros((3, len(self.lowest)))
        known = np.ma.masked_invalid(values)
        ends = [self.lowest.copy(), self.highest.copy()]
        for neuron, column in zip(neurons.tolist(), known.T, strict=True):
            found = column.compressed()
            if len(found):
                shares[:, neuron] = np.quantile(found, _SHARES)
            for end, of in zip(ends, (np.min, np.max), strict=True):
                end[neuron] = of(found) if len(found) else 0.0
        typical = self.typical.copy()
        typical[neurons] = 0.0
        return replace(self, lowest=ends[0], highest=ends[1], typical=typical, shares=shares)


def reached(network: Network, recording: Recording) -> Reached:
    """What a recording of a network reaches. Raises RecordingError for a partial one."""
    recording.check_whole("a picture cannot be drawn from")
    fixed = np.zeros(len(recording.sources))
    fixed[np.delete(np.arange(len(fixed)), recording.plastic)] = recording.weights_static
    sources, follows = network.connections.sources.whole(), np.diff(recording.step) == 1
    found = reached_by(sources, fixed, recording.activity, recording.weights, recording.plastic, follows)
    return replace(found, signals=largest_signals(network, recording)) if Signals(network) else found


def largest_signals(
    network: Network, recording: Recording, along: Callable[[FloatArray], FloatArray] = np.asarray
) -> FloatArray:
    """The largest magnitude of what a recording sends ``along`` each line, which connections are unless it is said how
    many of them (rows, m) make a line."""
    with np.errstate(over="ignore", invalid="ignore"):
        parts = [_largest(along(part)) for part in Signals(network).parts(recording)]
    result: FloatArray = np.max(parts, axis=0)
    return result


def nothing(network: Network) -> Reached:
    """What is known where nothing is run: the weights that stay as they are; the others may reach anything."""
    neurons, signals, changes = np.zeros(len(network.neurons)), *np.zeros((2, len(network.connections)))
    weights = _largest(network.connections.weights.whole()[None])
    weights[network.changing] = changes[network.changing] = np.inf
    return Reached(neurons, neurons, neurons, weights, signals, changes, np.zeros((0, len(network.changing))))


def reached_by(
    sources: IntArray,
    fixed: FloatArray,
    activity: FloatArray,
    weights: FloatArray,
    changing: IntArray,
    follows: npt.NDArray[np.bool_] | None = None,
) -> Reached:
    """The same of arrays: ``activity`` (rows, n), ``weights`` (rows, p) of the connections ``changing`` (p,), and
    those of all others in ``fixed`` (m,). ``follows`` (rows − 1,) says which row is the step after the one before;
    without it all are."""
    with np.errstate(over="ignore", invalid="ignore"):
        low, high = np.full((2, activity.shape[1]), [[np.inf], [-np.inf]])
        for rows in _chunks(len(activity)):
            known = np.isfinite(activity[rows])
            low = np.minimum(low, np.where(known, activity[rows], np.inf).min(axis=0))
            high = np.maximum(high, np.where(known, activity[rows], -np.inf).max(axis=0))
        low, high = (np.where(np.isfinite(end), end, 0.0) for end in (low, high))
        peaks = np.maximum(np.abs(low), np.abs(high))
        logs, awake = np.zeros((2, len(peaks)))
        reach, signals, changes = np.zeros((3, len(changing)))
        for rows in _chunks(len(activity)):
            size = np.abs(activity[rows])
            counts = (size > REST * peaks) & np.isfinite(size)
            logs += np.log(size, out=np.zeros_like(size), where=counts).sum(axis=0)
            awake += counts.sum(axis=0)
            if len(changing):
                reach = np.maximum(reach, _largest(weights[rows]))
                signals = np.maximum(signals, _largest(weights[rows] * activity[rows][:, sources[changing]]))
                steps = np.diff(weights[rows.start : rows.stop + 1], axis=0)
                changes = np.maximum(changes, _largest(steps if follows is None else steps[follows[rows]]))
        weight_peaks = np.where(np.isfinite(fixed), np.abs(fixed), 0.0)
        signal_peaks = weight_peaks * peaks[sources]
    change_peaks = np.zeros(len(fixed))
    weight_peaks[changing], signal_peaks[changing], change_peaks[changing] = reach, signals, changes
    typical = np.where(awake > 0, np.exp(logs / np.maximum(awake, 1)), 0.0)
    signal_peaks = np.where(np.isfinite(signal_peaks), signal_peaks, 0.0)
    return Reached(low, high, typical, weight_peaks, signal_peaks, change_peaks, _spread(weights, follows))


def _spread(weights: FloatArray, follows: npt.NDArray[np.bool_] | None) -> FloatArray:
    """By how much weights (rows, p) change at some of the steps at which that is known, (k, p)."""
    known = np.arange(len(weights) - 1) if follows is None else np.flatnonzero(follows)
    most = min(_STEPS, max(_NUMBERS // max(weights.shape[1], 1), 1))
    if len(known) > most:
        known = known[np.linspace(0, len(known) - 1, most).astype(np.int64)]
    with np.errstate(over="ignore", invalid="ignore"):
        result: FloatArray = np.abs(weights[known + 1] - weights[known])
    return result


def _chunks(rows: int) -> Iterator[slice]:
    for first in range(0, rows, _CHUNK):
        yield slice(first, min(first + _CHUNK, rows))


def _largest(values: FloatArray) -> FloatArray:
    """The largest magnitude of each column that is a finite number, 0 without any."""
    sizes = np.abs(values)
    result: FloatArray = np.where(np.isfinite(sizes), sizes, 0.0).max(axis=0, initial=0.0)
    return result
