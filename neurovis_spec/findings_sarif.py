"""Findings as SARIF 2.1.0 (OASIS, 2020), which code scanners and editors read.

In: diagnostics. Out: the text of one log with one run. Its rules are the codes that occur, with what the catalogue says
of them; columns count code points, as everywhere here.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import PurePath
from typing import Final
from urllib.parse import quote

from neurovis_spec.codes import Code, catalogue
from neurovis_spec.diagnostics import Diagnostic
from neurovis_spec.version import __version__

SCHEMA: Final = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"


def to_sarif(diagnostics: Iterable[Diagnostic]) -> str:
    """The log of one run. A run without findings has no results, which means: all is well."""
    found = tuple(diagnostics)
    codes = sorted({diagnostic.code for diagnostic in found})
    driver = {
        "name": "NeuroVis",
        "version": __version__,
        "rules": [_rule(code, catalogue().get(code)) for code in codes],
    }
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(diagnostic, codes.index(diagnostic.code)) for diagnostic in found],
    }
    written = json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2)
    return written.replace("\x7f", "\\u007f")


def _rule(name: str, code: Code | None) -> dict[str, object]:
    """A code as a rule; one that the catalogue lacks is a plug-in's own."""
    if code is None:
        return {"id": name}
    return {
        "id": name,
        "shortDescription": {"text": code.meaning},
        "help": {"text": code.text(), "markdown": code.markdown()},
        "defaultConfiguration": {"level": code.severity},
    }


def _result(diagnostic: Diagnostic, rule: int) -> dict[str, object]:
    span = diagnostic.span
    hint = "" if diagnostic.hint is None else f"\nhelp: {diagnostic.hint}"
    region = {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }
    location = {"artifactLocation": {"uri": _uri(span.file)}, "region": region}
    return {
        "ruleId": diagnostic.code,
        "ruleIndex": rule,
        "level": diagnostic.severity,
        "message": {"text": diagnostic.message + hint},
        "locations": [{"physicalLocation": location}],
    }


def _uri(file: str) -> str:
    """A path as a URI: relative ones stay relative, to the folder where the program was called."""
    path = PurePath(file)
    if path.is_absolute():
        return "file://" + quote(path.as_posix(), errors="replace")
    return quote(path.as_posix(), errors="replace")
