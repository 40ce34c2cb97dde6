"""Saving: what was shown, as files: a picture, a film of the last steps, a recording.

In: what was seen, step by step, and how it is drawn. Out: the bytes of a file, of the same picture as the page has.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from neurovis_spec import pipeline
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.source import NOTHING, Drawn, Mask, Seen
from neurovis_spec.live.view import View
from neurovis_spec.runtime.columns import columns_of
from neurovis_spec.runtime.kinds import Rows
from neurovis_spec.runtime.recording import After, Numbers, Recording, recording_of
from neurovis_spec.scene import Film
from neurovis_spec.scene.figure import with_body
from neurovis_spec.scene.film import filmed
from neurovis_spec.scene.film_size import frames_a_second
from neurovis_spec.scene.poses import Poses

#: The most steps that are looked back, the most numbers in them, and the most seconds of a film.
MOST_STEPS, _NUMBERS, MOST_SECONDS = 10_000, 8_000_000, 60


def steps_for(network: Network, seconds: float | None) -> int:
    """How many steps are looked back: those of so many seconds of a film, or as many as there is room for."""
    room = max(1, _NUMBERS // max(1, len(network.neurons) + len(network.connections)))
    wanted = MOST_STEPS if seconds is None else round(seconds * frames_a_second(network))
    return max(1, min(wanted, room, MOST_STEPS))


def picture(view: View, seen: Seen, drawn: Drawn = NOTHING) -> bytes:
    """A step as SVG, with the body that is drawn."""
    return pipeline.draw(pipeline.frame(_film(view, [seen], drawn), 0), ".svg")


def film(view: View, seen: Sequence[Seen], drawn: Drawn = NOTHING) -> bytes:
    """Steps as a moving SVG, with the body that is drawn."""
    return pipeline.animate(_film(view, seen, drawn), ".svg")


def _film(view: View, seen: Sequence[Seen], drawn: Drawn) -> Film:
    network = view.drawn.network
    made = filmed(view.drawn, view.plan, [one.snapshot for one in seen], view.gains, frames_a_second(network))
    masks = [view.lesioned(one) for one in seen]
    faint = _first("n", [neurons for neurons, _ in masks]) | _first("c", [lines for _, lines in masks])
    made = replace(made, faint=faint)
    if drawn.skeleton is None:
        return made
    unknown = np.full(drawn.skeleton.size, np.nan)
    poses = [unknown if one.snapshot.pose is None else one.snapshot.pose for one in seen]
    return with_body(made, Poses(drawn.skeleton, np.array(poses), drawn.start))


def _first(kind: str, masks: Sequence[Mask]) -> dict[str, int]:
    """The frame from which on something is lesioned to the end."""
    stays = np.logical_and.accumulate(np.stack(masks)[::-1])[::-1]
    return {f"{kind}{index}": int(stays[:, index].argmax()) for index in np.flatnonzero(stays[-1]).tolist()}


def recording(network: Network, seen: Sequence[Seen], parameters: Mapping[str, float], drawn: Drawn = NOTHING) -> bytes:
    """Steps as a recording (``.npz``), but for the last, whose weights are those after it; ``drawn`` is the body."""
    *rows, last = seen
    changing = network.changing
    poses = [one.snapshot.pose for one in rows if one.snapshot.pose is not None]
    sensed = [one.snapshot.sensors for one in rows if one.snapshot.sensors is not None]
    numbers = Numbers(
        np.array([one.snapshot.step for one in rows], np.int64),
        Rows(
            np.array([one.snapshot.activity for one in rows]).reshape(len(rows), len(network.neurons)),
            np.array([one.snapshot.weights[changing] for one in rows]).reshape(len(rows), len(changing)),
            np.zeros((len(rows), 0)),
            np.array(sensed).reshape(len(rows), -1 if sensed else 0),
            np.array(poses).reshape(len(rows), -1 if poses else 0),
        ),
    )
    weights = last.snapshot.weights
    given = {name: value for name, value in parameters.items() if value != network.parameters[name]}
    lesioned = np.flatnonzero(last.lesioned_neurons), np.flatnonzero(last.lesioned_connections)
    after = After(weights[changing], last.snapshot.step, given, *lesioned)
    columns = replace(
        columns_of(replace(network, outputs=())),
        sensors=drawn.sensor_names if sensed else None,
        skeleton=drawn.skeleton if poses else None,
    )
    return _npz(recording_of(network, columns, numbers, weights, after))


def _npz(made: Recording) -> bytes:
    with tempfile.TemporaryDirectory(prefix="neurovis-") as folder:
        path = Path(folder) / "recording.npz"
        made.save(path)
        return path.read_bytes()
