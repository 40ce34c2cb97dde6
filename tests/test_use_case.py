"""The paper's use cases, held to its figures."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.recording import Recording

SPECS = Path(__file__).parent.parent / "specs"
PERIOD = 128.67  # steps


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
    alpha, phi = 1.01, 0.049
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
    assert recording["T"][1_000 + 16] == pytest.approx(
        0.5 * math.sin(2 * math.pi * 1_016 / PERIOD) - 0.1 * math.sin(4 * math.pi * 1_016 / PERIOD), abs=1e-12
    )


def test_three_or_four_kernels_are_awake(learned: Recording) -> None:
    awake = (np.abs(learned["K"][1_000:]) > 0.05).sum(axis=1)
    assert set(awake.tolist()) == {3, 4}


@pytest.mark.parametrize(("pair", "seconds"), [(("K2", "K3"), 2.3), (("K2", "K4"), 1.5)])
def test_kernels_are_awake_together_as_in_figure_6(learned: Recording, pair: tuple[str, str], seconds: float) -> None:
    two_periods = slice(1_000, 1_000 + round(2 * PERIOD))
    together = np.logical_and(*(np.abs(learned[name][two_periods]) > 0.05 for name in pair))
    assert together.sum() / 40 == pytest.approx(seconds, abs=0.15)


def test_the_oscillator_has_the_stated_period_and_amplitude(learned: Recording) -> None:
    c1 = learned["C1"][2_000:]
    assert np.abs(c1).max() == pytest.approx(0.198, abs=5e-4)
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
