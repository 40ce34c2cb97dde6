"""The course of a run: all that says what it is, in one value, from whoever asks for it down to the recorder.

In: how long, what of it is kept, what it runs on, where it goes on from. Out: a Course; ``record`` makes the run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy.typing as npt

from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.columns import ALL, Keep
from neurovis_spec.runtime.embodied import Embodied

if TYPE_CHECKING:
    from neurovis_spec.runtime.backend import Backend, Ready
    from neurovis_spec.runtime.recording import Recording
    from neurovis_spec.runtime.until import Until


@dataclass(frozen=True)
class Course:
    """What a run is. Raises ValueError for steps that cannot be counted."""

    #: those to be made; None: ``time.steps`` of the network
    steps: int | None = None
    #: one step in so many is kept
    every: int = 1
    #: arrays that replace the sources of inputs (``InputReader``)
    inputs: Mapping[str, npt.ArrayLike] | None = None
    #: what computes; None: what has made the steps before, else what is chosen (``ready``)
    backend: str | Backend | Ready | None = None
    #: the recording to go on from
    start: Recording | None = None
    #: whether of that nothing but the weights is taken
    weights_alone: bool = False
    #: what may end it earlier
    until: Until | None = None
    #: what of a step is recorded
    keep: Keep = ALL
    #: the file from which it goes on exactly, if it is there, and which holds its state at the end
    checkpoint: Path | None = None
    #: the network's body, opened; None where it has none, or is yet to be opened
    body: Embodied | None = None

    def __post_init__(self) -> None:
        steps = 0 if self.steps is None else self.steps
        if steps < 0 or self.every < 1:
            raise ValueError(f"{steps} steps, every {self.every}: at least 0 and at least 1 are needed")

    def length(self, network: Network) -> int:
        """How many steps are to be made of this network."""
        return network.steps if self.steps is None else self.steps

    def embodied(self, network: Network) -> Course:
        """The same with the network's body opened, if it has one. Raises BodyError."""
        return self if network.body is None or self.body is not None else replace(self, body=Embodied(network))
