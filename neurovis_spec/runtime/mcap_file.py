"""Recordings as ``.mcap``, as tools of robots read them: a message a topic and step, as a node would have sent it.

In: a Recording and a path, or a path. Out: a file that can be read at any moment while it is written, or a Recording.
Topics are ``NAMESPACE/NETWORK/activity``, ``/weights`` (of the changing connections), ``/states``, ``/sensors`` and
``/pose`` of a body, and ``/spec``; ``/values`` has activities again, by name, for those who plot them, and is passed
over here. What does not grow with the steps, the *frame* (a recording without rows), is an attachment, as an archive
like a ``.npz``. A recording may go on from file to file: ``NAME.mcap``, ``NAME-1.mcap``, ….
"""

from __future__ import annotations

import io
import json
import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from io import FileIO
from itertools import chain
from pathlib import Path
from time import monotonic

import numpy as np

from neurovis_spec.compiler.ros_settings import by_name
from neurovis_spec.runtime import mcap_records as records
from neurovis_spec.runtime.arrived import Arrived
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.files import Part, move, part_of, regular_size
from neurovis_spec.runtime.mcap_records import Channel, DamagedError, Found, Message, Schema, Topic
from neurovis_spec.runtime.named_values import SCHEMA, NamedValues
from neurovis_spec.runtime.npz_file import frame_bytes, frame_from_bytes, recording_errors
from neurovis_spec.runtime.recording import Recording, after_rows, ended
from neurovis_spec.runtime.rows import KINDS, After, Rows, RowWriter, Steps
from neurovis_spec.runtime.wire import ARRAY, ENCODINGS, STRING, ArrayForm, Encoding, label_of, text_message, text_of
from neurovis_spec.version import __version__

#: the attachment that holds what does not grow with the steps
FRAME = "neurovis/frame.npz"
_FOREIGN = (
    "not a recording of NeuroVis: it does not say of which network it is; where it holds the topic 'spec', "
    "'neurovis ros play FILE --record NEW.mcap' makes one of it"
)
_ABOUT, _AFTER = "neurovis", "neurovis/after"
_LAST_TIME = (1 << 64) - 1
#: bytes that the frame may take
_MOST_FRAME = 1 << 30
#: bytes of what a file says of itself
_MOST_ABOUT = 8 << 20
#: the chunks of a file may always grow to this many bytes, and beyond that to so many times its size
_ROOM, _RATIO = 32 << 20, 20


def write_mcap(recording: Recording, path: Path) -> None:
    """Write a recording; what was there stays until all is written."""
    with part_of(path) as part:
        rows = _McapRows(part.file, recording)
        after = After(
            weights=recording.weights_after,
            reached=recording.reached,
            set_parameters=recording.set_parameters,
            lesioned_neurons=recording.lesioned_neurons,
            lesioned_connections=recording.lesioned_connections,
        )
        rows.put(recording.step.tolist(), recording.rows, after)
        rows.close()
        part.take_place()


@contextmanager
def stream_mcap(path: Path, frame: Recording, steps: Steps) -> Iterator[RowWriter]:
    """A writer for rows as they come. After an exception there is a part that holds the rows until then."""
    with part_of(path) as part:
        rows = _McapRows(part.file, frame, part, steps)
        yield rows
        rows.close()
        part.take_place()


def mcap_size(frame: Recording, steps: Steps) -> int:
    """About the bytes that a file takes."""
    each = [8 * width + 200 for width in frame.widths if width]
    each += [20 + len(frame.neurons[neuron]) for neuron in by_name(frame.by_name, len(frame.neurons))]
    return len(steps) * sum(each) + len(frame_bytes(frame)) + len(frame.spec)


class _McapRows:
    """Writes rows as messages; a chunk is with the system when a write returns."""

    def __init__(self, file: FileIO, frame: Recording, part: Part | None = None, steps: Steps | None = None) -> None:
        if frame.recorded is not None:
            raise RecordingError("a .mcap holds the activities of all neurons: record a part as .npz or .csv")
        if frame.recorded_weights is not None:
            raise RecordingError("a .mcap holds all changing weights or none: record a part as .npz or .csv")
        self._file, self._dt, self._part, self._steps = file, frame.dt, part, steps
        self._rows, self._synced, self._after = 0, monotonic(), ""
        base = f"{frame.namespace.rstrip('/')}/{frame.network or 'network'}"
        recorded = [name for name, width in zip(KINDS, frame.widths, strict=True) if width or name == "activity"]
        channels = [Channel(2, f"{base}/spec"), *(Channel(1, f"{base}/{name}") for name in recorded)]
        sizes = dict(zip(KINDS, frame.widths, strict=True))
        label = label_of(frame.hash)
        #: of each kind that is recorded its place in KINDS, its channel (1 is the spec) and the form of its messages
        self._channels = [
            (KINDS.index(name), n, ArrayForm.of(label, sizes[name], "cdr")) for n, name in enumerate(recorded, 2)
        ]
        about = {"network": frame.network, "hash": frame.hash, "dt": repr(frame.dt), "version": __version__}
        schemas, named = [Schema(*ARRAY), Schema(*STRING)], by_name(frame.by_name, len(frame.neurons))
        self._values = NamedValues.of(frame.neurons, named) if named else None
        if self._values is not None:
            schemas.append(Schema(SCHEMA, self._values.schema, "jsonschema"))
            channels.append(Channel(len(schemas), f"{base}/values", "json"))
        #: the channel of what has names
        self._named = len(channels)
        start = records.head("ros2", f"neurovis {__version__}") + records.metadata(_ABOUT, about)
        start += records.attachment(FRAME, frame_bytes(replace(frame, spiking=None)))  # spikes are not in it
        start += records.schemas_and_channels(schemas, channels)
        if frame.spec:
            start += records.chunk([Message(1, 0, 0, 0, text_message(frame.spec, "cdr"))])
        records.put(file, start)

    def write(self, rows: Rows, after: After) -> None:
        assert self._steps is not None
        count = len(rows.activity)
        self.put([self._steps.at(self._rows + row) for row in range(count)], rows, after)
        self._rows += count
        if self._part is not None:
            self._part.held = self._steps.at(self._rows - 1) if self._rows else None

    def put(self, steps: list[int], rows: Rows, after: After) -> None:
        """Rows of these steps, in chunks."""
        for chunk in records.chunks(self._messages(steps, rows)):
            records.put(self._file, chunk)
        end = {
            "reached": after.reached,
            "set_parameters": dict(after.set_parameters),
            "lesioned_neurons": after.lesioned_neurons.tolist(),
            "lesioned_connections": after.lesioned_connections.tolist(),
        }
        self._after, self._weights = json.dumps(end), after.weights.copy()
        if monotonic() - self._synced >= 1:
            os.fdatasync(self._file.fileno()) if hasattr(os, "fdatasync") else os.fsync(self._file.fileno())
            self._synced = monotonic()

    def _messages(self, steps: list[int], rows: Rows) -> Iterator[Message]:
        for row, step in enumerate(steps):
            seconds = step * self._dt
            time = min(round(seconds * 1e9), _LAST_TIME)
            for kind, channel, form in self._channels:
                data = form.message(step, seconds, rows[kind][row])
                yield Message(channel, step % (1 << 32), time, time, data)
            if self._values is not None:
                yield Message(self._named, step % (1 << 32), time, time, self._values.message(rows.activity[row]))

    def close(self) -> None:
        """What is true after the last step, then index and footer."""
        if self._after:
            weights = json.dumps(self._weights.tolist())
            records.put(self._file, records.metadata(_AFTER, {"after": self._after, "weights": weights}))
        records.finish(self._file)


def held_mcap(file: FileIO) -> int | None:
    """The last step that a part holds, None for none. Raises OSError."""
    try:
        return next((step for found in reversed(_chunks(file)) for step in reversed(_steps(file, found))), None)
    except (RecordingError, UnicodeDecodeError):
        return None


def _chunks(file: FileIO) -> list[Found]:
    return [found for found in records.scan(file) if found.opcode == records.CHUNK]


def _steps(file: FileIO, found: Found) -> list[int]:
    """The steps of a chunk's arrays."""
    messages = records.messages_of(records.content_of(file, found))
    return [one.sequence for one in messages if isinstance(one, Message) and one.channel > 1]


def finish_mcap(file: FileIO, part: Path, path: Path) -> None:
    """Turn the part of a run that broke off into a recording. Raises RecordingError, OSError."""
    records.finish(file)
    move(file, part, path)


def recover_mcap(part: Path) -> Recording:
    """Read a part up to its last whole chunk. Raises RecordingError."""
    reading = _Reading()
    with recording_errors(part):
        reading.read(part)
        return reading.recording(part, None)


def read_mcap(path: Path, run: int | None = None) -> Recording:
    """Read a recording, with the files that go on where it ends; of what breaks off what is whole, with a warning. Of
    several runs the one with this number, by default the last. Raises RecordingError."""
    reading, broken = _Reading(), list[Path]()
    for file in chain([path], following(path, reading.about, _about)):
        with recording_errors(file):
            if not reading.read(file):
                broken.append(file)
    with recording_errors(path):
        recording = reading.recording(path, run)
    for file in broken:
        last = f"up to step {recording.step[-1]}" if len(recording) else "no step"
        warnings.warn(f"{file} breaks off: it is read to its last whole chunk, {last}", stacklevel=4)
    return recording


def _about(path: Path) -> dict[str, str]:
    """What a file says of itself. Raises RecordingError."""
    with recording_errors(path):
        regular_size(path)
        with path.open("rb", buffering=1 << 16) as file:
            for found in records.scan(file):
                if found.opcode == records.METADATA:
                    reader = records.content_of(file, found, _MOST_ABOUT)
                    if reader.text() == _ABOUT:
                        return reader.mapping()
                elif found.opcode == records.CHUNK:
                    break
    return {}


class _Reading:
    """Reads the records of files one after the other."""

    def __init__(self) -> None:
        #: what the first file says of itself
        self.about: dict[str, str] = {}
        self._after: dict[str, str] = {}
        self._rows: Arrived | None = None
        self._spec = ""

    def read(self, path: Path) -> bool:
        """Read a file; whether it has come to its end. Raises RecordingError."""
        regular_size(path)
        with path.open("rb", buffering=1 << 16) as file:
            self._file = file
            #: of each channel of ours what it holds and how
            self._channels: dict[int, tuple[int, Encoding]] = {}
            self._known: set[int] = set()
            self._specs: dict[int, Encoding] = {}
            self._named = 0
            self._room = max(_ROOM, _RATIO * file.seek(0, io.SEEK_END))
            for found in records.scan(file):
                if found.opcode in (records.DATA_END, records.FOOTER):
                    return True
                try:
                    self._take(found)
                except DamagedError:
                    break
        return False

    def recording(self, path: Path, run: int | None) -> Recording:
        """What was read. Raises RecordingError."""
        if self._rows is None:
            raise RecordingError(_FOREIGN)
        recording = replace(self._rows.recording(path, run), spec=self._spec)
        return ended(recording, self._ended(recording))

    def _take(self, found: Found) -> None:
        """Read a record, if it is one of those that matter. Raises RecordingError, DamagedError."""
        if found.opcode == records.ATTACHMENT and found.length <= _MOST_FRAME and self._rows is None:
            reader = records.content_of(self._file, found)
            reader.take(16)  # its two times
            name = reader.text()
            reader.text()  # its type
            if name == FRAME:
                self._rows = Arrived(frame_from_bytes(reader.take(reader.number(8))))
        elif found.opcode == records.METADATA:
            reader = records.content_of(self._file, found)
            name = reader.text()
            if name == _AFTER:
                self._after = reader.mapping()
            elif name == _ABOUT and not self.about:
                self.about.update(reader.mapping())
        elif found.opcode == records.CHANNEL:
            self._named += 1
            if self._named > records.MOST_NAMED:
                raise RecordingError("it holds more channels than there are numbers for")
            self._channel(records.topic_of(records.content_of(self._file, found)))
        elif found.opcode == records.CHUNK:
            content = records.content_of(self._file, found)
            self._room -= records.expanded_size(content)
            if self._room < 0:
                raise RecordingError("not a recording: it grows out of all proportion")
            for message in records.messages_of(content):
                if isinstance(message, Message):
                    self._message(message)
                elif isinstance(message, Topic):
                    self._channel(message)

    def _channel(self, topic: Topic) -> None:
        """Note what a channel holds; topics of others are known and passed over."""
        self._known.add(topic.channel)
        kind = topic.topic.rpartition("/")[2]
        encoding = next((one for one in ENCODINGS.values() if one == topic.encoding), None)
        if encoding is None:
            return
        if kind == "spec":
            self._specs[topic.channel] = encoding
        elif kind in KINDS:
            self._channels[topic.channel] = KINDS.index(kind), encoding

    def _message(self, message: Message) -> None:
        """Take a spec or a row. Raises RecordingError."""
        if message.channel in self._specs:
            self._spec = text_of(message.data, self._specs[message.channel])
            return
        if message.channel not in self._channels:
            if message.channel not in self._known:
                raise RecordingError("a message is of a channel that there is not")
            return
        kind, encoding = self._channels[message.channel]
        if self._rows is None:
            raise RecordingError(_FOREIGN)
        self._rows.take(kind, message.log_time, message.data, encoding)

    def _ended(self, recording: Recording) -> After:
        """What is true after the last step; what the file does not say, as its rows do. Raises RecordingError."""
        changing = len(recording.plastic)
        by_rows = after_rows(recording.step, recording.weights, changing)
        if not self._after:
            return replace(by_rows, set_parameters=recording.set_parameters)
        end, weights = json.loads(self._after["after"]), json.loads(self._after["weights"])
        n, m = len(recording.neurons), len(recording.sources)
        lesioned = [
            np.array(end[name], dtype=np.int64).reshape(-1) for name in ("lesioned_neurons", "lesioned_connections")
        ]
        reached = end["reached"]
        values = np.array(weights, dtype=np.float64).reshape(changing)
        for indices, high in zip(lesioned, (n, m), strict=True):
            if len(indices) and (indices.min() < 0 or indices.max() >= high):
                raise RecordingError("it says that parts are lesioned that are not there")
        if type(reached) is not int or not 0 <= reached < 2**62:
            raise RecordingError(f"'reached' is {reached}")
        set_parameters = {str(name): float(value) for name, value in dict(end["set_parameters"]).items()}
        return After(values, reached, set_parameters, *lesioned)


def numbered(path: Path, number: int) -> Path:
    """The path of the file with a number, from 0; of a folder, the file in it."""
    if not path.suffix:
        return path / f"{path.name}_{number}.mcap"
    return path if not number else path.with_name(f"{path.stem}-{number}{path.suffix}")


def following(path: Path, about: Mapping[str, str], about_of: Callable[[Path], Mapping[str, str]]) -> Iterator[Path]:
    """The further files of a recording, by what each says ``about`` itself: it is one of the same recording."""
    number = 1
    while "recording" in about and numbered(path, number).is_file():
        try:
            said = about_of(numbered(path, number))
        except RecordingError:
            return
        if said.get("recording") != about["recording"]:
            return
        yield numbered(path, number)
        number += 1
