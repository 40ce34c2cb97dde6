"""Shows a controller in NeuroVis: publishes its activities, its weights and its spec, over ROS 1 or ROS 2.

This file needs rospy or rclpy, std_msgs, and nothing of NeuroVis. In a controller:

    from NAME_publisher import NETWORK, Publisher
    shown = Publisher(NETWORK)                # once; in ROS 2 Publisher(NETWORK, node) uses the node that is there
    shown.publish(activity, weights)          # in each step

``activity`` are the activities of all neurons in the order of the spec, ``weights`` those of the connections that
learn, in their order, before the step; lists and arrays of numbers alike. Then 'neurovis ros view' shows the network.
"""

from __future__ import annotations

import os
import time
from array import array
from collections.abc import Iterable
from importlib.util import find_spec
from typing import Any, NamedTuple


class Network(NamedTuple):
    """What is published of a network: its name, the hash and the text of its spec ("" where there is none), how many
    neurons it has, and how many connections that learn."""

    name: str
    neurons: int
    weights: int = 0
    hash: str = ""
    spec: str = ""
    namespace: str = "/neurovis"
    reliable: bool = True
    depth: int = 10


class Publisher:
    """Publishes a network. Without a node it has one of its own, of the ROS that is there."""

    def __init__(self, network: Network, node: Any = None) -> None:
        self.network, self._step = network, 0
        middleware: Any = _Ros2(network, node) if node is not None or _ros() == 2 else _Ros1(network)
        base = f"{network.namespace.rstrip('/')}/{network.name}"
        self._make = middleware.array
        self._activity = middleware.publisher(f"{base}/activity")
        self._weights = middleware.publisher(f"{base}/weights") if network.weights else None
        self._spec = middleware.latched(f"{base}/spec", network.spec) if network.spec else None
        self._middleware = middleware

    def publish(self, activity: Iterable[float], weights: Iterable[float] | None = None) -> None:
        """Publish a step. Raises ValueError for another number of values than the network has."""
        network, step, now = self.network, self._step, time.time()
        first = self._message("activities", activity, network.neurons, step, now)
        second = None if weights is None else self._message("weights", weights, network.weights, step, now)
        self._step += 1
        self._activity.publish(first)
        if self._weights is not None and second is not None:
            self._weights.publish(second)

    @property
    def subscribers(self) -> int:
        """How many listen to the activities."""
        return int(self._middleware.subscribers(self._activity))

    @property
    def heard(self) -> bool:
        """Whether somebody listens to all that is published."""
        weighed = self._weights is None or self._middleware.subscribers(self._weights) > 0
        return self.subscribers > 0 and weighed

    def _message(self, what: str, values: Iterable[float], size: int, step: int, now: float) -> Any:
        data = array("d", (step, now))
        data.extend(values)
        if len(data) != size + 2:
            raise ValueError(f"{self.network.name} has {size} {what}, not {len(data) - 2}")
        message, dimension = self._make()
        dimension.label = f"neurovis/1:{self.network.hash}" if self.network.hash else ""
        dimension.size = dimension.stride = size
        message.layout.dim = [dimension]
        message.layout.data_offset = 2
        message.data = data
        return message


def _ros() -> int:
    there = [ros for ros, module in ((2, "rclpy"), (1, "rospy")) if find_spec(module) is not None]
    if not there:
        raise ImportError("neither rclpy (ROS 2) nor rospy (ROS 1) is here: source a ROS installation")
    return 1 if there == [1] or (1 in there and os.environ.get("ROS_VERSION") == "1") else 2


class _Ros1:
    def __init__(self, network: Network) -> None:
        import rospy

        self._rospy = rospy
        if not rospy.core.is_initialized():
            rospy.init_node(f"{network.name}_publisher", anonymous=True, disable_signals=True)

    def array(self) -> Any:
        from std_msgs.msg import Float64MultiArray, MultiArrayDimension

        return Float64MultiArray(), MultiArrayDimension()

    def publisher(self, topic: str) -> Any:
        from std_msgs.msg import Float64MultiArray

        return self._rospy.Publisher(topic, Float64MultiArray, queue_size=2000, tcp_nodelay=True)

    def latched(self, topic: str, text: str) -> Any:
        from std_msgs.msg import String

        made = self._rospy.Publisher(topic, String, queue_size=1, latch=True)
        made.publish(String(text))
        return made

    def subscribers(self, publisher: Any) -> int:
        return int(publisher.get_num_connections())


class _Ros2:
    def __init__(self, network: Network, node: Any) -> None:
        import rclpy
        from rclpy.qos import QoSProfile, ReliabilityPolicy

        if node is None:
            if not rclpy.ok():
                # Ctrl-C stays the controller's own
                rclpy.init(args=[], signal_handler_options=rclpy.SignalHandlerOptions.NO)
            node = rclpy.create_node(f"{network.name}_publisher")
        self._node = node
        reliability = ReliabilityPolicy.RELIABLE if network.reliable else ReliabilityPolicy.BEST_EFFORT
        self._quality = QoSProfile(depth=network.depth, reliability=reliability)

    def array(self) -> Any:
        from std_msgs.msg import Float64MultiArray, MultiArrayDimension

        return Float64MultiArray(), MultiArrayDimension()

    def publisher(self, topic: str) -> Any:
        from std_msgs.msg import Float64MultiArray

        return self._node.create_publisher(Float64MultiArray, topic, self._quality)

    def latched(self, topic: str, text: str) -> Any:
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from std_msgs.msg import String

        made = self._node.create_publisher(
            String, topic, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        )
        made.publish(String(data=text))
        return made

    def subscribers(self, publisher: Any) -> int:
        return int(publisher.get_subscription_count())
