"""Models of the literature, written as their equations stand, against SciPy's DOP853."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record

Derivatives = Callable[[float, FloatArray], FloatArray]


def run(text: str, steps: int) -> FloatArray:
    """The activities at the steps 0 to ``steps``."""
    return record(nv.compile_text("neurovis: 1\n" + text).network, Course(steps + 1, backend="numpy")).activity


def exact(derivatives: Derivatives, start: list[float], dt: float, steps: int) -> FloatArray:
    """The states at the steps 0 to ``steps``: (steps, states)."""
    times = [k * dt for k in range(steps + 1)]
    found: FloatArray = solve_ivp(derivatives, (0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-12).y.T
    return found


HODGKIN_HUXLEY = """
name: hodgkin_huxley
time: {dt: DT, integrate: METHOD}
models:
  hodgkin_huxley:
    time: ms
    parameters: {gNa: 120, gK: 36, gL: 0.3, ENa: 50, EK: -77, EL: -54.4}
    let:
      am: 1/exprel(-(v + 40)/10)
      bm: 4*exp(-(v + 65)/18)
      ah: 0.07*exp(-(v + 65)/20)
      bh: 1/(1 + exp(-(v + 35)/10))
      an: 0.1/exprel(-(v + 55)/10)
      bn: 0.125*exp(-(v + 65)/80)
    state:
      v: {initial: -65, unit: mV, derivative: drive - gNa*m^3*h*(v - ENa) - gK*n_^4*(v - EK) - gL*(v - EL)}
      m: {initial: 0.05, derivative: am*(1 - m) - bm*m}
      h: {initial: 0.6, derivative: ah*(1 - h) - bh*h}
      n_: {initial: 0.32, derivative: an*(1 - n_) - bn*n_}
    activity: v
neurons: {N: {model: hodgkin_huxley, bias: 10}}
"""


def hodgkin_huxley(t: float, x: FloatArray) -> FloatArray:
    v, m, h, n = x
    am, an = 0.1 * (v + 40) / (1 - np.exp(-(v + 40) / 10)), 0.01 * (v + 55) / (1 - np.exp(-(v + 55) / 10))
    ah, bh = 0.07 * np.exp(-(v + 65) / 20), 1 / (1 + np.exp(-(v + 35) / 10))
    bm, bn = 4 * np.exp(-(v + 65) / 18), 0.125 * np.exp(-(v + 65) / 80)
    current = 10 - 120 * m**3 * h * (v - 50) - 36 * n**4 * (v + 77) - 0.3 * (v + 54.4)
    return np.array([current, am * (1 - m) - bm * m, ah * (1 - h) - bh * h, an * (1 - n) - bn * n])


@pytest.mark.parametrize(("method", "bound"), [("rk4", 2e-4), ("heun", 0.3), ("euler", 8.0), ("exponential", 50.0)])
def test_hodgkin_huxley(method: str, bound: float) -> None:
    """20 ms with spikes at 0.01 ms, in mV: the methods err as the published figures say."""
    text = HODGKIN_HUXLEY.replace("DT", "1e-5").replace("METHOD", method)
    expected = exact(hodgkin_huxley, [-65, 0.05, 0.6, 0.32], 0.01, 2000)[:, 0]
    error = np.abs(run(text, 2000)[:, 0] - expected).max()
    assert error < bound
    assert expected.max() > 30  # it spikes
    if method == "rk4":
        finer = np.abs(run(text.replace("1e-5", "5e-6"), 4000)[::2, 0] - expected).max()
        assert error / finer > 13


ADEX = """
name: adex
time: {dt: 1e-4}
models:
  adex:
    time: ms
    parameters: {C: 281, gL: 30, EL: -70.6, VT: -50.4, DT: 2, a: 4, tau_w: 144}
    state:
      v: {initial: EL, derivative: (-gL*(v - EL) + gL*DT*exp((v - VT)/DT) - w + drive)/C}
      w: {derivative: (a*(v - EL) - w)/tau_w}
    activity: v
neurons: {N: {model: adex, input: current}}
inputs: {current: {expression: 450*sin(40*t)}}
"""


def test_adex_below_its_threshold() -> None:
    def adex(t: float, x: FloatArray) -> FloatArray:
        v, w = x
        current = 450 * np.sin(0.04 * t)
        return np.array(
            [
                (-30 * (v + 70.6) + 60 * np.exp((v + 50.4) / 2) - w + current) / 281,
                (4 * (v + 70.6) - w) / 144,
            ]
        )

    expected = exact(adex, [-70.6, 0], 0.1, 2000)[:, 0]
    assert -52 > expected.max() > -60
    assert np.abs(run(ADEX, 2000)[:, 0] - expected).max() < 1e-6


WILSON_COWAN = """
name: wilson_cowan
time: {dt: 5e-4}
activations:
  response: {parameters: {a: 1, theta: 0}, value: 1/(1 + exp(-a*(x - theta))) - 1/(1 + exp(a*theta))}
models:
  wilson_cowan:
    time: ms
    parameters: {tau: 8}
    state: {r: {initial: 0.1, derivative: (-r + (1 - r)*f(drive))/tau}}
    activity: r
neurons:
  E: {model: wilson_cowan, activation: {response: {a: 1.3, theta: 4}}, bias: 1.25}
  I: {model: wilson_cowan, activation: {response: {a: 2, theta: 3.7}}}
connections: {E -> E: {weight: 16}, I -> E: {weight: -12}, E -> I: {weight: 15}, I -> I: {weight: -3}}
"""


def test_wilson_cowan() -> None:
    """The limit cycle of their Fig. 11 (1972)."""

    def response(x: float, a: float, theta: float) -> float:
        return float(1 / (1 + np.exp(-a * (x - theta))) - 1 / (1 + np.exp(a * theta)))

    def wilson_cowan(t: float, x: FloatArray) -> FloatArray:
        e, i = x
        de = -e + (1 - e) * response(16 * e - 12 * i + 1.25, 1.3, 4)
        di = -i + (1 - i) * response(15 * e - 3 * i, 2, 3.7)
        return np.array([de, di]) / 8

    expected = exact(wilson_cowan, [0.1, 0.1], 0.5, 600)
    found = run(WILSON_COWAN, 600)
    assert np.abs(found - expected).max() < 1e-5
    assert np.ptp(expected[300:, 0]) > 0.1  # it oscillates


JANSEN_RIT = """
name: jansen_rit
time: {dt: 1e-3}
activations: {firing: {value: 5/(1 + exp(0.56*(6 - x)))}}
models:
  potential:
    parameters: {gain: 3.25, rate: 100, scale: 1}
    ports: [afferent]
    state:
      y: {derivative: z}
      z: {derivative: gain*rate*(scale*f(drive) + afferent) - 2*rate*z - rate^2*y}
    activity: y
neurons:
  P: {model: potential, activation: firing}
  E: {model: {potential: {scale: 108}}, activation: firing, bias: {afferent: 220}}
  I: {model: {potential: {gain: 22, rate: 50, scale: 33.75}}, activation: firing}
connections: {E -> P: {weight: 1}, I -> P: {weight: -1}, P -> E: {weight: 135}, P -> I: {weight: 33.75}}
"""


def test_jansen_rit() -> None:
    """A cortical column (1995) of three populations: its alpha rhythm, in mV."""

    def firing(v: float) -> float:
        return float(5 / (1 + np.exp(0.56 * (6 - v))))

    def jansen_rit(t: float, x: FloatArray) -> FloatArray:
        (p, e, i), z = x[:3], x[3:]
        rates = np.array([firing(e - i), 220 + 108 * firing(135 * p), 33.75 * firing(33.75 * p)])
        gain, rate = np.array([3.25, 3.25, 22]), np.array([100, 100, 50])
        return np.concatenate((z, gain * rate * rates - 2 * rate * z - rate**2 * x[:3]))

    expected = exact(jansen_rit, [0.0] * 6, 1e-3, 1000)[:, :3]
    found = run(JANSEN_RIT, 1000)
    assert np.abs(found - expected).max() < 1e-3
    eeg = expected[500:, 1] - expected[500:, 2]
    assert np.ptp(eeg) > 4
    finer = np.abs(run(JANSEN_RIT.replace("1e-3", "5e-4"), 2000)[::2] - expected).max()
    assert np.abs(found - expected).max() / finer > 13
