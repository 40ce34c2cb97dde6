"""The heading of a picture: its title, and the line under it: the step, the time where the spec gives a time step, the
error where a rule has a target.

In: texts; a network and activities. Out: texts with their places, such as ``step 160 · 8.00 s · error +0.28``. A title
takes as many lines as the width of the picture asks for; all below it is so much lower.
"""

from __future__ import annotations

import math

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.scene import texts
from neurovis_spec.scene.frame import MARGIN
from neurovis_spec.scene.model import Text, Theme

TITLE, CAPTION = 17.0, 11.5
TITLE_Y, CAPTION_Y, HEADER = 35.0, 54.0, 58.0
#: From a line of a title to the next; and the share of a picture's height that all but the first take at most.
_LINE, MOST_TITLE = 21.0, 0.3


def title_text(title: str, width: float, theme: Theme) -> Text:
    """The title of a picture of this width, in one line."""
    words = texts.shorten(title, TITLE, width - 2 * MARGIN, 600)
    return Text((MARGIN, TITLE_Y), words, TITLE, theme.ink, weight=600)


def title_lines(title: str, width: float, theme: Theme) -> tuple[Text, ...]:
    """The title of a picture of this width, in as many lines as it takes."""
    lines = enumerate(texts.wrapped(title, TITLE, width - 2 * MARGIN, 600))
    return tuple(Text((MARGIN, TITLE_Y + _LINE * row), words, TITLE, theme.ink, weight=600) for row, words in lines)


def lowered(title: str, width: float) -> float:
    """How much lower all stands in a picture of this width because the title has several lines."""
    return _LINE * (len(texts.wrapped(title, TITLE, width - 2 * MARGIN, 600)) - 1)


def caption_text(words: str, width: float, theme: Theme, down: float = 0.0) -> Text:
    """The line under the title, so much lower than under one of one line."""
    return Text((MARGIN, CAPTION_Y + down), texts.shorten(words, CAPTION, width - 2 * MARGIN), CAPTION, theme.muted)


def caption(network: Network, step: int, activity: FloatArray) -> str:
    """What is said of a step; ``activity`` (n,)."""
    parts = [f"step {step}"]
    dt = network.shown_dt
    if dt is not None:
        parts.append(f"{step * dt.length:.{_decimals(dt.length)}f} {dt.unit}")
    error = _error(network, activity)
    if error is not None:
        parts.append(f"error {error}")
    return " · ".join(parts)


def _decimals(dt: float) -> int:
    """As many as tell steps apart, at most four."""
    if dt <= 0 or not math.isfinite(dt):
        return 2
    return min(4, max(0 if dt >= 1 and dt == round(dt) else 2, math.ceil(-math.log10(dt))))


def aims(network: Network) -> list[tuple[int, int]]:
    """What neurons are to be, and which neurons (indices), where exactly one rule has a signal ``target``, which is an
    activity; else none."""
    found = [projection for projection in network.projections if "target" in projection.signals]
    if len(found) != 1:
        return []
    sources, targets = found[0].signals["target"], network.connections.targets[found[0].members]
    pairs = sorted({(int(s), int(t)) for s, t in zip(sources.tolist(), targets.tolist(), strict=True)})
    return [] if any(source >= len(network.neurons) for source, _ in pairs) else pairs


def _error(network: Network, activity: FloatArray) -> str | None:
    """target − post; the root mean square where they are several."""
    pairs = aims(network)
    if not pairs:
        return None
    errors = np.array([activity[source] - activity[target] for source, target in pairs])
    if len(errors) == 1:
        return _signed(float(errors[0]))
    rms = float(np.sqrt(np.mean(errors**2)))
    return f"{rms:.2f} (RMS)" if math.isfinite(rms) else "is no number"


def _signed(value: float) -> str:
    if not math.isfinite(value):
        return "is no number"
    text = f"{value:+.2f}".replace("-", "−")
    return "0.00" if text in ("+0.00", "−0.00") else text
