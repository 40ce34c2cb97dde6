"""Findings as other programs read them: JSON, workflow commands of GitHub Actions, SARIF 2.1.0 (OASIS, 2020).

In: diagnostics. Out: one text. In all of them columns count code points, as everywhere here.

- *JSON*: an array of objects.
- *GitHub*, which shows them beside the lines of a change:
  ``::error file=…,line=…,col=…,endColumn=…,title=CODE::MESSAGE``.
- *SARIF*, which code scanners and editors read: a log with one run, whose rules are the codes that occur, with what the
  catalogue says of them.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import PurePath
from typing import TYPE_CHECKING, Final
from urllib.parse import quote

from neurovis_spec.diagnostics import Diagnostic, printable
from neurovis_spec.version import __version__

if TYPE_CHECKING:
    from neurovis_spec.codes import Code

SCHEMA: Final = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
_DATA = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_PROPERTY = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A", ":": "%3A", ",": "%2C"})


def to_json(diagnostics: Iterable[Diagnostic]) -> str:
    """Findings as a JSON array of objects; lines and columns count from 1, ``hint`` may be null."""
    written = json.dumps([_record(diagnostic) for diagnostic in diagnostics], indent=2)
    return written.replace("\x7f", "\\u007f")  # the one control character that JSON leaves as it is


def _record(diagnostic: Diagnostic) -> dict[str, str | int | None]:
    span = diagnostic.span
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        "message": diagnostic.message,
        "file": span.file,
        "line": span.line,
        "column": span.column,
        "end_line": span.end_line,
        "end_column": span.end_column,
        "hint": diagnostic.hint,
    }


def to_github(diagnostics: Iterable[Diagnostic]) -> str:
    """A line for each finding; empty without one.

    The end column is the one behind the last character. A finding over several lines has no columns: a runner would
    throw them away, with a complaint.
    """
    return "\n".join(_command(diagnostic) for diagnostic in diagnostics)


def _command(diagnostic: Diagnostic) -> str:
    span = diagnostic.span
    place: dict[str, str | int] = {"file": span.file, "line": span.line}
    if span.end_line > span.line:
        place |= {"endLine": span.end_line}
    else:
        place |= {"col": span.column, "endColumn": max(span.end_column, span.column)}
    place["title"] = diagnostic.code
    properties = ",".join(f"{key}={_property(value)}" for key, value in place.items())
    message = printable(diagnostic.message)
    if diagnostic.hint is not None:
        message += f"\nhelp: {printable(diagnostic.hint)}"
    return f"::{diagnostic.severity} {properties}::{message.translate(_DATA)}"


def _property(value: str | int) -> str:
    return printable(str(value)).translate(_PROPERTY)


def to_sarif(diagnostics: Iterable[Diagnostic]) -> str:
    """The log of one run. A run without findings has no results, which means: all is well."""
    from neurovis_spec.codes import catalogue  # only here: the others need no PyYAML

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
