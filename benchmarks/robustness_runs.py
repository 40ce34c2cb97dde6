"""Recordings and checkpoints that lie: what somebody may be sent, and loads.

In: nothing. Out: cases for ``robustness.py``, each a function that writes a file into a folder, one that loads it, and
what that may cost. What comes out is a recording, as far as the file is whole, or an error that says why there is none.
"""

from __future__ import annotations

import io
import json
import random
import struct
import tempfile
import warnings
import zipfile
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard

import neurovis_spec as nv
from neurovis_spec.runtime import mcap_records as records
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.npz_file import frame_bytes

SPEC = """\
neurovis: 1
name: x
seed: 1
time: {steps: 40}
neurons: {A: {count: 3, bias: 1 + i, model: leaky_integrator, noise: "normal(0, 0.1)"}, O: {}}
connections:
  A -> O: {weight: 0.1, delay: 3, plasticity: {oja: {rate: 0.01}}}
outputs: {membrane: A.v}
"""
OTHER = SPEC.replace("seed: 1", "seed: 2")
#: How many bytes are changed, one after the other.
FLIPS = 300
MANY = 1_000_000


class Attempt(NamedTuple):
    """A file, how it is loaded, and its budget in seconds and MiB."""

    data: Callable[[], bytes]
    load: Callable[[Path], list[str]]
    seconds: float
    mib: float


@cache
def network(text: str = SPEC) -> nv.CompiledNetwork:
    return nv.compile_text(text)


@cache
def whole(suffix: str, text: str = SPEC) -> bytes:
    """A sound file: a recording, or (``.state``) a checkpoint."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"x{suffix}"
        if suffix == ".state":
            network(text).run(checkpoint=path)
        else:
            network(text).run_to(path)
        return path.read_bytes()


def load(path: Path) -> list[str]:
    """Load a file; what was said."""
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            if path.suffix == ".state":
                network().simulator().restore(path)
            else:
                recording = nv.load(path)
                recording.neurons, recording.connection_names, recording.missing  # noqa: B018
    except RecordingError as error:
        return [str(error).partition(": ")[2][:60]]
    return ["a part of it" if told else "all of it"]


def load_flipped(path: Path) -> list[str]:
    """Load a file time and again, one byte of it changed, drawn with a seed."""
    data, draw = path.read_bytes(), random.Random(1)
    for _ in range(FLIPS):
        place, other = draw.randrange(len(data)), draw.randrange(1, 256)
        path.write_bytes(data[:place] + bytes([data[place] ^ other]) + data[place + 1 :])
        load(path)
    return [f"{FLIPS} files"]


def arrays(suffix: str, change: Callable[[dict[str, np.ndarray]], object]) -> Callable[[], bytes]:
    """An archive with some of its arrays changed."""

    def data() -> bytes:
        with np.load(io.BytesIO(whole(suffix))) as file:
            held = dict(file)
        change(held)
        stream = io.BytesIO()
        np.savez_compressed(stream, **held)
        return stream.getvalue()

    return data


def about(suffix: str, change: Callable[[str], str]) -> Callable[[], bytes]:
    """An archive with another ``about``."""
    return arrays(suffix, lambda held: held.update(about=np.array(change(str(held["about"])))))


def archive(members: Iterator[tuple[str, bytes]]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as made:
        for name, data in members:
            made.writestr(name, data)
    return stream.getvalue()


def npy(shape: str, descr: str = "<f8", data: bytes = b"") -> bytes:
    header = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


def member(suffix: str, name: str, data: bytes) -> Callable[[], bytes]:
    """An archive with another member of this name."""

    def made() -> bytes:
        with zipfile.ZipFile(io.BytesIO(whole(suffix))) as held:
            kept = [(one, held.read(one)) for one in held.namelist() if one != name]
        return archive(iter([*kept, (name, data)]))

    return made


def starts() -> dict[int, records.Found]:
    """The first record of each kind in a sound .mcap."""
    found: dict[int, records.Found] = {}
    for one in records.scan(io.BytesIO(whole(".mcap"))):
        found.setdefault(one.opcode, one)
    return found


def before_chunks(*more: bytes) -> bytes:
    """A .mcap up to its first chunk, and then something else."""
    return whole(".mcap")[: starts()[records.CHUNK].start] + b"".join(more)


def chunk(data: bytes, size: int, compression: str = "") -> bytes:
    """A chunk that says that it grows to so many bytes."""
    start = struct.pack("<QQQI", 0, 0, size, 0)
    return records.record(records.CHUNK, start, records.text(compression), struct.pack("<Q", len(data)), data)


def lying(opcode: int, at: int, value: int, size: int = 8) -> Callable[[], bytes]:
    """A .mcap in whose first record of a kind a number, at this byte of its content, is another one."""

    def data() -> bytes:
        place = starts()[opcode].content + at
        return whole(".mcap")[:place] + value.to_bytes(size, "little") + whole(".mcap")[place + size :]

    return data


def _chunks() -> bytes:
    """The chunks of a sound .mcap."""
    sound = whole(".mcap")
    return b"".join(
        sound[one.start : one.end] for one in records.scan(io.BytesIO(sound)) if one.opcode == records.CHUNK
    )


def zeros(size: int) -> Iterator[bytes]:
    for _ in range(size >> 20):
        yield bytes(1 << 20)


def zstd(size: int) -> bytes:
    press = zstandard.ZstdCompressor(level=1).compressobj()
    return b"".join([*(press.compress(piece) for piece in zeros(size)), press.flush()])


def lz4_(size: int) -> bytes:
    with lz4.frame.LZ4FrameCompressor() as press:
        return b"".join([press.begin(), *(press.compress(piece) for piece in zeros(size)), press.flush()])


def framed(change: Callable[[dict[str, np.ndarray]], object]) -> Callable[[], bytes]:
    """A .mcap with another archive of what does not grow."""

    def data() -> bytes:
        with np.load(io.BytesIO(frame_bytes(network().run(0)))) as file:
            held = dict(file)
        change(held)
        stream = io.BytesIO()
        np.savez_compressed(stream, **held)
        return attached(stream.getvalue())

    return data


def attached(frame: bytes) -> bytes:
    found, sound = starts(), whole(".mcap")
    place = found[records.ATTACHMENT]
    return sound[: place.start] + records.attachment("neurovis/frame.npz", frame) + sound[place.end :]


def ended_with(after: str, weights: str = "[0, 0, 0]") -> Callable[[], bytes]:
    """A .mcap with another note of what is true after the last step."""
    note = {"after": after, "weights": weights}
    return lambda: before_chunks(records.metadata("neurovis/after", note), records.record(records.DATA_END, bytes(4)))


_TOLD = '{"reached": 1, "set_parameters": %s, "lesioned_neurons": %s, "lesioned_connections": []}'
_EMPTY_MESSAGE = records.record(records.MESSAGE, bytes(22))
_MCAP: dict[str, Callable[[], bytes]] = {
    "nothing at all": lambda: b"",
    "the first eight bytes": lambda: records.MAGIC,
    "a MiB at random": lambda: records.MAGIC + random.Random(1).randbytes(1 << 20),
    "broken off in the middle": lambda: whole(".mcap")[: len(whole(".mcap")) // 2],
    "broken off at the end": lambda: whole(".mcap")[:-40],
    "a record of 2^63 bytes, it says": lambda: before_chunks(struct.pack("<BQ", records.CHUNK, 1 << 63)),
    "a chunk of 2^63 bytes, it says": lying(records.CHUNK, 16, 1 << 63),
    "a chunk of none, it says": lying(records.CHUNK, 16, 0),
    "records of 2^63 bytes in a chunk": lying(records.CHUNK, 32, 1 << 63),
    "a chunk whose checksum lies": lying(records.CHUNK, 24, 1, 4),
    "an unknown compression": lambda: before_chunks(chunk(b"x" * 100, 100, "x" * 100)),
    "zstd: 1 GiB, it says so": lambda: before_chunks(chunk(zstd(1 << 30), 1 << 30, "zstd")),
    "zstd: 1 GiB, it says 1 KiB": lambda: before_chunks(chunk(zstd(1 << 30), 1 << 10, "zstd")),
    "zstd: 1 GiB, it says 32 MiB": lambda: before_chunks(chunk(zstd(1 << 30), 32 << 20, "zstd")),
    "zstd: fifty chunks of 32 MiB": lambda: before_chunks(*[chunk(zstd(32 << 20), 32 << 20, "zstd")] * 50),
    "zstd that is none": lambda: before_chunks(chunk(b"x" * 100, 1000, "zstd")),
    "lz4: 1 GiB, it says so": lambda: before_chunks(chunk(lz4_(1 << 30), 1 << 30, "lz4")),
    "lz4: 1 GiB, it says 1 KiB": lambda: before_chunks(chunk(lz4_(1 << 30), 1 << 10, "lz4")),
    "lz4: fifty chunks of 32 MiB": lambda: before_chunks(*[chunk(lz4_(32 << 20), 32 << 20, "lz4")] * 50),
    "a million messages without a channel": lambda: before_chunks(
        chunk(_EMPTY_MESSAGE * MANY, len(_EMPTY_MESSAGE) * MANY)
    ),
    "a million messages of a text": lambda: before_chunks(
        *[chunk(records.record(records.MESSAGE, b"\1" + bytes(21)) * 2000, 31 * 2000)] * 500
    ),
    "a million channels": lambda: before_chunks(
        *(records.record(records.CHANNEL, struct.pack("<HH", n % 65536, 1), records.text("x")) for n in range(MANY))
    ),
    "a million schemas in a chunk": lambda: before_chunks(
        chunk(records.record(records.SCHEMA, b"") * MANY, 9 * MANY)
    ),
    "300,000 empty chunks": lambda: before_chunks(chunk(b"", 0) * 300_000),
    "a million attachments": lambda: before_chunks(records.attachment("x", b"") * MANY),
    "metadata of a million pairs": lambda: before_chunks(
        records.metadata("neurovis/after", {str(number): "" for number in range(MANY)})
    ),
    "metadata of 2^32 pairs, it says": lambda: before_chunks(
        records.record(records.METADATA, records.text("neurovis/after"), b"\xff" * 4)
    ),
    "an end that is no JSON": ended_with("[" * 100_000),
    "an end of ten million brackets": ended_with("[" * 10_000_000),
    "an end of a million weights": ended_with(_TOLD % ("{}", "[]"), json.dumps([0] * MANY)),
    "an end of a number of a million digits": ended_with(_TOLD % ("{}", "[]"), "[" + "9" * MANY + "]"),
    "an end of a million parameters": ended_with(_TOLD % (json.dumps({str(n): 1 for n in range(MANY)}), "[]")),
    "an end that lesions a million neurons": ended_with(_TOLD % ("{}", json.dumps([9] * MANY))),
    "the frame of 1 GiB of zeros": lambda: attached(
        archive(iter([("activity.npy", npy("(0, 4)")), ("neurons.npy", npy("(134217728,)", "<U2", bytes(1 << 30)))]))
    ),
    "the frame of 2^50 neurons, it says": framed(lambda held: held.update(activity=np.zeros((0, 1 << 50)))),
    "the frame of objects": framed(lambda held: held.update(neurons=np.array([{}] * 4, dtype=object))),
    "the frame of other types": framed(lambda held: held.update(sources=np.array(["a", "b", "c"]))),
    "the frame of a picture": lambda: attached(b"\x89PNG\r\n\x1a\n" * 1000),
    "no frame": lambda: whole(".mcap").replace(b"neurovis/frame.npz", b"neurovis/other.npz"),
    "steps that go back": lambda: before_chunks(_chunks() * 2),
    "messages of another network": lambda: whole(".mcap").replace(network().hash.encode(), b"0" * 64),
}  # fmt: skip

_BOTH: dict[str, Callable[[str], Callable[[], bytes]]] = {
    "nothing at all": lambda suffix: lambda: b"",
    "an archive that is none": lambda suffix: lambda: b"PK\x03\x04" + bytes(100),
    "broken off in the middle": lambda suffix: lambda: whole(suffix)[: len(whole(suffix)) // 2],
    "broken off at the end": lambda suffix: lambda: whole(suffix)[:-40],
    "1 GiB of zeros": lambda suffix: member(suffix, "activity.npy", npy("(33554432, 4)", "<f8", bytes(1 << 30))),
    "1 GiB of zeros, a text": lambda suffix: member(suffix, "about.npy", npy("()", "<U268435456", bytes(1 << 30))),
    "1e12 numbers, it says": lambda suffix: member(suffix, "activity.npy", npy("(1000000, 1000000)")),
    "a header of brackets": lambda suffix: member(suffix, "weights.npy", npy("(" * 9000)),
    "objects": lambda suffix: arrays(suffix, lambda held: held.update(weights=np.array([{}] * 3, dtype=object))),
    "texts for numbers": lambda suffix: arrays(suffix, lambda held: held.update(weights=np.array([["x"] * 3]))),
    "complex numbers": lambda suffix: arrays(suffix, lambda held: held.update(activity=held["activity"] + 1j)),
    "too many dimensions": lambda suffix: arrays(suffix, lambda held: held.update(activity=held["activity"][None])),
    "an array too few": lambda suffix: arrays(suffix, lambda held: held.pop("weights")),
    "20,000 arrays more": lambda suffix: lambda: _crowded(suffix),
    "a text of brackets": lambda suffix: about(suffix, lambda text: "[" * 1000),
    "a text of a huge number": lambda suffix: about(suffix, lambda text: "9" * 1000),
    "a text that is a list": lambda suffix: about(suffix, lambda text: "[]"),
}


def _crowded(suffix: str) -> bytes:
    with zipfile.ZipFile(io.BytesIO(whole(suffix))) as held:
        kept = [(one, held.read(one)) for one in held.namelist()]
    return archive(iter([*((f"{number}.npy", b"") for number in range(20_000)), *kept]))


_STATE: dict[str, Callable[[], bytes]] = {
    "of another network": lambda: whole(".state", OTHER),
    "a recording": lambda: whole(".npz"),
    "a million clamps": arrays(
        ".state",
        lambda held: held.update(
            clamps=np.zeros((MANY, 3), np.int64), clamped=np.zeros(0, np.int64), clamp_values=np.zeros(MANY)
        ),
    ),
    "a clamp of −1 neurons": arrays(
        ".state", lambda held: held.update(clamps=np.array([[5, -1, -1]]), clamp_values=np.zeros(1))
    ),
    "a clamp of 2^62 neurons": arrays(
        ".state", lambda held: held.update(clamps=np.array([[5, -1, 1 << 62]] * 4), clamp_values=np.zeros(4))
    ),
    "step 10^300": about(".state", lambda text: text.replace('"k": 40', '"k": 1e300')),
}
_NPZ: dict[str, Callable[[], bytes]] = {
    "a checkpoint": lambda: whole(".state"),
    "connections of neurons that are not there": arrays(".npz", lambda held: held.update(sources=held["sources"] + 9)),
    "steps that go back": arrays(".npz", lambda held: held.update(step=held["step"][::-1])),
    "a view of a million neurons": about(
        ".npz", lambda text: json.dumps({**json.loads(text), "views": {"v": [[0] * MANY, False]}})
    ),
    "250,000 views": about(
        ".npz", lambda text: json.dumps({**json.loads(text), "views": {str(n): [[0], True] for n in range(MANY // 4)}})
    ),
}
#: files that hold much, all of it as it should be
BUDGETS = {"250,000 views": (2, 200)}
#: title → name → attempt
SUFFIXES = {"recordings, .mcap": ".mcap", "recordings, .npz": ".npz", "checkpoints": ".state"}
RUNS: dict[str, dict[str, Attempt]] = {
    "recordings, .mcap": {
        **{name: Attempt(data, load, 2, 200) for name, data in _MCAP.items()},
        f"{FLIPS} times, a byte is another": Attempt(lambda: whole(".mcap"), load_flipped, 6, 60),
    },
    **{
        title: {
            **{name: Attempt(made(suffix), load, 0.2, 60) for name, made in _BOTH.items()},
            **{name: Attempt(data, load, *BUDGETS.get(name, (0.2, 60))) for name, data in more.items()},
            f"{FLIPS} times, a byte is another": Attempt(partial(whole, suffix), load_flipped, 3, 60),
        }
        for title, suffix, more in (("recordings, .npz", ".npz", _NPZ), ("checkpoints", ".state", _STATE))
    },
}
