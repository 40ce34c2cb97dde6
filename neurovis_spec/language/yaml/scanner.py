"""The scanner: what the parser has to know of single characters, texts and numbers.

In: the text of a spec. Out: a place in it that goes on from token to token, the comments that it has passed, and
scalars. What is wrong is reported here; what a syntax error costs is the parser's concern.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.yaml import faults, texts
from neurovis_spec.language.yaml.characters import Lines
from neurovis_spec.language.yaml.faults import Words
from neurovis_spec.language.yaml.refusals import Refusals
from neurovis_spec.language.yaml.scalars import NumberRangeError, resolve
from neurovis_spec.language.yaml.source import Scalar
from neurovis_spec.language.yaml.texts import Written

#: A longer key has to be announced by a question mark.
LONGEST_KEY: Final = 1024
#: What may begin a text without quotes; signs that depend on what follows are to be added, and a closing parenthesis.
FIRST: Final = r"(?:[^\s\-?:,\[\]{}#&*!|>'\"%@`]|"
#: What ends a text without quotes anywhere: a blank and #, the end of a line. A colon, and signs of brackets, are to
#: be added. Each alternative begins with a character, so that a search looks at little more than these.
ENDS_TEXT: Final = r"#(?<!\S#)|\r|\n"
#: What a text in quotes is searched for: the quote that ends it, and what holds one that does not.
_QUOTES: Final = {"'": re.compile("''?"), '"': re.compile(r'\\.|"', re.DOTALL)}
_HEADER: Final = re.compile(r"[|>](?:([-+])?([1-9])?|([1-9])([-+]))(?:[ \t]+(#[^\r\n]*)?)?(?=[\r\n]|\Z)")
_PROPERTY: Final = re.compile(r"!<[^>\s]*>|![^\s,\[\]{}]*|[&*][A-Za-z0-9_-]+(?=[\s,\[\]{}:?%@`]|\Z)")
REST: Final = re.compile(r"[ \t]*(#[^\r\n]*)?")
_BREAK: Final = re.compile(r"\r\n|\n|\r")
BLANKS: Final = re.compile(" *")
_BLANK_LINE: Final = re.compile(r"[ \t]*(#[^\r\n]*)?(?:\r\n|\n|\r)")
_NEXT_TEXT: Final = re.compile(r"[ \t]*(?:\r\n|\n|\r)(?:[ \t]*(?:\r\n|\n|\r))*")
VISIBLE: Final = re.compile(r"[^\s]")
#: A line end, the blanks that begin the next line, and the rest of it.
_LINE: Final = re.compile(r"(?:\r\n|\n|\r)( *)[^\r\n]*")
#: A name, or a sum of names with an arrow.
SIMPLE_NAME: Final = r"([A-Za-z_][\w.]*(?: (?:->|\+) [\w.]+)*)"
#: Such a name, and a number or a short text.
SIMPLE: Final = SIMPLE_NAME + r" *: +((?:[A-Za-z0-9_.]|[-+](?![ \t\r\n,\[\]{}]))[\w.+*/^-]*)"


class UnsoundError(Exception):
    """A syntax error in a value that is read for the first time."""

    def __init__(self, words: Words, at: int) -> None:
        super().__init__(words.message)
        self.words = words
        self.at = at


class Unquoted(NamedTuple):
    """How texts without quotes begin, and what ends them; the blanks before that are no part of them."""

    first: re.Pattern[str]
    stop: re.Pattern[str]

    def begun(self, text: str, at: int, end: int) -> int | None:
        """Where a text ends on its line that begins at an index; None where none does."""
        return self.further(text, at + 1, end) if self.first.match(text, at, end) else None

    def further(self, text: str, at: int, end: int) -> int:
        """Where a text ends that goes on from an index on a line: there, where none of it follows."""
        stop = self.stop.search(text, at, end)
        return at + len(text[at : stop.start() if stop else end].rstrip(" \t"))


class Plain(NamedTuple):
    """A scalar without quotes, and where it begins and ends in the text."""

    begin: int
    end: int
    scalar: Scalar


class Scanner:
    """Goes through one text."""

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
        self._plain: Plain | None = None
        #: where values stand that are lost to a syntax error
        self._lost: list[Span] = []
        #: whether lines of the mapping or list that is being read are left out, as they fit nowhere
        self._open = False
        #: whether it is known what every syntax error has cost
        self._whole = True
        #: Where comments begin.
        self.comments: list[int] = []

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
        rest = REST.match(text, self._at, end)
        assert rest is not None
        if rest.lastindex:
            self.comments.append(rest.start(1))
        self._at = rest.end()
        return text[self._at] if self._at < end else ""

    def _gap_on_line(self) -> bool:
        """Pass blanks and a comment. Returns whether something else follows on the line."""
        rest = REST.match(self._text, self._at, self._end)
        assert rest is not None
        if rest.lastindex:
            self.comments.append(rest.start(1))
        self._at = rest.end()
        return self._at < self._end and self._text[self._at] not in "\r\n"

    def _next_line(self) -> None:
        """Go from behind the last value of a line to the first of the next. In lines between that hold nothing, or a
        comment alone, tabs are blanks."""
        before = self._at
        if self._gap() and self._start >= before and (tab := self._text.find("\t", self._start, self._at)) >= 0:
            self._misplaced(faults.TAB, tab)

    def _indicator(self, sign: str) -> bool:
        """Whether a sign comes next that has a blank behind it."""
        at = self._at + 1
        return self._text.startswith(sign, self._at) and (at >= self._end or self._text[at] in " \t\r\n")

    # What is wrong

    def _report(self, words: Words, at: int | None = None) -> None:
        """Report a syntax error in the value that is being read; its first one. It is at the next character unless
        told otherwise."""
        at = self._at if at is None else at
        if self._trial:
            raise UnsoundError(words, at)
        if not self._broken:
            self._note(words, at)
            self._told = len(self._refuse.found)
        self._broken = True

    def _left_out(self, words: Words, at: int | None = None) -> None:
        """Report a syntax error that costs lines of the mapping or list that is being read."""
        self._open = True
        if not self._broken:
            self._note(words, self._at if at is None else at)

    def _misplaced(self, words: Words, at: int | None = None) -> None:
        """Report a syntax error behind which nobody can tell what is missing."""
        self._left_out(words, at)
        self._whole = self._whole and self._broken

    def _note(self, words: Words, at: int) -> None:
        if self._whole:
            line, column = self._lines.place(at)
            width = column <= len(self._lines.line(line))
            self._refuse.syntax(words, Span(self._file, line, column, line, column + width))

    def _loss(self, at: int) -> Scalar:
        """A placeholder for the value behind an index that a syntax error has cost; hardly any place accepts it."""
        match = VISIBLE.search(self._text, at)
        line, column = self._lines.place(at if match is None else match.start())
        span = Span(self._file, line, column, line, column + 1)
        self._lost.append(span)
        return Scalar(True, span, None)

    # Scalars

    def _property(self) -> bool:
        """Refuse a tag or an anchor, if there is one."""
        match = _PROPERTY.match(self._text, self._at, self._end) if self._text[self._at] in "!&" else None
        if match is None:
            return False
        self._refuse.property(match[0], self._span(match.end()))
        self._at = match.end()
        return True

    def _alias(self) -> Scalar:
        match = _PROPERTY.match(self._text, self._at, self._end)
        if match is None:
            return self._no_text()
        self._refuse.alias(match[0], self._span(match.end()))
        lost = self._loss(self._at)
        self._at = match.end()
        return lost

    def _no_text(self) -> Scalar:
        """Report a character with which no text begins, and pass it."""
        span = self._span(self._at + 1)
        self._report(faults.start(self._text[self._at]))
        self._at += 1
        return Scalar(None, span)

    def _plain_text(self, kind: Unquoted, indent: int | None) -> Scalar:
        text, end, first = self._text, self._end, self._at
        last = kind.begun(text, first, end)
        if last is None:
            return self._no_text()
        line, column = self._here()
        self._at = last
        if indent is not None:
            self._go_on(kind, indent)
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
        self._plain = Plain(first, self._at, scalar)
        return scalar

    def _go_on(self, kind: Unquoted, indent: int) -> None:
        """Pass the further lines of a text without quotes."""
        text, end = self._text, self._end
        while breaks := _NEXT_TEXT.match(text, self._at, end):
            blanks = BLANKS.match(text, breaks.end(), end)
            assert blanks is not None
            at = blanks.end()
            while at < end and text[at] == "\t" and at - breaks.end() > indent:
                at += 1
            last = at if at - breaks.end() <= indent else kind.further(text, at, end)
            if last == at:
                return
            self._move(breaks.end())
            self._at = last

    def _quoted(self, quote: str) -> Scalar:
        text, first = self._text, self._at
        line, column = self._here()
        closing = next((one for one in _QUOTES[quote].finditer(text, first + 1, self._end) if one[0] == quote), None)
        if closing is None:
            self._report(faults.quote(quote))
            self._at = self._line_end()
            return Scalar(text[first + 1 : self._at], self._from(line, column), 1)
        last = closing.end()
        written = text[first:last]
        self._move(last)
        span = self._from(line, column)
        if "\n" not in written and "\r" not in written and ("\\" if quote == '"' else "''") not in written[1:-1]:
            return Scalar(written[1:-1], span, 1)
        if quote == "'":
            return Scalar(texts.single(written[1:-1]), span, None, Written(text, first, last))
        try:
            value = texts.double(written[1:-1])
        except texts.EscapeError as error:
            at = first + 1 + error.at
            self._report(faults.escape(text[at : at + 2]), at)
            return Scalar(written[1:-1], span, None)
        return Scalar(self._refuse.escaped_controls(value, span), span, None, Written(text, first, last))

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
