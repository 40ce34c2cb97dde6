"""Entries that make no connection, with this seed or these numbers: a warning, and so is an event that names one."""

from __future__ import annotations

import numpy as np
import pytest

import neurovis_spec as nv

HEAD = "neurovis: 1\nname: x\n"
PAIR = "neurons: {A: {bias: 1}, B: {bias: 1}}\n"
DRAWN = "connections: {A -> B: {weight: 2, pattern: {random: {probability: 0.5}}, plasticity: hebbian}}\n"


@pytest.mark.parametrize(
    "event", ["{at: 2, lesion: A -> B}", "{at: 2, mend: A -> B}", "{at: 2, learning: {A -> B: false}}"]
)
def test_an_event_that_names_an_entry_that_drew_nothing_is_a_warning(event: str) -> None:
    """So a sweep over seeds goes on where there is nothing to lesion."""
    seen = set()
    for seed in range(8):
        plain = nv.compile_text(HEAD + PAIR + DRAWN, seed=seed)
        network = nv.compile_text(f"{HEAD}{PAIR}{DRAWN}events: [{event}]\n", seed=seed)
        count = len(network.network.connections)
        seen.add(count)
        told = [item for item in network.warnings if item.code == "nothing-drawn"]
        assert [item.span.line for item in told] == ([] if count else [4, 5])
        if not count:
            assert "no effect: the entry of 'A -> B' makes no connection" in told[1].message
            np.testing.assert_array_equal(network.run(steps=4).activity, plain.run(steps=4).activity)
    assert seen == {0, 1}


def test_what_no_entry_makes_is_an_error() -> None:
    with pytest.raises(nv.SpecError, match="there is no connection 'B -> A'"):
        nv.compile_text(f"{HEAD}{PAIR}{DRAWN}events: [{{at: 2, lesion: B -> A}}]\n")


@pytest.mark.parametrize(
    "pattern",
    [
        "random: {probability: none}",
        "fixed_indegree: {count: none}",
        "fixed_outdegree: {count: none}",
        "nearest: {count: none}",
    ],
)
@pytest.mark.parametrize("ends", ["A -> B", "A -> A"])
def test_a_probability_and_a_count_of_0_are_warnings(pattern: str, ends: str) -> None:
    entry = f"{ends}: {{weight: i + 1, delay: 2, pattern: {{{pattern}}}, plasticity: hebbian}}"
    text = f"{HEAD}parameters: {{none: 0}}\nneurons: {{A: {{count: 3, bias: 1}}, B: {{count: 4, bias: 1}}}}\n"
    network = nv.compile_text(f"{text}connections:\n  {entry}\n")
    (told,) = network.warnings
    assert (told.code, told.span.line) == ("nothing-drawn", 6)
    assert "of 0 this entry makes no connection at all" in told.message
    assert len(network.network.connections) == 0
    assert network.run(steps=3).activity.tolist() == [[1.0] * 7] * 3
    network = nv.compile_text(f"{text}connections:\n  {entry}\n", none=1)
    assert not network.warnings


def test_less_than_0_is_an_error() -> None:
    for pattern in ("random: {probability: -0.1}", "nearest: {count: -1}"):
        with pytest.raises(nv.SpecError, match="out-of-range"):
            nv.compile_text(f"{HEAD}{PAIR}connections: {{A -> B: {{pattern: {{{pattern}}}}}}}\n")


def test_what_is_drawn_of_nothing_is_drawn() -> None:
    """A gain, a curve of weights and a picture of an entry that makes nothing."""
    entry = "connections: {A -> B: {pattern: {random: {probability: 0}}}}\n"
    render = "render: {gain: {signal: {A -> B: 2}}}\n"
    network = nv.compile_text(HEAD + PAIR + entry + render)
    assert [item.code for item in network.warnings] == ["nothing-drawn", "nothing-drawn"]
    assert network.gains.signal.shape == (0,)
