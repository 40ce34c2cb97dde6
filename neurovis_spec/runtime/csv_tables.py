"""A network as tables: neurons and edges as ``.csv``, which a spec reads back.

In: a Network, the weights that it has, what the spec calls the columns of its edge files. Out: the texts of
``neurons.csv`` and ``edges.csv``.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.tables import EdgeFile
from neurovis_spec.language.units import TIMES


class EdgeNames(NamedTuple):
    """What the columns of edges are called, and the unit of delays; None: they are steps."""

    names: Mapping[str, str]
    unit: str | None = None

    @staticmethod
    def of(files: Iterable[EdgeFile]) -> EdgeNames:
        """Those of edge files, where all that name any name the same; else ours."""
        found = {
            (tuple((what, name.value) for what, name in file.columns), None if file.unit is None else file.unit.value)
            for file in files
            if file.columns is not None
        }
        if len(found) != 1:
            return EdgeNames({})
        ((names, unit),) = found
        return EdgeNames(dict(names), unit)


def csv_tables(network: Network, weights: FloatArray, edges: EdgeNames) -> dict[str, str]:
    """The texts of the files by name, with a weight for each connection."""
    return {"neurons.csv": _text(_neurons(network)), "edges.csv": _text(_edges(network, weights, edges))}


def _text(columns: Mapping[str, Sequence[object]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([[*columns], *zip(*columns.values(), strict=True)])
    return text.getvalue()


def _neurons(network: Network) -> dict[str, Sequence[object]]:
    """A column for what any neuron has, by its name."""
    neurons = network.neurons
    columns: dict[str, Sequence[object]] = {
        "name": neurons.names,
        "group": [group.name for group in neurons.groups for _ in group.indices],
    }
    if not np.isnan(neurons.position).all():
        axes = zip("xyz", neurons.position.T, strict=False)  # as many as positions have numbers
        columns |= {axis: _cells(values) for axis, values in axes}
    columns["bias"] = neurons.bias.tolist()
    if not np.isnan(neurons.initial).all():
        columns["initial"] = _cells(neurons.initial)
    if any(label != name.rpartition(".")[2] for label, name in zip(neurons.labels, neurons.names, strict=True)):
        columns["label"] = neurons.labels
    boxes = {neuron: title for title, members in network.layout.boxes for neuron in members}
    boxes |= {neuron: group.box for group in neurons.groups if group.box is not None for neuron in group.indices}
    if boxes:
        columns["box"] = [boxes.get(neuron, "") for neuron in range(len(neurons.names))]
    return columns


def _edges(network: Network, weights: FloatArray, edges: EdgeNames) -> dict[str, Sequence[object]]:
    """A row for each connection; of symmetric ones for one of each two."""
    lines, names = network.connections, network.neurons.names
    rows = np.setdiff1d(np.arange(len(lines)), lines.second)
    columns: dict[str, Sequence[object]] = {
        edges.names.get("from", "from"): [names[i] for i in lines.sources.whole()[rows].tolist()],
        edges.names.get("to", "to"): [names[i] for i in lines.targets.whole()[rows].tolist()],
        edges.names.get("weight", "weight"): weights[rows].tolist(),
    }
    steps, exact = lines.delays.whole()[rows], None if lines.lags is None else lines.lags.whole()[rows]
    if edges.unit is not None:
        factor = Fraction(network.dt) / TIMES[edges.unit]
        times = steps if exact is None else np.where(np.isnan(exact), steps, exact)
        columns[edges.names["delay"]] = [float(Fraction(time) * factor) for time in times.tolist()]
    elif exact is None:
        columns[edges.names.get("delay", "delay")] = steps.tolist()
    else:
        whole = np.isnan(exact)
        columns[edges.names.get("delay", "delay")] = [
            s if w else "" for s, w in zip(steps.tolist(), whole, strict=True)
        ]
        columns["delay_seconds"] = _cells(exact * network.dt)
    entries, texts = lines.entries, {"label": lines.own_labels, network.render.style: lines.styles}
    for name, own in texts.items():
        if own is not None and name not in columns:
            columns[name] = [own.of(row) for row in rows.tolist()]
    return {**columns, "entry": [entries[i] for i in lines.entry.whole()[rows].tolist()]}


def _cells(values: FloatArray) -> list[object]:
    return ["" if value != value else value for value in values.tolist()]
