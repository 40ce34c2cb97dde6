"""The spec as one text: what it includes and the data that it reads are inside.

In: a Spec, how it was compiled. Out: a YAML text that compiles to the same network (of the same hash) anywhere. A spec
that names no files, and of which nothing was set from outside, stays as it was written. A body stays behind: it is not
of the network, and lies where its files are.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable, Mapping
from io import StringIO
from pathlib import Path
from typing import Annotated, Final, TypeAlias

import numpy as np
from pydantic import TypeAdapter

from neurovis_spec.compiler.compile import Request
from neurovis_spec.compiler.connections.edges import EdgeColumns
from neurovis_spec.compiler.drawing.sections import line_style
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.data.edge_list import EdgeTable
from neurovis_spec.language.data.files import NamedFile, read_edges, read_sheet, read_table
from neurovis_spec.language.data.sheet import Sheet
from neurovis_spec.language.data.table import MOST_CELLS
from neurovis_spec.language.located import Leaf, Located
from neurovis_spec.language.modules import INCLUDED
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.tables import (
    WHERE,
    Condition,
    EdgeFile,
    EdgesField,
    as_where,
    columns_in,
    columns_of_edges,
    edge_column,
)
from neurovis_spec.language.unknown import UNKNOWN
from neurovis_spec.language.yaml.source import AnyList, Entry, Node, Scalar, one_or_more
from neurovis_spec.language.yaml.source import Mapping as SourceMapping

_WHERE: Final = TypeAdapter(Annotated[tuple[Condition, ...], Leaf(as_where, WHERE.shape)])
_EDGES: Final[TypeAdapter[object]] = TypeAdapter(EdgesField)
Plain: TypeAlias = "bool | int | float | str | list[Plain] | dict[str, Plain] | None"


def whole_text(spec: Spec, request: Request, sources: Mapping[str, str]) -> str:
    """The spec as one text. Raises SpecError where a file that it names is gone meanwhile."""
    findings = Findings()
    reader = _Reader(request.root, findings, line_style(spec.render))
    root = reader.mapping(spec.source, request.base, ())
    included = () if request.includes is None else request.includes.files
    own = sources.get(spec.source.span.file)
    if own is not None and not (reader.inlined or included or request.parameters or request.seed is not None):
        return own
    root.pop("include", None)
    for file in included:
        brought = reader.mapping(file.model.source, file.folder, ())
        for section in INCLUDED:
            there, more = root.setdefault(section, {}), brought.get(section)
            if isinstance(there, dict) and isinstance(more, dict):
                there.update(more)
            if not there:
                del root[section]
    _set(root, request)
    findings.check()
    return json.dumps(root, ensure_ascii=False, indent=1)


def _set(root: dict[str, Plain], request: Request) -> None:
    parameters = root.get("parameters")
    for name, value in request.parameters.items():
        if isinstance(parameters, dict) and name in parameters:
            written = parameters[name]
            parameters[name] = {**written, "value": value} if isinstance(written, dict) else value
    if request.seed is not None:
        root["seed"] = request.seed


class _Reader:
    """Makes plain values of nodes, with the data of files in their places."""

    def __init__(self, root: Path, findings: Findings, style: Located[str] | None) -> None:
        """``style``: the column of edges whose values pictures tell apart."""
        self._root, self._findings = root, findings
        self._perhaps = () if style is None else (style,)
        self.inlined = False
        #: the columns of texts that a connection names
        self._texts: tuple[Located[str], ...] = ()
        #: columns of edges that settings may name, at a connection that has some
        self._columns: EdgeColumns | None = None

    def mapping(self, node: SourceMapping, folder: Path, path: tuple[str, ...]) -> dict[str, Plain]:
        """A mapping, in its order."""
        if path[-2:-1] == ("inputs",) and node.get("file") is not None:
            rest = {e.name: self.value(e.value, folder, path) for e in node.entries if e.name not in ("file", "key")}
            return {**rest, "values": self._table(node, folder)}
        around, self._columns = self._columns, self._columns_of(node, folder) or self._columns
        if node.get("edges") is not None:
            label = node.get("label")
            self._texts = columns_in((label,)) if label is not None else ()
        result: dict[str, Plain] = {}
        for entry in node.entries:
            if (path == ("layout",) and entry.name == "file") or (not path and entry.name == "body"):
                self.inlined = True
                continue
            result[entry.name] = self.value(entry.value, folder, (*path, entry.name))
        self._columns = around
        return result

    def value(self, node: Node, folder: Path, path: tuple[str, ...]) -> Plain:
        """Any node."""
        if isinstance(node, SourceMapping):
            if path[-1:] not in (("edges",), ("spikes",)) and node.get("file") is not None and _has_columns(node):
                return self._inline(node, folder)
            is_matrix = path[-1:] in (("matrix",), ("centre",), ("position",)) or path[-2:-1] in (
                ("matrices",),
                ("set",),
            )
            if is_matrix and node.get("file") is not None:
                return self._table(node, folder)
            if path[-1:] == ("spikes",) and node.get("file") is not None:
                return self._spikes(node, folder)
            if path and path[-1] == "edges" and node.get("file") is not None:
                return self._edges(node, folder)
            if self._columns is not None and node.get("column") is not None and path[-1] != "label":
                column = edge_column(node, self._findings)
                values = UNKNOWN if column is UNKNOWN else self._columns.value(column, self._findings)
                return None if values is UNKNOWN else [*map(float, values)]
            return self.mapping(node, folder, path)
        if isinstance(node, AnyList):
            return [self.value(item, folder, path) for item in node.items]
        if path[-3:-2] == ("inputs",) and path[-1] == "spikes" and isinstance(node, Scalar):  # a path
            return self._spikes(SourceMapping((Entry(Scalar("file", node.span), node),), node.span), folder)
        return node.value

    def _named(self, node: SourceMapping, folder: Path) -> NamedFile:
        self.inlined = True
        file, key = node.get("file"), node.get("key")
        assert isinstance(file, Scalar)
        located = Located(str(key.value), key) if isinstance(key, Scalar) else None
        return NamedFile(str(file.value), self._root, folder, file.span, located)

    def _table(self, node: SourceMapping, folder: Path) -> Plain:
        table = read_table(self._named(node, folder), self._findings)
        if table is UNKNOWN:
            return None
        return [
            [value if there else None for value, there in zip(row, present, strict=True)]
            for row, present in zip(table.values.tolist(), table.present.tolist(), strict=True)
        ]

    def _inline(self, node: SourceMapping, folder: Path) -> Plain:
        """What stands in a table, with what is read of it as a text."""
        where = _WHERE.validate_python(node.get("where"), context=self._findings)
        sheet = read_sheet(self._named(node, folder), where, self._findings)
        used = [one for key in ("column", "columns", "by") if (found := node.get(key)) for one in one_or_more(found)]
        names = {str(one.value): Located(str(one.value), one) for one in used if isinstance(one, Scalar)}
        rest = {e.name: self.value(e.value, folder, ()) for e in node.entries if e.name not in ("file", "key", "where")}
        return None if sheet is UNKNOWN else {"csv": _text_of(sheet, names.values()), **rest}

    def _spikes(self, node: SourceMapping, folder: Path) -> Plain:
        """A table of spikes, with its two columns as a text."""
        sheet = read_sheet(self._named(node, folder), (), self._findings, MOST_CELLS)
        called = node.get("columns")
        names: dict[str, Located[str]] = {}
        for key in ("time", "index"):
            written = called.get(key) if isinstance(called, SourceMapping) else None
            name = written if isinstance(written, Scalar) else Scalar(key, node.span)
            names[key] = Located(str(name.value), name)
        rest = {e.name: self.value(e.value, folder, ()) for e in node.entries if e.name != "file"}
        columns = {name.value: name for name in names.values()}
        return None if sheet is UNKNOWN else {"csv": _text_of(sheet, columns.values()), **rest}

    def _edges(self, node: SourceMapping, folder: Path) -> Plain:
        written = self._written(node)._replace(texts=self._texts, perhaps=self._perhaps)
        edges = read_edges(self._named(node, folder), self._findings, written=written)
        if edges is UNKNOWN:
            return None
        return _with_texts(edges) if edges.texts else list(_rows(edges))

    def _written(self, node: SourceMapping) -> EdgeFile:
        written: object = _EDGES.validate_python(node, context=self._findings)
        assert isinstance(written, EdgeFile)
        return written

    def _columns_of(self, body: SourceMapping, folder: Path) -> EdgeColumns | None:
        """The columns of its edges that settings of a connection name; None where there are none."""
        edges = body.get("edges")
        if not isinstance(edges, SourceMapping) or edges.get("file") is None:
            return None
        choices = [one for key in ("synapse", "plasticity") if (node := body.get(key)) for one in one_or_more(node)]
        settings = [entry.value for one in choices if isinstance(one, SourceMapping) for entry in one.entries]
        more = [name for one in settings if isinstance(one, SourceMapping) for name in columns_of_edges(one)]
        if not more:
            return None
        written = self._written(edges)._replace(more=tuple({name.value: name for name in more}.values()))
        table = read_edges(self._named(edges, folder), self._findings, written=written)
        return None if table is UNKNOWN else EdgeColumns.of(table)


def _text_of(sheet: Sheet, names: Iterable[Located[str]]) -> str:
    """Some columns of a table, as a text."""
    text, used = StringIO(), [*names]
    columns = [sheet.texts(name) for name in used]
    csv.writer(text, lineterminator="\n").writerows([[name.value for name in used], *zip(*columns, strict=True)])
    return text.getvalue()


def _has_columns(node: SourceMapping) -> bool:
    return node.get("column") is not None or node.get("columns") is not None


def _with_texts(edges: EdgeTable) -> Plain:
    """Edges as a table within a spec, with their further columns of texts."""
    count = range(len(edges))
    table: dict[str, list[object]] = {name: [texts.of(edge) for edge in count] for name, texts in edges.texts.items()}
    called: dict[str, Plain] = {}
    for what, cells in _cells(edges).items():
        name, place = what, edges.columns.get(what)
        own = place is not None and edges.header[place - 1] == what
        while not own and name.casefold() in map(str.casefold, table):
            name += "'"
        called[what] = name
        table[name] = cells
    seconds = called.pop("delay_seconds", None)
    if seconds is not None and called.pop("delay", None) is None:  # else both are called as we call them
        called["delay"] = {"column": seconds, "unit": "s"}
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows([[*table], *zip(*table.values(), strict=True)])
    return {"csv": text.getvalue(), "columns": called}


def _cells(edges: EdgeTable) -> dict[str, list[object]]:
    """What a table has of edges, by what each column is for; an empty cell where nothing is said."""
    found: dict[str, list[object]] = {"from": [*edges.sources], "to": [*edges.targets]}
    found["weight"] = [*edges.weights.tolist()]
    steps = edges.delays.tolist()
    if max(steps, default=-1) >= 0:
        found["delay"] = ["" if delay < 0 else delay for delay in steps]
    if edges.seconds is not None:
        found["delay_seconds"] = ["" if math.isnan(time) else time for time in edges.seconds.tolist()]
    return found


def _rows(edges: EdgeTable) -> Iterable[Plain]:
    """Edges as a spec writes them."""
    seconds = np.full(len(edges), np.nan) if edges.seconds is None else edges.seconds
    columns = edges.weights.tolist(), edges.delays.tolist(), seconds.tolist()
    for source, target, weight, steps, time in zip(edges.sources, edges.targets, *columns, strict=True):
        delay: list[Plain] = [] if steps < 0 else [steps]
        yield [source, target, weight, *(delay if math.isnan(time) else [f"{time!r} s"])]
