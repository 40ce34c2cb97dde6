"""Use case 3 of the paper, held to what it says: ripples and gaits, learning at an obstacle, memory of the floor."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from beams_across import Arrangement, obstacles
from beams_across import walk as beams_walk

import neurovis_spec as nv
from neurovis_spec.analysis import gait
from neurovis_spec.runtime.recording import Recording

FOLDER = Path(__file__).parent.parent / "specs" / "hexapod"
SPEC = FOLDER / "hexapod.yaml"
#: in the order in which the ripple of the delay line passes them
LEGS = ("right3", "right2", "right1", "left3", "left2", "left1")
#: radians a step, by the number of ripples
PHI = {1: 0.1048, 2: 0.2095, 3: 0.3142}
#: where each of them is settled in the run of the spec
SETTLED = {1: slice(120, 360), 2: slice(420, 540), 3: slice(600, 2900)}
SWING, LIFT = 10, 5  # steps from tap to tap, and that a leg is lifted
#: feet that have to be down, by the number of ripples
DOWN = {1: 5, 2: 4, 3: 3}
FIRST, EVERY, BEAMS = 603, 180, 8  # steps at which the front legs come to a beam
#: steps later than the front leg that a beam comes to a leg, and that a leg is held high
LATER, CLEARING = {"1": 0, "2": 65, "3": 100}, 40
NEWS = ("left1.dp -> left2.dp", "left2.dp -> left3.dp", "right1.dp -> right2.dp", "right2.dp -> right3.dp")

Flags = npt.NDArray[np.bool_]


@pytest.fixture(scope="module")
def walk() -> Recording:
    return nv.compile(SPEC).run()


def line(recording: Recording) -> Flags:
    """Which neurons of the second delay line are active: steps × 6."""
    return np.stack([recording[f"DL{number}"] for number in range(6, 12)], axis=1) > 0.5


def ripples(active: Flags) -> npt.NDArray[np.int_]:
    """Runs of active neurons along the line, at each step."""
    before = np.pad(active, ((0, 0), (1, 0)))[:, :-1]
    return np.asarray((active & ~before).sum(axis=1))


def lifted(recording: Recording) -> Flags:
    """Which legs the rhythm lifts, as far as the motor neurons say: steps × 6 (LEGS)."""
    return np.stack([recording[f"{leg}.CF"] for leg in LEGS], axis=1) > 0.5


def onsets(signal: npt.NDArray[np.float64], level: float = 0.5) -> list[int]:
    """Steps at which a signal rises above a level."""
    return [int(step) + 1 for step in np.flatnonzero((signal[:-1] <= level) & (signal[1:] > level))]


def swings(recording: Recording, leg: str, window: slice) -> list[tuple[int, int]]:
    """First step and length of every swing that begins and ends in a window."""
    up = (recording[f"{leg}.CF"][window] > 0.5).astype(int)
    begins, ends = np.flatnonzero(np.diff(up) == 1) + 1, np.flatnonzero(np.diff(up) == -1) + 1
    ends = ends[ends > begins[0]]
    return [(window.start + int(b), int(e - b)) for b, e in zip(begins, ends, strict=False)]


def steps_to_act(recording: Recording, leg: str) -> list[int]:
    """For each beam, how long after the front leg's hit a leg steps high for the last time."""
    high = onsets(recording[f"{leg}.over"])
    times = [[step - start for step in high if start <= step < start + EVERY] for start in beams()]
    return [max(of_beam) for of_beam in times]


def hits(recording: Recording, leg: str) -> list[int]:
    """For each beam, whether the leg hits it."""
    late = LATER[leg[-1]]
    return [int(recording[f"{leg}.T"][start + late : start + late + 25].max() > 0.1) for start in beams()]


def down(recording: Recording) -> Flags:
    """Which feet feel the ground: steps × 6 (LEGS)."""
    return np.stack([recording[f"{leg}.F"] for leg in LEGS], axis=1) > 0.5


def beams() -> list[int]:
    return [FIRST + EVERY * number for number in range(BEAMS)]


# The network


def test_it_is_as_large_as_the_paper_says() -> None:
    network = nv.compile(SPEC).network
    assert (len(network.neurons), len(network.connections)) == (148, 204)
    names = network.neurons.names
    assert {"C0", "C1", *(f"DL{number}" for number in range(12))} <= set(names)
    for part in ("BC", "CF", "FT", "dr", "dp", "S", "K"):
        assert sum(name.endswith(f".{part}") for name in names) == 6


def test_six_legs_are_one_module_and_mirrored() -> None:
    network = nv.compile(SPEC).network
    of_leg = {leg: [n[len(leg) :] for n in network.neurons.names if n.startswith(f"{leg}.")] for leg in LEGS}
    assert len(of_leg["left1"]) == 22
    assert all(names == of_leg["left1"] for names in of_leg.values())
    assert [len(mirror.pairs) for mirror in network.layout.mirrors] == [3 * 22, 3, 3]


def test_the_data_are_what_their_program_makes(tmp_path: Path) -> None:
    program = tmp_path / "make_data.py"
    program.write_bytes((FOLDER / "data" / "make_data.py").read_bytes())
    subprocess.run([sys.executable, program], check=True, timeout=60)
    made = {path.name: path.read_bytes() for path in tmp_path.glob("*.csv")}
    assert made == {path.name: path.read_bytes() for path in (FOLDER / "data").glob("*.csv")}
    assert sum(len(content) for content in made.values()) < 64 * 1024


# Dynamics: ripples and gaits


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_frequency_says_how_many_ripples_are_on_the_line(walk: Recording, count: int) -> None:
    assert set(ripples(line(walk))[SETTLED[count]].tolist()) == {count}


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_frequency_may_be_set_while_it_runs(count: int) -> None:
    simulation = nv.compile(SPEC, phi=PHI[count % 3 + 1]).simulator()
    active = []
    for step in range(355):
        if step == 100:
            simulation.set(phi=PHI[count])
        simulation.step()
        active.append(simulation.activity > 0.5)
    names = nv.compile(SPEC).network.neurons.names
    columns = [names.index(f"DL{number}") for number in range(6, 12)]
    assert set(ripples(np.stack(active)[200:, columns]).tolist()) == {count}


@pytest.mark.parametrize(("count", "phases"), [(1, [0, 1, 2, 3, 4, 5]), (2, [0, 2, 4, 0, 2, 4])])
def test_the_phases_of_the_gaits(walk: Recording, count: int, phases: list[int]) -> None:
    """Wave and caterpillar, of six; a leg is lifted equally long in each."""
    window = SETTLED[count]
    found = gait(walk, [f"{leg}.CF" for leg in LEGS], window.start, window.stop, threshold=0.5)
    assert (6 * found.column("phase")).tolist() == pytest.approx(phases, abs=1e-9)
    assert found.column("period").tolist() == [6 * SWING / count] * 6
    assert found.column("duty").tolist() == pytest.approx([LIFT / (6 * SWING / count)] * 6)


def test_the_phases_of_the_tripod(walk: Recording) -> None:
    """Three legs and three legs, half a period apart; at the beams single steps differ."""
    window = SETTLED[3]
    phase = gait(walk, [f"{leg}.CF" for leg in LEGS], window.start, window.stop, threshold=0.5).column("phase")
    away = np.angle(np.exp(2j * np.pi * (phase - [0, 0.5, 0, 0.5, 0, 0.5]))) / (2 * np.pi)
    assert np.abs(away).max() < 0.03


def test_in_the_wave_gait_one_leg_lifts_after_the_other(walk: Recording) -> None:
    window = SETTLED[1]
    assert set(lifted(walk)[window].sum(axis=1).tolist()) == {0, 1}
    first = [swings(walk, leg, window)[0][0] for leg in LEGS]
    period = 6 * SWING
    assert [(step - first[0]) % period for step in first] == [0, 10, 20, 30, 40, 50]


def test_in_the_caterpillar_gait_pairs_lift_from_hind_to_front(walk: Recording) -> None:
    window = SETTLED[2]
    first = {leg: [step for step, _ in swings(walk, leg, window)] for leg in LEGS}
    for place in "123":
        assert first[f"left{place}"] == first[f"right{place}"]
    assert [(first[f"left{place}"][0] - first["left3"][0]) % (3 * SWING) for place in "321"] == [0, 10, 20]
    assert set(lifted(walk)[window].sum(axis=1).tolist()) == {0, 2}


def test_in_the_tripod_gait_three_legs_lift_in_turn_with_the_others(walk: Recording) -> None:
    window = slice(2100, 2900)  # no obstacles any more
    up = dict(zip(LEGS, lifted(walk)[window].T, strict=True))
    assert up["left1"].tolist() == up["right2"].tolist() == up["left3"].tolist()
    assert up["right1"].tolist() == up["left2"].tolist() == up["right3"].tolist()
    assert not (up["left1"] & up["right1"]).any()


@pytest.mark.parametrize(("count", "window"), [(1, SETTLED[1]), (2, SETTLED[2]), (3, slice(2100, 2900))])
def test_a_swing_takes_as_long_at_every_speed_and_goes_forward(walk: Recording, count: int, window: slice) -> None:
    for leg in LEGS:
        begins, lengths = zip(*swings(walk, leg, window), strict=True)
        assert set(lengths) == {LIFT}
        strides = set(np.diff(begins).tolist())
        assert strides == {6 // count * SWING}
        angle = walk[f"{leg}.qBC"]
        assert all(angle[begin + LIFT + 3] - angle[begin + 2] > 1.4 for begin in begins[:-1])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_enough_feet_are_down_to_stand_on(walk: Recording, count: int) -> None:
    """In 95 % of the steps of a settled gait, beams and the soft floor among them."""
    feet = down(walk)[SETTLED[count]].sum(axis=1)
    assert (feet >= DOWN[count]).mean() >= 0.95


@pytest.mark.parametrize(("count", "window"), [(1, SETTLED[1]), (2, SETTLED[2]), (3, slice(640, 2900))])
def test_legs_that_stand_go_back_all_at_one_speed(walk: Recording, count: int, window: slice) -> None:
    """No jump, no stop: from the first to the last step of a stance BC goes back by the same."""
    speed = 2 / (2 * np.pi / PHI[count] - LIFT)
    for leg in LEGS:
        stands = walk[f"{leg}.F"][window] > 0.5
        change = np.diff(walk[f"{leg}.BC"][window])[stands[1:] & stands[:-1]]
        assert change.tolist() == pytest.approx([-speed] * len(change), rel=0.06)
        joint = np.diff(walk[f"{leg}.qBC"][window])[stands[1:] & stands[:-1]]
        assert np.median(joint) == pytest.approx(-speed, rel=0.05)
        assert joint.min() > -1.05 * speed


def test_a_change_of_gait_lifts_no_leg_twice(walk: Recording) -> None:
    for leg in LEGS:
        begins, lengths = zip(*swings(walk, leg, slice(60, 600)), strict=True)
        assert np.diff(begins).min() >= 2 * SWING - 1
        assert set(lengths) <= {LIFT - 1, LIFT}


# Plasticity: the obstacle


def test_before_the_first_beam_nothing_is_learned(walk: Recording) -> None:
    for name in NEWS:
        assert set(walk.weight(name)[: FIRST + 1].tolist()) == {1.0}


def test_while_the_news_comes_too_early_the_weights_grow(walk: Recording) -> None:
    for name in NEWS:
        leg = name.split(" -> ")[1].split(".")[0]
        weights = walk.weight(name)[[start - 1 for start in (*beams(), FIRST + EVERY * BEAMS)]]
        missed = hits(walk, leg)
        assert missed == sorted(missed, reverse=True)  # once it is learned it stays so
        assert 2 <= sum(missed) <= 6
        grown = np.diff(weights)
        assert (grown[: sum(missed)] > 0.02).all()
        assert set(grown[sum(missed) :].tolist()) == {0.0}
        assert weights[-1] > 1.15


def test_the_news_passes_more_slowly_until_it_comes_with_the_beam(walk: Recording) -> None:
    for leg in ("left2", "left3", "right2", "right3"):
        times = steps_to_act(walk, leg)
        assert times == sorted(times)
        arrival = LATER[leg[-1]]
        assert times[0] + CLEARING < arrival + SWING  # too early: the leg steps high no more
        assert times[0] + SWING < times[-1] <= arrival
        assert times[-1] + CLEARING > arrival
        assert len(set(times[-3:])) == 1


def test_the_reflex_is_one_of_legs_that_swing(walk: Recording) -> None:
    """A beam beside a leg that stands hits nothing, and neither the reflex nor its memory lifts the leg."""
    for number, leg in enumerate(LEGS):
        stands = walk[f"{leg}.F"] > 0.5
        assert (stands & (walk[f"{leg}.beam"] > 0)).sum() > BEAMS
        assert walk[f"{leg}.T"][stands].max() == 0
        told = walk[f"DL{6 + number}"] > 0
        assert walk[f"{leg}.CF"].max() == 2
        assert walk[f"{leg}.CF"][1:][~told[:-1]].max() == 0


@pytest.mark.parametrize(
    "arrangement", [Arrangement(180, (60, 100), 0), Arrangement(110, (45, 80), 4), Arrangement(150, (40, 70), 8)]
)
def test_beams_elsewhere_are_learned_as_well(arrangement: Arrangement) -> None:
    """Other distances, other positions, unevenly: hits go down, and stay down."""
    hits, weights = beams_walk(arrangement)
    first, *_, third, last = (int(part.sum()) for part in np.array_split(hits, 4))
    assert first >= 4
    assert max(third, last) <= first / 4
    assert 0.95 <= min(weights) <= max(weights) < 2


def test_news_that_comes_too_late_comes_earlier_next_time() -> None:
    """The beams come later at first, then earlier: what was learned too much is taken back."""
    late, early = Arrangement(180, (70, 105), 0), Arrangement(180, (40, 60), 0)
    arrivals = np.concatenate([late.arrivals(1), early.arrivals(1) + 180 * late.beams])
    signal = obstacles(arrivals)
    recording = nv.compile(SPEC).run(steps=len(signal), inputs={"obstacle_left": signal, "obstacle_right": signal})
    weights = recording.weight("left2.dp -> left3.dp")
    assert weights[arrivals[15, 0]] > weights[-1] + 0.2
    assert all(recording["left3.T"][step : step + 25].max() == 0 for step in arrivals[-4:, 2])


def test_after_the_last_beam_the_weights_stay(walk: Recording) -> None:
    for name in NEWS:
        after = walk.weight(name)[FIRST + EVERY * (BEAMS - 3) + EVERY - 1 :]
        assert set(after.tolist()) == {float(after[0])}
        assert walk.weight(name).max() < 2  # nowhere near its bound of 4


def test_the_front_legs_cannot_be_warned(walk: Recording) -> None:
    for leg in ("left1", "right1"):
        assert hits(walk, leg) == [1] * BEAMS
        assert walk[f"{leg}.over"].max() == 0


def test_without_learning_every_beam_is_hit() -> None:
    recording = nv.compile(SPEC, eta=0, eta_hind=0).run(steps=FIRST + EVERY * BEAMS)
    for leg in ("left2", "left3", "right2", "right3"):
        assert hits(recording, leg) == [1] * BEAMS


def test_a_leg_that_is_warned_lifts_higher_than_in_a_step(walk: Recording) -> None:
    last = beams()[-1] + LATER["2"]
    assert walk["left2.qCF"][last : last + 2 * SWING].max() > 1.9
    assert walk["left2.qCF"][SETTLED[1]].max() < 1


# Memory: the floor


def test_on_the_rigid_floor_k_has_a_level(walk: Recording) -> None:
    level = walk["right1.K"][2100:2310]
    assert level.mean() == pytest.approx(0.071, abs=0.005)
    assert np.ptp(level) < 0.06 * level.mean()


def test_k_hardly_changes_while_s_vanishes(walk: Recording) -> None:
    gap = slice(2310, 2370)
    before = walk["right1.K"][2250:2310].mean()
    assert walk["right1.S"][gap].max() == 0
    assert walk["right1.S"][2250:2310].sum() >= 9  # three strides
    assert np.abs(walk["right1.K"][gap] / before - 1).max() < 0.03
    assert np.abs(walk["right1.K"][2370:2500] / before - 1).max() < 0.08


def test_k_goes_to_a_new_level_when_s_changes(walk: Recording) -> None:
    assert walk["right1.S"][2440:2500].sum() < 11
    assert walk["right1.S"][2800:2860].sum() >= 12
    old, new = walk["right1.K"][2440:2500].mean(), walk["right1.K"][2840:2900].mean()
    assert new > 1.6 * old
    half = np.flatnonzero(walk["right1.K"][2500:] > (old + new) / 2)[0]
    assert 30 < half < 150  # neither at once nor never
    # within a stride it hardly moves: the hormone does not follow single contacts
    assert np.ptp(walk["right1.K"][2840:2900]) < 0.1 * new


def test_k_closes_the_loop(walk: Recording, tmp_path: Path) -> None:
    """A leg that stretches finds the soft ground earlier; where K stretches nothing it goes on missing it."""
    spec = shutil.copytree(FOLDER, tmp_path / "hexapod") / SPEC.name
    text = spec.read_text()
    assert text.count("events:\n") == 1
    spec.write_text(text.replace("events:\n", "events:\n  - {at: 0, lesion: [right1.K -> right1.FT]}\n"))
    numb = nv.compile(spec).run()
    end = slice(2840, 2900)
    assert walk["right1.S"][end].sum() < numb["right1.S"][end].sum()
    assert walk["right1.F"][end].sum() > numb["right1.F"][end].sum()
    assert walk["right1.K"][end].mean() < numb["right1.K"][end].mean()


def test_five_legs_are_on_the_soft_floor_before_the_sixth(walk: Recording) -> None:
    levels = {leg: walk[f"{leg}.K"][2440:2500].mean() for leg in LEGS}
    assert levels.pop("right1") < 0.08
    assert all(level > 0.105 for level in levels.values())


def test_k_stretches_the_leg(walk: Recording) -> None:
    stands = walk["right1.M"] < 0.01
    rigid, soft = (
        walk["right1.qFT"][window][stands[window]].max() for window in (slice(2240, 2300), slice(2840, 2900))
    )
    assert soft - rigid == pytest.approx(0.07, abs=0.02)


def test_the_picture_shows_the_names_of_the_paper() -> None:
    neurons = nv.compile(SPEC).network.neurons
    assert {f"{kind}{leg}" for kind in ("S", "K", "CF", "FT", "BC", "d") for leg in range(6)} | {
        f"d{number}" for number in range(6, 12)
    } | {"C0", "C1"} | {f"DL{number}" for number in range(12)} <= set(neurons.labels)
    labels = dict(zip(neurons.names, neurons.labels, strict=True))
    # the paper's leg 1 is the right front one; d6 to d11 carry the news from front to hind
    assert [labels[f"right1.{name}"] for name in ("CF", "S", "K", "dr", "dp")] == ["CF1", "S1", "K1", "d1", "d7"]
    assert [labels[f"{side}{row}.dp"] for row in (1, 2, 3) for side in ("left", "right")] == [
        f"d{number}" for number in range(6, 12)
    ]
