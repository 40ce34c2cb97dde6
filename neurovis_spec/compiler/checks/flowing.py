"""What is legal and makes the integration of states worse than its method is.

In: what a spec without errors became, in which states flow. Out: warnings: at connections that hold over a step what
could be made anew at each stage, at noise that is held, and at a step that is too long for what decays fastest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from neurovis_spec.arrays import BoolArray, Indices, integers
from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.checks.neurons import unreached
from neurovis_spec.compiler.connections.connect import Connected
from neurovis_spec.compiler.flows import plain_flow, ports_read_by, reads, sent_by
from neurovis_spec.compiler.levels import Cycle, held_at, made_anew, order_of
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.neurons.groups import Built
from neurovis_spec.compiler.program import DRIVE, SYNAPSE, Definition, EndName
from neurovis_spec.compiler.stiffness import stiffest_at_begin
from neurovis_spec.compiler.taken import Side, Wired, read_at, reads_past
from neurovis_spec.diagnostics import Findings, Span, listed
from neurovis_spec.language.expressions.derivative import as_derivative
from neurovis_spec.language.library import StateModel
from neurovis_spec.language.words import Method

#: What to do where connections have different delays, one step among them.
_IN_SECONDS: Final = "write them in seconds, which are not rounded: delay: {seconds: …}"
#: Methods of an order above 1.
_HIGHER: Final = frozenset(("heun", "rk4"))


def check_flowing(compiled: Compiled, findings: Findings) -> None:
    """Warn of what makes an integration worse than it could be. Most specs have none."""
    by = compiled.network.integration
    if by is None:
        _nothing_flows(compiled, findings)
        return
    if by.method in _HIGHER:
        _held_couplings(compiled, by.method, findings)
    _held_noise(compiled, findings)
    _held_events(compiled, findings)
    _steps_by_hand(compiled, by.method, findings)
    _stiff(compiled, findings)


def _nothing_flows(compiled: Compiled, findings: Findings) -> None:
    """``integrate`` where no state has a derivative."""
    time = compiled.spec.time
    entry = None if time is None else time.source.entry("integrate")
    if entry is not None:
        message = "'integrate' changes nothing: no neuron here has a state with a 'derivative'"
        findings.warning("no-effect", entry.key.span, message, "remove it, or take a model that has one")


def _held_couplings(compiled: Compiled, method: Method, findings: Findings) -> None:
    """Connections of delay 1 that bring to a derivative, by themselves or through neurons without one, what would flow
    with delay 0."""
    network, census, made = compiled.network, compiled.census, compiled.network.connections
    delays = made.delays.whole()
    lagging = None if made.lags is None else ~np.isnan(made.lags.whole())
    of_one_step = delays == 1 if lagging is None else (delays == 1) & ~lagging
    if not of_one_step.any():
        return
    shorter = integers(np.where(of_one_step, 0, delays))
    wired = replace(Connected(compiled.bundles, complete=True).wired, delays=shorter, timed=lagging)
    held = held_at(network.neurons, network.inputs, network.noises)
    would = of_one_step & made_anew(census.models.different, census.models.of, wired, held)
    would &= _varying(network, wired)[wired.sources.compact()]
    if not would.any():
        return
    entry, told = wired.entry.compact(), set[Span]()
    mended = replace(wired, delays=integers(np.where(would, 0, delays)))
    hint = "write delay: 0"
    if isinstance(order_of(census.models.different, census.models.of, mended, held), Cycle):
        hint += ", but not all around a loop whose neurons send what reads a port"
    for number in np.unique(entry[would]).tolist():
        bundle = compiled.bundles[number]
        synapse = None if bundle.synapse is None else bundle.synapse.definition
        body = compiled.entries[bundle.key].body
        span = bundle.key if body.delay is None else body.delay.span
        if span in told or (synapse is not None and not reads_past(synapse)):
            continue
        told.add(span)
        first = np.flatnonzero(would & (entry == number))[0]
        start, end = (int(census.models.of[ends.compact()[first]]) for ends in (wired.sources, wired.targets))
        some = bool((delays[entry == number] != 1).any())
        whose, its = (f"one of '{bundle.name}'", "that") if some else (f"'{bundle.name}'", "its")
        message = f"{whose} has a delay of one step, over which {method} holds {its} signal: its order is 1 then"
        if body.delay is None and census.models.delay(start, end, bundle.route, synapse) == 1:
            source, target = (census.models.different[model] for model in (start, end))
            message += f". That is the default, since {_why_held(source, bundle.route.sends, target, synapse)}"
        findings.warning("held-coupling", span, message, _IN_SECONDS if some and body.delay is not None else hint)


def _why_held(source: Definition, sends: str, target: Definition, synapse: Definition | None) -> str:
    """Why a connection has a delay of one step by default."""
    if not source.flows:
        return f"the model '{source.name}' of its source has no derivative"
    if synapse is not None:
        read = next((name for name in read_at("pre", synapse, sends) if not plain_flow(source, name)), None)
        if read is None:
            return "its synapse waits for spikes"
        what_is_sent = [name for name in ("pre", "sent") if name in synapse.read and read == sends]
        text = next(iter(what_is_sent), EndName("pre", read).text)
        return f"its synapse reads {text}, which in the model '{source.name}' of its source does not flow by itself"
    if plain_flow(source, sends):
        return f"no derivative of the model '{target.name}' of its target reads it"
    return f"the model '{source.name}' of its source sends what reads a port"


def _varying(network: Network, wired: Wired) -> BoolArray:
    """For each neuron whether anything changes what it sends in a run: a state, an input, the time, or such a neuron
    before it."""
    neurons = network.neurons
    result: BoolArray = neurons.input >= 0
    for given in neurons.port_input.values():
        result |= given >= 0
    for population in network.populations:
        model = population.model.definition
        if model.state or not model.read.isdisjoint(("t", "k")):
            result[population.members] = True
    return ~unreached(~result, wired.sources.compact(), wired.targets.compact())


def _held_noise(compiled: Compiled, findings: Findings) -> None:
    """Noise of groups that a derivative reads, by itself or in what a synapse reads of these groups."""
    told, through, begin = set[Span](), None, 0
    for one in compiled.census.groups:
        model, members = one.kind.model.definition, slice(begin, begin := begin + len(one.bias))
        read = ports_read_by(model)
        for port, formula, _ in one.noises:
            if formula.span in told:
                continue
            if port in read.flow:
                reader = f"a derivative of '{model.name}' reads it"
            else:
                through = _read_by_synapses(compiled) if through is None else through
                outputs = [name for name, ports in read.outputs.items() if port in ports and name in through]
                if not any(through[name][members].any() for name in outputs):
                    continue
                reader = f"a derivative reads it through a synapse, in what '{model.name}' makes of it"
            told.add(formula.span)
            message = f"this noise is held over each step, and {reader}: its effect"
            hint = "give the state a 'noise' of its own, which is scaled by the root of the step"
            findings.warning("noise-held", formula.span, f"{message} becomes less with a shorter step", hint)


def _held_events(compiled: Compiled, findings: Findings) -> None:
    """Inputs that count events, at ports that a derivative reads which does not divide by the length of a step."""
    inputs = [one for one in compiled.network.inputs if one.counts]
    counts = {place for one in inputs for place in range(one.start, one.start + one.size)}
    told = set[Span]()
    for group in compiled.census.groups if inputs else ():
        model, given = group.kind.model.definition, {DRIVE: group.input, **group.port_input}
        read = [reads(model, [state.derivative]) for state in model.flows]
        held = frozenset[str]().union(*(names for names in read if "dt" not in names))
        for written, at in group.model.input or ():
            port = DRIVE if at is None else at.value
            if port not in held or written.span in told or int(given[port][0]) not in counts:
                continue
            told.add(written.span)
            message = f"'{written.value}' counts events, and a derivative of '{model.name}' reads '{port}':"
            message += " what an event adds is in proportion to 'dt'"
            jumps = sorted(ports_read_by(model).jump - held)
            hint = "let a state 'jump' by a port of its own, which adds the count once"
            if jumps:
                hint = f"a state jumps by {listed(jumps)}: write input: {{{jumps[0]}: {written.value}}}"
            findings.warning("events-held", written.span, message, hint)


def _read_by_synapses(compiled: Compiled) -> dict[str, BoolArray]:
    """By activities and outputs for each neuron whether a synapse reads that of it and brings it to a derivative, of
    its target or of its own."""
    models, result = compiled.census.models, dict[str, BoolArray]()
    derived = [ports_read_by(model).flow for model in models.different]
    for bundle in compiled.bundles:
        if bundle.synapse is None:
            continue
        synapse, ports = bundle.synapse.definition, {port for port, _ in bundle.route.ports}
        brings = np.array([bool(synapse.flows) or not ports.isdisjoint(read) for read in derived], dtype=np.bool_)
        used = brings[models.of[bundle.targets]]
        ends: tuple[tuple[Side, Indices], ...] = (("pre", bundle.sources[used]), ("post", bundle.targets[used]))
        for side, neurons in ends:
            for sends in read_at(side, synapse, bundle.route.sends):
                for number in np.unique(models.of[neurons]).tolist():
                    name = sent_by(models.different[number], sends)
                    found = result.setdefault(name, np.zeros(len(models.of), dtype=np.bool_))
                    found[neurons[models.of[neurons] == number]] = True
    return result


def _steps_by_hand(compiled: Compiled, method: Method, findings: Findings) -> None:
    """States that ``each_step`` takes by a step of the Euler method, in a network in which others are integrated. Where
    nothing flows all is as it always was: nobody is told to write it in another way."""
    groups: dict[str, list[Built]] = {}
    for one in compiled.census.groups:
        groups.setdefault(one.kind.model.definition.name, []).append(one)
    synapses = {one.use.definition.name for one in compiled.network.projections if one.kind == SYNAPSE}
    for library in compiled.libraries:
        for name, model in library.models.items():
            if name in groups:
                _tell_steps(model.state, method, any(one.model.initial is None for one in groups[name]), findings)
        for name, synapse in library.synapses.items():
            if name in synapses:
                _tell_steps(synapse.state, method, False, findings)


def _tell_steps(states: Mapping[str, StateModel], method: Method, begins: bool, findings: Findings) -> None:
    """The same of some states; ``begins``: whether each_step makes the value of step 0."""
    for state, written in states.items():
        step = written.each_step
        if step is None or not isinstance(step.value, str) or written.derivative is not None:
            continue
        if (flow := as_derivative(state, step.value)) is not None:
            message = f"this is a step of the Euler method by hand, beside what is integrated by {method}"
            hint = f"write derivative: {flow}"
            if begins:
                hint += "; it does nothing at step 0 then, where 'each_step' makes a step"
            findings.warning("step-by-hand", step.span, message, hint)


def _stiff(compiled: Compiled, findings: Findings) -> None:
    """A step that is too long for the state that decays fastest, as it begins."""
    network, time = compiled.network, compiled.spec.time
    if time is None or time.dt is None:
        return
    worst = stiffest_at_begin(network)
    if worst is not None:
        message, hint = worst.words(network)
        findings.warning("stiff-step", time.dt.span, f"{message}: the run will diverge", hint)
