"""Findings: where they are, what they say, and how several are collected.

In: facts that a stage noticed (a code, a place, a sentence). Out: an ordered tuple of Diagnostics, or a
SpecError that holds them. Nothing is raised at the first mistake: a stage goes on and collects. How findings
are shown (text, JSON) is in ``neurovis_spec.findings``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

Severity = Literal["error", "warning"]
#: A help line; where it takes a while to find, what finds it.
Hint: TypeAlias = "str | Callable[[], str | None] | None"
#: Errors after which no help line is looked for, and no misspelt name understood: nobody reads them.
MOST_HINTS = 100


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
        from neurovis_spec.findings import show_text

        return [show_text(self.diagnostics, self.sources)]


@dataclass(slots=True)
class Findings:
    """Collects findings while the stages go on; ``sources`` maps each file read to its text.

    A stretch of the text is invalid for one reason, which is the first that is found: what later stages make of it is a
    follow-up. So findings merge by their place: a module, which is checked in each of its instances, is told of once.
    """

    sources: dict[str, str] = field(default_factory=dict)
    #: the files that an author names, as far as they were looked for
    files: set[Path] = field(default_factory=set)
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
        self.files |= others.files
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


def nearest(name: str, known: Iterable[str], most: int = 3) -> tuple[str, ...]:
    """The known names that are most like ``name``, best first, up to six; none that is too far off.

    >>> nearest("kerel", ["kernel", "sigmoid", "keel"]), nearest("tahn", ["tanh", "sigmoid", "atan"])
    (('kernel', 'keel'), ('tanh',))
    """
    from neurovis_spec.likeness import alike  # only here: most specs have no mistake
    from neurovis_spec.lookalikes import in_ascii

    names, seen = tuple(dict.fromkeys(known)), in_ascii(name)
    return (seen,) if seen != name and seen in names else alike(seen, names)[:most]


def meant(name: str, known: Iterable[str]) -> str | None:
    """The known name that a misspelt one can only be meant for: it is one slip away, two in a word of five letters or
    more, or in one of four of which three are kept, and no other is as near. None where that is not sure.

    >>> meant("wieght", ["weight", "centre"]), meant("modles", ["models", "modules"]), meant("note", ["noise"])
    ('weight', None, None)
    >>> meant("fomr", ["from", "to"]), meant("size", ["file"])
    ('from', None)
    """
    close = nearest(name, known, 6)  # few: a distance takes a while to find
    if not name.isascii():
        from neurovis_spec.lookalikes import in_ascii

        name = in_ascii(name)
    most = 1 if len(name) < 4 else 2
    far = sorted((slips(name, other), other) for other in close if abs(len(name) - len(other)) <= most)
    if not far or far[0][0] > most or (len(far) > 1 and far[1][0] == far[0][0]):
        return None
    right = far[0][1]
    if len(name) == 4 and far[0][0] == 2:
        kept = (Counter(name.casefold()) & Counter(right.casefold())).total()
        return right if len(right) == 4 and kept >= 3 else None
    return right


def slips(one: str, other: str) -> int:
    """How many slips lead from one word to the other: a letter too few, too many or wrong, two changed over (the
    optimal string alignment distance; case is not counted).

    >>> slips("wieght", "weight"), slips("sensr", "sensor"), slips("kitten", "sitting")
    (1, 1, 3)
    """
    one, other = one.casefold(), other.casefold()
    before, last = list[int](), list(range(len(other) + 1))
    for i, letter in enumerate(one, 1):
        row = [i]
        for j, wanted in enumerate(other, 1):
            cost = min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (letter != wanted))
            if i > 1 and j > 1 and letter == other[j - 2] and one[i - 2] == wanted:
                cost = min(cost, before[j - 2] + 1)
            row.append(cost)
        before, last = last, row
    return last[-1]


def suggest(name: str, known: Iterable[str], what: str = "known") -> str | None:
    """A help line for an unknown name: the nearest known ones, else all of a short list.

    >>> suggest("tahn", ["tanh", "sigmoid"])
    "did you mean 'tanh'?"
    """
    names = tuple(dict.fromkeys(known))
    close = nearest(name, names)
    if close:
        return did_you_mean(close)
    if not names:
        return None
    return f"{what}: {listed(names)}"


def did_you_mean(names: Iterable[str]) -> str:
    """The help line that offers these names."""
    return "did you mean " + " or ".join(f"'{name}'" for name in names) + "?"
