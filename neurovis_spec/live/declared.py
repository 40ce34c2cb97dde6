"""Declared: what a user can change in a run (by ``turns``), as data for the page.

In: a compiled network. Out: the parameters that can be set, each with its name, the value that it begins with, its
bounds where it has some, its description and its unit; the inputs without a source, with the sensors that they are and
the units of these; and the rules that can be stopped.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compilation import Compilation
from neurovis_spec.compiler.events.settable import Dependent
from neurovis_spec.compiler.network import Network
from neurovis_spec.describe import wired
from neurovis_spec.language.sections import InputModel
from neurovis_spec.live.turns import rules


def declared(compiled: Compilation) -> dict[str, list[dict[str, object]]]:
    """All that can be changed."""
    network, written = compiled.network, compiled.spec.inputs
    inputs = [entry for entry in network.inputs if not entry.has_source]
    sensed = _sensed(network)
    return {
        "parameters": parameters(compiled),
        "inputs": [
            {"name": entry.name, "size": entry.size, "description": _about(entry.name, written, sensed)}
            for entry in inputs
        ],
        "rules": [{"connections": rule.connections, "rule": rule.written} for rule in rules(network)],
    }


def words_of(network: Network) -> list[str]:
    """The names that a measure can have beside those of neurons, connections, sensors and parameters."""
    groups = (group.name for group in network.neurons.groups if len(group.indices) > 1)
    return [*dict.fromkeys((*groups, *(output.name for output in network.outputs)))]


def _about(name: str, written: Mapping[str, InputModel], sensed: Mapping[str, str]) -> str:
    """The description of an input, and which sensors it is."""
    own = written[name].description if name in written else None
    return "; ".join(text for text in ("" if own is None else own.value, sensed.get(name, "")) if text)


def _sensed(network: Network) -> dict[str, str]:
    """The sensors that inputs are, with their units, by the names of the inputs."""
    found = None if network.body is None else wired(network)
    result: dict[str, str] = {}
    for port, inputs in () if found is None else found.sensors:
        for name in inputs:
            text = f"{port.name} ({port.unit})" if port.unit else port.name
            result[name] = f"{result[name]}, {text}" if name in result else f"senses {text}"
    return result


def parameters(compiled: Compilation) -> list[dict[str, object]]:
    """The parameters in the order written; bounds that follow other parameters are as these begin."""
    network, written = compiled.network, compiled.spec.parameters
    settable = network.settable
    result: list[dict[str, object]] = []
    for name, value in network.parameters.items():
        if name not in network.structural:
            slot = settable.slots[settable.index[name]]
            low, high = (_bound(bound, settable.parameters) for bound in (slot.low, slot.high))
            about, unit = (written[name].about, written[name].measure) if name in written else ("", "")
            words = {"description": about, "unit": unit}
            result.append({"name": name, "value": value, "low": low, "high": high, **words})
    return result


def _bound(bound: float | Dependent, parameters: FloatArray) -> float | None:
    """A bound, None where there is none."""
    number = bound if isinstance(bound, float) else float(bound.values(parameters))
    return number if math.isfinite(number) else None
