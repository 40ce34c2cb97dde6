"""States of models and rules, and partial recordings: what is kept of a step, and how it is read again (§12, §14)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.turns import Set
from neurovis_spec.runtime.c_backend import CStepper
from neurovis_spec.runtime.c_package import files
from neurovis_spec.runtime.c_settable import ExportError
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.recording import Recording

SPEC = """\
neurovis: 1
name: states
time: {steps: 30, episode: 10}
inputs: {reward: {expression: sin(k)}}
modules:
  leg:
    neurons: {K: {count: 2, model: {adaptive: {}}, bias: 1 + i}}
neurons:
  A: {count: 3, model: leaky_integrator, bias: 1 + i, activation: tanh}
  R: {input: reward}
  O: {}
instances: {left: {module: leg, count: 2}}
connections:
  - A -> O: {weight: 0.1, plasticity: {reward_modulated: {policy: R, reward: R}}}
  - A1 -> O: {weight: 0.2, delay: 2, plasticity: {reward_modulated: {policy: R, reward: R}}}
  - left.K -> O: 0.3
outputs: {membrane: A.v, one: A2.v, tired: left.K.b, trace: (A -> O).eligibility, signal: O}
"""
WANTED = ["left1.K.v", "(A2 -> O).baseline"]


@pytest.fixture(scope="module")
def network() -> nv.CompiledNetwork:
    return nv.compile_text(SPEC)


def test_a_state_is_that_after_the_step(network: nv.CompiledNetwork) -> None:
    """Against plain loops over the equations of the library."""
    recording = network.run(states=WANTED)
    k = np.arange(1, 31.0)
    assert recording["A.v"].shape == (30, 3)
    np.testing.assert_allclose(recording["A2.v"], 2 * (1 - 0.9**k), rtol=1e-12)
    np.testing.assert_allclose(recording["A"], np.tanh(recording["A.v"]), rtol=1e-12)
    v, b = [0.0], [0.0]
    for _ in range(30):
        v, b = [*v, 0.9 * v[-1] + 0.1 * (2 - b[-1])], [*b, 0.99 * b[-1] + 0.01 * max(v[-1], 0)]
    np.testing.assert_allclose(recording["left1.K2.v"], v[1:], rtol=1e-12)
    np.testing.assert_allclose(recording["left2.K2.b"], b[1:], rtol=1e-12)
    reward, post, arrived = np.sin(np.arange(30.0)), recording["O"], np.vstack([np.zeros(3), recording["A"][:-1]])
    eligibility = np.zeros((30, 3))
    for step in range(30):
        if (step + 1) % 10:
            added = reward[step] * arrived[step] * (reward[step] - post[step])
            eligibility[step] = (eligibility[step - 1] if step else 0) + added
    traces = recording["(A -> O).eligibility"][:, :3]
    np.testing.assert_allclose(traces, eligibility, rtol=1e-12, atol=1e-15)
    assert traces.any()
    assert np.array_equal(recording["membrane"], recording["A.v"])
    assert recording["one"].shape == (30,)
    assert np.array_equal(recording["tired"][:, 0], recording["left1.K1.b"])
    assert np.array_equal(recording["left1.K.v"][:, 1], recording["left1.K2.v"])
    assert recording["(A2 -> O).baseline"].shape == (30,)
    assert recording["(A1 -> O).eligibility"].shape == (30, 2)
    assert "(A1 -> O (2)).eligibility" in recording


def test_the_reference_gives_the_same_states(network: nv.CompiledNetwork) -> None:
    one, other = (network.run(states=WANTED, backend=name) for name in ("numpy", "reference"))
    assert one.state_names == other.state_names
    assert np.allclose(one.states, other.states, rtol=1e-12, atol=1e-12)


def test_outputs_of_a_step_are_states(network: nv.CompiledNetwork) -> None:
    simulation, recording = network.simulator(), network.run()
    for k in range(12):
        out = simulation.step()
        for name in ("membrane", "one", "tired", "trace", "signal"):
            assert np.array_equal(out[name], recording[name][k])
    assert np.shape(out["one"]) == ()
    assert np.shape(out["trace"]) == (4,)


@pytest.mark.parametrize("suffix", ["npz", "csv"])
@pytest.mark.parametrize("streamed", [False, True])
def test_states_come_back_from_a_file(network: nv.CompiledNetwork, tmp_path: Path, suffix: str, streamed: bool) -> None:
    path, made = tmp_path / f"x.{suffix}", network.run(states=WANTED)
    if streamed:
        network.run_to(path, states=WANTED)
    else:
        made.save(path)
    again = nv.load(path)
    assert again.state_names == made.state_names
    assert np.array_equal(again.states, made.states)
    for name in ("A.v" if suffix == "npz" else "A1.v", "left1.K1.b", *WANTED[1:]):
        assert np.array_equal(again[name], made[name])
    assert np.array_equal(again.activity, made.activity)
    assert np.array_equal(again.weights, made.weights)


def test_a_neuron_of_an_instance_is_no_state() -> None:
    text = SPEC.replace("neurons: {K: {count", "neurons: {v: {bias: 1}, K: {count") + "layout: {}\n"
    network = nv.compile_text(text.replace("signal: O", "signal: left1.v"))
    assert network.run(2)["signal"].shape == (2,)
    with pytest.raises(KeyError, match="no state"):
        network.run(2, states=["left1.v"])


@pytest.mark.parametrize(
    ("reference", "words"),
    [
        ("A.w", "its states are: v"),
        ("O.v", "has no states"),
        ("Q.v", "no neuron, group or output 'Q'"),
        ("A", "is no state"),
        ("(R -> O).x", "no connection"),
        ("(left.K -> O).x", "no rule changes"),
        ("(A -> O).x", "eligibility, baseline"),
        ("A..v", "is no state"),
    ],
)
def test_an_unknown_state_is_refused_in_words(network: nv.CompiledNetwork, reference: str, words: str) -> None:
    with pytest.raises(KeyError, match=words.replace("(", "\\(")):
        network.run(2, states=[reference])


def test_what_watches_over_a_division_is_no_state() -> None:
    """Whoever asks for a state that is not there is told of those that are, and of no cell of ours among them."""
    text = """\
neurovis: 1
name: divided
time: {dt: 0.1}
models:
  m: {state: {v: {derivative: 1/(1 + drive) - v}}, outputs: {twice: 2*v}, activity: "clip(1/drive, -1, 1)"}
neurons: {A: {model: m, bias: 1}}
"""
    network = nv.compile_text(text)
    with pytest.raises(KeyError) as wrong:
        network.run(2, states=["A.w"])
    assert "its states and outputs are: v, twice" in str(wrong.value)
    assert "divides" not in str(wrong.value)


def test_weights_are_asked_for_by_their_own_name(network: nv.CompiledNetwork) -> None:
    with pytest.raises(KeyError, match=r"weight\('A -> B'\) gives the weight of a connection"):
        network.run(2)["A1 -> O"]


@pytest.mark.parametrize("name", ["(A2 -> O).eligibility", "(A1 -> O (2)).baseline", "left2.K1.b"])
def test_a_measure_names_the_state_of_a_rule_as_that_of_a_model(network: nv.CompiledNetwork, name: str) -> None:
    recording = network.run(30, states=[name])
    expected = recording[name].ravel()
    assert len(set(expected.tolist())) > 3
    np.testing.assert_array_equal(network.measure(f"2*{name} + k", recording), 2 * expected + np.arange(30.0))
    level = float(np.sort(np.abs(expected))[20])
    first = int(np.flatnonzero(np.abs(expected) >= level)[0])
    until = network.until(f"max(abs({name}), last=1) >= {level!r}")
    assert len(network.run(30, until=until)) == first + 1


def test_a_measure_of_several_states_is_told_to_name_one(network: nv.CompiledNetwork) -> None:
    with pytest.raises(nv.SpecError, match=r"'\(A -> O\).baseline' is 4 states, and no single one"):
        network.until("(A -> O).baseline > 0")


def test_a_state_that_was_not_recorded_is_said(network: nv.CompiledNetwork) -> None:
    recording = network.run(2)
    with pytest.raises(KeyError, match=r"'left1.K.v' was not recorded"):
        recording["left1.K.v"]
    assert "left1.K.v" not in recording
    assert "A.v" in recording


def partial(network: nv.CompiledNetwork, tmp_path: Path, suffix: str = "npz") -> Recording:
    path = tmp_path / f"partial.{suffix}"
    network.run_to(path, every=10, neurons="O + A1..A2", weights="none", states=["A3.v"])
    return nv.load(path)


def test_a_partial_recording_knows_what_it_holds(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    whole, part = network.run(), partial(network, tmp_path)
    with np.load(tmp_path / "partial.npz") as file:
        assert file["recorded"].tolist() == [0, 1, 4]
        assert file["activity"].shape == (3, 3)
        assert file["neurons"].tolist() == list(whole.neurons)
        assert file["weights"].shape == (3, 0)
        assert len(file["plastic"]) == 4 == len(file["weights_after"])
    assert part.neurons == whole.neurons
    assert part.step.tolist() == [0, 10, 20]
    for name in ("O", "A1..A2", "A2 + O", "A3.v", "membrane"):
        assert np.array_equal(part[name], whole[name][::10])
    for name, told in (("A", "A3 was"), ("A3", "A3 was"), ("left1.K", "left1.K1, left1.K2 were")):
        with pytest.raises(KeyError, match=rf"{told} not recorded.*holds A1, A2, O"):
            part[name]
    with pytest.raises(KeyError, match="weight 'A1 -> O' was not recorded"):
        part.weight("A1 -> O")
    assert part.weight("left1.K1 -> O").shape == (3,)
    assert "svg" in part._repr_svg_()


def test_a_partial_recording_in_memory_is_that_of_the_file(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    part = partial(network, tmp_path)
    made = network.run(every=10, neurons=["O", "A1..A2"], weights="none", states=["A3.v"])
    assert np.array_equal(part.activity, made.activity)
    assert np.array_equal(part.states, made.states)
    assert partial(network, tmp_path, "csv")["A1"].shape == (3,)


def test_nothing_goes_on_from_or_draws_a_partial_recording(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    part = partial(network, tmp_path)
    with pytest.raises(RecordingError, match=r"go on from a partial recording: it lacks the activities of A3, R"):
        network.run(start=part)
    with pytest.raises(RecordingError, match=r"lacks the activities .* and the changing weights"):
        network.render(tmp_path / "x.svg", recording=part)
    with pytest.raises(RecordingError, match="lacks the changing weights"):
        network.animate(tmp_path / "x.svg", recording=network.run(5, weights="none"))


def test_every_neuron_named_is_a_whole_recording(network: nv.CompiledNetwork) -> None:
    recording = network.run(2, neurons="A + R + O + left.K")
    assert recording.missing is None
    assert recording.recorded is None
    assert network.run(start=recording, steps=2).step.tolist() == [0, 1]


def test_the_command_records_and_shows_states(tmp_path: Path) -> None:
    spec = tmp_path / "x.yaml"
    spec.write_text(SPEC, encoding="utf-8")
    run = [*("run", str(spec)), "--states", "left1.K.v", "--states", "(A -> O).baseline"]
    shown = CliRunner().invoke(neurovis, run)
    assert shown.exit_code == 0
    assert "left1.K.v" in shown.stdout
    assert "membrane" in shown.stdout
    made = CliRunner().invoke(neurovis, [*run, "-o", str(tmp_path / "x.npz"), "--neurons", "O", "--weights", "none"])
    assert made.exit_code == 0
    assert nv.load(tmp_path / "x.npz")["left1.K.v"].shape == (30, 2)
    wrong = CliRunner().invoke(neurovis, ["run", str(spec), "--states", "A.w"])
    assert wrong.exit_code == 1
    assert "its states are: v" in wrong.stderr
    told = CliRunner().invoke(neurovis, ["inspect", str(spec)])
    assert "A1.v" in told.stdout


def test_the_hash_knows_which_state_an_output_names() -> None:
    first = nv.compile_text(SPEC).hash
    assert first != nv.compile_text(SPEC.replace("tired: left.K.b", "tired: left.K.v")).hash
    assert first == nv.compile_text(SPEC.replace("membrane: A.v", "membrane: [A1.v, A2..A3.v]")).hash


FLOW = """neurovis: 1
name: flow
time: {dt: 0.01, steps: 30}
parameters: {g: 1}
models:
  cell:
    time: ms
    parameters: {tau: 20, gain: 2}
    ports: [more]
    state: {v: {initial: 0.5, derivative: (gain*drive + more - v)/tau}, n: {initial: 0, each_step: n + 1}}
    outputs: {c: 2*v}
    activity: v
modules:
  leg: {parameters: {own: 1}, neurons: {K: {model: {cell: {gain: own}}, bias: 1}}}
neurons: {K: {count: 2, model: {cell: {gain: [g, 3*g]}}, bias: 1}, O: {}}
instances: {left: {module: leg, set: {own: g}}}
connections: {K -> O: {weight: 1, send: c}}
outputs: {o: K.c, w: O}
"""


@pytest.fixture(scope="module")
def flow() -> nv.CompiledNetwork:
    return nv.compile_text(FLOW)


def test_outputs_and_states_that_flow_are_recorded_as_states_are(flow: nv.CompiledNetwork, tmp_path: Path) -> None:
    made = flow.run(states="all")
    assert set(made.state_names) == {f"{name}.{state}" for name in ("K1", "K2", "left.K") for state in "vnc"}
    np.testing.assert_array_equal(made["K.v"], made["K"])
    np.testing.assert_array_equal(made["o"], 2 * made["K.v"])
    for suffix in ("npz", "csv", "mcap"):
        flow.run_to(tmp_path / f"all.{suffix}", states="all")
        again = nv.load(tmp_path / f"all.{suffix}")
        assert set(again.state_names) == set(made.state_names)
        for name in made.state_names:
            np.testing.assert_array_equal(again[name], made[name])
    simulation = flow.simulator()
    for row in made["o"][:5]:
        np.testing.assert_array_equal(simulation.step()["o"], row)
    np.testing.assert_array_equal(flow.measure("max(K2.c, last=1)", made), made["K2.c"])
    asked = flow.run(states=["left.K.c", "K1.v"])
    assert asked.state_names == ("K1.c", "K2.c", "left.K.c", "K1.v")


def test_outputs_and_states_that_flow_are_drawn_as_traces(flow: nv.CompiledNetwork, tmp_path: Path) -> None:
    flow.render(tmp_path / "a.svg", view={"traces": ["K.c", "left.K.v"]})
    drawn = (tmp_path / "a.svg").read_text()
    assert all(name in drawn for name in ("K1.c", "K2.c", "left.K.v"))


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_a_slider_reaches_parameters_within_derivatives_at_once(backend: str) -> None:
    """Those of a definition that follow one of the spec, each by itself, and those of an instance."""
    flow = nv.compile_text(FLOW)
    by_event = nv.compile_text(FLOW + "events: [{at: 6, set: {g: 5}}]\n").run(12, backend=backend)
    source = SimulatedSource(flow.simulator(backend))
    while source.step < 5:
        source.advance()
    source.turn(Set({"g": 5.0}))
    for step in (6, 7, 8):
        source.advance()
        np.testing.assert_array_equal(source.seen().snapshot.activity, by_event.activity[step])
    source.go(3)
    np.testing.assert_array_equal(source.seen().snapshot.activity, by_event.activity[3])
    source.go(8)
    np.testing.assert_array_equal(source.seen().snapshot.activity, by_event.activity[8])
    assert (by_event.activity[6, :2] > flow.run(12, backend=backend).activity[6, :2]).all()


@pytest.mark.compiler
@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize("until", [None, "O > 0.4"])
def test_a_run_in_c_keeps_states_as_one_step_by_step_does(every: int, until: str | None) -> None:
    """Many steps a call, with events between them, a measure that ends it, and from a recording on."""
    events = "events:\n  - {at: 7, set: {g: 2}}\n  - {from: 12, to: 20, clamp: {A2: 0.3}}\n  - {at: 16, lesion: A3}\n"
    spec = SPEC.replace("bias: 1 + i, act", "bias: g + i, act") + "parameters: {g: 1}\n" + events
    network = nv.compile_text(spec)
    wanted = network.run(states=WANTED, backend="reference", every=every, until=until)
    made = network.run(states=WANTED, backend="c", every=every, until=until)
    assert made.state_names == wanted.state_names
    assert made.step.tolist() == wanted.step.tolist()
    assert (len(made) < len(network.run(every=every))) == (until is not None)
    for of in ("activity", "weights", "states"):
        assert getattr(made, of).tobytes() == getattr(wanted, of).tobytes(), of
    further = [network.run(9, states=WANTED, backend=backend, start=made) for backend in ("reference", "c")]
    assert further[0].states.tobytes() == further[1].states.tobytes()


@pytest.mark.compiler
def test_a_run_in_c_makes_many_steps_a_call_where_states_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(CStepper, "step", refuse)
    assert len(nv.compile_text(SPEC).run(states=WANTED, backend="c")) == 30


SIGNALS = """neurovis: 1
name: signals
time: {dt: 0.1, steps: 8}
parameters: {g: 0.5}
models: {m: {state: {v: {derivative: drive - v}}, activity: v}}
synapses: {gap: {signal: weight*(pre.v - post.v)}}
neurons: {A: {count: 2, model: m, initial: {v: i + 1}}, B: {model: m}}
connections:
- A -> B: {weight: g, synapse: gap, plasticity: hebbian}
- B -> A1: 1
"""


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_signals_of_synapses_are_asked_for_as_states_are(backend: str) -> None:
    """By outputs, of runs and of single steps; by --states, where weights are left out; by measures."""
    network = nv.compile_text(SIGNALS + "outputs: {both: (A -> B).signal, one: (A2 -> B).signal}\n")
    run, plain = network.run(backend=backend), nv.compile_text(SIGNALS).run(backend=backend, states=["all"])
    signals = plain["(A -> B).signal"]
    np.testing.assert_array_equal(signals, plain.weights * (plain["A.v"] - plain["B.v"][:, None]))
    np.testing.assert_array_equal(run["both"], signals)
    simulation = network.simulator(backend=backend)
    assert np.isnan(simulation.outputs["one"])
    steps = [dict(simulation.step()) for _ in range(8)]
    np.testing.assert_array_equal([step["both"] for step in steps], signals)
    np.testing.assert_array_equal([step["one"] for step in steps], run["one"])
    simulation.reset()
    assert simulation.step()["one"] == run["one"][0]
    few = network.run(backend=backend, weights="none", states=["(A1 -> B).signal"])
    np.testing.assert_array_equal(few["(A1 -> B).signal"], signals[:, 0])


def test_a_sweep_measures_signals_of_synapses(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(SIGNALS + "outputs: {one: (A2 -> B).signal}\n")
    one = nv.compile_text(SIGNALS).run()["(A2 -> B).signal"]
    metrics = {"last": "(A2 -> B).signal", "mean": "mean(one)"}
    table = nv.sweep(tmp_path / "spec.yaml", {"g": [0.5]}, metrics, jobs=1)
    assert [table[name][0] for name in metrics] == pytest.approx([one[-1], one.mean()], rel=1e-9)


def test_where_signals_of_synapses_are_not_formed_it_is_told() -> None:
    network = nv.compile_text(SIGNALS + "outputs: {one: (A2 -> B).signal}\n")
    with pytest.raises(nv.SpecError, match="a signal of a synapse is formed where it is recorded, not at each step"):
        network.until("one > 0")
    with pytest.raises(ExportError, match="the output 'one' is of signals of synapses, which exported C does not"):
        files(network.network)
    with pytest.raises(nv.SpecError, match="no rule changes 'B -> A1', so it has no states"):
        nv.compile_text(SIGNALS + "outputs: {none: (B -> A1).signal}\n")
