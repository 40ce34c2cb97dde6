"""Neurons put by hand: what stands where, and what is written into the spec or its layout file."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest
from examples import SPECS, shipped

import neurovis_spec as nv
from neurovis_spec.layout.model import LayoutRefusalError
from neurovis_spec.live.commands import Into
from neurovis_spec.live.pins import STEP, Compile, Placed, SavingError, placed, saving

MIRRORED = """neurovis: 1
name: m   # two halves
neurons:
  L: {count: 3, activation: tanh, bias: 1}
  R: {count: 3, activation: tanh, bias: 1}
  O: {activation: tanh}
connections:
  L + R -> O: 1
layout:
  mirror: [[L, R]]   # alike
"""


def compiler(spec: Path) -> Compile:
    return lambda text: nv.compile_text(text, file=str(spec), folder=spec.parent)


def away(shown: Placed, neuron: str, by: tuple[float, float]) -> Placed:
    x, y = shown.layout.positions[neuron]
    return shown.put(neuron, (x + by[0], y + by[1]))


def moved(before: Placed, after: Placed) -> set[str]:
    return {name for name, point in after.layout.positions.items() if point != before.layout.positions[name]}


def test_the_rest_stays_and_what_runs_there_is_routed_anew() -> None:
    begun = placed(nv.compile(SPECS / "cpg_rbf.yaml"))
    put = away(begun, "O", (1.28, 0.2))
    assert moved(begun, put) == {"O"}
    assert all(coordinate % STEP == 0 for coordinate in put.layout.positions["O"])
    assert math.dist(put.layout.positions["O"], begun.layout.positions["O"]) == pytest.approx(
        math.hypot(1.28, 0.2), abs=0.1
    )
    others = {name for name, route in put.layout.routes.items() if route != begun.layout.routes[name]}
    assert others == {f"K{number} -> O" for number in range(1, 9)}
    assert put.moved == ("O",)


def test_a_mirror_image_follows() -> None:
    begun = placed(nv.compile_text(MIRRORED))
    put = away(begun, "L2", (-0.25, 0.5))
    assert moved(begun, put) >= {"L2", "R2"}
    (left, y), (right, other) = put.layout.positions["L2"], put.layout.positions["R2"]
    assert (y, left + right) == (other, sum(begun.layout.positions[name][0] for name in ("L2", "R2")))
    assert away(put, "R2", (0.5, 0)).moved == ("R2",), "of two images the last that was put counts"


def test_what_is_drawn_alike_stays_alike() -> None:
    begun = placed(shipped(SPECS / "hexapod" / "hexapod.yaml"))
    put = away(begun, "left1.BC", (0.7, 0.2))
    assert moved(begun, put) == {f"{side}{number}.BC" for side in ("left", "right") for number in (1, 2, 3)}


def test_a_pin_of_the_spec_can_be_moved() -> None:
    begun = placed(nv.compile_text(MIRRORED + "  positions: {O: [5, 5], R1: [8, 0]}\n"))
    put = away(away(begun, "O", (0.5, 0)), "L1", (0, -0.5))
    assert put.layout.positions["O"] == (5.5, 5)
    assert put.layout.positions["L1"][1] == put.layout.positions["R1"][1] == -0.5


def test_what_cannot_be_is_refused() -> None:
    begun = placed(nv.compile_text(MIRRORED + "  positions: {O: [5, 5], L1: [0, 0]}\n"))
    with pytest.raises(LayoutRefusalError, match="closer than"):
        begun.put("O", (0.1, 0.1))
    with pytest.raises(KeyError):
        begun.put("X", (0, 0))


def test_an_edited_network_keeps_what_was_put() -> None:
    put = away(placed(nv.compile_text(MIRRORED)), "O", (2, 0))
    edited = nv.compile_text(MIRRORED.replace("name: m", "name: n").replace("L: {count: 3", "L: {count: 3, initial: 1"))
    carried = put.carried(edited)
    assert carried.layout.positions["O"] == put.layout.positions["O"]
    gone = put.carried(nv.compile_text("neurovis: 1\nname: z\nneurons: {A: {activation: tanh}}\n"))
    assert gone.moved == ()


@pytest.mark.parametrize("into", ["spec", "file"])
@pytest.mark.parametrize("text", [MIRRORED, MIRRORED + "  positions: {O: [5, 5], R1: [8, 0]}\n"])
def test_what_is_saved_is_drawn_as_it_was_shown(into: Into, text: str, tmp_path: Path) -> None:
    spec = tmp_path / "m.yaml"
    spec.write_text(text)
    put = away(away(placed(nv.compile(spec)), "O", (0.5, 0.25)), "L1", (0, -0.5))
    found = saving(put, spec, compiler(spec), into)
    assert spec.read_text() == text, "nothing is written before it is said"
    assert found.diff.startswith("--- a/m")
    found.write()
    again = nv.compile(spec)
    assert again.warnings == ()
    assert again.layout().positions == put.layout.positions
    assert "# two halves" in spec.read_text()
    assert "# alike" in spec.read_text()
    assert (tmp_path / "m.layout.yaml").exists() == (into == "file")
    assert saving(Placed(again, None, put.layout), spec, compiler(spec), into).diff == ""


def test_a_layout_file_that_the_spec_names_is_written(tmp_path: Path) -> None:
    shutil.copytree(SPECS, tmp_path / "specs")
    spec = tmp_path / "specs/cpg_rbf.yaml"
    text = spec.read_text().replace("direction: down}", "direction: down, file: here.yaml}")
    spec.write_text(text)
    nv.compile(spec).layout().save(spec.parent / "here.yaml")
    put = away(placed(nv.compile(spec)), "O", (1, 0))
    found = saving(put, spec, compiler(spec), "file")
    assert [file.path.name for file in found.files] == ["here.yaml"]
    assert "-  O: [3.5, 4]\n+  O: [4.5, 4]\n" in found.diff
    found.write()
    assert nv.compile(spec).layout().value == put.layout
    assert spec.read_text() == text


def test_pins_alone_are_enough_where_the_rest_is_remembered(tmp_path: Path) -> None:
    shutil.copytree(SPECS, tmp_path / "specs")
    spec = tmp_path / "specs/cpg_rbf.yaml"
    spec.write_text(spec.read_text().replace("direction: down}", "direction: down, file: here.yaml}"))
    nv.compile(spec).layout().save(spec.parent / "here.yaml")
    put = away(placed(nv.compile(spec)), "O", (1, 0))
    added = [line for line in saving(put, spec, compiler(spec), "spec").diff.split("\n") if line.startswith("+    ")]
    assert added == ["+    O: [4.5, 4]"]


def test_what_has_changed_meanwhile_is_not_written_over(tmp_path: Path) -> None:
    spec = tmp_path / "m.yaml"
    spec.write_text(MIRRORED)
    put = away(placed(nv.compile(spec)), "O", (1, 0))
    found = saving(put, spec, compiler(spec), "file")
    (tmp_path / "m.layout.yaml").write_text("mine")
    with pytest.raises(SavingError, match="changed meanwhile"):
        found.write()
    assert (tmp_path / "m.layout.yaml").read_text() == "mine"
    assert spec.read_text() == MIRRORED
    with pytest.raises(SavingError, match=r"m\.layout\.yaml is there already"):
        saving(put, spec, compiler(spec), "file")
    spec.write_text(MIRRORED.replace("L + R -> O: 1", "L -> O: 1"))
    with pytest.raises(SavingError, match="another network"):
        saving(put, spec, compiler(spec), "spec")
    spec.unlink()
    with pytest.raises(SavingError, match="no longer there"):
        saving(put, spec, compiler(spec), "spec")
