"""States of connections that are kept once for many, in whole runs in C: each number as where every connection has its
own, in networks of any make, whatever is done to them meanwhile."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from random_specs import Spec
from random_spikes import spiking_specs
from test_flow_conformance import arrays, compiled

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime import c_backend
from neurovis_spec.runtime import record as blocks
from neurovis_spec.runtime.c_backend import CStepper, written
from neurovis_spec.runtime.columns import Keep, columns_of
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.kept_once import kept_once
from neurovis_spec.runtime.record import InMemory, record, run_steps
from neurovis_spec.runtime.rows import Steps
from neurovis_spec.runtime.state import initial_state

TRACES = """
neurovis: 1
name: traces
seed: 4
time: {dt: 1 ms, integrate: {method: METHOD, substeps: 2}}
parameters: {fade: 6, up: 0.1, gain: 1}
models:
  cell:
    time: ms
    ports: [kick]
    state: {v: {initial: 0, derivative: (drive - v)/7, jump: kick}}
    spike: {when: v >= 1, set: {v: 0}, refractory: 2, hold: v}
rules:
  pairs:
    time: ms
    parameters: {fade: 6, up: 0.1, down: 0.07}
    let: {slower: 2*fade}
    state:
      a: {derivative: -a/fade, on_pre: a + up}
      slow: {initial: 0.5, derivative: (a - slow)/slower}
      b: {derivative: -b/4, on_post: b - down}
      seen: {on_pre: seen + a + 0.1*b}
      drift: {derivative: 0.3*(a + pre.v - drift)}
    weight: {on_pre: weight + b + 0.01*slow, on_post: weight + a - 0.01*drift}
  count: {state: {n: {each_step: 0.9*n, on_post: n + 1}}, weight: {each_step: weight - 0.001*n*pre}}
synapses:
  tired:
    time: ms
    let: {u1: u + 0.4*(1 - u)}
    state:
      u: {derivative: -u/30, on_pre: u1}
      x: {initial: 1, derivative: (1 - x)/20, on_pre: x - u1*x}
      g: {derivative: -g/3, on_pre: g + u1*x*weight}
    signal: g*(1 + 0.1*x)
  fading: {time: ms, state: {g: {derivative: -g/3, on_pre: g + weight}}, signal: g*(2 - post.v)}
neurons:
  A: {count: 5, model: cell, bias: "uniform(1, 2.5)", initial: {v: "uniform(0, 1)"}}
  B: {count: 4, model: cell, bias: "gain*uniform(0.8, 2)", initial: {v: "uniform(0, 1)"}}
connections:
  A -> B: {weight: "normal(0, 0.2)", pattern: all_to_all, port: kick, delay: "DELAY", bounds: [-1, 1],
    plasticity: [RULE, count]}
  B -> A: {weight: "normal(0, 0.5)", pattern: all_to_all, synapse: tired, delay: 2, plasticity: RULE}
  A -> A: {weight: 0.02*i, pattern: all_to_all, synapse: fading}
events: [EVENTS]
"""
EVENTS = {
    "nothing": "",
    "lesioned": "{at: 7, lesion: [A2, B3 -> A5]}, {at: 14, mend: [A2, B3 -> A5]}, "
    "{at: 16, learning: {A -> B: false}}, {at: 18, learning: {A -> B: true}}",
    "held": "{from: 5, to: 9, clamp: {A3: 1, B2: 0, (A1 -> B2).a: 0.3}}",
    "set": "{at: 6, set: {up: 0.3, gain: 1.4}}, {at: 15, set: {fade: 3}}",
}


def traces(method: str = "rk4", delay: str = "1", rule: str = "pairs", events: str = "") -> Network:
    text = TRACES.replace("METHOD", method).replace("DELAY", delay).replace("RULE", rule).replace("EVENTS", events)
    return nv.compile_text(text).network


def kept(network: Network) -> dict[str, int]:
    """The states that are kept once, and how often."""
    once = kept_once(network)
    found = {} if once is None else once.kept
    return {f"{key.owner.number}.{key.name}": len(one.first) for key, one in found.items() if key.owner is not None}


def followed(network: Network, backend: str, pieces: tuple[int, ...], every: int = 1) -> list[dict[str, FloatArray]]:
    """All numbers of the state behind each of these pieces of a run, and the activities of its steps."""
    state, found = initial_state(network), list[dict[str, FloatArray]]()
    for steps in pieces:
        course = Course(steps, backend=backend, keep=Keep(weights=False), every=every)
        rows = InMemory(columns_of(network, course.keep).widths(network), len(Steps(steps, every, state.k)), state.k)
        run_steps(network, state, course, rows)
        found.append({**arrays(state.copy()), "rows": rows.numbers(Steps(steps, every, state.k - steps)).rows.activity})
    return found


def agree(network: Network, pieces: tuple[int, ...] = (9, 1, 16), every: int = 1) -> None:
    for one, other in zip(*(followed(network, name, pieces, every) for name in ("reference", "c")), strict=True):
        for (name, expected), found in zip(one.items(), other.values(), strict=True):
            np.testing.assert_array_equal(found, expected, name)


@pytest.fixture
def loops(monkeypatch: pytest.MonkeyPatch) -> None:
    """Networks of any size are gone through in loops, and blocks of steps are as long as can be, whatever they take."""
    monkeypatch.setattr(c_backend, "SMALL", 0)
    monkeypatch.setattr(blocks, "_BLOCK", 1e9)
    c_backend.forget()


@pytest.mark.compiler
@pytest.mark.usefixtures("loops")
@settings(max_examples=5, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=spiking_specs(most=4))
def test_whole_runs_are_those_of_the_reference(spec: Spec) -> None:
    agree(compiled(spec), pieces=(5, 9))


def test_traces_are_kept_once_for_each_source_and_delay_and_for_each_target() -> None:
    # one projection has the rule wherever it is: spikes come from 9 neurons
    found = {"0.a": 9, "0.slow": 9, "0.b": 9, "1.n": 4, "2.u": 4, "2.x": 4, "3.g": 5}
    assert kept(traces()) == found
    assert kept(traces(delay="1 + (i + j) % 3")) == found | {"0.a": 19, "0.slow": 19}


ALONE = {
    "what is set for all": ("{pairs: {fade: fade, up: up}}", {"a", "slow", "b"}),
    "parameters of a source": ("{pairs: {fade: 5 + i}}", {"a", "slow", "b"}),
    "parameters of a target": ("{pairs: {up: 0.1 + 0.1*j, down: 0.1*j}}", {"b"}),
    "parameters of each": ("{pairs: {fade: 5 + i, down: 0.1*i*j}}", {"a", "slow"}),
    "what is set for some": ("{pairs: {fade: 'fade + i'}}", {"b"}),
}


@pytest.mark.parametrize("what", ALONE)
def test_parameters_have_to_be_the_same_for_all_that_are_kept_once(what: str) -> None:
    rule, expected = ALONE[what]
    network = traces(rule=rule)
    assert {name[2:] for name in kept(network) if name.startswith("0.")} == expected


@pytest.mark.parametrize(
    ("state", "names"),
    [
        ("{s: {derivative: -s/9, on_pre: s + 1}}", {"s"}),
        ("{s: {derivative: -s/9, on_pre: s + 1, on_post: s - 1}}", set[str]()),
        ("{s: {derivative: -s/9, on_pre: s + weight}}", set[str]()),
        ("{s: {derivative: -s/9, on_pre: s + pre.v}}", set[str]()),
        ("{s: {derivative: -s/9}}", set[str]()),
        ("{s: {on_pre: s + 1}}", set[str]()),
        ("{s: {on_pre: s + 1}, r: {derivative: (s - r)/t, on_pre: k*r}}", {"s", "r"}),
        ("{s: {derivative: -s/9, on_pre: s + r}, r: {derivative: -r/5}}", set[str]()),
        ("{s: {derivative: -s/9, on_pre: s + r}, r: {on_post: r + 1}}", set[str]()),
        ("{s: {each_step: 0.9*s, on_post: s + 1, each_episode: s/2}}", set[str]()),
    ],
)
def test_what_is_kept_once_reads_itself_and_one_side_alone(state: str, names: set[str]) -> None:
    text = TRACES[: TRACES.index("rules:")] + (
        f"rules: {{own: {{time: ms, state: {state}, weight: {{on_post: weight + s}}}}}}\n"
        "neurons: {A: {count: 3, model: cell}, B: {count: 2, model: cell}}\n"
        "connections: {A -> B: {weight: 1, pattern: all_to_all, port: kick, plasticity: own}}\n"
    )
    network = nv.compile_text(
        text.replace("substeps: 2}", "substeps: 2}, episode: 9").replace("METHOD", "euler")
    ).network
    assert {name[2:] for name in kept(network)} == names


@pytest.mark.parametrize(
    ("weight", "more", "names"),
    [
        ("0.3", "", {"g"}),
        ("0.1*i", "", {"g"}),
        ("0.1*j", "", set[str]()),
        ("w", "", set[str]()),
        ("0.3", ", plasticity: count", set[str]()),
    ],
)
def test_weights_that_stay_are_like_parameters(weight: str, more: str, names: set[str]) -> None:
    text = (
        TRACES[: TRACES.index("events:")].replace("0.02*i", weight).replace("synapse: fading", f"synapse: fading{more}")
    )
    text = text.replace("up: 0.1, gain", "up: 0.1, w: 1, gain").replace("METHOD", "heun").replace("DELAY", "1")
    network = nv.compile_text(text.replace("RULE", "pairs")).network
    assert {name[2:] for name in kept(network) if name.endswith(".g")} == names


@pytest.mark.compiler
@pytest.mark.usefixtures("loops")
@pytest.mark.parametrize(
    ("events", "delay", "rule", "method"),
    [
        ("nothing", "1 + (i + j) % 3", "pairs", "exponential"),
        ("lesioned", "2", "{pairs: {fade: fade + i, up: up}}", "rk4"),
        ("held", "1", "{pairs: {fade: 5 + i, up: up}}", "heun"),
        ("set", "1 + j % 2", "{pairs: {fade: fade, up: up}}", "semi_implicit"),
    ],
)
def test_runs_in_pieces_are_those_of_the_reference(events: str, delay: str, rule: str, method: str) -> None:
    """Also where copies differ behind a lesion, a clamp or a stop, and checkpoints lie anywhere."""
    network = traces(method, delay, rule, EVENTS[events])
    assert written(network).once
    agree(network)


@pytest.mark.compiler
@pytest.mark.usefixtures("loops")
def test_what_brings_a_signal_that_steps_change_is_held_as_ever() -> None:
    """An activity that reads it is taken at a stage as the step before has left it, by rules that see it."""
    text = TRACES[: TRACES.index("rules:")].replace(
        "models:",
        """models:
  sum: {time: ms, ports: [p], state: {v: {initial: 0.3, derivative: (drive - v)/7}}, activity: v + p}""",
    )
    text += """
rules: {seen: {time: ms, state: {d: {derivative: 0.3*(post - d)}}, weight: {each_step: weight + 0.01*d}}}
synapses: {fading: {state: {g: {each_step: 0.8*g, on_pre: g + 1}}, signal: g*weight}}
neurons: {A: {count: 3, model: cell, bias: 2}, B: {count: 2, model: sum, bias: 1}}
connections:
  A -> B: {weight: 0.3, pattern: all_to_all, synapse: fading, port: p, delay: 1}
  B -> B: {weight: 0.2, pattern: all_to_all, delay: 1, plasticity: seen}
"""
    network = nv.compile_text(text.replace("METHOD", "rk4")).network
    assert set(kept(network).values()) == {3}
    agree(network)


@pytest.mark.compiler
@pytest.mark.usefixtures("loops")
def test_weights_of_a_state_that_somebody_has_changed_count() -> None:
    text = TRACES[: TRACES.index("  A -> B")] + "  A -> A: {weight: 0.1, pattern: all_to_all, synapse: fading}\n"
    network = nv.compile_text(text.replace("METHOD", "heun")).network
    assert written(network).once
    found = []
    for backend in ("reference", "c"):
        state = initial_state(network)
        state.weights[[1, 7]] = 0.7, -0.3
        course = Course(12, backend=backend)
        run_steps(network, state, course, InMemory(columns_of(network, course.keep).widths(network), 12))
        found.append(arrays(state))
    for name, expected in found[0].items():
        np.testing.assert_array_equal(found[1][name], expected, name)


@pytest.mark.compiler
@pytest.mark.usefixtures("loops")
def test_what_is_kept_once_is_what_each_connection_would_have(monkeypatch: pytest.MonkeyPatch) -> None:
    """To the bit, zeros among it; and where states are recorded, each connection has its own."""
    network, steppers = traces("exponential", "2", events=EVENTS["set"]), list[CStepper]()
    take_code = CStepper._take_code

    def noting(stepper: CStepper, own_signals: bool) -> None:
        take_code(stepper, own_signals)
        steppers.append(stepper)

    monkeypatch.setattr(CStepper, "_take_code", noting)
    once = followed(network, "c", (18, 1, 7), every=4)
    for stepper, found in zip(steppers, once, strict=True):
        there = kept_once(network)
        assert there is not None
        last = [found[f"{key.owner}.{key.name}"][one.first] for key, one in there.kept.items()]
        np.testing.assert_array_equal(stepper._once, np.concatenate(last))
    recorded = record(network, Course(26, backend="c", keep=Keep(states=("(A -> B).a",))))
    assert not steppers[-1]._once.any()
    np.testing.assert_array_equal(recorded["(A -> B).a"][-1], once[-1]["Owner(kind='rule', number=0).a"][:20])
    monkeypatch.setattr(c_backend, "kept_once", lambda _: None)
    c_backend.forget()
    for one, other in zip(once, followed(network, "c", (18, 1, 7), every=4), strict=True):
        assert {name: array.tobytes() for name, array in one.items()} == {
            name: array.tobytes() for name, array in other.items()
        }
