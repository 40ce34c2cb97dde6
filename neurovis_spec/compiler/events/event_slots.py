"""What events set: the slots of parameters, and slots that events alone set, for weights and for what inputs are fed.

In: a Network, its events. Out: the network with these slots behind those of its parameters, and for each event which
slots it sets to what. So a weight that an event sets follows a slot as others follow a parameter, and whoever can set
parameters in a run can set it: the backends, exported C, checkpoints, the way back of a live run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, FloatColumn, IntArray, frozen
from neurovis_spec.compiler.events.events import Event, Feed, SetWeights
from neurovis_spec.compiler.events.settable import (
    HIGH,
    LOW,
    WEIGHTS,
    Assembled,
    Binding,
    Dependent,
    ParameterFormula,
    Part,
    Settable,
    Slot,
    Subset,
)
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.network import Connections, Network
from neurovis_spec.compiler.program import Key
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.expressions.tree import Name
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.unknown import UNKNOWN
from neurovis_spec.language.values import FormulaList


class Assigned(NamedTuple):
    """A slot that an event sets, and to what; ``name`` is what the author calls it, at ``key``."""

    slot: int
    name: str
    formula: Formula
    key: Span


def with_event_slots(
    network: Network, events: tuple[Event, ...], slots: Mapping[str, int], findings: Findings
) -> tuple[Network, tuple[tuple[Assigned, ...], ...]]:
    """The network with the slots of its events; for each event what it sets. ``slots`` are those of parameters by name;
    one whose own value is invalid has none, which is reported. So is a list of weights that are not as many as the
    connections."""
    making = _Making(network.settable, network.connections, findings)
    assigned = tuple(tuple(making.assigned(event, slots)) for event in events)
    return (network if making.settable is network.settable else replace(network, settable=making.settable)), assigned


@dataclass
class _Making:
    """Makes slots, one after the other."""

    settable: Settable
    connections: Connections
    findings: Findings
    #: the slots of weights that are set to one number, by what is named
    _of_weights: dict[tuple[str, bytes], int] = field(default_factory=dict)

    def assigned(self, event: Event, slots: Mapping[str, int]) -> Iterator[Assigned]:
        """What an event sets: parameters first, so that a weight which is set follows none at that step."""
        for name, formula in event.set.items():
            if name in slots:
                yield Assigned(slots[name], name, formula, event.keys[name])
        for weights in event.weights:
            yield from self._weights(weights)
        for feed in event.feeds:
            yield from self._feed(feed)

    def _weights(self, weights: SetWeights) -> Iterator[Assigned]:
        if isinstance(weights.value, FormulaList):
            yield from self._each_weight(weights, weights.value)
            return
        members, _ = self.connections.with_tied(self.connections.with_twins(weights.members))
        known = weights.name, members.tobytes()
        if known not in self._of_weights:
            slot = self._of_weights[known] = self._slot(weights.name)
            self._bind(ParameterFormula(Name("weight"), {"weight": slot}), members)
        yield Assigned(self._of_weights[known], weights.name, weights.value, weights.key)

    def _each_weight(self, weights: SetWeights, values: FormulaList) -> Iterator[Assigned]:
        """A list of weights: numbers stand in an array, of formulas each has a slot, and one slot says that they are
        set. Of twins the list has the weight of those that are written."""
        members, written = weights.members, np.setdiff1d(weights.members, self.connections.second)
        if len(written):
            members = written
        if len(values.items) != len(members):
            message = f"'{shorten(weights.name)}' has {plural(len(values.items), 'weight')} for "
            self.findings.error("wrong-size", values.span, message + plural(len(members), "connection"))
            return
        trigger = self._slot(weights.name)
        yield Assigned(trigger, weights.name, Located(1.0, values.items[0].node), weights.key)
        base, parts = np.zeros(len(members)), []
        for place, item in enumerate(values.items):
            if isinstance(item.value, str):
                slot = self._slot(weights.name)
                yield Assigned(slot, weights.name, item, item.span)
                parts.append(Part(ParameterFormula(Name("weight"), {"weight": slot}), np.array([place])))
            elif item.value is not UNKNOWN:
                base[place] = item.value
        if self.connections.twins is not None:
            twins = self.connections.twins[members]
            members = np.concatenate((members, twins[twins >= 0]))
            order = np.concatenate((np.arange(len(base)), np.flatnonzero(twins >= 0)))
            each: FloatArray | Dependent = Subset(Assembled(base, tuple(parts)), order) if parts else base[order]
        else:
            each = Assembled(base, tuple(parts)) if parts else base
        if self.connections.tied is not None:
            members, whose = self.connections.with_tied(members)
            each = each[whose] if isinstance(each, np.ndarray) else Subset(each, whose)
        self._bind(ParameterFormula(Name("weights"), {"set": trigger}, {"weights": each}), members)

    def _feed(self, feed: Feed) -> Iterator[Assigned]:
        first = self.settable.feeds.get(feed.name)
        if first is None:
            first = self._slot(feed.name)
            for place in range(feed.size):
                self._slot(f"{feed.name} [{place}]")
            self.settable = replace(self.settable, feeds={**self.settable.feeds, feed.name: first})
        node = feed.node
        yield Assigned(first, feed.name, Located(0.0 if feed.values is None else 1.0, node), feed.key)
        for place, value in enumerate(feed.values or ()):
            yield Assigned(first + 1 + place, feed.name, value, feed.key)

    def _slot(self, name: str) -> int:
        """Another slot, whose index this gives."""
        before = self.settable
        count = len(before.slots)
        self.settable = replace(before, slots=(*before.slots, Slot(name, 0.0)), of_events=before.own_count)
        return count

    def _bind(self, formula: ParameterFormula, members: IntArray) -> None:
        """Have the weights of connections follow a formula, within the bounds of those that learn."""
        places = frozen(members)
        binding = Binding(
            formula,
            weights=True,
            indices=places,
            array=WEIGHTS,
            places=places,
            low=self._bound(LOW, self.connections.low, members),
            high=self._bound(HIGH, self.connections.high, members),
        )
        self.settable = replace(self.settable, bindings=(*self.settable.bindings, binding))

    def _bound(self, array: Key, bounds: FloatColumn, members: IntArray) -> Dependent | None:
        """The bounds of some weights on one side; None where they have none."""
        following = [one for one in self.settable.bindings if one.array == array and np.isin(one.places, members).any()]
        if following:
            parts = tuple(Part(one.formula, one.places) for one in following)
            return Subset(Assembled(bounds.whole(), parts), members)
        own = bounds[members]
        if not np.isfinite(own).any():
            return None
        return ParameterFormula(Name("bound"), {}, {"bound": own})
