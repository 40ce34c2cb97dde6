"""Middleware: what NeuroVis asks of ROS 1 and ROS 2, one small interface.

In: nothing; these are the types, and ``open_node``, which finds the ROS that is there. Messages are bytes as they go
over the wire: ROS 1's serialization, or CDR with its four bytes of encapsulation. ``fields`` knows what is in them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from typing import Final, Literal, NamedTuple, Protocol, TypeAlias

from neurovis_spec.runtime.wire import Encoding

Ros: TypeAlias = Literal[1, 2]
#: the module that each ROS is imported as
MODULES: Final[Mapping[Ros, str]] = {1: "rospy", 2: "rclpy"}


class MiddlewareError(ValueError):
    """No ROS, or one that cannot be used as it is asked for; ``hint`` says what there is to do."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


class Origin(NamedTuple):
    """Who has sent a message. ``who`` is the same on all topics of a publisher, "" where ROS does not say;
    ``connection`` is another one where it begins anew; ``name`` is its node's. ``alone`` asks whether it is the only
    one that is there by now."""

    who: str
    connection: str
    name: str
    alone: Callable[[], bool]


class Arrival(NamedTuple):
    """A message as it came; times in nanoseconds since 1970. ``type`` is what its publisher says that it is
    (``package/Name``), ``sent`` the time at which it was sent, and ``origin`` who has sent it, where the middleware
    knows."""

    data: bytes
    received: int
    sent: int | None
    type: str
    origin: Origin | None = None


#: Called with each message, in a thread of the middleware: it must not wait. What it raises is reported
#: through ``Tell``.
Arrived: TypeAlias = Callable[[Arrival], None]
#: Called with a line about what goes on: a publisher with another quality of service, a master that is away.
Tell: TypeAlias = Callable[[str], None]
#: Called with values for parameters, in the middleware's thread; gives why not, or None when they are set.
SetParameters: TypeAlias = Callable[[Mapping[str, float]], str | None]


@dataclass(frozen=True, slots=True)
class Quality:
    """Quality of service. Of a subscription ``offered`` takes the reliability that publishers have.

    ROS 1 knows depth (as the length of queues) and ``transient_local`` (latched) alone.
    """

    reliability: Literal["reliable", "best_effort", "offered"] = "reliable"
    durability: Literal["volatile", "transient_local"] = "volatile"
    depth: int = 10


#: of the topic with the spec
LATCHED: Final = Quality("reliable", "transient_local", 1)
#: of a display: what it cannot show in time it does not get
DISPLAY: Final = Quality("best_effort", "volatile", 5)
#: of a recorder
RECORDER: Final = Quality("offered", "volatile", 4000)


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a node: its value, its bounds (None where there is none) and what it is."""

    name: str
    value: float
    low: float | None = None
    high: float | None = None
    description: str = ""


class Publisher(Protocol):
    """Sends to a topic."""

    topic: str
    type: str

    @property
    def subscribers(self) -> int:
        """How many there are now."""
        ...

    def publish(self, data: bytes) -> None:
        """Send a message. Nothing is raised where nobody can be reached."""
        ...

    def close(self) -> None:
        """Publish no more."""
        ...


class Subscription(Protocol):
    """Listens to a topic."""

    topic: str

    @property
    def publishers(self) -> int:
        """How many there are now."""
        ...

    def close(self) -> None:
        """Listen no more; after that nothing arrives."""
        ...


class Node(Protocol):
    """A node: it is there until it is closed. Its methods may be called by any thread."""

    ros: Ros
    #: how messages are written
    encoding: Encoding
    #: its name, with its namespace
    name: str
    #: how often it had to be registered anew
    reconnects: int
    #: whether its time is that of ``/clock``
    simulated: bool

    @property
    def ended(self) -> bool:
        """Whether others want the node to end: it goes when it is closed, at the latest after two seconds."""
        ...

    def now(self) -> int:
        """Nanoseconds since 1970; with simulated time, nanoseconds of ``/clock``, 0 before it has begun."""
        ...

    def publisher(self, topic: str, type_: str, quality: Quality) -> Publisher:
        """A publisher of messages of a type (``package/Name``). Raises MiddlewareError where the type's package is
        missing."""
        ...

    def subscription(self, topic: str, type_: str, quality: Quality, arrived: Arrived) -> Subscription:
        """Have ``arrived`` called with every message; in ROS 1 with those of other types, too, as their ``type``
        says; ROS 2 delivers none of these, and the node tells that they are there. Raises MiddlewareError where the
        type's package is missing."""
        ...

    def definition(self, type_: str) -> str:
        """The fields of a type and of all that it refers to, as recordings hold them (``fields`` reads that). Raises
        MiddlewareError where the type's package is missing."""
        ...

    def resolved(self, topic: str) -> str:
        """The name that a topic has with ROS, which may have been told another one (``/from:=/to``)."""
        ...

    def topics(self) -> Mapping[str, tuple[str, ...]]:
        """The topics that have publishers, and their types (``package/Name``), as far as they are known by now."""
        ...

    def declare(self, parameters: Sequence[Parameter], set_: SetParameters) -> None:
        """Offer parameters that others can set: ROS 2's own; in ROS 1 ``NAME/parameters/…`` of the master's server.
        Those that the node was started with are set at once: ROS 2's overrides; in ROS 1 ``~NAME``."""
        ...

    def follow(self, values: Mapping[str, float]) -> None:
        """Set the node's own parameters to these current values, which somebody may have set otherwise than by ROS."""
        ...

    def parameters_of(self, node: str, names: Sequence[str]) -> Mapping[str, float] | None:
        """The parameters of another node that have these names, as they are; None where it offers none. Waits for a
        second at most."""
        ...

    def set_parameters_of(self, node: str, values: Mapping[str, float]) -> str | None:
        """Set parameters of another node; gives why not. ROS 1 does not know whether they are taken: the other node
        puts back what it does not take. Waits for a second at most."""
        ...

    def close(self) -> None:
        """Send what is still to be sent, and go. A second call does nothing."""
        ...


@dataclass(frozen=True, slots=True)
class NodeOptions:
    """How a node is to be opened: its name and namespace, ``ros`` (None: what is there), whether it meets other
    machines, whether its time is that of ``/clock`` (also where ROS is told so: ``use_sim_time``), whether another of
    its name may be there (``anonymous``), ``arguments`` for ROS itself: ``--ros-args -r a:=b -p name:=1``, in ROS 1
    ``a:=b _name:=1``; and for how many ``seconds`` it waits for a master (None: until there is one)."""

    name: str
    namespace: str = "/"
    ros: Ros | None = None
    remote: bool = False
    sim_time: bool = False
    anonymous: bool = False
    arguments: tuple[str, ...] = ()
    seconds: float | None = None
    environment: Mapping[str, str] = field(default_factory=lambda: os.environ)


def choose(asked: Ros | None, environment: Mapping[str, str] = os.environ) -> Ros:
    """Which ROS is used: the one asked for, else that of ``ROS_VERSION`` where both are there, else what is there.
    Raises MiddlewareError where it cannot be imported."""
    there = [ros for ros, module in MODULES.items() if find_spec(module) is not None]
    if asked is not None and asked not in there:
        raise _missing(f"ROS {asked} is not here: the module '{MODULES[asked]}' cannot be imported")
    if not there:
        raise _missing(
            "there is no ROS here: neither of the modules 'rclpy' (ROS 2) and 'rospy' (ROS 1) can be imported"
        )
    if asked is not None:
        return asked
    named = environment.get("ROS_VERSION")
    return 1 if 1 in there and (2 not in there or named == "1") else 2


def _missing(message: str) -> MiddlewareError:
    return MiddlewareError(
        message,
        "source a ROS installation (. /opt/ros/DISTRO/setup.sh) in the environment that NeuroVis is in, or install one "
        'there: pip install "ros-rclpy[fastrtps]" ros-std-msgs, or apt install python3-rospy python3-std-msgs',
    )


def open_node(options: NodeOptions, tell: Tell) -> Node:
    """A node with these options. Raises MiddlewareError."""
    ros = choose(options.ros, options.environment)
    opened: Node = import_module(f"neurovis_spec.ros.ros{ros}").open_node(options, tell)
    return opened
