"""Every defective spec of tests/errors is answered at the right place, with the right code, and in words that help.

The expected findings stand in the specs, beside the offending lines: ``# error: LINE:COLUMN CODE  WORDS``, or
``# warning: …``; the words must occur in the message or the hint. What they include lies in ``include``, with the
findings of its own. Specs in ``layout`` compile, and a layout engine refuses them: ``# refused: CODE  WORDS``, or
warns of what came out: ``# warned: CODE  WORDS``. The files in ``layout_files`` are layout files.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import neurovis_spec as nv
from neurovis_spec.codes import VALIDATE, catalogue
from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.layout.file import parse
from neurovis_spec.layout.model import LayoutRefusalError

FOLDER = Path(__file__).parent / "errors"
SPECS = sorted(FOLDER.glob("*.yaml"))
INCLUDED = sorted((FOLDER / "include").glob("*.yaml"))
REFUSED = sorted((FOLDER / "layout").glob("*.yaml"))
LAYOUT_FILES = sorted((FOLDER / "layout_files").glob("*.yaml"))
EXPECTED = re.compile(r"# (error|warning): (\d+):(\d+) ([\w-]+)(?:  (.*?))?(?=\s+# error|\s+# warning|$)", re.MULTILINE)
REFUSAL = re.compile(r"# (refused|warned): ([\w-]+)  (.*)")


def findings(path: Path) -> tuple[tuple[Diagnostic, ...], set[str]]:
    """The findings of a spec, and the files that were read."""
    try:
        network = nv.compile(path)
    except nv.SpecError as error:
        return error.diagnostics, set(error.sources)
    return network.warnings, set(network.sources)


def text_of(path: Path) -> str:
    """The text, also of a file that is not UTF-8."""
    return path.read_text(encoding="utf-8", errors="replace")


def hold(found: tuple[Diagnostic, ...], files: set[str]) -> None:
    """The findings are those that the files expect."""
    expected = [(file, *item) for file in sorted(files) for item in EXPECTED.findall(text_of(FOLDER / file))]
    assert expected, "a spec of this folder says what is wrong with it"
    assert [(str(FOLDER / d.span.file), d.severity, d.span.line, d.span.column, d.code) for d in found] == [
        (str(FOLDER / file), severity, int(line), int(column), code)
        for file, severity, line, column, code, _ in expected
    ]
    for diagnostic, (*_, words) in zip(found, expected, strict=True):
        assert words.strip() in f"{diagnostic.message} {diagnostic.hint or ''}"


def test_there_are_many() -> None:
    assert len(SPECS) >= 240


def test_every_code_is_covered() -> None:
    covered = {
        code for path in (*SPECS, *INCLUDED, *LAYOUT_FILES) for _, _, _, code, _ in EXPECTED.findall(text_of(path))
    }
    covered |= {code for path in REFUSED for _, code, _ in REFUSAL.findall(text_of(path))}
    wanted = {code.name for code in catalogue().values() if code.rare is None}
    elsewhere = {name for name in wanted if catalogue()[name].command.startswith("neurovis run")}
    assert wanted - covered - elsewhere == set()
    assert all(catalogue()[name].command != VALIDATE for name in elsewhere)


@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.stem)
def test_finding(path: Path) -> None:
    found, files = findings(path)
    assert str(path) in files
    hold(found, files)


@pytest.mark.parametrize("path", LAYOUT_FILES, ids=lambda path: path.stem)
def test_layout_file(path: Path) -> None:
    found = Findings()
    assert parse(text_of(path), f"layout_files/{path.name}", found) is None
    hold(found.sorted(), {f"layout_files/{path.name}"})


@pytest.mark.parametrize("path", REFUSED, ids=lambda path: path.stem)
def test_refusal(path: Path) -> None:
    ((how, code, words),) = REFUSAL.findall(text_of(path))
    network = nv.compile(path)
    if how == "warned":
        (warning,) = network.layout().warnings
        assert warning.code == code
        assert words in f"{warning.message} {warning.hint or ''}"
        return
    with pytest.raises(LayoutRefusalError) as caught:
        network.layout()
    assert caught.value.code == code
    assert words in f"{caught.value} {caught.value.hint or ''}"
