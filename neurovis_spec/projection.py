"""Positions of three numbers on a page: from where they are seen, and how near each of them is.

In: positions (n, 3), x and y as on a page (y downwards), z towards whoever looks from above; a Viewpoint. Out: where
they are on the page (n, 2), and how near they are to who looks (n,).
"""

from __future__ import annotations

import math

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.words import TOP, VIEWPOINTS, Viewpoint

#: to how many binary digits of the farthest place others are the same
_EXACT = 36


def projected(position: FloatArray, view: Viewpoint) -> tuple[FloatArray, FloatArray]:
    """Where positions (n, 2) or (n, 3) are on the page (n, 2), and how near they are (n,), a plane all the same.

    >>> places, near = projected(np.array([[1.0, 2.0, 3.0]]), Viewpoint(0.0, 0.0))
    >>> places.tolist(), near.tolist()
    ([[1.0, -3.0]], [2.0])
    """
    if position.shape[1] == 2:
        return position, np.zeros(len(position))
    (sin_a, cos_a), (sin_e, cos_e) = _sine_and_cosine(view.azimuth), _sine_and_cosine(view.elevation)
    right = np.array([cos_a, sin_a, 0.0])
    down = np.array([-sin_a * sin_e, cos_a * sin_e, -cos_e])
    towards = np.array([-sin_a * cos_e, cos_a * cos_e, sin_e])
    with np.errstate(invalid="ignore"):  # of those that have no position
        along = [_along(position, axis) for axis in (right, down, towards)]
    return np.stack(along[:2], axis=1), along[2]


def joined(places: FloatArray) -> FloatArray:
    """Places, those of neurons behind each other the same, though they differ by what is rounded."""
    known = np.isfinite(places)
    extent = float(np.abs(places[known]).max(initial=0.0))
    if not extent:
        return places
    exponent = int(np.frexp(extent)[1]) - _EXACT
    return np.ldexp(np.rint(np.ldexp(places, -exponent)), exponent)


def _along(position: FloatArray, axis: FloatArray) -> FloatArray:
    """How far positions are along an axis; a part of it that is 0 takes no part, so that what is exact stays so."""
    result = np.zeros(len(position))
    for number in np.flatnonzero(axis).tolist():
        result = result + position[:, number] * axis[number]
    return result


def _sine_and_cosine(degrees: float) -> tuple[float, float]:
    """Exact for right angles, and one of 0 where the other is 1."""
    turns, rest = divmod(degrees, 90.0)
    sine, cosine = (0.0, 1.0) if rest == 0 else (math.sin(math.radians(rest)), math.cos(math.radians(rest)))
    for _ in range(int(turns) % 4):
        sine, cosine = cosine, -sine
    return sine + 0.0, cosine + 0.0


def nearness(network: Network, engine: str) -> FloatArray | None:
    """How near each neuron of a picture is (n,), from 0 for the farthest to 1 for the nearest, and for one without a
    position. None where an engine has not put them where their positions are, or these are in a plane."""
    position = network.neurons.position
    if engine != "spatial" or position.shape[1] == 2:
        return None
    near = projected(position, network.layout.view)[1]
    known = np.isfinite(near)
    low, high = near[known].min(initial=np.inf), near[known].max(initial=-np.inf)
    if not low < high:
        return None
    return np.where(known, (near - low) / (high - low), 1.0)


def called(view: Viewpoint) -> str:
    """From where that is, in words."""
    named = {point: name for name, point in VIEWPOINTS.items()}
    if view in named:
        return f"from {'above' if view == TOP else f'the {named[view]}'}"
    return f"from {view.azimuth:g}° around and {view.elevation:g}° above"
