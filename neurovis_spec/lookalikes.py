"""Characters that look like others, or like nothing: what they are to be in names, keys and expressions.

In: a text. Out: the same in ASCII, where each character has such a double; which of its characters are no ASCII.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from typing import Final

_CYRILLIC: Final = ("АВЕКМНОРСТУХаеорсухіјѕһԁԛԝЅІЈҮ", "ABEKMHOPCTYXaeopcyxijshdqwSIJY")
_GREEK: Final = ("ΑΒΕΖΗΙΚΜΝΟΡΤΥΧοϲ", "ABEZHIKMNOPTYXoc")
_SIGNS: Final[Mapping[str, str]] = {
    "→": "->", "⟶": "->", "➔": "->", "➜": "->", "⇒": "->", "–": "-", "—": "-", "‐": "-", "‑": "-", "‒": "-", "−": "-",
    "“": '"', "”": '"', "„": '"', "‘": "'", "’": "'",
}  # fmt: skip
_DOUBLES: Final = {**dict(zip(*_CYRILLIC, strict=True)), **dict(zip(*_GREEK, strict=True)), **_SIGNS}
#: Characters that are not seen, or seen as a blank.
_UNSEEN: Final = frozenset({"Zs", "Cf", "Cc", "Zl", "Zp"})
_NOT_ASCII: Final = re.compile(r"[^\x00-\x7f]")


def unseen(character: str) -> bool:
    """Whether a character is none of ASCII and is not seen, or seen as a blank."""
    return not character.isascii() and unicodedata.category(character) in _UNSEEN


def double(character: str) -> str | None:
    """What a character looks like in ASCII; nothing where it is not seen, None where it looks like itself alone.

    >>> double(chr(0x410)), double(chr(0x200B)), double(chr(0xA0)), double(chr(0xE9))
    ('A', '', ' ', None)
    """
    if unseen(character):
        return " " if unicodedata.category(character) == "Zs" else ""
    known = _DOUBLES.get(character) or unicodedata.normalize("NFKC", character)
    return known if known.isascii() else None


def in_ascii(text: str) -> str:
    """A text as its author sees it, in ASCII, as far as there are such characters.

    >>> in_ascii("le" + chr(0x200B) + "ft" + chr(0xA0)), in_ascii("café")
    ('left', 'café')
    """
    if text.isascii():
        return text
    return _NOT_ASCII.sub(lambda match: match[0] if (seen := double(match[0])) is None else seen, text).strip()


def strange(text: str) -> tuple[str, ...]:
    """The characters of a text that are no ASCII, each once."""
    return () if text.isascii() else tuple(dict.fromkeys(_NOT_ASCII.findall(text)))
