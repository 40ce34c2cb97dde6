"""Bundles: what a picture leaves out of its pathways, bands from group to group.

In: pathways of what is left out, where neurons, boxes and texts stand. Out: a Bundle for each: a band for what excites,
one beside it for what inhibits, as both added up would hide either. They lie above lines and beneath neurons, each as
wide as the root of its sum says. A band begins and ends at the hub of a group: its disc where it has one neuron, else
the middle of its neurons, with its name where no box says it. Hubs of groups that stand among each other are apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.geometry import Rect
from neurovis_spec.layout.model import Point
from neurovis_spec.scene import texts
from neurovis_spec.scene.geometry import samples
from neurovis_spec.scene.lines import Line, trimmed
from neurovis_spec.scene.model import Group, Shape, Spline, Text, Theme, ended
from neurovis_spec.scene.obstacles import Obstacles
from neurovis_spec.scene.pathways import Pathway, Strand
from neurovis_spec.scene.themes import mixed

#: How wide the widest band is, in page units, where there are few of them, and the narrowest; with more than so many
#: they get narrower.
_WIDEST, _NARROWEST, _CROWD = 11.0, 1.8, 8
#: More bundles than this are no help.
_MOST = 2500
#: How much of its colour there is in a band.
_SHARE = 0.5
#: Hubs are so far apart where their groups have room, as a share of the picture's shorter side and at least; how far
#: bands keep from the middle of one that stands among others, and at most from that of one whose rim is free; and from
#: a rim.
_APART, _LEAST_APART, _HUB, _MOST_RIM, _AIR = 0.22, 84.0, 9.0, 44.0, 2.0
#: Of the way between two hubs this is a band at least.
_BETWEEN = 0.6
#: What is nearer to the middle of a group than this share of its neurons, on either side, is not its rim.
_RIM = 0.1
#: How far a band bends to its right, as a share of its length; what bands beside each other keep between them.
_BEND, _BESIDE = 0.14, 1.5
#: How far a loop reaches from its hub, and how wide it opens.
_LOOP, _OPEN = 58.0, 0.55
#: Discs beside which gaps and heads of lines are as those of bands.
_USUAL = 20.0
#: What is said of a strand.
DOES: Final = {1: "excite", -1: "inhibit", 0: "neither"}
#: The name of a hub: its size, and how far from the hub it may stand.
_NAME, _FAR = 10.5, 60.0


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """What of a bundle does the same, as it is drawn."""

    strand: Strand
    line: Line
    width: float


@dataclass(frozen=True, slots=True, eq=False)
class Bundle:
    """What is left out of a pathway, as it is drawn."""

    pathway: Pathway
    bands: tuple[Band, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Bundles:
    """The bundles of a picture, the widest first, and the names of hubs."""

    all: tuple[Bundle, ...] = ()
    names: tuple[Text, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """What bundles lie on, in page units: centres (n, 2) and radii (n,) of discs; the groups that boxes have ``named``;
    what is in the way of names; what of the page the network has."""

    network: Network
    centres: FloatArray
    radii: FloatArray
    named: frozenset[str]
    obstacles: Obstacles
    picture: Rect


def bundled(left: Sequence[Pathway], ground: Ground, theme: Theme) -> Bundles:
    """The bundles of what is left out of some pathways. Takes room for them among the obstacles."""
    if not left:
        return Bundles()
    hubs, groups, obstacles = _hubs(left, ground), ground.network.neurons.groups, ground.obstacles
    wanted = ((groups[number], hub) for number, hub in hubs.items())
    names = [
        _name(f"{group.name} ×{group.count:,}", hub, obstacles, theme)
        for group, hub in wanted
        if group.count > 1 and group.name not in ground.named
    ]
    bundles = _drawn(left, hubs, ground.picture)
    for one in bundles:
        for band in one.bands:
            obstacles.add_line(samples([band.line.points], 24)[0], band.width / 2 + 1.5)
    return Bundles(tuple(bundles), tuple(name for name in names if name is not None))


def strongest(network: Network, left: Sequence[Pathway]) -> tuple[list[Pathway], tuple[str, ...]]:
    """The pathways that become bundles, the strongest first, of equal ones that with most connections; and what the
    picture says where these are not all."""
    order = sorted(left, key=lambda one: (-_finite(one.size), -one.count, one.name(network)))
    few = len(order) - _MOST
    said = f"of {few:,} of {len(order):,} pathways nothing is drawn, the weakest of all that is left out"
    return order[:_MOST], (said,) if few > 0 else ()


def largest(left: Sequence[Pathway]) -> float:
    """The largest sum of what does the same, which is the widest band."""
    return max((abs(_finite(strand.total)) for one in left for strand in one.strands), default=0.0)


@dataclass(frozen=True, slots=True)
class _Hub:
    """Where bands of a group begin and end: so far from a point, or, where no other neuron is there, and it is not too
    far away, at the rim of a rectangle around it."""

    centre: Point
    reach: float
    rect: Rect | None = None

    def rim(self, towards: Point) -> float:
        """How far it reaches in a direction, a unit vector."""
        if self.rect is None:
            return self.reach
        (x, y), (x0, y0, x1, y1) = self.centre, self.rect
        ways = [
            (high - at if way > 0 else at - low) / abs(way)
            for at, way, low, high in ((x, towards[0], x0, x1), (y, towards[1], y0, y1))
            if abs(way) > 1e-9
        ]
        return max(self.reach, min(*ways, _MOST_RIM) + _AIR)


def _hubs(left: Sequence[Pathway], ground: Ground) -> dict[int, _Hub]:
    """The hubs of all groups at which something begins or ends, by their numbers."""
    groups, centres, (x0, y0, x1, y1) = ground.network.neurons.groups, ground.centres, ground.picture
    found = {number for one in left for number in (one.source, one.target)}
    numbers = sorted(found, key=lambda number: groups[number].name)
    members = [np.asarray(groups[number].indices) for number in numbers]
    middles = np.array([centres[own].mean(axis=0) for own in members])
    low, high = (np.array([np.quantile(centres[own], rim, axis=0) for own in members]) for rim in (_RIM, 1 - _RIM))
    at = _apart(middles, low, high, max(_LEAST_APART, _APART * min(x1 - x0, y1 - y0)))
    hubs = {}
    for number, own, (x, y) in zip(numbers, members, at.tolist(), strict=True):
        if len(own) == 1:
            hubs[number] = _Hub((x, y), float(ground.radii[own[0]]))
        else:
            hubs[number] = _Hub((x, y), _HUB, _alone(own, ground))
    return hubs


def _alone(members: IntArray, ground: Ground) -> Rect | None:
    """The rectangle around some neurons; None where others stand in it."""
    discs = ground.radii[:, None]
    low, high = ((ground.centres + side * discs)[members] for side in (-1, 1))
    corner, opposite = low.min(axis=0), high.max(axis=0)
    within = ((ground.centres > corner) & (ground.centres < opposite)).all(axis=1)
    if int(within.sum()) > len(members):
        return None
    return float(corner[0]), float(corner[1]), float(opposite[0]), float(opposite[1])


def _apart(places: FloatArray, low: FloatArray, high: FloatArray, least: float) -> FloatArray:
    """Places that push each other off where they are closer than so, each in its own rectangle."""
    count = len(places)
    turn = 2.4 * np.arange(count)  # where two are in one place, each goes its own way
    places = places + 1e-3 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    for _ in range(60):
        away = places[:, None] - places[None]
        far = np.hypot(away[..., 0], away[..., 1]) + np.eye(count)
        push = np.clip(least - far, 0.0, None) * (1 - np.eye(count))
        places = places + 0.25 * (away / far[..., None] * push[..., None]).sum(axis=1)
        places = np.clip(places, low, high)
    return places


def _name(words: str, hub: _Hub, obstacles: Obstacles, theme: Theme) -> Text | None:
    """The name of a hub where it lies on no disc and no text, as near as can be; None where there is no such place."""
    wide = texts.width(words, _NAME, 600)
    for ring in range(int(_FAR / 6)):
        for step in range(max(1, 6 * ring)):
            angle = 2 * math.pi * step / max(1, 6 * ring)
            x, y = hub.centre[0] + 6 * ring * math.cos(angle), hub.centre[1] + 6 * ring * math.sin(angle)
            rect = (x - wide / 2, y - 0.55 * _NAME, x + wide / 2, y + 0.5 * _NAME)
            if not obstacles.disc_hits(rect) and not obstacles.text_hits(rect):
                obstacles.add_text(rect)
                point = (x, y + 0.36 * _NAME)
                return Text(point, words, _NAME, theme.muted, "middle", 600, halo=theme.background)
    return None


def _finite(total: float) -> float:
    return total if math.isfinite(total) else 0.0


def _drawn(left: Sequence[Pathway], hubs: Mapping[int, _Hub], picture: Rect) -> list[Bundle]:
    """The bundles, the widest first, so that none hides another."""
    widest, most = _WIDEST * min(1.0, (_CROWD / len(left)) ** 0.25), largest(left)
    routes: list[FloatArray] = []
    reaches: list[tuple[float, float]] = []
    widths: list[float] = []
    for one in left:
        own = [_width(strand, most, widest) for strand in one.strands]
        a, b = hubs[one.source], hubs[one.target]
        rims = _rims(a, b)
        aside = -(sum(own) + _BESIDE * (len(own) - 1)) / 2
        for place, width in enumerate(own):
            if one.source == one.target:
                routes.append(_loop(a, picture, 1.0 + 0.35 * place))
            else:
                routes.append(_arc(a, b, aside + width / 2))
            aside += width + _BESIDE
            reaches.append(rims)
        widths += own
    lines = iter(zip(trimmed(routes, np.array(reaches), _USUAL), widths, strict=True))
    result = [Bundle(one, tuple(Band(strand, *next(lines)) for strand in one.strands)) for one in left]
    return sorted(result, key=lambda one: -max(band.width for band in one.bands))


def _width(strand: Strand, most: float, widest: float) -> float:
    """As the root of the sum: a band that is twice as wide stands for four times as much."""
    share = abs(_finite(strand.total)) / most if most > 0 else 0.0
    return max(_NARROWEST, widest * math.sqrt(share))


def _rims(a: _Hub, b: _Hub) -> tuple[float, float]:
    """How far a band keeps from the middles of its hubs."""
    (ax, ay), (bx, by) = a.centre, b.centre
    far = math.hypot(bx - ax, by - ay)
    if far == 0:
        return a.reach, b.reach
    way = (bx - ax) / far, (by - ay) / far
    rims = a.rim(way), b.rim((-way[0], -way[1]))
    fewer = min(1.0, (1 - _BETWEEN) * far / sum(rims))
    return fewer * rims[0], fewer * rims[1]


def _arc(a: _Hub, b: _Hub, aside: float) -> FloatArray:
    """From hub to hub, bent to the right, and moved aside by so much."""
    start, end = np.array(a.centre), np.array(b.centre)
    along = end - start
    right = np.array([-along[1], along[0]])
    far = float(np.hypot(*along))
    off = right / far * aside if far > 0 else np.zeros(2)
    bend = _BEND * right
    return np.array([start + off, start + along / 3 + bend + off, start + along * 2 / 3 + bend + off, end + off])


def _loop(hub: _Hub, picture: Rect, larger: float) -> FloatArray:
    """Out of a hub and back to it, away from the middle of the picture, but within it."""
    (x0, y0, x1, y1), (x, y) = picture, hub.centre
    size, angle = larger * (_LOOP + hub.reach), math.atan2(y - (y0 + y1) / 2, x - (x0 + x1) / 2)
    turns = (angle - _OPEN, angle + _OPEN)
    inner = [(min(max(x + size * math.cos(t), x0), x1), min(max(y + size * math.sin(t), y0), y1)) for t in turns]
    return np.array([hub.centre, *inner, hub.centre])


def ink(theme: Theme, end: int) -> str:
    """The colour of bands that excite (1), inhibit (−1), or do neither (0), so pale that none is taken for a signal."""
    return mixed(theme.background, {1: theme.positive, -1: theme.negative, 0: theme.zero}[end], _SHARE)


def drawn(network: Network, bundle: Bundle, theme: Theme, step: int) -> Group:
    """A bundle as a group of a scene; its sums are those of a step."""
    one, shapes = bundle.pathway, list[Shape]()
    for band in bundle.bands:
        colour, end = ink(theme, band.strand.end), band.strand.end if theme.ends == "signs" else 1
        shapes += [Spline(band.line.points, colour, band.width), ended(band.line.end, band.width, colour, end)]
    name = one.name(network)
    data = {"class": "bundle", "pathway": name, "count": str(one.count), "sum": f"{one.total:.12g}"}
    data |= {DOES[strand.end]: f"{strand.total:.12g}" for strand in one.strands}
    data |= {"learns": ", ".join(one.rules)} if one.rules else {}
    return Group(tuple(shapes), f"bundle:{name}", data, _said(name, one, step))


def _said(name: str, one: Pathway, step: int) -> str:
    """What a pointer shows of a bundle."""
    when = f" at step {step:,}" if one.rules else ""
    strands = [
        f"{strand.count:,} {DOES[strand.end]}: Σ w = {texts.number(strand.total, 4)}{when}" for strand in one.strands
    ]
    low, high = one.delays
    delays = [] if high == low == 1 else [f"delay {low}" if low == high else f"delay {low} … {high}"]
    return "\n".join([f"{name.replace('->', '→')} · {one.count:,}", *strands, *one.rules, *delays])


class Told(NamedTuple):
    """What a legend says of bundles: what they do, in the order of strands; the largest sum of a band."""

    ends: tuple[int, ...]
    largest: float


def told(left: Sequence[Pathway]) -> Told | None:
    """What a legend says of the bundles of these pathways, None without any."""
    ends = {strand.end for one in left for strand in one.strands}
    return Told(tuple(end for end in DOES if end in ends), largest(left)) if left else None
