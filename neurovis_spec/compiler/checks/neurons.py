"""Neurons that stay silent, and what a group is given that its model does not read.

In: what a spec without errors became. Out: warnings at the groups. Idle are the neurons that nothing reaches but
themselves or each other, that have no input, bias, initial value or noise, and that surely stay at 0 by their model and
activation (a cosine would not), whatever events set (a model whose formulas read the time is never reported). Neurons
that are idle only because all that drives them is idle are not reported: that follows from the others. A network
without a single connection is a sketch: of its neurons only those are reported that an output or a rule names.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import PIECE, Indices, IntArray, pieces, sorting, starts_of
from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.events.settable import bias_of
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.names.references import key_span
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.neurons.groups import NeuronType
from neurovis_spec.compiler.neurons.initial_states import beginning
from neurovis_spec.compiler.program import DRIVE, SYNAPSE, Definition, Population
from neurovis_spec.compiler.values.constants import NEAR_INTEGER
from neurovis_spec.compiler.values.spikes import steps_at_rest, still_fires
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.library import Library
from neurovis_spec.language.sections import GroupModel
from neurovis_spec.language.yaml.source import Mapping as SourceMapping

Mask = npt.NDArray[np.bool_]
#: So many steps from what is active are taken for all connections at once; what lies farther is followed by its ways.
_WHOLE_ARRAY_PASSES = 8
#: From so many neurons connections are followed one by one, from more together.
_FEW_ENOUGH_FOR_LOOP = 32
#: The keys of a group that make its drive
_DRIVING = ("input", "bias", "noise", "combine")


def check_neurons(compiled: Compiled, findings: Findings) -> None:
    """Warn of idle neurons, once for each group as it is written, and of what a model leaves out of account."""
    told = _warn_ignored(compiled, findings)
    _warn_firing_once(compiled, findings)
    _warn_rounded_rests(compiled, findings)
    if any(event.clamp for event in compiled.spec.events):
        return  # what is clamped is active from outside
    _warn_idle(compiled, told, findings)


def _warn_ignored(compiled: Compiled, findings: Findings) -> set[Span]:
    """Warn of what groups are given that their models do not read; the places of these warnings."""
    told: set[Span] = set()
    reads: dict[str, _Reads] = {}
    for neuron_type, written in compiled.models:
        model = neuron_type.model.definition
        read = reads.get(model.name) or reads.setdefault(model.name, _reads(model))
        for span, message, hint in _ignored(model, read, written):
            if span not in told:
                told.add(span)
                findings.warning("no-effect", span, message, hint)
    return told


def _warn_firing_once(compiled: Compiled, findings: Findings) -> None:
    """Warn of spikes behind which ``when`` still holds, by the parameters that a group gives its model: its neurons are
    not armed again before something else makes that false."""
    told: set[Span] = set()
    for neuron_type, written in compiled.models:
        model, span = neuron_type.model, _place_of_model(written)
        if span in told or not still_fires(model.definition, model.parameters, compiled.network.dt):
            continue
        told.add(span)
        message = f"with these parameters 'when' of the model '{model.definition.name}' still holds behind 'set'"
        hint = "a neuron fires once then, until 'when' has been false: let 'set' make it false, or leave it out"
        findings.warning("unreachable-spike", span, message, hint)


def _place_of_model(written: GroupModel) -> Span:
    return written.source.span if written.model is None else written.model.name.span


def _warn_rounded_rests(compiled: Compiled, findings: Findings) -> None:
    """Warn of refractory times that are no whole numbers of steps, where they are written, or where the group is whose
    parameters make them so."""
    told: set[Span] = set()
    for neuron_type, written in compiled.models:
        model, span = neuron_type.model.definition, _place_of_rest(neuron_type, written, compiled.libraries)
        exact = steps_at_rest(model, neuron_type.model.parameters, compiled.network.dt)
        if exact is None or span in told:
            continue
        off = exact[(np.abs(exact - np.rint(exact)) > NEAR_INTEGER) | (exact < 0)]
        if len(off):
            told.add(span)
            steps = max(math.floor(off[0] + 0.5), int(off[0] > 0))
            message = f"the refractory time of '{model.name}' is {off[0]:.12g} steps"
            message += f": it rests for {plural(steps, 'step')}, {steps * compiled.network.dt:.12g} s"
            findings.warning("refractory-rounded", span, message, "write a whole number of steps, or shorten 'dt'")


def _place_of_rest(neuron_type: NeuronType, written: GroupModel, libraries: Iterable[Library]) -> Span:
    """Where a refractory time is written, or, if that is a formula or of a built-in model, where the model is named."""
    name = neuron_type.model.definition.name
    model = next((one.models[name] for one in libraries if name in one.models), None)
    spike = None if model is None else model.spike
    if spike is None or spike.refractory is None or isinstance(spike.refractory.value, str):
        return _place_of_model(written)
    return spike.refractory.span


def _warn_idle(compiled: Compiled, told: set[Span], findings: Findings) -> None:
    """Warn of the groups with idle neurons, but for those at whose places something is ``told`` already."""
    network = compiled.network
    idle = _idle(network)
    if not idle.any():
        return
    has_incoming = np.zeros(len(network.neurons), dtype=np.bool_)
    for targets in pieces(network.connections.targets.compact()):
        has_incoming[targets] = True
    origin = {scope.called(name): (scope, name) for scope in compiled.scopes for name in scope.section.neurons}
    for group in network.neurons.groups:
        members = [member for member in group.indices if idle[member]]
        scope, own_name = origin[group.name]
        written, span = scope.section.neurons[own_name], key_span(scope.section, "neurons", own_name)
        # a bias or an initial of 0 that is written is meant
        if not members or span in told or written.bias is not None or written.initial is not None:
            continue
        told.add(span)
        names = [network.neurons.names[member] for member in members]
        shown = f"'{group.name}'" if len(names) == group.count else ", ".join(f"'{name}'" for name in names[:5])
        if len(names) > 5 and len(names) < group.count:
            shown += " and others"
        outside = "from outside " if has_incoming[members].any() else ""
        message = (
            f"nothing {outside}reaches {shown}, and there is no input, bias, initial or noise: the activity stays 0"
        )
        hint = "connect something to it, or give it an input, a bias, an initial or a noise"
        findings.warning("idle-neuron", span, message, hint)


class _Reads(NamedTuple):
    """What a model reads of a neuron."""

    activation: bool
    drive: bool


def _reads(model: Definition) -> _Reads:
    return _Reads(model.reads_activation, DRIVE in model.read)


def _ignored(model: Definition, reads: _Reads, group: GroupModel) -> Iterator[tuple[Span, str, str]]:
    """The place of each key that the model does not read, and what to say there."""
    activation = group.activation
    if activation is not None and not reads.activation:
        message = f"the model '{model.name}' does not use the activation '{activation.name.value}'"
        yield activation.name.span, message, "remove it, or take a model whose activity is f(…)"
    if reads.drive:
        return
    for key in _DRIVING:
        entry = group.source.entry(key)
        if entry is not None and not (isinstance(entry.value, SourceMapping) and entry.value.entry(DRIVE) is None):
            message = f"the model '{model.name}' does not read its drive: '{key}' changes nothing"
            yield entry.key.span, message, "remove it, or take a model that reads 'drive'"


def _idle(network: Network) -> Mask:
    """Whether each neuron is idle."""
    neurons, connections = network.neurons, network.connections
    quiet: Mask = (neurons.input < 0) & (neurons.bias == 0) & np.isnan(neurons.initial)
    for bias in neurons.port_bias.values():
        quiet &= bias == 0
    for places in neurons.port_input.values():
        quiet &= places < 0
    for noise in network.noises:
        quiet[noise.members] = False
    for port in (port for population in network.populations for port in population.ports):
        if port.combine == "distance":  # |c| away from a signal of 0
            for incoming in pieces(port.incoming):
                quiet[connections.targets[incoming]] = False
    for projection in network.projections:
        if projection.kind == SYNAPSE:  # which may bring something of nothing
            quiet[connections.targets[projection.members]] = False
    if not len(connections):
        quiet &= _needed(network)
    if not quiet.any():
        return quiet
    for population in network.populations:
        quiet[population.members] &= _stays_at_zero(population, network)
    owners, biases = set(), {bias_of(port) for port in (DRIVE, *neurons.port_bias)}
    for binding in network.set_by_events:  # what an event makes of a neuron is not checked
        owners.add(binding.array.owner)
        if binding.array in biases:
            quiet[binding.places] = False
    for population in network.populations if owners else ():
        if any(use.owner in owners for use in population.uses):
            quiet[population.members] = False
    sources, targets = connections.sources.compact(), connections.targets.compact()
    idle = unreached(quiet, sources, targets)
    return _first_causes(idle, sources, targets) if idle.any() else idle


def _needed(network: Network) -> Mask:
    """Whether an output or a rule asks for a neuron."""
    neurons = network.neuron_of
    needed = np.zeros(len(network.neurons), dtype=np.bool_)
    for output in network.outputs:
        needed[output.neurons] = True
    for projection in network.projections:
        for signal in projection.signals.values():
            needed[neurons[signal[signal < len(neurons)]]] = True
    return needed


class _Ways:
    """The ways along connections: from each neuron where its own lead."""

    def __init__(self, n: int, begins: Indices, ends: Indices) -> None:
        self._starts, self._ends = starts_of(begins, n), np.empty_like(ends)
        for some, places in sorting(begins, self._starts):
            self._ends[places] = ends[some]
        #: of each neuron a place among those just found
        self._last = np.zeros(n, dtype=np.int64)

    def follow(self, reached: Mask, begin: list[int]) -> None:
        """Mark neurons as reached, and all to which a way leads from them through neurons that are not yet."""
        reached[begin] = True
        seen, starts, ends = reached.data, self._starts.data, self._ends.data  # items of these are read faster
        waiting = begin
        while waiting:
            if len(waiting) > _FEW_ENOUGH_FOR_LOOP:
                waiting = self._follow_all(reached, np.array(waiting))
                continue
            found = []
            for neuron in waiting:
                for end in ends[starts[neuron] : starts[neuron + 1]]:
                    if not seen[end]:
                        seen[end] = True
                        found.append(end)
            waiting = found

    def _follow_all(self, reached: Mask, begin: IntArray) -> list[int]:
        """Mark where connections lead from many neurons, and say what is new."""
        found: list[int] = []
        together = np.cumsum(self._starts[begin + 1] - self._starts[begin])
        cuts = np.searchsorted(together, np.arange(PIECE, together[-1], PIECE))  # as many connections in each piece
        for some in np.split(begin, cuts):
            first, counts = self._starts[some], self._starts[some + 1] - self._starts[some]
            # each neuron's ends are a run of _ends: the positions of all these runs, one after the other
            positions = np.repeat(first - np.cumsum(counts) + counts, counts) + np.arange(counts.sum())
            ends = self._ends[positions]
            ends = ends[~reached[ends]]
            reached[ends] = True
            place = np.arange(len(ends))
            self._last[ends] = place
            found += ends[self._last[ends] == place].tolist()  # each neuron once
        return found


def unreached(quiet: Mask, sources: Indices, targets: Indices) -> Mask:
    """The quiet neurons that no way leads to from one that is not."""
    reached = ~quiet
    for _ in range(_WHOLE_ARRAY_PASSES):
        before = int(reached.sum())
        for begins, ends in zip(pieces(sources), pieces(targets), strict=True):
            reached[ends[reached[begins]]] = True
        if int(reached.sum()) == before:
            return ~reached
    rest = np.concatenate([~reached[ends] for ends in pieces(targets)])  # what may still lead somewhere
    _Ways(len(quiet), sources[rest], targets[rest]).follow(reached, np.flatnonzero(reached).tolist())
    return ~reached


def _first_causes(idle: Mask, sources: Indices, targets: Indices) -> Mask:
    """Of the idle neurons those that are not behind other ones: without sources, or on a cycle that has none.

    What is behind neurons without sources is reached from these. Of the rest each neuron has sources, in the rest. Two
    passes find the cycles, as those of Kosaraju's algorithm find strong components: the first follows the ways from one
    neuron after the other that was not reached yet; the second does so once more, beginning with the last of these.
    Those that it has not reached yet are on cycles without sources, one on each, and the whole cycle is what leads to
    it."""
    both = [idle[begins] & idle[ends] for begins, ends in zip(pieces(sources), pieces(targets), strict=True)]
    inside = slice(None) if all(piece.all() for piece in both) else np.concatenate(both)
    sources, targets = sources[inside], targets[inside]
    behind = np.zeros(len(idle), dtype=np.bool_)
    for begins, ends in zip(pieces(sources), pieces(targets), strict=True):
        behind[ends[begins != ends]] = True
    if not behind.any():
        return idle
    result = idle & ~behind
    ways, reached = _Ways(len(idle), sources, targets), ~idle
    ways.follow(reached, np.flatnonzero(result).tolist())
    reached_again = reached.copy()
    starts: list[int] = []
    causes: list[int] = []
    for neuron in np.flatnonzero(~reached).tolist():
        if not reached[neuron]:
            starts.append(neuron)
            ways.follow(reached, [neuron])
    for neuron in reversed(starts):
        if not reached_again[neuron]:
            ways.follow(reached_again, [neuron])
            causes.append(neuron)
    if causes:
        del ways
        _Ways(len(idle), targets, sources).follow(result, causes)
    return result


def _stays_at_zero(population: Population, network: Network) -> Mask:
    """Whether the neurons of a population, never driven, surely keep their states and an activity of 0: then all that
    their formulas read stays what it is at the first step."""
    count, model = len(population.members), population.model.definition
    if any(port.combine == "product" for port in population.ports) or not model.read.isdisjoint(("k", "t")):
        return np.zeros(count, dtype=np.bool_)
    result = np.ones(count, dtype=np.bool_)
    begin = beginning(
        population, network.dt, network.neurons.starts, dict.fromkeys((port.name for port in population.ports), 0.0)
    )
    for state in model.state:
        old = begin.values[state.name]
        for change, still in ((state.each_step, old), (state.each_episode, old), (state.derivative, 0.0)):
            if change is not None:
                result &= np.broadcast_to(begin.of(change) == still, (count,))
        if network.outlets:  # it may be sent
            result &= old == 0
    for given in model.gives:
        assert given.each_step is not None
        result &= np.broadcast_to(begin.of(given.each_step) == 0, (count,))
    return result
