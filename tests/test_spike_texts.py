"""What is said of spikes in findings."""

from __future__ import annotations

import neurovis_spec as nv

RESET = """
neurovis: 1
name: x
time: {dt: 0.1 ms}
models:
  m:
    time: ms
    parameters: {Vt: 20, Vr: 10, b: 1}
    let: {over: v >= Vt, base: Vr, LET}
    state: {v: {DOES: (drive - w - v)/20}, w: {DOES: -w/50}}
    spike: {when: WHEN, set: SET}
neurons: {B: {count: 2, model: {m: {Vr: [10, 20]}}, bias: 30}}
"""
#: each twice as much as the one before
LONG = ", ".join(("a0: v", *(f"a{i}: a{i - 1} + a{i - 1}" for i in range(1, 60))))


def warned(when: str, reset: str, does: str = "derivative", let: str = "a: 1") -> bool:
    text = RESET.replace("LET", let).replace("DOES", does).replace("WHEN", when).replace("SET", reset)
    return "unreachable-spike" in {one.code for one in nv.compile_text(text).warnings}


def test_a_reset_to_where_it_fires_is_told_where_that_is_known() -> None:
    for when, reset in (("over", "{v: Vr, w: w + b}"), ("v >= Vt", "{v: base}")):
        assert warned(when, reset)  # of the second neuron
        assert warned(when, reset, "each_step")
    assert warned("a59 > 1", "{v: Vr}", let=LONG)
    assert not warned("v > Vt", "{v: Vr}")
    assert not warned("f(v) >= 20", "{v: Vr}")
    for reset in ("{v: v - b}", "{w: w + b}"):
        assert not warned("over", reset)
    assert not warned("over and w < 1", "{v: Vr}")
