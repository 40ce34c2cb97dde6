"""What an engine refuses is shown where the spec asks for it, as every other finding is."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

import pytest
from click.testing import CliRunner
from lsp_marks import marked
from neurovis_layouts.layered import LayeredEngine, frame_routing
from neurovis_layouts.routing import route_all

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.layout import LayoutRefusalError
from neurovis_spec.lsp.check import check

LEGS = """\
neurovis: 1
name: legs
modules:
  leg:
    neurons: {S: {bias: 1}, K: {}}
    connections: {S -> K: 1}
instances: {left: {module: leg, count: 2}, right: {module: leg, count: 2}}
connections: {left1.K -> right1.S: 1}
layout:
"""
GROUPS = """\
neurovis: 1
name: groups
neurons:
  A: {count: 4, bias: 1, position: [i, 0]}
  B: {}
connections: {A -> B: 1}
layout:
"""
CELLS = """\
neurovis: 1
name: cells
modules:
  m:
    neurons: {A: {bias: 1}, B: {}, C: {bias: 1}, D: {bias: 1}, E: {bias: 1}, F: {}}
    connections: {B -> F: 1, D -> B: 1, D -> F: 1}
    layout: {align: [[E, B]], plan: [[C, D], [F, A]]}
instances: {one: {module: m}}
"""
PAIRED = GROUPS.replace("B: {}", "B: {count: 2}").replace("A -> B", "A1 -> B1")
PINS = "{left1: [0, 0], left2: [0.2, 0], left1.K: [4, 4]}"

REFUSED = [
    (f"{LEGS}  positions: {PINS}\n", "pin-in-frame", "[0.2, 0]"),
    (f"{LEGS}  mirror: [[left, right]]\n  positions: {PINS}\n", "mirror-pins", "[0, 0]"),
    (f"{LEGS}  mirror: [[left1.S, right1.K]]\n", "mirror-frames", "[left1.S, right1.K]"),
    (f"{GROUPS}  arrange: {{A: row, A1..A2: column}}\n", "arranged-twice", "A1..A2"),
    (f"{GROUPS}  arrange: {{A: column}}\n  align: [[A3, B], [A1, A2]]\n", "align-conflict", "[A1, A2]"),
    (f"{GROUPS}  arrange: {{A: row}}\n  mirror: [[A1, B], [A2, A3]]\n", "mirror-arrange", "A"),
    (f"{GROUPS}  engine: spatial\n".replace(", position: [i, 0]", ""), "position-missing", "A"),
    (f"{GROUPS}  engine: manual\n", "position-missing", "A"),
    (f"{GROUPS}  engine: circular\n  align: [[A1, B]]\n", "layout-align-unsupported", "[A1, B]"),
    (f"{GROUPS}  engine: circular\n  plan: [[A, B]]\n", "layout-plan-unsupported", "[A, B]"),
    (LEGS.replace("    conn", "    layout: {mirror: [[S, K]]}\n    conn") + "  engine: grid\n",
     "layout-mirror-unsupported", "[S, K]"),
    (LEGS.replace("{bias: 1}, K: {}}", "{count: 1}, K: {}}\n    layout: {arrange: {S: row, S1: row}}")
     + "  direction: down\n", "arranged-twice", "S1"),
    (LEGS.replace("{bias: 1}, K: {}}",
                  "{count: 3}, K: {}}\n    layout: {arrange: {S: row}, mirror: [[S1, K], [S2, S3]]}")
     + "  direction: down\n", "mirror-arrange", "S"),
    (CELLS, "align-conflict", "[E, B]"),
    (f"{LEGS}  mirror: [[left, right]]\n  align: [[left1.S, right1.K]]\n", "align-conflict", "[left1.S, right1.K]"),
    (f"{PAIRED}  plan: [[A], [B]]\n  positions: {{A1: [0, 0], A4: [4, 3], B1: [2, 1]}}\n", "pin-in-frame", "[2, 1]"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "code", "marked"), REFUSED, ids=[f"{code}-{at}" for _, code, at in REFUSED])
def test_a_refusal_is_a_finding_with_its_place(text: str, code: str, marked: str, tmp_path: Path) -> None:
    with pytest.raises(LayoutRefusalError) as caught:
        nv.compile_text(text).layout()
    found = caught.value.diagnostic
    assert caught.value.code == code
    assert found is not None
    assert (found.code, found.message, found.hint) == (code, str(caught.value), caught.value.hint)
    line = text.split("\n")[found.span.line - 1]
    assert line[found.span.column - 1 : found.span.end_column - 1] == marked
    spec = tmp_path / "spec.yaml"
    spec.write_text(text, encoding="utf-8")
    for command in (["layout", str(spec)], ["render", str(spec), "-o", str(tmp_path / "x.svg")]):
        result = CliRunner().invoke(neurovis, command)
        assert result.exit_code == 1
        at = f"{spec}:{found.span.line}:{found.span.column}: error[{code}]: {found.message}"
        assert at in result.stderr
        assert "^" * len(marked) in result.stderr


#: what no engine has to begin for
FORESEEN = {"arranged-twice", "align-conflict", "position-missing", "pin-in-frame", "mirror-pins",
            "layout-align-unsupported", "layout-mirror-unsupported", "layout-arrange-unsupported",
            "layout-plan-unsupported", "mirror-frames", "mirror-arrange"}  # fmt: skip
MORE = [
    (f"{GROUPS}  engine: circular\n  arrange: {{A: row}}\n", "layout-arrange-unsupported", "A"),
    (f"{GROUPS}  engine: circular\n  mirror: [[A1, A2]]\n", "layout-mirror-unsupported", "[A1, A2]"),
    (f"{GROUPS}  direction: right\n  arrange: {{A: row}}\n  align: [[B, A3], [A1, A2]]\n", "align-conflict",
     "[A1, A2]"),
    (f"{GROUPS}  engine: manual\n  positions: {{B: [9, 9], {', '.join(f'A{i}: [{i}, 0]' for i in range(1, 5))}}}\n"
     "  arrange: {A: row}\n", "layout-arrange-unsupported", "A"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "code", "marked"), [*REFUSED, *MORE])
def test_validate_says_what_would_be_refused(text: str, code: str, marked: str, tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text(text, encoding="utf-8")
    validated = CliRunner().invoke(neurovis, ["validate", str(spec)])
    laid_out = CliRunner().invoke(neurovis, ["layout", str(spec)])
    assert laid_out.exit_code == 1
    if code in FORESEEN:
        assert validated.exit_code == 1
        (line,) = [line for line in laid_out.stderr.split("\n") if "error[" in line]
        assert line in validated.stderr
        assert "ok" not in validated.stdout
        assert "^" * len(marked) in validated.stderr
    else:
        assert (validated.exit_code, validated.stderr) == (0, "")


@pytest.mark.parametrize(
    ("said", "code"),
    [
        ("positions: {left1: [0, 0], left2: [0.5, 0.5]}", "pin-in-frame"),
        ("positions: {left1.S: [0, 0], left1.K: [4, 0], right1.S: [2, 0]}", "pin-in-frame"),
        ("mirror: [[left, right]]\n  positions: {left1: [0, 0], right2: [0.5, 0.5]}", "pin-in-frame"),
        ("mirror: [[left, right]]\n  positions: {left1: [0, 0], right2: [6, 0.5]}", None),
        ("positions: {left1.S: [0, 0], left1.K: [0, 4], right1.S: [6, 0], right1.K: [6, 4]}", None),
        ("positions: {left1.S: [0, 0], right1.K: [0.5, 1]}", None),
        ("engine: grid\n  positions: {left1: [0, 0], left2: [0.5, 0.5]}", None),
    ],
)
def test_validate_accepts_the_pins_that_layout_keeps_and_no_others(said: str, code: str | None) -> None:
    network = nv.compile_text(f"{LEGS}  {said}\n")
    refused = network.refusal()
    assert (None if refused is None else refused.code) == code
    if code is None:
        assert network.layout().positions
        return
    with pytest.raises(LayoutRefusalError) as caught:
        network.layout()
    assert refused == caught.value.diagnostic


def test_pins_are_checked_where_there_are_any_and_nothing_is_routed_between_frames_for_it() -> None:
    with (
        patch.object(LayeredEngine, "check", autospec=True, side_effect=LayeredEngine.check) as check,
        patch.object(frame_routing, "route_all", side_effect=route_all) as routed,
    ):
        assert nv.compile_text(f"{LEGS}  direction: down\n").refusal() is None
        assert nv.compile_text(f"{GROUPS}  positions: {{B: [0, 5]}}\n").refusal() is None
        assert (check.call_count, routed.call_count) == (0, 0)
        # mirror images are checked, too, but nothing is drawn for it
        assert nv.compile_text(f"{LEGS}  mirror: [[left, right]]\n").refusal() is None
        assert (check.call_count, routed.call_count) == (1, 0)
        check.reset_mock()
        assert nv.compile_text(f"{LEGS}  positions: {{left1: [0, 0]}}\n").refusal() is None
        assert check.call_count == 1
        # within the instances, which are drawn alike
        assert [len(centres) for (_, centres, *_), _ in routed.call_args_list] == [2]


@pytest.mark.parametrize(
    "said",
    [
        "engine: layered",
        "engine: circular",
        "engine: spatial\n  positions: {B: [0, 5]}",
        "arrange: {A: row}\n  align: [[A1, A2]]",
        "arrange: {A: column}\n  align: [[A1, A2]]\n  direction: right",
        "arrange: {A: column}\n  align: [[A1, B]]",
        "arrange: {A1..A2: row, A3..A4: row}\n  mirror: [[A1, A2]]",
    ],
)
def test_what_can_be_drawn_is_not_refused(said: str) -> None:
    network = nv.compile_text(f"{GROUPS}  {said}\n")
    assert network.refusal() is None
    assert network.layout().positions


def test_an_arrangement_over_instances_and_one_within_them_do_not_contradict() -> None:
    text = LEGS.replace("    conn", "    layout: {arrange: {S: row}}\n    conn") + "  arrange: {left.S: row}\n"
    network = nv.compile_text(text)
    assert network.refusal() is None
    assert network.layout().positions


def test_an_engine_that_the_caller_names_is_no_fault_of_the_spec() -> None:
    for said in ("engine: circular", "direction: up"):
        network = nv.compile_text(f"{GROUPS}  {said}\n")
        with pytest.raises(LayoutRefusalError) as caught:
            network.layout("nobody")
        assert caught.value.code == "unknown-engine"
        assert caught.value.diagnostic is None


def test_what_an_included_module_says_is_marked_in_its_file(tmp_path: Path) -> None:
    legs, head = "modules:\n  leg:\n    neurons: {K: {count: 3, bias: 1}}\n", "neurovis: 1\n"
    (tmp_path / "legs.yaml").write_text(f"{head}{legs}    layout: {{arrange: {{K: row, K2: row}}}}\n", encoding="utf-8")
    spec = tmp_path / "spec.yaml"
    spec.write_text(f"{head}name: two\ninclude: [legs.yaml]\ninstances: {{l: {{module: leg}}}}\n", encoding="utf-8")
    with pytest.raises(LayoutRefusalError) as caught:
        nv.compile(spec).layout()
    found = caught.value.diagnostic
    assert found is not None
    assert (Path(found.span.file).name, found.span.line, found.span.column) == ("legs.yaml", 5, 32)
    assert found.span.file in caught.value.sources


def test_an_editor_is_told_as_validate_tells_it() -> None:
    found = check(marked(f"{GROUPS}  engine: circular\n  align: [[A1, B]]¦\n")[0])
    assert [(item.code, item.span.line) for item in found.findings] == [("layout-align-unsupported", 9)]
    assert found.network is not None
