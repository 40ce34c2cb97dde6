"""A recording is played: its messages go out on their topics, as they came.

In: a Bag, a Node. Out: each message at its distance from the first, divided by the speed; a recording of one ROS is
converted where the node is of the other.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from neurovis_spec.ros.accept import STRING
from neurovis_spec.ros.bags import Bag
from neurovis_spec.ros.convert import ConversionError, Converter
from neurovis_spec.ros.logs import Stored, Topic
from neurovis_spec.ros.middleware import Arrival, Node, Publisher, Quality, Tell
from neurovis_spec.ros.pace import NO_CLOCK, Clock, SimulatedClock, SteadyClock, clock_begins
from neurovis_spec.ros.summary import Counts, Teller
from neurovis_spec.runtime.wire import WireError, text_of

#: Called with what is sent; must not wait.
Sent = Callable[[str, Arrival], None]


@dataclass(frozen=True, slots=True)
class Playback:
    """How it is played: so many times as fast, again and again, beginning when each topic has a subscriber, at the
    latest after ``wait`` seconds, for so many ``seconds`` at most."""

    speed: float = 1.0
    loop: bool = False
    wait: float = 0.0
    seconds: float | None = None
    sim_time: bool = False


def is_spec(topic: Topic, bag: Bag) -> bool:
    """Whether a topic is that of a network's spec."""
    base, _, name = topic.name.rpartition("/")
    return name == "spec" and topic.type == STRING and any(one.name == f"{base}/activity" for one in bag.topics)


def spec_of(bag: Bag, network: str | None = None) -> tuple[str, str] | None:
    """The spec that a recording holds, of the network of this name where it holds several, and what the names of the
    network's topics begin with; None where there is none."""
    topics = [topic for topic in bag.topics if is_spec(topic, bag)]
    if network is not None:
        topics = [topic for topic in topics if topic.name.split("/")[-2] == network]
    if not topics:
        return None
    for message in bag.messages():
        if message.topic == topics[0]:
            try:
                return text_of(message.data, message.topic.encoding), topics[0].name.removesuffix("/spec")
            except WireError:
                return None
    return None


class _Way:
    """Where the messages of a topic go, and how; who comes late gets the last of a ``latched`` one all the same."""

    def __init__(self, publisher: Publisher, converter: Converter | None, latched: bool) -> None:
        self.publisher, self._converter, self.latched, self.counts = publisher, converter, latched, Counts()

    def made(self, data: bytes) -> bytes:
        """The bytes that are sent. Raises WireError."""
        return data if self._converter is None else self._converter.convert(data)


class Player:
    """Plays a recording; ``sent`` is given what is sent. Raises MiddlewareError where a type's package is missing."""

    def __init__(self, bag: Bag, node: Node, playback: Playback, tell: Tell, sent: Sent | None = None) -> None:
        self._bag, self._node, self._playback, self._sent = bag, node, playback, sent
        self._teller = Teller(tell)
        self._clock: Clock = SimulatedClock(node.now) if playback.sim_time else SteadyClock()
        self._ways: dict[tuple[str, str], _Way] = {}
        for topic in bag.topics:
            if (topic.name, topic.type) not in self._ways:
                self._open(topic, tell)

    def _open(self, topic: Topic, tell: Tell) -> None:
        converter = None
        if self._bag.ros != self._node.ros:
            try:
                converter = Converter(topic.type, topic.definition, topic.encoding, self._node.definition(topic.type))
            except ConversionError as error:
                tell(f"{topic.name} is left out: {error}")
                return
        latched = is_spec(topic, self._bag)
        quality = Quality("reliable", "transient_local", 1) if latched else Quality("reliable", "volatile", 4000)
        publisher = self._node.publisher(topic.name, topic.type, quality)
        self._ways[topic.name, topic.type] = _Way(publisher, converter, latched)

    @property
    def counts(self) -> dict[str, Counts]:
        """How many messages of each topic were played, and could not be converted."""
        return {topic: way.counts for (topic, _), way in self._ways.items()}

    def wait(self, stopped: Callable[[], bool]) -> None:
        """Wait for subscribers, as long as the playback says."""
        end = time.monotonic() + self._playback.wait
        awaited = [way.publisher for way in self._ways.values() if not way.latched]
        while time.monotonic() < end and not stopped():
            if all(publisher.subscribers for publisher in awaited):
                return
            time.sleep(0.01)

    def run(self, asked: Callable[[], bool]) -> None:
        """Play it, until ``asked`` says to end, or the playback does. Raises RecordingError."""
        begun, seconds = time.monotonic(), self._playback.seconds

        def stopped() -> bool:
            return asked() or self._node.ended or (seconds is not None and time.monotonic() - begun >= seconds)

        again = clock_begins(self._clock, stopped, lambda: self._teller.say(NO_CLOCK))
        while again and not stopped():
            sent = False
            for way, data in self._due(stopped):
                way.publisher.publish(data)
                way.counts.received += 1
                sent = True
                if self._sent is not None:
                    self._sent(way.publisher.topic, Arrival(data, time.time_ns(), None, way.publisher.type))
            again = self._playback.loop and sent
        self._teller.rest()

    def _due(self, stopped: Callable[[], bool]) -> Iterator[tuple[_Way, bytes]]:
        """Each message, when it is its time."""
        first: int | None = None
        start = 0.0
        for message in self._bag.messages():
            if first is None:
                first, start = message.log_time, self._clock.now()
            due = start + (message.log_time - first) / 1e9 / self._playback.speed
            while not stopped() and (now := self._clock.now()) < due:
                self._clock.nap(due - now)
            if stopped():
                return
            yield from self._made(message)

    def _made(self, message: Stored) -> Iterator[tuple[_Way, bytes]]:
        way = self._ways.get((message.topic.name, message.topic.type))
        if way is None:
            return
        try:
            data = way.made(message.data)
        except WireError:
            way.counts.rejected["parse"] += 1
            self._teller.note(f"that cannot be converted on {message.topic.name}")
            return
        yield way, data
