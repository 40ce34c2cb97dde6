"""Curves: what a page shows of a run before anybody has asked: outputs, their targets, the error, and what each episode
brings.

In: a network as it is drawn. Out: Curves. A rule with a target says what its neurons are to be; the error is what the
heading of the picture says, step by step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.history import Members
from neurovis_spec.live.series import Series, Steps, episodes
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene.caption import aims
from neurovis_spec.scene.collapse import Gathered

#: The most curves.
_MOST: Final = 3
#: What a page shows of a neuron that is the raster of its group.
RASTER: Final = "*"


@dataclass(frozen=True, slots=True)
class Curve:
    """Signals in one axis: their ``items``, as a page asks for them, the first of them in front, with their names."""

    items: tuple[str, ...]
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Error:
    """How far activities are from what they are to be, as a series."""

    members: Members
    reads: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    back: int = 1

    def begin(self, first: int) -> Error:
        """It remembers nothing."""
        return self

    def copy(self) -> Error:
        """It changes nothing."""
        return self

    def rows(self, steps: Steps) -> FloatArray:
        """The error of each step."""
        return np.asarray(self.members.join(steps.activity[:, self.members.read]), np.float64)

    def recorded(self, recording: Recording, steps: Steps) -> FloatArray:
        """The error of each step of a recording."""
        return self.rows(steps)


@dataclass(frozen=True, slots=True)
class Curves:
    """Those that a page begins with, and the ``errors`` that can be asked for as ``e0``, …; behind them in ``series``
    all that can be asked for so."""

    shown: tuple[Curve, ...]
    errors: tuple[Members, ...]
    series: tuple[str, ...]


def series_of(network: Network) -> Mapping[str, tuple[str, Series]]:
    """What a run of a network has as ``e0``, …: its error, and what episodes bring, with what it is called."""
    called, pairs = network.neurons.names, aims(network)
    found = list[tuple[str, Series]]()
    if pairs:
        told = "error (RMS)" if len(pairs) > 1 else f"{called[pairs[0][0]]} − {called[pairs[0][1]]}"
        found.append((told, Error(_error(pairs))))
    found += episodes(network).items()
    return {f"e{at}": one for at, one in enumerate(found)}


def _error(pairs: list[tuple[int, int]]) -> Members:
    """How far neurons are from what they are to be."""
    sources, targets = (np.array(ends, dtype=np.int64) for ends in zip(*pairs, strict=True))
    return Members("neurons", sources, "rms" if len(pairs) > 1 else "mean", targets)


def curves_of(drawn: Gathered) -> Curves:
    """What a page begins with."""
    series = series_of(drawn.whole)
    learning = tuple(Curve((item,), (told,)) for item, (told, _) in series.items())
    begun = _of_targets(drawn) or _of_outputs(drawn) or _of_spikes(drawn)
    errors = tuple(one.members for _, one in series.values() if isinstance(one, Error))
    return Curves((*begun[: _MOST - len(learning)], *learning), errors, tuple(series))


def _of_targets(drawn: Gathered) -> tuple[Curve, ...]:
    """Outputs with what they are to be."""
    glyphs, unit = drawn.network.neurons.names, drawn.unit
    pairs = dict.fromkeys((int(unit[target]), int(unit[source])) for source, target in aims(drawn.whole))
    return tuple(Curve(tuple(f"n{one}" for one in pair), tuple(glyphs[one] for one in pair)) for pair in pairs)


def _of_outputs(drawn: Gathered) -> tuple[Curve, ...]:
    """The activities that leave the network, or of neurons which the spec calls outputs."""
    network, names = drawn.whole, drawn.network.neurons.names
    found = [int(neuron) for output in network.outputs if not output.states for neuron in output.neurons]
    found = found or [index for group in network.neurons.groups if group.role == "output" for index in group.indices]
    items = [*dict.fromkeys(int(drawn.unit[neuron]) for neuron in found)]
    return tuple(Curve((f"n{item}",), (names[item],)) for item in items[:_MOST])


def _of_spikes(drawn: Gathered) -> tuple[Curve, ...]:
    """The raster of the first group that fires."""
    fires = np.flatnonzero(drawn.whole.spiking)
    if not len(fires):
        return ()
    item = int(drawn.unit[fires[0]])
    return (Curve((f"n{item}.{RASTER}",), (drawn.network.neurons.names[item],)),)
