"""What arrives with continuous delays, as NumPy code: at a stage between two of three steps, read once a step.

In: a Step in the making, connections. Out: lines, and identifiers of what was sent at the three steps; then of what
lies between two of them, at a stage where a ``share`` of the step is over.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import Indices, IntArray
from neurovis_spec.compiler.program import Projection
from neurovis_spec.runtime.lags import Lags
from neurovis_spec.runtime.numpy_arrivals import Step, end_at, long_past, put_together, signals_of
from neurovis_spec.runtime.numpy_code import Code
from neurovis_spec.runtime.stages import End, ends_of


class Around(NamedTuple):
    """Identifiers of what was sent at three steps, the second of which is k − 1 − W, and of the parts of a step that
    the delays have beyond W."""

    values: tuple[str, str, str]
    part: str


def signals_around(step: Step, lags: Lags, connections: Indices) -> Around:
    """The signals of connections that were sent around the time at which those left that arrive in a step."""
    whole = lags.whole[connections]
    first, second, third = (signals_of(step, connections, whole + ago) for ago in (2, 1, 0))
    return Around((first, second, third), step.code.constant(lags.part[connections]))


def ends_around(step: Step, lags: Lags, members: IntArray, places: IntArray) -> Around:
    """Activities and outlets, one a connection, as they were around the time at which those left that arrive in a
    step."""
    first, second, third = (long_past(step, members, places, lags.whole[members] + 1 - after) for after in (-1, 0, 1))
    return Around((first, second, third), step.code.constant(lags.part[members]))


def behind_lags(step: Step, projection: Projection) -> dict[str, str]:
    """What connections of which some have a continuous delay read of the past at the end of a step, by names."""
    members = projection.members
    if step.lags is None or not step.lags.there[members].any():
        return {}
    lags, found = step.lags.some(members), {}
    there, others = np.flatnonzero(lags.there), np.flatnonzero(~lags.there)
    for name, end in ends_of(step.network, projection).items():
        if end.past and not end.rounded:
            parts = [(_behind_step(step, lags.some(there), members[there], end.places[there]), there)]
            if len(others):
                rest = end_at(step, members[others], End(end.places[others], past=True))
                parts.append((rest, others))
            found[name] = put_together(step.code, parts, len(members), "a")
    return found


def _behind_step(step: Step, lags: Lags, members: IntArray, places: IntArray) -> str:
    """Activities and outlets that arrive at the end of a step."""
    code, late = step.code, lags.part > 0
    next_ = long_past(step, members, places, lags.whole)
    if not late.any():
        return next_
    one = long_past(step, members, places, lags.whole + late)
    share = code.constant(np.where(late, 1.0 - lags.part, 0.0))
    between = f"{one} + {share} * ({next_} - {one})"
    return between if late.all() else f"np.where({code.constant(late)}, {between}, {next_})"


def at_stage(code: Code, around: Around) -> str:
    """What arrives at a stage."""
    first, second, third = around.values
    q = code.let("q", f"share - {around.part}")
    early = code.let("q", f"{q} < 0.0")
    one = code.let("q", f"np.where({early}, {first}, {second})")
    next_ = f"np.where({early}, {second}, {third})"
    return code.let("g", f"{one} + np.where({early}, {q} + 1.0, {q}) * ({next_} - {one})")
