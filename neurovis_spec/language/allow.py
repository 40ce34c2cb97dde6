"""Comments that silence: ``# neurovis: allow CODE`` at the end of a line, or several codes with commas between.

In: the findings, with the texts that were read. Out: the same without the warnings that are allowed on their line, and
with a warning for each allow that allows nothing. What a comment is the YAML scanner says: a text that holds these
words is none. Behind another ``#`` the comment may say why.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from itertools import islice
from typing import Final, NamedTuple

import yaml

from neurovis_spec.codes import VALIDATE, catalogue
from neurovis_spec.diagnostics import Diagnostic, Findings, Span, suggest
from neurovis_spec.language.yaml.characters import FORBIDDEN, REPLACEMENT, Lines

USELESS: Final = "useless-allow"
_MOST: Final = 1000  # of these in a spec; nobody reads what more would say
_UNREADABLE: Final = ("too-deep", "too-large")  # scanning these again would take long
_ALLOW: Final = re.compile(r"(?<![^\s#])#[ \t]*neurovis[ \t]*:[ \t]*allow(?![\w-])(?P<codes>[^#\r\n]*)")
_CODE: Final = re.compile(r"[^\s,]+")


class Allow(NamedTuple):
    """One code in such a comment; the span is the code's, or the comment's where it names none (``code`` is '')."""

    code: str
    span: Span


def allows(text: str, file: str) -> tuple[Allow, ...]:
    """All codes that a text allows, in order; of very many the first.

    >>> [(allow.code, allow.span.line) for allow in allows("a: '# neurovis: allow x'  # neurovis: allow y, z", "f")]
    [('y', 1), ('z', 1)]
    """
    matches = list(islice(_ALLOW.finditer(text), _MOST))
    if not matches:
        return ()
    lines = Lines(text)
    texts = _Texts(text)
    result: list[Allow] = []
    for match in matches:
        line, column = lines.place(match.start())
        if (line, column) in texts:
            continue
        offset = match.start("codes") - match.start()
        found = [
            Allow(code.group(), _on(file, line, column + offset + code.start(), len(code.group())))
            for code in islice(_CODE.finditer(match["codes"]), _MOST)
        ]
        result += found or [Allow("", _on(file, line, column, len(match.group().rstrip())))]
        if len(result) >= _MOST:
            break
    return tuple(result[:_MOST])


def _on(file: str, line: int, column: int, length: int) -> Span:
    return Span(file, line, column, line, column + length)


class _Texts:
    """The places of a YAML text that lie in a value or a key, where ``#`` begins no comment."""

    def __init__(self, text: str) -> None:
        self._ranges = list(_scalars(FORBIDDEN.sub(REPLACEMENT, text)))

    def __contains__(self, place: tuple[int, int]) -> bool:
        at = bisect_right(self._ranges, place, key=lambda ends: ends[0]) - 1
        return at >= 0 and place < self._ranges[at][1]


def _scalars(text: str) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """First and last place (exclusive) of each scalar, as far as the text can be scanned. The line on which a block
    scalar is announced belongs to it no more than its indentation does."""
    loader = yaml.CLoader if yaml.__with_libyaml__ else yaml.Loader
    try:
        for token in yaml.scan(text, Loader=loader):
            if isinstance(token, yaml.ScalarToken):
                first, last = token.start_mark, token.end_mark
                block = token.style in ("|", ">")
                begin = (first.line + 2, 1) if block else (first.line + 1, first.column + 1)
                yield begin, (last.line + 1, last.column + 1)
    except yaml.YAMLError:
        return


def silence(findings: Findings) -> None:
    """Take the allowed warnings out of the findings, and note each allow that is useless."""
    if any(item.code in _UNREADABLE for item in findings.sorted()):
        return
    asked = _asked(findings)
    if not asked:
        return
    # a spec with errors has not been looked through for warnings
    complete = not findings.failed
    there = {_key(item) for item in findings.sorted() if item.severity == "warning"}
    for allow in asked:
        if allow.code != USELESS:
            _judge(allow, there, complete, findings)
    useless = {_key(item) for item in findings.sorted() if item.code == USELESS}
    drop_allowed(findings)
    for allow in asked:
        if allow.code == USELESS:
            _judge(allow, useless, complete, findings)


def drop_allowed(findings: Findings) -> None:
    """Take the allowed warnings out of the findings."""
    wanted = {(allow.span.file, allow.span.line, allow.code) for allow in _asked(findings)}
    findings.drop(lambda item: _key(item) in wanted)


def _asked(findings: Findings) -> list[Allow]:
    return [allow for file, text in findings.sources.items() for allow in allows(text, file)][:_MOST]


def _key(item: Diagnostic) -> tuple[str, int, str]:
    return item.span.file, item.span.line, item.code


def _judge(allow: Allow, there: set[tuple[str, int, str]], complete: bool, findings: Findings) -> None:
    """Report an allow that can allow nothing."""
    if (allow.span.file, allow.span.line, allow.code) in there:
        return
    code = catalogue().get(allow.code)
    message, hint = f"there is no warning '{allow.code}' on this line", "remove the comment"
    if not allow.code:
        message, hint = "this comment allows nothing", "write # neurovis: allow CODE"
    elif code is None:
        names = [name for name, entry in catalogue().items() if entry.severity == "warning"]
        message, hint = f"there is no code '{allow.code[:40]}'", suggest(allow.code[:40], names, "warnings") or hint
    elif code.severity == "error":
        message, hint = f"'{allow.code}' is an error; only warnings can be allowed", "mend what the error is about"
    elif not complete or code.command != VALIDATE:
        return  # what only a layout can tell is not looked for before there is one
    findings.warning(USELESS, allow.span, message, hint)
