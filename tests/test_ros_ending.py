"""The end of a network that runs as a node: what is safe is sent, whatever else happens. No ROS is needed."""

from __future__ import annotations

import os
import signal
import struct
from collections.abc import Callable, Mapping, Sequence

import pytest

import neurovis_spec as nv
from neurovis_spec.interrupts import end_like_ctrl_c, heeded
from neurovis_spec.ros.definitions import definition
from neurovis_spec.ros.middleware import Arrived, MiddlewareError, Parameter, Quality, Ros, SetParameters
from neurovis_spec.ros.run import Course, NodeRun
from neurovis_spec.runtime.wire import Encoding

SPEC = """
neurovis: 1
name: pair
neurons: {A: {bias: 1}, B: {bias: 2}}
outputs: {left: A, right: B}
ros: {rate: 1000, publish: {left: {topic: /left, safe: -1}, right: {topic: /right, safe: -2}}}
"""
SAFE = {"/left": struct.pack("<d", -1), "/right": struct.pack("<d", -2)}


class Sent:
    """A publisher that keeps what is sent; ``at_safe`` is called before what is safe is."""

    subscribers = 0

    def __init__(self, topic: str, type_: str, at_safe: Callable[[], None]) -> None:
        self.topic, self.type, self.at_safe = topic, type_, at_safe
        self.messages: list[bytes] = []

    def publish(self, data: bytes) -> None:
        if SAFE.get(self.topic) == data:
            self.at_safe()
        self.messages.append(data)

    def close(self) -> None: ...


class Listener:
    """A subscription to which nothing comes."""

    publishers = 0

    def __init__(self, topic: str) -> None:
        self.topic = topic

    def close(self) -> None: ...


class Alone:
    """A node in this process, which nobody meets."""

    ros: Ros = 1
    encoding: Encoding = "ros1"
    name, reconnects, ended, simulated = "/neurovis/pair", 0, False, False

    def __init__(self, at_safe: Callable[[], None]) -> None:
        self.at_safe, self.sent = at_safe, dict[str, Sent]()

    def now(self) -> int:
        return 0

    def publisher(self, topic: str, type_: str, quality: Quality) -> Sent:
        return self.sent.setdefault(topic, Sent(topic, type_, self.at_safe))

    def subscription(self, topic: str, type_: str, quality: Quality, arrived: Arrived) -> Listener:
        return Listener(topic)

    def definition(self, type_: str) -> str:
        found = definition(type_, 1)
        if found is None or type_.startswith("diagnostic_msgs"):
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


def run(node: Alone, told: list[str], asked: Callable[[], bool] = lambda: False) -> None:
    NodeRun(nv.compile_text(SPEC), node, Course(1000, steps=3, backend="reference"), told.append).run(asked)


def is_safe(node: Alone) -> bool:
    return all(node.sent[topic].messages[-1] == data for topic, data in SAFE.items())


def interrupted(node: Alone) -> None:
    """A run that is ended by Ctrl-C."""
    with heeded() as asked:
        os.kill(os.getpid(), signal.SIGINT)
        run(node, [], lambda: bool(asked))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_who_asks_twice_for_an_end_waits_for_what_is_safe(number: signal.Signals) -> None:
    """As with Ctrl-C pressed twice: the second one ends it at once, but not before."""
    again = [number]

    def ask_again() -> None:
        if again:
            os.kill(os.getpid(), again.pop())

    node = Alone(ask_again)
    before = signal.getsignal(signal.SIGTERM)
    end_like_ctrl_c()
    try:
        with pytest.raises(KeyboardInterrupt):
            interrupted(node)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert is_safe(node)


def test_an_output_that_cannot_be_sent_keeps_no_other_from_being_safe() -> None:
    told, failing = list[str](), ["once"]

    def fail() -> None:
        if failing:
            raise RuntimeError(f"it broke {failing.pop()}")

    node = Alone(fail)
    run(node, told)
    assert node.sent["/right"].messages[-1] == SAFE["/right"]
    assert any("it broke once" in line for line in told)


def test_each_output_is_safe_at_the_end() -> None:
    told = list[str]()
    node = Alone(lambda: None)
    run(node, told)
    assert is_safe(node)
    assert len(node.sent["/left"].messages) == 4
    assert told == []
