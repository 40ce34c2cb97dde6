"""Who may listen: what is set in a node's environment, so that this machine alone meets it.

In: NodeOptions; of ROS 2 what carries its messages. Out: a Reach. ROS's own variables say whom a node looks for, and
not who may speak to it: ROS 2 listens at every address all the same. There a profile of Fast DDS closes the transport.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal, NamedTuple
from urllib.parse import urlsplit

from neurovis_spec.ros.middleware import MiddlewareError, NodeOptions, Tell

_LOCAL: Final = ("localhost", "127.0.0.1", "::1")
_RANGE: Final = "ROS_AUTOMATIC_DISCOVERY_RANGE"
#: how far a node of ROS 2 looks where it is to meet this machine alone
_NEAR: Final = ("", "LOCALHOST", "OFF")
#: what may name other machines, to which a node then speaks whatever the range is
_PEERS: Final = ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER", "ROS2_EASY_MODE")
_PEER_HERE: Final = re.compile(r"((UDP|TCP)v[46]:)?\[?(localhost|127(\.\d+){3}|::1)?\]?(:\d+)?", re.IGNORECASE)
_PROFILE: Final = Path(__file__).with_name("this_machine.xml")


class Carrier(NamedTuple):
    """What carries the messages of ROS 2: the implementation of its middleware (``rmw_…``), and which Fast DDS that is;
    None where it is none."""

    name: str
    fast_dds: Literal[2, 3] | None


class _Profiles(NamedTuple):
    """What names profiles of a Fast DDS: variables, of which the first is ours to set, and a file where it starts."""

    variables: tuple[str, ...]
    file: str


_PROFILES: Final[Mapping[Literal[2, 3], _Profiles]] = {
    2: _Profiles(("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_ENVIRONMENT_FILE"), "DEFAULT_FASTRTPS_PROFILES.xml"),
    3: _Profiles(
        ("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_ENVIRONMENT_FILE"),
        "DEFAULT_FASTDDS_PROFILES.xml",
    ),
}


@dataclass(frozen=True, slots=True)
class Reach:
    """What is set in the environment, and what is taken out of it (None); ``told`` is what a user has to know."""

    environment: Mapping[str, str | None] = field(default_factory=dict)
    told: tuple[str, ...] = ()

    def take(self, tell: Tell) -> None:
        """Make it that of this process."""
        for name, value in self.environment.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        for line in self.told:
            tell(line)


def reach_1(options: NodeOptions) -> Reach:
    """The reach of a node of ROS 1. Raises MiddlewareError for a master on another machine that would not see it."""
    given = options.environment
    if options.remote or given.get("ROS_IP") or given.get("ROS_HOSTNAME"):
        return Reach()
    host = urlsplit(given.get("ROS_MASTER_URI", "")).hostname
    if host is not None and host not in _LOCAL:
        raise MiddlewareError(
            f"ROS_MASTER_URI names another machine, '{host}', which does not see this node",
            "--remote lets other machines listen; or set ROS_IP to the address of this machine that they reach",
        )
    return Reach({"ROS_IP": "127.0.0.1"})


def reach_2(options: NodeOptions, carrier: Carrier, folder: Path) -> Reach:
    """The reach of a node of ROS 2 that starts in a folder."""
    given = options.environment
    if options.remote or given.get(_RANGE, "") not in _NEAR:
        return Reach()
    changed: dict[str, str | None] = {} if given.get(_RANGE) else {_RANGE: "LOCALHOST"}
    told = []
    for name in _PEERS:
        if not all(_PEER_HERE.fullmatch(peer.strip()) for peer in given.get(name, "").split(";")):
            changed[name] = None
            told.append(f"{name} names other machines: with --remote they are met")
    if carrier.fast_dds is None:
        told.append(
            f"{carrier.name} may let other machines listen: it is Fast DDS that is kept to this one"
            " (RMW_IMPLEMENTATION=rmw_fastrtps_cpp)"
        )
    elif (own := _own_profile(given, carrier.fast_dds, folder)) is not None:
        told.append(f"{own} says who may listen, and may let other machines: without it this one alone can")
    else:
        changed[_PROFILES[carrier.fast_dds].variables[0]] = str(_PROFILE)
    return Reach(changed, tuple(told))


def _own_profile(given: Mapping[str, str], fast_dds: Literal[2, 3], folder: Path) -> str | None:
    """What names a profile of the user's own; None where there is none."""
    variables, file = _PROFILES[fast_dds]
    for name in variables:
        if given.get(name):
            return name
    return file if (folder / file).is_file() and given.get("SKIP_DEFAULT_XML_FILE") != "1" else None
