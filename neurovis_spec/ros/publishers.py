"""Publishers told apart: of several that send on a network's topics one is heard, until it has ended.

In: messages, with what the middleware knows of who has sent them. Out: whether a message is of the publisher whose
turn it is: what two controllers send is never one run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from neurovis_spec.ros.middleware import Arrival, Origin, Tell

#: a publisher has fallen silent when nothing has come for so many nanoseconds, and for so many of its intervals
_SILENT, _INTERVALS = 1_000_000_000, 3
#: nanoseconds between two questions whether another one is still there
_AGAIN: Final = 100_000_000
#: what the names begin with of those of which nobody knows which publisher they are
_NAMELESS: Final = "#"
#: publishers that are kept in mind
_MOST: Final = 16

#: Whose a message is: of the publisher that is heard, of one that begins anew, of another one that sends at the same
#: time, or of another one of which that is not sure yet: it is when the one that is heard sends again, or does not.
Whose: TypeAlias = Literal["same", "anew", "other", "unsure"]


@dataclass(slots=True)
class _Heard:
    """Who is heard on a topic, when the last message came, and how long after the one before."""

    origin: Origin
    last: int
    interval: int = 0


class OnePublisher:
    """The one publisher of a network that is heard. Another one comes in its place when it has gone, or fallen silent;
    who that is goes to ``tell``."""

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self._topics: dict[str, _Heard] = {}
        self._who, self._asked = "", 0
        #: who may come in the place of the one that is heard, and who does not, for both have sent
        self._next: Origin | None = None
        self._beside: list[str] = []

    def whose(self, topic: str, arrival: Arrival) -> Whose:
        """Whose a message on a topic is."""
        origin, now = arrival.origin, arrival.received
        if origin is None:  # which nobody knows
            return "same"
        heard = self._topics.get(topic)
        if heard is not None and heard.origin.connection == origin.connection:
            heard.interval, heard.last = now - heard.last, now
            self._is_there(topic)
            return "same"
        if self._is_other(heard, origin):
            if not self._has_gone(origin, now):
                return self._whose_else(origin)
            self._begin(f"{topic}: another publisher goes on, {origin.name}".rstrip(", "))
        elif heard is not None:
            self._begin(f"{topic}: {origin.name} has begun anew")
        self._who = origin.who or self._who
        self._topics[topic] = _Heard(origin, now)
        return "anew"

    def _begin(self, news: str) -> None:
        self._topics.clear()
        self._next, self._beside = None, []
        self._tell(news)

    def _is_other(self, heard: _Heard | None, origin: Origin) -> bool:
        """Whether a message is of another one than is heard on its topic, or on the others. Where nobody knows who
        sends, each connection is another one."""
        if heard is not None and (not origin.who or not heard.origin.who):
            return True
        return bool(self._who and origin.who and self._who != origin.who)

    def _has_gone(self, origin: Origin, now: int) -> bool:
        """Whether the publisher that is heard has gone, or fallen silent, when another one sends."""
        last = max(one.last for one in self._topics.values())
        usual = max(one.interval for one in self._topics.values())
        if now - last > max(_SILENT, _INTERVALS * usual):
            return True
        if now - self._asked < _AGAIN:
            return False
        self._asked = now
        return origin.alone()

    def _whose_else(self, origin: Origin) -> Whose:
        """Whose a message of another one is while it is not known that the one that is heard has gone."""
        if _name(origin) in self._beside or (self._next is not None and _name(origin) != _name(self._next)):
            return "other"
        self._next = origin
        return "unsure"

    def may_follow(self, arrival: Arrival) -> bool:
        """Whether a message is of one that may come in the place of the one that is heard."""
        return self._next is not None and arrival.origin is not None and _name(arrival.origin) == _name(self._next)

    def _is_there(self, topic: str) -> None:
        """The one that is heard has sent again: another one sends beside it, and does not come in its place."""
        if self._next is not None:
            name = f", {self._next.name}," if self._next.name else ""
            self._tell(f"{topic}: another publisher{name} sends at the same time: its messages are left out")
            self._beside = [*self._beside, _name(self._next)][-_MOST:]
            self._next = None


def _name(origin: Origin) -> str:
    """What tells a publisher from others."""
    return origin.who or origin.connection


@dataclass(slots=True, eq=False)
class _Row:
    """Messages whose numbers follow each other, and the publisher that has sent them."""

    publisher: str
    last: int


class Numbered:
    """Publishers of a topic told apart where the middleware does not say who has sent a message: by the numbers that
    each gives its own, which only grow, and by those that there are (``there``)."""

    def __init__(self, there: Callable[[], Sequence[str]]) -> None:
        self._there = there
        #: the one heard longest ago first
        self._rows: list[_Row] = []
        self._begun = 0

    def of(self, number: int) -> str:
        """Who has sent the message with a number: one of those that there are, or a name that is none of theirs."""
        following = [row for row in self._rows if row.last + 1 == number]
        row = following[0] if len(following) == 1 else self._found(number)
        row.last = number
        self._rows = [*(one for one in self._rows if one is not row), row][-_MOST:]
        return row.publisher

    def _found(self, number: int) -> _Row:
        """Whose the message is where it follows none, or several: of a publisher of which nothing came yet, or one of
        whose messages some are lost."""
        there = self._there()
        still = [row for row in self._rows if row.publisher in there or row.publisher.startswith(_NAMELESS)]
        still = still[max(0, len(still) - len(there)) :]  # of nameless ones those that were heard last
        if following := [row for row in still if row.last + 1 == number]:
            return following[0]
        before = [row for row in still if row.last < number]
        if before and len(still) == len(there):
            return max(before, key=lambda row: row.last)
        new = set(there) - {row.publisher for row in self._rows}
        self._begun += 1
        certain = len(new) == 1 and len(still) == len(there) - 1
        return _Row(new.pop() if certain else f"{_NAMELESS}{self._begun}", 0)
