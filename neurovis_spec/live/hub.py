"""The hub: who looks on, what each of them is sent, the latest frame that it has room for, and what its messages do.

In: what a run shows, from its thread. Out: for each client the next messages, on the event loop. A client that has not
drawn the frames that it was sent gets no more; what changes meanwhile it gets with the next one. So a slow client sees
fewer frames, a stalled one none, and neither costs the others or the run anything. Many viewers see fewer frames each.
The messages of clients, who are trusted with nothing, however they came: the Reception asks the hub, the run and the
desk; what is refused is told.
"""

from __future__ import annotations

import asyncio
import json
import logging
import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

import numpy as np
import numpy.typing as npt

from neurovis_spec.live.aside import Compared
from neurovis_spec.live.commands import Fetch, Fit, Measure, Request
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.held import told_of
from neurovis_spec.live.history import Bins, History
from neurovis_spec.live.joined import Joined, joined
from neurovis_spec.live.protocol import (
    ADDED,
    LEFT,
    LEFT_PAIRS,
    PAIRS,
    TRACE,
    Close,
    Connections,
    LookAt,
    Themed,
    Trace,
    acknowledged,
    aside_message,
    body_message,
    command_of,
    frame_message,
    held_message,
    joined_message,
    measured_message,
    raster_message,
    refused_message,
    scene_message,
    status_message,
    sums_message,
    trace_message,
    undefined_message,
    values_message,
)
from neurovis_spec.live.run import Run, Shown, Status
from neurovis_spec.live.source import NOTHING, Drawn
from neurovis_spec.live.sums import SumArray
from neurovis_spec.live.typed import findings
from neurovis_spec.live.undefined import Undefined
from neurovis_spec.live.view import View

_LOG: Final = logging.getLogger(__name__)
#: Nothing is wanted.
AS_IT_IS: Final = Themed("", dark=False)

#: Frames that a client may be sent before it has drawn them.
AHEAD: Final = 2
#: Frames a second that all viewers together are sent, and the least that each is, where it has room.
_FRAMES_OF_ALL, _FRAMES_EACH = 2000, 20
#: After traces were read nobody's are for so many times as long: they take a quarter of the time at most.
_REST: Final = 3
#: Texts that wait for a client; of more the oldest are dropped.
_TEXTS: Final = 16


@dataclass(eq=False)
class Client:
    """Somebody who looks on, and who as the owner may ask for something."""

    owner: bool
    #: the theme that it wants
    wants: Themed = AS_IT_IS
    #: the version and the theme of the scene, the serial of the frame and the status that were sent last
    version: int = 0
    theme: str = ""
    sent: int = 0
    status: str = ""
    #: the body that it was told of
    body: Drawn = NOTHING
    #: what it was told of that is not finite
    undefined: Undefined | None = None
    #: the serials of frames that were sent and are not drawn yet
    ahead: deque[int] = field(default_factory=deque)
    #: what it wants the values of, and whether it has just asked
    items: tuple[str, ...] = ()
    asked: bool = False
    #: whether it is to be sent the branch that is shown beside the run
    renew: bool = False
    #: the traces that it wants, and those that it is to be sent
    wanted: Trace | None = None
    traces: tuple[bytes, ...] = ()
    #: what it holds, of which it is to be told all connections
    held: str = ""
    #: the boxes that it has closed, and what runs there of the scene of which version
    closed: tuple[str, ...] = ()
    joined: Joined | None = None
    added: SumArray | None = None
    texts: deque[str | bytes] = field(default_factory=lambda: deque(maxlen=_TEXTS))
    wake: asyncio.Event = field(default_factory=asyncio.Event)

    def tell(self, text: str | bytes) -> None:
        """Send a text when there is room."""
        self.texts.append(text)
        self.wake.set()


class Hub:
    """The clients of a run. ``takes`` are the messages that are taken besides those that its source takes. All methods
    but ``show``, ``watched``, ``refuse``, ``answer``, ``tell_soon`` and ``keep_soon`` are called on the event loop."""

    def __init__(self, loop: asyncio.AbstractEventLoop, takes: frozenset[str] = frozenset()) -> None:
        self._loop, self._takes = loop, takes
        self._clients: set[Client] = set()
        self._slot: Shown | None = None
        self._scheduled = False
        self._shown: Shown | None = None
        self._version, self._serial = 0, 0
        #: for each item (connections, then neurons) the serial of the frame in which it last changed
        self._changed_at: npt.NDArray[np.int64] = np.zeros(0, np.int64)
        #: the same of bundles
        self._summed_at: npt.NDArray[np.int64] = np.zeros(0, np.int64)
        self._frames: dict[int, bytes] = {}
        #: of the branch that is shown beside the run what it is, and what is sent of it
        self._aside_frame: tuple[Compared | None, tuple[bytes, ...]] = None, ()
        #: when viewers are sent the next frame, and what will do so where there is one
        self._next = 0.0
        self._timer: asyncio.TimerHandle | None = None
        #: who waits for traces, until when nobody is answered, and what will answer
        self._waiting: deque[Client] = deque()
        self._rest = 0.0
        self._reader: asyncio.TimerHandle | None = None
        #: who waits for connections, and whether somebody's are being looked up
        self._holding: deque[Client] = deque()
        self._looking = False
        self._statuses: dict[bool, str] = {}
        #: the scenes of the current version by their themes: None while one is made
        self._scenes: dict[str, bytes | None] = {}
        #: what those who come later are told, too, by its type
        self._kept: dict[str, str] = {}

    def __len__(self) -> int:
        return len(self._clients)

    @property
    def watched(self) -> bool:
        """Whether anybody looks on."""
        return bool(self._clients)

    def show(self, shown: Shown) -> None:
        """Have this seen, in place of what was not yet taken; from any thread, and without waiting."""
        self._slot = shown
        if not self._scheduled:
            self._scheduled = True
            self._call(self._take)

    def join(self, client: Client) -> None:
        """Somebody has come."""
        self._clients.add(client)
        for text in self._kept.values():
            client.tell(text)
        client.wake.set()

    def leave(self, client: Client) -> None:
        """Somebody has gone."""
        self._clients.discard(client)

    def tell(self, text: str, keep: str = "") -> None:
        """Tell all; with ``keep`` those who come later, too, until something else is kept by this name."""
        if keep:
            self._kept[keep] = text
        for client in self._clients:
            client.tell(text)

    def refuse(self, client: Client, reason: str) -> None:
        """Tell a client why what it asked is not done; from any thread."""
        self.answer(client, refused_message(reason))

    def answer(self, client: Client, text: str | bytes) -> None:
        """Tell a client something, from any thread."""
        self._call(client.tell, text)

    def tell_soon(self, text: str, keep: str = "") -> None:
        """``tell``, from any thread."""
        self._call(self.tell, text, keep)

    def keep_soon(self, text: str) -> None:
        """Tell all, and those who come later until there is another text of its type; from any thread."""
        self.tell_soon(text, json.loads(text)["type"])

    def _call(self, what: Callable[..., None], *values: object) -> None:
        """Have the loop call something, if it still runs."""
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(what, *values)

    def check(self, client: Client, items: tuple[str, ...]) -> None:
        """A client wants values: now, and with each frame."""
        client.items, client.asked = items, bool(items)
        client.wake.set()

    def trace(self, client: Client, wanted: Trace) -> None:
        """A client wants traces, in place of those that it has asked for before and not been sent yet."""
        if client.wanted is None:
            self._waiting.append(client)
        client.wanted = wanted
        self._read_soon()

    def _read_soon(self) -> None:
        """Have traces read if somebody waits for some, as soon as there is a picture."""
        if self._waiting and self._reader is None and self._shown is not None:
            self._reader = self._loop.call_at(self._rest, self._read_traces)

    def _read_traces(self) -> None:
        """Read traces for whoever has waited longest; the more of the processor it takes the longer is the rest."""
        begun, shown = time.thread_time(), self._shown
        client, self._reader = self._waiting.popleft(), None
        wanted, client.wanted = client.wanted, None
        if client in self._clients and shown is not None and wanted is not None:
            read = partial(self._traces, shown.view)
            left = shown.status.futures.history(wanted.branch)
            both = (() if left is None else ((left, LEFT, LEFT_PAIRS),)) + ((shown.history, TRACE, PAIRS),)
            client.traces = (
                *(read(history, wanted.items, wanted.bins, kind) for history, kind, _ in both),
                *(read(history, wanted.pairs, wanted.steps, kind) for history, _, kind in both if wanted.pairs),
                *(self._raster(shown, item, wanted.bins) for item in wanted.rasters),
            )
            client.wake.set()
        self._rest = self._loop.time() + _REST * (time.thread_time() - begun)
        self._read_soon()

    def _traces(self, view: View, history: History, items: tuple[str, ...], bins: Bins, kind: int) -> bytes:
        found = {item: view.members(item) for item in items}
        ranges = {view.place(item): history.read(one, bins) for item, one in found.items() if one is not None}
        return trace_message(self._version, ranges, bins, kind)

    def _raster(self, shown: Shown, item: str, bins: Bins) -> bytes:
        names, members = shown.view.raster(item)
        place, _ = shown.view.place(item)
        return raster_message(self._version, place, names, [shown.history.read(one, bins) for one in members], bins)

    def hold(self, client: Client, item: str) -> None:
        """A client wants all connections of what it holds, in place of what it has asked for before."""
        if not client.held:
            self._holding.append(client)
        client.held = item
        self._look_soon()

    def _look_soon(self) -> None:
        """Look up connections if somebody waits for some and none are looked up, as soon as there is a picture."""
        if self._holding and not self._looking and self._shown is not None:
            self._look_up()

    def close(self, client: Client, boxes: tuple[str, ...]) -> None:
        """A client has closed these boxes alone."""
        shown = self._shown
        if shown is None or boxes == client.closed:
            return
        client.closed, client.joined = boxes, joined(shown.view, boxes) if boxes else None
        if client.joined is not None:
            client.added = None
            client.tell(joined_message(client.joined.content, self._version))
            for message in self._added(client, client.joined, shown):
                client.tell(message)
            client.renew = shown.compared is not None
            client.wake.set()

    def _added(self, client: Client, joined: Joined, shown: Shown) -> Iterator[bytes]:
        """What runs from and to the boxes that a client has closed adds up to, where that has changed."""
        sums = shown.view.added(shown.seen, joined.sums)
        if client.added is None or not np.array_equal(sums, client.added, equal_nan=True):
            client.added = sums
            yield sums_message(sums, self._version, np.arange(len(sums)), ADDED)

    def _look_up(self) -> None:
        """Look up connections for whoever has waited longest, beside the loop, as of many it takes a while."""
        client, shown = self._holding.popleft(), self._shown
        item, client.held = client.held, ""
        self._looking = client in self._clients and shown is not None
        if shown is not None and self._looking:
            version, view, snapshot = self._version, shown.view, shown.seen.snapshot

            def look() -> bytes:
                return held_message(told_of(view, item, view.drawn.snapshot(snapshot).weights), version)

            def answer(found: asyncio.Future[bytes]) -> None:
                self._looking = False
                if not found.cancelled() and found.exception() is None:
                    client.tell(found.result())
                self._look_soon()

            self._loop.run_in_executor(None, look).add_done_callback(answer)
        else:
            self._look_soon()

    def drawn(self, client: Client, serial: int) -> None:
        """A client has drawn a frame, and so those before it."""
        while client.ahead and client.ahead[0] <= serial:
            client.ahead.popleft()
        if client.sent < self._serial and (client.owner or self._timer is None):
            client.wake.set()

    def messages(self, client: Client) -> Iterator[bytes | str]:
        """What is to be sent to a client now."""
        while client.texts:
            yield client.texts.popleft()
        shown = self._shown
        if shown is None:
            return
        theme = self.theme_of(client)
        if (client.version, client.theme) != (self._version, theme):
            scene = self._scene(shown.view, theme)
            if scene is not None:
                client.version, client.theme, client.sent = self._version, theme, 0
                client.ahead.clear()
                client.closed, client.joined = (), None
                yield scene_message(scene, self._version)
            elif client.version != self._version:
                return
        status = self._statuses[client.owner]
        if client.status != status:
            client.status = status
            yield status
        if client.body is not shown.body:
            before, client.body = client.body, shown.body
            if before != shown.body:
                yield body_message(shown.body)
        if client.undefined != shown.undefined:
            client.undefined = shown.undefined
            yield undefined_message(shown.undefined)
        if client.sent < self._serial and len(client.ahead) < AHEAD:
            since, client.sent = client.sent, self._serial
            client.ahead.append(self._serial)
            summed = np.flatnonzero(self._summed_at > since)
            if len(summed):
                yield sums_message(shown.glance.sums, self._version, summed)
            if client.joined is not None:
                yield from self._added(client, client.joined, shown)
            yield self._frame(since)
            client.renew = shown.compared is not None
            client.asked = bool(client.items)
        if client.renew:
            client.renew = False
            yield from self._aside(client, shown)
        if client.asked:
            client.asked = False
            yield _told_values(shown, client.items)
        if client.traces:
            traces, client.traces = client.traces, ()
            yield from traces

    def _aside(self, client: Client, shown: Shown) -> Iterator[bytes]:
        """All of the branch that is shown beside the run, of which nothing is kept between frames."""
        compared = shown.compared
        if compared is None:
            return
        if self._aside_frame[0] is not compared:
            all_items = np.arange(len(compared.glance.kinds))
            frame = frame_message(compared.glance, compared.reach, self._version, self._serial, all_items)
            sums = compared.glance.sums
            more = [sums_message(sums, self._version, np.arange(len(sums)))] if len(sums) else []
            self._aside_frame = compared, tuple(aside_message(one) for one in (*more, frame))
        if client.joined is not None:
            added = shown.view.added(compared.seen, client.joined.sums)
            yield aside_message(sums_message(added, self._version, np.arange(len(added)), ADDED))
        yield from self._aside_frame[1]

    def dress(self, client: Client, wants: Themed) -> None:
        """A client wants its picture in a theme."""
        client.wants = wants
        client.wake.set()

    def theme_of(self, client: Client) -> str:
        """The theme that a client sees, "" for that of the view."""
        name, view = client.wants.name, None if self._shown is None else self._shown.view
        if not name and client.wants.dark and not (view is None or view.themed):
            name = "dark"
        return name

    def _scene(self, view: View, theme: str) -> bytes | None:
        """The scene of a view in a theme; None where it is still to be made, beside the loop, for all who want it."""
        if not theme:
            return view.content
        if theme not in self._scenes:
            self._scenes[theme] = None

            def made(found: asyncio.Future[View]) -> None:
                if found.cancelled() or self._shown is None or self._shown.view is not view:
                    return
                failed = found.exception()
                if failed is not None:
                    _LOG.error("the picture cannot be drawn in the theme %s", theme, exc_info=failed)
                self._scenes[theme] = view.content if failed is not None else found.result().content
                for client in self._clients:
                    client.wake.set()

            self._loop.run_in_executor(None, view.dressed, theme).add_done_callback(made)
        return self._scenes[theme]

    def _take(self) -> None:
        self._scheduled = False
        shown, before = self._slot, self._shown
        if shown is None or shown is before:
            return
        self._serial += 1
        if before is None or shown.view is not before.view:
            self._version = self._version % 0xFFFF + 1
            self._scenes = {}
            self._changed_at = np.full(len(shown.glance.kinds), self._serial, np.int64)
            self._summed_at = np.full(len(shown.glance.sums), self._serial, np.int64)
        else:
            self._changed_at[_changed(before, shown)] = self._serial
            one, other = before.glance.sums, shown.glance.sums
            self._summed_at[((one != other) & ~(np.isnan(one) & np.isnan(other))).any(axis=1)] = self._serial
        if before is None or not _told_alike(before.status, shown.status) or not self._statuses:
            self._statuses = {owner: status_message(shown.status, owner, self._takes) for owner in (True, False)}
        self._shown = shown
        self._frames.clear()
        for client in self._clients:
            told = client.version == self._version and client.status == self._statuses[client.owner]
            if not told or (client.owner and len(client.ahead) < AHEAD):
                client.wake.set()
        if self._timer is None:
            self._timer = self._loop.call_at(self._next, self._wake_viewers)
        self._read_soon()
        self._look_soon()

    def _wake_viewers(self) -> None:
        """Send viewers the latest frame; the more there are, the longer until the next."""
        self._timer = None
        self._next = self._loop.time() + min(len(self._clients) / _FRAMES_OF_ALL, 1 / _FRAMES_EACH)
        for client in self._clients:
            if not client.owner and len(client.ahead) < AHEAD:
                client.wake.set()

    def _frame(self, since: int) -> bytes:
        """The latest frame for whoever has the one of this serial; most have the same, so it is made once for them."""
        found = self._frames.get(since)
        if found is None:
            assert self._shown is not None
            changed = np.flatnonzero(self._changed_at > since)
            shown = self._shown
            found = frame_message(shown.glance, shown.reach, self._version, self._serial, changed)
            self._frames[since] = found
        return found


def _told_values(shown: Shown, items: tuple[str, ...]) -> str:
    """What a client is told of what it looks at, of the run and of the branch that is shown beside it."""
    view, other = shown.view, None if shown.compared is None else shown.compared.seen
    beside = {} if other is None else view.values(other, items)
    lost = view.partly(shown.seen, items), {} if other is None else view.partly(other, items)
    return values_message(shown.glance.step, _values(shown, items), beside, lost)


def _values(shown: Shown, items: tuple[str, ...]) -> dict[str, float]:
    """What a client looks at, series as they are kept."""
    step, found = shown.glance.step, shown.view.values(shown.seen, items, shown.quantities)
    for item in items:
        members = shown.view.members(item) if item not in found else None
        if members is not None and members.series:
            value = float(shown.history.read(members, Bins(step, 1, 1))[0, 0])
            found |= {} if math.isnan(value) else {item: value}
    return found


def _told_alike(one: Status, other: Status) -> bool:
    """Whether a client is told the same of both; a turn that is taken back and taken anew has another number."""
    if one != other:
        return False
    return one.turned is other.turned or [e.number for e in one.turned] == [e.number for e in other.turned]


def _changed(before: Shown, now: Shown) -> npt.NDArray[np.bool_]:
    """Which items (connections, then neurons) look otherwise, but for their colours."""
    one, other = before.glance, now.glance
    changed: npt.NDArray[np.bool_] = one.kinds != other.kinds
    changed[: len(other.lines)] |= (one.widths != other.widths) | (one.glows != other.glows)
    return changed


class Reception:
    """Takes messages, on the event loop of a hub."""

    def __init__(self, hub: Hub, run: Run, desk: Desk | None = None) -> None:
        self._hub, self._run, self._desk = hub, run, desk

    def take(self, client: Client, message: bytes | str) -> None:
        """Do what a message asks for. Raises ProtocolError for one that no page of ours sends."""
        if isinstance(message, bytes):
            self._hub.drawn(client, acknowledged(message).serial)
            return
        command = command_of(message)
        if isinstance(command, LookAt):
            self._hub.check(client, command.items)
        elif isinstance(command, Trace):
            self._hub.trace(client, command)
        elif isinstance(command, Close):
            self._hub.close(client, command.boxes)
        elif isinstance(command, Connections):
            self._hub.hold(client, command.of)
        elif isinstance(command, Themed):
            self._hub.dress(client, command)
        elif not client.owner:
            client.tell(refused_message("this page only looks on"))
        elif isinstance(command, Measure):
            found = findings(command.text, self._run.view.drawn.whole)
            client.tell(measured_message(command.text, found))
            if not found:
                self._run.ask(command, lambda reason: self._hub.refuse(client, reason))
        elif not isinstance(command, Request):
            self._run.ask(command, lambda reason: self._hub.refuse(client, reason))
        elif self._desk is not None:
            if isinstance(command, Fetch):
                command = replace(command, theme=self._hub.theme_of(client))
            self._desk.ask(command, lambda text: self._hub.answer(client, text))
        elif not isinstance(command, Fit):  # every page asks for that
            client.tell(refused_message("nothing is put by hand or saved here"))
