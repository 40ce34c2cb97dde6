"""Saving: what was shown, as files: a picture, a film of the last steps, a recording.

In: what was seen, step by step, and how it is drawn. Out: the bytes of a file, of the same picture as the page has.
What was turned by hand is part of what changes in it, as events of the spec are.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path

import numpy as np

from neurovis_spec.arrays import FloatArray, frozen
from neurovis_spec.compiler.events.changes import Change
from neurovis_spec.compiler.events.settable import WEIGHTS, Binding, ParameterFormula, Settable, Slot
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.expressions.tree import Name, Number
from neurovis_spec.live.source import NOTHING, Drawn, Mask, Seen, Source
from neurovis_spec.live.turns import Lesion, Mend, Set, Turned, Weigh
from neurovis_spec.live.view import View
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.columns import Numbers, Probe, columns_of, recording_of
from neurovis_spec.runtime.fitting import with_spikes
from neurovis_spec.runtime.names import names_of
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.references import find_connections, find_parts
from neurovis_spec.runtime.rows import After, Rows
from neurovis_spec.scene import Film
from neurovis_spec.scene.figure import PAGE, with_body
from neurovis_spec.scene.film import filmed, still
from neurovis_spec.scene.film_size import frames_a_second
from neurovis_spec.scene.poses import Poses
from neurovis_spec.scene.renderers import drawing, renderer_for

#: The most steps that are looked back, the most numbers in them, and the most seconds of a film.
MOST_STEPS, _NUMBERS, MOST_SECONDS = 10_000, 8_000_000, 60


def as_turned(network: Network, turned: Sequence[Turned]) -> Network:
    """The network with the parameters and weights that were set by hand, and the lesions, among what changes; by its
    hash it is the one that it was."""
    network = _with_weights(network, [entry.turn.connections for entry in turned if isinstance(entry.turn, Weigh)])
    slots = {slot.name: place for place, slot in enumerate(network.settable.slots)}
    changes, names = {change.at: change for change in network.changes}, names_of(network)
    for at, what in ((entry.step + 1, entry.turn) for entry in turned):
        before = changes.get(at, Change(at))
        if isinstance(what, Set):
            changes[at] = before._replace(parameters=(*before.parameters, *_parameters(network, what)))
        elif isinstance(what, Weigh):
            given = slots[_slot_of(what.connections)], ParameterFormula(Number(what.value), {})
            changes[at] = before._replace(parameters=(*before.parameters, given))
        elif isinstance(what, Lesion | Mend):  # one that is mended before a step is made is none
            neurons, connections = find_parts(network, what.part, names)
            joined = np.union1d if isinstance(what, Lesion) else np.setdiff1d
            changes[at] = before._replace(
                lesioned_neurons=frozen(joined(before.lesioned_neurons, neurons)),
                lesioned_connections=frozen(joined(before.lesioned_connections, connections)),
            )
    if len(changes) == len(network.changes) and all(change is changes[change.at] for change in network.changes):
        return network
    return replace(network, changes=tuple(changes[at] for at in sorted(changes)))


def _slot_of(connections: str) -> str:
    """What the slot is called of a weight that was set by hand; no parameter is."""
    return f"by hand: {connections}"


def _with_weights(network: Network, connections: Sequence[str]) -> Network:
    """The network with a slot for the weight of each of these, as events have them."""
    names, before = names_of(network), network.settable
    slots, bindings = [*before.slots], [*before.bindings]
    for name in dict.fromkeys(connections):
        own = find_connections(network, name, names)
        members = frozen(network.connections.with_tied(network.connections.with_twins(own))[0])
        formula = ParameterFormula(Name("weight"), {"weight": len(slots)})
        bindings.append(Binding(formula, weights=True, indices=members, array=WEIGHTS, places=members))
        slots.append(Slot(_slot_of(name), 0.0))
    if len(slots) == len(before.slots):
        return network
    settable: Settable = replace(before, slots=(*slots,), bindings=(*bindings,), of_events=before.own_count)
    return replace(network, settable=settable)


def _parameters(network: Network, what: Set) -> tuple[tuple[int, ParameterFormula], ...]:
    slots = network.settable.index
    return tuple((slots[name], ParameterFormula(Number(value), {})) for name, value in what.values.items())


def steps_for(network: Network, seconds: float | None) -> int:
    """How many steps are looked back: those of so many seconds of a film, or as many as there is room for."""
    room = max(1, _NUMBERS // max(1, len(network.neurons) + len(network.connections)))
    wanted = MOST_STEPS if seconds is None else round(seconds * frames_a_second(network))
    return max(1, min(wanted, room, MOST_STEPS))


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """What a source tells for files, when it stands at the last of the steps that were ``seen``: what is true after it,
    what was turned until then, the body that is drawn, and what makes the steps."""

    seen: Sequence[Seen]
    after: After
    turned: tuple[Turned, ...] = ()
    body: Drawn = NOTHING
    backend: str = ""


def told_by(source: Source, steps: int) -> Told:
    """What a source tells of its last steps. Raises SourceError."""
    return Told(source.recall(steps), source.after(), source.turned, source.body, source.backend)


def picture(view: View, told: Told, suffix: str = ".svg") -> bytes:
    """The last step, with the body that is drawn. Raises RendererError."""
    return drawing(still(_film(view, replace(told, seen=told.seen[-1:])), 0), suffix)


def film(view: View, told: Told, suffix: str = ".svg", progress: Progress | None = None) -> bytes:
    """Steps as a film, by default a moving SVG, with the body that is drawn. Raises RendererError where nobody here
    makes films of this kind."""
    return renderer_for(suffix, moving=True).animate(_film(view, told), suffix, progress)


def _film(view: View, told: Told) -> Film:
    network, seen, body = view.drawn.whole, told.seen, told.body
    turned, planned, drawn = as_turned(network, told.turned), view.plan, view.drawn
    if turned is not network or body.skeleton is not None:
        drawn, planned = view.planned(turned, 0.0 if body.skeleton is None else PAGE)
    made = filmed(drawn, planned, [one.snapshot for one in seen], view.gains, frames_a_second(network))
    masks = [view.lesioned(one) for one in seen]
    faint = _first("n", [neurons for neurons, _ in masks]) | _first("c", [lines for _, lines in masks])
    made = replace(made, faint=faint)
    if body.skeleton is None:
        return made
    unknown = np.full(body.skeleton.size, np.nan)
    poses = [unknown if one.snapshot.pose is None else one.snapshot.pose for one in seen]
    return with_body(made, Poses(body.skeleton, np.array(poses), body.start))


def _first(kind: str, masks: Sequence[Mask]) -> dict[str, int]:
    """The frame from which on something is lesioned to the end."""
    stays = np.logical_and.accumulate(np.stack(masks)[::-1])[::-1]
    return {f"{kind}{index}": int(stays[:, index].argmax()) for index in np.flatnonzero(stays[-1]).tolist()}


def recording(network: Network, told: Told) -> bytes:
    """Steps as a recording (``.npz``), the same as of a run in which events of the spec do what was turned. States that
    outputs name, sensors and poses are in it where they are known of every step."""
    seen, turned, body = told.seen, as_turned(network, told.turned), told.body
    changing = turned.changing
    states = _known([one.states for one in seen])
    sensed, poses = (_known([of(one.snapshot) for one in seen]) for of in (attrgetter("sensors"), attrgetter("pose")))
    columns = columns_of(turned)
    columns = replace(
        columns if states else replace(columns, probe=Probe((), ()), outputs={}),
        sensors=body.sensor_names if sensed else None,
        skeleton=body.skeleton if poses else None,
    )
    rows = Rows(
        np.array([one.snapshot.activity for one in seen]),
        np.array([one.snapshot.weights[changing] for one in seen]),
        *(np.array(several).reshape(len(seen), -1 if several else 0) for several in (states, sensed, poses)),
    )
    numbers = Numbers(np.array([one.snapshot.step for one in seen], np.int64), rows)
    after = replace(told.after, weights=told.after.weights[changing])
    made = recording_of(turned, columns, numbers, told.after.weights, after, told.backend)
    return _npz(with_spikes(made, turned))


def _known(values: Sequence[FloatArray | None]) -> list[FloatArray]:
    """The values of all steps; none where one of them is not known."""
    known = [one for one in values if one is not None]
    return known if len(known) == len(values) else []


def _npz(made: Recording) -> bytes:
    with tempfile.TemporaryDirectory(prefix="neurovis-") as folder:
        path = Path(folder) / "recording.npz"
        made.save(path)
        return path.read_bytes()
