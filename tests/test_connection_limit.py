"""Entries that connect far too many neurons are refused before any connection is made, and no other is."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_specs import HEAD, codes, compiled

import neurovis_spec as nv
from neurovis_spec.compiler.connections.pattern_settings import Values
from neurovis_spec.compiler.connections.patterns import RECIPES

GROUPS = "parameters: {size: 10000}\nneurons: {A: {count: size, bias: 1}, B: {count: size, bias: 1}}\n"


@pytest.mark.parametrize(
    "pattern",
    [
        "all_to_all",
        "{random: {probability: 1}}",
        "{random: {probability: size/5e4}}",
        "{fixed_indegree: {count: 1001}}",
        "{fixed_outdegree: {count: 1001}}",
        "{nearest: {count: 1001}}",
        "{small_world: {degree: 1002, rewire: 0.1}}",
        "{band: {width: 520}}",
    ],
)
def test_no_connection_is_made_where_there_are_far_too_many(pattern: str) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(nv.SpecError) as caught:
            nv.compile_text(HEAD + GROUPS + f"connections: {{A -> B: {{pattern: {pattern}}}}}\n")
        assert tracemalloc.get_traced_memory()[1] < 20_000_000  # ten million connections take 400 MB
    finally:
        tracemalloc.stop()
    (found,) = caught.value.diagnostics
    assert (found.code, found.span.line, found.span.column) == ("too-many", 5, 15)
    assert found.hint == "raise it with --limit"


@pytest.mark.parametrize(
    ("pattern", "code"),
    [
        ("{fixed_indegree: {count: 1e17}}", "out-of-range"),
        ("{random: {probability: 2}}", "out-of-range"),
        ("{random: {probabilty: 1}}", "unknown-parameter"),
        ("all_to_al", "unknown-pattern"),
        ("{small_world: {degree: 1e9, rewire: 0}}", "out-of-range"),
    ],
)
def test_what_is_wrong_with_a_pattern_is_said(pattern: str, code: str) -> None:
    assert code in codes(GROUPS + f"connections: {{A -> B: {{pattern: {pattern}}}}}\n")


def test_a_small_network_is_told_all_at_once() -> None:
    text = "neurons: {A: {count: 4000, activation: tahn}}\nconnections: {A -> A: {pattern: all_to_all}, B -> A: 1}\n"
    assert codes(text) == ["unknown-activation", "too-many", "unknown-neuron"]


def test_many_neurons_may_be_connected_sparsely() -> None:
    text = GROUPS + "connections: {A -> B: {pattern: {fixed_indegree: {count: 2}}}}\n"
    assert len(compiled(text).network.connections) == 20_000


@given(
    st.integers(1, 12),
    st.integers(1, 12),
    st.sampled_from(["all_to_all", "one_to_one", "chain", "ring", "count", "band", "degree"]),
    st.integers(0, 4),
)
def test_no_pattern_makes_fewer_than_are_counted(n: int, m: int, what: str, size: int) -> None:
    """Between two groups; within one a neuron's connection to itself may be left out."""
    forms = {
        "count": [
            ("fixed_indegree", {"count": size}),
            ("fixed_outdegree", {"count": size}),
            ("nearest", {"count": size}),
        ],
        "band": [("band", {"width": size})],
        "degree": [("small_world", {"degree": 2 * size, "rewire": 0})],
    }
    for name, settings in forms.get(what, [(what, dict[str, int]())]):
        written = name if not settings else f"{{{name}: {settings}}}".replace("'", "")
        text = f"neurons: {{A: {{count: {n}, bias: 1}}, B: {{count: {m}, bias: 1}}}}\n"
        try:
            network = compiled(f"{text}connections: {{A -> B: {{pattern: {written}}}}}\n").network
        except nv.SpecError:
            continue
        values = Values({one: float(value) for one, value in settings.items()})
        assert RECIPES[name].least(n, m, values) <= len(network.connections) + (name == "chain")
        assert np.all(network.connections.sources.whole() < n)
