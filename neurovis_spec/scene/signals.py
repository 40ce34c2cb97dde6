"""Signals: what each connection sends, which colours its line (Eq. 3).

In: a network; a step of a run, or rows of a recording. Out: what is sent along each connection. Connections that take
a state or an output of their source (``send``), and those whose signal is formed at a synapse, need more than
activities and weights tell: a Snapshot has it as ``sent``, a recording among its states.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from neurovis_spec.arguments import callers_level
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.flows import reads
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import SYNAPSE
from neurovis_spec.diagnostics import listed
from neurovis_spec.runtime.columns import Probe, probe_of
from neurovis_spec.runtime.stages import taken_by

if TYPE_CHECKING:
    from neurovis_spec.runtime.recording import Recording, Snapshot
    from neurovis_spec.runtime.simulation import Simulation

Mask = npt.NDArray[np.bool_]

#: Rows of a recording that are looked at together.
_CHUNK = 64


class Signal(NamedTuple):
    """What each connection brings, (…, m): ``weight`` times what it takes of its source, ``sent``; of a synapse the
    signal that it forms, with a weight of 1."""

    sent: FloatArray
    weight: FloatArray

    @property
    def value(self) -> FloatArray:
        """The product."""
        return self.sent * self.weight


class Lesion(NamedTuple):
    """An event: from step ``at`` on neurons are mended, and others lesioned. Masks (k,) of what they send."""

    at: int
    mended: Mask
    lesioned: Mask


@dataclass(frozen=True, eq=False)
class RecordedSent:
    """What is sent beside activities by the rows of a recording: states and signals (k,) in these columns, but 0 by
    neurons that are lesioned, whose states go on; those that were lesioned by hand from a row on (k,)."""

    recording: Recording
    columns: IntArray
    lesions: Sequence[Lesion]
    by_hand: IntArray

    def rows(self, rows: slice) -> FloatArray:
        """Of some rows (rows, k)."""
        states, step = self.recording.states[rows][:, self.columns], self.recording.step[rows]
        silent = np.arange(*rows.indices(len(self.recording)))[:, None] >= self.by_hand
        for at, mended, lesioned in self.lesions:
            after = step >= at
            silent[np.ix_(after, mended)] = False
            silent[np.ix_(after, lesioned)] = True
        return np.where(silent, 0.0, states)


@dataclass(frozen=True, eq=False)
class Signals:
    """The signals of a network of n neurons and m connections, which are known by k numbers beside activities."""

    network: Network

    def __bool__(self) -> bool:
        """Whether a connection takes anything beside activities, or has a synapse."""
        return len(self.network.sent) > 0

    @property
    def called(self) -> str:
        """What a legend calls signals: ``w·a`` where connections take the activity, ``w·v`` where all take the one
        state or output v; of synapses it says nothing more."""
        names = {one.state for one in self.network.sent if len(one.neurons)}
        synapses = len(self.network.joined)
        if not synapses and not names:
            return "w·a"
        if synapses == len(self.network.connections):
            return ""
        alone = len(names) == 1 and bool((self._sources >= len(self.network.neurons)).all())
        plain = f"w·{names.pop() if alone else 'what is sent' if names else 'a'}"
        return f"{plain}, or of a synapse" if synapses else plain

    @cached_property
    def spikes(self) -> Mask:
        """Which of the k numbers are spikes, or signals that synapses form of a spike: they last for one step."""
        are = self.network.spikes
        found = are[len(self.network.neurons) + self.network.taken]
        read = np.zeros(len(self.network.connections), np.bool_)
        sent = taken_by(self.network)
        for projection in self.network.projections:
            if projection.kind == SYNAPSE:
                definition = projection.use.definition
                for name in reads(definition, [definition.given.each_step]):
                    ends = sent[projection.members] if name == "pre" else projection.ends.get(name)
                    if ends is not None:
                        read[projection.members] |= are[ends]
        return np.concatenate([found, read[self.network.joined]])

    @cached_property
    def _probe(self) -> Probe:
        """What reads the k numbers in a run."""
        return probe_of(self.network, self.network.sent)

    @cached_property
    def _neurons(self) -> IntArray:
        """The neurons (k,) whose states these are, −1 for the signals of synapses, which are 0 where an end is
        lesioned."""
        of_synapses = np.full(len(self.network.joined), -1, np.int64)
        return np.concatenate([np.zeros(0, np.int64), *(one.neurons for one in self.network.sent), of_synapses])

    @cached_property
    def _sources(self) -> IntArray:
        """Where what each connection takes, or its synapse forms (m,), stands among n activities and k further
        numbers."""
        sending, n, taken = self.network.sending, len(self.network.neurons), self.network.taken
        result = self.network.connections.sources.whole()
        if sending is not None:
            result = np.where(sending < n, sending, n + np.searchsorted(taken, sending - n))
        joined = self.network.joined
        if len(joined):
            result = result.copy()
            result[joined] = n + len(taken) + np.arange(len(joined))
        return result

    def _of(self, activity: FloatArray, sent: FloatArray | None, weights: FloatArray) -> Signal:
        """Signals by activities (…, n), what is sent beside them (…, k), and weights (…, m)."""
        if self:
            joined = self.network.joined
            if sent is None:
                sent = np.full((*activity.shape[:-1], len(self._neurons)), np.nan)
            activity = np.concatenate([activity, sent], axis=-1)
            if len(joined):
                weights = weights.copy()
                weights[..., joined] = 1.0
        return Signal(activity[..., self._sources], weights)

    def at(self, snapshot: Snapshot) -> Signal:
        """The signals (m,) of a step, of what a picture shows of activities; NaN where they are not known."""
        seen = snapshot.activity if snapshot.seen is None else snapshot.seen
        return self._of(seen, snapshot.sent, snapshot.weights)

    def follow(self, run: Simulation) -> None:
        """Have a run form what a picture of its steps needs (``of_run``)."""
        if len(self.network.joined):
            run.follow_signals()

    def of_run(self, run: Simulation) -> FloatArray | None:
        """``Snapshot.sent`` of the last step of a run that is followed."""
        if not self:
            return None
        taken, formed, joined = run.outlets[self.network.taken], run.signals, self.network.joined
        return np.concatenate([taken, np.full(len(joined), np.nan) if formed is None else formed[joined]])

    def recorded(self, recording: Recording) -> RecordedSent | None:
        """What a recording holds of what is sent beside activities. None where that is nothing, and where it lacks some
        of it, of which it warns (RuntimeWarning): the lines have no colour then."""
        known = {name: column for column, name in enumerate(recording.state_names)}
        missing = [name for name in self._probe.names if name not in known] if self else []
        if missing:
            warnings.warn(
                f"the recording does not hold {listed(missing)}, which connections send: their lines have no colour",
                RuntimeWarning,
                stacklevel=callers_level(),
            )
        if missing or not self:
            return None
        columns = np.array([known[name] for name in self._probe.names], np.int64)
        return RecordedSent(recording, columns, self._lesions, self._by_hand(recording))

    @cached_property
    def _lesions(self) -> list[Lesion]:
        """What events do to the neurons that send more than activities."""
        found = (
            Lesion(
                change.at, *(np.isin(self._neurons, one) for one in (change.mended_neurons, change.lesioned_neurons))
            )
            for change in self.network.changes
        )
        return [one for one in found if one.lesioned.any() or one.mended.any()]

    def _by_hand(self, recording: Recording) -> IntArray:
        """The row from which on each of the k numbers is silent since its neuron was lesioned, and by no event: as far
        as a recording tells, behind the last one in which that was active."""
        result = np.full(len(self._neurons), len(recording), np.int64)
        lesioned = np.isin(self._neurons, recording.lesioned_neurons)
        for one in self._lesions:
            lesioned &= ~one.lesioned
        for place in np.flatnonzero(lesioned).tolist():
            active = np.flatnonzero(recording.activity[:, self._neurons[place]])
            result[place] = active[-1] + 1 if len(active) else 0
        return result

    def parts(self, recording: Recording) -> Iterator[FloatArray]:
        """The signals of all rows of a recording, some rows (rows, m) at a time."""
        recorded = self.recorded(recording)
        for first in range(0, max(len(recording), 1), _CHUNK):
            rows = slice(first, first + _CHUNK)
            sent = None if recorded is None else recorded.rows(rows)
            yield self._of(recording.activity[rows], sent, weights_of(recording, rows)).value


def weights_of(recording: Recording, rows: slice) -> FloatArray:
    """All weights of these rows of a recording (rows, m); without rows one, with the changing ones 0."""
    changing = recording.weights[rows]
    weights = np.zeros((max(len(changing), 1), len(recording.sources)))
    fixed = np.delete(np.arange(len(recording.sources)), recording.plastic)
    weights[:, fixed] = recording.weights_static
    if len(changing):
        weights[:, recording.plastic] = changing
    return weights
