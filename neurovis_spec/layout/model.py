"""What a layout engine is given and what it gives back.

In: nothing; these are the values of the seam. Out: LayoutProblem (structure alone: no activation, no weight's value),
Layout (a position for every neuron, a route for every connection), Capabilities (what an engine says it can
do) and the LayoutEngine protocol. x grows right, y grows down; one unit is the distance between neighbours of a rank;
a neuron's disc is 0.6 across.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol, TypeAlias, get_args, runtime_checkable

from neurovis_spec.compiler.drawing.drawing_settings import Seat as Seat
from neurovis_spec.diagnostics import Diagnostic, Span
from neurovis_spec.progress import Progress

Point: TypeAlias = tuple[float, float]
#: A cubic Bézier spline: 1 + 3k points from the centre of the source to the centre of the target.
Route: TypeAlias = tuple[Point, ...]
Direction = Literal["down", "up", "right", "left"]
DIRECTIONS: tuple[Direction, ...] = ("down", "up", "right", "left")
Arrangement = Literal["row", "column", "grid", "ring", "arc"]
#: Where a label stands, in the picture, that its disc cannot hold.
Side = Literal["right", "left", "below", "above"]
SIDES: tuple[Side, ...] = get_args(Side)
#: Width by height of a page: that of a screen or a slide.
PAGE = 4 / 3
#: A page that takes less than this share with signals from left to right has them so, if it may choose.
TURNED = 0.85
#: Pixels that a picture without a stated size has for the network, beside its margins, title and legend.
ROOM = (1228.0, 720.0)
#: How long an engine may look for fewer crossings.
Effort = Literal["quick", "normal", "best"]
EFFORTS: tuple[Effort, ...] = get_args(Effort)
#: What a drawing may show best: how signals flow, clusters, some neurons that nearly all drive each other, pins of all
#: neurons, where neurons are as data.
Suits = Literal["flow", "clusters", "tangle", "pins", "positions"]

#: Radius of a neuron's disc.
RADIUS = 0.3
#: Coordinates that no pin gives are multiples of this.
GRID = 1 / 1024


@dataclass(frozen=True, slots=True)
class LayoutEdge:
    """A connection. ``name`` is its name in the layout file (``C1 -> K1``, ``C1 -> K1 (2)``)."""

    name: str
    source: int
    target: int
    delay: int
    #: it leads back as well: two connections that are drawn as one line
    symmetric: bool = False

    @property
    def ways(self) -> tuple[tuple[int, int], ...]:
        """From where to where signals run along it: of what is symmetric both ways."""
        there = self.source, self.target
        return (there, there[::-1]) if self.symmetric else (there,)


@dataclass(frozen=True, slots=True)
class LayoutGroup:
    """Neurons declared together, in the order of their numbers or, where these are listed, of their names."""

    name: str
    members: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class LayoutModule:
    """An instance of a module: a frame that nothing foreign enters.

    ``path`` is its name (``left1.knee``); ``parent`` the index of the instance around it, −1 without one; ``members``
    its neurons, those of instances within it included. Instances with the same ``template`` are of one make (the same
    neurons, connections and pins within): they are drawn alike, exactly, up to a mirror; the i-th member of one is
    the i-th member of the other. ``pins`` are relative to the origin of the
    instance, which is free unless ``origin`` says where it is.
    """

    path: str
    module: str
    parent: int
    members: tuple[int, ...]
    template: str
    pins: Mapping[int, Point] = field(default_factory=dict)
    origin: Point | None = None


@dataclass(frozen=True, slots=True)
class LayoutMirror:
    """Pairs of neurons, the second the mirror image of the first on an axis along the direction; ``modules`` are the
    pairs of instances that were named. ``scope`` is the instance in whose frame the axis lies, −1 for the whole."""

    scope: int
    pairs: tuple[tuple[int, int], ...]
    modules: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class LayoutCell:
    """Neurons that stand together in a cell of the page, or in several that are neighbours. ``scope`` is the instance
    whose frame is divided so, −1 for the page."""

    members: tuple[int, ...]
    seat: Seat
    scope: int = -1


@dataclass(frozen=True, slots=True)
class LayoutProblem:
    """What is to be laid out, in canonical order: neurons in the natural order of their names (K2 before K10), edges by
    the natural order of their names, so that the order of the spec cannot show in the result."""

    network: str
    neurons: tuple[str, ...]
    groups: tuple[LayoutGroup, ...]
    edges: tuple[LayoutEdge, ...]
    #: pinned neurons: index to exact position, those that an instance's origin pins among them
    pins: Mapping[int, Point] = field(default_factory=dict)
    direction: Direction = "down"
    #: members, in the order in which the author lists them, and how they are to be arranged
    arrange: tuple[tuple[tuple[int, ...], Arrangement], ...] = ()
    #: named frames and their members
    boxes: tuple[tuple[str, tuple[int, ...]], ...] = ()
    neuron_spacing: float = 1.0
    rank_spacing: float = 2.0
    #: width by height that the drawing is to come near to; None where the author has not said
    aspect: float | None = None
    #: whether nobody says the direction
    turnable: bool = False
    #: where signals enter and leave the network: a hint on what comes first in a loop
    entries: tuple[int, ...] = ()
    exits: tuple[int, ...] = ()
    #: of what is drawn as a frame: the neurons that something outside of it drives, and those that drive such
    inward: tuple[int, ...] = ()
    outward: tuple[int, ...] = ()
    #: instances of modules, in the natural order of their paths: an instance before those within it
    modules: tuple[LayoutModule, ...] = ()
    mirrors: tuple[LayoutMirror, ...] = ()
    #: neurons on one line across the direction
    align: tuple[tuple[int, ...], ...] = ()
    #: what stands in which row and column of the page, or of an instance, whatever the direction; in none of these is a
    #: neuron in two cells
    plan: tuple[LayoutCell, ...] = ()
    #: where neurons are as data (a body, a connectome); NaN where that is not known
    places: tuple[Point, ...] = ()
    #: how wide and high the label of each neuron is beside its disc, (0, 0) where this holds it; none where all do
    labels: tuple[Point, ...] = ()
    #: how wide the title is of the frame that is drawn around all of this; 0 for none
    title: float = 0.0
    #: an earlier layout of the same network: memory, not pins
    memory: Layout | None = None
    effort: Effort = "normal"

    def reading(self) -> tuple[int, ...]:
        """The place of each neuron in the order in which they are read: that of their names, but the neurons of a group
        have their places in the order of the group."""
        place = list(range(len(self.neurons)))
        for group in self.groups:
            for member, at in zip(group.members, sorted(group.members), strict=True):
                place[member] = at
        return tuple(place)

    @property
    def turns(self) -> bool:
        """Whether the page may choose the direction: one is asked for, and nothing that the author says, and no earlier
        layout, holds by the one that there is."""
        held = self.pins or self.arrange or self.mirrors or self.align or self.plan or self.memory is not None
        held = held or any(module.pins or module.origin is not None for module in self.modules)
        return self.turnable and self.aspect is not None and not held

    @property
    def page(self) -> float:
        """Width by height of the page."""
        return PAGE if self.aspect is None else self.aspect

    def disc(self, size: Point) -> float:
        """The radius of discs in pixels, about, in a drawing of this width and height (layout units) that fills the
        default page, or one as large of the shape that the author says."""
        turned = 1.0 if self.aspect is None else math.sqrt(self.aspect * ROOM[1] / ROOM[0])
        return RADIUS * min(ROOM[0] * turned / max(size[0], 1.0), ROOM[1] / turned / max(size[1], 1.0))


@dataclass(frozen=True, slots=True)
class Layout:
    """Where everything is: positions by neuron name, routes by connection name, neurons in natural order; on which side
    of its disc a label stands for which room was kept there, by neuron name; the ``direction`` where the page
    chose it."""

    network: str
    engine: str
    positions: Mapping[str, Point]
    routes: Mapping[str, Route]
    labels: Mapping[str, Side] = field(default_factory=dict)
    direction: Direction | None = None

    @property
    def sides(self) -> tuple[float, float]:
        """How wide and high all of it is, with its discs."""
        points = [*self.positions.values(), *(point for route in self.routes.values() for point in route)]
        wide, high = (
            (max(ends) - min(ends) + 2 * RADIUS for ends in zip(*points, strict=True)) if points else (0.0, 0.0)
        )
        return wide, high

    def __repr__(self) -> str:
        sizes = f"{len(self.positions):,} positions, {len(self.routes):,} routes"
        return f"<layout of {self.network} by {self.engine}: {sizes}>"


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What an engine can do. What a spec asks for beyond it is refused before the engine starts."""

    pins: bool = False
    #: lays out what is not pinned (an engine without it needs every position)
    free: bool = True
    #: draws what is not pinned where its ``position`` says, and what has none beside what it is connected to (it needs
    #: one that has a place)
    places: bool = False
    arrange: bool = False
    boxes: bool = False
    direction: bool = False
    #: draws instances as frames, those of one template alike
    modules: bool = False
    mirrors: bool = False
    align: bool = False
    #: puts what the author says into rows and columns of the page
    plan: bool = False
    #: keeps what it can of an earlier layout
    memory: bool = False
    #: draws boxes as frames, into which nothing else comes
    frames: bool = False
    #: says what it would refuse, and routes nothing for it: ``check`` takes a problem (CheckingEngine)
    checks: bool = False
    #: says how large its drawing will be before it routes anything: ``size`` takes a problem (SizingEngine)
    sizes: bool = False
    #: what it shows best, of which ``auto`` takes the first engine by name
    suits: Suits | None = None
    #: says how far it is: ``lay_out`` takes a Progress as its second argument (ReportingEngine)
    progress: bool = False
    #: most neurons and most connections
    neurons: int = 1_000_000
    edges: int = 10_000_000


@runtime_checkable
class LayoutEngine(Protocol):
    """An engine, found through the entry point group ``neurovis.layouts`` (the entry point names a class that is called
    without arguments)."""

    name: str
    capabilities: Capabilities

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place every neuron once and route every edge. Deterministic. Raises ``LayoutRefusalError`` for a problem
        that cannot be solved as asked."""
        ...


class ReportingEngine(LayoutEngine, Protocol):
    """An engine that takes its time, and says how far it is; it declares ``progress``."""

    def lay_out(self, problem: LayoutProblem, progress: Progress | None = None) -> Layout:
        """As LayoutEngine's; ``progress`` is called now and then."""
        ...


class CheckingEngine(LayoutEngine, Protocol):
    """An engine that refuses some pins where it finds that they leave no room; it declares ``checks``."""

    def check(self, problem: LayoutProblem) -> None:
        """Raises the LayoutRefusalError that ``lay_out`` would."""
        ...


class SizingEngine(LayoutEngine, Protocol):
    """An engine that knows how large its drawing will be before it routes anything; it declares ``sizes``."""

    def size(self, problem: LayoutProblem) -> Point:
        """Width and height of the picture of a problem that it draws, in units of the layout."""
        ...


def effort_of(text: str) -> Effort:
    """Raises ValueError where there is no such effort."""
    for effort in EFFORTS:
        if effort == text:
            return effort
    raise ValueError(f"'effort' is quick, normal or best, not {text!r}")


class LayoutRefusalError(Exception):
    """An engine cannot do what is asked. ``code`` is a finding's code, the text is for the author; ``about`` are the
    neurons that it speaks of. Who knows the spec adds the finding, with its place, and the texts read."""

    def __init__(self, code: str, message: str, hint: str | None = None, about: tuple[str, ...] = ()) -> None:
        self.code = code
        self.hint = hint
        self.about = about
        self.diagnostic: Diagnostic | None = None
        self.sources: Mapping[str, str] = {}
        super().__init__(message)

    def locate(self, span: Span, sources: Mapping[str, str]) -> None:
        """Say where the spec asks for what is refused."""
        self.diagnostic = Diagnostic(self.code, str(self), span, "error", self.hint)
        self.sources = sources
