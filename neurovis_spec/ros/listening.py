"""One network's topics: what arrives on them is judged, counted, recorded and shown.

In: a compiled network, which ROS, where to record, whether to show. Out: a Listening, to which arrivals are handed by
any thread; its source is what the live page shows, its counts are those of the summary.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.ros.accept import ARRAY, STRING, Accepted, Judge, Stream, anything, arrays, headed
from neurovis_spec.ros.definitions import definition
from neurovis_spec.ros.files import Files, Rotation
from neurovis_spec.ros.logs import topic_of
from neurovis_spec.ros.middleware import Arrival, Ros
from neurovis_spec.ros.publishers import OnePublisher
from neurovis_spec.ros.received import ReceivedSource
from neurovis_spec.ros.recorder import Recorder
from neurovis_spec.ros.summary import Counts
from neurovis_spec.ros.video import Video
from neurovis_spec.runtime.columns import Probe, columns_of
from neurovis_spec.runtime.npz_file import frame_bytes
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.stream import empty_recording
from neurovis_spec.runtime.wire import ENCODINGS, text_message
from neurovis_spec.version import __version__

ACTIVITY: Final = "activity"
WEIGHTS: Final = "weights"
SPEC: Final = "spec"


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is wanted of a network's topics: a recording, and that they are shown; ``backend`` is the name of the one
    that makes the steps, "" where that is not known."""

    record: Path | None = None
    rotation: Rotation = field(default_factory=Rotation)
    force: bool = False
    shown: bool = False
    backend: str = ""


def base_of(compiled: CompiledNetwork) -> str:
    """What the names of a network's topics begin with."""
    return f"{compiled.network.ros.namespace.rstrip('/')}/{compiled.network.name}"


def frame(compiled: CompiledNetwork, backend: str = "") -> Recording:
    """A recording without rows, to which received activities and weights are added: it has the names, connections and
    hash of the network, and the name of the backend, where that runs here."""
    network = compiled.network
    columns = replace(columns_of(network), probe=Probe((), ()), outputs={}, spiking=None)
    return replace(empty_recording(network, columns, compiled.simulator("reference").state()), backend=backend)


class Listening:
    """The topics of a network, whose names begin with ``base``. ``definitions`` gives the text of a type that is not in
    the table of the usual ones. Raises OSError where there can be no recording."""

    def __init__(
        self,
        compiled: CompiledNetwork,
        ros: Ros,
        wanted: Wanted,
        tell: Callable[[str], None],
        definitions: Callable[[str], str] = lambda type_: "",
        base: str | None = None,
    ) -> None:
        # a topic has activities alone: neurons are coloured by these
        network = replace(compiled.network, render=replace(compiled.network.render, show=()))
        self.compiled, self.ros, self._definitions_of = replace(compiled, network=network), ros, definitions
        self.base = base_of(compiled) if base is None else base
        self.streams: dict[str, Stream] = {}
        self._definitions: dict[str, str] = {}
        self.source = ReceivedSource(network) if wanted.shown else None
        self._files = None if wanted.record is None else self._recording(wanted.record, wanted)
        #: the film that is made of it, where there is one
        self.video: Video | None = None
        self.recorder = Recorder(self._files, self._definitions, tell, self._heard)
        publishers = OnePublisher(tell)
        self.activity = self._array(ACTIVITY, len(network.neurons), publishers)
        if len(network.changing):
            self._array(WEIGHTS, len(network.changing), publishers)

    def _recording(self, path: Path, wanted: Wanted) -> Files:
        network = self.compiled.network
        about = {"network": network.name, "hash": network.hash, "dt": repr(network.dt), "version": __version__}
        topic = topic_of(f"{self.base}/{SPEC}", STRING, self._definition(STRING), self.ros)
        first = [(topic, text_message(self.compiled.text(), ENCODINGS[self.ros]))]
        kept = frame_bytes(frame(self.compiled, wanted.backend))
        return Files(path, self.ros, about, first, wanted.rotation, wanted.force, kept)

    def _definition(self, type_: str) -> str:
        return definition(type_, self.ros) or self._definitions_of(type_)

    def add(self, topic: str, type_: str) -> Stream:
        """Another topic, which is recorded as it comes; the summary has it under its name."""
        if topic in self.streams:
            return self.streams[topic]
        text = self._definition(type_)
        has_header = text.split("\n", 1)[0].split() in (["std_msgs/Header", "header"], ["Header", "header"])
        return self._add(topic, topic, type_, headed if has_header else anything)

    def _add(self, name: str, topic: str, type_: str, judge: Judge) -> Stream:
        self._definitions[type_] = self._definition(type_)
        made = self.streams[topic] = Stream(name, topic, type_, ENCODINGS[self.ros], judge)
        return made

    def _array(self, name: str, size: int, publishers: OnePublisher) -> Stream:
        """A topic of the network's own."""
        made = self._add(name, f"{self.base}/{name}", ARRAY, arrays(self.compiled.network.hash, size))
        made.publishers = publishers
        return made

    def start(self) -> None:
        """Begin."""
        self.recorder.start()

    def put(self, topic: str, arrival: Arrival) -> None:
        """A message; those of topics that are not known are passed over."""
        stream = self.streams.get(topic)
        if stream is not None:
            self.recorder.put(stream, arrival)

    def anew(self) -> None:
        """Connections were made anew."""
        for stream in self.streams.values():
            self.recorder.anew(stream)

    def end(self) -> None:
        """Write all that came, and close the files. Raises what has kept them from being written."""
        self.recorder.end()
        if self.recorder.failure is not None:
            raise self.recorder.failure

    def _heard(self, stream: Stream, arrival: Arrival, accepted: Accepted) -> None:
        if self.source is None:
            return
        if stream is self.activity:
            self.source.hear_activity(accepted.seq, arrival.received, accepted.numbers)
        elif stream.name == WEIGHTS:
            self.source.hear_weights(accepted.seq, accepted.numbers)

    @property
    def counts(self) -> dict[str, Counts]:
        """What became of the messages, by topic."""
        return {stream.name: stream.counts for stream in self.streams.values()}

    @property
    def shown(self) -> tuple[int, int]:
        """How many steps were shown, and how many skipped."""
        if self.source is None:
            return 0, 0
        return self.source.shown, self.source.came - self.source.shown

    @property
    def paths(self) -> tuple[str, ...]:
        """The files of the recording, and the film."""
        recorded = () if self._files is None else self._files.paths
        filmed = () if self.video is None or not self.video.begun else (self.video.path,)
        return tuple(map(str, (*recorded, *filmed)))
