"""Collapse: groups and instances as one glyph each, with what runs between them added up.

In: a network and what of it is collapsed. Out: a Gathered: a network to be drawn, in which a glyph is a neuron whose
activity is the mean of those that it holds, and all that runs from one glyph, or neuron, to another is one connection
(a bundle): its weight is the sum of their weights, whatever their delays and rules, its signal the sum of their
signals. What runs within a glyph is not drawn. The network is drawn, never run.

Of pathways each group is a glyph, what runs within it is drawn as well, and what excites and what inhibits are two
lines (``pathways``), which the sum of both would hide.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray, IntColumn, Texts, integers, reals
from neurovis_spec.compiler.drawing.drawing_settings import (
    Cell,
    LayoutSettings,
    Mirror,
    RenderSettings,
    ShownState,
    StatedGain,
)
from neurovis_spec.compiler.events.changes import Change
from neurovis_spec.compiler.events.settable import Settable
from neurovis_spec.compiler.network import Connections, Group, Instance, Network, Neurons
from neurovis_spec.scene import texts
from neurovis_spec.scene.ends import EndArray, ends_of
from neurovis_spec.scene.lesions import lesions_of
from neurovis_spec.scene.pathways import Strand, pathways
from neurovis_spec.scene.reached import Reached, largest_signals, reached, reached_by
from neurovis_spec.scene.shown_states import ShownStates
from neurovis_spec.scene.signals import Signal, Signals, weights_of

if TYPE_CHECKING:
    from neurovis_spec.runtime.recording import Recording, Snapshot

#: What a legend calls all that is added up: it has one gain, so that thick says more than thin.
ADDED = "added up"
#: So many neurons of a glyph are named where a pointer shows it.
_NAMED = 12
#: Rows of a recording that are added up together.
_CHUNK = 64


@dataclass(frozen=True, eq=False)
class Gathered:
    """``network`` is drawn in place of ``whole``. ``unit`` (of each neuron of the whole) and ``bundle`` (of each of its
    connections, −1 within a glyph) are indices into it; ``sizes`` and ``counts`` say how many of the whole each neuron
    and each connection stands for, ``glyph`` and ``sheaf`` whether it is a glyph, or runs from or to one."""

    whole: Network
    network: Network
    unit: IntArray
    bundle: IntArray
    sizes: IntArray
    counts: IntArray
    glyph: tuple[bool, ...]
    sheaf: tuple[bool, ...]
    #: of each line, where pathways are drawn, else None
    strands: tuple[Strand, ...] | None = None

    @property
    def any(self) -> bool:
        """Whether anything is collapsed."""
        return self.network is not self.whole

    def mean(self, activity: FloatArray) -> FloatArray:
        """Activities (…, n) of the whole as those of what is drawn."""
        return _added(activity, self.unit, len(self.sizes)) / self.sizes

    def total(self, values: FloatArray) -> FloatArray:
        """Weights or signals (…, m) of the whole, added up."""
        return _added(values, self.bundle, len(self.counts))

    def asked(self, settings: RenderSettings) -> RenderSettings:
        """What is asked to be seen of the whole as of what is drawn."""
        if not self.any:
            return settings
        if settings.focus is not None:
            settings = replace(settings, focus=(settings.focus[0], self._units(settings.focus[1])))
        if settings.path is not None:
            name, *ends = settings.path
            settings = replace(settings, path=(name, self._units(ends[0]), self._units(ends[1])))
        return settings

    def _units(self, members: Sequence[int]) -> tuple[int, ...]:
        return tuple(np.unique(self.unit[list(members)]).tolist())

    def snapshot(self, snapshot: Snapshot) -> Snapshot:
        """A step of the whole as one of what is drawn."""
        if not self.any:
            return snapshot
        before = snapshot.previous_weights
        return replace(
            snapshot,
            activity=self.mean(snapshot.activity),
            seen=None if snapshot.seen is None else self.mean(snapshot.seen),
            weights=self.total(snapshot.weights),
            previous_weights=None if before is None else self.total(before),
            shown=None if snapshot.shown is None else self._shown(self.mean(snapshot.activity), snapshot.shown),
        )

    def _shown(self, activity: FloatArray, shown: FloatArray) -> FloatArray:
        """The activities (…, glyphs) of what is drawn, with the means of what all members of a glyph show (…, n)."""
        states = ShownStates(self.network)
        return states.put(activity, self.mean(shown)[..., states.neurons])

    def signals(self, snapshot: Snapshot) -> Signal:
        """What a step of the whole sends along each line that is drawn, added up where something is collapsed."""
        sent = self._signals.at(snapshot)
        if not self.any:
            return sent
        with np.errstate(over="ignore", invalid="ignore"):
            total = self.total(sent.value)
        return Signal(total, np.ones_like(total))

    def ends(self, weights: FloatArray, own: EndArray | None = None) -> EndArray:
        """How the lines that are drawn end where the weights of the whole are these, and its lines end as ``own``, by
        default as the network says: of what is added up as its sum does, in which each counts by how it ends."""
        own = ends_of(self.whole, weights) if own is None else own
        if not self.any:
            return own
        with np.errstate(over="ignore", invalid="ignore"):
            negative = self.total(own.astype(np.float64) * np.abs(weights)) < 0
        some = self.total(np.abs(own).astype(np.float64)) > 0
        return np.where(some, np.where(negative, np.int8(-1), np.int8(1)), np.int8(0))

    @cached_property
    def _signals(self) -> Signals:
        return Signals(self.whole)

    def reached(self, recording: Recording) -> Reached:
        """How far a recording of the whole takes what is drawn."""
        states, own = ShownStates(self.whole), ShownStates(self.network)
        if not self.any:
            found = reached(self.whole, recording)
            shown = recording.states[:, own.columns(recording)]
            return found.with_shown(own.neurons, shown) if own else found
        changing, sources = self.network.changing, self.network.connections.sources.whole()
        fixed = self.total(weights_of(recording, slice(0, 0)))
        parts = [self.total(weights_of(recording, rows))[:, changing] for rows in _rows(recording)]
        found = reached_by(sources, fixed[0], self.mean(recording.activity), np.concatenate(parts), changing)
        found = replace(found, signals=largest_signals(self.whole, recording, self.total))
        if not own:
            return found
        return found.with_shown(own.neurons, self.mean(states.recorded(recording))[:, own.neurons])


def _rows(recording: Recording) -> list[slice]:
    return [slice(first, first + _CHUNK) for first in range(0, max(len(recording.activity), 1), _CHUNK)]


def _added(values: FloatArray, to: IntArray, count: int) -> FloatArray:
    """Values (…, k) added up by where they go (k,), −1 for nowhere: (…, count)."""
    kept = np.flatnonzero(to >= 0)
    order = kept[np.argsort(to[kept], kind="stable")]
    starts = np.searchsorted(to[order], np.arange(count))
    if not count:
        return np.zeros((*values.shape[:-1], 0))
    result: FloatArray = np.add.reduceat(values[..., order], starts, axis=-1)
    return result


def gathered(network: Network, collapse: Sequence[tuple[str, tuple[int, ...]]], pathways: bool = False) -> Gathered:
    """A network with these neurons, by name, as one glyph each; no neuron is in two. Of ``pathways`` the rest of each
    group is one, too."""
    collapse = _by_instance(network, collapse)
    if pathways:
        taken = {index for _, members in collapse for index in members}
        rest = [(group.name, tuple(set(group.indices) - taken)) for group in network.neurons.groups]
        collapse += [(name, tuple(sorted(members))) for name, members in rest if len(members) > 1]
    elif not collapse:
        ones = np.ones(len(network.neurons), np.int64), np.ones(len(network.connections), np.int64)
        here = np.arange(len(network.neurons)), np.arange(len(network.connections))
        plain = (False,) * len(network.neurons), (False,) * len(network.connections)
        return Gathered(network, network, *here, *ones, *plain)
    return _Gatherer(network, collapse, pathways).gathered()


def _by_instance(
    network: Network, collapse: Sequence[tuple[str, tuple[int, ...]]]
) -> list[tuple[str, tuple[int, ...]]]:
    """With instances that are named together each by itself."""
    result: list[tuple[str, tuple[int, ...]]] = []
    for name, members in collapse:
        each = [(one.path, tuple(one.indices)) for one in network.instances if one.number and one.declared == name]
        result += each or [(name, members)]
    return result


class _Gatherer:
    """Makes the network that is drawn, part by part."""

    def __init__(self, network: Network, collapse: Sequence[tuple[str, tuple[int, ...]]], as_pathways: bool) -> None:
        self.whole = network
        owner = np.full(len(network.neurons), -1, np.int64)
        for number, (_, members) in enumerate(collapse):
            owner[list(members)] = number
        seen: dict[tuple[bool, int], int] = {}
        of = [seen.setdefault((own >= 0, own if own >= 0 else i), len(seen)) for i, own in enumerate(owner.tolist())]
        self.unit = np.array(of, np.int64)
        self.glyphs = {seen[True, number]: name for number, (name, _) in enumerate(collapse)}
        self.members: list[list[int]] = [[] for _ in seen]
        for index, unit in enumerate(of):
            self.members[unit].append(index)
        self.sources = self.unit[network.connections.sources.whole()].tolist()
        self.targets = self.unit[network.connections.targets.whole()].tolist()
        self.strands: tuple[Strand, ...] | None = None
        if as_pathways:
            self.strands = tuple(strand for one in pathways(network, groups=self.unit) for strand in one.strands)
        self.bundles = self._bundles() if self.strands is None else [one.members.tolist() for one in self.strands]
        self.bundle = np.full(len(network.connections), -1, np.int64)
        for place, own in enumerate(self.bundles):
            self.bundle[own] = place
        self.sheaf = tuple(
            as_pathways or self.sources[own[0]] in self.glyphs or self.targets[own[0]] in self.glyphs
            for own in self.bundles
        )

    def _bundles(self) -> list[list[int]]:
        """The connections that are one line each: all from one glyph, or neuron, to another."""
        bundles: list[list[int]] = []
        found: dict[tuple[int, int], int] = {}
        for index, ends in enumerate(zip(self.sources, self.targets, strict=True)):
            joined = ends[0] in self.glyphs or ends[1] in self.glyphs
            if joined and ends[0] == ends[1]:
                continue
            place = found.setdefault(ends, len(bundles)) if joined else len(bundles)
            if place == len(bundles):
                bundles.append([])
            bundles[place].append(index)
        return bundles

    def gathered(self) -> Gathered:
        """The whole, and what is drawn in its place."""
        whole = self.whole
        network = replace(
            whole,
            neurons=self._neurons(),
            connections=self._connections(),
            inputs=(),
            outputs=(),
            noises=(),
            populations=(),
            program=(),
            projections=(),
            layout=self._layout(),
            render=self._render(),
            instances=self._instances(),
            settable=Settable(),
            changes=self._changes(),
            numbering=None,
        )
        network.__dict__["changing"] = np.unique(self._bundles_of(whole.changing))
        if self.strands is None:
            network.__dict__["connection_names"] = tuple(self._names(network))
        sizes = np.array([len(own) for own in self.members], np.int64)
        counts = np.array([len(own) for own in self.bundles], np.int64)
        glyph = tuple(unit in self.glyphs for unit in range(len(self.members)))
        return Gathered(whole, network, self.unit, self.bundle, sizes, counts, glyph, self.sheaf, self.strands)

    def _names(self, network: Network) -> Iterator[str]:
        """What the lines of what is drawn are called: those that are connections of the whole as these are."""
        names, ends = network.neurons.names, network.connections
        sources, targets = ends.sources.tolist(), ends.targets.tolist()
        for a, b, own, joined in zip(sources, targets, self.bundles, self.sheaf, strict=True):
            yield f"{names[a]} -> {names[b]}" if joined else self.whole.connection_names[own[0]]

    def _whole_units(self, indices: Iterable[int]) -> list[int]:
        """The units of which these neurons are all the members, in order."""
        chosen = set(indices)
        units = sorted({int(self.unit[index]) for index in chosen})
        return [unit for unit in units if chosen.issuperset(self.members[unit])]

    def _bundles_of(self, indices: IntArray) -> IntArray:
        found: IntArray = self.bundle[indices]
        return found[found >= 0]

    def _neurons(self) -> Neurons:
        neurons = self.whole.neurons
        group_of = [number for number, group in enumerate(neurons.groups) for _ in group.indices]
        groups: list[Group] = []
        taken = {neurons.names[own[0]] for unit, own in enumerate(self.members) if unit not in self.glyphs}
        names, labels = [], []
        for unit, own in enumerate(self.members):
            group = neurons.groups[group_of[own[0]]]
            if unit in self.glyphs:
                name = self.glyphs[unit]
                while name in taken:  # a group may be called like a neuron of another
                    name += "*"
                names.append(name)
                labels.append(name if self.strands is None else name.rpartition(".")[2])
                groups.append(self._glyph(unit, name, [neurons.groups[group_of[index]] for index in own]))
                continue
            names.append(neurons.names[own[0]])
            labels.append(neurons.labels[own[0]])
            last = groups[-1] if groups else None
            if last is not None and last.name == group.name and (unit - 1) not in self.glyphs:
                groups[-1] = replace(last, count=last.count + 1)
            else:
                groups.append(replace(group, start=unit, count=1))
        first = [own[0] for own in self.members]
        return Neurons(
            tuple(names),
            tuple(labels),
            tuple(groups),
            neurons.bias[first],
            neurons.initial[first],
            np.full(len(first), -1, np.int64),
            neurons.position[first],
        )

    def _glyph(self, unit: int, name: str, groups: Sequence[Group]) -> Group:
        """The group of a glyph; it says what the glyph holds."""
        own, neurons = self.members[unit], self.whole.neurons
        held = [neurons.names[index] for index in own]
        words = ", ".join(held if len(held) <= _NAMED else [*held[: _NAMED - 1], "…", held[-1]])
        within = sum(a == b == unit for a, b in zip(self.sources, self.targets, strict=True))
        lines = f"\n{within:,} connections within" if within and self.strands is None else ""
        boxes = {group.box for group in groups}
        box = boxes.pop() if len(boxes) == 1 else None
        if box is not None:
            around = [index for group in neurons.groups if group.box == box for index in group.indices]
            box = None if len(around) == len(own) else box
        many = f"the mean of {len(own):,} neurons" if len(own) > 1 else "one neuron"
        return Group(name, unit, 1, many, "static", "sum", {}, {}, box=box, description=words + lines)

    def _connections(self) -> Connections:
        old = self.whole.connections
        first = np.array([own[0] for own in self.bundles], np.int64)
        entries = list(old.entries)
        descriptions, learns = list(old.descriptions), list(old.learns)
        entry_of, weights_of, delays_of = old.entry.whole(), old.weights.whole(), old.delays.whole()
        entry, weights = entry_of[first].tolist(), weights_of[first].tolist()
        for place, (own, joined) in enumerate(zip(self.bundles, self.sheaf, strict=True)):
            if not joined:
                continue
            values = weights_of[own]
            weights[place] = float(values.sum())
            up, down = float(values[values > 0].sum()), float(values[values < 0].sum())
            parts = [f"{len(own):,} connection{'s' * (len(own) > 1)}, added up"]
            if up and down:
                parts.append(f"at first {texts.number(up, sign=True)} and {texts.number(down)}")
            rules = {old.learns[number] for number in set(entry_of[own].tolist())} - {None}
            entry[place] = len(entries)
            entries.append(ADDED)
            descriptions.append(": ".join(parts))
            learns.append(", ".join(sorted(rule for rule in rules if rule)) or None)
        count = len(self.bundles)
        delays = np.array([int(delays_of[own].min()) for own in self.bundles], np.int64)
        return Connections(
            integers(np.array([self.sources[own[0]] for own in self.bundles], np.int64)),
            integers(np.array([self.targets[own[0]] for own in self.bundles], np.int64)),
            reals(np.array(weights, float)),
            reals(np.zeros(count)),
            integers(delays),
            integers(np.full(count, -1, np.int64)),
            integers(np.array(entry, np.int64)),
            reals(np.full(count, -np.inf)),
            reals(np.full(count, np.inf)),
            tuple(entries),
            tuple(descriptions),
            tuple(learns),
            (*old.labels, *(None for _ in entries[len(old.labels) :])),
            synapses=(*old.synapses, *(None for _ in entries[len(old.labels) :])) if old.synapses else (),
            twins=self._twins(),
            own_labels=self._shared(old.own_labels),
            styles=self._shared(old.styles),
        )

    def _shared(self, texts: Texts | None) -> Texts | None:
        """The texts that all connections of each line have; none where they have several."""
        if texts is None:
            return None
        numbers = np.array([own[0] for own in self.bundles], np.int64)
        first = texts.numbers[numbers]
        alike = [bool((texts.numbers[own] == one).all()) for own, one in zip(self.bundles, first, strict=True)]
        return texts._replace(numbers=np.where(alike, first, -1))

    def _twins(self) -> IntColumn | None:
        """Which lines are there in both directions by symmetric pairs alone, so that each two of them are one."""
        twins, count = self.whole.connections.twins, len(self.bundles)
        if twins is None:
            return None
        result = np.full(count, -1, np.int64)
        for place, own in enumerate(self.bundles):
            back = np.sort(twins[np.array(own, np.int64)])
            other = int(self.bundle[back[0]]) if back[0] >= 0 else -1
            if other >= 0 and np.array_equal(back, self.bundles[other]):
                result[place] = other
        return integers(result) if (result >= 0).any() else None

    def _layout(self) -> LayoutSettings:
        old = self.whole.layout
        boxes = []
        for name, members in old.boxes:
            units = self._whole_units(members)
            if len(units) > 1 or (units and units[0] not in self.glyphs):
                boxes.append((name, tuple(units)))
        mirrors = []
        for mirror in old.mirrors:
            pairs = {(int(self.unit[a]), int(self.unit[b])) for a, b in mirror.pairs}
            apart = tuple(sorted((a, b) for a, b in pairs if a != b and len(self.members[a]) == len(self.members[b])))
            if apart:
                mirrors.append(Mirror(mirror.scope, apart))
        return LayoutSettings(
            direction=old.direction,
            boxes=tuple(boxes),
            neuron_spacing=old.neuron_spacing,
            rank_spacing=old.rank_spacing,
            mirrors=tuple(mirrors),
            plan=tuple(self._plan()),
        )

    def _plan(self) -> Iterator[Cell]:
        """The cells of the page, and of instances that are not within a glyph, with what stands in them whole."""
        scopes = {"", *(instance.path for instance in self._instances())}
        for cell in self.whole.layout.plan:
            units = self._whole_units(cell.members)
            if units and cell.scope in scopes:
                yield replace(cell, members=tuple(units))

    def _render(self) -> RenderSettings:
        old = self.whole.render

        def of_neurons(stated: tuple[StatedGain, ...]) -> tuple[StatedGain, ...]:
            return tuple(
                one if one.members is None else replace(one, members=tuple(self._whole_units(one.members)))
                for one in stated
            )

        def wholly(one: ShownState) -> ShownState:
            return replace(one, members=tuple(self._whole_units(one.members)))

        def of_lines(stated: tuple[StatedGain, ...]) -> tuple[StatedGain, ...]:
            result = []
            for one in stated:
                if one.members is not None:
                    chosen = set(one.members)
                    places = {int(self.bundle[index]) for index in one.members} - {-1}
                    whole = sorted(place for place in places if chosen.issuperset(self.bundles[place]))
                    one = replace(one, members=tuple(whole))
                result.append(one)
            return tuple(result)

        return replace(
            old,
            activity=of_neurons(old.activity),
            signal=of_lines(old.signal),
            thickness=of_lines(old.thickness),
            change=of_lines(old.change),
            show=tuple(shown for shown in map(wholly, old.show) if shown.members),
        )

    def _instances(self) -> tuple[Instance, ...]:
        """The instances that are not within a glyph, and of which no glyph holds a part alone."""
        result = []
        for instance in self.whole.instances:
            units = self._whole_units(instance.indices)
            held = sum(len(self.members[unit]) for unit in units)
            if held == instance.count and units and not (len(units) == 1 and units[0] in self.glyphs):
                result.append(replace(instance, start=units[0], count=len(units)))
        return tuple(result)

    def _changes(self) -> tuple[Change, ...]:
        """Lesions: of a glyph, or a bundle, at the step at which the last of it is gone."""
        gone = lesions_of(self.whole)
        neurons, lines = _last(self.members, gone.neurons), _last(self.bundles, gone.connections)
        return tuple(
            Change(
                at,
                lesioned_neurons=np.array(neurons.get(at, []), np.int64),
                lesioned_connections=np.array(lines.get(at, []), np.int64),
            )
            for at in sorted({*neurons, *lines})
        )


def _last(parts: Sequence[Sequence[int]], since: Mapping[int, int]) -> dict[int, list[int]]:
    """By step, the parts all of whose members are gone from that step on."""
    result: dict[int, list[int]] = {}
    for part, own in enumerate(parts):
        if all(index in since for index in own):
            result.setdefault(max(since[index] for index in own), []).append(part)
    return result
