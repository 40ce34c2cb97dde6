"""Neurons: from the groups of a spec to structures of arrays.

In: Scopes. Out: a Census: Neurons, a Directory of names for each scope, and for each group what its activation and
its model are (``groups`` makes each).
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, Indices, IntArray, frozen, narrow
from neurovis_spec.compiler.events.settable import Assembled, Part, Subset
from neurovis_spec.compiler.flows import ports_read_by
from neurovis_spec.compiler.levels import default_delay
from neurovis_spec.compiler.limits import Limits
from neurovis_spec.compiler.names.references import Directory, key_span
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.network import Group, Neurons, Route
from neurovis_spec.compiler.neurons.groups import Builder, Built, Kinds, unread_neurons
from neurovis_spec.compiler.neurons.positions import depend_on_positions
from neurovis_spec.compiler.program import Definition
from neurovis_spec.language.located import IDENTIFIER, Located
from neurovis_spec.language.model import names_of
from neurovis_spec.language.tables import TableColumn
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown, known

Number = TypeVar("Number", np.float64, np.int64)
#: Characters that no name has.
_NO_LETTERS = re.compile(r"[^A-Za-z0-9_]+")


@dataclass(frozen=True)
class Models:
    """The models that there are, and for each neuron the number of its own."""

    different: tuple[Definition, ...]
    of: Indices
    _delays: dict[tuple[int, int, Route, str], int] = field(default_factory=dict)

    def delay(self, source: int, target: int, route: Route, synapse: Definition | None = None) -> int:
        """The delay of a connection that names none, from a neuron of one of these models to one of another."""
        key = source, target, route, "" if synapse is None else synapse.name
        if key not in self._delays:
            ports, models = [name for name, _ in route.ports], (self.different[source], self.different[target])
            self._delays[key] = default_delay(models[0], route.sends, models[1], ports, synapse)
        return self._delays[key]

    def into_flow(self, targets: Indices, route: Route) -> npt.NDArray[np.bool_]:
        """For each connection to one of these whether a derivative there reads what arrives."""
        ports = [name for name, _ in route.ports]
        reading = [not read.isdisjoint(ports) for read in self._read_by_flow]
        return np.array(reading, dtype=np.bool_)[self.of[targets]]

    @cached_property
    def _read_by_flow(self) -> list[frozenset[str]]:
        """The ports that derivatives of each model read."""
        return [ports_read_by(one).flow for one in self.different]

    @property
    def flow(self) -> bool:
        """Whether any has a state with a derivative."""
        return any(one.flows for one in self.different)

    @property
    def fires(self) -> bool:
        """Whether any fires."""
        return any(one.fires for one in self.different)

    def pairs(self, sources: Indices, targets: Indices) -> list[tuple[Definition, Definition]]:
        """The models of both ends of connections, each pair once."""
        numbers = self.of[sources].astype(np.int64) * len(self.different) + self.of[targets]
        found = (divmod(number, len(self.different)) for number in np.unique(numbers).tolist())
        return [(self.different[source], self.different[target]) for source, target in found]


class Inside(NamedTuple):
    """A group, and where neurons of it stand among others."""

    group: Built
    places: IntArray


@dataclass(frozen=True)
class Census:
    """All neurons, the groups that they are made of, and how everything is called in each scope (``directories`` are in
    the order of the scopes, the network's own first)."""

    neurons: Neurons
    groups: tuple[Built, ...]
    directories: tuple[Directory, ...]

    @cached_property
    def by_id(self) -> Mapping[str, tuple[int, ...]]:
        """The neurons that tables call otherwise, by what they call them."""
        found: dict[str, tuple[int, ...]] = {}
        for built in self.groups:
            for neuron, one in enumerate(known(built.ids, ()), built.group.start):
                if one:
                    found[one] = (*found.get(one, ()), neuron)
        return found

    @property
    def ids_known(self) -> bool:
        """Whether what tables call the neurons is valid wherever it is said."""
        return all(one.ids is not UNKNOWN for one in self.groups)

    @cached_property
    def moving(self) -> Assembled:
        """The positions, x and y (and z) in turn, of which some may follow parameters."""
        axes, parts = self.neurons.position.shape[1], list[Part]()
        for one in self.groups:
            own = 2 if one.position is UNKNOWN else one.position.shape[1]
            for part in one.parts:
                if part.field == "position":
                    neuron, axis = np.divmod(part.within(own * one.group.count), own)
                    parts.append(part._replace(places=axes * (one.group.start + neuron) + axis))
        return Assembled(self.neurons.position.ravel(), tuple(parts))

    def straight(self, one: Indices, other: Indices) -> FloatArray:
        """How far neurons are from others; the indices broadcast. Squares, a sum and a root are rounded in one way on
        every machine, as no other function is; a power of two, which rounds nothing, keeps squares from overflowing."""
        position, scale = self._scaled
        squared = np.zeros(())
        for axis in range(position.shape[1]):
            difference = position[one, axis] - position[other, axis]
            np.multiply(difference, difference, out=difference)
            squared = difference if not axis else np.add(squared, difference, out=squared)
        return np.multiply(np.sqrt(squared, out=squared), scale, out=squared)

    @cached_property
    def _scaled(self) -> tuple[FloatArray, float]:
        """The positions, divided by a power of two so that none is beyond 2, and this power."""
        most = np.abs(self.neurons.position).max(initial=0, where=np.isfinite(self.neurons.position))
        power = min(int(np.frexp(most)[1]), sys.float_info.max_exp - 1)
        return np.ldexp(self.neurons.position, -power), 2.0**power

    @cached_property
    def misplaced(self) -> npt.NDArray[np.bool_]:
        """For each neuron whether what the spec says of its position is invalid."""
        return self._each([one.position is UNKNOWN or "position" in one.model.unknown for one in self.groups])

    @cached_property
    def models(self) -> Models:
        """The model of every neuron."""
        different = {one.kind.model.definition.name: one.kind.model.definition for one in self.groups}
        number = {name: place for place, name in enumerate(different)}
        numbers = [number[one.kind.model.definition.name] for one in self.groups]
        return Models(tuple(different.values()), np.repeat(narrow(np.array(numbers, dtype=np.int64)), self._counts))

    @cached_property
    def units(self) -> IntArray | None:
        """For each neuron the first of those that are updated as one, as they share 1 among each other, else −1; None
        where there are none."""
        if not any(one.kind.activation.definition.softmax for one in self.groups):
            return None
        result = np.full(len(self.neurons), -1, dtype=np.int64)
        for one in self.groups:
            if one.kind.activation.definition.softmax:
                result[one.group.start : one.group.start + one.group.count] = one.group.start
        return result

    @cached_property
    def _counts(self) -> list[int]:
        return [one.group.count for one in self.groups]

    def groups_of(self, neurons: Indices) -> list[Built]:
        """The groups that these neurons belong to."""
        starts = [one.group.start for one in self.groups]
        numbers = np.searchsorted(starts, neurons, side="right") - 1
        return [self.groups[number] for number in np.flatnonzero(np.bincount(numbers))]  # np.unique loads numpy.ma

    def groups_at(self, neurons: Indices) -> list[Inside]:
        """The groups of some neurons, each with the places among these where its own stand."""
        starts = [one.group.start for one in self.groups]
        numbers = np.searchsorted(starts, neurons, side="right") - 1
        return [Inside(self.groups[number], np.flatnonzero(numbers == number)) for number in np.unique(numbers)]

    def _each(self, values: list[bool]) -> npt.NDArray[np.bool_]:
        """For each neuron what holds of its group."""
        return np.repeat(np.array(values, dtype=np.bool_), self._counts)

    def go_by_position(self, neurons: IntArray) -> None:
        """Mark the parameters that place these neurons as structural: which connections exist depends on them."""
        for one in self.groups_of(neurons):
            depend_on_positions(one.model.position, one.constants)

    def parameter(self, name: str) -> FloatArray:
        """The parameter of this name of the model of each neuron (n,), NaN where it has none."""
        result = np.full(len(self.neurons), np.nan)
        for one in self.groups:
            if name in one.kind.model.parameters:
                result[one.group.start : one.group.start + one.group.count] = one.kind.model.parameters[name]
        return result

    def followed(self, name: str, neurons: IntArray) -> Subset:
        """This parameter of the models of these neurons, of which some may follow parameters of a run."""
        parts = [
            part._replace(places=one.group.start + part.within(one.group.count))
            for one in self.groups_of(neurons.ravel())
            for part in one.kind.model.parts
            if part.name == name
        ]
        return Subset(Assembled(self.parameter(name), tuple(parts)), neurons)

    def go_by_parameter(self, name: str, neurons: IntArray) -> None:
        """Mark the parameters of the run that this one of the models of these neurons follows as structural."""
        for one in self.groups_of(neurons):
            one.constants.depend_on(part for part in one.kind.model.parts if part.name == name)

    @property
    def directory(self) -> Directory:
        """How everything is called in the spec itself."""
        return self.directories[0]


class _ScopeGroups(NamedTuple):
    """A scope with its groups."""

    scope: Scope
    built: tuple[Built, ...]
    #: the index of its first neuron
    start: int
    #: names that may mean neurons of an invalid declaration
    invalid: Names[Group]


def populate(scopes: tuple[Scope, ...], limits: Limits, seed: int) -> Census:
    """Make every neuron, scope by scope. A group that is invalid is made as far as its names are known, so that what
    refers to it can be checked."""
    all_groups: list[_ScopeGroups] = []
    kinds: Kinds = {}
    start = 0
    for scope in scopes:
        groups = _scope_groups(scope, start, limits, seed, kinds)
        all_groups.append(groups)
        start += sum(item.group.count for item in groups.built)
        _check_owners(scope, groups.built)
    return _join(all_groups)


def without_neurons(census: Census) -> Census:
    """A census without neurons whose tables of names are open: no name is reported as unknown, since the lack of
    neurons was reported already."""
    first, *others = census.directories
    return replace(census, directories=(replace(first, invalid=first.invalid.opened()), *others))


def _scope_groups(scope: Scope, start: int, limits: Limits, seed: int, kinds: Kinds) -> _ScopeGroups:
    """The groups of a scope, whose first neuron is ``start``."""
    builder = Builder(scope, limits, seed, kinds)
    built: list[Built] = []
    invalid: dict[str, Group | Unknown] = {
        name: UNKNOWN for name, places in scope.children.items() if places is UNKNOWN
    }
    is_open = scope.children.is_open
    next_neuron = start
    for name, model in scope.section.neurons.items():
        group = builder.group(name, model, next_neuron)
        if group is UNKNOWN:
            invalid.update({name: UNKNOWN, **unread_neurons(model)})
            is_open = is_open or unread_neurons(model).is_open
            continue
        built.append(group)
        for neuron in group.names if model.names is not None or not IDENTIFIER.fullmatch(name) else ():
            if not IDENTIFIER.fullmatch(neuron):
                invalid.update(dict.fromkeys(_repaired(neuron), UNKNOWN))
        next_neuron += group.group.count
    names: Names[Group] = names_of(scope.section, "neurons", invalid).opened(is_open)
    return _ScopeGroups(scope, tuple(built), start, names)


def _repaired(name: str) -> tuple[str, str]:
    """How an invalid name may be written elsewhere, where its author had it right."""
    return _NO_LETTERS.sub("", name), _NO_LETTERS.sub("_", name)


def _check_owners(scope: Scope, built: tuple[Built, ...]) -> None:
    """Report two declarations of one name: of two groups, a neuron and an input, an instance and others."""
    section, findings = scope.section, scope.constants.findings
    owners: dict[str, str] = {}
    for item in built:
        name = item.name
        # A group of several may not be called like a neuron of another one either: what would the name refer to?
        own = dict.fromkeys((*item.names, name), name)
        if owners.keys().isdisjoint(own) and section.inputs.keys().isdisjoint(own):
            owners.update(own)
            continue
        for neuron in own:
            other = owners.setdefault(neuron, name)
            if other != name:
                first = key_span(section, "neurons", other)
                message = f"'{name}' and '{other}' (line {first.line}) both make the name '{neuron}'"
                hint = "rename one of them, or count it from another number (first)"
                findings.error("duplicate-neuron", key_span(section, "neurons", name), message, hint)
                break
            if neuron in section.inputs and neuron != name:
                first = key_span(section, "inputs", neuron)
                message = f"the neuron '{neuron}' of '{name}' is called like an input (line {first.line})"
                findings.error("duplicate-name", key_span(section, "neurons", name), message)
                break
    _check_instances(scope, owners)


def _check_instances(scope: Scope, owners: Mapping[str, str]) -> None:
    """Report an instance that is called like anything else in its scope. ``owners`` has the group of each name."""
    section, findings = scope.section, scope.constants.findings
    taken: dict[str, str] = {}
    children = scope.children.known()
    for name, model in section.instances.items():
        count = 0 if model.count is None else len(children.get(name, ()))
        numbered = (f"{name}{number}" for number in range(1, count + 1))
        for called in (name, *(numbered if model.names is None else _listed(name, model.names, children))):
            other = taken.setdefault(called, name)
            what = None
            if other != name:
                what = f"instance '{other}' (line {key_span(section, 'instances', other).line})"
            elif called in owners:
                what = f"group '{owners[called]}' (line {key_span(section, 'neurons', owners[called]).line})"
            elif called in section.inputs:
                what = f"input '{called}' (line {key_span(section, 'inputs', called).line})"
            if what is not None:
                whose = "" if called == name else f" of '{name}'"
                message = f"the instance '{called}'{whose} is called like the {what}"
                hint = "groups, inputs and instances share their names"
                findings.error("duplicate-name", key_span(section, "instances", name), message, hint)
                break


def _listed(
    name: str, written: tuple[Located[str], ...] | TableColumn, children: Mapping[str, tuple[int, ...]]
) -> tuple[str, ...]:
    """The names that the instances of an entry have by themselves."""
    if not isinstance(written, TableColumn):
        return tuple(one.value for one in written)
    own = set(children.get(name, ()))
    return tuple(other for other, places in children.items() if other != name and own.issuperset(places))


def _join(all_groups: list[_ScopeGroups]) -> Census:
    """All groups as one structure of arrays."""
    built = [item for groups in all_groups for item in groups.built]
    names: list[str] = []
    for groups in all_groups:
        own = chain.from_iterable(item.names for item in groups.built)
        names.extend(map(groups.scope.called, own) if groups.scope.path else own)
    empty = np.zeros(0)
    neurons = Neurons(
        names=tuple(names),
        labels=tuple(chain.from_iterable(item.labels for item in built)),
        groups=tuple(item.group for item in built),
        bias=frozen(np.concatenate([item.bias for item in built] or [empty])),
        initial=frozen(np.concatenate([item.initial for item in built] or [empty])),
        input=frozen(np.concatenate([item.input for item in built] or [empty.astype(np.int64)])),
        position=frozen(_positions(built)),
        starts=_starts(built, len(names)),
        port_bias=_of_ports(built, [one.port_bias for one in built], np.zeros(len(names))),
        port_input=_of_ports(built, [one.port_input for one in built], np.full(len(names), -1, dtype=np.int64)),
    )
    return Census(neurons, tuple(built), _directories(all_groups, len(names)))


def _starts(built: list[Built], total: int) -> dict[str, FloatArray]:
    """By states of models, what they begin with in all neurons, NaN where no group says it."""
    result: dict[str, FloatArray] = {}
    for item in built:
        for state, values in item.starts.items():
            array = result.setdefault(state, np.full(total, np.nan))
            array[item.group.start : item.group.start + item.group.count] = values
    return {state: frozen(array) for state, array in result.items()}


def _of_ports(
    built: list[Built], given: list[Mapping[str, npt.NDArray[Number]]], otherwise: npt.NDArray[Number]
) -> dict[str, npt.NDArray[Number]]:
    """By ports, what groups are given there, in all neurons, and what holds of those that are given nothing."""
    result: dict[str, npt.NDArray[Number]] = {}
    for item, ports in zip(built, given, strict=True):
        for port, values in ports.items():
            array = result.setdefault(port, otherwise.copy())
            array[item.group.start : item.group.start + item.group.count] = values
    return {port: frozen(array) for port, array in result.items()}


def _positions(built: list[Built]) -> FloatArray:
    """The positions of all neurons, NaN where there is none; of three numbers where any has three, and then those of
    two are at height 0."""
    given = [np.full((one.group.count, 2), np.nan) if one.position is UNKNOWN else one.position for one in built]
    axes = max((one.shape[1] for one in given), default=2)
    wide = [one if one.shape[1] == axes else np.column_stack((one, 0.0 * one[:, 0])) for one in given]
    return np.concatenate(wide or [np.zeros((0, 2))])


def _directories(all_groups: list[_ScopeGroups], total: int) -> tuple[Directory, ...]:
    """The Directory of each scope. A scope stands before the instances within it, so the last is made first."""
    made: dict[int, Directory] = {}
    #: by scope the first scope behind it and all instances within it
    scope_after: dict[int, int] = {}
    for index in range(len(all_groups) - 1, -1, -1):
        groups = all_groups[index]
        children = groups.scope.children.known()
        after = max([index + 1, *(scope_after[child] for places in children.values() for child in places)])
        scope_after[index] = after
        stop = all_groups[after].start if after < len(all_groups) else total
        made[index] = Directory(
            groups={item.name: item.group for item in groups.built},
            neurons=dict(
                chain.from_iterable(zip(item.names, item.group.indices, strict=True) for item in groups.built)
            ),
            first={item.name: item.first for item in groups.built if item.first is not None},
            invalid=groups.invalid,
            instances={name: tuple(made[child] for child in places) for name, places in children.items()},
            members=range(groups.start, stop),
            inputs=groups.scope.section.inputs,
            scope=index,
            module=groups.scope.module,
            states={item.name: tuple(one.name for one in item.kind.model.definition.kept) for item in groups.built},
        )
    return tuple(made[index] for index in range(len(all_groups)))
