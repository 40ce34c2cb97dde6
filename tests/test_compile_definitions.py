"""One's own activations, models and rules, as §7 of the language says; and what the content hash depends on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_specs import HEAD, answer, codes, compiled, network_of

import neurovis_spec as nv
from neurovis_spec.language.expressions.functions import meaning

USE = "\nneurons: {A: {activation: %s, bias: 2}}"


def test_an_activation_of_ones_own() -> None:
    text = "activations: {bend: {parameters: {c: 3, d: c^2}, let: {u: c*x, v: u + d}, value: v - x}}" + USE
    assert compiled(text % "bend").run(1)["A"].tolist() == [3 * 2 + 9 - 2]
    assert compiled(text % "{bend: {c: 1}}").run(1)["A"].tolist() == [2 + 1 - 2]  # defaults follow what is set
    assert compiled(text % "{bend: {d: 0}}").run(1)["A"].tolist() == [6 - 2]


def test_a_model_of_ones_own() -> None:
    text = (
        "models: {fade: {parameters: {r: 0.5}, let: {g: r*v}, "
        "state: {v: {initial: 8*r, each_step: g + drive}, old: {each_step: v}}, activity: f(v) + old}}\n"
        "neurons: {A: {model: fade, bias: 1}}"
    )
    v, old, expected = 4.0, 0.0, []
    for _ in range(4):
        v, old = 0.5 * v + 1, v  # together, from old values
        expected.append(v + old)
    assert compiled(text).run(4)["A"].tolist() == expected


def test_a_rule_of_ones_own() -> None:
    text = (
        "rules: {pull: {parameters: {r: 0.5}, signals: [goal], let: {gap: goal - post}, "
        "state: {m: {initial: 1, each_step: m + 1}}, weight: {each_step: weight + r*gap*m}}}\n"
        "neurons: {A: {bias: 1}, B: {}, G: {bias: 3}}\n"
        "connections: {A -> B: {delay: 0, weight: 0, plasticity: {pull: {goal: G}}}}"
    )
    weight, expected = 0.0, []
    for step in range(4):
        expected.append(weight)
        weight += 0.5 * (3 - weight) * (step + 1)
    assert compiled(text).run(4).weight("A -> B").tolist() == expected


def test_a_definition_replaces_a_builtin_with_a_warning() -> None:
    network = nv.compile_text(HEAD + "activations: {tanh: {value: 7*x}}" + USE % "tanh")
    assert [(item.code, item.severity, item.span.line) for item in network.warnings] == [
        ("replaces-builtin", "warning", 3)
    ]
    assert network.run(1)["A"].tolist() == [14]


@pytest.mark.parametrize(
    ("definition", "code"),
    [
        ("activations: {a: {value: x + y}}", "unknown-name"),
        ("activations: {a: {value: x + p}}", "unknown-name"),  # never the spec's parameters
        ("activations: {a: {value: k}}", "unknown-name"),
        ("activations: {a: {value: f(x)}}", "unknown-function"),
        ("activations: {a: {value: 'normal(x, 1)'}}", "draw-not-allowed"),
        ("activations: {a: {value: 1/0}}", "not-finite"),
        ("activations: {a: {}}", "missing-key"),
        ("activations: {a: {value: x, state: {v: {}}}}", "unknown-key"),
        ("activations: {a: {parameters: {x: 1}, value: x}}", "duplicate-name"),
        ("activations: {a: {parameters: {pi: 1}, value: x}}", "duplicate-name"),
        ("activations: {a: {parameters: {b: c, c: 1}, value: x}}", "unknown-name"),
        ("activations: {a: {parameters: {b: 1/0}, value: x}}", "not-finite"),
        ("activations: {a: {parameters: {b: {value: 2, max: 1}}, value: x}}", "out-of-range"),
        ("activations: {a: {parameters: {b: {value: 2, max: q}}, value: x}}", "unknown-name"),
        ("activations: {a: {let: {u: v, v: u + x}, value: u}}", "let-cycle"),
        ("models: {m: {activity: x}}", "unknown-name"),
        ("models: {m: {state: {v: {initial: drive}}, activity: v}}", "unknown-name"),
        ("models: {m: {state: {v: {}}, let: {v: 1}, activity: v}}", "duplicate-name"),
        ("models: {m: {state: {v: {each_episode: f(v)}}, activity: v}}", "unknown-function"),
        ("models: {m: {activity: f}}", "unknown-name"),
        ("rules: {r: {weight: {}}}", "missing-key"),
        ("rules: {r: {weight: {each_step: target}}}", "unknown-name"),
        ("rules: {r: {signals: [pre], weight: {each_step: pre}}}", "duplicate-name"),
        ("rules: {r: {signals: [a b], weight: {each_step: pre}}}", "bad-name"),
        ("rules: {2r: {weight: {each_step: pre}}}", "bad-name"),
    ],
)
def test_definitions_are_checked_even_if_unused(definition: str, code: str) -> None:
    assert codes(f"parameters: {{p: 1}}\n{definition}\nneurons: {{A: {{bias: p}}}}") == [code]


def test_settings_lie_within_the_bounds_of_a_parameter() -> None:
    text = "activations: {a: {parameters: {b: {value: 1, min: 0, max: 2}}, value: b*x}}\n"
    text += "neurons: {A: {count: 2, activation: "
    assert codes(text + "{a: {b: 3}}}}") == ["out-of-range"]
    assert codes(text + "{a: {b: [1, -1]}}}}") == ["out-of-range"]
    assert len(network_of(text + "{a: {b: [2, 0]}}}}").neurons) == 2


def test_settings_that_make_no_number() -> None:
    text = "models: {m: {parameters: {z: 1, y: 1/z}, state: {v: {initial: log(z)}}, activity: v*y}}\n"
    text += "neurons: {A: {model: "
    assert codes(text + "{m: {z: 0}}}}") == ["not-finite"]
    assert codes(text + "{m: {z: 0, y: 1}}}}") == ["not-finite"]
    assert len(network_of(text + "m}}").neurons) == 1


@pytest.mark.parametrize(
    ("use", "code", "hint"),
    [
        ("gausian", "unknown-activation", "'gaussian'"),
        ("{gaussian: {sigm: 1}}", "unknown-parameter", "'sigma'"),
        ("{tanh: {a: 1}}", "unknown-parameter", "no parameters"),
        ("{tanh: {}, relu: {}}", "one-key", "{name:"),
        ("{gaussian: 3}", "wrong-type", "write {gaussian: {SETTING: 3}}"),
        ("{gaussian: {sigma: [1, 2]}}", "wrong-size", ""),
    ],
)
def test_wrong_uses(use: str, code: str, hint: str) -> None:
    found, _, help_line = answer(USE % use)
    assert found == code
    assert hint in help_line


# ---- one cause, one finding; all causes at once ---------------------------------------------------------------------


def test_all_findings_come_at_once() -> None:
    text = """
parameters: {p: zz, q: p + 1}
inputs: {s: {expression: sin(}, u: {sise: 3}}
activations: {a: {valu: x}, b: {value: x + y}}
neurons:
  A: {activaton: tanh, bias: q}
  B: {count: -1}
  C: {activation: tahn, input: s, model: {leaky_integrator: {laek: 1}}}
  D: {activation: a, input: u, bias: [1, 2]}
connections:
  A -> C: {wieght: 1}
  B3 -> C: 1
  C -> E: 1
  C -> D: {plasticity: delta}
outputs: {y: F, z: [B, C]}
layout: {engine: layerd, positions: {G: [0, 0]}}
render: {theme: drak}
"""
    expected = (
        ("unknown-name", "zz"),
        ("missing-operand", ""),
        ("unknown-key", "sise"),
        ("unknown-key", "valu"),
        ("unknown-name", "y"),
        ("unknown-key", "activaton"),
        ("out-of-range", "count"),
        ("unknown-activation", "tahn"),
        ("unknown-parameter", "laek"),
        ("wrong-size", "'u'"),
        ("wrong-size", "bias"),
        ("unknown-key", "wieght"),
        ("unknown-neuron", "E"),
        ("missing-signal", "target"),
        ("unknown-neuron", "F"),
        ("unknown-engine", "layerd"),
        ("unknown-neuron", "G"),
        ("unknown-value", "drak"),
    )
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(HEAD + text)
    found = caught.value.diagnostics
    assert [item.code for item in found] == [code for code, _ in expected]
    for item, (_, word) in zip(found, expected, strict=True):
        assert word in item.message


@pytest.mark.parametrize(
    "text",
    [
        "neurns: {A: {}}\nconnections: {A -> A: 1}\noutputs: {y: A}",
        "paramters: {a: 1}\nneurons: {A: {bias: a}}",
        "inptus: {s: {}}\nneurons: {A: {input: s}}\nconnections: {A -> A: {plasticity: {delta: {target: s}}}}",
        "activation: {swish: {value: x}}\nneurons: {A: {activation: swish}}",
        "neurons: {A: {cuont: 3}}\nconnections: {A1 -> A3: 1, A -> A2: 1}",
        "neurons: {A: {size: 3}}\nconnections: {A1 -> A3: 1}",
        "neurons: {A: {names: [x, 2]}}\nconnections: {x -> A: 1}",
        "neurons: {A: {count: 0}}\nconnections: {A1 -> A1..A2: 1}\nlayout: {positions: {A1: [0, 0]}}",
        "rules: {r: {signals: [a b], weight: {each_step: c}}}\nneurons: {A: {}}\n"
        "connections: {A -> A: {plasticity: {r: {c: A}}}}",
        "activations: {a: {parameters: [b], value: b*x}}\nneurons: {A: {activation: {a: {b: 1}}}}",
        "neurons: {A: {combine: distnce}, B: {}}\nconnections: {B -> A: {centre: 1}}",
        "neurons: {A: {count: 2}, B: {count: 2}}\nconnections: {A -> B: {patern: all_to_all}}",
        "connections: {A -> B: 1, B -> A: 1}",
        "time: {dt: {value: 1}}\nneurons: {A: {bias: dt}}",
        "parameters: {a: {vlaue: 1}}\nneurons: {A: {bias: a}}",
        "inputs: {s: {file: 3}}\nneurons: {A: {input: s}}",
    ],
)
def test_one_cause_one_finding(text: str) -> None:
    assert len(codes(text)) == 1


def test_another_version_is_answered_alone() -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text("neurovis: 2\nname: 3\nmolecules: {A: {}}\nneurons: {A: {bias: q}}")
    assert "language-version" in [item.code for item in caught.value.diagnostics]
    assert len(caught.value.diagnostics) == 1


def test_a_key_of_elsewhere_is_sent_home() -> None:
    assert "a group of neurons" in answer("neurons: {A: {}}\nconnections: {A -> A: {bias: 1}}")[2]
    assert "a connection" in answer("neurons: {A: {matrix: [[1]]}}")[2]
    assert "'render'" in answer("neurons: {A: {}}\nlayout: {theme: dark}")[2]
    assert "'time'" in answer("dt: 0.1\nneurons: {A: {}}")[2]


# ---- the content hash -----------------------------------------------------------------------------------------------

BASE = """seed: 4
time: {dt: 0.1, steps: 10}
parameters: {a: 2, b: 3}
inputs: {s: {expression: a*sin(k)}, v: {values: [1, 2]}}
activations: {bend: {parameters: {c: 1}, value: c*x}}
rules: {pull: {signals: [goal], weight: {each_step: weight + goal}}}
neurons:
  A: {count: 2, activation: bend, input: s, label: L, box: X, role: input, description: d}
  B: {bias: a, model: leaky_integrator, initial: 0.5}
connections:
  A -> B: {matrix: [[1], [2]], description: d}
  B -> A: {delay: 2, plasticity: {pull: {goal: v}}, bounds: [0, 5]}
outputs: {y: B}
"""


def hash_of(text: str, folder: Path | None = None, seed: int | None = None) -> str:
    return nv.compile_text(HEAD + text, folder=folder, seed=seed).hash


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("label: L", "label: [x, y]"),
        ("box: X", "box: Y"),
        ("role: input", "role: hidden"),
        (", description: d", ""),
        ("steps: 10", "steps: 99"),
        ("a: 2, b: 3", "b: 3, a: 2"),
        ("a: 2, b: 3", "a: {value: 2, description: text, min: 0}, b: 3"),
        ("[[1], [2]]", "[ [1.0],  # a comment\n   [2] ]"),
        ("a*sin(k)", "'a  *  sin( k )'"),
        ("[1, 2]", "[[1], [2]]"),
        ("seed: 4", "title: t\ndescription: d\nauthors: [x]\nlicense: MIT\nreferences: r\nseed: 4"),
        ("outputs: ", "layout: {direction: up}\nrender: {theme: dark}\nros: {rate: 3}\noutputs: "),
        ("activations: {", "activations: {unused: {value: x}, "),
        ("{matrix: [[1], [2]], description: d}", "{description: d, matrix: [[1], [2]]}"),
    ],
)
def test_what_the_hash_does_not_see(old: str, new: str) -> None:
    assert old in BASE
    assert hash_of(BASE.replace(old, new)) == hash_of(BASE)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("seed: 4", "seed: 5"),
        ("dt: 0.1", "dt: 0.2"),
        ("steps: 10", "steps: 10, episode: 5"),
        ("b: 3", "b: 4"),
        ("b: 3", "c: 3"),
        ("sin(k)", "cos(k)"),
        ("[1, 2]", "[1, 3]"),
        ("value: c*x", "value: c*x + 0"),
        ("c: 1", "c: 2"),
        ("weight + goal", "weight - goal"),
        ("count: 2, ", "count: 2, first: 5, "),
        ("bias: a", "bias: b"),
        ("leaky_integrator", "static"),
        ("initial: 0.5", "initial: 0.25"),
        ("[[1], [2]]", "[[1], [2.0000000000000004]]"),
        ("delay: 2", "delay: 3"),
        ("goal: v", "goal: s"),
        ("[0, 5]", "[0, 6]"),
        ("outputs: {y: B}", "outputs: {z: B}"),
        ("outputs: {y: B}", "outputs: {y: A}"),
        ("outputs: {y: B}", "outputs: {y: B}\nevents: [{at: 3, lesion: [A1]}]"),
    ],
)
def test_what_the_hash_sees(old: str, new: str) -> None:
    assert old in BASE
    assert hash_of(BASE.replace(old, new)) != hash_of(BASE)


ORDERED = """parameters: {a: 1}
inputs: {%s}
models: {m: {parameters: {%s}, state: {%s}, activity: v + w*p + q}}
rules: {pull: {signals: [%s], weight: {each_step: weight + x - y}}}
neurons: {A: {input: s, model: m}, B: {count: 2, input: r, noise: 'normal(0, 1)'}}
connections: {A -> B: {weight: 1, plasticity: {pull: {%s}}}}
outputs: {%s}
events: [{at: 3, set: {a: 2}}]
"""
PARTS = (
    ("r: {size: 2}", "s: {expression: a*k}", "u: {values: [[1, 2]]}"),
    ("p: 1", "q: 2"),
    ("v: {initial: 0, each_step: v + p}", "w: {initial: 0, each_step: w + v}"),
    ("x", "y"),
    ("x: u", "y: r"),
    ("one: A", "two: B"),
)


@pytest.mark.parametrize("turned", range(len(PARTS)))
def test_the_hash_does_not_depend_on_an_order_that_no_run_depends_on(turned: int) -> None:
    def text(turn: int | None) -> str:
        return ORDERED % tuple(", ".join(parts[::-1] if at == turn else parts) for at, parts in enumerate(PARTS))

    assert hash_of(text(turned)) == hash_of(text(None))
    one, other = (nv.compile_text(HEAD + text(turn)).run(6) for turn in (None, turned))
    assert np.array_equal(one.activity, other.activity)
    assert np.array_equal(one.weights, other.weights)
    assert hash_of(text(None).replace("{input: s, model", "{input: z, model").replace("s: {e", "z: {e")) != hash_of(
        text(None)
    )


def test_the_hash_sees_data_files_by_their_values(tmp_path: Path) -> None:
    text = "neurons: {A: {count: 2}}\nconnections: {A -> A: {matrix: {file: m.csv}}}"
    (tmp_path / "m.csv").write_text("1,2\n3,4\n")
    first = hash_of(text, tmp_path)
    (tmp_path / "m.csv").write_text("1.0, 2\n3,4")
    assert hash_of(text, tmp_path) == first
    (tmp_path / "m.csv").write_text("1,2\n3,5\n")
    assert hash_of(text, tmp_path) != first


def test_the_seed_given_counts_like_the_seed_written() -> None:
    text = "neurons: {A: {bias: 'normal(0, 1)'}}"
    assert hash_of(text, seed=0) == hash_of(text)
    assert hash_of(text, seed=3) == hash_of("seed: 3\n" + text) != hash_of(text)
    large = 2**53
    assert hash_of("neurons: {A: {}}", seed=large) != hash_of("neurons: {A: {}}", seed=large + 1)
    assert hash_of("neurons: {A: {}}", seed=-(2**63)) != hash_of("neurons: {A: {}}", seed=2**63 - 1)


def test_every_array_of_a_network_is_frozen() -> None:
    network = nv.compile_text(HEAD + BASE).network
    arrays = [
        getattr(network.connections, name).whole() for name in ("sources", "targets", "weights", "delays", "centres")
    ]
    arrays += [network.neurons.bias, network.neurons.initial, network.neurons.input, network.neurons.position]
    for population in network.populations:
        arrays += [population.members, population.drive.incoming, population.drive.slots]
    for entry in network.projections:
        arrays += [entry.members, *entry.signals.values()]
    arrays += [array for _, use in network.uses for array in use.parameters.values()]
    assert all(isinstance(array, np.ndarray) and not array.flags.writeable for array in arrays)


@pytest.mark.parametrize(
    ("section", "names", "rest"),
    [
        ("activations", "pi e dt x", "value: 1"),
        ("models", "pi e dt t k drive", "activity: 1"),
        ("rules", "pi e dt t k pre sent post weight", "weight: {each_step: weight}"),
    ],
)
def test_whoever_declares_a_name_that_is_given_is_told_what_it_means(section: str, names: str, rest: str) -> None:
    for name in names.split():
        text = f"neurovis: 1\nname: y\nneurons: {{A: {{}}}}\n{section}: {{d: {{let: {{{name}: 1}}, {rest}}}}}"
        with pytest.raises(nv.SpecError) as caught:
            nv.compile_text(text)
        (found,) = [one for one in caught.value.diagnostics if one.code == "duplicate-name"]
        assert found.message == f"'{name}' already means something here: {meaning(name)}"
