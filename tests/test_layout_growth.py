"""Layouts of many frames and of many long routes; benchmarks/work.py counts the work that they take."""

from __future__ import annotations

import random
import tracemalloc

import layout_conformance as suite
import pytest
from neurovis_layouts.routing.obstacles import Obstacles, Walls

import neurovis_spec as nv
from neurovis_spec.layout.geometry import straight
from neurovis_spec.layout.problem import problem_of

HEAD = "neurovis: 1\nname: many\n"


def legs(count: int, engine: str = "grid") -> nv.CompiledNetwork:
    """Instances, a quarter of them connected with another anywhere."""
    draw = random.Random(3)
    text = HEAD + "modules: {leg: {neurons: {S: {bias: 1}, K: {}}, connections: {S -> K: 1}}}\n"
    text += f"instances: {{l: {{module: leg, count: {count}}}}}\nlayout: {{engine: {engine}}}\nconnections:\n"
    ends = [(draw.randint(1, count), draw.randint(1, count)) for _ in range(count // 4)]
    return nv.compile_text(text + "".join(f"  - l{a}.K -> l{b}.S: 1\n" for a, b in ends))


@pytest.mark.parametrize("engine", ["grid", "circular"])
def test_among_many_frames_no_route_enters_a_foreign_one(engine: str) -> None:
    network = legs(80, engine)
    layout = network.layout()
    assert suite.through_frames(layout.value, problem_of(network.network)) == []
    assert layout.metrics()["edges_over_neurons"] == 0


def test_what_stands_in_the_way_of_many_long_routes_is_found_in_little_memory() -> None:
    """1,500 routes of 60 units across a grid, of half a million points: looked at all at once they took 80 MB."""
    centres = [(1.5 * i, 1.5 * j) for i in range(40) for j in range(40)]
    discs = Obstacles(centres)
    walls = Walls([(frozenset({1}), (10.0, 10.0, 12.0, 12.0))], len(centres))
    own = [(0, k) for k in range(100, len(centres))]
    routes = [straight((0.0, 0.0), (60.0, 0.04 * k)) for _, k in own]
    tracemalloc.start()
    try:
        discs.clearances(routes, own)
        walls.entered(routes, own)
        assert tracemalloc.get_traced_memory()[1] < 15e6
    finally:
        tracemalloc.stop()
