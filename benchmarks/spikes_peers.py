"""Networks of ``benchmarks/spikes.py`` in Brian2 and NEST.

In: the tool, the kind of network, a ``.npz`` with its connections (sources, targets, weights, delays in steps), the
first ``v`` and the ``bias`` of each neuron, and the number of steps of 0.1 ms. Out: on standard output, as JSON, the
seconds of the loop, those of what came before, the number of spikes, and the most bytes that a process has had. It runs
in a Python of its own: these tools need another NumPy than we do.

Brian2 is ``cpp_standalone``, compiled with -O2; traces of rules are ``event-driven``, which is its quick way. NEST has
one thread; of networks with conductances or rules it has none that is alike.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

Given = dict[str, np.ndarray]
REPEATS = 5

NEURONS = {
    "brunel": ("dv/dt = (bias - v)/(20*ms) : 1 (unless refractory)", "v >= 20", "v = 10", 2.0, "exact"),
    "coba": (
        """dv/dt = (ge*(0 - v) + gi*(-80 - v) - (v + 60) + bias)/(20*ms) : 1 (unless refractory)
           dge/dt = -ge/(5*ms) : 1
           dgi/dt = -gi/(10*ms) : 1""",
        "v > -50",
        "v = -60",
        5.0,
        "exponential_euler",
    ),
    "stdp": ("dv/dt = (bias - v)/(20*ms) : 1 (unless refractory)", "v >= 20", "v = 10", 2.0, "exact"),
}


def brian2(kind: str, given: Given) -> dict[str, float]:
    import brian2 as b  # type: ignore[import-not-found, unused-ignore]

    begun = time.process_time()
    equations, threshold, reset, refractory, method = NEURONS[kind]
    with tempfile.TemporaryDirectory() as folder:
        b.set_device("cpp_standalone", directory=folder, build_on_run=False)
        b.prefs.codegen.cpp.extra_compile_args_gcc = ["-O2", "-w"]
        b.defaultclock.dt = 0.1 * b.ms
        cells = b.NeuronGroup(
            len(given["v"]),
            equations + "\nbias : 1 (constant)",
            threshold=threshold,
            reset=reset,
            refractory=refractory * b.ms,
            method=method,
        )
        cells.v, cells.bias = given["v"], given["bias"]
        monitor = b.SpikeMonitor(cells)
        links = [links_of(kind, sign, given, cells) for sign in ((1, -1) if kind != "stdp" else (1,))]
        b.Network(cells, monitor, *links).run(int(given["steps"]) * 0.1 * b.ms)
        b.device.build(directory=folder, compile=True, run=False)
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        compiled = time.process_time() - begun + children.ru_utime + children.ru_stime
        took, memory = [], peak()
        for _ in range(REPEATS):
            process = subprocess.Popen(["./main"], cwd=folder, stdout=subprocess.DEVNULL)
            used, seconds = _waited(process)
            memory = max(memory, used)
            loop = float((Path(folder) / "results" / "last_run_info.txt").read_text().split()[0])
            took.append(min(loop, seconds))  # its clock goes on while other processes have the processor
        counted = next((Path(folder) / "results").glob("_dynamic_array_spikemonitor_t_*"), None)
        spikes = 0 if counted is None else counted.stat().st_size // 8
    return {"seconds": min(took), "compile": compiled, "spikes": spikes, "memory": memory}


def _waited(process: subprocess.Popen[bytes]) -> tuple[int, float]:
    """The most bytes that it has had, and its seconds of the processor, when it has ended."""
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit("Brian2's program failed")
    return used.ru_maxrss << 10, used.ru_utime + used.ru_stime


def links_of(kind: str, sign: int, given: Given, cells: object) -> object:
    """The connections whose weights have this sign, or that come from neurons of this kind."""
    import brian2 as b

    some = np.sign(given["weights"]) == sign if kind == "brunel" else np.ones(len(given["weights"]), dtype=np.bool_)
    into = "v"
    if kind == "coba":
        into = "ge" if sign == 1 else "gi"
        some = (given["weights"] < 1) == (sign == 1)
    if kind == "stdp":
        model = """w : 1
                   da/dt = -a/(20*ms) : 1 (event-driven)
                   db/dt = -b/(20*ms) : 1 (event-driven)"""
        before = "v_post += w\na += 0.0001\nw = clip(w + b, 0, 0.01)"
        links = b.Synapses(cells, cells, model, on_pre=before, on_post="b -= 0.000105\nw = clip(w + a, 0, 0.01)")
    else:
        links = b.Synapses(cells, cells, "w : 1", on_pre=f"{into}_post += w")
    links.connect(i=given["sources"][some], j=given["targets"][some])
    links.w = given["weights"][some]
    links.delay = given["delays"][some][0] * 0.1 * b.ms  # all are alike
    return links


def nest(kind: str, given: Given) -> dict[str, float]:
    import nest as n  # type: ignore[import-not-found, unused-ignore]

    if kind != "brunel":
        raise SystemExit("nothing alike")
    begun = time.process_time()
    n.set_verbosity("M_ERROR")
    n.resolution = 0.1
    values = {"tau_m": 20.0, "C_m": 20.0, "E_L": 0.0, "V_th": 20.0, "V_reset": 10.0, "t_ref": 2.0}
    cells = n.Create("iaf_psc_delta", len(given["v"]), values)
    cells.V_m, cells.I_e = given["v"].tolist(), given["bias"].tolist()
    ends = given["sources"] + 1, given["targets"] + 1
    weights, delays = given["weights"].astype(float), given["delays"] * 0.1
    n.Connect(*ends, "one_to_one", {"weight": weights, "delay": delays})
    counter = n.Create("spike_recorder")
    n.Connect(cells, counter)
    n.Prepare()
    n.Run(0.1)
    compiled, start = time.process_time() - begun, time.process_time()
    n.Run(int(given["steps"]) * 0.1)
    seconds = time.process_time() - start
    n.Cleanup()
    return {"seconds": seconds, "compile": compiled, "spikes": counter.n_events, "memory": peak()}


def peak() -> int:
    """The most bytes that this process has had."""
    said = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(said["VmHWM"].split()[0]) << 10


def main(tool: str, kind: str, path: str) -> None:
    given = dict(np.load(path))
    print(json.dumps({"brian2": brian2, "nest": nest}[tool](kind, given)))


main(*sys.argv[1:])
