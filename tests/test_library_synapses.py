"""The synapses of the library, and what they make of its models: each against a closed form, an integrator of high
order, or the formulas of its paper."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
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
        f"  {ends}: {{matrix: {weight.tolist()}, delay: 0, synapse: {{sigmoidal_conductance: {{rest: 0, {settings}}}}}}}"
        for ends, (weight, about) in pairs.items()
        for settings in [", ".join(f"{name}: {values.ravel().tolist()}" for name, values in about.items())]
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
