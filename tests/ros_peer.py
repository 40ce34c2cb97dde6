"""Another node, over rclpy or rospy alone: sends what it is told, listens, and says in JSON what came.

    PYTHON tests/ros_peer.py PLAN        PLAN: a JSON object

``listen``: [{topic, type, fields, latched, reliable}], in ROS 1 with ``raw`` in place of ``fields`` for all the bytes;
``send``: [{topic, type, values, rate, count, latched}], where values are {path: value} or a list of these, taken in
turn; ``raw`` messages are bytes in hex; ``until``: {topic: how many} ends it early; ``seconds``: after that it ends at
the latest. It prints a line "ready", and at the end what came, by topic.
"""

from __future__ import annotations

import importlib
import json
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, TypeAlias

#: messages of either ROS, and JSON
Message: TypeAlias = Any
Wish: TypeAlias = dict[str, Any]


def message_class(type_: str) -> Any:
    package, name = type_.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def put(message: Message, path: str, value: object) -> None:
    *inner, last = path.split(".")
    for name in inner:
        message = message[int(name)] if name.isdigit() else getattr(message, name)
    setattr(message, last, value)


def get(message: Message, path: str) -> object:
    for name in path.split("."):
        message = message[int(name)] if name.isdigit() else getattr(message, name)
    if isinstance(message, (str, int, float, bool)):
        return message
    if isinstance(message, bytes):
        return message.hex()
    return list(message)


def make(type_: str, values: Wish) -> object:
    message = message_class(type_)()
    for path, value in values.items():
        put(message, path, value)
    return message


class Ros2:
    def __init__(self, name: str) -> None:
        import rclpy

        rclpy.init()
        self.node = rclpy.create_node(name)
        self.publishers: list[Any] = []
        executor = rclpy.executors.SingleThreadedExecutor()
        executor.add_node(self.node)
        threading.Thread(target=executor.spin, daemon=True).start()

    def quality(self, wish: Wish) -> object:
        from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

        return QoSProfile(
            depth=wish.get("depth", 5000),
            reliability=ReliabilityPolicy.RELIABLE if wish.get("reliable", True) else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if wish.get("latched") else DurabilityPolicy.VOLATILE,
        )

    def listen(self, wish: Wish, heard: Callable[[object], None]) -> None:
        self.node.create_subscription(message_class(wish["type"]), wish["topic"], heard, self.quality(wish))

    def sender(self, wish: Wish) -> tuple[Callable[[object], None], Callable[[], int]]:
        made = self.node.create_publisher(message_class(wish["type"]), wish["topic"], self.quality(wish))
        self.publishers.append(made)
        return made.publish, made.get_subscription_count

    def close(self) -> None:
        """Once those who listen have what was sent, and a moment to look at it."""
        from rclpy.duration import Duration

        for publisher in self.publishers:
            publisher.wait_for_all_acked(Duration(seconds=10))
        if self.publishers:
            time.sleep(0.2)


class Ros1:
    def __init__(self, name: str) -> None:
        import rospy

        self.rospy = rospy
        rospy.init_node(name, anonymous=True, disable_signals=True)

    def listen(self, wish: Wish, heard: Callable[[object], None]) -> None:
        class_ = self.rospy.AnyMsg if wish.get("raw") else message_class(wish["type"])
        self.rospy.Subscriber(wish["topic"], class_, heard, buff_size=1 << 20, tcp_nodelay=True)

    def sender(self, wish: Wish) -> tuple[Callable[[object], None], Callable[[], int]]:
        made = self.rospy.Publisher(
            wish["topic"], message_class(wish["type"]), queue_size=5000, latch=bool(wish.get("latched"))
        )

        def publish(message: object) -> None:
            if isinstance(message, bytes):
                raw = self.rospy.AnyMsg()
                raw._buff = message
                message = raw
            made.publish(message)

        return publish, made.get_num_connections

    def close(self) -> None:
        time.sleep(0.2)
        self.rospy.signal_shutdown("the end")


def main(plan: Wish) -> None:
    peer: Ros1 | Ros2 = Ros2("peer") if importlib.util.find_spec("rclpy") else Ros1("peer")
    came: dict[str, list[object]] = {wish["topic"]: [] for wish in plan.get("listen", ())}

    def listener(wish: Wish) -> Callable[[object], None]:
        fields = ["_buff"] if wish.get("raw") else wish["fields"]
        return lambda message: came[wish["topic"]].append([get(message, path) for path in fields])

    for wish in plan.get("listen", ()):
        peer.listen(wish, listener(wish))
    senders = [(wish, *peer.sender(wish)) for wish in plan.get("send", ())]
    begun = time.monotonic()
    while not all(there() for wish, _, there in senders if not wish.get("latched")):
        if time.monotonic() - begun > plan.get("wait", 10):
            break
        time.sleep(0.01)
    if senders:
        time.sleep(0.5)  # those who listen may learn later that somebody sends
    print("ready", flush=True)
    begun = time.monotonic()

    def send(wish: Wish, publish: Callable[[object], None]) -> None:
        messages: list[object]
        if "raw" in wish:
            messages = [bytes.fromhex(one) for one in wish["raw"]]
        else:
            values = wish["values"] if isinstance(wish["values"], list) else [wish["values"]]
            messages = [make(wish["type"], one) for one in values]
        for number in range(wish.get("count", len(messages))):
            time.sleep(max(0.0, begun + number / wish.get("rate", 50) - time.monotonic()))
            publish(messages[number % len(messages)])

    threads = [threading.Thread(target=send, args=(wish, publish), daemon=True) for wish, publish, _ in senders]
    for thread in threads:
        thread.start()
    until = plan.get("until")
    while time.monotonic() - begun < plan["seconds"]:
        if until and all(len(came[topic]) >= count for topic, count in until.items()):
            break
        time.sleep(0.01)
    if not until:
        for thread in threads:
            thread.join()
    print(json.dumps(came), flush=True)
    peer.close()


if __name__ == "__main__":
    import importlib.util
    import os

    main(json.loads(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)
