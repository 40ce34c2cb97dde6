"""How long networks with derivatives take: beside Brian2 and PyRates, and beside C and NumPy by hand.

In: ``--peers PYTHON``, a Python that has Brian2 and PyRates (they need another NumPy than we do), or ``PEERS_PYTHON``;
without either, or with ``--no-peers``, the tables are ours alone. Out: three tables on standard output. Run it with
``python benchmarks/dynamics.py``; only the ratios of one run can be compared.

The first table has five networks: the two populations of Wilson and Cowan, a hundred columns of Jansen and Rit, a
CTRNN of a thousand; and two with synapses: a hundred phases, each coupled to all others, after Kuramoto, and the 448
cells of C. elegans (``specs/worm``), with graded synapses and gap junctions. All keep the activity of each neuron at
each step. "Evaluations" are those of all derivatives, a step of dt; "error" is the greatest distance from SciPy's
DOP853 (rtol 1e-11) over all neurons and steps; "alike" is the quotient of what a peer takes and what we take in C with
the same method and dt; "time" is that for the same time of the network, with the quickest of our methods and steps
whose error is no greater.

The second has 216 stiff cells, pairs of half-centres with persistent sodium (Daun, Rubin and Rybak 2009, Journal of
Computational Neuroscience 27:3-36), beside what a careful author would write for this one network in C and in NumPy;
C is compiled by the same compiler with the same flags. The third has the two networks with synapses beside C by hand.
"""

from __future__ import annotations

import argparse
import csv
import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from runtime import at, loaded
from scipy.integrate import solve_ivp
from scipy.sparse import csr_array

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.c_backend import CBackend
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.state import initial_state

HERE = Path(__file__).resolve().parent
Flow = Callable[[float, FloatArray], FloatArray]
Numbers: TypeAlias = FloatArray | IntArray
#: evaluations of all derivatives a step
STAGES = {"euler": 1, "heun": 2, "rk4": 4}
#: our methods, and the dt of each as a multiple of the case's
OURS = (("euler", 1), ("heun", 1), ("rk4", 1), ("rk4", 2), ("rk4", 4), ("rk4", 8), ("rk4", 0.5), ("rk4", 0.25))
PEERS = (("brian2", "euler"), ("brian2", "rk4"), ("pyrates", "euler"), ("pyrates", "DOP853"))
REPEATS = 9


@dataclass(frozen=True)
class Case:
    """A network, its equations, and the numbers that peers are given."""

    #: as ``dynamics_peers.py`` calls it
    network: str
    name: str
    spec: str
    flow: Flow
    #: what is compared, of the states of a row each
    shown: Callable[[FloatArray], FloatArray]
    start: FloatArray
    dt: float
    steps: int
    given: dict[str, Numbers]


def sigmoid(x: FloatArray) -> FloatArray:
    return np.asarray(1 / (1 + np.exp(-x)))


def several(random: np.random.Generator, n: int, each: int) -> npt.NDArray[np.int64]:
    """Targets of n sources, so many different ones each."""
    return np.concatenate([random.choice(n, each, replace=False) for _ in range(n)])


def entries(sources: Numbers, targets: Numbers, weights: FloatArray, more: str = "") -> str:
    """Connections, an entry each."""
    lines = zip(sources.tolist(), targets.tolist(), weights.tolist(), strict=True)
    return "\n".join(f"  - N{i + 1} -> N{j + 1}: {{weight: {w!r}{more}}}" for i, j, w in lines)


def wilson_cowan() -> Case:
    """Two populations that oscillate, 3 s of them."""
    spec = """models:
  population:
    parameters: {a: 1.3, theta: 4}
    let: {S: sigmoid(a*(drive - theta)) - sigmoid(-a*theta)}
    state: {rate: {initial: 0.1, derivative: (-rate + (1 - rate)*S)/0.01}}
    activity: rate
neurons: {N: {count: 2, model: {population: {a: [1.3, 2], theta: [4, 3.7]}}, bias: [1.25, 0]}}
connections: {N -> N: {matrix: [[16, 15], [-12, -3]]}}"""
    weights, bias = np.array([[16.0, 15.0], [-12.0, -3.0]]), np.array([1.25, 0.0])
    slope, threshold = np.array([1.3, 2.0]), np.array([4.0, 3.7])

    def flow(t: float, x: FloatArray) -> FloatArray:
        response = sigmoid(slope * (x @ weights + bias - threshold)) - sigmoid(-slope * threshold)
        return np.asarray((-x + (1 - x) * response) / 0.01)

    given = {"sources": [0, 1, 0, 1], "targets": [0, 0, 1, 1], "weights": [16.0, -12, 15, -3]}
    given |= {"p": bias, "s": slope, "h": threshold, "initial": [0.1, 0.1]}
    numbers = {name: np.asarray(values) for name, values in given.items()}
    return Case("wilson_cowan", "Wilson-Cowan, 2/4", spec, flow, lambda x: x, np.full(2, 0.1), 1e-4, 30000, numbers)


def jansen_rit(n: int = 100) -> Case:
    """Columns of unlike inputs that excite each other by their rates, each five others."""
    random = np.random.default_rng(1)
    sources, targets = np.repeat(np.arange(n), 5), several(random, n, 5)
    weights, bias = random.uniform(0, 10, 5 * n), np.linspace(120, 320, n)
    spec = f"""neurons: {{N: {{count: {n}, model: jansen_rit, bias: {bias.tolist()}}}}}
connections:
{entries(sources, targets, weights)}"""
    matrix = csr_array((weights, (targets, sources)), shape=(n, n))

    def rate(v: FloatArray) -> FloatArray:
        return 5 * sigmoid(0.56 * (v - 6))

    def flow(t: float, x: FloatArray) -> FloatArray:
        y = x.reshape(6, n)
        sent = rate(y[1] - y[2])
        y3 = 325 * sent - 200 * y[3] - 1e4 * y[0]
        y4 = 325 * (matrix @ sent + bias + 108 * rate(135 * y[0])) - 200 * y[4] - 1e4 * y[1]
        return np.concatenate((y[3:].ravel(), y3, y4, 37125 * rate(33.75 * y[0]) - 100 * y[5] - 2500 * y[2]))

    given: dict[str, Numbers] = {"sources": sources, "targets": targets, "weights": weights, "p": bias}
    given["initial"] = np.zeros(n)
    name, start = f"Jansen-Rit × {n}, {5 * n}", np.zeros(6 * n)
    return Case(
        "jansen_rit", name, spec, flow, lambda x: x[:, n : 2 * n] - x[:, 2 * n : 3 * n], start, 5e-4, 4000, given
    )


def ctrnn(n: int = 1000) -> Case:
    """Neurons of a CTRNN, ten connections each."""
    random = np.random.default_rng(2)
    sources, targets = np.repeat(np.arange(n), 10), several(random, n, 10)
    weights, bias, taus = random.normal(0, 0.35, 10 * n), random.normal(0, 0.3, n), random.uniform(0.5, 1.5, n)
    spec = f"""neurons:
  N: {{count: {n}, activation: tanh, model: {{leaky: {{tau: {taus.tolist()}}}}}, bias: {bias.tolist()}}}
connections:
{entries(sources, targets, weights)}"""
    matrix = csr_array((weights, (targets, sources)), shape=(n, n))

    def flow(t: float, v: FloatArray) -> FloatArray:
        return np.asarray((matrix @ np.tanh(v) + bias - v) / taus)

    given: dict[str, Numbers] = {"sources": sources, "targets": targets, "weights": weights, "p": bias}
    given["tau"] = taus
    given["initial"] = np.zeros(n)
    return Case("ctrnn", f"CTRNN, {n}/{10 * n}", spec, flow, np.tanh, np.zeros(n), 0.02, 1000, given)


def kuramoto(n: int = 100) -> Case:
    """Phases of unlike frequencies, each coupled to all others."""
    random = np.random.default_rng(3)
    frequencies, phases, weight = random.normal(1, 0.1, n), random.uniform(0, 6, n), 2 / n
    targets, sources = np.nonzero(~np.eye(n, dtype=np.bool_))
    spec = f"""neurons:
  N: {{count: {n}, model: {{phase_oscillator: {{nu: {frequencies.tolist()}}}}}, initial: {{theta: {phases.tolist()}}}}}
connections: {{N -> N: {{weight: {weight!r}, pattern: all_to_all, synapse: phase}}}}"""

    def flow(t: float, theta: FloatArray) -> FloatArray:
        return np.asarray(2 * np.pi * frequencies + weight * np.sin(theta - theta[:, np.newaxis]).sum(1))

    given: dict[str, Numbers] = {"sources": sources, "targets": targets, "weights": np.full(len(sources), weight)}
    given |= {"p": frequencies, "initial": phases}
    return Case("kuramoto", f"Kuramoto, {n}/{len(sources)}", spec, flow, np.cos, phases, 0.01, 1000, given)


def worm() -> Case:
    """The cells of C. elegans, of which one is touched; a hundredth of the conductance of Kunert, Shlizerman and Kutz a
    contact, or a millisecond were too long for any method here."""
    with (HERE.parent / "specs" / "worm" / "data" / "worm.csv").open(encoding="utf-8", newline="") as file:
        rows = sorted(csv.DictReader(file), key=lambda row: row["kind"])
    cells = list(dict.fromkeys(row[end] for row in rows for end in ("from", "to")))
    place, n = {cell: index for index, cell in enumerate(cells)}, len(cells)
    sources, targets = (np.array([place[row[end]] for row in rows]) for end in ("from", "to"))
    weights, gap = (
        np.array([float(row["contacts"]) for row in rows]),
        np.array([row["kind"] == "electrical" for row in rows]),
    )
    reversals = np.where([row["from"].startswith(("DD", "VD")) for row in rows], -45.0, 0.0)
    current, opens = np.where(np.arange(n) == place["PLML"], 5000.0, 0.0), 1 / 11
    written = [
        entries(sources[some], targets[some], weights[some], f", synapse: {synapse}")
        for some, synapse in (
            (~gap & (reversals == 0), "graded"),
            (~gap & (reversals < 0), "{graded: {E: -45}}"),
            (gap, "gap_junction"),
        )
    ]
    spec = f"""neurons: {{N: {{count: {n}, model: graded, initial: {{v: -35}}, bias: {current.tolist()}}}}}
connections:
{chr(10).join(written)}"""
    size, chemical = (n, n), ~gap
    opened, pulled, joined = (
        csr_array((values[some], (targets[some], sources[some])), shape=size)
        for values, some in ((weights, chemical), (weights * reversals, chemical), (weights, gap))
    )
    gaps = joined.sum(1)

    def flow(t: float, x: FloatArray) -> FloatArray:
        v, s = x[:n], x[n:]
        arriving = pulled @ s - (opened @ s) * v + joined @ v - gaps * v
        slopes = 10 * (-35 - v) + arriving + current, sigmoid(0.125 * (v + 35)) * (1 - s) - 5 * s
        return np.concatenate(slopes)

    given: dict[str, Numbers] = {"sources": sources, "targets": targets, "weights": weights, "reversal": reversals}
    given |= {"kinds": gap.astype(np.int64), "p": current, "initial": np.full(n, -35.0), "s": np.full(n, opens)}
    name, start = f"C. elegans, {n}/{len(rows)}", np.concatenate((np.full(n, -35.0), np.full(n, opens)))
    return Case("worm", name, spec, flow, lambda x: x[:, :n], start, 5e-4, 1000, given)


@dataclass(frozen=True)
class Row:
    """What one tool took with one method."""

    tool: str
    method: str
    dt: float
    seconds: float
    steps: int
    #: of all derivatives, in the whole run
    evaluations: int
    error: float


def best(run: Callable[[], object]) -> float:
    """The seconds of the processor in the quickest of some runs; the first of all is not counted."""
    run()
    found = []
    for _ in range(REPEATS):
        start = time.process_time()
        run()
        found.append(time.process_time() - start)
    return min(found)


def compiled_with(case: Case, method: str, dt: float) -> Network:
    """The network of a case."""
    head = f"neurovis: 1\nname: x\ntime: {{dt: {dt!r}, integrate: {method}}}\n"
    return nv.compile_text(head + case.spec).network


def rows_of(case: Case, peers: str | None) -> list[Row]:
    """All tools on one network."""
    end = case.dt * case.steps
    grid = np.arange(4 * case.steps + 1) * (case.dt / 4)
    exact = case.shown(
        solve_ivp(case.flow, (0, end), case.start, "DOP853", grid, rtol=1e-11, atol=1e-12, max_step=4 * case.dt).y.T
    )
    found = []
    for backend in ("c", "numpy"):
        for method, times in OURS if backend == "c" else OURS[2:3]:
            dt, steps = case.dt * times, round(case.steps / times)
            network = compiled_with(case, method, dt)
            course = Course(steps + 1, backend=backend, keep=Keep(sent=False))
            error = np.abs(record(network, course).activity - exact[:: round(4 * times)]).max()
            seconds = best(lambda network=network, course=course: record(network, course))  # type: ignore[misc]
            found.append(Row(f"ours, {backend}", method, dt, seconds, steps, STAGES[method] * steps, float(error)))
    return found + [one for tool in PEERS if peers for one in [peer(case, *tool, peers, exact[::4])] if one]


def peer(case: Case, tool: str, method: str, python: str, exact: FloatArray) -> Row | None:
    """One peer's; None where it has none."""
    with tempfile.TemporaryDirectory() as folder:
        path, output = Path(folder) / "network.npz", Path(folder) / "shown.npy"
        np.savez(path, dt=case.dt, steps=case.steps, **case.given)  # type: ignore[arg-type]
        command = [python, str(HERE / "dynamics_peers.py"), tool, case.network, str(path), method, str(output)]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            print(f"{tool}: {done.stderr[-300:]}", file=sys.stderr)
            return None
        error = float(np.abs(np.load(output) - exact[:-1]).max())
    seconds, evaluations = done.stdout.split()[-2:]
    return Row(tool, method, case.dt, float(seconds), case.steps, int(evaluations), error)


CASES = {"wilson_cowan": wilson_cowan, "jansen_rit": jansen_rit, "ctrnn": ctrnn, "kuramoto": kuramoto, "worm": worm}


def compare(peers: str | None, names: list[str] | None) -> None:
    """The table of the networks."""
    heads = ("tool", "method", "dt, ms", "µs a step", "evaluations", "error", "alike", "time", "with")
    print("| network | " + " | ".join(heads) + " |\n|" + " --- |" * (len(heads) + 1))
    for name in names or CASES:
        case = CASES[name]()
        rows = rows_of(case, peers)
        for row in rows:
            step, evaluations = row.seconds / row.steps * 1e6, row.evaluations / row.steps
            cells = [row.tool, row.method, f"{row.dt * 1e3:g}", f"{step:.3g}", f"{evaluations:.3g}", f"{row.error:.1e}"]
            print(f"| {case.name} | " + " | ".join(cells + quotients(row, rows)) + " |", flush=True)


def quotients(row: Row, rows: list[Row]) -> list[str]:
    """What a peer takes over what we do: with the same method and dt, and with the quickest of no greater error."""
    ours = [] if row.tool.startswith("ours") else [one for one in rows if one.tool == "ours, c"]
    alike = [f"{row.seconds / one.seconds:.2f}" for one in ours if (one.method, one.dt) == (row.method, row.dt)]
    as_good = [one for one in ours if one.error <= row.error]
    if not as_good:
        return [*(alike or "–"), "–", "–"]
    quickest = min(as_good, key=lambda one: one.seconds)
    return [*(alike or "–"), f"{row.seconds / quickest.seconds:.1f}", f"{quickest.method}, {quickest.dt * 1e3:g} ms"]


# ---- 216 stiff cells -----------------------------------------------------------------------------------------------

CELLS = 216
STIFF = """
neurovis: 1
name: half_centres
time: {{dt: {dt} ms, integrate: {method}}}
models:
  half_centre:
    time: ms
    parameters: {{C: 0.21, gNa: 10, ENa: 50, gL: 2.8, EL: -65, gA: 0.2, epsilon: 0.01}}
    ports: [g, gE]
    let:
      m: 1/(1 + exp((v + 37)/-6))
      hinf: 1/(1 + exp((v + 30)/6))
      rate: epsilon*cosh((v + 30)/12)
      INa: gNa*m*h*(v - ENa)
    state:
      v: {{unit: mV, derivative: (gE - g*v - INa - gL*(v - EL) - gA*v)/C}}
      h: {{derivative: rate*(hinf - h)}}
    outputs: {{s: 1/(1 + exp(-(v + 43)))}}
    activity: v
    send: s
neurons:
  N: {{count: 216, model: {{half_centre: {{gA: 0.15 + 0.0005*i}}}}, initial: {{v: -65 + 0.2*i, h: 0.3 + 0.001*i}}}}
connections:
"""
#: the exponential and the classical method, as one would write them down
STIFF_BY_HAND = """
static double exprel(double x) { return x == 0.0 ? 1.0 : expm1(x)/x; }

static void stage(int32_t n, const double *restrict x, double *restrict f, double *restrict j, double *restrict s,
                  const int32_t *first, const int32_t *source, const double *w, const double *reversal,
                  const double *gA)
{
    for (int32_t i = 0; i < n; i++)
        s[i] = 1.0/(1.0 + exp(-(x[i] + 43.0)));
    for (int32_t i = 0; i < n; i++) {
        double g = 0.0, gE = 0.0;
        for (int32_t e = first[i]; e < first[i + 1]; e++) {
            const double signal = w[e]*s[source[e]];
            g += signal;
            gE += signal*reversal[e];
        }
        const double v = x[i], h = x[n + i], gate = exp((v + 37.0)/-6.0), m = 1.0/(1.0 + gate);
        const double rate = 0.01*cosh((v + 30.0)/12.0);
        f[i] = (gE - g*v - 10.0*m*h*(v - 50.0) - 2.8*(v - -65.0) - gA[i]*v)/0.21;
        f[n + i] = rate*(1.0/(1.0 + exp((v + 30.0)/6.0)) - h);
        if (j) {
            const double dm = -1.0/((1.0 + gate)*(1.0 + gate))*(gate*-0.16666666666666666);
            j[i] = 4.761904761904762*(-g - ((v - 50.0)*(h*(10.0*dm)) + 10.0*m*h) - 2.8 - gA[i]);
            j[n + i] = -rate;
        }
    }
}

void run(int64_t steps, int64_t rk4, double h, const int32_t *first, const int32_t *source, const double *w,
         const double *reversal, const double *gA, double *restrict x, double *restrict rows)
{
    enum {n = 216};
    double f[2*n], j[2*n], s[n], y[2*n], sum[2*n];
    memcpy(rows, x, n*sizeof(double));
    for (int64_t k = 1; k < steps; k++) {
        if (rk4) {
            stage(n, x, sum, 0, s, first, source, w, reversal, gA);
            for (int q = 0; q < 2*n; q++)
                y[q] = x[q] + (h/2.0)*sum[q];
            stage(n, y, f, 0, s, first, source, w, reversal, gA);
            for (int q = 0; q < 2*n; q++) {
                sum[q] += 2.0*f[q];
                y[q] = x[q] + (h/2.0)*f[q];
            }
            stage(n, y, f, 0, s, first, source, w, reversal, gA);
            for (int q = 0; q < 2*n; q++) {
                sum[q] += 2.0*f[q];
                y[q] = x[q] + h*f[q];
            }
            stage(n, y, f, 0, s, first, source, w, reversal, gA);
            for (int q = 0; q < 2*n; q++)
                x[q] += (h/6.0)*(sum[q] + f[q]);
        } else {
            stage(n, x, f, j, s, first, source, w, reversal, gA);
            for (int q = 0; q < 2*n; q++)
                x[q] += h*exprel(h*(j[q] < 0.0 ? j[q] : 0.0))*f[q];
        }
        memcpy(rows + k*n, x, n*sizeof(double));
    }
}
"""


@dataclass(frozen=True)
class Links:
    """Who inhibits (reversal -80 mV) and excites (0 mV) whom; in the order of the spec."""

    sources: IntArray
    targets: IntArray
    weights: FloatArray
    reversals: FloatArray

    @property
    def spec(self) -> str:
        """The connections, an entry each."""
        ends = zip(self.sources + 1, self.targets + 1, self.weights.tolist(), self.reversals, strict=True)
        ports = {-80.0: "{g: 1, gE: -80}", 0.0: "g"}
        return "\n".join(f"  - N{i} -> N{j}: {{weight: {w!r}, port: {ports[float(E)]}}}" for i, j, w, E in ends)


def links() -> Links:
    """Two of each pair inhibit each other, and 18 cells excite one of the next but five pairs."""
    cells, excited = np.arange(CELLS), np.arange(18) * 12
    sources, targets = np.concatenate((cells, excited)), np.concatenate((cells ^ 1, (excited + 12) % CELLS))
    weights = np.concatenate((0.3 + 0.001 * cells, np.full(18, 0.05)))
    return Links(sources, targets, weights, np.where(np.arange(CELLS + 18) < CELLS, -80.0, 0.0))


def stiff_in_c(joined: Links, method: str, dt: float, steps: int) -> Callable[[], FloatArray]:
    """C by hand."""
    order = np.argsort(joined.targets, kind="stable")
    first = np.searchsorted(joined.targets[order], np.arange(CELLS + 1)).astype(np.int32)
    source, w, reversal = joined.sources[order].astype(np.int32), joined.weights[order], joined.reversals[order]
    i, rows, compiled = np.arange(CELLS), np.empty((steps, CELLS)), loaded(STIFF_BY_HAND)
    given = (first, source, w, reversal, 0.15 + 0.0005 * i)

    def run() -> FloatArray:
        x = np.concatenate((-65 + 0.2 * i, 0.3 + 0.001 * i))
        numbers = (ctypes.c_int64(steps), ctypes.c_int64(method == "rk4"), ctypes.c_double(dt))
        compiled(*numbers, *map(at, given), at(x), at(rows))
        return rows

    return run


def stiff_in_numpy(joined: Links, method: str, dt: float, steps: int) -> Callable[[], FloatArray]:
    """NumPy by hand: arrays over all cells."""
    i, rows = np.arange(CELLS), np.empty((steps, CELLS))
    applied, exp, bincount = 0.15 + 0.0005 * i, np.exp, np.bincount
    sources, targets, weights, reversals = joined.sources, joined.targets, joined.weights, joined.reversals

    def stage(x: FloatArray, slopes: bool) -> tuple[FloatArray, FloatArray]:
        v, h = x[:CELLS], x[CELLS:]
        signals = weights * (1 / (1 + exp(-(v + 43))))[sources]
        g, pulled = bincount(targets, signals, CELLS), bincount(targets, signals * reversals, CELLS)
        gate = exp((v + 37) / -6)
        m, rate = 1 / (1 + gate), 0.01 * np.cosh((v + 30) / 12)
        f, j = np.empty(2 * CELLS), np.empty(2 * CELLS)
        f[:CELLS] = (pulled - g * v - 10 * m * h * (v - 50) - 2.8 * (v + 65) - applied * v) / 0.21
        f[CELLS:] = rate * (1 / (1 + exp((v + 30) / 6)) - h)
        if slopes:
            j[:CELLS] = (-g - (v - 50) * h * 10 * (m * m * gate / 6) - 10 * m * h - 2.8 - applied) / 0.21
            j[CELLS:] = -rate
        return f, j

    def run() -> FloatArray:
        x = np.concatenate((-65 + 0.2 * i, 0.3 + 0.001 * i))
        rows[0] = x[:CELLS]
        for k in range(1, steps):
            if method == "rk4":
                one = stage(x, False)[0]
                two = stage(x + dt / 2 * one, False)[0]
                three = stage(x + dt / 2 * two, False)[0]
                x = x + dt / 6 * (one + 2 * two + 2 * three + stage(x + dt * three, False)[0])
            else:
                f, j = stage(x, True)
                z = dt * np.minimum(j, 0)
                x = x + dt * np.divide(np.expm1(z), z, out=np.ones(2 * CELLS), where=z != 0) * f
            rows[k] = x[:CELLS]
        return rows

    return run


def ours_in_c(network: Network, steps: int) -> Callable[[], FloatArray]:
    """The loop of the backend, with all activities kept."""
    stepper, rows = CBackend().prepare(network), np.empty((steps, len(network.neurons)))

    def run() -> FloatArray:
        stepper.run(initial_state(network), np.zeros((steps, 0)), rows, np.empty((steps, 0)), 1, True)
        return rows

    return run


def ours_in_numpy(network: Network, steps: int) -> Callable[[], FloatArray]:
    """Step by step."""
    stepper, rows = NumpyBackend().prepare(network), np.empty((steps, CELLS))

    def run() -> FloatArray:
        state, reader = initial_state(network), InputReader(network)
        with np.errstate(all="ignore"):
            for k, vector in enumerate(reader.rows(0, steps)):
                stepper.step(state, vector)
                rows[k] = state.activity
        return rows

    return run


def stiff(steps: int = 1001) -> None:
    """The table of the stiff cells."""
    heads = ("C", "by hand", "C/by hand", "bits", "numpy", "by hand", "numpy/by hand", "differ by")
    print("\n| method, dt | " + " | ".join(heads) + " |\n|" + " --- |" * (len(heads) + 1))
    joined = links()
    for method, dt in (("exponential", 0.1), ("rk4", 0.01)):
        text = STIFF.format(dt=dt, method=method).lstrip() + joined.spec
        network = nv.compile_text(text).network
        runs = {
            "c": ours_in_c(network, steps),
            "c by hand": stiff_in_c(joined, method, network.dt * 1e3, steps),
            "numpy": ours_in_numpy(network, steps),
            "numpy by hand": stiff_in_numpy(joined, method, dt, steps),
        }
        rows = {name: run().copy() for name, run in runs.items()}
        assert np.isfinite(rows["c"]).all()
        took = quickest_of(runs, steps)
        bits = "equal" if rows["c"].tobytes() == rows["c by hand"].tobytes() else "differ"
        apart = np.abs(rows["numpy"] - rows["numpy by hand"]).max()
        cells = [f"{took['c']:.3g}", f"{took['c by hand']:.3g}", f"{took['c'] / took['c by hand']:.2f}", bits]
        cells += [f"{took['numpy']:.3g}", f"{took['numpy by hand']:.3g}"]
        cells += [f"{took['numpy'] / took['numpy by hand']:.2f}", f"{apart:.0e} mV"]
        print(f"| {method}, {dt} ms | " + " | ".join(cells) + " |", flush=True)


# ---- synapses ------------------------------------------------------------------------------------------------------

#: the loop of a careful author over the stages, with what changes a network's states as ``slopes``
BY_HAND = """
void run(int64_t steps, int64_t rk4, double h, int64_t cells, const int32_t *first, const int32_t *source,
         const double *w, const int32_t *chemical, const double *E, const double *p, double *restrict x,
         double *restrict rows)
{
    static double f[1000], y[1000], sum[1000];
    const int32_t n = (int32_t)cells, all = STATES*n;
    for (int32_t i = 0; i < n; i++)
        rows[i] = SHOWN;
    for (int64_t k = 1; k < steps; k++) {
        slopes(n, x, sum, first, source, w, chemical, E, p);
        if (rk4) {
            for (int32_t q = 0; q < all; q++)
                y[q] = x[q] + (h/2.0)*sum[q];
            slopes(n, y, f, first, source, w, chemical, E, p);
            for (int32_t q = 0; q < all; q++) {
                sum[q] += 2.0*f[q];
                y[q] = x[q] + (h/2.0)*f[q];
            }
            slopes(n, y, f, first, source, w, chemical, E, p);
            for (int32_t q = 0; q < all; q++) {
                sum[q] += 2.0*f[q];
                y[q] = x[q] + h*f[q];
            }
            slopes(n, y, f, first, source, w, chemical, E, p);
            for (int32_t q = 0; q < all; q++)
                x[q] += (h/6.0)*(sum[q] + f[q]);
        } else {
            for (int32_t q = 0; q < all; q++)
                x[q] += h*sum[q];
        }
        for (int32_t i = 0; i < n; i++)
            rows[k*n + i] = SHOWN;
    }
}
"""
#: of each network what is kept, and the derivatives; its first connections, up to ``chemical``, are graded synapses
SLOPES_BY_HAND = {
    "kuramoto": """
#define STATES 1
#define SHOWN cos(x[i])
static void slopes(int32_t n, const double *restrict x, double *restrict f, const int32_t *first,
                   const int32_t *source, const double *w, const int32_t *chemical, const double *E, const double *p)
{
    for (int32_t i = 0; i < n; i++) {
        double u = 0.0;
        for (int32_t e = first[i]; e < first[i + 1]; e++)
            u += w[e]*sin(x[source[e]] - x[i]);
        f[i] = 6.283185307179586*p[i] + u;
    }
}
""",
    "worm": """
#define STATES 2
#define SHOWN x[i]
static void slopes(int32_t n, const double *restrict x, double *restrict f, const int32_t *first,
                   const int32_t *source, const double *w, const int32_t *chemical, const double *E, const double *p)
{
    const double *v = x, *s = x + n;
    for (int32_t i = 0; i < n; i++) {
        double u = 0.0;
        for (int32_t e = first[i]; e < chemical[i]; e++)
            u += w[e]*s[source[e]]*(E[e] - v[i]);
        for (int32_t e = chemical[i]; e < first[i + 1]; e++)
            u += w[e]*(v[source[e]] - v[i]);
        f[i] = 10.0*(-35.0 - v[i]) + (u + p[i]);
        f[n + i] = 1.0/(1.0 + exp(-(0.125*(v[i] + 35.0))))*(1.0 - s[i]) - 5.0*s[i];
    }
}
""",
}


def synapses_in_c(case: Case, method: str) -> Callable[[], FloatArray]:
    """C by hand for a network with synapses."""
    given, n, steps = case.given, len(case.given["p"]), case.steps + 1
    kinds = given.get("kinds", np.zeros(len(given["weights"]), dtype=np.int64))
    reversals = given.get("reversal", np.zeros(len(kinds)))
    order = np.lexsort((-reversals, kinds, given["targets"]))
    targets = given["targets"][order]
    first = np.searchsorted(targets, np.arange(n + 1)).astype(np.int32)
    chemical = (first[:-1] + np.bincount(targets[kinds[order] == 0], minlength=n)).astype(np.int32)
    source, w, reversal = given["sources"][order].astype(np.int32), given["weights"][order], reversals[order]
    arrays, rows = (first, source, w, chemical, reversal, given["p"]), np.empty((steps, n))
    compiled = loaded(SLOPES_BY_HAND[case.network] + BY_HAND)

    def run() -> FloatArray:
        x = case.start.copy()
        numbers = ctypes.c_int64(steps), ctypes.c_int64(method == "rk4"), ctypes.c_double(case.dt), ctypes.c_int64(n)
        compiled(*numbers, *map(at, arrays), at(x), at(rows))
        return rows

    return run


def synapses() -> None:
    """The table of networks with synapses."""
    print("\n| network | method | C | by hand | C/by hand | bits | differ by |\n|" + " --- |" * 7)
    for case in (kuramoto(), worm()):
        for method in ("euler", "rk4"):
            network = compiled_with(case, method, case.dt)
            runs = {"c": ours_in_c(network, case.steps + 1), "by hand": synapses_in_c(case, method)}
            rows = {name: run().copy() for name, run in runs.items()}
            took = quickest_of(runs, case.steps)
            bits = "equal" if rows["c"].tobytes() == rows["by hand"].tobytes() else "differ"
            cells = [f"{took['c']:.3g}", f"{took['by hand']:.3g}", f"{took['c'] / took['by hand']:.2f}", bits]
            print(f"| {case.name} | {method} | " + " | ".join(cells), end="")
            print(f" | {np.abs(rows['c'] - rows['by hand']).max():.0e} |", flush=True)


def quickest_of(runs: dict[str, Callable[[], FloatArray]], steps: int) -> dict[str, float]:
    """The microseconds a step that the quickest run of each takes; they take turns."""
    took = dict.fromkeys(runs, float("inf"))
    for _ in range(2 * REPEATS):
        for name, run in runs.items():
            start = time.process_time()
            run()
            took[name] = min(took[name], (time.process_time() - start) / steps * 1e6)
    return took


def main() -> None:
    parser = argparse.ArgumentParser(description="Networks with derivatives, beside peers and by hand.")
    parser.add_argument("--peers", default=os.environ.get("PEERS_PYTHON"), help="a Python with Brian2 and PyRates")
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument("--only", choices=("compared", "stiff", "synapses"))
    parser.add_argument("--networks", nargs="+", choices=CASES, help="of the first table; all unless said")
    asked = parser.parse_args()
    if asked.only in (None, "compared"):
        peers = asked.peers and str(Path(shutil.which(asked.peers) or asked.peers).absolute())
        compare(None if asked.no_peers else peers, asked.networks)
    if asked.only in (None, "stiff"):
        stiff()
    if asked.only in (None, "synapses"):
        synapses()


if __name__ == "__main__":
    main()
