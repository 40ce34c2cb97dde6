"""Labels: the room that names of neurons and titles of frames take, in units of a layout.

In: a network, or names. Out: for each neuron how wide and high its label is beside its disc, (0, 0) where the disc
holds it; how wide titles are; what a label covers on a side of its disc. Layouts keep this room and scenes use it, so
both measure here, as in a picture that is not reduced.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from neurovis_spec.compiler.network import Group, Network, Neurons
from neurovis_spec.layout.geometry import Rect, shifted
from neurovis_spec.layout.model import RADIUS, Point, Side
from neurovis_spec.text_width import width, with_subscript

#: Page units for a layout unit in a picture that is small enough.
UNIT = 66.0
#: How heavy the letters of labels are, and those of the titles of instances and of boxes.
WEIGHT, INSTANCE_WEIGHT, BOX_WEIGHT = 600, 600, 400
#: The smallest size on a disc, in page units; of numbered names, which say where one is among many; on small discs.
SMALLEST, NUMBERED, TINY = 9.0, 7.5, 6.0
#: The largest beside a disc; and how far its letters rise over their baseline and hang below it, in sizes.
BESIDE, RISE, DROP = 11.0, 0.8, 0.25
#: From a line of a label to the next, in sizes.
LINE = 1.15
#: Gaps between a disc and its label: to the side, below, above, at a corner.
ASIDE, BELOW, ABOVE, CORNER = 5.0, 4.0, 4.0, 3.0
#: How long a name beside a disc may be, in sizes of its letters: it must not look like a title of those around.
WIDEST = 18.0
#: More labels than this are never beside discs.
MOST = 400
#: How large a title is, and how far from the sides of its frame.
TITLE_SIZE, TITLE_INSET = 11.5, 10.0
#: How high the letters of a title are with the air around them.
TITLE_HIGH = 17.0
#: Of labels so wide together, in layout units, there is no room: in a picture that holds them all, letters that can be
#: read are larger than what was kept for them.
_MOST_ROOM = 100.0
#: What a text leaves free of its disc's width, as a share of the radius and at most.
_FREE, _MOST_FREE = 0.252, 5.0


def names_in_parts(neurons: Neurons) -> list[tuple[str, str]]:
    """The name of each neuron within its instance, and its subscript: its number in its group, whatever the group's own
    name ends in; of a neuron that has none, what the name ends in."""
    found = [("", "")] * len(neurons)
    for group in neurons.groups:
        own = group.name.rpartition(".")[2]
        for index in group.indices:
            name = neurons.names[index].rpartition(".")[2]
            number = name.removeprefix(own)
            counted = number.isdecimal() and number != name
            found[index] = (own.removesuffix("_") or own, number) if counted else with_subscript(name)
    return found


def parts_of(neurons: Neurons) -> list[tuple[str, str]]:
    """The label of each neuron and its subscript: that of the name, and of a label of its own that is such a name."""
    labelled = zip(neurons.labels, neurons.names, names_in_parts(neurons), strict=True)
    return [
        parts if label == name.rpartition(".")[2] else with_subscript(label) if label.isidentifier() else (label, "")
        for label, name, parts in labelled
    ]


def told_by_number(neurons: Neurons) -> list[bool]:
    """Whether a number alone says which neuron of its group each is: of several that are called alike but for it."""
    found, parts = [False] * len(neurons), parts_of(neurons)
    for group in neurons.groups:
        alike = len({parts[index][0] for index in group.indices}) == 1 and group.count > 1
        for index in group.indices if alike else ():
            found[index] = bool(parts[index][1])
    return found


def called_alike(neurons: Neurons) -> tuple[Group, ...]:
    """The groups of several neurons that have one label: it is said once of all of them."""
    return tuple(
        group
        for group in neurons.groups
        if group.count > 1
        and len({neurons.labels[index] for index in group.indices}) == 1
        and neurons.labels[group.start]
    )


def least_on_disc(subscript: str, radius: float) -> float:
    """The smallest size on a disc: it grows no faster than the disc, so that what fits on one fits on a larger one."""
    return max(TINY, min(NUMBERED if subscript else SMALLEST, 0.5 * radius))


def chord(radius: float, size: float) -> float:
    """How wide a text of this size may be on a disc."""
    free = min(_FREE * radius, _MOST_FREE)
    return float(2 * (max(radius * radius - (0.4 * size) ** 2, 0.0)) ** 0.5 - free)


def fits(parts: tuple[str, str], size: float, radius: float) -> bool:
    """Whether a label of this size has room on a disc."""
    return width(parts[0], size, WEIGHT, parts[1]) <= chord(radius, size)


def label_room(network: Network) -> tuple[Point, ...]:
    """How wide and high each neuron's label is beside its disc; (0, 0) where the disc holds it, or at least the number
    that says which of its group it is, and where it is that of the whole group. Mirror images, and neurons of one name
    in instances of one module, take the same room, that of the longest label. None at all where labels are left out, or
    are so long together that a picture of them all is too small for them."""
    neurons, none = network.neurons, (0.0, 0.0)
    radius = RADIUS * UNIT
    beside = [
        not told and not fits(both, least_on_disc(both[1], radius), radius)
        for both, told in zip(parts_of(neurons), told_by_number(neurons), strict=True)
    ]
    for group in called_alike(neurons):
        beside[group.start : group.start + group.count] = [False] * group.count
    if not network.render.labels or not any(beside):
        return ()
    wide = [
        min(width(label, 1.0, WEIGHT), WIDEST) * BESIDE / UNIT if there else 0.0
        for label, there in zip(neurons.labels, beside, strict=True)
    ]
    for alike in _alike(network):
        most = max(wide[index] for index in alike)
        for index in alike:
            wide[index] = most
    if sum(wide) > _MOST_ROOM:
        return ()
    high = (RISE + DROP) * BESIDE / UNIT
    return tuple((w, high) if w else none for w in wide)


def _alike(network: Network) -> list[list[int]]:
    """Neurons that are drawn alike, those that are alike by way of others together."""
    root = list(range(len(network.neurons)))

    def find(index: int) -> int:
        while root[index] != index:
            root[index] = root[root[index]]
            index = root[index]
        return index

    first: dict[tuple[str, str], int] = {}
    for instance in network.instances:
        for index in instance.indices:
            own = network.neurons.names[index][len(instance.path) :]
            root[find(index)] = find(first.setdefault((instance.module, own), index))
    for mirror in network.layout.mirrors:
        for one, other in mirror.pairs:
            root[find(one)] = find(other)
    found: dict[int, list[int]] = {}
    for index in range(len(root)):
        found.setdefault(find(index), []).append(index)
    return list(found.values())


def title_room(path: str, weight: int) -> float:
    """How wide a frame has to be for its title: the last part of its name."""
    words = path.rpartition(".")[2]
    return (width(words, TITLE_SIZE, weight) + 2 * TITLE_INSET) / UNIT if words else 0.0


def instance_titles(modules: Iterable[tuple[str, str]]) -> list[float]:
    """How wide the frames of instances (path and module) have to be for their titles, those of one module alike."""
    given = list(modules)
    widest: dict[str, float] = {}
    for path, module in given:
        widest[module] = max(widest.get(module, 0.0), title_room(path, INSTANCE_WEIGHT))
    return [widest[module] for _, module in given]


def beside(across: int, down: int, radius: float, wide: float, size: float, lines: int = 1) -> Rect:
    """What letters, in so many lines, cover beside a disc, from its centre, in page units: to the left or right
    (``across`` is −1 or 1), above or below (``down``), or at a corner."""
    more = (lines - 1) * LINE * size
    high = (RISE + DROP) * size + more
    if not across:
        top = radius + BELOW if down > 0 else -radius - ABOVE - high
        return -wide / 2, top, wide / 2, top + high
    near, top = radius + ASIDE, (0.36 - RISE) * size - more / 2
    if down:
        near = 0.75 * radius + CORNER
        top = near - 0.08 * size if down > 0 else DROP * size - near - high
    x0, x1 = (near, near + wide) if across > 0 else (-near - wide, -near)
    return x0, top, x1, top + high


#: The sides of discs that layouts speak of: how far across and down.
STEPS: Mapping[Side, tuple[int, int]] = {"right": (1, 0), "left": (-1, 0), "below": (0, 1), "above": (0, -1)}


def label_rect(point: Point, room: Point, side: Side) -> Rect:
    """What a label of this width and height covers on a side of the disc at a point, in units of a layout."""
    wide, high = UNIT * room[0], UNIT * room[1]
    x0, y0, x1, y1 = (each / UNIT for each in beside(*STEPS[side], UNIT * RADIUS, wide, high / (RISE + DROP)))
    return shifted((x0, y0, x1, y1), point)


def widened(rect: Rect, least: float) -> Rect:
    """A rectangle at least so wide, its middle where it was."""
    more = max(0.0, least - (rect[2] - rect[0])) / 2
    return rect[0] - more, rect[1], rect[2] + more, rect[3]


def label_rects(places: Sequence[Point], rooms: Sequence[Point], sides: Sequence[Side | None]) -> list[Rect | None]:
    """What the labels of neurons cover, None where one stands on its disc or nobody says on which side."""
    if not rooms:
        return [None] * len(places)
    return [
        label_rect(point, room, side) if side is not None and room[0] else None
        for point, room, side in zip(places, rooms, sides, strict=True)
    ]
