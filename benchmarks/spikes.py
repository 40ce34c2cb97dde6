"""How long networks that spike take, and what memory, beside Brian2 and NEST.

In: ``--brian2 PYTHON`` and ``--nest PYTHON``, Pythons that have them (``BRIAN2_PYTHON``, ``NEST_PYTHON``); what is not
given is left out. Out: a table on standard output. Run it with ``python benchmarks/spikes.py``; only the ratios of one
run can be compared.

The networks are that of Brunel (2000) with kicks, of 500 and 5,000 neurons (10 % of all connections) and 10,000 (5 %),
that of Vogels and Abbott (2005) with conductances (COBA), and a thousand neurons that come to a thousand others along a
million connections, which learn by the timing of spikes. We make the connections and first values, and peers take the
same; and, without peers, COBA with synapses that bring conductances, each with its own states, or shared. All integrate
exactly, or, where that is not to be had, by exponential Euler (NEST: as its models do), and note every spike.

Times are of the processor, of the loop alone: what a run of all steps takes without what one of a single step takes;
Brian2's (``cpp_standalone``, -O2) is what its clock says of its loop or what its whole program takes, whatever is less.
Tools take turns, and of several runs the quickest counts.
"Compile" is what comes before: from the spec to the end of the first step, and until Brian2's program is built.
"Memory" is the most that a process has had in all; of Brian2, which has two, the larger.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import neurovis_spec as nv
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.state import initial_state

HERE = Path(__file__).resolve().parent
#: of our runs in one process, and of processes that take turns
REPEATS, TURNS = 5, 3


def brunel(n: int, share: float, bias: float = 24.0) -> str:
    """Leaky neurons with kicks, four in five excitatory, that come after 1.5 ms."""
    excitatory, inhibitory = n * 4 // 5, n // 5
    many, few = round(excitatory * share), round(inhibitory * share)
    weight = 80 / many
    lines = [
        f"  {i} -> {j}: {{weight: {w!r}, pattern: {{fixed_indegree: {{count: {count}}}}}, port: kicks,"
        " delay: {seconds: 0.0015}}"
        for i, w, count in (("E", weight, many), ("I", -5 * weight, few))
        for j in "EI"
    ]
    return f"""models:
  neuron:
    time: ms
    parameters: {{tau: 20, threshold: 20, reset: 10, refractory: 2}}
    ports: [kicks]
    state: {{v: {{derivative: (drive - v)/tau, jump: kicks}}}}
    spike: {{when: v >= threshold, set: {{v: reset}}, refractory: refractory, hold: v}}
neurons:
  E: {{count: {excitatory}, model: neuron, bias: {bias}, initial: {{v: "uniform(0, 20)"}}}}
  I: {{count: {inhibitory}, model: neuron, bias: {bias}, initial: {{v: "uniform(0, 20)"}}}}
connections:
{chr(10).join(lines)}"""


def coba(n: int) -> str:
    """Leaky neurons with conductances; a fiftieth of all connections."""
    lines = [
        f"  {i} -> {j}: {{weight: {w}, pattern: {{random: {{probability: 0.02}}}}, port: {port}}}"
        for i, w, port in (("E", 0.3, "excitatory"), ("I", 3.35, "inhibitory"))
        for j in "EI"
    ]
    return f"""models:
  neuron:
    time: ms
    ports: [excitatory, inhibitory]
    state:
      v: {{initial: -60, derivative: (ge*(0 - v) + gi*(-80 - v) - (v + 60) + drive)/20}}
      ge: {{derivative: -ge/5, jump: excitatory}}
      gi: {{derivative: -gi/10, jump: inhibitory}}
    spike: {{when: v > -50, set: {{v: -60}}, refractory: 5, hold: v}}
neurons:
  E: {{count: {n * 4 // 5}, model: neuron, bias: 12, initial: {{v: "uniform(-60, -50)"}}}}
  I: {{count: {n // 5}, model: neuron, bias: 12, initial: {{v: "uniform(-60, -50)"}}}}
connections:
{chr(10).join(lines)}"""


def synapses(n: int, *, shared: bool) -> str:
    """The same with conductances of synapses: of each connection, or of all of an entry at a target."""
    lines = [
        f"  {i} -> E + I: {{weight: {w}, pattern: {{random: {{probability: 0.02}}}}, synapse: {{receptor: {given}}}}}"
        for i, w, given in (("E", 0.3, "{tau: 5, E: 0}"), ("I", 3.35, "{tau: 10, E: -80}"))
    ]
    return f"""models:
  neuron:
    time: ms
    state: {{v: {{initial: -60, derivative: (drive - v - 60)/20}}}}
    spike: {{when: v > -50, set: {{v: -60}}, refractory: 5, hold: v}}
synapses:
  receptor:
    shared: {str(shared).lower()}
    time: ms
    parameters: {{tau: 5, E: 0}}
    state: {{g: {{derivative: -g/tau, on_pre: g + weight}}}}
    signal: g*(E - post.v)
neurons:
  E: {{count: {n * 4 // 5}, model: neuron, bias: 12, initial: {{v: "uniform(-60, -50)"}}}}
  I: {{count: {n // 5}, model: neuron, bias: 12, initial: {{v: "uniform(-60, -50)"}}}}
connections:
{chr(10).join(lines)}"""


def stdp(n: int) -> str:
    """Neurons that all come to all others; pairs of spikes change the weights."""
    return f"""models:
  neuron:
    time: ms
    ports: [kicks]
    state: {{v: {{derivative: (drive - v)/20, jump: kicks}}}}
    spike: {{when: v >= 20, set: {{v: 10}}, refractory: 2, hold: v}}
rules:
  timing:
    time: ms
    state:
      a: {{derivative: -a/20, on_pre: a + 0.0001}}
      b: {{derivative: -b/20, on_post: b - 0.000105}}
    weight: {{on_pre: "clip(weight + b, 0, 0.01)", on_post: "clip(weight + a, 0, 0.01)"}}
neurons:
  A: {{count: {n}, model: neuron, bias: 21, initial: {{v: "uniform(0, 20)"}}}}
  B: {{count: {n}, model: neuron, bias: 20.2, initial: {{v: "uniform(0, 20)"}}}}
connections:
  A -> B: {{weight: 0.005, pattern: all_to_all, port: kicks, delay: 1, plasticity: timing}}"""


@dataclass(frozen=True)
class Case:
    """A network, and how long it runs."""

    name: str
    #: as ``spikes_peers.py`` calls it
    kind: str
    spec: Callable[[], str]
    steps: int
    #: our time over Brian2's at most
    asked: float | None = None


CASES = {
    "brunel500": Case("Brunel, 500", "brunel", lambda: brunel(500, 0.1), 20000, 1.0),
    "brunel5000": Case("Brunel, 5,000", "brunel", lambda: brunel(5000, 0.1), 5000, 0.7),
    "brunel10000": Case("Brunel, 10,000", "brunel", lambda: brunel(10000, 0.05), 3000, 0.7),
    "coba": Case("COBA, 4,000", "coba", lambda: coba(4000), 5000, 0.7),
    "synapses": Case("COBA, 4,000, a synapse each", "coba", lambda: synapses(4000, shared=False), 1000),
    "shared": Case("COBA, 4,000, synapses shared", "coba", lambda: synapses(4000, shared=True), 1000),
    "stdp": Case("STDP, 1,000,000 connections", "stdp", lambda: stdp(1000), 1000, 0.7),
    "silent": Case("silent, 1,000 neurons, 100,000 connections", "brunel", lambda: brunel(1000, 0.1, 10.0), 10000),
    "alone": Case("the neurons alone", "brunel", lambda: brunel(1000, 0.1, 10.0).split("connections:")[0], 10000),
}


def network_of(case: Case) -> Network:
    head = f"neurovis: 1\nname: x\ntime: {{dt: 1e-4, steps: {case.steps}, integrate: exponential}}\n"
    return nv.compile_text(head + case.spec()).network


def ours(key: str, path: str) -> None:
    """In a process of its own: what we take, as JSON on standard output."""
    case, keep = CASES[key], Keep(weights=False, sent=False)
    begun = time.process_time()
    children = os.times().children_user + os.times().children_system
    network = network_of(case)
    every = case.steps  # no row but the first: what is noted are spikes

    def run(steps: int) -> int:
        return len(record(network, Course(steps, backend="c", keep=keep, every=every)).fired.steps)

    run(1)
    compiled = time.process_time() - begun + os.times().children_user + os.times().children_system - children
    took, spikes = {1: float("inf"), case.steps: float("inf")}, 0
    for _ in range(REPEATS):
        for steps in took:
            begun = time.process_time()
            spikes = run(steps)
            took[steps] = min(took[steps], time.process_time() - begun)
    seconds = (took[case.steps] - took[1]) / (case.steps - 1) * case.steps
    print(json.dumps({"seconds": seconds, "compile": compiled, "spikes": spikes, "memory": peak()}))
    if path:
        there = network.connections
        there = network.connections
        v = next(array for own in initial_state(network).cells.values() for array in own.values())
        ends = {"sources": there.sources[:], "targets": there.targets[:], "delays": there.delays[:]}
        numbers = {"v": v, "bias": network.neurons.bias, "weights": there.weights[:], "steps": np.array(case.steps)}
        np.savez(path, **ends, **numbers)  # type: ignore[arg-type]


def peak() -> int:
    """The most bytes that this process has had: ``ru_maxrss`` has what the one before it had."""
    said = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(said["VmHWM"].split()[0]) << 10


def measured(command: list[str]) -> dict[str, float] | None:
    """What a process says of itself; None where it fails, with its last words."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        print(done.stderr[-500:], file=sys.stderr)
        return None
    said: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return said


def rows_of(key: str, peers: dict[str, str]) -> dict[str, dict[str, float]]:
    """What each tool takes for a network, the quickest of its turns."""
    found: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "network.npz")
        commands = {"ours": [sys.executable, __file__, "--ours", key, path]}
        for tool, python in peers.items():
            commands[tool] = [python, str(HERE / "spikes_peers.py"), tool, CASES[key].kind, path]
        for _ in range(TURNS):
            for tool, command in list(commands.items()):
                row = measured(command)
                if row is None:
                    del commands[tool]
                elif tool not in found or row["seconds"] < found[tool]["seconds"]:
                    found[tool] = row
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description="Networks that spike, beside peers.")
    parser.add_argument("--brian2", default=os.environ.get("BRIAN2_PYTHON"), help="a Python with Brian2")
    parser.add_argument("--nest", default=os.environ.get("NEST_PYTHON"), help="a Python with NEST")
    parser.add_argument("--networks", nargs="+", choices=CASES, help="all unless said")
    parser.add_argument("--ours", nargs=2, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.ours:
        ours(*asked.ours)
        return
    heads = ("network", "tool", "µs a step", "ours/its", "asked", "compile, s", "memory, MB", "ours/its", "spikes")
    print("| " + " | ".join(heads) + " |\n|" + " --- |" * len(heads))
    for key in asked.networks or CASES:
        case = CASES[key]
        peers = {tool: python for tool, python in (("brian2", asked.brian2), ("nest", asked.nest)) if python}
        rows = rows_of(key, peers if case.asked else {})
        for tool, row in rows.items():
            mine = rows["ours"]
            ratios = [f"{mine[what] / row[what]:.2f}" if tool != "ours" else "–" for what in ("seconds", "memory")]
            limit = f"{case.asked}" if tool == "brian2" else "–"
            step, memory = row["seconds"] / case.steps * 1e6, row["memory"] / 1e6
            cells = [case.name, tool, f"{step:.3g}", ratios[0], limit, f"{row['compile']:.1f}", f"{memory:.0f}"]
            print("| " + " | ".join([*cells, ratios[1], f"{row['spikes']:.0f}"]) + " |", flush=True)


if __name__ == "__main__":
    main()
