"""The watch: one warning, at once, when an activity or a weight is no longer a finite number.

In: the State after a step. Out: at most one RuntimeWarning in a run, which names the neuron or connection and the step.
"""

from __future__ import annotations

import math
import warnings

import numpy as np

from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.state import State


class Watch:
    """Looks at the state after each step until it has warned."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._learns = bool(network.plasticity)
        self.warned = False

    def look(self, state: State) -> None:
        """Warn if something of the step just made is NaN or infinite."""
        # a sum of squares is finite only if all terms are: one cheap product instead of a test each
        if math.isfinite(state.activity.dot(state.activity)) and (
            not self._learns or math.isfinite(state.weights.dot(state.weights))
        ):
            return
        if not self.warned:
            self._name(state)

    def _name(self, state: State) -> None:
        step = state.k - 1
        bad = np.flatnonzero(~np.isfinite(state.activity))
        if len(bad):
            value, name = state.activity[bad[0]], self._network.neurons.names[bad[0]]
            self._warn(f"the activity of {name} is {value} at step {step}")
            return
        bad = np.flatnonzero(~np.isfinite(state.weights))
        if len(bad):
            value, name = state.weights[bad[0]], self._network.connection_names[bad[0]]
            self._warn(f"the weight of {name} is {value} after step {step}")

    def _warn(self, message: str) -> None:
        self.warned = True
        warnings.warn(f"{message}, in '{self._network.name}'", RuntimeWarning, stacklevel=4)
