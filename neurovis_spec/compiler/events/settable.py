"""What can be set in a run: parameters, and the numbers of a network that depend on them (§9).

In: formulas and what their names mean. Out: Settable, a part of a Network: a Slot for each parameter, and Bindings,
each a formula with the numbers that it gives. To set a parameter is to evaluate the bindings that read it and to write
what they give into arrays; nothing is compiled anew. What depends on a parameter and has no binding (a count, a delay,
the first weight of a rule) stays as it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.program import Key, Owner
from neurovis_spec.language.expressions.evaluate import Drawing, Value, evaluate_array
from neurovis_spec.language.expressions.functions import NUMPY, Library
from neurovis_spec.language.expressions.tree import Number, Tree, names

#: Arrays that a network has one of.
BIAS, CENTRES, LOW, HIGH, WEIGHTS, NOISE = (
    Key(None, name) for name in ("bias", "centres", "low", "high", "weights", "noise")
)


def table_of(number: int) -> Key:
    """The rows of an input."""
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
    """An expression over parameters: ``places`` gives the slot of each that can be set, ``known`` what its other names
    mean; these may follow the parameters, too. ``draw`` gives its random numbers, the same each time."""

    tree: Tree
    places: Mapping[str, int]
    known: Mapping[str, Value | Dependent] = field(default_factory=dict)
    draw: Drawing | None = None

    @property
    def slots(self) -> frozenset[int]:
        """The parameters that it reads."""
        direct = frozenset(self.places.values())
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
        given: dict[str, Value] = {name: float(parameters[slot]) for name, slot in self.places.items()}
        for name, value in self.known.items():
            given[name] = value if isinstance(value, float | np.ndarray) else value.values(parameters, by)
        return evaluate_array(self.tree, given, self.draw, by=by)


class Part(NamedTuple):
    """Some numbers of a group or an entry that follow a formula: those at ``places`` (None: all of them) of the array
    ``field``, for a setting of a definition that of its parameter ``name``. They must lie from ``low`` to ``high``."""

    formula: Dependent
    places: IntArray | None = None
    field: str = ""
    name: str = ""
    low: Dependent | None = None
    high: Dependent | None = None

    def some(self, places: IntArray) -> Part:
        """The part with what its formulas give at some of its places alone."""
        if isinstance(self.formula, ParameterFormula) and self.formula.plain and self.low is self.high is None:
            return self
        low, high = (None if bound is None else Subset(bound, places) for bound in (self.low, self.high))
        return self._replace(formula=Subset(self.formula, places), low=low, high=high)

    def within(self, count: int) -> IntArray:
        """The places, of ``count`` in all."""
        return np.arange(count, dtype=np.int64) if self.places is None else self.places


@dataclass(frozen=True, slots=True, eq=False)
class Assembled:
    """An array of which some parts follow parameters, and the others are as in ``base``."""

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


@dataclass(frozen=True, slots=True, eq=False)
class Distance:
    """How far the neurons of connections are from each other; ``positions`` are x and y of all neurons in turn."""

    positions: Assembled
    sources: IntArray
    targets: IntArray

    @property
    def slots(self) -> frozenset[int]:
        """The parameters that it reads."""
        found = np.concatenate((self.sources, self.targets))
        parts = self.positions.parts
        return frozenset().union(*(part.formula.slots for part in parts if np.isin(part.within(0) // 2, found).any()))

    def values(self, parameters: FloatArray, by: Library = NUMPY) -> FloatArray:
        """The distances with these parameters."""
        place = self.positions.values(parameters, by).reshape(-1, 2)
        apart = place[self.sources] - place[self.targets]
        # NumPy's is that of the C library
        return np.hypot(apart[:, 0], apart[:, 1])


@dataclass(frozen=True, slots=True, eq=False)
class Slot:
    """A parameter: of the spec, or with a dotted name of an instance where it depends on one of the spec. ``formula``
    is what it follows until it is set itself; ``low`` and ``high`` are its bounds, which may follow others. ``given``:
    its value does not come from the spec, which says ``own``."""

    name: str
    value: float
    formula: ParameterFormula | None = None
    low: float | Dependent = -np.inf
    high: float | Dependent = np.inf
    given: bool = False
    own: ParameterFormula | None = None

    @property
    def bounds_read(self) -> frozenset[int]:
        """The parameters that its bounds read."""
        return frozenset().union(*(bound.slots for bound in (self.low, self.high) if not isinstance(bound, float)))


@dataclass(frozen=True, slots=True, eq=False)
class Binding:
    """Numbers that follow a formula: ``indices`` into the vector of all weights (``weights``) or into that of the
    other numbers that can be set. ``array`` and ``places`` say what they are, whatever the vector looks like. They must
    lie from ``low`` to ``high``."""

    formula: Dependent
    weights: bool
    indices: IntArray
    array: Key
    places: IntArray
    low: Dependent | None = None
    high: Dependent | None = None

    @property
    def slots(self) -> frozenset[int]:
        """The parameters that it reads."""
        return self.formula.slots.union(*(bound.slots for bound in (self.low, self.high) if bound is not None))


class Variable(NamedTuple):
    """An array of a network in the vector of numbers that can be set, from ``start`` on; of size 1 where all of its
    numbers are the same."""

    start: int
    size: int


@dataclass(frozen=True, eq=False)
class Settable:
    """All that can be set. ``variables`` are BIAS, CENTRES, LOW, HIGH (one number a neuron or a connection), parameters
    of definitions in use, and the tables of inputs; ``initial`` is what they begin with."""

    slots: tuple[Slot, ...] = ()
    bindings: tuple[Binding, ...] = ()
    variables: Mapping[Key, Variable] = field(default_factory=dict)
    initial: FloatArray = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def index(self) -> Mapping[str, int]:
        """The slot of each parameter by name."""
        return {slot.name: place for place, slot in enumerate(self.slots)}

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
        for place, slot in enumerate(self.slots):
            for read in () if slot.formula is None else slot.formula.slots:
                result[read].append(place)
        return tuple(tuple(places) for places in result)

    @cached_property
    def bounded(self) -> tuple[tuple[int, frozenset[int]], ...]:
        """The slots whose bounds follow parameters, and which they read."""
        return tuple((place, slot.bounds_read) for place, slot in enumerate(self.slots) if slot.bounds_read)

    @cached_property
    def readers(self) -> tuple[tuple[int, ...], ...]:
        """For each slot the bindings that read it, ascending."""
        result: list[list[int]] = [[] for _ in self.slots]
        for place, binding in enumerate(self.bindings):
            for read in binding.slots:
                result[read].append(place)
        return tuple(tuple(places) for places in result)

    def reached(self, changed: Sequence[int], own: Sequence[bool]) -> list[int]:
        """The slots that follow from others that change, ascending; not those that are set themselves (``own``)."""
        found: set[int] = set()
        waiting = list(changed)
        while waiting:
            for place in self.followers[waiting.pop()]:
                if place not in found and not own[place]:
                    found.add(place)
                    waiting.append(place)
        return sorted(found.difference(changed))

    def bound_to(self, changed: Sequence[int]) -> list[int]:
        """The bindings that read any of these slots, ascending."""
        return sorted({place for slot in changed for place in self.readers[slot]})


def places_of(tree: Tree, settable: Mapping[str, int]) -> dict[str, int]:
    """The slots of the parameters that an expression names."""
    return {name: settable[name] for name in sorted(names(tree) & settable.keys())}
