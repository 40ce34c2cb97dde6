"""States with derivatives: the order of each method, against closed forms and an adaptive method of high order; and the
Euler method as authors write it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.backend import Availability, BackendError, Capabilities, Stepper, choose_backend, ready
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.record import record

BOTH = ["reference", "numpy"]
ORDERS = {"euler": 1, "heun": 2, "rk4": 4, "exponential": 1, "semi_implicit": 1}


def run(text: str, steps: int, backend: str = "numpy") -> FloatArray:
    """The activities at steps 0 to ``steps``."""
    return record(nv.compile_text("neurovis: 1\nname: x\n" + text).network, Course(steps + 1, backend=backend)).activity


def one_cell(state: str, time: str, activity: str = "v") -> str:
    """A neuron of a model with these states, in a line each."""
    return f"time: {time}\nmodels: {{m: {{state: {{{state}}}, activity: {activity}}}}}\nneurons: {{N: {{model: m}}}}\n"


CLOSED: dict[str, tuple[str, Callable[[float], float]]] = {
    "decay": ("v: {initial: 1, derivative: -3*v}", lambda t: math.exp(-3 * t)),
    "logistic": ("v: {initial: 0.1, derivative: 2*v*(1 - v)}", lambda t: 1 / (1 + 9 * math.exp(-2 * t))),
    "turning": (
        "v: {initial: 1, derivative: 2*y}, y: {derivative: -2*v}",
        lambda t: math.cos(2 * t),
    ),
    "driven": ("v: {derivative: cos(t) - v}", lambda t: (math.cos(t) + math.sin(t) - math.exp(-t)) / 2),
    "through let": (
        "v: {initial: 0.5, derivative: tanh(y) - v}, y: {initial: 0.2}",
        lambda t: math.tanh(0.2) + (0.5 - math.tanh(0.2)) * math.exp(-t),
    ),
}


@pytest.mark.parametrize("closed", CLOSED)
@pytest.mark.parametrize("method", ORDERS)
@pytest.mark.parametrize("backend", BOTH)
def test_errors_fall_as_the_order_says(backend: str, method: str, closed: str) -> None:
    state, exact = CLOSED[closed]
    errors = [
        abs(run(one_cell(state, f"{{dt: {1 / steps}, integrate: {method}}}"), steps, backend)[-1, 0] - exact(1.0))
        for steps in (16, 32, 64)
    ]
    if method == "exponential" and closed in ("decay", "through let"):
        assert max(errors) < 1e-14  # linear in its own state: exact
    else:
        assert abs(math.log2(errors[1] / errors[2]) - ORDERS[method]) < 0.25


@pytest.mark.parametrize("method", ["heun", "rk4"])
def test_an_edge_on_the_grid_falls_between_two_steps(method: str) -> None:
    """A current that is switched on at the beginning of a step costs no order."""
    errors = []
    for steps in (16, 32):
        text = one_cell("v: {derivative: drive - v}", f"{{dt: {1 / steps}, integrate: {method}}}")
        text = text.replace("model: m", "model: m, input: on") + "inputs: {on: {expression: 2 if t >= 0.5 else 1}}\n"
        half = 1 - math.exp(-0.5)
        errors.append(abs(run(text, steps)[-1, 0] - (2 + (half - 2) * math.exp(-0.5))))
    assert abs(math.log2(errors[0] / errors[1]) - ORDERS[method]) < 0.3


#: what three cells of different kinds do, in milliseconds and in seconds, with substeps and all that goes with them
COUPLED = """
time: {dt: DT, integrate: {method: METHOD, substeps: SUBSTEPS}}
inputs: {wave: {expression: sin(7*t)}}
models:
  relaxing:
    time: ms
    ports: [slow]
    parameters: {tau: 80}
    let: {pull: "0.3*slow - v^3/3"}
    state:
      v: {initial: 0.5, derivative: (v + pull - w + drive)/tau}
      w: {initial: 0.1, derivative: 0.08*(v + 0.7 - 0.8*w)/tau*10}
    outputs: {both: v - w}
    activity: v
  rate: {parameters: {tau: 0.2}, state: {r: {initial: 0.1, derivative: (f(drive) - r)/tau}}, activity: r}
neurons:
  A: {count: 2, model: relaxing, input: wave, bias: {drive: 0.1, slow: 0.2}}
  B: {count: 3, model: rate, activation: tanh}
connections:
  A -> B: {weight: "0.5 + i - j/2", pattern: all_to_all, send: both}
  B -> A: {weight: 0.7, pattern: all_to_all, port: {drive: 0.5, slow: -1}}
  B -> B: {weight: "-0.4", pattern: all_to_all}
"""


def coupled(t: float, x: FloatArray) -> FloatArray:
    """The derivatives of ``COUPLED`` a second: v, w of A, r of B."""
    v, w, r = x[:2], x[2:4], x[4:]
    weights = 0.5 + np.arange(2)[:, None] - np.arange(3)[None, :] / 2
    arriving = 0.7 * r.sum()
    slow, drive = -arriving + 0.2, 0.5 * arriving + 0.1 + math.sin(7 * t)
    dv = (v + 0.3 * slow - v**3 / 3 - w + drive) / 0.08
    dw = 0.08 * (v + 0.7 - 0.8 * w) / 0.08 * 10
    dr = (np.tanh((v - w) @ weights - 0.4 * (r.sum() - r)) - r) / 0.2
    return np.concatenate((dv, dw, dr))


@pytest.mark.parametrize(("method", "bound"), [("rk4", 1e-7), ("heun", 1e-3), ("exponential", 0.1), ("euler", 0.1)])
def test_coupled_cells_are_where_an_adaptive_method_is(method: str, bound: float) -> None:
    start = np.array([0.5, 0.5, 0.1, 0.1, 0.1, 0.1, 0.1])
    exact = solve_ivp(coupled, (0, 0.5), start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    expected = np.concatenate((exact[:2], exact[4:]))
    errors = []
    for substeps in (1, 2):
        text = COUPLED.replace("DT", "0.002").replace("METHOD", method).replace("SUBSTEPS", str(substeps))
        runs = [run(text, 250, backend)[-1] for backend in (BOTH if substeps > 1 and method == "rk4" else ["numpy"])]
        errors.append(max(float(np.abs(found - expected).max()) for found in runs))
    assert errors[0] < bound
    assert abs(math.log2(errors[0] / errors[1]) - ORDERS[method]) < 0.3


#: six neurons that are chaotic: 1e-9 more in each state are 2 in an activity after 75 seconds
CTRNN = """
seed: 87
time: {dt: 0.05, integrate: euler}
models:
  written: {parameters: {tau: 1}, state: {v: {initial: 0.3, each_step: v + dt*((drive - v)/tau)}}, activity: f(v)}
  flowing: {parameters: {tau: 1}, state: {v: {initial: 0.3, derivative: (drive - v)/tau}}, activity: f(v)}
neurons:
  N: {count: 6, model: KIND, activation: tanh, INITIAL}
connections:
  N -> N: {weight: "normal(0, 6)", pattern: all_to_all, delay: 1}
"""


@pytest.mark.parametrize("backend", BOTH)
def test_euler_as_it_is_written_by_hand_is_euler_bit_for_bit(backend: str) -> None:
    """With the activity that the states give at first, and the signals sampled."""
    flowing = run(CTRNN.replace("KIND", "flowing").replace(", INITIAL", ""), 2000, backend)
    first = f"initial: {float(flowing[0, 0])!r}"
    written = run(CTRNN.replace("KIND", "written").replace("INITIAL", first), 2000, backend)
    assert flowing.tobytes() == written.tobytes()
    assert len(np.unique(flowing[-400:, 0].round(3))) > 150


class Old:
    """A backend that was made before anything flowed."""

    name = "old"
    capabilities = Capabilities(noise=True)

    def availability(self) -> Availability:
        """Always there."""
        return NumpyBackend().availability()

    def prepare(self, network: Network) -> Stepper:
        """As NumPy's."""
        return NumpyBackend().prepare(network)


def test_a_backend_that_does_not_integrate_is_refused_by_name_and_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NEUROVIS_BACKEND", raising=False)
    network = nv.compile_text("neurovis: 1\nname: x\n" + one_cell("v: {derivative: -v}", "{dt: 0.1}")).network
    with pytest.raises(BackendError, match=r"the backend 'old' cannot run 'x': no derivatives"):
        ready(network, Old())
    gated = CTRNN.replace("KIND", "written").replace("INITIAL", "initial: 0.1")
    gated = gated.replace("activity", "outputs: {o: v}, activity", 1).replace("delay: 1", "delay: 1, send: o")
    with pytest.raises(BackendError, match=r"no outputs of models; no states that are sent"):
        ready(nv.compile_text("neurovis: 1\nname: x\n" + gated).network, Old())
    assert choose_backend(network)[0] in ("numpy", "c")
