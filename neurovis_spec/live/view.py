"""The view: how a network is drawn live, the same picture as ``render`` makes of a step.

In: a compiled network, its gains, a theme. Out: a View: its plan, all that stays as a page gets it, and for each step a
Glance: colours, widths and glows as small numbers, as fine as can be seen (Eqs. 2–5).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compilation import Compilation
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import SPIKE, SYNAPSE
from neurovis_spec.layout.model import RADIUS, Layout
from neurovis_spec.layout.problem import in_direction
from neurovis_spec.live.beside import Beside
from neurovis_spec.live.commands import AS_IT_IS, Appearance
from neurovis_spec.live.curves import Curves, curves_of
from neurovis_spec.live.declared import declared, words_of
from neurovis_spec.live.drawing import Moved, content, moved
from neurovis_spec.live.history import Members
from neurovis_spec.live.source import Mask, Seen
from neurovis_spec.live.sums import ENDS, SumArray, Sums
from neurovis_spec.live.weights import ranges_of
from neurovis_spec.live.windows import window_of
from neurovis_spec.runtime.quantities import Glyphs, Listed, Quantities
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.scene import Scene, bundles
from neurovis_spec.scene.caption import caption
from neurovis_spec.scene.collapse import Gathered, gathered
from neurovis_spec.scene.encode import looks, paint, tooltips
from neurovis_spec.scene.gains import Gains, Scale
from neurovis_spec.scene.gathered_layout import standing
from neurovis_spec.scene.legend_scales import nice_weights
from neurovis_spec.scene.matrix import order_of
from neurovis_spec.scene.pathway_words import told
from neurovis_spec.scene.pathways import Pathway
from neurovis_spec.scene.plan import Plan, plan, retitled
from neurovis_spec.themes import THEMES

#: A colour value of 1 as a number: between neighbours lie less than 1.2 of 255 levels of a colour.
LEVELS = 127
#: The colour value of a neuron whose activity is no finite number.
_NO_LEVEL = -LEVELS - 1
#: Widths are counted in these parts of a user unit, up to what 16 bits hold.
FINENESS, _WIDEST = 16, (1 << 16) - 1
#: The most rows of a raster; of more neurons several share one.
RASTER_ROWS = 64
#: Bits of a kind: a line that ends in no arrow, what is lesioned, a connection that inhibits, as its synapse or its
#: negative weight says, a clamped neuron, a neuron whose activity is no finite number.
BAR, FAINT, NEGATIVE, CLAMPED, UNDEFINED = 1, 2, 4, 4, 8
#: Errors, inputs, measures and sensors have their number with the place of their kind here above so many bits.
KINDS, KIND = "?eims", 28
#: The higher bits of the kind of a line hold the size of its weight, from 0 to SHARES, the largest of its scale.
SHARES, _SHARE = 31, 8


@dataclass(frozen=True, slots=True, eq=False)
class Glance:
    """What a step looks like: colour values of discs (n,) and lines (m,); widths and glow widths (m,); and ``kinds``
    (m + n,): of each connection, then of each neuron, BAR where its line ends in a bar, or, where it is not NEGATIVE,
    in nothing, FAINT where it is lesioned, of a line NEGATIVE where its weight is, or its synapse says so, and in the
    higher bits how large the weight is; of a neuron CLAMPED where it is, and
    UNDEFINED where its activity is no finite number. ``pose`` is that of the body, and ``told`` what moves it, no
    numbers where there is none; ``sums`` are those of bundles, but for single connections."""

    step: int
    caption: str
    discs: npt.NDArray[np.int8]
    lines: npt.NDArray[np.int8]
    widths: npt.NDArray[np.uint16]
    glows: npt.NDArray[np.uint16]
    kinds: npt.NDArray[np.uint8]
    pose: npt.NDArray[np.float32]
    told: npt.NDArray[np.float32]
    sums: SumArray


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """How a network is drawn: ``drawn`` is what stands for it, where parts of it are collapsed."""

    drawn: Gathered
    gains: Gains
    plan: Plan
    #: of each line, the largest weight that there is on its scale, of compressed ones its square root
    largest: FloatArray
    layout: Layout
    #: all that stays, as a page gets it
    content: bytes
    appearance: Appearance
    #: the same network, drawn otherwise
    otherwise: Callable[[Appearance], View]
    #: whether the spec, or who shows it, asks for its theme; the same picture in the theme of another name
    themed: bool
    dress: Callable[[str], View]
    #: what can be asked for by a name, and the names of what is drawn
    quantities: Quantities
    listed: Listed
    #: what a page shows the course of from the beginning
    curves: Curves
    #: where inputs and sensors stand
    beside: Beside
    #: what stays of a picture of the same network in which more changes, at least so wide (page units)
    planned: Callable[[Network, float], tuple[Gathered, Plan]]
    #: of the bundles that stand for several connections
    sums: Sums

    def dressed(self, theme: str) -> View:
        """The same picture in a theme of ours, "": in its own."""
        return self if not theme or self.plan.theme == THEMES[theme] else self.dress(theme)

    def glance(self, seen: Seen) -> Glance:
        """What a step looks like."""
        whole, drawn = seen.snapshot, self.drawn
        snapshot = drawn.snapshot(whole)
        ends = drawn.ends(whole.weights, whole.ends)
        shown = looks(drawn.network, snapshot, self.gains, self.plan.frame.widest, drawn.signals(whole), ends)
        words = self.plan.caption_shape(caption(drawn.whole, whole.step, whole.activity))
        lost_neurons, lost = self._lost(seen)
        neurons, lines = lost_neurons == self.drawn.sizes, lost == self.drawn.counts
        headless = ends <= 0  # a bar, or nothing, which is a bar of what is not negative
        of_lines = headless * BAR + lines * FAINT + (ends < 0) * NEGATIVE + self._shares(snapshot.weights) * _SHARE
        clamped, undefined = self._all(seen.clamped), ~np.isfinite(snapshot.told)
        of_neurons = neurons * FAINT + clamped * CLAMPED + undefined * UNDEFINED
        return Glance(
            step=snapshot.step,
            caption="" if words is None else words.text,
            discs=_levels(shown.discs),
            lines=_levels(shown.lines),
            widths=_parts(shown.widths),
            glows=_parts(shown.glows),
            kinds=np.concatenate([of_lines, of_neurons]).astype(np.uint8),
            pose=_short(whole.pose),
            told=_short(whole.commands),
            sums=self.sums.at(snapshot.weights, ends, lost),
        )

    def added(self, seen: Seen, sums: Sums) -> SumArray:
        """What some connections add up to at a step."""
        weights = self.drawn.snapshot(seen.snapshot).weights
        ends = self.drawn.ends(seen.snapshot.weights, seen.snapshot.ends)
        return sums.at(weights, ends, self._lost(seen)[1])

    def _shares(self, weights: FloatArray) -> npt.NDArray[np.int64]:
        """How large weights are, as parts of the largest of their scale; none is 0 that is not."""
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            parts = np.nan_to_num(
                np.ceil(SHARES * self.gains.thickened(weights) / self.largest), nan=0.0, posinf=SHARES
            )
        result: npt.NDArray[np.int64] = np.minimum(parts, SHARES).astype(np.int64)
        return result

    def values(self, seen: Seen, items: Iterable[str], quantities: FloatArray | None = None) -> dict[str, float]:
        """Exact activities, or states that are shown (``n3``), weights (``c5``), ``quantities`` (``c5.g``) and errors
        (``e0``) at a step, by these ids; unknown ones are left out, and quantities of which nothing is known. Inputs
        (``i0``) and sensors (``s0``) are among the quantities."""
        snapshot = self.drawn.snapshot(seen.snapshot)
        result = dict[str, float]()
        for item in items:
            key, _, name = item.partition(".")
            values, index = snapshot.told if item[0] == "n" else snapshot.weights, int(key[1:])
            if item[0] == "e" and not name:
                for error in self.curves.errors[index : index + 1]:
                    result[item] = float(error.join(seen.snapshot.told[error.read][None])[0])
            elif name or item[0] not in "nc":
                members = None if quantities is None else self.members(item)
                if members is not None and quantities is not None and not members.series:
                    value = float(members.join(quantities[members.read][None])[0])
                    result |= {} if math.isnan(value) else {item: value}
            elif index < len(values):
                result[item] = float(values[index])
        return result

    def members(self, item: str) -> Members | None:
        """What of the network an item stands for (``n3``, ``c5``), what of that has a name (``c5.g``), a number of an
        input (``i0``) or of a sensor (``s0``), or a series: an error (``e0``), a measure (``m0``); None where there is
        none."""
        key, _, name = item.partition(".")
        if item[0] not in "nc":
            return None if name else self._beside_members(item)
        neurons = item[0] == "n"
        members = np.flatnonzero((self.drawn.unit if neurons else self.drawn.bundle) == int(key[1:]))
        if not name:
            found = Members("neurons", members) if neurons else Members("connections", members, "sum")
        else:
            places = self.quantities.places("neuron" if neurons else "connection", name, members)
            found = Members("quantities", places, "sum" if not neurons and name == SYNAPSE.gives else "mean")
        return found if len(found.indices) else None

    def _beside_members(self, item: str) -> Members | None:
        """What stands beside the network."""
        if item[0] in "em":
            return Members.of_series(item) if item[0] == "m" or item in self.curves.series else None
        places = self.beside.places("inputs" if item[0] == "i" else "sensors")[int(item[1:]) :][:1]
        return Members("quantities", places) if len(places) else None

    def raster(self, item: str) -> tuple[tuple[str, ...], tuple[Members, ...]]:
        """Of the groups of the neurons that an item (``n3``) is drawn for those that fire: the names of the first and
        the last, and the spikes of each, or of some neighbours together, in their order; none where nobody fires."""
        whole = self.drawn.whole.neurons
        drawn = np.flatnonzero(self.drawn.unit == int(item[1:]))
        starts = [group.start for group in whole.groups]
        own = [whole.groups[place] for place in np.unique(np.searchsorted(starts, drawn, "right") - 1).tolist()]
        members = np.concatenate([np.zeros(0, np.int64), *(np.asarray(group.indices) for group in own)])
        fires = [block.neurons for block in self.quantities.blocks if block.state == SPIKE]
        firing = members[np.isin(members, np.concatenate([members[:0], *fires]))]
        if not len(firing):
            return (), ()
        rows = np.array_split(firing, min(len(firing), RASTER_ROWS))
        places = (self.quantities.places("neuron", SPIKE, row) for row in rows)
        return (whole.names[firing[0]], whole.names[firing[-1]]), tuple(Members("quantities", of) for of in places)

    def place(self, item: str) -> tuple[int, int]:
        """The number of an item that there is among connections, then neurons, or with its kind in its highest four
        bits; and that of its name among those that the page knows, from 1 on, 0 without one."""
        key, _, name = item.partition(".")
        if item[0] not in "nc":
            return KINDS.index(item[0]) << KIND | int(key[1:]), 0
        index = int(key[1:]) + (0 if item[0] == "c" else len(self.drawn.counts))
        return index, 1 + self.listed.lists[self.listed.of[index]].index(name) if name else 0

    def moved(self, layout: Layout) -> Moved:
        """What stands, and runs, elsewhere in another layout."""
        return moved(self.plan, self.layout, layout)

    def lesioned(self, seen: Seen) -> tuple[Mask, Mask]:
        """Which glyphs and lines are drawn as lesioned: those of which all neurons, or all connections, are."""
        neurons, lines = self._lost(seen)
        return neurons == self.drawn.sizes, lines == self.drawn.counts

    def partly(self, seen: Seen, items: Iterable[str]) -> dict[str, tuple[int, int]]:
        """Of which glyphs and lines, by these ids, some are lesioned and others not: how many, and of how many."""
        if not self.drawn.any or not (seen.lesioned_neurons.any() or seen.lesioned_connections.any()):
            return {}
        neurons, lines = self._lost(seen)
        kinds = {"n": (neurons, self.drawn.sizes), "c": (lines, self.drawn.counts)}
        result = dict[str, tuple[int, int]]()
        for item in items:
            if item[0] in kinds and item[1:].isdigit():
                lost, whole = kinds[item[0]]
                index = int(item[1:])
                if index < len(whole) and 0 < lost[index] < whole[index]:
                    result[item] = int(lost[index]), int(whole[index])
        return result

    def _lost(self, seen: Seen) -> tuple[Mask | IntArray, Mask | IntArray]:
        """How many neurons of each glyph, and connections of each line, are lesioned."""
        drawn = self.drawn
        if not drawn.any:
            return seen.lesioned_neurons, seen.lesioned_connections
        outside = drawn.bundle >= 0
        lines = np.bincount(drawn.bundle[outside], seen.lesioned_connections[outside], len(drawn.counts))
        return self._many(seen.lesioned_neurons), lines.astype(np.int64)

    @property
    def radius(self) -> float:
        """That of the discs of neurons, in page units."""
        return RADIUS * self.plan.frame.scale / self.plan.unit

    def _many(self, neurons: Mask) -> Mask | IntArray:
        """How many such neurons each glyph stands for."""
        drawn = self.drawn
        return np.bincount(drawn.unit, neurons, len(drawn.sizes)).astype(np.int64) if drawn.any else neurons

    def _all(self, neurons: Mask) -> Mask:
        """Which glyphs stand for such neurons and no others."""
        every: Mask = self._many(neurons) == self.drawn.sizes
        return every


def view_of(
    compiled: Compilation,
    gains: Gains,
    theme: str | None = None,
    engine: str | None = None,
    appearance: Appearance = AS_IT_IS,
    layout: Layout | None = None,
    otherwise: Callable[[Appearance], View] | None = None,
    before: View | None = None,
) -> View:
    """How a compiled network is drawn, by default in the layout of an engine. ``gains`` are of what its ``appearance``
    shows, each neuron or each group; ``otherwise`` draws it in another one, by default with the same gains; ``before``
    is how it was drawn with these gains and another title. Raises LayoutRefusalError, RendererError."""
    layout = compiled.placed(engine) if layout is None else layout
    network = in_direction(compiled.network, layout)
    settings = replace(compiled.settings_for(theme), pathways=appearance.pathways)
    drawn, stands = standing(network, layout, settings)
    seen = appearance.gains(gains)
    same = before is not None and before.layout is stands and before.appearance == appearance
    planned = retitled(before.plan, drawn, stands, seen, settings) if before is not None and same else None
    planned = planned or plan(drawn, stands, seen, settings)
    largest = np.ones(len(seen.thickness))
    for scale in seen.thickness_scales:
        largest[seen.on_thickness(scale)] = _largest(scale)
    scene = _scene(drawn, planned, seen)
    rows = order_of(drawn.network, stands, range(len(drawn.network.neurons)))
    written = compiled.spec.render
    themed = theme is not None or (written is not None and written.theme is not None)
    quantities = Quantities(network)
    listed = quantities.listed(Glyphs(drawn.unit, len(drawn.sizes)), Glyphs(drawn.bundle, len(drawn.counts)))
    names = {"named": [list(one) for one in listed.lists], "names": listed.of.tolist() if len(quantities) else []}
    curves = curves_of(drawn)
    beside = Beside(network, len(quantities))
    begins = {
        "boxes": {name: list(one) for name, one in planned.boxes.items()},
        "curves": [asdict(curve) for curve in curves.shown],
        "beside": {"inputs": beside.input_names, "sensors": beside.sensor_names, "words": words_of(network)},
    }
    joined, bands = _bundles(planned)
    by_hand = {**declared(compiled), **ranges_of(drawn)}
    asked = {"themed": themed, "pathways": appearance.pathways, "window": window_of(compiled)}
    more = {**by_hand, **names, **begins, **bands, **asked, "themes": list(THEMES)}
    words = content(drawn.network, scene, rows, _constants(drawn, planned), more)
    otherwise = otherwise or partial(view_of, compiled, gains, theme, engine, layout=layout)
    dress = partial(_dressed, compiled, gains, appearance, layout, otherwise)
    anew = partial(_planned, stands, seen, settings)
    how = appearance, otherwise, themed, dress
    names_of = quantities, listed, curves, beside
    sums = Sums.of(joined, drawn.counts)
    return View(drawn, seen, planned, largest, stands, words, *how, *names_of, anew, sums)


def _constants(drawn: Gathered, planned: Plan) -> dict[str, float]:
    """What the numbers of frames mean, and where the layout stands in the picture: of one in which something is
    collapsed nothing can be put elsewhere."""
    frame = planned.frame
    bar = BAR if planned.theme.ends == "signs" else 0  # a theme may know nothing but arrows
    kinds = {"isBar": bar, "isFaint": FAINT, "isNegative": NEGATIVE, "isClamped": CLAMPED, "isUndefined": UNDEFINED}
    where = {"scale": 0.0 if drawn.any else frame.scale, "left": frame.left, "top": frame.top}
    return {"levels": LEVELS, "fineness": FINENESS, "shares": SHARES, "share": _SHARE, **kinds, **where}


def _dressed(
    compiled: Compilation,
    gains: Gains,
    appearance: Appearance,
    layout: Layout,
    otherwise: Callable[[Appearance], View],
    theme: str,
) -> View:
    return view_of(compiled, gains, theme, appearance=appearance, layout=layout, otherwise=otherwise)


def _bundles(planned: Plan) -> tuple[list[Pathway], dict[str, object]]:
    """The pathways whose sums a page is told, and what it must know of how bundles are drawn."""
    network, left = planned.network, planned.left
    lone = {name: int(one.members[0]) for name, one in left.items() if bundles.is_lone(network, one)}
    joined = {name: one for name, one in left.items() if name not in lone}
    widths = bundles.widths(list(left.values()), len(joined))
    inks = [[bundles.ink(planned.theme, end, alone) for end in ENDS] for alone in (False, True)]
    wide = {"widest": planned.unit * widths.widest, "narrowest": planned.unit * widths.narrowest, "most": widths.most}
    told = {"joined": list(joined), "lone": lone, "inks": inks, **wide, "signs": planned.theme.ends == "signs"}
    return list(joined.values()), {"bundles": told}


def _planned(
    stands: Layout, gains: Gains, settings: RenderSettings, network: Network, narrowest: float
) -> tuple[Gathered, Plan]:
    drawn = gathered(in_direction(network, stands), settings.collapse, settings.pathways)
    return drawn, plan(drawn, stands, gains, settings, narrowest=narrowest)


def _scene(drawn: Gathered, planned: Plan, gains: Gains) -> Scene:
    """All that stays: the picture before anything happens. No line glows, nothing is faint, and tooltips say no values:
    these come with each Glance."""
    network = planned.network
    activity, weights = np.zeros(len(network.neurons)), network.connections.weights.whole()
    shown = looks(network, Snapshot(0, activity, weights, None), gains, planned.frame.widest)
    of_neurons, of_connections = tooltips(network, gains, activity[None], weights[None])
    words = [without_value(text) for text in of_neurons], [without_value(text) for text in of_connections]
    scene = paint(planned, shown, np.zeros(len(shown.lines), bool), caption(network, 0, activity), words, 0)
    groups = tuple(replace(group, opacity=1.0) for group in scene.groups)
    return replace(scene, title=planned.title, groups=groups, told=told(drawn, weights, weights, shown.ends[None]))


def without_value(tooltip: str) -> str:
    """A tooltip without its second line."""
    name, _, more = tooltip.partition("\n")
    return "\n".join([name, *more.split("\n")[1:]])


def _levels(values: npt.NDArray[np.float64]) -> npt.NDArray[np.int8]:
    return np.where(np.isnan(values), _NO_LEVEL, np.rint(np.nan_to_num(values, nan=0.0) * LEVELS)).astype(np.int8)


def _short(numbers: FloatArray | None) -> npt.NDArray[np.float32]:
    """Numbers of a body as a page gets them, none where they are not known; what is too large for it is as good as
    nowhere."""
    with np.errstate(over="ignore"):
        return np.zeros(0, np.float32) if numbers is None else numbers.astype(np.float32)


def _parts(widths: npt.NDArray[np.float64]) -> npt.NDArray[np.uint16]:
    return np.minimum(np.rint(widths * FINENESS), _WIDEST).astype(np.uint16)


def _largest(scale: Scale) -> float:
    """The largest weight on a scale, as it is shown; where what is learned has no bound, that of a line that is about
    as wide as a legend has room for."""
    if math.isfinite(scale.reaches) or not scale.gain:
        return scale.shown(scale.reaches or 1.0)
    return nice_weights(scale.gain)[-1]
