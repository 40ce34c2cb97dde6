"""Recordings as ``.npz``: written in one go or row by row, and checked while they are read.

In: a Recording and a path, or a path. Out: a file, or a Recording. Nothing in a file is trusted: headers are read
before memory is taken, sizes must agree with each other and with the archive, and pickles are never loaded. Beside the
arrays that ``docs/language.md`` names ours hold ``about``, a JSON text with what arrays do not say (names of groups and
outputs, the network's hash, ranks of parallel connections, parameters that were set, the backend); a file without it is
read as well. While a network runs its rows go into a journal beside the file, of which the archive is made at the end.
A *frame* is a recording without rows: all that is known before the first step; the journal begins with it.
"""

from __future__ import annotations

import io
import json
import math
import sys
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from io import FileIO
from pathlib import Path
from typing import IO, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import IntArray, narrow
from neurovis_spec.body import BodyError, Skeleton, skeleton_of, text_of
from neurovis_spec.compiler.limits import DEEPEST
from neurovis_spec.language.data.npy import LONGEST_HEADER, read_header
from neurovis_spec.language.data.table import CellError
from neurovis_spec.real_paths import reason_of
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.files import Part, part_of, regular_size, replacing
from neurovis_spec.runtime.journal import Journal, JournalWriter, is_begun, read_journal
from neurovis_spec.runtime.recording import Recording, after_rows, ended
from neurovis_spec.runtime.rows import KINDS, After, Rows, RowWriter, Steps, Widths
from neurovis_spec.runtime.spikes import Fired

Array: TypeAlias = npt.NDArray[np.generic]

#: kinds of dtype and dimensions of the arrays that a recording must hold
REQUIRED: Mapping[str, tuple[str, int]] = {
    "activity": ("fiu", 2),
    "neurons": ("U", 1),
    "weights": ("fiu", 2),
    "weights_static": ("fiu", 1),
    "plastic": ("iu", 1),
    "sources": ("iu", 1),
    "targets": ("iu", 1),
    "delays": ("iu", 1),
    "dt": ("fiu", 0),
    "step": ("iu", 1),
}
#: those that files of other programs and of earlier versions need not hold
OPTIONAL: Mapping[str, tuple[str, int]] = {
    "weights_after": ("fiu", 1),
    "reached": ("iu", 0),
    "lesioned_neurons": ("iu", 1),
    "lesioned_connections": ("iu", 1),
    "about": ("U", 0),
    "states": ("fiu", 2),
    "state_names": ("U", 1),
    "recorded": ("iu", 1),
    "recorded_weights": ("iu", 1),
    "sensors": ("fiu", 2),
    "sensor_names": ("U", 1),
    "pose": ("fiu", 2),
    "skeleton": ("U", 0),
    "spiking": ("iu", 1),
    "spike_steps": ("iu", 1),
    "spike_neurons": ("iu", 1),
    "spike_range": ("iu", 1),
}
#: an archive may always grow to this many bytes, and beyond that to a hundred times its size
ROOM = 256 * 2**20
RATIO = 100
_NUMBER = 8
#: what the views of ``about`` are of, in messages
_VIEWED: Mapping[str, str] = {"views": "neurons", "state_views": "states"}


def write_npz(recording: Recording, path: Path) -> None:
    """Write a recording; what was there stays until all is written."""
    with replacing(path) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        put_arrays(archive, {**_row_arrays(recording), **_fixed_arrays(recording), **_spike_arrays(recording)})


def npz_size(frame: Recording, steps: Steps) -> int:
    """The bytes that a streamed file takes, and the journal of which it is made."""
    width = sum(frame.widths)
    fixed = sum(array.nbytes for array in _fixed_arrays(frame).values())
    return len(steps) * _NUMBER * (2 * width + 1) + 2 * fixed  # the step is in the archive alone


@contextmanager
def stream_npz(path: Path, frame: Recording, steps: Steps) -> Iterator[RowWriter]:
    """A writer for rows, of which there may be fewer in the end than steps were to be. What was there stays until all
    is written; after an exception there is a part that holds the rows until then."""
    with part_of(path) as part:
        yield _NpzRows(part, frame, steps)
        _archive(part.file, path)


class _NpzRows:
    """Writes rows into a journal, and says which steps it holds."""

    def __init__(self, part: Part, frame: Recording, steps: Steps) -> None:
        self._journal = JournalWriter(part.file, frame_bytes(frame), steps)
        self._part, self._steps, self._rows = part, steps, 0

    def write(self, rows: Rows, after: After) -> None:
        self._journal.write(rows, after)
        self._rows += len(rows.activity)
        self._part.held = self._steps.at(self._rows - 1) if self._rows else None


def _archive(file: FileIO, path: Path) -> None:
    """Make an archive of a journal, in memory that does not grow with the rows. Raises RecordingError, OSError."""
    journal, frame = _journal(file)
    rows, widths = journal.rows, journal.columns
    with replacing(path) as out, zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as archive:
        put_arrays(archive, {**_fixed_arrays(frame), **_spike_arrays(frame)})
        recorded = _row_arrays(frame)
        for place, kind in enumerate(KINDS):
            if kind in recorded:
                _put_pieces(archive, kind, "<f8", (rows, widths[place]), journal.pieces(place))
        steps = (numbers.astype("<i8").tobytes() for numbers in journal.steps.parts())
        _put_pieces(archive, "step", "<i8", (rows,), steps)


def held_npz(file: FileIO) -> int | None:
    """The last step that a part holds, None for none. Raises RecordingError for a file that is no part, OSError."""
    if not is_begun(file):
        raise RecordingError("not a recording in progress")
    try:
        journal, _ = _journal(file)
    except RecordingError:
        return None
    return journal.steps.at(journal.rows - 1) if journal.rows else None


def finish_npz(file: FileIO, part: Path, path: Path) -> None:
    """Turn the part of a run that broke off into a recording. Raises RecordingError, OSError."""
    _archive(file, path)
    part.unlink()


def recover_npz(part: Path) -> Recording:
    """Read a part. Raises RecordingError."""
    with recording_errors(part), FileIO(part) as file:
        journal, frame = _journal(file)
        steps = np.concatenate([frame.step, *journal.steps.parts()])
        return frame.having(steps, journal.all_rows)


def _journal(file: FileIO) -> tuple[Journal, Recording]:
    """A journal, and its frame, with what is true after the last row. Raises RecordingError, OSError."""
    frames: list[Recording] = []

    def columns(frame: bytes) -> tuple[Widths, int]:
        recording = frame_from_bytes(frame)
        frames.append(recording)  # for use below: the journal keeps its bytes alone
        return recording.widths, len(recording.plastic)

    try:
        journal = read_journal(file, columns)
        frame = frames[0]
        if journal.chunks:
            journal_end = {name: np.array(journal.after[name], dtype=np.int64)
                    for name in ("reached", "lesioned_neurons", "lesioned_connections")}  # fmt: skip
            arrays = {**journal_end, "weights_after": journal.weights}
            rows_end = after_rows(frame.step, frame.weights, len(frame.plastic))
            frame = ended(frame, _after(arrays, journal.after, rows_end, len(frame.neurons), len(frame.sources)))
        if frame.spiking is not None:
            frame = frame.with_fired(_checked(journal.fired, frame.spiking))
    except (OSError, RecordingError):
        raise
    except Exception as error:  # as in recording_errors
        raise RecordingError(f"not a recording in progress ({type(error).__name__}: {str(error)[:200]})") from None
    return journal, frame


def frame_from_bytes(frame: bytes) -> Recording:
    """The recording without rows that ``frame_bytes`` made these bytes of. Raises RecordingError, and what zipfile,
    NumPy and json raise for what is malformed."""
    return _recording(_arrays(io.BytesIO(frame), len(frame)))


def frame_bytes(frame: Recording) -> bytes:
    """All but the rows, as an archive of its own."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        put_arrays(archive, {**_row_arrays(frame.part(slice(0))), **_fixed_arrays(frame), **_spike_arrays(frame)})
    return file.getvalue()


def _put_pieces(
    archive: zipfile.ZipFile, name: str, descr: str, shape: tuple[int, ...], pieces: Iterable[bytes]
) -> None:
    """An array whose bytes come one piece after another."""
    with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
        np.lib.format.write_array_header_1_0(member, {"descr": descr, "fortran_order": False, "shape": shape})
        for piece in pieces:
            member.write(piece)


def put_arrays(archive: zipfile.ZipFile, arrays: Mapping[str, Array]) -> None:
    """Whole arrays, as ``numpy.savez`` puts them into an archive."""
    for name, array in arrays.items():
        with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
            np.lib.format.write_array(member, array, allow_pickle=False)


def _row_arrays(recording: Recording) -> dict[str, Array]:
    """The arrays with a row a step."""
    arrays: dict[str, Array] = {"activity": recording.activity, "weights": recording.weights, "step": recording.step}
    if recording.state_names:
        arrays["states"] = recording.states
    if recording.sensors is not None:
        arrays["sensors"] = recording.sensors
    if recording.pose is not None:
        arrays["pose"] = recording.pose
    return arrays


def _spike_arrays(recording: Recording) -> dict[str, Array]:
    """The spikes, each in as few bytes as hold it; they are no rows."""
    if recording.spiking is None:
        return {}
    return {
        "spiking": recording.spiking,
        "spike_steps": narrow(recording.spike_steps),
        "spike_neurons": narrow(recording.spike_neurons),
        "spike_range": np.array(recording.spike_range, dtype=np.int64),
    }


def _checked(fired: Fired, spiking: IntArray) -> Fired:
    """Spikes of neurons that may. Raises RecordingError for what are none."""
    steps, neurons, first, stop = fired
    if steps.shape != neurons.shape or not 0 <= first <= stop:
        raise RecordingError("its spikes do not agree with each other")
    if len(steps) and (int(steps.min()) < first or int(steps.max()) >= stop or (np.diff(steps) < 0).any()):
        raise RecordingError("its spikes are not in the order of their steps")
    if not np.isin(neurons, spiking).all():
        raise RecordingError("'spike_neurons' holds a neuron that does not spike")
    return fired


def _fixed_arrays(recording: Recording) -> dict[str, Array]:
    """The arrays that do not grow with the steps."""
    parallel = np.flatnonzero(recording.ranks > 1)
    about = {
        "network": recording.network,
        "hash": recording.hash,
        "views": {name: [list(members), single] for name, (members, single) in recording.views.items()},
        "counted": dict(recording.counted),
        "parallel": [[int(index), int(recording.ranks[index])] for index in parallel],
        "set_parameters": dict(recording.set_parameters),
    }
    if recording.backend:
        about["backend"] = recording.backend
    if recording.named:
        about["named"] = [*recording.named]
    more: dict[str, Array] = {}
    if recording.state_names:
        about["state_views"] = {
            name: [list(members), single] for name, (members, single) in recording.state_views.items()
        }
        more["state_names"] = np.array(recording.state_names, dtype=np.str_)
    if recording.recorded is not None:
        more["recorded"] = recording.recorded
    if recording.recorded_weights is not None:
        more["recorded_weights"] = recording.recorded_weights
    if recording.sensors is not None:
        more["sensor_names"] = np.array(recording.sensor_names, dtype=np.str_)
    if recording.skeleton is not None:
        more["skeleton"] = np.array(text_of(recording.skeleton))
    return {
        "neurons": np.array(recording.neurons, dtype=np.str_),
        "weights_static": recording.weights_static,
        "plastic": recording.plastic,
        "sources": recording.sources,
        "targets": recording.targets,
        "delays": recording.delays,
        "dt": np.array(recording.dt, dtype=np.float64),
        "weights_after": recording.weights_after,
        "reached": np.array(recording.reached, dtype=np.int64),
        "lesioned_neurons": recording.lesioned_neurons,
        "lesioned_connections": recording.lesioned_connections,
        "about": np.array(json.dumps(about)),
        **more,
    }


def read_npz(path: Path) -> Recording:
    """Read a recording. Raises RecordingError."""
    with recording_errors(path):
        size = regular_size(path)
        with path.open("rb") as file:
            return _recording(_arrays(file, size))


@contextmanager
def recording_errors(path: Path, what: str = "a recording") -> Iterator[None]:
    """A block that reads a file: whatever is raised there becomes a RecordingError that names the file."""
    try:
        yield
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    except OSError as error:
        raise RecordingError(f"{path}: {reason_of(error)}") from None
    except Exception as error:
        # zipfile, zlib, NumPy's header parser and json have errors of their own for every way to be malformed
        raise RecordingError(f"{path}: not {what} ({type(error).__name__}: {str(error)[:200]})") from None


def _arrays(archived: IO[bytes], size: int) -> dict[str, Array]:
    """The arrays of an archive of so many bytes that belong to a recording. Raises RecordingError."""
    room = max(ROOM, RATIO * size)
    arrays: dict[str, Array] = {}
    with zipfile.ZipFile(archived) as archive:
        present = set(archive.namelist())
        for name, (kinds, dimensions) in {**REQUIRED, **OPTIONAL}.items():
            if f"{name}.npy" not in present:
                if name in OPTIONAL:
                    continue
                raise RecordingError(f"not a recording: it holds no '{name}'")
            member = archive.getinfo(f"{name}.npy")
            room -= member.file_size
            if room < 0:
                raise RecordingError("not a recording: it grows out of all proportion")
            with archive.open(member) as file:
                arrays[name] = read_array(file, name, member.file_size, kinds, dimensions)
    return arrays


def read_array(file: IO[bytes], name: str, size: int, kinds: str, dimensions: int) -> Array:
    """One array, its header checked before its data is read."""
    try:
        header = read_header(file.read(LONGEST_HEADER), size, kinds, (dimensions,), most=sys.maxsize)
    except CellError as error:
        raise RecordingError(f"'{name}' is of another type or shape: {error}") from None
    file.seek(header.offset)
    return header.array(file.read(header.count * header.dtype.itemsize))


def _check_shapes(arrays: Mapping[str, Array], n: int, recorded: IntArray | None) -> None:
    """Raise RecordingError where arrays of a network of ``n`` neurons do not fit to each other."""
    rows, m, p = len(arrays["activity"]), len(arrays["sources"]), len(arrays["plastic"])
    shapes = {
        "activity": (rows, n if recorded is None else len(recorded)),
        "neurons": (n,),
        "weights": (rows, len(arrays.get("recorded_weights", arrays["plastic"])) if arrays["weights"].shape[1] else 0),
        "states": (rows, len(arrays.get("state_names", ()))),
        "weights_static": (m - p,),
        "targets": (m,),
        "delays": (m,),
        "step": (rows,),
        "weights_after": (p,),
    }
    for name, shape in shapes.items():
        if name in arrays and arrays[name].shape != shape:
            raise RecordingError(f"'{name}' has the shape {arrays[name].shape}, where the others ask for {shape}")
    if "state_names" in arrays and "states" not in arrays:
        raise RecordingError("it names states and holds none")


def _names(arrays: Mapping[str, Array], name: str) -> tuple[str, ...]:
    """The texts of an array, each of which is there once. Raises RecordingError."""
    found = tuple(str(one) for one in arrays[name].tolist())
    if len(set(found)) != len(found):
        raise RecordingError(f"'{name}' holds a name twice")
    return found


def _recording(arrays: Mapping[str, Array]) -> Recording:
    """The recording of these arrays, once they agree with each other. n neurons, m connections, of which p change.
    Raises RecordingError."""
    rows, n = arrays["activity"].shape
    n = len(arrays["neurons"]) if "recorded" in arrays else n  # a partial recording has fewer columns than neurons
    m, p = len(arrays["sources"]), len(arrays["plastic"])
    recorded = _integers(arrays, "recorded", 0, n, ascending=True) if "recorded" in arrays else None
    _check_shapes(arrays, n, recorded)
    state_names = _names(arrays, "state_names") if "state_names" in arrays else ()
    skeleton = _checked_skeleton(arrays, rows)
    neurons = _names(arrays, "neurons")
    dt = float(arrays["dt"].astype(np.float64))
    if not (math.isfinite(dt) and dt > 0):
        raise RecordingError(f"'dt' is {dt}")
    about = _about(arrays)
    step = _integers(arrays, "step", 0, 2**62, ascending=True)
    plastic = _integers(arrays, "plastic", 0, m, ascending=True)
    weights = arrays["weights"].astype(np.float64)
    after = _after(arrays, about, after_rows(step, weights, p), n, m)
    recording = Recording(
        activity=arrays["activity"].astype(np.float64),
        neurons=neurons,
        weights=weights,
        weights_static=arrays["weights_static"].astype(np.float64),
        plastic=plastic,
        sources=_integers(arrays, "sources", 0, n),
        targets=_integers(arrays, "targets", 0, n),
        delays=_integers(arrays, "delays", 0, 2**31),
        dt=dt,
        step=step,
        ranks=_ranks(about, arrays["sources"].astype(np.int64), arrays["targets"].astype(np.int64)),
        weights_after=after.weights,
        reached=after.reached,
        set_parameters=after.set_parameters,
        lesioned_neurons=after.lesioned_neurons,
        lesioned_connections=after.lesioned_connections,
        views=_views(about, "views", n),
        network=str(about.get("network", "")),
        hash=str(about.get("hash", "")),
        counted=_counted(about, n),
        named=_named(about),
        states=arrays["states"].astype(np.float64) if state_names else np.zeros((rows, 0)),
        state_names=state_names,
        state_views=_views(about, "state_views", len(state_names)),
        recorded=recorded,
        recorded_weights=_recorded_weights(arrays, plastic, m),
        sensors=arrays["sensors"].astype(np.float64) if "sensors" in arrays else None,
        sensor_names=tuple(str(name) for name in arrays["sensor_names"].tolist()) if "sensors" in arrays else (),
        pose=None if skeleton is None else arrays["pose"].astype(np.float64),
        skeleton=skeleton,
        backend=str(about.get("backend", "")),
    )
    return _with_spikes(recording, arrays)


def _recorded_weights(arrays: Mapping[str, Array], plastic: IntArray, m: int) -> IntArray | None:
    """The connections whose weights alone are there; None where all are, or none. Raises RecordingError."""
    if "recorded_weights" not in arrays:
        return None
    found = _integers(arrays, "recorded_weights", 0, m, ascending=True)
    if not np.isin(found, plastic).all():
        raise RecordingError("'recorded_weights' names connections whose weights never change")
    return found


def _with_spikes(recording: Recording, arrays: Mapping[str, Array]) -> Recording:
    """A recording with the spikes that the arrays hold, if they hold any. Raises RecordingError."""
    if "spiking" not in arrays:
        return recording
    spiking = _integers(arrays, "spiking", 0, len(recording.neurons), ascending=True)
    missing = [name for name in ("spike_steps", "spike_neurons", "spike_range") if name not in arrays]
    if missing or len(arrays["spike_range"]) != 2:
        raise RecordingError("it says who spikes, and not when")
    steps, neurons = (arrays[name].astype(np.int64) for name in ("spike_steps", "spike_neurons"))
    first, stop = arrays["spike_range"].astype(np.int64).tolist()
    return recording.with_fired(_checked(Fired(steps, neurons, first, stop), spiking), spiking)


def _checked_skeleton(arrays: Mapping[str, Array], rows: int) -> Skeleton | None:
    """How the pose is drawn, None without a pose. Raises RecordingError where the arrays of a body do not agree."""
    for name, beside in (("sensors", "sensor_names"), ("pose", "skeleton")):
        if (name in arrays) != (beside in arrays):
            raise RecordingError(f"of '{name}' and '{beside}' it holds one alone")
    skeleton = None
    shapes = {}
    if "sensors" in arrays:
        shapes["sensors"] = rows, len(arrays["sensor_names"])
    if "pose" in arrays:
        try:
            skeleton = skeleton_of(str(arrays["skeleton"]))
        except BodyError as error:
            raise RecordingError(f"'skeleton': {error}") from None
        shapes["pose"] = rows, skeleton.size
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise RecordingError(f"'{name}' has the shape {arrays[name].shape}, where the others ask for {shape}")
    return skeleton


def _after(arrays: Mapping[str, Array], about: Mapping[str, object], by_rows: After, n: int, m: int) -> After:
    """What is true after the last step; where the file does not say it, what its rows say (``by_rows``)."""
    parameters = about.get("set_parameters", {})
    if not isinstance(parameters, dict) or not all(type(value) in (int, float) for value in parameters.values()):
        raise RecordingError("'about' sets no parameters")
    reached = int(arrays["reached"]) if "reached" in arrays else by_rows.reached
    if not 0 <= reached < 2**62:
        raise RecordingError(f"'reached' is {reached}")
    none = np.zeros(0, dtype=np.int64)
    neurons, connections = (
        _integers(arrays, name, 0, high, ascending=True) if name in arrays else none
        for name, high in (("lesioned_neurons", n), ("lesioned_connections", m))
    )
    return After(
        weights=arrays["weights_after"].astype(np.float64) if "weights_after" in arrays else by_rows.weights,
        reached=reached,
        set_parameters={str(name): float(value) for name, value in parameters.items()},
        lesioned_neurons=neurons,
        lesioned_connections=connections,
    )


def _integers(arrays: Mapping[str, Array], name: str, low: int, high: int, ascending: bool = False) -> IntArray:
    """An array of indices from ``low`` to below ``high``. Raises RecordingError for others."""
    values = arrays[name]
    if len(values) and (int(values.min()) < low or int(values.max()) >= high):
        raise RecordingError(f"'{name}' holds a number outside {low} … {high - 1}")
    array: IntArray = values.astype(np.int64)
    if ascending and (np.diff(array) <= 0).any():
        raise RecordingError(f"'{name}' does not ascend")
    return array


def _about(arrays: Mapping[str, Array]) -> dict[str, object]:
    about = json.loads(str(arrays["about"])) if "about" in arrays else {}
    if not isinstance(about, dict):
        raise RecordingError("'about' is no mapping")
    return about


def _views(about: Mapping[str, object], key: str, n: int) -> dict[str, tuple[tuple[int, ...], bool]]:
    """For each name that ``about`` knows, the indices below n that it stands for, and whether it is a single one."""
    views = about.get(key, {})
    if not isinstance(views, dict):
        raise RecordingError("'about' names no views")
    checked = {}
    for name, (members, single) in views.items():
        if not members or not all(type(index) is int and 0 <= index < n for index in members):
            raise RecordingError(f"'about': '{name}' names {_VIEWED[key]} that are not there")
        checked[str(name)] = (tuple(members), bool(single))
    return checked


def _named(about: Mapping[str, object]) -> tuple[str, ...]:
    """The groups whose neurons have names of their own; none in recordings of before."""
    named, views = about.get("named", []), about.get("views", {})
    if not isinstance(named, list) or not isinstance(views, dict):
        raise RecordingError("'about' names no groups")
    if not all(isinstance(name, str) and name in views for name in named):
        raise RecordingError("'about' names groups that are no views")
    return tuple(map(str, named))


def _counted(about: Mapping[str, object], n: int) -> dict[str, int]:
    """How many instances names stand for; more than n neurons can be in are refused."""
    counted = about.get("counted", {})
    if not isinstance(counted, dict) or not all(type(one) is int and one > 0 for one in counted.values()):
        raise RecordingError("'about' counts no instances")
    if sum(counted.values()) > n * DEEPEST:
        raise RecordingError("'about' counts more instances than there is room for")
    return {str(name): number for name, number in counted.items()}


def _ranks(about: Mapping[str, object], sources: IntArray, targets: IntArray) -> IntArray:
    """Ranks as ``about`` gives them; without it, among connections that share both ends, in their order."""
    ranks = np.ones(len(sources), dtype=np.int64)
    if "parallel" not in about:
        seen: dict[tuple[int, int], int] = {}
        for index, ends in enumerate(zip(sources.tolist(), targets.tolist(), strict=True)):
            ranks[index] = seen[ends] = seen.get(ends, 0) + 1
        return ranks
    parallel = about["parallel"]
    if not isinstance(parallel, list):
        raise RecordingError("'about' lists no parallel connections")
    for index, rank in parallel:
        if type(index) is not int or type(rank) is not int or not 0 <= index < len(ranks) or not 1 < rank <= len(ranks):
            raise RecordingError("'about' ranks a connection that is not there")
        ranks[index] = rank
    return ranks
