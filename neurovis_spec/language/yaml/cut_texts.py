"""Texts that a comma has cut: ``{weight: normal(0, 1)}`` reads as ``normal(0`` and a key ``1)``.

In: the unquoted scalars of a flow collection, one after the other. Out: the text as it was meant, from the one that
opens a parenthesis to the one that closes it.
"""

from __future__ import annotations

from typing import NamedTuple

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.yaml.packed import is_open
from neurovis_spec.language.yaml.refusals import Refusals
from neurovis_spec.language.yaml.source import Entry, Scalar
from neurovis_spec.language.yaml.written_text import Written


class Plain(NamedTuple):
    """An unquoted scalar: where it begins and ends in the text."""

    begin: int
    end: int
    scalar: Scalar


class Run:
    """Neighbouring scalars that are one text."""

    def __init__(self, text: str, first: Plain) -> None:
        self._text = text
        self.first = first
        self.last = first
        self._open = self._balance(first)

    @classmethod
    def begin(cls, text: str, plain: Plain | None) -> Run | None:
        """A run that begins here; None where no parenthesis is left open."""
        if plain is None or not is_open(text[plain.begin : plain.end]):
            return None
        return cls(text, plain)

    def take(self, plain: Plain | None) -> bool:
        """Whether the text goes on in this scalar."""
        if self._open <= 0 or plain is None:
            return False
        self.last = plain
        self._open += self._balance(plain)
        return True

    def _balance(self, plain: Plain) -> int:
        written = self._text[plain.begin : plain.end]
        return written.count("(") - written.count(")")

    @property
    def joined(self) -> bool:
        """Whether there was more than the first."""
        return self.last is not self.first

    def scalar(self) -> Scalar:
        """The whole, as if it had been quoted."""
        first, last = self.first.scalar.span, self.last.scalar.span
        span = Span(first.file, first.line, first.column, last.end_line, last.end_column)
        written = Written(self._text, self.first.begin, self.last.end)
        value = self._text[written.begin : written.end]
        if span.line == span.end_line:
            return Scalar(value, span)
        return Scalar(" ".join(value.split()), span, None, written)

    def refused(self, refuse: Refusals) -> Scalar:
        """The whole, which is reported."""
        whole = self.scalar()
        refuse.cut_text(whole, self._text[self.first.begin : self.first.end])
        return whole


class FlowCommas:
    """Watches the entries of one flow mapping for texts and numbers that commas have cut, and mends ``entries``."""

    def __init__(self, text: str, refuse: Refusals, entries: dict[str, Entry]) -> None:
        self._text = text
        self._refuse = refuse
        self._entries = entries
        self._name: str | None = None
        self._before: Plain | None = None
        self._run: Run | None = None

    def begin(self, name: str | None, value: Plain | None) -> None:
        """An entry was read, whose value is unquoted or None; its name is None where it was dropped."""
        self.close()
        self._name = name
        self._run = Run.begin(self._text, value)
        self._before = value

    def cut(self, key: Plain | None) -> bool:
        """Whether this key, which has no colon, is a piece of the text before it."""
        before = self._before
        if before is None or key is None:
            return False
        if self._run is not None and self._run.take(key):
            return True
        if _is_number(before.scalar) and _is_number(key.scalar):
            if self._text[before.end : key.begin] != ",":
                return False
            self._refuse.decimal_comma(before.scalar, key.scalar, self._text[before.begin : key.end])
            return True
        if isinstance(before.scalar.value, str) and isinstance(key.scalar.value, str) and "->" not in key.scalar.value:
            self._refuse.stray_text(before.scalar, key.scalar)
            return True
        return False

    def close(self) -> None:
        """The text before ends here."""
        if self._run is not None and self._run.joined:
            whole = self._run.refused(self._refuse)
            if self._name is not None:
                self._entries[self._name] = Entry(self._entries[self._name].key, whole)
        self._run = None


def _is_number(scalar: Scalar) -> bool:
    return isinstance(scalar.value, int | float) and not isinstance(scalar.value, bool)
