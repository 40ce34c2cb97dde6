"""Groups, references, parameters and inputs become what §1 and §3 of the language say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_specs import answer, codes, compiled, network_of, pairs

import neurovis_spec as nv
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.runtime.simulation import ParameterError


def names(group: str) -> tuple[str, ...]:
    return network_of(f"neurons: {{K: {group}}}").neurons.names


def test_names_of_a_group() -> None:
    assert names("{}") == ("K",)
    assert names("{count: 3}") == ("K1", "K2", "K3")
    assert names("{count: 1}") == ("K1",)
    assert names("{count: 3, first: 0}") == ("K0", "K1", "K2")
    assert names("{names: [a, b_2, _c]}") == ("a", "b_2", "_c")
    assert names("{names: [a, b], count: 2}") == ("a", "b")
    assert names("{count: 2*1 + 1}") == ("K1", "K2", "K3")


def test_neurons_stand_in_the_order_written() -> None:
    assert network_of("neurons: {Z: {}, B: {count: 2}, A: {}}").neurons.names == ("Z", "B1", "B2", "A")


def test_labels() -> None:
    def labels(group: str) -> tuple[str, ...]:
        return network_of(f"neurons: {{K: {group}}}").neurons.labels

    assert labels("{count: 2}") == ("K1", "K2")
    assert labels("{count: 2, label: 'a b'}") == ("a b", "a b")
    assert labels("{count: 2, label: [x, y]}") == ("x", "y")
    assert labels("{count: 1, label: [x]}") == ("x",)
    for wrong in ("[x, y]", "[x]", "[]"):
        assert codes(f"neurons: {{K: {{count: 3, label: {wrong}}}}}") == ["wrong-size"]


@pytest.mark.parametrize(
    ("group", "code"),
    [
        ("{count: 0}", "out-of-range"),
        ("{count: -2}", "out-of-range"),
        ("{count: 1.5}", "not-an-integer"),
        ("{first: 2}", "first-without-count"),
        ("{count: 2, first: -1}", "out-of-range"),
        ("{count: 3, names: [a, b]}", "wrong-size"),
        ("{names: []}", "wrong-size"),
        ("{names: [a, a]}", "duplicate-neuron"),
        ("{names: [a, 2b]}", "bad-name"),
        ("{names: [a b]}", "bad-name"),
        ("{count: 1000001}", "too-many"),
        ("{count: 1e300}", "out-of-range"),
    ],
)
def test_wrong_groups(group: str, code: str) -> None:
    assert codes(f"neurons: {{K: {group}}}") == [code]


def test_a_name_has_64_characters_at_most() -> None:
    assert names(f"{{names: [{'n' * 64}]}}") == ("n" * 64,)
    assert codes(f"neurons: {{K: {{names: [{'n' * 65}]}}}}") == ["bad-name"]
    assert codes(f"neurons: {{{'n' * 64}: {{count: 1}}}}") == ["bad-name"]


def test_a_neuron_has_one_declaration() -> None:
    assert codes("neurons: {K: {count: 11}, K1: {count: 1}}") == ["duplicate-neuron"]
    assert codes("neurons: {K: {count: 2}, K2: {}}") == ["duplicate-neuron"]
    assert codes("neurons: {A: {names: [B]}, B: {names: [C]}}") == ["duplicate-neuron"]
    assert codes("inputs: {K: {}}\nneurons: {K: {}}") == ["duplicate-name"]
    assert codes("inputs: {K1: {}}\nneurons: {K: {count: 2}}") == ["duplicate-name"]


def test_values_of_a_group() -> None:
    text = "parameters: {a: 2}\nneurons:\n  K: {count: 3, bias: a*i + n, initial: [0, a, a/2]}\n  L: {bias: a}"
    neurons = network_of(text).neurons
    assert neurons.bias.tolist() == [3, 5, 7, 2]
    assert neurons.initial[:3].tolist() == [0, 2, 1]
    assert np.isnan(neurons.initial[3])
    assert codes("neurons: {K: {count: 3, bias: [1, 2]}}") == ["wrong-size"]
    assert codes("neurons: {K: {bias: 1/0}, L: {bias: sqrt(-1)}}") == ["not-finite"] * 2


def test_parameters_of_an_activation_may_differ_from_neuron_to_neuron() -> None:
    network = network_of("neurons: {K: {count: 3, activation: {gaussian: {sigma: i + 1}}}, L: {activation: gaussian}}")
    (population,) = network.populations
    assert population.activation.parameters["sigma"].tolist() == [1, 2, 3, 1]


def test_blocks_join_neurons_that_are_updated_alike() -> None:
    text = (
        "neurons: {A: {activation: tanh}, B: {}, C: {activation: tanh}}\nconnections: {A -> C: {delay: 0}, B -> A: 1}"
    )
    populations = network_of(text).populations
    assert [(b.level, b.activation.definition.name, b.members.tolist()) for b in populations] == [
        (0, "tanh", [0]),
        (0, "identity", [1]),
        (1, "tanh", [2]),
    ]
    assert [b.drive.incoming.tolist() for b in populations] == [[1], [], [0]]


# ---- references ---------------------------------------------------------------------------------------------------

GROUPS = "neurons: {K: {count: 12, first: 0}, K1x: {}, O: {}, P: {names: [p, q]}}\n"


def end(reference: str) -> list[str]:
    return [pair.split()[0] for pair in pairs(f"{GROUPS}connections: {{{reference} -> O: 1}}")]


def test_references() -> None:
    assert end("O") == ["O"]
    assert end("K11") == ["K11"]
    assert end("P") == ["p", "q"]
    assert end("q") == ["q"]
    assert end("K3..K5") == ["K3", "K4", "K5"]
    assert end("K3 .. K3") == ["K3"]
    assert end("q + K9..K11 + K1x") == ["q", "K9", "K10", "K11", "K1x"]
    assert end("q+K0") == ["q", "K0"]


def test_a_range_belongs_to_the_longest_group_name() -> None:
    text = "neurons: {K: {count: 2}, K1_: {count: 3}, O: {}}\nconnections: {K1_2..K1_3 -> O: 1, K1..K2 -> O: 1}"
    assert pairs(text) == ["K1_2 O", "K1_3 O", "K1 O", "K2 O"]
    text = "neurons: {K: {count: 9}, K1: {count: 3, first: 5}, O: {}}\nconnections: {K15..K16 -> O: 1}"
    assert codes(text) == ["duplicate-neuron"]  # the group K1 is called like a neuron of K


@pytest.mark.parametrize(
    ("reference", "code", "words"),
    [
        ("K12", "unknown-neuron", "numbers 0 to 11"),
        ("k3", "unknown-neuron", "'K3'"),
        ("K3..K12", "bad-range", "numbers 0 to 11"),
        ("K5..K3", "bad-range", "backwards"),
        ("K03..K05", "bad-range", "one counted group"),
        ("p..q", "bad-range", "one counted group"),
        ("K3..O", "bad-range", "one counted group"),
        ("K + K3", "repeated-reference", "'K3'"),
        ("K +", "empty-reference", "missing"),
    ],
)
def test_wrong_references(reference: str, code: str, words: str) -> None:
    found, message, hint = answer(f"{GROUPS}connections: {{{reference} -> O: 1}}")
    assert found == code
    assert words in message + hint


def test_outputs_refer_to_groups_neurons_and_lists() -> None:
    outputs = network_of(f"{GROUPS}outputs: {{a: O, b: [K1, P], c: K2..K3 + O}}").outputs
    assert [(o.name, o.neurons.tolist(), o.scalar) for o in outputs] == [
        ("a", [13], True),
        ("b", [1, 14, 15], False),
        ("c", [2, 3, 13], False),
    ]
    assert codes(f"{GROUPS}outputs: {{a: []}}") == ["empty-reference"]


# ---- parameters ---------------------------------------------------------------------------------------------------


def test_parameters_see_earlier_ones() -> None:
    text = "time: {dt: 0.5}\nparameters: {a: 2, b: a^2 + dt, c: {value: b*pi, min: 0}}\nneurons: {A: {}}"
    assert network_of(text).parameters == {"a": 2, "b": 4.5, "c": 4.5 * np.pi}
    assert codes("parameters: {a: b, b: 1}\nneurons: {A: {}}") == ["unknown-name"]
    assert codes("parameters: {a: a}\nneurons: {A: {}}") == ["unknown-name"]


def test_what_is_set_replaces_a_value_and_others_follow() -> None:
    text = "neurovis: 1\nname: x\nparameters: {a: {value: 2, min: 0, max: 5}, b: 10*a}\nneurons: {A: {bias: b}}"
    network = nv.compile_text(text, a=3).network
    assert network.parameters == {"a": 3, "b": 30}
    assert network.neurons.bias.tolist() == [30]
    assert nv.compile_text(text, parameters={"b": 7}).network.neurons.bias.tolist() == [7]
    for wrong in ({"a": 6.0}, {"a": -1.0}, {"c": 1.0}, {"a": float("nan")}):
        with pytest.raises(nv.SpecError):
            nv.compile_text(text, parameters=wrong)


def test_functions_bar_no_names() -> None:
    text = "parameters: {sin: 2, normal: 3, f: 4, x: 5}\nneurons: {A: {bias: sin(0) + sin*normal + f + x}}"
    assert network_of(text).neurons.bias.tolist() == [15]


def test_a_function_is_no_value() -> None:
    assert answer("neurons: {A: {bias: sin + 1}}")[1:] == ("'sin' is a function, not a value", "write sin(x)")
    assert "normal(mean, deviation)" in answer("neurons: {A: {bias: normal}}")[2]


def test_names_of_elsewhere_are_explained() -> None:
    assert "at each step" in answer("neurons: {A: {bias: k}}")[2]
    assert "group" in answer("parameters: {a: i}\nneurons: {A: {}}")[2]
    assert "n_from" in answer("neurons: {A: {count: 2}}\nconnections: {A -> A1: n}")[2]


def test_structural_parameters_cannot_be_set() -> None:
    text = (
        "parameters: {n0: 2, m: n0 + 1, d: 1, p: 0.5, s: 1, w: 1, run: 5}\ntime: {steps: run}\n"
        "inputs: {u: {size: s}}\nneurons: {A: {count: m}}\n"
        "connections: {A -> A: {weight: w, delay: d, pattern: {random: {probability: p}}, self: true}}"
    )
    network = compiled(text)
    assert network.network.structural == {"n0", "m", "d", "p", "s"}
    sim = network.simulator()
    sim.set(w=3, run=7)
    for name in ("n0", "m", "d", "p", "s"):
        with pytest.raises(ParameterError, match="structure"):
            sim.set(**{name: 1.0})


def test_a_long_chain_of_parameters() -> None:
    chain = "".join(f"  p{n}: p{n - 1} + 1\n" for n in range(1, 1500))
    assert len(network_of(f"parameters:\n  p0: 0\n{chain}neurons: {{A: {{count: p1499}}}}").neurons) == 1499


# ---- inputs -------------------------------------------------------------------------------------------------------


def test_inputs(tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_text("left,right\n1,2\n3,4\n")
    np.save(tmp_path / "n.npy", np.array([1.0, 2.0, 3.0]))
    text = (
        "parameters: {a: 2}\ninputs:\n  e: {expression: a*sin(k) + t}\n  f: {file: s.csv}\n  g: {file: n.npy}\n"
        "  v: {values: [[0], [a], 1]}\n  z: {size: a + 1}\n  o: {}\nneurons: {A: {input: e}}"
    )
    inputs = network_of(text, tmp_path).inputs
    assert [(i.name, i.start, i.size) for i in inputs] == [
        ("e", 0, 1),
        ("f", 1, 2),
        ("g", 3, 1),
        ("v", 4, 1),
        ("z", 5, 3),
        ("o", 8, 1),
    ]
    tables = [None if entry.table is None else entry.table.tolist() for entry in inputs]
    assert tables == [None, [[1, 2], [3, 4]], [[1], [2], [3]], [[0], [2], [1]], None, None]


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ("{values: []}", "wrong-size"),
        ("{values: [[]]}", "wrong-size"),
        ("{values: [[1, 2], [3]]}", "wrong-size"),
        ("{values: [1, null]}", "wrong-type"),
        ("{values: [k]}", "unknown-name"),
        ("{values: [[[1]]]}", "wrong-type"),
        ("{size: 0}", "out-of-range"),
        ("{size: 1e9}", "too-many"),
        ("{size: 2, values: [1]}", "conflicting-keys"),
        ("{expression: 1/0}", "not-finite"),
        ("{expression: sin(k}", "unbalanced-parenthesis"),
        ("{expression: 'normal(0, 1)'}", "draw-not-allowed"),
        ("{file: none.csv}", "file-missing"),
    ],
)
def test_wrong_inputs(body: str, code: str) -> None:
    assert codes(f"inputs: {{s: {body}}}\nneurons: {{A: {{input: s}}}}") == [code]


def test_a_long_table_of_formulas() -> None:
    rows = ", ".join(["[a, 1]", "[2*a, 0]"] * 100)
    text = f"parameters: {{a: 3}}\ninputs: {{s: {{values: [{rows}]}}}}\nneurons: {{A: {{}}}}"
    table = network_of(text).inputs[0].table
    assert table is not None
    assert table.tolist() == [[3, 1], [6, 0]] * 100


def test_positions() -> None:
    text = "parameters: {a: 2}\nneurons: {A: {position: [1, a]}, B: {count: 2, position: [[0, 0], [a, -1]]}, C: {}}"
    position = network_of(text).neurons.position
    assert position[:3].tolist() == [[1, 2], [0, 0], [2, -1]]
    assert np.isnan(position[3]).all()
    assert codes("neurons: {B: {count: 2, position: [[0, 0]]}}") == ["wrong-size"]
    assert codes("neurons: {B: {count: 2, position: [0, 0]}}") == ["wrong-type", "wrong-type"]


def test_labels_hold_expressions_of_the_instances_number_and_parameters() -> None:
    text = """modules:
  leg:
    parameters: {side: 0, gain: 0.25}
    neurons:
      CF: {label: "CF{2*(number - 1) + side}"}
      d: {count: 2, label: "d{number}.{i} of {n} {{{gain}}}"}
      e: {count: 2, label: ["{{x}", "y{i}"]}
  own:
    parameters: {number: 7}
    neurons: {A: {label: "{number}"}}
  pair: {instances: {leg: {module: leg, count: 2}}}
instances:
  left: {module: leg, count: 2}
  right: {module: leg, count: 2, set: {side: 1}}
  tail: {module: leg}
  own: {module: own, count: 2}
  pair: {module: pair, count: 3}
parameters: {of: 3}
neurons: {K: {count: 3, label: "{of*(i + 1)}"}, L: {label: "{1/3} {-of} {1e20} }"}}"""
    neurons = network_of(text).neurons
    labels = dict(zip(neurons.names, neurons.labels, strict=True))
    shown = {name: labels[name] for name in ("left1.CF", "right1.CF", "left2.CF", "right2.CF", "tail.CF")}
    assert list(shown.values()) == ["CF0", "CF1", "CF2", "CF3", "CF0"]
    assert [labels[f"left2.{name}"] for name in ("d1", "d2", "e1", "e2")] == [
        "d2.0 of 2 {0.25}", "d2.1 of 2 {0.25}", "{x}", "y1",
    ]  # fmt: skip
    assert labels["own2.A"] == "7"  # a parameter of this name is meant, where there is one
    assert labels["pair3.leg2.CF"] == "CF2"
    assert [labels[name] for name in ("K1", "K2", "K3", "L")] == ["3", "6", "9", "0.333333 -3 1e+20 }"]


def test_a_label_changes_nothing_but_the_picture() -> None:
    """Nor does a parameter become structural by it."""
    text = "parameters: {a: 1}\nneurons: {A: {label: 'x{a}', bias: a}}\nevents: [{at: 2, set: {a: 2}}]"
    one, other = network_of(text), network_of(text.replace("x{a}", "y{2*a}"))
    assert one.hash == other.hash
    assert (one.neurons.labels, other.neurons.labels) == (("x1",), ("y2",))


STARTS = """parameters: {low: -65}
neurons:
  A: {count: 3, model: izhikevich, activation: step, bias: 5, initial: {v: low + 5*i, u: "normal(0, 1)"}}
  B: {model: leaky_integrator, initial: {activity: 0.5, v: 2}}
  C: {model: leaky_integrator, initial: {v: 3}}
  D: {model: leaky_integrator, bias: 1}
connections: {A -> B: 1}
outputs: {s: A.v, b: B.v, c: C.v, d: D.v}
"""


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_states_begin_where_the_group_says(backend: str) -> None:
    """With 'activity' they are first updated at step 1, without it at step 0."""
    run = compiled(STARTS).run(steps=3, backend=backend)
    assert run["b"].tolist() == pytest.approx([2, 1.8, 1.62])
    assert run["c"].tolist() == pytest.approx([2.7, 2.43, 2.187])
    assert run["d"][0] == pytest.approx(0.1)
    assert run["B"][0] == 0.5
    assert run["C"][0] == run["c"][0]
    reference = compiled(STARTS).run(steps=3, backend="reference")
    assert np.array_equal(run.activity, reference.activity)
    assert np.array_equal(run["s"], reference["s"])
    v = np.array([-65.0, -60.0, -55.0])
    u = Stream(0, "initial", "A.u").normal(np.arange(3), 0, 0, 0)
    assert run["s"][0] == pytest.approx(v + 0.04 * v**2 + 5 * v + 140 - u + 5)


def test_what_states_begin_with_is_content() -> None:
    hashes = {compiled(STARTS.replace("v: 3", f"v: {value}")).hash for value in (3, 4)}
    assert len(hashes) == 2
    one, other = (
        compiled(f"neurons: {{A: {{bias: 1, initial: {text}}}}}").hash
        for text in ("{activity: 'uniform(0, 1)'}", "'uniform(0, 1)'")
    )
    assert one == other
