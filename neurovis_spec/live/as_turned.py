"""As turned: a network of which what was turned by hand is part of what changes in a run, as events of its spec are.

In: a network and what was turned. Out: the same network with more changes, for files: which weights a recording has row
by row, and what the legend of a picture tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import frozen
from neurovis_spec.compiler.events.changes import Change
from neurovis_spec.compiler.events.settable import ParameterFormula
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.expressions.tree import Number
from neurovis_spec.live.source import Turned
from neurovis_spec.live.turns import Lesion, Mend, Set
from neurovis_spec.runtime.names import names_of
from neurovis_spec.runtime.references import find_parts


def as_turned(network: Network, turned: Sequence[Turned]) -> Network:
    """The network with the parameters that were set by hand, and the lesions, among what changes; by its hash it is
    the one that it was."""
    changes, names = {change.at: change for change in network.changes}, names_of(network)
    for at, what in ((entry.step + 1, entry.turn) for entry in turned):
        before = changes.get(at, Change(at))
        if isinstance(what, Set):
            changes[at] = before._replace(parameters=(*before.parameters, *_parameters(network, what)))
        elif isinstance(what, Lesion | Mend):  # one that is mended before a step is made is none
            neurons, connections = find_parts(network, what.part, names)
            joined = np.union1d if isinstance(what, Lesion) else np.setdiff1d
            changes[at] = before._replace(
                lesioned_neurons=frozen(joined(before.lesioned_neurons, neurons)),
                lesioned_connections=frozen(joined(before.lesioned_connections, connections)),
            )
    if len(changes) == len(network.changes) and all(change is changes[change.at] for change in network.changes):
        return network
    return replace(network, changes=tuple(changes[at] for at in sorted(changes)))


def _parameters(network: Network, what: Set) -> tuple[tuple[int, ParameterFormula], ...]:
    slots = network.settable.index
    return tuple((slots[name], ParameterFormula(Number(value), {})) for name, value in what.values.items())
