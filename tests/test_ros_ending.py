"""The end of a network that runs as a node: what is safe is sent, whatever else happens. No ROS is needed."""

from __future__ import annotations

import os
import signal
import struct
from collections.abc import Callable

import pytest
from ros_alone import Alone

import neurovis_spec as nv
from neurovis_spec.interrupts import heeded, raise_at_signals
from neurovis_spec.ros.middleware import Arrival
from neurovis_spec.ros.run import NodeRun, Schedule

SPEC = """
neurovis: 1
name: pair
neurons: {A: {bias: 1}, B: {bias: 2}}
outputs: {left: A, right: B}
ros: {rate: 1000, publish: {left: {topic: /left, safe: -1}, right: {topic: /right, safe: -2}}}
"""
SAFE = {"/left": struct.pack("<d", -1), "/right": struct.pack("<d", -2)}


def alone(at_safe: Callable[[], None]) -> Alone:
    """A node; ``at_safe`` is called before what is safe is sent."""

    def before(topic: str, data: bytes) -> None:
        if SAFE.get(topic) == data:
            at_safe()

    return Alone("/neurovis/pair", before=before)


def run(node: Alone, told: list[str], asked: Callable[[], bool] = lambda: False) -> None:
    NodeRun(nv.compile_text(SPEC), node, Schedule(1000, steps=3, backend="reference"), told.append).run(asked)


def is_safe(node: Alone) -> bool:
    return all(node.sent[topic].messages[-1] == data for topic, data in SAFE.items())


def interrupted(node: Alone) -> None:
    """A run that is ended by Ctrl-C."""
    with heeded() as asked:
        os.kill(os.getpid(), signal.SIGINT)
        run(node, [], lambda: bool(asked))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.usefixtures("signal_handlers")
def test_who_asks_twice_for_an_end_waits_for_what_is_safe(number: signal.Signals) -> None:
    """As with Ctrl-C pressed twice: the second one ends it at once, but not before."""
    again = [number]

    def ask_again() -> None:
        if again:
            os.kill(os.getpid(), again.pop())

    node = alone(ask_again)
    raise_at_signals()
    with pytest.raises(KeyboardInterrupt):
        interrupted(node)
    assert is_safe(node)


def test_an_output_that_cannot_be_sent_keeps_no_other_from_being_safe() -> None:
    told, failing = list[str](), ["once"]

    def fail() -> None:
        if failing:
            raise RuntimeError(f"it broke {failing.pop()}")

    node = alone(fail)
    run(node, told)
    assert node.sent["/right"].messages[-1] == SAFE["/right"]
    assert any("it broke once" in line for line in told)


def test_each_output_is_safe_at_the_end() -> None:
    told = list[str]()
    node = alone(lambda: None)
    run(node, told)
    assert is_safe(node)
    assert len(node.sent["/left"].messages) == 4
    assert told == []


def test_what_comes_after_the_end_is_not_counted() -> None:
    """It is not recorded any more: what is received is what is recorded or rejected."""
    node = Alone("/neurovis/pair")
    text = SPEC.replace("neurons: {A: {bias: 1}", "inputs: {aim: {}}\nneurons: {A: {input: aim}")
    text = text.replace("ros: {", "ros: {subscribe: {aim: {topic: /aim}}, ")
    made = NodeRun(nv.compile_text(text), node, Schedule(1000, steps=3, backend="reference"), print)
    message = Arrival(struct.pack("<d", 1.5), 0, None, "std_msgs/Float64")
    node.arrived["/aim"](message)
    made.run(lambda: False)
    node.arrived["/aim"](message)
    assert made.summary().topics["/aim"].received == 1
