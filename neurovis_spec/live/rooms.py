"""Rooms: the networks of the gallery that run, each with those who look on at it.

In: what is listed, and what stages it. Out: a Room for whoever asks for one: it is made when it is asked for first, in
a thread, while those who have come are told so. A room in which nobody looks on stands still; of too many the one that
was asked for longest ago, and in which nobody is, ends.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from neurovis_spec.diagnostics import SpecError, show_text
from neurovis_spec.live.commands import REQUESTS, Pause
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.hub import Hub, Reception
from neurovis_spec.live.listing import Listed
from neurovis_spec.live.protocol import findings_message, refused_message
from neurovis_spec.live.run import Run, Stage

#: Networks that are kept at once.
MOST: Final = 8
#: Seconds for which a room in which nobody is goes on.
_EMPTY: Final = 5.0

#: Compiles and stages what is listed; and what makes the desk of its run.
Opened: TypeAlias = tuple[Stage, Callable[[Run, Callable[[str], None]], Desk]]
Open: TypeAlias = Callable[[Listed], Opened]


@dataclass(eq=False)
class Room:
    """A network that runs; ``run`` is None until it is made, and where it cannot be."""

    hub: Hub
    reception: Reception | None = None
    run: Run | None = None
    desk: Desk | None = None
    tasks: set[asyncio.Task[None]] = field(default_factory=set)

    def end(self) -> None:
        """Stop."""
        for task in self.tasks:
            task.cancel()
        for thread in (self.desk, self.run):
            if thread is not None:
                thread.end()


class Rooms:
    """The rooms of what is ``listed``. All methods are called on the event loop."""

    def __init__(self, listed: tuple[Listed, ...], open_: Open) -> None:
        self._listed, self._open = listed, open_
        #: by their numbers, those that were asked for last at the end
        self._rooms: dict[int, Room] = {}

    def room(self, number: int) -> Room | None:
        """The room of what has this number in the list; None where there are too many."""
        room = self._rooms.pop(number, None)
        if room is None:
            empty = [other for other, one in self._rooms.items() if not len(one.hub)]
            if len(self._rooms) >= MOST:
                if not empty:
                    return None
                self._rooms.pop(empty[0]).end()
            room = Room(Hub(asyncio.get_running_loop(), REQUESTS))
            task = asyncio.create_task(self._make(room, number))
            room.tasks.add(task)
            task.add_done_callback(room.tasks.discard)
        self._rooms[number] = room
        return room

    async def _make(self, room: Room, number: int) -> None:
        hub = room.hub
        hub.tell(findings_message("compiling and laying out …", errors=False), "findings")
        try:
            stage, desk = await asyncio.to_thread(self._open, self._listed[number])
        except Exception as error:  # a body, a layout engine, ours or anybody's, may fail
            found = isinstance(error, SpecError)
            words = show_text(error.diagnostics, error.sources) if isinstance(error, SpecError) else str(error)
            hub.tell(findings_message(words if found else f"{type(error).__name__}: {words}", errors=True), "findings")
            self._rooms.pop(number, None)  # who asks anew tries anew
            return
        run = Run(*stage, hub.show, lambda: hub.watched, lambda reason: hub.tell_soon(refused_message(reason)))
        room.desk = desk(run, hub.keep_soon)
        room.run, room.reception = run, Reception(hub, run, room.desk)
        hub.tell(findings_message("", errors=False), "findings")
        run.start()
        room.desk.start()

    def left(self, room: Room) -> None:
        """Somebody has gone: where nobody is left, it stands still after a while."""
        if not len(room.hub):
            asyncio.get_running_loop().call_later(_EMPTY, self._rest, room)

    @staticmethod
    def _rest(room: Room) -> None:
        if not len(room.hub) and room.run is not None:
            room.run.ask(Pause())

    def end(self) -> None:
        """Stop all."""
        for room in self._rooms.values():
            room.end()
        self._rooms.clear()
