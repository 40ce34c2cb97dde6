"""Runs that end at the first step after which a measure is true."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from test_runtime_backends import parts

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.runtime.c_backend import CStepper
from neurovis_spec.runtime.checkpoint import load_state
from neurovis_spec.runtime.recording import Recording

SPEC = """\
neurovis: 1
name: ramp
time: {steps: 600}
parameters: {slope: 0.01}
inputs: {rise: {expression: slope*k}}
neurons: {A: {input: rise}, B: {}}
connections: {A -> B: {weight: 0, delay: 0, plasticity: {hebbian: {rate: 0.001}}}}
outputs: {signal: A}
events: [{at: 300, set: {slope: 0.02}}]
"""
MEAN = "mean(signal, last=5) >= 1"  # of 0.01·(k − 2): from k = 102 on
FIRST = 102
BACKENDS = ["numpy", "reference", pytest.param("c", marks=pytest.mark.compiler)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "ramp.yaml").write_text(SPEC)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*arguments: object) -> Result:
    result = CliRunner().invoke(neurovis, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_run_ends_at_the_first_step_after_which_it_is_true(backend: str) -> None:
    network = nv.compile_text(SPEC)
    until = network.until(MEAN)
    recording = network.run(until=until, backend=backend)
    whole = network.run(backend=backend)
    assert network.measure(MEAN, whole).tolist().index(1.0) == FIRST
    assert recording.step.tolist() == list(range(FIRST + 1))
    assert recording.reached == FIRST + 1
    np.testing.assert_array_equal(recording.activity, whole.activity[: FIRST + 1])
    np.testing.assert_array_equal(recording.weights, whole.weights[: FIRST + 1])
    np.testing.assert_array_equal(recording.weights_after, whole.weights[FIRST + 1])
    ending = until.ending
    assert ending is not None
    assert (ending.step, ending.met) == (FIRST, True)
    assert ending.values == {"mean(signal, last=5)": pytest.approx(1.0)}


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("every", [1, 7])
def test_states_are_recorded_up_to_there(every: int, backend: str) -> None:
    """Of connections too, and with many steps by a call."""
    rule = "rules: {drift: {state: {p: {each_step: 0.9*p + pre}, q: {each_step: q + post}}, weight: {each_step: p}}}\n"
    model = "models: {m: {state: {v: {initial: 1, each_step: 0.9*v + 0.1*drive}}, activity: v}}\n"
    text = SPEC.replace("B: {}", "B: {model: m, count: 2}").replace("hebbian: {rate: 0.001}", "drift: {}")
    network = nv.compile_text(text.replace("{weight: 0,", "{weight: 0, pattern: all_to_all,") + rule + model)
    recording = network.run(until=MEAN, backend=backend, every=every, states=["all"])
    whole = network.run(backend="reference", states=["all"])
    rows = slice(0, FIRST + 1, every)
    assert recording.states.shape[1] == 6
    for part in ("step", "activity", "weights", "states"):
        np.testing.assert_allclose(getattr(recording, part), getattr(whole, part)[rows], rtol=1e-12, err_msg=part)


@pytest.mark.parametrize("name", ["x.npz", "x.csv"])
@pytest.mark.parametrize("every", [1, 7])
def test_a_streamed_run_ends_there_too(folder: Path, name: str, every: int) -> None:
    network = nv.compile("ramp.yaml")
    network.run_to(name, until=MEAN, every=every)
    network.run(until=MEAN, every=every).save(f"whole_{name}")
    read, kept = nv.load(name), nv.load(f"whole_{name}")
    assert read.step.tolist() == list(range(0, FIRST + 1, every))
    np.testing.assert_array_equal(read.activity, kept.activity)
    np.testing.assert_array_equal(read.weights_after, kept.weights_after)
    assert read.reached == kept.reached


def test_a_measure_is_false_before_its_windows_are_full() -> None:
    network = nv.compile_text(SPEC)
    assert network.run(until="min(A, last=50) > -1").reached == 50
    assert network.run(until="min(A, last=50) > -1 or k > 20").reached == 50
    assert network.run(until="k >= 0").reached == 1
    assert network.run(until="A - A / 0 != 0 and k > 3").reached == 5, "NaN is true, as everywhere, and of no harm"


def test_the_parameters_are_those_of_the_step() -> None:
    assert nv.compile_text(SPEC).run(until="slope > 0.015").reached == 301


def test_a_run_that_goes_on_from_a_checkpoint_counts_on(folder: Path) -> None:
    """``k`` and the parameters are those of the whole run; the windows begin with the part."""
    network = nv.compile("ramp.yaml")
    whole = network.run()
    for begin in (100, 350):
        network.run(begin, checkpoint="x.state")
        until = network.until(f"k >= {begin + 20} and slope == {0.01 if begin == 100 else 0.02}")
        part = network.run(200, until=until, checkpoint="x.state")
        assert part.step.tolist() == list(range(begin, begin + 21))
        assert until.ending is not None
        assert (until.ending.step, until.ending.made, until.ending.met) == (begin + 20, 21, True)
        found = network.measure("mean(A, last=3) + slope + t", part)
        np.testing.assert_allclose(found[2:], network.measure("mean(A, last=3) + slope + t", whole)[begin + 2 :][:19])
        (folder / "x.state").unlink()
    result = call("run", "ramp.yaml", "--steps", 100, "--checkpoint", "x.state")
    result = call("run", "ramp.yaml", "--checkpoint", "x.state", "--until", "k >= 120")
    assert result.stderr == "until k >= 120: ended at step 120\n"
    assert result.stdout.startswith("ramp: 21 steps in ")


def test_a_run_can_be_used_again() -> None:
    network = nv.compile_text(SPEC)
    until = network.until(MEAN)
    for _ in range(2):
        assert network.run(until=until).reached == FIRST + 1
        assert network.run(steps=FIRST, until=until).reached == FIRST
        assert until.ending is not None
        assert (until.ending.step, until.ending.met) == (FIRST - 1, False)


def test_the_command_says_at_which_step_it_ended_and_why(folder: Path) -> None:
    result = call("run", "ramp.yaml", "--until", MEAN)
    assert result.exit_code == 0
    assert result.stderr == f"until {MEAN}: ended at step 102: mean(signal, last=5) is 1\n"
    assert result.stdout.startswith("ramp: 103 steps in ")
    assert "outputs at step 102:" in result.stdout
    result = call("run", "ramp.yaml", "--until", MEAN, "-o", "x.npz")
    assert (result.exit_code, result.stderr.count("ended at step 102")) == (0, 1)
    assert result.stdout.startswith("x.npz: 103 steps in ")
    result = call("run", "ramp.yaml", "--until", "A > 100")
    assert (result.exit_code, result.stderr) == (0, "until A > 100: still false at the last step, 599\n")


@pytest.mark.parametrize(
    ("text", "code", "place", "words"),
    [
        ("mean(sginal, last=5) > 1", "unknown-name", "<until>:1:6:", "did you mean 'signal'?"),
        ("1 < mean(A)", "bad-window", "<until>:1:5:", "needs the number of steps"),
        ("mean(A, last=601) > 0", "bad-window", "<until>:1:1:", "the last 601 steps of a run of 600"),
        ("A >\n 1 +", "missing-operand", "<until>:1:8:", ""),
    ],
)
def test_a_mistake_is_answered_with_its_place(folder: Path, text: str, code: str, place: str, words: str) -> None:
    before = sorted(folder.iterdir())
    result = call("run", "ramp.yaml", "--until", text, "-o", "x.npz")
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr.startswith(f"{place} error[{code}]: ")
    assert "^" in result.stderr
    assert words in result.stderr
    assert sorted(folder.iterdir()) == before


@pytest.mark.compiler
@pytest.mark.parametrize("every", [1, 7])
@pytest.mark.parametrize(
    "measure",
    [
        "rms(rhythm - goal, last=5) < 0.02",
        "max(abs(A), last=3) - min(A, last=40) > 0.3 and k > 517",
        "exp(A) > 1.2 and k >= 33",
        "k >= 520",
        "k >= 1400",
        "A > 1e9",
    ],
)
def test_it_ends_in_c_where_it_ends_step_by_step_and_goes_on_alike(
    measure: str, every: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blocks of steps, and an end within one: all of the state is that of the last step, noise and delays included."""
    spec = """
neurovis: 1
name: noisy
seed: 4
parameters: {gain: 0.9}
inputs: {goal: {expression: "0.4*sin(k/7)"}}
neurons:
  A: {bias: 0.1, noise: "normal(0, 0.2)", model: {leaky_integrator: {leak: 0.3}}, activation: tanh}
  B: {input: goal}
connections:
  A -> A: {weight: gain, delay: 3}
  B -> A: {weight: 0.2, delay: 2, plasticity: {oja: {rate: 0.01}}}
outputs: {rhythm: A, goal: B}
events: [{at: 515, set: {gain: 0.5}}]
"""
    network, calls, files = nv.compile_text(spec), [], []
    run = CStepper.run

    def counted(stepper: CStepper, *given: object) -> object:
        calls.append(1)
        return run(stepper, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(CStepper, "run", counted)
    monkeypatch.setattr(CStepper, "step", lambda *_: pytest.fail("step by step")) if "exp" not in measure else None
    runs, ends = [], []
    for backend in ("reference", "c"):
        until, checkpoint = network.until(measure), tmp_path / f"{backend}.npz"
        runs.append(network.run(1500, until=until, backend=backend, every=every, checkpoint=checkpoint))
        ends.append(until.ending)
        files.append(load_state(network.network, checkpoint))
    assert ends[0] == ends[1]
    assert runs[0].step.tolist() == runs[1].step.tolist()
    for plain, fast in zip(*(rows_of(one) for one in runs), strict=True):
        assert plain.tobytes() == fast.tobytes()
    for plain, fast in zip(*(parts(one) for one in files), strict=True):
        np.testing.assert_array_equal(plain, fast)
    assert ("exp" in measure) == (not calls)


def rows_of(recording: Recording) -> tuple[np.ndarray, ...]:
    return recording.activity, recording.weights, recording.weights_after


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("every", [1, 10])
def test_without_a_file_no_more_than_the_last_step_is_kept(folder: Path, backend: str, every: int) -> None:
    """A run of 10¹² steps at the most ends early, and reserves nothing for the others."""
    result = call("run", "ramp.yaml", "--until", MEAN, "--steps", 10**12, "--backend", backend, "--every", every)
    assert result.exit_code == 0, result.output
    assert f"outputs at step {FIRST - FIRST % every}:" in result.output
    assert f"{FIRST + 1} steps in" in result.output
    network = nv.compile_text(SPEC)
    last = network.run(until=MEAN, backend=backend, every=every, last=True)
    whole = network.run(until=MEAN, backend=backend, every=every)
    assert last.step.tolist() == whole.step[-1:].tolist()
    assert last.activity.tobytes() == whole.activity[-1:].tobytes()
    assert last.weights.tobytes() == whole.weights[-1:].tobytes()
    assert last.weights_after.tobytes() == whole.weights_after.tobytes()
