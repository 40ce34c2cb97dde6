"""Around a syntax error: the value that holds it, which is left out so that the rest of the text can be read.

In: a text's lines, and the line at which a parser gave up. Out: where the value begins that this line's key or list
item has, and where it ends: before the next line that is indented no further. None where there is no key on the line,
so that nobody can tell what would be missing.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from neurovis_spec.language.yaml.characters import Lines

#: Syntax errors of one text that are looked behind, and the largest text (characters) in which they are.
MOST_MENDED: Final = 20
LARGEST_MENDED: Final = 1 << 20
#: What stands for the value that was left out: a plain text of one character.
UNREAD: Final = "~"
_KEY: Final = re.compile(
    r" *(?P<dashes>(?:- +)*)"
    r"(?:(?P<key>\"[^\"\\]*\"|'[^']*'|[^\s#\"'\[\]{}&*!|>%@`,?:-][^#]*?)[ \t]*:[ \t]+)?(?P<value>[^\s#].*)"
)
#: Where a value has begun without a colon and a blank before it.
_TOO_SOON: Final = re.compile(r":(?=[^ ])|[ \t]*:?[ \t]*[\[{]")


class Stretch(NamedTuple):
    """Characters ``start`` to ``end`` of a text, in whose stead ``instead`` is read, of which the last character stands
    for the value, on ``line`` in ``column`` (from 1)."""

    start: int
    end: int
    instead: str
    line: int
    column: int

    @property
    def unread(self) -> int:
        """Where what stands for the value begins."""
        return self.start + len(self.instead) - 1


def faulty_value(lines: Lines, number: int) -> Stretch | None:
    """The value of the key, or of the list item, on line ``number``."""
    text = lines.line(number)
    match = _KEY.fullmatch(text)
    if match is None or not (match["key"] or match["dashes"]) or match["value"] == UNREAD:
        return None
    depth = match.start("key") if match["key"] else match.start("value") - 1
    last = number
    while last < len(lines.starts) and _within(lines.line(last + 1), depth):
        last += 1
    begin, instead = match.start("value"), UNREAD
    soon = _TOO_SOON.search(text, match.start("key"), match.end("key")) if match["key"] else None
    if soon is not None:  # what looks like the key reaches into the value
        begin, instead = soon.start(), f": {UNREAD}"
    first = lines.starts[number - 1]
    end = lines.starts[last - 1] + len(lines.line(last))
    if first + begin + len(instead) > end:
        return None
    return Stretch(first + begin, end, instead, number, begin + len(instead))


def _within(line: str, depth: int) -> bool:
    """Whether a line belongs to a value whose key is that deep."""
    stripped = line.lstrip(" ")
    return not stripped or stripped[0] == "#" or len(line) - len(stripped) > depth


def left_out(text: str, stretch: Stretch) -> str:
    """The text without the value, so that everything else stays where it was."""
    gone = re.sub(r"[^\r\n]", " ", text[stretch.start : stretch.end])
    return text[: stretch.start] + stretch.instead + gone[len(stretch.instead) :] + text[stretch.end :]
