"""What was tried out before derivatives were built, held as tests: models of the literature with the numbers of then,
beside an adaptive method of high order, and noise beside its theory."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record

HEAD = "neurovis: 1\nname: x\n"


def run(spec: str, steps: int, backend: str = "numpy") -> FloatArray:
    """The activities at steps 0 to ``steps``."""
    return record(nv.compile_text(HEAD + spec).network, Course(steps + 1, backend=backend)).activity


WILSON_COWAN = """
time: {dt: 0.01 ms}
models:
  population:
    time: ms
    parameters: {a: 1.3, theta: 4}
    let: {S: sigmoid(a*(drive - theta)) - sigmoid(-a*theta)}
    state: {rate: {initial: 0.1, derivative: (-rate + (1 - rate)*S)/10}}
    activity: rate
neurons: {N: {count: 2, model: {population: {a: [1.3, 2], theta: [4, 3.7]}}, bias: [1.25, 0]}}
connections: {N -> N: {matrix: [[16, 15], [-12, -3]]}}
"""


def test_wilson_and_cowan_to_the_last_bits_that_an_adaptive_method_has() -> None:
    def flow(t: float, x: FloatArray) -> FloatArray:
        slope, threshold = np.array([1.3, 2.0]), np.array([4.0, 3.7])
        drive = x @ np.array([[16.0, 15.0], [-12.0, -3.0]]) + [1.25, 0.0]
        response = 1 / (1 + np.exp(-slope * (drive - threshold))) - 1 / (1 + np.exp(slope * threshold))
        return np.asarray((-x + (1 - x) * response) / 10)

    exact = solve_ivp(flow, (0, 30), [0.1, 0.1], "DOP853", [30], rtol=3e-14, atol=1e-15).y[:, 0]
    assert np.abs(run(WILSON_COWAN, 3000)[-1] - exact).max() < 5e-12


ADEX = """
time: {dt: 0.01 ms}
models:
  adex:
    time: ms
    parameters: {C: 281, gL: 30, EL: -70.6, VT: -50.4, DT: 2, tau_w: 144, a: 4}
    state:
      v: {initial: -70.6, unit: mV, derivative: (gL*DT*exp((v - VT)/DT) - gL*(v - EL) - w + drive)/C}
      w: {initial: 0, unit: pA, derivative: (a*(v - EL) - w)/tau_w}
    activity: v
neurons: {A: {model: adex, bias: CURRENT}}
"""


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_adex_below_its_threshold(backend: str) -> None:
    """Brette and Gerstner 2005: with 500 pA it stays below, and overshoots; with 1,000 pA it rises without end."""

    def flow(t: float, x: FloatArray) -> list[float]:
        v, w = x
        upswing = 60 * np.exp((v + 50.4) / 2)
        return [(upswing - 30 * (v + 70.6) - w + 500) / 281, (4 * (v + 70.6) - w) / 144]

    exact = solve_ivp(flow, (0, 60), [-70.6, 0], "DOP853", np.arange(61.0), rtol=1e-12, atol=1e-12).y[0]
    found = run(ADEX.replace("CURRENT", "500"), 6000, backend)[:, 0]
    assert np.abs(found[::100] - exact).max() < 1e-9
    assert found.max() > found[-1] + 0.03  # w follows slowly
    with pytest.warns(RuntimeWarning, match="is (inf|nan)"):
        run(ADEX.replace("CURRENT", "1000"), 3000, backend)


HODGKIN_HUXLEY = """
time: {dt: 0.01 ms, integrate: METHOD}
models:
  squid:
    time: ms
    parameters: {C: 1, gNa: 120, gK: 36, gL: 0.3, ENa: 50, EK: -77, EL: -54.387}
    let:
      am: 1/exprel(-(v + 40)/10)
      bm: 4*exp(-(v + 65)/18)
      ah: 0.07*exp(-(v + 65)/20)
      bh: 1/(1 + exp(-(v + 35)/10))
      an: 0.1/exprel(-(v + 55)/10)
      bn: 0.125*exp(-(v + 65)/80)
    state:
      v: {initial: -65, derivative: (drive - gNa*m^3*h*(v - ENa) - gK*n^4*(v - EK) - gL*(v - EL))/C}
      m: {initial: 0.0529, derivative: am*(1 - m) - bm*m}
      h: {initial: 0.5961, derivative: ah*(1 - h) - bh*h}
      n: {initial: 0.3177, derivative: an*(1 - n) - bn*n}
    activity: v
inputs: {current: {expression: 10 if t >= 0.005 else 0}}
neurons: {A: {model: squid, input: current}}
"""


def exprel(x: float) -> float:
    return float(np.expm1(x)) / x if x else 1.0


def squid(x: FloatArray, current: float) -> tuple[FloatArray, FloatArray]:
    """The derivatives of Hodgkin and Huxley's cell, and how much each changes with its own state."""
    v, m, h, n = x
    am, bm = 1 / exprel(-(v + 40) / 10), 4 * np.exp(-(v + 65) / 18)
    ah, bh = 0.07 * np.exp(-(v + 65) / 20), 1 / (1 + np.exp(-(v + 35) / 10))
    an, bn = 0.1 / exprel(-(v + 55) / 10), 0.125 * np.exp(-(v + 65) / 80)
    dv = current - 120 * m**3 * h * (v - 50) - 36 * n**4 * (v + 77) - 0.3 * (v + 54.387)
    f = np.array([dv, am * (1 - m) - bm * m, ah * (1 - h) - bh * h, an * (1 - n) - bn * n])
    return f, np.array([-(120 * m**3 * h + 36 * n**4 + 0.3), -(am + bm), -(ah + bh), -(an + bn)])


@pytest.mark.parametrize(("method", "bound"), [("exponential", 1e-9), ("semi_implicit", 1e-9), ("euler", 1e-9)])
def test_hodgkin_and_huxleys_cell_is_what_a_loop_by_hand_makes(method: str, bound: float) -> None:
    """The first spike and a half, step by step. The current is on from 5 ms on, so in the step that begins there."""
    x, steps, dt = np.array([-65, 0.0529, 0.5961, 0.3177]), 1500, 0.01
    expected = [x[0]]
    for k in range(steps):
        f, j = squid(x, 10.0 if k >= 500 else 0.0)
        if method == "exponential":
            change = dt * np.array([exprel(dt * min(one, 0.0)) for one in j]) * f
        else:
            change = dt * f / (1 - dt * j) if method == "semi_implicit" else dt * f
        x = x + change
        expected.append(x[0])
    found = run(HODGKIN_HUXLEY.replace("METHOD", method), steps)[:, 0]
    assert max(expected) > 30
    assert np.abs(found - expected).max() < bound


def test_the_noise_of_two_hundred_has_the_deviation_of_theory() -> None:
    spec = """
time: {dt: 0.001, integrate: euler}
models:
  ou: {parameters: {tau: 0.05, sigma: 2}, state: {x: {derivative: -x/tau, noise: sigma*sqrt(2/tau)}}, activity: x}
neurons: {X: {count: 200, model: ou}}
"""
    late = run(spec, 5000)[500:]
    assert late.std() == pytest.approx(2.0, rel=0.02)  # of Euler and Maruyama 1 % more than the 2 of theory
    assert late.mean() == pytest.approx(0.0, abs=0.05)
