"""What a text says though it cannot be read at this moment: its keys and values, guessed from lines and brackets.

In: the text of a spec that somebody is in the middle of writing. Out: Items, as ``outline`` gives them for a sound one,
and where a place stands: the keys that lead there, and what is written up to it. Indentation gives the nesting of
blocks; brackets that nobody has closed end where a line begins further left than the one that opened them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.yaml.scalars import NumberRangeError, resolve
from neurovis_spec.language.yaml.source import Scalar, ScalarValue
from neurovis_spec.lsp.outline import Item, Path
from neurovis_spec.lsp.text import Place, Text

_QUOTED = re.compile(r"\"(?:[^\"\\]|\\.)*\"?|'(?:[^']|'')*'?")
#: The reader refuses what is nested deeper; so do we, to stay linear.
_DEEPEST = 80
_BLOCK_TEXT = re.compile(r"[|>][-+0-9]*\s*(#.*)?$")


@dataclass(frozen=True, slots=True)
class Where:
    """Where a place stands.

    ``mapping`` is the path of the mapping of which a key may stand here, ``value`` the path of which the value may;
    None where it cannot be. ``typed`` is what is written before the place, from ``start`` on, ``rest`` what is written
    behind it; ``colon`` says that a colon follows.
    """

    mapping: Path | None
    value: Path | None
    typed: str
    rest: str
    start: Place
    colon: bool = False


@dataclass(slots=True)
class _Frame:
    """An open block or bracket; ``key`` is the key or the index that is being filled."""

    kind: Literal["block", "{", "["]
    indent: int
    key: str | int | None = None
    #: whether the colon behind the key has been passed
    filled: bool = False


@dataclass(slots=True)
class _Token:
    """A piece of a line: a bracket, a comma, a colon, a dash, or a text from ``start`` to ``end`` (0-based)."""

    kind: Literal["{", "}", "[", "]", ",", ":", "-", "text"]
    start: int
    end: int
    inner: int = 0


@dataclass
class _Scan:
    """Goes through the lines once."""

    text: Text
    file: str
    until: Place | None = None
    first: int = 1
    frames: list[_Frame] = field(default_factory=lambda: [_Frame("block", 0)])
    block_text: int | None = None
    where: Where | None = None

    def items(self) -> Iterator[Item]:
        """The items of all lines; stops at ``until``, which ``where`` then describes."""
        for number in range(self.first, len(self.text.lines.starts) + 1):
            line = self.text.line(number)
            here = self.until is not None and number == self.until.line
            if not line.strip() and not here:
                continue
            indent = len(line) - len(line.lstrip())
            if self.block_text is not None:
                if indent > self.block_text or not line.strip():
                    if here:
                        return
                    continue
                self.block_text = None
            self._close(line, indent, here)
            yield from self._line(number, line, here)
            if here or len(self.frames) > _DEEPEST:
                return

    def _close(self, line: str, indent: int, here: bool) -> None:
        """Leave what the line's indentation ends."""
        stripped = line.strip()
        if here and not stripped and self.until is not None:
            indent = self.until.column - 1
        if self.frames[-1].kind != "block" and stripped:
            opened = next(frame for frame in self.frames if frame.kind != "block")
            if indent <= opened.indent and stripped[0] not in "]}":
                del self.frames[self.frames.index(opened) :]
        while len(self.frames) > 1 and self.frames[-1].kind == "block":
            frame = self.frames[-1]
            dash = stripped == "-" or stripped.startswith("- ")
            if frame.indent > indent or (frame.indent == indent and isinstance(frame.key, int) and not dash):
                self.frames.pop()
                continue
            break

    def path(self) -> Path:
        """The keys of all open frames."""
        return tuple(frame.key for frame in self.frames if frame.key is not None)

    def _line(self, number: int, line: str, here: bool) -> Iterator[Item]:
        tokens = list(self._tokens(line))
        stop = self.until.column - 1 if here and self.until is not None else None
        for at, token in enumerate(tokens):
            following = tokens[at + 1] if at + 1 < len(tokens) else None
            is_key = following is not None and following.kind == ":"
            if stop is not None:
                if token.start > stop or (token.start == stop and token.kind != "text"):
                    break
                reach = len(line) if following is None else following.start
                if token.kind == "text" and (
                    stop <= token.end or (stop <= reach and not line[token.end : stop].strip())
                ):
                    self.where = self._found(line, token, stop, is_key)
                    return
            yield from self._token(number, line, token, is_key)
            if len(self.frames) > _DEEPEST:
                return
        if stop is not None:
            self.where = self._found(line, None, stop, False)

    def _token(self, number: int, line: str, token: _Token, is_key: bool) -> Iterator[Item]:
        top = self.frames[-1]
        match token.kind:
            case "text" if _BLOCK_TEXT.fullmatch(line, token.start) and top.kind == "block":
                self.block_text = top.indent
            case "text":
                yield from self._scalar(number, line, token, is_key)
            case ":":
                top.filled = True
            case "-":
                self._dash(token.start)
            case "{" | "[":
                indent = len(line) - len(line.lstrip())
                first = 0 if token.kind == "[" else None
                self.frames.append(_Frame("{" if token.kind == "{" else "[", indent, first))
            case ",":
                if isinstance(top.key, int):
                    top.key += 1
                else:
                    top.key, top.filled = None, False
            case _:
                if len(self.frames) > 1 and top.kind != "block":
                    self.frames.pop()

    def _scalar(self, number: int, line: str, token: _Token, is_key: bool) -> Iterator[Item]:
        raw = line[token.start : token.end]
        text = raw[1:].removesuffix(raw[0]) if token.inner else raw
        span = Span(self.file, number, token.start + 1, number, token.end + 1)
        exact = token.inner == 0 or not ("\\" in text if raw[0] == '"' else "'" in text)
        if is_key:
            self._key(text, token.start)
            scalar = Scalar(text, span, token.inner if exact else None)
        else:
            scalar = Scalar(text if token.inner else _plain(text), span, token.inner if exact else None)
        yield Item(self.path(), scalar, is_key, span)

    def _key(self, text: str, column: int) -> None:
        top = self.frames[-1]
        if top.kind == "block":
            if top.key is None or (top.indent >= column and not isinstance(top.key, int)):
                top.key, top.filled, top.indent = text, False, column
            else:
                self.frames.append(_Frame("block", column, text))
        elif top.kind == "[":  # a single pair in a list: [a: 1]
            self.frames.append(_Frame("{", top.indent, text))
        else:
            top.key, top.filled = text, False

    def _dash(self, column: int) -> None:
        top = self.frames[-1]
        if isinstance(top.key, int) and top.kind == "block" and top.indent == column:
            top.key += 1
        elif top.key is None and top.kind == "block":
            top.key, top.indent = 0, column
        else:
            self.frames.append(_Frame("block", column, 0))

    def _found(self, line: str, token: _Token | None, stop: int, is_key: bool) -> Where:
        """What may stand at the place that was looked for."""
        assert self.until is not None
        start = stop if token is None else min(token.start + token.inner, stop)
        end = stop if token is None else max(token.end, stop)
        rest = line[stop:end].rstrip("\"'") if token is not None and token.inner else line[stop:end]
        column = stop if token is None else token.start
        mapping, value = self._expected(line, column)
        return Where(
            mapping, None if is_key else value, line[start:stop], rest, Place(self.until.line, start + 1), is_key
        )

    def _expected(self, line: str, column: int) -> tuple[Path | None, Path | None]:
        """The path of the mapping of which a key may begin at a column, and the path of which the value may."""
        top, path = self.frames[-1], self.path()
        if top.kind == "[":
            return None, path
        if top.kind == "{":
            if top.filled:
                return None, path
            return (path if top.key is None else path[:-1]), None
        before = [token.kind for token in self._tokens(line) if token.end <= column]
        if ":" in before:
            return None, path
        if isinstance(top.key, int):
            return path, path
        if top.key is None:
            return path, None
        if column <= top.indent:
            return path[:-1], None
        return path, path

    def _tokens(self, line: str) -> Iterator[_Token]:
        """The pieces of a line. Brackets count only where a value may begin, or within brackets."""
        at, depth = 0, sum(frame.kind != "block" for frame in self.frames)
        fresh = True  # whether a value or a key may begin here
        while at < len(line):
            character = line[at]
            if character in " \t":
                at += 1
            elif character == "#" and (at == 0 or line[at - 1] in " \t"):
                return
            elif character in "{[" and (fresh or depth):
                depth += 1
                yield _Token("{" if character == "{" else "[", at, at + 1)
                at, fresh = at + 1, True
            elif character in "}]" and depth:
                depth -= 1
                yield _Token("}" if character == "}" else "]", at, at + 1)
                at, fresh = at + 1, False
            elif character == "," and depth:
                yield _Token(",", at, at + 1)
                at, fresh = at + 1, True
            elif character == ":" and _ends_key(line, at, depth):
                yield _Token(":", at, at + 1)
                at, fresh = at + 1, True
            elif character == "-" and not depth and fresh and line[at + 1 : at + 2] in ("", " "):
                yield _Token("-", at, at + 1)
                at += 1
            elif character in "\"'" and fresh:
                match = _QUOTED.match(line, at)
                assert match is not None
                yield _Token("text", at, match.end(), 1)
                at, fresh = match.end(), False
            else:
                end = _plain_end(line, at, depth)
                yield _Token("text", at, end)
                at, fresh = end, False


def _ends_key(line: str, at: int, depth: int) -> bool:
    following = line[at + 1 : at + 2]
    return following in ("", " ", "\t") or (depth > 0 and following in ",[]{}")


def _plain_end(line: str, start: int, depth: int) -> int:
    """The end of a plain text that begins at ``start``; never at the start."""
    at = start + 1
    while at < len(line):
        character = line[at]
        if character == ":" and _ends_key(line, at, depth):
            break
        if depth and character in ",[]{}":
            break
        if character == "#" and line[at - 1] in " \t":
            break
        at += 1
    return start + max(1, len(line[start:at].rstrip()))


def _plain(text: str) -> ScalarValue:
    try:
        return resolve(text)
    except NumberRangeError as error:
        return error.nearest


def outline_of_text(text: Text, file: str) -> tuple[Item, ...]:
    """The items of a text, sound or not."""
    return tuple(_Scan(text, file).items())


def _section(text: Text, number: int) -> int:
    """The last line up to this one that begins a section: what is above it is over there, whatever is open."""
    while number > 1 and (text.line(number)[:1] or " ") in " \t#-]}":
        number -= 1
    return number


def where(text: Text, place: Place) -> Where | None:
    """Where a place stands; None within a block text, where nothing is looked for."""
    scan = _Scan(text, "", place, first=_section(text, place.line))
    for _ in scan.items():
        pass
    return scan.where
