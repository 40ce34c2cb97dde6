"""Gains for Eqs. 2–5: as the author states them, else such that the range of each group and each entry shows.

In: what a run reaches. Out: Gains, one for every neuron and connection, and the scales that a legend shows. The neurons
of a group, and the connections of an entry, have one gain; what is declared in a module has one in all its instances.
Those whose ranges are alike share a scale. Of an entry whose weights are too many, or too far apart, to be told by eye
the square root is shown: it is compressed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings, ShownState, StatedGain
from neurovis_spec.compiler.network import Network
from neurovis_spec.scene import encoding
from neurovis_spec.scene.called import Names, names_of, unit_of
from neurovis_spec.scene.reached import Reached
from neurovis_spec.scene.shown_states import ShownStates

#: what reaches so many times the full colour can be told from grey for most of a period, in every theme; at its height
#: alone; or what reaches nearly as much as the strongest
_TOLD, _LOST, _NEARLY = 1.3, 0.5, 0.75
#: what reaches so many times the full colour is far beyond it; and how much rather it is that than lost in grey
_FAR, _RATHER = 1.5, 1.3
#: a colour of this value can just be told; a strongest that is more than so many times the weakest has no scale with it
_JUST, _SPREAD = 0.25, 32.0
#: of a group with many members: the share of them that a scale goes by
_MOST = 0.9
#: ranges that differ by less than this factor are alike; there are at most so many scales
_ALIKE, _SCALES = 2.0, 4
#: of those that are one-sided, so that each uses nearly the whole of its colour
_ALIKE_SPANS = 1.25
#: weights are compared by eye: those that differ by less than this factor share a scale
_ALIKE_WEIGHTS = 3.0
#: how wide, in user units, the strongest line is to be, one that learns, and a typical one, in a small network; and how
#: wide one must become to be seen to grow
_WIDEST, _LEARNED, _TYPICAL, _SEEN = 5.0, 5.0, 2.2, 2.0
#: with more lines than this they get thinner
_CROWD = 10
#: an entry of more connections than this is compressed, and one whose strongest are so many times a typical one
_MANY, _FAR_APART = 500, 20.0
#: the share of its members that those which are "the strongest" of a group or an entry are not less than
_STRONGEST = 0.99
#: how wide the strongest are at least of what is compressed, and how wide any is at most
_STRONG, _BROADEST = 2.4, 6.0
#: the share of changes that the largest are beyond, which alone glow where everything learns all the time
_LARGEST = 0.9
#: a state is at rest at 0 where the middle of its values is nearer to that than this share of its range
_REST = 0.1
#: what is at most so much is nothing but rounding, and beyond that numbers overflow
_LEAST, _GREATEST = 1e-12, 1e280


@dataclass(frozen=True, slots=True)
class Scale:
    """A gain and what has it: the groups, entries or references in ``names`` (empty: all that have no other).
    ``reaches`` is how far their values go, as a distance from ``centre``; 0 where nothing is known of it. ``state`` is
    what is shown in place of an activity. Where it is ``compressed`` the gain is that of the square root; of changes,
    those below ``least`` are not shown."""

    gain: float
    names: tuple[str, ...] = ()
    centre: float = 0.0
    reaches: float = 0.0
    state: str = ""
    compressed: bool = False
    least: float = 0.0

    def shown(self, value: float) -> float:
        """What of a magnitude the gain is multiplied with."""
        return math.sqrt(value) if self.compressed else value

    @property
    def full(self) -> float:
        """The magnitude at which a colour is full, or a line is a unit wide."""
        return 1 / self.gain**2 if self.compressed else 1 / abs(self.gain)


@dataclass(frozen=True, eq=False)
class Gains:
    """γ_NC (``activity``, n) with what is drawn as 0 (``centre``, n), γ_CC (``signal``, m), γ_CT (``thickness``, m,
    user units), γ_LI (``change``, m) of Eqs. 2–5, and the scales that they make, each sort in the order of the spec.
    Connections are compressed, or not, in their colour and in their thickness (m), and glow where they change by no
    less than ``least_change`` (m)."""

    activity: FloatArray
    centre: FloatArray
    signal: FloatArray
    thickness: FloatArray
    change: FloatArray
    signal_compressed: BoolArray
    thickness_compressed: BoolArray
    least_change: FloatArray
    activity_scales: tuple[Scale, ...]
    signal_scales: tuple[Scale, ...]
    thickness_scales: tuple[Scale, ...]
    change_scales: tuple[Scale, ...]

    def thickened(self, weights: FloatArray) -> FloatArray:
        """What of weights (m,) is shown as thickness: their magnitudes, or the square roots of these."""
        sizes = np.abs(weights)
        result: FloatArray = np.where(self.thickness_compressed, np.sqrt(sizes), sizes)
        return result

    def widths(self, weights: FloatArray) -> FloatArray:
        """Eq. 4 of weights (m,)."""
        return encoding.thickness(weights, self.thickness, self.thickness_compressed)

    def on_thickness(self, scale: Scale) -> BoolArray:
        """The connections (m,) that have a scale of thickness."""
        result: BoolArray = (self.thickness == scale.gain) & (self.thickness_compressed == scale.compressed)
        return result

    @property
    def brief(self) -> Gains:
        """The same with one scale of each sort; that there are others is said beside its names."""

        def cut(scales: tuple[Scale, ...]) -> tuple[Scale, ...]:
            if len(scales) <= 1:
                return scales
            return (replace(scales[0], names=(*(scales[0].names[:1] or ("others",)), "…")),)

        return replace(
            self,
            activity_scales=cut(self.activity_scales),
            signal_scales=cut(self.signal_scales),
            thickness_scales=cut(self.thickness_scales),
            change_scales=cut(self.change_scales),
        )


def in_pages(gains: Gains, unit: float) -> Gains:
    """The gains with widths in page units, of which each is so many user units."""
    if unit == 1:
        return gains
    scales = tuple(replace(scale, gain=scale.gain / unit) for scale in gains.thickness_scales)
    return replace(gains, thickness=gains.thickness / unit, thickness_scales=scales)


def choose_gains(network: Network, settings: RenderSettings, run: Reached) -> Gains:
    """Gains that use the range of each group and entry well; those that ``settings`` states win. All that are chosen
    are finite and positive."""
    names = names_of(network)
    groups, entries = _groups(network, names), _entries(network, names)
    colours = _colours(groups, run)
    stated = [*_of_states(settings.show, run.shares, names), *_named(settings.activity, names)]
    activity = _chosen(groups, colours, stated, run.highest, run.lowest, ShownStates(network).called)
    compressed = _compressed(entries, run.weights)
    signals = _signals(entries, run.signals, compressed)
    signal = _chosen(entries, signals, _of_lines(settings.signal, names, network), run.signals)
    widths = _widths(entries, run.weights, network.changing, compressed)
    thickness = _chosen(entries, widths, _of_lines(settings.thickness, names, network), run.weights)
    changes = _changes(entries, run, network.changing)
    change = _chosen(entries, changes, _of_lines(settings.change, names, network), run.changes)
    return Gains(
        activity=activity.gains,
        centre=activity.centres,
        signal=signal.gains,
        thickness=thickness.gains,
        change=change.gains,
        signal_compressed=signal.compressed,
        thickness_compressed=thickness.compressed,
        least_change=change.least,
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
    compressed: BoolArray
    least: FloatArray
    scales: tuple[Scale, ...]


def _groups(network: Network, names: Names) -> _Units:
    of_neurons = np.zeros(len(network.neurons), np.int64)
    numbers: dict[str, int] = {}
    for group in network.neurons.groups:
        number = numbers.setdefault(unit_of(group), len(numbers))
        of_neurons[group.start : group.start + group.count] = number
    return _units(tuple(names.called[name] for name in numbers), of_neurons)


def _entries(network: Network, names: Names) -> _Units:
    """The entries of ``connections``; an entry of a module is one."""
    plain = replace(names, called={})
    numbers: dict[str, int] = {}
    of_entries, called = [], dict[int, str]()
    for entry in network.connections.entries:
        number = numbers.setdefault(plain.reference(entry), len(numbers))
        called.setdefault(number, names.reference(entry))
        of_entries.append(number)
    return _units(tuple(called.values()), np.array(of_entries, np.int64)[network.connections.entry.whole()])


def _units(names: tuple[str, ...], numbers: IntArray) -> _Units:
    order = np.argsort(numbers, kind="stable")
    bounds = np.searchsorted(numbers[order], np.arange(len(names) + 1))
    members = tuple(order[low:high] for low, high in pairwise(bounds.tolist()))
    return _Units(names, members, len(numbers))


def _named(stated: Sequence[StatedGain], names: Names) -> list[StatedGain]:
    """The gains of the author in the words of the picture."""
    return [replace(one, name=names.reference(one.name)) for one in stated]


def _of_lines(stated: Sequence[StatedGain], names: Names, network: Network) -> list[StatedGain]:
    """The same of connections: what is said of one of a symmetric pair is said of the line that both are."""
    paired = network.connections.with_twins
    return [
        one if one.members is None else replace(one, members=tuple(paired(np.array(one.members, np.int64)).tolist()))
        for one in _named(stated, names)
    ]


def _of_states(shown: Sequence[ShownState], shares: FloatArray | None, names: Names) -> Iterator[StatedGain]:
    """The gains of what is shown in place of activities: rest is grey, and nearly all values have a colour of their
    own. Rest is 0 where it is near that, else as a legend can state it."""
    for one in shown:
        if shares is None:
            return
        low, rest, high = shares[:, list(one.members)]
        ends, centre = (float(low.min()), float(high.max())), float(np.median(rest))
        full = max(ends[1] - centre, centre - ends[0])
        if _LEAST * max(abs(centre), 1.0) < full < _GREATEST:
            fine = 10.0 ** np.floor(np.log10(full / 10))
            near = abs(centre) <= _REST * (ends[1] - ends[0])
            centre = 0.0 if near else float(f"{fine * np.rint(centre / fine):.12g}")
            full = _nice(max(ends[1] - centre, centre - ends[0]))
        else:
            full = 1.0
        yield StatedGain(1 / full, one.members, names.reference(one.name), centre)


@dataclass(frozen=True, slots=True)
class _Share:
    """Units that have a gain together."""

    units: list[int]
    gain: float
    compressed: bool = False
    least: float = 0.0


def _chosen(
    units: _Units,
    chosen: Sequence[_Share],
    stated: Sequence[StatedGain],
    highest: FloatArray,
    lowest: FloatArray | None = None,
    states: Sequence[str] = (),
) -> _Chosen:
    """Gains for all members: those that are chosen, under those that are stated. ``highest`` and ``lowest`` say how far
    the values of the members go, ``states`` which of them are states that are shown."""
    owner = np.full(units.count, -1, np.int64)  # the number of the scale that each member has
    scales: list[Scale] = []
    for share in chosen:
        for unit in share.units:
            owner[units.members[unit]] = len(scales)
        names = tuple(units.names[unit] for unit in share.units)
        scales.append(Scale(share.gain, names, compressed=share.compressed, least=share.least))
    others = scales[0] if scales else Scale(1.0)
    free = owner >= 0
    for one in stated:
        members = np.arange(units.count) if one.members is None else np.array(one.members, np.int64)
        owner[members], free[members] = len(scales), False
        scales.append(Scale(one.gain, (one.name,) if one.name else (), one.centre))
    left = {name for name, members in zip(units.names, units.members, strict=True) if free[members].any()}
    kept: dict[Scale, Scale] = {}
    for number, scale in enumerate(scales):
        mine = np.flatnonzero(owner == number)
        if not len(mine):
            continue
        names = scale.names
        if number < len(chosen):
            names = tuple(name for name in names if name in left)
        reaches = float((highest[mine] - scale.centre).max(initial=0.0))
        if lowest is not None:
            reaches = max(reaches, float((scale.centre - lowest[mine]).max()))
        state = _what({states[index] for index in mine.tolist()} if states else {""})
        if state and len(mine) == units.count:
            names = ()
        key = replace(scale, names=(), state=state)
        same = kept.get(key)
        if same is not None:
            names = () if not names or not same.names else (*same.names, *names)
            reaches = max(reaches, same.reaches)
        kept[key] = replace(scale, names=names, reaches=reaches, state=state)
    if not kept and units.count:
        kept[Scale(1.0)] = Scale(1.0)
    if len(kept) == 1 and not stated:  # it is that of all which have one
        kept = {key: replace(scale, names=()) for key, scale in kept.items()}
    return _by_owner([*scales, others], owner, tuple(kept.values()))


def _by_owner(scales: Sequence[Scale], owner: IntArray, shown: tuple[Scale, ...]) -> _Chosen:
    """What the scales say of all members, by the number of the scale that each has: −1 is that of the last."""
    return _Chosen(
        gains=np.array([scale.gain for scale in scales])[owner],
        centres=np.array([scale.centre for scale in scales])[owner],
        compressed=np.array([scale.compressed for scale in scales])[owner],
        least=np.array([scale.least for scale in scales])[owner],
        scales=shown,
    )


def _what(states: set[str]) -> str:
    """What a scale is of, where it is not activities alone."""
    return "" if states == {""} else ", ".join(sorted(state or "activity" for state in states))


def _compressed(entries: _Units, weights: FloatArray) -> list[bool]:
    """Of which entries the square root is shown: those of many connections, and those whose strongest are far stronger
    than a typical one. Of what is all alike nothing is gained by it."""
    result = []
    for members in entries.members:
        known = _known(weights[members])
        many = len(members) > _MANY
        apart = len(known) > 0 and float(np.quantile(known, _STRONGEST)) >= _FAR_APART * _middle(known)
        result.append((many or apart) and len(known) > 0 and bool(np.ptp(known) > 0))
    return result


def _colours(groups: _Units, run: Reached) -> list[_Share]:
    """Gains of activities. Those of a group that is one-sided, as rates are, span all that it reaches, as half of a
    theme's colours is all that it has. What the others have does not hang on that."""
    range_ = 2 * np.minimum(run.activity / 2, run.typical)  # so that nothing overflows
    spans = []
    for members in groups.members:
        one_sided = bool((run.lowest[members] >= 0).all() or (run.highest[members] <= 0).all())
        spans.append(_strongest(run.activity[members]) if one_sided else 0.0)
    shares = [
        _Share(units, 1 / _nice(max(spans[unit] for unit in units))) for units in _alike(spans, _ALIKE_SPANS, _SCALES)
    ]
    for share in _shared([_full(range_[members]) for members in groups.members]):
        others = [unit for unit in share.units if not spans[unit]]
        shares += [replace(share, units=others)] if others else []
    return sorted(shares, key=lambda share: share.units)


def _signals(entries: _Units, signals: FloatArray, compressed: Sequence[bool]) -> list[_Share]:
    """Gains of signals. What is compressed has its full colour at its strongest."""
    reached = [signals[members] for members in entries.members]
    exact = [0.0 if root else _full(own) for own, root in zip(reached, compressed, strict=True)]
    strongest = [_strongest(own) if root else 0.0 for own, root in zip(reached, compressed, strict=True)]
    roots = [
        _Share(units, 1 / math.sqrt(_nice(max(strongest[unit] for unit in units))), compressed=True)
        for units in _alike(strongest, _ALIKE**2, _SCALES)
    ]
    return sorted([*_shared(exact, least=True), *roots], key=lambda share: share.units)


def _changes(entries: _Units, run: Reached, changing: IntArray) -> list[_Share]:
    """Gains of changes. Where more glows than does not, only the largest changes are to glow, so that it is seen where
    and when most is learned."""
    shares = []
    for share in _shared([_middle(_known(run.changes[members])) for members in entries.members]):
        own = np.isin(changing, np.concatenate([entries.members[unit] for unit in share.units]))
        steps = run.steps[:, own]
        known = _known(steps)
        always = 2 * np.count_nonzero(share.gain * known >= encoding.FAINTEST) > steps.size
        shares.append(replace(share, least=float(np.quantile(known, _LARGEST)) if always else 0.0))
    return shares


def _strongest(values: FloatArray) -> float:
    """The magnitude that hardly any of a group, or of an entry, is beyond; 0 where none reaches anything."""
    known = _known(values)
    return float(np.quantile(known, _STRONGEST, method="higher")) if len(known) else 0.0


def _shared(full: Sequence[float], *, least: bool = False) -> list[_Share]:
    """Gains at which ``full`` is 1; 0 in a unit that reaches nothing. Where units share a scale the middle of theirs
    counts, or the ``least``."""
    result = []
    for units in _alike(full, _ALIKE, _SCALES):
        low, high = (end(full[unit] for unit in units) for end in (min, max))
        result.append(_Share(units, 1 / _nice(low if least else float(np.sqrt(low) * np.sqrt(high)))))
    return result


def _widths(entries: _Units, weights: FloatArray, changing: IntArray, compressed: Sequence[bool]) -> list[_Share]:
    """Gains of thickness. Entries whose strongest weights are alike share one, so that these can be compared. One that
    learns has that of others if it is seen to grow there, else by what it reaches."""
    reached = [_known(weights[members]) for members in entries.members]
    roots = [own if root else own[:0] for own, root in zip(reached, compressed, strict=True)]
    peaks = [own[:0] if root else own for own, root in zip(reached, compressed, strict=True)]
    tops = [float(values.max(initial=0.0)) for values in peaks]
    learns = np.isin(np.arange(entries.count), changing)
    learning = {unit for unit, members in enumerate(entries.members) if learns[members].any()}
    fixed = [0.0 if unit in learning else top for unit, top in enumerate(tops)]
    shares = []
    for units in _alike(fixed, _ALIKE_WEIGHTS, _SCALES - 1):
        every = np.concatenate([peaks[unit] for unit in units])
        gain = min(_WIDEST / float(every.max()), _TYPICAL / _middle(every)) * _crowd(entries.count)
        shares.append(_Share(units, gain))
    for unit in learning:
        for share in shares:
            ends = [tops[unit], *(fixed[other] for other in share.units if fixed[other])]
            if _SEEN <= tops[unit] * share.gain <= _WIDEST and max(ends) <= _ALIKE_WEIGHTS * min(ends):
                share.units.append(unit)
                tops[unit] = 0.0
                break
    own = [top if unit in learning else 0.0 for unit, top in enumerate(tops)]
    for units in _alike(own, _LEARNED / _SEEN, _SCALES - 1):
        shares.append(_Share(units, _LEARNED / max(own[unit] for unit in units) * _crowd(len(changing))))
    shares += _root_widths(roots)
    nice = [replace(share, units=sorted(share.units), gain=1 / _nice(1 / share.gain)) for share in shares]
    return sorted(nice, key=lambda share: share.units)


def _root_widths(peaks: Sequence[FloatArray]) -> list[_Share]:
    """The same of entries that are compressed: their strongest are wide, however many lines there are, and a typical
    one is no thinner than a line can be, if no other gets too wide for it."""
    shares = []
    for units in _alike([float(own.max(initial=0.0)) for own in peaks], _ALIKE_WEIGHTS**2, _SCALES):
        every = np.concatenate([peaks[unit] for unit in units])
        least = max(_STRONG / math.sqrt(_strongest(every)), encoding.THINNEST / math.sqrt(_middle(every)))
        shares.append(_Share(units, min(least, _BROADEST / math.sqrt(every.max())), compressed=True))
    return shares


def _alike(values: Sequence[float], factor: float, most: int) -> list[list[int]]:
    """Units by the scale that they share, each in order, the scales by their first unit: neighbours are put together,
    the nearest first, as long as no two values in one differ by more than ``factor``, and until there are at most
    ``most``. A value of 0 has none."""
    rounded = np.array([_nice(value) for value in values])
    lows = np.unique(rounded[rounded > 0])  # of each part the least value, and the greatest
    highs = lows.copy()
    while len(lows) > 1:
        ratios = highs[1:] / lows[:-1]
        place = int(np.argmin(ratios))
        if ratios[place] > factor and len(lows) <= most:
            break
        lows, highs = np.delete(lows, place + 1), np.delete(highs, place)
    part = np.searchsorted(lows, rounded, side="right") - 1
    return sorted([np.flatnonzero((part == number) & (rounded > 0)).tolist() for number in range(len(lows))])


def _full(peaks: FloatArray) -> float:
    """The value at which the colour is full, for members that reach so much; 0 where none reaches anything.

    It is a balance of those that then can hardly be told from grey and those that are far beyond what a colour shows; a
    little rather the latter. Where the weakest and the strongest are not too far apart, none is quite lost.
    """
    peaks = np.sort(_known(peaks))
    if not len(peaks):
        return 0.0
    top = float(peaks[int(np.ceil(_MOST * (len(peaks) - 1)))])
    tried = np.unique(np.append(peaks[peaks < _NEARLY * top] / _TOLD, top))
    sums = np.concatenate([[0.0], np.cumsum(peaks)])
    enough = np.minimum(_TOLD * tried, _NEARLY * top) * (1 - 1e-9)
    lost = np.searchsorted(peaks, np.minimum(_LOST * tried, enough))
    hard = np.searchsorted(peaks, enough)
    missing = lost + ((hard - lost) * _TOLD - (sums[hard] - sums[lost]) / tried) / (_TOLD - _LOST)
    beyond = len(peaks) - np.searchsorted(peaks, _FAR * tried, side="right")
    best = float(tried[int(np.argmin(_RATHER * missing + beyond))])
    if peaks[-1] <= _SPREAD * peaks[0]:
        best = min(best, float(peaks[0]) / _JUST)
    return best


def _known(values: FloatArray) -> FloatArray:
    """Those that are not next to nothing, and finite; those so large that they cannot be added up count as less."""
    result: FloatArray = np.minimum(values[(values > _LEAST) & np.isfinite(values)], _GREATEST)
    return result


def _middle(values: FloatArray) -> float:
    """The median; 0 of nothing."""
    return float(np.median(values)) if len(values) else 0.0


def _crowd(lines: int) -> float:
    """By how much lines are thinner where there are many of them: half as wide at 160 as at 10."""
    return float(min(1.0, (_CROWD / max(lines, 1)) ** 0.25))


def _nice(value: float) -> float:
    """Two significant digits: what a legend can state."""
    return float(f"{value:.1e}")
