"""Mirror units: the units of a problem that is to be symmetric: those on one side, those on the axis, and reflections.

In: a problem, its frames, whose mirror image each neuron is. Out: units of which each is its own image or has one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

from neurovis_layouts.layered.parts import symmetric
from neurovis_layouts.layered.units import Unit, formation, units_of
from neurovis_spec.layout.model import Arrangement, LayoutProblem, LayoutRefusalError, Point


def symmetric_units(problem: LayoutProblem, frames: Sequence[Unit], pair: Mapping[int, int]) -> list[Unit]:
    """All units, in the order of their first neurons; ``frames`` are those of both sides.

    Raises LayoutRefusalError where an arrangement cannot be symmetric.
    """
    framed = {m for unit in frames for m in unit.members}
    second = {b for mirror in problem.mirrors for _, b in mirror.pairs} - framed
    blocks = arranged_on_axis(problem, pair, framed)
    solid = framed | {m for unit in blocks for m in unit.members}
    result: list[Unit] = []
    for unit in units_of(problem, [*frames, *blocks], second - solid):
        for piece in [unit] if unit.members[0] in solid else _pure(unit, pair):
            result.append(piece)
            if piece.members[0] in pair and piece.members[0] not in solid:
                result.append(_reflected(piece, pair))
    return sorted(result, key=lambda unit: min(unit.members))


def arranged_on_axis(problem: LayoutProblem, pair: Mapping[int, int], framed: AbstractSet[int]) -> list[Unit]:
    """The arrangements of neurons that are not ``framed`` in which mirror images stand opposite each other.

    Raises LayoutRefusalError where one cannot be symmetric.
    """
    return [block for members, how in problem.arrange if (block := _arranged(problem, members, how, pair, framed))]


def _pure(unit: Unit, pair: Mapping[int, int]) -> Iterator[Unit]:
    """A unit as it is if all of its neurons have an image or none has, else in pieces."""
    with_image = tuple(m for m in unit.members if m in pair)
    if len(with_image) in (0, len(unit.members)):
        yield unit
    elif unit.places is None:
        yield Unit(with_image)
        yield Unit(tuple(m for m in unit.members if m not in pair))
    else:  # a block that is not symmetric in itself would pull its neurons off the axis
        yield from (Unit((m,)) for m in unit.members)


def _reflected(unit: Unit, pair: Mapping[int, int]) -> Unit:
    places = None if unit.places is None else tuple((-x + 0.0, y) for x, y in unit.places)
    return replace(unit, members=tuple(pair[m] for m in unit.members), places=places)


def _arranged(
    problem: LayoutProblem, members: Sequence[int], how: Arrangement, pair: Mapping[int, int], framed: AbstractSet[int]
) -> Unit | None:
    """An arrangement that holds mirror images of each other: a block on the axis, in which these stand opposite."""
    own = set(members)
    if own & framed or not symmetric(members, pair):
        return None
    points = formation(problem, members, how)
    left = sorted((p for p in points if p[0] < 0), key=points.index)
    middle = [p for p in points if p[0] == 0]
    first = {a for mirror in problem.mirrors for a, _ in mirror.pairs}
    leads = [m for m in members if m in first and pair[m] in own]
    lone = [m for m in members if m not in pair]
    twins = [(-x, y) in set(points) for x, y in left]
    if len(leads) != len(left) or len(lone) != len(middle) or not all(twins):
        names = problem.neurons
        raise LayoutRefusalError(
            "mirror-arrange",
            f"'{names[members[0]]}' and those arranged with it as {how} cannot be mirror images of each other in it",
            "arrange each side by itself",
            tuple(names[m] for m in members),
        )
    places: dict[int, Point] = dict(zip(lone, middle, strict=True))
    for one, (x, y) in zip(leads, left, strict=True):
        places[one], places[pair[one]] = (x, y), (-x, y)
    return Unit(tuple(members), tuple(places[m] for m in members))
