"""Sources of the live view: going on and back is exact, turns are taken again, memory is bounded."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.live.carry import carried
from neurovis_spec.live.past import EVERY, Kept, Past
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import Reach, Seen, SourceError
from neurovis_spec.live.turns import Feed, Hold, Learn, Lesion, Mend, Release, Set, Turn, Turned, rules
from neurovis_spec.scene.fading import Fading, snapshots_of

SPEC = """neurovis: 1
name: live
time: {dt: 0.05, steps: 40}
parameters: {mix: 0.5, pull: {value: 0.1, min: 0, max: 1}}
inputs: {push: {}}
neurons:
  A: {count: 3, activation: tanh, noise: "normal(0, 0.05)"}
  B: {activation: tanh, input: push}
connections:
  A -> A: {pattern: all_to_all, weight: "uniform(-1, 1)", delay: 2}
  A -> B: {weight: mix, plasticity: {hebbian: {rate: 0.05}}}
  B -> B: pull
events:
  - {at: 30, lesion: [A2]}
  - {at: 50, mend: [A2]}
  - {at: 50, set: {pull: 0.2}}
"""


def network(text: str = SPEC) -> nv.CompiledNetwork:
    return nv.compile_text(text)


def same(one: Seen, other: Seen) -> bool:
    a, b = one.snapshot, other.snapshot
    before = (a.previous_weights is None) == (b.previous_weights is None)
    if a.previous_weights is not None and b.previous_weights is not None:
        before = np.array_equal(a.previous_weights, b.previous_weights)
    return bool(
        a.step == b.step
        and before
        and np.array_equal(a.activity, b.activity)
        and np.array_equal(a.weights, b.weights)
        and np.array_equal(one.lesioned_neurons, other.lesioned_neurons)
        and np.array_equal(one.lesioned_connections, other.lesioned_connections)
        and np.array_equal(one.clamped, other.clamped)
    )


TURNS: dict[int, Turn] = {
    20: Set({"pull": 0.7}),
    70: Lesion("A1"),
    100: Mend("A1"),
    101: Hold("A3", 0.25),
    130: Release("A3"),
    140: Learn("A -> B", False),
}


def driven(source: SimulatedSource, steps: int) -> dict[int, Seen]:
    """What is seen of each step, with all turns taken."""
    seen = {source.step: source.seen()}
    while source.step < steps:
        source.advance()
        if source.step in TURNS:
            source.turn(TURNS[source.step])
        seen[source.step] = source.seen()
    return seen


def test_what_is_seen_is_what_a_recording_holds() -> None:
    compiled = network()
    recording = compiled.run(steps=120)
    source = SimulatedSource(compiled.simulator())
    for step in range(120):
        seen, known = source.seen().snapshot, recording.snapshot(step)
        assert np.array_equal(seen.activity, known.activity)
        assert np.array_equal(seen.weights, known.weights)
        assert (seen.previous_weights is None) == (step == 0)
        if known.previous_weights is not None and seen.previous_weights is not None:
            assert np.array_equal(seen.previous_weights, known.previous_weights)
        source.advance()


def test_it_goes_back_and_on_exactly_with_what_was_turned_on_the_way() -> None:
    source = SimulatedSource(network().simulator())
    seen = driven(source, 3 * EVERY)
    assert source.reach == Reach(0, 3 * EVERY)
    order = [*range(3 * EVERY, -1, -7), *range(0, 3 * EVERY, 11), EVERY, EVERY - 1, EVERY + 1, 0, 20, 21, 19, 20, 101]
    for step in order:
        source.go(step)
        assert same(source.seen(), seen[step]), step
    source.go(0)
    for step in range(1, 3 * EVERY + 1):
        assert source.advance()
        assert same(source.seen(), seen[step]), step
    assert [entry.step for entry in source.turned] == list(TURNS)
    source.go(100)
    assert [entry.step for entry in source.turned] == [20, 70, 100]


def test_a_turn_in_the_past_makes_another_future() -> None:
    source = SimulatedSource(network().simulator())
    seen = driven(source, 150)
    source.go(60)
    source.turn(Lesion("B"))
    assert source.reach == Reach(0, 60)
    assert source.seen().lesioned_neurons.tolist() == [False, False, False, True]
    source.advance()
    assert source.seen().snapshot.activity[3] == 0 != seen[61].snapshot.activity[3]
    source.go(59)
    assert same(source.seen(), seen[59])
    source.go(30)
    source.branch()
    assert source.reach == Reach(0, 30)
    assert [entry.step for entry in source.turned] == [20]
    source.restart()
    assert (source.step, source.reach, source.turned) == (0, Reach(0, 0), ())


def test_an_input_is_fed_until_its_source_has_it_again() -> None:
    compiled = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {A: {activation: identity, input: push}}\ninputs: {push: {}}"
    )
    source = SimulatedSource(compiled.simulator())
    source.turn(Feed("push", (0.5,)))
    source.advance()
    assert source.seen().snapshot.activity.tolist() == [0.5]
    source.turn(Feed("push"))
    source.advance()
    assert source.seen().snapshot.activity.tolist() == [0.0]
    source.go(1)
    assert source.seen().snapshot.activity.tolist() == [0.5]


@pytest.mark.parametrize(
    "turn",
    [
        *(Set({"gian": 1.0}), Set({"pull": 7.0}), Feed("pull", (1.0,)), Feed("push", (1.0, 2.0)), Hold("Q", 0.0)),
        *(Lesion("Q"), Mend("Q -> B"), Learn("A -> A", False)),
    ],
)
def test_what_cannot_be_turned_is_refused_and_changes_nothing(turn: Turn) -> None:
    source = SimulatedSource(network().simulator())
    seen = driven(source, 5)
    source.go(3)
    with pytest.raises(SourceError):
        source.turn(turn)
    assert source.reach == Reach(0, 5)
    source.advance()
    assert same(source.seen(), seen[4])


def test_the_past_takes_bounded_memory_and_says_how_far_back_it_reaches() -> None:
    compiled = network()
    size = Kept(compiled.simulator().state(), {}, Fading(compiled.network)).size
    source = SimulatedSource(compiled.simulator(), room=3 * size + size // 2)
    seen = driven(source, 10 * EVERY)
    assert source.reach == Reach(8 * EVERY + 1, 10 * EVERY)
    for step in (8 * EVERY + 1, 9 * EVERY, 8 * EVERY + 5):
        source.go(step)
        assert same(source.seen(), seen[step])
    with pytest.raises(SourceError, match="the past goes from step 513 to 640"):
        source.go(8 * EVERY)
    source.restart()
    assert same(source.seen(), seen[0])


def test_the_room_is_of_the_bytes_that_states_hold() -> None:
    simulation = network().simulator()
    past = Past(room=1)
    for _ in range(3):
        past.keep(Kept(simulation.state(), {}, Fading(simulation.network)))
        simulation.step()
    assert len(past) == 1
    assert past.first == 2
    assert past.taken == Kept(simulation.state(), {}, Fading(simulation.network)).size


def test_a_recording_is_gone_through_row_by_row() -> None:
    compiled = network()
    source = RecordedSource(compiled.network, compiled.run(steps=61, every=10))
    assert (source.step, source.reach) == (0, Reach(0, 60))
    steps = [source.step]
    while source.advance():
        steps.append(source.step)
    assert steps == [0, 10, 20, 30, 40, 50, 60]
    assert source.number_after(-1) == 50
    assert source.number_after(1) == 60
    source.go(31)
    assert source.step == 40
    assert source.seen().lesioned_neurons.tolist() == [False, True, False, False]
    with pytest.raises(SourceError):
        source.go(61)
    with pytest.raises(SourceError):
        source.branch()
    with pytest.raises(SourceError):
        source.turn(Lesion("B"))


def test_of_values_given_while_one_is_dragged_or_at_one_step_the_last_is_the_turn() -> None:
    source = SimulatedSource(network().simulator())
    for value in (0.3, 0.4, 0.6):
        source.turn(Set({"pull": value}, moving=True))
        source.advance()
    source.turn(Set({"pull": 0.9}))
    assert [*source.turned] == [Turned(3, Set({"pull": 0.9}))]
    source.turn(Set({"pull": 1.0}))
    assert [*source.turned] == [Turned(3, Set({"pull": 1.0}))]
    source.turn(Set({"mix": 1.0}))
    source.advance()
    source.turn(Set({"mix": 2.0}))
    for value in (0.1, 0.2):
        source.turn(Hold("B", value, moving=True))
        source.advance()
    source.turn(Feed("push", (1.0,)))
    assert [*source.turned][1:] == [
        Turned(3, Set({"mix": 1.0})), Turned(4, Set({"mix": 2.0})),
        Turned(5, Hold("B", 0.2, moving=True)), Turned(6, Feed("push", (1.0,))),
    ]  # fmt: skip
    source.go(1)
    assert [*source.turned] == [Turned(1, Set({"pull": 0.4}, moving=True))]
    assert source.parameters["pull"] == 0.4
    source.go(2)
    source.advance()
    assert source.parameters["pull"] == 1.0


def test_it_says_what_is_fed_and_which_rules_are_carried_out() -> None:
    source = SimulatedSource(network().simulator())
    assert source.learning == {"A -> B": True}
    source.advance()
    source.turn(Feed("push", (0.5,)))
    source.turn(Learn("A1 -> B", False))
    assert source.fed == {"push": (0.5,)}
    assert source.learning == {"A -> B": None}
    source.advance()
    source.turn(Learn("A -> B", False))
    assert source.learning == {"A -> B": False}
    source.go(0)
    assert (source.fed, source.learning) == ({}, {"A -> B": True})


MANY_RULES = """neurovis: 1
name: rules
modules:
  leg: {neurons: {K: {count: 2}, O: {}}, connections: {K -> O: {plasticity: {hebbian: {rate: 0.1}}}, O -> K: 1}}
neurons: {A: {}, B: {}, C: {count: 3}}
instances: {left: {module: leg, count: 2}, right: {module: leg}}
connections:
  - A -> B: {plasticity: {hebbian: {rate: 0.1}}}
  - A -> B: {plasticity: {oja: {rate: 0.1}}}
  - A -> left1.K: {pattern: all_to_all, plasticity: {oja: {rate: 0.1}}}
  - A + C1..C2 -> left.K: {pattern: all_to_all, plasticity: {oja: {rate: 0.1}}}
  - B -> C: {pattern: all_to_all}
"""


def test_each_rule_has_a_reference_that_stops_it() -> None:
    compiled = network(MANY_RULES)
    found = rules(compiled.network)
    assert [rule.connections for rule in found] == [
        "A -> B", "A -> left1.K", "A + C1..C2 -> left.K",
        "left1.K -> left1.O", "left2.K -> left2.O", "right.K -> right.O",
    ]  # fmt: skip
    assert found[0].written == "hebbian(rate=0.1); oja(rate=0.1)"
    for rule in found:
        source = SimulatedSource(compiled.simulator())
        source.turn(Learn(rule.connections, False))
        assert source.learning[rule.connections] is False


def test_what_is_clamped_by_events_and_by_hand_is_seen() -> None:
    events = "  - {from: 5, to: 9, clamp: {A1..A2: 0}}\n  - {from: 7, to: 8, clamp: {A2 + B: 0}}\n"
    compiled = network(SPEC + events)
    source = SimulatedSource(compiled.simulator())
    recorded = RecordedSource(compiled.network, compiled.run(12))
    wanted = {4: [], 5: [0, 1], 6: [0, 1], 7: [0, 1, 3], 8: [0, 1], 9: []}
    for step, clamped in wanted.items():
        source.go(0)
        while source.step < step:
            source.advance()
        recorded.go(step)
        for one in (source, recorded):
            assert np.flatnonzero(one.seen().clamped).tolist() == clamped, (step, one)
    source.turn(Hold("A3", 0.5))
    assert np.flatnonzero(source.seen().clamped).tolist() == [2]
    source.turn(Release("A"))
    assert not source.seen().clamped.any()


def test_an_edited_comment_changes_nothing() -> None:
    source, known = SimulatedSource(network().simulator()), SimulatedSource(network().simulator())
    driven(source, 80)
    seen = driven(known, 200)
    assert len(seen) == 201
    other = carried(source, network(SPEC + "# a comment\n").simulator())
    assert other.step == 80
    now, then = other.seen().snapshot, seen[80].snapshot
    assert np.array_equal(now.activity, then.activity)
    assert np.array_equal(now.weights, then.weights)
    while other.step < 200:
        other.advance()
        if other.step in TURNS:
            other.turn(TURNS[other.step])
        assert same(other.seen(), seen[other.step])


def test_what_was_lesioned_for_a_while_has_nothing_under_way_in_an_edited_network_either() -> None:
    source, known = SimulatedSource(network().simulator()), SimulatedSource(network().simulator())
    for one in (source, known):
        one.go(0)
        while one.step < 10:
            one.advance()
        one.turn(Lesion("A3 -> A1"))
        while one.step < 20:
            one.advance()
        one.turn(Lesion("A2 -> A1"))
    other = carried(source, network(SPEC + "# a comment\n").simulator())
    for one in (other, known):
        one.turn(Mend("A2 -> A1"))
        one.turn(Mend("A3 -> A1"))
    for _ in range(5):
        other.advance()
        known.advance()
        assert same(other.seen(), known.seen())


def test_an_edited_network_goes_on_at_its_step_with_what_it_has_learned() -> None:
    source = SimulatedSource(network().simulator())
    driven(source, 60)
    learned = {name: source.seen().snapshot.weights[i] for i, name in enumerate(source.network.connection_names)}
    edited = (
        SPEC.replace("count: 3", "count: 2").replace("lesion: [A2]", "lesion: [A1]").replace("mend: [A2]", "mend: [B]")
    )
    edited = edited.replace("  B -> B: pull", "  B -> B: pull\n  B -> C: 0.7").replace(
        "connections:", "  C: {}\nconnections:"
    )
    other = carried(source, network(edited).simulator())
    assert other.step == 60
    weights = dict(zip(other.network.connection_names, other.seen().snapshot.weights.tolist(), strict=True))
    for name in ("A1 -> B", "A2 -> B"):
        assert weights[name] == learned[name] != 0.5
    assert weights["B -> C"] == 0.7
    assert other.seen().lesioned_neurons.tolist() == [True, False, False, False]
    assert other.parameters == {"mix": 0.5, "pull": 0.2}
    other.restart()
    assert other.step == 0
    assert other.parameters == {"mix": 0.5, "pull": 0.1}


def test_a_network_without_a_neuron_of_the_old_one_begins_anew() -> None:
    source = SimulatedSource(network().simulator())
    driven(source, 10)
    other = carried(source, nv.compile_text("neurovis: 1\nname: y\nneurons: {Z: {activation: tanh}}").simulator())
    assert other.step == 0


def test_what_spikes_is_seen_to_fade_in_both_sources_and_after_going_back() -> None:
    spiking = (
        "neurovis: 1\nname: s\ntime: {dt: 0.01, steps: 200}\nneurons: {A: {model: integrate_and_fire, bias: 0.15}}"
    )
    compiled = nv.compile_text(spiking)
    recording = compiled.run(steps=200)
    source, recorded = SimulatedSource(compiled.simulator()), RecordedSource(compiled.network, recording)
    shown = []
    for snapshot in snapshots_of(compiled.network, recording, range(200)):
        seen, again = source.seen().snapshot, recorded.seen().snapshot
        assert snapshot.seen is not None
        assert seen.seen is not None
        assert again.seen is not None
        assert seen.seen == pytest.approx(snapshot.seen, abs=1e-12)
        assert again.seen == pytest.approx(snapshot.seen, abs=1e-4)
        shown.append(float(seen.seen[0]))
        source.advance()
        recorded.advance()
    assert any(0 < value < 1 for value in shown)
    for step in (150, 64, 63, 65, 1, 199):
        source.go(step)
        again = source.seen().snapshot
        assert again.seen is not None
        assert float(again.seen[0]) == shown[step]


def test_events_that_do_not_go_with_what_was_turned_are_told_and_it_goes_on() -> None:
    compiled = nv.compile_text(
        "neurovis: 1\nname: e\ntime: {steps: 9}\nparameters: {a: {value: 1, max: 3}, b: 0}\n"
        "neurons: {A: {bias: a}}\nevents: [{at: 5, set: {a: a + 1}}]"
    )
    source = SimulatedSource(compiled.simulator())
    source.turn(Set({"a": 2.5}))
    while source.step < 3:
        source.advance()
    with pytest.warns(RuntimeWarning, match="the events at step 5"):
        source.advance()
    assert source.step == 4
    source.advance()
    assert source.parameters["a"] == 2.5


def test_turns_are_gone_back_before_and_taken_again() -> None:
    source = SimulatedSource(network().simulator())
    driven(source, 21)
    assert [entry.step for entry in source.turned] == [20]
    source.go(3)
    assert not source.turned
    source.go(21)
    assert [entry.step for entry in source.turned] == [20]


def test_of_a_recording_what_events_mend_is_seen_whole_again() -> None:
    compiled = network()
    source, simulated = RecordedSource(compiled.network, compiled.run(60)), SimulatedSource(compiled.simulator())
    for step in (35, 55, 29, 59, 30):
        while simulated.reach.last < step:
            simulated.go(simulated.reach.last)
            simulated.advance()
        simulated.go(step)
        source.go(step)
        seen, known = source.seen(), simulated.seen()
        assert np.array_equal(seen.lesioned_neurons, known.lesioned_neurons)
        assert np.array_equal(seen.lesioned_connections, known.lesioned_connections)
        one, other = source.after(), simulated.after()
        assert one.weights.tobytes() == other.weights.tobytes()
        assert (one.reached, one.set_parameters) == (other.reached, other.set_parameters)
        assert np.array_equal(one.lesioned_neurons, other.lesioned_neurons)


def test_events_that_do_not_go_with_what_was_turned_are_left_out_of_an_edited_network_too() -> None:
    spec = (
        "neurovis: 1\nname: e\ntime: {steps: 9}\nparameters: {a: {value: 1, max: 3}, b: 0}\n"
        "neurons: {A: {bias: a}}\nevents: [{at: 5, set: {a: a + 1}}]"
    )
    source = SimulatedSource(nv.compile_text(spec).simulator())
    source.turn(Set({"a": 2.5}))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(7):
            source.advance()
        other = carried(source, nv.compile_text(spec).simulator())
    assert (other.step, other.parameters["a"]) == (7, 2.5)


def test_an_edit_goes_on_where_only_the_newest_state_is_kept() -> None:
    source = SimulatedSource(network().simulator(), room=1)
    driven(source, 70)
    source.turn(Set({"pull": 0.9}))
    other = carried(source, network().simulator())
    source = SimulatedSource(network().simulator())
    driven(source, 70)
    source.turn(Set({"pull": 0.9}))
    source.advance()
    assert other.step == 71
    assert same(replace(other.seen(), snapshot=replace(other.seen().snapshot, previous_weights=None)),
                replace(source.seen(), snapshot=replace(source.seen().snapshot, previous_weights=None)))  # fmt: skip
