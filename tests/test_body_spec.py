"""The ``body`` of a spec: what it becomes, where its files may lie, what ``inspect`` and an editor say of it."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from lsp_marks import marked

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.lsp.completion import complete
from neurovis_spec.lsp.hover import hover
from neurovis_spec.lsp.rename import apply, rename
from neurovis_spec.plugins import _points

MODEL = Path(__file__).parent / "errors" / "data" / "body_leg.xml"
SPEC = """\
neurovis: 1
name: kick
time: {dt: 0.05, episode: 20}
parameters: {gain: 0.4, lift: {value: 0.1, max: 1}}
inputs: {way: {size: 3}, hit: {expression: sin(k)}, up: {}}
neurons: {A: {input: hit}, B: {count: 3, input: way}, C: {input: up}}
connections: {A -> B: 1, B -> A: 0.3}
outputs: {swing: A, legs: B}
"""
BODY = """\
body:
  mujoco: leg.xml
  sensors: {way: place, hit: touch, up: "place[2]"}
  actuators:
    hip[0]: gain*swing + lift*legs[ 1 ] - legs[0] + dt
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shutil.copy(MODEL, tmp_path / "leg.xml")
    return tmp_path


def codes(text: str, folder: Path) -> list[tuple[str, int, int]]:
    try:
        found = nv.compile_text(text, folder=folder).warnings
    except nv.SpecError as error:
        found = error.diagnostics
    return [(item.code, item.span.line, item.span.column) for item in found]


def test_what_a_body_becomes(folder: Path) -> None:
    compiled = nv.compile_text(SPEC + BODY, folder=folder)
    assert compiled.warnings == ()
    body = compiled.network.body
    assert body is not None
    assert (body.kind, body.given, body.path, body.substeps) == ("mujoco", "leg.xml", folder / "leg.xml", None)
    assert [(one.input, one.sensors) for one in body.sensed] == [(0, ("place",)), (1, ("touch",)), (2, ("place[2]",))]
    (moved,) = body.moved
    assert moved.actuator == "hip", "a single number has one name"
    assert set(moved.outputs) == {("swing", 0, 0), ("legs[1]", 1, 1), ("legs[0]", 1, 0)}
    assert [name for name, _ in moved.parameters] == ["gain", "lift"]
    assert not body.each_episode
    again = nv.compile_text(SPEC + BODY + "  reset: each_episode\n  substeps: 2 + 3\n", folder=folder).network.body
    assert again is not None
    assert (again.each_episode, again.substeps) == (True, 5)


def test_a_body_does_not_change_the_hash(folder: Path) -> None:
    assert nv.compile_text(SPEC + BODY, folder=folder).hash == nv.compile_text(SPEC).hash


def test_a_parameter_that_a_command_alone_reads_is_used(folder: Path) -> None:
    assert ("unused-parameter", 4, 14) in codes(SPEC, folder)
    assert codes(SPEC + BODY, folder) == []


def test_names_are_checked_where_the_steps_do_not_fit(folder: Path) -> None:
    wrong = SPEC + BODY.replace("place,", "palce,") + "  substeps: 7\n"
    assert codes(wrong, folder) == [("unknown-sensor", 11, 18), ("bad-body", 14, 13)]


def test_what_follows_from_another_mistake_is_not_reported(folder: Path) -> None:
    wrong = (SPEC + BODY).replace("dt: 0.05", "dt: zero").replace("legs: B}", "legs: Q}").replace("up: {}", "up: []")
    assert [code for code, _, _ in codes(wrong, folder)] == ["unknown-name", "wrong-type", "unknown-neuron"]


@pytest.mark.parametrize("link", [False, True])
def test_nothing_outside_the_root_is_opened(tmp_path: Path, link: bool) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    shutil.copy(MODEL, tmp_path / "leg.xml")
    part = "leg.xml" if link else "../leg.xml"
    if link:
        (inner / "leg.xml").symlink_to(tmp_path / "leg.xml")
    include = f'<include file="{part}"/>'
    folders = '<asset><mesh file="leg.xml"/></asset><include file="folders.xml"/>'
    (inner / "whole.xml").write_text(f"<mujoco>{include}</mujoco>")
    (inner / "windows.xml").write_text(f"<mujoco>{include.replace('../', '..' + chr(92))}</mujoco>")
    (inner / "folders.xml").write_text('<mujoco><compiler assetdir=".."/></mujoco>')
    (inner / "later.xml").write_text(f"<mujoco>{include if link else folders}</mujoco>")
    (inner / "a" / "b").mkdir(parents=True)
    (inner / "far").symlink_to(inner / "a" / "b")
    lexical = '<include file="far/../../leg.xml"/>'  # of which MuJoCo makes ../leg.xml
    (inner / "reduced.xml").write_text(f"<mujoco>{include if link else lexical}</mujoco>")
    for name in ("whole.xml", part, "windows.xml", "later.xml", "reduced.xml"):
        assert codes(SPEC + BODY.replace("leg.xml", name), inner) == [("path-outside", 10, 11)]
    (inner / "spec.yaml").write_text(SPEC + BODY.replace("leg.xml", "whole.xml"))
    assert nv.compile(inner / "spec.yaml", root=tmp_path).warnings == ()


def test_what_is_not_installed_is_a_warning(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("neurovis_bodies")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    compiled = nv.compile_text(SPEC + BODY.replace("place,", "palce,"), folder=folder)
    (found,) = compiled.warnings
    assert (found.code, found.span.line, found.span.column) == ("body-unchecked", 10, 11)
    assert "needs what is not installed" in found.message
    assert found.hint == "pip install 'neurovis-spec[sim]'"
    assert compiled.network.body is not None
    assert compiled.describe()["body"] == {
        **{"kind": "mujoco", "given": "leg.xml", "substeps": None},
        **{"sensors": None, "actuators": None},
    }


def test_a_plug_in_that_fails_is_reported(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from importlib.metadata import EntryPoint

    from neurovis_spec import plugins

    broken = EntryPoint("broken", "neurovis_spec.nothing_of_the_kind:Kind", "neurovis.bodies")
    odd = EntryPoint("odd", "fractions:Fraction.limit_denominator", "neurovis.bodies")
    none = EntryPoint("none", "fractions:Fraction", "neurovis.bodies")
    there = _points("neurovis.bodies")
    with_others = {**there, "broken": broken, "odd": odd, "none": none}
    monkeypatch.setattr(plugins, "_points", lambda group: with_others if group == "neurovis.bodies" else {})
    from neurovis_spec.language.body import BodyModel

    BodyModel._fields.cache_clear()
    try:
        assert codes(SPEC + "body: {odd: thing}\n", folder)[0] == ("bad-body", 9, 13)
        assert codes(SPEC + "body: {none: thing}\n", folder)[0] == ("bad-body", 9, 14)
        assert codes(SPEC + "body: {broken: thing}\n", folder)[-1] == ("body-unchecked", 9, 16)
    finally:
        BodyModel._fields.cache_clear()


def inspected(folder: Path, *arguments: str) -> str:
    (folder / "spec.yaml").write_text(SPEC + BODY)
    result = CliRunner().invoke(neurovis, ["inspect", str(folder / "spec.yaml"), *arguments])
    assert (result.exit_code, result.stderr) == (0, "")
    return result.stdout


def test_inspect_shows_the_ports(folder: Path) -> None:
    shown = inspected(folder)
    assert (
        "body\n  mujoco: leg.xml\n\n"
        "sensors\n  name   size  unit  input\n"
        "  place  3     m     way up\n  touch  1     N     hit\n  angle  1     rad\n\n"
        "actuators\n  name  size  unit  range   command\n"
        "  hip   1     rad   -1 … 1  gain*swing + lift*legs[ 1 ] - legs[0] + dt\n"
    ) in shown
    assert "way   3     sensors" in shown
    told = json.loads(inspected(folder, "--format", "json"))
    assert [entry["source"] for entry in told["inputs"]] == ["sensors", "sensors", "sensors"]
    assert told["body"]["sensors"][0] == {"name": "place", "size": 3, "unit": "m", "inputs": ["way", "up"]}
    (hip,) = told["body"]["actuators"]
    assert (hip["low"], hip["high"]) == (-1, 1)
    assert hip["commands"] == {"hip": "gain*swing + lift*legs[ 1 ] - legs[0] + dt"}


@pytest.mark.parametrize(
    ("body", "there", "missing"),
    [
        ("body:\n  ¦", ["mujoco", "gymnasium", "sensors", "actuators"], ["weight"]),
        ("body:\n  mujoco: leg.xml\n  sensors: {up: ¦", ["touch", "place", "place[2]", "angle"], ["hip", "A"]),
        ("body:\n  mujoco: leg.xml\n  sensors: {way: [angle, t¦]}", ["touch", "place[0]"], ["hip"]),
        ("body:\n  mujoco: leg.xml\n  sensors: {¦", ["way", "hit", "up"], ["touch"]),
        ("body:\n  mujoco: leg.xml\n  actuators:\n    ¦", ["hip"], ["touch", "swing"]),
        ("body:\n  mujoco: leg.xml\n  actuators:\n    hip: 2*¦", ["swing", "legs", "gain", "dt", "sin"], ["A", "hip"]),
        ("body:\n  mujoco: none.xml\n  sensors: {up: ¦", [], ["touch"]),
        ("body:\n  mujoco: leg.xml\n  reset: ¦", ["each_episode", "never"], []),
    ],
)
def test_what_fits_is_offered(folder: Path, body: str, there: list[str], missing: list[str]) -> None:
    document, place = marked(SPEC + body, folder)
    found = {item.label for item in complete(document, place)}
    assert set(there) <= found
    assert found.isdisjoint(missing)


@pytest.mark.parametrize(
    ("mark", "told"),
    [
        ("way: pl¦ace", "**place** (sensor): 3 numbers, m"),
        ('"pl¦ace[2]"', "**place** (sensor): 3 numbers, m"),
        ("h¦ip[0]:", "**hip** (actuator): 1 number, rad, -1 … 1"),
        ("g¦ain*swing", "gain"),
    ],
)
def test_what_stands_there_is_explained(folder: Path, mark: str, told: str) -> None:
    document, place = marked((SPEC + BODY).replace(mark.replace("¦", ""), mark, 1), folder)
    found = hover(document, place)
    assert found is not None
    assert told in found.markdown


def test_an_output_is_renamed_in_commands(folder: Path) -> None:
    document, place = marked((SPEC + BODY).replace("legs: B", "le¦gs: B"), folder)
    edited = apply(document, rename(document, place, "limbs"))
    assert edited.source == (SPEC + BODY).replace("legs", "limbs")


def test_the_text_of_a_network_goes_anywhere_without_its_body(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    compiled = nv.compile_text(SPEC + BODY, folder=folder)
    elsewhere = nv.compile_text(compiled.text(), folder=tmp_path_factory.mktemp("elsewhere"))
    assert elsewhere.hash == compiled.hash
    assert elsewhere.network.body is None


ODD = ["[]", "0", "''", "~", "{}", "{a: }", *(f"{{hip: {odd}}}" for odd in ("[1]", "''", "{}", "1e999")), "{[a]: 1}"]


@pytest.mark.parametrize("key", ["sensors", "actuators", "substeps", "reset", "mujoco"])
def test_what_is_out_of_place_is_a_finding(folder: Path, key: str) -> None:
    for value in ODD:
        body = {"mujoco": "leg.xml", key: value}
        text = SPEC + "body:\n" + "".join(f"  {one}: {what}\n" for one, what in body.items())
        if value == "{}" and key in ("sensors", "actuators"):
            nv.compile_text(text, folder=folder)
            continue
        with pytest.raises(nv.SpecError) as caught:
            nv.compile_text(text, folder=folder)
        assert {found.span.line for found in caught.value.diagnostics} <= {10, 11}, value
