"""Likeness: bounds change nothing in what is offered; benchmarks/work.py counts the names that are compared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from difflib import SequenceMatcher

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec import likeness
from neurovis_spec.diagnostics import MOST_HINTS
from neurovis_spec.likeness import nearest


def one_by_one(name: str, known: Iterable[str]) -> list[str]:
    """The same by its definition, every known name compared in full."""
    folded = name.casefold()
    scored: list[tuple[float, str]] = []
    for candidate in known:
        other = candidate.casefold()
        score = SequenceMatcher(None, folded, other, autojunk=False).ratio() + 0.05 * (folded[:1] == other[:1])
        if Counter(folded) == Counter(other):
            score = max(score, 0.97)
        if folded and other and (other.startswith(folded) or (len(other) > 1 and folded.startswith(other))):
            score = max(score, 0.75)
        stems = {text.rstrip("0123456789") for text in (folded, other)}
        if len(stems) == 1 and stems != {""}:
            score = max(score, 0.7)
        if score >= 0.6:
            scored.append((-score, candidate))
    best = min(scored, default=(0.0, ""))[0]
    return [candidate for score, candidate in sorted(scored) if score <= best + 0.12][: likeness.MOST]


WORDS = st.one_of(
    st.text("abK1", max_size=7),
    st.builds("gain{}_".format, st.integers(0, 99)),
    st.builds("Neuron{}".format, st.integers(0, 99)),
    st.text("aß\u00c4_.2", max_size=70),
)


@settings(max_examples=60, deadline=None)
@given(
    st.one_of(WORDS, st.sampled_from(["gian5_", "gain", "nueron12", "k", ""])),
    st.one_of(st.lists(WORDS, max_size=8), st.lists(WORDS, min_size=70, max_size=90)),
)
def test_the_names_offered_are_those_that_comparing_all_would_offer(name: str, known: list[str]) -> None:
    assert list(nearest(name, known, likeness.MOST)) == one_by_one(name, dict.fromkeys(known))


def test_the_first_of_many_misspelt_names_get_hints() -> None:
    groups = ", ".join(f"group_{number}_x: {{}}" for number in range(200))
    wrong = ", ".join(f"gruop_{number}_x -> group_0_x: 1" for number in range(200))
    with pytest.raises(nv.SpecError) as raised:
        nv.compile_text(f"neurovis: 1\nname: x\nneurons: {{{groups}}}\nconnections: {{{wrong}}}\n")
    assert len(raised.value.diagnostics) == 200
    assert str(raised.value.diagnostics[MOST_HINTS - 1].hint).startswith(f"did you mean 'group_{MOST_HINTS - 1}_x'")
