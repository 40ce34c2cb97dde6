"""What is wrong with an expression, and where in its text.

In: a mistake that the lexer, the parser or a substitution noticed. Out: an exception with character offsets, which the
caller turns into a finding at its place in the file. Behind a mistake of the grammar all is guesswork; functions that
are unknown, out of place or called wrongly are mistakes of their own, of which there may be several.
"""

from __future__ import annotations


class ExpressionError(Exception):
    """An expression is invalid from character ``start`` to ``end`` (0-based, exclusive) of its text. ``others`` are
    further mistakes in it; ``used`` its names, each with where it begins and ends, as far as these are known."""

    def __init__(self, code: str, message: str, start: int, end: int, hint: str | None = None) -> None:
        self.code = code
        self.message = message
        self.start = start
        self.end = end
        self.hint = hint
        self.others: tuple[ExpressionError, ...] = ()
        self.used: tuple[tuple[str, int, int], ...] = ()
        super().__init__(message)
