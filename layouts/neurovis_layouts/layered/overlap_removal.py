"""Overlap removal: moves what is not pinned off what is; mirror images move together, aligned neurons on their line.

In: bodies, some of them pinned, whose mirror image each neuron is, the axis. Out: a place for every body.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet

from neurovis_layouts.layered.occupancy import Body, Ground
from neurovis_spec.layout.model import RADIUS, LayoutRefusalError, Point

_STEP = 0.25


def arranged(
    names: Sequence[str], bodies: Sequence[Body], pair: Mapping[int, int], axis: float, shifted: AbstractSet[int]
) -> list[Point]:
    """Where each body stands: pinned ones first, then those whose wish is free, then the others. The wishes of free
    bodies are clear of each other, except for those ``shifted`` to the lines that pins give.

    Raises LayoutRefusalError where a line has no room.
    """
    owner = {m: b for b, body in enumerate(bodies) for m in body.members}
    image = [owner[pair[body.members[0]]] if body.members[0] in pair else -1 for body in bodies]
    ground = Ground()
    at: dict[int, Point] = {}
    for b, body in enumerate(bodies):
        if body.pinned:
            ground.put(body, body.wish)
            at[b] = body.wish
    waiting: list[int] = []
    for b, body in enumerate(bodies):
        if b not in at and not (0 <= image[b] < b):
            places = _both(body, body.wish, image[b], b, bodies, axis)
            moved = any(k in shifted for k, _ in places)
            if not moved and all(ground.takes(bodies[k], place, 2 * RADIUS) for k, place in places):
                at.update(places)
            else:
                waiting.append(b)
    for b, place in sorted(at.items()):
        if not bodies[b].pinned:
            ground.put(bodies[b], place)
    for b in waiting:
        found = _search(ground, bodies, b, image[b], axis)
        if not found:
            about = tuple(names[m] for m in bodies[b].members)
            raise LayoutRefusalError("pin-in-frame", "pins leave no room on a line", "move one of the pins", about)
        for k, place in found:
            ground.put(bodies[k], place)
            at[k] = place
    return [at[b] for b in range(len(bodies))]


def _both(
    body: Body, place: Point, image: int, own: int, bodies: Sequence[Body], axis: float
) -> list[tuple[int, Point]]:
    """A body and its image, where they stand together."""
    if image < 0 or image == own:
        return [(own, place)]
    return [(own, place), (image, (2 * axis - place[0], place[1]))]


def _search(ground: Ground, bodies: Sequence[Body], own: int, image: int, axis: float) -> list[tuple[int, Point]]:
    """The free place nearest to the wish, sideways first; none where a line has no room. What is on the axis stays
    on it if that can be."""
    body = bodies[own]
    x, y = body.wish
    on_axis = image == own or (image < 0 and x == axis)
    reach = 4
    while True:
        steps = range(-reach, reach + 1)
        across, along = [0] if on_axis else steps, [0] if body.level else steps
        around = sorted((i * i + j * j, abs(j), -i, -j) for i in across for j in along)
        for squared, _, i, j in around:
            if squared > reach * reach:
                break
            place = (x - i * _STEP, y - j * _STEP)
            places = _both(body, place, image, own, bodies, axis)
            if _clear_of_each_other(bodies, places) and all(ground.takes(bodies[k], p) for k, p in places):
                return places
        if reach > 64 and on_axis and image != own:
            on_axis = False
        elif reach > 4096:
            return []
        reach *= 2


def _clear_of_each_other(bodies: Sequence[Body], places: Sequence[tuple[int, Point]]) -> bool:
    if len(places) < 2:
        return True
    ground = Ground()
    ground.put(bodies[places[0][0]], places[0][1])
    return ground.takes(bodies[places[1][0]], places[1][1])
