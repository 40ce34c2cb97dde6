"""The session: a live run whose viewers are frames in a notebook.

In: a source and its view; messages of frames, which come and go. Out: for each frame the messages of the protocol. One
thread runs and one sends, so that neither the notebook's cells nor the run wait for the other.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from threading import Thread, current_thread
from typing import Final, TypeAlias

from neurovis_spec.live.commands import Command, Pause, Play, Present
from neurovis_spec.live.hub import AHEAD, Client, Hub, Reception
from neurovis_spec.live.protocol import ProtocolError, refused_message
from neurovis_spec.live.run import Done, Refuse, Run, Shown, Stage

#: Frames of a notebook at once; of more, the one that came first is left.
MOST: Final = 16
#: Seconds after which a frame that has drawn nothing counts as gone.
SILENCE = 20.0
#: Frames a second and bytes a second that each is sent: a Jupyter server cuts off a kernel beyond 1 MB/s.
_FRAMES, _BYTES = 30, 300_000

#: Sends a message to the frame of this name; called in the session's thread.
Send: TypeAlias = Callable[[str, bytes | str], None]
#: Called when something else is shown, in the session's thread.
Follow: TypeAlias = Callable[[], None]


class Session:
    """A run for frames; ``shown`` is what it shows now. It stands still while there is no frame, and ``playing`` says
    whether it begins to play with the first. A frame that draws nothing of what it is sent for a while counts as gone:
    its browser is closed, its tab is behind others, or the notebook is at work; when it says something, it is back."""

    def __init__(self, stage: Stage, send: Send, follow: Follow, playing: bool = True) -> None:
        self._send, self._follow, self._playing = send, follow, playing
        self._loop = asyncio.new_event_loop()
        self._thread = Thread(target=self._serve, name="notebook", daemon=True)
        self._hub = Hub(self._loop)
        self._run = Run(*stage, self._show, tell=self._tell, playing=False)
        self._reception = Reception(self._hub, self._run)
        self._frames: dict[str, tuple[Client, asyncio.Task[None]]] = {}
        self._ended = False
        self.shown = self._run.shown()

    def begin(self) -> None:
        """Begin, standing still."""
        self._thread.start()
        self._run.start()

    def join(self, name: str) -> None:
        """A frame has come."""
        self._call(self._join, name)

    def leave(self, name: str) -> None:
        """A frame has gone."""
        self._call(self._leave, name)

    def take(self, name: str, message: bytes | str) -> None:
        """A frame has sent a message."""
        self._call(self._take, name, message)

    def ask(self, command: Command, refuse: Refuse, done: Done) -> None:
        """Have a command carried out; one of the two is called, mostly by the run's thread."""
        if self._ended:
            refuse("the view is closed")
            return
        self._run.ask(command, refuse, done)

    def end(self) -> None:
        """Stop, and leave all frames."""
        if self._ended:
            return
        self._ended = True
        self._run.end()
        self._loop.call_soon_threadsafe(self._leave_all)
        if current_thread() is not self._thread:
            self._thread.join(5.0)

    def _call(self, what: Callable[..., None], *values: object) -> None:
        if not self._ended:
            self._loop.call_soon_threadsafe(what, *values)

    # --- in the session's thread

    def _serve(self) -> None:
        self._loop.run_forever()
        self._loop.close()

    def _join(self, name: str) -> None:
        self._leave(name)
        if len(self._frames) >= MOST:
            self._leave(next(iter(self._frames)))
        client = Client(owner=True)
        self._frames[name] = client, self._loop.create_task(self._write(name, client))
        self._hub.join(client)
        first = len(self._frames) == 1
        self._run.ask(Play() if first and self._playing else Present())

    def _leave(self, name: str) -> None:
        if name not in self._frames:
            return
        client, task = self._frames.pop(name)
        task.cancel()
        self._hub.leave(client)
        if not self._frames:
            self._playing = self.shown.status.playing
            self._run.ask(Pause())

    def _leave_all(self) -> None:
        for name in list(self._frames):
            self._leave(name)
        self._loop.call_soon(self._loop.stop)

    def _take(self, name: str, message: bytes | str) -> None:
        if name not in self._frames:
            self._join(name)
        client, _ = self._frames[name]
        try:
            self._reception.take(client, message)
        except ProtocolError as error:
            client.tell(refused_message(str(error)))

    async def _write(self, name: str, client: Client) -> None:
        """Send what there is for a frame whenever there is something, no faster than a notebook can bear."""
        while True:
            try:
                async with asyncio.timeout(SILENCE):
                    await client.wake.wait()
            except TimeoutError:
                if len(client.ahead) < AHEAD:
                    continue
                self._leave(name)
                return
            client.wake.clear()
            sent = 0
            for message in list(self._hub.messages(client)):
                self._send(name, message)
                sent += len(message)
            await asyncio.sleep(max(1 / _FRAMES, sent / _BYTES))

    # --- in the run's thread

    def _show(self, shown: Shown) -> None:
        self.shown = shown
        self._hub.show(shown)
        self._loop.call_soon_threadsafe(self._follow)

    def _tell(self, reason: str) -> None:
        self._hub.tell_soon(refused_message(reason))
