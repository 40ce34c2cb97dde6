"""Which engine ``auto`` stands for.

In: a LayoutProblem. Out: an engine's name, and why, in words for ``inspect``.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence, Set
from dataclasses import replace
from typing import cast

from neurovis_spec.layout.engines import engine_of, engines_that, refuse
from neurovis_spec.layout.model import LayoutProblem, LayoutRefusalError, SizingEngine, Suits

#: A component of so many neurons, with so many connections each within their group, is a tangle.
_LARGE, _DENSE = 40, 2.5
#: A tangle goes on a ring if it has this share of all connections that there can be, and no more neurons than these: on
#: a larger ring discs get too small.
_COMPLETE, _MOST_IN_RING = 0.25, 120
#: With more connections nobody can follow one.
_MOST_IN_RANKS = 1000
#: Layers of neurons, frames of instances, and chains and trees, show something nevertheless, up to so many.
_MOST_IN_LAYERS = 20_000
#: In chains and trees so few of the neurons have several sources, or targets where branches converge, and none has more
#: connections than these: those to the far end of a rank would run along it.
_MERGING, _MOST_AT_ONE = 0.1, 40
#: So many parts that hang together by themselves are drawn in ranks before it gets slow.
_MOST_PARTS = 500
#: Trees of more connections than this are drawn as such if these run to and fro: in ranks they would cross. So are
#: others, if a neuron has more than this, as the rank of its targets would be a line; and all that have too many for
#: ranks. But at least this share of the neurons have one neighbour: what is mostly chains is long, and ranks it is.
_MOST_TO_AND_FRO, _MOST_IN_ROW, _ENDS = 60, 120, 0.1

#: Discs whose radius has fewer pixels than this cannot be told from lines. No engine draws them larger where there are
#: more neurons than this.
_SEEN, _MOST_SEEN = 3.0, 2000

_USUAL = "the default for networks whose positions are not all given"
_TANGLED = "its neurons drive one another in loops so densely that ranks would say nothing"


def choose_engine(problem: LayoutProblem) -> tuple[str, str]:
    """The engine that ``auto`` stands for, and why, in words for ``inspect``. What is too large for the one that suits
    it best is drawn by the one for clusters, if that can do all that is asked. Raises LayoutRefusalError where none is
    installed."""
    suits, why = _most_suitable(problem)
    if suits == "positions" and (small := _too_small(problem)):
        suits, instead = _most_suitable(replace(problem, places=()))
        why = small if instead == _USUAL else f"{instead}; {small}"
    name = _suited(suits)
    if _takes(name, problem):
        return name, why
    large = _suited("clusters")
    if not _takes(large, problem):
        return name, why
    return large, f"{why}, and '{name}' does not draw so many neurons and connections"


def _suited(suits: Suits) -> str:
    """The engine that shows something best."""
    names = engines_that(lambda can: can.suits == suits)
    if not names:
        raise LayoutRefusalError("unknown-engine", f"no layout engine is installed that suits {suits}")
    return names[0]


def _too_small(problem: LayoutProblem) -> str:
    """How small discs would be where their positions are, in words; '' where they can be seen."""
    name = _suited("positions")
    engine = engine_of(name)
    if not engine.capabilities.sizes or len(problem.neurons) > _MOST_SEEN or not _takes(name, problem):
        return ""
    radius = problem.disc(cast(SizingEngine, engine).size(problem))
    if radius >= _SEEN:
        return ""
    return f"where their 'position' says, as '{name}' draws them, discs would have a radius of {radius:.1f} pixels"


def _takes(name: str, problem: LayoutProblem) -> bool:
    """Whether an engine can do what a problem asks for."""
    try:
        refuse(problem, name, engine_of(name).capabilities)
    except LayoutRefusalError:
        return False
    return True


def _most_suitable(problem: LayoutProblem) -> tuple[Suits, str]:
    """What a drawing is to show, and why."""
    if problem.plan:
        return "flow", "it puts what the spec says into rows and columns of the page"
    if problem.arrange or problem.align:
        return "flow", "it can arrange and align as the spec says"
    suits, why = _unasked(problem)
    if problem.mirrors and suits not in ("flow", "clusters"):
        return "flow", "it can mirror as the spec says"
    return suits, why


def _unasked(problem: LayoutProblem) -> tuple[Suits, str]:
    """What a drawing shows best where nothing is asked of it but pins and instances, and why."""
    edges = len(problem.edges)
    if problem.neurons and len(problem.pins) == len(problem.neurons):
        return "pins", "every neuron has a position"
    if problem.places and not problem.modules and all(math.isfinite(x + y) for x, y in problem.places):
        return "positions", "every neuron has a 'position' as data"
    if problem.modules and edges <= _MOST_IN_LAYERS:
        return "flow", "it draws instances as frames"
    if not (problem.pins or problem.modules) and _tangled(problem):
        if (
            not problem.boxes
            and len(problem.neurons) <= _MOST_IN_RING
            and edges > _COMPLETE * len(problem.neurons) ** 2
        ):
            return "tangle", _TANGLED
        return "clusters", _TANGLED
    if not (problem.pins or problem.boxes or problem.modules or problem.mirrors) and _as_trees(problem):
        return "clusters", f"its {edges} connections form trees, which it draws without a crossing"
    if edges > _MOST_IN_RANKS and _in_branches(problem):
        return "flow", f"its {edges} connections form chains or trees, whose flow ranks keep"
    if edges > _MOST_IN_RANKS and not _in_layers(problem):
        shown = ", and instances show as such, not as frames drawn alike" if problem.modules else ""
        return "clusters", f"its {edges} connections are too many to follow each: clusters say more{shown}"
    return "flow", _USUAL


def _in_branches(problem: LayoutProblem) -> bool:
    """Whether the connections form chains and trees, or nearly: each neuron has one source, or, where branches
    converge, one target. Then one can follow each connection, however many there are."""
    if len(problem.edges) > _MOST_IN_LAYERS:
        return False
    pairs = {(edge.source, edge.target) for edge in problem.edges if edge.source != edge.target}
    sources, targets = _times(pairs)
    wired = sources.keys() | targets.keys()
    if len(pairs) > (1 + _MERGING) * len(wired) or max((sources + targets).values(), default=0) > _MOST_AT_ONE:
        return False
    parts = _parts(pairs)
    return len(parts) <= _MOST_PARTS and _merging(parts, sources, targets) <= _MERGING * len(wired)


def _as_trees(problem: LayoutProblem) -> bool:
    """Whether the connections form nothing but trees, and ranks would show that badly: branches converge as well as
    divide, or one neuron has very many, or all of them are."""
    pairs = {(min(e.source, e.target), max(e.source, e.target)) for e in problem.edges if e.source != e.target}
    if not _MOST_TO_AND_FRO < len(pairs) < len(problem.neurons):
        return False
    parts = _parts(pairs)
    if len(pairs) != sum(map(len, parts)) - len(parts):
        return False
    sources, targets = _times({(e.source, e.target) for e in problem.edges if e.source != e.target})
    near = (sources + targets).values()
    if sum(times == 1 for times in near) < _ENDS * len(near):
        return False
    wide = max(near) > _MOST_IN_ROW or len(pairs) > _MOST_IN_RANKS
    return wide or _merging(parts, sources, targets) > _MERGING * len(pairs)


def _times(pairs: Set[tuple[int, int]]) -> tuple[Counter[int], Counter[int]]:
    """How many sources each neuron has, and how many targets."""
    return Counter(target for _, target in pairs), Counter(source for source, _ in pairs)


def _parts(pairs: Set[tuple[int, int]]) -> list[set[int]]:
    """The neurons of each part that hangs together."""
    import networkx as nx  # only here, for few networks

    return list(nx.connected_components(nx.Graph(sorted(pairs))))


def _merging(parts: Sequence[Set[int]], sources: Counter[int], targets: Counter[int]) -> int:
    """How many sources, or targets where that is less, neurons have beyond their first, part by part."""
    return sum(min(sum(max(times[i] - 1, 0) for i in part) for times in (sources, targets)) for part in parts)


def _in_layers(problem: LayoutProblem) -> bool:
    """Whether groups are layers, as in a perceptron: nothing runs within a group, and signals never come back to
    one."""
    if len(problem.edges) > _MOST_IN_LAYERS or 2 * len(problem.groups) > len(problem.neurons):
        return False
    group = {m: number for number, members in enumerate(problem.groups) for m in members.members}
    between = {(group.get(a, -1), group.get(b, -1)) for edge in problem.edges for a, b in edge.ways}
    import networkx as nx  # only here, for few networks

    return bool(nx.is_directed_acyclic_graph(nx.DiGraph(sorted(between))))


def _tangled(problem: LayoutProblem) -> bool:
    """Whether a large strongly connected component is dense with connections within groups: there is no direction in
    such a network that ranks could show. Connections between groups, even back and forth, do give one."""
    group = {m: number for number, members in enumerate(problem.groups) for m in members.members}
    loops = [e for e in problem.edges if e.source != e.target and group.get(e.source) == group.get(e.target)]
    if len(loops) < _DENSE * _LARGE:
        return False
    import networkx as nx  # only here, for few networks

    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_edges_from(way for edge in problem.edges for way in edge.ways)
    largest: set[int] = max(nx.strongly_connected_components(graph), key=len)
    inside = sum(edge.source in largest and edge.target in largest for edge in loops)
    return len(largest) >= _LARGE and inside >= _DENSE * len(largest)
