"""Spikes on connections: what they may come to, and who has to fire.

In: an entry's synapse and rules, the models at both ends of its connections. Out: findings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from neurovis_spec.compiler.flows import ports_read_by, reads, reads_spike, sent_by
from neurovis_spec.compiler.network import Route
from neurovis_spec.compiler.program import Definition
from neurovis_spec.diagnostics import Findings, Span, listed


@dataclass(frozen=True)
class SpikeCheck:
    """Checks an entry, at the place of its key. ``pairs``: the models of sources and targets that it connects."""

    route: Route
    synapse: Definition | None
    rules: Sequence[Definition]
    pairs: Sequence[tuple[Definition, Definition]]
    key: Span
    findings: Findings

    def check(self, *, undelayed: bool) -> None:
        """Report spikes in derivatives, and those that a signal reads in the step in which they are fired, where any
        connection is ``undelayed``."""
        for source, target in self.pairs:
            reason = self._into_flow(source, target)
            if reason:
                message = f"a spike lasts no time, and {reason}: its effect would depend on dt"
                self.findings.error("spike-in-derivative", self.key, message, self._hint(target))
                return
            if undelayed and self.synapse is not None and self._in_signal(source, self.synapse):
                message = f"the signal of the synapse '{self.synapse.name}' reads a spike, which needs a delay of 1"
                self.findings.error("out-of-range", self.key, message, "write delay: 1, or leave it out")
                return

    def _into_flow(self, source: Definition, target: Definition) -> str:
        """Why what spikes bring is in a derivative; "" where it is not."""
        ports = [port for port, _ in self.route.ports if port in ports_read_by(target).flow]
        brings = reads_spike(source, self.route.sends)
        if self.synapse is not None:
            brings = self._in_signal(source, self.synapse)
        if brings and ports:
            return f"the model '{target.name}' of a target reads '{ports[0]}' in a derivative"
        for one in (*self.rules, *([] if self.synapse is None else [self.synapse])):
            derivatives = [state.derivative for state in (*one.state, *one.gives)]
            if any(reads_spike(source, name) for name in self._taken(source, reads(one, derivatives))):
                return f"the {one.kind.name} '{one.name}' reads what is one in a derivative"
        return ""

    def _in_signal(self, source: Definition, synapse: Definition) -> bool:
        """Whether the signal of a synapse reads a spike of the source."""
        read = reads(synapse, [synapse.given.each_step])
        return any(reads_spike(source, name) for name in self._taken(source, read))

    def _taken(self, source: Definition, read: frozenset[str]) -> Iterator[str]:
        """What of the source is read, by the names of its model."""
        if not read.isdisjoint(("pre", "sent")):
            yield sent_by(source, self.route.sends)
        yield from (name.removeprefix("pre.") for name in read if name.startswith("pre."))

    def _hint(self, target: Definition) -> str:
        """What to do about it."""
        if jumping := sorted(ports_read_by(target).jump):
            return f"what jumps by spikes there is at {listed([f'port: {port}' for port in jumping])}"
        return "let a state of the model 'jump' by a port, or use a synapse, such as exponential"
