"""Every backend against the reference, and the reference against numbers worked out by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laws import examples
from networks_by_hand import (
    GAUSSIAN,
    LEAKY,
    STATIC,
    TANH,
    Learns,
    Link,
    Unit,
    activation,
    build,
    cpg_rbf,
    model,
    rule,
    tree,
)

from neurovis_spec.api import compile_text
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Input, Network
from neurovis_spec.compiler.program import Definition
from neurovis_spec.language.words import Combine
from neurovis_spec.runtime.backend import BackendError, Capabilities, listing, load, prepare
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.numpy_backend import NumpyBackend, step_code
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.reference import ReferenceBackend
from neurovis_spec.runtime.state import State, first_conditions, initial_state

BOTH = ("reference", "numpy")

# ---- networks at random ------------------------------------------------------------------------------------------

ADAPTIVE = model(
    "f(v)",
    {
        "v": ("start", "(1 - leak) * v + leak * (drive - b)", "0.5 * v + 0.1 * held"),
        "b": ("0.1", "b + 0.1 * (held - b)", None),
    },
    ["leak", "start"],
    {"held": "v if v > 0 else 0"},
)
SWAPPING = model("f(0.5 * p) + 0.1 * q", {"p": ("0.3", "q", "q"), "q": ("-0.2", "p", "p"), "kept": ("1", None, None)})
CLOCKED = activation("sin(x + 0.01 * k) * slope + 0 * t", slope=0.5)
TRACED = rule(
    step="weight + rate * trace * (teacher - post) - decayed",
    end="weight - 0.1 * trace",
    states={"trace": ("0.1", "0.5 * trace + pre", "0"), "last": ("0", "weight", "trace")},
    parameters=["rate"],
    signals=["teacher"],
    let={"decayed": "0.001 * weight * sent"},
)
SEASONAL = rule(end="0.9 * weight + 0.01 * total / k", states={"total": ("0", "total + pre * post + 0*t", "0")})
COPYING = rule(step="last", states={"last": ("0.5", "weight", None)})
MODELS: Sequence[tuple[Definition, dict[str, float]]] = (
    (STATIC, {}),
    (LEAKY, {"leak": 0.3}),
    (ADAPTIVE, {"leak": 0.2, "start": 0.1}),
    (SWAPPING, {}),
)
BOUNDED: Sequence[tuple[Definition, dict[str, float]]] = (
    (TANH, {}),
    (GAUSSIAN, {"sigma": 0.7}),
    (CLOCKED, {"slope": 0.5}),
)
USES = (Learns(TRACED, {"rate": 0.05}, {"teacher": 0}), Learns(SEASONAL), Learns(COPYING))


@st.composite
def networks(draw: st.DrawFn, gain: float = 0.9) -> Network:
    """Any mixture of what the runtime knows; delay-0 links go from lower to higher neurons only."""
    n = draw(st.integers(1, 7))
    units = []
    for index in range(n):
        kind, parameters = draw(st.sampled_from(MODELS))
        combine: Combine = draw(st.sampled_from(["sum", "sum", "product", "distance"]))
        function, shape = draw(st.sampled_from(BOUNDED))
        units.append(
            Unit(
                f"N{index}",
                function,
                kind,
                combine,
                bias=draw(st.sampled_from([0.0, 0.0, 0.25, -0.5])),
                initial=draw(st.sampled_from([math.nan, math.nan, 0.4, -0.2])),
                input=draw(st.sampled_from([-1, -1, 0, 1, 2])),
                shape={name: value + 0.1 * index for name, value in shape.items()},
                parameters={name: value + 0.05 * (index % 2) for name, value in parameters.items()},
            )
        )
    links = []
    for _ in range(draw(st.integers(0, 14))):
        source, target = draw(st.integers(0, n - 1)), draw(st.integers(0, n - 1))
        bounded = draw(st.booleans())
        links.append(
            Link(
                source,
                target,
                weight=draw(st.floats(-1, 1)) * gain,
                delay=draw(st.integers(0 if source < target else 1, 5)),
                centre=draw(st.sampled_from([0.0, 0.3])),
                learns=draw(st.integers(-1, len(USES) - 1)),
                low=-0.6 if bounded else -math.inf,
                high=0.7 if bounded else math.inf,
            )
        )
    used = sorted({link.learns for link in links} - {-1})
    links = [replace(link, learns=used.index(link.learns) if link.learns >= 0 else -1) for link in links]
    uses = [_teach(USES[index], draw(st.integers(0, n + 2))) for index in used]
    inputs = [
        Input("wave", 0, 1, tree("0.3 * sin(0.1 * k) + 0 * t")),
        Input("rows", 1, 2, table=np.array([[0.1, -0.2], [0.3, 0.4], [-0.5, 0.2]])),
    ]
    return build(units, links, uses, inputs, dt=0.1, episode=draw(st.sampled_from([None, 1, 3, 7])))


def _teach(use: Learns, signal: int) -> Learns:
    return Learns(use.rule, use.parameters, dict.fromkeys(use.signals, signal))


def parts(state: State) -> list[FloatArray]:
    """All arrays of a state."""
    inner = [array for own in state.cells.values() for array in own.values()]
    return [state.activity, state.weights, state.signals, state.history, *inner]


@examples(60)
@given(networks())
def test_each_step_begun_in_the_reference_state_agrees(network: Network) -> None:
    plain, fast, reader = ReferenceBackend().prepare(network), NumpyBackend().prepare(network), InputReader(network)
    state = initial_state(network)
    with np.errstate(all="ignore"):
        for k in range(24):
            other = state.copy()
            plain.step(state, reader.at(k))
            fast.step(other, reader.at(k))
            assert (state.k, other.k) == (k + 1, k + 1)
            for expected, found in zip(parts(state), parts(other), strict=True):
                np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 2**32))
def test_contracting_networks_agree_for_2000_steps(seed: int) -> None:
    random = np.random.default_rng(seed)
    units = [Unit(f"N{i}", TANH, bias=0.1) for i in range(2)]
    units += [Unit(f"L{i}", TANH, LEAKY, bias=0.1, parameters={"leak": 0.3}) for i in range(2)]
    weights, delays = random.uniform(-0.2, 0.2, 16).tolist(), random.integers(1, 4, 16).tolist()
    links = [Link(i // 4, i % 4, weights[i], delays[i]) for i in range(16)]
    network = build(units, links)
    runs = [record(network, Course(2000, backend=name)) for name in BOTH]
    np.testing.assert_allclose(runs[1].activity, runs[0].activity, rtol=0, atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32), st.sampled_from(["sum", "product", "distance"]))
def test_terms_are_combined_in_the_order_of_the_connections_bit_for_bit(seed: int, combine: Combine) -> None:
    random = np.random.default_rng(seed)
    units = [Unit(f"S{i}", initial=float(value)) for i, value in enumerate(random.uniform(0.9, 1.2, 40))]
    units += [Unit("A", combine=combine, bias=0.1), Unit("B", combine=combine)]
    links = [
        Link(int(random.integers(40)), int(random.integers(40, 42)), float(random.uniform(0.8, 1.2)), 0, 0.1)
        for _ in range(200)
    ]
    network = build(units, links)
    runs = [record(network, Course(1, backend=name)) for name in BOTH]
    assert runs[0].activity.tobytes() == runs[1].activity.tobytes()
    assert runs[0]["B"][0] not in (0.0, 1.0)


# ---- by hand -----------------------------------------------------------------------------------------------------


def run(network: Network, steps: int, backend: str) -> Recording:
    return record(network, Course(steps, backend=backend))


@pytest.mark.parametrize("backend", BOTH)
def test_the_printed_rhythm_of_the_paper(backend: str) -> None:
    units = [Unit("C1", TANH, initial=0.1), Unit("C2", TANH, initial=0.1)]
    links = [Link(0, 0, 1.0), Link(0, 1, -0.049), Link(1, 0, 0.049), Link(1, 1, 1.0)]
    found = run(build(units, links), 1001, backend).activity[1000]
    np.testing.assert_allclose(found, (-0.036558981443553, 0.061863978098396), rtol=0, atol=1e-12)


@pytest.mark.parametrize("backend", BOTH)
@pytest.mark.parametrize("delay", range(6))
def test_a_signal_arrives_after_its_delay(delay: int, backend: str) -> None:
    pulse = Input("pulse", 0, 1, table=np.array([[3.0], [5.0], [0.0]]))
    network = build([Unit("S", input=0), Unit("A")], [Link(0, 1, 2.0, delay)], inputs=[pulse])
    expected = np.zeros(10)
    expected[delay : delay + 2] = (6.0, 10.0)
    assert run(network, 10, backend)["A"].tolist() == expected.tolist()


@pytest.mark.parametrize("backend", BOTH)
def test_a_signal_is_formed_with_the_weight_of_its_departure(backend: str) -> None:
    # the weight doubles each step: 1, 2, 4, 8; the source is 1 always; delay 2
    doubling = Learns(rule("2 * weight"))
    network = build([Unit("S", bias=1.0), Unit("A")], [Link(0, 1, 1.0, 2, learns=0)], [doubling])
    recording = run(network, 6, backend)
    assert recording.weight("S -> A").tolist() == [1, 2, 4, 8, 16, 32]
    assert recording["A"].tolist() == [0, 0, 1, 2, 4, 8]


@pytest.mark.parametrize("backend", BOTH)
def test_combinations_before_anything_has_arrived(backend: str) -> None:
    units = [
        Unit("S", bias=1.0),
        Unit("Sum", bias=0.5),
        Unit("Product", combine="product"),
        Unit("Alone", combine="product", bias=0.25),
        Unit("Distance", combine="distance"),
    ]
    links = [Link(0, 1, 2.0), Link(0, 2, 3.0), Link(0, 2, 4.0), Link(0, 4, 1.0, 1, -3.0), Link(0, 4, 1.0, 1, 4.0)]
    found = run(build(units, links), 2, backend).activity
    assert found[0].tolist() == [1.0, 0.5, 0.0, 1.25, 5.0]
    assert found[1].tolist() == [1.0, 2.5, 12.0, 1.25, 5.0]


@pytest.mark.parametrize("backend", BOTH)
def test_initial_is_step_0_and_states_begin_at_step_1(backend: str) -> None:
    counter = model("v", {"v": ("0", "v + 1", "100")})
    units = [Unit("Given", model=counter, initial=7.0), Unit("Computed", model=counter)]
    assert run(build(units), 3, backend).activity.tolist() == [[7, 1], [1, 2], [2, 3]]
    each = run(build(units, episode=1), 3, backend).activity.tolist()
    assert each == [[7, 1], [1, 101], [101, 101]]


@pytest.mark.parametrize("backend", BOTH)
def test_initial_reaches_delay_0_targets_at_step_0(backend: str) -> None:
    network = build([Unit("S", initial=2.0), Unit("A")], [Link(0, 1, 3.0, 0)])
    assert run(network, 2, backend).activity.tolist() == [[2, 6], [0, 0]]


@pytest.mark.parametrize("backend", BOTH)
@pytest.mark.parametrize("delay", [0, 1, 3])
def test_pre_is_the_activity_that_reaches_the_synapse(delay: int, backend: str) -> None:
    ramp = Input("ramp", 0, 1, tree("k + 1"))
    follow = Learns(rule("100 * pre + sent + post / 1000"))
    units = [Unit("S", input=0), Unit("A", bias=1.0)]
    units, links = [*units, Unit("Sink")], [Link(0, 1, 0.0, delay, learns=0), Link(1, 2, 0.0, 5)]
    network = build(units, links, [follow], [ramp])
    recording = run(network, 7, backend)
    weights, post, sent = recording.weight("S -> A"), recording["A"], recording["S"]
    for t in range(6):
        pre = sent[t - delay] if t >= delay else 0.0
        assert weights[t + 1] == pytest.approx(100 * pre + sent[t] + post[t] / 1000, rel=1e-15)


@pytest.mark.parametrize("backend", BOTH)
def test_mixed_delays_of_pre(backend: str) -> None:
    ramp = Input("ramp", 0, 1, tree("k + 1"))
    units = [Unit("S", input=0), Unit("A"), Unit("B"), Unit("D")]
    links = [Link(0, 1, 0.0, 2, learns=0), Link(0, 2, 0.0, 0, learns=0), Link(0, 3, 0.0, 4, learns=0)]
    found = run(build(units, links, [Learns(rule("pre"))], [ramp]), 8, backend)
    assert found.weights[1:].tolist() == [[max(t - 1, 0), t + 1, max(t - 3, 0)] for t in range(7)]


@pytest.mark.parametrize("backend", BOTH)
def test_bounds_hold_after_each_change(backend: str) -> None:
    grow = Learns(rule("weight + 0.4", "weight - 0.5"))
    network = build([Unit("S"), Unit("A")], [Link(0, 1, 0.0, 1, learns=0, low=-0.25, high=1.0)], [grow], episode=4)
    # 0, .4, .8, 1 (clipped), then at the end of step 3: min(1.4, 1) − 0.5
    assert run(network, 6, backend).weight("S -> A").tolist() == pytest.approx([0, 0.4, 0.8, 1.0, 0.5, 0.9], rel=1e-15)


@pytest.mark.parametrize("backend", BOTH)
def test_right_hand_sides_use_old_values(backend: str) -> None:
    swap = Learns(rule("other", "weight + other", {"other": ("5", "weight", "10 * weight + other")}))
    network = build([Unit("S"), Unit("A")], [Link(0, 1, 2.0, learns=0)], [swap], episode=3)
    # (w, o): (2,5) (5,2) (2,5) → step (5,2) → end (7, 52) → (52, 7)
    assert run(network, 5, backend).weight("S -> A").tolist() == [2, 5, 2, 7, 52]


@pytest.mark.parametrize("backend", BOTH)
def test_reward_modulated_learning_against_a_plain_loop(backend: str) -> None:
    """Eq. 15: the sum over an episode holds all its steps, and the changed weight is w[t+1]."""
    learning = rule(
        end="weight + rate * (reward - baseline) * eligibility",
        states={
            "eligibility": ("0", "eligibility + policy * pre * (policy - post)", "0"),
            "baseline": ("0", None, "smoothing * baseline + (1 - smoothing) * reward"),
        },
        parameters=["rate", "smoothing"],
        signals=["policy", "reward"],
    )
    inputs = [Input("policy", 0, 1, tree("sin(0.7 * k)")), Input("reward", 1, 1, tree("cos(0.3 * k)"))]
    use = Learns(learning, {"rate": 0.1, "smoothing": 0.9}, {"policy": 2, "reward": 3})
    network = build([Unit("S", bias=0.5), Unit("A")], [Link(0, 1, 0.2, 1, learns=0)], [use], inputs, episode=5)
    weight, eligibility, baseline, sent, arriving, expected = 0.2, 0.0, 0.0, 0.5, 0.0, []
    for t in range(23):
        expected.append(weight)
        pre, post = (sent if t else 0.0), arriving
        arriving = weight * sent
        policy, reward = math.sin(0.7 * t), math.cos(0.3 * t)
        eligibility += policy * pre * (policy - post)
        if (t + 1) % 5 == 0:
            weight += 0.1 * (reward - baseline) * eligibility
            baseline, eligibility = 0.9 * baseline + 0.1 * reward, 0.0
    np.testing.assert_allclose(run(network, 23, backend).weight("S -> A"), expected, rtol=0, atol=1e-14)
    assert len(set(expected)) == 5


@pytest.mark.parametrize("backend", BOTH)
def test_the_delta_rule_learns_the_target_of_use_case_1(backend: str) -> None:
    recording = run(cpg_rbf(), 600 if backend == "reference" else 12000, backend)
    error = (recording["O"] - recording["T"]) ** 2
    if backend == "numpy":
        assert error[-500:].mean() < 0.2 * error[:500].mean()
    kernels, weights = recording["K"], recording.weights
    np.testing.assert_allclose(recording["O"], (kernels * weights).sum(axis=1), rtol=0, atol=1e-12)
    grown = weights[:-1] + 0.01 * kernels[:-1] * (recording["T"] - recording["O"])[:-1, None]
    np.testing.assert_allclose(weights[1:], grown, rtol=0, atol=1e-15)


@pytest.mark.parametrize("backend", BOTH)
def test_k_t_and_dt_are_known_to_rules_and_models(backend: str) -> None:
    clock = model("f(k + t / 10 + dt / 1000 + drive)", {})
    network = build(
        [Unit("A", model=clock), Unit("B")], [Link(0, 1, 0.0, learns=0)], [Learns(rule("k + t + 0 * pi * e"))], dt=0.5
    )
    recording = run(network, 4, backend)
    np.testing.assert_allclose(recording["A"], [k + k * 0.05 + 0.0005 for k in range(4)], rtol=1e-15)
    assert recording.weight("A -> B").tolist() == [0.0, 0.0, 1.5, 3.0]


@pytest.mark.parametrize("backend", BOTH)
def test_a_neuron_without_anything_is_0_and_an_input_reaches_only_its_own(backend: str) -> None:
    two = Input("two", 0, 2, table=np.array([[1.0, 2.0]]))
    units = [Unit("A"), Unit("B", input=1), Unit("C", bias=10.0, input=0), Unit("D", input=1)]
    assert run(build(units, inputs=[two]), 1, backend).activity.tolist() == [[0, 2, 11, 2]]


@pytest.mark.parametrize("backend", BOTH)
def test_an_input_reaches_its_own_where_one_parameter_is_the_bias_of_all(backend: str) -> None:
    text = "neurovis: 1\nname: x\nparameters: {b: 0.5}\ninputs: {one: {expression: '1'}}\n"
    network = compile_text(text + "neurons: {A: {count: 2, bias: b, input: one}, B: {bias: b}}").network
    assert run(network, 1, backend).activity.tolist() == [[1.5, 1.5, 0.5]]


def test_names_of_the_author_never_reach_the_code() -> None:
    evil = model("f(v) + __import__", {"v": ("0", "v + lambda_", None)}, ["lambda_", "__import__"])
    twice, values = activation("x * exec", exec=2.0), {"lambda_": 1.5, "__import__": 0.25}
    network = build([Unit("import os", twice, evil, shape={"exec": 2.0}, parameters=values)])
    text = step_code(network, first_conditions(network).structure).text()
    assert not any(word in text for word in ("__import__", "lambda_", "exec", "import os"))
    assert run(network, 2, "numpy").activity.tolist() == [[3.25], [6.25]]


@pytest.mark.parametrize("every", [1, 3])
def test_many_steps_of_array_code_are_those_made_one_by_one(every: int) -> None:
    network, stepper = cpg_rbf(), NumpyBackend().prepare(cpg_rbf())
    together = record(network, Course(300, backend="numpy", every=every))
    state, rows, weights = initial_state(network), [], []
    for k, vector in enumerate(InputReader(network).rows(0, 300)):
        weights.append(state.weights[network.changing].copy())
        stepper.step(state, vector)
        rows.append(state.activity.copy())
        assert state.k == k + 1
    assert together.activity.tobytes() == np.array(rows)[::every].tobytes()
    assert together.weights.tobytes() == np.array(weights)[::every].tobytes()


# ---- choosing ----------------------------------------------------------------------------------------------------


def test_backends_are_found_by_name_and_refused_with_the_nearest() -> None:
    assert load("reference").name == "reference"
    assert [line.split()[0] for line in listing()] == ["c", "numpy", "reference"]
    assert listing()[1:] == (
        "numpy available array code made for each network; the numbers of the reference up to rounding",
        "reference available plain and slow: what the others are tested against; the bits of the reference",
    )
    with pytest.raises(BackendError, match="'numpy'"):
        load("nmupy")


@pytest.mark.parametrize(
    ("capabilities", "words"),
    [
        (Capabilities(plasticity=False), "no plasticity"),
        (Capabilities(delays=False), "no delays"),
        (Capabilities(episodes=False), "no episodes"),
        (Capabilities(largest=4), "at most 4 neurons and connections, not 5"),
    ],
)
def test_a_network_that_asks_for_more_is_refused_before_it_starts(capabilities: Capabilities, words: str) -> None:
    class Weak(NumpyBackend):
        pass

    Weak.capabilities = capabilities
    links = [Link(0, 1, 1.0, 3, learns=0), Link(0, 1), Link(1, 1)]
    network = build([Unit("A"), Unit("B")], links, [Learns(COPYING)], episode=3)
    with pytest.raises(BackendError, match=words):
        prepare(network, Weak())


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_entries_that_learn_by_one_rule_are_computed_together(backend: str) -> None:
    """Whatever their parameters, signals and delays are, and what stands between them."""
    head = "neurovis: 1\nname: x\nneurons: {A: {count: 3, bias: i + 1}, B: {count: 2}, T: {count: 2, bias: 0.5*i}}\n"
    entries = [
        "A1 -> B1: {weight: 0, plasticity: {delta: {rate: 0.1, target: T1}}}",
        "A2 -> B1: 0.5",
        "A3 -> B2: {weight: 0.1, delay: 3, plasticity: {delta: {rate: 0.2, target: T2}}}",
        "A2 -> B2: {weight: 0, plasticity: oja}",
        "A1 -> B2: {weight: 0.2, plasticity: {delta: {target: T1}}, bounds: [0, 0.3]}",
    ]
    network = compile_text(head + "connections:\n" + "".join(f"  {entry}\n" for entry in entries))
    assert [rule.members.tolist() for rule in network.network.projections] == [[0, 2, 4], [3]]
    titles = network.network.connections.learns
    assert titles[2] == "delta(rate=0.2, target=T2)"
    assert titles[1] is None
    # the same rules under names of their own are computed one by one
    apart = "".join(f"  {entry.replace('delta:', f'delta{i}:')}\n" for i, entry in enumerate(entries))
    rule = "{parameters: {rate: 0.01}, signals: [target], weight: {each_step: weight + rate*pre*(target - post)}}"
    rules = "".join(f"  delta{i}: {rule}\n" for i in (0, 2, 4))
    alone = compile_text(f"{head}rules:\n{rules}connections:\n{apart}")
    assert len(alone.network.projections) == 4
    expected, found = alone.run(20, backend=backend), network.run(20, backend=backend)
    np.testing.assert_array_equal(found.weights, expected.weights)
