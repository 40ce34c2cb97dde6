"""The topics of the first NeuroVis: what they say of a network, and the spec that describes the same one.

In: texts and arrays as they come, in any order. Out: names, positions and connections, and the text of a spec that
validates; entries that say nothing, or more than one thing, are left out and counted.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from math import dist, isfinite
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
import yaml

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.drawing.pins import DIAMETER
from neurovis_spec.runtime.wire import Encoding, WireError, array_of, text_of

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
