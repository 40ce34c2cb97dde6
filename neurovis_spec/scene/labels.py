"""Neuron labels: on the disc, else beside it where there is room, else shortened, else left out.

In: labels, discs and what is in the way. Out: for every neuron a Label or None. Labels do not move neurons; in dense
pictures they are left out rather than drawn over each other or over discs, those of the neurons with the most
connections last (``beside``). Both of a mirrored pair are treated alike. A larger picture shows every name that a
smaller one shows.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.geometry import Cells, Rect, united
from neurovis_spec.layout.labels import (
    ABOVE,
    ASIDE,
    BELOW,
    BESIDE,
    DROP,
    LINE,
    MOST,
    NUMBERED,
    RISE,
    SMALLEST,
    STEPS,
    TINY,
    UNIT,
    WEIGHT,
    WIDEST,
    chord,
    fits,
    least_on_disc,
    parts_of,
    told_by_number,
)
from neurovis_spec.layout.model import RADIUS, Point, Side
from neurovis_spec.scene import texts
from neurovis_spec.scene.beside import placed
from neurovis_spec.scene.model import Text, Theme
from neurovis_spec.scene.obstacles import Obstacles
from neurovis_spec.scene.spots import Field, Slot, Wanted
from neurovis_spec.scene.texts import Cut

#: on the disc: not smaller than the first for the sake of others, never larger than the second
_READABLE, _LARGEST = 10.5, 14.0
#: beside it: never smaller, and as large as the picture makes what the layout kept room for
_BESIDE_SMALLEST, _BESIDE_SHARE = 8.5, BESIDE / (RADIUS * UNIT)
#: how much larger than the smallest the others are at most
_UNLIKE = 1.25
#: one that is shortened may be
_LEGIBLE = 8.0
#: a disc smaller than this has no label on it
_SMALLEST_DISC = 7.0
#: and one smaller than this no label beside a number
_SMALLEST_NUMBERED = 16.0
#: to how much of its width a name is cut beside its disc, if there is no room for it, and how many letters it keeps
_CUT, _LETTERS = (0.75, 0.5), 3
#: What lies on more than this is left out.
_TOO_MUCH = 10_000
#: In how many lines a long name is at most.
_LINES = 3
#: How much the label of a glyph moves up, for the number beneath it, in its sizes.
_UP = 0.3
#: How large the number on a glyph is whose label stands beside it, in radii, and how wide at most.
_COUNT, COUNT_ROOM = 0.7, 1.9


@dataclass(frozen=True, slots=True)
class Label:
    """A text for a neuron; on the disc its colour follows the disc's."""

    text: str
    subscript: str
    size: float
    point: Point
    anchor: Literal["start", "middle", "end"]
    on_disc: bool
    #: it lies across a line
    crosses: bool = False
    #: the lines below the first; the last of all has the subscript
    below: tuple[str, ...] = ()

    def shapes(self, fill: str, halo: str) -> tuple[Text, ...]:
        """Its lines in a colour; where it lies across a line, with a halo in another."""
        around, (x, y) = halo if self.crosses else "", self.point
        subscripts = (*("" for _ in self.below), self.subscript)
        return tuple(
            Text((x, y + row * LINE * self.size), text, self.size, fill, self.anchor, WEIGHT, sub, self.on_disc, around)
            for row, (text, sub) in enumerate(zip((self.text, *self.below), subscripts, strict=True))
        )


@dataclass(frozen=True, slots=True)
class Ground:
    """What labels stand on: discs, in layout units (``places``, ``radii``) and where ``scale`` and ``shift`` put them
    in the picture; sample points of the lines, and of the ``borders`` of frames, in layout units; the extent of it all;
    and how far labels are to reach beyond it, to either side, in page units; what other texts have ``taken`` of the
    picture (k, 4)."""

    places: FloatArray
    radii: FloatArray
    scale: float
    shift: Point
    dots: FloatArray
    borders: FloatArray
    extent: Rect
    reach: float
    taken: FloatArray
    #: who is in each frame, the largest first
    frames: Sequence[Collection[int]] = ()
    #: which way (across, down) is out of the ring on which a neuron stands
    outward: Mapping[int, Point] = field(default_factory=dict)

    def centre(self, index: int) -> Point:
        """The centre of a disc in the picture."""
        x, y = self.places[index].tolist()
        return x * self.scale + self.shift[0], y * self.scale + self.shift[1]

    def radius(self, index: int) -> float:
        """The radius of a disc in the picture."""
        return float(self.radii[index]) * self.scale

    def counts(self, index: int, count: int) -> bool:
        """Whether a disc is large enough to say how many neurons it stands for."""
        return size_of_count(count, self.radius(index)) > 0


def as_count(size: int) -> str:
    """How many neurons a glyph stands for, as a picture says it.

    >>> as_count(1600)
    '×1,600'
    """
    return f"×{size:,}"


def size_of_count(count: int, radius: float) -> float:
    """How large that is on a glyph of this radius, beside which its label stands, in page units; 0 where it could not
    be read."""
    size = min(_COUNT * radius, COUNT_ROOM * radius / texts.width(as_count(count), 1.0))
    return size if size >= TINY else 0.0


def labels_of(
    network: Network,
    ground: Ground,
    obstacles: Obstacles,
    hidden: Sequence[bool] = (),
    numbered: Mapping[int, int] = MappingProxyType({}),
    sides: Mapping[int, Side] = MappingProxyType({}),
) -> list[Label | None]:
    """A label for every neuron, or None where there is no room for any of it, or it is ``hidden``. Those that are
    ``numbered`` are glyphs of so many neurons, which their discs say, or labels where these are too small. On the
    ``sides`` given there is room kept for labels."""
    neurons = network.neurons
    parts = parts_of(neurons)
    chosen = [index for index in range(len(neurons)) if not (hidden and hidden[index])]
    partners = {a: b for a, b in partners_of(network).items() if not (hidden and (hidden[a] or hidden[b]))}
    smallest = float(ground.radii[chosen].min(initial=np.inf)) * ground.scale
    common = _common_size([parts[index] for index in chosen], smallest) if smallest >= _SMALLEST_DISC else TINY
    result: list[Label | None] = [None] * len(neurons)
    for index in chosen:
        if ground.radius(index) >= (_SMALLEST_NUMBERED if index in numbered else _SMALLEST_DISC):
            result[index] = _on_disc(*parts[index], ground.centre(index), ground.radius(index), common)
    for one, other in partners.items():
        if result[other] is None:
            result[one] = None
    alone = _told_alone(network, ground, chosen)
    words = _whole(network, {index: count for index, count in numbered.items() if not ground.counts(index, count)})
    called = _Called(words, _until(network, ground, parts, numbered), alone)
    beside = _beside(network, ground, obstacles, chosen, called, sides)
    for index in chosen:  # it is easier to read beside a disc than where it has to be very small
        result[index] = beside.get(index) or result[index]
    for index, label in beside.items():
        if result[index] is label:
            obstacles.add_text(_rect(label))
    cut, told = Cut(neurons.labels), told_by_number(neurons)
    for index in chosen:
        if result[index] is None and index not in numbered and ground.radius(index) >= _SMALLEST_DISC:
            both = parts[index] if told[index] else (neurons.labels[index], "")
            result[index] = _shortened(*both, ground.centre(index), ground.radius(index), cut, index in alone)
    for one, other in partners.items():
        if result[other] is None:
            result[one] = None
    return result


def _until(
    network: Network, ground: Ground, parts: Sequence[tuple[str, str]], numbered: Collection[int]
) -> list[float]:
    """From which scale on each label stands on its disc; what is numbered together stands alike."""
    needed = {both: _radius_for(both) for both in set(parts)}
    until = [
        max(needed[both], _SMALLEST_NUMBERED if index in numbered else _SMALLEST_DISC) / float(radius)
        for index, (both, radius) in enumerate(zip(parts, ground.radii.tolist(), strict=True))
    ]
    for group in network.neurons.groups:
        counted = [index for index in group.indices if parts[index][1]]
        latest = max((until[index] for index in counted), default=0.0)
        for index in counted:
            until[index] = latest
    return until


def beside_all(label: str, rect: Rect, obstacles: Obstacles, picture: Rect, theme: Theme) -> tuple[Text, ...]:
    """What all neurons in a part of the ``picture`` are called, in lines, at an end of it, above or below, where it
    covers least, and no disc; nothing where there is no room. Its own room is added to ``obstacles``."""
    (x0, y0, x1, y1), size, said = rect, BESIDE, _in_lines(label, "")
    wide, high = _wide(said, size), (RISE + DROP + LINE * (len(said[0]) - 1)) * size
    across, down = (x0 + x1 - wide) / 2, (y0 + y1 - high) / 2
    corners = ((x0 - ASIDE - wide, down), (x1 + ASIDE, down), (across, y0 - ABOVE - high), (across, y1 + BELOW))
    rects = [(x - 2, y, x + wide + 2, y + high) for x, y in corners]
    inside = [own for own in rects if united((own, picture)) == picture]
    if not inside:
        return ()
    hits, place = min((obstacles.hits(own), place) for place, own in enumerate(inside))
    if hits >= _TOO_MUCH:
        return ()
    obstacles.add_text(inside[place])
    (first, *below), (left, top, right, _) = said[0], inside[place]
    anchor: Literal["start", "middle", "end"] = "end" if right <= x0 else "start" if left >= x1 else "middle"
    start = {"start": left + 2, "middle": (left + right) / 2, "end": right - 2}[anchor]
    point = start, top + RISE * size
    return Label(first, "", size, point, anchor, False, hits > 0, tuple(below)).shapes(theme.ink, theme.background)


def raised(labels: Sequence[Label | None], sizes: Mapping[int, int]) -> list[Label | None]:
    """The labels, those on glyphs moved up to leave room for their numbers."""
    return [
        replace(label, point=(label.point[0], label.point[1] - _UP * label.size))
        if label is not None and label.on_disc and index in sizes
        else label
        for index, label in enumerate(labels)
    ]


def partners_of(network: Network) -> dict[int, int]:
    """The mirror image of each neuron that has one."""
    result: dict[int, int] = {}
    for mirror in network.layout.mirrors:
        for one, other in mirror.pairs:
            if one != other and one not in result and other not in result:
                result[one], result[other] = other, one
    return result


def rank_of(network: Network) -> list[int]:
    """The neurons by the number of their connections, those with the most first."""
    connections, count = network.connections, len(network.neurons)
    ends = np.concatenate([connections.sources.whole(), connections.targets.whole()])
    degrees = np.bincount(ends, minlength=count)
    for one, other in partners_of(network).items():
        degrees[one] = max(degrees[one], degrees[other])
    order: list[int] = np.lexsort((np.arange(count), -degrees)).tolist()
    return order


def size_beside(radius: float) -> float:
    """How large the letters are beside a disc of this radius, in page units."""
    return min(BESIDE, max(_BESIDE_SMALLEST, _BESIDE_SHARE * radius))


@dataclass(frozen=True, slots=True)
class _Called:
    """What is said of each neuron beside its disc, from which scale on a label stands on it, and whose number ``alone``
    says who they are: their names are not cut."""

    words: Sequence[tuple[str, str]]
    until: Sequence[float]
    alone: frozenset[int]


def _beside(
    network: Network,
    ground: Ground,
    obstacles: Obstacles,
    chosen: Sequence[int],
    called: _Called,
    sides: Mapping[int, Side],
) -> dict[int, Label]:
    """Labels beside discs, by neuron, as far as there is room for them at this scale or a smaller one, on the ``sides``
    with room for them if that is enough."""
    among, partners, words = set(chosen), partners_of(network), called.words
    cut, lines = Cut(base for base, _ in words), _lines(network, ground, chosen)
    said: dict[int, list[_Saying]] = {}
    wanted: list[Wanted] = []
    for index in [index for index in rank_of(network) if index in among][:MOST]:
        if index in said:
            continue
        partner = partners.get(index, index)
        members = (index, partner) if partner != index and partner in among else (index,)
        wordings, usual = _wordings([words[one] for one in members], cut, not called.alone.issuperset(members))
        said |= {one: [wording[place] for wording in wordings] for place, one in enumerate(members)}
        kept = [Slot(*STEPS[sides[one]]) for one in members if one in sides]
        wanted.append(
            Wanted(
                members,
                tuple(tuple((_wide(one), len(one[0])) for one in wording) for wording in wordings),
                usual,
                max(called.until[one] for one in members),
                tuple(kept) if len(kept) == len(members) else (),
                lines.get(index, -1),
                ground.outward.get(index),
            )
        )
    level, taken = _level(network), (ground.taken - np.tile(ground.shift, 2)) / ground.scale
    field = Field(ground.places, ground.radii, ground.dots, ground.borders, ground.extent, ground.reach, level, taken)
    result: dict[int, Label] = {}
    for index, (slot, wording) in placed(wanted, field, size_beside, ground.scale).items():
        label = _at(said[index][wording], slot, ground.centre(index), ground.radius(index))
        result[index] = replace(label, crosses=obstacles.crossed(_rect(label)))
    return result


def _at(said: _Saying, slot: Slot, centre: Point, radius: float) -> Label:
    """What is said on a side of a disc."""
    size, ((first, *below), subscript) = size_beside(radius), said
    width = _wide(said, size)
    x0, y0, _, _ = slot.text(radius, width, size, 1 + len(below))
    anchor: Literal["start", "middle", "end"] = ("end", "middle", "start")[slot.across + 1]
    point = centre[0] + x0 + width * (1 - slot.across) / 2, centre[1] + y0 + RISE * size
    return Label(first, subscript, size, point, anchor, False, below=tuple(below))


def _told_alone(network: Network, ground: Ground, chosen: Sequence[int]) -> frozenset[int]:
    """Whose number alone says who they are: those of the neurons with one in their group that have two of their group
    next to them."""
    group = np.zeros(len(network.neurons), np.int64)
    for number, own in enumerate(network.neurons.groups):
        group[own.start : own.start + own.count] = number
    told, shown = told_by_number(network.neurons), np.array(chosen, np.int64)
    numbered = np.array([told[index] and ground.radius(index) >= _SMALLEST_DISC for index in chosen], np.bool_)
    among = _among_own(ground.places[shown], group[shown], np.flatnonzero(numbered))
    return frozenset(shown[among].tolist())


def _among_own(places: FloatArray, group: IntArray, asked: IntArray) -> IntArray:
    """Which of the places ``asked``, of all (n, 2), have two of their ``group`` (n,) next to them; of equally near ones
    those of the group are nearer."""
    found: list[IntArray] = []
    far, reach = float(np.ptp(places, axis=0).max()) if len(places) else 0.0, 1.0
    while len(asked):
        row, other, squared = Cells(places, reach).near(places[asked])
        away, foreign = np.sqrt(squared).round(6), group[other] != group[asked[row]]
        near = np.flatnonzero((other != asked[row]) & (away < reach))
        near = near[np.lexsort((foreign[near], away[near], row[near]))]
        begin = np.searchsorted(row[near], np.arange(len(asked) + 1))
        decided = np.diff(begin) >= 2
        first = begin[:-1][decided]
        found.append(asked[decided][~(foreign[near[first]] | foreign[near[first + 1]])])
        asked, reach = asked[~decided] if reach <= 2 * far else asked[:0], 2 * reach
    return np.concatenate(found) if found else asked


def _lines(network: Network, ground: Ground, chosen: Sequence[int]) -> dict[int, int]:
    """Whose names are to stand on one side, by the number of their line: of neurons of one rank those in the same
    frame, or in no frame of the same group; of a group also those that are alone in their rank."""
    frame = {index: number for number, members in enumerate(ground.frames) for index in members}
    group = {index: number for number, own in enumerate(network.neurons.groups) for index in own.indices}
    along = 0 if _level(network) else 1
    ranks: dict[tuple[int, int, float], list[int]] = {}
    for index in chosen:
        rank = round(float(ground.places[index, along]), 6)
        ranks.setdefault((frame.get(index, -1), -1 if index in frame else group[index], rank), []).append(index)
    lines = [members for members in ranks.values() if len(members) > 1]
    alone: dict[int, list[int]] = {}
    for index in [members[0] for members in ranks.values() if len(members) == 1]:
        alone.setdefault(group[index], []).append(index)
    return {index: number for number, members in enumerate([*lines, *alone.values()]) for index in members}


#: What is said of a neuron: lines, and a subscript behind the last.
_Saying: TypeAlias = tuple[tuple[str, ...], str]


def _wordings(words: Sequence[tuple[str, str]], cut: Cut, shorter: bool) -> tuple[list[list[_Saying]], int]:
    """What can be said of neurons that are labelled alike, from all of their names on; and which of these is usual: a
    name in a line, but so long a one that it would look like a title of those around in several. It may be ``shorter``,
    too."""
    whole: list[_Saying] = [((text,), sub) for text, sub in words]
    wide = [_wide(both) for both in whole]
    found = [whole]
    if max(wide) > WIDEST:
        found.append([_in_lines(*both) for both in words])
    for share in (1.0, *_CUT) if shorter else (1.0,):
        parts = [cut.parts(*both, 1.0, share * min(each, WIDEST)) for both, each in zip(words, wide, strict=True)]
        said: list[_Saying] = [((text,), sub) for text, sub in parts]
        if said != found[-1] and all(len(text) > _LETTERS or (text, sub) in words for text, sub in parts):
            found.append(said)
    return found, int(max(wide) > WIDEST)


def _in_lines(text: str, subscript: str) -> _Saying:
    """A name in as many lines as it takes, at most ``_LINES``, of about equal length."""
    lines = texts.wrapped(text, 1.0, WIDEST, WEIGHT)
    if len(lines) > _LINES:
        last = texts.shorten("".join(lines[_LINES - 1 :]), 1.0, WIDEST, WEIGHT)
        return (*lines[: _LINES - 1], last), subscript
    low, high = 0.0, WIDEST
    for _ in range(8):
        middle = (low + high) / 2
        low, high = (low, middle) if len(texts.wrapped(text, 1.0, middle, WEIGHT)) <= len(lines) else (middle, high)
    return tuple(texts.wrapped(text, 1.0, high, WEIGHT)), subscript


def _whole(network: Network, numbered: Mapping[int, int]) -> list[tuple[str, str]]:
    """What is said of each neuron beside its disc, and a subscript: a name that keeps all of its letters; of those that
    are ``numbered`` how many neurons they are."""
    labelled = enumerate(zip(network.neurons.labels, parts_of(network.neurons), strict=True))
    return [
        (label, as_count(numbered[index])) if index in numbered else parts if label == "".join(parts) else (label, "")
        for index, (label, parts) in labelled
    ]


def _wide(said: _Saying, size: float = 1.0) -> float:
    *lines, last = said[0]
    return max([texts.width(last, size, WEIGHT, said[1]), *(texts.width(line, size, WEIGHT) for line in lines)])


def _rect(label: Label) -> Rect:
    """What a label beside a disc covers."""
    width, (x, y) = _wide(((label.text, *label.below), label.subscript), label.size), label.point
    left = x - {"start": 0.0, "middle": width / 2, "end": width}[label.anchor]
    bottom = y + (DROP + LINE * len(label.below)) * label.size
    return left - 2, y - RISE * label.size, left + width + 2, bottom


def margin_beside(
    network: Network,
    radius: float,
    rooms: Collection[int] = (),
    numbered: Mapping[int, int] = MappingProxyType({}),
) -> float:
    """How far labels may reach beyond the discs at the rim: 0 where all fit on discs of this radius, or have ``rooms``
    kept for them in a picture that is not reduced. Those of glyphs that are ``numbered`` may have to say so."""
    words = _whole(network, {index: count for index, count in numbered.items() if not size_of_count(count, radius)})
    cut = Cut(base for base, _ in words)
    kept = rooms if radius >= _BESIDE_SMALLEST / _BESIDE_SHARE else ()
    named = [both for index, both in enumerate(zip(words, parts_of(network.neurons), strict=True)) if index not in kept]
    if radius >= _SMALLEST_DISC and all(
        _on_disc(*parts, (0.0, 0.0), radius, _READABLE) is not None for _, parts in named
    ):
        return 0.0
    said = [cut.parts(*own, 1.0, WIDEST) for own, _ in named]
    return max((_wide(((text,), sub), size_beside(radius)) for text, sub in said), default=0.0) + ASIDE + 3


def room_beside(network: Network, radius: float) -> list[tuple[int, Point]]:
    """The neurons whose labels do not fit on discs of this radius, and how far from their centres these reach then:
    down, or to either side where signals run across."""
    neurons, level = network.neurons, _level(network)
    result: list[tuple[int, Point]] = []
    for index, (label, parts) in enumerate(zip(neurons.labels, parts_of(neurons), strict=True)):
        if _on_disc(*parts, (0.0, 0.0), radius, _READABLE) is None:
            width = min(texts.width(label, BESIDE, WEIGHT), 5 * radius)
            result.append((index, (radius + 8 + width, 0.0) if level else (0.0, radius + 17)))
    return result


def _level(network: Network) -> bool:
    """Whether signals run across, so that there is more room at the ends than beneath."""
    return network.layout.direction in ("right", "left")


def _radius_for(parts: tuple[str, str]) -> float:
    """The radius of the smallest disc that holds a label; infinite for one that none does."""
    low, high = 0.0, 100.0
    if not fits(parts, max(NUMBERED, least_on_disc(parts[1], high)), high):
        return np.inf
    for _ in range(24):
        middle = (low + high) / 2
        holds = fits(parts, max(NUMBERED, least_on_disc(parts[1], middle)), middle)
        low, high = (low, middle) if holds else (middle, high)
    return high


def _common_size(parts: list[tuple[str, str]], radius: float) -> float:
    """The size of most labels: the largest at which all that fit at a readable size do fit."""
    size = largest = min(_LARGEST, 0.76 * radius)
    readable = [p for p in dict.fromkeys(parts) if fits(p, min(_READABLE, largest), radius)]
    while size > _READABLE and not all(fits(p, size, radius) for p in readable):
        size -= 0.5
    smallest = size
    for both in dict.fromkeys(parts):
        least = least_on_disc(both[1], radius)
        if fits(both, least, radius):
            while smallest > least and not fits(both, smallest, radius):
                smallest = max(smallest - 0.5, least)
    return min(size, max(_UNLIKE * smallest, min(SMALLEST, largest)))


def _on_disc(
    base: str, subscript: str, centre: Point, radius: float, common: float, least: float | None = None
) -> Label | None:
    least = least or least_on_disc(subscript, radius)
    size = max(common, least)
    while size > least and not fits((base, subscript), size, radius):
        size = max(size - 0.5, least)
    if not fits((base, subscript), size, radius):
        return None
    drop = 0.36 if not subscript else 0.32
    return Label(base, subscript, size, (centre[0], centre[1] + drop * size), "middle", True)


def _shortened(base: str, subscript: str, centre: Point, radius: float, cut: Cut, alone: bool) -> Label | None:
    """What fits on the disc: part of a name; of a numbered one its number, ``alone`` if need be and if that says who it
    is."""
    if subscript:
        for end in range(min(len(base) - 1, 3), 0, -1):
            found = _on_disc(base[:end] + "…", subscript, centre, radius, SMALLEST, _LEGIBLE)
            if found is not None:
                return found
        return _on_disc(subscript, "", centre, radius, min(SMALLEST, 0.76 * radius), TINY) if alone else None
    size = min(max(SMALLEST, min(10.0, 0.5 * radius)), 0.76 * radius)
    text = cut.shorten(base, size, chord(radius, size))
    if len(text) < 3:  # a single letter says nothing
        return None
    return Label(text, "", size, (centre[0], centre[1] + 0.36 * size), "middle", True)
