"""Collections in brackets.

In: a scanner that stands at a bracket. Out: the list or the mapping, however many lines it takes. A comma that has cut
a text (``{weight: normal(0, 1)}``) is reported, and the text read as it was meant.
"""

from __future__ import annotations

import re
from typing import Final

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.yaml import faults
from neurovis_spec.language.yaml.faults import Words
from neurovis_spec.language.yaml.packed import PACK_FROM, Packer, balance
from neurovis_spec.language.yaml.refusals import DEEPEST, MOST_ENTRIES, ReadingStoppedError
from neurovis_spec.language.yaml.scalars import NumberRangeError, resolve
from neurovis_spec.language.yaml.scanner import (
    ENDS_TEXT,
    FIRST,
    LONGEST_KEY,
    SIMPLE,
    VISIBLE,
    Plain,
    Scanner,
    Unquoted,
    UnsoundError,
)
from neurovis_spec.language.yaml.source import Entry, Mapping, Node, Scalar, ScalarValue, Sequence
from neurovis_spec.language.yaml.texts import Written

_FLOW_TEXT: Final = Unquoted(
    re.compile(FIRST + r"-(?![\s,\[\]{}]|\Z))", re.ASCII),
    re.compile(rf":(?=[\s,\[\]{{}}]|\Z)|{ENDS_TEXT}|,|\[|\]|\{{|\}}", re.ASCII),
)
_COMMA: Final = re.compile(r"\s*,\s*", re.ASCII)
#: Digits, and further ones that commas set apart.
_DIGITS: Final = re.compile(r"[0-9]+")
_THOUSANDS: Final = re.compile(r"(?:,[0-9]{3})+(?![\w.])")
_FLOW_COLON: Final = re.compile(r"[ \t]*:")
_TIGHT: Final = re.compile(r":[,\[\]{}]")
#: A list of texts and numbers that need no second look.
_SIMPLE_ROW: Final = re.compile(r"\[([^\[\]{}'\"#&*!|>%@`?:\r\n]*)\]")
SIMPLE_PAIR: Final = re.compile(SIMPLE + r" *(?:, *|(?=\}))")
_FLOW_SIGNS: Final = frozenset(",[]{}")
_CLOSING: Final = {"[": "]", "{": "}"}


class Brackets(Scanner):
    """Reads what stands in brackets, and entries of mappings in general."""

    def _flow(self, depth: int) -> Node:
        self._deep(depth)
        return self._list(depth) if self._text[self._at] == "[" else self._braces(depth)

    def _closed(self, opening: str, begin: int) -> bool:
        """Whether a collection that a bracket has opened ends here; one that closes it is passed."""
        character, closing = self._gap(), _CLOSING[opening]
        if not character:
            more = VISIBLE.search(self._text, self._end)
            self._report(faults.unclosed(opening, closing, self._lines.place(self._end)[0] if more else None), begin)
        elif character not in "]}":
            return False
        elif character != closing:
            self._report(faults.wrong_bracket(character, opening, closing))
        self._at += bool(character)
        return True

    def _comma(self, opening: str, *, behind_key: bool = False) -> None:
        """Pass the comma between two items; none is wanted before a closing bracket. ``behind_key``: the last item was
        a key without a colon."""
        character = self._gap()
        if character and character not in ",]}":
            self._report(*self._apart(character, opening, behind_key))
        self._at += character in (",", ":")

    def _apart(self, character: str, opening: str, behind_key: bool) -> tuple[Words, int]:
        """What is wrong where no comma stands between two items, and where."""
        before = self._plain
        if character == ":" and self._text[self._at - 1 : self._at].strip() and _TIGHT.match(self._text, self._at):
            return faults.NO_BLANK, self._at
        if character == ":" and before is not None and len(self._text[before.begin : before.end].split()) == 1:
            return faults.SECOND_COLON, self._at
        if before is None or character not in "[{" or self._line != before.scalar.span.line:
            return faults.no_comma(_CLOSING[opening]), self._at
        written = self._text[before.begin : before.end]
        tight = self._at == before.end
        if behind_key and character == "[" and (tight or written.rstrip().endswith(("->", "+"))):
            return faults.bracket_in_key(written), self._at
        if behind_key:
            return faults.no_colon(f"{written} {character}…{_CLOSING[character]}"), before.begin
        return faults.settings_apart(written), self._at

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
            self._append(items, self._item(depth + 1))
            self._comma("[")
        self._plain = None
        span = self._from(*place)
        packer = Packer.of(items, self._file) if len(items) > PACK_FROM else None
        return Sequence(tuple(items), span) if packer is None else packer.finish(span)

    def _simple_row(self, cells: list[tuple[ScalarValue, int, int]], span: Span) -> Node:
        """A list of texts and numbers on one line."""
        if len(cells) > PACK_FROM:
            packer = Packer(self._file, in_rows=False)
            if packer.add_cells(cells, span.line):
                return packer.finish(span)
        line = span.line
        return Sequence(
            tuple(Scalar(value, Span(self._file, line, one, line, other)) for value, one, other in cells), span
        )

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

    def _braces(self, depth: int) -> Mapping:
        place, begin = self._here(), self._at
        self._at += 1
        entries: dict[str, Entry] = {}
        empty, before = True, None
        while not self._closed("{", begin):
            empty = False
            match = SIMPLE_PAIR.match(self._text, self._at, self._end)
            if match is not None and (simple := self._simple_entry(match, entries)) is not None:
                before = Plain(match.start(2), match.end(2), simple)
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
            self._comma("{", behind_key=not colon)
        self._plain = None
        return self._made(entries, self._from(*place), empty=empty)

    def _flow_colon(self, line: int, at: int, *, announced: bool) -> bool:
        """Pass the colon behind a key that begins on a line, if there is one."""
        match = _FLOW_COLON.match(self._text, self._at, self._end)
        if match is None or (line != self._line and not announced):
            return False
        if self._plain is not None and self._text[match.end() : match.end() + 1] in _FLOW_SIGNS:
            return False
        if match.end() - at > LONGEST_KEY and not announced:
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
        scalar = self._plain_text(_FLOW_TEXT, -1)
        return scalar if self._partial or self._plain is None else self._past_commas(self._plain)

    # Texts that a comma has cut

    def _past_commas(self, first: Plain) -> Scalar:
        """A text as it was meant that commas have cut: ``{weight: normal(0, 1)}`` reads as ``normal(0`` and ``1)``. It
        goes on while one of its parentheses is open."""
        text, span = self._text, first.scalar.span
        unclosed = balance(text[first.begin : first.end])
        while unclosed > 0 and (last := self._cut_off()) is not None:
            unclosed += balance(text[self._at : last])
            self._move(last)
        if self._at == first.end:
            return first.scalar
        written = text[first.begin : self._at]
        whole = Scalar(written, self._from(span.line, span.column))
        if span.line != self._line:
            whole = Scalar(" ".join(written.split()), whole.span, None, Written(text, first.begin, self._at))
        self._refuse.cut_text(whole, text[first.begin : first.end])
        self._plain = None
        return whole

    def _cut_off(self) -> int | None:
        """Where the text behind the next comma ends; None where there is none, or where it is a key."""
        comma = _COMMA.match(self._text, self._at, self._end)
        last = comma and _FLOW_TEXT.begun(self._text, comma.end(), self._end)
        return None if last is None or _FLOW_COLON.match(self._text, last, self._end) else last

    def _is_cut_off(self, before: Plain | None, key: Plain | None) -> bool:
        """Whether a key without a colon is a piece of the value before it, which a comma has cut."""
        if before is None or key is None or self._partial:
            return False
        one, other = before.scalar, key.scalar
        if _is_number(one) and (_is_number(other) or _DIGITS.fullmatch(self._text, key.begin, key.end)):
            if self._text[before.end : key.begin] != ",":
                return False
            more = _THOUSANDS.match(self._text, key.end, self._end)
            self._at = key.end if more is None else more.end()
            span = self._from(one.span.line, one.span.column)
            self._refuse.number_with_commas(self._text[before.begin : self._at], span)
            self._lost.append(one.span)  # it is a part of what was meant
            return True
        if isinstance(one.value, str) and isinstance(other.value, str) and "->" not in other.value:
            self._refuse.stray_text(one, other)
            return True
        return False

    # Entries

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

    def _put(self, entries: dict[str, Entry], key: Scalar, value: Node) -> None:
        """Take an entry up, unless its key is there already; parts of a text may have a key twice."""
        name = str(key.value)
        if name in entries and not self._partial:
            self._refuse.duplicate(key, entries[name])
            return
        if name in entries:
            name = f"{name}\0{len(entries)}"
        if len(entries) >= MOST_ENTRIES:
            if self._trial:
                raise UnsoundError(faults.NOWHERE, self._at)
            self._refuse.too_many(key.span)
            raise ReadingStoppedError
        entries[name] = Entry(key, value)

    def _simple_entry(self, match: re.Match[str], entries: dict[str, Entry]) -> Scalar | None:
        """Take up a name and a value; None, and nothing taken, where they need a second look."""
        name = match[1]
        try:
            value = resolve(match[2])
        except NumberRangeError:
            return None
        if not self._is_new(name, entries):
            return None
        file, line, start = self._file, self._line, self._start - 1
        key = Scalar(name, Span(file, line, match.start() - start, line, match.end(1) - start))
        scalar = Scalar(value, Span(file, line, match.start(2) - start, line, match.end(2) - start))
        entries[name] = Entry(key, scalar)
        return scalar

    def _append(self, items: list[Node], item: Node) -> None:
        """Put an item into a list, which may not hold more mappings than a mapping may hold entries."""
        if len(items) >= MOST_ENTRIES and isinstance(item, Mapping):
            if self._trial:
                raise UnsoundError(faults.NOWHERE, self._at)
            self._refuse.too_long(item.span)
            raise ReadingStoppedError
        items.append(item)

    def _is_new(self, name: str, entries: dict[str, Entry]) -> bool:
        """Whether a name can be put into a mapping as a key without a second look."""
        return (
            name not in entries and resolve(name) == name and len(name) <= LONGEST_KEY and len(entries) < MOST_ENTRIES
        )

    def _made(self, entries: dict[str, Entry], span: Span, *, empty: bool = False, is_open: bool = False) -> Mapping:
        """A mapping. That it has no entries though it is not ``empty`` follows from what was refused."""
        if not entries and not empty:
            self._lost.append(span)
        return Mapping(tuple(entries.values()), span, is_open)

    def _deep(self, depth: int) -> None:
        """Refuse a collection below the deepest level; nothing more is read then."""
        if depth > DEEPEST:
            if self._trial:
                raise UnsoundError(faults.NOWHERE, self._at)
            self._refuse.too_deep(self._span(self._at + 1))
            raise ReadingStoppedError


def _is_number(scalar: Scalar) -> bool:
    return isinstance(scalar.value, int | float) and not isinstance(scalar.value, bool)
