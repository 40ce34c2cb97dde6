"""Data files of a spec: where they may lie, and that each is read once.

In: the folder of the spec and the root that no path may leave. Out: tables of numbers and lists of edges. What is much
too large for the place that names it is refused before it is made.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from neurovis_spec.compiler.limits import amount
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.data.files import (
    CellError,
    NamedFile,
    Room,
    Table,
    read_column,
    read_edges,
    read_sheet,
    read_table,
)
from neurovis_spec.language.located import Located
from neurovis_spec.language.tables import Condition, EdgeFile, FileReference
from neurovis_spec.language.unknown import UNKNOWN, Unknown

if TYPE_CHECKING:
    from neurovis_spec.arrays import FloatArray
    from neurovis_spec.language.data.edge_list import EdgeTable
    from neurovis_spec.language.data.sheet import Sheet

T = TypeVar("T")
#: Cells of a table that is read whatever its place needs: what is said of it then is more exact.
_FEW = 1 << 16


@dataclass
class _Shelf(Generic[T]):
    """What was read, each file once; UNKNOWN where it is invalid."""

    read: dict[Hashable, T | Unknown] = field(default_factory=dict)
    #: what was too large for a place, with what there is room for; another place may have more
    refused: set[Hashable] = field(default_factory=set)

    def get(self, file: Hashable, place: Hashable, room: Room, read: Callable[[Room], T | Unknown]) -> T | Unknown:
        """What ``read`` returns for a file, cached. ``room`` raises CellError where the file is too large for this
        place; that is remembered for the place alone, and the result is UNKNOWN."""
        if file in self.read:
            return self.read[file]
        if (file, place) in self.refused:
            return UNKNOWN

        def noting(count: int) -> None:
            try:
                room(count)
            except CellError:
                self.refused.add((file, place))
                raise

        found = read(noting)
        if (file, place) not in self.refused:
            self.read[file] = found
        return found


@dataclass
class OpenSheet:
    """A table whose columns have names, each of which is read once as numbers or texts. What is wrong with one is told
    where it is named first."""

    sheet: Sheet
    named: NamedFile
    findings: Findings
    _numbers: dict[str, FloatArray | Unknown] = field(default_factory=dict)
    _texts: dict[str, tuple[str, ...] | Unknown] = field(default_factory=dict)

    def numbers(self, column: Located[str], *, gaps: bool = True) -> FloatArray | Unknown:
        """A column of numbers, NaN where a cell is empty; UNKNOWN where one is invalid, which is reported. ``gaps``:
        whether a cell may be."""
        if column.value not in self._numbers:
            named, read = self.named._replace(span=column.span), partial(self.sheet.numbers, column)
            self._numbers[column.value] = read_column(named, read, self.findings, gaps=gaps)
        return self._numbers[column.value]

    def texts(self, column: Located[str]) -> tuple[str, ...] | Unknown:
        """A column of texts, "" where a cell is empty."""
        if column.value not in self._texts:
            read = partial(self.sheet.texts, column)
            self._texts[column.value] = read_column(self.named._replace(span=column.span), read, self.findings)
        return self._texts[column.value]


@dataclass
class Files:
    """The data files that a spec names. What is invalid in one is reported once, where it is named first."""

    base: Path
    root: Path
    findings: Findings
    _tables: _Shelf[Table] = field(default_factory=_Shelf)
    _edges: _Shelf[EdgeTable] = field(default_factory=_Shelf)
    _sheets: dict[Hashable, OpenSheet | Unknown] = field(default_factory=dict)

    def table(
        self, reference: FileReference, shape: tuple[int, int] | None = None, *, full: str = "", keyed: bool = True
    ) -> Table | Unknown:
        """The numbers of a file, and where it has none. A table of many more cells than the ``shape`` that its place
        needs is refused; whether a smaller one fits, the caller has to say. ``full``, if given, says what needs a
        number everywhere in a table of that shape. ``keyed``: the author can give a key at this place."""
        path, key = reference.path, reference.key

        def room(cells: int) -> None:
            if shape is not None and cells > max(_FEW, 2 * shape[0] * shape[1]):  # a header counts as well
                raise CellError("wrong-size", f"it has {amount(cells)} cells; {shape[0]} × {shape[1]} are wanted")

        def read(room: Room) -> Table | Unknown:
            return read_table(self._named(reference), self.findings, keyed=keyed, gaps=not full, room=room)

        file = (path.value, None if key is None else key.value, keyed, full)
        table = self._tables.get(file, shape, room, read)
        if table is UNKNOWN:
            return UNKNOWN
        gap = next(table.gaps(), None) if full and shape in (None, table.values.shape) else None
        if gap is not None:
            message = f"row {gap[0]}, column {gap[1]} of the file is empty; {full}"
            self.findings.error("file-format", path.span, message)
            return UNKNOWN
        return table

    def _named(self, reference: FileReference) -> NamedFile:
        return NamedFile(
            reference.path.value, self.root, self.base, reference.path.span, reference.key, reference.inline
        )

    def table_at(self, path: Located[str]) -> Table | Unknown:
        """The table of an input: of any size, beside whose path no key can stand."""
        reference = FileReference(path, None, path.span)
        return self.table(reference, full="an input needs a number everywhere", keyed=False)

    def sheet(
        self, file: FileReference, where: tuple[Condition, ...] = (), most: int | None = None
    ) -> OpenSheet | Unknown:
        """The rows of a table that count, whose columns have names: of at most so many rows, or as many as neurons may
        have."""
        key = None if file.key is None else file.key.value
        what = file.path.value, file.inline, key, most, *(one.what for one in where)
        if what not in self._sheets:
            named = self._named(file)
            sheet = read_sheet(named, where, self.findings, most)
            self._sheets[what] = UNKNOWN if sheet is UNKNOWN else OpenSheet(sheet, named, self.findings)
        return self._sheets[what]

    def edges(self, written: EdgeFile, most: int | None = None) -> EdgeTable | Unknown:
        """The edges of a file of text, at most so many."""
        path, key = written.file.path, written.file.key

        def room(edges: int) -> None:
            if most is not None and edges > most:
                message = f"it has {amount(edges)} edges; {amount(most)} more connections may be made"
                raise CellError("too-many", message, "raise the limit with --limit")

        def read(room: Room) -> EdgeTable | Unknown:
            return read_edges(self._named(written.file), self.findings, written=written, room=room)

        file = path.value, written.file.inline, None if key is None else key.value
        return self._edges.get((*file, written.what), most, room, read)
