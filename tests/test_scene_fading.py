"""Traces: a spike of one step is seen for a while, in stills and in films alike; and who has a trace."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import film_of, scene_of
from small_specs import compiled, network_of

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.scene import Disc, Scene, Text, still
from neurovis_spec.scene.fading import seconds_of, snapshots_of
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.shots import shots_of, snapshots_of_run
from neurovis_spec.scene.themes import THEMES, colours

TIME = "time: {dt: 0.001, steps: 300}\n"
SPIKING = (
    TIME
    + """neurons:
  E: {count: 3, model: {integrate_and_fire: {leak: 0.05}}, bias: 0.06 + 0.01*i}
  R: {model: {leaky_integrator: {leak: 0.02}}}
connections: {E -> R: {pattern: all_to_all, weight: -1}}
"""
)
QUIET = colours(THEMES["default"], [0.0])[0]


def seconds(text: str) -> list[float]:
    return [round(one, 9) for one in seconds_of(network_of(text)).tolist()]


def discs(scene: Scene) -> list[str]:
    found = [g.shapes[0] for g in scene.groups if "neuron" in g.data]
    return [shape.fill for shape in found if isinstance(shape, Disc)]


def words(scene: Scene) -> set[str]:
    return {shape.text for shape in scene.shapes() if isinstance(shape, Text)}


def test_what_spikes_has_a_trace_by_itself() -> None:
    """A fifth of a second of a film, which has a frame a step and 60 frames a second at most."""
    assert seconds(SPIKING) == [0.012] * 3 + [0]
    assert seconds("time: {dt: 0.05}\nneurons: {E: {model: integrate_and_fire}}") == [0.2]
    assert seconds("neurons: {E: {model: integrate_and_fire}}") == [5]
    assert seconds("time: {dt: 0.5}\nneurons: {E: {model: integrate_and_fire}}") == [1]


@pytest.mark.parametrize(
    ("group", "spikes"),
    [
        ("{model: izhikevich, activation: {step: {threshold: 30}}}", True),
        ("{model: izhikevich}", False),  # its potential
        ("{activation: step}", False),
        ("{model: hysteresis}", False),
        ("{model: own}", True),
        ("{model: graded}", False),
        ("{model: graded, activation: step}", True),
    ],
)
def test_a_model_says_whether_it_spikes(group: str, spikes: bool) -> None:
    text = """models:
  own: {state: {v: {each_step: v + drive}}, activity: "1 if v > 1 else 0", spikes: true}
  graded: {state: {v: {each_step: v + drive}}, activity: f(v), spikes: true}
"""
    network = network_of(f"{text}neurons: {{A: {group}, B: {{model: own}}, C: {{model: graded}}}}")
    assert network.neurons.groups[0].spikes is spikes


def test_the_spec_says_how_long_and_the_reference_that_names_the_fewest_holds() -> None:
    said = SPIKING + "parameters: {long: 0.1}\nrender: {trace: {E2: 0, E: long/2, R: 0.02}}"
    assert seconds(said) == [0.05, 0, 0.05, 0.02]


def test_the_trace_is_the_activity_furthest_from_0_each_faded_by_its_age() -> None:
    network = compiled(SPIKING)
    recording = network.run()
    assert set(np.unique(recording["E"]).tolist()) == {0, 1}
    left, shown = math.exp(-0.001 / 0.012), np.zeros(3)
    by_hand = []
    for now in recording["E"]:
        shown = np.where(np.abs(now) >= np.abs(left * shown), now, left * shown)
        by_hand.append(shown)
    run = snapshots_of_run(Simulation(network.network), Look(network.network.render, count=300, fps=1.0))
    for row, (recorded, made) in enumerate(zip(snapshots_of(network.network, recording, range(300)), run, strict=True)):
        for seen in (recorded.seen, made.seen):
            assert seen is not None
            assert seen[:3] == pytest.approx(by_hand[row], abs=1e-12)
            assert seen[3] == recording["R"][row]  # which has none
    for steps in ([250], [3, 250], range(0, 251, 50)):
        *_, last = snapshots_of(network.network, recording, steps)
        assert last.seen is not None
        assert last.seen[:3] == pytest.approx(by_hand[250], abs=2e-5)


def test_it_goes_by_steps_where_a_recording_has_not_all_of_them() -> None:
    network = compiled(SPIKING)
    recording = network.run(every=7)
    left, shown = math.exp(-0.007 / 0.012), np.zeros(3)
    for row, now in enumerate(recording["E"]):
        shown = np.maximum(now, left * shown)
        (snapshot,) = snapshots_of(network.network, recording, [7 * row])
        assert snapshot.seen is not None
        assert snapshot.seen[:3] == pytest.approx(shown, abs=2e-5)


def pictures(network: CompiledNetwork) -> tuple[Scene, Scene]:
    """Step 250 as a still, and as a frame of a film."""
    recording = network.run()
    own = network.network
    (alone,) = shots_of(own, recording, Look(own.render, first=250)).snapshots(own)
    steps = list(shots_of(own, recording, Look(own.render, first=230, count=40, fps=60.0)).snapshots(own))
    return scene_of(network, alone), still(film_of(network, steps), 20)


def test_a_still_and_the_frame_of_a_film_show_the_same_trace() -> None:
    network = compiled(SPIKING + "render: {gain: {activity: 1, signal: 1}}")
    alone, frame = pictures(network)
    assert discs(alone) == discs(frame)
    assert network.run()["E"][250].max() == 0  # nobody spikes in this very step
    assert any(fill != QUIET for fill in discs(alone)[:3])
    without = compiled(SPIKING + "render: {gain: {activity: 1, signal: 1}, trace: {E: 0}}")
    assert discs(pictures(without)[0])[:3] == [QUIET] * 3


def test_a_recording_of_ones_own_is_drawn_with_the_same_trace(tmp_path: Path) -> None:
    network = compiled(SPIKING + "render: {gain: {activity: 1, signal: 1, thickness: 1, change: 1}}")
    network.render(tmp_path / "with.svg", step=250, recording=network.run())
    network.render(tmp_path / "without.svg", step=250)
    drawn = [re.findall(r"data-.*", (tmp_path / f"{name}.svg").read_text()) for name in ("with", "without")]
    assert len(drawn[0]) == 4 + 3
    shown = [[re.findall(r'(?:fill|stroke|stroke-width)="[^"]*"', line) for line in lines] for lines in drawn]
    assert shown[0] == shown[1]


def test_lines_carry_what_is_seen_of_their_source() -> None:
    scene, _ = pictures(compiled(SPIKING + "render: {gain: {activity: 1, signal: 1}}"))
    lines = {g.data["from"]: g.shapes[0] for g in scene.groups if "connection" in g.data}
    assert any(getattr(line, "stroke", QUIET) != QUIET for line in lines.values())


def test_the_legend_and_the_tooltip_say_so() -> None:
    scene, _ = pictures(compiled(SPIKING))
    assert {"Trace", "activity fades", "to 1/e in 0.012 s"} <= words(scene)
    titles = {g.data["neuron"]: g.title for g in scene.groups if "neuron" in g.data}
    assert "fades to 1/e in 0.012 s" in titles["E1"]
    assert "fades" not in titles["R"]
    both, _ = pictures(compiled(SPIKING + "render: {trace: {E: 0.005, R: 0.1}}"))
    assert "to 1/e in 0.005 … 0.1 s" in words(both)
    none, _ = pictures(compiled(SPIKING + "render: {trace: {E: 0}}"))
    assert "Trace" not in words(none)


def test_a_trace_changes_nothing_but_the_picture() -> None:
    assert network_of(SPIKING).hash == network_of(SPIKING + "render: {trace: {R: 1}}").hash
    network = compiled(TIME + "neurons: {A: {bias: 1}}")
    (snapshot,) = shots_of(network.network, network.run(), Look(network.network.render, first=5)).snapshots(
        network.network
    )
    assert snapshot.seen is None


def test_what_is_no_number_leaves_no_trace() -> None:
    network = compiled(TIME + "neurons: {A: {bias: 1}, B: {bias: 1}}\nrender: {trace: {A: 0.01}}")
    recording = network.run(5)
    activity = recording.activity.copy()
    activity[2:] = np.array([[np.nan, np.nan], [0, 0], [0, np.inf]])
    odd = snapshots_of(network.network, replace(recording, activity=activity), [1, 2, 3])
    for snapshot, expected in zip(odd, ([1, 1], [math.exp(-0.1), 0], [math.exp(-0.2), 0]), strict=True):
        assert snapshot.seen is not None
        assert np.nan_to_num(snapshot.seen).tolist() == pytest.approx(expected)


def test_a_figure_shows_the_traces_too(tmp_path: Path) -> None:
    network = compiled(SPIKING)
    network.render(tmp_path / "one.svg", step=250)
    network.render(tmp_path / "figure.svg", step=250, view=["network", "raster"])
    fills = [
        re.findall(r'data-neuron="\w+".*?<circle [^>]*fill="(#\w+)"', (tmp_path / name).read_text(), re.DOTALL)[:4]
        for name in ("one.svg", "figure.svg")
    ]
    assert fills[0] == fills[1]
    assert set(fills[0][:3]) != {QUIET}
