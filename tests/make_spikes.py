"""Makes ``tests/data/spikes.npz`` anew: what Brian2 makes of the networks below, on the connections and from the
initial values of ours. ``python tests/make_spikes.py`` where Brian2 (2.9), NEST (nest-simulator 3) and
this package are installed; ``test_peer_spikes`` holds our runs against the file, and needs none of them.

A step n of Brian2 is our step n + 1, and its refractory time is ours and a step more. Where a spike is to arrive before
the test of the threshold, as ours with a delay do, its schedule is groups, synapses, thresholds, resets; spikes come
into its queues a step later then, so that its delay is ours less a step."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

import neurovis_spec as nv

Array: TypeAlias = npt.NDArray[np.float64] | npt.NDArray[np.integer]
FILE: Final = Path(__file__).parent / "data" / "spikes.npz"

#: Brunel 2000, scaled: 500 neurons, 25,000 connections whose spikes add to potentials.
BRUNEL: Final = """neurovis: 1
name: brunel
time: {dt: 0.1 ms, steps: 3001, integrate: exponential}
parameters: {J: 2, g: 5}
neurons:
  E: {count: 400, model: {lif: {rest: 0, threshold: 20, reset: 10}}, bias: 24, initial: {v: "uniform(0, 20)"}}
  I: {count: 100, model: {lif: {rest: 0, threshold: 20, reset: 10}}, bias: 24, initial: {v: "uniform(0, 20)"}}
connections:
  E -> E + I: {weight: J, pattern: {fixed_indegree: {count: 40}}, port: pulses, delay: 1.5 ms}
  I -> E + I: {weight: -g*J, pattern: {fixed_indegree: {count: 10}}, port: pulses, delay: 1.5 ms}
"""
#: Vogels and Abbott 2005, as in Brette et al. 2007, scaled: 400 neurons, some 16,000 conductances.
COBA: Final = """neurovis: 1
name: coba
time: {dt: 0.1 ms, steps: 3001, integrate: exponential}
neurons:
  E: {count: 320, model: {lif_conductance: {refractory: 4.9}}, bias: 12, initial: {v: "uniform(-60, -50)"}}
  I: {count: 80, model: {lif_conductance: {refractory: 4.9}}, bias: 12, initial: {v: "uniform(-60, -50)"}}
connections:
  E -> E + I: {weight: 0.3, pattern: {random: {probability: 0.1}}, port: excitatory, delay: DELAY}
  I -> E + I: {weight: 3.35, pattern: {random: {probability: 0.1}}, port: inhibitory, delay: DELAY}
"""
ADEX: Final = (
    "neurovis: 1\nname: adex\ntime: {dt: 0.01 ms}\nros: {rate: 100}\nneurons: {N: {model: adex, bias: 1000}}\n"
)
#: Hodgkin and Huxley's cell with five drives, of which the first does not fire for long; METHOD is rk4 or exponential.
HODGKIN_HUXLEY: Final = """neurovis: 1
name: squid
time: {dt: 0.01 ms, steps: 5001, integrate: METHOD}
ros: {rate: 100}
neurons: {N: {count: 5, model: hodgkin_huxley, bias: [6, 8, 10, 20, 40]}}
"""
#: What Brian2 calls these methods.
METHODS: Final = {"rk4": "rk4", "exponential": "exponential_euler"}
#: The steps, of a millisecond, in which three sources and their targets fire.
PRE: Final = [
    [3, 20, 21, 60, 110, 111, 112, 180],
    [5, 50, 90, 91, 130, 170, 171, 172],
    [10, 11, 12, 13, 14, 15, 150, 199],
]
POST: Final = [
    [5, 22, 55, 61, 100, 113, 150, 178],
    [5, 6, 7, 51, 89, 131, 173, 190],
    [12, 30, 31, 32, 33, 90, 149, 151],
]
STEPS: Final = 220

#: A source that fires in step 10, of a neuron that a spike makes fire, and of one that only takes it.
ORDER: Final = """neurovis: 1
name: order
time: {dt: 0.1 ms, steps: 20, integrate: exponential}
inputs: {at: {spikes: {times: [[0.001]]}}}
neurons:
  S: {model: spike_source, input: at}
  N: {model: {lif: {rest: 0, threshold: 1, reset: 0}}}
  V: {model: {lif: {rest: 0, threshold: 100, reset: 0}}}
connections: {S -> N + V: {weight: 2, port: pulses, delay: DELAY}}
"""


def of_steps(trains: list[list[int]], index: int | None = None) -> str:
    """Spike times for an input, in seconds, of all or one of these trains of milliseconds."""
    chosen = trains if index is None else [trains[index]]
    return "[" + ", ".join("[" + ", ".join(repr(step / 1000) for step in train) + "]" for train in chosen) + "]"


def main() -> None:
    """Make them and write the file."""
    brian2, nest = import_module("brian2"), import_module("nest")
    brian2.prefs.codegen.target = "numpy"
    found = {
        "brunel": delta_network(brian2, nv.compile_text(BRUNEL)),
        "coba_1": conductance_network(brian2, nv.compile_text(COBA.replace("DELAY", "1")), 1),
        "coba_0": conductance_network(brian2, nv.compile_text(COBA.replace("DELAY", "0")), 0),
        **adex(brian2),
        **hodgkin_huxley(brian2),
        "stdp": timing(
            brian2,
            "da/dt = -a/(20*ms) : 1 (clock-driven)\ndb/dt = -b/(20*ms) : 1 (clock-driven)",
            "w += b; a += 0.01",
            "w += a; b -= 0.0105",
        ),
        "stdp_triplet": timing(
            brian2,
            "\n".join(
                f"d{name}/dt = -{name}/({tau}*ms) : 1 (clock-driven)"
                for name, tau in {"r1": 16.8, "r2": 101, "o1": 33.7, "o2": 125}.items()
            ),
            "w -= o1*(0.007 + 0.00023*r2); r1 += 1; r2 += 1",
            "w += r1*(5e-10 + 0.0062*o2); o1 += 1; o2 += 1",
        ),
        "tsodyks_markram": released(brian2),
        "order_brian2": np.array([order_of_brian2(brian2, delay) for delay in (0, 1, 2)]),
        "order_nest": np.array([order_of_nest(nest, delay) for delay in (1, 2)]),
    }
    for name, values in found.items():
        print(name, values.shape)
    np.savez_compressed(FILE, **found, allow_pickle=False)


def delta_network(b: ModuleType, ours: nv.CompiledNetwork) -> Array:
    """(spikes, 2) steps and neurons of BRUNEL."""
    equations = "dv/dt = (24 - v)/(20*ms) : 1 (unless refractory)"
    return spikes_of(b, ours, equations, "v >= 20", "v = 10", 2.1, {"pulses": "v_post += w"}, delay=14)


def conductance_network(b: ModuleType, ours: nv.CompiledNetwork, delay: int) -> Array:
    """The same of COBA; with delay 0 in Brian2's own order."""
    equations = """dv/dt = (ge*(0 - v) + gi*(-80 - v) - (v + 60) + 12)/(20*ms) : 1 (unless refractory)
    dge/dt = -ge/(5*ms) : 1
    dgi/dt = -gi/(10*ms) : 1"""
    kicks = {"excitatory": "ge_post += w", "inhibitory": "gi_post += w"}
    return spikes_of(b, ours, equations, "v >= -50", "v = -60", 5, kicks, delay=0, late=delay > 0)


def spikes_of(
    b: ModuleType,
    ours: nv.CompiledNetwork,
    equations: str,
    threshold: str,
    reset: str,
    refractory: float,
    kicks: dict[str, str],
    delay: int,
    late: bool = True,
) -> Array:
    """(spikes, 2) our steps, neurons. A weight above 0 at the first port, the others at the last."""
    b.start_scope()
    b.defaultclock.dt = 0.1 * b.ms
    first = ["start", "groups", "thresholds", "synapses", "resets", "end"]
    network, begin = ours.network, ours.run(1, states=["E.v", "I.v"])
    cells = b.NeuronGroup(
        len(begin.neurons), equations, threshold=threshold, reset=reset, refractory=refractory * b.ms,
        method="exponential_euler",
    )  # fmt: skip
    cells.v = np.concatenate([begin["E.v"][0], begin["I.v"][0]])
    sources, targets = network.connections.sources.whole(), network.connections.targets.whole()
    weights = network.connections.weights.whole()
    chosen = [sources < begin["E.v"].shape[1], sources >= begin["E.v"].shape[1]]
    made = []
    for own, kick in zip(chosen, [*kicks.values()] * (2 // len(kicks)), strict=True):
        synapses = b.Synapses(cells, cells, "w : 1", on_pre=kick)
        synapses.connect(i=sources[own], j=targets[own])
        synapses.w = weights[own]
        synapses.delay = delay * b.defaultclock.dt
        made.append(synapses)
    monitor = b.SpikeMonitor(cells)
    whole = b.Network(cells, monitor, *made)
    whole.schedule = ["start", "groups", "synapses", "thresholds", "resets", "end"] if late else first
    whole.run(300 * b.ms)
    steps = np.rint(np.asarray(monitor.t / b.defaultclock.dt)).astype(np.int64) + 1
    order = np.lexsort((np.asarray(monitor.i), steps))
    return np.stack([steps, np.asarray(monitor.i)], axis=1)[order].astype(np.uint16)


def adex(b: ModuleType) -> dict[str, Array]:
    """The steps in which ADEX fires in 300 ms, and v and w at every hundredth."""
    b.start_scope()
    b.defaultclock.dt = 0.01 * b.ms
    cell = b.NeuronGroup(
        1,
        """dv/dt = (30*(-70.6 - v) + 30*2*exp((clip(v, -1000, -40.4) + 50.4)/2) - w + 1000)/281/ms : 1
        dw/dt = (4*(clip(v, -1000, -40.4) + 70.6) - w)/144/ms : 1""",
        threshold="v >= -40.4",
        reset="v = -70.6; w += 80.5",
        method="rk4",
    )
    cell.v = -70.6
    spikes, states = b.SpikeMonitor(cell), b.StateMonitor(cell, ["v", "w"], record=True, dt=1 * b.ms)
    b.Network(cell, spikes, states).run(300 * b.ms)
    steps = np.rint(np.asarray(spikes.t / b.defaultclock.dt)).astype(np.int64) + 1
    return {"adex": steps, "adex_states": np.stack([states.v[0], states.w[0]])}


def hodgkin_huxley(b: ModuleType) -> dict[str, Array]:
    """By each method the steps and neurons, (spikes, 2), of HODGKIN_HUXLEY in 50 ms, and v at every hundredth step."""
    b.defaultclock.dt = 0.01 * b.ms
    found = dict[str, Array]()
    for ours, theirs in METHODS.items():
        b.start_scope()
        cells = b.NeuronGroup(
            5,
            """dv/dt = (drive - 120*m*m*m*h*(v - 50) - 36*n*n*n*n*(v + 77) - 0.3*(v + 54.387))/ms : 1
            dm/dt = (1/exprel(-(v + 40)/10)*(1 - m) - 4*exp(-(v + 65)/18)*m)/ms : 1
            dh/dt = (0.07*exp(-(v + 65)/20)*(1 - h) - h/(1 + exp(-(v + 35)/10)))/ms : 1
            dn/dt = (0.1/exprel(-(v + 55)/10)*(1 - n) - 0.125*exp(-(v + 65)/80)*n)/ms : 1
            drive : 1""",
            threshold="v >= 0",
            refractory="v >= 0",
            method=theirs,
        )
        cells.v, cells.m, cells.h, cells.n, cells.drive = -65, 0.0529, 0.5961, 0.3177, [6, 8, 10, 20, 40]
        spikes, states = b.SpikeMonitor(cells), b.StateMonitor(cells, "v", record=True, dt=1 * b.ms)
        b.Network(cells, spikes, states).run(50 * b.ms)
        steps = np.rint(np.asarray(spikes.t / b.defaultclock.dt)).astype(np.int64) + 1
        order = np.lexsort((np.asarray(spikes.i), steps))
        found[f"squid_{ours}"] = np.stack([steps, np.asarray(spikes.i)], axis=1)[order].astype(np.uint16)
        found[f"squid_{ours}_v"] = np.asarray(states.v).T
    return found


def generators(b: ModuleType, trains: list[list[int]]) -> object:
    """What fires in these steps."""
    index = np.concatenate([[number] * len(train) for number, train in enumerate(trains)])
    return b.SpikeGeneratorGroup(len(trains), index, np.concatenate(trains) * b.ms)


def timing(b: ModuleType, traces: str, on_pre: str, on_post: str) -> Array:
    """(STEPS + 1, 3) the weights that each step leaves, with delays of a step."""
    b.start_scope()
    b.defaultclock.dt = 1 * b.ms
    pre, post = generators(b, PRE), generators(b, POST)
    synapses = b.Synapses(pre, post, f"w : 1\n{traces}", on_pre=on_pre, on_post=on_post, method="exact", delay=1 * b.ms)
    synapses.connect(j="i")
    synapses.w = 0.5
    states = b.StateMonitor(synapses, "w", record=True)
    b.Network(pre, post, synapses, states).run((STEPS + 2) * b.ms)
    return np.asarray(states.w).T[1:]


def released(b: ModuleType) -> Array:
    """(STEPS + 1, 3) the sums of what the sources have released until each step, three steps later."""
    b.start_scope()
    b.defaultclock.dt = 1 * b.ms
    pre, target = generators(b, PRE), b.NeuronGroup(3, "total : 1")
    synapses = b.Synapses(
        pre,
        target,
        "du/dt = -u/(1000*ms) : 1 (clock-driven)\ndx/dt = (1 - x)/(800*ms) : 1 (clock-driven)",
        on_pre="u += 0.5*(1 - u); total_post += 2*u*x; x -= u*x",
        method="exact",
        delay=3 * b.ms,
    )
    synapses.connect(j="i")
    synapses.x = 1
    states = b.StateMonitor(target, "total", record=True)
    b.Network(pre, target, synapses, states).run((STEPS + 2) * b.ms)
    return np.asarray(states.total).T[1:]


def order_of_brian2(b: ModuleType, delay: int) -> list[int]:
    """As ORDER: by how many steps later the potential has a spike, and a neuron fires of it, in Brian2's own order."""
    b.start_scope()
    b.defaultclock.dt = 0.1 * b.ms
    source = b.SpikeGeneratorGroup(1, [0], [1] * b.ms)
    cells = b.NeuronGroup(2, "dv/dt = -v/(20*ms) : 1\nhigh : 1", threshold="v >= high", reset="v = 0", method="exact")
    cells.high = [1, 100]
    synapses = b.Synapses(source, cells, on_pre="v_post += 2", delay=delay * b.defaultclock.dt)
    synapses.connect()
    told, spikes = b.SpikeMonitor(source), b.SpikeMonitor(cells)
    states = b.StateMonitor(cells, "v", record=[1], when="end")
    b.Network(source, cells, synapses, told, spikes, states).run(3 * b.ms)
    begin, fires = (round(float(monitor.t[0] / b.defaultclock.dt)) for monitor in (told, spikes))
    return [int(np.flatnonzero(states.v[0] > 1)[0]) - begin, fires - begin]


def order_of_nest(nest: ModuleType, delay: int) -> list[int]:
    """The same in NEST (3.8), where there is no delay 0; the source is driven to its threshold, and takes no spike."""
    nest.ResetKernel()
    nest.set_verbosity("M_ERROR")
    nest.set(resolution=0.1)
    about = {"E_L": 0.0, "V_m": 0.0, "V_reset": 0.0, "tau_m": 20.0}
    source = nest.Create("iaf_psc_delta", params={**about, "V_th": 1.0, "I_e": 300.0, "t_ref": 50.0})
    cells = nest.Create("iaf_psc_delta", 2, params=[{**about, "V_th": 1.0}, {**about, "V_th": 100.0}])
    meter = nest.Create("voltmeter", params={"interval": 0.1})
    told, spikes = nest.Create("spike_recorder", 2)
    nest.Connect(source, cells, syn_spec={"weight": 2.0, "delay": 0.1 * delay})
    nest.Connect(source, told)
    nest.Connect(cells, spikes)
    nest.Connect(meter, cells[1])
    nest.Simulate(5.0)
    begin, fires = (round(float(recorder.events["times"][0]) / 0.1) for recorder in (told, spikes))
    times = meter.events["times"][meter.events["V_m"] > 1]
    return [round(float(times[0]) / 0.1) - begin, fires - begin]


if __name__ == "__main__":
    main()
