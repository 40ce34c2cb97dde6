"""Views: what a page is made of: the network, its matrix, traces, a raster, weights, its body, each as a Block.

In: a network, its layout (where a view needs it), the rows of a recording that are shown, Panels. Out: Blocks, which
say how high they are and draw themselves into a Part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.compiler.drawing.drawing_settings import Curve, Panel
from neurovis_spec.compiler.network import Network, StepLength
from neurovis_spec.compiler.program import SPIKE
from neurovis_spec.layout.model import Layout
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene import body, encoding, strips
from neurovis_spec.scene.encode import tooltips
from neurovis_spec.scene.ends import effects_of, ends_of, signed
from neurovis_spec.scene.frame import MARGIN
from neurovis_spec.scene.gains import Gains
from neurovis_spec.scene.gains import Scale as Own
from neurovis_spec.scene.heat import Heat, bands_of
from neurovis_spec.scene.matrix import MatrixCells, order_of
from neurovis_spec.scene.model import Film, Group, Text, Theme
from neurovis_spec.scene.parts import Part
from neurovis_spec.scene.poses import Poses, middles_of, posed_of, start_of
from neurovis_spec.scene.scales import ScaleLabel, scale_of
from neurovis_spec.scene.series import chosen, full_name, kind_of, short_names, values_of
from neurovis_spec.scene.shots import Shots
from neurovis_spec.scene.shown_states import ShownStates
from neurovis_spec.scene.strips import SMALL, Span
from neurovis_spec.scene.texts import number
from neurovis_spec.scene.themes import MOST_DISTINCT
from neurovis_spec.scene.traces import PLOT, Trace, Traces

#: The most curves of a view that names them, and of one that chooses them.
_MOST_NAMED, _MOST_CHOSEN = 4 * MOST_DISTINCT, MOST_DISTINCT
#: Columns of a recording that are compared at a time.
_TOGETHER = 512
#: The share of the weights of a scale that do not go beyond its full colour in a matrix.
_MOST = 0.9


@dataclass(frozen=True)
class BlockSpace:
    """Where a block is drawn: a page of this width, on it the time; plots ``share`` times as high as by themselves,
    the axis of the time beneath them or not; ``prefix`` begins the ids of its groups."""

    width: float
    span: Span
    share: float
    axis: bool
    theme: Theme
    prefix: str


class Block(Protocol):
    """A view, ready to be drawn."""

    @property
    def timed(self) -> bool:
        """Whether it is a view over time."""
        ...

    @property
    def sides(self) -> tuple[float, float]:
        """How much room it needs to the left and to the right of the time."""
        ...

    def heights(self, width: float) -> tuple[float, float]:
        """What of its height cannot change, and what can."""
        ...

    def part(self, place: BlockSpace) -> Part:
        """What it draws."""
        ...


@dataclass(frozen=True)
class Note:
    """A view that has nothing to show says so."""

    words: str
    timed = False
    sides = (0.0, 0.0)

    def heights(self, width: float) -> tuple[float, float]:
        """A line of text."""
        return 22.0, 0.0

    def part(self, place: BlockSpace) -> Part:
        """The words alone."""
        return Part((Group((Text((MARGIN, 15.0), self.words, SMALL, place.theme.muted),)),), 22.0)


@dataclass(frozen=True)
class Curves:
    """Traces or weights."""

    traces: Traces
    timed = True

    @property
    def sides(self) -> tuple[float, float]:
        """Ticks to the left, names to the right."""
        return self.traces.left, self.traces.right

    def heights(self, width: float) -> tuple[float, float]:
        """Titles, and plots."""
        count = len(self.traces.strips)
        return self.traces.height(0.0), count * PLOT

    def part(self, place: BlockSpace) -> Part:
        """The strips."""
        return self.traces.part(place.span, PLOT * place.share, place.axis, place.theme, place.prefix)


@dataclass(frozen=True)
class Raster:
    """Neurons over time."""

    heat: Heat
    timed = True

    @property
    def sides(self) -> tuple[float, float]:
        """Names to the left."""
        return self.heat.left, 0.0

    def heights(self, width: float) -> tuple[float, float]:
        """A title, and the cells."""
        return self.heat.height(0.0), self.heat.natural

    def part(self, place: BlockSpace) -> Part:
        """The strip."""
        return self.heat.part(place.span, self.heat.natural * place.share, place.axis, place.theme, place.prefix)


@dataclass(frozen=True)
class Grid:
    """The matrix."""

    cells: MatrixCells
    timed = False
    sides = (0.0, 0.0)

    def heights(self, width: float) -> tuple[float, float]:
        """Title and names, and the cells."""
        return self.cells.heights(width - 2 * MARGIN)

    def part(self, place: BlockSpace) -> Part:
        """The cells, as large as there is room."""
        width = place.width - 2 * MARGIN
        fixed, free = self.cells.heights(width)
        return self.cells.part(width, MARGIN, fixed + free * place.share, place.theme, place.prefix)


@dataclass(frozen=True)
class Embodied:
    """The body, from above and from its side."""

    picture: body.BodyPicture
    plot: float = body.PLOT
    timed = False
    sides = (0.0, 0.0)

    def heights(self, width: float) -> tuple[float, float]:
        """Titles and numbers, and the drawings."""
        return self.picture.fixed, self.plot

    def part(self, place: BlockSpace) -> Part:
        """Both drawings."""
        return self.picture.part(MARGIN, place.width - MARGIN, self.plot * place.share, place.theme, place.prefix)


@dataclass(frozen=True)
class Drawing:
    """The picture of the network, which is as large as it was made."""

    film: Film
    timed = False
    sides = (0.0, 0.0)

    def heights(self, width: float) -> tuple[float, float]:
        """None of it changes."""
        return self.film.scene.height, 0.0

    def part(self, place: BlockSpace) -> Part:
        """Its groups; the film itself says how they change."""
        return Part(self.film.scene.groups, self.film.scene.height)


@dataclass(frozen=True)
class Maker:
    """Makes the blocks of a network's views."""

    network: Network
    layout: Layout | None
    shots: Shots
    #: None where no view needs them
    gains: Gains | None
    #: whether the page has a legend
    explained: bool
    #: connections whose weight stays below are left out of a matrix, as they are of the network's picture
    min_weight: float | None = None

    def block(self, panel: Panel) -> Block:
        """A view other than the network's picture. Raises RecordingError where the recording lacks what it shows."""
        match panel.view:
            case "matrix":
                return self._matrix(panel.shown)
            case "raster":
                return self._raster(panel.shown)
            case "body":
                return self._body()
            case _:
                return self._traces(panel)

    def _body(self) -> Block:
        posed = posed_of(self.shots.recording)
        if posed is None:
            return Note("there is no body to show: the recording holds no poses of one")
        skeleton, values = posed
        frames = self.shots.frames
        run = middles_of(skeleton, values), frames
        poses = Poses(skeleton, values[frames], start_of(skeleton, values[0]), run)
        return Embodied(body.BodyPicture(poses))

    def _traces(self, panel: Panel) -> Block:
        named = panel.shown is not None
        curves = tuple(dict.fromkeys(panel.shown if panel.shown is not None else chosen(panel.view, self.network)))
        if not curves:
            return Note("no weight of this network changes" if panel.view == "weights" else "there is nothing to trace")
        most = _MOST_NAMED if named else 2 * _MOST_CHOSEN if panel.view == "weights" else _MOST_CHOSEN
        shown, how = curves[:most], ""
        if len(curves) > most and panel.view == "weights":
            shown, how = self._changing_most(curves, most), ", those that change most"
        words = kind_of(shown)
        if len(curves) > most:
            words += f" · {most} of {len(curves):,}{how}"
        rows, frames = self.shots.rows, self.shots.frames
        traces = []
        names = zip(shown, short_names(shown, self.network), self._fired_beside(shown), strict=True)
        for curve, name, spikes in names:
            values = values_of(curve, self.network, self.shots.recording)
            traces.append(Trace(*name, values[rows], values[frames], full_name(curve, self.network), spikes))
        return Curves(Traces(panel.view, words, tuple(traces)))

    def _fired_beside(self, curves: Sequence[Curve]) -> list[IntArray | None]:
        """Of each curve the steps at which its neuron fires, once for each neuron, and where that is not what the curve
        itself shows; else None."""
        recording, found, marked = self.shots.recording, list[IntArray | None](), set[int]()
        spiking = set() if recording.spiking is None else set(recording.spiking.tolist())
        shown = {index for group in self.network.neurons.groups if group.spikes for index in group.indices}
        for curve in curves:
            itself = curve.state == SPIKE or (not curve.state and curve.index in shown)
            spikes = None
            if curve.of == "neuron" and curve.index in spiking - marked and not itself:
                spikes = recording.spike_steps[recording.spike_neurons == curve.index]
                marked.add(curve.index)
            found.append(spikes)
        return found

    def _changing_most(self, curves: Sequence[Curve], most: int) -> tuple[Curve, ...]:
        """Of weights those that change most in what is shown, in the order given."""
        recording, rows = self.shots.recording, self.shots.rows
        wanted = np.array([curve.index for curve in curves], np.int64)
        far = np.zeros(len(wanted))
        columns = np.searchsorted(recording.plastic, wanted)
        known = np.flatnonzero(columns < recording.weights.shape[1])
        known = known[recording.plastic[columns[known]] == wanted[known]]
        for first in range(0, len(known), _TOGETHER):
            some = known[first : first + _TOGETHER]
            values = recording.weights[rows][:, columns[some]]
            finite = np.isfinite(values)
            high, low = np.where(finite, values, -np.inf).max(axis=0), np.where(finite, values, np.inf).min(axis=0)
            far[some] = np.where(finite.any(axis=0), high / 2 - low / 2, 0.0)
        return tuple(curves[place] for place in sorted(np.argsort(-far, kind="stable")[:most].tolist()))

    def _raster(self, shown: tuple[Curve, ...] | None) -> Block:
        network, recording = self.network, self.shots.recording
        curves = chosen("raster", network) if shown is None else tuple(dict.fromkeys(shown))
        neurons = np.array([curve.index for curve in curves if curve.of == "neuron"], np.int64)
        if not len(neurons):
            return Note("there is no neuron to show")
        recording.check_whole("a raster cannot be drawn from")
        group_of = {index: group.name for group in network.neurons.groups for index in group.indices}
        groups = [group_of[index] for index in neurons.tolist()]
        bands = bands_of(groups), bands_of([group.partition(".")[0] for group in groups])
        rows, gains, states = self.shots.rows, self.gains, ShownStates(network)
        assert gains is not None
        values = states.recorded(recording)

        def colour(some: IntArray) -> FloatArray:
            own = neurons[some]
            return encoding.neuron_colour(values[rows][:, own], gains.activity[own], gains.centre[own])

        spiking, spikes = _spikes(recording, neurons)
        own = set(np.unique(gains.activity[neurons[~spiking]]).tolist())
        used = [(one, 1 / abs(one.gain or 1e-9)) for one in gains.activity_scales if one.gain in own]
        scale = ScaleLabel("") if self.explained else scale_of("", used)
        names = short_names([curve for curve in curves if curve.of == "neuron"], network)
        whose = zip(neurons.tolist(), spiking.tolist(), strict=True)
        told = ["spikes" if fires else states.called[index] or "activity" for index, fires in whose]
        what = ", ".join(dict.fromkeys(told))
        return Raster(Heat(what, colour, spiking, spikes, tuple(names), *bands, scale))

    def _matrix(self, shown: tuple[Curve, ...] | None) -> Block:
        network = self.network
        assert self.layout is not None
        assert self.gains is not None
        ends = network.connections
        connections = np.arange(len(ends))
        if shown is not None:
            connections = np.unique(np.array([curve.index for curve in shown if curve.of == "connection"], np.int64))
        if not len(connections):
            return Note("there is no connection to show")
        everyone = range(len(network.neurons))
        sources = everyone if shown is None else np.unique(ends.sources[connections]).tolist()
        targets = everyone if shown is None else np.unique(ends.targets[connections]).tolist()
        snapshots = list(self.shots.snapshots(network))
        weights = np.stack([snapshot.weights[connections] for snapshot in snapshots])
        title = f"source (rows) × target (columns) · {len(connections):,} connections"
        if self.min_weight is not None:
            strong = ~(np.abs(weights) < self.min_weight).all(axis=0)
            if not strong.all():
                weak = f"{np.count_nonzero(~strong):,} of {len(connections):,} connections"
                title = f"source (rows) × target (columns) · without {weak} with |w| < {number(self.min_weight)}"
            connections, weights = connections[strong], weights[:, strong]
            if not len(connections):
                return Note(f"every |w| is below {number(self.min_weight)}")
        full, compressed, used = _full_at(weights, self.gains, connections)
        every = np.stack([snapshot.weights for snapshot in snapshots])
        ends_at = [ends_of(network, one.weights) if one.ends is None else one.ends for one in snapshots]
        effects = effects_of(network, every, np.stack(ends_at))[:, connections]
        said = len(signed(network)) > 0
        with np.errstate(over="ignore", invalid="ignore"):
            shares = effects / full
            values = np.clip(np.where(compressed, encoding.root(shares), shares), -1.0, 1.0)
        lows, highs = weights.min(axis=0), weights.max(axis=0)
        activity = np.stack([snapshots[0].activity, snapshots[0].activity])
        low, high = (ends.weights.whole().copy() for _ in range(2))
        low[connections], high[connections] = lows, highs
        titles = tooltips(network, self.gains, activity, np.stack([low, high]))[1]
        scale = scale_of("weight (− inhibits)" if said else "weight", used)
        rows, columns = (order_of(network, self.layout, some) for some in (sources, targets))
        return Grid(MatrixCells(network, rows, columns, connections, np.nan_to_num(values), scale, titles, title))


def _spikes(recording: Recording, neurons: IntArray) -> tuple[npt.NDArray[np.bool_], tuple[IntArray, IntArray]]:
    """Which of some neurons spike, and their spikes: steps, and places among these neurons."""
    if recording.spiking is None:
        return np.zeros(len(neurons), np.bool_), (neurons[:0], neurons[:0])
    place = np.full(len(recording.neurons), -1, np.int64)
    place[neurons] = np.arange(len(neurons))
    places = place[recording.spike_neurons]
    own = places >= 0
    return np.isin(neurons, recording.spiking), (recording.spike_steps[own], places[own])


def _full_at(
    weights: FloatArray, gains: Gains, connections: IntArray
) -> tuple[FloatArray, BoolArray, list[tuple[Own, float]]]:
    """The weight at which a cell has its full colour, for each connection and for each scale that some have: what all
    but the strongest of a scale stay below; and which are compressed. Connections share a scale here as they do in
    their thickness."""
    known = np.where(np.isfinite(weights), np.abs(weights), 0.0).max(axis=0)
    full, used = np.ones(len(connections)), list[tuple[Own, float]]()
    for scale in gains.thickness_scales:
        members = gains.on_thickness(scale)[connections]
        own = known[members & (known > 0)]
        if not members.any():
            continue
        reached = float(f"{np.quantile(own, _MOST, method='higher'):.2g}") if len(own) else 1.0
        full[members] = reached
        used.append((scale, reached))
    return full, gains.thickness_compressed[connections], used


def span_of(blocks: Sequence[Block], shots: Shots, width: float, dt: StepLength | None) -> Span:
    """Where the time lies on a page of this width, the same for all views over it."""
    timed = [block.sides for block in blocks if block.timed]
    left = MARGIN + max((one[0] for one in timed), default=0.0)
    right = width - MARGIN - max((one[1] for one in timed), default=0.0)
    steps = shots.recording.step
    return Span(steps[shots.rows], steps[shots.frames], left, max(right, left + 8.0), dt)


#: What the axis of the time adds to the last of several views over it.
AXIS = strips.AXIS
