"""A step that becomes too long for what is integrated in the course of a run."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from test_flow_oracles import HODGKIN_HUXLEY

import neurovis_spec as nv
from neurovis_spec.arguments import CodedWarning
from neurovis_spec.compiler.stiffness import Stiffest, stiffest_at_begin
from neurovis_spec.runtime.stiffness import stiffest_of_run


def cell(dt: str, method: str = "rk4") -> nv.CompiledNetwork:
    """Hodgkin and Huxley's cell, which fires after 2 ms, for 30 ms."""
    text = HODGKIN_HUXLEY.replace("DT", f"{dt}, steps: 300").replace("METHOD", method).replace("DRIVE", "bias: 10")
    return nv.compile_text("neurovis: 1\nname: cell\n" + text.replace("inputs: {current", "#"))


def test_a_cell_is_too_stiff_within_its_spike_alone() -> None:
    """Nothing is said of it as it begins."""
    made = cell("0.1 ms")
    assert made.warnings == ()
    assert stiffest_at_begin(made.network) is None
    assert stiffest_of_run(made.network, 10) is None
    worst = stiffest_of_run(made.network, 300)
    assert worst is not None
    assert (worst.owner, worst.state) == ("A", "v")
    assert worst.step is not None
    assert 10 < worst.step < 60


def test_the_slopes_are_those_of_the_equations() -> None:
    """Beside differences of the derivative, at the states of the same run."""
    made = cell("0.1 ms").network
    worst = stiffest_of_run(made, 300)
    assert worst is not None
    run = cell("0.1 ms", "exponential").run(300, states=["A.m", "A.h", "A.n"])
    m, h, n = run.states.T
    slopes = -(120 * m**3 * h + 36 * n**4 + 0.3)  # per ms, C is 1
    assert int(np.argmin(slopes)) == worst.step
    np.testing.assert_allclose(worst.slope, 1e3 * slopes.min(), rtol=1e-9)


@pytest.mark.parametrize(("dt", "method"), [("0.1 ms", "exponential"), ("0.1 ms", "semi_implicit"), ("50 us", "rk4")])
def test_a_method_that_bears_it_is_not_warned_of(dt: str, method: str) -> None:
    assert stiffest_of_run(cell(dt, method).network, 300) is None


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_the_warning_of_a_run_that_diverges_names_it(backend: str) -> None:
    with pytest.warns(RuntimeWarning, match=r"A is nan at step \d+, in '\w+' \(stiff-step: dt·∂v'/∂v is -3\.") as told:
        cell("0.1 ms").run(300, backend=backend)
    (one,) = told
    assert "the limit of rk4 is -2.785; take a dt of at most 0.08" in str(one.message)


def test_so_it_is_where_a_parameter_that_is_set_makes_it_so() -> None:
    text = """\
neurovis: 1
name: set
time: {dt: 0.1}
parameters: {rate: 1}
models: {m: {parameters: {r: 1}, state: {v: {initial: 1, derivative: -r*v}}, activity: v}}
neurons: {A: {count: 2, model: {m: {r: rate}}}}
events: [{at: 5, set: {rate: 10000}}]
"""
    with pytest.warns(RuntimeWarning, match=r"in 'set' \(stiff-step: dt·∂v'/∂v is -1e\+03 at 'A1'; the limit"):
        nv.compile_text(text).run(200)


def test_what_diverges_by_itself_is_not_called_stiff() -> None:
    text = (
        "neurovis: 1\nname: x\ntime: {dt: 0.1}\nmodels: {m: {state: {v: {initial: 1, derivative: v^2}}, activity: v}}\n"
    )
    with pytest.warns(RuntimeWarning) as told:
        nv.compile_text(text + "neurons: {A: {model: m}}").run(60, backend="numpy")
    assert all("stiff" not in str(one.message) for one in told)


def test_an_activation_between_that_a_derivative_reads_is_looked_through() -> None:
    """The slopes that are followed read that of the activation, which has none of its own."""
    text = """\
neurovis: 1
name: x
time: {dt: 0.1}
models: {m: {let: {r: f(v)}, state: {v: {initial: 1, derivative: v*v*(1 + r)}}, activity: r}}
neurons: {A: {model: m, activation: tanh}}
"""
    with pytest.warns(RuntimeWarning) as told:
        nv.compile_text(text).run(60, backend="numpy")
    assert all("stiff" not in str(one.message) for one in told)


def test_states_of_connections_alone_diverge_without_a_word_of_it() -> None:
    text = """\
neurovis: 1
name: x
time: {dt: 0.1}
synapses: {growing: {state: {g: {initial: 1, derivative: g^2}}, signal: g*pre}}
neurons: {A: {bias: 1}, B: {}}
connections: {A -> B: {synapse: growing}}
"""
    with pytest.warns(RuntimeWarning) as told:
        nv.compile_text(text).run(60, backend="reference")
    assert all("stiff" not in str(one.message) for one in told)


def test_a_picture_warns_of_what_the_run_bears_by_luck(tmp_path: Path) -> None:
    """Not where the run is no longer finite, which tells it itself, nor where validate has told it."""
    made = cell("85 us")
    with pytest.warns(
        CodedWarning, match=r"∂v is -2\.\d+ at 'A' at step \d+; the limit of rk4 is -2\.785: take"
    ) as told:
        made.render(tmp_path / "a.svg")
    assert [one.message.code for one in told if isinstance(one.message, CodedWarning)] == ["stiff-step"]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        _ = cell("0.1 ms").gains
    assert not [one for one in caught if isinstance(one.message, CodedWarning)]


def test_a_time_is_told_in_the_unit_of_dt() -> None:
    message, hint = Stiffest("A", "v", -33_000.0, 7).words(cell("0.1 ms").network)
    assert message == "dt·∂v'/∂v is -3.3 at 'A' at step 7; the limit of rk4 is -2.785"
    assert hint == "take a dt of at most 0.084 ms, or integrate: exponential"


GIVING_WAY = """\
neurovis: 1
name: pair
time: {dt: 1}
models:
  opening: {state: {s: {derivative: 0.1}}, activity: s}
  cell:
    parameters: {tau: 2}
    ports: [excitatory]
    state: {v: {initial: 1, derivative: (drive + 0.5*excitatory*v - v)/tau}}
    activity: v
synapses: {conductance: {let: {apart: 4 - post.v}, signal: weight*pre.s*apart}}
neurons: {A: {model: opening}, B: {model: cell}, C: {model: cell}}
connections:
  A -> B: {synapse: conductance, weight: 0.5, port: {drive: 2, excitatory: 1}}
  A -> C: {synapse: conductance, weight: 0.1}
"""


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_a_conductance_that_opens_makes_its_target_stiff(backend: str) -> None:
    """∂v'/∂v with all that arrives: 2·w·s·(4 − v) at drive, and w·s·(4 − v), times v/2, at the other port."""
    made = nv.compile_text(GIVING_WAY)
    assert made.warnings == ()
    assert stiffest_at_begin(made.network) is None
    worst = stiffest_of_run(made.network, 60)
    assert worst is not None
    assert (worst.owner, worst.state, worst.step) == ("B", "v", 59)
    text = GIVING_WAY.replace("dt: 1", "dt: 1, integrate: exponential")
    run = nv.compile_text(text).run(60, backend=backend, states="all")
    s, v = run.activity[-1, :2]
    by_excitatory = 0.5 * s * (4 - v)
    slope = (-1 + 0.5 * by_excitatory - 2 * 0.5 * s + 0.5 * v * -0.5 * s) / 2
    np.testing.assert_allclose(worst.slope, slope, rtol=1e-9)
