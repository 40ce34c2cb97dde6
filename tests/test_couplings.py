"""What connects neurons whose states flow: ports, what is sent, delays that nobody writes, and the order of a step."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_specs import codes

import neurovis_spec as nv
from neurovis_spec.cli.overview import overview
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Diffuse, Integrate, Send, Update

MODELS = """\
neurovis: 1
name: coupled
time: {dt: 0.001}
models:
  leaky: {state: {v: {derivative: drive - v}}, activity: v}
  direct: {state: {v: {derivative: drive - v}}, outputs: {twice: 2*v}, activity: v + 0.5*drive}
  cell:
    ports: {q: sum, p: product}
    state: {v: {derivative: f(drive) + p - v, noise: 0.1}}
    outputs: {rate: v + q}
    activity: v
    send: rate
  counter: {state: {n: {each_step: n + drive}}, activity: n}
"""


def compiled(text: str) -> Network:
    """The network of the models with neurons and connections."""
    return nv.compile_text(MODELS + text).network


def errors(text: str) -> set[str]:
    """The codes of its errors."""
    with pytest.raises(nv.SpecError) as caught:
        compiled(text)
    return {one.code for one in caught.value.diagnostics if one.severity == "error"}


# ---- ports and what is sent --------------------------------------------------------------------------------------


def test_a_connection_leads_to_ports_with_factors() -> None:
    network = compiled("""\
parameters: {half: 0.5}
neurons: {A: {count: 2, bias: 1}, B: {model: cell}}
connections:
- A -> B: {weight: 2, pattern: all_to_all, port: {drive: 1, q: half}}
- A -> B: {pattern: all_to_all, port: p}
- A -> B: {pattern: all_to_all}
""")
    (of,) = [one for one in network.populations if one.model.definition.name == "cell"]
    assert [(port.name, port.combine) for port in of.ports] == [("drive", "sum"), ("q", "sum"), ("p", "product")]
    assert [port.incoming.tolist() for port in of.ports] == [[0, 1, 4, 5], [0, 1], [2, 3]]
    assert [None if port.factors is None else port.factors.tolist() for port in of.ports] == [None, [0.5, 0.5], None]
    assert "half" in network.structural


def test_what_leads_to_another_port_is_another_connection() -> None:
    text = """\
neurons: {A: {bias: 1, count: 2}, B: {model: far, count: 2}}
models: {far: {ports: {q: distance}, activity: drive + q}}
connections:
  A -> B: {port: q, centre: 2, pattern: all_to_all}
  A1 + A2 -> B: {pattern: all_to_all}
"""
    made = nv.compile_text("neurovis: 1\nname: x\n" + text)
    assert made.warnings == ()
    assert made.network.connections.centres.tolist() == [2, 2, 2, 2, 0, 0, 0, 0]
    assert codes(text.replace("port: q", "port: drive")) == ["useless-key"]
    (again,) = nv.compile_text("neurovis: 1\nname: x\n" + text.replace("port: q, centre: 2, ", "")).warnings
    assert again.code == "made-twice"


def test_what_is_plain_is_hashed_as_it_always_was() -> None:
    plain = "{time}neurons: {{A: {{{0}}}, B: {{}}}}\nconnections: {{A -> B: {1}}}\n"
    head = "neurovis: 1\nname: x\nparameters: {b: 2}\ninputs: {s: {expression: t}}\n"
    hashes = {
        nv.compile_text(head + plain.format(group, entry, time=time)).hash
        for group, entry, time in (
            ("bias: b, input: s, noise: 'normal(0, b)'", "{}", ""),
            ("bias: {drive: b}, input: {drive: s}, noise: {drive: 'normal(0, b)'}", "{port: drive}", ""),
            ("bias: b, input: s, noise: 'normal(0, b)'", "{port: {drive: 1}, send: activity}", ""),
            ("bias: b, input: s, noise: 'normal(0, b)'", "{}", "time: {integrate: euler}\n"),
        )
    }
    assert len(hashes) == 1


@pytest.mark.parametrize(
    "change",
    [
        "time: {dt: 0.001, integrate: heun}",
        "time: {dt: 0.001, integrate: {substeps: 2}}",
        "connections: {A -> B: {port: q}}",
        "connections: {A -> B: {port: {drive: 2}}}",
        "connections: {A -> B: {send: activity}}",
        "neurons: {A: {model: cell}, B: {model: cell, bias: {q: 1}}}",
        "neurons: {A: {model: cell}, B: {model: cell, input: {q: s}}}",
        "neurons: {A: {model: cell}, B: {model: cell, noise: {q: 'normal(0, 1)'}}}",
    ],
)
def test_what_is_said_of_ports_and_flows_is_hashed(change: str) -> None:
    parts = {
        "time": "time: {dt: 0.001}",
        "inputs": "inputs: {s: {}}",
        "neurons": "neurons: {A: {model: cell}, B: {model: cell}}",
        "connections": "connections: {A -> B: {}}",
    }
    head = MODELS.replace("time: {dt: 0.001}\n", "")
    before, after = (
        nv.compile_text(head + "\n".join((parts | more).values()) + "\n").hash
        for more in ({}, {change.partition(":")[0]: change})
    )
    assert before != after
    also = {
        "time": "time: {dt: 1 ms, integrate: {method: rk4, substeps: 1}}",
        "connections": "connections: {A -> B: 1}",
    }
    assert nv.compile_text(head + "\n".join((parts | also).values()) + "\n").hash == before


def test_groups_give_to_ports() -> None:
    network = compiled("""\
parameters: {b: 2}
inputs: {s: {size: 2}, u: {expression: t}}
neurons:
  A: {bias: 1}
  B: {model: cell, count: 2, bias: {drive: b, q: [b, 3]}, input: {q: s, p: u}, noise: {q: "normal(0, b)"}}
""")
    neurons = network.neurons
    assert neurons.bias.tolist() == [1, 2, 2]
    assert neurons.port_bias["q"].tolist() == [0, 2, 3]
    assert neurons.input.tolist() == [-1, -1, -1]
    assert {name: places.tolist() for name, places in neurons.port_input.items()} == {"q": [-1, 0, 1], "p": [-1, 2, 2]}
    assert [(one.name, one.port, one.state, one.start) for one in network.noises] == [
        ("B.q", "q", "", 3),
        ("B.v", "", "v", 5),
    ]
    assert network.noise_of("q").tolist() == [-1, 3, 4]
    assert network.noise_of(state="v").tolist() == [-1, 5, 6]
    followed = {binding.array.text: binding.places.tolist() for binding in network.settable.bindings}
    assert followed["bias"] == [1, 2]
    assert followed["bias/0/q"] == [1]


def test_a_bias_of_a_port_follows_a_parameter_in_a_run() -> None:
    text = "parameters: {b: 2}\nneurons: {A: {bias: 1}, B: {model: reader, bias: {q: b}}}\nmodels:\n"
    models = "  reader: {ports: [q], activity: drive + 10*q}\n"
    run = nv.compile_text("neurovis: 1\nname: x\n" + text + models).simulator()
    run.step()
    run.set(b=3)
    run.step()
    assert run.activity.tolist() == [1, 30]


def test_connections_take_what_is_sent() -> None:
    network = compiled("""\
neurons: {A: {model: direct, count: 2}, B: {model: cell}, S: {}}
connections:
- A -> S: {pattern: all_to_all}
- A -> S: {pattern: all_to_all, send: v}
- B -> S: {}
- B -> S: {send: activity}
- B -> S: {send: rate}
""")
    assert [route.sends for route in network.connections.routes] == ["", "v", "", "activity", ""]
    assert [(one.name, one.start) for one in network.outlets] == [("v", 0), ("v", 2), ("rate", 3)]
    assert network.sending is not None
    assert network.sending.tolist() == [0, 1, 4, 5, 7, 2, 7]


# ---- delays that nobody writes ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entry", "delay"),
    [
        ("L -> L", 0),
        ("L -> D", 0),
        ("D -> L", 1),  # its activity reads drive
        ("D -> L: {send: v}", 0),
        ("D -> L: {send: twice}", 0),
        ("C -> L", 1),  # it sends its rate, which reads a port
        ("C -> L: {send: activity}", 0),
        ("L -> C", 0),
        ("L -> C: {port: q}", 1),  # no derivative reads it
        ("L -> C: {port: {q: 1, p: 2}}", 0),
        ("L -> M", 1),
        ("M -> L", 1),
        ("S -> L", 1),
        ("L -> S", 1),
    ],
)
def test_the_delay_of_a_connection_follows_from_the_models(entry: str, delay: int) -> None:
    text = f"connections: {{{entry if ': ' in entry else entry + ': {}'}}}\n"
    groups = "neurons: {L: {model: leaky}, D: {model: direct}, C: {model: cell}, M: {model: counter}, S: {}}\n"
    network = compiled(groups + text)
    assert network.connections.delays.tolist() == [delay]
    assert network.connections.undelayed == ((0,) if delay == 0 else ())


def test_an_entry_has_the_delays_of_its_connections() -> None:
    network = compiled("""\
neurons: {L: {model: leaky}, S: {bias: 1}, T: {model: leaky}}
connections: {L + S -> T: {pattern: all_to_all}}
""")
    assert network.connections.delays.tolist() == [0, 1]


def test_edges_have_delays_of_their_own() -> None:
    network = compiled("""\
neurons: {L: {model: leaky, count: 2}}
connections: {L -> L: {edges: [[L1, L2], [L2, L1, 1, 2 ms], [L1, L1, 1, 1]]}}
""")
    assert network.connections.delays.tolist() == [0, 2, 1]


# ---- the order of a step -------------------------------------------------------------------------------------------


def test_what_reaches_a_derivative_at_once_is_updated_before_the_integration() -> None:
    network = compiled("""\
inputs: {table: {values: [[1], [2]]}}
neurons: {L: {model: leaky}, M: {model: counter, input: table}, S: {}, N: {model: cell}}
connections: {M -> L: {delay: 0}, L -> S: {delay: 0}, L -> N: {}}
""")
    by_number = [one.model.definition.name for one in network.populations]
    order = [
        by_number[step.population] if isinstance(step, Update) else type(step).__name__
        for step in network.program
        if isinstance(step, (Update, Integrate, Diffuse, Send))
    ]
    assert order == ["counter", "Integrate", "Diffuse", "leaky", "cell", "static", "Send"]


def test_what_flows_through_a_static_neuron_is_made_at_each_stage() -> None:
    text = """\
inputs: {{wave: {{{input}}}}}
neurons: {{L: {{model: leaky}}, S: {{input: wave}}, T: {{model: leaky}}}}
connections: {{L -> S: {{delay: 0}}, S -> T: {{delay: 0}}}}
"""
    network = compiled(text.format(input="expression: sin(t)"))
    (integrate,) = [step for step in network.program if isinstance(step, Integrate)]
    assert {network.populations[number].model.definition.name for number in integrate.populations} == {
        "leaky",
        "static",
    }
    assert errors(text.format(input="")) == {"delay-0-cycle"}  # what is supplied is held, so S is made before and after


def test_a_supplied_input_keeps_a_static_neuron_out_of_the_stages() -> None:
    network = compiled("""\
inputs: {hand: {}}
neurons: {S: {input: hand}, T: {model: leaky}}
connections: {S -> T: {delay: 0}}
""")
    (integrate,) = [step for step in network.program if isinstance(step, Integrate)]
    assert [network.populations[number].model.definition.name for number in integrate.populations] == ["leaky"]
    assert [one.model.definition.name for one in network.populations] == ["static", "leaky"]
    assert network.populations[1].drive.staged is None


def test_inspect_shows_the_order_of_a_step() -> None:
    made = nv.compile_text(
        MODELS
        + """\
inputs: {u: {size: 2}}
neurons: {L: {model: leaky, bias: 1}, C: {model: cell, bias: {q: 2}, input: {p: u}, count: 2}, S: {}}
connections: {L -> C: {pattern: all_to_all}, L -> S: {}, S -> C: {port: {p: 0.5}, pattern: all_to_all}}
"""
    )
    lines = [" ".join(line.split()) for line in overview(made).splitlines()]
    program = lines[lines.index("program") + 1 :]
    assert program[: program.index("")] == [
        "integrate L v (rk4)",
        "integrate C v (rk4)",
        "noise C v",
        "update S",
        "update L",
        "update C",
        "made anew at each stage L -> C",
        "held over a step S -> C",
        "delay 0 by default L -> C",
    ]
    assert "S -> C 2 1 1 0.5·p" in lines
    assert any(line.endswith("0, q 2 p u") for line in lines)
    told = made.describe()
    assert told["integrate"] == {"method": "rk4", "substeps": 1}
    connections = told["connections"]
    assert isinstance(connections, list)
    assert [one["ports"] for one in connections] == [{"drive": 1}] * 3 + [{"p": 0.5}] * 2


# ---- a law: levels and stages against a plain reference ------------------------------------------------------------

#: By model: the ports that derivatives read, those that are read once a step, and those that what is sent reads; None
#: where it does not flow.
READS: dict[str, tuple[set[str], set[str], set[str] | None]] = {
    "leaky": ({"drive"}, set(), set()),
    "direct": ({"drive"}, {"drive"}, {"drive"}),
    "cell": ({"drive", "p"}, {"q"}, {"q"}),
    "counter": (set(), {"drive"}, None),
    "static": (set(), {"drive"}, {"drive"}),
}
#: A connection: source, target, port, delay.
Wire = tuple[int, int, str, int]
INTEGRATION = -1


@st.composite
def wirings(draw: st.DrawFn) -> tuple[list[str], list[Wire], list[bool]]:
    """Models of neurons, connections, and which neurons have an input that is supplied."""
    models = draw(st.lists(st.sampled_from(sorted(READS)), min_size=1, max_size=6))
    models.append(draw(st.sampled_from(["leaky", "direct", "cell"])))
    n = len(models)
    wires: list[Wire] = []
    for source, target in draw(st.lists(st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)), max_size=9)):
        port = draw(st.sampled_from(["drive", "q", "p"] if models[target] == "cell" else ["drive"]))
        wires.append((source, target, port, draw(st.sampled_from([0, 0, 0, 1]))))
    return models, wires, draw(st.lists(st.booleans(), min_size=n, max_size=n))


def flows_of(models: list[str], wires: list[Wire], supplied: list[bool]) -> list[bool]:
    """Which neurons send what flows: all that could, until nothing more is found that does not."""
    flows = [READS[model][2] is not None for model in models]
    while True:
        mixed = {(target, port) for source, target, port, delay in wires if delay or not flows[source]}
        mixed |= {(neuron, "drive") for neuron, held in enumerate(supplied) if held}
        found = [
            flows[neuron] and not any((neuron, port) in mixed for port in READS[model][2] or ())
            for neuron, model in enumerate(models)
        ]
        if found == flows:
            return flows
        flows = found


def longest(nodes: Iterable[int], edges: set[tuple[int, int]]) -> dict[int, int] | None:
    """The level of each node: the length of the longest way that leads to it; None where there is a circle."""
    level = dict.fromkeys(nodes, 0)
    for _ in range(len(level) + 1):
        before = dict(level)
        for source, target in edges:
            level[target] = max(level[target], level[source] + 1)
        if level == before:
            return level
    return None


@settings(max_examples=100)
@given(wirings())
def test_levels_are_those_of_a_plain_reference(made: tuple[list[str], list[Wire], list[bool]]) -> None:
    models, wires, supplied = made
    flows = flows_of(models, wires, supplied)
    staged: set[Wire] = set()
    while True:
        passed_on = {(source, port) for source, *_ in staged for port in READS[models[source]][2] or ()}
        more = {
            one for one in wires if not one[3] and flows[one[0]]
            and (one[2] in READS[models[one[1]]][0] or (one[1], one[2]) in passed_on)
        }  # fmt: skip
        if more == staged:
            break
        staged = more
    stages = longest(range(len(models)), {(s, t) for s, t, port, _ in staged if (t, port) in passed_on})
    edges = {(INTEGRATION, neuron) for neuron, model in enumerate(models) if READS[model][0]}
    edges |= {(s, t) for s, t, port, delay in wires if not delay and port in READS[models[t]][1]}
    edges |= {
        (s, INTEGRATION) for s, t, port, delay in wires
        if not delay and port in READS[models[t]][0] and not flows[s]
    }  # fmt: skip
    levels = longest([*range(len(models)), INTEGRATION], edges)
    if levels is None:  # nobody waits for what is made of flow states alone: it is known behind the integration
        ahead = {neuron for neuron, model in enumerate(models) if READS[model][2] == set()}
        levels = longest(
            [*range(len(models)), INTEGRATION],
            {(INTEGRATION if s in ahead and t != INTEGRATION else s, t) for s, t in edges},
        )

    groups = "".join(
        f"  N{number}_: {{model: {model}{', input: hand' if held else ''}}}\n"
        for number, (model, held) in enumerate(zip(models, supplied, strict=True))
    )
    entries = "".join(f"- N{s}_ -> N{t}_: {{port: {port}, delay: {delay}}}\n" for s, t, port, delay in wires)
    text = f"inputs: {{hand: {{}}}}\nneurons:\n{groups}" + (f"connections:\n{entries}" if wires else "")
    if stages is None or levels is None:
        assert errors(text) == {"algebraic-loop" if stages is None else "delay-0-cycle"}
        return
    network = compiled(text)
    for population in network.populations:
        assert {levels[neuron] for neuron in population.members.tolist()} == {population.level}
        assert {stages[neuron] for neuron in population.members.tolist()} == {population.stage}
        for port in population.ports:
            anew = [] if port.staged is None else port.staged.tolist()
            assert [wires[one] in staged for one in port.incoming.tolist()] == [
                place in anew for place in range(len(port.incoming))
            ]
    (integrate,) = [step for step in network.program if isinstance(step, Integrate)]
    making = {neuron for neuron, model in enumerate(models) if READS[model][0]} | {one[0] for one in staged}
    inside = [network.populations[number].members.tolist() for number in integrate.populations]
    assert making <= {neuron for members in inside for neuron in members}
    order = [network.populations[number].stage for number in integrate.populations]
    assert all(before <= after for before, after in pairwise(order))
    at = network.program.index(integrate)
    updated_before = {step.population for step in network.program[:at] if isinstance(step, Update)}
    assert updated_before == {
        number for number, one in enumerate(network.populations) if one.level < levels[INTEGRATION]
    }


@pytest.mark.parametrize(
    ("given", "flows"), [("bias: {q: 1}", True), ("input: {q: hand}", False), ("noise: {q: 'normal(0, 1)'}", False)]
)
@pytest.mark.parametrize("more", ["", "- B -> A: {port: q, delay: 0, send: v}\n"])
def test_what_is_held_at_a_port_is_held_whether_anything_is_connected_there(given: str, flows: bool, more: str) -> None:
    text = f"""\
inputs: {{hand: {{}}}}
neurons: {{A: {{model: cell, {given}}}, B: {{model: cell}}}}
connections:
- A -> B: {{delay: 0}}
{more}"""
    if not flows:  # it is made behind the integration, which would wait for it
        assert errors(text) == {"delay-0-cycle"}
        return
    network = compiled(text)
    (port,) = [port for one in network.populations for port in one.ports if port.name == "drive" and len(port.incoming)]
    assert port.staged is not None


def test_a_neuron_sends_itself_a_state_into_a_port_that_what_it_sends_reads() -> None:
    compiled("""\
neurons: {A: {model: cell, bias: 1}, B: {model: cell}}
connections:
- A -> A: {port: q, send: v, delay: 0}
- A -> B: {port: drive, send: rate, delay: 0}
- B -> A: {port: drive, send: rate, delay: 0}
""")
