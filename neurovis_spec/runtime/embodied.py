"""The body of a network in a run: what it senses becomes inputs, what the network says moves it.

In: a Network with a body, and the State of a run. Out: before a step the sensors, in the vector of all inputs; behind
it the body, moved on. An episode ends with a step k where (k + 1) % ``time.episode`` is 0, and with one at which the
body says that it has ended. Behind such a step the body is reset in place of being moved, so that what a step senses,
a reward, too, belongs to the episode of that step. What of the body belongs to a State is a value, BodyState, that is
taken and put when somebody keeps one. A *port* is a sensor or an actuator, of one number or several.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from math import isfinite

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.body import Body, BodyError, Port, open_body
from neurovis_spec.compiler.body_settings import BodySettings, Moved
from neurovis_spec.compiler.names.state_references import StateOf, singles
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.language.expressions.emit import defined, emit
from neurovis_spec.likeness import suggest
from neurovis_spec.runtime.checkpoint import numbers_of
from neurovis_spec.runtime.columns import Probe, probe_of
from neurovis_spec.runtime.state import BodyState, State, constants

#: Seeds are below this: what takes them may hold 31 bits.
_SEEDS = 2.0**31
#: Gives the commands, from activities, parameters and the states that outputs name.
_Commands = Callable[[FloatArray, FloatArray, FloatArray], tuple[float, ...]]


class Embodied:
    """A network's body in a run, at the moment of a state. Raises BodyError where it cannot be opened, or has not the
    sensors and actuators that the network asks for."""

    def __init__(self, network: Network, body: Body | None = None) -> None:
        assert network.body is not None
        self._network, self._settings = network, network.body
        settings = self._settings
        if body is None:
            body = open_body(settings.kind, settings.given, settings.path, network.dt, settings.substeps)
        self.body = body
        #: the names of what is sensed, ``name`` or ``name[i]``, and how the pose is drawn
        self.sensor_names = tuple(_names(self.body.sensors))
        self.skeleton = self.body.skeleton
        #: for each input that is sensed, its places in the vector of all inputs, and the columns of what is sensed
        self._wired = _wired(network, self._settings, self.body)
        self._places, self._columns = _joined(self._wired.values())
        #: where it stands that they are held over a step
        self._held = [network.held_inputs[name] for name in self._wired if name in network.held_inputs]
        #: the inputs that were given otherwise the last time, and the places and columns of the others
        self._given: tuple[frozenset[str], IntArray, IntArray] = frozenset(), self._places, self._columns
        #: the commands of the spec, by the places of their actuators
        self._moved = {_place(self.body.actuators, one.actuator, "actuator"): one for one in self._settings.moved}
        self._commands, self._probe = _commands(network, self._moved.values())
        if self._probe.forms:
            raise BodyError(
                "a command reads a signal of a synapse", "command by activities, states and outputs of models"
            )
        self._moves = np.array(list(self._moved), dtype=np.int64)
        self._size = sum(port.size for port in self.body.actuators)
        #: the number of the episode to come or going on; whether the last step ended one
        self.episode, self.ended_episode = 0, False
        #: how many steps earlier runs had (``State.drawn``); whether the body was reset and not moved since
        self._drawn, self._fresh = 0, True
        #: what was sensed last
        self.sensed: FloatArray = np.zeros(len(self.sensor_names))

    def take(self, state: State) -> None:
        """Be where a state says. Raises BodyError where the body cannot be kept."""
        was = state.body
        if was is None and state.k > 0:
            raise BodyError("this is the state of a run without a body")
        self._drawn = state.drawn
        self.episode, self.ended_episode = (0, False) if was is None else (was.episode, was.ended_episode)
        if was is None or was.carried is None:
            self._reset()
        else:
            self.body.restore(was.carried)
            self._fresh = False

    def put(self, state: State) -> None:
        """Have a state say where the body is. Raises BodyError where it cannot be kept."""
        state.body = BodyState(self.episode, self.ended_episode, None if self._fresh else self.body.state())

    def _reset(self) -> None:
        self.body.reset(seed_of(self._network, self.episode, self._drawn))
        self._fresh = True

    def check_kept(self) -> None:
        """Refuse a body that cannot be put into a file. Raises BodyError."""
        numbers_of(self.body.state())

    @property
    def inputs(self) -> frozenset[str]:
        """The inputs that it senses."""
        return frozenset(self._wired)

    def sense(self, vector: FloatArray, given: Collection[str] = ()) -> FloatArray:
        """The vector of all inputs with what is sensed in it, but for the inputs that are ``given`` otherwise."""
        self.sensed = sensed = self.body.sense().copy()
        places, columns = self._places, self._columns
        if given:
            names = frozenset(given)
            if self._given[0] != names:
                self._given = names, *_joined(self._wired[name] for name in self._wired if name not in names)
            _, places, columns = self._given
        vector = vector.copy()
        vector[places] = sensed[columns]
        vector[self._held] = 1.0
        return vector

    def move(self, state: State) -> None:
        """Behind a step: move the body on, or end its episode. Raises BodyError."""
        ended_by_body, length = self.body.ended, self._network.episode
        ended_by_time = length is not None and state.k % length == 0
        self.ended_episode = ended_by_body or ended_by_time
        if self.ended_episode:
            self.episode += 1
        if ended_by_body or (ended_by_time and self._settings.each_episode):
            self._reset()
            return
        try:
            self.body.advance(self._network.dt, self.commands(state))
        except BodyError as error:
            raise BodyError(f"at step {state.k - 1}: {error}", error.hint, error.key) from None
        self._fresh = False

    @property
    def moved(self) -> bool:
        """Whether the last step has moved it; else its episode ended there, and it was told nothing."""
        return not self._fresh

    def commands(self, state: State) -> FloatArray:
        """What the actuators are told after a step. Raises BodyError where that is no number."""
        probed = self._probe.now(state)
        with np.errstate(all="ignore"):
            values = self._commands(state.activity, state.conditions.parameters, probed)
            result = np.zeros(self._size)
            result[self._moves] = values
            squares = result.dot(result)
        if not isfinite(squares):  # one quick test; huge numbers fail it, too, and pass those below
            for one, value in zip(self._moved.values(), values, strict=True):
                if not isfinite(value):
                    raise BodyError(f"the command of '{one.actuator}' is {float(value)}")
        return result

    def pose(self) -> FloatArray | None:
        """The pose now, None where there is nothing to draw."""
        return None if self.skeleton is None else self.body.pose().copy()

    def show(self, sensors: FloatArray, pose: FloatArray) -> None:
        """Put what was sensed last, and the pose now, into rows of a recording."""
        sensors[:] = self.sensed
        if self.skeleton is not None:
            pose[:] = self.body.pose()


def seed_of(network: Network, episode: int, drawn: int = 0) -> int:
    """What the body is reset with at the beginning of an episode: it depends on the seed of the spec, the number of the
    episode, and how many steps the runs had that this one continues (``State.drawn``), alone."""
    stream = Stream(network.seed, "body", "reset")
    return int(stream.drawn("uniform", 0.0, _SEEDS, (episode, 0, drawn, 0)))


def embodied(network: Network) -> Embodied | None:
    """The body of a network, if it has one, opened for a run. Raises BodyError."""
    return None if network.body is None else Embodied(network)


def _names(ports: Collection[Port]) -> list[str]:
    """A name for each number of ports."""
    return [name for port in ports for name in port.numbers]


def _wired(network: Network, settings: BodySettings, body: Body) -> dict[str, tuple[IntArray, IntArray]]:
    """For each input that is sensed, where it stands in the vector of all inputs and in what is sensed."""
    result = {}
    for sensed in settings.sensed:
        entry = network.inputs[sensed.input]
        columns = [place for name in sensed.sensors for place in _several(body.sensors, name, "sensor")]
        if len(columns) != entry.size:
            raise BodyError(f"the input '{entry.name}' takes {entry.size} numbers, and its sensors are {len(columns)}")
        result[entry.name] = np.arange(entry.start, entry.start + entry.size), np.array(columns, dtype=np.int64)
    return result


def _joined(parts: Iterable[tuple[IntArray, IntArray]]) -> tuple[IntArray, IntArray]:
    """The places and the columns of several inputs, one behind the other."""
    none = np.zeros(0, dtype=np.int64)
    places, columns = zip((none, none), *parts, strict=True)
    return np.concatenate(places), np.concatenate(columns)


def _commands(network: Network, moved: Collection[Moved]) -> tuple[_Commands, Probe]:
    """What gives all commands, one after the other, as code made of identifiers of our own (as the steps are), and the
    probe for the states that it reads. Two commands, one with a parameter and one of a state, become

        def commands(a, p, s):
            return (
                p[0]*a[4],
                s[0] - a[2],
            )
    """
    states: list[StateOf] = []
    begins: dict[int, int] = {}  # of each output that is states, where they begin among all
    for one in moved:
        for _, index, _ in one.outputs:
            output = network.outputs[index]
            if output.states and index not in begins:
                begins[index] = len(list(singles(states)))
                states += output.states
    namespace: dict[str, object] = {"np": np}
    clock = {}
    for number, (name, value) in enumerate(constants(network.dt).items()):
        clock[name] = f"c{number}"
        namespace[f"c{number}"] = np.float64(value)
    lines = []
    for one in moved:
        known = {**clock, **{name: f"p[{slot}]" for name, slot in one.parameters}}
        for name, index, number in one.outputs:
            neurons = network.outputs[index].neurons
            known[name] = f"s[{begins[index] + number}]" if index in begins else f"a[{int(neurons[number])}]"
        lines.append(f"        {emit(one.command, known)},")
    text = ["def commands(a, p, s):", "    return (", *lines, "    )"]
    function = defined("commands", text, "commands of a network", namespace)
    assert callable(function)
    return function, probe_of(network, states)


def _several(ports: Collection[Port], name: str, what: str) -> range:
    """Where the numbers of a port, or one of them (``name[i]``), stand among all."""
    begin = 0
    for port in ports:
        if port.name == name:
            return range(begin, begin + port.size)
        begin += port.size
    known = _names(ports)
    if name in known:
        return range(known.index(name), known.index(name) + 1)
    raise BodyError(f"the body has no {what} '{name}'", suggest(name, known, f"its {what}s are"))


def _place(ports: Collection[Port], name: str, what: str) -> int:
    """Where a single number stands."""
    places = _several(ports, name, what)
    if len(places) != 1:
        raise BodyError(f"the {what} '{name}' is {len(places)} numbers: name one of them, '{name}[0]'")
    return places[0]
