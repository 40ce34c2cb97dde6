"""Makes: which instances of modules are of one make, and so are drawn alike.

In: the instances of a network, and its neurons, edges, groups and layout settings in canonical order. Out:
LayoutModules. Two instances are of one make if they are of one module and everything within them that a picture shows
is equal: the names of the neurons in them, the connections among these with their delays, what is arranged or pinned.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from neurovis_spec.layout.model import Arrangement, LayoutEdge, LayoutGroup, LayoutModule, Point
from neurovis_spec.layout.naming import natural_key

_Members: TypeAlias = tuple[int, ...]


def modules_of(
    names: Sequence[str],
    modules: Sequence[tuple[str, str]],
    edges: Sequence[LayoutEdge],
    groups: Sequence[LayoutGroup],
    arrange: Sequence[tuple[_Members, Arrangement]],
    boxes: Sequence[tuple[str, _Members]],
    relative: Mapping[str, Mapping[str, Point]],
    origins: Mapping[str, Point],
) -> tuple[LayoutModule, ...]:
    """The instances in the natural order of their paths, each with its neurons and its make."""
    ordered = sorted(modules, key=lambda item: natural_key(item[0]))
    place = {path: number for number, (path, _) in enumerate(ordered)}
    ways = [_around(name, place) for name in names]
    members: list[list[int]] = [[] for _ in ordered]
    for neuron, way in enumerate(ways):
        for around in way:
            members[around].append(neuron)
    inside: list[list[object]] = [[] for _ in ordered]

    def note(ends: Sequence[int], what: object) -> None:
        if not ends:
            return
        shared = set(ways[ends[0]]).intersection(*(ways[end] for end in ends[1:]))
        for around in shared:
            start = len(ordered[around][0]) + 1
            inside[around].append((what, tuple(names[end][start:] for end in ends)))

    for edge in edges:
        note((edge.source, edge.target), ("edge", edge.delay))
    for group in groups:
        note(group.members, "group")
    for ends, how in arrange:
        note(ends, how)
    for _, ends in boxes:
        note(ends, "box")
    known: dict[object, str] = {}
    numbers: dict[str, int] = {}
    result: list[LayoutModule] = []
    for number, (path, module) in enumerate(ordered):
        start, pins = len(path) + 1, relative.get(path, {})
        own = {index: pins[names[index]] for index in members[number] if names[index] in pins}
        make = (
            module,
            tuple(names[index][start:] for index in members[number]),
            tuple(inside[number]),
            tuple((names[index][start:], point) for index, point in own.items()),
        )
        if make not in known:
            numbers[module] = numbers.get(module, 0) + 1
            known[make] = module if numbers[module] == 1 else f"{module} ({numbers[module]})"
        parent = place.get(path.rpartition(".")[0], -1)
        result.append(LayoutModule(path, module, parent, tuple(members[number]), known[make], own, origins.get(path)))
    return tuple(result)


def _around(name: str, place: Mapping[str, int]) -> tuple[int, ...]:
    """The instances that a neuron is in, the outermost first."""
    found: list[int] = []
    end = name.find(".")
    while end >= 0:
        if name[:end] in place:
            found.append(place[name[:end]])
        end = name.find(".", end + 1)
    return tuple(found)
