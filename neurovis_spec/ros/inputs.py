"""Inputs from topics: the latest message of each is the input of a step, as long as it is not too old.

In: messages, by a thread of the middleware. Out: for each step the values of inputs, and which of them have fallen
silent. A message that cannot be used is counted, and the one before it stays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from threading import Lock

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.ros_settings import Subscription as Settings
from neurovis_spec.likeness import nearest
from neurovis_spec.ros.definitions import Definition
from neurovis_spec.ros.fields import numbers_at, texts_at
from neurovis_spec.ros.middleware import Arrival, Arrived
from neurovis_spec.ros.summary import REASONS, Counts, Reason, Teller
from neurovis_spec.runtime.wire import Encoding, WireError

#: names of a message that are listed, and characters of each
_LISTED, _LONGEST = 12, 40


@dataclass(slots=True)
class _Silence:
    """Whether an input is silent, and what there is to tell of that; of one that ends the run the end tells."""

    settings: Settings
    silent: bool = False
    _falls: int = 0
    _told: tuple[int, bool] = 0, False

    def follow(self, silent: bool) -> None:
        """Whether it is silent at a step."""
        self._falls += silent and not self.silent
        self.silent = silent

    def news(self) -> str | None:
        """What there is to tell since this was asked last."""
        one, (before, was_silent) = self.settings, self._told
        self._told = falls, silent = self._falls, self.silent
        again = f"the input '{one.input}' is heard again"
        if one.on_timeout == "stop" or falls == before:
            return again if was_silent and not silent else None
        often = f" ({falls - before} times)" if falls - before > 1 else ""
        fallen = f"the input '{one.input}' has fallen silent{often}: no message on {one.topic} for {one.timeout:g} s"
        return fallen if silent else f"{fallen}; {again}"


class _Reading:
    """One input: what of a message it takes, and what it was last."""

    def __init__(
        self, settings: Settings, size: int, definition: Definition, encoding: Encoding, teller: Teller
    ) -> None:
        self.settings, self.size, self.silence, self._teller = settings, size, _Silence(settings), teller
        self._numbers = numbers_at(definition, settings.field, encoding)
        self._names = texts_at(definition, "name", encoding) if settings.names else None
        #: the last message's values, and when it came; one value, so that no step sees half of it
        self.last: tuple[FloatArray, float] | None = None
        #: names that are picked and did not come, of which it was told
        self._missed = set[str]()

    def values(self, data: bytes) -> FloatArray | Reason:
        """The values of a message, or why it has none. Raises WireError."""
        numbers = np.array(self._numbers(data), dtype=np.float64)
        if self._names is not None:
            names = list(self._names(data))
            if len(names) != len(numbers):
                return "length"
            if missing := [name for name in self.settings.names if name not in names]:
                self._miss(missing[0], names)
                return "names"
            return numbers[[names.index(name) for name in self.settings.names]]
        return numbers if len(numbers) == self.size else "length"

    def _miss(self, name: str, names: Sequence[str]) -> None:
        """Tell, once of each, of a name that a message lacks, and of those that it has, the nearest first."""
        if name in self._missed:
            return
        self._missed.add(name)
        came = [one[:_LONGEST] for one in names[: 10 * _LISTED]]
        near = nearest(name, came)
        listed = [*near, *(one for one in came if one not in near)]
        more = ", …" if len(names) > _LISTED else ""
        said = ", ".join(map(repr, listed[:_LISTED])) + more if names else "none"
        where = f"the input '{self.settings.input}': there is no '{name}' in a message on {self.settings.topic}"
        self._teller.say(f"{where}; its names are {said}")


def _ignore(arrival: Arrival) -> None:
    """Nobody else wants it."""


@dataclass(eq=False)
class InputTopic:
    """A topic that inputs come from; ``clock`` gives the seconds by which messages grow old."""

    topic: str
    type: str
    readings: Sequence[_Reading]
    clock: Callable[[], float]
    teller: Teller
    counts: Counts = field(default_factory=Counts)
    #: called with each message that is not rejected
    heard: Arrived = _ignore
    _lock: Lock = field(default_factory=Lock)
    _over: bool = False

    def end(self) -> None:
        """Take no more messages."""
        with self._lock:
            self._over = True

    def take(self, arrival: Arrival) -> None:
        """A message."""
        with self._lock:
            if not self._over:
                self._take(arrival)

    def _take(self, arrival: Arrival) -> None:
        self.counts.received += 1
        if arrival.type not in (self.type, "*", ""):
            self._reject("type")
            return
        try:
            found = [reading.values(arrival.data) for reading in self.readings]
        except WireError:
            self._reject("parse")
            return
        now = self.clock()
        reasons = [one for one in found if isinstance(one, str)]
        values = [(reading, one) for reading, one in zip(self.readings, found, strict=True) if not isinstance(one, str)]
        if reasons:
            self._reject(reasons[0])
        else:
            self.heard(arrival)
        if any(not np.isfinite(one).all() for _, one in values):
            self.counts.not_finite += 1
            self.teller.note(f"not finite on {self.topic}")
        for reading, one in values:
            if np.isfinite(one).all():
                reading.last = one, now

    def _reject(self, reason: Reason) -> None:
        self.counts.rejected[reason] += 1
        self.teller.note(f"{REASONS[reason]} on {self.topic}")


@dataclass(frozen=True)
class Inputs:
    """All inputs that come from topics."""

    topics: tuple[InputTopic, ...]

    @classmethod
    def of(
        cls,
        settings: Iterable[Settings],
        sizes: Mapping[str, int],
        definitions: Mapping[str, Definition],
        encoding: Encoding,
        clock: Callable[[], float],
        teller: Teller,
    ) -> Inputs:
        """The inputs of a spec, whose topics are absolute; ``definitions`` by type. Raises WireError where a type has
        no such numbers."""
        found = dict[tuple[str, str], list[_Reading]]()
        for one in settings:
            reading = _Reading(one, sizes[one.input], definitions[one.type], encoding, teller)
            found.setdefault((one.topic, one.type), []).append(reading)
        return cls(tuple(InputTopic(*key, readings, clock, teller) for key, readings in found.items()))

    def values(self, now: float) -> dict[str, float | FloatArray]:
        """The inputs of a step; 0 before the first message."""
        result = dict[str, float | FloatArray]()
        for topic in self.topics:
            for reading in topic.readings:
                values, last = np.zeros(reading.size), reading.last
                if last is not None:
                    timeout = reading.settings.timeout
                    reading.silence.follow(timeout is not None and now - last[1] > timeout)
                    if not reading.silence.silent or reading.settings.on_timeout != "zero":
                        values = last[0]
                result[reading.settings.input] = float(values[0]) if reading.size == 1 else values
        return result

    def news(self) -> list[str]:
        """Which inputs have fallen silent, or are heard again, since this was asked last."""
        told = [one.silence.news() for topic in self.topics for one in topic.readings]
        return [line for line in told if line is not None]

    @property
    def silent(self) -> tuple[Settings, ...]:
        """The inputs of the last step that had fallen silent."""
        return tuple(one.settings for topic in self.topics for one in topic.readings if one.silence.silent)
