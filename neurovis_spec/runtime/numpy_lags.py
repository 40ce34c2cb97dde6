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
from neurovis_spec.runtime.numpy_arrivals import Step, end_at, put_together
from neurovis_spec.runtime.numpy_code import Code
from neurovis_spec.runtime.stages import End, ends_of
from neurovis_spec.runtime.state import NEVER_LOST


class Around(NamedTuple):
    """Identifiers of what was sent at three steps, the second of which is k − 1 − W, and of the parts of a step that
    the delays have beyond W."""

    values: tuple[str, str, str]
    part: str


def signals_around(step: Step, lags: Lags, connections: Indices) -> Around:
    """The signals of connections that were sent around the time at which those left that arrive in a step."""
    first, second, third = (_signals(step, lags.some(connections), connections, after) for after in (-1, 0, 1))
    return Around((first, second, third), step.code.constant(lags.part[connections]))


def _signals(step: Step, lags: Lags, connections: Indices, after: int) -> str:
    """The signals that were sent so many steps after k − 1 − W."""
    code, layout = step.code, step.layout
    ago, shares = lags.whole + 1 - after, layout.shares[connections]
    parts: list[tuple[str, IntArray]] = []
    for which in (shares, ~shares):
        places = np.flatnonzero(which)
        if not len(places):
            continue
        some = connections[places]
        sent = _slots(code, layout.offsets[some].astype(np.int64), layout.lengths[some].astype(np.int64), ago[places])
        if which is shares:
            sent = f"{code.select('weights', some, len(step.network.connections))} * {sent}"
            lost = step.structure.lost[some]
            if (lost > NEVER_LOST).any():
                sent = f"np.where(k < {code.constant(lost + ago[places])}, 0.0, {sent})"
        parts.append((sent, places))
    return put_together(code, parts, len(connections))


def _slots(code: Code, offsets: IntArray, lengths: IntArray, ago: IntArray) -> str:
    """What is in the slots of so many steps ago."""
    length, count = int(lengths[0]), len(offsets)
    if (lengths != length).any() or (ago != ago[0]).any():
        return f"signals[{code.constant(offsets)} + (k - {code.constant(ago)}) % {code.constant(lengths)}]"
    slot = f"(k - {ago[0]}) % {length}"
    first = int(offsets[0])
    if np.array_equal(offsets, first + length * np.arange(count)):
        return f"signals[{first} + {slot}:{first + length * count}:{length}]"
    return f"signals[{code.constant(offsets)} + {slot}]"


def ends_around(step: Step, lags: Lags, members: IntArray, places: IntArray) -> Around:
    """Activities and outlets, one a connection, as they were around the time at which those left that arrive in a
    step."""
    first, second, third = (past(step, members, places, lags.whole[members] + 1 - after) for after in (-1, 0, 1))
    return Around((first, second, third), step.code.constant(lags.part[members]))


def past(step: Step, members: IntArray, places: IntArray, ago: IntArray) -> str:
    """Activities and outlets of so many steps ago; before the first step they are as at that, 0 where they are lost."""
    code, lost = step.code, step.structure.lost[members]
    code.head_lines.add(f"since = {NEVER_LOST} if state.continued else 0")
    rows = f"np.maximum(k - {code.constant(ago)}, since) % {step.depth}"
    made = f"history[{rows}, {code.constant(np.ascontiguousarray(places, dtype=np.intp))}]"
    if (lost > NEVER_LOST).any():
        made = f"np.where(k < {code.constant(lost + ago)}, 0.0, {made})"
    return code.let("a", made)


def behind_lags(step: Step, projection: Projection) -> dict[str, str]:
    """What connections of which some have a continuous delay read of the past at the end of a step, by names."""
    members = projection.members
    if step.lags is None or not step.lags.there[members].any():
        return {}
    lags, found = step.lags.some(members), {}
    there, others = np.flatnonzero(lags.there), np.flatnonzero(~lags.there)
    for name, end in ends_of(step.network, projection).items():
        if end.past:
            parts = [(_behind_step(step, lags.some(there), members[there], end.places[there]), there)]
            if len(others):
                rest = end_at(step, members[others], End(end.places[others], past=True))
                parts.append((rest, others))
            found[name] = put_together(step.code, parts, len(members), "a")
    return found


def _behind_step(step: Step, lags: Lags, members: IntArray, places: IntArray) -> str:
    """Activities and outlets that arrive at the end of a step."""
    code, late = step.code, lags.part > 0
    next_ = past(step, members, places, lags.whole)
    if not late.any():
        return next_
    one, share = past(step, members, places, lags.whole + late), code.constant(np.where(late, 1.0 - lags.part, 0.0))
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
