"""Runs that end at the first step after which a measure is true."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis

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


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "ramp.yaml").write_text(SPEC)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*arguments: object) -> Result:
    result = CliRunner().invoke(neurovis, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


@pytest.mark.parametrize("backend", ["numpy", "reference"])
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
