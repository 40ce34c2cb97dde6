"""The JSON Schema says what the compiler says, as far as shapes go: editors underline what is wrong, nothing else."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import cast

import hostile
import pytest
import yaml
from click.testing import CliRunner
from jsonschema import Draft202012Validator
from laws import one_in

import neurovis_spec as nv
from neurovis_spec import api
from neurovis_spec.cli.commands import neurovis

HERE = Path(__file__).parent
SPECS = sorted((HERE.parent / "specs").glob("**/*.yaml"))
#: libyaml's reads as PyYAML's own does, ten times as fast; it is in the wheels of PyYAML.
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
SCHEMA = api.schema()
INCLUDED = api.schema(included=True)
VALIDATOR = Draft202012Validator(SCHEMA)
#: Findings about shapes: these a schema can know.
SHAPE = {
    *("wrong-type", "unknown-key", "missing-key", "unknown-value", "one-key", "no-value", "unknown-section"),
    *("conflicting-keys", "useless-key", "bad-event", "first-without-count", "unknown-pattern", "empty-reference"),
}
#: Where a schema cannot tell, or need not: whether a list of n values or a name is wanted depends on a definition.
BEYOND = ("goal", "probability", "random", "weight", "swish", "slow", "own", "edges", "position")
#: Defective specs with a shape that only who knows the rest of the spec, or YAML 1.2, can tell from a right one.
ELSEWHERE = (
    "wrong_type_bool",
    "no_value",
    "centre_useless",
    "empty_reference",
    "line_style_no_entry",
    "line_style_no_file",
)


def messages(text: str) -> list[str]:
    return [error.message for error in VALIDATOR.iter_errors(yaml.load(text, LOADER))]


def test_it_is_a_schema() -> None:
    Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"] == "https://json-schema.org/draft/2020-12/schema"


def test_every_reference_leads_somewhere() -> None:
    """Also those of parts that no example has, such as 'scale' of a connection."""
    for schema in (SCHEMA, INCLUDED):
        Draft202012Validator.check_schema(schema)
        known = {f"#/$defs/{name}" for name in cast(dict[str, object], schema["$defs"])}
        used = set(re.findall(r'"\$ref": "([^"]*)"', json.dumps(schema)))
        assert used
        assert used <= known


def test_connections_have_one_shape_everywhere() -> None:
    definitions = cast(dict[str, dict[str, dict[str, object]]], SCHEMA["$defs"])
    properties = cast(dict[str, dict[str, object]], SCHEMA["properties"])
    inside = definitions["ModuleModel"]["properties"]["connections"]
    assert cast(dict[str, object], inside)["anyOf"] == properties["connections"]["anyOf"]


@pytest.mark.parametrize("place", ["properties", "ModuleModel", "InstanceModel", "LayoutModel", "ModuleLayoutModel"])
def test_every_key_is_described(place: str) -> None:
    definitions = cast(dict[str, dict[str, dict[str, object]]], SCHEMA["$defs"])
    keys = SCHEMA["properties"] if place == "properties" else definitions[place]["properties"]
    for name, schema in cast(dict[str, dict[str, object]], keys).items():
        assert schema.get("description"), name


PARTS = """
modules:
  toe: {neurons: {K: {}}, connections: {K -> K: 1}}
  leg:
    title: A leg
    parameters: {gain: 1, slow: {value: 2*gain, min: 0}}
    neurons: {S: {input: load}, K: {count: 2}}
    inputs: {load: {}}
    instances: {toe: {module: toe, count: 3, set: {}, inputs: {}}}
    connections: [{S -> K: gain}, {K -> K: {matrix: [[0, 1], [1, 0]], scale: {norm: 1}}, toe.K -> S: }]
    layout: {positions: {S: [0, 0]}, arrange: {K: row}, boxes: {All: [S, K]}, mirror: [[K1, K2]], align: [[K1, K2]]}
"""


@pytest.mark.parametrize(
    ("text", "spec", "included"),
    [
        (PARTS, True, True),
        ("include: legs.yaml", True, True),
        ("include: [a.yaml, b/c.yaml]\nrules: {r: {weight: {each_step: weight}}}", True, True),
        ("instances: {left: {module: leg, count: 3, set: {gain: 0.8*i}, inputs: {load: go}}}", True, False),
        ("layout: {mirror: [[left, right]], align: [[left1, left2]], file: x.layout.json}", True, False),
        ("neurons: {A: {}}", True, False),
        ("instances: {left: {count: 3}}", False, False),
        ("instances: {left: {module: leg, first: 0}}", False, False),
        ("instances: {left: {module: leg, set: [1]}}", False, False),
        ("layout: {mirror: [[left, right, up]]}", False, False),
        ("layout: {align: [left, right]}", False, False),
        ("include: {legs: 1}", False, False),
        ("modules: {leg: {neurons: {K: {acivation: tanh}}}}", False, False),
        ("modules: {leg: {outputs: {a: K}}}", False, False),
        ("modules: {leg: {neurons: {K: {}}, connections: {K to K: 1}}}", False, False),
        ("modules: {leg: {neurons: {K: {}}, connections: {K -> K: {wieght: 1}}}}", False, False),
        ("modules: {leg: {neurons: {K: {}}, connections: {K -> K: {scale: {nrm: 1}}}}}", False, False),
        ("modules: {leg: {layout: {engine: grid}}}", False, False),
        ("modules: {1leg: {}}", False, False),
    ],
)
def test_modules_instances_and_includes(text: str, spec: bool, included: bool) -> None:
    assert (messages(f"neurovis: 1\nname: x\n{text}") == []) == spec
    assert (not list(Draft202012Validator(INCLUDED).iter_errors(yaml.safe_load(text)))) == included


def test_the_command_prints_both() -> None:
    for given, schema in (([], SCHEMA), (["--included"], INCLUDED)):
        result = CliRunner().invoke(neurovis, ["schema", *given])
        assert result.exit_code == 0
        assert json.loads(result.output) == schema


@pytest.mark.parametrize("path", [*SPECS, HERE / "rich.yaml"], ids=lambda path: path.stem)
def test_right_specs_pass(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    if yaml.safe_load(text).keys() == {"body"}:  # a body for --body: a spec's
        text = f"neurovis: 1\nname: x\n{text}"
    as_included = list(Draft202012Validator(INCLUDED).iter_errors(yaml.safe_load(text)))
    if "\nname:" in text:
        assert messages(text) == []
        assert as_included != []
    else:
        assert as_included == []


PAGE = (HERE.parent / "docs" / "language.md").read_text(encoding="utf-8")
MANUAL = HERE.parent / "neurovis_spec" / "manual" / "examples.yaml"


@pytest.mark.parametrize("text", re.findall(r"^```yaml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL))
def test_examples_of_the_language_page_pass(text: str) -> None:
    assert list(VALIDATOR.iter_errors({"neurovis": 1, "name": "x", **yaml.safe_load(text)})) == []


@pytest.mark.parametrize("key", yaml.safe_load(MANUAL.read_text(encoding="utf-8")))
def test_examples_of_the_manual_pass(key: str) -> None:
    example = yaml.safe_load(yaml.safe_load(MANUAL.read_text(encoding="utf-8"))[key])
    assert list(VALIDATOR.iter_errors({"neurovis": 1, "name": "x", **example})) == []


@pytest.mark.parametrize(
    "text",
    [
        "neurons: {A: {activation: tanh, model: {leaky_integrator: {leak: [0.1, a]}}}}",
        "neurons: {A: {activation: {gaussian: }}}",
        "neurons: {A: {activation: {piecewise_linear: {x0: 0, x1: 2*a}}, count: n}}",
        "connections: {A -> B: , B -> A: 0.5, C -> A: a*i, D -> A: {plasticity: {delta: {rate: 0.1, target: T}}}}",
        "connections: [{A -> B: 1}, {A -> B: {pattern: {random: {probability: 0.1}}}}]",
        "connections: {A -> B: {matrix: [[1, null, a*2]], rows: to, bounds: [-a, a], plasticity: oja}}",
        "connections: {A -> B: {edges: [[A, B], [A, B, 1], [A, B, a, 2]]}, B -> A: {edges: {file: e.csv}}}",
        "connections: {A -> B: {centre: {file: c.csv}}, B -> A: {centre: 1}, C -> A: {centre: [[1]]}}",
        "inputs: {a: {}, b: {size: 3}, c: {values: [1, a, [2]]}, d: {file: d.csv}}",
        "parameters: {a: 1, b: {value: 2, min: 0, max: a}}",
        "neurons: {A: {position: [0, 1]}, B: {position: [[0, a], [1, 2]]}, C: {position: {file: p.csv}}}",
        "neurons: {A: {bias: 1, initial: [0, a]}, B: {count: 2, label: [x, y]}, C: {names: [u, v], label: z}}",
        "render: {title: false, size: [640, 480]}",
        "render: {title: Text}",
        "connections: {A -> B: {pattern: ring}, B -> A: {pattern: {ring: }}, A -> C: {pattern: {ring: {}}}}",
        "connections: {A -> B: {centre: [[1]], rows: to}, B -> A: {edges: [[A, B]], centre: 1}}",
        "connections: {A -> B: {scale: {indegree: false}}}",
        "events: [{at: 1, set: {a: 1}, lesion: A}, {from: 1, clamp: {A: 1}}, {from: 1, to: n, clamp: {A: 1}}]",
        "outputs: {a: A, b: [A, B + C]}",
        "seed: -3",
    ],
)
def test_every_way_to_write_passes(text: str) -> None:
    assert messages(f"neurovis: 1\nname: x\n{text}") == []


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("colour: red", []),
        ("neurons: {A: {activaton: tanh}}", ["neurons", "A"]),
        ("neurons: {A: }", ["neurons", "A"]),
        ("neurons: {1A: {}}", ["neurons"]),
        ("neurons: {A: {combine: product of}}", ["neurons", "A", "combine"]),
        ("neurons: {A: {bias: }}", ["neurons", "A", "bias"]),
        ("neurons: {A: {activation: {tanh: {}, relu: {}}}}", ["neurons", "A", "activation"]),
        ("neurons: {A: {activation: {gaussian: 3}}}", ["neurons", "A", "activation"]),
        ("connections: {A to B: 1}", ["connections"]),
        ("connections: {A -> B: [[1]]}", ["connections"]),
        ("connections: {A -> B: {wieght: 1}}", ["connections"]),
        ("time: {dt: true}", ["time", "dt"]),
        ("rules: {r: {signals: [a]}}", ["rules", "r"]),
        ("rules: {r: {weight: {}}}", ["rules", "r", "weight"]),
        ("connections: {A -> B: {edges: [['', B]]}}", ["connections"]),
        ("events: [{at: 1, lesion: []}]", ["events", 0, "lesion"]),
        ("events: [{at: 1, set: {}}]", ["events", 0, "set"]),
        ("connections: {A -> B: {scale: {}}}", ["connections"]),
        ("connections: {A -> B: {scale: {norm: 1, indegree: true}}}", ["connections"]),
        ("connections: {A -> B: {pattern: random}}", ["connections"]),
        ("connections: {A -> B: {pattern: {random: {}}}}", ["connections"]),
        ("connections: {A -> B: {pattern: {random: }}}", ["connections"]),
        ("connections: {A -> B: {pattern: {small_world: {degree: 2}}}}", ["connections"]),
        ("connections: {A -> B: {pattern: {ring: {count: 2}}}}", ["connections"]),
        ("connections: {A -> B: {pattern: rong}}", ["connections"]),
        ("connections: {A -> B: {matrix: [[1]], weight: 1}}", ["connections"]),
        ("connections: {A -> B: {edges: [[A, B]], centre: [[1]]}}", ["connections"]),
        ("connections: {A -> B: {bounds: [0, 1]}}", ["connections"]),
        ("connections: {A -> B: {rows: to}}", ["connections"]),
        ("connections: {A -> B: {matrix: [[1]], self: true}}", ["connections"]),
        ("inputs: {a: {file: a.csv, size: 1}}", ["inputs", "a"]),
        ("inputs: {a: {expression: k, poisson: 1}}", ["inputs", "a"]),
        ("inputs: {a: {spikes: {time: h}}}", ["inputs", "a", "spikes"]),
        ("neurons: {A: {first: 0}}", ["neurons", "A"]),
        ("neurons: {A: {names: [a, 1b]}}", ["neurons", "A", "names"]),
        ("parameters: {pi: 3}", ["parameters"]),
        ("events: [{at: 1}]", ["events", 0]),
        ("events: [{set: {a: 1}}]", ["events", 0]),
        ("events: [{at: 1, to: 2, lesion: A}]", ["events", 0]),
        ("events: [{at: 1, clamp: {A: 1}, from: 2}]", ["events", 0]),
        ("outputs: {a: []}", ["outputs", "a"]),
        ("outputs: {a: ' '}", ["outputs", "a"]),
        ("seed: 9223372036854775808", ["seed"]),
        ("layout: {positions: {A: [1, 2, 3]}}", ["layout", "positions", "A"]),
        ("render: {theme: drak}", ["render", "theme"]),
    ],
)
def test_wrong_shapes_are_found_where_they_are(text: str, where: list[str | int]) -> None:
    found = list(VALIDATOR.iter_errors(yaml.safe_load(f"neurovis: 1\nname: x\n{text}")))
    assert [list(error.absolute_path) for error in found] == [where]


@pytest.mark.parametrize("path", sorted((HERE / "errors").glob("*.yaml")), ids=lambda path: path.stem)
def test_defective_specs_are_refused_for_their_shape_alone(path: Path) -> None:
    text = path.read_bytes().decode("utf-8", "replace")
    codes = set(re.findall(r"# error: \d+:\d+ ([\w-]+)", text))
    if path.stem.startswith("yaml_") or not codes or not codes <= SHAPE:
        return  # YAML's own faults never come to a schema; meanings are beyond it
    if path.stem not in ELSEWHERE:
        assert messages(text), f"{path.stem} has a wrong shape"


def errors(text: str) -> set[str]:
    """The codes of the errors that the compiler finds."""
    try:
        nv.compile_text(text)
    except nv.SpecError as error:
        return {item.code for item in error.diagnostics if item.severity == "error"}
    return set()


@pytest.mark.parametrize("part", range(3))
def test_schema_and_compiler_agree(part: int) -> None:
    """What the compiler accepts the schema accepts; what is wrong in shape alone it refuses."""
    rich, share = cast(hostile.Data, yaml.safe_load(hostile.RICH)), 40 * one_in(2)
    for number, path in enumerate(hostile.paths(rich)):
        for other, (name, wrong) in enumerate(hostile.WRONG.items()):
            if (number + other) % (3 * share) != share * part + 3 or name == "huge":  # PyYAML takes 1e300 for a text
                continue
            text = hostile.replaced(rich, path, wrong)
            refused, codes = bool(messages(text)), errors(text)
            if not codes:
                assert not refused, f"{hostile.shown(path)}: {name} is refused"
            elif codes <= SHAPE and not {str(key) for key in path}.intersection(BEYOND) and "->" not in str(path[-1]):
                assert refused, f"{hostile.shown(path)}: {name} is accepted"


@pytest.mark.parametrize("part", range(3))
def test_schema_and_compiler_agree_on_what_is_missing(part: int) -> None:
    """The same, with one part of the spec left out."""
    rich = cast(hostile.Data, yaml.safe_load(hostile.RICH))
    for path in list(hostile.paths(rich))[part :: 9 * one_in(2)]:
        text = json.dumps(hostile.without(rich, path), ensure_ascii=False)
        refused, codes = bool(messages(text)), errors(text)
        if not codes:
            assert not refused, f"{hostile.shown(path)} may be left out"
        elif codes <= SHAPE - {"useless-key"}:  # without 'combine: distance' there is no use for a 'centre'
            assert refused, f"{hostile.shown(path)} is missed"
