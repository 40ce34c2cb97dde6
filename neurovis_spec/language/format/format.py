"""Canonical formatting: the same spec, as anybody would write it.

In: the text of a spec. Out: the text with canonical blanks, indentation and line ends, in which every comment, the
author's order, quotes and blank lines are kept; or None, and findings, for a text that the reader refuses. Formatting
twice changes nothing more, and the values are the same before and after (names of connections but for their blanks).
"""

from __future__ import annotations

from itertools import zip_longest

import yaml

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.format.connection_keys import normal
from neurovis_spec.language.format.layout import print_document
from neurovis_spec.language.format.parse import INDICATORS, TreeReader, signature
from neurovis_spec.language.yaml.reader import event_source, read_text


class FormattingError(Exception):
    """The result would not have had the same values: a mistake of ours, and nothing is to be written."""


def format_text(text: str, file: str, findings: Findings) -> str | None:
    """The canonical text; None where there are errors, which are reported. ``file`` is what findings call the text.

    Takes time in proportion to the text. Raises FormattingError.
    """
    read_text(text, file, findings)
    if findings.failed:
        return None
    return format_read(text)


def format_read(text: str) -> str:
    """The canonical text of one that the reader has accepted. Raises FormattingError."""
    plain = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    plain += "" if plain.endswith("\n") else "\n"
    reader = TreeReader(plain, event_source(plain))
    written = print_document(reader.document())
    _check(reader.events, written)
    return written


def _check(before: list[object], written: str) -> None:
    """Compare what YAML makes of the text with what it made of the first."""
    parser = event_source(written)
    after = (signature(event) for event in iter(parser.get_event, None))
    try:
        same = all(old == new or _meaning(old) == _meaning(new) for old, new in zip_longest(before, after))
    except yaml.YAMLError:
        same = False
    if not same:
        raise FormattingError("formatting would have changed what this says")


def _meaning(event: object) -> object:
    match event:
        case (str() as value, bool() as plain):
            return normal(value), plain and value not in INDICATORS
    return event
