"""What every renderer has to draw alike: scenes of each kind of shape, and of whole pictures.

``SCENES`` by name; ``similarity`` of two pictures. ``test_renderers`` draws them with all that needs no browser,
``test_browser`` with the others.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from hand_networks import use_case_1
from PIL import Image as Pillow

from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.scene import (
    THEMES,
    Arrowhead,
    Disc,
    Film,
    FlatSpline,
    Group,
    Image,
    Polygon,
    Polyline,
    Ramp,
    Rectangle,
    Scene,
    Shape,
    Spline,
    Text,
    colours,
)
from neurovis_spec.scene.film import film, scene_of_step
from neurovis_spec.scene.gains import choose_gains

#: How alike two drawings of a scene are at least.
ALIKE = 0.985
INK, RED, BLUE, GOLD = "#1f2328", "#d55e00", "#0072b2", "#f2c200"
CASE = use_case_1(1300)
GAINS = choose_gains(CASE.network, RenderSettings(), CASE.reached)


def _scene(shapes: Sequence[Shape], theme: str = "default", density: float = 2.0, **more: float) -> Scene:
    return Scene(200, 140, THEMES[theme], "shapes", (Group(tuple(shapes), **more),), density)  # type: ignore[arg-type]


def _fan(width: float) -> list[Spline]:
    """Straight lines in all directions, and a wave."""
    result: list[Spline] = []
    for number in range(12):
        x, y = math.cos(number * math.pi / 12), math.sin(number * math.pi / 12)
        points = tuple((70 + t * x, 70 + t * y) for t in (-60, -20, 20, 60))
        result.append(Spline(points, RED if number % 2 else BLUE, width))
    result.append(Spline(((140, 20), (210, 50), (110, 90), (180, 120)), INK, width))
    return result


def _heads() -> list[Shape]:
    result: list[Shape] = []
    for number in range(10):
        x, y = math.cos(number * 0.63), math.sin(number * 0.63)
        kind = "bar" if number % 2 else "arrow"
        tip = (100 + 60 * x, 70 + 60 * y)
        head = Arrowhead(tip, (x, y), 9 + number / 2, 3.5 + number / 4, RED, kind, 2.0)  # type: ignore[arg-type]
        nx, ny = head.notch
        points = tuple((100 + t * (nx - 100), 70 + t * (ny - 70)) for t in (0.2, 0.5, 0.8, 1))
        result += [Spline(points, RED, 2.0), head]
    return result


def _texts() -> list[Shape]:
    return [
        Text((10, 30), "Function approximation", 15, INK, weight=600),
        Text((10, 52), "step 160 · 4.00 s · error −0.28", 11, "#59636e"),
        Text((190, 75), "C → K, K → O", 12, BLUE, "end"),
        Text((100, 100), "K", 18, RED, "middle", 600, "12"),
        Rectangle((20, 108), 90, 26, 0, RED, RED, 0),
        Text((30, 126), "halo", 14, INK, halo="#ffffff"),
        Text((192, 136), "activity", 11, INK, upward=True),
    ]


def _areas() -> list[Shape]:
    ramp = tuple(colours(THEMES["default"], np.linspace(-1, 1, 41)))
    return [
        Rectangle((10.5, 10.5), 80, 50, 9, "#f6f8fa", "#59636e", 1.0),
        Disc((50, 35), 14, BLUE, "#ffffff", 1.5),
        Disc((75, 35), 5, RED, INK, 1.0),
        Ramp((10, 75), 100, 10, ramp),
        Polyline(tuple((10 + k, 115 + 15 * math.sin(k / 5) + (k % 7)) for k in range(180)), INK, 1.2),
        Spline(((10, 95), (70, 95), (130, 95), (190, 95)), INK, 2.0, (2.0, 4.0)),
        Polyline(((120, 20), (150, 60), (180, 30)), RED, 14.0, round=True),
        Polygon(((150, 70), (190.5, 78.3), (186, 90), (164, 92.5)), GOLD),
        Polygon(((140, 60), (120, 62), (128, 50)), BLUE, 3.0),
    ]


def _cells() -> list[Shape]:
    cells = np.random.default_rng(1).integers(0, 256, (8, 10, 3)).astype(np.uint8)
    return [Image((20, 10), 150, 120, 10, 8, cells.tobytes())]


def _glowing() -> list[Shape]:
    line = ((20.0, 20.0), (100.0, 20.0), (60.0, 120.0), (180.0, 120.0))
    return [Spline(line, GOLD, 9.0, glow=True), Spline(line, BLUE, 3.0), Disc((20, 20), 8, BLUE, "#ffffff", 1.5)]


def use_case(step: int, theme: str) -> Scene:
    """Use case 1 at a step."""
    return scene_of_step(CASE.network, CASE.layout, CASE.snapshot(step), GAINS, RenderSettings(theme=theme))


SCENES = {
    "thin lines": _scene(_fan(0.6)),
    "lines": _scene(_fan(1.7)),
    "wide lines": _scene(_fan(7.0)[:3] + _fan(7.0)[-1:]),
    "dashes": _scene([FlatSpline(line.points, line.stroke, 2.5, (9.0, 3.0, 2.5, 3.0)) for line in _fan(2.5)]),
    "heads": _scene(_heads()),
    "texts": _scene(_texts()),
    "areas": _scene(_areas()),
    "cells": _scene(_cells()),
    "glow": _scene(_glowing(), "dark"),
    "faint": _scene(_glowing(), opacity=0.3),
    "use case 1": use_case(160, "default"),
    "use case 1, dark, learned": use_case(1180, "dark"),
    "use case 1, print": replace(use_case(400, "print"), density=1.0),
}


def short_film(frames: int = 8) -> Film:
    """Use case 1 while it learns."""
    steps = [CASE.snapshot(k) for k in range(120, 120 + frames)]
    return film(CASE.network, CASE.layout, steps, GAINS, RenderSettings(), 40.0)


def similarity(one: Pillow.Image, other: Pillow.Image, window: int = 8) -> float:
    """The mean structural similarity of two pictures (Wang et al. 2004), greyscale, flat windows."""
    a, b = (np.asarray(picture.convert("L"), float) for picture in (one, other))

    def mean(x: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        total = np.pad(x, ((1, 0), (1, 0))).cumsum(0).cumsum(1)
        w = window
        result: npt.NDArray[np.float64] = (total[w:, w:] - total[:-w, w:] - total[w:, :-w] + total[:-w, :-w]) / w**2
        return result

    ma, mb = mean(a), mean(b)
    va, vb, both = mean(a * a) - ma * ma, mean(b * b) - mb * mb, mean(a * b) - ma * mb
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    return float(np.mean((2 * ma * mb + c1) * (2 * both + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))))
