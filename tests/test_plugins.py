"""A plug-in that is broken says so, and does not stand in the way of the others."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from plugged import call, plugged

from neurovis_spec import plugins
from neurovis_spec.likeness import nearest

SPEC = "neurovis: 1\nname: x\nneurons: {A: {}}\n"


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    info = tmp_path / "broken-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n", encoding="utf-8")
    points = "".join(
        f"[neurovis.{group}]\na_broken = broken_plugin:Thing\n"
        for group in ("layouts", "renderers", "backends", "formats")
    )
    (info / "entry_points.txt").write_text(points, encoding="utf-8")
    (tmp_path / "broken_plugin.py").write_text("import a_library_that_nobody_has\n", encoding="utf-8")
    (tmp_path / "x.yaml").write_text(SPEC, encoding="utf-8")
    with plugged(tmp_path, monkeypatch):
        yield tmp_path


@pytest.mark.parametrize(
    "arguments", [("layout", "x.yaml", "--engine", "a_broken"), ("run", "x.yaml", "--backend", "a_broken")]
)
def test_asked_for_it_is_an_error_that_names_it(site: Path, arguments: tuple[str, ...]) -> None:
    done = call(*arguments)
    assert done.exit_code == 1
    assert "a_broken" in done.stderr
    assert "a_library_that_nobody_has" in done.stderr


@pytest.mark.parametrize("arguments", [("render", "x.yaml", "-o", "x.svg"), ("run", "x.yaml", "-o", "x.npz")])
def test_not_asked_for_it_is_passed_over(site: Path, arguments: tuple[str, ...]) -> None:
    done = call(*arguments)
    assert done.exit_code == 0
    assert (site / arguments[-1]).stat().st_size > 0


def test_in_the_list_of_backends_it_is_unavailable(site: Path) -> None:
    done = call("run", "--backend", "list")
    assert done.exit_code == 0
    assert "a_broken unavailable: " in done.stdout
    assert "numpy available" in done.stdout


def test_a_name_that_nobody_registered() -> None:
    with pytest.raises(KeyError):
        plugins.load(plugins.BACKENDS, "none_of_this_name")


def test_far_off_names_are_not_offered_beside_a_near_one() -> None:
    assert nearest("gausian", ["gaussian", "sin", "cos"]) == ("gaussian",)
    assert nearest("tahn", ["tanh", "sigmoid"]) == ("tanh",)
    assert nearest("xyz", ["tanh", "sigmoid"]) == ()
