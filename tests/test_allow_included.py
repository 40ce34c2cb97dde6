"""``# neurovis: allow CODE`` in included files: it silences there, and one that silences nothing is warned of there."""

from __future__ import annotations

from pathlib import Path

import neurovis_spec as nv

LEGS = """neurovis: 1
include: [deep.yaml]
modules:
  leg:
    parameters:
      spare: 1{spare}
    neurons:
      K: {count: 2, bias: 1}{group}
"""
SPEC = """neurovis: 1
name: x
include: [library/legs.yaml]
instances: {left: {module: leg, count: 3}}
outputs: {o: left.K}
"""


def warned(folder: Path, deep: str = "", **comments: str) -> list[tuple[str, int, str, str]]:
    (folder / "library").mkdir(exist_ok=True)
    given = {"spare": "", "group": "", **{name: f"  # neurovis: allow {code}" for name, code in comments.items()}}
    text = LEGS.replace("{spare}", given["spare"]).replace("{group}", given["group"])
    (folder / "library" / "legs.yaml").write_text(text)
    (folder / "library" / "deep.yaml").write_text(f"neurovis: 1\n{deep}")
    (folder / "spec.yaml").write_text(SPEC)
    found = nv.compile(folder / "spec.yaml").warnings
    return [(Path(item.span.file).name, item.span.line, item.code, item.message) for item in found]


def test_a_warning_in_an_included_file_is_silenced_where_it_stands(tmp_path: Path) -> None:
    assert [item[:3] for item in warned(tmp_path)] == [("legs.yaml", 6, "unused-parameter")]
    assert warned(tmp_path, spare="unused-parameter") == []


def test_what_silences_nothing_is_warned_of_in_the_included_file(tmp_path: Path) -> None:
    found = warned(tmp_path, spare="unused-parameter", group="idle-neuron", deep="# neurovis: allow\n")
    assert found == [
        ("deep.yaml", 2, "useless-allow", "this comment allows nothing"),
        ("legs.yaml", 8, "useless-allow", "there is no warning 'idle-neuron' on this line"),
    ]
    assert warned(tmp_path, spare="unused-parameter", group="useless-allow, idle-neuron") == []


def test_a_comment_of_the_spec_silences_nothing_in_the_included_file(tmp_path: Path) -> None:
    warned(tmp_path)
    (tmp_path / "spec.yaml").write_text(SPEC.replace("outputs:", "# neurovis: allow unused-parameter\noutputs:"))
    found = [(Path(item.span.file).name, item.code) for item in nv.compile(tmp_path / "spec.yaml").warnings]
    assert sorted(found) == [("legs.yaml", "unused-parameter"), ("spec.yaml", "useless-allow")]
