"""What arrives with continuous delays at a stage, as C: when a ``share`` of the step is over.

In: a step in the making, connections. Out: lines that put what each of them brings into ``fl``. With a ring of 12 slots
behind the first 40, and a delay of 10.25 steps,

    const double q1 = share - 0.25;
    const int32_t i2 = nv_slot(r12, 11, 12, q1);
    fl[0] = nv_between(signals[40 + i2], signals[40 + nv_next(i2, 12)], q1);

where r12 is k mod 12: 11 steps before k, or one more where q1 is below 0, what arrives was on its way.
"""

from __future__ import annotations

from itertools import count

import numpy as np

from neurovis_spec.arrays import Indices, IntArray
from neurovis_spec.runtime.c_code import Code, Place
from neurovis_spec.runtime.c_step import StepCode
from neurovis_spec.runtime.lags import Lags

#: remainders of so many lengths have a name made of these
_FEW = 8


def write_arriving(step: StepCode, lags: Lags, connections: Indices) -> None:
    """What these connections bring, each in its place in ``fl``."""
    code = step.code
    if step.form.written_out:
        for place in range(len(connections)):
            with code.block(""):
                _arriving(step, lags.some(connections), connections, place)
    else:
        with code.block(code.loop("e", len(connections))):
            _arriving(step, lags.some(connections), connections, "e")


def _arriving(step: StepCode, lags: Lags, connections: Indices, place: Place) -> None:
    """What one of these connections brings."""
    code, layout = step.code, step.layout
    lengths, ago = layout.lengths[connections].astype(np.int64), lags.whole + 1
    part = code.text(code.number(lags.part, place))
    q = code.let("q", f"share - {part}")
    slot, length, back = code.name("i"), code.at(lengths, place), code.at(ago, place)
    code.line(f"const int32_t {slot} = nv_slot({_rest(code, lengths, place)}, {back}, {length}, {q});")
    offset, connection = code.at(layout.offsets[connections].astype(np.int64), place), code.at(connections, place)
    signals = [f"signals[{offset} + {slot}]", f"signals[{offset} + nv_next({slot}, {length})]"]
    shares = layout.shares[connections]
    own = shares[place : place + 1] if isinstance(place, int) else shares
    for number, signal in enumerate(signals if own.any() else ()):
        weighted = f"weights[{connection}]*{signal}"
        if step.form.lost:
            sent = f"k - ({back}) - ({q} < {code.text(0.0)}) + {number}"
            weighted = f"({sent} < lost[{connection}] ? {code.text(0.0)} : {weighted})"
        if not own.all():
            weighted = f"({code.at(shares.astype(np.int64), place)} ? {weighted} : {signal})"
        signals[number] = weighted
    code.line(f"fl[{place}] = nv_between({', '.join(signals)}, {q});")


def _rest(code: Code, lengths: IntArray, place: Place) -> str:
    """k mod the length of the ring of a connection."""
    if isinstance(place, int):
        return code.remainder(int(lengths[place]))
    kinds: list[int] = np.unique(lengths).tolist()
    if len(kinds) == 1:
        return code.remainder(kinds[0])
    values = ", ".join(f"(int32_t)(k % {kind})" for kind in kinds)
    names = iter(["_".join(["m", *map(str, kinds)])] if len(kinds) <= _FEW else map("m{}".format, count()))
    for name in names:
        line = f"const int32_t {name}[{len(kinds)}] = {{{values}}};"
        if code.head.setdefault(name, line) == line:
            return f"{name}[{code.at(np.searchsorted(kinds, lengths), place)}]"
    raise AssertionError("there are always further names")
