"""The section ``outputs``: names for what leaves a network, activities of neurons or states of models and rules.

In: the section as written, who finds what it names. Out: Outputs, or findings with the nearest known names.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import frozen
from neurovis_spec.compiler.limits import PATIENCE
from neurovis_spec.compiler.names.finder import Finder
from neurovis_spec.compiler.names.references import resolve
from neurovis_spec.compiler.names.state_references import StateOf, singles
from neurovis_spec.compiler.network import Output
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.located import Located
from neurovis_spec.language.references import Part, StateName, parse_sum
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import Reference


def make_outputs(spec: Spec, finder: Finder) -> tuple[Output, ...]:
    """The named outputs. Without any, nothing leaves the network but its record."""
    return tuple(_Reader(finder).outputs(spec))


@dataclass(frozen=True)
class _Reader:
    """Reads the section; ``finder`` resolves what it names."""

    finder: Finder

    @property
    def findings(self) -> Findings:
        """Where findings go."""
        return self.finder.findings

    def outputs(self, spec: Spec) -> Iterator[Output]:
        """The outputs in the order written; what is invalid is reported and left out."""
        for name, reference in spec.outputs.items():
            parts = [(part, text) for text in reference.parts for part in parse_sum(text.value)]
            parts_with_states = [(part, text, self.finder.directory.name_of_state(part)) for part, text in parts]
            if any(state_name is not None for _, _, state_name in parts_with_states):
                output = self._of_states(name, parts_with_states)
            else:
                output = self._of_neurons(name, reference)
            if output is not UNKNOWN:
                yield output

    def _of_neurons(self, name: str, reference: Reference) -> Output | Unknown:
        neurons = resolve(reference.parts, self.finder.directory, self.findings)
        if neurons is UNKNOWN:
            return UNKNOWN
        return Output(name, frozen(np.array(neurons, dtype=np.int64)), scalar=len(neurons) == 1)

    def _of_states(
        self, name: str, parts_with_states: list[tuple[Part, Located[str], StateName | None]]
    ) -> Output | Unknown:
        """An output of states; UNKNOWN where a part is invalid, is no state, or names states that are named before
        it."""
        states: list[StateOf] = []
        failed = False
        seen: set[tuple[str, str, int]] = set()
        before = self.findings.errors
        for part, text, state_name in parts_with_states:
            if self.findings.errors - before >= PATIENCE:
                return UNKNOWN
            span = text.node.at(part.start, part.end)
            if state_name is None:
                message = f"'{shorten(part.text)}' is no state, and the output '{name}' is of states"
                self.findings.error("mixed-output", span, message, "make an output of each kind")
                failed = True
                continue
            state = self.finder.state(state_name, part, text)
            if state is UNKNOWN:
                failed = True
                continue
            its_singles = set(singles([state]))
            if not seen.isdisjoint(its_singles):
                message = f"'{shorten(part.text)}' names states that are named before it"
                self.findings.error("repeated-reference", span, message)
                failed = True
            seen |= its_singles
            states.append(state)
        if failed:
            return UNKNOWN
        neurons = frozen(np.unique(np.concatenate([state.neurons for state in states])))
        return Output(name, neurons, scalar=sum(state.size for state in states) == 1, states=tuple(states))
