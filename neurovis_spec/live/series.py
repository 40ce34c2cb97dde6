"""Series: a number a step that follows from what is known of the steps until then: an error, what an episode has
brought, a measure that somebody has typed.

In: activities and quantities (``runtime/quantities.py``, and behind them ``beside.py``) of steps in their order. Out:
the number of each step, NaN where there is none yet. A Series says what it is; its Follower goes from step to step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, Protocol, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.beside import Beside
from neurovis_spec.runtime.measures import Measure, Meter, over
from neurovis_spec.runtime.quantities import Quantities
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.state import Conditions, initial_state


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """What is known of some steps in their order: which they are (rows,), the activities (rows, n), or the states that
    neurons show, and the quantities that a series reads (rows, columns), NaN where they are not known."""

    step: IntArray
    activity: FloatArray
    quantities: FloatArray


class Follower(Protocol):
    """A series by now."""

    def rows(self, steps: Steps) -> FloatArray:
        """The number of each of the next steps, (rows,)."""
        ...

    def copy(self) -> Follower:
        """The same, which goes on by itself."""
        ...


class Series(Protocol):
    """What a number follows from."""

    @property
    def reads(self) -> IntArray:
        """The quantities that it reads."""
        ...

    @property
    def back(self) -> int | None:
        """How many steps it looks back, None for all."""
        ...

    def begin(self, first: int) -> Follower:
        """At a step, of the steps before which nothing is known."""
        ...

    def recorded(self, recording: Recording, steps: Steps) -> FloatArray:
        """The number of each step of a recording, (rows,). Raises SpecError, BodyError, RecordingError."""
        ...


# --- a reward, or a way, an episode

#: What is taken of an episode: the last number, the sum, or how far a place is from where it was.
Taken: TypeAlias = Literal["last", "sum", "way"]


@dataclass(frozen=True, slots=True, eq=False)
class Episodes:
    """Of each episode one number, from its last step on: of an activity, of a quantity (``reads[1:]``, of which the
    first is 1 at an episode's end), or how far x and y have come. An episode ends every ``length`` steps, too."""

    reads: IntArray
    taken: Taken
    length: int | None = None
    #: whose activity is taken; None where a quantity is
    neuron: int | None = None
    back: None = None

    def begin(self, first: int) -> _Episode:
        """Before the end of an episode it is not known when that began, but at the beginning of a run."""
        return _Episode(self, known=first == 0)

    def recorded(self, recording: Recording, steps: Steps) -> FloatArray:
        """The number of each step of a recording."""
        return self.begin(int(recording.step[0]) if len(recording) else 0).rows(steps)


@dataclass(slots=True, eq=False)
class _Episode:
    """The last number, what the episode that goes on has come to, and whether that is known from its beginning."""

    of: Episodes
    known: bool
    value: float = math.nan
    total: float = 0.0
    start: tuple[float, float] | None = None

    def copy(self) -> _Episode:
        return replace(self)

    def rows(self, steps: Steps) -> FloatArray:
        of, result = self.of, np.empty(len(steps.step))
        told = steps.quantities[:, 0] > 0
        ended = told if of.length is None else told | ((steps.step + 1) % of.length == 0)
        taken = steps.quantities[:, 1:] if of.neuron is None else steps.activity[:, [of.neuron]]
        for row, (end, numbers) in enumerate(zip(ended.tolist(), taken.tolist(), strict=True)):
            if of.taken == "way":
                self.start = self.start or (numbers[0], numbers[1])
                now = math.hypot(numbers[0] - self.start[0], numbers[1] - self.start[1])
            else:
                now = self.total = numbers[0] + (self.total if of.taken == "sum" else 0.0)
            if end:
                self.value = now if self.known or of.taken == "last" else math.nan
                self.known, self.total, self.start = True, 0.0, None
            result[row] = self.value
        return result


# --- a measure


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """A measure of the language."""

    measure: Measure
    network: Network
    reads: IntArray
    #: of what it reads so many are its states and sensors; the parameters behind them, the lesioned neurons, and which
    #: these are
    states: int
    slots: IntArray
    lesioned: IntArray
    back: int | None

    def begin(self, first: int) -> _Metered:
        """The meter before a step."""
        meter = Meter(self.measure, first)
        return _Metered(self, meter, initial_state(self.network).conditions, first == 0 or self.back is not None)

    def recorded(self, recording: Recording, steps: Steps) -> FloatArray:
        """What it is after each step of a recording."""
        return over(self.measure.text, self.network, recording)


def measured(measure: Measure, network: Network) -> Measured:
    """The series of a measure."""
    every = Quantities(network)
    beside = Beside(network, len(every))
    index = {name: place for place, name in enumerate(every.names)} if measure.probe.names else {}
    sensors = dict(zip(beside.sensor_names, beside.places("sensors").tolist(), strict=True))
    states = [*(index[name] for name in measure.probe.names), *(sensors[name] for name in measure.sensors)]
    slots = np.array(sorted(set(measure.slots.values())), np.int64)
    lesioned = np.unique(np.concatenate([np.zeros(0, np.int64), *(others for _, others, _ in measure.spikes.values())]))
    reads = np.concatenate([np.array(states, np.int64), beside.places("parameters")[slots], beside.lesioned(lesioned)])
    whole = any(window.last is None for window in measure.formula.windows)
    return Measured(measure, network, reads, len(states), slots, lesioned, None if whole else measure.longest)


@dataclass(slots=True, eq=False)
class _Metered:
    """A meter, and what holds for the steps that it is given; ``known``: whether all is known that it looks back to."""

    of: Measured
    meter: Meter
    conditions: Conditions
    known: bool

    def copy(self) -> _Metered:
        return _Metered(self.of, self.meter.copy(), self.conditions, self.known)

    def rows(self, steps: Steps) -> FloatArray:
        of = self.of
        held = steps.quantities[:, of.states :]
        edges = np.flatnonzero((held[1:] != held[:-1]).any(axis=1) & ~np.isnan(held[1:]).any(axis=1)) + 1
        parts = [np.zeros(0)]
        for begin, end in zip([0, *edges.tolist()], [*edges.tolist(), len(held)], strict=True):
            if begin < end:
                conditions = self._conditions(held[begin])
                rows = slice(begin, end)
                values = self.meter.rows(steps.activity[rows], conditions, steps.quantities[rows, : of.states])
                parts.append(values)
        values = np.concatenate(parts)
        return values if self.known else np.full(len(values), np.nan)

    def _conditions(self, held: FloatArray) -> Conditions:
        """What held in a step: its parameters and lesions, those that the spec gives where they are not known."""
        of, now = self.of, self.conditions
        if not len(held) or np.isnan(held).any():
            return now
        parameters, lesioned = now.parameters.copy(), now.lesioned_neurons.copy()
        parameters[of.slots] = held[: len(of.slots)]
        lesioned[of.lesioned] = held[len(of.slots) :] > 0
        return replace(now, parameters=parameters, lesioned_neurons=lesioned)


# --- what a spec has


def episodes(network: Network) -> Mapping[str, Episodes]:
    """What each episode brings, by what it is called: the reward of rules that learn from one, where there is none the
    way of a body; none without episodes."""
    by_body = network.body is not None and network.body.each_episode
    if network.episode is None and not by_body:
        return {}
    beside = Beside(network, len(Quantities(network)))
    ended = beside.places("ended")
    n, inputs = len(network.neurons), beside.places("inputs")
    behind = n + network.outlet_count
    for projection in network.projections:
        rewards = np.unique(projection.signals.get("reward", np.zeros(0, np.int64)))
        if len(rewards) != 1 or n <= rewards[0] < behind:
            continue
        (reward,) = rewards.tolist()
        # a rule that learns step by step is rewarded step by step: what counts is all of it
        taken: Taken = "last" if projection.uses[0].definition.given.each_episode is not None else "sum"
        if reward < n:
            return {f"{network.neurons.names[reward]} an episode": Episodes(ended, taken, network.episode, reward)}
        reads = np.concatenate([ended, inputs[[reward - behind]]])
        return {f"{beside.input_names[reward - behind]} an episode": Episodes(reads, taken, network.episode)}
    if network.body is None:
        return {}
    return {"way an episode": Episodes(np.concatenate([ended, beside.places("place")]), "way", network.episode)}
