"""The overview of a compiled network: what ``neurovis inspect`` prints for people.

In: a compiled network. Out: a text: tables of groups, connections by entry, inputs and outputs, the connection matrix
of a small network (Eq. 11), the choices made and the hash.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from neurovis_spec.cli.files import count
from neurovis_spec.cli.tables import number, spread, table
from neurovis_spec.compiler.flows import ports_read_by
from neurovis_spec.compiler.network import PLAIN_ROUTE
from neurovis_spec.compiler.program import (
    FEED,
    JOINING,
    RULE,
    Advance,
    Definition,
    Diffuse,
    Hidden,
    Integrate,
    Learn,
    Operation,
    Receive,
    SendAhead,
    Softmax,
    Update,
)
from neurovis_spec.describe import wired
from neurovis_spec.diagnostics import printable
from neurovis_spec.runtime.stages import acts_now, taken_by

if TYPE_CHECKING:
    from neurovis_spec.arrays import IntArray
    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.compiler.body_settings import BodySettings
    from neurovis_spec.compiler.network import Connections, Group, Input, Network, Route

#: The largest network whose connection matrix is shown, in neurons.
_MATRIX = 24
_OF_GROUPS = ("group", "neurons", "size", "activation", "model", "combine", "bias", "input", "box")
_OF_ENTRIES = ("entry", "number", "symmetric", "weight", "delay", "port", "sends", "synapse", "rule", "bounds")


def overview(compiled: CompiledNetwork) -> str:
    """All of it, paragraph by paragraph."""
    network = compiled.network
    return "\n\n".join(part for part in _parts(compiled, network) if part)


def _parts(compiled: CompiledNetwork, network: Network) -> Iterator[str]:
    yield _head(network)
    if network.parameters:
        written = compiled.spec.parameters
        units = {name: one.unit.value for name, one in written.items() if one.unit is not None}
        values = [(name, _in_unit(number(value), units.get(name))) for name, value in network.parameters.items()]
        yield "parameters\n" + table(values)
    of_definitions = _units(network)
    groups = [_group(network, group, of_definitions) for group in network.neurons.groups]
    yield "neurons\n" + table(*_without_empty(groups, _OF_GROUPS))
    if len(network.connections):
        yield "connections\n" + table(*_without_empty(_entries(network), _OF_ENTRIES))
    yield _program(network)
    if network.inputs:
        sensed = set() if network.body is None else {one.input for one in network.body.sensed}
        inputs = [_input(entry, index in sensed) for index, entry in enumerate(network.inputs)]
        yield "inputs\n" + table(inputs, ("name", "size", "source"))
    if network.outputs:
        names = network.neurons.names
        outputs = [
            (o.name, _few([*network.state_names(o.states)] or [names[i] for i in o.neurons.tolist()]))
            for o in network.outputs
        ]
        yield "outputs\n" + table(outputs, ("name", "of"))
    if network.body is not None:
        yield from _body(network, network.body)
    yield _matrix(network)
    yield _files(compiled)
    choices = [("layout engine", *compiled.choose_engine()), ("backend", *compiled.choose_backend())]
    yield "choices\n" + table([(what, f"{name}: {why}") for what, name, why in choices])
    yield f"hash {network.hash}"


def _files(compiled: CompiledNetwork) -> str:
    """What was found in files by looking at them."""
    base = compiled.request.base
    found = [(os.path.relpath(path, base), about) for path, about in sorted(compiled.files.items()) if about]
    return "files\n" + table(found) if found else ""


def _head(network: Network) -> str:
    """The name, the sizes and the clock."""
    dt, unit = network.shown_dt or (network.dt, "s")
    plastic = int((network.connections.rules.whole() >= 0).sum())
    lines = [
        f"{network.name}: {network.title}" if network.title != network.name else network.name,
        f"{count(len(network.neurons), 'neuron')}, {count(len(network.connections), 'connection')}"
        + (f", {plastic:,} of them learning" if plastic else ""),
        f"dt {number(dt)} {unit}, {count(network.steps, 'step')} ({number(dt * network.steps)} {unit})"
        + (f", episodes of {count(network.episode, 'step')}" if network.episode is not None else "")
        + f", seed {network.seed}",
    ]
    return "\n".join(printable(line) for line in lines)


def _units(network: Network) -> Mapping[tuple[str, str], Mapping[str, str]]:
    """The units of parameters, by kinds and names of definitions."""
    return {(use.definition.kind.name, use.definition.name): dict(use.definition.units) for _, use in network.uses}


def _group(network: Network, group: Group, units: Mapping[tuple[str, str], Mapping[str, str]]) -> tuple[str, ...]:
    names = network.neurons.names[group.start : group.start + group.count]
    return (
        group.name,
        _range(names),
        str(group.count),
        _defined(group.activation, group.activation_parameters, units["activation", group.activation]),
        _defined(group.model, group.model_parameters, units["model", group.model]),
        group.combine,
        ", ".join((spread(network.neurons.bias[list(group.indices)].tolist()), *_port_biases(network, group))),
        ", ".join(filter(None, (group.input, *_port_inputs(network, group)))),
        group.box or "",
    )


def _port_biases(network: Network, group: Group) -> Iterator[str]:
    """The biases at ports other than drive."""
    for port, bias in network.neurons.port_bias.items():
        if bias[list(group.indices)].any():
            yield f"{port} {spread(bias[list(group.indices)].tolist())}"


def _port_inputs(network: Network, group: Group) -> Iterator[str]:
    """The inputs at ports other than drive."""
    for port, places in network.neurons.port_input.items():
        place = int(places[group.start])
        yield from (f"{port} {one.name}" for one in network.inputs if 0 <= place - one.start < one.size and place >= 0)


def _defined(name: str, parameters: Mapping[str, tuple[float, ...]], units: Mapping[str, str]) -> str:
    """A definition in use, with the values of its parameters."""
    given = ", ".join(f"{key}={_in_unit(spread(values), units.get(key))}" for key, values in parameters.items())
    return f"{name}({given})" if given else name


def _in_unit(value: str, unit: str | None) -> str:
    return value if unit is None else f"{value} {unit}"


def _range(names: tuple[str, ...]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"


def _few(names: list[str], most: int = 12) -> str:
    return " ".join(names[:most]) + (" …" if len(names) > most else "")


def _entries(network: Network) -> list[tuple[str, ...]]:
    connections = network.connections
    entry = connections.entry.compact()
    return [
        _entry(connections, index, route, np.flatnonzero(entry == index))
        for index, route in enumerate(connections.each_route)
    ]


def _entry(connections: Connections, index: int, route: Route, members: IntArray) -> tuple[str, ...]:
    name = connections.entries[index]
    if not len(members):
        return name, "0", *[""] * (len(_OF_ENTRIES) - 2)
    return (
        name,
        f"{len(members):,}",
        "both ways" if connections.twins is not None and connections.twins[members[0]] >= 0 else "",
        spread(connections.weights[members].tolist()),
        _delays(connections, members),
        "" if route.ports == PLAIN_ROUTE.ports else ", ".join(map(_port, route.ports)),
        route.sends,
        (connections.synapses[index] if connections.synapses else None) or "",
        connections.learns[index] or "",
        _bounds(float(connections.low[members[0]]), float(connections.high[members[0]])),
    )


def _delays(connections: Connections, members: IntArray) -> str:
    """Delays in steps, and those that are continuous as they are exactly."""
    delays = connections.delays[members]
    low, high = int(delays.min()), int(delays.max())
    steps = str(low) if low == high else f"{low} … {high}"
    lags = np.zeros(0) if connections.lags is None else connections.lags[members]
    late = lags[~np.isnan(lags)]
    if not len(late):
        return steps
    least, most = number(float(late.min())), number(float(late.max()))
    exact = least if least == most else f"{least} … {most}"
    return exact if len(late) == len(delays) else f"{steps}; between steps {exact}"


def _port(of_route: tuple[str, float]) -> str:
    name, factor = of_route
    return name if factor == 1 else f"{number(factor)}·{name}"


def _program(network: Network) -> str:
    """The order of a step where states flow, or synapses have states: what is integrated together, and what of it is
    held."""
    if network.integration is None and not any(isinstance(one, Receive | Advance) for one in network.program):
        return ""
    rows = [row for operation in network.program for row in _rows(network, operation)]
    reached: dict[str, set[str]] = {}
    for one in () if network.integration is None else network.integration.populations:
        for name, how in _into_derivatives(network, one):
            reached.setdefault(how, set()).add(name)
    for name, how in _spikes(network):
        reached.setdefault(how, set()).add(name)
    reached["delay 0 by default"] = {network.connections.entries[entry] for entry in network.connections.undelayed}
    told = [
        (how, ", ".join(name for name in network.connections.entries if name in reached[how]))
        for how in (_ANEW, _FORMED, _BETWEEN, _HELD, _BEFORE, _BEHIND, "delay 0 by default")
        if reached.get(how)
    ]
    return "\n".join(["program", table(rows), *([table(told)] if told else [])])


def _rows(network: Network, operation: Operation) -> Iterator[tuple[str, str, str]]:
    """What an operation does, to whom, and how."""
    match operation:
        case Update(population=one):
            yield "update", _members(network, one), ""
        case Softmax(population=one):
            yield "softmax", _members(network, one), ""
        case Advance(population=one, phase=phase):
            changing = _changed(network.populations[one].model.definition.during([phase]))
            yield _PHASES.get(phase, phase), _members(network, one), changing
        case Learn(projection=one, phases=phases) if _wait_for_spikes(network):
            projection = network.projections[one].during(phases)
            yield ", ".join(phases), _connected(network, one), _changed(projection.use.definition)
        case Integrate(populations=several, method=method, substeps=substeps, projections=connected):
            how = method + (f", {count(substeps, 'substep')} a step" if substeps > 1 else "")
            for one in several:
                yield "integrate", _members(network, one), _flows(network.populations[one].model.definition, how)
            for one in connected:
                yield "integrate", _connected(network, one), _flows(network.projections[one].use.definition, how)
        case Receive(projection=one, phases=phases):
            definition = network.projections[one].during(phases).use.definition
            if once := _changed(definition if definition.kind == FEED else replace(definition, gives=())):
                yield "on_pre" if "on_pre" in phases else "receive", _connected(network, one), once
        case SendAhead(population=one, names=names):
            yield "send ahead", _members(network, one), ", ".join(names)
        case Diffuse(populations=several):
            for one in several:
                flows = network.populations[one].model.definition.flows
                yield "noise", _members(network, one), ", ".join(state.name for state in flows if state.noise)


def _wait_for_spikes(network: Network) -> bool:
    """Whether any rule does, so that the order of all counts."""
    return any(one.kind == RULE and one.use.definition.acts for one in network.projections)


def _changed(made: Definition) -> str:
    """The names of what changes once a step of a definition."""
    changing = (one for one in (*made.state, *(made.gives if made.kind.lasting else ())) if not isinstance(one, Hidden))
    return ", ".join(one.name for one in changing if one.stepped or (one in made.gives and one.derivative is not None))


def _spikes(network: Network) -> Iterator[tuple[str, str]]:
    """The entries that bring spikes, and when these count."""
    spikes, names = network.spikes, network.connections.entries
    for population in network.populations if spikes.any() else ():
        for port in population.ports:
            now = acts_now(port)
            come = spikes[taken_by(network)[port.incoming]] & (network.synapses.numbers[port.incoming] < 0)
            for how, some in ((_BEFORE, come & ~now), (_BEHIND, now)):
                for entry in np.unique(network.connections.entry[port.incoming[some]]).tolist():
                    yield names[entry], how
    for one in network.projections:
        if one.kind in JOINING and one.use.definition.has("on_pre"):
            for entry in np.unique(network.connections.entry[one.members]).tolist():
                yield names[entry], _BEHIND if one.at_once else _BEFORE


def _connected(network: Network, projection: int) -> str:
    """The entries whose connections are of a projection."""
    found = set(network.connections.entry[network.projections[projection].members].tolist())
    return ", ".join(name for number, name in enumerate(network.connections.entries) if number in found)


def _members(network: Network, population: int) -> str:
    """The neurons of a population, by groups where these are whole."""
    members = set(network.populations[population].members.tolist())
    named: list[str] = []
    for group in network.neurons.groups:
        inside = [neuron for neuron in group.indices if neuron in members]
        named += [group.name] if len(inside) == group.count else [network.neurons.names[neuron] for neuron in inside]
    return _few(named)


def _flows(definition: Definition, how: str) -> str:
    """What is integrated by a definition; where it has no such states what it sends is made at each stage."""
    states = [state.name for state in definition.flows]
    return f"{', '.join(states)} ({how})" if states else "what it sends, at each stage"


#: What phases of models are called that are not called by a key of the language.
_PHASES: Final = {"jump_now": "jump, behind all spikes"}
#: When spikes count.
_BEFORE, _BEHIND = "spikes that arrive before the threshold is tested", "spikes that act behind all of their step"

#: What becomes of what connections bring to derivatives.
_ANEW, _FORMED, _BETWEEN, _HELD = (
    "made anew at each stage",
    "formed at each stage, of what was sent before",
    "read between steps",
    "held over a step",
)


def _into_derivatives(network: Network, population: int) -> Iterator[tuple[str, str]]:
    """The entries that reach derivatives of a population, and what becomes of what they bring: a synapse forms its
    signal at each stage, and what it reads of its source is held where it has a delay."""
    one, connections = network.populations[population], network.connections
    read = ports_read_by(one.model.definition).flow
    for port in (port for port in one.ports if port.name in read):
        anew = np.zeros(len(port.incoming), dtype=np.bool_)
        anew[[] if port.staged is None else port.staged] = True
        delayed, late = connections.delays[port.incoming] > 0, np.zeros(len(anew), dtype=np.bool_)
        if connections.lags is not None:
            late = ~np.isnan(connections.lags[port.incoming])
        before = anew & delayed & ~late
        for how, some in ((_ANEW, anew & ~delayed), (_FORMED, before), (_BETWEEN, anew & late), (_HELD, ~anew)):
            for entry in np.unique(connections.entry[port.incoming[some]]).tolist():
                yield connections.entries[entry], how


def _bounds(low: float, high: float) -> str:
    return "" if low == -np.inf and high == np.inf else f"{number(low)} … {number(high)}"


def _input(entry: Input, is_sensed: bool) -> tuple[str, str, str]:
    source = "external"
    if is_sensed:
        source = "sensors"
    elif entry.expression is not None:
        source = "poisson" if entry.is_drawn else "expression, once a step" if entry.hold else "expression"
    elif entry.table is not None:
        source = f"table of {count(len(entry.table), 'row')}"
    elif entry.spikes is not None:
        source = count(len(entry.spikes.times), "spike")
    return entry.name, str(entry.size), source


def _body(network: Network, settings: BodySettings) -> Iterator[str]:
    """The body, and what of it is sensed and moved."""
    steps = "" if settings.substeps is None else f", {count(settings.substeps, 'substep')} a step"
    head = f"body\n  {printable(f'{settings.kind}: {settings.given}')}{steps}"
    found = wired(network)
    if found is None:
        yield f"{head}\n  it cannot be opened here: its sensors and actuators are not known"
        return
    yield head
    if found.sensors:
        rows = [(port.name, str(port.size), port.unit, " ".join(inputs)) for port, inputs in found.sensors]
        yield "sensors\n" + table(rows, ("name", "size", "unit", "input"))
    if found.actuators:
        told = [
            (port.name, str(port.size), port.unit, _bounds(port.low, port.high), _commands(port.name, commands))
            for port, commands in found.actuators
        ]
        yield "actuators\n" + table(told, ("name", "size", "unit", "range", "command"))


def _commands(actuator: str, commands: Mapping[str, str]) -> str:
    return ", ".join(text if name == actuator else f"{name}: {text}" for name, text in commands.items())


def _matrix(network: Network) -> str:
    """C of Eq. 11: 1 where a connection leads from the row's neuron to the column's; more where several do."""
    size = len(network.neurons)
    if size > _MATRIX or not len(network.connections):
        return ""
    matrix = np.zeros((size, size), dtype=np.int64)
    np.add.at(matrix, (network.connections.sources.whole(), network.connections.targets.whole()), 1)
    names = network.neurons.names
    rows = [(name, *(str(c) if c else "·" for c in row)) for name, row in zip(names, matrix.tolist(), strict=True)]
    return "connection matrix C (from row to column)\n" + table(rows, ("", *names), right=True)


def _without_empty(rows: Sequence[Sequence[str]], header: Sequence[str]) -> tuple[list[list[str]], list[str]]:
    """Without the columns that say nothing."""
    kept = [column for column in range(len(header)) if any(row[column] for row in rows)]
    return [[row[column] for column in kept] for row in rows], [header[column] for column in kept]
