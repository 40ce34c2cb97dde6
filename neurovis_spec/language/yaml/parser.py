"""The parser: a text becomes the tree that everything else is made from.

In: the text of a spec. Out: its root, values that know their places (``source``), whatever the text looks like. Between
them lie blanks, comments and punctuation alone: with the text itself beside it, the tree has lost nothing. What YAML or
the language does not allow is reported, and reading goes on behind it.

A syntax error costs the value of the innermost key or list item around it, up to the next line that is indented no
further; a ``partial`` tree keeps what there is of such a value. A bracket or a quote may close on a line that is
indented less; where reading it so ends in an error, it is read once more, up to the next line that is no part of it.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Final, NamedTuple

from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.yaml import faults, texts
from neurovis_spec.language.yaml.characters import Lines
from neurovis_spec.language.yaml.faults import Words
from neurovis_spec.language.yaml.packed import Packer, balance
from neurovis_spec.language.yaml.refusals import DEEPEST, ComposingStoppedError, Refusals
from neurovis_spec.language.yaml.scalars import NumberRangeError, resolve
from neurovis_spec.language.yaml.source import Entry, Mapping, Node, Scalar, ScalarValue, Sequence
from neurovis_spec.language.yaml.written_text import Written

_PACK_FROM: Final = 64
#: A longer key has to be announced by a question mark.
_LONGEST_KEY: Final = 1024

_END: Final = r"(?=[ \t\r\n]|\Z)"
_FIRST: Final = r"(?:[^\s\-?:,\[\]{}#&*!|>'\"%@`]|"
#: A text without quotes on one line, outside of brackets and within them: to a blank and #, or to a colon and a blank.
_TEXT: Final = r"(?:[^\s:]+|:(?=\S)|[ \t]+(?![\s#]|:\s|:\Z|\Z))"
_PLAIN: Final = re.compile(_FIRST + r"[-?:](?=\S))" + _TEXT + "*+", re.ASCII)
_MORE: Final = re.compile(_TEXT + "++", re.ASCII)
_FLOW_TEXT: Final = r"(?:[^\s:,\[\]{}]+|:(?![\s,\[\]{}]|\Z)|[ \t]+(?![\s#,\[\]{}]|:[\s,\[\]{}]|:\Z|\Z))"
_FLOW_PLAIN: Final = re.compile(_FIRST + r"-(?![\s,\[\]{}]|\Z))" + _FLOW_TEXT + "*+", re.ASCII)
#: What is behind a comma within brackets, and no key.
_CUT_OFF: Final = re.compile(
    rf"\s*,\s*{_FIRST}-(?![\s,\[\]{{}}]|\Z)){_FLOW_TEXT}*+(?![ \t]*:(?:[\s,\[\]{{}}]|\Z))", re.ASCII
)
_FLOW_MORE: Final = re.compile(_FLOW_TEXT + "++", re.ASCII)
_QUOTED: Final = {"'": re.compile(r"'(?:[^']|'')*+'"), '"': re.compile(r'"(?:[^"\\]|\\.)*+"', re.DOTALL)}
_HEADER: Final = re.compile(r"[|>](?:([-+])?([1-9])?|([1-9])([-+]))(?:[ \t]+(#[^\r\n]*)?)?(?=[\r\n]|\Z)")
_COLON: Final = re.compile(r"[ \t]*:" + _END)
_FLOW_COLON: Final = re.compile(r"[ \t]*:")
_PROPERTY: Final = re.compile(r"!<[^>\s]*>|![^\s,\[\]{}]*|[&*][A-Za-z0-9_-]+(?=[\s,\[\]{}:?%@`]|\Z)")
_REST: Final = re.compile(r"[ \t]*(#[^\r\n]*)?")
_BREAK: Final = re.compile(r"\r\n|\n|\r")
_BLANKS: Final = re.compile(" *")
_BLANK_LINE: Final = re.compile(r"[ \t]*(#[^\r\n]*)?(?:\r\n|\n|\r)")
_NEXT_TEXT: Final = re.compile(r"[ \t]*(?:\r\n|\n|\r)(?:[ \t]*(?:\r\n|\n|\r))*")
_DIRECTIVE: Final = re.compile(r"%YAML[ \t]+1\.2[ \t]*(#.*)?")
_TAB: Final = re.compile(r"(?<![^\r\n]) *\t")
_VISIBLE: Final = re.compile(r"[^\s]")
_MARKER: Final = re.compile(r"(?<![^\r\n])(?:---|\.\.\.)" + _END)
_TIGHT: Final = re.compile(r":[,\[\]{}]")
_TIGHT_COLON: Final = re.compile(r"[A-Za-z_][\w.]*:(?=\S)")
#: A line that has a key and a colon.
_KEYED: Final = re.compile(r":(?:\s|\Z)")
#: Where a value has begun within what looks like its key: without a blank before it, or without a colon.
_TOO_SOON: Final = re.compile(r":(?=[^ ])|[ \t]*:?[ \t]*[\[{]")
#: A list of texts and numbers that need no second look.
_SIMPLE_ROW: Final = re.compile(r"\[([^\[\]{}'\"#&*!|>%@`?:\r\n]*)\]")
#: A line of a list that is such a list.
_ROW_LINE: Final = re.compile(r"- +\[([^\[\]{}'\"#&*!|>%@`?:\r\n]*)\][ \t]*(?:\r\n|\n|\r)")
#: A line end, the blanks that begin the next line, and the rest of it.
_LINE: Final = re.compile(r"(?:\r\n|\n|\r)( *)[^\r\n]*")
#: A name, and a number or a short text.
_SIMPLE: Final = r"([A-Za-z_][\w.]*(?: (?:->|\+) [\w.]+)*) *: +((?:[A-Za-z0-9_.]|[-+](?![ \t\r\n,\[\]{}]))[\w.+*/^-]*)"
_SIMPLE_PAIR: Final = re.compile(_SIMPLE + r" *(?:, *|(?=\}))")
_FLOW_SIGNS: Final = frozenset(",[]{}")
_CLOSING: Final = {"[": "]", "{": "}"}


@cache
def _stretch(column: int) -> re.Pattern[str]:
    """The rest of a line, and the lines that belong to what stands in a column of it: those that are indented further,
    are blank, hold a comment alone or begin with a closing bracket."""
    deeper = f" {{{column + 1}}}"
    return re.compile(rf"[^\r\n]*(?:(?:\r\n|\n|\r)(?=[ \t]*(?:[#\r\n\]}}]|\Z)|{deeper})[^\r\n]*)*+(?:\r\n|\n|\r)?")


@cache
def _simple_lines(column: int) -> re.Pattern[str]:
    """A line of a block in a column that holds a name and a number or a short text, behind which neither goes on."""
    return re.compile(rf"{_SIMPLE} *(?:\r\n|\n|\r)( {{0,{column}}})(?=[^ \t\r\n#]|\Z)")


class _Key(NamedTuple):
    """What stands before a colon: its place, the key (None where it is refused), whether there is a colon, and whether
    a question mark announces it."""

    span: Span
    name: Scalar | None
    colon: bool = True
    announced: bool = False


class _UnsoundError(Exception):
    """A syntax error in a value that is read for the first time."""

    def __init__(self, words: Words, at: int) -> None:
        super().__init__(words.message)
        self.words = words
        self.at = at


class _Plain(NamedTuple):
    """A scalar without quotes, and where it begins and ends in the text."""

    begin: int
    end: int
    scalar: Scalar


class _Cursor(NamedTuple):
    """How far a text is read: the next character, its line, where that begins, and how much was noted so far."""

    at: int
    line: int
    start: int
    comments: int
    findings: int
    lost: int


class Parser:
    """Reads one text."""

    def __init__(self, text: str, file: str, *, partial: bool = False) -> None:
        self._text = text
        self._file = file
        self._lines = Lines(text)
        self._partial = partial
        self._refuse = Refusals()
        self._at = 0
        self._line = 1
        self._start = 0
        self._end = len(text)
        #: whether a syntax error ends the reading of a value, which is then read again
        self._trial = False
        #: whether there was one in the value that is being read
        self._broken = False
        #: how much had been found by then: what else is found in the same value may follow from it
        self._told = 0
        #: the scalar that was read last, where it is without quotes
        self._plain: _Plain | None = None
        #: where values stand that are lost to a syntax error
        self._lost: list[Span] = []
        #: whether it is known what every syntax error has cost
        self._whole = True
        #: Where comments begin.
        self.comments: list[int] = []

    def document(self, findings: Findings) -> Node | None:
        """The root; None where there is nothing, or, unless it may be ``partial``, where nobody can tell what is
        missing. All that is invalid is reported."""
        root: Node | None = None
        try:
            root = self._document()
        except ComposingStoppedError:
            self._whole = False
        self._refuse.report(findings)
        for span in self._lost:
            findings.unread(span)
        return root if self._whole or self._partial else None

    # The whole text

    def _document(self) -> Node | None:
        self._next_line()
        directive = False
        while self._text.startswith("%", self._at) and self._at == self._start:
            directive = True
            end = self._line_end()
            if not _DIRECTIVE.fullmatch(self._text, self._at, end):
                self._refuse.directive(self._span(end))
            self._at = end
            self._next_line()
        marker = _MARKER.match(self._text, self._at)
        bare = marker is None or marker[0] != "---"
        if directive and bare:
            self._misplaced(faults.NO_START)
        if marker is not None and not bare:
            self._at = marker.end()
        stop = _MARKER.search(self._text, self._at)
        self._end = stop.start() if stop else len(self._text)
        if bare and self._at >= self._end:
            return None
        root = self._value(-1, 1, fresh=bare)
        if self._broken:
            self._whole = False
        if self._at < self._end:
            self._misplaced(faults.NOWHERE)
        if stop is not None:
            self._behind(stop)
        return root

    def _behind(self, stop: re.Match[str]) -> None:
        """What follows the mark that ends a document: nothing, or another one."""
        self._end = len(self._text)
        self._move(stop.start())
        if stop[0] == "...":
            self._at = stop.end()
            self._gap()
            while self._text.startswith("...", self._at) and self._at == self._start:
                self._at += 3
                self._gap()
        if self._text.startswith("---", self._at) and self._at == self._start:
            self._refuse.second_document(self._span(self._at + 3))
        elif self._at < self._end:
            self._misplaced(faults.NOWHERE)

    # Where we are

    def _here(self) -> tuple[int, int]:
        """Line and column of the next character."""
        return self._line, self._at - self._start + 1

    def _span(self, end: int) -> Span:
        """From the next character to another on the same line."""
        return Span(self._file, self._line, self._at - self._start + 1, self._line, end - self._start + 1)

    def _from(self, line: int, column: int) -> Span:
        """From a place to the next character."""
        return Span(self._file, line, column, self._line, self._at - self._start + 1)

    def _nothing(self, line: int, column: int) -> Scalar:
        """A value that is not there."""
        return Scalar(None, Span(self._file, line, column, line, column))

    def _move(self, at: int) -> None:
        """Pass everything up to an index."""
        for match in _BREAK.finditer(self._text, self._at, at):
            self._line += 1
            self._start = match.end()
        self._at = at

    def _line_end(self) -> int:
        """The index of this line's end."""
        match = _BREAK.search(self._text, self._at, self._end)
        return match.start() if match else self._end

    def _gap(self) -> str:
        """Pass blanks, comments and line ends. Returns the character that is next, nothing at the end."""
        text, end = self._text, self._end
        if self._at < end and text[self._at] not in " \t\r\n#":
            return text[self._at]
        while match := _BLANK_LINE.match(text, self._at, end):
            if match.lastindex:
                self.comments.append(match.start(1))
            self._at = self._start = match.end()
            self._line += 1
        rest = _REST.match(text, self._at, end)
        assert rest is not None
        if rest.lastindex:
            self.comments.append(rest.start(1))
        self._at = rest.end()
        return text[self._at] if self._at < end else ""

    def _next_line(self) -> None:
        """Go from behind the last value of a line to the first of the next."""
        before = self._at
        self._gap()
        if self._text.find("\t", before, self._at) >= 0 and (tab := _TAB.search(self._text, before, self._at)):
            self._misplaced(faults.TAB, tab.end() - 1)

    def _finish(self) -> None:
        """Behind a value of a block: only a comment may follow on the line."""
        rest = _REST.match(self._text, self._at, self._end)
        assert rest is not None
        at = rest.end()
        if at < self._end and self._text[at] not in "\r\n":
            self._at = at
            self._report(self._behind_value())
            self._at = self._line_end()
        self._next_line()

    def _behind_value(self) -> Words:
        character = self._text[self._at]
        if character == ":":
            return faults.SECOND_COLON if _COLON.match(self._text, self._at, self._end) else faults.NO_BLANK
        return faults.start(character) if character in "]}" else faults.BEHIND_VALUE

    # What is wrong

    def _report(self, words: Words, at: int | None = None) -> None:
        """Report a syntax error in the value that is being read; its first one. It is at the next character unless
        told otherwise."""
        at = self._at if at is None else at
        if self._trial:
            raise _UnsoundError(words, at)
        if not self._broken:
            self._note(words, at)
            self._told = len(self._refuse.found)
        self._broken = True

    def _misplaced(self, words: Words, at: int | None = None) -> None:
        """Report a syntax error between values: nobody can tell what is missing then."""
        if not self._broken:
            self._note(words, self._at if at is None else at)
            self._whole = False

    def _note(self, words: Words, at: int) -> None:
        if self._whole:
            line, column = self._lines.place(at)
            width = column <= len(self._lines.line(line))
            self._refuse.syntax(words, Span(self._file, line, column, line, column + width))

    def _mark(self) -> _Cursor:
        noted = len(self.comments), len(self._refuse.found), len(self._lost)
        return _Cursor(self._at, self._line, self._start, *noted)

    def _reset(self, cursor: _Cursor, whole: bool) -> None:
        self._at, self._line, self._start = cursor[:3]
        del self.comments[cursor.comments :]
        del self._refuse.found[cursor.findings :]
        del self._lost[cursor.lost :]
        self._whole = whole

    def _limit(self, column: int) -> int:
        """Where the lines end that belong to a key or a dash in a column: those that are indented further, are blank or
        hold comments alone, or begin with a closing bracket."""
        match = _stretch(column).match(self._text, self._at, self._end)
        assert match is not None
        return match.end()

    def _entry(self, column: int, depth: int, *, fresh: bool = False, dashes: bool = False) -> Node:
        """The value behind a colon or a dash that belongs to a block in a column, to the begin of the next line."""
        cursor, whole, outer = self._mark(), self._whole, (self._trial, self._broken)
        self._trial, self._broken = True, False
        try:
            node = self._value(column, depth, fresh=fresh, dashes=dashes)
        except _UnsoundError as error:
            self._reset(cursor, whole)
            end, self._end = self._end, self._limit(column)
            self._trial = False
            node = self._value(column, depth, fresh=fresh, dashes=dashes)
            self._report(error.words, error.at)  # where another was found there is one already
            told = self._refuse.found[cursor.findings : self._told]
            self._refuse.found[cursor.findings :] = [item for item in told if item.code == faults.CODE]
            self._move(max(self._at, self._end))
            self._end = end
            self._next_line()
            if not self._partial:
                node = self._loss(cursor)
        self._trial, self._broken = outer
        return node

    def _loss(self, cursor: _Cursor) -> Scalar:
        """What stands for a value that is lost: it fits hardly anywhere."""
        match = _VISIBLE.search(self._text, cursor.at)
        at = cursor.at if match is None else match.start()
        line, column = self._lines.place(at)
        span = Span(self._file, line, column, line, column + 1)
        self._lost.append(span)
        return Scalar(True, span, None)

    # Blocks

    def _value(self, indent: int, depth: int, *, fresh: bool = False, dashes: bool = False) -> Node:
        """A value of a block that stands in column ``indent`` (from 0), to the begin of the next line. ``fresh``: a
        block may begin on this line; ``dashes``: a list may stand in the block's own column."""
        behind = self._here()
        column = -1
        while True:
            line, before = self._line, self._at
            if self._gap_on_line():
                tab = self._text.find("\t", before, self._at) if fresh else -1
                if tab >= 0:
                    self._report(faults.TAB_BEFORE, tab)
            else:
                self._next_line()
                fresh, column = True, -1
                here = self._at - self._start
                if self._at >= self._end or (
                    here <= indent and not (dashes and here == indent and self._indicator("-"))
                ):
                    return self._nothing(*behind)
            if column < 0 or self._line != line:
                column = self._at - self._start
            if not self._property():
                return self._block_node(indent, depth, column, fresh=fresh)
            behind = self._here()

    def _gap_on_line(self) -> bool:
        """Pass blanks and a comment. Returns whether something else follows on the line."""
        rest = _REST.match(self._text, self._at, self._end)
        assert rest is not None
        if rest.lastindex:
            self.comments.append(rest.start(1))
        self._at = rest.end()
        return self._at < self._end and self._text[self._at] not in "\r\n"

    def _property(self) -> bool:
        """Refuse a tag or an anchor, if there is one."""
        match = _PROPERTY.match(self._text, self._at, self._end) if self._text[self._at] in "!&" else None
        if match is None:
            return False
        self._refuse.property(match[0], self._span(match.end()))
        self._at = match.end()
        return True

    def _indicator(self, sign: str) -> bool:
        """Whether a sign comes next that has a blank behind it."""
        at = self._at + 1
        return self._text.startswith(sign, self._at) and (at >= self._end or self._text[at] in " \t\r\n")

    def _block_node(self, indent: int, depth: int, column: int, *, fresh: bool) -> Node:
        if self._indicator("-"):
            if fresh:
                return self._sequence(column, depth, indent)
            self._report(faults.LATE_ITEM)
        if fresh and (self._indicator("?") or self._indicator(":")):
            return self._mapping(column, depth)
        if self._text[self._at] in "|>":
            node: Node = self._block_text(indent)
            self._finish()
            return node
        cursor = self._mark()
        node = self._inline(depth, indent)
        if _COLON.match(self._text, self._at, self._end):
            if fresh and cursor.line == self._line:
                return self._mapping(column, depth, self._behind_key(node, cursor))
            if cursor.line != self._line and isinstance(node, Scalar):
                return self._key_in_text(node, cursor, column, depth, fresh=fresh)
        self._finish()
        return node

    def _key_in_text(self, node: Scalar, cursor: _Cursor, column: int, depth: int, *, fresh: bool) -> Node:
        """A text that goes on for several lines until there is a colon: its last line was meant to be a key."""
        blanks = _BLANKS.match(self._text, self._start)
        assert blanks is not None
        here = blanks.end() - self._start
        number, above = self._above(node.span.line)
        indent = len(above) - len(above.lstrip())
        if self._plain is None:
            self._misplaced(faults.KEY_OF_LINES, cursor.at)
        elif indent >= here and not _KEYED.search(above):
            self._no_colon(self._lines.starts[number - 1] + indent)
        else:
            self._misplaced(faults.LATE_KEY, blanks.end())
        if not fresh or here != column or self._plain is None:
            self._at = self._line_end()
            self._next_line()
            return node
        self._at, self._line, self._start = cursor[:3]
        match = _PLAIN.match(self._text, self._at, self._end)
        assert match is not None
        key = Scalar(match[0], self._span(match.end()))
        self._at = match.end()
        return self._mapping(column, depth, _Key(key.span, key, colon=False))

    def _above(self, first: int) -> tuple[int, str]:
        """The last line above this one that is not blank, and its number, which is no less than ``first``."""
        number = self._line - 1
        while number > first and not self._lines.line(number).strip():
            number -= 1
        return number, self._lines.line(number)

    def _no_colon(self, at: int) -> None:
        """Report that what begins at an index and fills its line is no key."""
        line = self._lines.line(self._lines.place(at)[0])
        written = line[self._lines.place(at)[1] - 1 :].rstrip()
        tight = _TIGHT_COLON.match(written)
        if tight:
            self._misplaced(faults.NO_BLANK, at + tight.end() - 1)
        else:
            self._misplaced(faults.no_colon(written), at)

    def _deep(self, depth: int) -> None:
        """Refuse a collection below the deepest level; nothing more is read then."""
        if depth > DEEPEST:
            if self._trial:
                raise _UnsoundError(faults.NOWHERE, self._at)
            self._refuse.too_deep(self._span(self._at + 1))
            raise ComposingStoppedError

    def _mapping(self, column: int, depth: int, key: _Key | None = None) -> Mapping:
        """A mapping whose keys stand in a column, from its first key on or from behind it."""
        self._deep(depth)
        line, first = (self._line, column + 1) if key is None else (key.span.line, key.span.column)
        entries: dict[str, Entry] = {}
        last = line, first
        while key is not None or self._goes_on(column):
            if key is None and (passed := self._simple_entries(column, entries)):
                last = passed
                continue
            last = self._mapping_entry(key or self._key(column, depth), column, depth, entries)
            key = None
        return self._made(entries, Span(self._file, line, first, *last))

    def _made(self, entries: dict[str, Entry], span: Span, *, empty: bool = False) -> Mapping:
        """A mapping. That it has no entries though it is not ``empty`` follows from what was refused."""
        if not entries and not empty:
            self._lost.append(span)
        return Mapping(tuple(entries.values()), span)

    def _goes_on(self, column: int) -> bool:
        """Whether the next line belongs to a block in a column; none that does may be indented further."""
        if self._at < self._end and self._at - self._start > column:
            self._further_in(column)
        return self._at < self._end and self._at - self._start == column

    def _simple_entries(self, column: int, entries: dict[str, Entry]) -> tuple[int, int] | None:
        """Take up lines that hold no more than a name and a value. Returns where the last of these values ends."""
        pattern, last = _simple_lines(column), None
        while self._at - self._start == column and (match := pattern.match(self._text, self._at, self._end)):
            value = self._simple_entry(match, entries)
            if value is None:
                break
            last = value.span[3:]
            self._at, self._start, self._line = match.end(), match.start(3), self._line + 1
        return last

    def _simple_entry(self, match: re.Match[str], entries: dict[str, Entry]) -> Scalar | None:
        """Take up a name and a value; None, and nothing taken, where they need a second look."""
        name = match[1]
        try:
            value = resolve(match[2])
        except NumberRangeError:
            return None
        if name in entries or resolve(name) != name or len(name) > _LONGEST_KEY:
            return None
        file, line, start = self._file, self._line, self._start - 1
        key = Scalar(name, Span(file, line, match.start() - start, line, match.end(1) - start))
        scalar = Scalar(value, Span(file, line, match.start(2) - start, line, match.end(2) - start))
        entries[name] = Entry(key, scalar)
        return scalar

    def _mapping_entry(self, key: _Key, column: int, depth: int, entries: dict[str, Entry]) -> tuple[int, int]:
        """Read the value of a key. Returns where the entry ends."""
        span, name = key.span, key.name
        value: Node = self._nothing(span.end_line, span.end_column)
        if key.colon:
            soon = None if name is None or name.inner != 0 else _TOO_SOON.search(str(name.value), 1)
            lost, found = len(self._lost), len(self._refuse.found)
            value = self._entry(column, depth + 1, fresh=key.announced, dashes=True)
            if soon is not None and len(self._lost) > lost and self._lost[-1] == value.span and name is not None:
                name = self._early(name, soon, found)
        elif not key.announced:
            self._at = self._line_end()
            self._next_line()
        if name is not None:
            self._put(entries, name, value)
        return max((span.end_line, span.end_column), (value.span.end_line, value.span.end_column))

    def _put(self, entries: dict[str, Entry], key: Scalar, value: Node) -> None:
        """Take an entry up, unless its key is there already; parts of a text may have a key twice."""
        name = str(key.value)
        if name in entries and not self._partial:
            self._refuse.duplicate(key, entries[name])
            return
        if name in entries:
            name = f"{name}\0{len(entries)}"
        entries[name] = Entry(key, value)

    def _early(self, key: Scalar, soon: re.Match[str], found: int) -> Scalar:
        """The key of a value that is lost, where it seems to reach into this value: ``A:{bias`` is the key ``A``."""
        name = str(key.value)[: soon.start()]
        at = self._lines.starts[key.span.line - 1] + key.span.column - 1
        del self._refuse.found[found:]
        tight = soon[0].startswith(":")
        self._note(faults.NO_BLANK if tight else faults.no_colon(name), at + soon.start() if tight else at)
        return Scalar(name, key.at(0, soon.start()))

    def _further_in(self, column: int) -> None:
        """Lines between two entries that are indented further than these."""
        character = self._text[self._at]
        if character in "]}":
            self._misplaced(faults.start(character))
        elif self._indicator("-"):
            self._misplaced(faults.ITEM_IN_MAPPING)
        else:
            _, above = self._above(1)
            columns = {column + 1, len(above) - len(above.lstrip()) + 1} - {self._at - self._start + 1}
            self._misplaced(faults.indentation(columns))
        self._move(self._limit(column))
        self._next_line()

    def _key(self, column: int, depth: int) -> _Key:
        """A key of a block, to its colon; what is none has a place and no name."""
        if self._indicator("?"):
            self._at += 1
            announced = self._entry(column, depth + 1, fresh=True)
            colon = self._at - self._start == column and self._indicator(":")
            self._at += colon
            return _Key(announced.span, self._as_key(announced), colon, announced=True)
        if self._indicator(":") or self._indicator("-"):
            place = self._here()
            self._misplaced(faults.NO_KEY if self._indicator(":") else faults.ITEM_IN_MAPPING)
            self._at += 1
            self._entry(column, depth + 1, fresh=True)
            return _Key(self._nothing(*place).span, None, colon=False, announced=True)
        while self._property() and self._gap_on_line():
            pass
        cursor = self._mark()
        node: Node = self._nothing(*self._here())
        if not _COLON.match(self._text, self._at, self._end) and self._gap_on_line():
            node = self._inline(depth + 1, None)
        if self._line == cursor.line:
            if _COLON.match(self._text, self._at, self._end):
                return self._behind_key(node, cursor)
            self._no_colon(cursor.at)
        else:
            self._misplaced(faults.KEY_OF_LINES, cursor.at)
        return _Key(node.span, node if isinstance(node, Scalar) and isinstance(node.value, str) else None, colon=False)

    def _behind_key(self, node: Node, cursor: _Cursor) -> _Key:
        """Pass the colon behind a key that begins at the cursor."""
        if self._at - cursor.at > _LONGEST_KEY:
            self._misplaced(faults.LONG_KEY, cursor.at)
        colon = _COLON.match(self._text, self._at, self._end)
        assert colon is not None
        self._at = colon.end()
        return _Key(node.span, self._as_key(node))

    def _as_key(self, node: Node) -> Scalar | None:
        """The key as a text, refused where it is none; None where the entry has to be dropped."""
        if not isinstance(node, Scalar):
            self._refuse.collection_key(node)
            return None
        if node.value == "<<" and node.inner == 0:
            self._refuse.merge_key(node.span)
            return None
        if isinstance(node.value, str):
            return node
        if node.inner is None:  # an alias, or a value that is lost
            return None
        first = self._lines.starts[node.span.line - 1] - 1
        written = self._text[first + node.span.column : first + node.span.end_column]
        self._refuse.key_not_text(node, written)
        return Scalar(written, node.span, node.inner) if written else None

    def _sequence(self, column: int, depth: int, indent: int) -> Node:
        """A list whose dashes stand in a column, within a block that stands in column ``indent``."""
        self._deep(depth)
        line, first = self._here()
        items: list[Node] = []
        packer: Packer | None = None
        last = line, first
        while True:
            if len(items) == _PACK_FROM + 1 and (packer := Packer.of(items, self._file)) is not None:
                items = []
            if packer is None or not self._packed_line(packer):
                self._at += 1
                item: Node = self._entry(column, depth + 1, fresh=True)
                last = item.span.end_line, item.span.end_column
                if packer is not None and not packer.add_node(item):
                    items, packer = [*packer.take_back_items(), item], None
                elif packer is None:
                    items.append(item)
            if not self._goes_on(column) or not self._indicator("-"):
                break
        if self._at < self._end and self._at - self._start == column > indent:
            self._misplaced(faults.KEY_IN_LIST)
            self._move(self._limit(column))
            self._next_line()
        if packer is not None:
            return packer.finish(Span(self._file, line, first, *packer.end()))
        return Sequence(tuple(items), Span(self._file, line, first, *max((line, first), last)))

    def _packed_line(self, packer: Packer) -> bool:
        """Take a whole item that holds nothing but texts and numbers straight into a packed list."""
        match = _ROW_LINE.match(self._text, self._at, self._end)
        if match is None or not packer.in_rows:
            return False
        cells = self._cells(match.start(1), match[1])
        if cells is None or not packer.add_row(cells, self._line, match.end(1) + 2 - self._start):
            return False
        self._at = self._start = match.end()
        self._line += 1
        self._next_line()
        return True

    def _cells(self, at: int, inner: str) -> list[tuple[ScalarValue, int, int]] | None:
        """The values between two brackets, each with the columns at which it begins and ends; None where one of them
        is not simply a text or a number."""
        cells = []
        column = at - self._start + 1
        try:
            for piece in inner.split(","):
                text = piece.strip(" \t")
                if not text or (text[0] == "-" and text[1:2] in ("", " ", "\t")) or balance(text) > 0:
                    return None
                first = column + piece.index(text)
                cells.append((resolve(text), first, first + len(text)))
                column += len(piece) + 1
        except NumberRangeError:
            return None
        return cells

    # Scalars

    def _inline(self, depth: int, indent: int | None) -> Node:
        """A scalar, or a collection in brackets. A text goes on in lines that are indented further than ``indent``;
        with None it ends with its line."""
        self._plain = None
        character = self._text[self._at]
        if character in "[{":
            return self._flow(depth)
        if character in "'\"":
            return self._quoted(character)
        if character == "*":
            return self._alias()
        return self._plain_text(_PLAIN, _MORE, indent)

    def _alias(self) -> Scalar:
        match = _PROPERTY.match(self._text, self._at, self._end)
        if match is None:
            return self._no_text()
        self._refuse.alias(match[0], self._span(match.end()))
        cursor = self._mark()
        self._at = match.end()
        return self._loss(cursor)

    def _no_text(self) -> Scalar:
        """Report a character with which no text begins, and pass it."""
        span = self._span(self._at + 1)
        self._report(faults.start(self._text[self._at]))
        self._at += 1
        return Scalar(None, span)

    def _plain_text(self, begin: re.Pattern[str], more: re.Pattern[str], indent: int | None) -> Scalar:
        text, end, first = self._text, self._end, self._at
        match = begin.match(text, first, end)
        if match is None:
            return self._no_text()
        line, column = self._here()
        self._at = match.end()
        if indent is not None:
            self._go_on(more, indent)
        span = self._from(line, column)
        content, written = text[first : self._at], None
        if span.line != span.end_line:
            content, written = texts.plain(content), Written(text, first, self._at)
        try:
            value = resolve(content)
        except NumberRangeError as error:
            self._refuse.number(error, span)
            value = error.nearest
        scalar = Scalar(value, span, 0 if written is None else None, written)
        self._plain = _Plain(first, self._at, scalar)
        return scalar

    def _go_on(self, more: re.Pattern[str], indent: int) -> None:
        """Pass the further lines of a text without quotes."""
        text, end = self._text, self._end
        while breaks := _NEXT_TEXT.match(text, self._at, end):
            blanks = _BLANKS.match(text, breaks.end(), end)
            assert blanks is not None
            at = blanks.end()
            while at < end and text[at] == "\t" and at - breaks.end() > indent:
                at += 1
            match = None if at - breaks.end() <= indent else more.match(text, at, end)
            if match is None or text[at] == "#":
                return
            self._move(breaks.end())
            self._at = match.end()

    def _quoted(self, quote: str) -> Scalar:
        text, first = self._text, self._at
        line, column = self._here()
        match = _QUOTED[quote].match(text, first, self._end)
        if match is None:
            self._report(faults.quote(quote))
            self._at = self._line_end()
            return Scalar(text[first + 1 : self._at], self._from(line, column), 1)
        written = match[0]
        self._move(match.end())
        span = self._from(line, column)
        if "\n" not in written and "\r" not in written and ("\\" if quote == '"' else "''") not in written[1:-1]:
            return Scalar(written[1:-1], span, 1)
        if quote == "'":
            return Scalar(texts.single(written[1:-1]), span, None, Written(text, first, match.end()))
        try:
            value = texts.double(written[1:-1])
        except texts.EscapeError as error:
            at = first + 1 + error.at
            self._report(faults.escape(text[at : at + 2]), at)
            return Scalar(written[1:-1], span, None)
        return Scalar(self._refuse.escaped_controls(value, span), span, None, Written(text, first, match.end()))

    def _block_text(self, indent: int) -> Scalar:
        """A text behind | or >, up to the end of its last line."""
        text, end, first = self._text, self._end, self._at
        line, column = self._here()
        header = _HEADER.match(text, first, end)
        if header is None:
            self._report(faults.block_header(text[first]))
            self._at = self._line_end()
            return Scalar(None, self._from(line, column), None)
        if header[5]:
            self.comments.append(header.start(5))
        self._at = header.end()
        digit = header[2] or header[3]
        width = max(indent, 0) + int(digit) if digit else self._indentation(indent)
        lines: list[str] = []
        while match := _LINE.match(text, self._at, end):
            blanks, behind = match.end(1) - match.start(1), text[match.end(1) : match.end(1) + 1]
            if blanks < width and behind not in ("", "\r", "\n"):
                if behind == "\t":
                    self._report(faults.TAB, match.end(1))
                break
            if match.end() == match.start(1) and match.end() >= end:
                break  # behind the last line break
            lines.append(text[match.start(1) + width : match.end()])
            self._move(match.end())
        written = text[first : self._at].rstrip()
        value = texts.block(lines, folded=header[0][0] == ">", chomping=header[1] or header[4])
        last_line, last = self._lines.place(first + len(written))
        return Scalar(
            value,
            Span(self._file, line, column, last_line, last),
            None,
            Written(text, first, first + len(written)),
        )

    def _indentation(self, indent: int) -> int:
        """How far a block text is indented: as its first line that is not blank."""
        width, at = indent + 1, self._at
        while match := _LINE.match(self._text, at, self._end):
            width = max(width, match.end(1) - match.start(1))
            at = match.end()
            if self._text.startswith("\t", match.end(1)):
                self._report(faults.TAB, match.end(1))
            if match.end(1) < at or at >= self._end:
                break
        return width

    # Brackets

    def _flow(self, depth: int) -> Node:
        self._deep(depth)
        return self._list(depth) if self._text[self._at] == "[" else self._braces(depth)

    def _closed(self, opening: str, begin: int) -> bool:
        """Whether a collection that a bracket has opened ends here; one that closes it is passed."""
        character, closing = self._gap(), _CLOSING[opening]
        if not character:
            more = _VISIBLE.search(self._text, self._end)
            self._report(faults.unclosed(opening, closing, self._lines.place(self._end)[0] if more else None), begin)
        elif character not in "]}":
            return False
        elif character != closing:
            self._report(faults.wrong_bracket(character, opening, closing))
        self._at += bool(character)
        return True

    def _comma(self, opening: str) -> None:
        """Pass the comma between two items; none is wanted before a closing bracket."""
        character = self._gap()
        if character and character not in ",]}":
            tight = self._text[self._at - 1 : self._at].strip() and _TIGHT.match(self._text, self._at)
            self._report(faults.NO_BLANK if tight else faults.no_comma(_CLOSING[opening]))
        self._at += character in (",", ":")

    def _list(self, depth: int) -> Node:
        place, begin = self._here(), self._at
        match = _SIMPLE_ROW.match(self._text, begin, self._end)
        cells = self._cells(match.start(1), match[1]) if match else None
        if match is not None and cells is not None:
            self._at = match.end()
            return self._simple_row(cells, self._from(*place))
        self._at += 1
        items: list[Node] = []
        while not self._closed("[", begin):
            items.append(self._item(depth + 1))
            self._comma("[")
        self._plain = None
        span = self._from(*place)
        packer = Packer.of(items, self._file) if len(items) > _PACK_FROM else None
        return Sequence(tuple(items), span) if packer is None else packer.finish(span)

    def _simple_row(self, cells: list[tuple[ScalarValue, int, int]], span: Span) -> Node:
        """A list of texts and numbers on one line."""
        if len(cells) > _PACK_FROM:
            packer = Packer(self._file, in_rows=False)
            if packer.add_cells(cells, span.line):
                return packer.finish(span)
        line = span.line
        return Sequence(
            tuple(Scalar(value, Span(self._file, line, one, line, other)) for value, one, other in cells), span
        )

    def _item(self, depth: int) -> Node:
        """An item of a list: a value, or a single pair ``a: 1``."""
        place = self._here()
        announced = self._indicator("?")
        if announced:
            self._at += 1
            self._gap()
        line, at = self._line, self._at
        key = self._flow_node(depth)
        colon = self._flow_colon(line, at, announced=announced)
        if not colon and not announced:
            return key
        value = self._flow_value(depth, colon)
        self._plain = None
        name = self._as_key(key)
        entries = () if name is None else (Entry(name, value),)
        return Mapping(entries, Span(self._file, *place, value.span.end_line, value.span.end_column))

    def _flow_colon(self, line: int, at: int, *, announced: bool) -> bool:
        """Pass the colon behind a key that begins on a line, if there is one."""
        match = _FLOW_COLON.match(self._text, self._at, self._end)
        if match is None or (line != self._line and not announced):
            return False
        if self._plain is not None and self._text[match.end() : match.end() + 1] in _FLOW_SIGNS:
            return False
        if match.end() - at > _LONGEST_KEY and not announced:
            self._report(faults.LONG_KEY, at)
        self._at = match.end()
        return True

    def _flow_value(self, depth: int, colon: bool) -> Node:
        """The value behind a key in brackets; behind the key itself where there is no colon."""
        behind = self._here()
        plain = self._plain
        if colon:
            character = self._gap()
            if character and character not in ",]}":
                return self._flow_node(depth)
        self._plain = None if colon else plain
        return self._nothing(*behind)

    def _flow_node(self, depth: int) -> Node:
        """A value within brackets, to its last character."""
        self._plain = None
        behind = self._here()
        refused = False
        while (character := self._gap()) and self._property():
            refused, behind = True, self._here()
        if not character or (refused and character in ",]}:"):
            return self._nothing(*behind)
        if character in "[{":
            return self._flow(depth)
        if character in "'\"":
            return self._quoted(character)
        if character == "*":
            return self._alias()
        scalar = self._plain_text(_FLOW_PLAIN, _FLOW_MORE, -1)
        return scalar if self._partial or self._plain is None else self._past_commas(self._plain)

    def _past_commas(self, first: _Plain) -> Scalar:
        """A text as it was meant that commas have cut: ``{weight: normal(0, 1)}`` reads as ``normal(0`` and ``1)``. It
        goes on while one of its parentheses is open."""
        text, span = self._text, first.scalar.span
        unclosed = balance(text[first.begin : first.end])
        while unclosed > 0 and (match := _CUT_OFF.match(text, self._at, self._end)):
            unclosed += balance(match[0])
            self._move(match.end())
        if self._at == first.end:
            return first.scalar
        written = text[first.begin : self._at]
        whole = Scalar(written, self._from(span.line, span.column))
        if span.line != self._line:
            whole = Scalar(" ".join(written.split()), whole.span, None, Written(text, first.begin, self._at))
        self._refuse.cut_text(whole, text[first.begin : first.end])
        self._plain = None
        return whole

    def _braces(self, depth: int) -> Mapping:
        place, begin = self._here(), self._at
        self._at += 1
        entries: dict[str, Entry] = {}
        empty, before = True, None
        while not self._closed("{", begin):
            empty = False
            match = _SIMPLE_PAIR.match(self._text, self._at, self._end)
            if match is not None and (simple := self._simple_entry(match, entries)) is not None:
                before = _Plain(match.start(2), match.end(2), simple)
                self._at = match.end()
                continue
            announced = self._indicator("?")
            if announced:
                self._at += 1
                self._gap()
            line, at = self._line, self._at
            node = self._flow_node(depth + 1)
            plain = self._plain
            colon = self._flow_colon(line, at, announced=announced)
            if colon or not self._is_cut_off(before, plain):
                key = self._as_key(node)
                value = self._flow_value(depth + 1, colon)
                before = self._plain if colon else None
                if key is not None:
                    self._put(entries, key, value)
            self._comma("{")
        self._plain = None
        return self._made(entries, self._from(*place), empty=empty)

    def _is_cut_off(self, before: _Plain | None, key: _Plain | None) -> bool:
        """Whether a key without a colon is a piece of the value before it, which a comma has cut."""
        if before is None or key is None or self._partial:
            return False
        one, other = before.scalar, key.scalar
        if _is_number(one) and _is_number(other):
            if self._text[before.end : key.begin] != ",":
                return False
            self._refuse.decimal_comma(one, other, self._text[before.begin : key.end])
            return True
        if isinstance(one.value, str) and isinstance(other.value, str) and "->" not in other.value:
            self._refuse.stray_text(one, other)
            return True
        return False


def _is_number(scalar: Scalar) -> bool:
    return isinstance(scalar.value, int | float) and not isinstance(scalar.value, bool)
