"""Findings as workflow commands of GitHub Actions, which shows them beside the lines of a change.

In: diagnostics. Out: lines ``::error file=…,line=…,col=…,endColumn=…,title=CODE::MESSAGE``.
"""

from __future__ import annotations

from collections.abc import Iterable

from neurovis_spec.diagnostics import Diagnostic
from neurovis_spec.findings import printable

_DATA = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_PROPERTY = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A", ":": "%3A", ",": "%2C"})


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
