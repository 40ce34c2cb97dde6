"""The reception: what a client's message does, however it came.

In: the messages of a client, who is trusted with nothing. Out: the hub and the run are asked; what is refused is told.
"""

from __future__ import annotations

from neurovis_spec.live.hub import Client, Hub
from neurovis_spec.live.protocol import LookAt, Trace, acknowledged, command_of, refused_message
from neurovis_spec.live.run import Run


class Reception:
    """Takes messages, on the event loop of a hub."""

    def __init__(self, hub: Hub, run: Run) -> None:
        self._hub, self._run = hub, run

    def take(self, client: Client, message: bytes | str) -> None:
        """Do what a message asks for. Raises ProtocolError for one that no page of ours sends."""
        if isinstance(message, bytes):
            self._hub.drawn(client, acknowledged(message).serial)
            return
        command = command_of(message)
        if isinstance(command, LookAt):
            self._hub.look_at(client, command.items)
        elif isinstance(command, Trace):
            self._hub.trace(client, command)
        elif client.owner:
            self._run.ask(command, lambda reason: self._hub.refuse(client, reason))
        else:
            client.tell(refused_message("this page only looks on"))
