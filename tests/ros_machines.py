"""Two machines on one: networks of their own, a cable between them, and nothing else that both can reach.

Each is a network namespace with a loopback and one end of a pair of interfaces, and memory of its own: what goes from
one to the other goes over the cable, and nothing leaves the two.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

#: who may make one: root, or, where the system allows that, anybody
_WAYS = (("unshare", "--net", "--mount", "--ipc"), ("unshare", "--map-root-user", "--net", "--mount", "--ipc"))
#: its loopback is up, its shared memory its own; it is there until its input ends
_MACHINE = "mount -t tmpfs tmpfs /dev/shm && ip link set lo up && echo there && exec cat"
_PATH = {"PATH": f"{os.environ['PATH']}:/usr/sbin:/sbin"}


class Machine(NamedTuple):
    """A machine: its address, and what goes before a command that is to run on it."""

    address: str
    inside: tuple[str, ...]


@contextmanager
def two_machines() -> Iterator[tuple[Machine, Machine]]:
    """Two machines, connected, for a block."""
    assert shutil.which("ip", path=_PATH["PATH"]), "two machines need 'ip': apt-get install iproute2"
    way = next((way for way in _WAYS if _made([*way, "true"])), None)
    assert way is not None, "two machines need namespaces of networks: run this as root"
    first = _machine(list(way))
    second = None
    try:
        mapped = ("--user", "--preserve-credentials") if "--map-root-user" in way else ()
        inside = _inside(first, mapped)
        second = _machine([*inside, "unshare", "--net", "--mount", "--ipc"])
        machines = [Machine(f"10.77.0.{one}", _inside(of, mapped)) for one, of in ((1, first), (2, second))]
        cable = f"ip link add cable type veth peer name cable netns {second.pid}"
        for machine, before in zip(machines, (cable, "true"), strict=True):
            route = "ip link set cable up && ip route add 224.0.0.0/4 dev cable"
            done = f"{before} && ip addr add {machine.address}/24 dev cable && {route}"
            assert _made([*machine.inside, "sh", "-c", done]), "the two machines cannot be connected"
        yield machines[0], machines[1]
    finally:
        for one in (first, second):
            if one is not None:
                one.kill()
                one.wait()
                for pipe in (one.stdin, one.stdout):
                    assert pipe is not None
                    pipe.close()


def _made(command: list[str]) -> bool:
    return subprocess.run(command, capture_output=True, check=False, env={**os.environ, **_PATH}).returncode == 0


def _machine(way: list[str]) -> subprocess.Popen[str]:
    made = subprocess.Popen(
        [*way, "sh", "-c", _MACHINE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **_PATH},
    )
    assert made.stdout is not None
    assert made.stdout.readline() == "there\n", "a machine of its own cannot be made here"
    return made


def _inside(machine: subprocess.Popen[str], mapped: tuple[str, ...]) -> tuple[str, ...]:
    return "nsenter", f"--target={machine.pid}", *mapped, "--net", "--mount", "--ipc", f"--wd={Path.cwd()}"
