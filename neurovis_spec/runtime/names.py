"""What references name in a recording: ``K``, ``K3``, ``K3..K5``, ``K1 + O``, ``left.K``, as a spec writes them.

In: the names of neurons, groups and outputs, how many there are of counted instances, and a reference. Out: indices of
neurons, or a text that says why there are none. It goes by names alone, which a file holds.

With an instance ``left: {count: 2}`` of a module with the group K of 3 neurons, ``left.K2`` names left1.K2 and
left2.K2, ``left.K1..K2`` those and left1.K1, left2.K1.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count, takewhile
from typing import NamedTuple

from neurovis_spec.compiler.names.given import GIVEN
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.references import Arrow, NeuronRange, Part, RuleState, parse_sum, state_of
from neurovis_spec.likeness import suggest
from neurovis_spec.runtime.errors import unknown_text


class Found(NamedTuple):
    """Neurons by index; ``single`` where one is meant, not a list of one."""

    neurons: tuple[int, ...]
    single: bool


@dataclass(frozen=True)
class Names:
    """Who is called what in a recording."""

    neurons: Mapping[str, int]
    #: groups and outputs
    views: Mapping[str, tuple[tuple[int, ...], bool]] = field(default_factory=dict)
    #: how many instances a name stands for: ``left`` for ``left1``, ``left2``, …
    counted: Mapping[str, int] = field(default_factory=dict)
    #: states that are recorded (``K1.v``, ``(K1 -> O).e``), by their columns
    states: Mapping[str, int] = field(default_factory=dict)
    #: outputs that name states, and whether a single one is meant
    state_views: Mapping[str, tuple[tuple[int, ...], bool]] = field(default_factory=dict)
    #: groups whose neurons have names of their own
    named: tuple[str, ...] = ()

    def find_states(self, reference: str) -> Found | str | None:
        """The columns of the states of a reference; None where it is to no state, a text where that is not there."""
        parts = parse_sum(reference)
        result: list[int] = []
        single = len(parts) == 1
        for part in parts:
            found = self._states(part)
            if not isinstance(found, Found):
                return found
            single = single and found.single
            result += found.neurons
        return Found(tuple(result), single)

    def _states(self, part: Part) -> Found | str | None:
        """The same of one part of a sum."""
        text, name = part.text, state_of(part)
        if text in self.state_views:
            return Found(*self.state_views[text])
        if text in self.states and not (isinstance(part, RuleState) and not part.ends.text.endswith(")")):
            return Found((self.states[text],), True)
        single = False
        if name is None:
            return None
        if name.state == GIVEN and isinstance(self.find(name.owner.text), str):
            return self._given(name.owner.text)
        if isinstance(name.owner, Arrow):
            columns, single = self._of_rules(name.owner, name.state)
        else:
            owners = self.find(name.owner.text)
            if isinstance(owners, str) or isinstance(self.find(text), Found):
                return None
            neuron_names = list(self.neurons)
            columns = [self.states.get(f"{neuron_names[index]}.{name.state}") for index in owners.neurons]
        there = tuple(column for column in columns if column is not None)
        if not there or len(there) < len(columns):
            return f"the state '{text}' was not recorded" + (
                f"; {suggest(text, self.states, 'recorded are')}" if self.states else ", and no other"
            )
        return Found(there, single)

    def _given(self, name: str) -> Found | str:
        """The columns of what an input of several numbers is given."""
        called = (f"{name}[{number}].{GIVEN}" for number in count())
        columns = tuple(self.states[one] for one in takewhile(self.states.__contains__, called))
        if columns:
            return Found(columns, False)
        return f"what an input '{name}' is given was not recorded: neurovis run --states '{name}.{GIVEN}' records it"

    def _of_rules(self, wanted: Arrow, state: str) -> tuple[list[int | None], bool]:
        """The columns of a state between two ends, and whether it is the only one of two single neurons."""
        sources, targets = self.find(wanted.sources.text), self.find(wanted.targets.text)
        if isinstance(sources, str) or isinstance(targets, str):
            return [], False
        columns: list[int | None] = []
        for text, column in self.states.items():
            (part,) = parse_sum(text)
            if not isinstance(part, RuleState) or part.state != state:
                continue
            source, target = part.ends.sources.text, part.ends.targets.text.partition(" ")[0]
            if self.neurons[source] in sources.neurons and self.neurons[target] in targets.neurons:
                columns.append(column)
        return columns, len(columns) == 1 and sources.single and targets.single

    def find(self, reference: str) -> Found | str:
        """The neurons of a reference, in the order written; a text says what is wrong."""
        parts = parse_sum(reference)
        if len(parts) == 1:
            return self._of_part(parts[0])
        result: list[int] = []
        for part in parts:
            found = self._of_part(part)
            if isinstance(found, str):
                return found
            if not set(result).isdisjoint(found.neurons):
                return f"'{part.text}' names neurons that are named before it in '{reference}'"
            result.extend(found.neurons)
        return Found(tuple(result), False)

    def _of_part(self, part: Part) -> Found | str:
        """The neurons of a part of a sum; a text says what is wrong."""
        found = self._by_path(part.text)
        if found is None and isinstance(part, NeuronRange) and part.numbers is not None:
            found = self._range(*part.numbers)
        if found is None:
            return unknown_text("neuron, group or output", part.text, [*self.neurons, *self.views])
        return found

    def _by_path(self, name: str) -> Found | None:
        """What a name names, alone or in several instances (``left.K``); None where it is not there."""
        found = self._known(name)
        if found is None and "." in name:
            way, _, own_name = name.rpartition(".")
            found = _joined([self._known(f"{path}.{own_name}") for path in self._paths(way)])
        return found

    def _known(self, name: str) -> Found | None:
        """What has exactly this name: a neuron, a group or an output."""
        if name in self.neurons:
            return Found((self.neurons[name],), True)
        return Found(*self.views[name]) if name in self.views else None

    def _range(self, group: str, numbers: range) -> Found | None:
        """Neurons of these numbers (``left.K1..K2``: ``left.K`` and 1, 2); None where one is not there."""
        way, dot, stem = group.rpartition(".")
        return _joined(
            [self._consecutive(f"{path}{dot}{stem}", numbers) for path in (self._paths(way) if dot else [""])]
        )

    def _consecutive(self, stem: str, numbers: range) -> Found | None:
        """The same of one instance."""
        indices: list[int] = []
        for number in numbers:
            index = self.neurons.get(f"{stem}{number}")
            if index is None:
                return None
            indices.append(index)
        return Found(tuple(indices), False)

    def _paths(self, way: str) -> list[str]:
        """The instances that a way leads to."""
        paths = [""]
        for step in way.split("."):
            ahead = [f"{path}.{step}" if path else step for path in paths]
            paths = [one for path in ahead for one in self._numbered(path)]
        return paths

    def _numbered(self, path: str) -> list[str]:
        """The instances that a path stands for: ``left1``, ``left2`` for ``left``."""
        number = self.counted.get(path)
        return [path] if number is None else [f"{path}{k + 1}" for k in range(number)]


def names_of(network: Network) -> Names:
    """Who is called what in a network."""
    groups = {g.name: (tuple(g.indices), False) for g in network.neurons.groups if g.name not in network.neuron_index}
    outputs = {o.name: (tuple(o.neurons.tolist()), o.scalar) for o in network.outputs if not o.states}
    numbered = [one for one in network.instances if one.number]
    named = {one.path: one.declared for one in numbered if one.path != f"{one.declared}{one.number}"}
    counted = {one.declared: one.number for one in numbered if one.path not in named}
    together = {name: (neurons, False) for name, neurons in _together(network, named).items()} if named else {}
    neurons = network.neurons.names
    own = (name for name, (members, _) in groups.items() if not are_numbered(name, [neurons[one] for one in members]))
    return Names(network.neuron_index, outputs | groups | together, counted, named=tuple(own))


def are_numbered(name: str, called: Sequence[str]) -> bool:
    """Whether neurons are called as those of a counted group of this name are: ``K3``, ``K4``, …"""
    first = called[0].removeprefix(name) if called else ""
    return first.isdecimal() and [*called] == [f"{name}{int(first) + place}" for place in range(len(called))]


def _together(network: Network, named: Mapping[str, str]) -> dict[str, tuple[int, ...]]:
    """The neurons and groups of instances with names of their own, by what all of these are called: ``legs.K``."""
    inside = [(group.name, group.indices) for group in network.neurons.groups]
    inside += [(name, range(index, index + 1)) for name, index in network.neuron_index.items()]
    result: dict[str, dict[int, None]] = {}
    for name, neurons in inside:
        steps = name.split(".")
        for end in range(1, len(steps)):
            declared = named.get(".".join(steps[:end]))
            if declared is not None:
                result.setdefault(".".join((declared, *steps[end:])), {}).update(dict.fromkeys(neurons))
    return {name: tuple(neurons) for name, neurons in result.items()}


def _joined(found: Iterable[Found | None]) -> Found | None:
    """All of them, None where there are none or one is missing."""
    result: list[int] = []
    for one in found:
        if one is None:
            return None
        result.extend(one.neurons)
    return Found(tuple(result), False) if result else None
