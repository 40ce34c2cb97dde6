"""Tries: of several numbers of bands or rows the one that costs least, without trying all.

In: numbers, and what is made with one. Out: what costs least. More bands, or more rows, first make a page better and
then worse, so that what follows some tries in vain is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

#: Each single fold has to be worth this (with 0.97: thirty coupled instances take 40 % more room for 7 % fewer
#: crossings).
_EACH = 0.96
#: So many numbers of bands one after the other are tried in vain.
_IN_VAIN = 2
#: So many numbers of bands or rows are tried one by one, further ones in steps of a fifth, up to so many.
_ONE_BY_ONE, _STEP, _MOST_FOLDS = 8, 5, 40


class Costly(Protocol):
    """Something that has been tried."""

    @property
    def cost(self) -> float:
        """What it costs."""


Tried = TypeVar("Tried", bound=Costly)


def cheapest(tried: Callable[[int], Tried], counts: Iterable[int], found: Tried) -> Tried:
    """What costs least, clearly less than what is ``found``, with any of these numbers; once more have been no better
    for some times, even more are not tried."""
    best, vain = found, 0
    for count in counts:
        now = tried(count)
        vain += 1
        if now.cost < _EACH * best.cost:
            best, vain = now, 0
        if vain == _IN_VAIN:
            break
    return best


def steps(counts: range) -> Iterator[int]:
    """The numbers that are tried of these.

    >>> list(steps(range(2, 20)))
    [2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 19]
    """
    yield from (count for count in counts if count <= _ONE_BY_ONE)
    count = max(_ONE_BY_ONE + 1, counts.start)
    while count < min(counts.stop, _MOST_FOLDS + 1):
        yield count
        count += max(1, count // _STEP)
