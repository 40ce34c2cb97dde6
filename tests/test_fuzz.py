"""Some of what ``benchmarks/fuzzing.py`` tries by the ten thousand: broken specs and expressions, held to the laws."""

from __future__ import annotations

from collections import Counter

import fuzz_expressions
import fuzz_texts
import pytest
from fuzz_laws import check_expression, check_input
from laws import one_in

TEXTS = 1500 // one_in(2)
PARTS = range(TEXTS // 250)


@pytest.mark.parametrize("part", PARTS)
def test_specs(part: int) -> None:
    codes: Counter[str] = Counter()
    compiled = 0
    for number in range(part, TEXTS, len(PARTS)):
        made = fuzz_texts.make(0, number)
        outcome = check_input(made.data, made.folder)
        compiled += outcome.compiled
        codes.update(outcome.codes)
    assert compiled >= 8, "the texts are too broken to say much"
    assert len(codes) >= 50, "the texts are broken in too few ways"


@pytest.mark.parametrize("part", PARTS)
def test_expressions(part: int) -> None:
    outcomes = [check_expression(fuzz_expressions.make(0, number)) for number in range(part, 1000, len(PARTS))]
    assert sum(outcome.compiled for outcome in outcomes) >= 50
    assert len({code for outcome in outcomes for code in outcome.codes}) >= 8


def test_the_same_seed_gives_the_same_texts() -> None:
    assert [fuzz_texts.make(3, number) for number in range(3000, 3020)] == [
        fuzz_texts.make(3, number) for number in range(3000, 3020)
    ]
    assert fuzz_texts.make(3, 3000) != fuzz_texts.make(4, 3000)
    assert fuzz_expressions.make(3, 1) == fuzz_expressions.make(3, 1)
