"""Frames that lie on each other because pins or a mirror ask for it: drawn so, and warned of where the spec asks."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis

LEGS = """\
neurovis: 1
name: legs
modules: {leg: {neurons: {A: {bias: 1}, B: {}}, connections: {A -> B: 1}}}
instances: {left: {module: leg}, right: {module: leg}}
neurons: {C: {count: 2, bias: 1}, D: {}}
connections: {C -> left.A: 1, C -> right.A: 1, left.B + right.B -> D: 1}
layout: LAYOUT
"""
EACH_OTHER = "the frames of 'left' and 'right' lie on each other"
NEITHER = "the frames of 'q' and 'r' lie on each other; therefore neither is drawn"
IN_LEFT = "'D' stands in the frame of 'left', which is not drawn therefore"
#: C1 stands in the box, and the frame of the right leg may reach into it, too: one of the two is told.
IN_BOX = "'q'"
CASES = [
    ("{positions: {left: [0, 0], right: [2, 0]}}", "", ""),
    ("{positions: {left: [0, 0], right: [1, 0]}}", EACH_OTHER, "[0, 0]"),
    ("{positions: {left.A: [0, 0], right.B: [1, 1]}}", EACH_OTHER, "[0, 0]"),
    ("{positions: {left: [0, 0], D: [0.61, 1]}}", IN_LEFT, "[0.61, 1]"),
    ("{positions: {left: [0, 0], D: [0.66, 1]}}", "", ""),
    ("{mirror: [[left, right]], boxes: {q: [left, C2]}}", IN_BOX, "[left, C2]"),
    ("{boxes: {q: [C], r: [D]}, positions: {C1: [0, 0], C2: [4, 0], D: [2, 0.75]}}", NEITHER, "[0, 0]"),
    ("{engine: grid, positions: {left.A: [0, 0], left.B: [0, 2], right.A: [1, 0]}}", EACH_OTHER, "[0, 0]"),
]


def marked(text: str, found: nv.Diagnostic) -> str:
    return text.split("\n")[found.span.line - 1][found.span.column - 1 : found.span.end_column - 1]


@pytest.mark.parametrize(("layout", "message", "at"), CASES)
def test_what_lies_on_each_other_is_warned_of_where_the_spec_asks_for_it(layout: str, message: str, at: str) -> None:
    text = LEGS.replace("LAYOUT", layout)
    found = nv.compile_text(text).layout().warnings
    if not at:
        assert found == ()
        return
    assert {(warning.code, warning.severity) for warning in found} == {("frames-overlap", "warning")}
    assert marked(text, found[0]) == at
    assert message in found[0].message


def test_a_pin_of_a_module_is_marked_there() -> None:
    pins = "layout: {positions: {S: [0, 0], k.A: [0.61, 0], k.B: [0.61, 2]}}"
    text = f"""\
neurovis: 1
name: legs
modules:
  knee: {{neurons: {{A: {{bias: 1}}, B: {{}}}}, connections: {{A -> B: 1}}}}
  leg: {{neurons: {{S: {{bias: 1}}}}, instances: {{k: {{module: knee}}}}, connections: {{S -> k.A: 1}}, {pins}}}
instances: {{left: {{module: leg}}}}
"""
    (found,) = nv.compile_text(text).layout().warnings
    assert found.message == "'left.S' stands in the frame of 'left.k', which is not drawn therefore"
    assert marked(text, found) in ("[0, 0]", "[0.61, 0]", "[0.61, 2]")


def test_commands_that_lay_out_show_it_and_a_comment_allows_it(tmp_path: Path) -> None:
    spec, picture = tmp_path / "legs.yaml", tmp_path / "legs.svg"
    text = LEGS.replace("LAYOUT", "{positions: {left: [0, 0], right: [1, 0]}}")
    commands = (
        ["layout", str(spec)],
        ["render", str(spec), "-o", str(picture), "--step", "1"],
        ["render", str(spec), "-o", str(picture), "--step", "1", "--engine", "layered"],
        ["animate", str(spec), "-o", str(picture), "--steps", "2"],
    )
    for line, expected in ((text, True), (f"{text.rstrip()}  # neurovis: allow frames-overlap\n", False)):
        spec.write_text(line, encoding="utf-8")
        for command in commands:
            result = CliRunner().invoke(neurovis, command)
            assert result.exit_code == 0
            assert ("warning[frames-overlap]" in result.stderr) == expected
            assert expected or result.stderr == ""
        assert CliRunner().invoke(neurovis, ["validate", "--strict", str(spec)]).exit_code == 0
