"""Size estimate: whether a spec makes more instances or neurons than there may be, found before any of them is made.

In: a section, its Constants, the modules. Out: how many instances it makes, or a finding. Modules within modules
multiply, so that a few lines can ask for more than any machine holds. Modules are gone through from the outside in,
each of them once, with an array for each parameter, a number an instance; beyond the limit nothing is counted. What is
invalid counts as nothing here, and is found where the instances are made.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping
from graphlib import TopologicalSorter
from typing import NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.limits import MOST_INSTANCES, amount
from neurovis_spec.compiler.names.modules import Module
from neurovis_spec.compiler.names.references import Section, key_span
from neurovis_spec.compiler.values.constants import NEAR_INTEGER, Constants
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import Formula
from neurovis_spec.language.modules import InstanceModel
from neurovis_spec.language.sections import GroupModel
from neurovis_spec.language.tables import TableColumn
from neurovis_spec.language.unknown import UNKNOWN, Names

#: The instances of one module: for each entry that makes some how many these are, and what is set in each of them.
_Made: TypeAlias = list[tuple[int, Mapping[str, FloatArray]]]


class _Entered(NamedTuple):
    """What an entry makes: how many instances of a module, and what is set in each of them."""

    module: str
    instances: int
    given: Mapping[str, FloatArray]


class _LargeGroupError(Exception):
    """A group that has too many neurons by itself: its ``count``, and how many these are."""

    def __init__(self, count: Formula, neurons: int) -> None:
        super().__init__()
        self.count, self.neurons = count, neurons


class SizeEstimate:
    """Counts instances and neurons of a spec and its modules, none of which holds itself; ``most`` neurons are not too
    many."""

    def __init__(self, modules: Mapping[str, Module], dt: float, most: int) -> None:
        self._modules = modules
        self._dt = dt
        self._most = most
        inner = {
            name: [entry.module.value for entry in module.model.instances.values() if entry.module.value in modules]
            for name, module in modules.items()
        }
        self._order = tuple(TopologicalSorter(inner).static_order())[::-1]

    def instances(self, section: Section, constants: Constants, findings: Findings) -> int | None:
        """How many instances a section makes with all that is within it. None where these, or the neurons in them, are
        too many: then the finding stands at the first entry that is one too many, or at a group that is too large by
        itself; the section's own groups are left to who makes them."""
        own = sum(float(size_of(group, constants, {}, 1)[0]) for group in section.neurons.values())
        if own > self._most:
            return None
        entries = tuple(section.instances.items())
        entered = tuple(self._entered((model for _, model in entries), constants, {}, 1))

        def count_of_first(few: int) -> tuple[int, int]:
            """Instances and neurons with so many entries."""
            instances, neurons = self._count(entered[:few])
            return instances, int(own) + neurons

        def are_too_many(few: int) -> bool:
            instances, neurons = count_of_first(few)
            return instances > MOST_INSTANCES or neurons > self._most

        try:
            instances, neurons = count_of_first(len(entered))
            if instances <= MOST_INSTANCES and neurons <= self._most:
                return instances
            # the first entry with which there are too many: mostly the last that was counted, else by bisection
            few = len(entered) - 1
            first = 1 + few if not are_too_many(few) else 1 + bisect_left(range(1, few), True, key=are_too_many)
            name, model = entries[first - 1]
            span = key_span(section, "instances", name) if model.count is None else model.count.span
            instances, neurons = count_of_first(first)
        except _LargeGroupError as error:
            span, instances, neurons = error.count.span, 0, error.neurons
        if instances > MOST_INSTANCES:
            message = f"this makes more than {MOST_INSTANCES:,} instances, the most that there may be"
            findings.error("too-many", span, message)
        else:
            message = f"this makes {amount(neurons)} neurons; the limit is {self._most:,}"
            findings.error("too-many", span, message, "raise it with --limit")
        return None

    def _count(self, entered: Iterable[_Entered]) -> tuple[int, int]:
        """The instances that entries make, with all that is within, and their neurons; beyond MOST_INSTANCES nothing is
        counted. Raises _LargeGroupError."""
        waiting: dict[str, _Made] = {name: [] for name in self._order}
        instances = _wait(entered, waiting)
        neurons = 0
        for name in self._order:
            model, made = self._modules[name].model, waiting[name]
            rows = sum(size for size, _ in made)
            if not rows or instances > MOST_INSTANCES:
                continue
            own = Constants(Names(), self._dt, Findings())
            known: dict[str, FloatArray] = {}
            for key, parameter in model.parameters.items():
                given = np.concatenate([values.get(key, np.full(size, np.nan)) for size, values in made])
                if np.isnan(given).any():
                    value = own.unchecked(parameter.value, known)
                    given = np.where(np.isnan(given), np.nan if value is UNKNOWN else value, given)
                known[key] = given
            for group in model.neurons.values():
                sizes = size_of(group, own, known, rows)
                if group.count is not None and sizes.max() > self._most:
                    raise _LargeGroupError(group.count, int(sizes.max()))
                neurons += int(sizes.sum())
            instances += _wait(self._entered(model.instances.values(), own, known, rows), waiting)
        return instances, neurons

    def _entered(
        self, entries: Iterable[InstanceModel], constants: Constants, known: Mapping[str, FloatArray], rows: int
    ) -> Iterator[_Entered]:
        """What entries make in so many scopes, up to the one that makes more than MOST_INSTANCES."""
        instances = 0
        for model in entries:
            module = model.module.value
            if module not in self._modules:
                yield _Entered(module, 0, {})
                continue
            counts = size_of(model, constants, known, rows)
            instances += int(counts.sum())
            if instances > MOST_INSTANCES:
                yield _Entered(module, int(counts.sum()), {})
                return
            scopes = np.repeat(np.arange(rows), counts.astype(np.int64))
            first = np.cumsum(counts) - counts
            around = {key: value[scopes] for key, value in known.items()}
            around |= {"i": np.arange(len(scopes)) - first[scopes], "n": counts[scopes]}
            given: dict[str, FloatArray] = {}
            for key, formula in model.formulas(self._modules[module].model.matrices).items():
                value = constants.unchecked(formula, around)
                given[key] = np.broadcast_to(np.nan if value is UNKNOWN else value, scopes.shape)
            yield _Entered(module, len(scopes), given)


def _wait(entered: Iterable[_Entered], waiting: Mapping[str, _Made]) -> int:
    """How many instances entries make; up to MOST_INSTANCES these wait until their module's turn comes."""
    instances = 0
    for entry in entered:
        instances += entry.instances
        if instances > MOST_INSTANCES:
            break
        if entry.instances:
            waiting[entry.module].append((entry.instances, entry.given))
    return instances


def size_of(
    group: GroupModel | InstanceModel, constants: Constants, known: Mapping[str, FloatArray], rows: int
) -> FloatArray:
    """How many neurons a group has, or instances an entry makes, in each row."""
    if group.count is None:
        names = () if isinstance(group.names, TableColumn) else group.names or ()  # no file is opened here
        return np.full(rows, float(len(names) or 1))
    return _counted(group.count, constants, known, rows)


def _counted(formula: Formula | None, constants: Constants, known: Mapping[str, FloatArray], rows: int) -> FloatArray:
    """A count, in each row; 0 where it is none."""
    value = 1.0 if formula is None else constants.unchecked(formula, known)
    counts = np.broadcast_to(np.asarray(0.0 if value is UNKNOWN else value, dtype=np.float64), (rows,))
    with np.errstate(invalid="ignore"):
        right = (counts >= 1) & (counts <= 2**53) & (np.abs(counts - np.rint(counts)) <= NEAR_INTEGER)
        return np.where(right, np.rint(counts), 0.0)
