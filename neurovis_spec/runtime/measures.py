"""Measures of a run: ``rms(O - T, last=129)`` for the networks at hand, step by step or many steps at a time.

In: the text of a measure, a Network, activities. Out: a Measure, whose names mean neurons and parameters, or SpecError
with every finding; a Meter, which gives its value after each step; of a Recording, its values after all of them.
"""

from __future__ import annotations

import copy
import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.body import BodyError
from neurovis_spec.compiler.names.state_references import StateOf, singles
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import SPIKE
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.expressions.evaluate import evaluate, evaluate_array
from neurovis_spec.language.expressions.functions import rows_of
from neurovis_spec.language.expressions.measures import COUNTED, PLACE, SPIKES, Formula, Summary, parse_measure
from neurovis_spec.language.expressions.parser import ExpressionError
from neurovis_spec.language.expressions.tree import Name, Tree, is_square, names, walk
from neurovis_spec.language.references import Arrow, parse_sum, state_of
from neurovis_spec.likeness import suggest
from neurovis_spec.runtime.columns import Probe, probe_of, spiking_of
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.errors import RecordingError, UnknownNameError
from neurovis_spec.runtime.names import Names, names_of
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.references import find_states
from neurovis_spec.runtime.state import Conditions, constants, initial_state
from neurovis_spec.runtime.windows import running

#: Names that mean the same in every measure.
_OF_TIME: Final = ("k", "t", "dt", "pi", "e")

LABEL = "<measure>"
#: what becomes of values (steps, members) of a group
_ACROSS: Final[Mapping[str, Callable[[FloatArray], FloatArray]]] = {
    "mean": lambda values: np.mean(values, axis=1),
    "rms": lambda values: np.sqrt(np.mean(values * values, axis=1)),
    "min": lambda values: np.min(values, axis=1),
    "max": lambda values: np.max(values, axis=1),
    "count": lambda values: np.sum((values != 0) & (values == values), axis=1).astype(np.float64),
}


@dataclass(frozen=True, eq=False)
class Measure:
    """A measure of the runs of a network."""

    formula: Formula
    #: for each neuron that it names its index
    neurons: Mapping[str, int]
    #: for each reference to several that stands in a window or a count their indices, as many in all of one of these
    groups: Mapping[str, IntArray]
    #: for each parameter its slot, the index of its value
    slots: Mapping[str, int]
    #: for each state its column among those that ``probe`` reads, for each number of a sensor that behind these
    states: Mapping[str, int]
    #: for each reference to several states, or to a sensor of several numbers, that stands in a window or a count their
    #: columns
    state_groups: Mapping[str, IntArray]
    #: for each reference whose rate is asked for the neurons that it names whose activity is a spike, the others, and
    #: the states that are the spikes of these
    spikes: Mapping[str, tuple[IntArray, IntArray, tuple[str, ...]]]
    probe: Probe
    #: the numbers of sensors that it reads
    sensors: tuple[str, ...]
    #: seconds a step
    dt: float
    #: where the text stands, in findings
    label: str

    @property
    def text(self) -> str:
        """As it is written."""
        return self.formula.text

    @property
    def longest(self) -> int:
        """How many steps have to be made before it has a value."""
        return self.formula.longest

    @property
    def together(self) -> bool:
        """Whether ``Meter.rows`` gives the bits of ``Meter.step``, from activities and parameters alone: no function
        takes part that NumPy works out by itself."""
        trees = _trees(self.formula)
        return not self.states and not any(_by_numpy(node) for tree in trees for node in walk(tree))

    def check_steps(self, steps: int) -> None:
        """Refuse a window that is longer than a run of so many steps. Raises SpecError."""
        findings = findings_of(self.text, self.label)
        for window in self.formula.windows:
            if window.last is not None and window.last > steps:
                message = f"the last {window.last} steps of a run of {steps}: there are not so many"
                hint = "make more steps, or 'last' smaller"
                findings.error("bad-window", _span(self.label, window.start, window.end), message, hint)
        findings.check()


def _by_numpy(node: Tree) -> bool:
    """Whether NumPy works out a part of a formula in its own way: of 0 and −0, which are equal, its ``min`` takes
    either. A square is a product to both."""
    if is_square(node) is not None:
        return False
    return any(row.agree != "bits" for row in rows_of(node))


def findings_of(text: str, label: str) -> Findings:
    """An empty collection of findings about a measure."""
    return Findings({label: text})


def parsed(text: str, label: str, *, bounded: bool = False) -> Formula:
    """The formula of a measure, its names not yet looked up; ``bounded``: every window needs its ``last``. Raises
    SpecError."""
    text = text.replace("\n", " ").replace("\r", " ")  # a finding counts the columns of one line
    findings = findings_of(text, label)
    formula = None
    try:
        formula = parse_measure(text)
    except ExpressionError as error:
        for one in (error, *error.others):
            findings.error(one.code, _span(label, one.start, one.end), one.message, one.hint)
    for window in () if formula is None or not bounded else formula.windows:
        if window.last is None:
            message = f"'{window.called}' here needs the number of steps that it is of"
            hint = f"write '{window.called}(…, last=100)' for the last hundred"
            findings.error("bad-window", _span(label, window.start, window.end), message, hint)
    findings.check()
    assert formula is not None
    return formula


def resolved(formula: Formula, network: Network, label: str) -> Measure:
    """The measure for the runs of a network. Raises SpecError for names that mean nothing, or not one number."""
    directory, findings = names_of(network), findings_of(formula.text, label)
    neurons: dict[str, int] = {}
    groups: dict[str, IntArray] = {}
    slots: dict[str, int] = {}
    states: dict[str, StateOf] = {}
    spikes: dict[str, tuple[IntArray, IntArray, tuple[str, ...]]] = {}
    sensors: dict[str, None] = {}
    several_states: dict[str, tuple[str, ...]] = {}
    places = {PLACE(number) for number in range(len(formula.windows))}
    places |= {COUNTED(number) for number in range(len(formula.counts))}
    for tree in _trees(formula):
        named = [node for node in walk(tree) if isinstance(node, Name) and node.name not in places]
        several = {} if tree is formula.tree else _several(named, directory)
        groups |= {node.name: members for node, members in several.items()}
        sizes = {node: len(members) for node, members in several.items()}
        for node in named:
            found = () if tree is formula.tree else _states_of(node.name, network, directory)
            if len(found) > 1:
                single = network.state_names(found)
                states |= dict(zip(single, found, strict=True))
                several_states[node.name], sizes[node] = single, len(single)
                continue
            span = _span(label, node.start, node.end)
            if sensed := _sensed(node.name, network, directory):
                sensors |= dict.fromkeys(sensed)
                if len(sensed) > 1 and tree is formula.tree:
                    _report_several(node.name, f"{len(sensed)} numbers of a sensor", sensed[0], span, findings)
                elif len(sensed) > 1:
                    several_states[node.name], sizes[node] = sensed, len(sensed)
            elif node.name.startswith(SPIKES):
                _resolve_spikes(node.name, span, network, directory, spikes, states, findings)
            elif node not in several and not _resolve_state(node.name, span, network, directory, states, findings):
                _resolve(node.name, span, network, directory, neurons, slots, findings)
        _check_sizes(sizes, label, findings)
    for one in formula.counts:
        if {*groups, *several_states}.isdisjoint(names(one.tree)):
            message, hint = "'count' is of the neurons of a group", "write 'count(E > 0.5)', with a group"
            findings.error("not-one-number", _span(label, one.start, one.end), message, hint)
    findings.check()
    columns = {name: column for column, name in enumerate((*states, *sensors))}
    probe = probe_of(network, states.values())
    of_several = {
        name: np.array([columns[one] for one in single], dtype=np.int64) for name, single in several_states.items()
    }
    return Measure(
        formula, neurons, groups, slots, columns, of_several, spikes, probe, tuple(sensors), network.dt, label
    )


def _sensed(name: str, network: Network, directory: Names) -> tuple[str, ...]:
    """What the numbers of a sensor of the body are called, or the one of them that is named so; none where the name
    means anything else, or nothing."""
    sensors = {} if network.body is None else network.body.sensors
    numbers = sensors.get(name) or tuple(one for own in sensors.values() for one in own if one == name)
    if not numbers or name in _OF_TIME or name in network.parameters or not isinstance(directory.find(name), str):
        return ()
    return () if any(output.name == name for output in network.outputs) else numbers


def sensed_columns(measure: Measure, names: Sequence[str] | None) -> IntArray:
    """Where the numbers of sensors that a measure reads stand among all that are sensed, which have these names; None
    where nothing is. Raises BodyError for one that is not there."""
    missing = next((name for name in measure.sensors if name not in (names or ())), None)
    if missing is not None:
        why = "there is no body" if names is None else suggest(missing, names, "its sensors are")
        raise BodyError(f"'{missing}' of '{measure.text}' is not sensed: {why or 'the body has no sensors'}")
    return np.array([(names or ()).index(name) for name in measure.sensors], dtype=np.int64)


def _states_of(name: str, network: Network, directory: Names) -> list[StateOf]:
    """The states that a name means, one by one; none where it means anything else, or nothing."""
    output = next((one for one in network.outputs if one.name == name and one.states), None)
    found = () if output is None else output.states
    if output is None and not name.startswith(SPIKES) and isinstance(directory.find(name), str):
        with suppress(UnknownNameError):
            found = tuple(find_states(network, name, directory))
    return [StateOf.of(what, state, np.array([index])) for state, what, index in singles(found)]


def _several(named: Iterable[Name], directory: Names) -> dict[Name, IntArray]:
    """The names that are references to several neurons, and these."""
    found = {node: directory.find(node.name) for node in named if not node.name.startswith(SPIKES)}
    return {
        node: np.array(one.neurons, dtype=np.int64)
        for node, one in found.items()
        if not isinstance(one, str) and not one.single
    }


def _check_sizes(sizes: Mapping[Name, int], label: str, findings: Findings) -> None:
    """Report a reference that is not to as many as the one before it."""
    for (first, before), (node, size) in pairwise(sizes.items()):
        if size != before:
            message = f"'{shorten(node.name)}' is {size} numbers, and '{shorten(first.name)}' {before}"
            hint = "what is computed of two groups is computed one by one: take as many of both"
            findings.error("not-one-number", _span(label, node.start, node.end), message, hint)


def measure_of(text: str, network: Network, label: str, *, bounded: bool = False) -> Measure:
    """The measure that a text is for the runs of a network: ``parsed`` and ``resolved``. Raises SpecError."""
    return resolved(parsed(text, label, bounded=bounded), network, label)


def _trees(formula: Formula) -> tuple[Tree, ...]:
    """All trees of a formula, its own first."""
    return formula.tree, *(window.tree for window in formula.windows), *(one.tree for one in formula.counts)


def _resolve_state(
    name: str, span: Span, network: Network, directory: Names, states: dict[str, StateOf], findings: Findings
) -> bool:
    """Whether a name is a state, or an output that is one. It is put into ``states`` then, or, where it is several or
    none of the network, reported."""
    output = next((one for one in network.outputs if one.name == name and one.states), None)
    if output is None:
        (part,) = parse_sum(name)
        state = state_of(part)
        if state is None or not isinstance(directory.find(name), str):
            return False
        if not isinstance(state.owner, Arrow) and isinstance(directory.find(state.owner.text), str):
            return False
        try:
            named = find_states(network, name, directory)
        except UnknownNameError as error:
            findings.error("unknown-name", span, str(error))
            return True
    else:
        named = output.states
    first = next(one for one in named if one.size)
    if sum(one.size for one in named) == 1:
        states[name] = first
    else:
        (one,) = network.state_names([StateOf(first.state, first.neurons[:1], first.connections[:1])])
        _report_several(name, f"{sum(state.size for state in named)} states", one, span, findings)
    return True


def _report_several(name: str, what: str, one: str, span: Span, findings: Findings) -> None:
    """Report a name that is ``what``, where a single number is wanted."""
    message = f"'{shorten(name)}' is {what}, and no single one"
    findings.error("not-one-number", span, message, f"name one of them, as in '{one}'")


def _resolve_spikes(
    name: str,
    span: Span,
    network: Network,
    directory: Names,
    spikes: dict[str, tuple[IntArray, IntArray, tuple[str, ...]]],
    states: dict[str, StateOf],
    findings: Findings,
) -> None:
    """Whose spikes a rate is of: put into ``spikes``, and into ``states`` what tells them, or reported."""
    reference = name.removeprefix(SPIKES)
    found = directory.find(reference)
    if isinstance(found, str):
        findings.error("unknown-name", span, found)
        return
    neurons, spiking = np.array(found.neurons, dtype=np.int64), spiking_of(network)
    silent = np.setdiff1d(neurons, spiking.neurons)
    if len(silent):
        message = f"'{network.neurons.names[int(silent[0])]}' does not spike, as its model says"
        findings.error("not-one-number", span, message, "a rate is of neurons that spike; of others write mean(…)")
        return
    others = np.intersect1d(neurons, spiking.by_state)
    own = [StateOf.of("neuron", SPIKE, others[at : at + 1]) for at in range(len(others))]
    names = network.state_names(own)
    states |= dict(zip(names, own, strict=True))
    spikes[name] = np.intersect1d(neurons, spiking.by_activity), others, tuple(names)


def _resolve(
    name: str,
    span: Span,
    network: Network,
    directory: Names,
    neurons: dict[str, int],
    slots: dict[str, int],
    findings: Findings,
) -> None:
    """What a name means that is no state: put into ``neurons`` or ``slots``, or reported."""
    # a name is a neuron or a value (a parameter, or of the time), not both; ``found`` is a text where it is no neuron
    is_value, found = name in _OF_TIME or name in network.parameters, directory.find(name)
    if isinstance(found, str):
        if not is_value:
            sensors = () if network.body is None else tuple(network.body.sensors)
            known = (*network.neuron_index, *directory.views, *network.parameters, *sensors, *_OF_TIME)
            hint = suggest(name, known, "neurons, outputs and parameters")
            message = f"there is no neuron, output or parameter '{shorten(name)}'"
            findings.error("unknown-name", span, message, hint)
        elif name in network.parameters:
            slots[name] = network.settable.index[name]
    elif is_value:
        what = "a parameter" if name in network.parameters else "a constant" if name in ("pi", "e") else "the time"
        what = "the duration of a step" if name == "dt" else what
        hint = "give the neuron an output of another name"
        findings.error("not-one-number", span, f"'{name}' is a neuron and {what}", hint)
    elif not found.single:
        first = network.neurons.names[found.neurons[0]]
        message = f"'{shorten(name)}' is {_counted(len(found.neurons))}, and no single one"
        hint = f"name one of them, as in '{first}', or sum them up: mean({shorten(name)}), count({shorten(name)} > 0.5)"
        findings.error("not-one-number", span, message, hint)
    else:
        neurons[name] = found.neurons[0]


def _counted(number: int) -> str:
    return "a list of one neuron" if number == 1 else f"{number} neurons"


def _span(label: str, start: int, end: int) -> Span:
    return Span(label, 1, 1, 1, 1).within(start, end)


class Meter:
    """The value of a measure after each step of a run, whose first is step ``first``; ``made`` is how many there
    were."""

    def __init__(self, measure: Measure, first: int = 0) -> None:
        self.measure = measure
        self.first = first
        self.made = 0
        self._running = [running(window.summary, window.last) for window in measure.formula.windows]
        self._constants = constants(measure.dt)
        several = {*measure.groups, *measure.state_groups}
        #: of each window whether it is of the neurons of a group, or of their states
        self._grouped = [not several.isdisjoint(names(window.tree)) for window in measure.formula.windows]
        #: the value of each window after the last step
        self.values: list[float] = [math.nan] * len(self._running)

    def copy(self) -> Meter:
        """An independent copy with the values so far."""
        other = copy.copy(self)
        other._running, other.values = copy.deepcopy(self._running), list(self.values)
        return other

    def step(self, activity: FloatArray, conditions: Conditions, states: FloatArray) -> float:
        """After one more step: a[t] of all neurons, the conditions of the step, the states of the probe and behind them
        what its sensors measured. NaN before the measure has a value."""
        known = dict(self._constants)
        for name, index in self.measure.neurons.items():
            known[name] = float(activity[index])
        for name, slot in self.measure.slots.items():
            known[name] = float(conditions.parameters[slot])
        for name, column in self.measure.states.items():
            known[name] = float(states[column])
        for name in self.measure.spikes:
            known[name] = float(self._rate(name, activity[None], conditions, states[None])[0])
        k = self.first + self.made
        known["k"] = float(k)
        known["t"] = k * self.measure.dt
        self.made += 1
        for number, one in enumerate(self.measure.formula.counts):
            known[COUNTED(number)] = float(self._across("count", one.tree, known, activity[None], states[None])[0])
        for number, window in enumerate(self.measure.formula.windows):
            if self._grouped[number]:
                now = float(self._across(window.summary, window.tree, known, activity[None], states[None])[0])
            else:
                now = evaluate(window.tree, known)
            value = self._running[number].push(now)
            self.values[number] = known[PLACE(number)] = value
        return math.nan if self.made < self.measure.longest else evaluate(self.measure.formula.tree, known)

    def _rate(self, name: str, activity: FloatArray, conditions: Conditions, states: FloatArray) -> FloatArray:
        """How many of the neurons of a reference fire at each of some steps, a neuron and a second, (steps,). The
        states of a lesioned neuron go on, and it fires for nobody."""
        neurons, others, of_states = self.measure.spikes[name]
        columns = np.array([self.measure.states[state] for state in of_states], dtype=np.int64)
        heard = columns[~conditions.lesioned_neurons[others]]
        fired = np.count_nonzero(activity[:, neurons], axis=1) + np.count_nonzero(states[:, heard], axis=1)
        result: FloatArray = fired / ((len(neurons) + len(columns)) * self.measure.dt)
        return result

    def _across(
        self,
        how: Summary | Literal["count"],
        tree: Tree,
        known: Mapping[str, float | FloatArray],
        activity: FloatArray,
        states: FloatArray,
    ) -> FloatArray:
        """A formula of the neurons of a group at each of some steps, summed up over them, (steps,). What is known of
        each step, (steps,), is the same for all of them."""
        read: dict[str, float | FloatArray] = {}
        size = 1
        for name in names(tree):
            members, columns = self.measure.groups.get(name), self.measure.state_groups.get(name)
            if members is not None:
                read[name], size = activity[:, members], len(members)
            elif columns is not None:
                read[name], size = states[:, columns], len(columns)
            else:
                value = known[name]
                read[name] = value.reshape(-1, 1) if isinstance(value, np.ndarray) else value
        values = np.broadcast_to(evaluate_array(tree, read), (len(activity), size))
        with np.errstate(all="ignore"):
            return _ACROSS[how](values)

    def rows(self, activity: FloatArray, conditions: Conditions, states: FloatArray) -> FloatArray:
        """After each of some more steps, all under the same conditions: a row of ``activity`` and ``states`` a step."""
        count = len(activity)
        known: dict[str, float | FloatArray] = dict(self._constants)
        known |= {name: activity[:, index] for name, index in self.measure.neurons.items()}
        known |= {name: float(conditions.parameters[slot]) for name, slot in self.measure.slots.items()}
        known |= {name: states[:, column] for name, column in self.measure.states.items()}
        known |= {name: self._rate(name, activity, conditions, states) for name in self.measure.spikes}
        begin = self.first + self.made
        k = np.arange(begin, begin + count).astype(np.float64)
        known |= {"k": k, "t": k * self.measure.dt}
        for number, one in enumerate(self.measure.formula.counts):
            known[COUNTED(number)] = self._across("count", one.tree, known, activity, states)
        for number, window in enumerate(self.measure.formula.windows):
            if self._grouped[number]:
                now = self._across(window.summary, window.tree, known, activity, states)
            else:
                now = _broadcast(window.tree, known, count)
            values = self._running[number].extend(now)
            known[PLACE(number)] = values
            if count:
                self.values[number] = float(values[-1])
        result = _broadcast(self.measure.formula.tree, known, count)
        missing = self.measure.longest - 1 - self.made
        if missing > 0:
            result[:missing] = math.nan
        self.made += count
        return result


def _broadcast(tree: Tree, known: Mapping[str, float | FloatArray], count: int) -> FloatArray:
    read = {name: known[name] for name in names(tree)}
    return np.array(np.broadcast_to(evaluate_array(tree, read), (count,)), dtype=np.float64)


def over(text: str, network: Network, recording: Recording) -> FloatArray:
    """What a measure is after each step of a recording, (rows,); NaN while it has no value. Parameters are those that
    the network and its events give. Raises SpecError, BodyError where a sensor was not recorded, and RecordingError for
    a recording of another network or of some steps only."""
    first = int(recording.step[0]) if len(recording) else 0
    meter = Meter(measure_of(text, network, LABEL), first)
    if recording.neurons != network.neurons.names:
        raise RecordingError("a measure is of a recording of all neurons of the network, and this one has others")
    stop = first + len(recording)
    if not np.array_equal(recording.step, np.arange(first, stop)):
        raise RecordingError("a measure is of every step, and the recording holds some of them only")
    states = _states(meter.measure.probe.names, recording)
    if meter.measure.sensors:
        sensors = recording.sensors
        columns = sensed_columns(meter.measure, None if sensors is None else recording.sensor_names)
        states = np.concatenate((states, np.zeros((len(recording), 0)) if sensors is None else sensors[:, columns]), 1)
    state, controls = initial_state(network), Controls(network)
    edges = sorted({first, stop, *(change.at for change in network.changes if first < change.at < stop)})
    changes = deque(sorted(network.changes, key=lambda change: change.at))
    parts = [np.zeros(0)]
    for begin, end in pairwise(edges):
        while changes and changes[0].at <= begin:
            with np.errstate(all="ignore"):
                controls.apply(state, changes.popleft())
        rows = slice(begin - first, end - first)
        parts.append(meter.rows(recording.activity[rows], state.conditions, states[rows]))
    return np.concatenate(parts)


def _states(names: Sequence[str], recording: Recording) -> FloatArray:
    """The columns of these states, of spikes as a recording has them beside."""
    index, found = {name: place for place, name in enumerate(recording.neurons)}, list[FloatArray]()
    spiking = set() if recording.spiking is None else set(recording.spiking.tolist())
    for name in names:
        neuron = index.get(name.removesuffix(f".{SPIKE}"))
        if name in recording.state_names:
            found.append(recording.states[:, recording.state_names.index(name)])
        elif name.endswith(f".{SPIKE}") and neuron in spiking:
            fired = recording.spike_steps[recording.spike_neurons == neuron]
            found.append(np.isin(recording.step, fired).astype(np.float64))
        else:
            raise RecordingError(f"the state '{name}' was not recorded")
    return np.stack(found, axis=1) if found else np.zeros((len(recording), 0))
