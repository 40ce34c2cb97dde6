"""Turns: the changes that a user makes to a network while it runs: set a parameter, a weight, feed an input, clamp, …

In: names and values, as a client sends them. Out: frozen values, one for each change; ``turn`` applies one to a
Simulation. While a slider is dragged its values are ``moving``: the whole drag counts as one turn, to its last value.
``rules`` are the connections whose learning can be switched on and off, by the references that name them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.references import Arrow, parse
from neurovis_spec.runtime.names import Found, Names, names_of
from neurovis_spec.runtime.simulation import Simulation


@dataclass(frozen=True, slots=True)
class Set:
    """Parameters have other values from now on."""

    values: Mapping[str, float]
    moving: bool = False


@dataclass(frozen=True, slots=True)
class Feed:
    """An input has these values from now on, in place of its source; none: its source again."""

    name: str
    values: tuple[float, ...] = ()
    moving: bool = False


@dataclass(frozen=True, slots=True)
class Hold:
    """Neurons are clamped to a value."""

    neurons: str
    value: float
    moving: bool = False


@dataclass(frozen=True, slots=True)
class Release:
    """Neurons are clamped no more."""

    neurons: str


@dataclass(frozen=True, slots=True)
class Lesion:
    """A neuron or a connection takes no part any more."""

    part: str


@dataclass(frozen=True, slots=True)
class Mend:
    """The opposite of a lesion."""

    part: str


@dataclass(frozen=True, slots=True)
class Learn:
    """Learning of these connections is switched on or off."""

    connections: str
    on: bool


@dataclass(frozen=True, slots=True)
class Weigh:
    """Connections have this weight from now on, until a rule or a parameter changes it."""

    connections: str
    value: float
    moving: bool = False


Turn: TypeAlias = Set | Feed | Hold | Release | Lesion | Mend | Learn | Weigh
#: the messages that ask for them
TURNS: Final = frozenset(("set", "feed", "hold", "release", "lesion", "mend", "learn", "weigh"))


@dataclass(frozen=True, slots=True)
class Turned:
    """A turn that was taken at ``step``: it has its effect from the next one on. Of several values that were given to
    one thing at the same step, or in one drag, only the last is kept. Of a run each has its ``number``; ``back`` takes
    it back, and a drag begins at the step ``since``."""

    step: int
    turn: Turn
    number: int = field(default=0, compare=False)
    back: Turn | None = field(default=None, compare=False)
    since: int | None = field(default=None, compare=False)

    def after(self, before: Turned) -> Turned:
        """The same in place of one before, of which it is the next value."""
        since = before.step if before.since is None else before.since
        return replace(self, number=before.number, back=before.back, since=None if since == self.step else since)


def is_finite(turn: Turn) -> bool:
    """Whether all numbers that a turn gives are finite; those of a rule that diverges, and of what events set, need
    not be."""
    match turn:
        case Set():
            return all(map(math.isfinite, turn.values.values()))
        case Feed():
            return all(map(math.isfinite, turn.values))
        case Hold() | Weigh():
            return math.isfinite(turn.value)
    return True


def same_value(one: Turn, other: Turn) -> bool:
    """Whether both set the same parameters or the same weights, feed the same input or clamp the same neurons."""
    match one, other:
        case (Set(), Set()):
            return one.values.keys() == other.values.keys()
        case (Feed(), Feed()):
            return one.name == other.name
        case (Hold(), Hold()):
            return one.neurons == other.neurons
        case (Weigh(), Weigh()):
            return one.connections == other.connections
    return False


def taken(turned: Sequence[Turned], one: Turned) -> list[Turned]:
    """What was turned, with another turn behind it, in place of one before that gave the same thing a value at the same
    step. Of what is turned at one step weights come last, as events of a step set parameters first: a weight that
    follows a parameter has what was given to itself."""
    before, later = list(turned), list[Turned]()
    while isinstance(one.turn, Set) and before and before[-1].step == one.step and isinstance(before[-1].turn, Weigh):
        later.insert(0, before.pop())
    if before and before[-1].step == one.step and same_value(before[-1].turn, one.turn):
        one = one.after(before.pop())
    return [*before, one, *later]


def without_drags(turned: Sequence[Turned]) -> tuple[Turned, ...]:
    """The turns without the values that a slider only passed while it was dragged."""
    found = list[Turned]()
    for one in turned:
        dragged = found and isinstance(found[-1].turn, Set | Feed | Hold | Weigh) and found[-1].turn.moving
        if dragged and same_value(found[-1].turn, one.turn):
            one = one.after(found.pop())
        found.append(one)
    return tuple(found)


def opposite(
    what: Turn,
    turned: Sequence[Turned],
    parameters: Mapping[str, float],
    fed: Mapping[str, tuple[float, ...]],
    weight: float | None = None,
) -> Turn:
    """What takes a turn back that is about to be taken, after what was ``turned`` before; ``parameters`` and what is
    ``fed`` are those of now, ``weight`` is that of connections that are given one."""
    match what:
        case Set():
            return Set({name: parameters.get(name, value) for name, value in what.values.items()})
        case Feed():
            return Feed(what.name, fed.get(what.name, ()))
        case Hold() | Release():
            clamps = (entry.turn for entry in reversed(turned) if isinstance(entry.turn, Hold | Release))
            before = next((one for one in clamps if one.neurons == what.neurons), None)
            return Hold(what.neurons, before.value) if isinstance(before, Hold) else Release(what.neurons)
        case Lesion():
            return Mend(what.part)
        case Mend():
            return Lesion(what.part)
        case Learn():
            return Learn(what.connections, not what.on)
        case Weigh():
            return Weigh(what.connections, math.nan if weight is None else weight)  # several had different ones


def turn(simulation: Simulation, what: Set | Hold | Release | Lesion | Mend | Learn | Weigh) -> None:
    """Apply a turn. Raises ParameterError or another ValueError, or KeyError, and then nothing has changed."""
    match what:
        case Set():
            simulation.set(what.values)
        case Hold():
            simulation.clamp(what.neurons, what.value)
        case Release():
            simulation.release(what.neurons)
        case Lesion():
            simulation.lesion(what.part)
        case Mend():
            simulation.mend(what.part)
        case Learn():
            simulation.learning(what.connections, what.on)
        case Weigh():
            simulation.set_weight(what.connections, what.value)


def fed_by(network: Network, fed: Mapping[str, tuple[float, ...]], what: Feed) -> dict[str, tuple[float, ...]]:
    """The values that inputs are fed by hand, by name, after this turn. Raises ValueError."""
    entry = next((entry for entry in network.inputs if entry.name == what.name), None)
    if entry is None:
        raise ValueError(f"there is no input '{what.name}'")
    if not what.values:
        return {name: values for name, values in fed.items() if name != what.name}
    if len(what.values) not in (1, entry.size):
        raise ValueError(f"the input '{what.name}' takes {entry.size} numbers, not {len(what.values)}")
    return {**fed, what.name: (what.values * entry.size)[: entry.size]}


def feed(simulation: Simulation, fed: Mapping[str, tuple[float, ...]], what: Feed) -> dict[str, tuple[float, ...]]:
    """Take a turn that feeds an input; what is ``fed`` by hand then, but for inputs that events of the spec feed, too:
    these the simulation itself is told, so that of it and of events the latest counts. Raises ValueError."""
    values = fed_by(simulation.network, fed, what)
    if what.name in simulation.network.settable.feeds:
        simulation.feed(what.name, values.pop(what.name, ()))
    return values


@dataclass(frozen=True, slots=True, eq=False)
class Rule:
    """The rules at ``connections``, a reference: as they are written, and the ``members`` that they are of."""

    connections: str
    written: str
    members: IntArray


def rules(network: Network) -> tuple[Rule, ...]:
    """The rules in the order of the spec; what one reference names has one."""
    connections = network.connections
    known, learning = names_of(network), np.flatnonzero(connections.learning)
    entry = connections.entry[learning]
    found: dict[str, tuple[list[str], IntArray]] = {}
    for number, (name, written) in enumerate(zip(connections.entries, connections.learns, strict=True)):
        members = learning[entry == number]
        if written is not None and len(members):
            reference = _reference(network, known, name, members)
            words, others = found.get(reference, ([], members[:0]))
            found[reference] = ([*words, written], np.union1d(others, members))
    return tuple(Rule(name, "; ".join(dict.fromkeys(words)), members) for name, (words, members) in found.items())


def carried_out(rules: Sequence[Rule], stopped: npt.NDArray[np.bool_]) -> dict[str, bool | None]:
    """Whether rules are carried out, by their connections, where those of some connections are ``stopped`` (m,); None
    where some are."""
    off = {rule.connections: stopped[rule.members] for rule in rules}
    return {name: None if some.any() and not some.all() else not some.any() for name, some in off.items()}


def _reference(network: Network, known: Names, name: str, members: IntArray) -> str:
    """What names the connections of an entry; one of a module says the instance of its source alone."""
    plain = name.partition(" (")[0]
    arrow = parse(plain)
    assert isinstance(arrow, Arrow)
    source, target = arrow.sources.text, arrow.targets
    inside, _, _ = source.rpartition(".")
    wanted = set(network.connections.targets[members].tolist())
    for one in (target.text, " + ".join(f"{inside}.{part.text}" for part in target.parts)):
        ends = known.find(one)
        if isinstance(ends, Found) and wanted <= set(ends.neurons):
            return f"{source} -> {one}"
    return network.connection_names[int(members[0])] if len(members) == 1 else plain
