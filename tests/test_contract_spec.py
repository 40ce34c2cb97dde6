"""A whole spec (§1): the example as printed, its defaults, and the inputs that are described beside it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from small_specs import codes, compiled, network_of, wires

import neurovis_spec as nv

EXAMPLE = """\
neurovis: 1                        # language version, required
name: cpg_rbf                      # required, an identifier
title: Function approximation      # optional metadata: texts, lists of texts
time: {dt: 0.025, steps: 12000}    # dt: seconds a step (default 1); steps: default run length (default 1000)
seed: 7                            # the only source of randomness

parameters:                        # named constants, in order; an expression may use earlier ones
  alpha: 1.01
  phi: 0.049                       # radians a step
  period: 128.67                   # of the settled orbit, in steps; not 2 pi / phi
  eta: {value: 0.01, min: 0, max: 1, description: learning rate}
  second: {value: 0.2, description: amplitude of the second harmonic}

inputs:                            # signals that come from outside the network; k: the step, t: seconds
  target: {expression: 0.5*sin(2*pi*k/period) + second*sin(4*pi*k/period)}

neurons:
  C: {count: 2, activation: tanh, initial: [0.1, 0], box: rhythm}
  K: {count: 8, combine: distance, activation: {gaussian: {sigma: 40}}, box: kernels}
  O: {}
  T: {input: target}

connections:
  C -> C:
    matrix:                        # rows are sources
      - [alpha*cos(phi), -alpha*sin(phi)]
      - [alpha*sin(phi),  alpha*cos(phi)]
  C -> K: {centre: {file: data/centres.csv}, delay: 0}
  K -> O: {weight: 0, delay: 0, plasticity: {delta: {rate: eta, target: T}}}

outputs: {signal: O}               # names for what leaves the network
layout: {engine: layered, direction: down}
render: {theme: default}           # without gains: such that this network's range shows
ros: {namespace: /neurovis, rate: 40}
"""
CENTRES = (Path(__file__).parents[1] / "specs" / "data" / "centres.csv").read_text(encoding="utf-8")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The example as it is printed, with its data beside it."""
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "centres.csv").write_text(CENTRES, encoding="utf-8")
    (tmp_path / "cpg_rbf.yaml").write_text(EXAMPLE, encoding="utf-8")
    return tmp_path


def test_the_example_is_the_network_of_the_paper(folder: Path) -> None:
    """Without a finding: 12 neurons, 28 connections, all settings as written."""
    network = nv.compile(folder / "cpg_rbf.yaml")
    assert network.warnings == ()
    assert network.name == "cpg_rbf"
    assert network.network.title == "Function approximation"
    assert (network.network.dt, network.network.steps, network.network.seed) == (0.025, 12000, 7)
    assert network.parameters == {"alpha": 1.01, "phi": 0.049, "period": 128.67, "eta": 0.01, "second": 0.2}
    assert network.network.neurons.names == ("C1", "C2", *(f"K{i}" for i in range(1, 9)), "O", "T")
    made = wires(network.network)
    a, b = 1.01 * math.cos(0.049), 1.01 * math.sin(0.049)
    expected = [("C1", "C1", a), ("C1", "C2", -b), ("C2", "C1", b), ("C2", "C2", a)]
    assert [wire[:2] for wire in made[:4]] == [wire[:2] for wire in expected]
    assert [wire[2] for wire in made[:4]] == pytest.approx([wire[2] for wire in expected], abs=1e-15)
    assert len(made) == 28
    assert {wire[3] for wire in made[4:]} == {0}
    assert [(entry.name, entry.neurons.tolist()) for entry in network.network.outputs] == [("signal", [10])]
    assert (network.network.layout.engine, network.network.layout.direction) == ("layered", "down")
    assert network.network.render.theme == "default"


def test_the_example_runs_and_learns_its_target(folder: Path) -> None:
    """The target is the input's formula at step k; the error of the last period is below a hundredth."""
    run = nv.compile(folder / "cpg_rbf.yaml").run()
    k = np.arange(12000)
    target = 0.5 * np.sin(2 * np.pi * k / 128.67) + 0.2 * np.sin(4 * np.pi * k / 128.67)
    np.testing.assert_allclose(run["T"], target, atol=1e-12)
    np.testing.assert_array_equal(run["signal"], run["O"])
    assert np.sqrt(np.mean((run["T"] - run["O"])[-129:] ** 2)) < 0.01


def test_version_and_name_are_required() -> None:
    """Each is missed by its name."""
    for text, key in (("name: x\nneurons: {A: {}}\n", "neurovis"), ("neurovis: 1\nneurons: {A: {}}\n", "name")):
        with pytest.raises(nv.SpecError) as caught:
            nv.compile_text(text)
        (found,) = caught.value.diagnostics
        assert (found.code, found.message) == ("missing-key", f"the key '{key}' is missing")
    for name in ("1st", "a b", "a-b", "''", "é", "n" * 65, "3"):
        with pytest.raises(nv.SpecError):
            nv.compile_text(f"neurovis: 1\nname: {name}\nneurons: {{A: {{}}}}\n")


@pytest.mark.parametrize("key", ["title", "description", "authors", "license", "references"])
def test_metadata_are_texts_or_lists_of_texts(key: str) -> None:
    """They are optional; a number is neither."""
    for value in ("one", "[one, two]", "|\n  one\n  two\n"):
        assert compiled(f"{key}: {value}\nneurons: {{A: {{}}}}").warnings == ()
    assert codes(f"{key}: 3\nneurons: {{A: {{}}}}") == ["wrong-type"]
    assert codes(f"{key}: [one, 2]\nneurons: {{A: {{}}}}") == ["wrong-type"]


def test_a_step_is_a_second_and_a_run_a_thousand_steps_by_default() -> None:
    """And the seed is 0."""
    network = compiled("neurons: {A: {bias: 'normal(0, 1)'}}")
    assert (network.network.dt, network.network.steps, network.network.seed) == (1, 1000, 0)
    assert len(network.run()) == 1000
    assert network.hash == compiled("seed: 0\ntime: {dt: 1}\nneurons: {A: {bias: 'normal(0, 1)'}}").hash


def test_the_seed_is_the_only_source_of_randomness() -> None:
    """The same spec gives the same network and the same run again, whatever was drawn before."""
    text = (
        "neurons: {A: {count: 5, bias: 'normal(0, 1)', noise: 'uniform(-1, 1)', initial: 'normal(0, 2)'}}\n"
        "connections: {A -> A: {weight: 'normal(0, 1)', pattern: {random: {probability: 0.5}}}}"
    )
    first = compiled(text)
    np.random.default_rng(1).normal(size=9)
    again, other = compiled(text), compiled(f"seed: 1\n{text}")
    assert wires(first.network) == wires(again.network) != wires(other.network)
    np.testing.assert_array_equal(first.run(20).activity, again.run(20).activity)
    assert (first.run(20).activity != other.run(20).activity).any()


def test_k_is_the_step_and_t_are_seconds() -> None:
    """In the expression of an input; with the default dt both are the same."""
    text = "inputs: {k: {expression: k}, t: {expression: t}}\nneurons: {K: {input: k}, T: {input: t}}"
    run = compiled(f"time: {{dt: 0.5}}\n{text}").run(4)
    assert (run["K"].tolist(), run["T"].tolist()) == ([0, 1, 2, 3], [0, 0.5, 1, 1.5])
    run = compiled(text).run(4)
    assert run["K"].tolist() == run["T"].tolist() == [0, 1, 2, 3]


def test_inputs_come_from_a_file_a_list_or_the_caller(tmp_path: Path) -> None:
    """Past its end the last row stays, of a list as of a file; what nobody supplies is 0."""
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "sensed.csv").write_text("1,2\n3,4\n", encoding="utf-8")
    text = (
        "inputs: {sensed: {file: data/sensed.csv}, pulse: {values: [[0], [1], [0]]}, torque: {size: 18}}\n"
        "neurons: {S: {count: 2, input: sensed}, P: {input: pulse}, Q: {count: 18, input: torque}}"
    )
    network = compiled(text, tmp_path)
    run = network.run(5)
    assert run["S"].tolist() == [[1, 2], [3, 4], [3, 4], [3, 4], [3, 4]]
    assert run["P"].tolist() == [0, 1, 0, 0, 0]
    assert not run["Q"].any()
    given = network.run(3, {"torque": np.arange(54.0).reshape(3, 18)})
    assert given["Q"].ravel().tolist() == list(range(54))


def test_what_a_caller_supplies_replaces_the_source_in_step_for_that_step_only() -> None:
    """An input with a source goes back to it."""
    text = "inputs: {s: {expression: 10 + k}, u: {}}\nneurons: {A: {input: s}, B: {input: u}}\noutputs: {a: A, b: B}"
    simulation = compiled(text).simulator()
    found = [simulation.step(**values) for values in ({}, {"s": -1.0, "u": 5.0}, {}, {"u": 2.0}, {})]
    assert [(float(out["a"]), float(out["b"])) for out in found] == [(10, 0), (-1, 5), (12, 0), (13, 2), (14, 0)]


def test_groups_inputs_and_instances_share_one_namespace() -> None:
    """Parameters, outputs, boxes and definitions have names of their own."""
    module = "modules: {m: {neurons: {K: {bias: 1}}}}\n"
    assert codes("inputs: {A: {}}\nneurons: {A: {}}") == ["duplicate-name"]
    assert codes(module + "neurons: {A: {bias: 1}}\ninstances: {A: {module: m}}") == ["duplicate-name"]
    assert codes(module + "inputs: {A: {}}\ninstances: {A: {module: m}, B: {module: m}}") == ["duplicate-name"]
    text = (
        "parameters: {A: 2}\nmodules: {A: {inputs: {K: {}}, neurons: {L: {input: K}, A: {bias: 1}}}}\n"
        "activations: {A: {value: x}}\nneurons: {A: {bias: A, box: A, activation: A}}\n"
        "instances: {B: {module: A}}\noutputs: {A: A}\nlayout: {boxes: {B: A}}"
    )
    assert network_of(text).neurons.names == ("A", "B.L", "B.A")


def test_hashes_outlive_a_version() -> None:
    """What was recorded with an earlier one belongs to the same network."""
    network = nv.compile_text(
        """neurovis: 1
name: pinned
activations:
  wave: {parameters: {b: 2}, value: x*b/3 - sin(x) + 1 if x > 0 and b > 0 else -x^2}
neurons: {A: {count: 2, activation: wave, noise: "normal(0, 1) + k % 3 - 1"}}
connections: {A -> A: {pattern: ring}}
"""
    )
    assert network.describe()["hash"] == "398d1075b5f645ddf9131ae6846853e790f98f7df32fe701a2c40591358cb848"
