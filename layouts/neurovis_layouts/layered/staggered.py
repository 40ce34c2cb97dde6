"""Staggered: ranks of very many neurons in two rows, every other neuron behind its neighbours, so that a network much
wider than a page becomes narrower.

In: levels with their order and where that places them, the proportions of a page. Out: the levels, of such ranks every
other neuron lifted. Connections to and from these run in the gaps between those before them (``fold_ports``).
"""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

from neurovis_layouts.layered.levels import Levels, Node
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import LayoutProblem, Point

#: What is wider than a page by this is staggered: its ranks of so many neurons and more, that make it so wide.
_WIDE, _FEWEST, _PART = 2.0, 20, 0.5


def staggered(
    problem: LayoutProblem, levels: Levels, order: Sequence[Sequence[int]], places: Sequence[Point]
) -> Levels | None:
    """The levels with the widest ranks staggered; None where they are not much wider than a page."""
    xs, ys = zip(*places, strict=True)
    wide, high = max(xs) - min(xs) + 1, max(ys) - min(ys) + 1
    page = problem.page if problem.direction in ("down", "up") else 1 / problem.page
    if wide < _WIDE * page * high:
        return None
    lined = {m for line in problem.align for m in line}
    nodes, rise = list(levels.nodes), snap(problem.neuron_spacing / 2)
    for rank in order:
        own = [n for n in rank if nodes[n].members]
        across = [places[n][0] for n in own]
        alone = all(_alone(nodes[n], lined) for n in own)
        if alone and len(own) >= _FEWEST and max(across) - min(across) > _PART * wide:
            for place, n in enumerate(own):
                nodes[n] = replace(nodes[n], lift=rise if place % 2 else -rise)
    return None if nodes == levels.nodes else replace(levels, nodes=nodes)


def _alone(node: Node, lined: AbstractSet[int]) -> bool:
    """Whether a node is a single neuron, as high as its disc, that nobody wants on a line."""
    return len(node.members) == 1 and node.reach == (0.0, 0.0) and not node.lift and node.members[0][0] not in lined
