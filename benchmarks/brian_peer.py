"""A network of tanh neurons in Brian2, for ``benchmarks/runtime.py``.

In: a ``.npz`` with sources, targets, weights and bias, a number of steps, whether connections learn. Out: the seconds
of the loop, on standard output. It runs in a Python of its own: Brian2 needs another NumPy than we do.
"""

from __future__ import annotations

import sys
import tempfile

import brian2 as b  # type: ignore[import-not-found, unused-ignore]
import numpy as np


def main(path: str, steps: int, plastic: bool) -> None:
    given = np.load(path)
    with tempfile.TemporaryDirectory() as folder:
        b.set_device("cpp_standalone", directory=folder, build_on_run=False)
        b.prefs.codegen.cpp.extra_compile_args_gcc = ["-O2", "-ffp-contract=off", "-w"]
        b.defaultclock.dt = 1 * b.ms
        cells = b.NeuronGroup(len(given["bias"]), "a : 1\nu : 1\nbias : 1")
        cells.bias = given["bias"]
        cells.run_regularly("a = tanh(u + bias)", when="thresholds")
        links = b.Synapses(cells, cells, "w : 1\nsent : 1\nu_post = sent : 1 (summed)")
        links.connect(i=given["sources"], j=given["targets"])
        links.w = given["weights"]
        if plastic:
            links.run_regularly("w += 0.01*a_post*(a_pre - a_post*w)", when="end")
        links.run_regularly("sent = w*a_pre", when="end", order=-1)
        kept = [b.StateMonitor(cells, "a", record=True)]
        if plastic:
            kept.append(b.StateMonitor(links, "w", record=True))
        net = b.Network(cells, links, *kept)
        net.run(steps * b.ms)
        b.device.build(directory=folder, compile=True, run=True, with_output=False)
        print(b.device._last_run_time)


main(sys.argv[1], int(sys.argv[2]), sys.argv[3] == "1")
