"""A network as plain data: what ``neurovis inspect --format json`` prints.

In: a Network, and the layout engine with the reason for it. Out: a dict of plain values.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import NamedTuple

from neurovis_spec.body import BodyError, Port, open_body
from neurovis_spec.compiler.network import Input, Network
from neurovis_spec.compiler.program import RULE, SYNAPSE


def describe(network: Network, engine: tuple[str, str]) -> dict[str, object]:
    """The object of ``inspect``: keys and shapes as the contract states them."""
    names = network.neurons.names
    sensed = set() if network.body is None else {one.input for one in network.body.sensed}
    return {
        "name": network.name,
        "dt": network.dt,
        "steps": network.steps,
        "seed": network.seed,
        "parameters": dict(network.parameters),
        "neurons": _neurons(network),
        "connections": _connections(network),
        "inputs": [
            {
                "name": entry.name,
                "size": entry.size,
                "source": "sensors" if index in sensed else _source(entry),
                **({"hold": True} if entry.hold else {}),
            }
            for index, entry in enumerate(network.inputs)
        ],
        "outputs": [
            {"name": entry.name, "neurons": [names[neuron] for neuron in entry.neurons.tolist()]}
            | ({"states": list(network.state_names(entry.states))} if entry.states else {})
            for entry in network.outputs
        ],
        **_integration(network),
        "engine": {"name": engine[0], "reason": engine[1]},
        "hash": network.hash,
        **({} if network.body is None else {"body": _body(network)}),
    }


def _neurons(network: Network) -> list[dict[str, object]]:
    owners = [group for group in network.neurons.groups for _ in range(group.count)]
    return [
        {
            "name": name,
            "group": group.name,
            "module": group.module,
            "activation": group.activation,
            "model": group.model,
            "combine": group.combine,
            "bias": bias,
        }
        for name, group, bias in zip(network.neurons.names, owners, network.neurons.bias.tolist(), strict=True)
    ]


def _connections(network: Network) -> list[dict[str, object]]:
    names, connections = network.neurons.names, network.connections
    routes, synapses = _routes(network), _synapses(network)
    twins = () if connections.twins is None else connections.twins.tolist()
    return [
        {"from": names[source], "to": names[target], "weight": weight, "delay": delay, "rule": rule}
        | (routes[entry] if routes else {})
        | ({"synapse": synapses[entry]} if synapses else {})
        | ({"symmetric": twins[index] >= 0} if twins else {})
        for index, (source, target, weight, delay, rule, entry) in enumerate(
            zip(
                connections.sources.tolist(),
                connections.targets.tolist(),
                connections.weights.tolist(),
                connections.delays.tolist(),
                _rules(network),
                connections.entry.tolist(),
                strict=True,
            )
        )
    ]


def _rules(network: Network) -> list[str | None]:
    """The rule of each connection by its name, or several in their order; None for one that does not learn."""
    result: list[str | None] = [None] * len(network.connections)
    rules = [one for one in network.projections if one.kind == RULE]
    for one in sorted(rules, key=lambda one: one.place):
        for connection in one.members.tolist():
            before, name = result[connection], one.use.definition.name
            result[connection] = name if before is None else f"{before} + {name}"
    return result


def _routes(network: Network) -> list[dict[str, object]]:
    """By entries what connections take and where they bring it, where any does as no other says."""
    return [{"sends": route.sends or None, "ports": dict(route.ports)} for route in network.connections.routes]


def _synapses(network: Network) -> list[str | None]:
    """By entries the synapses of connections by name, where any has one."""
    result: list[str | None] = [None] * len(network.connections.entries)
    for one in network.projections:
        for entry in set(network.connections.entry[one.members].tolist()) if one.kind == SYNAPSE else ():
            result[entry] = one.use.definition.name
    return result if any(result) else []


def _integration(network: Network) -> dict[str, object]:
    """How states are integrated, where there are some with a derivative."""
    by = network.integration
    return {} if by is None else {"integrate": {"method": by.method, "substeps": by.substeps}}


class Wired(NamedTuple):
    """The sensors of a body, each with the inputs that take of it, and its actuators, each with its commands."""

    sensors: tuple[tuple[Port, tuple[str, ...]], ...]
    actuators: tuple[tuple[Port, Mapping[str, str]], ...]


def wired(network: Network) -> Wired | None:
    """What of its body a network senses and moves; None where the body cannot be opened: what it needs is missing."""
    settings = network.body
    assert settings is not None
    try:
        body = open_body(settings.kind, settings.given, settings.path, network.dt, settings.substeps)
    except BodyError:
        return None
    taken = [(name, network.inputs[one.input].name) for one in settings.sensed for name in one.sensors]
    told = [(one.actuator, one.text) for one in settings.moved]
    return Wired(
        tuple((port, tuple(dict.fromkeys(of for name, of in taken if _is_of(name, port)))) for port in body.sensors),
        tuple((port, {name: text for name, text in told if _is_of(name, port)}) for port in body.actuators),
    )


def _body(network: Network) -> dict[str, object]:
    """The body, its ports null where they are not known."""
    settings, found = network.body, wired(network)
    assert settings is not None
    sensors = found and [{**_port(port), "inputs": list(inputs)} for port, inputs in found.sensors]
    actuators = found and [{**_port(port), **_range(port), "commands": told} for port, told in found.actuators]
    about = {"kind": settings.kind, "given": settings.given, "substeps": settings.substeps}
    return {**about, "sensors": sensors, "actuators": actuators}


def _port(port: Port) -> dict[str, object]:
    return {"name": port.name, "size": port.size, "unit": port.unit}


def _range(port: Port) -> dict[str, object]:
    return {key: bound if isfinite(bound) else None for key, bound in (("low", port.low), ("high", port.high))}


def _is_of(name: str, port: Port) -> bool:
    """Whether a name is that of a sensor or an actuator, or of one number of it."""
    return name == port.name or name in port.numbers


def _source(entry: Input) -> str:
    if entry.spikes is not None:
        return "spikes"
    if entry.is_drawn:
        return "poisson"
    return "expression" if entry.expression is not None else "table" if entry.table is not None else "external"
