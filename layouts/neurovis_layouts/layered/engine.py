"""The layered engine: its phases, in the order in which they are carried out.

In: a frame of a network, or a component of what is in it. Out: where everything in it stands. After Sugiyama, Tagawa
and Toda (1981), frame by frame from the inside out (``hierarchy``). A phase takes what those before it have made of a
frame (``frame_layout``) or a component (``component_layout``), and adds something; what is said beside it is when it is
carried out. Every phase is deterministic and computes in plain IEEE arithmetic, so the result is the same everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeAlias, TypeVar

from neurovis_layouts.layered import component_layout as components
from neurovis_layouts.layered import frame_layout as frames
from neurovis_layouts.layered.component_layout import Component, ComponentLayout, RankProblem
from neurovis_layouts.layered.frame_layout import Frame
from neurovis_layouts.layered.frame_routing import Standing

T = TypeVar("T")
#: What is done, and when.
Phases: TypeAlias = tuple[tuple[Callable[[T], T], Callable[[T], object]], ...]


def _always(_: object) -> bool:
    return True


#: A component for which one way of cutting loops is chosen: its ranks, the order in these, and places.
RANKS: Phases[Component] = (
    (components.with_axis, lambda found: found.part.pair),
    (components.with_frames_in_ranks, _always),
)
ORDER: Phases[Component] = (
    (components.with_levels, _always),
    (components.with_rows_interleaved, lambda found: found.folds.ranks),
    (components.with_spines, lambda found: found.columns),
    (components.in_order, lambda found: not found.part.pair),
    (components.in_symmetric_order, lambda found: found.part.pair),
    (components.with_straight_columns, lambda found: found.columns),
    (components.with_crossings, _always),
    (components.with_columns_tied, lambda found: found.columns),
)
PLACES: Phases[Component] = (
    (components.with_reflections, _always),
    (components.with_labels_at_ends, _always),
    (components.with_places, _always),
    (components.with_staggered_ranks, lambda found: not (found.partner or found.columns)),
    (components.with_layers_apart, lambda found: found.uneven),
    (components.with_guests_drawn_in, lambda found: found.part.guests),
    (components.with_neurons, _always),
    (components.with_waypoints, _always),
    (components.in_bands, lambda found: not found.part.pair),
    (components.with_labels, _always),
)


def component(part: RankProblem) -> ComponentLayout:
    """A component in ranks: of all ways of cutting its loops the one that costs least in a draft, and of all rows in
    which its frames may stand."""
    found = [_after(RANKS, one) for one in components.ranked(part)]
    if len(found) > 1:
        found = [min(found, key=lambda one: _after(ORDER, one.draft()).cost())]
    rows = components.with_rows(found[0], lambda one: _after((*ORDER, *PLACES), one.draft()))
    return _after((*ORDER, *PLACES), rows).layout


#: A frame on a page that is divided into rows and columns.
PAGE: Phases[Frame] = (
    (frames.with_page, _always),
    (frames.with_pins, _always),
)
#: Any other, whose units stand in ranks.
FRAME: Phases[Frame] = (
    (frames.with_pieces, _always),
    (frames.with_units, _always),
    (frames.with_rows, _always),
    (frames.with_bonds, _always),
    (partial(frames.with_components, laid_out=component), _always),
    (frames.with_pins, _always),
)


def stands(frame: Frame) -> Standing:
    """Where everything in a frame stands."""
    return _after(PAGE if frame.problem.plan else FRAME, frame).standing()


def _after(phases: Phases[T], found: T) -> T:
    for phase, when in phases:
        if when(found):
            found = phase(found)
    return found
