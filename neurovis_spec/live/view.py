"""The view: how a network is drawn live, the same picture as ``render`` makes of a step.

In: a compiled network, its gains, a theme. Out: a View: its plan, all that stays as a page gets it, and for each step a
Look: colours, widths and glows as small numbers, as fine as can be seen (Eqs. 2–5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.drawing import content
from neurovis_spec.live.source import Seen
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.scene import Scene
from neurovis_spec.scene.caption import caption
from neurovis_spec.scene.encode import looks, paint, tooltips
from neurovis_spec.scene.gains import Gains
from neurovis_spec.scene.plan import Plan, plan

#: A colour value of 1 as a number: between neighbours lie less than 1.2 of 255 levels of a colour.
LEVELS = 127
#: Widths are counted in these parts of a user unit, up to what 16 bits hold.
FINENESS, _WIDEST = 16, (1 << 16) - 1
#: What a connection or a neuron may be besides.
BAR, FAINT = 1, 2


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What a step looks like: colour values of discs (n,) and lines (m,); widths and glow widths (m,); and ``kinds``
    (m + n,): of each connection, then of each neuron, BAR where its line ends in a bar, FAINT where it is lesioned."""

    step: int
    caption: str
    discs: npt.NDArray[np.int8]
    lines: npt.NDArray[np.int8]
    widths: npt.NDArray[np.uint16]
    glows: npt.NDArray[np.uint16]
    kinds: npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """How a network is drawn."""

    network: Network
    gains: Gains
    plan: Plan
    #: all that stays, as a page gets it
    content: bytes

    def look(self, seen: Seen) -> Look:
        """What a step looks like."""
        snapshot = seen.snapshot
        shown = looks(self.network, snapshot, self.gains, self.plan.frame.widest)
        words = self.plan.caption_shape(caption(self.network, snapshot.step, snapshot.activity))
        bars = shown.bars & (self.plan.theme.ends == "signs")
        return Look(
            step=snapshot.step,
            caption="" if words is None else words.text,
            discs=_levels(shown.discs),
            lines=_levels(shown.lines),
            widths=_parts(shown.widths),
            glows=_parts(shown.glows),
            kinds=np.concatenate(
                [bars * BAR + seen.lesioned_connections * FAINT, seen.lesioned_neurons * FAINT]
            ).astype(np.uint8),
        )


def view_of(compiled: CompiledNetwork, gains: Gains, theme: str | None = None, engine: str | None = None) -> View:
    """How a compiled network is drawn. Raises LayoutRefusalError."""
    network = compiled.network
    settings = network.render if theme is None else replace(network.render, theme=theme)
    planned = plan(network, compiled.drawn(engine).value, gains, settings)
    constants = {"levels": LEVELS, "fineness": FINENESS, "isBar": BAR, "isFaint": FAINT}
    return View(network, gains, planned, content(network, _scene(planned), constants))


def _scene(planned: Plan) -> Scene:
    """All that stays: the picture before anything happens. No line glows, nothing is faint, and tooltips say no values:
    these come with each Look."""
    network, gains = planned.network, planned.gains
    activity, weights = np.zeros(len(network.neurons)), network.connections.weights
    shown = looks(network, Snapshot(0, activity, weights, None), gains, planned.frame.widest)
    of_neurons, of_connections = tooltips(network, gains, activity[None], weights[None])
    words = [_without_value(text) for text in of_neurons], [_without_value(text) for text in of_connections]
    scene = paint(planned, shown, np.zeros(len(shown.lines), bool), caption(network, 0, activity), words, 0)
    return replace(scene, title=planned.title, groups=tuple(replace(group, opacity=1.0) for group in scene.groups))


def _without_value(tooltip: str) -> str:
    """A tooltip without its second line."""
    name, _, more = tooltip.partition("\n")
    return "\n".join([name, *more.split("\n")[1:]])


def _levels(values: npt.NDArray[np.float64]) -> npt.NDArray[np.int8]:
    return np.rint(np.nan_to_num(values, nan=0.0) * LEVELS).astype(np.int8)


def _parts(widths: npt.NDArray[np.float64]) -> npt.NDArray[np.uint16]:
    return np.minimum(np.rint(widths * FINENESS), _WIDEST).astype(np.uint16)
