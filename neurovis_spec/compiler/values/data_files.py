"""Data files of a spec: where they may lie, and that each is read once.

In: the folder of the spec and the root that no path may leave. Out: tables of numbers and lists of edges. What is much
too large for the place that names it is refused before it is made.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from neurovis_spec.compiler.limits import amount
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.data.files import CellError, Room, Table, read_edges, read_table
from neurovis_spec.language.located import Located
from neurovis_spec.language.values import FileReference

if TYPE_CHECKING:
    from neurovis_spec.language.data.edge_list import EdgeTable

T = TypeVar("T")
#: Cells of a table that is read whatever its place needs: what is said of it then is more exact.
_FEW = 1 << 16


@dataclass
class _Shelf(Generic[T]):
    """What was read, each file once; None where it is invalid."""

    read: dict[Hashable, T | None] = field(default_factory=dict)
    #: what was too large for a place, with what there is room for; another place may have more
    refused: set[Hashable] = field(default_factory=set)

    def get(self, file: Hashable, place: Hashable, room: Room, read: Callable[[Room], T | None]) -> T | None:
        """What ``read`` makes of a file in which there is room at a place for so much."""
        if file in self.read:
            return self.read[file]
        if (file, place) in self.refused:
            return None

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
class Files:
    """The data files that a spec names. What is invalid in one is reported once, where it is named first."""

    base: Path
    root: Path
    findings: Findings
    _tables: _Shelf[Table] = field(default_factory=_Shelf)
    _edges: _Shelf[EdgeTable] = field(default_factory=_Shelf)

    def table(
        self, reference: FileReference, shape: tuple[int, int] | None = None, *, gaps: bool = True
    ) -> Table | None:
        """The numbers of a file, and where it has none, which the caller refuses if there may be no ``gaps``; None
        where it is invalid. A table of many more cells than the ``shape`` that its place needs is refused; whether a
        smaller one fits, the caller has to say."""
        return self._table(reference.path, reference.key, shape, keyed=True, gaps=gaps)

    def table_at(self, path: Located[str]) -> Table | None:
        """The same of a path alone, beside which no ``key`` can stand, without gaps and of any size."""
        return self._table(path, None, None, keyed=False, gaps=False)

    def edges(self, reference: FileReference, most: int | None = None) -> EdgeTable | None:
        """The edges of a ``.csv`` file, at most so many; None where it is invalid."""
        path, key = reference.path, reference.key

        def room(edges: int) -> None:
            if most is not None and edges > most:
                message = f"it has {amount(edges)} edges; {amount(most)} more connections may be made"
                raise CellError("too-many", message, "raise the limit with --limit")

        def read(room: Room) -> EdgeTable | None:
            return read_edges(path.value, self.root, self.base, path.span, self.findings, key, room=room)

        return self._edges.get((path.value, None if key is None else key.value), most, room, read)

    def _table(
        self, path: Located[str], key: Located[str] | None, shape: tuple[int, int] | None, *, keyed: bool, gaps: bool
    ) -> Table | None:
        def room(cells: int) -> None:
            if shape is not None and cells > max(_FEW, 2 * shape[0] * shape[1]):  # a header counts as well
                raise CellError("wrong-size", f"it has {amount(cells)} cells; {shape[0]} × {shape[1]} are wanted")

        def read(room: Room) -> Table | None:
            where = (path.value, self.root, self.base, path.span)
            return read_table(*where, self.findings, key, keyed=keyed, gaps=gaps, room=room)

        return self._tables.get((path.value, None if key is None else key.value, keyed, gaps), shape, room, read)
