"""What goes wrong with recordings: those that cannot be read, written or used, and names that they do not know.

In: what is wrong, and the names that there are. Out: errors whose messages offer the nearest.
"""

from __future__ import annotations

from collections.abc import Iterable

from neurovis_spec.likeness import suggest


class RecordingError(ValueError):
    """A recording that cannot be read, written, or used with this network."""


class UnknownNameError(KeyError):
    """A name that a recording or simulation does not know; the message offers the nearest."""

    def __str__(self) -> str:
        return str(self.args[0])


def unknown(what: str, name: str, known: Iterable[str]) -> UnknownNameError:
    """An error that offers the nearest known names."""
    return UnknownNameError(unknown_text(what, name, known))


def unknown_text(what: str, name: str, known: Iterable[str]) -> str:
    """That there is none of that name, and which are nearest."""
    hint = suggest(name, known)
    return f"no {what} '{name}'" + (f"; {hint}" if hint else "")
