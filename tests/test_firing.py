"""What spikes tell: rates, intervals, counts, correlograms and episodes, by trains that are known and by hand."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec import analysis
from neurovis_spec.analysis import report
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.recording import Recording

SPEC = """\
neurovis: 1
name: few
time: {dt: 1 ms, steps: 200, episode: 50}
models: {cell: {time: ms, state: {v: {derivative: (drive - v)/20}}, spike: {when: v >= 1, set: {v: 0}}}}
neurons: {K: {count: 2, model: cell, bias: [1.3, 1.6]}, H: {model: cell, bias: 2}, O: {}}
connections: {K -> O: {weight: 1}}
"""
NETWORK = nv.compile_text(SPEC)
RUN = NETWORK.run(backend="reference")


def with_trains(trains: list[list[int]], stop: int) -> Recording:
    """The recording with these spikes of K1, K2 and H, of steps 0 to before ``stop``."""
    spikes = sorted((step, neuron) for neuron, train in enumerate(trains) for step in train)
    steps, neurons = (np.array(column, np.int64) for column in (zip(*spikes, strict=True) if spikes else ((), ())))
    return replace(RUN, spike_steps=steps, spike_neurons=neurons, spike_range=(0, stop))


def test_a_clock_and_chance() -> None:
    """Of a clock CV and Fano factor are 0; of a Poisson process both are 1."""
    random = np.random.default_rng(1)
    chance = np.flatnonzero(random.uniform(size=400_000) < 0.01).tolist()
    made = analysis.firing(with_trains([list(range(5, 400_000, 100)), chance, []], 400_000), windows=400)
    assert made["K1", "spikes"] == 4000
    assert made["K1", "rate"] == pytest.approx(10)
    assert made["K1", "interval"] == pytest.approx(0.1)
    assert made["K1", "CV"] == made["K1", "Fano factor"] == 0
    assert made["K2", "CV"] == pytest.approx(1, abs=0.05)
    assert made["K2", "Fano factor"] == pytest.approx(1, abs=0.15)
    assert made["H", "rate"] == 0
    assert np.isnan([made["H", name] for name in ("interval", "CV", "Fano factor")]).all()


def test_groups_are_means_of_their_neurons() -> None:
    made, groups = analysis.firing(RUN), analysis.group_firing(RUN)
    assert groups.rows.labels == ("K", "H")
    assert groups["K", "neurons"] == 2
    assert groups["K", "spikes"] == made["K1", "spikes"] + made["K2", "spikes"] == len(RUN.spikes("K").times)
    for name in ("rate", "interval", "CV"):
        assert groups["K", name] == pytest.approx((made["K1", name] + made["K2", name]) / 2)
    over = analysis.rates(RUN, bins=20)
    assert over.values.sum(axis=0) * 0.01 == pytest.approx([groups["K", "spikes"] / 2, groups["H", "spikes"]])
    assert over.rows.labels[:2] == ("0", "10")
    assert analysis.group_firing(RUN, "K1 + H").rows.labels == ("K1", "H")  # not all of K


def test_groups_whose_neurons_have_names_are_groups(tmp_path: Path) -> None:
    text = "neurovis: 1\nname: x\ntime: {dt: 0.01, steps: 60}\n"
    text += "neurons: {C: {names: [A, B, D], model: integrate_and_fire, bias: [2, 3, 0]}, K: {count: 2}}\n"
    text += "outputs: {both: A + B}\n"
    network = nv.compile_text(text)
    run = network.run(backend="numpy")
    run.save(tmp_path / "x.npz")
    for one in (run, nv.load(tmp_path / "x.npz")):
        made = analysis.group_firing(one)
        assert made.rows.labels == ("C",)
        assert made["C", "neurons"] == 3
        assert made["C", "spikes"] == len(one.spikes("C").times) > 0
        assert analysis.group_firing(one, "both").rows.labels == ("A", "B")


def test_steps_and_neurons_are_chosen() -> None:
    late = analysis.firing(RUN, "K2 + O", 100, 200)
    assert late.rows.labels == ("K2",)
    assert late["K2", "spikes"] == (RUN.spikes("K2").times >= 0.1 - 1e-9).sum()
    assert late["K2", "rate"] == pytest.approx(late["K2", "spikes"] / 0.1)
    with pytest.raises(RecordingError, match="none of these neurons spikes"):
        analysis.firing(RUN, "O")
    with pytest.raises(RecordingError, match="nothing to measure from 500 to before 200"):
        analysis.firing(RUN, start=500)
    with pytest.raises(RecordingError, match="holds no spikes"):
        analysis.firing(replace(RUN, spiking=None))


def test_rows_that_are_not_kept_change_nothing() -> None:
    few = NETWORK.run(backend="reference", every=40)
    np.testing.assert_array_equal(analysis.firing(few), analysis.firing(RUN))
    np.testing.assert_array_equal(analysis.correlogram(few), analysis.correlogram(RUN))


def test_intervals_are_shares() -> None:
    run = with_trains([[0, 10, 20, 30], [0, 20, 40], [7]], 100)
    made = analysis.intervals(run, bins=100)
    assert made["10", "K"] == pytest.approx(3 / 5)
    assert made["20", "K"] == pytest.approx(2 / 5)
    assert made.column("H").sum() == 0
    with pytest.raises(RecordingError, match="no neuron fires twice"):
        analysis.intervals(with_trains([[3], [5], []], 100))


TRAIN = st.lists(st.integers(0, 99), max_size=12, unique=True)


@settings(max_examples=30, deadline=None)
@given(st.tuples(TRAIN, TRAIN, TRAIN), st.integers(1, 60), st.integers(1, 30))
def test_a_correlogram_counts_pairs(trains: tuple[list[int], ...], reach: int, bins: int) -> None:
    made = analysis.correlogram(with_trains([*trains], 100), reach=reach / 1000, bins=bins)
    assert made.columns.labels == ("K, K", "K, H", "H, H")
    middles = [int(label) for label in made.rows.labels]
    width = middles[1] - middles[0]
    assert middles[len(middles) // 2] == 0
    assert width % 2 == 1
    groups = {"K": (0, 1), "H": (2,)}
    for column in made.columns.labels:
        one, other = (groups[name] for name in column.split(", "))
        sent = sum(len(trains[a]) for a in one)
        for middle in middles:
            pairs = sum(
                abs(t - s - middle) <= width // 2
                for a in one for b in other if (a != b) or len(one) == 1
                for s in trains[a] for t in trains[b] if not (a == b and s == t)
            )  # fmt: skip
            size = max(sent, 1) * max(len(other) - (one == other), 1) * width * 0.001 * (1 - abs(middle) / 100)
            assert made[str(middle), column] == pytest.approx(pairs / size, abs=1e-6)


def test_of_independent_trains_it_is_the_rate_everywhere() -> None:
    random = np.random.default_rng(2)
    trains = [np.flatnonzero(random.uniform(size=50_000) < 0.02).tolist() for _ in range(3)]
    made = analysis.correlogram(with_trains(trains, 50_000), reach=10.0, bins=20)
    assert made.values == pytest.approx(20, rel=0.1)


def test_lags_end_where_the_recording_does() -> None:
    """Nothing is below 0, and no lag is divided by a time that there is not."""
    run = with_trains([list(range(0, 100, 7)), list(range(3, 100, 10)), []], 100)
    for reach in (0.2, 1e6, float("inf")):
        made = analysis.correlogram(run, reach=reach, bins=40)
        assert max(int(label) for label in made.rows.labels) == 95
        assert (made.values >= 0).all()
    for stop in (1, 2, 3):
        values = analysis.correlogram(run, reach=1, stop=stop).values
        assert np.isfinite(values[len(values) // 2]).all()
    for reach in (0, -1, float("nan")):
        with pytest.raises(ValueError, match="'reach' is above 0"):
            analysis.correlogram(run, reach=reach)
    for measure in (analysis.correlogram, analysis.intervals, analysis.rates):
        with pytest.raises(ValueError, match="'bins' is at least 1, not 0"):
            measure(run, bins=0)
    with pytest.raises(ValueError, match="'windows' is at least 1, not 0"):
        analysis.firing(run, windows=0)


def test_a_group_may_begin_at_any_number() -> None:
    text = SPEC.replace("K: {count: 2,", "K: {count: 2, first: 4,")
    groups = analysis.group_firing(nv.compile_text(text).run(backend="reference"))
    assert groups.rows.labels == ("K", "H")


def test_what_follows_in_each_episode() -> None:
    run = with_trains([[10, 60, 110], [10, 60, 149], [30, 199]], 199)  # the last episode is not whole
    made = analysis.around(run, 50, bins=50)
    assert made.column("K")[10] == pytest.approx(1000 * 5 / 6)
    assert made.column("K")[49] == pytest.approx(1000 / 6)
    assert made.column("H")[30] == pytest.approx(1000 / 3)
    assert made.values.sum() == pytest.approx(1000 * (1 + 1 / 3))
    with pytest.raises(RecordingError, match="no episode of 500 steps is whole"):
        analysis.around(RUN, 500)


def test_the_report_has_them_where_neurons_spike(tmp_path: Path) -> None:
    report.analyze(NETWORK, tmp_path / "spiking", RUN, report.ReportOptions(trials=False))
    files = {path.name for path in (tmp_path / "spiking").iterdir()}
    for stem in ("rates", "intervals", "correlogram", "episodes"):
        assert {f"{stem}.svg", f"{stem}.csv", f"{stem}.json"} <= files
    assert files <= set(report.file_names())
    page = (tmp_path / "spiking" / "index.html").read_text(encoding="utf-8")
    assert "Softky and Koch" in page
    assert "σ(Δt_i)" in page
    found = json.loads((tmp_path / "spiking" / "group_firing.json").read_text(encoding="utf-8"))
    assert "K" in json.dumps(found)
    quiet = nv.compile_text("neurovis: 1\nname: quiet\ntime: {steps: 20}\nneurons: {O: {count: 2}}\n")
    report.analyze(quiet, tmp_path / "quiet", None, report.ReportOptions(trials=False))
    assert "firing.csv" not in {path.name for path in (tmp_path / "quiet").iterdir()}


def test_the_command_prints_how_groups_fire(tmp_path: Path) -> None:
    (tmp_path / "few.yaml").write_text(SPEC, encoding="utf-8")
    arguments = ["analyze", str(tmp_path / "few.yaml"), "--no-trials", "-o", str(tmp_path / "found"), "--of", "K + H"]
    said = CliRunner().invoke(neurovis, arguments).output
    assert re.search(r"^ +neurons +spikes +rate \(1/s\) +interval \(s\) +CV +Fano factor$", said, re.MULTILINE)
    groups = analysis.group_firing(RUN)
    assert re.search(rf"^  K +2 +{groups['K', 'spikes']:g} +{groups['K', 'rate']:.4g} ", said, re.MULTILINE)


RATED = """\
neurovis: 1
name: rated
time: {dt: 1 ms, steps: 200}
models:
  cell: {time: ms, state: {v: {derivative: (drive - v)/20}}, spike: {when: v >= 1, set: {v: 0}}}
  shown: {time: ms, state: {v: {derivative: (drive - v)/10}}, spike: {when: v >= 1, set: {v: 0}}, activity: v}
neurons: {K: {count: 2, model: cell, bias: [1.3, 1.6]}, P: {count: 2, model: shown, bias: [1.4, 0]}}
"""


@pytest.mark.parametrize("states", ["", "all"])
def test_a_lesioned_neuron_has_no_rate(states: str) -> None:
    """Its states go on, the one that is its spike among them, and it fires for nobody."""
    network = nv.compile_text(f"{RATED}events: [{{at: 100, lesion: P1}}]\n")
    run = network.run(backend="reference", states=[states] if states else ())
    rate = network.measure("rate(P, last=90)", run)
    assert rate[99] > 0
    assert rate[199] == 0
    assert network.run(backend="reference", until="k > 120 and rate(P, last=20) > 0").step[-1] == 199


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_a_measure_of_the_rate(backend: str) -> None:
    """Of groups, of neurons whose activity is something else, step by step, in blocks, and of a recording."""
    network = nv.compile_text(RATED)
    run = network.run(backend=backend, states=["P.spike"])
    for name, fired in (("K", run["K"]), ("K2", run["K2"][:, None]), ("P", run["P.spike"])):
        wanted = [fired[max(step - 49, 0) : step + 1].sum() / (50 * fired.shape[1] * 0.001) for step in range(200)]
        np.testing.assert_allclose(network.measure(f"rate({name}, last=50)", run)[49:], wanted[49:])
        reached = int(np.flatnonzero(np.array(wanted[49:]) > 0.9 * max(wanted))[0]) + 49
        ended = network.run(backend=backend, until=f"rate({name}, last=50) > {0.9 * max(wanted)}")
        assert ended.step[-1] == reached
    plain = network.run(backend=backend)
    np.testing.assert_array_equal(network.measure("rate(P)", plain), network.measure("rate(P)", run))


@pytest.mark.parametrize(
    ("measure", "message"),
    [
        ("rate(O, last=5) > 1", "'O' does not spike"),
        ("rate(2*K1, last=5) > 1", "'rate' is of neurons that spike"),
        ("rate(J, last=5) > 1", "no neuron, group or output 'J'"),
        ("rate(K) > 1", "'rate' here needs the number of steps"),
        ("rate(K, last=900) > 1", "the last 900 steps of a run of 200"),
    ],
)
def test_a_rate_that_cannot_be(measure: str, message: str) -> None:
    with pytest.raises(nv.SpecError, match=message):
        NETWORK.run(until=measure)


def test_a_run_that_is_not_recorded_prints_rates(tmp_path: Path) -> None:
    (tmp_path / "few.yaml").write_text(SPEC, encoding="utf-8")
    said = CliRunner().invoke(neurovis, ["run", str(tmp_path / "few.yaml"), "--backend", "numpy"]).output
    rates = analysis.group_firing(RUN).column("rate")
    assert (
        f"{len(RUN.spike_steps)} spikes; rates a neuron and a second:\n  K  {rates[0]:.6g}\n  H  {rates[1]:.6g}\n"
        in said
    )
