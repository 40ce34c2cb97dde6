from __future__ import annotations

import doctest
import hashlib
import math
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from neurovis_spec.compiler.values import box_muller, draws
from neurovis_spec.compiler.values.draws import Stream, philox4x32

SEEDS = st.integers(-(2**63), 2**63 - 1)


@pytest.mark.parametrize("module", [draws, box_muller], ids=lambda m: m.__name__)
def test_doctests(module: ModuleType) -> None:
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0


# Known answers of Random123 (kat_vectors, philox4x32 with 10 rounds).
KNOWN = [
    ((0, 0, 0, 0), (0, 0), "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        "d16cfe09 94fdcceb 5001e420 24126ea1",
    ),
]


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN)
def test_philox_known_answers(counter: tuple[int, ...], key: tuple[int, int], answer: str) -> None:
    block = philox4x32(np.array(counter, dtype=np.uint32), key)
    assert block.dtype == np.uint32
    assert " ".join(f"{word:08x}" for word in block) == answer


def plain_philox(counter: list[int], key: list[int]) -> list[int]:
    """The algorithm as the paper prints it, in Python integers."""
    for _ in range(10):
        first, second = 0xD2511F53 * counter[0], 0xCD9E8D57 * counter[2]
        counter = [
            (second >> 32) ^ counter[1] ^ key[0],
            second & 0xFFFFFFFF,
            (first >> 32) ^ counter[3] ^ key[1],
            first & 0xFFFFFFFF,
        ]
        key = [(key[0] + 0x9E3779B9) & 0xFFFFFFFF, (key[1] + 0xBB67AE85) & 0xFFFFFFFF]
    return counter


WORD = st.integers(0, 2**32 - 1)


@given(st.lists(st.tuples(WORD, WORD, WORD, WORD), min_size=1, max_size=5), st.tuples(WORD, WORD))
def test_philox_agrees_with_plain_integers(counters: list[tuple[int, ...]], key: tuple[int, int]) -> None:
    blocks = philox4x32(np.array(counters, dtype=np.uint32), key)
    assert blocks.tolist() == [plain_philox(list(counter), list(key)) for counter in counters]


def test_philox_in_chunks_and_any_shape() -> None:
    counters = np.arange(4 * 40000, dtype=np.uint32).reshape(200, 200, 4)
    blocks = philox4x32(counters, (1, 2))
    assert blocks.shape == (200, 200, 4)
    for at in ((0, 0), (81, 183), (81, 184), (199, 199)):
        np.testing.assert_array_equal(blocks[at], philox4x32(counters[at], (1, 2)))
    assert philox4x32(np.empty((0, 4), dtype=np.uint32), (1, 2)).shape == (0, 4)


def test_key_is_the_digest() -> None:
    digest = hashlib.sha256(b"-9223372036854775808/weight/left1.K -> O (2)").digest()
    low, high = Stream(-(2**63), "weight", "left1.K -> O (2)").key
    assert low + 2**32 * high == int.from_bytes(digest[:8], "little")


def test_uniform_composition() -> None:
    stream = Stream(7, "weight", "K -> O")
    words = [int(word) for word in stream.words(3, 1, 5, 2)]
    assert words == plain_philox([3, 1, 5, 2], list(stream.key))
    assert float(stream.uniform(3, 1, 5, 2)) == ((words[0] >> 5) * 2**26 + (words[1] >> 6)) / 2**53
    first, second = (((words[k] >> 5) * 2**26 + (words[k + 1] >> 6)) / 2**53 for k in (0, 2))
    expected = math.sqrt(-2 * math.log(1 - first)) * math.cos(2 * math.pi * second)
    assert float(stream.normal(3, 1, 5, 2)) == pytest.approx(expected, rel=1e-14)


# Pinned: a change here changes every network that draws.
GOLDEN_UNIFORM = ["0x1.5671ca6da36ebp-1", "0x1.4564c8c4d79dep-1"]
GOLDEN_NORMAL = ["-0x1.02ba56937ab9fp+0", "0x1.7c5be4ec1e454p-1", "0x1.d73dd15c976f5p-2", "0x1.c2c2152bc60f4p-4"]
GOLDEN_TARGETS = [0, 3, 18, 19, 21, 24, 36, 37]


def test_golden_values() -> None:
    stream = Stream(7, "weight", "K -> O")
    assert stream.key == (1904109748, 1066991554)
    assert [float(u).hex() for u in stream.uniform(np.arange(2), 1, 0, 0)] == GOLDEN_UNIFORM
    assert [float(z).hex() for z in stream.normal(np.arange(4), 0, 9, 1)] == GOLDEN_NORMAL
    assert Stream(-1, "edges", "A -> B").random_targets(2, 40, 0.2).tolist() == GOLDEN_TARGETS


@given(SEEDS, st.integers(0, 10**6), st.integers(0, 10**6), st.integers(0, 10**7), st.integers(0, 9))
@settings(max_examples=30)
def test_one_by_one_equals_all_at_once(seed: int, i: int, j: int, step: int, draw: int) -> None:
    stream = Stream(seed, "noise", "K")
    rows, columns = np.arange(i, i + 3)[:, None], np.arange(j, j + 19)
    for method in (stream.uniform, stream.normal):
        table = method(rows, columns, step, draw)
        assert table.shape == (3, 19)
        single = [[float(method(int(r), int(c), step, draw)) for c in columns] for r in rows[:, 0]]
        assert table.tolist() == single
        np.testing.assert_array_equal(method(rows, columns[::-1], step, draw), table[:, ::-1])


def test_every_part_counts() -> None:
    base = Stream(1, "weight", "A")
    reference = float(base.uniform(0, 0, 0, 0))
    others = [Stream(2, "weight", "A"), Stream(1, "bias", "A"), Stream(1, "weight", "B")]
    values = [float(other.uniform(0, 0, 0, 0)) for other in others]
    values += [float(base.uniform(*(int(k == part) for k in range(4)))) for part in range(4)]
    assert len({reference, *values}) == 8


@pytest.mark.parametrize("seed", [0, 1, -5])
def test_moments(seed: int) -> None:
    stream, count = Stream(seed, "initial", "K"), 40000
    u = stream.uniform(np.arange(200)[:, None], np.arange(200), 0, 0).ravel()
    z = stream.normal(np.arange(200)[:, None], np.arange(200), 0, 0).ravel()
    five = 5 / math.sqrt(count)  # five standard errors
    assert u.min() >= 0
    assert u.max() < 1
    assert abs(u.mean() - 0.5) < five * math.sqrt(1 / 12)
    assert abs(u.var() - 1 / 12) < five * math.sqrt(1 / 180)
    assert abs(z.mean()) < five
    assert abs(z.var() - 1) < five * math.sqrt(2)
    assert abs((z**3).mean()) < five * math.sqrt(15)
    assert abs((z**4).mean() - 3) < five * math.sqrt(96)
    assert abs(np.mean(u[1:] * u[:-1]) - 0.25) < five * math.sqrt(7 / 144)
    inside = np.abs(z) < 1
    assert abs(inside.mean() - math.erf(math.sqrt(0.5))) < five * 0.5


def test_drawn_scales() -> None:
    stream = Stream(3, "weight", "A")
    z, u = stream.normal(1, 2, 0, 0), stream.uniform(1, 2, 0, 0)
    assert stream.drawn("normal", 10.0, 0.5, (1, 2, 0, 0)) == 10 + 0.5 * z
    assert stream.drawn("uniform", -1.0, 3.0, (1, 2, 0, 0)) == -1 + 4 * u
    assert stream.drawn("uniform", np.zeros(3), 1.0, (1, 2, 0, 0)).tolist() == [u] * 3


@given(st.integers(1, 2**53))
def test_log_is_the_logarithm(numerator: int) -> None:
    x = numerator / 2**53
    assert float(box_muller.log(np.array(x))) == pytest.approx(math.log(x), rel=4e-16, abs=0)


@given(st.integers(0, 2**53))
def test_cosine_is_the_cosine(numerator: int) -> None:
    u = numerator / 2**53
    assert float(box_muller.cos_turns(np.array(u))) == pytest.approx(math.cos(2 * math.pi * u), rel=0, abs=1e-15)


def test_extreme_uniforms_stay_finite() -> None:
    extreme = np.array([0.0, 1 - 2.0**-53])
    values = box_muller.normal(extreme[:, None], np.array([0.0, 0.25, 0.5, 0.75]))
    assert values[0].tolist() == [0, 0, 0, 0]
    assert values[1, 0] == pytest.approx(math.sqrt(2 * 53 * math.log(2)), rel=1e-15)
    assert values[1, 2] == -values[1, 0]


def plain_targets(stream: Stream, row: int, n: int, probability: float) -> list[int]:
    """Gap by gap, as documented."""
    targets: list[int] = []
    at, number = -1, 0
    while True:
        u = float(stream.uniform(row, number, 0, 0))
        at += 1 + math.floor(math.log(1 - u) / math.log1p(-probability))
        if at >= n:
            return targets
        targets.append(at)
        number += 1


@given(SEEDS, st.integers(0, 1000), st.integers(0, 300), st.floats(0.001, 0.999))
@settings(max_examples=60)
def test_targets_gap_by_gap(seed: int, row: int, n: int, probability: float) -> None:
    stream = Stream(seed, "edges", "A -> B")
    targets = stream.random_targets(row, n, probability)
    assert targets.dtype == np.int64
    assert targets.tolist() == plain_targets(stream, row, n, probability)


def test_targets_at_the_ends() -> None:
    stream = Stream(0, "edges", "A -> B")
    assert stream.random_targets(0, 5, 0.0).tolist() == []
    assert stream.random_targets(0, 5, 1.0).tolist() == [0, 1, 2, 3, 4]
    assert stream.random_targets(0, 0, 0.5).tolist() == []
    assert stream.random_targets(0, 0, 1.0).tolist() == []
    for tiny in (1e-300, 5e-324, 1e-17):
        assert stream.random_targets(0, 10**6, tiny).tolist() == []
    assert stream.random_targets(0, 100, 1 - 2.0**-53).tolist() == list(range(100))


def test_targets_of_fewer_are_a_prefix() -> None:
    stream = Stream(0, "edges", "A -> B")
    many = stream.random_targets(4, 1000, 0.1)
    assert stream.random_targets(4, 300, 0.1).tolist() == many[many < 300].tolist()


def test_every_target_is_equally_likely() -> None:
    stream, rows, n, probability = Stream(11, "edges", "A -> A"), 3000, 20, 0.3
    counts = np.zeros(n)
    for row in range(rows):
        counts[stream.random_targets(row, n, probability)] += 1
    error = math.sqrt(rows * probability * (1 - probability))
    assert np.abs(counts - rows * probability).max() < 5 * error


@given(SEEDS, st.integers(0, 30), st.integers(0, 60), st.sampled_from([0.0, 1e-9, 0.02, 0.5, 0.97, 1.0]))
def test_pairs_are_the_targets_row_by_row(seed: int, rows: int, n: int, probability: float) -> None:
    stream = Stream(seed, "edges", "A -> B")
    i, j = stream.random_pairs(rows, n, probability)
    expected = [(row, int(t)) for row in range(rows) for t in stream.random_targets(row, n, probability)]
    assert list(zip(i.tolist(), j.tolist(), strict=True)) == expected


def test_pairs_of_many_rows() -> None:
    stream = Stream(5, "edges", "A -> B")
    i, j = stream.random_pairs(20000, 300, 0.01)
    for row in (0, 1, 7777, 19999):
        assert j[i == row].tolist() == stream.random_targets(row, 300, 0.01).tolist()
