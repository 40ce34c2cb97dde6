"""Shared synapses: one state for all connections of an entry at a target does what one for each of them does."""

from __future__ import annotations

import copy
import random
import tempfile
import warnings
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from random_specs import Plain, Spec
from random_spikes import made_spec
from test_flow_conformance import compiled
from test_spike_conformance import follow
from test_spike_seams import alike, fires_alike

import neurovis_spec as nv
from neurovis_spec.cli.overview import overview
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.carry import carried
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.runtime import c_backend, c_export
from neurovis_spec.runtime.c_backend import CBackend
from neurovis_spec.runtime.columns import Keep, probe_of
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.formed import signals_of
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.references import find_states
from neurovis_spec.runtime.simulation import ParameterError, Simulation
from neurovis_spec.runtime.state import State
from neurovis_spec.scene.ends import ends_of

BACKENDS = ["numpy", pytest.param("c", marks=pytest.mark.compiler)]


def shared(spec: Spec) -> Spec | None:
    """The same spec with all synapses shared that can be; None where there are none."""
    result = copy.deepcopy(spec)
    synapses = cast("dict[str, dict[str, Plain]]", result["synapses"])
    connections = cast("dict[str, dict[str, Plain]]", result["connections"])
    multiplied = {str(body.get("synapse")) for body in connections.values() if "gain" in str(body.get("port"))}
    can_be = [
        one
        for name, one in synapses.items()
        if name not in multiplied and "on_pre" in str(one) and str(one["signal"]).startswith("g")
    ]
    for one in can_be:
        one["shared"] = True
    return result if can_be else None


@st.composite
def sharing_specs(draw: st.DrawFn, most: int = 4) -> tuple[Spec, Spec]:
    """A random spec without and with shared synapses."""
    seed, groups = draw(st.integers(0, 2**32)), draw(st.integers(1, 3))
    while True:
        spec = made_spec(random.Random(seed), groups, most)
        if made := shared(spec):
            return spec, made
        seed += 1


def without_lesions(spec: Spec) -> Spec:
    """What is lesioned brings nothing by a synapse of its own, and what it has added before where that is shared."""
    events = cast("list[dict[str, Plain]]", spec["events"])
    return {**spec, "events": [one for one in events if one.keys().isdisjoint(("lesion", "mend"))]}


def run(network: Network, steps: int = 14, backend: str = "reference") -> Recording:
    return record(network, Course(steps, backend=backend, keep=Keep(states=("all",))))


@settings(max_examples=10, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(specs=sharing_specs())
def test_what_is_shared_does_what_is_not(specs: tuple[Spec, Spec]) -> None:
    each, together = (compiled(without_lesions(one)) for one in specs)
    expected, found = run(each), run(together)
    np.testing.assert_allclose(found.activity, expected.activity, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.weights, expected.weights, rtol=1e-12, atol=1e-12)


@settings(max_examples=6, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(specs=sharing_specs())
def test_each_step_in_numpy_is_that_of_the_reference(specs: tuple[Spec, Spec]) -> None:
    follow(compiled(specs[1]), NumpyBackend())


@pytest.mark.compiler
@pytest.mark.parametrize("size", [0, 600], ids=["loops", "written out"])
@settings(max_examples=4, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(specs=sharing_specs(most=5))
def test_each_step_in_c_is_that_of_the_reference(specs: tuple[Spec, Spec], size: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(c_backend, "SMALL", size)
        follow(compiled(specs[1]), CBackend())


@pytest.mark.compiler
@pytest.mark.parametrize("size", [0, 600], ids=["loops", "written out"])
@settings(max_examples=3, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(specs=sharing_specs())
def test_exported_c_runs_as_the_reference_does(specs: tuple[Spec, Spec], size: int) -> None:
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        warnings.simplefilter("ignore")
        patch.setattr(c_export, "SMALL", size)
        try:
            network = nv.compile(specs[1])
        except nv.SpecError:  # a cycle without delay
            return
        fires_alike(network, Path(folder), steps=14)


@settings(max_examples=3, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(specs=sharing_specs(), cut=st.integers(1, 13))
def test_an_edit_of_nothing_and_a_checkpoint_change_nothing(specs: tuple[Spec, Spec], cut: int) -> None:
    network = compiled(specs[1])
    plain, edited = (SimulatedSource(Simulation(network, "numpy")) for _ in range(2))
    whole, other = (Simulation(network, "numpy") for _ in range(2))
    for k in range(14):
        if k == cut:
            edited = carried(edited, Simulation(network, "numpy"))
            with tempfile.TemporaryDirectory() as folder:
                whole.save_state(Path(folder) / "kept.npz")
                other.restore(Path(folder) / "kept.npz")
        for one in (plain, edited):
            one.advance()
        whole.step()
        if k >= cut:
            other.step()
        np.testing.assert_array_equal(edited.seen().snapshot.activity, plain.seen().snapshot.activity)
    alike(other.state(), whole.state())


TEXT = """\
neurovis: 1
name: receptors
time: {dt: 1 ms, steps: 40}
parameters: {tau: 4, w: 0.3}
models:
  cell: {time: ms, state: {v: {derivative: (drive - v)/9}}, spike: {when: v >= 1, set: {v: 0}}}
  leak: {time: ms, state: {v: {derivative: (drive - v)/9}}, activity: v}
synapses:
  receptor:
    shared: true
    time: ms
    parameters: {tau: 5, E: 3}
    let: {open: g + h/2, more: pre.v + weight}
    state: {g: {derivative: (h - g)/tau, on_pre: more + g - 0.1}, h: {derivative: -h/3, on_pre: h - weight/4}}
    signal: open*(E - post.v)
inputs: {train: {spikes: {times: [[0.002, 0.02], [0.003, 0.021], [0.003]]}, size: 3}}
neurons:
  S: {count: 3, model: spike_source, input: train}
  A: {count: 3, model: cell, bias: 1.5}
  B: {count: 2, model: leak}
outputs: {g: (S2 -> B2).g}
connections:
  - S -> B: {weight: w*(1 + i - j/2), pattern: all_to_all, synapse: {plain: {tau: tau}}, delay: 2}
  - A -> B: {weight: 0.2, pattern: all_to_all, synapse: receptor, delay: 1 + i, plasticity: grows}
  - A -> A: {weight: 0.1, pattern: ring, synapse: {receptor: {tau: tau}}}
rules: {grows: {weight: {on_pre: 1.1*weight}}}
"""
PLAIN = """\
  plain: {SHARED, time: ms, parameters: {tau: 4}, state: {g: {derivative: -g/tau, on_pre: g + weight}}, signal: g}
"""


def value(network: Network, state: State, name: str) -> float:
    """A state of a run by its name."""
    return float(probe_of(network, find_states(network, name)).now(state)[0])


def network_of(events: str = "", shares: bool = True) -> nv.CompiledNetwork:
    text = TEXT.replace("synapses:\n", f"synapses:\n{PLAIN.replace('SHARED', 'shared: true')}")
    text = text if shares else text.replace("shared: true", "shared: false")
    return nv.compile_text(f"{text}events: [{events}]\n" if events else text)


def fade(steps: int) -> float:
    """What rk4 leaves of 1 that decays by a time constant of 4 steps."""
    x = 1 / 4
    return float((1 - x + x**2 / 2 - x**3 / 6 + x**4 / 24) ** steps)


def test_there_is_one_state_for_each_entry_and_target() -> None:
    network = network_of().network
    cells = Simulation(network, "numpy").state().cells
    sizes = [
        (network.projections[owner.number].use.definition.name, name, len(values))
        for owner, own in cells.items()
        if owner.kind == "synapse"
        for name, values in own.items()
    ]
    assert sorted(sizes) == [
        ("plain", "g", 2),
        ("receptor", "g", 2),
        ("receptor", "g", 3),
        ("receptor", "h", 2),
        ("receptor", "h", 3),
    ]


def test_only_specs_that_share_have_another_hash() -> None:
    each, together = network_of(shares=False), network_of()
    text = TEXT.replace("synapses:\n", f"synapses:\n{PLAIN.replace('SHARED, ', '')}").replace("    shared: true\n", "")
    assert each.hash == nv.compile_text(text).hash != together.hash
    assert nv.compile_text(together.text()).hash == together.hash


@pytest.mark.parametrize("backend", ["reference", *BACKENDS])
def test_what_arrives_is_added_and_decays_together(backend: str) -> None:
    made = network_of().run(30, backend=backend, states="all")
    first, second = 0.3 * np.array([1, 2, 3]), 0.3 * np.array([0.5, 1.5, 2.5])
    for target, weights in (("B1", first), ("B2", second)):
        g = made[f"(S1 -> {target}).g"].ravel()
        assert g[3] == 0
        np.testing.assert_allclose(g[4], weights[0], rtol=1e-14)
        np.testing.assert_allclose(g[5], weights[0] * fade(1) + weights[1:].sum(), rtol=1e-14)
        np.testing.assert_allclose(g[15], g[5] * fade(10), rtol=1e-13)
    assert made.state_names.count("(S1 -> B2).g") == 1
    assert "(S2 -> B2).g" not in made.state_names
    np.testing.assert_array_equal(made["g"].ravel(), made["(S1 -> B2).g"].ravel())  # whichever is named
    asked = network_of().run(30, backend=backend, states="(S3 -> B1).g + (A -> A).h")
    np.testing.assert_array_equal(asked["(S1 -> B1).g"].ravel(), made["(S1 -> B1).g"].ravel())


@pytest.mark.parametrize("backend", ["reference", *BACKENDS])
def test_a_lesioned_connection_adds_nothing_more(backend: str) -> None:
    """Be it the one that the state goes by, or another one; what was under way is lost, also where it is mended."""
    whole = network_of().run(30, backend=backend, states="all")["(S1 -> B1).g"].ravel()
    for lesioned, weight in (("S1 -> B1", 0.3), ("S2 -> B1", 0.6), ("S1", 0.3)):
        events = f"{{at: 10, lesion: {lesioned}}}"
        g = network_of(events).run(30, backend=backend, states="all")["(S1 -> B1).g"].ravel()
        np.testing.assert_array_equal(g[:22], whole[:22])
        came = 22 if lesioned != "S2 -> B1" else 23
        np.testing.assert_allclose(whole[29] - g[29], weight * fade(29 - came), rtol=1e-12)
        mended = f"{{at: 4, lesion: {lesioned}}}, {{at: 8, mend: {lesioned}}}"
        g = network_of(mended).run(30, backend=backend, states="all")["(S1 -> B1).g"].ravel()
        came = 4 if lesioned != "S2 -> B1" else 5
        np.testing.assert_allclose(whole[12] - g[12], weight * fade(12 - came), rtol=1e-12)
        np.testing.assert_allclose(whole[29] - g[29], weight * fade(29 - came), rtol=1e-9)


@pytest.mark.parametrize("backend", ["reference", *BACKENDS])
def test_a_lesioned_target_keeps_its_states(backend: str) -> None:
    runs = [
        network_of("{at: 8, lesion: B1}, {at: 14, mend: B1}", shares).run(30, backend=backend, states="all")
        for shares in (True, False)
    ]
    g = runs[0]["(S1 -> B1).g"].ravel()
    assert g[7] == g[13] > g[14] > 0
    np.testing.assert_allclose(runs[0].activity, runs[1].activity, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("backend", ["reference", *BACKENDS])
def test_states_go_back_with_their_targets(backend: str) -> None:
    whole, made = (
        network_of(events).run(20, backend=backend, states="all")["(S1 -> B1).g + (S1 -> B2).g"]
        for events in ("", "{at: 10, reset: [S1, B2]}")
    )
    np.testing.assert_array_equal(made[:, 0], whole[:, 0])
    np.testing.assert_array_equal(made[:10], whole[:10])
    assert whole[19, 1] > 0
    assert not made[10:, 1].any()


@pytest.mark.parametrize("backend", ["reference", *BACKENDS])
def test_states_are_clamped_and_parameters_set(backend: str) -> None:
    events = "{from: 3, to: 12, clamp: {(S3 -> B1).g: 0.7}}, {at: 15, set: {tau: 8, w: 1}}"
    network = network_of(events)
    made = network.run(30, backend=backend, states="all")
    g = made["(S1 -> B1).g"].ravel()
    np.testing.assert_array_equal(g[3:12], 0.7)
    np.testing.assert_allclose(g[14], 0.7 * fade(3), rtol=1e-13)
    np.testing.assert_allclose(g[16] / g[14], (1 - 1 / 8 + 1 / 128 - 1 / 3072 + 1 / 98304) ** 2, rtol=1e-12)
    expected = network_of(events.partition("}}, ")[2], shares=False).run(30, backend=backend)
    together = network_of(events.partition("}}, ")[2]).run(30, backend=backend)
    np.testing.assert_allclose(together.activity, expected.activity, rtol=1e-12)
    simulation = Simulation(network.network, backend)
    simulation.clamp("(S2 -> B1).g", 0.4)
    simulation.step()
    assert made["(S1 -> B1).g"].ravel()[0] == 0
    assert value(network.network, simulation.state(), "(S1 -> B1).g") == 0.4


@pytest.mark.parametrize("backend", BACKENDS)
def test_each_line_has_its_share_of_the_signal(backend: str) -> None:
    """By its weight among those of all that lead to a target and are not lesioned; in all backends alike."""
    network = network_of("{at: 8, lesion: S1 -> B1}, {at: 20, lesion: B2}")
    made, expected = (network.run(30, backend=name, states="all") for name in (backend, "reference"))
    np.testing.assert_array_equal(made.states, expected.states)
    shares = np.array([0.3, 0.6, 0.9]) * np.where(np.arange(30)[:, None] < 8, 1, [0, 1, 1])
    found = np.stack([made[f"(S{i} -> B1).signal"].ravel() for i in (1, 2, 3)], axis=1)
    whole = made["(S1 -> B1).g"].reshape(-1, 1)
    np.testing.assert_allclose(found, whole * shares / shares.sum(axis=1, keepdims=True), rtol=1e-13)
    assert made["(S2 -> B2).signal"][:20].any()
    assert not made["(S2 -> B2).signal"][20:].any()
    ring = made["(A1 -> A2).signal"].ravel()
    np.testing.assert_allclose(
        ring, ((made["(A1 -> A2).g"] + made["(A1 -> A2).h"] / 2) * (3 - made["A2.v"])).ravel(), rtol=1e-13
    )


ENDS = """\
neurovis: 1
name: ends
time: {dt: 1 ms, steps: 40}
parameters: {q: 0.2}
models:
  told: {time: ms, parameters: {q: 1}, state: {v: {derivative: (drive - v)/9}}, spike: {when: v >= 1, set: {v: 0}}}
  moves: {time: ms, state: {q: {derivative: (drive - q)/7}}, spike: {when: q >= 1, set: {q: 0.1}}}
  leak: {time: ms, parameters: {part: 0.5}, state: {v: {derivative: (drive - v)/9}}, activity: v}
synapses:
  receptor:
    shared: true
    state: {g: {each_step: 0.8*g, on_pre: g + weight*pre.q + post.part/9}}
    signal: post.part*g
    sign: 0.35 - weight
modules:
  half:
    neurons:
      A: {count: 2, model: {told: {q: [0.1, 0.3]}}, bias: 1.5}
      C: {count: 2, model: moves, bias: 1.7 + i}
      B: {count: 2, model: {leak: {part: 0.5 + i}}}
    connections: {A + C -> B: {weight: 0.1*(1 + i), pattern: all_to_all, synapse: receptor}}
instances: {left: {module: half}, right: {module: half}}
neurons: {P: {model: {told: {q: q}}, bias: 2}}
connections: {P -> left.B + right.B: {weight: 0.4, pattern: all_to_all, synapse: receptor, delay: 0}}
events: [{at: 11, set: {q: 0.9}}]
"""


@pytest.mark.parametrize("backend", ["reference", *BACKENDS])
def test_what_is_added_reads_both_ends(backend: str) -> None:
    """Parameters of the ends, that may be set, and states, also where one name is the one here and the other there."""
    together, each = (nv.compile_text(text) for text in (ENDS, ENDS.replace("shared: true", "shared: false")))
    made, expected = (network.run(40, backend=backend) for network in (together, each))
    assert np.abs(made["left.B1"]).max() > 0.1
    np.testing.assert_allclose(made.activity, expected.activity, rtol=1e-12, atol=1e-14)
    before = nv.compile_text(ENDS[: ENDS.index("events:")]).run(40, backend=backend)
    assert not np.array_equal(made["left.B"], before["left.B"])
    network = together.network
    assert ends_of(network, network.connections.weights.whole()).tolist() == [-1] * 4 + [1, 1, 1, 1, 1, 1, -1, -1] * 2


def test_weights_of_0_share_nothing() -> None:
    network = network_of("{at: 5, set: {w: 0}}")
    simulation = Simulation(network.network, "numpy")
    for _ in range(12):
        simulation.step()
    made = signals_of(network.network, simulation.state(), simulation.connection_weights)
    assert np.isfinite(made).all()
    assert value(network.network, simulation.state(), "(S1 -> B1).g") > 0
    assert not made[:6].any()


def test_a_run_goes_on_from_a_recording(tmp_path: Path) -> None:
    network = network_of()
    whole = network.run(16, states="all")
    network.run(9, states="all").save(tmp_path / "first.npz")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rest = network.run(1, states="all", start=nv.load(tmp_path / "first.npz"))
    np.testing.assert_array_equal(rest["(S1 -> B1).g"].ravel()[0], whole["(S1 -> B1).g"].ravel()[9])


def test_an_edit_that_makes_another_connection_the_first_keeps_what_was_added() -> None:
    source = SimulatedSource(network_of().simulator(backend="numpy"))
    for _ in range(9):
        source.advance()
    text = TEXT.replace("synapses:\n", f"synapses:\n{PLAIN.replace('SHARED', 'shared: true')}")
    text = text.replace("- S -> B:", "- S2..S3 -> B:").replace("(S2 -> B2)", "(S3 -> B2)")
    edited = nv.compile_text(text)
    before = value(source.network, source.leave(), "(S1 -> B1).g")
    after = carried(source, Simulation(edited.network, "numpy"))
    assert value(edited.network, after.leave(), "(S2 -> B1).g") == before > 0


def test_inspect_says_what_is_done_when() -> None:
    program = [" ".join(line.split()) for line in overview(network_of()).splitlines()]
    assert [line for line in program if line.startswith("on_pre ")] == [
        "on_pre A -> A g, h",
        "on_pre S -> B g",
        "on_pre A -> B g, h",
        "on_pre A -> B weight",
    ]


HIDDEN = """\
neurovis: 1
name: hidden
time: {dt: 1 ms, steps: 30}
parameters: {q: 1}
models:
  cell: {time: ms, parameters: {q: 1}, state: {v: {derivative: (drive - v)/9}}, spike: {when: v >= 1, set: {v: 0}}}
synapses:
  receptor:
    shared: true
    time: ms
    parameters: {U: {value: 1, max: 2}}
    state: {g: {derivative: -g/5, on_pre: "g + U*min(weight/pre.q, 2)"}}
    signal: g
neurons: {A: {count: 3, model: {cell: {q: q}}, bias: 1.5}, B: {model: cell}}
connections: {A -> B: {synapse: {receptor: {U: q}}, pattern: all_to_all}}
"""


@pytest.mark.parametrize("backend", ["reference", *BACKENDS])
def test_what_is_undefined_in_what_is_added_is_told_of_the_synapse(backend: str) -> None:
    network = nv.compile_text(f"{HIDDEN}events: [{{at: 12, set: {{q: 0}}}}]\n")
    with pytest.warns(RuntimeWarning, match="the synapse 'receptor' divides by 0 for A1 -> B"):
        network.run(30, backend=backend)
    with pytest.raises(ParameterError, match="the parameter 'U' of a synapse would be above its bound of 2"):
        nv.compile_text(HIDDEN).simulator(backend=backend).set(q=3)
