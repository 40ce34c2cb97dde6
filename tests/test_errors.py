"""Every defective spec of tests/errors is answered at the right place, with the right code, and in words that help.

The expected findings stand in the specs, beside the offending lines: ``# error: LINE:COLUMN CODE  WORDS``; the words
must occur in the message or the hint.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import neurovis_spec as nv
from neurovis_spec.diagnostics import Diagnostic

FOLDER = Path(__file__).parent / "errors"
SPECS = sorted(FOLDER.glob("*.yaml"))
EXPECTED = re.compile(r"# error: (\d+):(\d+) ([\w-]+)(?:  (.*?))?(?=  # error|$)", re.MULTILINE)


def findings(path: Path) -> tuple[Diagnostic, ...]:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile(path)
    return tuple(found for found in caught.value.diagnostics if found.severity == "error")


def test_there_are_many() -> None:
    assert len(SPECS) >= 100


@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.stem)
def test_finding(path: Path) -> None:
    expected = EXPECTED.findall(path.read_text(encoding="utf-8"))
    assert expected, "a spec of this folder says what is wrong with it"
    found = findings(path)
    assert [(d.span.line, d.span.column, d.code) for d in found] == [
        (int(line), int(column), code) for line, column, code, _ in expected
    ]
    for diagnostic, (_, _, _, words) in zip(found, expected, strict=True):
        assert words.strip() in f"{diagnostic.message} {diagnostic.hint or ''}"
