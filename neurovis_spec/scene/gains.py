"""Gains for Eqs. 2–5: as the author states them, else such that this network's range shows.

In: the peaks of a probe run. Out: Gains. A gain is chosen from the peaks of groups of neurons and entries of
connections rather than of single ones, so that one big group does not drown a small one: the value at which a colour is
full is the geometric mean of the weakest and the strongest group.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.network import Network, RenderSettings

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

#: groups whose peak is below this share of the strongest are not looked at: they are silent
_SILENT = 1 / 32
#: how wide, in user units, the strongest and a typical line are to be in a small network
_WIDEST, _TYPICAL = 9.0, 4.5


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
        activity=_full_at(_peaks(activity_peaks, groups)),
        signal=_full_at(_peaks(signal_peaks, entries)),
        thickness=_thickness(_peaks(weight_peaks, entries), len(network.connections)),
        change=1 / _nice(float(np.median(changes))) if len(changes) else 1.0,
    )
    return Gains(
        activity=chosen.activity if settings.activity is None else settings.activity,
        signal=chosen.signal if settings.signal is None else settings.signal,
        thickness=chosen.thickness if settings.thickness is None else settings.thickness,
        change=chosen.change if settings.change is None else settings.change,
    )


def _peaks(values: FloatArray, members: IntArray) -> FloatArray:
    """The peak of every group of values that is not silent, finite and above zero."""
    finite = np.where(np.isfinite(values), np.abs(values), 0.0)
    peaks = np.zeros(int(members.max(initial=-1)) + 1)
    np.maximum.at(peaks, members, finite)
    result: FloatArray = peaks[(peaks > 1e-12) & (peaks >= _SILENT * peaks.max(initial=0.0)) & (peaks < 1e12)]
    return result


def _full_at(peaks: FloatArray) -> float:
    if not len(peaks):
        return 1.0
    return 1 / _nice(math.sqrt(float(peaks.min()) * float(peaks.max())))


def _thickness(peaks: FloatArray, connections: int) -> float:
    """Thinner where there are many lines: at 400 half as wide as at 40."""
    if not len(peaks):
        return _TYPICAL
    crowd = min(1.0, (40 / max(connections, 1)) ** 0.3)
    return _nice(crowd * min(_WIDEST / float(peaks.max()), _TYPICAL / float(np.median(peaks))))


def _nice(value: float) -> float:
    """Two significant digits: what a legend can state."""
    return float(f"{value:.1e}")
