"""Importance: what the outputs lose without a neuron or an input, by lesion and by occlusion.

In: a compiled network. Out: for each neuron and each input, how far the outputs go elsewhere where it is removed
(lesion: a neuron takes no part, an input is 0) and where it no longer changes (occlusion: held at its mean).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from neurovis_spec.analysis.trials import Trials
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.named_array import Axis, NamedArray

QUANTITIES = ("lesion", "occlusion", "lesion share", "occlusion share")


def importance(
    network: CompiledNetwork,
    start: int | None = None,
    steps: int | None = None,
    inputs: Mapping[str, npt.ArrayLike] | None = None,
    of: str | Sequence[str] | None = None,
    progress: Progress | None = None,
) -> NamedArray:
    """A row for each input and each neuron that is not itself an output: the root mean square of the difference of the
    outputs from those of the intact network, and the share of it in how much these vary (1: as if they were held at
    their mean). See ``Trials`` for the arguments. NaN where the network cannot be held so."""
    return importance_by(Trials(network, start, steps, inputs, of), progress)


def importance_by(trials: Trials, progress: Progress | None = None) -> NamedArray:
    """``importance`` for trials that have been prepared."""
    network = trials.network
    names = network.neurons.names
    own = [index for index in range(len(names)) if index not in set(trials.outputs.tolist())]
    labels = [*(entry.name for entry in network.inputs), *(names[index] for index in own)]
    twice = {entry.name for entry in network.inputs} & set(names)
    labels = [f"input {label}" if place < len(network.inputs) and label in twice else label
              for place, label in enumerate(labels)]  # fmt: skip
    found: list[tuple[float, float]] = []
    for entry in network.inputs:
        with np.errstate(all="ignore"):
            mean = trials.given[:, entry.start : entry.start + entry.size].mean(axis=0)
        silent = trials.with_input(entry, np.zeros_like)
        held = trials.with_input(entry, lambda _, mean=mean: mean)  # type: ignore[misc]
        found.append((_apart(trials, silent), _apart(trials, held)))
        _tell(progress, len(found), len(labels))
    for index in own:
        with np.errstate(all="ignore"):
            level = float(trials.activity[:, index].mean())
        removed = trials.changed(lambda simulation, name=names[index]: simulation.lesion(name))  # type: ignore[misc]
        occluded = float("nan")
        if np.isfinite(level):
            clamped = trials.changed(lambda simulation, name=names[index], x=level: simulation.clamp(name, x))  # type: ignore[misc]
            occluded = _apart(trials, clamped)
        found.append((_apart(trials, removed), occluded))
        _tell(progress, len(found), len(labels))
    lost = np.array(found, dtype=np.float64).reshape(-1, 2)
    with np.errstate(all="ignore"):
        varies = float(np.sqrt(np.mean((trials.intact - trials.intact.mean(axis=0)) ** 2)))
        share = lost / varies if varies > 0 else np.full_like(lost, np.nan)
    values = np.concatenate([lost, share], axis=1)
    return NamedArray("importance", values, Axis("without", tuple(labels)), Axis("quantity", QUANTITIES))


def _apart(trials: Trials, outputs: FloatArray) -> float:
    with np.errstate(all="ignore"):
        return float(np.sqrt(np.mean((outputs - trials.intact) ** 2)))


def _tell(progress: Progress | None, done: int, total: int) -> None:
    if progress is not None:
        progress(done, total)
