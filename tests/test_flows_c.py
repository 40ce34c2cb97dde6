"""What flows, in C: the bits of the reference, written out and in loops, in a library and exported."""

from __future__ import annotations

import re
import tempfile
import warnings
from pathlib import Path

import numpy as np
import pytest
from exported import built, exported
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from random_flows import flowing_specs
from random_specs import Spec
from test_export_c import runs_alike
from test_flow_conformance import compiled, in_pieces

import neurovis_spec as nv
from neurovis_spec.runtime import c_backend, c_export
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.reference import ReferenceBackend
from neurovis_spec.runtime.state import State, initial_state

pytestmark = pytest.mark.compiler
FORMS = pytest.mark.parametrize("small", [0, 600], ids=["loops", "written out"])
MANY = """
neurovis: 1
name: many
time: {dt: 0.01, integrate: METHOD}
models:
  rate:
    time: ms
    parameters: {tau: 20}
    ports: [gate]
    state: {v: {derivative: (f(drive + 0.1*gate) - v)/tau}}
    outputs: {twice: 2*v}
    activity: v
inputs: {wave: {expression: sin(9*t)}}
neurons:
  A: {count: 40, model: {rate: {tau: 15 + i}}, activation: tanh, initial: {v: 0.1*sin(i)}, input: wave}
  B: {count: 30, model: rate, activation: sigmoid, bias: {gate: 0.2}}
connections:
  - A -> A: {weight: "normal(0, 0.3)", pattern: all_to_all}
  - A -> B: {weight: "uniform(-1, 1)", pattern: {random: {probability: 0.6}}, port: {drive: 0.5, gate: 1}}
  - B -> A: {weight: "uniform(-1, 1)", pattern: {random: {probability: 0.6}}, delay: 2, port: gate}
  - B -> A: {weight: "uniform(-1, 1)", pattern: all_to_all, send: twice, port: gate}
"""


def same_bits(network: nv.CompiledNetwork, steps: int) -> None:
    """Activities, weights and states of the C backend are the reference's, many steps by a call and one by one."""
    states = Keep(states=("all",))
    expected, found = (record(network.network, Course(steps, backend=one, keep=states)) for one in ("reference", "c"))
    for part in ("activity", "weights", "states"):
        np.testing.assert_array_equal(getattr(found, part), getattr(expected, part), part)
    one_by_one = record(
        network.network, Course(steps, backend="c", keep=Keep(neurons=(network.network.neurons.names[0],)))
    )
    np.testing.assert_array_equal(one_by_one.activity[:, 0], expected.activity[:, 0])


JOINED = """
neurovis: 1
name: joined
time: {dt: 0.01, integrate: METHOD}
parameters: {level: 0.5}
models:
  rate:
    time: ms
    parameters: {tau: 20}
    ports: [gate]
    state: {v: {derivative: (f(drive + 0.1*gate) - v)/tau}, s: {initial: 0.1, derivative: 0.01*(v - s)}}
    activity: v
  step: {state: {u: {initial: 0.2, each_step: 0.9*u + 0.1*drive}}, activity: u, outputs: {twice: 2*u}}
synapses:
  graded: {parameters: {E: 0.3}, signal: weight*pre.s*(E - post.v)}
  gap: {signal: weight*(pre.v - post.v)}
  slow:
    time: ms
    parameters: {tau: 30, E: 0}
    state: {g: {initial: 0.1, derivative: (pre - g)/tau}}
    signal: weight*g*(E - 0.1*post.s)
  kept: {state: {r: {each_step: 0.8*r + 0.2*sent}}, signal: weight*r*post.u}
neurons:
  A: {count: 20, model: {rate: {tau: 15 + i}}, activation: tanh, initial: {v: 0.1*sin(i)}}
  B: {count: 18, model: rate, activation: sigmoid, bias: {gate: 0.2}}
  M: {count: 17, model: step, bias: 0.1}
connections:
  - A -> A: {weight: "normal(0, 0.3)", pattern: {random: {probability: 0.6}}, synapse: {graded: {E: level + 0.01*i}}}
  - A -> A: {weight: "uniform(0, 1)", pattern: {random: {probability: 0.2}}, synapse: gap}
  - A -> B: {weight: 0.4, pattern: {random: {probability: 0.6}}, port: {drive: 1, gate: 2}, synapse: {slow: {E: level}}}
  - B -> A: {weight: "uniform(-1, 1)", pattern: {random: {probability: 0.6}}, delay: 2, synapse: gap}
  - B -> A: {weight: "uniform(-1, 1)", pattern: all_to_all, send: s}
  - B -> A: {weight: 0.3, pattern: {random: {probability: 0.3}}, delay: {seconds: 0.013 + 0.001*i}, synapse: graded}
  - M -> M: {weight: 0.1, pattern: {random: {probability: 0.8}}, synapse: kept, delay: 1}
  - M -> A: {weight: 0.1, pattern: {random: {probability: 0.3}}, send: twice, port: gate, plasticity: oja}
  - B -> M: {weight: 0.2, pattern: all_to_all, synapse: kept, delay: 0}
events:
  - {at: 5, lesion: [A3, M -> M]}
  - {from: 6, to: 7, clamp: {B2: 0.4}}
  - {at: 6, set: {level: 0.6}}
  - {at: 7, mend: [A3, M -> M]}
"""


DISTANCES = """
neurovis: 1
name: distances
time: {dt: 0.01}
models:
  near: {ports: {far: distance}, state: {v: {initial: 0.1, derivative: far - v}}, activity: v}
  free: {state: {v: {initial: 0.5, derivative: 1 - v}}, activity: v}
neurons: {S: {bias: 0.7}, F: {model: free}, T: {count: 2, model: near}}
connections:
  S -> T: {pattern: all_to_all, weight: 0.5, delay: 1, port: far}
  F -> T1: {weight: 0.5, port: far}
"""


@FORMS
def test_a_distance_is_one_where_only_some_neurons_are_given_what_flows(
    small: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(c_backend, "SMALL", small)
    same_bits(nv.compile_text(DISTANCES), 5)


@FORMS
@settings(max_examples=12, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=flowing_specs())
def test_random_networks_have_the_bits_of_the_reference(small: int, spec: Spec) -> None:
    compiled(spec)
    with warnings.catch_warnings(), pytest.MonkeyPatch.context() as patch:
        warnings.simplefilter("ignore")
        patch.setattr(c_backend, "SMALL", small)
        same_bits(nv.compile(spec), 12)


@FORMS
@settings(max_examples=4, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=flowing_specs(), cut=st.integers(1, 11))
def test_a_run_in_pieces_is_the_whole_one(small: int, spec: Spec, cut: int) -> None:
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(c_backend, "SMALL", small)
        in_pieces(compiled(spec), "c", cut, Path(folder) / "state")


@pytest.mark.parametrize("method", ["euler", "heun", "rk4", "{method: exponential, substeps: 2}", "semi_implicit"])
def test_many_neurons_are_summed_beside_each_other_in_their_order(method: str) -> None:
    network = nv.compile_text(MANY.replace("METHOD", method))
    assert len(network.network.connections) > c_backend.SMALL
    same_bits(network, 4)


SPRING = (
    "v: {initial: 0.3, derivative: y - 0.3*v}, y: {initial: -0.2, derivative: -v - 0.1*y*c}, "
    "c: {initial: 1, each_step: 0.9*c}"
)
GATED = "g: {initial: 1, derivative: -g}, v: {initial: 0, derivative: g*(1 - v)}"


@pytest.mark.parametrize("method", ["euler", "exponential", "semi_implicit"])
@pytest.mark.parametrize("states", [GATED, SPRING])
def test_a_state_that_is_changed_in_place_is_read_as_it_was(states: str, method: str) -> None:
    """By the derivatives of those behind it, of which the slope varies."""
    network = nv.compile_text(
        f"""neurovis: 1
name: m
time: {{dt: 0.1, integrate: {method}}}
models: {{m: {{state: {{{states}}}, activity: v}}}}
neurons: {{A: {{model: m, count: {c_backend.SMALL + 1}}}}}
"""
    )
    same_bits(network, 20)


@pytest.mark.parametrize("method", ["heun", "exponential"])
def test_many_synapses_of_several_kinds_are_added_up_in_their_order(method: str) -> None:
    """Runs of connections of a kind, kinds that take turns, packed weights; and all that events do to them."""
    text = JOINED.replace("METHOD", method)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        same_bits(nv.compile_text(text), 13)


@FORMS
@settings(max_examples=5, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=flowing_specs())
def test_random_networks_run_alike_when_exported(small: int, spec: Spec) -> None:
    compiled(spec)
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        warnings.simplefilter("ignore")
        patch.setattr(c_export, "SMALL", small)
        runs_alike(nv.compile(spec), Path(folder), steps=12)


GAPS = """
neurovis: 1
name: gaps
time: {dt: 0.01, integrate: METHOD}
models:
  cell:
    state: {v: {initial: 0.1, derivative: GROWTH*v + drive}, s: {derivative: v - s}}
    outputs: {above: v - 1}
    activity: v
synapses:
  gap: {signal: weight*(pre.v - post.v)}
  opened: {signal: weight*pre.s*(1 - post.v)}
neurons: {N: {count: 20, model: cell, initial: {v: 0.1*sin(i)}}}
connections:
  - N -> N: {weight: "uniform(0, 0.1)", pattern: {random: {probability: 0.5}}, synapse: gap}
  - N -> N: {weight: "uniform(0, 0.1)", pattern: {random: {probability: 0.5}}, synapse: opened}
"""


def in_a_block(network: nv.CompiledNetwork, steps: int) -> tuple[int, State]:
    """How many of some steps are made by a call, and the state behind them."""
    stepper, state = c_backend.CBackend().prepare(network.network), initial_state(network.network)
    rows, none = np.empty((steps, len(state.activity))), np.empty((steps, 0))
    return stepper.run(state, none, rows, none, 1, look=True), state


@pytest.mark.parametrize("method", ["euler", "rk4"])
def test_what_only_synapses_take_at_stages_is_there_behind_a_block(method: str) -> None:
    """No step of it writes what none reads; weights are packed once, in the order of the stage."""
    network = nv.compile_text(GAPS.replace("METHOD", method).replace("GROWTH", "-1"))
    written, plain = c_backend.written(network.network), initial_state(network.network)
    assert written.text.count("outlets[p] = ") == 2  # in nv_general and nv_let_out
    assert written.packed == len(network.network.connections)
    made, state = in_a_block(network, 6)
    stepper = ReferenceBackend().prepare(network.network)
    for _ in range(made):
        stepper.step(plain, np.zeros(0))
    assert made == 6
    assert state.outlets.tobytes() == plain.outlets.tobytes()
    for owner, own in plain.cells.items():
        for name, values in own.items():
            assert state.cells[owner][name].tobytes() == values.tobytes(), name


def test_a_block_ends_behind_the_step_that_is_not_finite_where_the_activity_is_a_state() -> None:
    network = nv.compile_text(GAPS.replace("METHOD", "euler").replace("GROWTH", "1e6"))
    with np.errstate(all="ignore"):
        made, state = in_a_block(network, 200)
        before, state_before = in_a_block(network, made - 1)
    assert before == made - 1 < 199
    assert np.isfinite(state_before.activity).all()
    assert not np.isfinite(state.activity).all()


@pytest.mark.parametrize("text", [MANY, JOINED], ids=["ports", "synapses"])
def test_what_arrives_is_put_together_in_the_struct_of_what_is_exported(text: str, tmp_path: Path) -> None:
    """Not on the stack, of which a microcontroller has little."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        network = nv.compile_text(text.replace("METHOD", "heun"))
        runs_alike(network, tmp_path, steps=9)
    source = c_export.Exported(network.network).source()
    assert "double *const u" in source
    assert not re.findall(r"^ +double u\d+\[\d+\];", source, re.MULTILINE)


@pytest.mark.parametrize("method", ["rk4", "exponential"])
def test_numbers_of_32_bits(method: str, tmp_path: Path) -> None:
    network = nv.compile_text(MANY.replace("METHOD", method))
    expected = network.run(4, backend="numpy").activity
    controller = exported(network, tmp_path, "C++17", real="float")
    for row in expected:
        controller.step()
        np.testing.assert_allclose(controller.activity, row, rtol=0, atol=1e-4)


def test_nothing_is_differentiated_where_no_method_asks_for_it() -> None:
    text = (Path(__file__).parent / "errors/flows_slope_too_long.yaml").read_text().replace("exponential", "rk4")
    same_bits(nv.compile_text(text), 3)


@pytest.mark.parametrize("method", ["exponential", "semi_implicit"])
def test_a_state_that_is_held_stays_where_its_slope_is_undefined(method: str) -> None:
    text = f"""
neurovis: 1
name: held
time: {{dt: 0.1, integrate: {{method: {method}, substeps: 2}}}}
models: {{m: {{state: {{v: {{initial: 1, derivative: sqrt(v)}}, w: {{derivative: v - w}}}}, activity: w}}}}
neurons: {{A: {{model: m}}}}
events: [{{from: 2, clamp: {{A.v: -1}}}}]
"""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        same_bits(nv.compile_text(text), 5)


@FORMS
@pytest.mark.parametrize(
    "state",
    ["derivative: -v + 0.3*drive", "derivative: drive - v, each_step: 0.9*v", "derivative: drive, each_episode: 0.1"],
)
@pytest.mark.parametrize("sent", ["tanh(v)", "v*cos(t)", "p*f(v)"])
def test_what_is_there_from_the_step_before_is_what_a_stage_would_make(
    small: int, state: str, sent: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also right behind a step in which a neuron was held, and a parameter was another."""
    text = f"""
neurovis: 1
name: again
time: {{dt: 0.1, episode: 4}}
parameters: {{p: 0.7}}
models:
  m: {{parameters: {{p: 1}}, state: {{v: {{initial: 0.4, {state}}}}}, outputs: {{o: "{sent}"}}, activity: f(v)}}
neurons: {{A: {{count: 3, model: {{m: {{p: p}}}}, bias: 0.2*i}}, B: {{model: m}}}}
connections: [{{A -> A: {{weight: 0.3, pattern: all_to_all, send: o}}}}, {{A -> B: {{weight: 1, pattern: all_to_all}}}}]
events: [{{from: 5, to: 7, clamp: {{A1: 0.9}}}}, {{at: 9, set: {{p: 0.2}}}}]
"""
    monkeypatch.setattr(c_backend, "SMALL", small)
    network = nv.compile_text(text)
    taken = c_backend.written(network.network).text.count("if (follows && ")
    assert taken == ((sent != "v*cos(t)") + 1) * ("each_episode" not in state)
    same_bits(network, 14)


CONDUCTANCES = """
neurovis: 1
name: conductances
time: {dt: 0.001, integrate: METHOD}
models:
  cell:
    parameters: {E: -60}
    state: {v: {initial: -50, derivative: 10*(E - v) + drive}, s: {derivative: 5*(1/(1 + exp(-0.2*(v + 40))) - s)}}
    activity: v
synapses:
  graded: {parameters: {E: -75}, signal: weight*pre.s*(E - post.v)}
  slow: {parameters: {E: 0}, state: {g: {derivative: 3*(tanh(pre.v) - g)}}, signal: weight*g*tanh(E - post.v)}
neurons: {A: {count: 4, model: cell, bias: 200, initial: {v: -50 + i}}}
connections:
  - A1 -> A2: {weight: 3, synapse: graded}
  - A2 -> A1: {weight: 3, synapse: graded}
  - A3 -> A4: {weight: 3, synapse: slow}
  - A4 -> A3: {weight: 3, synapse: slow, delay: 2}
events: [{from: 5, to: 9, clamp: {A1.v: -40}}, {at: 6, lesion: A3 -> A4}, {at: 8, mend: A3 -> A4}]
"""


@pytest.mark.parametrize(("method", "stages", "calls"), [("rk4", 4, 4 * 8), ("exponential", 1, 8 + 2)])
def test_exported_conductances_say_what_they_cost(method: str, stages: int, calls: int, tmp_path: Path) -> None:
    """No heap; the size of the state, the stages, the signals and the functions of a step, as they are."""
    network = nv.compile_text(CONDUCTANCES.replace("METHOD", method))
    runs_alike(network, tmp_path, steps=14)
    readme, source = ((tmp_path / name).read_text() for name in ("README.md", "conductances.c"))
    assert f"takes {len(built(network, tmp_path).memory)} bytes" in readme
    assert f"- {stages} stage" in readme
    assert "at each 10 derivatives, and 4 signals made anew" in readme
    assert f"- {calls} calls of functions" in readme
    assert "malloc" not in source
