"""What flows in definitions, and how their derivatives depend on their own states."""

from __future__ import annotations

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

import neurovis_spec as nv
from neurovis_spec.cli.overview import overview
from neurovis_spec.compiler.flows import (
    flows_by,
    jacobian,
    known_behind_flow,
    plain_flow,
    ports_read_by,
    reads,
    with_slope,
)
from neurovis_spec.compiler.program import Definition
from neurovis_spec.compiler.values.definitions import sorted_by_need
from neurovis_spec.language.expressions.evaluate import evaluate

HEAD = "neurovis: 1\nname: f\ntime: {dt: 0.1}\n"
CONSTANTS = {"pi": np.pi, "e": np.e, "dt": 0.1, "t": 0.3, "k": 3.0}


def model(body: str, group: str = "") -> Definition:
    """The model of a spec with one neuron."""
    return both(body, group)[0]


def both(body: str, group: str = "") -> tuple[Definition, Definition]:
    """The model and the activation of a spec with one neuron."""
    text = f"{HEAD}models:\n  m:\n    {body}\nneurons: {{A: {{model: m{group}}}}}"
    (population,) = nv.compile_text(text).network.populations
    return population.model.definition, population.activation.definition


# ---- what is read ------------------------------------------------------------------------------------------------

PORTS = """ports: [a, b, c]
    parameters: {p: 1}
    let: {u: v + a, w: u*p, z: b + k}
    state: {v: {derivative: w - drive}, m: {each_step: m + c}, q: {derivative: -q, each_step: q + z}}
    outputs: {own: v + p*t + dt, through: w, held: m, counted: q + k, both: q + c, mapped: z}
    activity: f(v)"""


def test_what_formulas_read() -> None:
    made = model(PORTS)
    assert reads(made, [made.flows[0].derivative]) == {"v", "a", "p", "drive"}
    assert reads(made, [None, made.state[2].each_step]) == {"q", "b", "k"}
    found = ports_read_by(made)
    assert found.flow == {"a", "drive"}
    assert found.update == {"a", "b", "c"}
    assert found.outputs["through"] == {"a"}
    assert found.outputs["activity"] == frozenset()


@pytest.mark.parametrize(
    ("sent", "ports"),
    [
        ("", ""),
        ("activity", ""),
        ("v", ""),
        ("q", ""),
        ("m", None),
        ("own", ""),
        ("through", "a"),
        ("held", None),
        ("counted", None),
        ("both", "c"),
        ("mapped", None),
    ],
)
def test_what_flows(sent: str, ports: str | None) -> None:
    made = model(PORTS)
    assert flows_by(made, sent) == (None if ports is None else frozenset(ports))
    assert plain_flow(made, sent) == (ports == "")


# ---- the Jacobian ------------------------------------------------------------------------------------------------

_NAMES = st.sampled_from(["v", "w", "p", "drive", "a", "1.5", "0.3"])
_FORMULAS = st.recursive(
    _NAMES,
    lambda parts: st.one_of(
        st.tuples(parts, st.sampled_from("+-*"), parts).map(lambda one: f"({' '.join(one)})"),
        st.tuples(st.sampled_from(["sin", "tanh", "f", "sigmoid"]), parts).map(lambda one: f"{one[0]}({one[1]})"),
        parts.map(lambda one: f"(0.3*{one})^3"),
        parts.map(lambda one: f"exprel(0.2*{one})"),
    ),
    max_leaves=4,
)


@settings(max_examples=25, deadline=None)
@given(_FORMULAS, _FORMULAS, _FORMULAS, st.sampled_from(["tanh", "sigmoid", "gaussian"]))
def test_the_jacobian_is_that_of_finite_differences(x: str, y: str, dv: str, activation: str) -> None:
    body = f"""ports: [a]
    parameters: {{p: 0.7}}
    let: {{x: "{x} + v", y: "{y} - w*x"}}
    state: {{v: {{derivative: "{dv} + y*x"}}, w: {{derivative: "x*w - {dv}"}}}}
    activity: v"""
    made, shape = both(body, f", activation: {activation}")
    shape = with_slope(shape)
    assert with_slope(shape) is shape
    found = jacobian(made)
    point = CONSTANTS | {"v": 0.4, "w": -0.6, "p": 0.7, "a": 0.9, "drive": 0.25}
    functions = {
        name: lambda u, tree=tree: evaluate(tree, CONSTANTS | {"x": u, "sigma": 1.0})
        for name, tree in shape.functions.items()
    }

    def derivative(state: int, at: dict[str, float]) -> float:
        known = dict(at)
        for name, tree in made.let:
            known[name] = evaluate(tree, known, functions)
        derivative = made.flows[state].derivative
        assert derivative is not None
        return evaluate(derivative, known, functions)

    known = dict(point)
    for name, tree in (*made.let, *found.let):
        known[name] = evaluate(tree, known, functions)
    for number, name in enumerate("vw"):
        h = 1e-5
        near = [derivative(number, point | {name: point[name] + side * h}) for side in (1, -1)]
        wanted = (near[0] - near[1]) / (2 * h)
        got = evaluate(found.diagonal[name], known, functions)
        assert got == pytest.approx(wanted, rel=1e-5, abs=1e-6 * max(1.0, *map(abs, near)))


def test_only_what_the_diagonal_needs_is_computed() -> None:
    found = jacobian(
        model("let: {x: 2*v, y: x*v*w}\n    state: {v: {derivative: -x}, w: {derivative: v}}\n    activity: y")
    )
    assert found.let == ()
    assert evaluate(found.diagonal["v"], {}) == -2.0
    assert evaluate(found.diagonal["w"], {}) == 0.0


# ---- the order of intermediate values ----------------------------------------------------------------------------


@settings(max_examples=40)
@given(st.permutations("abcdef"), st.data())
def test_names_come_behind_what_they_need_and_else_stay(names: list[str], data: st.DataObject) -> None:
    ranks = data.draw(st.permutations(names))
    needs = {
        name: data.draw(st.sets(st.sampled_from(ranks[: ranks.index(name)]))) if ranks.index(name) else set[str]()
        for name in names
    }
    order, circle = sorted_by_need(needs)
    assert circle == []
    assert sorted(order) == sorted(names)
    assert all(order.index(need) < order.index(name) for name in names for need in needs[name])
    assert sorted_by_need({name: needs[name] for name in order}) == (order, [])  # a valid order stays
    for place, name in enumerate(order):  # nothing that is written earlier could come here
        could = [one for one in order[place:] if needs[one] <= set(order[:place])]
        assert name == min(could, key=names.index)


@settings(max_examples=30)
@given(st.integers(1, 5), st.sets(st.sampled_from("abcdef")))
def test_who_needs_each_other_is_named_from_the_first_on(length: int, others: set[str]) -> None:
    names = [f"c{number}" for number in range(length)]
    needs = {name: [names[(number + 1) % length]] for number, name in enumerate(names)}
    order, circle = sorted_by_need({one: ["c0"] for one in sorted(others)} | needs)
    assert circle == names
    assert order == [*sorted(others), *names]


def test_let_in_another_order_is_the_same_network() -> None:
    rest = "state: {v: {derivative: -z}}\n    activity: y"
    hashes = {
        nv.compile_text(f"{HEAD}models:\n  m:\n    let: {{{let}}}\n    {rest}\nneurons: {{A: {{model: m}}}}").hash
        for let in ("x: 2*v, y: x + 1, z: y*x", "z: y*x, x: 2*v, y: x + 1", "y: x + 1, x: 2*v, z: y*x")
    }
    assert len(hashes) == 1


# ---- powers ------------------------------------------------------------------------------------------------------


def test_written_cubes_are_products_where_something_flows() -> None:
    flowing = model(
        'let: {c: v^3}\n    state: {v: {derivative: "-c - v^4 + pow(v, 3) + v^2 + v^(2 + 1)"}}\n    activity: v'
    )
    made = flowing.flows[0].derivative
    v = 1.3
    known = {"v": v, "c": evaluate(dict(flowing.let)["c"], {"v": v})}
    assert known["c"] == (v * v) * v
    assert made is not None
    assert evaluate(made, known) == -((v * v) * v) - ((v * v) * v) * v + v**3.0 + v * v + v**3.0
    still = model("let: {c: v^3}\n    state: {v: {each_step: -c}}\n    activity: v")
    assert evaluate(dict(still.let)["c"], {"v": v}) == v**3.0
    assert v**3.0 != (v * v) * v


# ---- the content -------------------------------------------------------------------------------------------------

CONTENT = """
    parameters: {tau: 2}
    ports: [a, b]
    state: {v: {derivative: (a + b - v)/tau, noise: 0.1}, w: {derivative: -w}}
    outputs: {x: v*w, y: w}
    activity: v"""


def hash_of(body: str) -> str:
    return nv.compile_text(f"{HEAD}models:\n  m:{body}\nneurons: {{A: {{model: m}}}}").hash


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("{tau: 2}", "{tau: {value: 2, unit: s}}"),
        ("[a, b]", "{b: {unit: pA}, a: sum}"),
        ("-w}", "-w, unit: mV}"),
        ("{x: v*w, y: w}", "{y: w, x: v*w}"),
        ("activity: v", "activity: v\n    send: activity\n    time: s"),
    ],
)
def test_what_is_shown_and_the_order_of_names_are_no_content(old: str, new: str) -> None:
    assert hash_of(CONTENT.replace(old, new)) == hash_of(CONTENT)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("derivative: -w", "derivative: -2*w"),
        ("derivative: -w", "each_step: -w"),
        ("noise: 0.1", "noise: 0.2"),
        (", noise: 0.1", ""),
        ("[a, b]", "[a, b, c]"),
        ("[a, b]", "{a: sum, b: product}"),
        ("y: w", "y: 2*w"),
        ("y: w", "z: w"),
        ("activity: v", "activity: v\n    send: w"),
        ("activity: v", "activity: v\n    time: ms"),
    ],
)
def test_what_a_run_depends_on_is_content(old: str, new: str) -> None:
    assert hash_of(CONTENT.replace(old, new)) != hash_of(CONTENT)


# ---- what is too long to be differentiated -----------------------------------------------------------------------

LONG = "*".join(f"sin(x + {number})" for number in range(30))


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_a_long_derivative_is_no_matter_where_its_own_is_not_needed(backend: str) -> None:
    text = f"""{HEAD}models:
  m: {{state: {{x: {{initial: 0.3, derivative: {LONG}}}}}, activity: f(x)}}
activations: {{a: {{value: {LONG}}}}}
neurons: {{M: {{model: m, activation: a}}}}"""
    run = nv.compile_text(text).run(3, backend=backend)
    assert np.isfinite(run.activity).all()


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_a_state_without_a_formula_is_constant_as_a_parameter_is(backend: str) -> None:
    """What reads it flows, so that a connection has delay 0 by default, and the run is the same."""
    text = f"""{HEAD}models:
  m:
    parameters: {{p: 1}}
    state: {{v: {{initial: 1, derivative: drive - v}}, g: {{initial: 1}}}}
    activity: tanh(GAIN*v)
neurons: {{A: {{model: m, count: 3, INITIAL}}}}
connections: {{A -> A: {{weight: 2*i - j, pattern: all_to_all}}}}"""
    drawn = text.replace("GAIN", "g").replace("INITIAL", "initial: {g: [1, 2, 0.5]}")
    given = text.replace("GAIN", "p").replace("model: m, count: 3, INITIAL", "model: {m: {p: [1, 2, 0.5]}}, count: 3")
    runs = [nv.compile_text(one).run(6, backend=backend) for one in (drawn, given)]
    assert nv.compile_text(drawn).network.connections.delays.whole().max() == 0
    assert np.array_equal(runs[0].activity, runs[1].activity)


@pytest.mark.parametrize(("more", "known"), [("", True), (", each_step: 2*v", False), (", each_episode: 0", False)])
def test_what_a_step_changes_is_not_known_ahead_of_it(more: str, known: bool) -> None:
    made = model(f"state: {{v: {{derivative: -v{more}}}}}\n    outputs: {{twice: 2*v}}\n    activity: v")
    assert known_behind_flow(made, "twice") == known


def test_an_activation_in_a_derivative_is_used() -> None:
    text = f"{HEAD}models: {{m: {{state: {{v: {{derivative: f(drive) - v}}}}, activity: v}}}}\n"
    assert nv.compile_text(f"{text}neurons: {{A: {{model: m, activation: tanh, bias: 1}}}}").warnings == ()


# ---- what is taken at a stage ------------------------------------------------------------------------------------

RATE = """
    ports: [q]
    state: {v: {initial: 1, derivative: drive - v}}
    outputs: {rate: v + drive, more: q}
    activity: v
"""
RATES = f"models:\n  cell: {RATE}  same: {RATE}"
BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_neuron_may_send_what_reads_a_port_beside_what_reads_none(backend: str) -> None:
    """A.v -> B.rate -> A.rate is no loop: the first of these reads nothing."""
    text = f"""{HEAD}{RATES}neurons: {{A: {{model: cell}}, B: {{model: cell}}, C: {{model: cell}}}}
connections:
- A -> B: {{send: v, delay: 0}}
- B -> A: {{send: rate, delay: 0, weight: 0.3}}
- A -> C: {{send: rate, delay: 0}}
"""
    m = np.array([[0.3 - 1, 0.3, 0], [1, -1, 0], [1.3, 0.3, -1]])  # x' = m x
    values, vectors = np.linalg.eig(m)
    exact = (vectors @ np.diag(np.exp(0.5 * values)) @ np.linalg.inv(vectors) @ np.ones(3)).real
    np.testing.assert_allclose(nv.compile_text(text).run(6, backend=backend).activity[5], exact, rtol=1e-6)


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_taken_is_made_behind_what_it_reads(backend: str) -> None:
    """Also where a neuron that is updated together with others reads more of a stage than these."""
    text = f"""{HEAD}{RATES}neurons: {{GROUPS, X: {{model: cell}}, Y: {{model: cell, bias: 1}},
  Z: {{model: cell}}, M: {{count: 3}}}}
connections:
- Y -> X: {{send: rate, delay: 0}}
- X -> P2: {{send: rate, delay: 0, weight: -0.7}}
- P1 -> Z: {{send: rate, delay: 0}}
- M -> M: {{delay: 0, edges: [[M1, M2], [M2, M3]]}}
- M3 -> P1: {{delay: 0, port: q}}
"""
    together, apart = (
        nv.compile_text(text.replace("GROUPS", groups)).run(5, backend=backend)
        for groups in ("P: {count: 2, model: cell}", "P1: {model: cell}, P2: {model: same}")
    )
    assert np.array_equal(together.activity, apart.activity)


# ---- where a run begins ------------------------------------------------------------------------------------------


def test_an_activity_that_is_a_state_begins_as_the_state() -> None:
    text = f"{HEAD}models: {{m: {{state: {{u: {{initial: 1, derivative: v}}, v: {{derivative: -u}}}}, activity: v}}}}\n"
    state, activity, both = (
        nv.compile_text(f"{text}neurons: {{A: {{count: 3, model: m, initial: {initial}}}}}")
        for initial in ("{v: [1, 2, 3]}", "[1, 2, 3]", "{activity: i + 1, u: 1}")
    )
    assert state.hash == activity.hash != both.hash
    assert [*activity.run(1).activity[0]] == [*both.run(1).activity[0]] == [1, 2, 3]


def test_draws_of_such_an_activity_are_those_of_the_state() -> None:
    text = (
        f"{HEAD}models: {{m: {{state: {{v: {{derivative: -v}}}}, activity: v}}}}\nneurons: {{A: {{count: 3, model: m, "
    )
    drawn = [nv.compile_text(f"{text}initial: {one}}}}}").hash for one in ('"normal(0, 1)"', '{v: "normal(0, 1)"}')]
    assert drawn[0] == drawn[1]


def test_dt_and_t_are_in_the_unit_of_the_definition() -> None:
    """In formulas, initial values and defaults."""
    body = "parameters: {p: 2*dt}, state: {v: {initial: dt, derivative: 1}}, outputs: {o: t, q: p, d: dt}, activity: v"
    text = f"""neurovis: 1
name: x
time: {{dt: 0.002}}
models: {{s: {{{body}}}, ms: {{time: ms, {body}}}}}
neurons: {{A: {{model: s}}, B: {{model: ms}}}}
outputs: {{oa: A.o, ob: B.o, qa: A.q, qb: B.q, da: A.d, db: B.d}}
"""
    found = nv.compile_text(text).run(4)
    for name in ("A", "oa", "qa", "da"):
        other = {"A": "B"}.get(name, f"{name[0]}b")
        assert np.asarray(found[other]).ravel() == pytest.approx(1000 * np.asarray(found[name]).ravel(), rel=1e-12)
    assert np.asarray(found["oa"]).ravel() == pytest.approx([0, 0.002, 0.004, 0.006])
    assert np.asarray(found["A"]).ravel() == pytest.approx([0.002, 0.004, 0.006, 0.008])


def test_a_delay_that_an_edge_writes_is_no_default() -> None:
    neurons = "neurons: {A: {model: leaky, bias: 1}, B: {model: leaky}}"
    written, default = (
        nv.compile_text(f"{HEAD}{neurons}\nconnections: {{A -> B: {body}}}").warnings
        for body in ("{edges: [[A, B, 1, 1]]}", "{edges: [[A, B, 1]]}")
    )
    assert [one.code for one in written] == ["held-coupling"]
    assert "default" not in written[0].message
    assert default == ()


HELD = """inputs:
  ramp: {expression: g*t}
  kept: {expression: g*t, hold: true}
  late: {expression: 1 if t >= 0.2 else 0, hold: true}
parameters: {g: 2}
models: {sum: {state: {v: {derivative: drive}}, activity: v}}
neurons: {R: {model: sum, input: ramp}, H: {model: sum, input: kept}, L: {model: sum, input: late}}
events: [{at: 6, set: {g: 3}}]
"""


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
@pytest.mark.parametrize("method", ["rk4", "heun", "{method: euler, substeps: 3}"])
def test_an_input_that_is_held_is_that_of_the_end_of_the_step(backend: str, method: str) -> None:
    head = HEAD.replace("dt: 0.1", f"dt: 0.1, integrate: {method}")
    made = nv.compile_text(head + HELD).run(10, backend=backend)
    k = np.arange(1, 10)
    seen = np.where(k >= 6, 3, 2) * (k * 0.1)
    assert made["H"] == pytest.approx(np.append(0, np.cumsum(0.1 * seen)), rel=1e-12)
    assert made["L"] == pytest.approx(np.append(0, np.cumsum(0.1 * (k * 0.1 >= 0.2))), rel=1e-12)
    if method == "rk4":
        assert made["R"][:6] == pytest.approx((np.arange(6) * 0.1) ** 2, rel=1e-4)


def test_what_is_held_is_content_where_something_flows_and_does_not_flow() -> None:
    plain, false, held = (
        nv.compile_text(HEAD + HELD.replace(", hold: true", hold)).network
        for hold in ("", ", hold: false", ", hold: true")
    )
    assert plain.hash == false.hash != held.hash
    assert [plain.held_inputs.keys(), held.held_inputs.keys()] == [{"ramp", "kept", "late"}, {"ramp"}]
    static = "inputs: {a: {expression: t%s}}\nneurons: {A: {input: a}}\n"
    hashes = {nv.compile_text(HEAD + static % hold).network.hash for hold in ("", ", hold: true")}
    assert len(hashes) == 1


def test_inspect_says_what_is_held() -> None:
    network = nv.compile_text(HEAD + HELD)
    assert str(network.describe()["inputs"]).count("'hold': True") == 2
    assert overview(network).count("expression, once a step") == 2
