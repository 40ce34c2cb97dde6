"""What can be set in a run: parameters, and the numbers of a network that depend on them.

In: formulas and what their names mean. Out: Settable, a part of a Network. To set a parameter is to evaluate the
bindings that read it and to write what they give into arrays; nothing is compiled anew. What depends on a parameter and
has no binding (a count, a delay, the first weight of a rule) stays as it is.

Three words, by the example ``parameters: {g: 2, w: g/4}`` with ``A -> B: {weight: w + 1}``:

- A **Slot** is a parameter that can be set; slots are known by their index. Here g is slot 0 and w is slot 1. w
  *follows* g: its slot has the formula g/4, which holds until w is set itself.
- A **Part** says, while an entry or a group is compiled, which of its own numbers follow a formula: of the entry's
  ``weights`` all follow w + 1. ``Constants.following`` (``values/constants.py``) collects parts.
- A **Binding** is what a part becomes when the network is complete (``events/bound.py``): weight 7 of the network
  follows w + 1.

To set g to 4 is to compute slot 1 (1.0), then the binding (2.0), and to write that into weight 7.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, reduce
from typing import NamedTuple, Protocol

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray
from neurovis_spec.compiler.program import DRIVE, Key, Owner
from neurovis_spec.language.expressions.evaluate import Drawing, Value, evaluate_array
from neurovis_spec.language.expressions.functions import NUMPY, Library
from neurovis_spec.language.expressions.tree import Number, Tree, names

#: Arrays that a network has one of.
BIAS, CENTRES, LOW, HIGH, WEIGHTS, NOISE = (
    Key(None, name) for name in ("bias", "centres", "low", "high", "weights", "noise")
)


def bias_of(port: str) -> Key:
    """The biases of a port, one a neuron."""
    return BIAS if port == DRIVE else Key(Owner("bias", 0), port)


def table_of(number: int) -> Key:
    """The array of an input's rows; ``number`` is that of the input."""
    return Key(Owner("table", number), "")


class Dependent(Protocol):
    """Something that follows the parameters of a run."""

    @property
    def slots(self) -> frozenset[int]:
        """The parameters that it reads."""
        ...

    def values(self, parameters: FloatArray, by: Library = NUMPY) -> Value:
        """Its value or values with these parameters (one a slot), finite or not; functions are computed ``by`` a
        library: NumPy's while a network is compiled, in a run that of its backend."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class ParameterFormula:
    """An expression over parameters."""

    tree: Tree
    #: the slot of each parameter in it that can be set, by name
    slot_of: Mapping[str, int]
    #: what its other names mean; these may follow parameters, too
    known: Mapping[str, Value | Dependent] = field(default_factory=dict)
    #: gives its random numbers, the same each time
    draw: Drawing | None = None

    @property
    def slots(self) -> frozenset[int]:
        """The parameters that it reads."""
        direct = frozenset(self.slot_of.values())
        return direct.union(
            *(value.slots for value in self.known.values() if not isinstance(value, float | np.ndarray))
        )

    @property
    def plain(self) -> bool:
        """Whether it is one number, made of parameters and numbers alone."""
        return self.draw is None and all(isinstance(value, float) for value in self.known.values())

    def values(self, parameters: FloatArray, by: Library = NUMPY) -> Value:
        """Its value or values with these parameters."""
        if isinstance(self.tree, Number):
            return self.tree.value
        given: dict[str, Value] = {name: float(parameters[slot]) for name, slot in self.slot_of.items()}
        for name, value in self.known.items():
            given[name] = value if isinstance(value, float | np.ndarray) else value.values(parameters, by)
        return evaluate_array(self.tree, given, self.draw, by=by)


class Part(NamedTuple):
    """Some numbers of a group, an entry or an input that follow a formula."""

    formula: Dependent
    #: their indices in the array of the group or entry; None: all of them
    places: IntArray | None = None
    #: which array, ``weights`` or ``bias``; for a setting of a definition the kind of that, ``model`` or ``rule``
    field: str = ""
    #: for a setting of a definition the parameter that is set
    name: str = ""
    #: and what that definition is called
    of: str = ""
    #: the bounds within which they must lie
    low: Dependent | None = None
    high: Dependent | None = None

    def subset(self, places: IntArray) -> Part:
        """The part of which the formulas give only the numbers at these indices of what they give now."""
        if isinstance(self.formula, ParameterFormula) and self.formula.plain and self.low is self.high is None:
            return self
        low, high = (None if bound is None else Subset(bound, places) for bound in (self.low, self.high))
        return self._replace(formula=Subset(self.formula, places), low=low, high=high)

    def within(self, count: int) -> IntArray:
        """The places, of ``count`` in all."""
        return np.arange(count, dtype=np.int64) if self.places is None else self.places


@dataclass(frozen=True, slots=True, eq=False)
class Assembled:
    """An array of which some parts follow parameters, and the other numbers are those of ``base``."""

    base: FloatArray
    parts: tuple[Part, ...]

    @property
    def slots(self) -> frozenset[int]:
        """The parameters that it reads."""
        return frozenset().union(*(part.formula.slots for part in self.parts))

    def values(self, parameters: FloatArray, by: Library = NUMPY) -> FloatArray:
        """The whole array with these parameters."""
        result = np.array(self.base, dtype=np.float64)
        for part in self.parts:
            result[... if part.places is None else part.places] = part.formula.values(parameters, by)
        return result


@dataclass(frozen=True, slots=True, eq=False)
class Subset:
    """Some of the numbers that a formula gives; of one number that one."""

    whole: Dependent
    places: IntArray

    @property
    def slots(self) -> frozenset[int]:
        """The parameters that it reads."""
        return self.whole.slots

    def values(self, parameters: FloatArray, by: Library = NUMPY) -> Value:
        """These numbers with these parameters."""
        whole = self.whole.values(parameters, by)
        return whole if np.size(whole) == 1 else np.asarray(whole)[self.places]


def apart(positions: FloatArray, one: Indices, other: Indices) -> FloatArray:
    """How far neurons are from others, of positions (n, axes); the indices broadcast. NumPy's hypot is that of the C
    library, so that compiled code gives the same bits."""
    along = (positions[one, axis] - positions[other, axis] for axis in range(positions.shape[1]))
    return reduce(np.hypot, along)


@dataclass(frozen=True, slots=True, eq=False)
class Distance:
    """How far source and target of connections are from each other. ``positions`` are x and y of all neurons in turn,
    x0, y0, x1, y1, …, or three numbers each, where there are so many ``axes``."""

    positions: Assembled
    sources: IntArray
    targets: IntArray
    axes: int = 2

    @property
    def slots(self) -> frozenset[int]:
        """The parameters that it reads."""
        found = np.concatenate((self.sources, self.targets))
        parts = self.positions.parts
        # number k of the positions is one of neuron k // axes
        read = (part for part in parts if np.isin(part.within(0) // self.axes, found).any())
        return frozenset().union(*(part.formula.slots for part in read))

    def values(self, parameters: FloatArray, by: Library = NUMPY) -> FloatArray:
        """The distances with these parameters."""
        return apart(self.positions.values(parameters, by).reshape(-1, self.axes), self.sources, self.targets)


@dataclass(frozen=True, slots=True, eq=False)
class Slot:
    """A parameter that can be set: one of the spec, or one of an instance that follows one of the spec (``leg.g``)."""

    name: str
    #: what it is when a run begins
    value: float
    #: what it follows until it is set itself
    formula: ParameterFormula | None = None
    #: its bounds, which may follow other parameters
    low: float | Dependent = -np.inf
    high: float | Dependent = np.inf
    #: whether its value was given from outside (``--set``)
    given: bool = False
    #: if so, what the spec says
    own: ParameterFormula | None = None
    #: its unit, "" without one
    unit: str = ""

    @property
    def bounds_read(self) -> frozenset[int]:
        """The parameters that its bounds read."""
        return frozenset().union(*(bound.slots for bound in (self.low, self.high) if not isinstance(bound, float)))


@dataclass(frozen=True, slots=True, eq=False)
class Binding:
    """Numbers of a network that follow a formula."""

    formula: Dependent
    #: whether they are weights; the others stand in the vector of Settable's ``variables``
    weights: bool
    #: where they stand in the vector of all weights, or in that of the variables: one index alone where all numbers of
    #: an array are the same, as these take one place in that vector
    indices: IntArray
    #: which array of the network they belong to
    array: Key
    #: their indices in that array, one for each, however the vector is laid out
    places: IntArray
    #: the bounds within which they must lie
    low: Dependent | None = None
    high: Dependent | None = None

    @property
    def slots(self) -> frozenset[int]:
        """The parameters that it reads."""
        return self.formula.slots.union(*(bound.slots for bound in (self.low, self.high) if bound is not None))

    def written_by(self, of_events: int) -> frozenset[int]:
        """The parameters that have its numbers written anew. A weight that an event sets, to what slots from
        ``of_events`` on hold, stays where its bounds alone are others: it is what it has become since."""
        own = self.formula.slots
        return own if any(slot >= of_events for slot in own) else self.slots


class Variable(NamedTuple):
    """An array of a network in the vector of numbers that can be set, from ``start`` on; of size 1 where all of its
    numbers are the same."""

    start: int
    size: int


@dataclass(frozen=True, eq=False)
class Settable:
    """All that can be set in a run of a network."""

    slots: tuple[Slot, ...] = ()
    bindings: tuple[Binding, ...] = ()
    #: BIAS, CENTRES, LOW, HIGH (one number a neuron or a connection), parameters of definitions, tables of inputs
    variables: Mapping[Key, Variable] = field(default_factory=dict)
    #: the vector of all of these when a run begins
    initial: FloatArray = field(default_factory=lambda: np.zeros(0))
    #: the first of the slots that events alone set (``event_slots``), which are no parameters; None without any
    of_events: int | None = None
    #: by inputs that events feed, the slot that says whether they are fed; behind it stand what they are fed
    feeds: Mapping[str, int] = field(default_factory=dict)

    @cached_property
    def index(self) -> Mapping[str, int]:
        """The index of each slot by the name of its parameter."""
        return {slot.name: index for index, slot in enumerate(self.slots[: self.of_events])}

    @property
    def own_count(self) -> int:
        """How many slots are parameters; those behind them events alone set."""
        return len(self.slots) if self.of_events is None else self.of_events

    @cached_property
    def given_by_events(self) -> tuple[Binding, ...]:
        """The bindings of weights that events give, and no parameter."""
        first = self.own_count
        return tuple(one for one in self.bindings if one.weights and any(slot >= first for slot in one.formula.slots))

    @cached_property
    def parameters(self) -> FloatArray:
        """The initial values of the parameters, one a slot."""
        result = np.array([slot.value for slot in self.slots], dtype=np.float64)
        result.flags.writeable = False
        return result

    @cached_property
    def followers(self) -> tuple[tuple[int, ...], ...]:
        """For each slot the slots whose formulas read it, ascending."""
        result: list[list[int]] = [[] for _ in self.slots]
        for index, slot in enumerate(self.slots):
            for read in () if slot.formula is None else slot.formula.slots:
                result[read].append(index)
        return tuple(map(tuple, result))

    @cached_property
    def bounded(self) -> tuple[tuple[int, frozenset[int]], ...]:
        """The slots whose bounds follow parameters, and which they read."""
        return tuple((index, slot.bounds_read) for index, slot in enumerate(self.slots) if slot.bounds_read)

    @cached_property
    def readers(self) -> tuple[tuple[int, ...], ...]:
        """For each slot the bindings that are written anew where it is set, ascending."""
        result: list[list[int]] = [[] for _ in self.slots]
        for index, binding in enumerate(self.bindings):
            for read in binding.written_by(self.own_count):
                result[read].append(index)
        return tuple(map(tuple, result))

    def reached(self, changed: Sequence[int], was_set: Sequence[bool]) -> list[int]:
        """The slots that follow slots that change, directly or through others, ascending. ``was_set`` says of each slot
        whether it has been set itself: then it follows nothing any more."""
        found: set[int] = set()
        waiting = list(changed)
        while waiting:
            for follower in self.followers[waiting.pop()]:
                if follower not in found and not was_set[follower]:
                    found.add(follower)
                    waiting.append(follower)
        return sorted(found.difference(changed))

    def bound_to(self, changed: Sequence[int]) -> list[int]:
        """The bindings that read any of these slots, ascending."""
        return sorted({reader for slot in changed for reader in self.readers[slot]})


def slots_named(tree: Tree, settable: Mapping[str, int]) -> dict[str, int]:
    """The slots of the parameters that an expression names, by name. ``settable`` has the slots of all."""
    return {name: settable[name] for name in sorted(names(tree) & settable.keys())}
