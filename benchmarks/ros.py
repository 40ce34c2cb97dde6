"""The rates that ``neurovis ros`` holds, the jitter of its steps, and whether three minutes at 1 kHz lose anything.

    make .ros/kilted/made .ros/one/made
    .venv/bin/python benchmarks/ros.py [--quick] [--only rates,jitter,long] [--ros kilted,one]

Rates: ``ros run`` steps at a rate, ``ros view --record`` in another process records; from 100 Hz upwards, until one
does not hold, twice: a message is lost, or more than one step in a hundred began more than half a period late.

At most 2,000 messages wait for a recorder that does not get its turn (``qos: {depth: 2000}``).

Jitter: how far the time between two steps is from the period, in microseconds, from the stamps in the messages; the
median, 99 of 100, the largest. A bare loop makes nothing but the same message: rclpy's timer, or rospy's Rate.

Before each figure stands the load of the machine (what runs or waits to, on so many cores): above one for each core the
figures are of the load. ``--quick`` takes three minutes in place of half an hour.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))

from ros_worlds import World, world  # noqa: E402

from neurovis_spec.arrays import FloatArray  # noqa: E402
from neurovis_spec.ros.bags import read_bag  # noqa: E402
from neurovis_spec.runtime.wire import array_of  # noqa: E402

RATES = (100, 200, 500, 1000, 2000, 5000, 10_000)
#: neurons and how many connections a neuron has; all of them learn, so their weights are sent, too
SIZES = ((12, 2), (150, 2), (1000, 10))
_SPEC = """neurovis: 1
name: random
time: {{steps: 100, dt: 0.001}}
neurons: {{R: {{count: {neurons}, activation: tanh, initial: "uniform(-1, 1)"}}}}
connections:
  R -> R:
    weight: "normal(0, 0.5)"
    pattern: {{random: {{probability: {probability}}}}}
    plasticity: {{oja: {{rate: 0.0001}}}}
ros: {{qos: {{depth: 2000}}}}
"""
#: a loop that makes messages of so many numbers at a rate for so many seconds, and nothing else
_BARE_2 = """
import sys, time, rclpy
from std_msgs.msg import Float64MultiArray
size, rate, seconds = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
rclpy.init()
node = rclpy.create_node("bare")
publisher = node.create_publisher(Float64MultiArray, "/bare", 10)
stamps = []
def step():
    stamps.append(time.time())
    publisher.publish(Float64MultiArray(data=[float(len(stamps)), stamps[-1]] + [0.5] * size))
node.create_timer(1 / rate, step)
end = time.monotonic() + seconds
while time.monotonic() < end:
    rclpy.spin_once(node, timeout_sec=0.1)
print(" ".join(map(repr, stamps)))
"""
_BARE_1 = """
import sys, time, rospy
from std_msgs.msg import Float64MultiArray
size, rate, seconds = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
rospy.init_node("bare", disable_signals=True)
publisher = rospy.Publisher("/bare", Float64MultiArray, queue_size=10, tcp_nodelay=True)
stamps, pace = [], rospy.Rate(rate)
end = time.monotonic() + seconds
while time.monotonic() < end:
    stamps.append(time.time())
    publisher.publish(data=[float(len(stamps)), stamps[-1]] + [0.5] * size)
    pace.sleep()
print(" ".join(map(repr, stamps)))
"""


def load() -> str:
    """The load of the machine in the last minute."""
    return f"{os.getloadavg()[0]:5.1f}"


@dataclass(frozen=True)
class Taken:
    """What a run made and what was recorded of it. ``stamps`` are when its steps began."""

    steps: int
    late: int
    seconds: float
    recorded: int
    lost: int
    stamps: FloatArray

    @property
    def whole(self) -> bool:
        """Whether all was recorded."""
        return self.lost == 0 and self.recorded == self.steps

    def holds(self, rate: float, seconds: float) -> bool:
        """Whether the rate was held."""
        return self.whole and self.late <= self.steps / 100 and self.steps >= 0.99 * rate * seconds


def taken(ros: World, spec: Path, rate: float, seconds: float) -> Taken:
    """Run a spec at a rate, and record it by another process, which is there before and ends after it."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "x.mcap"
        view = ros.neurovis("ros", "view", spec, "--record", file, "--format", "json")
        view.wait_for("ready")
        course = ("--rate", str(rate), "--steps", str(round(rate * seconds)), "--seconds", str(2 * seconds))
        run = ros.neurovis("ros", "run", spec, *course, "--wait", "30", "--format", "json")
        assert run.end(3 * seconds + 60) == 0, run.err
        time.sleep(1)
        assert view.stop() == 0, view.err
        made, seen = run.json(), view.json()
        there = [seen["topics"][name] for name in ("activity", "weights")]
        stamps = [array_of(one.data, one.topic.encoding).data[1] for one in read_bag(file).messages()
                  if one.topic.name.endswith("/activity")]  # fmt: skip
        return Taken(made["steps"], made["late"], made["seconds"], min(one["recorded"] for one in there),
                     sum(one["lost"] for one in there), np.array(stamps))  # fmt: skip


def written(folder: Path, neurons: int, each: int) -> Path:
    """A spec of so many neurons."""
    path = folder / f"random{neurons}.yaml"
    path.write_text(_SPEC.format(neurons=neurons, probability=each / neurons))
    return path


def rates(ros: World, folder: Path, seconds: float, sizes: Sequence[tuple[int, int]]) -> None:
    """The highest rates that hold."""
    print(f"\n{ros.name}: rates, {seconds:g} s each")
    print(f"{'load':>5} {'neurons':>8} {'Hz':>7} {'steps':>8} {'late':>6} {'recorded':>9} {'lost':>6}")
    for neurons, each in sizes:
        spec = written(folder, neurons, each)
        best = 0
        for rate in RATES:
            if not any(held(ros, spec, neurons, rate, seconds) for _ in range(2)):
                break
            best = rate
        print(f"      {neurons:8} {best:7} Hz hold", flush=True)


def held(ros: World, spec: Path, neurons: int, rate: float, seconds: float) -> bool:
    """Try a rate, and tell of it."""
    before, found = load(), taken(ros, spec, rate, seconds)
    counts = f"{found.steps:8} {found.late:6} {found.recorded:9} {found.lost:6}"
    holds = found.holds(rate, seconds)
    print(f"{before} {neurons:8} {rate:7} {counts}{'' if holds else '  does not hold'}", flush=True)
    return holds


def told(name: str, rate: float, stamps: FloatArray) -> str:
    """The jitter of a loop."""
    off = np.abs(np.diff(stamps[len(stamps) // 10 :]) - 1 / rate) * 1e6  # without its beginning
    middle, most = np.percentile(off, [50, 99])
    return f"{name:28} {rate:6g} Hz {len(stamps):7} {middle:8.0f} {most:8.0f} {off.max():9.0f}"


def jitter(ros: World, folder: Path, seconds: float) -> None:
    """The jitter of ``ros run`` beside a bare loop's."""
    spec, size = written(folder, 150, 2), 150
    print(f"\n{ros.name}: jitter in µs, {size} neurons, {seconds:g} s each")
    print(f"{'load':>5} {'':28} {'rate':>9} {'steps':>7} {'median':>8} {'99 %':>8} {'largest':>9}")
    for rate in (100, 1000):
        before = load()
        bare = ros.python(_BARE_1 if ros.ros == 1 else _BARE_2, str(size), str(rate), str(seconds))
        assert bare.end(seconds + 60) == 0, bare.err
        stamps = np.array([float(word) for word in bare.out[-1].split()])
        print(before, told("bare rospy.Rate" if ros.ros == 1 else "bare rclpy timer", rate, stamps), flush=True)
        before = load()
        print(before, told("neurovis ros run", rate, taken(ros, spec, rate, seconds).stamps), flush=True)


def long(ros: World, folder: Path, seconds: float) -> None:
    """A kilohertz for minutes."""
    before, found = load(), taken(ros, written(folder, 150, 2), 1000, seconds)
    print(f"\n{ros.name}: load {before.strip()}, 150 neurons at 1 kHz for {seconds:g} s: {found.steps} steps in "
          f"{found.seconds:.1f} s, {found.late} late, {found.recorded} recorded, {found.lost} lost: "
          f"{'nothing is missing' if found.whole else 'IT IS NOT WHOLE'}", flush=True)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", default="rates,jitter,long")
    parser.add_argument("--ros", default="kilted,one")
    asked = parser.parse_args()
    wanted = asked.only.split(",")
    print(f"{os.cpu_count()} cores, load {load().strip()}")
    with tempfile.TemporaryDirectory() as named:
        folder = Path(named)
        for name in asked.ros.split(","):
            with world(name) as ros:
                if "rates" in wanted:
                    rates(ros, folder, 2 if asked.quick else 10, SIZES)
                if "jitter" in wanted:
                    jitter(ros, folder, 4 if asked.quick else 30)
                if "long" in wanted:
                    long(ros, folder, 10 if asked.quick else 180)


if __name__ == "__main__":
    main()
