"""Data files that a spec names: tables of numbers and lists of edges.

In: a path as the author wrote it, the folders it may lie in, and its place in the spec. Out: arrays, or findings at
that place. Files are opened only inside the root, only if they are regular ones, and never run or unpickled. What
reads a kind of file is imported with the first file of that kind.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import islice
from pathlib import Path, PureWindowsPath
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.data.table import (
    EMPTY_CELL,
    MOST_CELLS,
    MOST_FAULTS,
    CellError,
    Faults,
    Room,
    Table,
    full,
    in_cell,
)
from neurovis_spec.language.located import Located
from neurovis_spec.language.tables import DATA_FILES, TABLE_FILES, TEXT_FILES, Condition, EdgeFile
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.opening import FileFault, read_parts
from neurovis_spec.likeness import suggest
from neurovis_spec.real_paths import real_path

if TYPE_CHECKING:
    from neurovis_spec.language.data.edge_list import EdgeTable
    from neurovis_spec.language.data.sheet import Sheet

__all__ = [
    "DATA_FILES",
    "CellError",
    "NamedFile",
    "Room",
    "Table",
    "locate",
    "read_column",
    "read_data",
    "read_edges",
    "read_sheet",
    "read_table",
]

T = TypeVar("T")
LARGEST: Final = 256 << 20  # bytes; ten million connections in double precision are 80 MB
#: characters of a path: what common systems take
LONGEST_PATH: Final = 4096
#: what is said of NaN and infinity where no cell may be empty
NO_GAP: Final = "a finite number is needed in every cell"
#: bytes of a file that are let go together, as soon as they are read
_PART: Final = 1 << 22
#: bytes of a file of text that is shown with what is wrong in it
_SHOWN: Final = 1 << 20
_FROM: Final = "paths are relative to the file that names them"


class NamedFile(NamedTuple):
    """A file as an author names it: by a path relative to ``base``, inside ``root`` also behind symbolic links; where
    that stands, and with which ``key`` of an array in it. ``inline``: the path is no path but the text itself."""

    path: str
    root: Path
    base: Path
    span: Span
    key: Located[str] | None = None
    inline: bool = False

    @property
    def called(self) -> str:
        """What it is called in a sentence."""
        return "the table" if self.inline else f"the file '{_short(self.path)}'"


def locate(file: NamedFile, findings: Findings) -> Path | Unknown:
    """The file that an author means.

    Codes: ``path-outside``, ``file-missing``. Whether there is such a file is not asked here.
    """
    path_text, root, base, span, *_ = file
    shown = _short(path_text)
    if not path_text or "\0" in path_text:
        findings.error("file-missing", span, "this is no path of a file")
        return UNKNOWN
    if len(path_text) > LONGEST_PATH:
        message = f"a path of {len(path_text):,} characters is no path of a file; {LONGEST_PATH:,} are the most"
        findings.error("file-missing", span, message)
        return UNKNOWN
    if Path(path_text).is_absolute() or PureWindowsPath(path_text).drive or path_text.startswith(("/", "\\")):
        findings.error("path-outside", span, f"the path '{shown}' is absolute", _FROM)
        return UNKNOWN
    try:
        inside, path = real_path(root), real_path(base / path_text)
    except ValueError:  # a lone surrogate
        findings.error("file-missing", span, f"the file '{shown}' does not exist")
        return UNKNOWN
    if not path.is_relative_to(inside):
        hint = "data lies in the folder of the main spec or below it (--root names another folder)"
        findings.error("path-outside", span, f"the path '{shown}' leaves the folder of the spec", hint)
        return UNKNOWN
    findings.files.setdefault(path, "")
    return path


def read_data(file: NamedFile, findings: Findings) -> bytes | Unknown:
    """The bytes of a file that an author named; UNKNOWN, and a finding, where it must not or cannot be read."""
    parts = _read_parts(file, findings)
    return UNKNOWN if parts is UNKNOWN else b"".join(parts)


def _read_parts(file: NamedFile, findings: Findings, size: int | None = None) -> list[bytes] | Unknown:
    """The same in parts of this size."""
    path = locate(file, findings)
    if path is UNKNOWN:
        return UNKNOWN
    data = read_parts(path, LARGEST, size)
    if isinstance(data, FileFault):
        hint = (_neighbours(path) or _FROM) if data.code == "file-missing" else None
        findings.error(data.code, file.span, f"the file '{_short(file.path)}' {data.reason}", hint)
        return UNKNOWN
    return data


def read_table(
    file: NamedFile,
    findings: Findings,
    *,
    keyed: bool = True,
    gaps: bool = True,
    inside: bool = False,
    kinds: Iterable[str] = DATA_FILES,
    room: Room | None = None,
) -> Table | Unknown:
    """A table of numbers from a file of one of these ``kinds``; an array of one dimension is a column.

    A ``.csv`` may begin with a row of texts, the header; its empty cells are absent, and so is what an ``.mtx`` and a
    sparse ``.npz`` leave out. The key of the file names an array of an ``.npz``; ``keyed`` says whether the author can
    give one at this place, ``gaps`` whether cells may be empty there. ``inside``: none may, and findings stand at the
    cells of a ``.csv``, not where it is named. ``room`` may refuse a table for its size before it is made. Codes: those
    of ``read_data`` and ``room``, and ``file-format``, ``invalid-utf8``, ``not-finite``, ``cell-empty``,
    ``missing-key``, ``unknown-array``, ``useless-key``.
    """
    key, suffix = file.key, Path(file.path).suffix.lower()
    if suffix not in kinds:
        message = f"'{_short(file.path)}' is no kind of file that holds numbers"
        findings.error("file-format", file.span, message, "known: " + ", ".join(kinds))
        return UNKNOWN
    if key is not None and suffix != ".npz":
        _refuse_key(key, findings)
        return UNKNOWN
    data = read_data(file, findings)
    if data is UNKNOWN:
        return UNKNOWN
    try:
        table = _parsed(suffix, data, None if key is None else key.value, room)
        if inside:
            _check_full(table)
        return table
    except CellError as error:
        if error.code == "missing-key" and not keyed:
            error = CellError("file-format", str(error), "keep the one that is meant in a file of its own")
        place = key.span if key is not None and error.code == "unknown-array" else file.span
        shown = data if inside and suffix == ".csv" else None
        _refuse(error, file.called, place, findings, gaps=gaps and not inside, shown=shown)
        return UNKNOWN


def _check_full(table: Table) -> None:
    """Refuse empty cells. Raises CellError."""
    faults = Faults()
    for row, column in islice(table.gaps(), MOST_FAULTS):
        faults.note(in_cell(row, column, "a cell is empty", NO_GAP, "cell-empty"))
    faults.check()


def _parsed(suffix: str, data: bytes, key: str | None, room: Room | None) -> Table:
    """The table in a file of one of DATA_FILES. Raises CellError."""
    if suffix == ".csv":
        from neurovis_spec.language.data.csv_table import parse_numbers

        return parse_numbers(data, room)
    if suffix in TEXT_FILES:
        from neurovis_spec.language.data.csv_table import parse_separated

        return parse_separated(data, suffix, room)
    if suffix == ".npy":
        from neurovis_spec.language.data.npy import parse_npy

        return full(parse_npy(data, room))
    if suffix == ".mtx":
        from neurovis_spec.language.data.mtx import parse_mtx

        return parse_mtx(data, room)
    from neurovis_spec.language.data.npy import parse_npz

    return parse_npz(data, key, room)


def read_edges(
    named: NamedFile, findings: Findings, *, written: EdgeFile | None = None, room: Room | None = None
) -> EdgeTable | Unknown:
    """A list of edges from a file of text whose header names the columns from, to, weight and perhaps delay, or what is
    ``written`` that they are called.

    An empty weight is 1, an empty delay −1; a key is refused; ``room`` may refuse so many edges before they are
    made. Where rows are invalid, these are reported, and the table has a ``fault``. Codes: those of ``read_data`` and
    of ``room``, and ``file-format``, ``invalid-utf8``, ``not-finite``, ``useless-key``.
    """
    suffix = ".csv" if named.inline else Path(named.path).suffix.lower()
    if suffix not in (TABLE_FILES if written else TEXT_FILES):
        message = f"edges are read from a .csv file, not from '{_short(named.path)}'"
        findings.error("file-format", named.span, message)
        return UNKNOWN
    if named.key is not None:
        _refuse_key(named.key, findings)
        return UNKNOWN
    parts = [_inline(named)] if named.inline else _read_parts(named, findings, _PART)
    if parts is UNKNOWN:
        return UNKNOWN
    from neurovis_spec.language.data.edge_list import edges_of, parse_edges

    try:
        if written is None or suffix in TEXT_FILES:
            table = parse_edges(parts, room, written)
        else:
            table = edges_of(_sheet_in(b"".join(parts), named, written.where, MOST_CELLS), written, room)
    except CellError as error:
        _refuse(error, named.called, named.span, findings)
        return UNKNOWN
    if not named.inline:
        note(named, table.about, findings)
    if table.fault is not None:
        _refuse(table.fault, named.called, named.span, findings)
    return table


def read_sheet(
    named: NamedFile, where: tuple[Condition, ...], findings: Findings, most: int | None = None
) -> Sheet | Unknown:
    """A table whose columns have names, of the rows that count: of at most so many rows, or as many as neurons may
    have. Codes: those of ``read_data``, and ``file-format``,
    ``invalid-utf8``, ``too-large``, ``useless-key``."""
    if not named.inline and Path(named.path).suffix.lower() not in TABLE_FILES:
        message = f"'{_short(named.path)}' is no kind of file whose columns have names"
        findings.error("file-format", named.span, message, "known: " + ", ".join(TABLE_FILES))
        return UNKNOWN
    if named.key is not None:
        _refuse_key(named.key, findings)
        return UNKNOWN
    data = _inline(named) if named.inline else read_data(named, findings)
    if data is UNKNOWN:
        return UNKNOWN
    try:
        sheet = _sheet_in(data, named, where, most)
    except CellError as error:
        _refuse(error, named.called, named.span, findings)
        return UNKNOWN
    if not named.inline:
        note(named, sheet.about, findings)
    return sheet


def _inline(named: NamedFile) -> bytes:
    """What stands in the spec, as the bytes of a file."""
    return named.path.encode("utf-8", "replace")


def _sheet_in(data: bytes, named: NamedFile, where: tuple[Condition, ...], most: int | None = None) -> Sheet:
    """The table of a file of one of TABLE_FILES, of at most so many rows, or as many as neurons may have. Raises
    CellError."""
    from neurovis_spec.language.data.sheet import MOST_ROWS, parse_sheet

    rows = MOST_ROWS if most is None else most
    suffix = "" if named.inline else Path(named.path).suffix.lower()
    if suffix in (".npz", ".parquet"):
        from neurovis_spec.language.data.array_sheet import parse_npz_sheet, parse_parquet_sheet

        return (parse_npz_sheet if suffix == ".npz" else parse_parquet_sheet)(data, where, rows)
    return parse_sheet(data, suffix, where, rows)


def read_column(named: NamedFile, read: Callable[[], T], findings: Findings, *, gaps: bool = True) -> T | Unknown:
    """What is read of a column of a sheet, which may have ``gaps``; UNKNOWN where something of it is invalid, which is
    reported."""
    try:
        return read()
    except CellError as error:
        _refuse(error, named.called, named.span, findings, gaps=gaps)
        return UNKNOWN


def note(named: NamedFile, about: str, findings: Findings) -> None:
    """Keep what was found in a file by looking at it, for whoever asks what a network is made of."""
    path = locate(named, Findings())
    if about and path is not UNKNOWN:
        before = findings.files.get(path)
        findings.files[path] = about if not before or before == about else f"{before}; {about}"


def _refuse_key(key: Located[str], findings: Findings) -> None:
    findings.error("useless-key", key.span, "'key' names an array of an .npz file, and this file is none")


def _refuse(
    error: CellError, called: str, span: Span, findings: Findings, *, gaps: bool = True, shown: bytes | None = None
) -> None:
    """All that is wrong with a file; at the cells of a file of text, where this is ``shown``."""
    from neurovis_spec.language.data.csv_table import cell_at

    for number, one in enumerate((error, *error.others)):
        hint = NO_GAP if one.hint == EMPTY_CELL and not gaps else one.hint
        if shown is None:
            message, at = str(one), one.span or span
            if one.span is None:
                message = f"{called}: {one}"
            findings.error(one.code, at, message, hint, key=(number, message))
        else:
            place = cell_at(shown, span.file, one.at) if any(one.at) else span
            findings.error(one.code, place, str(one), hint)
    if shown is not None and len(shown) <= _SHOWN:
        findings.sources[span.file] = shown.decode("utf-8-sig", "replace")


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
