"""A measure over a recording, all steps at a time.

In: the text of a measure, a Network, a Recording of it. Out: the value after each step.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.conditions import Controls
from neurovis_spec.runtime.measures import Meter, measure_of
from neurovis_spec.runtime.recording import Recording, RecordingError
from neurovis_spec.runtime.state import initial_state

LABEL = "<measure>"


def over(text: str, network: Network, recording: Recording) -> FloatArray:
    """What a measure is after each step of a recording, (steps,); NaN while it has no value. Parameters are those that
    the network and its events give. Raises SpecError, and RecordingError for a recording of another network or of some
    steps only."""
    meter = Meter(measure_of(text, network, LABEL))
    if recording.neurons != network.neurons.names:
        raise RecordingError("a measure is of a recording of all neurons of the network, and this one has others")
    steps = len(recording)
    if not np.array_equal(recording.step, np.arange(steps)):
        raise RecordingError("a measure is of every step from step 0 on, and the recording holds some of them only")
    states = _states(meter.measure.probe.names, recording)
    state, controls = initial_state(network), Controls(network)
    changes = {change.at: change for change in network.changes}
    parts = []
    for begin, end in pairwise([0, *(at for at in changes if 0 < at < steps), steps]):
        if begin in changes:
            with np.errstate(all="ignore"):
                controls.apply(state.conditions, state.weights, state.signals, changes[begin])
        parts.append(meter.rows(recording.activity[begin:end], state.conditions.parameters, states[begin:end]))
    return np.concatenate(parts)


def _states(names: Sequence[str], recording: Recording) -> FloatArray:
    """The columns of these states."""
    for name in names:
        if name not in recording.state_names:
            raise RecordingError(f"the state '{name}' was not recorded")
    return recording.states[:, [recording.state_names.index(name) for name in names]]
