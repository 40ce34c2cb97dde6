"""What spikes, in every backend: each step as the reference makes it, in networks of any make."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from random_specs import Spec
from random_spikes import spiking_specs
from test_flow_conformance import arrays, compiled

import neurovis_spec as nv
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime import c_backend
from neurovis_spec.runtime.backend import Backend, BackendError, Capabilities
from neurovis_spec.runtime.c_backend import CBackend, CStepper
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.numpy_backend import NumpyBackend, NumpyStepper
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.reference import ReferenceBackend
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.state import initial_state

BACKENDS = ["numpy", pytest.param("c", marks=pytest.mark.compiler)]


def follow(network: Network, backend: Backend, steps: int = 14) -> int:
    """Each step of a backend, begun in the reference's state, is that of the reference, with all events; but for the
    sign of what is 0, since what does not fire is not visited. Gives how many fire."""
    plain, other, reader = ReferenceBackend().prepare(network), backend.prepare(network), InputReader(network)
    state, controls, fired = initial_state(network), Controls(network), 0
    for k in range(steps):
        controls.begin(state)
        reader.use(state)
        beside = state.copy()
        plain.step(state, reader.at(k))
        other.step(beside, reader.at(k))
        for (name, expected), found in zip(arrays(state).items(), arrays(beside).values(), strict=True):
            np.testing.assert_array_equal(found, expected, f"{name} at {k}")
        fired += sum(int(own["spike"].sum()) for own in state.cells.values() if "spike" in own)
    return fired


@settings(max_examples=25, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=spiking_specs())
def test_each_step_in_numpy_is_that_of_the_reference(spec: Spec) -> None:
    follow(compiled(spec), NumpyBackend())


@pytest.mark.compiler
@pytest.mark.parametrize("size", [0, 600], ids=["loops", "written out"])
@settings(max_examples=6, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=spiking_specs(most=5))
def test_each_step_in_c_is_that_of_the_reference(spec: Spec, size: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(c_backend, "SMALL", size)
        follow(compiled(spec), CBackend())


LATE = """
neurovis: 1
name: late
time: {dt: 1 ms}
models:
  cell:
    time: ms
    state: {v: {initial: 0.3, derivative: (1.5 + drive - v)/3}}
    spike: {when: v >= 1, set: {v: 0}}
rules:
  seen:
    state: {heard: {on_pre: heard + 1}, last: {on_pre: pre.v}, sum: {each_step: sum + spike}}
    weight: {on_pre: weight + 0.01*pre.v}
neurons: {A: {count: 2, model: cell, initial: {v: [0.3, 0.7]}}, B: {model: cell}}
connections:
  A -> B: {weight: 0.1, pattern: all_to_all, send: v, delay: {seconds: 0.0024 + 0.0003*i}, plasticity: seen}
"""


@pytest.mark.parametrize("backend", ["reference", *BACKENDS])
@pytest.mark.parametrize("size", [0, 600])
def test_a_spike_arrives_once_where_the_delay_is_continuous(
    backend: str, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It lies on no line between two steps: the delays of 2.4 and 2.7 steps are of 2 and 3. What flows lies on one."""
    monkeypatch.setattr(c_backend, "SMALL", size)
    network = nv.compile_text(LATE).network
    assert network.connections.lags is not None
    run = record(network, Course(12, backend=backend, keep=Keep(states=("all",))))
    for name, delay, exact in (("A1", 2, 2.4), ("A2", 3, 2.7)):
        fired, v = run[name], run[f"{name}.v"]
        heard = np.concatenate((np.zeros(delay), np.cumsum(fired)))[: len(fired)]
        np.testing.assert_array_equal(run[f"({name} -> B).heard"], heard)
        np.testing.assert_array_equal(run[f"({name} -> B).sum"], heard)
        step = int(np.flatnonzero(fired)[0]) + delay
        whole, part = int(exact), exact - int(exact)
        between = v[step - whole - 1] + (1 - part) * (v[step - whole] - v[step - whole - 1])
        np.testing.assert_allclose(run[f"({name} -> B).last"][step], between, rtol=1e-12)


MIXED = """
neurovis: 1
name: mixed
time: {dt: 1 ms}
models:
  cell:
    time: ms
    ports: [kick]
    state: {v: {initial: 0, derivative: (drive - v)/7, jump: kick}}
    spike: {when: v >= 1, set: {v: 0}, refractory: 2, hold: v}
rules:
  trade: {state: {a: {on_pre: 0.5*a + 0.1, on_post: 0.9*a}}, weight: {on_pre: weight - 0.1*a, on_post: weight + a}}
neurons: {E: {count: 60, model: cell, bias: "uniform(0.8, 2)", initial: {v: "uniform(0, 1)"}}}
connections:
  E -> E: {weight: "normal(0, 0.3)", pattern: {random: {probability: 0.4}}, port: kick, delay: DELAY, REST}
events: [{at: 4, lesion: [E7..E9]}, {at: 11, mend: [E7..E9]}, {from: 6, to: 9, clamp: {E3: 1, E4: 0}}]
"""


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("rest", ["self: true", "plasticity: trade, bounds: [-1.5, 1.5]"])
@pytest.mark.parametrize("delay", ["0", "1", "1 + (i + 5*j) % 4"], ids=["now", "next", "mixed"])
def test_sums_of_many_spikes_are_in_the_order_of_the_connections(backend: str, rest: str, delay: str) -> None:
    """Also where what fired brings them in another order, as with delays that differ."""
    network = nv.compile_text(MIXED.replace("DELAY", f'"{delay}"').replace("REST", rest)).network
    runs = [record(network, Course(40, backend=one, keep=Keep(states=("all",)))) for one in ("reference", backend)]
    assert runs[0].activity.sum() > 200
    np.testing.assert_array_equal(runs[1].activity, runs[0].activity)
    np.testing.assert_array_equal(runs[1].states, runs[0].states)
    np.testing.assert_array_equal(runs[1].weights, runs[0].weights)


@pytest.mark.parametrize("backend", BACKENDS)
def test_states_are_held_where_spikes_come_in_any_order(backend: str) -> None:
    """Those of some connections, by delays that differ, while spikes come to them and to others."""
    text = MIXED.replace("DELAY", '"1 + (i + 5*j) % 4"').replace("REST", "plasticity: trade")
    network = nv.compile_text(text.replace("E3: 1, E4: 0", "(E3..E30 -> E).a: 0.2, (E40 -> E).a: 0.4")).network
    runs = [record(network, Course(14, backend=one, keep=Keep(states=("all",)))) for one in ("reference", backend)]
    np.testing.assert_array_equal(runs[1].states, runs[0].states)
    np.testing.assert_array_equal(runs[1].weights, runs[0].weights)


TWO_PORTS = """
neurovis: 1
name: two_ports
time: {dt: 1 ms}
models:
  cell:
    time: ms
    ports: [near, far]
    state: {v: {initial: 0.2, derivative: (drive - v)/5, jump: near - far/2}}
    spike: {when: v >= 1, set: {v: 0}}
neurons: {A: {count: 3, model: cell, bias: 1.3 + i/4}, B: {count: 3, model: cell, bias: 1.2}}
connections:
  - A -> B: {weight: 0.3 + j/10, pattern: all_to_all, port: near, delay: 1 + i % 2, plasticity: learns}
  - A -> B: {weight: 0.2 + j/10, pattern: all_to_all, port: far, delay: 2 - i % 2, plasticity: learns}
rules: {learns: {weight: {on_pre: 0.9*weight}}}
"""


@pytest.mark.compiler
@pytest.mark.parametrize("size", [0, 600], ids=["loops", "written out"])
def test_spikes_of_several_delays_come_to_several_ports(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(c_backend, "SMALL", size)
    assert follow(nv.compile_text(TWO_PORTS).network, CBackend(), steps=30) > 10


def test_a_backend_without_spikes_refuses_them() -> None:
    class Plain(NumpyBackend):
        name = "plain"
        capabilities = Capabilities(flows=True, synapses=True)

    jumps = TWO_PORTS.replace("spike: {when: v >= 1, set: {v: 0}}", "activity: v").replace(", plasticity: learns", "")
    jumps = jumps[: jumps.index("rules:")]
    for text in (TWO_PORTS, jumps):
        with pytest.raises(BackendError, match=r"'plain' cannot run 'two_ports': no spikes"):
            Simulation(nv.compile_text(text).network, Plain())


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_run_that_keeps_no_weights_makes_many_steps_by_a_call(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = MIXED.replace("DELAY", "2").replace("REST", "plasticity: trade")
    network = nv.compile_text(text).network
    runs = [record(network, Course(40, backend=backend, every=every)) for every in (1, 7)]
    for name in ("step", "advance"):
        for made in (CStepper, NumpyStepper):
            monkeypatch.setattr(made, name, lambda *_: pytest.fail("a step of its own"), raising=False)
    for every, kept in zip((1, 7), runs, strict=True):
        run = record(network, Course(40, backend=backend, every=every, keep=Keep(weights=False)))
        np.testing.assert_array_equal(run.activity, kept.activity)
        np.testing.assert_array_equal(run.fired.neurons, runs[0].fired.neurons)
        np.testing.assert_array_equal(run.weights_after, kept.weights_after)
        assert run.weights.shape == (len(run.activity), 0)


GROWING = {
    "weight": ("rules", "{weight: {on_pre: 1e200*weight}}"),
    "state": ("rules", "{state: {a: {initial: 1, on_post: 1e200*a}}, weight: {on_pre: weight}}"),
    "trace": ("rules", "{time: ms, state: {a: {initial: 1, derivative: -a/9, on_pre: 1e200*a}}, weight: {on_post: a}}"),
    "synapse": ("synapses", "{state: {g: {initial: 1, on_pre: 1e200*g}}, signal: 1/(9 + g)}"),
    "flow": ("synapses", "{state: {g: {initial: 1, derivative: 3e5*g}}, signal: 1/(9 + g)}"),
}


@pytest.mark.compiler
@pytest.mark.parametrize("grows", GROWING)
def test_what_spikes_make_infinite_is_told_at_its_step(grows: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where only connections are looked at that a spike has come to."""
    monkeypatch.setattr(c_backend, "SMALL", 0)
    section, body = GROWING[grows]
    key = {"rules": "plasticity", "synapses": "synapse"}[section]
    head, tail = MIXED.split("rules:")[0], MIXED[MIXED.index("neurons:") : MIXED.index("events:")]
    tail = tail.replace("count: 60", "count: 9").replace("DELAY", "3").replace("REST", f"{key}: grows")
    network = nv.compile_text(f"{head}{section}: {{grows: {body}}}\n{tail}").network
    told = []
    for backend in ("reference", "c"):
        with pytest.warns(RuntimeWarning) as found:
            record(network, Course(60, backend=backend, keep=Keep(weights=False)))
        told.append([str(one.message) for one in found])
    assert told[0] == told[1]
    assert "inf" in told[0][0]
