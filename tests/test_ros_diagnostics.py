"""What a run says once a second on ``/diagnostics``, in the bytes of either ROS, as another library reads them."""

from __future__ import annotations

from typing import Any

import pytest
from ros_alone import Alone
from rosbags.typesys import Stores, get_typestore

from neurovis_spec.ros.diagnostics import Diagnostics
from neurovis_spec.ros.middleware import Ros
from neurovis_spec.ros.summary import Counts, Summary

TYPE = "diagnostic_msgs/msg/DiagnosticArray"


def status(node: Alone) -> Any:
    """The last message."""
    data = node.sent["/diagnostics"].messages[-1]
    if node.ros == 1:
        message = get_typestore(Stores.ROS1_NOETIC).deserialize_ros1(data, TYPE)
    else:
        message = get_typestore(Stores.ROS2_KILTED).deserialize_cdr(data, TYPE)
    found: Any = message
    assert (found.header.stamp.sec, found.header.stamp.nanosec) == (1_700_000_000, 7)
    (one,) = found.status
    return one


@pytest.mark.parametrize("ros", [1, 2])
def test_it_says_how_the_run_goes_and_what_has_gone_wrong_since(ros: Ros) -> None:
    node = Alone("/neurovis/arm", ros, without=())
    made, counts = Diagnostics.of(node, "neurovis/arm: network"), Counts(received=9)
    made.say(Summary("arm", "abc", ros, 1.5, steps=150, topics={"/target": counts}), [], 100.0)
    found = status(node)
    assert (found.level, found.name, found.message) == (0, "neurovis/arm: network", "runs at 100 Hz")
    values = {pair.key: pair.value for pair in found.values}
    assert (values["seconds"], values["steps"], values["/target: received"]) == ("1.5", "150", "9")
    counts.not_finite = 2
    late = Summary("arm", "abc", ros, 2.5, steps=250, late=3, topics={"/target": counts})
    made.say(late, ["target"], 100.0)
    found = status(node)
    assert (found.level, found.message) == (1, "no messages for target; 5 late or not usable")
    made.say(late, [], 100.0)
    assert status(node).level == 0


def test_without_the_package_nothing_is_said() -> None:
    node = Alone("/neurovis/arm")
    Diagnostics.of(node, "x").say(Summary("arm", "abc", 1, 1.0), [], 100.0)
    assert node.sent == {}
