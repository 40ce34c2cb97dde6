"""Synapses, and rules with derivatives or a centre, as they are written: what becomes of them, where their names hold,
what of them is hashed."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_specs import answer, compiled, network_of

import neurovis_spec as nv
from neurovis_spec.compiler.program import RULE, SYNAPSE, Definition, EndName
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import Chain, Name, names

CELLS = """\
time: {dt: 0.1 ms}
models:
  cell:
    parameters: {tau: 2, rest: -60}
    state: {v: {derivative: (rest - v + drive)/tau}}
    outputs: {rate: 2*v}
    activity: v
neurons: {A: {model: cell, bias: 1}, B: {model: cell}}
"""


def synapse(text: str) -> Definition:
    """A synapse as it is in use from A to B."""
    network = network_of(f"{CELLS}synapses: {{s: {text}}}\nconnections: {{A -> B: {{synapse: s}}}}\n")
    (made,) = (one.use.definition for one in network.projections if one.kind == SYNAPSE)
    return made


def rule(text: str) -> Definition:
    """A rule as it is in use from A to B."""
    network = network_of(f"{CELLS}rules: {{s: {text}}}\nconnections: {{A -> B: {{plasticity: s}}}}\n")
    (made,) = (one.use.definition for one in network.projections if one.kind == RULE)
    return made


def test_a_synapse_is_a_definition() -> None:
    made = synapse(
        "{time: ms, parameters: {E: {value: 0, unit: mV}}, let: {c: g*b, b: 2*pre.rate}, "
        "state: {g: {initial: E + 1, unit: nS, derivative: b - g}, n: {each_step: n + 1, each_episode: 0}}, "
        "signal: weight*c*(E - post.v), sign: E + 1, description: one}"
    )
    assert (made.kind, made.name, made.per_second) == (SYNAPSE, "s", 1000.0)
    assert made.parameters == ("E",)
    assert made.units == (("E", "mV"),)
    assert [name for name, _ in made.let] == ["b", "c"]
    assert [one.name for one in made.gives] == ["signal"]
    assert [(one.name, one.unit, one.each_step is None, one.each_episode is None) for one in made.state] == [
        ("g", "nS", True, True),
        ("n", "", False, False),
    ]
    assert [one.name for one in made.flows] == ["g"]
    assert made.lasting == made.state
    assert made.fleeting == made.gives
    assert made.end_names == (EndName("post", "v"), EndName("pre", "rate"))
    assert made.sign is not None
    assert names(made.sign) == {"E"}


def test_what_is_at_an_end_is_one_name() -> None:
    tree = parse("-pre.v*(post.E1 - pre)", naming="ends")
    assert names(tree) == {"pre.v", "post.E1", "pre"}
    assert parse("  pre.v", naming="ends") == Name("pre.v", 2, 7)


NO_ATTRIBUTES = ("no-attributes", "there are no attributes in an expression", "refer to a value by its name alone")


@pytest.mark.parametrize(
    "text",
    [
        "neurons: {A: {bias: pre.v}}",
        "models: {m: {activity: drive + pre.v}}\nneurons: {A: {}}",
        "activations: {m: {value: x*post.v}}\nneurons: {A: {}}",
        "inputs: {s: {expression: pre.v}}\nneurons: {A: {}}",
        "parameters: {p: pre.v}\nneurons: {A: {}}",
        "neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: {plasticity: {hebbian: {rate: pre.v}}}}",
    ],
)
def test_elsewhere_a_point_is_answered_as_ever(text: str) -> None:
    assert answer(text) == NO_ATTRIBUTES


def test_a_weight_reads_parameters_of_the_ends_alone() -> None:
    code, message, _ = answer("neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: {weight: pre.v}}")
    assert (code, message) == ("unknown-name", "the model 'static' of 'A' has no parameter 'v'")


def test_a_group_may_be_called_pre() -> None:
    text = CELLS.replace("A:", "pre:").replace("B:", "post:")
    text += "connections: {pre -> post: 0.5}\noutputs: {o: pre.v, p: pre}\n"
    network = compiled(text)
    run = network.run(3)
    assert run["o"].tolist() == run["pre"].tolist()
    assert [output.name for output in network.network.outputs] == ["o", "p"]


def test_powers_are_products_in_all_synapses_and_where_a_rule_has_a_derivative() -> None:
    cube = (Name("pre.v"),) * 3

    def operands(made: Definition) -> tuple[Name, ...]:
        tree = dict(made.let)["c"]
        assert isinstance(tree, Chain)
        return tuple(Name(part.name) for part in tree.operands if isinstance(part, Name))

    assert operands(synapse("{let: {c: pre.v^3}, signal: c}")) == cube
    assert operands(rule("{let: {c: pre.v^3}, weight: {derivative: c}}")) == cube
    assert operands(rule("{let: {c: pre.v^3}, state: {q: {derivative: c}}, weight: {each_step: weight*q}}")) == cube
    assert not isinstance(dict(rule("{let: {c: pre.v^3}, weight: {each_step: weight + c}}").let)["c"], Chain)


def test_a_rule_may_have_derivatives() -> None:
    made = rule("{time: ms, state: {c: {unit: mM, derivative: pre.v*post.v - c}}, weight: {derivative: c - weight}}")
    assert (made.per_second, made.given.name, made.given.each_step) == (1000.0, "weight", None)
    assert made.given.derivative is not None
    assert names(made.given.derivative) == {"c", "weight"}
    assert [(one.name, one.unit) for one in made.flows] == [("c", "mM")]
    assert made.lasting == (*made.state, *made.gives)


@pytest.mark.parametrize(
    ("settings", "value"),
    [("{E: 2*i + j + n_to}", 1.0), ("{tau: 0.02 s}", 20.0), ("{E: [7]}", 7.0), ("{E: g}", 3.0)],
)
def test_a_synapse_is_set_as_a_rule_is(settings: str, value: float) -> None:
    text = (
        f"{CELLS}parameters: {{g: 3}}\nsynapses: {{s: {{parameters: {{E: 0, tau: {{value: 1, unit: ms}}}}, "
        f"signal: weight*pre/tau + E}}}}\nconnections: {{A -> B: {{synapse: {{s: {settings}}}}}}}\n"
    )
    (one,) = network_of(text).projections
    assert one.use.parameters["tau" if "tau" in settings else "E"].tolist() == [value]


BASE = (
    CELLS + "synapses: {s: {time: s, parameters: {E: 1, b: 2}, let: {c: b*g}, "
    "state: {g: {unit: nS, derivative: pre - g}, n: {each_step: n + 1}}, "
    "signal: weight*(c + n)*(E - post.v), sign: E, description: one}}\n"
    "rules: {r: {time: s, state: {q: {unit: mM, derivative: pre - q}}, weight: {derivative: q - weight}}}\n"
    "connections: {A -> B: {synapse: s, plasticity: r}}\n"
)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("sign: E", "sign: -E"),
        ("unit: nS", "unit: pS"),
        ("unit: mM", "unit: uM"),
        ("description: one", "description: two"),
        ("{E: 1, b: 2}", "{b: 2, E: 1}"),
        (
            "g: {unit: nS, derivative: pre - g}, n: {each_step: n + 1}",
            "n: {each_step: n + 1}, g: {derivative: pre - g}",
        ),
        ("time: s, parameters", "parameters"),
        ("synapses: {s", "synapses: {other: {signal: weight*pre}, s"),
    ],
)
def test_what_the_hash_does_not_see(old: str, new: str) -> None:
    assert old in BASE
    assert network_of(BASE.replace(old, new)).hash == network_of(BASE).hash


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("signal: weight", "signal: 2*weight"),
        ("let: {c: b*g}", "let: {c: b + g}"),
        ("derivative: pre - g", "derivative: sent - g"),
        ("derivative: pre - g", "initial: 1, derivative: pre - g"),
        ("derivative: pre - g", "each_step: pre - g"),
        ("n: {each_step: n + 1}", "n: {each_step: n + 1, each_episode: 0}"),
        ("s: {time: s", "s: {time: ms"),
        ("r: {time: s", "r: {time: ms"),
        ("{E: 1,", "{E: 3,"),
        ("post.v", "post.rate"),
        ("derivative: pre - q", "derivative: sent - q"),
        ("derivative: q - weight", "derivative: q"),
        ("derivative: q - weight", "each_step: q - weight"),
        ("synapse: s, ", ""),
    ],
)
def test_what_the_hash_sees(old: str, new: str) -> None:
    assert old in BASE
    assert network_of(BASE.replace(old, new)).hash != network_of(BASE).hash


def test_files_that_are_included_and_modules_have_synapses(tmp_path: Path) -> None:
    library = tmp_path / "library.yaml"
    library.write_text("synapses: {gap: {parameters: {g: 1}, signal: g*weight*(pre.v - post.v), sign: 0}}", "utf-8")
    text = (
        CELLS + "include: library.yaml\nmodules:\n  pair:\n    neurons: {P: {model: cell}, Q: {model: cell, bias: 1}}\n"
        "    connections: {Q -> P: {synapse: {gap: {g: 2}}}}\ninstances: {one: {module: pair}}\n"
        "connections: {A -> B: {synapse: gap}}\n"
    )
    network = compiled(text, tmp_path)
    assert network.warnings == ()
    found = [one.use.parameters["g"].tolist() for one in network.network.projections]
    assert sorted(value for values in found for value in values) == [1.0, 2.0]
    whole = network.text()
    library.unlink()
    assert nv.compile_text(whole, folder=tmp_path).hash == network.hash


def test_no_state_of_a_synapse_has_the_name_of_its_signal() -> None:
    """(A -> B).signal is what the synapse gives, in recordings."""
    text = "neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: {synapse: s}}\n"
    body = "{state: {signal: {each_step: signal + pre}}, signal: weight*signal}"
    code, message, hint = answer(f"synapses: {{s: {body}}}\n{text}")
    assert (code, hint) == ("reserved-name", "choose another name")
    assert message == "'signal' is no name for a state of a synapse: it means what the synapse gives"
    one = f"synapses: {{s: {{parameters: {{signal: 1}}, signal: weight*signal}}}}\n{text}"
    assert compiled(one).run(2).state_names == ("(A -> B).signal",)
