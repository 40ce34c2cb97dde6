"""Learning: what an entry of ``connections`` says of its plasticity.

In: Choices (rules with settings and signals). Out: for each a Learning: the rule, its parameters (one value a
connection), and for each signal where it comes from.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.connections.signals import Place, Signal, signal_of, text_of
from neurovis_spec.compiler.program import RULE, Definition
from neurovis_spec.compiler.values.arguments import Each, Settled, check_initials, settled_of
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.sections import ConnectionModel
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import Choice


class Learning(NamedTuple):
    """A rule in use."""

    settled: Settled
    #: where each signal comes from
    signals: Mapping[str, Signal]
    #: what the author calls each signal
    texts: Mapping[str, str]

    @property
    def rule(self) -> Definition:
        """The rule."""
        return self.settled.definition

    @property
    def parameters(self) -> Mapping[str, FloatArray]:
        """Its parameters, one value a connection."""
        return self.settled.parameters


_SETTING = formula_at(ConnectionModel, "plasticity", "RULE", "SETTING")


def rules_of(choices: tuple[Choice, ...], at: Place) -> tuple[Learning, ...] | Unknown:
    """The rules of an entry, in their order; UNKNOWN where one is invalid, or they have something in common."""
    found = [_learning_of(choice, at) for choice in choices]
    known = [one for one in found if one is not UNKNOWN]
    apart = _are_apart(choices, found, at.findings)
    return tuple(known) if apart and len(known) == len(choices) else UNKNOWN


def _are_apart(choices: tuple[Choice, ...], found: list[Learning | Unknown], findings: Findings) -> bool:
    """Whether no two rules of a connection are the same, or have states of the same name; a finding where two do."""
    before, owners = findings.errors, dict[str, str]()
    for number, (choice, learning) in enumerate(zip(choices, found, strict=True)):
        name = choice.name.value
        if name in (other.name.value for other in choices[:number]):
            message = f"the rule '{shorten(name)}' is here already: a connection has a rule once"
            findings.error("duplicate-name", choice.name.span, message, "leave it out here")
            continue
        rule = None if learning is UNKNOWN else learning.rule
        for state in () if rule is None else rule.kept:
            other = owners.setdefault(state.name, name)
            if other != name and rule is not None:
                what = "change the" if state in rule.gives else "have a state"
                message = f"the rules '{shorten(other)}' and '{shorten(name)}' both {what} '{state.name}'"
                hint = "states of a connection have different names: rename it in one of them"
                findings.error("duplicate-name", choice.name.span, message, hint)
    return findings.errors == before


def _learning_of(choice: Choice, at: Place) -> Learning | Unknown:
    """A rule of an entry; UNKNOWN where it is invalid."""
    constants, ends = at.scope.constants, at.ends
    each = Each("connection", dict.fromkeys(_SETTING.sees, UNKNOWN) if ends is UNKNOWN else ends._asdict(), at.table)
    count = UNKNOWN if ends is UNKNOWN else len(ends.j)
    settled = settled_of(choice, RULE, at.scope.definitions, constants, each, count)
    if settled is UNKNOWN:
        return UNKNOWN
    rule = settled.definition
    signals: dict[str, Signal] = {}
    failed = not settled.sound
    is_reported = constants.findings.is_invalid(choice.name.span)
    for signal in rule.signals:
        entry = settled.entries.get(signal)
        if entry is None or entry is UNKNOWN:
            failed = True
            if entry is None and not is_reported:
                message = f"the rule '{rule.name}' needs the signal '{signal}'"
                hint = f"write {{{rule.name}: {{{signal}: NEURON_OR_INPUT}}}}"
                constants.findings.error("missing-signal", choice.name.span, message, hint, key=signal)
            continue
        made = signal_of(entry, at)
        if made is UNKNOWN:
            failed = True
        else:
            signals[signal] = made
    if failed or not check_initials(settled, choice, constants):
        return UNKNOWN
    return Learning(settled, signals, {name: text_of(settled.entries.known()[name].value) for name in rule.signals})


def title_of(rules: Iterable[Learning]) -> str:
    """Rules in use for display, in their order: ``delta(rate=0.01, target=T) + decay(rate=0.1)``."""
    return " + ".join(
        called(one.settled, (f"{signal}={one.texts[signal]}" for signal in one.rule.signals)) for one in rules
    )


def called(used: Settled, further: Iterable[str] = ()) -> str:
    """A rule or a synapse in use for display: ``phase(lag=0.5)``; a parameter that has several values is ``…``."""
    parts = [
        f"{name}={array[0]:g}" if len(array) and (array == array[0]).all() else f"{name}=…"
        for name, array in used.parameters.items()
    ]
    parts += further
    return f"{used.definition.name}({', '.join(parts)})" if parts else used.definition.name
