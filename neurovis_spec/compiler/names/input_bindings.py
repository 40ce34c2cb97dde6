"""Bindings: which inputs around an instance are the inputs of its module.

In: the entry of an instance, the scope around it. Out: an InputBinding for each input of the module, by the name that
it has there; and, of an input of several values, those that one instance gets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.names.references import known_inputs
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.network import Input
from neurovis_spec.diagnostics import Findings, Hint, Span, shorten
from neurovis_spec.language.located import Located
from neurovis_spec.language.model import unread
from neurovis_spec.language.modules import InstanceModel
from neurovis_spec.language.unknown import UNKNOWN, Unknown

#: The most sizes that a message lists.
_FEW = 3


@dataclass(frozen=True)
class InputBinding:
    """What an entry of instances says an input of its module is, where, and what it is.

    ``wanted`` notes how many components the module's own input has, in each of the instances.
    """

    name: str
    span: Span
    input: Input | Unknown
    wanted: list[int] = field(default_factory=list)


def bindings_of(model: InstanceModel, scope: Scope, findings: Findings) -> dict[str, InputBinding]:
    """The inputs of the scope around that an instance names."""
    result: dict[str, InputBinding] = {}
    for name, outer in model.inputs.items():
        found = scope.input(outer.value)
        if found is None:
            _report_unknown(outer, scope, findings)
        result[name] = InputBinding(outer.value, outer.span, UNKNOWN if found is None else found)
    for name, value in unread(model, "inputs").items():
        result[name] = InputBinding(name, model.source.span, value)
    return result


def _report_unknown(outer: Located[str], scope: Scope, findings: Findings) -> None:
    """Report a name that is no input of the scope around: a group of neurons, or nothing."""
    section, lost = scope.section, None
    hint: Hint = "connect it to the neurons of the instance"
    message = f"'{shorten(outer.value)}' is a group of neurons, not an input"
    if outer.value.partition(".")[0] not in section.neurons:
        message = f"there is no input '{shorten(outer.value)}'"
        hint = partial(known_inputs, outer.value, section.inputs)
        lost = scope.undeclared(outer.value)
    findings.error("unknown-input", outer.span, message, hint, undeclared=lost)


def shared_out(made: Input, bound: InputBinding, position: int, count: int) -> Input | Unknown:
    """What one of ``count`` instances gets of an input around it; sizes that do not fit are found later
    (``check_sizes``)."""
    outer = bound.input
    bound.wanted.append(made.size)
    if outer is UNKNOWN:
        return UNKNOWN
    if outer.size == made.size:
        return Input(outer.name, outer.start, made.size)
    if outer.size == count * made.size:
        return Input(outer.name, outer.start + position * made.size, made.size)
    return UNKNOWN


def check_sizes(bound: InputBinding, called: Sequence[str], findings: Findings) -> None:
    """A finding where an input does not fit the instances of an entry, which are ``called`` so: it goes to each of
    them, or is shared out among them in equal parts."""
    outer, count = bound.input, len(called)
    if outer is UNKNOWN or len(bound.wanted) < count or set(bound.wanted) in ({outer.size}, {outer.size / count}):
        return  # of an input that is invalid itself all is said
    has = f"the input '{bound.name}' has {plural(outer.size, 'component')}"
    sizes = dict.fromkeys(bound.wanted)
    if len(sizes) > 1:
        wants = [f"'{called[bound.wanted.index(size)]}' wants {size}" for size in list(sizes)[:_FEW]]
        more = ", …" if len(sizes) > _FEW else ""
        hint = "one input is the same for all of them, or shared out in equal parts; declare an entry for each size"
        message = f"{has}, and the instances disagree: {', '.join(wants)}{more}"
        findings.error("wrong-size", bound.span, message, hint)
        return
    size = bound.wanted[0]
    wanted = f"{size}" if count == 1 else f"{size} or {count * size}"
    share = "one of count × size is shared out, one of the module's size goes to each"
    findings.error("wrong-size", bound.span, f"{has}; {wanted} are wanted here", None if count == 1 else share)
