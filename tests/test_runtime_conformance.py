"""What every backend promises: each step as the reference makes it, and every event and call of a run alike.

The C backend computes with the C library that Python itself calls, so that it gives the same bits.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from networks_by_hand import TANH, Learns, Link, Unit, build, cpg_rbf, model, rule
from random_specs import specs
from test_runtime_backends import networks, parts

import neurovis_spec as nv
from neurovis_spec.compiler.network import Input, Network
from neurovis_spec.runtime import c_backend, c_library
from neurovis_spec.runtime.backend import Backend, Stepper, load
from neurovis_spec.runtime.c_backend import CBackend, written
from neurovis_spec.runtime.c_code import Tables
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.reference import ReferenceBackend
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.state import State, initial_state

SPECS = sorted(
    path for path in (Path(__file__).parent.parent / "specs").rglob("*.yaml") if "\nname:" in path.read_text("utf-8")
)
OTHERS = ["numpy", pytest.param("c", marks=pytest.mark.compiler)]
#: a program in which something of everything happens
EVENTS = """
neurovis: 1
name: events
time: {dt: 0.1, episode: 7}
seed: 3
parameters: {gain: 0.4, leak: 0.2, rate: 0.02, level: 0.3, offset: 0.1}
inputs: {wave: {expression: "level*sin(k/3)"}, teacher: {expression: "0.2*cos(k/5)"}}
neurons:
  S: {count: 4, input: wave, initial: 0.2, bias: offset, activation: tanh}
  L: {count: 4, model: {leaky_integrator: {leak: leak}}, activation: tanh, noise: "normal(0, 0.05)"}
  P: {count: 2, combine: product}
  D: {combine: distance, activation: {gaussian: {sigma: 0.7}}}
  O: {}
connections:
  S -> L: {weight: "gain*(1 + i - j)/4", pattern: all_to_all}
  L -> S: {weight: 0.3, delay: 3, pattern: one_to_one}
  S -> P: {weight: 1.1, pattern: all_to_all, delay: 2}
  L -> D: {weight: gain, centre: offset}
  L -> O: {weight: 0.1, plasticity: {delta: {rate: rate, target: teacher}}, delay: 2}
  P -> O: {weight: 0.2, plasticity: {oja: {rate: rate}}, bounds: [-0.5, 0.5]}
events:
  - {at: 4, set: {gain: 0.7, leak: 0.3}}
  - {from: 6, to: 15, clamp: {S2: level}}
  - {at: 9, lesion: [L3, S1 -> P1]}
  - {at: 11, learning: {L -> O: false}}
  - {at: 14, set: {rate: 0.05, level: 0.5, offset: -0.2}}
  - {at: 20, mend: [L3, S1 -> P1]}
  - {at: 22, learning: {L -> O: true}}
outputs: {out: O}
"""


def agree(state: State, other: State, exact: bool) -> None:
    """Both hold the same: bit for bit, or within 1e-12."""
    assert state.k == other.k
    for expected, found in zip(parts(state), parts(other), strict=True):
        if exact:
            np.testing.assert_array_equal(found, expected)
            assert np.array_equal(np.signbit(found), np.signbit(expected)) or np.isnan(expected).any()
        else:
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def follow(network: Network, backend: Backend, steps: int = 24) -> None:
    """Each step is begun in the reference's state."""
    plain, fast, reader = ReferenceBackend().prepare(network), backend.prepare(network), InputReader(network)
    state = initial_state(network)
    with np.errstate(all="ignore"):
        for k in range(steps):
            other = state.copy()
            plain.step(state, reader.at(k))
            fast.step(other, reader.at(k))
            agree(state, other, backend.capabilities.exactness == "bits")


@pytest.mark.compiler
@pytest.mark.parametrize("size", [0, 600], ids=["loops", "written out"])
@settings(max_examples=25, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(network=networks())
def test_each_step_in_c_is_the_reference_bit_for_bit(network: Network, size: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(c_backend, "SMALL", size)
        follow(network, CBackend())


@pytest.mark.parametrize("backend", OTHERS)
@settings(max_examples=12, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=specs())
def test_each_step_of_a_random_spec_agrees(spec: dict[str, object], backend: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        follow(nv.compile(spec).network, load(backend), 12)


@pytest.mark.compiler
@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.stem)
def test_the_examples_run_alike_in_c(path: Path) -> None:
    network = nv.compile(path).network
    runs = [record(network, Course(60, backend=name)) for name in ("reference", "c")]
    assert runs[0].activity.tobytes() == runs[1].activity.tobytes()
    assert runs[0].weights.tobytes() == runs[1].weights.tobytes()


@pytest.mark.compiler
@pytest.mark.parametrize("every", [1, 4])
def test_events_apply_alike_in_whole_runs(every: int) -> None:
    network = nv.compile_text(EVENTS).network
    runs = [record(network, Course(30, backend=name, every=every)) for name in ("reference", "c")]
    assert runs[0].activity.tobytes() == runs[1].activity.tobytes()
    assert runs[0].weights.tobytes() == runs[1].weights.tobytes()


@pytest.mark.parametrize("backend", OTHERS)
def test_every_call_of_a_run_does_alike(backend: str) -> None:
    """Setting, clamping, lesioning, stopping rules, going back: after each, both are where the other is."""
    network = nv.compile_text(EVENTS).network
    plain, fast = Simulation(network, "reference"), Simulation(network, backend)

    def both(steps: int) -> None:
        for _ in range(steps):
            plain.step(wave=0.3)
            fast.step(wave=0.3)
            agree(plain.state(), fast.state(), load(backend).capabilities.exactness == "bits")

    both(5)
    for simulation in (plain, fast):
        simulation.set(gain=-0.2, rate=0.5)
    both(2)
    kept = plain.state(), fast.state()
    for simulation in (plain, fast):
        simulation.clamp("L1..L2 + O", 0.25)
    both(3)
    for simulation in (plain, fast):
        simulation.release("L1")
        simulation.lesion("P2")
        simulation.lesion("L -> D")
        simulation.learning("P -> O", False)
    both(6)
    for simulation in (plain, fast):
        simulation.mend("P2")
        simulation.learning("P -> O", True)
    both(9)
    plain.restore(kept[1])
    fast.restore(kept[0])
    both(9)
    for simulation in (plain, fast):
        simulation.reset()
    both(3)


@pytest.mark.compiler
@pytest.mark.parametrize("delay", [0, 1, 3])
@pytest.mark.parametrize("by_target", [False, True])
def test_full_matrices_and_many_connections_add_up_in_order(delay: int, by_target: bool) -> None:
    """Each way in which the sums of a large network are written."""
    random = np.random.default_rng(1)
    units = [Unit(f"S{i}", TANH, bias=float(b)) for i, b in enumerate(random.normal(size=20))]
    units += [Unit(f"T{i}", TANH) for i in range(30)]
    ends = [(s, t) for s in range(20) for t in range(20, 50)]
    if by_target:
        ends.sort(key=lambda pair: pair[1])
    links = [Link(s, t, float(random.normal()), delay) for s, t in ends]
    follow(build(units, links), CBackend(), 6)
    follow(build(units, links[:-3]), CBackend(), 6)


@pytest.mark.compiler
@pytest.mark.parametrize("delay", [0, 3])
def test_neurons_of_a_full_matrix_may_take_different_things_of_a_source(delay: int) -> None:
    matrix = "\n".join(
        f"  - {source} -> {targets}: {{weight: 0.3*j - 0.2, delay: {delay}, pattern: all_to_all{sent}}}"
        for source in ("S1", "S2")
        for targets, sent in (("T1..T150", ", send: v"), ("T151..T300", ""))
    )
    network = nv.compile_text(
        "neurovis: 1\nname: x\n"
        "models: {two: {state: {v: {each_step: 0.5*v + drive}}, activity: v + 0.1}}\n"
        f"neurons: {{S: {{count: 2, model: two, bias: 0.1*i}}, T: {{count: 300}}}}\nconnections:\n{matrix}\n"
    )
    runs = [network.run(6, backend=name).activity for name in ("c", "reference")]
    assert (runs[0] == runs[1]).all()


@pytest.mark.compiler
@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_what_is_not_finite_is_told_at_its_step(backend: str) -> None:
    growing = model("f(v)", {"v": ("1", "v^2 * 10 + 1e300 * (v > 1e9)", None)})
    network = build([Unit("A", model=growing), Unit("B", input=0)], inputs=[Input("s", 0, 1)])
    with pytest.warns(RuntimeWarning, match=r"A is inf at step 5") as first:
        record(network, Course(600, backend="reference"))
    with pytest.warns(RuntimeWarning) as second:
        record(network, Course(600, backend=backend))
    assert [str(w.message) for w in second] == [str(w.message) for w in first]


@pytest.mark.compiler
@pytest.mark.parametrize("size", [0, 600])
def test_setting_clamping_and_lesioning_compile_nothing(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(c_backend, "SMALL", size)
    network = nv.compile_text(EVENTS).network
    simulation = Simulation(network, "c")
    monkeypatch.setattr(c_library, "load", lambda text: pytest.fail("something was compiled"))
    simulation.set(gain=0.9)
    simulation.clamp("S1", 1)
    simulation.lesion("L2")
    simulation.learning("L -> O", False)
    simulation.step()
    assert simulation.activity[0] == 1


@pytest.mark.compiler
def test_one_state_goes_from_backend_to_backend() -> None:
    network = cpg_rbf()
    steppers: list[Stepper] = [
        ReferenceBackend().prepare(network),
        CBackend().prepare(network),
        NumpyBackend().prepare(network),
    ]
    reader, state, plain = InputReader(network), initial_state(network), initial_state(network)
    for k in range(30):
        steppers[k % 3].step(state, reader.at(k))
        steppers[0].step(plain, reader.at(k))
        state = state.copy() if k % 4 == 0 else state
    for expected, found in zip(parts(plain), parts(state), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    assert math.isfinite(float(state.activity.sum()))


LANES = """
neurovis: 1
name: lanes
seed: 5
neurons:
  S: {count: 9, bias: "0.1*i", activation: tanh, noise: "normal(0, 0.2)"}
  T: {count: 21, combine: COMBINE, activation: tanh}
connections:
  S -> T: {weight: "uniform(-2, 2)", pattern: {random: {probability: 0.6}}, delay: DELAY, PLASTIC}
  T -> S: {weight: "normal(0, 0.4)", pattern: {random: {probability: 0.9}}}
"""


@pytest.mark.compiler
@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("combine", ["sum", "product", "distance"])
@pytest.mark.parametrize("delay", [0, 1, 2])
@pytest.mark.parametrize("learns", [False, True])
def test_neurons_with_different_numbers_of_connections_go_on_beside_each_other(
    combine: str, delay: int, learns: bool
) -> None:
    """Groups of eight neurons and a rest, groups of four connections and a rest."""
    more = ", plasticity: {oja: {rate: 0.01}}" if learns else ""
    text = LANES.replace("COMBINE", combine).replace("DELAY", str(delay)).replace(", PLASTIC", more)
    network = nv.compile_text(text).network
    degrees = np.bincount(network.connections.targets.whole(), minlength=30)
    assert len(set(degrees.tolist())) > 3
    follow(network, CBackend(), 12)
    runs = [record(network, Course(40, backend=name)) for name in ("reference", "c")]
    assert runs[0].activity.tobytes() == runs[1].activity.tobytes()
    assert runs[0].weights.tobytes() == runs[1].weights.tobytes()
    assert runs[0].weights_after.tobytes() == runs[1].weights_after.tobytes()


@pytest.mark.compiler
@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("place", [0, 3, 10])
def test_a_weight_that_is_not_finite_for_one_step_is_told_in_whole_runs(place: int) -> None:
    """What learns is looked at where it is stored, be it in a group of four connections or in the rest: one weight may
    be infinite for a step and finite again."""
    passing = rule("1e308*10 if k == 37 and pre == 1 else 0.5")
    units = [Unit(f"N{i}", TANH, bias=40 if i == place else 0.01 * i) for i in range(11)]
    links = [Link(i, (3 * i + 1) % 11, 0.1, learns=0) for i in range(11)]
    network = build(units, links, [Learns(passing)])
    with pytest.warns(RuntimeWarning, match=f"N{place} -> .* inf after step 37") as first:
        record(network, Course(90, backend="reference"))
    with pytest.warns(RuntimeWarning) as second:
        record(network, Course(90, backend="c"))
    assert [str(w.message) for w in second] == [str(w.message) for w in first]


@pytest.mark.parametrize(
    ("indices", "kind"), [([0, 65_535], "uint16"), ([3, 65_536], "int32"), ([-1, 7], "int32"), ([0, 65_537], "int32")]
)
def test_tables_of_indices_are_as_narrow_as_can_be(indices: list[int], kind: str) -> None:
    tables = Tables("double", longest=0)
    name = tables.name(np.array(indices))
    assert tables.passed_in[0].dtype == kind
    assert tables.passed_in[0].tolist() == indices
    assert tables.pointer_lines() == {name: f"const {kind}_t *restrict const {name} = (const {kind}_t *)p->given[0];"}


def test_the_weights_of_a_full_matrix_are_read_where_they_lie() -> None:
    """A whole run forms what arrives after one step where it arrives; only weights that lie in another order are put
    beside each other for it."""
    network = nv.compile_text(
        "neurovis: 1\nname: x\n"
        "neurons: {A: {count: 40, activation: tanh, bias: 0.1}, B: {count: 40, activation: sin}}\n"
        "connections:\n"
        "  A -> B: {weight: sin(i + j), pattern: all_to_all}\n"
        "  B -> A: {weight: cos(i * j) / 40, pattern: {band: {width: 25}}}\n"
    )
    band = int((network.network.connections.entry.whole() == 1).sum())
    assert written(network.network).packed == band < len(network.network.connections)
    runs = [network.run(50, backend=name) for name in ("c", "reference")]
    assert (runs[0].activity == runs[1].activity).all()
