"""The settings of a ROS node: from which topics inputs come and to which outputs go.

In: nothing; these are values of a Network, which ``compiler.ros`` makes. Nothing of them changes what the network does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from neurovis_spec.language.words import MOST_NAMED, Durability, OnTimeout, Reliability

NAMESPACE: Final = "/neurovis"

#: The most messages that may wait to be sent: a longer queue is a mistake.
MOST_WAITING = 1_000_000


@dataclass(frozen=True, slots=True)
class Subscription:
    """An input that comes from a topic."""

    input: str
    topic: str
    #: of the messages, ``package/Name``
    type: str
    #: the dotted path to the numbers in a message
    field: str = "data"
    #: the joints to take of a message that names its joints, in this order; empty: all numbers
    names: tuple[str, ...] = ()
    #: seconds after the last message until the input is as ``on_timeout`` says; None: never
    timeout: float | None = None
    on_timeout: OnTimeout = "zero"


@dataclass(frozen=True, slots=True)
class Publication:
    """An output that goes to a topic."""

    output: str
    topic: str
    #: of the messages, ``package/Name``
    type: str
    #: the dotted path to the numbers in a message
    field: str = "data"
    #: what is sent when the run ends or stops; None: nothing
    safe: float | None = None


@dataclass(frozen=True, slots=True)
class RosSettings:
    """The ``ros`` section, references resolved."""

    #: steps a second
    rate: float = 1.0
    #: absolute
    namespace: str = NAMESPACE
    reliability: Reliability = "reliable"
    durability: Durability = "volatile"
    #: how many messages wait to be sent; None: as the rate asks for (``depth_at``)
    depth: int | None = None
    subscribe: tuple[Subscription, ...] = ()
    publish: tuple[Publication, ...] = ()
    #: the neurons whose activities are published by name; None: all, where these are few (``by_name``)
    values: tuple[int, ...] | None = None

    def depth_at(self, rate: float) -> int:
        """How many messages wait to be sent at so many steps a second: what the spec says, else those of two seconds,
        so that a recorder that does not get its turn for so long misses nothing; 10 at least, ROS's own default."""
        return max(10, math.ceil(min(2 * rate, MOST_WAITING))) if self.depth is None else self.depth


def by_name(values: Sequence[int] | None, neurons: int) -> Sequence[int]:
    """Which of so many neurons are published by name: those that the spec says, else all where they are few: a number
    as a text takes more than twice the bytes of one in an array, and some 0.2 µs."""
    if values is not None:
        return values
    return range(neurons) if neurons <= MOST_NAMED else ()


def absolute(topic: str, node: str) -> str:
    """A topic's whole name, seen from a node, whose own whole name is ``node``.

    >>> absolute("/a", "/ns/net"), absolute("a/b", "/ns/net"), absolute("~/a", "/ns/net")
    ('/a', '/ns/a/b', '/ns/net/a')
    """
    if topic.startswith("/"):
        return topic
    if topic.startswith("~"):
        return f"{node}/{topic[1:].lstrip('/')}"
    return f"{node.rpartition('/')[0]}/{topic}"
