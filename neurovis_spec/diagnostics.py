"""Findings: where they are, what they say, how several are collected, and how people are shown them.

In: facts that a stage noticed (a code, a place, a sentence). Out: an ordered tuple of Diagnostics, a SpecError that
holds them, or their text. Nothing is raised at the first mistake: a stage goes on and collects. Nothing from the
author's files reaches a terminal raw: what could move its cursor, change its colours or reorder its text is shown as an
escape. What other programs read is in ``neurovis_spec.findings_formats``.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Collection, Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Final, Literal, NamedTuple, TypeAlias

Severity = Literal["error", "warning"]
#: A help line; where it takes a while to find, what finds it.
Hint: TypeAlias = "str | Callable[[], str | None] | None"
#: Errors after which no help line is looked for, and no misspelt name understood: nobody reads them.
MOST_HINTS = 100

_TAB: Final = 4
_WIDEST: Final = 100  # columns of a source line that are shown
_BEFORE: Final = 60  # of them before the place, in a longer line
_LONGEST_MESSAGE: Final = 1000
_LINE_END: Final = re.compile("\r\n|\n|\r")
_ESCAPED_CATEGORIES: Final = frozenset({"Cc", "Cs", "Zl", "Zp", "Cn", "Co"})
_INVISIBLE: Final = re.compile("[\u061c\u200b\u200e\u200f\u202a-\u202e\u2060-\u206f\ufeff\U000e0000-\U000e007f]")


class Span(NamedTuple):
    """A stretch of a file. Lines and columns count from 1, columns in code points; the end is exclusive."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int

    def within(self, start: int, end: int) -> Span:
        """The part from ``start`` to ``end`` (0-based, exclusive) of a span that lies on one line."""
        return Span(self.file, self.line, self.column + start, self.line, self.column + max(end, start + 1))

    def seen_from(self, here: Span) -> str:
        """Where it is, in a sentence about another place: its line, or its column on the same line."""
        return f"column {self.column}" if self.line == here.line else f"line {self.line}"


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding: a stable code, a sentence in the author's words, its place and a suggestion, if any."""

    code: str
    message: str
    span: Span
    severity: Severity = "error"
    hint: str | None = None


class Home(NamedTuple):
    """Where names are declared: under the keys ``parts`` (``layout.boxes`` is one key within another) of the mapping to
    which the path ``within`` leads from the top of a file."""

    within: tuple[str, ...]
    parts: tuple[str, ...]


class Undeclared(NamedTuple):
    """A name that is used, and where its declaration should stand."""

    name: str
    home: Home


#: What tells findings apart: the stretch, the code, and what its reporter says.
Mark: TypeAlias = "tuple[Span, str, Hashable]"


class SpecError(Exception):
    """The input is invalid. ``diagnostics`` holds every finding, sorted by place; ``sources`` the texts read."""

    def __init__(self, diagnostics: Iterable[Diagnostic], sources: Mapping[str, str] | None = None) -> None:
        self.diagnostics: tuple[Diagnostic, ...] = tuple(diagnostics)
        self.sources: Mapping[str, str] = dict(sources or {})
        super().__init__("\n".join(headline(d) for d in self.diagnostics))

    def _render_traceback_(self) -> list[str]:
        """What a notebook shows: the findings with their lines, as the command line does, and no traceback."""
        return [show_text(self.diagnostics, self.sources)]


@dataclass(slots=True)
class Findings:
    """Collects findings while the stages go on; ``sources`` maps each file read to its text.

    A stretch of the text is invalid for one reason, which is the first that is found: what later stages make of it is a
    follow-up. So findings merge by their place: a module, which is checked in each of its instances, is told of once.
    """

    sources: dict[str, str] = field(default_factory=dict)
    #: the files that an author names, as far as they were looked for, with what was found in them by looking
    files: dict[Path, str] = field(default_factory=dict)
    _told: dict[Mark, Diagnostic] = field(default_factory=dict)
    #: the names that findings miss
    _undeclared: dict[Mark, Undeclared] = field(default_factory=dict)
    _errors: int = 0
    #: the code of the first error about each stretch
    _first: dict[Span, str] = field(default_factory=dict)
    _unread: set[Span] = field(default_factory=set)

    def error(
        self,
        code: str,
        span: Span,
        message: str,
        hint: Hint = None,
        *,
        key: Hashable = None,
        undeclared: Undeclared | None = None,
    ) -> None:
        """Report a mistake. ``key``: a stretch may have several mistakes, and this is what tells them apart, such as a
        row of a data file that the stretch names. ``undeclared`` is the name that is missing, if that is the
        mistake."""
        if callable(hint):
            hint = None if self.many else hint()
        self._add(Diagnostic(code, message, span, "error", hint), key)
        if undeclared is not None:
            self._undeclared.setdefault((span, code, key), undeclared)

    def warning(self, code: str, span: Span, message: str, hint: str | None = None) -> None:
        """Note something legal that is surely not meant."""
        self._add(Diagnostic(code, message, span, "warning", hint), None)

    def _add(self, item: Diagnostic, key: Hashable) -> None:
        if item.severity == "error":
            self._errors += 1
            self._first.setdefault(item.span, item.code)
        if item.span not in self._unread:
            self._told.setdefault((item.span, item.code, key), item)

    def unread(self, span: Span) -> None:
        """What stands there could not be read, for a reason that is reported: all else that is found there follows."""
        self._unread.add(span)

    def take(self, others: Findings) -> None:
        """Report what others have noted."""
        self.files |= {path: found or self.files.get(path, "") for path, found in others.files.items()}
        self._unread |= others._unread
        for (_, _, key), item in others._told.items():
            self._add(item, key)
        self._undeclared = others._undeclared | self._undeclared

    def missing(self) -> dict[Mark, tuple[Diagnostic, Undeclared]]:
        """The findings that miss a name, by place."""
        there = {mark: self._told[mark] for mark in self._undeclared if mark in self._told and self._counts(mark)}
        return {mark: (there[mark], self._undeclared[mark]) for mark in sorted(there, key=lambda mark: mark[0])}

    def told(self) -> dict[Mark, Diagnostic]:
        """The errors that are no follow-up of another one."""
        return {mark: item for mark, item in self._told.items() if item.severity == "error" and self._counts(mark)}

    def fold(self, marks: Iterable[Mark], into: Diagnostic) -> None:
        """Tell one finding in the place of several."""
        for mark in marks:
            del self._told[mark]
        self._told[into.span, into.code, None] = into
        self._first[into.span] = into.code

    def drop(self, unwanted: Callable[[Diagnostic], bool]) -> None:
        """Forget warnings that the author has allowed; errors stay."""
        self._told = {mark: item for mark, item in self._told.items() if item.severity == "error" or not unwanted(item)}

    def retell(self, word: Callable[[Diagnostic], Diagnostic]) -> None:
        """Tell each finding in other words."""
        self._told = {mark: word(item) for mark, item in self._told.items()}

    @property
    def failed(self) -> bool:
        """Whether there is an error among the findings."""
        return self._errors > 0

    @property
    def errors(self) -> int:
        """How many errors there are so far: a stage compares it before and after."""
        return self._errors

    @property
    def many(self) -> bool:
        """Whether there are so many errors that unknown names are no longer compared with known ones."""
        return self._errors >= MOST_HINTS

    def is_invalid(self, span: Span) -> bool:
        """Whether there is an error about exactly this stretch of a text."""
        return span in self._first or span in self._unread

    def sorted(self) -> tuple[Diagnostic, ...]:
        """All findings by place, those of one place in the order in which they were found."""
        told = (item for mark, item in self._told.items() if self._counts(mark))
        return tuple(sorted(told, key=lambda item: (item.span, item.severity)))

    def _counts(self, mark: Mark) -> bool:
        """Whether a finding is no follow-up of another one."""
        span, code, key = mark
        return key is not None or self._first.get(span, code) == code

    def check(self) -> None:
        """Raise SpecError if there is an error."""
        if self.failed:
            raise SpecError(self.sorted(), self.sources)


def headline(diagnostic: Diagnostic) -> str:
    """The first line of a finding: ``FILE:LINE:COLUMN: error[CODE]: MESSAGE``."""
    span = diagnostic.span
    place = f"{span.file}:{span.line}:{span.column}"
    return f"{place}: {diagnostic.severity}[{diagnostic.code}]: {diagnostic.message}"


def shorten(text: str, most: int = 40) -> str:
    """A piece of the author's text in a finding: the beginning of a long one."""
    return text if len(text) <= most else text[: most - 3] + "…"


def listed(names: Collection[str]) -> str:
    """Known names in a help line: the first few, as far as they fit.

    >>> listed(["kernel", "sigmoid"]), listed(["x" * 300, *(f"C{number}" for number in range(100))])[37:]
    ('kernel, sigmoid', '…, C0, C1, C2, C3, C4, C5, C6, C7, C8, C9, C10, …')
    """
    words = [shorten(name) for name in islice(names, 12)]
    while len(words) > 1 and sum(map(len, words)) > 240:
        words.pop()
    return ", ".join(words) + (", …" if len(words) < len(names) else "")


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
