"""The graphs that layouts are measured on: generated the same way on every machine, or read from a folder.

In: sizes, or a folder with ``rome/``, ``north/`` and ``connectome.csv``. Out: LayoutProblems whose neurons have no
groups, as the peers know none. The folder is the user's: the Rome and North graphs (Di Battista et al. 1997, 2000; as
GraphML or as JSON with nodes and edges) and the connectome of C. elegans (a line ``source,target`` for each pair that
chemical synapses connect) have their own terms. Without it there are stand-ins of the same sizes.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from random import Random

import neurovis_spec as nv
from neurovis_spec.layout import LayoutEdge, LayoutGroup, LayoutProblem
from neurovis_spec.layout.naming import edge_key, natural_key
from neurovis_spec.layout.problem import problem_of

Pair = tuple[str, str]
_NODE = re.compile(r'<node id="([^"]+)"')
_EDGE = re.compile(r'<edge [^>]*source="([^"]+)" target="([^"]+)"')
SAMPLE = 30


def problem_of_pairs(name: str, pairs: Iterable[Pair], more: Iterable[str] = ()) -> LayoutProblem:
    """A problem in canonical order; equal pairs are one; ``more`` are neurons that may have no connection."""
    edges = {f"{a} -> {b}": (a, b) for a, b in pairs}
    names = sorted({end for pair in edges.values() for end in pair} | set(more), key=natural_key)
    index = {neuron: i for i, neuron in enumerate(names)}
    return LayoutProblem(
        name,
        tuple(names),
        tuple(LayoutGroup(neuron, (i,)) for neuron, i in index.items()),
        tuple(LayoutEdge(key, index[edges[key][0]], index[edges[key][1]], 1) for key in sorted(edges, key=edge_key)),
    )


def layers(*sizes: int) -> LayoutProblem:
    """A network of fully connected layers."""
    names = [[f"{chr(65 + layer)}{i + 1}" for i in range(size)] for layer, size in enumerate(sizes)]
    pairs = [(a, b) for above, below in pairwise(names) for a in above for b in below]
    return problem_of_pairs("-".join(map(str, sizes)), pairs)


def reservoir(units: int, seed: int = 1) -> LayoutProblem:
    """An input of four, units of which each drives five others, an output of four that reads a tenth of them."""
    random = Random(seed)
    names = [f"R{i + 1}" for i in range(units)]
    pairs = [(a, names[int(random.random() * units)]) for a in names for _ in range(5)]
    pairs += [(f"I{k + 1}", name) for name in names for k in range(4) if random.random() < 0.1]
    pairs += [(name, f"O{k + 1}") for name in names for k in range(4) if random.random() < 0.1]
    return problem_of_pairs(f"reservoir {units}", pairs)


def small_worlds(units: int, connections: int, module: int = 25, seed: int = 1) -> LayoutProblem:
    """Modules, each a small world of its own (Watts and Strogatz 1998: a ring of neighbours, a tenth of its connections
    rewired within the module), and one connection in sixteen to any unit anywhere; all run from the lower number to the
    higher: a modular network with a direction."""
    random = Random(seed)
    found: dict[tuple[int, int], None] = {}
    reach = -(-connections // units)
    for step in range(1, 50 * reach):
        for i in range(units):
            first = i - i % module
            size = min(module, units - first)
            j = first + (i - first + 1 + (step - 1) % max(1, min(size - 1, reach))) % size
            if random.random() < 0.1:
                j = first + int(random.random() * size)
            if random.random() < 0.06 or step > reach:
                j = int(random.random() * units)
            if i != j and len(found) < connections:
                found[min(i, j), max(i, j)] = None
        if len(found) >= connections:
            break
    return problem_of_pairs(f"small worlds {units}/{connections}", ((f"N{a + 1}", f"N{b + 1}") for a, b in found))


def tangle(units: int, connections: int, seed: int) -> LayoutProblem:
    """Connections between any two different units."""
    random = Random(seed)
    pairs: dict[Pair, None] = {}
    while len(pairs) < connections:
        a, b = random.randrange(units), random.randrange(units)
        if a != b:
            pairs[f"N{a}", f"N{b}"] = None
    return problem_of_pairs(f"tangle {units}/{connections}", pairs, (f"N{i}" for i in range(units)))


def star(units: int) -> LayoutProblem:
    """A unit that drives all others."""
    return problem_of_pairs(f"star {units}", (("N0", f"N{i}") for i in range(1, units)))


def coupled(instances: int, links: int, seed: int = 1) -> LayoutProblem:
    """Instances of a module of four neurons in a loop, and links between any neurons of any two of them."""
    random = Random(seed)
    found: dict[str, None] = {}
    while len(found) < links:
        a, b = random.randrange(instances), random.randrange(instances)
        link = f"m{a}.{random.choice('ABCD')} -> m{b}.{random.choice('ABCD')}: {{weight: 1}}"
        if a != b:
            found[link] = None
    loop = "A -> B: {weight: 1}, B -> C: {weight: 1}, C -> D: {weight: -1}, D -> A: {weight: 0.5}"
    text = f"""
neurovis: 1
name: coupled
modules: {{M: {{neurons: {{A: {{}}, B: {{}}, C: {{}}, D: {{}}}}, connections: {{{loop}}}}}}}
instances: {{{", ".join(f"m{number}: {{module: M}}" for number in range(instances))}}}
connections: {{{", ".join(found)}}}
"""
    return problem_of(nv.compile_text(text).network)


def boxed(problem: LayoutProblem, boxes: int) -> LayoutProblem:
    """The same with its neurons, in their order, in boxes of one size."""
    count = len(problem.neurons)
    bounds = [number * count // boxes for number in range(boxes + 1)]
    parts = tuple((f"box {n}", tuple(range(*pair))) for n, pair in enumerate(pairwise(bounds), 1))
    return replace(problem, boxes=parts)


def sparse(units: int, connections: int, seed: int) -> LayoutProblem:
    """A stand-in for a Rome or North graph: a tree in which units follow recent ones, and further connections; most
    from the lower number to the higher."""
    random = Random(seed)
    pairs = {(max(0, i - 1 - int(random.random() ** 2 * i)), i) for i in range(1, units)}
    while len(pairs) < min(connections, units * (units - 1) // 2):
        a, b = sorted((int(random.random() * units), int(random.random() * units)))
        if a != b:
            pairs.add((a, b))
    return problem_of_pairs(f"sparse {units}", ((f"n{a}", f"n{b}") for a, b in sorted(pairs)))


def sample(folder: Path | None, kind: str, seed: int | None = None) -> tuple[list[LayoutProblem], str]:
    """Thirty of the graphs in a folder, drawn with a seed, else evenly over their natural order (by size and number
    for North graphs); without a folder stand-ins; and what they are."""
    paths = sorted((folder / kind).iterdir(), key=lambda path: natural_key(path.name)) if folder else []
    paths = [path for path in paths if path.suffix in (".graphml", ".json")]
    if len(paths) < SAMPLE:
        density = 1.35 if kind == "rome" else 1.5
        sizes = [10 + 3 * i for i in range(SAMPLE)]
        graphs = [sparse(n, round(density * n), n if seed is None else 1000 * seed + n) for n in sizes]
        return graphs, f"{SAMPLE} stand-ins for {kind.capitalize()} graphs{_drawn(seed)}"
    evenly = [paths[(2 * i + 1) * len(paths) // (2 * SAMPLE)] for i in range(SAMPLE)]
    chosen = evenly if seed is None else Random(seed).sample(paths, SAMPLE)
    return [read(path) for path in chosen], f"{SAMPLE} {kind.capitalize()} graphs{_drawn(seed)}"


def _drawn(seed: int | None) -> str:
    return "" if seed is None else f", sample {seed}"


def read(path: Path) -> LayoutProblem:
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".json":
        graph = json.loads(text)
        pairs = [(f"n{edge['source']}", f"n{edge['target']}") for edge in graph.get("edges", graph.get("links", ()))]
        return problem_of_pairs(path.stem, pairs, (f"n{node['id']}" for node in graph["nodes"]))
    return problem_of_pairs(path.stem, _EDGE.findall(text), _NODE.findall(text))


def connectome(folder: Path | None) -> tuple[LayoutProblem, str]:
    """302 neurons, 2,194 pairs: C. elegans from ``connectome.csv``, neurons without chemical synapses added; else
    a network of that size in which few neurons have many connections, most of them to near ones, either way round."""
    path = folder / "connectome.csv" if folder else None
    if path and path.exists():
        lines = [line.split(",") for line in path.read_text(encoding="utf-8").split()]
        pairs: Sequence[Pair] = [(line[0], line[1]) for line in lines]
        apart = 302 - len({end for pair in pairs for end in pair})
        return problem_of_pairs("connectome", pairs, (f"apart{i + 1}" for i in range(apart))), "C. elegans"
    random = Random(1)
    found: dict[tuple[int, int], None] = {}
    while len(found) < 2194:
        a = int(random.random() ** 2 * 302)
        b = int(random.random() ** 2 * 302) if random.random() < 0.3 else (a + int(random.gauss(0, 20))) % 302
        if a != b:
            found[a, b] = None
    pairs = [(f"N{(a * 145) % 302 + 1}", f"N{(b * 145) % 302 + 1}") for a, b in found]
    return problem_of_pairs("connectome", pairs, (f"N{i + 1}" for i in range(302))), "generated connectome"
