"""What stands between two values of a spec: comments, line breaks, blank lines.

In: a text and the stretch from the end of one value to the begin of the next. Out: a Gap. No value begins or ends in
such a stretch, so whatever begins with # in it is a comment; commas, colons and dashes in it are passed over.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

_PIECE: Final = re.compile(r"#[^\n]*|\n|\.\.\.")
_PROLOGUE_PIECE: Final = re.compile(r"[#%][^\n]*|\n")


class Comment(NamedTuple):
    """A comment with its #; its ``column`` (from 0), how many blanks are between the code before and it (``behind``),
    and whether the line above is ``blank``."""

    text: str
    column: int
    behind: int = 0
    blank: bool = False


class Gap(NamedTuple):
    """The comment on the line of the token before, the comments on lines of their own, whether a blank line comes
    last, and whether there is any line break."""

    trailing: Comment | None
    own: tuple[Comment, ...]
    blank: bool
    broken: bool

    @property
    def comments(self) -> tuple[Comment, ...]:
        """All of them, in the order written."""
        return self.own if self.trailing is None else (self.trailing, *self.own)


NONE: Final = Gap(None, (), False, False)
_BREAK: Final = Gap(None, (), False, True)
_BLANK: Final = Gap(None, (), True, True)


def read_gap(text: str, start: int, stop: int, *, prologue: bool = False) -> Gap:
    r"""The gap from ``start`` up to ``stop``; in a ``prologue`` lines that begin with % (directives) are kept, too.

    >>> gap = read_gap("a: 1  # one\n\n# two\nb: 2", 4, 19)
    >>> gap.trailing, gap.own
    (Comment(text='# one', column=6, behind=2, blank=False), (Comment(text='# two', column=0, behind=0, blank=True),))
    """
    if text.find("\n", start, stop) < 0:  # a comment ends with its line
        return NONE
    trailing: Comment | None = None
    own: list[Comment] = []
    breaks = 0
    line = start
    on_line = start > 0 and text[start - 1] != "\n"
    for match in (_PROLOGUE_PIECE if prologue else _PIECE).finditer(text, start, stop):
        if text[match.start()] == "\n":
            breaks += 1
            line = match.end()
            continue
        if text[match.start()] == ".":  # the document's end, which is left out
            breaks, on_line = 0, False
            continue
        written = match.group().rstrip()
        if on_line and breaks == 0:
            line = text.rfind("\n", 0, start) + 1
            before = text[start : match.start()]
            behind = len(before) - len(before.rstrip())
            trailing = Comment(written, match.start() - line, behind)
        else:
            own.append(Comment(written, match.start() - line, 0, breaks >= 2))
        breaks = 0
    if not own and trailing is None:
        return _BLANK if breaks >= 2 else _BREAK
    return Gap(trailing, tuple(own), breaks >= 2, True)


def joined(first: Gap, *later: Gap) -> Gap:
    """The first gap, with the comments of later gaps after its own, each on a line of its own."""
    moved = [comment._replace(behind=0, blank=False) for gap in later for comment in gap.comments]
    if not moved:
        return first
    moved[0] = moved[0]._replace(blank=first.blank)
    return Gap(first.trailing, (*first.own, *moved), False, True)
