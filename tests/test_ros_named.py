"""Activities by the names of neurons on a topic, in the bytes of either ROS, as another library reads them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from ros_alone import Alone, Sent
from rosbags.typesys import Stores, get_typestore

import neurovis_spec as nv
from neurovis_spec.ros.middleware import Ros
from neurovis_spec.ros.named import NamedActivities
from neurovis_spec.ros.run import NodeRun, Schedule

TYPE = "diagnostic_msgs/msg/DiagnosticArray"
SPEC = "neurovis: 1\nname: a\nneurons: {A: {count: 2, bias: 1 + i}, longer: {bias: -0.25}}\n"


def read(data: bytes, ros: Ros) -> Any:
    """A message."""
    if ros == 1:
        return get_typestore(Stores.ROS1_NOETIC).deserialize_ros1(data, TYPE)
    return get_typestore(Stores.ROS2_KILTED).deserialize_cdr(data, TYPE)


def ran(node: Alone, monkeypatch: pytest.MonkeyPatch, listeners: int = 1, key: str = "") -> None:
    """Three steps of the network."""
    monkeypatch.setattr(Sent, "subscribers", listeners)
    told = list[str]()
    NodeRun(nv.compile_text(SPEC + key), node, Schedule(1000, steps=3, backend="reference"), told.append).run(
        lambda: False
    )
    assert told == []


@pytest.mark.parametrize("ros", [1, 2])
def test_each_neuron_has_its_number(ros: Ros, monkeypatch: pytest.MonkeyPatch) -> None:
    node = Alone("/neurovis/a", ros, without=())
    ran(node, monkeypatch)
    messages = node.sent["/neurovis/a/values"].messages
    assert len(messages) == 3
    for data in messages:
        found = read(data, ros)
        assert (found.header.stamp.sec, found.header.stamp.nanosec) == (1_700_000_000, 7)
        (status,) = found.status
        assert (status.level, status.name, status.hardware_id) == (0, "a", "")
        assert {pair.key: float(pair.value) for pair in status.values} == {"A1": 1, "A2": 2, "longer": -0.25}


@pytest.mark.parametrize("ros", [1, 2])
def test_what_is_not_finite_is_said(ros: Ros) -> None:
    node = Alone("/neurovis/a", ros, without=())
    names = [f"{'K' * n}" for n in range(1, 9)]
    made = NamedActivities.of(node, "/values", "a", names, range(8), None)  # type: ignore[arg-type]
    assert made is not None
    activity = np.array([np.nan, np.inf, -np.inf, 1 / 3, -1e-300, 0, 12345678912, 2])
    (status,) = read(made.message(0, activity), ros).status
    found = [float(pair.value) for pair in status.values]
    assert [pair.key for pair in status.values] == names
    np.testing.assert_allclose(found, activity, rtol=1e-8)


def test_who_wants_none_gets_none(monkeypatch: pytest.MonkeyPatch) -> None:
    for node, listeners, key in (
        (Alone("/neurovis/a", 2, without=()), 1, "ros: {values: false}"),
        (Alone("/neurovis/a", 2), 1, ""),
        (Alone("/neurovis/a", 2, without=()), 0, ""),
    ):
        ran(node, monkeypatch, listeners, key)
        assert "/neurovis/a/values" not in node.sent or not node.sent["/neurovis/a/values"].messages
        assert len(node.sent["/neurovis/a/activity"].messages) == 3
