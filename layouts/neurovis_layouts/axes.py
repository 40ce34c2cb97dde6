"""Axes: where a mirror's axis may stand among pins, and where the images of these are then.

In: pins, and whose mirror image each neuron is. Out: places for the axis, the likeliest first; for each the pins with
their images.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from neurovis_spec.layout.geometry import distance, snap
from neurovis_spec.layout.model import RADIUS, LayoutProblem, LayoutRefusalError, Point

_SLACK = 1e-9
#: Steps of the search, each with how many of them it takes to either side: fine ones first.
_STEPS = ((0.25, 20), (1.0, 20))


def shift_of(free: Sequence[Point], pins: Mapping[int, Point]) -> Point:
    """The least-squares fit of the free plan to the pins, on the grid."""
    return (
        snap(math.fsum(x - free[i][0] for i, (x, _) in sorted(pins.items())) / len(pins)),
        snap(math.fsum(y - free[i][1] for i, (_, y) in sorted(pins.items())) / len(pins)),
    )


def axes(
    problem: LayoutProblem, start: float, pair: Mapping[int, int], wide: float
) -> Iterator[tuple[float, dict[int, Point]]]:
    """Where the axis may be, the ``start`` first, each with the pins and their images: one place where both of a pair
    are pinned, else also so far off that nothing ``wide`` around a pin reaches it.

    Raises LayoutRefusalError where such pairs disagree, and where an image stands on a pin wherever the axis is.
    """
    refusal: LayoutRefusalError | None = None
    found = False
    for axis in _places(problem, start, pair, wide):
        try:
            pins = _imaged(problem, pair, axis)
        except LayoutRefusalError as error:
            refusal = refusal or error
        else:
            found = True
            yield axis, pins
    if refusal is not None and not found:
        raise refusal


def _places(problem: LayoutProblem, start: float, pair: Mapping[int, int], wide: float) -> Iterator[float]:
    """Where the axis may be. Raises LayoutRefusalError where pinned pairs disagree."""
    pins = problem.pins
    both = sorted((a, b) for a, b in pair.items() if a < b and a in pins and b in pins)
    for a, b in both:
        first = both[0]
        apart = pins[a][0] + pins[b][0] - pins[first[0]][0] - pins[first[1]][0]
        if abs(apart) > _SLACK or abs(pins[a][1] - pins[b][1]) > _SLACK:
            names = problem.neurons[a], problem.neurons[b]
            message = f"the pins of '{names[0]}' and '{names[1]}' are not mirror images"
            raise LayoutRefusalError("mirror-pins", message, about=names)
    if both or not pair:
        yield (pins[both[0][0]][0] + pins[both[0][1]][0]) / 2 if both else 0.0
        return
    yield start
    reach = 0.0
    for step, count in _STEPS:
        for number in range(1, count + 1):
            yield start + reach + number * step
            yield start - reach - number * step
        reach += count * step
    across = [x for i, (x, _) in pins.items() if i in pair] or [start]
    yield snap(max(across) + wide)
    yield snap(min(across) - wide)


def _imaged(problem: LayoutProblem, pair: Mapping[int, int], axis: float) -> dict[int, Point]:
    """The pins with their images. Raises LayoutRefusalError where one of these stands on a pin."""
    images = {pair[i]: (2 * axis - x, y) for i, (x, y) in problem.pins.items() if i in pair}
    found = dict(sorted({**images, **problem.pins}.items()))
    for i in images:
        if i not in problem.pins:
            _refuse_close(problem, found, i, pair[i])
    return found


def _refuse_close(problem: LayoutProblem, pins: Mapping[int, Point], image: int, pinned: int) -> None:
    for j, other in pins.items():
        if j != image and distance(pins[image], other) < 2 * RADIUS - _SLACK:
            names = problem.neurons[pinned], problem.neurons[j]
            raise LayoutRefusalError(
                "mirror-pins",
                f"no axis keeps the mirror images of pins off other pins: that of '{names[0]}' stands on '{names[1]}'",
                "move one of the pins, or leave one out",
                names,
            )
