"""Networks that announce themselves: which there are, and the spec of one.

In: a Node. Out: a compiled network. A spec from a network is data of somebody else: it may name no file.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from queue import Empty, SimpleQueue
from tempfile import TemporaryDirectory
from typing import NamedTuple

from neurovis_spec import api
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.ros.accept import ARRAY, STRING
from neurovis_spec.ros.middleware import LATCHED, Arrival, MiddlewareError, Node, Tell
from neurovis_spec.runtime.wire import WireError, text_of

#: seconds in which others may announce themselves, too
_OTHERS = 0.5


def compiled_from(text: str, where: str) -> CompiledNetwork:
    """The network of a spec that came from elsewhere, where its body is, too. Raises SpecError."""
    with TemporaryDirectory() as empty:
        return api.compile_text(text, file=f"{where} (spec)", folder=empty, root=empty, body=False)


def specs_of(node: Node) -> tuple[str, ...]:
    """The topics on which networks announce themselves."""
    there = node.topics()
    return tuple(
        topic
        for topic, types in there.items()
        if topic.endswith("/spec")
        and STRING in types
        and ARRAY in there.get(f"{topic.removesuffix('/spec')}/activity", ())
    )


class Others:
    """Says, once each, which other networks announce themselves while this one is ``shown``."""

    def __init__(self, node: Node, shown: str, tell: Tell) -> None:
        self._node, self._tell, self._known = node, tell, {shown}

    def look(self) -> None:
        """Look for new ones, and say so."""
        for topic in specs_of(self._node):
            if topic not in self._known:
                self._known.add(topic)
                name = topic.split("/")[-2]
                self._tell(f"another network announces itself, on {topic}: --network {name} shows it")


class Announced(NamedTuple):
    """A network that has announced itself, and what the names of its topics begin with."""

    compiled: CompiledNetwork
    base: str


def find(node: Node, network: str | None, stopped: Callable[[], bool]) -> Announced | None:
    """The network that announces itself, of this name where there are several; None where it was stopped before.
    Raises MiddlewareError, SpecError."""
    topic = _topic(node, network, stopped)
    if topic is None:
        return None
    came: SimpleQueue[Arrival] = SimpleQueue()
    subscription = node.subscription(topic, STRING, LATCHED, came.put)
    try:
        while not stopped():
            try:
                arrival = came.get(timeout=0.05)
            except Empty:
                continue
            try:
                compiled = compiled_from(text_of(arrival.data, node.encoding), topic)
                return Announced(compiled, topic.removesuffix("/spec"))
            except WireError as error:
                raise MiddlewareError(f"the message on {topic} cannot be read: {error}") from None
    finally:
        subscription.close()
    return None


def _topic(node: Node, network: str | None, stopped: Callable[[], bool]) -> str | None:
    since: float | None = None
    while not stopped():
        found = specs_of(node)
        if network is not None:
            found = tuple(topic for topic in found if topic.split("/")[-2] == network)
        if found:
            since = time.monotonic() if since is None else since
            if len(found) > 1:
                names = ", ".join(sorted({topic.split("/")[-2] for topic in found}))
                raise MiddlewareError(f"several networks announce themselves: {names}", "say which with --network NAME")
            if network is not None or time.monotonic() - since >= _OTHERS:
                return found[0]
        time.sleep(0.05)
    return None
