"""The units of a definition: those that are declared, and those that follow from its formulas.

In: the models of definitions, and where they are in use. Out: a Sheet each: the unit of every name, and what does not
fit. Units are labels: nothing that is computed depends on them. A name without one gets that which its formulas leave
it, if they leave one alone; a number that is written has any.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from types import MappingProxyType
from typing import Final, NamedTuple

from neurovis_spec.compiler.program import Kind
from neurovis_spec.diagnostics import shorten
from neurovis_spec.language.expressions.dimensions import Misfit, read_units
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import Name, Tree, names, walk
from neurovis_spec.language.library import DefinitionModel, Parts
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.model import Model
from neurovis_spec.language.units import NUMBER, Unit, spelled, unit_of

_NO_ENDS: Final[Mapping[str, Unit]] = MappingProxyType({})
#: What is in the unit of time of a definition.
_CLOCK: Final = "t"
#: Names whose unit is that of a number, or any, whatever a formula makes of them.
_NUMBERS: Final = frozenset({"pi", "e", "k"})


class Equation(NamedTuple):
    """A formula, and what its unit is: that of ``name`` times ``per``; any where that is "". ``key`` is what it is
    called there."""

    name: str
    key: str
    formula: Formula
    tree: Tree
    per: Unit = NUMBER

    def named(self, name: str) -> list[Tree]:
        """Where a name stands in the formula."""
        return [node for node in walk(self.tree) if isinstance(node, Name) and node.name == name]


class Unequal(NamedTuple):
    """An equation whose formula is in ``found``, where ``wanted`` follows from what it is of; ``suspect`` is the only
    name that makes it right with another prefix, "" where there is none, or are several."""

    found: Unit
    wanted: Unit
    suspect: str = ""


class Fault(NamedTuple):
    """What does not fit in an equation: a part of it, or the whole."""

    equation: Equation
    what: Misfit | Unequal


class Sheet(NamedTuple):
    """A definition with the units of all its names: as they are ``written``, and those that are ``known``, of what it
    reads at the ends of a connection, too. Of a unit that is not ours nothing is known."""

    kind: Kind
    name: str
    parts: Parts
    written: Mapping[str, str]
    known: Mapping[str, Unit]
    #: whatever else its formulas read that has a unit: drive, the weight, what is at the ends of a connection
    reads: tuple[str, ...]
    faults: tuple[Fault, ...]

    def told(self, unit: Unit) -> str:
        """How a unit is written, in the author's words where they have it."""
        return shorten(spelled(unit, self.written.values()))

    @property
    def gives(self) -> str:
        """What its kind gives, by its name in formulas."""
        return self.parts.gives or self.kind.gives

    @property
    def names(self) -> Iterator[tuple[str, str]]:
        """All that has a name in it: what it is, and the name."""
        parts = self.parts
        yield from (("parameter", name) for name in parts.parameters)
        yield from (("port", port.name.value) for port in parts.ports)
        yield from (("let", name) for name in parts.let)
        yield from (("state", name) for name in parts.state or ())
        yield from (("output", name) for name in parts.outputs or ())
        yield "output", self.gives
        yield from (("reads", name) for name in self.reads)


def sheet_of(kind: Kind, name: str, model: DefinitionModel, ends: Mapping[str, Unit] = _NO_ENDS) -> Sheet:
    """The units of a definition, which is sound, where those of what it reads at the ends of a connection are known
    (``pre.v``)."""
    parts = model.parts()
    sheet = Sheet(kind, name, parts, parts.units, {}, (), ())
    declared = {one for _, one in sheet.names}
    time = unit_of(parts.time)
    assert time is not None
    given = {one: unit for one, unit in {_CLOCK: time, "dt": time, "spike": NUMBER}.items() if one not in declared}
    # what is declared in a unit that is not ours has some unit: formulas give it none
    known = {**given, **ends, **as_known(sheet.written)}
    equations = tuple(_equations(kind, parts, time))
    read = frozenset().union(*(names(one.tree) for one in equations), (one.name for one in equations if one.name))
    free = read - sheet.written.keys() - _NUMBERS - known.keys()
    while more := _deduced(equations, known, free):
        known |= more
    reads = tuple(sorted(read - declared - given.keys() - _NUMBERS))
    return sheet._replace(known=known, reads=reads, faults=tuple(faults_of(equations, known)))


def as_known(written: Mapping[str, str]) -> dict[str, Unit]:
    """The units of names as formulas take them, where they are made of ours."""
    return {name: unit.to_formulas for name, text in written.items() if (unit := unit_of(text)) is not None}


def _deduced(equations: Iterable[Equation], known: Mapping[str, Unit], free: frozenset[str]) -> dict[str, Unit]:
    """The units that names get next: by their own formulas, else by those that they are in."""
    own: dict[str, Unit] = {}
    within: dict[str, Unit] = {}
    for one in equations:
        made = read_units(one.tree, known, free, _wanted(one, known))
        within = made.deduced | within
        if made.unit is not None and one.name in free and one.name not in known:
            own.setdefault(one.name, made.unit / one.per)
    return own or within


def _wanted(equation: Equation, known: Mapping[str, Unit]) -> Unit | None:
    """The unit that the formula of an equation should have."""
    unit = known.get(equation.name)
    return None if unit is None else unit * equation.per


def faults_of(equations: Iterable[Equation], known: Mapping[str, Unit]) -> Iterator[Fault]:
    """What does not fit in equations."""
    for one in equations:
        wanted = _wanted(one, known)
        made = read_units(one.tree, known, wanted=wanted)
        yield from (Fault(one, misfit) for misfit in made.misfits)
        # of numbers alone one that changes by 1 a second may be meant
        fits = made.unit in (None, wanted) or (one.key == "derivative" and made.unit == NUMBER)
        if not made.misfits and wanted is not None and not fits:
            assert made.unit is not None
            yield Fault(one, Unequal(made.unit, wanted, _suspect(one, known, made.unit / wanted)))


def _suspect(equation: Equation, known: Mapping[str, Unit], factor: Unit) -> str:
    """The only name in a formula with which the equation were right if its unit were another by a factor."""
    if not factor.is_scale:
        return ""
    found: list[str] = []
    for name in sorted(names(equation.tree) & known.keys()):
        for other in (known[name] * factor, known[name] / factor):
            changed = {**known, name: other}
            wanted = _wanted(equation, changed)
            made = read_units(equation.tree, changed, wanted=wanted)
            if not made.misfits and made.unit == wanted:
                found.append(name)
                break
    return found[0] if len(found) == 1 else ""


# Equations


def _equations(kind: Kind, parts: Parts, time: Unit) -> Iterator[Equation]:
    """All formulas of a definition, each with the name of what it is the value of."""
    of_name: list[tuple[str, str, Formula | None]] = []
    for name, parameter in parts.parameters.items():
        of_name += [
            (name, "value", parameter.value),
            (name, "min", parameter.minimum),
            (name, "max", parameter.maximum),
        ]
    of_name += [(name, "let", formula) for name, formula in parts.let.items()]
    for name, state in (parts.state or {}).items():
        of_name += [(name, key, formula) for key, formula in _formulas(state)]
    of_name += [(name, "outputs", formula) for name, formula in (parts.outputs or {}).items()]
    gives = parts.gives or kind.gives
    of_name += [(gives, "each_step", parts.each_step), (gives, "each_episode", parts.each_episode)]
    of_name += [
        (gives, "derivative", parts.derivative),
        *((gives, key, formula) for key, formula in parts.acts.items()),
    ]
    if parts.spike is not None:
        of_name += [(name, "set", formula) for name, formula in parts.spike.set.items()]
        of_name += [("", "when", parts.spike.when), (_CLOCK, "refractory", parts.spike.refractory)]
    per = {"derivative": NUMBER / time, "noise": NUMBER / time ** Fraction(1, 2)}
    for name, key, formula in of_name:
        if formula is not None and isinstance(formula.value, str):
            tree = parse(formula.value, extra_functions={"f": 1}, naming="ends")
            yield Equation(name, key, formula, tree, per.get(key, NUMBER))


def _formulas(state: Model) -> Iterator[tuple[str, Formula]]:
    """All formulas of a state, by their keys: whatever is written of it but its unit."""
    for key, value in state:
        if key != "unit" and isinstance(value, Located):
            yield key, value
