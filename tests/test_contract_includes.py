"""What is left of modules and included files (§8)."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_specs import HEAD, codes, compiled, network_of, wires

import neurovis_spec as nv

LEG = "modules: {leg: {neurons: {K: {bias: 1}}}}\n"
SPEC = "include: more.yaml\ninstances: {left: {module: leg}}\n"


@pytest.mark.parametrize(
    "section",
    [
        "name: y", "time: {steps: 3}", "seed: 3", "parameters: {p: 1}", "inputs: {s: {}}", "neurons: {A: {}}",
        "instances: {l: {module: leg}}", "connections: {A -> B: 1}", "outputs: {o: A}", "events: [{at: 1, lesion: A}]",
        "layout: {engine: grid}", "render: {theme: dark}", "ros: {rate: 3}",
    ],
)  # fmt: skip
def test_an_included_file_holds_no_section_of_a_network(section: str, tmp_path: Path) -> None:
    """The finding stands in that file, at the key."""
    (tmp_path / "more.yaml").write_text(f"{LEG}{section}\n", encoding="utf-8")
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(HEAD + SPEC, folder=tmp_path)
    (found,) = caught.value.diagnostics
    assert (found.code, Path(found.span.file).name) == ("unknown-key", "more.yaml")
    assert (found.span.line, found.span.column) == (2, 1)


def test_an_included_file_may_hold_the_version_modules_definitions_and_metadata(tmp_path: Path) -> None:
    """Titles, authors and the like are its own, not the spec's."""
    more = (
        "neurovis: 1\ntitle: Legs\ndescription: [a, b]\nauthors: [A, B]\nlicense: MIT\nreferences: C\n"
        "activations: {cube: {value: x^3}}\nmodels: {keep: {activity: f(drive)}}\n"
        "rules: {grow: {weight: {each_step: weight + 1}}}\n"
        "modules: {leg: {neurons: {K: {bias: 2, activation: cube, model: keep}, L: {}},"
        " connections: {K -> L: {weight: 0, plasticity: grow}}}}\n"
    )
    (tmp_path / "more.yaml").write_text(more, encoding="utf-8")
    network = compiled(f"title: Mine\n{SPEC}", tmp_path)
    run = network.run(3)
    assert network.network.title == "Mine"
    assert run["left.K"].tolist() == [8, 8, 8]
    assert run.weights[:, 0].tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("section", "name", "body"),
    [
        ("modules", "leg", "{neurons: {K: {bias: 2}}}"),
        ("activations", "bend", "{value: x}"),
        ("models", "keep", "{activity: f(drive)}"),
        ("rules", "grow", "{weight: {each_step: weight + 1}}"),
    ],
)
def test_two_definitions_of_one_name_are_an_error(section: str, name: str, body: str, tmp_path: Path) -> None:
    """In two files, wherever the second is; the finding names the place of the first."""
    for file in ("more", "again"):
        (tmp_path / f"{file}.yaml").write_text(f"{section}: {{{name}: {body}}}\n", encoding="utf-8")
    rest = "neurons: {A: {bias: 1}}\n"
    for text in (
        f"include: [more.yaml, again.yaml]\n{rest}",
        f"include: more.yaml\n{section}: {{{name}: {body}}}\n{rest}",
    ):
        with pytest.raises(nv.SpecError) as caught:
            nv.compile_text(HEAD + text, folder=tmp_path)
        (found,) = caught.value.diagnostics
        assert found.code == "duplicate-definition"
        assert "more.yaml" in found.message


def test_a_file_that_is_included_twice_is_included_once(tmp_path: Path) -> None:
    """By different ways, or by different names of it."""
    (tmp_path / "more.yaml").write_text(LEG, encoding="utf-8")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "all.yaml").write_text("include: ../more.yaml\n", encoding="utf-8")
    text = "include: [more.yaml, ./more.yaml, sub/../more.yaml, sub/all.yaml]\ninstances: {left: {module: leg}}\n"
    assert network_of(text, tmp_path).neurons.names == ("left.K",)


def test_a_module_sees_the_definitions_and_its_own_parameters_alone() -> None:
    """Neither the parameters, nor the groups, nor the inputs of the spec around it."""
    outside = (
        "parameters: {p: 1}\ninputs: {s: {expression: p}}\nactivations: {two: {value: 2*x}}\nneurons: {A: {input: s}}\n"
    )
    for inside, code in (
        ("{neurons: {K: {bias: p}}}", "unknown-name"),
        ("{neurons: {K: {input: s}}}", "unknown-input"),
        ("{neurons: {K: {bias: 1}}, connections: {A -> K: 1}}", "unknown-neuron"),
    ):
        assert codes(f"{outside}modules: {{m: {inside}}}\ninstances: {{i: {{module: m}}}}") == [code]
    fine = f"{outside}modules: {{m: {{neurons: {{K: {{bias: 3, activation: two}}}}}}}}\ninstances: {{i: {{module: m}}}}"
    assert compiled(fine).run(1)["i.K"].tolist() == [6]


def test_set_gives_parameters_of_the_module_alone() -> None:
    """An unknown one is answered with those that there are."""
    text = "parameters: {p: 2}\nmodules: {m: {parameters: {gain: 1}, neurons: {K: {bias: gain}}}}\n"
    assert compiled(f"{text}instances: {{i: {{module: m, set: {{gain: p}}}}}}").run(1)["i.K"].tolist() == [2]
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(f"{HEAD}{text}instances: {{i: {{module: m, set: {{gian: p}}}}}}")
    (found,) = [item for item in caught.value.diagnostics if item.severity == "error"]
    assert found.hint == "did you mean 'gain'?"


def test_names_across_modules_join_instances_to_the_spec_and_to_each_other() -> None:
    """As sources and as targets, of one instance or of all of a counted one."""
    text = """
modules: {leg: {neurons: {S: {bias: 1}, K: {count: 2}}}}
neurons: {A: {bias: 1}}
instances: {left: {module: leg, count: 2}, tail: {module: leg}}
connections: [{A -> left.S: 1}, {left.K1 -> A: 2}, {left2.S -> tail.K: 3}, {tail.K2 + A -> left1.K1: 4}]
"""
    assert [(a, b, w) for a, b, w, _ in wires(network_of(text))] == [
        ("A", "left1.S", 1), ("A", "left2.S", 1), ("left1.K1", "A", 2), ("left2.K1", "A", 2),
        ("left2.S", "tail.K1", 3), ("left2.S", "tail.K2", 3), ("tail.K2", "left1.K1", 4), ("A", "left1.K1", 4),
    ]  # fmt: skip
