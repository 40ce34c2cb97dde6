"""The gallery shows every example, and what is committed is what is drawn."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent.parent
PAGE = (HERE / "docs" / "gallery.md").read_text(encoding="utf-8")
SHOWN = re.findall(r"!\[[^\]]+\]\(pictures/(\w+)\.svg\)", PAGE)


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
    assert {path.stem for path in (HERE / "docs" / "pictures").glob("*.svg")} == set(SHOWN)
    for name in SHOWN:
        assert (HERE / "docs" / "pictures" / f"{name}.svg").stat().st_size <= 180 * 1024


def test_what_is_committed_is_what_is_drawn(tmp_path: Path) -> None:
    """Of the example whose values are exact, so the same on every machine."""
    command = [sys.executable, str(HERE / "gallery.py"), "mlp", "--to", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    assert [path.name for path in tmp_path.iterdir()] == ["mlp.svg"]
    assert (tmp_path / "mlp.svg").read_bytes() == (HERE / "docs" / "pictures" / "mlp.svg").read_bytes()
