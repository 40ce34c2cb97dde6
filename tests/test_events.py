"""Events: what is set, clamped and lesioned during a run, on both backends, held to plain computations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.recording import Recording

HEAD = "neurovis: 1\nname: x\ntime: {steps: 20}\n"
CHAIN = (
    HEAD
    + """
parameters: {gain: 2, push: 1}
inputs: {s: {expression: push}}
neurons: {A: {input: s}, B: {}, C: {}}
connections:
  A -> B: gain
  B -> C: {weight: 0.5, delay: 3}
"""
)
BACKENDS = pytest.mark.parametrize("backend", ["reference", "numpy"])


def run(text: str, backend: str, steps: int = 20) -> Recording:
    """The run, which must be the same step by step."""
    network = nv.compile_text(text)
    recording = network.run(steps, backend=backend)
    simulation = network.simulator(backend)
    for k in range(steps):
        simulation.step()
        np.testing.assert_array_equal(simulation.activity, recording.activity[k])
        if k + 1 < steps:
            np.testing.assert_array_equal(simulation.weights, recording.weights[k + 1])
    return recording


@BACKENDS
def test_a_parameter_is_set_from_a_step_on(backend: str) -> None:
    recording = run(CHAIN + "events: [{at: 5, set: {gain: 3}}, {at: 9, set: {push: 10*gain}}]", backend)
    # The signal w·a is formed when it leaves: with the new gain at step 5, so it arrives at step 6.
    assert recording["A"].tolist() == [1.0] * 9 + [30.0] * 11
    assert recording["B"].tolist() == [0.0] + [2.0] * 5 + [3.0] * 4 + [90.0] * 10
    assert recording["C"][3:].tolist() == (0.5 * recording["B"][:-3]).tolist()
    assert recording.weight("A -> B")[[4, 5]].tolist() == [2.0, 3.0]  # it can change: the record holds it
    assert "A -> B" in [recording.connection_names[index] for index in recording.plastic]


@BACKENDS
def test_a_clamp_lasts_until_its_end_and_the_state_goes_on(backend: str) -> None:
    text = (
        HEAD
        + """
inputs: {s: {expression: 1}}
neurons: {A: {input: s, model: {leaky_integrator: {leak: 0.5}}}, B: {}}
connections: {A -> B: 1}
events:
  - {from: 3, to: 6, clamp: {A: -1}}
  - {from: 10, clamp: {B: 7}}
"""
    )
    recording = run(text, backend)
    free = 1 - 0.5 ** np.arange(1, 21)
    expected = np.where((np.arange(20) >= 3) & (np.arange(20) < 6), -1.0, free)
    np.testing.assert_allclose(recording["A"], expected, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(recording["B"][10:], 7.0)
    np.testing.assert_array_equal(recording["B"][1:10], recording["A"][:9])


@BACKENDS
def test_a_clamp_goes_before_initial(backend: str) -> None:
    text = HEAD + "neurons: {A: {initial: 0.5, bias: 2}}\nevents: [{from: 0, to: 2, clamp: {A: 3}}]"
    assert run(text, backend)["A"][:4].tolist() == [3.0, 3.0, 2.0, 2.0]


@BACKENDS
def test_a_lesion_drops_what_is_under_way(backend: str) -> None:
    recording = run(CHAIN + "events: [{at: 8, lesion: [B -> C]}]", backend)
    assert recording["C"][:8].tolist() == [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]
    assert recording["C"][8:].tolist() == [0.0] * 12
    assert (recording.weight("B -> C") == 0.5).all()


@BACKENDS
def test_a_lesioned_neuron_is_silent_and_so_are_its_connections(backend: str) -> None:
    recording = run(CHAIN + "events: [{at: 8, lesion: B}]", backend)
    assert recording["B"][7] == 2
    assert (recording["B"][8:] == 0).all()
    assert (recording["C"][8:] == 0).all()


@BACKENDS
def test_a_lesion_is_no_factor_and_no_term(backend: str) -> None:
    text = (
        HEAD
        + """
neurons: {A: {count: 2, bias: 3}, P: {combine: product}, D: {combine: distance}}
connections:
  A -> P: {weight: 1, delay: 0}
  A -> D: {centre: 1, delay: 0}
events: [{at: 4, lesion: A2}]
"""
    )
    recording = run(text, backend)
    assert recording["P"][[3, 4]].tolist() == [9.0, 3.0]
    np.testing.assert_allclose(recording["D"][[3, 4]], [np.sqrt(8), 2.0])


@BACKENDS
def test_what_is_lesioned_of_a_rule_keeps_its_weights_and_the_rest_goes_on(backend: str) -> None:
    text = (
        HEAD
        + """
rules:
  counting:
    state: {total: {each_step: total + pre}}
    weight: {each_step: weight + 0.01 * total}
neurons: {A: {count: 3, bias: i + 1}, O: {}}
connections:
  A -> O: {weight: 0, delay: 2, plasticity: counting}
events: [{at: 6, lesion: A3 -> O}]
"""
    )
    recording = run(text, backend)
    for i, name in enumerate(("A1 -> O", "A2 -> O", "A3 -> O")):
        weight, total, expected = 0.0, 0.0, []
        for k in range(20):
            expected.append(weight)
            if name == "A3 -> O" and k >= 6:
                continue
            pre = i + 1.0 if k >= 2 else 0.0
            weight, total = weight + 0.01 * total, total + pre
        np.testing.assert_allclose(recording.weight(name), expected, rtol=0, atol=1e-14)


@BACKENDS
def test_plastic_weights_stay_when_a_parameter_is_set(backend: str) -> None:
    text = (
        HEAD
        + """
parameters: {rate: 0.1, first: 0.5}
neurons: {A: {bias: 1}, O: {}}
connections: {A -> O: {weight: first, plasticity: {hebbian: {rate: rate}}}}
events: [{at: 5, set: {rate: 0, first: 9}}]
"""
    )
    weight = run(text, backend).weight("A -> O")
    assert weight[5] > weight[2] > 0.4
    assert (weight[5:] == weight[5]).all()


def test_where_an_event_stands_does_not_show_in_the_hash() -> None:
    text = CHAIN + "events: [{at: 2, set: {gain: 3, push: 2*gain}}]\n"
    moved = text.replace("parameters:", "\n# a comment\n\nparameters:").replace("gain: 3", "gain:   3.0")
    assert nv.compile_text(text).hash == nv.compile_text(moved).hash
    assert nv.compile_text(text).hash != nv.compile_text(text.replace("gain: 3", "gain: 4")).hash


#: A place that follows a parameter, and one that holds the same number.
PLACES = [
    "neurons: {A: {bias: P}}",
    "neurons: {A: {bias: 1, activation: {leaky_relu: {slope: P}}}}",
    "neurons: {A: {bias: 1, model: {leaky_integrator: {leak: P}}}}",
    "neurons: {A: {noise: 'normal(0, P)'}}",
    "neurons: {A: {input: s}}\ninputs: {s: {expression: P*k}}",
    "neurons: {A: {input: s}}\ninputs: {s: {values: [[1], [P]]}}",
    "neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: P}",
    "neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: {matrix: [[P]]}}",
    "neurons: {A: {bias: 1}, B: {combine: distance}}\nconnections: {A -> B: {centre: P}}",
    "neurons: {A: {bias: 1}, B: {bias: 1}}\nconnections: {A -> B: {plasticity: {hebbian: {rate: P}}}}",
    "neurons: {A: {bias: 1}, B: {bias: 1}}\nconnections: {A -> B: {plasticity: hebbian, bounds: [-9, 5*P]}}",
    "modules: {m: {parameters: {q: 1}, neurons: {A: {bias: q}}}}\ninstances: {x: {module: m, set: {q: P}}}",
    "neurons: {A: {bias: 1}}\nclamp: P",
]


@pytest.mark.parametrize("place", PLACES)
def test_networks_that_an_event_parts_have_other_hashes(place: str) -> None:
    """Both are the same until the parameter is set."""
    head = "neurovis: 1\nname: x\nparameters: {p: 0.5}\n"
    events = "events:\n  - {at: 3, set: {p: 0.75}}\n"
    place, _, clamp = place.partition("\nclamp: ")
    events += f"  - {{from: 2, clamp: {{A: {clamp}}}}}\n" if clamp else ""
    texts = [(f"{head}{place}\n{events}").replace("P", written) for written in ("p", "0.5", "0.50", "p + 0")]
    moves, stays, also, moved = (nv.compile_text(text).hash for text in texts)
    assert moves != stays
    assert stays == also
    if "expression" not in place and "noise" not in place:  # an input and a noise keep their formulas
        assert moves == moved


def test_clamps_and_lesions_show_in_the_hash() -> None:
    events = [
        "[]",
        "[{from: 3, clamp: {A: 1}}]",
        "[{from: 3, clamp: {A: 2}}]",
        "[{from: 3, clamp: {B: 1}}]",
        "[{from: 3, to: 9, clamp: {A: 1}}]",
        "[{at: 3, lesion: A}]",
        "[{at: 4, lesion: A}]",
        "[{at: 3, lesion: A -> B}]",
        "[{at: 3, lesion: B -> C}]",
    ]
    assert len({nv.compile_text(f"{CHAIN}events: {event}").hash for event in events}) == len(events)
    same = ["[{from: 3, clamp: {A: 1}}]", "[{from: 1 + 2, clamp: {A: push}}]"]
    assert len({nv.compile_text(f"{CHAIN}events: {event}").hash for event in same}) == 1


def test_events_show_in_the_hash_and_in_what_can_change(tmp_path: Path) -> None:
    plain = nv.compile_text(CHAIN)
    later, sooner = (nv.compile_text(CHAIN + f"events: [{{at: {at}, set: {{gain: 3}}}}]") for at in (5000, 50))
    assert len({plain.hash, later.hash, sooner.hash}) == 3
    assert later.run(10).plastic.tolist() == [0]  # an event that is not reached counts, too
    later.run(10).save(tmp_path / "x.npz")
    assert nv.load(tmp_path / "x.npz").weights.shape == (10, 1)


def test_setting_by_hand_and_by_an_event_go_together() -> None:
    simulation = nv.compile_text(CHAIN + "events: [{at: 5, set: {gain: 3}}]").simulator()
    for _ in range(3):
        simulation.step()
    simulation.set(push=2)
    for _ in range(5):
        simulation.step()
    assert simulation.weight("A -> B") == 3
    assert simulation.activity[:2].tolist() == [2.0, 6.0]
    simulation.reset()
    simulation.step()
    assert simulation.activity[0] == 1
    assert simulation.weight("A -> B") == 2


LEVEL = (
    HEAD
    + """
parameters: {level: 0.5, twice: 2*level}
neurons: {A: {bias: level}, S: {count: 2}}
events:
  - {at: 2, set: {level: 1}}
  - {from: 3, clamp: {S: level, S2: twice}}
  - {at: 6, set: {level: 3*level}}
"""
)


@BACKENDS
def test_what_is_clamped_follows_the_parameters(backend: str) -> None:
    recording = run(LEVEL, backend, 9)
    assert recording["A"].tolist() == [0.5] * 2 + [1.0] * 4 + [3.0] * 3
    assert recording["S"][:, 0].tolist() == [0.0] * 3 + [1.0] * 3 + [3.0] * 3
    assert recording["S"][:, 1].tolist() == [0.0] * 3 + [2.0] * 3 + [6.0] * 3


def test_a_clamp_that_a_parameter_makes_infinite_is_a_finding() -> None:
    with pytest.raises(nv.SpecError, match="infinite") as caught:
        nv.compile_text(LEVEL.replace("S: level", "S: 1/(level - 1)"))
    (finding,) = caught.value.diagnostics
    assert (finding.code, finding.span.line) == ("not-finite", 9)


@pytest.mark.parametrize("by_hand", range(8))
def test_what_is_set_by_hand_holds_until_a_later_event(by_hand: int) -> None:
    """Events up to the step at which something is set are past, those before the first step excepted."""
    simulation = nv.compile_text(LEVEL).simulator()
    seen = []
    for k in range(9):
        if k == by_hand:
            simulation.set(level=7)
        simulation.step()
        seen.append(simulation.activity.tolist())
    level = 0.5
    for k in range(9):
        level = {2: 1.0, 6: 3 * level}.get(k, level)
        level = 7.0 if k == by_hand else level
        assert seen[k] == [level, level if k >= 3 else 0.0, 2 * level if k >= 3 else 0.0]


@BACKENDS
def test_rates_of_instances_part_and_meet(backend: str) -> None:
    """Instances learn by one rule each, whether their rates are equal or not."""
    begin = HEAD + "parameters: {p: 0.1}\nevents: [{at: 2, set: {p: 0}}, {at: 4, set: {p: 0.1}}]\n"
    neurons = "neurons: {A: {bias: 1}, B: {bias: 1}}"
    wires = "connections: {A -> B: {weight: 0, plasticity: {hebbian: {rate: RATE}}}}"
    module = f"modules: {{leg: {{parameters: {{r: 0.1}}, {neurons}, {wires.replace('RATE', 'r')}}}}}\n"
    recording = run(begin + module + "instances: {left: {module: leg, set: {r: p}}, right: {module: leg}}", backend)
    for side, rate in (("left", "p"), ("right", "0.1")):
        plain = run(f"{begin}{neurons}\n{wires.replace('RATE', rate)}", backend)
        assert recording.weight(f"{side}.A -> {side}.B").tolist() == plain.weight("A -> B").tolist()
    assert (np.diff(recording.weight("left.A -> left.B")) == 0).tolist()[:5] == [True, False, True, True, False]


def test_what_an_event_has_set_is_not_worked_out_anew() -> None:
    text = HEAD + "parameters: {a: 1, b: 1}\nneurons: {A: {bias: a}, B: {bias: b}}\nevents: [{at: 1, set: {a: 2*b}}]"
    simulation = nv.compile_text(text).simulator()
    simulation.step()
    simulation.step()
    simulation.set(b=5)
    simulation.step()
    assert simulation.activity.tolist() == [2.0, 5.0]


def test_events_come_again_after_a_state_of_an_earlier_step() -> None:
    """What was set by hand afterwards is no part of the state."""
    simulation = nv.compile_text(CHAIN + "events: [{at: 1, set: {gain: 3}}, {at: 4, set: {gain: 4}}]").simulator()
    for _ in range(2):
        simulation.step()
    early = simulation.state()
    for _ in range(4):
        simulation.step()
    simulation.set(push=2)
    simulation.restore(early)
    assert simulation.weight("A -> B") == 3
    gains, pushes = [], []
    for _ in range(4):
        simulation.step()
        gains.append(simulation.weight("A -> B"))
        pushes.append(simulation.activity[0])
    assert gains == [3.0, 4.0, 4.0, 4.0]
    assert pushes == [1.0] * 4


def warnings(text: str) -> list[tuple[str, int, int, str]]:
    """Code, line, column, message of each."""
    found = nv.compile_text(text).warnings
    return [(item.code, item.span.line, item.span.column, item.message) for item in found]


@pytest.mark.parametrize(
    "rest",
    [
        "neurons: {A: {initial: p, bias: 1}}",
        "neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: {weight: p, plasticity: hebbian}}",
        "neurons: {A: {bias: 1}}\nlayout: {positions: {A: [p, 0]}}",
        "neurons: {A: {bias: 1, position: [p, 0]}}",
        "neurons: {A: {bias: 'max(p, 20)'}}",
        "neurons: {A: {bias: 1}, N: {noise: 'normal(0, q)'}}",
        "neurons: {A: {bias: 1}}\nmodules: {m: {parameters: {r: 1}, neurons: {K: {bias: 1, initial: r}}}}\n"
        "instances: {x: {module: m, set: {r: p}}}",
    ],
)
def test_what_is_set_in_vain_is_a_warning(rest: str) -> None:
    head = HEAD + "parameters: {p: 2, q: 1}\n"
    found = warnings(f"{head}events: [{{at: 3, set: {{p: 5}}}}]\n{rest}\noutputs: {{o: A}}\n")
    assert ("no-effect", 5, 24, "setting 'p' changes nothing in the run") in found


@pytest.mark.parametrize(
    "rest",
    [
        "events: [{at: 3, set: {p: 2}}]\nneurons: {A: {initial: p, bias: 1}}",
        "events: [{at: 3, set: {p: 5}}]\nneurons: {A: {initial: p, bias: p}}",
        "events: [{at: 3, set: {p: 5}}, {at: 4, set: {r: p}}]\nneurons: {A: {bias: r}}",
        "events: [{at: 3, set: {p: 5}}, {from: 4, clamp: {A: q}}]\nneurons: {A: {bias: 1}}",
        "events: [{at: 3, set: {p: 5}}]\nneurons: {A: {input: s}}\ninputs: {s: {expression: q*k}}",
        "events: [{at: 3, set: {p: 5}}]\nneurons: {A: {noise: 'normal(0, q)'}}",
    ],
)
def test_what_is_set_to_some_effect_is_no_warning(rest: str) -> None:
    found = warnings(f"{HEAD}parameters: {{p: 2, q: 3*p, r: 1}}\n{rest}\n")
    assert not [item for item in found if item[0] == "no-effect"]


def test_what_is_set_twice_at_a_step_names_both_places() -> None:
    text = HEAD + "parameters: {g: 1}\nneurons: {A: {bias: g}}\nevents:\n"
    found = warnings(text + "  - {at: 2, set: {g: 2*g}}\n  - {at: 1, set: {g: 4}}\n  - {at: 2, set: {g: g + 1}}\n")
    beside = warnings(text + "  [{at: 2, set: {g: 2*g}}, {at: 2, set: {g: g + 1}}]\n")
    assert beside == [("no-effect", 7, 18, "'g' is set again at this step (column 42): what is set here is lost")]
    assert found == [("no-effect", 7, 19, "'g' is set again at this step (line 9): what is set here is lost")]


@pytest.mark.parametrize(
    ("event", "code", "column"),
    [
        ("{at: 5, set: {gian: 3}}", "unknown-parameter", 24),
        ("{at: -1, set: {gain: 3}}", "out-of-range", 15),
        ("{from: 5, set: {gain: 3}}", "bad-event", 11),
        ("{at: 5}", "bad-event", 11),
        ("{at: 5, clamp: {A: 0}}", "bad-event", 11),
        ("{from: 5, to: 4, clamp: {A: 0}}", "out-of-range", 24),
        ("{from: 5, clamp: {Q: 0}}", "unknown-neuron", 28),
        ("{at: 5, lesion: [A -> Q]}", "unknown-neuron", 32),
        ("{at: 5, lesion: [A -> C]}", "no-connection", 27),
        ("{at: 5, sett: {gain: 3}}", "unknown-key", 18),
        ("{set: {gain: 3}}", "bad-event", 11),
    ],
)
def test_findings(event: str, code: str, column: int) -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(CHAIN + f"events: [{event}]")
    found = [(d.code, d.span.column) for d in caught.value.diagnostics]
    assert found[0] == (code, column)
    assert caught.value.diagnostics[0].span.line == 11


def test_structural_parameters_cannot_be_set() -> None:
    text = HEAD + "parameters: {d: 2}\nneurons: {A: {}, B: {}}\nconnections: {A -> B: {delay: d}}\n"
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(text + "events: [{at: 1, set: {d: 3}}]")
    assert [d.code for d in caught.value.diagnostics] == ["structural-parameter"]


NEAR = "connections: {L -> L: {pattern: {nearest: {count: 1}}}}"


@pytest.mark.parametrize(
    "rest",
    [
        f"neurons: {{L: {{count: 3, position: [[p, 0], [1, 0], [9, 0]], bias: i}}}}\n{NEAR}",
        f"neurons: {{L: {{count: 3, position: ['q*i^2', 0], bias: i}}}}\n{NEAR}",
        "neurons: {L: {count: 2, bias: 1, position: [[0, 0], [3, 0]]}, K: {count: 2, position: [[1, p], [2, 0]]}}\n"
        "connections: {L -> K: {pattern: {nearest: {count: 1}}}}",
        "modules: {m: {parameters: {r: 1}, neurons: {L: {count: 3, position: [r*i^2, 0], bias: 1}}, "
        f"{NEAR}}}}}\n"
        "instances: {x: {module: m, set: {r: q}}}",
        "modules: {m: {parameters: {r: 1}, neurons: {L: {count: 3, position: [r*i^2, 0], bias: 1}}}}\n"
        "instances: {x: {module: m, set: {r: q}}}\n"
        "connections: {x.L -> x.L: {pattern: {nearest: {count: 1}}}}",
    ],
)
def test_positions_by_which_connections_are_there_cannot_be_set(rest: str) -> None:
    text = f"{HEAD}parameters: {{p: 2, q: 2*p}}\n{rest}\n"
    with pytest.raises(nv.SpecError, match="'p' cannot be set in a run") as caught:
        nv.compile_text(f"{text}events: [{{at: 2, set: {{p: 8}}}}]")
    assert [item.code for item in caught.value.diagnostics] == ["structural-parameter"]
    with pytest.raises(ValueError, match="'p' cannot be set in a run"):
        nv.compile_text(text).simulator().set(p=8)


def test_positions_by_which_weights_go_can_be_set() -> None:
    text = HEAD + "parameters: {p: 2}\nneurons: {A: {bias: 1, position: [0, 0]}, B: {position: [p, 0]}}\n"
    simulation = nv.compile_text(text + "connections: {A -> B: distance}").simulator()
    simulation.set(p=8)
    assert simulation.weight("A -> B") == 8


def test_set_changes_no_initial_activity() -> None:
    """§9: what is set at step 0 already changes the bias, but not the activity at step 0 that the group begins with."""
    text = "neurovis: 1\nname: x\nparameters: {g: 1}\nneurons: {A: {initial: g, bias: g}}\n"
    recording = nv.compile_text(text + "events: [{at: 0, set: {g: 2}}]").run(steps=3)
    assert recording["A"].tolist() == [1.0, 2.0, 2.0]
