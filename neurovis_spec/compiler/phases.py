"""Phases: what events make of a network, as a series of networks (§9).

In: the network as it begins, its events. Out: the same network with ``phases``: for each step at which something
changes, the network that runs from then on. A phase has the neurons, the connections and the weights' places of the
first network; what is lesioned is left out of its blocks and rules, what is clamped is listed, what is set is compiled
in. What holds by a step is carried on to the next, so that many events take a time in proportion to their number.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from heapq import heappop, heappush
from operator import itemgetter

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.arrays import IntArray, frozen
from neurovis_spec.compiler.constants import Constants
from neurovis_spec.compiler.digest import digest
from neurovis_spec.compiler.events import Event
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Block, Learn, Plasticity
from neurovis_spec.compiler.settable import differences
from neurovis_spec.diagnostics import Span
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.located import Formula

#: Compiles the network anew with other parameters, without its events; None where that is at fault.
Recompile = Callable[[Mapping[str, float]], Network | None]
Mask = npt.NDArray[np.bool_]

#: Most steps at which something changes: each is a network of its own.
MOST = 10_000


def with_phases(
    network: Network,
    events: tuple[Event, ...],
    recompile: Recompile,
    constants: Constants,
    place: Span,
    since: int | None = None,
) -> Network:
    """The network with a phase for each step at which something changes. An expression that is set sees the values that
    the parameters have by then, not those of the other parameters that are set in the same step.

    Its hash covers what each of the phases is. ``since``: the network is one with the parameters of this step, at which
    they were set by hand; what events have set by then is past.
    """
    begun, over = defaultdict[int, list[int]](list), defaultdict[int, list[int]](list)
    for number, event in enumerate(events):
        begun[event.at].append(number)
        if event.clamp and event.to is not None:
            over[event.to].append(number)
    steps = sorted({*begun, *over})
    if len(steps) > MOST:
        constants.findings.error(
            "too-many", place, f"the events change something at {len(steps):,} steps; {MOST:,} are possible"
        )
        return network
    phases: list[tuple[int, Network]] = []
    course: list[object] = []
    settings, clamps, lesions = _Settings(network, events, recompile, constants), _Clamps(), _Lesions()
    for step in steps:
        new = [(number, events[number]) for number in begun.get(step, ())]
        if since is None or step > since:
            settings.go_on([event for _, event in new])
        if settings.failed:
            return network
        silent = lesions.add(event for _, event in new)
        clamps.go_on(new, over.get(step, ()), silent)
        phase = clamps.on(lesions.without(settings.base), constants)
        held = None if phases and phase.clamped is phases[-1][1].clamped else np.array(phase.clamped)
        cut = sorted({index for _, event in new for index in event.connections})
        course.append((step, settings.mark, sorted(silent), cut, held))
        phases.append((step, phase))
    return replace(network, phases=tuple(phases), hash=digest(network.hash, course))


class _Settings:
    """What is set by a step, and the network with it; each is compiled once."""

    def __init__(self, network: Network, events: tuple[Event, ...], recompile: Recompile, constants: Constants) -> None:
        self.base = network
        #: of what the parameters are, and of what they make of the network where it differs from the first one
        self.mark = ("", digest({}))
        self.failed = False
        self._first, self._recompile, self._constants = network, recompile, constants
        self._chosen: dict[str, float] = {}
        self._known: dict[tuple[tuple[str, str], ...], tuple[Network, tuple[str, str]]] = {}
        self._read = _read(events, constants)

    def go_on(self, events: Iterable[Event]) -> None:
        """Set what further events set, all of a step."""
        due: dict[str, tuple[Formula, Span]] = {}
        for event in events:
            for name, formula in event.set.items():
                key = event.keys[name]
                if name in due:
                    first = due[name][1]
                    where = f"line {key.line}" if key.line != first.line else f"column {key.column}"
                    message = f"'{name}' is set again at this step ({where}): what is set here is lost"
                    self._constants.findings.warning("no-effect", first, message, "set it once")
                due[name] = formula, key
        if not due:
            return
        now = replace(self._constants, parameters=dict(self.base.parameters))
        values = {name: now.scalar(formula) for name, (formula, _) in due.items()}
        self._chosen |= {name: value for name, value in values.items() if value is not None}
        before, (_, effect) = self.base, self.mark
        choice = tuple((name, self._chosen[name].hex()) for name in sorted(self._chosen))  # -0.0 is not 0.0
        if choice not in self._known:
            made = self._recompile(self._chosen)
            if made is None:
                self.failed = True
                return
            # the parameter that is set does not reach back to the activity at step 0
            made = replace(made, neurons=replace(made.neurons, initial=self._first.neurons.initial))
            self._known[choice] = made, (digest(made.parameters), digest(differences(made, self._first)))
        self.base, self.mark = self._known[choice]
        if self.mark[1] == effect and self._read.isdisjoint(due):
            self._look(before, {name: key for name, (_, key) in due.items()})

    def _look(self, before: Network, due: Mapping[str, Span]) -> None:
        """Parameters that got another value, by which nothing in the run changes."""
        for name, key in due.items():
            if before.parameters[name] != self.base.parameters[name]:
                message = f"setting '{name}' changes nothing in the run"
                hint = "what it begins with (an initial, a weight that learns) and how it is drawn stay as they are"
                self._constants.findings.warning("no-effect", key, message, hint)


def _read(events: tuple[Event, ...], constants: Constants) -> set[str]:
    """The parameters that events themselves depend on."""
    formulas = {id(formula): formula for event in events for formula in event.set.values()}
    formulas |= {id(formula): formula for event in events for _, formula in event.clamp}
    trees = [constants.tree(formula) for formula in formulas.values()]
    waiting = [name for tree in trees if tree is not None for name in names(tree)]
    found: set[str] = set()
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += constants.uses.get(name, ())
    return found


class _Lesions:
    """What is lesioned by a step, and a network without it."""

    def __init__(self) -> None:
        self._neurons, self._connections = set[int](), set[int]()
        self._base: Network | None = None
        self._result: Network | None = None
        self._done = (0, 0)

    def add(self, events: Iterable[Event]) -> list[int]:
        """Lesion what further events name. Returns the neurons that were not lesioned before."""
        new: list[int] = []
        for event in events:
            new.extend(set(event.neurons) - self._neurons)
            self._neurons.update(event.neurons)
            self._connections.update(event.connections)
        return new

    def without(self, base: Network) -> Network:
        """A network without what is lesioned; the one before is gone on from where it is of the same base."""
        done = len(self._neurons), len(self._connections)
        if base is not self._base or self._result is None:
            self._base, self._result = base, _cut(base, self._gone(base))
        elif done != self._done:
            self._result = _cut(self._result, self._gone(base))
        self._done = done
        return self._result

    def _gone(self, base: Network) -> Mask:
        """Which connections are lesioned, by name or with one of their ends."""
        silent = np.zeros(len(base.neurons), dtype=np.bool_)
        silent[list(self._neurons)] = True
        gone: Mask = silent[base.connections.sources] | silent[base.connections.targets]
        gone[list(self._connections)] = True
        return gone


class _Clamps:
    """The clamps that hold at a step: of several of a neuron the one that is written last; a lesion holds for good."""

    def __init__(self) -> None:
        #: ascending neurons, each with what it is held at; None is 0, for good
        self._held: list[tuple[int, Formula | None]] = []
        self._network: Network | None = None
        self._result: Network | None = None
        #: what formulas are worth with the parameters of a network, by the formula's id
        self._values: dict[int, float] = {}
        self._parameters: Mapping[str, float] | None = None
        #: by neuron: the clamps that hold and some that are over, that of the last event first
        self._of = defaultdict[int, list[tuple[int, Formula]]](list)
        self._over = set[int]()
        self._silent = set[int]()
        self._neurons_of: dict[int, Iterable[int]] = {}

    def go_on(self, new: Iterable[tuple[int, Event]], over: Iterable[int], silent: Iterable[int]) -> None:
        """Begin the clamps of events with their numbers, end those of others, and hold lesioned neurons at 0."""
        touched = set[int]()
        for number, event in new:
            clamps = dict(event.clamp)
            self._neurons_of[number] = clamps
            touched |= clamps.keys()
            for neuron, formula in clamps.items():
                heappush(self._of[neuron], (-number, formula))
        for number in over:
            self._over.add(number)
            touched.update(self._neurons_of.pop(number))
        for neuron in silent:
            self._silent.add(neuron)
            self._put(neuron, (neuron, None))
        for neuron in touched - self._silent:
            heap = self._of[neuron]
            while heap and -heap[0][0] in self._over:
                heappop(heap)
            self._put(neuron, (neuron, heap[0][1]) if heap else None)

    def on(self, network: Network, constants: Constants) -> Network:
        """A network with what is clamped, at what its parameters make of that; the same one while nothing changes."""
        if self._result is None or network is not self._network:
            if network.parameters is not self._parameters:
                self._parameters, self._values = network.parameters, {}
            now = replace(constants, parameters=dict(network.parameters))
            held = tuple((neuron, self._value(formula, now)) for neuron, formula in self._held)
            self._network, self._result = network, replace(network, clamped=held, phases=())
        return self._result

    def _value(self, formula: Formula | None, now: Constants) -> float:
        """What a neuron is held at; what is at fault, a finding, stands as 0."""
        if formula is None:
            return 0.0
        if id(formula) not in self._values:  # one for a whole group
            self._values[id(formula)] = now.scalar(formula) or 0.0
        return self._values[id(formula)]

    def _put(self, neuron: int, entry: tuple[int, Formula | None] | None) -> None:
        """Note what a neuron is held at, if at anything."""
        begin = bisect_left(self._held, neuron, key=itemgetter(0))
        end = begin + (begin < len(self._held) and self._held[begin][0] == neuron)
        self._held[begin:end] = [] if entry is None else [entry]
        self._result = None


def _cut(network: Network, gone: Mask) -> Network:
    """A network without some of its connections in blocks and rules."""
    plasticity = tuple(_kept_rule(entry, gone) for entry in network.plasticity)
    idle = {number for number, entry in enumerate(plasticity) if not len(entry.members)}
    return replace(
        network,
        blocks=tuple(_kept_block(block, gone) for block in network.blocks),
        plasticity=plasticity,
        program=tuple(op for op in network.program if not (isinstance(op, Learn) and op.plasticity in idle)),
    )


def _kept(array: IntArray, keep: Mask) -> IntArray:
    result = array[keep]
    frozen(result)
    return result


def _kept_block(block: Block, gone: Mask) -> Block:
    keep = ~gone[block.incoming]
    if keep.all():
        return block
    return replace(block, incoming=_kept(block.incoming, keep), slots=_kept(block.slots, keep))


def _kept_rule(entry: Plasticity, gone: Mask) -> Plasticity:
    keep = ~gone[entry.members]
    if keep.all():
        return entry
    return replace(
        entry,
        members=_kept(entry.members, keep),
        parameters={name: values[keep] for name, values in entry.parameters.items()},
        signals={name: _kept(values, keep) for name, values in entry.signals.items()},
    )
