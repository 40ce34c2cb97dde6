"""Data files that a spec names: tables of numbers and lists of edges.

In: a path as the author wrote it, the folders it may lie in, and its place in the spec. Out: arrays, or findings at
that place. Files are opened only inside the root, only if they are regular ones, and never run or unpickled.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Final

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.diagnostics import Findings, Span, suggest
from neurovis_spec.language.data_files_csv import CellError, EdgeTable, Rows, parse_edges, parse_numbers, parse_rows
from neurovis_spec.language.data_files_npy import parse_npy
from neurovis_spec.language.reader_files import FileFault, read_bytes

__all__ = ["EdgeTable", "Table", "locate", "read_data", "read_edges", "read_table"]

LARGEST: Final = 256 << 20  # bytes; ten million connections in double precision are 80 MB


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Numbers in rows. ``values`` (rows × columns, float64) is NaN exactly where ``present`` is false: an empty cell.

    ``header`` holds the names of the columns, where the file has them; ``digest`` is the SHA-256 of its bytes, in hex.
    """

    values: NDArray[np.float64]
    present: NDArray[np.bool_]
    header: tuple[str, ...] | None
    digest: str


def locate(path_text: str, root: Path, base: Path, span: Span, findings: Findings) -> Path | None:
    """The file that an author means by a path: relative to ``base``, inside ``root`` also behind symbolic links.

    Codes: ``path-outside``, ``file-missing``. Whether there is such a file is not asked here.
    """
    shown = _short(path_text)
    if not path_text or "\0" in path_text:
        findings.error("file-missing", span, "this is no path of a file")
        return None
    if Path(path_text).is_absolute() or PureWindowsPath(path_text).drive or path_text.startswith(("/", "\\")):
        hint = "paths are relative to the file that names them"
        findings.error("path-outside", span, f"the path '{shown}' is absolute", hint)
        return None
    try:
        inside = root.resolve()
        path = (base / path_text).resolve()
    except (OSError, RuntimeError, ValueError):  # loops of links, names too long
        findings.error("file-missing", span, f"the file '{shown}' does not exist")
        return None
    if not path.is_relative_to(inside):
        hint = "data lies in the folder of the main spec or below it (--root names another folder)"
        findings.error("path-outside", span, f"the path '{shown}' leaves the folder of the spec", hint)
        return None
    return path


def read_data(path_text: str, root: Path, base: Path, span: Span, findings: Findings) -> bytes | None:
    """The bytes of a file that an author named; None, and a finding, where it must not or cannot be read."""
    path = locate(path_text, root, base, span, findings)
    if path is None:
        return None
    data = read_bytes(path, LARGEST)
    if isinstance(data, FileFault):
        hint = _neighbours(path) if data.code == "file-missing" else None
        findings.error(data.code, span, f"the file '{_short(path_text)}' {data.reason}", hint)
        return None
    return data


def read_table(path_text: str, root: Path, base: Path, span: Span, findings: Findings) -> Table | None:
    """A table of numbers from a ``.csv`` or ``.npy`` file; a one-dimensional array is a column.

    A ``.csv`` may begin with a row of texts, the header; its empty cells are absent. Codes: those of ``locate``, and
    ``file-kind``, ``file-unreadable``, ``too-large``, ``file-format``, ``not-finite``.
    """
    parsers: dict[str, Callable[[bytes], Rows]] = {".csv": parse_numbers, ".npy": _npy}
    suffix = Path(path_text).suffix.lower()
    if suffix not in parsers:
        message = f"'{_short(path_text)}' is no kind of file that holds numbers"
        findings.error("file-format", span, message, "known: " + ", ".join(parsers))
        return None
    data = read_data(path_text, root, base, span, findings)
    if data is None:
        return None
    try:
        rows = parsers[suffix](data)
    except CellError as error:
        _refuse(error, path_text, span, findings)
        return None
    return Table(rows.values, rows.present, rows.header, hashlib.sha256(data).hexdigest())


def read_edges(path_text: str, root: Path, base: Path, span: Span, findings: Findings) -> EdgeTable | None:
    """A list of edges from a ``.csv`` file whose header names the columns from, to, weight and perhaps delay.

    An empty weight is 1, an empty delay None. Codes: those of ``read_table``.
    """
    if Path(path_text).suffix.lower() != ".csv":
        findings.error("file-format", span, f"edges are read from a .csv file, not from '{_short(path_text)}'")
        return None
    data = read_data(path_text, root, base, span, findings)
    if data is None:
        return None
    try:
        return parse_edges(parse_rows(data), hashlib.sha256(data).hexdigest())
    except CellError as error:
        _refuse(error, path_text, span, findings)
        return None


def _npy(data: bytes) -> Rows:
    values = parse_npy(data)
    return Rows(values, np.ones(values.shape, dtype=np.bool_), None)


def _refuse(error: CellError, path_text: str, span: Span, findings: Findings) -> None:
    findings.error(error.code, span, f"the file '{_short(path_text)}': {error}", error.hint)


def _neighbours(path: Path) -> str | None:
    """A help line that names the files beside a missing one, where one of the same kind is alike."""
    try:
        beside = [entry for _, entry in zip(range(1000), path.parent.iterdir(), strict=False)]
    except OSError:
        return None
    hint = suggest(path.name, sorted(entry.name for entry in beside if entry.suffix == path.suffix))
    return hint if hint is not None and hint.startswith("did you mean") else None


def _short(text: str) -> str:
    return text if len(text) <= 80 else text[:78] + "…"
