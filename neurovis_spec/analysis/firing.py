"""Firing: what the spikes of a recording tell: rates, intervals, counts, and how spikes of one follow those of another.

In: a Recording that holds spikes, which neurons, from which step to which. Out: named arrays: a row for each neuron or
group, or for each bin of time, of intervals, of lags. A group is what the spec calls one, where all of its neurons are
asked for; any other neuron stands by itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations_with_replacement

import numpy as np

from neurovis_spec import arguments
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.excerpt import chosen
from neurovis_spec.runtime.named_array import Axis, NamedArray
from neurovis_spec.runtime.names import are_numbered
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.spikes import Fired

#: Of a neuron, and of a group, whose numbers are means over its neurons.
_OF_NEURONS = ("spikes", "rate", "interval", "CV", "Fano factor")
_OF_GROUPS = ("neurons", *_OF_NEURONS)
#: So many windows the steps are cut into for the Fano factor, and bins for curves, unless something else is asked for.
WINDOWS, BINS = 10, 100


def firing(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    windows: int = WINDOWS,
) -> NamedArray:
    """A row for each neuron: its ``spikes``, its ``rate`` a second, the mean ``interval`` between its spikes in seconds
    and their coefficient of variation (``CV``), and the ``Fano factor`` of its counts in as many ``windows`` of the
    steps; NaN where there are too few. Raises KeyError, RecordingError where it holds no spikes or no such steps."""
    trains = _trains(recording, of, start, stop)
    return NamedArray("firing", trains.table(windows), Axis("neuron", trains.names), Axis("quantity", _OF_NEURONS))


def group_firing(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    windows: int = WINDOWS,
) -> NamedArray:
    """The same, a row for each group: how many ``neurons`` it has, all their ``spikes``, and the means of the rest over
    those that have it."""
    trains = _trains(recording, of, start, stop)
    table = trains.table(windows)
    values = np.full((len(trains.groups), len(_OF_GROUPS)), np.nan)
    for row, members in enumerate(trains.groups.values()):
        own = table[members]
        values[row, :2] = len(members), own[:, 0].sum()
        for column in range(1, len(_OF_NEURONS)):
            known = own[np.isfinite(own[:, column]), column]
            values[row, column + 1] = known.mean() if len(known) else np.nan
    return NamedArray("group firing", values, Axis("group", tuple(trains.groups)), Axis("quantity", _OF_GROUPS))


def rates(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    bins: int = BINS,
) -> NamedArray:
    """The rate of each group over time, a neuron and a second: a row for each of so many bins, by its first step."""
    trains = _trains(recording, of, start, stop)
    edges = trains.cuts(_count(bins))
    values = np.stack([trains.counts(members, edges) / len(members) for members in trains.groups.values()], axis=1)
    values /= (np.diff(edges) * recording.dt)[:, None]
    return NamedArray("rates", values, _steps(edges), Axis("group", tuple(trains.groups)), "1/s")


def around(
    recording: Recording,
    episode: int,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    bins: int = BINS,
) -> NamedArray:
    """The same over the steps of an ``episode``, the mean of all that are whole (a peristimulus time histogram); a row
    for each bin, by its first step in the episode. Raises RecordingError where none is."""
    trains, steps = _trains(recording, of, start, stop), arguments.integer("episode", episode, 1)
    first, last = -(-trains.fired.first // steps), trains.fired.stop // steps
    if last <= first:
        raise RecordingError(f"no episode of {steps} steps is whole")
    edges = _cuts(0, steps, _count(bins))
    inside = (trains.fired.steps >= first * steps) & (trains.fired.steps < last * steps)
    at, who = trains.fired.steps[inside] % steps, trains.places[inside]
    values = [
        np.histogram(at[np.isin(who, members)], edges)[0] / (len(members) * (last - first))
        for members in trains.groups.values()
    ]
    table = np.stack(values, axis=1) / (np.diff(edges) * recording.dt)[:, None]
    return NamedArray("rates in episodes", table, _steps(edges), Axis("group", tuple(trains.groups)), "1/s")


def intervals(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    bins: int = BINS,
) -> NamedArray:
    """How often intervals between spikes of the same neuron are so long: of each group the share in each of so many
    bins, up to the 99th percentile; a row for each bin, by its first step. Raises RecordingError where no neuron fires
    twice."""
    trains = _trains(recording, of, start, stop)
    found = {name: trains.intervals(members)[0] for name, members in trains.groups.items()}
    every = np.concatenate(list(found.values()))
    if not len(every):
        raise RecordingError("no neuron fires twice")
    longest = int(np.quantile(every, 0.99, method="higher")) + 1
    edges = _cuts(0, longest, _count(bins))
    shares = [np.histogram(own, edges)[0] / max(len(own), 1) for own in found.values()]
    return NamedArray("intervals", np.stack(shares, axis=1), _steps(edges), Axis("group", tuple(found)))


def correlogram(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    reach: float | None = None,
    bins: int = BINS,
) -> NamedArray:
    """Cross-correlograms: how often a neuron of one group fires so long after a spike of a neuron of another, a second;
    within a group of two different neurons, of a single neuron its autocorrelogram without the spike itself. A row for
    each bin of lags, by the step in its middle, up to ``reach`` seconds to either side (by default ten mean intervals
    of the group that fires most, a quarter of the time at most), as far as there are such lags; a column for each pair.
    Raises RecordingError where nobody fires."""
    trains = _trains(recording, of, start, stop)
    steps = trains.fired.stop - trains.fired.first
    far = trains.reach() if reach is None else round(_positive("reach", reach, steps * recording.dt) / recording.dt)
    far = min(far, max(steps - 2, 0))
    width = -(-2 * far // max(_count(bins), 2)) | 1  # so that a bin is as far to either side of lag 0
    half = max(1, far // width)
    edges = np.arange(-half, half + 2) * width - width // 2
    # of how much of the time there is a step so far away
    seen = 1 - np.abs(edges[:-1] + width // 2) / steps
    seen = np.where(seen > 0, seen, np.nan)
    columns, values = list[str](), list[FloatArray]()
    for one, other in combinations_with_replacement(trains.groups, 2):
        members, others = trains.groups[one], trains.groups[other]
        pairs = trains.pairs(members, others, edges)
        sent = int(np.isin(trains.places, members).sum())
        targets = max(len(others) - (one == other), 1)
        columns.append(f"{one}, {other}")
        values.append(pairs / (max(sent, 1) * targets * width * recording.dt * seen))
    middles = _steps(edges + width // 2)
    return NamedArray("correlogram", np.stack(values, axis=1), middles, Axis("pair", tuple(columns)), "1/s")


class _Trains:
    """The spikes of some neurons, called ``names``: ``places`` are the places among these of those that have fired."""

    def __init__(
        self, fired: Fired, places: IntArray, names: tuple[str, ...], groups: Mapping[str, IntArray], dt: float
    ):
        self.fired, self.places, self.names, self.groups, self.dt = fired, places, names, groups, dt

    @property
    def seconds(self) -> float:
        """How long they were looked at."""
        return (self.fired.stop - self.fired.first) * self.dt

    def cuts(self, count: int) -> IntArray:
        """The steps cut into so many parts, or as many as there are steps."""
        return _cuts(self.fired.first, self.fired.stop, count)

    def counts(self, members: IntArray, edges: IntArray) -> FloatArray:
        """All spikes of some neurons between these steps."""
        own = self.fired.steps[np.isin(self.places, members)]
        return np.diff(np.searchsorted(own, edges)).astype(np.float64)

    def intervals(self, members: IntArray | None = None) -> tuple[IntArray, IntArray]:
        """The steps between spikes of the same neuron, and whose they are."""
        some = slice(None) if members is None else np.isin(self.places, members)
        steps, who = self.fired.steps[some], self.places[some]
        order = np.lexsort((steps, who))
        steps, who = steps[order], who[order]
        same = np.diff(who) == 0
        return np.diff(steps)[same], who[1:][same]

    def table(self, windows: int) -> FloatArray:
        """What ``firing`` says of each neuron."""
        count = len(self.names)
        spikes = np.bincount(self.places, minlength=count).astype(np.float64)
        between, whose = self.intervals()
        many = np.bincount(whose, minlength=count).astype(np.float64)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.bincount(whose, between, count) / many
            spread = np.sqrt(np.bincount(whose, (between - mean[whose]) ** 2, count) / (many - 1))
            cv = np.where(many > 1, spread / mean, np.nan)
        edges = self.cuts(_count(windows, "windows"))
        at = np.searchsorted(edges, self.fired.steps, "right") - 1
        counts = np.zeros((count, len(edges) - 1))
        np.add.at(counts, (self.places, at), 1.0)
        fano = np.full(count, np.nan)
        if counts.shape[1] > 1:
            some = spikes > 0
            fano[some] = counts[some].var(axis=1, ddof=1) / counts[some].mean(axis=1)
        return np.column_stack([spikes, spikes / self.seconds, mean * self.dt, cv, fano])

    def reach(self) -> int:
        """How far correlograms look by themselves, in steps."""
        if not len(self.places):
            raise RecordingError("nobody fires")
        most = max(self.counts(members, self.cuts(1)).sum() / len(members) for members in self.groups.values())
        steps = self.fired.stop - self.fired.first
        return max(1, min(int(10 * steps / most), steps // 4))

    def pairs(self, members: IntArray, others: IntArray, edges: IntArray) -> FloatArray:
        """How many pairs of spikes of two different neurons, or of a single one, are so far apart: by lags between
        these edges (bins,)."""
        far = int(np.abs(edges).max())
        steps, lags = self.fired.stop - self.fired.first, np.arange(-far, far + 1)
        size = 1 << (steps + far).bit_length()  # so that no lag comes round
        one, other = (np.fft.rfft(self._by_step(some, steps), size) for some in (members, others))
        found = np.rint(np.fft.irfft(np.conj(one) * other, size))[lags]
        both = np.intersect1d(members, others)
        if len(members) == 1 and len(both):
            found[far] = 0.0  # each spike with itself
        elif len(both):
            found -= self._of_same(both, far)
        within = (lags >= edges[0]) & (lags < edges[-1])
        bins = np.searchsorted(edges, lags[within], "right") - 1
        result: FloatArray = np.bincount(bins, found[within], len(edges) - 1).astype(np.float64)
        return result

    def _by_step(self, members: IntArray, steps: int) -> IntArray:
        """How many of some neurons fire at each step."""
        own = np.isin(self.places, members)
        return np.bincount(self.fired.steps[own] - self.fired.first, minlength=steps)

    def _of_same(self, members: IntArray, far: int) -> FloatArray:
        """How many pairs of spikes of the same neuron are so far apart, by lags from −far to far."""
        own = np.isin(self.places, members)
        steps, who = self.fired.steps[own], self.places[own]
        order = np.lexsort((steps, who))
        steps, who = steps[order], who[order]
        counts = np.zeros(2 * far + 1)
        counts[far] = len(steps)
        for ahead in range(1, len(steps)):  # the next spike of each, the one behind it, …
            between = (steps[ahead:] - steps[:-ahead])[who[ahead:] == who[:-ahead]]
            between = between[between <= far]
            if not len(between):
                break
            counts += np.bincount(np.concatenate([far + between, far - between]), minlength=2 * far + 1)
        return counts


def _trains(recording: Recording, of: str | Sequence[str] | None, start: int | None, stop: int | None) -> _Trains:
    """The spikes of the neurons that references name, by default of all that spike. Raises KeyError, RecordingError."""
    if recording.spiking is None:
        raise RecordingError("the recording holds no spikes")
    index = {name: place for place, name in enumerate(recording.neurons)}
    names = tuple(recording.neurons[place] for place in recording.spiking.tolist())
    if of is not None:
        spiking = frozenset(names)
        names = tuple(name for name in chosen(recording, of) if name in spiking)
        if not names:
            raise RecordingError("none of these neurons spikes")
    first = recording.spike_range[0] if start is None else arguments.integer("start", start, 0)
    last = recording.spike_range[1] if stop is None else arguments.integer("stop", stop, 0)
    fired = recording.fired.between(first, last)
    if fired.stop <= fired.first:
        low, high = recording.spike_range
        raise RecordingError(
            f"there is nothing to measure from {first} to before {last}: there are spikes of {low} to {high - 1}"
        )
    place = np.full(len(recording.neurons), -1, dtype=np.int64)
    place[[index[name] for name in names]] = np.arange(len(names))
    places = place[fired.neurons]
    own = places >= 0
    fired = fired._replace(steps=fired.steps[own], neurons=fired.neurons[own])
    return _Trains(fired, places[own], names, _groups(recording, names), recording.dt)


def _groups(recording: Recording, names: Sequence[str]) -> Mapping[str, IntArray]:
    """The groups that are whole among some neurons, as places among these; any other neuron is one by itself."""
    group_of, there = dict[str, str](), set(names)
    for name, (members, _) in recording.views.items():
        called = [recording.neurons[member] for member in members]
        if there.issuperset(called) and (name in recording.named or are_numbered(name, called)):
            group_of.update(dict.fromkeys(called, name))
    found: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        found.setdefault(group_of.get(name, name), []).append(place)
    return {name: np.array(places, dtype=np.int64) for name, places in found.items()}


def _cuts(first: int, stop: int, count: int) -> IntArray:
    """Steps cut into so many parts, or as many as there are steps."""
    cuts: IntArray = np.unique(np.linspace(first, stop, min(count, stop - first) + 1).astype(np.int64))
    return cuts


def _count(value: object, name: str = "bins") -> int:
    return arguments.integer(name, value, 1)


def _positive(name: str, value: object, most: float) -> float:
    """A number above 0; what is beyond ``most`` is that."""
    number = arguments.number(name, value)
    if not number > 0:
        raise ValueError(f"'{name}' is above 0, not {number:g}")
    return min(number, most)


def _steps(edges: IntArray) -> Axis:
    return Axis("step", tuple(str(edge) for edge in edges[:-1].tolist()))
