"""What an editor is answered: completions, explanations, places, edits, as plain functions of a text and a place."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsp_marks import marked

from neurovis_spec.language.patterns import PATTERNS
from neurovis_spec.lsp import protocol as wire
from neurovis_spec.lsp.check import check
from neurovis_spec.lsp.completion import Completion, complete
from neurovis_spec.lsp.definition import definition
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.hover import hover
from neurovis_spec.lsp.rename import RenameError, apply, prepare, rename
from neurovis_spec.lsp.symbols import symbols
from neurovis_spec.lsp.text import Place

SPECS = sorted((Path(__file__).parents[1] / "specs").glob("**/*.yaml"))
BASE = """neurovis: 1
name: small
parameters:
  alpha: 1.5
  beta: {value: 2*alpha, min: 0, max: 9, description: how much}
inputs:
  go: {expression: alpha*sin(k)}
activations:
  swish: {parameters: {slope: 1}, value: x * sigmoid(slope * x), description: Smooth.}
neurons:
  K: {count: 5, activation: {gaussian: {sigma: 4}}, description: kernels}
  O: {activation: swish}
  T: {input: go}
"""
FLOW = """neurovis: 1
name: flow
time: {dt: 0.1}
models:
  cell:
    parameters: {tau: {value: 2, unit: ms, description: how slow}}
    ports: {gate: product}
    state: {v: {unit: mV, derivative: "(gate*drive - v)/tau", noise: 0.1}}
    outputs: {current: 2*v}
    activity: f(v)
    send: current
neurons:
  A: {model: cell}
"""
REST = """connections:
  K1 + K3..K5 -> O: {weight: alpha, plasticity: {delta: {rate: beta, target: T}}}
  K -> K: {edges: [[K1, K2, 0.5], [K4, K5]]}
outputs: {all: [K2, O], k: K}
layout: {positions: {K1: [0, 0]}, arrange: {K3..K4: row}}
"""


def offered(text: str) -> dict[str, Completion]:
    document, place = marked(text)
    return {item.label: item for item in complete(document, place)}


@pytest.mark.parametrize(
    ("text", "there", "missing"),
    [
        ("¦", ["neurovis", "name", "neurons"], ["weight"]),
        (BASE + "con¦", ["connections", "outputs"], ["neurons", "name"]),
        ("neurons:\n  K: {count: 3, ¦", ["activation", "model", "bias"], ["count", "weight"]),
        ("neurons:\n  K: {cou¦nt: 3}", ["count", "first"], []),
        ("neurons:\n  K: {model: izhikevich, initial: {¦", ["activity", "v", "u"], ["alpha", "a"]),
        ("neurons:\n  K: {model: {adaptive: {leak: 1}}, initial: {v: 1, ¦", ["activity", "b"], ["leak"]),
        (BASE + "  L: {model: izhikevich, initial: {v: ¦", ["alpha", "normal", "i"], ["v", "k"]),
        ("neurons:\n  K: {combine: ¦", ["sum", "product", "distance"], ["alpha"]),
        ("models:\n  m: {state: {v: {¦", ["derivative", "noise", "unit", "each_step", "jump"], ["on_pre"]),
        ("models:\n  m: {time: ¦", ["s", "ms"], []),
        ("models:\n  m: {ports: {a: ¦", ["sum", "product"], []),
        ("models:\n  m: {ports: {a: {¦", ["combine", "unit"], []),
        (FLOW.replace("(gate*", "(ga¦te*"), ["gate", "drive", "tau", "v"], ["current"]),
        (FLOW.replace("send: current", "send: ¦"), ["v", "current", "activity"], ["tau", "gate"]),
        (FLOW + "  B: {bias: {¦", ["drive"], ["gate", "v"]),
        (FLOW + "  B: {model: cell, bias: {¦", ["drive", "gate"], ["v"]),
        (FLOW + "  B: {model: {cell: {tau: 3}}, input: {¦", ["drive", "gate"], ["v"]),
        (FLOW + "connections: {A -> A: {port: ¦", ["drive", "gate"], ["v"]),
        (FLOW + "connections: {A -> A: {port: {¦", ["drive", "gate"], ["v"]),
        (FLOW + "connections: [{A -> A: {send: ¦", ["activity", "v", "current"], ["gate"]),
        (FLOW + "  B: {count: 2}\nconnections: {B2 -> A: {send: ¦", ["activity"], ["v"]),
        (FLOW.replace("dt: 0.1", "integrate: ¦"), ["rk4", "exponential"], []),
        (FLOW.replace("dt: 0.1", "integrate: {¦"), ["method", "substeps"], []),
        (FLOW + "outputs: {o: A.¦", ["v", "current"], ["tau"]),
        (FLOW + "render: {show: {A: ¦", ["v", "current"], ["tau", "gate"]),
        (BASE + "  L: {activation: ¦", ["tanh", "swish"], ["leaky_integrator", "alpha"]),
        (BASE + "  L: {activation: {swish: {¦", ["slope"], ["sigma"]),
        (BASE + "  L: {model: ¦", ["leaky_integrator", "static"], ["tanh"]),
        (BASE + "  L: {input: ¦", ["go"], ["K", "alpha"]),
        (BASE + "  L: {bias: 2*a¦", ["alpha", "i", "n", "sin", "normal", "pi"], ["K", "j", "tanh "]),
        (BASE + "  L: {model: adaptive}\noutputs: {membrane: L.¦", ["v", "b"], ["K", "drive"]),
        (BASE + "  L: {count: 2, model: {izhikevich: {a: 1}}}\noutputs: {membrane: [L2.¦", ["v", "u"], ["K"]),
        (BASE + "connections:\n  K¦", ["K", "K1", "K5", "O", "T"], ["alpha", "go"]),
        (BASE + "connections:\n  K -> ¦", ["K", "O", "T"], ["alpha"]),
        (BASE + "connections:\n  K -> O: ¦", ["alpha", "j", "n_from"], ["K"]),
        (BASE + "connections:\n  K -> O: {plasticity: {¦", ["delta", "oja"], ["tanh"]),
        (BASE + "connections:\n  K -> O: {plasticity: {delta: {¦", ["rate", "target"], ["alpha"]),
        (BASE + "connections:\n  K -> O: {plasticity: {delta: {rate: ¦", ["alpha", "beta", "i", "n_to"], ["K", "n"]),
        (BASE + "connections:\n  K -> O: {plasticity: {delta: {target: ¦", ["T", "go", "K1", "K5"], ["alpha"]),
        (BASE + "connections:\n  K -> O: {plasticity: {delta: {target: [K1, ¦", ["T", "go", "K2"], ["alpha"]),
        (BASE + "connections:\n  K -> O: {plasticity: {delta: {target: {from: ¦", ["T", "go", "K1"], ["alpha"]),
        (BASE + "connections:\n  K -> O: {plasticity: [oja, {delta: {target: {from: [K1, ¦", ["T", "K2"], ["alpha"]),
        (FLOW + "connections: {A -> A: {plasticity: {delta: {target: A.¦", ["v", "current"], ["tau"]),
        (BASE + "connections:\n  K -> O: {pattern: ¦", ["all_to_all", "random"], ["alpha"]),
        (BASE + "connections:\n  K -> O: {pattern: {¦", ["ring", "random", "band"], ["probability"]),
        (BASE + "connections:\n  K -> O: {pattern: {random: {¦", ["probability"], ["random", "count"]),
        (BASE + "connections:\n  K -> O: {pattern: {random: {pro¦}}}", ["probability"], ["random"]),
        (BASE + "connections:\n  K -> O: {pattern: {small_world: {degree: 2, ¦}}}", ["rewire"], ["degree"]),
        (BASE + "connections:\n  K -> O:\n    pattern:\n      nearest:\n        ¦", ["count"], ["nearest"]),
        (BASE + "connections:\n  - K -> O: {pattern: {band: {width: ¦}}}", ["alpha", "max"], ["width"]),
        (BASE + "connections:\n  K -> O: {scale: {¦}}", ["norm", "indegree"], ["alpha"]),
        (BASE + "connections:\n  K -> O: {scale: {indegree: ¦}}", ["true", "false"], ["alpha", "sin"]),
        (BASE + "outputs: {o: [K, ¦", ["K", "O", "K3"], ["alpha"]),
        (BASE + "layout: {positions: {¦", ["K1", "O"], ["K"]),
        (BASE + "layout: {engine: ¦", ["auto", "layered", "circular"], []),
        (BASE + "render: {theme: ¦", ["default", "dark", "print", "paper"], []),
        (BASE + "render: {labels: ¦", ["true", "false"], []),
        (BASE + "render: {gain: {¦", ["activity", "signal", "thickness", "change"], ["K"]),
        (BASE + "render: {gain: {activity: {¦", ["K", "K1", "O"], ["alpha", "activity"]),
        (BASE + "render: {gain: {signal: {K -> ¦", ["K", "O"], ["alpha"]),
        (BASE + "render: {gain: {activity: {K: ¦", ["alpha", "sin"], ["K"]),
        (BASE + "render: {gain: {activity: {K: [0, ¦", ["alpha", "sin"], ["K"]),
        (BASE + "render: {gain: {thickness: ¦", ["alpha", "sin"], ["K"]),
        (BASE + "rules:\n  r: {parameters: {eta: 1}, weight: {each_step: ¦", ["eta", "pre", "weight"], ["alpha"]),
        ("parameters:\n  a: 1\n  b: ¦\n  c: 2", ["a", "sin"], ["b", "c"]),
        (BASE + "outputs: {o: K}\nros: {publish: {¦", ["o"], ["go"]),
        (BASE + "ros: {subscribe: {¦", ["go"], ["K"]),
        (BASE + "ros: {qos: {¦", ["depth", "reliability"], ["K"]),
        (BASE + "ros: {qos: {reliability: ¦", ["reliable", "best_effort"], ["volatile"]),
        (BASE + "ros: {subscribe: {go: {¦", ["topic", "type", "timeout", "names"], ["safe", "K"]),
        (BASE + "ros: {subscribe: {go: {type: ¦", ["std_msgs/Float64", "sensor_msgs/JointState"], ["std_msgs/String"]),
        (BASE + "ros: {subscribe: {go: {type: geometry_msgs/Twist, field: ¦", ["linear.x"], ["linear", "data"]),
        (BASE + "ros: {subscribe: {go: {on_timeout: ¦", ["hold", "zero", "stop"], ["go"]),
        (BASE + "outputs: {o: K}\nros: {publish: {o: {¦", ["topic", "field", "safe"], ["timeout"]),
        (BASE + "events: [{at: 1, set: {¦", ["alpha", "K", "O"], ["go"]),
        (BASE + "events: [{at: 1, set: {K -> ¦", ["K", "O"], ["alpha"]),
        (BASE + "events: [{at: 1, feed: {¦", ["go"], ["alpha", "K"]),
        (BASE + "events: [{at: 1, reset: ¦", ["K", "O"], ["alpha", "go"]),
        ("description: |\n  ¦", [], ["name"]),
        ("neurons:\n  K: {count: 3,\n  O: {activation: ta¦", ["tanh"], ["count"]),
        ('parameters:\n  alpha: 1\n  p: "al¦pha"', ["alpha"], ["p"]),
        (BASE + "outputs: {o: ¦\nlayout:\n  engine: x", ["K"], ["alpha"]),
    ],
)
def test_what_fits_is_offered_and_nothing_else(text: str, there: list[str], missing: list[str]) -> None:
    labels = offered(text)
    assert [label for label in there if label not in labels] == []
    assert [label for label in missing if label in labels] == []


def test_a_key_comes_with_its_colon_and_its_description() -> None:
    assert offered("neurons:\n  K: {cou¦")["count"].insert == "count: "
    assert offered("neurons:\n  K: {cou¦: 3}")["count"].insert == "count"
    assert "How many neurons" in offered("neurons:\n  K: {¦")["count"].documentation


def test_patterns_and_their_settings_come_with_what_they_mean() -> None:
    found = offered(BASE + "connections:\n  K -> O: {pattern: {¦")
    assert found["ring"].documentation == "As chain, and the last with the first."
    for name, pattern in PATTERNS.items():
        inside = offered(BASE + f"connections:\n  K -> O: {{pattern: {{{name}: {{¦")
        assert list(inside) == [*pattern.settings]
        assert all(item.documentation for item in inside.values())


def test_a_completion_replaces_the_word_alone() -> None:
    document, place = marked(BASE + "  L: {bias: 2*al¦ph + 1}")
    (found,) = (item for item in complete(document, place) if item.label == "alpha")
    assert document.text.part(found.span) == "alph"
    document, place = marked(BASE + "connections:\n  K1..K¦ -> O: 1")
    (found,) = (item for item in complete(document, place) if item.label == "K3")
    assert document.text.part(found.span) == "K"


def test_behind_a_dot_the_neurons_of_the_module_are_offered() -> None:
    text = "modules:\n  leg: {neurons: {S: {count: 2}}}\ninstances:\n  left: {module: leg, count: 2}\n"
    text += "connections:\n  left1.¦"
    assert set(offered(text)) == {"S", "S1", "S2"}


def test_an_instance_is_given_the_parameters_and_inputs_of_its_module() -> None:
    text = "parameters: {outer: 1}\nmodules:\n  leg: {parameters: {gain: 1}, inputs: {load: {}}, neurons: {S: {}}}\n"
    text += "  body: {instances: {a2: {module: leg, count: 3}}, layout: {boxes: {B: a21.¦}}}\n"
    assert set(offered(text)) == {"S"}
    text = text.replace("¦", "S") + "instances:\n  left: {module: leg, "
    assert set(offered(text + "set: {¦")) == {"gain"}
    assert {"outer", "i", "n"} <= set(offered(text + "set: {gain: ¦")) - {"gain"}
    assert set(offered(text + "inputs: {¦")) == {"load"}
    assert set(offered(text + "module: ¦")) == {"leg", "body"}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("  K1 + K3¦", ["K3", "5 neurons (K1 … K5)", "gaussian(sigma = 4)", "static", "kernels"]),
        ("weight: al¦pha", ["**alpha** = `1.5`"]),
        ("rate: be¦ta", ["`2*alpha` = 3", "from 0 to 9", "how much"]),
        ("{del¦ta:", ["weight = weight + rate * pre * (target - post)", "Widrow", "learning rate"]),
        ("{ra¦te: beta", ["parameter of delta", "0.01", "learning rate"]),
        ("activation: sw¦ish", ["f(x) = x * sigmoid(slope * x)", "Smooth."]),
        ("{gauss¦ian", ["f(x) = exp(-sigma * x^2)", "Bell curve"]),
        ("alpha*si¦n(k)", ["sin(x)"]),
        ("alpha*sin(¦k)", ["The step"]),
        ("{input: g¦o", ["input, size 1", "`alpha*sin(k)`"]),
        ("{cou¦nt: 5", ["How many neurons"]),
        ("alpha, plast¦icity", ["A rule"]),
    ],
)
def test_hover_tells_what_it_is(text: str, told: list[str]) -> None:
    source = (BASE + REST).replace(text.replace("¦", ""), text, 1)
    found = hover(*marked(source, compiled=True))
    assert found is not None
    assert [part for part in told if part not in found.markdown] == []


def test_the_size_of_a_group_is_that_of_the_network() -> None:
    text = (BASE + REST).replace("{count: 5", "{count: 2*beta - 1").replace("K -> K", "K¦ -> K")
    found = hover(*marked(text, compiled=True))
    assert found is not None
    assert "5 neurons (K1 … K5)" in found.markdown
    found = hover(*marked(text))
    assert found is not None
    assert "2*beta - 1 neurons" in found.markdown


def test_hover_and_definition_work_in_a_broken_document() -> None:
    broken = (BASE + REST).replace("weight: alpha", "weight: al¦pha") + "render: {gain: {activity: ]\n"
    document, place = marked(broken)
    assert check(document).network is None
    found = hover(document, place)
    assert found is not None
    assert found.markdown == "**alpha** = `1.5`"
    location = definition(document, place)
    assert location is not None
    assert document.text.part(location.span) == "alpha"
    assert location.span.line == 4


@pytest.mark.parametrize(
    ("at", "told"),
    [
        ("model: ce¦ll", ["cell(tau = 2 ms)", "dv/dt = (gate*drive - v)/tau", "current = 2*v", "how slow"]),
        ("(gate*drive - v¦)", ["dv/dt = (gate*drive - v)/tau", "dv/dt with noise of 0.1"]),
        ("- v)/ta¦u", ["parameter of cell", "`2 ms`"]),
        ("send: curr¦ent", ["current = 2*v"]),
        ("deriva¦tive", ["What it changes by"]),
        ("gate*dri¦ve", ["u[t]"]),
    ],
)
def test_what_flows_is_explained(at: str, told: list[str]) -> None:
    found = hover(*marked(FLOW.replace(at.replace("¦", ""), at)))
    assert found is not None
    assert all(one in found.markdown for one in told), found.markdown


@pytest.mark.parametrize(
    ("step", "flow"),
    [
        ("v + dt*(drive - v)/tau", "(drive - v)/tau"),
        ("v + dt * drive", "drive"),
        ("(1 - leak)*v + leak*(drive - w)", "((drive - w) - v)*leak/dt"),
        ("v + drive", None),
        ("w + dt*v", None),
        ("(1 - leak)*v + rate*drive", None),
    ],
)
def test_a_step_by_euler_is_shown_as_a_derivative(step: str, flow: str | None) -> None:
    text = f"neurovis: 1\nname: x\nmodels:\n  m: {{state: {{v¦: {{each_step: {step}}}, w: {{}}}}, activity: v}}\n"
    found = hover(*marked(text))
    assert found is not None
    assert (f"`derivative: {flow}`" in found.markdown) == (flow is not None)
    assert ("derivative" in found.markdown) == (flow is not None)


@pytest.mark.parametrize(
    ("at", "unit"),
    [
        ("le¦ak:", ", in pA (derived)"),
        ("v¦:", ", in mV\n"),
        ("w¦:", ", in pA (derived)"),
        ("act¦ive:", " of m\n"),
        ("g¦:", "default `2 nS`"),
    ],
)
def test_a_unit_is_shown_as_it_is_declared_or_derived(at: str, unit: str) -> None:
    text = """\
neurovis: 1
models:
  m:
    parameters: {g: {value: 2, unit: nS}, C: {value: 1, unit: pF}}
    let: {leak: -g*v, active: step(v)}
    state: {v: {unit: mV, derivative: (leak - w)/C}, w: {derivative: 2*w}}
    activity: v*active
"""
    found = hover(*marked(text.replace(at.replace("¦", ""), at, 1)))
    assert found is not None
    assert unit in found.markdown


def test_units_of_what_is_not_sound_are_not_shown() -> None:
    for broken in ("(leak", "1 +", "[1, 2]", "{a: 1}"):
        text = (
            f"neurovis: 1\nmodels:\n  m: {{let: {{lea¦k: 2*v}}, state: {{v: {{derivative: {broken}}}}}, activity: v}}\n"
        )
        found = hover(*marked(text))
        assert found is None or "derived" not in found.markdown


def test_names_of_what_is_sent_and_of_ports_are_renamed() -> None:
    document, place = marked(FLOW.replace("send: curr", "send: curr¦"))
    assert apply(document, rename(document, place, "flux")).source == FLOW.replace("current", "flux")
    document, place = marked(FLOW.replace("{ga", "{ga¦"))
    assert apply(document, rename(document, place, "door")).source == FLOW.replace("gate", "door")


COUPLED = """neurovis: 1
name: coupled
time: {dt: 0.1}
models:
  cell:
    parameters: {rest: -60}
    state: {v: {derivative: rest - v + drive}}
    outputs: {rate: 2*v}
    activity: v
synapses:
  graded:
    time: ms
    parameters: {E: {value: 0, unit: mV, description: where it reverses}}
    state: {g: {derivative: pre.rate - g}}
    signal: weight*g*(E - post.v)
    sign: E - post.rest
    description: A conductance.
neurons:
  A: {model: cell, initial: {v: -50}}
  B: {model: cell}
connections:
  A -> B: {synapse: {graded: {E: -80}}}
"""


@pytest.mark.parametrize(
    ("at", "there", "missing"),
    [
        ("signal: |weight*¦", ["weight", "post", "pre", "g", "E", "tanh", "k"], ["f", "drive", "v", "rest"]),
        ("signal: |weight*g*(E - post.¦", ["v", "rate", "rest", "activity"], ["g", "E", "post", "tanh"]),
        ("signal: |weight*g*(E - post.r¦", ["rate", "rest"], ["g"]),
        ("sign: |¦", ["weight", "E"], ["k"]),
        ("pre.rate - g}}\n    |s¦", ["signal", "sign"], ["spikes", "send", "ports"]),
        ("    state: {g: {|¦", ["derivative", "unit", "initial", "each_step"], ["noise", "jump"]),
        ("{synapse: |¦", ["graded"], ["cell", "oja"]),
        ("{synapse: |{graded: {¦", ["E"], ["g"]),
        ("{synapse: |{graded: {E: ¦", ["i", "n_to"], ["A", "post"]),
    ],
)
def test_what_fits_in_synapses_is_offered(at: str, there: list[str], missing: list[str]) -> None:
    written, typed = at.split("|")
    found = offered(COUPLED[: COUPLED.index(written) + len(written)] + typed)
    assert found.keys() >= set(there)
    assert found.keys().isdisjoint(missing)


FIRES = """neurovis: 1
name: fires
models:
  cell:
    ports: [kicks]
    let: {high: 1 + drive}
    state: {v: {derivative: -v, noise: 1, jump: 3*kicks}, w: {each_step: w}}
    spike: {when: v >= high, set: {v: 0}, refractory: 2, hold: v}
    outputs: {half: v/2}
    send: v
  plain: {state: {p: {each_step: p}}, activity: p}
synapses:
  fast: {state: {g: {derivative: -g, on_pre: g + weight}}, signal: g + pre.g}
rules:
  timed: {state: {a: {derivative: -a, on_pre: a + 1}}, weight: {on_pre: weight - a, on_post: weight + a}}
  quiet: {weight: {each_step: weight + 1}}
neurons:
  E: {model: cell}
connections:
  E -> E: {send: v}
outputs: {o: E.v}
render: {show: {E: v}}
events: [{from: 10, clamp: {E.v: 1}}]
"""


@pytest.mark.parametrize(
    ("at", "there", "missing"),
    [
        ("spike: {when: ¦v >= high, ", ["v", "high", "drive", "spike", "f"], ["pre"]),
        ("set: {¦v: 0}", ["v", "w"], ["half", "activity", "spike"]),
        ("set: {v: ¦0}", ["v", "drive", "kicks", "k", "f", "spike"], ["half"]),
        ("hold: ¦v}", ["v", "w"], ["half", "activity", "spike"]),
        ("jump: 3*¦kicks", ["kicks", "v", "spike"], ["pre"]),
        ("derivative: ¦-v, noise", ["v", "drive"], ["spike"]),
        ("noise: ¦1", ["v"], ["spike"]),
        ("each_step: ¦w}", ["spike"], []),
        ("let: {high: ¦1", ["spike"], []),
        ("half: ¦v/2", ["spike"], []),
        ("    send: ¦v", ["v", "half", "activity", "spike"], ["high"]),
        ("each_step: ¦p}", ["p"], ["spike"]),
        ("on_pre: ¦g + weight", ["g", "spike", "weight"], ["drive"]),
        ("signal: ¦g + ", ["g", "spike"], []),
        ("pre.¦g}", ["v", "spike", "half"], []),
        ("on_post: ¦weight + a", ["a", "spike"], []),
        ("each_step: ¦weight + 1", ["weight"], ["spike"]),
        ("{send: ¦v}", ["v", "spike", "half", "activity"], []),
        ("{o: E.¦v}", ["v", "spike", "half"], []),
        ("{E: ¦v}}", ["v", "spike", "half"], []),
        ("clamp: {E.¦v", ["v", "spike"], []),
    ],
)
def test_what_fits_where_neurons_fire_is_offered(at: str, there: list[str], missing: list[str]) -> None:
    plain = at.replace("¦", "")
    assert FIRES.count(plain) == 1
    found = offered(FIRES.replace(plain, at))
    assert found.keys() >= set(there)
    assert found.keys().isdisjoint(missing)


@pytest.mark.parametrize(
    ("until", "there", "missing"),
    [
        ("    spike: {", ["when", "set", "refractory", "hold"], ["each_step"]),
        ("    state: {v: {", ["derivative", "jump"], ["on_pre", "on_post"]),
        ("state: {g: {", ["derivative", "on_pre"], ["on_post", "jump"]),
        ("state: {a: {", ["derivative", "on_pre", "on_post"], ["jump"]),
        ("weight: {", ["on_pre", "on_post", "each_step"], ["jump"]),
        ("  cell:\n    ", ["spike", "ports", "state"], ["weight"]),
    ],
)
def test_keys_of_what_fires_are_offered(until: str, there: list[str], missing: list[str]) -> None:
    found = offered(FIRES.partition(until)[0] + until + "¦")
    assert found.keys() >= set(there)
    assert found.keys().isdisjoint(missing)


@pytest.mark.parametrize(
    ("at", "told"),
    [
        ("    sp¦ike: {", "**spike**: When it fires"),
        ("wh¦en: v", "**when**: It fires where this is true"),
        ("s¦et: {v", "**set**: New values of states"),
        ("refra¦ctory", "**refractory**: How long it cannot fire again"),
        ("ho¦ld: v", "**hold**: States that stay as they are"),
        ("ju¦mp: 3", "**jump**: What is added when spikes arrive"),
        ("{derivative: -g, on_¦pre: g", "**on_pre**: Its new value when a spike arrives"),
        ("on_¦post: weight", "**on_post**: Its new value when the target fires"),
        ("hold: ¦v}", "v = 0 when it fires"),
        ("1 + spi¦ke", "`spike`: In a model with a spike block, 1 in the step"),
        ("send: spi¦ke", "`spike`: In a model with a spike block, 1 in the step"),
        ("g + spi¦ke", "`spike`: In a model with a spike block, 1 in the step"),
        ("g*pre.spi¦ke", "`spike`: In a model with a spike block, 1 in the step"),
        ("o: E.spi¦ke", "`spike`: In a model with a spike block, 1 in the step"),
    ],
)
def test_what_fires_is_explained(at: str, told: str) -> None:
    spec = FIRES.replace("1 + drive", "1 + spike").replace("    send: v", "    send: spike")
    spec = spec.replace("signal: g + pre.g", "signal: g + spike + g*pre.spike").replace("o: E.v", "o: E.spike")
    plain = at.replace("¦", "")
    assert spec.count(plain) == 1
    found = hover(*marked(spec.replace(plain, at)))
    assert found is not None
    assert told in found.markdown


def test_a_rule_of_the_centre_is_offered_it_in_place_of_the_weight() -> None:
    rule = "neurovis: 1\nname: x\nrules:\n  near: {let: {d: ¦}, centre: {each_step: centre + 0.1*(pre - centre)}}\n"
    assert offered(rule).keys() >= {"centre", "pre", "sent"}
    assert "weight" not in offered(rule)


@pytest.mark.parametrize(
    ("at", "told"),
    [
        (
            "{synapse: {grad¦ed",
            ["graded(E = 0 mV)", "dg/dt = pre.rate - g", "signal = weight*g*(E - post.v)", "reverses"],
        ),
        ("(E - post.v¦)", ["dv/dt = rest - v + drive"]),
        ("sign: E - post.re¦st", ["parameter of cell", "`-60`"]),
        ("weight*g¦*", ["dg/dt = pre.rate - g"]),
        ("E - po¦st.v", ["the target's activity"]),
        ("    sig¦nal", ["What arrives at the port"]),
    ],
)
def test_synapses_are_explained(at: str, told: list[str]) -> None:
    found = hover(*marked(COUPLED.replace(at.replace("¦", ""), at, 1)))
    assert found is not None
    assert all(one in found.markdown for one in told), found.markdown


def test_what_events_set_and_feed_is_renamed() -> None:
    text = (
        BASE
        + "connections: {K -> O: 1}\nevents:\n  - {at: 1, set: {alpha: 2, K2 -> O: alpha}, feed: {go: 1}, reset: [O]}\n"
    )
    assert renamed(text.replace("{al¦pha", "{alpha").replace("set: {alpha", "set: {al¦pha"), "b") == text.replace(
        "alpha", "b"
    )
    assert renamed(text.replace("K2 -> O", "K2 -> O¦"), "P").count("P") == 4
    assert renamed(text.replace("feed: {go", "feed: {g¦o"), "h") == text.replace("go", "h")


def test_what_is_read_of_the_ends_leads_to_the_model_and_is_renamed_with_it() -> None:
    document, place = marked(COUPLED.replace("post.rest", "post.re¦st"))
    found = definition(document, place)
    assert found is not None
    assert (found.span.line, document.text.part(found.span)) == (6, "rest")
    assert renamed(COUPLED.replace("{rate:", "{ra¦te:"), "flux") == COUPLED.replace("rate", "flux")
    assert renamed(COUPLED.replace("{synapse: {graded", "{synapse: {gra¦ded"), "slow") == COUPLED.replace(
        "graded", "slow"
    )
    assert renamed(COUPLED.replace("{E: -80", "{E¦: -80"), "V") == (
        COUPLED.replace("{E:", "{V:").replace("E - post", "V - post")
    )


def test_where_two_models_have_it_what_is_read_of_the_ends_is_of_neither() -> None:
    two = COUPLED.replace("synapses:", "  other: {state: {v: {each_step: v}}, activity: v}\nsynapses:")
    document, place = marked(two.replace("post.v", "post.v¦"))
    assert definition(document, place) is None


@pytest.mark.parametrize(
    ("text", "line", "name"),
    [
        ("K1 + K3..K¦5", 11, "K"),
        ("weight: alph¦a", 4, "alpha"),
        ("{input: go¦", 7, "go"),
        ("activation: sw¦ish", 9, "swish"),
        ("target: T¦", 13, "T"),
        ("sigmoid(sl¦ope", 9, "slope"),
        ("{K3..K4¦", 11, "K"),
    ],
)
def test_definition_leads_to_the_declaration(text: str, line: int, name: str) -> None:
    source = (BASE + REST).replace(text.replace("¦", ""), text, 1)
    document, place = marked(source)
    found = definition(document, place)
    assert found is not None
    assert (found.path, found.span.line, document.text.part(found.span)) == (None, line, name)


def test_definition_leads_to_what_ships_and_to_what_is_included(tmp_path: Path) -> None:
    found = definition(*marked((BASE + REST).replace("{delta", "{de¦lta")))
    assert found is not None
    assert found.path is not None
    assert found.path.name == "rules.yaml"
    assert found.path.read_text().splitlines()[found.span.line - 1].strip() == "delta:"
    (tmp_path / "more.yaml").write_text("neurovis: 1\ninclude: [deep.yaml]\n")
    (tmp_path / "deep.yaml").write_text("neurovis: 1\nrules:\n  mine: {weight: {each_step: weight}}\n")
    text = "include: [more.yaml]\nconnections:\n  A -> B: {plasticity: mi¦ne}"
    found = definition(*marked(text, tmp_path))
    assert found is not None
    assert (found.path, found.span.line, found.span.column) == ((tmp_path / "deep.yaml").resolve(), 3, 3)
    assert definition(*marked("include: [../etc¦/passwd]", tmp_path)) is None


def renamed(text: str, new: str) -> str:
    document, place = marked(text)
    return apply(document, rename(document, place, new)).source


def test_renaming_a_group_renames_it_in_lists_of_signals() -> None:
    text = (BASE + REST).replace("K1 + K3..K5 -> O", "O -> K1 + K2").replace("target: T", "target: [K4, T]")
    assert "target: [Leg4, T]" in renamed(text.replace("arrange: {K3..K4", "arrange: {K3..K¦4"), "Leg")


SIGNALS = """neurovis: 1
name: signals
rules: {r: {signals: [err, source], weight: {each_step: weight + 0.1*err*source}}}
modules:
  leg:
    neurons: {K: {count: 2, model: izhikevich}, O: {model: adaptive}}
    connections:
      K -> O: {plasticity: {r: {err: O.b, source: {from: K.v}}}}
instances: {left: {module: leg}}
neurons: {A: {count: 2, model: adaptive}}
connections:
  A -> left.O: {plasticity: [oja, {r: {err: left.K1.u, source: {from: [A1.b, A2]}}}]}
"""


@pytest.mark.parametrize(("at", "new"), [("K: {", "Knee"), ("A: {", "Arm"), ("O: {", "Out"), ("left: {", "front")])
def test_renaming_renames_in_signals_of_states_and_of_sources(at: str, new: str) -> None:
    old = at.partition(":")[0]
    expected = re.sub(rf"\b{old}(?=[12]?\b)", new, SIGNALS)
    assert renamed(SIGNALS.replace(at, f"{old}¦: {{", 1), new) == expected


STATES = """neurovis: 1
name: states
models:
  one: {state: {v: {derivative: drive - v}}, activity: v}
  two: {state: {v: {derivative: -v}}, outputs: {w: 2*v}, activity: v}
synapses: {trace: {state: {g: {derivative: pre - g}}, signal: weight*g}}
rules: {r: {signals: [err], state: {tr: {each_step: pre}}, weight: {each_step: weight + 0.1*err*tr}}}
modules: {leg: {neurons: {K: {model: one}}}}
instances: {left: {module: leg}}
neurons: {A: {count: 2, model: {one: {}}}, B: {model: two}}
connections: {A -> B: {synapse: trace, pattern: all_to_all, plasticity: {r: {err: A1.v}}}}
outputs: {a: A1.v, b: [B.v, left.K.v], g: (A1 -> B).g, e: (A -> B).tr, more: A1..A2.v + B.w}
events: [{from: 1, to: 4, clamp: {A.v: 0.5, B.v: 1, (A1 -> B).g: 0.2, left.K.v: 0}}]
"""


def test_a_state_is_renamed_wherever_it_is_named_behind_its_neurons_or_connections() -> None:
    def after(old: str, new: str) -> str:
        return re.sub(old, new, STATES)

    one = after(r"(?<=one: {state: {)v|(?<=A\d\.)v|(?<=A\.)v|(?<=left\.K\.)v", "volt")
    one = one.replace("derivative: drive - v}}, activity: v}", "derivative: drive - volt}}, activity: volt}")
    assert renamed(STATES.replace("one: {state: {v", "one: {state: {v¦"), "volt") == one
    assert renamed(STATES.replace("a: A1.v", "a: A1.v¦"), "volt") == one
    assert renamed(STATES.replace("trace: {state: {g", "trace: {state: {g¦"), "q") == after(r"\bg\b(?!: \()", "q")
    assert renamed(STATES.replace("(A -> B).tr", "(A -> B).tr¦"), "trail") == after(r"\btr\b", "trail")
    assert renamed(STATES.replace("{w: 2", "{w¦: 2"), "twice") == after(r"\bw\b", "twice")


def test_the_owner_of_a_state_that_is_a_signal_leads_to_its_group() -> None:
    document, place = marked(SIGNALS.replace("from: K.v", "from: K¦.v"))
    found = definition(document, place)
    assert found is not None
    assert (found.span.line, document.text.part(found.span)) == (6, "K")


def test_renaming_a_group_renames_its_neurons_and_ranges() -> None:
    assert check(Document(BASE + REST)).network is not None
    result = renamed((BASE + REST).replace("K3..K5", "K3..K¦5"), "Leg")
    assert "Leg: {count: 5" in result
    assert "Leg1 + Leg3..Leg5 -> O" in result
    assert "Leg -> Leg: {edges: [[Leg1, Leg2, 0.5], [Leg4, Leg5]]}" in result
    assert "{all: [Leg2, O], k: Leg}" in result
    assert "{positions: {Leg1: [0, 0]}, arrange: {Leg3..Leg4: row}}" in result
    assert check(Document(result)).network is not None
    assert renamed(result.replace("Leg: {count", "Le¦g: {count"), "K") == BASE + REST


def test_renaming_a_group_renames_it_in_gains() -> None:
    gains = "render: {gain: {activity: {K: 2, K3..K5: alpha}, signal: {K1 -> O: 4}, change: {K1 + K3 -> O: 1}}}\n"
    assert check(Document(BASE + REST + gains)).network is not None
    result = renamed((BASE + REST + gains).replace("activity: {K:", "activity: {K¦:"), "Leg")
    assert "activity: {Leg: 2, Leg3..Leg5: alpha}" in result
    assert "signal: {Leg1 -> O: 4}, change: {Leg1 + Leg3 -> O: 1}" in result
    assert check(Document(result)).network is not None


def test_weights_and_delays_of_edges_are_expressions() -> None:
    text = BASE.replace("  beta:", "  late: 2\n  beta:")
    text += "connections:\n  K -> K: {edges: [[K1, K2, alpha, late + 1], [K4, K5, 2*alpha]]}\n"
    result = renamed(text.replace("  alpha: 1.5", "  al¦pha: 1.5"), "gain")
    assert "[[K1, K2, gain, late + 1], [K4, K5, 2*gain]]" in result
    assert "[[K1, K2, alpha, lag + 1], [K4" in renamed(text.replace("  late: 2", "  la¦te: 2"), "lag")
    assert {"alpha", "sin"} <= set(offered(text.replace("2*alpha", "2*¦alpha"))) - {"K1"}
    assert {"K", "K1"} <= set(offered(text.replace("[K4", "[¦K4"))) - {"alpha"}


def test_renaming_a_parameter_leaves_other_scopes_alone() -> None:
    text = BASE.replace("slope: 1", "alpha: 1").replace("slope * x", "alpha * x") + REST
    result = renamed(text.replace("  alpha: 1.5", "  al¦pha: 1.5"), "gain")
    assert "  gain: 1.5" in result
    assert "value: 2*gain" in result
    assert "gain*sin(k)" in result
    assert "weight: gain" in result
    assert "{parameters: {alpha: 1}, value: x * sigmoid(alpha * x)" in result


def test_renaming_a_definition_and_its_parameters() -> None:
    text = (BASE + REST).replace("activation: swish", "activation: {swish: {slope: 2}}")
    assert "activation: {silu: {slope: 2}}" in renamed(text.replace("swish: {par", "swi¦sh: {par"), "silu")
    result = renamed(text.replace("{slope: 2}", "{slo¦pe: 2}"), "b")
    assert "{parameters: {b: 1}, value: x * sigmoid(b * x)" in result
    assert "{swish: {b: 2}}" in result


def test_a_module_has_names_of_its_own() -> None:
    text = (
        "modules:\n  leg: {neurons: {S: {}}, connections: {S -> S: 1}}\nneurons: {¦S: {}}\nconnections: {S -> S: 2}\n"
    )
    assert renamed(text, "U") == text.replace("{¦S: {}}", "{U: {}}").replace("S -> S: 2", "U -> U: 2")
    text += "instances: {left: {module: leg}}\noutputs: {o: left.S¦}\n"
    result = renamed(text.replace("¦", "", 1), "V")
    assert "{neurons: {V: {}}, connections: {V -> V: 1}}" in result
    assert "o: left.V" in result
    assert "neurons: {S: {}}" in result


def test_names_that_stand_behind_astral_characters_and_over_lines_are_renamed() -> None:
    text = 'neurovis: 1\nname: x\nparameters:\n  a¦b: 1\n  c: {description: "𝜎😀", value: ab + 1}\n'
    text += "  d: >-\n    ab +\n    c * ab\n"
    assert renamed(text, "g") == text.replace("a¦b", "g").replace("ab", "g")


@pytest.mark.parametrize(
    ("mark", "new", "why"),
    [
        ("  K¦: {count", "2K", "is not a name"),
        ("  K¦: {count", "true", "which reads it as true"),
        ("  K¦: {count", "O", "'O' is declared already, in line 12"),
        ("  K¦: {count", "go", "'go' is declared already, in line 7"),
        ("  O¦: {act", "K3", "'K3' is a neuron already, declared in line 11"),
        ("  alp¦ha: 1.5", "beta", "'beta' is declared already, in line 5"),
        ("  alp¦ha: 1.5", "pi", "may not be called 'pi'"),
        ("  alp¦ha: 1.5", "n_from", "'n_from' means something else"),
        ("slo¦pe: 1", "x", "'x' means something else in line 9"),
        ("  K¦: {count", "a" * 64, "there would be an error in line 11"),
        ("{gauss¦ian", "bell", "is not declared in this document"),
        ("name: sm¦all", "x", "there is no name here"),
    ],
)
def test_a_bad_rename_is_refused_with_a_sentence(mark: str, new: str, why: str) -> None:
    document, place = marked((BASE + REST).replace(mark.replace("¦", ""), mark, 1))
    with pytest.raises(RenameError) as caught:
        rename(document, place, new)
    assert why in str(caught.value)


def test_what_is_renamed_at_a_neuron_is_its_group() -> None:
    document, place = marked((BASE + REST).replace("K3..K5", "K3..K5¦", 1))
    span, name = prepare(document, place)
    assert (name, document.text.part(span), span.line, span.column) == ("K", "K", 15, 12)


def test_a_text_with_escapes_is_not_renamed_by_guess() -> None:
    text = 'parameters:\n  a¦b: 1\n  c: "\\x61b + 1"\n'
    with pytest.raises(RenameError, match="line 3 in a text with escapes"):
        renamed(text, "g")


def test_symbols_are_nested() -> None:
    document = Document(BASE + REST)
    found = {symbol.name: symbol for symbol in symbols(document)}
    assert [child.name for child in found["neurons"].children] == ["K", "O", "T"]
    assert [child.detail for child in found["neurons"].children] == ["count 5", "", ""]
    assert [child.name for child in found["connections"].children] == ["K1 + K3..K5 -> O", "K -> K"]
    for symbol in found.values():
        for child in symbol.children:
            assert (symbol.whole.line, symbol.whole.column) <= (child.whole.line, child.whole.column)
            assert (child.whole.end_line, child.whole.end_column) <= (symbol.whole.end_line, symbol.whole.end_column)


@settings(deadline=None, max_examples=150)
@given(st.sampled_from(SPECS), st.data())
def test_nothing_breaks_on_whatever_somebody_is_typing(path: Path, data: st.DataObject) -> None:
    whole = path.read_text(encoding="utf-8")
    at = data.draw(st.integers(0, len(whole)))
    cut = data.draw(st.integers(at, min(len(whole), at + 60)))
    typed = data.draw(st.text(st.sampled_from("aK1.,:+->{}[]\"'#| \n\t𝜎"), max_size=6))
    document = Document(whole[:at] + typed + whole[cut:], "x", path.parent)
    for place in (Place(*document.text.lines.place(at)), Place(*document.text.lines.place(at + len(typed)))):
        for completion in complete(document, place):
            assert completion.span.line == place.line
            assert completion.span.column <= place.column <= completion.span.end_column
        found = hover(document, place)
        assert found is None or found.markdown
        definition(document, place)
        with suppress(RenameError):
            prepare(document, place)
    symbols(document)


DEEP = ("{a: " * 20_000, "[" * 100_000, "- " * 100_000, "a: " + "x" * 500_000, "outputs: {a: " + "K" * 500_000)


@pytest.mark.parametrize("text", DEEP, ids=["braces", "brackets", "dashes", "text", "reference"])
def test_deep_and_long_texts_are_looked_at_once(text: str) -> None:
    document, place = Document(text), Place(1, len(text) + 1)  # whatever is quadratic takes minutes here
    complete(document, place)
    assert hover(document, place) is None
    assert definition(document, place) is None
    assert len(symbols(document)) <= 1


def test_a_group_is_renamed_in_the_states_of_its_model_too() -> None:
    text = (
        "neurons:\n  K¦: {count: 2, model: adaptive}\n  O: {}\noutputs: {m: K.v, k: [left.K.b, K1.b], e: (K -> O).z}\n"
    )
    wanted = (
        "neurons:\n  L: {count: 2, model: adaptive}\n  O: {}\noutputs: {m: L.v, k: [left.K.b, L1.b], e: (L -> O).z}\n"
    )
    assert renamed(text, "L") == wanted


LABELLED = """neurovis: 1
name: legs
modules:
  leg:
    parameters: {side: 0}
    neurons:
      A: {label: "side {2*(number - 1) + side}"}
instances: {left: {module: leg, count: 2, set: {side: 1}}}
"""


def test_a_parameter_is_renamed_in_the_expressions_of_a_label_and_not_in_its_text() -> None:
    edited = renamed(LABELLED.replace("{side: 0}", "{si¦de: 0}"), "hand")
    assert 'label: "side {2*(number - 1) + hand}"' in edited
    assert "set: {hand: 1}" in edited
    assert "parameters: {hand: 0}" in edited


def test_within_the_braces_of_a_label_parameters_and_the_number_are_offered_and_explained() -> None:
    offered = {one.label for one in complete(*marked(LABELLED.replace("+ side}", "+ ¦}")))}
    assert {"side", "number", "i", "n", "sin"} <= offered
    assert not {"side", "number"} & {one.label for one in complete(*marked(LABELLED.replace('"side {', '"¦side {')))}
    shown = hover(*marked(LABELLED.replace("(number", "(num¦ber")))
    assert shown is not None
    assert "number of the instance" in shown.markdown


def test_the_colours_of_a_theme_are_offered_and_explained() -> None:
    offered = {one.label for one in complete(*marked(BASE + "render: {theme: {base: dark, ¦}}"))}
    assert {"negative", "glow", "ends"} <= offered
    assert {one.label for one in complete(*marked(BASE + "render: {theme: {base: ¦}}"))} == {
        "default", "dark", "print", "paper",
    }  # fmt: skip
    shown = hover(*marked(BASE + 'render: {theme: {ne¦gative: "#d55e00"}}'))
    assert shown is not None
    assert "colour of −1" in shown.markdown


@pytest.mark.parametrize(
    ("text", "wrong", "right"),
    [
        ("neurons: {A: {activation: 'tahn'}}", "tahn", "tanh"),
        ("neurons: {A: {activaton: tanh}}", "activaton", "activation"),
        ("parameters: {alpha: 1}\nneurons: {A: {bias: 2*alhpa}}", "alhpa", "alpha"),
        ("neurons: {A: {model: leaky_integrator, bias: 1}}\noutputs: {o: A.vv}", "vv", "v"),
        ("neurons: {Left: {bias: 1}, O: {}}\nconnections: {Lfet -> O: 1}", "Lfet", "Left"),
    ],
)
def test_a_quick_fix_writes_the_right_name(text: str, wrong: str, right: str) -> None:
    spec = f"neurovis: 1\nname: x\n{text}\n"
    document, _ = marked(spec + "¦")
    fixes = wire.fixes("file:///x.yaml", document.text, wire.diagnostics(document.text, check(document).findings))
    fix = next(one for one in fixes if one.title == f"Write '{right}'")
    assert fix.edit is not None
    assert fix.edit.changes is not None
    (change,) = fix.edit.changes["file:///x.yaml"]
    lines = spec.splitlines()
    line = lines[change.range.start.line]
    assert line[change.range.start.character : change.range.end.character] == wrong
    lines[change.range.start.line] = line[: change.range.start.character] + right + line[change.range.end.character :]
    mended, _ = marked("\n".join(lines) + "\n¦")
    assert not [one for one in check(mended).findings if one.severity == "error"]
