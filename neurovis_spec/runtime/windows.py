"""Sums, least and greatest values over the last N steps, or over all, in constant time a step.

In: values, one a step. Out: the summary after each. Steps lie in blocks of N: a window is the end of one block and the
beginning of the next, and of both the sums are known, so that nothing is ever subtracted: rounding does not add up, and
what was infinite or NaN is forgotten N steps later. Of all steps the sum is kept in two numbers, to about 100 bits.

With N = 3 and the values a b c | d e, the window after e is c d e: the *tail* of the block before from c on, and the
*head* of this one, d e.
"""

from __future__ import annotations

import math
from typing import Final, Protocol

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.language.expressions.functions import maximum, minimum
from neurovis_spec.language.expressions.measures import Summary

#: How two values of a summary become one, and the value of none; the sum of rms is one of squares.
_COMBINE: Final = {"rms": np.add, "mean": np.add, "min": np.minimum, "max": np.maximum}
_BEGIN: Final = {"rms": 0.0, "mean": 0.0, "min": math.inf, "max": -math.inf}


class Running(Protocol):
    """A summary that is updated step by step."""

    def push(self, value: float) -> float:
        """One more value; the summary by now."""
        ...

    def extend(self, values: FloatArray) -> FloatArray:
        """More values; the summary after each."""
        ...


def running(summary: Summary, last: int | None) -> Running:
    """A summary of the last N values, or of all."""
    return _All(summary) if last is None else _Last(summary, last)


class _Last:
    """Of the last ``count`` values; of fewer while there are not so many."""

    def __init__(self, summary: Summary, count: int) -> None:
        self._summary, self._count = summary, count
        self._block = np.empty(count)
        self._filled = 0
        #: the summary of the block so far
        self._head = _BEGIN[summary]
        #: the summaries of the block before from each place to its end, None in the first block
        self._tails: FloatArray | None = None

    def push(self, value: float) -> float:
        if self._filled == self._count:
            self._begin_block()
        value = value * value if self._summary == "rms" else value
        self._block[self._filled] = value
        self._filled += 1
        self._head = _combined(self._summary, self._head, value)
        count = self._filled if self._tails is None else self._count
        total = self._head
        if self._tails is not None and self._filled < self._count:
            total = _combined(self._summary, float(self._tails[self._filled]), total)
        return _finished(self._summary, total, count)

    def _begin_block(self) -> None:
        """The block is full: another begins."""
        with np.errstate(all="ignore"):
            self._tails = _COMBINE[self._summary].accumulate(self._block[::-1])[::-1]
        self._filled, self._head = 0, _BEGIN[self._summary]

    def extend(self, values: FloatArray) -> FloatArray:
        result = np.empty(len(values))
        first = 0
        while first < len(values):
            if self._filled == self._count:
                self._begin_block()
            begin = self._filled
            of_block = values[first : first + self._count - begin]
            result[first : first + len(of_block)] = self._within(of_block, begin)
            first += len(of_block)
        return result

    def _within(self, values: FloatArray, begin: int) -> FloatArray:
        """More values of one block."""
        combine, end = _COMBINE[self._summary], begin + len(values)
        with np.errstate(all="ignore"):
            values = values * values if self._summary == "rms" else values
            self._block[begin:end] = values
            heads = combine.accumulate(np.concatenate(([self._head], values)))[1:]
            self._head, self._filled = float(heads[-1]), end
            if self._tails is None:
                totals, counts = heads, np.arange(begin + 1.0, end + 1.0)
            else:
                tails = np.append(self._tails, _BEGIN[self._summary])[begin + 1 : end + 1]
                totals, counts = combine(tails, heads), np.full(len(values), float(self._count))
            return _finished_array(self._summary, totals, counts)


class _All:
    """Of all values."""

    def __init__(self, summary: Summary) -> None:
        self._summary = summary
        self._made = 0
        #: the summary so far; of a sum also what its rounding has left
        self._high, self._low = _BEGIN[summary], 0.0

    def push(self, value: float) -> float:
        return float(self.extend(np.array([value]))[-1])

    def extend(self, values: FloatArray) -> FloatArray:
        if not len(values):
            return values
        combine = _COMBINE[self._summary]
        with np.errstate(all="ignore"):
            values = values * values if self._summary == "rms" else values
            totals = combine.accumulate(np.concatenate(([self._high], values)))[1:]
            if combine is np.add:
                self._add(values)
                # those between are rounded one by one; the last is as exact as the sum, on which the next call goes on
                totals[-1] = self._high
            else:
                self._high = float(totals[-1])
            counts = np.arange(self._made + 1.0, self._made + len(values) + 1.0)
            self._made += len(values)
            return _finished_array(self._summary, totals, counts)

    def _add(self, values: FloatArray) -> None:
        """Add to the sum: ``_high`` is it rounded, ``_low`` what the rounding has left."""
        rough = self._high + float(np.add.reduce(values))
        if not math.isfinite(rough):
            self._high, self._low = rough, 0.0
            return
        parts = [self._high, self._low, *values.tolist()]
        self._high = math.fsum(parts)
        self._low = math.fsum([*parts, -self._high])


def _combined(summary: Summary, one: float, other: float) -> float:
    if summary in ("rms", "mean"):
        return one + other
    return minimum(one, other) if summary == "min" else maximum(one, other)


def _finished(summary: Summary, total: float, count: int) -> float:
    """The summary of ``count`` values that come to ``total``."""
    if summary in ("min", "max"):
        return total + 0.0  # of 0 and −0 NumPy takes either: −0 becomes 0
    mean = total / count
    return mean if summary == "mean" else math.sqrt(mean)


def _finished_array(summary: Summary, totals: FloatArray, counts: FloatArray) -> FloatArray:
    """The same for many totals at once."""
    if summary in ("min", "max"):
        return totals + 0.0
    return np.asarray(np.sqrt(totals / counts) if summary == "rms" else totals / counts, dtype=np.float64)
