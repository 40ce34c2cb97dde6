"""Where an event stands.

In: an event of the parser, whose marks PyYAML's types call optional though its parsers always set them. Out: its marks
(which count from 0) or its span (which counts from 1).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from yaml.events import Event

from neurovis_spec.diagnostics import Span

if TYPE_CHECKING:
    from yaml import _yaml, error

    Mark: TypeAlias = error.Mark | _yaml.Mark


def begin(event: Event) -> Mark:
    """The mark of an event's first character."""
    mark = event.start_mark
    assert mark is not None
    return mark


def end(event: Event) -> Mark:
    """The mark behind an event's last character."""
    mark = event.end_mark
    assert mark is not None
    return mark


def span(first: Event, last: Event, file: str) -> Span:
    """From the begin of one event to the end of another."""
    start, stop = begin(first), end(last)
    return Span(file, start.line + 1, start.column + 1, stop.line + 1, stop.column + 1)
