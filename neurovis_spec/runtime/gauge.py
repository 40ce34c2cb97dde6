"""A measure over a recording, all steps at a time.

In: the text of a measure, a Network, a Recording of it. Out: the value after each step.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.measures import Meter, measure_of
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.state import initial_state

LABEL = "<measure>"


def over(text: str, network: Network, recording: Recording) -> FloatArray:
    """What a measure is after each step of a recording, (rows,); NaN while it has no value. Parameters are those that
    the network and its events give. Raises SpecError, and RecordingError for a recording of another network or of some
    steps only."""
    first = int(recording.step[0]) if len(recording) else 0
    meter = Meter(measure_of(text, network, LABEL), first)
    if recording.neurons != network.neurons.names:
        raise RecordingError("a measure is of a recording of all neurons of the network, and this one has others")
    stop = first + len(recording)
    if not np.array_equal(recording.step, np.arange(first, stop)):
        raise RecordingError("a measure is of every step, and the recording holds some of them only")
    states = _states(meter.measure.probe.names, recording)
    state, controls = initial_state(network), Controls(network)
    edges = sorted({first, stop, *(change.at for change in network.changes if first < change.at < stop)})
    changes = deque(sorted(network.changes, key=lambda change: change.at))
    parts = [np.zeros(0)]
    for begin, end in pairwise(edges):
        while changes and changes[0].at <= begin:
            with np.errstate(all="ignore"):
                controls.apply(state, changes.popleft())
        rows = slice(begin - first, end - first)
        parts.append(meter.rows(recording.activity[rows], state.conditions.parameters, states[rows]))
    return np.concatenate(parts)


def _states(names: Sequence[str], recording: Recording) -> FloatArray:
    """The columns of these states."""
    for name in names:
        if name not in recording.state_names:
            raise RecordingError(f"the state '{name}' was not recorded")
    return recording.states[:, [recording.state_names.index(name) for name in names]]
