"""The built-in definitions: each against a plain computation over 200 steps, on both backends, and against what is
published of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import pytest

import neurovis_spec as nv
from neurovis_spec.compiler.program import ACTIVATION, MODEL, RULE
from neurovis_spec.compiler.values.builtin import builtin_definitions, libraries
from neurovis_spec.runtime.recording import Recording

BACKENDS = ("reference", "numpy")
STEPS = 200
FloatArray = npt.NDArray[np.float64]


def noise(*shape: int, seed: int = 1) -> FloatArray:
    return np.random.default_rng(seed).normal(0, 1, shape)


def on_both(text: str, inputs: Mapping[str, npt.ArrayLike] | None = None, steps: int = STEPS) -> Recording:
    """The run of a spec, the same on both backends (whose tanh and exp may differ in the last bit)."""
    network = nv.compile_text(text)
    assert network.warnings == ()
    plain, fast = (network.run(steps, inputs, backend=backend) for backend in BACKENDS)
    np.testing.assert_allclose(fast.activity, plain.activity, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(fast.weights, plain.weights, rtol=1e-13, atol=1e-15)
    return fast


# ---- activations -------------------------------------------------------------------------------------------------


def line(x: float) -> float:
    """From (−0.5, 2) to (1, −1), constant outside."""
    return 2 - 3 * (min(max(x, -0.5), 1) + 0.5) / 1.5


ACTIVATIONS: Mapping[str, Callable[[float], float]] = {
    "identity": lambda x: x,
    "tanh": math.tanh,
    "sigmoid": lambda x: 1 / (1 + math.exp(-x)),
    "relu": lambda x: x if x > 0 else 0,
    "leaky_relu": lambda x: x if x > 0 else 0.01 * x,
    "{leaky_relu: {slope: 0.2}}": lambda x: x if x > 0 else 0.2 * x,
    "softplus": lambda x: math.log(1 + math.exp(x)),
    "step": lambda x: float(x >= 0),
    "{step: {threshold: 0.5}}": lambda x: float(x >= 0.5),
    "sign": lambda x: math.copysign(1, x) if x else 0,
    "sin": math.sin,
    "cos": math.cos,
    "gaussian": lambda x: math.exp(-x * x),
    "{gaussian: {sigma: 3}}": lambda x: math.exp(-3 * x * x),
    "clip": lambda x: min(max(x, -1), 1),
    "{clip: {low: 0, high: 0.5}}": lambda x: min(max(x, 0), 0.5),
    "piecewise_linear": lambda x: min(max(x, -1), 1),
    "{piecewise_linear: {x0: -0.5, y0: 2, x1: 1, y1: -1}}": line,
}


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_an_activation(activation: str) -> None:
    x = np.concatenate([np.linspace(-5, 5, STEPS - 4), [0.0, 0.5, -0.5, 1.0]])
    text = f"neurovis: 1\nname: x\ninputs: {{x: {{}}}}\nneurons: {{A: {{input: x, activation: {activation}}}}}"
    expected = [ACTIVATIONS[activation](value) for value in x.tolist()]
    np.testing.assert_allclose(on_both(text, {"x": x})["A"], expected, rtol=1e-14, atol=1e-15)


def test_softplus_does_not_overflow() -> None:
    text = "neurovis: 1\nname: x\ninputs: {x: {}}\nneurons: {A: {input: x, activation: softplus}}"
    assert on_both(text, {"x": [1e4, -1e4]}, 2)["A"].tolist() == [1e4, 0]


# ---- models ------------------------------------------------------------------------------------------------------


def static(u: FloatArray) -> list[float]:
    return [math.tanh(x) for x in u]


def leaky_integrator(u: FloatArray, leak: float = 0.1) -> list[float]:
    v, a = 0.0, []
    for x in u:
        v = (1 - leak) * v + leak * x
        a.append(math.tanh(v))
    return a


def adaptive(u: FloatArray, leak: float = 0.1, strength: float = 1, rate: float = 0.01) -> list[float]:
    v, b, a = 0.0, 0.0, []
    for x in u:
        v, b = (1 - leak) * v + leak * (x - strength * b), (1 - rate) * b + rate * max(v, 0)
        a.append(math.tanh(v))
    return a


def hysteresis(u: FloatArray, low: float = -0.5, high: float = 0.5) -> list[float]:
    s, a = 0, []
    for x in u:
        if x > high:
            s = 1
        elif x < low:
            s = 0
        a.append(math.tanh(s))
    return a


def integrate_and_fire(u: FloatArray, leak: float = 0.1, threshold: float = 1, reset: float = 0) -> list[float]:
    v, a = 0.0, []
    for x in u:
        v = (reset if v >= threshold else (1 - leak) * v) + x
        a.append(float(v >= threshold))
    return a


def izhikevich(
    u: FloatArray, a: float = 0.02, b: float = 0.2, c: float = -65, d: float = 8, h: float = 1
) -> list[float]:
    potential, recovery, result = -65.0, -13.0, []
    for x in u:
        if potential >= 30:
            potential, recovery = c, recovery + d
        potential, recovery = (
            potential + h * (0.04 * potential**2 + 5 * potential + 140 - recovery + x),
            recovery + h * a * (b * potential - recovery),
        )
        result.append(math.tanh(potential))
    return result


Model = Callable[..., list[float]]
MODELS: tuple[tuple[Model, dict[str, float]], ...] = (
    (static, {}),
    (leaky_integrator, {}),
    (leaky_integrator, {"leak": 0.4}),
    (adaptive, {}),
    (adaptive, {"leak": 0.5, "strength": 2, "rate": 0.2}),
    (hysteresis, {}),
    (hysteresis, {"low": -1.5, "high": 1}),
    (integrate_and_fire, {}),
    (integrate_and_fire, {"leak": 0.02, "threshold": 0.7, "reset": -0.3}),
    (izhikevich, {}),
    (izhikevich, {"a": 0.1, "b": 0.25, "c": -60, "d": 2, "h": 0.5}),
)


def neuron(model: str, activation: str = "tanh") -> str:
    used = "" if "integrate_and_fire" in model else f", activation: {activation}"
    group = f"{{input: u{used}, model: {model}}}"
    return f"neurovis: 1\nname: x\ninputs: {{u: {{}}}}\nneurons: {{A: {group}}}"


@pytest.mark.parametrize(("model", "parameters"), MODELS)
def test_a_model(model: Model, parameters: dict[str, float]) -> None:
    settings = ", ".join(f"{name}: {value}" for name, value in parameters.items())
    text = neuron(f"{{{model.__name__}: {{{settings}}}}}" if parameters else model.__name__)
    u = noise(STEPS) * (8 if model is izhikevich else 1) + 0.3
    expected = model(u, **parameters)
    if model is not static:
        assert len(set(expected)) > 1
    np.testing.assert_allclose(on_both(text, {"u": u})["A"], expected, rtol=1e-9, atol=1e-12)


def test_every_model_and_rule_is_among_those_tested() -> None:
    definitions = builtin_definitions()
    elsewhere = {
        name  # what flows or fires, and what waits for spikes
        for kind in (MODEL, RULE)
        for name, one in definitions.of(kind).known().items()
        if one.definition.flows or one.definition.fires
    }
    assert {model.__name__ for model, _ in MODELS} == set(definitions.of(MODEL)) - elsewhere - {"cfc"}
    assert {learner.__name__ for learner, _ in RULES} == set(definitions.of(RULE)) - elsewhere
    # a group's shares are no function of one neuron's x: ``test_softmax.py``
    assert {name.strip("{").split(":")[0] for name in ACTIVATIONS} | {"softmax"} == set(definitions.of(ACTIVATION))


def test_every_definition_says_what_it_is() -> None:
    for library in libraries():
        for section in (library.activations, library.models, library.rules):
            assert all(definition.description is not None for definition in section.values())


def spikes(model: str, drive: float, steps: int) -> FloatArray:
    """The steps at which a neuron under a constant drive spikes."""
    text = neuron(model, "{step: {threshold: 30}}")
    a = nv.compile_text(text).run(steps, {"u": np.full(steps, drive)})["A"]
    return np.flatnonzero(a).astype(np.float64)


def test_an_izhikevich_neuron_rests_at_minus_70_millivolts() -> None:
    # with b = 0.2 the nullclines meet at v = −70, u = −14 (Izhikevich 2003)
    text = neuron("izhikevich", "identity")
    assert nv.compile_text(text).run(1000, {"u": np.zeros(1000)})["A"][-1] == pytest.approx(-70, abs=1e-3)


def test_regular_spiking_begins_quickly_and_tires() -> None:
    # Izhikevich 2003, Fig. 2 (RS): intervals grow, then settle; some 20 to 30 spikes a second for a drive of 10
    intervals = np.diff(spikes("{izhikevich: {h: 0.25}}", 10, 4000)) * 0.25
    assert intervals[0] < 0.7 * intervals[-1]
    assert (np.diff(intervals) > -1).all()
    assert intervals[-1] == pytest.approx(intervals[-2], abs=0.5)
    assert 15 < 1000 / intervals[-1] < 35


def test_fast_spiking_is_fast_and_does_not_tire() -> None:
    # Fig. 2 (FS): periodic trains of high frequency, practically without adaptation
    intervals = np.diff(spikes("{izhikevich: {a: 0.1, d: 2, h: 0.25}}", 10, 4000)) * 0.25
    assert 1000 / intervals[-1] > 60
    assert intervals[2:].max() - intervals[2:].min() <= 0.5


def test_chattering_comes_in_bursts() -> None:
    # Fig. 2 (CH): bursts of closely spaced spikes
    intervals = np.diff(spikes("{izhikevich: {c: -50, d: 2, h: 0.25}}", 10, 4000)) * 0.25
    assert (intervals < 8).sum() > len(intervals) / 2
    assert (intervals > 15).sum() >= 5
    assert not ((intervals >= 8) & (intervals <= 15)).any()


def test_integrate_and_fire_has_its_rheobase_and_its_period() -> None:
    # v → drive/leak: below leak·threshold it never spikes, above every ⌈ln(1 − θ·leak/I) / ln(1 − leak)⌉ steps
    text = neuron("integrate_and_fire")
    for drive in (0.0999, 0.101, 0.15, 0.3, 0.7):
        spiking = np.flatnonzero(nv.compile_text(text).run(400, {"u": np.full(400, drive)})["A"])
        if drive < 0.1:
            assert len(spiking) == 0
        else:
            period = math.ceil(math.log(1 - 0.1 / drive) / math.log(0.9))
            assert set(np.diff(spiking).tolist()) == {period}


def test_hysteresis_keeps_what_it_was_told() -> None:
    u = np.concatenate([np.zeros(20), [0.6], np.zeros(50), [-0.4, 0.4], np.zeros(27), [-0.6], np.zeros(100)])
    a = on_both(neuron("hysteresis", "identity"), {"u": u})["A"]
    assert a.tolist() == [0] * 20 + [1] * 80 + [0] * 100


def test_an_adaptive_neuron_settles_where_fatigue_balances_the_drive() -> None:
    text = neuron("{adaptive: {strength: 3, rate: 0.05}}", "identity")
    a = on_both(text, {"u": np.full(1000, 2.0)}, 1000)["A"]
    assert a.max() > 0.9
    assert a[-1] == pytest.approx(2 / (1 + 3), abs=1e-9)


@pytest.mark.parametrize(
    ("inhibition", "behaviour"),
    [(1.05, "both"), (2.0, "turns"), (4.0, "one")],
)
def test_two_adaptive_neurons_that_inhibit_each_other(inhibition: float, behaviour: str) -> None:
    # Matsuoka 1985: with time constants τ = 20, T = 200 and fatigue β = 2.5 they take turns if 1 + τ/T < w < 1 + β
    text = f"""
neurovis: 1
name: matsuoka
neurons:
  N: {{count: 2, activation: relu, bias: [1, 1.01], model: {{adaptive: {{leak: 0.05, rate: 0.005, strength: 2.5}}}}}}
connections: {{N -> N: {{weight: {-inhibition}, pattern: all_to_all}}}}
"""
    a = nv.compile_text(text).run(12000)["N"][-4000:]
    leads = np.sign(a[:, 0] - a[:, 1])
    changes = int((np.diff(leads) != 0).sum())
    if behaviour == "turns":
        assert 4 <= changes <= 40
        assert a.min(axis=0).max() == 0  # each falls silent while the other is active
    else:
        assert changes == 0
        assert np.ptp(a, axis=0).max() < 1e-3
        assert (a[-1] > 0).tolist() == ([True, True] if behaviour == "both" else [False, True])


# ---- rules -------------------------------------------------------------------------------------------------------


@dataclass
class Synapse:
    """What a rule sees at one connection and step; ``keep`` is its memory."""

    pre: float = 0.0
    post: float = 0.0
    first: float = 0.0  # the signals, in the rule's order
    second: float = 0.0
    t: int = 0
    keep: dict[str, float] = field(default_factory=dict)

    def change(self, name: str, by: float) -> None:
        self.keep[name] = self.keep.get(name, 0.0) + by


def delta(w: float, s: Synapse, rate: float = 0.01) -> float:
    return w + rate * s.pre * (s.first - s.post)


def hebbian(w: float, s: Synapse, rate: float = 0.01) -> float:
    return w + rate * s.pre * s.post


def anti_hebbian(w: float, s: Synapse, rate: float = 0.01) -> float:
    return w - rate * s.pre * s.post


def oja(w: float, s: Synapse, rate: float = 0.01) -> float:
    return w + rate * s.post * (s.pre - s.post * w)


def bcm(w: float, s: Synapse, rate: float = 0.01, threshold_rate: float = 0.01) -> float:
    theta = s.keep.get("theta", 0.0)
    s.change("theta", threshold_rate * (s.post**2 - theta))
    return w + rate * s.pre * s.post * (s.post - theta)


def covariance(w: float, s: Synapse, rate: float = 0.01, average_rate: float = 0.01) -> float:
    p, q = s.keep.get("p", 0.0), s.keep.get("q", 0.0)
    s.change("p", average_rate * (s.pre - p))
    s.change("q", average_rate * (s.post - q))
    return w + rate * (s.pre - p) * (s.post - q)


def input_correlation(w: float, s: Synapse, rate: float = 0.01) -> float:
    last, s.keep["last"] = s.keep.get("last", s.first), s.first
    return w + rate * s.pre * (s.first - last)


def differential_hebbian(w: float, s: Synapse, rate: float = 0.01) -> float:
    last, s.keep["last"] = s.keep.get("last", s.post), s.post
    return w + rate * s.pre * (s.post - last)


EPISODE = 17


def reward_modulated(w: float, s: Synapse, rate: float = 0.01, smoothing: float = 0.9) -> float:
    s.change("eligibility", s.first * s.pre * (s.first - s.post))
    if (s.t + 1) % EPISODE == 0:
        baseline = s.keep.get("baseline", 0.0)
        w += rate * (s.second - baseline) * s.keep["eligibility"]
        s.keep.update(eligibility=0.0, baseline=smoothing * baseline + (1 - smoothing) * s.second)
    return w


def policy_gradient(w: float, s: Synapse, rate: float = 0.01, smoothing: float = 0.9) -> float:
    s.change("eligibility", s.first * s.pre)
    if (s.t + 1) % EPISODE == 0:
        baseline = s.keep.get("baseline", 0.0)
        w += rate * (s.second - baseline) * s.keep["eligibility"]
        s.keep.update(eligibility=0.0, baseline=smoothing * baseline + (1 - smoothing) * s.second)
    return w


def decay(w: float, s: Synapse, rate: float = 0.01) -> float:
    return w - rate * w


Learner = Callable[..., float]
RULES: tuple[tuple[Learner, dict[str, float]], ...] = (
    (delta, {"rate": 0.2}),
    (hebbian, {}),
    (anti_hebbian, {"rate": 0.03}),
    (oja, {"rate": 0.05}),
    (bcm, {}),
    (bcm, {"rate": 0.02, "threshold_rate": 0.1}),
    (covariance, {}),
    (covariance, {"rate": 0.05, "average_rate": 0.2}),
    (input_correlation, {"rate": 0.1}),
    (differential_hebbian, {"rate": 0.1}),
    (reward_modulated, {}),
    (reward_modulated, {"rate": 0.05, "smoothing": 0.5}),
    (policy_gradient, {}),
    (policy_gradient, {"rate": 0.05, "smoothing": 0.5}),
    (decay, {"rate": 0.02}),
)


def learned(rule: Learner, parameters: dict[str, float], x: FloatArray, teach: FloatArray, delay: int) -> FloatArray:
    """w[t] of two connections onto one linear neuron, step by step, in plain Python."""
    synapses, w, weights = (Synapse(), Synapse()), [0.3, -0.2], []
    for t in range(len(x)):
        weights.append(list(w))
        past = t - delay
        pre = x[past].tolist() if past >= 0 else [0.0, 0.0]
        post = sum(weight * a for weight, a in zip(weights[past], pre, strict=True)) if past >= 0 else 0.0
        for i, synapse in enumerate(synapses):
            synapse.pre, synapse.post, synapse.t = pre[i], post, t
            synapse.first, synapse.second = teach[t].tolist()
            w[i] = rule(w[i], synapse, **parameters)
    return np.array(weights)


def one_target(rule: str, delay: int = 0, episode: str = "") -> str:
    return f"""
neurovis: 1
name: one_target
time: {{steps: {STEPS}{episode}}}
inputs: {{x: {{size: 2}}, one: {{}}, two: {{}}}}
neurons: {{X: {{count: 2, input: x}}, Y: {{}}, Z: {{input: two}}, W: {{input: one}}}}
connections: {{X -> Y: {{weight: 0.3 - 0.5*i, delay: {delay}, plasticity: {rule}}}}}
"""


@pytest.mark.parametrize("delay", [0, 1, 3])
@pytest.mark.parametrize(("learner", "parameters"), RULES)
def test_a_rule(learner: Learner, parameters: dict[str, float], delay: int) -> None:
    names = builtin_definitions().of(RULE).known()[learner.__name__].definition.signals
    given = [f"{name}: {value}" for name, value in parameters.items()]
    given += [f"{name}: {source}" for name, source in zip(names, ("one", "Z"), strict=False)]
    episode = f", episode: {EPISODE}" if learner in (reward_modulated, policy_gradient) else ""
    rule = f"{{{learner.__name__}: {{{', '.join(given)}}}}}"
    x, teach = noise(STEPS, 2) + 0.2, noise(STEPS, 2, seed=2)
    run = on_both(one_target(rule, delay, episode), {"x": x, "one": teach[:, 0], "two": teach[:, 1]})
    expected = learned(learner, parameters, x, teach, delay)
    assert np.abs(expected[-1] - expected[0]).min() > 1e-3
    np.testing.assert_allclose(run.weights, expected, rtol=1e-11, atol=1e-12)


def patterned(rule: str, x: FloatArray, **inputs: FloatArray) -> Recording:
    """A long run of two inputs onto one linear neuron."""
    return nv.compile_text(one_target(rule)).run(len(x), {"x": x, **inputs})


def test_oja_finds_the_first_principal_component() -> None:
    x = noise(20000, 2) @ np.array([[1.0, 0.6], [0.0, 0.5]])
    w = patterned("{oja: {rate: 0.002}}", x).weights[-4000:].mean(axis=0)
    _, vectors = np.linalg.eigh(x.T @ x)
    assert abs(w @ vectors[:, -1]) == pytest.approx(1, abs=0.01)
    assert np.linalg.norm(w) == pytest.approx(1, abs=0.02)


def test_bcm_comes_to_answer_one_of_two_inputs_with_2() -> None:
    # with n patterns, each as likely, the stable states answer one of them with n and no other
    # (Intrator and Cooper 1992, Neural Networks 5:3-17)
    which = np.arange(40000) % 2
    x = np.array([[1.0, 0.2], [0.2, 1.0]])[which]
    w = patterned("{bcm: {rate: 0.002, threshold_rate: 0.05}}", x).weights[-1]
    answers = sorted((np.array([[1.0, 0.2], [0.2, 1.0]]) @ w).tolist())
    assert answers == pytest.approx([0, 2], abs=0.15)


def test_covariance_grows_by_it_and_hebb_by_the_product() -> None:
    # sent 1 ± noise to a target that is driven by the second input alone: no covariance with the first
    x = np.stack([2 + noise(20000), noise(20000, seed=3)], axis=1)
    x[:, 1] += 1.5
    text = """
neurovis: 1
name: apart
inputs: {x: {size: 2}}
neurons: {X: {count: 2, input: x}, Y: {}}
connections:
  - X2 -> Y: {delay: 0}
  - X1 -> Y: {weight: 0, delay: 0, plasticity: {RULE: {rate: 1.0e-9}}}
"""
    growth = {
        rule: nv.compile_text(text.replace("RULE", rule)).run(20000, {"x": x}).weights[-1, 0] / 2e-5
        for rule in ("covariance", "hebbian")
    }
    assert growth["covariance"] == pytest.approx(0, abs=0.06)
    assert growth["hebbian"] == pytest.approx(3, abs=0.1)


def test_anti_hebbian_takes_the_common_part_away() -> None:
    # w → −E[x₁x₂]/E[x₁²], where the target is uncorrelated with the first input
    x = noise(30000, 2) @ np.array([[1.0, 0.8], [0.0, 1.0]])
    text = """
neurovis: 1
name: apart
inputs: {x: {size: 2}}
neurons: {X: {count: 2, input: x}, Y: {}}
connections:
  - X2 -> Y: {delay: 0}
  - X1 -> Y: {weight: 0, delay: 0, plasticity: {anti_hebbian: {rate: 0.002}}}
"""
    run = nv.compile_text(text).run(30000, {"x": x})
    expected = -(x[:, 0] @ x[:, 1]) / (x[:, 0] @ x[:, 0])
    assert run.weights[-10000:].mean() == pytest.approx(expected, abs=0.05)


def test_ico_stops_once_the_reflex_is_silent() -> None:
    # Porr and Wörgötter 2006: the predictive input learns to act before the disturbance until there is no reflex left
    text = """
neurovis: 1
name: ico
inputs:
  warning: {expression: 1 if k % 100 >= 10 and k % 100 < 27 else 0}
  disturbance: {expression: 0.5 if k % 100 >= 25 and k % 100 < 27 else 0}
neurons:
  P: {input: warning, model: {leaky_integrator: {leak: 0.5}}}
  A: {}
  R: {input: disturbance, activation: relu}
connections:
  P -> A: {weight: 0, delay: 0, plasticity: {input_correlation: {rate: 0.3, reflex: R}}, bounds: [0, 5]}
  A -> R: {weight: -1, delay: 0}
"""
    run = on_both(text, steps=6000)
    w, reflex = run.weights[:, 0], run["R"]
    assert w[1000] - w[0] > 10 * (w[-1] - w[-1001])
    assert reflex[:100].max() == 0.5
    assert reflex[-1000:].max() < 0.02
    assert w[-1] == pytest.approx(w[-1001], abs=2e-3)


def test_ico_is_still_while_the_reflex_is() -> None:
    x, reflex = noise(STEPS, 2), np.full(STEPS, 0.7)
    w = patterned("{input_correlation: {rate: 0.1, reflex: one}}", x, one=reflex).weights
    assert (w == w[0]).all()  # at step 0, too: from nothing to 0.7 is no change


def test_differential_hebbian_tells_before_from_after() -> None:
    # a pulse that comes before the target's rise strengthens, one that comes before its fall weakens (Kosko 1986)
    text = """
neurovis: 1
name: timing
inputs: {early: {}, late: {}, rise: {}}
neurons: {E: {input: early}, L: {input: late}, R: {input: rise}, Y: {}}
connections:
  R -> Y: {delay: 0}
  E + L -> Y: {weight: 0, delay: 0, plasticity: {differential_hebbian: {rate: 0.1}}}
"""
    early, late, rise = np.zeros(50), np.zeros(50), np.zeros(50)
    early[18:22], rise[20:30], late[28:32] = 1, 1, 1
    run = on_both(text, {"early": early, "late": late, "rise": rise}, 50)
    assert run.weight("E -> Y")[-1] > 0.05
    assert run.weight("L -> Y")[-1] < -0.05


def test_decay_is_geometric() -> None:
    w = on_both(one_target("{decay: {rate: 0.02}}"), {"x": noise(STEPS, 2)}).weights
    np.testing.assert_allclose(w, np.outer(0.98 ** np.arange(STEPS), [0.3, -0.2]), rtol=1e-12)
