"""What a layout is worth: crossings, overlaps, routes over discs, flow, area.

In: a layout and its problem. Out: the numbers of ``neurovis layout --metrics``, computed from the routes as
drawn: splines flattened to short segments, which meet only in the cells of a grid. Labels overlap something, in a
picture that is not reduced, if they lie on another disc, on another label, on the frame of others, or across the line
of a frame that their neuron is in; or if no room is kept for them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import networkx as nx
import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.frames import Frames, entered
from neurovis_spec.layout.geometry import (
    Cells,
    Rect,
    crossing,
    cubic,
    meet,
    near_pairs,
    padded,
    pieces_of,
    squared_distances,
)
from neurovis_spec.layout.labels import label_rect
from neurovis_spec.layout.model import RADIUS, Direction, Layout, LayoutProblem, Point, Route

#: Crossings this close to a neuron that both routes have are how edges meet, not how they cross.
_MEETING = 0.35
_OVER = 0.3
_SLACK = 1e-9
_STEP = 0.4
#: Cells are no smaller than this, and no segment spans more of them across or down.
_FINEST_CELL, _MOST_CELLS = 0.02, 32
#: The most segments that a cubic piece is flattened to.
_FINEST = 4096
#: Beyond this many in all they grow longer: memory has an end.
_MOST_SEGMENTS = 2_000_000
#: Segments that are compared with discs at a time.
_AT_ONCE = 1 << 14
#: Pairs of segments that are compared, about; of more than that a sample of the routes is.
_MOST_PAIRS = 20_000_000
_ALONG: dict[Direction, Point] = {"down": (0, 1), "up": (0, -1), "right": (1, 0), "left": (-1, 0)}
_TOUCHING = 1e-6


def metrics(layout: Layout, problem: LayoutProblem) -> dict[str, float | int]:
    """The measures of a complete layout of this problem; ``seconds`` is for whoever measured it. Where there are too
    many pairs of routes to compare them all, ``crossings`` are those of ``sampled`` routes times the pairs that there
    are by the pairs compared. Of labels beside their discs, ``label_overlaps`` are those that lie on something.
    """
    centres = np.array([layout.positions[name] for name in problem.neurons], dtype=np.float64).reshape(-1, 2)
    segments = _Segments([layout.routes[edge.name] for edge in problem.edges])
    ends = np.array([(edge.source, edge.target) for edge in problem.edges], dtype=np.int64).reshape(-1, 2)
    crossings, sampled = _crossings(segments, ends, centres)
    estimated = {"sampled": sampled} if sampled < len(ends) else {}
    return {
        "neurons": len(problem.neurons),
        "edges": len(problem.edges),
        "crossings": crossings,
        **estimated,
        "overlaps": len(near_pairs(centres, 2 * RADIUS - _SLACK)[0]),
        "edges_over_neurons": _edges_over_neurons(segments, ends, centres),
        "flow": _flow(layout, problem),
        "symmetry": _symmetry(centres, problem),
        "area": _area(centres),
        **({"label_overlaps": label_overlaps(layout, problem)} if any(wide for wide, _ in problem.labels) else {}),
        "pins_moved": sum(layout.positions[problem.neurons[i]] != point for i, point in problem.pins.items()),
    }


class _Segments:
    """All routes as short straight segments: ``a``, ``b`` (m, 2) and the edge of each."""

    def __init__(self, routes: list[Route]) -> None:
        a: list[FloatArray] = [np.zeros((0, 2))]
        b: list[FloatArray] = [np.zeros((0, 2))]
        edge: list[IntArray] = [np.zeros(0, dtype=np.int64)]
        points, owner = pieces_of(routes)
        length = np.sqrt((np.diff(points, axis=1) ** 2).sum(axis=2)).sum(axis=1)
        step = max(_STEP, float(length.sum()) / _MOST_SEGMENTS)
        parts = np.clip(np.ceil(length / step), 8, _FINEST).astype(np.int64)
        for count in np.unique(parts).tolist():
            chosen = parts == count
            line = cubic(points[chosen][:, None], np.linspace(0.0, 1.0, count + 1))
            a.append(line[:, :-1].reshape(-1, 2))
            b.append(line[:, 1:].reshape(-1, 2))
            edge.append(np.repeat(owner[chosen], count))
        self.a, self.b, self.edge = np.concatenate(a), np.concatenate(b), np.concatenate(edge)
        lengths = np.sqrt(((self.b - self.a) ** 2).sum(axis=1))
        self.longest = float(lengths.max()) if len(lengths) else 0.0


def _in_cells(low: FloatArray, high: FloatArray, cell: FloatArray) -> tuple[IntArray, IntArray]:
    """For boxes (m, 2): (item, cell key) for each of the cells that a box touches."""
    first = np.floor(low / cell).astype(np.int64)
    spans = np.floor(high / cell).astype(np.int64) - first + 1
    counts = spans.prod(axis=1)
    items = np.repeat(np.arange(len(low), dtype=np.int64), counts)
    place = np.arange(len(items), dtype=np.int64) - np.repeat(np.cumsum(counts) - counts, counts)
    column, row = np.divmod(place, spans[items, 1])
    return items, _key(first[items, 0] + column, first[items, 1] + row)


def _key(column: IntArray, row: IntArray) -> IntArray:
    return column * np.int64(1 << 31) + row


def _pairs(keys: IntArray) -> Iterator[tuple[IntArray, IntArray]]:
    """All pairs of places with equal keys, in batches; ``keys`` are sorted."""
    at = np.arange(len(keys), dtype=np.int64)
    step = 1
    while True:
        at = at[at + step < len(keys)]
        at = at[keys[at] == keys[at + step]]
        if not len(at):
            return
        yield at, at + step
        step += 1


def _crossings(segments: _Segments, ends: IntArray, centres: FloatArray) -> tuple[int, int]:
    """How many crossings there are, and from how many routes that is known."""
    if not len(segments.a):
        return 0, len(ends)
    low, high = np.minimum(segments.a, segments.b), np.maximum(segments.a, segments.b)
    # as large as a typical segment, across and down: where all run nearly level, flat cells tell them apart
    extent = high - low
    cell = np.maximum(np.maximum(1.5 * extent.mean(axis=0), extent.max(axis=0) / _MOST_CELLS), _FINEST_CELL)
    items, keys = _in_cells(low, high, cell)
    pairs = int((np.unique(keys, return_counts=True)[1].astype(np.float64) ** 2).sum() / 2)
    sampled, scale = len(ends), 1.0
    if pairs > _MOST_PAIRS:
        chosen = _sample(len(ends), math.sqrt(_MOST_PAIRS / pairs))
        sampled = int(chosen.sum())
        scale = len(ends) * (len(ends) - 1) / (sampled * (sampled - 1))
        kept = chosen[segments.edge[items]]
        items, keys = items[kept], keys[kept]
    order = np.argsort(keys, kind="stable")
    items, keys = items[order], keys[order]
    edge, a = segments.edge[items], np.ascontiguousarray(segments.a[items].T)
    u = np.ascontiguousarray((segments.b - segments.a)[items].T)
    total = 0
    for first, second in _pairs(keys):
        other = edge[first] != edge[second]
        i, j = first[other], second[other]
        share, hit = crossing((a[0][i], a[1][i]), (u[0][i], u[1][i]), (a[0][j], a[1][j]), (u[0][j], u[1][j]))
        i, j = i[hit], j[hit]
        where = (a[:, i] + share * u[:, i]).T
        # a pair may share several cells: it counts in the one that the point lies in
        once = _key(*np.floor(where / cell).astype(np.int64).T) == keys[i]
        total += int(_outside(where[once], ends[edge[i[once]]], ends[edge[j[once]]], centres).sum())
    return round(total * scale), sampled


def _sample(count: int, share: float) -> BoolArray:
    """Which of so many routes are in a sample; two at least, the same each time."""
    scattered = np.arange(count, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)  # Knuth's multiplicative hashing
    chosen = np.zeros(count, dtype=np.bool_)
    chosen[np.argsort(scattered, kind="stable")[: max(2, math.ceil(share * count))]] = True
    return chosen


def _outside(where: FloatArray, one: IntArray, two: IntArray, centres: FloatArray) -> BoolArray:
    """Whether a point is not near a neuron that both edges have."""
    result = np.ones(len(where), dtype=np.bool_)
    for i in (0, 1):
        shared = (one[:, i] == two[:, 0]) | (one[:, i] == two[:, 1])
        far = ((where - centres[one[:, i]]) ** 2).sum(axis=1) > _MEETING**2
        result &= ~shared | far
    return result


def _edges_over_neurons(segments: _Segments, ends: IntArray, centres: FloatArray) -> int:
    """Routes closer than 0.3 to a centre that is not theirs."""
    if not len(segments.a) or not len(centres):
        return 0
    cells = Cells(centres, segments.longest / 2 + _OVER)
    over: set[int] = set()
    for start in range(0, len(segments.a), _AT_ONCE):
        a, b = segments.a[start : start + _AT_ONCE], segments.b[start : start + _AT_ONCE]
        chosen, neuron, _ = cells.near((a + b) / 2)
        edge = segments.edge[start + chosen]
        foreign = (ends[edge, 0] != neuron) & (ends[edge, 1] != neuron)
        near = squared_distances(*(centres[neuron] - a[chosen]).T, *(b - a)[chosen].T) < (_OVER - _SLACK) ** 2
        over.update(edge[foreign & near].tolist())
    return len(over)


def _flow(layout: Layout, problem: LayoutProblem) -> float:
    """Share of the edges outside strongly connected components whose target lies further along the direction; 1 for
    none."""
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(range(len(problem.neurons)))
    graph.add_edges_from(way for edge in problem.edges for way in edge.ways)
    component = {node: number for number, part in enumerate(nx.strongly_connected_components(graph)) for node in part}
    dx, dy = _ALONG[problem.direction]
    along = [dx * x + dy * y for x, y in (layout.positions[name] for name in problem.neurons)]
    open_edges = [edge for edge in problem.edges if component[edge.source] != component[edge.target]]
    forward = sum(along[edge.target] > along[edge.source] for edge in open_edges)
    return forward / len(open_edges) if open_edges else 1.0


def _symmetry(centres: FloatArray, problem: LayoutProblem) -> float:
    """Share of the mirrored pairs that are mirror images on the axis of their scope (the median of the middles between
    pairs), to a billionth; 1 for none. A plan may turn an instance by a quarter, and the axis in it."""
    if not problem.mirrors:
        return 1.0
    across = 0 if problem.direction in ("down", "up") else 1
    scopes: dict[int, list[tuple[int, int]]] = {}
    for mirror in problem.mirrors:
        scopes.setdefault(mirror.scope, []).extend(mirror.pairs)
    kept = 0
    for scope, pairs in scopes.items():
        first, second = centres[[a for a, _ in pairs]], centres[[b for _, b in pairs]]
        turns = (across, 1 - across) if scope >= 0 and problem.plan else (across,)
        kept += max(_mirrored(first, second, turn) for turn in turns)
    return kept / sum(len(pairs) for pairs in scopes.values())


def _mirrored(first: FloatArray, second: FloatArray, across: int) -> int:
    """How many of these are images on one axis; ``across``: which coordinate that changes."""
    middle = (first[:, across] + second[:, across]) / 2
    axis = np.sort(middle)[len(middle) // 2]
    level = np.abs(first[:, 1 - across] - second[:, 1 - across]) <= _SLACK
    return int((level & (np.abs(middle - axis) <= _SLACK)).sum())


def _area(centres: FloatArray) -> float:
    """Of the smallest upright rectangle that holds every disc."""
    if not len(centres):
        return 0.0
    width, height = (centres.max(axis=0) - centres.min(axis=0) + 2 * RADIUS).tolist()
    return float(width * height)


def label_overlaps(layout: Layout, problem: LayoutProblem) -> int:
    """The labels that overlap something, or that nobody says where to put."""
    beside = [i for i, (wide, _) in enumerate(problem.labels) if wide]
    sides = {i: layout.labels[name] for i in beside if (name := problem.neurons[i]) in layout.labels}
    rects = {i: label_rect(layout.positions[problem.neurons[i]], problem.labels[i], side) for i, side in sides.items()}
    ground = Ground(layout, problem)
    return sum(
        i not in rects
        or not ground.free(i, rects[i], -_TOUCHING)
        or any(meet(rects[i], other, -_TOUCHING) for k, other in rects.items() if k != i)
        for i in beside
    )


class Ground:
    """What labels stand on: discs, and the frames that are drawn."""

    def __init__(self, layout: Layout, problem: LayoutProblem) -> None:
        places = [layout.positions[name] for name in problem.neurons]
        routes = {i: layout.routes[edge.name] for i, edge in enumerate(problem.edges)}
        frames = Frames(problem, layout.labels)
        self._centres: FloatArray = np.array(places, dtype=np.float64).reshape(-1, 2)
        self._frames = [
            (own, rect)
            for own, rect in zip(frames.members, frames.rects(dict(enumerate(places)), routes), strict=True)
            if rect is not None and not entered(self._centres, rect, own)
        ]

    def free(self, neuron: int, rect: Rect, air: float, title: float = 0.0) -> bool:
        """Whether the label of a neuron comes no nearer than ``air`` to another disc, to the frame of others, or to the
        line of a frame that holds the neuron, below whose top so much is left for its ``title``."""
        x0, y0, x1, y1 = rect
        away = np.maximum(np.maximum((x0, y0) - self._centres, self._centres - (x1, y1)), 0.0)
        far = np.hypot(away[:, 0], away[:, 1])
        far[neuron] = np.inf
        if (far < RADIUS + air).any():
            return False
        for members, frame in self._frames:
            if neuron not in members:
                if meet(rect, frame, air):
                    return False
            elif not _within(padded(rect, air), (frame[0], frame[1] + title, *frame[2:])):
                return False
        return True


def _within(rect: Rect, frame: Rect) -> bool:
    return rect[0] >= frame[0] and rect[1] >= frame[1] and rect[2] <= frame[2] and rect[3] <= frame[3]
