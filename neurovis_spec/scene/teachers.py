"""Who teaches whom: the signals of plasticity rules, as quiet dotted lines.

In: a network's rules and where its neurons are. Out: a dotted spline from each neuron that is a signal of a rule to
the neuron whose connections learn by it; where there are many of a signal from one group to another, one from hub to
hub for all of these. Signals that come from inputs alone have no neuron to start from.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.geometry import Rect
from neurovis_spec.scene.collapse import Gathered
from neurovis_spec.scene.geometry import sample
from neurovis_spec.scene.hubs import Hub, hubs_of
from neurovis_spec.scene.lines import Line, trimmed
from neurovis_spec.scene.obstacles import Obstacles

#: Of more pairs than this of a signal from one group to another there is one dotted line; where there would be more
#: lines than can be quiet, one of each.
_MANY, _MOST = 12, 200
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


@dataclass(frozen=True, slots=True)
class Guide:
    """A dotted line: of a pair, or of all ``count`` pairs of a signal of a rule from one group to another: of which the
    first one, and the neurons at either end, ascending."""

    first: Teacher
    sources: tuple[int, ...]
    targets: tuple[int, ...]
    count: int = 1

    @property
    def ends(self) -> tuple[int, ...]:
        """All neurons at its ends."""
        return (*self.sources, *self.targets)


def guides_of(network: Network, teachers: Sequence[Teacher]) -> tuple[list[Guide], tuple[str, ...]]:
    """The dotted lines of pairs, in the order of these; and what the picture says where there are too many."""
    group = [group.name for group in network.neurons.groups for _ in group.indices]
    alike: dict[tuple[str, ...], list[Teacher]] = {}
    for one in teachers:
        alike.setdefault((one.rule, one.signal, one.state, group[one.source], group[one.target]), []).append(one)
    few = sum(len(pairs) if len(pairs) <= _MANY else 1 for pairs in alike.values())
    most = _MANY if few <= _MOST else 1
    guides = [guide for pairs in alike.values() for guide in (_each(pairs) if len(pairs) <= most else [_all(pairs)])]
    place = {one: number for number, one in enumerate(teachers)}
    if len(guides) <= _MOST:
        return sorted(guides, key=lambda guide: place[guide.first]), ()
    names = network.neurons.names
    ordered = sorted(guides, key=lambda one: (-one.count, names[one.first.source], names[one.first.target]))[:_MOST]
    said = f"{len(guides) - _MOST:,} of {len(guides):,} dotted lines of rules are left out"
    return sorted(ordered, key=lambda guide: place[guide.first]), (said,)


def _each(pairs: Sequence[Teacher]) -> list[Guide]:
    """A dotted line for each."""
    return [Guide(one, (one.source,), (one.target,)) for one in pairs]


def _all(pairs: Sequence[Teacher]) -> Guide:
    """One for all."""
    sources, targets = {one.source for one in pairs}, {one.target for one in pairs}
    return Guide(pairs[0], tuple(sorted(sources)), tuple(sorted(targets)), len(pairs))


def hubs_between(
    guides: Sequence[Guide], centres: FloatArray, radii: FloatArray, radius: float, picture: Rect
) -> list[tuple[Hub, Hub]]:
    """Where dotted lines begin and end: at the discs of pairs, of which each has a ``radius``, else at hubs."""
    ends = [end for guide in guides for end in (guide.sources, guide.targets)]
    several = iter(hubs_of([np.array(end) for end in ends if len(end) > 1], centres, radii, picture))
    each = [next(several) if len(end) > 1 else Hub(tuple(centres[end[0]].tolist()), radius) for end in ends]
    return list(zip(each[::2], each[1::2], strict=True))


def room_of(guide: Guide, frames: Iterable[tuple[Collection[int], Rect]], picture: Rect) -> Rect:
    """Where a dotted line may run: in the smallest frame that holds all neurons at its ends, else in the picture."""
    around = [rect for members, rect in frames if set(guide.ends) <= set(members)]
    return min(around, key=lambda rect: (rect[2] - rect[0]) * (rect[3] - rect[1]), default=picture)


def dotted(
    guides: Sequence[Guide],
    images: Mapping[int, int],
    hubs: Sequence[tuple[Hub, Hub]],
    radius: float,
    obstacles: Obstacles,
    rooms: Sequence[Rect],
) -> list[Line]:
    """The dotted lines between ``hubs``, as between discs of a ``radius``: straight, or bent where they would run over
    a disc or along other lines, but never out of their ``rooms``; between mirror ``images`` mirrored, by what both
    would run over."""
    number = {(guide.sources, guide.targets): i for i, guide in enumerate(guides)}
    sides: list[Mapping[int, int]] = []  # of each guide that is drawn by itself those that are, and to which side
    done: set[int] = set()
    for i, guide in enumerate(guides):
        if i in done:
            continue
        mirrored = (tuple(sorted(images.get(one, -1) for one in some)) for some in (guide.sources, guide.targets))
        image = number.get((next(mirrored), next(mirrored)), i)
        sides.append({image: -1, i: 1})
        done |= {image, i}
    lines = iter(
        _lines([(hubs[k], side * bend) for own in sides for bend in _BENDS for k, side in own.items()], radius)
    )
    found: dict[int, Line] = {}
    for own in sides:
        tried = [(bend, {k: next(lines) for k in own}) for bend in _BENDS]
        costs = [_cost(bend, some, guides, hubs, obstacles, rooms) for bend, some in tried]
        found |= tried[costs.index(min(costs))][1]
    return [found[i] for i in range(len(guides))]


def _cost(
    bend: float,
    lines: Mapping[int, Line],
    guides: Sequence[Guide],
    hubs: Sequence[tuple[Hub, Hub]],
    obstacles: Obstacles,
    rooms: Sequence[Rect],
) -> float:
    """What these dotted lines with this bend would run over."""
    cost = 4 * abs(bend)
    for k, line in lines.items():
        dots = sample(line.points, max(8, int(math.dist(hubs[k][0].centre, hubs[k][1].centre) / 6)))
        out = bend and not _within(dots, rooms[k])
        cost += math.inf if out else obstacles.path_hits(dots[2:-2], guides[k].ends)
    return cost


def _lines(wanted: Sequence[tuple[tuple[Hub, Hub], float]], radius: float) -> list[Line]:
    """The dotted lines from hub to hub, each with a bend."""
    routes, rims = list[FloatArray](), list[tuple[float, float]]()
    for (one, other), bend in wanted:
        start, end = np.array(one.centre), np.array(other.centre)
        along, far = end - start, math.dist(one.centre, other.centre)
        x, y = (along / far).tolist() if far > 0 else (1.0, 0.0)
        rims.append((one.rim((x, y)), other.rim((-x, -y))))
        routes.append(_bent(start, end, bend))
    return trimmed(routes, np.array(rims).reshape(-1, 2), radius, air=1.0)


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
