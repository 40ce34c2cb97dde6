"""Where the characters of a text stand that YAML has folded, or that holds escapes.

In: a stretch of a document that holds a scalar, and its value. Out: for each character of the value its place in the
document. YAML changes nothing but blanks, line ends, doubled quotes and escapes: so what is none of these is found in
the same order in both.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from functools import lru_cache
from typing import Final, NamedTuple

from neurovis_spec.language.yaml.texts import OTHERWISE, meaning

_BREAK: Final = re.compile("\r\n|\n|\r")


class Written(NamedTuple):
    """A scalar as it is written: the characters ``begin`` to ``end`` of a text, quotes and headers among them."""

    text: str
    begin: int
    end: int

    def places(self, value: str) -> tuple[tuple[int, int], ...] | None:
        """For each character of the value how many lines below the begin it stands, and how many columns behind the
        begin of its line (of the first line: behind the begin of the scalar); None where the value is another one.

        Blanks and line ends of the value stand where those before them end.

        >>> Written("'it''s\\n  so'", 0, 12).places("it's so")
        ((0, 1), (0, 2), (0, 3), (0, 5), (0, 6), (1, 2), (1, 3))
        """
        found = _places(self, value)
        return None if found is None else tuple((line, column) for _, line, column in found)

    def part(self, value: str, start: int, end: int) -> Written | None:
        """How the characters ``start`` to ``end`` of the value are written."""
        found = _places(self, value)
        if not found or not start < end <= len(found):
            return None
        return Written(self.text, self.begin + found[start][0], self.begin + found[end - 1][0] + 1)

    def pieces(self) -> Iterator[tuple[str, int, int]]:
        """The characters that are no blanks, each with where it begins and ends."""
        raw = self.text[self.begin : self.end]
        at, end = 0, len(raw)
        if raw[:1] in ("|", ">"):
            header = _BREAK.search(raw)
            at = end if header is None else header.end()
        elif (pattern := OTHERWISE.get(raw[:1])) is not None:
            at, end = 1, end - 1
            for match in pattern.finditer(raw, at, end):
                yield from _visible(raw, at, match.start())
                at = match.end()
                if character := meaning(match).strip():
                    yield character, match.start(), at
        yield from _visible(raw, at, end)


@lru_cache(maxsize=4)
def _places(written: Written, value: str) -> tuple[tuple[int, int, int], ...] | None:
    """For each character its offset, line and column. Of one text several are asked for, one after the other."""
    pieces = written.pieces()
    offsets: list[int] = []
    behind = 0
    for character in value:
        if character.isspace():
            offsets.append(behind)
            continue
        found, start, stop = next(pieces, ("", 0, 0))
        if found != character:
            return None
        offsets.append(start)
        behind = stop
    if next(pieces, None) is not None:
        return None
    raw = written.text[written.begin : written.end]
    starts = [0, *(match.end() for match in _BREAK.finditer(raw))]
    lines = (bisect_right(starts, offset) - 1 for offset in offsets)
    return tuple((offset, line, offset - starts[line]) for line, offset in zip(lines, offsets, strict=True))


def _visible(raw: str, begin: int, end: int) -> Iterator[tuple[str, int, int]]:
    for at in range(begin, end):
        if not raw[at].isspace():
            yield raw[at], at, at + 1
