"""The section ``outputs``: names for what leaves a network, activities of neurons or states of models and rules.

In: the section as written, the Population and the connections. Out: Outputs, or findings with the nearest known names.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import frozen
from neurovis_spec.compiler.connections.connect import Connected
from neurovis_spec.compiler.limits import PATIENCE
from neurovis_spec.compiler.names.references import Directory, parts, resolve, resolve_end, resolve_part
from neurovis_spec.compiler.names.state_references import (
    Holder,
    Refusal,
    StateName,
    StateOf,
    Wiring,
    model_state,
    rule_state,
    singles,
    split_state,
)
from neurovis_spec.compiler.network import Output
from neurovis_spec.compiler.neurons.populate import Population
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.located import Located
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.values import Reference
from neurovis_spec.language.yaml.source import Scalar


def make_outputs(spec: Spec, population: Population, made: Connected, findings: Findings) -> tuple[Output, ...]:
    """The named outputs. Without any, nothing leaves the network but its record."""
    reader = _Reader(population.directory, state_reader(population, made, findings), findings)
    return tuple(reader.outputs(spec))


def state_reader(population: Population, made: Connected, findings: Findings) -> StateReader:
    """Who reads references to states."""
    return StateReader(population.directory, _models(population), _wiring(made), findings)


@dataclass(frozen=True)
class _Reader:
    directory: Directory
    states: StateReader
    findings: Findings

    def outputs(self, spec: Spec) -> Iterator[Output]:
        for name, reference in spec.outputs.items():
            if not reference.parts and not reference.failed:
                self.findings.error("empty-reference", reference.span, f"the output '{name}' names no neuron")
                continue
            pieces = [(part, span) for text in reference.parts for part, span in parts(text)]
            named = [(part, span, self.states.name(part)) for part, span in pieces]
            if any(state is not None for _, _, state in named):
                output = self._of_states(name, named)
            else:
                output = self._of_neurons(name, reference)
            if output is not None:
                yield output

    def _of_neurons(self, name: str, reference: Reference) -> Output | None:
        neurons = resolve(reference.parts, self.directory, self.findings)
        if neurons is None:
            return None
        array = np.array(neurons, dtype=np.int64)
        frozen(array)
        return Output(name, array, len(neurons) == 1)

    def _of_states(self, name: str, named: list[tuple[str, Span, StateName | None]]) -> Output | None:
        found: list[StateOf] = []
        failed = False
        seen: set[tuple[str, str, int]] = set()
        before = self.findings.errors
        for text, span, state in named:
            if self.findings.errors - before >= PATIENCE:
                return None
            if state is None:
                message = f"'{shorten(text)}' is no state, and the output '{name}' is of states"
                self.findings.error("mixed-output", span, message, "make an output of each kind")
                failed = True
                continue
            one = self.states.find(state, span)
            if one is None:
                failed = True
                continue
            own = set(singles([one]))
            if not seen.isdisjoint(own):
                self.findings.error(
                    "repeated-reference", span, f"'{shorten(text)}' names states that are named before it"
                )
                failed = True
            seen |= own
            found.append(one)
        if failed:
            return None
        neurons = np.unique(np.concatenate([one.neurons for one in found]))
        frozen(neurons)
        return Output(name, neurons, sum(one.size for one in found) == 1, tuple(found))


@dataclass(frozen=True)
class StateReader:
    """Reads references to states of models and rules."""

    directory: Directory
    models: tuple[Holder, ...]
    wiring: Wiring
    findings: Findings

    def name(self, text: str) -> StateName | None:
        """A reference that is to a state, and to no neuron or range of neurons."""
        name = split_state(text)
        if name is None or self.directory.find(text) is not None or self.directory.instance(text):
            return None
        if name.of_rule:
            return name
        head = name.owner.partition(".")[0]
        inside = self.directory.instance(name.owner)
        return None if inside or (head == name.owner and head in self.directory.instances) else name

    def find(self, name: StateName, span: Span) -> StateOf | None:
        """The state of a reference; None where there is none, which is reported."""
        one: StateOf | Refusal | None
        if name.of_rule:
            left, _, right = name.owner.partition("->")
            ends = [resolve_end(Located(end.strip(), Scalar(end.strip(), span)), self.directory, self.findings)
                    for end in (left, right)]  # fmt: skip
            if ends[0] is None or ends[1] is None:
                return None
            one = rule_state(name, ends[0], ends[1], self.wiring)
        else:
            neurons = resolve_part(name.owner, span, self.directory, self.findings)
            one = None if neurons is None else model_state(name, neurons, self.models)
        if isinstance(one, Refusal):
            self.findings.error("unknown-state", span, one.message, one.hint)
            return None
        return one


def _models(population: Population) -> tuple[Holder, ...]:
    """The states of the models of groups; nothing is known of a group whose model is invalid."""
    result = []
    for group, kind, written in zip(population.neurons.groups, population.kinds, population.models, strict=True):
        if "model" in written.lost or (written.model is not None and written.model.name.value != kind.model.name):
            continue
        states = tuple(quantity.name for quantity in kind.model.state)
        result.append(Holder(np.array(group.indices, dtype=np.int64), kind.model.name, states))
    return tuple(result)


def _wiring(made: Connected) -> Wiring:
    rules, start = [], 0
    for bundle in made.bundles:
        members = np.arange(start, start + len(bundle.sources))
        start += len(members)
        if bundle.learning is not None:
            rule = bundle.learning.rule
            rules.append(Holder(members, rule.name, tuple(quantity.name for quantity in rule.state)))
    return Wiring(made.sources, made.targets, tuple(rules), made.complete)
