"""The reader: a text, or a file, becomes a SourceDocument.

In: bytes or a text, and the name that findings call it by. Out: a document whose values know where they stand, or None
where it could not be read to its end. Findings are collected, never raised; the text read is kept in
``findings.sources`` for showing them.
"""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import Final

from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.gc_paused import uncollected
from neurovis_spec.language.yaml.characters import FORBIDDEN, REPLACEMENT, Lines, character_name
from neurovis_spec.language.yaml.opening import FileFault, read_bytes
from neurovis_spec.language.yaml.parser import Parser
from neurovis_spec.language.yaml.refusals import ONE_GROUP, TABLE, TOO_LONG, TOO_MANY, crowded
from neurovis_spec.language.yaml.source import Mapping, Node, Scalar, SourceDocument, describe

LARGEST: Final = 64 << 20  # bytes
_MOST_CHARACTERS: Final = 20
_BOM: Final = "\ufeff"


def read_file(path: Path, name: str, findings: Findings) -> SourceDocument | None:
    """Read a file; ``name`` is what findings call it. Never raises for what is in the file or in its stead."""
    data = read_bytes(path, LARGEST)
    if isinstance(data, FileFault):
        findings.error(data.code, Span(name, 1, 1, 1, 1), f"the file {data.reason}")
        return None
    return read_content(data, name, findings)


def read_content(data: bytes, name: str, findings: Findings) -> SourceDocument | None:
    """Read the bytes of a file that findings call ``name``."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        _refuse_bytes(data, error.start, name, findings)
        return None
    return read_text(text, name, findings)


def read_text(text: str, file: str, findings: Findings) -> SourceDocument | None:
    """Read a text; ``file`` is what findings call it.

    Never raises for what is in the text. None means that it has no root that is a mapping, or that nobody can tell what
    a syntax error has cost; a document is returned also where there were findings that reading could get past.
    """
    text = text.removeprefix(_BOM)
    findings.sources[file] = text
    if len(text) > LARGEST or (4 * len(text) > LARGEST and len(text.encode("utf-8", "replace")) > LARGEST):
        findings.error("too-large", Span(file, 1, 1, 1, 1), f"the text is larger than {LARGEST >> 20} MiB")
        return None
    many = crowded(text)
    if many is not None:
        line, column = text.count("\n", 0, many) + 1, many - text.rfind("\n", 0, many)
        words = (TOO_LONG, TABLE) if text[many] == "-" else (TOO_MANY, ONE_GROUP)
        findings.error("too-large", Span(file, line, column, line, column + 1), *words)
        return None
    lines = Lines(text)
    clean = _without_forbidden(text, file, lines, findings)
    errors = findings.errors
    with uncollected():
        root = Parser(clean, file).document(findings)
    if root is None and findings.errors > errors:
        return None
    return _document(root, file, findings)


def read_any(text: str, file: str) -> Node | None:
    """What there is of a text, sound or not: the parts of values with syntax errors, too."""
    with uncollected():
        return Parser(FORBIDDEN.sub(REPLACEMENT, text), file, partial=True).document(Findings())


def comments(text: str) -> list[int]:
    """Where the comments of a text begin."""
    parser = Parser(FORBIDDEN.sub(REPLACEMENT, text), "", partial=True)
    with uncollected():
        parser.document(Findings())
    return parser.comments


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


def _refuse_bytes(data: bytes, at: int, name: str, findings: Findings) -> None:
    """Report the first byte that is not UTF-8, at the place where it stands."""
    before = data[:at].decode("utf-8").removeprefix(_BOM)
    findings.sources[name] = data.decode("utf-8", "replace").removeprefix(_BOM)
    line, column = Lines(before).place(len(before))
    utf_16 = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    hint = "this looks like UTF-16: save it as UTF-8" if utf_16 else "save the file as UTF-8"
    span = Span(name, line, column, line, column + 1)
    findings.error("invalid-utf8", span, f"the byte 0x{data[at]:02x} is not UTF-8", hint)
