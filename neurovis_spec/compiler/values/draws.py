"""Randomness that depends on names alone: Philox4x32-10, counted.

In: the seed, what is drawn (a purpose and a name), and for each number its counter (i, j, step, number of the draw).
Out: the number. There is no state: a draw depends on no order, no backend and no platform. Source: Salmon, Moraes,
Dror and Shaw, Parallel random numbers: as easy as 1, 2, 3 (SC 2011).

Exactly: the key is the first 8 bytes, little-endian, of the SHA-256 of ``SEED/PURPOSE/NAME`` (UTF-8, the seed in
decimal), the low word first. A block is four words w0 … w3 of 32 bits. A uniform number is ⌊w0/2^5⌋·2^26 + ⌊w1/2^6⌋
over 2^53, in [0, 1); a normal one comes from two such, of w0 w1 and of w2 w3, by ``box_muller.normal``; a count of the
Poisson distribution from one, by ``poisson.counts``.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, Indices, IntArray, width
from neurovis_spec.compiler.values import box_muller, poisson
from neurovis_spec.language.expressions.tree import DrawKind

WordArray: TypeAlias = npt.NDArray[np.uint32]
LongArray: TypeAlias = npt.NDArray[np.uint64]
#: the four words of counters, or of what becomes of them
Block: TypeAlias = tuple[LongArray, LongArray, LongArray, LongArray]
#: One part of a counter: integers that broadcast with the other parts; taken modulo 2^32.
Index: TypeAlias = int | npt.NDArray[np.integer]
Value: TypeAlias = float | FloatArray

_MULTIPLIERS = (np.uint64(0xD2511F53), np.uint64(0xCD9E8D57))
_WEYL = (0x9E3779B9, 0xBB67AE85)
_ROUNDS = 10
_LOW, _HIGH = np.uint64(0xFFFFFFFF), np.uint64(32)
#: Blocks made at once: what fits into a processor's cache.
_CHUNK = 8192


def philox4x32(counter: WordArray, key: tuple[int, int]) -> WordArray:
    """The blocks of Philox4x32-10 for counters (…, 4) and a key of two words: (…, 4).

    >>> [hex(word) for word in philox4x32(np.zeros(4, np.uint32), (0, 0))]
    ['0x6627e8d5', '0xe169c58d', '0xbc57ac4c', '0x9b00dbd8']
    """
    counters = np.asarray(counter, dtype=np.uint32)
    flat = counters.reshape(-1, 4)
    blocks = np.empty_like(flat)
    for start in range(0, len(flat), _CHUNK):
        parts = flat[start : start + _CHUNK].T.astype(np.uint64)
        blocks[start : start + _CHUNK] = np.stack(_rounds((parts[0], parts[1], parts[2], parts[3]), key), axis=-1)
    return blocks.reshape(counters.shape)


def _rounds(parts: Block, key: tuple[int, int]) -> Block:
    """The words w0 … w3 of counters, each below 2^32 in 64 bits. What the parts of a counter have in common is computed
    once: they broadcast, and so do the words."""
    c0, c1, c2, c3 = parts
    k0, k1 = key
    for _ in range(_ROUNDS):
        first, second = _MULTIPLIERS[0] * c0, _MULTIPLIERS[1] * c2
        c0, c1 = (second >> _HIGH) ^ (c1 ^ np.uint64(k0)), second & _LOW
        c2, c3 = (first >> _HIGH) ^ (c3 ^ np.uint64(k1)), first & _LOW
        k0, k1 = (k0 + _WEYL[0]) & 0xFFFFFFFF, (k1 + _WEYL[1]) & 0xFFFFFFFF
    return c0, c1, c2, c3


def _pieces(shape: tuple[int, ...]) -> Iterator[tuple[slice, ...]]:
    """An array of this shape in pieces of at most ``_CHUNK`` items."""
    if not shape:
        yield ()
        return
    behind = math.prod(shape[1:])
    if behind <= _CHUNK:
        rows = max(1, _CHUNK // max(behind, 1))
        for start in range(0, shape[0], rows):
            yield slice(start, start + rows), *(slice(None) for _ in shape[1:])
        return
    for row in range(shape[0]):
        for piece in _pieces(shape[1:]):
            yield slice(row, row + 1), *piece


def _fraction(high: LongArray, low: LongArray) -> FloatArray:
    """53 bits of two words, as a number in [0, 1)."""
    return (((high >> np.uint64(5)) << np.uint64(26)) | (low >> np.uint64(6))).astype(np.float64) * 2.0**-53


def _normal(block: Block) -> FloatArray:
    return box_muller.normal(_fraction(block[0], block[1]), _fraction(block[2], block[3]))


def _word(part: Indices) -> LongArray:
    """A part of a counter modulo 2^32."""
    return part.astype(np.uint64) & _LOW


@dataclass(frozen=True)
class Stream:
    """The numbers of one purpose and name under a seed.

    The purpose is one of ``weight``, ``centre``, ``edges``, ``count``, ``delay``, ``bias``, ``initial``, ``noise``,
    ``input``; the name that of the group or input with the path of its instance (``left1.K``), or that of the entry
    behind the path of the instance that declares it (``left1/K -> O``; an entry ``left1.K -> O`` around the instance
    draws by itself).

    >>> Stream(7, "weight", "K -> O").uniform(0, np.arange(3), 0, 0).round(6)
    array([0.091661, 0.668837, 0.808927])
    """

    seed: int
    purpose: str
    name: str

    @cached_property
    def key(self) -> tuple[int, int]:
        """The two words of the key, low and high."""
        digest = hashlib.sha256(f"{self.seed}/{self.purpose}/{self.name}".encode()).digest()
        return int.from_bytes(digest[:4], "little"), int.from_bytes(digest[4:8], "little")

    def words(self, i: Index, j: Index, step: Index, draw: Index) -> WordArray:
        """The four words of each counter: the shape of the broadcast parts, and (4,)."""
        parts = np.broadcast_arrays(*(np.asarray(part, dtype=np.int64) for part in (i, j, step, draw)))
        return philox4x32(np.stack(parts, axis=-1).astype(np.uint32), self.key)

    def uniform(self, i: Index, j: Index, step: Index, draw: Index) -> FloatArray:
        """Uniform numbers in [0, 1), of the shape to which the parts of the counter broadcast."""
        return self._numbers((i, j, step, draw), lambda block: _fraction(block[0], block[1]))

    def normal(self, i: Index, j: Index, step: Index, draw: Index) -> FloatArray:
        """Standard normal numbers, of the shape to which the parts of the counter broadcast."""
        return self._numbers((i, j, step, draw), _normal)

    def _numbers(self, parts: tuple[Index, Index, Index, Index], make: Callable[[Block], FloatArray]) -> FloatArray:
        """A number of each counter, so many at a time that what they are made of stays in a processor's cache."""
        shape = np.broadcast_shapes(*(np.shape(part) for part in parts))
        aligned = [np.asarray(part) for part in parts]
        aligned = [part.reshape((1,) * (len(shape) - part.ndim) + part.shape) for part in aligned]
        numbers = np.empty(shape)
        for piece in _pieces(shape):
            c0, c1, c2, c3 = (
                part[tuple(taken if size > 1 else slice(None) for taken, size in zip(piece, part.shape, strict=True))]
                for part in aligned
            )
            block = _rounds((_word(c0), _word(c1), _word(c2), _word(c3)), self.key)
            numbers[piece] = make(block)
        return numbers

    def drawn(
        self,
        kind: DrawKind,
        first: Value,
        second: Value,
        counter: tuple[Index, Index, Index, Index],
    ) -> FloatArray:
        """``normal(first, second)``: mean and deviation; ``uniform(first, second)``: from low to below high; or
        ``poisson(first)``: the mean. The counter is (i, j, step, draw).

        NaN where a deviation is negative, or that is no mean: no distribution has one.
        """
        if kind == "poisson":
            return poisson.counts(first, self.uniform(*counter))
        if kind == "normal":
            drawn = np.asarray(first + second * self.normal(*counter))
            return np.where(np.less(second, 0), np.nan, drawn) if np.less(second, 0).any() else drawn
        return np.asarray(first + (second - first) * self.uniform(*counter))

    def chosen(self, rows: IntArray, chances: FloatArray) -> tuple[IntArray, IntArray]:
        """The pairs of these rows, each of which is there with a probability of its own, of ``chances`` (rows, n): the
        indices of their rows among these and their targets, row by row.

        A pair (i, j) is there where u is less than its probability. Sixteen neighbours share a block: with b the byte
        j mod 16 of the counter (i, ⌊j/16⌋, 0, 0), the lowest of w0 first, u lies from b/2^8 to (b + 1)/2^8. Where that
        does not decide, u is (b + v)/2^8, v the uniform number of the counter (i, j, 0, 1).
        """
        n = chances.shape[1]
        blocks = np.arange(-(-n // 16), dtype=np.int64)
        words = np.empty((len(rows), len(blocks), 4), dtype="<u4")
        for some, others in _pieces(words.shape[:2]):
            i, j, none = _word(rows[some, None]), _word(blocks[None, others]), np.zeros((), dtype=np.uint64)
            for place, word in enumerate(_rounds((i, j, none, none), self.key)):
                words[some, others, place] = word
        byte, scaled = words.view(np.uint8).reshape(len(rows), -1)[:, :n], chances * 2.0**8
        row, target = np.divmod(np.flatnonzero(byte < scaled), n)
        rest = scaled[row, target] - byte[row, target]
        unsure = np.flatnonzero(rest < 1)
        there = np.ones(len(row), dtype=np.bool_)
        there[unsure] = self.uniform(rows[row[unsure]], target[unsure], 0, 1) < rest[unsure]
        return row[there], target[there]

    def random_targets(self, row: int, n: int, probability: float) -> IntArray:
        """The targets 0 … n−1 that row ``row`` connects to, each with this probability, ascending.

        From target to target goes a geometric gap: the numbers u0, u1, … of the counters (row, number of the gap, 0, 0)
        leave out ⌊ln(1 − u)/ln(1 − probability)⌋ targets before the first, after the first, and so on.
        """
        return self._connected(np.array([row], dtype=np.int64), n, probability)[1]

    def random_pairs(self, rows: int, n: int, probability: float) -> tuple[Indices, Indices]:
        """The rows and the targets of ``random_targets`` for the rows 0 … rows−1, row by row, in the least width."""
        together, kind = max(1, _CHUNK // _batch(n, probability)), width(-1, max(rows, n))
        i, j = [np.empty(0, dtype=kind)], [np.empty(0, dtype=kind)]
        for start in range(0, rows, together):
            some = np.arange(start, min(start + together, rows), dtype=np.int64)
            for side, found in zip((i, j), self._connected(some, n, probability), strict=True):
                side.append(found.astype(kind))
        return np.concatenate(i), np.concatenate(j)

    def _connected(self, rows: IntArray, n: int, probability: float) -> tuple[IntArray, IntArray]:
        """The pairs of several rows at once, ordered by row and target."""
        if probability <= 0 or n <= 0:
            return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
        if probability >= 1:
            return np.repeat(rows, n), np.tile(np.arange(n, dtype=np.int64), len(rows))
        scale, batch = _log1p(-probability), _batch(n, probability)
        found: list[tuple[IntArray, IntArray]] = []
        last, number = np.full(len(rows), -1, dtype=np.int64), np.arange(batch, dtype=np.int64)
        waiting = rows
        while len(waiting):
            with np.errstate(over="ignore"):  # a gap beyond all numbers is one beyond n
                skipped = np.floor(box_muller.log(1.0 - self.uniform(waiting[:, None], number, 0, 0)) / scale)
            targets = last[:, None] + np.cumsum(np.minimum(skipped, n).astype(np.int64) + 1, axis=1)
            inside = targets < n
            found.append((np.repeat(waiting, np.count_nonzero(inside, axis=1)), targets[inside]))
            unfinished = inside[:, -1]
            waiting, last, number = waiting[unfinished], targets[unfinished, -1], number + batch
        i, j = (np.concatenate(parts) for parts in zip(*found, strict=True))
        order = np.argsort(i, kind="stable")
        return i[order], j[order]


def _batch(n: int, probability: float) -> int:
    """How many gaps to draw at once: nearly always enough for a row. The result does not depend on it."""
    expected = n * min(max(probability, 0.0), 1.0)
    return int(expected + 4 * expected**0.5) + 4


def _log1p(x: float) -> float:
    """ln(1 + x), right for a small x as well (Kahan), by the same logarithm as the gaps."""
    rounded = 1.0 + x
    if rounded == 1.0:
        return x
    return float(box_muller.log(np.array(rounded))) * (x / (rounded - 1.0))
