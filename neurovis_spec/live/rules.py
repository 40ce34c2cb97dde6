"""Rules: the connections whose learning can be switched on and off in a run.

In: a network. Out: for each entry with a rule the reference that names its connections, its rule, and its members.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.references import Arrow, parse
from neurovis_spec.runtime.names import Found, names_of


@dataclass(frozen=True, slots=True, eq=False)
class Rule:
    """The rules at ``connections``, a reference: as they are written, and the ``members`` that they are of."""

    connections: str
    written: str
    members: IntArray


def rules(network: Network) -> tuple[Rule, ...]:
    """The rules in the order of the spec; what one reference names has one."""
    connections = network.connections
    found: dict[str, tuple[list[str], IntArray]] = {}
    for number, (name, written) in enumerate(zip(connections.entries, connections.learns, strict=True)):
        members = np.flatnonzero((connections.entry.whole() == number) & (connections.rules.whole() >= 0))
        if written is not None and len(members):
            reference = _reference(network, name, members)
            words, others = found.get(reference, ([], members[:0]))
            found[reference] = ([*words, written], np.union1d(others, members))
    return tuple(Rule(name, "; ".join(dict.fromkeys(words)), members) for name, (words, members) in found.items())


def carried_out(rules: Sequence[Rule], stopped: npt.NDArray[np.bool_]) -> dict[str, bool | None]:
    """Whether rules are carried out, by their connections, where those of some connections are ``stopped`` (m,); None
    where some are."""
    off = {rule.connections: stopped[rule.members] for rule in rules}
    return {name: None if some.any() and not some.all() else not some.any() for name, some in off.items()}


def _reference(network: Network, name: str, members: IntArray) -> str:
    """What names the connections of an entry; one of a module says the instance of its source alone."""
    plain = name.partition(" (")[0]
    arrow = parse(plain)
    assert isinstance(arrow, Arrow)
    source, target = arrow.sources.text, arrow.targets
    inside, _, _ = source.rpartition(".")
    known, wanted = names_of(network), set(network.connections.targets[members].tolist())
    for one in (target.text, " + ".join(f"{inside}.{part.text}" for part in target.parts)):
        ends = known.find(one)
        if isinstance(ends, Found) and wanted <= set(ends.neurons):
            return f"{source} -> {one}"
    return network.connection_names[int(members[0])] if len(members) == 1 else plain
