"""What ``-o`` may name: never a file that the command reads, whatever links lead to it."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from neurovis_spec.cli.commands import neurovis

SPEC = """\
neurovis: 1
name: small
time: {steps: 5}
include: [parts/more.yaml]
layout: {file: small.layout.yaml}
inputs: {w: {}, table: {file: d/in.csv}}
neurons: {A: {count: 2, input: w}, B: {count: 2, activation: mine}}
connections: {A -> B: {matrix: {file: d/m.csv}}}
"""
LAYOUT = "layout small.yaml -o small.layout.yaml"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A spec, what it reads, and what is made of it."""
    path = tmp_path_factory.mktemp("made")
    (path / "small.yaml").write_text(SPEC)
    for name in ("d", "parts"):
        (path / name).mkdir()
    (path / "d/m.csv").write_text("1,2\n3,4\n")
    (path / "d/in.csv").write_text("1\n2\n")
    (path / "parts/more.yaml").write_text("neurovis: 1\nactivations: {mine: {value: x + 1}}\n")
    np.save(path / "w.npy", np.ones((3, 1)))
    (path / "w.csv").write_text("1\n2\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(path)
        for arguments in (LAYOUT, "run small.yaml -o x.npz", "run small.yaml -o x.csv"):
            assert call(arguments).exit_code == 0
    return path


@pytest.fixture
def folder(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of it, as the working folder."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(arguments: str) -> Result:
    return CliRunner().invoke(neurovis, arguments.split())


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


#: a command whose output, ``OUT``, is the file before it; and what is said of it
INPUTS = [
    ("small.yaml", "layout small.yaml -o OUT", "the spec itself"),
    ("small.yaml", "run small.yaml -o OUT", "the spec itself"),
    ("small.yaml", "render small.yaml -o OUT", "the spec itself"),
    ("small.yaml", "animate small.yaml -o OUT", "the spec itself"),
    ("small.yaml", "layout small.yaml --update OUT", "the spec itself"),
    ("d/m.csv", "run small.yaml -o OUT", "a file that the spec reads ('d/m.csv')"),
    ("d/in.csv", "run small.yaml -o OUT", "a file that the spec reads ('d/in.csv')"),
    ("d/in.csv", "render small.yaml -o OUT", "a file that the spec reads ('d/in.csv')"),
    ("parts/more.yaml", "layout small.yaml -o OUT", "a file that the spec reads ('parts/more.yaml')"),
    ("parts/more.yaml", "layout small.yaml --update OUT", "a file that the spec reads ('parts/more.yaml')"),
    ("small.layout.yaml", "animate small.yaml -o OUT", "the layout file of the spec"),
    ("w.csv", "run small.yaml --input w=w.csv -o OUT", "the file of the input 'w'"),
    ("x.npz", "run small.yaml --from x.npz -o OUT", "the recording that the run goes on from"),
    ("x.csv", "run small.yaml --from x.csv -o OUT", "the recording that the run goes on from"),
    ("x.npz", "render small.yaml --recording x.npz -o OUT", "the recording that is drawn"),
    ("x.npz", "animate small.yaml --recording x.npz -o OUT", "the recording that is drawn"),
]


@pytest.mark.parametrize("link", ["", "symbolic", "folder", "hard"])
@pytest.mark.parametrize(("name", "arguments", "words"), INPUTS)
def test_no_command_overwrites_what_it_reads(folder: Path, name: str, arguments: str, words: str, link: str) -> None:
    named = folder / name
    output = name
    if link == "symbolic":
        output = f"link{named.suffix}"
        Path(output).symlink_to(named)
    elif link == "folder":
        Path("away").symlink_to(folder)
        output = f"away/{name}"
    elif link == "hard":
        output = f"hard{named.suffix}"
        os.link(named, output)
    before = contents(folder)
    result = call(arguments.replace("OUT", output))
    assert result.exit_code == 2
    option = "--update" if "--update" in arguments else "-o"
    assert f"{option} {output} is {words}, which would be lost: name another file" in " ".join(result.output.split())
    assert contents(folder) == before


def test_the_spec_may_be_read_from_a_link_and_not_be_written_through_it(folder: Path) -> None:
    Path("other.yaml").symlink_to("small.yaml")
    assert call("layout other.yaml -o small.yaml").exit_code == 2
    assert Path("small.yaml").read_text() == SPEC


def test_the_layout_file_that_a_spec_names_is_what_layout_writes(folder: Path) -> None:
    for arguments in (LAYOUT, "layout small.yaml --update small.layout.yaml"):
        assert call(arguments).exit_code == 0
    Path("small.layout.yaml").unlink()
    assert call(LAYOUT).exit_code == 0
    assert Path("small.layout.yaml").exists()


def test_a_part_that_is_read_is_not_cleared_by_the_run_that_reads_it(folder: Path) -> None:
    Path(".x.csv.part").write_bytes(Path("x.csv").read_bytes())
    result = call("run small.yaml --from .x.csv.part -o x.csv")
    assert result.exit_code == 2
    assert "the recording that the run goes on from" in result.output
    assert Path(".x.csv.part").exists()


@pytest.mark.parametrize("command", ["run", "render", "animate"])
def test_a_dash_is_no_file(folder: Path, command: str) -> None:
    result = call(f"{command} small.yaml -o -")
    assert result.exit_code == 2
    assert "-o takes a file: what is written does not go to standard output ('-')" in result.output
    assert not Path("-").exists()


@pytest.mark.parametrize("command", ["export small.yaml --to c", "ros export small.yaml"])
def test_a_dash_is_no_folder(folder: Path, command: str) -> None:
    result = call(f"{command} -o -")
    assert result.exit_code == 2
    assert "-o takes a folder: what is written does not go to standard output ('-')" in result.output
    assert not Path("-").exists()


def test_a_dash_for_a_layout_is_standard_output(folder: Path) -> None:
    assert call("layout small.yaml -o -").output == call("layout small.yaml").output
    assert call("layout small.yaml --update -").exit_code == 2
    assert not Path("-").exists()
