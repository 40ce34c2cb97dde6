"""Gains: the author's win, the rest shows the network's range, nothing is ever infinite."""

from __future__ import annotations

import math
from dataclasses import astuple

import numpy as np
from hand_networks import C, G, network, numbered, use_case_1
from hypothesis import given, settings
from hypothesis import strategies as st

from neurovis_spec.compiler.wishes import RenderSettings
from neurovis_spec.scene.gains import choose_gains

CASE = use_case_1(1300)


def test_all_four_ingredients_of_use_case_1_show() -> None:
    gains = choose_gains(CASE.network, RenderSettings(), *CASE.peaks)
    activity, weights, signals, changes = CASE.peaks
    groups = [activity[g.start : g.start + g.count].max() for g in CASE.network.neurons.groups]
    assert all(0.6 <= gains.activity * peak <= 3.5 for peak in groups)
    assert gains.signal * signals[4:20].max() >= 0.75
    assert gains.signal * signals[20:].max() <= 3
    assert weights.max() * gains.thickness <= 9
    assert weights[20:].max() * gains.thickness >= 1.2
    assert 0.5 <= np.median(changes[20:]) * gains.change <= 2


def test_what_the_author_states_wins_one_by_one() -> None:
    stated = RenderSettings(activity=3.25, change=0.0)
    gains, free = (choose_gains(CASE.network, s, *CASE.peaks) for s in (stated, RenderSettings()))
    assert (gains.activity, gains.change) == (3.25, 0.0)
    assert (gains.signal, gains.thickness) == (free.signal, free.thickness)


def test_a_silent_network_has_finite_gains() -> None:
    none = np.zeros(28)
    gains = choose_gains(CASE.network, RenderSettings(), np.zeros(12), none, none, none)
    assert all(math.isfinite(g) and g > 0 for g in astuple(gains))


def test_a_network_without_connections() -> None:
    single = network([G("A", ("A",))], [])
    none = np.zeros(0)
    gains = choose_gains(single, RenderSettings(), np.array([0.5]), none, none, none)
    assert gains.activity == 2.0


def test_a_small_group_is_not_drowned_by_a_big_one() -> None:
    made = network([numbered("A", 30), numbered("B", 2)], [C("A1", "B1")])
    peaks = np.array([1.0] * 30 + [0.1] * 2)
    one = np.ones(1)
    gains = choose_gains(made, RenderSettings(), peaks, one, one, one)
    assert gains.activity * 0.1 > 0.25


def test_a_few_strong_neurons_do_not_take_the_colour_of_a_big_group() -> None:
    made = network([numbered("A", 100)], [C("A1", "A2")])
    peaks = np.array([0.1] * 95 + [1.0] * 5)
    one = np.ones(1)
    assert choose_gains(made, RenderSettings(), peaks, one, one, one).activity == 10.0
    few = network([numbered("A", 8)], [C("A1", "A2")])
    assert choose_gains(few, RenderSettings(), np.array([0.1] * 7 + [1.0]), one, one, one).activity == 1.0


peak = st.one_of(st.floats(0, 1e300), st.sampled_from([float("nan"), float("inf"), 0.0, 5e-324]))


@settings(max_examples=60, deadline=None)
@given(st.lists(peak, min_size=12, max_size=12), st.lists(peak, min_size=28, max_size=28))
def test_any_peaks_give_finite_gains(activity: list[float], other: list[float]) -> None:
    w = np.array(other)
    gains = choose_gains(CASE.network, RenderSettings(), np.array(activity), w, w, w)
    assert all(math.isfinite(g) and g > 0 for g in astuple(gains))
