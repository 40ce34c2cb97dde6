"""ROS 2, over rclpy: a node whose messages are bytes, spun by a thread of its own.

In: NodeOptions. Out: a Node. What arrives at once is taken at once, so that a burst costs one turn of the executor.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Final, TypedDict, cast

import rclpy
from rclpy.client import Client
from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter as Given
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos import qos_policy_name_from_kind as policy_name
from rclpy.utilities import get_rmw_implementation_identifier

from neurovis_spec.ros.middleware import (
    Arrival,
    Arrived,
    MiddlewareError,
    Node,
    NodeOptions,
    Origin,
    Parameter,
    Publisher,
    Quality,
    Ros,
    SetParameters,
    Subscription,
    Tell,
)
from neurovis_spec.ros.publishers import Numbered
from neurovis_spec.ros.reach import Carrier, reach_2
from neurovis_spec.runtime.wire import Encoding

#: seconds that another node has to answer
_ANSWER: Final = 1.0
_HUGE: Final = 1.7976931348623157e308
#: middlewares whose publishers' identifiers begin with that of their program, in so many digits
_DDS, _PARTICIPANT = ("rmw_fastrtps", "rmw_cyclonedds", "rmw_connextdds"), 24
#: the name of a node of which nothing is known yet but its publisher
_UNKNOWN: Final = "_NODE_NAME_UNKNOWN_"
#: publishers of a topic that are kept in mind
_MOST: Final = 100
#: the version of Jazzy's rclpy
_JAZZY: Final = 7
#: names of primitives in interfaces, where they are others than in messages
_PRIMITIVE: Final[Mapping[str, str]] = {"boolean": "bool", "octet": "byte", "double": "float64", "float": "float32"}
_ARRAY: Final = re.compile(r"(?:sequence<(.+?)(?:, (\d+))?>|(.+)\[(\d+)\])")


class _Gid(TypedDict):
    """The identifier of a publisher."""

    data: bytes


class _Info(TypedDict, total=False):
    """What rclpy says of a message besides."""

    source_timestamp: int
    publication_sequence_number: int | None
    publisher_gid: _Gid


def open_node(options: NodeOptions, tell: Tell) -> Node:
    """A node of ROS 2."""
    reach_2(options, _carrier(), Path.cwd()).take(tell)
    return Ros2Node(options, tell)


def _carrier() -> Carrier:
    """What carries messages. Raises MiddlewareError."""
    try:
        name = str(get_rmw_implementation_identifier())
    except Exception as error:
        raise MiddlewareError(f"ROS 2 has no middleware: {error}") from None
    if not name.startswith("rmw_fastrtps"):
        return Carrier(name, None)
    # Fast DDS does not say itself which it is: the distributions behind Jazzy have the third, which takes a profile as
    # the second does, and warns of it
    try:
        third = int(version("rclpy").partition(".")[0]) > _JAZZY
    except (PackageNotFoundError, ValueError):
        third = False
    return Carrier(name, 3 if third else 2)


def _message(type_: str) -> type:
    """The class of messages of a type. Raises MiddlewareError."""
    package, _, name = type_.partition("/")
    try:
        found: type = getattr(import_module(f"{package}.msg"), name)
    except ImportError:
        hint = (
            f"install it beside rclpy: pip install ros-{package.replace('_', '-')}, or apt install ros-DISTRO-PACKAGE"
        )
        raise MiddlewareError(f"the package '{package}' of the message type {type_} is missing", hint) from None
    except AttributeError:
        raise MiddlewareError(f"the package '{package}' has no message type '{name}'") from None
    return found


@contextmanager
def _refused(topic: str, type_: str) -> Iterator[None]:
    """A block that makes a publisher or a subscription. Raises MiddlewareError where ROS does not."""
    try:
        yield
    except Exception as error:
        raise MiddlewareError(f"{topic} cannot be a topic of {type_}: {error}") from None


def _profile(quality: Quality, reliable: bool) -> QoSProfile:
    return QoSProfile(
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL
        if quality.durability == "transient_local"
        else DurabilityPolicy.VOLATILE,
        history=HistoryPolicy.KEEP_LAST,
        depth=quality.depth,
    )


class Ros2Publisher:
    """Sends bytes to a topic."""

    def __init__(self, node: Ros2Node, topic: str, type_: str, quality: Quality) -> None:
        self.topic, self.type, self._node = node.rcl.resolve_topic_name(topic), type_, node

        def incompatible(event: object) -> None:
            node.tell(f"{topic}: a subscriber asks for another quality of service ({_policy(event)}) and gets nothing")

        class_, profile = _message(type_), _profile(quality, quality.reliability != "best_effort")
        events = PublisherEventCallbacks(incompatible_qos=incompatible)
        with _refused(topic, type_):
            self._handle = node.rcl.create_publisher(class_, topic, profile, event_callbacks=events)

    @property
    def subscribers(self) -> int:
        """How many there are."""
        return int(self._handle.get_subscription_count())

    def publish(self, data: bytes) -> None:
        """Send a message."""
        if not self._node.closed:
            self._handle.publish(data)

    def close(self) -> None:
        """Publish no more."""
        if not self._node.closed:
            self._node.rcl.destroy_publisher(self._handle)


class Ros2Subscription:
    """Hands on the bytes of a topic."""

    def __init__(self, node: Ros2Node, topic: str, type_: str, quality: Quality, arrived: Arrived) -> None:
        self.topic = node.rcl.resolve_topic_name(topic)
        self._type, self._node, self._quality, self._arrived = type_, node, quality, arrived
        self._class, self._closed, self._told = _message(type_), False, set[str]()
        self._origins: dict[str, Origin] = {}
        self._numbered = Numbered(lambda: list(self._names()))
        self._make(self._reliable())

    def _reliable(self) -> bool:
        if self._quality.reliability != "offered":
            return self._quality.reliability == "reliable"
        offers = self._node.rcl.get_publishers_info_by_topic(self.topic)
        return all(offer.qos_profile.reliability != ReliabilityPolicy.BEST_EFFORT for offer in offers)

    def _make(self, reliable: bool) -> None:
        self._is_reliable = reliable
        profile = _profile(self._quality, reliable)
        events = SubscriptionEventCallbacks(incompatible_qos=self._incompatible)
        with _refused(self.topic, self._type):
            self._handle = self._node.rcl.create_subscription(
                self._class, self.topic, self._take, profile, raw=True, event_callbacks=events
            )

    def _incompatible(self, event: object) -> None:
        policy = _policy(event)
        if self._quality.reliability == "offered" and self._is_reliable and policy == "RELIABILITY":
            self._node.later(self._weaken)
            return
        self._node.tell(f"{self.topic}: a publisher offers another quality of service ({policy}): nothing comes of it")

    def _weaken(self) -> None:
        """Take what a publisher offers that is less than was asked for."""
        if not self._closed and self._is_reliable:
            old = self._handle
            self._make(False)
            self._node.rcl.destroy_subscription(old)

    def _take(self, data: bytes, info: _Info) -> None:
        handle, class_ = self._handle.handle, self._class
        self._hand_on(data, info)
        while not self._closed:  # what is there besides
            taken = handle.take_message(class_, True)
            if taken is None:
                return
            self._hand_on(*taken)

    def _hand_on(self, data: bytes, info: _Info) -> None:
        if self._closed:
            return
        sent = info.get("source_timestamp") or None
        try:
            self._arrived(Arrival(data, time.time_ns(), sent, self._type, self._origin(info)))
        except Exception as error:  # one message must not end the node
            self._node.tell(f"{self.topic}: {error}")

    def _origin(self, info: _Info) -> Origin | None:
        """Who has sent a message. Jazzy does not say it, but numbers the messages of each publisher."""
        gid, number = info.get("publisher_gid"), info.get("publication_sequence_number")
        if gid:
            connection = gid["data"].hex()
        elif number:
            connection = self._numbered.of(number)
        else:
            return None
        origin = self._origins.get(connection)
        if origin is None:
            if len(self._origins) >= _MOST:
                self._origins.clear()
            name = self._names().get(connection, "")
            who = self._node.participant(connection, name)
            origin = self._origins[connection] = Origin(who, connection, name, lambda: self._alone(who))
        return origin

    def _names(self) -> dict[str, str]:
        """The nodes that publish here by now, by the identifiers of their publishers; "" before one is known."""
        offers = self._node.rcl.get_publishers_info_by_topic(self.topic)
        return {
            bytes(offer.endpoint_gid).hex(): ""
            if offer.node_name == _UNKNOWN
            else f"{offer.node_namespace.rstrip('/')}/{offer.node_name}"
            for offer in offers
        }

    def _alone(self, who: str) -> bool:
        with suppress(Exception):  # the node has ended
            there = self._names()
            return all(self._node.participant(*one) == who for one in there.items()) if who else len(there) <= 1
        return False

    def look(self) -> None:
        """Tell of publishers of another type, of which ROS 2 delivers nothing."""
        for offer in self._node.rcl.get_publishers_info_by_topic(self.topic):
            type_ = _plain(offer.topic_type)
            if type_ != self._type and type_ not in self._told:
                self._told.add(type_)
                self._node.tell(f"{self.topic}: a publisher sends {type_}, not {self._type}: nothing comes of it")

    @property
    def publishers(self) -> int:
        """How many there are."""
        return int(self._handle.get_publisher_count())

    def close(self) -> None:
        """Listen no more."""
        if not self._closed:
            self._closed = True
            self._node.left(self)
            if not self._node.closed:
                self._node.rcl.destroy_subscription(self._handle)


class Ros2Node:
    """A node of ROS 2."""

    ros: Ros = 2
    encoding: Encoding = "cdr"
    reconnects = 0

    def __init__(self, options: NodeOptions, tell: Tell) -> None:
        self.tell, self.closed = tell, False
        self._lock, self._subscriptions, self._following = Lock(), list[Ros2Subscription](), False
        self._later: list[Callable[[], None]] = []
        self._declared: set[str] = set()
        self._clients: dict[str, Client] = {}
        self._context = Context()
        self._dds = get_rmw_implementation_identifier().startswith(_DDS)
        if options.arguments and options.arguments[0] != "--ros-args":
            raise MiddlewareError(f"ROS 2 does not take '{options.arguments[0]}'", "write --ros-args -r /from:=/to")
        no_signals = rclpy.SignalHandlerOptions.NO
        try:
            rclpy.init(args=list(options.arguments), context=self._context, signal_handler_options=no_signals)
            self.rcl = rclpy.create_node(
                options.name,
                namespace=options.namespace,
                context=self._context,
                use_global_arguments=bool(options.arguments),
                parameter_overrides=[Given("use_sim_time", Given.Type.BOOL, True)] if options.sim_time else [],
            )
        except Exception as error:
            raise MiddlewareError(f"a node of ROS 2 cannot be made: {error}") from None
        self.name = str(self.rcl.get_fully_qualified_name())
        self._clock = self.rcl.get_clock()
        self.simulated = bool(self.rcl.get_parameter("use_sim_time").value)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.rcl)
        self.rcl.create_timer(1.0, self._look)
        self._thread = Thread(target=self._spin, name="ros", daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self.closed:
            try:
                self._executor.spin_once(timeout_sec=0.1)
            except ExternalShutdownException:
                return
            except Exception as error:
                if not self.closed:
                    self.tell(f"ROS 2: {error}")
            while self._later:
                self._later.pop(0)()

    def participant(self, publisher: str, name: str) -> str:
        """What all publishers of a program have in common, of which one has this identifier and a node of this name."""
        return publisher[:_PARTICIPANT] if self._dds and not publisher.startswith("#") else name

    def later(self, what: Callable[[], None]) -> None:
        """Have something done by the node's thread, between two turns."""
        self._later.append(what)

    def _look(self) -> None:
        with self._lock:
            there = list(self._subscriptions)
        for subscription in there:
            subscription.look()

    def left(self, subscription: Ros2Subscription) -> None:
        """A subscription is no more."""
        with self._lock:
            self._subscriptions.remove(subscription)

    def now(self) -> int:
        """Nanoseconds since 1970, or of ``/clock``."""
        return int(self._clock.now().nanoseconds)

    @property
    def ended(self) -> bool:
        """Whether others want the node to end: ROS 2 does not know that."""
        return False

    def publisher(self, topic: str, type_: str, quality: Quality) -> Publisher:
        """A publisher."""
        return Ros2Publisher(self, topic, type_, quality)

    def subscription(self, topic: str, type_: str, quality: Quality, arrived: Arrived) -> Subscription:
        """Listen to a topic."""
        made = Ros2Subscription(self, topic, type_, quality, arrived)
        with self._lock:
            self._subscriptions.append(made)
        return made

    def definition(self, type_: str) -> str:
        """The fields of a type, and of those that it refers to."""
        parts, waiting = dict[str, str](), [type_]
        while waiting:
            name = waiting.pop(0)
            if name not in parts:
                fields = _message(name).get_fields_and_field_types()  # type: ignore[attr-defined]
                written = [(field, _written(type_)) for field, type_ in fields.items()]
                parts[name] = "".join(f"{type_} {field}\n" for field, type_ in written)
                waiting += [base for _, type_ in written if "/" in (base := type_.partition("[")[0])]
        separator = "=" * 80
        return f"{separator}\n".join(text if name == type_ else f"MSG: {name}\n{text}" for name, text in parts.items())

    def resolved(self, topic: str) -> str:
        """The name that a topic has with ROS."""
        return str(self.rcl.resolve_topic_name(topic))

    def topics(self) -> Mapping[str, tuple[str, ...]]:
        """The topics that have publishers, and their types."""
        return {
            topic: tuple(_plain(type_) for type_ in types)
            for topic, types in self.rcl.get_topic_names_and_types()
            if self.rcl.count_publishers(topic)
        }

    def declare(self, parameters: Sequence[Parameter], set_: SetParameters) -> None:
        """Offer parameters."""
        from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult

        for one in parameters:
            ranges = []
            if one.low is not None or one.high is not None:
                low, high = -_HUGE if one.low is None else one.low, _HUGE if one.high is None else one.high
                ranges.append(FloatingPointRange(from_value=low, to_value=high, step=0.0))
            about = ParameterDescriptor(description=one.description, floating_point_range=ranges)
            if self.rcl.has_parameter(one.name):
                self.tell(f"the parameter '{one.name}' is one of ROS itself: it cannot be set from outside")
                continue
            try:
                # what it was started with may be of another type, or out of its bounds
                anything = ParameterDescriptor(dynamic_typing=True)
                given = self.rcl.declare_parameter(one.name, float(one.value), anything).value
                self.rcl.undeclare_parameter(one.name)
                self.rcl.declare_parameter(one.name, float(one.value), about, ignore_override=True)
            except Exception as error:
                self.tell(f"the parameter '{one.name}' is not offered: {error}")
                continue
            self._declared.add(one.name)
            self._start(one, given, set_)

        def asked(given: Sequence[Given]) -> SetParametersResult:
            values = {one.name: float(one.value) for one in given if one.name in self._declared}
            why = None if self._following or not values else set_(values)
            return SetParametersResult(successful=why is None, reason=why or "")

        self.rcl.add_on_set_parameters_callback(asked)

    def _start(self, one: Parameter, given: object, set_: SetParameters) -> None:
        """Set a parameter that the node was started with."""
        if given == one.value:
            return
        if isinstance(given, bool) or not isinstance(given, int | float):
            why: str | None = f"'{one.name}' takes a number"
        else:
            why = set_({one.name: float(given)})
        if why is not None:
            self.tell(f"the parameter '{one.name}' stays {one.value:g}: {why}")
        elif isinstance(given, int | float):
            self._show({one.name: float(given)})

    def follow(self, values: Mapping[str, float]) -> None:
        """Set the node's own parameters to these current values, those that differ."""
        changed = {
            name: value
            for name, value in values.items()
            if name in self._declared and self.rcl.get_parameter(name).value != value
        }
        if changed:
            self.later(lambda: self._show(changed))

    def _show(self, values: Mapping[str, float]) -> None:
        self._following = True
        try:
            self.rcl.set_parameters([Given(name, Given.Type.DOUBLE, value) for name, value in values.items()])
        finally:
            self._following = False

    def parameters_of(self, node: str, names: Sequence[str]) -> Mapping[str, float] | None:
        """Parameters of another node, by its services."""
        from rcl_interfaces.msg import ParameterType
        from rcl_interfaces.srv import GetParameters

        request = GetParameters.Request(names=list(names))
        answer = cast("GetParameters.Response | None", self._call(GetParameters, f"{node}/get_parameters", request))
        if answer is None or len(answer.values) != len(names):
            return None
        found = zip(names, answer.values, strict=True)
        return {name: one.double_value for name, one in found if one.type == ParameterType.PARAMETER_DOUBLE}

    def set_parameters_of(self, node: str, values: Mapping[str, float]) -> str | None:
        """Set parameters of another node, all or none."""
        from rcl_interfaces.srv import SetParametersAtomically

        given = [Given(name, Given.Type.DOUBLE, float(value)).to_parameter_msg() for name, value in values.items()]
        request = SetParametersAtomically.Request(parameters=given)
        answer = cast(
            "SetParametersAtomically.Response | None",
            self._call(SetParametersAtomically, f"{node}/set_parameters_atomically", request),
        )
        if answer is None:
            return f"{node} does not answer"
        return None if answer.result.successful else answer.result.reason or f"{node} refuses it"

    def _call(self, type_: type, name: str, request: object) -> object:
        """What a service answers; None where there is none, or it takes too long."""
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self.rcl.create_client(type_, name)
        if not client.service_is_ready():
            return None
        future, answered = client.call_async(request), Event()
        future.add_done_callback(lambda _: answered.set())
        if not answered.wait(_ANSWER):
            client.remove_pending_request(future)
            return None
        return None if future.exception() is not None else future.result()

    def close(self) -> None:
        """Go, once what was sent has been taken by those who take it for sure."""
        if self.closed:
            return
        with suppress(Exception):
            from rclpy.duration import Duration

            for publisher in list(self.rcl.publishers):
                publisher.wait_for_all_acked(Duration(seconds=0.3))
        self.closed = True
        self._thread.join(5.0)
        if self._thread.is_alive():  # on a busy machine; what it still looks at is not taken from it
            return
        with suppress(Exception):
            self._executor.shutdown(timeout_sec=1.0)
            self.rcl.destroy_node()
            self._context.try_shutdown()


def _policy(event: object) -> str:
    kind = getattr(event, "last_policy_kind", None)
    return str(policy_name(kind)) if kind is not None else "unknown"


def _plain(type_: str) -> str:
    return type_.replace("/msg/", "/")


def _written(type_: str) -> str:
    """A type of a field as a message definition writes it: ``sequence<double>`` is ``float64[]``."""
    match = _ARRAY.fullmatch(type_)
    base, array = type_, ""
    if match is not None:
        base, array = (match[1], "[]") if match[1] is not None else (match[3], f"[{match[4]}]")
    base = re.sub(r"<.*", "", base)
    return f"{_PRIMITIVE.get(base, base)}{array}"
