"""Showing findings: as text for people, as JSON for programs.

In: diagnostics and the texts they are about. Out: a string. Nothing from the author's files reaches a terminal raw:
what could move its cursor, change its colours or reorder its text is shown as an escape.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from typing import Final

from neurovis_spec.diagnostics import Diagnostic, Span, headline

_TAB: Final = 4
_WIDEST: Final = 100  # columns of a source line that are shown
_BEFORE: Final = 60  # of them before the place, in a longer line
_LONGEST_MESSAGE: Final = 1000
_LINE_END: Final = re.compile("\r\n|\n|\r")
_ESCAPED_CATEGORIES: Final = frozenset({"Cc", "Cs", "Zl", "Zp", "Cn", "Co"})
_INVISIBLE: Final = re.compile("[\u061c\u200b\u200e\u200f\u202a-\u202e\u2060-\u206f\ufeff\U000e0000-\U000e007f]")


def show_text(diagnostics: Iterable[Diagnostic], sources: Mapping[str, str], most: int = 20) -> str:
    """Findings for a terminal: each with its place, the invalid line, carets under it and a help line.

    ``sources`` maps file names to texts; a finding about a file without a text is shown without the line. At most
    ``most`` are shown. The last line counts them all. Empty where there is nothing to show.
    """
    found = tuple(diagnostics)
    lines: dict[str, list[str]] = {}
    blocks: list[str] = []
    for diagnostic in found[:most]:
        file = diagnostic.span.file
        if file in sources and file not in lines:
            lines[file] = _LINE_END.split(sources[file])
        blocks.append(_block(diagnostic, lines.get(file)))
    if len(found) > most:
        blocks.append(f"… and {len(found) - most} more")
    if found:
        blocks.append(summary(found))
    return "\n\n".join(blocks)


def summary(diagnostics: Iterable[Diagnostic]) -> str:
    """How many errors and warnings there are, such as ``3 errors, 1 warning``."""
    found = tuple(diagnostics)
    errors = sum(diagnostic.severity == "error" for diagnostic in found)
    counts = (("error", errors), ("warning", len(found) - errors))
    return ", ".join(f"{count} {word}{'' if count == 1 else 's'}" for word, count in counts if count)


def to_json(diagnostics: Iterable[Diagnostic]) -> str:
    """Findings as a JSON array of objects; lines and columns count from 1, ``hint`` may be null."""
    import json

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


def printable(text: str) -> str:
    r"""A text with every character that is no harmless visible one written as an escape.

    >>> printable("a" + chr(27) + "[31m")
    'a\\x1b[31m'
    """
    return "".join(_shown(character) for character in text)


def _shown(character: str) -> str:
    harmful = unicodedata.category(character) in _ESCAPED_CATEGORIES or _INVISIBLE.match(character)
    return _escape(character) if harmful else character


def _escape(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def _block(diagnostic: Diagnostic, lines: list[str] | None) -> str:
    parts = [printable(_bounded(headline(diagnostic)))]
    if lines is not None and 1 <= diagnostic.span.line <= len(lines):
        parts += _excerpt(lines[diagnostic.span.line - 1], diagnostic.span)
    if diagnostic.hint is not None:
        parts.append("help: " + printable(_bounded(diagnostic.hint)))
    return "\n".join(parts)


def _bounded(text: str) -> str:
    return text if len(text) <= _LONGEST_MESSAGE else text[: _LONGEST_MESSAGE - 1] + "…"


def _excerpt(line: str, span: Span) -> list[str]:
    """The line with its number, and carets under the span's part in it."""
    start = min(span.column - 1, len(line))
    stop = len(line) if span.end_line > span.line else min(span.end_column - 1, len(line))
    # Only what may come into view is measured: a line can be as long as a file.
    first = max(0, start - 2 * _WIDEST)
    cells = [_cell(character) for character in line[first : start + 2 * _WIDEST]]
    start, stop = start - first, min(max(stop, start + 1) - first, len(cells))
    low, high = _window([width for _, width in cells], start)
    left = "…" if first + low > 0 else ""
    right = "…" if first + high < len(line) else ""
    shown = left + "".join(text for text, _ in cells[low:high]) + right
    before = len(left) + sum(width for _, width in cells[low:start])
    carets = max(1, sum(width for _, width in cells[start : min(stop, high)]))
    number = str(span.line)
    return [f" {number} | {shown}".rstrip(), f" {' ' * len(number)} | {' ' * before}{'^' * carets}"]


def _window(widths: list[int], start: int) -> tuple[int, int]:
    """The part of a line that is shown: all of a short one, else some columns before and behind the start."""
    low = 0
    if sum(widths) > _WIDEST:
        low, room = start, _BEFORE
        while low > 0 and room >= widths[low - 1]:
            low -= 1
            room -= widths[low]
        if sum(widths[:low]) <= 1:
            low = 0
    high, room = low, _WIDEST
    while high < len(widths) and room >= widths[high]:
        room -= widths[high]
        high += 1
    return low, high


def _cell(character: str) -> tuple[str, int]:
    """How a character of a source line is shown, and how many columns that takes."""
    if character == "\t":
        return " " * _TAB, _TAB
    shown = _shown(character)
    if shown != character:
        return shown, len(shown)
    if unicodedata.category(character) in ("Mn", "Me", "Cf"):
        return shown, 0
    return shown, 2 if unicodedata.east_asian_width(character) in ("W", "F") else 1
