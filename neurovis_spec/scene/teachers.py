"""Who teaches whom: the signals of plasticity rules, as quiet dotted lines.

In: a network's rules and where its neurons are. Out: a dotted spline from each neuron that is a signal of a rule to
the neuron whose connections learn by it. Signals that come from inputs alone have no neuron to start from.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.geometry import Rect
from neurovis_spec.scene.collapse import Gathered
from neurovis_spec.scene.geometry import sample
from neurovis_spec.scene.lines import Line, trimmed
from neurovis_spec.scene.obstacles import Obstacles

_BENDS = (0.0, *(side * bend for bend in (0.09, 0.18, 0.27, 0.36, 0.48, 0.6) for side in (1, -1)))


@dataclass(frozen=True, slots=True)
class Teacher:
    """``source`` is the ``signal`` of the rule by which connections to ``target`` learn (neuron indices), or its
    ``state`` or output of this name is."""

    source: int
    target: int
    signal: str
    rule: str
    state: str = ""


def teachers_of(network: Network) -> list[Teacher]:
    """Every pair once, in the order of the rules; none from a neuron to itself."""
    found: dict[tuple[int, int], Teacher] = {}
    neurons, states = network.neuron_of.tolist(), [""] * len(network.neurons)
    for outlet in network.outlets:
        states += [outlet.name] * len(network.populations[outlet.population].members)
    for projection in network.projections:
        for signal, sources in projection.signals.items():
            for source, target in zip(sources.tolist(), network.connections.targets[projection.members], strict=True):
                if source < len(neurons) and neurons[source] != target:
                    pair = (neurons[source], int(target))
                    rule = projection.rule.definition.name
                    found.setdefault(pair, Teacher(*pair, signal, rule, states[source]))
    return list(found.values())


def drawn_teachers(drawn: Gathered) -> list[Teacher]:
    """The pairs of the whole of which both neurons are drawn, and in no glyph, by their indices in what is drawn."""
    pairs = ((one, int(drawn.unit[one.source]), int(drawn.unit[one.target])) for one in teachers_of(drawn.whole))
    glyph = drawn.glyph
    return [replace(one, source=a, target=b) for one, a, b in pairs if not glyph[a] and not glyph[b]]


def fewer(network: Network, teachers: Sequence[Teacher], most: int) -> list[Teacher]:
    """So many of the pairs, in the same order: in turn one of each signal of each rule from one group to another, by
    the names of the neurons, so that each of these keeps as many as any."""
    names, group = network.neurons.names, [group.name for group in network.neurons.groups for _ in group.indices]
    turns: Counter[tuple[object, ...]] = Counter()
    ranked: list[tuple[int, str, str, int]] = []
    for source, target, place in sorted((names[one.source], names[one.target], k) for k, one in enumerate(teachers)):
        one = teachers[place]
        sort = one.rule, one.signal, group[one.source], group[one.target]
        ranked.append((turns[sort], source, target, place))
        turns[sort] += 1
    return [teachers[place] for place in sorted(place for *_, place in sorted(ranked)[:most])]


def room_of(teacher: Teacher, frames: Iterable[tuple[Collection[int], Rect]], picture: Rect) -> Rect:
    """Where the dotted line of a pair may run: in the smallest frame that holds both neurons, else in the picture."""
    around = [rect for members, rect in frames if teacher.source in members and teacher.target in members]
    return min(around, key=lambda rect: (rect[2] - rect[0]) * (rect[3] - rect[1]), default=picture)


def dotted(
    teachers: Sequence[Teacher],
    images: Mapping[int, int],
    centres: FloatArray,
    radius: float,
    obstacles: Obstacles,
    rooms: Sequence[Rect],
) -> list[Line]:
    """The dotted lines of pairs, between discs of a ``radius``: straight, or bent where they would run over a disc or
    along other lines, but never out of their ``rooms``; between mirror ``images`` mirrored, by what both would run
    over."""
    number = {(teacher.source, teacher.target): i for i, teacher in enumerate(teachers)}
    found: dict[int, Line] = {}
    for i, teacher in enumerate(teachers):
        if i in found:
            continue
        image = number.get((images.get(teacher.source, -1), images.get(teacher.target, -1)), i)
        best: tuple[float, dict[int, Line]] | None = None
        for bend in _BENDS:
            cost, lines = 4 * abs(bend), dict[int, Line]()
            for k, side in {image: -1, i: 1}.items():
                ends = (teachers[k].source, teachers[k].target)
                start, end = centres[ends[0]], centres[ends[1]]
                (lines[k],) = trimmed([_bent(start, end, side * bend)], radius, radius, air=1.0)
                dots = sample(lines[k].points, max(8, int(math.dist(start, end) / 6)))
                out = bend and not _within(dots, rooms[k])
                cost += math.inf if out else obstacles.path_hits(dots[2:-2], ends)
            if best is None or cost < best[0]:
                best = (cost, lines)
        found |= best[1] if best is not None else {}
    return [found[i] for i in range(len(teachers))]


def _within(dots: FloatArray, room: Rect) -> bool:
    low, high = dots.min(axis=0), dots.max(axis=0)
    return bool(low[0] >= room[0] and low[1] >= room[1] and high[0] <= room[2] and high[1] <= room[3])


def _bent(start: FloatArray, end: FloatArray, bend: float) -> FloatArray:
    along = end - start
    aside = np.array([along[1], -along[0]]) * bend
    return np.array([start, start + along / 3 + aside, start + along * 2 / 3 + aside, end])


def dash(width: float) -> tuple[float, float]:
    """Round dots, three widths apart."""
    return 0.01, 3.2 * width


def label_of(teachers: Sequence[Teacher]) -> str:
    """What the legend says of them: ``target of delta``, or the signals alone where they are several.

    >>> label_of([Teacher(0, 1, "reward", "walk"), Teacher(2, 1, "policy", "walk")])
    'policy, reward'
    """
    told = {f"{teacher.signal} of {teacher.rule}" for teacher in teachers}
    if len(told) == 1:
        return told.pop()
    signals = sorted({teacher.signal for teacher in teachers})
    return ", ".join(signals) if len(signals) <= 3 else f"{len(signals)} signals of rules"
