"""What is in the way: lines, discs and texts that a new text should not touch.

In: sampled lines, discs and rectangles, in user units. Out: how much a rectangle would cover. Texts find room with it,
or are left out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.geometry import Rect, meet


class Obstacles:
    """Collects what is drawn; ``hits`` counts what a rectangle would cover."""

    def __init__(
        self, lines: Sequence[FloatArray], reaches: Sequence[float], centres: FloatArray, radii: FloatArray
    ) -> None:
        """``reaches``: how far each line (half its width and its glow) reaches beyond its sample points; ``radii`` of
        the discs."""
        self._dots = np.concatenate(lines) if lines else np.zeros((0, 2))
        self._reaches = np.repeat(np.asarray(reaches, float), [len(line) for line in lines])
        self._centres = centres
        self._radii = radii
        self._texts: list[Rect] = []
        self._frames = np.zeros((0, 2))

    def add_text(self, rect: Rect) -> None:
        """Room that a text has taken."""
        self._texts.append(rect)

    def keep_texts(self, count: int) -> None:
        """Forget all texts but the first ones."""
        del self._texts[count:]

    def texts(self) -> FloatArray:
        """(k, 4) the room that texts have taken."""
        return np.array(self._texts, float).reshape(-1, 4)

    def add_line(self, dots: FloatArray, reach: float | FloatArray = 2.5) -> None:
        """One more line, as sample points, all of one reach or each of its own."""
        self._dots = np.concatenate([self._dots, dots])
        self._reaches = np.concatenate([self._reaches, np.full(len(dots), reach)])

    def add_frame(self, dots: FloatArray) -> None:
        """The line of a box, as sample points."""
        self._frames = np.concatenate([self._frames, dots])

    def crossed(self, rect: Rect) -> bool:
        """Whether a line, of a connection or of a box, runs through a rectangle."""
        return self.line_hits(rect) > 0 or self.frame_hits(rect) > 0

    def frame_hits(self, rect: Rect) -> int:
        """How many sample points of boxes' lines a rectangle covers."""
        return _within(self._frames, np.full(len(self._frames), 2.5), rect)

    def near(self, rect: Rect) -> Obstacles:
        """Only what lies in a rectangle, and all texts, also those that will be added."""
        near = _inside(self._centres, rect, self._radii + 1)
        result = Obstacles([], [], self._centres[near], self._radii[near])
        inside = _inside(self._dots, rect)
        result._dots, result._reaches = self._dots[inside], self._reaches[inside]
        result._frames = self._frames[_inside(self._frames, rect)]
        result._texts = self._texts
        return result

    def line_hits(self, rect: Rect) -> int:
        """How many sample points of lines a rectangle covers."""
        return _within(self._dots, self._reaches, rect)

    def disc_hits(self, rect: Rect) -> int:
        """How many discs a rectangle touches."""
        x0, y0, x1, y1 = rect
        near_x = np.clip(self._centres[:, 0], x0, x1)
        near_y = np.clip(self._centres[:, 1], y0, y1)
        away = np.hypot(self._centres[:, 0] - near_x, self._centres[:, 1] - near_y)
        return int(np.count_nonzero(away < self._radii + 1))

    def text_hits(self, rect: Rect) -> int:
        """How many texts a rectangle touches."""
        return sum(meet(rect, other) for other in self._texts)

    def hits(self, rect: Rect, crossed: int = 1) -> int:
        """How much is in the way: a text or a disc weighs more than all lines, and a line ``crossed`` times as much as
        that of a box."""
        covered = 10_000 * (self.text_hits(rect) + self.disc_hits(rect))
        return covered + crossed * self.line_hits(rect) + self.frame_hits(rect)

    def path_hits(self, dots: FloatArray, ends: tuple[int, ...]) -> int:
        """How much a line through these points would cross: discs other than ``ends`` weigh more than lines."""
        others, radii = np.delete(self._centres, list(ends), axis=0), np.delete(self._radii, list(ends))
        hits = 0
        for x, y in dots.tolist():
            if (np.hypot(others[:, 0] - x, others[:, 1] - y) < radii + 3).any():
                hits += 1000
            if len(self._dots) and np.hypot(self._dots[:, 0] - x, self._dots[:, 1] - y).min() < 4:
                hits += 1
        return hits


def _within(dots: FloatArray, reach: FloatArray, rect: Rect) -> int:
    """How many points are in a rectangle, or as near to it as each reaches."""
    return int(np.count_nonzero(_inside(dots, rect, reach)))


def _inside(dots: FloatArray, rect: Rect, reach: FloatArray | float = 0.0) -> npt.NDArray[np.bool_]:
    (x0, y0, x1, y1), (x, y) = rect, dots.T
    result: npt.NDArray[np.bool_] = (x > x0 - reach) & (x < x1 + reach) & (y > y0 - reach) & (y < y1 + reach)
    return result
