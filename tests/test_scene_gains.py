"""Gains: the author's win, the rest shows what each group and entry reaches, nothing is ever infinite."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hand_networks import C, G, network, numbered, use_case_1
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings, StatedGain
from neurovis_spec.scene.gains import choose_gains
from neurovis_spec.scene.probe import probe_steps
from neurovis_spec.scene.reached import Reached, nothing, reached_by

CASE = use_case_1(1300)


def reaches(
    activity: list[float], weights: list[float], signals: list[float] | None = None, changes: list[float] | None = None
) -> Reached:
    """What is reached, activities by steady ones of either sign."""
    peaks, heavy, none = np.array(activity), np.array(weights), np.zeros(len(weights))
    sent = heavy if signals is None else np.array(signals)
    known = none if changes is None else np.array(changes)
    return Reached(-peaks, peaks, peaks, heavy, sent, known, known[None, known > 0])


def test_all_four_ingredients_of_use_case_1_show() -> None:
    run = CASE.reached
    gains = choose_gains(CASE.network, RenderSettings(), run)
    assert ((gains.activity * run.activity >= 0.7) & (gains.activity * run.activity <= 5.2)).all()
    assert (gains.signal * run.signals >= 0.24).all()
    assert (gains.thickness * run.weights <= 6.5).all()
    assert (gains.thickness * run.weights)[20:].max() >= 4
    assert 0.5 <= np.median((gains.change * run.changes)[20:]) <= 2


def test_what_the_author_states_wins_one_by_one() -> None:
    stated = RenderSettings(activity=(StatedGain(3.25),), change=(StatedGain(0.0),))
    gains, free = (choose_gains(CASE.network, s, CASE.reached) for s in (stated, RenderSettings()))
    assert set(gains.activity) == {3.25}
    assert set(gains.change) == {0.0}
    assert (gains.signal == free.signal).all()
    assert (gains.thickness == free.thickness).all()
    assert [(scale.gain, scale.names) for scale in gains.activity_scales] == [(3.25, ())]


def test_a_later_gain_goes_before_an_earlier_one_and_what_is_left_has_its_own() -> None:
    some, one = (2, 3, 4, 5), (3,)
    stated = (StatedGain(2.0, some, "K1..K4"), StatedGain(7.0, one, "K2"))
    gains = choose_gains(CASE.network, RenderSettings(activity=stated), CASE.reached)
    assert gains.activity[2:6].tolist() == [2.0, 7.0, 2.0, 2.0]
    shown = {name: scale.gain for scale in gains.activity_scales for name in scale.names}
    assert shown["K1..K4"] == 2.0
    assert shown["K2"] == 7.0
    assert shown["K"] == gains.activity[7]
    every = (*stated, StatedGain(4.0, tuple(range(2, 10)), "K"))
    gains = choose_gains(CASE.network, RenderSettings(activity=every), CASE.reached)
    assert not {"K1..K4", "K2"} & {name for scale in gains.activity_scales for name in scale.names}


def test_a_range_is_drawn_around_its_middle() -> None:
    stated = RenderSettings(activity=(StatedGain(0.02, (10,), "O", -30.0),))
    gains = choose_gains(CASE.network, stated, CASE.reached)
    assert gains.centre[10] == -30.0
    assert not gains.centre[:10].any()


def test_a_silent_network_has_finite_gains() -> None:
    gains = choose_gains(CASE.network, RenderSettings(), nothing(CASE.network))
    for values in (gains.activity, gains.signal, gains.thickness, gains.change):
        assert (np.isfinite(values) & (values > 0)).all()


def test_a_network_without_connections() -> None:
    single = network([G("A", ("A",))], [])
    assert choose_gains(single, RenderSettings(), reaches([0.5], [])).activity.tolist() == [2.0]


def test_a_quiet_group_has_a_scale_of_its_own_and_like_groups_share_one() -> None:
    made = network([numbered("A", 30), numbered("B", 2), numbered("D", 2)], [C("A1", "B1")])
    gains = choose_gains(made, RenderSettings(), reaches([1.0] * 30 + [0.01] * 2 + [0.8] * 2, [1.0]))
    assert [scale.names for scale in gains.activity_scales] == [("A", "D"), ("B",)]
    assert gains.activity[30] * 0.01 == 1.0
    assert gains.activity[0] == gains.activity[33]


def test_a_few_strong_neurons_do_not_take_the_colour_of_a_big_group() -> None:
    made = network([numbered("A", 100)], [C("A1", "A2")])
    gains = choose_gains(made, RenderSettings(), reaches([0.1] * 95 + [1.0] * 5, [1.0]))
    assert gains.activity[0] * 0.1 >= 0.6


def test_the_weakest_of_an_entry_can_be_told_from_grey_and_the_scale_says_how_far_it_goes() -> None:
    made = network([numbered("A", 2)], [C(f"A{i}", f"A{j}", 1.0) for i in (1, 2) for j in (1, 2)])
    gains = choose_gains(made, RenderSettings(), reaches([1.0, 1.0], [1.0, 0.05, 0.05, 1.0]))
    assert gains.signal[1] * 0.05 >= 0.6
    (scale,) = gains.signal_scales
    assert scale.reaches == 1.0


def test_where_the_spread_is_too_wide_the_many_count() -> None:
    made = network([numbered("A", 50)], [C("A1", f"A{i}") for i in range(1, 51)])
    weights = [1.0] * 49 + [1e-4]
    gains = choose_gains(made, RenderSettings(), reaches([1.0] * 50, weights))
    assert gains.signal[0] <= 1 / 0.6 + 0.1


def thick(weights: list[list[float]], learning: set[int]) -> list[float]:
    """The widths that the strongest of some entries reach."""
    lines = [C("A1", "A2", w, entry=e, rule=0 if e in learning else -1) for e, some in enumerate(weights) for w in some]
    rules = [("hebbian", dict[str, str]())]
    made = network([numbered("A", 2)], lines, entries=[f"E{e}" for e in range(len(weights))], rules=rules)
    reached = np.array([w for some in weights for w in some])
    gains = choose_gains(made, RenderSettings(), reaches([1.0, 1.0], reached.tolist()))
    return [float((gains.thickness * reached)[made.connections.entry.whole() == e].max()) for e in range(len(weights))]


def test_weights_that_are_alike_can_be_compared_learned_or_not() -> None:
    one, other, learned = thick([[1.0], [2.0], [1.5]], {2})
    assert other == 2 * one
    assert learned == 1.5 * one
    assert one >= 1


def test_what_learns_is_seen_to_grow_beside_heavier_weights_that_stay() -> None:
    fixed, learned = thick([[1.0] * 16, [0.5, 0.1]], {1})
    assert learned >= 4
    assert 1 <= fixed <= 2.2


def test_there_are_few_scales_however_many_entries() -> None:
    lines = [C(f"A{i}", f"A{i + 1}", 1.0, entry=i - 1) for i in range(1, 21)]
    made = network([numbered("A", 21)], lines, entries=[f"A{i} -> A{i + 1}" for i in range(1, 21)])
    gains = choose_gains(made, RenderSettings(), reaches([1.0] * 21, [3.0**i for i in range(20)]))
    assert len(gains.signal_scales) == 4
    assert sum(len(scale.names) for scale in gains.signal_scales) == 20


def test_what_a_kernel_does_while_it_sleeps_does_not_count() -> None:
    """Typical is what a neuron does while it is awake; one that is at rest for long has the same scale."""
    t = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    short, long = np.sin(t), np.concatenate([np.sin(t), np.zeros(4000)])
    none = np.zeros(0)
    one, other = (
        reached_by(none.astype(np.int64), none, a[:, None], np.zeros((len(a), 0)), none.astype(np.int64))
        for a in (short, long)
    )
    assert one.typical == other.typical
    assert 2 * one.typical[0] >= 0.98


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(-3, 3), st.lists(st.floats(-1.4, 1.4), min_size=1, max_size=12), st.booleans()),
        min_size=1,
        max_size=9,
    )
)
def test_whatever_entries_there_are_the_weak_are_told_and_none_is_too_wide(
    made: list[tuple[float, list[float], bool]],
) -> None:
    """Of entries of any magnitude, with weights that are a few hundred apart at most."""
    weights = [[10 ** (base + offset / 2) for offset in some] for base, some, _ in made]
    rules = [("hebbian", dict[str, str]())]
    lines = [C("A1", "A2", w, entry=e, rule=-1 + made[e][2]) for e, some in enumerate(weights) for w in some]
    net = network([numbered("A", 2)], lines, entries=[f"E{e}" for e in range(len(weights))], rules=rules)
    peaks = np.array([w for some in weights for w in some])
    gains = choose_gains(net, RenderSettings(), reaches([1.0, 1.0], peaks.tolist()))
    assert len(gains.signal_scales) <= 4
    assert len(gains.thickness_scales) <= 6
    for entry in range(len(weights)):
        mine = net.connections.entry.whole() == entry
        assert len(set(gains.signal[mine])) == 1
        assert (gains.signal[mine] * peaks[mine]).min() >= 0.23
        assert (gains.thickness[mine] * peaks[mine]).max() <= 5.3


peak = st.one_of(st.floats(0, 1e300), st.sampled_from([float("nan"), float("inf"), 0.0, 5e-324]))


@settings(max_examples=60, deadline=None)
@given(st.lists(peak, min_size=12, max_size=12), st.lists(peak, min_size=28, max_size=28))
def test_any_run_gives_finite_gains(activity: list[float], other: list[float]) -> None:
    rows: FloatArray = np.array([activity, activity[::-1]])
    weights = np.array([other, other[::-1]])
    fixed = np.where(np.arange(28) < 20, weights[0], 0.0)
    changing = CASE.network.changing
    run = reached_by(CASE.network.connections.sources.whole(), fixed, rows, weights[:, changing], changing)
    gains = choose_gains(CASE.network, RenderSettings(), run)
    for values in (gains.activity, gains.signal, gains.thickness, gains.change):
        assert all(math.isfinite(gain) and gain > 0 for gain in values.tolist())


def test_scales_are_named_as_the_picture_shows_neurons() -> None:
    groups = [
        replace(numbered("DL", 3), labels=("d0", "d1", "d2")),
        G("B", ("B",), labels=("bell",)),
        G("S", ("S",), labels=("x1",)),
        G("R", ("R",), labels=("x1",)),
    ]
    lines = [C("DL1", "B", 1.0, entry=0), C("B", "S", 0.01, entry=1)]
    made = network(groups, lines, entries=["DL -> B", "B -> S"])
    stated = RenderSettings(activity=(StatedGain(2.0, (0,), "DL1 + S"),))
    gains = choose_gains(made, stated, reaches([1.0] * 6, [1.0, 0.01]))
    assert [scale.names for scale in gains.signal_scales] == [("d -> bell",), ("bell -> S",)]
    assert [scale.names for scale in gains.activity_scales] == [("d", "bell", "S", "R"), ("d0 + S",)]


@pytest.mark.parametrize(
    ("gain", "runs"),
    [
        ("activity: 1, signal: 1, thickness: 1, change: 1", False),
        ("activity: {A: 1, B: 2}, signal: {A -> B: 1, B -> A: 1}, thickness: 1, change: 1", False),
        ("activity: {A: 1}, signal: 1, thickness: 1, change: 1", True),
        ("activity: 1, signal: {A -> B: 1}, thickness: 1, change: 1", True),
        ("activity: 1, signal: 1, thickness: 1", True),
    ],
)
def test_nothing_is_run_for_gains_that_are_stated_for_all(gain: str, runs: bool) -> None:
    text = "neurovis: 1\nname: x\nneurons: {A: {count: 2}, B: {}}\nconnections: {A -> B: 1, B -> A: 1}\n"
    network = nv.compile_text(f"{text}render: {{gain: {{{gain}}}}}\n").network
    assert (probe_steps(network) > 0) == runs
