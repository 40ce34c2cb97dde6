"""Models of the literature, written as their equations stand, against SciPy's DOP853 and against loops by hand, and
noise beside its theory."""

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


def run(text: str, steps: int, backend: str = "numpy") -> FloatArray:
    """The activities at the steps 0 to ``steps``."""
    return record(nv.compile_text("neurovis: 1\nname: x\n" + text).network, Course(steps + 1, backend=backend)).activity


def exact(
    derivatives: Derivatives, start: list[float], dt: float, steps: int, rtol: float = 1e-12, atol: float = 1e-12
) -> FloatArray:
    """The states at the steps 0 to ``steps``: (steps, states)."""
    times = [k * dt for k in range(steps + 1)]
    found: FloatArray = solve_ivp(derivatives, (0, times[-1]), start, "DOP853", times, rtol=rtol, atol=atol).y.T
    return found


HODGKIN_HUXLEY = """
time: {dt: DT, integrate: METHOD}
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
      v: {initial: -65, unit: mV, derivative: (drive - gNa*m^3*h*(v - ENa) - gK*n^4*(v - EK) - gL*(v - EL))/C}
      m: {initial: 0.0529, derivative: am*(1 - m) - bm*m}
      h: {initial: 0.5961, derivative: ah*(1 - h) - bh*h}
      n: {initial: 0.3177, derivative: an*(1 - n) - bn*n}
    activity: v
inputs: {current: {expression: 10 if t >= 0.005 else 0}}
neurons: {A: {model: squid, DRIVE}}
"""
RESTING = [-65, 0.0529, 0.5961, 0.3177]


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


@pytest.mark.parametrize(("method", "bound"), [("rk4", 2e-4), ("heun", 0.3), ("euler", 8.0), ("exponential", 50.0)])
def test_hodgkin_huxley(method: str, bound: float) -> None:
    """20 ms with spikes at 0.01 ms, in mV: the methods err as the published figures say."""
    text = HODGKIN_HUXLEY.replace("DT", "1e-5").replace("METHOD", method).replace("DRIVE", "bias: 10")
    expected = exact(lambda t, x: squid(x, 10)[0], RESTING, 0.01, 2000)[:, 0]
    error = np.abs(run(text, 2000)[:, 0] - expected).max()
    assert error < bound
    assert expected.max() > 30  # it spikes
    if method == "rk4":
        finer = np.abs(run(text.replace("1e-5", "5e-6"), 4000)[::2, 0] - expected).max()
        assert error / finer > 13


@pytest.mark.parametrize("method", ["exponential", "semi_implicit", "euler"])
def test_hodgkin_and_huxleys_cell_is_what_a_loop_by_hand_makes(method: str) -> None:
    """The first spike and a half, step by step. The current is on from 5 ms on, so in the step that begins there."""
    x, steps, dt = np.array(RESTING), 1500, 0.01
    expected = [x[0]]
    for k in range(steps):
        f, j = squid(x, 10.0 if k >= 500 else 0.0)
        if method == "exponential":
            change = dt * np.array([exprel(dt * min(one, 0.0)) for one in j]) * f
        else:
            change = dt * f / (1 - dt * j) if method == "semi_implicit" else dt * f
        x = x + change
        expected.append(x[0])
    text = HODGKIN_HUXLEY.replace("DT", "0.01 ms").replace("METHOD", method).replace("DRIVE", "input: current")
    assert max(expected) > 30
    assert np.abs(run(text, steps)[:, 0] - expected).max() < 1e-9


ADEX = """
time: {dt: DT}
models:
  adex:
    time: ms
    parameters: {C: 281, gL: 30, EL: -70.6, VT: -50.4, DT: 2, tau_w: 144, a: 4}
    state:
      v: {initial: EL, unit: mV, derivative: (gL*DT*exp((v - VT)/DT) - gL*(v - EL) - w + drive)/C}
      w: {initial: 0, unit: pA, derivative: (a*(v - EL) - w)/tau_w}
    activity: v
inputs: {current: {expression: 450*sin(40*t)}}
neurons: {A: {model: adex, DRIVE}}
"""


def adex(x: FloatArray, current: float) -> FloatArray:
    v, w = x
    upswing = 60 * np.exp((v + 50.4) / 2)
    return np.array([(upswing - 30 * (v + 70.6) - w + current) / 281, (4 * (v + 70.6) - w) / 144])


def test_adex_below_its_threshold() -> None:
    text = ADEX.replace("dt: DT", "dt: 1e-4").replace("DRIVE", "input: current")
    expected = exact(lambda t, x: adex(x, 450 * np.sin(0.04 * t)), [-70.6, 0], 0.1, 2000)[:, 0]
    assert -52 > expected.max() > -60
    assert np.abs(run(text, 2000)[:, 0] - expected).max() < 1e-6


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_adex_overshoots_below_its_threshold_and_rises_above_it(backend: str) -> None:
    """Brette and Gerstner 2005: with 500 pA it stays below, and overshoots; with 1,000 pA it rises without end."""
    text = ADEX.replace("dt: DT", "dt: 0.01 ms")
    expected = exact(lambda t, x: adex(x, 500), [-70.6, 0], 1, 60)[:, 0]
    found = run(text.replace("DRIVE", "bias: 500"), 6000, backend)[:, 0]
    assert np.abs(found[::100] - expected).max() < 1e-9
    assert found.max() > found[-1] + 0.03  # w follows slowly
    with pytest.warns(RuntimeWarning, match="is (inf|nan)"):
        run(text.replace("DRIVE", "bias: 1000"), 3000, backend)


WILSON_COWAN = """
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


#: the same in other words: one group, a matrix, the response in the model
WILSON_COWAN_IN_ONE = """
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


def wilson_cowan(x: FloatArray, tau: float) -> FloatArray:
    slope, threshold = np.array([1.3, 2.0]), np.array([4.0, 3.7])
    drive = x @ np.array([[16.0, 15.0], [-12.0, -3.0]]) + [1.25, 0.0]
    response = 1 / (1 + np.exp(-slope * (drive - threshold))) - 1 / (1 + np.exp(slope * threshold))
    return np.asarray((-x + (1 - x) * response) / tau)


def test_wilson_cowan() -> None:
    """The limit cycle of their Fig. 11 (1972)."""
    expected = exact(lambda t, x: wilson_cowan(x, 8), [0.1, 0.1], 0.5, 600)
    found = run(WILSON_COWAN, 600)
    assert np.abs(found - expected).max() < 1e-5
    assert np.ptp(expected[300:, 0]) > 0.1  # it oscillates


def test_wilson_and_cowan_to_the_last_bits_that_an_adaptive_method_has() -> None:
    expected = exact(lambda t, x: wilson_cowan(x, 10), [0.1, 0.1], 30, 1, rtol=3e-14, atol=1e-15)[-1]
    assert np.abs(run(WILSON_COWAN_IN_ONE, 3000)[-1] - expected).max() < 5e-12


JANSEN_RIT = """
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


FITZHUGH_NAGUMO = """
time: {dt: 0.05}
models:
  fitzhugh_nagumo:
    parameters: {a: 0.7, b: 0.8, eps: 0.08}
    state: {v: {derivative: v - v^3/3 - w + drive}, w: {derivative: eps*(v + a - b*w)}}
    activity: v
synapses: {gap_junction: {signal: weight*(pre.v - post.v), sign: 0}}
neurons: {N: {count: 10, model: fitzhugh_nagumo, bias: 0.5, initial: {v: sin(i), w: 0.1*i}}}
connections:
  N -> N: {weight: 0.2, pattern: {band: {width: 1}}, synapse: gap_junction}
  N1 -> N10: {weight: 0.2, synapse: gap_junction}
  N10 -> N1: {weight: 0.2, synapse: gap_junction}
"""


def test_a_ring_of_fitzhugh_and_nagumo_with_gap_junctions() -> None:
    """Ten cells (1961), each joined to its neighbours."""

    def ring(t: float, x: FloatArray) -> FloatArray:
        v, w = x[:10], x[10:]
        joined = 0.2 * (np.roll(v, 1) - v) + 0.2 * (np.roll(v, -1) - v)
        return np.concatenate((v - v**3 / 3 - w + 0.5 + joined, 0.08 * (v + 0.7 - 0.8 * w)))

    start = [*np.sin(np.arange(10)).tolist(), *(0.1 * np.arange(10)).tolist()]
    expected = exact(ring, start, 0.05, 1000)[:, :10]
    assert np.abs(run(FITZHUGH_NAGUMO, 1000) - expected).max() < 1.9e-6
    assert np.ptp(expected[500:]) > 3  # they fire


KURAMOTO = """
time: {dt: 0.0125}
models:
  phase: {parameters: {omega: 1}, state: {theta: {derivative: omega + drive}}, activity: theta}
synapses: {pull: {parameters: {lag: 0}, signal: weight*sin(pre.theta - post.theta - lag)}}
neurons: {N: {count: 20, model: {phase: {omega: 1 + 0.05*i}}, initial: {theta: 0.3*i*i}}}
connections: {N -> N: {weight: 1/20, pattern: all_to_all, synapse: {pull: {lag: 0.3}}}}
"""


def test_oscillators_of_kuramoto_and_sakaguchi() -> None:
    """Twenty phases (1986), each pulled by all others with a lag: up to 1.8e2 rad."""
    omega, others = 1 + 0.05 * np.arange(20), ~np.eye(20, dtype=np.bool_)

    def phases(t: float, theta: FloatArray) -> FloatArray:
        pulled: FloatArray = np.sin(theta[None, :] - theta[:, None] - 0.3) / 20
        found: FloatArray = omega + pulled.sum(axis=1, where=others)
        return found

    start = (0.3 * np.arange(20) ** 2).tolist()
    expected = exact(phases, start, 0.0125 * 80, 55, rtol=1e-13)
    found = run(KURAMOTO, 55 * 80)[::80]
    assert 180 < expected.max() < 190
    assert np.abs(found - expected).max() < 8e-10


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
