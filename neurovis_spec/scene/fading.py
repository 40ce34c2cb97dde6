"""Traces for the eye: what was active fades, so that a spike of one step can be seen.

In: a network, whose spec may say how long; a recording, or a run step by step. Out: what a picture of a step shows in
place of the activity: of the activities up to now, each faded by the time since, the one that is furthest from 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.units import TIMES
from neurovis_spec.runtime.recording import Recording, Snapshot
from neurovis_spec.scene.ends import SetEnds
from neurovis_spec.scene.film_size import frames_a_second
from neurovis_spec.scene.shown_states import ShownStates
from neurovis_spec.scene.signals import Signals

#: Seconds of a film in which the trace of a spike fades to 1/e, where the spec does not say; and the least steps.
_SECONDS, _STEPS = 0.2, 2.0
#: A trace that is fainter than this share cannot be told from nothing, nor can two pictures that differ by it.
_FAINTEST = 1e-5
#: Rows that are evaluated at a time.
_CHUNK = 256


def seconds_of(network: Network) -> FloatArray:
    """The time in which the activity of each neuron fades to 1/e in a picture, 0 for those that have no trace (n,).

    Without a word of the spec those that spike have one.
    """
    usual = _usual(network)
    result = np.zeros(len(network.neurons))
    for group in network.neurons.groups:
        if group.spikes:
            result[group.start : group.start + group.count] = usual
    for stated in network.render.traces:
        result[list(stated.members)] = stated.seconds
    return result


def sent_seconds_of(network: Network) -> FloatArray:
    """The same of what connections take beside activities, and of what their synapses form (``Signals``), (k,): of
    spikes, and of what is made of one."""
    signals = Signals(network)
    return np.where(signals.spikes, _usual(network), 0.0) if signals else np.zeros(0)


def told_times(network: Network, seconds: FloatArray) -> FloatArray:
    """Times in the unit in which people are told: that in which the spec writes ``time.dt``, ``network.dt_unit``."""
    return seconds / float(TIMES[network.dt_unit])


def _usual(network: Network) -> float:
    """The time where the spec does not say it."""
    return network.dt * max(_STEPS, _SECONDS * frames_a_second(network))


class Fading:
    """Follows the activities of a run, and what else its connections send, forward, and knows what a picture shows of
    them: ``sent`` is that of what is sent, None where nothing of it fades."""

    def __init__(self, network: Network) -> None:
        seconds, sent = seconds_of(network), sent_seconds_of(network)
        self._count, self.sends = len(seconds), bool(sent.any())
        self.sent: FloatArray | None = None
        if self.sends:
            seconds = np.concatenate([seconds, sent])
        has = seconds > 0
        #: the share of an activity that is left after a step, by neuron
        self._left = np.zeros(len(seconds))
        self._left[has] = np.exp(-network.dt / seconds[has])
        self._any = bool(has.any())
        self._step, self._shown = 0, np.zeros(0)

    def __bool__(self) -> bool:
        """Whether a neuron has a trace."""
        return self._any

    @property
    def reach(self) -> float:
        """For how many steps a trace can be told from nothing."""
        longest = float(self._left.max(initial=0.0))
        return math.log(_FAINTEST) / math.log(longest) if 0 < longest < 1 else longest * math.inf

    def follow(self, steps: IntArray, rows: FloatArray, sent: FloatArray | None = None) -> FloatArray:
        """Take the activities ``rows`` (steps, n) of the next steps, and what was ``sent`` beside them (steps, k), None
        where that is not known or nothing of it fades; gives what a picture shows of activities at the last of them."""
        if self.sends:
            unknown = np.full((len(rows), len(self._left) - self._count), np.nan)
            rows = np.concatenate([rows, unknown if sent is None else sent], axis=1)
        for first in range(0, len(steps), _CHUNK):
            some, now = rows[first : first + _CHUNK], steps[first : first + _CHUNK]
            if len(self._shown):
                some, now = np.vstack([self._shown, some]), np.concatenate([[self._step], now])
            with np.errstate(invalid="ignore", under="ignore"):
                faded = (some * self._left ** (now[-1] - now)[:, None])[::-1]  # what is no number is as nothing
            furthest = np.nan_to_num(np.abs(faded), nan=0.0).argmax(axis=0)  # of equal ones the latest
            self._step, self._shown = int(now[-1]), faded[furthest, np.arange(faded.shape[1])]
        self.sent = self._shown[self._count :] if self.sends else None
        return self._shown[: self._count]


def snapshots_of(network: Network, recording: Recording, steps: Iterable[int]) -> Iterator[Snapshot]:
    """The snapshots of ascending steps of a recording, with the states that are shown and sent, and the traces of what
    was before. Raises RecordingError."""
    fading, states, done = Fading(network), ShownStates(network), 0
    columns, sending = states.columns(recording), Signals(network).recorded(recording)
    ends = SetEnds(network).by_events()
    for step in steps:
        snapshot = recording.snapshot(step)
        if states:
            now = states.put(snapshot.activity, recording.states[recording.row(step), columns])
            snapshot = replace(snapshot, shown=now)
        if sending is not None and not fading.sends:
            row = recording.row(step)
            (sent,) = sending.rows(slice(row, row + 1))
            snapshot = replace(snapshot, sent=sent)
        if ends is not None:
            snapshot = replace(snapshot, ends=ends.at(step, snapshot.weights))
        if fading:
            row = recording.row(step)
            done = max(done, int(np.searchsorted(recording.step, step - fading.reach)))
            rows = slice(done, row + 1)
            beside = None if sending is None or not fading.sends else sending.rows(rows)
            seen = fading.follow(recording.step[rows], recording.activity[rows], beside)
            snapshot, done = replace(snapshot, seen=seen), row + 1
            if beside is not None:
                snapshot = replace(snapshot, sent=fading.sent)
        yield snapshot
