"""The topics of the first NeuroVis on a node: what comes describes a network, and then shows how it runs.

In: a Node. Out: a Legacy that learns; once it knows a network, its activities and weights as messages of this version.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from functools import partial
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Final

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.language.ros_types import plain
from neurovis_spec.ros.accept import ARRAY
from neurovis_spec.ros.announced import compiled_from
from neurovis_spec.ros.counts import REASONS, Counts, Reason, Teller
from neurovis_spec.ros.legacy import KINDS, Kind, Legacy, types_of
from neurovis_spec.ros.listening import ACTIVITY, WEIGHTS, Listening
from neurovis_spec.ros.middleware import Arrival, Node, Quality, Tell
from neurovis_spec.runtime.ros_messages import label_of
from neurovis_spec.runtime.wire import ArrayForm, WireError

_QUALITY: Final = Quality("offered", "volatile", 4000)
#: messages that wait to be read
_ROOM: Final = 100_000
#: bytes of activities and weights that wait for their network, and what each takes besides its own
_WAITING: Final = 64 << 20
_EACH: Final = 300
#: a description is taken when it has stayed as it is for so many seconds
_SETTLED: Final = 0.5
_LOOK: Final = 0.2


#: what activities and weights are called in this version
_NAMES: Final[Mapping[Kind, str]] = {"activity": ACTIVITY, "weightsAll": WEIGHTS}


class LegacyListener:
    """Listens to the topics under a namespace. ``counts`` are those of the topics, under their names. What comes before
    its network is known waits, and goes on with it; ``wanted`` is whether it goes anywhere."""

    def __init__(self, node: Node, namespace: str, network: str, tell: Tell, wanted: bool = True) -> None:
        self._node, self._network, self._tell, self._teller = node, network, tell, Teller(tell)
        self.legacy = Legacy()
        self.counts: dict[str, Counts] = {kind: Counts() for kind in KINDS}
        self._topics = {f"{namespace.rstrip('/')}/{kind}": kind for kind in KINDS}
        self._heard = set[tuple[str, str]]()
        self._came: SimpleQueue[tuple[Kind, Arrival]] = SimpleQueue()
        self._looked, self._changed = 0.0, monotonic()
        self._described: tuple[object, ...] = ()
        self._to: Listening | None = None
        self._forms: dict[str, tuple[str, ArrayForm]] = {}
        self._sizes, self._told = {ACTIVITY: 0, WEIGHTS: 0}, False
        #: activities and weights whose network is not known yet, and the bytes that they take
        self._waiting: deque[tuple[Kind, Arrival]] = deque()
        self._held = 0
        #: whether it counts as known
        self.known = False
        #: those that have been judged, and go on as soon as it is known where to
        self._ready: list[tuple[str, FloatArray, Arrival]] = []
        self._wanted = wanted
        #: how many messages of each topic of this version there were
        self._made = {ACTIVITY: 0, WEIGHTS: 0}

    def look(self) -> None:
        """Listen to the topics that have publishers by now, with the types that these have."""
        for topic, types in self._node.topics().items():
            kind = self._topics.get(topic)
            if kind is None:
                continue
            for type_ in map(plain, types):
                if (topic, type_) in self._heard:
                    continue
                self._heard.add((topic, type_))
                if type_ not in types_of(kind):
                    self._tell(f"{topic}: its messages are {type_}, not {' or '.join(types_of(kind))}")
                elif self._node.ros == 2 or all(one != topic for one, _ in self._heard - {(topic, type_)}):
                    self._node.subscription(topic, type_, _QUALITY, partial(self._arrived, kind))

    def _arrived(self, kind: Kind, arrival: Arrival) -> None:
        if self._came.qsize() < _ROOM:
            self._came.put((kind, arrival))
        else:
            self.counts[kind].lost += 1

    def hear(self, seconds: float) -> None:
        """Take what has come, for about so long."""
        end = monotonic() + seconds
        while (left := end - monotonic()) > 0:
            if monotonic() - self._looked >= _LOOK:
                self._looked = monotonic()
                self.look()
            try:
                self._take(*self._came.get(timeout=left))
            except Empty:
                break
        self._teller.look()

    def _take(self, kind: Kind, arrival: Arrival) -> None:
        self.counts[kind].received += 1
        if self.known or kind not in _NAMES:
            self._judge(kind, arrival)
            return
        self._waiting.append((kind, arrival))
        self._held += len(arrival.data) + _EACH
        while self._held > _WAITING:
            oldest, gone = self._waiting.popleft()
            self._held -= len(gone.data) + _EACH
            self.counts[oldest].lost += 1
            self._teller.note(f"lost on {oldest}, for its network is not known yet")

    def _judge(self, kind: Kind, arrival: Arrival) -> None:
        why = self._judged(kind, arrival)
        if why is not None:
            self.counts[kind].rejected[why] += 1
            self._teller.note(f"{REASONS[why]} on {kind}")

    def _judged(self, kind: Kind, arrival: Arrival) -> Reason | None:
        type_ = plain(arrival.type)
        if type_ not in types_of(kind):
            return "type"
        legacy = self.legacy
        try:
            found = legacy.hear(kind, arrival.data, self._node.encoding, type_)
        except WireError:
            return "parse"
        if isinstance(found, str):
            return found
        if kind not in _NAMES:
            described = (legacy.names, dict(legacy.positions), dict(legacy.edges))
            if described != self._described:
                self._described, self._changed = described, monotonic()
                self._tell_of_change()
            return None
        name = _NAMES[kind]
        if self._to is not None and len(found) != self._sizes[name]:
            if name == WEIGHTS and not self._sizes[name]:  # nobody knew that they change
                self._tell_of_change()
            return "length"
        self.counts[kind].not_finite += not np.isfinite(found).all()
        self._hand_on(name, found, arrival)
        return None

    def _tell_of_change(self) -> None:
        if self._to is not None and not self._told:
            self._told = True
            self._tell("the network has changed: what is shown and recorded is as it was; begin anew")

    @property
    def settled(self) -> bool:
        """Whether there is a network that has stayed as it is."""
        return self.legacy.described and monotonic() - self._changed >= _SETTLED

    def know(self) -> None:
        """From now on the network counts as known: what has waited for it is judged."""
        self.known = True
        while self._waiting:
            self._judge(*self._waiting.popleft())

    def compiled(self) -> CompiledNetwork:
        """The network as it is known. Raises SpecError."""
        return compiled_from(self.legacy.spec(self._network), self._network)

    def to(self, listening: Listening) -> None:
        """From now on activities and weights go there, as messages of this version."""
        self._to = listening
        network, encoding = listening.compiled.network, self._node.encoding
        self._sizes = {ACTIVITY: len(network.neurons), WEIGHTS: len(network.changing)}
        for topic, stream in listening.streams.items():
            form = ArrayForm.of(label_of(network.hash), self._sizes[stream.name], encoding)
            self._forms[stream.name] = topic, form
        for one in self._ready:
            self._hand_on(*one)
        self._ready.clear()

    def _hand_on(self, name: str, numbers: FloatArray, arrival: Arrival) -> None:
        if self._to is None:
            if self._wanted:
                self._ready.append((name, numbers, arrival._replace(data=b"")))
            return
        topic, form = self._forms[name]
        data = form.message(self._made[name], arrival.received / 1e9, numbers)
        self._made[name] += 1
        self._to.put(topic, Arrival(data, arrival.received, None, ARRAY, arrival.origin))

    def end(self) -> None:
        """What was recorded, and entries that were left out, which count as not to be read."""
        self.know()
        if self._to is not None:
            there = {stream.name: stream.counts for stream in self._to.streams.values()}
            for kind, name in _NAMES.items():
                if name in there:
                    self.counts[kind].recorded = there[name].recorded
                    self.counts[kind].lost += there[name].lost
                    self.counts[kind].rejected["publisher"] += there[name].rejected["publisher"]
        for kind, count in self.legacy.left_out.items():
            if count:
                self.counts[kind].rejected["parse"] += count
                self._tell(f"{count} entries of {kind} say nothing, or more than one thing, and are left out")
        self._teller.rest()
