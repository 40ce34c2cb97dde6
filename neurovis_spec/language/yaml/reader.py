"""The reader: a text, or a file, becomes a SourceDocument.

In: bytes or a text, and the name that findings call it by. Out: a document whose values know where they stand, or None
where it could not be read to its end. Findings are collected, never raised; the text read is kept in
``findings.sources`` for showing them.
"""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path
from typing import Final

import yaml
from yaml.events import Event
from yaml.parser import Parser
from yaml.reader import Reader
from yaml.scanner import Scanner, ScannerError

from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.gc_paused import uncollected
from neurovis_spec.language.yaml.characters import FORBIDDEN, REPLACEMENT, Lines, character_name
from neurovis_spec.language.yaml.composer import Composer, EventSource
from neurovis_spec.language.yaml.opening import FileFault, read_bytes
from neurovis_spec.language.yaml.refusals import ComposingStoppedError
from neurovis_spec.language.yaml.repair import LARGEST_MENDED, MOST_MENDED, faulty_value, left_out
from neurovis_spec.language.yaml.source import Mapping, Node, Scalar, SourceDocument, describe
from neurovis_spec.language.yaml.syntax_errors import explain

LARGEST: Final = 64 << 20  # bytes
_MOST_CHARACTERS: Final = 20
_BOM: Final = "\ufeff"
_MOST_DIRECTIVES: Final = 20
_DIRECTIVE: Final = re.compile(r"^%", re.MULTILINE)
_ALLOWED_DIRECTIVE: Final = re.compile(r"%YAML[ \t]+1\.2[ \t]*(#.*)?")
_PROLOGUE_LINE: Final = re.compile(r"(?:[ \t]*(?:#[^\r\n]*)?|%[^\r\n]*)(?:\r\n|\n|\r|\Z)")


if yaml.__with_libyaml__:
    from yaml._yaml import CParser as _CParser


class _PythonStages(Reader, Scanner, Parser):
    """PyYAML's parser in pure Python, for where its C one is not installed."""

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        Parser.__init__(self)


class _PythonParser:
    """The same, with an error of its own for an escape beyond Unicode, which the scanner does not check."""

    def __init__(self, text: str) -> None:
        self._stages = _PythonStages(text)
        self._source: EventSource = self._stages

    def get_event(self) -> Event | None:
        """The next event, None past the end. Raises yaml.YAMLError."""
        try:
            return self._source.get_event()
        except (ValueError, OverflowError) as error:
            context = "while scanning a double-quoted scalar"
            mark = self._stages.get_mark()
            raise ScannerError(context, None, "found invalid Unicode character escape code", mark) from error


def read_file(path: Path, name: str, findings: Findings, *, mend: bool = False) -> SourceDocument | None:
    """Read a file; ``name`` is what findings call it. Never raises for what is in the file or in its stead."""
    data = read_bytes(path, LARGEST)
    if isinstance(data, FileFault):
        findings.error(data.code, Span(name, 1, 1, 1, 1), f"the file {data.reason}")
        return None
    return read_content(data, name, findings, mend=mend)


def read_content(data: bytes, name: str, findings: Findings, *, mend: bool = False) -> SourceDocument | None:
    """Read the bytes of a file that findings call ``name``."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        _refuse_bytes(data, error.start, name, findings)
        return None
    return read_text(text, name, findings, mend=mend)


def read_text(
    text: str, file: str, findings: Findings, *, pure: bool = False, mend: bool = False
) -> SourceDocument | None:
    """Read a text; ``file`` is what findings call it, ``pure`` takes the Python parser though there is a C one.

    Never raises for what is in the text. None means that it has no root that is a mapping, or could not be read to its
    end; a document is returned also where there were findings that reading could get past. With ``mend`` these are
    syntax errors, too, where it is clear which value is invalid: it is left out.
    """
    text = text.removeprefix(_BOM)
    findings.sources[file] = text
    start = Span(file, 1, 1, 1, 1)
    if len(text) > LARGEST or (4 * len(text) > LARGEST and len(text.encode("utf-8", "replace")) > LARGEST):
        findings.error("too-large", start, f"the text is larger than {LARGEST >> 20} MiB")
        return None
    lines = Lines(text)
    clean = _without_forbidden(text, file, lines, findings)
    clean = _without_directives(clean, file, findings)
    if not clean.endswith(("\n", "\r")):
        clean += "\n"  # without it the parsers differ about the place of what is missing at the end
    unread: set[int] = set()
    for _ in range(MOST_MENDED + 1):
        refused = Findings()
        composer = Composer(clean, file, refused, event_source(clean, pure=pure), unread)
        try:
            with uncollected():
                root = composer.document()
        except ComposingStoppedError:
            findings.take(refused)
            return None
        except yaml.YAMLError as error:
            syntax = explain(error, lines, composer.open_brackets)
        else:
            findings.take(refused)
            return _document(root, file, findings)
        findings.error(syntax.code, syntax.span(file, lines), syntax.message, syntax.hint)
        opened = composer.open_brackets[0][0] if composer.open_brackets else syntax.line
        found = faulty_value(Lines(clean), min(opened, syntax.line)) if mend and len(clean) <= LARGEST_MENDED else None
        if found is None:
            findings.take(refused)
            return None
        clean = left_out(clean, found)
        unread = {start for start in unread if not found.start <= start < found.end} | {found.unread}
        findings.unread(Span(file, found.line, found.column, found.line, found.column + 1))
    return None


def event_source(text: str, *, pure: bool = False) -> EventSource:
    """A parser over a text: the C one where it is installed, unless the ``pure`` Python one is wanted."""
    if pure or not yaml.__with_libyaml__:
        return _PythonParser(text)
    return _CParser(text)


def _document(root: Node | None, file: str, findings: Findings) -> SourceDocument | None:
    if isinstance(root, Mapping):
        return SourceDocument(file, root)
    hint = "a spec begins with a line 'neurovis: 1'"
    if root is None or (isinstance(root, Scalar) and root.value is None):
        findings.error("not-a-mapping", Span(file, 1, 1, 1, 1), "there is nothing in this file", hint)
    else:
        message = f"keys with their values ('key: value') are wanted here, but this is {describe(root)}"
        findings.error("not-a-mapping", root.span, message, hint)
    return None


def _without_forbidden(text: str, file: str, lines: Lines, findings: Findings) -> str:
    """Refuse invisible characters; the text with a visible one for each, so that no place moves."""
    if FORBIDDEN.search(text) is None:
        return text
    for match in islice(FORBIDDEN.finditer(text), _MOST_CHARACTERS):
        line, column = lines.place(match.start())
        message = f"the character {character_name(match.group())} is not allowed"
        findings.error("control-character", Span(file, line, column, line, column + 1), message)
    return FORBIDDEN.sub(REPLACEMENT, text)


def _without_directives(text: str, file: str, findings: Findings) -> str:
    """Refuse directives other than %YAML 1.2; the text with a comment for each."""
    if _DIRECTIVE.search(text) is None:
        return text
    index, number, refused = 0, 1, 0
    pieces: list[str] = []
    while index < len(text) and refused < _MOST_DIRECTIVES and (match := _PROLOGUE_LINE.match(text, index)):
        line = match.group()
        directive = line.rstrip()
        if directive.startswith("%") and not _ALLOWED_DIRECTIVE.fullmatch(directive):
            span = Span(file, number, 1, number, len(directive) + 1)
            findings.error("directive", span, "the only directive that is allowed is '%YAML 1.2'", "remove this line")
            line = "#" + line[1:]
            refused += 1
        pieces.append(line)
        index, number = match.end(), number + 1
    return "".join(pieces) + text[index:]


def _refuse_bytes(data: bytes, at: int, name: str, findings: Findings) -> None:
    """Report the first byte that is not UTF-8, at the place where it stands."""
    before = data[:at].decode("utf-8").removeprefix(_BOM)
    findings.sources[name] = data.decode("utf-8", "replace").removeprefix(_BOM)
    line, column = Lines(before).place(len(before))
    utf_16 = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    hint = "this looks like UTF-16: save it as UTF-8" if utf_16 else "save the file as UTF-8"
    span = Span(name, line, column, line, column + 1)
    findings.error("invalid-utf8", span, f"the byte 0x{data[at]:02x} is not UTF-8", hint)
