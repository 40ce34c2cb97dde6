"""What is said of spikes in findings."""

from __future__ import annotations

import pytest

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


BROKEN = """
neurovis: 1
name: x
time: {dt: 1 ms}
models:
  cell:
    time: ms
    ports: {kick: sum, gain: product}
    state: {v: {derivative: (drive - v)/7, jump: JUMP, noise: NOISE}, x: {each_step: 0.5*x + gain}}
    spike: {when: v + 0*x >= 1, set: {v: 0}, refractory: REST}
synapses: {s: {state: {g: {derivative: -g + GROWS}}, signal: weight*(g + BRINGS)}}
rules:
  r: {signals: [by], state: {a: {derivative: -a + LEARNS}}, weight: {each_step: weight + a, on_post: weight + 1}}
  w: {weight: {derivative: ALONG, on_pre: weight + 1}}
neurons: {A: {model: cell, bias: 2}, B: {model: cell, bias: 2}}
connections:
  A -> B: {weight: 1, port: PORT, synapse: s, plasticity: [{r: {by: SIGNAL}}, w], delay: DELAY}
"""
SOUND = {
    "JUMP": "kick", "NOISE": "1", "REST": "2", "GROWS": "weight*pre.v", "BRINGS": "spike", "LEARNS": "by",
    "ALONG": "-weight", "PORT": "kick", "SIGNAL": "B.v", "DELAY": "1",
}  # fmt: skip


def found(changes: dict[str, str]) -> list[str]:
    """The errors, each by its code, its line, and what to do."""
    text = BROKEN
    for name, value in {**SOUND, **changes}.items():
        text = text.replace(name, value)
    try:
        nv.compile_text(text)
    except nv.SpecError as error:
        return [f"{one.code} {one.span.line} {one.hint}" for one in error.diagnostics]
    return []


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, ""),
        ({"NOISE": "spike"}, "spike-in-derivative 9 read it in 'jump'"),
        ({"GROWS": "spike"}, "spike-in-derivative 11 read it in 'on_pre'"),
        ({"GROWS": "2*pre.spike"}, "spike-in-derivative 11 read it in 'on_pre'"),
        ({"GROWS": "post.spike"}, "spike-in-derivative 11 read it in 'each_step'"),
        ({"GROWS": "pre"}, "spike-in-derivative 17 read it in 'on_pre'"),
        ({"GROWS": "post"}, "spike-in-derivative 17 read it in 'each_step'"),
        ({"LEARNS": "post"}, "spike-in-derivative 17 read it in 'on_post'"),
        ({"LEARNS": "post.spike"}, "spike-in-derivative 13 read it in 'on_post'"),
        ({"SIGNAL": "B"}, "spike-in-derivative 17 read it in 'each_step'"),
        ({"SIGNAL": "A.spike"}, "spike-in-derivative 17 read it in 'each_step'"),
        ({"ALONG": "spike - weight"}, "spike-in-derivative 14 read it in 'on_pre'"),
        ({"ALONG": "pre*weight"}, "spike-in-derivative 17 read it in 'on_pre'"),
        ({"PORT": "drive"}, "spike-in-derivative 17 what jumps by spikes there is at port: kick"),
        ({"PORT": "drive", "BRINGS": "post.spike"}, "spike-in-derivative 17 what jumps by spikes"),
        ({"DELAY": "0"}, "out-of-range 17 write delay: 1"),
        ({"JUMP": "kick^2"}, "jump-not-linear 9 as in jump"),
        ({"JUMP": "1"}, "jump-not-linear 9 as in jump"),
        ({"JUMP": "kick + k"}, "jump-not-linear 9 as in jump"),
        ({"JUMP": "gain"}, "jump-not-linear 9 a port by which a state jumps is a sum"),
        ({"JUMP": "kick +"}, "missing-operand 9"),
        ({"REST": "-2"}, "out-of-range 10 leave it out"),
    ],
)
def test_each_cause_is_told_once_where_it_is(changes: dict[str, str], expected: str) -> None:
    errors = found(changes)
    assert len(errors) == bool(expected), errors
    assert all(one.startswith(expected) for one in errors), errors


CELL = """
neurovis: 1
name: x
time: {dt: 0.1 ms}
models:
  cell:
    time: ms
    parameters: {rest: 2}
    ports: PORTS
    let: {LET}
    state: {v: {derivative: (drive - v)/7, jump: JUMP}}
    spike: {when: v >= 1, set: {v: 0}, refractory: REST}
    activity: ACTIVITY
neurons: {A: {count: 3, model: MODEL, COMBINE}}
connections: {A -> A: {pattern: chain, port: kick, delay: 0}}
synapses: {reads: {signal: weight*pre.away}}
outputs: {}
events: []
"""
CIRCLE = "a: b, b: a"


def told(**changes: str) -> list[str]:
    """All findings of a cell, each by its code, its place, its message and what to do."""
    text, given = CELL, {"PORTS": "[kick]", "LET": "", "JUMP": "kick", "REST": "rest", "ACTIVITY": "spike"}
    for name, value in {**given, "MODEL": "cell", "COMBINE": "bias: 2", **changes}.items():
        text = text.replace(name, value)
    try:
        findings = nv.compile_text(text).warnings
    except nv.SpecError as error:
        findings = error.diagnostics
    return [f"{one.code} {one.span.line}:{one.span.column} {one.message}; {one.hint}" for one in findings]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"LET": CIRCLE, "JUMP": "a*kick"}, ["let-cycle 10:11 "]),
        ({"LET": CIRCLE, "ACTIVITY": "a"}, ["let-cycle 10:11 "]),
        ({"LET": LONG, "JUMP": "a59*kick"}, []),
        ({"LET": LONG, "JUMP": "a59*kick^2"}, ["jump-not-linear 11:50 "]),
        ({"LET": "a: 2*kick, b: a - kick", "JUMP": "(b if v > 0 else 0) + drive/2"}, []),
        ({"LET": "a: 2*kick, b: a - kick", "JUMP": "(b if v > 0 else v)"}, ["jump-not-linear 11:50 "]),
        ({"PORTS": "[kick, {gain: sum}]", "JUMP": "gain"}, ["wrong-type 9:19 "]),
        ({"JUMP": "kick}, spike: {derivative: -spike"}, ["duplicate-name 11:57 "]),
    ],
)
def test_a_jump_is_read_through_intermediate_values(changes: dict[str, str], expected: list[str]) -> None:
    errors = [one for one in told(**changes) if not one.startswith("unused")]
    assert len(errors) == len(expected), errors
    assert all(one.startswith(start) for one, start in zip(errors, expected, strict=True)), errors


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"JUMP": "drive", "COMBINE": "bias: 1, combine: product"}, "jump-not-linear 14:56 a state of 'cell' jumps by"),
        ({"JUMP": "kick", "COMBINE": "bias: 1, combine: product"}, ""),
        ({"JUMP": "drive", "COMBINE": "bias: 1, combine: sum"}, ""),
        ({"REST": "0.25"}, "refractory-rounded 12:52 REST 2.5 steps: it rests for 3 steps, 0.0003 s;"),
        ({"REST": "250 us"}, "refractory-rounded 12:52 REST 2.5 steps"),
        ({"REST": "0.00025 s"}, "refractory-rounded 12:52 REST 2.5 steps"),
        ({"REST": "0.01"}, "refractory-rounded 12:52 REST 0.1 steps: it rests for 1 step, 0.0001 s;"),
        ({"REST": "0.3"}, ""),
        ({"REST": "rest*dt"}, ""),
        ({"REST": "rest + v"}, ""),
        ({"REST": "rest*f(1)"}, ""),
        ({"MODEL": "{cell: {rest: [2, 1.75, 3]}}"}, "refractory-rounded 14:33 REST 17.5 steps"),
        ({"MODEL": "{cell: {rest: -1}}"}, "refractory-rounded 14:33 REST -10 steps: it rests for 0 "),
        ({"MODEL": "{lif: {refractory: 0.34}}", "port: kick": "port: pulses"}, "refractory-rounded 14:33 "),
        ({"REST": "0, hold: v"}, ""),
        ({", refractory: rest": ", hold: v"}, "useless-key 12:40 'hold' is for as long as 'refractory' says"),
    ],
)
def test_what_a_jump_and_a_rest_are_not_is_told(changes: dict[str, str], expected: str) -> None:
    findings = [one for one in told(**changes) if not one.startswith(("unused", "no-effect"))]
    assert len(findings) == bool(expected), findings
    expected = expected.replace("REST", "the refractory time of 'cell' is")
    assert all(one.startswith(expected) for one in findings), findings


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"COMBINE": "initial: 1"}, "initial-activity 14:47 no neuron fires at step 0"),
        ({"COMBINE": "initial: {v: 0.5, spike: 1}"}, "initial-activity 14:56 no neuron fires at step 0"),
        ({"COMBINE": "initial: {V: 0.5}"}, "has no state 'V'; did you mean 'v'?"),
        ({"COMBINE": "initial: {away: 1}"}, "has no state 'away'; its states are: v"),
        ({"port: kick": "port: kick, send: away"}, "it can send: activity, v, spike"),
        ({"port: kick": "port: kick, synapse: reads"}, "it has: activity, v, spike, rest"),
        ({"outputs: {}": "outputs: {o: A.away}"}, "its states are: v, spike"),
        ({"events: []": "events: [{from: 1, to: 2, clamp: {A.away: 1}}]"}, "its states are: v, spike"),
    ],
)
def test_states_of_ours_are_offered_to_nobody(changes: dict[str, str], expected: str) -> None:
    findings = [one for one in told(**changes) if not one.startswith("unused")]
    assert len(findings) == 1, findings
    assert findings[0].startswith(expected) or findings[0].endswith(expected), findings
