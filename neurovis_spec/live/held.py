"""Held: all connections of what somebody holds, also those for which the picture has no room.

In: a View, the id of what is held, the weights of a step. Out: Held: which connections it has, and how many come from
elsewhere, go elsewhere and stay within; ``lines_of``, those of them that the picture leaves out, as groups of a scene.
"""

from __future__ import annotations

import gzip
import json
import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.live.drawing import group_as_json
from neurovis_spec.live.view import View, without_value
from neurovis_spec.scene import Group, Shape, Spline
from neurovis_spec.scene.encode import connection_tooltips, data_attributes
from neurovis_spec.scene.line_styles import styles_of
from neurovis_spec.scene.model import FlatSpline, ended
from neurovis_spec.scene.plan import rerouted

#: More lines than this are not drawn beside those of the picture.
MOST: Final = 5000
#: What can be held: a neuron, a connection, what stands around neurons, what stands for many lines.
KINDS: Final = re.compile(r"([nc][0-9]{1,9}|(box|instance|bundle):.{1,4096})", re.ASCII | re.DOTALL)


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """The connections of what is held, ascending, of what is drawn; how many of the network come into it (``inputs``),
    leave it (``outputs``) and stay ``within``."""

    connections: IntArray
    inputs: int
    outputs: int
    within: int


def held(view: View, item: str) -> Held | None:
    """What is held by an id (``KINDS``): a neuron or a box with all that ends or begins there, a connection, all that a
    bundle stands for. None where there is no such thing."""
    drawn = view.drawn
    ends, counts = drawn.network.connections, drawn.counts
    if item[0] == "c" and item[1:].isdigit():
        return _alone(view, np.array([int(item[1:])])) if int(item[1:]) < len(counts) else None
    if item in view.plan.left:
        return _alone(view, view.plan.left[item].members)
    members = view.plan.boxes.get(item, ())
    if item[0] == "n" and item[1:].isdigit() and int(item[1:]) < len(drawn.sizes):
        members = (int(item[1:]),)
    if not members:
        return None
    own = np.zeros(len(drawn.sizes), bool)
    own[list(members)] = True
    begin, end = own[ends.sources.whole()], own[ends.targets.whole()]
    parts = (int(counts[some].sum()) for some in (end & ~begin, begin & ~end, begin & end))
    return Held(np.flatnonzero(begin | end), *parts)


def _alone(view: View, connections: IntArray) -> Held:
    """Connections, of whose ends nothing is held."""
    return Held(connections, 0, 0, int(view.drawn.counts[connections].sum()))


def told_of(view: View, item: str, weights: FloatArray) -> bytes:
    """What a page is told of what it holds, as JSON, compressed: how many connections that has, and those lines of it
    that the picture leaves out, at most MOST, the strongest by the ``weights`` (m,) of what is drawn. Nothing of what
    there is not."""
    found = held(view, item) or Held(np.zeros(0, np.int64), 0, 0, 0)
    left = hidden(view, found.connections)
    strongest = left[np.argsort(-np.nan_to_num(np.abs(weights[left])), kind="stable")[:MOST]]
    value = {
        "of": item,
        "inputs": found.inputs,
        "outputs": found.outputs,
        "within": found.within,
        "undrawn": len(left) - len(strongest),
        "groups": [group_as_json(group) for group in lines_of(view, np.sort(strongest).tolist())],
    }
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return gzip.compress(text.encode("utf-8", "replace"), 1, mtime=0)


def hidden(view: View, connections: IntArray) -> IntArray:
    """Those that the picture leaves out; of symmetric pairs, which are one line, the first."""
    ends, lines = view.drawn.network.connections, np.array(list(view.plan.lines), np.int64)
    if ends.twins is not None and len(connections):
        twins = ends.twins[connections]
        connections = np.unique(np.where((twins >= 0) & (twins < connections), twins, connections))
    result: IntArray = np.setdiff1d(connections, lines)
    return result


def lines_of(view: View, some: list[int]) -> list[Group]:
    """Connections as groups of a scene, as they run in the layout, without what depends on a step."""
    planned, network = view.plan, view.drawn.network
    styles, theme = styles_of(network), planned.theme
    radius, weights = view.radius, network.connections.weights.whole()
    titles = connection_tooltips(network, view.gains, weights[None], some)
    rows = zip(some, rerouted(planned, view.layout, some), data_attributes(network, some), titles, strict=True)
    result = list[Group]()
    for index, line, data, title in rows:
        dash = () if styles is None else tuple(planned.unit * one for one in styles.dash(index, radius))
        kind = FlatSpline if dash else Spline
        heads = (ended(end, 1.0, theme.zero, 1) for end in line.ends)
        shapes: tuple[Shape, ...] = (kind(line.points, theme.zero, 1.0, dash), *heads)
        if view.drawn.sheaf[index]:
            data["size"] = str(int(view.drawn.counts[index]))
        result.append(Group(shapes, f"c{index}", data, without_value(title)))
    return result
