"""The measures of a recording: each against its definition, and what they refuse."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np
import numpy.typing as npt
import pytest

import neurovis_spec as nv
from neurovis_spec import analysis
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.pairwise import period_of
from neurovis_spec.runtime.recording import Recording

Array = npt.NDArray[np.float64]
PER: tuple[Literal["period", "total"], ...] = ("period", "total")

NETWORK = """neurovis: 1
name: small
time: {steps: 400, dt: 0.5}
inputs: {wave: {expression: sin(2*pi*k/40)}, slow: {expression: cos(2*pi*k/80)}}
neurons: {A: {input: wave}, B: {input: slow}, K: {count: 3, activation: tanh}, O: {}}
connections:
  A -> K: {weight: i + 1}
  B -> O: 0.5
  K -> O: {weight: 0, plasticity: {delta: {rate: 0.02, target: A}}}
outputs: {signal: O}
"""


@pytest.fixture(scope="module")
def run() -> Recording:
    return nv.compile_text(NETWORK).run()


def made(activity: Array, dt: float = 1.0) -> Recording:
    """A recording of neurons N1, N2, … that were made up."""
    count = activity.shape[1]
    blank = nv.compile_text(f"neurovis: 1\nname: x\nneurons: {{N: {{count: {count}}}}}").run(len(activity))
    return replace(blank, activity=activity, dt=dt)


def test_the_connection_matrix_has_sources_as_rows(run: Recording) -> None:
    matrix = analysis.connection_matrix(run)
    assert (matrix.rows.name, matrix.columns.name) == ("from", "to")
    assert np.asarray(matrix).sum() == len(run.sources) == 7
    assert (matrix["A", "K1"], matrix["K1", "A"]) == (1, 0)
    assert matrix.row("B") == {"A": 0, "B": 0, "K1": 0, "K2": 0, "K3": 0, "O": 1}
    assert np.asarray(analysis.connection_matrix(run, ["K", "O"]))[:, 3].tolist() == [1, 1, 1, 0]


def test_pairs_are_what_their_equations_say(run: Recording) -> None:
    """Eqs. 12 to 14, term by term."""
    x, y = run["K1"][100:], run["O"][100:]
    joint = np.histogram2d(x, y, bins=12)[0] / len(x)
    bits = sum(
        joint[i, j] * math.log2(joint[i, j] / (joint[i].sum() * joint[:, j].sum()))
        for i, j in zip(*np.nonzero(joint), strict=True)
    )
    pair = ("K1", "O")
    assert run.mutual_information(start=100, bins=12)[pair] == pytest.approx(bits, abs=1e-12)
    assert run.cross_correlation(start=100)[pair] == pytest.approx(float(np.mean(x * y)), abs=1e-12)
    assert analysis.printed_correlation(run, start=100)[pair] == pytest.approx(float(x.mean() * y.mean()), abs=1e-12)
    both = np.sum((np.abs(x) > 0.1) & (np.abs(y) > 0.1)) * 0.5
    assert run.coactivation(start=100, threshold=0.1, per="total")[pair] == pytest.approx(float(both))
    assert run.coactivation(start=100, threshold=0.1, period=60)[pair] == pytest.approx(float(both) / 5)
    for table in (run.mutual_information(), run.cross_correlation(), run.coactivation()):
        np.testing.assert_array_equal(np.asarray(table), np.asarray(table).T)


def test_what_a_neuron_tells_of_itself_is_its_entropy_and_of_a_constant_nothing() -> None:
    four = np.repeat(np.arange(4.0), 25)
    recording = made(np.stack([four, np.full(100, 7.0), np.tile(np.arange(4.0), 25)], axis=1))
    information = recording.mutual_information(bins=4)
    assert information["N1", "N1"] == pytest.approx(2)
    assert (information["N1", "N2"], information["N2", "N2"]) == (0, 0)
    assert information["N1", "N3"] == pytest.approx(0.0117, abs=0.01)
    broken = made(np.stack([four, np.where(four == 2, np.nan, four)], axis=1))
    assert np.isnan(broken.mutual_information()["N1", "N2"])
    assert np.isnan(broken.cross_correlation()["N1", "N2"])


def test_the_period_is_that_of_all_neurons_together(run: Recording) -> None:
    """A wave of 40 steps and one of 80 repeat after 80."""
    assert period_of(run.activity[200:, :2]) == pytest.approx(80, abs=0.1)
    assert period_of(run.activity[200:, :1]) == pytest.approx(40, abs=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_noise_has_no_period(seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=(500, 4))
    assert period_of(values) is None
    with pytest.raises(RecordingError, match="no period"):
        made(values).coactivation()
    assert made(values).coactivation(per="total")["N1", "N1"] > 0


@pytest.mark.parametrize("activity", [np.zeros((50, 2)), np.full((50, 2), np.nan), np.zeros((3, 1)), np.ones((50, 1))])
def test_what_does_not_change_has_no_period(activity: Array) -> None:
    assert period_of(activity) is None


def test_every_second_step_gives_the_same_seconds_and_period(run: Recording) -> None:
    """But for the step at which a neuron becomes active, which need not be among those."""
    half = nv.compile_text(NETWORK).run(every=2)
    for per in PER:
        whole, seen = (r.coactivation(per=per, threshold=0.4).values for r in (run, half))
        np.testing.assert_allclose(seen, whole, rtol=0.1)


def test_what_a_recording_lacks_is_no_time_that_is_measured() -> None:
    """Such as steps that a controller passed over when it began anew with a higher number, or that were lost."""
    t = np.arange(400)
    legs = np.stack([(t % 20) < 6, ((t - 5) % 20) < 10], axis=1).astype(float)
    whole = made(legs, dt=0.1)
    gap = replace(whole, step=np.where(t < 210, t, t + 4807))
    for per in PER:
        np.testing.assert_allclose(gap.coactivation(per=per).values, whole.coactivation(per=per).values, rtol=1e-12)
    found, expected = (analysis.gait(one, "N") for one in (gap, whole))
    for quantity in ("onset", "duty", "phase", "period"):
        np.testing.assert_allclose(found.column(quantity), expected.column(quantity), rtol=1e-12)
    assert analysis.stretches(gap, "N2", 180, 5040)["N2"] == [(185, 195), (205, 210), (5017, 5022), (5032, 5040)]
    assert max(after - first for first, after in analysis.stretches(gap, "N2")["N2"]) == 10


def test_the_gait_of_made_up_legs() -> None:
    """A period of 20: the second leg a quarter behind the first, the third at its onsets; the fourth never."""
    t = np.arange(200)
    legs = [(t % 20) < 6, ((t - 5) % 20) < 10, (t % 20) < 2, t < 0]
    recording = made(np.stack(legs, axis=1).astype(float), dt=0.1)
    found = analysis.gait(recording, "N")
    assert found.column("phase")[:3].tolist() == pytest.approx([0, 0.25, 0])
    assert found.column("duty").tolist() == pytest.approx([0.3, 0.5, 0.1, 0])
    assert found.column("period")[:3].tolist() == [20, 20, 20]
    assert found.column("onset")[:3].tolist() == [20, 5, 20]
    assert np.isnan(found.row("N4")["onset"])
    assert analysis.stretches(recording, "N1", 0, 50)["N1"] == [(0, 6), (20, 26), (40, 46)]


def test_a_wave_around_zero_swings_once_a_period(run: Recording) -> None:
    found = analysis.gait(run, "A", 80)
    assert found["A", "period"] == 40
    assert found["A", "duty"] == pytest.approx(0.5, abs=0.03)


def test_a_phase_near_the_turn_is_not_averaged_to_the_opposite() -> None:
    t = np.arange(400)
    late = np.isin(t % 40, [39, 1]) & (t % 40 == np.where((t // 40) % 2, 39, 1))
    recording = made(np.stack([t % 40 < 1, late], axis=1).astype(float))
    phase = analysis.gait(recording)["N2", "phase"]
    assert min(phase, 1 - phase) < 0.03


def test_weights_and_what_became_of_them(run: Recording) -> None:
    own = run.weight("K2 -> O")
    assert analysis.weights(run).column("K2 -> O").tolist() == own.tolist()
    steps = np.diff(own)
    assert analysis.updates(run).column("K2 -> O").tolist() == steps.tolist()
    row = analysis.weight_changes(run).row("K2 -> O")
    assert (row["first"], row["last"], row["change"]) == (own[0], own[-1], own[-1] - own[0])
    assert row["travelled"] == pytest.approx(float(np.abs(steps).sum()))
    assert row["largest update"] == steps[int(np.abs(steps).argmax())]
    assert row["at step"] == int(np.abs(steps).argmax())
    still = analysis.weight_changes(nv.compile_text(NETWORK.replace("rate: 0.02", "rate: 0")).run()).row("K2 -> O")
    assert (still["largest update"], math.isnan(still["at step"])) == (0, True)
    one = analysis.weight_changes(run, start=10, stop=11).row("K2 -> O")
    assert (one["change"], math.isnan(one["at step"])) == (0, True)


def test_a_table_answers_by_names_and_offers_the_nearest(run: Recording) -> None:
    table = run.cross_correlation("K")
    assert repr(table) == "<cross-correlation: 3 neuron × 3 neuron>"
    assert table.values.flags.writeable is False
    with pytest.raises(KeyError, match="did you mean 'K1'"):
        table["K1", "K1x"]
    with pytest.raises(KeyError, match="'Kx'"):
        run.cross_correlation("Kx")


def test_what_cannot_be_measured_is_refused(run: Recording) -> None:
    network = nv.compile_text(NETWORK)
    with pytest.raises(RecordingError, match=r"from 400: the recording has steps 0 to 399"):
        run.coactivation(start=400)
    with pytest.raises(RecordingError, match="no weights"):
        analysis.weight_changes(network.run(weights="none"))
    with pytest.raises(KeyError, match="not recorded"):
        network.run(neurons="O").cross_correlation("K")
    with pytest.raises(ValueError, match="too many for a measure of pairs"):
        made(np.zeros((2, 401))).cross_correlation()
    with pytest.raises(ValueError, match="'per'"):
        run.coactivation(per="hour")  # type: ignore[arg-type]
    for bins in (-1, 1, 1001):
        with pytest.raises(ValueError, match="bins"):
            run.mutual_information(bins=bins)
    with pytest.raises(ValueError, match="threshold"):
        run.coactivation(threshold=-0.1)
    with pytest.raises(ValueError, match="period"):
        run.coactivation(period=0)


def test_part_of_a_recording_is_measured_by_what_it_holds() -> None:
    part = nv.compile_text(NETWORK).run(neurons="K + O", weights="none")
    assert part.cross_correlation().rows.labels == ("K1", "K2", "K3", "O")


def test_topography_has_positions_and_activities(run: Recording) -> None:
    network = nv.compile_text(NETWORK)
    positions = network.layout().positions
    found = analysis.topography(run, positions)
    assert (found["K2", "x"], found["K2", "y"]) == positions["K2"]
    assert found["O", "last"] == run["O"][-1]
    assert found["O", "rms"] == pytest.approx(float(np.sqrt(np.mean(run["O"] ** 2))))
