"""The topics of the first NeuroVis: what they say of a network, the spec that describes the same one, and how it runs.

In: texts and arrays as they come, in any order (Legacy, which knows nothing of ROS), from a Node (the Listener). Out:
names, positions and connections, and the text of a spec that validates; entries that say nothing, or more than one
thing, are left out and counted. Once it knows a network, its activities and weights as messages of this version.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from math import dist, isfinite
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
import yaml

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.drawing.pins import DIAMETER
from neurovis_spec.language.ros_types import plain
from neurovis_spec.ros.accept import ARRAY
from neurovis_spec.ros.announced import compiled_from
from neurovis_spec.ros.listening import ACTIVITY, WEIGHTS, Listening
from neurovis_spec.ros.middleware import Arrival, Node, Quality, Tell
from neurovis_spec.ros.summary import REASONS, Counts, Reason, Teller
from neurovis_spec.runtime.wire import ArrayForm, Encoding, WireError, array_of, label_of, text_of

Kind: TypeAlias = Literal["neuronName", "neuronPos", "connections", "connectionsLayers", "activity", "weightsAll"]
KINDS: Final[tuple[Kind, ...]] = get_args(Kind)
#: what numbers come as, besides texts
FLOATS: Final = "std_msgs/Float32MultiArray"
TEXT: Final = "std_msgs/String"
_TEXTS: Final = frozenset(("neuronName", "neuronPos", "connectionsLayers"))
#: neurons and connections that are taken
_MOST_NEURONS, _MOST_CONNECTIONS = 10_000, 1_000_000
#: characters of names, and of labels
_LONGEST, _LONGEST_LABEL = 64, 200
_FARTHEST: Final = 1e4
#: places may have to be so many times farther apart
_FARTHEST_APART: Final = 64.0
_SEPARATORS: Final = re.compile(r"[,/;\s]+")
_NUMBER: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(inf(inity)?|nan)", re.IGNORECASE)
_RULE: Final = "received"

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


def types_of(kind: Kind) -> tuple[str, ...]:
    """The types that a topic may have."""
    return (TEXT,) if kind in _TEXTS else (FLOATS, TEXT)


def numbers_of(data: bytes, encoding: Encoding, type_: str) -> FloatArray:
    """The numbers of a message, of an array or a text. Raises WireError."""
    if type_ == FLOATS:
        return array_of(data, encoding, "f4").data
    words = [word for word in _SEPARATORS.split(text_of(data, encoding)) if word]
    if not all(map(_NUMBER.fullmatch, words)):
        raise WireError("it holds what is no number")
    return np.array([float(word) for word in words])


@dataclass
class Legacy:
    """What has been heard of a network so far."""

    names: tuple[str, ...] = ()
    #: of the neurons that have one
    positions: dict[str, tuple[float, float]] = field(default_factory=dict)
    #: the weights of connections by the places of their ends, in order
    edges: dict[tuple[int, int], float] = field(default_factory=dict)
    #: whether weights have come, and so change
    weighted: bool = False
    #: how many entries of the last message of a topic were left out
    left_out: dict[Kind, int] = field(default_factory=dict)
    _texts: dict[Kind, str] = field(default_factory=dict)
    _matrix: FloatArray | None = None

    @property
    def described(self) -> bool:
        """Whether there is a network to show: neurons, and what connects them."""
        return bool(self.names) and (self._matrix is not None or "connectionsLayers" in self._texts)

    def hear(self, kind: Kind, data: bytes, encoding: Encoding, type_: str) -> FloatArray | Literal["length"]:
        """Take a message; the numbers of activities and of weights. Raises WireError."""
        if kind in _TEXTS:
            self._hear_text(kind, text_of(data, encoding))
            return np.zeros(0)
        numbers = numbers_of(data, encoding, type_)
        if kind == "connections":
            return self._hear_matrix(numbers)
        if kind == "activity":
            return numbers if len(numbers) == len(self.names) else "length"
        n, m = len(self.names), len(self.edges)
        if len(numbers) == m:
            weights = numbers
        elif len(numbers) == n * n:
            weights = numbers[[source * n + target for source, target in self.edges]]
        else:
            return "length"
        self.weighted = True
        return weights

    def _hear_text(self, kind: Kind, text: str) -> None:
        known = self._texts.get(kind)
        self._texts[kind] = text
        if text == known:
            return
        if kind == "neuronName":
            self._name(text)
        self._describe(kind)

    def _hear_matrix(self, numbers: FloatArray) -> FloatArray | Literal["length"]:
        if self.names and len(numbers) != len(self.names) ** 2:
            return "length"
        if self._matrix is None or not np.array_equal(numbers, self._matrix, equal_nan=True):
            self._matrix = numbers
            self._connect()
        return np.zeros(0)

    def _name(self, text: str) -> None:
        given = text.removesuffix("/").split("/")
        names = tuple(dict.fromkeys(name for name in given if name))[:_MOST_NEURONS]
        self.left_out["neuronName"] = len(given) - len(names) if text else 0
        self.names = names

    def _describe(self, changed: Kind) -> None:
        """Read anew what depends on what has changed."""
        if not self.names:
            return
        if changed in ("neuronName", "neuronPos"):
            found = positions(self._texts.get("neuronPos", ""), self.names)
            self.positions, self.left_out["neuronPos"] = found
        if changed in ("neuronName", "connectionsLayers"):
            self._connect()

    def _connect(self) -> None:
        n, matrix = len(self.names), self._matrix
        self.edges = {}
        if not n:
            return
        if matrix is not None and len(matrix) == n * n:
            (places,) = np.nonzero(matrix)
            for place in places[:_MOST_CONNECTIONS].tolist():
                if isfinite(matrix[place]):
                    self.edges[divmod(place, n)] = float(matrix[place])
            self.left_out["connections"] = len(places) - len(self.edges)
        pairs, bad = layer_pairs(self._texts.get("connectionsLayers", ""), self.names)
        for pair in islice(pairs, _MOST_CONNECTIONS - len(self.edges)):
            self.edges.setdefault(pair, 1.0)
        self.left_out["connectionsLayers"] = bad + (next(pairs, None) is not None)

    def spec(self, network: str) -> str:
        """The network as a spec, under this name."""
        ids = identifiers(self.names)
        neurons: dict[str, dict[str, object]] = {}
        for name, identifier in zip(self.names, ids, strict=True):
            shown = "".join(letter if letter.isprintable() else "_" for letter in name[:_LONGEST_LABEL])
            label = shown.replace("{", "{{").replace("}", "}}")
            neurons[identifier] = {"initial": 0} if name == identifier else {"label": label, "initial": 0}
        connections: dict[str, object] = {}
        for (source, target), weight in self.edges.items():
            plain = float(str(np.float32(weight))) if np.float32(weight) == weight else weight
            what: object = {"weight": plain, "plasticity": _RULE} if self.weighted else plain
            connections[f"{ids[source]} -> {ids[target]}"] = what
        spec: dict[str, object] = {"neurovis": 1, "name": network, "neurons": neurons}
        if connections:
            spec["connections"] = connections
        if self.weighted and connections:
            description = "weights come from the controller"
            spec["rules"] = {_RULE: {"description": description, "weight": {"each_step": "weight"}}}
        if self.positions:
            of = dict(zip(self.names, ids, strict=True))
            spec["layout"] = {"positions": {of[name]: list(place) for name, place in apart(self.positions).items()}}
        return yaml.safe_dump(spec, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120)


def positions(text: str, names: Sequence[str]) -> tuple[dict[str, tuple[float, float]], int]:
    """Where neurons are, and how many entries say nothing: ``A_LAYER_X_Y/…`` or ``A_X_Y/…``.

    >>> positions("a_b_1_2_3/a_4_5/c_1_2", ["a", "a_b"])
    ({'a_b': (2.0, 1.0), 'a': (4.0, 5.0)}, 1)
    """
    found: dict[str, tuple[float, float]] = {}
    taken: set[tuple[float, float]] = set()
    bad, known = 0, set(names)
    for entry in filter(None, text.split("/")):
        places = (at for at in reversed(range(len(entry))) if entry[at] == "_")
        at = next((at for at in places if entry[:at] in known), None)
        words = [] if at is None else entry[at + 1 :].split("_")
        values = [float(word) for word in words if _NUMBER.fullmatch(word)]
        if at is None or len(values) != len(words) or len(words) not in (2, 3):
            bad += 1
            continue
        place = (values[1], values[0]) if len(words) == 3 else (values[0], values[1])
        if place in taken or entry[:at] in found or not all(abs(value) <= _FARTHEST for value in place):
            bad += 1
            continue
        found[entry[:at]] = place
        taken.add(place)
    return found, bad


def apart(places: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """The same places, as much farther apart as discs need; what is still on another is left out.

    >>> apart({"a": (0, 0), "b": (0.25, 0), "c": (0.25, 1e-9)})
    {'a': (0.0, 0.0), 'b': (16.0, 0.0)}
    """
    close = [dist(one, two) for one, two in _close(places.values(), DIAMETER)]
    factor = min(DIAMETER / min(close), _FARTHEST_APART) if close else 1.0
    moved = {name: (x * factor, y * factor) for name, (x, y) in places.items()}
    covered = {two for _, two in _close(moved.values(), DIAMETER * (1 - 1e-9))}
    return {name: place for name, place in moved.items() if place not in covered}


def _close(
    places: Iterable[tuple[float, float]], distance: float
) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    """The pairs of places that are closer than that."""
    ordered = sorted(places)
    for number, one in enumerate(ordered):
        for two in islice(ordered, number + 1, None):
            if two[0] - one[0] >= distance:
                break
            if dist(one, two) < distance:
                yield one, two


def layer_pairs(text: str, names: Sequence[str]) -> tuple[Iterator[tuple[int, int]], int]:
    """The connections between layers, and how many entries say nothing: ``L1-L2/…``.

    >>> pairs, bad = layer_pairs("in-out/out-c/x-y", ["in-1", "in-2", "out-1", "c"])
    >>> list(pairs), bad
    ([(0, 2), (1, 2), (2, 3)], 1)
    """
    members: dict[str, list[int]] = {}
    for number, name in enumerate(names):
        for layer in {name, *(name[:at] for at, letter in enumerate(name) if letter == "-" and at)}:
            members.setdefault(layer, []).append(number)
    joined, bad = list[tuple[str, str]](), 0
    for entry in filter(None, text.split("/")):
        splits = [(entry[:at], entry[at + 1 :]) for at, letter in enumerate(entry) if letter == "-"]
        fitting = [split for split in splits if split[0] in members and split[1] in members]
        if len(fitting) == 1:
            joined.append(fitting[0])
        else:
            bad += 1
    pairs = ((source, target) for one, two in joined for source in members[one] for target in members[two])
    return pairs, bad


def identifiers(names: Sequence[str]) -> list[str]:
    """Names that the language allows: ``_`` for each character that it does not, a number where two become one.

    >>> identifiers(["a-b", "a_b", "a b", "1"])
    ['a_b2', 'a_b', 'a_b3', '_1']
    """
    made = [re.sub(r"[^A-Za-z0-9_]", "_", name) for name in names]
    made = [(f"_{name}" if name[:1].isdigit() else name)[:_LONGEST] for name in made]
    kept = {name for name, given in zip(made, names, strict=True) if name == given}
    result, counts = list[str](), dict[str, int]()
    for name, given in zip(made, names, strict=True):
        if name == given:
            result.append(name)
            continue
        while name in kept:
            base = re.sub(r"[^A-Za-z0-9_]", "_", given)
            base = f"_{base}" if base[:1].isdigit() else base
            counts[base] = counts.get(base, 1) + 1
            number = str(counts[base])
            name = base[: _LONGEST - len(number)] + number
        kept.add(name)
        result.append(name)
    return result


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
