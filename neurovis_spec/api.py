"""What users hold: a compiled network with ``.run``, ``.layout``, ``.render`` (the top layer, under the command line)."""

from __future__ import annotations


class CompiledNetwork:
    """A compiled network."""


def compile() -> CompiledNetwork:  # noqa: A001
    """Compile a spec."""
    raise NotImplementedError


def compile_text() -> CompiledNetwork:
    """Compile the text of a spec."""
    raise NotImplementedError


def load() -> object:
    """Read a recording."""
    raise NotImplementedError
