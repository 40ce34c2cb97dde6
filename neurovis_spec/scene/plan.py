"""The plan of a picture: all that does not change from step to step.

In: a network, its layout, gains and settings. Out: a Plan: the frame, discs, lines, boxes, labels, title and legend.
``encode`` and ``film`` paint activities and weights on it, so every step of a network has the same geometry. All is
arranged in page units; the Plan is in user units (``frame``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.geometry import Rect
from neurovis_spec.layout.labels import BESIDE, UNIT, called_alike, label_rects, label_room
from neurovis_spec.layout.model import RADIUS, Layout, Point, Side
from neurovis_spec.layout.naming import natural_key
from neurovis_spec.projection import called, nearness
from neurovis_spec.scene import bundles, delays, encoding, legend, texts
from neurovis_spec.scene.boxes import Box, boxes_of, entitled, outward
from neurovis_spec.scene.caption import (
    CAPTION,
    CAPTION_Y,
    HEADER,
    MOST_TITLE,
    TITLE,
    caption_text,
    lowered,
    title_lines,
)
from neurovis_spec.scene.collapse import Gathered
from neurovis_spec.scene.ends import EndArray, SetEnds, signed
from neurovis_spec.scene.fading import seconds_of, sent_seconds_of, told_times
from neurovis_spec.scene.frame import MARGIN, MOST, Frame, Margins, fit, unit_for
from neurovis_spec.scene.gains import Gains, in_pages
from neurovis_spec.scene.gathered_layout import radius_of
from neurovis_spec.scene.geometry import batches, bounds, samples
from neurovis_spec.scene.labels import (
    Ground,
    Label,
    beside_all,
    labels_of,
    margin_beside,
    partners_of,
    raised,
    room_beside,
    size_beside,
)
from neurovis_spec.scene.legend_scales import LegendEntry
from neurovis_spec.scene.lesions import Lesions, lesions_of
from neurovis_spec.scene.line_labels import backed, line_labels, pathway_labels
from neurovis_spec.scene.line_styles import Styles, styles_of
from neurovis_spec.scene.lines import Line, routes_of, trimmed
from neurovis_spec.scene.model import Arrowhead, Group, Polygon, Rectangle, Shape, Spline, Text, Theme, head_half_width
from neurovis_spec.scene.obstacles import Obstacles
from neurovis_spec.scene.pathway_words import PathwayWords, lost_by
from neurovis_spec.scene.pathways import Pathway, pathways
from neurovis_spec.scene.scaling import scaled, scaled_group
from neurovis_spec.scene.shown import Shown, shown
from neurovis_spec.scene.signals import Signals
from neurovis_spec.scene.spots import beyond
from neurovis_spec.scene.teachers import Guide, dash, dotted, drawn_teachers, guides_of, hubs_between, label_of, room_of
from neurovis_spec.scene.themes import theme_of, tints_of
from neurovis_spec.scene.titles import Heading, Titled, elsewhere, in_one_place, outline

if TYPE_CHECKING:
    from neurovis_spec.runtime.recording import Snapshot

#: how high a line is that says what is left out; what texts keep of the picture's edge
_NOTE_LINE, _EDGE = 16.0, 6.0
#: how large the farthest of neurons in space is, where the nearest is as large as others are
_FAR = 0.55
#: how large a neuron is that is out of focus
_UNFOCUSED = 0.4
#: a picture is made so wide at most to have its legend in one row, and its title in one line
_ROOM = 840.0
#: the id of the title's group
_TITLED = "title"


@dataclass(frozen=True, slots=True)
class Plan:
    """The unchanging part of a picture. ``order``: connection indices from back to front."""

    network: Network
    gains: Gains
    theme: Theme
    title: str
    frame: Frame
    #: of every neuron
    radii: tuple[float, ...]
    rings: tuple[float, ...]
    centres: tuple[Point, ...]
    #: how many neurons each stands for, where it is a glyph, and how many connections each line
    sizes: Mapping[int, int]
    counts: Mapping[int, int]
    #: of the connections that are drawn
    lines: Mapping[int, Line]
    order: tuple[int, ...]
    #: neuron indices from back to front, where some are nearer than others; empty where all are in a plane
    depth: tuple[int, ...]
    #: on connections whose signal takes several steps, by index
    beads: Mapping[int, Rectangle]
    #: what events remove, and when
    lesions: Lesions
    labels: tuple[Label | None, ...]
    #: beneath the lines, between these and the discs, and above the discs
    back: tuple[Group, ...]
    between: tuple[Group, ...]
    front: tuple[Group, ...]
    #: how much lower than under a title of one line the caption is; None without one
    captioned: float | None
    #: user units in a page unit
    unit: float
    #: what is left out, as the picture says it
    notes: tuple[str, ...]
    #: who is in each box, and what is left out of which pathway and stands as a bundle, by the ids of their groups
    boxes: Mapping[str, tuple[int, ...]]
    left: Mapping[str, Pathway]
    framed: _Framed = field(repr=False)

    def theme_ends(self, ends: EndArray) -> EndArray:
        """How lines end in its theme, which may know nothing but arrows."""
        return ends if self.theme.ends == "signs" else np.ones_like(ends)

    def caption_shape(self, words: str) -> Text | None:
        """The line under the title, if there is one."""
        if self.captioned is None:
            return None
        return scaled(caption_text(words, self.frame.width / self.unit, self.theme, self.captioned), self.unit)


def plan(
    drawn: Gathered,
    layout: Layout,
    gains: Gains,
    settings: RenderSettings,
    peaks: FloatArray | None = None,
    narrowest: float = 0.0,
    begin: Snapshot | None = None,
) -> Plan:
    """Arrange everything that stays the same. ``layout`` is that of what is drawn; ``peaks`` (m,) are the largest
    magnitudes of its weights in what is drawn, by default those at first; ``begin`` is the first step of the whole that
    is drawn, of which bundles have their sums, by default that before anything happens. Without a stated size the
    picture is at least ``narrowest`` wide (page units). Raises KeyError for a theme that does not exist, RendererError
    for a path that is none."""
    theme = theme_of(settings)
    content, framed = _begun(drawn, layout, gains, settings, peaks, narrowest, begin)
    network, seen = content.network, content.seen
    frame, gains = framed.frame, in_pages(gains, framed.unit)
    page = _on_page(content, framed, gains, layout, theme)
    said = _texts(content, page, settings)
    rings = np.minimum(2.5, 0.12 * page.radii)
    lone, joined = _bundle_groups(content, page.bundles, theme, 0 if begin is None else begin.step)
    made = Plan(
        network=network,
        gains=gains,
        theme=theme,
        title=network.title or network.name,
        frame=frame,
        radii=tuple((page.radii - rings / 2).tolist()),
        rings=tuple(rings.tolist()),
        centres=tuple((x, y) for x, y in page.centres.tolist()),
        sizes=content.sizes,
        counts={line: count for line, count in enumerate(drawn.counts.tolist()) if drawn.sheaf[line]},
        lines=page.lines,
        order=_order(network, gains.widths(network.connections.weights.whole()), seen.lines),
        depth=() if content.near is None else tuple(np.argsort(content.near, kind="stable").tolist()),
        beads=delays.beads(network, page.lines, RADIUS * frame.scale, theme),
        lesions=content.lesions,
        labels=tuple(raised(said.labels, content.sizes)),
        back=(*_box_frames(page.boxes, frame, theme), *lone, *_dotted_groups(content, page, theme, many=False)),
        between=(*joined, *_dotted_groups(content, page, theme, many=True)),
        front=(*_in_front(content, page, said), *framed.around(content.notes, theme)),
        captioned=None if framed.title is None else lowered(framed.title, frame.width),
        unit=1.0,
        notes=content.notes,
        boxes={f"{box.kind}:{box.path}": box.members for box in page.boxes},
        left={bundles.id_of(one.pathway, network): one.pathway for one in page.bundles.all},
        framed=framed,
    )
    return made if framed.unit == 1 else _in_user_units(made, framed.unit)


def retitled(planned: Plan, drawn: Gathered, layout: Layout, gains: Gains, settings: RenderSettings) -> Plan | None:
    """The plan of a network of which nothing but the title has changed, all else being as it was when it was
    ``planned``; None where more has, or where this title has other room than that one had, so that the rest would stand
    elsewhere."""
    network, before = drawn.network, planned.network
    kept = (getattr(network, one.name) is getattr(before, one.name) for one in fields(network) if one.name != "title")
    if not all(kept):
        return None
    content, framed = _begun(drawn, layout, gains, settings)
    room, roomed = ((one.picture(len(content.notes)), one.title is None) for one in (framed, planned.framed))
    if room != roomed or replace(framed, title=None) != replace(planned.framed, title=None):
        return None
    unit, title = planned.unit, framed.titled(theme_of(settings))
    front = [group for group in planned.front if group.id != _TITLED]
    place = next((place for place, group in enumerate(planned.front) if group.id == _TITLED), len(front))
    front[place:place] = [group if unit == 1 else scaled_group(group, unit) for group in title]
    captioned = None if framed.title is None else lowered(framed.title, framed.frame.width)
    words = network.title or network.name
    return replace(planned, network=network, title=words, front=tuple(front), captioned=captioned, framed=framed)


def _begun(
    drawn: Gathered,
    layout: Layout,
    gains: Gains,
    settings: RenderSettings,
    peaks: FloatArray | None = None,
    narrowest: float = 0.0,
    begin: Snapshot | None = None,
) -> tuple[_Content, _Framed]:
    """What is in a picture, and its frame."""
    weights = np.abs(drawn.network.connections.weights.whole()) if peaks is None else peaks
    content = _content(drawn, layout, settings, weights, begin)
    widths = encoding.clamped(gains.widths(weights)[content.seen.lines])
    return content, _framed(_Wanted(content, gains, settings, theme_of(settings), narrowest), widths)


@dataclass(frozen=True, slots=True, eq=False)
class _Content:
    """What is in a picture, in units of the layout, before it is known how large that is."""

    network: Network
    #: (n, 2) of every neuron, and the route of every connection
    positions: FloatArray
    routes: Sequence[FloatArray]
    seen: Shown
    #: (n,) radii of discs, and how many neurons those are that are glyphs
    radii: FloatArray
    sizes: Mapping[int, int]
    #: what the labels cover for which the layout kept room, by neuron, and on which side they stand
    rooms: Mapping[int, Rect]
    sides: Mapping[int, Side]
    boxes: Sequence[Box]
    #: the pathways of what is left out, the strongest first
    left: Sequence[Pathway]
    #: who has a dotted line to whom
    guides: Sequence[Guide]
    lesions: Lesions
    #: what the legend says of signals, and how lines end
    signals: str
    ends: legend.Ends
    notes: tuple[str, ...]
    #: of pathways, what stands beside each line, the most words first
    said: Sequence[Sequence[str]]
    extent: Rect
    #: (n,) how near neurons in space are, None where all are in a plane
    near: FloatArray | None
    #: None where all lines are solid
    styles: Styles | None


def _content(
    drawn: Gathered, layout: Layout, settings: RenderSettings, weights: FloatArray, begin: Snapshot | None
) -> _Content:
    network = drawn.network
    positions, routes = _in_units(network, layout)
    seen = shown(network, drawn.asked(settings), weights, _lengths(routes))
    left, unsaid = bundles.strongest(network, _left(drawn, seen.left, begin))
    radii = np.array([radius_of(size) for size in drawn.sizes.tolist()]) * np.where(seen.focus, 1.0, _UNFOCUSED)
    near = nearness(network, layout.engine)
    radii = radii if near is None else radii * (_FAR + (1.0 - _FAR) * near)
    rooms = _rooms(network, layout) if settings.labels else {}
    sides = {index: layout.labels[network.neurons.names[index]] for index in rooms}
    boxes = boxes_of(network, positions, routes, rooms)
    teachers = [one for one in drawn_teachers(drawn) if seen.focus[one.source] and seen.focus[one.target]]
    guides, few = guides_of(network, teachers)
    beside = room_beside(network, RADIUS * UNIT) if settings.labels else []
    beside = [(index, reach) for index, reach in beside if index not in rooms]
    extent = _extent(positions, radii, routes, boxes, beside, rooms.values())
    lesions, signals, ends = lesions_of(network), Signals(drawn.whole).called, _ends(drawn)
    words = PathwayWords(drawn.whole, lost_by(drawn.whole, 0 if begin is None else begin.step))
    return _Content(
        network=network,
        positions=positions,
        routes=routes,
        seen=seen,
        radii=radii,
        sizes={unit: size for unit, size in enumerate(drawn.sizes.tolist()) if drawn.glyph[unit]},
        rooms=rooms,
        sides=sides,
        boxes=boxes,
        left=left,
        guides=guides,
        lesions=lesions,
        signals=signals,
        ends=ends,
        notes=(*seen.notes, *few, *unsaid),
        said=[words.beside(strand) for strand in drawn.strands or ()],
        extent=extent,
        near=near,
        styles=styles_of(network),
    )


def _left(drawn: Gathered, some: npt.NDArray[np.bool_], begin: Snapshot | None) -> tuple[Pathway, ...]:
    """The pathways of what is left out, with the weights and ends of a step."""
    if not some.any():
        return ()
    whole = drawn.whole.connections.weights.whole() if begin is None else begin.weights
    ends = drawn.ends(whole, None if begin is None else begin.ends)
    return pathways(drawn.network, some, drawn.total(whole) if drawn.any else whole, ends, drawn.counts)


@dataclass(frozen=True, slots=True, eq=False)
class _OnPage:
    """Where that is on the page, in page units: centres (n, 2) and radii (n,) of discs, the lines that are drawn by
    connection, dotted ones, boxes in units of the layout; what is in the way of texts; what of the page the network
    has, and how much is left free beside it."""

    frame: Frame
    centres: FloatArray
    radii: FloatArray
    lines: Mapping[int, Line]
    guides: Sequence[Line]
    bundles: bundles.Bundles
    boxes: Sequence[Box]
    obstacles: Obstacles
    picture: Rect
    margin: float


def _on_page(content: _Content, framed: _Framed, gains: Gains, layout: Layout, theme: Theme) -> _OnPage:
    network, frame = content.network, framed.frame
    boxes = entitled(content.boxes, content.positions, frame.scale, _rooms(network, layout, frame.scale))
    centres, radii = frame.map(content.positions), content.radii * frame.scale
    ends = np.stack([radii[network.connections.sources.whole()], radii[network.connections.targets.whole()]], axis=1)
    kept = np.flatnonzero(content.seen.lines).tolist()
    lines = trimmed([frame.map(content.routes[index]) for index in kept], ends[kept], RADIUS * frame.scale)
    lines = _both_ways(network, kept, lines)
    reaches = _reaches(network, gains, frame.widest)
    obstacles = Obstacles(_dots(lines), [reaches[index] for index in kept], centres, radii)
    picture = framed.picture(len(content.notes))
    frames = [(box.members, _mapped(box.rect, frame)) for box in boxes]
    around, radius = [room_of(guide, frames, picture) for guide in content.guides], RADIUS * frame.scale
    hubs = hubs_between(content.guides, centres, radii, radius, picture)
    guides = dotted(content.guides, partners_of(network), hubs, radius, obstacles, around)
    for points in _dots(guides):
        obstacles.add_line(points)
    for box in boxes:
        sector = box.sector
        obstacles.add_frame(outline(_mapped(box.rect, frame)) if sector is None else frame.map(sector.border(0.1)))
    drawn = dict(zip(kept, lines, strict=True))
    if (styles := content.styles) is not None:
        dashes = ((index, styles.dash(index, RADIUS * frame.scale)) for index in kept)
        drawn = {index: replace(drawn[index], dash=dash) for index, dash in dashes}
    ground = bundles.Ground(network, centres, radii, _titled_groups(network, boxes), obstacles, picture)
    bands = bundles.bundled(content.left, ground, theme)
    return _OnPage(frame, centres, radii, drawn, guides, bands, boxes, obstacles, picture, framed.margin)


@dataclass(frozen=True, slots=True)
class _Texts:
    """Titles by box, labels of neurons, by group what all of its neurons are called, and by entry what connections
    are."""

    titles: Mapping[int, Heading]
    labels: Sequence[Label | None]
    groups: Mapping[str, tuple[Text, ...]]
    lines: Mapping[str, Text]


def _texts(content: _Content, page: _OnPage, settings: RenderSettings) -> _Texts:
    """The texts in the network; each is in the way of those after it: titles all in one place, labels of neurons, of
    connections, the other titles."""
    network, obstacles, boxes, theme = content.network, page.obstacles, page.boxes, theme_of(settings)
    titled = _titled(boxes, page.frame, page.picture)
    framed = [index for index, box in enumerate(boxes) if box.sector is None]  # there is no one place along a ring
    kept = [_mapped(rect, page.frame) for rect in content.rooms.values()]
    found = in_one_place([titled[index] for index in framed], obstacles, theme, kept)
    titles = {framed[place]: heading for place, heading in found.items()}
    labels: list[Label | None] = [None] * len(network.neurons)
    groups: Mapping[str, tuple[Text, ...]] = {}
    lines: Mapping[str, Text] = {}
    if settings.labels:
        groups = _called_together(content, page, theme)
        hidden = (~content.seen.focus).tolist()
        for name in groups:
            for index in network.group_index[name].indices:
                hidden[index] = True
        labels = labels_of(network, _ground(content, page), obstacles, hidden, content.sizes, content.sides)
        if content.said:
            strongest = np.argsort(-np.abs(network.connections.weights.whole()), kind="stable").tolist()
            told = {network.connection_names[k]: (page.lines[k], content.said[k]) for k in strongest if k in page.lines}
            lines = pathway_labels(told, obstacles, theme, page.picture)
        else:
            lines = line_labels(network, page.lines, obstacles, theme, page.picture)
    left = [index for index in range(len(boxes)) if index not in titles]
    unsaid = {titled[index].computes for index, one in titles.items() if one.words != boxes[index].title}
    others = elsewhere([titled[index] for index in left], obstacles, theme, unsaid)
    titles |= {index: one for index, one in zip(left, others, strict=True) if one is not None}
    return _Texts(titles, labels, groups, lines)


def _called_together(content: _Content, page: _OnPage, theme: Theme) -> dict[str, tuple[Text, ...]]:
    """By group what all of its neurons are called, once beside them all: of those that stand together, where there is
    room for it."""
    neurons, found = content.network.neurons, dict[str, tuple[Text, ...]]()
    for group in called_alike(neurons):
        own = np.array(group.indices, np.int64)
        low, high = page.centres[own].min(axis=0), page.centres[own].max(axis=0)
        within = ((page.centres >= low) & (page.centres <= high)).all(axis=1)
        if content.seen.focus[own].all() and int(within.sum()) == group.count:
            reach = float(page.radii[own].max())
            (x0, y0), (x1, y1) = (low - reach).tolist(), (high + reach).tolist()
            label = neurons.labels[group.start]
            found[group.name] = beside_all(label, (x0, y0, x1, y1), page.obstacles, page.picture, theme)
    return {name: lines for name, lines in found.items() if lines}


def _in_front(content: _Content, page: _OnPage, said: _Texts) -> Iterator[Group]:
    """The labels of connections and of groups, and the titles."""
    for name, words in said.groups.items():
        yield Group(words, id=f"label:{name}")
    for entry, text in said.lines.items():
        yield Group(backed(text) if content.said else (text,), id=f"label:{entry}")
    for index in sorted(said.titles):
        yield Group(said.titles[index].lines, id=f"title:{page.boxes[index].path}")


def _ground(content: _Content, page: _OnPage) -> Ground:
    """What the labels of neurons stand on."""
    network, frame, boxes = content.network, page.frame, page.boxes
    borders = [outline(box.rect, 4 / UNIT) if box.sector is None else box.sector.border(4 / UNIT) for box in boxes]
    inner = [(points - (frame.left, frame.top)) / frame.scale for points in _dots(page.guides)]
    inner += samples([content.routes[i] for i in page.lines], 24)
    rooms = frozenset(content.rooms)
    return Ground(
        content.positions,
        content.radii,
        frame.scale,
        (frame.left, frame.top),
        np.concatenate([np.zeros((0, 2)), *inner]),
        np.concatenate([np.zeros((0, 2)), *borders]),
        content.extent,
        margin_beside(network, RADIUS * frame.scale, rooms, content.sizes) if page.margin > MARGIN else 0.0,
        page.obstacles.texts(),
        [box.members for box in boxes],
        outward(network, content.positions),
    )


def _in_user_units(made: Plan, unit: float) -> Plan:
    """A plan in page units, of which each is so many user units, in these."""
    return replace(
        made,
        frame=made.frame.times(unit),
        radii=tuple(unit * radius for radius in made.radii),
        rings=tuple(unit * ring for ring in made.rings),
        centres=tuple((unit * x, unit * y) for x, y in made.centres),
        lines={index: scaled(line, unit) for index, line in made.lines.items()},
        beads={index: scaled(bead, unit) for index, bead in made.beads.items()},
        labels=tuple(label and scaled(label, unit) for label in made.labels),
        back=tuple(scaled_group(group, unit) for group in made.back),
        between=tuple(scaled_group(group, unit) for group in made.between),
        front=tuple(scaled_group(group, unit) for group in made.front),
        unit=unit,
    )


def rerouted(planned: Plan, layout: Layout, connections: Sequence[int]) -> list[Line]:
    """How some connections run in another layout, on the same picture."""
    network, frame, unit = planned.network, planned.frame, planned.unit
    names, ends, chosen = network.neurons.names, network.connections, np.array(connections, np.int64)
    pairs = list(zip(ends.sources[chosen].tolist(), ends.targets[chosen].tolist(), strict=True))
    radii = np.array(planned.radii) + np.array(planned.rings) / 2
    radius = RADIUS * frame.scale / unit
    routes = routes_of(
        [network.connection_names[index] for index in connections], [(names[a], names[b]) for a, b in pairs], layout
    )
    discs = np.array([(radii[a], radii[b]) for a, b in pairs]).reshape(-1, 2)
    return _both_ways(network, connections, trimmed([frame.map(route) for route in routes], discs, radius, unit))


def _both_ways(network: Network, connections: Sequence[int], lines: list[Line]) -> list[Line]:
    """The lines of some connections, those of symmetric pairs with a head at either end."""
    twins = network.connections.twins
    if twins is None:
        return lines
    pairs = zip(lines, twins[np.array(connections, np.int64)].tolist(), strict=True)
    return [line if twin < 0 else line.both_ways() for line, twin in pairs]


def _lengths(routes: Sequence[FloatArray]) -> FloatArray:
    """How far routes go, roughly: along their control points."""
    lengths = np.zeros(len(routes))
    for members, control in batches(routes):
        lengths[members] = np.hypot(*np.moveaxis(np.diff(control, axis=1), 2, 0)).sum(axis=1)
    return lengths


def _in_units(network: Network, layout: Layout) -> tuple[FloatArray, list[FloatArray]]:
    names, connections = network.neurons.names, network.connections
    positions = np.array([layout.positions[name] for name in names], float).reshape(-1, 2)
    ends = [
        (names[source], names[target])
        for source, target in zip(connections.sources.tolist(), connections.targets.tolist(), strict=True)
    ]
    routes = routes_of(network.connection_names, ends, layout)
    second, twins = connections.second, connections.twins
    if twins is not None:  # which run as their twins do
        for index, twin in zip(second.tolist(), twins[second].tolist(), strict=True):
            routes[index] = routes[twin][::-1]
    return positions, routes


def _rooms(network: Network, layout: Layout, scale: float = UNIT) -> dict[int, Rect]:
    """What labels cover for which the layout kept room, by neuron, in its units, in a picture of this scale."""
    if not layout.labels:
        return {}
    names = network.neurons.names
    sides = [layout.labels.get(name) for name in names]
    larger = size_beside(RADIUS * scale) / scale * UNIT / BESIDE
    room = [(larger * wide, larger * high) for wide, high in label_room(network)]
    rects = label_rects([layout.positions[name] for name in names], room, sides)
    return {index: rect for index, rect in enumerate(rects) if rect is not None}


def _extent(
    positions: FloatArray,
    radii: FloatArray,
    routes: Sequence[FloatArray],
    boxes: Sequence[Box],
    beside: Sequence[tuple[int, Point]],
    rooms: Iterable[Rect],
) -> Rect:
    """What the layout takes up, in its units; the neurons in ``beside`` have labels that reach so far, others have room
    for them."""
    corners = [np.array([rect[:2], rect[2:]]) for rect in (*(box.rect for box in boxes), *rooms)]
    for index, (across, down) in beside:
        x, y = positions[index].tolist()
        corners.append(np.array([(x - across / UNIT, y), (x + across / UNIT, y + down / UNIT)]))
    per_segment = 12 if len(routes) < 5000 else 4
    discs = np.maximum(radii, RADIUS)[:, None]
    around = bounds([positions - discs, positions + discs, *corners, *samples(routes, per_segment)])
    return around if around is not None else (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class _Wanted:
    """What a frame goes by. The picture is at least ``narrowest`` wide, in page units."""

    content: _Content
    gains: Gains
    settings: RenderSettings
    theme: Theme
    narrowest: float

    def margin(self, frame: Frame) -> float:
        """What is left free on either side, so that there is room for the labels of discs at the rim."""
        if not self.settings.labels:
            return MARGIN
        content = self.content
        reach = margin_beside(content.network, RADIUS * frame.scale, frozenset(content.rooms), content.sizes)
        return _EDGE + beyond(content.extent, frame.scale, reach)


@dataclass(frozen=True, slots=True)
class _Framed:
    """The title (None: no header), the legend's entries, the frame in page units, the user units in one of these, and
    what is left free on either side."""

    title: str | None
    items: Sequence[LegendEntry]
    frame: Frame
    unit: float
    margin: float

    @property
    def bottom(self) -> float:
        """Where the legend begins."""
        below = legend.height(self.items, self.frame.width - 2 * MARGIN)
        return self.frame.height - below - (MARGIN if self.items else 4.0)

    def picture(self, notes: int) -> Rect:
        """What the network has of the page, below so many notes."""
        top = _top(self.title, self.frame.width, notes) or 4.0
        return 6.0, top, self.frame.width - 6.0, self.bottom - (8.0 if self.items else 0.0)

    def titled(self, theme: Theme) -> Iterator[Group]:
        """The title, where there is one."""
        if self.title is not None:
            yield Group(title_lines(self.title, self.frame.width, theme), id=_TITLED)

    def around(self, notes: Sequence[str], theme: Theme) -> Iterator[Group]:
        """Title, notes and legend."""
        yield from self.titled(theme)
        if notes:
            yield _noted(notes, self.title, self.frame, theme)
        if self.items:
            yield legend.flow(self.items, self.frame.width - 2 * MARGIN, MARGIN, self.bottom)


def _framed(wanted: _Wanted, widths: FloatArray) -> _Framed:
    """The frame of a picture; no line, of these ``widths``, is wider than the discs in focus. A picture that is part of
    another has the units of that."""
    content, delayed, unit = wanted.content, delays.label_of(wanted.content.network), 1.0
    smallest = float(content.radii[content.seen.focus].min(initial=RADIUS))
    title, items, frame = _frame(wanted, wanted.gains, delayed, MARGIN)
    if not delays.visible(RADIUS * frame.scale):
        delayed = ""
        title, items, frame = _frame(wanted, wanted.gains, delayed, MARGIN)
    margin = wanted.margin(frame)
    for _ in range(2):
        before, unit = unit, 1.0 if wanted.narrowest else unit_for(smallest * frame.scale, widths)
        if (unit, margin) != (before, MARGIN):
            title, items, frame = _frame(wanted, in_pages(wanted.gains, unit), delayed, margin)
    return _Framed(title, items, frame, unit, margin)


def _frame(wanted: _Wanted, gains: Gains, delayed: str, margin: float) -> tuple[str | None, list[LegendEntry], Frame]:
    """The title, the legend's entries, and the frame. In a picture too small for them both go."""
    content, settings, network = wanted.content, wanted.settings, wanted.content.network
    words = settings.title if isinstance(settings.title, str) else network.title or network.name
    title = words if settings.title is not False and words else None
    room = MOST if settings.size is None else settings.size
    items = _explained(wanted, gains, delayed, room) if settings.legend else []
    if title is not None and room[1] < 4 * HEADER:
        title = None
    noted = max((texts.width(note, CAPTION) for note in content.notes), default=0.0)
    across = max(noted, texts.width(title, TITLE, 600) if title is not None else 0.0)

    def footer(width: float) -> float:
        return legend.height(items, width - 2 * MARGIN) + (0.9 * MARGIN if items else 0.0)

    fitting = min(max(legend.widest_row(items, _ROOM - 2 * MARGIN) + 2 * MARGIN, 120.0), _ROOM)
    narrowest = max(fitting, wanted.narrowest)
    for said in dict.fromkeys((title, None)):  # a title that would take most of the picture goes

        def header(width: float, said: str | None = said) -> float:
            return _top(said, width, len(content.notes))

        margins = Margins(min(across, _ROOM - 2 * MARGIN), header, footer, narrowest, margin)
        frame = fit(content.extent, margins, settings.size)
        if said is None or lowered(said, frame.width) <= MOST_TITLE * frame.height:
            break
    return said, items, frame


def _explained(wanted: _Wanted, gains: Gains, delayed: str, room: tuple[float, float]) -> list[LegendEntry]:
    """The entries of the legend; none where these would take too much of such a picture."""
    content, network, (wide, high) = wanted.content, wanted.content.network, room
    contents = legend.Contents(
        signals=content.signals if len(network.connections) else None,
        learns=len(network.changing) > 0,
        teaches=label_of([guide.first for guide in content.guides]) if content.guides else "",
        delays=delayed,
        lesions=bool(content.lesions),
        ends=content.ends,
        styles=content.styles,
        traces=_least_and_most(told_times(network, seconds_of(network))),
        sent_traces=_least_and_most(told_times(network, sent_seconds_of(network))),
        unit=network.dt_unit,
        seen="" if content.near is None else called(network.layout.view),
        pathways=bool(content.said) and wanted.settings.labels,
        bundles=bundles.told(content.network, content.left),
    )
    for brief in (False, True):
        items = legend.entries(contents, gains, wanted.theme, brief=brief)
        widest = max(item.width for item in items)
        if widest <= wide - 2 * MARGIN and legend.height(items, wide - 2 * MARGIN) <= 0.4 * high:
            return items
    return []


def _top(title: str | None, width: float, notes: int) -> float:
    """How high the header is in a picture of this width."""
    titled = 0.0 if title is None else HEADER + lowered(title, width)
    return (titled or (8.0 if notes else 0.0)) + _NOTE_LINE * notes


def _noted(notes: Sequence[str], title: str | None, frame: Frame, theme: Theme) -> Group:
    """What is left out, below the caption."""
    first = (4.0 if title is None else CAPTION_Y + lowered(title, frame.width)) + _NOTE_LINE
    room = frame.width - 2 * MARGIN
    lines = [
        Text((MARGIN, first + _NOTE_LINE * place), texts.shorten(note, CAPTION, room), CAPTION, theme.muted)
        for place, note in enumerate(notes)
    ]
    return Group(tuple(lines), id="notes", title="\n".join(notes))


def _least_and_most(seconds: FloatArray) -> tuple[float, ...]:
    """The shortest and the longest time above 0: one where these are the same, none where there are none."""
    above = seconds[seconds > 0]
    return tuple(sorted({float(above.min()), float(above.max())})) if len(above) else ()


def _ends(drawn: Gathered) -> legend.Ends:
    """Which ends there are: bars where a weight is negative, or may become so by learning, and what synapses say."""
    network, said = drawn.network, signed(drawn.whole)
    weights = drawn.whole.connections.weights.whole()
    kinds = {kind for own in SetEnds(drawn.whole).kinds() for kind in np.unique(drawn.ends(weights, own)).tolist()}
    free = network.changing if drawn.any else np.setdiff1d(network.changing, said)
    if (network.connections.low[free] < 0).any():
        kinds.add(-1)
    return legend.Ends(tuple(kind for kind in (1, -1, 0) if kind in kinds), len(said) > 0)


def _order(network: Network, widths: FloatArray, lines: npt.NDArray[np.bool_]) -> tuple[int, ...]:
    """The ``lines`` that are drawn. Those that can glow come first, so that their glow lies beneath all others; then
    thin ones before thick ones, so that what matters is seen in a dense picture; else as in the network."""
    fixed = np.ones(len(widths), bool)
    fixed[network.changing] = False
    order = np.lexsort((np.arange(len(widths)), np.nan_to_num(widths, posinf=np.inf), fixed))
    return tuple(order[lines[order]].tolist())


def _reaches(network: Network, gains: Gains, widest: float) -> list[float]:
    """How far lines reach from their middle: half their width and a little air; those that learn glow as well."""
    weights = network.connections.weights.whole()
    widths = encoding.line_width(weights, gains.thickness, widest, gains.thickness_compressed)
    reaches = np.maximum(2.5, 0.5 * widths + 1.5)
    reaches[network.changing] = np.maximum(reaches[network.changing], 3.5)
    result: list[float] = reaches.tolist()
    return result


def _dots(lines: Sequence[Line]) -> list[FloatArray]:
    """Points on lines, up to the tips of their heads."""
    found = samples([line.points for line in lines], 24)
    return [np.concatenate([dots, [line.tip]]) for dots, line in zip(found, lines, strict=True)]


def _box_frames(boxes: Sequence[Box], frame: Frame, theme: Theme) -> list[Group]:
    groups = []
    tints = tints_of(theme, sorted({box.name for box in boxes if box.kind == "box"}, key=natural_key))
    for box in boxes:
        x0, y0, x1, y1 = _mapped(box.rect, frame)
        radius = min(10.0, 0.2 * frame.scale)
        fill, line = tints.get(box.name if box.kind == "box" else "", (theme.box_fill, theme.box_line))
        shapes: tuple[Shape, ...] = (Rectangle((x0, y0), x1 - x0, y1 - y0, radius, fill, line, 1.0),)
        if box.sector is not None:
            line_around = tuple((x, y) for x, y in frame.map(np.array(box.sector.outline())).tolist())
            pieces = frame.map(box.sector.pieces()).tolist()
            filled = (Polygon(tuple((x, y) for x, y in corners), fill) for corners in pieces)
            shapes = (*filled, Spline(line_around, line, 1.0))
        groups.append(Group(shapes, id=f"{box.kind}:{box.path}", title=box.path))
    return groups


def _titled(boxes: Sequence[Box], frame: Frame, picture: Rect) -> list[Titled]:
    return [
        Titled(box, _mapped(rect, frame), _room(box, boxes, frame, picture), _foreign(box, boxes, frame))
        for box in boxes
        for rect in (box.rect if box.sector is None else box.sector.outmost(),)
    ]


def _room(box: Box, boxes: Sequence[Box], frame: Frame, picture: Rect) -> Rect:
    """Where a title may stand: within the smallest instance that holds the box, else anywhere."""
    around = [b for b in boxes if b.kind == "instance" and b is not box and set(box.members) <= set(b.members)]
    outer = [b for b in around if b.kind != box.kind or len(b.path) < len(box.path)]
    return _mapped(min(outer, key=lambda b: (len(b.members), -len(b.path))).rect, frame) if outer else picture


def _foreign(box: Box, boxes: Sequence[Box], frame: Frame) -> tuple[Rect, ...]:
    """The frames that do not hold a box, but for sectors, which do not fill their rectangles."""
    within = set(box.members)
    others = (other for other in boxes if other.sector is None and not within <= set(other.members))
    return tuple(_mapped(other.rect, frame) for other in others)


def _mapped(rect: Rect, frame: Frame) -> Rect:
    (x0, y0), (x1, y1) = frame.map(np.array([rect[:2], rect[2:]])).tolist()
    return x0, y0, x1, y1


def _titled_groups(network: Network, boxes: Sequence[Box]) -> frozenset[str]:
    """The groups that are all of a box, whose title is their name."""
    held = {tuple(sorted(box.members)) for box in boxes}
    return frozenset(group.name for group in network.neurons.groups if tuple(group.indices) in held)


def _bundle_groups(
    content: _Content, left: bundles.Bundles, theme: Theme, step: int
) -> tuple[list[Group], list[Group]]:
    """Bundles beneath the lines, and above these, with the names of hubs."""
    gone = frozenset(connection for connection, at in content.lesions.connections.items() if at <= step)
    lone, joined = (
        [bundles.drawn(content.network, one, theme, step, gone) for one in left.all if one.lone is alone]
        for alone in (True, False)
    )
    return lone, [*joined, *([Group(left.names, id="hubs")] if left.names else [])]


def _dotted_groups(content: _Content, page: _OnPage, theme: Theme, *, many: bool) -> list[Group]:
    """The dotted lines of pairs, or those of ``many``."""
    groups, neurons = [], content.network.neurons
    group = [one.name for one in neurons.groups for _ in one.indices]
    for guide, line in zip(content.guides, page.guides, strict=True):
        if (guide.count > 1) is not many:
            continue
        first = guide.first
        source, target = (
            neurons.names[some[0]] if len(some) == 1 else group[some[0]] for some in (guide.sources, guide.targets)
        )
        count = f" · {guide.count:,}" if many else ""
        taught_by = f"{source}.{first.state}" if first.state else source
        words = f"{source} ⇢ {target}{count}\n{taught_by} is the {first.signal} of {first.rule}"
        width = 1.6 if line.head > 5 else 0.9
        head = Arrowhead(line.tip, line.direction, 0.8 * line.head, head_half_width(0.6, 0.8 * line.head), theme.muted)
        dots_ = Spline(line.points, theme.muted, width, dash(width))
        data = {"signal": f"{source} -> {target}"} | ({"count": str(guide.count)} if many else {})
        which = f":{first.rule}.{first.signal}.{first.state}" if many else ""
        groups.append(Group((dots_, head), f"signal:{source} -> {target}{which}", data, words))
    return groups
