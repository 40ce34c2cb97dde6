"""Followed: series of a history, worked out as its steps become known, and kept for longer than these.

In: a Series, and the steps that a history knows, some at a time. Out: its number at each of them. Where the history is
cut it goes on from there: of followers that look back to the beginning copies are kept now and then.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.live.series import Follower, Series, Steps

#: The most steps of which the numbers are kept, and steps that are worked out together.
_STEPS: Final = 1 << 19
_TOGETHER: Final = 4096
#: The most steps between two copies of a follower, and the most copies.
APART: Final = 1024
_COPIES: Final = 64

#: Gives what is known of the steps from one to another, both included.
Known: TypeAlias = Callable[[int, int], Steps]


class _Values(NamedTuple):
    """The numbers of so many steps (``filled``) from ``first`` on."""

    first: int
    filled: int
    array: FloatArray


class Followed:
    """A series, up to a step. One thread works it out, others read without waiting. Of what looks back to the beginning
    a copy is kept so many steps ``apart``: fewer than its history knows."""

    def __init__(self, series: Series, apart: int = APART) -> None:
        self.series, self._apart = series, apart
        self._values = _Values(0, 0, np.empty(256))
        #: the series behind the last step of ``_values``; None where that is to be found again
        self._now: Follower | None = None
        #: copies of it before these steps, ascending
        self._copies: list[tuple[int, Follower]] = []

    @property
    def last(self) -> int:
        """The last step that is worked out; −1 before the first."""
        return self._values.first + self._values.filled - 1

    @property
    def size(self) -> int:
        """The bytes that it takes."""
        return int(self._values.array.nbytes)

    def work_out(self, first: int, last: int, known: Known) -> None:
        """Work out the steps up to ``last``, of which those from ``first`` on are known."""
        while self.last < last:
            if self._now is None or first > self.last + 1:
                self._find(first, known)
                continue
            begin = self.last + 1
            end = min(last, begin + _TOGETHER - 1)
            if self.series.back is None:
                end = min(end, begin - begin % self._apart + self._apart - 1)
            self._append(self._now.rows(known(begin, end)))
            if self.series.back is None and (end + 1) % self._apart == 0:
                self._copies = [*self._copies[1 - _COPIES :], (end + 1, self._now.copy())]

    def _find(self, first: int, known: Known) -> None:
        """Be behind the last step that is worked out; where what follows is not known, before the ``first`` that is."""
        if first > self.last + 1:
            if self._values.filled:
                self._append(np.full(min(first - self.last - 1, _STEPS), np.nan))
            self._values = self._values if self.last == first - 1 else _Values(first, 0, self._values.array)
            self._now, self._copies = self.series.begin(first), []
            return
        if self._values.filled == 0:
            self._values, self._now = _Values(first, 0, self._values.array), self.series.begin(first)
            return
        place, found = first, None
        if self.series.back is not None:
            place = max(first, self.last + 1 - self.series.back)
        elif usable := [one for one in self._copies if first <= one[0] <= self.last + 1]:
            place, found = usable[-1]
        now = self.series.begin(place) if found is None else found.copy()
        for begin in range(place, self.last + 1, _TOGETHER):
            now.rows(known(begin, min(self.last, begin + _TOGETHER - 1)))
        self._now = now

    def _append(self, numbers: FloatArray) -> None:
        first, count, array = self._values
        if count + len(numbers) > len(array):
            kept = min(count, max(0, _STEPS - len(numbers)))
            room = np.empty(min(2 * _STEPS, 2 * (kept + len(numbers))))
            room[:kept] = array[count - kept : count]
            first, count, array = first + count - kept, kept, room
        array[count : count + len(numbers)] = numbers
        self._values = _Values(first, count + len(numbers), array)

    def cut(self, step: int) -> None:
        """Forget what came after a step."""
        if step < self.last:
            first, _, array = self._values
            count = max(0, step + 1 - first)
            self._values = _Values(first if count else step + 1, count, array)
            self._copies = [one for one in self._copies if one[0] <= step + 1]
            self._now = None

    def copy(self) -> Followed:
        """The same, which goes on by itself."""
        made = Followed(self.series, self._apart)
        made._values = self._values._replace(array=self._values.array.copy())
        made._now = None if self._now is None else self._now.copy()
        made._copies = list(self._copies)
        return made

    def after(self, step: int) -> Followed:
        """The steps after this one alone; more are not worked out."""
        first, count, array = self._values
        made, begin = Followed(self.series, self._apart), max(0, step + 1 - first)
        made._values = _Values(first + begin, max(0, count - begin), array[begin:count].copy())
        return made

    def go_on(self, later: Followed) -> None:
        """Have these steps follow, in place of all from the first of them on."""
        first, count, array = later._values
        self.cut(first - 1)
        if count and self.last == first - 1:
            self._append(array[:count])
            self._now = None

    def between(self, begin: int, end: int) -> tuple[IntArray, FloatArray]:
        """Of the steps from one to another, both included, those that are worked out, and their numbers."""
        first, count, array = self._values
        steps = np.arange(max(first, begin), min(first + count, end + 1))
        return steps, array[steps - first]
