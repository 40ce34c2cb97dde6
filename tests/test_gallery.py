"""The gallery shows every example, and what is committed is what is drawn."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import neurovis_spec as nv

HERE = Path(__file__).parent.parent
PAGE = (HERE / "docs" / "gallery.md").read_text(encoding="utf-8")
FIRST, SECOND = PAGE.split("## Beside dot")
SHOWN = re.findall(r"!\[[^\]]+\]\(pictures/(\w+)\.svg\)", FIRST)
#: our picture and dot's of the same network, and our row of the table beneath
BESIDE = re.findall(
    r"!\[by NeuroVis\]\(pictures/(\w+)\.svg\) \| !\[by dot\]\(pictures/(\w+)\.svg\)"
    r".*?^\| NeuroVis \| ([\d.,| ]+) \|$",
    SECOND,
    re.DOTALL | re.MULTILINE,
)
SPECS = {name: spec for spec, name in re.findall(r"`neurovis render specs/([\w/]+)\.yaml .* -o (\w+)\.svg`", FIRST)}


def test_every_example_is_shown_with_the_command_that_draws_it() -> None:
    folder = HERE / "specs"
    specs = {
        path.relative_to(folder).with_suffix("").as_posix()
        for path in (*folder.glob("*.yaml"), *folder.glob("*/*.yaml"))
    }
    assert {Path(spec).name for spec in specs} <= set(SHOWN)
    assert {"cpg_rbf_dark", "cpg_rbf_learning"} <= set(SHOWN)
    drawn = re.findall(r"`neurovis (?:render|animate) specs/([\w/]+)\.yaml .* -o (\w+)\.svg`", PAGE)
    assert [name for _, name in drawn] == SHOWN
    assert {spec for spec, _ in drawn} == specs


def test_every_picture_is_there_and_small() -> None:
    by_dot = {theirs for _, theirs, _ in BESIDE}
    assert {path.stem for path in (HERE / "docs" / "pictures").glob("*.svg")} == {*SHOWN, *by_dot}
    for name in (*SHOWN, *by_dot):
        assert (HERE / "docs" / "pictures" / f"{name}.svg").stat().st_size <= (100 if name in by_dot else 180) * 1024


def test_every_network_stands_beside_dots_drawing_of_it() -> None:
    assert {SPECS[ours] for ours, _, _ in BESIDE} == set(SPECS.values())
    assert [theirs for _, theirs, _ in BESIDE] == [f"{ours}_dot" for ours, _, _ in BESIDE]


@pytest.mark.parametrize(("name", "row"), [(ours, row) for ours, _, row in BESIDE], ids=lambda part: part.split()[0])
def test_the_measures_on_the_page_are_those_of_the_layout(name: str, row: str) -> None:
    found = nv.compile(HERE / "specs" / f"{SPECS[name]}.yaml").layout().metrics()
    crossings, over, overlaps, flow, area = (float(part.replace(",", "")) for part in row.split("|"))
    assert (crossings, over, overlaps) == (found["crossings"], found["edges_over_neurons"], found["overlaps"])
    assert (over, overlaps) == (0, 0)
    assert flow == pytest.approx(found["flow"], abs=0.006)
    assert area == pytest.approx(found["area"], abs=0.06)


@pytest.mark.dot
def test_dots_drawing_has_every_neuron_and_connection(tmp_path: Path) -> None:
    command = [sys.executable, str(HERE / "gallery.py"), "mlp_dot", "--to", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    drawn = (tmp_path / "mlp_dot.svg").read_text(encoding="utf-8")
    ours = (HERE / "docs" / "pictures" / "mlp.svg").read_text(encoding="utf-8")
    for shape in ("circle", "polygon"):
        assert drawn.count(f"<{shape} ") == ours.count(f"<{shape} ") > 0
    colours = [sorted(re.findall(r'<circle [^>]*fill="(#\w+)"', text)) for text in (drawn, ours)]
    assert colours[0] == colours[1]


def test_what_is_committed_is_what_is_drawn(tmp_path: Path) -> None:
    """Of the example whose values are exact, so the same on every machine."""
    command = [sys.executable, str(HERE / "gallery.py"), "mlp", "--to", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    assert [path.name for path in tmp_path.iterdir()] == ["mlp.svg"]
    assert (tmp_path / "mlp.svg").read_bytes() == (HERE / "docs" / "pictures" / "mlp.svg").read_bytes()
