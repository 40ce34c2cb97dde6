"""The synapses of the library, and what they make of its models: each against a closed form, an integrator of high
order, or the formulas of its paper."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
from examples import SPECS
from scipy.integrate import solve_ivp

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.manual.builtins import builtins
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record

Flow = Callable[[float, FloatArray], FloatArray]


def run(spec: str, time: str, steps: int, state: str = "") -> FloatArray:
    """The activities at steps 0 to ``steps``, or what is named of states and outputs: a row a step."""
    shown = f"outputs: {{shown: {state}}}\n" if state else ""
    found = record(
        nv.compile_text(f"neurovis: 1\nname: x\ntime: {time}\n{spec}\n{shown}").network,
        Course(steps + 1, backend="numpy"),
    )
    return found[state].reshape(steps + 1, -1) if state else found.activity


def solved(flow: Flow, start: FloatArray, end: float, points: int, method: str = "DOP853") -> FloatArray:
    """The solution of an equation at so many points from 0 to an end, in a row each."""
    at = np.linspace(0, end, points)
    found = solve_ivp(flow, (0, end), start, method, at, rtol=1e-11, atol=1e-11)
    return np.asarray(found.y.T, dtype=np.float64)


def sigmoid(x: FloatArray) -> FloatArray:
    return np.asarray(1 / (1 + np.exp(-x)), dtype=np.float64)


def exprel(x: FloatArray) -> FloatArray:
    return np.asarray(np.expm1(x) / x, dtype=np.float64)


# ---- each synapse --------------------------------------------------------------------------------------------------


def test_gap_junctions_and_diffusion_share_what_two_have() -> None:
    """In closed form: the difference of two leaky cells falls as exp(-(1 + 2w)t), their sum as exp(-t)."""
    t = np.linspace(0, 1, 101)
    for synapse in ("gap_junction", "diffusive"):
        spec = f"""neurons: {{N: {{count: 2, model: leaky, initial: {{v: [3, 1]}}}}}}
connections: {{N -> N: {{weight: 2, pattern: all_to_all, synapse: {synapse}}}}}"""
        found = run(spec, "{dt: 0.01}", 100)
        assert np.abs(found.sum(axis=1) - 4 * np.exp(-t)).max() < 1e-9
        assert np.abs(found[:, 0] - found[:, 1] - 2 * np.exp(-5 * t)).max() < 1e-7


def test_a_graded_conductance_is_open_as_far_as_its_source_says() -> None:
    """In closed form: a source that sends 0.25 pulls a cell of leak 1 with the conductance 4 · 0.25 towards -80."""
    spec = """neurons: {S: {bias: 0.25}, N: {model: ltc}}
connections: {S -> N: {weight: 4, synapse: {graded: {E: -80}}, delay: 0}}"""
    found = run(spec, "{dt: 0.01}", 100)[:, 1]
    assert np.abs(found + 40 * (1 - np.exp(-2 * np.linspace(0, 1, 101)))).max() < 3e-8


def test_a_phase_follows_another_by_its_lag() -> None:
    """In closed form: the difference to what the lag says turns as that of one pendulum without mass."""
    spec = """neurons: {N: {count: 2, model: phase_oscillator, initial: {theta: [0, 2]}}}
connections: {N1 -> N2: {weight: 3, synapse: {phase: {lag: 0.5}}}}"""
    theta = run(spec, "{dt: 0.005}", 400, "N.theta")
    away = 2 * np.arctan(np.tan(1.25) * np.exp(-3 * np.linspace(0, 2, 401)))  # of theta2 from theta1 - 0.5
    assert np.abs(theta[:, 1] - theta[:, 0] + 0.5 - away).max() < 1e-9


def test_each_names_its_source_and_what_its_parameters_are() -> None:
    synapses = [one for one in builtins() if one.kind == "synapse"]
    assert {one.name for one in synapses} == {
        "gap_junction", "diffusive", "graded", "sigmoidal_conductance", "phase", "amplitude_phase",
        "exponential", "alpha", "double_exponential", "nmda", "tsodyks_markram",  # in test_library_spikes
    }  # fmt: skip
    assert all(about for one in synapses for _, _, about in one.parameters)


# ---- networks of the literature ------------------------------------------------------------------------------------


def test_the_salamanders_spinal_cord() -> None:
    """Sixteen oscillators in two chains (Ijspeert 2007): a wave goes down each, the sides take turns."""
    chain = "weight: 10, pattern: chain, synapse: {amplitude_phase: {lag:"
    spec = f"""neurons:
  L: {{count: 8, model: {{amplitude_oscillator: {{nu: 1 + 0.05*i}}}}, initial: {{theta: 0.2*i}}}}
  R: {{count: 8, model: {{amplitude_oscillator: {{nu: 1 + 0.05*i, R: 1 + 0.1*i}}}}, initial: {{theta: sin(i)}}}}
connections:
  L -> L: {{{chain} pi/4}}}}}}
  R -> R: {{{chain} pi/4}}}}}}
  L -> R: {{weight: 10, pattern: one_to_one, synapse: {{amplitude_phase: {{lag: pi}}}}}}
  R -> L: {{weight: 10, pattern: one_to_one, synapse: {{amplitude_phase: {{lag: pi}}}}}}
"""
    back = [
        f"  {side}{i + 1} -> {side}{i}: {{weight: 10, synapse: {{amplitude_phase: {{lag: -pi/4}}}}}}\n"
        for side in "LR"
        for i in range(1, 8)
    ]
    theta = np.hstack([run(spec + "".join(back), "{dt: 0.01}", 1000, f"{side}.theta") for side in "LR"])

    segment = np.tile(np.arange(8), 2)
    weights, lags = np.zeros((16, 16)), np.zeros((16, 16))  # rows are sources
    for side in (0, 8):
        for i in range(7):
            weights[side + i, side + i + 1] = weights[side + i + 1, side + i] = 10
            lags[side + i, side + i + 1], lags[side + i + 1, side + i] = np.pi / 4, -np.pi / 4
    for i in range(8):
        weights[i, i + 8] = weights[i + 8, i] = 10
        lags[i, i + 8] = lags[i + 8, i] = np.pi
    assert np.count_nonzero(weights) == 44
    most = np.array([1.0] * 8 + (1 + 0.1 * np.arange(8)).tolist())

    def flow(t: float, x: FloatArray) -> FloatArray:
        theta, r, speed = x[:16], x[16:32], x[32:]
        pull = weights * r[:, None] * np.sin(theta[:, None] - theta[None, :] - lags)
        return np.concatenate(
            (2 * np.pi * (1 + 0.05 * segment) + pull.sum(axis=0), speed, 20 * (5 * (most - r) - speed))
        )

    start = np.concatenate((0.2 * np.arange(8), np.sin(np.arange(8)), np.zeros(32)))
    expected = solved(flow, start, 10.0, 1001)[:, :16]
    assert 70 < expected.max() < 85
    assert np.abs(theta - expected).max() < 3.6e-5
    apart = np.exp(1j * (theta[-1, :7] - theta[-1, 1:8]))
    assert np.abs(np.angle(apart) - np.pi / 4).max() < 0.3  # the wave
    assert np.abs(np.angle(np.exp(1j * (theta[-1, :8] - theta[-1, 8:] - np.pi)))).max() < 0.2  # the sides


def test_liquid_time_constants_are_those_of_the_papers_solver() -> None:
    """Six neurons, each joined to each, and two inputs, by the fused solver with six unfolds (Hasani 2021)."""
    generator = np.random.default_rng(3)

    def drawn(low: float, high: float, *shape: int) -> FloatArray:
        return np.asarray(generator.uniform(low, high, shape), dtype=np.float64)

    c, g, e = drawn(0.4, 0.6, 6), drawn(0.001, 1, 6), drawn(-0.2, 0.2, 6)
    pairs = {
        ends: (
            drawn(0.001, 1, *shape),
            {
                "E": np.sign(drawn(-1, 1, *shape)),
                "threshold": drawn(0.3, 0.8, *shape),
                "slope": 1 / drawn(3, 8, *shape),
            },
        )
        for ends, shape in (("A + B -> N", (2, 6)), ("N -> N", (6, 6)))
    }
    entries = [
        f"  {ends}: {{matrix: {weight.tolist()}, delay: 0, synapse: {{sigmoidal_conductance: {{rest: 0, {about}}}}}}}"
        for ends, (weight, given) in pairs.items()
        for about in [", ".join(f"{name}: {values.ravel().tolist()}" for name, values in given.items())]
    ]
    spec = f"""inputs: {{a: {{expression: sin(0.3*k)}}, b: {{expression: sin(0.3*k + 2)}}}}
neurons:
  A: {{input: a}}
  B: {{input: b}}
  N: {{count: 6, model: {{ltc: {{C: {c.tolist()}, g: {g.tolist()}, E: {e.tolist()}}}}}}}
connections:
{chr(10).join(entries)}
"""
    found = run(spec, "{dt: 1, integrate: {method: semi_implicit, substeps: 6}}", 20)
    v = e
    for k in range(1, 21):
        seen = np.sin(0.3 * k + 2 * np.arange(2))
        for _ in range(6):
            opened = {
                ends: weight * sigmoid((x[:, None] - about["threshold"]) / about["slope"])
                for (ends, (weight, about)), x in zip(pairs.items(), (seen, v), strict=True)
            }
            inward = sum((opened[ends] * about["E"]).sum(axis=0) for ends, (_, about) in pairs.items())
            whole = sum(one.sum(axis=0) for one in opened.values())
            v = (6 * c * v + g * e + inward) / (6 * c + g + whole)
        assert np.abs(found[k, 2:] - v).max() < 1.8e-15


def test_the_joints_of_a_stick_insect_are_what_a_loop_by_hand_makes() -> None:
    """Eighteen joints of ``specs/stick_insect``, 216 neurons and 234 conductances, by Runge and Kutta's method of
    fourth order with a loop; each with its own drive, so that none is like another."""
    spec = """neurovis: 1
name: joints
include: [modules/joint.yaml]
time: {dt: 0.01 ms}
instances: {J: {module: joint, count: 18, set: {drive: 0.19 + 0.001*i, first: -70 + i, second: -10 - i}}}
"""
    network = nv.compile_text(spec, folder=SPECS / "stick_insect")
    assert len(network.network.connection_names) == 234
    parts = ["C", "S", "R", "IN", "MN"]
    run = network.run(1001, backend="numpy")
    assert run.activity.shape[1] == 216
    found = np.concatenate([run[f"J{n + 1}.{part}"].reshape(1001, -1) for n in range(18) for part in parts], axis=1)

    n = np.arange(18.0)
    begin = np.column_stack((-70 + n, -10 - n))
    v = np.hstack((begin, np.full((18, 6), -63.46), np.full((18, 4), -65.0)))  # C1, C2, S, R, IN1 to IN4, MN1 to MN4
    h = np.hstack((sigmoid(-(begin + 30) / 6), np.full((18, 6), 0.791)))
    gates = np.zeros((4, 18, 4))
    gates[0] = 0.9
    capacity = np.array([0.9153] * 2 + [0.21] * 6)
    leak = np.array([2.8] * 2 + [10.0, 6.8] + [2.8] * 4)
    speed = np.array([0.0023] * 2 + [0.01] * 6)
    drive = np.hstack((np.tile((0.19 + 0.001 * n)[:, None], 2), np.tile([0.0, 0, 1.6, 1.6, 1.6, 1.6], (18, 1))))
    pull = np.array([0.0] * 4 + [-80.0] * 4)

    def s(v: FloatArray, slope: float) -> FloatArray:
        return sigmoid((v + 43) / slope)

    def flow(v: FloatArray, h: FloatArray, gates: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        cells, motor = v[:, :8], v[:, 8:]
        c1, c2, sense = v[:, 0], v[:, 1], v[:, 2]
        arrived = np.zeros((18, 8))
        arrived[:, 0] = s(c2, 0.1) * (-80 - c1) + 0.06 * s(sense, 1 / 0.42) * (0 - c1)
        arrived[:, 1] = s(c1, 0.1) * (-80 - c2) + 0.03 * s(sense, 0.1) * (-80 - c2)
        arrived[:, 3] = 0.4 * s(sense, 0.1) * (0 - v[:, 3])
        arrived[:, 4:6] = (0.5 * s(c1, 0.1))[:, None] * (0 - v[:, 4:6])
        arrived[:, 6:8] = (0.5 * s(c2, 0.1))[:, None] * (0 - v[:, 6:8])
        sodium = 10 * sigmoid((cells + 37) / 6) * h * (50 - cells)
        inward = (sodium + leak * (-65 - cells) + drive * (pull - cells) + arrived) / capacity
        back = speed * np.cosh((cells + 30) / 12) * (sigmoid(-(cells + 30) / 6) - h)
        m, k, p, q = gates
        current = 55 * (m * m * m) * k * (55 - motor) + 10 * (p * p * p * p) * (-80 - motor) + 6 * q * (-80 - motor)
        current = current + 0.8 * (-70 - motor) + 0.25 * (0 - motor) + 2 * s(v[:, 4:8], 2) * (-80 - motor)
        turned = np.array([
            1.28 / exprel(-(motor + 51.9) / 4) * (1 - m) - 1.4 / exprel((motor + 24.9) / 5) * m,
            0.128 * np.exp(-(motor + 48) / 18) * (1 - k) - 4 * sigmoid((motor + 25) / 5) * k,
            0.08 / exprel(-(motor + 29.9) / 5) * (1 - p) - 0.25 * np.exp(-(motor + 45) / 40) * p,
            0.0005 * (sigmoid(0.6 * (motor + 30)) - q),
        ])  # fmt: skip
        return np.hstack((inward, current)), back, turned

    state = (v, h, gates)
    for k in range(1001):
        assert (
            np.abs(found[k] - state[0].ravel()).max() < 2.8e-14
        )  # 0 on the machine where this was written, over 5,000 steps
        slopes = [flow(*state)]
        for part in (0.005, 0.005, 0.01):
            slopes.append(flow(*(one + part * slope for one, slope in zip(state, slopes[-1], strict=True))))
        state = tuple(
            one + (a + 2 * b + 2 * c + d) * (0.01 / 6) for one, a, b, c, d in zip(state, *slopes, strict=True)
        )


def test_the_whole_worm_by_graded_synapses_and_gap_junctions(tmp_path: Path) -> None:
    """The 448 cells of C. elegans and all 7,379 pairs that touch (``specs/worm/data/worm.csv``), in the model of
    Kunert, Shlizerman and Kutz, with a hundredth of its conductance a contact: with 100 pS a millisecond is too long
    for rk4."""
    with (SPECS / "worm" / "data" / "worm.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    cells = list(dict.fromkeys(row[end] for row in rows for end in ("from", "to")))
    place = {cell: index for index, cell in enumerate(cells)}
    contacts = {kind: np.zeros((448, 448)) for kind in ("chemical", "electrical")}
    inhibits = np.array([cell.startswith(("DD", "VD")) for cell in cells])
    files = {name: ["from,to,weight"] for name in ("excitatory", "inhibitory", "electrical")}
    for row in rows:
        source, target = place[row["from"]], place[row["to"]]
        contacts[row["kind"]][source, target] = float(row["contacts"])
        name = "electrical" if row["kind"] == "electrical" else "inhibitory" if inhibits[source] else "excitatory"
        files[name].append(f"N{source + 1},N{target + 1},{row['contacts']}")
    for name, lines in files.items():
        (tmp_path / f"{name}.csv").write_text("\n".join(lines), encoding="utf-8")
    touched = place["PLML"]
    spec = f"""neurovis: 1
name: worm
neurons: {{N: {{count: 448, model: graded, initial: {{v: -35}}}}, T: {{bias: 5000}}}}
connections:
  - N -> N: {{edges: {{file: excitatory.csv}}, synapse: graded}}
  - N -> N: {{edges: {{file: inhibitory.csv}}, synapse: {{graded: {{E: -45}}}}}}
  - N -> N: {{edges: {{file: electrical.csv}}, synapse: gap_junction}}
  - T -> N{touched + 1}: {{delay: 0}}
"""

    def flow(t: float, x: FloatArray) -> FloatArray:
        v, s = x[:448], x[448:]
        sent = contacts["chemical"].T @ (s * np.where(inhibits, -45.0, 0.0)) - contacts["chemical"].T @ s * v
        gaps = contacts["electrical"].T @ v - contacts["electrical"].sum(axis=0) * v
        current = 10 * (-35 - v) + sent + gaps
        current[touched] += 5000
        return np.concatenate((current, sigmoid(0.125 * (v + 35)) * (1 - s) - 5 * s))

    start = np.concatenate((np.full(448, -35.0), np.full(448, 1 / 11)))
    expected = solved(flow, start, 0.05, 51, "LSODA")[:, :448]
    assert np.ptp(expected[-1]) > 10
    assert len(rows) == 7379
    for dt, bound in ((1, 4.3e-4), (0.2, 5.6e-7)):
        steps = round(50 / dt)
        network = nv.compile_text(f"{spec}time: {{dt: {dt} ms}}\n", folder=tmp_path)
        found = network.run(steps + 1, backend="numpy")["N"]
        assert np.abs(found[:: round(1 / dt)] - expected).max() < bound
