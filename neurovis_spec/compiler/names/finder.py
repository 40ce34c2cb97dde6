"""Who finds what references name in a spec: neurons, connections, states of models and rules.

In: the Census, the connections that are made. Out: arrays of indices and StateOf, or findings with the nearest
names. References that are written alike share one array.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from neurovis_spec.arrays import IntArray, frozen
from neurovis_spec.compiler.connections.connect import Connected
from neurovis_spec.compiler.names.references import Directory, arrow_of, few, resolve_end, resolve_part, resolve_sum
from neurovis_spec.compiler.names.state_references import (
    Holder,
    Refusal,
    StateOf,
    Wiring,
    connections_state,
    model_state,
)
from neurovis_spec.compiler.neurons.groups import is_written
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import SYNAPSE, Definition, Quantity
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.located import Located
from neurovis_spec.language.references import Arrow, DottedName, Part, StateName, parse_sum
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.likeness import suggest


@dataclass(frozen=True)
class Finder:
    """Finds what references name; ``models`` has the states and outputs of neurons, ``lasting`` the states alone,
    ``wiring`` the connections and their states."""

    directory: Directory
    models: tuple[Holder, ...]
    lasting: tuple[Holder, ...]
    wiring: Wiring
    findings: Findings
    #: what references mean, those that are valid
    known_neurons: dict[str, IntArray] = field(default_factory=dict)
    known_connections: dict[str, IntArray] = field(default_factory=dict)

    def neurons(self, text: Located[str]) -> IntArray | Unknown:
        """The neurons of a reference; UNKNOWN where it is invalid."""
        if text.value not in self.known_neurons:
            found = resolve_end(text, self.directory, self.findings)
            if found is UNKNOWN:
                return UNKNOWN
            self.known_neurons[text.value] = frozen(np.unique(np.array(found, dtype=np.int64)))
        return self.known_neurons[text.value]

    def connections(self, text: Located[str]) -> IntArray | Unknown:
        """The connections between two ends; UNKNOWN, and a finding, where there is none. There may be none between the
        ends of an entry that has drawn none with this seed, which is a warning."""
        if text.value not in self.known_connections:
            arrow = arrow_of(text, self.findings)
            found = UNKNOWN if arrow is UNKNOWN else self._between(arrow, text)
            if arrow is UNKNOWN or found is UNKNOWN or not self.wiring.complete:
                return UNKNOWN
            if not len(found) and self._drew_nothing(arrow, text):
                message = f"this has no effect: the entry of '{shorten(text.value)}' makes no connection at all"
                self.findings.warning("nothing-drawn", text.span, message)
            elif not len(found):
                message = f"there is no connection '{shorten(text.value)}'"
                self.findings.error("no-connection", text.span, message, lambda: self._other(arrow, text))
                return UNKNOWN
            self.known_connections[text.value] = frozen(found)
        return self.known_connections[text.value]

    def _between(self, arrow: Arrow, text: Located[str], back: bool = False) -> IntArray | Unknown:
        sources = resolve_sum(arrow.sources, text, self.directory, self.findings)
        targets = resolve_sum(arrow.targets, text, self.directory, self.findings)
        if sources is UNKNOWN or targets is UNKNOWN:
            return UNKNOWN
        return self.wiring.between(targets, sources) if back else self.wiring.between(sources, targets)

    def _drew_nothing(self, arrow: Arrow, text: Located[str]) -> bool:
        ends = [resolve_sum(end, text, self.directory, self.findings) for end in (arrow.sources, arrow.targets)]
        sources, targets = (() if end is UNKNOWN else end for end in ends)
        return self.wiring.nothing_between(sources, targets)

    def learns(self, connections: IntArray) -> bool:
        """Whether any of these connections has a rule."""
        return any(bool(np.isin(connections, rule.members).any()) for rule in self.wiring.rules)

    def _other(self, arrow: Arrow, text: Located[str]) -> str | None:
        """Which connection may be meant: the one the other way, those that are called alike, those of either end."""
        source, target = arrow.sources.text, arrow.targets.text
        back = self._between(arrow, text, back=True)
        if back is not UNKNOWN and len(back):
            return f"there is '{shorten(target)} -> {shorten(source)}', the other way"
        names = self.wiring.names
        near = [name for name in names if source in name.split(" -> ")[0] or target in name.split(" -> ")[-1]]
        return suggest(f"{source} -> {target}", few(arrow.text, near or names), "connections")

    def having(self, text: Located[str], state: Located[str]) -> IntArray | Unknown:
        """The neurons of a reference, whose models must have this state or output; UNKNOWN where it is invalid."""
        neurons = self.neurons(text)
        if neurons is UNKNOWN:
            return UNKNOWN
        one = model_state(StateName(DottedName(text.value, 0), state.value), neurons.tolist(), self.models)
        return self._refused(one, state.span) if isinstance(one, Refusal) else one.neurons

    def clamped(self, text: Located[str]) -> IntArray | StateOf | Unknown:
        """What a key of ``clamp`` names: neurons, or a state of some neurons or connections; UNKNOWN where it is
        neither, which is reported."""
        part, *others = parse_sum(text.value)
        name = None if others else self.directory.name_of_state(part)
        if name is None:
            return self.neurons(text)
        return self.state(name, part, text, self.lasting)

    def state(
        self, name: StateName, part: Part, text: Located[str], models: tuple[Holder, ...] | None = None
    ) -> StateOf | Unknown:
        """The state or output that a part of a text names, or which of these ``models`` have; UNKNOWN where there is
        none, which is reported."""
        one: StateOf | Refusal | Unknown
        if isinstance(name.owner, Arrow):
            connections = self._between(name.owner, text)
            one = (
                UNKNOWN
                if connections is UNKNOWN
                else connections_state(name, connections, self.wiring, outputs=models is None)
            )
        else:
            neurons = resolve_part(name.owner, text, self.directory, self.findings)
            one = UNKNOWN if neurons is UNKNOWN else model_state(name, neurons, models or self.models)
        if isinstance(one, Refusal):
            return self._refused(one, text.node.at(part.start, part.end))
        return one

    def _refused(self, why: Refusal, span: Span) -> Unknown:
        why.report("unknown-state", span, self.findings)
        return UNKNOWN


def finder_of(census: Census, made: Connected, findings: Findings) -> Finder:
    """The Finder of the neurons, connections and states of a spec."""
    rules, synapses, start = [], [], 0
    for bundle in made.bundles:
        first, start = start, start + len(bundle.sources)
        members = np.arange(first, start)
        rules += [_holder(members, learning.rule.name, learning.rule.named) for learning in bundle.rules]
        if bundle.synapse is not None:
            synapse = bundle.synapse.definition
            carriers = None if bundle.carriers is None else first + bundle.carriers
            holder = _holder(members, synapse.name, synapse.holdable)
            synapses.append(holder._replace(outputs=(SYNAPSE.gives,), carriers=carriers))
    names = tuple(bundle.name for bundle in made.bundles)
    empty = tuple(bundle.empty for bundle in made.bundles if bundle.empty is not None)
    ends = made.sources.compact(), made.targets.compact()
    wiring = Wiring(*ends, names, tuple(rules), made.complete, empty, tuple(synapses))
    models = _models(census)
    kept = tuple(_holder(members, model.name, model.holdable, model.outputs) for model, members in models)
    lasting = tuple(_holder(members, model.name, model.holdable) for model, members in models)
    return Finder(census.directory, kept, lasting, wiring, findings)


def _holder(members: IntArray, name: str, states: tuple[Quantity, ...], outputs: tuple[Quantity, ...] = ()) -> Holder:
    return Holder(members, name, tuple(one.name for one in states), tuple(one.name for one in outputs))


def _models(census: Census) -> list[tuple[Definition, IntArray]]:
    """The models of groups, each with its neurons; nothing is known of a group whose model is invalid."""
    members: dict[str, list[range]] = {}
    models: dict[str, Definition] = {}
    for one in census.groups:
        model = one.kind.model.definition
        if not is_written(one.kind, one.model):
            continue
        models[model.name] = model
        members.setdefault(model.name, []).append(one.group.indices)
    return [(models[name], np.fromiter(chain.from_iterable(some), np.int64)) for name, some in members.items()]
