"""What entries with a synapse compile to: definitions in use at both ends, projections, levels, the program."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.cli.overview import overview
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Check, Gather, Integrate, Learn, Receive, SendAhead, Update
from neurovis_spec.compiler.run_checks import without_checks
from neurovis_spec.diagnostics import SpecError
from neurovis_spec.runtime.simulation import Simulation

HEAD = """\
neurovis: 1
name: x
time: {dt: 0.1}
parameters: {tau: 2, lag: 0.5}
models:
  cell:
    parameters: {tau: 1}
    state: {v: {initial: 0.5, derivative: (drive - v)/tau}}
    outputs: {rate: tanh(v), through: v + drive}
    activity: tanh(v)
  theta: {state: {v: {derivative: drive}, tau: {each_step: tau + 1}}, activity: v}
synapses:
  gap: {signal: weight*(pre.v - post.v), sign: 0}
  scaled: {parameters: {lag: 0}, signal: weight*(pre.v - lag)/post.tau}
  low: {state: {g: {derivative: pre - g}}, signal: weight*g}
  map: {state: {x: {each_step: x + 0.1*(pre - x)}}, signal: weight*x}
  graded: {signal: weight*pre.through}
  divided: {signal: "weight*clip(1/pre, -1, 1)"}
  timed: {signal: weight*post.v*sin(t)}
  fixed: {state: {share: {initial: 0.5}}, signal: weight*share*pre.v}
  sampled: {signal: weight*pre.v*k}
rules:
  approach: {state: {q: {each_step: 0.5*q + post.tau*pre.v}}, weight: {each_step: weight + 0.1*q}}
  slow: {state: {c: {derivative: pre*post - c}}, weight: {derivative: 0.1*c}}
inputs: {s: {expression: sin(t)}}
neurons:
  A: {count: 2, model: {cell: {tau: tau}}, bias: 1}
  B: {count: 2, model: cell}
  P: {model: theta}
  S: {input: s}
  M: {model: leaky_integrator}
connections:
"""


def network_of(*entries: str, head: str = HEAD) -> Network:
    return nv.compile_text(head + "".join(f"  - {entry}\n" for entry in entries)).network


def program_of(*entries: str) -> list[str]:
    """Who is integrated, updated and so on, in order: groups by their names, projections by their definitions."""
    network = network_of(*entries)
    group = [one.name for one in network.neurons.groups for _ in one.indices]
    called = [group[one.members[0]] for one in network.populations]
    learned = [one.use.definition.name for one in network.projections]
    result = []
    for operation in network.program:
        match operation:
            case Update(population=one):
                result.append(called[one])
            case Integrate(populations=several, projections=joined):
                result.append(" ".join(["integrate", *(called[one] for one in several), *(learned[n] for n in joined)]))
            case SendAhead(population=one, names=names):
                result.append(f"ahead {called[one]} {' '.join(names)}")
            case Receive(projection=one) | Learn(projection=one):
                result.append(learned[one])
    return result


# What is at the ends


def test_what_is_read_of_the_ends_is_found_among_activities_and_outlets() -> None:
    network = network_of("A -> B: {synapse: gap, pattern: one_to_one}")
    (projection,) = network.projections
    state = Simulation(network, backend="reference").state()
    taken = np.concatenate((np.zeros(len(network.neurons)), np.zeros(network.outlet_count)))
    for outlet in network.outlets:
        members = network.populations[outlet.population].members
        taken[len(network.neurons) + outlet.start + np.arange(len(members))] = 10 * members + len(outlet.name)
    assert projection.kind.name == "synapse"
    assert taken[projection.ends["pre.v"]].tolist() == [1, 11]
    assert taken[projection.ends["post.v"]].tolist() == [21, 31]
    assert len(state.outlets) == network.outlet_count


def test_a_parameter_of_an_end_is_set_where_it_is_read() -> None:
    network = network_of("B + A -> B + A: {synapse: {scaled: {lag: lag}}, pattern: all_to_all, self: true}")
    (projection,) = {one.use.definition.name: one for one in network.projections}.values()
    given = {name: values.tolist() for name, values in projection.use.parameters.items()}
    assert given == {"lag": [0.5] * 16, "post.tau": [1, 1, 2, 2] * 4}
    simulation = Simulation(network, backend="reference")
    simulation.set(tau=4, lag=3)
    bound = {one.array.text: one for one in network.settable.bindings}
    (at_ends,) = (one for name, one in bound.items() if name.endswith("post.tau"))
    assert at_ends.places.tolist() == [place for place in range(16) if place % 4 > 1]
    simulation.step()
    parameters = simulation.state().conditions.variables
    start = network.settable.variables[at_ends.array].start
    assert parameters[start : start + 16].tolist() == [1, 1, 4, 4] * 4


def test_what_is_set_at_an_end_counts_from_then_on() -> None:
    network = network_of("A -> A: {synapse: scaled, pattern: ring, delay: 1}")
    rows = []
    for backend, tau in (("reference", 4), ("numpy", 4), ("numpy", 2)):
        simulation = Simulation(network, backend=backend)
        for k in range(8):
            if k == 4:
                simulation.set(tau=tau)
            simulation.step()
        rows.append(simulation.activity.copy())
    np.testing.assert_allclose(rows[0], rows[1], rtol=1e-13)
    assert np.abs(rows[1] - rows[2]).max() > 0.01


def test_a_list_at_an_end_is_set_one_by_one() -> None:
    head = HEAD.replace("{cell: {tau: tau}}", "{cell: {tau: [3, tau*lag]}}")
    network = network_of("B -> A2 + A1: {synapse: scaled, pattern: all_to_all}", head=head)
    scaled = next(one for one in network.projections if one.use.definition.name == "scaled")
    assert scaled.use.parameters["post.tau"].tolist() == [1, 3, 1, 3]
    found = [one for one in network.settable.bindings if one.array.text.endswith("post.tau")]
    assert [one.places.tolist() for one in found] == [[0, 2]]
    assert np.broadcast_to(found[0].formula.values(np.array([8.0, 0.5])), 2).tolist() == [4, 4]


def test_what_is_a_parameter_here_and_a_state_there_is_of_two_projections() -> None:
    network = network_of("A + P -> P + B: {synapse: scaled, pattern: all_to_all}")
    found = {tuple(one.use.definition.parameters): one for one in network.projections}
    assert {names: one.members.tolist() for names, one in found.items()} == {
        ("lag",): [0, 3],
        ("lag", "post.tau"): [1, 2, 4, 5, 6, 7],
    }
    assert sorted(found["lag",].ends) == ["post.tau", "pre.v"]
    assert sorted(found["lag", "post.tau"].ends) == ["pre.v"]


def test_rules_read_the_ends_as_synapses_do() -> None:
    network = network_of("A -> B: {pattern: one_to_one, plasticity: approach}", "A -> P: {plasticity: approach}")
    one, other = network.projections
    assert network.connections.rules.tolist() == [0, 0, 1, 1]
    assert one.use.parameters["post.tau"].tolist() == [1, 1]
    assert sorted(one.ends) == ["pre.v"]
    assert sorted(other.ends) == ["post.tau", "pre.v"]


# Projections


def test_rules_come_first_and_synapses_are_apart_by_their_targets() -> None:
    network = network_of(
        "A -> B: {synapse: low, pattern: one_to_one}",
        "A -> M: {synapse: low, pattern: all_to_all, plasticity: hebbian}",
        "B -> M: {plasticity: hebbian, pattern: all_to_all}",
        "B -> B: {synapse: low, pattern: one_to_one, delay: 1}",
    )
    assert [(one.use.owner, one.use.definition.name, one.members.tolist()) for one in network.projections] == [
        (("rule", 0), "hebbian", [2, 3, 4, 5]),
        (("synapse", 1), "low", [0, 1, 6, 7]),
        (("synapse", 2), "low", [2, 3]),
    ]
    assert network.connections.rules.tolist() == [-1, -1, 0, 0, 0, 0, -1, -1]
    assert network.connections.synapses == ("low", "low", None, "low")


def test_the_states_of_synapses_are_referred_to_and_recorded() -> None:
    text = HEAD + "  A -> B: {synapse: low, pattern: one_to_one}\n" + "outputs: {g: (A -> B).g, one: (A2 -> B2).g}\n"
    compiled = nv.compile_text(text)
    recording = compiled.run(6, backend="reference", states=["(A -> B).g"])
    signals = ("(A1 -> B1).signal", "(A2 -> B2).signal")  # by which pictures of it colour these connections
    assert recording.state_names == ("(A1 -> B1).g", "(A2 -> B2).g", *signals)
    assert (recording.states[-1] > 0.01).all()
    with pytest.raises(KeyError, match=r"the synapse 'low' of 'A -> B' has no state 'h'; its states are: g"):
        compiled.run(1, backend="reference", states=["(A -> B).h"])


# Delays that nobody names


@pytest.mark.parametrize(
    ("entry", "delay"),
    [
        ("A1 -> B1: {synapse: gap}", 0),
        ("A1 -> M: {synapse: low}", 0),  # whatever the target does with it
        ("A1 -> B1: {synapse: graded}", 1),  # it reads a port
        ("S -> B1: {synapse: low}", 1),  # the source does not flow
        ("P -> B1: {synapse: scaled}", 0),
        ("A1 -> B1: {synapse: timed}", 0),  # it takes nothing of its source
        ("A1 -> M: {}", 1),
    ],
)
def test_the_delay_is_0_where_all_that_is_read_of_the_source_flows(entry: str, delay: int) -> None:
    network = network_of(entry)
    assert network.connections.delays.tolist() == [delay]
    assert network.connections.undelayed == ((0,) if delay == 0 else ())


def test_edges_with_delays_of_their_own_have_none_by_default() -> None:
    network = network_of(
        "A -> B: {synapse: gap, edges: [[A1, B1, 1, 2], [A2, B2, 1, 0]]}",
        "B -> A: {synapse: gap, edges: [[B1, A1, 1, 2], [B2, A2]]}",
    )
    assert network.connections.delays.tolist() == [2, 0, 2, 0]
    assert network.connections.undelayed == (1,)


# Levels


def test_a_signal_is_formed_at_each_stage_whatever_its_delay() -> None:
    network = network_of(
        "A1 -> B1: {synapse: gap, delay: 3}", "A1 -> B1: 2", "A2 -> B1: {delay: 0}", "S -> B1: {synapse: map}"
    )
    (port,) = (one.drive for one in network.populations if network.neuron_index["B1"] in one.members)
    assert port.incoming.tolist() == [0, 1, 2, 3]
    assert port.staged is not None
    assert port.staged.tolist() == [0, 1, 2, 3]
    assert network.connections.delays.tolist() == [3, 0, 0, 1]


def test_states_of_synapses_are_integrated_with_those_of_neurons() -> None:
    found = program_of("S -> M: {synapse: low}")
    assert "integrate A P low" in found
    assert found.index("integrate A P low") < found.index("M")


@pytest.mark.parametrize(
    ("entries", "before", "after"),
    [
        (["M -> B1: {synapse: low, delay: 0}"], "M", "integrate A P low"),  # a derivative of the synapse reads it
        (["S -> B1: {synapse: map, delay: 0}"], "S", "map"),
        (["M -> A1: {synapse: map, delay: 0}"], "M", "map"),
        (["A1 -> M: {synapse: low}"], "integrate A P low", "M"),
        (["A1 -> M: {synapse: graded, delay: 0}"], "A", "M"),
    ],
)
def test_what_reaches_a_synapse_without_delay_is_made_before_it(entries: list[str], before: str, after: str) -> None:
    found = program_of(*entries)
    assert found.index(before) < found.index(after)


def test_nobody_waits_for_the_other_way_of_a_gap_junction() -> None:
    """All of these read the port at the end of the step, too: what they read of each other is known by then."""
    found = program_of("A -> A: {synapse: gap, pattern: all_to_all}")
    assert found.index("integrate A P") < found.index("ahead A v") < found.index("A")


@pytest.mark.parametrize(
    "entries",
    [
        ["A1 -> B1: {synapse: gap}", "B1 -> A1: {synapse: graded, delay: 0}", "A1 -> B1: {send: through, delay: 0}"],
        ["A1 -> A2: {synapse: graded, delay: 0}", "A2 -> A1: {synapse: graded, delay: 0}"],
    ],
)
def test_outputs_that_read_each_other_in_a_stage_are_a_loop(entries: list[str]) -> None:
    with pytest.raises(nv.SpecError, match=r"within one stage: A1\.through -> (B1|A2)\.through -> A1\.through"):
        network_of(*entries)


def test_an_output_of_the_target_that_reads_the_same_port_is_a_loop() -> None:
    head = HEAD.replace("signal: weight*pre.through", "signal: weight*(pre.v - post.through)")
    with pytest.raises(nv.SpecError, match=r"within one stage: B1\.through -> B1\.through"):
        network_of("A1 -> B1: {synapse: graded}", head=head)


@pytest.mark.parametrize("synapse", ["sampled", "map"])
def test_what_does_not_flow_is_held_on_its_way(synapse: str) -> None:
    """``through`` of B reads what arrives, so that with a signal that is sampled it is not made anew in a step."""
    entries = "B1 -> A2: {send: through, delay: 0}", "A1 -> B1: {synapse: %s, delay: 0}"
    network = network_of(entries[0], entries[1] % "gap")
    (port,) = (one.drive for one in network.populations if network.neuron_index["A2"] in one.members)
    assert port.staged is not None
    assert network.connections.targets[port.incoming[port.staged]].tolist() == [1]
    with pytest.raises(nv.SpecError, match="within one step: the integration -> B1 -> the integration"):
        network_of(entries[0], entries[1] % synapse)


def test_a_state_without_a_formula_holds_nothing() -> None:
    """It is as a parameter: neurons whose outputs read the port may drive each other in a stage."""
    there, back = "A1 -> B1: {synapse: fixed}", "B1 -> A1: {send: through, delay: 0}"
    assert network_of(there, back).connections.delays.tolist() == [0, 0]


def test_delayed_signals_take_no_slots_and_are_remembered() -> None:
    network = network_of("A1 -> B1: {synapse: gap, delay: 3}", "A1 -> B1: {delay: 2}")
    state = Simulation(network, backend="reference").state()
    assert len(state.signals) == 2
    assert state.history.shape == (4, len(network.neurons) + network.outlet_count)


def test_what_is_remembered_fits_into_memory() -> None:
    spec = {
        "neurovis": 1,
        "name": "long",
        "synapses": {"s": {"signal": "weight*pre"}},
        "neurons": {"E": {"count": 300}},
        "connections": {"E1 -> E2": {"synapse": "s", "delay": 1_000_000}},
    }
    with pytest.raises(SpecError, match="300,000,000 numbers would be kept for a synapse"):
        nv.compile(spec)


def test_what_a_rule_remembers_fits_into_memory() -> None:
    rules = {"past": {"weight": {"each_step": "weight + pre"}}, "now": {"weight": {"each_step": "weight + post"}}}
    spec = {
        "neurovis": 1,
        "name": "long",
        "rules": rules,
        "neurons": {"E": {"count": 300}},
        "connections": {"E1 -> E2": {"plasticity": "past", "delay": 1_000_000}},
    }
    with pytest.raises(SpecError, match="300,000,000 numbers would be kept for a rule that reads 'pre'"):
        nv.compile(spec)
    nv.compile(spec | {"connections": {"E1 -> E2": {"plasticity": "now", "delay": 1_000_000}}})


# Checks in a run


def test_a_division_that_is_swallowed_is_looked_for_once_a_step() -> None:
    network = network_of("S -> M: {synapse: divided}")
    (projection,) = network.projections
    assert [type(one) for one in projection.use.definition.state] == [Check]
    population = next(
        number for number, one in enumerate(network.populations) if network.neuron_index["M"] in one.members
    )
    received = Receive(0, ("each_step",))
    place = network.program.index(received)
    assert network.program[place + 1] == Gather(population)
    assert received not in without_checks(network).program
    simulation = Simulation(network, backend="reference")
    with pytest.warns(RuntimeWarning, match="the synapse 'divided' divides by 0 for S -> M after step 0"):
        simulation.step()


# What it is


def test_a_network_says_what_its_synapses_do() -> None:
    compiled = nv.compile_text(
        HEAD
        + """\
  - A -> B: {synapse: {scaled: {lag: lag}}, pattern: one_to_one}
    S -> B: {weight: 0.5, pattern: all_to_all}
  - A -> B: {synapse: low, pattern: one_to_one, delay: 2}
    S -> M: {synapse: map}
"""
    )
    told = overview(compiled)
    program = told[told.index("program\n") :].split("\n\n")[0].splitlines()
    assert program == [
        "program",
        "  integrate  A           v (rk4)",
        "  integrate  P           v (rk4)",
        "  integrate  B           v (rk4)",
        "  integrate  A -> B (2)  g (rk4)",
        "  update     S",
        "  receive    S -> M      x",
        "  update     M",
        "  update     A",
        "  update     P",
        "  update     B",
        "  made anew at each stage                        A -> B",
        "  formed at each stage, of what was sent before  A -> B (2)",
        "  held over a step                               S -> B",
        "  delay 0 by default                             A -> B",
    ]
    entries = compiled.describe()["connections"]
    assert isinstance(entries, list)
    described = [one.get("synapse") for one in entries]
    assert described == ["scaled", "scaled", None, None, "low", "low", "map"]


def hash_of(**changes: str) -> str:
    head = HEAD
    for old, new in changes.items():
        head = head.replace(
            {"lag": "lag: 0}", "signal": "pre.v - lag", "sign": "sign: 0", "model": "tau: tau"}[old], new
        )
    return network_of("A -> B: {synapse: scaled, pattern: one_to_one}", "A1 -> B2: {synapse: gap}", head=head).hash


def test_its_hash_says_what_synapses_are_and_not_how_they_look() -> None:
    plain = hash_of()
    assert hash_of(sign="sign: 1") == plain
    assert len({plain, hash_of(lag="lag: 1}"), hash_of(signal="pre.v + lag"), hash_of(model="tau: 3")}) == 4
    text = HEAD.replace("name: x", "name: y")
    assert network_of("A1 -> B1: {}").hash == network_of("A1 -> B1: {}", head=text.replace("name: y", "name: x")).hash


# A law


def _plain(text: str) -> str:
    return text.replace("SYNAPSE", "")


def _weighted(text: str) -> str:
    return text.replace("SYNAPSE", "synapse: weighted, ")


MAP = """\
neurovis: 1
name: law
synapses: {weighted: {signal: weight*pre}}
inputs: {s: {expression: sin(t)}}
neurons: {A: {count: 3, activation: tanh, input: s}, B: {count: 3, model: leaky_integrator, combine: COMBINE}}
connections:
"""


@given(
    combine=st.sampled_from(["sum", "product"]),
    delays=st.lists(st.integers(0, 3), min_size=1, max_size=4),
    weights=st.lists(st.floats(-2, 2), min_size=4, max_size=4),
)
@settings(max_examples=20, deadline=None)
def test_a_synapse_that_says_what_connections_do_changes_nothing(
    combine: str, delays: list[int], weights: list[float]
) -> None:
    entries = [
        f"  - A -> B: {{SYNAPSEweight: {weight!r}, pattern: one_to_one, delay: {delay}}}\n"
        for delay, weight in zip(delays, weights, strict=False)
    ]
    text = MAP.replace("COMBINE", combine) + "".join(entries)
    one, other = (nv.compile_text(made(text)).run(8, backend="reference").activity for made in (_plain, _weighted))
    np.testing.assert_array_equal(one, other)


FLOWS = """\
neurovis: 1
name: law
time: {dt: 0.1, integrate: METHOD}
models:
  cell: {state: {v: {derivative: drive - v}}, outputs: {r: v + 0.5*drive}, activity: tanh(v)}
synapses: {weighted: {signal: weight*pre}}
neurons: {A: {count: 3, model: cell, bias: 1, initial: {v: 0.3*i}}, B: {count: 3, model: cell}, C: {count: 3}}
connections:
"""


@given(
    method=st.sampled_from(["euler", "rk4", "exponential"]),
    ends=st.lists(st.sampled_from(["A -> B", "B -> A", "A -> A", "A -> C", "C -> B"]), min_size=1, max_size=4),
    delays=st.lists(st.integers(0, 3), min_size=4, max_size=4),
    sends=st.sampled_from(["", "send: v, "]),
)
@settings(max_examples=25, deadline=None)
def test_nor_where_states_flow(method: str, ends: list[str], delays: list[int], sends: str) -> None:
    """But for the order in which what arrives is added up: at a stage what is held comes first."""
    entries = [
        f"  - {end}: {{SYNAPSE{'' if end[0] == 'C' else sends}weight: 0.4, pattern: one_to_one, delay: {delay}}}\n"
        for end, delay in zip(ends, delays, strict=False)
    ]
    text = FLOWS.replace("METHOD", method) + "".join(entries)
    try:
        one = nv.compile_text(_plain(text))
    except nv.SpecError:  # neurons wait for each other: those with a synapse do, too
        with pytest.raises(nv.SpecError):
            nv.compile_text(_weighted(text))
        return
    other = nv.compile_text(_weighted(text))
    first, second = (each.run(12, backend="reference").activity for each in (one, other))
    np.testing.assert_allclose(first, second, rtol=1e-12, atol=1e-13)
