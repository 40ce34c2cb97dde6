"""Inputs, the step-by-step simulation, running and recording, going on from a recording."""

from __future__ import annotations

import math
import pickle
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, cast

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from networks_by_hand import TANH, Learns, Link, Unit, build, cpg_rbf, rule, tree

import neurovis_spec as nv
from neurovis_spec.compiler.network import Input, Network, Output
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.inputs import InputError, InputReader
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.rows import STRETCH
from neurovis_spec.runtime.simulation import ParameterError, Simulation
from neurovis_spec.runtime.state import initial_state
from neurovis_spec.runtime.watch import Watch

BOTH = ("reference", "numpy")


def three_inputs() -> Network:
    inputs = [
        Input("wave", 0, 1, tree("gain * k + t + dt")),
        Input("rows", 1, 2, table=np.array([[1.0, 2.0], [3.0, 4.0]])),
        Input("torque", 3, 3),
    ]
    units = [Unit(f"N{i}", input=i) for i in range(6)]
    outputs = [Output("first", np.array([0]), True), Output("rest", np.array([3, 4, 5]), False)]
    return build(units, inputs=inputs, outputs=outputs, dt=0.5, parameters={"gain": 10.0})


# ---- inputs ------------------------------------------------------------------------------------------------------


def test_inputs_come_from_expressions_tables_and_else_are_0() -> None:
    reader = InputReader(three_inputs())
    assert reader.at(0).tolist() == [0.5, 1, 2, 0, 0, 0]
    assert reader.at(2).tolist() == [21.5, 3, 4, 0, 0, 0]
    assert reader.at(5 * STRETCH + 3)[1:3].tolist() == [3, 4]
    assert reader.at(1)[0] == 11.0  # back again


def test_a_supplied_value_holds_for_its_step_only() -> None:
    reader = InputReader(three_inputs())
    assert reader.at(1, {"torque": [1, 2, 3], "wave": -1}).tolist() == [-1, 3, 4, 1, 2, 3]
    assert reader.at(1).tolist() == [11, 3, 4, 0, 0, 0]


def test_supplied_arrays_replace_sources_and_their_last_row_stays() -> None:
    torque = np.arange(6.0).reshape(2, 3)
    reader = InputReader(three_inputs(), {"torque": torque, "wave": [7, 8, 9], "rows": [5, 6]})
    assert [reader.at(k).tolist() for k in (0, 1, 2, 3)] == [
        [7, 5, 6, 0, 1, 2],
        [8, 5, 6, 3, 4, 5],
        [9, 5, 6, 3, 4, 5],
        [9, 5, 6, 3, 4, 5],
    ]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"torqe": 1}, "no input 'torqe'; did you mean 'torque'"),
        ({"torque": 1}, "takes 3 numbers a step, not shape"),
        ({"torque": [1, 2]}, "takes 3 numbers"),
        ({"wave": [1, 2]}, "takes one number"),
        ({"wave": math.nan}, "NaN or infinity"),
        ({"torque": [0, math.inf, 0]}, "NaN or infinity"),
        ({"wave": "0.3"}, "not an array of numbers"),
        ({"wave": None}, "not an array of numbers"),
        ({"torque": [[1], [2, 3]]}, "not an array of numbers"),
        ({"wave": 1j}, "not an array of numbers"),
    ],
)
def test_wrong_values_are_refused_and_no_step_is_made(values: Mapping[str, object], words: str) -> None:
    simulation = Simulation(three_inputs())
    with pytest.raises(InputError, match=words):
        simulation.step(cast("Mapping[str, npt.ArrayLike]", values))
    assert simulation.k == 0


@pytest.mark.parametrize("value", [np.zeros((4, 2)), np.zeros((0, 3)), np.zeros((1, 3, 1)), [[0, 0, math.nan]], 3.0])
def test_wrong_arrays_are_refused(value: object) -> None:
    with pytest.raises(InputError, match="torque"):
        record(three_inputs(), Course(3, inputs={"torque": cast("npt.ArrayLike", value)}))


# ---- step by step ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("backend", BOTH)
def test_stepping_is_running_bit_for_bit(backend: str) -> None:
    network = cpg_rbf()
    steps = 40 if backend == "reference" else 2 * STRETCH + 5
    recording = record(network, Course(steps, backend=backend))
    simulation = Simulation(network, backend)
    for k in range(steps):
        assert simulation.weights.tolist() == recording.weights[k].tolist()
        outputs = simulation.step()
        assert simulation.k == k + 1
        assert simulation.activity.tolist() == recording.activity[k].tolist()
        assert outputs["signal"] == recording["O"][k]
        assert np.array_equal(outputs["kernels"], recording["K"][k])


def test_before_the_first_step_there_is_no_activity() -> None:
    simulation = Simulation(cpg_rbf())
    assert np.isnan(simulation.activity).all()
    assert simulation.activity.shape == (12,)
    assert simulation.weights.tolist() == [0.0] * 8


def test_outputs_are_numbers_and_arrays_and_stay_what_they_were() -> None:
    simulation = Simulation(three_inputs())
    first = simulation.step(torque=[1, 2, 3])
    simulation.step(torque=[4, 5, 6])
    assert isinstance(first["first"], np.float64)
    assert first["first"] == 0.5
    assert np.asarray(first["rest"]).tolist() == [1, 2, 3]
    assert Simulation(build([Unit("A")])).step() == {}


def test_weights_by_name() -> None:
    simulation = Simulation(cpg_rbf())
    for _ in range(5):
        simulation.step()
    assert simulation.weight("C1 -> K1") == 1.0
    assert simulation.weight("K3 -> O") == simulation.weights[2] != 0
    with pytest.raises(KeyError, match="did you mean 'K1 -> O'"):
        simulation.weight("K1 -> 0")


def test_states_are_kept_and_gone_back_to() -> None:
    simulation = Simulation(cpg_rbf())
    for _ in range(7):
        simulation.step()
    kept = simulation.state()
    first = [simulation.step()["signal"] for _ in range(5)]
    simulation.restore(kept)
    assert simulation.k == 7
    assert [simulation.step()["signal"] for _ in range(5)] == first
    simulation.reset()
    assert simulation.k == 0
    assert np.isnan(simulation.activity).all()
    assert simulation.weights.tolist() == [0.0] * 8


# ---- parameters --------------------------------------------------------------------------------------------------


ADJUSTABLE = """
neurovis: 1
name: x
parameters: {gain: 2, offset: 1, rate: 1, size: 1}
inputs: {drive: {expression: offset}}
rules: {growing: {parameters: {rate: 1}, weight: {each_step: weight + rate}}}
neurons: {A: {input: drive}, B: {model: {leaky_integrator: {leak: 0.5}}}, D: {}, S: {count: size}}
connections:
  A -> B: gain
  A -> D: {weight: 0.25, plasticity: {growing: {rate: rate}}}
"""


def adjustable(backend: str | None = None) -> Simulation:
    """A -> B by ``gain``, A -> D learned, B leaks, A reads ``offset`` · 1."""
    return nv.compile_text(ADJUSTABLE).simulator(backend)


@pytest.mark.parametrize("backend", BOTH)
def test_set_changes_parameters_and_keeps_what_was_learned(backend: str) -> None:
    simulation = adjustable(backend)
    for _ in range(3):
        simulation.step()
    # A = 1; B: 0, 1, 1.5; the weight of A -> D: 3.25
    assert simulation.activity[:3].tolist() == [1, 1.5, 2.25 - 1]
    simulation.set(gain=10.0, rate=0.5)
    assert simulation.weight("A -> B") == 10.0
    assert simulation.weights.tolist() == [3.25]
    simulation.step()  # the signals under way were formed before: 2 and 2.25
    assert simulation.activity[:3].tolist() == [1, 1.75, 2.25]
    assert simulation.weights.tolist() == [3.75]
    simulation.set({"offset": 3.0})
    simulation.step()
    assert simulation.activity[:3].tolist() == [3, 0.5 * 1.75 + 0.5 * 10, 3.25]
    simulation.reset()
    assert simulation.weight("A -> B") == 2.0
    assert simulation.parameters["offset"] == 1.0


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"gian": 1.0}, "no parameter 'gian'; did you mean 'gain'"),
        ({"size": 2.0}, "cannot be set in a run"),
        ({"gain": math.nan}, "finite number"),
        ({"gain": "1"}, "finite number"),
    ],
)
def test_parameters_that_cannot_be_set(values: Mapping[str, float], words: str) -> None:
    simulation = adjustable()
    with pytest.raises(ParameterError, match=words):
        simulation.set({"offset": 5.0, **values})
    simulation.step()
    assert simulation.activity[0] == 1.0


# ---- what is not finite ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("backend", BOTH)
def test_one_warning_names_the_neuron_and_the_step(backend: str) -> None:
    network = build([Unit("Calm"), Unit("Wild", bias=1.0)], [Link(1, 1, 1e200)])
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        recording = record(network, Course(10, backend=backend))
        simulation = Simulation(network, backend)
        for _ in range(2):
            simulation.step()
        assert len(caught) == 1
        for _ in range(8):
            simulation.step()
    assert [(w.category, str(w.message)) for w in caught] == [
        (RuntimeWarning, "the activity of Wild is inf at step 2, in 'by_hand'")
    ] * 2
    assert np.isinf(recording["Wild"][2:]).all()
    assert recording["Wild"][1] == 1e200


@pytest.mark.parametrize("backend", BOTH)
def test_one_warning_names_the_connection(backend: str) -> None:
    bad = Learns(rule("1 / (2 - k)"))
    network = build([Unit("A"), Unit("B")], [Link(0, 1, 1.0, learns=0)], [bad])
    with pytest.warns(RuntimeWarning, match="the weight of A -> B is inf after step 2") as caught:
        record(network, Course(10, backend=backend))
    assert len(caught) == 1


@pytest.mark.parametrize("place", [0, 9_000, 19_999])
def test_a_neuron_among_many_is_warned_of(place: int) -> None:
    network = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {count: 20000}}").network
    state = initial_state(network)
    state.activity[place] = np.inf
    with pytest.warns(RuntimeWarning, match=f"the activity of A{place + 1} is inf"):
        Watch(network).check(state)


class Multiplied(np.ndarray[tuple[int], np.dtype[np.float64]]):
    """Numbers that say how many of them are multiplied at a time."""

    sizes: ClassVar[list[int]] = []

    def dot(self, *given: object, **more: object) -> object:  # type: ignore[override]
        self.sizes.append(len(self))
        return np.asarray(self).dot(np.asarray(given[0]))


def test_no_product_is_so_large_that_threads_share_it() -> None:
    """OpenBLAS does from 10,001 numbers on, and then waits for them where the processors are busy."""
    network = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {count: 50000}}").network
    state = initial_state(network)
    state.activity = state.activity.view(Multiplied)
    Watch(network).check(state)
    assert sum(Multiplied.sizes) == 50_000
    assert max(Multiplied.sizes) <= 10_000


HIDDEN = [
    (
        "inputs: {s: {expression: 1/(k - 5)}}\nneurons: {A: {}, B: {input: s, activation: tanh}}",
        "the input 's' of B is inf at step 5",
    ),
    (
        "inputs: {s: {expression: 1/(k - 300)}}\nneurons: {B: {bias: 1}}",
        "the input 's' is inf at step 300",
    ),
    (
        "activations: {above: {value: 1 if x > 0 else 0}}\n"
        "neurons: {A: {noise: 'normal(0, 3 - k)', activation: above}}",
        "the noise of A is nan at step 4",
    ),
    (
        "models: {wild: {state: {v: {initial: 1e300, each_step: v*1e3}}, activity: tanh(v)}}\n"
        "neurons: {A: {bias: 1}, B: {count: 2, model: wild}}",
        "the state 'v' of B1 is inf at step 2",
    ),
    (
        "rules: {wild: {state: {m: {initial: 1e300, each_step: m*1e3}}, weight: {each_step: weight + pre/m}}}\n"
        "neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: {weight: 1, plasticity: wild}}",
        "the state 'm' of A -> B is inf after step 2",
    ),
]


@pytest.mark.parametrize("backend", BOTH)
@pytest.mark.parametrize(("text", "message"), HIDDEN, ids=[message for _, message in HIDDEN])
def test_what_no_activity_shows_is_warned_of_once(text: str, message: str, backend: str) -> None:
    network = nv.compile_text(f"neurovis: 1\nname: x\n{text}\n")
    with pytest.warns(RuntimeWarning) as caught:
        recording = network.run(600, backend=backend)
    assert [str(item.message) for item in caught] == [f"{message}, in 'x'"]
    assert np.isfinite(recording.activity).all()


@pytest.mark.parametrize("backend", BOTH)
def test_what_is_not_finite_behind_the_end_of_a_run_is_no_reason_to_warn(backend: str) -> None:
    text = "neurovis: 1\nname: x\ninputs: {s: {expression: 1/(k - 5)}}\nneurons: {B: {input: s, activation: tanh}}\n"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        nv.compile_text(text).run(5, backend=backend)


@pytest.mark.parametrize("backend", BOTH)
def test_large_but_finite_is_no_reason_to_warn(backend: str) -> None:
    network = build([Unit("A", bias=1e300), Unit("B", bias=-1e300)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        record(network, Course(5, backend=backend))


# ---- recording ---------------------------------------------------------------------------------------------------


def test_a_recording_holds_what_the_contract_says() -> None:
    recording = record(cpg_rbf(), Course(300))
    assert recording.activity.shape == (300, 12)
    assert recording.weights.shape == (300, 8)
    assert recording.weights[0].tolist() == [0.0] * 8
    assert recording.plastic.tolist() == list(range(20, 28))
    assert recording.weights_static.tolist() == cpg_rbf().connections.weights[:20].tolist()
    assert recording["C1"][0] == 0.1
    assert recording["K"].shape == (300, 8)
    assert np.array_equal(recording["signal"], recording["O"])
    assert recording["O"].shape == (300,)
    assert np.array_equal(recording.weight("K2 -> O"), recording.weights[:, 1])
    assert np.array_equal(recording.weight("C1 -> K1"), np.ones(300))
    assert recording.weight("C1 -> C2").tolist() == [-1.0094 * math.sin(0.049)] * 300
    assert recording.step.tolist() == list(range(300))
    with pytest.raises(ValueError, match="read-only"):
        recording.activity[0, 0] = 1.0


def test_names_that_a_recording_does_not_know() -> None:
    recording = record(cpg_rbf(), Course(3))
    with pytest.raises(KeyError, match="no neuron, group or output 'K9'; did you mean"):
        recording["K9"]
    with pytest.raises(KeyError, match="no connection 'K1->O'; did you mean 'K1 -> O'"):
        recording.weight("K1->O")
    with pytest.raises(RecordingError, match="step 3 is not in the recording"):
        recording.snapshot(3)


def test_snapshots_hold_all_weights_and_those_before() -> None:
    recording = record(cpg_rbf(), Course(20))
    now, first = recording.snapshot(7), recording.snapshot(0)
    assert first.previous_weights is None
    assert now.previous_weights is not None
    assert np.array_equal(now.activity, recording.activity[7])
    assert np.array_equal(now.weights[20:], recording.weights[7])
    assert np.array_equal(now.previous_weights[20:], recording.weights[6])
    assert now.weights[4:20].tolist() == [1.0] * 16


@given(st.integers(0, 30), st.integers(1, 12))
@settings(max_examples=25, deadline=None)
def test_every_kth_step_is_recorded(steps: int, every: int) -> None:
    whole, some = record(cpg_rbf(), Course(steps)), record(cpg_rbf(), Course(steps, every=every))
    assert some.step.tolist() == list(range(0, steps, every))
    assert np.array_equal(some.activity, whole.activity[::every])
    assert np.array_equal(some.weights, whole.weights[::every])
    if steps > every > 1:
        assert some.snapshot(every).previous_weights is None


def test_progress_is_told_and_reaches_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("neurovis_spec.runtime.record.monotonic", lambda: 0.0)  # blocks are not cut short
    told: list[tuple[int, int]] = []
    record(cpg_rbf(), Course(600, backend="reference"), lambda done, total: told.append((done, total)))
    assert told == [(256, 600), (512, 600), (600, 600)]


def test_the_default_length_is_the_networks_and_nonsense_is_refused() -> None:
    assert len(record(replace(cpg_rbf(), steps=17))) == 17
    with pytest.raises(ValueError, match="at least"):
        record(cpg_rbf(), Course(-1))
    with pytest.raises(ValueError, match="at least"):
        record(cpg_rbf(), Course(1, every=0))


# ---- going on ----------------------------------------------------------------------------------------------------


@given(st.integers(0, 2**32), st.integers(1, 12))
@settings(max_examples=30, deadline=None)
def test_a_run_goes_on_as_if_it_had_not_been_cut(seed: int, cut: int) -> None:
    """Exactly so where nothing but activities and signals is carried, however long the delays."""
    random = np.random.default_rng(seed)
    units = [Unit(f"N{i}", TANH, bias=0.1 * i, initial=0.3 if i == 0 else math.nan) for i in range(4)]
    delays, weights = random.integers(1, 6, 16).tolist(), random.normal(size=16).tolist()
    network = build(units, [Link(i // 4, i % 4, weights[i], delays[i]) for i in range(16)])
    whole, part = record(network, Course(cut + 10)), record(network, Course(cut))
    rest = record(network, Course(10, start=part))
    assert rest.step[0] == 0
    assert np.array_equal(rest.activity, whole.activity[cut:])


def test_what_was_learned_is_kept() -> None:
    network = cpg_rbf()
    before = record(network, Course(500))
    after = record(network, Course(5, start=before))
    assert np.array_equal(after.weights[0], before.weights_after)
    assert not np.array_equal(after.weights[0], before.weights[-1])
    rhythm = before["C"][-1]
    matrix = network.connections.weights[:4].reshape(2, 2)
    np.testing.assert_allclose(after["C"][0], np.tanh(rhythm @ matrix), rtol=0, atol=1e-15)
    frozen = record(cpg_rbf(learns=False), Course(5, start=before))
    assert np.array_equal(frozen.weights_static[20:], before.weights_after)
    assert len(frozen.plastic) == 0
    assert np.array_equal(Simulation(network, start=before).weights, before.weights_after)


def test_pre_goes_on_as_well() -> None:
    ramp = [Input("ramp", 0, 1, tree("k + 1"))]
    network = build([Unit("S", input=0), Unit("A")], [Link(0, 1, 0.0, 3, learns=0)], [Learns(rule("pre"))], ramp)
    rest = record(network, Course(5, start=record(network, Course(10))))
    # w[10] = a[6] is the weight after the last step; then a[7], a[8], a[9] arrive, and a[0] of the new run
    assert rest.weight("S -> A").tolist() == [7, 8, 9, 10, 1]


def test_recordings_of_another_network_are_refused() -> None:
    network = cpg_rbf()
    other = build([Unit("A")])
    with pytest.raises(RecordingError, match="has no neuron 'C1'"):
        record(network, Course(1, start=record(other, Course(2))))
    with pytest.raises(RecordingError, match="'by_hand' has no neuron 'C1'"):
        record(build([]), Course(1, start=record(network, Course(2))))
    with pytest.raises(RecordingError, match="no step to go on from"):
        record(network, Course(1, start=record(network, Course(0))))
    links = build([], [Link(0, 0)]).connections
    fewer = replace(network, connections=links, projections=(), populations=(), program=())
    with pytest.raises(RecordingError, match="has no connection 'K1 -> O'"):
        record(fewer, Course(1, start=record(network, Course(2))))


@pytest.mark.parametrize("backend", BOTH)
def test_a_pickled_simulation_goes_on_where_it_was(backend: str) -> None:
    network = cpg_rbf()
    simulation = Simulation(network, backend)
    for _ in range(7):
        simulation.step()
    simulation.lesion("K3")
    copy = pickle.loads(pickle.dumps(simulation))
    assert isinstance(copy, Simulation)
    for _ in range(9):
        copy.step()
        simulation.step()
        np.testing.assert_array_equal(copy.activity, simulation.activity)
    np.testing.assert_array_equal(copy.weights, simulation.weights)
    assert copy.k == simulation.k == 16
    copy.reset()
    assert copy.k == 0
    assert not copy.lesioned[0].any()


def test_what_a_run_and_a_layout_are_fits_on_a_line() -> None:
    compiled = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {count: 3, bias: 1}}")
    shown = repr(compiled.run(5)), repr(compiled.layout())
    assert shown == (
        "<recording of x: 5 steps of 3 neurons, 0 changing weights>",
        "<layout of x by layered: 3 positions, 0 routes>",
    )


def test_a_picture_into_no_folder_names_the_folder(tmp_path: Path) -> None:
    compiled = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {bias: 1}}")
    with pytest.raises(FileNotFoundError, match=r"there is no folder: .*nowhere"):
        compiled.render(tmp_path / "nowhere" / "x.svg")


@pytest.mark.parametrize("backend", BOTH)
def test_a_rule_of_no_connections_runs(backend: str) -> None:
    text = (
        "neurovis: 1\nname: x\nneurons: {A: {count: 2, bias: 1}}\n"
        "connections: {A -> A: {pattern: {random: {probability: 0.0001}}, plasticity: hebbian}}"
    )
    assert nv.compile_text(text).run(3, backend=backend)["A"].tolist() == [[1.0, 1.0]] * 3


@pytest.mark.parametrize("suffix", ["", ".npz", ".mcap"])
def test_what_steps_record_is_what_a_run_records(suffix: str, tmp_path: Path) -> None:
    """Also where events of the step to come have changed something: that is not true after the last step."""
    compiled = nv.compile_text(
        "neurovis: 1\nname: told\nneurons: {A: {count: 3, bias: 0.1}}\nparameters: {gain: 1}\ntime: {steps: 9}\n"
        "connections: {A1 -> A2: gain, A2 -> A3: 0.5}\n"
        "events: [{at: 5, set: {gain: 3}}, {at: 5, lesion: A3}]\n"
    )
    place = tmp_path / f"stepped{suffix}" if suffix else True
    with compiled.simulator(record=place) as simulation:
        for _ in range(5):
            simulation.step()
    made, run = simulation.recording, compiled.run(5)
    assert dict(made.set_parameters) == dict(run.set_parameters) == {}
    for name in ("activity", "weights_after", "weights_static", "lesioned_neurons", "lesioned_connections"):
        assert getattr(made, name).tolist() == getattr(run, name).tolist(), name
    if suffix == "":
        simulation.set(gain=2)  # by hand, after the events: what the next step begins with
        assert dict(simulation.recording.set_parameters) == {"gain": 2.0}
        assert simulation.recording.lesioned_neurons.tolist() == [2]
