"""What a text stands for that is written in quotes, over several lines, or behind | or >.

In: the characters as they are written. Out: the text. Line breaks within become blanks, blank lines line breaks;
escapes stand for characters.
"""

from __future__ import annotations

import re
from typing import Final

_FOLD: Final = r"[ \t]*(?:\r\n|\n|\r)[ \t]*((?:(?:\r\n|\n|\r)[ \t]*)*)"
_PLAIN: Final = re.compile(_FOLD)
_SINGLE: Final = re.compile(f"''|{_FOLD}")
#: An escape of a text in double quotes: the end of a line behind which the text goes on, one with a number, any other.
_ESCAPES: Final = (
    r"\\(?:(?:\r\n|\n|\r)[ \t]*((?:(?:\r\n|\n|\r)[ \t]*)*)|x([0-9A-Fa-f]{2})|u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))"
)
_DOUBLE: Final = re.compile(f"{_ESCAPES}|{_FOLD}", re.DOTALL)
#: What is written otherwise between quotes, by the quote.
OTHERWISE: Final = {"'": _SINGLE, '"': _DOUBLE}
_BREAK: Final = re.compile(r"\r\n|\n|\r")
_ESCAPED: Final = {
    **{"0": "\0", "a": "\a", "b": "\b", "t": "\t", "\t": "\t", "n": "\n", "v": "\v", "f": "\f", "r": "\r", "e": "\x1b"},
    **{" ": " ", '"': '"', "/": "/", "\\": "\\", "N": "\x85", "_": "\xa0", "L": "\u2028", "P": "\u2029"},
}


class EscapeError(ValueError):
    """An escape that YAML does not know; ``at`` is where its backslash is."""

    def __init__(self, at: int) -> None:
        super().__init__(at)
        self.at = at


def plain(written: str) -> str:
    r"""An unquoted text.

    >>> plain("one\n  two\n\n  three")
    'one two\nthree'
    """
    return _PLAIN.sub(_folded, written)


def single(inner: str) -> str:
    """What stands between single quotes."""
    return _SINGLE.sub(meaning, inner)


def double(inner: str) -> str:
    """What stands between double quotes. Raises EscapeError."""
    return _DOUBLE.sub(meaning, inner)


def _folded(match: re.Match[str]) -> str:
    """One line break is a blank; of more the first says nothing."""
    later = match[match.re.groups]
    return "\n" * len(_BREAK.findall(later)) if later else " "


def meaning(match: re.Match[str]) -> str:
    """The characters that an escape, a doubled quote or a line break between quotes stands for. Raises EscapeError."""
    if match[0] == "''":
        return "'"
    if match[0][0] != "\\":
        return _folded(match)
    if match[1] is not None:
        return "\n" * len(_BREAK.findall(match[1]))
    number = match[2] or match[3] or match[4]
    if number is None:
        if match[5] not in _ESCAPED:
            raise EscapeError(match.start())
        return _ESCAPED[match[5]]
    code = int(number, 16)
    if code > 0x10FFFF or 0xD800 <= code < 0xE000:
        raise EscapeError(match.start())
    return chr(code)


def block(lines: list[str], *, folded: bool, chomping: str | None) -> str:
    r"""A text behind | or > (``folded``), of which these are the lines without their indentation. Of the line breaks at
    its end one is kept, with ``-`` none and with ``+`` all.

    >>> block(["one", "two", "", "three", "  four", ""], folded=True, chomping=None)
    'one two\nthree\n  four\n'
    """
    count = len(lines)
    while count and not lines[count - 1]:
        count -= 1
    behind = len(lines) - count
    text = _fold(lines[:count]) if folded else "\n".join(lines[:count])
    if chomping == "-":
        return text
    if chomping == "+":
        return text + "\n" * (behind + (count > 0))
    return text + "\n" * (count > 0)


def _fold(lines: list[str]) -> str:
    """Lines become one, but for those that are indented further."""
    parts: list[str] = []
    breaks, before = 0, None
    for line in lines:
        if not line:
            breaks += 1
            continue
        if before is not None:
            apart = line[0] in " \t" or before[0] in " \t"
            parts.append("\n" * (breaks + 1) if apart else "\n" * breaks or " ")
        else:
            parts.append("\n" * breaks)
        parts.append(line)
        breaks, before = 0, line
    return "".join(parts)
