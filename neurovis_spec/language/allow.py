"""Comments that silence: ``# neurovis: allow CODE`` at the end of a line, or several codes with commas between.

In: the findings, with the texts that were read. Out: the same without the warnings that are allowed on their line, and
with a warning for each allow that allows nothing. What a comment is the reader says: a text that holds these words is
none. Behind another ``#`` the comment may say why.
"""

from __future__ import annotations

import re
from itertools import islice
from typing import Final, NamedTuple

from neurovis_spec.codes import VALIDATE, catalogue
from neurovis_spec.diagnostics import Diagnostic, Findings, Span
from neurovis_spec.language.yaml.characters import Lines
from neurovis_spec.language.yaml.reader import comments
from neurovis_spec.likeness import suggest

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
    if _ALLOW.search(text) is None:
        return ()
    lines = Lines(text)
    result: list[Allow] = []
    for begin in comments(text):
        for match in _ALLOW.finditer(lines.line(lines.place(begin)[0]), lines.place(begin)[1] - 1):
            result += _codes(match, file, lines.place(begin)[0])
        if len(result) >= _MOST:
            break
    return tuple(result[:_MOST])


def _codes(match: re.Match[str], file: str, line: int) -> list[Allow]:
    """The codes that a comment on a line names."""
    begin = match.start("codes") + 1
    found = islice(_CODE.finditer(match["codes"]), _MOST)
    codes = [Allow(code.group(), _on(file, line, begin + code.start(), len(code.group()))) for code in found]
    return codes or [Allow("", _on(file, line, match.start() + 1, len(match.group().rstrip())))]


def _on(file: str, line: int, column: int, length: int) -> Span:
    return Span(file, line, column, line, column + length)


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
