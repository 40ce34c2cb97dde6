"""Forces on points, and where these come to rest.

In: a wiring, where its points are. Out: where they come to rest (``settle``), step by step, each shorter than the one
before. Links pull with a force that grows slower than their length, so that clusters stand apart (Noack 2007: forces
between linear and logarithmic); arcs press their target below their source; mirror images are such at each step. All
points push each other off, by the inverse of their distance: that is the field. Points of many small parts are taken
pair by pair; those of a large one
give their mass to a grid, whose field is one convolution, by Fourier transform (Hockney and Eastwood 1988:
particle-mesh). Closer than a cell that push fades, which is as well, as discs are kept apart afterwards; but of a
network that reaches far out on one side cells are so large that whole clusters would fall into one: there what the grid
cannot tell apart is added pair by pair.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from neurovis_layouts.apart import pushed
from neurovis_layouts.symmetry import Symmetry
from neurovis_layouts.wiring import Wiring
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.geometry import lengths, near_pairs

#: Cells wider than this, in the distance that points of such a mass have from each other, are too wide; how far, in the
#: same, pairs are added then.
_WIDEST, _REACH = 2.0, 3.0
_FEWEST_CELLS, _MOST_CELLS = 16, 1024
#: Nearer than this (squared) the push of a pair grows no more.
_SOFT = 0.01

#: Whatever gives the push (n, 2) on places (n, 2).
Field: TypeAlias = Callable[[FloatArray], FloatArray]
#: How strongly points push each other off.
_PUSH = 0.2
#: How strongly an arc presses as long as its target is too little below its source.
_PRESS = 4.0


def pair_field(mass: FloatArray, one: IntArray, other: IntArray) -> Field:
    """Pair by pair: ``one`` and ``other`` (k,) are the pairs."""
    both = mass[one] * mass[other]

    def field(places: FloatArray) -> FloatArray:
        way = places[other] - places[one]
        return pushed(len(mass), one, other, way * (both / ((way**2).sum(axis=1) + _SOFT))[:, None])

    return field


class GridField:
    """On a square grid with about four cells for each point."""

    def __init__(self, mass: FloatArray) -> None:
        self._mass = mass
        self._unit = float(np.sqrt(mass.mean()))
        self._cells = _smooth(int(np.clip(2 * np.sqrt(len(mass)), _FEWEST_CELLS, _MOST_CELLS)))
        self._size = 2 * self._cells  # twice, so that what leaves on one side does not come back on the other
        steps = np.arange(self._size, dtype=np.float64)
        steps = np.where(steps < self._cells, steps, steps - self._size)
        right, down = steps[:, None], steps[None, :]
        squared = right**2 + down**2
        squared[0, 0] = 1.0
        # the field of a round cloud one cell wide: 1/r beyond it, none at its middle
        strength = (1 - _fading(squared)) / squared
        kernel = np.fft.fft2(right * strength + 1j * down * strength)
        self._kernel = kernel.astype(np.complex64)

    def __call__(self, places: FloatArray, /) -> FloatArray:
        """The push on each place."""
        low = places.min(axis=0)
        cell = (float((places.max(axis=0) - low).max()) + 1e-9) / (self._cells - 2)
        at = (places - low) / cell + 0.5
        corner = np.floor(at).astype(np.int64)
        (fx, fy), size = (at - corner).T, self._size
        shares = ((1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy)
        first = corner[:, 0] * size + corner[:, 1]
        where = (first, first + size, first + 1, first + size + 1)
        masses = np.concatenate([share * self._mass for share in shares])
        used = self._cells
        density = np.bincount(np.concatenate(where), masses, used * size).reshape(used, size)
        # the rest of the rows is empty, and nobody asks for their field
        rows = np.fft.fft(density.astype(np.float32), axis=1)
        waves, kernel = np.fft.fft(rows, n=size, axis=0), self._kernel
        # by parts: a product of complex numbers is rounded as each processor likes
        product = np.empty_like(waves)
        product.real = waves.real * kernel.real - waves.imag * kernel.imag
        product.imag = waves.real * kernel.imag + waves.imag * kernel.real
        field = np.fft.ifft(np.fft.ifft(product, axis=0)[:used], axis=1).ravel()
        felt = sum((share * field[place] for share, place in zip(shares, where, strict=True)), start=np.zeros(1))
        push: FloatArray = np.stack([felt.real, felt.imag], axis=1) * (self._mass / cell)[:, None]
        return push if cell <= _WIDEST * self._unit else push + self._within(places, cell)

    def _within(self, places: FloatArray, cell: float) -> FloatArray:
        """What the field of clouds one cell wide lacks between points close by."""
        one, other, way, far = near_pairs(places, min(2 * cell, _REACH * self._unit))
        lacking = _fading((far / cell) ** 2) / (far**2 + _SOFT)
        push = way * (lacking * self._mass[one] * self._mass[other])[:, None]
        return pushed(len(places), one, other, push)


def _fading(x: FloatArray) -> FloatArray:
    """Nearly exp(−x), by products alone, so that it is the same on every processor."""
    grown = 1 + x / 64
    for _ in range(6):
        grown = grown * grown
    fading: FloatArray = 1 / grown
    return fading


def _smooth(least: int) -> int:
    """The least number from ``least`` on without a prime factor above 5: Fourier transforms of such sizes are quick."""
    while True:
        rest = least
        for factor in (2, 3, 5):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return least
        least += 1


@dataclass(frozen=True, slots=True)
class Cooling:
    """How many steps, and the longest move in the first and in the last."""

    steps: int
    first: float
    last: float


@dataclass(frozen=True, slots=True)
class Held:
    """What does not move: ``points`` (k,), by index, and the ``axis`` of mirror images, which stands at this x."""

    points: IntArray
    axis: float


def settle(
    wiring: Wiring,
    places: FloatArray,
    field: Field,
    cooling: Cooling,
    held: Held | None = None,
    drop: FloatArray | float = 1.0,
    tick: Callable[[int], None] | None = None,
) -> FloatArray:
    """Places (count, 2) at rest, but for what is ``held``. An arc presses as long as its target is less than ``drop``
    below its source, one for all or (m,). ``tick`` is called after every step with the number of points."""
    count, symmetry = wiring.count, Symmetry(wiring.image, held.axis if held else 0.0)
    for step in range(cooling.steps):
        force = _PUSH * field(places)
        way = places[wiring.b] - places[wiring.a]
        length = lengths(way) + 1e-9
        # links pull with the power 11/16 of their length, by roots alone, which every processor rounds alike
        fourth = np.sqrt(np.sqrt(length))
        stiffness = wiring.weight / (fourth * np.sqrt(np.sqrt(fourth)))
        force += pushed(count, wiring.b, wiring.a, way * stiffness[:, None])
        stiff = np.bincount(wiring.a, stiffness, count) + np.bincount(wiring.b, stiffness, count)
        missing = drop - (places[wiring.below, 1] - places[wiring.above, 1])
        press = _PRESS * wiring.pull * np.maximum(missing, 0)
        force[:, 1] += np.bincount(wiring.below, press, count) - np.bincount(wiring.above, press, count)
        active = _PRESS * wiring.pull * (missing > 0)
        stiff += np.bincount(wiring.below, active, count) + np.bincount(wiring.above, active, count)
        move = force / (stiff + 1e-9)[:, None]
        far = lengths(move) + 1e-12
        longest = cooling.first * (cooling.last / cooling.first) ** (step / max(1, cooling.steps - 1))
        move *= (np.minimum(far, longest) / far)[:, None]
        if held is not None:
            move[held.points] = 0.0
        places = symmetry.kept(places + move)
        if tick is not None:
            tick(count)
    return places
