"""A network as plain data: what ``neurovis inspect --format json`` prints (§12).

In: a Network, and the layout engine with the reason for it. Out: a dict of plain values.
"""

from __future__ import annotations

from neurovis_spec.compiler.names.state_references import names_of_states
from neurovis_spec.compiler.network import Network


def describe(network: Network, engine: tuple[str, str]) -> dict[str, object]:
    """The object of ``inspect``: keys and shapes as the contract states them."""
    owners = [group for group in network.neurons.groups for _ in range(group.count)]
    names, connections = network.neurons.names, network.connections
    rules = [None if rule < 0 else network.plasticity[rule].rule.name for rule in connections.rules.tolist()]
    return {
        "name": network.name,
        "dt": network.dt,
        "steps": network.steps,
        "seed": network.seed,
        "parameters": dict(network.parameters),
        "neurons": [
            {
                "name": name,
                "group": group.name,
                "module": group.module,
                "activation": group.activation,
                "model": group.model,
                "combine": group.combine,
                "bias": bias,
            }
            for name, group, bias in zip(names, owners, network.neurons.bias.tolist(), strict=True)
        ],
        "connections": [
            {"from": names[source], "to": names[target], "weight": weight, "delay": delay, "rule": rule}
            for source, target, weight, delay, rule in zip(
                connections.sources.tolist(),
                connections.targets.tolist(),
                connections.weights.tolist(),
                connections.delays.tolist(),
                rules,
                strict=True,
            )
        ],
        "inputs": [
            {"name": entry.name, "size": entry.size, "source": _source(entry.expression, entry.table)}
            for entry in network.inputs
        ],
        "outputs": [
            {"name": entry.name, "neurons": [names[neuron] for neuron in entry.neurons.tolist()]}
            | ({"states": list(names_of_states(network, entry.states))} if entry.states else {})
            for entry in network.outputs
        ],
        "engine": {"name": engine[0], "reason": engine[1]},
        "hash": network.hash,
    }


def _source(expression: object, table: object) -> str:
    return "expression" if expression is not None else "table" if table is not None else "external"
