"""The gallery shows every example, in every theme, and what is committed is what is drawn."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import gallery
from neurovis_spec.runtime.backend import ENVIRONMENT_VARIABLE

HERE = Path(__file__).parent.parent
PICTURES = HERE / "docs" / "pictures"
THEMED = gallery.themed()
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
    small = {*(theirs for _, theirs, _ in BESIDE), *(picture.name for picture in THEMED)}
    there = {path.relative_to(PICTURES).with_suffix("").as_posix() for path in PICTURES.rglob("*.svg")}
    assert there == {*SHOWN, *small}
    for name in there:
        assert (PICTURES / f"{name}.svg").stat().st_size <= (120 if name in small else 180) * 1024


def test_every_example_is_shown_in_every_theme() -> None:
    page = (HERE / "docs" / "themes.md").read_text(encoding="utf-8")
    assert page == gallery.themes_page()
    rows = [re.findall(r"!\[(\w+)\]\(pictures/([\w/]+)\.svg\)", line) for line in page.splitlines() if "![" in line]
    for row in rows:
        name = row[0][1]
        others = [(theme, f"themes/{name}_{theme}") for theme in ("dark", "print", "paper")]
        assert row == [("default", name), *others]
    assert {SPECS[row[0][1]] for row in rows} == set(SPECS.values())


def test_every_network_stands_beside_dots_drawing_of_it() -> None:
    assert {SPECS[ours] for ours, _, _ in BESIDE} == set(SPECS.values())
    assert [theirs for _, theirs, _ in BESIDE] == [f"{ours}_dot" for ours, _, _ in BESIDE]


@pytest.mark.parametrize(("name", "row"), [(ours, row) for ours, _, row in BESIDE], ids=lambda part: part.split()[0])
def test_the_measures_on_the_page_are_those_of_the_layout(name: str, row: str) -> None:
    found = gallery.compiled(SPECS[name]).drawn().metrics()
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


def test_the_words_on_the_page_are_those_of_the_gallery() -> None:
    assert "\n\n".join([*gallery.shown(), ""]) == FIRST


@pytest.mark.parametrize("picture", THEMED, ids=lambda picture: picture.name)
def test_in_other_themes_only_colours_are_others(picture: gallery.Picture) -> None:
    """So these need not be drawn here to know that they are not old, but for some, which show the colours."""

    def told(name: str) -> str:
        return gallery.untold((PICTURES / f"{name}.svg").read_text(encoding="utf-8"))

    own = [re.sub(r"#[0-9a-f]{6}\b", "#", told(name)) for name in (picture.name, picture.name[7:].rpartition("_")[0])]
    assert own[0] == own[1]


#: Runs that the reference takes long for.
LONG = ("balance", "reward", "stick_insect/stick_insect", "worm/worm")
DRAWN = [*gallery.PICTURES, *(one for one in THEMED if one.spec in ("cpg_rbf", "hebbian", "mlp"))]


def stale(picture: gallery.Picture, path: Path) -> bool:
    """Whether what is committed is not what is drawn, but for the last digits of numbers, which differ from machine to
    machine."""
    gallery.draw(picture, path)
    committed = PICTURES / f"{picture.name}.svg"
    return not gallery.alike(path.read_text(encoding="utf-8"), committed.read_text(encoding="utf-8"))


@pytest.mark.parametrize("picture", [one for one in DRAWN if one.spec not in LONG], ids=lambda picture: picture.name)
def test_what_is_committed_is_what_is_drawn(
    picture: gallery.Picture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The gallery is drawn from runs in C, whose bits the reference has without a compiler; NumPy's part from them
    within thousands of steps of learning."""
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, "reference")
    assert not stale(picture, tmp_path / "drawn.svg")


@pytest.mark.compiler
@pytest.mark.parametrize("picture", [one for one in DRAWN if one.spec in LONG], ids=lambda picture: picture.name)
def test_what_is_committed_of_long_runs_is_what_is_drawn(
    picture: gallery.Picture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, "c")
    assert not stale(picture, tmp_path / "drawn.svg")


@pytest.mark.dot
@pytest.mark.parametrize("name", gallery.BESIDE)
def test_what_is_committed_of_dot_is_what_is_drawn(name: str, tmp_path: Path) -> None:
    """Our part of it: another dot draws otherwise."""
    (picture,) = (picture for picture in gallery.PICTURES if picture.name == name)
    gallery.draw_as_dot(picture, tmp_path / "drawn.svg")
    colours = [
        sorted(re.findall(r'fill="(#\w+)"', path.read_text(encoding="utf-8")))
        for path in (tmp_path / "drawn.svg", PICTURES / f"{name}_dot.svg")
    ]
    assert colours[0] == colours[1]


@pytest.mark.parametrize("change", ["stroke-width", "theme", "words"])
def test_a_stale_picture_is_noticed(change: str, tmp_path: Path) -> None:
    (picture,) = (picture for picture in THEMED if picture.name == "themes/mlp_dark")
    committed = (PICTURES / f"{picture.name}.svg").read_text(encoding="utf-8")
    stale = {
        "stroke-width": committed.replace('stroke-width="2.2222222222222223"', 'stroke-width="2.3"', 1),
        "theme": (PICTURES / "themes" / "mlp_print.svg").read_text(encoding="utf-8"),
        "words": committed.replace("Exclusive or", "Exclusive", 1),
    }[change]
    assert stale != committed
    assert not gallery.alike(stale, committed)
    (tmp_path / "mlp.svg").write_text(stale, encoding="utf-8")
    gallery.draw(picture, tmp_path / "mlp.svg")
    assert (tmp_path / "mlp.svg").read_text(encoding="utf-8") == committed
