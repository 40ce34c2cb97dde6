"""Gains for Eqs. 2–5: as the author states them, else such that this network's range shows.

In: the peaks of a probe run. Out: Gains. A gain is chosen from the peaks of groups of neurons and entries of
connections rather than of single ones, so that one big group does not drown a small one: the value at which a colour is
full lies between the weakest and the strongest group, nearer to the weakest, so that quiet groups have colour too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.wishes import RenderSettings

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

#: groups whose peak is below this share of the strongest are not looked at: they are silent
_SILENT = 1 / 32
#: of a group with many members: the share of them that do not saturate
_MOST = 0.9
#: where between the weakest (0) and the strongest group (1) a colour is full, on a logarithmic scale
_BETWEEN = 0.25
#: how wide, in user units, the strongest and a typical line are to be in a small network
_WIDEST, _TYPICAL = 9.0, 4.5
#: with more lines than this they get thinner
_CROWD = 10


@dataclass(frozen=True, slots=True)
class Gains:
    """γ_NC (``activity``), γ_CC (``signal``), γ_CT (``thickness``, user units), γ_LI (``change``) of Eqs. 2–5."""

    activity: float
    signal: float
    thickness: float
    change: float


def choose_gains(
    network: Network,
    settings: RenderSettings,
    activity_peaks: FloatArray,
    weight_peaks: FloatArray,
    signal_peaks: FloatArray,
    change_peaks: FloatArray,
) -> Gains:
    """Gains that use the range of this network well; those that ``settings`` states win.

    The peaks are the largest magnitudes over a run: ``activity_peaks`` (n,) of a, ``weight_peaks`` (m,) of w,
    ``signal_peaks`` (m,) of w·a, ``change_peaks`` (m,) of w[t] − w[t−1]. All results are finite and positive.
    """
    groups = np.zeros(len(network.neurons), np.int64)
    for number, group in enumerate(network.neurons.groups):
        groups[group.start : group.start + group.count] = number
    entries = network.connections.entry
    changes = _peaks(change_peaks, np.arange(len(change_peaks)))
    chosen = Gains(
        activity=_full_at(_peaks(activity_peaks, groups, _MOST)),
        signal=_full_at(_peaks(signal_peaks, entries, _MOST)),
        thickness=_thickness(_peaks(weight_peaks, entries), len(network.connections)),
        change=1 / _nice(float(np.median(changes))) if len(changes) else 1.0,
    )
    return Gains(
        activity=chosen.activity if settings.activity is None else settings.activity,
        signal=chosen.signal if settings.signal is None else settings.signal,
        thickness=chosen.thickness if settings.thickness is None else settings.thickness,
        change=chosen.change if settings.change is None else settings.change,
    )


def _peaks(values: FloatArray, members: IntArray, share: float = 1.0) -> FloatArray:
    """The peak of every group of values that is not silent, finite and above zero: the value that a ``share`` of its
    members do not exceed."""
    finite = np.where(np.isfinite(values), np.abs(values), 0.0)
    order = np.lexsort((finite, members))
    first = np.flatnonzero(np.diff(members[order], prepend=-1))
    count = np.diff(first, append=len(members))
    peaks = finite[order][first + np.ceil(share * (count - 1)).astype(int)]
    result: FloatArray = peaks[(peaks > 1e-12) & (peaks >= _SILENT * peaks.max(initial=0.0)) & (peaks < 1e12)]
    return result


def _full_at(peaks: FloatArray) -> float:
    if not len(peaks):
        return 1.0
    low, high = float(peaks.min()), float(peaks.max())
    return 1 / _nice(low * (high / low) ** _BETWEEN)


def _thickness(peaks: FloatArray, connections: int) -> float:
    """Thinner where there are many lines: half as wide at 160 as at 10."""
    if not len(peaks):
        return _TYPICAL
    crowd = min(1.0, (_CROWD / max(connections, 1)) ** 0.25)
    return _nice(crowd * min(_WIDEST / float(peaks.max()), _TYPICAL / float(np.median(peaks))))


def _nice(value: float) -> float:
    """Two significant digits: what a legend can state."""
    return float(f"{value:.1e}")
