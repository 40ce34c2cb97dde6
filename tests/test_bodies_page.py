"""docs/bodies.md: its examples are checked, run, and do what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis

PAGE = (Path(__file__).parents[1] / "docs" / "bodies.md").read_text(encoding="utf-8")
FILES = re.findall(r"^`(\S+)`\n\n```\w+\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
WHOLE = re.findall(r"^```yaml\n(neurovis: 1\n.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
(PYTHON,) = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files of the page."""
    for name, content in FILES:
        (tmp_path / name).write_text(content, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_its_specs_are_sound_and_do_not_fall(folder: Path) -> None:
    assert len(WHOLE) == 2
    for text in WHOLE:
        network = nv.compile_text(text, folder=folder)
        assert network.warnings == ()
        assert np.abs(network.run()["O"]).max() < 10


def test_inspect_shows_what_the_page_shows(folder: Path) -> None:
    shown = CliRunner().invoke(neurovis, ["inspect", "pendulum.yaml"]).stdout
    (console,) = re.findall(r"^\$ neurovis inspect .*?\n(.*?)^\$ ", PAGE, re.MULTILINE | re.DOTALL)
    assert console.strip() in shown


def test_its_python_runs(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(PYTHON, "bodies.md", "exec"), {})
    lean = float(re.findall(r"it leans by (-?[\d.]+) rad", capsys.readouterr().out)[0])
    assert abs(lean) < 0.01
