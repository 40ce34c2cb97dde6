"""What is wrong with an expression, and where in its text.

In: a mistake that the lexer, the parser or a substitution noticed. Out: an exception with character offsets, which the
caller turns into a finding at its place in the file. One mistake an expression: what follows the first is guesswork.
"""

from __future__ import annotations


class ExpressionError(Exception):
    """An expression is at fault from character ``start`` to ``end`` (0-based, exclusive) of its text."""

    def __init__(self, code: str, message: str, start: int, end: int, hint: str | None = None) -> None:
        self.code = code
        self.message = message
        self.start = start
        self.end = end
        self.hint = hint
        super().__init__(message)


def shortened(text: str, most: int = 40) -> str:
    """A piece of the author's text in a message: the beginning of a long one."""
    return text if len(text) <= most else text[: most - 3] + "…"
