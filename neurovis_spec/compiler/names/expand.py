"""Scopes: the spec itself and every instance of a module, each with what the names in it mean.

In: the root's Spec (or a module that is checked by itself), the Library, Constants. Out: Scopes in the order of their
neurons: a scope before the instances within it, and all inputs of the network. An instance's parameters are worked out
anew, with what ``set`` gives them; its inputs are those of the scope around it, or inputs of the network.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Final, NamedTuple

from neurovis_spec.compiler.events.settable import ParameterFormula
from neurovis_spec.compiler.limits import DEEPEST, MOST_INSTANCES, Limits
from neurovis_spec.compiler.names.input_bindings import InputBinding, bindings_of, check_sizes, shared_out
from neurovis_spec.compiler.names.listed import listed_names
from neurovis_spec.compiler.names.modules import Library, Module
from neurovis_spec.compiler.names.references import Section, home_of, key_of, key_span
from neurovis_spec.compiler.names.scope import Expansion, GivenMatrix, Scope
from neurovis_spec.compiler.names.size_estimate import SizeEstimate
from neurovis_spec.compiler.network import Input
from neurovis_spec.compiler.neurons.inputs import make_input
from neurovis_spec.compiler.values.constants import Constants, Outside
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.compiler.values.parameters import make_parameters
from neurovis_spec.diagnostics import Findings, Undeclared, shorten
from neurovis_spec.language.expressions.tree import Number, names, substitute
from neurovis_spec.language.located import NAME_RULE, Formula, Located, in_unit, too_long
from neurovis_spec.language.model import names_of, unread
from neurovis_spec.language.modules import InstanceModel, ModuleModel
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.tables import TableColumn
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown
from neurovis_spec.likeness import suggest

#: What ``set`` knows beside the parameters: the number of the instance, from 0, and how many its entry makes.
_SETTING = formula_at(InstanceModel, "set", "PARAMETER")
COUNTED = _SETTING.sees
#: What to do where a module reads a parameter from around it.
_OUTSIDE: Final = "a module sees its own parameters alone: declare '{0}' there, and give it with set: {{{0}: {0}}}"


@dataclass(frozen=True)
class _Place:
    """Where an instance stands: its names, and how many there are of it. Of ``left: {count: 3}`` the second one is
    ``left2``, number 2, at position 1 of 3."""

    path: str
    #: the path without the number
    declared: str
    #: 0 where it is not counted
    number: int
    position: int
    count: int


class _Given(NamedTuple):
    """What an instance gives its module: inputs; parameters, with the names that are read for each; matrices."""

    inputs: Mapping[str, InputBinding] = MappingProxyType({})
    settings: Mapping[str, frozenset[str]] = MappingProxyType({})
    matrices: Mapping[str, GivenMatrix | Unknown] = MappingProxyType({})


class _StoppedError(Exception):
    """There are too many instances; the finding is reported."""


@dataclass
class Expander:
    """Makes the scopes of a network."""

    library: Library
    root: Path
    findings: Findings
    dt: float
    #: the scopes so far; None for one whose inputs are being made
    scopes: list[Scope | None] = field(default_factory=list)
    #: the inputs of the network so far
    inputs: list[Input] = field(default_factory=list)
    #: one for each folder, so that each file is read once
    files: dict[Path, Files] = field(default_factory=dict)
    #: the names of the modules that have an instance
    used: set[str] = field(default_factory=set)
    #: how many scopes were made by all expansions so far
    scopes_made: int = 0
    #: whether a finding says that there would be too many, or that they are nested too deep
    stopped: bool = False
    limits: Limits = field(default_factory=Limits)

    @cached_property
    def _size_estimate(self) -> SizeEstimate:
        return SizeEstimate(self.library.modules.known(), self.dt, self.limits.neurons)

    def expand(self, section: Section, constants: Constants, folder: Path, module: str | None = None) -> Expansion:
        """The scopes of a section whose parameters are known, and the inputs of the network. ``module``: it is a module
        that is checked by itself."""
        path = module or ""
        self.scopes, self.inputs = [], []
        try:
            self._make_scope(section, constants, folder, _Place(path, path, 0, 0, 1), (), module=module)
        except _StoppedError:  # which instances there are is not known then
            root = self._scope(0)
            self.scopes = [replace(root, children=root.children.opened())]
        self.scopes_made += len(self.scopes)
        return Expansion(tuple(map(self._scope, range(len(self.scopes)))), tuple(self.inputs))

    def files_in(self, folder: Path) -> Files:
        """The data files that are named relative to a folder."""
        if folder not in self.files:
            self.files[folder] = Files(folder, self.root, self.findings)
        return self.files[folder]

    def _make_scope(
        self,
        section: Section,
        constants: Constants,
        folder: Path,
        place: _Place,
        ancestors: tuple[int, ...],
        given: _Given | None = None,
        module: str | None = None,
    ) -> int:
        """Make one scope and those within it. ``ancestors`` are the indices of the scopes around it, the spec
        first. Returns the index of the scope."""
        index = len(self.scopes)
        self.scopes.append(None)
        files, given = self.files_in(folder), given or _Given()
        inputs = self._inputs(section, constants, files, place, given.inputs)
        scope = Scope(
            path=place.path,
            section=section,
            constants=constants,
            definitions=self.library.definitions,
            files=files,
            inputs=inputs,
            children=names_of(section, "instances", {}),  # those within are not known yet
            module=module,
            parent=ancestors[-1] if ancestors else -1,
            declared=place.declared,
            number=place.number,
            settings=given.settings,
            matrices=self._matrices(section, constants, files, given.matrices),
        )
        self.scopes[index] = scope
        if not ancestors:
            self._check_size(scope)
        if not section.instances:
            return index
        by_name = self._children(section, scope, (*ancestors, index))
        children = names_of(section, "instances", by_name)
        inner = {  # inputs of a single instance are also seen from here, as INSTANCE.INPUT
            f"{name}.{key}": its_input
            for name, scopes in children.known().items()
            if len(scopes) == 1
            for key, its_input in self._scope(scopes[0]).inputs.items()
        }
        self.scopes[index] = replace(scope, children=children, inputs=Names({**inputs, **inner}, inputs.is_open))
        return index

    def _children(
        self, section: Section, scope: Scope, ancestors: tuple[int, ...]
    ) -> dict[str, tuple[int, ...] | Unknown]:
        """Make the scopes of the instances in a section; their indices by name."""
        by_name: dict[str, tuple[int, ...] | Unknown] = {}
        of_tables: set[str] = set()  # their names are known from here alone, to whoever compares them
        for name, model in section.instances.items():
            made = self._instances(name, model, scope, ancestors)
            by_name.update({one: places for one, places in made.items() if one not in of_tables})
            if isinstance(model.names, TableColumn):
                of_tables.update(made)
        return by_name

    def _check_size(self, scope: Scope) -> None:
        """Refuse more instances, or neurons, than there may be before any of them is made. Modules that are checked
        by themselves share the limit of instances: one that would go beyond it is made without the instances within
        it, which is no finding."""
        if self.stopped:
            raise _StoppedError
        if scope.section.instances:
            quiet = replace(scope.constants, findings=Findings(), structural=set())
            instances = self._size_estimate.instances(scope.section, quiet, self.findings)
            self.stopped = instances is None
            if instances is None or (self.scopes_made + instances > MOST_INSTANCES and scope.module is not None):
                raise _StoppedError

    def _scope(self, index: int) -> Scope:
        scope = self.scopes[index]
        assert scope is not None
        return scope

    def _inputs(
        self,
        section: Section,
        constants: Constants,
        files: Files,
        place: _Place,
        bound: Mapping[str, InputBinding],
    ) -> Names[Input]:
        """The inputs of a scope by their names in it; those that are not bound are inputs of the network."""
        result: dict[str, Input | Unknown] = {}
        for name, model in section.inputs.items():
            start = 0 if not self.inputs else self.inputs[-1].start + self.inputs[-1].size
            made = make_input(name, model, start, section, constants, files)
            if made is UNKNOWN or name in bound:
                result[name] = made if made is UNKNOWN else shared_out(made, bound[name], place.position, place.count)
                continue
            if place.path:
                tree = made.expression
                if tree is not None:  # the network knows the parameters of the spec, and those that follow them
                    values = {
                        key: Number(value)
                        for key, value in constants.parameters.items()
                        if key not in constants.settable
                    }
                    tree = substitute(tree, values)
                made = replace(made, name=f"{place.path}.{name}", expression=tree)
            self.inputs.append(made)
            result[name] = made
        return names_of(section, "inputs", result)

    def _instances(
        self, name: str, model: InstanceModel, scope: Scope, ancestors: tuple[int, ...]
    ) -> Mapping[str, tuple[int, ...] | Unknown]:
        """The indices of the scopes of the instances that one entry makes, by name: ``left1`` has one, ``left`` all of
        a counted one."""
        module = self._module(model)
        count = None if model.count is None else scope.constants.integer(model.count, "'count'", 1)
        if module is UNKNOWN or count is UNKNOWN or not model.unknown.isdisjoint(("count", "names")):
            for formula in model.formulas(()).values():
                scope.constants.value(formula, dict.fromkeys(COUNTED, UNKNOWN))
            bindings_of(model, scope, self.findings)
            return {name: UNKNOWN}
        if len(ancestors) > DEEPEST:
            span = key_span(scope.section, "instances", name)
            self.findings.error("too-deep", span, f"modules are nested at most {DEEPEST} deep")
            self.stopped = True
            raise _StoppedError
        instance_names = self._instance_names(name, model, count, scope)
        if instance_names is UNKNOWN:
            return {name: UNKNOWN}
        single = count is None and model.names is None
        self.used.add(module.name)
        self._check_keys(model, module)
        bound, matrices = bindings_of(model, scope, self.findings), self._set_matrices(model, module, scope)
        result: dict[str, tuple[int, ...]] = {}
        for position, instance_name in enumerate(instance_names):
            number = 0 if single else position + 1
            place = _Place(scope.called(instance_name), scope.called(name), number, position, len(instance_names))
            constants, settings = self._constants(model, module, scope, place)
            given = _Given(bound, settings, matrices)
            index = self._make_scope(module.model, constants, module.folder, place, ancestors, given, module.name)
            result[instance_name] = (index,)
        for binding in bound.values():
            check_sizes(binding, instance_names, self.findings)
        if not single:
            result[name] = tuple(result[instance_name][0] for instance_name in instance_names)
        return result

    def _matrices(
        self, section: Section, constants: Constants, files: Files, given: Mapping[str, GivenMatrix | Unknown]
    ) -> Names[GivenMatrix]:
        """The matrices of a scope by their names: those that are given, the others as they are written."""
        if not isinstance(section, ModuleModel):
            return Names()
        for name in section.matrices:
            if name in section.parameters:
                span = key_of(section.source, "matrices", name).span
                message = f"'{name}' is a parameter of this module, and a matrix"
                self.findings.error("duplicate-name", span, message, "rename one of them")
        own = {name: GivenMatrix(written, constants, files) for name, written in section.matrices.items()}
        return names_of(section, "matrices", {**own, **given})

    def _set_matrices(self, model: InstanceModel, module: Module, scope: Scope) -> dict[str, GivenMatrix | Unknown]:
        """The matrices that an instance sets: rows, files, or matrices of the scope around it. A finding for what is
        no matrix, or no parameter."""
        found: dict[str, GivenMatrix | Unknown] = {}
        known = names_of(module.model, "matrices", module.model.matrices)
        for name, value in model.set.items():
            if isinstance(value, Located):
                if name in known:
                    found[name] = self._matrix_around(value, module, name, scope)
            elif name in known:
                found[name] = GivenMatrix(value, scope.constants, scope.files)
            elif name in module.model.parameters:
                message = f"'{name}' of the module '{module.name}' is a number, and this a matrix"
                self.findings.error("wrong-type", value.span, message, "matrices stand under 'matrices' of a module")
        return {**found, **{name: UNKNOWN for name in unread(model, "set") if name in known}}

    def _matrix_around(self, named: Formula, module: Module, name: str, scope: Scope) -> GivenMatrix | Unknown:
        """A matrix of the scope around an instance, by its name."""
        matrix = scope.matrices.get(str(named.value))
        if matrix is not None:
            return matrix
        message = f"'{name}' of the module '{module.name}' is a matrix"
        hint = suggest(str(named.value), scope.matrices, "matrices out here") if scope.matrices else None
        self.findings.error("wrong-type", named.span, message, hint or "write rows, [[1, 2], [3, 4]], or {file: …}")
        return UNKNOWN

    def _instance_names(
        self, name: str, model: InstanceModel, count: int | None, scope: Scope
    ) -> tuple[str, ...] | Unknown:
        """What the instances of an entry are called."""
        span = key_span(scope.section, "instances", name)
        if model.names is not None:
            listed = listed_names(model.names, model.source, scope.files, "duplicate-name")
            names = UNKNOWN if listed is UNKNOWN else listed.checked(count, self.findings)
            if names is not UNKNOWN and name in names:
                message = f"'{name}' is all of these instances, and one of them, too"
                self.findings.error("duplicate-name", span, message, "rename one of them")
                return UNKNOWN
            return names
        names = (name,) if count is None else tuple(f"{name}{number}" for number in range(1, count + 1))
        if len(names[-1]) > 64:
            self.findings.error("bad-name", span, too_long(names[-1]), NAME_RULE)
            return UNKNOWN
        return names

    def _module(self, model: InstanceModel) -> Module | Unknown:
        """The module that an instance names; UNKNOWN, and a finding, where there is none."""
        name, known = model.module.value, self.library.modules
        found = known.get(name)
        if found is None:
            self.findings.error(
                "unknown-module",
                model.module.span,
                f"there is no module '{shorten(name)}'",
                lambda: suggest(name, known, "modules") or "there are no modules; add it under 'modules'",
                undeclared=Undeclared(name, home_of(None, ("modules",))),
            )
        return UNKNOWN if found is None else found

    def _check_keys(self, model: InstanceModel, module: Module) -> None:
        """What ``set`` and ``inputs`` name must be the module's."""
        inner = module.model
        settable: dict[str, object] = {**inner.parameters, **inner.matrices}
        parameters, matrices = (names_of(inner, part, settable) for part in ("parameters", "matrices"))
        parts: tuple[tuple[str, Mapping[str, object], str, Collection[str]], ...] = (
            ("set", model.set, "parameter", parameters.over(matrices)),
            ("inputs", model.inputs, "input", names_of(inner, "inputs", inner.inputs)),
        )
        for part, given, what, known in parts:
            for name in given:
                if name not in known:
                    message = f"the module '{module.name}' has no {what} '{shorten(name)}'"
                    hint = suggest(name, known, f"{what}s of '{module.name}'")
                    span, home = key_of(model.source, part, name).span, home_of(module.name, (f"{what}s",))
                    self.findings.error(f"unknown-{what}", span, message, hint, undeclared=Undeclared(name, home))

    def _constants(
        self, model: InstanceModel, module: Module, scope: Scope, place: _Place
    ) -> tuple[Constants, dict[str, frozenset[str]]]:
        """The constants of one instance, and for each of its settings the names that its formula reads."""
        outer = scope.constants
        constants = constants_of(module, self.dt, self.findings)
        around = Outside(outer.names, _OUTSIDE)
        constants = replace(constants, slots=outer.slots, path=place.path, outside=around, timed=outer.timed)
        extra = dict(zip(COUNTED, (float(place.position), float(place.count)), strict=True))
        given: dict[str, float] = {}
        following_settings: dict[str, ParameterFormula] = {}
        names_read: dict[str, frozenset[str]] = {}
        formulas = model.formulas(module.model.matrices)
        for name, written in formulas.items():
            parameter = module.model.parameters.get(name)
            formula = in_unit(written, "" if parameter is None else parameter.measure, self.findings)
            value = scope.constants.value(formula, extra)
            if name not in module.model.parameters:
                continue
            if value is UNKNOWN:
                constants.names.declared[name] = UNKNOWN
                continue
            given[name] = float(value)
            tree = scope.constants.tree(formula, _SETTING) if isinstance(formula.value, str) else UNKNOWN
            names_read[name] = frozenset() if tree is UNKNOWN else names(tree)
            if tree is not UNKNOWN and not names(tree).isdisjoint(outer.settable):
                following_settings[name] = outer.bound(tree, extra)
        constants.settings = following_settings
        constants.names.declared.update(unread(model, "set"))
        places = {name: formula.span for name, formula in formulas.items()}
        make_parameters(module.model, constants, given, places)
        return constants, names_read


def constants_of(module: Module, dt: float, findings: Findings) -> Constants:
    """Constants for the parameters of a module, before these are known."""
    home = home_of(module.name, ("parameters",))
    return Constants(names_of(module.model, "parameters", {}), dt, findings, home=home)
