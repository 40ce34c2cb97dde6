"""Lines of code with comments behind them, and where these comments go.

In: code and comments, written piece by piece. Out: the text. Comments behind code that stood in one column on
neighbouring lines stay in one column: their own if the code leaves two blanks before it, else the first that is free.
Where they stood right behind the longest line (one or two blanks), they do so again.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from neurovis_spec.language.format.gaps import Comment

_BLANKS: Final = 2  # before a comment behind code


class _Line(NamedTuple):
    code: str  # empty for a blank line and for a comment on a line of its own
    comment: Comment | None = None
    indent: int = 0  # of a comment on a line of its own


class LineWriter:
    """Gathers lines; the last one is open."""

    def __init__(self) -> None:
        self._lines: list[_Line] = []
        self._parts: list[str] = []
        self._comment: Comment | None = None
        self.width = 0  # of the open line

    def write(self, text: str) -> None:
        """Go on in the open line."""
        self._parts.append(text)
        self.width += len(text)

    def behind(self, comment: Comment | None) -> None:
        """A comment behind the open line; nothing may follow there."""
        if comment is not None:
            assert self._comment is None
            self._comment = comment

    def end(self) -> None:
        """Close the open line, if there is anything in it."""
        code = "".join(self._parts)
        if code or self._comment is not None:
            self._lines.append(_Line(code, self._comment))
        self._parts.clear()
        self._comment = None
        self.width = 0

    def begin(self, indent: int) -> None:
        """Close the open line and begin another."""
        self.end()
        self._parts.append(" " * indent)
        self.width = indent

    def blank(self) -> None:
        """Close the open line and leave one blank."""
        self.end()
        self._lines.append(_Line(""))

    def raw(self, line: str) -> None:
        """Close the open line and write one of a text, blank or not."""
        self.end()
        self._lines.append(_Line(line))

    def own(self, comment: Comment, indent: int) -> None:
        """Close the open line and write a comment on a line of its own."""
        self.end()
        self._lines.append(_Line("", comment, indent))

    def text(self) -> str:
        """All lines, each with its line end."""
        self.end()
        written: list[str] = []
        at = 0
        while at < len(self._lines):
            line = self._lines[at]
            if line.comment is None:
                written.append(line.code)
                at += 1
            elif not line.code:
                written.append(" " * line.indent + line.comment.text)
                at += 1
            else:
                run = self._run(at, line.comment.column)
                written += _in_one_column(run, line.comment.column)
                at += len(run)
        return "".join(f"{line}\n" for line in written)

    def _run(self, first: int, column: int) -> list[_Line]:
        """The lines from ``first`` on whose comments stood in one column; one may go on below on a line of its own."""
        stop = first + 1
        while stop < len(self._lines):
            comment = self._lines[stop].comment
            if comment is None or comment.column != column or comment.blank:
                break
            stop += 1
        return self._lines[first:stop]


def _in_one_column(run: list[_Line], column: int) -> list[str]:
    longest = max(len(line.code) for line in run) + _BLANKS
    tight = any(line.code and line.comment is not None and line.comment.behind <= _BLANKS for line in run)
    place = longest if tight else max(column, longest)
    return [line.code + " " * (place - len(line.code)) + line.comment.text for line in run if line.comment is not None]
