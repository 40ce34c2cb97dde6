"""The protocol: what goes between the server and a page, as bytes and texts (docs/live.md has every message).

In: looks and statuses; texts from clients, which are trusted with nothing. Out: messages; commands whose shape
and range are checked.
"""

from __future__ import annotations

import json
import math
import re
import struct
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from operator import attrgetter
from typing import Final, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from neurovis_spec.body import text_of
from neurovis_spec.compiler.drawing.pins import FARTHEST
from neurovis_spec.diagnostics import Diagnostic
from neurovis_spec.layout.model import Point
from neurovis_spec.live.as_events import as_events
from neurovis_spec.live.clock import SPEEDS
from neurovis_spec.live.commands import (
    MOST,
    Appearance,
    Branch,
    Command,
    Compare,
    Draw,
    Event,
    Fetch,
    Fit,
    Forget,
    Into,
    Keep,
    Loop,
    Measure,
    Pause,
    PlaceNeuron,
    Play,
    Rekeep,
    Rename,
    Request,
    Restart,
    Restore,
    Save,
    Seek,
    Speed,
    Step,
    Switch,
    Undo,
    Unkeep,
    Unloop,
    Unmeasure,
    Unplace,
    What,
    Write,
)
from neurovis_spec.live.drawing import Moved
from neurovis_spec.live.futures import Future
from neurovis_spec.live.held import KINDS
from neurovis_spec.live.history import Bins, Range
from neurovis_spec.live.run import Status
from neurovis_spec.live.saved_views import SHOWN, SavedView
from neurovis_spec.live.saving import MOST_SECONDS
from neurovis_spec.live.source import Drawn, Reach
from neurovis_spec.live.sums import SumArray
from neurovis_spec.live.turns import Feed, Hold, Learn, Lesion, Mend, Release, Set, Turn, Turned, Weigh, is_finite
from neurovis_spec.live.typed import LONGEST
from neurovis_spec.live.undefined import Undefined
from neurovis_spec.live.view import Glance
from neurovis_spec.live.windows import Window
from neurovis_spec.themes import THEMES

#: The first byte of a binary message from the server.
SCENE, FRAME, TRACE, FILE, RASTER, LEFT, HELD, SUMS, JOINED, ADDED, PAIRS, ASIDE, LEFT_PAIRS = range(1, 14)
#: kind, scene
_SCENE_HEAD = struct.Struct("<BxH")
#: kind
_ASIDE_HEAD = struct.Struct("<B3x")
#: kind, scene, how many bundles
_SUMS_HEAD = struct.Struct("<BxHI")
#: kind, scene, serial, changed, step, first, last, bytes of the caption, numbers of the pose
_HEAD = struct.Struct("<BxHIIdddHH")
#: The most numbers of a pose; of a body with more there is no picture.
_POSED = (1 << 16) - 1
#: kind, scene, traces, the bins: the first step, steps in each, how many
_TRACE_HEAD = struct.Struct("<BxHIdII")
#: kind, scene, item, the bins as those of traces, how many rows, bytes of the names
_RASTER_HEAD = struct.Struct("<BxHIdIIHH")
#: What a cell of a raster is of whose steps nothing is known; a share of 1 is one less.
_UNKNOWN = 255
#: A message of a client: at most so many bytes, names so many characters.
LARGEST, _LONGEST = 16_384, 4096
#: The most steps there can be (a double holds each).
_MOST = (1 << 53) - 1
#: The most components of an input, and parameters set at once.
_MANY = 1024
#: The most items whose values a client gets, and the id of one: of a neuron or a connection, perhaps with the name of
#: something that it has; or of an error, an input, a measure, a sensor.
_WATCHED, _ITEM = 64, re.compile(r"[nceims][0-9]{1,8}(\.[A-Za-z_]\w{0,4095})?", re.ASCII)
#: The gains of Eqs. 2–5.
_GAINS = ("activity", "signal", "thickness", "change")
#: The most items that a client is sent traces of at once, and rasters, the most bins, and steps in each.
_TRACED, _RASTERS, _BINS, _EVERY = 24, 8, 2048, 1 << 32
#: The most turns and events that are listed, the latest turns and the first events.
_LISTED = 1000
#: The most turns by which a future is called.
_SAID = 4
#: The most characters of the name of a future.
_CALLED = 80
#: The most steps that are made at once.
_NEAR = 64


class ProtocolError(ValueError):
    """A message that no page of ours sends."""


# --- what the server sends


def scene_message(content: bytes, version: int) -> bytes:
    """The scene with its version, which frames name."""
    return _SCENE_HEAD.pack(SCENE, version) + content


def joined_message(content: bytes, version: int) -> bytes:
    """What runs from and to the boxes that a client has closed, in a scene of this version."""
    return _SCENE_HEAD.pack(JOINED, version) + content


def sums_message(sums: SumArray, version: int, changed: npt.NDArray[np.int64], kind: int = SUMS) -> bytes:
    """What bundles add up to, those that have ``changed``, or of the ``kind`` ADDED what closed boxes join."""
    rows = np.ascontiguousarray(sums[changed], "<f4")
    return _SUMS_HEAD.pack(kind, version, len(changed)) + changed.astype("<u4").tobytes() + rows.tobytes()


def held_message(content: bytes, version: int) -> bytes:
    """The connections of what a client holds, in a scene of this version."""
    return _SCENE_HEAD.pack(HELD, version) + content


def frame_message(glance: Glance, reach: Reach, version: int, serial: int, changed: npt.NDArray[np.int64]) -> bytes:
    """A frame: all colours, and of the ``changed`` items (connections, then neurons) widths, glows and kinds; and the
    pose of the body with what its motors were told."""
    lines = len(glance.lines)
    of_lines = np.minimum(changed, max(lines - 1, 0))
    none = np.zeros(len(changed), np.uint16)
    widths, glows = (values[of_lines] if lines else none for values in (glance.widths, glance.glows))
    words = glance.caption.encode("utf-8", "replace")[:4096]
    pose = np.concatenate([glance.pose, glance.told]) if len(glance.pose) else glance.pose
    pose = pose if len(pose) <= _POSED else pose[:0]
    counts = len(words), len(pose)
    head = _HEAD.pack(FRAME, version, serial, len(changed), glance.step, reach.first, reach.last, *counts)
    colours = glance.discs.tobytes() + glance.lines.tobytes()
    parts = [
        *(head, changed.astype("<u4").tobytes(), widths.astype("<u2").tobytes(), glows.astype("<u2").tobytes()),
        *(glance.kinds[changed].tobytes(), colours, words, pose.astype("<f4").tobytes()),
    ]
    return b"".join(parts)


def aside_message(message: bytes) -> bytes:
    """A frame, or what is added up, of the branch that is shown beside the run."""
    return _ASIDE_HEAD.pack(ASIDE) + message


def status_message(status: Status, owner: bool, takes: frozenset[str] = frozenset()) -> str:
    """How the run stands. ``takes`` are the messages that are taken besides those that its source takes."""
    able = status.capabilities
    return _text(
        "status",
        playing=status.playing,
        speed="max" if math.isinf(status.speed) else f"{status.speed:g}",
        ended=status.ended,
        owner=owner,
        can={"takes": sorted(able.takes | takes), "ends": able.ends, "arrives": able.arrives},
        parameters={name: value for name, value in status.parameters.items() if math.isfinite(value)},
        fed={name: list(values) for name, values in status.fed.items() if all(map(math.isfinite, values))},
        learning=dict(status.learning),
        turned=[_listed(entry) for entry in status.turned[-_LISTED:]],
        copied=as_events(status.turned[-_LISTED:]).text,
        events=list(status.events[:_LISTED]),
        appearance=asdict(status.appearance),
        backend=status.backend,
        loop=None if status.loop is None else list(status.loop),
        measures=[{"number": number, "text": text} for number, text in status.measures],
        futures=[_future(one) for one in status.futures.all],
        dropped=status.futures.dropped,
        current=status.futures.now,
        branch=status.branch,
        compared=status.compared,
    )


def body_message(body: Drawn) -> str:
    """How the pose is drawn that frames have from now on, and where the body was when the view began; null where there
    is nothing to draw."""
    skeleton = body.skeleton
    if skeleton is None or skeleton.size + len(body.motors) > _POSED:
        return _text("body", skeleton=None, start=[0.0, 0.0], motors=[])
    motors = [[one.point, one.name, *(end if math.isfinite(end) else None for end in one[2:])] for one in body.motors]
    return _text("body", skeleton=json.loads(text_of(skeleton)), start=list(body.start), motors=motors)


def undefined_message(undefined: Undefined | None) -> str:
    """What is not finite, and since when; nothing where all is."""
    if undefined is None:
        return _text("undefined", item="", since=0, known=True, count=0)
    return _text("undefined", **asdict(undefined))


def _future(future: Future) -> dict[str, object]:
    """A future, with what was turned in it since it went on differently, and those within it."""
    begin = bisect_left(future.turned, future.at, key=attrgetter("step"))  # with each frame, of thousands in a drag
    own = [_turned(entry) for entry in future.turned[begin : begin + _SAID]]
    within = [_future(one) for one in future.within]
    named = {"number": future.number, "name": future.name, "older": future.older}
    return {**named, "at": future.at, "last": future.last, "turned": own, "within": within}


def _listed(entry: Turned) -> dict[str, object]:
    """A turn with its number, what takes it back, and of a drag the step at which it began."""
    more = {} if entry.since is None else {"since": entry.since}
    back = entry.back if entry.back is None or is_finite(entry.back) else None  # JSON has no word for what is not
    return {**_turned(entry), "number": entry.number, "back": back and _message(back), **more}


def _turned(entry: Turned) -> dict[str, object]:
    """A turn, and the step after which it was taken."""
    return {"step": entry.step, **_message(entry.turn)}


def _message(turn: Turn) -> dict[str, object]:
    """A turn as a client asks for it."""
    return {"type": type(turn).__name__.lower(), **asdict(turn)}


#: Of how many of what an item stands for so many are lesioned, where these are not all.
Partly: TypeAlias = Mapping[str, tuple[int, int]]


def values_message(
    step: int, values: Mapping[str, float], other: Mapping[str, float], lost: tuple[Partly, Partly]
) -> str:
    """Exact values of what a client looks at, and those of the branch beside the run, null for what is no finite
    number; and of both what is lesioned in part."""
    known, beside = (
        {name: value if math.isfinite(value) else None for name, value in some.items()} for some in (values, other)
    )
    return _text("values", step=step, values=known, other=beside, lost=lost[0], otherLost=lost[1])


def trace_message(version: int, traces: Mapping[tuple[int, int], Range], bins: Bins, kind: int = TRACE) -> bytes:
    """Traces of items (``View.place``), each with what of it that is: 0 its activity or weight, else the
    number of a name in the list that the scene has for it, from 1 on. The least and the largest value of each bin. Of
    the ``kind`` LEFT they are those of another future; of PAIRS, and LEFT_PAIRS, a bin is a step."""
    head = _TRACE_HEAD.pack(kind, version, len(traces), bins.first, bins.every, bins.count)
    items = np.array(list(traces), "<u4").reshape(-1, 2).T
    return b"".join([head, items.tobytes(), *(trace.astype("<f4").tobytes() for trace in traces.values())])


def raster_message(version: int, item: int, names: Sequence[str], rows: Sequence[Range], bins: Bins) -> bytes:
    """The spikes of neurons in rows, of each the ranges of the share that fires; ``names`` are those of the first and
    the last neuron. The largest share of each bin is a byte: at least 1 where any fires."""
    shares = np.array([row[:, 1] for row in rows], np.float64).reshape(len(rows), bins.count)
    cells = np.where(np.isnan(shares), _UNKNOWN, np.ceil((_UNKNOWN - 1) * np.clip(shares, 0, 1))).astype(np.uint8)
    words = "\n".join(names).encode()[: (1 << 16) - 1]
    head = _RASTER_HEAD.pack(RASTER, version, item, bins.first, bins.every, bins.count, len(rows), len(words))
    return head + words + cells.tobytes()


def measured_message(text: str, found: Sequence[Diagnostic]) -> str:
    """Whether a text is a measure: what is wrong with it, from one character to another, nothing where all is well."""
    told = [
        {"start": one.span.column - 1, "end": one.span.end_column - 1, "message": one.message, "hint": one.hint or ""}
        for one in found
    ]
    return _text("measured", text=text, findings=told)


def findings_message(text: str, errors: bool) -> str:
    """What was noticed about an edited spec, as ``validate`` shows it; nothing: all is well."""
    return _text("findings", text=text, errors=errors)


def file_message(name: str, data: bytes) -> bytes:
    """A file to be saved by a browser: kind, bytes of the name, the name, the file."""
    words = name.encode()
    return struct.pack("<BxH", FILE, len(words)) + words + data


def moved_message(moved: Moved) -> str:
    """Where discs and lines are while a neuron is dragged, in units of the picture."""
    return _text("moved", discs=dict(moved.discs), lines={name: list(line) for name, line in moved.lines.items()})


def placed_message(neurons: Sequence[str], undo: bool, files: bool) -> str:
    """The neurons that were put by hand and are not saved; whether that can be undone, and saved."""
    return _text("placed", neurons=list(neurons), undo=undo, files=files)


def saving_message(files: Sequence[str], diff: str, written: bool, into: Into = "spec") -> str:
    """What would change in which files, or that these are written; ``into`` is what was asked for."""
    return _text("saving", files=list(files), diff=diff, written=written, into=into)


def views_message(file: str, views: Mapping[str, SavedView], findings: str) -> str:
    """The views that are saved, in which file, and what is wrong with that, as ``validate`` shows it."""
    return _text("views", file=file, views={name: asdict(view) for name, view in views.items()}, findings=findings)


def making_message(done: int, total: int) -> str:
    """How far a file is that was asked for."""
    return _text("making", done=done, total=total)


def fitting_message(window: Window | None, shown: Window) -> str:
    """For which window the network is being laid out, None for none any more, and for which it is that is shown."""
    return _text("fitting", window=window, shown=shown)


def refused_message(reason: str) -> str:
    """Why what was asked is not done."""
    return _text("refused", reason=reason)


def _text(kind: str, **values: object) -> str:
    return json.dumps({"type": kind, **values}, ensure_ascii=False, separators=(",", ":"), allow_nan=False)


# --- what a client sends


@dataclass(frozen=True, slots=True)
class Acknowledged:
    """The client has drawn the frame of this serial."""

    serial: int


#: What of a message's values must hold.
Check: TypeAlias = Callable[[object], object]


@dataclass(frozen=True, slots=True)
class LookAt:
    """The client wants the exact values of neurons (``n3``) and connections (``c5``), or of what these have by a name
    (``c5.g``), with each frame; it is nobody else's business, so viewers may ask for it."""

    items: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Themed:
    """The client wants the picture in the theme of this name, "": as it is, and where nobody asks for a theme dark if
    its system is ``dark``; it is nobody else's business, so viewers may ask for it."""

    name: str
    dark: bool


@dataclass(frozen=True, slots=True)
class Trace:
    """The client wants to be sent once how some items went, in bins of steps, the ``rasters`` of the groups of some
    neurons, and of ``pairs`` that are drawn against each other the latest of these steps one by one; viewers may ask
    for it, too."""

    items: tuple[str, ...]
    bins: Bins
    rasters: tuple[str, ...] = ()
    pairs: tuple[str, ...] = ()
    #: the number of the future that it wants beside; by default that of the one that was left last
    branch: int | None = None

    @property
    def steps(self) -> Bins:
        """The latest of the steps, one by one."""
        bins = self.bins
        count = min(_BINS, bins.every * bins.count)
        return Bins(bins.first + bins.every * bins.count - count, 1, count)


@dataclass(frozen=True, slots=True)
class Connections:
    """The client wants once all connections ``of`` what it holds; viewers may ask for it, too."""

    of: str


@dataclass(frozen=True, slots=True)
class Close:
    """The client has closed these boxes, and wants what runs from and to them added up; viewers may ask for it, too."""

    boxes: tuple[str, ...]


#: What is nobody else's business, so that viewers may ask for it.
Wish: TypeAlias = LookAt | Themed | Trace | Connections | Close


def acknowledged(data: bytes) -> Acknowledged:
    """A binary message: four bytes. Raises ProtocolError."""
    if len(data) != 4:
        raise ProtocolError("a frame is acknowledged in four bytes")
    return Acknowledged(int.from_bytes(data, "little"))


def command_of(text: str) -> Command | Request | Wish:
    """A text message. Raises ProtocolError."""
    if len(text) > LARGEST:
        raise ProtocolError("the message is too long")
    try:
        message = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise ProtocolError("the message is no JSON") from None
    if not isinstance(message, dict):
        raise ProtocolError("a message is an object")
    kind = message.pop("type", None)
    wanted = _MESSAGES.get(kind) if isinstance(kind, str) else None
    if wanted is None:
        raise ProtocolError("the type of the message is unknown")
    checks, make = wanted
    if not _encodes(message):
        raise ProtocolError("the message holds half a character")
    if not set(checks) - _OPTIONAL <= set(message) <= set(checks):
        raise ProtocolError(f"a message '{kind}' has other members")
    return make(**{name: checks[name](value) for name, value in message.items()})


def _encodes(value: object) -> bool:
    """Whether all texts can be sent on: JSON may hold one half of a pair of surrogates."""
    try:
        json.dumps(value, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        return False
    return True


def _no_constant(name: str) -> object:
    raise ValueError(name)


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 1e300:
        raise ProtocolError("a finite number is wanted")
    return float(value)


def _whole(low: int, high: int) -> Callable[[object], int]:
    def check(value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise ProtocolError(f"an integer from {low} to {high} is wanted")
        return value

    return check


def _name(value: object) -> str:
    if not isinstance(value, str) or not 0 < len(value) <= _LONGEST:
        raise ProtocolError("a name is wanted")
    return value


def _measure_text(value: object) -> str:
    if not isinstance(value, str) or not 0 < len(value.strip()) <= LONGEST:
        raise ProtocolError(f"a measure of at most {LONGEST} characters is wanted")
    return value.strip()


def _called(value: object) -> str:
    if not isinstance(value, str) or len(value) > _CALLED:
        raise ProtocolError(f"a name of at most {_CALLED} characters is wanted")
    return _spaced(value)


def _spaced(name: str) -> str:
    """A name as it was typed, without what is blank at its ends; a tab within it is a blank."""
    return "".join(" " if one.isspace() else one for one in name.strip())


def _truth(value: object) -> bool:
    if not isinstance(value, bool):
        raise ProtocolError("true or false is wanted")
    return value


def _speed(value: object) -> float:
    if not isinstance(value, str) or value not in SPEEDS:
        raise ProtocolError(f"a speed is wanted: {', '.join(SPEEDS)}")
    return SPEEDS[value]


def _view(value: object) -> SavedView:
    of_view = set(SavedView.__slots__)
    if not isinstance(value, dict) or not of_view - {"window"} <= set(value) <= of_view:
        raise ProtocolError("all of a view is wanted")
    checks: dict[str, Check] = {
        "step": _whole(0, _MOST),
        "speed": _one_of(*SPEEDS),
        "camera": _camera,
        "curves": _texts,
        "theme": _theme,
        "closed": _texts,
        "shows": _one_of(*SHOWN),
        "window": _window,
    }
    made: Callable[..., SavedView] = SavedView
    return made(**{name: None if value.get(name) is None else check(value[name]) for name, check in checks.items()})


def _camera(value: object) -> tuple[float, float, float] | str:
    if value == "whole":
        return "whole"
    if not isinstance(value, list) or len(value) != 3:
        raise ProtocolError("a camera is wanted")
    zoom, x, y = (_number(number) for number in value)
    if zoom <= 0:
        raise ProtocolError("a camera is wanted")
    return zoom, x, y


def _texts(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) > _MANY:
        raise ProtocolError(f"at most {_MANY} texts are wanted")
    return tuple(_name(one) for one in value)


def _view_name(value: object) -> str:
    name = _spaced(_name(value))
    if not name:
        raise ProtocolError("a name is wanted")
    return name


def _theme(value: object) -> str:
    if not isinstance(value, str) or (value and value not in THEMES):
        raise ProtocolError(f"a theme is wanted: {', '.join(THEMES)}, or none")
    return value


def _factor(value: object) -> float:
    number = _number(value)
    if not 1 / MOST <= number <= MOST:
        raise ProtocolError(f"a number from 1/{MOST:g} to {MOST:g} is wanted")
    return number


def _draw(pathways: bool = False, **gains: float) -> Draw:
    return Draw(Appearance(**gains, pathways=pathways))


def _values(value: object) -> Mapping[str, float]:
    if not isinstance(value, dict) or not 0 < len(value) <= _MANY:
        raise ProtocolError("names with numbers are wanted")
    return {_name(name): _number(number) for name, number in value.items()}


def _numbers(value: object) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) > _MANY:
        raise ProtocolError("a list of numbers is wanted")
    return tuple(_number(number) for number in value)


def _point(value: object) -> Point:
    if not isinstance(value, list) or len(value) != 2:
        raise ProtocolError("a point is wanted")
    x, y = (_number(number) for number in value)
    if max(abs(x), abs(y)) > FARTHEST:
        raise ProtocolError(f"a point lies within {FARTHEST:g} of the origin")
    return x, y


def _seconds(value: object) -> float:
    number = _number(value)
    if not 0 < number <= MOST_SECONDS:
        raise ProtocolError(f"at most {MOST_SECONDS} seconds are wanted")
    return number


def _one_of(*texts: str) -> Check:
    def check(value: object) -> str:
        if not isinstance(value, str) or value not in texts:
            raise ProtocolError(f"one of these is wanted: {', '.join(texts)}")
        return value

    return check


_window: Final = _one_of(*get_args(Window))


def _items(value: object) -> tuple[str, ...]:
    if isinstance(value, list) and len(value) <= _WATCHED:
        found = [item for item in value if isinstance(item, str) and _ITEM.fullmatch(item)]
        if len(found) == len(value):
            return tuple(dict.fromkeys(found))
    raise ProtocolError(f"at most {_WATCHED} ids of neurons and connections are wanted")


def _trace(
    items: tuple[str, ...],
    first: int,
    every: int,
    bins: int,
    rasters: tuple[str, ...] = (),
    pairs: tuple[str, ...] = (),
    branch: int | None = None,
) -> Trace:
    if max(len(items), len(pairs)) > _TRACED or len(rasters) > _RASTERS:
        raise ProtocolError(f"at most {_TRACED} traces and {_RASTERS} rasters are wanted")
    if any(item[0] != "n" or "." in item for item in rasters):
        raise ProtocolError("rasters are of neurons")
    return Trace(items, Bins(first, every, bins), rasters, pairs, branch)


def _held(value: object) -> str:
    if not isinstance(value, str) or not KINDS.fullmatch(value):
        raise ProtocolError("the id of what can be held is wanted")
    return value


def _boxes(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) > _MANY:
        raise ProtocolError(f"at most {_MANY} ids of boxes are wanted")
    return tuple(_held(box) for box in value)


_MESSAGES: Final[Mapping[str, tuple[Mapping[str, Check], Callable[..., Command | Request | Wish]]]] = {
    "look": ({"items": _items}, LookAt),
    "trace": (
        {
            "items": _items,
            "rasters": _items,
            "pairs": _items,
            "branch": _whole(0, _MOST),
            "first": _whole(0, _MOST),
            "every": _whole(1, _EVERY),
            "bins": _whole(1, _BINS),
        },
        _trace,
    ),
    "connections": ({"of": _held}, Connections),
    "close": ({"boxes": _boxes}, Close),
    "play": ({}, Play),
    "pause": ({}, Pause),
    "step": ({"by": _whole(-_NEAR, _NEAR)}, Step),
    "seek": ({"step": _whole(0, _MOST)}, Seek),
    "event": ({"by": _whole(-1, 1)}, Event),
    "restart": ({}, Restart),
    "branch": ({}, Branch),
    "switch": ({"number": _whole(0, _MOST), "shown": _whole(0, _MOST)}, Switch),
    "theme": ({"name": _theme, "dark": _truth}, Themed),
    "compare": ({"number": _whole(-1, _MOST)}, Compare),
    "rename": ({"number": _whole(0, _MOST), "name": _called}, Rename),
    "forget": ({"number": _whole(0, _MOST)}, Forget),
    "restore": ({}, Restore),
    "undo": ({"number": _whole(0, _MOST)}, Undo),
    "draw": ({**dict.fromkeys(_GAINS, _factor), "pathways": _truth}, _draw),
    "speed": ({"value": _speed}, Speed),
    "measure": ({"text": _measure_text}, Measure),
    "loop": ({"first": _whole(0, _MOST), "last": _whole(0, _MOST)}, Loop),
    "unloop": ({}, Unloop),
    "unmeasure": ({"number": _whole(0, _MOST)}, Unmeasure),
    "set": ({"values": _values, "moving": _truth}, Set),
    "feed": ({"name": _name, "values": _numbers, "moving": _truth}, Feed),
    "hold": ({"neurons": _name, "value": _number, "moving": _truth}, Hold),
    "release": ({"neurons": _name}, Release),
    "lesion": ({"part": _name}, Lesion),
    "mend": ({"part": _name}, Mend),
    "learn": ({"connections": _name, "on": _truth}, Learn),
    "weigh": ({"connections": _name, "value": _number, "moving": _truth}, Weigh),
    "place": ({"neuron": _name, "at": _point, "done": _truth}, PlaceNeuron),
    "unplace": ({}, Unplace),
    "save": ({"into": _one_of(*get_args(Into))}, Save),
    "write": ({}, Write),
    "keep": ({"name": _view_name, "view": _view}, Keep),
    "unkeep": ({"name": _name}, Unkeep),
    "rekeep": ({"name": _name, "to": _view_name}, Rekeep),
    "fit": ({"window": _window}, Fit),
    "fetch": ({"what": _one_of(*get_args(What)), "seconds": _seconds}, Fetch),
}
#: Members that a message need not have.
_OPTIONAL: Final = {"moving", "pathways", "rasters", "pairs", "branch", "shown"}
#: The types of the messages that a client may send, for the tests of the documentation.
MESSAGES: Final = tuple(_MESSAGES)
