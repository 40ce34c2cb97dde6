"""The types of a network's arrays, which are read-only.

In: an array. Out: the same, which nobody can write to any more; what reads the elements that it names; or a Column, in
which what is equal over a stretch is kept once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any, Generic, NamedTuple, TypeAlias, TypeVar, cast, overload

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
#: integers of any width, to take elements by: nothing is computed with them
Indices: TypeAlias = npt.NDArray[np.integer]
BoolArray: TypeAlias = npt.NDArray[np.bool_]
Array = TypeVar("Array", bound="npt.NDArray[Any]")
Kind = TypeVar("Kind", bound=np.generic)
Number = TypeVar("Number", np.float64, np.int64)
#: fewer equal numbers are kept as they are
_SHORT = 8
#: numbers that are made at once where many are read from one end to the other
PIECE = 1 << 16
#: the integers that are narrower than others, with the least and the greatest of each
_NARROW = tuple((kind, np.iinfo(kind).min, np.iinfo(kind).max) for kind in (np.int8, np.int16, np.int32))


def frozen(array: Array) -> Array:
    """The same array, made read-only."""
    array.flags.writeable = False
    return array


def narrow(array: Indices) -> Indices:
    """The same integers in the least width that holds them.

    >>> narrow(np.array([-1, 200])).dtype, narrow(np.arange(3)).dtype
    (dtype('int16'), dtype('int8'))
    """
    low, high = (int(array.min()), int(array.max())) if array.size else (0, 0)
    return array.astype(width(low, high), copy=False)


def width(low: int, high: int) -> type[np.signedinteger]:
    """The least width of integers from ``low`` to ``high``."""
    for kind, least, most in _NARROW:
        if least <= low and high <= most:
            return kind
    return np.int64


def pieces(array: npt.NDArray[Kind]) -> Iterator[npt.NDArray[Kind]]:
    """An array some of it at a time, as what is made of all of it at once would take more room than it takes: an index
    of NumPy has eight bytes, however narrow it was. There is at least one piece."""
    for start in range(0, max(len(array), 1), PIECE):
        yield array[start : start + PIECE]


def starts_of(numbers: Indices, below: int) -> IntArray:
    """Where each number from 0 to ``below`` − 1 begins when many of them are sorted, and at last how many these are."""
    result = np.zeros(below + 1, dtype=np.int64)
    for piece in pieces(numbers):
        result[1:] += np.bincount(piece, minlength=below)
    return np.cumsum(result)


def sorting(numbers: Indices, starts: IntArray) -> Iterator[tuple[slice, IntArray]]:
    """Where each of many numbers stands when they are sorted, equal ones in their order: some of them at a time, where
    these stand now, and where then. ``starts`` are those of the numbers. It is done by counting, in linear time and in
    the room of a piece.

    >>> numbers = np.array([1, 0, 2, 0])
    >>> [places.tolist() for _, places in sorting(numbers, starts_of(numbers, 3))]
    [[2, 0, 3, 1]]
    """
    below = len(starts) - 1
    free, size = starts[:-1].copy(), max(PIECE, below)  # where the next of each number is to stand
    for start in range(0, len(numbers), size):
        some = numbers[start : start + size]
        order, counts = np.argsort(some, kind="stable"), np.bincount(some, minlength=below)
        places = np.empty(len(some), dtype=np.int64)
        places[order] = np.arange(len(some)) + np.repeat(free - (np.cumsum(counts) - counts), counts)
        yield slice(start, start + len(some)), places
        free += counts


def subscript(indices: IntArray) -> slice | IntArray | None:
    """A slice where the indices lie in a row, which is quicker; None without any."""
    if not len(indices):
        return None
    first, count = int(indices[0]), len(indices)
    return slice(first, first + count) if np.array_equal(indices, np.arange(first, first + count)) else indices


class Column(Generic[Number]):
    """Numbers, read-only: what is equal over a stretch is kept once, integers in the least width that holds them all.
    What is taken from it has the full width.

    >>> column = Column.of([np.full(1000, 7), np.arange(3)], np.int64)
    >>> len(column), int(column[999]), column[np.array([0, 1002])], column.kept
    (1003, 7, array([7, 2]), array([7, 0, 1, 2], dtype=int8))
    """

    __slots__ = ("_bounds", "_first", "_kind", "_step", "kept")

    def __init__(
        self, kind: type[Number], bounds: IntArray, first: IntArray, step: IntArray, kept: npt.NDArray[Any]
    ) -> None:
        self._kind: type[Number] = kind
        #: number c of a stretch is kept[first + step·(c − bound)]: a step is 0 where all are equal, else 1
        self._bounds, self._first, self._step = bounds, first, step
        #: the numbers, those that are equal over a stretch once
        self.kept = frozen(kept)

    @classmethod
    def of(cls, parts: Iterable[npt.NDArray[Any]], kind: type[Number]) -> Column[Number]:
        """A column of these parts, one behind the other; one that is broadcast takes no more than its number."""
        sizes: list[int] = []
        steps: list[int] = []
        kept: list[npt.NDArray[Any]] = []
        run: Iterable[npt.NDArray[Any]]
        for alike, run in groupby((part for part in parts if len(part)), _alike):
            some = [*run]
            kept.append(some[0][:1] if alike else some[0] if len(some) == 1 else np.concatenate(some))
            sizes.append(sum(map(len, some)))
            steps.append(0 if alike else 1)
        values = kept[0] if len(kept) == 1 else np.concatenate([*kept, np.zeros(0, dtype=kind)])
        bounds = np.concatenate(([0], np.cumsum(sizes, dtype=np.int64)))
        first = np.concatenate(([0], np.cumsum([len(part) for part in kept], dtype=np.int64)))[:-1]
        values = values.astype(np.float64, copy=False) if kind is np.float64 else narrow(values)
        return cls(kind, bounds, first, np.array(steps, dtype=np.int64), np.ascontiguousarray(values))

    @classmethod
    def repeated(cls, values: npt.NDArray[Any], sizes: IntArray, kind: type[Number]) -> Column[Number]:
        """A column of each value so many times."""
        if len(values) and (values == values[0]).all():
            return cls.of([np.broadcast_to(values[0], (int(sizes.sum()),))], kind)
        if _SHORT * len(sizes) > sizes.sum():
            return cls.of([np.repeat(values, sizes)], kind)
        return cls.of(
            [np.broadcast_to(value, (size,)) for value, size in zip(values, sizes.tolist(), strict=True)], kind
        )

    def __len__(self) -> int:
        return int(self._bounds[-1])

    @overload
    def __getitem__(self, index: int) -> Number: ...
    @overload
    def __getitem__(self, index: Indices | BoolArray | slice) -> npt.NDArray[Number]: ...
    def __getitem__(self, index: int | Indices | BoolArray | slice) -> Number | npt.NDArray[Number]:
        if not isinstance(index, slice | np.ndarray):
            return self._kind(self.kept[self._at(np.asarray(range(len(self))[index]))])
        if isinstance(index, slice):
            index = np.arange(*index.indices(len(self)))
        at = np.flatnonzero(index) if index.dtype == np.bool_ else cast("Indices", index)
        return self.some(at).astype(self._kind)

    def some(self, indices: Indices) -> npt.NDArray[Any]:
        """Some of them, read-only, in the width in which they are kept; see ``compact``."""
        if len(self._step) == 1 and not self._step[0]:
            return np.broadcast_to(self.kept[0], indices.shape)
        return frozen(self.kept[self._at(indices)])

    def _at(self, indices: Indices) -> Indices:
        """Where these numbers are kept."""
        if len(self._step) == 1:
            return indices if self._step[0] else np.zeros_like(indices)
        if (indices < 0).any():
            indices = np.where(indices < 0, indices + np.int64(len(self)), indices)
        run = np.searchsorted(self._bounds, indices, side="right") - 1
        return np.asarray(self._first[run] + self._step[run] * (indices - self._bounds[run]))

    def whole(self) -> npt.NDArray[Number]:
        """All of them, made anew where they are not kept so: a reader's own, for as long as it needs them."""
        if len(self._step) == 1 and not self._step[0]:
            return np.broadcast_to(self._kind(self.kept[0]), (len(self),))
        return frozen(self.compact().astype(self._kind, copy=False))

    def compact(self) -> npt.NDArray[Any]:
        """All of them in the width in which they are kept: to be compared, or to take elements by, not to be computed
        with."""
        if len(self._step) == 1 and self._step[0]:
            return self.kept
        result = np.empty(len(self), dtype=self.kept.dtype)
        for start, stop, numbers in self.stretches():
            result[start:stop] = numbers
        return frozen(result)

    def stretches(self) -> Iterator[tuple[int, int, npt.NDArray[Any]]]:
        """What is kept of each stretch: where it begins and ends, and its numbers, one where all are equal."""
        for start, stop, first, step in zip(
            self._bounds.tolist(), self._bounds[1:].tolist(), self._first.tolist(), self._step.tolist(), strict=False
        ):
            yield start, stop, self.kept[first : first + (stop - start if step else 1)]

    def pieces(self) -> Iterator[npt.NDArray[Number]]:
        """All of them, some at a time."""
        for start, stop, numbers in self.stretches():
            for begin in range(0, stop - start, PIECE):
                size = min(PIECE, stop - start - begin)
                some = numbers[begin : begin + size] if len(numbers) > 1 else np.broadcast_to(numbers, (size,))
                yield some.astype(self._kind)

    @overload
    def tolist(self: Column[np.int64]) -> list[int]: ...
    @overload
    def tolist(self: Column[np.float64]) -> list[float]: ...
    def tolist(self) -> list[int] | list[float]:
        """All of them, as Python's numbers."""
        return [number for piece in self.pieces() for number in piece.tolist()]


IntColumn: TypeAlias = Column[np.int64]
FloatColumn: TypeAlias = Column[np.float64]


def integers(*parts: Indices) -> IntColumn:
    """A column of these parts, one behind the other."""
    return Column.of(parts, np.int64)


def reals(*parts: FloatArray) -> FloatColumn:
    """A column of these parts, one behind the other."""
    return Column.of(parts, np.float64)


class Texts(NamedTuple):
    """A text for each of many, or none: ``known[number]`` of each of the ``numbers``, none of −1."""

    known: tuple[str, ...]
    numbers: Indices

    def of(self, place: int) -> str:
        """The text of one, "" where it has none."""
        number = int(self.numbers[place])
        return "" if number < 0 else self.known[number]

    def at(self, places: IntArray) -> Texts:
        """Those of some, in this order."""
        return self._replace(numbers=self.numbers[places])

    @property
    def used(self) -> tuple[str, ...]:
        """The texts that are there, in no order that means anything."""
        return tuple(self.known[number] for number in np.unique(self.numbers).tolist() if number >= 0)


def texts_of(parts: Iterable[tuple[Texts | None, int]]) -> Texts | None:
    """The texts of all parts, one behind the other, of which each has so many, or none; None where none has any."""
    every = [*parts]
    if all(texts is None for texts, _ in every):
        return None
    number_of: dict[str, int] = {}
    found: list[Indices] = []
    for texts, count in every:
        if texts is None:
            found.append(np.full(count, -1, dtype=np.int8))
        else:
            moved = [number_of.setdefault(text, len(number_of)) for text in texts.known]
            found.append(np.array([*moved, -1], dtype=np.int64)[texts.numbers])
    return Texts(tuple(number_of), frozen(narrow(np.concatenate(found))))


def _alike(part: npt.NDArray[Any]) -> bytes:
    """The bits of the one number that is kept of a part, where it is long and all of it is equal in all bits; else
    nothing."""
    if len(part) < _SHORT:
        return b""
    if part.strides != (0,):
        bits = np.ascontiguousarray(part).view(np.dtype(f"i{part.itemsize}"))
        if (bits != bits[0]).any():
            return b""
    return part[:1].tobytes()
