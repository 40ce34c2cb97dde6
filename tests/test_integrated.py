"""States with derivatives: the order of each method, against closed forms and an adaptive method of high order."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from flows_by_hand import flowing, integrated
from networks_by_hand import Unit, build

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Definition
from neurovis_spec.language.words import Method
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record

ORDERS: dict[Method, int] = {"euler": 1, "heun": 2, "rk4": 4, "exponential": 1, "semi_implicit": 1}

DECAY = flowing("v", {"v": ("1", "-3*v")})
LOGISTIC = flowing("v", {"v": ("0.1", "2*v*(1 - v)")})
TURNING = flowing("x", {"x": ("1", "2*y"), "y": ("0", "-2*x")})
DRIVEN = flowing("v", {"v": ("0", "cos(t) - v")})


def decay(t: float) -> float:
    return math.exp(-3 * t)


def logistic(t: float) -> float:
    return 1 / (1 + 9 * math.exp(-2 * t))


def driven(t: float) -> float:
    return (math.cos(t) + math.sin(t) - math.exp(-t)) / 2


def run(network: Network, steps: int, backend: str = "reference") -> FloatArray:
    return record(network, Course(steps + 1, backend=backend)).activity


CLOSED = [
    (DECAY, decay), (LOGISTIC, logistic), (TURNING, lambda t: math.cos(2 * t)), (DRIVEN, driven),
]  # fmt: skip


@pytest.mark.parametrize(("model", "exact"), CLOSED, ids=["decay", "logistic", "turning", "driven"])
@pytest.mark.parametrize("method", ["euler", "heun", "rk4"])
@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_errors_fall_as_the_order_says(
    backend: str, method: Method, model: Definition, exact: Callable[[float], float]
) -> None:
    errors = []
    for steps in (16, 32, 64):
        network = integrated(build([Unit("N", model=model)], dt=1 / steps), method)
        errors.append(abs(run(network, steps, backend)[-1, 0] - exact(1.0)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])

    assert abs(orders[-1] - ORDERS[method]) < 0.25
