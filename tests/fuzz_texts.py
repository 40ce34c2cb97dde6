"""Texts that no author means: specs mutated by bytes, by tokens and by structure, from a corpus.

In: a seed and a number. Out: always the same text for both, with the folder that its data files are in. The corpus are
the examples, the defective specs, the spec with every key, and the small nasty texts of ``tests/corpus``.
"""

from __future__ import annotations

import copy
import json
import random
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import hostile
import yaml
from hostile import Data

TESTS = Path(__file__).parent
#: Folders of specs that are right, and of others.
RIGHT = (TESTS.parent / "specs", TESTS / "corpus" / "right")
WRONG = (TESTS / "errors", TESTS / "corpus")

#: Pieces that mean something to YAML, to an expression, to a reader of numbers or to a terminal.
NASTY = (
    ": ", ":", "- ", "? ", "? - ", "[", "]", "{", "}", ",", "&a ", "*a", "!!str ", "!x ", "<<: ", "|", ">-",
    "%YAML 1.1\n", "---\n", "...\n", "# ", "'", '"', "\\", "\\u202e", "\\U00110000", "\\x", "@", "`", "~", "\t",
    "\n", "\r", "\r\n", "\0", "\x1b[2J", "\x7f", "\x85", "\u2028", "\u202e", "\ufeff", "\ufffe", "\ud800",
    "\u0301", "😀", "名", "ﬀ", "١", "\u00a0", "null", "true", "yes", ".nan", "-.inf", "1e999", "-0", "0x1f",
    "010", "1_0", "9223372036854775808", "1" * 400, "1e-400", "->", " -> ", "+", "..", "K1..K3", "C1..", ".",
    "a.b.c", "A", "K", "(", ")", "((((", "))))", "^", "**", "//", " if ", " else ", "1/0", "sqrt(-1)", "log(0)",
    "exp(1000)", "0^-1", "normal(0, 1)", "uniform(1, 0)", "i", "j", "n", "k", "t", "dt", "x.y", "x[0]",
    "lambda: 0", "{{x}}", "${x}", "__import__('os')", "../../etc/passwd", "/dev/zero", "data/centres.csv", ".",
    "con", "a\0b", "# neurovis: allow unused", "# neurovis: allow ", "#neurovis:allow x,,y", "x" * 300,
    " " * 70, "[" * 70, "{a: " * 70, "- " * 70,
)  # fmt: skip
_TOKEN = re.compile(r"\s+|\w+|[^\w\s]")
_WORD = re.compile(r"[A-Za-z_]\w*")
_VALUE = re.compile(r"(?<=[ \[{])(?:(?P<number>-?[0-9.]+)|[a-z_]+)(?=[\s,\]}])")
_VALUES = ("0", "1", "2", "3", "4", "-1", "0.5", "1e3", "1e-9", "-0.0", "12", "1/3", "2*pi", "dt", "sin(1)", "1e300")


@dataclass(frozen=True, slots=True)
class Input:
    """A text (or bytes that are none) and the folder of its data files."""

    data: bytes
    folder: Path


@dataclass(frozen=True, slots=True)
class Seed:
    """A text of the corpus, and the plain data of one that is YAML."""

    text: str
    folder: Path
    data: Data


@cache
def corpus() -> tuple[Seed, ...]:
    """All seeds, in an order of their own."""
    found = [Seed(hostile.RICH, TESTS, yaml.safe_load(hostile.RICH))]
    for folder in (*RIGHT, *WRONG):
        for path in sorted(folder.glob("*.yaml")):
            text = path.read_bytes().decode("utf-8", "replace")
            try:
                data: Data = json.loads(json.dumps(yaml.safe_load(text)))  # all keys become texts
            except (yaml.YAMLError, ValueError, TypeError, RecursionError):
                data = None
            found.append(Seed(text, folder, data))
    return tuple(found)


@cache
def right() -> tuple[Seed, ...]:
    """The seeds that hold no mistake."""
    return tuple(seed for seed in corpus() if seed.folder in (TESTS, *RIGHT))


@cache
def words() -> tuple[str, ...]:
    """The words of the language and of the corpus."""
    return tuple(sorted({word for seed in corpus() for word in _WORD.findall(seed.text)}))


def make(seed: int, number: int) -> Input:
    """Input ``number`` of a run with this seed."""
    chooser = random.Random(f"{seed}/{number}")
    # The seeds themselves come first, as they are.
    if number < len(corpus()):
        return Input(corpus()[number].text.encode(), corpus()[number].folder)
    # Half of them come from the specs that are right, which are fewer than those that are not.
    parent = chooser.choice(corpus() if chooser.random() < 0.5 else right())
    text = parent.text
    if parent in right() and chooser.random() < 0.3:
        text, rounds = _renumbered(chooser, text), 0
    elif isinstance(parent.data, dict) and chooser.random() < 0.5:
        text = _restructured(chooser, parent.data)
        rounds = chooser.choice((0, 0, 1))
    else:
        rounds = chooser.choice((1, 1, 1, 2, 4, 8))
    for _ in range(rounds):
        text = chooser.choice(_MUTATIONS)(chooser, text)
    data = text.encode("utf-8", "surrogatepass")
    return Input(_broken(chooser, data) if chooser.random() < 0.03 else data, parent.folder)


def _broken(chooser: random.Random, data: bytes) -> bytes:
    """Some bytes turned over."""
    broken = bytearray(data or b"a")
    for _ in range(chooser.randint(1, 3)):
        broken[chooser.randrange(len(broken))] ^= 1 << chooser.randrange(8)
    return bytes(broken)


def _renumbered(chooser: random.Random, text: str) -> str:
    """Some numbers, words and lines that end in a value replaced by such as may well do: much of this compiles."""
    for _ in range(chooser.randint(1, 3)):
        places = list(_VALUE.finditer(text))
        if places:
            match = chooser.choice(places)
            value = chooser.choice(_VALUES) if match["number"] else chooser.choice(words())
            text = text[: match.start()] + value + text[match.end() :]
    return text


# Characters


def _stretch(chooser: random.Random, text: str, longest: int = 40) -> tuple[int, int]:
    start = chooser.randint(0, len(text))
    return start, min(len(text), start + chooser.randint(0, longest))


def _insert(chooser: random.Random, text: str) -> str:
    at = chooser.randint(0, len(text))
    return text[:at] + chooser.choice(NASTY) + text[at:]


def _remove(chooser: random.Random, text: str) -> str:
    start, end = _stretch(chooser, text)
    return text[:start] + text[end:]


def _double(chooser: random.Random, text: str) -> str:
    start, end = _stretch(chooser, text)
    return text[:end] + text[start:end] * chooser.choice((1, 1, 3, 40)) + text[end:]


def _end(chooser: random.Random, text: str) -> str:
    return text[: chooser.randint(0, len(text))]


def _one(chooser: random.Random, text: str) -> str:
    at = chooser.randint(0, max(0, len(text) - 1))
    return text[:at] + chr(chooser.choice((chooser.randrange(128), chooser.randrange(0x3000)))) + text[at + 1 :]


# Tokens


def _tokens(chooser: random.Random, text: str) -> str:
    """One or a few words, blanks or marks lost, doubled, swapped or replaced."""
    parts = _TOKEN.findall(text) or [""]
    for _ in range(chooser.choice((1, 1, 2, 5))):
        at = chooser.randrange(len(parts))
        match chooser.choice(("lose", "double", "swap", "nasty", "word", "word")):
            case "lose":
                parts[at] = ""
            case "double":
                parts[at] *= 2
            case "swap":
                other = chooser.randrange(len(parts))
                parts[at], parts[other] = parts[other], parts[at]
            case "nasty":
                parts[at] = chooser.choice(NASTY)
            case _:
                named = [place for place, part in enumerate(parts) if _WORD.match(part)] or [at]
                parts[chooser.choice(named)] = chooser.choice(words())
    return "".join(parts)


# Lines


def _lines(chooser: random.Random, text: str) -> str:
    """Lines lost, doubled, swapped, moved in or out."""
    lines = text.split("\n")
    for _ in range(chooser.choice((1, 2, 4))):
        at = chooser.randrange(len(lines))
        match chooser.choice(("lose", "double", "swap", "in", "out", "tab")):
            case "lose":
                lines[at] = ""
            case "double":
                lines.insert(at, lines[at])
            case "swap":
                other = chooser.randrange(len(lines))
                lines[at], lines[other] = lines[other], lines[at]
            case "in":
                lines[at] = " " * chooser.randint(1, 6) + lines[at]
            case "out":
                lines[at] = lines[at].lstrip()
            case _:
                lines[at] = "\t" + lines[at]
    return "\n".join(lines)


def _splice(chooser: random.Random, text: str) -> str:
    """The begin of one spec, the end of another."""
    first, second = text.split("\n"), chooser.choice(corpus()).text.split("\n")
    return "\n".join([*first[: chooser.randint(0, len(first))], *second[chooser.randint(0, len(second)) :]])


_MUTATIONS: tuple[Callable[[random.Random, str], str], ...] = (
    _insert, _insert, _remove, _double, _end, _one, _tokens, _tokens, _tokens, _lines, _splice,
)  # fmt: skip


# Structure


def _restructured(chooser: random.Random, data: Data) -> str:
    """A spec with some of its parts lost, renamed, replaced, wrapped or moved, written in one way or another."""
    changed = copy.deepcopy(data)
    for _ in range(chooser.choice((1, 1, 2, 3))):
        places = list(hostile.paths(changed))
        if places:
            _change(chooser, changed, chooser.choice(places))
    if chooser.random() < 0.5:
        return str(yaml.safe_dump(changed, sort_keys=False, allow_unicode=True))
    text = json.dumps(changed, indent=chooser.choice((None, 1)), ensure_ascii=False)
    return re.sub(r'"@@(.*?)@@"', lambda match: hostile.WRONG[match[1]], text)


def _change(chooser: random.Random, data: Data, path: hostile.Place) -> None:
    holder = data
    for part in path[:-1]:
        holder = holder[part]  # type: ignore[index]
    last = path[-1]
    if isinstance(holder, list):
        assert isinstance(last, int)
        match chooser.choice(("lose", "double", "replace", "wrap")):
            case "lose":
                del holder[last]
            case "double":
                holder.insert(last, copy.deepcopy(holder[last]))
            case "replace":
                holder[last] = _other(chooser)
            case _:
                holder[last] = [holder[last]]
    elif isinstance(holder, dict):
        assert isinstance(last, str)
        value = holder[last]
        match chooser.choice(("lose", "rename", "replace", "replace", "wrap", "add")):
            case "lose":
                del holder[last]
            case "rename":
                holder[chooser.choice((*words(), misspelt(chooser, last)))] = holder.pop(last)
            case "replace":
                holder[last] = _other(chooser)
            case "wrap":
                holder[last] = chooser.choice(([value], {chooser.choice(words()): value}))
            case _:
                holder[chooser.choice(words())] = _other(chooser)


def _other(chooser: random.Random) -> Data:
    """A part of another spec, a wrong value or a word."""
    match chooser.choice(("part", "part", "wrong", "word", "number")):
        case "part":
            data = chooser.choice(corpus()).data
            places = list(hostile.paths(data))
            for part in chooser.choice(places) if places else ():
                data = data[part]  # type: ignore[index]
            return copy.deepcopy(data)
        case "wrong":
            return f"@@{chooser.choice(list(hostile.WRONG))}@@"
        case "word":
            return chooser.choice(words())
        case _:
            return chooser.choice((0, 1, 2, 3, 12, -1, 0.5, -0.0, 1e-300, 1e300, 2**53, 2**63 - 1, 1_000_000_000))


def misspelt(chooser: random.Random, word: str) -> str:
    """A word with one letter lost, doubled, replaced or two changed over."""
    if not word:
        return "x"
    at = chooser.randrange(len(word))
    match chooser.choice(("lose", "double", "replace", "swap")):
        case "lose":
            return word[:at] + word[at + 1 :]
        case "double":
            return word[:at] + word[at] + word[at:]
        case "replace":
            return word[:at] + chooser.choice("abcdefghijklmnopqrstuvwxyz") + word[at + 1 :]
        case _:
            return word[:at] + word[at : at + 2][::-1] + word[at + 2 :]
