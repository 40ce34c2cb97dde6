"""A unified diff of two texts whose lines are in the same order, in time in proportion to them.

In: a text before and after. Out: a diff that ``patch`` and ``git apply`` understand. Lines that are there once in both
are what holds the texts together (difflib alone takes hours for a large file in which every other line has changed).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from difflib import SequenceMatcher
from typing import Final, NamedTuple

_CONTEXT: Final = 3
_SMALL: Final = 10_000  # the most pairs of lines that are compared each with each


class _Change(NamedTuple):
    """The lines ``old`` up to ``old_end`` become the lines ``new`` up to ``new_end`` (from 0)."""

    old: int
    old_end: int
    new: int
    new_end: int


def difference(before: str, after: str, name: str) -> str:
    r"""The diff; empty for equal texts.

    >>> print(difference("a\nb\n", "a\nc\n", "x"), end="")
    --- a/x
    +++ b/x
    @@ -1,2 +1,2 @@
     a
    -b
    +c
    """
    old, new = _lines(before), _lines(after)
    written = [f"--- a/{name}\n", f"+++ b/{name}\n"]
    for hunk in _hunks(_changes(old, new)):
        written += _written(hunk, old, new)
    return "".join(written) if len(written) > 2 else ""


def _lines(text: str) -> list[str]:
    """Lines with their ends, which are LF alone: what else a text may hold belongs to its line."""
    lines = [f"{line}\n" for line in text.split("\n")]
    last = lines.pop()
    return lines if last == "\n" else [*lines, last[:-1]]


def _changes(old: Sequence[str], new: Sequence[str]) -> Iterator[_Change]:
    at = _Change(0, 0, 0, 0)
    for i, j in [*_anchors(old, new), (len(old), len(new))]:
        yield from _between(old, new, at.old_end, i, at.new_end, j)
        at = _Change(i, i, j, j)


def _anchors(old: Sequence[str], new: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Places of lines that are there once in both texts, in order."""
    once = {line for line, count in Counter(old).items() if count == 1}
    once &= {line for line, count in Counter(new).items() if count == 1}
    places = {line: j for j, line in enumerate(new) if line in once}
    last = -1
    for i, line in enumerate(old):
        j = places.get(line, -1)
        if j > last:
            yield i, j
            last = j


def _between(
    old: Sequence[str], new: Sequence[str], old_at: int, old_end: int, new_at: int, new_end: int
) -> Iterator[_Change]:
    """The changes in a stretch without anchors; in a large one all that is not equal at its ends."""
    while old_at < old_end and new_at < new_end and old[old_at] == new[new_at]:
        old_at, new_at = old_at + 1, new_at + 1
    while old_at < old_end and new_at < new_end and old[old_end - 1] == new[new_end - 1]:
        old_end, new_end = old_end - 1, new_end - 1
    if (old_end - old_at) * (new_end - new_at) > _SMALL:
        yield _Change(old_at, old_end, new_at, new_end)
        return
    matcher = SequenceMatcher(None, old[old_at:old_end], new[new_at:new_end], autojunk=False)
    for kind, i, i_end, j, j_end in matcher.get_opcodes():
        if kind != "equal":
            yield _Change(old_at + i, old_at + i_end, new_at + j, new_at + j_end)


def _hunks(changes: Iterable[_Change]) -> Iterator[list[_Change]]:
    """Changes whose contexts meet are shown together."""
    hunk: list[_Change] = []
    for change in changes:
        if hunk and change.old - hunk[-1].old_end > 2 * _CONTEXT:
            yield hunk
            hunk = []
        hunk.append(change)
    if hunk:
        yield hunk


def _written(hunk: Sequence[_Change], old: Sequence[str], new: Sequence[str]) -> Iterator[str]:
    begin = max(hunk[0].old - _CONTEXT, 0)
    end = min(hunk[-1].old_end + _CONTEXT, len(old))
    new_begin = hunk[0].new - (hunk[0].old - begin)
    new_end = hunk[-1].new_end + (end - hunk[-1].old_end)
    yield f"@@ -{_range(begin, end)} +{_range(new_begin, new_end)} @@\n"
    at = begin
    for change in hunk:
        yield from _signed(" ", old[at : change.old])
        yield from _signed("-", old[change.old : change.old_end])
        yield from _signed("+", new[change.new : change.new_end])
        at = change.old_end
    yield from _signed(" ", old[at:end])


def _range(begin: int, end: int) -> str:
    """First line and number of lines; an empty stretch is named by the line before it."""
    return f"{begin + 1 if end > begin else begin},{end - begin}"


def _signed(sign: str, lines: Iterable[str]) -> Iterator[str]:
    for line in lines:
        yield sign + line if line.endswith("\n") else f"{sign}{line}\n\\ No newline at end of file\n"
