"""Weights that are set by hand: as an event of the spec sets them, in each backend, and offered by the page."""

from __future__ import annotations

import numpy as np
import pytest
from small_specs import compiled

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import SourceError
from neurovis_spec.live.turns import Set, Turn, Turned, Weigh, taken
from neurovis_spec.live.view import view_of
from neurovis_spec.live.weights import NO_RANGE, ranges_of
from neurovis_spec.runtime import signals
from neurovis_spec.runtime.errors import RecordingError, UnknownNameError
from neurovis_spec.runtime.simulation import ParameterError
from neurovis_spec.scene.collapse import gathered

SPEC = """
parameters: {g: 0.5, top: 1}
neurons:
  S: {count: 2, bias: 0.3, activation: tanh}
  K: {count: 2, activation: tanh}
  L: {activation: tanh}
connections:
  S -> K: {weight: 0.4, pattern: all_to_all, delay: 3}
  K -> S: {weight: {transpose: S -> K}, delay: 2}
  K -> K: {weight: 0.2, pattern: chain, symmetric: true}
  K1 -> K1: {weight: g, delay: 1}
  S2 -> L: {weight: 0.5, plasticity: {hebbian: {rate: 0.01}}, bounds: [-0.5, top]}
"""
#: Weights that are set at steps.
GIVEN = {
    2: ("S1 -> K2", 0.7),
    4: ("K1 -> K1", -0.3),
    5: ("K1 -> K2", 0.6),
    7: ("S2 -> L", 0.25),
    9: ("S1 -> K2", 0),
}


@pytest.mark.parametrize("shares", [False, True])
@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_by_hand_a_weight_is_what_an_event_makes_it(
    backend: str, shares: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if shares:  # of what is under way, as connections do whose weights nothing in the spec changes
        monkeypatch.setattr(signals, "LEAST_SAVED", 0)
    events = "".join(f"  - {{at: {at}, set: {{{name}: {value}}}}}\n" for at, (name, value) in GIVEN.items())
    run = compiled(f"{SPEC}events:\n{events}").run(14, backend=backend)
    simulation = compiled(SPEC).simulator(backend=backend)
    assert not shares or signals.signal_layout(simulation.network).shares.any()
    for step in range(14):
        if step in GIVEN:
            simulation.set_weight(*GIVEN[step])
        weights = simulation.connection_weights
        simulation.step()
        assert simulation.activity.tobytes() == run.activity[step].tobytes(), step
        assert weights.tobytes() == run.all_weights(step).tobytes(), step


@pytest.mark.parametrize(
    ("name", "value", "error", "words"),
    [
        ("S2 -> L", 1.5, ParameterError, "a weight would be above its bound of 1"),
        ("S2 -> L", -0.6, ParameterError, "a weight would be below its bound of -0.5"),
        ("S1 -> K2", np.nan, ParameterError, "a weight is a finite number, not nan"),
        ("S1", 0.3, UnknownNameError, "'S1' is no connection: write FROM -> TO"),
        ("S1 -> Q", 0.3, UnknownNameError, "no neuron, group or output 'Q'"),
    ],
)
def test_what_cannot_be_a_weight_is_refused(name: str, value: float, error: type[Exception], words: str) -> None:
    simulation = compiled(SPEC).simulator()
    before = simulation.connection_weights
    with pytest.raises(error, match=words):
        simulation.set_weight(name, value)
    assert np.array_equal(simulation.connection_weights, before)


def test_a_recording_holds_what_its_network_can_change_and_nothing_else_is_set_meanwhile() -> None:
    simulation = compiled(SPEC).simulator(record=True)
    simulation.set_weight("S2 -> L", 0.3)
    with pytest.raises(RecordingError, match="has one weight of 'K1 -> K1' for all steps"):
        simulation.set_weight("K1 -> K1", 0.3)


def test_at_one_step_weights_come_after_parameters_as_in_the_spec() -> None:
    network = compiled(SPEC)
    source = SimulatedSource(network.simulator())
    turns: list[Turn] = [Weigh("K1 -> K1", 0.1), Weigh("S2 -> L", 0.9), Set({"g": 0.8}), Set({"g": 0.7})]
    for turn in turns:
        source.turn(turn)
    assert [entry.turn for entry in source.turned] == [turns[3], *turns[:2]]
    source.advance()
    weights = dict(zip(network.network.connection_names, source.seen().snapshot.weights.tolist(), strict=True))
    assert weights["K1 -> K1"] == 0.1
    with pytest.raises(SourceError, match="above its bound"):
        source.turn(Weigh("S2 -> L", 1.2))
    source.turn(Weigh("S2 -> L", 0.9))
    before = source.seen().snapshot.weights, source.parameters, source.turned
    with pytest.raises(SourceError, match=r"above its bound of 0\.5"):
        source.turn(Set({"top": 0.5}))
    assert source.parameters == before[1]
    assert source.turned == before[2]
    assert taken([], Turned(3, turns[0])) == [Turned(3, turns[0])]


def test_a_slider_goes_within_the_bounds_of_a_weight_or_as_far_as_the_largest_of_its_entry() -> None:
    network = compiled(SPEC)
    found = ranges_of(gathered(network.network, ()))
    names, ranges, ranged = network.network.connection_names, found["ranges"], found["ranged"]
    assert isinstance(ranges, list)
    assert isinstance(ranged, list)
    of = {name: ranges[ranged[place]] for place, name in enumerate(names)}
    assert of["S2 -> L"] == [-0.5, 1.0, 0.5]
    assert of["S1 -> K1"] == [None, None, 0.4]
    collapsed = nv.compile_text(f"neurovis: 1\nname: x\n{SPEC}render: {{collapse: [S]}}\n")
    lines = ranges_of(gathered(collapsed.network, collapsed.network.render.collapse))["ranged"]
    assert isinstance(lines, list)
    assert NO_RANGE in lines
    assert isinstance(collapsed, CompiledNetwork)


def test_a_cell_of_the_matrix_shows_a_weight_though_what_is_learned_has_no_bound() -> None:
    made = compiled("""
neurons: {A: {bias: 0.4}, B: {}, C: {}}
connections:
  A -> B: {weight: 1}
  A -> C: {weight: -0.3, plasticity: {hebbian: {rate: 0.01}}}
render: {gain: {activity: 1, signal: 1, thickness: 2.5, change: 1}}
""")
    view, source = view_of(made, made.gains), SimulatedSource(made.simulator())
    assert [scale.reaches for scale in made.gains.thickness_scales] == [np.inf]
    large, small = view.glance(source.seen()).kinds[:2] // 8
    assert large > small > 0
