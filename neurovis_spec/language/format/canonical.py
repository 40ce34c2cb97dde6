"""Canonical formatting: the same spec, as anybody would write it.

In: the text of a spec. Out: the text with canonical blanks, indentation and line ends, in which every comment, the
author's order, quotes and blank lines are kept; or None, and findings, for a text that the reader refuses. Formatting
twice changes nothing more, and the values are the same before and after (names of connections but for their blanks).
"""

from __future__ import annotations

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.format.printer import normal, print_document
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import Mapping, Node, Packed, Scalar


class FormattingError(Exception):
    """The result would not have had the same values: a mistake of ours, and nothing is to be written."""


def format_text(text: str, file: str, findings: Findings) -> str | None:
    """The canonical text; None where there are errors, which are reported. ``file`` is what findings call the text.

    Takes time in proportion to the text. Raises FormattingError.
    """
    document = read_text(text, file, findings)
    if document is None or findings.failed:
        return None
    written = print_document(document.root, with_line_feeds(text))
    again = read_text(written, file, Findings())
    if again is None or not _same(document.root, again.root):
        raise FormattingError("formatting would have changed what this says")
    return written


def format_read(text: str) -> str:
    """The canonical text of one that the reader has accepted. Raises FormattingError."""
    written = format_text(text, "", findings := Findings())
    findings.check()
    assert written is not None
    return written


def with_line_feeds(text: str) -> str:
    """A text whose lines end with LF, the last one, too; no place in it is another."""
    plain = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    return plain if plain.endswith("\n") else plain + "\n"


def _same(one: Node, other: Node) -> bool:
    """Whether two values are the same."""
    if isinstance(one, Scalar):
        return isinstance(other, Scalar) and _meaning(one) == _meaning(other)
    if isinstance(one, Mapping):
        if not isinstance(other, Mapping) or len(one.entries) != len(other.entries):
            return False
        pairs = zip(one.entries, other.entries, strict=True)
        return all(_same(a.key, b.key) and _same(a.value, b.value) for a, b in pairs)
    if isinstance(other, Scalar | Mapping) or len(one) != len(other):
        return False
    if isinstance(one, Packed) and isinstance(other, Packed):
        return _cells(one) == _cells(other)
    return all(_same(a, b) for a, b in zip(one.items, other.items, strict=True))


def _meaning(scalar: Scalar) -> tuple[type, str]:
    return type(scalar.value), normal(str(scalar.value))


def _cells(node: Packed) -> object:
    return node.kinds, node.numbers.tobytes(), node.integers, node.texts, node.rows
