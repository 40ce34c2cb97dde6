"""Shown: which neurons and connections a picture draws, and what it says of those that it leaves out.

In: a network, what the author or the reader asks to see, how long lines are. Out: Shown. What is drawn looks the same
as in the whole picture; the rest is left out, and neurons out of focus are small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.scene import texts
from neurovis_spec.scene.heading import CAPTION
from neurovis_spec.scene.renderers import RendererError
from neurovis_spec.scene.thinned import bare, losses, thinned

BoolArray = npt.NDArray[np.bool_]

#: With more connections than this nobody can follow one, and the weakest are left out.
_ALL = 2500
#: Then so many are drawn, or so many a neuron where there are many of these; of more than the last a picture shows
#: nothing.
_MOST_LINES, _LINES_EACH, _MOST_OF_ALL = 1000, 2, 5000
#: How wide a note is at most that could be two, in page units.
_ROOM = 780.0


class LeftOut(UserWarning):
    """What a picture leaves out, as a warning for callers that do not look at its notes."""

    prefix = "note"


@dataclass(frozen=True, slots=True)
class Shown:
    """``lines`` (m,) are drawn; neurons that are not in ``focus`` (n,) are small and have no label; ``notes`` are lines
    of text that say so."""

    lines: BoolArray
    focus: BoolArray
    notes: tuple[str, ...]


def shown(network: Network, settings: RenderSettings, weights: FloatArray, lengths: FloatArray) -> Shown:
    """What is drawn of a network. ``weights`` (m,) are the largest magnitudes of its weights in what is drawn,
    ``lengths`` those of its routes. Raises RendererError."""
    lines, focus = np.ones(len(network.connections), bool), np.ones(len(network.neurons), bool)
    notes: list[str] = []
    if settings.focus is not None:
        name, members = settings.focus
        lines, focus, words = _focused(network, name, np.array(members, np.int64))
        notes.append(words)
    if settings.path is not None:
        name, sources, targets = settings.path
        lines, focus, words = _paths(network, name, np.array(sources, np.int64), np.array(targets, np.int64))
        notes.append(words)
    if settings.min_weight is not None:
        few = lines & (weights < settings.min_weight)
        if few.any():
            least = texts.number(settings.min_weight)
            notes.append(f"{_left_out(int(few.sum()), int(lines.sum()))}: those with |w| < {least}")
        lines = lines & ~few
    most = _most(network, settings)
    if most is not None and int(lines.sum()) > most:
        before, lines = lines, thinned(network, lines, weights, lengths, most)
        why = "to keep the file below 5 MB" if settings.most is not None else "to keep the rest readable"
        notes += _thinned_out(network, before, lines, why)
    return Shown(lines, focus, tuple(notes))


def check_path(network: Network, settings: RenderSettings) -> None:
    """Raise RendererError where the path that is asked for is none."""
    if settings.path is not None:
        name, sources, targets = settings.path
        _paths(network, name, np.array(sources, np.int64), np.array(targets, np.int64))


def _most(network: Network, settings: RenderSettings) -> int | None:
    """The most lines; None where all are wanted."""
    if settings.full:
        return None
    if settings.most is not None or settings.min_weight is not None or settings.focus or settings.path:
        return settings.most
    return (
        None
        if len(network.connections) <= _ALL
        else min(max(_MOST_LINES, _LINES_EACH * len(network.neurons)), _MOST_OF_ALL)
    )


def _left_out(count: int, of: int) -> str:
    return f"{count:,} of {of:,} connections are left out"


def _thinned_out(network: Network, before: BoolArray, lines: BoolArray, why: str) -> list[str]:
    """What is said where these lines stay of those before."""
    few = _left_out(int(before.sum() - lines.sum()), int(before.sum()))
    bared = zip(bare(network, before, lines), ("neuron", "pathway"), strict=True)
    gone = " and ".join(_count(number, what) for number, what in bared if number)
    gone = f", and all of {gone}" if gone else ""
    notes = [f"{few}, the weakest that arrive at each neuron{gone}, {why}; all: --full"]
    for lost in losses(network, before, lines):
        longer = f"{notes[-1]}, {lost}"
        if len(notes) > 1 and texts.width(longer, CAPTION) <= _ROOM:
            notes[-1] = longer
        else:
            notes.append(f"left out: {lost}")
    return notes


def _focused(network: Network, name: str, members: IntArray) -> tuple[BoolArray, BoolArray, str]:
    """Neurons with all that drives them or is driven by them."""
    connections = network.connections
    chosen = np.zeros(len(network.neurons), bool)
    chosen[members] = True
    into, out = chosen[connections.targets.whole()], chosen[connections.sources.whole()]
    lines, focus = into | out, chosen.copy()
    sources = np.unique(connections.sources[into & ~out])
    targets = np.unique(connections.targets[out & ~into])
    focus[sources] = focus[targets] = True
    parts = [_count(len(sources), "source"), _count(len(targets), "target")]
    return lines, focus, f"focus on {name}: {parts[0]}, {parts[1]}; {_rest(focus)}"


def _paths(network: Network, name: str, sources: IntArray, targets: IntArray) -> tuple[BoolArray, BoolArray, str]:
    """All shortest directed paths to each of ``targets`` from the nearest of ``sources``, of at least one connection.
    Raises RendererError where none of them is reached."""
    connections = network.connections
    begin, end = connections.sources.whole(), connections.targets.whole()
    far = np.full(len(network.neurons), -1, np.int64)  # connections from the nearest source
    reached = np.zeros(len(network.neurons), bool)
    reached[sources] = True
    steps = 0
    while reached.any():
        steps += 1
        ahead = np.unique(end[reached[begin]])
        fresh = ahead[far[ahead] < 0]
        far[fresh] = steps
        reached = np.zeros(len(far), bool)
        reached[fresh] = True
    there = targets[far[targets] > 0]
    if not len(there):
        back = _paths_lead(network, targets, sources)
        hint = "there is one the other way round" if back else "nothing leads there; --focus shows what a neuron drives"
        raise RendererError(f"there is no path {name}", hint)
    starts = np.zeros(len(far), bool)
    starts[sources] = True
    lines, focus = np.zeros(len(begin), bool), np.zeros(len(far), bool)
    front = np.zeros(len(far), bool)
    for step in range(int(far[there].max()), 0, -1):
        front[there[far[there] == step]] = True
        focus |= front
        own = front[end] & (starts[begin] if step == 1 else (far[begin] == step - 1))
        lines |= own
        front = np.zeros(len(far), bool)
        front[begin[own]] = True
    focus |= front
    lengths = sorted({int(step) for step in far[there].tolist()})
    long = f"{lengths[0]}" if len(lengths) == 1 else f"{lengths[0]} to {lengths[-1]}"
    plural = "" if lengths == [1] else "s"
    words = f"shortest paths {name.replace('->', '→')}: {long} connection{plural} long; {_rest(focus)}"
    return lines, focus, words


def _paths_lead(network: Network, sources: IntArray, targets: IntArray) -> bool:
    """Whether any of the targets is reached from the sources."""
    begin, end = network.connections.sources.whole(), network.connections.targets.whole()
    seen = np.zeros(len(network.neurons), bool)
    front = np.zeros(len(seen), bool)
    front[sources] = True
    while front.any():
        ahead = np.zeros(len(seen), bool)
        ahead[end[front[begin]]] = True
        front = ahead & ~seen
        seen |= ahead
    return bool(seen[targets].any())


def _rest(focus: BoolArray) -> str:
    return f"{_count(int((~focus).sum()), 'other neuron')} small, without connections"


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"
