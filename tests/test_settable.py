"""What is set in a run: all that depends on a parameter follows it, as if it had been compiled with that value."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import cast

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.simulation import ParameterError, Simulation
from neurovis_spec.runtime.state import State

HEAD = "neurovis: 1\nname: x\nseed: 3\nparameters: {p: 0.5, q: 2*p, r: {value: 0.25, min: 0, max: 4}}\n"
BACKENDS = pytest.mark.parametrize("backend", ["reference", "numpy"])
#: Specs in which numbers of all kinds follow ``p``, in all ways in which they can be written.
SPECS = {
    "bias": "neurons: {A: {count: 3, bias: p*i}, B: {bias: [p]}, C: {count: 3, bias: [1, p, q + p]}}",
    "drawn bias": "neurons: {A: {count: 3, bias: 'normal(p, q)'}, B: {count: 2, bias: [p, 'uniform(0, p)']}}",
    "activation": "neurons: {A: {count: 2, bias: -1, activation: {leaky_relu: {slope: [p, 0.1]}}}}",
    "shared activation": "neurons: {A: {count: 2, bias: -1, activation: {leaky_relu: {slope: p}}}, "
    "B: {bias: -2, activation: {leaky_relu: {slope: p}}}, C: {bias: -2, activation: leaky_relu}}",
    "model": "neurons: {A: {count: 3, bias: 1, model: {leaky_integrator: {leak: p/(i + 1)}}}}",
    "levels": "neurons: {A: {count: 3, bias: 1, model: {leaky_integrator: {leak: p/(i + 1)}}}}\n"
    "connections: {A1 -> A3: {weight: p, delay: 0}}",
    "weight": "neurons: {A: {count: 2, bias: 1}, B: {count: 3}}\n"
    "connections: {A -> B: {weight: p*i + j, pattern: all_to_all}}",
    "drawn weight": "neurons: {A: {count: 2, bias: 1}, B: {count: 3}}\n"
    "connections: {A -> B: {weight: 'normal(0, p)', pattern: all_to_all}}",
    "matrix": "neurons: {A: {count: 2, bias: 1}, B: {count: 3}}\n"
    "connections: {A -> B: {matrix: [[p, null, 1], [0, p, q*j]]}, "
    "B -> A: {matrix: [[p, 1, null], [null, 2, p + i]], rows: to}}",
    "edges": "neurons: {A: {count: 2, bias: 1}, B: {count: 3}}\n"
    "connections: {A -> B: {edges: [[A1, B1], [A2, B3, p], [A1, B2, q*i + 1, 2]]}}",
    "centre": "neurons: {A: {count: 2, bias: 1}, B: {count: 2, combine: distance}}\n"
    "connections: {A -> B: {centre: [[p, null], [0, q]]}}",
    "one centre": "neurons: {A: {count: 2, bias: 1}, B: {combine: distance}}\nconnections: {A -> B: {centre: p + i}}",
    "centre and matrix": "neurons: {A: {count: 2, bias: 1}, B: {count: 2, combine: distance}}\n"
    "connections: {A -> B: {matrix: [[1, p], [null, q]], centre: [[p, null], [0, q]]}}",
    "scale": "neurons: {A: {count: 3, bias: 1}}\n"
    "connections: {A -> A: {weight: 'normal(0, 1)', pattern: all_to_all, scale: {spectral_radius: p}}}",
    "scaled": "neurons: {A: {count: 3, bias: 1}, B: {count: 2}}\n"
    "connections: {A -> B: {weight: p + i*j, pattern: all_to_all, scale: {norm: 2}}}",
    "distance": "neurons: {A: {count: 2, bias: 1, position: [[p, 0], [1, q]]}, B: {count: 2, position: ['i*p', 3]}}\n"
    "connections: {A -> B: {weight: 1/distance, pattern: all_to_all}}",
    "rule": "neurons: {A: {count: 2, bias: 1}, B: {bias: 0.5}}\n"
    "connections: {A -> B: {weight: 0.1, plasticity: {hebbian: {rate: p*(i + 1)}}, bounds: [-p, 3*q]}}",
    "traces": "neurons: {A: {count: 2, bias: 1}, B: {bias: 0.5}}\n"
    "connections: {A -> B: {weight: 0.1, plasticity: {bcm: {rate: p, threshold_rate: 0.1}}}}",
    "table": "inputs: {s: {values: [[p, 1], [2, q]]}}\nneurons: {A: {count: 2, input: s}}",
    "expression": "inputs: {s: {expression: p*k + q}}\nneurons: {A: {input: s}}",
    "noise": "neurons: {A: {count: 2, noise: 'normal(q, p)'}}",
    "default": "activations:\n  twice: {parameters: {a: 1, b: 2*a}, value: a*x + b}\n"
    "neurons: {A: {count: 2, bias: 1, activation: {twice: {a: [p, 3]}}}}",
    "instances": "modules:\n  m:\n    parameters: {g: 1, h: g + 1}\n"
    "    neurons: {A: {bias: h, noise: 'normal(0, g)'}, B: {model: {leaky_integrator: {leak: h/9}}}, S: {input: s}}\n"
    "    inputs: {s: {expression: g*k}}\n"
    "    connections: {A -> B: g, B -> A: {weight: 0.1, plasticity: {oja: {rate: g/9}}}}\n"
    "instances: {l: {module: m, count: 2, set: {g: p*(i + 1)}}, r: {module: m, set: {h: q}}, o: {module: m}}",
    "nested": "modules:\n  k: {parameters: {g: 1}, neurons: {A: {bias: g}}}\n"
    "  m: {parameters: {g: 1}, instances: {x: {module: k, set: {g: 2*g}}}}\n"
    "instances: {l: {module: m, set: {g: p + q}}}",
}


@BACKENDS
@pytest.mark.parametrize("spec", SPECS)
def test_what_is_set_is_as_if_it_had_been_compiled_so(spec: str, backend: str) -> None:
    """From the first step on, where nothing has been learned yet; by hand, and by an event."""
    text = HEAD + SPECS[spec]
    wanted = nv.compile_text(text, p=0.75)
    before = nv.compile_text(text)
    simulation = before.simulator(backend)
    simulation.set(p=0.75)
    event = nv.compile_text(text + "\nevents: [{at: 0, set: {p: 0.75}}]").run(6, backend=backend)
    expected = wanted.run(6, backend=backend)
    assert not np.array_equal(expected.activity, before.run(6, backend=backend).activity)
    for k in range(6):
        simulation.step()
        np.testing.assert_array_equal(simulation.activity, expected.activity[k])
        np.testing.assert_array_equal(event.activity[k], expected.activity[k])
    assert simulation.parameters == wanted.parameters


@BACKENDS
@pytest.mark.parametrize("spec", SPECS)
def test_what_is_set_and_set_back_leaves_nothing(spec: str, backend: str) -> None:
    network = nv.compile_text(HEAD + SPECS[spec])
    simulation = network.simulator(backend)
    simulation.set(p=3.0, r=1)
    simulation.set(p=0.5)
    simulation.set({"r": 0.25})
    expected = network.run(6, backend=backend)
    for k in range(6):
        simulation.step()
        np.testing.assert_array_equal(simulation.activity, expected.activity[k])


def test_a_parameter_that_was_set_follows_no_other_any_more() -> None:
    simulation = nv.compile_text(HEAD + "neurons: {A: {bias: q}}").simulator()
    simulation.set(p=3)
    assert simulation.parameters["q"] == 6
    simulation.set(q=1)
    simulation.set(p=5)
    simulation.step()
    assert simulation.parameters["q"] == 1
    assert simulation.activity.tolist() == [1.0]


@pytest.mark.parametrize(
    ("spec", "values", "words"),
    [
        ("neurons: {A: {bias: p}}", {"r": 5}, "'r' is 5; its bounds are 0 to 4"),
        ("neurons: {A: {bias: 1/p}}", {"p": 0}, "a bias would be infinite"),
        (
            "neurons: {A: {count: 2, activation: {clip: {low: [p, 0], high: [1, p]}}}}",
            {"p": 2},
            "the parameter 'high' of an activation would be below its bound of 2",
        ),
        ("neurons: {A: {count: 2, bias: 'log(p - i/4)'}}", {"p": 0.2}, "a bias would be not finite"),
        ("neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: log(p)}", {"p": -1}, "a weight would be undefined"),
        (
            "neurons: {A: {bias: 1}}\nconnections: {A -> A: {weight: 0, plasticity: oja, bounds: [p - 3, 2]}}",
            {"p": 8},
            "a lower bound of weights would be above its bound of 2",
        ),
        (
            "neurons: {A: {bias: 1}}\nconnections: {A -> A: {weight: 1, plasticity: oja, bounds: [0, p + 1]}}",
            {"p": -4},
            "a lower bound of weights would be above its bound of -3",
        ),
        (
            "models:\n  own: {parameters: {a: {value: 0.1, max: 1}, b: {value: 2, min: 4*a}}, "
            "activity: a*f(drive) + b}\n"
            "neurons: {A: {count: 2, bias: 1, model: {own: {a: [0.25, p], b: 2}}}}",
            {"p": 0.75},
            "the parameter 'b' of a model would be below its bound of 3",
        ),
        ("neurons: {A: {noise: 'normal(0, p)'}}", {"p": -1}, "the spread of noise would be below its bound of 0"),
        (
            "neurons: {A: {count: 2, noise: 'uniform(i, q)'}}",
            {"p": 0.25},
            "the spread of noise would be below its bound of 0",
        ),
        (
            "neurons: {A: {count: 2}}\nconnections: {A -> A: {weight: p*j, pattern: all_to_all, scale: {norm: 1}}}",
            {"p": 0},
            "a weight would be not finite",
        ),
    ],
)
def test_values_that_a_network_cannot_have_change_nothing(spec: str, values: dict[str, float], words: str) -> None:
    text = HEAD + spec
    simulation = nv.compile_text(text).simulator()
    for _ in range(2):  # the second time by a function made for it
        with pytest.raises(ParameterError, match=words):
            simulation.set(values)
    assert simulation.parameters == nv.compile_text(text).parameters
    simulation.step()
    assert simulation.activity.tolist() == nv.compile_text(text).run(1).activity[0].tolist()
    name, value = next(iter(values.items()))
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(f"{text}\nevents:\n  - {{at: 7, set: {{{name}: {value}}}}}\n")
    (finding,) = caught.value.diagnostics
    line = len(text.splitlines()) + 2
    assert (finding.code, finding.span.line, finding.span.column) == ("out-of-range", line, 19)
    assert f"from step 7 on {words}" in finding.message


@pytest.mark.parametrize("bound", ["", "true", "[1]", "{}"])
def test_a_bound_that_is_none_is_a_finding_and_nothing_else(bound: str) -> None:
    text = f"neurovis: 1\nname: x\nparameters: {{g: {{value: 1, min: {bound}}}}}\nneurons: {{A: {{bias: g}}}}\n"
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(text + "events: [{at: 2, set: {g: 1}}]")
    assert [item.span.line for item in caught.value.diagnostics] == [3]


def test_a_parameter_without_a_value_is_a_finding_and_nothing_else() -> None:
    text = "neurovis: 1\nname: x\nparameters: {p: {}, q: 1}\nneurons: {A: {bias: q}}\n"
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(text + "events: [{at: 3, set: {p: p*0.5 + 0.1}}]")
    assert [item.span.line for item in caught.value.diagnostics] == [3]


def test_many_events_take_no_memory_each() -> None:
    """An event is what it sets, not a network of its own."""
    text = HEAD + "neurons: {A: {count: 300, bias: p}}\nconnections: {A -> A: {weight: p*i, pattern: all_to_all}}\n"
    events = "".join(f"  - {{at: {k}, set: {{p: {k}}}}}\n" for k in range(1, 101))
    network = nv.compile_text(text + "events:\n" + events).network
    arrays = [array for change in network.changes for array in change if isinstance(array, np.ndarray)]
    assert len(network.changes) == 100
    assert sum(array.size for array in arrays) == 0
    assert network.connections.weights[1] == 0.0


@BACKENDS
def test_what_is_clamped_lesioned_and_stopped_by_hand_is_as_by_events(backend: str, tmp_path: Path) -> None:
    text = HEAD + (
        "neurons: {A: {count: 3, bias: 1, model: {leaky_integrator: {leak: 0.3}}}, B: {count: 2}}\n"
        "connections: {A -> B: {weight: 0.5, delay: 2, pattern: all_to_all}, "
        "B -> A: {weight: 0.1, pattern: all_to_all, plasticity: {bcm: {rate: 0.1}}}}\n"
    )
    events = (
        "events:\n  - {from: 2, to: 5, clamp: {A1..A2: 0.5}}\n  - {at: 3, lesion: [B1, A3 -> B2]}\n"
        "  - {at: 4, learning: {B -> A: false}}\n  - {at: 6, learning: {B2 -> A: true}}\n"
        "  - {at: 7, mend: [B1, A3 -> B2]}\n"
        "  - {at: 8, learning: {B -> A: true}}\n"
    )
    simulation = nv.compile_text(text).simulator(backend)
    expected = nv.compile_text(text + events).run(15, backend=backend)
    for k in range(15):
        match k:
            case 2:
                simulation.clamp("A1..A2", 0.5)
            case 3:
                simulation.lesion("B1", "A3 -> B2")
            case 4:
                simulation.learning("B -> A", False)
            case 5:
                simulation.release("A1 + A2")
            case 6:
                simulation.learning("B2 -> A")
            case 7:
                simulation.mend("B1", "A3 -> B2")
            case 8:
                simulation.learning("B -> A", True)
        np.testing.assert_array_equal(simulation.weights, expected.weights[k])
        simulation.step()
        np.testing.assert_array_equal(simulation.activity, expected.activity[k])
    weight = expected.weight("B2 -> A1")
    assert len({*weight[4:7].tolist()}) == 1
    assert weight[7] != weight[6]
    assert expected["B1"][3:7].tolist() == [0.0] * 4
    assert expected["B1"][7] == 0.0  # nothing was sent while it was lesioned
    assert expected["B1"][9] > 0


@BACKENDS
def test_a_lesion_that_is_mended_before_a_step_is_none(backend: str, tmp_path: Path) -> None:
    """What is under way is lost when a step is made without it, and not before."""
    network = nv.compile_text(
        HEAD + "neurons: {A: {count: 2, bias: 1}, B: {}}\n"
        "connections: {A1 -> B: {weight: 1, delay: 3}, A2 -> B: {weight: 10, delay: 3}}\n"
    )

    def made(turns: Mapping[int, Callable[[Simulation], object]]) -> list[float]:
        simulation, found = network.simulator(backend), []
        for k in range(12):
            if k in turns:
                turns[k](simulation)
            simulation.step()
            found.append(float(simulation.activity[2]))
        return found

    def twice(simulation: Simulation) -> None:
        for part in ("A2", "A2 -> B", "B", "A1 -> B"):
            simulation.lesion(part)
            simulation.mend(part)
        simulation.lesion("A2")
        simulation.save_state(tmp_path / "x.state")
        simulation.restore(tmp_path / "x.state")
        simulation.mend("A2")

    whole = made({})
    assert whole == [0.0] * 3 + [11.0] * 9
    assert made(dict.fromkeys(range(12), twice)) == whole

    def stepped(simulation: Simulation) -> None:
        simulation.mend("A2")
        twice(simulation)

    lost = [0.0] * 3 + [11.0] * 2 + [1.0] * 4 + [11.0] * 3
    assert made({5: lambda one: one.lesion("A2"), 6: lambda one: one.mend("A2")}) == lost
    assert made({5: lambda one: one.lesion("A2"), 6: stepped}) == lost


@BACKENDS
def test_a_state_is_put_back_exactly(backend: str) -> None:
    """With delays, noise, episodes, rules, what was set and what events do."""
    text = HEAD.replace("name: x\n", "name: x\ntime: {episode: 4}\n") + (
        "neurons: {A: {count: 3, bias: p, noise: 'normal(0, p)'}, B: {count: 2}}\n"
        "connections: {A -> B: {weight: q, delay: 3, pattern: all_to_all}, "
        "B -> A: {weight: 0.1, pattern: all_to_all, plasticity: {reward_modulated: {policy: A1, reward: B1}}}}\n"
        "events: [{at: 9, set: {p: 2}}, {from: 5, to: 11, clamp: {A2: q}}, {at: 12, lesion: [A3]}]\n"
    )
    simulation = nv.compile_text(text).simulator(backend)
    for k in range(6):
        if k == 3:
            simulation.set(q=4)
        simulation.step()
    kept = simulation.state()

    def rest() -> list[list[float]]:
        return [(simulation.step(), [*simulation.activity, *simulation.weights])[1] for _ in range(12)]

    first = rest()
    simulation.set(p=3, q=0)
    simulation.clamp("B", 5)
    simulation.lesion("A1")
    simulation.restore(kept)
    assert simulation.k == 6
    assert rest() == first


def test_a_state_of_another_network_is_refused() -> None:
    one, other = (nv.compile_text(HEAD + f"neurons: {{A: {{bias: {bias}}}}}").simulator() for bias in (1, 2))
    with pytest.raises(ValueError, match="of another network"):
        one.restore(other.state())


def test_by_hand_only_what_there_is() -> None:
    simulation = nv.compile_text(
        HEAD + "neurons: {A: {count: 2, bias: 1}, B: {}}\nconnections: {A -> B: 1}"
    ).simulator()
    with pytest.raises(KeyError, match="no neuron"):
        simulation.clamp("Q", 1)
    with pytest.raises(KeyError, match="no connection"):
        simulation.lesion("B -> A")
    with pytest.raises(KeyError, match="no neuron"):
        simulation.lesion("A1", "Q")
    with pytest.raises(KeyError, match="no neuron"):
        simulation.mend("A3")
    with pytest.raises(KeyError, match="no rule"):
        simulation.learning("A -> B", False)
    with pytest.raises(ValueError, match="finite number"):
        simulation.clamp("A", float("nan"))
    simulation.step()
    assert simulation.activity.tolist() == [1.0, 1.0, 0.0]


def test_arguments_of_another_kind_are_named() -> None:
    simulation = nv.compile_text(HEAD + "neurons: {A: {bias: p}}").simulator()
    wrong = cast("str", 3)
    with pytest.raises(TypeError, match="'name' is a text, not int"):
        simulation.weight(wrong)
    with pytest.raises(TypeError, match="'values' is a mapping, not int"):
        simulation.set(cast("dict[str, float]", 3))
    with pytest.raises(TypeError, match="given by name, not as int"):
        simulation.step(cast("dict[str, float]", 3))
    with pytest.raises(TypeError, match="'reference' is a text, not int"):
        simulation.lesion(wrong)
    with pytest.raises(TypeError, match="'state' is a state, as state"):
        simulation.restore(cast("State", 3))


@BACKENDS
def test_an_event_that_cannot_be_after_what_was_set_by_hand_is_left_out(backend: str) -> None:
    text = HEAD + "neurons: {A: {bias: r}}\nevents: [{at: 2, set: {r: 2*r}}, {at: 2, lesion: A}]"
    simulation = nv.compile_text(text).simulator(backend)
    simulation.set(r=3)
    simulation.step()
    with pytest.raises(ParameterError, match="the events at step 2: 'r' is 6; its bounds are 0 to 4"):
        simulation.step()
    assert (simulation.k, simulation.activity.tolist()) == (2, [3.0])
    simulation.step()
    assert simulation.activity.tolist() == [3.0]


def test_a_state_in_which_other_numbers_follow_parameters_is_refused() -> None:
    """The hash does not see what follows a parameter; a state has the numbers that do."""
    one = nv.compile_text(HEAD + "neurons: {A: {bias: p}, B: {bias: 0.5}}")
    other = nv.compile_text(HEAD + "neurons: {A: {bias: 0.5}, B: {bias: p}}")
    assert one.hash == other.hash
    with pytest.raises(ValueError, match="a state of another network"):
        other.simulator().restore(one.simulator().state())


def test_a_cell_of_no_connection_follows_nothing() -> None:
    text = HEAD + (
        "neurons: {A: {count: 2, bias: 1}, B: {combine: distance}}\n"
        "connections: {A -> B: {matrix: [[p], [null]], centre: [[1], [p]]}}\nevents: [{at: 1, set: {p: 2}}]\n"
    )
    assert nv.compile_text(text).run(4)["B"].tolist() == [1.0, 0.5, 1.0, 1.0]


def test_bounds_of_parameters_follow_other_parameters() -> None:
    text = HEAD.replace("p: 0.5", "p: 0.5, s: {value: 1, min: p, max: 2*p}") + "neurons: {A: {bias: s}}\n"
    simulation = nv.compile_text(text).simulator()
    for _ in range(2):
        with pytest.raises(ParameterError, match="'s' is 1; its bounds are 2 to 4"):
            simulation.set(p=2)
        with pytest.raises(ParameterError, match=r"'s' is 3; its bounds are 0\.5 to 1"):
            simulation.set(s=3)
    simulation.set(p=2, s=3)
    assert simulation.parameters["s"] == 3
    with pytest.raises(nv.SpecError, match="from step 1 on 's' is 1; its bounds are 3 to 6"):
        nv.compile_text(text + "events: [{at: 1, set: {p: 3}}]")
