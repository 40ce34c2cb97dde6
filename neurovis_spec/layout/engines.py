"""Layout engines: by name, by what they can do, and what is asked of one that it cannot do, or that nobody can.

In: a name, what is wanted, what a LayoutProblem asks. Out: the engines that are installed; nothing, or a
LayoutRefusalError. No engine runs for that, so that ``neurovis validate`` can say what ``neurovis layout`` would
refuse.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import takewhile
from operator import attrgetter

import numpy as np

from neurovis_spec import plugins
from neurovis_spec.layout.geometry import near_pairs
from neurovis_spec.layout.model import (
    RADIUS,
    Arrangement,
    Capabilities,
    LayoutEngine,
    LayoutProblem,
    LayoutRefusalError,
)
from neurovis_spec.layout.naming import natural_key
from neurovis_spec.likeness import suggest

#: Rounding in the last bit does not make two pins overlap.
_SLACK = 1e-9
#: So many neurons are named in a message.
_SHOWN = 5


def refuse(problem: LayoutProblem, name: str, can: Capabilities) -> None:
    """Raise LayoutRefusalError for the first thing that is asked for beyond what the engine of this name can do, or
    that contradicts itself."""
    _refuse_size(problem, name, can)
    _refuse_without_place(problem, name, can)
    for code, ability, needed, words in (
        ("layout-pins-unsupported", "pins", problem.pins, "keep pinned positions (layout.positions)"),
        ("layout-arrange-unsupported", "arrange", problem.arrange, "arrange groups (layout.arrange)"),
        ("layout-boxes-unsupported", "boxes", problem.boxes, "keep the members of a box together"),
        ("layout-mirror-unsupported", "mirrors", problem.mirrors, "draw mirror images (layout.mirror)"),
        ("layout-align-unsupported", "align", problem.align, "put neurons on one line (layout.align)"),
        ("layout-plan-unsupported", "plan", problem.plan, "put cells in rows and columns (layout.plan)"),
        ("layout-memory-unsupported", "memory", problem.memory is not None, "remember a layout (layout.file)"),
        ("layout-direction-unsupported", "direction", problem.direction != "down", "draw in another direction"),
    ):
        able = attrgetter(ability)
        if needed and not able(can):
            raise LayoutRefusalError(code, f"the engine '{name}' cannot {words}", they_can(engines_that(able)))
    _refuse_contradictions(problem)
    _refuse_close_pins(problem)


def _refuse_contradictions(problem: LayoutProblem) -> None:
    """Raise LayoutRefusalError where a neuron is arranged twice, or a line holds neurons that an arrangement keeps off
    it."""
    arranged: dict[int, tuple[int, Arrangement]] = {}
    for number, (whole, how) in enumerate(problem.arrange):
        for member in _together(problem, whole):
            if member in arranged:
                name = problem.neurons[member]
                raise LayoutRefusalError("arranged-twice", f"'{name}' is arranged twice", "arrange it once", (name,))
            arranged[member] = number, how
    along = "column" if problem.direction in ("down", "up") else "row"
    for line in problem.align:
        first: dict[int, int] = {}
        for member in line:
            number, way = arranged.get(member, (-1, None))
            if way == along and (mate := first.setdefault(number, member)) != member:
                names = problem.neurons[mate], problem.neurons[member]
                raise LayoutRefusalError(
                    "align-conflict",
                    f"'{names[0]}' and '{names[1]}' cannot stand on one line: what they belong to holds them apart",
                    about=names,
                )


def _together(problem: LayoutProblem, members: Sequence[int]) -> Sequence[int]:
    """Those of the members of an arrangement that it arranges: they stand in no instance that is within what all have
    in common."""
    paths = [problem.neurons[member].split(".")[:-1] for member in members]
    if not any(paths):
        return members
    both = zip(min(paths), max(paths), strict=False)
    common = sum(1 for _ in takewhile(lambda steps: steps[0] == steps[1], both))
    return [member for member, path in zip(members, paths, strict=True) if len(path) == common]


def _refuse_size(problem: LayoutProblem, name: str, can: Capabilities) -> None:
    neurons, edges = len(problem.neurons), len(problem.edges)
    if neurons > can.neurons or edges > can.edges:
        raise LayoutRefusalError(
            "layout-too-large",
            f"the engine '{name}' draws at most {can.neurons} neurons and {can.edges} connections; "
            f"this network has {neurons} and {edges}",
        )


def _refuse_without_place(problem: LayoutProblem, name: str, can: Capabilities) -> None:
    if can.free and not can.places:
        return
    known = {i for i, (x, y) in enumerate(problem.places) if can.places and math.isfinite(x + y)}
    if can.places and (known or problem.pins):
        return
    free = [n for i, n in enumerate(problem.neurons) if i not in problem.pins and i not in known]
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


def _refuse_close_pins(problem: LayoutProblem) -> None:
    """Refuse pins that are not finite, and two of which the discs would overlap."""
    pinned = sorted(problem.pins)
    for index in pinned:
        if not all(map(math.isfinite, problem.pins[index])):
            name = problem.neurons[index]
            raise LayoutRefusalError("pin-not-finite", f"the pin of '{name}' is not finite", about=(name,))
    there = np.array([problem.pins[index] for index in pinned], dtype=np.float64).reshape(-1, 2)
    one, other, _, _ = near_pairs(there, 2 * RADIUS - _SLACK)
    pairs = (sorted(pair, reverse=True) for pair in zip(one.tolist(), other.tolist(), strict=True))
    for later, first in sorted(pairs)[:1]:
        names = problem.neurons[pinned[first]], problem.neurons[pinned[later]]
        message = f"the pins of '{names[0]}' and '{names[1]}' are closer than {2 * RADIUS:g}: their discs would overlap"
        raise LayoutRefusalError("pins-too-close", message, about=names)


def engine_of(name: str) -> LayoutEngine:
    """The engine of a name. Raises LayoutRefusalError."""
    try:
        made: object = plugins.load(plugins.LAYOUTS, name)
    except KeyError:
        known = plugins.names(plugins.LAYOUTS)
        hint = suggest(name, ("auto", *known), "known engines")
        raise LayoutRefusalError("unknown-engine", f"there is no layout engine '{name}' here", hint) from None
    if not isinstance(made, LayoutEngine) or not isinstance(made.capabilities, Capabilities):
        raise LayoutRefusalError("broken-engine", f"what is installed as layout engine '{name}' is none")
    return made


def engines_that(can: Callable[[Capabilities], bool]) -> list[str]:
    """The names of the installed engines that can do something, in order; one that cannot be loaded can do nothing."""
    result = []
    for name in plugins.names(plugins.LAYOUTS):
        try:
            engine = engine_of(name)
        except (LayoutRefusalError, plugins.PluginError):
            continue
        if can(engine.capabilities):
            result.append(name)
    return result


def they_can(names: list[str]) -> str | None:
    """A help line that names engines.

    >>> they_can(["circular", "grid", "layered"])
    "the engines 'circular', 'grid' and 'layered' can"
    """
    quoted = [f"'{name}'" for name in names]
    if len(quoted) < 2:
        return f"the engine {quoted[0]} can" if quoted else None
    return f"the engines {', '.join(quoted[:-1])} and {quoted[-1]} can"
