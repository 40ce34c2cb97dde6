"""What a layout promises, as distances from it: ours beside dot with clusters on the same graphs in one run.

In: nothing; ``--tries N`` edits, orders and sets of pins a graph, ``--seed``, ``--graphs FOLDER`` (``networks.py``).
Out: a table, in Markdown, on standard output, of distances in spacings (0 is the promise kept): how far

* the images of mirrored neurons lie from where their mirror has them,
* the neurons of an instance lie from where the first instance of its make has them, as it is or mirrored,
* neurons that an edit left alone move, with the earlier layout at hand: those of instances that it did not touch, and
  the others,
* neurons move when the keys of the spec are written in another order (for the peer: its nodes and edges),
* pinned neurons lie from their pins;

the worst, and the mean. The peer's drawings may be shifted as a whole: medians are laid upon each other. Status 1 where
a promise of ours is not kept.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).resolve().parent))

import yaml
from layout_peers import PEERS
from networks import sample, small_worlds

import neurovis_spec as nv
from neurovis_spec.layout import Layout, LayoutEdge, LayoutGroup, LayoutProblem, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.naming import edge_key, natural_key
from neurovis_spec.layout.problem import problem_of

SPECS = Path(__file__).resolve().parent.parent / "specs"
_LIMIT = 60.0
_HEAD = ("promise", "graph", "by", "tries", "worst", "mean", "overlaps")
#: Rounding of the peers' numbers is none of their faults, nor of ours.
_SLACK = 1e-9

#: As it is, mirrored across, mirrored up and down.
_REFLECTIONS = ((1, 1), (-1, 1), (1, -1))
#: In these a name sees those before it: their order has a meaning.
_IN_ORDER = ("parameters", "let", "state")


@dataclass
class Distances:
    """How far from a promise, try by try."""

    worst: float = 0.0
    total: float = 0.0
    count: int = 0
    tries: int = 0
    overlaps: int = 0

    def add(self, found: Iterable[float], overlaps: int = 0) -> None:
        for distance in found:
            self.worst, self.total, self.count = max(self.worst, distance), self.total + distance, self.count + 1
        self.tries += 1
        self.overlaps += overlaps

    def row(self, promise: str, graph: str, by: str) -> str:
        mean = self.total / self.count if self.count else 0.0
        cells = (promise, graph, by, f"{self.tries}", f"{self.worst:.2f}", f"{mean:.3f}", f"{self.overlaps}")
        return f"| {' | '.join(cells)} |"


def ours(problem: LayoutProblem, engine: str = "layered") -> Layout:
    return lay_out_problem(problem, engine)


def _peer_of(problem: LayoutProblem) -> str:
    return "dot, clusters" if problem.modules or problem.boxes else "dot"


def theirs(problem: LayoutProblem) -> Layout:
    made = PEERS[_peer_of(problem)](problem, _LIMIT)
    if made is None:
        raise SystemExit(f"dot fails on {problem.network}")
    return made[0]


def apart(a: Point, b: Point) -> float:
    return float(((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) ** 0.5)


def moved(before: Layout, after: Layout, names: Iterable[str], shifted: bool) -> list[float]:
    """How far each neuron went; with ``shifted``, beyond what the drawing as a whole did."""
    pairs = [(before.positions[name], after.positions[name]) for name in names]
    if not pairs:
        return []
    by = tuple(statistics.median(b[k] - a[k] for a, b in pairs) if shifted else 0.0 for k in (0, 1))
    return [apart((a[0] + by[0], a[1] + by[1]), b) for a, b in pairs]


def from_mirrors(layout: Layout, problem: LayoutProblem) -> Iterator[float]:
    """How far the second of each mirrored pair is from the image of the first, on the axis that suits most."""
    across = 0 if problem.direction in ("down", "up") else 1
    at = [layout.positions[name] for name in problem.neurons]
    for mirror in problem.mirrors:
        twice = statistics.median(at[a][across] + at[b][across] for a, b in mirror.pairs)
        for a, b in mirror.pairs:
            image = (twice - at[a][0], at[a][1]) if across == 0 else (at[a][0], twice - at[a][1])
            yield apart(image, at[b])


def from_templates(layout: Layout, problem: LayoutProblem) -> Iterator[float]:
    """How far each neuron of an instance is from its place in the first one of its make, the instance as it is or
    mirrored, whichever is nearer."""
    makes: dict[str, list[list[Point]]] = {}
    for module in problem.modules:
        points = [layout.positions[problem.neurons[i]] for i in module.members]
        middle = tuple(sum(point[k] for point in points) / max(1, len(points)) for k in (0, 1))
        makes.setdefault(module.template, []).append([(x - middle[0], y - middle[1]) for x, y in points])
    for first, *others in makes.values():
        for other in others:
            ways = (
                [apart(a, (s * b[0], t * b[1])) for a, b in zip(first, other, strict=True)] for s, t in _REFLECTIONS
            )
            yield from min(ways, key=sum)


def edited(problem: LayoutProblem, random: Random) -> tuple[LayoutProblem, frozenset[str]]:
    """The problem after one edit outside of its instances, and the neurons that the edit is about: a connection more
    or less, or a neuron more with two connections."""
    home = {i: number for number, module in enumerate(problem.modules) if module.parent < 0 for i in module.members}
    inner = {i for i, edge in enumerate(problem.edges) if home.get(edge.source, -1) == home.get(edge.target, -2)}
    kind = random.choice(("more", "less", "neuron"))
    edges = list(problem.edges)
    names, groups = problem.neurons, problem.groups
    if kind == "less":
        gone = random.choice([i for i in range(len(edges)) if i not in inner])
        about = {edges[gone].source, edges[gone].target}
        del edges[gone]
    elif kind == "more":
        known = {(edge.source, edge.target) for edge in edges}
        free = (tuple(random.sample(range(len(names)), 2)) for _ in range(1000))
        a, b = next(
            p for p in free if p not in known and (home.get(p[0], -1) != home.get(p[1], -1) or p[0] not in home)
        )
        edges.append(LayoutEdge(f"{names[a]} -> {names[b]}", a, b, 1))
        about = {a, b}
    else:
        a, b, new = *random.sample(range(len(names)), 2), len(names)
        names = (*names, "zz_new")
        groups = (*groups, LayoutGroup("zz_new", (new,)))
        edges.append(LayoutEdge(f"{names[a]} -> zz_new", a, new, 1))
        edges.append(LayoutEdge(f"zz_new -> {names[b]}", new, b, 1))
        about = {a, b, new}
    edges.sort(key=lambda edge: edge_key(edge.name))
    return replace(problem, neurons=names, groups=groups, edges=tuple(edges)), frozenset(names[i] for i in about)


def reordered(problem: LayoutProblem, random: Random) -> LayoutProblem:
    """The same graph with its neurons and edges in another order, for a peer that knows no canonical one."""
    order = list(range(len(problem.neurons)))
    random.shuffle(order)
    place = {old: new for new, old in enumerate(order)}
    edges = [replace(edge, source=place[edge.source], target=place[edge.target]) for edge in problem.edges]
    random.shuffle(edges)
    modules = tuple(replace(m, members=tuple(place[i] for i in m.members), pins={}) for m in problem.modules)
    boxes = tuple((name, tuple(place[i] for i in members)) for name, members in problem.boxes)
    names = tuple(problem.neurons[i] for i in order)
    return LayoutProblem(problem.network, names, (), tuple(edges), modules=modules, boxes=boxes)


def rewritten(path: Path, random: Random) -> LayoutProblem:
    """The problem of a spec whose keys are written in another order."""

    def shuffled(value: object) -> object:
        if not isinstance(value, dict):
            return value
        keys = list(value)
        random.shuffle(keys)
        return {key: value[key] if key in _IN_ORDER else shuffled(value[key]) for key in keys}

    spec = shuffled(yaml.safe_load(path.read_text(encoding="utf-8")))
    text = yaml.safe_dump(spec, sort_keys=False, allow_unicode=True)
    return problem_of(nv.compile_text(text, folder=path.parent).network)


def pinned(problem: LayoutProblem, layout: Layout, random: Random) -> LayoutProblem:
    """The problem with a tenth of its free neurons pinned: each near where it was, none near another pin."""
    free = set(range(len(problem.neurons))) - {i for module in problem.modules for i in module.members}
    free -= {i for mirror in problem.mirrors for pair in mirror.pairs for i in pair}
    free -= {i for line in problem.align for i in line}
    pins: dict[int, Point] = {}
    for i in random.sample(sorted(free), max(1, len(free) // 10)):
        x, y = layout.positions[problem.neurons[i]]
        point = (x + random.choice((-2.5, -1.25, 1.25, 2.5)), y + random.choice((-0.75, 0.0, 0.75)))
        if all(apart(point, other) >= 1.0 for other in pins.values()):
            pins[i] = point
    return replace(problem, pins=pins)


def overlaps(layout: Layout, problem: LayoutProblem) -> int:
    return int(metrics(layout, problem)["overlaps"])


def structure(graph: str, problem: LayoutProblem) -> Iterator[tuple[str, str, str, Distances]]:
    for by, engine in (("**layered**", ours), ("dot, clusters", theirs)):
        layout = engine(problem)
        mirrors, alike = Distances(), Distances()
        mirrors.add(from_mirrors(layout, problem), overlaps(layout, problem))
        alike.add(from_templates(layout, problem), overlaps(layout, problem))
        yield "mirror images", graph, by, mirrors
        yield "instances alike", graph, by, alike


def stability(
    graph: str, problems: list[LayoutProblem], engine: str, tries: int, seed: int
) -> Iterator[tuple[str, str, str, Distances]]:
    peer = engine == "layered"
    whole, rest, without = Distances(), Distances(), Distances()
    random = Random(seed)
    for problem in problems:
        before, other = ours(problem, engine), theirs(problem) if peer else None
        for _ in range(tries):
            later, about = edited(problem, random)
            after = ours(replace(later, memory=before), engine)
            alone = {
                problem.neurons[i]
                for module in problem.modules
                for i in module.members
                if not about & {problem.neurons[j] for j in module.members}
            }
            count = overlaps(after, later)
            left = [name for name in problem.neurons if name not in alone]
            if problem.modules:
                whole.add(moved(before, after, sorted(alone), shifted=False), count)
            rest.add(moved(before, after, left, shifted=False), count)
            if other is not None:
                again = theirs(later)
                without.add(moved(other, again, problem.neurons, shifted=True), overlaps(again, later))
    if whole.tries:
        yield "an edit: instances it leaves alone", graph, f"**{engine}**", whole
    yield "an edit: the rest", graph, f"**{engine}**", rest
    if peer:
        yield "an edit: all", graph, _peer_of(problems[0]), without


def orders(path: Path, tries: int, seed: int) -> Iterator[tuple[str, str, str, Distances]]:
    problem = problem_of(nv.compile(path).network)
    mine, other = Distances(), Distances()
    first, second = ours(problem), theirs(problem)
    random = Random(seed)
    for _ in range(tries):
        layout = ours(rewritten(path, random))
        mine.add(moved(first, layout, problem.neurons, shifted=False), overlaps(layout, problem))
        again = reordered(problem, random)
        drawn = theirs(again)
        other.add(moved(second, drawn, problem.neurons, shifted=True), overlaps(drawn, again))
    yield "another order", path.name, "**layered**", mine
    yield "another order", path.name, "dot, clusters", other


def pins(
    graph: str, problems: list[LayoutProblem], engine: str, tries: int, seed: int
) -> Iterator[tuple[str, str, str, Distances]]:
    found = Distances()
    random = Random(seed)
    for problem in problems:
        free = ours(problem, engine)
        for _ in range(tries):
            held = pinned(problem, free, random)
            layout = ours(held, engine)
            off = (apart(layout.positions[held.neurons[i]], point) for i, point in held.pins.items())
            found.add(off, overlaps(layout, held))
    yield "pins", graph, f"**{engine}**", found


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--graphs", type=Path)
    parser.add_argument("--tries", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    tries, seed = asked.tries, asked.seed
    hexapod = SPECS / "hexapod" / "hexapod.yaml"
    walker = problem_of(nv.compile(hexapod).network)
    rome, name = sample(asked.graphs, "rome")
    rome = sorted(rome, key=lambda problem: natural_key(problem.network))[:: max(1, len(rome) // 10)]
    name = f"{len(rome)} of {name}"
    world = small_worlds(300, 2500)
    print(f"| {' | '.join(_HEAD)} |\n|{' --- |' * len(_HEAD)}")
    broken = False
    for rows in (
        partial(structure, hexapod.name, walker),
        partial(stability, hexapod.name, [walker], "layered", tries, seed),
        partial(stability, name, rome, "layered", max(1, tries // 4), seed),
        partial(stability, world.network, [world], "large", tries, seed),
        partial(orders, hexapod, max(1, tries // 4), seed),
        partial(pins, hexapod.name, [walker], "layered", tries, seed),
        partial(pins, name, rome, "layered", max(1, tries // 4), seed),
        partial(pins, world.network, [world], "large", tries, seed),
    ):
        for promise, graph, by, distances in rows():
            print(distances.row(promise, graph, by), flush=True)
            broken = broken or (by.startswith("**") and (distances.worst > _SLACK or distances.overlaps > 0))
    return int(broken)


if __name__ == "__main__":
    sys.exit(main())
