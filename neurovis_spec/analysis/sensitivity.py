"""Sensitivity (saliency): how much the outputs change with a weight, a parameter or an input.

In: a compiled network. Out: for each of them the derivative of the outputs by central differences: runs from the same
state, with a little more and a little less of it. Where a smaller difference gives another derivative there is none: a
threshold is crossed, and the outputs jump.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from neurovis_spec.analysis.trials import Trials
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.named_array import Axis, NamedArray
from neurovis_spec.runtime.simulation import ParameterError

QUANTITIES = ("mean", "rms", "elasticity")
#: How far to either side, of the size of what is changed; where that is 0, of 1.
STEP = 1e-4
#: The second difference, of the first; how far both derivatives may be apart, of the larger one and of the rounding.
_FINER, _APART, _ROUNDING = 0.25, 0.1, 1e3

#: What moves something by so much, and gives the outputs; ParameterError where it cannot be there.
Move = Callable[[float], FloatArray]


def sensitivity(
    network: CompiledNetwork,
    start: int | None = None,
    steps: int | None = None,
    inputs: Mapping[str, npt.ArrayLike] | None = None,
    of: str | Sequence[str] | None = None,
    progress: Progress | None = None,
) -> NamedArray:
    """A row for each input, each parameter that can be set in a run and each connection: the ``mean`` over steps and
    outputs of ∂output/∂it, its root mean square (``rms``), and the ``elasticity``, the rms times the size of it: how
    much the outputs change where it changes by its own size. A weight that learns goes on learning; an input is changed
    by the same at all steps. NaN where there is no derivative. See ``Trials`` for the arguments."""
    return sensitivity_by(Trials(network, start, steps, inputs, of), progress)


def sensitivity_by(trials: Trials, progress: Progress | None = None) -> NamedArray:
    """``sensitivity`` for trials that have been prepared."""
    network = trials.network
    total = len(network.inputs) + len(network.parameters) - len(network.structural) + len(network.connections)
    labels, found = [], []
    for label, size, move in _moves(trials):
        mean, rms = _derivative(move, trials.intact, STEP * (size or 1.0))
        found.append((mean, rms, rms * size))
        labels.append(label)
        if progress is not None:
            progress(min(len(found), total), total)
    values = np.array(found, dtype=np.float64).reshape(-1, len(QUANTITIES))
    return NamedArray("sensitivity", values, Axis("to", tuple(labels)), Axis("quantity", QUANTITIES))


def _moves(trials: Trials) -> Iterator[tuple[str, float, Move]]:
    """Each input, parameter and connection: its name, the size of its value, and a function that runs it changed."""
    network = trials.network
    for entry in network.inputs:
        given = trials.given[:, entry.start : entry.start + entry.size]
        with np.errstate(all="ignore"):
            size = float(np.sqrt(np.mean(given**2)))
        yield f"input {entry.name}", size, lambda h, entry=entry: trials.with_input(entry, lambda x: x + h)  # type: ignore[misc]
    for name in network.parameters:
        if name not in network.structural:
            value = trials.parameter(name)

            def move(h: float, name: str = name, value: float = value) -> FloatArray:
                return trials.changed(lambda simulation: simulation.set({name: value + h}))

            yield f"parameter {name}", abs(value), move
    weights = trials.weights
    for index, name in enumerate(network.connection_names):
        yield name, abs(float(weights[index])), lambda h, index=index: trials.with_weight(index, h)  # type: ignore[misc]


def _derivative(move: Move, intact: FloatArray, h: float) -> tuple[float, float]:
    """The mean and the root mean square of the derivative; NaN where there is none."""
    finer = h * _FINER
    with np.errstate(all="ignore"):
        slope = _slope(move, intact, h)
        one, other = (float(np.sqrt(np.mean(values**2))) for values in (slope, _slope(move, intact, finer)))
        rounding = _ROUNDING * float(np.finfo(np.float64).eps * np.abs(intact).max()) / finer
    if not abs(one - other) <= _APART * max(one, other) + rounding:
        return float("nan"), float("nan")
    return float(np.mean(slope)), one


def _slope(move: Move, intact: FloatArray, h: float) -> FloatArray:
    """The derivative by the difference of both sides; of one where the other is not allowed."""
    sides: list[tuple[float, FloatArray]] = []
    for by in (h, -h):
        try:
            sides.append((by, move(by)))
        except ParameterError:
            sides.append((0.0, intact))
    (more, above), (less, below) = sides
    with np.errstate(all="ignore"):
        slope: FloatArray = np.asarray(above - below, dtype=np.float64)
        return slope / (more - less) if more != less else np.full_like(intact, np.nan)
