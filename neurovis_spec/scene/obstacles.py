"""What is in the way: lines, discs and texts that a new text should not touch.

In: sampled lines, discs and rectangles, in user units. Out: how much a rectangle would cover. Texts find room with it,
or are left out.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from neurovis_spec.scene.geometry import FloatArray, Rect, overlap


class Obstacles:
    """Collects what is drawn; ``hits`` counts what a rectangle would cover."""

    def __init__(self, lines: Iterable[FloatArray], centres: FloatArray, radius: float, line_reach: float) -> None:
        """``line_reach``: how far a line (half its width and its glow) reaches beyond its sample points."""
        arrays = list(lines)
        self._dots = np.concatenate(arrays) if arrays else np.zeros((0, 2))
        self._reach = line_reach
        self._centres = centres
        self._radius = radius
        self._texts: list[Rect] = []

    def add_text(self, rect: Rect) -> None:
        """Room that a text has taken."""
        self._texts.append(rect)

    def add_line(self, dots: FloatArray) -> None:
        """One more line, as sample points."""
        self._dots = np.concatenate([self._dots, dots])

    def line_hits(self, rect: Rect) -> int:
        """How many sample points of lines a rectangle covers."""
        x0, y0, x1, y1 = rect
        dots, reach = self._dots, self._reach
        inside = (
            (dots[:, 0] > x0 - reach)
            & (dots[:, 0] < x1 + reach)
            & (dots[:, 1] > y0 - reach)
            & (dots[:, 1] < y1 + reach)
        )
        return int(np.count_nonzero(inside))

    def disc_hits(self, rect: Rect) -> int:
        """How many discs a rectangle touches."""
        x0, y0, x1, y1 = rect
        near_x = np.clip(self._centres[:, 0], x0, x1)
        near_y = np.clip(self._centres[:, 1], y0, y1)
        away = np.hypot(self._centres[:, 0] - near_x, self._centres[:, 1] - near_y)
        return int(np.count_nonzero(away < self._radius + 1))

    def text_hits(self, rect: Rect) -> int:
        """How many texts a rectangle touches."""
        return sum(overlap(rect, other) for other in self._texts)

    def hits(self, rect: Rect) -> int:
        """How much is in the way: a text or a disc weighs more than all lines."""
        return 10_000 * (self.text_hits(rect) + self.disc_hits(rect)) + self.line_hits(rect)

    def path_hits(self, dots: FloatArray, ends: tuple[int, ...]) -> int:
        """How much a line through these points would cross: discs other than ``ends`` weigh more than lines."""
        others = np.delete(self._centres, list(ends), axis=0)
        hits = 0
        for x, y in dots.tolist():
            if len(others) and np.hypot(others[:, 0] - x, others[:, 1] - y).min() < self._radius + 3:
                hits += 1000
            if len(self._dots) and np.hypot(self._dots[:, 0] - x, self._dots[:, 1] - y).min() < 4:
                hits += 1
        return hits
