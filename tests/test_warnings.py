"""Warnings: each where it belongs, none where something may be meant, and silent where the author says so."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from unittest.mock import patch

import networkx
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from toy_bodies import registered

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.codes import catalogue
from neurovis_spec.compiler.checks import neurons as checks
from neurovis_spec.compiler.checks import warnings as table
from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.language.allow import allows

ROOT = Path(__file__).parents[1]
SPECS = [*sorted((ROOT / "specs").glob("*.yaml")), ROOT / "specs" / "hexapod" / "hexapod.yaml"]
PAIR = "neurons: {A: {bias: 1}, B: {}}\n"


def warnings(body: str) -> list[tuple[str, str]]:
    """Code and the text at fault of every warning of a spec."""
    text = f"neurovis: 1\nname: x\n{body}"
    lines = text.split("\n")
    found = nv.compile_text(text).warnings
    assert all(item.severity == "warning" for item in found)
    return [(item.code, lines[item.span.line - 1][item.span.column - 1 : item.span.end_column - 1]) for item in found]


@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.stem)
def test_examples_are_free_of_warnings(path: Path) -> None:
    assert nv.compile(path).warnings == ()


# Inputs


def test_an_input_that_nothing_reads() -> None:
    assert warnings("inputs: {s: {}, r: {size: 2}}\nneurons: {A: {input: s}}\n") == [("unused-input", "r")]


def test_a_rule_reads_an_input() -> None:
    rule = "connections: {A -> B: {plasticity: {delta: {target: s}}}}\n"
    assert warnings(f"inputs: {{s: {{}}}}\n{PAIR}{rule}") == []


# Parameters


def test_a_parameter_that_nothing_uses() -> None:
    body = "parameters: {a: 1, b: 2*a, c: 3}\nneurons: {A: {bias: b}}\n"
    assert warnings(body) == [("unused-parameter", "c")]


def test_texts_for_people_use_nothing() -> None:
    body = "title: of gain\ndescription: gain\nparameters: {gain: 1}\nneurons: {A: {label: gain}}\n"
    assert warnings(body) == [("unused-parameter", "gain")]


def test_a_name_that_is_no_expression_uses_nothing() -> None:
    body = "parameters: {tanh: 1, s: 2, A: 3, one: 4}\ninputs: {s: {}}\n"
    body += "neurons: {A: {input: s, activation: tanh}, B: {names: [one]}}\n"
    body += "connections: {A -> B: {edges: [[A, one]]}}\n"
    assert warnings(body) == [("unused-parameter", name) for name in ("tanh", "s", "A", "one")]


def test_a_definition_is_not_used_by_what_is_called_alike() -> None:
    body = "activations: {cube: {value: x^3}}\nmodels: {kept: {activity: f(drive)}}\n"
    assert warnings(body + "neurons: {cube: {bias: 1, model: kept}}\noutputs: {kept: cube}\n") == [
        ("unused-definition", "cube")
    ]
    module = "modules: {leg: {neurons: {K: {bias: 1, activation: cube}}}}\n"
    assert [code for code, _ in warnings(body + module + "neurons: {A: {bias: 1, model: kept}}\n")] == ["unused-module"]


def test_a_definition_sees_its_own_parameters() -> None:
    body = "parameters: {beta: 1}\n"
    body += "activations: {swish: {parameters: {beta: 1}, value: x * sigmoid(beta * x)}}\n"
    body += "neurons: {A: {activation: swish, bias: 1}}\n"
    assert warnings(body) == [("unused-parameter", "beta")]


@pytest.mark.parametrize(
    "use",
    [
        "neurons: {A: {bias: p}}",
        "neurons: {A: {count: p}}",
        "neurons: {A: {count: 2, bias: [1, p]}}",
        "neurons: {A: {initial: -p}}",
        'neurons: {A: {noise: "normal(0, p)"}}',
        "neurons: {A: {activation: {gaussian: {sigma: p}}}}",
        "neurons: {A: {model: {leaky_integrator: {leak: p/2}}}}",
        "neurons: {A: {position: [p, 0]}}",
        "time: {dt: 1, steps: 10*p}\nneurons: {A: {}}",
        "inputs: {s: {expression: p*k}}\nneurons: {A: {input: s}}",
        "inputs: {s: {size: p}}\nneurons: {A: {input: s}}",
        "inputs: {s: {values: [[0], [p]]}}\nneurons: {A: {input: s}}",
        "neurons: {A: {bias: 1}}\nconnections: {A -> A: p}",
        "neurons: {A: {bias: 1}}\nconnections: {A -> A: {delay: p}}",
        "neurons: {A: {bias: 1}}\nconnections: {A -> A: {matrix: [[p]]}}",
        "neurons: {A: {bias: 1}}\nconnections: {A -> A: {edges: [[A, A, p]]}}",
        "neurons: {A: {bias: 1}}\nconnections: {A -> A: {plasticity: {hebbian: {rate: p}}}}",
        "neurons: {A: {bias: 1}}\nconnections: {A -> A: {plasticity: hebbian, bounds: [-p, p]}}",
        "neurons: {A: {count: 9, bias: 1}}\nconnections: {A -> A: {pattern: {random: {probability: p/2}}}}",
        "neurons: {A: {bias: 1}}\nevents: [{from: 3, clamp: {A: p}}]",
    ],
)
def test_every_place_of_an_expression_uses_a_parameter(use: str) -> None:
    assert warnings(f"parameters: {{p: 1}}\n{use}\n") == []


# Definitions


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        ("activation", "activations: {cube: {value: x^3}}"),
        ("model", "models: {cube: {activity: f(drive)^3}}"),
        ("rule", "rules: {cube: {weight: {each_step: weight + pre^3}}}"),
    ],
)
def test_a_definition_that_nobody_uses(kind: str, body: str) -> None:
    assert warnings(f"{body}\n{PAIR}") == [("unused-definition", "cube")]
    if kind == "rule":
        assert warnings(f"{body}\n{PAIR}connections: {{A -> B: {{plasticity: cube}}}}\n") == []
    else:
        assert warnings(f"{body}\nneurons: {{A: {{{kind}: cube, bias: 1}}}}\n") == []


@pytest.mark.parametrize(
    ("definition", "use"),
    [
        ("rules: {cube: {weight: {each_step: weight + pre^3}}}", "plasticity"),
        ("synapses: {cube: {signal: pre^3}}", "synapse"),
    ],
)
def test_what_an_entry_names_that_draws_no_connection_is_used(definition: str, use: str) -> None:
    body = f"{definition}\n{PAIR}connections: {{A -> B: {{pattern: {{random: {{probability: 0}}}}, {use}: cube}}}}\n"
    assert ("unused-definition", "cube") not in warnings(body)


def test_a_default_that_is_replaced_is_used() -> None:
    body = "activations: {identity: {value: 2*x}}\nneurons: {A: {bias: 1}}\n"
    assert warnings(body) == [("replaces-builtin", "identity")]


# Idle neurons


def test_a_neuron_that_stays_at_zero() -> None:
    assert warnings("neurons: {A: {}, B: {}}\nconnections: {A -> B: 1}\n") == [("idle-neuron", "A")]
    assert warnings("neurons: {A: {}}\noutputs: {a: A}\n") == [("idle-neuron", "A")]
    rule = "connections: {A -> B: {plasticity: {delta: {target: T}}}}\n"
    assert warnings("neurons: {A: {bias: 1}, B: {}, T: {}}\n" + rule) == [("idle-neuron", "T")]


@given(
    st.lists(st.tuples(st.sampled_from("ABCDEFGH"), st.sampled_from("ABCDEFGH")), min_size=1, max_size=14, unique=True),
    st.sets(st.sampled_from("ABCDEFGH"), max_size=2),
    st.sampled_from([0, 32]),
    st.sampled_from([0, 8]),
)
def test_idle_are_those_that_nothing_else_leads_to(
    edges: list[tuple[str, str]], active: set[str], few: int, at_once: int
) -> None:
    graph = networkx.DiGraph(edges)
    graph.add_nodes_from("ABCDEFGH")
    idle = graph.subgraph(set(graph) - active.union(*(networkx.descendants(graph, neuron) for neuron in active)))
    whole = networkx.condensation(idle)
    first = {name for part in whole if not whole.in_degree(part) for name in whole.nodes[part]["members"]}
    groups = "".join(f"  {name}: {{bias: {int(name in active)}}}\n" for name in "ABCDEFGH").replace("{bias: 0}", "{}")
    entries = "".join(
        f"  {source} -> {target}: {'{self: true}' if source == target else 1}\n" for source, target in edges
    )
    with patch.object(checks, "_FEW_ENOUGH_FOR_LOOP", few), patch.object(checks, "_WHOLE_ARRAY_PASSES", at_once):
        found = warnings(f"neurons:\n{groups}connections:\n{entries}")
    assert sorted(found) == [("idle-neuron", name) for name in sorted(first)]


@pytest.mark.parametrize("model", ["leaky_integrator", "adaptive", "hysteresis", "integrate_and_fire"])
def test_a_state_that_nothing_drives_stays(model: str) -> None:
    activation = "" if model == "integrate_and_fire" else ", activation: tanh"  # which that model does not use
    body = f"neurons: {{A: {{model: {model}{activation}}}, B: {{}}}}\nconnections: {{A -> B: 1}}\n"
    run = nv.compile_text(f"neurovis: 1\nname: x\n{body}").run(50)
    assert not run["A"].any()
    assert warnings(body) == [("idle-neuron", "A")]


@pytest.mark.parametrize(
    "neuron",
    [
        "bias: 1",
        "bias: 0",
        "initial: 0.1",
        "initial: 0",
        'noise: "normal(0, 1)"',
        "input: s",
        "activation: cos",
        "activation: sigmoid",
        "activation: step",
        "combine: product",
        "activation: gaussian, combine: distance",
        "model: izhikevich",
        "model: clock",
    ],
)
def test_a_neuron_that_may_be_active_is_let_be(neuron: str) -> None:
    body = "inputs: {s: {}}\nmodels: {clock: {activity: f(k)}}\n"
    body += f"neurons: {{A: {{{neuron}}}, B: {{}}, S: {{input: s}}, C: {{model: clock}}}}\nconnections: {{A -> B: 1}}\n"
    assert warnings(body) == []


@pytest.mark.parametrize(
    "model",
    [
        "{activity: f(drive) if k < 50 else 1}",
        "{activity: f(drive) + step(t - 30)}",
        "{state: {c: {initial: 0, each_step: c + 1}}, activity: f(drive) if c < 10 else 1}",
        "{state: {c: {initial: 0, each_step: c + (1 if k > 20 else 0)}}, activity: c}",
        "{let: {late: step(k - 40)}, state: {c: {initial: 0, each_step: c + late}}, activity: c}",
        "{state: {c: {initial: 0, each_episode: c + 1}}, activity: c}",
        "{state: {v: {initial: 0, each_step: u}, u: {initial: 0, each_step: u + step(k - 9)}}, activity: v}",
    ],
)
def test_a_neuron_whose_own_model_begins_late_is_let_be(model: str) -> None:
    body = f"time: {{episode: 30}}\nmodels: {{late: {model}}}\n"
    body += "neurons: {A: {model: late}, B: {}}\nconnections: {A -> B: 1}\n"
    assert nv.compile_text(f"neurovis: 1\nname: x\n{body}").run(99)["A"].any()
    assert warnings(body) == []


def test_a_neuron_that_an_event_makes_active_is_let_be() -> None:
    body = "parameters: {level: 0}\nmodels: {held: {parameters: {at: 0}, activity: at}}\n"
    body += "neurons: {A: {model: {held: {at: level}}}, B: {}}\nconnections: {A -> B: 1}\n"
    assert warnings(body) == [("idle-neuron", "A")]
    assert warnings(body + "events: [{at: 5, set: {level: 1}}]\n") == []


def test_a_neuron_without_any_connection_is_told_of_where_others_have_some() -> None:
    assert warnings("neurons: {A: {}, B: {count: 2}}\n") == []  # a sketch
    assert warnings("neurons: {A: {bias: 1}, B: {}, C: {}}\nconnections: {A -> B: 1}\n") == [("idle-neuron", "C")]


@pytest.mark.parametrize(
    ("neurons", "connections", "told"),
    [
        ("A: {}, B: {}", "A -> A: 1, A -> B: 1", ["A"]),
        ("A: {}, B: {}, C: {}", "A -> B: 1, B -> A: 1, B -> C: 1, C -> C: 1", ["A", "B"]),
        ("K: {count: 3, activation: tanh}", "K -> K: {pattern: ring}", ["K"]),
        ("A: {initial: 0.1}, B: {}", "A -> A: 1, A -> B: 1", []),
        ("A: {activation: cos}, B: {}", "A -> A: 1, A -> B: 1, B -> B: 1", []),
        ("A: {activation: {gaussian: {sigma: 1}}, combine: distance}", "A -> A: {centre: 1}", []),
        ("A: {combine: distance}, B: {}", "A -> A: {centre: 1}, A -> B: 1", []),
        ("A: {bias: 1}, B: {}, C: {}", "A -> B: 0, B -> B: 1, B -> C: 1, C -> B: 1", []),
    ],
)
def test_what_only_feeds_itself_is_not_reached(neurons: str, connections: str, told: list[str]) -> None:
    body = f"neurons: {{{neurons}}}\nconnections: {{{connections}}}\n"
    assert warnings(body) == [("idle-neuron", name) for name in told]
    run = nv.compile_text(f"neurovis: 1\nname: x\n{body}").run(20)
    assert all(not run[name].any() for name in told)


def test_a_long_way_from_what_is_active() -> None:
    body = "neurons: {A: {bias: 1}, K: {count: 60}, B: {}}\n"
    body += "connections: {A -> K1: 1, K -> K: {pattern: chain}, K60 -> B: 1"
    assert warnings(body + "}\n") == []
    assert warnings(body.replace("A -> K1: 1, ", "") + ", A -> B: 1}\n") == [("idle-neuron", "K")]


def test_a_clamp_is_a_source() -> None:
    body = "neurons: {A: {}, B: {}}\nconnections: {A -> B: 1}\n"
    assert warnings(body + "events: [{from: 3, to: 5, clamp: {A: 1}}]\n") == []
    assert warnings(body + "events: [{at: 3, lesion: A}]\n") == [("idle-neuron", "A")]


def test_one_finding_for_a_group() -> None:
    body = "neurons: {K: {count: 900}, O: {}}\nconnections: {K -> O: 1}\n"
    assert warnings(body) == [("idle-neuron", "K")]
    body = "neurons: {K: {count: 9}, O: {bias: 1}}\nconnections: [{K -> O: 1}, {O -> K2..K8: 1}]\n"
    (found,) = nv.compile_text(f"neurovis: 1\nname: x\n{body}").warnings
    assert "'K1', 'K9'" in found.message


# Rates


def test_a_rate_of_zero() -> None:
    body = f"{PAIR}connections: {{A -> B: {{plasticity: {{hebbian: {{rate: 0}}}}}}}}\n"
    assert warnings(body) == [("zero-rate", "0")]
    rule = "rules: {mine: {parameters: {rate: 0}, weight: {each_step: weight + rate * pre}}}\n"
    assert warnings(f"{rule}{PAIR}connections: {{A -> B: {{plasticity: mine}}}}\n") == [("zero-rate", "mine")]


@pytest.mark.parametrize(
    "rule",
    ["{hebbian: {rate: eta}}", "{hebbian: {rate: 1e-9}}", "hebbian", "{mine: {rate: 0}}", "{late: {rate: 0}}"],
)
def test_a_rule_that_may_learn_is_let_be(rule: str) -> None:
    body = "parameters: {eta: 0}\nrules:\n"
    body += "  mine: {parameters: {rate: 1, loss: 0.1}, weight: {each_step: weight + rate * pre - loss * weight}}\n"
    body += "  late: {parameters: {rate: 1}, weight: {each_step: weight + rate * pre, each_episode: weight / 2}}\n"
    body += "neurons: {A: {bias: eta + 1}, B: {}}\nconnections:\n"
    body += f"  A -> B: {{plasticity: {rule}}}\n  B -> A: {{plasticity: mine}}\n  B -> B: {{plasticity: late}}\n"
    assert warnings(body) == []


def test_a_rule_for_episodes_without_episodes() -> None:
    body = "neurons: {A: {bias: 1}, P: {bias: 1}, R: {bias: 1}, O: {}}\nconnections:\n"
    body += "  A -> O: {plasticity: {reward_modulated: {policy: P, reward: R}}}\n"
    assert warnings(body) == [("no-effect", "reward_modulated")]
    assert warnings(f"{body}time: {{episode: 5}}\n") == []
    own = "rules: {mine: {weight: {each_episode: weight / 2}}, both: {weight: {each_step: weight, each_episode: 0}}}\n"
    assert warnings(f"{own}{body}  R -> O: {{plasticity: mine}}\n  O -> O: {{plasticity: both}}\n") == [
        ("no-effect", "reward_modulated"),
        ("no-effect", "mine"),
    ]
    leg = "modules: {leg: {neurons: {A: {bias: 1}, B: {}}, connections: {A -> B: {plasticity: mine}}}}\n"
    rule = "rules: {mine: {weight: {each_episode: weight / 2}}}\n"
    assert warnings(f"{rule}{leg}instances: {{x: {{module: leg, count: 3}}}}\n") == [("no-effect", "mine")]


# Where there is an error there are no warnings of these kinds


def test_errors_come_alone() -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text("neurovis: 1\nname: x\nparameters: {a: 1, b: c}\nneurons: {A: {}}\n")
    assert [found.code for found in caught.value.diagnostics] == ["unknown-name"]


def test_strict(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.yaml").write_text("neurovis: 1\nname: x\nparameters: {a: 1}\nneurons: {A: {}}\n", encoding="utf-8")
    plain = CliRunner().invoke(neurovis, ["validate", "x.yaml"])
    assert (plain.exit_code, plain.stdout) == (0, "x.yaml: ok (1 neuron, 0 connections)\n")
    assert "x.yaml:3:14: warning[unused-parameter]: no expression uses the parameter 'a'" in plain.stderr
    strict = CliRunner().invoke(neurovis, ["validate", "x.yaml", "--strict"])
    assert (strict.exit_code, strict.stdout) == (1, "")
    assert "x.yaml:3:14: error[unused-parameter]" in strict.stderr


TWO_WARNINGS = "neurovis: 1\nname: x\nparameters: {a: 1, b: 2}\nneurons: {A: {bias: 1}}\n"


@pytest.mark.parametrize(
    "arguments",
    [
        "run SPEC --steps 2 -o x.npz",
        "render SPEC -o x.svg",
        "animate SPEC --steps 2 -o x.svg",
        "sweep SPEC --over seed=1 --metric mean(A) --steps 2 --jobs 1 -o x.csv",
        "analyze SPEC -o measures",
        "layout SPEC -o layout.yaml",
        "inspect SPEC",
        "export SPEC --to c -o exported",
        "ros export SPEC -o exported",
    ],
)
def test_validate_alone_shows_warnings_in_full(arguments: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The others say how many there are, and by which command they are shown, of a SPEC as it is named."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a b.yaml").write_text(TWO_WARNINGS, encoding="utf-8")
    told = CliRunner().invoke(neurovis, ["a b.yaml" if word == "SPEC" else word for word in arguments.split()])
    assert told.exit_code == 0, told.output
    assert "2 warnings: neurovis validate 'a b.yaml'" in told.stderr.splitlines()
    assert "unused-parameter" not in told.stderr


def test_warnings_of_standard_input_are_shown_with_the_options_that_matter() -> None:
    given = ["inspect", "-", "--limit", "9", "--root", ".", "--no-body"]
    told = CliRunner().invoke(neurovis, given, input=TWO_WARNINGS.replace(", b: 2", ""))
    assert told.stderr == "1 warning: neurovis validate - --root . --limit 9 --no-body\n"


# Comments that allow


def test_an_allowed_warning_is_silent() -> None:
    assert warnings("parameters:\n  a: 1   # neurovis: allow unused-parameter\nneurons: {A: {}}\n") == []
    assert warnings("parameters:\n  a: 1   #neurovis:allow unused-parameter\nneurons: {A: {}}\n") == []
    assert warnings("parameters:\n  a: 1   # neurovis: allow unused-parameter # for later\nneurons: {A: {}}\n") == []
    assert warnings("parameters:\n  a: 1   # for later  # neurovis: allow unused-parameter\nneurons: {A: {}}\n") == []


def test_several_codes() -> None:
    line = "activations: {relu: {value: x}}   # neurovis: allow unused-definition, replaces-builtin\n"
    assert warnings(f"{line}neurons: {{A: {{}}}}\n") == []


def test_only_its_line_and_its_code() -> None:
    body = (
        "parameters:   # neurovis: allow unused-parameter\n  a: 1   # neurovis: allow unused-input\nneurons: {A: {}}\n"
    )
    assert warnings(body) == [
        ("useless-allow", "unused-parameter"),
        ("unused-parameter", "a"),
        ("useless-allow", "unused-input"),
    ]


@pytest.mark.parametrize(
    ("comment", "place", "words"),
    [
        ("# neurovis: allow idle-neuron", "idle-neuron", "there is no warning 'idle-neuron' on this line"),
        ("# neurovis: allow unknown-name", "unknown-name", "is an error; only warnings can be allowed"),
        ("# neurovis: allow idle-neurons", "idle-neurons", "did you mean 'idle-neuron'?"),
        ("# neurovis: allow", "# neurovis: allow", "this comment allows nothing"),
        ("# neurovis: allow useless-allow", "useless-allow", "there is no warning 'useless-allow' on this line"),
    ],
)
def test_an_allow_for_nothing_is_a_warning(comment: str, place: str, words: str) -> None:
    body = f"neurons: {{A: {{}}}}   {comment}\n"
    assert warnings(body) == [("useless-allow", place)]
    (found,) = nv.compile_text(f"neurovis: 1\nname: x\n{body}").warnings
    assert words in f"{found.message}; {found.hint}"


def test_a_useless_allow_can_be_allowed() -> None:
    assert warnings("neurons: {A: {}}   # neurovis: allow idle-neuron, useless-allow\n") == []


def test_an_error_is_not_silenced() -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {bias: c}}   # neurovis: allow unknown-name, idle-neuron\n")
    # whether there would be a warning without the error, nobody knows
    assert [found.code for found in caught.value.diagnostics] == ["unknown-name", "useless-allow"]


@pytest.mark.parametrize(
    "value",
    [
        "'# neurovis: allow unused-parameter'",
        '"# neurovis: allow unused-parameter"',
        "a#neurovis:allow unused-parameter",
        "'two\n\n  # neurovis: allow unused-parameter lines'",
        "|\n  # neurovis: allow unused-parameter\n  and more",
        ">-\n  # neurovis: allow unused-parameter",
    ],
)
def test_a_text_is_no_comment(value: str) -> None:
    assert warnings(f"title: {value}\nneurons: {{A: {{}}}}\n") == []
    assert warnings(f"parameters: {{a: 1}}\ndescription: {value}\nneurons: {{A: {{}}}}\n") == [
        ("unused-parameter", "a")
    ]


def test_a_comment_behind_a_text_is_one() -> None:
    text = "a: 'x # neurovis: allow a'   # neurovis: allow b\nc: |   # neurovis: allow d\n  # neurovis: allow e\nf: x\n"
    assert [(allow.code, allow.span.line) for allow in allows(text, "f")] == [("b", 1), ("d", 2)]


def test_line_ends_of_windows() -> None:
    body = (
        "neurovis: 1\r\nname: x\r\nparameters:\r\n  a: 1   # neurovis: allow unused-parameter\r\nneurons: {A: {}}\r\n"
    )
    assert nv.compile_text(body).warnings == ()


def test_every_warning_of_the_catalogue_can_be_allowed(tmp_path: Path) -> None:
    for code in catalogue().values():
        # a package of another's, one that is not there, and a run
        elsewhere = ("useless-allow", "hidden-definition", "body-unchecked", "states-begin-anew")
        if code.severity == "warning" and code.name not in elsewhere:
            assert code.bad is not None
            for name, content in code.files.items():
                (tmp_path / name).write_text(content)
            (found,) = _told(code.bad, tmp_path)
            lines = code.bad.split("\n")
            lines[found.span.line - 1] += f"   # neurovis: allow {code.name}"
            assert _told("\n".join(lines), tmp_path) == (), code.name


def test_a_check_that_is_left_out_would_find_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Checks are left out of specs without their sections: so it is with the examples of the catalogue."""
    done = []

    def warn(compiled: Compiled, findings: Findings) -> None:
        table.warn(compiled, findings)
        found = findings.sorted()
        for check in table._CHECKS:
            check.warn(compiled, findings)
        assert findings.sorted() == found, compiled.spec.source
        done.append(found)

    monkeypatch.setattr("neurovis_spec.compiler.compile.warn", warn)
    for code in catalogue().values():
        texts = (code.good, code.bad if code.severity == "warning" else None)
        for text in (text for text in texts if text is not None and not code.files):
            with suppress(nv.SpecError):
                nv.compile_text(text, folder=tmp_path)
    assert len(done) > 100
    assert sum(map(bool, done)) >= 20


def _told(text: str, folder: Path) -> tuple[Diagnostic, ...]:
    """What is said of a spec when it is compiled, else of its layout."""
    network = nv.compile_text(text, folder=folder)
    return network.warnings or network.layout().warnings


@given(st.text(max_size=60), st.text(max_size=20))
def test_any_text_can_be_searched(before: str, codes: str) -> None:
    for allow in allows(f"{before}\nx: 1  # neurovis: allow {codes}", "f"):
        assert allow.span.column >= 1
        assert not set(allow.code) & set(" ,#\r\n")


def test_a_commented_spec_is_no_allow() -> None:
    assert warnings("neurons: {A: {}}\n# neurovis: 1\n# neurovis: allowance\n") == []


# What something outside the run reads


MONITOR = """\
models:
  cell:
    parameters: {slow: 0.9}
    let: {low: v - 1}
    state:
      v: {each_step: 0.9 * v + drive}
      calcium: {each_step: slow * calcium + low}
    activity: f(v)
rules:
  counting:
    parameters: {rate: 0, slow: 0.5}
    let: {both: pre * post}
    state: {seen: {each_step: slow * seen + both}}
    weight: {each_step: weight + rate * pre}
neurons: {A: {bias: 1, model: cell}, B: {}}
"""


@pytest.mark.parametrize(
    "readers",
    [
        "outputs: {calcium: A.calcium, seen: (A -> B).seen}\n",
        "outputs: {seen: (A -> B).seen}\nrender: {figure: [{traces: [A.calcium]}]}\n",
        "outputs: {seen: (A -> B).seen}\n",  # 'run --states A.calcium' reads it, 'sweep --metric', 'sim.step', …
    ],
)
@pytest.mark.parametrize("bounds", ["", ", bounds: [1, 1]"])
def test_a_state_is_there_to_be_recorded(readers: str, bounds: str) -> None:
    """Nor is what it reads unused, nor a rule that changes no weight without effect where its states are outputs."""
    assert warnings(f"{MONITOR}connections: {{A -> B: {{plasticity: counting{bounds}}}}}\n{readers}") == []


def test_what_no_state_reads_either_is_told() -> None:
    body = MONITOR.replace("+ low}", "}").replace("+ both}", "}")
    assert warnings(body + "connections: {A -> B: {plasticity: {counting: {rate: 0}}}}\n") == [
        ("unused-part", "low"),
        ("unused-part", "both"),
        ("zero-rate", "0"),
    ]


def test_a_strict_check_passes_a_spec_whose_states_are_recorded(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text(f"neurovis: 1\nname: x\n{MONITOR}connections: {{A -> B: 1}}\n", "utf-8")
    spec = str(tmp_path / "x.yaml")
    found = CliRunner().invoke(neurovis, ["validate", spec, "--strict"])
    assert "unused-part" not in found.stderr
    ran = CliRunner().invoke(neurovis, ["run", spec, "--steps", "3", "--states", "A.calcium"])
    assert "unused-part" not in ran.stderr


def test_a_body_that_ends_its_episodes_itself_is_reset(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch)
    body = "time: {dt: 0.05}\nneurons: {A: {bias: 1}}\noutputs: {a: A}\n"
    assert warnings(body + "body: {toy: short, actuators: {push: a}, reset: each_episode}\n") == []
