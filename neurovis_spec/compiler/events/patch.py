"""Setting parameters: from new values to the numbers that follow them.

In: Settable, values for some slots (a slot is the index of a parameter). Out: a Patch: those values, those of the slots
that follow them, and the numbers of each binding that reads any of these (a Binding says which numbers of an array
follow which formula), all checked before anything is written. What is set a second time is computed by a function of
NumPy code made from the typed trees, which calls the functions of the library that computes the run.
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
from neurovis_spec.compiler.program import FEED, Key
from neurovis_spec.language.expressions.emit import defined, emit
from neurovis_spec.language.expressions.evaluate import Value
from neurovis_spec.language.expressions.functions import NUMPY, Library

#: What the numbers of an array are called in messages, by the name of the array or the kind of its owner.
_NAMES_IN_MESSAGES: Mapping[str, str] = {
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
#: How many plans are kept.
_MOST_PLANS = 256


class PatchError(ValueError):
    """Values that parameters cannot take; ``slots`` are those that what is wrong reads, or the one that is wrong."""

    def __init__(self, message: str, slots: frozenset[int]) -> None:
        super().__init__(message)
        self.slots = slots


@dataclass(frozen=True, slots=True)
class Patch:
    """What setting some parameters comes to."""

    #: the values of all slots
    parameters: FloatArray
    #: the bindings that read a slot that changes, and what each gives
    bindings: tuple[Binding, ...]
    values: tuple[Value, ...]
    #: the slots that have other values now, those that follow included
    changed: frozenset[int]

    def write(self, weights: FloatArray, variables: FloatArray) -> None:
        """Write the values into these two vectors."""
        for binding, value in zip(self.bindings, self.values, strict=True):
            if len(binding.indices):  # else it is only checked
                (weights if binding.weights else variables)[binding.indices] = value


@dataclass(slots=True, eq=False)
class _Plan:
    """What has to be computed when certain slots are set, in this order."""

    #: the slots that follow them
    following: tuple[int, ...]
    #: the bindings that read any of these slots
    bindings: tuple[Binding, ...]
    #: the slots that are set, and those that follow
    changed: frozenset[int]
    #: of the slots with bounds that follow parameters those whose bounds, or values, change
    bounded: tuple[int, ...]
    #: the plan as one function; made at the second request
    function: Callable[[FloatArray], tuple[Value, ...]] | None = None
    was_requested: bool = False


@dataclass
class Patcher:
    """Makes patches for one network."""

    settable: Settable
    #: whose functions formulas call
    library: Library = NUMPY
    #: plans by the slots that are set, and bytes that say which were set before
    _plans: dict[tuple[tuple[int, ...], bytes], _Plan] = field(default_factory=dict)

    def patch(self, parameters: FloatArray, set_before: npt.NDArray[np.bool_], values: Mapping[int, float]) -> Patch:
        """The patch that sets slots to values, where the other slots are as in ``parameters``. ``set_before`` says
        which slots have been set before, so that they follow nothing any more. Raises PatchError where a parameter
        would leave its bounds, or a number that follows would not be finite. Call it under ``np.errstate``."""
        set_now = tuple(values)
        key = set_now, set_before.tobytes()
        plan = self._plans.get(key)
        if plan is None:
            if len(self._plans) >= _MOST_PLANS:
                self._plans.clear()
            plan = self._plans[key] = self._plan(set_now, set_before)
        new = parameters.copy()
        for slot, value in values.items():
            new[slot] = value
            self._check_slot(slot, value)
        if plan.function is None and plan.was_requested:
            plan.function = self._compiled(plan)
        plan.was_requested = True
        # either also writes into ``new`` what the following slots are
        bound_values = self._evaluated(plan, new) if plan.function is None else plan.function(new)
        for slot in plan.bounded:
            self._check_bounds(slot, new)
        return Patch(new, plan.bindings, bound_values, plan.changed)

    def _plan(self, set_now: Sequence[int], set_before: npt.NDArray[np.bool_]) -> _Plan:
        following = self.settable.reached(set_now, set_before.tolist())
        changed = [*set_now, *following]
        bindings = tuple(self.settable.bindings[index] for index in self.settable.bound_to(changed))
        bounded = (slot for slot, read in self.settable.bounded if slot in changed or not read.isdisjoint(changed))
        return _Plan(tuple(following), bindings, frozenset(changed), tuple(bounded))

    def _evaluated(self, plan: _Plan, parameters: FloatArray) -> tuple[Value, ...]:
        """The plan carried out formula by formula: writes the following slots, gives the values of the bindings."""
        for slot in plan.following:
            formula = self.settable.slots[slot].formula
            assert formula is not None
            parameters[slot] = formula.values(parameters, self.library)
            self._check_slot(slot, float(parameters[slot]))
        result = []
        for binding in plan.bindings:
            value = binding.formula.values(parameters, self.library)
            self._check(binding, value, parameters)
            result.append(value)
        return tuple(result)

    def _compiled(self, plan: _Plan) -> Callable[[FloatArray], tuple[Value, ...]]:
        """The plan as one function; its text holds identifiers of our own only. Where g (slot 0) is set, w (slot 1) is
        g/4 and a weight is w + 1::

            def values(p):                        # the values of all slots
                p0 = p[0]
                p[1] = p1 = p0/4.0
                slot(1, p1)                       # check the slot
                b0 = p1 + 1.0                     # the number of binding 0
                if not isfinite(b0): check(t0, b0, p)
                return (b0, )
        """
        library = self.library
        space: dict[str, object] = {"np": np, "isfinite": math.isfinite, "check": self._check, "slot": self._check_slot}
        space |= {"by": library, **_library_names(library)}
        lines = ["def values(p):"]
        formulas = [self.settable.slots[slot].formula for slot in plan.following]
        read = {
            slot
            for formula in (*formulas, *(binding.formula for binding in plan.bindings))
            if isinstance(formula, ParameterFormula)
            for slot in formula.slot_of.values()
        }
        lines += [f"    p{slot} = p[{slot}]" for slot in sorted(read.difference(plan.following))]
        for slot, formula in zip(plan.following, formulas, strict=True):
            assert formula is not None
            lines.append(f"    p[{slot}] = p{slot} = {_code(formula, space, library)}")
            lines.append(f"    slot({slot}, p{slot})")
        for index, binding in enumerate(plan.bindings):
            lines.append(f"    b{index} = {_code(binding.formula, space, library)}")
            space[f"t{index}"] = binding
            is_one_number = isinstance(binding.formula, ParameterFormula) and binding.formula.plain
            if is_one_number and binding.low is None and binding.high is None:  # the cheap test first
                lines.append(f"    if not isfinite(b{index}): check(t{index}, b{index}, p)")
            else:
                lines.append(f"    check(t{index}, b{index}, p)")
        results = "".join(f"b{index}, " for index in range(len(plan.bindings)))
        lines.append(f"    return ({results})")
        function = defined("values", lines, "setting of parameters", space)
        assert callable(function)
        return function

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
            bound if isinstance(bound, float) else float(bound.values(parameters, self.library))
            for bound in (entry.low, entry.high)
        )
        self._compare(slot, float(parameters[slot]), low, high)

    def _compare(self, slot: int, value: float, low: float, high: float) -> None:
        """Raise PatchError where the value of a parameter is out of these bounds."""
        entry = self.settable.slots[slot]
        if not low <= value <= high:
            bounds = f"{low:g} to {high:g}".replace("-inf", "-∞").replace("inf", "∞")
            message = f"'{entry.name}' is {value:g}; its bounds are {bounds}"
            raise PatchError(message, entry.bounds_read.union((slot,)))

    def _check(self, binding: Binding, value: Value, parameters: FloatArray) -> None:
        """Raise PatchError where a number is not finite, or out of its bounds."""
        name = _name_in_message(binding.array)
        if not np.isfinite(value).all():
            what = "not finite" if np.ndim(value) else "undefined" if np.isnan(value) else "infinite"
            raise PatchError(f"{name} would be {what}", binding.slots)
        for bound, beyond, word in ((binding.low, np.less, "below"), (binding.high, np.greater, "above")):
            if bound is None:
                continue
            edge = bound.values(parameters, self.library)
            if beyond(value, edge).any():
                message = f"{name} would be {word} its bound of {float(np.max(edge)):g}"
                raise PatchError(message, binding.slots)


def _library_names(library: Library) -> dict[str, object]:
    """The functions of a library by their names in the code: ``by_exp``."""
    return {f"by_{name}": function for name, function in (*library.calls.items(), *library._asdict().items())}


def _call_emitters(library: Library) -> Mapping[str, Callable[..., str]]:
    """For each function of a library what makes the code of a call: ``by_exp(p0)``. Nothing for NumPy's functions, for
    which ``emit`` has code of its own, which is quicker."""
    if library is NUMPY:
        return {}
    names = {name: name for name in library.calls} | {"%": "remainder"}
    return {name: partial(_emit_call, f"by_{function}") for name, function in names.items()}


def _emit_call(name: str, *arguments: str) -> str:
    return f"{name}({', '.join(arguments)})"


def _code(formula: object, space: dict[str, object], library: Library) -> str:
    """A formula as code, ``p1 + 1.0``; where it is more than an expression over parameters and numbers, a call. What
    the code names is put into ``space``."""
    if isinstance(formula, ParameterFormula) and formula.draw is None:
        names = {name: f"p{slot}" for name, slot in formula.slot_of.items()}
        if all(isinstance(value, float | np.ndarray) for value in formula.known.values()):
            for name, value in formula.known.items():
                names[name] = f"c{len(space)}"  # ``space`` grows with each, so that the number is new
                space[names[name]] = np.float64(value) if isinstance(value, float) else value
            return emit(formula.tree, names, _call_emitters(library))
    name = f"c{len(space)}"
    space[name] = formula
    return f"{name}.values(p, by)"


def _name_in_message(array: Key) -> str:
    """What a number of the array is called in a message."""
    kind = array.name if array.owner is None else array.owner.kind
    kind = FEED.noun if kind == FEED.name else kind
    if kind in _NAMES_IN_MESSAGES:
        return _NAMES_IN_MESSAGES[kind]
    return f"the parameter '{array.name}' of {'an' if kind[0] in _VOWELS else 'a'} {kind}"
