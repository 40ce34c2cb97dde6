"""The paper's use cases, held to its figures."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import neurovis_spec as nv
from neurovis_spec.analysis import awake_at_once, printed_correlation, weight_changes
from neurovis_spec.runtime.recording import Recording

SPECS = Path(__file__).parent.parent / "specs"
PERIOD = 128.62  # steps
#: the last twenty periods of a recording
FROM = 12_000 - round(20 * PERIOD)
SETTLED = slice(FROM, None)


@pytest.fixture(scope="module")
def learned() -> Recording:
    return nv.compile(SPECS / "cpg_rbf.yaml").run()


def last_error(recording: Recording) -> float:
    """Root mean square of the error over the last period."""
    last = round(PERIOD)
    return float(np.sqrt(np.mean((recording["T"] - recording["O"])[-last:] ** 2)))


def test_the_network_is_that_of_the_paper() -> None:
    network = nv.compile(SPECS / "cpg_rbf.yaml").network
    assert (len(network.neurons), len(network.connections)) == (12, 28)
    alpha, phi = 1.0094, 0.049
    expected = [alpha * math.cos(phi), -alpha * math.sin(phi), alpha * math.sin(phi), alpha * math.cos(phi)]
    names = [network.connection_names[index] for index in range(4)]
    assert names == ["C1 -> C1", "C1 -> C2", "C2 -> C1", "C2 -> C2"]
    assert network.connections.weights[:4].tolist() == pytest.approx(expected, rel=1e-15)


def test_the_target_is_learned(learned: Recording) -> None:
    assert len(learned) == 12_000
    assert last_error(learned) < 0.01


def test_before_learning_the_error_is_the_target(learned: Recording) -> None:
    assert learned["O"][0] == 0.0
    assert abs(learned["T"] - learned["O"])[:64].max() > 0.4


def test_a_second_target_is_learned_too() -> None:
    recording = nv.compile(SPECS / "cpg_rbf.yaml", second=-0.1).run()
    assert last_error(recording) < 0.01
    turn = 2 * math.pi * (1_016 + 24) / PERIOD
    assert recording["T"][1_016] == pytest.approx(0.5 * math.sin(turn) - 0.1 * math.sin(2 * turn), abs=1e-12)


def awake(recording: Recording, neuron: str) -> npt.NDArray[np.bool_]:
    """When a neuron is active, as Figure 6 has it: its absolute activity is above 0.05."""
    return np.asarray(np.abs(recording[neuron][SETTLED]) > 0.05, dtype=np.bool_)


def test_three_to_five_kernels_are_awake(learned: Recording) -> None:
    assert awake_at_once(learned, "K", start=FROM).rows.labels == ("3", "4", "5")


@pytest.mark.parametrize(("pair", "seconds"), [(("K2", "K3"), 2.3), (("K2", "K4"), 1.4)])
def test_kernels_are_awake_together_as_in_figure_6a(learned: Recording, pair: tuple[str, str], seconds: float) -> None:
    assert round(learned.coactivation("K", start=FROM)[pair], 1) == seconds
    assert learned.coactivation("K", start=FROM, per="total")[pair] == pytest.approx(20 * seconds, abs=1)


@pytest.mark.parametrize(("pair", "product"), [(("K2", "K3"), 0.10), (("K2", "K4"), 0.02)])
def test_kernels_correlate_as_in_figure_6b(learned: Recording, pair: tuple[str, str], product: float) -> None:
    """Eq. 12 with the joint distribution: the mean of the product."""
    assert round(learned.cross_correlation("K", start=FROM)[pair], 2) == product


def test_equation_12_as_printed_has_one_value_for_all_pairs(learned: Recording) -> None:
    """With p(x)·p(y) the two pairs that Figure 6B tells apart are alike."""
    printed = printed_correlation(learned, "K", start=FROM)
    assert [round(printed[pair], 2) for pair in (("K2", "K3"), ("K2", "K4"))] == [0.06, 0.06]


@pytest.mark.parametrize(("pair", "bits"), [(("K2", "K3"), 1.34), (("K2", "K4"), 0.76)])
def test_kernels_tell_of_each_other_as_in_figure_6c(learned: Recording, pair: tuple[str, str], bits: float) -> None:
    """The paper has 1.39 and 0.78."""
    assert round(learned.mutual_information("K", start=FROM)[pair], 2) == bits


def test_five_kernels_are_awake_while_c2_is_strong_and_c1_weakly_negative(learned: Recording) -> None:
    """Figures 5A and 5C: "whenever C1 is pale red, and C2 is bright green, K1-4 and K8 are active"."""
    five = np.flatnonzero((awake(learned, "K") == [True, True, True, True, False, False, False, True]).all(axis=1))
    assert len(five) >= 20 * 5
    c1, c2 = (learned[name][SETTLED] / np.abs(learned[name][SETTLED]).max() for name in ("C1", "C2"))
    assert c1[five].min() > -0.5
    assert c1[five].max() < 0
    assert c2[five].min() > 0.9


def test_k2_comes_to_hold_o_down_most_of_all(learned: Recording) -> None:
    """From "a thin red" to a "thick red connection", "the thickest" of them."""
    at_first, in_the_end = ([float(learned.weight(f"K{i} -> O")[step]) for i in range(1, 9)] for step in (100, -1))
    assert (round(at_first[1], 2), round(in_the_end[1], 2)) == (-0.11, -0.52)
    assert max(in_the_end, key=abs) == in_the_end[1]
    changes = weight_changes(learned)
    assert changes["K2 -> O", "last"] == in_the_end[1]
    assert changes.rows.labels[int(np.argmax(np.abs(changes.column("change"))))] == "K2 -> O"


def test_the_settings_are_those_of_the_paper() -> None:
    network = nv.compile(SPECS / "cpg_rbf.yaml")
    assert network.network.dt == 0.05
    assert [network.parameters[name] for name in ("alpha", "phi", "period")] == [1.0094, 0.049, 128.62]
    assert nv.compile(SPECS / "cpg_printed.yaml").network.dt == 0.05


def test_the_kernels_sit_on_a_period_of_the_settled_orbit_from_the_minimum_of_c1_on(learned: Recording) -> None:
    centres = np.array(nv.compile(SPECS / "cpg_rbf.yaml").network.connections.centres[4:20]).reshape(2, 8)
    orbit = np.array([learned["C1"][SETTLED], learned["C2"][SETTLED]])
    times = np.arange(orbit.shape[1])
    low = int(np.argmin(orbit[0, : round(PERIOD)]))
    for number in range(8):
        expected = [np.interp(low + number * PERIOD / 7, times, c) for c in orbit]
        assert centres[:, number].tolist() == pytest.approx(expected, abs=0.006)
    assert centres[:, 0].tolist() == centres[:, 7].tolist()


def test_the_oscillator_has_the_stated_period_and_amplitude(learned: Recording) -> None:
    c1 = learned["C1"][2_000:]
    assert np.abs(c1).max() == pytest.approx(0.192, abs=5e-4)
    rising = np.flatnonzero((c1[:-1] < 0) & (c1[1:] >= 0))
    assert (rising[-1] - rising[0]) / (len(rising) - 1) == pytest.approx(PERIOD, abs=0.03)


def test_it_learns_over_a_delay_of_twenty_steps() -> None:
    text = (SPECS / "cpg_rbf.yaml").read_text(encoding="utf-8")
    assert "K -> O: {weight: 0, delay: 0," in text
    delayed = nv.compile_text(
        text.replace("K -> O: {weight: 0, delay: 0,", "K -> O: {weight: 0, delay: 20,"), folder=SPECS
    )
    assert set(delayed.network.connections.delays[-8:].tolist()) == {20}
    assert last_error(delayed.run()) < 0.01


def test_with_the_wrong_pre_it_would_not() -> None:
    """The same delay with ``sent`` (what leaves now) in place of ``pre`` (what arrives now) does not learn."""
    text = (SPECS / "cpg_rbf.yaml").read_text(encoding="utf-8")
    rule = """
rules:
  wrong:
    parameters: {rate: 0.01}
    signals: [target]
    weight: {each_step: weight + rate * sent * (target - post)}
"""
    text = text.replace(
        "K -> O: {weight: 0, delay: 0, plasticity: {delta:", "K -> O: {weight: 0, delay: 20, plasticity: {wrong:"
    )
    assert "wrong:" in text
    assert not last_error(nv.compile_text(text + rule, folder=SPECS).run()) < 0.01


def test_the_weights_as_printed() -> None:
    recording = nv.compile(SPECS / "cpg_printed.yaml").run()
    assert recording.activity[0].tolist() == [0.1, 0.1]
    assert recording.activity[1_000].tolist() == pytest.approx([-0.036558981443553, 0.061863978098396], abs=1e-12)
    c1 = nv.compile(SPECS / "cpg_printed.yaml").run(12_000)["C1"][8_000:]
    assert np.abs(c1).max() == pytest.approx(0.0692, abs=5e-5)
    rising = np.flatnonzero((c1[:-1] < 0) & (c1[1:] >= 0))
    assert (rising[-1] - rising[0]) / (len(rising) - 1) == pytest.approx(128.34, abs=0.1)


def test_short_term_memory_stays_when_its_cause_has_gone() -> None:
    recording = nv.compile(SPECS / "short_term_memory.yaml").run()
    assert recording["I"][39] == 0
    assert recording["I"][45] == 1
    assert (recording["I"][50:200] == 0).all()
    assert np.abs(recording["O"][:41]).max() == 0
    kept = recording["O"][70:200]
    assert kept.min() > 0.7
    assert np.ptp(kept) < 0.01
    without = nv.compile(SPECS / "short_term_memory.yaml", loop=0).run()
    assert np.abs(without["O"][52:200]).max() == 0


def test_exclusive_or_answers_in_the_step_of_the_question() -> None:
    recording = nv.compile(SPECS / "mlp.yaml").run()
    question = recording["X"][:8]
    assert recording["O"][:8].tolist() == np.logical_xor(question[:, 0] > 0, question[:, 1] > 0).astype(float).tolist()


def test_the_ring_keeps_a_direction_and_moves_it() -> None:
    recording = nv.compile(SPECS / "ring.yaml").run()
    n = recording["R"].shape[1]

    def direction(step: int) -> float:
        """Where the hill is: the angle of the population vector, in neurons from R1."""
        vector = (recording["R"][step] * np.exp(2j * np.pi * np.arange(n) / n)).sum()
        return float(np.angle(vector) * n / (2 * np.pi) % n)

    cued, kept, moved = direction(39), direction(115), direction(len(recording) - 1)
    assert abs(cued - kept) < 0.1
    assert abs(moved - kept) > 1.5
    assert np.abs(recording["R"][115]).max() > 0.5


def test_the_bell_comes_to_mean_food() -> None:
    recording = nv.compile(SPECS / "hebbian.yaml").run()
    weight = recording.weight("B -> S")
    assert weight[0] == 0
    assert weight[600] > 0.9
    assert recording["S"][2:5].max() == 0  # the bell alone, before
    assert recording["S"][602:606].min() > 0.8  # the bell alone, after
    assert weight[899] < weight[620]
