"""Texts that a comma has cut: ``{weight: normal(0, 1)}`` reads as ``normal(0`` and a key ``1)``.

In: the plain scalars of a flow collection, one after the other. Out: the text as it was meant, from the one that opens
a parenthesis to the one that closes it.
"""

from __future__ import annotations

from yaml.events import Event, ScalarEvent

from neurovis_spec.language.yaml import marks
from neurovis_spec.language.yaml.packed import is_open
from neurovis_spec.language.yaml.refusals import Refusals
from neurovis_spec.language.yaml.source import Entry, Node, Scalar
from neurovis_spec.language.yaml.written_text import Written


def is_plain(event: Event) -> bool:
    """Whether this is an unquoted scalar without tag and anchor."""
    return isinstance(event, ScalarEvent) and event.implicit[0] and event.anchor is None


class Run:
    """Neighbouring scalars that are one text."""

    def __init__(self, first: ScalarEvent) -> None:
        self.first = first
        self.last = first
        self._open = _balance(first)

    @classmethod
    def begin(cls, event: Event) -> Run | None:
        """A run that begins here; None where no parenthesis is left open."""
        if isinstance(event, ScalarEvent) and "(" in event.value and is_plain(event) and is_open(event.value):
            return cls(event)
        return None

    def take(self, event: Event) -> bool:
        """Whether the text goes on in this scalar."""
        if self._open <= 0 or not isinstance(event, ScalarEvent) or not is_plain(event):
            return False
        self.last = event
        self._open += _balance(event)
        return True

    @property
    def joined(self) -> bool:
        """Whether there was more than the first."""
        return self.last is not self.first

    def scalar(self, text: str, file: str) -> Scalar:
        """The whole, as if it had been quoted."""
        span = marks.span(self.first, self.last, file)
        one_line = span.line == span.end_line
        written = Written(text, marks.begin(self.first).index, marks.end(self.last).index)
        value = text[written.begin : written.end]
        if one_line:
            return Scalar(value, span)
        return Scalar(" ".join(value.split()), span, None, written)


class FlowCommas:
    """Watches the entries of one flow mapping for texts and numbers that commas have cut, and mends ``entries``."""

    def __init__(self, text: str, file: str, refuse: Refusals, entries: dict[str, Entry]) -> None:
        self._text = text
        self._file = file
        self._refuse = refuse
        self._entries = entries
        self._name: str | None = None
        self._before: ScalarEvent | None = None
        self._value: Scalar | None = None
        self._run: Run | None = None

    def begin(self, name: str | None, event: Event, value: Node) -> None:
        """An entry was read; its name is None where it was dropped."""
        self.close()
        self._name = name
        self._run = Run.begin(event)
        plain = isinstance(event, ScalarEvent) and is_plain(event) and event.value
        self._before = event if plain and isinstance(event, ScalarEvent) else None
        self._value = value if plain and isinstance(value, Scalar) else None

    def cut(self, key_event: Event, key: Node, value_event: Event) -> bool:
        """Whether this key has no value of its own because it is a piece of the text before it."""
        if self._before is None or self._value is None or not isinstance(key, Scalar):
            return False
        if not self._is_lone(key_event, value_event):
            return False
        if self._run is not None and self._run.take(key_event):
            return True
        between = self._text[marks.end(self._before).index : marks.begin(key_event).index]
        if _is_number(self._value) and _is_number(key):
            if between != ",":
                return False
            written = self._text[marks.begin(self._before).index : marks.end(key_event).index]
            self._refuse.decimal_comma(self._value, key, written)
            return True
        if isinstance(self._value.value, str) and isinstance(key.value, str) and "->" not in key.value:
            self._refuse.stray_text(self._value, key)
            return True
        return False

    def _is_lone(self, key: Event, value: Event) -> bool:
        if not is_plain(key) or not is_plain(value) or marks.begin(value).index != marks.end(value).index:
            return False
        return ":" not in self._text[marks.end(key).index : marks.begin(value).index]

    def close(self) -> None:
        """The text before ends here."""
        if self._run is not None and self._run.joined:
            whole = self._run.scalar(self._text, self._file)
            self._refuse.cut_text(whole, self._run.first.value)
            if self._name is not None:
                self._entries[self._name] = Entry(self._entries[self._name].key, whole)
        self._run = None


def _is_number(scalar: Scalar) -> bool:
    return isinstance(scalar.value, int | float) and not isinstance(scalar.value, bool)


def _balance(event: ScalarEvent) -> int:
    text: str = event.value
    return text.count("(") - text.count(")")
