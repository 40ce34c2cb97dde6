"""Adding to a list of a spec, with everything else in it left as its author wrote it, byte for byte.

In: the text of a spec, the name of a list at its top, and items as they are written. Out: the text in which they are
its last ones. Unlike ``edit`` nothing is formatted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.format.canonical import FormattingError, with_line_feeds
from neurovis_spec.language.format.printer import Source
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import AnyList, Entry, Mapping, Scalar

_STEP = 2


class _Insertion(NamedTuple):
    """Text at an index."""

    at: int
    text: str


def append(text: str, key: str, items: Sequence[str], comments: Sequence[str] = ()) -> str:
    r"""The text of a spec, which the reader has accepted, with ``items`` behind those of the list ``key``, and below
    them ``comments``, a line each. Raises FormattingError where there is no such place.

    >>> print(append("a: 1   # one\nevents: [{at: 1}]\n", "events", ["{at: 2}"], ["# more"]), end="")
    a: 1   # one
    events: [{at: 1}, {at: 2}]
    # more
    """
    plain = with_line_feeds(text)
    document = read_text(plain, "", Findings())
    assert document is not None
    for one in reversed(_insertions(Source(plain), document.root, key, items, comments)):
        text = _inserted(text, one)
    again = read_text(with_line_feeds(text), "", Findings())
    if again is None or _count(again.root, key) != _count(document.root, key) + len(items):
        raise FormattingError(f"{key} cannot be added here")
    return text


def _count(root: Mapping, key: str) -> int:
    found = root.get(key)
    return len(found) if isinstance(found, AnyList) else 0


def _insertions(
    source: Source, root: Mapping, key: str, items: Sequence[str], comments: Sequence[str]
) -> list[_Insertion]:
    """Insertions that add the items, in order."""
    entry, is_block = root.entry(key), source.is_block(root)
    column = root.span.column - 1 if is_block else 0
    if entry is None:
        if not is_block:
            last = source.end(root.entries[-1].value)
            more = [_Insertion(last, f", {key}: [{', '.join(items)}]")] if items else []
            return [*more, _below(source, source.end(root), 0, comments)]
        begin = f"{' ' * column}{key}:\n" if items else ""
        lines = begin + _lines(column + _STEP, [f"- {item}" for item in items]) + _lines(column, comments)
        at = _next_line(source, source.end(root))
        rest = source.text[at:]
        if rest and not rest.strip():  # these blank lines may belong to the last text
            return [_Insertion(len(source.text), lines)]
        return [_Insertion(at, "\n" + lines if items else lines)]
    return _into(source, entry, column, items, comments)


def _into(source: Source, entry: Entry, column: int, items: Sequence[str], comments: Sequence[str]) -> list[_Insertion]:
    """Behind the items of a list that there is, which may be empty."""
    value = entry.value
    begin, end = source.begin(value), source.end(value)
    dashed = [f"- {item}" for item in items]
    if isinstance(value, Scalar) and value.value is None and begin == end:  # a key alone
        return [_below(source, source.end(entry.key), column + _STEP, [*dashed, *comments])]
    if not isinstance(value, AnyList):
        raise FormattingError(f"{entry.name} is no list")
    if source.is_block(value):
        return [_below(source, end, value.span.column - 1, [*dashed, *comments])]
    members = value.items
    at = source.end(members[-1]) if members else begin + 1
    apart = ", "
    if members and "\n" in source.text[begin : source.begin(members[-1])]:
        apart = ",\n" + " " * (members[-1].span.column - 1)
    added = (apart if members and items else "") + apart.join(items)
    return [_Insertion(at, added), _below(source, end, column, comments)]


def _lines(column: int, lines: Sequence[str]) -> str:
    return "".join(f"{' ' * column}{line}\n" for line in lines)


def _next_line(source: Source, at: int) -> int:
    return source.text.index("\n", at) + 1


def _below(source: Source, at: int, column: int, lines: Sequence[str]) -> _Insertion:
    """Lines in a column, below that of an index."""
    return _Insertion(_next_line(source, at), _lines(column, lines))


def _inserted(text: str, one: _Insertion) -> str:
    """A text with something at an index of the same text with line feeds; it has the line ends that the text has."""
    bom = "\ufeff" if text.startswith("\ufeff") else ""
    text, added, at = text.removeprefix(bom), one.text, one.at
    if not added:
        return bom + text
    crlf = "\r\n" in text
    if crlf:
        place = text.find("\r\n")
        while 0 <= place < at:
            at += 1
            place = text.find("\r\n", place + 2)
    if at > len(text):  # the last line has no end
        added, at = "\n" + added, len(text)
    return bom + text[:at] + (added.replace("\n", "\r\n") if crlf else added) + text[at:]
