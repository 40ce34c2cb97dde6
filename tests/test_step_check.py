"""``run --check-step``: runs with shorter steps, what they differ by, and the order that this shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from small_specs import compiled

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.runtime.inputs import InputError
from neurovis_spec.runtime.step_check import StepError, stretched

PAIR = """time: {dt: 0.02, steps: 60, integrate: %s}
models:
  hopf:
    state:
      x: {initial: 0.3, derivative: (1 - x^2 - y^2)*x - 6*y + drive}
      y: {derivative: (1 - x^2 - y^2)*y + 6*x}
    activity: x
neurons: {H: {count: 2, model: hopf, initial: {x: 0.1 + 0.3*i}}, O: {}}
connections: {H1 -> H2: {weight: 0.5}, H -> O: 1}
"""
RK4 = PAIR % "rk4"


def errors(text: str, **given: object) -> dict[str, StepError]:
    return {one.name: one for one in compiled(text).check_step(**given).errors}  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("method", "order"), [("euler", 1), ("heun", 2), ("rk4", 4), ("exponential", 1), ("semi_implicit", 1)]
)
def test_each_method_shows_its_order(method: str, order: int) -> None:
    found = errors(PAIR % method)
    assert list(found) == ["H", "H.x", "H.y", "O"]
    assert all(one.order == pytest.approx(order, abs=0.25) for one in found.values())
    assert found["H"].first == found["H.x"].first > found["H"].second > 0


def test_what_is_counted_in_steps_takes_as_long() -> None:
    """With events, a table and a delay that is held: the runs are of one network, so that rk4 keeps its order."""
    text = RK4.replace("O: {}", "O: {}, D: {input: pulse}").replace(
        "H -> O: 1", "H -> O: {weight: 1, delay: 3}, D -> H: 1"
    )
    events = "events: [{at: 10, set: {g: 2}}, {from: 20, to: 30, clamp: {D: 0.5}}]\n"
    table = "inputs: {pulse: {values: [0, 0, 1, 1, 1, 0]}}\nparameters: {g: 1}\n"
    network = compiled(text.replace("D -> H: 1", "D -> H: {weight: g, delay: 0}") + table + events)
    found = {one.name: one for one in network.check_step().errors}
    assert found["H"].order == pytest.approx(4, abs=0.3)
    assert found["O"].order == pytest.approx(4, abs=0.3)
    assert found["D"].why == "equal"
    finer = stretched(network.network, 4)
    assert finer.dt == network.network.dt / 4
    assert set(finer.connections.delays.tolist()) == {0, 12}
    assert [change.at for change in finer.changes] == [37, 77, 117]


def test_rows_that_are_given_are_stretched_and_every_step_of_several_is_compared() -> None:
    text = (
        RK4.replace("O: {}", "O: {}, D: {input: u}").replace("H -> O: 1", "D -> H: {weight: 1, delay: 0}")
        + "inputs: {u: {size: 1}}\n"
    )
    network = compiled(text)
    rows = np.repeat([0.0, 1.0, -1.0], 20)
    whole = {one.name: one for one in network.check_step(inputs={"u": rows}).errors}
    some = {one.name: one for one in network.check_step(inputs={"u": rows}, every=7).errors}
    assert whole["H"].order == pytest.approx(4, abs=0.3)
    assert 0 < some["H"].first <= whole["H"].first


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("derivative: (1 - x^2 - y^2)*y + 6*x", "each_step: y, derivative: (1 - x^2 - y^2)*y + 6*x", "each_step"),
        ("derivative: (1 - x^2 - y^2)*y + 6*x", "noise: 0.1, derivative: (1 - x^2 - y^2)*y + 6*x", "noise"),
        ("{weight: 0.5}", "{weight: 0.5, delay: 1}", "delay 1"),
        ("H: {count: 2,", 'H: {count: 2, noise: "normal(0, 1)",', "noise"),
        ("6*y + drive", "6*y + drive + 0*k", "k"),
        ("H: {count: 2,", "H: {count: 2, input: u,", "an input that reads k"),
    ],
)
def test_what_is_per_step_or_random_has_no_order_and_what_it_reaches(old: str, new: str, why: str) -> None:
    found = errors(RK4.replace(old, new) + "inputs: {u: {expression: 0*k}}\n")
    assert (found["H"].order, found["H"].why) == (None, why)
    assert (found["O"].order, found["O"].why) == (None, f"{why} of H")


def test_learning_has_no_order_and_what_is_no_number_is_told() -> None:
    learning = "neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: {weight: 0.1, plasticity: oja}}\n"
    assert errors(learning, steps=5)["B"].why == "learning"
    far = "models: {m: {state: {v: {initial: 9, derivative: v^3}}, activity: v}}\nneurons: {A: {model: m}}\n"
    with pytest.warns(RuntimeWarning):
        assert errors("time: {dt: 1}\n" + far, steps=9)["A"].why == "not finite"


def test_the_command_prints_a_table_and_says_with_what_it_does_not_go(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("neurovis: 1\nname: pair\n" + RK4)
    made = CliRunner().invoke(neurovis, ["run", str(tmp_path / "a.yaml"), "--check-step"])
    assert made.exit_code == 0, made.output
    lines = [line.split() for line in made.stdout.splitlines()]
    assert made.stdout.startswith("pair: 60 steps of 0.02 s, 0.01 s, 0.005 s, rk4, backend ")
    assert lines[2][0] == "H"
    assert 3.7 < float(lines[2][-1]) < 4.3
    refused = CliRunner().invoke(neurovis, ["run", str(tmp_path / "a.yaml"), "--check-step", "--until", "O > 1"])
    assert refused.exit_code == 2
    assert "goes without --until" in refused.output


def test_a_network_with_a_body_is_refused() -> None:
    spec = Path(__file__).parents[1] / "specs" / "walk" / "walk.yaml"
    with pytest.raises(InputError, match="--no-body"):
        nv.compile(spec).check_step(steps=3)


def test_numbers_that_are_given_for_all_steps_are_so_in_shorter_ones() -> None:
    text = PAIR.replace("neurons: {H: {", "inputs: {two: {size: 2}}\nneurons: {H: {input: two, ") % "rk4"
    for_each_step = np.tile([0.1, -0.2], (60, 1))
    assert errors(text, inputs={"two": [0.1, -0.2]}) == errors(text, inputs={"two": for_each_step})


def test_continuous_delays_are_rounded_anew_where_they_are_seen_once_a_step() -> None:
    text = """time: {dt: 0.5 ms, steps: 100}
models: {c: {state: {x: {initial: 1, derivative: -100*x + 100*drive}}, activity: x}}
neurons: {A: {model: c}, B: {model: c, initial: {x: 0.5}}}
connections: {A -> B: {weight: 0.5, delay: 4.3 ms}, B -> A: {weight: -0.8, delay: 4.3 ms}}
"""
    assert all(one.order == pytest.approx(1.6, abs=0.4) for one in errors(text).values())
    finer = stretched(compiled(text).network, 4).connections
    assert (finer.delays.tolist(), finer.lags and finer.lags.tolist()) == ([34, 34], [34.4, 34.4])


CHAOS = """neurovis: 1
name: lorenz
time: {dt: 0.02, steps: 1500}
models:
  lorenz:
    state:
      x: {initial: 1, derivative: 10*(y - x)}
      y: {initial: 1, derivative: x*(28 - z) - y}
      z: {initial: 1, derivative: x*y - 8/3*z}
    activity: x
neurons: {L: {model: lorenz}}
"""


def test_an_order_that_is_none_is_explained(tmp_path: Path) -> None:
    """Of a chaotic run; over fewer steps, which is what is said to do, there is the order of the method."""
    (tmp_path / "a.yaml").write_text(CHAOS)
    made = CliRunner().invoke(neurovis, ["run", str(tmp_path / "a.yaml"), "--check-step"])
    assert made.exit_code == 0
    last = made.stdout.splitlines()[-1]
    assert last.startswith("help: an order below 0.5 (L")
    assert "the run is chaotic" in last
    assert "check fewer steps, such as 150," in last
    check = nv.compile_text(CHAOS).check_step(steps=150)
    assert check.hint == ""
    assert [one.order for one in check.errors] == pytest.approx([4, 4, 4, 4], abs=0.2)
