"""How long a step takes: the reference, the NumPy backend, and NumPy written by hand for the same network.

In: nothing. Out: a table of microseconds a step and ratios, on standard output. Run it with
``python benchmarks/stepping.py``; only the ratios of one run can be compared. By hand means what a careful author would
write: index arrays, ``bincount``, one array for each group, nothing that the network does not need.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from networks_by_hand import TANH, Unit, build, cpg_rbf, rewired
from toy_bodies import Cart, carted

import neurovis_spec as nv
from neurovis_spec.compiler.compile import Request, compile_spec
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.shape import read_spec
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.runtime.backend import load
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.embodied import Embodied
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.state import initial_state

Run = Callable[[int], None]


def random_network(n: int, m: int) -> Network:
    """Tanh neurons, random connections of delay 1, sorted by source as a connectome is."""
    random = np.random.default_rng(1)
    ends = sorted(zip(random.integers(0, n, m).tolist(), random.integers(0, n, m).tolist(), strict=True))
    weights = random.normal(0, (n / m) ** 0.5, m).tolist()
    sources, targets = zip(*ends, strict=True)
    return rewired(build([Unit(f"N{i}", TANH, bias=0.01 * i) for i in range(n)]), weights, sources, targets)


def random_by_hand(network: Network) -> Run:
    """Eq. 1 over arrays."""
    connections, n = network.connections, len(network.neurons)
    sources, targets = connections.sources.whole().astype(np.intp), connections.targets.whole().astype(np.intp)
    weights, bias, tanh, bincount = connections.weights.whole(), network.neurons.bias, np.tanh, np.bincount

    def run(steps: int) -> None:
        activity, history = np.zeros(n), np.empty((steps, n))
        for k in range(steps):
            activity = tanh(bincount(targets, weights * activity[sources], n) + bias)
            history[k] = activity

    return run


def cpg_by_hand(network: Network) -> Run:
    """Use case 1 as one would write it: a loop over four groups."""
    connections = network.connections
    matrix = connections.weights[:4].reshape(2, 2)
    centres = connections.centres[4:20].reshape(2, 8)

    def run(steps: int) -> None:
        k = np.arange(steps)
        turn = 2 * np.pi * (k + 24) / 128.62
        target = 0.5 * np.sin(turn) + 0.2 * np.sin(2 * turn)
        rhythm, weights = np.array([0.1, 0.0]), np.zeros(8)
        history, learned = np.empty((steps, 12)), np.empty((steps, 8))
        for t in range(steps):
            if t:
                rhythm = np.tanh((matrix * rhythm[:, None]).sum(axis=0))
            distance = np.sqrt(((rhythm[:, None] - centres) ** 2).sum(axis=0))
            kernels = np.exp(-40 * distance**2)
            output = (weights * kernels).sum()
            history[t, :2], history[t, 2:10], history[t, 10], history[t, 11] = rhythm, kernels, output, target[t]
            learned[t] = weights
            weights = weights + 0.01 * kernels * (target[t] - output)

    return run


def stepping(network: Network, backend: str) -> Run:
    """The backend's step alone."""
    stepper = load(backend).prepare(network)

    def run(steps: int) -> None:
        state, reader = initial_state(network), InputReader(network)
        with np.errstate(all="ignore"):
            for k in range(steps):
                stepper.step(state, reader.at(k))

    return run


def recording(network: Network) -> Run:
    """``record``: inputs, step, watch and record."""

    def run(steps: int) -> None:
        record(network, Course(steps, backend="numpy"))

    return run


def microseconds(run: Run, steps: int, repeats: int = 7) -> float:
    """The best of several runs, a step."""
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        run(steps)
        best = min(best, time.perf_counter() - start)
    return best / steps * 1e6


def setting(path: str, name: str) -> tuple[float, float, int, float]:
    """Setting a parameter beside a step of the NumPy backend, both by hand in one loop: microseconds of each, how many
    numbers follow the parameter, the ratio."""
    network = nv.compile(Path(__file__).resolve().parent.parent / path)
    simulation, values = network.simulator("numpy"), [network.parameters[name] * (1 + 1e-6 * i) for i in range(7)]
    simulation.step()
    settable = network.network.settable
    slot = settable.index[name]
    slots = [slot, *settable.reached([slot], [False] * len(settable.slots))]
    reach = sum(len(settable.bindings[number].indices) for number in settable.bound_to(slots))

    def sets(count: int) -> None:
        for i in range(count):
            simulation.set({name: values[i % 7]})

    def steps(count: int) -> None:
        for _ in range(count):
            simulation.step()

    took, step = microseconds(sets, 2000), microseconds(steps, 2000)
    return took, step, reach, took / step


def many_events(count: int) -> tuple[float, float]:
    """Seconds of the processor to read, and to compile, a spec with so many events that set a parameter."""
    events = "".join(f"  - {{at: {k + 1}, set: {{g: {k * 0.5 + 2}}}}}\n" for k in range(count))
    text = "neurovis: 1\nname: x\nparameters: {g: 1}\nneurons: {A: {count: 12, bias: g}}\nevents:\n" + events
    begin = time.process_time()
    findings = Findings()
    document = read_text(text, "x", findings)
    spec = None if document is None else read_spec(document, findings)
    assert spec is not None
    read = time.process_time()
    assert compile_spec(spec, Request(Path(), Path()), findings) is not None
    return read - begin, time.process_time() - read


def with_a_cart() -> tuple[float, float, float]:
    """A step of a network without a body, with one, and of this alone."""
    compiled, cart = carted(), Cart()
    network, still = compiled.network, np.zeros(3)

    def stepped(simulation: Simulation) -> Run:
        def run(steps: int) -> None:
            for _ in range(steps):
                simulation.step()

        return run

    def alone(steps: int) -> None:
        for _ in range(steps):
            cart.sense()
            cart.advance(network.dt, still)

    embodied = Simulation(network, body=Embodied(network, Cart()))
    bare = Simulation(replace(network, body=None))
    return microseconds(stepped(bare), 5000), microseconds(stepped(embodied), 5000), microseconds(alone, 5000)


def main() -> None:
    cases = (
        ("12/28, use case 1", cpg_rbf(), cpg_by_hand, 20000),
        ("302/7,000", random_network(302, 7000), random_by_hand, 2000),
    )
    print(f"{'µs a step':20}{'reference':>12}{'numpy step':>12}{'numpy record':>14}{'by hand':>10}{'record/hand':>13}")
    for name, network, hand, steps in cases:
        plain = microseconds(stepping(network, "reference"), min(steps // 100, 20), 3)
        step = microseconds(stepping(network, "numpy"), steps)
        whole = microseconds(recording(network), steps)
        peer = microseconds(hand(network), steps)
        print(f"{name:20}{plain:12.1f}{step:12.2f}{whole:14.2f}{peer:10.2f}{whole / peer:13.2f}")
    print(f"\n{'setting a parameter':34}{'numbers':>8}{'set µs':>8}{'step µs':>9}{'set/step':>10}")
    for path, parameter in (("specs/cpg_rbf.yaml", "phi"), ("specs/hexapod/hexapod.yaml", "phi")):
        took, step, reach, ratio = setting(path, parameter)
        print(f"{f'{Path(path).stem}, {parameter}':34}{reach:8}{took:8.2f}{step:9.2f}{ratio:10.2f}")
    bare, embodied, cart = with_a_cart()
    print(f"\nwith a body: {embodied:.2f} µs a step, {bare:.2f} without it, and {cart:.2f} of the body alone")
    read, compiled = many_events(10_000)
    print(f"\n10,000 different set events: read in {read:.2f} s, compiled in {compiled:.2f} s of the processor")


if __name__ == "__main__":
    main()
