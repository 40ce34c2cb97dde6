"""What ``neurovis ros export`` writes: whole, escaped for its place, and only over files of its own."""

from __future__ import annotations

import ast
import json
import runpy
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml
from click.testing import CliRunner

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.cli.ros_options import arguments_of_ros
from neurovis_spec.ros.export import YOURS, Form, save, texts
from neurovis_spec.ros.middleware import Ros
from neurovis_spec.ros.templates import number, plain_line, xml
from neurovis_spec.runtime.c_settable import ExportError

SPEC = r"""
neurovis: 1
name: Arm_2
title: "An \"arm\" <b>'x'</b> & {{ 7*7 }} {% raw %} -- */ \\ \n $(arg x) é"
time: {dt: 0.01, steps: 100}
parameters:
  gain: {value: 1e-5, min: 0, max: 2, description: "How: \"strongly\"\nit # follows"}
  on: 2
  count: 2
inputs: {target: {}, torque: {size: 2}}
neurons:
  A: {input: target, activation: identity, bias: on}
  M: {count: count, input: torque, activation: identity}
  B: {activation: identity}
connections: {A -> B: {weight: gain, plasticity: {oja: {rate: 0.1}}}}
outputs: {signal: B, motors: M}
ros:
  namespace: robot/left
  subscribe:
    target: {topic: /target, timeout: 0.4}
    torque: {topic: joints, type: sensor_msgs/JointState, field: effort, names: ['h"\ip', "${knee}"]}
  publish:
    signal: {topic: /cmd_vel, type: geometry_msgs/Twist, field: linear.x, safe: -1}
    motors: {topic: ~/motors}
"""
FORMS: list[tuple[Form, Ros]] = [("package", 1), ("package", 2), ("cpp", 1), ("publisher", 2)]


@pytest.fixture(scope="module")
def compiled() -> nv.CompiledNetwork:
    return nv.compile_text(SPEC)


@pytest.mark.parametrize(("form", "ros"), FORMS)
def test_every_file_can_be_read_as_what_it_is(compiled: nv.CompiledNetwork, form: Form, ros: Ros) -> None:
    made = texts(compiled, form, ros)
    for name, text in made.items():
        assert "\r" not in text
        if name.endswith((".xml", ".launch")):
            ElementTree.fromstring(text)
        elif name.endswith(".py") or text.startswith("#!/usr/bin/env python3"):
            ast.parse(text)
        elif name.endswith(".yaml"):
            yaml.safe_load(text)


@pytest.mark.parametrize("ros", [1, 2])
def test_a_package_says_what_it_is_and_holds_the_network(
    compiled: nv.CompiledNetwork, ros: Ros, tmp_path: Path
) -> None:
    written, kept = save(tmp_path, texts(compiled, "package", ros))
    assert not kept
    package = ElementTree.parse(tmp_path / "package.xml").getroot()
    assert package.findtext("name") == "neurovis_arm_2"
    assert package.findtext("description") == plain_line(compiled.network.title or "")
    needs = {one.text for one in package.iter("exec_depend")}
    assert needs >= {"std_msgs", "sensor_msgs", "geometry_msgs", "rospy" if ros == 1 else "rclpy"}
    (spec,) = [path for path in written if path.name == "network.yaml"]
    assert nv.compile(spec).network.hash == compiled.network.hash
    assert nv.compile(spec).network.ros == compiled.network.ros
    settings = yaml.safe_load((tmp_path / "config" / "parameters.yaml").read_text())
    given = settings if ros == 1 else settings["/**"]["ros__parameters"]
    assert given == {"gain": 1e-5, "on": 2.0}
    assert all(isinstance(value, float) for value in given.values())
    if ros == 1:
        assert (tmp_path / "scripts" / "run").stat().st_mode & 0o111
        (node,) = ElementTree.parse(tmp_path / "launch" / "network.launch").getroot().iter("node")
        assert (node.get("pkg"), node.get("type")) == ("neurovis_arm_2", "run")
        assert (node.get("ns"), node.get("name")) == ("/robot/left", "Arm_2")
    else:
        (node,) = ElementTree.parse(tmp_path / "launch" / "network.launch.xml").getroot().iter("node")
        assert (node.get("pkg"), node.get("exec")) == ("neurovis_arm_2", "run")


def test_a_network_without_parameters_has_no_file_of_them() -> None:
    compiled = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {}}\n")
    for form, ros in FORMS:
        made = texts(compiled, form, ros)
        assert not any("parameters.yaml" in name or "parameters.yaml" in text for name, text in made.items())


def test_a_publisher_of_python_holds_the_network(compiled: nv.CompiledNetwork, tmp_path: Path) -> None:
    save(tmp_path, texts(compiled, "publisher", 2))
    network = runpy.run_path(str(tmp_path / "arm_2_publisher.py"))["NETWORK"]
    assert network.spec == compiled.text()
    assert (network.name, network.namespace, network.hash) == ("Arm_2", "/robot/left", compiled.network.hash)
    assert (network.neurons, network.weights) == (4, 1)


def test_what_is_yours_stays_and_what_is_not_ours_is_not_replaced(compiled: nv.CompiledNetwork, tmp_path: Path) -> None:
    made = texts(compiled, "package", 2)
    save(tmp_path, made)
    for path in (tmp_path / "setup.py", tmp_path / "config" / "parameters.yaml"):
        path.write_text("mine")
    run = tmp_path / "neurovis_arm_2" / "run.py"
    run.write_text(f"{run.read_text()}# more\n")
    written, kept = save(tmp_path, made)
    assert sorted(kept) == [tmp_path / "config" / "parameters.yaml", tmp_path / "setup.py"]
    assert run in written
    assert run.read_text() == made["neurovis_arm_2/run.py"]
    assert {name for name in made if name in YOURS} >= {"setup.py", "package.xml"}
    run.write_text("print()")
    (tmp_path / "README.md").unlink()
    with pytest.raises(ExportError, match=r"run\.py was not made by neurovis and would be lost"):
        save(tmp_path, made)
    assert not (tmp_path / "README.md").exists()


def test_texts_are_escaped_for_their_place() -> None:
    assert ElementTree.fromstring(f"<a b='{xml(repr(0) + chr(39))}'>{xml('<&>]]>' + chr(1))}</a>").text == "<&>]]> "
    assert [yaml.safe_load(number(value)) for value in (1e-7, 1e22, 3, -0.1)] == [1e-7, 1e22, 3.0, -0.1]
    with pytest.raises(ValueError, match="not finite"):
        number(float("inf"))


def test_arguments_of_ros_are_told_apart() -> None:
    given = ["x.yaml", "--rate", "5", "--ros-args", "--params-file", "p", "-r", "__node:=y"]
    assert arguments_of_ros(given) == (given[:3], tuple(given[3:]))
    assert arguments_of_ros(["a.yaml", "--set", "a=1"]) == (["a.yaml", "--set", "a=1"], ())


def test_the_command_says_what_it_wrote(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = tmp_path / "arm.yaml"
    spec.write_text(SPEC)
    folder = tmp_path / "made"
    done = CliRunner().invoke(neurovis, ["ros", "export", str(spec), "--to", "cpp", "--set", "on=3", "-o", str(folder)])
    assert done.exit_code == 0, done.output
    assert str(folder / "arm_2_node.cpp") in done.output.splitlines()
    assert json.loads((folder / "config" / "parameters.yaml").read_text().splitlines()[-1].partition(":")[2]) == 3
    wrong = CliRunner().invoke(neurovis, ["ros", "export", str(spec), "--to", "cpp", "--ros", "2", "-o", str(folder)])
    assert wrong.exit_code == 2
    assert "roscpp" in wrong.output
    monkeypatch.setattr("neurovis_spec.cli.ros_export.find_spec", lambda name: None)
    missing = CliRunner().invoke(neurovis, ["ros", "export", str(spec), "-o", str(folder)])
    assert missing.exit_code == 1
    assert "ros export needs jinja2" in missing.output
