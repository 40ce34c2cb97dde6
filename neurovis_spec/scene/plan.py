"""The plan of a picture: all that does not change from step to step.

In: a network, its layout, gains and settings. Out: a Plan: the frame, discs, lines, boxes, labels, title and legend, in
user units. ``encode`` and ``film`` paint activities and weights on it, so every step of a network
has the same geometry.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.wishes import RenderSettings
from neurovis_spec.layout.model import RADIUS, Layout
from neurovis_spec.scene import delays, encoding, legend, texts
from neurovis_spec.scene.boxes import Box, boxes_of
from neurovis_spec.scene.fading import seconds_of
from neurovis_spec.scene.frame import MARGIN, MOST, UNIT, Frame, Wishes, fit
from neurovis_spec.scene.gains import Gains
from neurovis_spec.scene.geometry import FloatArray, Point, Rect, bounds, samples
from neurovis_spec.scene.heading import HEADER, TITLE, caption_text, title_text
from neurovis_spec.scene.labels import Label, labels_of, room_beside
from neurovis_spec.scene.legend_entry import Entry
from neurovis_spec.scene.lesions import Lesions, lesions_of
from neurovis_spec.scene.lines import Line, routes_of, trimmed
from neurovis_spec.scene.model import Arrowhead, Group, Rectangle, Spline, Text, Theme, head_half_width
from neurovis_spec.scene.obstacles import Obstacles
from neurovis_spec.scene.teachers import Teacher, dash, dotted, label_of, teachers_of
from neurovis_spec.scene.themes import theme_of
from neurovis_spec.scene.titles import Titled, outline, titles_of

#: a picture is made so wide at most to have its legend in few rows, and its whole title
_ROOM = 840.0
#: more dotted lines than this would not be quiet
_MOST_TEACHERS = 200


@dataclass(frozen=True, slots=True)
class Plan:
    """The unchanging part of a picture. ``order``: connection indices from back to front."""

    network: Network
    gains: Gains
    theme: Theme
    title: str
    frame: Frame
    radius: float
    ring: float
    centres: tuple[Point, ...]
    lines: tuple[Line, ...]
    order: tuple[int, ...]
    #: on connections whose signal takes several steps, by index
    beads: Mapping[int, Rectangle]
    #: what events remove, and when
    lesions: Lesions
    labels: tuple[Label | None, ...]
    #: beneath the lines, and above the discs
    back: tuple[Group, ...]
    front: tuple[Group, ...]
    captioned: bool

    def caption_shape(self, words: str) -> Text | None:
        """The line under the title, if there is one."""
        return caption_text(words, self.frame.width, self.theme) if self.captioned else None


def plan(network: Network, layout: Layout, gains: Gains, settings: RenderSettings, narrowest: float = 0.0) -> Plan:
    """Arrange everything that stays the same; without a stated size the picture is at least ``narrowest`` wide. Raises
    KeyError for a theme that does not exist."""
    theme = theme_of(settings)
    positions, routes = _in_units(network, layout)
    boxes = boxes_of(network, positions, routes)
    teachers = teachers_of(network)[:_MOST_TEACHERS]
    beside = room_beside(network, RADIUS * UNIT) if settings.labels else []
    extent = _extent(positions, routes, boxes, beside)
    around = _Around(theme, teachers, extent, narrowest)
    title, items, frame = _frame(network, gains, settings, around, delays.label_of(network))
    if not delays.visible(RADIUS * frame.scale):
        title, items, frame = _frame(network, gains, settings, around, "")
    centres = frame.map(positions)
    radius = RADIUS * frame.scale
    gap, head = min(1.5, 0.1 * radius), _head(radius)
    lines = trimmed([frame.map(route) for route in routes], radius, gap, head)
    obstacles = Obstacles(_dots(lines), _reaches(network, gains, frame.widest), centres, radius)
    dots = [(teacher, dotted(teacher, centres, radius, gap, head, obstacles)) for teacher in teachers]
    for points in _dots([line for _, line in dots]):
        obstacles.add_line(points)
    for box in boxes:
        obstacles.add_frame(outline(_mapped(box.rect, frame)))
    header = _header(title, frame, theme) if title is not None else None
    top = HEADER if header else 4.0
    bottom = frame.height - legend.height(items, frame.width - 2 * MARGIN) - (MARGIN if items else 4.0)
    picture = (6.0, top, frame.width - 6.0, bottom - (8.0 if items else 0.0))
    spots: list[Point] = [(x, y) for x, y in centres.tolist()]
    labels = labels_of(network, spots, radius, obstacles, picture) if settings.labels else [None] * len(spots)
    titles = _box_titles(boxes, frame, obstacles, theme, picture)
    front = [*titles, *([header] if header else [])]
    if items:
        front.append(legend.flow(items, frame.width - 2 * MARGIN, MARGIN, bottom))
    ring = min(2.5, 0.12 * radius)
    return Plan(
        network=network,
        gains=gains,
        theme=theme,
        title=network.title or network.name,
        frame=frame,
        radius=radius - ring / 2,
        ring=ring,
        centres=tuple(spots),
        lines=tuple(lines),
        order=_order(network),
        beads=delays.beads(network, lines, radius, theme),
        lesions=lesions_of(network),
        labels=tuple(labels),
        back=(*_box_frames(boxes, frame, theme), *_dotted_groups(network, dots, theme)),
        front=tuple(front),
        captioned=header is not None,
    )


def _in_units(network: Network, layout: Layout) -> tuple[FloatArray, list[FloatArray]]:
    names, connections = network.neurons.names, network.connections
    positions = np.array([layout.positions[name] for name in names], float).reshape(-1, 2)
    ends = [
        (names[source], names[target])
        for source, target in zip(connections.sources.tolist(), connections.targets.tolist(), strict=True)
    ]
    return positions, routes_of(network.connection_names, ends, layout)


def _extent(
    positions: FloatArray, routes: Sequence[FloatArray], boxes: Sequence[Box], beside: Sequence[tuple[int, Point]]
) -> Rect:
    """What the layout takes up, in its units; the neurons in ``beside`` have labels that reach so far."""
    corners = [np.array([box.rect[:2], box.rect[2:]]) for box in boxes]
    for index, (across, down) in beside:
        x, y = positions[index].tolist()
        corners.append(np.array([(x - across / UNIT, y), (x + across / UNIT, y + down / UNIT)]))
    per_segment = 12 if len(routes) < 5000 else 4
    around = bounds([positions - RADIUS, positions + RADIUS, *corners, *samples(routes, per_segment)])
    return around if around is not None else (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True)
class _Around:
    """What the frame of a picture depends on."""

    theme: Theme
    teachers: list[Teacher]
    extent: Rect
    narrowest: float


def _frame(
    network: Network, gains: Gains, settings: RenderSettings, around: _Around, delayed: str
) -> tuple[str | None, list[Entry], Frame]:
    """The title (None: no header), the legend's entries, and the frame. In a picture too small for them both go."""
    words = settings.title if isinstance(settings.title, str) else network.title or network.name
    title = words if settings.title is not False and words else None
    wide, high = MOST if settings.size is None else settings.size
    items: list[Entry] = []
    if settings.legend:
        contents = legend.Contents(
            lines=len(network.connections) > 0,
            learns=len(network.changing) > 0,
            teaches=label_of(around.teachers) if around.teachers else "",
            delays=delayed,
            lesions=bool(lesions_of(network)),
            inhibits=_inhibits(network),
            traces=_ends_of(seconds_of(network)),
        )
        for brief in (False, True):
            items = legend.entries(contents, gains, around.theme, brief=brief)
            widest = max(item.width for item in items)
            if widest <= wide - 2 * MARGIN and legend.height(items, wide - 2 * MARGIN) <= 0.4 * high:
                break
        else:
            items = []
    if title is not None and high < 4 * HEADER:
        title = None
    header = (texts.width(title, TITLE, 600), HEADER) if title is not None else (0.0, 0.0)

    def footer(width: float) -> float:
        return legend.height(items, width - 2 * MARGIN) + (0.9 * MARGIN if items else 0.0)

    fitting = min(max(legend.widest_row(items, _ROOM - 2 * MARGIN) + 2 * MARGIN, 120.0), _ROOM)
    narrowest = max(fitting, around.narrowest)
    wishes = Wishes((min(header[0], _ROOM - 2 * MARGIN), header[1]), footer, narrowest)
    return title, items, fit(around.extent, wishes, settings.size)


def _ends_of(seconds: FloatArray) -> tuple[float, ...]:
    """The shortest and the longest time above 0: one where these are the same, none where there are none."""
    above = seconds[seconds > 0]
    return tuple(sorted({float(above.min()), float(above.max())})) if len(above) else ()


def _inhibits(network: Network) -> bool:
    """Whether a weight is negative, or may become so by learning."""
    connections, changing = network.connections, network.changing
    return bool((connections.weights < 0).any() or (connections.low[changing] < 0).any())


def _header(title: str, frame: Frame, theme: Theme) -> Group:
    return Group((title_text(title, frame.width, theme),), id="title")


def _order(network: Network) -> tuple[int, ...]:
    """Lines that can glow come first, so that their glow lies beneath all others; then weak ones before strong ones, so
    that what matters is seen in a dense picture; else as in the network."""
    weights = np.nan_to_num(np.abs(network.connections.weights), posinf=np.inf)
    fixed = np.ones(len(weights), bool)
    fixed[network.changing] = False
    order = np.lexsort((np.arange(len(weights)), np.where(fixed, weights, 0.0), fixed))
    return tuple(order.tolist())


def _head(radius: float) -> float:
    """How long heads are: a little longer for their discs where these are small, so that they still can be seen."""
    return min(10.0, max(0.5 * radius, min(6.5, 0.75 * radius)))


def _reaches(network: Network, gains: Gains, widest: float) -> list[float]:
    """How far lines reach from their middle: half their width and a little air; those that learn glow as well."""
    widths = encoding.line_width(network.connections.weights, gains.thickness, widest)
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
    for box in boxes:
        x0, y0, x1, y1 = _mapped(box.rect, frame)
        radius = min(10.0, 0.2 * frame.scale)
        shape = Rectangle((x0, y0), x1 - x0, y1 - y0, radius, theme.box_fill, theme.box_line, 1.0)
        groups.append(Group((shape,), id=f"{box.kind}:{box.path}", title=box.path))
    return groups


def _box_titles(boxes: Sequence[Box], frame: Frame, obstacles: Obstacles, theme: Theme, picture: Rect) -> list[Group]:
    if frame.scale < 12:  # the boxes are smaller than their titles
        return []
    items = [
        Titled(box, _mapped(box.rect, frame), _room(box, boxes, frame, picture), _foreign(box, boxes, frame))
        for box in boxes
    ]
    found = titles_of(items, obstacles, theme)
    return [Group((text,), id=f"title:{box.path}") for box, text in zip(boxes, found, strict=True) if text is not None]


def _room(box: Box, boxes: Sequence[Box], frame: Frame, picture: Rect) -> Rect:
    """Where a title may stand: within the smallest instance that holds the box, else anywhere."""
    around = [b for b in boxes if b.kind == "instance" and b is not box and set(box.members) <= set(b.members)]
    outer = [b for b in around if b.kind != box.kind or len(b.path) < len(box.path)]
    return _mapped(min(outer, key=lambda b: (len(b.members), -len(b.path))).rect, frame) if outer else picture


def _foreign(box: Box, boxes: Sequence[Box], frame: Frame) -> tuple[Rect, ...]:
    """The frames that do not hold a box."""
    within = set(box.members)
    return tuple(_mapped(other.rect, frame) for other in boxes if not within <= set(other.members))


def _mapped(rect: Rect, frame: Frame) -> Rect:
    (x0, y0), (x1, y1) = frame.map(np.array([rect[:2], rect[2:]])).tolist()
    return x0, y0, x1, y1


def _dotted_groups(network: Network, dots: Sequence[tuple[Teacher, Line]], theme: Theme) -> list[Group]:
    names = network.neurons.names
    groups = []
    for teacher, line in dots:
        source, target = names[teacher.source], names[teacher.target]
        words = f"{source} ⇢ {target}\n{source} is the {teacher.signal} of {teacher.rule}"
        width = 1.6 if line.head > 5 else 0.9
        head = Arrowhead(line.tip, line.direction, 0.8 * line.head, head_half_width(0.6, 0.8 * line.head), theme.muted)
        dots_ = Spline(line.points, theme.muted, width, dash(width))
        groups.append(Group((dots_, head), f"signal:{source} -> {target}", {"signal": f"{source} -> {target}"}, words))
    return groups
