"""Shown states: what ``render: {show: {N: v}}`` says colours neurons in place of their activity, everywhere."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scenes import scene_of
from small_specs import compiled, network_of

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.diagnostics import SpecError
from neurovis_spec.live.history import Bins, Members
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.view import LEVELS, view_of
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.scene.fading import snapshots_of
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.shots import snapshots_of_run

PHASES = """time: {dt: 0.01, steps: 200}
models: {phase: {state: {theta: {derivative: 6.3 + drive}}, outputs: {x: cos(theta)}, activity: theta}}
neurons: {N: {count: 3, model: phase, initial: {theta: i}}, O: {count: 2, bias: i}}
connections: {N -> O: {pattern: all_to_all, weight: 0.1, delay: 1}}
"""
SHOWN = PHASES + "render: {show: {N: x}}\n"
POTENTIAL = """time: {dt: 1, steps: 200}
models:
  cell:
    parameters: {rest: -65}
    state: {v: {initial: rest, each_step: "30 if k % 20 == 0 else -75 if k % 20 < 3 else rest"}}
    activity: 1 if v > 0 else 0
neurons: {E: {model: cell}, F: {model: cell}}
"""


def at(network: CompiledNetwork, step: int) -> Snapshot:
    """A step of a run."""
    (snapshot,) = snapshots_of(network.network, network.run(step + 1), [step])
    return snapshot


def test_a_shown_state_is_recorded_and_changes_no_hash() -> None:
    shown, plain = compiled(SHOWN), compiled(PHASES)
    assert shown.network.hash == plain.network.hash
    made = shown.run(50)
    assert made.state_names == ("N1.x", "N2.x", "N3.x")
    assert np.allclose(made["N.x"], np.cos(made["N"]))
    assert plain.run(50).state_names == ()


def test_discs_show_it_and_lines_the_signal() -> None:
    network = compiled(SHOWN)
    made = network.run()
    gains = network.gains_for(made)
    assert gains.activity[:3].tolist() == [1.0] * 3  # from −1 to 1, around 0
    assert gains.centre.tolist() == [0.0] * 5
    assert [(scale.state, scale.names) for scale in gains.activity_scales] == [("", ("O",)), ("x", ("N",))]
    by_recording = list(snapshots_of(network.network, made, range(200)))
    by_run = list(snapshots_of_run(Simulation(network.network), Look(network.network.render, first=0, count=200)))
    for one, other in zip(by_recording, by_run, strict=True):
        assert one.shown is not None
        assert other.shown is not None
        assert (one.shown == other.shown).all()
        assert (one.shown[3:] == one.activity[3:]).all()
    plain = compiled(PHASES)
    assert (gains.signal == plain.gains_for(plain.run()).signal).all()


def test_rest_is_grey_and_nearly_all_values_have_a_colour() -> None:
    network = compiled(POTENTIAL + "render: {show: {E: v}}\n")
    gains = network.gains_for(network.run())
    assert gains.centre.tolist() == [-65, 0]
    assert 1 / gains.activity[0] == pytest.approx(95)
    ranged = compiled(POTENTIAL + "render: {show: {E + F: v}, gain: {activity: {E: [-80, 40]}}}\n")
    gains = ranged.gains_for(ranged.run())
    assert gains.centre.tolist() == [-20, -65]
    assert [(scale.state, scale.names) for scale in gains.activity_scales] == [("v", ("E + F",)), ("v", ("E",))]


def test_what_names_the_fewest_holds() -> None:
    text = PHASES + "render: {show: {N: theta, N2: x}}\n"
    shown = network_of(text).render.show
    assert [(one.state, one.members) for one in shown] == [("theta", (0, 2)), ("x", (1,))]


def test_a_constant_state_is_grey() -> None:
    still = "models: {m: {state: {v: {initial: 7, each_step: v}}, activity: drive}}\nneurons: {A: {model: m}}\n"
    network = compiled(still + "render: {show: {A: v}}\n")
    assert network.gains.centre.tolist() == [7]
    assert network.gains.activity.tolist() == [1]


def test_legend_tooltips_and_names_say_what_is_shown() -> None:
    network = compiled(SHOWN)
    scene = scene_of(network, at(network, 30))
    titles = {group.data["neuron"]: group.title for group in scene.groups if "neuron" in group.data}
    assert titles["N1"].split("\n")[1].startswith("x −0.")
    assert titles["O1"].split("\n")[1].startswith("activity ")
    assert {group.data.get("state") for group in scene.groups if "neuron" in group.data} == {"x", None}
    words = str(list(scene.shapes()))
    assert "x of N" in words
    assert "activity of O" in words
    alone = compiled(POTENTIAL + "render: {show: {E: v, F: v}}\n")
    assert "neuron: v" in str(list(scene_of(alone, at(alone, 0)).shapes()))


def test_views_over_time_show_it(tmp_path: Path) -> None:
    compiled(SHOWN).render(tmp_path / "a.svg", view=["traces", "raster"])
    text = re.sub(r"<[^>]*>", " ", (tmp_path / "a.svg").read_text())
    assert "N1.x" in text
    assert "x, activity" in text


def test_a_glyph_shows_the_mean_of_its_members() -> None:
    network = compiled(SHOWN.replace("show: {N: x}", "show: {N: x}, collapse: N"))
    made = network.run()
    view = view_of(network, network.gains_for(made))
    (snapshot,) = snapshots_of(network.network, made, [20])
    drawn = view.drawn.snapshot(snapshot)
    assert drawn.shown is not None
    (glyph,) = np.unique(view.drawn.unit[:3])
    assert drawn.shown[glyph] == pytest.approx(made["N.x"][20].mean())
    some = compiled(SHOWN.replace("show: {N: x}", "show: {N1: x}, collapse: N"))
    assert view_of(some, some.gains).drawn.network.render.show == ()


def sources(network: CompiledNetwork) -> tuple[SimulatedSource, RecordedSource]:
    run = SimulatedSource(Simulation(network.network))
    return run, RecordedSource(network.network, network.run(60))


def test_the_live_page_has_the_same_colours_and_traces_of_it() -> None:
    network = compiled(SHOWN)
    view = view_of(network, network.gains)
    for source in sources(network):
        for _ in range(40):
            source.advance()
        now = np.cos(source.seen().snapshot.activity[:3])
        assert (view.glance(source.seen()).discs[:3] == np.rint(LEVELS * now)).all()
        assert view.values(source.seen(), ["n0"]) == {"n0": pytest.approx(now[0])}
        assert source.history.read(Members("neurons", np.array([1])), Bins(40, 1, 1))[0, 0] == pytest.approx(now[1])


def test_a_recording_without_it_is_refused_with_what_to_do(tmp_path: Path) -> None:
    made, network = compiled(PHASES).run(20), compiled(SHOWN)
    with pytest.raises(
        RecordingError, match=r"state 'N1.x', which the picture shows: record it \(neurovis run --states"
    ):
        network.render(tmp_path / "a.svg", recording=made)
    with pytest.raises(RecordingError, match=r"N1\.x"):
        RecordedSource(network.network, made)
    network.render(tmp_path / "a.svg", recording=compiled(PHASES).run(20, states="N.x"))


def test_a_state_that_there_is_not_is_told_at_its_place() -> None:
    with pytest.raises(SpecError, match=r"7:20.*no state and no output 'thta'"):
        network_of(PHASES + "render: {show: {N: thta}}\n")
