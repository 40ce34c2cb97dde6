"""Groups: one group of neurons, from what is written of it to its values.

In: a Scope and the model of a group. Out: its neurons' names, what they are (NeuronType), and their values, one a
neuron.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray, frozen
from neurovis_spec.compiler.events.settable import BIAS, Part
from neurovis_spec.compiler.flows import ports_read_by
from neurovis_spec.compiler.limits import Limits, amount, plural
from neurovis_spec.compiler.names.listed import ListedNames, listed_names
from neurovis_spec.compiler.names.references import key_span, known_inputs
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.names.state_references import no_port, no_state
from neurovis_spec.compiler.network import Group, Input
from neurovis_spec.compiler.neurons.labels import check_length, labels_of
from neurovis_spec.compiler.neurons.positions import positions_of
from neurovis_spec.compiler.program import ACTIVATION, DRIVE, MODEL, SPIKE, Kind, is_activation, ports_of
from neurovis_spec.compiler.values.arguments import (
    Each,
    Settled,
    as_states,
    check_initials,
    neurons,
    settled_of,
    spread,
)
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.compiler.values.definitions import Definitions
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.compiler.values.table_values import TableReader
from neurovis_spec.diagnostics import shorten
from neurovis_spec.language.expressions.tree import Tree, draws, walk
from neurovis_spec.language.expressions.tree import names as names_in
from neurovis_spec.language.located import (
    IDENTIFIER,
    NAME_RULE,
    Formula,
    Located,
    too_long,
    value_or,
)
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.sections import GroupModel
from neurovis_spec.language.tables import TableColumn
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown, known
from neurovis_spec.language.values import AtPort, Choice, Initial, Values, all_in_unit
from neurovis_spec.language.yaml.source import AnyList, Scalar
from neurovis_spec.language.yaml.source import Mapping as SourceMapping
from neurovis_spec.likeness import meant, nearest

T = TypeVar("T")
_NOISE = formula_at(GroupModel, "noise")


class NeuronType(NamedTuple):
    """What the neurons of a group are: definitions with parameters, one value a neuron."""

    activation: Settled
    model: Settled

    @property
    def parts(self) -> tuple[Part, ...]:
        """Which of their parameters follow parameters of a run."""
        return *self.activation.parts, *self.model.parts


class WrittenNoise(NamedTuple):
    """Noise of a group: the port that it is added to, and how it is written and read."""

    port: str
    formula: Formula
    tree: Tree


class Built(NamedTuple):
    """One group, before its values are joined with those of the others."""

    #: its name in its scope
    name: str
    group: Group
    kind: NeuronType
    #: what is written of it
    model: GroupModel
    #: the names of its neurons in their scope, and what stands at them in pictures
    names: tuple[str, ...]
    labels: tuple[str, ...]
    #: what tables call its neurons, "" where they have no other name
    ids: tuple[str, ...] | Unknown
    #: the box of each, "" where it is in none, if a table says so
    boxes: tuple[str, ...]
    bias: FloatArray
    #: the activities at step 0, NaN where none is given
    initial: FloatArray
    #: the places of the neurons' inputs in the vector of all inputs, −1 without one
    input: IntArray
    #: x and y, NaN where none is given
    position: FloatArray | Unknown
    #: of a counted group the number of the first neuron
    first: int | None
    #: what its expressions may use
    constants: Constants
    #: what states of its model begin with
    starts: Mapping[str, FloatArray]
    noises: tuple[WrittenNoise, ...]
    #: which of its numbers follow parameters: of ``bias``, of ``position`` (x, then y), of those of its kind
    parts: tuple[Part, ...] = ()
    #: bias and input of ports other than ``drive``
    port_bias: Mapping[str, FloatArray] = MappingProxyType({})
    port_input: Mapping[str, IntArray] = MappingProxyType({})


def is_written(kind: NeuronType, model: GroupModel) -> bool:
    """Whether the model of a group is the one that is written: it is another one where that is invalid."""
    if not model.sound and "model" in model.unknown:
        return False
    return model.model is None or model.model.name.value == kind.model.definition.name


class _Defaults(NamedTuple):
    """The default values of n neurons, for keys that are not written."""

    bias: FloatArray
    initial: FloatArray
    input: IntArray
    position: FloatArray


@lru_cache(maxsize=64)
def _defaults(n: int) -> _Defaults:
    """The default arrays, read-only and shared by all groups of a size: instances make many of these."""
    nothing = np.full((n, 2), np.nan)
    return _Defaults(
        frozen(np.zeros(n)), frozen(np.full(n, np.nan)), frozen(np.full(n, -1, dtype=np.int64)), frozen(nothing)
    )


#: Types of neurons that are the same in all instances of a module, by the module, the group and its count.
Kinds: TypeAlias = dict[tuple[str | None, str, int], NeuronType]


@dataclass(frozen=True)
class Builder:
    """Makes the groups of one scope."""

    scope: Scope
    limits: Limits
    seed: int
    kinds: Kinds

    @property
    def constants(self) -> Constants:
        """What the scope's expressions may use."""
        return self.scope.constants

    @property
    def definitions(self) -> Definitions:
        """The definitions that the scope sees."""
        return self.scope.definitions

    def group(self, name: str, model: GroupModel, start: int) -> Built | Unknown:
        """One group; UNKNOWN where it is not known which neurons it has."""
        findings = self.constants.findings
        if name in self.scope.section.inputs and IDENTIFIER.fullmatch(name):
            first = key_span(self.scope.section, "inputs", name)
            message = f"'{name}' is an input already (line {first.line}); groups and inputs share their names"
            findings.error("duplicate-name", key_span(self.scope.section, "neurons", name), message)
        names, first_number = (UNKNOWN, None) if _may_lack_names(model) else self._names(name, model, start)
        n = UNKNOWN if names is UNKNOWN else len(names)
        table = TableReader(self.scope.files, names, self.scope.called(""))
        ids = self._ids(model, names, table)
        table = replace(table, ids=ids)
        kind = self._kind(name, model, n, table)
        self._check_combine(model, kind)
        self._check_softmax(model, kind)
        biases, bias_parts = self._bias(model, n, name, kind, table)
        given = as_states(model.initial or _NO_INITIAL, kind.model.definition, findings)
        initial = UNKNOWN if given.activity is None else self._drawn(given.activity, n, "initial", name, table)
        starts = self._starts(given, n, name, kind, model, table) if given.states else _NO_STARTS
        inputs = self._inputs(model, n, name, kind)
        position, position_parts = self._position(model, n, name, table)
        noises = self._noises(model, name, kind)
        if names is UNKNOWN or n is UNKNOWN:
            return UNKNOWN
        labels = self._labels(model, names, table)
        group = self._described(name, model, kind, start, n)
        return Built(
            name=name,
            group=group,
            kind=kind,
            model=model,
            names=names,
            labels=known(labels, names),
            ids=ids,
            boxes=self._boxes(model, table),
            bias=biases.pop(DRIVE, _defaults(n).bias),
            initial=_defaults(n).initial if initial is UNKNOWN else initial,
            input=inputs.pop(DRIVE, _defaults(n).input),
            position=position,
            first=first_number,
            constants=self.constants,
            starts=starts,
            noises=noises,
            parts=(*kind.parts, *bias_parts, *position_parts),
            port_bias=biases,
            port_input=inputs,
        )

    def _described(self, name: str, model: GroupModel, kind: NeuronType, start: int, n: int) -> Group:
        """What the network knows of a group as such."""
        return Group(
            name=self.scope.called(name),
            start=start,
            count=n,
            activation=kind.activation.definition.name,
            model=kind.model.definition.name,
            combine=value_or(model.combine, "sum"),
            activation_parameters=_numbers(kind.activation.parameters),
            model_parameters=_numbers(kind.model.parameters),
            input=self._input_name(model),
            box=self.scope.called(model.box.value) if isinstance(model.box, Located) else None,
            role=None if model.role is None else model.role.value,
            description=value_or(model.description, None),
            module=self.scope.module,
            spikes=_spikes(kind),
        )

    def _at_ports(
        self, written: tuple[AtPort[T], ...] | None, name: str, kind: NeuronType, model: GroupModel
    ) -> Iterator[tuple[str, T]]:
        """What is written of ports, by their names; those that the model has not are reported."""
        for value, port in written or ():
            if port is not None and is_written(kind, model):
                refusal = no_port(port.value, name, kind.model.definition)
                if refusal is not None:
                    refusal.report("unknown-port", port.span, self.constants.findings)
            yield DRIVE if port is None else port.value, value

    def _check_combine(self, model: GroupModel, kind: NeuronType) -> None:
        """Report a drive that is no sum, where a state jumps by it."""
        neuron, combine = kind.model.definition, model.combine
        if combine is None or combine.value == "sum" or not is_written(kind, model):
            return
        if DRIVE in ports_read_by(neuron).jump:
            message = f"a state of '{neuron.name}' jumps by '{DRIVE}', which combines by {combine.value} here"
            hint = "a port by which a state jumps is a sum: leave 'combine' out"
            self.constants.findings.error("jump-not-linear", combine.span, message, hint)

    def _check_softmax(self, model: GroupModel, kind: NeuronType) -> None:
        """Report a model whose activity is no activation of something, where a group shares 1 by its activities."""
        neuron = kind.model.definition
        if model.activation is None or not kind.activation.definition.softmax or not is_written(kind, model):
            return
        tree = neuron.given.each_step
        calls = sum(is_activation(node) for one in neuron.formulas for node in walk(one))
        once = not (neuron.flows or neuron.fires or neuron.given.each_episode)
        known = {*ports_of(neuron), *(one.name for one in neuron.state)}
        if once and calls == 1 and tree is not None and is_activation(tree) and not known.isdisjoint(names_in(tree)):
            return
        name = model.activation.name
        message = f"'{shorten(name.value)}' is worked out of the activities of the whole group, and "
        message += f"the activity of the model '{neuron.name}' is not f(…) of ports or states, once a step"
        hint = "let a group with a model such as static, activity: f(drive), follow with delay 0"
        self.constants.findings.error("softmax-model", name.span, message, hint)

    def _bias(
        self, model: GroupModel, n: int | Unknown, name: str, kind: NeuronType, table: TableReader
    ) -> tuple[dict[str, FloatArray], list[Part]]:
        """The bias by ports, where there is one, and what of it follows parameters."""
        result: dict[str, FloatArray] = {}
        following: list[Part] = []
        units = {port.name: port.unit for port in kind.model.definition.ports}
        for port, formulas in self._at_ports(model.bias, name, kind, model):
            formulas = all_in_unit(formulas, units.get(port, ""), self.constants.findings)
            with self.constants.following() as parts:
                bias = self._drawn(formulas, n, "bias", name, table, None if port == DRIVE else port)
            if bias is not UNKNOWN:
                result[port] = bias
            following += [part._replace(field=BIAS.name, name=port) for part in parts]
        return result, following

    def _noises(self, model: GroupModel, name: str, kind: NeuronType) -> tuple[WrittenNoise, ...]:
        """The noise by ports, as far as it is in order."""
        written = self._at_ports(model.noise, name, kind, model)
        found = ((port, formula, _noise_of(formula, self.constants)) for port, formula in written)
        return tuple(WrittenNoise(port, formula, tree) for port, formula, tree in found if tree is not UNKNOWN)

    def _position(
        self, model: GroupModel, n: int | Unknown, name: str, table: TableReader
    ) -> tuple[FloatArray | Unknown, list[Part]]:
        """The positions, NaN without any, and what of them follows parameters."""
        if model.position is None:
            return UNKNOWN if n is UNKNOWN else _defaults(n).position, []
        with self.constants.following() as parts:
            stream = Stream(self.seed, "position", self.scope.called(name))
            position = positions_of(model.position, n, self.constants, table, stream)
        return position, [part._replace(field="position") for part in parts]

    def _starts(
        self, given: Initial, n: int | Unknown, name: str, kind: NeuronType, model: GroupModel, table: TableReader
    ) -> dict[str, FloatArray]:
        """What states of the model begin with, as far as that is given."""
        result: dict[str, FloatArray] = {}
        neuron = kind.model.definition
        model_known = is_written(kind, model)  # else it is invalid, and reported
        units = {state.name: state.unit for state in neuron.holdable if state.name != SPIKE}
        states = tuple(units)
        for state, formulas in given.states:
            if model_known and state.value not in states:
                found = no_state("model", neuron.name, f"of '{name}'", state.value, states)
                found.report("unknown-state", state.span, self.constants.findings)
            formulas = all_in_unit(formulas, units.get(state.value, ""), self.constants.findings)
            values = self._drawn(formulas, n, "initial", name, table, state.value)
            if values is not UNKNOWN:
                result[state.value] = values
        return result

    def _input_name(self, model: GroupModel) -> str | None:
        """The network's name of the input of a group."""
        written = next((name for name, port in model.input or () if port is None or port.value == DRIVE), None)
        if written is None:
            return None
        found = self.scope.input(written.value)
        return found.name if isinstance(found, Input) else written.value

    def _names(self, name: str, model: GroupModel, start: int) -> tuple[tuple[str, ...] | Unknown, int | None]:
        """The names of the neurons, and of a counted group the first number."""
        findings = self.constants.findings
        count = None if model.count is None else self.constants.integer(model.count, "'count'", 1)
        if count is UNKNOWN:
            return UNKNOWN, None
        written = self._listed(model)
        if written is UNKNOWN:
            return UNKNOWN, None
        total = start + (count or (0 if written is None else len(written.names)) or 1)
        if total > self.limits.neurons:
            span = key_span(self.scope.section, "neurons", name) if model.count is None else model.count.span
            message = f"this makes {amount(total)} neurons; the limit is {self.limits.neurons:,}"
            findings.error("too-many", span, message, "raise it with --limit")
            return UNKNOWN, None
        if written is not None:
            return written.checked(count, self.constants.findings), None
        if count is None:
            return (name,), None
        first = 1 if model.first is None else self.constants.integer(model.first, "'first'", 0)
        if first is UNKNOWN:
            return UNKNOWN, None
        names = tuple(f"{name}{number}" for number in range(first, first + count))
        if len(names[-1]) > 64:
            findings.error("bad-name", key_span(self.scope.section, "neurons", name), too_long(names[-1]), NAME_RULE)
            return UNKNOWN, None
        return names, first

    def _listed(self, model: GroupModel) -> ListedNames | Unknown | None:
        """The names under ``names``; None where there are none."""
        if model.names is None:
            return None
        return listed_names(model.names, model.source, self.scope.files, "duplicate-neuron")

    def _kind(self, name: str, model: GroupModel, n: int | Unknown, table: TableReader) -> NeuronType:
        """The activation and the model of the neurons; ``identity`` and ``static`` where these are invalid."""
        if n is UNKNOWN or not (_fixed(model.activation) and _fixed(model.model)):
            return self._neuron_type(model, neurons(n, table), n)
        if self._plain(model.activation, ACTIVATION) and self._plain(model.model, MODEL):
            # what says no more than names is the same in every group: there may be very many of these
            name = f"{_name_of(model.activation)} {_name_of(model.model)}"
        key = self.scope.module, name, n
        if key not in self.kinds:
            self.kinds[key] = self._neuron_type(model, neurons(n), n)
        return self.kinds[key]

    def _neuron_type(self, model: GroupModel, each: Each, n: int | Unknown) -> NeuronType:
        activation = self._settled(model.activation or _default("identity", model), ACTIVATION, each, n)
        choice = model.model or _default("static", model)
        neuron = self._settled(choice, MODEL, each, n)
        check_initials(neuron, choice, self.constants)
        return NeuronType(activation, neuron)

    def _settled(self, choice: Choice, kind: Kind, each: Each, n: int | Unknown) -> Settled:
        """The definition that a group names, with its settings; where it is invalid that of groups that name none."""
        found = settled_of(choice, kind, self.definitions, self.constants, each, n)
        if found is not UNKNOWN and found.sound:
            return found
        plain = self.definitions.of(kind).known()["identity" if kind == ACTIVATION else "static"]
        return Settled(plain.definition, {}, (), Names())

    def _plain(self, choice: Choice | None, kind: Kind) -> bool:
        """Whether a choice is the name of a definition, or nothing."""
        known = self.definitions.of(kind).known()
        return choice is None or (not choice.settings.entries and choice.name.value in known)

    def _drawn(
        self,
        formulas: Values,
        n: int | Unknown,
        purpose: str,
        name: str,
        table: TableReader,
        state: str | None = None,
    ) -> FloatArray | Unknown:
        """The values of a key, or those of a state in it, of the group's neurons."""
        if isinstance(formulas, TableColumn):
            return table.numbers(formulas)
        called, what = self.scope.called(name), purpose
        if state is not None:
            called, what = f"{called}.{state}", state
        return spread(formulas, n, self.constants, f"'{what}'", Stream(self.seed, purpose, called))

    def _inputs(self, model: GroupModel, n: int | Unknown, name: str, kind: NeuronType) -> dict[str, IntArray]:
        """The places of the neurons' inputs in the vector of all inputs, by ports, where they are known."""
        found = ((port, self._input(text, n)) for port, text in self._at_ports(model.input, name, kind, model))
        return {port: places for port, places in found if places is not UNKNOWN}

    def _input(self, text: Located[str], n: int | Unknown) -> IntArray | Unknown:
        """The places of the neurons' inputs in the vector of all inputs: one component for all, or one for each;
        UNKNOWN where it is not known."""
        name = text.value
        found = self.scope.input(name)
        findings = self.constants.findings
        if found is None:
            known = tuple(self.scope.section.inputs)
            found = None if findings.many else self.scope.input(meant(name, known) or "")
            message = f"there is no input '{shorten(name)}'"
            lost = self.scope.undeclared(name)
            findings.error("unknown-input", text.span, message, lambda: known_inputs(name, known), undeclared=lost)
        if not isinstance(found, Input) or n is UNKNOWN:
            return UNKNOWN
        if found.size == 1:
            return np.full(n, found.start, dtype=np.int64)
        if found.size == n:
            return np.arange(found.start, found.start + n, dtype=np.int64)
        message = f"the input '{name}' has {found.size} components, the group has {plural(n, 'neuron')}"
        findings.error("wrong-size", text.span, message, "an input has one component, or one for each neuron")
        return UNKNOWN

    def _boxes(self, model: GroupModel, table: TableReader) -> tuple[str, ...]:
        """The box of each neuron, if a table says so."""
        if not isinstance(model.box, TableColumn):
            return ()
        titles = known(table.texts(model.box, gaps=True), ())
        return tuple(title and self.scope.called(title) for title in titles)

    def _ids(
        self, model: GroupModel, names: tuple[str, ...] | Unknown, table: TableReader
    ) -> tuple[str, ...] | Unknown:
        """What tables call the neurons, each otherwise; nothing where that is not said, UNKNOWN where it is invalid."""
        if "ids" in model.unknown or (model.ids is not None and names is UNKNOWN):
            return UNKNOWN
        if model.ids is None or names is UNKNOWN:
            return ()
        findings, node = self.constants.findings, model.source.get("ids")
        if isinstance(model.ids, TableColumn):
            (column,) = model.ids.columns
            texts, spans = table.texts(model.ids, gaps=True), [column.span] * len(names)
            if texts is UNKNOWN:
                return UNKNOWN
            ids = texts
        else:
            ids, spans = tuple(one.value.strip() for one in model.ids), [one.span for one in model.ids]
            if len(ids) != len(names):
                message = f"'ids' has {plural(len(ids), 'text')} for {plural(len(names), 'neuron')}"
                findings.error("wrong-size", model.source.span if node is None else node.span, message)
                return UNKNOWN
        first: dict[str, str] = {}
        for one, name, place in zip(ids, names, spans, strict=False):
            if one and first.setdefault(one, name) != name:
                message = f"'{shorten(one)}' is the id of '{first[one]}' and of '{name}'"
                findings.error("duplicate-name", place, message, "give each neuron its own", key=name)
        return ids if len(first) == sum(map(bool, ids)) else UNKNOWN

    def _labels(self, model: GroupModel, names: tuple[str, ...], table: TableReader) -> tuple[str, ...] | Unknown:
        """What stands at the neurons in pictures; UNKNOWN where that is invalid."""
        if model.label is None:
            return names
        if isinstance(model.label, TableColumn):
            texts = table.texts(model.label)
            (column,) = model.label.columns
            labels = (Located(text, column.node) for text in known(texts, ()))
            return texts if all(check_length(label, self.constants.findings) for label in labels) else UNKNOWN
        node = model.source.get("label")
        if node is None or isinstance(node, Scalar) or len(model.label) == len(names):
            return labels_of(model.label, len(names), self.scope)
        message = f"'label' has {plural(len(model.label), 'text')} for {plural(len(names), 'neuron')}"
        self.constants.findings.error("wrong-size", node.span, message)
        return UNKNOWN


#: The parameters of what has none.
_NO_PARAMETERS: Mapping[str, tuple[float, ...]] = {}
_NO_INITIAL = Initial(None)
_NO_STARTS: Mapping[str, FloatArray] = {}


def _numbers(parameters: Mapping[str, FloatArray]) -> Mapping[str, tuple[float, ...]]:
    """The values of parameters as numbers."""
    return {name: tuple(values.tolist()) for name, values in parameters.items()} if parameters else _NO_PARAMETERS


def _spikes(kind: NeuronType) -> bool:
    """Whether neurons spike: their model does, and what its activity is of is no graded activation."""
    model = kind.model.definition
    return model.spikes and (kind.activation.definition.name == "step" or not model.reads_activation)


def _default(name: str, model: GroupModel) -> Choice:
    return Choice(Located(name, Scalar(name, model.source.span)), SourceMapping((), model.source.span))


def _fixed(choice: Choice | None) -> bool:
    """Whether a choice means the same wherever it stands: what is set in it are numbers."""
    return choice is None or not any(
        not isinstance(entry.value, Scalar) or isinstance(entry.value.value, str) for entry in choice.settings.entries
    )


def _name_of(choice: Choice | None) -> str:
    return "" if choice is None else choice.name.value


#: Keys that say which neurons a group has.
_NAMING = frozenset({"count", "first", "names"})


def _may_lack_names(model: GroupModel) -> bool:
    """Whether what could not be read of a group may have said which neurons there are."""
    if model.sound:
        return False
    if not model.unknown.isdisjoint(_NAMING):
        return True
    if model.count is not None or model.names is not None:
        return False
    known = GroupModel.model_fields
    foreign = [
        entry.value for entry in model.source.entries if entry.name not in known and not nearest(entry.name, known)
    ]
    # in a key of some other language a number may be how many there are
    return any(not isinstance(node, Scalar) or type(node.value) in (int, float) for node in foreign)


def unread_neurons(model: GroupModel) -> Names[Group]:
    """What the neurons of a group may be called of which it is not known which it has."""
    node = model.source.get("names")
    items = node.items if isinstance(node, AnyList) else ()
    texts = {str(item.value): UNKNOWN for item in items if isinstance(item, Scalar)}
    return Names(texts, "names" in model.unknown and not isinstance(node, AnyList))


def _noise_of(formula: Formula, constants: Constants) -> Tree | Unknown:
    """The expression of a noise, which draws something."""
    tree = constants.tree(formula, _NOISE)
    if tree is UNKNOWN or draws(tree):
        return tree
    message = "this noise draws nothing: it is the same at each run"
    hint = "use normal(mean, deviation), uniform(low, high) or poisson(mean); a constant belongs to 'bias'"
    constants.findings.error("no-draw", formula.span, message, hint)
    return UNKNOWN
