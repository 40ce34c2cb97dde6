"""Measures: what is written, what it is over the last steps of a run, and how mistakes are answered."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.language.expressions.measures import SUMMARIES, parse_measure
from neurovis_spec.runtime.measures import Meter, measure_of
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.state import initial_state
from neurovis_spec.runtime.windows import _Last, running

Array = npt.NDArray[np.float64]

NETWORK = """neurovis: 1
name: small
time: {steps: 40, dt: 0.5}
parameters: {gain: 0.5, phase: 1}
inputs: {wave: {expression: sin(0.3*k + phase)}}
neurons: {A: {input: wave}, K: {count: 3, bias: gain}}
modules: {leg: {neurons: {M: {bias: 2}}}}
instances: {left: {module: leg, count: 2}}
connections: {A -> K: 0.5}
outputs: {signal: K2, all: K}
events: [{at: 20, set: {gain: 0.75}}]
"""
NUMBERS = st.floats(-1e6, 1e6, allow_nan=False) | st.sampled_from([math.inf, -math.inf, math.nan, 1e200, 0.0])


def plain(summary: str, values: list[float]) -> float:
    """What a summary is of values."""
    with np.errstate(all="ignore"):
        array = np.array(values)
        if summary == "rms":
            return float(np.sqrt((array * array).sum() / len(array)))
        if summary == "mean":
            return float(array.sum() / len(array))
        return float(array.min() if summary == "min" else array.max())


@given(
    values=st.lists(NUMBERS, max_size=40),
    last=st.integers(1, 9) | st.none(),
    summary=st.sampled_from(SUMMARIES),
    cuts=st.lists(st.integers(0, 40)),
)
@settings(max_examples=200, deadline=None)
def test_windows_are_what_they_say_however_the_values_come(
    values: list[float], last: int | None, summary: str, cuts: list[int]
) -> None:
    known = next(one for one in SUMMARIES if one == summary)
    single, many = running(known, last), running(known, last)
    one_by_one = [single.push(value) for value in values]
    edges = sorted({0, len(values), *(cut for cut in cuts if cut < len(values))})
    together = [x for a, b in pairwise(edges) for x in many.extend(np.array(values[a:b])).tolist()]
    if last is not None:
        np.testing.assert_array_equal(one_by_one, together)
    for end, value in enumerate(one_by_one, 1):
        wanted = plain(summary, values[0 if last is None else max(0, end - last) : end])
        scale = max((abs(v) for v in values[:end] if math.isfinite(v)), default=1.0)
        np.testing.assert_allclose(value, wanted, rtol=1e-9, atol=1e-12 * scale if last is None else 1e-6)


def test_a_window_does_not_drift_and_forgets_what_was_huge() -> None:
    window = running("mean", 5)
    for value in (1e300, math.inf, 1e16, -1e16, *([0.1] * 4)):
        window.push(value)
    assert window.push(0.1) == pytest.approx(0.1, rel=1e-15)
    everything = running("mean", None)
    for _ in range(100):
        everything.extend(np.full(1000, 0.1))
    assert everything.push(0.1) == pytest.approx(0.1, rel=1e-16)


def test_the_work_of_a_step_does_not_grow_with_the_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """A window keeps one block of numbers, which is put together once in N steps."""
    turns = 0
    turn = _Last._begin_block

    def counted(self: _Last) -> None:
        nonlocal turns
        turns += 1
        turn(self)

    monkeypatch.setattr(_Last, "_begin_block", counted)
    window = running("rms", 1000)
    for _ in range(5000):
        window.push(1.0)
    assert turns == 4


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("signal", lambda k, a: a["K2"]),
        ("rms(A - K1, last=7)", lambda k, a: rolled(np.square(a["A"] - a["K1"]), 7, np.mean) ** 0.5),
        ("mean(signal, last=3) * 2 + gain", lambda k, a: rolled(a["K2"], 3, np.mean) * 2 + np.where(k < 20, 0.5, 0.75)),
        ("max(A, last=4) - min(A, last=2)", lambda k, a: rolled(a["A"], 4, np.max) - rolled(a["A"], 2, np.min)),
        ("max(A, K1)", lambda k, a: np.maximum(a["A"], a["K1"])),
        ("t if k > 3 else left2.M", lambda k, a: np.where(k > 3, k * 0.5, 2.0)),
        ("mean(gain * k)", lambda k, a: np.cumsum(np.where(k < 20, 0.5, 0.75) * k) / (k + 1)),
        ("max(mean(A, last=2), abs(mean(A, last=5)))", lambda k, a: np.maximum(
            rolled(a["A"], 2, np.mean), abs(rolled(a["A"], 5, np.mean)))),
    ],
)  # fmt: skip
def test_a_measure_of_a_recording(text: str, wanted: Callable[[Array, Recording], Array]) -> None:
    network = nv.compile_text(NETWORK)
    recording = network.run()
    expected = np.array(wanted(np.arange(40.0), recording))
    found = network.measure(text, recording)
    measure = measure_of(text, network.network, "<test>")
    expected[: measure.longest - 1] = np.nan
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    meter = Meter(measure)
    conditions = initial_state(network.network).conditions
    for k in range(40):
        conditions.parameters[network.network.settable.index["gain"]] = 0.5 if k < 20 else 0.75
        value = meter.step(recording.activity[k], conditions, np.zeros(0))
        assert value == found[k] or (math.isnan(value) and math.isnan(found[k])) or "mean(gain" in text


def rolled(values: Array, last: int, how: Callable[[Array], object]) -> Array:
    """What is over the last values, from those that there are."""
    return np.array([how(values[max(0, end - last + 1) : end + 1]) for end in range(len(values))])


def test_a_measure_is_of_every_step() -> None:
    network = nv.compile_text(NETWORK)
    with pytest.raises(ValueError, match="every step"):
        network.measure("A", network.run(every=2))


@pytest.mark.parametrize(
    ("text", "code", "column", "words"),
    [
        ("rms(O, last=5)", "unknown-name", 5, "there is no neuron, output or parameter 'O'"),
        ("K4 > 1", "unknown-name", 1, "did you mean"),
        ("A + siganl", "unknown-name", 5, "did you mean 'signal'?"),
        ("left3.M", "unknown-name", 1, "did you mean 'left1.M' or 'left2.M'?"),
        ("A + gian", "unknown-name", 5, "did you mean 'gain'?"),
        ("K", "not-one-number", 1, "name one of them, as in 'K1'"),
        ("A - K1..K2", "not-one-number", 5, "'K1..K2' is 2 neurons"),
        ("left.M", "not-one-number", 1, "as in 'left1.M'"),
        ("rsm(A, last=5)", "unknown-function", 1, "did you mean 'rms'?"),
        ("rms(A, lats=5)", "bad-window", 8, "did you mean 'last'?"),
        ("rms(A, last=0)", "bad-window", 13, "from 1 on"),
        ("rms(A, last=1.5)", "bad-window", 13, "from 1 on"),
        ("rms(A, last=gain)", "bad-window", 13, "from 1 on"),
        ("rms(A, last=)", "bad-window", 12, "from 1 on"),
        ("rms(A, last=2, last=3)", "bad-window", 16, "twice"),
        ("rms(A, K1, last=2)", "bad-window", 1, "of 2 values"),
        ("mean(rms(A, last=2), last=3)", "bad-window", 6, "inside 'mean'"),
        ("clip(A, low=1)", "foreign-operator", 12, "have no names"),
        ("A = 3", "foreign-operator", 3, "'=='"),
        ("1 + (A -> K1).eligibility > 0", "unknown-name", 5, "no rule changes 'A -> K1'"),
        ("rms((A -> K).x)", "unknown-name", 5, "no rule changes 'A -> K'"),
        ("(A -> K1) > 0", "missing-operand", 5, "between '-' and '>'"),
        ("rms(A", "unbalanced-parenthesis", 4, "never closed"),
        ("", "empty-expression", 1, ""),
        ("A +", "missing-operand", 3, ""),
        ("normal(0, 1)", "draw-not-allowed", 1, ""),
        ("x" * 1001, "expression-too-long", 1001, ""),
    ],
)
def test_a_mistake_has_its_place(text: str, code: str, column: int, words: str) -> None:
    network = nv.compile_text(NETWORK)
    with pytest.raises(nv.SpecError) as caught:
        measure_of(text, network.network, "<until>")
    found = caught.value.diagnostics[0]
    assert (found.code, found.span.file, found.span.line, found.span.column) == (code, "<until>", 1, column)
    assert words in f"{found.message} {found.hint}"


STATES = """neurovis: 1
name: cells
time: {steps: 30}
neurons: {V: {count: 2, model: leaky, bias: i + 1}, U: {model: leaky}}
models: {leaky: {state: {v: {initial: 0.5, each_step: v + 0.1*(drive - v)}}, activity: tanh(v)}}
outputs: {potential: V2.v, both: V.v}
"""


def test_a_state_is_a_number_as_well() -> None:
    network = nv.compile_text(STATES)
    recording = network.run(states=["V.v"])
    assert recording["V2.v"][-1] > 1
    for name in ("V2.v", "potential"):
        found = network.measure(f"mean({name}, last=3)", recording)
        np.testing.assert_allclose(found[2:], rolled(recording["V2.v"], 3, np.mean)[2:])
        level = float(recording["V2.v"][20])
        assert network.run(until=f"{name} >= {level!r}").reached == 21
        table = nv.sweep(yaml.safe_load(STATES), {"seed": "0"}, [f"x = {name}", "V1.v", "U"])
        assert table.rows[0][1:] == (recording["V2.v"][-1], recording["V1.v"][-1], recording["U"][-1], None)
    with pytest.raises(ValueError, match=r"the state 'U\.v' was not recorded"):
        network.measure("U.v", recording)
    for text, code in (("V2.w", "unknown-name"), ("V.v", "not-one-number"), ("both", "not-one-number")):
        with pytest.raises(nv.SpecError, match=code):
            network.run(until=f"{text} > 0")


def test_a_name_of_two_things_is_refused() -> None:
    network = nv.compile_text("neurovis: 1\nname: x\nparameters: {A: 1}\nneurons: {A: {bias: A}, t: {}, B: {}}")
    for text in ("A", "mean(t, last=2)"):
        with pytest.raises(nv.SpecError, match="not-one-number"):
            network.measure(text, network.run(3))
    assert network.measure("B + k", network.run(3)).tolist() == [0.0, 1.0, 2.0]


def test_all_findings_come_at_once() -> None:
    network = nv.compile_text(NETWORK)
    with pytest.raises(nv.SpecError) as caught:
        measure_of("foo(A) + bar(A)", network.network, "<until>")
    assert len(caught.value.diagnostics) == 2
    with pytest.raises(nv.SpecError) as caught:
        measure_of("one + rms(two, last=3)", network.network, "<until>")
    assert [found.span.column for found in caught.value.diagnostics] == [1, 11]


def test_a_long_expression_of_windows_is_parsed_in_no_time() -> None:
    """Each token is gone through once, however deep calls stand in each other."""
    text = "max(" * 60 + "A" + ", 1)" * 60
    assert parse_measure(text).windows == ()
    assert len(parse_measure("+".join(["rms(A, last=9)"] * 60)).windows) == 60


@pytest.mark.parametrize(
    ("text", "together"),
    [
        ("1/min(A, B)", False),
        ("1/max(A, B)", False),
        ("1/clip(A, B, 1)", False),
        ("1/min(A, last=2)", True),
        ("1/max(A, last=5) + sqrt(B)", True),
        ("abs(A)/B - sign(A)*B^2", True),
    ],
)
def test_of_many_steps_at_once_the_bits_are_those_of_each(text: str, together: bool) -> None:
    """Also where 0 meets −0, which are equal and of which NumPy's ``min`` and ``max`` take either."""
    network = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {}, B: {}}").network
    measure, conditions = measure_of(text, network, "<test>"), initial_state(network).conditions
    assert measure.together == together
    values = [0.0, -0.0, 1.0, -0.0, 0.0, 0.0, -0.0, -1.0, math.inf, -0.0, math.nan, 0.0]
    rows = np.array([(a, b) for a in values for b in values])
    one, many = Meter(measure), Meter(measure)
    with np.errstate(all="ignore"):
        each = np.array([one.step(row, conditions, np.zeros(0)) for row in rows])
        if together:
            made = many.rows(rows, conditions, np.zeros((len(rows), 0)))
            np.testing.assert_array_equal(made, each)
            np.testing.assert_array_equal(np.signbit(made[made == made]), np.signbit(each[each == each]))


GROUPS = """neurovis: 1
name: groups
time: {steps: 30, dt: 0.5}
parameters: {half: 0.5}
inputs: {wave: {size: 3, expression: sin(0.7*k + i)}}
models: {slow: {state: {v: {each_step: 0.5*v + drive}}, activity: 2*v}}
neurons: {K: {count: 3, input: wave, model: slow}, L: {count: 3, bias: 0.1*i}, M: {count: 2}, A: {bias: 0.25}}
"""


def of_groups(recording: Recording) -> dict[str, Array]:
    """What some measures are, from the numbers of a run."""
    k, level, v = recording["K"], recording["L"], recording["K.v"]
    whole = range(1, len(recording) + 1)
    return {
        "mean(K, last=4)": np.array([k[max(0, t - 4) : t].mean() for t in whole]),
        "rms(K - L, last=4)": np.array([np.sqrt(((k - level)[max(0, t - 4) : t] ** 2).mean()) for t in whole]),
        "max(K)": np.array([k[:t].max() for t in whole]),
        "min(abs(K + A), last=2)": np.array([np.abs(k + 0.25)[max(0, t - 2) : t].min() for t in whole]),
        "count(K > half)": (k > 0.5).sum(axis=1).astype(float),
        "count(K > L and K < A)": ((k > level) & (k < 0.25)).sum(axis=1).astype(float),
        "mean(count(K > half), last=4)/3": np.array(
            [(k > 0.5)[max(0, t - 4) : t].sum(axis=1).mean() / 3 for t in whole]
        ),
        "max(K1..K2) - mean(M)": np.array([k[:t, :2].max() for t in whole]),
        "mean(K.v, last=4) + count(K.v > 0.2)": np.array(
            [v[max(0, t - 4) : t].mean() + (v[t - 1] > 0.2).sum() for t in whole]
        ),
    }


@pytest.mark.parametrize("text", of_groups(nv.compile_text(GROUPS).run(1, states="all")))
def test_measures_are_over_the_neurons_of_groups_and_over_steps(text: str) -> None:
    network = nv.compile_text(GROUPS)
    recording = network.run(states="all")
    found, expected = network.measure(text, recording), of_groups(recording)[text]
    longest = measure_of(text, network.network, "<measure>").longest
    np.testing.assert_allclose(found[longest - 1 :], expected[longest - 1 :], rtol=1e-14)
    meter, probe = Meter(measure_of(text, network.network, "<measure>")), recording["K.v"]
    states = probe if "K.v" in text else probe[:, :0]
    conditions = initial_state(network.network).conditions
    stepped = [meter.step(recording.activity[t], conditions, states[t]) for t in range(len(recording))]
    np.testing.assert_array_equal(stepped, found)


def test_a_run_ends_by_a_measure_over_a_group() -> None:
    network = nv.compile_text(GROUPS)
    until = network.until("count(K > half) == 3")
    found = network.run(until=until)
    wanted = np.flatnonzero((network.run()["K"] > 0.5).sum(axis=1) == 3)
    assert until.ending is not None
    assert len(found) == (wanted[0] + 1 if len(wanted) else 30)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("K > 0.5", "'K' is 3 neurons, and no single one"),
        ("mean(K + M, last=2)", "'M' is 2 numbers, and 'K' 3"),
        ("count(A > 0.5)", "'count' is of the neurons of a group"),
        ("count(K > 0, 1)", "'count' takes 1 argument"),
        ("count(count(K) > 1)", "'count' stands inside 'count'"),
        ("count(K > mean(K))", "a summary over steps stands inside 'count'"),
    ],
)
def test_what_is_wrong_with_groups_is_told(text: str, message: str) -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(GROUPS).until(text)
    assert message in str(caught.value)
