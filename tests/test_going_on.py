"""Going on from a recording: what was learned and what was changed is kept, unless it is given anew."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.recording import Recording

HEAD = "neurovis: 1\nname: x\nseed: 5\nparameters: {g: 1, h: 2*g}\n"
PLAIN = (
    HEAD + "neurons: {A: {bias: g}, B: {bias: h}, C: {}}\n"
    "connections: {A -> C: g, B -> C: {weight: 0, plasticity: hebbian}}\n"
)


def saved(recording: Recording, folder: Path) -> Recording:
    """The recording, written and read."""
    recording.save(folder / "x.npz")
    return nv.load(folder / "x.npz")


def test_what_the_last_step_learned_is_kept(tmp_path: Path) -> None:
    """An episode's end is the last step of each run: its update is all that is learned there."""
    network = nv.compile("specs/reward.yaml")
    episode = network.network.episode
    assert episode is not None
    recording = network.run(episode - 1)
    for _ in range(4):
        recording = saved(network.run(episode, start=recording), tmp_path)
    assert np.abs(recording.weights_after).max() > 0


def test_every_kth_row_loses_no_weight(tmp_path: Path) -> None:
    network = nv.compile("specs/hebbian.yaml")
    whole, some = (saved(network.run(101, every=every), tmp_path) for every in (1, 50))
    np.testing.assert_array_equal(some.weights_after, whole.weights_after)
    np.testing.assert_array_equal(network.simulator(start=some).weights, whole.weights_after)


def test_the_number_of_a_parallel_connection_does_not_follow_what_is_set() -> None:
    text = HEAD + (
        "neurons: {A: {bias: 1}, O: {bias: 1}}\nconnections:\n"
        "  - {A -> O: {weight: 3*g, plasticity: {hebbian: {rate: 0.1}}}}\n"
        "  - {A -> O: {weight: 5, plasticity: {hebbian: {rate: 0.2}}}}\n"
    )
    first, other = nv.compile_text(text), nv.compile_text(text, g=4)
    assert first.network.connection_names == other.network.connection_names == ("A -> O", "A -> O (2)")
    learned = first.run(5)
    resumed = other.simulator(start=learned)
    for name in ("A -> O", "A -> O (2)"):
        assert resumed.weight(name) == learned.weights_after[first.network.connection_index[name]]


def test_what_was_set_is_kept_with_all_that_follows_it(tmp_path: Path) -> None:
    network = nv.compile_text(PLAIN + "events: [{at: 2, set: {g: 5}}]")
    recording = saved(network.run(4), tmp_path)
    again = network.simulator(start=recording)
    assert again.parameters == {"g": 5, "h": 10}
    assert again.weight("A -> C") == 5
    again.step()
    assert again.activity[:2].tolist() == [5.0, 10.0]
    assert saved(network.run(1, start=recording), tmp_path).set_parameters == {"g": 5.0}


def test_what_is_set_anew_goes_before_it() -> None:
    recording = nv.compile_text(PLAIN + "events: [{at: 2, set: {g: 5}}]").run(4)
    simulation = nv.compile_text(PLAIN, g=3).simulator(start=recording)
    assert simulation.parameters == {"g": 3, "h": 6}
    assert simulation.weight("A -> C") == 3
    simulation.step()
    assert simulation.activity[:2].tolist() == [3.0, 6.0]


def test_what_was_given_is_kept_too() -> None:
    recording = nv.compile_text(PLAIN, g=4).run(3)
    assert nv.compile_text(PLAIN).simulator(start=recording).parameters == {"g": 4, "h": 8}
    assert nv.compile_text(PLAIN, h=1).simulator(start=recording).parameters == {"g": 4, "h": 1}


def test_a_parameter_of_the_structure_has_to_be_the_same() -> None:
    text = HEAD.replace("{g: 1", "{d: 2, g: 1") + "neurons: {A: {bias: g}, B: {}}\nconnections: {A -> B: {delay: d}}\n"
    recording = nv.compile_text(text, d=3).run(3)
    with pytest.raises(RecordingError, match="made with d = 3, on which the structure of the network depends"):
        nv.compile_text(text).simulator(start=recording)
    assert nv.compile_text(text, d=3).simulator(start=recording).k == 0


def test_what_was_lesioned_stays_so(tmp_path: Path) -> None:
    network = nv.compile_text(PLAIN + "events: [{at: 1, lesion: [B, A -> C]}]")
    recording = saved(network.run(4), tmp_path)
    rest = network.run(4, start=recording)
    assert rest["B"].tolist() == [0.0] * 4
    assert rest["C"].tolist() == [0.0] * 4
    simulation = nv.compile_text(PLAIN).simulator(start=recording)
    simulation.step()
    assert simulation.activity.tolist() == [1.0, 0.0, 0.0]
    simulation.mend("B", "A -> C")
    simulation.step()
    simulation.step()
    assert simulation.activity.tolist() == [1.0, 2.0, 1.0]


def test_what_a_lesioned_connection_carried_is_not_under_way(tmp_path: Path) -> None:
    text = HEAD + "neurons: {A: {bias: g}, B: {}}\nconnections: {A -> B: {delay: 2}}\n"
    recording = nv.compile_text(text + "events: [{at: 1, lesion: A -> B}]").run(5)
    simulation = nv.compile_text(text).simulator(start=saved(recording, tmp_path))
    simulation.mend("A -> B")
    found = []
    for _ in range(4):
        simulation.step()
        found.append(simulation.activity[1])
    assert found == [0.0, 0.0, 1.0, 1.0]


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_random_numbers_go_on(backend: str, tmp_path: Path) -> None:
    network = nv.compile_text(HEAD + "neurons: {A: {count: 2, noise: 'normal(0, g)'}, B: {noise: 'uniform(0, k + 1)'}}")
    whole = network.run(30, backend=backend)
    first = saved(network.run(10, backend=backend), tmp_path)
    second = saved(network.run(7, backend=backend, start=first), tmp_path)
    third = network.run(13, backend=backend, start=second)
    assert (second.reached, third.reached) == (17, 30)
    np.testing.assert_array_equal(np.concatenate([first["A"], second["A"], third["A"]]), whole["A"])
    np.testing.assert_allclose(third["B"] / np.arange(1, 14), whole["B"][17:] / np.arange(18, 31), rtol=1e-14)


def test_events_that_no_longer_fit_are_refused_before_the_run(tmp_path: Path) -> None:
    """What a recording has set goes before the events, which have been tried out from the spec's own values."""
    head = "neurovis: 1\nname: x\nparameters: {g: {value: 1, max: 3}}\nneurons: {A: {bias: g}}\n"
    network = nv.compile_text(head + "events: [{at: 2, set: {g: 2*g}}]")
    recording = saved(network.run(4), tmp_path)
    with pytest.raises(RecordingError, match="do not fit the events: from step 2 on 'g' is 4; its bounds are -∞ to 3"):
        network.run(4, start=recording)
    assert network.run(2, start=recording)["A"].tolist() == [2.0, 2.0]


def test_signals_under_way_were_sent_with_the_weights_of_their_time(tmp_path: Path) -> None:
    text = HEAD + "neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: {weight: g, delay: 4}}\n"
    network = nv.compile_text(text + "events: [{at: 8, set: {g: 5}}]")
    first = saved(network.run(10), tmp_path)
    assert network.run(8, start=first)["B"].tolist() == network.run(18)["B"][10:].tolist() == [1.0] * 2 + [5.0] * 6
    assert nv.compile_text(text, g=3).run(6, start=first)["B"].tolist() == [1.0, 1.0, 5.0, 5.0, 3.0, 3.0]
