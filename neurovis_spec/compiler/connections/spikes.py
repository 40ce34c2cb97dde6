"""Spikes on connections: what they may come to, and who has to fire.

In: an entry's synapse and rules, the models at both ends of its connections. Out: findings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from neurovis_spec.compiler.connections.plasticity import Learning
from neurovis_spec.compiler.connections.signals import Signal
from neurovis_spec.compiler.flows import ports_read_by, reads, reads_spike, sent_by
from neurovis_spec.compiler.network import Route
from neurovis_spec.compiler.neurons.populate import Models
from neurovis_spec.compiler.program import AT_SPIKE, MODEL, RULE, Definition
from neurovis_spec.diagnostics import Findings, Span, listed

#: Where to read a spike in place of a derivative, by the end that it is of.
_ACTS: Final = {"pre": "on_pre", "sent": "on_pre", "post": "on_post"}


@dataclass(frozen=True)
class SpikeCheck:
    """Checks an entry, at the place of its key. ``pairs``: the models of sources and targets that it connects, of all
    the ``models``."""

    route: Route
    synapse: Definition | None
    rules: Sequence[Learning]
    pairs: Sequence[tuple[Definition, Definition]]
    models: Models
    key: Span
    findings: Findings

    def check(self, *, undelayed: bool) -> None:
        """Report spikes in derivatives, and those that a signal reads in the step in which they are fired, where any
        connection is ``undelayed``."""
        for source, target in self.pairs:
            found = self._into_port(source, target) or self._in_derivative(source, target)
            if found:
                reason, hint = found
                message = f"a spike lasts no time, and {reason}: its effect would depend on dt"
                self.findings.error("spike-in-derivative", self.key, message, hint)
                return
            if undelayed and self.synapse is not None and any(self._in_signal(self.synapse, source, None)):
                message = f"the signal of the synapse '{self.synapse.name}' reads a spike, which needs a delay of 1"
                self.findings.error("out-of-range", self.key, message, "write delay: 1, or leave it out")
                return

    def _into_port(self, source: Definition, target: Definition) -> tuple[str, str] | None:
        """Why what spikes bring is in a derivative of the target, and what to do about it."""
        ports = [port for port, _ in self.route.ports if port in ports_read_by(target).flow]
        brings = reads_spike(source, self.route.sends)
        if self.synapse is not None:
            brings = any(self._in_signal(self.synapse, source, target))
        if not brings or not ports:
            return None
        hint = "let a state of the model 'jump' by a port, or use a synapse, such as exponential"
        if jumping := sorted(ports_read_by(target).jump):
            hint = f"what jumps by spikes there is at {listed([f'port: {port}' for port in jumping])}"
        return f"the model '{target.name}' of a target reads '{ports[0]}' in a derivative", hint

    def _in_derivative(self, source: Definition, target: Definition) -> tuple[str, str] | None:
        """Which derivative of a synapse or a rule reads what is a spike by the models here, and what to do about it. Of
        ``pre.spike`` and ``post.spike`` the definition itself is told."""
        in_use = [(one.rule, one.signals) for one in self.rules]
        if self.synapse is not None:
            in_use.append((self.synapse, {}))
        for definition, signals in in_use:
            read = reads(definition, [state.derivative for state in (*definition.state, *definition.gives)])
            names = [*self._spikes(read - {*AT_SPIKE.values()}, source, target)]
            names += [name for name in sorted(read & signals.keys()) if self._is_spike(signals[name])]
            if names:
                act = _ACTS.get(names[0].partition(".")[0], "each_step")
                act = "each_step" if act == "on_post" and definition.kind != RULE else act
                reads_it = f"the {definition.kind.name} '{definition.name}' reads '{names[0]}', which is one,"
                return f"{reads_it} in a derivative", f"read it in '{act}'"
        return None

    def _is_spike(self, signal: Signal) -> bool:
        """Whether a signal of a rule is a spike of any neuron, or made of one."""
        of = self.models.of
        states = np.logical_or.reduce([np.zeros(len(signal.places), dtype=np.bool_), *signal.states.values()])
        taken = {MODEL.gives: (signal.places < len(of)) & ~states, **signal.states}
        return any(
            reads_spike(self.models.different[model], name)
            for name, which in taken.items()
            for model in np.unique(of[signal.places[which]]).tolist()
        )

    def _in_signal(self, synapse: Definition, source: Definition, target: Definition | None) -> Iterator[str]:
        """The names by which the signal of a synapse reads spikes of the source, and of the target, if it is given."""
        return self._spikes(reads(synapse, [synapse.given.each_step]), source, target)

    def _spikes(self, read: frozenset[str], source: Definition, target: Definition | None) -> Iterator[str]:
        """Those of some names in a definition that are spikes of an end, or made of one."""
        for name in sorted(read):
            end, _, of_model = name.partition(".")
            if end in ("pre", "sent") and reads_spike(source, of_model or sent_by(source, self.route.sends)):
                yield name
            if end == "post" and target is not None and reads_spike(target, of_model or MODEL.gives):
                yield name
