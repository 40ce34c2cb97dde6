"""Symmetry: places and routes of neurons some of which are mirror images of others, about one axis.

In: a problem, or places near those wanted. Out: whose image each neuron is; the places, symmetric; where the axis
stands among pins; which routes are their image's reflections. Who has no image stands anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurovis_layouts.axes import axes, shift_of
from neurovis_layouts.frame import from_picture
from neurovis_layouts.routing.ends import keys_of
from neurovis_layouts.routing.images import Images, images_of
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.geometry import Cells, snap
from neurovis_spec.layout.model import RADIUS, LayoutProblem, LayoutRefusalError, Point

#: How far from a pin the axis may stand, in neuron spacings, when it has to leave all pins on one side.
_WIDE = 4.0


@dataclass(frozen=True, slots=True)
class Symmetry:
    """``image`` (n,): the mirror image of each point, itself where it has none; ``axis`` is the x of the axis."""

    image: IntArray
    axis: float = 0.0

    @property
    def paired(self) -> BoolArray:
        """(n,) who has an image."""
        paired: BoolArray = self.image != np.arange(len(self.image))
        return paired

    @property
    def pair(self) -> dict[int, int]:
        """By who has an image: who that is."""
        return {i: int(self.image[i]) for i in np.flatnonzero(self.paired).tolist()}

    def kept(self, places: FloatArray) -> FloatArray:
        """Places (n, 2) made symmetric, each pair moved as little as that takes."""
        paired = self.paired
        if not paired.any():
            return places
        theirs = places[self.image] * (-1.0, 1.0) + (2 * self.axis, 0.0)
        symmetric: FloatArray = np.where(paired[:, None], (places + theirs) / 2, places)
        return symmetric

    def within(self, chosen: IntArray) -> Symmetry:
        """That of the chosen points alone, which are in order; who has the image elsewhere has none here."""
        image = np.where(np.isin(self.image[chosen], chosen), self.image[chosen], chosen)
        return Symmetry(np.searchsorted(chosen, image), self.axis)

    def reflected(self, point: Point) -> Point:
        """A point on the other side of the axis."""
        return 2 * self.axis - point[0], point[1]


def symmetry_of(problem: LayoutProblem) -> Symmetry:
    """The mirror images that a problem asks for. Raises LayoutRefusalError where the axis is that of an instance, which
    is drawn as a frame by others alone."""
    image = np.arange(len(problem.neurons), dtype=np.int64)
    for mirror in problem.mirrors:
        if mirror.scope >= 0:
            path = problem.modules[mirror.scope].path
            names = tuple(problem.neurons[i] for pair in mirror.pairs for i in pair)
            message = f"mirror images about the axis of '{path}' need a frame of it, which this engine does not draw"
            raise LayoutRefusalError("layout-mirror-unsupported", message, "'layered' draws it", names)
        for one, other in mirror.pairs:
            image[one], image[other] = other, one
    return Symmetry(image)


def first_of_pairs(problem: LayoutProblem) -> IntArray:
    """Those that were written first of their pairs."""
    return np.array(sorted({one for mirror in problem.mirrors for one, _ in mirror.pairs}), dtype=np.int64)


def about_pins(problem: LayoutProblem, symmetry: Symmetry, places: FloatArray) -> tuple[Symmetry, IntArray, FloatArray]:
    """The symmetry with its axis where the images of pins have room, by ``places`` that are symmetric about 0; who is
    held by a pin, or by that of its image (p,), in order, and where (p, 2), in the engine's frame."""
    turned = replace(problem, pins={i: from_picture(point, problem.direction) for i, point in problem.pins.items()})
    free = [(float(x), float(y)) for x, y in places[: len(problem.neurons)].tolist()]
    axis, held = 0.0, turned.pins
    if held:
        start = shift_of(free, held)[0]
        axis, held = next(axes(turned, start, symmetry.pair, _WIDE * problem.neuron_spacing))
    fixed = np.array(sorted(held), dtype=np.int64)
    there = np.array([held[i] for i in fixed.tolist()], dtype=np.float64).reshape(-1, 2)
    return replace(symmetry, axis=axis), fixed, there


def exact(problem: LayoutProblem, symmetry: Symmetry, centres: Sequence[Point]) -> list[Point]:
    """Centres near these of which images are reflections to the last bit: of what is pinned, and of what was written
    first."""
    found = list(centres)
    for one in first_of_pairs(problem).tolist():
        other = int(symmetry.image[one])
        if one in problem.pins or other in problem.pins:
            one, other = (one, other) if one in problem.pins else (other, one)
        else:
            offset = snap(found[one][0] - symmetry.axis)
            found[one] = symmetry.axis + offset, found[one][1]
        if other not in problem.pins:
            found[other] = symmetry.reflected(found[one])
    return found


def routed_alike(problem: LayoutProblem, symmetry: Symmetry, centres: Sequence[Point]) -> tuple[Images, list[Point]]:
    """Which routes are reflections of others, and what these keep off besides the discs: where these would be on the
    other side of the axis, but for what stands there."""
    pair, there = symmetry.pair, np.array(centres, dtype=np.float64)
    ghosts = np.array([symmetry.reflected(point) for i, point in enumerate(centres) if i not in pair]).reshape(-1, 2)
    taken = Cells(there, 2 * RADIUS).near(ghosts)[0]
    free: list[Point] = [(x, y) for x, y in np.delete(ghosts, taken, axis=0).tolist()]
    return images_of(keys_of(problem.edges), centres, pair, symmetry.axis), free
