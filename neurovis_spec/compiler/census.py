"""The census: how many instances a spec makes, counted before any of them is made.

In: the entries of ``instances``, the Constants around them, the modules. Out: a number. Modules within modules
multiply, so that a few lines can ask for more than any machine holds. A module is counted once for each set of values
that its counts depend on, however often it is used; what is at fault counts as nothing here, and is found where the
instances are made.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from neurovis_spec.compiler.constants import Constants
from neurovis_spec.compiler.limits import DEEPEST, MOST_INSTANCES
from neurovis_spec.compiler.modules import Module
from neurovis_spec.compiler.parameters import make_parameters
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.expressions.parser import ExpressionError, parse
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.located import Formula
from neurovis_spec.language.modules import InstanceModel

#: What is set of a module that its counts depend on.
_Given: TypeAlias = tuple[tuple[str, float], ...]


class TooManyError(Exception):
    """There are more instances than there may be, however many."""


@dataclass
class Census:
    """Counts instances. Raises TooManyError where it has seen more than there may be and is not done yet."""

    modules: Mapping[str, Module]
    dt: float
    totals: dict[tuple[str, _Given], int] = field(default_factory=dict)
    wanted: dict[str, frozenset[str]] = field(default_factory=dict)
    #: instances that were looked at one by one: each of them is made at least once
    seen: int = 0

    def of_entry(self, model: InstanceModel, constants: Constants, depth: int = 0) -> int:
        """The instances that one entry makes, with those within them."""
        module = self.modules.get(model.module.value)
        count = 1 if model.count is None else constants.integer(model.count, "", 1, structural=False)
        if module is None or count is None or depth >= DEEPEST:
            return 0
        if count > MOST_INSTANCES:
            return count
        return sum(
            many * (1 + self._within(module, given, depth))
            for given, many in self._given(model, module, constants, count).items()
        )

    def _within(self, module: Module, given: _Given, depth: int) -> int:
        """The instances within one of a module of which this is set."""
        key = module.name, given
        if key not in self.totals:
            constants = Constants({}, self.dt, Findings())
            make_parameters(module.model, constants, dict(given))
            models = module.model.instances.values()
            self.totals[key] = sum(self.of_entry(model, constants, depth + 1) for model in models)
        return self.totals[key]

    def _given(self, model: InstanceModel, module: Module, constants: Constants, count: int) -> Counter[_Given]:
        """What is set in the instances of an entry, as far as counts depend on it, and in how many of them."""
        wanted = self._wanted(module, 0)
        formulas = {name: formula for name, formula in model.set.items() if name in wanted}
        if not formulas:
            return Counter({(): count})
        self.seen += count
        if self.seen > MOST_INSTANCES:
            raise TooManyError
        place = np.arange(count, dtype=np.float64)
        columns: list[list[float]] = []
        for formula in formulas.values():
            value = constants.value(formula, {"i": place, "n": float(count)})
            columns.append([] if value is None else np.broadcast_to(np.asarray(value), (count,)).tolist())
        return Counter(tuple(zip(formulas, row, strict=True)) for row in zip(*columns, strict=False))

    def _wanted(self, module: Module, depth: int) -> frozenset[str]:
        """The parameters of a module on which it depends how many instances there are in it."""
        if module.name not in self.wanted:
            found: set[str] = set()
            for model in module.model.instances.values():
                found.update(_names(() if model.count is None else (model.count,)))
                inner = self.modules.get(model.module.value)
                if inner is not None and depth < DEEPEST:
                    below = self._wanted(inner, depth + 1)
                    found.update(_names(formula for name, formula in model.set.items() if name in below))
            for name, parameter in reversed(module.model.parameters.items()):  # one may use those before it
                if name in found:
                    found.update(_names((parameter.value,)))
            self.wanted[module.name] = frozenset(found)
        return self.wanted[module.name]


def _names(formulas: Iterable[Formula]) -> frozenset[str]:
    """The names that formulas use; none of one that cannot be read."""
    found: set[str] = set()
    for formula in formulas:
        if isinstance(formula.value, str):
            try:
                found.update(names(parse(formula.value)))
            except ExpressionError:
                continue
    return frozenset(found)
