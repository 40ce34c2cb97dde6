"""ELK, beside which layouts are measured: what it makes of a graph is read as a layout of ours."""

import sys
from itertools import combinations, pairwise
from pathlib import Path

import layout_conformance as suite
import pytest

from neurovis_spec.layout.geometry import bounds, distance
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "benchmarks"))
from layout_peers import PEERS

pytestmark = pytest.mark.node

NAMES = ["I", *(f"{m}.{n}" for m in ("a", "b") for n in ("X", "Y")), "O"]
PAIRS = [("I", "a.X"), ("I", "b.Y"), ("a.X", "a.Y"), ("b.Y", "b.X"), ("a.Y", "O"), ("b.X", "O"), ("O", "O"), ("O", "I")]
PROBLEM = NamedProblem("pair", NAMES, edges=suite.named(PAIRS), modules=[("a", "m"), ("b", "m")]).canonical()


@pytest.mark.parametrize("peer", ["elk", "elk, clusters"])
def test_elk_places_every_neuron_and_routes_every_connection(peer: str) -> None:
    made = PEERS[peer](PROBLEM, 60)
    assert made is not None
    layout, seconds = made
    assert seconds > 0
    suite.check_routes(PROBLEM, layout)
    assert min(distance(a, b) for a, b in combinations(layout.positions.values(), 2)) > 0.999
    assert metrics(layout, PROBLEM)["crossings"] == 0
    ranks = sorted({y for _, y in layout.positions.values()})
    assert min(below - above for above, below in pairwise(ranks)) > 0.999


def test_elk_keeps_instances_apart() -> None:
    made = PEERS["elk, clusters"](PROBLEM, 60)
    assert made is not None
    places = made[0].positions
    one, other = (bounds([places[f"{m}.X"], places[f"{m}.Y"]]) for m in ("a", "b"))
    assert one[2] + 0.6 < other[0] or other[2] + 0.6 < one[0] or one[3] + 0.6 < other[1] or other[3] + 0.6 < one[1]
