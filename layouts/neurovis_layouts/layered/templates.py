"""Templates: which instances of a problem are drawn alike, and the problem of drawing each kind once.

In: a LayoutProblem. Out: for every kind of instance one problem of its own, in which the connections, hints, mirrors
and lines of all instances of that kind are joined, so that one drawing serves them all. Instances of one template are
of one kind, and so are two that are mirror images of each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import TypeAlias

import networkx as nx

from neurovis_layouts.routing.ends import Key, keys_of
from neurovis_spec.layout.labels import instance_titles
from neurovis_spec.layout.model import (
    LayoutCell,
    LayoutEdge,
    LayoutGroup,
    LayoutMirror,
    LayoutModule,
    LayoutProblem,
    LayoutRefusalError,
)

_Pairs: TypeAlias = list[tuple[int, int]]
_Lines: TypeAlias = list[tuple[int, ...]]


class Book:
    """Kinds of instances by number, and the problem that each is."""

    def __init__(self, problem: LayoutProblem) -> None:
        """Raises LayoutRefusalError where a mirror pairs what cannot be mirror images."""
        self._problem = problem
        modules = problem.modules
        self._around: list[list[int]] = [[] for _ in problem.neurons]
        for number, module in enumerate(modules):
            for member in module.members:
                self._around[member].append(number)
        self._kinds = nx.utils.UnionFind(range(len(modules)))
        self._number = {module.path: number for number, module in enumerate(modules)}
        first: dict[str, int] = {}
        for number, module in enumerate(modules):
            self._kinds.union(first.setdefault(module.template, number), number)
        self._pairs: dict[int, _Pairs] = {}
        self._lines: dict[int, _Lines] = {}
        for mirror in problem.mirrors:
            for a, b in mirror.pairs:
                self._mirror(mirror.scope, a, b)
        for line in problem.align:
            self._align(-1, line)
        self._join_inner()
        #: of each kind, which is known by its first instance, all
        self._copies = {min(copies): sorted(copies) for copies in self._kinds.to_sets()}
        self._kind = {number: kind for kind, copies in self._copies.items() for number in copies}
        self.problem_of = cache(self._of)

    def _join_inner(self) -> None:
        """Instances at one place of instances of one kind are of one kind; outer ones come first."""
        first: dict[tuple[int, str], int] = {}
        modules = self._problem.modules
        for number in sorted(range(len(modules)), key=lambda n: (modules[n].path.count("."), n)):
            module = modules[number]
            if module.parent >= 0:
                place = self._kinds[module.parent], module.path.rpartition(".")[2]
                self._kinds.union(first.setdefault(place, number), number)

    def _inside(self, scope: int, neuron: int) -> int:
        """The instance right below ``scope`` that a neuron is in, −1 without one."""
        chain = self._around[neuron]
        place = chain.index(scope) + 1 if scope >= 0 else 0
        return chain[place] if place < len(chain) else -1

    def _mirror(self, scope: int, a: int, b: int) -> None:
        one, other = self._inside(scope, a), self._inside(scope, b)
        if one == other and one >= 0:
            self._mirror(one, a, b)
            return
        if one >= 0 or other >= 0:
            modules, names = self._problem.modules, self._problem.neurons
            fits = one >= 0 and other >= 0 and len(modules[one].members) == len(modules[other].members)
            if not fits or modules[one].members.index(a) != modules[other].members.index(b):
                raise LayoutRefusalError(
                    "mirror-frames",
                    f"'{names[a]}' and '{names[b]}' cannot be mirror images: they do not stand in the same place of "
                    "instances of equal make",
                    "mirror the instances, or neurons outside of all instances",
                    (names[a], names[b]),
                )
            self._kinds.union(one, other)
        self._pairs.setdefault(scope, []).append((a, b))

    def _align(self, scope: int, line: Sequence[int]) -> None:
        self._lines.setdefault(scope, []).append(tuple(line))
        within: dict[int, list[int]] = {}
        for member in line:
            within.setdefault(self._inside(scope, member), []).append(member)
        for number, members in within.items():
            if number >= 0 and len(members) > 1:
                self._align(number, members)

    def whole(self) -> LayoutProblem:
        """The problem itself, modules named by their kinds, mirrors and lines those that concern it directly."""
        problem = self._problem
        return replace(
            problem,
            modules=tuple(replace(m, template=str(self._kind[i])) for i, m in enumerate(problem.modules)),
            mirrors=_mirror(self._pairs.get(-1, [])),
            align=tuple(self._lines.get(-1, [])),
            plan=tuple(cell for cell in problem.plan if cell.scope < 0),
        )

    def _of(self, kind: int) -> LayoutProblem:
        """The problem of drawing one instance of this kind alone, its neurons numbered from 0."""
        copies = self._copies[kind]
        modules = self._problem.modules
        pairs: set[tuple[int, int]] = set()
        lines: set[tuple[int, ...]] = set()
        cells: set[LayoutCell] = set()
        pins: dict[int, tuple[float, float]] = {}
        for number in copies:
            place = {n: i for i, n in enumerate(modules[number].members)}
            pairs.update((place[a], place[b]) for a, b in self._pairs.get(number, ()))
            lines.update(tuple(place[n] for n in line) for line in self._lines.get(number, ()))
            cells.update(
                replace(cell, members=tuple(sorted(place[n] for n in cell.members)), scope=-1)
                for cell in self._problem.plan
                if cell.scope == number
            )
            for neuron, point in modules[number].pins.items():
                pins.setdefault(place[neuron], point)
        part = restricted(self._problem, [modules[number].members for number in copies], f"{modules[copies[0]].path}.")
        titles = instance_titles((module.path, module.module) for module in modules)
        return replace(
            part,
            modules=tuple(replace(m, template=str(self._kind[self._number[m.path]])) for m in part.modules),
            mirrors=_mirror(sorted(pairs)),
            align=tuple(sorted(lines)),
            plan=tuple(sorted(cells, key=lambda cell: cell.members)),
            pins=dict(sorted(pins.items())),
            title=max(titles[number] for number in copies),
        )


def _mirror(pairs: Sequence[tuple[int, int]]) -> tuple[LayoutMirror, ...]:
    return (LayoutMirror(-1, tuple(sorted(set(pairs)))),) if pairs else ()


def restricted(problem: LayoutProblem, copies: Sequence[Sequence[int]], within: str = "") -> LayoutProblem:
    """The problem of the neurons of one of these ``copies`` alone, counted from 0 in the order given, without pins,
    mirrors and lines: connected as they are in any copy, and entered and left where any is.

    ``within`` is how the paths of the instances in it begin, which may hold as many neurons as what is around them.
    """
    members = copies[0]
    place = {neuron: i for i, neuron in enumerate(members)}
    edges, entries, exits = _connected(problem, copies)

    def inside(neurons: Sequence[int]) -> tuple[int, ...]:
        return tuple(place[n] for n in neurons if n in place)

    groups = tuple(LayoutGroup(g.name, found) for g in problem.groups if (found := inside(g.members)))
    arrange = tuple((found, how) for of, how in problem.arrange if len(found := inside(of)) == len(of))
    boxes = tuple((name, found) for name, of in problem.boxes if len(found := inside(of)) == len(of) < len(members))
    return LayoutProblem(
        problem.network,
        tuple(problem.neurons[n] for n in members),
        groups,
        edges,
        direction=problem.direction,
        arrange=arrange,
        boxes=boxes,
        neuron_spacing=problem.neuron_spacing,
        rank_spacing=problem.rank_spacing,
        entries=tuple(sorted(entries - exits)),
        exits=tuple(sorted(exits - entries)),
        inward=tuple(sorted(entries)),
        outward=tuple(sorted(exits)),
        modules=_instances(problem, place, within),
        effort=problem.effort,
        labels=tuple(problem.labels[n] for n in members) if problem.labels else (),
    )


def _connected(
    problem: LayoutProblem, copies: Sequence[Sequence[int]]
) -> tuple[tuple[LayoutEdge, ...], set[int], set[int]]:
    """What connects neurons of a copy, by their places in it, with the delay in the first copy that has it; and who is
    entered from outside of a copy, and left to there, in any."""
    where = {neuron: (number, i) for number, own in enumerate(copies) for i, neuron in enumerate(own)}
    edges: dict[Key, LayoutEdge] = {}
    entries = {where[n][1] for n in problem.entries if n in where}
    exits = {where[n][1] for n in problem.exits if n in where}
    for edge, (a, b, times) in zip(problem.edges, keys_of(problem.edges), strict=True):
        source, target = where.get(a), where.get(b)
        if source and target and source[0] == target[0]:
            edges.setdefault((source[1], target[1], times), edge)
            continue
        if source:
            exits.add(source[1])
        if target:
            entries.add(target[1])
    found = tuple(replace(edges[key], name=f"{key}", source=key[0], target=key[1]) for key in sorted(edges))
    return found, entries, exits


def _instances(problem: LayoutProblem, place: Mapping[int, int], within: str) -> tuple[LayoutModule, ...]:
    """The instances whose paths begin so, all of whose neurons have a ``place``, by these."""
    kept = [
        i
        for i, module in enumerate(problem.modules)
        if module.members and module.path.startswith(within) and all(n in place for n in module.members)
    ]
    number = {old: new for new, old in enumerate(kept)}
    return tuple(
        replace(
            module,
            parent=number.get(module.parent, -1),
            members=tuple(place[n] for n in module.members),
            pins={place[n]: point for n, point in module.pins.items()},
            origin=None,
        )
        for module in (problem.modules[i] for i in kept)
    )
