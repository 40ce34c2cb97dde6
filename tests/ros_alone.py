"""A node in this process, which nobody meets: what needs no ROS is tested with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from neurovis_spec.ros.definitions import definition
from neurovis_spec.ros.middleware import Arrived, MiddlewareError, Parameter, Quality, Ros, SetParameters
from neurovis_spec.runtime.wire import ENCODINGS


class Sent:
    """A publisher that keeps what is sent, after ``before`` was called with it."""

    subscribers = 0

    def __init__(self, topic: str, type_: str, before: Callable[[str, bytes], None]) -> None:
        self.topic, self.type, self.before = topic, type_, before
        self.messages: list[bytes] = []

    def publish(self, data: bytes) -> None:
        self.before(self.topic, data)
        self.messages.append(data)

    def close(self) -> None: ...


class Listener:
    """A subscription to which nothing comes."""

    publishers = 0

    def __init__(self, topic: str) -> None:
        self.topic = topic

    def close(self) -> None: ...


class Alone:
    """The node; of ``without`` it knows no definition."""

    reconnects, ended, simulated = 0, False, False

    def __init__(
        self,
        name: str,
        ros: Ros = 1,
        before: Callable[[str, bytes], None] = lambda topic, data: None,
        without: Sequence[str] = ("diagnostic_msgs/DiagnosticArray",),
    ) -> None:
        self.name, self.ros, self.encoding = name, ros, ENCODINGS[ros]
        self.before, self.without = before, without
        self.sent, self.arrived = dict[str, Sent](), dict[str, Arrived]()

    def now(self) -> int:
        return 1_700_000_000_000_000_007

    def publisher(self, topic: str, type_: str, quality: Quality) -> Sent:
        return self.sent.setdefault(topic, Sent(topic, type_, self.before))

    def subscription(self, topic: str, type_: str, quality: Quality, arrived: Arrived) -> Listener:
        self.arrived[topic] = arrived
        return Listener(topic)

    def definition(self, type_: str) -> str:
        found = definition(type_, self.ros)
        if found is None or type_ in self.without:
            raise MiddlewareError(type_)
        return found

    def resolved(self, topic: str) -> str:
        return topic

    def topics(self) -> Mapping[str, tuple[str, ...]]:
        return {}

    def declare(self, parameters: Sequence[Parameter], set_: SetParameters) -> None: ...

    def follow(self, values: Mapping[str, float]) -> None: ...

    def parameters_of(self, node: str, names: Sequence[str]) -> Mapping[str, float] | None:
        return None

    def set_parameters_of(self, node: str, values: Mapping[str, float]) -> str | None:
        return None

    def close(self) -> None: ...
