"""The parser: a text becomes the tree that everything else is made from.

In: the text of a spec. Out: its root, values that know their places (``source``), whatever the text looks like. Between
them lie blanks, comments and punctuation alone: with the text itself beside it, the tree has lost nothing. What YAML or
the language does not allow is reported, and reading goes on behind it.

A syntax error costs the value of the innermost key or list item around it, up to the next line that is indented no
further; a ``partial`` tree keeps what there is of such a value. Lines that fit nowhere, as a colon is missing or their
indentation is another, are left out: the mapping that they may belong to is then open. A bracket or a quote may close
on a line that is indented less; where reading it so ends in an error, it is read once more, up to the next line that is
no part of it.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Final, NamedTuple

from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.yaml import faults
from neurovis_spec.language.yaml.brackets import SIMPLE_PAIR, Brackets
from neurovis_spec.language.yaml.faults import Words
from neurovis_spec.language.yaml.packed import PACK_FROM, Packer
from neurovis_spec.language.yaml.refusals import DEEPEST, ReadingStoppedError
from neurovis_spec.language.yaml.scalars import resolve
from neurovis_spec.language.yaml.scanner import (
    BLANKS,
    ENDS_TEXT,
    FIRST,
    LONGEST_KEY,
    REST,
    SIMPLE,
    SIMPLE_NAME,
    Unquoted,
    UnsoundError,
)
from neurovis_spec.language.yaml.source import Entry, Mapping, Node, Scalar, Sequence
from neurovis_spec.likeness import unseen

_END: Final = r"(?=[ \t\r\n]|\Z)"
_TEXT: Final = Unquoted(
    re.compile(FIRST + r"[-?:](?=\S))", re.ASCII),
    re.compile(rf":(?=\s|\Z)|{ENDS_TEXT}", re.ASCII),
)
_COLON: Final = re.compile(r"[ \t]*:" + _END)
_DIRECTIVE: Final = re.compile(r"%YAML[ \t]+1\.2[ \t]*(#.*)?")
_MARKER: Final = re.compile(r"(?<![^\r\n])(?:---|\.\.\.)" + _END)
_COMMENT: Final = re.compile(r"[ \t]#.*")
#: What a line without a colon begins with that seems to be meant for its key.
_WORD: Final = re.compile(r"[A-Za-z_][\w.]*(?: (?:->|\+) [\w.]+)*(?=[ \t]|\Z)", re.ASCII)
_TIGHT_COLON: Final = re.compile(r"[A-Za-z_][\w.]*:(?=\S)")
#: A line that is no more than a name, or names joined as the ends of a connection are.
_HEAD: Final = re.compile(r"[A-Za-z_][\w.]*(?: *(?:->|\+) *[\w.]+)*", re.ASCII)
#: A line that has a key and a colon.
_KEYED: Final = re.compile(r":(?:\s|\Z)")
#: Where a value has begun within what looks like its key: without a blank before it, or without a colon.
_TOO_SOON: Final = re.compile(r":(?=[^ ])|[ \t]*:?[ \t]*[\[{]")
#: A line of a list that is such a list.
_ROW_LINE: Final = re.compile(r"- +\[([^\[\]{}'\"#&*!|>%@`?:\r\n]*)\][ \t]*(?:\r\n|\n|\r)")


@cache
def _line_before_others(column: int) -> re.Pattern[str]:
    """The line end before a line that does not belong to what stands in a column above it. Those do that are indented
    further, are blank, hold a comment alone or begin with a closing bracket."""
    deeper = f" {{{column + 1}}}"
    return re.compile(rf"(?:\r\n|\n|\r)(?![ \t]*(?:[#\r\n\]}}]|\Z)|{deeper})")


@cache
def _simple_lines(column: int) -> re.Pattern[str]:
    """A line of a block in a column that holds a name and a number or a short text, behind which neither goes on."""
    return re.compile(rf"{SIMPLE}{_ends_line(column)}")


@cache
def _braces_end(column: int) -> re.Pattern[str]:
    """The end of such a line that holds a name and pairs in braces."""
    return re.compile(rf"\}}{_ends_line(column)}")


def _ends_line(column: int) -> str:
    """The end of a line, and the indentation of one behind it that is no part of its value."""
    return rf" *(?:\r\n|\n|\r)(?P<indent> {{0,{column}}})(?=[^ \t\r\n#]|\Z)"


#: a name and a brace that opens
_BRACES = re.compile(rf"{SIMPLE_NAME} *: +(\{{) *")
#: a key that needs no second look
_NAME = re.compile(r"([A-Za-z_][A-Za-z0-9_]{0,63}):(?=[ \r\n])")


class _Cursor(NamedTuple):
    """How far a text is read: the next character, its line, where that begins, and how much was noted so far."""

    at: int
    line: int
    start: int
    comments: int
    findings: int
    lost: int


class _Key(NamedTuple):
    """What stands before a colon: its place, the key (None where it is refused), whether there is a colon, and whether
    a question mark announces it."""

    span: Span
    name: Scalar | None
    colon: bool = True
    announced: bool = False


class Parser(Brackets):
    """Reads one text."""

    def document(self, findings: Findings) -> Node | None:
        """The root; None where there is nothing, or, unless it may be ``partial``, where nobody can tell what is
        missing. All that is invalid is reported."""
        root: Node | None = None
        try:
            root = self._document()
        except ReadingStoppedError:
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

    # Errors

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
        match = _line_before_others(column).search(self._text, self._at, self._end)
        return match.end() if match else self._end

    def _entry(self, column: int, depth: int, *, fresh: bool = False, dashes: bool = False) -> Node:
        """The value behind a colon or a dash that belongs to a block in a column, to the begin of the next line."""
        cursor, whole, is_open, outer = self._mark(), self._whole, self._open, (self._trial, self._broken)
        self._trial, self._broken = True, False
        try:
            node = self._value(column, depth, fresh=fresh, dashes=dashes)
        except UnsoundError as error:
            self._reset(cursor, whole)
            self._open = is_open
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
                node = self._loss(cursor.at)
        self._trial, self._broken = outer
        return node

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
                return self._key_in_text(node, cursor, (indent, column), depth, fresh=fresh)
        self._finish()
        if fresh and self._plain is not None and self._at - self._start == column > indent and self._at < self._end:
            # the line below, in the same column, is an entry as well
            return self._without_colon(self._no_colon(cursor.at), cursor, column, depth)
        return node

    def _without_colon(self, key: _Key, cursor: _Cursor, column: int, depth: int) -> Node:
        """A mapping whose first line, at the cursor, is no more than a text."""
        self._at, self._line, self._start = cursor[:3]
        return self._mapping(column, depth, key)

    def _heads(self, cursor: _Cursor) -> bool:
        """Whether the line at the cursor is a name alone, which lines indented further belong to."""
        line = self._lines.line(cursor.line)[cursor.at - cursor.start :]
        return not self._partial and _HEAD.fullmatch(_COMMENT.sub("", line).rstrip()) is not None

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
        return self._plain_text(_TEXT, indent)

    def _finish(self) -> None:
        """Behind a value of a block: only a comment may follow on the line."""
        rest = REST.match(self._text, self._at, self._end)
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
        if self._text.startswith(faults.COMMENTS, self._at):
            return faults.COMMENT
        return faults.start(character) if character in "]}" else faults.BEHIND_VALUE

    def _goes_on(self, column: int, entries: dict[str, Entry] | None = None) -> bool:
        """Whether the next line belongs to a block in a column, of which these are the entries so far. None that does
        may be indented further: what is may be meant for the last of them."""
        if self._at < self._end and self._at - self._start > column:
            self._further_in(column)
            self._open_last(entries)
        while self._at < self._end and self._at - self._start == column and unseen(self._text[self._at]):
            self._refuse.indentation(self._text[self._at], self._span(self._at + 1))
            self._open = True
            self._leave_out(column)
            self._open_last(entries)
        return self._at < self._end and self._at - self._start == column

    def _open_last(self, entries: dict[str, Entry] | None) -> None:
        """Lines that are left out may be meant for the last entry."""
        if entries:
            name, entry = entries.popitem()
            entries[name] = entry._replace(value=self._opened(entry.value))

    def _further_in(self, column: int) -> None:
        """Leave out lines between two entries that are indented further than these."""
        character = self._text[self._at]
        if character in "]}":
            self._left_out(faults.start(character))
        elif self._indicator("-"):
            self._left_out(faults.ITEM_IN_MAPPING)
        else:
            _, above = self._above(1)
            columns = {column + 1, len(above) - len(above.lstrip()) + 1} - {self._at - self._start + 1}
            self._left_out(faults.indentation(columns))
        self._leave_out(column)

    def _leave_out(self, column: int) -> None:
        """Pass what belongs to a line of a block in a column."""
        self._move(self._limit(column))
        self._next_line()

    def _above(self, first: int) -> tuple[int, str]:
        """The last line above this one that is not blank, and its number, which is no less than ``first``."""
        number = self._line - 1
        while number > first and not self._lines.line(number).strip():
            number -= 1
        return number, self._lines.line(number)

    def _no_colon(self, at: int) -> _Key:
        """Report that what begins at an index and fills its line is no key. Its first word seems to be meant for one;
        where it has none, nobody knows what is left out."""
        number, column = self._lines.place(at)
        line = self._lines.line(number)
        written = _COMMENT.sub("", line[column - 1 :]).rstrip()
        tight, word = _TIGHT_COLON.match(written), _WORD.match(written)
        is_open = self._open or word is None
        if tight:
            self._left_out(faults.NO_BLANK, at + tight.end() - 1)
        else:
            self._left_out(faults.no_colon(written), at)
        self._open = is_open
        last = _TEXT.begun(line, column - 1, len(line)) if self._partial else word and column - 1 + word.end()
        if last is None:
            return _Key(self._nothing(number, column).span, None, colon=False)
        span = Span(self._file, number, column, number, last + 1)
        return _Key(span, Scalar(line[column - 1 : last], span), colon=False)

    # Mappings

    def _mapping(self, column: int, depth: int, key: _Key | None = None) -> Mapping:
        """A mapping whose keys stand in a column, from its first key on or from behind it."""
        self._deep(depth)
        line, first = (self._line, column + 1) if key is None else (key.span.line, key.span.column)
        entries: dict[str, Entry] = {}
        last = line, first
        outer, self._open = self._open, key is not None and not key.colon and key.name is None
        while key is not None or self._goes_on(column, entries):
            if key is None and (passed := self._simple_entries(column, depth, entries)):
                last = passed
                continue
            last = self._mapping_entry(key or self._key(column, depth), column, depth, entries)
            key = None
        is_open, self._open = self._open, outer
        return self._made(entries, Span(self._file, line, first, *last), is_open=is_open)

    def _opened(self, node: Node) -> Node:
        """A value to which lines may belong that could not be read."""
        if isinstance(node, Scalar):
            return self._lost_node(node) if node.value is None else node
        begin = self._lines.starts[node.span.line - 1] + node.span.column - 1
        if self._text[begin] in "[{":
            return node
        if isinstance(node, Mapping):
            last = tuple(entry._replace(value=self._opened(entry.value)) for entry in node.entries[-1:])
            return Mapping((*node.entries[:-1], *last), node.span, is_open=True)
        return self._lost_node(node)

    def _lost_node(self, node: Node) -> Node:
        """What stands for a value of which nobody knows what it was meant to be."""
        return node if self._partial else self._loss(self._lines.starts[node.span.line - 1] + node.span.column - 1)

    def _simple_entries(self, column: int, depth: int, entries: dict[str, Entry]) -> tuple[int, int] | None:
        """Take up lines that hold no more than a name and a value, or such pairs in braces. Returns where the last of
        these values ends."""
        pattern, last = _simple_lines(column), None
        while self._at - self._start == column:
            match = pattern.match(self._text, self._at, self._end)
            value: Node | None = None if match is None else self._simple_entry(match, entries)
            if match is None and depth < DEEPEST and (braces := self._simple_braces(column, entries)):
                match, value = braces
            if match is None or value is None:
                break
            last = value.span[3:]
            self._at, self._line = match.end(), self._line + 1
            self._start = self._at - len(match["indent"])
        return last

    def _simple_braces(self, column: int, entries: dict[str, Entry]) -> tuple[re.Match[str], Mapping] | None:
        """Take up a line that holds a name and pairs of names and values in braces. Returns its end and the mapping;
        None, and nothing taken, where it needs a second look."""
        head = _BRACES.match(self._text, self._at, self._end)
        if head is None or not self._is_new(head[1], entries):
            return None
        pairs: dict[str, Entry] = {}
        at = head.end()
        while pair := SIMPLE_PAIR.match(self._text, at, self._end):
            if self._simple_entry(pair, pairs) is None:
                return None
            at = pair.end()
        tail = _braces_end(column).match(self._text, at, self._end)
        if tail is None:
            return None
        file, line, start = self._file, self._line, self._start - 1
        key = Scalar(head[1], Span(file, line, head.start() - start, line, head.end(1) - start))
        mapping = Mapping(tuple(pairs.values()), Span(file, line, head.start(2) - start, line, at + 1 - start))
        entries[head[1]] = Entry(key, mapping)
        return tail, mapping

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
            self._leave_out(column)
            if name is not None and not self._partial:
                value = self._lost_node(name)
                self._lost.append(name.span)
        if name is not None:
            self._put(entries, name, value)
        return max((span.end_line, span.end_column), (value.span.end_line, value.span.end_column))

    def _early(self, key: Scalar, soon: re.Match[str], found: int) -> Scalar:
        """The key of a value that is lost, where it seems to reach into this value: ``A:{bias`` is the key ``A``."""
        name = str(key.value)[: soon.start()]
        at = self._lines.starts[key.span.line - 1] + key.span.column - 1
        del self._refuse.found[found:]
        tight = soon[0].startswith(":")
        rest = self._lines.line(key.span.line)[key.span.column - 1 :]
        words = faults.NO_BLANK if tight else faults.no_colon(_COMMENT.sub("", rest).rstrip())
        self._note(words, at + soon.start() if tight else at)
        return Scalar(name, key.at(0, soon.start()))

    def _key(self, column: int, depth: int) -> _Key:
        """A key of a block, to its colon; what is none has a place and no name."""
        simple = _NAME.match(self._text, self._at, self._end)
        if simple is not None and resolve(simple[1]) == simple[1]:  # most are no more than a name
            number, column = self._here()
            span = Span(self._file, number, column, number, column + len(simple[1]))
            self._at = simple.end()
            return _Key(span, Scalar(simple[1], span))
        if self._indicator("?"):
            self._at += 1
            announced = self._entry(column, depth + 1, fresh=True)
            colon = self._at - self._start == column and self._indicator(":")
            self._at += colon
            return _Key(announced.span, self._as_key(announced), colon, announced=True)
        if self._indicator(":") or self._indicator("-"):
            place = self._here()
            self._left_out(faults.NO_KEY if self._indicator(":") else faults.ITEM_IN_MAPPING)
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
            return self._no_colon(cursor.at)
        self._left_out(faults.KEY_OF_LINES, cursor.at)
        key = node if self._partial and isinstance(node, Scalar) and isinstance(node.value, str) else None
        return _Key(node.span, key, colon=False)

    def _behind_key(self, node: Node, cursor: _Cursor) -> _Key:
        """Pass the colon behind a key that begins at the cursor."""
        if self._at - cursor.at > LONGEST_KEY:
            self._left_out(faults.LONG_KEY, cursor.at)
        colon = _COLON.match(self._text, self._at, self._end)
        assert colon is not None
        self._at = colon.end()
        return _Key(node.span, self._as_key(node))

    def _key_in_text(self, node: Scalar, cursor: _Cursor, columns: tuple[int, int], depth: int, *, fresh: bool) -> Node:
        """A text that goes on for several lines until there is a colon: its last line was meant to be a key.
        ``columns`` are those of the block around it and of its first line."""
        indent, column = columns
        blanks = BLANKS.match(self._text, self._start)
        assert blanks is not None
        here = blanks.end() - self._start
        if fresh and self._plain is not None and (here == column or self._heads(cursor)):
            return self._without_colon(self._no_colon(cursor.at), cursor, column, depth)
        number, above = self._above(node.span.line)
        begin = len(above) - len(above.lstrip())
        if self._plain is None:
            self._left_out(faults.KEY_OF_LINES, cursor.at)
        elif begin >= here and not _KEYED.search(above):
            self._no_colon(self._lines.starts[number - 1] + begin)
        else:
            self._left_out(faults.LATE_KEY, blanks.end())
        self._leave_out(indent)
        return self._lost_node(node)

    # Lists

    def _sequence(self, column: int, depth: int, indent: int) -> Node:
        """A list whose dashes stand in a column, within a block that stands in column ``indent``."""
        self._deep(depth)
        line, first = self._here()
        items: list[Node] = []
        packer: Packer | None = None
        last = line, first
        outer, self._open = self._open, False
        while True:
            if len(items) == PACK_FROM + 1 and (packer := Packer.of(items, self._file)) is not None:
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
            self._left_out(faults.KEY_IN_LIST)
            self._leave_out(column)
        node: Node = Sequence(tuple(items), Span(self._file, line, first, *max((line, first), last)))
        if packer is not None:
            node = packer.finish(Span(self._file, line, first, *packer.end()))
        is_open, self._open = self._open, outer
        return self._lost_node(node) if is_open else node

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
