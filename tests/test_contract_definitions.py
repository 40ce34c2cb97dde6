"""Definitions of one's own (§7): those of the contract as printed, the tables of what is built in, what they see."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np
import pytest
from click.testing import CliRunner
from small_specs import codes, compiled

from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiler.program import ACTIVATION, MODEL, RULE, SYNAPSE
from neurovis_spec.compiler.values.builtin import builtin_definitions
from neurovis_spec.compiler.values.definitions import Default
from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.unknown import UNKNOWN
from neurovis_spec.manual.builtins import Builtin, builtins

PRINTED = """\
activations:
  swish: {parameters: {beta: 1}, value: x * sigmoid(beta * x)}        # x: the combined input

models:
  leaky_integrator:
    parameters: {leak: 0.1}
    state: {v: {initial: 0, each_step: (1 - leak) * v + leak * drive}} # drive: u[t] of section 5
    activity: f(v)                                                    # f: the neuron's activation
  izhikevich:                                                         # Izhikevich 2003; h: milliseconds a step
    parameters: {a: 0.02, b: 0.2, c: -65, d: 8, h: 1}
    let: {v0: c if v >= 30 else v, u0: u + d if v >= 30 else u}       # intermediate values, in order
    state:
      v: {initial: -65, each_step: v0 + h * (0.04 * v0^2 + 5 * v0 + 140 - u0 + drive)}
      u: {initial: -13, each_step: u0 + h * a * (b * v0 - u0)}
    activity: f(v)

rules:
  delta:                                                              # Eq. 10
    parameters: {rate: 0.01}
    signals: [target]
    weight: {each_step: weight + rate * pre * (target - post)}
  reward_modulated:                                                   # Eq. 15
    parameters: {rate: 0.01, smoothing: 0.9}
    signals: [policy, reward]
    state:
      eligibility: {initial: 0, each_step: eligibility + policy * pre * (policy - post), each_episode: 0}
      baseline: {initial: 0, each_episode: smoothing * baseline + (1 - smoothing) * reward}
    weight: {each_episode: weight + rate * (reward - baseline) * eligibility}
"""
USE = """\
time: {episode: 7}
inputs: {s: {expression: 9*sin(k/3)}}
neurons:
  A: {input: s, model: leaky_integrator, activation: tanh}
  I: {input: s, model: {izhikevich: {h: 0.5}}}
  P: {bias: 0.3, noise: "normal(0, 1)"}
  O: {}
  Q: {}
connections:
  A -> O: {weight: 0.1, plasticity: {delta: {rate: 0.05, target: P}}}
  A -> Q: {weight: 0.1, plasticity: {reward_modulated: {policy: P, reward: O}}}
"""


def test_the_definitions_of_the_contract_are_the_built_in_ones() -> None:
    """As printed they replace these, each with a warning, and nothing of a run changes."""
    own, built_in = compiled(PRINTED + USE), compiled(USE)
    replaced = [item.message for item in own.warnings if item.code == "replaces-builtin"]
    assert len(replaced) == 4
    for name in ("leaky_integrator", "izhikevich", "delta", "reward_modulated"):
        assert any(f"'{name}'" in message for message in replaced)
    one, other = own.run(60), built_in.run(60)
    np.testing.assert_array_equal(one.activity, other.activity)
    np.testing.assert_array_equal(one.weights, other.weights)
    assert (one.weights[-1] != one.weights[0]).all()


def test_swish_is_what_it_says() -> None:
    """x · sigmoid(βx), with the default and with another β."""
    text = PRINTED + "neurons: {A: {bias: 2, activation: swish}, B: {bias: 2, activation: {swish: {beta: 0.5}}}}"
    assert compiled(text).run(1).activity[0] == pytest.approx([2 / (1 + np.exp(-2)), 2 / (1 + np.exp(-1))], rel=1e-15)


DEFAULTS = {
    "identity": {}, "tanh": {}, "sigmoid": {}, "relu": {}, "leaky_relu": {"slope": 0.01}, "softplus": {},
    "softmax": {"gain": 1},
    "step": {"threshold": 0}, "sign": {}, "sin": {}, "cos": {}, "gaussian": {"sigma": 1},
    "clip": {"low": -1, "high": 1}, "piecewise_linear": {"x0": -1, "y0": -1, "x1": 1, "y1": 1},
    "static": {}, "leaky_integrator": {"leak": 0.1}, "adaptive": {"leak": 0.1, "strength": 1, "rate": 0.01},
    "hysteresis": {"low": -0.5, "high": 0.5}, "integrate_and_fire": {"leak": 0.1, "threshold": 1, "reset": 0},
    "izhikevich": {"a": 0.02, "b": 0.2, "c": -65, "d": 8, "h": 1},
    "leaky": {"tau": 1, "theta": 0}, "fitzhugh_nagumo": {"tau": 1, "a": 0.7, "b": 0.8, "epsilon": 0.08},
    "matsuoka": {"tau": 1, "tau_fatigue": 12, "strength": 2.5}, "hopf": {"nu": 1, "mu": 1, "gamma": 8},
    "van_der_pol": {"mu": 1, "p": 1, "omega": 1},
    "wilson_cowan": {"tau": 10, "slope": 1.2, "threshold": 2.8, "refractory": 1},
    "jansen_rit": {"A": 3.25, "B": 22, "a": 100, "b": 50, "C": 135, "e0": 2.5, "v0": 6, "r": 0.56},
    "phase_oscillator": {"nu": 1}, "amplitude_oscillator": {"nu": 1, "R": 1, "a": 20},
    "ornstein_uhlenbeck": {"tau": 0.05, "mean": 0, "sigma": 1}, "cfc": {"ts": 1},
    "hodgkin_huxley": {"C": 1, "gNa": 120, "gK": 36, "gL": 0.3, "ENa": 50, "EK": -77, "EL": -54.387},
    "morris_lecar": {
        "C": 20, "gCa": 4.4, "gK": 8, "gL": 2, "ECa": 120, "EK": -84, "EL": -60,
        "V1": -1.2, "V2": 18, "V3": 2, "V4": 30, "phi": 0.04,
    },
    "graded": {"C": 1, "g": 10, "E": -35, "threshold": -35, "beta": 0.125, "up": 1, "down": 5},
    "danner": {
        "C": 10, "gNaP": 4.5, "gL": 4.5, "gE": 10, "gI": 10, "ENa": 50, "EL": -62.5, "EE": -10, "EI": -75,
        "threshold": -50, "top": 0,
    },
    "ltc": {"C": 1, "g": 1, "E": 0},
    "lif": {"tau": 20, "rest": -70, "threshold": -50, "reset": -60, "refractory": 2},
    "lif_current": {
        "tau": 10, "C": 250, "rest": -65, "threshold": -50, "reset": -65, "refractory": 2, "tau_excitatory": 0.5,
        "tau_inhibitory": 0.5,
    },
    "lif_conductance": {
        "tau": 20, "rest": -60, "threshold": -50, "reset": -60, "refractory": 5, "tau_excitatory": 5,
        "tau_inhibitory": 10, "Ee": 0, "Ei": -80,
    },
    "lif_conductance_alpha": {
        "C": 250, "g": 16.6667, "rest": -70, "threshold": -55, "reset": -60, "refractory": 2, "tau_excitatory": 0.2,
        "tau_inhibitory": 2, "Ee": 0, "Ei": -85,
    },
    "adex": {
        "C": 281, "gL": 30, "EL": -70.6, "VT": -50.4, "DT": 2, "tau_w": 144, "a": 4, "b": 80.5, "Vr": -70.6,
        "Vpeak": -40.4, "tau_excitatory": 5, "tau_inhibitory": 10, "Ee": 0, "Ei": -80,
    },
    "izhikevich_ode": {"a": 0.02, "b": 0.2, "c": -65, "d": 8}, "qif": {"tau": 10, "peak": 100}, "spike_source": {},
    "delta": {"rate": 0.01}, "hebbian": {"rate": 0.01}, "anti_hebbian": {"rate": 0.01}, "oja": {"rate": 0.01},
    "bcm": {"rate": 0.01, "threshold_rate": 0.01}, "covariance": {"rate": 0.01, "average_rate": 0.01},
    "input_correlation": {"rate": 0.01}, "differential_hebbian": {"rate": 0.01},
    "reward_modulated": {"rate": 0.01, "smoothing": 0.9}, "policy_gradient": {"rate": 0.01, "smoothing": 0.9},
    "decay": {"rate": 0.01}, "stdp": {"tau_pre": 20, "tau_post": 20, "up": 0.01, "down": 0.0105},
    "stdp_multiplicative": {"tau_pre": 20, "tau_post": 20, "up": 0.01, "down": 0.0105, "highest": 1},
    "stdp_triplet": {
        "tau_plus": 16.8, "tau_x": 101, "tau_minus": 33.7, "tau_y": 125, "A2_plus": 5e-10, "A3_plus": 6.2e-3,
        "A2_minus": 7e-3, "A3_minus": 2.3e-4,
    },
    "stdp_reward": {"rate": 0.01, "tau_pre": 20, "tau_post": 20, "tau_eligibility": 1000, "up": 1, "down": 1.05},
    "homeostatic_scaling": {"rate": 1e-5, "goal": 5, "tau": 1000},
    "vogels_inhibitory": {"rate": 0.001, "tau": 20, "goal": 5},
}  # fmt: skip
SYNAPSES = {
    "gap_junction": {}, "diffusive": {}, "graded": {"E": 0, "rest": -40},
    "phase": {"lag": 0}, "amplitude_phase": {"lag": 0},
    "sigmoidal_conductance": {"E": 0, "threshold": -44, "slope": 2, "rest": -40},
    "exponential": {"tau": 5, "E": 0, "rest": -60}, "alpha": {"tau": 5, "E": 0, "rest": -60},
    "double_exponential": {"tau_rise": 1, "tau_decay": 5, "E": 0, "rest": -60},
    "nmda": {"tau_rise": 2, "tau_decay": 100, "alpha": 0.5, "Mg": 1, "E": 0},
    "tsodyks_markram": {"U": 0.5, "tau_rec": 800, "tau_fac": 1000},
}  # fmt: skip
SIGNALS = {
    "delta": ("target",), "input_correlation": ("reflex",),
    "reward_modulated": ("policy", "reward"), "policy_gradient": ("noise", "reward"), "stdp_reward": ("reward",),
}  # fmt: skip


def settled(defaults: Iterable[Default]) -> dict[str, float]:
    """Those of a definition, which may follow from ones before."""
    found: dict[str, float] = {}
    for default in defaults:
        if default.value is not UNKNOWN:
            found[default.name] = evaluate(default.value, found)
    return found


def test_the_built_in_ones_are_those_of_the_tables_with_their_parameters_and_signals() -> None:
    """No more and no fewer, with these defaults."""
    known = builtin_definitions()
    found: dict[str, dict[str, dict[str, float]]] = {}
    for kind in (ACTIVATION, MODEL, RULE, SYNAPSE):
        found[kind.name] = {name: settled(defaults) for name, (_, defaults) in known.of(kind).known().items()}
    assert {**found["activation"], **found["model"], **found["rule"]} == DEFAULTS
    assert found["synapse"] == SYNAPSES
    assert {name: rule.signals for name, (rule, _) in known.of(RULE).known().items() if rule.signals} == SIGNALS


@pytest.mark.parametrize("one", builtins(), ids=lambda one: f"{one.kind} {one.name}")
def test_a_description_holds_the_equation_and_the_source_and_docs_shows_it(one: Builtin) -> None:
    """An equation has an ``=``; a source a year, or the number of one of the paper's equations."""
    assert re.search(r"[\w\])] = ", one.about), one.about
    assert re.search(r"\b(1[89]|20)\d\d\b|\bEqs?\. \d", one.about), one.about
    shown = CliRunner().invoke(neurovis, ["docs", one.name]).stdout
    assert one.about in " ".join(shown.split())


@pytest.mark.parametrize(
    ("definition", "use"),
    [
        ("activations: {a: {value: p*x}}", "{activation: a}"),
        ("models: {a: {activity: p*f(drive)}}", "{model: a}"),
        ("rules: {a: {weight: {each_step: weight + p}}}", ""),
        ("activations: {a: {let: {u: p}, value: u}}", ""),
        ("models: {a: {state: {v: {initial: p}}, activity: v}}", ""),
        ("rules: {a: {parameters: {r: p}, weight: {each_step: weight + r}}}", ""),
    ],
)
def test_a_definition_sees_its_own_parameters_never_the_specs(definition: str, use: str) -> None:
    """Used or not."""
    assert codes(f"parameters: {{p: 1}}\n{definition}\nneurons: {{A: {use or '{bias: p}'}}}") == ["unknown-name"]


def test_what_a_rule_sees() -> None:
    """pre is what reaches the synapse, sent what leaves, post the target's activity; k and t the step and the time."""
    text = """
time: {dt: 0.5}
inputs: {s: {expression: 2^k}}
rules: {all: {parameters: {z: 0}, weight: {each_step: 1e8*pre + 1e4*sent + 100*post + 10*k + t + z*weight}}}
neurons: {A: {input: s}, B: {bias: 3}}
connections: {A -> B: {weight: 0, delay: 2, plasticity: all}}
"""
    weight = compiled(text).run(5).weights[:, 0]
    a = [2.0**k for k in range(5)]
    post = [3.0 + (weight[k - 2] * a[k - 2] if k >= 2 else 0) for k in range(5)]
    for k in range(4):
        pre = a[k - 2] if k >= 2 else 0
        assert weight[k + 1] == pytest.approx(1e8 * pre + 1e4 * a[k] + 100 * post[k] + 10 * k + 0.5 * k, rel=1e-14)


def test_the_state_of_a_rule_is_kept_per_connection() -> None:
    """Each connection counts what it has carried itself."""
    text = """
rules: {sum: {state: {m: {each_step: m + pre}}, weight: {each_step: m + pre}}}
neurons: {A: {count: 2, bias: i + 1}, B: {count: 2}}
connections: {A -> B: {pattern: all_to_all, weight: 0, delay: 0, plasticity: sum}}
"""
    assert compiled(text).run(4).weights[-1].tolist() == [3, 3, 6, 6]


def test_bounds_apply_after_the_change_at_an_episodes_end_too() -> None:
    """Right after each: what follows begins within them."""
    text = """
time: {episode: 2}
rules: {up: {weight: {each_step: weight + 0.4, each_episode: weight + 5}}}
neurons: {A: {bias: 1}, B: {}}
connections: {A -> B: {weight: 0, plasticity: up, bounds: [-1, 1]}}
"""
    assert compiled(text).run(4).weights[:, 0].tolist() == [0, 0.4, 1, 1]
