"""Edge lists: ``[from, to, weight, delay]`` rows, from the spec or from a file.

In: rows as written or a file, the neurons of both ends. Out: positions within the ends, weights and delays (none where
an edge names none), in the order written; of a file further columns that settings name. Long plain lists go from the
reader's packed arrays straight into arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray, Texts, narrow
from neurovis_spec.compiler.connections.delays import DelayReader, Delays, Timed, text_of
from neurovis_spec.compiler.limits import LONGEST_DELAY, PATIENCE
from neurovis_spec.compiler.names.references import Directory, few
from neurovis_spec.compiler.values.cells import Cells, cells_of, seen_by_pairs, values_of
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.located import time_of
from neurovis_spec.language.tables import EdgeColumn, EdgeFile, EdgeRows
from neurovis_spec.language.units import Seconds
from neurovis_spec.language.unknown import UNKNOWN, Unknown, known
from neurovis_spec.language.yaml.source import NULL, TEXT
from neurovis_spec.likeness import suggest

if TYPE_CHECKING:
    from neurovis_spec.language.data.edge_list import EdgeTable

_AN_EDGE = "an edge is [from, to], [from, to, weight] or [from, to, weight, delay]"


class EdgeList(NamedTuple):
    """Edges: positions within the ends, weights, delays."""

    i: Indices
    j: Indices
    weights: FloatArray
    delays: Delays
    #: of edges of a file what else is read of it
    columns: EdgeColumns | None = None


class EdgeColumns(NamedTuple):
    """Columns of a file of edges, one number a connection, NaN where a cell is empty, or one text. ``rows`` are those
    of the file, ``places`` says which column each is, from 1, and ``header`` how all are called."""

    values: Mapping[str, FloatArray]
    rows: Indices
    places: Mapping[str, int]
    texts: Mapping[str, Texts]
    header: tuple[str, ...]

    @staticmethod
    def of(table: EdgeTable) -> EdgeColumns:
        """Those of a file."""
        return EdgeColumns(table.more, narrow(table.rows()), table.columns, table.texts, table.header)

    def at(self, kept: IntArray) -> EdgeColumns:
        """Those of some connections, in this order."""
        values = {name: values[kept] for name, values in self.values.items()}
        texts = {name: texts.at(kept) for name, texts in self.texts.items()}
        return self._replace(values=values, rows=self.rows[kept], texts=texts)

    def value(self, wanted: EdgeColumn, findings: Findings) -> FloatArray | Unknown:
        """One of them; UNKNOWN where cells are empty that must not be, which is reported."""
        values = self.values[wanted.name.value]
        empty = np.flatnonzero(np.isnan(values))
        if not len(empty):
            return values
        if wanted.default is None:
            for place in empty[:PATIENCE].tolist():
                at = f"row {self.rows[place]}, column {self.places[wanted.name.value]} of the file"
                hint = "fill it in, or write a default: {column: NAME, default: NUMBER}"
                findings.error("file-format", wanted.span, f"{at} is empty", hint, key=place)
            return UNKNOWN
        return np.where(np.isnan(values), wanted.default, values)


@dataclass(frozen=True)
class End:
    """The neurons that belong to an end. Of one that is UNKNOWN, those of its ``directory`` may."""

    neurons: Indices | Unknown
    directory: Directory
    #: the names of all neurons of the network, and how many characters of them are the path of the scope
    called: tuple[str, ...]
    path: int
    #: the neurons that tables call otherwise, by what they call them
    by_id: Mapping[str, tuple[int, ...]]
    #: whether any name may be that of one, as what tables call some is invalid
    open: bool = False

    @cached_property
    def positions(self) -> Mapping[str, int] | Unknown:
        """The positions within the end of its neurons, by the names that they have in the scope."""
        if self.neurons is UNKNOWN:
            return UNKNOWN
        return {self.called[neuron][self.path :]: position for position, neuron in enumerate(self.neurons.tolist())}

    def indices(self, names: tuple[str, ...]) -> IntArray:
        """The position of each of these neurons; −1 where one cannot belong to the end, 0 where it may."""
        if self.positions is UNKNOWN:
            known = (self.open or self.directory.find(name) is not None or name in self.by_id for name in names)
            return np.array([0 if one else -1 for one in known], dtype=np.int64)
        places: dict[str, tuple[int, ...]] = {name: (self.positions.get(name, -1),) for name in names}
        if self.by_id:
            places |= {name: self.called_by(name) for name, place in places.items() if place == (-1,)}
        return np.array([found[0] if len(found) == 1 else -1 for found in map(places.__getitem__, names)], np.int64)

    def called_by(self, name: str) -> tuple[int, ...]:
        """The positions within the end of the neurons that tables call so."""
        if self.neurons is UNKNOWN or name not in self.by_id:
            return ()
        return tuple(np.flatnonzero(np.isin(self.neurons, self.by_id[name])).tolist())

    @property
    def names(self) -> Collection[str]:
        """The neurons that may belong to it, by their names and what tables call them."""
        if self.positions is UNKNOWN:
            return self.directory.neurons
        return [*self.positions, *(one for one in self.by_id if self.called_by(one))] if self.by_id else self.positions

    @property
    def size(self) -> float | Unknown:
        """How many belong to it."""
        return UNKNOWN if self.neurons is UNKNOWN else float(len(self.neurons))


@dataclass(frozen=True)
class EdgeReader:
    """Reads the edges of one entry."""

    sources: End
    targets: End
    constants: Constants
    files: Files
    stream: Stream
    #: how many connections may be made; None where that is not known
    most: int | None = None

    def read(self, edges: EdgeRows | EdgeFile) -> EdgeList | Unknown:
        """All edges; UNKNOWN where one is invalid."""
        if isinstance(edges, EdgeFile):
            return self._from_file(edges)
        if len(edges.node) == 0:
            self.constants.findings.error("wrong-size", edges.node.span, "there is no edge in this list")
            return UNKNOWN
        cells = cells_of(edges.node, self.constants.findings, _AN_EDGE, named=True)
        return UNKNOWN if cells is UNKNOWN else self._from_cells(cells)

    def _from_cells(self, cells: Cells) -> EdgeList | Unknown:
        """The edges of a list in the spec, a row of cells each."""
        findings = self.constants.findings
        widths = cells.widths
        right = (widths >= 2) & (widths <= 4)
        wrong = np.flatnonzero(~right)
        for row in wrong[:PATIENCE].tolist():
            if widths[row] or not cells.failed:  # what failed may have been no row at all
                findings.error("wrong-type", cells.row_span(row), _AN_EDGE)
        first = cells.starts[:-1]
        i = self._ends(cells, first[right], self.sources, "source")
        j = self._ends(cells, first[right] + 1, self.targets, "target")
        # the indices of the edges that have a weight, and of those that have a delay
        weighted, delayed = np.flatnonzero(right & (widths >= 3)), np.flatnonzero(right & (widths == 4))
        ends = UNKNOWN if i is UNKNOWN or j is UNKNOWN or len(wrong) else (i[weighted], j[weighted])
        with self.constants.following() as parts:
            given_weights = self._given_weights(cells, first[weighted] + 2, ends)
        # the indices of a part count the edges that have a weight; from here on they count all edges
        self.constants.follow(part._replace(places=weighted[part.within(len(weighted))]) for part in parts)
        delays = self._given_delays(cells, first[delayed] + 3, delayed)
        if i is UNKNOWN or j is UNKNOWN or given_weights is UNKNOWN or delays is UNKNOWN:
            return UNKNOWN
        if len(wrong) or cells.failed:
            return UNKNOWN
        weights = np.ones(len(widths))
        weights[weighted] = given_weights
        return EdgeList(i, j, weights, delays)

    def _ends(self, cells: Cells, which: IntArray, end: End, what: str) -> Indices | Unknown:
        """The positions of the neurons that these cells name."""
        findings = self.constants.findings
        no_names = which[cells.kinds[which] != TEXT]
        for cell in no_names[:PATIENCE].tolist():
            if findings.is_invalid(cells.node(cell).span):  # it is no cell at all
                continue
            findings.error("wrong-type", cells.node(cell).span, f"the {what} of an edge is the name of a neuron")
        which = which[cells.kinds[which] == TEXT]
        texts = cells.numbers[which].astype(np.int64)
        positions = self._positions(cells.texts, texts, end, what, lambda at: (cells.node(int(which[at])).span, ""))
        return UNKNOWN if len(no_names) else positions

    def _positions(
        self, names: tuple[str, ...], which: Indices, end: End, what: str, where: Callable[[int], tuple[Span, str]]
    ) -> Indices | Unknown:
        """The positions in an end of the neurons that edges name, by the numbers of these names. ``where`` says of an
        edge where it stands, and what is to be added in words."""
        positions = narrow(end.indices(names))[which]
        unknown = np.flatnonzero(positions < 0)
        _, once = np.unique(which[unknown], return_index=True)
        for edge in unknown[np.sort(once)].tolist()[:PATIENCE]:
            self._report_outside(names[int(which[edge])], end, what, *where(edge))
        return UNKNOWN if len(unknown) or end.positions is UNKNOWN else positions

    def _given_weights(
        self, cells: Cells, which: IntArray, ends: tuple[Indices, Indices] | Unknown
    ) -> FloatArray | Unknown:
        """The weights in these cells, 1 for a null; they are checked even if their ends are invalid."""
        i, j = known(ends, (UNKNOWN, UNKNOWN))
        seen = seen_by_pairs(i, j, (self.sources.size, self.targets.size), self.stream)
        values = values_of(cells, which, self.constants, *seen)
        return UNKNOWN if values is UNKNOWN else np.where(cells.kinds[which] == NULL, 1.0, values)

    def _given_delays(self, cells: Cells, which: IntArray, edges: IntArray) -> Delays | Unknown:
        """The delays in these cells, each of an edge: few distinct ones, each evaluated once."""
        reader, steps = DelayReader(self.constants), np.full(len(cells.widths), -1, dtype=np.int64)
        places: dict[tuple[int, float], list[int]] = {}
        for place, cell in enumerate(which.tolist()):
            key = int(cells.kinds[cell]), float(cells.numbers[cell]) if cells.kinds[cell] != NULL else 0.0
            places.setdefault(key, []).append(place)
        exact, timed, failed = np.full(len(steps), np.nan), list[Timed](), False
        for alike in places.values():
            formula = time_of(cells.node(int(which[alike[0]])), self.constants.findings)
            in_seconds = formula is not UNKNOWN and isinstance(formula.value, Seconds)
            found = UNKNOWN if formula is UNKNOWN else reader.single(formula, in_seconds)
            if formula is UNKNOWN or found is UNKNOWN:
                failed = True
                continue
            own = edges[alike]
            steps[own], exact[own] = found
            if in_seconds:
                timed.append(Timed(formula.span, text_of(formula), own))
        return UNKNOWN if failed else Delays(narrow(steps), exact if timed else None, tuple(timed))

    def _report_outside(self, name: str, end: End, what: str, span: Span, where: str) -> None:
        """Report a neuron that does not belong to an end, which is ``what``: a source or a target."""
        if not name.strip():
            message = f"the {what} of an edge is the name of a neuron, this is empty"
            self.constants.findings.error("wrong-type", span, message)
            return
        if len(end.called_by(name)) > 1:
            message = f"'{shorten(name)}'{where} is the id of {len(end.called_by(name))} {what}s of this entry"
            advice = "name the neuron, or give the groups entries of their own"
            self.constants.findings.error("edge-outside", span, message, advice, key=(what, where, name))
            return
        hint = suggest(name, few(name, end.names), "neurons" if end.positions is UNKNOWN else f"{what}s of this entry")
        message, lost = f"'{shorten(name)}'{where} is not among the {what}s of this entry", None
        if end.directory.find(name) is None:
            message, lost = f"there is no neuron '{shorten(name)}'{where}", end.directory.undeclared(name)
        key = (what, where) if where else None
        self.constants.findings.error("edge-outside", span, message, hint, key=key, undeclared=lost)

    def _from_file(self, written: EdgeFile) -> EdgeList | Unknown:
        table = self.files.edges(written, self.most)
        if table is UNKNOWN:
            return UNKNOWN
        span = written.file.path.span
        if not len(table) and table.fault is None:
            self.constants.findings.error("wrong-size", span, "there is no edge in this file")
            return UNKNOWN
        i, j = (
            self._positions(table.names, which, end, what, lambda edge: (span, f" (row {table.row(edge)} of the file)"))
            for which, end, what in ((table.begins, self.sources, "source"), (table.ends, self.targets, "target"))
        )
        delays = table.delays.compact()
        long = np.flatnonzero(delays > LONGEST_DELAY).tolist()
        for place in long[:PATIENCE]:
            message = f"row {table.row(place)} of the file: a delay must be at most {LONGEST_DELAY:,}"
            self.constants.findings.error("out-of-range", span, message, key=("delay", place))
        given: Delays | Unknown = Delays(delays)
        if table.seconds is not None:
            reader = DelayReader(self.constants)
            timed = reader.each(table.seconds, span, True, False, lambda edge: f"row {table.row(edge)} of the file")
            given = UNKNOWN if timed is UNKNOWN else timed.over(Delays(delays))
        if i is UNKNOWN or j is UNKNOWN or long or table.fault is not None or given is UNKNOWN:
            return UNKNOWN
        further = written.more or written.texts or written.perhaps
        return EdgeList(i, j, table.weights, given, EdgeColumns.of(table) if further else None)
