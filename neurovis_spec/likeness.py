"""Likeness: which of known names are much like another, which characters look alike, and what an author is told.

In: a name, known names. Out: those like it, best first; the one that it can only be meant for; a help line. Few names
are compared in full. Of the others a bound says that they are not like it: no name is more alike than the letters that
both have, and of many names, which are prepared once, those that both have in the same order (the longest common
subsequence, found for all names at once: Hyyrö 2004). Characters that look like others, or like nothing, are taken for
what they are to be: ``in_ascii``.
"""

from __future__ import annotations

import re
import unicodedata
from bisect import bisect_left, insort
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from neurovis_spec.diagnostics import listed

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


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

#: What a first letter that is right is worth, as it is seldom mistyped; how alike names are at least that have the same
#: letters (letters changed over are the commonest slip), of which one begins the other, or that differ in their number.
_FIRST, _LETTERS, _BEGINS, _STEM = 0.05, 0.97, 0.75, 0.7
#: What is less alike is not offered, nor what is less so than the best by more than this.
_LEAST, _WORSE = 0.6, 0.12
#: So many like names are looked for.
MOST: Final = 6
#: More names than this are prepared; of names the beginning of this length, by which a longer one is not judged.
_FEW, _LONGEST = 60, 63
#: Rounding of bounds.
_SLACK = 1e-9


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


def nearest(name: str, known: Iterable[str], most: int = 3) -> tuple[str, ...]:
    """The known names that are most like ``name``, best first, up to six; none that is too far off.

    >>> nearest("kerel", ["kernel", "sigmoid", "keel"]), nearest("tahn", ["tanh", "sigmoid", "atan"])
    (('kernel', 'keel'), ('tanh',))
    """
    names, seen = tuple(dict.fromkeys(known)), in_ascii(name)
    return (seen,) if seen != name and seen in names else alike(seen, names)[:most]


def meant(name: str, known: Iterable[str]) -> str | None:
    """The known name that a misspelt one can only be meant for: it is one slip away, two in a word of five letters or
    more, or in one of four of which three are kept, and no other is as near. None where that is not sure.

    >>> meant("wieght", ["weight", "centre"]), meant("modles", ["models", "modules"]), meant("note", ["noise"])
    ('weight', None, None)
    >>> meant("fomr", ["from", "to"]), meant("size", ["file"])
    ('from', None)
    """
    close = nearest(name, known, 6)  # few: a distance takes a while to find
    name = in_ascii(name)
    most = 1 if len(name) < 4 else 2
    far = sorted((slips(name, other), other) for other in close if abs(len(name) - len(other)) <= most)
    if not far or far[0][0] > most or (len(far) > 1 and far[1][0] == far[0][0]):
        return None
    right = far[0][1]
    if len(name) == 4 and far[0][0] == 2:
        kept = (Counter(name.casefold()) & Counter(right.casefold())).total()
        return right if len(right) == 4 and kept >= 3 else None
    return right


def slips(one: str, other: str) -> int:
    """How many slips lead from one word to the other: a letter too few, too many or wrong, two changed over (the
    optimal string alignment distance; case is not counted).

    >>> slips("wieght", "weight"), slips("sensr", "sensor"), slips("kitten", "sitting")
    (1, 1, 3)
    """
    one, other = one.casefold(), other.casefold()
    before, last = list[int](), list(range(len(other) + 1))
    for i, letter in enumerate(one, 1):
        row = [i]
        for j, wanted in enumerate(other, 1):
            cost = min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (letter != wanted))
            if i > 1 and j > 1 and letter == other[j - 2] and one[i - 2] == wanted:
                cost = min(cost, before[j - 2] + 1)
            row.append(cost)
        before, last = last, row
    return last[-1]


def suggest(name: str, known: Iterable[str], what: str = "known") -> str | None:
    """A help line for an unknown name: the nearest known ones, else all of a short list.

    >>> suggest("tahn", ["tanh", "sigmoid"])
    "did you mean 'tanh'?"
    """
    names = tuple(dict.fromkeys(known))
    close = nearest(name, names)
    if close:
        return did_you_mean(close)
    if not names:
        return None
    return f"{what}: {listed(names)}"


def did_you_mean(names: Iterable[str]) -> str:
    """The help line that offers these names."""
    return "did you mean " + " or ".join(f"'{name}'" for name in names) + "?"


@lru_cache(maxsize=16)
def alike(name: str, known: tuple[str, ...]) -> tuple[str, ...]:
    """The known names that are much like another, best first, but no more than ``MOST``; kept, as who is answered with
    these may also be understood by them."""
    from difflib import SequenceMatcher  # only here: most specs have no mistake

    folded = name.casefold()
    matcher = SequenceMatcher(None, folded, autojunk=False)
    scored: list[tuple[float, str]] = []  # the best so far, in order
    enough = _LEAST
    for most, least, candidate in _bounds(folded, known):
        if most < enough - _SLACK:
            break
        other = candidate.casefold()
        matcher.set_seq2(other)
        score = max(matcher.ratio() + _first(folded, other), least)
        if score >= enough:
            insort(scored, (-score, candidate))
            del scored[MOST:]
            enough = max(_LEAST, -scored[0][0] - _WORSE, -scored[-1][0] if len(scored) == MOST else 0.0)
    return tuple(candidate for score, candidate in scored if score <= scored[0][0] + _WORSE)


def _bounds(folded: str, known: tuple[str, ...]) -> Iterator[tuple[float, float, str]]:
    """Known names with how much each is like another at most and at least, what may be most like it first."""
    if len(known) > _FEW and 0 < len(folded) <= _LONGEST:
        yield from _prepared(known).bounds(folded)
        return
    letters = Counter(folded)
    found: list[tuple[float, float, str]] = []
    for candidate in known:
        other = candidate.casefold()
        shared = sum(min(count, other.count(letter)) for letter, count in letters.items())
        least = _least(folded, other, shared)
        found.append((max(_share(shared, folded, other) + _first(folded, other), least), least, candidate))
    yield from sorted(found, key=lambda one: -one[0])


def _least(folded: str, other: str, shared: int) -> float:
    """How much two names are alike at least that share so many letters."""
    if shared == len(folded) == len(other):
        return _LETTERS
    # a name of one letter begins too many others
    if folded and other and (other.startswith(folded) or (len(other) > 1 and folded.startswith(other))):
        return _BEGINS
    return _STEM if _stem(folded) == _stem(other) != "" else 0.0


def _first(folded: str, other: str) -> float:
    return _FIRST if folded[:1] == other[:1] else 0.0


def _share(shared: int, folded: str, other: str) -> float:
    """How alike names are that have so many letters in common."""
    return 2.0 * shared / (len(folded) + len(other)) if folded or other else 1.0


def _stem(name: str) -> str:
    """A name without the number at its end: K3 and K12 are alike."""
    return name.rstrip("0123456789")


@lru_cache(maxsize=4)
def _prepared(known: tuple[str, ...]) -> _Many:
    return _Many(known)


class _Many:
    """Many names, prepared for the question which of them may be like another."""

    def __init__(self, known: tuple[str, ...]) -> None:
        import numpy as np

        self._known = known
        self._folded = [name.casefold() for name in known]
        self._by_letters = _places("".join(sorted(name)) for name in self._folded)
        self._by_stem = _places(map(_stem, self._folded))
        self._by_first = {
            letter: np.array(places) for letter, places in _places(name[:1] for name in self._folded).items()
        }
        self._by_name = _places(self._folded)
        self._sorted = sorted(self._by_name)
        self._lengths = np.array([len(name) for name in self._folded], dtype=np.int64)
        width = max(1, min(_LONGEST, int(self._lengths.max())))
        letters = np.array(self._folded, dtype=f"<U{width}").view(np.uint32).reshape(-1, width)
        #: (width, n) the first letters of each, as numbers of an alphabet; behind the end of a name that of no letter
        alphabet, numbers = np.unique(letters, return_inverse=True)
        self._alphabet: list[int] = alphabet.tolist()
        self._letters: npt.NDArray[np.int64] = np.ascontiguousarray(numbers.reshape(letters.shape).T)
        self._long = np.flatnonzero(self._lengths > width)

    def bounds(self, folded: str) -> Iterator[tuple[float, float, str]]:
        """The names with how much each is like another at most and at least, what may be most like it first."""
        import numpy as np

        least, first = np.zeros(len(self._known)), np.zeros(len(self._known))
        least[self._by_stem.get(_stem(folded) or " ", [])] = _STEM
        least[self._one_begins_the_other(folded)] = _BEGINS
        least[self._by_letters.get("".join(sorted(folded)), [])] = _LETTERS
        first[self._by_first.get(folded[0], [])] = _FIRST
        share = 2.0 * self._in_order(folded) / (len(folded) + self._lengths)
        share[self._long] = 1.0
        most = np.maximum(share + first, least)
        enough = np.flatnonzero(most >= _LEAST - _SLACK)
        for place in enough[np.argsort(-most[enough], kind="stable")].tolist():
            yield float(most[place]), float(least[place]), self._known[place]

    def _one_begins_the_other(self, folded: str) -> list[int]:
        """Names that begin with this one, and those that it begins with, but for single letters."""
        found: list[int] = []
        for name in self._sorted[bisect_left(self._sorted, folded) :]:
            if not name.startswith(folded):
                break
            found += self._by_name[name]
        for length in range(2, len(folded)):
            found += self._by_name.get(folded[:length], [])
        return found

    def _in_order(self, folded: str) -> npt.NDArray[np.int64]:
        """(n,) how many letters each name has in common with this one, in the same order."""
        import numpy as np

        masks: dict[int, int] = {}
        for place, letter in enumerate(folded):
            masks[ord(letter)] = masks.get(ord(letter), 0) | 1 << place
        table = np.array([masks.get(letter, 0) for letter in self._alphabet], dtype=np.uint64)
        # of each name a row of bits, one for each letter of this one: 0 where it has found its place
        rows = np.full(len(self._known), (1 << len(folded)) - 1, dtype=np.uint64)
        for column in self._letters:
            kept = rows & table[column]
            rows = (rows + kept) | (rows - kept)
        bits = np.unpackbits(rows.view(np.uint8).reshape(-1, 8), axis=1, bitorder="little")[:, : len(folded)]
        common: npt.NDArray[np.int64] = len(folded) - bits.sum(axis=1, dtype=np.int64)
        return common


def _places(words: Iterable[str]) -> dict[str, list[int]]:
    """Where each word stands."""
    found: dict[str, list[int]] = {}
    for place, word in enumerate(words):
        found.setdefault(word, []).append(place)
    return found
