"""Golden files pin what the compiler, the layout and the encoding make of every example.

``tests/golden/<spec>/network.json``, ``layout.<engine>.json`` and ``scene.json`` (of small specs) are compared value by
value; ``scene.svg`` lies beside them to be looked at, and must show the same items. After a wanted change: ``pytest
tests/test_golden.py
--update-golden``, then read the diff.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest
from examples import EXAMPLES, shipped
from scenes import file_of, scene_of

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.program import ACTIVATION, MODEL, SYNAPSE, Definition, Population, Projection
from neurovis_spec.scene import Scene

HERE = Path(__file__).parent
SPECS = EXAMPLES
#: specs whose scene is pinned: of the others a change of the layout would change thousands of lines and say no more
SMALL = [path for path in SPECS if path.stem not in ("hexapod", "stick_insect", "worm")]
#: the step that the scene shows
STEPS = {"cpg_rbf": 90, "mlp": 3, "hebbian": 250, "reward": 630, "walk": 50}
Plain: TypeAlias = "bool | int | float | str | list[Plain] | dict[str, Plain] | None"


def plain(value: object) -> Plain:
    """Any of our values as JSON: records by their fields, arrays as lists, NaN as text."""
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if value is None or isinstance(value, bool | int | str):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        kind: dict[str, Plain] = {"kind": type(value).__name__}
        return kind | {f.name: plain(getattr(value, f.name)) for f in fields(value) if f.name not in ("start", "end")}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list | frozenset):
        return [plain(item) for item in (sorted(value) if isinstance(value, frozenset) else value)]
    raise TypeError(f"no golden form for {type(value).__name__}")


#: What the fields of operations are called in the golden files.
CALLED = {"population": "block", "projection": "plasticity"}


def record(kind: str, **fields: object) -> dict[str, Plain]:
    """A record by the names that it had in the first golden files."""
    return {"kind": kind, **{name: plain(value) for name, value in fields.items()}}


def definition_of(made: Definition) -> dict[str, Plain]:
    named = {"name": made.name, "parameters": made.parameters}
    state = [
        record(type(one).__name__, name=one.name, initial=one.initial, each_step=one.each_step,
               each_episode=one.each_episode, **({} if one.derivative is None else {"derivative": one.derivative}))
        for one in made.state
    ]  # fmt: skip
    inner = {"let": made.let, "state": state}
    given = made.given
    if made.kind == ACTIVATION:
        checked = {"undefined": made.gives[1].each_step} if len(made.gives) > 1 else {}
        return record("CheckedActivation" if checked else "Activation", **named, value=given.each_step, **checked)
    if made.kind == MODEL:
        return record("Model", **named, **inner, activity=given.each_step, spikes=made.spikes)
    if made.kind == SYNAPSE:
        return record("Synapse", **named, **inner, signal=given.each_step, sign=made.sign)
    steps = {"each_step": given.each_step, "each_episode": given.each_episode}
    return record("Rule", **named, signals=made.signals, **inner, **steps)


def block_of(population: Population) -> dict[str, Plain]:
    return record(
        "Block",
        level=population.level,
        members=population.members,
        combine=population.drive.combine,
        activation=definition_of(population.activation.definition),
        activation_parameters=population.activation.parameters,
        model=definition_of(population.model.definition),
        model_parameters=population.model.parameters,
        incoming=population.drive.incoming,
        slots=population.drive.slots,
    )


def plasticity_of(one: Projection) -> dict[str, Plain]:
    if one.kind == SYNAPSE:
        return record(
            "Synapse", synapse=definition_of(one.use.definition), members=one.members, parameters=one.use.parameters
        )
    rule, parameters = definition_of(one.rule.definition), one.rule.parameters
    return record("Plasticity", rule=rule, members=one.members, parameters=parameters, signals=one.signals)


def network_of(compiled: CompiledNetwork) -> Plain:
    network = compiled.network
    described = {key: plain(value) for key, value in compiled.describe().items() if key != "hash"}
    return {
        **described,
        "bounds": plain(np.stack([network.connections.low.whole(), network.connections.high.whole()], axis=1)),
        "centres": plain(network.connections.centres.whole()),
        "initial": plain(network.neurons.initial),
        "blocks": [block_of(one) for one in network.populations],
        "plasticity": [plasticity_of(one) for one in network.projections],
        "program": [
            record(
                type(one).__name__,
                **{
                    CALLED.get(field.name, field.name): getattr(one, field.name)
                    for field in fields(one)
                    if field.name != "phases" and getattr(one, field.name) is not False
                },
            )  # no golden network has connections of several rules, or spikes
            for one in network.program
        ],
    }


def drawn(compiled: CompiledNetwork) -> Scene:
    step = STEPS.get(compiled.name, 100)
    return scene_of(compiled, compiled.run(step + 1).snapshot(step))


def same(one: Plain, other: Plain, path: str = "$") -> None:
    """Equal but for the last bits of a float, which elementary functions owe to the platform."""
    if isinstance(one, dict) and isinstance(other, dict):
        assert list(one) == list(other), path
        for key in one:
            same(one[key], other[key], f"{path}.{key}")
    elif isinstance(one, list) and isinstance(other, list):
        assert len(one) == len(other), path
        for index, pair in enumerate(zip(one, other, strict=True)):
            same(*pair, f"{path}[{index}]")
    elif isinstance(one, float) and isinstance(other, float | int):
        assert math.isclose(one, other, rel_tol=1e-12, abs_tol=1e-12), f"{path}: {one} is not {other}"
    else:
        assert one == other, path


def compare(path: Path, value: Plain, update: bool) -> None:
    text = json.dumps(value, indent=1, ensure_ascii=False) + "\n"
    if update:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    assert path.exists(), f"{path.name} is missing: run with --update-golden and read the diff"
    same(json.loads(text), json.loads(path.read_text(encoding="utf-8")))


@pytest.fixture(scope="module", params=SPECS, ids=lambda path: path.stem)
def compiled(request: pytest.FixtureRequest) -> CompiledNetwork:
    return shipped(request.param)


def test_every_spec_says_what_to_look_at() -> None:
    assert {path.stem for path in SPECS} >= {"cpg_rbf", "cpg_printed", "short_term_memory", "mlp", "ring", "hebbian"}
    for path in SPECS:
        assert "# What to look at:" in path.read_text(encoding="utf-8"), path.name


def test_network(compiled: CompiledNetwork, update_golden: bool) -> None:
    compare(HERE / "golden" / compiled.name / "network.json", network_of(compiled), update_golden)


def test_layout(compiled: CompiledNetwork, update_golden: bool) -> None:
    layout = compiled.drawn()
    value = {"positions": plain(layout.positions), "routes": plain(layout.routes)}
    compare(HERE / "golden" / compiled.name / f"layout.{layout.engine}.json", value, update_golden)


@pytest.mark.parametrize("compiled", SMALL, indirect=True, ids=lambda path: path.stem)
def test_scene(compiled: CompiledNetwork, update_golden: bool) -> None:
    scene = drawn(compiled)
    folder = HERE / "golden" / compiled.name
    compare(folder / "scene.json", plain(scene), update_golden)
    svg = file_of(scene, ".svg").decode()
    if update_golden:
        (folder / "scene.svg").write_text(svg, encoding="utf-8")
    items = re.compile(r"<(\w+)|data-[\w-]+=\"[^\"]*\"")
    shown = (folder / "scene.svg").read_text(encoding="utf-8")
    assert [match.group() for match in items.finditer(shown)] == [match.group() for match in items.finditer(svg)]
