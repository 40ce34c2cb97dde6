"""Matrix: source × target as coloured cells, groups and modules in the order of the spec, and marked.

In: a network, positions, the weights of each frame. Out: a Part. A row is what a neuron sends, a column what one takes
in; where there is no connection there is no cell. Cells that change are shapes of their own; of many that stay an image
holds the colours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.labels import parts_of
from neurovis_spec.layout.model import Layout
from neurovis_spec.scene import texts
from neurovis_spec.scene.heat import Band, bands_of
from neurovis_spec.scene.model import Group, Image, Polyline, Rectangle, Shape, Text, Theme
from neurovis_spec.scene.parts import Changes, Part
from neurovis_spec.scene.scales import ScaleLabel
from neurovis_spec.scene.texts import Cut
from neurovis_spec.scene.themes import blend, channels, colours

#: The side of a cell at most, the side of the whole where there is room.
CELL, SIDE = 26.0, 620.0
#: More cells that stay than this become an image.
_MOST_SHAPES = 2_000
#: Cells smaller than this have no name for each.
_NAMED = 9.0
_SIZE, _LABEL, _TITLE_ROOM, _LINE = 11.0, 110.0, 24.0, 16.0
#: Neurons are in a line where none lies so far beside another, in units of the layout.
_LINED = 0.5
#: Lines between the groups of a module are so far apart at least.
_APART = 14.0


@dataclass(frozen=True)
class Order:
    """Neurons (indices) as rows or columns, and the groups and instances that they form: ``levels`` from the outermost
    to the group."""

    neurons: IntArray
    levels: tuple[tuple[Band, ...], ...]

    @property
    def places(self) -> dict[int, int]:
        """Neuron to row."""
        return {index: place for place, index in enumerate(self.neurons.tolist())}


def order_of(network: Network, layout: Layout, wanted: Sequence[int]) -> Order:
    """Groups and instances in the order of the spec, the neurons of a group in that of the layout: along its direction,
    then across; those that are in no line (a ring, a grid) in their own."""
    direction, names = network.layout.direction, network.neurons.names
    sign = -1.0 if direction in ("up", "left") else 1.0
    group_of = {index: group.name for group in network.neurons.groups for index in group.indices}
    paths = {index: tuple(_ways(group_of[index])) for index in wanted}
    at: dict[int, tuple[float, float]] = {}
    of_group: dict[str, list[tuple[float, float]]] = {}
    first: dict[str, int] = {}
    for index in sorted(wanted):
        x, y = layout.positions[names[index]]
        at[index] = (sign * y, x) if direction in ("down", "up") else (sign * x, y)
        of_group.setdefault(group_of[index], []).append(at[index])
        for path in paths[index]:
            first.setdefault(path, index)
    lines = {name for name, places in of_group.items() if np.ptp(places, axis=0).min() < _LINED}

    def key(index: int) -> tuple[list[int], tuple[float, float], int]:
        own = at[index] if group_of[index] in lines else (0.0, 0.0)
        return [first[path] for path in paths[index]], own, index

    ordered = sorted(wanted, key=key)
    depth = max((len(path) for path in paths.values()), default=0)
    levels = [bands_of([(*paths[index], *("",) * depth)[level] for index in ordered]) for level in range(depth)]
    return Order(np.array(ordered, np.int64), tuple(levels))


def _ways(group: str) -> list[str]:
    """A group with the instances around it, outermost first.

    >>> _ways("left1.knee.K")
    ['left1', 'left1.knee', 'left1.knee.K']
    """
    parts = group.split(".")
    return [".".join(parts[: end + 1]) for end in range(len(parts))]


@dataclass(frozen=True)
class MatrixCells:
    """The cells of a matrix: colour values in −1…1 of each connection shown, (frames, k); ``connections`` (k,)."""

    network: Network
    rows: Order
    columns: Order
    connections: IntArray
    values: FloatArray
    scale: ScaleLabel
    titles: Sequence[str]
    title: str

    def cell(self, width: float, height: float) -> float:
        """The side of a cell where the whole may be so wide and so high."""
        left, top = self.margins
        room_x = (width - left) / max(len(self.columns.neurons), 1)
        room_y = (height - top - self._head(width)) / max(len(self.rows.neurons), 1)
        return max(min(CELL, room_x, room_y, SIDE / max(len(self.columns.neurons), 1)), 1e-3)

    @property
    def margins(self) -> tuple[float, float]:
        """How much room the names of rows and of columns take."""
        return _names_room(self.network, self.rows), _names_room(self.network, self.columns)

    def _head(self, width: float) -> float:
        """The title and the scale, below each other where they do not fit side by side."""
        beside = texts.width(self.title, _SIZE) + self.scale.width + 20 <= width
        return _TITLE_ROOM if beside else _TITLE_ROOM + _LINE

    def heights(self, width: float) -> tuple[float, float]:
        """How high title and names are, and the cells where nothing else is asked for."""
        return self._head(width) + self.margins[1] + 8, self.cell(width, 1e9) * len(self.rows.neurons)

    def part(self, width: float, left: float, height: float, theme: Theme, prefix: str) -> Part:
        """The matrix in so much room, from ``left`` on."""
        cell = self.cell(width, height)
        beside, above = self.margins
        across, down = cell * len(self.columns.neurons), cell * len(self.rows.neurons)
        x0 = left + beside + max(0.0, (width - beside - across) / 2 - beside / 2)
        head = self._head(width)
        y0 = head + above
        ground = Rectangle((x0, y0), across, down, 0.0, theme.box_fill, theme.box_line, 1.0)
        title = texts.shorten(self.title, _SIZE, width)
        shapes: list[Shape] = [Text((left, 13), title, _SIZE, theme.muted), ground]
        shapes += self.scale.shapes(left + width, head - 11, theme, width)
        back = Group(tuple(shapes), f"{prefix}ground", {"view": "matrix"})
        cells, changes = self._cells((x0, y0), cell, theme, prefix)
        marks = Group(tuple(self._marks((x0, y0), cell, theme)), f"{prefix}marks")
        return Part((back, *cells, marks), height, changes)

    def _cells(
        self, corner: tuple[float, float], cell: float, theme: Theme, prefix: str
    ) -> tuple[list[Group], Changes]:
        rows, columns = self.rows.places, self.columns.places
        ends, values = self.network.connections, np.nan_to_num(self.values, nan=0.0)
        sources = np.array([rows[index] for index in ends.sources[self.connections].tolist()], np.int64)
        targets = np.array([columns[index] for index in ends.targets[self.connections].tolist()], np.int64)
        pairs, members = np.unique(sources * len(columns) + targets, return_inverse=True)
        summed = np.zeros((len(values), len(pairs)))
        np.add.at(summed.T, members, values.T)
        summed = np.clip(summed, -1.0, 1.0)
        by_pair: dict[int, list[int]] = {}
        for place, pair in enumerate(members.tolist()):
            by_pair.setdefault(pair, []).append(int(self.connections[place]))
        moving = (summed != summed[:1]).any(axis=0)
        names = self.network.neurons.names
        together = int((~moving).sum()) > _MOST_SHAPES
        groups: list[Group] = []
        if together:
            groups.append(self._image(corner, cell, pairs[~moving], summed[0, ~moving], theme, prefix))
        fills = colours(theme, summed[0])
        drawn: list[int] = []
        gap = min(0.6, 0.06 * cell)
        for place, pair in enumerate(pairs.tolist()):
            if together and not moving[place]:
                continue
            row, column = divmod(pair, len(columns))
            at = (corner[0] + column * cell + gap, corner[1] + row * cell + gap)
            shape = Rectangle(at, cell - 2 * gap, cell - 2 * gap, 0.0, fills[place], theme.box_line, 0.0)
            source, target = names[int(self.rows.neurons[row])], names[int(self.columns.neurons[column])]
            data = {"cell": f"{source} -> {target}", "from": source, "to": target}
            said = "\n".join(self.titles[index] for index in by_pair[place])
            groups.append(Group((shape,), f"{prefix}{pair}", data, said))
            drawn.append(place)
        changing = [place for place in drawn if moving[place]]
        fills_of = tuple(f"{prefix}{pairs[place]}" for place in changing)
        return groups, Changes(fills=fills_of, fill_values=summed[:, changing] if changing else None)

    def _image(
        self, corner: tuple[float, float], cell: float, pairs: IntArray, values: FloatArray, theme: Theme, prefix: str
    ) -> Group:
        """Cells that stay, so many that each as a shape would be too much."""
        down, across = len(self.rows.neurons), len(self.columns.neurons)
        cuts = [
            np.unique(np.linspace(0, n, min(n, max(1, int(2 * cell * n))) + 1).astype(np.int64)) for n in (down, across)
        ]
        row, column = (
            np.searchsorted(some, place, "right") - 1
            for some, place in zip(cuts, np.divmod(pairs, across), strict=True)
        )
        shape = len(cuts[0]) - 1, len(cuts[1]) - 1
        pixels = np.tile(np.array(channels(theme.box_fill), np.uint8), (shape[0] * shape[1], 1))
        order = np.argsort(np.abs(values), kind="stable")  # of several in a cell the strongest is put last
        pixels[(row * shape[1] + column)[order]] = blend(theme, values[order])
        extent = cell * across, cell * down
        image = Image(corner, *extent, shape[1], shape[0], pixels.tobytes())
        return Group((image,), f"{prefix}cells", {"cells": str(len(pairs))}, f"{len(pairs):,} connections")

    def _marks(self, corner: tuple[float, float], cell: float, theme: Theme) -> list[Shape]:
        """Lines between groups and modules, and the names of rows and columns."""
        (x0, y0), (across, down) = corner, (cell * len(self.columns.neurons), cell * len(self.rows.neurons))
        shapes: list[Shape] = []
        for order, upright in ((self.rows, False), (self.columns, True)):
            for level in reversed(range(len(order.levels))):
                bands, outer = order.levels[level], level == 0
                if not outer and cell * len(order.neurons) < _APART * len(bands):
                    continue  # lines alone would be seen
                for band in bands[1:]:
                    at = band.start * cell
                    ends = ((x0 + at, y0), (x0 + at, y0 + down)) if upright else ((x0, y0 + at), (x0 + across, y0 + at))
                    shapes.append(Polyline(ends, theme.muted if outer else theme.box_line, 1.2 if outer else 0.8))
            shapes += _names(self.network, order, (x0, y0), cell, upright, theme)
        return shapes


def _leaf_names(network: Network, order: Order) -> list[tuple[str, str]]:
    parts = parts_of(network.neurons)
    return [parts[index] for index in order.neurons.tolist()]


def _small(order: Order) -> bool:
    """Whether there is room for the name of each neuron."""
    return SIDE / max(len(order.neurons), 1) >= _NAMED


def _names_room(network: Network, order: Order) -> float:
    """How far names reach from the matrix."""
    if _small(order):
        widths = [texts.width(base, _SIZE, 400, sub) for base, sub in _leaf_names(network, order)]
        outer = [texts.width(band.name, _SIZE) for band in order.levels[0]] if len(order.levels) > 1 else []
        room = min(max(widths, default=0.0), _LABEL)
        return room + 8 + (_SIZE + 8 if outer else 0.0)
    widths = [texts.width(band.name, _SIZE) for band in _titled(order)]
    return min(max(widths, default=0.0), _LABEL) + 8


def _titled(order: Order) -> tuple[Band, ...]:
    """The bands that are named where neurons are not."""
    return order.levels[0] if order.levels else ()


def _names(
    network: Network, order: Order, corner: tuple[float, float], cell: float, upright: bool, theme: Theme
) -> list[Shape]:
    """Names before rows, or above columns (``upright``), reading upward."""
    shapes: list[Shape] = []
    leaves = _leaf_names(network, order) if _small(order) else []
    cut = Cut([base for base, _ in leaves] or [band.name for band in _titled(order)])

    def put(base: str, subscript: str, middle: float, away: float, size: float) -> None:
        base, subscript = cut.parts(base, subscript, size, _LABEL, 400)
        if upright:
            point = (corner[0] + middle + 0.36 * size, corner[1] - away)
            shapes.append(Text(point, base, size, theme.ink, "start", subscript=subscript, upward=True))
        else:
            point = (corner[0] - away, corner[1] + middle + 0.36 * size)
            shapes.append(Text(point, base, size, theme.ink, "end", subscript=subscript))

    if _small(order) and cell >= 0.75 * _NAMED:
        size = min(_SIZE, 0.9 * cell)
        for place, (base, subscript) in enumerate(leaves):
            put(base, subscript, (place + 0.5) * cell, 6.0, size)
        if len(order.levels) > 1:
            away = _names_room(network, order) - _SIZE
            for band in order.levels[0]:
                length = band.count * cell
                text = texts.shorten(band.name, _SIZE, length)
                middle = (band.start + band.count / 2) * cell
                if not text or band.count < 2:
                    continue
                if upright:
                    point = (corner[0] + middle, corner[1] - away)
                    shapes.append(Text(point, text, _SIZE, theme.muted, "middle", weight=600))
                else:
                    point = (corner[0] - away, corner[1] + middle)
                    shapes.append(Text(point, text, _SIZE, theme.muted, "middle", weight=600, upward=True))
        return shapes
    free = -1e9
    for band in _titled(order):
        middle = (band.start + band.count / 2) * cell
        if middle - _SIZE / 2 >= free:
            put(band.name, "", middle, 6.0, _SIZE)
            free = middle + _SIZE / 2 + 2
    return shapes
