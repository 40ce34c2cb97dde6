"""Which messages count: the label, the length and the prelude of arrays; what cannot be used is rejected, and why.

In: bytes of a message from anybody. Out: Accepted, with its numbers, its sequence number and its time; or why it is
rejected. A Stream does so for one topic, and counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.language.ros_types import plain
from neurovis_spec.ros.middleware import Arrival
from neurovis_spec.ros.publishers import OnePublisher
from neurovis_spec.ros.summary import REASONS, Counts, Reason, Teller
from neurovis_spec.runtime.wire import Encoding, WireError, array_of, label_of, stamp_of, text_of

ARRAY: Final = "std_msgs/Float64MultiArray"
STRING: Final = "std_msgs/String"
_LIMIT: Final = 1 << 64
_NOTHING: Final = np.zeros(0)
#: messages of a topic that wait at most
_MOST_HELD: Final = 10_000


@dataclass(frozen=True, slots=True, eq=False)
class Accepted:
    """A message that counts. ``seq`` is its sequence number, ``stamp`` its own time in nanoseconds since 1970, where it
    has them; ``numbers`` those of an array, without its prelude, ``text`` that of a text."""

    seq: int | None = None
    stamp: int | None = None
    numbers: FloatArray = field(default_factory=lambda: _NOTHING)
    text: str = ""
    labelled: bool = True
    finite: bool = True


#: What reads the bytes of a message: it gives why not where they do not count, or raises WireError.
Judge: TypeAlias = Callable[[bytes, Encoding], Accepted | Reason]


def arrays(hash_: str, size: int) -> Judge:
    """Arrays of a network: so many numbers, under its label or none."""
    label = label_of(hash_).encode()

    def judge(data: bytes, encoding: Encoding) -> Accepted | Reason:
        found = array_of(data, encoding)
        if found.offset not in (0, 2):
            return "parse"
        if found.label not in (label, b""):
            return "hash"
        if len(found.data) != found.offset + size:
            return "length"
        numbers = found.data[found.offset :]
        seq, stamp = _prelude(found.data) if found.offset else (None, None)
        return Accepted(seq, stamp, numbers, "", bool(found.label), bool(np.isfinite(numbers).all()))

    return judge


def _prelude(data: FloatArray) -> tuple[int | None, int | None]:
    """The sequence number and the time of an array; what cannot be one counts as none."""
    seq, seconds = float(data[0]), float(data[1])
    nanoseconds = seconds * 1e9
    return (
        int(seq) if math.isfinite(seq) and 0 <= seq < _LIMIT else None,
        round(nanoseconds) if math.isfinite(nanoseconds) and 0 <= nanoseconds < _LIMIT else None,
    )


def texts(data: bytes, encoding: Encoding) -> Accepted | Reason:
    """Texts, whatever they say."""
    return Accepted(text=text_of(data, encoding))


def anything(data: bytes, encoding: Encoding) -> Accepted | Reason:
    """Messages of a type that is not looked into."""
    return Accepted()


def headed(data: bytes, encoding: Encoding) -> Accepted | Reason:
    """Messages of a type that begins with a ``Header``."""
    return Accepted(stamp=stamp_of(data, encoding))


#: A message as it came, and what of it is accepted.
Taken: TypeAlias = tuple[Arrival, Accepted]


@dataclass(eq=False)
class Stream:
    """The messages of one topic. ``name`` is what the summary calls it."""

    name: str
    topic: str
    type: str
    encoding: Encoding
    judge: Judge
    #: of a network's topics: which publisher is heard
    publishers: OnePublisher | None = None
    counts: Counts = field(default_factory=Counts)
    _last: int | None = None
    #: messages that have gone missing here since the last that was accepted
    _missed: int = 0
    #: those of a publisher of which it is not sure yet whether it is the one that is heard
    _held: list[Taken] = field(default_factory=list)

    def take(self, arrival: Arrival, teller: Teller) -> Sequence[Taken]:
        """Count a message; gives those that are accepted by now: none where it is rejected or has to wait, and before
        it those that have waited."""
        self.counts.received += 1
        found = self._judged(arrival)
        if not isinstance(found, Accepted):
            return self._reject(found, 1, teller)
        whose = "same" if self.publishers is None else self.publishers.whose(self.topic, arrival)
        if whose == "unsure" and len(self._held) < _MOST_HELD:
            self._held.append((arrival, found))
            return ()
        if whose in ("other", "unsure"):
            return self._reject("publisher", 1, teller)
        if whose == "same":
            self._reject("publisher", len(self._held), teller)
            self._held = []
        else:
            self.anew()
        self._held.append((arrival, found))
        return self._accepted(teller)

    def _accepted(self, teller: Teller) -> Sequence[Taken]:
        """Those that have waited."""
        taken, self._held = self._held, []
        for _, found in taken:
            self._follow(found.seq, teller)
            self.counts.unlabelled += not found.labelled
            self.counts.not_finite += not found.finite
        return taken

    def _reject(self, reason: Reason, count: int, teller: Teller) -> Sequence[Taken]:
        if count:
            self.counts.rejected[reason] += count
            teller.note(f"{REASONS[reason]} on {self.topic}", count)
        return ()

    def _judged(self, arrival: Arrival) -> Accepted | Reason:
        if arrival.type and plain(arrival.type) != self.type:
            return "type"
        try:
            return self.judge(arrival.data, self.encoding)
        except WireError:
            return "parse"

    def _follow(self, seq: int | None, teller: Teller) -> None:
        gap = 0 if seq is None or self._last is None or seq <= self._last else seq - self._last - 1
        self._last = seq if seq is not None else self._last
        missed, self._missed = self._missed, 0
        self.lose(max(gap, missed), teller)

    def miss(self, count: int) -> None:
        """So many messages could not be kept until it was their turn; where they are numbered, the gap says so."""
        self._missed += count

    def anew(self) -> None:
        """The publisher is another from here on, or a connection was made anew: that is no loss."""
        self._last = None

    def end(self, teller: Teller) -> Sequence[Taken]:
        """No more messages come; gives those that have waited, if nothing came since of the publisher that was heard
        before."""
        missed, self._missed = self._missed, 0
        self.lose(missed, teller)
        if self._held and self.publishers is not None and self.publishers.may_follow(self._held[0][0]):
            self.anew()
            return self._accepted(teller)
        self._reject("publisher", len(self._held), teller)
        self._held = []
        return ()

    def lose(self, count: int, teller: Teller) -> None:
        """So many messages are lost."""
        if count:
            self.counts.lost += count
            teller.note(f"lost on {self.topic}", count)


def time_of(accepted: Accepted, arrival: Arrival) -> int:
    """The time of a message, in nanoseconds: its own, else that at which it was sent, else received."""
    for time in (accepted.stamp, arrival.sent):
        if time is not None:
            return time
    return arrival.received
