"""Modules, instances and included files: §8 of the contract, sentence by sentence."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_specs import Plain, Spec, section, specs
from small_specs import HEAD, codes, compiled, network_of, wires

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.limits import DEEPEST, MOST_INSTANCES
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.simulation import ParameterError

LEG = """
modules:
  leg:
    parameters: {gain: 1}
    neurons: {S: {input: load}, K: {model: {leaky_integrator: {leak: 0.05}}}}
    inputs: {load: {}}
    connections: {S -> K: gain}
    layout: {positions: {S: [0, 0], K: [0, 1]}}
"""
LEGS = (
    LEG
    + """
instances:
  left: {module: leg, count: 3, set: {gain: 0.8}}
  right: {module: leg, count: 3}
connections:
  left1.K -> right1.S: 0.2
"""
)


def flat_name(name: str) -> str:
    return name.replace(".", "_")


def assert_twins(modular: CompiledNetwork, flat: CompiledNetwork, steps: int = 40) -> None:
    """The same names but for their dots, in the same order, and bit for bit the same run."""
    one, other = modular.run(steps), flat.run(steps)
    assert tuple(map(flat_name, one.neurons)) == other.neurons
    assert [(flat_name(a), flat_name(b), w, d) for a, b, w, d in wires(modular.network)] == wires(flat.network)
    np.testing.assert_array_equal(one.activity, other.activity)
    np.testing.assert_array_equal(one.weights, other.weights)


# The example of the contract


def test_the_example_of_the_contract(tmp_path: Path) -> None:
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "legs.yaml").write_text(f"neurovis: 1\n{LEG}", encoding="utf-8")
    included = compiled("include: [library/legs.yaml]\n" + LEGS.replace(LEG, ""), tmp_path)
    inline = compiled(LEGS)
    sides = [f"{side}{number}" for side in ("left", "right") for number in (1, 2, 3)]
    assert included.network.neurons.names == tuple(f"{path}.{name}" for path in sides for name in ("S", "K"))
    assert wires(included.network) == [
        ("left1.K", "right1.S", 0.2, 1),
        *((f"{path}.S", f"{path}.K", 0.8 if path.startswith("left") else 1.0, 1) for path in sides),
    ]
    assert [entry.name for entry in included.network.inputs] == [f"{path}.load" for path in sides]
    assert included.hash == inline.hash, "where a module is written does not matter"
    assert included.warnings == inline.warnings == ()


def test_instances_run_like_the_network_written_flat() -> None:
    flat = "\n".join(
        [
            "inputs: {" + ", ".join(f"{side}{n}_load: {{}}" for side in ("left", "right") for n in (1, 2, 3)) + "}",
            "neurons:",
            *(
                f"  {path}_S: {{input: {path}_load}}\n  {path}_K: {{model: {{leaky_integrator: {{leak: 0.05}}}}}}"
                for path in ("left1", "left2", "left3", "right1", "right2", "right3")
            ),
            "connections:",
            "  left1_K -> right1_S: 0.2",
            *(f"  left{n}_S -> left{n}_K: 0.8" for n in (1, 2, 3)),
            *(f"  right{n}_S -> right{n}_K: 1" for n in (1, 2, 3)),
        ]
    )
    load = {"left1.load": np.sin(np.arange(60) / 7), "right2.load": np.cos(np.arange(60) / 5)}
    one = compiled(LEGS).run(60, load)
    other = compiled(flat).run(60, {flat_name(name): values for name, values in load.items()})
    np.testing.assert_array_equal(one.activity, other.activity)
    assert np.ptp(one["right1.K"]) > 0.01


# Names and order


def test_the_neurons_of_the_spec_come_first_then_those_of_the_instances() -> None:
    network = network_of(
        """
instances: {b: {module: outer, count: 2}, a: {module: inner}}
modules:
  outer: {instances: {x: {module: inner}}, neurons: {O: {bias: 1}}}
  inner: {neurons: {K: {count: 2, first: 0, bias: 1}}}
neurons: {Z: {bias: 1}, A: {bias: 1}}
"""
    )
    assert network.neurons.names == (
        *("Z", "A"),
        *("b1.O", "b1.x.K0", "b1.x.K1", "b2.O", "b2.x.K0", "b2.x.K1"),
        *("a.K0", "a.K1"),
    )


@pytest.mark.parametrize(
    ("reference", "names"),
    [
        ("left2.K", ["left2.K1", "left2.K2", "left2.K3"]),
        ("left2.K3", ["left2.K3"]),
        ("left.K3", ["left1.K3", "left2.K3"]),
        ("left.K", [f"left{n}.K{k}" for n in (1, 2) for k in (1, 2, 3)]),
        ("left1.K2..K3", ["left1.K2", "left1.K3"]),
        ("left1.K2..left1.K3", ["left1.K2", "left1.K3"]),
        ("left.K2..K3", [f"left{n}.K{k}" for n in (1, 2) for k in (2, 3)]),
        ("[left2.K1, left1.K1 + K]", ["left2.K1", "left1.K1", "K"]),
        ("side.leg2.K1", ["side.leg2.K1"]),
        ("side.leg.K1", ["side.leg1.K1", "side.leg2.K1"]),
    ],
)
def test_references_across_modules(reference: str, names: list[str]) -> None:
    network = network_of(
        f"""
modules:
  leg: {{neurons: {{K: {{count: 3, bias: 1}}}}}}
  side: {{instances: {{leg: {{module: leg, count: 2}}}}}}
neurons: {{K: {{bias: 1}}}}
instances: {{left: {{module: leg, count: 2}}, side: {{module: side}}}}
outputs: {{out: {reference}}}
"""
    )
    assert [network.neurons.names[index] for index in network.outputs[0].neurons] == names


def test_a_module_connects_what_is_within_it_alone() -> None:
    network = network_of(
        """
modules:
  leg: {neurons: {S: {bias: 1}, K: {}}, connections: {S -> K: 1}}
  side: {neurons: {K: {}}, instances: {leg: {module: leg, count: 2}}, connections: {leg.K -> K: 2, leg1.K -> leg2.S: 3}}
instances: {left: {module: side}, S: {module: side}}
"""
    )
    for path in ("left", "S"):
        mine = [(a, b, w) for a, b, w, _ in wires(network) if a.startswith(f"{path}.")]
        assert sorted(mine) == sorted(
            [
                (f"{path}.leg1.S", f"{path}.leg1.K", 1),
                (f"{path}.leg2.S", f"{path}.leg2.K", 1),
                (f"{path}.leg1.K", f"{path}.K", 2),
                (f"{path}.leg2.K", f"{path}.K", 2),
                (f"{path}.leg1.K", f"{path}.leg2.S", 3),
            ]
        )
    assert len(network.connections) == 10


def test_draws_go_by_the_path_of_the_instance() -> None:
    network = network_of(
        """
seed: 5
modules:
  leg:
    neurons: {S: {count: 4, bias: "normal(0, 1)", initial: "uniform(0, 1)", noise: "normal(0, 1)"}, K: {}}
    connections:
      - {S -> K: "normal(1, 2)"}
      - {S -> K: "uniform(0, 1)"}
instances: {left: {module: leg, count: 2}}
"""
    )
    i = np.arange(4)
    for number in (1, 2):
        group = network.neurons.groups[2 * number - 2]
        assert group.name == f"left{number}.S"
        bias = Stream(5, "bias", f"left{number}.S").drawn("normal", 0.0, 1.0, (i, 0, 0, 0))
        initial = Stream(5, "initial", f"left{number}.S").drawn("uniform", 0.0, 1.0, (i, 0, 0, 0))
        mine = slice(group.start, group.start + 4)
        assert network.neurons.bias[mine].tolist() == bias.tolist()
        assert network.neurons.initial[mine].tolist() == initial.tolist()
        begin = 8 * (number - 1)
        first = Stream(5, "weight", f"left{number}/S -> K").drawn("normal", 1.0, 2.0, (i, 0, 0, 0))
        second = Stream(5, "weight", f"left{number}/S -> K (2)").drawn("uniform", 0.0, 1.0, (i, 0, 0, 0))
        assert network.connections.weights[begin : begin + 8].tolist() == [*first.tolist(), *second.tolist()]
    assert [noise.name for noise in network.noises] == ["left1.S", "left2.S"]


def test_entries_within_and_around_an_instance_draw_independently() -> None:
    draw = "{weight: 'normal(0, 1)', pattern: all_to_all}"
    network = network_of(
        f"""
seed: 3
modules:
  knee: {{neurons: {{K: {{count: 9}}, O: {{count: 9}}}}, connections: {{K -> O: {draw}}}}}
  leg: {{neurons: {{O: {{count: 9}}}}, instances: {{knee: {{module: knee}}}}, connections: {{knee.K -> O: {draw}}}}}
neurons: {{O: {{count: 9}}}}
instances: {{left: {{module: leg, count: 1}}}}
connections: {{left1.knee.K -> O: {draw}}}
"""
    )
    assert network.connections.entries == ("left1.knee.K -> O",) * 3
    assert len(network.connections) == 3 * 81
    assert len(set(network.connections.weights.tolist())) == 3 * 81


# Parameters


def test_set_may_use_i_and_n_and_parameters_outside_and_what_depends_follows() -> None:
    network = compiled(
        """
parameters: {strength: 0.5}
modules:
  leg:
    parameters: {gain: 1, slow: gain/10, other: 7}
    neurons: {S: {bias: slow}, K: {bias: other}}
    connections: {S -> K: gain}
instances:
  left: {module: leg, count: 3, set: {gain: strength + i/n}}
  right: {module: leg, set: {gain: 2 + i + n}}
  tail: {module: leg}
"""
    ).network
    gains = [0.5, 0.5 + 1 / 3, 0.5 + 2 / 3, 3, 1]
    assert network.connections.weights.tolist() == gains
    assert network.neurons.bias[0::2].tolist() == [gain / 10 for gain in gains]
    assert set(network.neurons.bias[1::2]) == {7}
    assert dict(network.parameters) == {"strength": 0.5}


def test_set_hands_parameters_down() -> None:
    text = """
parameters: {speed: 0.25}
modules:
  toe: {parameters: {p: 1}, neurons: {K: {bias: p}}}
  leg: {parameters: {p: 2}, instances: {toe: {module: toe, count: 2, set: {p: p*10 + i}}}}
instances: {left: {module: leg, set: {p: speed}}, right: {module: leg}}
"""
    network = compiled(text)
    assert network.network.neurons.bias.tolist() == [2.5, 3.5, 20, 21]
    assert nv.compile_text(HEAD + text, speed=1).network.neurons.bias.tolist() == [10, 11, 20, 21]
    simulation = network.simulator()
    simulation.step()
    simulation.set(speed=0.5)
    simulation.step()
    assert simulation.activity.tolist() == [5, 6, 20, 21]


def test_an_event_reaches_into_instances() -> None:
    run = compiled(
        """
parameters: {strength: 1}
modules:
  toe: {parameters: {p: 1}, neurons: {K: {bias: 1}, L: {}}, connections: {K -> L: {weight: p, delay: 0}}}
  leg: {parameters: {p: 1}, instances: {toe: {module: toe, count: 2, set: {p: p + i}}}}
instances: {left: {module: leg, set: {p: 2*strength}}, right: {module: leg}}
events:
  - {at: 2, set: {strength: 10}}
  - {from: 3, to: 4, clamp: {left.toe2.K: 0.5, right.toe.L: -1}}
  - {at: 5, lesion: [left.toe1.K, right.toe.K -> right.toe.L]}
"""
    ).run(6)
    assert run["left.toe1.L"].tolist() == [2, 2, 20, 20, 20, 0]
    assert run["left.toe2.L"].tolist() == [3, 3, 21, 10.5, 21, 21]
    assert run["right.toe1.L"].tolist() == [1, 1, 1, -1, 1, 0]
    assert run["right.toe2.L"].tolist() == [2, 2, 2, -1, 2, 0]


def test_what_is_structural_in_an_instance_cannot_be_set() -> None:
    text = """
parameters: {toes: 2, gain: 1}
modules:
  leg: {parameters: {toes: 1, gain: 1}, neurons: {K: {count: toes, bias: gain}}}
  side: {parameters: {toes: 1, gain: 1}, instances: {leg: {module: leg, set: {toes: 2*toes, gain: gain}}}}
instances: {left: {module: side, set: {toes: toes, gain: gain}}}
"""
    network = compiled(text)
    assert network.network.structural == {"toes"}
    assert len(network.network.neurons) == 4
    with pytest.raises(ParameterError, match="'toes' cannot be set in a run"):
        network.simulator().set(toes=3)
    assert codes(f"{text}events: [{{at: 3, set: {{toes: 3}}}}]") == ["structural-parameter"]


# Inputs


def test_an_input_of_count_times_size_is_shared_out_and_one_of_the_modules_size_goes_to_each() -> None:
    simulation = compiled(
        """
inputs: {torque: {size: 6}, wind: {size: 2}, one: {}}
modules:
  leg: {inputs: {load: {size: 2}, push: {size: 2}}, neurons: {S: {count: 2, input: load}, P: {count: 2, input: push}}}
  tail: {inputs: {load: {}}, neurons: {S: {count: 3, input: load}}}
instances:
  left: {module: leg, count: 3, inputs: {load: torque, push: wind}}
  tail: {module: tail, count: 2, inputs: {load: one}}
"""
    ).simulator()
    simulation.step(torque=[1, 2, 3, 4, 5, 6], wind=[8, 9], one=7)
    assert simulation.activity.tolist() == [1, 2, 8, 9, 3, 4, 8, 9, 5, 6, 8, 9, 7, 7, 7, 7, 7, 7]


def test_inputs_are_handed_down() -> None:
    network = compiled(
        """
inputs: {angles: {size: 4}}
modules:
  joint: {inputs: {angle: {}}, neurons: {S: {input: angle}}}
  leg: {inputs: {angles: {size: 2}}, instances: {joint: {module: joint, count: 2, inputs: {angle: angles}}}}
instances: {left: {module: leg, count: 2, inputs: {angles: angles}}, tail: {module: leg}}
"""
    )
    assert [(entry.name, entry.size) for entry in network.network.inputs] == [("angles", 4), ("tail.angles", 2)]
    simulation = network.simulator()
    simulation.step({"angles": [1, 2, 3, 4], "tail.angles": [5, 6]})
    assert simulation.activity.tolist() == [1, 2, 3, 4, 5, 6]


def test_inputs_that_are_not_named_come_from_outside(tmp_path: Path) -> None:
    network = compiled(LEGS)
    simulation = network.simulator()
    simulation.step({"left1.load": 0.3})
    assert simulation.activity[0] == 0.3
    assert not simulation.activity[1:].any()
    (tmp_path / "spec.yaml").write_text(HEAD + LEGS, encoding="utf-8")
    (tmp_path / "load.csv").write_text("1\n2\n", encoding="utf-8")
    spec, load, out = (str(tmp_path / name) for name in ("spec.yaml", "load.csv", "out.npz"))
    done = CliRunner().invoke(neurovis, ["run", spec, "--steps", "2", "--input", f"right3.load={load}", "-o", out])
    assert done.exit_code == 0, done.output
    assert nv.load(out)["right3.S"].tolist() == [1, 2]


def test_a_modules_input_with_a_source_of_its_own_sees_its_own_parameters() -> None:
    run = compiled(
        """
modules:
  leg: {parameters: {phi: 1}, inputs: {wave: {expression: phi*k}, pulse: {values: [[1], [0]]}}, neurons:
    {S: {input: wave}, P: {input: pulse}}}
instances: {left: {module: leg, count: 2, set: {phi: 1 + i}}, right: {module: leg}}
"""
    ).run(3, {"right.wave": np.array([9.0, 9, 9])})
    assert run["left1.S"].tolist() == [0, 1, 2]
    assert run["left2.S"].tolist() == [0, 2, 4]
    assert run["right.S"].tolist() == [9, 9, 9]
    assert run["left2.P"].tolist() == [1, 0, 0]


# Learning


def test_each_instance_learns_for_itself() -> None:
    module = """
modules:
  unit:
    parameters: {rate: 0.1}
    inputs: {wanted: {}}
    neurons: {S: {bias: 1}, O: {}}
    connections: {S -> O: {weight: 0, delay: 0, plasticity: {delta: {rate: rate, target: wanted}}}}
"""
    one = compiled(module + "instances: {u: {module: unit, count: 2, set: {rate: 0.1*(i + 1)}}}")
    run = one.run(30, {"u1.wanted": np.ones(30), "u2.wanted": np.full(30, -2.0)})
    for number, rate, wanted in ((1, 0.1, 1.0), (2, 0.2, -2.0)):
        learned = run.weight(f"u{number}.S -> u{number}.O")
        np.testing.assert_allclose(learned, wanted * (1 - (1 - rate) ** np.arange(30)), atol=1e-12)


# Included files


def included(folder: Path, **files: str) -> None:
    """Files by their names, a double underscore for a slash."""
    for name, text in files.items():
        path = folder / f"{name.replace('__', '/')}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def test_definitions_of_included_files_are_those_of_all(tmp_path: Path) -> None:
    included(
        tmp_path,
        library__cube="title: Powers\nauthors: [A]\nactivations: {cube: {value: x^3}}\n",
        library__legs="include: cube.yaml\nmodules: {leg: {neurons: {K: {bias: 2, activation: cube}}}}\n",
    )
    network = compiled(
        "include: [library/legs.yaml, ./library/cube.yaml]\n"
        "neurons: {A: {bias: 3, activation: cube}}\ninstances: {left: {module: leg}}",
        tmp_path,
    )
    assert network.run(1).activity.tolist() == [[27, 8]]
    assert network.warnings == ()


def test_paths_are_relative_to_the_file_that_names_them(tmp_path: Path) -> None:
    module = "{neurons: {A: {bias: 1}, B: {count: 2}}, connections: {A -> B: {matrix: {file: data/w.csv}}}}"
    included(tmp_path, library__deep__one=f"modules: {{one: {module}}}\n", library__two="include: deep/one.yaml")
    for folder, row in (("library/deep/data", "1,2\n"), ("data", "3,4\n")):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "w.csv").write_text(row, encoding="utf-8")
    text = (
        f"include: library/two.yaml\nmodules: {{own: {module}}}\ninstances: {{a: {{module: one}}, b: {{module: own}}}}"
    )
    assert network_of(text, tmp_path).connections.weights.tolist() == [1, 2, 3, 4]


def test_a_mistake_within_an_included_file_hides_none_elsewhere(tmp_path: Path) -> None:
    included(tmp_path, library="modules: {m: {neurons: {Ü: {bias: 1}}}}\n")
    text = "include: library.yaml\nneurons: {A: {activation: tahn, model: leeky}}\ninstances: {q: {module: m}}"
    assert sorted(codes(text, tmp_path)) == ["bad-name", "unknown-activation", "unknown-model"]


def test_nothing_outside_the_root_is_read(tmp_path: Path) -> None:
    included(tmp_path, library="modules: {leg: {neurons: {K: {bias: 1}}}}\n", specs__near="include: ../library.yaml\n")
    text = "include: near.yaml\ninstances: {left: {module: leg}}"
    assert codes(text, tmp_path / "specs") == ["path-outside"]
    network = nv.compile_text(HEAD + text, folder=tmp_path / "specs", root=tmp_path)
    assert network.network.neurons.names == ("left.K",)
    (tmp_path / "specs" / "link.yaml").symlink_to(tmp_path / "library.yaml")
    assert codes(text.replace("near", "link"), tmp_path / "specs") == ["path-outside"]


def test_a_finding_points_into_the_included_file(tmp_path: Path) -> None:
    included(tmp_path, library__legs="modules:\n  leg: {neurons: {K: {bias: gian}}}\n")
    (tmp_path / "spec.yaml").write_text(
        f"{HEAD}include: library/legs.yaml\ninstances: {{left: {{module: leg, count: 6}}}}\n", encoding="utf-8"
    )
    with pytest.raises(nv.SpecError) as caught:
        nv.compile(tmp_path / "spec.yaml")
    (found,) = caught.value.diagnostics
    assert (found.span.file, found.span.line, found.span.column) == (str(tmp_path / "library" / "legs.yaml"), 2, 29)
    assert found.span.file in caught.value.sources


def test_the_hash_knows_what_a_network_is_and_not_where_it_is_written(tmp_path: Path) -> None:
    module = "leg: {parameters: {gain: 1}, neurons: {K: {bias: gain, activation: bent}}"
    bent = "activations: {bent: {value: x^3}}\n"
    instances = "instances: {left: {module: leg, set: {gain: 2}}}\n"
    included(tmp_path, legs=f"modules: {{{module}, title: A leg}}}}\n{bent}")
    away = compiled(f"include: legs.yaml\n{instances}", tmp_path).hash
    assert compiled(f"modules: {{{module}}}}}\n{bent}{instances}").hash == away
    assert compiled(f"modules: {{{module}, layout: {{positions: {{K: [0, 1]}}}}}}}}\n{bent}{instances}").hash == away
    assert compiled(f"modules: {{{module}}}}}\n{bent}{instances.replace('2', '3')}").hash != away
    assert compiled(f"modules: {{{module}}}}}\n{bent.replace('3', '2')}{instances}").hash != away


# Pins


def test_pins_of_a_module_are_relative_to_the_origin_and_those_of_the_spec_win() -> None:
    network = network_of(
        LEG
        + """
instances: {left: {module: leg, count: 3}}
layout: {positions: {left1: [10, 20], left2.K: [2, 3]}}
"""
    )
    names = network.neurons.names
    assert {names[index]: place for index, place in network.layout.positions.items()} == {
        "left1.S": (10, 20),
        "left1.K": (10, 21),
        "left2.K": (2, 3),
    }
    assert dict(network.layout.origins) == {"left1": (10, 20)}
    relative = {path: {names[index]: place for index, place in pins.items()} for path, pins in network.layout.relative}
    assert relative["left2"] == {"left2.S": (0, 0)}
    assert relative["left3"] == {"left3.S": (0, 0), "left3.K": (0, 1)}


# What is shown


def test_inspect_names_the_module() -> None:
    shown = compiled(LEGS + "\nneurons: {A: {bias: 1}}\n").describe()
    neurons = shown["neurons"]
    assert isinstance(neurons, list)
    assert [(entry["name"], entry["group"], entry["module"]) for entry in neurons[:3]] == [
        ("A", "A", None),
        ("left1.S", "left1.S", "leg"),
        ("left1.K", "left1.K", "leg"),
    ]


def test_a_file_to_be_included_is_no_spec(tmp_path: Path) -> None:
    for text in (f"neurovis: 1\n{LEG}", "neurovis: 1\nrules: {r: {weight: {each_step: weight + pre}}}\n"):
        with pytest.raises(nv.SpecError) as caught:
            nv.compile_text(text)
        (found,) = caught.value.diagnostics
        assert (found.code, found.message) == ("missing-key", "the key 'name' is missing")
        assert "include: [FILE]" in (found.hint or "")
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(f"neurovis: 1\n{LEGS}")
    assert caught.value.diagnostics[0].hint == "add name: the name of the network, an identifier"


# Limits


def nested(depth: int, count: int = 1) -> str:
    """Modules within modules, ``depth`` of them around a neuron, ``count`` of each."""
    chain = "".join(f"  m{i}: {{instances: {{x: {{module: m{i + 1}, count: {count}}}}}}}\n" for i in range(depth))
    return f"modules:\n{chain}  m{depth}: {{neurons: {{K: {{bias: 1}}}}}}\n"


def test_nesting_goes_as_deep_as_it_may() -> None:
    network = network_of(nested(DEEPEST - 1) + "instances: {x: {module: m0}}")
    assert network.neurons.names == (f"x.{'x1.' * (DEEPEST - 1)}K",)
    assert codes(nested(DEEPEST) + "instances: {x: {module: m0}}") == ["too-deep"]
    assert codes(nested(3000) + "instances: {x: {module: m0}}") == ["too-deep"]


@pytest.mark.parametrize(
    "text",
    [
        nested(60, 2) + "instances: {x: {module: m0}}",
        nested(60, 2) + "neurons: {A: {bias: 1}}",
        nested(1, 400) + "instances: {x: {module: m0, count: 300}}",
        nested(5, 50) + "instances: {x: {module: m0, count: 50}}",
        nested(0) + f"instances: {{x: {{module: m0, count: {MOST_INSTANCES + 1}}}}}",
        nested(0) + "parameters: {p: 1e15}\ninstances: {x: {module: m0, count: p}}",
        "modules:\n  b: {neurons: {K: {bias: 1}}}\n"
        "  a: {parameters: {p: 1}, instances: {x: {module: b, count: 1 + p}}}\n"
        "instances: {y: {module: a, count: 1000, set: {p: i}}}",
    ],
)
def test_too_many_instances_are_refused_before_they_are_made(text: str) -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(HEAD + text)
    (found,) = caught.value.diagnostics
    assert found.code == "too-many"
    assert found.message == "this makes more than 100,000 instances, the most that there may be"


def test_the_limit_of_neurons_counts_those_of_all_instances() -> None:
    text = "modules: {leg: {neurons: {K: {count: 400000, bias: 1}}}}\ninstances: {left: {module: leg, count: 3}}"
    assert codes(text) == ["too-many"]


def test_three_hundred_instances() -> None:
    network = compiled(
        f"{LEG}\nneurons: {{O: {{}}}}\n"
        "instances: {left: {module: leg, count: 300, set: {gain: i/n}}}\nconnections: {left.K -> O: 1}"
    )
    assert len(network.network.neurons) == 601
    assert len(network.network.instances) == 300
    assert network.network.connections.weights[-1] == 299 / 300
    assert network.run(3).activity.shape == (3, 601)


def test_modules_that_nobody_uses_are_looked_at_together_no_further_than_a_network() -> None:
    modules = "".join(f"  m{i}: {{neurons: {{K: {{count: 400000, bias: 1}}}}}}\n" for i in range(40))
    network = compiled(f"modules:\n{modules}neurons: {{A: {{bias: 1}}}}")
    assert [item.code for item in network.warnings] == ["unused-module"] * 40


# The law: a network of modules is the network that one would write without them


def without_draws(spec: Spec) -> Spec:
    """Draws go by names, which differ in the flat twin."""
    return json.loads(json.dumps(spec).replace("uniform(-0.3, 0.3)", "0.05*i - 0.03*j"))  # type: ignore[no-any-return]


def renamed(connections: dict[str, Plain], path: str) -> list[Plain]:
    """The connections of a module as those of the instance at ``path``, an entry each."""

    def called(key: str) -> str:
        source, target = key.split(" -> ")
        return f"{path}{source} -> {path}{target}"

    entries: list[Plain] = []
    for key, body in connections.items():
        assert isinstance(body, dict)
        own = copy.deepcopy(body)
        if isinstance(own.get("weight"), dict):  # that of another entry
            ((way, name),) = own["weight"].items()  # type: ignore[union-attr]
            own["weight"] = {way: called(str(name))}
        entries.append({called(key): own})
    return entries


LAW = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@LAW
@given(specs(), st.floats(-0.2, 0.2), st.integers(1, 3))
def test_a_modular_spec_is_its_flat_twin(drawn: Spec, top: float, count: int) -> None:
    spec = without_draws(drawn)
    neurons, connections = section(spec, "neurons"), section(spec, "connections")
    names = list(neurons)
    between: Plain = {"weight": 0.1, "pattern": "all_to_all", "delay": 2}

    def groups(path: str, shift: str) -> dict[str, Plain]:
        made: dict[str, Plain] = {}
        for name, group in neurons.items():
            assert isinstance(group, dict)
            made[f"{path}{name}"] = {**copy.deepcopy(group), "bias": f"{group['bias']!r} + {shift}"}
        return made

    modular: Plain = {
        **{key: spec[key] for key in ("neurovis", "name", "seed")},
        "parameters": {"top": top},
        "modules": {
            "inner": {
                "parameters": {"shift": 0},
                "inputs": {"wave": {"expression": "0.3*sin(k/3)"}},
                "neurons": groups("", "shift"),
                "connections": connections,
            },
            "outer": {
                "parameters": {"shift": 0.5},
                "instances": {"x": {"module": "inner", "count": count, "set": {"shift": "shift + i/n"}}},
                "connections": {f"x1.{names[0]} -> x{count}.{names[-1]}": between},
            },
        },
        "instances": {"b": {"module": "inner"}, "a": {"module": "outer", "count": 2, "set": {"shift": "top*(i + 1)"}}},
        "connections": [{f"b.{names[0]} -> a2.x1.{names[-1]}": between}],
        "outputs": {"out": f"a.x.{names[0]}"},
    }
    flat_neurons = groups("b_", "0.0")
    flat_connections: list[Plain] = [{f"b_{names[0]} -> a2_x1_{names[-1]}": between}, *renamed(connections, "b_")]
    for number in range(2):
        path = f"a{number + 1}_x"
        flat_connections.append({f"{path}1_{names[0]} -> {path}{count}_{names[-1]}": between})
        for inner in range(count):
            flat_neurons |= groups(f"{path}{inner + 1}_", repr(top * (number + 1) + inner / count))
            flat_connections += renamed(connections, f"{path}{inner + 1}_")
    flat: Plain = {
        **{key: spec[key] for key in ("neurovis", "name", "seed", "inputs")},
        "neurons": flat_neurons,
        "connections": flat_connections,
    }
    assert isinstance(modular, dict)
    assert isinstance(flat, dict)
    assert_twins(nv.compile(modular), nv.compile(flat))


def test_recordings_know_the_paths(tmp_path: Path) -> None:
    network = compiled(LEGS)
    recording = network.run(4, {"left1.load": np.ones(4)})
    recording.save(tmp_path / "x.npz")
    again: Recording = nv.load(tmp_path / "x.npz")
    assert again.neurons == network.network.neurons.names
    assert again["left1.S"].tolist() == [1, 1, 1, 1]
    assert again.weight("left1.S -> left1.K").tolist() == [0.8] * 4
