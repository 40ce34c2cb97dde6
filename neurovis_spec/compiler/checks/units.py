"""Units that do not fit: ``v + w`` where one is in mV and the other in pA, a derivative in mV/s of a state per ms.

In: the definitions of a spec and of the files that it includes, and between which models they are in use. Out: a Sheet
of each (``values/units.py``), and warnings at the part of a formula that does not fit. Where nothing has a unit there
is none.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.checks.definitions import choices_in
from neurovis_spec.compiler.names.references import Section
from neurovis_spec.compiler.network import Network, Route
from neurovis_spec.compiler.program import ACTIVATION, DRIVE, MODEL, RULE, SYNAPSE, EndName, Kind
from neurovis_spec.compiler.values.builtin import libraries
from neurovis_spec.compiler.values.units import Equation, Fault, Sheet, Unequal, as_known, faults_of, sheet_of
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.expressions.dimensions import Misfit
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import ExpressionError, Tree, names
from neurovis_spec.language.library import DefinitionModel, Library, Parts
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.sections import GroupModel
from neurovis_spec.language.units import NUMBER, SECOND, Unit, measured
from neurovis_spec.language.values import FormulaList
from neurovis_spec.language.yaml.source import Scalar

_KINDS: Final = (ACTIVATION, MODEL, RULE, SYNAPSE)


class Between(NamedTuple):
    """Where a rule or a synapse is in use: by which entry of the connections, between which models, on what way."""

    entry: int
    source: str
    target: str
    route: Route


class Sheets:
    """The units of the definitions of a spec, each made when it is asked for, once. ``own`` are the spec and the files
    that it includes."""

    def __init__(self, own: Iterable[Library], network: Network) -> None:
        self.own = tuple(own)
        self._network = network
        self._made: dict[tuple[Kind, str], Sheet] = {}

    @property
    def names(self) -> Iterator[tuple[Kind, str]]:
        """The definitions that are written there, in their order."""
        for library in self.own:
            for kind in _KINDS:
                yield from ((kind, name) for name in library.definitions[kind.section])

    @property
    def shown(self) -> Iterator[tuple[Kind, str]]:
        """These, and the built-in ones in use that have units."""
        yield from self.names
        used = dict.fromkeys((use.definition.kind, use.definition.name) for _, use in self._network.uses)
        yield from (key for key in used if not self.is_own(*key) and self.alone(*key).written)

    def alone(self, kind: Kind, name: str) -> Sheet:
        """The units of a definition by itself, whatever is at the ends of connections."""
        key = kind, name
        if key not in self._made:
            self._made[key] = sheet_of(kind, name, self._model(kind, name))
        return self._made[key]

    def between(self, kind: Kind, name: str, use: Between) -> Sheet:
        """The units of a rule or a synapse where it is in use."""
        return sheet_of(kind, name, self._model(kind, name), self._ends(use))

    def used(self, kind: Kind, name: str) -> Sheet:
        """The units of a definition with those at the ends of connections that are the same wherever it is in use."""
        uses = [self._ends(use) for use in self.uses.get((kind, name), ())]
        if not uses:
            return self.alone(kind, name)
        first, *others = uses
        same = {end: unit for end, unit in first.items() if all(other.get(end) == unit for other in others)}
        return sheet_of(kind, name, self._model(kind, name), same)

    @cached_property
    def uses(self) -> Mapping[tuple[Kind, str], list[Between]]:
        """Where rules and synapses are in use; of several entries between the same models the first."""
        network = self._network
        connections = network.connections
        model_of = np.zeros(len(network.neurons), dtype=np.int64)
        for number, population in enumerate(network.populations):
            model_of[population.members] = number
        models = [population.model.definition.name for population in network.populations]
        found: dict[tuple[Kind, str], dict[tuple[str, str, Route], Between]] = {}
        for projection in network.projections:
            of_all = connections.entry, connections.sources, connections.targets
            entries, *ends = (column.compact()[projection.members] for column in of_all)
            shape = len(connections.each_route), len(models), len(models)
            numbers = np.unique(np.ravel_multi_index((entries, *(model_of[of] for of in ends)), shape))
            those = found.setdefault((projection.kind, projection.use.definition.name), {})
            for entry, source, target in np.stack(np.unravel_index(numbers, shape), axis=1).tolist():
                one = Between(entry, models[source], models[target], connections.each_route[entry])
                those.setdefault(one[1:], one)
        return {key: [*those.values()] for key, those in found.items()}

    def is_own(self, kind: Kind, name: str) -> bool:
        """Whether a definition is one of those of the spec and of the files that it includes."""
        return any(name in library.definitions[kind.section] for library in self.own)

    def _model(self, kind: Kind, name: str) -> DefinitionModel:
        """A definition as it is written; an author's own before the built-in ones."""
        every = (library.definitions[kind.section] for library in (*self.own, *libraries()))
        return next(made[name] for made in every if name in made)

    def _ends(self, use: Between) -> dict[str, Unit]:
        """The units of what is read at both ends."""
        source, target = (self.alone(MODEL, name) for name in (use.source, use.target))
        known = {EndName("pre", name).text: unit for name, unit in source.known.items()}
        known |= {EndName("post", name).text: unit for name, unit in target.known.items()}
        send = source.parts.send
        sent = use.route.sends or (MODEL.gives if send is None else send.value)
        ends = {"pre": source.known.get(sent), "sent": source.known.get(sent), "post": target.known.get(MODEL.gives)}
        return known | {name: unit for name, unit in ends.items() if unit is not None}


def check_units(compiled: Compiled, findings: Findings) -> None:
    """Warn of units that do not fit."""
    sheets = Sheets(compiled.libraries, compiled.network)
    for kind, name in sheets.names:
        sheet = sheets.alone(kind, name)
        for fault in _different(sheet):
            _tell(fault, sheet, findings)
    _check_settings(compiled, sheets, findings)
    for (kind, name), uses in sheets.uses.items():
        if not sheets.alone(kind, name).faults:
            _check_uses(kind, name, uses, sheets, compiled, findings)


def _check_uses(
    kind: Kind, name: str, uses: Iterable[Between], sheets: Sheets, compiled: Compiled, findings: Findings
) -> None:
    """Warn of what does not fit with the models at the ends of a rule or a synapse, and at the port that it leads to:
    in its formulas, once, or at an entry with a built-in one."""
    own = sheets.is_own(kind, name)
    for use in uses:
        if not (own or sheets.is_own(MODEL, use.source) or sheets.is_own(MODEL, use.target)):
            continue
        sheet = sheets.between(kind, name, use)
        key = compiled.bundles[use.entry].key
        for fault in _different(sheet):
            _tell(fault, sheet, findings, None if own else key)
        if kind == SYNAPSE and not sheet.faults:
            _check_ports(sheet, sheets.alone(MODEL, use.target), use, key, findings)
        if own and sheet.faults:
            return


def _check_ports(sheet: Sheet, target: Sheet, use: Between, key: Span, findings: Findings) -> None:
    """Warn of a port that is in another unit than what a synapse brings there."""
    brought = sheet.known.get(SYNAPSE.gives)
    for port, factor in use.route.ports:
        unit = target.known.get(port)
        if brought is not None and unit not in (None, brought) and factor == 1:
            assert unit is not None
            message = f"'{sheet.name}' brings {sheet.told(brought)}, and '{port}' of '{target.name}' takes"
            findings.warning("unit", key, f"{message} {target.told(unit)}", _hint(brought, unit))


class _Setting(NamedTuple):
    """What has a unit and is set to a formula where it is in use, and the units of all that it is set beside."""

    name: str
    unit: Unit
    formula: Formula
    written: Mapping[str, str] = MappingProxyType({})

    @property
    def equations(self) -> list[Equation]:
        """The setting as an equation, where it is a formula."""
        if not isinstance(self.formula.value, str) or measured(self.formula.value) is not None:
            return []
        try:
            tree = parse(self.formula.value, random=True, naming="ends")
        except ExpressionError:  # it names an instance: of its parameters nothing is known here
            return []
        return [Equation(self.name, "setting", self.formula, tree)]


def _check_settings(compiled: Compiled, sheets: Sheets, findings: Findings) -> None:
    """Warn of what is set to formulas in another unit, of parameters of the spec or of a module that have one."""
    for section, _ in compiled.sections:
        labels = {name: one.measure for name, one in section.parameters.items() if one.measure}
        for one in _settings(section, sheets) if labels else ():
            known, written = {**as_known(labels), one.name: one.unit}, {**one.written, **labels}
            seen = Sheet(MODEL, "", Parts({}, {}, None), written, known, (), ())
            for fault in faults_of(one.equations, known):
                _tell(fault, seen, findings)


def _settings(section: Section, sheets: Sheets) -> Iterator[_Setting]:
    """What a section sets: parameters of definitions, what neurons begin with and are given, delays and rates."""
    for of, choice in choices_in(section):
        kind = next(kind for kind in _KINDS if kind.section == of)
        sheet = sheets.alone(kind, choice.name.value)
        for entry in choice.settings.entries:
            unit = sheet.known.get(entry.name) if entry.name in sheet.parts.parameters else None
            if unit is not None and isinstance(entry.value, Scalar) and isinstance(entry.value.value, str):
                formula: Formula = Located(entry.value.value, entry.value)
                yield _Setting(f"{entry.name} of {sheet.name}", unit, formula, sheet.written)
    for group in section.neurons.values():
        if group.model is not None:
            yield from _given(group, sheets.alone(MODEL, group.model.name.value))
    for key, body in section.connections:
        if body.delay is not None and body.delay.in_seconds and isinstance(body.delay.value, Located):
            yield _Setting(f"the delay of {shorten(key.value)}", SECOND, body.delay.value)
    for name, model in section.inputs.items():
        if model.poisson is not None:
            yield _Setting(f"the rate of {name}", NUMBER / SECOND, model.poisson)


def _given(group: GroupModel, sheet: Sheet) -> Iterator[_Setting]:
    """What states of the neurons of a group begin with, and the bias of their ports."""
    given = [(state.value, values) for state, values in (() if group.initial is None else group.initial.states)]
    given += [(DRIVE if at.port is None else at.port.value, at.value) for at in group.bias or ()]
    for name, values in given:
        formulas = values.items if isinstance(values, FormulaList) else (values,)
        for formula in formulas if name in sheet.known else ():
            if isinstance(formula, Located):
                yield _Setting(f"{name} of {sheet.name}", sheet.known[name], formula, sheet.written)


def _different(sheet: Sheet) -> Iterator[Fault]:
    """The faults of a definition, of those of the same part in the same words the first."""
    told: set[tuple[str, Unit, Unit]] = set()
    for fault in sheet.faults:
        text = str(fault.equation.formula.value)
        part = _quoted(fault.what.part, text) if isinstance(fault.what, Misfit) else text
        key = part, fault.what.found, fault.what.wanted
        if key not in told:
            told.add(key)
            yield fault


# What is said


def _tell(fault: Fault, sheet: Sheet, findings: Findings, place: Span | None = None) -> None:
    """Warn of a fault where it stands, or at a ``place`` that has the definition in use."""
    node = fault.equation.formula.node
    text = str(fault.equation.formula.value)
    if isinstance(fault.what, Misfit):
        message, part = _misfit(fault.what, text, sheet), fault.what.part
        own = node.at(part.start, part.end)
    else:
        message, suspected = _unequal(fault, fault.what, sheet), fault.equation.named(fault.what.suspect)
        own = node.at(suspected[0].start, suspected[0].end) if len(suspected) == 1 else node.span
    if place is not None:
        message = f"in the {sheet.kind.name} '{sheet.name}' {message}"
    hint = _hint(fault.what.found, fault.what.wanted)
    if isinstance(fault.what, Unequal) and fault.equation.key == "derivative":
        hint = f"derivatives are per {sheet.parts.time} here (time); {hint}"
    findings.warning("unit", place or own, message, hint)


def _misfit(misfit: Misfit, text: str, sheet: Sheet) -> str:
    """What is said of a part of a formula."""
    part, found = _quoted(misfit.part, text), _in(misfit.found, sheet)
    if misfit.function:
        what = "an exponent" if misfit.function == "^" else f"{misfit.function}()"
        return f"{what} is of a number, and {part} is {found}"
    # rather one whose unit follows from what is declared alone
    sure = sorted(misfit.beside, key=lambda one: not names(one) <= sheet.written.keys())
    beside = _quoted(sure[0], text) if sure else "what is beside it"
    return f"{part} is {found}, {beside} {_in(misfit.wanted, sheet)}"


def _in(unit: Unit, sheet: Sheet) -> str:
    """That something is in a unit."""
    if unit == NUMBER:
        return "a number without unit"
    return f"{sheet.told(unit)} times a number" if unit.is_scale else f"in {sheet.told(unit)}"


def _unequal(fault: Fault, unequal: Unequal, sheet: Sheet) -> str:
    """What is said of a formula as a whole."""
    name, key, *_, per = fault.equation
    found, whole = sheet.told(unequal.found), sheet.told(unequal.wanted / per)
    suspect = f"{unequal.suspect} in {sheet.told(sheet.known[unequal.suspect])}: " if unequal.suspect else ""
    time = sheet.parts.time
    match key:
        case "derivative":
            what = "state" if name in (sheet.parts.state or {}) else "value"
            return f"{suspect}{name}' is in {found}, its {what} in {whole} per {time}"
        case "noise":
            return f"{suspect}the noise of {name} is in {found}, its state in {whole} per root of {time}"
        case "refractory":
            return f"{suspect}the refractory time is in {found}, not in {whole}"
        case "setting":
            return f"{suspect}{name} is in {whole}, and is set to what is in {found}"
        case "let" | "outputs":
            return f"{suspect}{name} is in {found}, and is taken for {whole}"
        case _:
            return f"{suspect}{name} is in {whole}, its '{key}' in {found}"


def _hint(found: Unit, wanted: Unit) -> str:
    """What to do about a unit that does not fit."""
    factor = (found / wanted).factor
    if factor is not None:
        return f"they differ by a factor of {float(factor):g}: a number in front converts, since it has any unit"
    if wanted == NUMBER:
        return "divide it by what has that unit; a number that is written has any"
    return "what is added, compared or assigned has one unit; a number that is written has any"


def _quoted(part: Tree, text: str) -> str:
    return shorten(text[part.start : part.end])
