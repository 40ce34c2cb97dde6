"""Continuous delays: what flows arrives in derivatives as it was at that time, between steps, in every backend."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from exported import exported
from small_specs import network_of
from test_flows_c import same_bits

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.cli.overview import overview
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.formed import signals_of
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.step_check import check_step

BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]

# ---- against solutions ---------------------------------------------------------------------------------------------

LINE = """\
neurovis: 1
name: delay
time: {dt: DT, steps: STEPS, integrate: METHOD}
models: {line: {state: {x: {initial: 1, derivative: drive}}, activity: x}}
neurons: {X: {model: line}}
connections: {X -> X: {weight: -1, delay: {seconds: LAG}}}
"""


def line(steps_a_second: int, method: str, lag: float, backend: str, text: str = LINE) -> float:
    """The largest error of x' = −x(t − lag) over three seconds, x being 1 before 0."""
    steps = 3 * steps_a_second + 1
    for name, value in {"DT": 1 / steps_a_second, "STEPS": steps, "METHOD": method, "LAG": lag}.items():
        text = text.replace(name, str(value))
    found = nv.compile_text(text).run(backend=backend).activity[:, 0]
    return float(np.abs(found - [method_of_steps(k / steps_a_second, lag) for k in range(steps)]).max())


def method_of_steps(t: float, lag: float) -> float:
    """x(t), a polynomial of one degree more from lag to lag."""
    terms = range(int(t / lag + 1e-9) + 2)
    return math.fsum((-1.0) ** n * (t - (n - 1) * lag) ** n / math.factorial(n) for n in terms)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("method", ["heun", "rk4"])
def test_a_line_with_a_delay_is_that_of_the_method_of_steps(method: str, backend: str) -> None:
    errors = [line(steps, method, 1, backend) for steps in (100, 200)]
    assert errors == pytest.approx([8.33e-6, 2.08e-6], rel=2e-3)


@pytest.mark.parametrize(("method", "order"), [("euler", 1), ("heun", 2), ("{method: rk4, substeps: 3}", 2)])
def test_a_delay_that_is_no_whole_number_of_steps_is_of_the_same_order(method: str, order: int) -> None:
    coarse, fine = (line(steps, method, 0.3737, "numpy") for steps in (80, 160))
    assert math.log2(coarse / fine) == pytest.approx(order, abs=0.3)


RING = """\
neurovis: 1
name: ring
time: {dt: 0.5 ms, integrate: heun}
models: {rate: {time: ms, state: {v: {initial: 0.3, derivative: (f(drive) - v)/12}}, activity: v}}
neurons:
  N: {count: 7, model: rate, activation: tanh, bias: 0.2, initial: {v: cos(i)}, position: [X]}
connections:
  N -> N: {weight: 0.6*cos(i - 2*j), pattern: all_to_all, delay: {seconds: 0.001 + distance/700}}
"""


def test_a_network_with_delays_by_distance_is_loops_by_hand() -> None:
    places = np.stack([2.5 * np.cos(np.arange(7)), 2.5 * np.sin(np.arange(7))], axis=1)
    text = RING.replace("[X]", str([[round(x, 3), round(y, 3)] for x, y in places.tolist()]))
    network = nv.compile_text(text)
    found = network.run(120, backend="numpy").activity
    j, i = np.meshgrid(np.arange(7), np.arange(7))
    weights = 0.6 * np.cos(i - 2 * j) * (i != j)
    places = np.round(places, 3)
    lags = (0.001 + np.hypot(*(places[:, None] - places).transpose(2, 0, 1)) / 700) / 0.0005

    past = [np.cos(np.arange(7))]

    def slope(v: FloatArray, at: float) -> FloatArray:
        """dv/dt per step, at a time in steps."""
        then = np.clip(at - lags, 0, None)  # (source, target)
        first = np.minimum(np.floor(then).astype(int), len(past) - 1)
        share, rows = then - first, np.array(past)
        source = np.arange(7)[:, None]
        one, next_ = rows[first, source], rows[np.minimum(first + 1, len(past) - 1), source]
        drive = (weights * (one + share * (next_ - one))).sum(axis=0) + 0.2
        return np.asarray(0.5 * (np.tanh(drive) - v) / 12)

    for k in range(1, 120):
        v = past[-1]
        one = slope(v, k - 1)
        past.append(v + (one + slope(v + one, k)) / 2)
    # ours see the ends of a step from a millionth inside it
    np.testing.assert_allclose(found, past, rtol=0, atol=2e-7)


# ---- which delays are continuous -----------------------------------------------------------------------------------

MIXED = """\
time: {dt: 1 ms}
models:
  cell: {time: ms, ports: [seen], state: {v: {derivative: drive - v}}, outputs: {rate: v + seen, loud: v}, activity: v}
  through: {activity: drive}
inputs: {wave: {expression: sin(t)}, rows: {values: [1, 2, 3]}}
neurons:
  A: {model: cell}
  B: {model: cell, input: {seen: rows}}
  S: {input: wave}
  T: {input: rows}
  U: {model: through}
  V: {model: through, input: rows}
  O: {}
connections:
"""


@pytest.mark.parametrize(
    ("entry", "lag"),
    [
        ("A -> B: {delay: 2 ms}", 2.0),
        ("A -> B: {delay: 1.7 ms}", 1.7),
        ("A -> B: {delay: {seconds: 1.7*dt}, send: loud}", 1.7),
        ("A -> B: {delay: {matrix: [[2]]}}", None),
        ("A -> B: {delay: {seconds: {matrix: [[0.0025]]}}}", 2.5),
        ("A -> B: {edges: [[A, B, 1, 2.5 ms]]}", 2.5),
        ("A -> B: {delay: 2}", None),
        ("A -> B: {delay: 0 ms}", None),
        # what is sent is the same over a step, or nothing within it reads what arrives
        ("S -> B: {delay: 1.7 ms}", 1.7),
        ("T -> B: {delay: 1.7 ms}", None),
        ("B -> A: {delay: 1.7 ms, send: loud}", 1.7),
        ("A -> B: {delay: 1.7 ms, port: seen}", None),
        ("A -> O: {delay: 1.7 ms}", None),
        # through neurons without a state of their own
        ("{A -> U: {delay: 1.7 ms}, U -> B: {delay: 0}}", 1.7),
        ("{A -> U: {delay: 2}, U -> B: {delay: 1.7 ms}}", None),
        ("{A -> V: {delay: 1.7 ms}, V -> B: {delay: 0}}", None),
    ],
)
def test_which_delays_are_continuous(entry: str, lag: float | None) -> None:
    lags = network_of(f"{MIXED}- {entry}\n").connections.lags
    found = [] if lags is None else [one for one in lags.tolist() if not math.isnan(one)]
    assert found == ([] if lag is None else [lag])


def test_a_continuous_delay_is_another_network() -> None:
    hashes = {network_of(f"{MIXED}- A -> B: {{delay: {one}}}\n").hash for one in ("2", "2 ms", "2.2 ms", "2.3 ms")}
    assert len(hashes) == 4


def test_they_are_told() -> None:
    told = overview(nv.compile_text(f"neurovis: 1\nname: x\n{MIXED}- A -> B + O: {{delay: 1.7 ms}}\n"))
    assert "A -> B + O  2       1       2; between steps 1.7" in told
    assert "read between steps  A -> B + O" in told


# ---- what a run does with them -------------------------------------------------------------------------------------

LOOP = """\
neurovis: 1
name: loop
time: {dt: 0.1, integrate: heun}
parameters: {w: -0.8}
models:
  m: {state: {x: {initial: 1, derivative: drive - 0.2*x}}, activity: x, outputs: {seen: drive}}
synapses:
  plain: {signal: weight*pre}
  slow: {state: {g: {derivative: pre - g}}, signal: weight*g}
rules:
  kept: {state: {p: {each_step: pre}, q: {derivative: pre}}, weight: {each_step: weight + 0*p}}
neurons:
  A: {count: 2, model: m, initial: {x: [1, 0.5]}}
  B: {model: m}
connections:
  A -> B: {weight: w, delay: 0.43 s}
  B -> A: {weight: 0.7, delay: {seconds: 0.25 + 0.1*j}}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_comes_once_a_step_sees_whole_steps(backend: str) -> None:
    found = record(nv.compile_text(LOOP).network, Course(12, backend=backend, keep=Keep(states=("B.seen",))))
    signals = found.activity[:, :2] @ [-0.8, -0.8]
    np.testing.assert_allclose(found["B.seen"][4:], signals[:8], rtol=1e-15)
    # before the first step there was what is sent there
    np.testing.assert_allclose(found["B.seen"][1:4], signals[0], rtol=1e-15)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_synapse_reads_its_source_between_steps(backend: str) -> None:
    plain, joined = (
        record(nv.compile_text(one).network, Course(40, backend=backend)).activity
        for one in (LOOP, LOOP.replace("delay:", "synapse: plain, delay:"))
    )
    np.testing.assert_allclose(joined, plain, rtol=0, atol=1e-14)
    text = LOOP.replace("weight: w,", "weight: w, synapse: slow,")
    coarse, fine, finest = (
        record(
            nv.compile_text(text.replace("dt: 0.1", f"dt: {0.1 / parts}")).network,
            Course(20 * parts + 1, backend=backend, every=parts, keep=Keep(states=("(A1 -> B).g",))),
        )["(A1 -> B).g"]
        for parts in (1, 2, 16)
    )
    assert np.abs(coarse - finest).max() > 3 * np.abs(fine - finest).max()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_rule_sees_what_left_as_long_ago_as_the_delay_is(backend: str) -> None:
    text = LOOP.replace("q: {derivative: pre}", "") if backend == "c" else LOOP
    text = text.replace("weight: w, delay: 0.43 s", "weight: -0.8, delay: 0.43 s, plasticity: kept")
    found = record(nv.compile_text(text).network, Course(30, backend=backend, keep=Keep(states=("all",))))
    a = found.activity[:, 0]
    expected = np.interp(np.arange(30) - 4.3, np.arange(30), a)  # before the first step a[0]
    np.testing.assert_allclose(found["(A1 -> B).p"][1:], expected[1:], rtol=1e-14)
    if backend != "c":
        total = 0.1 * np.concatenate([[0], np.cumsum((expected[1:] + expected[:-1]) / 2)])
        np.testing.assert_allclose(found["(A1 -> B).q"], total, atol=1e-3)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("w", ["w", "-0.8"])
def test_a_lesion_loses_what_is_under_way(w: str, backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether each connection has signals of its own, or shares what is sent."""
    monkeypatch.setattr("neurovis_spec.runtime.signals.LEAST_SAVED", 1)
    text = LOOP.replace("weight: w", f"weight: {w}, pattern: all_to_all").replace("  B: {", "  B: {count: 2, ")
    text = text.replace("B -> A: {", "B -> A: {pattern: all_to_all, ")
    network = nv.compile_text(f"{text}events: [{{at: 9, lesion: A1 -> B1}}, {{at: 12, mend: A1 -> B1}}]\n")
    found = record(network.network, Course(30, backend=backend, keep=Keep(states=("B1.seen", "B2.seen"))))
    signals = -0.8 * found.activity[:, :2]
    missing = found["B2.seen"] - found["B1.seen"]
    np.testing.assert_allclose(missing[9:16], signals[5:12, 0], rtol=1e-12)
    np.testing.assert_allclose(missing[16:], 0, atol=1e-15)
    # between the last step that is lost and the first one that is not, the signal rises from 0
    expected = record(network.network, Course(30, backend="reference")).activity
    np.testing.assert_allclose(found.activity, expected, rtol=1e-13)


VARIED = """\
neurovis: 1
name: varied
time: {dt: 0.1, integrate: heun}
models: {m: {state: {x: {initial: 1, derivative: drive - 0.2*x}}, activity: x, outputs: {seen: drive}}}
neurons: {A: {count: 6, model: m, initial: {x: cos(i)}}, S: {count: 4, activation: tanh, bias: 0.3 - 0.1*i}}
parameters: {w: 0.1}
connections:
- A -> A: {weight: 0.2*sin(i - j), pattern: all_to_all, delay: {seconds: "uniform(0.1, 1)"}}
- A -> S: {weight: w*(i - j), pattern: all_to_all, delay: "uniform(1, 5)"}
- S -> A: {weight: 0.1*(1 + i - j), pattern: all_to_all, delay: 1 + i + j}
- S -> S: {weight: 0.2, pattern: all_to_all, delay: 1 + i, plasticity: {oja: {rate: 0.01}}}
events: [{at: 7, lesion: A1}, {at: 9, set: {w: -0.2}}, {at: 12, mend: A1}]
"""


@pytest.mark.parametrize("least", [1, 1 << 15])
def test_many_different_delays_give_the_same_bits(least: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Read and sent one by one, all at once, and each connection by itself."""
    monkeypatch.setattr("neurovis_spec.runtime.signals.LEAST_SAVED", least)
    network = nv.compile_text(VARIED)
    runs = [record(network.network, Course(30, backend="reference"))]
    for many in (0, 1000):
        monkeypatch.setattr("neurovis_spec.runtime.signals.MANY", many)
        runs.append(record(network.network, Course(30, backend="numpy")))
    for one in runs[1:]:
        np.testing.assert_allclose(one.activity, runs[0].activity, rtol=1e-13, atol=1e-15)
    np.testing.assert_array_equal(runs[1].activity, runs[2].activity)


@pytest.mark.compiler
@pytest.mark.parametrize("least", [1, 1 << 15])
def test_many_different_delays_in_c(least: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("neurovis_spec.runtime.signals.LEAST_SAVED", least)
    same_bits(nv.compile_text(VARIED), 20)


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.compiler)])
@pytest.mark.parametrize("cut", [1, 3, 9])
def test_a_run_goes_on_from_a_recording(cut: int, backend: str, tmp_path: Path) -> None:
    """From one that is shorter than the delays, too: what was before it is known."""
    network = nv.compile_text(LOOP)
    whole = network.run(25, backend=backend, states="all")
    first = network.run(cut, backend=backend, states="all")
    rest = network.run(25 - cut, backend=backend, states="all", start=first)
    np.testing.assert_array_equal(rest.activity, whole.activity[cut:])


READ = """neurovis: 1
name: read
time: {dt: 0.1}
models: {m: {state: {x: {derivative: -x + drive}}, activity: x}}
synapses: {pull: {signal: weight*(pre.x - post.x)}}
rules: {drawn: {state: {c: {each_step: pre.x - pre}}, weight: {each_step: weight + 0.1*pre*post - 0.01*c}}}
neurons: {A: {count: 3, model: m, initial: {x: 1 + i}}, B: {model: m, initial: {x: -1}}}
connections:
- A -> B: {weight: 0.5, synapse: pull, delay: {seconds: 0.25 + 0.3*i}}
- A -> B: {weight: 0.1*(1 + i), delay: {seconds: 0.35}, plasticity: drawn}
- B -> A: {weight: 0.4, synapse: pull, delay: 2 + 2*j}
- B -> A: {weight: 0.1, delay: 5, plasticity: drawn}
"""


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
@pytest.mark.parametrize("cut", [1, 3, 5, 9])
def test_what_synapses_and_rules_read_of_the_past_goes_on_from_a_recording(cut: int, backend: str) -> None:
    """From one that is shorter than the delays, too: with a continuous one what was before is the initial output, with
    one in steps 0."""
    network = nv.compile_text(READ)
    whole = network.run(20, backend=backend, states="all")
    first = network.run(cut, backend=backend, states="all")
    rest = network.run(20 - cut, backend=backend, states="all", start=first)
    np.testing.assert_array_equal(rest.states, whole.states[cut:])
    np.testing.assert_array_equal(rest.weights, whole.weights[cut:])
    np.testing.assert_array_equal(rest["(B -> A).signal"], whole["(B -> A).signal"][cut:])


def test_halving_the_step_keeps_the_delay() -> None:
    network = nv.compile_text(LOOP).network
    found = {one.name: (one.order, one.why) for one in check_step(network, Course(60)).errors}
    for name in ("A", "A.x", "B", "B.x"):
        assert 1.4 < (found[name][0] or 0) < 2.8, name


FORMS: list[Callable[[str], str]] = [
    str,
    lambda text: text.replace(
        "count: 2, model: m, initial: {x: [1, 0.5]}", "count: 30, model: m, initial: {x: cos(i)}"
    ),
]


@pytest.mark.compiler
@pytest.mark.parametrize("form", FORMS, ids=["few", "many"])
@pytest.mark.parametrize("real", ["double", "float"])
def test_exported_as_well(form: Callable[[str], str], real: str, tmp_path: Path) -> None:
    network = nv.compile_text(form(LOOP))
    if real == "double":
        same_bits(network, 20)
    controller = exported(network, tmp_path, "C99", real=real)
    for row in network.run(20, backend="reference").activity:
        controller.step()
        np.testing.assert_allclose(controller.activity, row, rtol=0, atol=0 if real == "double" else 1e-4)


BEGINNING = """\
neurovis: 1
name: beginning
time: {dt: 0.1, integrate: euler}
models:
  source: {state: {v: {initial: 1, derivative: -v}}, activity: v}
  cell: {state: {v: {derivative: drive}, seen: {each_step: drive}}, activity: v}
synapses: {brought: {state: {u: {each_step: pre.v}}, signal: weight*pre.v + u}}
neurons: {S: {count: 3, model: source}, A: {count: 3, model: cell}, B: {count: 3, model: cell}}
connections:
  S -> A: {pattern: one_to_one, synapse: brought, delay: {seconds: 0.42 - 0.1*i}}
  S -> B: {pattern: one_to_one, synapse: brought, delay: 1 + i}
"""


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("apart", [True, False])
def test_a_synapse_brings_before_the_first_step_what_was_there_wherever_it_is_formed(backend: str, apart: bool) -> None:
    """Also in the map, for which delays are rounded, and in a picture; with a delay in steps there is 0 until something
    arrives. Where they lead to one group they are formed together."""
    text = BEGINNING
    if not apart:
        text = text.replace("A: {count: 3,", "A: {count: 6,").replace(", B: {count: 3, model: cell}", "")
        text = text.replace("S -> A:", "S -> A1..A3:").replace("S -> B:", "S -> A4..A6:")
    simulation = Simulation(nv.compile_text(text).network, backend)
    v = 0.9 ** np.arange(8)
    for k in range(8):
        simulation.step()
        late = v[np.maximum(k - np.array([4, 3, 2]), 0)]
        held = np.where(k >= np.arange(1, 4), v[k - np.arange(1, 4)], 0)
        expected = 2 * np.concatenate([late, held]) if k else np.zeros(6)
        state = simulation.state()
        if k:  # at step 0 no state of it is made
            seen = np.concatenate([one["seen"] for one in state.cells.values() if "seen" in one])
            np.testing.assert_allclose(seen, expected, rtol=1e-12)
            np.testing.assert_allclose(signals_of(simulation.network, state, state.weights), expected, rtol=1e-12)
