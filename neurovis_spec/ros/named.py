"""``NS/NET/values``: activities by the names of neurons, for tools that plot curves by name.

In: a node, the names of neurons; activities. Out: messages of ``diagnostic_msgs/DiagnosticArray``, the one standard
message of pairs of a name and a number; none where that package is missing, and none while nobody listens.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.ros.definitions import Definition
from neurovis_spec.ros.diagnostics import TYPE
from neurovis_spec.ros.fields import encode
from neurovis_spec.ros.middleware import MiddlewareError, Node, Publisher, Quality
from neurovis_spec.runtime.wire import Encoding

#: where the stamp of a message is: behind a sequence number, or the four bytes of CDR
_STAMP = 4


@dataclass(frozen=True)
class NamedActivities:
    """Publishes the activities of some neurons."""

    publisher: Publisher
    encoding: Encoding
    #: what a message begins with, up to the pairs
    start: bytes
    neurons: IntArray
    #: the names of these neurons, as the bytes of a message
    keys: tuple[bytes, ...]

    @classmethod
    def of(
        cls, node: Node, topic: str, network: str, names: Sequence[str], wanted: Sequence[int], quality: Quality
    ) -> NamedActivities | None:
        """Of the neurons that are ``wanted``, of a ``network`` whose neurons have these ``names``. None where the
        package of the messages is missing."""
        try:
            definition = Definition.parse(TYPE, node.definition(TYPE))
        except MiddlewareError:
            return None
        status = {"name": network, "values": []}
        start = encode(definition, {"status": [status]}, node.encoding)[:-4] + struct.pack("<I", len(wanted))
        keys = tuple(_string(names[neuron].encode(), node.encoding) for neuron in wanted)
        publisher = node.publisher(topic, TYPE, quality)
        return cls(publisher, node.encoding, start, np.array(wanted, dtype=np.int64), keys)

    def step(self, nanoseconds: int, activity: FloatArray) -> None:
        """Send the activities (neurons,) of a step, if anybody listens."""
        if self.publisher.subscribers:
            self.publisher.publish(self.message(nanoseconds, activity))

    def message(self, nanoseconds: int, activity: FloatArray) -> bytes:
        """The message of a step. What is not finite is ``nan`` or ``inf``: tools leave a gap there."""
        seconds, rest = divmod(nanoseconds, 1_000_000_000)
        data = bytearray(self.start)
        struct.pack_into("<II", data, _STAMP, seconds & 0xFFFFFFFF, rest)
        for key, value in zip(self.keys, activity[self.neurons].tolist(), strict=True):
            data += key
            data += _string(b"%.9g" % value, self.encoding)
        return bytes(data)


def _string(text: bytes, encoding: Encoding) -> bytes:
    """A string of a message in which strings alone follow."""
    if encoding == "ros1":
        return struct.pack("<I", len(text)) + text
    return struct.pack("<I", len(text) + 1) + text + bytes(4 - len(text) % 4)
