"""What layouts are worth, ours beside dot, ELK, sfdp and networkx on the same graphs in one run.

In: nothing; ``--graphs FOLDER`` (see ``networks.py``), ``--sample SEED`` for thirty other Rome and North graphs (or
``1,2,3`` for several times thirty; constants were set on sample 11), ``--all`` for the large ones, ``--only WORD`` for
rows whose name holds it, ``--peers "dot;sfdp"``, ``--engines layered,large``, ``--limit SECONDS`` for a peer. Out: a
table, in Markdown, on standard output: crossings of the routes as drawn, discs that overlap, routes over foreign discs,
the share of connections along the direction (of those in no loop), area, area for each neuron, CPU seconds, those of
the slowest graph of a set, our crossings by the best peer's (of ``layered`` by the best of dot's and ELK's, which draw
ranks as well, of the others by the best of all), and our area by dot's with clusters. Sets of graphs are summed up,
flow is averaged. Only ratios of one run can be compared. ELK needs node and what ``package.json`` names (``make
node_modules/made``).
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from layout_peers import PEERS
from networks import boxed, connectome, coupled, layers, reservoir, sample, small_worlds, star, tangle

import neurovis_spec as nv
from neurovis_spec.layout import LayoutGroup, LayoutProblem, LayoutRefusalError
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import problem_of

SPECS = Path(__file__).resolve().parent.parent / "specs"
#: These draw ranks as `layered` does.
_RANKED = ("dot", "dot, polylines", "dot, hurried", "dot, clusters", "elk", "elk, clusters")
_HEAD = (
    "graph",
    "by",
    "crossings",
    "overlaps",
    "over discs",
    "flow",
    "area",
    "per neuron",
    "CPU",
    "slowest",
    "ratio",
    "area ratio",
)
_FRAMED = ("dot", "dot, clusters", "elk", "elk, clusters", "sfdp")
#: Neurons and connections of networks without any order.
TANGLES = ((30, 50), (40, 80), (40, 100), (50, 120))
_HURRIED = ("dot, hurried", "sfdp", "spring", "multipartite")


@dataclass(frozen=True, slots=True)
class Case:
    """A row: one graph or a set of them, the engines of ours and the peers that lay it out."""

    name: str
    problems: Sequence[LayoutProblem]
    engines: Sequence[str] = ("layered",)
    peers: Sequence[str] = ("dot", "dot, polylines", "elk", "sfdp", "spring", "multipartite")


@dataclass(frozen=True, slots=True)
class Worth:
    """Metrics summed up over a row, and the CPU seconds."""

    crossings: int
    overlaps: int
    over: int
    flow: float
    area: float
    neurons: int
    seconds: float
    slowest: float


def cases(folder: Path | None, slow: bool, seeds: Sequence[int | None] = (None,)) -> Iterator[Case]:
    yield Case("10-20-10", [layers(10, 20, 10)])
    for kind in ("rome", "north"):
        for seed in seeds:
            graphs, name = sample(folder, kind, seed)
            yield Case(name, graphs)
            if slow:
                yield Case(f"{name}, as one group", [_as_one_group(graph) for graph in graphs], peers=())
    for path in sorted([*SPECS.glob("*.yaml"), *SPECS.glob("hexapod/*.yaml")]):
        network = nv.compile(path).network
        problem, engines = problem_of(network), (network.layout.engine,)
        yield Case(f"specs/{path.relative_to(SPECS)}", [problem], engines, _FRAMED)
        if problem.plan:
            yield Case(f"{path.name}, without plan", [replace(problem, plan=())], engines, _FRAMED)
        if problem.plan or problem.mirrors or problem.align:
            # the peers know no page, no mirrors and no lines; without them ours, too, lets everything run along
            plain = replace(problem, plan=(), mirrors=(), align=())
            yield Case(f"{path.name}, without plan, mirror and align", [plain], engines, _FRAMED)
    tangles = [tangle(units, connections, seed) for units, connections in TANGLES for seed in (1, 2, 3)]
    yield Case("tangles of 30/50 to 50/120", tangles, peers=("dot", "dot, polylines", "sfdp"))
    yield Case("30 instances, 200 links", [coupled(30, 200)], peers=_FRAMED)
    yield Case("60 instances, 600 links", [coupled(60, 600)], peers=("dot, clusters", "sfdp"))
    yield Case("star of 3,000", [star(3000)], ("grid",), ("sfdp",))
    yield Case("small worlds 300/2,500", [small_worlds(300, 2500)], ("layered", "large"), _HURRIED)
    if slow:
        worm, name = connectome(folder)
        yield Case(f"{name} 302/2,194", [worm], ("layered", "auto"), _HURRIED)
        yield Case("small worlds 302/3,709 in three boxes", [boxed(small_worlds(302, 3709), 3)], peers=("sfdp",))
        yield Case("reservoir 300/1,700", [reservoir(300)], ("layered", "auto"), _HURRIED)
        peers = ("sfdp",)
        yield Case("small worlds 2,000/10,000", [small_worlds(2000, 10_000)], ("large", "layered"), peers)
        yield Case("small worlds 10,000/50,000", [small_worlds(10_000, 50_000)], ("large",), peers)


def _as_one_group(problem: LayoutProblem) -> LayoutProblem:
    return replace(problem, groups=(LayoutGroup("N", tuple(range(len(problem.neurons)))),))


def by_peer(case: Case, peer: str, limit: float) -> Worth | None:
    found: list[Worth] = []
    for problem in case.problems:
        made = PEERS[peer](problem, limit)
        if made is None:
            return None
        found.append(_worth(metrics(made[0], problem), made[1]))
    return _sum(found)


def by_us(case: Case, engine: str) -> Worth:
    found: list[Worth] = []
    for problem in case.problems:
        begun = time.process_time()
        layout = lay_out_problem(problem, engine)
        seconds = time.process_time() - begun
        found.append(_worth(metrics(layout, problem), seconds))
    return _sum(found)


def _worth(of: dict[str, float | int], seconds: float) -> Worth:
    crossings, overlaps, over, neurons = (
        int(of[name]) for name in ("crossings", "overlaps", "edges_over_neurons", "neurons")
    )
    return Worth(crossings, overlaps, over, of["flow"], of["area"], neurons, seconds, seconds)


def _sum(found: Sequence[Worth]) -> Worth:
    return Worth(
        sum(worth.crossings for worth in found),
        sum(worth.overlaps for worth in found),
        sum(worth.over for worth in found),
        sum(worth.flow for worth in found) / len(found),
        sum(worth.area for worth in found),
        sum(worth.neurons for worth in found),
        sum(worth.seconds for worth in found),
        max(worth.slowest for worth in found),
    )


def row(name: str, by: str, worth: Worth | None, ratio: float | None, area_ratio: float | None, limit: float) -> None:
    if worth is None:
        print(f"| {name} | {by} | – | – | – | – | – | – | none in {limit:.0f} s | | | |", flush=True)
        return
    cells = [f"{worth.crossings:,}", f"{worth.overlaps:,}", f"{worth.over:,}", f"{worth.flow:.3f}"]
    cells += [
        f"{worth.area:,.0f}",
        f"{worth.area / worth.neurons:.1f}",
        f"{worth.seconds:.2f} s",
        f"{worth.slowest:.2f} s",
    ]
    cells += ["" if found is None else f"{found:.2f}" for found in (ratio, area_ratio)]
    print(f"| {name} | {by} | {' | '.join(cells)} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--graphs", type=Path)
    parser.add_argument("--sample", default="")
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument("--peers", default=";".join(PEERS))
    parser.add_argument("--engines", default="")
    parser.add_argument("--limit", type=float, default=150.0)
    asked = parser.parse_args()
    print(f"| {' | '.join(_HEAD)} |\n|{' --- |' * len(_HEAD)}")
    seeds = [int(seed) for seed in asked.sample.split(",")] if asked.sample else [None]
    for case in cases(asked.graphs, asked.all or bool(asked.only), seeds):
        if asked.only not in case.name:
            continue
        best: dict[str, Worth] = {}
        for peer in (peer for peer in case.peers if peer in asked.peers.split(";")):
            worth = by_peer(case, peer, asked.limit)
            row(case.name, peer, worth, None, None, asked.limit)
            if worth:
                best[peer] = worth
        for engine in asked.engines.split(",") if asked.engines else case.engines:
            try:
                worth = by_us(case, engine)
            except LayoutRefusalError as refusal:
                print(f"| {case.name} | {engine}: {refusal} | | | | | | | | | | |", flush=True)
                continue
            same = [w.crossings for peer, w in best.items() if peer in _RANKED or engine != "layered"]
            least = min(same, default=0)
            clusters = best.get("dot, clusters")
            area_ratio = worth.area / clusters.area if clusters and clusters.area else None
            ratio = worth.crossings / least if least else None
            row(case.name, f"**{engine}**", worth, ratio, area_ratio, asked.limit)


if __name__ == "__main__":
    main()
