"""What the language says of connections, runs, rules and events (§4, §5, §7, §9), by hand on small networks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.recording import Recording

HEAD = "neurovis: 1\nname: x\n"


def run(text: str, steps: int) -> Recording:
    """A run of a spec without its head."""
    return nv.compile_text(HEAD + text).run(steps)


ENTRIES = [
    ("A -> B: 1", 3),
    ("B -> A: 1", 3),
    ("A -> A: 1", 1),
    ("B1 -> B: 1", 2),
    ("B1 -> B: {weight: 1, self: true}", 3),
    ("B -> B: {pattern: all_to_all}", 6),
    ("B -> B: {pattern: all_to_all, self: true}", 9),
    ("B -> B: {pattern: one_to_one}", 3),
    ("B -> B: {pattern: chain}", 2),
    ("B -> B: {pattern: ring}", 3),
    ("A+B1..B2->B3", 3),
    ("B -> A: {matrix: [[1], [null], [0]]}", 2),
    ("B -> D: {centre: [[1], [null], [2]], matrix: [[1], [2], [null]]}", 1),
    ("B -> D: {centre: [[1], [null], [2]]}", 2),
    ("B -> A: {edges: [[B1, A], [B1, A, 0.5, 3], [B2, A, 1]]}", 3),
]


@pytest.mark.parametrize(("entry", "count"), ENTRIES)
def test_how_many_connections_an_entry_makes(entry: str, count: int) -> None:
    """A single end connects to all; ``null`` is none and 0 is one; equal edges are parallel."""
    text = f"neurons: {{A: {{bias: 1}}, B: {{count: 3, bias: 1}}, D: {{combine: distance}}}}\nconnections:\n  {entry}"
    assert len(nv.compile_text(HEAD + (text if ":" in entry else f"{text}: 1") + "\n").network.connections) == count


def test_a_signal_leaves_with_its_weight_and_arrives_later() -> None:
    """Before it arrives it is 0, a product with it 0, a distance |c|."""
    text = (
        "inputs: {s: {values: [[1], [2], [3], [4]]}}\n"
        "neurons: {A: {input: s}, B: {}, D: {combine: product}, E: {combine: distance}, F: {combine: product}}\n"
        "connections:\n  A -> B: {delay: 2}\n  A -> D: 2\n  A -> E: {centre: -3}\n"
    )
    found = run(text, 6)
    assert found["A"].tolist() == [1, 2, 3, 4, 4, 4], "past the end of an input its last row stays"
    assert found["B"].tolist() == [0, 0, 1, 2, 3, 4]
    assert found["D"].tolist() == [0, 2, 4, 6, 8, 8]
    assert found["E"].tolist() == [3, 4, 5, 6, 7, 7]
    assert found["F"].tolist() == [1] * 6, "a product of no connections is 1"


def test_an_initial_is_the_first_activity_and_states_begin_after_it() -> None:
    """With ``initial`` the states are first updated at step 1."""
    found = run("neurons: {A: {initial: 3, model: {leaky_integrator: {leak: 0.5}}, bias: 1}}\n", 4)
    assert found["A"].tolist() == [3, 0.5, 0.75, 0.875]


def test_one_warning_names_the_neuron_and_the_step() -> None:
    """A branch that is not taken warns of nothing."""
    text = (
        "neurons: {B: {bias: -1, activation: safe}, A: {bias: -1, activation: root}}\n"
        "activations: {root: {value: sqrt(x)}, safe: {value: sqrt(x) if x > 0 else 0}}\n"
    )
    with pytest.warns(RuntimeWarning) as caught:
        run(text, 5)
    assert [str(item.message) for item in caught] == ["the activity of A is nan at step 0, in 'x'"]


Change = Callable[
    [int, float, "np.ndarray[tuple[int], np.dtype[np.float64]]", Recording, float, dict[str, float]], float
]


def _bcm(
    t: int,
    pre: float,
    b: np.ndarray[tuple[int], np.dtype[np.float64]],
    found: Recording,
    w: float,
    kept: dict[str, float],
) -> float:
    threshold = kept.get("threshold", 0.0)
    kept["threshold"] = threshold + 0.2 * (b[t] ** 2 - threshold)
    return float(0.1 * pre * b[t] * (b[t] - threshold))


RULES: dict[str, Change] = {
    "{delta: {rate: 0.1, target: P}}": lambda t, pre, b, found, w, kept: 0.1 * pre * (found["P"][t] - b[t]),
    "{hebbian: {rate: 0.1}}": lambda t, pre, b, found, w, kept: 0.1 * pre * b[t],
    "{anti_hebbian: {rate: 0.1}}": lambda t, pre, b, found, w, kept: -0.1 * pre * b[t],
    "{oja: {rate: 0.1}}": lambda t, pre, b, found, w, kept: 0.1 * b[t] * (pre - b[t] * w),
    "{bcm: {rate: 0.1, threshold_rate: 0.2}}": _bcm,
    "{input_correlation: {rate: 0.1, reflex: P}}": lambda t, pre, b, found, w, kept: (
        0.1 * pre * (found["P"][t] - found["P"][t - 1]) if t else 0.0
    ),
    "{differential_hebbian: {rate: 0.1}}": lambda t, pre, b, found, w, kept: (
        0.1 * pre * (b[t] - b[t - 1]) if t else 0.0
    ),
    "{decay: {rate: 0.1}}": lambda t, pre, b, found, w, kept: -0.1 * w,
}


@pytest.mark.parametrize("rule", RULES)
def test_what_a_built_in_rule_changes(rule: str) -> None:
    """The column 'change of the weight at a step' of the table of rules; ``pre`` is what reaches the synapse."""
    text = (
        "inputs: {s: {expression: sin(k + 1)}, r: {expression: cos(2*k)}}\n"
        "neurons: {A: {input: s}, B: {bias: 0.1}, P: {input: r}}\n"
        f"connections:\n  A -> B: {{weight: 0.5, delay: 2, plasticity: {rule}}}\n"
    )
    found = run(text, 12)
    weights, kept = found.weights[:, 0], dict[str, float]()
    for t in range(11):
        pre = float(found["A"][t - 2]) if t >= 2 else 0.0
        change = RULES[rule](t, pre, found["B"], found, float(weights[t]), kept)
        assert weights[t + 1] == pytest.approx(weights[t] + change, abs=1e-14), t


def test_bounds_apply_right_after_each_change() -> None:
    """And a rule sees ``sent`` at once, ``pre`` when it arrives."""
    text = "neurons: {A: {bias: 1}, B: {bias: 1}}\nconnections: {A -> B: {weight: 0.5, delay: 0, bounds: [0, 1], "
    assert run(text + "plasticity: {hebbian: {rate: 1}}}}\n", 3).weights.ravel().tolist() == [0.5, 1, 1]
    text = (
        "inputs: {s: {expression: k + 1}}\nneurons: {A: {input: s}, B: {}}\n"
        "rules: {both: {weight: {each_step: weight + 1000*sent + pre}}}\n"
        "connections: {A -> B: {weight: 0, delay: 2, plasticity: both}}\n"
    )
    assert run(text, 5).weights.ravel().tolist() == [0, 1000, 3000, 6001, 10003]


EVENTS = """\
parameters: {g: 1}
neurons: {A: {bias: g}, K: {count: 3}, O: {combine: product}, D: {combine: distance}}
connections:
  A -> K: {delay: 2}
  K -> O: {delay: 0, weight: 2}
  K -> D: {delay: 0, centre: 1}
events:
"""


def test_a_lesioned_neuron_is_no_factor_and_no_term() -> None:
    """Its activity is 0 from that step on, and a product or a distance goes on without it."""
    found = run(EVENTS + "  - {at: 4, lesion: [K3]}\n", 6)
    assert found["K3"].tolist() == [0, 0, 1, 1, 0, 0]
    assert found["O"].tolist() == [0, 0, 8, 8, 4, 4]
    assert found["D"].tolist() == [3**0.5, 3**0.5, 0, 0, 0, 0]


def test_a_lesioned_connection_takes_its_part_out() -> None:
    """Of an entry one connection; signals under way are dropped."""
    found = run(EVENTS + "  - {at: 4, lesion: [K1 -> O]}\n", 6)
    assert found["O"].tolist() == [0, 0, 8, 8, 4, 4]
    found = run(EVENTS + "  - {at: 3, lesion: [A -> K1]}\n", 6)
    assert (found["K1"].tolist(), found["K2"].tolist()) == ([0, 0, 1, 0, 0, 0], [0, 0, 1, 1, 1, 1])


def test_a_clamp_ends_before_its_end_and_the_state_goes_on() -> None:
    """``to`` is exclusive; without it a clamp lasts."""
    text = "neurons: {A: {bias: 1, model: {leaky_integrator: {leak: 0.5}}}}\n"
    assert run(text + "events: [{from: 1, to: 3, clamp: {A: 9}}]\n", 5)["A"].tolist() == [0.5, 9, 9, 0.9375, 0.96875]
    assert run(text + "events: [{from: 1, clamp: {A: 9}}]\n", 4)["A"].tolist() == [0.5, 9, 9, 9]


def test_set_changes_rates_but_no_plastic_weight_and_a_lesion_keeps_the_last() -> None:
    """``at: k`` applies at step k already."""
    text = (
        "parameters: {g: 1}\nneurons: {A: {bias: g}, B: {}}\n"
        "connections: {A -> B: {weight: g, plasticity: {hebbian: {rate: 0.1*g}}}}\n"
        "events: [{at: 2, set: {g: 2}}, {at: 4, lesion: [A -> B]}]\n"
    )
    found = run(text, 7)
    assert found["A"].tolist() == [1, 1, 2, 2, 2, 2, 2]
    assert found.weights.ravel() == pytest.approx([1, 1, 1.1, 1.3, 2.18, 2.18, 2.18])
    assert found["B"] == pytest.approx([0, 1, 1, 2.2, 0, 0, 0])
