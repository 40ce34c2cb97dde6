"""What flows, in every backend and however it is run: each step as the reference makes it, pieces as the whole."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st
from random_flows import flowing_specs
from random_specs import Plain, Spec

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import SpecError
from neurovis_spec.live.carry import carried
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.runtime import numpy_flows
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.reference import ReferenceBackend
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.state import State, initial_state

STEPS = 12


def compiled(spec: Spec) -> Network:
    """The network of a spec, unless connections without delay form a cycle in it."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return nv.compile(spec).network
    except SpecError as error:
        assume(all(one.code not in ("delay-0-cycle", "algebraic-loop") for one in error.diagnostics))
        raise


def arrays(state: State) -> dict[str, FloatArray]:
    """All numbers of a state, by what they are."""
    cells = {f"{owner}.{name}": values for owner, own in state.cells.items() for name, values in own.items()}
    return {
        "activity": state.activity, "outlets": state.outlets, "weights": state.weights, "signals": state.signals,
        "history": state.history, **cells,
    }  # fmt: skip


@settings(max_examples=20, deadline=None)
@given(spec=flowing_specs())
def test_each_step_begun_in_the_references_state_agrees(spec: Spec) -> None:
    follow(spec, exact=False)


@settings(max_examples=20, deadline=None)
@given(spec=flowing_specs(exact=True))
def test_sums_and_products_are_those_of_the_reference_bit_for_bit(spec: Spec) -> None:
    follow(spec, exact=True)


def follow(spec: Spec, exact: bool) -> None:
    """Each step in NumPy is that of the reference, with all events."""
    network = compiled(spec)
    plain, fast, reader = ReferenceBackend().prepare(network), NumpyBackend().prepare(network), InputReader(network)
    state, controls = initial_state(network), Controls(network)
    with np.errstate(all="ignore"):
        for k in range(STEPS):
            controls.begin(state)
            reader.use(state)
            other = state.copy()
            plain.step(state, reader.at(k))
            fast.step(other, reader.at(k))
            for (name, expected), found in zip(arrays(state).items(), arrays(other).values(), strict=True):
                if exact:
                    assert found.tobytes() == expected.tobytes(), (name, k)
                else:
                    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12, err_msg=f"{name} at {k}")


@settings(max_examples=10, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=flowing_specs(), backend=st.sampled_from(["reference", "numpy"]), cut=st.integers(1, STEPS - 1))
def test_a_run_in_pieces_is_the_whole_one(
    spec: Spec, backend: str, cut: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    in_pieces(compiled(spec), backend, cut, tmp_path_factory.mktemp("pieces") / "state")


def in_pieces(network: Network, backend: str, cut: int, checkpoint: Path) -> None:
    """Stepped, gone on from a checkpoint, gone back: bit for bit what a run makes at once."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        whole = record(network, Course(STEPS, backend=backend, keep=Keep(states=("all",))))
        simulation, other = Simulation(network, backend), Simulation(network, backend)
        for k in range(STEPS):
            if k == cut:
                simulation.save_state(checkpoint)
                other.restore(checkpoint)
            simulation.step()
            np.testing.assert_array_equal(simulation.activity, whole.activity[k])
        kept = simulation.state()
        simulation.restore(other.state())
        for one in (simulation, other):
            for _ in range(cut, STEPS):
                one.step()
            for found, expected in zip(arrays(one.state()).values(), arrays(kept).values(), strict=True):
                np.testing.assert_array_equal(found, expected)


@settings(max_examples=15, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=flowing_specs(), cut=st.integers(0, STEPS - 1))
def test_an_edit_of_nothing_changes_nothing(spec: Spec, cut: int) -> None:
    """What flows, what is sent and what rules read of it go on in the edited network, bit for bit."""
    network = compiled(spec)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        plain, edited = (SimulatedSource(Simulation(network, "numpy")) for _ in range(2))
        for k in range(STEPS):
            if k == cut:
                edited = carried(edited, Simulation(network, "numpy"))
            for one in (plain, edited):
                one.advance()
            seen, expected = edited.seen().snapshot, plain.seen().snapshot
            np.testing.assert_array_equal(seen.activity, expected.activity)
            np.testing.assert_array_equal(seen.weights, expected.weights)


@settings(max_examples=10, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=flowing_specs(), cut=st.integers(1, STEPS - 1))
def test_an_edit_elsewhere_changes_nothing(spec: Spec, cut: int) -> None:
    """Another group, and a connection of it with a state and a longer delay, before all others: what flows at neurons
    and synapses, and what is under way, is found in its new place."""
    network = compiled(spec)
    more: dict[str, dict[str, Plain]] = {
        "synapses": {"aside": {"state": {"aside": {"derivative": "pre - aside"}}, "signal": "aside"}},
        "neurons": {"Aside": {"count": 2}},
        "connections": {"Aside1 -> Aside2": {"synapse": "aside", "delay": 5}},
    }
    before = {section: part for section in more if isinstance(part := spec[section], dict)}
    other = compiled({**spec, **{section: {**own, **before[section]} for section, own in more.items()}})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        plain, edited = (SimulatedSource(Simulation(network, "numpy")) for _ in range(2))
        for k in range(STEPS):
            if k == cut:
                edited = carried(edited, Simulation(other, "numpy"))
            for one in (plain, edited):
                one.advance()
            seen, expected = edited.seen().snapshot, plain.seen().snapshot
            np.testing.assert_array_equal(seen.activity[-len(network.neurons) :], expected.activity)
            np.testing.assert_array_equal(seen.weights[len(seen.weights) - len(expected.weights) :], expected.weights)


LOOP = """
neurovis: 1
name: loop
time: {dt: 0.1}
models:
  m:
    time: ms
    ports: [p]
    let: {y: 2*x + 1}
    state: {x: {initial: 0.1, derivative: 0.001*(drive - x) + 0.0001*p, noise: 0.02}}
    outputs: {OUTPUTS}
    activity: f(x)
neurons:
  A: {model: m, activation: tanh, count: 2, initial: {x: [0.3, -0.2]}}
  B: {model: m, activation: sigmoid, bias: 0.2, noise: "normal(0, 0.1)"}
  C: {model: m, bias: 0.3}
  S: {activation: tanh}
connections:
  - A -> A: {weight: 0.7, pattern: all_to_all}
  - A -> B: {weight: 1, pattern: all_to_all}
  - B -> A: {weight: -1, send: scaled, port: {drive: 0.5, p: 1}, pattern: all_to_all}
  - B -> C: {weight: 1, send: x}
  - C -> B: {weight: 0.5, send: scaled}
  - C -> S: {weight: 1, delay: 0}
events:
  - {from: 5, to: 9, clamp: {B: 0.4}}
  - {from: 10, to: 14, clamp: {A1.x: 0.2}}
  - {at: 12, lesion: C}
  - {at: 16, mend: C}
  - {at: 18, lesion: A -> B}
"""
BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_output_that_reads_a_port_makes_no_circle_of_states_that_drive_each_other(backend: str) -> None:
    """What is sent is known behind the integration: the network is the same as without that output."""
    runs = []
    for outputs in ("scaled: f(y)", "scaled: f(y), current: drive + p"):
        network = nv.compile_text(LOOP.replace("OUTPUTS", outputs)).network
        runs.append(record(network, Course(25, backend=backend, keep=Keep(states=("all",)))))
    plain, made = runs
    np.testing.assert_array_equal(made.activity, plain.activity)
    np.testing.assert_array_equal(made["A1.x"], plain["A1.x"])
    np.testing.assert_allclose(made["C.current"][5], made["B.x"][5] + 0.3, rtol=1e-12)


CHAIN = """
neurovis: 1
name: chain
time: {dt: 0.05}
inputs: {wave: {expression: sin(9*t)}}
models:
  source: {state: {x: {initial: 0.3, derivative: "drive - 0.2*x"}}, activity: x, outputs: {twice: 2*x}}
  through: {state: {z: {initial: 0.1, derivative: "drive - 2*z"}}, activity: f(drive), outputs: {sum: drive + z}}
neurons:
  D: {count: 2, model: through, activation: sigmoid}
  C: {count: 2, activation: tanh, combine: product}
  B: {count: 3, model: through, activation: tanh, input: wave}
  A: {count: 2, model: source}
connections:
  A -> B: {weight: 0.8, pattern: all_to_all, send: twice}
  B -> C: {weight: 1.3, pattern: all_to_all, delay: 0, send: sum}
  C -> D: {weight: 0.5, pattern: one_to_one, delay: 0}
  D -> A: {weight: -0.9, pattern: all_to_all, delay: 0}
  C -> A: {weight: 0.1, pattern: one_to_one, delay: 3}
"""


def test_outputs_that_read_each_other_at_a_stage_are_made_in_order() -> None:
    """A chain of neurons whose outputs read their ports, some without a state, closed by a derivative alone."""
    network = nv.compile_text(CHAIN).network
    assert sorted(population.stage for population in network.populations) == [0, 1, 2, 3]
    runs = [record(network, Course(60, backend=backend)).activity for backend in ("reference", "numpy")]
    np.testing.assert_allclose(runs[1], runs[0], rtol=1e-12, atol=1e-12)
    # of the fourth order, so that all are seen where they are at a stage
    flowing = CHAIN.replace("{weight: 0.1, pattern: one_to_one, delay: 3}", "{weight: 0, pattern: one_to_one}")

    def after_half_a_second(steps: int) -> FloatArray:
        network = nv.compile_text(flowing.replace("0.05", str(0.5 / steps))).network
        return record(network, Course(steps + 1, backend="numpy")).activity[-1:]

    coarse, fine, finest = map(after_half_a_second, (40, 80, 640))
    assert 13 < np.abs(coarse - finest).max() / np.abs(fine - finest).max() < 20


DENSE = """
neurovis: 1
name: dense
time: {dt: 0.05, integrate: heun}
models:
  m: {state: {v: {initial: 0.3, derivative: drive - v}}, activity: f(v), outputs: {far: "v + GROWTH"}, send: far}
neurons: {A: {count: 70, model: m, bias: 0.01*i}, B: {count: 65, model: m, activation: sin}}
connections:
  A -> A: {weight: (1.1 + sin(i + j*j))/99, pattern: all_to_all, PLASTIC}
  A -> B: {weight: "uniform(0, 0.1)", pattern: all_to_all}
  B -> A: {weight: 0.1, pattern: {band: {width: 60}}, PLASTIC}
"""


@pytest.mark.parametrize("plastic", ["send: far", "plasticity: {oja: {rate: 0.01}}"])
@pytest.mark.parametrize("growth", ["0", "1e300*1e300 if t > 0.19 and t < 0.21 else 0"])
def test_a_full_matrix_adds_up_in_the_same_order(plastic: str, growth: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a product of a matrix as one by one, bit for bit, an infinite activity included."""
    network = nv.compile_text(DENSE.replace("PLASTIC", plastic).replace("GROWTH", growth)).network
    runs = []
    for least in (numpy_flows._DENSE, 1 << 62):
        monkeypatch.setattr(numpy_flows, "_DENSE", least)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            runs.append(record(network, Course(9, backend="numpy", keep=Keep(states=("all",)))))
    assert runs[0].states.tobytes() == runs[1].states.tobytes()
    assert runs[0].weights.tobytes() == runs[1].weights.tobytes()
    assert np.isinf(runs[0].states).any() == ("300" in growth)


@pytest.mark.parametrize("targets", [1, 2])
def test_what_few_neurons_get_of_many_adds_up_in_the_same_order(targets: int, monkeypatch: pytest.MonkeyPatch) -> None:
    text = f"""
neurovis: 1
name: few
time: {{dt: 0.1}}
models:
  m: {{state: {{v: {{derivative: -v}}}}, activity: v}}
  o: {{state: {{v: {{derivative: drive - v}}}}, activity: v}}
neurons: {{A: {{count: 400, model: m, initial: {{v: sin(i)}}}}, B: {{count: {targets}, model: o}}}}
connections: {{A -> B: {{weight: "normal(0, 1)", pattern: all_to_all}}}}
"""
    network, runs = nv.compile_text(text).network, []
    for least in (400, 1 << 62):
        monkeypatch.setattr(numpy_flows, "_DENSE", least)
        runs.append(record(network, Course(5, backend="numpy")).activity.tobytes())
    assert runs[0] == runs[1]


def test_a_matrix_that_only_noise_reads_has_the_weights_of_the_step() -> None:
    network = nv.compile_text("""
neurovis: 1
name: noisy
time: {dt: 0.05, integrate: euler}
models: {m: {ports: [p], state: {v: {initial: 0.3, derivative: -v, noise: p}}, activity: v}}
neurons: {A: {count: 65, model: m}}
connections: {A -> A: {weight: 0.1, pattern: all_to_all, port: p, plasticity: oja}}
""").network
    runs = [record(network, Course(4, backend=backend)).activity for backend in ("reference", "numpy")]
    assert np.ptp(runs[0][-1]) > 0
    np.testing.assert_allclose(runs[1], runs[0], rtol=1e-12)


@pytest.mark.parametrize("integrate", ["euler", "heun", "rk4", "{method: euler, substeps: 3}", "exponential"])
def test_noise_times_the_state_itself_is_that_of_the_beginning_of_the_step(integrate: str) -> None:
    network = nv.compile_text(f"""
neurovis: 1
name: noisy
time: {{dt: 0.1, integrate: {integrate}}}
models: {{m: {{state: {{v: {{initial: 0.3, derivative: -3*v + t, noise: v}}}}, activity: v}}}}
neurons: {{A: {{count: 3, model: m}}}}
""").network
    runs = [record(network, Course(6, backend=backend)).activity for backend in ("reference", "numpy")]
    assert np.ptp(runs[0][-1]) > 0
    np.testing.assert_allclose(runs[1], runs[0], rtol=1e-12)


def test_states_that_are_stepped_in_turn_leave_nothing_for_each_other() -> None:
    """Steps of two states in turn, with a matrix of other weights, are those of each alone."""
    spec = """neurovis: 1
name: x
time: {dt: 0.1}
models: {m: {state: {v: {derivative: f(drive) - v}}, activity: v}}
neurons: {A: {count: 70, model: m, activation: tanh, bias: 0.01*i}}
connections: {A -> A: {pattern: {random: {probability: 0.9}}, weight: 0.01*(i - j)}}
"""
    network = nv.compile_text(spec).network
    stepper, inputs = NumpyBackend().prepare(network), np.zeros(network.vector_size)
    one, other = initial_state(network), initial_state(network)
    other.weights *= -0.5
    alone = [one.copy(), other.copy()]
    for state in alone:
        fresh = NumpyBackend().prepare(network)
        for _ in range(5):
            fresh.step(state, inputs)
    for _ in range(5):
        stepper.step(one, inputs)
        stepper.step(other, inputs)
    assert [one.activity.tobytes(), other.activity.tobytes()] == [state.activity.tobytes() for state in alone]
