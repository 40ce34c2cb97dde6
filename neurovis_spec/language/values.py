"""Values that may be written in several ways: choices with parameters, matrices, references, patterns.

In: nodes. Out: one frozen value each, so that nobody behind this module asks again how it was written.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from collections.abc import Mapping as AnyMapping
from typing import Annotated, ClassVar, Final, Generic, NamedTuple, TypeAlias, TypeVar, cast, get_args

from pydantic import Field, ValidationInfo

from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.grammar import (
    BOOL,
    ENDS,
    FORMULA,
    FORMULAS,
    GROUP,
    NULL,
    PORT,
    REFERENCE,
    REFERENCES,
    RULE_SETTING,
    SYNAPSE_SETTING,
    TEXT,
    TWO,
    UNNAMED,
    Either,
    Key,
    Kind,
    ListOf,
    Map,
    Plain,
    Role,
    Shape,
    declaring,
    words,
)
from neurovis_spec.language.keys import Keys, Words, read_keys
from neurovis_spec.language.located import (
    IDENTIFIER,
    NAME,
    Formula,
    FormulaField,
    Leaf,
    Located,
    TextField,
    as_bool,
    as_formula,
    as_identifier,
    as_measured,
    as_parts,
    as_text,
    as_time,
    each,
    findings_of,
    give_up,
    in_unit,
    one_of,
    refuse,
    value_or,
)
from neurovis_spec.language.model import Model, NamedParameters, Short
from neurovis_spec.language.tables import (
    CELL_OF_ROWS,
    FILE,
    NUMBERS,
    OF_EDGES,
    FileReference,
    TableColumn,
    as_file,
    as_numbers_column,
    file_hint,
    is_from_table,
)
from neurovis_spec.language.units import Seconds, measured
from neurovis_spec.language.words import VIEWPOINTS, Combine
from neurovis_spec.language.yaml.source import AnyList, Entry, Mapping, Node, Scalar, Sequence, one_or_more

T = TypeVar("T")
#: What is declared in a definition, and known in it alone.
LOCAL = declaring("local")


class Choice(NamedTuple):
    """``name`` or ``{name: {parameter: value, …}}``: a definition with its settings."""

    name: Located[str]
    settings: Mapping


def as_choice(node: Node, info: ValidationInfo) -> Choice:
    """A name, or a mapping with one key whose value is a mapping of settings (or nothing)."""
    if isinstance(node, Scalar):
        if not isinstance(node.value, str):
            refuse(info, node, "a name, or {name: {parameter: value}}")
        return Choice(as_text(node, info), Mapping((), node.span))
    if not isinstance(node, Mapping):
        refuse(info, node, "a name, or {name: {parameter: value}}", "one for all of a group: give each its own group")
    entry = sole(node, "name", _chosen_by(node) or "write name, or {name: {parameter: value}}", info)
    name = Located(entry.name, entry.key)
    if isinstance(entry.value, Scalar) and entry.value.value is None:
        return Choice(name, Mapping((), entry.value.span))
    if not isinstance(entry.value, Mapping):
        refuse(
            info,
            entry.value,
            f"a mapping of the settings of '{shorten(entry.name)}'",
            f"write {{{shorten(entry.name)}: {{SETTING: {_shown(entry.value)}}}}}",
        )
    return Choice(name, entry.value)


def _shown(node: Node) -> str:
    return shorten(str(node.value)) if isinstance(node, Scalar) else "…"


def _chosen_by(node: Mapping) -> str | None:
    """What to write for a choice whose name is the value of a key, as other languages have it."""
    first = node.entries[0] if node.entries else None
    if first is None or first.name not in ("name", "type", "kind") or not isinstance(first.value, Scalar):
        return None
    settings = ", ".join(f"{entry.name}: …" for entry in node.entries[1:])
    return f"write {{{shorten(str(first.value.value))}: {{{shorten(settings)}}}}}"


def sole(node: Mapping, what: str, hint: str, info: ValidationInfo) -> Entry:
    """The only entry of a mapping."""
    if len(node.entries) != 1:
        span = node.entries[1].key.span if node.entries else node.span
        findings_of(info).error("one-key", span, f"expected one {what} here, found {len(node.entries)}", hint)
        give_up()
    return node.entries[0]


#: The key under which a signal of a rule has one component for each source.
FROM: Final = "from"


def _choice(kind: Kind, value: Role, *others: Map) -> Either:
    """A name, or a mapping from it to its settings, each a formula or several, or something else."""
    formula = Plain(FORMULA.written, value, formula=True)
    settings = Map({}, Either((formula, ListOf(formula), *others)), Role("setting", kind), nothing=True)
    return Either((TEXT, Map({}, settings, Role("choice", kind), one=True)))


def _of_sources(value: Role) -> Map:
    """A signal with one component for each source."""
    name = Plain({"type": "string"}, value)
    return Map({FROM: Key(Either((name, ListOf(name))), "What has one value for each source.", True)}, one=True)


ActivationField = Annotated[
    Choice, Leaf(as_choice, _choice("activation", GROUP, NUMBERS)), Role("choice", "activation")
]
ModelField = Annotated[Choice, Leaf(as_choice, _choice("model", GROUP, NUMBERS)), Role("choice", "model")]
SynapseField = Annotated[
    Choice, Leaf(as_choice, _choice("synapse", SYNAPSE_SETTING, OF_EDGES)), Role("choice", "synapse")
]


def as_choices(node: Node, info: ValidationInfo) -> tuple[Choice, ...]:
    """A choice, or a list of several."""
    if isinstance(node, AnyList) and not len(node):
        refuse(info, node, "a rule, or a list of rules", "leave the key out where nothing learns")
    return tuple(as_choice(item, info) for item in one_or_more(node))


_RULE: Final = _choice("rule", RULE_SETTING, _of_sources(RULE_SETTING), OF_EDGES)
RulesField = Annotated[
    tuple[Choice, ...], Leaf(as_choices, Either((_RULE, ListOf(_RULE, least=1)))), Role("choice", "rule")
]


class MatrixRows(NamedTuple):
    """Dense rows as written: every row a list of formulas or nulls (checked when they are evaluated)."""

    node: AnyList

    @property
    def span(self) -> Span:
        """The whole matrix."""
        return self.node.span


#: A matrix as it is written.
Written: TypeAlias = MatrixRows | FileReference


class MatrixName(NamedTuple):
    """A matrix of a module, by its name."""

    name: Located[str]

    @property
    def span(self) -> Span:
        """Where it is named."""
        return self.name.span


Matrix: TypeAlias = Written | MatrixName


def as_matrix(node: Node, info: ValidationInfo) -> Matrix:
    """A list of rows, a file, or the name of a matrix of the module."""
    if isinstance(node, Scalar) and isinstance(node.value, str) and IDENTIFIER.fullmatch(node.value):
        return MatrixName(Located(node.value, node))
    return as_written(node, info)


def as_written(node: Node, info: ValidationInfo) -> Written:
    """A list of rows, or a file."""
    if isinstance(node, Mapping):
        return as_file(node, info)
    if not isinstance(node, AnyList):
        refuse(info, node, "a list of rows, or {file: …}", file_hint(node))
    rows = node.items if isinstance(node, Sequence) else (node.cell(0),) if node.rows is None else ()
    for row in rows:
        if not isinstance(row, AnyList):
            refuse(info, row, "a row, that is a list", "a matrix is a list of lists: [[1, 2], [3, 4]]")
    return MatrixRows(node)


_ROWS: Final = ListOf(ListOf(CELL_OF_ROWS))

_MATRIX: Final = Either((_ROWS, FILE, NAME))
MatrixField = Annotated[Matrix, Leaf(as_matrix, _MATRIX)]
#: One that a module declares.
WrittenField = Annotated[Written, Leaf(as_written, Either((_ROWS, FILE)))]


def as_given(node: Node, info: ValidationInfo) -> Formula | Written:
    """What an instance sets: a number or an expression of a parameter, or a matrix."""
    return as_measured(node, info) if isinstance(node, Scalar) else as_written(node, info)


GivenField = Annotated[Formula | Written, Leaf(as_given, Either((FORMULA, _ROWS, FILE)), True)]


def as_centre(node: Node, info: ValidationInfo) -> Formula | Written:
    """Like a weight or like a matrix."""
    return as_formula(node, info) if isinstance(node, Scalar) else as_written(node, info)


CentreField = Annotated[Formula | Written, Leaf(as_centre, Either((FORMULA, _ROWS, FILE)))]

_DELAYS: Final = Map({"matrix": Key(_MATRIX, "The delay of each pair, sources as rows.")}, one=True)
_DELAY: Final = Map(
    {
        "seconds": Key(Either((FORMULA, _DELAYS)), "The delay in seconds, as an expression or {matrix: …}."),
        "matrix": Key(_MATRIX, "The delay of each pair in steps, sources as rows."),
    },
    one=True,
)


class Tie(NamedTuple):
    """``{same_as: A -> B}`` or ``{transpose: A -> B}``: the weights of an entry are those of another one, connection by
    connection, or with sources as targets."""

    entry: Located[str]
    transposed: bool

    @property
    def span(self) -> Span:
        """Where the other entry is named."""
        return self.entry.span


_OTHER: Final = Plain({"type": "string", "pattern": "->"}, ENDS)
_TIE: Final = Map(
    {
        "same_as": Key(_OTHER, "The entry whose weights these are, connection by connection."),
        "transpose": Key(_OTHER, "The entry whose weights these are, its sources as targets."),
    },
    one=True,
)


def as_weight(node: Node, info: ValidationInfo) -> Formula | Tie:
    """A formula, or whose weights they are."""
    if not isinstance(node, Mapping):
        return as_formula(node, info)
    keys = read_keys(node, _TIE.known, findings_of(info)).mapping
    entry = sole(keys, "way to tie weights", "write {same_as: FROM -> TO} or {transpose: FROM -> TO}", info)
    return Tie(as_text(entry.value, info), entry.name == "transpose") if entry.name in _TIE.known else give_up()


WeightField = Annotated[Formula | Tie, Leaf(as_weight, Either((FORMULA, _TIE)), True)]


class Delay(NamedTuple):
    """How long signals travel, of all connections or of each pair in a matrix: steps, or ``in_seconds``."""

    value: Formula | Matrix
    in_seconds: bool = False

    @property
    def span(self) -> Span:
        """Where it stands."""
        return self.value.span


def as_delay(node: Node, info: ValidationInfo) -> Delay:
    """Steps, a time with its unit, ``{seconds: …}`` or ``{matrix: …}``."""
    if isinstance(node, AnyList):
        refuse(info, node, "a delay", "rows of delays stand in a matrix: write {matrix: …}")
    if not isinstance(node, Mapping):
        time = as_time(node, info)
        return Delay(time, isinstance(time.value, Seconds))
    keys = read_keys(node, _DELAY.known, findings_of(info), Words(_no_delay)).mapping
    entry = sole(keys, "kind of delay", "write {seconds: …} or {matrix: …}", info)
    if entry.name == "matrix":
        return Delay(as_matrix(entry.value, info))
    if entry.name != "seconds":
        give_up()
    if not isinstance(entry.value, Mapping):
        return Delay(as_time(entry.value, info), in_seconds=True)
    keys = read_keys(entry.value, _DELAYS.known, findings_of(info), Words(_no_delay)).mapping
    entry = sole(keys, "matrix", "write {matrix: …}", info)
    return Delay(as_matrix(entry.value, info), in_seconds=True) if entry.name == "matrix" else give_up()


def _no_delay(name: str) -> tuple[str, str] | None:
    """What is said of a key of a delay that belongs into a matrix."""
    return (f"a delay has no '{name}'", "write {matrix: {file: …}}") if name in ("file", "key") else None


class FormulaList(NamedTuple):
    """A list of n values, one each."""

    items: tuple[Formula, ...]
    span: Span


#: What gives a number to each neuron.
Values: TypeAlias = Formula | FormulaList | TableColumn
VALUES: Final = Either((FORMULA, ListOf(FORMULA), NUMBERS))


def as_values(node: Node, info: ValidationInfo) -> Values:
    """Formulas that may have units, or a column of a table."""
    return as_numbers_column(node, info) if is_from_table(node) else as_all_measured(node, info)


def as_formulas(node: Node, info: ValidationInfo) -> Formula | FormulaList:
    """A formula, or a list with one for each neuron."""
    if isinstance(node, AnyList):
        return FormulaList(each(node.items, as_formula, info), node.span)
    return as_formula(node, info)


def as_all_measured(node: Node, info: ValidationInfo) -> Formula | FormulaList:
    """The same of what may have a unit: numbers with one stay texts."""
    if isinstance(node, AnyList):
        return FormulaList(each(node.items, as_measured, info), node.span)
    return as_measured(node, info)


def as_feed(node: Node, info: ValidationInfo) -> Formula | FormulaList | None:
    """What an input is fed: a formula, a list with one for each of its numbers, or null for nothing any more."""
    return None if isinstance(node, Scalar) and node.value is None else as_formulas(node, info)


def all_in_unit(formulas: Values, unit: str, findings: Findings) -> Values:
    """The same with numbers with a unit in this one, if it is any (``in_unit``); those of a table have none."""
    if isinstance(formulas, TableColumn):
        return formulas
    if isinstance(formulas, FormulaList):
        return FormulaList(tuple(in_unit(item, unit, findings) for item in formulas.items), formulas.span)
    return in_unit(formulas, unit, findings)


class Initial(NamedTuple):
    """What a group begins with: its activity at step 0 (None: it is computed), and states of its model."""

    activity: Values | None
    states: tuple[tuple[Located[str], Values], ...] = ()


def as_initial(node: Node, info: ValidationInfo) -> Initial:
    """The activity, or a mapping of states and ``activity``."""
    if is_from_table(node):
        return Initial(as_numbers_column(node, info))
    if not isinstance(node, Mapping):
        return Initial(as_formulas(node, info))
    if not node.entries:
        refuse(info, node, "a value, or states with their values", "write {activity: 0.5}")
    found = {entry.name: (Located(entry.name, entry.key), as_values(entry.value, info)) for entry in node.entries}
    _, activity = found.pop(ACTIVITY, (None, None))
    return Initial(activity, tuple(found.values()))


#: What stands beside the states of a model in ``initial``.
ACTIVITY = "activity"
_STATES: Final = Map(
    {ACTIVITY: Key(VALUES, "The activity at step 0; without it step 0 is computed.")},
    VALUES,
    Role("state", "model"),
    least=1,
)
#: What an event sets: a parameter or weights to a formula, weights to one number each, too.
SetField = Annotated[Formula | FormulaList, Leaf(as_all_measured, FORMULAS, True)]
FeedField = Annotated[Formula | FormulaList | None, Leaf(as_feed, Either((FORMULA, ListOf(FORMULA), NULL)), True)]
InitialField = Annotated[Initial, Leaf(as_initial, Either((VALUES, _STATES)))]


DelayField = Annotated[Delay, Leaf(as_delay, Either((FORMULA, _DELAY)))]


class AtPort(NamedTuple, Generic[T]):
    """What a group gives to a port, or a connection does there. ``port`` is None where none is named: it is drive."""

    value: T
    port: Located[str] | None = None


def at_ports(
    read: Callable[[Node, ValidationInfo], T], shape: Shape, wanted: str, not_ports: Collection[str] = ()
) -> Leaf[Node]:
    """The annotation of a field that takes a value for drive, or a mapping of ports, each with a value. A mapping with
    one of the keys ``not_ports`` is no such mapping."""

    def check(node: Node, info: ValidationInfo) -> tuple[AtPort[T], ...]:
        if not isinstance(node, Mapping) or any(node.entry(key) is not None for key in not_ports):
            return (AtPort(read(node, info)),)
        if not node.entries:
            refuse(info, node, wanted)
        return tuple(AtPort(read(one.value, info), Located(one.name, one.key)) for one in node.entries)

    return Leaf(check, Either((shape, Map({}, shape, PORT, least=1))))


def as_destinations(node: Node, info: ValidationInfo) -> tuple[AtPort[Formula | None], ...]:
    """The name of a port, or a mapping of ports and factors."""
    if isinstance(node, AnyList) or (isinstance(node, Mapping) and not node.entries):
        refuse(info, node, "the name of a port, or ports with factors", "write port: NAME, or {NAME: 1, NAME: 1}")
    if not isinstance(node, Mapping):
        return (AtPort(None, as_text(node, info)),)
    return tuple(AtPort(as_formula(one.value, info), Located(one.name, one.key)) for one in node.entries)


DestinationsField = Annotated[
    tuple[AtPort[Formula | None], ...],
    Leaf(as_destinations, Either((Plain(TEXT.written, PORT), Map({}, FORMULA, PORT, least=1)))),
]
BiasField = Annotated[
    tuple[AtPort[Values], ...],
    at_ports(as_values, VALUES, "a bias, or ports with biases", NUMBERS.known),
]
NoiseField = Annotated[tuple[AtPort[Formula], ...], at_ports(as_formula, FORMULA, "a noise, or ports with noises")]


class ParameterModel(Model):
    """A named constant: its value, and the bounds within which it may be set."""

    PLACE: ClassVar[str] = "a parameter"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {
        **dict.fromkeys(("default", "val"), "value"),
        **dict.fromkeys(("minimum", "low", "lower"), "min"),
        **dict.fromkeys(("maximum", "high", "upper"), "max"),
    }

    value: FormulaField = Field(description="The value.")
    minimum: FormulaField | None = Field(None, alias="min", description="The least value that it may be given.")
    maximum: FormulaField | None = Field(None, alias="max", description="The greatest value that it may be given.")
    unit: TextField | None = Field(
        None, description="Its unit, which is shown; values may be written with another one of the kind: 0.02 s for ms."
    )
    description: TextField | None = Field(None, description="What it is.")

    @property
    def about(self) -> str:
        """What it is, as the author says."""
        return value_or(self.description, "")

    @property
    def measure(self) -> str:
        """Its unit, "" without one."""
        return value_or(self.unit, "")

    @classmethod
    def _keys(cls, keys: Keys, findings: Findings) -> dict[str, object]:
        """What is written with a unit is a number in that of the parameter."""
        result = super()._keys(keys, findings)
        put_in_unit(result, ("value", "min", "max"), findings)
        return result


def put_in_unit(written: dict[str, object], keys: Iterable[str], findings: Findings) -> None:
    """Of what has a ``unit``: put numbers with another one in this, where they are the values of these keys."""
    unit = written.get("unit")
    if isinstance(unit, Scalar) and isinstance(unit.value, str):
        for key in keys:
            node = written.get(key)
            if isinstance(node, Scalar) and isinstance(node.value, str) and measured(node.value) is not None:
                written[key] = in_unit(Located(node.value, node), unit.value, findings)


ParameterField = Annotated[ParameterModel, Short("value", "a number or an expression")]
ParametersField = Annotated[NamedParameters[ParameterField], declaring("parameter")]


_COMBINATIONS: Final = get_args(Combine)


class WrittenPort(NamedTuple):
    """A port that a model declares."""

    name: Located[str]
    combine: Combine = "sum"
    unit: str = ""


def as_ports(node: Node, info: ValidationInfo) -> tuple[WrittenPort, ...]:
    """Names, or a mapping from each to how what arrives is combined."""
    if not isinstance(node, Mapping):
        return tuple(map(WrittenPort, each(one_or_more(node), as_identifier, info)))
    return each(node.entries, _port, info)


def _port(entry: Entry, info: ValidationInfo) -> WrittenPort:
    name, node = as_identifier(entry.key, info), entry.value
    if not isinstance(node, Mapping):
        return WrittenPort(name, _combine(node, info))
    keys = read_keys(node, _PORT.known, findings_of(info)).mapping
    combine, unit = keys.get("combine"), keys.get("unit")
    return WrittenPort(
        name,
        "sum" if combine is None else _combine(combine, info),
        "" if unit is None else as_text(unit, info).value,
    )


def _combine(node: Node, info: ValidationInfo) -> Combine:
    return cast(Combine, one_of(*_COMBINATIONS)(node, info).value)


_COMBINE: Final = words(*_COMBINATIONS)
_PORT: Final = Map(
    {
        "combine": Key(_COMBINE, "What arrives is combined by sum or product of w·a, or by distance (default sum)."),
        "unit": Key(UNNAMED, "Its unit, which is shown."),
    }
)
PortsField = Annotated[
    tuple[WrittenPort, ...], Leaf(as_ports, Either((NAME, ListOf(NAME), Map({}, Either((_COMBINE, _PORT)), LOCAL))))
]


class Reference(NamedTuple):
    """One or several references to neurons, as written, each with its place."""

    parts: tuple[Located[str], ...]
    span: Span


def as_reference(node: Node, info: ValidationInfo) -> Reference:
    """A reference, or a list of some."""
    if isinstance(node, Sequence) and not node.items:
        findings_of(info).error(
            "empty-reference", node.span, "this list names nothing", "leave it out, or name neurons"
        )
    parts = as_parts(node, info)
    return Reference(parts, node.span) if parts else give_up()


#: A reference, or a list of them.
SEVERAL: Final = Either((REFERENCE, ListOf(REFERENCE, least=1)))

ReferenceField = Annotated[Reference, Leaf(as_reference, SEVERAL), REFERENCES]


class Pair(NamedTuple):
    """Two numbers or expressions: a place, a size, bounds."""

    first: Formula
    second: Formula
    span: Span


#: What to do with a pin of three numbers.
FLAT: Final = "leave the third number out: a layout is in a plane; a neuron's 'position' may have three"


def pair(wanted: str, of_three: str | None = None) -> Leaf[Node]:
    """The annotation of a field that takes two numbers or expressions; ``wanted`` is what they are, for a finding, and
    ``of_three`` what to do where there are three."""

    def check(node: Node, info: ValidationInfo) -> Pair:
        if not isinstance(node, Sequence) or len(node.items) != 2:
            refuse(info, node, wanted, of_three if isinstance(node, Sequence) and len(node.items) == 3 else None)
        first, second = each(node.items, as_formula, info)
        return Pair(first, second, node.span)

    return Leaf(check, TWO)


PointField = Annotated[Pair, pair("a position [x, y]", FLAT)]


def as_view(node: Node, info: ValidationInfo) -> Pair | Located[str]:
    """From where a network in space is seen: one of the words, or two angles."""
    if not isinstance(node, Sequence):
        return one_of(*VIEWPOINTS)(node, info)
    if len(node.items) != 2:
        refuse(info, node, "a view [azimuth, elevation]")
    first, second = each(node.items, as_formula, info)
    return Pair(first, second, node.span)


ViewField = Annotated[Pair | Located[str], Leaf(as_view, Either((words(*VIEWPOINTS), TWO)), True)]


def as_title(node: Node, info: ValidationInfo) -> Located[bool] | Located[str]:
    """true, false or a text."""
    if isinstance(node, Scalar) and isinstance(node.value, str):
        return as_text(node, info)
    return as_bool(node, info)


TitleField = Annotated[Located[bool] | Located[str], Leaf(as_title, Either((BOOL, TEXT)))]
