"""Shown: which neurons and connections a picture draws, and what it says of those that it leaves out.

In: a network, what the author or the reader asks to see, how long lines are. Out: Shown. What is drawn looks the same
as in the whole picture; the rest is left out, and neurons out of focus are small. Where there are more lines than a
picture has room for, a line counts as much as it is of all that arrives at its target, so that what is drawn is as much
as can be of what drives each neuron; and a neuron, a pathway (what runs from one group to another) and an entry keep
their strongest. What of a pathway is left out then is drawn as a bundle (``scene/bundles``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.scene import texts
from neurovis_spec.scene.pathways import group_of, numbered
from neurovis_spec.scene.renderers import RendererError

BoolArray = npt.NDArray[np.bool_]

#: With more connections than this nobody can follow one, and the weakest are left out.
_ALL = 2500
#: Then so many are drawn, or so many a neuron where there are many of these, but no more than where all are.
_MOST_LINES, _LINES_EACH = 1000, 2
#: lengths are compared to so many decimals of a layout's unit: what is alike in a picture is so by rounding alone
_DECIMALS = 6


class LeftOut(UserWarning):
    """What a picture leaves out, as a warning for callers that do not look at its notes."""

    prefix = "note"


@dataclass(frozen=True, slots=True)
class Shown:
    """``lines`` (m,) are drawn; for those ``left`` (m,) there is no room; neurons that are not in ``focus`` (n,) are
    small and have no label; ``notes`` are lines of text that say so."""

    lines: BoolArray
    focus: BoolArray
    left: BoolArray
    notes: tuple[str, ...]


def shown(network: Network, settings: RenderSettings, weights: FloatArray, lengths: FloatArray) -> Shown:
    """What is drawn of a network. ``weights`` (m,) are the largest magnitudes of its weights in what is drawn,
    ``lengths`` those of its routes. Raises RendererError."""
    lines, focus = np.ones(len(network.connections), bool), np.ones(len(network.neurons), bool)
    notes: list[str] = []
    left = np.zeros(len(lines), bool)
    if settings.focus is not None:
        name, members = settings.focus
        lines, focus, words = _focused(network, name, np.array(members, np.int64))
        notes.append(words)
    if settings.path is not None:
        name, sources, targets = settings.path
        lines, focus, words = _paths(network, name, np.array(sources, np.int64), np.array(targets, np.int64))
        notes.append(words)
    lines = _once(network, lines)
    if settings.min_weight is not None:
        few = lines & (weights < settings.min_weight)
        if few.any():
            least = texts.number(settings.min_weight)
            notes.append(f"{_left_out(int(few.sum()), int(lines.sum()), settings.pathways)}: those with |w| < {least}")
        lines = lines & ~few
    most = _most(network, settings)
    if most is not None and int(lines.sum()) > most:
        before, lines = lines, thinned(network, lines, weights, lengths, most)
        why = "to keep the file below 5 MB" if settings.most is not None else "to keep the rest readable"
        notes.append(_thinned_out(network, before, lines, why))
        left[network.connections.with_twins(np.flatnonzero(before & ~lines))] = True
    return Shown(lines, focus, left, tuple(notes))


def _once(network: Network, lines: BoolArray) -> BoolArray:
    """Symmetric pairs of which either is to be drawn, by the first of both."""
    second, twins = network.connections.second, network.connections.twins
    if twins is not None:
        lines = lines.copy()
        lines[twins[second]] |= lines[second]
        lines[second] = False
    return lines


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
        if len(network.connections) - len(network.connections.second) <= _ALL
        else min(max(_MOST_LINES, _LINES_EACH * len(network.neurons)), _ALL)
    )


def _left_out(count: int, of: int, pathways: bool = False) -> str:
    return f"{count:,} of {of:,} {'pathways' if pathways else 'connections'} are left out"


def _thinned_out(network: Network, before: BoolArray, lines: BoolArray, why: str) -> str:
    """What is said where these lines stay of those before."""
    few = _left_out(int(before.sum() - lines.sum()), int(before.sum()))
    bared = bare(network, before, lines)
    gone = f", and all of {_count(bared, 'neuron')}" if bared else ""
    return f"{few}, the weakest that arrive at each neuron{gone}, {why}; all: --full"


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


def thinned(network: Network, lines: BoolArray, weights: FloatArray, lengths: FloatArray, most: int) -> BoolArray:
    """``most`` of the ``lines`` (m,): first what keeps every neuron and every pathway in the picture, then what is the
    largest share of |w| among all that arrives at its target; of equal ones the strongest, then the shortest, then the
    first by the names of its ends. No order of the spec decides."""
    sizes = np.nan_to_num(weights, nan=0.0)
    order = _strongest_first(network, lines, sizes, lengths)
    shares = _shares(network, sizes)[order]
    result = np.zeros(len(lines), bool)
    result[order[np.lexsort((-shares, _ranks(network, order)))[:most]]] = True  # ties stay as they are ordered
    return result


def _strongest_first(network: Network, lines: BoolArray, sizes: FloatArray, lengths: FloatArray) -> IntArray:
    """The indices of the ``lines``, the strongest first."""
    ends, names = network.connections, network.neurons.names
    kept = np.flatnonzero(lines)
    number = np.empty(len(names), np.int64)
    number[sorted(range(len(names)), key=names.__getitem__)] = np.arange(len(names))
    ties = number[ends.targets[kept]], number[ends.sources[kept]], lengths[kept].round(_DECIMALS)
    order: IntArray = kept[np.lexsort((*ties, -sizes[kept]))]
    return order


def _shares(network: Network, sizes: FloatArray) -> FloatArray:
    """Of each connection, how much of all |w| at its target it is; the same whatever order these stand in."""
    targets, count = network.connections.targets.whole(), len(network.neurons)
    largest = np.zeros(count)
    np.maximum.at(largest, targets, sizes)
    with np.errstate(invalid="ignore", divide="ignore"):
        parts = np.nan_to_num(sizes / largest[targets], nan=0.0)
        order = np.argsort(parts, kind="stable")
        result: FloatArray = parts / np.bincount(targets[order], parts[order], count)[targets]
    return np.nan_to_num(result, nan=0.0)


def _ranks(network: Network, order: IntArray) -> IntArray:
    """Who comes first, of connections in this order: 0 the strongest that arrives at a neuron, or that it sends where
    nothing arrives; 1 that of a pathway; 2 that of an entry; 3 the strongest that a neuron sends; 4 those of each
    neuron in each of its pathways; 5 the rest."""
    ends, group, groups = network.connections, group_of(network), len(network.neurons.groups)
    sources, targets = ends.sources[order], ends.targets[order]
    ranks = np.full(len(order), 5, np.int64)
    for rank, same in (
        (4, sources * groups + group[targets]),
        (4, targets * groups + group[sources]),
        (3, sources),
        (2, ends.entry[order]),
        (1, numbered(network)[order]),
        (0, targets),
    ):
        ranks[_first(same)] = rank
    starts = np.flatnonzero(~np.isin(sources, targets))
    ranks[starts[_first(sources[starts])]] = 0
    return ranks


def _first(values: IntArray) -> IntArray:
    """Where each value stands for the first time."""
    return np.unique(values, return_index=True)[1]


def bare(network: Network, lines: BoolArray, kept: BoolArray) -> int:
    """How many neurons have lines of which none is kept."""
    ends = network.connections
    before, after = (np.union1d(ends.sources[some], ends.targets[some]) for some in (lines, kept))
    return len(before) - len(after)
