"""Setting parameters: from new values to the numbers that follow them.

In: Settable, values for some slots. Out: those values, and what the bindings that read them come to, all checked before
anything is written. What is set often is done by a function of NumPy code made from the typed trees, which calls the
functions of the library that computes the run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.events.settable import Binding, ParameterFormula, Settable
from neurovis_spec.compiler.program import Key
from neurovis_spec.language.expressions.emit import defined, emit
from neurovis_spec.language.expressions.evaluate import Value
from neurovis_spec.language.expressions.functions import NUMPY, Library

#: What the arrays of a network are called in messages, those that it has one of by their names.
_CALLED: Mapping[str, str] = {
    "weights": "a weight",
    "bias": "a bias",
    "centres": "a centre",
    "low": "a lower bound of weights",
    "high": "an upper bound of weights",
    "table": "a value of an input",
    "noise": "the spread of noise",
}
#: The letters before which it is 'an'.
_VOWELS = "aeiou"


#: Plans that are kept.
_MOST_PLANS = 256


class PatchError(ValueError):
    """Values that parameters cannot take; ``slots`` are those that what is wrong reads, or the one that is wrong."""

    def __init__(self, message: str, slots: frozenset[int]) -> None:
        super().__init__(message)
        self.slots = slots


@dataclass(frozen=True, slots=True)
class Patch:
    """What setting some parameters comes to: the values of all slots, and of each binding that is affected, in the
    order of ``bindings``."""

    parameters: FloatArray
    bindings: tuple[Binding, ...]
    values: tuple[Value, ...]
    #: the slots that have other values now, those that follow included
    changed: frozenset[int]

    def write(self, weights: FloatArray, variables: FloatArray) -> None:
        """Put the values where they belong."""
        for binding, value in zip(self.bindings, self.values, strict=True):
            if not len(binding.indices):  # it writes nothing, and is only checked
                continue
            (weights if binding.weights else variables)[binding.indices] = value


@dataclass(slots=True, eq=False)
class _Plan:
    """What has to be computed when certain slots are set: the slots and bindings that follow them, in order."""

    following: tuple[int, ...]
    bindings: tuple[Binding, ...]
    changed: frozenset[int]
    #: slots whose bounds follow parameters that change, or that change themselves
    bounded: tuple[int, ...]
    #: that as one function, where it was asked for before
    function: Callable[[FloatArray], tuple[Value, ...]] | None = None
    asked: bool = False


@dataclass
class Patcher:
    """Makes patches for one network; what is asked for twice is compiled."""

    settable: Settable
    by: Library = NUMPY
    _plans: dict[tuple[tuple[int, ...], bytes], _Plan] = field(default_factory=dict)

    def patch(self, parameters: FloatArray, chosen: npt.NDArray[np.bool_], values: Mapping[int, float]) -> Patch:
        """The patch that sets slots to values, where the others are as in ``parameters`` and those ``chosen`` have been
        set before, so that they do not follow others any more. Raises PatchError where a parameter would leave its
        bounds, or a number that follows would not be finite; runs under ``np.errstate``."""
        own = tuple(values)
        key = own, chosen.tobytes()
        plan = self._plans.get(key)
        if plan is None:
            if len(self._plans) >= _MOST_PLANS:
                self._plans.clear()
            plan = self._plans[key] = self._plan(own, chosen)
        found = parameters.copy()
        for slot, value in values.items():
            found[slot] = value
            self._check_slot(slot, value)
        if plan.function is None and plan.asked:
            plan.function = self._compiled(plan)
        plan.asked = True
        made = self._evaluated(plan, found) if plan.function is None else plan.function(found)
        for slot in plan.bounded:
            self._check_bounds(slot, found)
        return Patch(found, plan.bindings, made, plan.changed)

    def _plan(self, own: Sequence[int], chosen: npt.NDArray[np.bool_]) -> _Plan:
        following = self.settable.reached(own, chosen.tolist())
        changed = [*own, *following]
        bindings = tuple(self.settable.bindings[place] for place in self.settable.bound_to(changed))
        bounded = (slot for slot, read in self.settable.bounded if slot in changed or not read.isdisjoint(changed))
        return _Plan(tuple(following), bindings, frozenset(changed), tuple(bounded))

    def _evaluated(self, plan: _Plan, parameters: FloatArray) -> tuple[Value, ...]:
        """The plan carried out formula by formula."""
        for slot in plan.following:
            formula = self.settable.slots[slot].formula
            assert formula is not None
            parameters[slot] = formula.values(parameters, self.by)
            self._check_slot(slot, float(parameters[slot]))
        result = []
        for binding in plan.bindings:
            value = binding.formula.values(parameters, self.by)
            self._check(binding, value, parameters)
            result.append(value)
        return tuple(result)

    def _compiled(self, plan: _Plan) -> Callable[[FloatArray], tuple[Value, ...]]:
        """The plan as one function; its text holds identifiers of our own only."""
        by = self.by
        space: dict[str, object] = {"np": np, "isfinite": math.isfinite, "check": self._check, "slot": self._check_slot}
        space |= {"by": by, **_called_by(by)}
        lines = ["def values(p):"]
        formulas = [self.settable.slots[slot].formula for slot in plan.following]
        read = {
            place
            for formula in (*formulas, *(binding.formula for binding in plan.bindings))
            if isinstance(formula, ParameterFormula)
            for place in formula.slot_of.values()
        }
        lines += [f"    p{place} = p[{place}]" for place in sorted(read.difference(plan.following))]
        for slot, formula in zip(plan.following, formulas, strict=True):
            assert formula is not None
            lines.append(f"    p[{slot}] = p{slot} = {_code(formula, space, by)}")
            lines.append(f"    slot({slot}, p{slot})")
        for number, binding in enumerate(plan.bindings):
            lines.append(f"    b{number} = {_code(binding.formula, space, by)}")
            space[f"t{number}"] = binding
            plain = isinstance(binding.formula, ParameterFormula) and binding.formula.plain
            if plain and binding.low is None and binding.high is None:
                lines.append(f"    if not isfinite(b{number}): check(t{number}, b{number}, p)")
            else:
                lines.append(f"    check(t{number}, b{number}, p)")
        results = "".join(f"b{number}, " for number in range(len(plan.bindings)))
        lines.append(f"    return ({results})")
        made = defined("values", lines, "setting of parameters", space)
        assert callable(made)
        return made

    def _check_slot(self, slot: int, value: float) -> None:
        """Raise PatchError where a parameter is not finite, or out of bounds that are numbers."""
        entry = self.settable.slots[slot]
        if not math.isfinite(value):
            what = "undefined" if math.isnan(value) else "infinite"
            raise PatchError(f"'{entry.name}' would be {what}", frozenset((slot,)))
        if isinstance(entry.low, float) and isinstance(entry.high, float):
            self._compare(slot, value, entry.low, entry.high)

    def _check_bounds(self, slot: int, parameters: FloatArray) -> None:
        """Raise PatchError where a parameter is out of bounds that follow others."""
        entry = self.settable.slots[slot]
        low, high = (
            bound if isinstance(bound, float) else float(bound.values(parameters, self.by))
            for bound in (entry.low, entry.high)
        )
        self._compare(slot, float(parameters[slot]), low, high)

    def _compare(self, slot: int, value: float, low: float, high: float) -> None:
        entry = self.settable.slots[slot]
        if not low <= value <= high:
            bounds = f"{low:g} to {high:g}".replace("-inf", "-∞").replace("inf", "∞")
            message = f"'{entry.name}' is {value:g}; its bounds are {bounds}"
            raise PatchError(message, entry.bounds_read.union((slot,)))

    def _check(self, binding: Binding, value: Value, parameters: FloatArray) -> None:
        """Raise PatchError where a number is not finite, or out of its bounds."""
        name = _called(binding.array)
        if not np.isfinite(value).all():
            what = "not finite" if np.ndim(value) else "undefined" if np.isnan(value) else "infinite"
            raise PatchError(f"{name} would be {what}", binding.slots)
        for bound, beyond, word in ((binding.low, np.less, "below"), (binding.high, np.greater, "above")):
            if bound is None:
                continue
            edge = bound.values(parameters, self.by)
            if beyond(value, edge).any():
                message = f"{name} would be {word} its bound of {float(np.max(edge)):g}"
                raise PatchError(message, binding.slots)


def _called_by(by: Library) -> dict[str, object]:
    """The functions of a library, by the names that code has for them."""
    return {f"by_{name}": function for name, function in (*by.calls.items(), *by._asdict().items())}


def _calls(by: Library) -> Mapping[str, Callable[..., str]]:
    """What makes the code of a call of a library's function; for NumPy's there is other code, which is quicker."""
    if by is NUMPY:
        return {}
    names = {name: name for name in by.calls} | {"%": "remainder"}
    return {name: partial(_call, f"by_{own}") for name, own in names.items()}


def _call(name: str, *arguments: str) -> str:
    return f"{name}({', '.join(arguments)})"


def _code(formula: object, space: dict[str, object], by: Library) -> str:
    """A formula as code; where it is more than an expression over parameters, a call."""
    if isinstance(formula, ParameterFormula) and formula.draw is None:
        names = {name: f"p{slot}" for name, slot in formula.slot_of.items()}
        if all(isinstance(value, float | np.ndarray) for value in formula.known.values()):
            for name, value in formula.known.items():
                names[name] = f"c{len(space)}"
                space[names[name]] = np.float64(value) if isinstance(value, float) else value
            return emit(formula.tree, names, _calls(by))
    name = f"c{len(space)}"
    space[name] = formula
    return f"{name}.values(p, by)"


def _called(array: Key) -> str:
    kind = array.name if array.owner is None else array.owner.kind
    if kind in _CALLED:
        return _CALLED[kind]
    return f"the parameter '{array.name}' of {'an' if kind[0] in _VOWELS else 'a'} {kind}"
