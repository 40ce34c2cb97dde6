"""The recorder: takes messages as they arrive; who brings them never has to wait.

In: messages, by any thread, into a queue of limited size. A thread of its own takes them out, has each checked and
counted, and writes those that are accepted; whoever wants to see them is given them, too. What a full queue or disk
does not take is counted as lost.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from threading import Condition, Thread
from time import monotonic
from typing import Final, TypeAlias

from neurovis_spec.ros.accept import Accepted, Stream, Taken, time_of
from neurovis_spec.ros.files import Files
from neurovis_spec.ros.logs import Stored, Topic
from neurovis_spec.ros.middleware import Arrival
from neurovis_spec.ros.summary import Teller
from neurovis_spec.runtime.mcap_records import LARGEST_CHUNK

#: bytes of messages that the queue takes
ROOM: Final = 256 << 20
#: what a message takes in the queue besides its bytes
_EACH: Final = 300
#: a chunk is closed so many seconds after its first message
_CHUNK_TIME: Final = 0.1
_SYNC_TIME: Final = 1.0

#: Called with each message that is accepted, in the recorder's thread.
Heard: TypeAlias = Callable[[Stream, Arrival, Accepted], None]


def _ignore(stream: Stream, arrival: Arrival, accepted: Accepted) -> None:
    """Nobody wants to see it."""


class Recorder:
    """Records what is put into it; without ``files`` messages are only checked and counted. ``definitions`` are those
    of the types of the streams."""

    def __init__(
        self,
        files: Files | None,
        definitions: Mapping[str, str],
        tell: Callable[[str], None],
        heard: Heard = _ignore,
        room: int = ROOM,
    ) -> None:
        self._files, self._definitions, self._tell, self._heard, self._room = files, definitions, tell, heard, room
        self._teller = Teller(tell)
        self._waiting = Condition()
        #: None in place of a message: connections were made anew before the next one
        self._queue: deque[tuple[Stream, Arrival | None]] = deque()
        self._held = 0
        #: messages that the queue could not take, by stream
        self._missed: dict[Stream, int] = {}
        self._ending = False
        self._streams: dict[Stream, Topic] = {}
        #: those of which something came
        self._seen = set[Stream]()
        self._chunk: list[tuple[Stream, Stored]] = []
        self._size, self._begun, self._synced = 0, 0.0, monotonic()
        self._full = False
        self._thread = Thread(target=self._work, name="recorder", daemon=True)
        self.failure: Exception | None = None

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def put(self, stream: Stream, arrival: Arrival) -> None:
        """A message of a stream; returns at once."""
        size = len(arrival.data) + _EACH
        with self._waiting:
            if self._held + size > self._room or self._ending:
                self._missed[stream] = self._missed.get(stream, 0) + 1
                return
            self._held += size
            self._append(stream, arrival)

    def anew(self, stream: Stream) -> None:
        """The connection was made anew: gaps in the numbers of messages from here on are no losses."""
        with self._waiting:
            self._append(stream, None)

    def _append(self, stream: Stream, arrival: Arrival | None) -> None:
        self._queue.append((stream, arrival))
        if len(self._queue) == 1:
            self._waiting.notify()

    def end(self) -> None:
        """Write all that came, and close the files."""
        with self._waiting:
            self._ending = True
            self._waiting.notify()
        if self._thread.is_alive():
            self._thread.join()

    def _work(self) -> None:
        try:
            while (some := self._next()) is not None:
                for stream, arrival in some:
                    if arrival is None:
                        stream.anew()
                    else:
                        self._take(stream, arrival)
                self._look()
            self._close()
        except Exception as failure:
            self.failure = failure
            self._tell(f"the recorder has failed: {failure}")

    def _next(self) -> deque[tuple[Stream, Arrival | None]] | None:
        """What has come, after waiting for it until something else is due; None at the end."""
        with self._waiting:
            if not self._queue and not self._ending:
                self._waiting.wait(self._wait())
            if not self._queue and self._ending:
                return None
            some, self._queue, self._held = self._queue, deque(), 0
            missed, self._missed = self._missed, {}
        for stream, count in missed.items():
            stream.miss(count)
        return some

    def _wait(self) -> float:
        return max(0.0, self._begun + _CHUNK_TIME - monotonic()) if self._chunk else _SYNC_TIME

    def _take(self, stream: Stream, arrival: Arrival) -> None:
        self._seen.add(stream)
        self._hand_on(stream, stream.take(arrival, self._teller))

    def _hand_on(self, stream: Stream, taken: Sequence[Taken]) -> None:
        for arrival, accepted in taken:
            if self._files is not None:
                self._keep(stream, arrival, accepted)
            self._heard(stream, arrival, accepted)

    def _keep(self, stream: Stream, arrival: Arrival, accepted: Accepted) -> None:
        size = len(arrival.data) + 32
        if self._chunk and (self._size + size > LARGEST_CHUNK or monotonic() - self._begun >= _CHUNK_TIME):
            self._write()
        if not self._chunk:
            self._begun = monotonic()
        topic = self._streams.get(stream)
        if topic is None:
            text = self._definitions.get(stream.type, "")
            topic = self._streams[stream] = Topic(stream.topic, stream.type, stream.encoding, text)
        sequence = stream.counts.received - 1 if accepted.seq is None else accepted.seq
        stored = Stored(topic, sequence % (1 << 32), arrival.received, time_of(accepted, arrival), arrival.data)
        self._chunk.append((stream, stored))
        self._size += size

    def _look(self) -> None:
        """Do what is due."""
        now = monotonic()
        if self._chunk and now - self._begun >= _CHUNK_TIME:
            self._write()
        if self._files is not None and now - self._synced >= _SYNC_TIME:
            self._synced = now
            self._try(self._files.sync)
        self._teller.look()

    def _write(self) -> None:
        assert self._files is not None
        files, chunk = self._files, self._chunk
        self._chunk, self._size = [], 0
        taken = self._try(lambda: files.write([stored for _, stored in chunk]))
        if taken and self._full:
            self._full = False
            self._tell("the recording is written again")
        for stream, _ in chunk:
            if taken:
                stream.counts.recorded += 1
            else:
                stream.lose(1, self._teller)

    def _try(self, do: Callable[[], None]) -> bool:
        """Do something with the files; tell where the disk does not take it, once until messages are written again."""
        try:
            do()
        except OSError as error:
            if not self._full:
                self._tell(f"the recording cannot be written: {error.strerror or error}; messages are lost")
            self._full = True
            return False
        return True

    def _close(self) -> None:
        with self._waiting:
            missed, self._missed = self._missed, {}
        for stream, count in missed.items():
            stream.miss(count)
        for stream in self._seen.union(missed):
            self._hand_on(stream, stream.end(self._teller))
        if self._chunk:
            self._write()
        if self._files is not None:
            self._try(self._files.close)
        self._teller.rest()
