"""Where the cursor stands in a text that somebody is in the middle of writing.

In: the text of a spec, whatever state it is in, and a place. Out: the keys that lead there, and what is written up to
it. A character is put at the place, and looked for in what the reader makes of the text then.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from neurovis_spec.language.yaml.reader import read_any
from neurovis_spec.language.yaml.source import Scalar
from neurovis_spec.lsp.outline import Path, nodes_at
from neurovis_spec.lsp.text import Place, Text

#: A character that nobody writes, and that may be a part of any text.
_MARK: Final = "\ue000"
_COLON: Final = re.compile(r"[\"']?[ \t]*:")


@dataclass(frozen=True, slots=True)
class Where:
    """Where a place stands.

    ``mapping`` is the path of the mapping of which a key may stand here, ``value`` the path of which the value may;
    None where it cannot be. ``typed`` is what is written before the place, ``rest`` what is written behind it;
    ``colon`` says that a colon follows.
    """

    mapping: Path | None
    value: Path | None
    typed: str
    rest: str
    colon: bool = False


def where(text: Text, place: Place) -> Where | None:
    """Where a place stands; None within a comment or a block text, where nothing is looked for."""
    first, lines = _section(text, place.line)
    line, at = lines[place.line - first], place.column - 1
    blank = " " if line[:at].endswith(":") else ""
    lines[place.line - first] = marked = line[:at] + blank + _MARK + line[at:]
    at += len(blank)
    root = read_any("\n".join(lines), "")
    found = [] if root is None else nodes_at(root, Place(place.line - first + 1, at + 1))
    if not found:
        return None
    path, scalar, is_key = found[-1]
    if not isinstance(scalar, Scalar) or _MARK not in str(scalar.value):
        return None
    span = scalar.span
    begin = span.column - 1 if span.line == place.line - first + 1 else len(marked) - len(marked.lstrip())
    end = span.end_column - 1 if span.end_line == place.line - first + 1 else len(marked)
    before = marked[:begin]
    if span.line != span.end_line and lines[span.line - 1][span.column - 1] in "|>":
        return None
    quoted = marked[begin : begin + 1] in ("'", '"')
    typed, rest = marked[begin + quoted : at], marked[at + 1 : end]
    if quoted:
        rest = rest.rstrip("'\"")
    if is_key:
        return Where(path[:-1], None, typed, rest, _COLON.match(marked, end) is not None)
    own_line = not before.strip(" -?") and not any(
        lines[node.span.line - 1][node.span.column - 1] in "[{" for _, node, _ in found[:-1]
    )
    return Where(path if own_line else None, path or None, typed, rest)


def _section(text: Text, number: int) -> tuple[int, list[str]]:
    """The lines around one that belong to the same key at the top, behind the number of the first of them: what is
    above and below is over there, whatever is open."""
    first, last = number, number + 1
    while first > 1 and _within(text.line(first)):
        first -= 1
    while last <= len(text.lines.starts) and _within(text.line(last)):
        last += 1
    return first, [text.line(line) for line in range(first, last)]


def _within(line: str) -> bool:
    return (line[:1] or " ") in " \t#-]}"
