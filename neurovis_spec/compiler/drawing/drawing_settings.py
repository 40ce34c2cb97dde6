"""What a spec says of its picture: the ``layout`` and ``render`` sections, references resolved.

In: nothing; these are values of a Network. Nothing of them changes what the network does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.language.words import TOP, Direction, Viewpoint

#: How many pixels a side of a picture has.
LEAST_SIDE, MOST_SIDE = 64, 16384
#: The most pixels of a picture: 8K is a little less. Its bytes take some 250 MB of memory.
MOST_PIXELS = 1 << 25


@dataclass(frozen=True, slots=True)
class Mirror:
    """Neurons of which the second of each pair is the mirror image of the first, on an axis along the direction.

    ``scope`` is the path of the instance in whose frame the axis lies, empty for the whole; ``instances`` are the paths
    of the instances that were named, if any.
    """

    scope: str
    pairs: tuple[tuple[int, int], ...]
    instances: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Seat:
    """A cell of a plan, or several that are neighbours: from which row and column on, how many of them, and of how many
    in all, empty ones among them."""

    row: int
    column: int
    rows: int
    columns: int
    height: int
    width: int

    def image(self, direction: str) -> Seat:
        """Where the mirror image is: the axis runs along the direction, through the middle of the page."""
        if direction in ("left", "right"):
            return replace(self, row=self.height - self.row - self.rows)
        return replace(self, column=self.width - self.column - self.columns)


@dataclass(frozen=True, slots=True)
class Cell:
    """Neurons that stand together on the page, or in the frame of the instance whose path ``scope`` is, and where."""

    scope: str
    members: tuple[int, ...]
    seat: Seat


@dataclass(frozen=True, slots=True)
class LayoutSettings:
    """The ``layout`` section, references resolved. Pins by neuron index, units of the layout."""

    engine: str = "auto"
    direction: Direction = "down"
    #: whether the author says so
    directed: bool = False
    positions: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    #: neuron indices → row, column, grid, ring, arc
    arrange: tuple[tuple[tuple[int, ...], str], ...] = ()
    boxes: tuple[tuple[str, tuple[int, ...]], ...] = ()
    neuron_spacing: float = 1.0
    rank_spacing: float = 2.0
    #: for each instance with pins of its module: its path, and its pins relative to its origin
    relative: tuple[tuple[str, Mapping[int, tuple[float, float]]], ...] = ()
    #: where instances have their origin, by path; the pins within them are among the positions then
    origins: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    mirrors: tuple[Mirror, ...] = ()
    #: neurons on one line across the direction
    align: tuple[tuple[int, ...], ...] = ()
    #: what stands in which row and column of the page
    plan: tuple[Cell, ...] = ()
    #: an earlier layout, as the spec names it
    file: str | None = None
    #: from where positions of three numbers are seen
    view: Viewpoint = TOP


@dataclass(frozen=True, slots=True)
class Curve:
    """A number of each step: the activity of a neuron, the weight of a connection, a ``state`` of the model of a neuron
    or of a rule or the synapse of a connection, or what an input is given. ``index`` is that of the neuron or of the
    connection, or the place in the vector of all inputs."""

    of: Literal["neuron", "connection", "input"]
    index: int
    state: str = ""


@dataclass(frozen=True, slots=True)
class Panel:
    """A view, and what it shows; None where it shows what it chooses by itself."""

    view: str
    shown: tuple[Curve, ...] | None = None


@dataclass(frozen=True, slots=True)
class StatedGain:
    """A gain that the author states: for the neurons or connections ``members``, which ``name`` refers to (None: for
    all). ``centre`` is what is drawn as 0: the middle of a range of activity."""

    gain: float
    members: tuple[int, ...] | None = None
    name: str = ""
    centre: float = 0.0


@dataclass(frozen=True, slots=True)
class StatedTrace:
    """How long, in seconds, what neurons were is still seen; 0 where it is not."""

    seconds: float
    members: tuple[int, ...]


@dataclass(frozen=True)
class ShownState:
    """A ``state``, or an output, whose value is the colour of the neurons ``members`` in place of their activity;
    ``name`` refers to them."""

    state: str
    members: tuple[int, ...]
    name: str

    @cached_property
    def indices(self) -> IntArray:
        """The members, as an array."""
        return np.array(self.members, np.int64)


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """The ``render`` section. Of the gains a later one goes before an earlier one; what has none gets one from what a
    run reaches."""

    activity: tuple[StatedGain, ...] = ()
    signal: tuple[StatedGain, ...] = ()
    thickness: tuple[StatedGain, ...] = ()
    change: tuple[StatedGain, ...] = ()
    #: a later one goes before an earlier one; of the others those that spike have one
    traces: tuple[StatedTrace, ...] = ()
    #: what colours neurons in place of their activity; no neuron is in two
    show: tuple[ShownState, ...] = ()
    #: the column of the files of edges by whose values lines are solid, dashed, …; "" for none
    style: str = ""
    theme: str = "default"
    #: what the spec changes of it: colours by their names, and ``ends``
    colours: tuple[tuple[str, str], ...] = ()
    size: tuple[int, int] | None = None
    labels: bool = True
    legend: bool = True
    title: bool | str = True
    #: the views of which the picture consists, from top to bottom; none: the network
    figure: tuple[Panel, ...] = ()
    #: how many steps the views over time show; None: all
    window: int | None = None
    #: what is drawn as one glyph each: its name, its neurons
    collapse: tuple[tuple[str, tuple[int, ...]], ...] = ()
    #: whether each group is drawn as one glyph, and what runs from one to another as a line that says what it holds
    pathways: bool = False
    #: connections with less are left out
    min_weight: float | None = None
    #: whether all connections are drawn, however many there are
    full: bool = False
    #: the most connections that are drawn, the weakest left out
    most: int | None = None
    #: what is drawn with all that it is connected to: as written, and its neurons
    focus: tuple[str, tuple[int, ...]] | None = None
    #: what is drawn: the shortest directed paths from the one to the other
    path: tuple[str, tuple[int, ...], tuple[int, ...]] | None = None
