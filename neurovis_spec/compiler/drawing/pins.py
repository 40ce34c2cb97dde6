"""Pins: where neurons are put by hand, in the spec and in modules.

In: ``layout.positions`` of every scope. Out: the places of neurons that are known, and for instances the places of
their neurons relative to their origins, and these origins, as far as they are known. A pin of the spec names a neuron
or an instance, whose origin it is then, and wins over what a module says; a module's pins are relative to the
instance's origin.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple, TypeAlias

from neurovis_spec.compiler.names.references import Directory, check_keys, key_of, resolve_end
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.drawing import LayoutModel, ModuleLayoutModel
from neurovis_spec.language.located import Located
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import Pair

Place: TypeAlias = tuple[float, float]

#: The diameter of a neuron's disc, and how far out anything may be asked to stand (units of the layout).
DIAMETER: Final = 0.6
FARTHEST: Final = 1e6


class Pins(NamedTuple):
    """Where neurons are put by hand."""

    #: by neuron
    places: Mapping[int, Place]
    #: by the path of an instance the pins of its module, relative to the instance's origin
    relative: tuple[tuple[str, Mapping[int, Place]], ...]
    #: by the path of an instance its origin, where that is known
    origins: Mapping[str, Place]
    #: where the place of each neuron was said
    spans: Mapping[int, Span]


class _Pin(NamedTuple):
    """A place, and where it was said."""

    x: float
    y: float
    key: Located[str]
    span: Span

    def moved(self, by: Place) -> _Pin:
        return _Pin(self.x + by[0], self.y + by[1], self.key, self.span)

    def at(self, origin: _Pin) -> _Pin:
        """The pin of an instance whose origin was said elsewhere."""
        return _Pin(self.x + origin.x, self.y + origin.y, origin.key, origin.span)


class _ScopePins(NamedTuple):
    """The pins that one scope says."""

    #: by neuron
    neurons: dict[int, _Pin]
    #: the origins of instances, by the place of their scope
    origins: dict[int, _Pin]


def pins_of(scopes: tuple[Scope, ...], census: Census, findings: Findings) -> Pins:
    """All pins. Those closer than 0.6 to each other are a finding."""
    pins_of_scope = [
        _scope_pins(scope, directory, findings) for scope, directory in zip(scopes, census.directories, strict=True)
    ]
    placed: dict[int, _Pin] = dict(pins_of_scope[0].neurons)
    pinned = set(placed)  # an outer scope wins
    # for each scope the instance whose origin its pins are relative to, and the way there from that origin
    frames: list[tuple[int, Place]] = [(0, (0.0, 0.0))]
    #: the pins relative to the origin of an instance, by the place of its scope
    relative: dict[int, dict[int, _Pin]] = {}
    for index in range(1, len(scopes)):
        frames.append(_frame(index, scopes, pins_of_scope, frames))
        base, shift = frames[index]
        for neuron, pin in pins_of_scope[index].neurons.items():
            if neuron not in pinned:
                relative.setdefault(base, {})[neuron] = pin.moved(shift)
            pinned.add(neuron)
    _check_placing(pins_of_scope, census, pinned, findings)
    origins = pins_of_scope[0].origins
    for base, pins in sorted(relative.items()):
        if base in origins:
            placed.update({neuron: pin.at(origins[base]) for neuron, pin in pins.items()})
        else:
            _check_distances(pins, census.neurons.names, len(scopes[base].called("")), findings)
    _check_distances(placed, census.neurons.names, 0, findings)
    return Pins(
        {neuron: (pin.x, pin.y) for neuron, pin in placed.items()},
        tuple(
            (scopes[base].path, {neuron: (pin.x, pin.y) for neuron, pin in pins.items()})
            for base, pins in sorted(relative.items())
        ),
        {scopes[index].path: (pin.x, pin.y) for index, pin in origins.items()},
        {neuron: pin.span for pins in (placed, *relative.values()) for neuron, pin in pins.items()},
    )


def _check_placing(pins_of_scope: list[_ScopePins], census: Census, pinned: set[int], findings: Findings) -> None:
    """A module that pins an instance within it needs pins in that one: they are what is placed."""
    for pins in pins_of_scope[1:]:
        for index, pin in pins.origins.items():
            if pinned.isdisjoint(census.directories[index].members):
                message = f"'{pin.key.value}' has no pins of its own that this could place"
                hint = "give its module 'layout: {positions: …}', or leave this pin out"
                findings.error("bad-pin", pin.key.span, message, hint)


def _frame(
    index: int, scopes: tuple[Scope, ...], pins_of_scope: list[_ScopePins], frames: list[tuple[int, Place]]
) -> tuple[int, Place]:
    """What the pins of an instance are relative to: its own origin, unless a module around it says where that is, the
    outermost first."""
    found: tuple[int, _Pin] | None = None
    outer = scopes[index].parent
    while outer > 0:
        pin = pins_of_scope[outer].origins.get(index)
        if pin is not None:
            found = outer, pin
        outer = scopes[outer].parent
    if found is None or index in pins_of_scope[0].origins:
        return index, (0.0, 0.0)
    base, (x, y) = frames[found[0]]
    return base, (x + found[1].x, y + found[1].y)


def _scope_pins(scope: Scope, directory: Directory, findings: Findings) -> _ScopePins:
    """The pins of a scope; what is invalid is reported and left out."""
    result = _ScopePins({}, {})
    model = scope.section.layout
    if model is None:
        return result
    check_keys(model.source, "positions", model.positions, directory, findings)
    for key, point in _points(model):
        x, y = scope.constants.scalar(point.first), scope.constants.scalar(point.second)
        if x is UNKNOWN or y is UNKNOWN:
            if not directory.instance(key.value):
                _neuron(key, directory, findings)
            continue
        if max(abs(x), abs(y)) > FARTHEST:
            findings.error("out-of-range", point.span, f"a pin lies within {FARTHEST:g} of the origin")
            continue
        pin = _Pin(x, y, key, point.span)
        instances = directory.instance(key.value)
        if len(instances) > 1:
            message = f"'{shorten(key.value)}' is {len(instances)} instances; a pin names one"
            findings.error("bad-pin", key.span, message, f"pin {key.value}1 and the others one by one")
            continue
        found = instances[0].scope if instances else _neuron(key, directory, findings)
        if found is UNKNOWN:
            continue
        known = result.origins if instances else result.neurons
        if found in known:
            line = known[found].key.span.line
            findings.error("duplicate-pin", key.span, f"'{key.value}' is pinned already (line {line})")
            continue
        known[found] = pin
    return result


def _points(model: LayoutModel | ModuleLayoutModel) -> Iterator[tuple[Located[str], Pair]]:
    for name, point in model.positions.items():
        yield key_of(model.source, "positions", name), point


def _neuron(key: Located[str], directory: Directory, findings: Findings) -> int | Unknown:
    """The one neuron that a key names; UNKNOWN, and a finding, where it names none or several."""
    members = resolve_end(key, directory, findings)
    if members is not UNKNOWN and len(members) != 1:
        message = f"'{shorten(key.value)}' is {len(members)} neurons; a pin names one"
        findings.error("bad-pin", key.span, message, "pin its neurons one by one, or use 'arrange'")
        return UNKNOWN
    return UNKNOWN if members is UNKNOWN else members[0]


def _check_distances(pins: Mapping[int, _Pin], names: tuple[str, ...], skip: int, findings: Findings) -> None:
    """Report pins that are closer than discs are wide, each once as it is written. Each is compared with those in the
    cells next to its own. ``skip``: so many characters of the names are those of the instance that they are in."""
    cells: dict[tuple[int, int], list[tuple[int, _Pin]]] = {}
    reported: set[Span] = set()
    for neuron, pin in pins.items():
        column, row = math.floor(pin.x / DIAMETER), math.floor(pin.y / DIAMETER)
        near = (other for i in (-1, 0, 1) for j in (-1, 0, 1) for other in cells.get((column + i, row + j), ()))
        for partner, other in near:
            if math.dist((other.x, other.y), (pin.x, pin.y)) < DIAMETER - 1e-9 and pin.span not in reported:
                reported.add(pin.span)
                shown_pair = f"'{names[neuron][skip:]}' and '{names[partner][skip:]}' (line {other.key.span.line})"
                findings.error("pins-overlap", pin.span, f"the pins of {shown_pair} are closer than {DIAMETER}")
                break
        cells.setdefault((column, row), []).append((neuron, pin))
