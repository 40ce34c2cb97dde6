"""Graphviz' dot as a peer: with the same neurons side by side, our layouts have no more crossings than dot's.

dot would put C2 of the oscillator below C1, which has fewer crossings and says that one comes after the other; so it
is told our ranks. The ring is left out: its neurons stand on a circle because its author says so.
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

import neurovis_spec as nv
from neurovis_spec.layout import Layout, Point, Route
from neurovis_spec.layout.geometry import straight
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import problem_of

pytestmark = pytest.mark.dot
EXAMPLES = sorted((Path(__file__).parent.parent / "specs").glob("*.yaml"))
SPECS = [path for path in EXAMPLES if "arrange:" not in path.read_text(encoding="utf-8")]
#: points of dot in a unit of ours: its nodes are as wide as our discs, its ranks as far apart
UNIT = 72.0


def dot_layout(network: nv.CompiledNetwork) -> Layout:
    """What dot makes of the same graph, as one of our layouts."""
    problem = problem_of(network.network)
    edges = [
        f"{json.dumps(problem.neurons[edge.source])} -> {json.dumps(problem.neurons[edge.target])} [id={number}]"
        for number, edge in enumerate(problem.edges)
    ]
    style = 'node [shape=circle, width=0.6, fixedsize=true, label=""]; nodesep=0.4; ranksep=1.4;'
    across = 1 if problem.direction in ("down", "up") else 0
    ranks: dict[float, list[str]] = {}
    for name, place in network.layout().positions.items():
        ranks.setdefault(place[across], []).append(json.dumps(name))
    edges += [f"{{rank=same; {'; '.join(names)}}}" for names in ranks.values()]
    text = f"digraph {{ {style} {'; '.join(json.dumps(name) for name in problem.neurons)}; {'; '.join(edges)} }}"
    done = subprocess.run(["dot", "-Tjson"], input=text, capture_output=True, text=True, check=True)
    drawing = json.loads(done.stdout)
    places = {item["name"]: item["pos"].split(",") for item in drawing["objects"] if "pos" in item}
    positions: dict[str, Point] = {name: (float(x) / UNIT, -float(y) / UNIT) for name, (x, y) in places.items()}
    routes: dict[str, Route] = {}
    for item in drawing["edges"]:
        edge = problem.edges[int(item["id"])]
        ends = positions[problem.neurons[edge.source]], positions[problem.neurons[edge.target]]
        routes[edge.name] = _route(item["pos"], *ends)
    return Layout(network.name, "dot", positions, routes)


def _route(text: str, source: Point, target: Point) -> Route:
    """dot's spline ends at the discs and its arrowhead: straight pieces lead on to the centres."""
    pieces = [piece for piece in text.split() if piece[0] not in "es"]
    points = [(float(x) / UNIT, -float(y) / UNIT) for x, y in (piece.split(",") for piece in pieces)]
    return (*straight(source, points[0]), *points[1:], *straight(points[-1], target)[1:])


@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.stem)
def test_no_more_crossings_than_dot(path: Path) -> None:
    network = nv.compile(path)
    ours = network.layout().metrics()
    peer = metrics(dot_layout(network), problem_of(network.network))
    assert ours["crossings"] <= peer["crossings"]
    assert ours["edges_over_neurons"] == 0
    assert ours["overlaps"] == 0
