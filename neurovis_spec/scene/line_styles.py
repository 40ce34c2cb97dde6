"""Styles of lines: solid, dashed, … by what connections have in a column of the files of their edges.

In: a network, whose spec names the column (``render: lines``). Out: the dashes of each line, and what the legend says
of them. Values have the styles in their order as names, from solid on; where connections have no value, or a line
stands for several that differ, solid is theirs. All dashes have flat ends, and none is a dot alone: round dots, in
grey, are the lines of rules (``teachers``).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import Indices
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.words import LINE_STYLES
from neurovis_spec.layout.naming import natural_key

#: Lengths of dashes and gaps beside discs of the usual size, by the style.
DASHES: Final = dict(
    zip(
        LINE_STYLES,
        ((), (8.0, 4.0), (3.5, 2.5), (9.0, 3.0, 2.5, 3.0), (18.0, 5.0), (9.0, 3.0, 2.5, 3.0, 2.5, 3.0)),
        strict=True,
    )
)
#: Beside smaller discs dashes are shorter, down to a share of these.
_USUAL, _LEAST = 12.0, 0.5
#: What the legend calls lines without a value of their own.
_OTHERS: Final = "others"


class Styles(NamedTuple):
    """Which style each connection has (m,), by its number; the column, and what has which style, in their order."""

    numbers: Indices
    column: str
    called: tuple[tuple[str, str], ...]

    def dash(self, connection: int, disc: float) -> tuple[float, ...]:
        """The dashes of a line between discs of this radius."""
        by = min(1.0, max(_LEAST, disc / _USUAL))
        return tuple(by * length for length in DASHES[LINE_STYLES[int(self.numbers[connection])]])


def styles_of(network: Network) -> Styles | None:
    """The styles of its connections; None where they all are as lines are."""
    texts = network.connections.styles
    if texts is None or not network.render.style:
        return None
    values = sorted(texts.used, key=natural_key)
    others = [_OTHERS] if (np.asarray(texts.numbers) < 0).any() else []
    called = (*others, *values)
    number_of = {text: number for number, text in enumerate(called) if not others or number}
    numbers = np.array([*(number_of.get(text, 0) for text in texts.known), 0], dtype=np.int64)[texts.numbers]
    return Styles(numbers, network.render.style, tuple(zip(called, LINE_STYLES, strict=False)))
