"""Checkpoints: the whole State of a run in a file, from which it goes on exactly.

In: a State and a path, or a Network and a path. Out: a file, or a State. The names in the file are fixed (``chosen``:
the parameters that were set). The file is an archive of arrays as NumPy writes them, without pickles; it is believed in
nothing: whatever is not of the size that this network asks for is refused before it is read, and so is a checkpoint of
another network (hash). What is under way is ``under_way`` where connections share it, and ``signals`` where each has
its own, as in the files of before.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.body import BodyError
from neurovis_spec.compiler.events.changes import Clamp
from neurovis_spec.compiler.events.settable import ParameterFormula
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.expressions.tree import Number
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.files import regular_size, replacing
from neurovis_spec.runtime.npz_file import Array, put_arrays, read_array, recording_errors
from neurovis_spec.runtime.signals import slots_of_each
from neurovis_spec.runtime.state import BodyState, State, by_kind, initial_state

#: bytes that the text may have, and those of all headers together
_TEXT, _ROOM = 4096, 1 << 20
#: more steps than are ever made
_MOST = 2**53
#: bytes for the clamps of a neuron, of which several may hold: events may cover each other
_CLAMPS = 1 << 12
#: bytes that the state of a body may take
_BODY = 256 << 20


def save_state(state: State, path: Path) -> None:
    """Write a state; what was there stays until all is written. Raises OSError, BodyError where the body is no
    numbers."""
    now, body = state.conditions, state.body
    about: dict[str, object] = {
        "neurovis_state": 1,
        "network": state.network,
        "k": state.k,
        "drawn": state.drawn,
        "continued": state.continued,
        "begun": state.begun,
    }
    if state.backend:
        about["backend"] = state.backend
    if body is not None:
        about["body"] = {"episode": body.episode, "ended_episode": body.ended_episode}
    clamps = list(now.held.active.values())
    arrays: dict[str, Array] = {
        "about": np.array(json.dumps(about)),
        **_arrays(state),
        "clamps": np.array([[c.order, c.event, len(c.neurons)] for c in clamps], dtype=np.int64).reshape(-1, 3),
        "clamped": _joined([clamp.neurons for clamp in clamps]).astype(np.int64),
        "clamp_values": np.array([_number(clamp) for clamp in clamps], dtype=np.float64),
    }
    n = len(state.activity)
    if (now.held.order[n:] >= 0).any():
        arrays |= {"fixed_order": now.held.order[n:], "fixed_value": now.held.value[n:]}
    if now.structure.has_lost:
        arrays["lost"] = now.structure.lost
    if body is not None and body.carried is not None:
        arrays["body"] = numbers_of(body.carried)
    with replacing(path) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        put_arrays(archive, arrays)


def numbers_of(carried: object) -> Array:
    """What a body carries, as it is put into a file. Raises BodyError where it is no array of numbers."""
    if not isinstance(carried, np.ndarray) or carried.dtype.kind != "f" or carried.ndim != 1:
        raise BodyError("the state of this body is no array of numbers, and cannot be put into a file")
    return carried


def load_state(network: Network, path: Path) -> State:
    """The state in a file. Raises RecordingError for a file that is none, or one of another network, or of one with a
    body where this has none, and the other way round."""
    with recording_errors(path, "a checkpoint"):
        state = initial_state(network)
        wanted = _arrays(state)
        own_size = slots_of_each(network)
        size, most = regular_size(path), 8 * own_size + sum(array.nbytes for array in wanted.values())
        most += state.conditions.structure.lost.nbytes + (0 if network.body is None else _BODY)
        if size > most + len(network.neurons) * _CLAMPS + _ROOM:
            raise RecordingError("not a checkpoint of this network: it is larger than its state")
        with path.open("rb") as file, zipfile.ZipFile(file) as archive:
            about = _about(archive)
            if about.get("network") != state.network:
                raise RecordingError(
                    "a checkpoint of another network, or of other parameters: it goes on with the spec and the "
                    "settings that it was made with"
                )
            if not state.own_signals and "signals.npy" in archive.namelist():
                state.signals, state.own_signals = np.zeros(own_size), True
                wanted = _arrays(state)
            arrays = {name: _member(archive, name, array) for name, array in wanted.items()}
            _fill(state, arrays)
            state.k, state.drawn = _whole(about, "k"), _whole(about, "drawn")
            state.backend = str(about.get("backend", ""))
            state.begun, state.continued = _whole(about, "begun", -1), about.get("continued") is True
            if "fixed_order.npy" in archive.namelist():
                held, n = state.conditions.held, len(network.neurons)
                held.order[n:] = _member(archive, "fixed_order", held.order[n:])
                held.value[n:] = _member(archive, "fixed_value", held.value[n:])
            _clamp_again(network, state, archive, size)
            lost = state.conditions.structure.lost
            if "lost.npy" in archive.namelist():
                lost = _member(archive, "lost", lost).astype(np.int64)
            state.body = _body(network, about, archive, size)
    controls = Controls(network)
    controls.restructure(state)
    now = state.conditions
    now.structure = replace(now.structure, since=arrays["gone_since"].astype(np.int64), lost=lost)
    return state


def _arrays(state: State) -> dict[str, Array]:
    """The arrays whose sizes follow from the network."""
    now = state.conditions
    return {
        "activity": state.activity,
        **({"outlets": state.outlets} if len(state.outlets) else {}),
        "weights": state.weights,
        _signals_as(state): state.signals,
        "history": state.history,
        **{kept: _joined(arrays) for kept, arrays in by_kind(state.cells).items()},
        "parameters": now.parameters,
        "chosen": now.was_set.astype(np.uint8),
        "variables": now.variables,
        "held_order": now.held.order[: len(state.activity)],
        "held_value": now.held.value[: len(state.activity)],
        "lesioned_neurons": now.lesioned_neurons.astype(np.uint8),
        "lesioned_connections": now.lesioned_connections.astype(np.uint8),
        "gone_since": now.structure.since,
        "paused": now.paused.astype(np.uint8),
    }


def _signals_as(state: State) -> str:
    """The name of what is under way."""
    return "signals" if state.own_signals else "under_way"


def _fill(state: State, saved: Mapping[str, Array]) -> None:
    """Have a state the arrays of a file, which are of the right sizes."""
    now = state.conditions
    state.activity, state.weights = _floats(saved["activity"]), _floats(saved["weights"])
    state.signals, state.history = _floats(saved[_signals_as(state)]), _floats(saved["history"])
    state.outlets = _floats(saved.get("outlets", state.outlets))
    for kept, arrays in by_kind(state.cells).items():
        ends = np.cumsum([len(array) for array in arrays])
        for array, values in zip(arrays, np.split(_floats(saved[kept]), ends), strict=False):
            array[:] = values
    now.parameters, now.variables = _floats(saved["parameters"]), _floats(saved["variables"])
    now.was_set = saved["chosen"].astype(np.bool_)
    n = len(state.activity)
    now.held.order[:n], now.held.value[:n] = saved["held_order"], saved["held_value"]
    now.lesioned_neurons = saved["lesioned_neurons"].astype(np.bool_)
    now.lesioned_connections = saved["lesioned_connections"].astype(np.bool_)
    now.paused = saved["paused"].astype(np.bool_)


def _clamp_again(network: Network, state: State, archive: zipfile.ZipFile, size: int) -> None:
    """The clamps that hold: those of events by their order, those by hand with their numbers."""
    rows = _member(archive, "clamps", np.zeros((0, 3), dtype=np.int64), size).astype(np.int64)
    neurons = _member(archive, "clamped", np.zeros(0, dtype=np.int64), size).astype(np.int64)
    values = _floats(_member(archive, "clamp_values", np.zeros(0), size))
    counts = rows[:, 2]
    within = (counts >= 0) & (counts <= len(neurons))  # so that their sum is one that fits
    if len(values) != len(rows) or not within.all() or counts.sum() != len(neurons):
        raise RecordingError("its clamps do not agree")
    if len(neurons) and (neurons.min() < 0 or neurons.max() >= network.clampable):
        raise RecordingError("it clamps neurons that are not there")
    of_events = {clamp.order: clamp for change in network.changes for clamp in change.clamps}
    held = state.conditions.held
    ends = np.cumsum(counts)
    for (order, event, count), end, value in zip(rows.tolist(), ends.tolist(), values.tolist(), strict=True):
        clamped = neurons[end - count : end]
        if event < 0:  # a clamp by hand
            held.active[order] = Clamp(order, event, clamped, ParameterFormula(Number(value), {}))
        elif order in of_events and of_events[order].event == event:
            held.active[order] = of_events[order]._replace(neurons=clamped)
        else:
            raise RecordingError("it holds a clamp that no event of this network begins")
    if not np.isin(held.order, [-1, *held.active]).all():
        raise RecordingError("its clamps do not agree")


def _body(network: Network, about: Mapping[str, object], archive: zipfile.ZipFile, size: int) -> BodyState | None:
    """Where the body was; None without a body. Raises RecordingError where the network and the file do not agree."""
    saved = about.get("body")
    if saved is None and network.body is not None and _whole(about, "k") > 0:
        raise RecordingError("a checkpoint of a run without a body: go on without one (--no-body)")
    if saved is not None and network.body is None:
        raise RecordingError("a checkpoint of a run with a body, which goes on with it alone")
    if saved is None:
        return None
    if not isinstance(saved, dict):
        raise RecordingError("not a checkpoint")
    carried = None
    if "body.npy" in archive.namelist():
        carried = _floats(_member(archive, "body", np.zeros(0), size))
    return BodyState(_whole(saved, "episode"), saved.get("ended_episode") is True, carried)


def _about(archive: zipfile.ZipFile) -> dict[str, object]:
    """The text of a checkpoint: all that is no array. Raises RecordingError."""
    member = archive.getinfo("about.npy")
    if member.file_size > _TEXT:
        raise RecordingError("not a checkpoint")
    with archive.open(member) as file:
        about = json.loads(str(read_array(file, "about", member.file_size, "U", 0)))
    if not isinstance(about, dict) or about.get("neurovis_state") != 1:
        raise RecordingError("not a checkpoint")
    return about


def _member(archive: zipfile.ZipFile, name: str, like: Array, room: int | None = None) -> Array:
    """An array of the type and, unless there is ``room`` for others, of the shape of another one."""
    member = archive.getinfo(f"{name}.npy")
    if member.file_size > (like.nbytes if room is None else room) + _TEXT:
        raise RecordingError(f"'{name}' is larger than this network's")
    with archive.open(member) as file:
        kinds = "f" if like.dtype.kind == "f" else "iu"
        array = read_array(file, name, member.file_size, kinds, like.ndim)
    if array.shape[1:] != like.shape[1:] or (room is None and array.shape != like.shape):
        raise RecordingError(f"'{name}' has the shape {array.shape}, where this network asks for {like.shape}")
    return array


def _whole(about: Mapping[str, object], name: str, least: int = 0) -> int:
    """A number of steps, of ``least`` or more. Raises RecordingError."""
    value = about.get(name)
    if type(value) is not int or not least <= value < _MOST:
        raise RecordingError(f"its '{name}' is no number of steps")
    return value


def _joined(arrays: list[npt.NDArray[np.float64]] | list[IntArray]) -> Array:
    return np.concatenate(arrays) if arrays else np.zeros(0)


def _floats(array: Array) -> FloatArray:
    return np.array(array, dtype=np.float64)


def _number(clamp: Clamp) -> float:
    """What a clamp by hand holds at; events know it themselves."""
    return clamp.value.tree.value if isinstance(clamp.value.tree, Number) else float("nan")
