"""What is strange about the characters of a name: findings name those that look like others, or like nothing.

In: Findings, with the texts that they are about. Out: the same; the help of those about a name, a key, a reference or
an expression says which characters there are no ASCII, where that may be what is wrong with it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache, partial
from typing import Final

from neurovis_spec.diagnostics import Diagnostic, Findings, Mark, Span, shorten
from neurovis_spec.language.yaml import faults
from neurovis_spec.language.yaml.characters import Lines, character_name
from neurovis_spec.likeness import double, strange, unseen

#: Findings about names, beside those about unknown ones.
_NAMES: Final = frozenset({"bad-name", "bad-connection", "bad-range", "edge-outside", "unexpected-character"})
_SHOWN: Final = 3
#: A key, and behind it what is no colon, or a colon and what is no blank.
_KEY: Final = re.compile(
    r"(?:^[ \t]*(?:- +)?|[{,] *)(?P<key>[A-Za-z_][\w.]*(?: *(?:->|\+) *[\w.]+)*)"
    r"(?: *(?P<colon>[\uff1a\ufe55])|:(?P<blank>[^\x00-\x7f]))",
    re.ASCII,
)
#: What is found of such a key.
_OF_KEYS: Final = frozenset({faults.CODE, "bad-name", "unknown-key", "wrong-type", "bad-connection"})


def name_characters(findings: Findings) -> None:
    """Say in the findings which characters of names are no ASCII."""
    texts = {file: text for file, text in findings.sources.items() if not text.isascii()}
    if findings.failed and texts:
        lines = cache(lambda file: Lines(texts.get(file, "")))
        _fold_keys(findings, lines)
        findings.retell(partial(_retold, lines=lines))


def _fold_keys(findings: Findings, lines: Callable[[str], Lines]) -> None:
    """Tell one finding of a key behind which stands a colon or a blank of another kind, in the place of what that has
    led to: on its line, and on the next one, if that seems to belong to nothing."""
    found: dict[tuple[str, int], list[Mark]] = {}
    told = findings.told()
    for mark, item in told.items():
        if item.code in _OF_KEYS:
            found.setdefault((item.span.file, item.span.line), []).append(mark)
    for file, number in sorted(found):
        for line in (number, number - 1):
            key = _KEY.search(lines(file).line(line))
            if key is None or (key["blank"] and not unseen(key["blank"])):
                continue
            marks = [mark for mark in found.pop((file, line), []) if mark[0].end_column > key.start("key")]
            below = found.get((file, line + 1), [])
            late = [mark for mark in below if told[mark].message == faults.LATE_KEY.message]
            found[file, line + 1] = [mark for mark in below if mark not in late]
            marks += late
            if marks:
                findings.fold(marks, _of_key(key, Span(file, line, 1, line, 1).within(*key.span())))
            break


def _of_key(key: re.Match[str], line: Span) -> Diagnostic:
    """What is wrong behind a key, and what to write; ``line`` is where both stand."""
    span = line._replace(column=key.start("key") + 1)
    name = shorten(key["key"])
    if key["colon"]:
        message = f"behind '{name}' stands {character_name(key['colon'])}, not ':'"
        return Diagnostic(faults.CODE, message, span, hint=f"write {name}: …")
    message = f"behind '{name}:' stands {character_name(key['blank'])}, which is no blank"
    return Diagnostic(faults.CODE, message, span, hint=f"write an ordinary blank behind '{name}:'")


def _retold(item: Diagnostic, lines: Callable[[str], Lines]) -> Diagnostic:
    span = item.span
    line = lines(span.file).line(span.line)
    found: Iterable[str] = strange(line[span.column - 1 : span.end_column - 1] if span.line == span.end_line else "")
    if item.code == faults.CODE:  # what has led to it may stand anywhere before it
        found = [character for character in strange(line[: span.end_column - 1]) if double(character) is not None]
    elif item.code not in _NAMES and not item.code.startswith("unknown-"):
        found = filter(unseen, found)  # a text may have all others
    told = [_told(character) for character in found if character_name(character) not in item.message]
    if not told:
        return item
    before = "" if item.hint is None else f"{item.hint} " if item.hint.endswith("?") else f"{item.hint}; "
    return replace(item, hint=before + "; ".join(told[:_SHOWN]))


def _told(character: str) -> str:
    """What a character is that is hard to tell from another."""
    name, seen = character_name(character), double(character)
    if unseen(character):
        return f"there is {name} in it, which is no blank" if seen else f"there is {name} in it, which is not seen"
    return f"'{character}' is {name}" + ("" if seen is None else f", not '{seen}'")
