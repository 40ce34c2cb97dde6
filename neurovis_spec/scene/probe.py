"""The probe: a run whose only purpose is to see how far the values of a network go.

In: a network. Out: Gains. The run is the network's own (its inputs, its default length, within a bound), never
somebody's recording, so that a picture of a step is the same wherever the step comes from.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene.gains import Gains, choose_gains

#: Most numbers that a probe records: 32 MB of activities and weights.
BUDGET = 4_000_000
#: Rows looked at together.
_CHUNK = 256


def probe_steps(network: Network) -> int:
    """How many steps the gains of a network take: none where its spec states all of them."""
    settings = network.render
    if None not in (settings.activity, settings.signal, settings.thickness, settings.change):
        return 0
    width = len(network.neurons) + len(network.changing) + 1
    return max(1, min(network.steps, BUDGET // width))


def probe(network: Network, progress: Progress | None = None, made: Recording | None = None) -> Gains:
    """The gains of a network: what its spec states, else from the peaks of its default run. Where this is ``made``, as
    far as they need it or further, it is not run again."""
    settings, steps = network.render, probe_steps(network)
    if not steps:
        none = np.zeros(len(network.connections))
        return choose_gains(network, settings, np.zeros(len(network.neurons)), none, none, none)
    if made is None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # the run that the author asks for warns
            made = record(network, steps, progress=progress)
    rows = slice(steps)
    recording = replace(
        made, step=made.step[rows], activity=made.activity[rows], weights=made.weights[rows], states=made.states[rows]
    )
    with np.errstate(over="ignore", invalid="ignore"):  # what is no finite number counts for nothing
        return choose_gains(network, settings, *peaks(network, recording))


def peaks(network: Network, recording: Recording) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Largest magnitudes over a recording: of a (n,), of w, of w·a and of w[t] − w[t−1] (m,)."""
    connections = network.connections
    activity = np.abs(recording.activity).max(axis=0, initial=0.0)
    weights = np.abs(connections.weights).astype(np.float64)
    changes = np.zeros(len(connections))
    signals = weights * activity[connections.sources]
    changing = network.changing
    if len(changing):
        sources = connections.sources[changing]
        weights[changing] = np.abs(recording.weights).max(axis=0, initial=0.0)
        signals[changing] = 0.0
        for first in range(0, len(recording.weights), _CHUNK):
            rows = slice(first, first + _CHUNK)
            w = recording.weights[rows]
            sent = np.abs(w * recording.activity[rows][:, sources]).max(axis=0, initial=0.0)
            signals[changing] = np.fmax(signals[changing], sent)
            step = np.abs(np.diff(recording.weights[first : first + _CHUNK + 1], axis=0)).max(axis=0, initial=0.0)
            changes[changing] = np.fmax(changes[changing], step)
    return activity, weights, signals, changes
