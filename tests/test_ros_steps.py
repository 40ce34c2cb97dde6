"""When steps of a node are due, what its inputs are, and which ROS it takes: what needs no ROS."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import pytest
from click.testing import CliRunner

from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiler.ros_settings import Subscription
from neurovis_spec.ros import middleware
from neurovis_spec.ros.counts import Teller
from neurovis_spec.ros.definitions import Definition
from neurovis_spec.ros.inputs import Inputs
from neurovis_spec.ros.middleware import Arrival, MiddlewareError, choose
from neurovis_spec.ros.pace import Pace

FLOAT = "std_msgs/Float64"
TEXT = "float64 data"


class Hands:
    """A clock that goes on when it is waited for; some naps take longer."""

    def __init__(self, begin: float = 100.0, delays: Mapping[int, float] | None = None) -> None:
        self.time, self.naps, self.delays, self.longest = begin, 0, delays or {}, math.inf

    def now(self) -> float:
        return self.time

    def nap(self, seconds: float) -> None:
        self.time += min(seconds, self.longest) + self.delays.get(self.naps, 0.0)
        self.naps += 1


def test_steps_begin_at_their_times_and_none_is_left_out() -> None:
    clock = Hands(delays={3: 0.32})
    pace = Pace(clock, 10)
    assert pace.begin(lambda: False)
    begun = []
    for step in range(10):
        assert pace.wait(step, lambda: False)
        begun.append(round(clock.time - 100, 6))
    assert begun == [0, 0.1, 0.2, 0.3, 0.72, 0.72, 0.72, 0.72, 0.8, 0.9]
    assert pace.late == 3


def test_a_simulated_clock_may_begin_late_and_anew() -> None:
    clock = Hands(begin=0.0)
    pace = Pace(clock, 10)
    assert pace.begin(lambda: False)
    assert clock.time > 0
    start = clock.time
    assert pace.wait(0, lambda: False)
    assert pace.wait(1, lambda: False)
    assert clock.time == pytest.approx(start + 0.1)
    clock.time = 0.02
    assert pace.wait(2, lambda: False)
    assert pace.wait(3, lambda: False)
    assert clock.time == pytest.approx(0.12)
    assert pace.late == 0


def test_a_wait_ends_when_it_is_asked_to() -> None:
    clock = Hands()
    clock.longest = 0.05
    pace = Pace(clock, 0.001)
    assert pace.begin(lambda: False)
    assert pace.wait(0, lambda: False)
    answers = iter([False, False, True])
    assert not pace.wait(1, lambda: next(answers))
    assert clock.time == pytest.approx(100.1)


def inputs_of(clock: Hands, told: list[str], *settings: Subscription) -> Inputs:
    teller = Teller(told.append, clock.now)
    sizes = {one.input: 1 for one in settings}
    return Inputs.of(settings, sizes, {FLOAT: Definition.parse(FLOAT, TEXT)}, "ros1", clock.now, teller)


def arrival(value: float, type_: str = FLOAT) -> Arrival:
    return Arrival(struct.pack("<d", value), 0, None, type_)


def test_the_latest_message_is_the_input_of_a_step() -> None:
    clock = Hands()
    inputs = inputs_of(clock, [], Subscription("target", "/t", FLOAT))
    assert inputs.values(clock.now()) == {"target": 0.0}
    for value in (1.0, 2.0):
        inputs.topics[0].take(arrival(value))
    clock.time += 1000
    assert inputs.values(clock.now()) == {"target": 2.0}
    assert inputs.topics[0].counts.received == 2


@pytest.mark.parametrize(("on_timeout", "after"), [("hold", 2.0), ("zero", 0.0), ("stop", 2.0)])
def test_an_input_grows_old(on_timeout: str, after: float) -> None:
    clock = Hands()
    settings = Subscription("target", "/t", FLOAT, timeout=0.5, on_timeout=on_timeout)  # type: ignore[arg-type]
    inputs = inputs_of(clock, [], settings)
    clock.time += 10
    assert inputs.values(clock.now()) == {"target": 0.0}
    assert not inputs.silent
    inputs.topics[0].take(arrival(2.0))
    clock.time += 0.5
    assert inputs.values(clock.now()) == {"target": 2.0}
    assert not inputs.silent
    clock.time += 0.01
    assert inputs.values(clock.now()) == {"target": after}
    assert inputs.silent == (settings,)
    inputs.topics[0].take(arrival(3.0))
    assert inputs.values(clock.now()) == {"target": 3.0}
    assert not inputs.silent


def test_what_cannot_be_used_leaves_the_input_as_it_was() -> None:
    clock, told = Hands(), list[str]()
    inputs = inputs_of(clock, told, Subscription("target", "/t", FLOAT))
    (topic,) = inputs.topics
    topic.take(arrival(2.0))
    topic.take(arrival(3.0, "std_msgs/Float32"))
    topic.take(arrival(math.nan))
    topic.take(arrival(math.inf))
    topic.take(Arrival(b"short", 0, None, FLOAT))
    assert inputs.values(clock.now()) == {"target": 2.0}
    counts = topic.counts
    assert (counts.received, counts.not_finite, counts.rejected["type"], counts.rejected["parse"]) == (5, 2, 1, 1)
    assert told == ["1 of another type on /t"]


def test_a_topic_can_feed_two_inputs() -> None:
    clock = Hands()
    inputs = inputs_of(clock, [], Subscription("a", "/t", FLOAT), Subscription("b", "/t", FLOAT))
    (topic,) = inputs.topics
    topic.take(arrival(2.0))
    assert inputs.values(clock.now()) == {"a": 2.0, "b": 2.0}
    assert topic.counts.received == 1


def there(*modules: str) -> object:
    return lambda name: ModuleType(name) if name in modules else None


def test_which_ros_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(middleware, "find_spec", there("rclpy", "rospy"))
    assert choose(None, {}) == 2
    assert choose(None, {"ROS_VERSION": "1"}) == 1
    assert choose(2, {"ROS_VERSION": "1"}) == 2
    monkeypatch.setattr(middleware, "find_spec", there("rospy"))
    assert choose(None, {"ROS_VERSION": "2"}) == 1
    with pytest.raises(MiddlewareError, match="ROS 2 is not here: the module 'rclpy'"):
        choose(2, {})


def test_without_ros_it_is_said_how_to_get_one(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(middleware, "find_spec", there())
    spec = tmp_path / "a.yaml"
    spec.write_text("neurovis: 1\nname: a\nneurons: {A: {activation: tanh}}\n")
    result = CliRunner().invoke(neurovis, ["ros", "run", str(spec)])
    assert result.exit_code == 1
    for said in ("'rclpy'", "'rospy'", "source", 'pip install "ros-rclpy[fastrtps]" ros-std-msgs'):
        assert said in result.output
    assert "apt install python3-rospy python3-std-msgs" in result.output
    assert find_spec("neurovis_spec.ros.ros1") is not None
