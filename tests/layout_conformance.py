"""What every layout engine has to keep, or to refuse by the limit that it declares.

In: an engine's name and problems. Out: failed assertions. A third-party engine can be held to it in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from hypothesis import strategies as st

from neurovis_spec.layout import RADIUS, Arrangement, Direction, Layout, LayoutProblem, LayoutRefusalError, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import distance, sampled
from neurovis_spec.layout.problem import NamedProblem

#: Farther than rounding to the grid of coordinates goes.
_SLACK = 1 / 128

Edge = tuple[str, str, str, int]
Rect = tuple[float, float, float, float]

ENGINES = ("layered", "organic", "large", "circular", "grid", "spatial", "manual")
#: Those that draw in ways of their own: "large" is another name of "organic" (test_layout_organic.py).
DRAWING = tuple(name for name in ENGINES if name != "large")


def named(pairs: Iterable[tuple[str, str]], delay: int = 1) -> list[Edge]:
    """Edges with the names that a network gives them."""
    seen: dict[tuple[str, str], int] = {}
    edges: list[Edge] = []
    for source, target in pairs:
        number = seen[source, target] = seen.get((source, target), 0) + 1
        edges.append((f"{source} -> {target}" + (f" ({number})" if number > 1 else ""), source, target, delay))
    return edges


def members(group: str, count: int) -> list[str]:
    return [f"{group}{i + 1}" for i in range(count)]


def full(sources: Iterable[str], targets: Iterable[str]) -> list[tuple[str, str]]:
    chosen = list(targets)
    return [(source, target) for source in sources for target in chosen]


def use_case_one(
    direction: Direction = "down", arrange: tuple[tuple[list[str], Arrangement], ...] = ()
) -> LayoutProblem:
    """The paper's first: two neurons of a rhythm, eight kernels, an output; T stands alone."""
    c, k = members("C", 2), members("K", 8)
    edges = named(full(c, c)) + named(full(c, k), 0) + named(full(k, ["O"]), 0)
    return NamedProblem(
        "cpg_rbf",
        [*c, *k, "O", "T"],
        [("C", c), ("K", k), ("O", ["O"]), ("T", ["T"])],
        edges,
        direction=direction,
        arrange=arrange,
        boxes=[("rhythm", c), ("kernels", k)],
    ).canonical()


def tangle() -> LayoutProblem:
    """A network in which much is alike, but for the names."""
    ring = members("R", 9)
    pairs = [(ring[i * 5 % 9], ring[i * i % 7]) for i in range(20)]
    edges = named(pairs) + named(full(["A"], ring))
    return NamedProblem("x", [*ring, "A", "B"], [("R", ring[:5])], edges, boxes=[("b", ring[:3])]).canonical()


@st.composite
def problems(draw: st.DrawFn, pinned: bool = True) -> LayoutProblem:
    """Small networks of any make: groups, loops, parallel and reciprocal edges, lone neurons, boxes, pins."""
    sizes = draw(st.lists(st.integers(1, 5), min_size=0, max_size=4))
    groups = [(name, members(name, size)) for name, size in zip("ABCD", sizes, strict=False)]
    names = [neuron for _, of in groups for neuron in of]
    pairs = draw(st.lists(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=24)) if names else []
    lattice = st.tuples(st.integers(-4, 4), st.integers(-4, 4))
    spots = draw(st.lists(lattice, unique=True, max_size=3)) if pinned else []
    pins = {name: (0.7 * x, 0.9 * y) for name, (x, y) in zip(names[::2], spots, strict=False)}
    boxes = [("frame", groups[0][1])] if draw(st.booleans()) and groups else []
    floats = st.floats(-1e6, 1e6)
    anywhere = st.lists(st.tuples(floats, floats), min_size=len(names), max_size=len(names))
    places = draw(anywhere) if draw(st.booleans()) else []
    return NamedProblem(
        "drawn",
        names,
        groups,
        named(pairs, draw(st.integers(0, 1))),
        pins,
        draw(st.sampled_from(["down", "up", "right", "left"])),
        boxes=boxes,
        places=dict(zip(names, places, strict=False)),
    ).canonical()


def extremes() -> list[LayoutProblem]:
    """Networks at the edge of what there is: very long, very deep, very loose, very centred, all in one place."""
    many = members("N", 2000)
    places = {name: (float(i), 0.0) for i, name in enumerate(many)}
    chain = NamedProblem("chain", many, [("N", many)], named(pairwise(many)), places=places).canonical()
    paths = [".".join(f"a{i}" for i in range(depth + 1)) for depth in range(20)]
    deepest = [f"{path}.X" for path in paths]
    modules = [(path, "m") for path in paths]
    deep = NamedProblem(
        "deep", deepest, [(n, [n]) for n in deepest], named(pairwise(deepest)), modules=modules
    ).canonical()
    few = members("N", 80)
    loose = NamedProblem("loose", few, places=dict.fromkeys(few, (1.0, 1.0))).canonical()
    pairs = NamedProblem("pairs", few, edges=named(zip(few[::2], few[1::2], strict=True))).canonical()
    star = NamedProblem("star", few, edges=named((few[0], name) for name in few)).canonical()
    return [chain, deep, loose, pairs, star]


def check(problem: LayoutProblem, engine: str) -> Layout | None:
    """Hold an engine to the contract on one problem; None where it refused by what it declares."""
    try:
        layout = lay_out_problem(problem, engine)
    except LayoutRefusalError as refusal:
        check_refusal(engine, refusal)
        return None
    check_positions(problem, layout)
    check_routes(problem, layout)
    return layout


def check_refusal(engine: str, refusal: LayoutRefusalError) -> None:
    """A refusal names the engine, and what it declares not to do; or pins that put a neuron into a foreign frame."""
    if refusal.code == "pin-in-frame":
        return
    assert engine in str(refusal)
    assert refusal.code in {
        "position-missing",
        "layout-pins-unsupported",
        "layout-arrange-unsupported",
        "layout-boxes-unsupported",
        "layout-direction-unsupported",
        "layout-too-large",
    }


def check_positions(problem: LayoutProblem, layout: Layout) -> None:
    assert tuple(layout.positions) == problem.neurons
    points = list(layout.positions.values())
    assert all(math.isfinite(x) and math.isfinite(y) for x, y in points)
    assert nearest(points) >= 2 * RADIUS - 1e-9
    for i, point in enumerate(points):
        if i in problem.pins:
            assert point == problem.pins[i]
        else:
            assert all(float(1024 * c).is_integer() for c in point)
    if points and not problem.pins:
        assert min(x for x, _ in points) == 0
        assert min(y for _, y in points) == 0


def nearest(points: list[Point]) -> float:
    """How far the two nearest points are from each other, at most 1, through cells of that width."""
    cells: dict[tuple[int, int], list[Point]] = {}
    least = 1.0
    for point in points:
        column, row = math.floor(point[0]), math.floor(point[1])
        for near in ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
            least = min([least, *(distance(point, other) for other in cells.get(near, ()))])
        cells.setdefault((column, row), []).append(point)
    return least


def check_routes(problem: LayoutProblem, layout: Layout) -> None:
    assert list(layout.routes) == [edge.name for edge in problem.edges]
    lines: dict[frozenset[int], list[list[Point]]] = {}
    for edge in problem.edges:
        route = layout.routes[edge.name]
        assert len(route) >= 4
        assert len(route) % 3 == 1
        assert route[0] == layout.positions[problem.neurons[edge.source]]
        assert route[-1] == layout.positions[problem.neurons[edge.target]]
        line = sampled(route, 0.05)
        if edge.source == edge.target:
            assert max(distance(point, route[0]) for point in line) > RADIUS + 0.1
        else:
            lines.setdefault(frozenset((edge.source, edge.target)), []).append(line)
    for equal in lines.values():
        for i, one in enumerate(equal):
            for other in equal[:i]:
                assert farthest(one, other) > 0.04, "two edges share a line"


def farthest(one: list[Point], other: list[Point]) -> float:
    """How far a point of one line is from the nearest of another, at most."""
    away = np.array(one)[:, None] - np.array(other)
    return float(np.sqrt((away * away).sum(axis=2)).min(axis=1).max())


def frames_of(layout: Layout, problem: LayoutProblem) -> list[tuple[frozenset[int], Rect]]:
    """The frames of instances and boxes as they are drawn, but for the room of titles: around centres, the routes
    between the neurons of an instance, and the frames in it."""
    at = [layout.positions[name] for name in problem.neurons]
    result: list[tuple[frozenset[int], Rect]] = [
        (frozenset(own), _around([at[m] for m in own], 0.6)) for _, own in problem.boxes if own
    ]
    found: dict[int, Rect] = {}
    for number, module in sorted(enumerate(problem.modules), reverse=True):
        own = frozenset(module.members)
        if not own:
            continue
        inner = [e.name for e in problem.edges if e.source in own and e.target in own]
        parts = [_around([at[m] for m in own], 0.65)]
        parts += [_around(sampled(layout.routes[name], 0.1), 0.2) for name in inner]
        parts += [
            _around([rect[:2], rect[2:]], 0.35) for k, rect in found.items() if problem.modules[k].parent == number
        ]
        found[number] = _around([corner for rect in parts for corner in (rect[:2], rect[2:])], 0.0)
        result.append((own, found[number]))
    return result


def _around(points: Iterable[Point], by: float) -> Rect:
    xs, ys = zip(*points, strict=True)
    return min(xs) - by, min(ys) - by, max(xs) + by, max(ys) + by


def through_frames(layout: Layout, problem: LayoutProblem) -> list[str]:
    """Routes that run through a frame that holds neither of their ends."""
    frames = frames_of(layout, problem)
    found: list[str] = []
    for edge in problem.edges:
        line = sampled(layout.routes[edge.name], 0.1)
        foreign = [rect for own, rect in frames if edge.source not in own and edge.target not in own]
        if any(_within(rect, point) for rect in foreign for point in line):
            found.append(edge.name)
    return found


def frames_meet(layout: Layout, problem: LayoutProblem) -> bool:
    """Whether frames that do not hold each other overlap, or a neuron stands in a foreign one."""
    frames = frames_of(layout, problem)
    at = [layout.positions[name] for name in problem.neurons]
    for i, (own, rect) in enumerate(frames):
        if any(_within(rect, point) for m, point in enumerate(at) if m not in own):
            return True
        for other, theirs in frames[:i]:
            wide, high = (min(rect[k + 2], theirs[k + 2]) - max(rect[k], theirs[k]) for k in (0, 1))
            if min(wide, high) > _SLACK and not (own <= other or other <= own):
                return True
    return False


def _within(rect: Rect, point: Point) -> bool:
    """Farther in than rounding to the grid of coordinates goes."""
    x0, y0, x1, y1 = rect
    return x0 + _SLACK < point[0] < x1 - _SLACK and y0 + _SLACK < point[1] < y1 - _SLACK


def across(problem: LayoutProblem) -> int:
    return 0 if problem.direction in ("down", "up") else 1


def check_mirror(layout: Layout, problem: LayoutProblem) -> None:
    """Images to the last bit, those of routes as well (to the own image and back: each its own)."""
    axis = across(problem)
    image = {a: b for mirror in problem.mirrors for pair in mirror.pairs for a, b in (pair, pair[::-1])}
    at = [layout.positions[name] for name in problem.neurons]
    sums = {at[a][axis] + at[b][axis] for a, b in image.items()}
    assert len(sums) <= 1
    assert all(at[a][1 - axis] == at[b][1 - axis] for a, b in image.items())
    if not sums:
        return
    twice = sums.pop()
    keys: dict[tuple[int, int, int], str] = {}
    times: dict[tuple[int, int], int] = {}
    for edge in problem.edges:
        number = times[edge.source, edge.target] = times.get((edge.source, edge.target), 0) + 1
        keys[edge.source, edge.target, number] = edge.name
    for (a, b, number), name in keys.items():
        ends = [image.get(n, n if 2 * at[n][axis] == twice else -1) for n in (a, b)]
        other = keys.get((ends[0], ends[1], number))
        if other is None or other == name:
            continue
        if (ends[0], ends[1]) == (b, a) != (a, b):
            # to the image and back: reflections of each other would share a line, so each is one of itself
            route = layout.routes[name]
            half = len(route) // 2
            mates = tuple((twice - x, y) if axis == 0 else (x, twice - y) for x, y in route[:half])
            assert route[: -half - 1 : -1] == mates, name
            continue
        expected = tuple((twice - x, y) if axis == 0 else (x, twice - y) for x, y in layout.routes[name])
        assert layout.routes[other] == expected, name
