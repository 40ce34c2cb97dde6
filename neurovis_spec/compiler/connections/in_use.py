"""Rules and synapses in use at the connections of an entry: what their formulas read of both ends.

In: a definition with its settings, the connections, the models of their ends. Out: an InUse: what is a parameter of the
model at an end has become one of the definition there, so that it is set as that is; what is a state, an output or the
activity is left to be read in a run. Where a name is the one at some ends and the other elsewhere there are several
Pieces.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, Indices, IntArray
from neurovis_spec.compiler.connections.signals import Signal
from neurovis_spec.compiler.events.settable import Part
from neurovis_spec.compiler.neurons.groups import Built, is_written
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import MODEL, SPIKE, SYNAPSE, Definition, EndName, ports_of
from neurovis_spec.compiler.taken import Side, is_kept
from neurovis_spec.compiler.values.arguments import Settled
from neurovis_spec.diagnostics import Findings, Home, Span, Undeclared, shorten
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.likeness import suggest


class Piece(NamedTuple):
    """Connections of an entry at whose ends the names of a definition mean the same: their indices among those of the
    entry, ascending; the definition, with what is a parameter at an end among its parameters; the values of these, one
    a connection; and the names that are something else there."""

    places: IntArray
    definition: Definition
    parameters: Mapping[str, FloatArray]
    read: tuple[EndName, ...] = ()


class InUse(NamedTuple):
    """A rule or a synapse of an entry. ``parts``: which of its parameters, those of the ends among them, follow
    parameters of the run. Of a rule ``signals`` says where these come from, and ``place`` is
    its place among the rules."""

    pieces: tuple[Piece, ...]
    parts: tuple[Part, ...]
    signals: Mapping[str, Signal] = MappingProxyType({})
    place: int = 0


class Joined(NamedTuple):
    """The connections of an entry: the neurons at their ends, and what these are."""

    sources: Indices
    targets: Indices
    census: Census

    def at(self, side: Side) -> Indices:
        """The neuron at an end of each connection."""
        return self.sources if side == "pre" else self.targets


def in_use(settled: Settled, span: Span, at: Joined, findings: Findings) -> InUse | Unknown:
    """A definition in use at connections; UNKNOWN where the model of an end has nothing of a name that it reads, which
    is reported at ``span``, where it is named."""
    definition, count = settled.definition, len(at.sources)
    found: list[_Meaning] = []
    for name in definition.end_names:
        meaning = _meaning(name, definition, span, at, findings)
        if meaning is UNKNOWN:
            return UNKNOWN
        found.append(meaning)
    parts = (*settled.parts, *(part for meaning in found for part in meaning.parts))
    pieces = []
    for is_parameter, places in _alike([meaning.is_parameter for meaning in found], count):
        inside = slice(None) if len(places) == count else places
        values = {name: array[inside] for name, array in settled.parameters.items()}
        own = [meaning for meaning, one in zip(found, is_parameter, strict=True) if one]
        values |= {meaning.name.text: meaning.values[inside] for meaning in own}
        grown = replace(definition, parameters=tuple(values)) if own else definition
        read = tuple(meaning.name for meaning, one in zip(found, is_parameter, strict=True) if not one)
        pieces.append(Piece(places, grown, values, read))
    return InUse(tuple(pieces), parts) if _sign_is_constant(pieces, span, findings) else UNKNOWN


#: What spikes in place of models that make a spike of an activity.
_SPIKING: Final = {"integrate_and_fire": "lif", "izhikevich": "izhikevich_ode"}


class _Meaning(NamedTuple):
    """What a name of an end is: for each connection whether a parameter, its values there, and which of these follow
    parameters of the run."""

    name: EndName
    is_parameter: BoolArray
    values: FloatArray
    parts: tuple[Part, ...]


def _meaning(name: EndName, definition: Definition, span: Span, at: Joined, findings: Findings) -> _Meaning | Unknown:
    """What a name of an end is, connection by connection; UNKNOWN where it is nothing, which is reported."""
    neurons = at.at(name.side)
    groups = at.census.groups_at(neurons)
    known = [one for one in groups if is_written(one.group.kind, one.group.model) and one.group.kind.model.sound]
    lacking = [one.group for one in known if not _has(one.group.kind.model.definition, name.name)]
    if lacking:
        _report(name, definition, span, [one.group for one in known], lacking[0], findings)
    if lacking or len(known) < len(groups):
        return UNKNOWN
    is_parameter, values = np.zeros(len(neurons), dtype=np.bool_), np.full(len(neurons), np.nan)
    parts: list[Part] = []
    for group, connections in groups:
        model = group.kind.model
        if name.name in model.parameters:
            members = neurons[connections].astype(np.int64) - group.group.start
            is_parameter[connections] = True
            values[connections] = model.parameters[name.name][members]
            parts += _parts_at(model, name.name, members, connections)
    moved = (one._replace(field=definition.kind.name, of=definition.name, name=name.text) for one in parts)
    return _Meaning(name, is_parameter, values, tuple(moved))


def _has(model: Definition, name: str) -> bool:
    return name in model.parameters or is_kept(model, name)


def _parts_at(model: Settled, name: str, members: IntArray, connections: IntArray) -> Iterator[Part]:
    """Which values of a parameter of a group's model, at some of its neurons, follow parameters of the run; they stand
    at connections. Within which bounds they must lie the group says."""
    for part in model.parts:
        if part.name == name and part.formula.slots:
            place_of = np.full(len(model.parameters[name]), -1, dtype=np.int64)
            places = part.within(len(place_of))
            place_of[places] = np.arange(len(places))
            inside = np.flatnonzero(place_of[members] >= 0)
            free = part._replace(low=None, high=None).subset(place_of[members[inside]])
            yield free._replace(places=connections[inside])


def _alike(masks: Sequence[BoolArray], count: int) -> Iterator[tuple[tuple[bool, ...], IntArray]]:
    """The different combinations of some masks of so many connections, and the connections that each is of, those with
    the first connection first."""
    if all(mask.all() or not mask.any() for mask in masks):
        yield tuple(bool(mask.any()) for mask in masks), np.arange(count, dtype=np.int64)
        return
    rows, first, number = np.unique(np.stack(masks, axis=1), axis=0, return_index=True, return_inverse=True)
    for one in np.argsort(first).tolist():
        yield tuple(rows[one].tolist()), np.flatnonzero(number.ravel() == one)


def _report(
    name: EndName, definition: Definition, span: Span, groups: Sequence[Built], lacking: Built, findings: Findings
) -> None:
    """That the model of a group has nothing of a name that a definition reads there, though that of another may."""
    model, what = lacking.kind.model.definition, f"the {definition.kind.name} '{definition.name}' reads {name.text}"
    if name.name == SPIKE:
        who, other = "source" if name.side == "pre" else "target", _SPIKING.get(model.name)
        message = f"the {definition.kind.name} '{definition.name}' needs a {who} that spikes: the model "
        message += f"'{model.name}' of '{lacking.name}' has no 'spike'"
        findings.error("spiking-needed", span, message, f"take {other}" if other else "add spike: {when: …} to it")
        return
    having = next((one for one in groups if _has(one.kind.model.definition, name.name)), None)
    message = f"{what}, and the model '{model.name}' of '{lacking.name}' has no '{shorten(name.name)}'"
    if having is not None:
        other = having.kind.model.definition.name
        message = f"{what}, and the model '{other}' of '{having.name}' has '{shorten(name.name)}'; "
        message += f"that of '{lacking.name}' ('{model.name}') has none"
    known = (MODEL.gives, *(one.name for one in model.named), *model.parameters)
    hint = partial(suggest, name.name, known, "it has")
    if name.name in ports_of(model):
        message = f"{what}, which is a port of the model '{model.name}' of '{lacking.name}'"
    lost = Undeclared(name.name, Home((MODEL.section, model.name), ("state", "outputs", "parameters")))
    findings.error("no-such-end-state", span, message, hint, undeclared=lost)


def _sign_is_constant(pieces: Sequence[Piece], span: Span, findings: Findings) -> bool:
    """Whether what says how the lines of a synapse end reads of the ends only parameters; a finding where it does
    not."""
    for piece in pieces:
        sign = piece.definition.sign
        for name in piece.read if sign is not None else ():
            assert sign is not None
            if name.text in names(sign):
                message = f"the sign of the {SYNAPSE.name} '{piece.definition.name}' reads {name.text}, which changes"
                hint = "how a line ends is drawn once: it follows from parameters and the weight"
                findings.error("no-such-end-state", span, message, hint)
                return False
    return True
