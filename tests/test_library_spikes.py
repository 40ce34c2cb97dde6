"""The models of the library that fire, and the synapses and rules that wait for spikes: each against a closed form, an
integrator of high order, or a plain loop."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import neurovis_spec as nv
from neurovis_spec.arrays import BoolArray, FloatArray
from neurovis_spec.manual.builtins import builtins
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record


class Run(NamedTuple):
    activity: FloatArray  # (steps + 1, neurons)
    shown: FloatArray  # (asked for, steps + 1, members)
    weights: FloatArray  # (steps + 1, connections that learn)


def run(spec: str, time: str, steps: int, states: str = "") -> Run:
    """Steps 0 to ``steps``, with the states or outputs asked for (``"A.v; (A -> B).g"``)."""
    asked = [one for one in states.split("; ") if one]
    shown = ", ".join(f'"o{number}": {one}' for number, one in enumerate(asked))
    text = f"neurovis: 1\nname: x\ntime: {time}\nros: {{rate: 100}}\n{spec}\noutputs: {{{shown}}}\n"
    found = record(nv.compile_text(text).network, Course(steps + 1, backend="numpy"))
    values = np.array([found[f"o{number}"].reshape(steps + 1, -1) for number in range(len(asked))])
    return Run(found.activity, values, found.weights)


def solved(flow: Callable[[float, FloatArray], object], start: list[float], end: float, points: int) -> FloatArray:
    """The solution of an equation at so many points from 0 to an end, in a row each."""
    at = np.linspace(0, end, points)
    found = solve_ivp(flow, (0, end), start, "DOP853", at, rtol=1e-12, atol=1e-13)
    return np.asarray(found.y.T, dtype=np.float64)


class Cell(NamedTuple):
    """A neuron that fires, as its paper has it."""

    flow: Callable[[FloatArray], FloatArray]
    start: list[float]
    fires: Callable[[FloatArray], bool]
    reset: Callable[[FloatArray], list[float]]
    rests: int = 0  # for how many steps its first state stays


def by_hand(cell: Cell, dt: float, steps: int, method: str = "rk4") -> tuple[FloatArray, list[int]]:
    """What a loop makes of it: the states at steps 0 to ``steps``, and when it fires."""
    x, left, found, fired = np.array(cell.start, dtype=np.float64), 0, [np.array(cell.start)], []

    def flow(x: FloatArray) -> FloatArray:
        slopes = np.asarray(cell.flow(x), dtype=np.float64)
        if left:
            slopes[0] = 0
        return slopes

    for k in range(1, steps + 1):
        if method == "euler":
            x = x + dt * flow(x)
        else:
            a = flow(x)
            b = flow(x + dt / 2 * a)
            c = flow(x + dt / 2 * b)
            x = x + dt / 6 * (a + 2 * b + 2 * c + flow(x + dt * c))
        if left:
            left -= 1
        elif cell.fires(x):
            x, left = np.array(cell.reset(x), dtype=np.float64), cell.rests
            fired.append(k)
        found.append(x)
    return np.array(found), fired


def fired(activity: FloatArray, neuron: int = 0) -> list[int]:
    return [int(step) for step in np.flatnonzero(activity[:, neuron])]


def train(steps: list[int], dt: float) -> str:
    """Spike times in seconds that fall into these steps of dt milliseconds."""
    return "[" + ", ".join(repr(float(step * dt / 1000)) for step in steps) + "]"


# ---- models ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("drive", "rests"), [(24.0, 20), (21.0, 0), (60.0, 7)])
def test_lif_in_closed_form(drive: float, rests: int) -> None:
    """From the reset on towards the drive, which it never reaches; integrated exactly by ``exponential``."""
    model = f"{{lif: {{rest: 0, threshold: 20, reset: 10, refractory: {rests / 10}}}}}"
    found = run(
        f"neurons: {{N: {{model: {model}, bias: {drive}}}}}", "{dt: 0.1 ms, integrate: exponential}", 3000, "N.v"
    )
    begin, since, v, spikes = 0.0, 0, [0.0], []
    for k in range(1, 3001):
        now = drive + (begin - drive) * np.exp(-max(k - since, 0) * 0.1 / 20)
        if k > since and now >= 20:
            begin, since, now = 10.0, k + rests, 10.0
            spikes.append(k)
        v.append(now)
    assert fired(found.activity) == spikes
    assert len(spikes) > 3
    assert np.abs(found.shown[0, :, 0] - v).max() < 1e-13
    period = rests + int(np.ceil(20 * np.log((drive - 10) / (drive - 20)) / 0.1))
    assert set(np.diff(spikes).tolist()) == {period}


def test_spikes_kick_a_lif() -> None:
    spec = f"""inputs: {{s: {{spikes: {{times: [{train([10, 50, 300], 0.1)}]}}, size: 1}}}}
neurons: {{S: {{model: spike_source, input: s}}, N: {{model: lif}}}}
connections: {{S -> N: {{weight: 3, port: pulses, delay: 15}}}}"""
    found = run(spec, "{dt: 0.1 ms, integrate: exponential}", 500, "N.v")
    assert fired(found.activity) == [10, 50, 300]
    k = np.arange(501)
    expected = -70 + sum(3 * np.where(k >= at, np.exp(-np.maximum(k - at, 0) * 0.1 / 20), 0) for at in (25, 65, 315))
    assert np.abs(found.shown[0, :, 0] - expected).max() < 1e-12


def test_currents_of_lif_current_decay() -> None:
    """The potential behind one spike at each port, a difference of two exponentials."""
    spec = f"""inputs: {{s: {{spikes: {{times: [{train([10], 0.01)}, {train([400], 0.01)}]}}, size: 2}}}}
neurons: {{S: {{count: 2, model: spike_source, input: s}}, N: {{model: lif_current}}}}
connections:
  S1 -> N: {{weight: 87.8, port: excitatory}}
  S2 -> N: {{weight: -351.2, port: inhibitory}}"""
    found = run(spec, "{dt: 0.01 ms}", 3000, "N.v; N.ie; N.ii")
    t = np.arange(3001) * 0.01
    expected = np.full(3001, -65.0)
    for weight, at in ((87.8, 0.11), (-351.2, 4.01)):
        since = np.maximum(t - at, 0)
        expected += weight / 250 / (1 / 0.5 - 1 / 10) * (np.exp(-since / 10) - np.exp(-since / 0.5))
    assert np.abs(found.shown[0, :, 0] - expected).max() < 1e-8
    for number, weight, at in ((1, 87.8, 11), (2, -351.2, 401)):
        k = np.arange(3001)
        left = np.where(k >= at, weight * np.exp(-np.maximum(k - at, 0) * 0.02), 0)
        assert np.abs(found.shown[number, :, 0] - left).max() < 1e-6


def test_conductances_of_lif_conductance_decay_and_pull() -> None:
    spec = f"""inputs: {{s: {{spikes: {{times: [{train([10], 0.05)}]}}, size: 1}}}}
neurons: {{S: {{model: spike_source, input: s}}, N: {{model: lif_conductance, initial: {{v: -55}}}}}}
connections:
  - S -> N: {{weight: 0.2, port: excitatory}}
  - S -> N: {{weight: 1.5, port: inhibitory}}"""
    found = run(spec, "{dt: 0.05 ms}", 1011, "N.v; N.ge; N.gi").shown[:, 11:, 0].T

    def flow(t: float, x: FloatArray) -> list[float]:
        v, ge, gi = x
        return [(-60 - v - ge * v + gi * (-80 - v)) / 20, -ge / 5, -gi / 10]

    start = -60 + 5 * np.exp(-0.55 / 20)
    expected = solved(flow, [start, 0.2, 1.5], 50.0, 1001)
    assert np.abs(found - expected).max() < 1e-8
    assert expected[:, 0].min() < -61


def test_a_driven_lif_conductance_fires_and_rests() -> None:
    spec = """neurons: {N: {model: lif_conductance, bias: {drive: 15, excitatory: 0}, initial: {ge: 0.3}}}"""
    found = run(spec, "{dt: 0.1 ms}", 2000, "N.v; N.ge")
    cell = Cell(
        lambda x: np.array([(-60 - x[0] - x[1] * x[0] + 15) / 20, -x[1] / 5]),
        [-60.0, 0.3],
        lambda x: bool(x[0] >= -50),
        lambda x: [-60.0, x[1]],
        rests=50,
    )
    expected, spikes = by_hand(cell, 0.1, 2000)
    assert fired(found.activity) == spikes
    assert len(spikes) > 5
    assert np.abs(found.shown[:, :, 0].T - expected).max() < 1e-12


def test_conductances_of_lif_conductance_alpha_rise_to_the_weight() -> None:
    spec = f"""inputs: {{s: {{spikes: {{times: [{train([10], 0.01)}]}}, size: 1}}}}
neurons: {{S: {{model: spike_source, input: s}}, N: {{model: lif_conductance_alpha}}}}
connections:
  - S -> N: {{weight: 8, port: excitatory}}
  - S -> N: {{weight: 3, port: inhibitory}}"""
    v, ge, gi = run(spec, "{dt: 0.01 ms}", 1511, "N.v; N.ge; N.gi").shown[:, 11:, 0]
    t = np.arange(1501) * 0.01
    assert np.abs(ge - 8 * t / 0.2 * np.exp(1 - t / 0.2)).max() < 1e-5
    assert np.abs(gi - 3 * t / 2 * np.exp(1 - t / 2)).max() < 1e-9
    assert ge.max() == pytest.approx(8, abs=1e-5)
    assert t[gi.argmax()] == 2.0

    def flow(t: float, x: FloatArray) -> list[float]:
        e, i = 8 * t / 0.2 * np.exp(1 - t / 0.2), 3 * t / 2 * np.exp(1 - t / 2)
        return [(16.6667 * (-70 - x[0]) - e * x[0] + i * (-85 - x[0])) / 250]

    expected = solved(flow, [-70.0], 15.0, 1501)[:, 0]
    assert np.abs(v - expected).max() < 1e-6
    assert expected.max() > -69


def test_adex_tires() -> None:
    found = run("neurons: {N: {model: adex, bias: 1000}}", "{dt: 0.05 ms}", 3000, "N.v; N.w")

    def flow(x: FloatArray) -> FloatArray:
        v, w = x
        top = min(v, -40.4)
        current = 30 * (-70.6 - v) + 30 * 2 * np.exp((top + 50.4) / 2) - w + 1000
        return np.array([current / 281, (4 * (top + 70.6) - w) / 144])

    cell = Cell(flow, [-70.6, 0.0], lambda x: bool(x[0] >= -40.4), lambda x: [-70.6, x[1] + 80.5])
    expected, spikes = by_hand(cell, 0.05, 3000)
    assert fired(found.activity) == spikes
    assert len(spikes) > 5
    assert np.diff(spikes)[-1] > 1.5 * np.diff(spikes)[0]
    assert np.abs(found.shown[:, :, 0].T - expected).max() < 1e-9


def test_conductances_of_adex_pull() -> None:
    spec = f"""inputs: {{s: {{spikes: {{times: [{train([10], 0.05)}]}}, size: 1}}}}
neurons: {{S: {{model: spike_source, input: s}}, N: {{model: adex}}}}
connections:
  - S -> N: {{weight: 6, port: excitatory}}
  - S -> N: {{weight: 9, port: inhibitory}}"""
    found = run(spec, "{dt: 0.05 ms}", 1011, "N.v; N.w; N.ge; N.gi").shown[:, 11:, 0].T

    def flow(t: float, x: FloatArray) -> list[float]:
        v, w, ge, gi = x
        current = 30 * (-70.6 - v) + 60 * np.exp((v + 50.4) / 2) - w - ge * v + gi * (-80 - v)
        return [current / 281, (4 * (v + 70.6) - w) / 144, -ge / 5, -gi / 10]

    assert np.abs(found - solved(flow, found[0].tolist(), 50.0, 1001)).max() < 1e-7
    assert np.ptp(found[:, 0]) > 1


@pytest.mark.parametrize(("c", "d", "count"), [(-65, 8, 23), (-50, 2, 87)])
def test_izhikevich_ode_to_the_last_bit(c: float, d: float, count: int) -> None:
    """Regular spiking, as by default, and chattering."""
    model = f"{{izhikevich_ode: {{c: {c}, d: {d}}}}}"
    time = "{dt: 0.1 ms, integrate: euler}"
    found = run(f"neurons: {{N: {{model: {model}, bias: 10}}}}", time, 10000, "N.v; N.u")

    def flow(x: FloatArray) -> FloatArray:
        v, u = x
        return np.array([0.04 * (v * v) + 5 * v + 140 - u + 10, 0.02 * (0.2 * v - u)])

    cell = Cell(flow, [-65.0, -13.0], lambda x: bool(x[0] >= 30), lambda x: [c, x[1] + d])
    expected, spikes = by_hand(cell, 0.1, 10000, "euler")
    assert fired(found.activity) == spikes
    assert np.abs(found.shown[:, :, 0].T - expected).max() == 0
    assert len(spikes) == count


def test_qif_fires_at_the_rate_of_its_normal_form() -> None:
    """From -peak to the peak it takes 2 tau/sqrt(u) atan(peak/sqrt(u))."""
    bias = [1, 0.25, 4, -1]
    found = run(f"neurons: {{N: {{count: 4, model: qif, bias: {bias}}}}}", "{dt: 0.01 ms}", 30000, "N.v")
    for neuron, u in enumerate(bias[:3]):
        period = 20 / np.sqrt(u) * np.arctan(100 / np.sqrt(u))
        assert period == pytest.approx(10 * np.pi / np.sqrt(u), rel=0.02)
        intervals = np.diff(fired(found.activity, neuron)) * 0.01
        assert len(intervals) >= 3
        assert np.abs(intervals - period).max() < 0.12  # of a step at the peak, where v grows by 10 in one
    assert np.abs(found.shown[0, :, 3] + 1).max() == 0  # below 0 it rests at -sqrt(-u)


def crossings(v: FloatArray) -> BoolArray:
    """Where it comes up to 0."""
    return np.asarray(np.r_[False, (v[1:] >= 0) & (v[:-1] < 0)], dtype=np.bool_)


@pytest.mark.parametrize(
    ("model", "drive", "dt", "steps"), [("hodgkin_huxley", 10, 0.01, 5000), ("morris_lecar", 100, 0.1, 4000)]
)
def test_cells_without_a_reset_fire_once_an_upstroke(model: str, drive: float, dt: float, steps: int) -> None:
    found = run(
        f"neurons: {{N: {{model: {model}, bias: {drive}}}, R: {{model: {model}}}}}",
        f"{{dt: {dt} ms}}",
        steps,
        "N.spike; R.spike",
    )
    assert ((found.shown[0, :, 0] == 1) == crossings(found.activity[:, 0])).all()
    assert 3 <= found.shown[0].sum() <= 5
    assert found.shown[1].sum() == 0


# ---- synapses ----------------------------------------------------------------------------------------------------

#: Steps of 0.05 ms in which a spike arrives.
ARRIVED = [11, 31, 32, 301]
T: FloatArray = np.arange(1001, dtype=np.float64) * 0.05


def behind_spikes(synapse: str, states: str, begin: float = -65) -> FloatArray:
    """What ARRIVED do by a synapse of weight 3 to a cell with a leak of 1 in 20 ms that never fires: its potential, and
    the states asked for, a row each."""
    spec = f"""inputs: {{s: {{spikes: {{times: [{train([at - 1 for at in ARRIVED], 0.05)}]}}, size: 1}}}}
neurons: {{S: {{model: spike_source, input: s}}, N: {{model: {{lif: {{threshold: 1000}}}}, initial: {{v: {begin}}}}}}}
connections: {{S -> N: {{weight: 3, synapse: {synapse}}}}}"""
    return run(spec, "{dt: 0.05 ms}", 1000, f"N.v; {states}").shown[:, :, 0]


def each(course: Callable[[FloatArray], FloatArray], t: FloatArray = T) -> FloatArray:
    """What all that have arrived do, one of which does this."""
    total = np.zeros_like(t)
    for at in ARRIVED:
        since = t - at * 0.05
        total += np.where(since >= -1e-9, course(np.maximum(since, 0)), 0)
    return total


def pulled(conductance: Callable[[float], float], reversal: float) -> FloatArray:
    """The potential of that cell, spike by spike, at steps 0 to 1,000."""
    found, v = [np.array([-65.0])], -65.0
    for start, stop in zip([0, *ARRIVED], [*ARRIVED, 1000], strict=True):

        def flow(
            t: float, x: FloatArray, arrived: tuple[int, ...] = tuple(at for at in ARRIVED if at <= start)
        ) -> list[float]:
            g = sum(conductance(max(t - at * 0.05, 0)) for at in arrived)
            return [(-70 - x[0] + g * (reversal - x[0])) / 20]

        at = np.linspace(start * 0.05, stop * 0.05, stop - start + 1)
        part = solve_ivp(flow, (at[0], at[-1]), [v], "DOP853", at, rtol=1e-11, atol=1e-12).y[0]
        found.append(part[1:])
        v = float(part[-1])
    return np.concatenate(found)


def test_an_exponential_conductance() -> None:
    v, g = behind_spikes("exponential", "(S -> N).g")
    assert np.abs(g - each(lambda t: 3 * np.exp(-t / 5))).max() < 1e-7
    assert np.abs(v - pulled(lambda t: 3 * float(np.exp(-t / 5)), 0)).max() < 1e-5


def test_an_alpha_conductance_is_greatest_after_tau() -> None:
    v, g = behind_spikes("{alpha: {tau: 2, E: -80}}", "(S -> N).g")
    assert np.abs(g - each(lambda t: 3 * t / 2 * np.exp(1 - t / 2))).max() < 1e-6
    assert (3 * T / 2 * np.exp(1 - T / 2)).max() == 3
    assert T[(T / 2 * np.exp(1 - T / 2)).argmax()] == 2
    assert np.abs(v - pulled(lambda t: 3 * t / 2 * float(np.exp(1 - t / 2)), -80)).max() < 1e-5


def test_a_double_exponential_conductance_rises_to_the_weight() -> None:
    v, rise, decay = behind_spikes("double_exponential", "(S -> N).rise; (S -> N).decay")
    most = np.log(5) * 5 / 4  # when it is greatest, for time constants of 1 and 5
    scale = 3 / (np.exp(-most / 5) - np.exp(-most))
    assert np.abs(decay - rise - each(lambda t: scale * (np.exp(-t / 5) - np.exp(-t)))).max() < 1e-6
    assert (scale * (np.exp(-T / 5) - np.exp(-T))).max() == pytest.approx(3, rel=1e-3)
    assert np.abs(v - pulled(lambda t: scale * float(np.exp(-t / 5) - np.exp(-t)), 0)).max() < 1e-5


def test_nmda_saturates_and_is_blocked_by_magnesium() -> None:
    v, s, x = behind_spikes("nmda", "(S -> N).s; (S -> N).x")
    assert np.abs(x - each(lambda t: np.exp(-t / 2))).max() < 1e-6

    def flow(t: float, y: FloatArray) -> list[float]:
        v, s, x = y
        block = 1 / (1 + np.exp(-0.062 * v) / 3.57)
        return [(-70 - v + 3 * s * block * (0 - v)) / 20, 0.5 * x * (1 - s) - s / 100, -x / 2]

    y, expected = np.array([-65.0, 0.0, 0.0]), [np.array([[-65.0, 0.0, 0.0]])]
    for start, stop in zip([0, *ARRIVED], [*ARRIVED, 1000], strict=True):
        part = solved(flow, y.tolist(), (stop - start) * 0.05, stop - start + 1)
        y = part[-1] + [0, 0, 1]
        part[-1] = y
        expected.append(part[1:])
    found = np.concatenate(expected)
    found[-1, 2] -= 1  # none arrives at the end
    assert np.abs(np.stack([v, s, x], axis=1) - found).max() < 1e-5
    assert 0.5 < s.max() < 1


def test_resources_of_tsodyks_and_markram_are_used_and_come_back() -> None:
    """From spike to spike in closed form, for a cell in which what is released adds up."""
    times = [10, 30, 50, 60, 61, 200, 900]
    spec = f"""inputs: {{s: {{spikes: {{times: [{train(times, 1)}]}}, size: 1}}}}
neurons: {{S: {{model: spike_source, input: s}}, N: {{model: {{lif: {{threshold: 1000, tau: 1.0e+9}}}}}}}}
connections: {{S -> N: {{weight: 2, port: pulses, delay: 3, synapse: tsodyks_markram}}}}"""
    time = "{dt: 1 ms, integrate: exponential}"
    v, released = run(spec, time, 1000, "N.v; (S -> N).released").shown[:, :, 0]
    u, x, last, expected = 0.0, 1.0, 0, np.full(1001, -70.0)
    for at in times:
        u, x = u * np.exp(-(at - last) / 1000), 1 + (x - 1) * np.exp(-(at - last) / 800)
        u += 0.5 * (1 - u)
        expected[at + 3 :] += 2 * u * x
        assert released[at + 3] == pytest.approx(u * x, abs=8e-14)
        x, last = x - u * x, at
    assert np.abs(v - expected).max() < 1e-5  # the leak
    steps = np.diff(v)[[at + 2 for at in times]]
    assert steps[0] == pytest.approx(1, abs=1e-6)
    assert steps[4] < 0.3


# ---- rules -------------------------------------------------------------------------------------------------------

PRE = [[3, 20, 21, 60, 110, 111, 112, 180], [5, 50, 90, 91, 130, 170, 171, 172], [10, 11, 12, 13, 14, 15, 150, 199]]
POST = [[5, 22, 55, 61, 100, 113, 150, 178], [5, 6, 7, 51, 89, 131, 173, 190], [12, 30, 31, 32, 33, 90, 149, 151]]
STEPS = 220


def learned(rule: str, delay: int = 1, initial: float = 0.5) -> FloatArray:
    """The weights of three connections from PRE to POST, which do not make their targets fire, as each step leaves them
    and the next one finds them: (steps + 1, 3)."""
    pre, post = (", ".join(train(one, 1) for one in trains) for trains in (PRE, POST))
    spec = f"""models:
  apart:
    ports: [aside]
    state: {{waiting: {{each_step: drive}}, told: {{jump: aside}}}}
    spike: {{when: waiting >= 1, set: {{waiting: 0}}}}
inputs:
  pre: {{spikes: {{times: [{pre}]}}, size: 3}}
  post: {{spikes: {{times: [{post}]}}, size: 3}}
  reward: {{expression: sin(t*40)}}
neurons:
  A: {{count: 3, model: spike_source, input: pre}}
  B: {{count: 3, model: apart, input: post}}
  R: {{input: reward}}
connections: {{A -> B: {{weight: {initial}, pattern: one_to_one, port: aside, delay: {delay}, plasticity: {rule}}}}}"""
    found = run(spec, "{dt: 1 ms, integrate: exponential}", STEPS + 1)
    assert [fired(found.activity, neuron) for neuron in range(6)] == PRE + POST
    return found.weights[1:]


def rule_by_loop(
    taus: dict[str, float],
    on_pre: Callable[[float, dict[str, float]], float],
    on_post: Callable[[float, dict[str, float]], float],
    then: Callable[[float, dict[str, float], int], float] = lambda w, x, k: w,
    delay: int = 1,
    initial: float = 0.5,
) -> FloatArray:
    """The weights that a loop makes: traces that decay, which spikes move, as they do weights."""
    found = np.full((STEPS + 1, 3), initial)
    for number, (pre, post) in enumerate(zip(PRE, POST, strict=True)):
        w, x = initial, dict.fromkeys(taus, 0.0)
        for k in range(1, STEPS + 1):
            for name, tau in taus.items():
                x[name] *= np.exp(-1 / tau)
            w = on_pre(w, x) if k - delay in pre else w
            w = on_post(w, x) if k in post else w
            w = then(w, x, k)
            found[k, number] = w
    return found


@pytest.mark.parametrize("delay", [1, 4])
def test_stdp_adds_all_pairs(delay: int) -> None:
    """In closed form: no step is gone through."""
    found = learned("{stdp: {tau_post: 30}}", delay)
    for number, (pre, post) in enumerate(zip(PRE, POST, strict=True)):
        arrived = np.array(pre, dtype=np.float64) + delay
        for k in range(STEPS + 1):
            apart = np.subtract.outer(np.array([at for at in post if at <= k]), arrived[arrived <= k])
            up, down = apart >= 0, apart < 0  # where both come in a step, what has arrived was first
            expected = 0.5 + 0.01 * np.exp(-apart[up] / 20).sum() - 0.0105 * np.exp(apart[down] / 30).sum()
            assert found[k, number] == pytest.approx(expected, abs=3e-15)
    assert np.ptp(found, axis=0).min() > 0.01


def test_stdp_multiplicative_shrinks_towards_its_bounds() -> None:
    def on_pre(w: float, x: dict[str, float]) -> float:
        x["a"] += 1
        return w - 0.3 * w * x["b"]

    def on_post(w: float, x: dict[str, float]) -> float:
        x["b"] += 1
        return w + 0.1 * (2 - w) * x["a"]

    found = learned("{stdp_multiplicative: {up: 0.1, down: 0.3, highest: 2}}")
    assert np.abs(found - rule_by_loop({"a": 20, "b": 20}, on_pre, on_post)).max() < 1e-14
    assert 0 < found.min() < 0.5 < found.max() < 2


def test_stdp_triplet_is_pfisters_and_gerstners() -> None:
    """Minimal numbers of the paper: tau_+ 16.8, tau_x 101, tau_- 33.7, tau_y 125."""

    def on_pre(w: float, x: dict[str, float]) -> float:
        w -= x["o1"] * (0.007 + 0.00023 * x["r2"])
        x["r1"] += 1
        x["r2"] += 1
        return w

    def on_post(w: float, x: dict[str, float]) -> float:
        w += x["r1"] * (5e-10 + 0.0062 * x["o2"])
        x["o1"] += 1
        x["o2"] += 1
        return w

    expected = rule_by_loop({"r1": 16.8, "r2": 101, "o1": 33.7, "o2": 125}, on_pre, on_post)
    found = learned("stdp_triplet")
    assert np.abs(found - expected).max() < 1.4e-14
    assert np.ptp(found, axis=0).min() > 0.02


def test_stdp_reward_waits_for_it() -> None:
    def on_pre(w: float, x: dict[str, float]) -> float:
        x["c"] += x["b"]
        x["a"] += 1
        return w

    def on_post(w: float, x: dict[str, float]) -> float:
        x["c"] += x["a"]
        x["b"] -= 1.05
        return w

    def then(w: float, x: dict[str, float], k: int) -> float:
        return w + 0.001 * math.sin(k * 0.001 * 40) * x["c"]

    expected = rule_by_loop({"a": 20, "b": 20, "c": 1000}, on_pre, on_post, then)
    found = learned("{stdp_reward: {rate: 0.001, reward: R}}")
    assert np.abs(found - expected).max() < 1e-14
    assert np.ptp(found, axis=0).min() > 0.01


def test_homeostatic_scaling_goes_on_until_the_rate_is_the_goal() -> None:
    def on_post(w: float, x: dict[str, float]) -> float:
        x["measured"] += 1000 / 50
        return w

    def then(w: float, x: dict[str, float], k: int) -> float:
        return w + 1e-4 * w * (30 - x["measured"])

    expected = rule_by_loop({"measured": 50}, lambda w, x: w, on_post, then)
    found = learned("{homeostatic_scaling: {rate: 1.0e-4, goal: 30, tau: 50}}")
    assert np.abs(found - expected).max() < 1.1e-14
    assert found.max() > 0.51  # before it fires
    assert found[-1].max() < found.max()


def test_vogels_inhibition_grows_where_the_target_fires_too_often() -> None:
    def on_pre(w: float, x: dict[str, float]) -> float:
        x["a"] += 1
        return w + 0.01 * (x["b"] - 2 * 10 * 0.02)

    def on_post(w: float, x: dict[str, float]) -> float:
        x["b"] += 1
        return w + 0.01 * x["a"]

    found = learned("{vogels_inhibitory: {rate: 0.01, goal: 10}}")
    assert np.abs(found - rule_by_loop({"a": 20, "b": 20}, on_pre, on_post)).max() < 1e-14
    assert found[-1].max() > 0.5
    assert (np.diff(found, axis=0) < 0).any()


def test_each_names_its_source_and_what_its_parameters_are() -> None:
    """Beside those of test_library_flows."""
    waiting = {
        "exponential", "alpha", "double_exponential", "nmda", "tsodyks_markram", "spike_source",
        "stdp", "stdp_multiplicative", "stdp_triplet", "stdp_reward", "homeostatic_scaling", "vogels_inhibitory",
    }  # fmt: skip
    for one in builtins():
        if one.name in waiting:
            waiting.remove(one.name)
            assert all(about for _, _, about in one.parameters)
            assert one.name == "spike_source" or re.search(r"\b(19|20)\d\d\b", one.about)
            nv.compile_text(f"neurovis: 1\nname: x\n{one.use}")
    assert not waiting
