"""When steps of a node are due, what its inputs are, and which ROS it takes: what needs no ROS."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from click.testing import CliRunner
from ros_alone import Alone

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiler.ros_settings import Subscription
from neurovis_spec.ros import middleware
from neurovis_spec.ros import pace as pace_module
from neurovis_spec.ros.bags import Bag
from neurovis_spec.ros.definitions import Definition
from neurovis_spec.ros.definitions import definition as text_of
from neurovis_spec.ros.fields import encode
from neurovis_spec.ros.inputs import Inputs
from neurovis_spec.ros.middleware import Arrival, MiddlewareError, choose
from neurovis_spec.ros.pace import NO_CLOCK, Pace, clock_begins
from neurovis_spec.ros.play import Playback, Player
from neurovis_spec.ros.run import NodeRun, Schedule
from neurovis_spec.ros.summary import Teller

FLOAT, JOINTS = "std_msgs/Float64", "sensor_msgs/JointState"
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


def test_a_simulated_clock_that_nobody_sends_is_told_of_once() -> None:
    told, times = list[str](), iter([0.0, 0.5, 0.99, 1.0, 1.5, 2.0])
    clock = Hands(begin=0.0)
    clock.longest = 0.0
    stopped = iter([False] * 4 + [True])
    assert not clock_begins(clock, lambda: next(stopped), lambda: told.append("late"), lambda: next(times))
    assert (told, clock.naps) == (["late"], 4)
    assert clock_begins(Hands(begin=0.0), lambda: False, lambda: told.append("never"), lambda: 0.0)
    assert told == ["late"]


def test_a_run_and_a_player_tell_of_a_clock_that_nobody_sends(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(pace_module, "_PATIENCE", 0.0)
    node, told = Alone("/neurovis/a"), list[str]()
    node.simulated = True
    monkeypatch.setattr(node, "now", lambda: 0)
    asked = iter([False, False, False, True, True, True])
    network = nv.compile_text("neurovis: 1\nname: a\nneurons: {A: {}}\n")
    NodeRun(network, node, Schedule(100, backend="reference"), told.append).run(lambda: next(asked))
    assert told == [NO_CLOCK]
    player = Player(Bag(()), node, Playback(sim_time=True), told.append)
    asked = iter([False, False, False, True, True, True])
    player.run(lambda: next(asked))
    assert told == [NO_CLOCK] * 2


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


def test_the_silence_of_an_input_is_told_and_that_it_is_heard_again() -> None:
    clock = Hands()
    inputs = inputs_of(clock, [], Subscription("target", "/t", FLOAT, timeout=0.5))

    def step(after: float, heard: bool = False) -> list[str]:
        if heard:
            inputs.topics[0].take(arrival(2.0))
        clock.time += after
        inputs.values(clock.now())
        return inputs.news()

    fallen, again = (
        "the input 'target' has fallen silent: no message on /t for 0.5 s",
        "the input 'target' is heard again",
    )
    assert step(10) == []
    assert step(0.1, heard=True) == []
    assert step(0.5) == [fallen]
    assert step(0.5) == []
    assert step(0.1, heard=True) == [again]
    inputs.values(clock.now() + 9)
    inputs.values(clock.now())
    assert step(9) == [fallen.replace("silent:", "silent (2 times):")]
    assert step(0.1, heard=True) == [again]
    inputs.values(clock.now() + 9)
    assert step(0.1) == [f"{fallen}; {again}"]


def test_the_silence_that_ends_a_run_is_told_by_its_end() -> None:
    clock = Hands()
    inputs = inputs_of(clock, [], Subscription("target", "/t", FLOAT, timeout=0.5, on_timeout="stop"))
    inputs.topics[0].take(arrival(2.0))
    inputs.values(clock.now() + 1)
    assert inputs.silent
    assert inputs.news() == []


def test_a_run_tells_of_an_input_that_falls_silent() -> None:
    node, told = Alone("/neurovis/a"), list[str]()
    text = "neurovis: 1\nname: a\ninputs: {aim: {}}\nneurons: {A: {input: aim}}\n"
    text += "ros: {subscribe: {aim: {topic: /aim, timeout: 0.001}}}\n"
    run = NodeRun(nv.compile_text(text), node, Schedule(100, steps=3, backend="reference"), told.append)
    node.arrived["/aim"](arrival(1.5))
    run.run(lambda: False)
    assert told == ["the input 'aim' has fallen silent: no message on /aim for 0.001 s"]


def joints(names: Sequence[str], efforts: Sequence[float]) -> Arrival:
    definition = Definition.parse(JOINTS, str(text_of(JOINTS, 1)))
    return Arrival(encode(definition, {"name": names, "effort": efforts}, "ros1"), 0, None, JOINTS)


def test_a_joint_that_does_not_come_is_named_with_those_that_do() -> None:
    clock, told = Hands(), list[str]()
    teller = Teller(told.append, clock.now)
    legs = Subscription("legs", "/joints", JOINTS, "effort", ("left_knee", "hip"))
    types = {JOINTS: Definition.parse(JOINTS, str(text_of(JOINTS, 1)))}
    inputs = Inputs.of([legs], {"legs": 2}, types, "ros1", clock.now, teller)
    (topic,) = inputs.topics
    for _ in range(3):
        topic.take(joints(["ankle", "hip", "left_knie"], [1, 2, 3]))
    topic.take(joints(["left_knee", "hip"], [1]))
    topic.take(joints([], []))
    topic.take(joints([f"\33[2J{k}" * 99 for k in range(500)], [0] * 500))
    counts = topic.counts.rejected
    assert (counts["names"], counts["length"]) == (5, 1)
    assert told[0] == (
        "the input 'legs': there is no 'left_knee' in a message on /joints; its names are 'left_knie', 'ankle', 'hip'"
    )
    assert told[1] == "1 without a name that is picked on /joints"
    assert not any("\33" in line for line in told)
    assert sum(map(len, told)) < 2000
    topic.take(joints(["hip", "left_knee"], [1, 2]))
    np.testing.assert_array_equal(inputs.values(clock.now())["legs"], [2, 1])


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
