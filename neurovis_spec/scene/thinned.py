"""Thinned: which lines stay where a picture has room for so many, and of which pathways the others are.

In: a network, the magnitudes of its weights, how long its lines are. Out: the lines that stay, and words on those that
do not. A line counts as much as it is of all that arrives at its target, so that what is drawn is as much as can be of
what drives each neuron. A neuron, a pathway (what runs from one group to another) and an entry keep their strongest.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.scene.called import names_of, unit_of

BoolArray = npt.NDArray[np.bool_]

#: so many pathways are named that lost lines
_NAMED = 6
#: lengths are compared to so many decimals of a layout's unit: what is alike in a picture is so by rounding alone
_DECIMALS = 6


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
    nothing arrives; 1 that of a pathway; 2 that of an entry; 3 those of each neuron in each of its pathways; 4 the
    rest."""
    ends, group, groups = network.connections, _groups(network), len(network.neurons.groups)
    sources, targets = ends.sources[order], ends.targets[order]
    ranks = np.full(len(order), 4, np.int64)
    for rank, same in (
        (3, sources * groups + group[targets]),
        (3, targets * groups + group[sources]),
        (2, ends.entry[order]),
        (1, _pathways(network)[order]),
        (0, targets),
    ):
        ranks[_first(same)] = rank
    starts = np.flatnonzero(~np.isin(sources, targets))
    ranks[starts[_first(sources[starts])]] = 0
    return ranks


def _first(values: IntArray) -> IntArray:
    """Where each value stands for the first time."""
    return np.unique(values, return_index=True)[1]


def _groups(network: Network) -> IntArray:
    """Of each neuron the number of its group."""
    groups = network.neurons.groups
    return np.repeat(np.arange(len(groups)), [group.count for group in groups])


def _pathways(network: Network) -> IntArray:
    """Of each connection the number of its pathway: that of the group that it comes from, then of that it goes to."""
    ends, group = network.connections, _groups(network)
    return group[ends.sources.whole()] * len(network.neurons.groups) + group[ends.targets.whole()]


def losses(network: Network, lines: BoolArray, kept: BoolArray) -> list[str]:
    """Which pathways lost how many of the ``lines`` where these are ``kept``, those that lost most first, the last of
    them together; what several instances of a module have is one. Nothing where there is one pathway."""
    names, groups = names_of(network).called, network.neurons.groups
    called = [names[unit_of(group)] for group in groups]
    numbers, members = np.unique(_pathways(network)[lines], return_inverse=True)
    lost, of = np.bincount(members, ~kept[lines]).astype(np.int64), np.bincount(members)
    found: dict[tuple[str, str], tuple[int, int]] = {}
    for number, fewer, count in zip(numbers.tolist(), lost.tolist(), of.tolist(), strict=True):
        source, target = divmod(number, len(groups))
        ends = called[source], called[target]
        before = found.get(ends, (0, 0))
        found[ends] = before[0] + fewer, before[1] + count
    if len(found) < 2:
        return []
    ordered = sorted((-fewer, count, *ends) for ends, (fewer, count) in found.items() if fewer)
    said = [f"{-fewer:,} of {count:,} {source} → {target}" for fewer, count, source, target in ordered[:_NAMED]]
    if rest := ordered[_NAMED:]:
        fewer, count = -sum(one[0] for one in rest), sum(one[1] for one in rest)
        said.append(f"{fewer:,} of {count:,} in {len(rest):,} other{'s' * (len(rest) > 1)}")
    return said


def bare(network: Network, lines: BoolArray, kept: BoolArray) -> tuple[int, int]:
    """How many neurons and how many pathways have lines of which none is kept."""
    ends, pathways = network.connections, _pathways(network)
    before, after = (np.union1d(ends.sources[some], ends.targets[some]) for some in (lines, kept))
    return len(before) - len(after), len(np.unique(pathways[lines])) - len(np.unique(pathways[kept]))
