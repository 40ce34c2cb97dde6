"""Values that stand in columns of a file: which file, which columns, which of its rows.

In: nodes. Out: frozen values, whose names of columns know their places; no file is opened here.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import Annotated, Final, NamedTuple, TypeGuard

from pydantic import TypeAdapter, ValidationError, ValidationInfo

from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.grammar import (
    CELL,
    FORMULA,
    NULL,
    REFERENCES,
    UNNAMED,
    Either,
    Key,
    ListOf,
    Map,
    Plain,
    Row,
    words,
)
from neurovis_spec.language.keys import Words, read_keys
from neurovis_spec.language.located import (
    Leaf,
    Located,
    as_text,
    each,
    findings_of,
    formula_of,
    give_up,
    one_of,
    refuse,
)
from neurovis_spec.language.model import opening
from neurovis_spec.language.units import TIME_ABOUTS, TIMES
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.source import AnyList, Entry, Mapping, Node, Scalar, Sequence, one_or_more

#: ``{file: path}``.
FILE: Final = Map(
    {
        "file": Key(UNNAMED, "A file, by its path relative to this one.", required=True),
        "key": Key(UNNAMED, "The name of the array in an archive."),
    }
)


class FileReference(NamedTuple):
    """``{file: path}``; ``key`` names the array of an archive. ``inline``: the path is no path but the text itself."""

    path: Located[str]
    key: Located[str] | None
    span: Span
    inline: bool = False


#: How the names of files end that hold a table of numbers.
DATA_FILES: Final = (".csv", ".tsv", ".txt", ".dat", ".npy", ".npz", ".mtx")
#: How those of text end whose cells something separates.
TEXT_FILES: Final = (".csv", ".tsv", ".txt", ".dat")
#: How those end whose columns have names.
TABLE_FILES: Final = (*TEXT_FILES, ".npz", ".parquet")


def file_and_keys(node: Mapping, shape: Map, info: ValidationInfo) -> tuple[FileReference, Mapping]:
    """The file of a mapping of this shape, and the mapping with its keys as they are meant."""
    keys = read_keys(node, shape.known, findings_of(info))
    node = keys.mapping
    inline = node.get("csv") if "csv" in shape.known else None
    path, key = node.get("file"), node.get("key")
    if path is not None and inline is not None:
        message = "'csv' beside 'file': values stand in one table"
        findings_of(info).error("conflicting-keys", inline.span, message, "remove one of them")
        give_up()
    if path is None and inline is None:
        if keys.lack("file"):
            findings_of(info).error("missing-key", opening(node), "the key 'file' is missing", "write {file: PATH}")
        give_up()
    text = as_text(path or inline or node, info)
    return FileReference(text, None if key is None else as_text(key, info), node.span, inline is not None), node


def as_file(node: Mapping, info: ValidationInfo) -> FileReference:
    """``{file: path, key: name}``."""
    return file_and_keys(node, FILE, info)[0]


def file_hint(node: Node) -> str | None:
    """How a file is named whose path stands in its place."""
    path = node.value if isinstance(node, Scalar) else None
    return f"write {{file: {path}}}" if isinstance(path, str) and path.endswith(DATA_FILES) else None


NUMBER: Final = Plain({"type": "number"})
#: A value that a cell may have: a text, a number, true or false, or nothing.
_VALUE: Final = Either((Plain({"type": ["string", "number", "boolean"]}), NULL))
WHERE: Final = Key(
    Map({}, Either((_VALUE, ListOf(_VALUE, least=1)))),
    "The rows that count: {COLUMN: value}, or {COLUMN: [values]}; of several columns all must fit.",
)


class Condition(NamedTuple):
    """The rows that have one of some values in a column."""

    column: Located[str]
    values: tuple[Scalar, ...]

    @property
    def what(self) -> tuple[object, ...]:
        """The same whoever says so."""
        return self.column.value, *((type(value.value), value.value) for value in self.values)


def as_where(node: Node | None, info: ValidationInfo) -> tuple[Condition, ...]:
    """``{COLUMN: value}``, or a list of values; nothing without a node."""
    if node is None:
        return ()
    if not isinstance(node, Mapping) or not node.entries:
        refuse(info, node, "columns with the values that count", "write where: {COLUMN: value}")
    return each(node.entries, _condition, info)


def _condition(entry: Entry, info: ValidationInfo) -> Condition:
    items = one_or_more(entry.value)
    if not items:
        refuse(info, entry.value, "a value, or a list of values")
    return Condition(Located(entry.name, entry.key), each(items, _cell, info))


def _cell(node: Node, info: ValidationInfo) -> Scalar:
    return node if isinstance(node, Scalar) else refuse(info, node, "a text, a number, true, false or null")


#: A cell of a matrix, or the weight of an edge.
CELL_OF_ROWS: Final = Either((Plain(FORMULA.written, CELL, formula=True), NULL))
_END: Final = Plain({"type": "string", "pattern": "\\S"}, REFERENCES)
_EDGE: Final = Row((_END, _END, CELL_OF_ROWS, FORMULA), least=2)


class EdgeRows(NamedTuple):
    """Edges as written: ``[from, to, weight, delay]``, the last two optional (checked when they are connected)."""

    node: AnyList


class EdgeFile(NamedTuple):
    """A file of edges. ``columns`` are what is called otherwise in it: ``from``, ``to``, ``weight``, ``delay``; a delay
    with a ``unit`` is a time; ``more`` are columns of numbers that others read of the edges, ``texts`` those of texts,
    and ``perhaps`` columns of texts that are read where the file has them."""

    file: FileReference
    columns: tuple[tuple[str, Located[str]], ...] | None = None
    unit: Located[str] | None = None
    where: tuple[Condition, ...] = ()
    more: tuple[Located[str], ...] = ()
    texts: tuple[Located[str], ...] = ()
    perhaps: tuple[Located[str], ...] = ()

    @property
    def span(self) -> Span:
        """Where it stands."""
        return self.file.span

    @property
    def what(self) -> Hashable:
        """What is read of the file: the same whoever says so."""
        columns = None if self.columns is None else tuple((what, name.value) for what, name in self.columns)
        unit = None if self.unit is None else self.unit.value
        further = (tuple(name.value for name in some) for some in (self.more, self.texts, self.perhaps))
        return columns, unit, tuple(one.what for one in self.where), *further


_UNIT: Final = words(*TIMES, abouts=TIME_ABOUTS)
_DELAYS: Final = Map(
    {
        "column": Key(UNNAMED, "What the column is called.", required=True),
        "unit": Key(_UNIT, "The unit of the delays; without one they are steps."),
    }
)
EDGE_COLUMNS: Final = Map(
    {
        "from": Key(UNNAMED, "The column of the sources (default from)."),
        "to": Key(UNNAMED, "The column of the targets (default to)."),
        "weight": Key(UNNAMED, "The column of the weights (default weight, if there is one)."),
        "delay": Key(
            Either((UNNAMED, _DELAYS)),
            "The column of the delays: a name, if they are steps, or {column: NAME, unit: ms} (default delay or "
            "delay_seconds, if there is one).",
        ),
    },
    least=1,
)
_EDGE_FILE: Final = Map(
    {
        "file": Key(UNNAMED, "A file, by its path relative to this one."),
        "csv": Key(UNNAMED, "The edges themselves, as a text, in place of a file."),
        "key": FILE.known["key"],
        "columns": Key(EDGE_COLUMNS, "What the columns are called; the file may have others, too."),
        "where": WHERE,
    }
)
_ELSEWHERE: Final = {
    **dict.fromkeys(("source", "src", "pre", "origin"), "from"),
    **dict.fromkeys(("target", "tgt", "post"), "to"),
    **dict.fromkeys(("weights", "w"), "weight"),
    **dict.fromkeys(("delays", "latency"), "delay"),
}


def as_edges(node: Node, info: ValidationInfo) -> EdgeRows | EdgeFile:
    """A list of edges, or a file."""
    if isinstance(node, Mapping):
        return _as_edge_file(node, info)
    if not isinstance(node, AnyList):
        refuse(info, node, "a list of edges [from, to, weight], or {file: …}", file_hint(node))
    rows = node.items[:1] if isinstance(node, Sequence) else (node.cell(0),) if node.rows is None else ()
    for row in rows:
        if not isinstance(row, AnyList):
            refuse(info, row, "an edge, that is a list", "edges are a list of lists: [[A, B, 0.5], [A, C, 1]]")
    return EdgeRows(node)


def _as_edge_file(node: Mapping, info: ValidationInfo) -> EdgeFile:
    file, keys = file_and_keys(node, _EDGE_FILE, info)
    where = as_where(keys.get("where"), info)
    written = keys.get("columns")
    if written is None:
        return EdgeFile(file, None, None, where)
    if not isinstance(written, Mapping) or not written.entries:
        refuse(info, written, "the names of columns", "write columns: {from: NAME, to: NAME}")
    found = read_keys(written, EDGE_COLUMNS.known, findings_of(info), Words(elsewhere=_ELSEWHERE)).mapping
    columns, unit = list[tuple[str, Located[str]]](), None
    for entry in found.entries:
        if entry.name not in EDGE_COLUMNS.known:
            give_up()
        if entry.name == "delay" and isinstance(entry.value, Mapping):
            name, unit = _delay_column(entry.value, info)
        else:
            name = as_text(entry.value, info)
        columns.append((entry.name, name))
    return EdgeFile(file, tuple(columns), unit, where)


def _delay_column(node: Mapping, info: ValidationInfo) -> tuple[Located[str], Located[str] | None]:
    keys = read_keys(node, _DELAYS.known, findings_of(info)).mapping
    column, unit = keys.get("column"), keys.get("unit")
    if column is None:
        refuse(info, node, "the column of the delays", "write delay: {column: NAME, unit: ms}")
    name = as_text(column, info)
    return name, None if unit is None else one_of(*TIMES)(unit, info)


#: A column of the edges of an entry, as a value of each of its connections.
OF_EDGES: Final = Map(
    {
        "column": Key(UNNAMED, "A column of the file of the entry's edges.", required=True),
        "default": Key(NUMBER, "What an empty cell is; without it, none may be empty."),
    }
)
EdgesField = Annotated[EdgeRows | EdgeFile, Leaf(as_edges, Either((ListOf(_EDGE), _EDGE_FILE)))]


class TableColumn(NamedTuple):
    """Values in columns of a file, one row a neuron: in order, or those that a column ``by`` names. ``default`` is what
    takes the place of an empty cell and of a row that is missing."""

    file: FileReference
    columns: tuple[Located[str], ...]
    by: Located[str] | None
    default: Node | None
    where: tuple[Condition, ...]
    span: Span


_COMMON: Final = {
    "file": Key(UNNAMED, "A file, by its path relative to this one."),
    "csv": Key(UNNAMED, "The table itself, as a text, in place of a file."),
    "key": FILE.known["key"],
    "by": Key(UNNAMED, "The column of the neurons' names, by which rows are found; without it they are in order."),
    "where": WHERE,
}
_COLUMN: Final = Key(UNNAMED, "The column of the values.", required=True)
#: A number for each neuron, a text for each, a position for each.
NUMBERS: Final = Map(
    {
        **_COMMON,
        "column": _COLUMN,
        "default": Key(NUMBER, "What an empty cell is, and what a neuron has that no row names."),
    }
)
WORDS: Final = Map(
    {
        **_COMMON,
        "column": _COLUMN,
        "default": Key(UNNAMED, "What an empty cell is, and what a neuron has that no row names."),
    }
)
#: The rows themselves are the neurons then.
NAMES: Final = Map({**{key: value for key, value in _COMMON.items() if key != "by"}, "column": _COLUMN})
PLACES: Final = Map(
    {
        **_COMMON,
        "columns": Key(ListOf(UNNAMED, least=2, most=2), "The columns of x and y.", required=True),
    }
)


def _as_column(node: Mapping, shape: Map, info: ValidationInfo) -> TableColumn:
    """What a mapping of this shape says."""
    file, keys = file_and_keys(node, shape, info)
    where, by, default = as_where(keys.get("where"), info), keys.get("by"), keys.get("default")
    several = "columns" in shape.known
    written = keys.get("columns" if several else "column")
    if written is None:
        if keys.entry("column") is None:
            hint = "write {file: PATH, columns: [x, y]}" if several else "write {file: PATH, column: NAME}"
            name = "columns" if several else "column"
            findings_of(info).error("missing-key", opening(node), f"the key '{name}' is missing", hint)
        give_up()
    if several and (not isinstance(written, AnyList) or len(written) not in _DIMENSIONS):
        refuse(info, written, "the columns of x and y, or of x, y and z")
    columns = each(one_or_more(written), as_text, info)
    if default is not None and not isinstance(default, Scalar):
        refuse(info, default, "a number or a text")
    return TableColumn(file, columns, None if by is None else as_text(by, info), default, where, node.span)


#: How many numbers a position has.
_DIMENSIONS: Final = (2, 3)


def as_numbers_column(node: Mapping, info: ValidationInfo) -> TableColumn:
    """``{file: PATH, column: NAME}``, with a number for each neuron."""
    column = _as_column(node, NUMBERS, info)
    if column.default is not None and number_of_default(column.default, findings_of(info)) is UNKNOWN:
        give_up()
    return column


def as_words_column(node: Mapping, info: ValidationInfo) -> TableColumn:
    """The same with a text for each."""
    column = _as_column(node, WORDS, info)
    if column.default is not None:
        as_text(column.default, info)
    return column


def as_names_column(node: Mapping, info: ValidationInfo) -> TableColumn:
    """The same with the name of a neuron in each row that counts."""
    return _as_column(node, NAMES, info)


def as_places_column(node: Mapping, info: ValidationInfo) -> TableColumn:
    """``{file: PATH, columns: [x, y]}``, with a position for each."""
    return _as_column(node, PLACES, info)


_NUMBERS: Final[TypeAdapter[TableColumn]] = TypeAdapter(Annotated[TableColumn, Leaf(as_numbers_column, NUMBERS)])


def numbers_column(node: Mapping, findings: Findings) -> TableColumn | Unknown:
    """What a setting says that stands in a table; UNKNOWN where it is invalid, which is reported."""
    try:
        return _NUMBERS.validate_python(node, context=findings)
    except ValidationError:
        return UNKNOWN


def is_from_table(node: Node) -> TypeGuard[Mapping]:
    """Whether a value is one of a table."""
    return isinstance(node, Mapping) and any(node.entry(key) is not None for key in ("column", "file", "csv"))


class EdgeColumn(NamedTuple):
    """``{column: NAME}``: a column of the edges of an entry; what an empty cell is, None where none may be."""

    name: Located[str]
    default: float | None
    span: Span


def edge_column(node: Mapping, findings: Findings) -> EdgeColumn | Unknown:
    """What a mapping that is a value of connections says."""
    if node.get("file") is not None:
        message = "a value of connections is a column of the file of their edges"
        findings.error("wrong-type", node.span, message, "write {column: NAME}, and edges: {file: …}")
        return UNKNOWN
    keys = read_keys(node, OF_EDGES.known, findings).mapping
    name, default = keys.get("column"), keys.get("default")
    if not isinstance(name, Scalar) or not isinstance(name.value, str):
        findings.error("wrong-type", node.span if name is None else name.span, "the name of a column is wanted here")
        return UNKNOWN
    number = None if default is None else number_of_default(default, findings)
    return UNKNOWN if number is UNKNOWN else EdgeColumn(Located(name.value, name), number, node.span)


def number_of_default(node: Node, findings: Findings) -> float | Unknown:
    """What takes the place of what a table has not: a number."""
    formula = formula_of(node, findings)
    value = UNKNOWN if formula is UNKNOWN else formula.value
    if not isinstance(value, str):
        return value if value is UNKNOWN else float(value)
    findings.error("wrong-type", node.span, "a default is a number, no expression")
    return UNKNOWN


class EdgeTexts(NamedTuple):
    """``{column: NAME}``: a column of texts of the edges of an entry."""

    name: Located[str]
    span: Span


TEXTS_OF_EDGES: Final = Map(
    {"column": Key(UNNAMED, "A column of the file of the entry's edges; an empty cell is no text.", required=True)}
)


def as_edge_texts(node: Node, info: ValidationInfo) -> EdgeTexts:
    """``{column: NAME}``."""
    if not isinstance(node, Mapping):
        refuse(info, node, "a column of the file of an entry's edges", "write {column: NAME}")
    keys = read_keys(node, TEXTS_OF_EDGES.known, findings_of(info)).mapping
    name = keys.get("column")
    if name is None:
        refuse(info, node, "a column of the file of an entry's edges", "write {column: NAME}")
    return EdgeTexts(as_text(name, info), node.span)


def columns_of_edges(settings: Mapping) -> tuple[Located[str], ...]:
    """The columns of edges that settings name."""
    return columns_in(entry.value for entry in settings.entries)


def columns_in(values: Iterable[Node]) -> tuple[Located[str], ...]:
    """The columns that values name."""
    found = (value.get("column") for value in values if isinstance(value, Mapping))
    return tuple(Located(one.value, one) for one in found if isinstance(one, Scalar) and isinstance(one.value, str))
