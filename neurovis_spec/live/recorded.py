"""A recording as a source: its steps, forward and back, as they were recorded.

In: a Network and a Recording of it. Out: a Source in which nothing can be set, clamped or lesioned by hand. What is
lesioned is what the spec's events say.
"""

from __future__ import annotations

from bisect import bisect_left

import numpy as np

from neurovis_spec.compiler.events.changes import Clamp
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.history import Recorded
from neurovis_spec.live.source import Capabilities, Mask, Reach, Seen, SourceError, Turned, drawn, recalled
from neurovis_spec.live.turns import Turn
from neurovis_spec.runtime.fitting import fitted
from neurovis_spec.runtime.recording import Recording, RecordingError
from neurovis_spec.scene.fading import snapshots_of
from neurovis_spec.scene.lesions import lesions_of


class RecordedSource:
    """The steps of a recording; it stands at the first. Raises RecordingError for one of another network, a partial or
    an empty one."""

    capabilities = Capabilities(ends=True)

    def __init__(self, network: Network, recording: Recording) -> None:
        self.network, self._recording = network, fitted(recording, network)
        self._recording.check_whole("a live view cannot show")
        if not len(recording):
            raise RecordingError("the recording holds no step")
        first = None if recording.pose is None else recording.pose[0]
        self.body = drawn(recording.skeleton, recording.sensor_names, first)
        self._steps: list[int] = recording.step.tolist()
        self._lesions = lesions_of(network)
        self._row = 0
        self.history = Recorded(self._recording)

    @property
    def step(self) -> int:
        """The current step."""
        return self._steps[self._row]

    @property
    def reach(self) -> Reach:
        """The first and the last step."""
        return Reach(self._steps[0], self._steps[-1])

    @property
    def turned(self) -> tuple[Turned, ...]:
        """Nothing was changed by hand."""
        return ()

    @property
    def parameters(self) -> dict[str, float]:
        """Nothing can be set."""
        return {}

    @property
    def fed(self) -> dict[str, tuple[float, ...]]:
        """No input is given by hand."""
        return {}

    @property
    def learning(self) -> dict[str, bool | None]:
        """No rule can be stopped."""
        return {}

    def seen(self) -> Seen:
        """What a picture of the current step is made from."""
        neurons, connections = np.zeros(len(self.network.neurons), bool), np.zeros(len(self.network.connections), bool)
        for mask, lesions in ((neurons, self._lesions.neurons), (connections, self._lesions.connections)):
            mask[[index for index, step in lesions.items() if step <= self.step]] = True
        (snapshot,) = snapshots_of(self.network, self._recording, [self.step])
        return Seen(snapshot, neurons, connections, self._clamped())

    def _clamped(self) -> Mask:
        """Which neurons events clamp at this step; clamps by hand are no part of a recording."""
        held: dict[int, Clamp] = {}
        for change in self.network.changes:
            if change.at <= self.step:
                held = {order: clamp for order, clamp in held.items() if clamp.event not in change.released}
                held |= {clamp.order: clamp for clamp in change.clamps}
        clamped = np.zeros(len(self.network.neurons), bool)
        for clamp in held.values():
            clamped[clamp.neurons] = True
        return clamped

    def advance(self) -> bool:
        """Go on by one row; False at the end."""
        if self._row == len(self._steps) - 1:
            return False
        self._row += 1
        return True

    def number_after(self, by: int) -> int:
        """The step so many rows further on, or back."""
        return self._steps[min(max(self._row + by, 0), len(self._steps) - 1)]

    def go(self, step: int) -> None:
        """Go to a step, or the next one that was recorded. Raises SourceError."""
        if not self._steps[0] <= step <= self._steps[-1]:
            raise SourceError(
                f"step {step} is not in the recording, which goes from {self._steps[0]} to {self._steps[-1]}"
            )
        self._row = bisect_left(self._steps, step)

    def restart(self) -> None:
        """Back to its first step."""
        self._row = 0

    def recall(self, steps: int) -> list[Seen]:
        """What was seen of the last steps."""
        return recalled(self, steps)

    def branch(self) -> None:
        """Raises SourceError: a recording stays as it is."""
        raise SourceError("a recording cannot go on differently: run the spec")

    def turn(self, turn: Turn) -> None:
        """Raises SourceError: a recording stays as it is."""
        raise SourceError("a recording cannot be changed: run the spec")
