"""What is strange about the characters of a name: findings name those that look like others, or like nothing.

In: Findings, with the texts that they are about. Out: the same; the help of those about a name, a key, a reference or
an expression says which characters there are no ASCII, where that may be what is wrong with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache, partial
from typing import Final

from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.language.yaml import faults
from neurovis_spec.language.yaml.characters import Lines, character_name
from neurovis_spec.lookalikes import double, strange, unseen

#: Findings about names, beside those about unknown ones.
_NAMES: Final = frozenset({"bad-name", "bad-connection", "bad-range", "edge-outside", "unexpected-character"})
_SHOWN: Final = 3


def name_characters(findings: Findings) -> None:
    """Say in the findings which characters of names are no ASCII."""
    texts = {file: text for file, text in findings.sources.items() if not text.isascii()}
    if findings.failed and texts:
        findings.retell(partial(_retold, lines=cache(lambda file: Lines(texts.get(file, "")))))


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
