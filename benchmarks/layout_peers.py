"""Peers of the layout engines: graphviz' dot and sfdp, ELK's layered, networkx's spring and multipartite layouts.

In: a LayoutProblem. Out: what the peer makes of the same graph, as one of our layouts, and its CPU seconds. A unit is a
disc's neighbour's distance for all of them: dot's and ELK's nodes are as wide as our discs, and as far apart as the
problem says, within ranks and between them; what knows no sizes is scaled until no two discs overlap as far as a common
factor can do that.
"""

from __future__ import annotations

import json
import resource
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import networkx as nx
import numpy as np

from neurovis_spec.layout import Layout, LayoutProblem, Point, Route
from neurovis_spec.layout.geometry import straight
from neurovis_spec.layout.model import RADIUS

Timed = tuple[Layout, float]
Members = frozenset[int]
#: Points of graphviz in a unit of ours.
_UNIT = 72.0
_DISCS = 'node [shape=circle, width=0.6, fixedsize=true, label=""]'
#: The script that calls ELK, where node finds elkjs (``make node_modules/made``).
_ELK = Path(__file__).with_name("elk.mjs")


def dot(problem: LayoutProblem, limit: float) -> Timed | None:
    """dot with its own ranks and splines; None where it fails or takes longer than ``limit`` seconds."""
    return _graphviz(problem, "dot", _dot(problem), limit)


def polylines(problem: LayoutProblem, limit: float) -> Timed | None:
    """dot with its other routing for such graphs: straight pieces."""
    return _graphviz(problem, "dot", f"{_dot(problem)}; splines=polyline", limit)


def hurried(problem: LayoutProblem, limit: float) -> Timed | None:
    """dot for what it does not finish untouched: fewer steps of its simplex and of its sweeps, straight lines."""
    return _graphviz(problem, "dot", f"{_dot(problem)}; nslimit=0.5; mclimit=0.2; splines=line", limit)


def clusters(problem: LayoutProblem, limit: float) -> Timed | None:
    """dot with a cluster for each instance of a module and each box that holds none of an instance's neurons, nested as
    they are."""
    return _graphviz(problem, "dot", "; ".join([_dot(problem), *_nested(_framed(problem))]), limit)


def _framed(problem: LayoutProblem) -> list[Members]:
    """Who is in an instance, or in a box without neurons of one."""
    instances = [frozenset(module.members) for module in problem.modules]
    taken = frozenset(member for members in instances for member in members)
    return [*instances, *(frozenset(box) for _, box in problem.boxes if not taken & set(box))]


def nested(problem: LayoutProblem, limit: float) -> Timed | None:
    """dot as told of what a picture frames: a cluster for each instance and each box, also those within another, and
    the direction."""
    sets = [frozenset(module.members) for module in problem.modules] + [frozenset(box) for _, box in problem.boxes]
    return _graphviz(problem, "dot", "; ".join([_dot(problem), _rankdir(problem), *_nested(sets)]), limit)


def directed(problem: LayoutProblem, limit: float) -> Timed | None:
    """dot as told of nothing but the direction."""
    return _graphviz(problem, "dot", f"{_dot(problem)}; {_rankdir(problem)}", limit)


def _dot(problem: LayoutProblem) -> str:
    between, ranks = _gaps(problem)
    return f"{_DISCS}; nodesep={between:.3f}; ranksep={ranks:.3f}"


def _gaps(problem: LayoutProblem) -> tuple[float, float]:
    """What is free between discs of a rank, and between ranks."""
    return max(problem.neuron_spacing - 2 * RADIUS, 0.05), max(problem.rank_spacing - 2 * RADIUS, 0.05)


def _rankdir(problem: LayoutProblem) -> str:
    return "rankdir=" + {"down": "TB", "up": "BT", "right": "LR", "left": "RL"}[problem.direction]


def _tree(
    sets: Sequence[Members],
) -> tuple[list[Members], dict[Members | None, list[Members]]]:
    """Clusters, and which are within which, each within the smallest that holds it; what crosses one already there is
    none."""
    kept: list[Members] = []
    for found in sorted(dict.fromkeys(sets), key=len, reverse=True):
        if found and all(found <= other or not found & other for other in kept):
            kept.append(found)
    within: dict[Members | None, list[Members]] = {}
    for number, found in enumerate(kept):
        within.setdefault(next((o for o in reversed(kept[:number]) if found <= o), None), []).append(found)
    return kept, within


def _nested(sets: Sequence[Members]) -> list[str]:
    """Clusters as dot takes them."""
    kept, within = _tree(sets)

    def written(found: Members) -> str:
        inner = within.get(found, [])
        parts = [*map(written, inner), *map(str, sorted(found.difference(*inner)))]
        return f"subgraph cluster_{kept.index(found)} {{ {'; '.join(parts)} }}"

    return [written(found) for found in within.get(None, [])]


def sfdp(problem: LayoutProblem, limit: float) -> Timed | None:
    """sfdp, overlaps removed, straight lines."""
    return _graphviz(problem, "sfdp", f"{_DISCS}; overlap=prism; K=1; splines=line", limit)


def elk(problem: LayoutProblem, limit: float) -> Timed | None:
    """ELK's layered with its own ranks, straight pieces; None where it takes longer than ``limit`` seconds."""
    return _elk(problem, [], limit)


def elk_clusters(problem: LayoutProblem, limit: float) -> Timed | None:
    """ELK's layered with a compound node for each cluster that dot has."""
    return _elk(problem, _framed(problem), limit)


def spring(problem: LayoutProblem, limit: float) -> Timed | None:
    """Fruchterman and Reingold's, of networkx."""
    graph = _graph(problem)
    begun = time.process_time()
    found = nx.spring_layout(graph, seed=1)
    seconds = time.process_time() - begun
    return _lines(problem, "spring", np.array([found[i] for i in range(len(problem.neurons))])), seconds


def multipartite(problem: LayoutProblem, limit: float) -> Timed | None:
    """networkx's layers, which are the generations of the graph without what closes loops; it orders nothing."""
    begun = time.process_time()
    graph = _graph(problem)
    graph.remove_edges_from([(a, b) for a, b in graph.edges if a >= b])
    for generation, nodes in enumerate(nx.topological_generations(graph)):
        for node in nodes:
            graph.nodes[node]["subset"] = generation
    found = nx.multipartite_layout(graph, align="horizontal")
    seconds = time.process_time() - begun
    return _lines(problem, "multipartite", np.array([found[i] for i in range(len(problem.neurons))])), seconds


PEERS: dict[str, Callable[[LayoutProblem, float], Timed | None]] = {
    "dot": dot,
    "dot, polylines": polylines,
    "dot, hurried": hurried,
    "dot, clusters": clusters,
    "elk": elk,
    "elk, clusters": elk_clusters,
    "sfdp": sfdp,
    "spring": spring,
    "multipartite": multipartite,
}


def _graph(problem: LayoutProblem) -> nx.DiGraph[int]:
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(range(len(problem.neurons)))
    graph.add_edges_from((edge.source, edge.target) for edge in problem.edges)
    return graph


def _graphviz(problem: LayoutProblem, engine: str, style: str, limit: float) -> Timed | None:
    edges = [f"{edge.source} -> {edge.target} [id={number}]" for number, edge in enumerate(problem.edges)]
    nodes = "; ".join(map(str, range(len(problem.neurons))))
    text = f"digraph {{ {style}; {nodes}; {'; '.join(edges)} }}"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run([engine, "-Tjson"], input=text, capture_output=True, text=True, check=True, timeout=limit)
    except (subprocess.TimeoutExpired, subprocess.CalledProcessError):
        return None
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    drawing = json.loads(done.stdout)
    centres: list[Point] = [(0.0, 0.0)] * len(problem.neurons)
    for item in drawing["objects"]:
        if "pos" in item and item["name"].isdigit():
            centres[int(item["name"])] = _point(item["pos"])
    routes: dict[str, Route] = {}
    for item in drawing["edges"]:
        edge = problem.edges[int(item["id"])]
        pieces = [_point(piece) for piece in item["pos"].split() if piece[0] not in "es"]
        # a spline ends at the discs and its arrowhead: straight pieces lead on to the centres
        source, target = centres[edge.source], centres[edge.target]
        routes[edge.name] = (*straight(source, pieces[0]), *pieces[1:], *straight(pieces[-1], target)[1:])
    if engine == "sfdp":
        routes = _straight(problem, centres)
    return Layout(problem.network, engine, dict(zip(problem.neurons, centres, strict=True)), routes), seconds


def _elk(problem: LayoutProblem, sets: Sequence[Members], limit: float) -> Timed | None:
    kept, within = _tree(sets)
    between, ranks = (_UNIT * gap for gap in _gaps(problem))
    wide = 2 * RADIUS * _UNIT

    def children(found: Members | None, members: Sequence[int]) -> list[dict[str, object]]:
        inner = within.get(found, [])
        alone = sorted(set(members).difference(*inner))
        boxes: list[dict[str, object]] = [
            {"id": f"cluster{kept.index(one)}", "children": children(one, sorted(one)), "layoutOptions": spacing}
            for one in inner
        ]
        return [*boxes, *({"id": f"{i}", "width": wide, "height": wide} for i in alone)]

    spacing = {
        "elk.algorithm": "layered",
        "elk.direction": "DOWN",
        "elk.edgeRouting": "POLYLINE",
        "elk.hierarchyHandling": "INCLUDE_CHILDREN",
        "elk.spacing.nodeNode": f"{between}",
        "elk.layered.spacing.nodeNodeBetweenLayers": f"{ranks}",
        "elk.json.shapeCoords": "ROOT",
        "elk.json.edgeCoords": "ROOT",
    }
    graph = {
        "id": "root",
        "layoutOptions": spacing,
        "children": children(None, range(len(problem.neurons))),
        "edges": [
            {"id": f"e{i}", "sources": [f"{edge.source}"], "targets": [f"{edge.target}"]}
            for i, edge in enumerate(problem.edges)
        ],
    }
    try:
        command = ["node", str(_ELK)]
        done = subprocess.run(
            command, input=json.dumps(graph), capture_output=True, text=True, check=True, timeout=limit
        )
    except (subprocess.TimeoutExpired, subprocess.CalledProcessError, FileNotFoundError):
        return None
    answer = json.loads(done.stdout)
    centres: list[Point] = [(0.0, 0.0)] * len(problem.neurons)
    rest = [answer["drawn"]]
    while rest:
        node = rest.pop()
        rest += node.get("children", [])
        if node["id"].isdigit():
            centres[int(node["id"])] = _scaled({"x": node["x"] + wide / 2, "y": node["y"] + wide / 2})
    routes: dict[str, Route] = {}
    for item in answer["drawn"]["edges"]:
        edge = problem.edges[int(item["id"][1:])]
        (section,) = item["sections"]
        line = [section["startPoint"], *section.get("bendPoints", []), section["endPoint"]]
        points = [centres[edge.source], *map(_scaled, line), centres[edge.target]]
        pieces = [straight(a, b) for a, b in pairwise(points) if a != b]
        routes[edge.name] = (points[0], *(point for piece in pieces for point in piece[1:]))
    layout = Layout(problem.network, "elk", dict(zip(problem.neurons, centres, strict=True)), routes)
    return layout, answer["milliseconds"] / 1000


def _scaled(point: Mapping[str, float]) -> Point:
    return point["x"] / _UNIT, point["y"] / _UNIT


def _point(text: str) -> Point:
    x, y = text.split(",")[:2]
    return float(x) / _UNIT, -float(y) / _UNIT


def _straight(problem: LayoutProblem, centres: Sequence[Point]) -> dict[str, Route]:
    """Lines; what a neuron does to itself is left at its centre."""
    return {edge.name: straight(centres[edge.source], centres[edge.target]) for edge in problem.edges}


def _lines(problem: LayoutProblem, name: str, places: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Layout:
    """As wide as a square with a place of its own for each neuron, and half as much again."""
    extent = float((places.max(axis=0) - places.min(axis=0)).max()) or 1.0
    places = places * (1.5 * len(places) ** 0.5 / extent)
    centres: list[Point] = [(float(x), float(y)) for x, y in places]
    return Layout(problem.network, name, dict(zip(problem.neurons, centres, strict=True)), _straight(problem, centres))
