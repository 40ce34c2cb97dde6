"""Synapses in a run: of what signals are formed, and when; against loops by hand, and solutions in closed form."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.arguments import CodedWarning
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.backend import BackendError, Capabilities
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.formed import signals_of
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.simulation import Simulation

BACKENDS = ["reference", "numpy"]


def network_of(text: str) -> Network:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return nv.compile_text("neurovis: 1\nname: x\n" + text).network


def steps(simulation: Simulation, count: int) -> None:
    for _ in range(count):
        simulation.step()


def cell(simulation: Simulation, kind: str, name: str, number: int = 0) -> FloatArray:
    """A state or an output of the definition of a kind in use, the ``number``-th of those that have it."""
    cells = [own[name] for owner, own in simulation.state().cells.items() if owner.kind == kind and name in own]
    return cells[number]


# ---- as the map sees it -------------------------------------------------------------------------------------------

MAPS = """
time: {episode: 4}
inputs: {count: {expression: k + 1}}
models:
  leaky: {state: {v: {each_step: 0.5*v + drive}}, outputs: {twice: 2*v}, activity: v - 1}
synapses:
  trace:
    state: {u: {initial: 1, each_step: 0.5*u + pre, each_episode: 0.25*u}}
    signal: weight*u*(10 - post.twice) + sent + 0.5*post
neurons: {A: {input: count}, B: {model: leaky}}
connections: {A -> B: {weight: 0.25, synapse: trace, delay: 2}}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_signal_is_formed_of_what_was_sent_of_the_target_before_it_is_updated_and_of_new_states(
    backend: str,
) -> None:
    simulation = Simulation(network_of(MAPS), backend)
    u, v, post = 1.0, 0.0, 0.0
    twice = 0.0
    for k in range(10):
        simulation.step()
        pre = float(k - 1) if k >= 2 else 0.0  # of two steps ago; nothing was sent before step 0
        u = 0.5 * u + pre
        v = 0.5 * v + (0.25 * u * (10 - twice) + (k + 1) + 0.5 * post)
        twice, post = 2 * v, v - 1
        if (k + 1) % 4 == 0:
            u *= 0.25  # behind the signal of the last step
        assert simulation.activity[1] == pytest.approx(post, rel=1e-15)
        assert cell(simulation, "synapse", "u")[0] == u


BEHIND = """
time: {dt: 0.1, integrate: euler}
models:
  flow: {state: {v: {initial: 1, derivative: -v}}, outputs: {half: v/2}, activity: drive}
synapses: {seen: {signal: weight*post.v + 10*post.half + 100*pre}}
neurons: {A: {bias: 1}, B: {model: flow}}
connections: {A -> B: {weight: 1, synapse: seen, delay: 0}}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_flows_of_the_target_is_seen_as_it_is_integrated_and_else_as_it_was(backend: str) -> None:
    simulation = Simulation(network_of(BEHIND), backend)
    v, half = 1.0, 0.0
    for k in range(5):
        simulation.step()
        v = v + 0.1 * -v if k else v
        assert simulation.activity[1] == pytest.approx(v + 10 * half + 100, rel=1e-14)
        half = v / 2
    simulation.clamp("B.v", 0.25)
    simulation.step()
    assert simulation.activity[1] == pytest.approx(0.25 + 10 * half + 100, rel=1e-14)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_state_that_is_held_from_the_start_on_is_seen_so_at_step_0(backend: str) -> None:
    network = network_of(BEHIND + "events: [{from: 0, clamp: {B.v: 3}}]\n")
    simulation = Simulation(network, backend)
    simulation.step()
    assert simulation.activity[1] == 103.0


# ---- at stages ----------------------------------------------------------------------------------------------------

CONDUCTANCE = """
time: {dt: DT, integrate: METHOD}
models:
  cell: {ports: [p], let: {leak: 0.5*(drive - v)}, state: {v: {initial: 0, derivative: 2*leak + p/4}}, activity: v}
synapses:
  fixed: {parameters: {E: 1}, let: {open: weight*(E - post.v)}, signal: 2*open}
neurons: {S: {}, C: {count: 2, model: cell}}
connections:
  S -> C1: {weight: 3, synapse: fixed, port: {drive: 1, p: 0.5}}
  S -> C2: {weight: 1, synapse: {fixed: {E: -2}}, port: p}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_slope_goes_through_ports_into_the_state_of_the_target(backend: str) -> None:
    """For what is linear in the state of the target the exponential method is exact, conductances included, however
    long a step is."""
    network = network_of(CONDUCTANCE.replace("DT", "0.7").replace("METHOD", "exponential"))
    simulation = Simulation(network, backend)
    # v' = (6(1 - v) - v) + 3(1 - v)/4, and v' = -v + 2(-2 - v)/4
    rates, limits = np.array([7.75, 1.5]), np.array([6.75 / 7.75, -1 / 1.5])
    for k in range(5):
        simulation.step()
        expected = limits * (1 - np.exp(-rates * 0.7 * k))
        np.testing.assert_allclose(simulation.activity[1:], expected, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("backend", BACKENDS)
def test_semi_implicit_takes_the_same_slope(backend: str) -> None:
    network = network_of(CONDUCTANCE.replace("DT", "0.7").replace("METHOD", "semi_implicit"))
    simulation = Simulation(network, backend)
    steps(simulation, 2)
    np.testing.assert_allclose(simulation.activity[1:], [0.7 * 6.75 / (1 + 0.7 * 7.75), -0.7 / (1 + 0.7 * 1.5)])


STATES = """
time: {dt: 0.01}
models:
  source: {state: {x: {initial: 1, derivative: -x}}, activity: x}
  target: {state: {v: {initial: 0.5, derivative: drive - v}}, activity: v}
synapses:
  low_pass:
    time: ms
    parameters: {tau: 500}
    state: {g: {derivative: (pre.x - g)/tau}, h: {initial: 2, derivative: (post.v - h)/tau}}
    signal: weight*g + h
neurons: {A: {model: source}, B: {model: target}}
connections: {A -> B: {weight: 3, synapse: low_pass}}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_states_of_synapses_are_integrated_with_those_of_neurons(backend: str) -> None:
    """A chain of linear equations: its matrix is exponentiated."""
    simulation = Simulation(network_of(STATES), backend)
    steps(simulation, 101)
    matrix = np.array([[-1, 0, 0, 0], [2, -2, 0, 0], [0, 0, -2, 2], [0, 3, 1, -1.0]])  # x, g, h, v
    values, vectors = np.linalg.eig(matrix)
    expected = (vectors @ np.diag(np.exp(values)) @ np.linalg.solve(vectors, np.array([1, 0, 2, 0.5]))).real
    found = [simulation.activity[0], *(cell(simulation, "synapse", name)[0] for name in "gh"), simulation.activity[1]]
    np.testing.assert_allclose(found, expected, rtol=1e-7)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("integrate", ["exponential", "semi_implicit", "rk4"])
def test_states_of_synapses_flow_where_no_model_has_a_derivative(backend: str, integrate: str) -> None:
    """Towards what a static neuron sends, held over a step: the exponential method is exact."""
    network = network_of(f"""
time: {{dt: 0.5, integrate: {integrate}}}
synapses: {{s: {{state: {{g: {{derivative: pre - 2*g}}}}, signal: g}}}}
neurons: {{A: {{bias: 3}}, B: {{}}}}
connections: {{A -> B: {{synapse: s, delay: 1}}}}
""")
    simulation = Simulation(network, backend)
    steps(simulation, 4)
    g = {"exponential": 1.5 * (1 - math.exp(-3)), "semi_implicit": 1.5 * (1 - 1 / 8), "rk4": 1.5 * (1 - 0.375**3)}
    np.testing.assert_allclose(simulation.activity[1], g[integrate], rtol=1e-12)


HELD = """
time: {dt: 0.1, integrate: euler}
models: {flow: {state: {v: {initial: INITIAL, derivative: drive}}, activity: v}}
synapses: {gap: {signal: weight*(pre.v - post.v)}}
neurons: {A: {model: flow, bias: 1, initial: {v: 4}}, B: {model: flow}}
connections: {A -> B: {weight: 1, synapse: gap, delay: 2}}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_delay_of_steps_holds_what_was_sent_and_of_before_there_is_nothing(backend: str) -> None:
    simulation = Simulation(network_of(HELD.replace("INITIAL", "0.5")), backend)
    a, b = [4.0], 0.5
    for k in range(6):
        simulation.step()
        if k:
            pre = a[k - 2] if k >= 2 else 0.0
            b += 0.1 * (pre - b)
            a.append(a[-1] + 0.1)
        assert simulation.activity.tolist() == pytest.approx([a[-1], b], rel=1e-14)


TOGETHER = """
time: {dt: 0.1}
models:
  m: {state: {z: {initial: 0.5, derivative: drive - z}}, activity: f(drive)}
  n: {state: {z: {initial: 0.5, derivative: drive - z}}, activity: f(drive)}
synapses: {now: {signal: weight*sent}}
inputs: {wave: {expression: 1 + t^2}}
neurons: {C: {model: m, input: wave}, A: {model: MODEL}}
connections: {C -> A: {weight: 2, synapse: now, delay: 1}}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_taken_of_a_neuron_reaches_one_that_is_updated_with_it(backend: str) -> None:
    """Whether they are of the same population or not."""
    networks = [network_of(TOGETHER.replace("MODEL", model)) for model in "mn"]
    assert len(networks[0].populations) < len(networks[1].populations)
    one, other = (record(network, Course(20, backend=backend, keep=Keep(states=("A.z",)))) for network in networks)
    np.testing.assert_array_equal(one.states, other.states)
    assert np.ptp(one.states) > 1


# ---- what events do -----------------------------------------------------------------------------------------------

EVENTS = """
time: {dt: 0.1, integrate: euler}
parameters: {E: 1, tau: 2}
models:
  source: {parameters: {gain: 1}, state: {x: {initial: 1, derivative: 0.5}}, activity: x}
  target: {state: {v: {derivative: drive}}, activity: v}
synapses:
  s: {parameters: {E: 0}, state: {g: {derivative: pre.x - g}, u: {each_step: u + pre.gain}}, signal: g*(E - post.v) + u}
neurons: {A: {model: {source: {gain: tau}}}, B: {model: target}}
connections: {A -> B: {weight: 1, synapse: {s: {E: E}}}}
"""


ONE_BEHIND_THE_OTHER = """
time: {dt: 0.1}
models:
  cell:
    ports: [g, h]
    state: {v: {initial: 1, derivative: drive - v}}
    outputs: {r: v + g, q: v + h}
    activity: v
  last: {state: {v: {derivative: drive - v}}, activity: v}
synapses:
  of_q: {signal: weight*(pre.v - post.q)}
  of_r: {signal: weight*(pre.v - post.r)}
  passed_on: {signal: weight*(pre.r + 2*pre.q)}
neurons: {A: {model: cell, count: 2, bias: [1, 2]}, B: {model: last, bias: 3}}
connections:
- B -> A1: {synapse: of_q, port: g, weight: 0.3}
- B -> A2: {synapse: of_r, port: h, weight: 0.3}
- A -> B: {synapse: passed_on, weight: 0.7, delay: 0}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_output_is_made_behind_another_of_the_same_neuron_that_a_synapse_reads(backend: str) -> None:
    """With rk4, each neuron in an order of its own."""

    def slopes(x: FloatArray) -> FloatArray:
        a, b, v = x.tolist()
        total = 0.7 * (a + 0.3 * (v - a)) + 1.4 * a  # A1 has q = v, and r behind it
        total += 0.7 * b + 1.4 * (b + 0.3 * (v - b))  # A2 has r = v, and q behind it
        return np.array([1 - a, 2 - b, total + 3 - v])

    x = np.array([1.0, 1.0, 0.0])
    simulation = Simulation(network_of(ONE_BEHIND_THE_OTHER), backend)
    simulation.step()
    for _ in range(10):
        k1 = slopes(x)
        k2 = slopes(x + 0.05 * k1)
        k3 = slopes(x + 0.05 * k2)
        x = x + 0.1 / 6 * (k1 + 2 * k2 + 2 * k3 + slopes(x + 0.1 * k3))
        simulation.step()
        np.testing.assert_allclose(simulation.activity, x, rtol=1e-13)


def test_outputs_of_a_neuron_that_read_each_other_through_synapses_are_a_loop() -> None:
    with pytest.raises(nv.SpecError, match=r"A1\.[qr] -> A1\.[qr]"):
        network_of(ONE_BEHIND_THE_OTHER.replace("B -> A2", "B -> A1"))


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("what", ["A -> B", "A", "B"])
def test_the_states_of_what_is_lesioned_stay_and_it_brings_nothing(backend: str, what: str) -> None:
    simulation = Simulation(network_of(EVENTS), backend)
    steps(simulation, 4)
    kept = {name: cell(simulation, "synapse", name).copy() for name in "gu"}
    v = cell(simulation, "model", "v").copy()
    simulation.lesion(what)
    for _ in range(3):
        simulation.step()
        assert all((cell(simulation, "synapse", name) == values).all() for name, values in kept.items())
        assert (cell(simulation, "model", "v") == v).all()
        assert signals_of(simulation.network, simulation.state(), simulation.connection_weights).tolist() == [0.0]
    simulation.mend(what)
    simulation.step()
    assert (cell(simulation, "synapse", "u") == kept["u"] + 2).all()
    assert cell(simulation, "synapse", "g") != kept["g"]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("flows", [True, False])
def test_what_a_lesion_has_lost_never_arrives(backend: str, flows: bool) -> None:
    """At stages as before an update: ``pre`` and ``pre.x`` are 0 until something arrives that was sent since."""
    target = "{state: {v: {derivative: 10*drive}}, activity: v}" if flows else "{activity: drive}"
    network = network_of(f"""
time: {{dt: 0.1, integrate: euler}}
models:
  source: {{state: {{x: {{each_step: x + 1}}}}, activity: 100*x}}
  target: {target}
synapses: {{s: {{signal: pre + pre.x}}}}
neurons: {{A: {{model: source}}, B: {{model: target}}}}
connections: {{A -> B: {{synapse: s, delay: 3}}}}
""")
    simulation = Simulation(network, backend)
    arrived, before = [], 0.0
    for k in range(16):
        if k in (6, 8):
            (simulation.lesion if k == 6 else simulation.mend)("A -> B")
        simulation.step()
        arrived.append(simulation.activity[1] - before if flows else simulation.activity[1])
        before = simulation.activity[1]
    x = [0.0] * 3 + [float(k - 2) for k in range(3, 16)]  # x is 1 at step 0
    expected = [0.0 if 6 <= k < 11 else 101 * x[k] for k in range(16)]
    assert arrived == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("backend", BACKENDS)
def test_parameters_of_a_synapse_and_of_an_end_of_it_are_set(backend: str) -> None:
    simulation = Simulation(network_of(EVENTS), backend)
    x, g, u, v = 1.0, 0.0, 0.0, 0.0
    settings: dict[int, Mapping[str, float]] = {2: {"E": 3.0}, 4: {"tau": -1.0}}
    known = {"E": 1.0, "tau": 2.0}
    for k in range(7):
        if k in settings:
            simulation.set(**settings[k])
            known |= settings[k]
        simulation.step()
        if k:
            x, g, v = x + 0.05, g + 0.1 * (x - g), v + 0.1 * (g * (known["E"] - v) + u)
            u += known["tau"]
        assert simulation.activity.tolist() == pytest.approx([x, v], rel=1e-14)


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_held_at_an_end_is_held_at_stages(backend: str) -> None:
    """The activity of a source, and the state of a target."""
    network = network_of("""
time: {dt: 0.5}
models: {flow: {state: {v: {initial: 1, derivative: drive - v}}, activity: v}}
synapses: {s: {state: {q: {derivative: pre + 10*post.v}}, signal: "0"}}
neurons: {A: {model: flow}, B: {model: flow}}
connections: {A -> B: {synapse: s}}
""")
    simulation = Simulation(network, backend)
    simulation.step()
    simulation.clamp("A", 2.0)
    simulation.clamp("B.v", 3.0)
    simulation.step()
    assert cell(simulation, "synapse", "q")[0] == pytest.approx(0.5 * 32, rel=1e-15)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_run_goes_on_from_a_recording_with_all_states(backend: str) -> None:
    network, keep = network_of(EVENTS.replace("synapse: {s", "delay: 2, synapse: {s")), Keep(states=("all",))
    whole = record(network, Course(20, backend=backend, keep=keep))
    first = record(network, Course(12, backend=backend, keep=keep))
    rest = record(network, Course(8, backend=backend, keep=keep, start=first))
    np.testing.assert_array_equal(rest.states, whole.states[12:])
    kept = Keep(states=("A.x", "B.v"))
    with pytest.warns(CodedWarning, match=r"lacks states with a derivative, as of A -> B, which begin anew"):
        record(network, Course(3, backend=backend, start=record(network, Course(12, backend=backend, keep=kept))))


def test_a_backend_without_synapses_refuses_them() -> None:
    class Plain(NumpyBackend):
        name = "plain"
        capabilities = Capabilities(flows=True)

    with pytest.raises(BackendError, match=r"'plain' cannot run 'x': no synapses"):
        Simulation(network_of(EVENTS), Plain())


# ---- pictures -----------------------------------------------------------------------------------------------------

SHOWN = """
time: {dt: 0.1}
parameters: {lag: 0.5}
models:
  flow: {parameters: {omega: 2}, state: {x: {initial: 0.3, derivative: omega + drive}}, activity: sin(x)}
synapses:
  pull:
    parameters: {lag: 0}
    let: {between: pre.x - post.x}
    state: {u: {each_step: u + 0.1}}
    signal: weight*sin(between - lag) + u + pre.omega + t
neurons: {A: {count: 2, model: flow}, S: {activation: tanh, bias: 0.3}}
connections:
  A -> A: {weight: 0.5, pattern: all_to_all, synapse: {pull: {lag: lag}}, delay: DELAY}
  S -> A: {weight: 2, pattern: all_to_all, plasticity: {oja: {rate: 0.1}}}
"""


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_signals_are_those_of_the_end_of_the_step(delay: int) -> None:
    simulation = Simulation(network_of(SHOWN.replace("DELAY", str(delay))), "numpy")
    simulation.set(lag=0.25)
    past: list[FloatArray] = []
    for k in range(5):
        weights = simulation.connection_weights.copy()
        simulation.step()
        past.append(cell(simulation, "model", "x").copy())
        x, (s,) = past[-1], simulation.activity[2:]
        pre = past[k - delay] if k >= delay else np.zeros(2)
        expected = [
            0.5 * math.sin(pre[source] - x[target] - 0.25) + cell(simulation, "synapse", "u")[0] + 2 + k * 0.1
            for source, target in ((1, 0), (0, 1))
        ]
        found = signals_of(simulation.network, simulation.state(), weights)
        by_ends = dict(zip(simulation.network.connection_names, found.tolist(), strict=True))
        assert [by_ends["A2 -> A1"], by_ends["A1 -> A2"]] == pytest.approx(expected, rel=1e-12)
        assert [by_ends["S -> A1"], by_ends["S -> A2"]] == pytest.approx([w * s for w in weights[2:]], rel=1e-15)
    simulation.lesion("A1")
    simulation.step()
    found = signals_of(simulation.network, simulation.state(), simulation.connection_weights)
    assert np.flatnonzero(found).tolist() == [3]
