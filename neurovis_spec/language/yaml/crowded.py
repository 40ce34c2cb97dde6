"""Crowded texts: mappings with more entries than a spec may have, and lists of as many mappings, found before a node
is made of any of them.

In: a text. Out: where the first entry stands that is one too many. Lines are looked at by how they begin alone, so this
takes a part of the time that reading takes, and no memory; what stands within brackets the parser counts itself.
"""

from __future__ import annotations

import re
from typing import Final

#: the most entries of a mapping, and mappings of a list: as many as there may be neurons, each a group by itself
MOST_ENTRIES: Final = 1_000_000
#: an entry has a name of a character, a colon and an end of the line at least
_SHORTEST = 3
#: the begin of a line that holds something: an item of a list (and whether a mapping), or a key with its colon
_KEY = r"(?![\[\]{}#\s])[^\n]*?:(?=[ \r\n])"
_BEGIN = re.compile(rf"^( *)(?:(-)(?=[ \r\n])((?: *\r?\n)? +(?:\{{|{_KEY}))?|{_KEY})", re.MULTILINE)


def crowded(text: str, most: int = MOST_ENTRIES) -> int | None:
    """The offset of the first entry that its mapping is too large for, or mapping (its dash) that its list is; None
    where there is none.

    >>> crowded("a:\\n  b: 1\\n  c: 2\\nd:\\n  e: 3\\n", 2), crowded("a:\\n  b: 1\\n  c: 2\\n  d: 3\\n", 2)
    (None, 19)
    """
    if len(text) <= _SHORTEST * most:
        return None
    #: how many entries there are by now at a depth, outer ones first; a list may stand in the column of its key
    counts: list[tuple[int, int]] = []
    for begin in _BEGIN.finditer(text):
        depth = 2 * (begin.end(1) - begin.start()) + (begin[2] is not None)
        while counts and counts[-1][0] > depth:  # the mappings of another item are others
            counts.pop()
        if begin[2] is not None and begin[3] is None:  # long lists of numbers take little
            continue
        number = counts.pop()[1] + 1 if counts and counts[-1][0] == depth else 1
        if number > most:
            return begin.end(1)
        counts.append((depth, number))
    return None
