"""Trials: runs of a network from one and the same state, each with something changed.

In: a compiled network, the step at which the trials begin, how many steps they have. Out: the outputs of a trial, step
by step. The run up to the first step is made once, and so is the code that makes steps. What is measured by them:

- *Importance*: what the outputs lose without a neuron or an input: how far they go elsewhere where it is removed
  (lesion: a neuron takes no part, an input is 0) and where it no longer changes (occlusion: held at its mean).
- *Sensitivity* (saliency): how much the outputs change with a weight, a parameter or an input: the derivative of the
  outputs by central differences, runs with a little more and a little less of it. Where a smaller difference gives
  another derivative there is none: a threshold is crossed, and the outputs jump.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from neurovis_spec import arguments
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.network import Input, Network
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.backend import Stepper, ready
from neurovis_spec.runtime.columns import Keep, columns_of
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.embodied import embodied
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.named_array import Axis, NamedArray
from neurovis_spec.runtime.record import InMemory, Last, run_steps
from neurovis_spec.runtime.rows import RowSink, Steps
from neurovis_spec.runtime.simulation import ParameterError, Simulation
from neurovis_spec.runtime.state import State, initial_state

#: Steps of a trial where nothing else is asked for.
STEPS = 500

_OF_IMPORTANCE = ("lesion", "occlusion", "lesion share", "occlusion share")
_OF_SENSITIVITY = ("mean", "rms", "elasticity")
#: How far to either side, of the size of what is changed; where that is 0, of 1.
STEP = 1e-4
#: The second difference, of the first; how far both derivatives may be apart, of the larger one and of the rounding.
_FINER, _APART, _ROUNDING = 0.25, 0.1, 1e3
#: Of a trial the activities alone are looked at.
_KEPT = Keep(sent=False)
#: What moves something by so much, and gives the outputs; ParameterError where it cannot be there.
Move = Callable[[float], FloatArray]


@dataclass(frozen=True)
class _Turned:
    """A stepper that is given other inputs: ``seen`` is given those of each step, and says which it is to take."""

    stepper: Stepper
    seen: Callable[[FloatArray], FloatArray]

    def step(self, state: State, inputs: FloatArray, /) -> None:
        self.stepper.step(state, self.seen(inputs))


class Trials:
    """Trials of ``steps`` steps from step ``start`` on, by default the last ones of ``time.steps``; ``inputs`` replace
    sources of inputs as in ``run``, ``of`` are the neurons that count as outputs (default: the spec's outputs, else
    those that send to nobody). Raises KeyError, ValueError where there are no outputs."""

    def __init__(
        self,
        compiled: CompiledNetwork,
        start: int | None = None,
        steps: int | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        of: str | Sequence[str] | None = None,
    ) -> None:
        network = compiled.network
        count = min(STEPS, network.steps) if steps is None else arguments.integer("steps", steps, 1, 1 << 40)
        first = max(network.steps - count, 0) if start is None else arguments.integer("start", start, 0, 1 << 40)
        self.network, self.start, self.steps, self._inputs = network, first, count, inputs
        self.outputs = output_neurons(network) if of is None else _neurons(network, of)
        if not len(self.outputs):
            raise ValueError("the network has no outputs: name the neurons that count as outputs")
        self._made, self._body = ready(network), embodied(network)
        self._simulation = Simulation(network, self._made, inputs=inputs, body=self._body)
        self._state = initial_state(network)
        self._widths = columns_of(network, _KEPT, self._body).widths(network)
        course = Course(first, inputs=inputs, backend=self._made, keep=_KEPT, body=self._body)
        _go(network, self._state, course, Last(self._widths))
        if self._body is not None:
            self._body.put(self._state)
        vectors: list[FloatArray] = []

        def noted(vector: FloatArray) -> FloatArray:
            vectors.append(vector.copy())
            return vector

        #: what the network does with nothing changed: all activities (steps, neurons), and the inputs that it is given
        self.activity = self._run(self._state.copy(), noted)
        self.given = np.array(vectors).reshape(count, -1)
        self.intact = self.activity[:, self.outputs]

    @property
    def weights(self) -> FloatArray:
        """w[start] of all connections (m,)."""
        return self._state.weights

    def parameter(self, name: str) -> float:
        """The value of a parameter at the first step."""
        return float(self._state.conditions.parameters[self.network.settable.index[name]])

    def changed(self, change: Callable[[Simulation], None]) -> FloatArray:
        """The outputs (steps, outputs) where something was done to the simulation before the first step."""
        self._simulation.restore(self._state)
        change(self._simulation)
        return self._run(self._simulation.state())[:, self.outputs]

    def with_weight(self, connection: int, more: float) -> FloatArray:
        """The outputs (steps, outputs) with a connection's weight, and that of its twin, increased by ``more`` from the
        first step on."""
        state = self._state.copy()
        state.weights[self.network.connections.with_twins(np.array([connection], dtype=np.int64))] += more
        return self._run(state)[:, self.outputs]

    def with_input(self, entry: Input, other: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """The outputs (steps, outputs) with an input replaced: ``other`` makes of its values others, at each step."""
        own = slice(entry.start, entry.start + entry.size)

        def seen(vector: FloatArray) -> FloatArray:
            replaced = vector.copy()
            replaced[own] = other(vector[own])
            return replaced

        return self._run(self._state.copy(), seen)[:, self.outputs]

    def _run(self, state: State, seen: Callable[[FloatArray], FloatArray] | None = None) -> FloatArray:
        rows = InMemory(self._widths, self.steps)
        made = self._made if seen is None else replace(self._made, stepper=_Turned(self._made.stepper, seen))
        course = Course(self.steps, inputs=self._inputs, backend=made, keep=_KEPT, body=self._body)
        _go(self.network, state, course, rows)
        return rows.numbers(Steps(self.steps, 1, self.start)).rows.activity


def _go(network: Network, state: State, course: Course, rows: RowSink) -> None:
    """Make the steps. What is no longer finite is seen in the numbers: hundreds of trials need not warn of it each."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        run_steps(network, state, course, rows)


def output_neurons(network: Network) -> IntArray:
    """The neurons of the spec's outputs, else those of the role output, else those that send to no other."""
    found = {index for output in network.outputs if not output.states for index in output.neurons.tolist()}
    if not found:
        found = {index for group in network.neurons.groups if group.role == "output" for index in group.indices}
    if not found:
        sources, targets = network.connections.sources.whole(), network.connections.targets.whole()
        found = set(targets.tolist()) - set(sources[sources != targets].tolist())
    return np.array(sorted(found), dtype=np.int64)


def _neurons(network: Network, of: str | Sequence[str]) -> IntArray:
    from neurovis_spec.runtime.names import names_of

    result: dict[int, None] = {}
    names = names_of(network)
    for reference in arguments.texts("of", of):
        found = names.find(reference)
        if isinstance(found, str):
            raise RecordingError(found)
        result.update(dict.fromkeys(found.neurons))
    return np.array(list(result), dtype=np.int64)


def importance(
    network: CompiledNetwork,
    start: int | None = None,
    steps: int | None = None,
    inputs: Mapping[str, npt.ArrayLike] | None = None,
    of: str | Sequence[str] | None = None,
    progress: Progress | None = None,
) -> NamedArray:
    """A row for each input and each neuron that is not itself an output: the root mean square of the difference of the
    outputs from those of the intact network, and the share of it in how much these vary (1: as if they were held at
    their mean). See ``Trials`` for the arguments. NaN where the network cannot be held so."""
    return importance_by(Trials(network, start, steps, inputs, of), progress)


def importance_by(trials: Trials, progress: Progress | None = None) -> NamedArray:
    """``importance`` for trials that have been prepared."""
    network = trials.network
    names = network.neurons.names
    own = [index for index in range(len(names)) if index not in set(trials.outputs.tolist())]
    labels = [*(entry.name for entry in network.inputs), *(names[index] for index in own)]
    twice = {entry.name for entry in network.inputs} & set(names)
    labels = [f"input {label}" if place < len(network.inputs) and label in twice else label
              for place, label in enumerate(labels)]  # fmt: skip
    found: list[tuple[float, float]] = []
    for entry in network.inputs:
        with np.errstate(all="ignore"):
            mean = trials.given[:, entry.start : entry.start + entry.size].mean(axis=0)
        silent = trials.with_input(entry, np.zeros_like)
        held = trials.with_input(entry, lambda _, mean=mean: mean)  # type: ignore[misc]
        found.append((_apart(trials, silent), _apart(trials, held)))
        _tell(progress, len(found), len(labels))
    for index in own:
        with np.errstate(all="ignore"):
            level = float(trials.activity[:, index].mean())
        removed = trials.changed(lambda simulation, name=names[index]: simulation.lesion(name))  # type: ignore[misc]
        occluded = float("nan")
        if np.isfinite(level):
            clamped = trials.changed(lambda simulation, name=names[index], x=level: simulation.clamp(name, x))  # type: ignore[misc]
            occluded = _apart(trials, clamped)
        found.append((_apart(trials, removed), occluded))
        _tell(progress, len(found), len(labels))
    lost = np.array(found, dtype=np.float64).reshape(-1, 2)
    with np.errstate(all="ignore"):
        varies = float(np.sqrt(np.mean((trials.intact - trials.intact.mean(axis=0)) ** 2)))
        share = lost / varies if varies > 0 else np.full_like(lost, np.nan)
    values = np.concatenate([lost, share], axis=1)
    return NamedArray("importance", values, Axis("without", tuple(labels)), Axis("quantity", _OF_IMPORTANCE))


def _apart(trials: Trials, outputs: FloatArray) -> float:
    with np.errstate(all="ignore"):
        return float(np.sqrt(np.mean((outputs - trials.intact) ** 2)))


def _tell(progress: Progress | None, done: int, total: int) -> None:
    if progress is not None:
        progress(done, total)


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
    much the outputs change where it changes by its own size. A symmetric pair is one. A weight that learns goes on
    learning; an input is changed by the same at all steps. NaN where there is no derivative. See ``Trials`` for the
    arguments."""
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
        _tell(progress, min(len(found), total), total)
    values = np.array(found, dtype=np.float64).reshape(-1, len(_OF_SENSITIVITY))
    return NamedArray("sensitivity", values, Axis("to", tuple(labels)), Axis("quantity", _OF_SENSITIVITY))


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
    weights, second = trials.weights, frozenset(network.connections.second.tolist())
    for index, name in enumerate(network.connection_names):
        if index in second:
            continue  # a symmetric pair has one weight
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
