"""Every command that compiles a spec takes ``--root`` and ``--limit``: what validates can be used."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from neurovis_spec.cli.commands import neurovis

SPEC = (
    "neurovis: 1\nname: x\nneurons: {A: {bias: 1}, B: {count: 2}}\nconnections: {A -> B: {matrix: {file: ../w.csv}}}\n"
)
COMMANDS = {
    "validate": ("validate",),
    "inspect": ("inspect",),
    "layout": ("layout",),
    "run": ("run", "--steps", "2"),
    "render": ("render", "--step", "1", "-o", "OUT.svg"),
    "animate": ("animate", "--steps", "2", "-o", "OUT.svg"),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_root_and_limit(command: str, tmp_path: Path) -> None:
    (tmp_path / "specs").mkdir()
    (tmp_path / "w.csv").write_text("1,2\n")
    spec = tmp_path / "specs" / "x.yaml"
    spec.write_text(SPEC)
    name, *rest = (word.replace("OUT", str(tmp_path / "out")) for word in COMMANDS[command])

    def run(*more: str) -> tuple[int, str]:
        done = CliRunner().invoke(neurovis, [name, str(spec), *rest, *more])
        return done.exit_code, done.stderr

    assert run("--root", str(tmp_path)) == (0, "")
    status, said = run()
    assert (status, "path-outside" in said) == (1, True)
    status, said = run("--root", str(tmp_path), "--limit", "1")
    assert (status, "too-many" in said) == (1, True)
