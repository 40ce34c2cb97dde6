"""Series: the numbers that views over time show, what they are called, and which a view shows by itself.

In: a network, a Recording of it, Curves. Out: arrays, a value a row; names; the curves of a view that names none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.drawing.drawing_settings import Curve, Panel
from neurovis_spec.compiler.names.given import GIVEN
from neurovis_spec.compiler.names.state_references import StateOf
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import SYNAPSE
from neurovis_spec.layout.labels import names_in_parts, parts_of
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene.shown_states import ShownStates


def values_of(curve: Curve, network: Network, recording: Recording) -> FloatArray:
    """The numbers of a curve, (rows,). Raises RecordingError where they were not recorded."""
    name = full_name(curve, network)
    if curve.state or curve.of == "input":
        if name not in recording.state_names:
            hint = f"record it (neurovis run --states '{name}')"
            what = "the state " if curve.state else ""
            raise RecordingError(f"the recording does not hold {what}'{name}', which the figure shows: {hint}")
        return recording.states[:, recording.state_names.index(name)]
    try:
        return recording[name] if curve.of == "neuron" else recording.weight(name)
    except KeyError as error:
        raise RecordingError(str(error)) from None


def full_name(curve: Curve, network: Network) -> str:
    """How the spec calls it: ``K1``, ``K1 -> O``, ``K1.v``, ``(K1 -> O).eligibility``, ``touch[2].given``."""
    if curve.of == "input":
        return network.given_names[curve.index]
    if curve.state:
        one = StateOf.of(curve.of, curve.state, np.array([curve.index], dtype=np.int64))
        return network.state_names([one])[0]
    return network.neurons.names[curve.index] if curve.of == "neuron" else network.connection_names[curve.index]


def short_names(curves: Sequence[Curve], network: Network) -> list[tuple[str, str]]:
    """What a picture calls each of them, and a subscript: labels of neurons, an arrow for a connection, the name of an
    input."""
    labels, names = parts_of(network.neurons), names_in_parts(network.neurons)
    found: list[tuple[str, str]] = []
    for curve in curves:
        if curve.of == "input":
            found.append((full_name(curve, network).removesuffix(f".{GIVEN}"), ""))
            continue
        if curve.of == "connection":
            name = network.connection_names[curve.index].replace("->", "→")
            found.append((f"({name}).{curve.state}" if curve.state else name, ""))
            continue
        path, dot, _ = network.neurons.names[curve.index].rpartition(".")
        base, subscript = names[curve.index] if dot else labels[curve.index]
        own = f"{path}{dot}{base}"
        found.append((f"{own}{subscript}.{curve.state}", "") if curve.state else (own, subscript))
    return found


def kind_of(curves: Sequence[Curve]) -> str:
    """What they all are, in a word or two."""
    kinds = {_kind_of(curve) for curve in curves}
    return ", ".join(kind for kind in ("activity", "weight", "signal", "state", "input") if kind in kinds)


def _kind_of(curve: Curve) -> str:
    if curve.of == "input":
        return "input"
    if curve.of == "neuron":
        return "state" if curve.state else "activity"
    return {"": "weight", SYNAPSE.gives: "signal"}.get(curve.state, "state")


def states_of(panels: Sequence[Panel], network: Network) -> tuple[str, ...]:
    """The states that have to be recorded for these views, and what inputs are given."""
    curves = [curve for panel in panels for curve in (panel.shown or chosen(panel.view, network))]
    recorded = (curve for curve in curves if curve.state or curve.of == "input")
    return tuple(dict.fromkeys(full_name(curve, network) for curve in recorded))


def chosen(view: str, network: Network) -> tuple[Curve, ...]:
    """What a view shows that names nothing: traces the outputs, then what takes in inputs, else all neurons, of these
    the states that they show; a raster all neurons; weights those that can change."""
    if view == "weights":
        return tuple(Curve("connection", index) for index in network.changing.tolist())
    every = range(len(network.neurons))
    if view != "traces":
        return tuple(Curve("neuron", index) for index in every) if view == "raster" else ()
    found: dict[Curve, None] = {}
    for output in network.outputs:
        for state in output.states:
            found.update(dict.fromkeys(Curve("neuron", index, state.state) for index in state.neurons.tolist()))
            rules = (Curve("connection", index, state.state) for index in state.connections.tolist())
            found.update(dict.fromkeys(rules))
        if not output.states:
            found.update(dict.fromkeys(Curve("neuron", index) for index in output.neurons.tolist()))
    taking = [index for group in network.neurons.groups if group.role == "output" for index in group.indices]
    taking += [index for group in network.neurons.groups if group.input is not None for index in group.indices]
    states = ShownStates(network).called
    more = taking if found or taking else every
    found.update(dict.fromkeys(Curve("neuron", index, states[index]) for index in more))
    return tuple(found)
