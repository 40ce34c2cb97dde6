"""Named boxes: the frame around their neurons, and a place for their title where no line crosses it.

In: the groups' ``box`` and the layout section's ``boxes``. Out: rectangles in layout units, largest first, and titles
in user units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from neurovis_spec.compiler.network import Group, Network
from neurovis_spec.scene import texts
from neurovis_spec.scene.geometry import FloatArray, Rect, bounds, overlap, sample
from neurovis_spec.scene.model import Text, Theme
from neurovis_spec.scene.obstacles import Obstacles

_PAD_ACROSS, _PAD_DOWN = 0.62, 0.6
_TIGHT = 0.42
_SIZE = 11.5


@dataclass(frozen=True, slots=True)
class Box:
    """A frame: its title in full, the name alone, its members, and its rectangle."""

    title: str
    name: str
    members: tuple[int, ...]
    rect: Rect


def boxes_of(network: Network, positions: FloatArray, routes: Sequence[FloatArray]) -> list[Box]:
    """All boxes, largest first; those that would touch another's are drawn tighter. Layout units."""
    members: dict[str, list[int]] = {}
    for group in network.neurons.groups:
        if group.box is not None:
            members.setdefault(group.box, []).extend(group.indices)
    for name, indices in network.layout.boxes:
        members.setdefault(name, []).extend(indices)
    named = {name: tuple(dict.fromkeys(indices)) for name, indices in members.items() if indices}
    wide = {name: _around(network, positions, routes, inside, False) for name, inside in named.items()}
    boxes = []
    for name, inside in named.items():
        crowded = any(other != name and overlap(wide[name], wide[other]) for other in named)
        rect = _around(network, positions, routes, inside, True) if crowded else wide[name]
        boxes.append(Box(_title(network, name, inside), name, inside, rect))
    return sorted(boxes, key=lambda b: (-(b.rect[2] - b.rect[0]) * (b.rect[3] - b.rect[1]), b.name))


def _around(
    network: Network, positions: FloatArray, routes: Sequence[FloatArray], inside: tuple[int, ...], tight: bool
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
    if around is None:
        return rect
    pad = 0.15
    return (
        min(rect[0], around[0] - pad),
        min(rect[1], around[1] - pad),
        max(rect[2], around[2] + pad),
        max(rect[3], around[3] + pad),
    )


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


def box_title(box: Box, rect: Rect, obstacles: Obstacles, theme: Theme, picture: Rect) -> Text | None:
    """The title where nothing crosses it: first inside the corners, then just outside; the name alone where the whole
    finds no room, or as much of the name as finds it. ``rect`` and ``picture``: the box and what may be drawn on, in
    user units."""
    best: tuple[int, int, Text, Rect] | None = None
    room = picture[2] - picture[0]
    shorter = [texts.shorten(box.name, _SIZE, share * min(room, rect[2] - rect[0])) for share in (1, 0.7, 0.5, 0.35)]
    fitting = [text for text in shorter if len(text) > 3]
    for penalty, text in enumerate([*(texts.shorten(name, _SIZE, room) for name in (box.title, box.name)), *fitting]):
        width = texts.width(text, _SIZE)
        for rank, (x, y) in enumerate(_places(rect, width, picture)):
            x = min(max(x, picture[0]), picture[2] - width)
            taken = (x - 2, y - _SIZE, x + width + 2, y + 0.3 * _SIZE)
            if taken[1] < picture[1] or taken[3] > picture[3]:
                continue
            hits = obstacles.hits(taken)
            if best is None or (hits, penalty * 1000 + rank) < best[:2]:
                best = (hits, penalty * 1000 + rank, Text((x, y), text, _SIZE, theme.muted), taken)
            if hits == 0:
                break
        if best is not None and best[0] == 0:
            break
    if best is None or best[0] >= 10_000:
        return None
    obstacles.add_text(best[3])
    return best[2]


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
