"""The sections of a network: clock, inputs, neurons, connections, events; the shape as written.

In: nodes. Out: frozen models whose leaves know their places. A spec has these sections, and a module has most of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from collections.abc import Mapping as AnyMapping
from contextlib import suppress
from typing import Annotated, ClassVar, Final

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import PydanticCustomError, core_schema

from neurovis_spec.diagnostics import listed, shorten
from neurovis_spec.language.grammar import (
    ENDS,
    FORMULA,
    FORMULAS,
    GROUP_DRAWN,
    LABEL,
    NOISE,
    PAIR,
    REFERENCES,
    RUN_EACH,
    SENT,
    SETTABLE,
    TEXT,
    TEXTS,
    WHICH,
    AsTable,
    Either,
    ListOf,
    Needs,
    NotWith,
    OneOf,
    declaring,
    naming,
)
from neurovis_spec.language.keys import apart, mend_torn
from neurovis_spec.language.located import (
    IDENTIFIER,
    NAME,
    BoolField,
    FormulaField,
    Leaf,
    Located,
    PartsField,
    TextField,
    TimeField,
    as_text,
    as_texts,
    findings_of,
    items_of,
    refuse,
    valid,
    words,
)
from neurovis_spec.language.model import Filled, Keyed, Model, Named, Short, entry_hint
from neurovis_spec.language.patterns import PATTERNS, PatternField
from neurovis_spec.language.tables import (
    DATA_FILES,
    FILE,
    NAMES,
    PLACES,
    TEXTS_OF_EDGES,
    WORDS,
    EdgesField,
    EdgeTexts,
    FileReference,
    TableColumn,
    as_edge_texts,
    as_file,
    as_names_column,
    as_places_column,
    as_words_column,
    is_from_table,
)
from neurovis_spec.language.units import TIME_ABOUTS, TIMES
from neurovis_spec.language.values import (
    ActivationField,
    AtPort,
    BiasField,
    CentreField,
    DelayField,
    DestinationsField,
    FeedField,
    InitialField,
    MatrixField,
    ModelField,
    NoiseField,
    Pair,
    RulesField,
    SetField,
    SynapseField,
    WeightField,
    at_ports,
    pair,
)
from neurovis_spec.language.words import METHODS, Combine, Method, NeuronRole
from neurovis_spec.language.yaml.source import AnyList, Entry, Mapping, Node, Scalar, one_or_more


class IntegrateModel(Model):
    """How states with a derivative are integrated over a step; a bare word is read as ``{method: …}``."""

    PLACE: ClassVar[str] = "'integrate'"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {
        **dict.fromkeys(("solver", "integrator", "scheme"), "method"),
        **dict.fromkeys(("steps", "sub_steps", "unfolds"), "substeps"),
    }

    method: Annotated[Located[Method], words(Method, abouts=METHODS)] | None = Field(
        None, description="The method (default rk4)."
    )
    substeps: FormulaField | None = Field(
        None, description="In how many parts of equal length a step is integrated (default 1)."
    )


class Time(Model):
    """The clock of a run."""

    PLACE: ClassVar[str] = "'time'"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = dict.fromkeys(("timestep", "time_step", "h"), "dt")

    dt: TimeField | None = Field(None, description="Seconds a step, or a time such as 0.1 ms (default 1).")
    steps: FormulaField | None = Field(None, description="Default run length in steps (default 1000).")
    episode: FormulaField | None = Field(None, description="Steps of an episode; it ends after every m steps.")
    integrate: Annotated[IntegrateModel, Short("method", "a method, or {method: …, substeps: …}")] | None = Field(
        None, description="How derivatives are integrated: a method, or {method: …, substeps: …} (default rk4)."
    )

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        if name not in ("duration", "length", "seconds", "t_end", "tmax", "T"):
            return None
        return f"unknown key '{name}'", "how long a run is, is counted in steps: steps: SECONDS/dt"

    @classmethod
    def _instead(cls, node: Node) -> str | None:
        value = node.value if isinstance(node, Scalar) and not isinstance(node.value, bool) else None
        return f"write {{steps: {value}}}" if isinstance(value, int) else None


def _table(node: Node, info: ValidationInfo) -> FileReference | AnyList:
    return node if isinstance(node, AnyList) else refuse(info, node, "a list of rows, one a step")


def _one_source(*others: str) -> NotWith:
    return NotWith(others, "'{own}' beside '{other}': an input has one source", "keep '{other}' or '{own}'")


def _sized(*others: str) -> NotWith:
    return NotWith(others, "'{own}' beside '{other}', which has a size of its own", "remove '{own}'")


class SpikeColumnsModel(Model):
    """Which columns of a file have the times of spikes, and the numbers of whom they are of."""

    PLACE: ClassVar[str] = "'columns'"

    time: TextField | None = Field(None, description="The column of the times (default time).")
    index: TextField | None = Field(
        None, description="The column that says of which number of the input, from 0, each spike is (default index)."
    )


def _times(node: Node, info: ValidationInfo) -> AnyList:
    return node if isinstance(node, AnyList) else refuse(info, node, "a list of times for each number of the input")


class SpikesModel(Model):
    """Spikes at given times."""

    PLACE: ClassVar[str] = "'spikes'"
    BARE: ClassVar[str] = "file"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {"unit": "time", "values": "times"}

    file: TextField | None = Field(
        None, description="A table with a row for each spike: .csv, .tsv, .txt, .dat, .npz or .parquet."
    )
    csv: Annotated[TextField | None, NotWith(("file",))] = Field(
        None, description="The table itself, as a text, in place of a file."
    )
    times: Annotated[AnyList | None, Leaf(_times, ListOf(ListOf(FORMULA))), NotWith(("file", "csv"))] = Field(
        None, description="The times inline: a list for each number of the input."
    )
    columns: Annotated[
        SpikeColumnsModel | None,
        Needs(("file", "csv"), "'columns' are those of a 'file'", "remove 'columns'"),
    ] = Field(None, description="What the columns of the file are called: {time: t_ms, index: id}.")
    time: Annotated[Located[str], words(*TIMES, abouts=TIME_ABOUTS)] | None = Field(
        None, description="The unit of the times (default s)."
    )

    @property
    def table(self) -> FileReference | None:
        """The table of the spikes."""
        text = self.file or self.csv
        return None if text is None else FileReference(text, None, text.span, inline=self.file is None)


class InputModel(Model):
    """A signal that comes from outside the network."""

    PLACE: ClassVar[str] = "an input"
    BARE: ClassVar[str] = "expression"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {"value": "expression", "formula": "expression", "data": "values"}

    expression: Annotated[FormulaField, RUN_EACH] | None = Field(
        None, description="A formula of k (the step), t (seconds) and parameters."
    )
    file: Annotated[TextField | None, _one_source("expression")] = Field(
        None, description="A .csv, .npy or .npz file, one row a step; the last row stays."
    )
    values: Annotated[AnyList | None, Leaf(_table, ListOf(FORMULAS)), _one_source("expression", "file")] = Field(
        None, description="The same, inline: one row a step."
    )
    spikes: Annotated[
        SpikesModel | None, Short("file", "{file: …} or {times: …}"), _one_source("expression", "file", "values")
    ] = Field(
        None, description="Spikes at given times, which are counted: {file: …, time: ms} or {times: [[0.1], []]}."
    )
    poisson: Annotated[FormulaField | None, RUN_EACH, _one_source("expression", "file", "values", "spikes")] = Field(
        None,
        description="Events at random, so many a second, which are counted: a formula of k, t, i, n and parameters.",
    )
    size: Annotated[FormulaField | None, _sized("file", "values")] = Field(
        None, description="How many numbers a step; an expression is then one of i (from 0) and n, too (default 1)."
    )
    hold: Annotated[
        BoolField | None,
        Needs(("expression",), "'hold' is of an 'expression'; others are the same over a step", "remove 'hold'"),
    ] = Field(None, description="Whether derivatives see it once a step, not as it is at each stage (default false).")
    description: TextField | None = Field(None, description="Shown as tooltip and on hover.")

    @classmethod
    def _instead(cls, node: Node) -> str | None:
        return "write {values: …}, one row a step" if isinstance(node, AnyList) else super()._instead(node)


#: Where a neuron is.
POSITION: Final = ListOf(FORMULA, least=2, most=3)
InputsField = Annotated[Named[InputModel], declaring("input")]


def _position(node: Node, info: ValidationInfo) -> FileReference | TableColumn | AnyList:
    if isinstance(node, Mapping) and any(node.entry(key) is not None for key in ("columns", "by", "where")):
        return as_places_column(node, info)
    if isinstance(node, Mapping):
        return as_file(node, info)
    wanted = "a position [x, y] or [x, y, z], a list of them, or {file: …}"
    return node if isinstance(node, AnyList) else refuse(info, node, wanted)


def _listed_names(node: Node, info: ValidationInfo) -> tuple[Located[str], ...] | TableColumn:
    return as_names_column(node, info) if is_from_table(node) else as_texts(node, info)


def _labels(node: Node, info: ValidationInfo) -> tuple[Located[str], ...] | TableColumn:
    return as_words_column(node, info) if is_from_table(node) else as_texts(node, info)


def _box(node: Node, info: ValidationInfo) -> Located[str] | TableColumn:
    return as_words_column(node, info) if is_from_table(node) else as_text(node, info)


ListedNamesField = Annotated[
    tuple[Located[str], ...] | TableColumn, Leaf(_listed_names, Either((NAME, ListOf(NAME), NAMES)))
]
LabelsField = Annotated[tuple[Located[str], ...] | TableColumn, Leaf(_labels, Either((TEXTS, WORDS)))]


def _as_input(node: Node, info: ValidationInfo) -> Located[str]:
    """The name of an input."""
    if isinstance(node, Scalar) and isinstance(node.value, str):
        return Located(node.value, node)
    hint = "declare it under 'inputs', and name it here"
    if isinstance(node, Scalar) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
        hint = f"what is added at every step is a bias: write bias: {node.value}"
    refuse(info, node, "the name of an input", hint)


#: An input to drive, or inputs to ports. Who writes one out here means no ports.
_INPUT = at_ports(_as_input, TEXT, "the name of an input, or ports with inputs", InputModel.model_fields)


class GroupModel(Model):
    """A group of neurons, or a single one."""

    PLACE: ClassVar[str] = "a group of neurons"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {
        **dict.fromkeys(("n", "number", "num"), "count"),
        **dict.fromkeys(("function", "transfer", "nonlinearity"), "activation"),
        **dict.fromkeys(("init", "start"), "initial"),
    }

    count: FormulaField | None = Field(None, description="How many neurons; K with count 3 makes K1, K2, K3.")
    first: Annotated[
        FormulaField | None, Needs(("count", "names"), "'first' needs 'count'", code="first-without-count")
    ] = Field(None, description="The number of the first neuron (default 1).")
    names: Annotated[ListedNamesField, declaring("neuron")] | None = Field(
        None, description="The names of the neurons, one by one, or {file: …, column: …}."
    )
    activation: ActivationField | None = Field(
        None, description="Activation function, name or {name: {parameter: value}} (default identity)."
    )
    model: ModelField | None = Field(
        None,
        description="How the activity follows from the input, name or {name: {…}}; static is Eq. 1 (default static).",
    )
    combine: Annotated[Located[Combine], words(Combine)] | None = Field(
        None,
        description="What arrives is combined by sum, product or max of w·a or by distance √Σ(w·a − c)² (default sum).",
    )
    bias: Annotated[BiasField, GROUP_DRAWN] | None = Field(
        None, description="Added to the combined input (default 0); or to several ports: {drive: 1, inhibitory: 2}."
    )
    initial: Annotated[InitialField, GROUP_DRAWN] | None = Field(
        None,
        description="The activity at step 0, else computed; or states of the model, too: {v: -65, activity: 0.5}.",
    )
    input: Annotated[tuple[AtPort[Located[str]], ...], _INPUT, naming("input")] | None = Field(
        None, description="An entry of inputs, added to the combined input; or to ports: {excitatory: rain}."
    )
    noise: Annotated[NoiseField, NOISE] | None = Field(
        None,
        description="A formula with normal, uniform or poisson, drawn anew and added each step; or by ports.",
    )
    position: Annotated[
        FileReference | TableColumn | AnyList | None,
        Leaf(_position, Either((POSITION, ListOf(POSITION), FILE, PLACES))),
        GROUP_DRAWN,
    ] = Field(
        None, description="Where the neuron is, as data: [x, y] or [x, y, z], a list of them, a file. It is no pin."
    )
    ids: LabelsField | None = Field(
        None,
        description="What tables call the neurons, whatever characters that has: in edge files and by 'by'; a list, or "
        "{file: …, column: …}.",
    )
    label: Annotated[LabelsField, LABEL] | None = Field(
        None,
        description="Display text; a counted group may give a list, or {file: …, column: …}. May hold expressions: "
        "'d{number}'.",
    )
    box: Annotated[Located[str] | TableColumn, Leaf(_box, Either((TEXT, WORDS)))] | None = Field(
        None, description="The named box of the picture that holds the group; or {file: …, column: …}, one each."
    )
    role: Annotated[Located[NeuronRole], words(NeuronRole)] | None = Field(
        None, description="What the picture and the layout take it for: input, hidden or output."
    )
    description: TextField | None = Field(None, description="Shown as tooltip and on hover.")

    @classmethod
    def _instead(cls, node: Node) -> str | None:
        value = node.value if isinstance(node, Scalar) else None
        if isinstance(value, int) and not isinstance(value, bool):
            return f"write {{count: {value}}} for so many neurons, {{bias: {value}}} for a bias"
        return f"write {{activation: {value}}}" if isinstance(value, str) and IDENTIFIER.fullmatch(value) else None


GroupsField = Annotated[Named[GroupModel], declaring("neuron")]


def _one_scale(*others: str) -> NotWith:
    return NotWith(
        others, "'{own}' beside '{other}': an entry is scaled in one way", "keep '{other}' or '{own}'", "one-key"
    )


class ScaleModel(Model):
    """How the weights of an entry are scaled together; one of the three."""

    PLACE: ClassVar[str] = "a 'scale'"
    ONE_OF: ClassVar[OneOf | None] = OneOf(
        ("spectral_radius", "norm", "indegree"),
        "expected one kind of scale here, found 0",
        "give it one of spectral_radius, norm and indegree",
        "one-key",
    )

    spectral_radius: FormulaField | None = Field(
        None, description="The largest magnitude of an eigenvalue of the entry's matrix; both ends the same neurons."
    )
    norm: Annotated[FormulaField | None, _one_scale("spectral_radius")] = Field(
        None, description="The Frobenius norm of the entry's matrix."
    )
    indegree: Annotated[BoolField | None, _one_scale("spectral_radius", "norm")] = Field(
        None, description="Whether each weight is divided by the connections of this entry into its target."
    )


#: Rows of centres say which neurons are connected, as a matrix does; those of delays have a cell for each pair.
_CENTRE, _DELAY = AsTable("centre"), AsTable("delay")
_WHICH: Final = (
    "'{own}' beside '{other}': '{other}' says which neurons are connected, so that '{own}' has nothing to say"
)


#: Of an entry whose weights are those of another one.
_TIED: Final = NotWith(
    (AsTable("weight"),), "'{own}' beside weights that are those of another entry, which says what '{own}' would say"
)


def _line_label(node: Node, info: ValidationInfo) -> Located[str] | EdgeTexts:
    return as_edge_texts(node, info) if isinstance(node, Mapping) else as_text(node, info)


LineLabelField = Annotated[Located[str] | EdgeTexts, Leaf(_line_label, Either((TEXT, TEXTS_OF_EDGES)))]


class ConnectionModel(Model):
    """The body of a connection; a bare weight is read as ``{weight: …}``."""

    PLACE: ClassVar[str] = "a connection"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {
        **dict.fromkeys(("w", "strength"), "weight"),
        **dict.fromkeys(("rule", "learning"), "plasticity"),
        "latency": "delay",
        "topology": "pattern",
    }

    weight: Annotated[
        WeightField | None,
        PAIR,
        NotWith(
            ("matrix", "edges"),
            "'{own}' beside '{other}', in which each connection has a weight of its own",
            "write the weights into '{other}'; an edge is [FROM, TO, WEIGHT, DELAY]",
        ),
    ] = Field(
        None, description="One number, or an expression of i, j, n_from, n_to (default 1); or {transpose: A -> B}."
    )
    centre: Annotated[CentreField, PAIR] | None = Field(
        None, description="For combine: distance; like weight or matrix (default 0)."
    )
    scale: Annotated[ScaleModel | None, _TIED] = Field(
        None, description="Scales the weights of this entry together when they are made."
    )
    matrix: MatrixField | None = Field(None, description="Dense rows, rows are sources; null means no connection.")
    edges: Annotated[EdgesField | None, NotWith(("matrix", _CENTRE), _WHICH)] = Field(
        None, description="[[from, to, weight, delay], …], the last two optional."
    )
    pattern: Annotated[PatternField | None, NotWith(("matrix", "edges", _CENTRE), _WHICH), _TIED] = Field(
        None,
        description="Which pairs are connected: all_to_all, one_to_one, chain, ring, {random: {probability: p}}, ….",
    )
    where: Annotated[FormulaField | None, WHICH, NotWith(("matrix", "edges", _CENTRE), _WHICH), _TIED] = Field(
        None,
        description="Which pairs, of a pattern or of all, there are: an expression of i, j, distance, …, true or not.",
    )
    self: Annotated[
        BoolField | None,
        NotWith(
            ("matrix", "edges", _CENTRE),
            "'self' says what a pattern may do; here every connection is written",
            code="useless-key",
        ),
        _TIED,
    ] = Field(None, description="Whether a neuron may connect to itself in a pattern (default false).")
    rows: Annotated[
        Annotated[Located[str], words("from", "to")] | None,
        Needs(("matrix", _CENTRE, _DELAY), "'rows' says how a matrix is read; there is no matrix"),
    ] = Field(None, description="Whether the rows of a matrix are sources (from) or targets (to) (default from).")
    delay: Annotated[DelayField, PAIR] | None = Field(
        None,
        description="Steps the signal travels, or a time: 1.5 ms, {seconds: distance/3}, {matrix: …}; 0 is within the "
        "same step (default 1).",
    )
    port: DestinationsField | None = Field(
        None, description="The port of the target, or several with factors: {ampa: 1, nmda: 0.3} (default drive)."
    )
    send: Annotated[TextField, SENT] | None = Field(
        None, description="What is sent: a state or an output of the source's model, or its activity."
    )
    synapse: SynapseField | None = Field(
        None, description="What it brings to its port, in place of weight times what is sent: name, or {name: {…}}."
    )
    symmetric: Annotated[BoolField | None, _TIED] = Field(
        None,
        description="Whether each connection is followed by one back with the same numbers, drawn as one line with it "
        "(default false).",
    )
    plasticity: Annotated[
        RulesField,
        NotWith(
            (AsTable("weight"),),
            "'plasticity' beside weights that are those of another entry, whose rule changes them",
            "let the entry that is named learn",
        ),
    ] = Field(
        default=(), description="A rule: name, or {name: {parameter: value, signal: …}}; or several, in their order."
    )
    bounds: Annotated[
        Annotated[Pair, pair("bounds [low, high]")] | None,
        Needs(("plasticity",), "'bounds' hold plastic weights; there is no 'plasticity'"),
    ] = Field(None, description="[low, high] for plastic weights.")
    label: LineLabelField | None = Field(
        None, description="What it is called in pictures and tooltips, or {column: NAME} of the file of its edges."
    )
    description: TextField | None = Field(None, description="Shown as tooltip and on hover.")

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        taken_by = [one.name for one in PATTERNS.values() if name in one.settings]
        if name in ("rate", "target", "learning_rate", "eta"):
            return f"'{name}' belongs to a rule, and stands with it", f"write plasticity: {{RULE: {{{name}: …}}}}"
        if name in ("lag", "E"):
            time = ", or delay: … for a time" if name == "lag" else ""
            hint = f"write synapse: {{SYNAPSE: {{{name}: …}}}}{time}"
            return f"'{name}' belongs to a synapse, and stands with it", hint
        if not taken_by:
            return None
        hint = f"write pattern: {{{taken_by[0]}: {{{name}: …}}}}"
        return f"'{name}' is a setting of {listed(taken_by)}, and stands in the pattern", hint


_AT = Needs(("at", "from"), "at which step? 'at' is missing", "write at: STEP", "bad-event")


class EventModel(Model):
    """Something that changes during a run."""

    PLACE: ClassVar[str] = "an event"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {
        **dict.fromkeys(("step", "time", "when", "t"), "at"),
        **dict.fromkeys(("kill", "remove", "cut", "delete"), "lesion"),
        **dict.fromkeys(("hold", "fix"), "clamp"),
        **dict.fromkeys(("restore", "heal", "repair"), "mend"),
        **dict.fromkeys(("until", "end"), "to"),
        **dict.fromkeys(("input", "inputs", "drive"), "feed"),
        **dict.fromkeys(("restart", "clear"), "reset"),
    }
    ONE_OF: ClassVar[OneOf | None] = OneOf(
        ("set", "feed", "clamp", "reset", "lesion", "mend", "learning"),
        "this event does nothing",
        "give it set, feed, clamp, reset, lesion, mend or learning",
        "bad-event",
    )

    at: Annotated[
        TimeField | None,
        NotWith(
            ("clamp",),
            "a clamp lasts: it has 'from', and perhaps 'to'",
            "write from: instead of at:",
            "bad-event",
        ),
    ] = Field(None, description="The step, or the time, from which on it applies (all but a clamp).")
    from_: Annotated[
        TimeField | None,
        Needs(("clamp",), "'from' is of a clamp, all else takes 'at' alone", "write at: STEP", "bad-event"),
    ] = Field(None, alias="from", description="The first step of a clamp, or the time.")
    to: Annotated[
        TimeField | None,
        Needs(("from", "clamp"), "'to' is the end of a clamp, all else takes 'at' alone", "remove 'to'", "bad-event"),
    ] = Field(None, description="The step, or the time, before which a clamp ends; without it, it lasts.")
    set: Annotated[Keyed[SetField], Filled("{parameter: value}"), SETTABLE, _AT] = Field(
        default_factory=dict,
        description="{parameter: value} from this step on; {FROM -> TO: weight} of connections, or a list of weights.",
    )
    feed: Annotated[Keyed[FeedField], Filled("{input: value}"), naming("input"), _AT] = Field(
        default_factory=dict, description="{input: value} in place of its source, until it is fed anew; null ends it."
    )
    clamp: Annotated[
        Keyed[FormulaField],
        Filled("{neurons: activity}"),
        REFERENCES,
        NotWith(
            ("set", "feed", "reset", "lesion", "mend", "learning"),
            "a clamp is an event of its own",
            "make it an entry of its own",
            "bad-event",
        ),
        Needs(("from", "at"), "a clamp needs 'from'", "write from: STEP", "bad-event"),
    ] = Field(
        default_factory=dict,
        description="{neurons: activity}, or {K.v: value of the state v}, {(K -> O).g: of a synapse's or rule's}.",
    )
    reset: Annotated[PartsField, Filled("a neuron"), REFERENCES, _AT] = Field(
        default=(), description="Neurons that go back to their beginning; weights stay."
    )
    lesion: Annotated[PartsField, Filled("a neuron or a connection"), ENDS, _AT] = Field(
        default=(), description="Neurons and connections (FROM -> TO) that are removed."
    )
    mend: Annotated[PartsField, Filled("a neuron or a connection"), ENDS, _AT] = Field(
        default=(), description="Neurons and connections (FROM -> TO) whose lesion is undone."
    )
    learning: Annotated[Keyed[BoolField], Filled("{connections: true or false}"), ENDS, _AT] = Field(
        default_factory=dict, description="{FROM -> TO: whether its rule is carried out} from this step on."
    )


def _mappings(items: Iterable[Node], info: ValidationInfo, wanted: str) -> tuple[Mapping, ...]:
    """Those of some items that are mappings; the others are reported."""

    def read(node: Node, info: ValidationInfo) -> Mapping:
        return node if isinstance(node, Mapping) else refuse(info, node, wanted, entry_hint(node) or _as_entry(node))

    return tuple(valid(items, read, info))


def _as_entry(node: Node) -> str | None:
    """What to write for a connection without a weight, or for an edge, in a list of connections."""
    if isinstance(node, Scalar) and isinstance(node.value, str) and _ARROW.fullmatch(node.value):
        return f"write {shorten(node.value)}: WEIGHT"
    cells = [str(item.value) for item in node.items if isinstance(item, Scalar)] if isinstance(node, AnyList) else []
    if not 2 <= len(cells) <= 3 or not all(map(IDENTIFIER.fullmatch, cells[:2])):
        return None
    return f"write {cells[0]} -> {cells[1]}: {cells[2] if len(cells) > 2 else 'WEIGHT'}"


_ARROW = re.compile(r"[\w.+ ]+->[\w.+ ]*[\w.]")


def _events(node: Node, info: ValidationInfo) -> tuple[Mapping, ...]:
    items = items_of(node, info, "a list of events", "write each event behind a dash")
    return _mappings(items, info, "an event, that is a mapping")


def _as_it_is(value: Located[str], info: ValidationInfo) -> Located[str]:
    return value


def _connections(node: Node, info: ValidationInfo) -> list[tuple[Located[str], object]]:
    """One mapping, or a list of mappings: in both cases the entries in the order written. What is invalid is reported
    and left out."""
    result: list[tuple[Located[str], object]] = []
    for mapping in _mappings(one_or_more(node), info, "a mapping FROM -> TO: weight, or a list of such"):
        if _in_parts(mapping, info):
            continue
        first: dict[str, Entry] = {}
        for entry in mend_torn(mapping, "bad-connection", findings_of(info)).entries:
            if (target := _target(entry)) is not None:
                message = f"'{shorten(entry.name)}' is no connection"
                hint = f"write {shorten(entry.name)} -> {shorten(target)}: WEIGHT"
                findings_of(info).error("bad-connection", entry.key.span, message, hint)
                continue
            same = first.setdefault("".join(entry.name.split()), entry)
            if same is not entry:  # two spellings of one key
                place = f"{same.key.span.line}:{same.key.span.column}"
                message = f"'{shorten(entry.name)}' is there twice: first at {place} as '{shorten(same.name)}'"
                hint = "connections that share both ends are written as a list of mappings"
                findings_of(info).error("duplicate-key", entry.key.span, message, hint)
            with suppress(PydanticCustomError):
                result.append((Located(entry.name, entry.key), _body(entry, info)))
    return result


def _target(entry: Entry) -> str | None:
    """The target of a connection that stands as the value of its source: ``A: B``."""
    value = entry.value.value if isinstance(entry.value, Scalar) else None
    return value if isinstance(value, str) and all(map(IDENTIFIER.fullmatch, (entry.name, value))) else None


def _in_parts(mapping: Mapping, info: ValidationInfo) -> bool:
    """Whether a mapping says ``from`` and ``to`` with keys of their own, as other languages do, which is reported."""
    ends = [entry for entry in mapping.entries if entry.name in _ENDS]
    if len(ends) != 2 or any("->" in entry.name for entry in mapping.entries):
        return False
    source, target = (shorten(str(entry.value.value)) if isinstance(entry.value, Scalar) else "…" for entry in ends)
    message = f"'{ends[0].name}' is no connection"
    findings_of(info).error("bad-connection", ends[0].key.span, message, f"write {source} -> {target}: {{weight: …}}")
    return True


#: How other languages call the ends of a connection.
_ENDS = ("from", "to", "source", "target", "pre", "post")


def written(section: Mapping) -> int:
    """How many entries the connections of a spec or a module have as they are written; what is none counts as one."""
    parts = one_or_more(section.get("connections"))
    return sum(len(part.entries) + part.is_open if isinstance(part, Mapping) else 1 for part in parts)


def _body(entry: Entry, info: ValidationInfo) -> Mapping:
    """A body as it is; a bare weight is short for a body with a weight, and nothing for an empty one."""
    node = entry.value
    if isinstance(node, Mapping):
        return node
    if not isinstance(node, Scalar):
        hint = "write {matrix: …}" if isinstance(node, AnyList) else None
        refuse(info, node, "a weight or a mapping", hint)
    if node.value is None:
        return Mapping((), entry.key.span)
    if isinstance(node.value, str) and node.value.strip().endswith(DATA_FILES):
        refuse(info, node, "a weight or a mapping", f"write {{matrix: {{file: {shorten(node.value.strip())}}}}}")
    parts = apart(node.value) if isinstance(node.value, str) else None
    if parts is not None and parts.key in ConnectionModel.model_fields:
        refuse(info, node, "a weight or a mapping", parts.told)
    return Mapping((Entry(Scalar("weight", node.span, None), node),), node.span)


class _FromTo:
    """Says in the schema that connections are a mapping from FROM -> TO to bodies, or a list of such."""

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        body = handler(schema)["items"]["prefixItems"][1]
        entries = {
            "type": "object",
            "propertyNames": {"pattern": "^[^>]*->[^>]*$"},
            "additionalProperties": {"anyOf": [*body["anyOf"], {"type": "null"}]},
        }
        return {"anyOf": [entries, {"type": "array", "items": entries}]}


ConnectionsField = Annotated[
    tuple[tuple[Annotated[Located[str], Leaf(_as_it_is, TEXT)], Annotated[ConnectionModel, Short("weight")]], ...],
    ENDS,
    BeforeValidator(_connections),
    _FromTo(),
]
EventsField = Annotated[tuple[EventModel, ...], BeforeValidator(_events)]
