"""Components: what is not connected is laid out on its own.

In: a problem and its units. Out: components as lists of units.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import networkx as nx

from neurovis_layouts.layered.units import Unit
from neurovis_spec.layout.model import LayoutProblem


def components_of(
    problem: LayoutProblem, units: Sequence[Unit], bonds: Sequence[int]
) -> tuple[list[list[int]], list[int]]:
    """Components of several connected units or of one block, as unit indices; and units without connections.

    Components that a box joins are one, and those that share a rank: ``bonds`` are each unit's first mate in it.
    """
    owner = {member: i for i, unit in enumerate(units) for member in unit.members}
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(len(units)))
    graph.add_edges_from((owner[edge.source], owner[edge.target]) for edge in problem.edges)
    for _, members in problem.boxes:
        mates = [owner[m] for m in members if graph.degree(owner[m]) or units[owner[m]].places is not None]
        graph.add_edges_from(pairwise(mates))
    graph.add_edges_from(enumerate(bonds))
    connected: list[list[int]] = []
    alone: list[int] = []
    for component in sorted(sorted(part) for part in nx.connected_components(graph)):
        if len(component) == 1 and units[component[0]].places is None:
            alone += component
        else:
            connected.append(component)
    return connected, alone
