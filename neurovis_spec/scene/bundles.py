"""Bundles: what a picture leaves out of its pathways, bands from group to group.

In: pathways of what is left out, where neurons, boxes and texts stand. Out: a Bundle for each: a band for what excites,
one beside it for what inhibits, as both added up would hide either. They lie above lines and beneath neurons, each as
wide as the root of its sum says. A band begins and ends at the hub of a group, beside its name where no box says it.
What is left out between two neurons is as thin as lines, and lies beneath these.
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
from neurovis_spec.scene import texts
from neurovis_spec.scene.ends import EndArray
from neurovis_spec.scene.geometry import samples
from neurovis_spec.scene.hubs import Hub, hubs_of
from neurovis_spec.scene.lesions import FAINT
from neurovis_spec.scene.lines import Line, trimmed
from neurovis_spec.scene.model import Group, Shape, Spline, Text, Theme, ended
from neurovis_spec.scene.obstacles import Obstacles
from neurovis_spec.scene.pathways import Pathway, Strand
from neurovis_spec.scene.themes import mixed

#: How wide the widest band is, in page units, where there are few of them, and the narrowest; with more than so many
#: they get narrower.
_WIDEST, _NARROWEST, _CROWD = 11.0, 1.8, 8
#: More bundles than this are no help.
_MOST = 5000
#: How much of its colour there is in a band, and in one between two neurons; how wide that is.
_SHARE, _LONE_SHARE, _THIN = 0.5, 0.3, 0.7
#: Of the way between two hubs this is a band at least.
_BETWEEN = 0.6
#: How far a band bends to its right, as a share of its length; what bands beside each other keep between them.
_BEND, _BESIDE = 0.14, 1.5
#: How far a loop reaches from its hub, and how wide it opens.
_LOOP, _OPEN = 58.0, 0.55
#: No band gets wider in a film than so many times the widest at its beginning.
_MOST_GROWN = 2.0
#: Discs beside which gaps and heads of lines are as those of bands.
_USUAL = 20.0
#: What a strand does, as data.
_DOES: Final = {1: "excite", -1: "inhibit", 0: "neither"}
#: The same in words.
SAID: Final = {1: "excite", -1: "inhibit", 0: "neither excite nor inhibit"}
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
    """What is left out of a pathway, as it is drawn. Where it is ``lone``, a connection between two neurons, nothing is
    added up, and it is thin and pale, beneath the lines."""

    pathway: Pathway
    bands: tuple[Band, ...]
    lone: bool


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
    bundles = _drawn(left, hubs, ground)
    bands = [band for one in bundles for band in one.bands]
    dots = samples([band.line.points for band in bands], 24)
    obstacles.add_line(
        np.concatenate(dots), np.repeat([band.width / 2 + 1.5 for band in bands], [len(one) for one in dots])
    )
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


def _hubs(left: Sequence[Pathway], ground: Ground) -> dict[int, Hub]:
    """The hubs of all groups at which something begins or ends, by their numbers."""
    groups = ground.network.neurons.groups
    found = {number for one in left for number in (one.source, one.target)}
    numbers = sorted(found, key=lambda number: groups[number].name)
    members = [np.asarray(groups[number].indices) for number in numbers]
    return dict(zip(numbers, hubs_of(members, ground.centres, ground.radii, ground.picture), strict=True))


def _name(words: str, hub: Hub, obstacles: Obstacles, theme: Theme) -> Text | None:
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


def _drawn(left: Sequence[Pathway], hubs: Mapping[int, Hub], ground: Ground) -> list[Bundle]:
    """The bundles, the widest first, so that none hides another."""
    lone = [is_lone(ground.network, one) for one in left]
    widths_of, result = widths(left, lone.count(False)), list[Bundle]()
    for alone, usual in ((False, _USUAL), (True, float(ground.radii.min(initial=_USUAL)))):
        some = [one for one, by_itself in zip(left, lone, strict=True) if by_itself is alone]
        wide = [[_THIN if alone else widths_of.at(strand.total) for strand in one.strands] for one in some]
        routes = [
            _routes(hubs[one.source], hubs[one.target], own, 0.0 if alone else _BEND, ground.picture)
            for one, own in zip(some, wide, strict=True)
        ]
        rims = [_rims(hubs[one.source], hubs[one.target]) for one in some for _ in one.strands]
        lines = iter(trimmed([route for own in routes for route in own], np.array(rims).reshape(-1, 2), usual))
        for one, own in zip(some, wide, strict=True):
            bands = tuple(Band(strand, next(lines), width) for strand, width in zip(one.strands, own, strict=True))
            result.append(Bundle(one, bands, alone))
    return sorted(result, key=lambda one: -max(band.width for band in one.bands))


def is_lone(network: Network, one: Pathway) -> bool:
    """Whether a pathway is that of one neuron to another, of which nothing is added up."""
    groups = network.neurons.groups
    single = groups[one.source].count == groups[one.target].count == 1
    return single and one.count == len(one.members) == 1


def _routes(a: Hub, b: Hub, widths: Sequence[float], bend: float, picture: Rect) -> list[FloatArray]:
    """How bands of these widths run from hub to hub, beside each other."""
    if a is b:
        return [_loop(a, picture, 1.0 + 0.35 * place) for place in range(len(widths))]
    aside, result = -(sum(widths) + _BESIDE * (len(widths) - 1)) / 2, list[FloatArray]()
    for width in widths:
        result.append(_arc(a, b, bend, aside + width / 2))
        aside += width + _BESIDE
    return result


class Widths(NamedTuple):
    """How wide bands are: as the roots of their sums, so that one that is twice as wide stands for four times as
    much; that of the sum ``most`` is the ``widest``."""

    widest: float
    narrowest: float
    most: float

    def at(self, total: float) -> float:
        """The width of a band with this sum."""
        share = abs(_finite(total)) / self.most if self.most > 0 else 0.0
        return max(self.narrowest, self.widest * math.sqrt(share))


def widths(left: Sequence[Pathway], bundles: int) -> Widths:
    """How wide the bands of these pathways are, of which so many are bundles."""
    return Widths(_WIDEST * min(1.0, (_CROWD / max(bundles, 1)) ** 0.25), _NARROWEST, largest(left))


def _rims(a: Hub, b: Hub) -> tuple[float, float]:
    """How far a band keeps from the middles of its hubs."""
    (ax, ay), (bx, by) = a.centre, b.centre
    far = math.hypot(bx - ax, by - ay)
    if far == 0:
        return a.reach, b.reach
    way = (bx - ax) / far, (by - ay) / far
    rims = a.rim(way), b.rim((-way[0], -way[1]))
    fewer = min(1.0, (1 - _BETWEEN) * far / sum(rims))
    return fewer * rims[0], fewer * rims[1]


def _arc(a: Hub, b: Hub, bend: float, aside: float) -> FloatArray:
    """From hub to hub, bent to the right by a share of its length, and moved aside by so much."""
    start, end = np.array(a.centre), np.array(b.centre)
    along = end - start
    right = np.array([-along[1], along[0]])
    far = float(np.hypot(*along))
    off = right / far * aside if far > 0 else np.zeros(2)
    off = off + bend * right * np.array([[0.0], [1.0], [1.0], [0.0]])
    result: FloatArray = np.stack([start, start + along / 3, start + along * 2 / 3, end]) + off
    return result


def _loop(hub: Hub, picture: Rect, larger: float) -> FloatArray:
    """Out of a hub and back to it, away from the middle of the picture, but within it."""
    (x0, y0, x1, y1), (x, y) = picture, hub.centre
    size, angle = larger * (_LOOP + hub.reach), math.atan2(y - (y0 + y1) / 2, x - (x0 + x1) / 2)
    turns = (angle - _OPEN, angle + _OPEN)
    inner = [(min(max(x + size * math.cos(t), x0), x1), min(max(y + size * math.sin(t), y0), y1)) for t in turns]
    return np.array([hub.centre, *inner, hub.centre])


def ink(theme: Theme, end: int, lone: bool = False) -> str:
    """The colour of bands that excite (1), inhibit (−1), or do neither (0), so pale that none is taken for a signal."""
    colour = {1: theme.positive, -1: theme.negative, 0: theme.zero}[end]
    return mixed(theme.background, colour, _LONE_SHARE if lone else _SHARE)


def drawn(network: Network, bundle: Bundle, theme: Theme, step: int, gone: frozenset[int]) -> Group:
    """A bundle as a group of a scene; its sums are those of a step, by which the connections ``gone`` are lesioned: it
    is faint where that are all of it."""
    one, shapes = bundle.pathway, list[Shape]()
    for band in bundle.bands:
        colour, end = ink(theme, band.strand.end, bundle.lone), band.strand.end if theme.ends == "signs" else 1
        shapes += [Spline(band.line.points, colour, band.width), ended(band.line.end, band.width, colour, end)]
    name = one.name(network)
    data = {"class": "bundle", "pathway": name, "count": str(one.count), "sum": f"{one.total:.12g}"}
    data |= {_DOES[strand.end]: f"{strand.total:.12g}" for strand in one.strands}
    data |= {"learns": ", ".join(one.rules)} if one.rules else {}
    lost = len(gone.intersection(one.members.tolist()))
    data |= {"lesioned": str(lost)} if lost else {}
    opacity = FAINT if lost == len(one.members) else 1.0
    return Group(tuple(shapes), id_of(one, network), data, _said(name, one, step, lost), opacity)


def id_of(one: Pathway, network: Network) -> str:
    """The id of the group of a bundle."""
    return f"bundle:{one.name(network)}"


def _said(name: str, one: Pathway, step: int, lost: int) -> str:
    """What a pointer shows of a bundle."""
    when = f" at step {step:,}" if one.rules else ""
    strands = [
        f"{strand.count:,} {SAID[strand.end]}: Σ w = {texts.number(strand.total, 4)}{when}" for strand in one.strands
    ]
    low, high = one.delays
    delays = [] if high == low == 1 else [f"delay {low}" if low == high else f"delay {low} … {high}"]
    lesioned = [f"{lost:,} of them lesioned"] if lost else []
    return "\n".join([f"{name.replace('->', '→')} · {one.count:,}", *strands, *lesioned, *one.rules, *delays])


@dataclass(frozen=True, slots=True, eq=False)
class Following:
    """Bands whose width follows their sum: the id of the group of each, which of its shapes it is, which connections
    its bundle has, and how they end that are added up in it."""

    names: tuple[tuple[str, int], ...]
    members: tuple[IntArray, ...]
    ends: tuple[int, ...]
    widths: Widths

    def at(self, weights: FloatArray, ends: EndArray) -> list[float]:
        """How wide each is where the weights of all connections, and how these end, are so (m,)."""
        result = []
        for members, end in zip(self.members, self.ends, strict=True):
            with np.errstate(over="ignore", invalid="ignore"):
                total = float(weights[members[ends[members] == end]].sum())
            result.append(min(self.widths.at(total), _MOST_GROWN * self.widths.widest))
        return result


def following(network: Network, left: Mapping[str, Pathway], changing: IntArray, unit: float) -> Following:
    """The bands of which some weights may change, those of the connections ``changing``; ``left`` are the pathways of
    bundles by the ids of their groups, a page unit is so many user units."""
    joined = {name: one for name, one in left.items() if not is_lone(network, one)}
    widest, narrowest, most = widths(list(left.values()), len(joined))
    may = np.zeros(len(network.connections), np.bool_)
    may[changing] = True
    found = [
        ((name, 2 * place), one.members, strand.end)
        for name, one in joined.items()
        if may[one.members].any()
        for place, strand in enumerate(one.strands)
    ]
    names, members, ends = tuple(zip(*found, strict=True)) if found else ((), (), ())
    return Following(names, members, ends, Widths(unit * widest, unit * narrowest, most))


class Told(NamedTuple):
    """What a legend says of bundles: what they do, in the order of strands; the largest sum of a band, None where all
    of them are lone."""

    ends: tuple[int, ...]
    largest: float | None


def told(network: Network, left: Sequence[Pathway]) -> Told | None:
    """What a legend says of the bundles of these pathways, None without any."""
    ends = {strand.end for one in left for strand in one.strands}
    lone = all(is_lone(network, one) for one in left)
    return Told(tuple(end for end in SAID if end in ends), None if lone else largest(left)) if left else None
