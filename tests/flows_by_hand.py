"""Networks with derivatives, lowered by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from networks_by_hand import tree

from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import (
    MODEL,
    Definition,
    Diffuse,
    Gather,
    Integrate,
    Learn,
    Operation,
    Quantity,
    ReadInputs,
    Send,
    Update,
)
from neurovis_spec.language.words import Method


def flowing(
    activity: str,
    derivatives: Mapping[str, tuple[str, str]],
    parameters: Sequence[str] = (),
    let: Mapping[str, str] | None = None,
    outputs: Mapping[str, str] | None = None,
    per_second: float = 1.0,
    noise: Mapping[str, str] | None = None,
) -> Definition:
    """A model of states with derivatives: by name an initial value and a derivative."""
    state = tuple(
        Quantity(
            name,
            initial=tree(initial),
            derivative=tree(text),
            noise=tree(noise[name]) if noise and name in noise else None,
        )
        for name, (initial, text) in derivatives.items()
    )
    gives = [Quantity("activity", tree(activity)), *(Quantity(n, tree(t)) for n, t in (outputs or {}).items())]
    lets = tuple((name, tree(text)) for name, text in (let or {}).items())
    return Definition(
        MODEL, activity + repr(derivatives), tuple(parameters), tuple(gives), lets, state, per_second=per_second
    )


def integrated(network: Network, method: Method = "rk4", substeps: int = 1) -> Network:
    """The network with its flow integrated: connections without delay from a model that flows are made anew at each
    stage; maps that are not reached by what flows come before."""
    sources, delays = network.connections.sources.whole(), network.connections.delays.whole()
    flows = [bool(one.model.definition.flows) for one in network.populations]
    of_neuron = np.zeros(len(network.neurons), dtype=np.bool_)
    for one, does in zip(network.populations, flows, strict=True):
        of_neuron[one.members] = does
    populations = []
    for one, does in zip(network.populations, flows, strict=True):
        staged = [np.flatnonzero((delays[p.incoming] == 0) & of_neuron[sources[p.incoming]]) for p in one.ports]
        ports = tuple(
            replace(port, staged=places if does and len(places) else None)
            for port, places in zip(one.ports, staged, strict=True)
        )
        populations.append(replace(one, ports=ports))
    numbers = tuple(number for number, does in enumerate(flows) if does)
    before = [number for number, does in enumerate(flows) if not does]
    noisy = tuple(number for number in numbers if any(s.noise for s in populations[number].model.definition.state))
    program: list[Operation] = [ReadInputs()]
    for number in before:
        program += [Gather(number), Update(number)]
    program.append(Integrate(numbers, method, substeps))
    program += [Diffuse(noisy)] if noisy else []
    for number in numbers:
        program += [Gather(number), Update(number)]
    program += [Send(), *(Learn(number) for number in range(len(network.projections)))]
    return replace(network, populations=tuple(populations), program=tuple(program))
