"""Gains for Eqs. 2–5: as the author states them, else such that the range of each group and each entry shows.

In: what a run reaches. Out: Gains, one for every neuron and connection, and the scales that a legend shows. The neurons
of a group, and the connections of an entry, have one gain; what is declared in a module has one in all its instances.
Those whose ranges are alike share a scale.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.wishes import RenderSettings, StatedGain
from neurovis_spec.scene.reached import Reached, nothing

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]

#: a colour of this value can surely be told from grey, in every theme; one of ``_JUST`` beside others
_TOLD, _JUST = 0.9, 0.25
#: one that cannot be told weighs as much as so many doublings of others beyond what a colour shows
_LOST = 5.0
#: where the strongest is more than so many times the weakest, no scale shows both
_SPREAD = 32.0
#: of a group with many members: the share of them that a scale goes by
_MOST = 0.9
#: ranges that differ by less than this factor are alike; there are at most so many scales
_ALIKE, _SCALES = 2.0, 4
#: how wide, in user units, the strongest line is to be, one that learns, and a typical one, in a small network
_WIDEST, _LEARNED, _TYPICAL = 6.5, 5.0, 2.6
#: with more lines than this they get thinner
_CROWD = 10

_PATH = re.compile(r"[A-Za-z_]\w*(?:\.(?!\.)[A-Za-z_]\w*)+", re.ASCII)


@dataclass(frozen=True, slots=True)
class Scale:
    """A gain and what has it: the groups, entries or references in ``names`` (empty: all that have no other).
    ``reaches`` is how far their values go, as a distance from ``centre``; 0 where nothing is known of it."""

    gain: float
    names: tuple[str, ...] = ()
    centre: float = 0.0
    reaches: float = 0.0


@dataclass(frozen=True, eq=False)
class Gains:
    """γ_NC (``activity``, n) with what is drawn as 0 (``centre``, n), γ_CC (``signal``, m), γ_CT (``thickness``, m,
    user units), γ_LI (``change``, m) of Eqs. 2–5, and the scales that they make, each sort in the order of the spec."""

    activity: FloatArray
    centre: FloatArray
    signal: FloatArray
    thickness: FloatArray
    change: FloatArray
    activity_scales: tuple[Scale, ...]
    signal_scales: tuple[Scale, ...]
    thickness_scales: tuple[Scale, ...]
    change_scales: tuple[Scale, ...]


def plain_gains(network: Network, activity: float, signal: float, thickness: float, change: float) -> Gains:
    """One gain of each sort for all."""
    stated = RenderSettings(
        activity=(StatedGain(activity),),
        signal=(StatedGain(signal),),
        thickness=(StatedGain(thickness),),
        change=(StatedGain(change),),
    )
    return choose_gains(network, stated, nothing(network))


def choose_gains(network: Network, settings: RenderSettings, run: Reached) -> Gains:
    """Gains that use the range of each group and entry well; those that ``settings`` states win. All that are chosen
    are finite and positive."""
    groups, entries = _groups(network), _entries(network)
    learns = np.zeros(len(network.connections), bool)
    learns[network.changing] = True
    range_ = np.minimum(run.activity, 2 * run.typical)
    activity = _chosen(
        groups, [_full(range_[m]) for m in groups.members], run.highest, settings.activity, lowest=run.lowest
    )
    signal = _chosen(
        entries, [_full(run.signals[m]) for m in entries.members], run.signals, settings.signal, least=True
    )
    widths = [
        _learning(run.weights[m], len(network.changing)) if learns[m].any() else _fixed(run.weights[m], len(learns))
        for m in entries.members
    ]
    thickness = _chosen(entries, widths, run.weights, settings.thickness)
    changes = [_typical(run.changes[m]) for m in entries.members]
    change = _chosen(entries, changes, run.changes, settings.change)
    return Gains(
        activity=activity.gains,
        centre=activity.centres,
        signal=signal.gains,
        thickness=thickness.gains,
        change=change.gains,
        activity_scales=activity.scales,
        signal_scales=signal.scales,
        thickness_scales=thickness.scales,
        change_scales=change.scales,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Units:
    """What has one gain: the names of groups or entries, and the members of each."""

    names: tuple[str, ...]
    members: tuple[IntArray, ...]
    #: how many members there are in all
    count: int


@dataclass(frozen=True, slots=True, eq=False)
class _Chosen:
    gains: FloatArray
    centres: FloatArray
    scales: tuple[Scale, ...]


def _groups(network: Network) -> _Units:
    of_neurons = np.zeros(len(network.neurons), np.int64)
    names: dict[str, int] = {}
    for group in network.neurons.groups:
        name = group.name if group.module is None else f"{group.module}.{group.name.rpartition('.')[2]}"
        of_neurons[group.start : group.start + group.count] = names.setdefault(name, len(names))
    return _units(tuple(names), of_neurons)


def _entries(network: Network) -> _Units:
    """The entries of ``connections``; instances are called by their modules, so that an entry of a module is one."""
    called = {instance.path: instance.module for instance in network.instances}
    called |= {instance.declared: instance.module for instance in network.instances}

    def by_module(match: re.Match[str]) -> str:
        path, _, own = match[0].rpartition(".")
        return f"{called[path]}.{own}" if path in called else match[0]

    names: dict[str, int] = {}
    numbers = [
        names.setdefault(_PATH.sub(by_module, name) if called else name, len(names))
        for name in network.connections.entries
    ]
    return _units(tuple(names), np.array(numbers, np.int64)[network.connections.entry])


def _units(names: tuple[str, ...], numbers: IntArray) -> _Units:
    order = np.argsort(numbers, kind="stable")
    bounds = np.searchsorted(numbers[order], np.arange(len(names) + 1))
    members = tuple(order[low:high] for low, high in pairwise(bounds.tolist()))
    return _Units(names, members, len(numbers))


def _chosen(
    units: _Units,
    full: Sequence[float],
    highest: FloatArray,
    stated: Sequence[StatedGain],
    *,
    lowest: FloatArray | None = None,
    least: bool = False,
) -> _Chosen:
    """Gains for all members. ``full`` is the value that is to be full colour (or a pixel, …) in each unit, 0 where
    nothing is reached; of units that share a scale the middle counts, or the ``least``."""
    gains, centres = np.ones(units.count), np.zeros(units.count)
    owner = np.full(units.count, -1, np.int64)  # the number of the scale that each member has
    scales: list[Scale] = []
    for together in _alike(full):
        low, high = (end(full[unit] for unit in together) for end in (min, max))
        value = _nice(low if least else float(np.sqrt(low * high)))
        for unit in together:
            gains[units.members[unit]], owner[units.members[unit]] = 1 / value, len(scales)
        scales.append(Scale(1 / value, tuple(units.names[unit] for unit in together)))
    if scales:
        gains[owner < 0] = scales[0].gain
    free = owner >= 0
    for one in stated:
        members = np.arange(units.count) if one.members is None else np.array(one.members, np.int64)
        gains[members], centres[members], owner[members] = one.gain, one.centre, len(scales)
        free[members] = False
        scales.append(Scale(one.gain, (one.name,) if one.name else (), one.centre))
    left = {name for name, members in zip(units.names, units.members, strict=True) if free[members].any()}
    kept: dict[tuple[float, float], Scale] = {}
    for number, scale in enumerate(scales):
        mine = np.flatnonzero(owner == number)
        if not len(mine):
            continue
        names = scale.names
        if number < len(scales) - len(stated):
            names = tuple(name for name in names if name in left)
        reaches = float((highest[mine] - scale.centre).max(initial=0.0))
        if lowest is not None:
            reaches = max(reaches, float((scale.centre - lowest[mine]).max()))
        same = kept.get((scale.gain, scale.centre))
        if same is not None:
            names = () if not names or not same.names else (*same.names, *names)
            reaches = max(reaches, same.reaches)
        kept[scale.gain, scale.centre] = replace(scale, names=names, reaches=reaches)
    return _Chosen(gains, centres, tuple(kept.values()))


def _alike(full: Sequence[float]) -> list[list[int]]:
    """Units by the scale that they share, each in order, the scales by their first unit: as few as there can be with no
    two values in one that differ by more than ``_ALIKE``, or ``_SCALES`` where that would be more."""
    order = sorted((unit for unit, value in enumerate(full) if value > 0), key=lambda unit: full[unit])
    parts = [[unit] for unit in order]
    while len(parts) > 1:
        ratios = [full[high[-1]] / full[low[0]] for low, high in pairwise(parts)]
        place = min(range(len(ratios)), key=ratios.__getitem__)
        if ratios[place] > _ALIKE and len(parts) <= _SCALES:
            break
        parts[place : place + 2] = [parts[place] + parts[place + 1]]
    return sorted(sorted(part) for part in parts)


def _full(peaks: FloatArray) -> float:
    """The value at which the colour is full, for members that reach so much; 0 where none reaches anything.

    It is a balance: each member that cannot be told from grey weighs as much as some doublings of others beyond what a
    colour shows; where the weakest and the strongest are not too far apart, none is lost.
    """
    peaks = np.sort(peaks[(peaks > 1e-12) & (peaks < 1e12)])
    if not len(peaks):
        return 0.0
    top = float(peaks[int(np.ceil(_MOST * (len(peaks) - 1)))])
    tried = np.unique(np.minimum(peaks / _TOLD, top))
    lost = np.searchsorted(peaks, _TOLD * tried * (1 - 1e-9))
    above = np.searchsorted(peaks, tried, side="right")
    logs = np.log2(peaks)
    sums = np.concatenate([np.cumsum(logs[::-1])[::-1], [0.0]])
    beyond = sums[above] - (len(peaks) - above) * np.log2(tried)
    best = float(tried[int(np.argmin(_LOST * lost + beyond))])
    if peaks[-1] <= _SPREAD * peaks[0]:
        best = min(best, float(peaks[0]) / _JUST)
    return best


def _fixed(peaks: FloatArray, lines: int) -> float:
    """The weight that is one user unit wide among so many ``lines``; 0 where there is none."""
    peaks = peaks[(peaks > 1e-12) & (peaks < 1e12)]
    if not len(peaks):
        return 0.0
    return max(float(peaks.max()) / _WIDEST, float(np.median(peaks)) / _TYPICAL) / _crowd(lines)


def _learning(peaks: FloatArray, lines: int) -> float:
    """The same for weights that change, of which there are so many: by what the strongest reaches, so that it is seen
    to grow."""
    peaks = peaks[(peaks > 1e-12) & (peaks < 1e12)]
    return float(peaks.max()) / _LEARNED / _crowd(lines) if len(peaks) else 0.0


def _crowd(lines: int) -> float:
    """By how much lines are thinner where there are many of them: half as wide at 160 as at 10."""
    return float(min(1.0, (_CROWD / max(lines, 1)) ** 0.25))


def _typical(peaks: FloatArray) -> float:
    """The median of what is reached; 0 where nothing is."""
    peaks = peaks[(peaks > 1e-12) & (peaks < 1e12)]
    return float(np.median(peaks)) if len(peaks) else 0.0


def _nice(value: float) -> float:
    """Two significant digits: what a legend can state."""
    return float(f"{value:.1e}")
