"""Any number may be an expression over the parameters (§3): each place that takes one, against the number itself."""

from __future__ import annotations

import pytest
from small_specs import codes, compiled

from neurovis_spec.compiled import CompiledNetwork

HEAD = "parameters: {two: 2, half: two/4}\n"
ONE = "neurons: {A: {bias: 1}}\n"
PAIR = "neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: "
NINE = "neurons: {A: {count: 9, bias: 1}}\nconnections: {A -> A: "
MODULE = "modules: {m: {parameters: {p: 1}, neurons: {K: {bias: p}}, layout: {positions: {K: [p, 1]}}}}\n"

# each ‹expression› stands for the number behind it
PLACES = [
    "time: {steps: ‹3*two|6›, episode: ‹two + 1|3›}\n" + ONE,
    "time: {dt: ‹1/40|0.025›}\n" + ONE,
    "parameters: {two: 2, half: two/4, q: {value: ‹two|2›, min: ‹half|0.5›, max: ‹2*two|4›}}\n" + ONE,
    "inputs: {s: {values: [[‹half|0.5›], ‹two|2›]}}\nneurons: {A: {input: s}}",
    "inputs: {s: {size: ‹two|2›}}\nneurons: {A: {count: 2, input: s}}",
    "neurons: {A: {count: ‹two + 1|3›, first: ‹3*two|6›, bias: ‹half|0.5›}}",
    "neurons: {A: {count: 3, bias: ‹i/n|[0, 0.3333333333333333, 0.6666666666666666]›}}",
    "neurons: {A: {count: 3, initial: [‹half|0.5›, ‹i|1›, ‹n|3›]}}",
    "neurons: {A: {bias: 1, position: [‹half|0.5›, ‹two|2›]}}",
    "neurons: {A: {count: 2, bias: 1, activation: {gaussian: {sigma: ‹two*i|[0, 2]›}}}}",
    "neurons: {A: {bias: 1, model: {leaky_integrator: {leak: ‹half|0.5›}}}}",
    PAIR + "{weight: ‹two|2›, delay: ‹two|2›}}",
    PAIR + "‹half|0.5›}",
    PAIR + "{bounds: [‹-two|-2›, ‹two|2›], plasticity: {hebbian: {rate: ‹half|0.5›}}}}",
    PAIR + "{edges: [[A, B, ‹half|0.5›, ‹two|2›]]}}",
    PAIR + "{matrix: [[‹half|0.5›]]}}",
    NINE + "{pattern: ring, plasticity: {hebbian: {rate: [‹two*i|0›, ‹half|0.5›" + ", 1" * 7 + "]}}}}",
    "neurons: {A: {count: 2, bias: 1}}\nconnections: {A -> A: {matrix: [[‹i + two|2›, ‹j|1›], [null, ‹n_to*half|1›]]}}",
    "neurons: {A: {count: 2, bias: 1, activation: {gaussian: {sigma: [‹half|0.5›, ‹two|2›]}}}}",
    "neurons: {A: {count: 2, bias: 1, model: {leaky_integrator: {leak: [‹half|0.5›, ‹half/two|0.25›]}}}}",
    "neurons: {A: {bias: 1}, B: {combine: distance}}\nconnections: {A -> B: {centre: ‹half|0.5›}}",
    "neurons: {A: {bias: 1}, B: {combine: distance}}\nconnections: {A -> B: {centre: [[‹half|0.5›]]}}",
    NINE + "{pattern: ring, scale: {spectral_radius: ‹half|0.5›}}}",
    NINE + "{pattern: ring, scale: {norm: ‹half|0.5›}}}",
    NINE + "{pattern: {random: {probability: ‹half|0.5›}}}}",
    NINE + "{pattern: {fixed_indegree: {count: ‹two|2›}}}}",
    NINE + "{pattern: {fixed_outdegree: {count: ‹two|2›}}}}",
    NINE + "{pattern: {nearest: {count: ‹two|2›}}}}",
    NINE + "{pattern: {small_world: {degree: ‹two|2›, rewire: ‹half|0.5›}}}}",
    NINE + "{pattern: {band: {width: ‹two|2›}}}}",
    MODULE + "instances: {a: {module: m, count: ‹two|2›, set: {p: ‹half|0.5›}}}",
    ONE + "events: [{at: ‹two + 1|3›, lesion: A}, {from: ‹two|2›, to: ‹two + 1|3›, clamp: {A: ‹half|0.5›}}]",
    ONE + "layout: {positions: {A: [‹two|2›, ‹-half|-0.5›]}, spacing: {neuron: ‹two|2›, rank: ‹2*two|4›}}",
    MODULE + "instances: {a: {module: m, set: {p: ‹half|0.5›}}}\nlayout: {positions: {a: [‹two|2›, 0]}}",
    ONE + "render: {gain: {activity: ‹two|2›, signal: ‹half|0.5›, thickness: ‹two|2›, change: ‹1/two|0.5›}}",
    ONE + "render: {size: [‹300*two|600›, ‹900*half|450›]}",
    ONE + "ros: {rate: ‹20*two|40›}",
]


def written(place: str, which: int) -> CompiledNetwork:
    """The network with the expressions (0) or with the numbers (1)."""
    text = "".join(part.split("|")[which] if odd else part for odd, part in _parts(place))
    return compiled(text if text.startswith("parameters") else HEAD + text)


def _parts(place: str) -> list[tuple[bool, str]]:
    return [(bool(index % 2), part) for index, part in enumerate(place.replace("›", "‹").split("‹"))]


@pytest.mark.parametrize("place", PLACES)
def test_an_expression_is_as_good_as_the_number(place: str) -> None:
    """The same network, settings of its layout and its pictures."""
    formula, number = written(place, 0), written(place, 1)
    assert formula.hash == number.hash
    assert formula.network.steps == number.network.steps
    assert formula.network.layout == number.network.layout
    assert formula.network.render == number.network.render
    assert {item.code for item in formula.warnings} <= {"unused-parameter"}


def test_what_an_event_sets_may_be_an_expression() -> None:
    """Over the values at that step; it stays an expression, and so it shows in the hash as one."""
    text = HEAD + "neurons: {A: {bias: half}}\nevents: [{at: 2, set: {half: two/8}}]"
    assert compiled(text).run(4)["A"].tolist() == [0.5, 0.5, 0.25, 0.25]


def test_a_setting_of_the_layout_follows_the_parameter() -> None:
    """It is no part of the structure, and may be set from outside."""
    network = compiled(
        f"parameters: {{far: 3}}\n{ONE}layout: {{positions: {{A: [far, 0]}}}}\nrender: {{gain: {{signal: far}}}}"
    )
    assert network.layout().positions == {"A": (3, 0)}
    assert [stated.gain for stated in network.network.render.signal] == [3]
    assert not network.network.structural


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("layout: {positions: {A: [q, 0]}}", "unknown-name"),
        ("layout: {positions: {A: [1e7*1, 0]}}", "out-of-range"),
        ("layout: {spacing: {rank: 1/10}}", "out-of-range"),
        ("render: {gain: {signal: 1 - 2}}", "out-of-range"),
        ("render: {gain: {signal: k}}", "unknown-name"),
        ("render: {size: [100.5*1, 100]}", "not-an-integer"),
        ("render: {size: [10, 100*400]}", "out-of-range"),
        ("ros: {rate: 1 - 1}", "out-of-range"),
        ("time: {dt: 1/0}", "not-finite"),
    ],
)
def test_what_an_expression_gives_is_checked_like_a_number(text: str, code: str) -> None:
    """With the code that the number would get."""
    found = codes(ONE + text)
    assert set(found) == {code}
