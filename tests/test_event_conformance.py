"""Events that set weights, feed inputs and put neurons back to their beginning: each backend does what the reference
does, in one go, step by step, in pieces and as exported C; and each is what can be had without it."""

from __future__ import annotations

import random
import warnings
from pathlib import Path

import numpy as np
import pytest
from exported import exported
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st
from random_events import with_events
from random_flows import flowing_specs
from random_learning import learning_specs
from random_specs import Spec
from random_spikes import made_spec
from small_specs import compiled

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.diagnostics import SpecError
from neurovis_spec.live.carry import carried
from neurovis_spec.live.show import Beginning
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.runtime import c_backend, c_export
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.simulation import Simulation

STEPS = 12
_SEEDS = st.integers(0, 2**32)
QUICK = settings(max_examples=8, deadline=None, phases=(Phase.explicit, Phase.generate))


def network_of(spec: Spec) -> CompiledNetwork:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return nv.compile(spec)
        except SpecError as error:  # a random network may have a cycle, which has nothing to do with events
            assume({one.code for one in error.diagnostics}.isdisjoint(("delay-0-cycle", "algebraic-loop")))
            raise


@st.composite
def eventful(draw: st.DrawFn, exact: bool = True) -> Spec:
    """Random networks of three kinds; ``exact`` ones use no functions whose last bits are those of a library."""
    chooser = random.Random(draw(_SEEDS))
    kind = draw(st.sampled_from(["flows", "spikes"] if exact else ["flows", "spikes", "learning"]))
    if kind == "flows":
        spec = draw(flowing_specs(exact=exact))
    else:
        spec = made_spec(chooser, 3) if kind == "spikes" else draw(learning_specs())
    return with_events(spec, chooser)


def quiet_run(network: CompiledNetwork, backend: str) -> Recording:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return network.run(STEPS, backend=backend)


def assert_alike(found: Recording, expected: Recording) -> None:
    np.testing.assert_array_equal(found.activity, expected.activity)
    np.testing.assert_array_equal(found.weights, expected.weights)


@QUICK
@given(spec=eventful())
def test_numpy_does_what_the_reference_does(spec: Spec) -> None:
    network = network_of(spec)
    assert_alike(quiet_run(network, "numpy"), quiet_run(network, "reference"))


@pytest.mark.compiler
@pytest.mark.parametrize("small", [0, 600], ids=["loops", "written out"])
@QUICK
@given(spec=eventful(exact=False))
def test_c_and_exported_c_do(spec: Spec, small: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    network = network_of(spec)
    expected = quiet_run(network, "reference")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(c_backend, "SMALL", small)
        patch.setattr(c_export, "SMALL", small)
        assert_alike(quiet_run(network, "c"), expected)
        controller = exported(network, tmp_path_factory.mktemp("c"), "C99")
    for k in range(STEPS):
        np.testing.assert_array_equal(controller.weights[network.network.changing], expected.weights[k], f"w[{k}]")
        controller.step()
        np.testing.assert_array_equal(controller.activity, expected.activity[k], f"a[{k}]")


@QUICK
@given(spec=eventful(exact=False), cut=st.integers(0, STEPS - 1))
def test_a_run_in_pieces_and_an_edit_of_nothing_change_nothing(
    spec: Spec, cut: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    network, checkpoint = network_of(spec).network, tmp_path_factory.mktemp("pieces") / "state"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        whole, restored = Simulation(network, "numpy"), Simulation(network, "numpy")
        plain, edited = (SimulatedSource(Simulation(network, "numpy")) for _ in range(2))
        expected = quiet_run(network_of(spec), "numpy")
        for k in range(STEPS):
            if k == cut:
                whole.save_state(checkpoint)
                restored.restore(checkpoint)
                edited = carried(edited, Simulation(network, "numpy"))
            whole.step()
            np.testing.assert_array_equal(whole.activity, expected.activity[k])
            if k >= cut:
                restored.step()
                np.testing.assert_array_equal(restored.activity, whole.activity)
            for one in (plain, edited):
                one.advance()
            np.testing.assert_array_equal(edited.seen().snapshot.activity, plain.seen().snapshot.activity)


LEARNING = """
time: {dt: 0.01}
parameters: {g: 0.5}
inputs: {push: {expression: sin(k)}, pair: {values: [[1, 2], [3, 4], [5, 6]]}, spare: {size: 2}}
neurons:
  A: {count: 2, input: push, activation: tanh}
  P: {count: 2, input: pair}
  S: {count: 2, input: spare}
  K: {count: 3, activation: tanh, initial: 0.2}
connections:
  A -> K: {weight: 0.3, pattern: all_to_all, delay: 0, plasticity: {hebbian: {rate: 0.01}}}
  P -> K: {weight: g/5, pattern: all_to_all, delay: 0}
  S -> K: {weight: 0.1, pattern: all_to_all, delay: 0}
"""


def with_event(event: str, spec: str = LEARNING) -> str:
    return f"{spec}events: [{event}]\n"


def test_a_weight_that_is_set_is_one_that_follows_a_parameter_which_is_set() -> None:
    named = LEARNING.replace("S -> K: {weight: 0.1", "S -> K: {weight: w").replace("{g: 0.5}", "{g: 0.5, w: 0.1}")
    own, by_name = (
        compiled(with_event(event, spec)).run(9, {"spare": [1.0, 2.0]})
        for event, spec in (("{at: 4, set: {S -> K: g + 0.2}}", LEARNING), ("{at: 4, set: {w: g + 0.2}}", named))
    )
    np.testing.assert_array_equal(own.activity, by_name.activity)
    np.testing.assert_array_equal(own.weight("S1 -> K2"), by_name.weight("S1 -> K2"))
    assert own.weight("S1 -> K2").tolist() == [0.1] * 4 + [0.7] * 5


def test_what_learns_goes_on_from_what_it_is_set_to() -> None:
    network = compiled(with_event("{at: 4, set: {A2 -> K: [0.5, 0.6, 0.7], A1 -> K2: g}}"))
    plain = compiled(LEARNING).simulator()
    found = network.run(9)
    for k in range(9):
        if k == 4:
            state = plain.state()
            names = [f"A2 -> K{i}" for i in (1, 2, 3)] + ["A1 -> K2"]
            state.weights[[plain.network.connection_index[name] for name in names]] = [0.5, 0.6, 0.7, 0.5]
            plain.restore(state)
        np.testing.assert_array_equal(
            plain.weights, found.weights[k][np.isin(network.network.changing, plain.network.changing)]
        )
        plain.step()
        np.testing.assert_array_equal(plain.activity, found.activity[k])


def test_a_weight_follows_its_parameter_again_where_that_is_set_later() -> None:
    found = compiled(with_event("{at: 2, set: {P -> K: 9, g: 2}}, {at: 4, set: {g: 3}}")).run(6)
    assert found.weight("P1 -> K1").tolist() == [0.1, 0.1, 9.0, 9.0, 0.6, 0.6]


def test_what_is_fed_is_what_a_caller_could_supply() -> None:
    event = "{at: 3, feed: {push: 0.8, pair: [7, g], spare: 2*g}}, {at: 6, feed: {push: null, pair: null, spare: null}}"
    steps = np.arange(9)
    fed = (steps >= 3) & (steps < 6)
    push = np.where(fed, 0.8, np.sin(steps))
    rows = np.array([[1, 2], [3, 4], [5, 6]])[np.minimum(steps, 2)]
    pair = np.where(fed[:, None], [7.0, 0.5], rows)
    spare = np.where(fed[:, None], 1.0, np.zeros((9, 2)))
    supplied = compiled(LEARNING).run(9, {"push": push, "pair": pair, "spare": spare}, backend="reference")
    np.testing.assert_array_equal(compiled(with_event(event)).run(9, backend="reference").activity, supplied.activity)


def test_what_a_caller_supplies_goes_before_what_is_fed() -> None:
    network = compiled(with_event("{at: 0, feed: {push: 0.8}}"))
    np.testing.assert_array_equal(
        network.run(4, {"push": 0.1}).activity, compiled(LEARNING).run(4, {"push": 0.1}).activity
    )
    simulator = network.simulator()
    simulator.step(push=0.1)
    first = simulator.activity[0]
    simulator.step()
    assert (first, simulator.activity[0]) == (np.tanh(0.1), np.tanh(0.8))


RESET = """
models: {sum: {state: {v: {initial: 2, each_step: v + drive}}, activity: v}}
rules: {count: {state: {seen: {each_step: seen + 1}}, weight: {each_step: weight + 0.125}}}
neurons: {A: {model: sum, bias: 1}, B: {model: sum, bias: 1}, C: {}, D: {}}
connections:
  A -> C: {delay: 3}
  B -> D: {delay: 3, plasticity: count}
"""


def test_neurons_that_are_reset_begin_anew_and_weights_do_not() -> None:
    network = compiled(with_event("{at: 5, reset: B}", RESET))
    found = network.run(10, states="all")
    assert found["A"].tolist() == [3.0 + k for k in range(10)]
    assert found["B"].tolist() == [3, 4, 5, 6, 7, 3, 4, 5, 6, 7]
    assert found["C"].tolist() == [0, 0, 0, *(3.0 + k for k in range(7))]
    # what B had sent never arrives; each weight is that of when it left
    assert found["D"].tolist() == [0, 0, 0, 3 * 1.0, 4 * 1.125, 0, 0, 0, 3 * 1.625, 4 * 1.75]
    assert found["(B -> D).seen"].tolist() == [1, 2, 3, 4, 5, 1, 2, 3, 4, 5]
    assert found.weight("B -> D").tolist() == [1 + k / 8 for k in range(10)]


def test_all_that_is_reset_runs_as_from_the_beginning() -> None:
    """In a network without initial activities, whose inputs are always the same."""
    spec = RESET.replace(", plasticity: count", "")
    found = compiled(with_event("{at: 6, reset: [A + B, C, D]}", spec)).run(12)
    np.testing.assert_array_equal(found.activity[6:], found.activity[:6])


def test_what_is_read_before_the_step_of_a_reset_is_what_was() -> None:
    simulator = compiled(with_event("{at: 3, reset: B}", RESET) + "outputs: {b: B}\n").simulator()
    assert [float(np.ravel(simulator.step()["b"])[0]) for _ in range(5)] == [3, 4, 5, 3, 4]
    simulator.reset()
    for _ in range(3):
        simulator.step()
    assert simulator.activity[1] == 5


def test_a_trial_that_keeps_what_was_learned_alone(tmp_path: Path) -> None:
    noisy = LEARNING.replace("initial: 0.2}", 'initial: 0.2, noise: "normal(0, 0.1)"}')
    network = compiled(noisy)
    simulator = network.simulator(backend="numpy")
    simulator.set(g=0.7)
    simulator.lesion("S1")
    for _ in range(5):
        simulator.step()
    learned = simulator.weights.copy()
    simulator.reset(keep="weights")
    assert simulator.k == 0
    assert simulator.parameters["g"] == 0.5
    np.testing.assert_array_equal(simulator.weights, learned)
    first = network.run(5, backend="numpy")
    assert not np.array_equal(first.weights_after, learned)
    first.save(tmp_path / "x.npz")
    second = network.run(5, start=nv.load(tmp_path / "x.npz"), only="weights", backend="numpy")
    again = network.simulator(backend="numpy")
    for _ in range(5):
        again.step()
    again.reset(keep="weights")
    for k in range(5):
        again.step()
        np.testing.assert_array_equal(again.activity, second.activity[k])
    for begun in (
        network.simulator("numpy", start=first, only="weights"),
        Beginning(first, weights_alone=True).simulation(network.network, "numpy"),
    ):
        for k in range(5):
            begun.step()
            np.testing.assert_array_equal(begun.activity, second.activity[k])
    with pytest.raises(ValueError, match="only is 'weights' or None, not 'all'"):
        network.simulator(start=first, only="all")  # type: ignore[arg-type]
    assert second.activity[0, -1] == 0.2  # the initial activity is taken
    assert not np.array_equal(second.activity, first.activity)
    with pytest.raises(ValueError, match="a reset keeps 'weights' or None, not 'all'"):
        again.reset(keep="all")  # type: ignore[arg-type]


WRONG = {
    "{at: 1, set: {A -> Q: 1}}": ("unknown-neuron", "Q"),
    "{at: 1, set: {K -> A: 1}}": ("no-connection", "there is no connection 'K -> A'"),
    "{at: 1, set: {A -> K: [1, 2]}}": ("wrong-size", "'A -> K' has 2 weights for 6 connections"),
    "{at: 1, set: {g: [1, 2]}}": ("wrong-size", "the parameter 'g' takes one value, not a list"),
    "{at: 1, set: {A -> K: 1/0}}": ("not-finite", ""),
    "{at: 1, feed: {pusch: 1}}": ("unknown-input", "there is no input 'pusch' to be fed"),
    "{at: 1, feed: {pair: [1, 2, 3]}}": ("wrong-size", "the input 'pair' takes 2 numbers, not 3"),
    "{at: 1, reset: Q}": ("unknown-neuron", "Q"),
    "{from: 1, reset: K}": ("bad-event", ""),
    "{at: 1, feed: {}}": ("no-value", ""),
}


@pytest.mark.parametrize("event", WRONG)
def test_what_is_wrong_with_them_is_told(event: str) -> None:
    code, text = WRONG[event]
    with pytest.raises(SpecError) as caught:
        compiled(with_event(event))
    found = [(one.code, one.message) for one in caught.value.diagnostics]
    assert any(one == code and text in message for one, message in found), found


def test_weights_stay_within_their_bounds() -> None:
    bounded = LEARNING.replace(
        "plasticity: {hebbian: {rate: 0.01}}", "plasticity: {hebbian: {rate: 0.01}}, bounds: [0, g]"
    )
    with pytest.raises(SpecError, match=r"a weight would be above its bound of 0\.5"):
        compiled(with_event("{at: 1, set: {A -> K: 0.6}}", bounded))
    found = compiled(with_event("{at: 1, set: {g: 0.8}}, {at: 2, set: {A -> K: 0.6}}", bounded)).run(4)
    assert found.weight("A1 -> K1")[2] == 0.6


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_a_weight_that_learns_stays_where_its_bounds_alone_are_set(backend: str) -> None:
    """Whether an event sets it later on, or has set it before."""
    bounded = LEARNING.replace(
        "plasticity: {hebbian: {rate: 0.01}}", "plasticity: {hebbian: {rate: 0.01}}, bounds: [0, g]"
    )
    plain = compiled(with_event("{at: 2, set: {g: 0.8}}", bounded)).run(4, backend=backend)
    later = compiled(with_event("{at: 2, set: {g: 0.8}}, {at: 3, set: {A -> K: 0.6}}", bounded))
    found = later.run(4, backend=backend).weight("A1 -> K1")
    assert found[:3].tolist() == plain.weight("A1 -> K1")[:3].tolist()
    assert found[3] == 0.6
    before = compiled(with_event("{at: 1, set: {A -> K: 0.3}}, {at: 3, set: {g: 0.8}}", bounded))
    without = compiled(with_event("{at: 1, set: {A -> K: 0.3}}", bounded))
    one, other = (spec.run(4, backend=backend).weight("A1 -> K1") for spec in (before, without))
    assert one.tolist() == other.tolist()
    assert one[3] > 0.3


def test_one_that_is_lost_is_told_and_one_of_a_weight_is_not_without_effect() -> None:
    text = with_event("{at: 1, set: {A -> K: 0.3, S -> K: 1}}, {at: 1, set: {S -> K: 2}}")
    messages = [(one.code, one.message) for one in compiled(text).warnings]
    assert messages == [("no-effect", "'S -> K' is set again at this step (column 64): what is set here is lost")]


def test_symmetric_connections_have_one_weight_in_both_directions() -> None:
    spec = "neurons: {N: {count: 3}}\nconnections: {N -> N: {weight: 0.5, pattern: all_to_all, symmetric: true}}\n"
    found = compiled(with_event("{at: 1, set: {N -> N: [1, 2, 3], N1 -> N2: 4}}", spec)).run(2)
    assert [found.weight(f"N{i} -> N{j}")[1] for i, j in ((1, 2), (2, 1), (1, 3), (3, 1), (2, 3), (3, 2))] == [
        4,
        4,
        2,
        2,
        3,
        3,
    ]


def test_a_trial_keeps_what_tied_weights_have_learned() -> None:
    """The weights of both entries stay one set of numbers."""
    back = "  K -> A: {weight: {transpose: A -> K}, delay: 1}\n"
    network = compiled(LEARNING + back)
    first = network.run(5)
    simulator = network.simulator()
    for _ in range(5):
        simulator.step()
    simulator.reset(keep="weights")
    second = network.run(1, start=first, only="weights")
    for weights in (simulator.connection_weights, second.all_weights(0)):
        found = {name: weights[index] for name, index in network.network.connection_index.items()}
        assert found["A2 -> K3"] == found["K3 -> A2"] != 0.3
