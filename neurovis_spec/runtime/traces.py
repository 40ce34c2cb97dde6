"""Traces: a recording as a small picture for a notebook, one line a neuron, one for each weight that changes.

In: a title, and numbers over the steps, kind by kind. Out: an SVG as text. It needs no network, so that a recording
that was only loaded shows itself, too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray

WIDTH, ROW, LEFT, TOP = 720, 26, 96, 28
#: most lines of each kind, and most points of a line (the lowest and the highest value of every column)
MOST, COLUMNS = 24, 300
COLOURS = {"activity": "#0072b2", "weight": "#b07d00", "state": "#009e73", "sensor": "#cc79a7"}


class Traced(NamedTuple):
    """Numbers of one kind over the steps: ``values`` (rows, names) of what ``names`` names."""

    quantity: str
    names: Sequence[str]
    values: FloatArray


def traces(title: str, kinds: Sequence[Traced]) -> str:
    """The values over the steps; every line has its own range, which is written beside it."""
    shown = [
        (kind.quantity, name, kind.values[:, column]) for kind in kinds for column, name in enumerate(kind.names[:MOST])
    ]
    height = TOP + ROW * len(shown) + 8
    hidden = sum(max(0, len(kind.names) - MOST) for kind in kinds)
    title = escape(title + (f" · {hidden} more" if hidden else ""))
    lines = [_line(top, *line) for top, line in zip(range(TOP, height, ROW), shown, strict=False)]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" '
        f'font-family="Arial,DejaVu Sans,sans-serif" font-size="11"><title>{title}</title>'
        f'<rect width="100%" height="100%" fill="#ffffff"/><text x="8" y="17" font-weight="600">{title}</text>'
        f"{''.join(lines)}</svg>"
    )


def _line(top: int, what: str, name: str, values: FloatArray) -> str:
    shown = name if len(name) <= 13 else name[:12] + "…"
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    points = _points(np.nan_to_num(values, nan=low, posinf=high, neginf=low), low, high, top)
    return (
        f"<g><title>{escape(f'{what} of {name}: {low:.4g} … {high:.4g}')}</title>"
        f'<text x="8" y="{top + 16}" fill="#1f2328">{escape(shown)}</text>'
        f'<polyline points="{points}" fill="none" stroke="{COLOURS[what]}" stroke-width="1"/>'
        f'<text x="{WIDTH - 8}" y="{top + 16}" fill="#6e7781" text-anchor="end">{low:.3g} … {high:.3g}</text></g>'
    )


def _points(values: FloatArray, low: float, high: float, top: int) -> str:
    """The line, by the lowest and the highest value of every column of pixels."""
    if not len(values):
        return ""
    right = WIDTH - 108
    exponent = int(np.frexp(max(abs(low), abs(high)))[1])  # of values near 1 no difference and no ratio overflows
    values, low, high = np.ldexp(values, -exponent), math.ldexp(low, -exponent), math.ldexp(high, -exponent)
    edges = np.linspace(0, len(values), min(COLUMNS, len(values)) + 1).astype(np.int64)
    scale = (ROW - 8) / (high - low) if high > low else 0.0
    places = []
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        piece = values[first:last]
        x = LEFT + (right - LEFT) * first / max(len(values) - 1, 1)
        extremes = (piece.min(), piece.max()) if piece[0] <= piece[-1] else (piece.max(), piece.min())
        places += [f"{x:.1f},{top + ROW - 4 - (value - low) * scale:.1f}" for value in dict.fromkeys(extremes)]
    return " ".join(places)
