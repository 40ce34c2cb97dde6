"""ROS 1, over rospy: a node whose messages are bytes, and which outlives its master.

In: NodeOptions. Out: a Node. A process has one node of ROS 1 at most. Once a second a watchdog asks the master whether
the node stands there with all its topics, and registers it anew where it does not: connections that are there stay.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from http.client import HTTPConnection
from itertools import count
from threading import Event, Lock, Thread
from typing import IO, Final, cast
from urllib.parse import urlsplit
from xmlrpc.client import ServerProxy, Transport

import genpy
import rosgraph
import roslib.message
import rospy

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
from neurovis_spec.ros.reach import reach_1
from neurovis_spec.runtime.wire import Encoding

#: seconds between two questions to the master, to the cache of parameters, and until the master counts as away
_WATCH, _LOOK, _AWAY = 1.0, 0.05, 2.0
#: messages that wait for one subscriber before the oldest is given up, where none is to be lost
_QUEUE: Final = 2000
_BUFFER: Final = 1 << 20


def open_node(options: NodeOptions, tell: Tell) -> Node:
    """A node of ROS 1; waits for its master."""
    reach_1(options).take(tell)
    return Ros1Node(options, tell)


class _Timely(Transport):
    """Calls that end, whatever becomes of the master."""

    def make_connection(self, host: tuple[str, dict[str, str]] | str) -> HTTPConnection:
        made = super().make_connection(host)
        made.timeout = _AWAY
        return made


def _class_of(type_: str) -> type:
    package = type_.partition("/")[0]
    try:
        found = roslib.message.get_message_class(type_)
    except (ImportError, ValueError):
        found = None
    if found is None:
        hint = f"apt install python3-{package.replace('_', '-')}, or source the workspace that has it"
        raise MiddlewareError(f"the message type {type_} is missing: there is no package '{package}' with it", hint)
    return cast(type, found)


def _raw(type_: str) -> type:
    """A class of messages of a type that are bytes."""
    real = _class_of(type_)

    def begin(self: object, data: bytes = b"") -> None:
        self.data = data  # type: ignore[attr-defined]

    def serialize(self: object, buffer: IO[bytes]) -> None:
        buffer.write(self.data)  # type: ignore[attr-defined]

    members = {name: getattr(real, name) for name in ("_type", "_md5sum", "_full_text")}
    made = {"__slots__": ["data"], "_slot_types": [], "_has_header": False, "__init__": begin, "serialize": serialize}
    return type("Raw", (genpy.Message,), {**members, **made})


class Ros1Publisher:
    """Sends bytes to a topic."""

    def __init__(self, node: Ros1Node, topic: str, type_: str, quality: Quality) -> None:
        self.type, self._node = type_, node
        self._class = _raw(type_)
        latched = quality.durability == "transient_local"
        queue = quality.depth if quality.reliability == "best_effort" else max(_QUEUE, quality.depth)
        self.handle = rospy.Publisher(topic, self._class, queue_size=queue, latch=latched, tcp_nodelay=True)
        self.topic = str(self.handle.resolved_name)
        there = self.handle.impl.data_class._type  # rospy would send one type in the name of the other
        if there != type_:
            self.handle.unregister()
            raise MiddlewareError(f"{self.topic} cannot be a topic of {type_}: this node publishes {there} on it")

    @property
    def subscribers(self) -> int:
        """How many there are."""
        return int(self.handle.get_num_connections())

    def publish(self, data: bytes) -> None:
        """Send a message."""
        with suppress(rospy.ROSException):  # the node has ended
            self.handle.publish(self._class(data))

    @property
    def waiting(self) -> bool:
        """Whether messages still wait to be sent."""
        return any(getattr(connection, "_queue", ()) for connection in list(self.handle.impl.connections))

    def close(self) -> None:
        """Publish no more."""
        self._node.left(self)
        self.handle.unregister()


class Ros1Subscription:
    """Hands on the bytes of a topic, whatever their type."""

    def __init__(self, node: Ros1Node, topic: str, quality: Quality, arrived: Arrived) -> None:
        self.type, self._node, self._arrived, self._closed = "*", node, arrived, False
        #: who has sent on each connection, by its header, of which each connection has one of its own
        self._origins: list[tuple[Mapping[str, str], Origin]] = []
        self._made = count()
        self.handle = rospy.Subscriber(topic, rospy.AnyMsg, self._take, buff_size=_BUFFER, tcp_nodelay=True)
        self.topic = str(self.handle.resolved_name)

    def _take(self, message: rospy.AnyMsg) -> None:
        if self._closed:
            return
        received = time.time_ns()
        header: Mapping[str, str] = getattr(message, "_connection_header", None) or {}
        try:
            origin = self._origin(header)
            self._arrived(Arrival(bytes(message._buff), received, None, header.get("type", ""), origin))
        except Exception as error:  # one message must not end the node
            self._node.tell(f"{self.topic}: {error}")

    def _origin(self, header: Mapping[str, str]) -> Origin:
        """Who has sent a message: a caller's new connection is one that has begun anew."""
        for known, origin in self._origins:
            if known is header:
                return origin
        who = header.get("callerid", "")
        made = Origin(who, f"{who} {next(self._made)}", who, lambda: self._callers() <= {who})
        there = {id(one.header) for one in self._connections()}
        self._origins = [*(one for one in self._origins if id(one[0]) in there), (header, made)]
        return made

    def _connections(self) -> list[rospy.impl.transport.Transport]:
        return list(self.handle.impl.connections)

    def _callers(self) -> set[str]:
        """Who publishes here by now; a connection that is being made does not say it yet."""
        return {one.header.get("callerid", "") for one in self._connections() if one.header}

    @property
    def publishers(self) -> int:
        """How many there are."""
        return int(self.handle.get_num_connections())

    def close(self) -> None:
        """Listen no more."""
        if not self._closed:
            self._closed = True
            self._node.left(self)
            self.handle.unregister()


class Ros1Node:
    """The node of ROS 1."""

    ros: Ros = 1
    encoding: Encoding = "ros1"

    def __init__(self, options: NodeOptions, tell: Tell) -> None:
        self.tell, self.reconnects, self.closed = tell, 0, False
        self._lock, self._there = Lock(), list[Ros1Publisher | Ros1Subscription]()
        self._prefix, self._set = "", cast("SetParameters | None", None)
        self._seen: dict[str, object] = {}
        self._end, self._gone, self._away, self._ending = Event(), Event(), False, False
        if options.arguments[:1] == ("--ros-args",):
            raise MiddlewareError("ROS 1 does not take '--ros-args'", "write /from:=/to, _NAME:=VALUE")
        uri = os.environ.setdefault("ROS_MASTER_URI", "http://localhost:11311")
        asked = [word.removeprefix("__ns:=") for word in options.arguments if word.startswith("__ns:=")]
        namespace = asked[-1] if asked else options.environment.get("ROS_NAMESPACE") or options.namespace
        os.environ["ROS_NAMESPACE"] = namespace
        rospy.names._set_caller_id(rosgraph.names.make_global_ns(namespace) + options.name)
        if urlsplit(uri).scheme not in ("http", "https") or not urlsplit(uri).hostname:
            raise MiddlewareError(f"ROS_MASTER_URI is no address: '{uri}'", "such as http://localhost:11311")
        self._uri = uri
        self._wait_for_master(options.seconds)
        self.simulated = options.sim_time or self._is_told_to_simulate()
        self._clock = 0 if self.simulated else None
        # rospy prints who has asked the node to end where the summary is printed
        rospy.impl.masterslave.print = partial(print, file=sys.stderr)
        try:
            remaps = ["neurovis", f"__ns:={namespace}", *options.arguments]
            rospy.init_node(
                options.name, remaps, anonymous=options.anonymous, disable_signals=True, disable_rostime=True
            )
        except Exception as error:
            raise MiddlewareError(f"a node of ROS 1 cannot be made: {error}") from None
        rospy.on_shutdown(self._asked_to_end)
        self.name = str(rospy.get_name())
        if self._clock is not None:
            self.subscription("/clock", "rosgraph_msgs/Clock", Quality(), self._tick)
        self._thread = Thread(target=self._watch, name="ros", daemon=True)
        self._thread.start()

    def _master(self) -> ServerProxy:
        return ServerProxy(self._uri, transport=_Timely())

    def _wait_for_master(self, seconds: float | None) -> None:
        """Wait until the master answers, so many seconds at most. Raises MiddlewareError."""
        told, begun = False, time.monotonic()
        while True:
            with suppress(OSError):
                self._ask(lambda master: master.getPid("/neurovis"))
                return
            if seconds is not None and time.monotonic() - begun >= seconds:
                raise MiddlewareError(f"there is no master of ROS 1 at {self._uri}", "roscore starts one")
            if not told:
                self.tell(f"waiting for the master of ROS 1 at {self._uri}")
                told = True
            time.sleep(0.2)

    def _is_told_to_simulate(self) -> bool:
        try:
            return self._ask(lambda master: master.getParam("/neurovis", "/use_sim_time")) is True
        except OSError:  # nobody has said so
            return False

    def _tick(self, arrival: Arrival) -> None:
        if len(arrival.data) == 8:
            seconds, rest = (int.from_bytes(arrival.data[at : at + 4], "little") for at in (0, 4))
            self._clock = seconds * 1_000_000_000 + rest

    def now(self) -> int:
        """Nanoseconds since 1970, or of ``/clock``."""
        return time.time_ns() if self._clock is None else self._clock

    @property
    def ended(self) -> bool:
        """Whether others want the node to end."""
        return self._ending

    def publisher(self, topic: str, type_: str, quality: Quality) -> Publisher:
        """A publisher."""
        made = Ros1Publisher(self, topic, type_, quality)
        with self._lock:
            self._there.append(made)
        return made

    def subscription(self, topic: str, type_: str, quality: Quality, arrived: Arrived) -> Subscription:
        """Listen to a topic, whatever the type of its messages."""
        made = Ros1Subscription(self, topic, quality, arrived)
        with self._lock:
            self._there.append(made)
        return made

    def left(self, what: Ros1Publisher | Ros1Subscription) -> None:
        """A publisher or a subscription is no more."""
        with self._lock:
            self._there.remove(what)

    def definition(self, type_: str) -> str:
        """The fields of a type, and of those that it refers to."""
        return str(_class_of(type_)._full_text)  # type: ignore[attr-defined]

    def resolved(self, topic: str) -> str:
        """The name that a topic has with ROS."""
        return str(rospy.resolve_name(topic))

    def topics(self) -> Mapping[str, tuple[str, ...]]:
        """The topics that have publishers, and their types; none while the master is away."""
        try:
            found = cast("list[tuple[str, str]]", self._ask(lambda master: master.getPublishedTopics(self.name, "")))
        except OSError:
            return {}
        return {topic: (type_,) for topic, type_ in found}

    def _ask(self, what: Callable[[ServerProxy], object]) -> object:
        """What the master answers. Raises OSError."""
        try:
            code, message, value = cast("tuple[int, str, object]", what(self._master()))
        except OSError:
            raise
        except Exception as error:
            raise OSError(str(error)) from None
        if code != 1:
            raise OSError(message)
        return value

    # ---- parameters --------------------------------------------------------------------------------------------

    def declare(self, parameters: Sequence[Parameter], set_: SetParameters) -> None:
        """Offer parameters on the master's server; who sets one there has it set here within a twentieth of a second.
        One that cannot be set is put back."""
        if parameters:
            self._prefix = f"{self.name}/parameters"
            self._values = {one.name: float(one.value) for one in parameters}
            self._start(set_)
            self._announce()
            self._set = set_

    def _start(self, set_: SetParameters) -> None:
        """Set what the node was started with."""
        try:
            given = self._ask(lambda master: master.getParam(self.name, self.name))
        except OSError:  # nothing
            return
        for name, value in given.items() if isinstance(given, dict) else ():
            if name in self._values:
                why = self._refusal({name: value}, set_)
                if why is not None:
                    self.tell(f"the parameter '{name}' stays {self._values[name]:g}: {why}")

    def _announce(self) -> None:
        """Put the parameters on the server, and have it tell of changes."""
        values = dict(self._values)
        self._ask(lambda master: master.setParam(self.name, self._prefix, values))
        self._ask(lambda master: master.subscribeParam(self.name, rospy.core.get_node_uri(), self._prefix))
        self._cache().set(self._prefix, dict(values))
        self._seen = dict(values)

    def _cache(self) -> rospy.impl.paramserver.ParamServerCache:
        return rospy.impl.paramserver.get_param_server_cache()

    def _look(self) -> None:
        """Set what others have set on the server."""
        if self._set is None:
            return
        now = self._on_server()
        changed = {name: value for name, value in now.items() if self._seen.get(name) != value}
        self._seen = now
        changed = {name: value for name, value in changed.items() if value != self._values.get(name)}
        why = self._refusal(changed, self._set) if changed else None
        if why is not None:
            self.tell(f"{self._prefix}: {why}")
        back = {*changed, *self._values.keys() - now.keys()} if why is not None else self._values.keys() - now.keys()
        self._put({name: self._values[name] for name in back if name in self._values})

    def _on_server(self) -> dict[str, object]:
        """The parameters as the server has them, which is what anybody may have made of them."""
        try:
            found = self._cache().get(self._prefix)
        except KeyError:
            return {}
        return dict(found) if isinstance(found, dict) else {}

    def _refusal(self, changed: Mapping[str, object], set_: SetParameters) -> str | None:
        given: dict[str, float] = {}
        for name, value in changed.items():
            if name not in self._values:
                return f"there is no parameter '{name}'"
            if isinstance(value, bool) or not isinstance(value, int | float):
                return f"'{name}' takes a number"
            given[name] = float(value)
        why = set_(given)
        if why is None:
            self._values |= given
        return why

    def _put(self, values: Mapping[str, float]) -> None:
        for name, value in values.items():
            key = f"{self._prefix}/{name}"
            with suppress(OSError):
                self._ask(lambda master, key=key, value=value: master.setParam(self.name, key, value))  # type: ignore[misc]
                self._cache().set(key, value)
                self._seen[name] = value

    def follow(self, values: Mapping[str, float]) -> None:
        """Have parameters show what they are by now."""
        if self._set is not None:
            changed = {name: value for name, value in values.items() if self._values.get(name, value) != value}
            self._values |= changed
            self._put(changed)

    def parameters_of(self, node: str, names: Sequence[str]) -> Mapping[str, float] | None:
        """Parameters of another node, as the master's server has them."""
        try:
            found = self._ask(lambda master: master.getParam(self.name, f"{node}/parameters"))
        except OSError:
            return None
        if not isinstance(found, dict):
            return None
        return {name: float(found[name]) for name in names if isinstance(found.get(name), int | float)}

    def set_parameters_of(self, node: str, values: Mapping[str, float]) -> str | None:
        """Put parameters of another node on the master's server, from where it takes them."""
        try:
            for name, value in values.items():
                key = f"{node}/parameters/{name}"
                self._ask(lambda master, key=key, value=float(value): master.setParam(self.name, key, value))  # type: ignore[misc]
        except OSError as error:
            return f"the master of ROS 1 does not answer ({error})"
        return None

    # ---- the master --------------------------------------------------------------------------------------------

    def _watch(self) -> None:
        due = time.monotonic() + _WATCH
        while not self._end.wait(_LOOK):
            try:
                self._look()
                if time.monotonic() >= due:
                    self._stand()
                    due = time.monotonic() + _WATCH
            except OSError as error:
                if not self._away:
                    self.tell(f"the master of ROS 1 is away ({error}): waiting for it")
                self._away, due = True, time.monotonic() + _WATCH
            except Exception as error:
                self.tell(f"ROS 1: {error}")
                due = time.monotonic() + _WATCH

    def _stand(self) -> None:
        """See that the node stands with the master, with all its topics. Raises OSError where that is away."""
        with self._lock:
            there = list(self._there)
        state = cast("list[list[tuple[str, list[str]]]]", self._ask(lambda master: master.getSystemState(self.name)))
        known = [{topic for topic, nodes in kind if self.name in nodes} for kind in state[:2]]
        missing = [one for one in there if one.topic not in known[isinstance(one, Ros1Subscription)]]
        if self._away:
            self.tell("the master of ROS 1 is back")
        if not missing and not self._away:
            return
        self._away = False
        if missing:
            self.reconnects += 1
            for one in missing:
                self._register(one)
            if self._set is not None:
                self._announce()

    def _register(self, one: Ros1Publisher | Ros1Subscription) -> None:
        """Have the master know a topic of this node again, and this node its publishers."""
        uri = rospy.core.get_node_uri()
        if isinstance(one, Ros1Publisher):
            self._ask(lambda master: master.registerPublisher(self.name, one.topic, one.type, uri))
            return
        publishers: object = self._ask(lambda master: master.registerSubscriber(self.name, one.topic, one.type, uri))
        ServerProxy(uri, transport=_Timely()).publisherUpdate("/master", one.topic, cast("list[str]", publishers))

    def _asked_to_end(self) -> None:
        """Others have the node end (``rosnode kill``): it may say a last word."""
        if not self.closed:
            self._ending = True
            self._gone.wait(_AWAY)

    def _send_rest(self) -> None:
        """Wait until what is to be sent has been."""
        deadline = time.monotonic() + 0.5
        with self._lock:
            publishers = [one for one in self._there if isinstance(one, Ros1Publisher)]
        while any(one.waiting for one in publishers) and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(0.05)  # the last one is with the system by then

    def close(self) -> None:
        """Go, once what waits has been sent."""
        if self.closed:
            return
        self.closed = True
        self._end.set()
        self._send_rest()
        self._gone.set()
        self._thread.join(2 * _AWAY)
        rospy.signal_shutdown("the end")
