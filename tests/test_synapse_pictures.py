"""Pictures and recordings of synapses: lines have the colour of what a synapse forms, at the end of the step."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from neurovis_renderers.animated_svg import AnimatedSvgRenderer
from neurovis_renderers.canvas import paint
from neurovis_renderers.moving import Moving, Painter
from scenes import film_of, scene_of
from small_specs import compiled

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.turns import Set
from neurovis_spec.live.view import BAR, LEVELS, NEGATIVE, view_of
from neurovis_spec.runtime.columns import Keep, columns_of
from neurovis_spec.runtime.formats import load
from neurovis_spec.runtime.formed import signals_of
from neurovis_spec.runtime.recording import Recording, Snapshot
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.scene.collapse import gathered
from neurovis_spec.scene.encode import looks
from neurovis_spec.scene.ends import effects_of, ends_of
from neurovis_spec.scene.fading import snapshots_of
from neurovis_spec.scene.film import still
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.model import Arrowhead, Scene, Text
from neurovis_spec.scene.reached import largest_signals
from neurovis_spec.scene.shots import snapshots_of_run
from neurovis_spec.scene.signals import Signals
from neurovis_spec.text_width import width

#: gap junctions, a synapse with a state, a delay and a parameter that is set, one that learns, a plain connection
TEXT = """time: {dt: 0.01, steps: 60}
parameters: {E: 2}
models:
  cell: {state: {v: {initial: 1, derivative: drive - v}}, activity: v}
synapses:
  gap: {signal: weight*(pre.v - post.v)}
  slow: {parameters: {E: 1}, state: {g: {derivative: pre.v - g}}, signal: weight*g*(E - post.v)}
neurons: {A: {count: 2, model: cell, initial: {v: i + 2}}, B: {count: 2, model: cell}}
connections:
  - A -> B: {pattern: one_to_one, weight: 0.5, synapse: gap}
  - A1 -> B2: {weight: -1, synapse: {slow: {E: E}}, delay: 3}
  - B1 -> A2: {synapse: gap, plasticity: {hebbian: {rate: 0.1}}, delay: 1}
  - B1 -> B2: 3
"""
EVENTS = "events: [{at: 10, set: {E: 5}}, {at: 20, lesion: A1}, {at: 30, mend: A1}]\n"


def at(network: CompiledNetwork, made: Recording, step: int) -> Snapshot:
    """A step of a recording."""
    (snapshot,) = snapshots_of(network.network, made, [step])
    return snapshot


def formed(network: CompiledNetwork, steps: int, backend: str = "numpy", turned: bool = False) -> list[FloatArray]:
    """What each connection brings, step by step; ``turned`` by hand as EVENTS do it."""
    simulation, found = Simulation(network.network, backend), []
    for step in range(steps):
        if turned and step == 10:
            simulation.set(E=5)
        if turned and step in (20, 30):
            (simulation.lesion if step == 20 else simulation.mend)("A1")
        weights = simulation.connection_weights
        simulation.step()
        found.append(signals_of(network.network, simulation.state(), weights))
    return found


def test_lines_have_the_colour_of_what_a_synapse_forms() -> None:
    network = compiled(TEXT)
    made = network.run(states=["A.v", "B.v", "(A1 -> B2).g"])
    names = [f"({name}).signal" for name in ("A1 -> B1", "A2 -> B2", "A1 -> B2", "B1 -> A2")]
    assert set(made.state_names) == {*names, "A1.v", "A2.v", "B1.v", "B2.v", "(A1 -> B2).g"}
    for row in (0, 20, 59):
        v = {name: made[f"{name}.v"][row] for name in ("A1", "A2", "B1", "B2")}
        before = made["B1.v"][row - 1] if row else 0.0
        wanted = [
            0.5 * (v["A1"] - v["B1"]),
            0.5 * (v["A2"] - v["B2"]),
            -made["(A1 -> B2).g"][row] * (2 - v["B2"]),
            made.weight("B1 -> A2")[row] * (before - v["A2"]),
            3 * made["B1"][row],
        ]
        snapshot = at(network, made, row)
        assert Signals(network.network).at(snapshot).value == pytest.approx(wanted, rel=1e-12)
        seen = looks(network.network, snapshot, replace(network.gains, signal=np.full(5, 0.3)), 10.0)
        assert seen.lines == pytest.approx(np.clip(0.3 * np.array(wanted), -1, 1))
    assert abs(made[names[2]][40]) > 0.1


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_a_run_a_recording_a_simulator_and_the_live_page_agree(backend: str, tmp_path: Path) -> None:
    wanted = formed(compiled(TEXT), 40, backend, turned=True)
    network = compiled(TEXT + EVENTS)
    made = network.run(40, backend=backend)
    signals, steps = Signals(network.network), range(40)
    simulation = Simulation(network.network, backend=backend)
    in_run = list(snapshots_of_run(simulation, Look(network.network.render, first=0, count=40)))
    recorded = list(snapshots_of(network.network, made, steps))
    assert [signals.at(one).value.tolist() for one in in_run] == [one.tolist() for one in wanted]
    assert [signals.at(one).value.tolist() for one in recorded] == [one.tolist() for one in wanted]
    simulator = network.simulator(backend)
    simulator.record(tmp_path / "a.npz")
    with simulator:
        for _ in steps:
            simulator.step()
    assert load(tmp_path / "a.npz").states.tolist() == made.states.tolist()
    view = view_of(network, network.gains)
    source, replayed = SimulatedSource(network.simulator(backend)), RecordedSource(network.network, made)
    for step in (0, 9, 10, 19, 20, 39, 12):
        for one in (source, replayed):
            while one.step < step:
                one.advance()
            one.go(step)
            levels = view.glance(one.seen()).lines
            colours = np.clip(view.gains.signal * wanted[step], -1, 1)
            assert np.abs(levels / LEVELS - colours).max() < 1 / LEVELS
            states = one.seen().states
            assert states is not None
            assert states.tolist() == made.states[step].tolist()
    assert wanted[25][0] == wanted[25][2] == 0 != wanted[35][0]


def test_gains_are_those_of_what_is_formed() -> None:
    network = compiled(TEXT)
    made = network.run()
    wanted = np.abs(formed(network, 60)).max(axis=0)
    assert largest_signals(network.network, made) == pytest.approx(wanted)
    assert network.gains.signal.tolist() == network.gains_for(made).signal.tolist()


def test_glyphs_add_up_what_is_formed() -> None:
    network = compiled(TEXT + "render: {collapse: [A, B]}\n")
    made = network.run()
    view = view_of(network, network.gains_for(made))
    signals = view.drawn.signals(at(network, made, 20)).value
    formed_then = formed(network, 21)[20]
    assert signals == pytest.approx([formed_then[:3].sum(), formed_then[3]])


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
    lacking = replace(made, states=made.states[:, :3], state_names=made.state_names[:3])
    with pytest.warns(RuntimeWarning, match=r"does not hold \(B1 -> A2\)\.signal, which connections send"):
        snapshot = at(network, lacking, 20)
    lines = looks(network.network, snapshot, network.gains, 10.0).lines
    assert lines[:4].tolist() == [0, 0, 0, 0]
    assert lines[4]


def test_a_partial_recording_a_sweep_and_plain_networks_hold_none() -> None:
    network = compiled(TEXT)
    assert network.run(3, neurons=["A"]).state_names == network.run(3, weights="none").state_names == ()
    without = network.run(3, signals="none")
    assert without.state_names == ()
    np.testing.assert_array_equal(without.weights, network.run(3).weights)
    with pytest.raises(ValueError, match="signals are 'all' or 'none', not 'some'"):
        network.run(3, signals="some")  # type: ignore[arg-type]
    assert columns_of(network.network, Keep(sent=False)).probe.names == ()
    fixed = compiled(TEXT.replace(", plasticity: {hebbian: {rate: 0.1}}", ""))
    assert fixed.run(3, weights="none").state_names == ()
    plain = compiled("neurons: {A: {}, B: {}}\nconnections: {A -> B: 2}\n")
    assert plain.run(3).state_names == ()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Signals(plain.network).at(at(plain, plain.run(3), 2)).value.tolist() == [2 * plain.run(3)["A"][2]]


def test_the_legend_says_of_what_signals_are() -> None:
    def words(connections: str) -> str:
        network = compiled(TEXT.partition("connections:")[0] + f"connections: {connections}\n")
        shapes = scene_of(network, at(network, network.run(3), 2)).shapes()
        (found,) = [shape.text for shape in shapes if isinstance(shape, Text) and "signal" in shape.text]
        return found.partition(" (up to")[0].partition(": ")[2]

    gap = "A -> B: {pattern: one_to_one, synapse: gap}"
    assert words(f"[{gap}]") == "signal"
    assert words(f"[{gap}, B1 -> A1: 1]") == "signal w·a, or of a synapse"
    assert words(f"[{gap}, B1 -> A1: {{send: v}}]") == "signal w·v, or of a synapse"
    assert words("[B1 -> A1: 1]") == "signal w·a"


def test_a_heading_of_the_legend_has_room() -> None:
    connections = "connections: [A -> B: {pattern: one_to_one, synapse: gap}, B1 -> A1: 1]\n"
    network = compiled(TEXT.partition("connections:")[0] + connections + "render: {gain: {signal: {A -> B: 3}}}\n")
    shapes = scene_of(network, at(network, network.run(3), 2)).shapes()
    found = {shape.text: shape for shape in shapes if isinstance(shape, Text)}
    lines, thickness = found["Lines: signal w·a, or of a synapse"], found["Thickness"]
    assert lines.point[1] == thickness.point[1]
    assert lines.point[0] + width(lines.text, lines.size, lines.weight) < thickness.point[0]


def test_a_state_of_a_rule_is_not_called_signal_where_a_synapse_gives_one() -> None:
    rule = "rules: {odd: {state: {signal: {each_step: pre}}, weight: {each_step: weight + signal}}}\n"
    with pytest.raises(nv.SpecError, match="the rule 'odd' has a state 'signal', which the synapse gives"):
        compiled(TEXT.replace("{hebbian: {rate: 0.1}}", "odd") + rule)
    assert compiled(TEXT.replace("synapse: gap, plasticity: {hebbian: {rate: 0.1}}", "plasticity: odd") + rule)


#: an arrow, a bar, none by a sign; by weights alone a bar and an arrow
SIGNS = """time: {dt: 0.1, steps: 10}
models: {cell: {parameters: {rest: -60}, state: {v: {derivative: drive - v}}, activity: v}}
synapses:
  gap: {signal: weight*(pre.v - post.v), sign: 0}
  graded: {parameters: {E: 0}, signal: weight*pre.v*(E - post.v), sign: E - post.rest}
  turning: {signal: weight*pre.v, sign: 0.5 - weight}
neurons: {A: {model: cell}, B: {count: 2, model: {cell: {rest: [-60, 10]}}}, C: {model: cell}}
connections:
  - A -> B: {synapse: graded}
  - B1 -> C: {weight: -1, synapse: gap}
  - A -> C: -2
  - B2 -> C: 3
  - C -> A: {weight: 0.2, synapse: turning, plasticity: {hebbian: {rate: 0}}}
  - C -> B1: {weight: 0.5, synapse: turning}
"""
WANTED = {"A -> B1": 1, "A -> B2": -1, "B1 -> C": 0, "A -> C": -1, "B2 -> C": 1, "C -> A": 1, "C -> B1": 0}


def test_lines_end_as_the_sign_of_their_synapse_says() -> None:
    network = compiled(SIGNS)
    weights = network.network.connections.weights.whole()
    assert (
        dict(zip(network.network.connection_names, ends_of(network.network, weights).tolist(), strict=True)) == WANTED
    )
    later = np.stack([weights, np.full(7, 0.75)])
    assert ends_of(network.network, later)[1].tolist() == [1, -1, 0, 1, 1, -1, -1]
    effects = effects_of(network.network, weights, ends_of(network.network, weights))
    assert effects.tolist() == [1, -1, 1, -2, 3, 0.2, 0.5]


def heads(scene: Scene) -> dict[str, Arrowhead]:
    found = ((group, shape) for group in scene.groups for shape in group.shapes if isinstance(shape, Arrowhead))
    return {group.data["connection"]: shape for group, shape in found if "connection" in group.data}


@pytest.mark.parametrize("suffix", [".svg", ".png"])
def test_stills_films_glances_and_legends_show_ends(suffix: str, tmp_path: Path) -> None:
    network = compiled(SIGNS)
    made = network.run()
    kinds = {1: "arrow", 0: "none", -1: "bar"}
    scene = scene_of(network, at(network, made, 3))
    assert {name: shape.kind for name, shape in heads(scene).items()} == {
        one: kinds[end] for one, end in WANTED.items()
    }
    plain = heads(scene)["B1 -> C"]
    assert plain.half_width == plain.width / 2
    said = {"excites", "inhibits", "neither excites nor inhibits"}
    assert {shape.text for shape in scene.shapes() if isinstance(shape, Text)} >= said
    themed = compiled(SIGNS + "render: {theme: {ends: arrows}}\n")
    assert {shape.kind for shape in heads(scene_of(themed, at(themed, made, 3))).values()} == {"arrow"}
    view = view_of(network, network.gains)
    glance = view.glance(RecordedSource(network.network, made).seen())
    in_page = [(bool(kind & BAR), bool(kind & NEGATIVE)) for kind in glance.kinds[:7].tolist()]
    of_ends = {1: (False, False), 0: (True, False), -1: (True, True)}
    assert in_page == [of_ends[end] for end in WANTED.values()]
    network.render(tmp_path / f"a{suffix}", recording=made, view=["network", "matrix"])
    assert (tmp_path / f"a{suffix}").stat().st_size > 1000


#: the reversal of the one is a parameter, that of the other compared with one of the target's model
REVERSING = """time: {dt: 0.1, steps: 10}
parameters: {reversal: 0, rest: -60}
models: {cell: {parameters: {rest: -60}, state: {v: {derivative: drive - v}}, activity: v}}
synapses:
  graded: {parameters: {E: 0}, signal: weight*pre.v*(E - post.v), sign: E - post.rest}
neurons: {A: {model: cell}, B: {model: {cell: {rest: rest}}}, C: {model: cell}}
connections:
  - A -> B: {synapse: graded}
  - A -> C: {synapse: {graded: {E: reversal}}}
  - C -> A: -1
events: [{at: 2, set: {rest: 50}}, {at: 5, set: {reversal: -80}}, {at: 7, set: {rest: 0}}]
"""
REVERSED = [[1, 1], [1, 1], *[[-1, 1]] * 3, *[[-1, -1]] * 2, *[[0, -1]] * 3]


def test_ends_follow_parameters_that_are_set_in_a_run() -> None:
    """Of a recording by its events, of a run as it is, also where it is turned by hand."""
    network = compiled(REVERSING)
    recording = network.run()
    assert film_of(network, list(snapshots_of(network.network, recording, range(10)))).line_ends[:, :2].tolist() == (
        REVERSED
    )
    followed = snapshots_of_run(Simulation(network.network), Look(network.network.render, first=0, count=10))
    assert [one.ends[:2].tolist() for one in followed if one.ends is not None] == REVERSED
    view, source = view_of(network, network.gains), SimulatedSource(Simulation(network.network))
    while source.step < 2:
        source.advance()
    source.turn(Set({"reversal": -90.0}))
    for end in (1, -1, -1):  # it has its effect from the next step on
        kinds = view.glance(source.seen()).kinds[:2].tolist()
        assert [(bool(kind & BAR), bool(kind & NEGATIVE)) for kind in kinds] == [(True, True), (end < 0, end < 0)]
        source.advance()


def test_legends_and_matrices_have_the_ends_that_events_lead_to(tmp_path: Path) -> None:
    network = compiled(REVERSING)
    made = network.run()
    scene = scene_of(network, at(network, made, 0))
    assert {shape.text for shape in scene.shapes() if isinstance(shape, Text)} >= {
        "excites",
        "inhibits",
        "neither excites nor inhibits",
    }
    assert {name: shape.kind for name, shape in heads(scene).items()} == {
        "A -> B": "arrow",
        "A -> C": "arrow",
        "C -> A": "bar",
    }
    drawn = gathered(network.network, [("both", (1, 2))])
    first, last = (drawn.ends(one.weights, one.ends).tolist() for one in snapshots_of(network.network, made, [0, 6]))
    assert [first[0], last[0]] == [1, -1]
    pictures = []
    for step in (0, 9):
        network.render(tmp_path / "a.svg", recording=made, step=step, view="matrix")
        pictures.append((tmp_path / "a.svg").read_text())
    assert pictures[0].replace("step 0", "step 9") != pictures[1]


def test_glyphs_end_as_what_they_hold_does() -> None:
    drawn = gathered(compiled(SIGNS).network, [("B", (1, 2))])
    found = drawn.ends(drawn.whole.connections.weights.whole()).tolist()
    ends = dict(zip(drawn.network.connection_names, found, strict=True))
    assert ends == {"A -> B": 1, "B -> C": 1, "A -> C": -1, "C -> A": 1, "C -> B": 0}


def test_a_line_that_loses_its_end_is_drawn_so_in_films() -> None:
    """From a bar to nothing to an arrow, as its weight changes: as a raster, and as an SVG that is animated."""
    rule = "rules: {growing: {weight: {each_step: weight - 0.25}}}\n"
    text = (
        SIGNS.partition("connections:")[0]
        + "connections: {C -> A: {weight: 1, synapse: turning, plasticity: growing}}\n"
    )
    network = compiled(text.replace("0.5 - weight", "'clip(weight, 0.4, 0.6) - 0.5'") + rule)
    made = film_of(network, list(snapshots_of(network.network, network.run(), range(5))))
    assert made.line_ends[:, 0].tolist() == [1, 1, 0, -1, -1]
    text = AnimatedSvgRenderer().animate(made, ".svg").decode()
    assert 'class="none" display="none"' in text
    assert ".nil>.both>.none{display:inline}" in text
    painter = Painter(Moving(made))
    for frame in range(5):
        alone = paint(still(made, frame))
        assert np.abs(painter.paint(frame).astype(int) - alone.astype(int)).max() <= 2
