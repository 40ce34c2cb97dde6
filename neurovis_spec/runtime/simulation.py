"""The Simulation: a network run step by step, for a control loop.

In: values for inputs, at each step. Out: the outputs of the step; activities and weights to look at; parameters that
can be set, neurons that can be clamped, parts that can be lesioned, rules that can be stopped from now on; states that
can be kept and gone back to.
"""

from __future__ import annotations

import os
import reprlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Literal, Self, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec import arguments
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.body import Port, Skeleton
from neurovis_spec.compiler.events.changes import Clamp
from neurovis_spec.compiler.events.patch import PatchError
from neurovis_spec.compiler.events.settable import ParameterFormula
from neurovis_spec.compiler.network import Network, Output
from neurovis_spec.language.expressions.tree import Number
from neurovis_spec.language.units import UnitError, measured, number_in
from neurovis_spec.likeness import suggest
from neurovis_spec.runtime.backend import Backend, Reading, Ready, ready
from neurovis_spec.runtime.beginning import new_trial
from neurovis_spec.runtime.columns import ALL, Keep, Probe, named_signals, probe_of
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.embodied import Embodied, embodied
from neurovis_spec.runtime.errors import RecordingError, UnknownNameError, unknown
from neurovis_spec.runtime.formed import Forming
from neurovis_spec.runtime.inputs import InputError, InputReader
from neurovis_spec.runtime.names import Names, names_of
from neurovis_spec.runtime.quantities import Quantities
from neurovis_spec.runtime.record import end_values
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.references import find_lasting_state, find_neurons, find_parts
from neurovis_spec.runtime.resume import learned_state, resumed_state
from neurovis_spec.runtime.rows import After
from neurovis_spec.runtime.state import State, initial_state
from neurovis_spec.runtime.watch import Checked, Watch

if TYPE_CHECKING:
    from neurovis_spec.runtime.recorder import Recorder

#: What reads an output, of the state and the signals (m,) behind a step.
_Reader: TypeAlias = Callable[[State, FloatArray | None], np.float64 | FloatArray]

#: Clamps by hand come after those of events.
_BY_HAND = 1 << 62


class ParameterError(ValueError):
    """A parameter that does not exist, cannot be set in a run, or cannot have this value."""


class Simulation:
    """A run in the making; ``start`` is a recording to go on from (see ``resume``), of which ``weights_alone`` takes
    nothing but weights that learn; ``inputs`` are whole arrays that replace the sources of inputs. Without a
    ``backend`` it goes on with that of what it goes on from, else with the one that is chosen. Events of the spec apply
    at their steps; what is done by hand between two steps comes after the events of the step to come. Raises
    BackendError, RecordingError, ParameterError (see ``step``).
    """

    def __init__(
        self,
        network: Network,
        backend: str | Backend | Ready | None = None,
        start: Recording | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        body: Embodied | None = None,
        *,
        weights_alone: bool = False,
    ) -> None:
        self.network = network
        self._asked_backend, self._inputs, self._watch = backend, inputs, Watch(network)
        self._body = embodied(network) if body is None else body
        self._eventful = bool(network.changes)
        #: the inputs that the caller gives for the whole run; the body does not sense these
        self._given = frozenset(inputs or ())
        self._use_backend("" if start is None else start.backend)
        resumed = learned_state if weights_alone else resumed_state
        self._begin = initial_state(network) if start is None else resumed(network, start, self._backend.functions)
        self._backend.take(self._begin)
        self._apply(self._begin)
        self._recorder: Recorder | None = None
        #: what forms the signals of each step, where somebody follows them, and those of the last one
        self._forming = Forming(network, self._backend.functions) if named_signals(network) else None
        self._signals: FloatArray | None = None
        #: what was true after the last step, where events of the step to come have changed something (``ended``)
        self._ended: After | None = None
        self.reset()

    def _use_backend(self, before: str) -> None:
        """Have the backend that is asked for make the steps to come, else the one that made those ``before``."""
        self._backend = ready(self.network, self._asked_backend, before)
        stepper = self._backend.stepper
        self._stepper = stepper if isinstance(stepper, Reading) else Checked(self.network, stepper)
        self._reader = InputReader(self.network, self._inputs, self._watch.take_inputs, self._backend.functions)
        self._reader.leave(stepper, () if self._body is None else self._body.inputs)
        self._controls = Controls(self.network, self._backend.functions)

    @property
    def backend(self) -> str:
        """The name of the backend that makes the steps."""
        return self._backend.name

    def record(self, path: str | os.PathLike[str] | None = None, every: int = 1, keep: Keep = ALL) -> None:
        """Record from the next step on, one step in ``every``: into a file, which is there when the simulation is
        closed, or in memory; ``recording`` is what was recorded. Raises RecordingError, OSError, KeyError."""
        from neurovis_spec.runtime.recorder import Recorder

        if self._recorder is not None:
            raise RecordingError("this simulation is recorded already")
        place = None if path is None else arguments.path("path", path)
        step = arguments.integer("every", every, 1, arguments.MOST_STEPS)
        course = Course(every=step, backend=self._backend, keep=keep, body=self._body)
        self._recorder = Recorder(self.network, self._state, course, place, lambda: self._ended or self.after())

    @property
    def recording(self) -> Recording:
        """What was recorded so far. Raises RecordingError where nothing is recorded (``record``)."""
        if self._recorder is None:
            raise RecordingError("nothing is recorded: network.simulator(record=True), or record='FILE.npz'")
        return self._recorder.recording()

    def close(self) -> None:
        """End the recording, if there is one: its file is there now."""
        self._close(None)

    def _close(self, error: BaseException | None) -> None:
        if self._recorder is not None:
            self._recorder.close(error)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the recording. After an exception, but for Ctrl-C and ``sys.exit``, a part beside the file holds the
        steps until then, as after a run that broke off."""
        self._close(error)

    def __reduce__(self) -> tuple[Callable[..., Simulation], tuple[object, ...]]:
        """A copy, in another process, goes on from here; code that was made for the network is made there anew."""
        return _resumed, (self.network, self._asked_backend, self._inputs, self._begin, self.state())

    @cached_property
    def _names(self) -> Names:
        return names_of(self.network)

    @cached_property
    def _outputs(self) -> tuple[tuple[str, _Reader], ...]:
        """How each output is read, by its name."""
        return tuple((entry.name, _reader(self.network, entry)) for entry in self.network.outputs)

    def _apply(self, state: State) -> bool:
        """What events change at the step to come; whether they do."""
        try:
            return self._controls.begin(state)
        except PatchError as error:
            raise ParameterError(f"the events at step {state.k}: {error}") from None

    @property
    def k(self) -> int:
        """The step that is computed next: 0 before the first, so the number of steps made."""
        return self._state.k

    @property
    def episode(self) -> int:
        """The number of the episode of step k, from 0: an episode ends every ``time.episode`` steps, and where the body
        ends it."""
        if self._body is not None:
            return self._body.episode
        length = self.network.episode
        return 0 if length is None else self._state.k // length

    @property
    def ended_episode(self) -> bool:
        """Whether the last step was the last one of an episode; the body has been reset since."""
        if self._body is not None:
            return self._body.ended_episode
        length = self.network.episode
        return length is not None and self._state.k > 0 and self._state.k % length == 0

    @property
    def sensors(self) -> Mapping[str, np.float64]:
        """What the body senses now, which step k is given, by the sensors' names (``name`` or ``name[i]``); an empty
        mapping without a body."""
        if self._body is None:
            return {}
        return dict(zip(self._body.sensor_names, self._body.body.sense(), strict=True))

    @property
    def sensed(self) -> FloatArray | None:
        """What the body sensed at the last step, by the columns that ``sensors`` names; None without a body."""
        return None if self._body is None else self._body.sensed

    @property
    def given(self) -> FloatArray:
        """The vector of all inputs at the last step, (inputs,), a copy; 0 before the first."""
        return self._stepper.vector[: self.network.input_size].copy()

    @property
    def commands(self) -> FloatArray | None:
        """What the actuators were told behind the last step, one number after the other; None without a body, before
        the first step, and behind one at which the body was reset. Raises BodyError where a command is no finite
        number."""
        if self._body is None or self._state.k == 0 or not self._body.moved:
            return None
        return self._body.commands(self._state)

    @property
    def actuators(self) -> Sequence[Port]:
        """What moves the body; nothing without one."""
        return () if self._body is None else self._body.body.actuators

    @property
    def pose(self) -> FloatArray | None:
        """The pose of the body at step k, None where there is nothing to draw; ``skeleton`` says how it is drawn."""
        return None if self._body is None else self._body.pose()

    @property
    def skeleton(self) -> Skeleton | None:
        """How the pose of the body is drawn, None where there is nothing to draw."""
        return None if self._body is None else self._body.skeleton

    @property
    def activity(self) -> FloatArray:
        """a[k−1] of all neurons (n,), a copy; NaN before the first step."""
        if self._state.k == 0:
            return np.full(len(self.network.neurons), np.nan)
        return self._state.activity.copy()

    @property
    def weights(self) -> FloatArray:
        """w[k], for the next step, of the connections that can change, in the order of a ``.npz``; a copy."""
        return self._state.weights[self.network.changing]

    @property
    def connection_weights(self) -> FloatArray:
        """w[k], for the next step, of all connections (m,); a copy."""
        return self._state.weights.copy()

    @property
    def lesioned(self) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
        """Which neurons (n,) and connections (m,) take no part from step k on, copies; a connection is lesioned with
        either of its ends."""
        now = self._state.conditions
        return now.lesioned_neurons.copy(), now.structure.cut.copy()

    @property
    def held(self) -> npt.NDArray[np.bool_]:
        """Which neurons (n,) are clamped from step k on, a copy."""
        return self._state.conditions.held.order[: len(self.network.neurons)] >= 0

    @property
    def stopped(self) -> npt.NDArray[np.bool_]:
        """Of which connections (m,) the rules are stopped from step k on, a copy."""
        return self._state.conditions.paused.copy()

    @property
    def parameters(self) -> Mapping[str, float]:
        """The parameters of the spec, as they are for the next step."""
        slots = self.network.settable.index
        return {name: float(self._state.conditions.parameters[slots[name]]) for name in self.network.parameters}

    @property
    def slots(self) -> FloatArray:
        """The value of each slot (``Settable.slots``), as it is for the next step; a copy."""
        return self._state.conditions.parameters.copy()

    @property
    def variables(self) -> FloatArray:
        """The numbers that follow parameters, as ``Settable.variables`` lays them out, as they are for the next step; a
        copy."""
        return self._state.conditions.variables.copy()

    def weight(self, name: str) -> float:
        """w[k] of any connection by name. Raises KeyError with the nearest names."""
        index = self.network.connection_index.get(arguments.text("name", name))
        if index is None:
            raise unknown("connection", name, self.network.connection_names)
        return float(self._state.weights[index])

    def step(
        self, values: Mapping[str, npt.ArrayLike] | None = None, /, **inputs: npt.ArrayLike
    ) -> Mapping[str, np.float64 | FloatArray]:
        """Compute step k; values replace the sources of inputs for this step only.

        Gives the outputs by name: a number for a single neuron, else an array; an empty mapping where the spec declares
        none. Raises InputError, and then no step was made; ParameterError where events of the step to come cannot set
        what they say with what was set by hand, and then the step was made, and these events are left out.
        """
        state, body = self._state, self._body
        if values is not None:
            if not isinstance(values, Mapping):
                raise TypeError(f"inputs are given by name, not as {type(values).__name__}: step(target=0.3)")
            inputs = {**values, **inputs}
        reader, watch, k = self._reader, self._watch, state.k
        if self._eventful:
            self._controls.rewind(state)
        if reader.all_left and not inputs:
            vector = self._stepper.vector
        else:
            vector = reader.at(k, inputs)
            if body is not None:
                vector = body.sense(vector, self._given.union(inputs, reader.fed))
        recorder = self._recorder if self._recorder is not None and self._recorder.going else None
        if recorder is not None:
            recorder.begin(state)
        before = None if self._forming is None else state.weights.copy()
        odd = self._stepper.advance(state, vector, reader.left_beside(inputs) if inputs else reader.left)
        if (odd or watch.waiting) and not watch.warned:
            watch.take_inputs_at(k, self._stepper.vector, inputs if body is None else body.inputs.union(inputs))
            watch.check(state)
        if before is not None and self._forming is not None:
            self._signals = self._forming.signals(state, before)
        due = self._eventful and self._controls.due(state)
        self._ended = self.after() if due else None
        if recorder is not None:
            recorder.end(state, self._stepper.vector)
        if body is not None:
            body.move(state)
        if due and self._apply(state):  # events of the next step apply now: ``weights`` are those of the next step
            reader.use(state)
        return self.outputs

    @property
    def ended(self) -> After | None:
        """What was true after the last step, where events of the step to come have changed something since; None where
        ``after`` is that, as it is once the caller has changed something, too. Its weights are those of all connections
        (m,)."""
        return self._ended

    def after(self) -> After:
        """What is true now, after the last step, with what events of the step to come and the caller have changed
        since. Its weights are those of all connections (m,)."""
        return replace(end_values(self.network, self._state), weights=self.connection_weights)

    @property
    def outlets(self) -> FloatArray:
        """What connections take of the last step beside activities, as ``Network.outlets`` lays it out; a copy."""
        return self._state.outlets.copy()

    def follow_signals(self) -> None:
        """Form the signals of each step to come, of what is true behind it and before events of the next one."""
        self._forming = Forming(self.network, self._backend.functions)

    @property
    def signals(self) -> FloatArray | None:
        """What each connection brought at the last step, (m,), a copy; None where nobody follows it, and before the
        first step (``follow_signals``)."""
        return None if self._signals is None else self._signals.copy()

    def probed(self, probe: Probe) -> FloatArray | None:
        """The states that a probe reads, (columns,); None where it reads none. Signals are known where they are
        followed."""
        return probe.now(self._state, self._signals) if probe.names else None

    def looked(self, quantities: Quantities) -> FloatArray:
        """All quantities as they are now, (k,). Signals are known where they are followed."""
        return quantities.now(self._state, self._signals)

    @property
    def outputs(self) -> Mapping[str, np.float64 | FloatArray]:
        """The outputs of the last step."""
        state = self._state
        found: dict[str, np.float64 | FloatArray] = {}
        for name, read in self._outputs:
            found[name] = read(state, self._signals)
        return found

    def set(self, values: Mapping[str, float | str] | None = None, /, **parameters: float | str) -> None:
        """Give parameters other values from step k on, until an event of a later step sets them again. A parameter with
        a unit takes a text such as ``0.02 s``, too.

        Fixed weights, biases, inputs, clamps and parameters of models and rules follow; plastic weights, states,
        signals under way and ``initial`` stay. Raises ParameterError, and then nothing has changed.
        """
        checked = self._checked({**arguments.mapping("values", values), **parameters})
        state = self._state
        try:
            with np.errstate(all="ignore"):
                self._controls.set(state.conditions, state.weights, checked)
        except PatchError as error:
            raise ParameterError(str(error)) from None
        self._ended = None
        self._reader.use(state)

    @property
    def fed(self) -> Mapping[str, tuple[float, ...]]:
        """What inputs are fed now that events feed, by their names."""
        now, index = self._state.conditions.parameters, self.network.input_index
        found = {}
        for name, first in self.network.settable.feeds.items():
            if now[first]:
                found[name] = tuple(now[first + 1 : first + 1 + index[name].size].tolist())
        return found

    def feed(self, name: str, values: Sequence[float] = ()) -> None:
        """Feed an input that events feed, too, these values from step k on, as an event does, until one of a later step
        feeds it anew; none: its source again. Raises InputError for an input that none feeds."""
        first = self.network.settable.feeds.get(name)
        if first is None:
            raise InputError(f"no event feeds the input '{name}': give step() its values")
        given = dict(enumerate(map(float, values), first + 1))
        self._controls.set(self._state.conditions, self._state.weights, {first: float(bool(given)), **given})
        self._reader.use(self._state)

    def weight_of(self, connections: str) -> float | None:
        """w[k] of all the connections (``K -> O``) that a reference names; None where they differ, and where it names
        none."""
        try:
            _, members = self._parts(connections)
        except KeyError:
            return None
        weights = self._state.weights[members]
        return float(weights[0]) if len(weights) and (weights == weights[0]).all() else None

    def set_weight(self, connections: str, value: float) -> None:
        """Give connections (``K3 -> O``) this weight from step k on, as an event does (``set: {K3 -> O: 0.4}``): one
        that learns is changed by its rule from there on, one that follows a parameter follows it again as soon as that
        is set. Raises KeyError for a name that there is not, ParameterError for a weight that is not finite or beyond
        its bounds, RecordingError where it is recorded and the recording holds no change of such a weight."""
        number, (neurons, members) = arguments.finite(value), self._parts(connections)
        if len(neurons):
            raise UnknownNameError(f"'{connections}' is no connection: write FROM -> TO")
        if number is None:
            raise ParameterError(f"a weight is a finite number, not {reprlib.repr(value)}")
        is_recorded = self._recorder is not None and self._recorder.going
        if is_recorded and not np.isin(members, self.network.changing).all():
            raise RecordingError(f"it is recorded, and a recording has one weight of '{connections}' for all steps")
        try:
            self._controls.weigh(self._state, members, number)
        except PatchError as error:
            raise ParameterError(str(error)) from None
        self._ended = None

    def _checked(self, values: Mapping[str, object]) -> dict[int, float]:
        """The values by slots, the indices of the parameters. Raises ParameterError."""
        slots, result = self.network.settable.index, {}
        for name, value in values.items():
            if name not in self.network.parameters:
                hint = suggest(name, self.network.parameters, "the parameters are")
                raise ParameterError(f"no parameter '{name}'" + (f"; {hint}" if hint else "; the network has none"))
            if name in self.network.structural:
                raise ParameterError(
                    f"parameter '{name}' cannot be set in a run: the structure of the network depends on it"
                )
            number = _number(name, value, self.network.settable.slots[slots[name]].unit)
            if number is None:
                raise ParameterError(f"parameter '{name}' takes a finite number, not {reprlib.repr(value)}")
            result[slots[name]] = number
        return result

    def clamp(self, neurons: str, value: float) -> None:
        """Hold neurons (``K1..K3``, ``K + O``, ``left.K``) at a value from step k on, whatever their model says; its
        states go on. ``K.v`` holds the state v of their model instead, ``(K -> O).g`` one of synapses or rules. Raises
        KeyError for a name that there is not, ValueError for a value that is not finite, BackendError where the backend
        holds no states."""
        number = arguments.finite(value)
        if number is None:
            raise ValueError(f"a neuron is clamped to a finite number, not {reprlib.repr(value)}")
        now = self._state.conditions
        order = max([_BY_HAND, *(order + 1 for order in now.held.active)])
        clamp = Clamp(order, -1, self._clampable(neurons), ParameterFormula(Number(number), {}))
        now.held.begin(clamp, now.parameters)
        self._controls.hold(now)

    def release(self, neurons: str) -> None:
        """No clamp holds these neurons, or these states, any more, by hand or by an event that has begun. Raises
        KeyError."""
        now = self._state.conditions
        now.held.release(self._clampable(neurons))
        self._controls.hold(now)

    def lesion(self, *parts: str) -> None:
        """Remove neurons (``K3``) or connections (``K -> O``) from step k on. Raises KeyError."""
        for part in parts:
            self._parts(part)
        self._ended = None
        for part in parts:
            self._controls.lesion(self._state, *self._parts(part))

    def mend(self, *parts: str) -> None:
        """Undo lesions of neurons or connections: from step k on they take part again. What was under way on them is
        lost, but where no step was made without them. Raises KeyError."""
        for part in parts:
            self._parts(part)
        self._ended = None
        for part in parts:
            self._controls.mend(self._state, *self._parts(part))

    def learning(self, connections: str, on: bool = True) -> None:
        """Carry out the rules of connections (``K -> O``) from step k on, or stop them: weights and states of rules
        stay as they are then. Raises KeyError; TypeError where ``on`` is neither True nor False."""
        _, members = self._parts(connections)
        if not len(members) or not self.network.connections.learning[members].any():
            raise UnknownNameError(f"there is no rule at '{connections}'")
        self._controls.learn(self._state, members, arguments.truth("on", on))

    def _clampable(self, text: str) -> IntArray:
        """Neurons or states, among all that can be clamped."""
        reference = arguments.text("reference", text)
        state = (
            None if not isinstance(self._names.find(reference), str) else find_lasting_state(self.network, reference)
        )
        if state is None:
            return self._neurons(text)
        self._backend.check_clamp(f"the state '{text}'")
        return self.network.clamp_places(state)

    def _neurons(self, text: str) -> IntArray:
        return np.array(find_neurons(arguments.text("reference", text), self._names), dtype=np.int64)

    def _parts(self, text: str) -> tuple[IntArray, IntArray]:
        """The neurons, or else the connections, that a reference names."""
        return find_parts(self.network, arguments.text("reference", text), self._names)

    def reset(self, keep: Literal["weights"] | None = None) -> None:
        """Back to the beginning, with the parameters of the beginning. A new trial may ``keep`` the ``"weights"`` that
        have been learned, with centres: then random numbers go on where they were. Raises RecordingError where it is
        recorded, ValueError for anything else to be kept."""
        if keep not in (None, "weights"):
            raise ValueError(f"a reset keeps 'weights' or None, not {reprlib.repr(keep)}")
        begin = self._begin.copy() if keep is None else new_trial(self.network, self._begin, self._state)
        self._check_recorded(begin)
        self._watch.warned = False
        self._take(begin)
        if self._body is not None:
            self._body.take(self._state)

    def _take(self, state: State) -> None:
        """Go on from this state, with its backend unless another is asked for."""
        if state.backend not in ("", self._backend.name):
            self._use_backend(state.backend)
            if self._forming is not None:
                self.follow_signals()
        self._backend.take(state)
        self._state, self._ended, self._signals = state, None, None
        self._reader.use(state)

    def state(self) -> State:
        """A copy of all that the run carries from step to step, what was set, clamped and lesioned and the body
        included. Raises BodyError where a body cannot be kept."""
        state = self._state.copy()
        if self._body is not None:
            self._body.put(state)
        return state

    def save_state(self, path: str | os.PathLike[str]) -> None:
        """Write the state to a file, a checkpoint, from which ``restore`` and ``run --checkpoint`` go on exactly.
        Raises OSError."""
        from neurovis_spec.runtime.checkpoint import save_state

        save_state(self.state(), arguments.path("path", path))

    def restore(self, state: State | str | os.PathLike[str]) -> None:
        """Go on from a state of this network, or from a checkpoint, exactly as it was, with the backend that made it
        unless the simulation was given another. Raises BackendError where that cannot be, ValueError for one of
        another network, RecordingError (a ValueError) for a file that is no checkpoint."""
        if isinstance(state, str | os.PathLike):
            from neurovis_spec.runtime.checkpoint import load_state

            state = load_state(self.network, Path(state))
        arguments.instance("state", state, State, "a state, as state() gives it, or a checkpoint")
        if state.network != self._begin.network:
            raise ValueError("this is a state of another network")
        self._check_recorded(state)
        if self._body is not None:
            self._body.take(state)
        elif state.body is not None:
            raise ValueError("this is a state of a run with a body, and this one has none")
        self._take(state.copy())
        if self._apply(self._state):
            self._reader.use(self._state)

    def _check_recorded(self, state: State) -> None:
        """Refuse another step while it is recorded: a recording holds steps in their order. Raises RecordingError."""
        if self._recorder is not None and self._recorder.going and state.k != self._state.k:
            raise RecordingError(f"it is recorded, and cannot go to step {state.k} now: close() it before")


def _resumed(
    network: Network,
    backend: str | Backend | Ready | None,
    inputs: Mapping[str, npt.ArrayLike] | None,
    begin: State,
    state: State,
) -> Simulation:
    """A simulation whose run began with one state, at another."""
    simulation = Simulation(network, backend, inputs=inputs)
    simulation._begin = begin
    simulation._take(state)
    if simulation._body is not None:
        simulation._body.take(state)
    return simulation


def _number(name: str, value: object, unit: str) -> float | None:
    """What a parameter with this unit ("" without one) is set to; None where it is no finite number. Raises
    ParameterError for a unit that does not fit."""
    written = measured(value) if unit and isinstance(value, str) else None
    if written is None:
        return arguments.finite(value)
    try:
        return number_in(unit, written)
    except UnitError as error:
        raise ParameterError(f"parameter '{name}': {error}") from None


def _reader(network: Network, output: Output) -> _Reader:
    """What reads an output from the state and the signals after a step."""
    if output.states:
        probe = probe_of(network, output.states)
        return (lambda state, signals: np.float64(probe.now(state, signals)[0])) if output.scalar else probe.now
    if output.scalar:
        index = int(output.neurons[0])
        return lambda state, _: state.activity[index]  # of an array of doubles: an np.float64
    return lambda state, _: state.activity[output.neurons]
