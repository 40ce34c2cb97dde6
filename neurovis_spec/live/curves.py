"""Curves: what a page shows of a run before anybody has asked: outputs, their targets, and the error.

In: a network as it is drawn. Out: Curves. A rule with a target says what its neurons are to be; the error is what the
heading of the picture says, step by step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from neurovis_spec.live.history import Members
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


@dataclass(frozen=True, slots=True)
class Curves:
    """Those that a page begins with, and what can be asked for as ``e0``, …: the errors."""

    shown: tuple[Curve, ...]
    errors: tuple[Members, ...]


def curves_of(drawn: Gathered) -> Curves:
    """What a page begins with."""
    network = drawn.whole
    called, glyphs, pairs = network.neurons.names, drawn.network.neurons.names, aims(network)
    if not pairs:
        return Curves(_of_outputs(drawn) or _of_spikes(drawn), ())
    sources, targets = (np.array(ends, dtype=np.int64) for ends in zip(*pairs, strict=True))
    told = "error (RMS)" if len(pairs) > 1 else f"{called[sources[0]]} − {called[targets[0]]}"
    ends = dict.fromkeys((int(drawn.unit[target]), int(drawn.unit[source])) for source, target in pairs)
    both = tuple(Curve(tuple(f"n{one}" for one in pair), tuple(glyphs[one] for one in pair)) for pair in ends)
    error = Members("neurons", sources, "rms" if len(pairs) > 1 else "mean", targets)
    return Curves((*both[: _MOST - 1], Curve(("e0",), (told,))), (error,))


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
