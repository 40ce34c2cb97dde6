"""Whether the hexapod learns to step over beams, wherever they lie: hits go down and stay down.

In: nothing. Out: a table, one row for each arrangement of beams (how far apart, when they come to the middle and
hind legs, how unevenly), with the hits of the middle and hind legs in each quarter of the beams, and the weights at
the end. Run it with ``python benchmarks/beams.py``; it takes a minute.

A beam lies in the way of a leg for a stride, so that one swing crosses it. Jitter moves each beam, for all legs, and
its arrival at each pair of legs, evenly by up to so many steps. One memory holds one beam: where the next comes to the
front legs before the last is behind the hind ones (a distance of 110 steps, 100 to the hind legs), its news replaces
the last one's.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from beams_across import WARNED, Arrangement, walk


def grid() -> Iterator[Arrangement]:
    """Distances, positions, jitters, and places of the first beam in a stride."""
    for every, later, jitter, offset in product(
        (110, 150, 180), ((40, 70), (45, 80), (55, 90), (65, 100)), (0, 4, 8), (0, 7)
    ):
        yield Arrangement(every, later, jitter, offset)


def main() -> None:
    print("every later    jitter offset   hits by quarter of", 4 * len(WARNED), "  weights")
    for arrangement in grid():
        hits, weights = walk(arrangement)
        quarters = [int(part.sum()) for part in np.array_split(hits, 4)]
        print(
            f"{arrangement.every:5} {arrangement.later!s:9} {arrangement.jitter:5} {arrangement.offset:6}   ",
            *(f"{count:3}" for count in quarters),
            "  ",
            *(f"{weight:.2f}" for weight in weights),
        )


if __name__ == "__main__":
    main()
