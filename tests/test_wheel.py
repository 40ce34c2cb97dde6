"""The wheel: built, installed in an environment of its own, and used from there.

Nothing is downloaded: the build runs without isolation with the hatchling that is installed here, and the new
environment reads the dependencies from the site-packages of this one (through a ``.pth`` file), but not NeuroVis,
which comes from the wheel.
"""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from collections.abc import Sequence
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def call(command: Sequence[str | Path], folder: Path) -> str:
    """Run a program away from the checkout, and without a Python path that leads into it."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=clean)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from the checkout."""
    folder = tmp_path_factory.mktemp("dist")
    call([sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT], folder)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def programs(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of programs of an environment in which the wheel is installed."""
    home = tmp_path_factory.mktemp("environment")
    venv.create(home, with_pip=False, symlinks=True)
    programs = home / ("Scripts" if os.name == "nt" else "bin")
    python = programs / Path(sys.executable).name
    site = Path(call([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], home).strip())
    pip: list[str | Path] = [sys.executable, "-m", "pip", "--python", python, "install"]
    call([*pip, "--quiet", "--no-deps", "--no-index", "--disable-pip-version-check", wheel], home)
    # It comes after the wheel's own files on the path, so that these win. Editable installs there are not followed,
    # since a .pth file in a folder that another one names is not read.
    (site / "zz_dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return programs


def test_the_wheel_holds_the_packages_the_library_and_the_examples(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    expected = {
        "neurovis_spec/pipeline.py",
        "neurovis_spec/analysis/catalogue.yaml",
        "neurovis_spec/analysis/page.html",
        "neurovis_spec/live/page.html",
        "neurovis_layouts/layered/engine.py",
        "neurovis_renderers/svg.py",
        "neurovis_renderers/fonts/DejaVuSans.ttf",
        "neurovis_renderers/fonts/DejaVuSans-Bold.ttf",
        "neurovis_renderers/fonts/LICENSE",
        "neurovis_spec/library/activations.yaml",
        "neurovis_spec/manual/examples.yaml",
        "neurovis_spec/manual/networks.yaml",
        "neurovis_spec/cli/starter.yaml",
        "neurovis_spec/examples/cpg_rbf.yaml",
        "neurovis_spec/examples/data/centres.csv",
        "neurovis_spec/examples/hexapod/hexapod.yaml",
        "neurovis_spec/examples/walk/hexapod.xml",
        "neurovis_spec/examples/hexapod/modules/leg.yaml",
        "neurovis_spec/examples/hexapod/data/obstacle.csv",
    }
    assert expected <= names
    tops = {name.split("/")[0] for name in names if ".dist-info" not in name}
    assert tops == {"neurovis_spec", "neurovis_layouts", "neurovis_renderers", "neurovis_bodies"}
    assert not [name for name in names if "test" in name.lower() or "__pycache__" in name]


def test_the_package_comes_from_the_wheel(programs: Path, tmp_path: Path) -> None:
    code = "import neurovis_spec, neurovis_layouts, neurovis_renderers as r; print(neurovis_spec.__file__, r.__file__)"
    paths = call([programs / "python", "-c", code], tmp_path).split()
    assert all(Path(path).is_relative_to(programs.parent) for path in paths)


def test_an_installed_neurovis_draws_its_own_example(programs: Path, tmp_path: Path) -> None:
    neurovis = programs / "neurovis"
    assert call([neurovis, "new", "walk", "--from", "cpg_rbf"], tmp_path).splitlines()[0] == "walk.yaml"
    assert (tmp_path / "data" / "centres.csv").is_file()
    call([neurovis, "render", "walk.yaml", "--step", "160", "-o", "walk.svg"], tmp_path)
    picture = (tmp_path / "walk.svg").read_text(encoding="utf-8")
    assert picture.count("data-neuron=") == 12
    assert picture.count("data-connection=") == 28
    call([neurovis, "render", "walk.yaml", "--step", "160", "-o", "walk.png"], tmp_path)
    assert (tmp_path / "walk.png").read_bytes().startswith(b"\x89PNG")


def test_an_installed_neurovis_copies_an_example_with_what_it_includes(programs: Path, tmp_path: Path) -> None:
    call([programs / "neurovis", "new", "walk", "--from", "hexapod"], tmp_path)
    assert "ok (148 neurons, 204 connections)" in call(
        [programs / "neurovis", "validate", Path("walk", "walk.yaml")], tmp_path
    )


def test_an_installed_neurovis_writes_a_starter(programs: Path, tmp_path: Path) -> None:
    call([programs / "neurovis", "new", "first"], tmp_path)
    assert call([programs / "neurovis", "validate", "first.yaml"], tmp_path).startswith("first.yaml: ok")
