"""The gains that an author states: for all, or for those that references name.

In: gains as written, who finds what references name. Out: StatedGains, of which a later one goes before an earlier one:
where references overlap, the one that names the fewest.
"""

from __future__ import annotations

import math
from typing import Literal

from neurovis_spec.compiler.drawing.drawing_settings import StatedGain
from neurovis_spec.compiler.names.finder import Finder
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.diagnostics import Span, shorten
from neurovis_spec.language.drawing import GainValue, Range
from neurovis_spec.language.located import Located
from neurovis_spec.language.references import Sum, parse
from neurovis_spec.language.unknown import UNKNOWN, Unknown

Sort = Literal["activity", "signal", "thickness", "change"]


def stated_gains(
    written: tuple[GainValue, ...], sort: Sort, finder: Finder, constants: Constants
) -> tuple[StatedGain, ...]:
    """The gains of one sort; what is invalid in them is reported and left out."""
    found: list[tuple[StatedGain, Span]] = []
    for one in written:
        value = _value(one, constants)
        members = None if one.key is None else _members(one.key, sort, finder)
        if value is UNKNOWN:
            continue
        if one.key is None:
            found.append((StatedGain(value[0], None, "", value[1]), one.span))
        elif members is not UNKNOWN:
            found.append((StatedGain(value[0], members, parse(one.key.value).normal, value[1]), one.key.span))
    found.sort(key=lambda item: math.inf if item[0].members is None else len(item[0].members))
    _check_ties(found, constants)
    return tuple(stated for stated, _ in reversed(found))


def _value(one: GainValue, constants: Constants) -> tuple[float, float] | Unknown:
    """The gain, and what is drawn as 0."""
    findings = constants.findings
    if isinstance(one.value, Range):
        low, high = (constants.scalar(end) for end in (one.value.low, one.value.high))
        if low is UNKNOWN or high is UNKNOWN:
            return UNKNOWN
        gain = 2 / (high - low) if high > low else math.inf
        if not math.isfinite(gain):
            message = f"a range goes from low to high, this one from {low:g} to {high:g}"
            findings.error("out-of-range", one.span, message, "write [low, high]")
            return UNKNOWN
        return gain, low / 2 + high / 2
    value = UNKNOWN if one.value is None else constants.scalar(one.value)
    if value is UNKNOWN:
        return UNKNOWN
    if value < 0:
        findings.error("out-of-range", one.span, f"a gain is not negative, this is {value:g}")
        return UNKNOWN
    return value, 0.0


def _members(key: Located[str], sort: Sort, finder: Finder) -> tuple[int, ...] | Unknown:
    """What a reference names: neurons, or connections."""
    if sort == "activity":
        if not isinstance(parse(key.value), Sum):
            message = f"'{shorten(key.value)}' is a connection; 'activity' is the colour of neurons"
            finder.findings.error("wrong-type", key.span, message, "the colour of connections is 'signal'")
            return UNKNOWN
        found = finder.neurons(key)
    else:
        found = finder.connections(key)
    return UNKNOWN if found is UNKNOWN else tuple(found.tolist())


def _check_ties(found: list[tuple[StatedGain, Span]], constants: Constants) -> None:
    """Of two references that name as many, neither goes before the other where they overlap. ``found`` begins with
    those that name the fewest."""
    held: dict[int, StatedGain] = {}
    for one, span in found:
        members = one.members or ()
        for member in members:
            other = held.setdefault(member, one)
            if len(other.members or ()) == len(members) and (other.gain, other.centre) != (one.gain, one.centre):
                what = "connections" if "->" in one.name else "neurons"
                message = f"'{shorten(one.name)}' and '{shorten(other.name)}' name the same {what}, and as many"
                hint = "where references overlap, the one that names the fewest holds"
                constants.findings.error("repeated-reference", span, message, hint)
                break
