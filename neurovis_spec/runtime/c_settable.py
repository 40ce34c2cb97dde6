"""Setting parameters in C: the same formulas as ``compiler/events/patch`` evaluates, over the parameters of a state.

In: Settable. Out: the lines of a function that takes new values for some parameters, follows all that depends on them,
and writes what this comes to, or nothing where something would not be finite or leave its bounds. What C cannot work
out keeps its value, and so do the parameters that it follows. A *slot* is the index of a parameter, a *Binding* the
cells of arrays that a formula of slots fills. One that is a number of ``x``, and its parameter at least 0, gives

    if (changed[0]) {
        if (!isfinite(parameters[0]) || parameters[0] < 0.0)
            return 0;
    }
    for (int write = 0; write < 2; write++) {    // checks everything, then writes
        if (changed[0]) {
            {
                const double value = parameters[0];
                if (!isfinite(value))
                    return 0;
                if (write)
                    x[3] = value;
            }
        }
    }
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from neurovis_spec.compiler.events.settable import (
    Assembled,
    Binding,
    Dependent,
    Distance,
    ParameterFormula,
    Settable,
    Subset,
)
from neurovis_spec.language.expressions.emit_c import Value
from neurovis_spec.language.expressions.evaluate import Value as ArrayValue
from neurovis_spec.language.expressions.tree import Draw
from neurovis_spec.runtime.c_code import Code, Place

#: numbers of a binding that are written out one by one, where they are no regular array
_MOST_WRITTEN_OUT = 4096


class ExportError(ValueError):
    """A network that C cannot be made of."""


def formula(code: Code, dependent: Dependent, place: Place, parameters: str = "parameters") -> Value:
    """The number at a place of what a formula gives. Raises ExportError."""
    match dependent:
        case ParameterFormula(tree=tree, slot_of=slot_of, known=known, draw=draw):
            names: dict[str, Value] = {name: f"{parameters}[{slot}]" for name, slot in slot_of.items()}
            for name, value in known.items():
                if isinstance(value, float | np.ndarray):
                    names[name] = _element(code, value, place)
                else:
                    names[name] = formula(code, value, place, parameters)

            def drawn(node: Draw, first: Value, second: Value) -> Value:
                assert draw is not None
                standard = replace(node, kind="uniform") if node.kind == "poisson" else node
                number = code.text(_element(code, draw(standard, np.float64(0.0), np.float64(1.0)), place))
                low, high = code.text(first), code.text(second)
                if node.kind == "poisson":
                    return f"{'(float)' if code.real == 'float' else ''}nv_poisson({low}, {number})"
                if node.kind == "uniform":
                    return f"(({low}) + (({high}) - ({low}))*{number})"
                return f"(({high}) < 0 ? NAN : ({low}) + ({high})*{number})"

            return code.emitter.value(tree, {**code.common_names, **names}, {}, drawn)
        case Assembled(base=base, parts=parts):
            index = _number(place) if base.size > 1 else 0  # one number for all
            for part in reversed(parts):  # a later part covers an earlier one
                inside = np.flatnonzero(part.within(base.size) == index)
                if len(inside):
                    return formula(code, part.formula, int(inside[-1]), parameters)
            return float(base.ravel()[index])
        case Subset(whole=whole, places=places):
            return formula(code, whole, int(places[_number(place)]), parameters)
        case Distance(positions=positions, sources=sources, targets=targets, axes=axes):
            index = _number(place)
            ends = (int(sources[index]), int(targets[index]))
            found = ""
            for axis in range(axes):
                one, other = (code.text(formula(code, positions, axes * end + axis, parameters)) for end in ends)
                apart = f"({one}) - ({other})"
                found = apart if not found else f"hypot{code.emitter.suffix}({found}, {apart})"
            return found
    raise ExportError("a parameter is used in a way that C cannot work out")


def _element(code: Code, value: ArrayValue, place: Place) -> Value:
    """The number at a place; a single number is there at every place."""
    array = np.asarray(value, dtype=np.float64).ravel()
    return float(array[0]) if len(array) == 1 else code.number(array, place)


def _number(place: Place) -> int:
    """A place that is no loop's: what is not ``regular`` is written out one by one."""
    assert isinstance(place, int)
    return place


def fixed(settable: Settable) -> tuple[Settable, Mapping[int, str]]:
    """What can be set in C, and the slots that keep their values, each with what follows it and C cannot work out."""
    reasons: dict[int, str] = {}
    kept = []
    for binding in settable.bindings:
        obstacle = _obstacle(binding, settable)
        if obstacle is None:
            kept.append(binding)
        else:
            reasons.update(dict.fromkeys(binding.slots, obstacle))
    # a slot keeps its value, too, where one that follows it does
    free = [False] * len(settable.slots)
    for slot in range(len(settable.slots)):
        for follower in settable.reached([slot], free):
            if follower in reasons:
                reasons.setdefault(slot, reasons[follower])
    return replace(settable, bindings=tuple(kept)), reasons


def _obstacle(binding: Binding, settable: Settable) -> str | None:
    """Why C cannot work out what a formula gives; None where it can."""
    bounds = [bound for bound in (binding.low, binding.high) if bound is not None]
    if not all(map(_is_formula, (binding.formula, *bounds))):
        return "a scale of weights"
    count = _count(binding, settable)
    if count > _MOST_WRITTEN_OUT and not all(map(regular, (binding.formula, *bounds))):
        return f"what is made of {count:,} positions or data (at most {_MOST_WRITTEN_OUT:,})"
    return None


def _is_formula(dependent: Dependent) -> bool:
    """Whether ``formula`` knows what to make of it."""
    match dependent:
        case ParameterFormula(known=known):
            return all(isinstance(value, float | np.ndarray) or _is_formula(value) for value in known.values())
        case Assembled(parts=parts):
            return all(_is_formula(part.formula) for part in parts)
        case Subset(whole=whole):
            return _is_formula(whole)
    return isinstance(dependent, Distance)


def _count(binding: Binding, settable: Settable) -> int:
    """How many numbers a binding gives."""
    return len(binding.indices) or int(np.size(binding.formula.values(settable.parameters)))


def regular(dependent: Dependent) -> bool:
    """Whether a loop can compute the numbers of a formula."""
    return isinstance(dependent, ParameterFormula) and all(
        isinstance(value, float | np.ndarray) or regular(value) for value in dependent.known.values()
    )


def write_follow(code: Code, settable: Settable) -> None:
    """The body of ``follow(state, parameters, changed)``, where some of the parameters are ``changed``. All that
    depends on them follows; it gives 0, and nothing has changed, where a number would not be finite or leave its
    bounds."""
    for slot, entry in enumerate(settable.slots):
        reads = {slot}.union(*(bound.slots for bound in (entry.low, entry.high) if not isinstance(bound, float)))
        condition = " || ".join(f"changed[{other}]" for other in sorted(reads))
        code.line(f"if ({condition}) {{")
        code.line(
            f"    if (!isfinite(parameters[{slot}]){_outside(code, f'parameters[{slot}]', entry.low, entry.high)})"
        )
        code.line("        return 0;")
        code.line("}")
        for place, follower in enumerate(settable.slots):
            if follower.formula is None or max(follower.formula.slots, default=-1) != slot:
                continue
            read = " || ".join(f"changed[{other}]" for other in sorted(follower.formula.slots))
            condition = f"({read})" if "||" in read else read
            with code.block(f"if (!changed[{place}] && !state->chosen[{place}] && {condition})"):
                code.line(f"parameters[{place}] = {code.text(formula(code, follower.formula, 0))};")
                code.line(f"changed[{place}] = 1;")
    with code.block("for (int write = 0; write < 2; write++)"):
        for binding in settable.bindings:
            if binding.slots:
                _write_binding(code, binding, settable)
    code.line(f"memcpy(state->parameters, parameters, {len(settable.slots)}*sizeof(parameters[0]));")
    code.line("return 1;")


def _outside(code: Code, value: str, low: float | Dependent, high: float | Dependent) -> str:
    """The tests, each after ``||``, that are true beyond the bounds; infinite bounds have none."""
    tests = ""
    for bound, beyond in ((low, "<"), (high, ">")):
        if not isinstance(bound, float):
            tests += f" || {value} {beyond} {code.text(formula(code, bound, 0))}"
        elif np.isfinite(bound):
            tests += f" || {value} {beyond} {code.text(bound)}"
    return tests


def _write_binding(code: Code, binding: Binding, settable: Settable) -> None:
    """What one formula gives, checked in the first round, written in the second; without indices it is only checked."""
    condition = " || ".join(f"changed[{slot}]" for slot in sorted(binding.written_by(settable.own_count)))
    count = _count(binding, settable)
    array = "weights" if binding.weights else "x"
    bounds = [bound for bound in (binding.low, binding.high) if bound is not None]
    with code.block(f"if ({condition})"):
        if count > 1 and all(regular(one) for one in (binding.formula, *bounds)):
            with code.block(code.loop("i", count)):
                _write_number(code, binding, "i", array)
            return
        for place in range(count):
            with code.block(""):
                _write_number(code, binding, place, array)


def _write_number(code: Code, binding: Binding, place: Place, array: str) -> None:
    """The lines for one number of a binding."""
    value = code.text(formula(code, binding.formula, place))
    code.line(f"const {code.real} value = {value};")
    low = "" if binding.low is None else f" || value < {code.text(formula(code, binding.low, place))}"
    high = "" if binding.high is None else f" || value > {code.text(formula(code, binding.high, place))}"
    code.line(f"if (!isfinite(value){low}{high})")
    code.line("    return 0;")
    if not len(binding.indices):
        return
    code.line("if (write)")
    code.line(f"    {array}[{code.at(binding.indices, place)}] = value;")
