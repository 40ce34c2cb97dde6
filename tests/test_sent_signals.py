"""Eq. 3 where connections send a state or an output in place of the activity: lines are coloured by what is sent."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import scene_of
from small_specs import compiled

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.view import LEVELS, view_of
from neurovis_spec.runtime.formats import load
from neurovis_spec.runtime.recording import Recording, Snapshot
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.scene.encode import looks
from neurovis_spec.scene.fading import snapshots_of
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.reached import largest_signals
from neurovis_spec.scene.shots import snapshots_of_run
from neurovis_spec.scene.signals import Signals

#: an activity that is always 0, and what is sent of it
TEXT = """time: {dt: 0.01, steps: 60}
models:
  cell: {state: {v: {initial: 1, derivative: -v + drive}, w: {derivative: v}}, outputs: {twice: 2*v}, activity: 0*v}
neurons: {A: {count: 2, model: cell, initial: {v: i + 1}}, B: {count: 2}}
connections:
  - A -> B: {pattern: one_to_one, weight: 0.5, send: twice}
  - A1 -> B2: {weight: -1, send: w}
  - B1 -> B2: 3
"""
PLAIN = "neurons: {A: {}, B: {}}\nconnections: {A -> B: 2}\n"


def at(network: CompiledNetwork, made: Recording, step: int) -> Snapshot:
    """A step of a recording."""
    (snapshot,) = snapshots_of(network.network, made, [step])
    return snapshot


def sent_in(made: Recording, row: int) -> list[float]:
    """What each connection of TEXT sends at a step, by its states; the last one sends the activity."""
    return [0.5 * made["A1.twice"][row], 0.5 * made["A2.twice"][row], -made["A1.w"][row], 3 * made["B1"][row]]


def test_lines_have_the_colour_of_what_is_sent() -> None:
    network = compiled(TEXT)
    made = network.run()
    assert made.state_names == ("A1.w", "A1.twice", "A2.twice")
    for step in (0, 20, 59):
        snapshot = at(network, made, step)
        wanted = sent_in(made, step)
        assert Signals(network.network).at(snapshot).value.tolist() == wanted
        seen = looks(network.network, snapshot, replace(network.gains, signal=np.full(4, 0.3)), 10.0)
        assert seen.lines == pytest.approx(np.clip(0.3 * np.array(wanted), -1, 1))
    assert made["A1.twice"][20] > 1


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_a_run_a_recording_and_the_live_page_agree(backend: str) -> None:
    network = compiled(TEXT)
    made = network.run(40, backend=backend)
    signals = Signals(network.network)
    simulation = Simulation(network.network, backend=backend)
    in_run = list(snapshots_of_run(simulation, Look(network.network.render, first=0, count=40)))
    recorded = list(snapshots_of(network.network, made, range(40)))
    assert [signals.at(one).value.tolist() for one in in_run] == [sent_in(made, row) for row in range(40)]
    assert [signals.at(one).value.tolist() for one in recorded] == [sent_in(made, row) for row in range(40)]
    view = view_of(network, network.gains)
    source, replayed = SimulatedSource(network.simulator(backend)), RecordedSource(network.network, made)
    for step in (0, 7):
        for one in (source, replayed):
            while one.step < step:
                one.advance()
            levels = view.glance(one.seen()).lines
            colours = np.clip(view.gains.signal * sent_in(made, step), -1, 1)
            assert np.abs(levels / LEVELS - colours).max() < 1 / LEVELS


def test_gains_are_those_of_what_is_sent() -> None:
    network = compiled(TEXT)
    made = network.run()
    wanted = np.abs([sent_in(made, row) for row in range(60)]).max(axis=0)
    assert largest_signals(network.network, made) == pytest.approx(wanted)
    assert network.gains.signal.tolist() == network.gains_for(made).signal.tolist()
    activity = compiled(TEXT.replace(", send: twice", "").replace(", send: w", ""))
    assert network.gains.signal.tolist() != activity.gains.signal.tolist()


def test_glyphs_add_up_what_is_sent() -> None:
    network = compiled(TEXT + "render: {collapse: [A, B]}\n")
    made = network.run()
    view = view_of(network, network.gains_for(made))
    signals = view.drawn.signals(at(network, made, 20)).value
    assert signals.tolist() == pytest.approx([sum(sent_in(made, 20)[:3])])


def test_a_lesioned_neuron_sends_nothing_though_its_states_go_on() -> None:
    events = "events:\n  - {at: 10, lesion: A1}\n  - {at: 30, mend: A1}\n  - {at: 50, lesion: A2}\n"
    network = compiled(TEXT + events)
    made = network.run()
    assert made["A1.twice"][20] > 0
    signals, run = Signals(network.network), Simulation(network.network)
    live = snapshots_of_run(run, Look(network.network.render, first=0, count=60))
    for one, other in zip(snapshots_of(network.network, made, range(60)), live, strict=True):
        assert one.sent is not None
        assert other.sent is not None
        assert one.sent.tolist() == other.sent.tolist(), one.step
    assert signals.at(at(network, made, 20)).value[0] == 0
    assert signals.at(at(network, made, 40)).value[0] > 0


def test_what_is_lesioned_by_hand_sends_nothing_in_its_recording() -> None:
    network = compiled(TEXT.replace("0*v", "v"))
    run = network.simulator("numpy")
    run.record()
    for step in range(20):
        if step == 10:
            run.lesion("A2")
        run.step()
    made = run.recording
    signals = Signals(network.network)
    for step, own in ((9, made["A2.twice"][9] / 2), (10, 0), (19, 0)):
        assert signals.at(at(network, made, step)).value[:2].tolist() == [made["A1.twice"][step] / 2, own]


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".mcap"])
def test_files_keep_it(tmp_path: Path, suffix: str) -> None:
    network = compiled(TEXT)
    made = network.run(30)
    path = tmp_path / f"a{suffix}"
    made.save(path)
    network.render(tmp_path / "one.svg", recording=made, step=20)
    network.render(tmp_path / "other.svg", recording=load(path), step=20)
    assert (tmp_path / "one.svg").read_text() == (tmp_path / "other.svg").read_text()


def test_a_recording_that_lacks_it_says_so_and_has_no_colours() -> None:
    network = compiled(TEXT)
    made = network.run(30)
    lacking = replace(made, states=made.states[:, :1], state_names=made.state_names[:1])
    with pytest.warns(RuntimeWarning, match=r"does not hold A1\.twice, A2\.twice, which connections send"):
        snapshot = at(network, lacking, 20)
    lines = looks(network.network, snapshot, network.gains, 10.0).lines
    assert lines[:3].tolist() == [0, 0, 0]
    with pytest.warns(RuntimeWarning, match="no colour"):
        assert network.gains_for(lacking).signal[:3].tolist() != []


def test_a_partial_recording_holds_no_more_than_is_asked_for() -> None:
    assert compiled(TEXT).run(3, neurons=["A"]).state_names == ()
    assert len(compiled(TEXT).run(3, weights="none").state_names) == 3  # no weight changes: it is whole
    learning = compiled(TEXT.replace("A1 -> B2: {", "A1 -> B2: {plasticity: hebbian, "))
    assert learning.run(3, weights="none").state_names == ()


def test_networks_that_send_activities_record_no_more() -> None:
    network = compiled(PLAIN)
    made = network.run(3)
    assert made.state_names == ()
    assert at(network, made, 2).sent is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Signals(network.network).at(at(network, made, 2)).value.tolist() == [2 * made["A"][2]]


def test_the_legend_says_what_is_sent() -> None:
    def words(text: str) -> str:
        network = compiled(text)
        return str(list(scene_of(network, at(network, network.run(3), 2)).shapes()))

    assert "signal w·a" in words(PLAIN)
    assert "signal w·what is sent" in words(TEXT)
    assert "signal w·v" in words(
        TEXT.partition("connections:")[0] + "connections: {A -> B: {pattern: one_to_one, send: v}}\n"
    )
