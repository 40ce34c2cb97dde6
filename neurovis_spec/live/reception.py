"""The reception: what a client's message does, however it came.

In: the messages of a client, who is trusted with nothing. Out: the hub, the run and the desk are asked; what is refused
is told.
"""

from __future__ import annotations

from neurovis_spec.live.desk import Desk
from neurovis_spec.live.hub import Client, Hub
from neurovis_spec.live.protocol import LookAt, Trace, acknowledged, command_of, refused_message
from neurovis_spec.live.requests import Request
from neurovis_spec.live.run import Run


class Reception:
    """Takes messages, on the event loop of a hub."""

    def __init__(self, hub: Hub, run: Run, desk: Desk | None = None) -> None:
        self._hub, self._run, self._desk = hub, run, desk

    def take(self, client: Client, message: bytes | str) -> None:
        """Do what a message asks for. Raises ProtocolError for one that no page of ours sends."""
        if isinstance(message, bytes):
            self._hub.drawn(client, acknowledged(message).serial)
            return
        command = command_of(message)
        if isinstance(command, LookAt):
            self._hub.check(client, command.items)
        elif isinstance(command, Trace):
            self._hub.trace(client, command)
        elif not client.owner:
            client.tell(refused_message("this page only looks on"))
        elif not isinstance(command, Request):
            self._run.ask(command, lambda reason: self._hub.refuse(client, reason))
        elif self._desk is not None:
            self._desk.ask(command, lambda text: self._hub.answer(client, text))
        else:
            client.tell(refused_message("nothing is put by hand or saved here"))
