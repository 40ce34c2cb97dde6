"""How long a step takes: the C backend beside C by hand, NumPy beside NumPy by hand, and Brian2 where it is installed.

In: nothing. Out: a table of microseconds a step and ratios, on standard output. Run it with ``python
benchmarks/runtime.py``; only the ratios of one run can be compared. C by hand is what a careful author would write for
the one network: a loop over neurons, one over the connections of each (CSR), arrays that are made beforehand; it is
compiled by the same compiler with the same flags. "tanh alone" is what the C library takes for the tanh of as many
neurons, on the numbers of a real step: what no program that calls it can be quicker than. All keep every activity, and
every weight that learns, and compute inputs that are expressions in their loop.
"Record" is a whole run as it is called from Python, into arrays that are made for it, and "sim.step" a step of a
Simulation. Brian2 runs ``cpp_standalone`` and keeps nothing.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parent))

from networks_by_hand import all_learning, cpg_rbf, rule
from stepping import cpg_by_hand, random_by_hand, random_network

from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime import c_library
from neurovis_spec.runtime.c_backend import CBackend
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.state import initial_state

Run = Callable[[int], None]
HERE = Path(__file__).resolve().parent
OJA = rule("weight + 0.01 * post * (pre - post * weight)")
_HEAD = "#include <math.h>\n#include <stdint.h>\n#include <string.h>\n"

#: tanh(Σ w·a + bias), connections of delay 1, Oja's rule where they learn
TANH_BY_HAND = """
void run(int64_t steps, int64_t n, int64_t learns, const int32_t *first, const int32_t *source, double *restrict w,
         double *restrict sent, const double *bias, double *restrict a, double *restrict next, double *restrict rows,
         double *restrict kept)
{
    for (int64_t k = 0; k < steps; k++) {
        if (learns)
            memcpy(kept + k*first[n], w, first[n]*sizeof(double));
        for (int64_t i = 0; i < n; i++) {
            double u = 0.0;
            if (learns)
                for (int32_t e = first[i]; e < first[i + 1]; e++)
                    u += sent[e];
            else
                for (int32_t e = first[i]; e < first[i + 1]; e++)
                    u += w[e]*a[source[e]];
            next[i] = tanh(u + bias[i]);
        }
        if (learns)
            for (int64_t i = 0; i < n; i++)
                for (int32_t e = first[i]; e < first[i + 1]; e++) {
                    sent[e] = w[e]*next[source[e]];
                    w[e] += 0.01*next[i]*(a[source[e]] - next[i]*w[e]);
                }
        memcpy(a, next, n*sizeof(double));
        memcpy(rows + k*n, a, n*sizeof(double));
    }
}
"""

#: use case 1: a rhythm of two neurons, eight kernels, an output that learns a target
CPG_BY_HAND = """
void run(int64_t steps, const double *matrix, const double *centres, double *restrict rows, double *restrict kept)
{
    static const int32_t first[11] = {0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20};
    static const int32_t source[20] = {0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1};
    double a[12] = {0}, w[8] = {0}, c[2];
    for (int64_t k = 0; k < steps; k++) {
        memcpy(kept + 8*k, w, sizeof w);
        c[0] = a[0];
        c[1] = a[1];
        for (int i = 0; i < 2; i++) {
            double u = 0.0;
            for (int32_t e = first[i]; e < first[i + 1]; e++)
                u += matrix[e]*c[source[e]];
            a[i] = tanh(u);
        }
        if (k == 0) {
            a[0] = 0.1;
            a[1] = 0.0;
        }
        for (int i = 2; i < 10; i++) {
            double u = 0.0, d;
            for (int32_t e = first[i]; e < first[i + 1]; e++) {
                d = a[source[e]] - centres[e - 4];
                u += d*d;
            }
            d = sqrt(u);
            a[i] = exp(-40.0*(d*d));
        }
        double u = 0.0;
        for (int i = 0; i < 8; i++)
            u += w[i]*a[2 + i];
        a[10] = u;
        const double turn = 2*3.141592653589793*(k + 24)/128.62;
        a[11] = 0.5*sin(turn) + 0.2*sin(2*turn);
        for (int i = 0; i < 8; i++)
            w[i] += 0.01*a[2 + i]*(a[11] - a[10]);
        memcpy(rows + 12*k, a, sizeof a);
    }
}
"""


def loaded(text: str) -> Callable[..., None]:
    """C by hand, compiled as the backend compiles."""
    run: Callable[..., None] = c_library.load(_HEAD + text).run
    return run


def at(array: object) -> ctypes.c_void_p:
    return ctypes.c_void_p(np.asarray(array).ctypes.data)


def rows_of(network: Network) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32], npt.NDArray[np.int64]]:
    """CSR: where each neuron's connections begin, their sources, and which connections they are."""
    targets = network.connections.targets.whole()
    order = np.argsort(targets, kind="stable")
    first = np.searchsorted(targets[order], np.arange(len(network.neurons) + 1)).astype(np.int32)
    return first, network.connections.sources[order].astype(np.int32), order


def tanh_in_c(network: Network) -> Run:
    run, n, m = loaded(TANH_BY_HAND), len(network.neurons), len(network.connections)
    first, source, order = rows_of(network)

    def made(steps: int) -> None:
        w, a, following = network.connections.weights[order].copy(), np.zeros(n), np.zeros(n)
        learns = bool(network.projections)
        rows, kept = ROOM[: steps * n], ROOM[steps * n :]
        numbers = (ctypes.c_int64(steps), ctypes.c_int64(n), ctypes.c_int64(learns))
        arrays = (first, source, w, np.zeros(m), network.neurons.bias, a, following, rows, kept)
        assert len(ROOM) >= steps * (n + m * learns)
        run(*numbers, *map(at, arrays))

    return made


#: the functions of the C library that a step calls, and nothing else
TANH_ALONE = """
void run(int64_t steps, int64_t n, const double *restrict u, double *restrict y)
{
    for (int64_t k = 0; k < steps; k++) {
        const double *now = u + 7*k % n;
        for (int64_t i = 0; i < n; i++)
            y[i] = tanh(now[i]);
    }
}
"""


def tanh_alone(network: Network) -> Run:
    """tanh of what arrives at each neuron after some steps."""
    run, n, links = loaded(TANH_ALONE), len(network.neurons), network.connections
    state, stepper = initial_state(network), CBackend().prepare(network)
    for _ in range(50):
        stepper.step(state, np.zeros(0))
    arriving = links.weights.whole() * state.activity[links.sources.whole()]
    u = np.tile(np.bincount(links.targets.whole(), arriving, n) + network.neurons.bias, 2)

    def made(steps: int) -> None:
        run(ctypes.c_int64(steps), ctypes.c_int64(n), at(u), at(ROOM))

    return made


def cpg_in_c(network: Network) -> Run:
    run = loaded(CPG_BY_HAND)
    matrix, centres = network.connections.weights[np.array([0, 2, 1, 3])], network.connections.centres.whole()
    by_target = centres[4:20].reshape(2, 8).T.ravel().copy()

    def made(steps: int) -> None:
        arrays = (matrix, by_target, ROOM[: 12 * steps], ROOM[12 * steps :])
        run(ctypes.c_int64(steps), *map(at, arrays))

    return made


#: where recordings go: made once, and touched, so that nobody pays for fresh memory
ROOM = np.ones(30_000_000)


def ours_in_c(network: Network) -> Run:
    """Whole runs, as ``record`` makes them: inputs that are expressions are computed within."""
    stepper, n = CBackend().prepare(network), len(network.neurons)
    InputReader(network).leave(stepper)
    inputs = np.ones((20000, network.vector_size))

    def made(steps: int) -> None:
        state, rows = initial_state(network), inputs[:steps]
        assert len(rows) == steps
        activity = ROOM[: steps * n].reshape(steps, n)
        kept = (
            ROOM[steps * n : steps * (n + len(network.changing))].reshape(steps, -1) if len(network.changing) else ROOM
        )
        stepper.run(state, rows, activity, kept, 1, True)

    return made


def one_by_one(network: Network) -> Run:
    """Steps called from Python, one by one."""
    stepper, vector = CBackend().prepare(network), next(InputReader(network).rows(0, 1))
    state = initial_state(network)

    def made(steps: int) -> None:
        step = stepper.step
        for _ in range(steps):
            step(state, vector)

    return made


def simulated(network: Network) -> Run:
    """Steps of a Simulation, one by one."""
    step = Simulation(network, "c").step

    def made(steps: int) -> None:
        for _ in range(steps):
            step()

    return made


def recorded(network: Network, backend: str) -> Run:
    def made(steps: int) -> None:
        record(network, Course(steps, backend=backend))

    return made


def numpy_steps(network: Network) -> Run:
    stepper = NumpyBackend().prepare(network)

    def made(steps: int) -> None:
        state, reader = initial_state(network), InputReader(network)
        with np.errstate(all="ignore"):
            for vector in reader.rows(0, steps):
                stepper.step(state, vector)

    return made


def brian(network: Network, steps: int) -> float:
    """Microseconds a step of the same network in Brian2, NaN where the Python in ``BRIAN_PYTHON`` has none."""
    python = os.environ.get("BRIAN_PYTHON", sys.executable)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "network.npz"
        links = network.connections
        sources, targets, weights = links.sources.whole(), links.targets.whole(), links.weights.whole()
        np.savez(path, sources=sources, targets=targets, weights=weights, bias=network.neurons.bias)
        command = [python, str(HERE / "brian_peer.py"), str(path), str(steps), str(int(bool(network.projections)))]
        done = [subprocess.run(command, capture_output=True, text=True, check=False) for _ in range(2)]
    if any(one.returncode for one in done):
        return float("nan")
    return min(float(one.stdout.split()[-1]) for one in done) / steps * 1e6


def same(case: Case) -> None:
    """Refuse to compare what does not compute the same."""
    n, kept = len(case.network.neurons), []
    for run in (ours_in_c(case.network), case.in_c(case.network)):
        run(case.check)
        kept.append(ROOM[: case.check * n].copy())
    np.testing.assert_allclose(kept[1], kept[0], rtol=0, atol=1e-12, err_msg=case.name)


@dataclass(frozen=True)
class Case:
    """A network, and what stands beside it."""

    name: str
    network: Network
    in_c: Callable[[Network], Run]
    in_numpy: Callable[[Network], Run] | None
    steps: int
    brian: bool = True
    #: steps that are compared: a chaotic network magnifies the last bit
    check: int = 50


def microseconds(runs: dict[str, Run], steps: int, repeats: int = 7) -> dict[str, float]:
    """The best of several runs of each, in turn, a step."""
    best = dict.fromkeys(runs, float("inf"))
    for _ in range(repeats):
        for name, run in runs.items():
            start = time.perf_counter()
            run(steps)
            best[name] = min(best[name], (time.perf_counter() - start) / steps * 1e6)
    return best


def main() -> None:
    cases = (
        Case("12/28, use case 1", cpg_rbf(), cpg_in_c, cpg_by_hand, 20000, False),
        Case("150/200", random_network(150, 200), tanh_in_c, random_by_hand, 10000),
        Case("302/7,000 plastic", all_learning(random_network(302, 7000), OJA), tanh_in_c, None, 1000),
        Case("1,000/10,000", random_network(1000, 10000), tanh_in_c, random_by_hand, 1000),
        Case("10,000/100,000", random_network(10000, 100000), tanh_in_c, random_by_hand, 100),
    )
    heads = (
        "c",
        "c by hand",
        "ratio",
        "tanh",
        "a step",
        "sim.step",
        "above",
        "record",
        "/by hand",
        "numpy",
        "by hand",
        "ratio",
        "brian2",
        "/c",
    )
    print(f"{'µs a step':20}" + "".join(f"{head:>10}" for head in heads))
    for case in cases:
        network = case.network
        same(case)
        runs = {"c": ours_in_c(network), "c by hand": case.in_c(network), "record": recorded(network, "c")}
        runs |= {"a step": one_by_one(network), "sim.step": simulated(network)}
        if case.in_c is tanh_in_c:
            runs["tanh"] = tanh_alone(network)
        found = microseconds(runs, case.steps)
        slower = {"numpy": numpy_steps(network)}
        if case.in_numpy is not None:
            slower["numpy by hand"] = case.in_numpy(network)
        found |= microseconds(slower, max(case.steps // 5, 20), 5)
        if case.brian:
            found["brian2"] = brian(network, case.steps * 2)
        above = found["sim.step"] - found["c"]
        numbers = [found["c"], found["c by hand"], found["c"] / found["c by hand"]]
        numbers += [found.get("tanh", np.nan), found["a step"], found["sim.step"], above]
        numbers += [found["record"], found["record"] / found["c by hand"]]
        numbers += [found["numpy"], found.get("numpy by hand", np.nan)]
        numbers += [found["numpy"] / numbers[-1], found.get("brian2", np.nan)]
        numbers.append(numbers[-1] / found["c"])
        print(f"{case.name:20}" + "".join(f"{'-' if np.isnan(x) else f'{x:.2f}':>10}" for x in numbers), flush=True)


if __name__ == "__main__":
    main()
