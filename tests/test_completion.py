"""What a shell completes: files, names of this program, names in the spec on the line; Bash runs its script here."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from neurovis_spec.cli.commands import neurovis
from neurovis_spec.codes import catalogue

SPEC = """\
neurovis: 1
name: walk
parameters: {gain: 1, gap: 2, phi: 0.1}
inputs: {touch: {size: 1}, load: {size: 1}}
neurons: {A: {input: touch}}
"""
NEUROVIS = '#!/bin/sh\nexec {python} -m neurovis_spec "$@"\n'
#: Words are COMP_WORDS as Bash has broken the line; what readline would be told to do is printed instead.
PRESS_TAB = """\
eval "$(_NEUROVIS_COMPLETE=bash_source neurovis)"
compopt() {{ printf 'compopt %s %s\n' "$@"; }}
COMP_WORDS=({words})
COMP_CWORD=$(( ${{#COMP_WORDS[@]}} - 1 ))
_neurovis_completion neurovis
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a spec and a table, and ``neurovis`` on the path."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "walk.yaml").write_text(SPEC, encoding="utf-8")
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "touch.csv").write_text("1\n", encoding="utf-8")
    program = tmp_path / ".bin" / "neurovis"
    program.parent.mkdir()
    program.write_text(NEUROVIS.format(python=sys.executable), encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent), prepend=":")
    return tmp_path


def offered(*words: str) -> list[tuple[str, str]]:
    """Kind and value of what is offered for the last of these words, as click gives it to any shell."""
    *before, last = words
    return [
        (item.type, item.value) for item in ShellComplete(neurovis, {}, "neurovis", "_X").get_completions(before, last)
    ]


def bash(*words: str) -> list[str]:
    """What the script that the README names gives Bash for the last of these words."""
    quoted = " ".join(f"'{word}'" for word in ("neurovis", *words))
    done = subprocess.run(["bash", "--norc", "-c", PRESS_TAB.format(words=quoted)], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.split("\n")[:-1]


FILES = [
    *(
        ("validate", ""),
        ("validate", "walk.yaml", "da"),
        ("fmt", "wa"),
        ("inspect", "wa"),
        ("layout", "wa"),
        ("run", "wa"),
        ("sweep", "wa"),
    ),
    *(("render", "wa"), ("animate", "wa"), ("render", "walk.yaml", "-o", ""), ("run", "walk.yaml", "--output", "x")),
    *(("run", "walk.yaml", "--from", "x"), ("render", "walk.yaml", "--recording", "x")),
    *(("animate", "walk.yaml", "--recording", "x"), ("layout", "walk.yaml", "--update", "x")),
]


@pytest.mark.parametrize("words", FILES, ids=" ".join)
def test_paths_are_left_to_the_shell(words: tuple[str, ...]) -> None:
    assert offered(*words) == [("file", words[-1])]


def test_a_root_is_a_folder() -> None:
    assert offered("validate", "--root", "d") == [("dir", "d")]


@pytest.mark.parametrize(
    ("words", "some"),
    [
        (("explain", "delay-0"), {"delay-0-cycle"}),
        (("explain", "li"), {"list"}),
        (("docs", "izh"), {"izhikevich"}),
        (("docs", "connections.del"), {"connections.delay"}),
        (("new", "walk", "--from", "cpg"), {"cpg_rbf"}),
        (("run", "--backend", ""), {"list", "numpy", "reference"}),
        (("layout", "x.yaml", "--engine", "la"), {"large", "layered"}),
        (("render", "x.yaml", "--theme", "pa"), {"paper"}),
        (("animate", "x.yaml", "--view", "ra"), {"raster"}),
        (("validate", "--format", "s"), {"sarif"}),
        (("inspect", "--format", "j"), {"json"}),
    ],
)
def test_names_of_this_program_are_offered(words: tuple[str, ...], some: set[str]) -> None:
    found = offered(*words)
    assert {kind for kind, _ in found} == {"plain"}
    assert some <= {value for _, value in found}
    assert all(value.startswith(words[-1]) for _, value in found)


def test_every_code_is_offered() -> None:
    assert [value for _, value in offered("explain", "")] == ["list", *catalogue()]


def test_parameters_and_inputs_of_the_spec_on_the_line_are_offered(folder: Path) -> None:
    assert offered("run", "walk.yaml", "--set", "ga") == [("plain", "gain="), ("plain", "gap=")]
    assert offered("render", "walk.yaml", "--set", "") == [("plain", f"{name}=") for name in ("gain", "gap", "phi")]
    assert offered("sweep", "walk.yaml", "--over", "ga") == [("plain", "gain="), ("plain", "gap=")]
    assert offered("sweep", "walk.yaml", "--over", "s") == [("plain", "seed=")]
    assert offered("run", "walk.yaml", "--input", "t") == [("plain", "touch=")]
    assert offered("run", "walk.yaml", "--input", "touch=data/t") == [("plain", "touch=data/touch.csv")]
    assert offered("run", "walk.yaml", "--input", "touch=") == [("plain", "touch=data/"), ("plain", "touch=walk.yaml")]


@pytest.mark.parametrize("text", ["", "a: [", "parameters: 3\n", "\0", "neurovis: 1\n"])
def test_a_spec_without_parameters_or_none_at_all_offers_nothing(folder: Path, text: str) -> None:
    (folder / "walk.yaml").write_text(text, encoding="utf-8")
    for spec in ("walk.yaml", "none.yaml", "data", "-"):
        assert offered("run", spec, "--set", "") == []
    assert offered("run", "--set", "") == []


def test_a_spec_too_large_to_be_read_in_a_moment_is_not(folder: Path) -> None:
    (folder / "walk.yaml").write_text(SPEC + "#" * (1 << 20), encoding="utf-8")
    assert offered("run", "walk.yaml", "--set", "") == []


def test_bash_completes_files_where_a_spec_is_wanted(folder: Path) -> None:
    assert bash("validate", "wa") == ["compopt -o default", ""]


def test_bash_completes_names(folder: Path) -> None:
    assert bash("val") == ["validate"]
    assert bash("explain", "delay-0-c") == ["delay-0-cycle"]


def test_bash_puts_no_blank_behind_a_sign_that_a_value_follows(folder: Path) -> None:
    assert bash("run", "walk.yaml", "--set", "gai") == ["compopt -o nospace", "gain="]


@pytest.mark.parametrize("typed", [("touch", "=", "da"), ("touch", "=")])
def test_bash_breaks_words_at_signs_and_files_are_completed_behind_them(folder: Path, typed: tuple[str, ...]) -> None:
    assert bash("run", "walk.yaml", "--input", *typed) == ["compopt -o default", ""]


def test_bash_completes_the_value_of_an_option_behind_its_sign(folder: Path) -> None:
    assert bash("validate", "--format", "=", "js") == ["json"]
