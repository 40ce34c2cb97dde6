"""What is left of a run (§5) and of events (§9)."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from small_specs import answer, codes, compiled

import neurovis_spec as nv
from neurovis_spec.compiler.values.draws import Stream

PRINTED = """\
parameters: {phi: 0.049}
inputs: {S: {expression: 1 + phi*k}}
neurons: {S1: {input: S}, K: {count: 3, bias: i + 1}, O: {}}
connections:
  S1 -> K: phi
  K -> O: {weight: 10, delay: 0}
events:
  - {at: 2000, set: {phi: 0.06}}
  - {from: 3000, to: 3200, clamp: {S1: 0}}
  - {at: 3500, lesion: [K3, K -> O]}         # removes neurons or connections from then on
"""


def test_the_events_of_the_contract() -> None:
    """As printed: each at its step already, the clamp until the step before its end."""
    run = compiled(PRINTED).run(4000)
    s, k, o = run["S1"], run["K"], run["O"]
    assert (s[1999], s[2000]) == (1 + 0.049 * 1999, 1 + 0.06 * 2000)
    assert (s[2999], s[3000], s[3199], s[3200]) == (1 + 0.06 * 2999, 0, 0, 1 + 0.06 * 3200)
    assert run.weight("S1 -> K1")[1999:2001].tolist() == [0.049, 0.06]
    assert k[2000, 0] == 1 + 0.049 * s[1999]
    assert k[2001, 0] == 1 + 0.06 * s[2000]
    assert k[3499, 2] != 0
    assert not k[3500:, 2].any()
    assert o[3499] != 0
    assert not o[3500:].any()
    assert run.weight("K1 -> O")[-1] == 10, "a lesioned weight keeps its last value"


def test_a_neuron_may_be_lesioned_as_a_group_a_range_or_a_path() -> None:
    """And a connection as an entry or as a part of one."""
    text = """
modules: {m: {neurons: {K: {count: 3, bias: 1}, O: {}}, connections: {K -> O: {delay: 0}}}}
neurons: {K: {count: 4, bias: 1}, O: {}}
instances: {a: {module: m, count: 2}}
connections: {K -> O: {delay: 0}}
events:
  - {at: 1, lesion: K2..K3}
  - {at: 2, lesion: [K1 -> O, a1.K]}
  - {at: 3, lesion: [K -> O, a2.K1 + a2.K2 -> a2.O]}
"""
    run = compiled(text).run(4)
    assert run["O"].tolist() == [4, 2, 1, 0]
    assert run["a1.O"].tolist() == [3, 3, 0, 0]
    assert run["a2.O"].tolist() == [3, 3, 3, 1]


def test_set_changes_all_that_depends_on_the_parameter() -> None:
    """Weights, biases, input expressions, parameters of activations and models, rates; other parameters follow."""
    text = """
parameters: {g: 1, twice: 2*g}
inputs: {s: {expression: twice}}
neurons:
  A: {input: s}
  B: {bias: twice}
  C: {bias: 1, activation: {leaky_relu: {slope: 0.1}}}
  D: {bias: 8, model: {leaky_integrator: {leak: g/4}}}
  E: {bias: 1, activation: {gaussian: {sigma: g}}}
  F: {}
  G: {}
connections:
  C -> F: {weight: twice, delay: 0}
  C -> G: {weight: 0, delay: 0, plasticity: {hebbian: {rate: g}}}
events: [{at: 2, set: {g: 2}}]
"""
    run = compiled(text).run(4)
    assert run["A"].tolist() == run["B"].tolist() == run["F"].tolist() == [2, 2, 4, 4]
    assert run["D"].tolist() == [2, 3.5, 5.75, 6.875]
    assert run["E"] == pytest.approx(np.exp([-1, -1, -2, -2]))


def test_set_takes_at_alone_and_no_structural_parameter() -> None:
    """A count, a delay, a pattern, a size, an episode: what they depend on cannot be set."""
    for place in (
        "neurons: {A: {count: p, bias: 1}}",
        "neurons: {A: {count: 2, first: p, bias: 1}}",
        "neurons: {A: {bias: 1}}\nconnections: {A -> A: {delay: p}}",
        "neurons: {A: {count: 5, bias: 1}}\nconnections: {A -> A: {pattern: {band: {width: p}}}}",
        "inputs: {s: {size: p}}\nneurons: {A: {count: 3, input: s}}",
        "neurons: {A: {bias: 1}}\ntime: {episode: p}",
        "modules: {m: {neurons: {K: {bias: 1}}}}\ninstances: {a: {module: m, count: p}}",
        "neurons: {A: {count: q, bias: 1}}",
    ):
        text = f"parameters: {{p: 3, q: p}}\n{place}\n"
        assert codes(text + "events: [{at: 2, set: {p: 4}}]") == ["structural-parameter"], place
    text = "parameters: {p: 3}\nneurons: {A: {bias: p}}\nevents: [{from: 2, to: 3, set: {p: 4}}]"
    code, message, _ = answer(text)
    assert code == "bad-event"
    assert "at" in message


def test_a_value_that_an_event_sets_keeps_within_the_bounds_of_the_parameter() -> None:
    """As one that is written or given."""
    text = "parameters: {p: {value: 1, max: 2}}\nneurons: {A: {bias: p}}\nevents: [{at: 2, set: {p: 3}}]"
    assert codes(text) == ["out-of-range"]


def test_an_episode_ends_where_t_plus_1_is_a_multiple_of_m() -> None:
    """The weight that its end gives is w[t + 1], after all of its own steps."""
    text = """
time: {episode: 3}
rules: {count: {state: {n: {each_step: n + 1, each_episode: 0}}, weight: {each_episode: weight + 10^n}}}
neurons: {A: {bias: 1}, B: {}}
connections: {A -> B: {weight: 0, plasticity: count}}
"""
    assert compiled(text).run(8).weights[:, 0].tolist() == [0, 0, 0, 1000, 1000, 1000, 2000, 2000]


def test_sources_come_before_targets_along_delay_0_connections() -> None:
    """In whatever order they are written; with delay 1 each step travels one connection (Eq. 1)."""
    text = "neurons: {D: {}, B: {}, C: {}, A: {bias: 1}}\nconnections: {C -> D: %s, A -> B: %s, B -> C: %s}"
    within = compiled(text % (("{delay: 0, weight: 2}",) * 3)).run(1)
    assert [float(within[name][0]) for name in "ABCD"] == [1, 2, 4, 8]
    across = compiled(text % (("{weight: 2}",) * 3)).run(4)
    assert [across[name].tolist() for name in "ABCD"] == [[1, 1, 1, 1], [0, 2, 2, 2], [0, 0, 4, 4], [0, 0, 0, 8]]


def test_an_undefined_constant_is_a_finding_and_an_undefined_activity_a_warning() -> None:
    """At once, one a run; a branch that is not taken warns of nothing."""
    assert codes("neurons: {A: {bias: log(0 - 1)}}") == ["not-finite"]
    assert codes("neurons: {A: {bias: 1e308*10}}") == ["not-finite"]
    text = (
        "activations: {root: {value: sqrt(x)}, safe: {value: 1/x if x != 0 else 0}}\n"
        "inputs: {s: {expression: 2 - k}}\nneurons: {S: {activation: safe}, A: {input: s, activation: root}}"
    )
    with pytest.warns(RuntimeWarning) as caught:
        run = compiled(text).run(9)
    assert [str(item.message) for item in caught] == ["the activity of A is nan at step 3, in 'x'"]
    assert np.isnan(run["A"][3:]).all()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compiled(text).run(3)


@pytest.mark.parametrize("backend", ["reference", "numpy"])
@pytest.mark.parametrize("combine", ["sum", "product", "distance"])
def test_terms_are_added_in_the_order_of_the_connections_bit_for_bit(combine: str, backend: str) -> None:
    """As written, a matrix or pattern row by row; then bias, input and noise."""
    centre = ", centre: 0.3*i + 0.7*j" if combine == "distance" else ""
    text = f"""
seed: 3
inputs: {{s: {{expression: 0.1*k + 1/3}}}}
neurons:
  A: {{count: 7, bias: "normal(1, 0.3)"}}
  B: {{count: 5, bias: "normal(1, 0.3)"}}
  O: {{count: 2, combine: {combine}, bias: [0.1, 0.7], input: s, noise: "normal(0, 1)"}}
connections:
  - B3 -> O: {{weight: 0.7, delay: 2{centre}}}
  - A -> O: {{weight: "normal(1, 0.2)", pattern: all_to_all, delay: 0{centre}}}
  - B -> O: {{matrix: [[1.1, 0.9], [0.3, null], [1.7, 1.3], [null, 0.8], [0.6, 1.2]]{centre}}}
  - A2..A5 -> O: {{weight: "normal(1, 0.2)", pattern: all_to_all, delay: 3{centre}}}
  - A7 -> O1: {{weight: 1/3{centre}}}
"""
    network = compiled(text)
    run = network.run(6, backend=backend)
    lines, names = network.network.connections, network.network.neurons.names
    noise = Stream(3, "noise", "O")
    for step in range(6):
        for number, target in enumerate(("O1", "O2")):
            into = [index for index in range(len(lines)) if names[lines.targets[index]] == target]
            total = 1.0 if combine == "product" else 0.0
            for index in into:
                past = step - int(lines.delays[index])
                signal = (
                    float(lines.weights[index]) * float(run[names[lines.sources[index]]][past]) if past >= 0 else 0.0
                )
                if combine == "distance":
                    gap = signal - float(lines.centres[index])
                    total += gap * gap
                else:
                    total = total * signal if combine == "product" else total + signal
            total = math.sqrt(total) if combine == "distance" else total
            drive = total + (0.1, 0.7)[number] + (0.1 * step + 1 / 3) + float(noise.normal(number, 0, step, 0))
            assert run[target][step] == drive


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_a_parameter_that_a_plastic_weight_began_with_may_be_set_beyond_its_bounds(backend: str) -> None:
    """``set`` changes no plastic weight, so what it would begin as does not matter any more; by hand as by an event."""
    text = """
parameters: {g: 1}
neurons: {A: {bias: g}, B: {}}
connections: {A -> B: {weight: g, bounds: [0, 2], plasticity: {decay: {rate: 0.5}}}}
"""
    run = compiled(text + "events: [{at: 2, set: {g: 5}}]").run(4, backend=backend)
    assert run["A"].tolist() == [1, 1, 5, 5]
    assert run.weights[:, 0].tolist() == [1, 0.5, 0.25, 0.125]
    simulation = compiled(text).simulator(backend)
    simulation.step()
    simulation.set(g=5)
    simulation.step()
    assert simulation.activity[0] == 5
    assert simulation.weights.tolist() == [0.25]
    with pytest.raises(nv.SpecError):
        nv.compile_text("neurovis: 1\nname: x\n" + text, g=5)
