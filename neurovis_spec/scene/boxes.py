"""Named boxes: the frame around their neurons, and a place for their title where no line crosses it.

In: the groups' ``box``, the layout section's ``boxes`` and the instances of modules. Out: rectangles in layout units,
largest first, and titles in user units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.compiler.network import Group, Network
from neurovis_spec.scene import texts
from neurovis_spec.scene.geometry import FloatArray, Rect, bounds, overlap, sample
from neurovis_spec.scene.model import Text, Theme
from neurovis_spec.scene.obstacles import Obstacles

_PAD_ACROSS, _PAD_DOWN = 0.62, 0.6
_TIGHT = 0.42
#: of a title; where nothing else helps its name gets as small as the last
_SIZE, _SMALLER = 11.5, (10.0, 9.0)

#: Around what an instance's frame holds: centres, routes, frames; and room for its title on top.
_PAD_FRAME, _PAD_ROUTE, _PAD_INNER, _TITLE_ROOM = 0.65, 0.2, 0.35, 0.35


@dataclass(frozen=True, slots=True)
class Box:
    """A frame: its title in full, the name alone, its members, and its rectangle; what it is (``box`` or
    ``instance``) and its name in the network, which no other of its kind has."""

    title: str
    name: str
    members: tuple[int, ...]
    rect: Rect
    kind: str = "box"
    path: str = ""


@dataclass(frozen=True, slots=True)
class _Named:
    kind: str
    path: str
    members: tuple[int, ...]


def boxes_of(network: Network, positions: FloatArray, routes: Sequence[FloatArray]) -> list[Box]:
    """All boxes, and the instances of modules, largest first. Boxes that would touch another's are drawn tighter, what
    holds another is drawn around it, and an instance that foreign neurons stand in has no frame. Layout units."""
    named = _named(network)
    within = {id(n): frozenset(n.members) for n in named}
    inner = _routes_within(network, routes, [n for n in named if n.kind == "instance"])
    rects: dict[int, Rect] = {}
    for tight in (False, True):
        for item in named:  # what is held by another comes before it
            held = [
                rects[id(o)] for o in named if o is not item and id(o) in rects and within[id(o)] < within[id(item)]
            ]
            if item.kind == "instance":
                rects[id(item)] = _framed(positions, inner.get(item.path, []), item.members, held)
            elif not tight or any(
                overlap(rects[id(item)], rects[id(o)])
                for o in named
                if not (within[id(o)] <= within[id(item)] or within[id(item)] <= within[id(o)])
            ):
                rects[id(item)] = _around(network, positions, routes, item.members, held, tight)
    boxes = [
        Box(_titled(network, n), n.path.rpartition(".")[2], n.members, rects[id(n)], n.kind, n.path)
        for n in named
        if n.kind == "box" or not _entered(positions, rects[id(n)], n.members)
    ]
    return sorted(boxes, key=lambda b: (-(b.rect[2] - b.rect[0]) * (b.rect[3] - b.rect[1]), b.kind, b.path))


def _named(network: Network) -> list[_Named]:
    """Boxes and instances by size, small ones first; an instance after a box with the same neurons."""
    members: dict[str, list[int]] = {}
    for group in network.neurons.groups:
        if group.box is not None:
            members.setdefault(group.box, []).extend(group.indices)
    for name, indices in network.layout.boxes:
        members.setdefault(name, []).extend(indices)
    found = [_Named("box", name, tuple(dict.fromkeys(indices))) for name, indices in members.items() if indices]
    found += [_Named("instance", i.path, tuple(i.indices)) for i in network.instances if i.count]
    return sorted(found, key=lambda n: (len(n.members), n.kind, n.path.count("."), n.path))


def _routes_within(
    network: Network, routes: Sequence[FloatArray], instances: Sequence[_Named]
) -> dict[str, list[FloatArray]]:
    """Sampled routes between two neurons of an instance, by its path."""
    starts = [(n.members[0], n.members[-1], n.path) for n in instances]
    found: dict[str, list[FloatArray]] = {}
    ends = zip(network.connections.sources.tolist(), network.connections.targets.tolist(), strict=True)
    for index, (source, target) in enumerate(ends if starts else ()):
        line: FloatArray | None = None
        for first, last, path in starts:
            if first <= source <= last and first <= target <= last:
                line = sample(routes[index], 8) if line is None else line
                found.setdefault(path, []).append(line)
    return found


def _framed(positions: FloatArray, lines: Sequence[FloatArray], inside: tuple[int, ...], held: Sequence[Rect]) -> Rect:
    """The frame of an instance, as the layered engine keeps it free."""
    parts = [_wider(bounds([positions[list(inside)]]), _PAD_FRAME), _wider(bounds(lines), _PAD_ROUTE)]
    x0, y0, x1, y1 = _union([part for part in parts if part is not None] + [_padded(r, _PAD_INNER) for r in held])
    return x0, y0 - _TITLE_ROOM, x1, y1


def _wider(rect: Rect | None, by: float) -> Rect | None:
    return None if rect is None else _padded(rect, by)


def _padded(rect: Rect, by: float) -> Rect:
    return rect[0] - by, rect[1] - by, rect[2] + by, rect[3] + by


def _union(rects: Sequence[Rect]) -> Rect:
    return (
        min(rect[0] for rect in rects),
        min(rect[1] for rect in rects),
        max(rect[2] for rect in rects),
        max(rect[3] for rect in rects),
    )


def _entered(positions: FloatArray, rect: Rect, members: tuple[int, ...]) -> bool:
    """Whether a neuron that is none of its members stands in a rectangle."""
    inside = (
        (positions[:, 0] > rect[0])
        & (positions[:, 0] < rect[2])
        & (positions[:, 1] > rect[1])
        & (positions[:, 1] < rect[3])
    )
    return int(inside.sum()) > int(inside[list(members)].sum())


def _around(
    network: Network,
    positions: FloatArray,
    routes: Sequence[FloatArray],
    inside: tuple[int, ...],
    held: Sequence[Rect],
    tight: bool,
) -> Rect:
    across, down = (_TIGHT, _TIGHT) if tight else (_PAD_ACROSS, _PAD_DOWN)
    dots = bounds([positions[list(inside)]])
    assert dots is not None
    x0, y0, x1, y1 = dots
    rect = (x0 - across, y0 - down, x1 + across, y1 + down)
    connections, chosen = network.connections, set(inside)
    loops = [
        sample(routes[index], 8)
        for index, (source, target) in enumerate(
            zip(connections.sources.tolist(), connections.targets.tolist(), strict=True)
        )
        if source == target and source in chosen
    ]
    around = bounds(loops)
    parts = [rect, *(_padded(r, 0.15 if tight else 0.3) for r in held)]
    return _union(parts if around is None else [*parts, _padded(around, 0.15)])


def _titled(network: Network, item: _Named) -> str:
    name = item.path.rpartition(".")[2]
    return name if item.kind == "instance" else _title(network, name, item.members)


def _title(network: Network, name: str, members: tuple[int, ...]) -> str:
    """The name, and what its neurons compute where that is one thing and worth saying."""
    chosen = set(members)
    groups = [group for group in network.neurons.groups if chosen.intersection(group.indices)]
    told = {_computes(group) for group in groups}
    only = told.pop() if len(told) == 1 else ""
    return f"{name} · {only}" if only else name


_GREEK = {"sigma": "σ", "beta": "β", "alpha": "α", "gamma": "γ", "theta": "θ", "tau": "τ"}


def _computes(group: Group) -> str:
    words = [] if group.model == "static" else [group.model.replace("_", " ")]
    if group.activation != "identity":
        words.append(group.activation.replace("_", " "))
        for key, values in group.activation_parameters.items():
            if len(group.activation_parameters) == 1 and len(set(values)) == 1:
                words[-1] += f", {_GREEK.get(key, key)} = {texts.number(values[0])}"
    return " ".join(words)


def outline(rect: Rect) -> FloatArray:
    """Points on the line of a box, in user units."""
    x0, y0, x1, y1 = rect
    across, down = np.arange(x0, x1, 4.0), np.arange(y0, y1, 4.0)
    return np.concatenate(
        [np.column_stack([across, np.full(len(across), y)]) for y in (y0, y1)]
        + [np.column_stack([np.full(len(down), x), down]) for x in (x0, x1)]
    )


def box_title(box: Box, rect: Rect, obstacles: Obstacles, theme: Theme, picture: Rect) -> Text | None:
    """The title where nothing crosses it: first inside the corners, then just outside; the name alone where the whole
    finds no room, or as much of the name as finds it. ``rect`` and ``picture``: the box and what may be drawn on, in
    user units."""
    best: tuple[int, int, Text, Rect] | None = None
    for penalty, (text, size) in enumerate(_wordings(box, rect, picture)):
        width = texts.width(text, size)
        for rank, (x, y) in enumerate(_places(rect, width, picture)):
            x = min(max(x, picture[0]), picture[2] - width)
            taken = (x - 2, y - size, x + width + 2, y + 0.3 * size)
            if taken[1] < picture[1] or taken[3] > picture[3]:
                continue
            hits = obstacles.hits(taken)
            if best is None or (hits, penalty * 1000 + rank) < best[:2]:
                halo = theme.box_fill if hits else ""
                best = (hits, penalty * 1000 + rank, Text((x, y), text, size, theme.muted, halo=halo), taken)
            if hits == 0:
                break
        if best is not None and best[0] == 0:
            break
    if best is None or best[0] >= 10_000:
        return None
    obstacles.add_text(best[3])
    return best[2]


def _wordings(box: Box, rect: Rect, picture: Rect) -> list[tuple[str, float]]:
    """What a title may say and how large, best first: all, the name, the name in small, the beginning of the name."""
    room = picture[2] - picture[0]
    whole = [(texts.shorten(box.title, _SIZE, room), _SIZE)]
    whole += [(texts.shorten(box.name, size, room), size) for size in (_SIZE, *_SMALLER)]
    shares = [texts.shorten(box.name, _SIZE, share * min(room, rect[2] - rect[0])) for share in (1, 0.7, 0.5, 0.35)]
    return whole + [(text, _SIZE) for text in shares if len(text) > 3]


def _places(rect: Rect, width: float, picture: Rect) -> list[tuple[float, float]]:
    """Starts of the baseline, best first."""
    x0, y0, x1, y1 = rect
    left, right = x0 + 10, x1 - 10 - width
    inside_top, inside_bottom, above, below = y0 + 14, y1 - 6, y0 - 6, y1 + 15
    corners = [
        (x, y) for y in (inside_top, inside_bottom, above, below) for x in ((left, right) if right > left else (left,))
    ]
    slid = [
        (left + (right - left) * share / 12, y)
        for y in (inside_top, inside_bottom, above, below)
        for share in range(1, 12)
        if right > left
    ]
    outside = [(x0 + 2, above), (x0 + 2, below), (x1 - 2 - width, above), (x1 - 2 - width, below)]
    sides = [x for x in (x0 - 8 - width, x1 + 8) if picture[0] <= x <= picture[2] - width]
    beside = [(x, y) for y in (y0 + 13, y1 - 5) for x in sides]
    return corners + outside + slid + beside
