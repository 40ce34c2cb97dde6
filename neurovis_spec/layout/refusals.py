"""Refusals: what is asked of an engine that it cannot do, or that nobody can.

In: what is asked, by a LayoutProblem or by a network's settings, and what an engine declares that it can do. Out:
nothing, or a LayoutRefusalError. No engine runs for it, so that ``neurovis validate`` can say what ``neurovis layout``
would refuse.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile

import numpy as np

from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.engines import engines_that, they_can
from neurovis_spec.layout.geometry import distance
from neurovis_spec.layout.model import (
    RADIUS,
    Capabilities,
    Direction,
    LayoutProblem,
    LayoutRefusalError,
    Point,
)
from neurovis_spec.layout.naming import natural_key

#: Rounding in the last bit does not make two pins overlap.
_SLACK = 1e-9
#: So many neurons are named in a message.
_SHOWN = 5


@dataclass(frozen=True, slots=True)
class Requirements:
    """What is asked of an engine. Neurons are meant by their place in ``neurons``; ``known`` are those whose data say
    where they are."""

    neurons: Sequence[str]
    connections: int
    pins: Mapping[int, Point]
    known: frozenset[int]
    arrange: Sequence[tuple[Sequence[int], str]]
    align: Sequence[Sequence[int]]
    direction: Direction
    boxes: bool
    mirrors: bool
    plan: bool
    memory: bool


def asked_by(problem: LayoutProblem) -> Requirements:
    """What a problem asks for."""
    return Requirements(
        problem.neurons,
        len(problem.edges),
        problem.pins,
        frozenset(i for i, (x, y) in enumerate(problem.places) if math.isfinite(x + y)),
        problem.arrange,
        problem.align,
        problem.direction,
        bool(problem.boxes),
        bool(problem.mirrors),
        bool(problem.plan),
        problem.memory is not None,
    )


def asked_of(network: Network, memory: bool) -> Requirements:
    """What the settings of a network ask for, with a ``memory`` of an earlier layout or without."""
    settings = network.layout
    return Requirements(
        network.neurons.names,
        len(network.connections),
        settings.positions,
        frozenset(np.flatnonzero(np.isfinite(network.neurons.position).all(axis=1)).tolist()),
        settings.arrange,
        settings.align,
        settings.direction,
        bool(settings.boxes) or any(group.box is not None for group in network.neurons.groups),
        bool(settings.mirrors),
        bool(settings.plan),
        memory,
    )


def refuse(wanted: Requirements, name: str, can: Capabilities) -> None:
    """Raise LayoutRefusalError for the first thing that is asked for beyond what the engine of this name can do, or
    that contradicts itself."""
    _refuse_size(wanted, name, can)
    _refuse_without_place(wanted, name, can)
    asked: Sequence[tuple[str, bool, Callable[[Capabilities], bool], str]] = (
        ("layout-pins-unsupported", bool(wanted.pins), lambda it: it.pins, "keep pinned positions (layout.positions)"),
        ("layout-arrange-unsupported", bool(wanted.arrange), lambda it: it.arrange, "arrange groups (layout.arrange)"),
        ("layout-boxes-unsupported", wanted.boxes, lambda it: it.boxes, "keep the members of a box together"),
        ("layout-mirror-unsupported", wanted.mirrors, lambda it: it.mirrors, "draw mirror images (layout.mirror)"),
        ("layout-align-unsupported", bool(wanted.align), lambda it: it.align, "put neurons on one line (layout.align)"),
        ("layout-plan-unsupported", wanted.plan, lambda it: it.plan, "put cells in rows and columns (layout.plan)"),
        ("layout-memory-unsupported", wanted.memory, lambda it: it.memory, "remember a layout (layout.file)"),
        (
            "layout-direction-unsupported",
            wanted.direction != "down",
            lambda it: it.direction,
            "draw in another direction",
        ),
    )
    for code, needed, does, words in asked:
        if needed and not does(can):
            hint = they_can(engines_that(does))
            raise LayoutRefusalError(code, f"the engine '{name}' cannot {words}", hint)
    _refuse_contradictions(wanted)
    _refuse_close_pins(wanted)


def _refuse_contradictions(wanted: Requirements) -> None:
    """Raise LayoutRefusalError where a neuron is arranged twice, or a line holds neurons that an arrangement keeps off
    it."""
    arranged: dict[int, tuple[int, str]] = {}
    for number, (whole, how) in enumerate(wanted.arrange):
        for member in _together(wanted, whole):
            if member in arranged:
                name = wanted.neurons[member]
                raise LayoutRefusalError("arranged-twice", f"'{name}' is arranged twice", "arrange it once", (name,))
            arranged[member] = number, how
    along = "column" if wanted.direction in ("down", "up") else "row"
    for line in wanted.align:
        first: dict[int, int] = {}
        for member in line:
            number, how = arranged.get(member, (-1, ""))
            if how == along and (mate := first.setdefault(number, member)) != member:
                names = wanted.neurons[mate], wanted.neurons[member]
                raise LayoutRefusalError(
                    "align-conflict",
                    f"'{names[0]}' and '{names[1]}' cannot stand on one line: what they belong to holds them apart",
                    about=names,
                )


def _together(wanted: Requirements, members: Sequence[int]) -> Sequence[int]:
    """Those of the members of an arrangement that it arranges: they stand in no instance that is within what all have
    in common."""
    paths = [wanted.neurons[member].split(".")[:-1] for member in members]
    if not any(paths):
        return members
    both = zip(min(paths), max(paths), strict=False)
    common = sum(1 for _ in takewhile(lambda steps: steps[0] == steps[1], both))
    return [member for member, path in zip(members, paths, strict=True) if len(path) == common]


def _refuse_size(wanted: Requirements, name: str, can: Capabilities) -> None:
    neurons, edges = len(wanted.neurons), wanted.connections
    if neurons > can.neurons or edges > can.edges:
        raise LayoutRefusalError(
            "layout-too-large",
            f"the engine '{name}' draws at most {can.neurons} neurons and {can.edges} connections; "
            f"this network has {neurons} and {edges}",
        )


def _refuse_without_place(wanted: Requirements, name: str, can: Capabilities) -> None:
    if can.free and not can.places:
        return
    known = wanted.known if can.places else frozenset[int]()
    if can.places and (known or wanted.pins):
        return
    free = [n for i, n in enumerate(wanted.neurons) if i not in wanted.pins and i not in known]
    if not free:
        return
    free.sort(key=natural_key)
    shown = ", ".join(f"'{one}'" for one in free[:_SHOWN])
    more = f" and {len(free) - _SHOWN} more" if len(free) > _SHOWN else ""
    has = "has" if len(free) == 1 else "have"
    if can.places:
        message = f"the engine '{name}' draws neurons where their 'position' says; {shown}{more} {has} none"
        hint = "give some of them a position, or pin them under layout.positions"
    else:
        message = f"the engine '{name}' needs a position for every neuron; {shown}{more} {has} none"
        hint = "give it one in layout.positions, or leave the engine out: another arranges the rest around the pins"
    raise LayoutRefusalError("position-missing", message, hint, tuple(free))


def _refuse_close_pins(wanted: Requirements) -> None:
    """Two pins whose discs would overlap, found through cells as wide as a disc."""
    cells: dict[tuple[int, int], list[int]] = {}
    for index, (x, y) in sorted(wanted.pins.items()):
        if not (math.isfinite(x) and math.isfinite(y)):
            name = wanted.neurons[index]
            raise LayoutRefusalError("pin-not-finite", f"the pin of '{name}' is not finite", about=(name,))
        column, row = math.floor(x / (2 * RADIUS)), math.floor(y / (2 * RADIUS))
        for near in ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
            for other in cells.get(near, ()):
                if distance(wanted.pins[other], (x, y)) < 2 * RADIUS - _SLACK:
                    raise LayoutRefusalError(
                        "pins-too-close",
                        f"the pins of '{wanted.neurons[other]}' and '{wanted.neurons[index]}' are closer than "
                        f"{2 * RADIUS:g}: their discs would overlap",
                        about=(wanted.neurons[other], wanted.neurons[index]),
                    )
        cells.setdefault((column, row), []).append(index)
