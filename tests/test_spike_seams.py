"""What spikes beside all that takes a network: exported C, edits of a live run, checkpoints, modules, sweeps."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

import numpy as np
import pytest
from exported import LANGUAGES, exported
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from random_spikes import spiking_specs

import neurovis_spec as nv
from neurovis_spec.arguments import CodedWarning
from neurovis_spec.arrays import FloatArray
from neurovis_spec.live.carry import carried
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.turns import Hold, Set, Turn
from neurovis_spec.runtime import c_export
from neurovis_spec.runtime.npz_file import read_npz
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.state import State

#: groups that fire, one whose activity is something else, inputs of spikes, a synapse and a rule that wait for some
SPEC = """\
neurovis: 1
name: seams
time: {dt: 1 ms, steps: 120, episode: 50}
parameters: {g: 1.5, threshold: 1}
models:
  cell:
    time: ms
    parameters: {tau: {value: 20, unit: ms}, threshold: 1}
    ports: [kick]
    state: {v: {initial: 0.2, derivative: (drive - v)/tau, jump: kick}}
    spike: {when: v >= threshold, set: {v: 0}, refractory: 2 ms, hold: v}
  shown:
    time: ms
    state: {v: {derivative: (drive - v)/5}}
    spike: {when: v >= 1, set: {v: 0}}
    activity: v
inputs:
  train: {spikes: {times: [[0.01, 0.02], [0.03]]}, size: 2}
  rain: {size: 2, poisson: 80}
synapses:
  trace:
    time: ms
    state: {s: {derivative: -s/5, on_pre: s + weight}}
    signal: s*(2 - post.v)
rules:
  pair:
    time: ms
    state: {a: {derivative: -a/20, on_pre: a + 0.1}, b: {derivative: -b/20, on_post: b - 0.1}}
    weight: {on_pre: weight + b, on_post: weight + a}
neurons:
  K: {count: 2, model: {cell: {threshold: threshold}}, bias: [1.3, 1.6], input: {kick: train}}
  H: {count: 2, model: cell, bias: g, input: {kick: rain}}
  P: {count: 2, model: shown, bias: [1.4, 2]}
  O: {count: 2}
connections:
  K -> H: {weight: 0.2, pattern: all_to_all, port: kick, delay: 2 ms, plasticity: pair}
  H -> K: {weight: 0.3, pattern: all_to_all, synapse: trace}
  P -> H: {weight: 0.1, pattern: one_to_one, send: spike, port: kick}
  K -> O: {pattern: one_to_one}
outputs: {out: O, fired: P.spike}
"""
EVENTS = """\
events:
  - {from: 20 ms, to: 24 ms, clamp: {K1: 1}}
  - {at: 10 ms, lesion: [H2, P2]}
  - {at: 60 ms, mend: [H2, P2]}
  - {at: 70 ms, set: {g: 1.9}}
"""
NETWORK = nv.compile_text(SPEC)


def fires_alike(network: nv.CompiledNetwork, folder: Path, language: str = "C99", steps: int = 40) -> None:
    """Activities, weights and who has fired are those of the reference, bit for bit."""
    expected = network.run(steps + 1, backend="reference")
    fired = set(zip(expected.spike_steps.tolist(), expected.spike_neurons.tolist(), strict=True))
    controller = exported(network, folder, language)
    for k in range(steps):
        np.testing.assert_array_equal(controller.weights[network.network.changing], expected.weights[k], f"w[{k}]")
        controller.step()
        np.testing.assert_array_equal(controller.activity, expected.activity[k], f"a[{k}]")
        assert controller.fired() == {neuron for step, neuron in fired if step == k}


@pytest.mark.compiler
@pytest.mark.parametrize(("small", "language"), [(0, "C99"), (600, "C99"), (0, "C++17")])
def test_exported_c_fires_as_the_reference_does(
    small: int, language: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert language in LANGUAGES
    monkeypatch.setattr(c_export, "SMALL", small)
    fires_alike(nv.compile_text(SPEC + EVENTS), tmp_path, language, 100)


@pytest.mark.compiler
@settings(max_examples=6, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=spiking_specs(), small=st.sampled_from([0, 600]))
def test_random_networks_that_spike_run_alike_when_exported(spec: dict[str, object], small: int) -> None:
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        warnings.simplefilter("ignore")
        patch.setattr(c_export, "SMALL", small)
        try:
            network = nv.compile(spec)
        except nv.SpecError:  # a cycle without delay
            return
        fires_alike(network, Path(folder), steps=15)


@pytest.mark.compiler
def test_exported_c_with_numbers_of_32_bits_fires(tmp_path: Path) -> None:
    expected = NETWORK.run(60, backend="reference")
    controller = exported(NETWORK, tmp_path, real="float")
    counts = []
    for _ in range(60):
        controller.step()
        counts.append(len(controller.fired()))
    assert sum(counts) == pytest.approx(len(expected.spike_steps), rel=0.1)
    assert 0 in counts


def test_the_readme_says_what_spikes_take_at_worst(tmp_path: Path) -> None:
    NETWORK.export(tmp_path)
    readme = (tmp_path / "README.md").read_text(encoding="ascii")
    assert "int32_t count = seams_fired(&state, fired);" in readme
    assert "- spikes: 6 neurons may fire; 12 connections of these wait for them" in readme
    quiet = nv.compile_text("neurovis: 1\nname: quiet\nneurons: {O: {count: 2}}\n")
    quiet.export(tmp_path / "quiet")
    assert all("fired" not in path.read_text(encoding="ascii") for path in (tmp_path / "quiet").iterdir())


@pytest.mark.parametrize("seconds", [0.0012, 0.0027])
def test_a_spike_comes_once_where_what_is_sent_arrives_between_steps(seconds: float) -> None:
    """A rule is told of it at the end of a step, as all backends have it."""
    text = """\
neurovis: 1
name: between
time: {dt: 1 ms, steps: 40}
models:
  wave: {time: ms, state: {x: {initial: 0.1, derivative: y + 0.1*drive}, y: {initial: 0.4, derivative: -x}},
         spike: {when: x > 0.2}, activity: x}
rules: {counts: {state: {n: {on_pre: n + 1}}, weight: {on_pre: weight + 1}}}
neurons: {A: {model: wave, bias: 0.3}, B: {model: wave}}
connections: {A -> B: {weight: 0.2, delay: {seconds: SECONDS}, plasticity: counts}}
"""
    network = nv.compile_text(text.replace("SECONDS", str(seconds)))
    runs = [network.run(backend=name, states=["(A -> B).n"]) for name in ("reference", "numpy")]
    delay = round(seconds / 0.001)
    fired = runs[0].spike_steps[runs[0].spike_neurons == 0]
    assert len(fired) > 3
    arrived = [(fired <= k - delay).sum() for k in range(40)]
    for run in runs:
        np.testing.assert_array_equal(run["(A -> B).n"].ravel(), arrived)
    np.testing.assert_array_equal(runs[0].activity, runs[1].activity)


AT_ONCE = """\
neurovis: 1
name: at_once
time: {dt: 1 ms, steps: 12}
models: {cell: {state: {u: {initial: 0.2, each_step: 0.7*u + drive}}, spike: {when: u > 0.5, set: {u: u - 0.4}}}}
synapses: {fades: {state: {g: {each_step: 0.5*g, on_pre: g + weight}}, signal: g/MOST}}
neurons: {A: {model: cell, bias: 1}, B: {}}
connections: {A -> B: {synapse: fades, delay: 0}}
"""


def test_what_spikes_do_at_once_is_done_once_where_a_run_is_checked() -> None:
    """A formula that may be undefined has its run checked, of which the program is made anew."""
    plain, checked = (nv.compile_text(AT_ONCE.replace("MOST", most)) for most in ("1", "(2 - 1/(1 + g))"))
    runs = [network.run(backend="reference", states=["(A -> B).g"]) for network in (plain, checked)]
    assert runs[0]["(A -> B).g"].max() > 0.9
    np.testing.assert_array_equal(runs[0]["(A -> B).g"], runs[1]["(A -> B).g"])


STEPS = 16


@settings(max_examples=12, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=spiking_specs(), cut=st.integers(0, STEPS - 1))
def test_an_edit_of_nothing_and_a_checkpoint_change_nothing(spec: dict[str, object], cut: int) -> None:
    """Who is armed, who rests, what was sent and what is under way go on in the edited network, bit for bit."""
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")
        try:
            network = nv.compile(spec).network
        except nv.SpecError:  # a cycle without delay
            return
        plain, edited = (SimulatedSource(Simulation(network, "numpy")) for _ in range(2))
        plainly, kept = (Simulation(network, "numpy") for _ in range(2))
        for k in range(STEPS):
            if k == cut:
                edited = carried(edited, Simulation(network, "numpy"))
                plainly.save_state(Path(folder) / "kept.npz")
                kept.restore(Path(folder) / "kept.npz")
            for one in (plain, edited):
                one.advance()
            plainly.step()
            if k >= cut:
                kept.step()
            np.testing.assert_array_equal(edited.seen().snapshot.activity, plain.seen().snapshot.activity)
            np.testing.assert_array_equal(edited.seen().snapshot.weights, plain.seen().snapshot.weights)
        alike(plainly.state(), kept.state())


def alike(one: State, other: State) -> None:
    """All numbers are the same."""
    for name in ("activity", "outlets", "weights", "signals", "history"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)
    for owner, cells in one.cells.items():
        for name, values in cells.items():
            np.testing.assert_array_equal(values, other.cells[owner][name], name)


def seen_by(source: SimulatedSource, steps: int, turns: dict[int, Turn]) -> dict[int, FloatArray]:
    """The activities of steps, with turns at some."""
    seen = {}
    for _ in range(steps):
        source.advance()
        if source.step in turns:
            source.turn(turns[source.step])
        seen[source.step] = source.seen().snapshot.activity.copy()
    return seen


def test_the_live_view_goes_back_over_spikes_and_on() -> None:
    turns: dict[int, Turn] = {30: Hold("K1", 1), 40: Set({"g": 2})}
    source = SimulatedSource(nv.compile_text(SPEC + EVENTS).simulator(backend="numpy"))
    seen = seen_by(source, 100, turns)
    for step in (99, 33, 12, 66, 30, 100):
        source.go(step)
        np.testing.assert_array_equal(source.seen().snapshot.activity, seen[step])


@pytest.mark.parametrize("at", [3, 20, 42])
def test_an_edit_goes_on_with_who_is_armed_and_who_rests(at: int) -> None:
    """Neurons of the same name fire on as they would: another group stands before them, and one is no more."""
    edited = SPEC.replace("neurons:\n", "neurons:\n  First: {count: 3, model: cell, bias: 1.1}\n").replace(
        "  K -> O: {pattern: one_to_one}\n", ""
    )
    source = SimulatedSource(NETWORK.simulator(backend="numpy"))
    seen_by(source, at, {})
    other = carried(source, nv.compile_text(edited).simulator(backend="numpy"))
    expected = NETWORK.run(at + 20, backend="reference")
    seen = seen_by(other, 20 - 1, {})
    for step, activity in seen.items():
        np.testing.assert_array_equal(activity[3:9], expected.activity[step, :6])


def test_an_edit_may_make_neurons_fire_and_stop_that() -> None:
    fires = """\
neurovis: 1
name: e
time: {dt: 1 ms}
models: {m: {time: ms, state: {v: {derivative: (drive - v)/9}}, BLOCK}}
neurons: {A: {model: m, bias: 2}}
"""
    without = fires.replace("BLOCK", "activity: v")
    block = fires.replace("BLOCK", "spike: {when: v >= 1, set: {v: 0}, refractory: 3, hold: v}")
    source = SimulatedSource(nv.compile_text(without).simulator(backend="numpy"))
    assert max(seen_by(source, 40, {})[40]) > 1.9
    firing = carried(source, nv.compile_text(block).simulator(backend="numpy"))
    spikes = [step for step, activity in seen_by(firing, 30, {}).items() if activity[0]]
    assert len(spikes) > 2
    silent = carried(firing, nv.compile_text(without).simulator(backend="numpy"))
    assert len(set(np.concatenate([*seen_by(silent, 20, {}).values()]))) == 20


def test_modules_sweeps_and_texts_take_spikes(tmp_path: Path) -> None:
    """Groups that fire within instances, swept over a parameter of the block; the text says the same again."""
    text = """\
neurovis: 1
name: halves
time: {dt: 1 ms, steps: 200}
models:
  cell:
    time: ms
    parameters: {tau: 10, threshold: 1}
    ports: [kick]
    state: {v: {derivative: (drive - v)/tau, jump: kick}}
    spike: {when: v >= threshold, set: {v: 0}, refractory: 1 ms}
modules:
  half:
    parameters: {high: 1}
    neurons: {E: {count: 2, model: {cell: {threshold: high}}, bias: [1.5, 2]}}
instances: {left: {module: half, set: {high: 1.2}}, right: {module: half}}
connections: {left.E -> right.E: {weight: 0.3, port: kick, pattern: one_to_one}}
"""
    network = nv.compile_text(text)
    runs = [network.run(backend=name) for name in ("reference", "numpy")]
    np.testing.assert_array_equal(runs[0].activity, runs[1].activity)
    assert len(runs[0].spikes("right.E").times) > len(runs[0].spikes("left.E").times) > 0
    assert nv.compile_text(network.text()).hash == network.hash
    (tmp_path / "swept.yaml").write_text(SPEC, encoding="utf-8")
    table = nv.sweep(tmp_path / "swept.yaml", {"threshold": [0.8, 1.2]}, {"often": "rate(K, last=100)"}, jobs=1)
    first, second = (float(str(cell)) for cell in table["often"])
    assert first > second > 0


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_a_run_goes_on_from_a_recording_with_all_states(backend: str, tmp_path: Path) -> None:
    """Who is armed, who rests, and what is under way, of what flows and of what does not; else it begins anew."""
    text = """\
neurovis: 1
name: on
time: {dt: 1 ms, steps: 40}
models:
  cell:
    time: ms
    ports: [kick]
    state: {v: {derivative: (drive - v)/5, jump: kick}}
    spike: {when: v >= 1, set: {v: 0}, refractory: 4, hold: v}
  map: {state: {u: {each_step: 0.7*u + drive}}, spike: {when: u > 0.5}, activity: u, send: spike}
neurons: {A: {count: 3, model: cell, bias: 1.5 + i/3}, B: {count: 2, model: map, bias: 0.2 - i/9}}
connections:
  A -> B: {weight: -0.9, pattern: all_to_all, delay: 3}
  B -> A: {weight: 1, port: kick, pattern: all_to_all}
"""
    only_map = text.replace("A: {count: 3, model: cell, bias: 1.5 + i/3}, ", "")
    for spec in (text, only_map[: only_map.index("connections")]):
        network = nv.compile_text(spec)
        whole = network.run(30, backend=backend, states="all")
        for cut in (6, 13, 17):
            network.run(cut, backend=backend, states="all").save(tmp_path / f"{cut}.npz")
            first = read_npz(tmp_path / f"{cut}.npz")
            rest = network.run(30 - cut, backend=backend, states="all", start=first)
            np.testing.assert_array_equal(rest.states, whole.states[cut:])
            np.testing.assert_array_equal(rest.activity, whole.activity[cut:])
        with pytest.warns(CodedWarning, match=r"lacks states (with a derivative|of neurons that fire), as of [AB]1"):
            network.run(3, backend=backend, start=network.run(5, backend=backend))


def test_all_states_tell_who_is_armed_and_how_long_who_rests() -> None:
    """As the manual has it: 1 more than the steps for which a neuron cannot fire yet, 0 behind these."""
    run = nv.compile_text(SPEC).run(backend="reference", states="all")
    fired, rests = run["K1.spike"].ravel(), run["K1.rests for"].ravel()
    assert fired.sum() > 3
    expected = np.zeros(len(fired))
    for step in np.flatnonzero(fired).tolist():
        behind = expected[step : step + 3]
        behind[:] = [3, 2, 1][: len(behind)]
    assert rests.tolist() == expected.tolist()
    assert {"K1.is armed", "K1.rests for"} <= set(run.state_names)


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_who_fires_is_held_at_whole_spikes(backend: str) -> None:
    """Of a neuron whose activity is its potential, as of one whose activity is the spike."""
    text = """\
neurovis: 1
name: held
time: {dt: 0.1 ms}
models: {cell: {time: ms, state: {v: {derivative: -v/20}}, spike: {when: v >= 1, set: {v: 0}}, activity: v}}
neurons: {A: {model: cell}, B: {}}
connections: {A -> B: {send: spike, weight: 2}}
events: [{from: 2, to: 4, clamp: {A.spike: 0.5}}]
"""
    assert nv.compile_text(text).run(7, backend=backend)["B"].tolist() == [0, 0, 0, 2, 2, 0, 0]
