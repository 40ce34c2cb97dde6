"""Symmetric entries: each connection is followed by its twin, which has its numbers, and both are one line."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from neurovis_layouts.wiring import wiring_of
from scenes import film_of, scene_of
from small_specs import compiled

import neurovis_spec as nv
from neurovis_spec.cli.overview import overview
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.describe import describe
from neurovis_spec.layout.problem import problem_of
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.turns import Lesion
from neurovis_spec.scene.collapse import gathered
from neurovis_spec.scene.fading import snapshots_of
from neurovis_spec.scene.film import still
from neurovis_spec.scene.lesions import lesions_of
from neurovis_spec.scene.model import Arrowhead, Disc, Scene, Spline

HEAD = """time: {dt: 0.1, steps: 20}
parameters: {g: 0.5, lag: 1}
models: {cell: {parameters: {c: 1}, state: {v: {derivative: (drive - v)/c}}, activity: v}}
synapses:
  gap: {signal: weight*(pre.v - post.v)}
  lagged: {parameters: {lag: 0}, state: {s: {derivative: pre.v - s}}, signal: weight*(s - post.v - lag*post.c)}
neurons: {N: {count: 6, model: {cell: {c: i + 1}}, initial: {v: i}}, M: {count: 3, model: cell}}
"""


def network(entry: str, more: str = "") -> CompiledNetwork:
    return compiled(f"{HEAD}connections:\n  - {entry}\n{more}")


def pairs(entry: str) -> list[str]:
    """The connections that are written or made, without their twins."""
    names = network(entry).network.connection_names
    twins = network(entry).network.connections.twins
    assert twins is not None
    assert twins.tolist() == [place + 1 - 2 * (place % 2) for place in range(len(names))]
    assert [" -> ".join(name.partition(" (")[0].split(" -> ")[::-1]) for name in names[::2]] == [
        name.partition(" (")[0] for name in names[1::2]
    ]
    return [name.replace(" -> ", "-") for name in names[::2]]


@pytest.mark.parametrize(
    ("entry", "wanted"),
    [
        ("N -> N: {synapse: gap, pattern: ring, symmetric: true}", "N1-N2 N2-N3 N3-N4 N4-N5 N5-N6 N1-N6"),
        ("N -> N: {synapse: gap, pattern: chain, symmetric: true}", "N1-N2 N2-N3 N3-N4 N4-N5 N5-N6"),
        ("M -> M: {pattern: all_to_all, symmetric: true}", "M1-M2 M1-M3 M2-M3"),
        ("M -> M: {pattern: all_to_all, self: true, symmetric: true}", "M1-M2 M1-M3 M2-M3"),
        ("M1 -> N1..N2: {symmetric: true}", "M1-N1 M1-N2"),
        ("N1..N2 -> N1: {symmetric: true}", "N2-N1"),
        ("N1..N3 -> M: {pattern: one_to_one, symmetric: true}", "N1-M1 N2-M2 N3-M3"),
        ("N -> N: {edges: [[N3, N1, 2], [N2, N2], [N4, N1]], symmetric: true}", "N3-N1 N4-N1"),
        ("M -> M: {matrix: [[1, 2, null], [null, null, 3], [null, null, 4]], symmetric: true}", "M1-M2 M2-M3"),
    ],
)
def test_each_pair_is_made_once_and_none_of_a_neuron_with_itself(entry: str, wanted: str) -> None:
    assert pairs(entry) == wanted.split()


def test_pairs_that_are_drawn_are_those_of_the_pattern_in_one_direction() -> None:
    plain = compiled(f"{HEAD}connections: [N -> N: {{pattern: {{random: {{probability: 0.5}}}}}}]\n").network
    drawn = [name.replace(" -> ", "-") for name in plain.connection_names if name[1] < name[-1]]
    assert pairs("N -> N: {pattern: {random: {probability: 0.5}}, symmetric: true}") == drawn


def test_twins_have_the_numbers_of_the_written_one() -> None:
    entry = "N -> N: {{pattern: chain, weight: 'i + uniform(0, 1)', delay: j, synapse: {{lagged: {{lag: i*lag}}}}{}}}"
    made, plain = network(entry.format(", symmetric: true")).network, network(entry.format("")).network
    for numbers, of in (
        (made.connections.weights, plain.connections.weights),
        (made.connections.delays, plain.connections.delays),
    ):
        assert numbers.tolist() == np.repeat(of.whole(), 2).tolist()
    (projection,) = made.projections
    assert projection.use.parameters["lag"].tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]
    assert projection.use.parameters["post.c"].tolist() == [2, 1, 3, 2, 4, 3, 5, 4, 6, 5]


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_a_run_is_that_of_both_written_out(backend: str) -> None:
    symmetric = network("N -> N: {pattern: chain, weight: g*(i + 1), synapse: {lagged: {lag: i*lag}}, symmetric: true}")
    edges = [(f"N{a}", f"N{b}", k) for k, (a, b) in enumerate(pairwise(range(1, 7)))]
    lines = [
        f"{a} -> {b}: {{weight: g*{k + 1}, synapse: {{lagged: {{lag: {k}*lag}}}}}}"
        for one, other, k in edges
        for a, b in ((one, other), (other, one))
    ]
    written = network("\n  - ".join(lines))
    assert symmetric.network.connection_names == written.network.connection_names
    assert symmetric.hash != written.hash
    runs = [one.simulator(backend) for one in (symmetric, written)]
    for step in range(20):
        for run in runs:
            if step == 5:
                run.set(g=0.25, lag=3)
            run.step()
        assert runs[0].activity.tolist() == runs[1].activity.tolist()
        assert runs[0].connection_weights.tolist() == runs[1].connection_weights.tolist()


def test_without_the_key_a_hash_stays() -> None:
    assert network("M -> M: {pattern: ring}").hash == network("M -> M: {pattern: ring, symmetric: false}").hash
    assert network("M -> M: {pattern: ring}").network.connections.twins is None


def test_lesions_and_mends_of_either_name_act_on_both() -> None:
    events = "events: [{at: 3, lesion: N2 -> N1}, {at: 6, mend: N1 -> N2}]\n"
    made = network("N -> N: {pattern: chain, synapse: gap, symmetric: true}", events)
    assert lesions_of(made.network).connections == {0: 3, 1: 3}
    recorded = made.run()
    run = network("N -> N: {pattern: chain, synapse: gap, symmetric: true}").simulator()
    for step in range(20):
        if step in (3, 6):
            (run.lesion if step == 3 else run.mend)(("N1 -> N2", "N2 -> N1")[step == 6])
            assert run.lesioned[1][:3].tolist() == [step == 3, step == 3, False]
        run.step()
        assert run.activity.tolist() == recorded.activity[step].tolist()
    source = SimulatedSource(network("N -> N: {pattern: chain, symmetric: true}").simulator())
    source.turn(Lesion("N2 -> N1"))
    assert np.flatnonzero(source.seen().lesioned_connections).tolist() == [0, 1]


def lines(scene: Scene) -> list[str]:
    return [group.data["connection"] for group in scene.groups if "connection" in group.data]


def test_both_are_one_line() -> None:
    made = network(
        "M -> M: {pattern: ring, synapse: gap, symmetric: true}", "render: {gain: {signal: {M2 -> M1: 7}}}\n"
    )
    (snapshot,) = snapshots_of(made.network, made.run(), [3])
    scene = scene_of(made, snapshot)
    assert lines(scene) == ["M1 -> M2", "M2 -> M3", "M1 -> M3"]
    assert [edge.name for edge in problem_of(made.network).edges] == ["M1 -> M2", "M1 -> M3", "M2 -> M3"]
    assert made.gains.signal.tolist()[:2] == [7, 7]
    (title,) = [group.title for group in scene.groups if group.data.get("connection") == "M1 -> M2"]
    assert title.startswith("M1 ↔ M2\n")


@pytest.mark.parametrize(
    ("groups", "pairs"),
    [
        ("N: {count: 5}", [("N1", "N2"), ("N2", "N3"), ("N3", "N4"), ("N4", "N5"), ("N5", "N1")]),
        ("N: {count: 3}, A: {}", [("N1", "N2"), ("N2", "N3"), ("A", "N1")]),
        ("A: {}, B: {}", [("A", "B")]),
    ],
)
def test_neurons_stand_where_they_would_if_both_ways_were_written(groups: str, pairs: list[tuple[str, str]]) -> None:
    """A ring is drawn as one, a half-centre side by side."""
    both = ", ".join(f"'{a} -> {b}': {{symmetric: true}}" for a, b in pairs)
    each = ", ".join(f"'{a} -> {b}': {{}}, '{b} -> {a}': {{}}" for a, b in pairs)
    specs = [f"neurons: {{{groups}}}\nconnections: {{{some}}}\n" for some in (both, each)]
    symmetric, written = (compiled(spec).layout().positions for spec in specs)
    assert symmetric == written


def test_a_symmetric_line_gives_the_organic_engine_no_direction() -> None:
    for both, arcs in (("true", 0), ("false", 5)):
        problem = problem_of(network(f"N -> N: {{pattern: chain, symmetric: {both}}}").network)
        assert len(wiring_of(problem, np.arange(9)).above) == arcs


def test_glyphs_are_joined_by_one_line_where_all_between_them_is_symmetric() -> None:
    made = network("N1..N3 -> M: {pattern: one_to_one, symmetric: true}\n  - N6 -> M: 2")
    drawn = gathered(made.network, [("M", (6, 7, 8)), ("P", (0, 1, 2))])
    assert drawn.network.connections.twins is not None
    assert [drawn.network.connection_names[index] for index in drawn.network.connections.second] == ["M -> P"]
    mixed = gathered(made.network, [("M", (6, 7, 8)), ("N", tuple(range(6)))])
    assert mixed.network.connections.twins is None


def test_focus_and_paths_find_a_line_by_either_direction() -> None:
    made = network("N -> N: {pattern: chain, symmetric: true}")
    (snapshot,) = snapshots_of(made.network, made.run(3), [1])
    settings = replace(made.network.render, path=("N3 -> N1", (2,), (0,)))
    assert sorted(lines(scene_of(made, snapshot, settings=settings))) == ["N1 -> N2", "N2 -> N3"]


def test_inspect_says_what_is_symmetric() -> None:
    made = network("N -> N: {pattern: chain, synapse: gap, symmetric: true}\n  - N1 -> M: {weight: 2}")
    told = overview(made).splitlines()
    begin = told.index("connections") + 1
    assert [" ".join(line.split()) for line in told[begin : begin + 3]] == [
        "entry number symmetric weight delay synapse",
        "N -> N 10 both ways 1 0 gap",
        "N1 -> M 3 2 0",
    ]
    described = describe(made.network, ("layered", ""))["connections"]
    assert isinstance(described, list)
    assert [one["symmetric"] for one in described] == [True] * 10 + [False] * 3
    plain = describe(network("N1 -> M1: 1").network, ("layered", ""))["connections"]
    assert isinstance(plain, list)
    assert "symmetric" not in plain[0]


def test_what_cannot_be_symmetric_is_told() -> None:
    with pytest.raises(nv.SpecError, match=r"both 'N1 -> N2' and 'N2 -> N1' are there \(4 of 5 connections do\)"):
        network("N -> N: {edges: [[N1, N2], [N2, N1], [N3, N1], [N4, N5], [N5, N4]], symmetric: true}")
    with pytest.raises(nv.SpecError, match="a rule at a symmetric entry would give the two connections"):
        network("M -> M: {pattern: ring, symmetric: true, plasticity: hebbian}")
    with pytest.raises(nv.SpecError, match="are not scaled together"):
        network("M -> M: {pattern: ring, symmetric: true, scale: {norm: 1}}")
    with pytest.raises(nv.SpecError, match="makes no connection at all"):
        network("M -> M: {pattern: one_to_one, symmetric: true}")
    with pytest.raises(nv.SpecError, match="has no port 'a'"):
        network("M -> N: {symmetric: true, port: a, pattern: all_to_all}")


def test_as_many_pairs_as_are_made_count_towards_the_limit() -> None:
    text = "neurovis: 1\nname: x\nneurons: {A: {count: 9}}\nconnections: {A -> A: {symmetric: true, PATTERN}}"
    for pattern in ("pattern: all_to_all", "pattern: {random: {probability: 1}}"):
        made = text.replace("PATTERN", pattern)
        assert len(nv.compile_text(made, limit=72).network.connections) == 72
        with pytest.raises(nv.SpecError, match="this makes 72 connections; the limit is 71"):
            nv.compile_text(made, limit=71)


@pytest.mark.parametrize("size", ["", "render: {size: [900, 700]}\n"])
def test_a_line_that_leads_both_ways_has_a_head_at_either_end(size: str) -> None:
    made = network("M -> M: {pattern: chain, weight: -1, symmetric: true}\n  - M1 -> M3: 1", size)
    steps = list(snapshots_of(made.network, made.run(), [0, 3]))
    scene = still(film_of(made, steps), 1)
    found = {group.data["connection"]: group.shapes for group in scene.groups if "connection" in group.data}
    assert {name: len(shapes) for name, shapes in found.items()} == {"M1 -> M2": 3, "M2 -> M3": 3, "M1 -> M3": 2}
    discs = {group.data["neuron"]: group.shapes[0] for group in scene.groups if "neuron" in group.data}
    for name in ("M1 -> M2", "M2 -> M3"):
        spline, *heads = found[name]
        assert isinstance(spline, Spline)
        ends = spline.points[-1], spline.points[0]
        for head, end, neuron in zip(heads, ends, name.split(" -> ")[::-1], strict=True):
            assert isinstance(head, Arrowhead)
            disc = discs[neuron]
            assert isinstance(disc, Disc)
            assert head.kind == "bar"
            assert head.notch == pytest.approx(end, abs=0.05 * head.length)
            toward = np.subtract(disc.centre, head.tip)
            assert np.dot(toward / np.hypot(*toward), head.direction) > 0.9
            assert disc.radius < np.hypot(*toward) < disc.radius + head.length
