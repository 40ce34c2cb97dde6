"""Columns: the numbers of an array, whatever is kept once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from neurovis_spec import arrays
from neurovis_spec.arrays import Column, FloatArray, integers, reals, sorting, starts_of
from neurovis_spec.compiler.digest import digest

NUMBERS = st.sampled_from([0.0, -0.0, 1.5, np.nan, np.inf, 1e300])
PARTS = st.lists(
    st.one_of(
        st.lists(NUMBERS, max_size=12).map(lambda numbers: np.array(numbers, dtype=np.float64)),
        st.tuples(NUMBERS, st.integers(0, 30)).map(lambda one: np.full(one[1], one[0])),
        st.tuples(NUMBERS, st.integers(0, 30)).map(lambda one: np.broadcast_to(np.float64(one[0]), (one[1],))),
    ),
    max_size=6,
)


def bits(array: FloatArray) -> list[int]:
    return [*map(int, np.ascontiguousarray(array).view(np.int64))]


@given(PARTS, st.data())
def test_a_column_is_the_array_of_its_parts(parts: list[FloatArray], data: st.DataObject) -> None:
    whole, column = np.concatenate([*parts, np.zeros(0)]), reals(*parts)
    assert len(column) == len(whole)
    assert bits(column.whole()) == bits(np.array(column.tolist())) == bits(whole)
    assert bits(np.concatenate([*column.pieces(), np.zeros(0)])) == bits(whole)
    assert digest(column) == digest(whole)
    chosen = np.array(
        data.draw(st.lists(st.integers(-len(whole), len(whole) - 1))) if len(whole) else [], dtype=np.int64
    )
    assert bits(column[chosen]) == bits(whole[chosen])
    assert bits(column[whole > 0]) == bits(whole[whole > 0])
    assert bits(column[1:-2:3]) == bits(whole[1:-2:3])
    assert [bits(np.array([column[index]])) for index in chosen.tolist()] == [bits(whole[[i]]) for i in chosen.tolist()]
    assert not column.whole().flags.writeable


@given(st.lists(st.tuples(st.integers(-(1 << 40), 1 << 40) | st.integers(-2, 2), st.integers(0, 30)), max_size=8))
def test_a_column_of_each_number_so_many_times(given: list[tuple[int, int]]) -> None:
    numbers = np.array([number for number, _ in given], dtype=np.int64)
    sizes = np.array([size for _, size in given], dtype=np.int64)
    whole = np.repeat(numbers, sizes)
    for column in (Column.repeated(numbers, sizes, np.int64), integers(whole)):
        assert column.tolist() == whole.tolist()
        assert column[np.arange(len(whole))].dtype == column.whole().dtype == np.int64
        assert digest(column) == digest(whole)


@pytest.mark.parametrize(("most", "size"), [(127, 1), (128, 2), (32768, 4), (1 << 31, 8)])
def test_integers_are_kept_in_the_least_width(most: int, size: int) -> None:
    assert integers(np.array([-1, most])).kept.nbytes == 2 * size


def test_what_is_equal_over_a_stretch_is_kept_once() -> None:
    column = reals(np.full(1000, 0.5), np.broadcast_to(np.float64(0.5), (1 << 40,)), np.arange(5.0))
    assert (len(column), column.kept.tolist()) == (1000 + (1 << 40) + 5, [0.5, 0.0, 1.0, 2.0, 3.0, 4.0])


@given(st.lists(st.integers(0, 9), max_size=40), st.integers(10, 12), st.integers(1, 30))
def test_sorting_by_counting_is_stable(given: list[int], below: int, piece: int) -> None:
    numbers = np.array(given, dtype=np.int8)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arrays, "PIECE", piece)
        starts, order = starts_of(numbers, below), np.full(len(numbers), -1)
        for some, places in sorting(numbers, starts):
            order[places] = np.arange(some.start, some.stop)
    assert order.tolist() == np.argsort(numbers, kind="stable").tolist()
    assert starts.tolist() == [sum(one < number for one in given) for number in range(below + 1)]
