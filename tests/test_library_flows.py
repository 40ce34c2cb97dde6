"""The models of the library in which something flows, each against a closed form, an integrator of high order, or the
formulas of its paper."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.program import MODEL
from neurovis_spec.compiler.values.definitions import LATER
from neurovis_spec.manual.builtins import builtins
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record


def run(spec: str, dt: float, steps: int, states: str = "") -> tuple[FloatArray, FloatArray]:
    """The activities at steps 0 to ``steps``, and the states or outputs asked for (``"A.v B.v"``)."""
    shown = ", ".join(f"o{number}: {one}" for number, one in enumerate(states.split()))
    text = f"neurovis: 1\nname: x\ntime: {{dt: {dt}}}\n{spec}\noutputs: {{{shown}}}\n"
    found = record(nv.compile_text(text).network, Course(steps + 1, backend="numpy"))
    return found.activity, np.array([found[one].reshape(steps + 1, -1) for one in states.split()])


def solved(flow: Callable[[float, FloatArray], object], start: list[float], end: float, points: int) -> FloatArray:
    """The solution of an equation at so many points from 0 to an end, in a row each."""
    at = np.linspace(0, end, points)
    found = solve_ivp(flow, (0, end), start, "DOP853", at, rtol=1e-12, atol=1e-13)
    return np.asarray(found.y.T, dtype=np.float64)


def sigmoid(x: FloatArray) -> FloatArray:
    return np.asarray(1 / (1 + np.exp(-x)), dtype=np.float64)


def test_leaky_is_the_neuron_of_a_ctrnn() -> None:
    """Beer's equation of three, each with its own time constant."""
    weights = np.array([[4.5, 1.0, -1.0], [-1.0, 4.5, 1.0], [1.0, -1.0, 4.5]])
    taus, thetas, bias = np.array([0.5, 1.0, 0.8]), np.array([-2.7, -2.2, -1.9]), np.array([0.1, 0.0, -0.2])
    model = f"{{leaky: {{tau: {taus.tolist()}, theta: {thetas.tolist()}}}}}"
    spec = f"""neurons:
  N: {{count: 3, activation: sigmoid, bias: {bias.tolist()}, model: {model}}}
connections:
  N -> N: {{matrix: {weights.tolist()}}}"""
    activity, (v,) = run(spec, 0.01, 500, "N.v")
    expected = solved(lambda t, v: (sigmoid(v + thetas) @ weights + bias - v) / taus, [0.0, 0.0, 0.0], 5.0, 501)
    assert np.abs(v - expected).max() < 1e-9
    assert np.abs(activity - sigmoid(expected + thetas)).max() < 1e-9


def test_fitzhugh_nagumo_fires_where_it_is_driven() -> None:
    activity, _ = run("neurons: {A: {model: fitzhugh_nagumo, bias: 0.5}, B: {model: fitzhugh_nagumo}}", 0.05, 2000)
    expected = solved(
        lambda t, x: [x[0] - x[0] ** 3 / 3 - x[1] + 0.5, 0.08 * (x[0] + 0.7 - 0.8 * x[1])], [-1.2, -0.62], 100.0, 2001
    )
    assert np.abs(activity[:, 0] - expected[:, 0]).max() < 1e-5
    assert activity[:, 0].max() > 1.5
    assert np.abs(activity[:, 1] + 1.2).max() < 0.01  # at rest


def test_two_of_matsuoka_take_turns() -> None:
    spec = """neurons: {N: {count: 2, model: {matsuoka: {tau: 0.25, tau_fatigue: 3}}, bias: 1, initial: {x: [0.1, 0]}}}
connections: {N -> N: {weight: -1.5, pattern: all_to_all}}"""
    activity, _ = run(spec, 0.01, 2000)

    def flow(t: float, s: FloatArray) -> list[float]:
        (x1, x2, f1, f2), y1, y2 = s, max(s[0], 0.0), max(s[1], 0.0)
        return [
            (1 - 1.5 * y2 - 2.5 * f1 - x1) / 0.25,
            (1 - 1.5 * y1 - 2.5 * f2 - x2) / 0.25,
            (y1 - f1) / 3,
            (y2 - f2) / 3,
        ]

    expected = np.maximum(solved(flow, [0.1, 0.0, 0.0, 0.0], 20.0, 2001)[:, :2], 0)
    assert np.abs(activity - expected).max() < 1e-4  # of second order where one begins or stops
    leads = activity[1000:, 0] > activity[1000:, 1]
    assert np.count_nonzero(leads[1:] != leads[:-1]) >= 4


def test_hopf_comes_back_to_its_amplitude() -> None:
    """In closed form: the square of the amplitude grows as a population does, the phase evenly."""
    mu, gamma, omega = 2.0, 3.0, 5.0
    model = f"{{hopf: {{mu: {mu}, gamma: {gamma}, nu: {omega / (2 * np.pi)!r}}}}}"
    spec = f"neurons: {{N: {{model: {model}, initial: {{x: 0.1}}}}}}"
    activity, (amplitude, phase) = run(spec, 0.001, 3000, "N.amplitude N.phase")
    t = np.arange(3001) * 0.001
    squared = mu / (1 + (mu / 0.01 - 1) * np.exp(-2 * gamma * mu * t))
    assert np.abs(amplitude[:, 0] - np.sqrt(squared)).max() < 1e-10
    assert np.abs(activity[:, 0] - np.sqrt(squared) * np.cos(omega * t)).max() < 1e-10
    assert np.abs(np.exp(1j * phase[:, 0]) - np.exp(1j * omega * t)).max() < 1e-10


def test_van_der_pol_has_twice_its_p_as_amplitude() -> None:
    spec = "neurons: {N: {model: {van_der_pol: {mu: 0.5, p: 1.5, omega: 2}}, initial: {x: 0.1}, bias: 0.2}}"
    activity, _ = run(spec, 0.01, 3000)
    expected = solved(lambda t, x: [x[1], 0.5 * (2.25 - x[0] ** 2) * x[1] - 4 * x[0] + 0.2], [0.1, 0.0], 30.0, 3001)
    assert np.abs(activity[:, 0] - expected[:, 0]).max() < 1e-5
    assert 2.9 < activity[2000:].max() < 3.2


def test_wilson_and_cowans_two_populations_oscillate() -> None:
    """With the numbers of their figure 11."""
    spec = """neurons:
  E: {bias: 1.25, model: {wilson_cowan: {slope: 1.3, threshold: 4}}}
  I: {model: {wilson_cowan: {slope: 2, threshold: 3.7}}}
connections: {E -> E: 16, I -> E: -12, E -> I: 15, I -> I: -3}"""
    activity, _ = run(spec, 1e-4, 2000)

    def response(x: float, slope: float, threshold: float) -> float:
        return float(1 / (1 + np.exp(-slope * (x - threshold))) - 1 / (1 + np.exp(slope * threshold)))

    def flow(t: float, x: FloatArray) -> list[float]:
        e, i = x
        most = 1 - 1 / (1 + np.exp(1.3 * 4)), 1 - 1 / (1 + np.exp(2 * 3.7))
        return [
            ((most[0] - e) * response(16 * e - 12 * i + 1.25, 1.3, 4) - e) / 0.01,
            ((most[1] - i) * response(15 * e - 3 * i, 2, 3.7) - i) / 0.01,
        ]

    assert np.abs(activity - solved(flow, [0.0, 0.0], 0.2, 2001)).max() < 1e-7
    assert np.ptp(activity[1000:, 0]) > 0.1


def test_jansen_and_rits_column_makes_an_alpha_rhythm() -> None:
    activity, (rate,) = run("neurons: {N: {model: jansen_rit, bias: 220}}", 5e-4, 2000, "N.rate")

    def s(v: float) -> float:
        return float(5 / (1 + np.exp(0.56 * (6 - v))))

    def flow(t: float, y: FloatArray) -> list[float]:
        return [
            *y[3:],
            3.25 * 100 * s(y[1] - y[2]) - 200 * y[3] - 1e4 * y[0],
            3.25 * 100 * (220 + 108 * s(135 * y[0])) - 200 * y[4] - 1e4 * y[1],
            22 * 50 * 33.75 * s(33.75 * y[0]) - 100 * y[5] - 2500 * y[2],
        ]

    expected = solved(flow, [0.0] * 6, 1.0, 2001)
    potential = expected[:, 1] - expected[:, 2]
    assert np.abs(activity[:, 0] - potential).max() < 1e-5
    assert np.abs(rate[:, 0] - [s(v) for v in potential]).max() < 1e-5
    late = activity[1000:, 0] - activity[1000:, 0].mean()
    assert np.count_nonzero((late[1:] > 0) & (late[:-1] <= 0)) in (4, 5, 6)  # some 10 a second


def test_phases_come_together_as_kuramoto_says() -> None:
    """By the sine of differences, which two connections make; two in closed form."""
    spec = """neurons: {N: {count: 2, model: {phase_oscillator: {nu: 3/(2*pi)}}, initial: {theta: [0, 2]}}}
connections:
  - N -> N: {weight: 0.7, pattern: all_to_all, send: sine, port: sines}
  - N -> N: {weight: 0.7, pattern: all_to_all, send: cosine, port: cosines}"""
    activity, (theta,) = run(spec, 0.01, 300, "N.theta")
    t = np.arange(301) * 0.01
    apart = 2 * np.arctan(np.tan(1.0) * np.exp(-1.4 * t))  # d' = -2*0.7*sin(d)
    assert np.abs(theta[:, 1] - theta[:, 0] - apart).max() < 1e-9
    assert np.abs(theta.mean(axis=1) - 1 - 3 * t).max() < 1e-11
    assert np.abs(activity - np.cos(theta)).max() < 1e-15


def test_amplitudes_of_ijspeerts_oscillators_come_evenly() -> None:
    """One alone in closed form, as its amplitude is damped critically; two with the coupling of the paper."""
    activity, (r,) = run("neurons: {N: {model: {amplitude_oscillator: {R: 2, nu: 1.5}}}}", 0.001, 2000, "N.r")
    t = np.arange(2001) * 0.001
    expected = 2 - 2 * (1 + 10 * t) * np.exp(-10 * t)
    assert np.abs(r[:, 0] - expected).max() < 1e-9
    assert np.abs(activity[:, 0] - expected * (1 + np.cos(3 * np.pi * t))).max() < 1e-8
    spec = """neurons: {N: {count: 2, model: {amplitude_oscillator: {R: [1, 2]}}, initial: {theta: [0, 1], r: 0.5}}}
connections:
  - N -> N: {weight: 10, pattern: all_to_all, send: sine, port: sines}
  - N -> N: {weight: 10, pattern: all_to_all, send: cosine, port: cosines}"""
    activity, _ = run(spec, 0.001, 1000)

    def flow(t: float, x: FloatArray) -> list[float]:
        a, b, r, s, v, w = x
        turn = 10 * np.sin(b - a)
        return [2 * np.pi + s * turn, 2 * np.pi - r * turn, v, w, 20 * (5 * (1 - r) - v), 20 * (5 * (2 - s) - w)]

    found = solved(flow, [0.0, 1.0, 0.5, 0.5, 0.0, 0.0], 1.0, 1001)
    assert np.abs(activity - found[:, 2:4] * (1 + np.cos(found[:, :2]))).max() < 1e-8


def test_ornstein_and_uhlenbecks_noise_has_its_variance_and_its_memory() -> None:
    spec = "neurons: {N: {count: 2000, model: {ornstein_uhlenbeck: {sigma: 2, mean: 3, tau: 0.05}}}}"
    activity, _ = run(spec, 0.001, 400)
    early, late = activity[350] - 3, activity[400] - 3
    assert late.mean() == pytest.approx(0, abs=0.15)
    assert late.std() == pytest.approx(2, rel=0.05)
    assert np.corrcoef(early, late)[0, 1] == pytest.approx(np.exp(-1), abs=0.07)
    assert activity[20].std() == pytest.approx(2 * np.sqrt(1 - np.exp(-2 * 0.02 / 0.05)), rel=0.05)


def test_cfc_is_the_closed_form_of_its_paper() -> None:
    generator = np.random.default_rng(5)
    g, h, a, b = (generator.normal(size=(4, 4)) for _ in range(4))
    entries = "\n".join(
        f"  - N -> N: {{matrix: {matrix.tolist()}, port: {port}}}"
        for port, matrix in (("g", g), ("h", h), ("time_a", a), ("time_b", b))
    )
    begin = np.array([-0.2, -0.1, 0.1, 0.3])
    group = f"count: 4, model: {{cfc: {{ts: 0.6}}}}, bias: {{g: 0.2, time_b: 0.1}}, initial: {begin.tolist()}"
    spec = f"neurons: {{N: {{{group}}}}}\nconnections:\n{entries}"
    activity, _ = run(spec, 0.1, 30)
    x = begin
    for now in activity[1:]:
        gate = sigmoid(-(x @ a) * 0.6 + x @ b + 0.1)
        x = np.tanh(x @ g + 0.2) * (1 - gate) + gate * np.tanh(x @ h)
        assert np.abs(now - x).max() < 1e-14


def test_cfc_with_a_weight_by_formula_to_the_last_bit() -> None:
    """Four neurons and 64 connections. What each begins with is its activity, which is what the first step sends: a
    state that begins with it is made anew at step 0, of nothing, and so is 0."""
    weights = {"g": "sin(1 + i + 3*j)", "h": "cos(2*i + j)", "time_a": "sin(i*j)", "time_b": "cos(i - j)"}
    spec = "neurons: {N: {count: 4, model: cfc, initial: 0.1*i - 0.2}}\nconnections:" + "".join(
        f"\n  - N -> N: {{weight: {weight}, pattern: all_to_all, self: true, port: {port}}}"
        for port, weight in weights.items()
    )
    activity, _ = run(spec, 0.1, 100)
    i, j = np.arange(4.0)[:, None], np.arange(4.0)[None, :]
    g, h, a, b = np.sin(1 + i + 3 * j), np.cos(2 * i + j), np.sin(i * j), np.cos(i - j)
    x = 0.1 * np.arange(4) - 0.2
    for now in activity[1:]:
        to_g, to_h, to_a, to_b = (sum(x[k] * weight[k] for k in range(4)) for weight in (g, h, a, b))
        gate = sigmoid(to_b - to_a)
        x = np.tanh(to_g) * (1 - gate) + gate * np.tanh(to_h)
        assert np.abs(now - x).max() <= 4e-17
    assert (run(spec.replace("0.1*i - 0.2", "{x: 0.1*i - 0.2}"), 0.1, 10)[0] == 0).all()


def test_the_squid_fires_where_it_is_driven() -> None:
    activity, _ = run("neurons: {N: {model: hodgkin_huxley, bias: 10}, R: {model: hodgkin_huxley}}", 1e-5, 2000)

    def exprel(x: float) -> float:
        return float(np.expm1(x)) / x if x else 1.0

    def flow(t: float, x: FloatArray) -> list[float]:
        v, m, h, n = x
        current = 10 - 120 * m**3 * h * (v - 50) - 36 * n**4 * (v + 77) - 0.3 * (v + 54.387)
        return [
            1e3 * current,
            1e3 * ((1 - m) / exprel(-(v + 40) / 10) - m * 4 * np.exp(-(v + 65) / 18)),
            1e3 * (0.07 * (1 - h) * np.exp(-(v + 65) / 20) - h / (1 + np.exp(-(v + 35) / 10))),
            1e3 * (0.1 * (1 - n) / exprel(-(v + 55) / 10) - n * 0.125 * np.exp(-(v + 65) / 80)),
        ]

    expected = solved(flow, [-65, 0.0529, 0.5961, 0.3177], 0.02, 2001)[:, 0]
    assert np.abs(activity[:, 0] - expected).max() < 2e-4
    assert expected.max() > 30
    assert np.abs(activity[:, 1] + 65).max() < 0.01  # at rest


def test_the_barnacles_fibre_oscillates_where_it_is_driven() -> None:
    activity, _ = run("neurons: {N: {model: morris_lecar, bias: 100}, R: {model: morris_lecar}}", 1e-4, 3000)

    def flow(t: float, x: FloatArray) -> list[float]:
        v, w = x
        opened, limit = ((1 + np.tanh((v - at) / wide)) / 2 for at, wide in ((-1.2, 18), (2, 30)))
        current = 100 - 4.4 * opened * (v - 120) - 8 * w * (v + 84) - 2 * (v + 60)
        return [1e3 * current / 20, 1e3 * 0.04 * np.cosh((v - 2) / 60) * (limit - w)]

    expected = solved(flow, [-60.855, 0.0149], 0.3, 3001)[:, 0]
    assert np.abs(activity[:, 0] - expected).max() < 1e-4
    assert np.ptp(expected[2000:]) > 60
    assert np.abs(activity[:, 1] + 60.855).max() < 0.01  # at rest


def test_two_of_danners_that_inhibit_each_other_take_turns() -> None:
    """With persistent sodium, and the drive of the brain stem as excitation."""
    spec = """neurons: {N: {count: 2, model: danner, bias: {excitatory: 0.04}, initial: {v: [-60, -50]}}}
connections: {N -> N: {weight: 0.3, pattern: all_to_all, port: inhibitory}}"""
    activity, (v,) = run(spec, 2e-4, 3000, "N.v")

    def flow(t: float, x: FloatArray) -> FloatArray:
        v, h = x[:2], x[2:]
        f = np.clip((v + 50) / 50, 0, 1)
        opened, limit = 1 / (1 + np.exp(-(v + 40) / 6)), 1 / (1 + np.exp((v + 45) / 4))
        inward = (
            4.5 * opened * h * (50 - v) + 4.5 * (-62.5 - v) + 10 * 0.04 * (-10 - v) + 10 * 0.3 * f[::-1] * (-75 - v)
        )
        return 1e3 * np.concatenate((inward / 10, (limit - h) / (80 + 80 / np.cosh((v + 35) / 15))))

    expected = solved(flow, [-60.0, -50.0, 0.5, 0.5], 0.6, 3001)[:, :2]
    assert np.abs(v - expected).max() < 0.01  # of second order where one begins to be active, or is so most
    leads = activity[:, 0] > activity[:, 1]
    assert np.count_nonzero(leads[1:] != leads[:-1]) >= 2
    assert ((activity > 0.2).any(axis=0) & (activity == 0).any(axis=0)).all()


def test_each_names_its_source_and_what_its_parameters_are() -> None:
    models = [one for one in builtins() if one.kind == "model" and (one.time or one.name == "cfc")]
    assert len(models) == 23
    for one in models:
        assert any(
            f" {year} " in one.about or f"{year})" in one.about or f" {year}," in one.about
            for year in range(1900, 2030)
        )
        assert all(about for _, _, about in one.parameters)
        nv.compile_text(f"neurovis: 1\nname: x\n{one.use}")


def test_a_model_of_ones_own_with_such_a_name_is_no_finding() -> None:
    text = "neurovis: 1\nname: x\nmodels: {{{0}: {{activity: f(drive)}}}}\nneurons: {{A: {{model: {0}, bias: 1}}}}"
    assert all(nv.compile_text(text.format(name)).warnings == () for name in LATER[MODEL])
    timed = {one.name for one in builtins() if one.kind == "model" and one.time}
    assert LATER[MODEL] == {*timed, "cfc", "spike_source"}
    assert [one.code for one in nv.compile_text(text.format("adaptive")).warnings] == ["replaces-builtin"]
