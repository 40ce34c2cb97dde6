"""Likeness: bounds change nothing in what is offered, and most names are never compared in full."""

from __future__ import annotations

import difflib
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


@pytest.mark.parametrize(("stem", "wrong"), [("gain", "gian"), ("activation", "atcivation"), ("K", "L")])
def test_of_many_names_few_are_compared_in_full(stem: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compared = Counter[str]()

    class Counting(SequenceMatcher[str]):
        def ratio(self) -> float:
            compared["times"] += 1
            return super().ratio()

    monkeypatch.setattr(difflib, "SequenceMatcher", Counting)
    known = [f"{stem}{number}_" for number in range(4000)]
    for number in range(0, 4000, 400):
        nearest(f"{wrong}{number}_", known)
    assert compared["times"] < 10 * 400


def test_of_2000_misspelt_references_to_2000_groups_few_are_compared_in_full(monkeypatch: pytest.MonkeyPatch) -> None:
    compared = Counter[str]()

    class Counting(SequenceMatcher[str]):
        def ratio(self) -> float:
            compared["times"] += 1
            return super().ratio()

    monkeypatch.setattr(difflib, "SequenceMatcher", Counting)
    groups = ", ".join(f"group_{number}_x: {{}}" for number in range(2000))
    wrong = ", ".join(f"gruop_{number}_x -> group_0_x: 1" for number in range(2000))
    with pytest.raises(nv.SpecError) as raised:
        nv.compile_text(f"neurovis: 1\nname: x\nneurons: {{{groups}}}\nconnections: {{{wrong}}}\n")
    assert len(raised.value.diagnostics) == 2000
    assert str(raised.value.diagnostics[MOST_HINTS - 1].hint).startswith(f"did you mean 'group_{MOST_HINTS - 1}_x'")
    assert compared["times"] < 3500


WORDS_500 = [f"group_{number}_x" for number in range(500)]
WRONG_500 = [f"gruop_{number}_x" for number in range(500)]
NEURONS = "neurons: {" + ", ".join(f"{name}: {{}}" for name in WORDS_500) + "}\n"
INPUTS = "inputs: {" + ", ".join(f"{name}: {{size: 1}}" for name in WORDS_500) + "}\n"
PARAMETERS = "parameters: {" + ", ".join(f"{name}: 1" for name in WORDS_500) + "}\n"
MODULE = "modules: {m: {inputs: {a: {size: 1}}, neurons: {B: {input: a}}}}\n"


def listed(entry: str) -> str:
    """A mapping with an entry for each misspelt name."""
    return "{" + ", ".join(entry.format(number, name) for number, name in enumerate(WRONG_500)) + "}\n"


@pytest.mark.parametrize(
    "spec",
    [
        NEURONS + "connections: " + listed("group_0_x -> {1}: 1"),
        NEURONS + "outputs: " + listed("o{0}: {1}"),
        NEURONS + "connections: " + listed("group_{0}_x -> group_0_x: {{plasticity: {{delta: {{target: {1}}}}}}}"),
        INPUTS + "neurons: " + listed("n{0}: {{input: {1}}}"),
        INPUTS + MODULE + "neurons: {A: {}}\ninstances: " + listed("m{0}: {{module: m, inputs: {{a: {1}}}}}"),
        INPUTS + "neurons: {A: {}}\nros: {subscribe: " + listed("{1}: {{topic: /t{0}}}") + "}",
        PARAMETERS + "neurons: " + listed("n{0}: {{bias: 2*{1}}}"),
        PARAMETERS + "neurons: {A: {}}\nevents: [{at: 3, set: " + listed("{1}: 1") + "}]",
        "neurons: " + listed("n{0}: {{activation: {1}}}"),
        MODULE + "neurons: {A: {}}\ninstances: " + listed("m{0}: {{module: {1}}}"),
    ],
    ids=["connections", "outputs", "target", "input", "binding", "ros", "parameter", "set", "activation", "module"],
)
def test_not_every_misspelt_name_is_compared_with_all_known_ones(spec: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody reads the help lines of 500 errors."""
    compared = Counter[str]()
    alike = likeness.alike

    def counted(name: str, known: tuple[str, ...]) -> tuple[str, ...]:
        compared["times"] += bool(known)
        return alike(name, known)

    monkeypatch.setattr(likeness, "alike", counted)
    with pytest.raises(nv.SpecError) as raised:
        nv.compile_text(f"neurovis: 1\nname: x\n{spec}")
    assert len(raised.value.diagnostics) == 500
    assert compared["times"] <= 2 * MOST_HINTS + 50
    assert raised.value.diagnostics[0].hint
