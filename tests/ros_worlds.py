"""ROS as it is installed for the tests: ROS 1 of Debian, ROS 2 Kilted and Jazzy, each in an environment of its own.

``make test-ros`` makes the environments; a World is one of them, with a domain or a master of its own.
"""

from __future__ import annotations

import itertools
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
FOLDER = Path(os.environ.get("NEUROVIS_ROS", ROOT / ".ros"))
PEER = Path(__file__).parent / "ros_peer.py"
NAMES = ("kilted", "jazzy", "one")
#: set by the wheels of ROS 2 for their own process, and by whoever runs the tests
_OURS = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE", "PYTHONPATH")
#: domains of ROS 2 whose ports are below those that systems give away
_DOMAINS = 100
_next = itertools.count(os.getpid())
#: a network of 150 neurons, and where its activities are published
BIG = """
neurovis: 1
name: big
time: {dt: 0.001}
neurons: {A: {count: 150, initial: 0}}
"""
BIG_ACTIVITY = "/neurovis/big/activity"
#: a node of ROS 1 that comes when a new master does: seconds from then to the stamps of the first step that it hears
#: of, and of the first whose neuron SEEN (counted from 2) has the value that it sends to ``/target``
NEWCOMER = """
import json, os, socket, time
from urllib.parse import urlsplit
import rospy
from std_msgs.msg import Float64, Float64MultiArray
address = urlsplit(os.environ["ROS_MASTER_URI"])
def there():
    try:
        socket.create_connection((address.hostname, address.port), 1).close()
    except OSError:
        return False
    return True
print("here", flush=True)
while there():
    time.sleep(0.01)
while not there():
    time.sleep(0.01)
back = time.time()
rospy.init_node("newcomer", disable_signals=True)
target = rospy.Publisher("/target", Float64, queue_size=1, latch=True)
target.publish(1.5)
came = []
rospy.Subscriber("/neurovis/arm/activity", Float64MultiArray, lambda message: came.append(message.data))
while not came or came[-1][SEEN] != 1.5:  # the neuron A is what comes in
    time.sleep(0.01)
stamps = [[one[1] for one in came], [one[1] for one in came if one[SEEN] == 1.5]]
print(json.dumps([times[0] - back for times in stamps]), flush=True)
os._exit(0)
"""
#: seconds for what takes one: machines of tests are slow
PATIENCE = 60.0


class Process:
    """A process whose lines are read as they come."""

    def __init__(self, command: Sequence[str | Path], environment: Mapping[str, str]) -> None:
        self._process = subprocess.Popen(
            [str(word) for word in command],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=dict(environment),
            start_new_session=True,
        )
        self.out: list[str] = []
        self.err: list[str] = []
        self._threads = [
            threading.Thread(target=self._read, args=(pipe, lines), daemon=True)
            for pipe, lines in ((self._process.stdout, self.out), (self._process.stderr, self.err))
        ]
        for thread in self._threads:
            thread.start()

    @staticmethod
    def _read(pipe: Any, lines: list[str]) -> None:
        for line in pipe:
            lines.append(line.rstrip("\n"))

    def wait_for(self, text: str | re.Pattern[str], seconds: float = PATIENCE) -> str:
        """The first line, of either stream, that holds a text."""
        pattern = re.compile(re.escape(text)) if isinstance(text, str) else text
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            for line in [*self.err, *self.out]:
                if pattern.search(line):
                    return line
            if self._process.poll() is not None and not any(thread.is_alive() for thread in self._threads):
                break
            time.sleep(0.01)
        raise AssertionError(f"no '{pattern.pattern}' in {self.out} {self.err}")

    def signal(self, number: int) -> None:
        self._process.send_signal(number)

    def interrupt(self) -> None:
        """Press Ctrl-C: all that it has started in its group gets it."""
        os.killpg(self._process.pid, signal.SIGINT)

    @property
    def running(self) -> bool:
        return self._process.poll() is None

    def end(self, seconds: float = PATIENCE) -> int:
        """Wait for the end; the status."""
        try:
            status = self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.kill()
            raise AssertionError(f"it does not end: {self.out} {self.err}") from None
        for thread in self._threads:
            thread.join(5)
        if status < 0:
            print(*self.err, sep="\n")
        return status

    def stop(self) -> int:
        """End it as Ctrl-C does; the status."""
        self.signal(signal.SIGINT)
        return self.end()

    def kill(self) -> None:
        """End it and what it has started, at once."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def json(self) -> Any:
        """The last line, as JSON."""
        assert self.out, self.err
        return json.loads(self.out[-1])


class World:
    """One ROS: its commands, run in its environment."""

    def __init__(self, name: str) -> None:
        self.name, self.ros = name, 1 if name == "one" else 2
        self.bin = FOLDER / name / "bin"
        assert self.bin.is_dir(), f"there is no environment {self.bin.parent}: make test-ros makes it"
        self.processes: list[Process] = []
        kept = {key: value for key, value in os.environ.items() if key not in _OURS and not key.startswith("ROS_")}
        # a crash of ROS says where it was
        self.environment = {**kept, "PYTHONUNBUFFERED": "1", "PYTHONFAULTHANDLER": "1"}
        self._core: Process | None = None
        self._claim: socket.socket | None = None
        if self.ros == 1:
            self.port = free_port()
            uri = f"http://127.0.0.1:{self.port}"
            self.environment |= {"ROS_MASTER_URI": uri, "ROS_LOG_DIR": f"/tmp/neurovis-ros-{self.port}"}
            self.start_core()
        else:
            self._claim, domain = claimed_domain()
            self.environment |= {"ROS_DOMAIN_ID": str(domain)}

    def started(self, command: Sequence[str | Path], **more: str) -> Process:
        """A process in the environment of this world, with more variables."""
        process = Process(command, {**self.environment, **more})
        self.processes.append(process)
        return process

    def start_core(self) -> None:
        """Start the master of ROS 1: ``roscore`` without what it starts besides."""
        environment = {**self.environment, "ROS_IP": "127.0.0.1"}
        command = ["/usr/bin/python3", "/usr/bin/rosmaster", "--core", "-p", str(self.port)]
        self._core = Process(command, environment)
        self.processes.append(self._core)
        deadline = time.monotonic() + PATIENCE
        while True:
            with suppress(OSError), socket.create_connection(("127.0.0.1", self.port)):
                return
            assert time.monotonic() < deadline, self._core.err
            time.sleep(0.02)

    def stop_core(self) -> None:
        """Kill the master of ROS 1."""
        assert self._core is not None
        self._core.kill()

    def neurovis(self, *arguments: str | Path, **environment: str) -> Process:
        """A command of NeuroVis."""
        return self.started([self.bin / "neurovis", *arguments], **environment)

    def peer(self, **plan: object) -> Process:
        """Another node; see ``ros_peer``. It meets this machine alone."""
        alone = {"ROS_IP": "127.0.0.1"} if self.ros == 1 else {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        return self.started([self.bin / "python", PEER, json.dumps({"seconds": PATIENCE, **plan})], **alone)

    def python(self, code: str, *arguments: str) -> Process:
        """A program in this environment."""
        alone = {"ROS_IP": "127.0.0.1"} if self.ros == 1 else {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        return self.started([self.bin / "python", "-c", code, *arguments], **alone)

    def program(self, *command: str | Path) -> Process:
        """A program of the system, which meets this machine alone."""
        return self.started(command, ROS_IP="127.0.0.1")

    def close(self) -> None:
        """Kill what still runs."""
        for process in self.processes:
            process.kill()
        if self._claim is not None:
            self._claim.close()


@contextmanager
def world(name: str) -> Iterator[World]:
    """A world for a block."""
    made = World(name)
    try:
        yield made
    finally:
        made.close()


def in_each(folder: Path, check: Callable[[World, Path], None]) -> None:
    """Check with each ROS at the same time what is mostly waiting, and holds on a busy machine, too. Each check is
    given a folder of its own in ``folder``, which is called as its ROS."""

    def checked(name: str) -> Exception | None:
        try:
            (folder / name).mkdir()
            with world(name) as ros:
                check(ros, folder / name)
        except Exception as error:
            error.add_note(f"with {name}")
            return error
        return None

    with ThreadPoolExecutor(len(NAMES)) as pool:
        errors = [error for error in pool.map(checked, NAMES) if error is not None]
    if errors:
        raise ExceptionGroup("what does not hold", errors)


def claimed_domain() -> tuple[socket.socket, int]:
    """A domain of ROS 2 that no other world in this network has, as long as the socket is open."""
    for _ in range(_DOMAINS):
        domain = 1 + next(_next) % _DOMAINS
        claim = socket.socket(socket.AF_UNIX)
        try:
            claim.bind(f"\0neurovis ROS domain {domain}")
        except OSError:
            claim.close()
            continue
        return claim, domain
    raise AssertionError("all domains of ROS 2 are taken")


def free_port() -> int:
    """A port that nobody listens at."""
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return int(sock.getsockname()[1])


assert sys.platform == "linux", "the tests with ROS run on Linux"
