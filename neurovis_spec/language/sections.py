"""The sections of a network: clock, inputs, neurons, connections, events; the shape as written.

In: nodes. Out: frozen models whose leaves know their places. A spec has these sections, and a module has most of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Annotated, ClassVar

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema
from pydantic_core import PydanticCustomError

from neurovis_spec.diagnostics import shorten
from neurovis_spec.language.exclusions import CONNECTION, EVENT, GROUP, INPUT, ONE_KEY
from neurovis_spec.language.located import (
    FORMULA,
    IDENTIFIER,
    BoolField,
    FormulaField,
    Leaf,
    Located,
    PartsField,
    TextField,
    TextsField,
    findings_of,
    refuse,
    words,
)
from neurovis_spec.language.model import Filled, Keyed, KeysAreNames, Model
from neurovis_spec.language.patterns import PatternField
from neurovis_spec.language.values import (
    FILE,
    FORMULAS,
    ONE_REFERENCE,
    CentreField,
    ChoiceField,
    EdgesField,
    FileReference,
    FormulasField,
    InitialField,
    MatrixField,
    as_file,
)
from neurovis_spec.language.yaml.source import Entry, Mapping, Node, Packed, Scalar, Sequence


class Time(Model):
    """The clock of a run."""

    PLACE: ClassVar[str] = "'time'"

    dt: FormulaField | None = Field(None, description="Seconds a step (default 1).")
    steps: FormulaField | None = Field(None, description="Default run length in steps (default 1000).")
    episode: FormulaField | None = Field(None, description="Steps of an episode; it ends after every m steps.")


def _table(node: Node, info: ValidationInfo) -> FileReference | Sequence | Packed:
    if isinstance(node, (Sequence, Packed)):
        return node
    refuse(info, node, "a list of rows, one a step")


class InputModel(Model):
    """A signal that comes from outside the network."""

    model_config = INPUT

    PLACE: ClassVar[str] = "an input"

    expression: FormulaField | None = Field(None, description="A formula of k (the step), t (seconds) and parameters.")
    file: TextField | None = Field(None, description="A .csv, .npy or .npz file, one row a step; the last row stays.")
    values: Annotated[
        Sequence | Packed | None,
        Leaf(_table, {"type": "array", "items": FORMULAS}),
    ] = Field(None, description="The same, inline: one row a step.")
    size: FormulaField | None = Field(None, description="How many numbers a step, for an input without a source.")
    description: TextField | None = Field(None, description="Shown as tooltip and on hover.")


_POINT = {"type": "array", "items": FORMULA, "minItems": 2, "maxItems": 2}


def _position(node: Node, info: ValidationInfo) -> FileReference | Sequence | Packed:
    if isinstance(node, Mapping):
        return as_file(node, info)
    if isinstance(node, (Sequence, Packed)):
        return node
    refuse(info, node, "a position [x, y], a list of them, or {file: …}")


_NAME = {"type": "string", "pattern": f"^{IDENTIFIER.pattern}$"}
_NAMES = {"anyOf": [_NAME, {"type": "array", "items": _NAME}]}


class GroupModel(Model):
    """A group of neurons, or a single one."""

    model_config = GROUP

    PLACE: ClassVar[str] = "a group of neurons"

    count: FormulaField | None = Field(None, description="How many neurons; K with count 3 makes K1, K2, K3.")
    first: FormulaField | None = Field(None, description="The number of the first neuron (default 1).")
    names: Annotated[TextsField, WithJsonSchema(_NAMES)] | None = Field(
        None, description="The names of the neurons, one by one."
    )
    activation: ChoiceField | None = Field(
        None, description="Activation function, name or {name: {parameter: value}} (default identity)."
    )
    model: ChoiceField | None = Field(
        None,
        description="How the activity follows from the input, name or {name: {…}}; static is Eq. 1 (default static).",
    )
    combine: Annotated[Located[str], words("sum", "product", "distance")] | None = Field(
        None,
        description="What arrives is combined by sum or product of w·a, or by distance √Σ(w·a − c)² (default sum).",
    )
    bias: FormulasField | None = Field(None, description="Added to the combined input (default 0).")
    initial: InitialField | None = Field(
        None,
        description="The activity at step 0, else computed; or states of the model, too: {v: -65, activity: 0.5}.",
    )
    input: TextField | None = Field(None, description="An entry of inputs, added to the combined input.")
    noise: FormulaField | None = Field(
        None, description="An expression with normal(m, s) or uniform(a, b), drawn anew and added each step."
    )
    position: Annotated[
        FileReference | Sequence | Packed | None,
        Leaf(_position, {"anyOf": [_POINT, {"type": "array", "items": _POINT}, FILE]}),
    ] = Field(None, description="Where the neuron is, as data: [x, y], a list of them, a file. It is no pin.")
    label: TextsField | None = Field(
        None, description="Display text; a counted group may give a list. May hold expressions: 'd{number}'."
    )
    box: TextField | None = Field(None, description="The named box of the picture that holds the group.")
    role: Annotated[Located[str], words("input", "hidden", "output")] | None = Field(
        None, description="What the picture and the layout take it for: input, hidden or output."
    )
    description: TextField | None = Field(None, description="Shown as tooltip and on hover.")


class ScaleModel(Model):
    """How the weights of an entry are scaled together; one of the three."""

    model_config = ONE_KEY

    PLACE: ClassVar[str] = "a 'scale'"

    spectral_radius: FormulaField | None = Field(
        None, description="The largest magnitude of an eigenvalue of the entry's matrix; both ends the same neurons."
    )
    norm: FormulaField | None = Field(None, description="The Frobenius norm of the entry's matrix.")
    indegree: BoolField | None = Field(
        None, description="Whether each weight is divided by the connections of this entry into its target."
    )


class ConnectionModel(Model):
    """The body of a connection; a bare weight is read as ``{weight: …}``."""

    model_config = CONNECTION

    PLACE: ClassVar[str] = "a connection"

    weight: FormulaField | None = Field(
        None, description="One number, or an expression of i, j, n_from, n_to (default 1)."
    )
    centre: CentreField | None = Field(None, description="For combine: distance; like weight or matrix (default 0).")
    scale: ScaleModel | None = Field(None, description="Scales the weights of this entry together when they are made.")
    matrix: MatrixField | None = Field(None, description="Dense rows, rows are sources; null means no connection.")
    edges: EdgesField | None = Field(None, description="[[from, to, weight, delay], …], the last two optional.")
    pattern: PatternField | None = Field(
        None,
        description="Which pairs are connected: all_to_all, one_to_one, chain, ring, {random: {probability: p}}, ….",
    )
    self: BoolField | None = Field(
        None, description="Whether a neuron may connect to itself in a pattern (default false)."
    )
    rows: Annotated[Located[str], words("from", "to")] | None = Field(
        None, description="Whether the rows of a matrix are sources (from) or targets (to) (default from)."
    )
    delay: FormulaField | None = Field(
        None, description="Steps the signal travels; 0 is within the same step (default 1)."
    )
    plasticity: ChoiceField | None = Field(None, description="A rule: name, or {name: {parameter: value, signal: …}}.")
    bounds: Annotated[
        tuple[FormulaField, FormulaField] | None,
        BeforeValidator(lambda node, info: _pair(node, info)),
        WithJsonSchema({"type": "array", "items": FORMULA, "minItems": 2, "maxItems": 2}),
    ] = Field(None, description="[low, high] for plastic weights.")
    label: TextField | None = Field(None, description="What it is called in pictures and tooltips.")
    description: TextField | None = Field(None, description="Shown as tooltip and on hover.")


def _pair(node: Node, info: ValidationInfo) -> tuple[Node, Node]:
    if isinstance(node, Sequence) and len(node.items) == 2:
        return (node.items[0], node.items[1])
    refuse(info, node, "bounds [low, high]")


_LESION = {"anyOf": [ONE_REFERENCE, {"type": "array", "items": ONE_REFERENCE}]}


class EventModel(Model):
    """Something that changes during a run."""

    model_config = EVENT

    PLACE: ClassVar[str] = "an event"

    at: FormulaField | None = Field(None, description="The step from which on it applies (all but a clamp).")
    from_: FormulaField | None = Field(None, alias="from", description="The first step of a clamp.")
    to: FormulaField | None = Field(None, description="The step before which a clamp ends; without it, it lasts.")
    set: Annotated[Keyed[FormulaField], KeysAreNames(), Filled("{parameter: value}")] = Field(
        default_factory=dict, description="{parameter: value} from this step on."
    )
    clamp: Annotated[Keyed[FormulaField], Filled("{neurons: activity}")] = Field(
        default_factory=dict, description="{neurons: activity}."
    )
    lesion: Annotated[PartsField, WithJsonSchema(_LESION), Filled("a neuron or a connection")] = Field(
        default=(), description="Neurons and connections (FROM -> TO) that are removed."
    )
    mend: Annotated[PartsField, WithJsonSchema(_LESION), Filled("a neuron or a connection")] = Field(
        default=(), description="Neurons and connections (FROM -> TO) whose lesion is undone."
    )
    learning: Annotated[Keyed[BoolField], Filled("{connections: true or false}")] = Field(
        default_factory=dict, description="{FROM -> TO: whether its rule is carried out} from this step on."
    )


#: Findings of one list, after which the rest of it is not looked at.
_PATIENCE = 20


def _mappings(node: Node, info: ValidationInfo, wanted: str) -> Iterator[Mapping]:
    """The mappings of a list; what is none is reported."""
    findings = findings_of(info)
    before = findings.errors
    for item in node.items if isinstance(node, (Sequence, Packed)) else (node,):
        if isinstance(item, Mapping):
            yield item
        elif findings.errors - before < _PATIENCE:
            with suppress(PydanticCustomError):
                refuse(info, item, wanted)


def _events(node: Node, info: ValidationInfo) -> tuple[Mapping, ...]:
    if not isinstance(node, (Sequence, Packed)):
        refuse(info, node, "a list of events", "write each event behind a dash")
    return tuple(_mappings(node, info, "an event, that is a mapping"))


def _as_it_is(value: Located[str], info: ValidationInfo) -> Located[str]:
    return value


def _connections(node: Node, info: ValidationInfo) -> list[tuple[Located[str], object]]:
    """One mapping, or a list of mappings: in both cases the entries in the order written. What is invalid is reported
    and left out."""
    result: list[tuple[Located[str], object]] = []
    for mapping in _mappings(node, info, "a mapping FROM -> TO: weight, or a list of such"):
        if _in_parts(mapping, info):
            continue
        first: dict[str, Entry] = {}
        for entry in mapping.entries:
            same = first.setdefault("".join(entry.name.split()), entry)
            if same is not entry:  # two spellings of one key
                place = f"{same.key.span.line}:{same.key.span.column}"
                message = f"'{shorten(entry.name)}' is there twice: first at {place} as '{shorten(same.name)}'"
                hint = "connections that share both ends are written as a list of mappings"
                findings_of(info).error("duplicate-key", entry.key.span, message, hint)
            with suppress(PydanticCustomError):
                result.append((Located(entry.name, entry.key), _body(entry, info)))
    return result


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
    node = section.get("connections")
    if node is None:
        return 0
    parts = node.items if isinstance(node, (Sequence, Packed)) else (node,)
    return sum(len(part.entries) if isinstance(part, Mapping) else 1 for part in parts)


def _body(entry: Entry, info: ValidationInfo) -> Mapping:
    """A body as it is; a bare weight is short for a body with a weight, and nothing for an empty one."""
    node = entry.value
    if isinstance(node, Mapping):
        return node
    if not isinstance(node, Scalar):
        hint = "write {matrix: …}" if isinstance(node, (Sequence, Packed)) else None
        refuse(info, node, "a weight or a mapping", hint)
    if node.value is None:
        return Mapping((), entry.key.span)
    return Mapping((Entry(Scalar("weight", node.span, None), node),), node.span)


ConnectionsField = Annotated[
    tuple[tuple[Annotated[Located[str], Leaf(_as_it_is, {})], ConnectionModel], ...],
    BeforeValidator(_connections),
    WithJsonSchema({"title": "Connections"}),
]
EventsField = Annotated[tuple[EventModel, ...], BeforeValidator(_events)]
